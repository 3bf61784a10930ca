"""Posteriors against quadrature of the density on a grid by numpy, and their intervals against many experiments."""

import sys

import numpy as np
import pytest

import fitting
import jaxcontact as jc
from fitting.after import posterior

pytest.importorskip("numpyro")

T = np.linspace(0.1, 10.0, 30)
G, ETA = 2e5, 1e6
FINE = 241


def curve(seed=1, noise=0.02):
    """Creep of a Maxwell fluid with white noise."""
    J = (1 / G + T / ETA) * (1 + noise * np.random.default_rng(seed).standard_normal(T.size))
    return fitting.CreepData(t=T, J=J)


def maxwell(**options):
    return fitting.fit_creep(curve(), "Maxwell", **options)


def quantiles(values, density):
    """At 2.5, 50 and 97.5 %, of a density (m,) on even steps."""
    share = np.cumsum(density) - 0.5 * density
    return np.interp([0.025, 0.5, 0.975], share / density.sum(), values)


def quadrature(centre, spread, log_density):
    """(quantiles, sd) of each coordinate of a density on a grid of six spreads to each side."""
    axes = [
        c + s * np.linspace(-6, 6, FINE if len(centre) == 2 else 81)
        for c, s in zip(centre, spread, strict=True)
    ]
    height = log_density(*np.meshgrid(*axes, indexing="ij"))
    density = np.exp(height - height.max())
    found = []
    for i, axis in enumerate(axes):
        own = density.sum(tuple(k for k in range(len(axes)) if k != i))
        mean = own @ axis / own.sum()
        found.append((quantiles(axis, own), np.sqrt(own @ (axis - mean) ** 2 / own.sum())))
    return found


def assert_agrees(draws, expected, ess):
    """Quantiles of draws within four errors of Monte Carlo, which are those of a normal density."""
    wanted, sd = expected
    error = 4.0 * sd / np.sqrt(ess) * np.array([2.7, 1.3, 2.7])
    assert np.all(np.abs(np.quantile(draws, [0.025, 0.5, 0.975]) - wanted) < error), (draws.size, wanted)


@pytest.mark.slow
@pytest.mark.parametrize(
    "known", [pytest.param(False, marks=pytest.mark.long), True], ids=["noise estimated", "noise known"]
)
def test_creep_has_the_density_of_a_grid(known):
    """RSS^(-n/2) without a sigma, exp(-RSS/2) with it, even in the logarithms of both parameters."""
    data = curve()
    sigma = 0.02 * (1 / G + T / ETA)
    fit = fitting.fit_creep(data, "Maxwell", **({"sigma": sigma} if known else {"weights": "relative"}))
    assert fit.widening == 1.0
    found = fitting.posterior(fit)

    def log_density(g, eta):
        model = np.exp(-g)[..., None] + np.exp(-eta)[..., None] * T
        if known:
            return -0.5 * np.sum(((model - data.J) / sigma) ** 2, -1)
        return -0.5 * T.size * np.log(np.sum((model / data.J - 1) ** 2, -1))

    expected = quadrature(np.log([fit.values["G"], fit.values["eta"]]), [0.02, 0.01], log_density)
    for name, rows in zip(("G", "eta"), expected, strict=True):
        assert_agrees(np.log(found.samples[name]), rows, found.ess[name])
        assert found.r_hat[name] < 1.05 and found.open == ()
        np.testing.assert_allclose(found.intervals[name], fit.intervals[name], rtol=0.01)


@pytest.mark.slow
def test_a_result_is_carried_through_the_draws():
    """J(t) is linear in the compliances, so that least squares of numpy alone has its median and its sd; with the prior
    even in logarithms the two differ by far less than the spread."""
    fit = maxwell(weights="relative")
    later = np.array([1.0, 100.0])
    found = fitting.posterior(fit)
    band = found.propagate(lambda material: material.creep(later))
    A = np.column_stack([np.ones(T.size), T]) / curve().J[:, None]
    x, rss = np.linalg.lstsq(A, np.ones(T.size), rcond=None)[:2]
    at = np.column_stack([np.ones(2), later])
    # of Student's t
    sd = np.sqrt(np.einsum("ni,ij,nj->n", at, np.linalg.inv(A.T @ A), at) * rss[0] / (T.size - 4))
    np.testing.assert_allclose(band.value, at @ x, atol=0.15 * sd.min(), rtol=2e-3)
    np.testing.assert_allclose(band.sd, sd, rtol=0.1)
    assert np.all((band.low < at @ x) & (at @ x < band.high))
    assert "profile" in found.summary() and "effective" in found.summary()
    again = fitting.posterior(fit).samples["G"]
    np.testing.assert_array_equal(again, found.samples["G"])


