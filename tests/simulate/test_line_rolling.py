"""Line contacts with friction in plane strain: Cattaneo, Carter, Bentall and Johnson, and rollers on what creeps."""

import functools

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ive, kve

import jaxcontact as jc
from jaxcontact.reference import hunter
from jaxcontact.response.coefficients import TangentialImages, tangential_lines

RADIUS, HALF, WIDTH, MU = 10e-3, 1e-4, 2e-3, 0.3  # half: of the contact
G, NU = 80e9, 0.3
STEEL = jc.Elastic(G, NU)
COMPLIANCE = 2.0 * (1.0 - NU) / G  # of two solids
LOAD = np.pi * HALF**2 / (2.0 * RADIUS * COMPLIANCE) * WIDTH
NODES, WEIGHTS = np.polynomial.legendre.leggauss(60)


def line(n, width):
    return jc.Grid((n, 1), (width / n, WIDTH), periodic=(False, True))


# influence coefficients ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("z", [0.7, 5.0])
def test_line_coefficients_are_integrals_of_line_loads_over_a_strip(z):
    """-ln(r^2/d^2)/(2 pi) along and across, d the width of the grid, and -atan(x/z)/pi, off and on the strip."""
    h, n = 2.0, 6
    # of L, T and K: at z = 0, and what z adds
    weights = np.array([[[0.4, 2.0]], [[0.7, 1.0]], [[0.3, -3.0]]])
    found = tangential_lines(
        jc.Grid((n, 1), (h, 1.0), periodic=(False, True)),
        TangentialImages(jnp.array([0.0, z]), jnp.asarray(weights)),
    )
    (L0, L), (T0, T), (K0, K) = weights[:, 0]
    for i in range(1, n):
        x = h * i + 0.5 * h * NODES
        sum_of = lambda f: 0.5 * h * np.sum(WEIGHTS * f)
        shallow = sum_of(-np.log((x / (n * h)) ** 2)) / (2 * np.pi)
        deeper = sum_of(-np.log1p((z / x) ** 2)) / (2 * np.pi)
        assert float(found.xx[0, i, 0]) == pytest.approx(L0 * shallow + L * deeper, rel=1e-12)
        assert float(found.yy[0, i, 0]) == pytest.approx(T0 * shallow + T * deeper, rel=1e-12)
        drawn = -0.5 * h * K0 + K * sum_of(np.arctan(z / x)) / np.pi
        assert float(found.x[0, i, 0]) == pytest.approx(drawn, rel=1e-12)
    assert float(found.x[0, 0, 0]) == 0.0
    assert not np.any(found.xy) and not np.any(found.y)


# shear --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_cattaneo_and_mindlin_in_plane_strain_and_across_it():
    """c = a sqrt(1 - Q/(mu P)), q = mu p0 [sqrt(1 - x^2/a^2) - (c/a) sqrt(1 - x^2/c^2)] for two similar solids, and the
    same across the line, where it slips in anti-plane shear (K. L. Johnson, Contact Mechanics, 1985, section 7.2)."""
    share, grid = 0.6, line(240, 3.0 * HALF)
    rail, roller = jc.LayeredHalfSpace([], STEEL), jc.Cylinder(RADIUS, WIDTH, STEEL)
    stuck = HALF * np.sqrt(1.0 - share)
    x, p0 = np.asarray(grid.axes()[0]), 2.0 * LOAD / WIDTH / (np.pi * HALF)
    ellipse = lambda c: np.sqrt(np.maximum(1.0 - (x / c) ** 2, 0.0))
    exact = MU * p0 * (ellipse(HALF) - stuck / HALF * ellipse(stuck))
    for axis in (0, 1):
        push = jc.TangentialLoad(share * MU * LOAD * np.eye(2)[axis])
        found = jc.shear(rail, roller, jc.Load(LOAD), push, [0.0], friction=MU, grid=grid, coupled=False)
        assert np.all(np.asarray(found.status) == jc.Status.FINE)
        traction = np.asarray(found.traction)[0, :, :, 0]
        assert np.sum(np.abs(traction[axis] - exact)) < 2e-3 * np.sum(exact)
        assert np.max(np.abs(traction[1 - axis])) < 1e-9 * MU * p0
        sticks = np.sum(np.asarray(found.stick)) * float(grid.spacing[0]) / 2.0
        assert sticks == pytest.approx(stuck, abs=float(grid.spacing[0]))


