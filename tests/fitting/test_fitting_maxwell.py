"""Generalised Maxwell models against non-negative least squares of scipy, and closed forms written here."""

import itertools
import json

import jax
import mpmath
import numpy as np
import pytest
from scipy import optimize

import fitting
import jaxcontact as jc
from fitting.cli.command import main
from fitting.fits.prony import MaxwellSeries

TAU, MODULI = np.array([0.03, 1.0, 40.0]), np.array([3e5, 1e5, 2e4])
T, OMEGA = np.geomspace(1e-3, 1e3, 80), np.geomspace(1e-3, 1e3, 60)


LAW = jax.jit(lambda material: (material.relaxation(T), material.complex_modulus(OMEGA), material.creep(T)))


def relaxed(Ge=0.0, t=T):
    return Ge + np.exp(-t[:, None] / TAU) @ MODULI


def oscillating(Ge=0.0, omega=OMEGA):
    s = 1j * omega[:, None] * TAU
    return Ge + (s / (1.0 + s)) @ MODULI


def curve(kind, Ge, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    if kind == "relaxation":
        return fitting.RelaxationData(T, relaxed(Ge) * (1.0 + noise * rng.standard_normal(T.size)), start=0.0)
    G = oscillating(Ge)
    error = noise * (rng.standard_normal(OMEGA.size) + 1j * rng.standard_normal(OMEGA.size)) * np.abs(G)
    return fitting.OscillationData(OMEGA, (G + error).real, (G + error).imag)


@pytest.mark.parametrize("kind", ["relaxation", "oscillation"])
@pytest.mark.parametrize("Ge", [0.0, 5e3])
def test_exact_data_return_the_moduli_and_the_equivalent_material(kind, Ge):
    fit = fitting.fit_maxwell(curve(kind, Ge), TAU, weights="relative", equilibrium=Ge > 0)
    truth = ({"Ge": Ge} if Ge else {}) | {f"G{i + 1}": G for i, G in enumerate(MODULI)}
    assert fit.values == pytest.approx(truth, rel=1e-7)
    relaxation, G, creep = map(np.asarray, LAW(fit.material))
    assert relaxation == pytest.approx(relaxed(Ge), rel=1e-6)
    assert np.abs(G / oscillating(Ge) - 1.0).max() < 1e-6
    assert fit.predict(T) == pytest.approx(creep, rel=1e-9)
    slope = MODULI @ TAU  # steady flow of a liquid
    assert float(fit.material.fluidity) == pytest.approx(0.0 if Ge else 1.0 / slope, rel=1e-7)


def test_the_conversion_is_that_of_the_poles():
    """Retardation rates are the zeros of G*(s), found here by bisection between the relaxation rates."""
    series = MaxwellSeries.with_times(TAU, True)
    c = series.compliances(np.append(5e3, MODULI))
    G = lambda rho: 5e3 - np.sum(MODULI * rho / (1.0 / TAU - rho))
    ends = np.append(0.0, np.sort(1.0 / TAU))
    inside = [(a + 1e-9 * (b - a), b - 1e-9 * (b - a)) for a, b in itertools.pairwise(ends)]
    assert np.asarray(c.rates) == pytest.approx([optimize.brentq(G, a, b) for a, b in inside], rel=1e-7)
    assert float(c.instantaneous) == pytest.approx(1.0 / (5e3 + MODULI.sum()))


@pytest.mark.parametrize("kind", ["relaxation", "oscillation"])
def test_the_optimum_is_the_nonnegative_least_squares(kind):
    data, tau = curve(kind, 5e3, noise=0.02), np.geomspace(1e-2, 1e2, 7)
    fit = fitting.fit_maxwell(data, tau, weights="proportional")
    if kind == "relaxation":
        A, y = np.column_stack([np.ones(T.size), np.exp(-T[:, None] / tau)]), data.modulus
        size = fit.fitted
    else:
        s = 1j * OMEGA[:, None] * tau
        whole = np.column_stack([np.ones(OMEGA.size), s / (1.0 + s)])
        A, y = np.concatenate([whole.real, whole.imag]), np.append(data.shear.real, data.shear.imag)
        size = np.tile(np.hypot(*np.split(fit.fitted, 2)), 2)
    weight = fit.residuals / (fit.fitted - y)
    np.testing.assert_allclose(weight * size, 1.0, rtol=1e-3)
    A, y = weight[:, None] * A, weight * y
    scale = np.linalg.norm(A, axis=0)
    best, cost = optimize.nnls(A / scale, y)
    assert list(fit.values.values()) == pytest.approx(
        best / scale, rel=1e-5, abs=1e-7 * best.max() / scale.min()
    )
    assert fit.rss == pytest.approx(cost**2, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["relaxation", "oscillation"])
def test_times_are_chosen(kind):
    """A broad power law: the chosen series describes it to the noise, within and between the data."""
    rng = np.random.default_rng(3)
    if kind == "relaxation":
        data = fitting.RelaxationData(
            T, 1e4 * T**-0.4 * (1.0 + 0.01 * rng.standard_normal(T.size)), start=0.0
        )
        fit = fitting.fit_maxwell(data, weights="relative")
        inner = (T > 1e-2) & (T < 1e2)
        assert fit.modulus(T[inner]) == pytest.approx(1e4 * T[inner] ** -0.4, rel=0.03)
    else:
        G = 1e4 * (1j * OMEGA) ** 0.4
        error = 0.01 * np.abs(G) * (rng.standard_normal(60) + 1j * rng.standard_normal(60))
        fit = fitting.fit_maxwell(fitting.OscillationData(OMEGA, (G + error).real, (G + error).imag))
        inner = (OMEGA > 1e-2) & (OMEGA < 1e2)
        assert np.abs(fit.modulus(OMEGA[inner]) / G[inner] - 1.0).max() < 0.03
    assert "relaxation times chosen by BIC" in fit.notes[-1] and fit.verdict == "accepted"


@pytest.mark.slow
def test_propagation_and_intervals():
    fit = fitting.fit_maxwell(curve("relaxation", 5e3, noise=0.01), TAU, weights="relative")
    assert all(fit.identified.values())
    assert all(
        low < truth < high for (low, high), truth in zip(fit.intervals.values(), [5e3, *MODULI], strict=True)
    )
    band = fitting.propagate(fit, lambda material: material.creep(1e6))
    assert float(band.low) < 1.0 / 5e3 < float(band.high)
    low, high = fit.band([1e4])
    assert low[0] < float(jc.Prony.creep(fit.material, 1e4)) < high[0]


def test_bad_input():
    with pytest.raises(ValueError, match="data: expected RelaxationData or OscillationData, got ndarray"):
        fitting.fit_maxwell(T)
    with pytest.raises(ValueError, match="tau: expected times > 0"):
        fitting.fit_maxwell(curve("relaxation", 0.0), [-1.0])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["relaxation", pytest.param("oscillation", marks=pytest.mark.slow)])
