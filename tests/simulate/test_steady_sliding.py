"""Steady sliding: Hunter's line contact, limits, the speeds of engines, energy, drift, and what is refused."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import exp1, expi
from tolerances import TIGHT_SOLVER

import jaxcontact as jc
from jaxcontact import slide_steady as public_slide_steady
from jaxcontact.contact import nonsymmetric
from jaxcontact.reference import hunter
from jaxcontact.simulate.slide_steady import exponential_integral

GRID = jc.Grid.square(64, 500e-6)
LOAD = jc.Load(60.0)


def slide_steady(body, ball, control=LOAD, *, velocity, grid=GRID, tolerance=1e-10, **more):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return public_slide_steady(
            body, ball, control, velocity=velocity, grid=grid, tolerance=tolerance, **more
        )


def indent(*args, **more):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.indent(*args, **more)


# Hunter's line contact -----------------------------------------------------------------------------------

J0, J1, TAU, NU, RADIUS, HALF_WIDTH = 1.0, 4.0, 1.0, 0.3, 1.0, 0.1
EXAMPLES = [  # speed, load per length, apex/a, friction/(a/R)
    (0.1, 0.008436, 0.3077, 0.47599),
    (0.02, 0.0052309, 0.0755, 0.14232),
    (0.5, 0.018259, 0.5630, 0.65361),
]


def line_contact(speed, half_width=HALF_WIDTH):
    return hunter.of_half_width(half_width, speed, RADIUS, J0, J1, TAU, NU)


@pytest.mark.parametrize("speed, load, apex, friction", EXAMPLES)
def test_hunters_figures_and_his_pressure_carry_the_load(speed, load, apex, friction):
    exact = line_contact(speed)
    found = exact.load, exact.apex / HALF_WIDTH, exact.friction / HALF_WIDTH
    np.testing.assert_allclose(found, (load, apex, friction), rtol=1e-4, atol=5e-5)
    x = -HALF_WIDTH * np.cos(np.linspace(0.0, np.pi, 4001))
    p = exact.pressure(x)
    assert np.min(p) >= 0.0
    np.testing.assert_allclose(np.trapezoid(p, x), exact.load, rtol=1e-5)
    np.testing.assert_allclose(np.trapezoid(p * (exact.apex - x), x) / exact.load, exact.friction, rtol=1e-4)
    again = hunter.of_load(exact.load, speed, RADIUS, J0, J1, TAU, NU)
    np.testing.assert_allclose(again.half_width, HALF_WIDTH, rtol=1e-9)


def sunk(exact, speed, datum):
    """Displacement under the axis by Hunter's pressure, over that at the datum: J0 -ln(r/d) and J1 of its mean over
    exp(-s/tau) along the way r + v s, with E1 and Ei."""
    angle = (np.arange(20000) + 0.5) * np.pi / 20000
    place = exact.apex + HALF_WIDTH * np.cos(angle)
    load = exact.pressure(exact.apex - place) * HALF_WIDTH * np.sin(angle) * np.pi / 20000
    away, behind = np.abs(place), np.abs(place) / (speed * TAU)
    lag = np.where(place < 0.0, np.exp(behind) * exp1(behind), -np.exp(-behind) * expi(behind))
    return -(1.0 - NU) / np.pi * np.sum(load * ((J0 + J1) * np.log(away / datum) + J1 * lag))


@pytest.mark.versions
@pytest.mark.parametrize(
    "speed", [pytest.param(0.1, marks=pytest.mark.slow), 0.02, pytest.param(0.5, marks=pytest.mark.slow)]
)
def test_line_contact_of_a_standard_solid(speed):
    """Under Hunter's load, with 200 of 512 cells or so in contact: edges within a cell, all else within 0.1 %."""
    n, dy, exact = 512, 0.5, line_contact(speed)
    solid = jc.LayeredHalfSpace([], jc.StandardLinearSolid(1.0 / J0, 1.0 / J1, TAU / J1, NU))
    grid = jc.Grid(shape=(n, 1), spacing=(0.36 / n, dy), periodic=(False, True))
    roller, load = jc.Cylinder(RADIUS, dy), jc.Load(exact.load * dy)
    steady = slide_steady(solid, roller, load, velocity=speed, grid=grid, tolerance=1e-9)
    assert int(steady.status) == jc.Status.FINE
    x, dx, p = np.asarray(grid.axes()[0]), float(grid.spacing[0]), np.asarray(steady.pressure)[:, 0]
    touching = x[p > 0.0]
    # the indenter moves in +x over the body: Hunter's picture, mirrored
    assert abs(touching[0] - dx / 2 - (exact.apex - HALF_WIDTH)) < dx
    assert abs(touching[-1] + dx / 2 - (exact.apex + HALF_WIDTH)) < dx
    hunters = exact.pressure(exact.apex - x) * (np.abs(x - exact.apex) < HALF_WIDTH)
    assert np.sum(np.abs(p - hunters)) < 1e-3 * np.sum(p)
    np.testing.assert_allclose(np.max(p), np.max(hunters), rtol=1e-3)
    np.testing.assert_allclose(steady.friction_coefficient, exact.friction, rtol=1e-3)
    np.testing.assert_allclose(steady.power, exact.friction * exact.load * dy * speed, rtol=1e-3)
    np.testing.assert_allclose(steady.approach, sunk(exact, speed, n * dx), rtol=1e-3)


