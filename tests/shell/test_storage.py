"""Results in files: what is saved comes back, with names and units that others can read."""

import dataclasses
import io
import sys
import tomllib
import tracemalloc
import zipfile
from pathlib import Path

import jax
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact._support import fields
from jaxcontact.results import storage

pytestmark = pytest.mark.versions

NT, NX, NY = 3, 6, 5
SIZES = {"time": NT, "x": NX, "y": NY, "direction": 2, "depth": 2, "row": 3, "column": 3, "component": 3}
SIZES["interface"] = 2
GRID = jc.Grid(shape=(NX, NY), spacing=(2e-6, 3e-6))


def made_up(kind, last=False, grid=GRID):
    """A result with every field a different number, as ``save="last"`` has them when last."""
    values, sizes = {}, SIZES | dict(zip("xy", grid.shape, strict=True))
    known = fields.fields_of(fields.stored_fields(kind))
    for i, field in enumerate(dataclasses.fields(kind)):
        if field.name in fields.NOT_STORED:
            continue
        dims = known[field.name].dimensions
        if not storage.has_times(kind) or (last and "x" in dims):
            dims = tuple(name for name in dims if name != "time")
        shape = tuple(sizes[name] for name in dims)
        values[field.name] = 1e-6 * (i + np.arange(np.prod(shape, dtype=int)).reshape(shape))
    saved = {"saved": None} if "saved" in {field.name for field in dataclasses.fields(kind)} else {}
    return kind(**values, **saved, grid=grid)


def assert_same(a, b):
    assert type(a) is type(b)
    for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True):
        np.testing.assert_allclose(x, y, rtol=1e-14)
    assert a.grid.shape == b.grid.shape and a.grid.periodic == b.grid.periodic


@pytest.mark.parametrize("ending", [".npz", ".nc"])
@pytest.mark.parametrize("kind", storage.result_classes().values(), ids=storage.result_classes())
def test_what_is_saved_comes_back(kind, ending, tmp_path):
    if ending == ".nc":
        pytest.importorskip("h5netcdf", reason="NetCDF is the extra jaxcontact[io]")
    for last in (False, True):
        result = made_up(kind, last)
        path = jc.write_result(result, tmp_path / f"result{ending}")
        assert_same(result, jc.read_result(path))
    for shape, periodic in (((NX, NY), True), ((NX, 1), (False, True))):
        result = made_up(kind, grid=jc.Grid(shape, GRID.spacing, periodic))
        assert_same(result, jc.read_result(jc.write_result(result, path)))
    assert [path.name for path in tmp_path.iterdir()] == [f"result{ending}"]


def test_every_field_of_every_result_can_be_stored():
    for kind in storage.result_classes().values():
        names = {field.name for field in dataclasses.fields(kind)}
        assert names <= set(fields.fields_of(names)) | set(fields.NOT_STORED), kind


def test_netcdf_has_named_dimensions_units_and_the_case(tmp_path, body, ball):
    xarray = pytest.importorskip("xarray", reason="NetCDF is the extra jaxcontact[io]")
    result = made_up(jc.ContactHistory)
    path = jc.write_result(
        result, tmp_path / "a.nc", body=body, indenter=ball, control=jc.Load(60.0), note="mine"
    )
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
        assert int(file.attrs["body.layers.0.bonded"]) == 1
        assert float(file.attrs["body.layers.0.material.eta2"]) == 120.9e9
        assert float(file.attrs["indenter.radius"]) == 9.525e-3
        assert float(file.attrs["control.value"]) == 60.0
        assert file.attrs["note"] == "mine"


def test_without_the_extra_the_error_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5netcdf", None)
    with pytest.raises(ImportError, match=r"pip install 'jaxcontact\[io\]'.*npz"):
        jc.write_result(made_up(jc.ContactHistory), tmp_path / "a.nc")
    assert not list(tmp_path.iterdir())


def test_a_save_that_fails_leaves_the_file_as_it_was(tmp_path, monkeypatch):
    path = jc.write_result(made_up(jc.ContactHistory), tmp_path / "a.npz")
    before = path.read_bytes()
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError("full")))
    with pytest.raises(OSError, match="full"):
        jc.write_result(made_up(jc.ContactHistory, last=True), path)
    assert path.read_bytes() == before


def claimed_npy(shape):
    """The head of a .npy file of float64, and a hundred bytes."""
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return file.getvalue() + bytes(100)


def npy(values):
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


