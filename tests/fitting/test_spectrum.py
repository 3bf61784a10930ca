"""Continuous relaxation spectra: known spectra whose moduli follow by quadrature, and what the data resolve."""

import json

import numpy as np
import pytest

import fitting
import jaxcontact as jc
from jaxcontact.__main__ import main
from tests.support.tables import read_back

LOGS = np.linspace(np.log(1e-6), np.log(1e6), 8001)
OMEGA = np.geomspace(1e-2, 1e2, 31)


def spectrum(tau):
    """Two normal curves over log tau and a constant [Pa]."""
    first = 1e4 * np.exp(-0.5 * (np.log(tau / 0.05) / 1.2) ** 2)
    return first + 3e3 * np.exp(-0.5 * np.log(tau / 20.0) ** 2) + 10.0


def moduli(omega=OMEGA, plateau=0.0):
    """Complex modulus of the spectrum by the trapezoidal rule in log tau."""
    tau = np.exp(LOGS)
    return plateau + np.array(
        [np.trapezoid(spectrum(tau) * 1j * w * tau / (1 + 1j * w * tau), LOGS) for w in omega]
    )


def noisy(G, seed, size=0.02):
    e = 1.0 + size * np.random.default_rng(seed).standard_normal((2, G.size))
    return fitting.OscillationData(OMEGA, G.real * e[0], G.imag * e[1])


def inside(fit):
    """Whether the interval holds the true spectrum, at the resolved times."""
    true = spectrum(fit.tau)
    return ((fit.low <= true) & (true <= fit.high))[fit.resolved]


@pytest.mark.slow
def test_a_known_spectrum_is_recovered_from_moduli():
    fit = fitting.fit_spectrum(noisy(moduli(), 1))
    assert not fit.refused and inside(fit).mean() > 0.8
    first, last = fit.limits
    assert 2e-3 < first < 2e-2 and 50.0 < last < 500.0  # little more than the reciprocal of the frequencies
    assert np.all(fit.width[fit.resolved] > 0.5) and np.all(np.isnan(fit.width[~fit.resolved]))
    np.testing.assert_allclose(fit.material.complex_modulus(OMEGA), moduli(), rtol=0.05)
    assert "resolved from" in fit.summary()


@pytest.mark.slow
def test_a_relaxation_modulus_with_a_plateau():
    t, tau = np.geomspace(1e-2, 1e2, 60), np.exp(LOGS)
    G = 5e4 + np.array([np.trapezoid(spectrum(tau) * np.exp(-s / tau), LOGS) for s in t])
    data = fitting.RelaxationData(
        t=t, modulus=G * (1.0 + 0.003 * np.random.default_rng(0).standard_normal(60))
    )
    fit = fitting.fit_spectrum(data, weights="relative")
    assert inside(fit).mean() > 0.8 and fit.resolved.sum() > 10
    assert fit.equilibrium == pytest.approx(5e4, rel=0.03)


def test_exact_data_are_described_too():
    G = moduli()
    fit = fitting.fit_spectrum(fitting.OscillationData(OMEGA, G.real, G.imag))
    well = (fit.tau > 5e-3) & (fit.tau < 200.0)
    assert np.all(fit.resolved[well]) and not fit.refused
    np.testing.assert_allclose(fit.H[well], spectrum(fit.tau)[well], rtol=0.2)


@pytest.mark.slow
def test_noisier_data_resolve_less():
    sharp, blunt = (fitting.fit_spectrum(noisy(moduli(), 2, size)) for size in (0.003, 0.1))
    assert sharp.resolved.sum() > blunt.resolved.sum()
    assert np.nanmedian(sharp.width) < np.nanmedian(blunt.width)


@pytest.mark.slow
def test_nothing_resolved_is_said_in_words():
    """A plateau with 1 % of noise has no relaxation to resolve."""
    t, rng = np.geomspace(1.0, 100.0, 20), np.random.default_rng(0)
    fit = fitting.fit_spectrum(fitting.RelaxationData(t, 1e3 * (1.0 + 0.01 * rng.standard_normal(20))))
    assert not fit.resolved.any()
    assert "resolved nowhere" in fit.summary() and "nan" not in fit.summary()


