"""Statistics of contacts against closed forms and a map drawn by hand."""

from types import SimpleNamespace

import jax
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.results.figures import is_round

MODULUS = 1e9  # E*
SOLID = jc.LayeredHalfSpace([], jc.Elastic(G=MODULUS / 4.0, nu=0.5))

PATCHES = """
#..#..
....##
##..#.
.#....
#..#.#
"""


def drawn(picture, periodic):
    """A contact drawn by hand, a line for each x."""
    pressure = np.array([[float(cell == "#") for cell in line] for line in picture.split()])
    grid = jc.Grid(pressure.shape, (2e-6, 3e-6), periodic)
    shown = {"pressure": pressure, "in_contact": pressure > 0.0, "gap": 1.0 - pressure}
    return SimpleNamespace(**shown, grid=grid, status=np.array(0))


@pytest.mark.parametrize(
    "periodic, cells",
    [
        (False, [3, 3, 1, 1, 1, 1, 1]),
        ((True, False), [3, 3, 2, 2, 1]),
        ((False, True), [3, 3, 2, 1, 1, 1]),
        (True, [3, 3, 3, 2]),
    ],
)
def test_patches_are_joined_by_the_sides_of_cells_across_periodic_edges_too_and_by_no_corner(periodic, cells):
    contact = drawn(PATCHES, periodic)
    clusters = jc.contact_clusters(contact)
    assert clusters.count == len(cells)
    np.testing.assert_allclose(clusters.areas, 6e-12 * np.array(cells))
    labels = clusters.labels
    np.testing.assert_array_equal(labels > 0, contact.pressure > 0.0)
    assert labels[1, 4] == labels[1, 5] == labels[2, 4] != labels[2, 0] == labels[2, 1] == labels[3, 1]
    assert (labels[0, 0] == labels[4, 0]) == (periodic in (True, (True, False)))
    assert (labels[4, 0] == labels[4, 5]) == (periodic in (True, (False, True)))


def test_no_contact_has_no_patches():
    clusters = jc.contact_clusters(drawn("....\n....\n....\n....", True))
    assert clusters.count == 0 and not np.any(clusters.labels)


@pytest.mark.parametrize("periodic, sides", [(False, (2, 4)), (True, (4, 4))])
def test_the_rim_is_pi_over_4_of_the_sides_and_a_free_edge_is_none(periodic, sides):
    """Two by two cells at an edge across y: two sides of 2 um along x, two more if it is periodic; four of 3 um along y."""
    found = jc.contact_statistics(drawn("......\n##....\n##....\n......", periodic))
    np.testing.assert_allclose(found.perimeter, np.pi / 4.0 * (sides[0] * 2e-6 + sides[1] * 3e-6))
    np.testing.assert_allclose(found.area_fraction, 4 / 24)
    excess = (np.pi - 1.0 + np.log(2.0)) / 24.0 * sum(sides) / 24
    np.testing.assert_allclose(found.corrected_fraction, 4 / 24 - excess)


@pytest.mark.slow
def test_the_area_of_hertz_is_met_over_twice_as_closely_without_the_error_of_the_rim():
    """Balls of 11 to 21 cells across, in the mean over 31 loads: pi a^2, and 2 pi a for the rim."""
    n, side, radius = 24, 1e-6, 1e-3
    a = np.linspace(5.4e-6, 10.4e-6, 31)
    load = 4.0 * MODULUS * a**3 / (3.0 * radius)
    grid = jc.Grid.square(n, n * side)
    history = jc.indent(SOLID, jc.Sphere(radius), jc.Load(load), np.arange(31.0), grid=grid)
    found, exact = jc.contact_statistics(history), np.pi * a**2 / (n * side) ** 2
    counted, corrected = (
        np.mean(np.asarray(fraction) / exact - 1.0)
        for fraction in (found.area_fraction, found.corrected_fraction)
    )
    assert abs(corrected) < counted / 2.5 and counted > 0.02
    np.testing.assert_allclose(np.mean(np.asarray(found.perimeter) / (2.0 * np.pi * a)), 1.0, atol=0.03)
    np.testing.assert_allclose(found.mean_pressure, load / (n * side) ** 2, rtol=1e-9)


