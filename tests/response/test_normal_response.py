"""The response of a layer on a half-space against 60-digit arithmetic and Laplace inversion."""

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.response.normal import response_of

EXACT = 1e-13  # float64 sums of positive terms
# one program a shape, not one an operation
step = jax.jit(lambda body, *given: response_of(body).mean_response(*given))


def printed_form(x, g, Gs, nu_c, nu_s):
    """alpha N as usually printed (the paper's Appendix A in compact form), in mpmath numbers."""
    G, kc, ks, theta = g / Gs, 3 - 4 * nu_c, 3 - 4 * nu_s, mp.e ** (-2 * x)
    k, lam = (G - 1) / (G + kc), (G * ks - kc) / (1 + G * ks)
    D = 1 - (lam + k + 4 * k * x * x) * theta + lam * k * theta**2
    return (1 - nu_c) / g * (1 + 4 * x * k * theta - lam * k * theta**2) / D


def layered(g, Gs, nu_c, nu_s, h=1.0):
    return jc.LayeredHalfSpace([jc.Layer(jc.Elastic(g, nu_c), h)], jc.Elastic(Gs, nu_s))


@pytest.mark.parametrize("nu_c", [0.0, 0.3, 0.4999, 0.5])
@pytest.mark.parametrize("nu_s", [0.0, 0.3, 0.5])
def test_all_thicknesses_and_contrasts_to_round_off(nu_c, nu_s):
    """alpha h from 1e-8 to 1e4, stiffness ratios from 1e-8 to 1e8."""
    x = np.array([1e-8, 1e-6, 1e-4, 1e-2, 0.3, 0.69, 0.71, 1.0, 3.0, 10.0, 20.0, 100.0, 1e3, 1e4])
    with mp.workdps(60):
        for ratio in (1e-8, 1e-4, 0.1, 1.0, 10.0, 1e4, 1e8):
            ours = step(layered(ratio, 1.0, nu_c, nu_s), x, 0.0, 0.0)
            exact = [float(printed_form(*map(mp.mpf, (v, ratio, 1.0, nu_c, nu_s)))) for v in x]
            np.testing.assert_allclose(ours, exact, rtol=EXACT)


def test_a_layer_of_the_substrates_material_is_no_layer():
    x = jnp.geomspace(1e-6, 1e3, 50)
    np.testing.assert_allclose(step(layered(2.0, 2.0, 0.3, 0.3), x, 0.0, 0.0), 0.35, rtol=EXACT)


def test_wavenumber_zero_is_the_substrate_and_the_response_itself_infinite():
    body = layered(0.01, 2.0, 0.3, 0.25)
    assert float(response_of(body).mean_response(0.0, 0.0, 0.0)) == 0.375
    assert np.isposinf(jc.normal_response(body, 0.0))


def test_gradients_are_finite_everywhere():
    f = lambda k, g, h, nu: response_of(layered(g, 2.0, nu, 0.3, h)).mean_response(k, 0.0, 0.0)
    gradient = jax.jit(jax.grad(f, argnums=(0, 1, 2, 3)))
    response = jax.jit(jax.grad(lambda k: jc.normal_response(layered(0.01, 2.0, 0.3, 0.3), k)))
    for x in (0.0, 1e-8, 1e-3, 0.7, 30.0, 1e4):
        assert np.all(np.isfinite(gradient(x, 0.01, 1.0, 0.3))), x
        assert np.isfinite(response(x)), x


def test_thin_film_limit_is_the_film_as_springs():
    """N -> N_s + h (1 - 2 nu)/(2 g (1 - nu)) for a soft thin film."""
    x = 1e-6
    ours = float(step(layered(1e-6, 1.0, 0.3, 0.3), x, 0.0, 0.0)) - 0.7
    assert ours == pytest.approx(x * 0.4 / (2e-6 * 0.7), rel=2e-6)


def test_the_empty_stack_is_a_half_space(film):
    body = jc.LayeredHalfSpace([], film)
    np.testing.assert_allclose(
        jc.normal_response(body, 3.0, 100.0), 0.7 * film.creep(100.0) / 3.0, rtol=EXACT
    )


@pytest.mark.parametrize("ratio", [0.01, 1.0, 100.0])
@pytest.mark.parametrize("x", [1e-3, 0.4, 5.0])
def test_time_response_against_numerical_laplace_inversion(film, ratio, x):
    """The correspondence principle by mpmath's inversion of the printed form with g(s) for g."""
    Gs = film.G1 / ratio
    body = jc.LayeredHalfSpace([jc.Layer(film, 1.0)], jc.Elastic(Gs, 0.3))

    def transform(s):
        J = 1 / mp.mpf(film.G1) + 1 / (film.G2 + film.eta2 * s) + 1 / (film.eta1 * s)
        return printed_form(mp.mpf(x), 1 / J, mp.mpf(Gs), mp.mpf("0.3"), mp.mpf("0.3")) / s

    for t in (10.0, 500.0, 7200.0):
        inverse = float(mp.invertlaplace(transform, t, method="talbot", degree=30))
        assert float(step(body, x, t, t)) == pytest.approx(inverse, rel=1e-9)


def test_mean_over_an_interval_is_the_integral(film, body):
    points, weights = np.polynomial.legendre.leggauss(40)
    t = 100.0 + 150.0 * (points + 1.0)
    values = step(body, 2e4, t, t)
    assert float(step(body, 2e4, 100.0, 400.0)) == pytest.approx(float(values @ weights) / 2.0, rel=1e-12)


def test_quasi_elastic_error_for_the_papers_film(body, steel, film):
    """Within 2.5e-6 for the film on steel; about 1 % for a film as stiff as its substrate."""
    x, t = jnp.geomspace(1e-4, 1e2, 60)[:, None], jnp.geomspace(1.0, 7200.0, 40)

    @jax.jit
    def worst(Gs):
        other = jc.LayeredHalfSpace([jc.Layer(film, 1.0)], jc.Elastic(Gs, 0.3))
        response = response_of(other)
        return jnp.max(jnp.abs(response.quasi_elastic(x, t, t) / response.mean_response(x, t, t) - 1.0))

    assert 1e-6 < worst(steel.G) < 4e-6
    assert 3e-3 < worst(film.G1 / 0.93) < 3e-2


@pytest.mark.slow
@pytest.mark.versions
@pytest.mark.parametrize(
    ("ratio", "nodes", "bound"), [(0.0093, 1, 1e-7), (0.0093, 3, 1e-12), (0.93, 3, 1e-4), (0.93, 6, 2e-7)]
)
def test_shared_decay_rates(film, ratio, nodes, bound):
    """The sum of products is within the stated error of the exact response at all wavenumbers and times."""
    body = jc.LayeredHalfSpace([jc.Layer(film, 1.0)], jc.Elastic(film.G1 / ratio, 0.3))
    x = response_of(body).wavenumbers()
    response = response_of(body).separate(nodes)
    assert float(response.error) < bound
    t = 1234.0
    growth = jnp.where(
        response.rates > 0,
        -jnp.expm1(-response.rates * t) / jnp.where(response.rates > 0, response.rates, 1),
        t,
    )
    values = response.terms[0] + growth @ response.mix.T @ response.terms[1:]
    np.testing.assert_allclose(
        values, response_of(body).mean_response(x, t, t), rtol=float(response.error) * 3 + 1e-13
    )
