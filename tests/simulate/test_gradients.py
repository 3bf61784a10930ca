"""Derivatives through contact and time: reverse equals forward equals central differences."""

import time
import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bodies import FILM, STEEL
from jax.test_util import check_grads
from tolerances import CENTRAL_DIFFERENCE, MODES, ROUND_OFF, TIGHT_SOLVER

import jaxcontact as jc
from jaxcontact.bodies import materials
from jaxcontact.contact import implicit
from jaxcontact.contact.normal import Problem
from jaxcontact.operators import kernels as gridded
from jaxcontact.operators.kernels import build
from jaxcontact.operators.operator import Family
from jaxcontact.response.coefficients import influence_coefficients
from jaxcontact.response.images import Images
from jaxcontact.response.normal import OneLayer

VALUES = {
    "G1": 0.75e9, "G2": 13.89e6, "eta1": 3.1486e12, "eta2": 120.9e9, "nu": 0.3, "thickness": 150e-9,
    "substrate G": 80e9, "substrate nu": 0.3, "radius": 9.525e-3, "ball G": 80e9, "ball nu": 0.3,
}  # fmt: skip
NAMES = (*VALUES, "control", "history", "heights")
OUTPUTS = ("load|approach", "half way", "smooth area", "film strain", "sum p^2", "gap")


def body_and_ball(q):
    """From the logarithms of the parameters over their values."""
    v = {name: value * jnp.exp(q[i]) for i, (name, value) in enumerate(VALUES.items())}
    film = jc.Burgers(v["G1"], v["G2"], v["eta1"], v["eta2"], v["nu"])
    substrate = jc.Elastic(v["substrate G"], v["substrate nu"])
    body = jc.LayeredHalfSpace([jc.Layer(film, v["thickness"])], substrate)
    return body, jc.Sphere(v["radius"], jc.Elastic(v["ball G"], v["ball nu"]))