FORGED = {
    "745 GiB that are not there": ({"pressure": claimed_npy((10**11,))}, "not an npz file"),
    "no bytes at all": ({"pressure": b""}, "not an npz file"),
    "text for numbers": ({"load": npy(np.array(["ten"]))}, "load: found <U3, accepted: real numbers"),
    "one load of three": ({"load": npy(np.zeros(1))}, r"load: found shape \(1,\), accepted: \(3,\)"),
    "one cell": (
        {"x": npy(np.zeros(1))},
        "x: found an array of shape \\(1,\\), accepted: two or more equally spaced cell centres",
    ),
    "cells beyond all bounds": (
        {"y": npy(np.array([-1e308, 1e308, 1.1e308, 1.2e308, 1.3e308]))},
        "y: found an array",
    ),
    "half a periodic grid": (
        {"grid_periodic": npy(np.array([1, 1]))},
        "grid_periodic, grid_spacing: expected",
    ),
    "a time that is none": ({"times": npy(np.array([0.0, np.nan, 1.0]))}, "times: found an array"),
    "time that runs backwards": ({"times": npy(np.array([0.0, 2.0, 1.0]))}, "times: found an array"),
}


@pytest.mark.parametrize("name", FORGED)
def test_a_file_that_is_not_what_it_claims_is_refused(name, tmp_path):
    members, words = FORGED[name]
    path = jc.write_result(made_up(jc.ContactHistory), tmp_path / "a.npz")
    with zipfile.ZipFile(path) as archive:
        own = {info.filename.removesuffix(".npy"): archive.read(info) for info in archive.infolist()}
    with zipfile.ZipFile(path, "w") as archive:
        for member, content in (own | members).items():
            archive.writestr(f"{member}.npy", content)
    with pytest.raises(ValueError, match=words) as caught:
        jc.read_result(path)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("directory", [False, True], ids=["head", "head and directory"])
