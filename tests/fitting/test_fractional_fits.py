"""Fits of fractional laws against scipy's least squares on J(t) by other means: the power law, and Talbot's contour."""

import json

import numpy as np
import pytest
from scipy import optimize, special, stats

import fitting
import jaxcontact as jc
from jaxcontact.__main__ import main

TIMES = np.geomspace(0.1, 1e3, 60)


def mittag_leffler(alpha, x):
    """E_alpha(-x^alpha), whose transform is s^(alpha-1)/(s^alpha + 1), by the fixed Talbot contour."""
    n = 24
    theta = np.arange(1, n) * np.pi / n
    r = 2.0 * n / (5.0 * x[:, None])
    s = r * theta * (1.0 / np.tan(theta) + 1j)
    turn = 1.0 + 1j * (theta + (theta / np.tan(theta) - 1.0) / np.tan(theta))
    image = lambda s: s ** (alpha - 1.0) / (s**alpha + 1.0)
    ends = 0.5 * np.exp(r * x[:, None]) * image(r + 0j)
    return np.real(r[:, 0] / n * (ends[:, 0] + np.sum(np.exp(x[:, None] * s) * image(s) * turn, 1)))


def power(V, alpha, t=TIMES):
    return t**alpha / (V * special.gamma(1.0 + alpha))


CREEP = {
    "Springpot": power,
    "FractionalMaxwell": lambda G, V, alpha: 1.0 / G + power(V, alpha),
    "FractionalKelvinVoigt": lambda G, V, alpha: (
        (1.0 - mittag_leffler(alpha, TIMES * (G / V) ** (1 / alpha))) / G
    ),
}
TRUTH = {"G": 800.0, "V": 1500.0, "alpha": 0.4}


def noisy(model):
    truth = [TRUTH[name] for name in ("G", "V", "alpha")][model == "Springpot" :]
    J = CREEP[model](*truth)
    return J, J * (1.0 + 0.01 * np.random.default_rng(3).standard_normal(J.size))


def least(model, J, sigma, start, held=None):
    """chi^2 of scipy's least squares, and its parameters; held: (place, value)."""
    free = np.arange(len(start)) != (held[0] if held else -1)

    def residual(logs):
        values = np.array(start, dtype=float)
        if held:
            values[held[0]] = held[1]
        values[free] = np.exp(logs)
        return (CREEP[model](*values) - J) / sigma

    found = optimize.least_squares(
        residual, np.log(np.array(start)[free]), xtol=1e-13, ftol=1e-13, gtol=1e-13
    )
    return 2.0 * found.cost, np.exp(found.x)


@pytest.mark.parametrize(
    "model",
    [
        pytest.param("FractionalKelvinVoigt", marks=pytest.mark.slow),
        pytest.param("FractionalMaxwell", marks=pytest.mark.slow),
        "Springpot",
    ],
)
def test_values_and_profile_intervals_are_those_of_scipy(model):
    """At an end of an interval the least chi^2 is 3.84 above the best: sigma is known."""
    truth, J = noisy(model)
    fit = fitting.fit_creep(fitting.CreepData(t=TIMES, J=J), model, sigma=0.01 * truth)
    best, values = least(model, J, 0.01 * truth, list(fit.values.values()))
    np.testing.assert_allclose(list(fit.values.values()), values, rtol=1e-4)
    np.testing.assert_allclose(fit.rss, best, rtol=1e-6)
    for place, name in enumerate(fit.values):
        assert fit.identified[name]
        for end in fit.intervals[name]:
            rise = least(model, J, 0.01 * truth, list(fit.values.values()), (place, end))[0] - best
            # the rise is twice as far off as the end, which is found to a thousandth of its distance
            np.testing.assert_allclose(rise, stats.chi2.ppf(0.95, 1), rtol=2e-3)
    np.testing.assert_allclose(fit.predict(TIMES), CREEP[model](*values), rtol=1e-3)
    np.testing.assert_allclose(fit.material.creep(TIMES), fit.predict(TIMES), rtol=1e-5)
    assert not fit.refused and "the law approximated by a Prony series" in fit.summary()


def test_a_band_of_a_springpot_is_that_of_linear_least_squares():
    """log J = alpha log t - log V - log Gamma(1 + alpha), nearly linear in what is fitted."""
    truth, J = noisy("Springpot")
    fit = fitting.fit_creep(fitting.CreepData(t=TIMES, J=J), "Springpot", sigma=0.01 * truth)
    row = lambda t: np.column_stack(
        [-np.ones(t.size), np.log(t) - special.digamma(1.0 + fit.values["alpha"])]
    )
    C = np.linalg.inv(row(TIMES).T @ row(TIMES)) * 0.01**2
    x = row(np.array([0.1, 30.0, 1e5]))
    low, high = fit.band([0.1, 30.0, 1e5])
    np.testing.assert_allclose(np.log(high / low), 2 * 1.959964 * np.sqrt(np.sum(x @ C * x, 1)), rtol=2e-2)


