"""Elastic contact: Hertz, punches, optimality, units, both controls, all kinds of grids."""

import dataclasses
import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tolerances import APPROACH, PEAK, SOLVER

import jaxcontact as jc
from jaxcontact.contact import implicit, normal
from jaxcontact.operators.operator import Family
from jaxcontact.response.coefficients import influence_coefficients
from jaxcontact.response.images import Images

NOW = np.zeros(1)
GLASS = jc.Elastic(G=30e9, nu=0.25)
HERTZ_RADIUS = (3 * 20.0 * 5e-3 * 0.75 / 30e9 / 8) ** (1 / 3)
N = 48  # cells a side where their number does not matter: one program serves many tests


def square(contact_radii):
    """A grid as wide as so many of Hertz's radii."""
    return jc.Grid.square(N, contact_radii * HERTZ_RADIUS)


def half_space(material=GLASS):
    return jc.LayeredHalfSpace([], material)


def press(control, grid, indenter=None, body=None, **options):
    indenter = jc.Sphere(5e-3) if indenter is None else indenter
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.indent(half_space() if body is None else body, indenter, control, NOW, grid=grid, **options)


@pytest.mark.versions
@pytest.mark.parametrize("shape", [pytest.param((101, 101), marks=pytest.mark.slow), (96, 130)])
def test_hertz(shape):
    """a^3 = 3 W R (1 - nu)/(8 G), approach a^2/R, p0 = 3 W/(2 pi a^2) on an odd and on a rectangular grid."""
    a = HERTZ_RADIUS
    grid = jc.Grid(shape=shape, spacing=(2.6 * a / shape[0], 2.6 * a / shape[1]))
    result = press(jc.Load(20.0), grid)
    assert float(result.approach[0]) == pytest.approx(a**2 / 5e-3, rel=APPROACH)
    assert float(result.contact_radius[0]) == pytest.approx(a, rel=1e-2)
    assert float(result.smooth_area[0]) == pytest.approx(np.pi * a**2, rel=2e-3)
    x, y = grid.coordinates()
    r2 = np.asarray(x**2 + y**2)
    expected = 3 * 20.0 / (2 * np.pi * a**2) * np.sqrt(np.maximum(1 - r2 / a**2, 0.0))
    # the rim's cells are cut by the contact's edge: compare in the mean over the load
    difference = np.sum(np.abs(np.asarray(result.pressure[0]) - expected)) / np.sum(expected)
    assert difference < 5e-3
    inside = r2 < (0.5 * a) ** 2
    np.testing.assert_allclose(np.asarray(result.pressure[0])[inside], expected[inside], rtol=PEAK)


@pytest.mark.slow
def test_elastic_ball_adds_its_compliance():
    result = press(jc.Load(20.0), jc.Grid.square(64, 3.2 * HERTZ_RADIUS), jc.Sphere(5e-3, GLASS))
    a = HERTZ_RADIUS * 2 ** (1 / 3)
    assert float(result.approach[0]) == pytest.approx(a**2 / 5e-3, rel=APPROACH)


@pytest.mark.slow
def test_flat_punch():
    """approach = (1 - nu) W/(4 G a); the punch's cells make its area."""
    a = 1e-3
    result = press(jc.Load(500.0), jc.Grid.square(129, 2.2 * a), jc.FlatPunch(a))
    assert float(result.approach[0]) == pytest.approx(0.75 / 30e9 * 500.0 / (4 * a), rel=5e-3)
    assert float(result.contact_radius[0]) == pytest.approx(a, rel=5e-3)


@pytest.mark.slow
def test_cone():
    """W = 2 E*/pi tan(angle) d^2, a = 2 d tan(angle)/pi, p(r) = E*/(2 tan(angle)) arccosh(a/r); E* = 2 G/(1 - nu)."""
    angle, depth, E = np.radians(75.0), 1e-6, 2 * 30e9 / 0.75
    a = 2 * depth * np.tan(angle) / np.pi
    grid = jc.Grid.square(96, 2.6 * a)
    result = press(jc.Approach(depth), grid, jc.Cone(angle))
    assert float(result.load[0]) == pytest.approx(2 * E / np.pi * np.tan(angle) * depth**2, rel=2e-3)
    x, y = (np.asarray(c) for c in grid.coordinates())
    r = np.hypot(x, y)
    away = (r > 0.2 * a) & (r < 0.9 * a)
    exact = E / (2 * np.tan(angle)) * np.arccosh(a / r[away])
    # the pressure is infinite at the tip; a fifth of a away from it, at seven cells, the error is below 2 %
    np.testing.assert_allclose(np.asarray(result.pressure[0])[away], exact, rtol=2e-2)