def creep_and_relaxation(q, control, n, times):
    """Outputs of order one. q: log parameters, then a scale and a tilt of the history, then a bump on the ball."""
    body, ball = body_and_ball(q)
    grid = jc.Grid.square(n, 560e-6)
    x, y = grid.coordinates()
    heights = -ball.profile(grid) + q[-1] * 1e-7 * jnp.cos(x * 3e4) * jnp.cos(y * 2e4)
    history = jnp.exp(q[-3]) * (1.0 + 0.2 * jnp.sin(times / 500.0) + q[-2] * times / times[-1])
    given = jc.Load(60.0 * history) if control == "load" else jc.Approach(2.52e-6 * history)
    rough = jc.HeightField(heights, material=ball.material)
    r = jc.indent(body, rough, given, times, grid=grid, tolerance=1e-12)
    answer = r.approach / 3e-6 if control == "load" else r.load / 60.0
    far = jnp.mean(r.gap[-1]) / 1e-6
    squares = jnp.sum((r.pressure[-1] / 1e9) ** 2) * (32 / n) ** 2 / 100.0
    return jnp.stack(
        [answer[-1], answer[len(times) // 2], r.smooth_area[-1] / 1e-7, r.film_strain[-1], squares, far]
    )


@pytest.mark.long  # test_every_derivative has fewer leaves in .ci/run
@pytest.mark.parametrize(("control", "n"), [("load", 32), ("approach", 64)])
def test_reverse_forward_and_central_differences_agree_for_every_leaf(control, n):
    """n x n cells, n/4 steps, tolerance 1e-12, where no cell enters or leaves contact within the step.

    Relative to the entry, or to a thousandth of its row's largest.
    """
    times = jnp.linspace(0.0, 1600.0, n // 4 + 1)
    f = jax.jit(lambda q: creep_and_relaxation(q, control, n, times))
    q, step = jnp.zeros(len(NAMES)), 3e-4
    forward, reverse = np.asarray(jax.jit(jax.jacfwd(f))(q)), np.asarray(jax.jit(jax.jacrev(f))(q))
    central = np.stack([(f(q + step * e) - f(q - step * e)) / (2 * step) for e in jnp.eye(q.size)], -1)
    size = np.maximum(np.abs(forward), 1e-3 * np.max(np.abs(forward), axis=1, keepdims=True))
    print(f"\n{control}: reverse - forward, central - forward, relative, for {', '.join(OUTPUTS)}")
    for i, name in enumerate(NAMES):
        two = [f"{a:.0e} {b:.0e}" for a, b in zip(abs(reverse - forward)[:, i] / size[:, i],
                                                  abs(central - forward)[:, i] / size[:, i], strict=True)]  # fmt: skip
        print(f"{name:13s} " + " | ".join(two))
    assert np.max(abs(reverse - forward) / size) < MODES
    assert np.max(abs(central - forward) / size) < CENTRAL_DIFFERENCE


def small_contact(q):
    """A contact of some 60 cells: approach and sum p^2 from log modulus, log curvature, log load."""
    grid = jc.Grid.square(16, 16.0)
    kernel = jnp.exp(q[0]) * influence_coefficients(grid, Images(jnp.zeros(0), jnp.ones(1)))
    x, y = grid.coordinates()
    gap = 0.02 * jnp.exp(q[1]) * (x**2 + 1.3 * y**2)
    operator = Family.of(kernel[None]).combined([1.0])
    problem = Problem(operator, gap, 9.0 * jnp.exp(q[2]), jnp.zeros(()), True)
    s = implicit.solve_contact(problem, jnp.zeros((16, 16)), jnp.asarray(1e-13), jnp.asarray(500))
    return jnp.stack([s.approach, jnp.sum(s.pressure**2), s.displacement[3, 4]])


def creep_and_modulus(q):
    film = jc.Burgers(*(jnp.exp(q[:4]) * jnp.array([0.75e9, 13.89e6, 3.1486e12, 120.9e9])))
    return jnp.stack([film.creep(700.0) * 1e8, film.relaxation(700.0) / 1e8])


def responses(q):
    body, _ = body_and_ball(jnp.pad(q, (0, 2)))
    return jc.normal_response(body, jnp.array([1e4, 3e6]), jnp.array([900.0, 100.0])) * jnp.array(
        [1e15, 1e16]
    )


def coefficients(q):
    body, ball = body_and_ball(jnp.pad(q, (0, 2)))
    built = build(body, ball, jc.Grid.square(8, 1.6e-6))
    spectra = built.family.spectrum
    first, shape = spectra[0, 1, 2], spectra[1, 1, 2] * built.mix[0, 0]
    return jnp.stack([first, 1e2 * shape]) * built.scale.compliance * 1e9


def stopped(f):
    return lambda *a, **k: jax.lax.stop_gradient(f(*a, **k))


CHECKS = {
    "materials": (creep_and_modulus, 4, materials, "relaxation_modes"),
    "responses": (responses, 9, OneLayer, "modes"),
    "influence coefficients": (coefficients, 9, gridded, "influence_coefficients"),
    "contact": (small_contact, 3, implicit, "solve_in_contact"),
}


LONG = ("responses", "influence coefficients", "contact")


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.long if name in LONG else pytest.mark.slow) for name in CHECKS],
)
def test_derivatives_to_second_order(name, monkeypatch):
    """In log parameters, outputs of order one; and the check fails once part of the rule is cut off."""
    f, size, module, part = CHECKS[name]
    q = jnp.asarray(np.random.default_rng(3).normal(size=size) * 0.05)

    def check():
        fresh = jax.jit(lambda q: f(q))
        check_grads(fresh, (q,), order=2, modes=("fwd", "rev"), eps=1e-4, rtol=2e-5, atol=2e-5)

    check()
    hessian = jax.jit(jax.hessian(lambda q: f(q)[0]))(q)
    np.testing.assert_allclose(hessian, hessian.T, rtol=1e-6, atol=1e-8)
    monkeypatch.setattr(module, part, stopped(getattr(module, part)))
    with pytest.raises(AssertionError):
        check()


