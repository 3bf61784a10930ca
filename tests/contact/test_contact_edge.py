"""The edge of a contact, found below the cell: its place, its slope, and that it moves between the cells."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bodies import GLASS
from tolerances import CENTRAL_DIFFERENCE

import jaxcontact as jc

BALL = jc.Sphere(5e-3)
GRID = jc.Grid.square(64, 260e-6)


def hertz_radius(load):
    """(3 W R (1 - nu)/(8 G))^(1/3) of a rigid ball (K. L. Johnson, Contact Mechanics, 1985, section 4.2)."""
    return (3.0 * load * 5e-3 * 0.75 / (8.0 * 30e9)) ** (1.0 / 3.0)


def radius(log_load, control=jc.Load, scale=20.0):
    control = control(scale * jnp.exp(log_load))
    return jc.indent(GLASS, BALL, control, [0.0], grid=GRID, tolerance=1e-11).contact_radius[0]


@pytest.mark.slow
def test_the_radius_moves_between_the_cells():
    """Loads that move Hertz's edge by a twentieth of a cell: no step is a cell, and none is missed."""
    cell = 260e-6 / 64
    exact = 98e-6 + 0.05 * cell * np.arange(21)
    loads = np.log(exact**3 / hertz_radius(1.0) ** 3 / 20.0)
    found = np.array([float(radius(load)) for load in loads])
    np.testing.assert_allclose(found, exact, atol=0.05 * cell)
    assert np.all(np.abs(np.diff(found) / (0.05 * cell) - 1.0) < 0.25)


@pytest.mark.slow
def test_the_slope_of_the_radius_is_that_of_hertz():
    """d log a/d log W = 1/3; by forward and reverse mode and by central differences over which no cell enters."""
    slope = jax.grad(radius)(0.0)
    assert float(slope / radius(0.0)) == pytest.approx(1.0 / 3.0, rel=0.05)
    assert float(jax.jvp(radius, (0.0,), (1.0,))[1]) == pytest.approx(float(slope), rel=1e-8)
    step = 1e-5
    central = float(radius(step) - radius(-step)) / (2 * step)
    assert central == pytest.approx(float(slope), rel=CENTRAL_DIFFERENCE * 10)


@pytest.mark.slow
def test_without_contact_radius_and_slope_are_zero():
    assert jax.value_and_grad(lambda q: radius(q, jc.Approach, -1e-7))(0.0) == (0.0, 0.0)
    assert jax.value_and_grad(lambda q: radius(q, jc.Load, 0.0))(0.0) == (0.0, 0.0)


@pytest.mark.slow
def test_a_flat_punch_ends_with_its_cells():
    """A wall has no gap to go by: the radius is that of the cells under the punch, to 0.15 of a cell."""
    history = jc.indent(GLASS, jc.FlatPunch(60e-6), jc.Load(20.0), [0.0], grid=GRID)
    counted = float(jnp.sqrt(history.contact_area[0] / jnp.pi))
    assert float(history.contact_radius[0]) == pytest.approx(counted, abs=0.15 * 260e-6 / 64)
