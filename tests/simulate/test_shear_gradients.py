"""Derivatives through partial slip: both modes against central differences, to all numbers, friction included."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tolerances import CENTRAL_DIFFERENCE, MODES

import jaxcontact as jc

NAMES = ("G [GPa]", "nu", "R [m]", "W [N]", "mu", "along x", "along y")
GRID = jc.Grid.square(24, 1.2e-3)


def observed(point, control, coupled):
    """Approach, shift, tangential load, heat, and moments of pressure and traction after a load and half its way back."""
    G, nu, radius, load, mu, x, y = point
    body = jc.LayeredHalfSpace([], jc.Elastic(G * 1e9, nu))
    way = jnp.stack([jnp.stack([x, y]), jnp.stack([-0.3 * x, y])])
    history = jc.shear(
        body, jc.Sphere(radius), jc.Load(load * jnp.array([1.0, 1.1])), control(way), [0.0, 1.0],
        friction=mu, grid=GRID, coupled=coupled, tolerance=1e-12,
    )  # fmt: skip
    last = lambda name: getattr(history, name)[-1]
    weights = jnp.cos(jnp.arange(24.0))
    return jnp.stack(
        [
            last("approach") / 1e-5,
            *last("tangential_displacement") / 1e-6,
            *last("tangential_load"),
            last("dissipated") / 1e-6,
            jnp.sum(last("pressure") ** 2) / 1e17,
            jnp.sum(last("traction")[0] * weights) / 1e7,
        ]
    )


@pytest.mark.parametrize(
    ("control", "coupled"),
    [
        pytest.param(jc.TangentialLoad, False, id="load", marks=pytest.mark.long),
        pytest.param(jc.TangentialLoad, True, id="load, coupled", marks=pytest.mark.slow),
        pytest.param(
            lambda way: jc.TangentialDisplacement(1e-6 * way),
            True,
            id="displacement, coupled",
            marks=pytest.mark.long,
        ),
    ],
)
def test_gradients_through_partial_slip(control, coupled):
    """The sets of stick, slip and separation are held; differences are too small to move a cell.

    The rounding of two solutions in a difference falls with the step: 4e-5, 1e-5, 4e-6 and 1e-6 of the scale at
    relative steps of 3e-6, 1e-5, 3e-5 and 1e-4.
    """
    point = jnp.array([1.0, 0.3, 10e-3, 10.0, 0.3, 1.2, 0.3])
    f = jax.jit(lambda point: observed(point, control, coupled))
    scale = jnp.abs(f(point))[:, None] / point + 1e-3 / point
    forward = jax.jit(jax.jacfwd(f))(point) / scale
    reverse = jax.jit(jax.jacrev(f))(point) / scale
    steps = 1e-4 * jnp.diag(point)
    differences = jnp.stack([(f(point + h) - f(point - h)) / (2.0 * jnp.sum(h)) for h in steps], 1) / scale
    np.testing.assert_allclose(forward, differences, atol=CENTRAL_DIFFERENCE)
    np.testing.assert_allclose(reverse, forward, atol=MODES)
    assert np.all(np.max(np.abs(differences), 0) > 0.01), NAMES
