"""``roll_steady`` with adhesion: the contact at rest, full slip and sliding, Kalker's slope, the limit without attraction,
what cannot be solved, derivatives."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from peeling import BALL, NU, RADIUS, REACH, UNITS, WORK, G
from scipy.optimize import brentq
from test_adhesive_films import averages
from tolerances import MODES

import jaxcontact as jc
from jaxcontact._support.status import Status
from jaxcontact.reference import maugis

LAW = jc.ExponentialAdhesion(WORK, 0.3 * REACH)
GRID = jc.Grid.square(n=32, width=4.5 * UNITS.radius)
SMALL = jc.Grid.square(n=20, width=6.0 * UNITS.radius)
SOFT, SPONGY = jc.Elastic(G, NU), jc.Elastic(G, 0.3)  # under a rigid ball without and with coupling
SMOOTH = jc.ExponentialAdhesion(WORK, 0.6 * REACH)
NEAR = jc.Approach(0.6 * UNITS.approach)


def rolled(body, ball, control, creepage, friction, strength, *, law=LAW, grid=GRID, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.roll_steady(
            body if isinstance(body, jc.LayeredHalfSpace) else jc.LayeredHalfSpace([], body), ball, control,
            creepage=jnp.asarray(creepage), friction=friction, shear_strength=strength, adhesion=law, grid=grid,
            **{"velocity": UNITS.radius} | options,
        )  # fmt: skip


@pytest.mark.long
def test_pressed_it_is_a_contact_at_rest_and_slipping_it_carries_friction_on_what_contact_carries():
    """Johnson, Kendall and Roberts' contact; and mu times the sum of net pressure and attraction, which is computed here
    from the gap with averages of the law that are written out, plus the strength of all that touches."""
    like = jc.Elastic(2.0 * G, NU)  # two of which are as compliant as one of G under a rigid ball
    slid = rolled(like, jc.Sphere(RADIUS, like), jc.Approach(UNITS.approach), (1e4, 0.0), 0.3, 0.05 * G)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pressed = jc.indent(
            jc.LayeredHalfSpace([], jc.Elastic(G, NU)), BALL, jc.Approach(UNITS.approach), [0.0], grid=GRID,
            adhesion=LAW,
        )  # fmt: skip
    peak = float(pressed.pressure.max())
    assert int(slid.status) == 0 and float(slid.sticking_share) == 0.0
    np.testing.assert_allclose(slid.pressure, pressed.pressure[0], atol=1e-6 * peak)
    for name in ("load", "cohesive_cells", "tabor_number"):
        np.testing.assert_allclose(getattr(slid, name), getattr(pressed, name)[0], rtol=1e-6)
    jkr = brentq(lambda a: float(maugis.jkr(a)[1]) - 1.0, 0.9, 5.0)
    # JKR is the limit of large Tabor numbers, here 3.3, as in ``test_adhesive_shear``
    assert float(slid.contact_radius) / UNITS.radius == pytest.approx(jkr, rel=0.05)

    matrix, weights = averages(GRID.shape[0])
    gap = np.maximum(slid.gap, 0.0)
    attraction = (
        matrix.T @ (np.outer(weights, weights) * np.asarray(LAW.traction(matrix @ gap @ matrix.T))) @ matrix
    )
    touching = np.asarray(slid.in_contact)
    carried = np.sum((np.asarray(slid.pressure) + attraction)[touching]) * float(GRID.cell_area)
    force = 0.3 * carried + 0.05 * G * np.sum(touching) * float(GRID.cell_area)
    assert carried > 3.0 * abs(float(slid.load)) and float(slid.load) < 0.0
    np.testing.assert_allclose(slid.tangential_load, [force, 0.0], rtol=1e-6, atol=1e-6 * force)


@pytest.mark.long
def test_a_small_creepage_takes_kalkers_force_whatever_the_friction():
    """C11 = 5.20 of like solids at nu = 0.5 (J. J. Kalker, 1990, table E3), with the contact radius."""
    slopes = []
    for friction, strength in ((0.3, 0.05 * G), (0.0, G)):
        found = rolled(SOFT, BALL, NEAR, (1e-6, 0.0), friction, strength, coupled=False, tolerance=1e-9)
        assert int(found.status) == 0 and float(found.sticking_share) == 1.0
        slopes.append(float(found.tangential_load[0]) / 1e-6)
    np.testing.assert_allclose(slopes, slopes[0], rtol=1e-6)
    # rolling is of first order in the size of a cell
    kalker = 5.20 * 2.0 * G * float(found.contact_radius) ** 2
    assert slopes[0] == pytest.approx(kalker, rel=0.05)


@pytest.mark.slow
def test_without_attraction_it_is_the_contact_without_adhesion():
    """The effect of an attraction is in proportion to it: 7.7e-6, 7.7e-8 and 7.7e-9 at 1e-6, 1e-8 and 1e-9 of the work."""
    faint = jc.ExponentialAdhesion(1e-10 * WORK, REACH)
    load = jc.Load(0.5 * UNITS.load)
    for creepage in (1e-4, 0.1):
        weak = rolled(SPONGY, BALL, load, (creepage, 0.0), 0.3, 0.0, law=faint, grid=SMALL, tolerance=1e-10)
        none = rolled(SPONGY, BALL, load, (creepage, 0.0), 0.3, None, law=None, grid=SMALL, tolerance=1e-10)
        assert int(weak.status) == int(none.status) == 0
        assert none.contact_pressure is None and none.shear_strength is None
        for name in ("pressure", "traction", "slip_ratio", "tangential_load", "friction_power"):
            expected = np.asarray(getattr(none, name))
            atol = 1e-8 * np.max(np.abs(expected))
            np.testing.assert_allclose(getattr(weak, name), expected, atol=atol, err_msg=name)


@pytest.mark.long
def test_without_friction_and_where_all_slips_it_is_steady_sliding():
    """On a solid that creeps and is compressible, whose pressure the traction changes; there ``slide_steady`` finds the
    traction together with the pressure."""
    body = jc.LayeredHalfSpace([], jc.StandardLinearSolid(3.0 * G, 1.5 * G, 1.5 * G, nu=0.3))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        given = {"velocity": UNITS.radius, "grid": SMALL, "adhesion": SMOOTH, "tolerance": 1e-10}
        sliding = {
            (mu, tau): jc.slide_steady(body, BALL, NEAR, friction=mu, shear_strength=tau, **given)
            for mu, tau in ((0.0, 0.0), (0.3, 0.04 * G))
        }
    for (mu, tau), expected in sliding.items():
        found = rolled(body, BALL, NEAR, (1e6, 0.0), mu, tau, law=SMOOTH, grid=SMALL, tolerance=1e-10)
        assert int(found.status) == int(expected.status) == 0
        for name in ("pressure", "contact_pressure", "traction", "displacement", "load", "hysteresis_power"):
            value = np.asarray(getattr(expected, name))
            atol = 1e-6 * np.max(np.abs(value))
            np.testing.assert_allclose(getattr(found, name), value, rtol=0.0, atol=atol, err_msg=name)
    changed = np.max(np.abs(sliding[0.0, 0.0].pressure - expected.pressure))
    assert changed > 0.02 * float(expected.pressure.max()) and float(expected.hysteresis_power) > 0.0


@pytest.mark.long
def test_what_cannot_be_solved_has_a_status():
    alone = {"law": SMOOTH, "grid": SMALL, "coupled": False}
    few = rolled(SOFT, BALL, NEAR, (0.1, 0.0), 0.3, 0.0, max_iterations=2, **alone)
    assert int(few.status) == Status.NOT_CONVERGED
    apart = rolled(SPONGY, BALL, jc.Load(-3.0 * UNITS.load), (0.1, 0.0), 0.3, 1e4, **alone)
    assert int(apart.status) == Status.PULLED_OFF
    for name in ("pressure", "traction", "tangential_load", "contact_pressure"):
        assert np.all(getattr(apart, name) == 0.0)


@pytest.mark.long
def test_creepages_are_mapped_inside_jit():
    at = lambda xi: rolled(
        SOFT, BALL, NEAR, jnp.stack([xi, 0.0 * xi]), 0.3, 0.0, law=SMOOTH, grid=SMALL, coupled=False
    )
    force = lambda xi: at(xi).tangential_load[0]
    some = jnp.array([0.05, 0.2])
    np.testing.assert_allclose(jax.jit(jax.vmap(force))(some), [force(xi) for xi in some], rtol=1e-7)


@pytest.mark.long
@pytest.mark.parametrize(("creeps", "coupled", "forced"), [(False, True, False), (True, False, True)])
def test_derivatives_are_those_of_central_differences(creeps, coupled, forced):
    """By modulus, work and range of the attraction, friction, shear strength, approach or load, creepage or force, radius,
    speed and spin; what touches, sticks and slips is held."""
    grid = jc.Grid.square(n=16, width=6.0 * UNITS.radius)

    def ends(q):
        solid = jc.Elastic(G * q[0], 0.3)
        if creeps:
            solid = jc.StandardLinearSolid(3.0 * G * q[0], 1.5 * G, 1.5 * G, nu=0.3)
        law = jc.ExponentialAdhesion(WORK * q[1], 0.8 * REACH * q[2])
        control = jc.Approach(0.6 * UNITS.approach * q[5])
        creepage = jnp.array([0.04, 0.02]) * q[6]
        if forced:
            control = jc.Load(-0.4 * UNITS.load * q[5])
            creepage = jc.TangentialLoad(jnp.array([0.8, 0.2]) * q[6] * UNITS.load)
        found = jc.roll_steady(
            jc.LayeredHalfSpace([], solid), jc.Sphere(RADIUS * q[7]), control, velocity=0.7 * UNITS.radius * q[8],
            creepage=creepage, spin=0.01 / UNITS.radius * q[9], friction=0.25 * q[3], shear_strength=0.05 * G * q[4],
            adhesion=law, grid=grid, coupled=coupled, tolerance=1e-11,
        )  # fmt: skip
        forces = (
            jnp.append(found.tangential_load, jnp.stack([found.load, found.hysteresis_force])) / UNITS.load
        )
        moment = found.moment / (UNITS.load * UNITS.radius)
        power = found.friction_power / (UNITS.load * UNITS.radius)
        numbers = jnp.stack([found.approach / UNITS.approach, moment, power])
        share = jnp.where(found.status == 0, found.sticking_share, -1.0)
        return jnp.concatenate([forces, found.creepage, numbers]), share

    at, step = jnp.ones(10), 1e-5
    both = jax.jit(ends)
    run = lambda q: both(q)[0]
    assert 0.2 < float(both(at)[1]) < 0.9
    forward = jax.jit(jax.jacfwd(run))(at)
    sides = [(run(at.at[i].add(step)) - run(at.at[i].add(-step))) / (2.0 * step) for i in range(10)]
    np.testing.assert_allclose(forward, jnp.stack(sides, 1), atol=1e-6 * np.abs(forward).max())
    weights = jnp.cos(jnp.arange(9.0))
    reverse = jax.jit(jax.grad(lambda q: weights @ run(q)))(at)
    np.testing.assert_allclose(reverse, weights @ forward, atol=100.0 * MODES * np.abs(forward).max())
