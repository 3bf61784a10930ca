"""Steady rolling: Kalker's creepage coefficients, the force that saturates, and what is lost."""

import functools

import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.reference import hertz

G, NU, RADIUS, LOAD, MU = 80e9, 0.25, 10e-3, 10.0, 0.3
SOLID = jc.Elastic(G, NU)
RAIL, WHEEL = jc.LayeredHalfSpace([], SOLID), jc.Sphere(RADIUS, SOLID)
A = float(hertz.contact_radius(LOAD, RADIUS, 2 * (1 - NU) / G))
GRID = jc.Grid.square(32, 2.4 * A)


@functools.cache
def rolled(xi_x, xi_y, friction=MU, velocity=1.0):
    return jc.roll_steady(
        RAIL, WHEEL, jc.Load(LOAD), velocity=velocity, creepage=(xi_x, xi_y), friction=friction, grid=GRID,
        coupled=False,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("direction", "coefficient"), [((1.0, 0.0), 4.12), ((0.0, 1.0), 3.67)])
def test_without_slip_the_force_is_kalkers(direction, coefficient):
    """F = C G a^2 xi; C11 = 4.12 and C22 = 3.67 for a round contact and nu = 0.25 (J. J. Kalker, Three-Dimensional
    Elastic Bodies in Rolling Contact, 1990, table E3). It is 0.8 and 1.1 % more at 30 cells a radius, 1.1 and 1.3 here."""
    state = rolled(1e-4 * direction[0], 1e-4 * direction[1], friction=5.0)
    assert bool(state.converged)
    force = np.asarray(state.tangential_load) / (1e-4 * G * A**2)
    np.testing.assert_allclose(force, coefficient * np.array(direction), atol=0.015 * coefficient)


@pytest.mark.slow
def test_the_force_saturates_as_vermeulen_and_johnson_measured():
    """F/(mu W) = 1 - (1 - C xi G a^2/(3 mu W))^3, which is within 5 % (K. L. Johnson, Contact Mechanics, Eq. 8.47)."""
    one = MU * LOAD / (4.12 * G * A**2)
    for share in (0.5, 1.0, 2.0):
        force = float(rolled(share * one, 0.0).tangential_load[0]) / (MU * LOAD)
        assert force == pytest.approx(1.0 - (1.0 - share / 3.0) ** 3, rel=0.06)
    fast = rolled(6.0 * one, 0.0)
    assert not np.any(fast.stick)
    assert float(fast.tangential_load[0]) == pytest.approx(MU * LOAD, rel=1e-3)


@pytest.mark.slow
def test_rolling_obeys_the_law_of_friction_and_sticks_at_its_leading_edge():
    """And what friction takes from cell to cell is what the force loses, to the first order in the cell."""
    state = rolled(MU * LOAD / (4.12 * G * A**2), 0.0)
    p, q, slip = (np.asarray(a) for a in (state.pressure, state.traction, state.slip_ratio))
    stick, size, slid = np.asarray(state.stick), np.hypot(*q), np.hypot(*slip)
    assert np.max(size - MU * p) <= 1e-12 * np.max(p)
    assert np.max(np.where(stick, slid, 0.0)) < 1e-6 * np.max(slid)
    turned = np.where((p > 0.0) & ~stick, np.sum(q * slip, 0) + MU * p * slid, 0.0)
    assert np.max(turned) < 1e-6 * np.max(MU * p * slid)
    x = np.broadcast_to(np.asarray(GRID.coordinates()[0]), stick.shape)
    assert np.mean(x[stick]) > 0.2 * A > 0.0 > np.mean(x[(p > 0.0) & ~stick])
    heat = -np.sum(q * slip) * float(GRID.cell_area)
    assert heat == pytest.approx(float(state.power), rel=0.12)


