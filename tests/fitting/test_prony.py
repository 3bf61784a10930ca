"""Series of retardation times against non-negative and linear least squares of scipy, and a truth written here."""

import json

import numpy as np
import pytest
from scipy import optimize, stats
from test_creep import linear_times, noisy

import fitting


def test_prony_series_is_the_nonnegative_least_squares():
    """scipy's nnls on the same columns; intervals from its profile; a compliance of zero has no lower limit."""
    t, J = noisy(40000.0, 3)
    tau = [100.0, 1000.0, 8704.0, 60000.0]
    fit = fitting.fit_prony(fitting.CreepData(t=t, J=J), tau, weights="relative")
    A = np.column_stack([np.ones(t.size), *(1 - np.exp(-t / s) for s in tau), t]) / J[:, None]
    scale = np.linalg.norm(A, axis=0)
    best, cost = optimize.nnls(A / scale, np.ones(t.size))
    np.testing.assert_allclose(
        list(fit.values.values()), best / scale, rtol=1e-6, atol=1e-9 * best.max() / scale[0]
    )
    np.testing.assert_allclose(fit.rss, cost**2, rtol=1e-10)
    np.testing.assert_allclose(fit.predict(t), fit.fitted, rtol=1e-12)
    high = fit.intervals["J3"][1]
    rest = np.delete(A / scale, 3, axis=1)
    height = optimize.nnls(rest, 1 - A[:, 3] * high)[1] ** 2 / cost**2 - 1
    np.testing.assert_allclose(height * 194 / stats.f.ppf(0.95, 1, 194), 1.0, rtol=1e-2)
    assert fit.intervals["J1"][0] == 0.0 and "J1    not identifiable: <" in fit.summary() and not fit.misfit
    with pytest.raises(ValueError, match="tau"):
        fitting.fit_prony(fitting.CreepData(t=t, J=J), [-1.0], weights="relative")


def test_prony_series_of_a_recovery():
    """Strain of a hold and the recovery after it, from the sum of two exponentials written out here."""
    truth = {"J0": 1e-9, "J1": 4e-8, "J2": 7e-8, "fluidity": 3e-13}
    creep = lambda t: (
        1e-9 - 4e-8 * np.expm1(-t / 300.0) - 7e-8 * np.expm1(-t / 9000.0) + 3e-13 * np.clip(t, 0.0, None)
    )
    t = linear_times(30000.0)
    strain = 2e6 * (creep(t) - np.where(t >= 12000.0, creep(np.clip(t - 12000.0, 0.0, None)), 0.0))
    data = fitting.CreepData(t=t, strain=strain, stress=([0.0, 12000.0, 12000.0], [2e6, 2e6, 0.0]))
    fit = fitting.fit_prony(data, [300.0, 9000.0], weights="absolute")
    for name, value in truth.items():
        np.testing.assert_allclose(fit.values[name], value, rtol=1e-9)
    np.testing.assert_allclose(fit.predict(t), creep(t), rtol=1e-9)


@pytest.mark.slow
def test_prony_band_is_that_of_linear_least_squares(tmp_path):
    """J(t) is linear in the compliances: its variance is x (A^T A)^-1 x s^2; the band is even in log J."""
    t, J = noisy(40000.0, 3)
    fit = fitting.fit_prony(fitting.CreepData(t=t, J=J), [8704.0], weights="relative")
    A = np.column_stack([np.ones(t.size), 1 - np.exp(-t / 8704.0), t]) / J[:, None]
    C = np.linalg.inv(A.T @ A) * fit.rss / (t.size - 3)
    for time in (100.0, 30000.0):
        x = np.array([1.0, 1 - np.exp(-time / 8704.0), time])
        low, high = (float(end[0]) for end in fit.band([time]))
        np.testing.assert_allclose(
            np.log(high / low), 2 * 1.959964 * np.sqrt(x @ C @ x) / fit.predict(time), rtol=1e-6
        )
        np.testing.assert_allclose(low * high, fit.predict(time) ** 2, rtol=1e-12)
    loaded = json.loads(fit.to_json())
    assert loaded["parameters"]["J1_1_per_Pa"] == fit.values["J1"] and loaded["tau_s"] == [8704.0]
    assert loaded["intervals"]["fluidity_1_per_Pa_s"] == list(fit.intervals["fluidity"])
    fit.plot(tmp_path / "fit.png")
    assert (tmp_path / "fit.png").stat().st_size > 10000


def spread_out(seed):
    """Three elements two decades apart under 1 % noise, over six decades: t, truth, J."""
    t = np.geomspace(1e-2, 1e4, 180)
    truth = 1e-9 - 2e-9 * np.expm1(-t / 0.5) - 1e-9 * np.expm1(-t / 50.0) - 4e-9 * np.expm1(-t / 2000.0)
    return t, truth, truth * (1 + 0.01 * np.random.default_rng(seed).standard_normal(t.size))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_times_that_are_chosen_follow_the_truth_within_the_noise(seed):
    """As many as the lowest BIC asks for, here by least squares of numpy on the columns that are not zero."""
    t, truth, J = spread_out(seed)
    fit = fitting.fit_prony(fitting.CreepData(t=t, J=J), weights="relative")
    # half of the noise
    assert np.sqrt(np.mean((fit.predict(t) / truth - 1) ** 2)) < 0.005 and not fit.refused
    assert "retardation times chosen by BIC" in fit.notes[-1]

    def bic(tau):
        A = np.column_stack([np.ones(t.size), -np.expm1(-t[:, None] / tau), t]) / J[:, None]
        x = optimize.nnls(A / np.linalg.norm(A, axis=0), np.ones(t.size))[0]
        rss = np.linalg.lstsq(A[:, x > 0], np.ones(t.size), rcond=None)[1][0]
        return t.size * np.log(rss) + np.log(t.size) * np.sum(x > 0)

    spread = lambda k: 1e-2 * 1e6 ** ((np.arange(k) + 0.5) / k)
    np.testing.assert_allclose(fit.tau, spread(min(range(1, 19), key=lambda k: bic(spread(k)))), rtol=1e-9)
