"""Derivatives of designs with many parameters: against central differences in ten random directions, and their cost."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc

N, TIMES = 12, jnp.array([0.0, 1.0, 4.0])
GRID = jc.Grid.square(N, 240e-6)
STEEL = jc.Elastic.from_young(210e9, nu=0.3)
FILM = jc.StandardLinearSolid(G1=1e9, G2=1e9, eta2=2e9, nu=0.4)
BALL = jc.Sphere(5e-3, STEEL)
pytestmark = pytest.mark.filterwarnings("ignore:.*cells across", "ignore:.*film strain")


def coated(thickness=40e-6, film=FILM):
    return jc.LayeredHalfSpace([jc.Layer(film, thickness=thickness)], substrate=STEEL)


def measures(history):
    """Pressure, approach and area in one number of order one."""
    weights = jnp.linspace(0.5, 1.5, N * N).reshape(N, N)
    p = jnp.sum(weights * history.pressure[-1] ** 2) / 1e15
    return p + history.approach[-1] / 1e-6 + history.smooth_area[-1] / 1e-8


def smooth():
    """Heights (N, N) with a single highest cell, at which the approach is zero; several would make it a kink."""
    x, y = GRID.coordinates()
    return -((x - 3e-6) ** 2 + (y - 5e-6) ** 2) / 10e-3


def of_heights(z):
    x, y = GRID.coordinates()
    # a single highest cell, at which the approach is zero
    smooth = -((x - 3e-6) ** 2 + (y - 5e-6) ** 2) / 10e-3
    bumps = jc.HeightField(smooth + 1e-7 * z, material=STEEL)
    return measures(jc.indent(coated(), bumps, jc.Load(0.5), TIMES, grid=GRID, tolerance=1e-12))


def of_thicknesses(z):
    body = coated(40e-6 * jnp.exp(0.05 * z), jc.Elastic(G=1e9, nu=0.4))
    indenter = jc.HeightField(smooth(), material=STEEL)
    return measures(jc.indent(body, indenter, jc.Load(0.5), TIMES[:1], grid=GRID, tolerance=1e-12))


def of_loads(z):
    load = jc.Load(0.5 + 0.01 * z)
    return measures(jc.indent(coated(), BALL, load, TIMES, grid=GRID, tolerance=1e-12))


DESIGNS = {
    "heights": (of_heights, (N, N)), "thicknesses": (of_thicknesses, (N, N)),
    "loads": (of_loads, (3,)),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["heights", *(pytest.param(name, marks=pytest.mark.long) for name in ("thicknesses", "loads"))]
)
def test_the_gradient_is_that_of_central_differences_in_ten_random_directions(name):
    """No cell enters or leaves the contact between the two points, so that the function is smooth there."""
    function, shape = DESIGNS[name]
    rng, step, at = np.random.default_rng(4), 1e-5, jnp.zeros(shape)
    value = jax.jit(jax.value_and_grad(function))
    gradient = np.asarray(value(at)[1])
    for _ in range(10):
        along = rng.standard_normal(shape)
        central = float(value(at + step * along)[0] - value(at - step * along)[0]) / (2.0 * step)
        assert np.sum(gradient * along) == pytest.approx(
            central, rel=1e-5, abs=1e-7 * np.linalg.norm(gradient)
        )


@pytest.mark.long
def test_products_with_the_hessian_are_differences_of_gradients():
    """Forward over reverse mode, for Newton-CG."""
    slope = jax.jit(jax.grad(of_heights))
    product = jax.jit(lambda at, along: jax.jvp(jax.grad(of_heights), (at,), (along,))[1])
    along, at, step = jnp.asarray(np.random.default_rng(5).standard_normal((N, N))), jnp.zeros((N, N)), 1e-5
    central = (slope(at + step * along) - slope(at - step * along)) / (2.0 * step)
    found = product(at, along)
    assert float(jnp.linalg.norm(found - central)) < 1e-4 * float(jnp.linalg.norm(central))
