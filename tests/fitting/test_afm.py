"""Force curves of microscopes: written by afmformats from a known curve, read back as load and depth."""

import importlib

import numpy as np
import pytest

import fitting

K = 0.05  # cantilever [N/m]
T = np.linspace(0.0, 6.0, 301)
DEPTH = np.interp(T, [0, 2, 3, 5, 6], [-4e-6, 0.0, 1e-6, 1.2e-6, -4e-6])
LOAD = 1e-9 * np.interp(T, [0, 2, 3, 5, 5.3, 6], [0, 0, 10, 10, 0, 0])
MARKS = np.digitize(T, [3.0, 5.0])
HEIGHT = 6e-5 - DEPTH - LOAD / K  # of the base of the cantilever, smaller nearer to the sample


def curve(path, number=0, **changes):
    """An HDF5 file, or another curve in it."""
    afmformats = pytest.importorskip("afmformats", reason="afmformats, the extra afm, is not installed")
    h5py = pytest.importorskip("h5py")
    data = {
        "force": LOAD,
        "height (measured)": HEIGHT,
        "time": T,
        "segment": MARKS.astype(np.uint8),
    } | changes
    about = {
        "path": path,
        "enum": number,
        "imaging mode": "force-distance",
        "spring constant": K,
        "point count": T.size,
    }
    force_curve = afmformats.AFMForceDistance(
        {key: value for key, value in data.items() if value is not None}, about
    )
    with h5py.File(path, "a") as file:
        force_curve.export_data(file, fmt="hdf5")
    return path


def test_depth_is_the_way_of_the_base_less_the_deflection(tmp_path):
    data = fitting.read_indentation(curve(tmp_path / "gel.h5"))
    np.testing.assert_allclose(data.t, T)
    np.testing.assert_allclose(data.load, LOAD, atol=1e-15)
    np.testing.assert_allclose(data.depth - data.depth[0], DEPTH - DEPTH[0], atol=1e-12)
    assert [(data.marks == name).sum() for name in ("approach", "hold", "retract")] == np.bincount(
        MARKS
    ).tolist()
    held = fitting.read_indentation(tmp_path / "gel.h5", segment=("approach", "hold")).in_contact()
    assert held.depth.max() == pytest.approx(1.2e-6, rel=0.05)


def test_a_tip_position_is_taken_as_it_is(tmp_path):
    data = fitting.read_indentation(curve(tmp_path / "gel.h5", **{"tip position": -DEPTH}))
    np.testing.assert_allclose(data.depth, DEPTH)


def test_one_of_several_curves(tmp_path):
    path = curve(curve(tmp_path / "map.h5"), number=1, force=2 * LOAD, **{"tip position": -DEPTH})
    with pytest.raises(ValueError, match="got 2: choose with curve= from 0 to 1"):
        fitting.read_indentation(path)
    np.testing.assert_allclose(fitting.read_indentation(path, curve=1).load, 2 * LOAD)
    with pytest.raises(ValueError, match="curve: expected 0 to 1, got 7"):
        fitting.read_indentation(path, curve=7)


def test_a_curve_without_times_is_refused(tmp_path):
    with pytest.raises(ValueError, match="expected times"):
        fitting.read_indentation(curve(tmp_path / "gel.h5", time=None))


def test_what_is_no_force_curve_is_one_line(tmp_path):
    pytest.importorskip("afmformats", reason="afmformats, the extra afm, is not installed")
    (tmp_path / "gel.jpk-force").write_text("no force curve")
    with pytest.raises(ValueError, match="afmformats cannot read it") as error:
        fitting.read_indentation(tmp_path / "gel.jpk-force")
    assert "\n" not in str(error.value)


def test_without_the_library_it_says_what_to_install(tmp_path, monkeypatch):
    def missing(name):
        raise ImportError(name)

    (tmp_path / "gel.jpk-force").write_bytes(b"PK")
    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(ImportError, match=r"pip install 'jaxcontact\[afm\]'"):
        fitting.read_indentation(tmp_path / "gel.jpk-force")
    with pytest.raises(ValueError, match="cannot be read"):
        fitting.read_indentation(tmp_path / "none.jpk-force")
