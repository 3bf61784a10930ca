"""Long curves as means: a fit of the means finds what a fit of the samples does, from a fraction of the points."""

import json

import numpy as np
import pytest
from scipy import signal

import fitting
import jaxcontact as jc
from jaxcontact.__main__ import main

TRUTH = {"G1": 0.75e9, "G2": 13.89e6, "eta1": 3.1486e12, "eta2": 120.9e9}
T = np.linspace(0.4, 40000.0, 100_000)


def creep(t):
    return 1 / TRUTH["G1"] - np.expm1(-TRUTH["G2"] / TRUTH["eta2"] * t) / TRUTH["G2"] + t / TRUTH["eta1"]


def noisy(rho, n, seed=0, t=T):
    """1 % of an AR(1) series of correlation rho on every (100000/n)th sample."""
    white = np.random.default_rng(seed).standard_normal(n)
    noise = signal.lfilter([np.sqrt(1 - rho**2)], [1, -rho], white)
    t = t[:: t.size // n]
    return fitting.CreepData(t=t, J=creep(t) * (1 + 0.01 * noise))


def width(fit, name):
    low, high = fit.intervals[name]
    return np.log(high / low)


@pytest.mark.slow
def test_means_of_a_clean_curve_give_its_parameters():
    short = fitting.resample(fitting.CreepData(t=T, J=creep(T)))
    assert 100 < short.t.size < 150
    np.testing.assert_allclose(short.J, creep(short.t), rtol=1e-5)
    found = fitting.fit_creep(short)
    for name, value in TRUTH.items():
        np.testing.assert_allclose(found.values[name], value, rtol=1e-4, err_msg=name)


@pytest.mark.slow
def test_under_white_noise_intervals_are_those_of_all_samples():
    data = noisy(0.0, 10_000)
    short = fitting.resample(data)
    few, all_of_them = fitting.fit_creep(short), fitting.fit_creep(data, weights="relative")
    assert few.weights == "averaged" and few.verdict == "accepted" and "correlated" not in short.notes[0]
    for name in TRUTH:
        ratio = width(few, name) / width(all_of_them, name)
        print(f"{name}: interval {ratio:.3f} of that of all samples")
        assert 0.8 < ratio < 1.25, name  # its own noise is known to 7 % from 130 means
        assert abs(np.log(few.values[name] / all_of_them.values[name])) < 0.5 * width(few, name)


@pytest.mark.long
@pytest.mark.parametrize(("rho", "least"), [(0.0, 0.88), (0.9, 0.8), (0.98, 0.8)])
def test_intervals_of_means_hold_the_truth_under_correlated_noise_too(rho, least):
    """Measured: 94 to 96, 88 to 94 and 86 to 99 of 100. With samples taken for independent a mean's error would be 4 times
    too small at 0.9, and 10 times at 0.98."""
    held = dict.fromkeys(TRUTH, 0)
    for seed in range(100):
        found = fitting.fit_creep(fitting.resample(noisy(rho, 10_000, seed)))
        for name, value in TRUTH.items():
            low, high = found.intervals[name]
            held[name] += low < value < high
    print(f"rho = {rho}: 95 % intervals of 100 series that hold the truth: {held}")
    assert min(held.values()) >= 100 * least


@pytest.mark.slow
def test_a_wander_slower_than_the_bins_is_still_seen():
    """1 % over 5000 s under white noise of 1 %: averaging takes the noise off, not the verdict."""
    white, t = noisy(0.0, 10_000), T[::10]
    wander = fitting.CreepData(t=t, J=white.J + 0.01 * creep(t) * np.sin(2 * np.pi * t / 5000.0))
    found = fitting.fit_creep(fitting.resample(wander))
    assert found.verdict == "rejected" and found.misfit


def test_no_mean_mixes_what_is_before_a_jump_of_the_stress_with_what_is_after():
    t = np.linspace(0.0, 100.0, 4001)
    held = (np.array([0.0, 50.0, 50.0, 100.0]), np.array([1e3, 1e3, 0.0, 0.0]))
    strain = 1e-3 * np.where(t < 50.0, 1 + t / 10, 5.0 + 0.0 * t)
    short = fitting.resample(fitting.CreepData(t=t, strain=strain, stress=held))
    after = short.t >= 50.0
    assert np.all(short.strain[after] == pytest.approx(5e-3, rel=1e-12))
    np.testing.assert_allclose(short.strain[~after], 1e-3 * (1 + short.t[~after] / 10), rtol=1e-12)
    dense = np.diff(short.t)[np.searchsorted(short.t, 50.0) :]
    assert dense[0] < 0.1 < dense[80]  # the logarithm begins again
    measured = fitting.CreepData(t=t, strain=strain, stress=np.where(t < 50.0, 1e3, 0.0))
    knots, stress = fitting.resample(measured).stress
    np.testing.assert_allclose(stress, np.where(knots < 50.0, 1e3, 0.0), atol=1e-9)


def test_a_few_samples_stay_as_they_are_and_known_errors_become_those_of_means():
    t = np.geomspace(1.0, 100.0, 15)
    sparse = fitting.CreepData(t=t, J=1e-6 * t)
    np.testing.assert_array_equal(fitting.resample(sparse).J, sparse.J)
    t = np.arange(1.0, 4001.0)
    noise = 1e-8 * np.random.default_rng(1).standard_normal(t.size)
    sigma = np.full(t.size, 1e-8)
    data = fitting.CreepData(t=t, J=1e-6 * (1 + t / 1000) + noise, sigma=sigma)
    short = fitting.resample(data, 10)
    off = (short.J - 1e-6 * (1 + short.t / 1000)) / short.sigma
    assert short.scatter is None and short.sigma.min() < 0.1e-8 and short.sigma[0] == 1e-8
    assert 0.75 < np.sqrt(np.mean(off**2)) < 1.25


@pytest.mark.slow
@pytest.mark.parametrize("control", ["load", "depth"])
def test_an_indentation_keeps_its_segments(control):
    """A ramp of 2 s and a hold, 5000 samples a second there and 100 a second after."""
    t = np.concatenate([np.arange(0.0, 2.0, 2e-3), np.arange(2.0, 200.0, 2e-2)])
    load = 1e-3 * np.minimum(t / 2, 1.0)
    # of (1 + s/100) under the unit ramp
    integral = np.where(t < 2, t + t**2 / 2 / 100, 2 + 2 * (t - 1) / 100) / 2
    ball = jc.Sphere(radius=5e-3)
    depth = (3 * 0.5 / (8 * np.sqrt(5e-3)) * 1e-3 * 1e-6 * integral) ** (2 / 3)
    short = fitting.resample(fitting.IndentationData(t=t, load=load, depth=depth))
    assert short.t.size < 250 and 2.0 in short.t
    # none across the corner
    np.testing.assert_allclose(short.load, 1e-3 * np.minimum(short.t / 2, 1.0), rtol=1e-9)
    found = fitting.fit_indentation(short, "Maxwell", indenter=ball, nu=0.5, control=control)
    assert found.weights == "averaged" and short.whole.shape == (3, t.size)
    np.testing.assert_allclose([found.values["G"], found.values["eta"]], [1e6, 1e8], rtol=2e-3)


@pytest.mark.parametrize(
    ("data", "per_decade", "message"),
    [
        ([1.0, 2.0], 20, "data: expected CreepData, RelaxationData or IndentationData, got list"),
        (noisy(0.0, 100), 0, "per_decade: expected a number > 0, got 0"),
        (noisy(0.0, 100), "20", "per_decade: expected a number > 0, got '20'"),
    ],
)
def test_what_cannot_be_resampled_is_refused(data, per_decade, message):
    with pytest.raises(ValueError, match=message):
        fitting.resample(data, per_decade)


@pytest.mark.slow
def test_the_command_line(tmp_path, capsys):
    data = noisy(0.0, 5000)
    file = tmp_path / "creep.csv"
    np.savetxt(file, np.c_[data.t, data.J], delimiter=",", header="t [s],J [1/Pa]", comments="")
    assert main(["fit", "creep", str(file), "-o", str(tmp_path / "out"), "--resample", "20"]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["weights"] == "averaged" and any(
        "of 5000 points left" in note for note in summary["notes"]
    )
    assert main(["fit", "creep", str(file), "-o", str(tmp_path / "no"), "--resample", "-1"]) == 2
    assert "--resample: expected a number > 0, got -1.0" in capsys.readouterr().err


@pytest.mark.slow
def test_a_relaxation_is_resampled():
    """10,000 samples of a Maxwell fluid: the fit to the means has the interval of the fit to the samples."""
    t = np.arange(1.0, 10001.0) * 1e-3
    G = 1e6 * np.exp(-t / 4.0) * (1 + 0.05 * np.random.default_rng(5).standard_normal(t.size))
    data = fitting.RelaxationData(t=t, modulus=G)
    short = fitting.resample(data, 30)
    assert short.t.size < 250 and "resampled" in short.notes[-1]
    few = fitting.fit_relaxation(short, "Maxwell").intervals["eta"]
    all_of_them = fitting.fit_relaxation(data, "Maxwell", weights="relative").intervals["eta"]
    np.testing.assert_allclose(few, 4e6, rtol=0.02)
    np.testing.assert_allclose(few[1] - few[0], all_of_them[1] - all_of_them[0], rtol=0.1)