def test_the_shell(tmp_path, capsys, kind):
    data, path = curve(kind, 5e3, noise=0.01), tmp_path / "melt.csv"
    if kind == "relaxation":
        rows = "".join(f"{t:.9g},{G:.9g}\n" for t, G in zip(data.t, data.modulus, strict=True))
        path.write_text("t [s],G(t) [Pa]\n" + rows)
        more = ["--start", "0", "--tau", "auto"]
    else:
        rows = zip(data.omega, data.storage, data.loss, strict=True)
        path.write_text(
            "omega [rad/s],G' [Pa],G'' [Pa]\n" + "".join(f"{w:.9g},{a:.9g},{b:.9g}\n" for w, a, b in rows)
        )
        more = ["--tau", "0.03,1,40"]
    words = [kind, str(path), *more, "-o", str(tmp_path / "out")]
    assert main(words) == 0
    assert ("chosen by BIC" in capsys.readouterr().out) == (kind == "relaxation")
    with pytest.raises(ValueError, match="--tau: expected no --fix"):
        main([*words[:-1], str(tmp_path / "other"), "--fix", "G1=1"])
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["verdict"] == "accepted" and "Ge_Pa" in summary["parameters"]


@pytest.mark.slow
def test_a_plateau_that_relaxes_after_the_data_is_noted():
    """A liquid of 1e5 Pa with 100 s, measured to 1 s, looks like a solid; the data cannot show which it is."""
    t = np.geomspace(0.01, 1.0, 40)
    modulus = 1e5 * (np.exp(-t / 100.0) + np.exp(-t / 0.1))
    noise = 1.0 + 0.01 * np.random.default_rng(2).standard_normal(t.size)
    fit = fitting.fit_maxwell(fitting.RelaxationData(t, modulus * noise, start=0.0))
    assert fit.intervals["Ge"][0] > 0.0 and "not relaxed within the data (1 s)" in " ".join(fit.notes)
    fluid = fitting.fit_maxwell(fitting.RelaxationData(t, 1e5 * np.exp(-t / 0.1) * noise, start=0.0), [0.1])
    assert not any("not relaxed" in note for note in fluid.notes)