def test_memory_is_not_set_aside_for_what_an_archive_only_claims(directory, tmp_path):
    """Three gigabytes in the array's head, and in the archive's directory, and a hundred bytes in the file."""
    path, head = tmp_path / "a.npz", claimed_npy((375_000_000,))
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("times.npy", head)
    if directory:
        content = bytearray(path.read_bytes())
        size = content.rindex(b"PK\x01\x02") + 24  # where it has the size of a member
        content[size : size + 4] = (3_000_000_000 + len(head) - 100).to_bytes(4, "little")
        path.write_bytes(content)
    tracemalloc.start()
    with pytest.raises(ValueError, match="not an npz file"):
        jc.read_result(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1e8


@pytest.mark.parametrize("ending", [".npz", ".nc"])
def test_a_file_that_was_cut_off_is_refused_wherever_it_was_cut(ending, tmp_path):
    if ending == ".nc":
        pytest.importorskip("h5netcdf", reason="NetCDF is the extra jaxcontact[io]")
    path = jc.write_result(made_up(jc.ContactHistory), tmp_path / f"a{ending}")
    whole = path.read_bytes()
    for length in range(0, len(whole), len(whole) // 7):
        path.write_bytes(whole[:length])
        with pytest.raises(ValueError, match="accepted: a file written by jaxcontact"):
            jc.read_result(path)


def test_a_result_of_vmap_is_not_saved_as_what_nobody_could_load(tmp_path):
    result = made_up(jc.ContactHistory)
    batch = jax.tree.map(lambda leaf: np.stack([leaf, leaf]), result)
    with pytest.raises(ValueError, match="times: found an array of shape"):
        jc.write_result(dataclasses.replace(batch, grid=result.grid), tmp_path / "a.npz")
    assert not list(tmp_path.iterdir())


def test_stresses_below_the_surface_have_a_depth_that_points_down(tmp_path):
    xarray = pytest.importorskip("xarray", reason="NetCDF is the extra jaxcontact[io]")
    inside = made_up(jc.InteriorFields)
    with xarray.open_dataset(jc.write_result(inside, tmp_path / "inside.nc"), engine="h5netcdf") as file:
        assert file["stress"].dims == ("depth", "row", "column", "y", "x")
        np.testing.assert_array_equal(file["stress"].values[1, 0, 2], inside.stress[1, 0, 2].T)
        assert file["depth"].attrs["positive"] == "down" and file["stress"].attrs["units"] == "Pa"
    np.testing.assert_allclose(jc.read_result(tmp_path / "inside.nc").von_mises, inside.von_mises)


@pytest.mark.parametrize("kind", storage.result_classes().values(), ids=storage.result_classes())
def test_every_stored_result_can_be_drawn(kind, tmp_path):
    path = jc.write_result(made_up(kind), tmp_path / "a.npz")
    assert main(["plot", str(path)]) == 0
    assert (tmp_path / "a.png").stat().st_size > 5000


def test_equal_results_give_equal_files(tmp_path):
    a, b = (jc.write_result(made_up(jc.ContactHistory), tmp_path / f"{name}.npz") for name in "ab")
    assert a.read_bytes() == b.read_bytes()


def test_the_extra_is_named_in_the_project():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    assert {"xarray", "h5netcdf"} <= {name.split(">")[0] for name in project["optional-dependencies"]["io"]}


NOTES = {
    "body": jc.LayeredHalfSpace([], jc.Elastic(G=1e9, nu=0.3)),
    "note": "a text",
    "number": 2.5,
    "list": [1.0, 2],
}
"""What a user may write beside a result."""


@pytest.mark.parametrize("ending", [".npz", ".nc", ".pvd"])
@pytest.mark.parametrize("kind", storage.result_classes().values(), ids=storage.result_classes())
def test_no_name_of_a_case_changes_what_is_loaded(kind, ending, tmp_path):
    """Every name that a file has in it, read from the file itself: refused before writing, or beside the result."""
    if ending == ".nc":
        pytest.importorskip("h5netcdf", reason="NetCDF is the extra jaxcontact[io]")
    result = made_up(kind, grid=jc.Grid((NX, NY), GRID.spacing, periodic=True))
    with np.load(jc.write_result(result, tmp_path / "plain.npz")) as file:
        names = {*file.files, "time", "depth", "grid", "saved", *dir(kind)}
    names = {name for name in names if not name.startswith("_")} - {"path", "result"}
    path, taken = tmp_path / f"result{ending}", set()
    for name in sorted(names):
        try:
            jc.write_result(result, tmp_path / "probe.npz", **{name: NOTES["body"]})
        except ValueError:
            taken.add(name)
    for name in taken:
        with pytest.raises(ValueError, match=f"^{name}: expected another name"):
            jc.write_result(result, path, **{name: 1.0})
    assert not path.exists()
    jc.write_result(result, path, **dict.fromkeys(names - taken, NOTES["body"]))
    if ending != ".pvd":
        assert_same(result, jc.read_result(path))
    assert {"x", "y", "kind", "status_names", *fields.stored_fields(kind)} <= taken
    assert (
        kind in (jc.InteriorFields, jc.Deflection)
        or {"pressure", "load", "profile", "approach", "status"} <= taken
    )


@pytest.mark.parametrize("ending", [".npz", ".nc"])
@pytest.mark.parametrize("kind", [jc.ContactHistory, jc.InteriorFields])  # with times and without
def test_what_is_written_beside_a_result_comes_back(kind, ending, tmp_path):
    if ending == ".nc":
        pytest.importorskip("h5netcdf", reason="NetCDF is the extra jaxcontact[io]")
    result = made_up(kind)
    path = jc.write_result(result, tmp_path / f"result{ending}", **NOTES)
    assert_same(result, jc.read_result(path))
    if ending == ".nc":
        import xarray

        with xarray.open_dataset(path, engine="h5netcdf", decode_times=False) as file:
            found = dict(file.attrs)
    else:
        with np.load(path) as file:
            found = {name: file[name] for name in file.files}
    assert (str(found["note"]), float(found["number"]), list(found["list"])) == ("a text", 2.5, [1.0, 2.0])
    assert str(found["body.substrate"]) == "Elastic" and float(found["body.substrate.nu"]) == 0.3


@pytest.mark.parametrize("ending", [".npz", ".nc"])
@pytest.mark.parametrize(
    ("case", "told"),
    [
        (
            {"made": __import__("datetime").date(2020, 1, 1)},
            "made: expected numbers, text or objects of jaxcontact",
        ),
        ({"some": {"set": {1}}}, "some.set: expected numbers"),
        ({"raw": b"bytes"}, "raw: expected numbers"),
        ({"a": {"b": 1.0}, "a.b": 2.0}, "a.b: expected each name once"),
    ],
    ids=["date", "set", "bytes", "twice"],
)
def test_what_cannot_be_read_again_is_not_written(case, told, ending, tmp_path):
    with pytest.raises(ValueError, match=told):
        jc.write_result(made_up(jc.ContactHistory), tmp_path / f"a{ending}", **case)
    assert not list(tmp_path.iterdir())


def test_a_netcdf_file_names_the_version_and_has_no_internal_numbers_among_its_attributes(tmp_path):
    """The numbers that the notes are formed from are attributes of a variable of their own, and are read from there."""
    xarray = pytest.importorskip("xarray")
    body, grid = jc.LayeredHalfSpace([], jc.Elastic(30e9)), jc.Grid.square(16, 3e-4)
    history = jc.indent(body, jc.Sphere(5e-3), jc.Load(20.0), [0.0], grid=grid)
    jc.write_result(history, tmp_path / "a.nc", note="mine")
    with xarray.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as file:
        assert set(file.attrs) == {"Conventions", "source", "kind", "notes", "note"}
        assert file.attrs["source"] == history.to_xarray().attrs["source"] == f"jaxcontact {jc.__version__}"
        assert float(file["diagnostics"].attrs["ball_radius"]) == 5e-3
    assert float(jc.read_result(tmp_path / "a.nc").diagnostics.ball_radius) == 5e-3