# a wave ----------------------------------------------------------------------------------------------------------

# of the pressure that flattens the wave
LENGTH, AMPLITUDE, SHARES = (
    1e-3,
    1e-6,
    np.array([0.05, 0.2, 0.5, 0.9]),
)
FULL = np.pi * MODULUS * AMPLITUDE / LENGTH


@pytest.fixture(scope="module")
def wave():
    grid = jc.Grid(shape=(256, 4), spacing=(LENGTH / 256, LENGTH / 64), periodic=True)
    x, y = grid.coordinates()
    heights = jc.HeightField(AMPLITUDE * np.cos(2.0 * np.pi * np.asarray(x) / LENGTH) + 0.0 * np.asarray(y))
    load = jc.Load(SHARES * FULL * float(grid.width[0] * grid.width[1]))
    return jc.indent(SOLID, heights, load, np.arange(4.0), grid=grid, tolerance=1e-10)


@pytest.mark.slow
def test_a_wave_has_the_area_and_the_mean_gap_of_westergaard(wave):
    """With s = p/p*: area (2/pi) asin(sqrt s), gap/amplitude 1 - s + s ln s. The gap is the integral of the stiffness of
    collinear contacts, d gap/dp = (length/(pi E*)) ln s. K. L. Johnson, Contact Mechanics (1985), section 13.2."""
    found = jc.contact_statistics(wave)
    np.testing.assert_allclose(found.mean_pressure, SHARES * FULL, rtol=1e-9)
    area = 2.0 / np.pi * np.arcsin(np.sqrt(SHARES))
    np.testing.assert_allclose(found.area_fraction, area, atol=2.0 / 256)  # a cell at either end
    gap = AMPLITUDE * (1.0 - SHARES + SHARES * np.log(SHARES))
    np.testing.assert_allclose(found.mean_gap, gap, atol=2e-4 * AMPLITUDE)
    assert [jc.contact_clusters(wave, step).count for step in range(4)] == [1, 1, 1, 1]


@pytest.mark.parametrize("bins", [20, 80])
def test_the_pressures_of_a_contact_sum_to_its_area_and_to_its_load(wave, bins):
    """Integrals of the density: exactly the area, and the mean pressure to half a bin of what is in contact."""
    spread, found = jc.pressure_histogram(wave, bins=bins), jc.contact_statistics(wave)
    widths, middles = np.diff(spread.edges), (spread.edges[1:] + spread.edges[:-1]) / 2.0
    np.testing.assert_allclose(spread.density @ widths, found.area_fraction, rtol=1e-12)
    moment = spread.density @ (widths * middles)
    assert np.all(np.abs(moment - found.mean_pressure) <= widths[0] / 2.0 * found.area_fraction)


def test_the_pressures_of_a_wave_are_spread_as_those_of_westergaard(wave):
    """In quarters of the peak: the share of x with p between two values, from p = 2 p' cos sqrt(s - sin^2)/s at s."""
    s, last = SHARES[2], wave.pressure[2]
    x = (np.arange(100000) + 0.5) / 100000 * np.pi / 2.0
    exact = 2.0 * FULL * np.cos(x) * np.sqrt(np.maximum(s - np.sin(x) ** 2, 0.0))
    one = SimpleNamespace(pressure=last, in_contact=last > 0.0, gap=wave.gap[2], grid=wave.grid)
    spread = jc.pressure_histogram(one, bins=4)
    shares = np.histogram(exact, spread.edges, weights=(exact > 0.0) / exact.size)[0]
    np.testing.assert_allclose(spread.density * np.diff(spread.edges), shares, atol=2.0 / 256)


