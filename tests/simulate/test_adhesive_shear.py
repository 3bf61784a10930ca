"""``shear`` with adhesion: a sticking contact, a slipping one, a constant shear strength in closed form, the work of a
cycle, the limit without adhesion, derivatives."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from peeling import BALL, NU, REACH, UNITS, WORK, G, approaching
from scipy.optimize import brentq
from test_adhesive_films import averages

import jaxcontact as jc
from jaxcontact._support.status import Status
from jaxcontact.reference import maugis

LAW = jc.ExponentialAdhesion(WORK, 0.3 * REACH)
GRID = jc.Grid.square(n=40, width=5.0 * UNITS.radius)
SOLID = jc.Elastic(G, NU)


def along_x(values):
    return jnp.stack([jnp.asarray(values), jnp.zeros(np.size(values))], 1)


def moved(values):
    """Tangential displacements in units of radius."""
    return jc.TangentialDisplacement(along_x(values) * UNITS.radius)


def sheared(tangential, friction, strength=None, *, solid=SOLID, control=None, law=LAW, grid=GRID, **options):
    count = np.shape(tangential.value)[0]
    control = approaching(np.ones(count)) if control is None else control
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.shear(
            jc.LayeredHalfSpace([], solid), BALL, control, tangential, np.arange(float(count)), friction=friction,
            shear_strength=strength, grid=grid, coupled=False, adhesion=law, **options,
        )  # fmt: skip


@pytest.mark.slow
def test_a_contact_that_sticks_is_a_disc_and_one_that_slips_carries_friction_on_what_contact_carries():
    """Johnson, Kendall and Roberts' contact with Q = 8 G a d/(2 - nu) below a rigid ball, and mu times the sum of net
    pressure and attraction, which is computed here from the gap with averages of the law that are written out."""
    held = sheared(moved([0.0, 1e-3]), 1e4)
    a = float(held.contact_radius[-1])
    assert not np.any(held.status) and np.all(held.sticking_share == 1.0)
    jkr = brentq(lambda a: float(maugis.jkr(a)[1]) - 1.0, 0.9, 5.0) * UNITS.radius
    assert a == pytest.approx(jkr, rel=0.05)  # at a Tabor number of 3.3
    disc = 8.0 * G * a / (2.0 - NU) * 1e-3 * UNITS.radius
    assert float(held.tangential_load[1, 0]) == pytest.approx(disc, rel=0.015)  # 0.8 % on 48 cells

    slid = sheared(moved([0.0, 1.0]), 0.3)
    matrix, weights = averages(GRID.shape[0])
    gap, pressure = np.maximum(slid.gap[1], 0.0), np.asarray(slid.pressure[1])
    attraction = (
        matrix.T @ (np.outer(weights, weights) * np.asarray(LAW.traction(matrix @ gap @ matrix.T))) @ matrix
    )
    carried = np.where(slid.in_contact[1], pressure + attraction, 0.0).sum() * float(GRID.cell_area)
    assert carried > 3.0 * abs(float(slid.load[1])) and float(slid.load[1]) < 0.0
    assert float(slid.tangential_load[1, 0]) == pytest.approx(0.3 * carried, rel=2e-3)  # some slip aside
    assert float(slid.sticking_share[1]) == 0.0
    np.testing.assert_allclose(slid.pressure[1], held.pressure[1], atol=1e-6 * float(held.pressure.max()))


@pytest.mark.long
def test_a_function_that_saves_sees_the_pressure_that_contact_carries():
    """The net pressure plus the attraction at a gap of zero, w/z, less where it is linear to a neighbour with a gap."""
    grid, path = jc.Grid.square(16, 6.0 * UNITS.radius), moved([0.0, 0.1])
    kept = sheared(path, 0.3, 0.01 * G, grid=grid, save=lambda step: (step.contact_pressure, step.pressure))
    carried, pressure = kept.saved
    whole = sheared(path, 0.3, 0.01 * G, grid=grid)
    np.testing.assert_array_equal(carried, whole.contact_pressure)
    middle = (slice(None), slice(7, 9), slice(7, 9))
    assert np.all(np.asarray(whole.pressure)[middle] < np.asarray(carried)[middle])
    np.testing.assert_allclose((carried - pressure)[middle], WORK / (0.3 * REACH), rtol=1e-6)
    none = sheared(path, 0.3, law=None, grid=grid, save=lambda step: step.contact_pressure)
    assert none.saved is None


@pytest.mark.long
def test_a_constant_shear_strength_slips_from_the_edge_as_a_cohesive_zone():
    """A ring c < r < a at the strength around a disc that sticks, at nu = 0 (the mode II counterpart of D. Maugis, J.
    Colloid Interface Sci. 150 (1992) 243, with 4 G* in place of E*, 1/G* = 2/G):

        d = tau sqrt(a^2 - c^2)/(2 G*),      Q = 2 tau (a^2 arccos(c/a) + c sqrt(a^2 - c^2)).

    The cells that touch have a larger area than the circle of the contact radius, by 4.7, 1.7 and 1.2 % on 24, 48 and 96
    cells, and Q is too large by up to 3.5, 1.3 and 0.9 %.
    """
    tau, solid = 0.05 * G, jc.Elastic(G, 0.0)
    a = float(
        sheared(
            moved([0.0]), 0.0, tau, solid=solid, grid=jc.Grid.square(48, 5.0 * UNITS.radius)
        ).contact_radius[0]
    )
    inner = np.array([0.9, 0.7, 0.4]) * a
    ring = np.sqrt(a**2 - inner**2)
    path = np.append(0.0, tau * ring / G) / UNITS.radius  # 2 G* = G
    run = sheared(moved(path), 0.0, tau, solid=solid, grid=jc.Grid.square(48, 5.0 * UNITS.radius))
    load = 2.0 * tau * (a**2 * np.arccos(inner / a) + inner * ring)
    assert not np.any(run.status)
    np.testing.assert_allclose(run.tangential_load[1:, 0], load, rtol=0.014)
    np.testing.assert_allclose(np.sqrt(run.sticking_share[1:]), inner / a, atol=0.04)
    total = sheared(moved([0.0, 0.5]), 0.0, tau, solid=solid)
    assert float(total.tangential_load[1, 0]) == pytest.approx(tau * float(total.contact_area[1]), rel=1e-4)


@pytest.mark.long
def test_the_loop_of_a_cycle_is_the_work_of_friction_and_too_large_a_load_slips():
    tau = 0.05 * G
    quarter = np.linspace(0.0, 0.08, 9)
    path = np.concatenate([quarter, quarter[-2::-1], -quarter[1:], -quarter[-2::-1], quarter[1:]])
    run = sheared(moved(path), 0.1, tau, grid=jc.Grid.square(24, 5.0 * UNITS.radius))
    assert not np.any(run.status)
    cycle = slice(8, 41)  # from the first largest displacement to the second
    x, force = path[cycle] * UNITS.radius, np.asarray(run.tangential_load[cycle, 0])
    loop = np.sum(np.diff(x) * (force[1:] + force[:-1]) / 2.0)
    assert float(run.dissipated[40] - run.dissipated[8]) == pytest.approx(loop, rel=0.01)
    assert force[-1] == pytest.approx(force[0], rel=1e-4)
    work = np.asarray(run.friction_work)
    assert work.sum() * float(run.grid.cell_area) == pytest.approx(float(run.dissipated[-1]), rel=1e-9)

    area = float(run.contact_area[0])
    for share, status in ((0.95, Status.FINE), (1.05, Status.GROSS_SLIP)):
        push = jc.TangentialLoad(along_x([0.0, share * tau * area]))
        assert int(sheared(push, 0.0, tau, grid=run.grid).status[1]) == status


@pytest.mark.long
def test_a_vanishing_attraction_leaves_the_contact_without_and_a_contact_that_is_pulled_off_lets_go():
    weak = jc.ExponentialAdhesion(1e-7 * WORK, 0.05 * REACH)
    path = moved([0.0, 0.02, 0.03])
    with_it, without = (sheared(path, 0.3, law=law) for law in (weak, None))
    assert not np.any(with_it.status) and not np.any(without.status)
    np.testing.assert_allclose(
        with_it.tangential_load, without.tangential_load, rtol=1e-4, atol=1e-5 * UNITS.load
    )
    np.testing.assert_allclose(with_it.traction, without.traction, atol=2e-3 * float(without.traction.max()))
    np.testing.assert_allclose(with_it.dissipated[1:], without.dissipated[1:], rtol=1e-3)

    away = sheared(moved([0.0, 0.02, 0.02]), 0.3, 0.01 * G, control=approaching([1.0, 0.0, -3.0]))
    assert float(away.tangential_load[1, 0]) > 0.0 and int(away.jumps[-1]) == 1
    assert np.all(away.traction[-1] == 0.0) and float(away.tangential_load[-1, 0]) == 0.0


@pytest.mark.long
@pytest.mark.parametrize("forced", [False, True])
def test_derivatives_are_those_of_central_differences(forced):
    """On a creeping solid in partial slip: by modulus, work and range of the attraction, friction, shear strength, approach
    or load, and what shears."""
    grid = jc.Grid.square(20, 6.0 * UNITS.radius)

    def ends(q):
        solid = jc.StandardLinearSolid(G * q[0], G, G, nu=NU)
        law = jc.ExponentialAdhesion(WORK * q[1], 0.5 * REACH * q[2])
        normal = jc.Approach(jnp.array([1.0, 1.1]) * q[5] * UNITS.approach)
        push = moved(jnp.array([0.0, 0.25]) * q[6])
        if forced:
            normal = jc.Load(jnp.array([0.4, 0.5]) * q[5] * UNITS.load)
            push = jc.TangentialLoad(along_x(jnp.array([0.0, 1.2]) * q[6] * UNITS.load))
        run = sheared(
            push, 0.2 * q[3], 0.04 * G * q[4], solid=solid, control=normal, law=law, grid=grid, tolerance=1e-12,
            max_iterations=8000,
        )  # fmt: skip
        last = jnp.stack([run.load[-1], run.tangential_load[-1, 0]]) / UNITS.load
        way = jnp.stack(
            [run.approach[-1] / UNITS.approach, run.tangential_displacement[-1, 0] / UNITS.radius]
        )
        stuck = jnp.sum(run.stick[-1]) / jnp.sum(run.in_contact[-1])
        return jnp.concatenate([last, way, run.dissipated[-1:] / (UNITS.load * UNITS.radius)]), stuck

    at, step = jnp.ones(7), 1e-6
    run = jax.jit(lambda q: ends(q)[0])
    assert 0.2 < float(ends(at)[1]) < 0.9
    backward = jax.jit(jax.jacrev(run))(at)
    sides = [(run(at.at[i].add(step)) - run(at.at[i].add(-step))) / (2.0 * step) for i in range(7)]
    np.testing.assert_allclose(backward, jnp.stack(sides, 1), atol=1e-6 * np.abs(backward).max())
    np.testing.assert_allclose(jax.jit(jax.jacfwd(run))(at), backward, atol=1e-8 * np.abs(backward).max())
