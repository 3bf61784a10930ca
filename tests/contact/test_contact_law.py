"""A contact law that limits the pressure to a hardness, through all solvers."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq, lsq_linear

import jaxcontact as jc
from jaxcontact._support.pytree import pytree, replace
from jaxcontact.contact import implicit, nonsymmetric, normal
from jaxcontact.contact.law import Hardness
from jaxcontact.history import time_loop
from jaxcontact.history.memory import Prediction
from jaxcontact.history.normal_step import PressStepper
from jaxcontact.operators.operator import Family
from jaxcontact.response.coefficients import influence_coefficients
from jaxcontact.response.images import Images

TOLERANCE, MOST = jnp.asarray(1e-11), jnp.asarray(2000)


def problem_of(gap, target, load_controlled, limit):
    """A half-space in units of its cells and of the compliance (1 - nu)/G."""
    grid = jc.Grid(gap.shape, (1.0, 1.0))
    kernel = influence_coefficients(grid, Images(jnp.zeros(0), jnp.ones(1)))
    operator = Family.of(kernel[None]).combined([1.0])
    gap, target = jnp.asarray(gap), jnp.asarray(target)
    return normal.Problem(operator, gap, target, jnp.min(gap), load_controlled, Hardness(jnp.asarray(limit)))


@functools.partial(jax.jit, static_argnames=("load_controlled", "method"))
def solved(gap, target, load_controlled, limit, method):
    problem = problem_of(gap, target, load_controlled, limit)
    return method(problem, jnp.zeros(gap.shape), TOLERANCE, MOST)


def dense_matrix(shape):
    """The half-space's coefficients, 1/(2 pi r) over a cell, by the primitive x log(y + r) + y log(x + r)."""
    x, y = (a.ravel() for a in np.meshgrid(*map(np.arange, shape), indexing="ij"))
    dx, dy = (np.abs(a[:, None] - a[None, :]) for a in (x, y))
    primitive = lambda u, v: u * np.log(v + np.hypot(u, v)) + v * np.log(u + np.hypot(u, v))
    high, low = (dx + 0.5, dy + 0.5), (dx - 0.5, dy - 0.5)
    ends = primitive(high[0], high[1]) + primitive(low[0], low[1])
    return (ends - primitive(high[0], low[1]) - primitive(low[0], high[1])) / (2 * np.pi)


def box_constrained(gap, approach, limit):
    """Pressures of least energy between 0 and the limit at a given approach, by bounded least squares."""
    K = dense_matrix(gap.shape)
    L = np.linalg.cholesky(K)
    b = np.linalg.solve(L, approach - gap.ravel())
    return lsq_linear(L.T, b, (0.0, limit), method="bvls", tol=1e-14).x.reshape(gap.shape)


def bumps(shape=(12, 11)):
    x, y = np.meshgrid(*map(np.arange, shape), indexing="ij")
    rough = 0.15 * np.random.RandomState(2).rand(*shape)
    return 0.02 * ((x - 5.2) ** 2 + (y - 4.9) ** 2) + rough


@pytest.mark.parametrize("limit", [0.15, 0.3, 100.0])
@pytest.mark.parametrize("method", [normal.solve, nonsymmetric.solve], ids=["symmetric", "active sets"])
def test_the_pressure_is_that_of_a_bounded_least_squares_at_a_given_approach(limit, method):
    gap = bumps()
    found = solved(gap, 0.9, False, limit, method)
    wanted = box_constrained(gap, 0.9, limit)
    assert found.error <= TOLERANCE
    np.testing.assert_allclose(found.pressure, wanted, atol=1e-7 * wanted.max())
    assert np.any(wanted == limit) == (limit < 1.0)


@pytest.mark.parametrize("limit", [0.15, 0.3])
@pytest.mark.parametrize("method", [normal.solve, nonsymmetric.solve], ids=["symmetric", "active sets"])
def test_a_load_is_carried_by_an_area_of_at_least_load_over_hardness(limit, method):
    gap, load = bumps(), 9.0
    found = solved(gap, load, True, limit, method)
    approach = brentq(lambda d: np.sum(box_constrained(gap, d, limit)) - load, 0.2, 5.0, xtol=1e-13)
    assert float(found.approach) == pytest.approx(approach, rel=1e-7)
    np.testing.assert_allclose(found.pressure, box_constrained(gap, approach, limit), atol=1e-6 * limit)
    assert float(jnp.sum(found.pressure)) == pytest.approx(load, rel=1e-12)
    assert int(jnp.sum(found.pressure > 0.0)) >= load / limit


@pytest.mark.long
def test_derivatives_hold_the_saturated_cells_at_the_hardness():
    gap = bumps()

    def outcome(q):
        problem = problem_of(gap, q[0], True, q[1])
        found = implicit.solve_contact(problem, jnp.zeros(gap.shape), TOLERANCE, MOST)
        return jnp.append(jnp.sum(found.pressure**2), found.approach)

    at = jnp.array([9.0, 0.15])
    forward, reverse = jax.jit(jax.jacfwd(outcome))(at), jax.jit(jax.jacrev(outcome))(at)
    np.testing.assert_allclose(forward, reverse, rtol=1e-8)
    for i, step in enumerate(1e-6 * np.eye(2)):
        central = (jax.jit(outcome)(at + step) - jax.jit(outcome)(at - step)) / 2e-6
        np.testing.assert_allclose(forward[:, i], central, rtol=1e-5)


@pytest.mark.slow
def test_a_march_in_time_takes_the_law_of_its_setup():
    """A ball on a Maxwell half-space under a rising load: no pressure above the hardness, whose area then grows."""
    steps = time_loop.Steps(jnp.ones((3, 1)), jnp.array([[2.0], [6.0], [12.0]]), jnp.zeros((3, 1)))
    stepper = PressStepper(
        _Elastic(), jnp.asarray(bumps()), jnp.asarray(1e-9), jnp.asarray(500), True, (False, False)
    )
    stepper = replace(stepper, law=Hardness(jnp.asarray(0.25)))
    _, outcome = jax.jit(lambda: time_loop.march_from_rest(stepper, steps, lambda outcome: outcome))()
    load, area = outcome.numbers["load"], outcome.numbers["contact_area"]
    assert np.all(np.asarray(outcome.numbers["status"]) != jc.Status.NOT_CONVERGED)
    assert float(jnp.max(outcome.fields["pressure"])) == 0.25
    np.testing.assert_allclose(load, [2.0, 6.0, 12.0], rtol=1e-12)
    assert np.all(np.asarray(area) >= np.asarray(load) / 0.25)


@pytree
class _Elastic:
    """A memory that remembers nothing: the half-space of ``problem_of``."""

    inherits = False

    def start(self, shape):
        return ()

    def predict(self, fields, pressure, step):
        return Prediction(problem_of(bumps(), 1.0, True, 1.0).operator, jnp.zeros(pressure.shape), fields)

    def update(self, fields, pressure, step):
        return fields

    def observe(self, fields, pressure, step):
        return {"film_strain": jnp.zeros(())}