# limits ---------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_infinite_speed_is_the_glassy_film(body, ball, film, steel):
    glass = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(film.G1, film.nu), 150e-9)], steel)
    elastic = indent(glass, ball, LOAD, jnp.zeros(1), grid=GRID, tolerance=1e-12, save="last")
    fast = slide_steady(body, ball, velocity=1e3)
    assert float(jnp.max(jnp.abs(fast.pressure - elastic.pressure)) / jnp.max(elastic.pressure)) < 1e-6
    np.testing.assert_allclose(fast.approach, elastic.approach[-1], rtol=1e-8)


@pytest.mark.slow
def test_at_rest_a_solid_film_is_relaxed(ball, film, steel):
    """Of a film that cannot flow: elastic with J at infinite time."""
    solid = jc.StandardLinearSolid(film.G1, film.G2, film.eta2)
    relaxed = jc.Elastic(1.0 / (1.0 / film.G1 + 1.0 / film.G2))
    on_steel = lambda material: jc.LayeredHalfSpace([jc.Layer(material, 150e-9)], steel)
    grid = jc.Grid.square(64, 700e-6)
    elastic = indent(on_steel(relaxed), ball, LOAD, jnp.zeros(1), grid=grid, tolerance=1e-12, save="last")
    rest = slide_steady(on_steel(solid), ball, velocity=0.0, grid=grid)
    assert float(jnp.max(jnp.abs(rest.pressure - elastic.pressure)) / jnp.max(elastic.pressure)) < 1e-6
    np.testing.assert_allclose(rest.approach, elastic.approach[-1], rtol=1e-6)
    assert float(rest.tangential_force) == 0.0


@pytest.mark.slow
def test_all_speeds_within_400_convolutions(body, ball):
    """1e-9 to 10 m/s. An iteration of BiCGSTAB takes two convolutions, each linear solve two more, the start 50."""
    for speed in 10.0 ** np.arange(-9.0, 2.0):
        grid = jc.Grid.square(64, 800e-6 if speed < 1e-7 else 500e-6)
        found = slide_steady(body, ball, velocity=speed, grid=grid, tolerance=1e-8)
        print(
            f"{speed:.0e} m/s: {int(found.iterations)} iterations, p0 {float(jnp.max(found.pressure)):.4e} Pa"
        )
        assert int(found.status) == 0
        assert 4 * int(found.iterations) + nonsymmetric.COLD_ITERATIONS < 400


@pytest.mark.long
def test_the_slowest_film_on_a_fine_grid_is_solved_too(body, ball):
    """From a cruder start cells deep inside were lost for good here, and 500 iterations did not do."""
    found = slide_steady(body, ball, velocity=1e-9, grid=jc.Grid.square(256, 620e-6), tolerance=1e-8)
    assert int(found.status) == 0 and int(found.iterations) < 60


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.03e-6, 0.1e-6, 0.4e-6, 1.6e-6, 6e-6])
def test_force_times_speed_is_the_power_of_the_dashpots(body, ball, speed):
    found = slide_steady(body, ball, velocity=speed)
    print(f"{speed:.1e}: mu {float(found.friction_coefficient):.3e}, strain {float(found.film_strain):.2f}")
    np.testing.assert_allclose(found.tangential_force * speed, found.power, rtol=1e-2)
    assert float(found.pressure_centre[0]) > 0.0
    # of a paraboloid
    np.testing.assert_allclose(found.tangential_force, 60.0 * found.pressure_centre[0] / 9.525e-3, rtol=1e-9)


