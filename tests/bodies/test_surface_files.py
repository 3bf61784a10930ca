"""Instrument files of surfaces, written here by hand or by the library that reads them."""

import sys

import numpy as np
import pytest

import jaxcontact as jc

HEIGHTS = np.random.RandomState(3).standard_normal((6, 4))  # nm
RULER = jc.Grid((6, 4), (2e-6, 3e-6))


def matrix(folder, head="# Width: 12 um\n# Height: 12 um\n# Value units: nm\n", heights=HEIGHTS):
    """The plain text that many instruments export: a head, and a line of heights along x for each y."""
    path = folder / "scan.asc"
    path.write_text(head + "".join(" ".join(f"{value:.9f}" for value in row) + "\n" for row in heights.T))
    return path


# of the library's reader of NetCDF
pytestmark = pytest.mark.filterwarnings("ignore:Cannot close a netcdf_file", "ignore:unclosed file")


def library():
    return pytest.importorskip("SurfaceTopography", reason="needs jaxcontact[surfaces]")


@pytest.mark.slow
def test_heights_and_cells_come_in_metres(tmp_path):
    """12 um over 6 points and over 4 points, heights in nm."""
    library()
    heights, grid = jc.read_surface(matrix(tmp_path))
    np.testing.assert_allclose(heights, HEIGHTS * 1e-9, atol=1e-18)
    assert grid.shape == (6, 4) and grid.periodic == (False, False)
    np.testing.assert_allclose(grid.spacing, (2e-6, 3e-6), rtol=1e-12)
    assert jc.read_surface(matrix(tmp_path), grid=RULER).grid is RULER


def test_a_file_that_says_so_is_periodic(tmp_path):
    topography = library().Topography(HEIGHTS, (12.0, 12.0), unit="µm", periodic=True)
    topography.to_netcdf(tmp_path / "scan.nc")
    heights, grid = jc.read_surface(tmp_path / "scan.nc")
    np.testing.assert_allclose(heights, HEIGHTS * 1e-6, rtol=1e-12)
    assert grid.periodic == (True, True)


def holes(folder):
    return matrix(folder, heights=np.where(np.abs(HEIGHTS) < 0.1, np.nan, HEIGHTS))


def line(folder):
    library().UniformLineScan(HEIGHTS[:, 0], 12.0, unit="nm").to_netcdf(folder / "scan.nc")
    return folder / "scan.nc"


def prose(folder):
    (folder / "scan.txt").write_text("not a surface")
    return folder / "scan.txt"


MISTAKES = {
    "points without a height": (
        lambda folder: jc.read_surface(holes(folder)),
        rf"expected a height at every point, got {np.sum(np.abs(HEIGHTS) < 0.1)} of 24 without",
    ),
    "a line": (lambda folder: jc.read_surface(line(folder)), r"got a line of 6 points: width= \[m\]"),
    "a width of a map": (
        lambda folder: jc.read_surface(matrix(folder), width=1e-6),
        "width: expected none for a map",
    ),
    "too many holes": (
        lambda folder: jc.read_surface(
            matrix(folder, heights=np.where(HEIGHTS < 1.0, np.nan, HEIGHTS)), fill=True
        ),
        "at most half of them can be filled",
    ),
    "a second unit": (
        lambda folder: jc.read_surface(matrix(folder), unit="um"),
        "unit: expected none for a file that states its unit, 'nm', got 'um'",
    ),
    "no unit": (
        lambda folder: jc.read_surface(matrix(folder, "# Width: 12\n# Height: 12\n")),
        "expected a unit of its lengths, got none: give unit=|could not be extracted",
    ),
    "no size": (lambda folder: jc.read_surface(matrix(folder, "")), "could not be extracted"),
    "another kind of file": (
        lambda folder: jc.read_surface(prose(folder)),
        "expected a surface that SurfaceTopography reads",
    ),
    "a grid of another shape": (
        lambda folder: jc.read_surface(matrix(folder), grid=jc.Grid((6, 6), RULER.spacing)),
        r"expected \(6, 6\) heights, got \(6, 4\)",
    ),
    "a grid of other cells": (
        lambda folder: jc.read_surface(matrix(folder), grid=jc.Grid((6, 4), (2e-6, 2e-6))),
        r"expected cells of \(2e-06, 2e-06\) m, got \(2e-06, 3e-06\) m",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_file_that_is_no_surface_is_refused_with_what_was_expected_and_what_came(name, tmp_path):
    library()
    mistake, words = MISTAKES[name]
    with pytest.raises(ValueError, match=words) as caught:
        mistake(tmp_path)
    assert str(caught.value).startswith(str(tmp_path / "scan")) and "\n" not in str(caught.value)


def test_without_the_library_the_extra_is_named(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    with pytest.raises(ImportError, match=r"pip install 'jaxcontact\[surfaces\]'"):
        jc.read_surface(matrix(tmp_path))


def test_no_file_is_an_error_of_the_system(tmp_path):
    library()
    with pytest.raises(FileNotFoundError):
        jc.read_surface(tmp_path / "none.x3p")


def test_a_scan_of_pixels_of_two_nanometres_is_not_that_of_cells_of_eight(tmp_path):
    """The difference of 6 nm was within numpy's default of 1e-8, in metres."""
    path = matrix(tmp_path, "# Width: 12\n# Height: 12\n# Value units: nm\n".replace("12\n", "12 nm\n"))
    own = jc.read_surface(path).grid
    np.testing.assert_allclose(own.spacing, (2e-9, 3e-9), rtol=1e-9)
    with pytest.raises(ValueError, match="expected cells of"):
        jc.read_surface(path, grid=jc.Grid(own.shape, (8e-9, 8e-9)))


def test_a_unit_is_given_where_a_file_has_none(tmp_path):
    library()
    heights, grid = jc.read_surface(matrix(tmp_path, "# Width: 12\n# Height: 12\n"), unit="um")
    np.testing.assert_allclose(heights, HEIGHTS * 1e-6, rtol=1e-6)
    np.testing.assert_allclose(grid.spacing, (2e-6, 3e-6), rtol=1e-12)


@pytest.mark.slow
def test_missing_points_are_filled_on_request(tmp_path):
    """A plane satisfies Laplace's equation: every hole off the edges gets its height back."""
    library()
    x, y = np.meshgrid(np.arange(9.0), np.arange(7.0), indexing="ij")
    plane = 3.0 * x - 2.0 * y + 5.0
    holed = plane.copy()
    holed[2:5, 2:4] = holed[6, 5] = np.nan
    path = matrix(tmp_path, "# Width: 9 um\n# Height: 7 um\n# Value units: nm\n", holed)
    np.testing.assert_allclose(jc.read_surface(path, fill=True).heights, plane * 1e-9, rtol=1e-6)


def test_a_line_scan_is_a_surface_of_constant_height_along_y(tmp_path):
    library()
    heights, grid = jc.read_surface(line(tmp_path), width=5e-6)
    np.testing.assert_allclose(heights, HEIGHTS[:, :1] * 1e-9, rtol=1e-6)
    assert grid.shape == (6, 1) and grid.periodic == (False, True)
    np.testing.assert_allclose(grid.spacing, (2e-9, 5e-6), rtol=1e-9)
