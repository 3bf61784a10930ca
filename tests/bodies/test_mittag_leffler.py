"""The Mittag-Leffler function and the moduli of fractional laws, against integrals and series with 40 digits."""

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest
from scipy import special

import jaxcontact as jc
from jaxcontact._support.exponential import mittag_leffler

mp.mp.dps = 40


def reference(x, alpha):
    """E_alpha(-x): its power series with digits to spare, or where x is large the Laplace transform of its spectrum."""
    x, a = mp.mpf(x), mp.mpf(alpha)
    if x <= 1:
        return mp.fsum((-x) ** k * mp.rgamma(1 + a * k) for k in range(int(300 / alpha)))
    u = mp.log(x) / a

    def density(w):  # of rates exp(w)
        y = mp.e ** (a * w)
        return (
            mp.sin(mp.pi * a)
            / mp.pi
            * y
            / (y**2 + 2 * y * mp.cos(mp.pi * a) + 1)
            * mp.e ** -(mp.e ** (w + u))
        )

    return mp.quad(density, [-u + z for z in (-300 / a, -100 / a, -30 / a, -10 / a, -5, -2, 0, 2, 3, 5, 6)])


@pytest.mark.slow
@pytest.mark.parametrize("alpha", [0.03, 0.4, 0.8, 0.98])
def test_the_function_and_its_complement_at_all_arguments(alpha):
    x = np.array([1e-200, 1e-12, 1e-3, 0.3, 0.9, 1.6, 5.0, 40.0, 1e4, 1e12])
    decay, rise = mittag_leffler(x, alpha)
    exact = [reference(value, alpha) for value in x]
    np.testing.assert_allclose(decay, [float(value) for value in exact], rtol=1e-11)
    np.testing.assert_allclose(rise[1:], [float(1 - value) for value in exact[1:]], rtol=1e-11)
    np.testing.assert_allclose(rise[0], 1e-200 / special.gamma(1.0 + alpha), rtol=1e-12)


def test_the_limits_of_order_one_and_of_half():
    x = np.array([0.0, 1e-3, 0.5, 3.0, 30.0])
    np.testing.assert_allclose(mittag_leffler(x, 1.0)[0], np.exp(-x), rtol=1e-14)
    np.testing.assert_allclose(mittag_leffler(x, 1.0)[1], -np.expm1(-x), rtol=1e-14)
    np.testing.assert_allclose(mittag_leffler(x, 1.0 - 1e-13)[0], np.exp(-x), rtol=1e-9, atol=1e-14)
    np.testing.assert_allclose(mittag_leffler(x, 0.5)[0], special.erfcx(x), rtol=1e-12)
    np.testing.assert_allclose(mittag_leffler(x, 1e-4)[0], 1.0 / (1.0 + x), rtol=1e-3)


@pytest.mark.parametrize("x, alpha", [(1e-6, 0.3), (0.7, 0.05), (2.0, 0.6), (50.0, 0.95)])
def test_derivatives_in_argument_and_order(x, alpha):
    by_x, by_alpha = jax.grad(lambda *z: mittag_leffler(*z)[0], (0, 1))(x, alpha)
    with mp.workdps(40):
        h = mp.mpf("1e-9")
        slope_x = (reference(x * (1 + h), alpha) - reference(x * (1 - h), alpha)) / (2 * h * x)
        slope_alpha = (reference(x, alpha + h) - reference(x, alpha - h)) / (2 * h)
    np.testing.assert_allclose(by_x, float(slope_x), rtol=1e-9)
    np.testing.assert_allclose(by_alpha, float(slope_alpha), rtol=1e-9)
    forward = jax.jvp(lambda a: mittag_leffler(x, a)[0], (alpha,), (1.0,))[1]
    np.testing.assert_allclose(forward, by_alpha, rtol=1e-12)
    assert np.isfinite(jax.grad(lambda z: mittag_leffler(z, alpha)[0])(0.0))


