"""Errors in proportion to the values: estimates without bias, against quasi-likelihood equations solved by scipy.

For errors of standard deviation s f(theta) the unbiased equations are sum (y - f) f'/f^2 = 0, those of a gamma distribution
(P. McCullagh, J. A. Nelder, Generalized Linear Models, 1989). Weights from the readings give estimates that are too low by
about s^2.
"""

import numpy as np
import pytest
from scipy import optimize

import fitting
import jaxcontact as jc

N, SIZE, NU, RADIUS, LOAD, THICKNESS = 60, 0.1, 0.3, 1e-3, 1e-2, 1e-4
T, OMEGA = np.geomspace(0.2, 60.0, N), np.geomspace(0.02, 50.0, N // 2)
TRUE = {"G": 2e5, "eta": 4e6}


def creep(G, eta, t=T):
    return 1.0 / G + t / eta


def relaxation(G, eta):
    return G * np.exp(-T * G / eta)


def moduli(G, eta):
    return 1.0 / (1.0 / G + 1.0 / (1j * OMEGA * eta))


def depth(G, eta):
    """Depth of a ball under a constant load from the first sample on (Lee and Radok)."""
    return (3 * (1 - NU) * creep(G, eta, T - T[0]) * LOAD / (8 * np.sqrt(RADIUS))) ** (2 / 3)


def stiffness(G):
    """Contact stiffness of a ball, 4 G a/(1 - nu)."""
    return 4 * G / (1 - NU) * np.sqrt(RADIUS * 1e-8 * T)


def growth(rate, removal_rate):
    """Thickness that grows from nothing at a constant stress and temperature, while it is removed."""
    return rate * np.exp(-40.0) / removal_rate * -np.expm1(-removal_rate * T)


def solved(model, y, start):
    """The root of the quasi-likelihood equations in the logarithms of the parameters."""
    start, step = dict(start), 1e-5

    def score(u):
        at = lambda shift: model(**dict(zip(start, np.exp(u + shift), strict=True)))
        f = at(0.0)
        slopes = [(at(step * one) - at(-step * one)) / (2 * step) for one in np.eye(u.size)]
        return [np.sum((np.conj(slope) * (y - f) / np.abs(f) ** 2).real) for slope in slopes]

    found = optimize.root(score, np.log(list(start.values())), tol=1e-12)
    return dict(zip(start, np.exp(found.x), strict=True))


def noisy(clean, seed=0):
    """Readings with relative errors, of a complex number in its parts alike."""
    rng = np.random.default_rng(seed)
    each = lambda: SIZE * rng.standard_normal(clean.size)
    return clean + np.abs(clean) * (each() + 1j * each() if np.iscomplexobj(clean) else each())


def of_creep(y, **weights):
    return fitting.fit_creep(fitting.CreepData(t=T, J=y), "Maxwell", **weights).values


def of_batch(y, weights):
    found = fitting.fit_creep_batch(T, [y, 2.0 * y], "Maxwell", weights=weights)
    return {name: both[0] for name, both in found.values.items()}


def of_relaxation(y, **weights):
    return fitting.fit_relaxation(fitting.RelaxationData(t=T, modulus=y), "Maxwell", **weights).values


def of_moduli(y, **weights):
    return fitting.fit_oscillation(
        fitting.OscillationData(OMEGA, y.real, y.imag), "Maxwell", **weights
    ).values


def of_sweeps(y, weights):
    """Two tests with the same readings, whose weights are proportional by default."""
    sweep = fitting.OscillationData(OMEGA, y.real, y.imag)
    return fitting.fit_together([sweep, sweep], "Maxwell").values


def of_series(y, **weights):
    data = fitting.OscillationData(OMEGA, y.real, y.imag)
    return fitting.fit_maxwell(data, [1.0, 20.0], **weights).values


def series(Ge, G1, G2):
    x = 1j * OMEGA
    return Ge + G1 * x / (1.0 + x) + G2 * 20.0 * x / (1.0 + 20.0 * x)


def of_depth(y, **weights):
    data = fitting.IndentationData(t=T, load=np.full(N, LOAD), depth=y)
    return fitting.fit_indentation(
        data, "Maxwell", indenter=jc.Sphere(radius=RADIUS), nu=NU, **weights
    ).values


def of_stiffness(y, **weights):
    data = fitting.StiffnessData(depth=1e-8 * T, stiffness=y)
    return fitting.fit_stiffness(data, indenter=jc.Sphere(radius=RADIUS), nu=NU, **weights).values


def of_growth(y, weights):
    held = {"activation_energy": 40.0 * 1.380649e-23 * 350.0, "activation_volume": 0.0}
    data = fitting.GrowthData(T, y, stress=1e8, temperature=350.0)
    return fitting.fit_growth(data, weights=weights, fixed=held).values


CASES = {
    "creep": (creep, TRUE, of_creep), "batch": (creep, TRUE, of_batch),
    "relaxation": (relaxation, TRUE, of_relaxation), "oscillation": (moduli, TRUE, of_moduli),
    "indentation": (depth, TRUE, of_depth), "stiffness": (stiffness, {"G": 2e5}, of_stiffness),
    "together": (moduli, TRUE, of_sweeps), "series": (series, {"Ge": 5e4, "G1": 2e5, "G2": 1e5}, of_series),
    "growth": (growth, {"rate": 1e-2, "removal_rate": 5e-2}, of_growth),
}  # fmt: skip


@pytest.mark.parametrize("kind", CASES)
def test_the_estimate_solves_the_unbiased_equations(kind):
    model, true, fit = CASES[kind]
    y = noisy(model(**true))
    found, expected = fit(y, weights="proportional"), solved(model, y, true)
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-4), name


