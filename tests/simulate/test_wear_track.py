"""Wear tracks: an indenter that moves over a body whose film grows, wears and creeps, against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

import jaxcontact as jc

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore:only", "ignore:film strain", "ignore:.*varies with a slope"),
]
STEEL = jc.Elastic(G=80e9, nu=0.3)
ROLLER, LOAD, RADIUS, LENGTH = jc.Cylinder(5e-3, length=1e-3), 20.0, 5e-3, 1e-3
LINE = jc.Grid((80, 1), (2e-6, LENGTH), periodic=(False, True))
# Hertz, (1 - nu^2)/E = (1 - nu)/(2 G)
HALF_WIDTH = np.sqrt(4 * LOAD / LENGTH * RADIUS * 0.7 / (np.pi * 2 * 80e9))
PEAK = 2 * LOAD / LENGTH / (np.pi * HALF_WIDTH)
HOMOGENEOUS = jc.LayeredHalfSpace([jc.Layer(STEEL, 1e-8)], STEEL)
ACROSS = np.linspace(-40e-6, 40e-6, 81)
CROSSED = slice(32, 48)  # cells that the contact has crossed entirely


def passed(law, path, *, body=HOMOGENEOUS, duration=1.0, **options):
    times = np.linspace(0.0, duration, len(path))
    given = {"grid": LINE, "tolerance": 1e-9} | options
    return jc.rub(body, ROLLER, jc.Load(LOAD), times, path=path, law=law, **given)


@pytest.mark.parametrize("passes", [pytest.param(1, marks=pytest.mark.long), 3])
def test_each_pass_wears_coefficient_times_line_load(passes):
    """int p dt = W/(length v) at every cell that is crossed: a depth of coefficient x W/length a pass, and a volume of
    coefficient x load x path, back and forth."""
    legs = [ACROSS if i % 2 == 0 else ACROSS[::-1] for i in range(passes)]
    path = np.concatenate([legs[0], *(leg[1:] for leg in legs[1:])])
    run = passed(jc.Archard(1e-15 / (LOAD / LENGTH)), path)
    worn = np.asarray(run.thickness[0] - run.thickness[-1])[:, 0]
    np.testing.assert_allclose(worn[CROSSED], passes * 1e-15, rtol=1e-3)
    volume = 1e-15 * LENGTH * passes * 80e-6
    assert np.sum(worn) * LINE.cell_area == pytest.approx(volume, rel=1e-6)
    np.testing.assert_allclose(run.position[:, 0], path)
    assert np.all(run.converged)


def test_growth_in_a_pass_is_the_integral_over_the_time_of_passage():
    """int rate exp(-(E - V p(x))/(k T)) dx/v with Hertz's pressure, by quadrature."""
    kT, rate = 1.380649e-23 * 373.0, 1e-12
    volume = 4.0 * kT / PEAK
    run = passed(jc.StressActivated(rate, 0.0, volume, 373.0), ACROSS)
    grown = np.asarray(run.thickness[-1] - run.thickness[0])[CROSSED, 0]
    pressed = lambda s: np.exp(volume * PEAK * np.sqrt(1 - s**2) / kT)
    expected = rate * HALF_WIDTH / 80e-6 * quad(pressed, -1.0, 1.0)[0]
    np.testing.assert_allclose(grown, expected, rtol=0.01)


def test_a_ball_wears_a_groove_of_the_line_integral_of_its_pressure():
    """int p dx = (pi/2) p0 (a^2 - y^2)/a across the track, on a grid that the ball goes around."""
    grid = jc.Grid((32, 20), (4e-6, 4e-6), periodic=(True, False))
    ball, load = jc.Sphere(2e-3), 0.5
    a = (3 * load * 2e-3 * 0.7 / (8 * 80e9)) ** (1 / 3) * 1.0
    peak = 1.5 * load / (np.pi * a**2)
    path = np.linspace(0.0, 128e-6, 129)  # once around
    run = jc.rub(
        HOMOGENEOUS, ball, jc.Load(load), np.linspace(0.0, 1.0, 129), path=path, law=jc.Archard(1e-21), grid=grid,
        save="last",
    )  # fmt: skip
    y = np.asarray(grid.axes()[1])
    groove = 1e-8 - np.asarray(run.thickness).mean(0)
    expected = 1e-21 * np.pi / 2 * peak * np.maximum(a**2 - y**2, 0.0) / a
    np.testing.assert_allclose(groove, expected, atol=0.06 * expected.max())
    assert groove.sum() * 4e-6 == pytest.approx(1e-21 * load, rel=1e-6)
    assert np.ptp(np.asarray(run.thickness), 0).max() < 0.03 * groove.max()


