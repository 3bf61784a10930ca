"""Materials: creep and relaxation are two faces of one law."""

import operator
from itertools import pairwise

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import quad
from tolerances import ROUND_OFF

import jaxcontact as jc
from jaxcontact.bodies.materials import Spectrum, relaxation_modes

pytestmark = pytest.mark.versions

MATERIALS = {
    "elastic": jc.Elastic(2.0),
    "maxwell": jc.Maxwell(2.0, 3.0),
    "standard": jc.StandardLinearSolid(2.0, 0.5, 1.5),
    "burgers": jc.Burgers(2.0, 0.5, 30.0, 1.5),
    "prony": jc.Prony(0.5, jnp.array([2.0, 0.3, 1.0]), jnp.array([3.0, 0.1, 20.0])),
    "prony with flow": jc.Prony(0.5, jnp.array([2.0, 0.3]), jnp.array([3.0, 0.1]), fluidity=0.04),
}


@pytest.mark.parametrize("name", MATERIALS)
@pytest.mark.parametrize("t", [0.3, pytest.param(4.0, marks=pytest.mark.slow)])
def test_creep_and_relaxation_are_inverse_under_convolution(name, t):
    """int_0^t J(t - s) G(s) ds = t."""
    material = MATERIALS[name]
    integrand = jax.jit(lambda s: material.creep(t - s) * material.relaxation(s))
    assert quad(lambda s: float(integrand(s)), 0.0, t, epsabs=1e-10, limit=200)[0] == pytest.approx(
        t, rel=1e-9
    )


@pytest.mark.parametrize("name", [*MATERIALS, "kelvin-voigt"])
def test_laplace_compliance_is_the_transform_of_creep(name):
    """Kelvin-Voigt too, whose relaxation has a pulse and no convolution identity in plain functions."""
    material = MATERIALS.get(name, jc.KelvinVoigt(2.0, 3.0))
    s = 0.7
    integrand = jax.jit(lambda t: jnp.exp(-s * t) * material.creep(t))
    transform = quad(lambda t: float(integrand(t)), 0.0, 80.0, epsabs=1e-11, limit=300)[0]
    assert float(material.laplace_compliance(s)) == pytest.approx(transform, rel=1e-8)


@pytest.mark.parametrize("name", [*MATERIALS, "kelvin-voigt"])
def test_complex_modulus_is_the_inverse_of_the_laplace_compliance_on_the_axis(name):
    """G* = 1/(s J(s)) at s = i omega."""
    material = MATERIALS.get(name, jc.KelvinVoigt(2.0, 3.0))
    s = 1j * 0.9
    assert complex(material.complex_modulus(0.9) * s * material.laplace_compliance(s)) == pytest.approx(
        1.0, rel=1e-12
    )


def test_kelvin_voigt_complex_modulus_is_spring_plus_dashpot():
    assert complex(jc.KelvinVoigt(2.0, 3.0).complex_modulus(5.0)) == pytest.approx(2.0 + 15.0j)


def test_burgers_is_a_maxwell_and_a_kelvin_voigt_element_in_series():
    t = jnp.array([0.0, 0.1, 3.0, 50.0])
    burgers = jc.Burgers(2.0, 0.5, 30.0, 1.5)
    series = jc.Maxwell(2.0, 30.0).creep(t) + jc.KelvinVoigt(0.5, 1.5).creep(t)
    np.testing.assert_allclose(burgers.creep(t), series, rtol=ROUND_OFF)


def test_burgers_relaxation_against_its_quadratic():
    """G(t) of the Burgers model from the roots of its characteristic polynomial (Findley et al. 1976, 5.5.6)."""
    G1, G2, eta1, eta2, t = 2.0, 0.5, 30.0, 1.5, 4.0
    p1, p2 = eta1 / G1 + eta1 / G2 + eta2 / G2, eta1 * eta2 / (G1 * G2)
    q1, q2, A = eta1, eta1 * eta2 / G2, np.sqrt(p1**2 - 4.0 * p2)
    r1, r2 = (p1 - A) / (2.0 * p2), (p1 + A) / (2.0 * p2)
    expected = ((q1 - q2 * r1) * np.exp(-r1 * t) - (q1 - q2 * r2) * np.exp(-r2 * t)) / A
    assert float(jc.Burgers(G1, G2, eta1, eta2).relaxation(t)) == pytest.approx(expected, rel=1e-12)