def creep_of_modes(Ge, G, tau, t):
    """J(t) at times (n,) by mpmath's inversion of its Laplace transform 1/(s^2 G(s)), of 60 digits."""
    with mpmath.workdps(60):
        G, tau = [mpmath.mpf(float(g)) for g in G], [mpmath.mpf(float(a)) for a in tau]
        moving = lambda s: (
            mpmath.mpf(float(Ge)) + sum(g * s * a / (1 + s * a) for g, a in zip(G, tau, strict=True))
        )
        found = [mpmath.invertlaplace(lambda s: 1 / (s * moving(s)), float(x), method="talbot") for x in t]
        return np.array([float(each) for each in found])


@pytest.mark.slow
@pytest.mark.parametrize("decades", [26, pytest.param(30, marks=pytest.mark.long), 45])
@pytest.mark.parametrize("solid", [True, False])
def test_spectra_over_tens_of_decades_give_the_creep_of_mpmath(decades, solid):
    """Random moduli from 1 to 1e9 Pa: eigenvalues of the matrix of rates were wrong below 1e-16 of the largest."""
    rng = np.random.default_rng(decades)
    tau = np.logspace(-10, decades - 10, decades // 2 + 1) * 10 ** rng.uniform(-0.5, 0.5, decades // 2 + 1)
    G = 10 ** np.linspace(9, 5, tau.size) * rng.uniform(0.3, 3.0, tau.size)
    G[rng.integers(1, tau.size - 1)] *= 1e-12  # a time that hardly relaxes
    Ge = 3e3 if solid else 0.0
    t = np.geomspace(tau[0] / 3.0, 3.0 * tau[-1], 12 * tau.size)
    data = fitting.RelaxationData(t, Ge + np.exp(-t[:, None] / tau) @ G, start=0.0)
    fit = fitting.fit_maxwell(data, tau, weights="relative", equilibrium=solid)
    found = np.array([fit.values[f"G{i + 1}"] for i in range(tau.size)])
    at = np.geomspace(tau[0], 30.0 * tau[-1], 9)
    right = creep_of_modes(fit.values.get("Ge", 0.0), found, tau, at)
    omega = 1.0 / t
    law = jax.jit(
        lambda material: (material.creep(at), material.relaxation(t), material.complex_modulus(omega))
    )
    creep, relaxation, modulus = law(fit.material)
    np.testing.assert_allclose(creep, right, rtol=1e-11)
    np.testing.assert_allclose(fit.predict(at), right, rtol=1e-11)
    np.testing.assert_allclose(relaxation, data.modulus, rtol=1e-6)
    s = 1j * omega[:, None] * tau
    np.testing.assert_allclose(modulus, fit.values.get("Ge", 0.0) + (s / (1.0 + s)) @ found, rtol=1e-9)
