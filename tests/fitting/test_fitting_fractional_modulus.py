"""Fractional laws on moduli: closed forms written here, the Maxwell law by the scaled complementary error function."""

import json

import numpy as np
import pytest
from scipy import special

import fitting
from fitting.cli.command import main

T, OMEGA = np.geomspace(1e-2, 1e3, 60), np.geomspace(1e-2, 1e3, 50)
TRUTH = {
    "Springpot": {"V": 2e4, "alpha": 0.3},
    "FractionalKelvinVoigt": {"G": 5e3, "V": 2e4, "alpha": 0.5},
    "FractionalMaxwell": {"G": 8e4, "V": 2e4, "alpha": 0.5},
}


def complex_modulus(name, omega=OMEGA):
    values = TRUTH[name]
    pot = values["V"] * (1j * omega) ** values["alpha"]
    if name == "FractionalMaxwell":
        return 1.0 / (1.0 / values["G"] + 1.0 / pot)
    return values.get("G", 0.0) + pot


def relaxation(name, t=T):
    values = TRUTH[name]
    if name == "FractionalMaxwell":  # E_1/2(-x) = erfcx(x)
        return values["G"] * special.erfcx(np.sqrt(t) * values["G"] / values["V"])
    return values.get("G", 0.0) + values["V"] * t ** -values["alpha"] / special.gamma(1.0 - values["alpha"])


def curve(name, kind, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    if kind == "relaxation":
        error = 1.0 + noise * rng.standard_normal(T.size)
        return fitting.RelaxationData(T, relaxation(name) * error, start=0.0)
    G = complex_modulus(name)
    G = G + noise * np.abs(G) * (rng.standard_normal(G.size) + 1j * rng.standard_normal(G.size))
    return fitting.OscillationData(OMEGA, G.real, G.imag)


SLOWEST = ("FractionalMaxwell", "relaxation")  # every value by a series


def fitted(name, kind, **given):
    fit = fitting.fit_relaxation if kind == "relaxation" else fitting.fit_oscillation
    return fit(curve(name, kind, **given), name, weights="relative")


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        pytest.param(name, kind, marks=pytest.mark.slow if (name, kind) == SLOWEST else ())
        for name in TRUTH for kind in ("relaxation", "oscillation")
    ],
)  # fmt: skip
def test_exact_data_return_the_law(name, kind):
    fit = fitted(name, kind)
    assert fit.values == pytest.approx(TRUTH[name], rel=1e-6)
    at, expected = (T, relaxation(name)) if kind == "relaxation" else (OMEGA, complex_modulus(name))
    assert np.abs(fit.modulus(at) / expected - 1.0).max() < 1e-6
    inner = np.geomspace(0.1, 10.0, 9)
    material = np.asarray(fit.material.complex_modulus(inner))
    # the Prony approximation of J(t)
    assert np.abs(material / complex_modulus(name, inner) - 1.0).max() < 0.01


def test_intervals_are_those_of_least_squares():
    """Against the covariance of the logarithms, with a Jacobian by differences of the closed form."""
    fit = fitted("FractionalMaxwell", "oscillation", noise=0.01)
    data = fit.data
    assert fit.verdict == "accepted"

    def model(z):
        pot = np.exp(z[1]) * (1j * OMEGA) ** z[2]
        G = pot * np.exp(z[0]) / (pot + np.exp(z[0])) / np.abs(data.shear)
        return np.append(G.real, G.imag)

    z = np.array([np.log(fit.values["G"]), np.log(fit.values["V"]), fit.values["alpha"]])
    J = np.stack([(model(z + e) - model(z - e)) / 2e-6 for e in 1e-6 * np.eye(3)], -1)
    sd = np.sqrt(np.diag(np.linalg.inv(J.T @ J)) * fit.rss / (100 - 3))
    low, high = fit.intervals["alpha"]
    assert 0.95 < (high - low) / (2 * 1.985 * sd[2]) < 1.35  # widened for possible correlation


@pytest.mark.slow
@pytest.mark.parametrize(
    "name, kind", [("FractionalMaxwell", "oscillation"), ("FractionalKelvinVoigt", "relaxation")]
)
def test_intervals_hold_the_truth(name, kind):
    """Twenty sets: fewer than 16 of 20 is improbable (3e-3) for a coverage of 95 %."""
    ends = [fitted(name, kind, noise=0.01, seed=seed).intervals["alpha"] for seed in range(20)]
    assert sum(low < 0.5 < high for low, high in ends) >= 16


@pytest.mark.slow
def test_a_classical_model_is_worse_and_the_band_holds_the_moduli():
    data = curve("FractionalMaxwell", "oscillation", noise=0.01)
    assert fitting.fit_oscillation(data, "Maxwell").verdict == "rejected"
    fits = [fitted("FractionalMaxwell", "oscillation", noise=0.01, seed=seed) for seed in range(10)]
    bands, expected = [fit.modulus_band(OMEGA) for fit in fits], complex_modulus("FractionalMaxwell")
    inside = [(low.imag < expected.imag) & (expected.imag < high.imag) for low, high in bands]
    assert np.mean(inside) > 0.8


def test_bad_input():
    data = fitting.RelaxationData(np.append(0.0, T), np.append(9e4, relaxation("Springpot")), start=0.0)
    with pytest.raises(ValueError, match="t: expected times > 0 for a fractional law, got 0"):
        fitting.fit_relaxation(data, "Springpot")


@pytest.mark.slow
def test_the_shell(tmp_path):
    data, path = curve("FractionalMaxwell", "oscillation", noise=0.01), tmp_path / "gel.csv"
    rows = zip(data.omega, data.storage, data.loss, strict=True)
    path.write_text(
        "omega [rad/s],G' [Pa],G'' [Pa]\n" + "".join(f"{w:.9g},{a:.9g},{b:.9g}\n" for w, a, b in rows)
    )
    words = ["oscillation", str(path), "--model", "fractionalmaxwell", "-o", str(tmp_path / "out")]
    assert main(words) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["parameters"]["alpha"] == pytest.approx(0.5, abs=0.01)
