"""Coulomb friction: against a convex minimiser, from any start, and by displacements in closed form."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from benchmarks.friction_problems import HALF_SPACE, RESIDUAL, problem, rectangle, residuals
from scipy.optimize import minimize

import jaxcontact as jc
from jaxcontact._support.pytree import replace
from jaxcontact.contact import friction
from jaxcontact.contact.friction import TangentialProblem
from jaxcontact.contact.implicit import solve_tangential
from jaxcontact.operators.coupled import Tangential, TractionOperator
from jaxcontact.response.coefficients import SurfaceKernels

N = 5
solve = jax.jit(
    lambda p, start: friction.solve(p, start, p.operator.tangential_from_tangential(start), 1e-10, 300)
)


@functools.cache
def operator():
    """Half-spaces of Poisson's ratio 0.4, and the matrix (2 N N, 2 N N) of its columns under unit loads."""
    f = rectangle(1.0, 1.0, N)
    entries = {"xx": 0.6 * f["r"] + 0.4 * f["xx"], "yy": 0.6 * f["r"] + 0.4 * f["yy"], "xy": 0.4 * f["xy"]}
    kernels = {name: entry[N - 1 :, N - 1 :] for name, entry in entries.items()}
    zero, units = np.zeros((N, N)), np.eye(2 * N * N).reshape(-1, 2, N, N)

    @jax.jit
    def operator_and_columns():
        made = TractionOperator(None, Tangential.of(SurfaceKernels(**kernels, x=zero, y=zero), coupled=False))
        return made, jax.vmap(made.tangential_from_tangential)(units)

    made, columns = operator_and_columns()
    return made, np.asarray(columns).reshape(2 * N * N, -1)