# elastic rolling ----------------------------------------------------------------------------------------------


@functools.cache
def tractive(share, n=192):
    grid = line(n, 3.0 * HALF)
    return jc.roll_steady(
        jc.LayeredHalfSpace([], STEEL), jc.Cylinder(RADIUS, WIDTH, STEEL), jc.Load(LOAD), velocity=1.0,
        creepage=(share * MU * HALF / RADIUS, 0.0), friction=MU, grid=grid, coupled=False,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.3, 0.7])
def test_carters_force_over_creepage(share):
    """Q/(mu P) = 1 - (1 - |xi| R/(mu a))^2, R the relative radius (here the roller's): with q = mu p less mu p0 (c/a) times
    an ellipse of half-width c beside the leading edge, u' = -mu (a - c)/R in stick is the creepage. F. W. Carter, Proc. R.
    Soc. A 112 (1926) 151; K. L. Johnson, Contact Mechanics (1985), section 8.3. First order in the cell: 0.3 % here."""
    state = tractive(share)
    assert bool(state.converged)
    assert float(state.tangential_load[0]) / (MU * LOAD) == pytest.approx(1.0 - (1.0 - share) ** 2, rel=5e-3)
    x = np.asarray(state.grid.axes()[0])[np.asarray(state.stick)[:, 0]]
    cell = float(state.grid.spacing[0])
    assert x.min() == pytest.approx((1.0 - 2.0 * (1.0 - share)) * HALF, abs=2.0 * cell)
    assert x.max() == pytest.approx(HALF, abs=cell)
    assert float(state.power) == pytest.approx(
        float(state.tangential_load[0]) * share * MU * HALF / RADIUS, rel=1e-12
    )


@pytest.mark.slow
def test_a_roller_that_creeps_too_far_slides():
    state = tractive(1.3)
    assert not np.any(state.stick)
    assert float(state.tangential_load[0]) == pytest.approx(MU * LOAD, rel=1e-9)


SOFT, SOFT_NU = 1e9, 0.2
BETA = (1.0 - 2.0 * SOFT_NU) / (2.0 * (1.0 - SOFT_NU))  # Dundurs' of a soft rail under a rigid roller
SOFT_LOAD = np.pi * HALF**2 / (2.0 * RADIUS) * SOFT / (1.0 - SOFT_NU) * WIDTH  # of Hertz


@pytest.mark.long
def test_unlike_rollers_roll_freely_with_the_creepage_of_bentall_and_johnson():
    """xi R/(beta a), a of Hertz: where all sticks, sqrt(b^2 - x^2) ((b + x)/(b - x))^(i eta) is proportional to p + i q,
    eta = ln((1 + beta)/(1 - beta))/(2 pi), and solves the coupled equations with xi = 2 eta b/R, b^2 = a^2/(1 + 4 eta^2);
    where all slips, the slip beta A p - xi changes sign where half of the load is within. There mu p |slip| is lost,
    although no tangential force does any work (0.9 % less at mu = 0.003, 0.1 % at 0.001).

    R. H. Bentall, K. L. Johnson, Int. J. Mech. Sci. 9 (1967) 389; K. L. Johnson, Contact Mechanics (1985), section 8.2.
    """
    grid = line(256, 2.6 * HALF)

    def rolled(friction):
        state = jc.roll_steady(
            jc.LayeredHalfSpace([], jc.Elastic(SOFT, SOFT_NU)), jc.Cylinder(RADIUS, WIDTH), jc.Load(SOFT_LOAD),
            velocity=2.0, creepage=jc.TangentialLoad((0.0, 0.0)), friction=friction, grid=grid,
        )  # fmt: skip
        assert bool(state.converged)
        return float(state.creepage[0]) * RADIUS / (BETA * HALF), float(state.power)

    eta = np.log((1.0 + BETA) / (1.0 - BETA)) / (2.0 * np.pi)
    stuck, lost_stuck = rolled(3.0)
    assert stuck == pytest.approx(2.0 * eta / BETA / np.sqrt(1.0 + 4.0 * eta**2), rel=0.02)
    angle = brentq(lambda t: t + np.sin(t) * np.cos(t) - np.pi / 4.0, 0.0, 1.0)
    slid, lost = rolled(0.003)
    assert slid == pytest.approx(np.cos(angle), rel=0.02)
    x = (np.arange(4000) + 0.5) / 4000
    half_ellipse = np.sqrt(1.0 - x**2)
    slip = 4.0 / np.pi * np.mean(half_ellipse * np.abs(half_ellipse - np.cos(angle))) * BETA * HALF / RADIUS
    assert lost == pytest.approx(2.0 * 0.003 * SOFT_LOAD * slip, rel=0.02)
    assert abs(lost_stuck) < 1e-3 * lost


