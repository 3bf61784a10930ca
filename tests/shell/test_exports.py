"""Every quantity that follows from a result's fields is in every export: tables, labelled arrays, files."""

import inspect
import re

import numpy as np
import pytest
from test_storage import made_up

import jaxcontact as jc
from jaxcontact._support import fields
from jaxcontact.results import storage

WORDS = {"notes"}  # in the attributes, see test_notes.py
PLACES = {"peak"}  # the largest of the von Mises stresses, which are exported, and its place on the axes
MAPS = {
    "gap",
    "in_contact",
    "von_mises",
    "traction",
}  # follow from fields of the same size: not stored a second time beside these


def derived(kind):
    """The names of all public properties of a kind of result that are quantities."""
    found = {name for name, _ in inspect.getmembers(kind, lambda member: isinstance(member, property))}
    return {name for name in found if not name.startswith("_")} - WORDS - PLACES


KINDS = pytest.mark.parametrize("kind", storage.result_classes().values(), ids=storage.result_classes())


@KINDS
def test_every_property_has_a_unit_and_a_meaning(kind):
    assert derived(kind) <= set(fields.fields_of(fields.stored_fields(kind)))
    assert derived(kind) == set(fields.derived_of(made_up(kind)))


@KINDS
def test_labelled_arrays_have_them(kind):
    pytest.importorskip("xarray")
    result = made_up(kind)
    labelled = result.to_xarray()
    for name in derived(kind):
        np.testing.assert_array_equal(labelled[name], getattr(result, name))
        assert set(labelled[name].attrs) >= {"units", "long_name"}


@pytest.mark.parametrize("kind", [jc.ContactHistory, jc.ShearHistory, jc.SlidingHistory, jc.RubbingHistory])
def test_tables_have_them(kind):
    pytest.importorskip("pandas")
    result = made_up(kind)
    columns = {name.split(" ")[0]: values for name, values in result.to_dataframe().items()}
    for name in derived(kind) - MAPS:
        np.testing.assert_array_equal(columns[name], getattr(result, name))


@KINDS
@pytest.mark.parametrize("ending", [".npz", ".nc"])
def test_files_have_them(kind, ending, tmp_path):
    result = made_up(kind)
    xarray = pytest.importorskip("xarray", reason="NetCDF is the extra jaxcontact[io]")
    path = jc.write_result(result, tmp_path / f"a{ending}")
    read = np.load if ending == ".npz" else lambda path: xarray.open_dataset(path, decode_times=False)
    with read(path) as file:
        for name in derived(kind) - MAPS:
            np.testing.assert_array_equal(file[name], getattr(result, name))


@KINDS
def test_paraview_has_them(kind, tmp_path):
    path = jc.write_result(made_up(kind), tmp_path / "film.pvd")
    text = next(iter(path.with_suffix("").glob("*_0.vtr"))).read_text()
    assert derived(kind) <= {name.split(" ")[0] for name in re.findall(r'Name="([^"]+)"', text)}


@KINDS
def test_paraview_and_netcdf_have_every_stored_map_at_every_time(kind, tmp_path):
    result = made_up(kind)
    known = fields.fields_of(fields.stored_fields(kind))
    maps = {name for name in fields.stored_fields(kind) if known[name].is_map}
    pieces = sorted(jc.write_result(result, tmp_path / "film.pvd").with_suffix("").glob("*.vtr"))
    assert len(pieces) == (len(result.times) if storage.has_times(kind) else 1)
    for piece in pieces:
        assert maps <= {name.split(" ")[0] for name in re.findall(r'Name="([^"]+)"', piece.read_text())}
    xarray = pytest.importorskip("xarray", reason="NetCDF is the extra jaxcontact[io]")
    with xarray.open_dataset(jc.write_result(result, tmp_path / "a.nc"), decode_times=False) as file:
        for name in maps:
            assert file[name].attrs["units"] == known[name].symbol
            values = file[name].transpose(..., "x", "y").to_numpy()
            np.testing.assert_array_equal(values, getattr(result, name))


def test_their_values_are_those_of_the_fields():
    """By hand, with numpy, from fields that are all different."""
    made = made_up(jc.SlidingHistory)
    table = fields.derived_of(made)
    np.testing.assert_array_equal(table["peak_pressure"], [p.max() for p in made.pressure])
    np.testing.assert_allclose(table["contact_radius"], np.sqrt(made.smooth_area / np.pi), rtol=1e-14)
    np.testing.assert_allclose(table["friction_coefficient"], made.tangential_force / made.load, rtol=1e-14)
    gap = [made.profile + u - d for u, d in zip(made.displacement, made.approach, strict=True)]
    np.testing.assert_allclose(table["gap"], gap, rtol=1e-14)
    steady = made_up(jc.SteadyRolling)
    table = fields.derived_of(steady)
    assert table["peak_pressure"] == steady.pressure.max()
    np.testing.assert_allclose(table["gap"], steady.profile + steady.displacement - steady.approach)
    np.testing.assert_allclose(table["sticking_share"], np.sum(steady.stick) / np.sum(steady.pressure > 0.0))
    last = fields.derived_of(made_up(jc.ContactHistory, last=True))
    assert "peak_pressure" not in last and last["gap"].ndim == 2


@pytest.mark.slow
def test_the_gap_of_steady_rolling_closes_in_the_contact():
    """Unlike solids, so that tractions along the surface move it across as well."""
    rubber, steel = jc.Elastic(1e6, nu=0.3), jc.Elastic.from_young(210e9, nu=0.3)
    rolling = jc.roll_steady(
        jc.LayeredHalfSpace([], rubber), jc.Sphere(5e-3, steel), jc.Load(1e-2), velocity=1.0,
        creepage=(1e-2, 0.0), friction=0.3, grid=jc.Grid.square(n=24, width=0.8e-3), tolerance=1e-6,
    )  # fmt: skip
    assert bool(rolling.converged) and rolling.sticking_share < 1.0
    gap = np.asarray(rolling.gap) / float(rolling.approach)
    np.testing.assert_allclose(gap[rolling.pressure > 0.0], 0.0, atol=1e-4)
    assert gap.min() > -1e-4 and gap.max() > 0.1