def drawn_problem(seed, load_controlled):
    """Bounds of a round contact with cells without any, a drift at random, and half of what friction holds or a shift."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(*[np.arange(N) - (N - 1) / 2] * 2, indexing="ij")
    bound = np.sqrt(np.maximum(1.0 - (x**2 + y**2) / 6.5, 0.0)) * rng.uniform(0.1, 1.0, (N, N))
    way = rng.normal(size=2)
    target = way / np.linalg.norm(way) * (np.sum(bound) * rng.uniform(0.0, 0.95) if load_controlled else 3.0)
    drift = rng.uniform(0.0, 4.0) * rng.normal(size=(2, N, N))
    given = map(jnp.asarray, (bound, bound > 0.0, drift, target))
    return TangentialProblem(operator()[0], *given, load_controlled)


def minimised(p):
    """Tractions of least energy by sequential quadratic programming (scipy) with the dense matrix."""
    matrix, cells = operator()[1], np.asarray(p.bound).ravel()
    inside = cells > 0.0
    keep = np.concatenate([inside, inside])
    K, b, m = matrix[np.ix_(keep, keep)], cells[inside], np.sum(inside)
    shift = np.zeros(2) if p.load_controlled else np.asarray(p.target)
    linear = (np.asarray(p.drift) - shift[:, None, None]).reshape(2, -1)[:, inside].ravel()
    rim = {"type": "ineq", "fun": lambda q: b**2 - q[:m] ** 2 - q[m:] ** 2}
    rim["jac"] = lambda q: np.hstack([-2 * np.diag(q[:m]), -2 * np.diag(q[m:])])
    ones = np.kron(np.eye(2), np.ones(m))
    total = {"type": "eq", "fun": lambda q: ones @ q - np.asarray(p.target), "jac": lambda q: ones}
    laws = [rim, total] if p.load_controlled else [rim]
    energy, slope = (lambda q: 0.5 * q @ K @ q + linear @ q), (lambda q: K @ q + linear)
    options = {"maxiter": 500, "ftol": 1e-14}
    found = minimize(energy, np.zeros(2 * m), jac=slope, constraints=laws, method="SLSQP", options=options)
    q = np.zeros(2 * N * N)
    q[keep] = found.x
    return q.reshape(2, N, N)


@pytest.mark.slow
@pytest.mark.parametrize("load_controlled", [True, False], ids=["sum", "shift"])
def test_tractions_are_those_of_least_energy(load_controlled):
    """Of 4 problems on 5 x 5 cells, with partial slip, in which cells slip to all sides."""
    slipping = []
    for seed in range(4):
        p = drawn_problem(seed, load_controlled)
        found = solve(p, jnp.zeros((2, N, N)))
        assert float(found.error) <= 1e-10
        np.testing.assert_allclose(found.traction, minimised(p), atol=1e-6 * np.max(p.bound))
        slipping.append(np.sum(~found.stick & (p.bound > 0.0)) / np.sum(p.bound > 0.0))
    assert min(slipping) < 0.8 and max(slipping) > 0.5


@pytest.mark.versions
@pytest.mark.parametrize("load_controlled", [True, False], ids=["sum", "shift"])
def test_tractions_do_not_depend_on_the_start(load_controlled):
    """Not on one that turns against the slip, is far too large, or of another sum."""
    rng = np.random.default_rng(1)
    for seed in range(4):
        p = drawn_problem(seed, load_controlled)
        first = solve(p, jnp.zeros((2, N, N)))
        for start in (-first.traction, 1e3 * rng.normal(size=(2, N, N)), first.slip * 1e6):
            again = solve(p, jnp.asarray(start))
            assert float(again.error) <= 1e-10
            np.testing.assert_allclose(again.traction, first.traction, atol=1e-8 * np.max(p.bound))


@pytest.mark.parametrize("shift", [1e1, 1e3, 1e6])
def test_in_gross_slip_all_tractions_are_as_large_as_they_may_be_and_against_the_slip(shift):
    p = drawn_problem(3, False)
    p = replace(p, target=jnp.array([-0.6 * shift, 0.8 * shift]))
    drawn = np.random.default_rng(0).normal(size=(2, N, N))
    for start in (jnp.zeros((2, N, N)), jnp.asarray(drawn)):
        found = solve(p, start)
        assert float(found.error) <= 1e-10 and int(found.iterations) < 100 and not np.any(found.stick)
        slip = np.asarray(found.displacement + p.drift - p.target[:, None, None])
        np.testing.assert_allclose(found.traction, -np.asarray(p.bound) * slip / np.hypot(*slip), atol=1e-8)


def test_a_sum_at_or_above_what_friction_holds_ends_at_once():
    p = drawn_problem(0, True)
    room = float(jnp.sum(p.bound))
    for share in (1.0, 1.5):
        given = replace(p, target=jnp.array([0.6, 0.8]) * share * room)
        found = solve(given, jnp.zeros((2, N, N)))
        assert float(found.error) == 1.0 and int(found.iterations) == 0
        np.testing.assert_allclose(np.sum(found.traction, (1, 2)), [0.6 * room, 0.8 * room], rtol=1e-12)
    nothing = replace(p, bound=0.0 * p.bound, contact=p.bound < 0.0, target=jnp.zeros(2))
    found = solve(nothing, jnp.ones((2, N, N)))
    assert float(found.error) == 0.0 and not np.any(found.traction) and not np.any(found.slip)


def test_without_friction_all_that_touches_slips_and_tractions_grow_against_the_slip():
    """The derivative by a coefficient of zero is that of gross slip, -p slip/|slip|."""
    p = drawn_problem(2, False)
    pressure, nothing = p.bound, jnp.zeros((2, N, N))
    slip = np.where(p.contact, np.asarray(p.drift) - np.asarray(p.target)[:, None, None], 0.0)
    expected = -np.asarray(pressure) * slip / np.maximum(np.hypot(*slip), 1e-300)

    @jax.jit
    def rubbed(coefficient):
        found = solve_tangential(
            replace(p, bound=coefficient * pressure), nothing, nothing, jnp.asarray(1e-14), 300
        )
        return found.traction, found.slip, found.stick

    traction, slipped, stick = rubbed(0.0)
    assert not np.any(traction) and not np.any(stick)
    # equal up to rounding; the quotient of a small friction deviates in proportion to it
    np.testing.assert_allclose(slipped, slip, rtol=1e-12)
    by_coefficient = lambda mode: jax.jit(mode(lambda mu: rubbed(mu)[0]))(0.0)
    np.testing.assert_allclose(by_coefficient(jax.jacfwd), expected, atol=1e-12)
    np.testing.assert_allclose(by_coefficient(jax.jacrev), expected, atol=1e-12)
    np.testing.assert_allclose(rubbed(1e-7)[0] / 1e-7, expected, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("control", [("load", "force"), ("load", "displacement")], ids="-".join)
def test_random_histories_obey_both_laws(control):
    """Eight of ``tests.benchmarks.friction_problems``: unlike solids, rough balls, histories with reversals."""
    for number in range(8):
        given = problem(number, HALF_SPACE, 32, control)
        history = given.run()
        assert np.all(history.converged) and np.max(history.iterations) < 300
        assert max(residuals(given, history, [*range(len(history.times))])) < RESIDUAL


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.1, 0.3])
def test_unlike_solids_in_gross_slip_there_and_back(friction):
    """A steel ball on aluminium, coupled, dragged by many contact radii and back: the force is that of all cells."""
    steel, aluminium = jc.Elastic.from_young(210e9, nu=0.3), jc.Elastic.from_young(70e9, nu=0.33)
    grid, ball = jc.Grid.square(40, 2.8 * 112e-6), jc.Sphere(5e-3, steel)
    way = 200e-6 * (1.0 - np.abs(np.linspace(-1.0, 1.0, 33)))
    drag, times = jc.TangentialDisplacement(np.stack([way, 0.0 * way], 1)), np.arange(33.0)
    body = jc.LayeredHalfSpace([], aluminium)
    history = jc.shear(body, ball, jc.Load(20.0), drag, times, friction=friction, grid=grid)
    assert np.all(history.converged) and np.max(history.iterations) < 150
    there, back = history.tangential_load[16], history.tangential_load[-1]
    np.testing.assert_allclose([there[0], -back[0]], 20.0 * friction, rtol=1e-3)
    np.testing.assert_allclose([there[1], back[1]], 0.0, atol=1e-6)


@pytest.mark.long
def test_iterations_hardly_grow_with_the_grid():
    """Steel on steel, Cattaneo and Mindlin, 64 and 256 cells along a side, from first contact on: at most 42 iterations."""
    steel, W, mu = jc.Elastic.from_young(210e9, nu=0.3), 60.0, 0.3
    body, ball = jc.LayeredHalfSpace([], steel), jc.Sphere(9.525e-3, steel)
    push = jc.TangentialLoad(np.outer([0.3, 0.5, 0.7, 0.9], [mu * W, 0.0]))
    most = []
    for n in (64, 256):
        grid = jc.Grid.square(n, 440e-6)
        history = jc.shear(body, ball, jc.Load(W), push, np.arange(4.0), friction=mu, grid=grid, save="last")
        assert np.all(history.converged)
        most.append(int(np.max(history.iterations)))
    assert max(most) < 1.5 * min(most) and max(most) <= 42