@pytest.mark.slow
def test_walls_and_steep_slopes_have_the_force_of_the_power():
    """In linear theory a profile and a load that are four times as large have four times the pressure in the same contact,
    and sixteen times the force: so have cones of slopes 0.5 and 2. The edge of a punch has a force without a slope, that of
    the power over the speed; the note on a slide says that its own force leaves it out."""
    rubber, v = jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=1e9, G2=0.5e9, eta2=0.5e9, nu=0.4)), 2e-5
    grid = jc.Grid.square(32, 128e-6)
    flat, steep = (
        slide_steady(rubber, jc.Cone(np.arctan(1.0 / slope)), jc.Load(0.5 * slope), velocity=v, grid=grid)
        for slope in (0.5, 2.0)
    )
    assert float(flat.tangential_force) > 0.01 * 0.25
    np.testing.assert_allclose(steep.tangential_force, 16.0 * flat.tangential_force, rtol=0.01)
    assert float(steep.hysteresis_power) == pytest.approx(16.0 * float(flat.hysteresis_power), rel=1e-6)
    punch, times = jc.FlatPunch(40e-6), np.linspace(0.0, 3.0, 7)
    moved = slide_steady(rubber, punch, jc.Load(0.2), velocity=v, grid=grid)
    np.testing.assert_allclose(moved.tangential_force * v, moved.hysteresis_power, rtol=1e-9)
    assert float(moved.friction_coefficient) > 0.01
    for velocity, indenter, said in (
        (v, punch, True),
        (v, jc.Cylinder(1e-3, 60e-6), False),
        (0.0, punch, False),
    ):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            slid = jc.slide(rubber, indenter, jc.Load(0.2), times, velocity=velocity, grid=grid)
        assert any("leave out their part" in note for note in slid.notes) == said


def test_directions_mirror_and_agree(body, ball):
    v = 0.4e-6
    x, back, y, diagonal = (
        slide_steady(body, ball, velocity=jnp.asarray(d), tolerance=1e-13)
        for d in ((v, 0.0), (-v, 0.0), (0.0, v), (v / np.sqrt(2.0), v / np.sqrt(2.0)))
    )
    peak = float(jnp.max(x.pressure))
    assert float(jnp.max(jnp.abs(back.pressure[::-1] - x.pressure))) < 1e-10 * peak
    assert float(jnp.max(jnp.abs(y.pressure.T - x.pressure))) < 1e-8 * peak
    np.testing.assert_allclose(jnp.max(diagonal.pressure), peak, rtol=2e-3)
    np.testing.assert_allclose(diagonal.tangential_force, x.tangential_force, rtol=1e-2)
    np.testing.assert_allclose(diagonal.approach, x.approach, rtol=1e-4)


@pytest.mark.slow
def test_window(body, ball):
    """Twice the cells behind and ahead: the peak of the film stays."""
    narrow = slide_steady(body, ball, velocity=0.1e-6)
    wide = slide_steady(body, ball, velocity=0.1e-6, grid=jc.Grid(shape=(128, 64), spacing=GRID.spacing))
    np.testing.assert_allclose(jnp.max(wide.pressure), jnp.max(narrow.pressure), rtol=1e-3)
    np.testing.assert_allclose(wide.approach, narrow.approach, rtol=1e-5)


@pytest.mark.long
def test_half_space_that_flows_drifts(ball, film):
    """The approach after one width of the grid and after two differ by the drift times ln 2."""
    half, speed = jc.LayeredHalfSpace([], film), 1.6e-6
    narrow = slide_steady(half, ball, velocity=speed, grid=jc.Grid.square(64, 4e-3))
    wide = slide_steady(
        half, ball, velocity=speed, grid=jc.Grid(shape=(128, 64), spacing=(4e-3 / 64, 4e-3 / 64))
    )
    drift = (1.0 - film.nu) * 60.0 / film.eta1 / (2.0 * np.pi * speed)
    np.testing.assert_allclose(narrow.approach_drift, drift, rtol=1e-9)
    np.testing.assert_allclose(wide.approach - narrow.approach, drift * np.log(2.0), rtol=2e-2)
    assert float(jnp.max(jnp.abs(wide.pressure[32:96] - narrow.pressure)) / jnp.max(narrow.pressure)) < 1e-3