@pytest.mark.slow
def test_no_contact_and_zero_load_have_zero_gradients():
    grid, times = jc.Grid.square(32, 560e-6), jnp.linspace(0.0, 1600.0, 5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")

        def peak(film, control):
            body = jc.LayeredHalfSpace([jc.Layer(film, 150e-9)], STEEL)
            return jnp.max(jc.indent(body, jc.Sphere(9.5e-3), control, times, grid=grid).pressure)

        gradient = jax.jit(jax.grad(peak, argnums=(0, 1)))(FILM, jc.Approach(-1e-6))
        assert all(float(leaf) == 0.0 for leaf in jax.tree.leaves(gradient))
        body, ball = jc.LayeredHalfSpace([], FILM), jc.Sphere(9.5e-3)
        lifted = lambda v: jc.indent(body, ball, jc.Load(v), times[:2], grid=grid).pressure[-1].sum()
        assert np.all(np.asarray(jax.jit(jax.grad(lifted))(jnp.array([1.0, 0.0]))) == 0.0)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:only")
def test_after_unloading_the_approach_has_the_derivative_of_the_print_left_behind():
    """A Maxwell half-space under 10 N for 600 s, then 300 s without: central differences; the middle still touches."""
    times, grid = jnp.array([0.0, 300.0, 600.0, 600.0, 900.0]), jc.Grid.square(32, 2.2e-3)
    loads = jnp.array([10.0, 10.0, 10.0, 0.0, 0.0])

    def left(q):
        body = jc.LayeredHalfSpace([], jc.Maxwell(1e9 * jnp.exp(q[0]), 1e12 * jnp.exp(q[1])))
        ball, load = jc.Sphere(9.525e-3 * jnp.exp(q[2])), jc.Load(loads * jnp.exp(q[3]))
        r = jc.indent(body, ball, load, times, grid=grid, tolerance=1e-12)
        return jnp.stack([r.approach[-1] / 1e-6, jnp.mean(r.gap[-1, 15:17, 15:17]) / 1e-6])

    left, step = jax.jit(left), 1e-4
    central = [(left(step * e) - left(-step * e)) / (2 * step) for e in jnp.eye(4)]
    found = jax.jit(jax.jacrev(left))(jnp.zeros(4))
    assert float(jnp.min(jnp.abs(found[0]))) > 0.1
    np.testing.assert_allclose(found.T, jnp.stack(central), rtol=CENTRAL_DIFFERENCE, atol=CENTRAL_DIFFERENCE)


@pytest.mark.slow
def test_a_derivative_whose_solve_fails_is_nan(monkeypatch):
    monkeypatch.setattr(implicit, "TANGENT_ITERATIONS", 2)
    slope = jax.jvp(jax.jit(lambda q: small_contact(q)), (jnp.zeros(3),), (jnp.ones(3),))[1]
    assert np.isnan(slope[1])


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:film strain", "ignore:only")
def test_a_film_that_may_flow_but_does_not_has_a_value_and_a_slope():
    """Fluidity zero: the solid without flow, and the slope towards flow."""
    times, grid = jnp.linspace(0.0, 1600.0, 3), jc.Grid.square(16, 560e-6)

    def approach(film):
        body, ball = jc.LayeredHalfSpace([jc.Layer(film, 150e-9)], STEEL), jc.Sphere(9.5e-3)
        return jc.indent(body, ball, jc.Load(60.0), times, grid=grid, tolerance=1e-12).approach[-1] / 3e-6

    def of_flow(fluidity):
        return approach(jc.Prony(J0=1 / 0.75e9, J=jnp.array([1 / 13.89e6]), tau=jnp.array([8704.0]), nu=0.3,
                                 fluidity=fluidity * 1e-13))  # fmt: skip

    solid = approach(jc.StandardLinearSolid(G1=0.75e9, G2=13.89e6, eta2=13.89e6 * 8704.0, nu=0.3))
    assert float(of_flow(0.0)) == pytest.approx(float(solid), rel=TIGHT_SOLVER)
    forward, reverse = jax.jvp(of_flow, (0.0,), (1.0,))[1], jax.grad(of_flow)(0.0)
    assert float(reverse) == pytest.approx(float(forward), rel=MODES)
    assert float(forward) == pytest.approx(float(of_flow(1e-3) - of_flow(0.0)) / 1e-3, rel=1e-3)


@pytest.mark.slow
@pytest.mark.versions
def test_where_a_cell_enters_contact_the_derivative_is_that_of_one_side():
    """The load at which four cells enter is bracketed; the pressure is continuous, its slope jumps."""
    grid, body = jc.Grid.square(16, 300e-6), jc.LayeredHalfSpace([], STEEL)
    run = jax.jit(
        lambda w: jc.indent(
            body, jc.Sphere(9.5e-3), jc.Load(w), jnp.zeros(1), grid=grid, tolerance=1e-13
        ).pressure[0]
    )
    count, corner = lambda w: int(jnp.sum(run(w) > 0.0)), lambda w: jnp.sum((run(w) / 1e9) ** 2)
    low, high = 10.0, 20.0
    assert count(low) < count(high)
    start = count(low)
    while high - low > 1e-10:
        middle = (low + high) / 2.0
        low, high = (middle, high) if count(middle) == start else (low, middle)
    slope, step = jax.jit(jax.grad(corner)), 1e-3
    below = (corner(low) - corner(low - step)) / step
    above = (corner(high + step) - corner(high)) / step
    assert float(slope(low)) == pytest.approx(float(below), rel=2e-4)
    assert float(slope(high)) == pytest.approx(float(above), rel=2e-4)
    assert float(corner(high)) == pytest.approx(float(corner(low)), rel=1e-9)
    assert abs(float(slope(high) / slope(low)) - 1.0) > 0.05  # a kink, on a grid this coarse


@pytest.mark.slow
def test_first_touch_by_heights_whose_top_is_several_cells_has_a_derivative_of_zero():
    """The approach is zero where the surfaces first touch, whatever the heights."""
    grid = jc.Grid.square(16, 16e-6)
    x, y = (np.asarray(c) / 8e-6 for c in grid.coordinates())
    heights = -1e-7 * np.maximum(np.abs(x), 1.0 / 8.0) ** 2 - 1e-7 * y**2
    rubber, loads = jc.LayeredHalfSpace([], jc.Elastic(1e6, 0.3)), jc.Load([0.0, 1e-7])

    def first(heights):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the contact is small
            return jc.indent(rubber, jc.HeightField(heights), loads, [0.0, 1.0], grid=grid).approach[0]

    assert np.sum(heights == np.max(heights)) > 1
    # a derivative of a length by a length, of order one where it is not zero: rounding
    np.testing.assert_allclose(jax.grad(first)(heights), 0.0, atol=1e-12)


def test_heights_whose_top_is_several_cells_have_a_finite_derivative():
    """In a jitted gradient over a single time, where a compiler may compute the heights twice with different rounding."""
    grid = jc.Grid((64, 4), (2.5e-6, 2.5e-6), periodic=True)
    rubber = jc.LayeredHalfSpace([], jc.Elastic(1e6, 0.3))
    load = jc.Load(2e3 * float(grid.width[0] * grid.width[1]))
    shape = np.cos(2.0 * np.pi * np.asarray(grid.coordinates()[0]) / 1.6e-4) * np.ones(grid.shape)

    def mean_gap(heights):
        return jnp.mean(
            jc.indent(rubber, jc.HeightField(1e-6 * heights), load, [0.0], grid=grid, tolerance=1e-12).gap
        )

    found = jax.jit(jax.grad(mean_gap))(shape)
    step = 1e-4 * shape
    expected = (mean_gap(shape + step) - mean_gap(shape - step)) / 2e-4
    np.testing.assert_allclose(np.sum(found * shape), expected, rtol=CENTRAL_DIFFERENCE)


@pytest.mark.slow
def test_an_integer_load_has_a_gradient():
    body, grid = jc.LayeredHalfSpace([], STEEL), jc.Grid.square(64, 330e-6)
    f = lambda load: jc.indent(body, jc.Sphere(9.525e-3), load, np.zeros(1), grid=grid).approach[0]
    expected = f(jc.Load(60)) * 2 / (3 * 60)  # approach ~ W^(2/3)
    assert float(jax.grad(f)(jc.Load(60)).value) == pytest.approx(float(expected), rel=5e-3)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:only")
def test_hessians_through_time_of_many_solids_at_once():
    """jit, vmap and hessian of a run of four steps: central differences of its gradient, and symmetric."""
    grid, times = jc.Grid.square(16, 6e-3), jnp.linspace(0.0, 1600.0, 4)

    def approach(q):
        half = jc.LayeredHalfSpace(
            [], jc.Burgers(*(jnp.exp(q) * jnp.asarray([0.75e9, 13.89e6, 3.1486e12, 120.9e9])))
        )
        run = jc.indent(half, jc.Sphere(9.5e-3), jc.Load(60.0), times, grid=grid, tolerance=1e-12)
        return run.approach[-1] / 1e-4

    solids, step = jnp.asarray(np.random.default_rng(5).normal(size=(2, 4)) * 0.05), 1e-4
    found, slope = jax.jit(jax.vmap(jax.hessian(approach)))(solids), jax.jit(jax.vmap(jax.grad(approach)))
    central = jnp.stack(
        [(slope(solids + step * e) - slope(solids - step * e)) / (2 * step) for e in jnp.eye(4)], 1
    )
    np.testing.assert_allclose(found, central, rtol=CENTRAL_DIFFERENCE, atol=CENTRAL_DIFFERENCE)
    np.testing.assert_allclose(found, found.transpose(0, 2, 1), rtol=1e-6, atol=1e-8)


@pytest.mark.long
def test_second_derivatives_hold_the_area_of_contact():
    """As the docs say: the slope of Hertz's load over approach is met, its curvature is not seen.

    17 cells to the radius: slope within 1 %, curvature by wide differences within 2 % (discretisation).
    """
    body, grid = jc.LayeredHalfSpace([], STEEL), jc.Grid.square(64, 500e-6)

    def load(d):
        control = jc.Approach(2e-6 * d)
        return jc.indent(body, jc.Sphere(9.525e-3), control, jnp.zeros(1), grid=grid, tolerance=1e-12).load[0]

    hertz = lambda d: 4 / 3 * 210e9 / 0.91 * (9.525e-3) ** 0.5 * (2e-6 * d) ** 1.5
    assert float(jax.grad(load)(1.0)) == pytest.approx(float(jax.grad(hertz)(1.0)), rel=1e-2)
    assert abs(float(jax.hessian(load)(1.0))) < 1e-6
    wide = (load(1.2) - 2 * load(1.0) + load(0.8)) / 0.04
    assert float(wide) == pytest.approx(float(jax.hessian(hertz)(1.0)), rel=2e-2)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:only")
def test_a_second_derivative_by_the_approach_of_what_creeps_is_there():
    """The load's cotangent is constant while the history moves with the approach; the area is held."""
    body, times = jc.LayeredHalfSpace([], jc.Maxwell(1e9, 1e10)), jnp.array([0.0, 5.0, 10.0])

    def load(d):
        control = jc.Approach(4e-6 * d * jnp.array([1.0, 1.1, 1.2]))
        return jc.indent(body, jc.Sphere(9e-3), control, times, grid=jc.Grid.square(16, 600e-6)).load[-1]

    assert abs(float(jax.hessian(load)(1.0))) < 1e-6 * float(jax.grad(load)(1.0))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:only")
def test_a_function_that_saves_is_only_asked_where_there_is_contact():
    """The mean depth under the pressure has no value without; seven steps do not fill blocks of three."""
    grid, times = jc.Grid.square(16, 2.2e-3), jnp.linspace(0.0, 600.0, 7)
    depth = lambda o: jnp.sum(o.pressure * o.displacement) / jnp.sum(o.pressure)

    def deepest(G):
        body = jc.LayeredHalfSpace([], jc.Maxwell(G, 1e12))
        return jc.indent(body, jc.Sphere(9e-3), jc.Load(10.0), times, grid=grid, save=depth).saved[-1]

    assert float(jax.jit(jax.grad(deepest))(1e9)) < 0.0


@pytest.mark.long
def test_many_parameter_sets_at_once_equal_the_loop():
    """Also prints the time of a case of either (a benchmark of neither: compile time is apart, once each)."""
    times = jnp.linspace(0.0, 1600.0, 4)
    f = jax.jit(lambda q: creep_and_relaxation(q, "load", 16, times))
    vmapped = jax.jit(jax.vmap(f))
    sets = jnp.asarray(np.random.default_rng(0).normal(size=(32, len(NAMES))) * 0.05)
    seconds, found = [], []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for run in (lambda: vmapped(sets), lambda: jnp.stack([f(q) for q in sets])):
            jax.block_until_ready(run())
            began = time.perf_counter()
            found.append(jax.block_until_ready(run()))
            seconds.append(time.perf_counter() - began)
    print(f"\na case: {seconds[0] / 32 * 1e3:.1f} ms by vmap, {seconds[1] / 32 * 1e3:.1f} ms in a loop")
    np.testing.assert_allclose(*found, rtol=TIGHT_SOLVER)


@pytest.mark.long
def test_what_reverse_mode_keeps_does_not_change_what_it_finds():
    times, grid = jnp.linspace(0.0, 1600.0, 6), jc.Grid.square(16, 560e-6)

    def gradient(checkpoint):
        def load(film):
            body = jc.LayeredHalfSpace([jc.Layer(film, 150e-9)], STEEL)
            ball, control = jc.Sphere(9.5e-3), jc.Approach(2.5e-6)
            return jc.indent(body, ball, control, times, grid=grid, checkpoint=checkpoint).load[-1]

        return jnp.stack(jax.tree.leaves(jax.grad(load)(FILM)))

    np.testing.assert_allclose(gradient("blocks"), gradient("pressures"), rtol=ROUND_OFF * 100)


@pytest.mark.slow
@pytest.mark.versions
def test_sensitivities_of_hertz_are_its_exponents():
    """approach ~ E*^(-2/3) R^(-1/3), peak pressure ~ E*^(2/3) R^(-2/3), on a grid of 64."""
    grid = jc.Grid.square(64, 330e-6)

    def outputs(pair):
        r = jc.indent(*pair, jc.Load(60.0), np.zeros(1), grid=grid, tolerance=1e-12)
        return {"approach": r.approach, "contact area": r.smooth_area, "load": r.load}

    table = jc.sensitivity(outputs, (jc.LayeredHalfSpace([], STEEL), jc.Sphere(9.525e-3)))
    assert table.parameters == ("[0].substrate.G", "[0].substrate.nu", "[1].radius")
    slopes = {name: dict(zip(table.parameters, v[:, 0], strict=True)) for name, v in table.values.items()}
    assert slopes["approach"]["[0].substrate.G"] == pytest.approx(-2 / 3, abs=5e-3)
    assert slopes["approach"]["[0].substrate.nu"] == pytest.approx(-2 / 3 * 0.3 / 0.7, abs=5e-3)
    assert slopes["approach"]["[1].radius"] == pytest.approx(-1 / 3, abs=5e-3)
    assert slopes["contact area"]["[1].radius"] == pytest.approx(2 / 3, abs=2e-2)
    assert slopes["load"]["[1].radius"] == pytest.approx(0.0, abs=1e-12)
    assert "[1].radius" in str(table) and "+0.0000" in str(table)
    assert tuple(table.values) == ("approach", "contact area", "load")
    with pytest.raises(ValueError, match="times: expected"):
        table.plot(np.zeros(3))


@pytest.mark.long
def test_sensitivities_refuse_and_warn_as_the_calculation_does():
    def outputs(body, **keywords):
        ball, grid = jc.Sphere(9e-3), jc.Grid.square(32, 330e-6)
        return {"approach": jc.indent(body, ball, jc.Load(60.0), np.zeros(1), grid=grid, **keywords).approach}

    with pytest.raises(ValueError, match="G"):
        jc.sensitivity(outputs, jc.LayeredHalfSpace([], jc.Elastic(-1e9, 0.3)))
    with pytest.warns(UserWarning, match="not converged"):
        jc.sensitivity(lambda body: outputs(body, max_iterations=1), jc.LayeredHalfSpace([], STEEL))