LAWS = [
    jc.Springpot(V=500.0, alpha=0.25), jc.FractionalMaxwell(G=3e3, V=2e3, alpha=0.45),
    jc.FractionalKelvinVoigt(G=1e3, V=2e3, alpha=0.7), jc.FractionalZener(G1=3e3, G2=1e3, V=2e3, alpha=0.55),
]  # fmt: skip


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_creep_and_relaxation_are_the_inverse_transforms_of_the_modulus(law):
    """By Talbot's contour with 30 digits, from J(s) = 1/(s M(s)) and G(s) = M(s)/s with the modulus M of springs and a
    springpot written out here."""
    G1, G2 = getattr(law, "G1", None), getattr(law, "G2", getattr(law, "G", 0.0))

    def modulus(s):
        pot = law.V * s ** mp.mpf(law.alpha)
        if isinstance(law, jc.FractionalMaxwell):
            return 1 / (1 / mp.mpf(law.G) + 1 / pot)
        below = G2 + pot
        return below if G1 is None else 1 / (1 / mp.mpf(G1) + 1 / below)

    t = np.array([1e-3, 0.2, 3.0, 1e3])
    with mp.workdps(30):
        J = [float(mp.invertlaplace(lambda s: 1 / (s * modulus(s)), x, method="talbot")) for x in t]
        G = [float(mp.invertlaplace(lambda s: modulus(s) / s, x, method="talbot")) for x in t]
    np.testing.assert_allclose(law.creep(t), J, rtol=1e-10)
    np.testing.assert_allclose(law.relaxation(t), G, rtol=1e-10)
    omega = np.array([1e-2, 1.0, 50.0])
    exact = np.array([complex(modulus(mp.mpc(0, w))) for w in omega])
    np.testing.assert_allclose(law.complex_modulus(omega), exact, rtol=1e-12)
    np.testing.assert_allclose(
        law.laplace_compliance(0.3), float(1 / (0.3 * modulus(mp.mpf(0.3)))), rtol=1e-12
    )


def test_the_fractional_zener_solid_has_its_limits():
    zener = jc.FractionalZener(G1=3e3, G2=1e3, V=2e3, alpha=1.0 - 1e-9, nu=0.4)
    solid = jc.StandardLinearSolid(G1=3e3, G2=1e3, eta2=2e3, nu=0.4)
    t = np.array([0.0, 0.1, 1.0, 5.0])
    np.testing.assert_allclose(zener.creep(t), solid.creep(t), rtol=1e-7)
    np.testing.assert_allclose(zener.relaxation(t), solid.relaxation(t), rtol=1e-7)
    law = jc.FractionalZener(G1=3e3, G2=1e3, V=2e3, alpha=0.5)
    assert float(law.creep(0.0)) == 1.0 / 3e3 and float(law.relaxation(0.0)) == 3e3
    np.testing.assert_allclose(law.relaxation(1e20), 750.0, rtol=1e-6)
    np.testing.assert_allclose(law.shifted(10.0).creep(20.0), law.creep(2.0), rtol=1e-12)


@pytest.mark.slow
def test_the_series_of_a_fractional_zener_solid_and_its_derivatives():
    t = np.geomspace(1e-2, 1e2, 20)
    law = jc.FractionalZener(G1=3e3, G2=1e3, V=2e3, alpha=0.5)
    np.testing.assert_allclose(law.prony(1e-2, 1e2, 1e-6).creep(t), law.creep(t), rtol=1e-6)
    slopes = jax.jit(jax.jacrev(lambda law: jnp.log(law.relaxation(t))))(law)
    for name in ("G1", "G2", "V", "alpha"):
        value, h = getattr(law, name), 1e-5
        changed = [jc.FractionalZener(**{**vars(law), name: value * (1 + side * h)}) for side in (1, -1)]
        central = np.subtract(*(np.log(one.relaxation(t)) for one in changed)) / (2 * h * value)
        np.testing.assert_allclose(getattr(slopes, name), central, rtol=1e-6, atol=1e-9 / value)