# rolling on what creeps ---------------------------------------------------------------------------------------

J0, J1, TAU = 1e-6, 4e-6, 1.0
LONG = J0 + J1


def rubber(nu):
    return jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=1.0 / J0, G2=1.0 / J1, eta2=TAU / J1, nu=nu))


def roll_on(body, load, speed, creepage, friction, n=96):
    return jc.roll_steady(
        body, jc.Cylinder(RADIUS, WIDTH), jc.Load(load * WIDTH), velocity=speed, creepage=(creepage, 0.0),
        friction=friction, grid=line(n, 30.0 * HALF),
    )  # fmt: skip


def adhering(contact, speed, creepage, nu):
    """Force per length under a creepage of an incompressible standard solid that sticks to a cylinder all over.

    With the method of S. C. Hunter (``reference.hunter``): q + tau' v q' = g on -1 < s < 1 from the leading edge, u'
    constant within, so that

        g = (c0 + c1 s) f + d (f + (1 + s) f'),    f = 1/sqrt(1 - s^2),    c1 = xi/((1 - nu) J(infinity)),

    the last part for the singular traction at the trailing edge, in Hadamard's sense. It ends there, and the slope goes on
    smoothly at the leading edge:

        c0 I0 + c1 I1 - d zeta (I0 + I1) = 0 at zeta,     c0 K0 - c1 K1 + d z (K1 - K0) = 0 at z,     Q' = pi a c0.
    """
    zeta, z = contact.zeta, contact.half_width / (TAU * speed)
    c1 = creepage / ((1.0 - nu) * LONG)
    rows = [
        [ive(0, zeta), -zeta * (ive(0, zeta) + ive(1, zeta))],
        [kve(0, z), z * (kve(1, z) - kve(0, z))],
    ]
    c0, _ = np.linalg.solve(rows, [-c1 * ive(1, zeta), c1 * kve(1, z)])
    return np.pi * contact.half_width * c0


@pytest.mark.slow
@pytest.mark.parametrize("speed", [1e-5, 3e-4, 1e-3, 0.3])
def test_an_adhering_cylinder_is_driven_by_what_creeps(speed):
    """From the relaxed solid to the one of the first instant, a fifth as compliant; 0.1 % at twice the cells."""
    half, creepage = 1e-3, 1e-3
    contact = hunter.of_half_width(half, speed, RADIUS, J0, J1, TAU, 0.5)
    state = roll_on(rubber(0.5), contact.load, speed, creepage, 20.0)
    assert bool(state.converged)
    force = float(state.tangential_load[0]) / WIDTH
    assert force == pytest.approx(adhering(contact, speed, creepage, 0.5), rel=0.02)
    lost = contact.friction * contact.load * WIDTH * speed  # Hunter, whatever the traction: nu = 0.5
    assert float(state.hysteresis_power) == pytest.approx(lost, rel=0.02)
    assert float(state.power) == pytest.approx(lost + force * WIDTH * creepage * speed, rel=0.02)