def test_from_young():
    assert pytest.approx(210e9 / 2.6) == jc.Elastic.from_young(210e9, nu=0.3).G


@pytest.mark.parametrize("name", MATERIALS)
def test_materials_are_pytrees_with_finite_derivatives(name):
    material = MATERIALS[name]
    leaves, tree = jax.tree.flatten(material)
    again = jax.tree.unflatten(tree, leaves)
    assert jax.tree.structure(again) == tree and all(map(operator.is_, jax.tree.leaves(again), leaves))
    for leaf in jax.tree.leaves(jax.jit(jax.grad(lambda m: m.relaxation(0.4)))(material)):
        assert np.all(np.isfinite(leaf))


def test_derivative_of_relaxation_against_central_differences():
    burgers = jc.Burgers(2.0, 0.5, 30.0, 1.5)
    value = jax.jit(lambda m: m.relaxation(4.0))
    gradient = jax.jit(jax.grad(value))(burgers)
    step = 1e-6
    for name in ("G1", "G2", "eta1", "eta2"):
        values = {n: getattr(burgers, n) for n in ("G1", "G2", "eta1", "eta2")}
        up = value(jc.Burgers(**{**values, name: values[name] * (1 + step)}))
        down = value(jc.Burgers(**{**values, name: values[name] * (1 - step)}))
        slope = float(up - down) / (2 * step * values[name])
        assert float(getattr(gradient, name)) == pytest.approx(slope, rel=1e-7)


@pytest.mark.long
def test_equal_times_are_one_branch_and_an_empty_branch_is_none():
    """Values, complex modulus and derivatives by every J of relaxation, and of a film's whole response."""
    twice = jc.Prony(1.0, jnp.array([2.0, 0.5, 0.0, 1.0]), jnp.array([3.0, 3.0, 7.0, 20.0]))
    once = jc.Prony(1.0, jnp.array([2.5, 1.0]), jnp.array([3.0, 20.0]))
    t = jnp.array([0.0, 0.1, 2.0, 30.0, 1e3])
    np.testing.assert_allclose(twice.relaxation(t), once.relaxation(t), rtol=ROUND_OFF)
    slopes = jax.jacobian(lambda J: jc.Prony(1.0, J, twice.tau).relaxation(t))(twice.J)
    merged = jax.jacobian(lambda J: jc.Prony(1.0, J, once.tau).relaxation(t))(once.J)
    np.testing.assert_allclose(slopes[:, [0, 1, 3]], merged[:, [0, 0, 1]], rtol=1e-9, atol=1e-13)
    new = lambda j: jc.Prony(1.0, jnp.array([2.5, j, 1.0]), jnp.array([3.0, 7.0, 20.0])).relaxation(t)
    from_nothing = (4.0 * new(1e-5) - new(2e-5) - 3.0 * new(0.0)) / 2e-5  # one-sided, second order
    np.testing.assert_allclose(slopes[:, 2], from_nothing, rtol=1e-6, atol=1e-9)
    film = lambda m: jc.LayeredHalfSpace([jc.Layer(m, 1.0)], jc.Elastic(5.0))
    k = jnp.array([0.1, 1.0, 8.0])[:, None]
    pairs = [jc.normal_response(film(m), k, t) for m in (twice, once)]
    np.testing.assert_allclose(*pairs, rtol=ROUND_OFF)


def test_rates_of_relaxation_over_fifteen_decades():
    """Against the roots in 60 digits; eigenvalues of a matrix would miss the small ones by parts of the largest."""
    rates, weights = [0.0, 1e-9, 3e-4, 3.1e-4, 1e6], [1e-8, 1e-9, 1e-4, 1e-12, 1e7]  # amplitude over time
    spectrum = Spectrum(1.0, jnp.array(weights[1:]) / jnp.array(rates[1:]), jnp.array(rates[1:]), weights[0])
    ours, _ = relaxation_modes(spectrum)
    with mp.workdps(60):
        rates, weights = ([mp.mpf(v) for v in a] for a in (rates, weights))
        f = lambda rho: 1 + mp.fsum(w / (r - rho) for r, w in zip(rates, weights, strict=True))
        ends = [*rates, rates[-1] + mp.fsum(weights)]
        between = [
            (a + (b - a) * mp.mpf(10) ** -40, b - (b - a) * mp.mpf(10) ** -40) for a, b in pairwise(ends)
        ]
        exact = [float(mp.findroot(f, ends, solver="bisect", maxsteps=300, verify=False)) for ends in between]
    np.testing.assert_allclose(ours, exact, rtol=ROUND_OFF)