@pytest.mark.slow
def test_long_cylinder_has_the_line_contacts_width_and_pressure_in_its_middle():
    """a^2 = 2 P' R A/pi, p0 = 2 P'/(pi a) with A = (1 - nu)/G, ten half-widths from the ends."""
    length, a, R = 20e-3, 5e-4, 1e-2
    A = 0.75 / 30e9
    per_length = np.pi * a**2 / (2 * R * A)
    grid = jc.Grid(shape=(65, 129), spacing=(3.0 * a / 65, 1.1 * length / 129))
    result = press(jc.Load(per_length * length), grid, jc.Cylinder(R, length))
    middle = result.pressure[0, :, 64]
    # the ends take more than their share: compare with the load that the middle carries
    carried = float(jnp.sum(middle) * grid.spacing[0])
    a = np.sqrt(2 * carried * R * A / np.pi)
    assert 0.85 * per_length < carried < per_length
    assert float(jnp.max(middle)) == pytest.approx(2 * carried / (np.pi * a), rel=1e-2)
    assert float(jnp.sum(middle > 0) * grid.spacing[0]) == pytest.approx(2 * a, rel=0.05)


@pytest.mark.long
def test_pressure_at_a_sharp_edge_grows_as_one_over_the_root_of_the_cell():
    """Of a flat strip of width 2 a, p = P'/(pi sqrt(a^2 - x^2)): K. L. Johnson, Contact Mechanics (1985), section 2.8."""
    a, width, edges = 1e-4, 1e-3, []
    for n in (64, 256):
        h = 2.0 * a / n
        grid = jc.Grid((n, 1), (h, width), periodic=(False, True))
        pressure = press(jc.Load(10.0 * width), grid, jc.HeightField(np.zeros((n, 1)))).pressure[0, :, 0]
        sides = np.linspace(-1.0, 1.0, n + 1)
        mean = 10.0 / (np.pi * h) * np.diff(np.arcsin(sides))  # over a cell
        inside = slice(n // 4, -n // 4)
        np.testing.assert_allclose(pressure[inside], mean[inside], rtol=0.01)
        edges.append(float(pressure[0]))
    assert edges[1] / edges[0] == pytest.approx(2.0, rel=0.01)


@pytest.mark.slow
@pytest.mark.versions
def test_solution_is_optimal_to_the_stated_tolerance():
    """p >= 0, g >= 0, p g = 0 and the load, checked on the fields themselves."""
    rng = np.random.default_rng(3)
    grid = jc.Grid(shape=(48, 40), spacing=(1e-6, 1.1e-6))
    heights = jnp.asarray(rng.standard_normal(grid.shape)) * 3e-9 - (lambda x, y: (x**2 + y**2) / 4e-4)(
        *grid.coordinates()
    )
    result = press(jc.Load(0.02), grid, jc.HeightField(heights), tolerance=1e-10)
    p, g = result.pressure[0], result.gap[0]
    depth = float(result.approach[0])
    assert bool(result.converged[0]) and float(jnp.min(p)) == 0.0
    assert float(jnp.min(g)) > -1e-9 * depth
    assert float(jnp.sum(p * jnp.abs(g)) / jnp.sum(p)) < 1e-9 * depth
    assert float(jnp.sum(p) * grid.cell_area) == pytest.approx(0.02, rel=1e-12)
    assert 20 < int(jnp.sum(p > 0)) < p.size / 2


def problem_at(lowest, load, grid=(80, 40), curvature=0.02):
    """Paraboloids with their lowest points at the given cells, on a half-space, in units of the cell."""
    x, y = np.meshgrid(*map(np.arange, grid), indexing="ij")
    gap = np.min([curvature / 2 * ((x - a) ** 2 + (y - b) ** 2) for a, b in lowest], 0)
    kernel = influence_coefficients(jc.Grid(grid, (1.0, 1.0)), Images(jnp.zeros(0), jnp.ones(1)))
    operator = Family.of(kernel[None]).combined([1.0])
    return normal.Problem(operator, jnp.asarray(gap), jnp.asarray(load), jnp.zeros(()), load_controlled=True)


@jax.jit
def solved(problem):
    """The pressure, and its derivative by the load."""
    start, options = jnp.zeros(problem.gap.shape), (jnp.asarray(1e-12), jnp.asarray(500))
    pressure = lambda load: (
        implicit.solve_contact(dataclasses.replace(problem, target=load), start, *options).pressure
    )
    return jax.jvp(pressure, (problem.target,), (jnp.ones(()),))


ONE, TWO = [(9.3, 29.0)], [(5.0, 6.0), (75.0, 34.0)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lowest", "load"), [pytest.param(ONE, 4.0, marks=pytest.mark.long), (TWO, 4.0), ([(40.0, 20.0)], 120.0)]
)
def test_the_window_changes_nothing_but_the_cost(lowest, load):
    """A contact off the middle, two that no window holds, one that outgrows it: solution and tangent."""
    problem = problem_at(lowest, load)
    plain = dataclasses.replace(problem, operator=dataclasses.replace(problem.operator, window=None))
    for found, expected in zip(solved(problem), solved(plain), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-8 * float(jnp.max(expected)))


@pytest.mark.slow
def test_a_contact_that_fits_the_window_is_solved_there():
    problem = problem_at(ONE, 4.0)
    start = normal.first_guess(problem)
    shape = problem.operator.window_shape(start.shape)
    p, taken = normal._search_in_window(problem, shape, start, jnp.asarray(1e-10), jnp.asarray(500))
    assert 3 < int(taken) < 30
    inverse = problem.operator.preconditioner_on_contact()
    on_grid = normal._search(problem, inverse, p, problem.operator(p), jnp.asarray(1e-10), jnp.asarray(0))
    assert float(on_grid.error) < 1.01e-10


@pytest.mark.parametrize("shape", [(8, 6), (6, 7), (7, 6), (5, 5), (8, 1)])
def test_compliance_of_a_cell_is_its_entry_of_the_dense_product(shape):
    """Displacement of a cell under its own unit pressure; the kernel is not a smooth one, whose short waves are weak."""
    i, j = np.meshgrid(*map(np.arange, shape), indexing="ij")
    coefficients, units = 2.0 * (i + j == 0) + 0.3 * (i + j == 1), np.eye(i.size).reshape(-1, *shape)

    @jax.jit
    def products_and_compliance(coefficients):
        operator = Family.of(coefficients[None]).combined([1.0])
        return jax.vmap(operator)(units), operator.cell_compliance(shape)

    dense, found = products_and_compliance(coefficients)
    np.testing.assert_allclose(found, np.mean(np.diag(dense.reshape(i.size, i.size))), rtol=1e-14)


@pytest.mark.slow
def test_height_field_of_a_ball_is_the_ball():
    grid = square(2.6)
    x, y = grid.coordinates()
    field = press(jc.Load(20.0), grid, jc.HeightField(-(x**2 + y**2) / 1e-2))
    ball = press(jc.Load(20.0), grid)
    np.testing.assert_allclose(field.pressure, ball.pressure, atol=SOLVER * float(jnp.max(ball.pressure)))


@pytest.mark.slow
def test_load_and_approach_control_are_inverse():
    grid = square(2.6)
    by_load = press(jc.Load(20.0), grid, tolerance=1e-11)
    by_approach = press(jc.Approach(by_load.approach[0]), grid, tolerance=1e-11)
    assert float(by_approach.load[0]) == pytest.approx(20.0, rel=1e-9)
    assert bool(by_approach.converged[0])


@pytest.mark.slow
def test_no_contact_and_zero_load():
    grid = jc.Grid.square(N, 1e-4)
    result = press(jc.Approach(-1e-6), grid)
    assert float(result.load[0]) == 0.0 and int(result.status[0]) == 0
    times = np.array([0.0, 1.0])
    lifted = jc.indent(half_space(), jc.Sphere(5e-3), jc.Load(jnp.array([0.05, 0.0])), times, grid=grid)
    assert float(jnp.max(lifted.pressure[1])) == 0.0
    # an elastic body springs back, and the approach counts from first touch
    assert float(lifted.approach[1]) == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("control", [pytest.param(jc.Load(20.0), marks=pytest.mark.long), jc.Approach(2e-6)])
def test_unit_systems_agree(control):
    """SI, mm-N-MPa and nm-nN-GPa give one dimensionless result to 1e-10."""
    film = jc.Burgers(1e9, 3e8, 1e11, 5e10, 0.35)
    times = jnp.array([0.0, 20.0, 300.0])
    results = []
    for length, force in [(1.0, 1.0), (1e3, 1.0), (1e9, 1e9)]:
        stress = force / length**2
        scaled = jc.Burgers(*(v * stress for v in (film.G1, film.G2, film.eta1, film.eta2)), nu=0.35)
        body = jc.LayeredHalfSpace([jc.Layer(scaled, 30e-6 * length)], jc.Elastic(30e9 * stress, 0.25))
        unit = force if isinstance(control, jc.Load) else length
        grid = jc.Grid.square(32, 700e-6 * length)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = jc.indent(
                body,
                jc.Sphere(5e-3 * length),
                type(control)(control.value * unit),
                times,
                grid=grid,
                tolerance=1e-12,
                substeps=8,
            )
        assert bool(jnp.all(result.converged))
        results.append((result.pressure / stress, result.approach / length, result.load / force))
    for other in results[1:]:
        for ours, theirs in zip(results[0], other, strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-10 * float(jnp.max(ours)))


@pytest.mark.slow
def test_status_tells_of_the_edge_of_a_coarse_grid_and_of_iterations():
    """A ball goes on beyond the grid; heights end with it, so that contact at its edge is no error."""
    assert int(press(jc.Load(20.0), square(1.5)).status[0]) == 2
    x, y = square(1.5).coordinates()
    block = press(jc.Load(20.0), square(1.5), jc.HeightField(-(x**2 + y**2) / 1e-2))
    assert int(block.status[0]) == 0 and float(block.pressure[0, 0, N // 2]) > 0.0
    assert int(press(jc.Load(20.0), square(48)).status[0]) == 3
    stopped = press(jc.Load(20.0), square(2.6), max_iterations=2)
    assert int(stopped.status[0]) == 1 and not bool(stopped.converged[0])


@pytest.mark.slow
def test_coarse_contact_warns_and_says_when_but_not_of_the_patches_of_heights():
    """Of one contact it matters; heights touch in patches whose sizes are the surface's own."""
    ball, grid, times = jc.Sphere(5e-3), square(15), np.array([3.0, 4.0])
    rising = jc.Load(np.array([10.0, 20.0]))
    with pytest.warns(UserWarning, match=r"cells across the smallest contact, at step 1 of 2 \(t = 3 s\)"):
        jc.indent(half_space(), ball, rising, times, grid=grid)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        jc.indent(half_space(), jc.HeightField(-ball.profile(grid)), rising, times, grid=grid)


BAD = {
    "negative load": (dict(control=jc.Load(-1.0)), "Load"),
    "load that never presses": (dict(control=jc.Load(jnp.zeros(2))), "expected > 0 at some time"),
    "load of the wrong length": (dict(control=jc.Load(jnp.ones(3))), "shape"),
    "times that decrease": (dict(times=np.array([1.0, 0.0])), "do not decrease"),
    "negative thickness": (dict(body=jc.LayeredHalfSpace([jc.Layer(GLASS, -1.0)], GLASS)), "thickness"),
    "Poisson's ratio": (dict(body=half_space(jc.Elastic(1.0, 0.6))), "nu"),
    "rigid first": (dict(body=half_space(jc.KelvinVoigt(1e9, 1e9))), "J\\(0\\) = 0"),
    "heights": (dict(indenter=jc.HeightField(np.zeros((3, 3)))), "heights"),
    "radius": (dict(indenter=jc.Sphere(0.0)), "radius"),
    "save": (dict(save="some"), "save"),
    "substeps": (dict(substeps=0), "substeps"),
    "correspondence": (dict(correspondence="approximate"), "correspondence"),
    "grid": (dict(grid=jc.Grid(shape=(8, 8), spacing=(1.0, -1.0))), "spacing"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_refused_before_anything_is_computed(name):
    change, words = BAD[name]
    arguments = dict(
        body=half_space(), indenter=jc.Sphere(5e-3), control=jc.Load(1.0), times=np.array([0.0, 1.0]),
        grid=jc.Grid.square(8, 1e-4),
    ) | change  # fmt: skip
    with pytest.raises(ValueError, match=words) as caught:
        jc.indent(**arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_two_equal_calls_trace_once():
    from jaxcontact.simulate.run import _run

    grid = square(2.6)
    press(jc.Load(20.0), grid)
    before = _run.compiled._cache_size()
    press(jc.Load(21.0), dataclasses.replace(grid, spacing=(2e-5, 2e-5)))
    assert _run.compiled._cache_size() == before


@pytest.mark.slow
@pytest.mark.versions
def test_vmap_equals_the_loop():
    grid = square(3.0)
    f = lambda G: jc.indent(
        half_space(jc.Elastic(G, 0.25)), jc.Sphere(5e-3), jc.Load(20.0), NOW, grid=grid, tolerance=1e-12
    ).approach[0]
    moduli = jnp.array([28e9, 30e9, 40e9])
    np.testing.assert_allclose(jax.vmap(f)(moduli), [f(G) for G in moduli], rtol=1e-9)
