"""Given pressures, at rest and in motion: closed forms, a hereditary integral, a wheel on a pavement, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.special import ellipe, ellipk, j0, j1

import jaxcontact as jc
from jaxcontact.simulate.deflection import _least_substeps


def under_a_disc(r, a):
    """u E/(2 (1 - nu^2) p a) at a distance r from the centre of a uniform disc on a half-space (K. L. Johnson, Contact
    Mechanics, 1985, Eqs. 3.29)."""
    r = np.asarray(r, float)
    inner, outer = np.minimum(r / a, 1.0) ** 2, np.minimum(a / np.maximum(r, 1e-12), 1.0) ** 2
    outside = ellipe(outer) - (1.0 - outer) * ellipk(np.minimum(outer, 1.0 - 1e-15))
    return 2.0 / np.pi * np.where(r <= a, ellipe(inner), r / a * outside)


def disc(grid, a):
    """The share of each cell within a radius a, of the area of the disc in all."""
    x, y = map(np.asarray, grid.coordinates())
    (dx, dy), part = grid.spacing, (np.arange(20) - 9.5) / 20.0
    inside = (x[..., None, None] + part[:, None] * dx) ** 2 + (y[..., None, None] + part * dy) ** 2 < a**2
    share = inside.mean((-1, -2))
    return share * np.pi * a**2 / (share.sum() * dx * dy)


@pytest.mark.slow
def test_a_uniform_disc_on_an_elastic_half_space():
    """Moving or not: 2 % at the edge, which crosses cells, 0.1 % elsewhere outside."""
    body = jc.LayeredHalfSpace([], jc.Elastic.from_young(50e6, nu=0.35))
    grid = jc.Grid.square(n=41, width=2.05)
    x, y = map(np.asarray, grid.coordinates())
    exact = 2.0 * (1.0 - 0.35**2) * 0.7e6 * 0.3 / 50e6 * under_a_disc(np.hypot(x, y), 0.3)
    for velocity in (0.0, (3.0, -2.0)):
        found = jc.deflection(body, grid, 0.7e6 * disc(grid, 0.3), [0.0, 0.2], velocity=velocity)
        np.testing.assert_allclose(found.displacement, np.stack([exact, exact]), rtol=0.02)
        far = np.hypot(x, y) > 0.6
        np.testing.assert_allclose(found.displacement[1][far], exact[far], rtol=1e-3)
        assert not found.notes and not np.any(found.status)


@pytest.mark.slow
@pytest.mark.parametrize("base", ["none", "bonded", "loose"])
def test_a_wave_that_moves_over_a_body_that_creeps(base):
    """On a periodic grid p cos k(X - v t) lowers a half-space, or a layer bonded to a rigid base or loose on it, by
    Re J*(k v) e^(i k x) times (1 - nu) p/k and a closed form of k h; the mean pressure lowers a layer by p h over its
    oedometric modulus, (1 - 2 nu)/(2 (1 - nu)) J."""
    nu, length, n, v, h = 0.4, 1e-3, 16, 2e-3, 2e-4
    solid = jc.StandardLinearSolid(G1=1e6, G2=5e5, eta2=1e5, nu=nu)
    k, grid = 2.0 * np.pi / length, jc.Grid((n, 4), (length / n, length / n), periodic=True)
    compliance = 1.0 / 1e6 + 1.0 / (5e5 + 1e5j * k * v)
    x, kh, K = np.broadcast_to(grid.coordinates()[0], grid.shape), k * h, 3.0 - 4.0 * nu
    shape, mean = {
        "none": (1.0, 0.0),
        "bonded": (
            (K * np.sinh(2 * kh) - 2 * kh) / (K * np.cosh(2 * kh) + 2 * kh**2 + (1 + K**2) / 2),
            h * (1 - 2 * nu) / (2 * (1 - nu)),
        ),
        "loose": ((np.cosh(2 * kh) - 1) / (np.sinh(2 * kh) + 2 * kh), h * (1 - 2 * nu) / (2 * (1 - nu))),
    }[base]
    layer = jc.Layer(solid, h, bonded=base == "bonded")
    body = jc.LayeredHalfSpace([], solid) if base == "none" else jc.LayeredHalfSpace([layer], None)
    found = jc.deflection(body, grid, 1e3 * np.cos(k * x) + 3e2, np.linspace(0.0, 8.0, 5), velocity=v)
    moving = (1.0 - nu) / k * shape * 1e3 * np.real(np.conj(compliance) * np.exp(1j * k * x))
    still = mean * 3e2 * (1.0 / 1e6 + 1.0 / 5e5)
    np.testing.assert_allclose(found.displacement[-1], moving + still, atol=1e-7 * np.max(moving))
    assert not found.notes and not np.any(found.status)


@pytest.mark.slow
def test_a_disc_that_moves_over_a_maxwell_half_space():
    """u = J0 D(r(T)) + integral of D(r(s))/eta ds at a place beside the path, D of the disc; a load that grows, too."""
    G, eta, nu, a, v = 30e6, 40e6, 0.4, 0.15, 2.0
    body = jc.LayeredHalfSpace([], jc.Maxwell(G, eta, nu=nu))
    grid = jc.Grid((97, 15), (0.05, 0.05))
    times, beside = np.linspace(0.0, 1.0, 6), 0.3
    start = -1.0  # of the load; the place is at x = 0
    at = start + v * times
    column, row = 48 - np.round(at / 0.05).astype(int), 7 + 6
    shape = lambda s: 0.7e6 * a * (1.0 - nu) * under_a_disc(np.hypot(start + v * s, beside), a)
    s = np.linspace(0.0, 1.0, 20001)
    for growth in (0.0, 1.5):
        pressure = 0.7e6 * disc(grid, a) * (1.0 + growth * times)[:, None, None]
        found = jc.deflection(body, grid, pressure, times, velocity=v)
        flow = shape(s) * (1.0 + growth * s) / eta
        flowed = np.concatenate([[0.0], np.cumsum((flow[1:] + flow[:-1]) / 2.0)]) * s[1]
        exact = shape(times) * (1.0 + growth * times) / G + np.interp(times, s, flowed)
        ours = np.asarray(found.displacement)[np.arange(6), column, row]
        np.testing.assert_allclose(ours, exact, rtol=3e-3)


# The pavement of ALVA's validation with ELLVA_VD: the point is 300 mm beside the path, the load at X.
X = np.array([-3.0, -1.0, -0.5, 0.0, 0.05, 0.5, 1.0, 3.0])
PUBLISHED = np.array([0.182, 0.447, 0.605, 0.786, 0.791, 0.658, 0.474, 0.190])  # [mm]
SPEED, RADIUS, PRESSURE = 60.0 / 3.6, 0.15, 1.1e6


def asphalt():
    """A Prony series of D = Dinf + (D0 - Dinf)/(1 + (t/tau)^n) over the times of the passage, J = 2 (1 + nu) D."""
    D = lambda t: 1e-8 + (2.5e-11 - 1e-8) / (1.0 + (t / 1000.0) ** 0.35)
    t, tau = np.geomspace(1e-6, 1.0, 300), np.geomspace(1e-6, 3.0, 20)
    columns = np.concatenate([np.ones((300, 1)), 1.0 - np.exp(-t[:, None] / tau)], 1)
    found = 2.6 * nnls(columns / D(t)[:, None], np.ones(300))[0]
    some = found[1:] > 0.0
    return jc.Prony(J0=found[0], J=found[1:][some], tau=tau[some], nu=0.3)


def pavement():
    """Layers of 150 and 600 mm on a deep base."""
    middle = jc.Layer(jc.Elastic.from_young(200e6, nu=0.35), 0.6)
    return jc.LayeredHalfSpace([jc.Layer(asphalt(), 0.15), middle], jc.Elastic.from_young(40e6, nu=0.4))


def hereditary(body, places):
    """The deflection at the point by the hereditary integral of the axisymmetric response to a disc, with N(k, t).

    u = K(r(T), 0) + sum over lags of the increase of K at the distance at which the load was; K is the half-space's under
    short waves plus an integral over wavenumbers of the rest.
    """
    panels = np.concatenate([[0.0], np.geomspace(1e-3, 4.0, 24), np.arange(5.0, 100.0, 1.0)])
    nodes, weights = np.polynomial.legendre.leggauss(8)
    k = ((panels[1:, None] + panels[:-1, None]) / 2.0 + np.diff(panels)[:, None] / 2.0 * nodes).ravel()
    w = (np.diff(panels)[:, None] / 2.0 * weights).ravel()
    lags = np.concatenate([[0.0], np.geomspace(1e-6, (places.max() + 5.0) / SPEED, 500)])
    top = body.layers[0].material
    short = 0.7 * np.asarray(jax.vmap(top.creep)(lags))
    rest = np.asarray(jax.jit(jc.normal_response)(body, k, lags[:, None])) * k - short[:, None]

    def kernel(r, n):
        return (
            PRESSURE
            * RADIUS
            * (short[n] * under_a_disc(r, RADIUS) + np.sum(w / k * rest[n] * j1(k * RADIUS) * j0(k * r)))
        )

    found = []
    for X in places:
        total, last = kernel(np.hypot(X, 0.3), 0), (X + 5.0) / SPEED
        for n in np.flatnonzero(lags[1:] <= last * (1.0 + 1e-9)) + 1:
            was = np.hypot(X - SPEED * (lags[n] + lags[n - 1]) / 2.0, 0.3)
            total += kernel(was, n) - kernel(was, n - 1)
        found.append(total)
    return np.array(found)


@pytest.mark.long
def test_a_wheel_on_a_creeping_pavement():
    """Within 0.3 % of the hereditary integral, within 3 % of the published deflections."""
    body, grid = pavement(), jc.Grid((129, 15), (0.05, 0.05))
    times = np.append(0.0, (X + 5.0) / SPEED)
    found = jc.deflection(body, grid, PRESSURE * disc(grid, RADIUS), times, velocity=SPEED)
    column = 64 - np.round(X / 0.05).astype(int)
    ours = np.asarray(found.displacement)[np.arange(1, 9), column, 7 + 6]
    np.testing.assert_allclose(ours, hereditary(body, X), rtol=3e-3)
    np.testing.assert_allclose(ours * 1e3, PUBLISHED, rtol=0.03)


SMALL = jc.Grid((16, 8), (0.1, 0.1))
TYRE = disc(SMALL, 0.2)


@pytest.mark.parametrize(
    "speeds", [(1.0, -1.0), (4.0, -4.0), (0.0, 4.0), (4.0, 4.0), (0.0, 0.0), (-20.0, -19.0)]
)
def test_inner_steps_are_as_many_as_a_velocity_that_changes_needs(speeds):
    """None is longer than half the width of 1.6 m in 1 s, or a tenth of a cell off the way, also where a reversal returns
    to its start."""
    velocity, (start, end) = np.stack([speeds, np.zeros(2)], 1), speeds
    n = _least_substeps(velocity, np.array([0.0, 1.0]), SMALL)

    def fits(n):
        way = lambda t: start * t + (end - start) * t**2 / 2.0
        ends = np.arange(n + 1) / n
        middle = (way(ends[1:]) + way(ends[:-1])) / 2.0 - way((ends[1:] + ends[:-1]) / 2.0)
        return np.all(np.abs(np.diff(way(ends))) < 0.8 + 1e-9) and np.all(np.abs(middle) < 0.01 + 1e-9)

    assert fits(n) and (n == 1 or not fits(n - 1))


@pytest.mark.slow
def test_a_load_that_goes_and_returns_between_two_times_has_moved():
    body = jc.LayeredHalfSpace([], jc.Maxwell(1.0, 2.0, nu=0.4))
    there_and_back = np.array([[1.0, 0.0], [-1.0, 0.0]])
    move = lambda **given: jc.deflection(body, SMALL, TYRE, [0.0, 1.0], velocity=there_and_back, **given)
    found, fine, at_rest = move(), move(substeps=40), move(substeps=1)
    error = lambda each: np.max(np.abs(each.displacement - fine.displacement)[-1]) / np.max(fine.displacement)
    assert error(found) < 0.01 < 0.05 < error(at_rest)


@pytest.mark.slow
@pytest.mark.parametrize(
    "velocity", [0.0, 0.2, np.array([[0.2, 0.0], [0.1, 0.0], [-0.1, 0.1]])], ids=["rest", "one", "many"]
)
def test_a_known_velocity_inside_jit(velocity):
    """The inner steps follow from the velocity, which is known where the pressure is traced."""
    body, grid = (
        jc.LayeredHalfSpace([], jc.StandardLinearSolid(1.0, 1.0, 1.0, nu=0.3)),
        jc.Grid.square(16, 1.6),
    )
    x, y = grid.coordinates()
    p, times = np.exp(-8.0 * (x**2 + y**2)), np.array([0.0, 0.5, 1.0])
    moved = lambda p: jc.deflection(body, grid, p, times, velocity=velocity).displacement
    np.testing.assert_allclose(jax.jit(moved)(p), moved(p), rtol=1e-9)
    of_pressure = jax.jit(jax.grad(lambda p: jnp.sum(moved(p))))(p)
    assert jnp.sum(of_pressure * p) == pytest.approx(float(jnp.sum(moved(p))), rel=1e-9)  # it is linear


def test_a_track_that_is_too_long_for_its_times_or_not_finite_is_refused():
    far = lambda v: jc.deflection(pavement(), SMALL, np.ones(SMALL.shape), [0.0, 1.0], velocity=v)
    with pytest.raises(
        ValueError, match=r"times \[s\]: expected steps of at most 500 widths .* got 1250: pass more"
    ):
        far(2000.0)
    for value in (np.nan, np.inf):
        with pytest.raises(ValueError, match=r"velocity \[m/s\]: expected finite"):
            far(value)


def answer(theta):
    """A deflection beside the path for (G, eta, thickness, pressure, speed)."""
    G, eta, h, p, v = theta
    body = jc.LayeredHalfSpace([jc.Layer(jc.Maxwell(G, eta, nu=0.4), h)], jc.Elastic(20.0, 0.3))
    found = jc.deflection(body, SMALL, p * TYRE, jnp.array([0.0, 0.3, 0.5]), velocity=v)
    return found.displacement[-1, 6:10, 3]


@pytest.mark.long
def test_derivatives_in_both_modes():
    theta, f = jnp.array([1.0, 2.0, 0.15, 0.3, 0.8]), jax.jit(answer)
    steps = 1e-5 * np.diag(np.asarray(theta))
    differences = np.stack([(f(theta + s) - f(theta - s)) / (2 * s.sum()) for s in steps], 1)
    for derivative in (jax.jacfwd, jax.jacrev):
        np.testing.assert_allclose(jax.jit(derivative(f))(theta), differences, rtol=1e-6, atol=1e-9)