@pytest.mark.slow
def test_rolling_back_is_rolling_forwards_seen_in_a_mirror():
    one = MU * LOAD / (4.12 * G * A**2)
    forwards, backwards = rolled(one, 0.0), rolled(one, 0.0, velocity=-2.0)
    np.testing.assert_allclose(
        backwards.traction[0], forwards.traction[0][::-1], atol=1e-5 * np.max(forwards.traction)
    )
    assert float(backwards.power) == pytest.approx(2.0 * float(forwards.power), rel=1e-5)


@pytest.mark.long
def test_rolling_along_y_and_askew():
    """Along y it is rolling along x with the axes exchanged; askew the force is Kalker's, along the creepage."""
    one = MU * LOAD / (4.12 * G * A**2)
    along_x, along_y = rolled(one, 0.0, velocity=(1.0, 0.0)), rolled(0.0, one, velocity=(0.0, 2.0))
    turned = np.swapaxes(np.asarray(along_x.traction)[::-1], 1, 2)
    np.testing.assert_allclose(along_y.traction, turned, atol=1e-5 * np.max(turned))
    assert float(along_y.power) == pytest.approx(2.0 * float(along_x.power), rel=1e-5)
    askew = rolled(0.6e-4, 0.8e-4, friction=100.0, velocity=(0.6, 0.8))
    force = np.asarray(askew.tangential_load) / (1e-4 * G * A**2)
    np.testing.assert_allclose(force, 4.12 * np.array([0.6, 0.8]), rtol=0.05)


@pytest.mark.slow
def test_rolling_with_the_force_that_a_creepage_takes():
    one = MU * LOAD / (4.12 * G * A**2)
    force = jc.TangentialLoad(rolled(one, 0.0).tangential_load)
    found = jc.roll_steady(
        RAIL, WHEEL, jc.Load(LOAD), velocity=1.0, creepage=force, friction=MU, grid=GRID, coupled=False
    )
    np.testing.assert_allclose(found.creepage, [one, 0.0], rtol=1e-4, atol=1e-4 * one)


@pytest.mark.slow
def test_unlike_solids_creep_in_free_rolling():
    """Without a force, a soft rail under a rigid wheel: drawn in by the pressure it is stretched, so that the wheel
    creeps; more so the more the solids differ, and not at all where nu = 0.5 takes the coupling away."""
    free = jc.TangentialLoad((0.0, 0.0))
    creepages = [
        float(
            jc.roll_steady(
                jc.LayeredHalfSpace([], jc.Elastic(1e9, nu)), jc.Sphere(RADIUS), jc.Load(LOAD), velocity=1.0,
                creepage=free, friction=MU, grid=jc.Grid.square(24, 1.2e-3),
            ).creepage[0]
        )
        for nu in (0.2, 0.4, 0.5)
    ]  # fmt: skip
    assert abs(creepages[0]) > abs(creepages[1]) > 1e-5
    assert abs(creepages[2]) < 1e-9


@pytest.mark.slow
def test_a_film_of_the_material_of_the_substrate_is_no_film():
    """On an elastic body; and its strain is that of a film that is pressed at rest."""
    ball, grid = jc.Sphere(RADIUS), jc.Grid.square(16, 2.4 * A)
    film = jc.LayeredHalfSpace([jc.Layer(SOLID, 0.5 * A)], SOLID)

    def rolled(body):
        return jc.roll_steady(
            body,
            ball,
            jc.Load(LOAD),
            velocity=1.0,
            creepage=(1e-3, 0.0),
            friction=MU,
            grid=grid,
            coupled=False,
        )

    coated, plain = rolled(film), rolled(RAIL)
    for name in ("pressure", "traction", "tangential_load", "approach"):
        expected = np.asarray(getattr(plain, name))
        np.testing.assert_allclose(getattr(coated, name), expected, atol=1e-4 * np.max(np.abs(expected)))
    pressed = jc.indent(film, ball, jc.Load(LOAD), [0.0], grid=grid)
    assert float(coated.film_strain) == pytest.approx(float(pressed.film_strain[0]), rel=1e-6)