@pytest.mark.slow
def test_what_the_data_leave_open_is_said_to_be_the_prior_s():
    """A spring that does not flow: the viscosity has a lower limit, and above it the prior."""
    # noise with a slight rise: without one the fit explains no more than a constant, and is rejected
    J = 5e-6 * (1 + 0.01 * np.random.default_rng(9).standard_normal(T.size))
    fit = fitting.fit_creep(fitting.CreepData(t=T, J=J), "Maxwell", weights="relative")
    found = fitting.posterior(fit)
    assert found.open == ("eta",) and "eta: not bounded" in found.summary()
    low, high = found.intervals["eta"]
    assert found.prior["eta"][0] < low < high < found.prior["eta"][1]
    np.testing.assert_allclose(found.intervals["G"], fit.intervals["G"], rtol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("apart", "follow", "word"), [(1.0, 0.0, "R-hat of eta"), (0.0, 0.94, "effective draws of")]
)
def test_chains_that_have_not_mixed_are_refused(apart, follow, word, monkeypatch):
    """Two of four chains one standard deviation away, or draws that hardly move."""
    random = np.random.default_rng(0).standard_normal((4, 1000, 2))
    x = random.copy()
    for k in range(1, 1000):
        x[:, k] = follow * x[:, k - 1] + np.sqrt(1 - follow**2) * random[:, k]
    x[:2, :, 1] += apart
    monkeypatch.setattr(posterior, "run", lambda *given: (x, np.zeros((4, 1000))))
    with pytest.raises(ValueError, match=f"chains: .*{word}.*expected.*warmup"):
        fitting.posterior(maxwell(weights="relative"))


def test_what_has_no_posterior_is_refused(monkeypatch):
    good = maxwell(weights="relative")
    bent = fitting.CreepData(t=T, J=1e-6 * (1 + np.sqrt(T)))
    with pytest.raises(ValueError, match="rejected"):
        fitting.posterior(fitting.fit_creep(bent, "Maxwell", weights="relative"))
    with pytest.raises(ValueError, match="expected the result of a fit, got float"):
        fitting.posterior(1.0)
    with pytest.raises(ValueError, match="chains >= 2"):
        fitting.posterior(good, chains=1)
    monkeypatch.setitem(sys.modules, "numpyro.infer.hmc", None)
    with pytest.raises(ImportError, match=r"jaxcontact\[bayes\]"):
        fitting.posterior(good)


@pytest.mark.long
def test_an_indentation_with_its_contact_point_has_the_density_of_a_grid():
    """depth^(3/2) = 3 (1 - nu)/(8 sqrt R) P J(t) under a step of load, and a shift of all depths."""
    R, P = 5e-6, 1e-8
    law = lambda g, eta, t: (3 * 0.5 / (8 * np.sqrt(R)) * P * (np.exp(-g) + t * np.exp(-eta))) ** (2 / 3)
    t = np.linspace(0.0, 40.0, 60)
    exact = law(np.log(G), np.log(ETA), t)
    depth = exact + 0.002 * exact.max() * np.random.default_rng(2).standard_normal(t.size) + 1e-8
    hold = fitting.IndentationData(t=t, load=np.full(t.size, P), depth=depth)
    fit = fitting.fit_indentation(hold, "Maxwell", indenter=jc.Sphere(R), nu=0.5, contact_point="fit")
    assert fit.widening == 1.0
    found = fitting.posterior(fit)

    def log_density(g, eta, shift):
        rss = sum((law(g, eta, one) + shift - there) ** 2 for one, there in zip(t, depth, strict=True))
        return -0.5 * t.size * np.log(rss)

    draws = [np.log(found.samples["G"]), np.log(found.samples["eta"]), found.nuisances["contact_point"]]
    ess = [found.ess["G"], found.ess["eta"], found.ess["G"]]
    expected = quadrature([np.median(d) for d in draws], [np.std(d) for d in draws], log_density)
    for one, rows, size in zip(draws, expected, ess, strict=True):
        assert_agrees(one, rows, size)


@pytest.mark.slow
def test_a_modulus_has_the_density_of_a_grid():
    """G(t) = G exp(-t G/eta)."""
    data = fitting.RelaxationData(
        t=T, modulus=G * np.exp(-T * G / ETA) * (1 + 0.02 * np.random.default_rng(4).standard_normal(T.size))
    )
    fit = fitting.fit_relaxation(data, "Maxwell", weights="absolute")
    assert fit.widening == 1.0
    found = fitting.posterior(fit)

    def log_density(g, eta):
        model = np.exp(g)[..., None] * np.exp(-T * np.exp(g - eta)[..., None])
        return -0.5 * T.size * np.log(np.sum((model - data.modulus) ** 2, -1))

    draws = [np.log(found.samples[name]) for name in ("G", "eta")]
    expected = quadrature([np.median(d) for d in draws], [np.std(d) for d in draws], log_density)
    for name, one, rows in zip(("G", "eta"), draws, expected, strict=True):
        assert_agrees(one, rows, found.ess[name])


@pytest.mark.long
def test_intervals_of_the_posterior_hold_the_truth():
    """95 % of 60 experiments, within three standard errors of such a count."""
    inside = []
    for seed in range(60):
        fit = fitting.fit_creep(curve(1000 + seed), "Maxwell", weights="relative")
        if fit.refused:
            continue
        found = fitting.posterior(fit, samples=500, warmup=300)
        inside += [
            low < truth < high for (low, high), truth in zip(found.intervals.values(), (G, ETA), strict=True)
        ]
    assert len(inside) >= 110
    assert abs(np.mean(inside) - 0.95) < 3 * np.sqrt(0.95 * 0.05 / (len(inside) / 2))
