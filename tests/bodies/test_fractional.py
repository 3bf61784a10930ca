"""Fractional materials against Mittag-Leffler's series, the power law, and Hertz's contact as it creeps."""

import jax
import mpmath as mp
import numpy as np
import pytest
from scipy import special

import jaxcontact as jc

TIMES = np.geomspace(1e-2, 1e3, 41)


def mittag_leffler(alpha, z):
    """E_alpha(-z) to 30 digits: its power series with digits to spare, or the asymptotic one where z is large."""
    if z > 1e2:
        return -mp.fsum((-mp.mpf(z)) ** -k * mp.rgamma(1 - alpha * mp.mpf(k)) for k in range(1, 12))
    digits = 40 + int(z ** (1.0 / alpha))
    terms = int(digits * 6 / alpha) + 40
    with mp.workdps(digits):
        a, z = mp.mpf(alpha), mp.mpf(z)
        return mp.fsum((-z) ** k * mp.rgamma(1 + a * k) for k in range(terms))


@pytest.mark.parametrize("alpha", [0.1, 0.5, 0.95])
def test_kelvin_voigt_creep_is_that_of_mittag_leffler(alpha):
    law = jc.FractionalKelvinVoigt(G=2e3, V=5e3, alpha=alpha)
    z = np.array([1e-8, 1e-3, 0.4, 1.2, 1e4])  # (t/tau)^alpha
    J = law.creep((z * 5e3 / 2e3) ** (1.0 / alpha))
    with mp.workdps(30):
        exact = [float((1 - mittag_leffler(alpha, value)) / 2e3) for value in z]
    np.testing.assert_allclose(J, exact, rtol=1e-9)
    assert float(law.creep(0.0)) == 0.0


@pytest.mark.parametrize("tolerance", [1e-2, 1e-7])
@pytest.mark.parametrize("alpha", [0.05, 0.5, 0.95])
def test_the_cut_of_a_power_law_keeps_its_error(alpha, tolerance):
    exact = 3e-4 + TIMES**alpha / (700.0 * special.gamma(1 + alpha))
    cut = jc.FractionalMaxwell(G=1.0 / 3e-4, V=700.0, alpha=alpha).prony(TIMES[0], TIMES[-1], tolerance)
    np.testing.assert_allclose(cut.creep(TIMES), exact, rtol=tolerance)
    assert min(float(np.min(cut.J)), float(cut.J0), float(cut.fluidity)) > 0.0


@pytest.mark.parametrize("tolerance", [1e-2, 1e-7])
@pytest.mark.parametrize("tau", [1e-6, 1.0, 1e7])
def test_the_cut_of_a_kelvin_voigt_solid_keeps_its_error(tau, tolerance):
    """E_1/2(-x) = erfcx(x), with the retardation before, among and after the times."""
    exact = (1.0 - special.erfcx(np.sqrt(TIMES / tau))) / 50.0
    law = jc.FractionalKelvinVoigt(G=50.0, V=50.0 * np.sqrt(tau), alpha=0.5)
    np.testing.assert_allclose(law.prony(TIMES[0], TIMES[-1], tolerance).creep(TIMES), exact, rtol=tolerance)


@pytest.mark.parametrize("alpha", [0.05, 0.8, 0.95, 0.98, 0.999])
def test_the_cut_of_other_orders_keeps_its_error(alpha):
    """Against the creep that is checked above, for which the mode of a dashpot is the hard one."""
    law = lambda order: jc.FractionalKelvinVoigt(G=50.0, V=80.0, alpha=order)
    cut = lambda order: law(order).prony(1e-2, 1e3, 1e-5).creep(TIMES)
    np.testing.assert_allclose(cut(alpha), law(alpha).creep(TIMES), rtol=1e-5)
    np.testing.assert_allclose(jax.jit(cut)(alpha), law(alpha).creep(TIMES), rtol=1e-5)


def test_derivatives_of_the_cut_are_those_of_the_law():
    """d log J/d alpha = log t - digamma(1 + alpha), d log J/d log V = -1 of a springpot."""
    log_creep = lambda law: jax.numpy.log(law.prony(1e-2, 1e3, 1e-6).creep(TIMES))
    slope = jax.jit(jax.jacfwd(log_creep))(jc.Springpot(V=3.0, alpha=0.4))
    np.testing.assert_allclose(slope.alpha, np.log(TIMES) - special.digamma(1.4), atol=1e-5)
    np.testing.assert_allclose(3.0 * slope.V, -1.0, rtol=1e-5)


@pytest.mark.slow
def test_a_ball_sinks_into_a_springpot_as_a_power_of_time():
    """A rigid ball under a load that steps on: approach^(3/2) = 3 (1 - nu) W J(t)/(8 sqrt(R)), in closed form."""
    V, alpha, R, W, times = 400.0, 0.3, 1e-3, 1e-5, np.array([0.0, 1.0, 10.0, 100.0])
    body = jc.LayeredHalfSpace([], jc.Springpot(V=V, alpha=alpha, nu=0.5).prony(1.0, 100.0))
    ball = jc.Sphere(R)
    grid = jc.Grid.around(body, ball, jc.Load(W), times, n=64)
    run = jc.indent(body, ball, jc.Load(W), times, grid=grid, substeps=16)
    J = times[1:] ** alpha / (V * special.gamma(1 + alpha))
    np.testing.assert_allclose(run.approach[1:] ** 1.5, 3.0 * 0.5 * W * J / (8.0 * np.sqrt(R)), rtol=5e-3)
    np.testing.assert_allclose(run.approach[1:] / run.approach[-1], (J / J[-1]) ** (2.0 / 3.0), rtol=3e-3)