def least_squares(y, weight):
    """Weighted least squares of a relaxation curve by scipy alone."""
    residual = lambda u: weight * (relaxation(*np.exp(u)) - y)
    found = optimize.least_squares(residual, np.log(list(TRUE.values())), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return dict(zip(TRUE, np.exp(found.x), strict=True))


@pytest.mark.parametrize("weights", [{"weights": "relative"}, {"sigma": "of the readings"}])
def test_weights_of_the_readings_are_used_as_given_and_their_bias_is_stated(weights):
    """60 errors of 10 % make a curve 1 % too low, 0.8 standard errors of a common factor; errors of 1 % are harmless."""
    for size, stated in ((0.1, True), (0.01, False)):
        clean = relaxation(**TRUE)
        y = clean * (1.0 + size * np.random.default_rng(0).standard_normal(N))
        given = {"sigma": size * y} if "sigma" in weights else weights
        fit = fitting.fit_relaxation(fitting.RelaxationData(t=T, modulus=y), "Maxwell", **given)
        for name, value in least_squares(y, 1.0 / y).items():
            assert fit.values[name] == pytest.approx(value, rel=1e-6)
        assert any("proportional" in note for note in fit.notes) == stated
    smooth = fitting.fit_relaxation(fitting.RelaxationData(t=T, modulus=y), "Maxwell", sigma=0.1 * clean)
    assert not any("proportional" in note for note in smooth.notes)


@pytest.mark.slow
def test_a_long_series_has_intervals_that_hold_the_truth():
    """10 000 readings with errors of 5 %: weights of the readings make G 0.25 % and eta 0.6 % too low."""
    t = np.linspace(0.0, 60.0, 10_000)
    G = TRUE["G"] * np.exp(-t * TRUE["G"] / TRUE["eta"])
    G *= 1.0 + 0.05 * np.random.default_rng(4).standard_normal(t.size)
    fit = fitting.fit_relaxation(fitting.RelaxationData(t=t, modulus=G), "Maxwell", weights="proportional")
    for name, value in TRUE.items():
        low, high = fit.intervals[name]
        assert high / low < 1.004
        assert abs(fit.values[name] - value) < 0.75 * (high - low)  # three standard errors


@pytest.mark.long
def test_a_constant_response_of_a_film_is_the_mean():
    """The unbiased equations of a constant have their mean as solution."""
    y = 1e-7 * noisy(np.ones(12))
    hold = fitting.IndentationData(t=np.arange(12.0), load=np.full(12, 1e-3), depth=y)
    fit = fitting.fit_indentation(
        hold, "Elastic", indenter=jc.Sphere(radius=1e-3), nu=0.3, weights="proportional", layer=1e-5,
        substrate=jc.Elastic(1e9, 0.3), grid=16,
    )  # fmt: skip
    np.testing.assert_allclose(fit.fitted, y.mean(), rtol=1e-4)


@pytest.mark.slow
def test_a_spectrum_describes_noisy_moduli_without_an_offset():
    omega = np.geomspace(0.1, 10.0, 120)
    clean = 1e5 * 1j * omega / (1.0 + 1j * omega) + 1e5
    rng = np.random.default_rng(5)
    off = 0.15 * (rng.standard_normal(120) + 1j * rng.standard_normal(120))
    y = clean + np.abs(clean) * off
    fit = fitting.fit_spectrum(fitting.OscillationData(omega, y.real, y.imag))
    found = np.asarray(fit.material.complex_modulus(omega))
    assert abs(np.mean((found / clean - 1.0).real)) < 0.025  # 4.5 % with weights of the readings