@pytest.mark.slow
def test_a_recovery_is_the_superposition_of_two_steps():
    """Strain of a load that steps on at 0 s and off at 400 s, a sample at either step."""
    t = np.linspace(0.0, 1000.0, 101)
    since = lambda start: np.where(t > start, power(1500.0, 0.4, np.clip(t - start, 1e-30, None)), 0.0)
    data = fitting.CreepData(
        t=t, strain=50.0 * (since(0.0) - since(400.0)), stress=([0, 400, 400], [50, 50, 0.0])
    )
    fit = fitting.fit_creep(data, jc.Springpot, weights="absolute")
    np.testing.assert_allclose(list(fit.values.values()), [1500.0, 0.4], rtol=1e-6)


@pytest.mark.slow
def test_a_power_law_is_told_from_a_burgers_material():
    """The fewest parameters that describe the data come first, and what does not describe them is refused."""
    _, J = noisy("Springpot")
    table = fitting.compare(fitting.CreepData(t=TIMES, J=J), ["Burgers", "Springpot"], weights="relative")
    assert [fit.model.__name__ for fit in table.fits] == ["Springpot", "Burgers"]
    assert not table.fits[0].refused and table.fits[1].refused


def test_what_is_held_stays_and_what_cannot_be_is_refused():
    _, J = noisy("Springpot")
    data = fitting.CreepData(t=TIMES, J=J)
    fit = fitting.fit_creep(data, "Springpot", weights="relative", fixed={"alpha": 0.35})
    assert fit.values["alpha"] == pytest.approx(0.35, rel=1e-12) and fit.fixed == ("alpha",)
    share = power(1.0, 0.35) / J  # sum (share/V - 1)^2 is least at V = sum share^2/sum share
    np.testing.assert_allclose(fit.values["V"], np.sum(share**2) / np.sum(share), rtol=1e-6)
    with pytest.raises(ValueError, match=r"alpha: expected between 0 and 1, .* got 2"):
        fitting.fit_creep(data, "Springpot", fixed={"alpha": 2.0})
    with pytest.raises(ValueError, match=r"model: expected one of .*FractionalMaxwell.*, got 'Nutting'"):
        fitting.fit_creep(data, "Nutting")


def test_a_dashpot_is_a_springpot_of_order_one():
    """V is its viscosity, with the interval of what is known of alpha, which has no limit above."""
    fit = fitting.fit_creep(fitting.CreepData(t=TIMES, J=1e-3 * TIMES), "Springpot", sigma=2e-4 * TIMES)
    np.testing.assert_allclose([fit.values["V"], fit.values["alpha"]], [1e3, 1.0], rtol=1e-9)
    assert fit.intervals["alpha"][1] == 1.0 and not fit.identified["alpha"]
    low, high = fit.intervals["V"]
    assert 900.0 < low < 1e3 < high < 1100.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "classical", "J"),
    [
        ("FractionalMaxwell", "Maxwell", 1 / 800 + TIMES / 1500),
        pytest.param(
            "FractionalKelvinVoigt", "KelvinVoigt", -np.expm1(-TIMES / 20) / 500, marks=pytest.mark.long
        ),
    ],
)
def test_a_classical_material_is_described_no_worse_by_its_fractional_law(law, classical, J):
    """It is the law at alpha = 1, so that the least squares of the law are not above those of the material."""
    noisy = J * (1.0 + 0.01 * np.random.default_rng(3).standard_normal(J.size))
    data = fitting.CreepData(t=TIMES, J=noisy)
    wide, narrow = (fitting.fit_creep(data, model, sigma=0.01 * J) for model in (law, classical))
    assert wide.rss <= narrow.rss * (1.0 + 1e-9)
    low, high = wide.intervals["alpha"]
    assert low < 1.0 and high == 1.0 and wide.values["alpha"] > 0.99
    off = np.abs(np.asarray(wide.material.creep(TIMES)) / wide.predict(TIMES) - 1.0)
    assert off.max() < 0.02  # the material handed out is a cut, or the classical one


@pytest.mark.slow
def test_a_ramp_of_a_maxwell_material_is_described_by_its_fractional_law():
    """Under a ramp and a hold: int J(t - s) dstress of a Maxwell material, in closed form."""
    t = np.linspace(0.5, 100.0, 60)
    stress = np.minimum(t, 20.0)
    lapse = np.where(t < 20.0, t**2 / 2.0, 200.0 + 20.0 * (t - 20.0))
    data = fitting.CreepData(
        t=t, strain=stress / 800 + lapse / 1500, stress=([0.0, 20.0, 100.0], [0.0, 20.0, 20.0])
    )
    fit = fitting.fit_creep(data, "FractionalMaxwell", weights="relative")
    np.testing.assert_allclose(list(fit.values.values()), [800.0, 1500.0, 1.0], rtol=1e-5)


@pytest.mark.slow
def test_a_law_from_the_command_line(tmp_path):
    _, J = noisy("Springpot")
    np.savetxt(
        tmp_path / "c.csv", np.column_stack([TIMES, J]), delimiter=",", header="t [s],J [1/Pa]", comments=""
    )
    words = ["fit", "creep", str(tmp_path / "c.csv"), "-o", str(tmp_path / "out"), "--model", "Springpot"]
    assert main(words) == 0
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    # the noise of 1 % leaves less than 5 %
    assert found["parameters"]["V_Pa_s^alpha"] == pytest.approx(1500.0, rel=0.05)
    assert found["parameters"]["alpha"] == pytest.approx(0.4, rel=0.05)