@pytest.mark.parametrize("kind", ["relaxation", "oscillation"])
def test_a_constant_modulus_has_no_spectrum(kind, tmp_path):
    t = np.geomspace(1.0, 100.0, 20)
    data = fitting.RelaxationData(t, np.full(20, 700.0))
    if kind == "oscillation":
        data = fitting.OscillationData(t, np.full(20, 700.0), np.zeros(20))
    fit = fitting.fit_spectrum(data)
    assert np.all(fit.H == 0.0) and np.all(fit.high == 0.0) and not fit.resolved.any()
    assert fit.equilibrium == pytest.approx(700.0, rel=1e-12) and fit.verdict == "accepted"
    assert "the modulus is constant within 1e-08: no spectrum, H = 0" in fit.notes
    assert (
        "no spectrum: the modulus does not relax" in fit.summary()
        and not json.loads(fit.to_json())["reasons"]
    )
    np.testing.assert_allclose(fit.material.relaxation([1e-6, 1.0, 1e6]), 700.0, rtol=1e-12)
    fit.plot(tmp_path / "fit.png")


def test_data_that_no_spectrum_describes_are_rejected():
    """G'' = 0 with G' that falls with frequency contradicts every spectrum >= 0."""
    G = moduli()
    assert fitting.fit_spectrum(fitting.OscillationData(OMEGA, G.real[::-1], G.imag)).verdict == "rejected"


@pytest.mark.long
def test_the_bands_hold_the_spectrum():
    held = np.concatenate([inside(fitting.fit_spectrum(noisy(moduli(), seed))) for seed in range(20)])
    assert 0.88 < held.mean() <= 1.0


@pytest.mark.slow
def test_the_command(tmp_path, capsys):
    data = noisy(moduli(), 5)
    G = data.storage + 1j * data.loss
    rows = "".join(f"{w},{a},{b}\n" for w, a, b in zip(OMEGA, G.real, G.imag, strict=True))
    path = tmp_path / "melt.csv"
    path.write_text("omega [rad/s],G' [Pa],G'' [Pa]\n" + rows)
    main(["fit", "oscillation", str(path), "--spectrum", "-o", str(tmp_path / "out")])
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    known = np.array(found["resolved"])
    assert np.allclose(np.array(found["H_Pa"])[known], spectrum(np.array(found["tau_s"])[known]), rtol=0.5)
    assert "resolved from" in capsys.readouterr().out
    written = read_back(tmp_path / "out" / "curve.csv")
    np.testing.assert_allclose(written["omega [rad/s]"], OMEGA, rtol=1e-9)
    np.testing.assert_allclose(written["G'' [Pa]"], G.imag, rtol=1e-9)
    assert main(["fit", "oscillation", str(path), "--spectrum", "--tau", "1", "-o", str(tmp_path / "b")]) != 0


def test_mistakes():
    with pytest.raises(ValueError, match="data: expected RelaxationData or OscillationData, got list"):
        fitting.fit_spectrum([])
    few = jc.Maxwell(1.0, 1.0, nu=0.5).relaxation(np.arange(1.0, 7.0))
    with pytest.raises(ValueError, match="at least 8 values"):
        fitting.fit_spectrum(fitting.RelaxationData(t=np.arange(1.0, 7.0), modulus=few))


def test_one_relaxation_time_is_a_spectrum_whatever_its_noise():
    """The estimated weights of this noise become those of a constant error, of another size than the weights before."""
    t, noise = np.geomspace(0.1, 1e3, 40), np.random.default_rng(12).standard_normal(40)
    G = (2e5 + 8e5 * np.exp(-t / 30.0)) * (1 + 0.01 * noise)
    found = fitting.fit_spectrum(fitting.RelaxationData(t, G, start=0.0))
    assert found.verdict == "accepted" and found.tau[np.argmax(found.H)] == pytest.approx(30.0, rel=0.3)
    assert found.equilibrium == pytest.approx(2e5, rel=0.02)
