"""What is written for ParaView, read by VTK's own reader: every point has the values of its cell."""

import numpy as np
import pytest
from test_storage import GRID, NT, NX, NY, made_up

import jaxcontact as jc

# half a gigabyte on disk, so that .ci/run installs it for this file alone
vtk_reader = pytest.importorskip("vtkmodules.vtkIOXML", reason="VTK's reader is the package vtk")
pytestmark = pytest.mark.slow


def read(path):
    """The grid in a .vtr file, as VTK reads it."""
    reader = vtk_reader.vtkXMLRectilinearGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    assert reader.GetErrorCode() == 0
    return reader.GetOutput()


def collection(path):
    """(time, file) of what a .pvd file names, as VTK reads XML."""
    from vtkmodules.vtkIOXMLParser import vtkXMLUtilities

    (whole,) = [vtkXMLUtilities.ReadElementFromFile(str(path)).FindNestedElementWithName("Collection")]
    sets = [whole.GetNestedElement(i) for i in range(whole.GetNumberOfNestedElements())]
    return [(float(one.GetAttribute("timestep")), path.parent / one.GetAttribute("file")) for one in sets]


def at(grid, name, place):
    """A point field at the point nearest to a place, which VTK finds."""
    values = grid.GetPointData().GetArray(name)
    return np.array(values.GetTuple(grid.FindPoint(place)))


@pytest.mark.parametrize("last", [False, True])
def test_every_time_is_a_map_with_the_values_of_each_cell_at_its_place(last, tmp_path):
    history = made_up(jc.ContactHistory, last)
    files = collection(jc.write_result(history, tmp_path / "press.pvd"))
    times = history.times[-1:] if last else history.times
    np.testing.assert_allclose([time for time, _ in files], times, rtol=1e-15)
    x, y = GRID.axes()
    for step, (_, file) in enumerate(files):
        grid = read(file)
        assert grid.GetNumberOfPoints() == NX * NY
        for i, j in np.ndindex(NX, NY):
            place = (x[i], y[j], 0.0)
            where = (i, j) if last else (step, i, j)
            assert at(grid, "pressure [Pa]", place) == history.pressure[where]
            assert at(grid, "gap [m]", place) == pytest.approx(history.gap[where], rel=1e-14)
        load = grid.GetFieldData().GetArray("load [N]").GetValue(0)
        assert load == history.load[NT - 1 if last else step]


def test_tractions_are_vectors_in_the_surface(tmp_path):
    sheared = made_up(jc.ShearHistory)
    (_, file), *_ = collection(jc.write_result(sheared, tmp_path / "shear.pvd"))
    x, y = GRID.axes()
    expected = [*sheared.traction[0, :, 4, 1], 0.0]
    np.testing.assert_array_equal(at(read(file), "traction [Pa]", (x[4], y[1], 0.0)), expected)


def test_stresses_below_the_surface_are_tensors_in_a_volume(tmp_path):
    inside = made_up(jc.InteriorFields)
    ((_, file),) = collection(jc.write_result(inside, tmp_path / "below.pvd"))
    grid, (x, y) = read(file), GRID.axes()
    assert grid.GetDimensions() == (NX, NY, 2)
    place = (x[5], y[2], inside.depths[1])
    np.testing.assert_array_equal(at(grid, "stress [Pa]", place), inside.stress[1, :, :, 5, 2].ravel())
    np.testing.assert_array_equal(at(grid, "displacement [m]", place), inside.displacement[1, :, 5, 2])
    expected = float(inside.von_mises[1, 5, 2])
    assert at(grid, "von_mises [Pa]", place) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("kind", [jc.SteadySliding, jc.SteadyRolling])
def test_a_steady_state_is_one_time(kind, tmp_path):
    steady = made_up(kind)
    ((time, file),) = collection(jc.write_result(steady, tmp_path / "steady.pvd"))
    x, y = GRID.axes()
    assert time == 0.0 and at(read(file), "pressure [Pa]", (x[1], y[3], 0.0)) == steady.pressure[1, 3]