@pytest.mark.long
def test_without_a_law_it_is_a_slide_over_a_film_that_creeps():
    """In the frame of the indenter: the pressure of ``slide``, which convects the history."""
    film = jc.StandardLinearSolid(G1=20e9, G2=10e9, eta2=1e9, nu=0.35)
    body = jc.LayeredHalfSpace([jc.Layer(film, 4e-6)], STEEL)
    times = np.linspace(0.0, 0.4, 81)
    run = passed(None, -20e-6 + 40e-6 * times / 0.4, body=body, duration=0.4)
    slid = jc.slide(body, ROLLER, jc.Load(LOAD), times, velocity=1e-4, grid=LINE, tolerance=1e-9)
    for step in (20, 80):  # moved by whole cells
        cells = round((float(run.position[step, 0]) + 20e-6) / 2e-6) - 10
        moved = np.roll(run.pressure[step], -cells, 0)
        np.testing.assert_allclose(moved, slid.pressure[step], atol=0.01 * float(slid.pressure[step].max()))
    still = slid.pressure[80][::-1]
    assert np.abs(slid.pressure[80] - still).max() > 0.05 * slid.pressure[80].max()
    np.testing.assert_array_equal(run.thickness[-1], run.thickness[0])
    pressed = np.asarray(run.pressure) > 0.0
    assert np.abs(np.asarray(run.gap)[pressed]).max() < 1e-7 * float(run.approach[0])


@pytest.mark.long
def test_a_patchy_film_passes_under_the_indenter():
    """Elastic, around a periodic line: at each place the contact of ``indent`` on the film moved the other way."""
    grid = jc.Grid((64, 1), (2e-6, LENGTH), periodic=True)
    thickness = np.where(np.abs(np.arange(64) - 20) < 6, 2e-6, 0.0)[:, None]
    body = lambda h: jc.LayeredHalfSpace([jc.Layer(jc.Elastic(8e9, 0.35), h)], STEEL)
    path = 2e-6 * np.arange(0, 80, 4)
    run = passed(None, path[:, None] * np.array([1.0, 0.0]), body=body(thickness), grid=grid, substeps=8)
    for step in (0, 9, 18):
        shift = -4 * step
        there = jc.indent(
            body(np.roll(thickness, shift, 0)), ROLLER, jc.Load(LOAD), [0.0], grid=grid, tolerance=1e-9
        )
        moved = np.roll(run.pressure[step], shift, 0)
        np.testing.assert_allclose(moved, there.pressure[0], atol=1e-3 * float(there.pressure.max()))
    assert np.ptp(run.peak_pressure) > 0.1 * run.peak_pressure.max()


@pytest.mark.long
def test_derivatives_of_a_track():
    """Of the depth by coefficient, load and length of the path: both modes, and central differences."""
    film = jc.Maxwell(20e9, 2e10, 0.3)

    def depth(scale):
        body = jc.LayeredHalfSpace([jc.Layer(film, 1e-6)], STEEL)
        law, times = jc.Archard(2e-16 * scale[0]), np.linspace(0.0, 1.0, 6)
        path = scale[2] * np.linspace(0.0, 10e-6, 6)
        run = jc.rub(
            body,
            ROLLER,
            jc.Load(LOAD * scale[1]),
            times,
            path=path,
            law=law,
            grid=LINE,
            tolerance=1e-11,
            thickest=2e-6,
        )
        return jnp.sum((1e-6 - run.thickness[-1]) ** 2) * 1e14

    one = jnp.ones(3)
    forward, reverse, value = jax.jit(jax.jacfwd(depth))(one), jax.jit(jax.jacrev(depth))(one), jax.jit(depth)
    np.testing.assert_allclose(reverse, forward, rtol=1e-7)
    for i, step in enumerate(1e-5 * np.eye(3)):
        difference = (value(one + step) - value(one - step)) / 2e-5
        assert float(forward[i]) == pytest.approx(float(difference), rel=1e-4)


@pytest.mark.filterwarnings("ignore:.*steps, the first")
def test_a_step_that_leaps_says_so():
    run = passed(None, np.array([0.0, 0.3, 0.6]) * HALF_WIDTH)
    assert run.status.tolist() == [0, jc.Status.STEP_TOO_LONG, jc.Status.STEP_TOO_LONG]
    assert any("moves along its path by over a quarter" in note for note in run.notes)


@pytest.mark.filterwarnings("ignore:.*steps, the first")
def test_a_leap_while_the_load_is_lifted_says_so():
    load, path = jc.Load(np.array([LOAD, LOAD, 0.0, 0.0])), np.array([0.0, 0.1, 1.0, 2.0]) * HALF_WIDTH
    run = jc.rub(HOMOGENEOUS, ROLLER, load, np.arange(4.0), path=path, law=jc.Archard(1e-20), grid=LINE)
    assert run.status.tolist() == [0, 0, jc.Status.STEP_TOO_LONG, jc.Status.INHERITED]


@pytest.mark.filterwarnings("ignore:.*steps, the first")
@pytest.mark.long
def test_a_leap_across_a_long_roller_is_measured_by_its_half_width():
    """On a grid in two dimensions as in plane strain; along the roller the contact is long."""
    grid = jc.Grid((32, 4), (4e-6, LENGTH / 4), periodic=(False, True))
    path = np.array([[0.0, 0.0], [0.1, 0.0], [0.6, 0.0], [0.6, 1.0]]) * HALF_WIDTH
    run = jc.rub(
        HOMOGENEOUS, ROLLER, jc.Load(LOAD), np.arange(4.0), path=path, law=jc.Archard(1e-20), grid=grid
    )
    assert run.status.tolist() == [0, 0, jc.Status.STEP_TOO_LONG, jc.Status.INHERITED]