@pytest.mark.long
def test_rolling_slowly_is_on_the_relaxed_solid_and_fast_on_that_of_the_first_instant():
    """With coupling, stick and slip; speed does not count beyond."""
    load, xi, mu = 20.0, 2e-3, 0.4
    for speed, compliance in ((1e-8, LONG), (1e3, J0)):
        elastic = jc.LayeredHalfSpace([], jc.Elastic(1.0 / compliance, 0.3))
        found, expected = (roll_on(body, load, speed, xi, mu) for body in (rubber(0.3), elastic))
        assert 3 < np.sum(expected.stick) < np.sum(np.asarray(expected.pressure) > 0) - 3
        for name in ("pressure", "traction"):
            exact = np.asarray(getattr(expected, name))
            np.testing.assert_allclose(getattr(found, name), exact, atol=2e-3 * np.max(exact))


@pytest.mark.slow
def test_without_friction_rolling_is_sliding():
    """In pressure, approach and place of the contact."""
    state = roll_on(rubber(0.3), 20.0, 1e-3, 1e-3, 1e-9)
    slid = jc.slide_steady(
        rubber(0.3), jc.Cylinder(RADIUS, WIDTH), jc.Load(20.0 * WIDTH), velocity=1e-3, grid=state.grid
    )
    np.testing.assert_allclose(state.pressure, slid.pressure, atol=1e-6 * np.max(slid.pressure))
    assert float(state.approach) == pytest.approx(float(slid.approach), rel=1e-6)
    assert float(slid.pressure_centre[0]) > 1e-5
    exact = hunter.of_load(20.0, 1e-3, RADIUS, J0, J1, TAU, 0.3)
    resistance = exact.friction * 20.0 * WIDTH
    assert float(state.hysteresis_force) == pytest.approx(resistance, rel=0.01)
    assert float(state.power) == pytest.approx(resistance * 1e-3, rel=0.01)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:only")  # few cells: that the contact is coarse is known
def test_what_left_the_grid_is_still_felt():
    """By a ball that rolls askew: on a grid of twice the width, where it has not left yet, it is the same."""
    body = jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=1e6, G2=0.5e6, eta2=0.5e6, nu=0.3))

    def rolled(n):
        return jc.roll_steady(
            body, jc.Sphere(5e-3), jc.Load(0.05), velocity=(1.6e-3, 1.2e-3), creepage=(0.02, -0.01), friction=0.5,
            grid=jc.Grid((n, n), (1e-4, 1e-4)),
        )  # fmt: skip

    narrow, wide = rolled(16), rolled(32)
    assert bool(narrow.converged) and bool(wide.converged)
    np.testing.assert_allclose(narrow.tangential_load, wide.tangential_load, rtol=3e-5)
    within = np.asarray(wide.traction)[:, 8:24, 8:24]
    np.testing.assert_allclose(narrow.traction, within, atol=2e-3 * np.max(np.abs(within)))


@pytest.mark.long
def test_a_film_that_creeps_is_rolled_on_as_on_its_elastic_limits():
    film = jc.StandardLinearSolid(G1=4e9, G2=2e9, eta2=2e9, nu=0.3)

    def rolled(material, speed):
        body = jc.LayeredHalfSpace([jc.Layer(material, 2e-5)], jc.Elastic(G, NU))
        return jc.roll_steady(
            body, jc.Cylinder(RADIUS, 1e-3), jc.Load(20.0), velocity=speed, creepage=(2e-3, 0.0), friction=0.3,
            grid=jc.Grid((64, 1), (3e-4 / 64, 1e-3), periodic=(False, True)),
        )  # fmt: skip

    for speed, modulus in ((1e-9, 1.0 / (1.0 / 4e9 + 1.0 / 2e9)), (1e4, 4e9)):
        found, expected = rolled(film, speed), rolled(jc.Elastic(modulus, 0.3), 1.0)
        assert bool(found.converged)
        for name in ("pressure", "traction"):
            exact = np.asarray(getattr(expected, name))
            np.testing.assert_allclose(getattr(found, name), exact, atol=1e-4 * np.max(np.abs(exact)))