@pytest.mark.parametrize(("most", "count"), [(2, 40), pytest.param(6, 500, marks=pytest.mark.slow)])
def test_the_slowest_rate_is_proportional_to_the_fluidity(most, count):
    """Exactly zero without one, and good to 1e-12 however small; spectra of one term to ``most``, also the slope.

    To first order rho = fluidity/(J0 + 1/c + sum J).
    """
    rng = np.random.default_rng(0)
    extra = jnp.asarray(10 ** rng.uniform(-12, 0, 64))
    spectrum = lambda J, tau, fluidity: jc.Prony(1e-9, J, tau, fluidity=fluidity).spectrum()
    slowest = jax.jit(lambda *given: relaxation_modes(spectrum(*given), extra)[0][:, 0])
    slope = jax.jit(jax.jacfwd(slowest, 2))
    for n in range(count):
        terms, fluidity = 1 + n % most, [0.0, 1e-300, 1e-200, 1e-100, 1e-40][n % 5]
        J, tau = 10 ** rng.uniform(-10, -8, terms), 10 ** rng.uniform(-2, 3, terms)
        exact = 1.0 / (1e-9 + np.asarray(extra) + np.sum(J))
        np.testing.assert_allclose(slowest(J, tau, fluidity), fluidity * exact, rtol=ROUND_OFF, atol=0.0)
        if terms == most:
            np.testing.assert_allclose(slope(J, tau, fluidity), exact, rtol=ROUND_OFF)


@pytest.mark.parametrize("name", MATERIALS)
def test_scaled_materials_are_stiffer_and_keep_their_times_and_poissons_ratio(name):
    material, t = MATERIALS[name], jnp.array([0.0, 0.3, 50.0])
    scaled, law = material.scaled(10.0), jax.jit(lambda m: (m.creep(t), m.relaxation(t)))
    (creep, relaxation), (stiff_creep, stiff_relaxation) = law(material), law(scaled)
    np.testing.assert_allclose(stiff_creep, creep / 10.0, rtol=ROUND_OFF)
    np.testing.assert_allclose(stiff_relaxation, relaxation * 10.0, rtol=ROUND_OFF)
    assert scaled.nu == material.nu


def test_a_series_of_lists_is_scaled_as_one_of_arrays():
    series = jc.Prony(1e-9, [2e-9, 3e-9], (10.0, 100.0))
    expected = float(series.creep(30.0)) / 2.0
    assert float(series.scaled(2).creep(30.0)) == pytest.approx(expected, rel=1e-14)


@pytest.mark.slow
def test_hessian_of_relaxation_is_symmetric_and_finite():
    """Two Newton steps carry two orders of derivatives through the decay rates."""
    f = lambda q: jc.Burgers(*jnp.exp(q)).relaxation(4.0)
    q = jnp.log(jnp.array([2.0, 0.5, 30.0, 1.5]))
    hessian, slope = jax.jit(jax.hessian(f))(q), jax.jit(jax.grad(f))
    slopes = np.array([(slope(q.at[i].add(1e-5)) - slope(q.at[i].add(-1e-5))) / 2e-5 for i in range(4)])
    np.testing.assert_allclose(hessian, slopes, rtol=1e-6, atol=1e-9)


SHIFTED = [
    jc.Elastic(1e9), jc.Maxwell(1e9, 1e11), jc.KelvinVoigt(1e3, 2e3), jc.StandardLinearSolid(2e6, 1e6, 1e6),
    jc.Burgers(2e5, 1e5, 5e6, 4e5), jc.Prony(1e-9, np.array([2e-9, 5e-9]), np.array([1.0, 9.0]), fluidity=1e-11),
    jc.Springpot(500.0, 0.25), jc.FractionalMaxwell(1e6, 2e6, 0.5), jc.FractionalKelvinVoigt(1e3, 2e3, 0.5),
]  # fmt: skip


@pytest.mark.parametrize("material", SHIFTED, ids=lambda material: type(material).__name__)
def test_a_shifted_material_has_the_creep_of_another_time(material):
    t = np.array([0.0, 0.3, 5.0, 700.0])
    creep = jax.jit(lambda m, t: m.creep(t))
    np.testing.assert_allclose(creep(material.shifted(7.0), 7.0 * t), creep(material, t), rtol=1e-9)
    assert jax.jit(jax.grad(lambda a: jnp.sum(material.shifted(a).creep(3.0))))(2.0) <= 0.0


