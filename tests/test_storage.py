"""Results in files: what is saved comes back, with names and units that others can read."""

import dataclasses
import sys
import tomllib
from pathlib import Path

import jax
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.files import storage

pytestmark = pytest.mark.versions

NT, NX, NY = 3, 6, 5
SIZES = {"time": NT, "x": NX, "y": NY, "direction": 2}
GRID = jc.Grid(shape=(NX, NY), spacing=(2e-6, 3e-6))


def made_up(kind, last=False):
    """A result with every field a different number, as ``save="last"`` has them when last."""
    values = {}
    for i, field in enumerate(dataclasses.fields(kind)):
        if field.name in storage.NOT_STORED:
            continue
        dims = storage.FIELDS[field.name][0]
        if kind is jc.SteadySliding or (last and "x" in dims):
            dims = tuple(name for name in dims if name != "time")
        shape = tuple(SIZES[name] for name in dims)
        values[field.name] = 1e-6 * (i + np.arange(np.prod(shape, dtype=int)).reshape(shape))
    saved = {} if kind is jc.SteadySliding else {"saved": None}
    return kind(**values, **saved, grid=GRID)


def assert_same(a, b):
    assert type(a) is type(b)
    for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True):
        np.testing.assert_allclose(x, y, rtol=1e-14)
    assert a.grid.shape == b.grid.shape


@pytest.mark.parametrize("ending", [".npz", ".nc"])
@pytest.mark.parametrize("kind", [jc.ContactHistory, jc.SlidingHistory, jc.SteadySliding])
def test_what_is_saved_comes_back(kind, ending, tmp_path):
    if ending == ".nc":
        pytest.importorskip("h5netcdf", reason="NetCDF is the extra jaxcontact[io]")
    for last in (False, True):
        result = made_up(kind, last)
        path = jc.save(result, tmp_path / f"result{ending}")
        assert_same(result, jc.load(path))
    assert [path.name for path in tmp_path.iterdir()] == [f"result{ending}"]


def test_every_field_of_every_result_can_be_stored():
    for kind in storage.KINDS.values():
        names = {field.name for field in dataclasses.fields(kind)}
        assert names <= set(storage.FIELDS) | set(storage.NOT_STORED), kind


def test_netcdf_has_named_dimensions_units_and_the_case(tmp_path, body, ball):
    xarray = pytest.importorskip("xarray", reason="NetCDF is the extra jaxcontact[io]")
    result = made_up(jc.ContactHistory)
    path = jc.save(result, tmp_path / "a.nc", body=body, indenter=ball, control=jc.Load(60.0), note="mine")
    with xarray.open_dataset(path, engine="h5netcdf", decode_times=False) as file:
        assert file["pressure"].dims == ("time", "y", "x")
        np.testing.assert_array_equal(file["pressure"].transpose("time", "x", "y"), result.pressure)
        units = {name: file[name].attrs["units"] for name in ("pressure", "approach", "load", "x", "time")}
        assert units == {"pressure": "Pa", "approach": "m", "load": "N", "x": "m", "time": "s"}
        assert all(
            "units" in values.attrs and "long_name" in values.attrs for values in file.variables.values()
        )
        np.testing.assert_allclose(file["x"], GRID.axes()[0])
        assert file.attrs["body.layers.0.material"] == "Burgers"
        assert float(file.attrs["body.layers.0.material.eta2"]) == 120.9e9
        assert float(file.attrs["indenter.radius"]) == 9.525e-3
        assert float(file.attrs["control.value"]) == 60.0
        assert file.attrs["note"] == "mine"


def test_without_the_extra_the_error_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5netcdf", None)
    with pytest.raises(ImportError, match=r"pip install 'jaxcontact\[io\]'.*npz"):
        jc.save(made_up(jc.ContactHistory), tmp_path / "a.nc")
    assert not list(tmp_path.iterdir())


def test_a_save_that_fails_leaves_the_file_as_it_was(tmp_path, monkeypatch):
    path = jc.save(made_up(jc.ContactHistory), tmp_path / "a.npz")
    before = path.read_bytes()
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError("full")))
    with pytest.raises(OSError, match="full"):
        jc.save(made_up(jc.ContactHistory, last=True), path)
    assert path.read_bytes() == before


def test_the_extra_is_named_in_the_project():
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    assert {"xarray", "h5netcdf"} <= {name.split(">")[0] for name in project["optional-dependencies"]["io"]}