def test_exponential_integral():
    """Against int_x^inf exp(-t)/t dt by Gauss quadrature in log t."""
    q, w = np.polynomial.legendre.leggauss(400)
    for x in (1e-9, 1e-3, 1.4999, 1.5, 20.0):
        s = (q + 1.0) / 2.0 * np.log1p(60.0 / x)
        exact = np.sum(w * np.exp(-x * np.exp(s))) / 2.0 * np.log1p(60.0 / x)
        np.testing.assert_allclose(exponential_integral(jnp.asarray(x)), exact, rtol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("speed", [pytest.param(3.2e-8, marks=pytest.mark.long), 1e-7])
def test_a_half_space_that_relaxes_as_the_contact_passes(ball, film, speed):
    """The operator is far from symmetric; the sets of active cells alone cycle for ever. Also (vx, vy) as a tuple."""
    for material in (film, jc.StandardLinearSolid(film.G1, film.G2, film.eta2)):
        half, grid = jc.LayeredHalfSpace([], material), jc.Grid.square(64, 6e-3)
        found = slide_steady(half, ball, velocity=(speed, 0.0), grid=grid, tolerance=1e-8)
        assert int(found.status) == 0 and int(found.iterations) < 200
        p, g = np.asarray(found.pressure), np.asarray(found.gap)
        assert np.max(np.abs(g[p > 0.0])) < 1e-7 * float(found.approach)
        assert np.min(g) > -1e-7 * float(found.approach)
        np.testing.assert_allclose(np.sum(p) * float(grid.cell_area), 60.0, rtol=1e-9)


@pytest.mark.slow
def test_no_steady_state(body, ball, film):
    half = jc.LayeredHalfSpace([], film)
    held = lambda depth: slide_steady(half, ball, jc.Approach(depth), velocity=1e-6).status
    at_rest = lambda speed: slide_steady(body, ball, velocity=speed).status
    assert int(jax.jit(held)(2e-6)) == int(jax.jit(at_rest)(0.0)) == 6  # where values are unknown
    with pytest.raises(ValueError, match=r"at rest .* no steady state"):
        jc.slide_steady(body, ball, LOAD, velocity=0.0, grid=GRID)
    with pytest.raises(ValueError, match="fixed approach the load decreases to zero"):
        jc.slide_steady(half, ball, jc.Approach(2e-6), velocity=1e-6, grid=GRID)
    with pytest.raises(ValueError, match="expected one number in the steady state"):
        jc.slide_steady(body, ball, jc.Load(jnp.ones(3)), velocity=1e-6, grid=GRID)
    with pytest.raises(ValueError, match=r"velocity: expected a number or shape \(2,\)"):
        jc.slide_steady(body, ball, LOAD, velocity=jnp.ones(3), grid=GRID)


@pytest.mark.slow
def test_a_held_approach_gives_back_its_load(body, ball):
    pressed = slide_steady(body, ball, velocity=0.4e-6, tolerance=TIGHT_SOLVER)
    held = slide_steady(body, ball, jc.Approach(pressed.approach), velocity=0.4e-6, tolerance=TIGHT_SOLVER)
    np.testing.assert_allclose(held.load, 60.0, rtol=1e-6)
    np.testing.assert_allclose(held.tangential_force, pressed.tangential_force, rtol=1e-4)


def solid(x):
    """A standard solid as half-space on 16 x 16 cells, in units of order one."""
    half = jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=x[0], G2=0.5 * x[1], eta2=x[2]))
    found = slide_steady(
        half,
        jc.Sphere(10.0 * x[3]),
        jc.Load(0.05 * x[4]),
        velocity=0.3 * x[5],
        grid=jc.Grid.square(16, 3.0),
        tolerance=1e-13,
    )
    return jnp.sum(found.pressure**2) + found.approach + 10.0 * (found.tangential_force + found.power)


@pytest.mark.long
def test_derivatives_reverse_forward_and_central():
    """Along one direction in all six parameters."""
    x, direction = jnp.ones(6), jnp.asarray([0.5, -0.3, 0.7, 0.4, -0.6, 0.8])
    gradient = jax.jit(jax.grad(solid))(x)
    forward = jax.jit(lambda d: jax.jvp(solid, (x,), (d,))[1])
    np.testing.assert_allclose(gradient @ direction, forward(direction), rtol=1e-8)
    plain, h = jax.jit(solid), 1e-5
    central = (plain(x + h * direction) - plain(x - h * direction)) / (2.0 * h)
    np.testing.assert_allclose(forward(direction), central, rtol=1e-5)
    assert abs(float(gradient[5])) > 1e-3 * float(jnp.max(jnp.abs(gradient)))  # the speed matters