def test_relaxation_of_many_branches_is_that_of_few(monkeypatch):
    """Above ``MANY`` rates products over the rates are loops of the program: 360 branches once took 10 GB."""
    times = np.geomspace(1e-4, 1e4, 9)
    body = jc.Prony(1e-9, np.full(12, 1e-10), np.geomspace(1e-3, 1e3, 12), 0.3, fluidity=1e-12)
    few = body.relaxation(times)
    monkeypatch.setattr("jaxcontact.bodies.materials.MANY", 5)
    jax.clear_caches()
    np.testing.assert_allclose(body.relaxation(times), few, rtol=1e-12)


NOT_A_LAW = {
    "a negative modulus": (jc.Burgers(-2.0, 0.5, 30.0, 1.5), "material Burgers G1: expected > 0, got -2"),
    "a negative part": (jc.Prony(0.5, [-2.0], [1.0]), "material Prony J: expected >= 0, got -2"),
    "more parts than times": (
        jc.Prony(0.5, [2.0, 1.0], [1.0]),
        r"expected J and tau of one shape, got \(2,\) and \(1,\)",
    ),
    "Poisson's ratio": (jc.Elastic(2.0, nu=0.7), "material nu: expected -1 < nu <= 0.5, got 0.7"),
    "an order above one": (jc.Springpot(2.0, 1.2), "alpha: expected > 0 and <= 1, got 1.2"),
    "a spring without stiffness": (jc.FractionalZener(2.0, 0.0, 1.0, 0.3), "G2: expected > 0, got 0"),
}


@pytest.mark.parametrize("name", NOT_A_LAW)
@pytest.mark.parametrize("method", ["creep", "relaxation", "complex_modulus", "laplace_compliance"])
def test_a_material_out_of_range_has_no_value(name, method):
    material, message = NOT_A_LAW[name]
    with pytest.raises(ValueError, match=message):
        getattr(material, method)(1.0)


FRACTIONAL = {
    "springpot": jc.Springpot(2.0, 0.3),
    "fractional Maxwell": jc.FractionalMaxwell(2.0, 3.0, 0.3),
    "fractional Kelvin-Voigt": jc.FractionalKelvinVoigt(2.0, 3.0, 0.3),
    "fractional Zener": jc.FractionalZener(2.0, 0.5, 3.0, 0.3),
    "Kelvin-Voigt": jc.KelvinVoigt(2.0, 3.0),
}


@pytest.mark.parametrize("name", MATERIALS | FRACTIONAL)
@pytest.mark.parametrize("method", ["creep", "relaxation"])
def test_before_the_loading_a_material_has_no_value(name, method):
    """A creep compliance at t < 0 would be a number of the wrong size (of Kelvin and Voigt's solid a negative one)."""
    evaluate = getattr((MATERIALS | FRACTIONAL)[name], method)
    for times in (-1.0, [0.0, -0.5, 2.0], np.nan):
        with pytest.raises(ValueError, match="t: expected times >= 0 s after the loading, got"):
            evaluate(times)


def test_factors_of_moduli_and_times_are_positive():
    for change in (jc.Maxwell(2.0, 3.0).scaled, jc.Maxwell(2.0, 3.0).shifted, jc.Springpot(2.0, 0.3).shifted):
        with pytest.raises(ValueError, match="factor: expected > 0, got -1"):
            change(-1.0)
    with pytest.raises(ValueError, match=r"nu: expected -1 < nu <= 0\.5, got -1"):
        jc.Elastic.from_young(2.0, nu=-1.0)


def test_after_infinite_time_the_springs_remain():
    """Two springs of 2 and 0.5 in series have the modulus 1/(1/2 + 1/0.5) = 0.4, whether the second one is beside a dashpot
    or beside a springpot. The bounds are rounding."""
    for solid in (MATERIALS["standard"], FRACTIONAL["fractional Zener"]):
        assert float(solid.creep(np.inf)) == pytest.approx(2.5, rel=1e-14)
        assert float(solid.relaxation(np.inf)) == pytest.approx(0.4, rel=1e-14)
    assert float(FRACTIONAL["fractional Kelvin-Voigt"].creep(np.inf)) == pytest.approx(0.5, rel=1e-14)
    assert float(FRACTIONAL["fractional Maxwell"].relaxation(np.inf)) == 0.0
