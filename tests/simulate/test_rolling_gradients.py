"""Derivatives of steady rolling: reverse, forward and central differences, by creepage or force, friction and materials."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bodies import STEEL
from tolerances import CENTRAL_DIFFERENCE, MODES

import jaxcontact as jc
from jaxcontact.simulate.roll_steady import ahead

RUBBER = jc.StandardLinearSolid(2e6, 1e6, 1e3, nu=0.45)
LINE = jc.Grid((48, 1), (6e-6, 1e-3), periodic=(False, True))
CASES = {
    "line": (jc.Cylinder(9.5e-3, 1e-3, STEEL), LINE, 200.0, lambda g: jc.Elastic(g * 80e9, 0.3), 1e-3, False),
    "coupled ball": (
        jc.Sphere(9.5e-3, STEEL), jc.Grid.square(16, 300e-6), 20.0, lambda g: jc.Elastic(g * 60e9, 0.2), 1e-3, True),
    "line that creeps": (
        jc.Cylinder(9.5e-3, 1e-3), LINE, 2e-3, lambda g: RUBBER.scaled(g), 1e-3, False),
}  # fmt: skip


@pytest.mark.parametrize("way", [(0.5, 0.0), (0.0, 0.3), (-0.4, 0.0), (0.0, 0.0)])
def test_by_a_component_of_zero_a_step_has_the_mean_derivative_of_both_sides(way):
    """The step is linear on either side of it, so that central differences are exact."""
    field, way = jnp.asarray(np.random.default_rng(1).normal(size=(2, 5, 4))), jnp.asarray(way)
    slopes = jax.jit(jax.jacfwd(ahead, 1))(field, way)
    differences = [(ahead(field, way + h) - ahead(field, way - h)) / 0.2 for h in 0.1 * jnp.eye(2)]
    np.testing.assert_allclose(slopes, jnp.stack(differences, -1), atol=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "forced"),
    [
        ("line", False),
        pytest.param("coupled ball", True, marks=pytest.mark.long),
        pytest.param("line that creeps", False, marks=pytest.mark.long),
    ],
)
def test_derivatives_reverse_forward_and_central(name, forced):
    """Of the force that a creepage takes, or the creepage of a force; what touches, sticks and slips is held."""
    indenter, grid, load, material, creepage, coupled = CASES[name]

    def solved(drive, friction, stiffness):
        given = jnp.stack([drive * creepage, 0.2 * drive * creepage])
        if forced:
            given = jc.TangentialLoad(0.3 * load * given / creepage)
        found = jc.roll_steady(
            jc.LayeredHalfSpace([], material(stiffness)), indenter, jc.Load(load), velocity=0.5, creepage=given,
            friction=0.6 * friction, grid=grid, coupled=coupled, tolerance=1e-11,
        )  # fmt: skip
        return (found.creepage if forced else found.tangential_load)[0] * (
            1.0 / creepage if forced else 1.0 / load
        )

    outcome, at = jax.jit(lambda x: solved(*x)), jnp.ones(3)
    forward, reverse = jax.jacfwd(outcome)(at), jax.grad(outcome)(at)
    np.testing.assert_allclose(reverse, forward, rtol=10 * MODES)
    steps = 3e-4 * np.eye(3)
    differences = [(outcome(at + step) - outcome(at - step)) / 6e-4 for step in steps]
    np.testing.assert_allclose(
        forward, differences, rtol=CENTRAL_DIFFERENCE, atol=CENTRAL_DIFFERENCE * np.max(np.abs(forward))
    )
    # a derivative in which the right side of the linear system depends on the coefficient alone
    if name == "line":
        alone = jax.grad(lambda friction: solved(1.0, friction, 1.0))(1.0)
        np.testing.assert_allclose(alone, forward[1], rtol=10 * MODES)


@pytest.mark.slow
def test_a_strict_tolerance_holds_for_the_steady_state():
    """At a tolerance of 1e-11 the derivatives of the force are its central differences within 2e-7.

    By velocity, friction, creepage and load. From a state that is steady to a change of 1e-7 a step they are 3e-6 off.
    """
    body = jc.LayeredHalfSpace([], jc.StandardLinearSolid(2e9, 1e9, 40e9, nu=0.35))
    roller = jc.Cylinder(5e-3, 1e-3, jc.Elastic(80e9, 0.3))
    grid = jc.Grid((21, 1), (9e-6, 1e-3), periodic=(False, True))
    values = np.array([2e-6, 0.3, 1e-3, 0.8])

    @jax.jit
    def force(scaled):
        velocity, friction, creepage, load = scaled * values
        return jc.roll_steady(
            body, roller, jc.Load(load), velocity=velocity, creepage=jnp.stack([creepage, 0.0]), friction=friction,
            grid=grid, coupled=False, tolerance=1e-11,
        ).tangential_load[0]  # fmt: skip

    one, step = np.ones(4), 1e-4
    differences = [(force(one + step * each) - force(one - step * each)) / (2 * step) for each in np.eye(4)]
    np.testing.assert_allclose(jax.grad(force)(one), differences, rtol=2e-7)


@pytest.mark.slow
@pytest.mark.parametrize("velocity", [(0.7, 0.0), (0.0, -0.7)])
def test_the_speed_has_no_effect_on_elastic_bodies(velocity):
    """Only the direction of rolling matters: the derivative along the velocity is zero, that across it is not."""
    body, ball = jc.LayeredHalfSpace([], STEEL), jc.Sphere(9.5e-3, STEEL)
    grid = jc.Grid.square(n=16, width=300e-6)

    def force(velocity):
        rolled = jc.roll_steady(
            body, ball, jc.Load(20.0), velocity=velocity, creepage=(1e-3, 2e-4), friction=0.3, grid=grid,
            coupled=False,
        )  # fmt: skip
        return rolled.tangential_load

    along = np.array(velocity)
    slopes = jax.jacfwd(force)(along)
    np.testing.assert_array_equal(slopes @ np.abs(np.sign(along)), 0.0)
    assert np.all(np.isfinite(slopes)) and np.any(slopes @ np.abs(np.sign(along[::-1])) != 0.0)


@pytest.mark.slow
def test_the_slope_of_free_rolling_is_that_of_both_modes():
    """At a creepage of zero, where no cell slips, and all lengths of slip and traction are zero."""
    body, ball = jc.LayeredHalfSpace([], STEEL), jc.Sphere(9.5e-3, STEEL)
    grid = jc.Grid.square(n=16, width=300e-6)

    def force(creepage):
        rolled = jc.roll_steady(
            body, ball, jc.Load(20.0), velocity=1.0, creepage=jnp.stack([creepage, 0.0]), friction=0.3, grid=grid,
            coupled=False,
        )  # fmt: skip
        return rolled.tangential_load[0]

    slope = jax.grad(force)(0.0)
    np.testing.assert_allclose(slope, jax.jacfwd(force)(0.0), rtol=1e-8)
    np.testing.assert_allclose(slope, force(1e-7) / 1e-7, rtol=1e-5)
