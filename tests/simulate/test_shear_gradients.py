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


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", ["alone", *(pytest.param(kind, marks=pytest.mark.long) for kind in ("coupled", "adhesive"))]
)
def test_without_friction_the_derivative_by_its_coefficient_is_that_of_gross_slip(kind):
    """No cell has a traction yet: the force grows by the load along the way of the indenter, and the work by that times the
    way. With coupling the pressure moves the surface too: one-sided differences stand in the place of the closed form.
    """
    way, more = np.array([3e-6, 4e-6]), {"coupled": kind == "coupled", "tolerance": 1e-12}
    if kind == "adhesive":
        more |= {"adhesion": jc.ExponentialAdhesion(0.5, 2e-6), "shear_strength": 0.0}

    @jax.jit
    def sheared(mu):
        history = jc.shear(
            jc.LayeredHalfSpace([], jc.Elastic(1e9, 0.3)), jc.Sphere(10e-3), jc.Load(10.0),
            jc.TangentialDisplacement(jnp.stack([jnp.zeros(2), way])), [0.0, 1.0], friction=mu, grid=GRID, **more,
        )  # fmt: skip
        carried = history.pressure if kind != "adhesive" else history.contact_pressure
        force, work = history.tangential_load[-1], history.dissipated[-1]
        return jnp.append(force, work / 1e-6), GRID.cell_area * jnp.sum(carried[-1]), history.slip[-1]

    _, carried, slip = sheared(0.0)
    touched = np.hypot(*slip) > 0.0
    force = float(carried) * way / 5e-6
    # the work of a step is the mean of the bounds before and after it times the slip, and the load is constant
    expected = np.append(force, float(carried) * 5e-6 / 1e-6)
    if kind == "coupled":
        steps = (1e-4, 2e-4)
        once, twice = ((sheared(h)[0] - sheared(0.0)[0]) / h for h in steps)
        expected = 2.0 * once - twice
    else:
        np.testing.assert_allclose(slip[:, touched], -np.broadcast_to(way[:, None], slip[:, touched].shape))
    forward = jax.jit(jax.jacfwd(lambda mu: sheared(mu)[0]))(0.0)
    reverse = jax.jit(jax.jacrev(lambda mu: sheared(mu)[0]))(0.0)
    np.testing.assert_allclose(forward, expected, rtol=1e-5)
    np.testing.assert_allclose(reverse, forward, rtol=MODES)