@pytest.mark.slow
def test_the_mean_gap_has_a_derivative_and_the_statistics_of_a_last_field_no_time(wave):
    """d gap/d load of a wave under half the full pressure, (amplitude/p*) ln s over the nominal area."""
    grid = wave.grid
    area = float(grid.width[0] * grid.width[1])

    def gap(load):
        heights = jc.HeightField(-wave.profile)
        history = jc.indent(SOLID, heights, jc.Load(load), [0.0], grid=grid, save="last", tolerance=1e-10)
        return jc.contact_statistics(history).mean_gap

    slope = jax.jit(jax.grad(gap))(0.5 * FULL * area)
    np.testing.assert_allclose(slope, AMPLITUDE / FULL * np.log(0.5) / area, rtol=1e-2)


# pictures --------------------------------------------------------------------------------------------------------


def test_what_is_round_is_drawn_by_its_profiles_and_all_else_by_maps():
    grid = jc.Grid((24, 20), (1e-6, 1e-6))
    one_of = lambda indenter: SimpleNamespace(profile=indenter.profile(grid), grid=grid)
    for indenter in (jc.Sphere(1e-3), jc.FlatPunch(5e-6)):
        assert is_round(one_of(indenter))
    x, y = (np.asarray(axis) for axis in grid.coordinates())
    for heights in (-(x**2) + 0.0 * y, -(x**2) - 2.0 * y**2, np.cos(3e5 * x) + 0.0 * y):
        assert not is_round(one_of(jc.HeightField(heights)))


def test_a_rough_contact_is_drawn_with_its_maps_and_statistics(wave):
    """The contact as it is; area over mean pressure in MPa; the histogram's steps enclose the area of the last time."""
    figure = wave.plot()
    by_label = {ax.get_xlabel(): ax for ax in figure.axes if ax.get_xlabel()}
    assert [ax.get_title() for ax in figure.axes[:2]] == ["pressure at 3 s", "gap at 3 s"]
    drawn = figure.axes[2].collections[0].get_array().reshape(4, 256).T
    np.testing.assert_array_equal(drawn > 0, wave.pressure[-1] > 0.0)
    line = by_label["mean pressure [MPa]"].lines[0]
    np.testing.assert_allclose(line.get_xdata(), SHARES * FULL / 1e6, rtol=1e-9)
    np.testing.assert_allclose(line.get_ydata(), np.mean(wave.pressure > 0.0, (1, 2)), rtol=1e-12)
    values, edges, _ = by_label["pressure [MPa]"].patches[-1].get_data()
    np.testing.assert_allclose(np.sum(values * np.diff(edges)), np.mean(wave.pressure[-1] > 0.0), rtol=1e-9)


@pytest.mark.slow
def test_statistics_with_adhesion_count_cells_that_are_pulled_as_well():
    """Contact is where the gap is zero, as in ``contact_area``; pressures and tensions sum to the load."""
    gel, grid = jc.LayeredHalfSpace([], jc.Elastic(G=1e3, nu=0.5)), jc.Grid.square(n=40, width=1.4e-3)
    adhesion = jc.ExponentialAdhesion(work=10e-3, range=25e-6)
    load = jc.Load(np.array([0.0, 2e-5]))
    history = jc.indent(gel, jc.Sphere(1e-3), load, [0.0, 1.0], grid=grid, adhesion=adhesion)
    nominal, statistics = grid.width[0] * grid.width[1], jc.contact_statistics(history)
    np.testing.assert_allclose(statistics.area_fraction * nominal, history.contact_area, rtol=1e-12)
    np.testing.assert_allclose(jc.contact_clusters(history).areas.sum(), history.contact_area[-1], rtol=1e-12)
    assert np.any(np.asarray(history.in_contact & (history.pressure < 0.0)))
    histogram = jc.pressure_histogram(history, bins=400)
    edges = np.asarray(histogram.edges)
    found = np.asarray(histogram.density) @ (np.diff(edges) * (edges[1:] + edges[:-1]) / 2.0)
    np.testing.assert_allclose(found, [0.0, 2e-5 / nominal], atol=0.5 * np.diff(edges)[0])
