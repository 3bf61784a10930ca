"""All nine responses at a wavevector: interface conditions, the printed formulas in 60 digits, Laplace inversion."""

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.reference.layered_solid import surface_response


def layered(g, Gs, nu_c, nu_s, h=1.0):
    return jc.LayeredHalfSpace([jc.Layer(jc.Elastic(g, nu_c), h)], jc.Elastic(Gs, nu_s))


respond = jax.jit(
    jax.vmap(lambda g, Gs, nu_c, nu_s, h, m, n: jc.frequency_response(layered(g, Gs, nu_c, nu_s, h), m, n))
)


def printed_form(x, g, Gs, nu_c, nu_s):
    """alpha (L, K, N, T) as Appendix A has them, its misprints mended, in compact form; mpmath numbers."""
    G, kc, ks, theta = g / Gs, 3 - 4 * nu_c, 3 - 4 * nu_s, mp.e ** (-2 * x)
    k, lam = (G - 1) / (G + kc), (G * ks - kc) / (1 + G * ks)
    D = 1 - (lam + k + 4 * k * x * x) * theta + lam * k * theta**2
    L = (1 - nu_c) / g * (1 - 4 * x * k * theta - lam * k * theta**2) / D
    N = (1 - nu_c) / g * (1 + 4 * x * k * theta - lam * k * theta**2) / D
    coupling = (1 - 2 * nu_c) * (1 - 2 * k * theta + lam * k * theta**2) - (k - lam - 4 * k * x * x) * theta
    T = ((1 + G) + (G - 1) * theta) / ((1 + G) - (G - 1) * theta) / g
    return L, coupling / (2 * g * D), N, T


def matrix(four, m, n):
    """The nine entries from alpha (L, K, N, T)."""
    alpha = np.hypot(m, n)
    L, K, N, T = (float(entry) for entry in four)
    r, s = np.array([m, n]) / alpha, np.array([-n, m]) / alpha
    full = np.zeros((3, 3), complex)
    full[:2, :2] = L * np.outer(r, r) + T * np.outer(s, s)
    full[:2, 2], full[2, :2], full[2, 2] = 1j * K * r, -1j * K * r, N
    return full / alpha


def relative(ours, exact):
    """Largest difference of entries, each in parts of the root of the two self-compliances."""
    size = np.sqrt(np.abs(np.einsum("...ii->...i", exact)))
    return np.max(np.abs(ours - exact) / (size[..., :, None] * size[..., None, :]))


def test_nine_responses_meet_all_interface_conditions():
    """200 random layers, stiffness ratios from 1e-3 to 1e3, alpha h from 1e-3 to 20, incompressible ones too."""
    rng = np.random.default_rng(3)
    g, Gs = 10.0 ** rng.uniform(7.5, 10.5, (2, 200))
    nu = rng.uniform(0.0, 0.5, (200, 2))
    nu[::9, 0], nu[::11, 1] = 0.5, 0.5
    alpha, angle = 10.0 ** rng.uniform(3, 8, 200), rng.uniform(0, 2 * np.pi, 200)
    h, m, n = 10.0 ** rng.uniform(-3, 1.3, 200) / alpha, alpha * np.cos(angle), alpha * np.sin(angle)
    exact = surface_response(np.stack([g, Gs], -1), nu, h[:, None], m, n)
    ours = respond(g, Gs, *nu.T, h, m, n)
    assert relative(ours, exact) < 1e-12
    np.testing.assert_allclose(ours, np.conj(np.swapaxes(ours, -1, -2)), rtol=1e-15)  # reciprocity


@pytest.mark.parametrize("ratio", [1e-6, 0.01, 1.0, 30.0, 1e6])
def test_printed_formulas_in_60_digits(ratio):
    """As printed they lose all their digits in float64 for thin layers; in 60 digits they are the same."""
    for x in (1e-8, 1e-4, 0.3, 2.0, 15.0):
        with mp.workdps(60):
            exact = printed_form(*map(mp.mpf, (x, ratio, 1.0, 0.25, 0.4)))
        ours = respond(*np.array([[ratio, 1.0, 0.25, 0.4, 1.0, 0.8 * x, -0.6 * x]]).T)[0]
        assert relative(np.asarray(ours), matrix(exact, 0.8 * x, -0.6 * x)) < 1e-13


def test_half_space_is_the_transform_of_cerruti_and_boussinesq():
    """Point loads: 1/r goes to 2 pi/alpha, x^2/r^3 to 2 pi n^2/alpha^3, x/r^2 to -2 pi i m/alpha^2."""
    G, nu, m, n = 2.0, 0.3, 3.0, -4.0
    alpha = 5.0
    ours = np.asarray(jc.frequency_response(jc.LayeredHalfSpace([], jc.Elastic(G, nu)), m, n))
    cerruti = [
        [(1 - nu) / alpha + nu * n**2 / alpha**3, -nu * m * n / alpha**3],
        [-nu * m * n / alpha**3, (1 - nu) / alpha + nu * m**2 / alpha**3],
    ]
    np.testing.assert_allclose(ours[:2, :2], np.array(cerruti) / G, rtol=1e-13)
    outward = -0.5 * (1 - 2 * nu) / G * -1j * np.array([m, n]) / alpha**2  # of a pressure: inward
    np.testing.assert_allclose(ours[:2, 2], outward, rtol=1e-13)
    assert ours[2, 2] == pytest.approx((1 - nu) / (G * alpha), rel=1e-13)


def test_a_layer_that_vanishes():
    """In thickness, or in contrast, it leaves the substrate."""
    bare = np.asarray(jc.frequency_response(jc.LayeredHalfSpace([], jc.Elastic(2.0, 0.3)), 0.6, 0.8))
    thin, alike = respond(
        *np.array([[1e-3, 2.0, 0.1, 0.3, 1e-18, 0.6, 0.8], [2.0, 2.0, 0.3, 0.3, 1.0, 0.6, 0.8]]).T
    )
    assert relative(np.asarray(thin), bare) < 1e-13
    assert relative(np.asarray(alike), bare) < 1e-13


def test_in_time_against_numerical_laplace_inversion(film):
    """A creeping film a hundredth as stiff as its substrate: the printed formulas with g(s), inverted by mpmath."""
    Gs, m, n = 100.0 * film.G1, 0.3, 0.4
    body = jc.LayeredHalfSpace([jc.Layer(film, 1.0)], jc.Elastic(Gs, 0.3))

    def transform(entry):
        def at(s):
            J = 1 / mp.mpf(film.G1) + 1 / (film.G2 + film.eta2 * s) + 1 / (film.eta1 * s)
            return printed_form(mp.mpf("0.5"), 1 / J, mp.mpf(Gs), mp.mpf("0.3"), mp.mpf("0.3"))[entry] / s

        return at

    ours = jc.frequency_response(body, m, n, np.array([10.0, 7200.0]))
    for i, t in enumerate((10.0, 7200.0)):
        four = [mp.invertlaplace(transform(entry), t, method="talbot", degree=24) for entry in range(4)]
        assert relative(np.asarray(ours[i]), matrix(four, m, n)) < 1e-9


@pytest.mark.slow
def test_wavevector_zero_is_defined_and_does_not_spoil_derivatives():
    body = layered(0.01, 2.0, 0.3, 0.25)
    np.testing.assert_array_equal(jc.frequency_response(body, 0.0, 0.0), np.diag([np.inf] * 3))
    total = lambda k: jnp.sum(jnp.abs(jc.frequency_response(body, k, 0.0)[1]) * (k > 0.0))
    assert float(jax.grad(total)(0.0)) == 0.0
