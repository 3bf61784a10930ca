"""Indentation of a film through the contact solver, against the axisymmetric march by Abel transforms."""

import functools
import warnings

import numpy as np
import pytest

import fitting
import jaxcontact as jc
from jaxcontact.reference import abel

TRUTH = {"G1": 0.75e9, "G2": 13.89e6, "eta1": 3148.6e9, "eta2": 120.9e9}
STEEL = jc.Elastic.from_young(210e9)
BALL = jc.Sphere(radius=9.525e-3, material=STEEL)
# h/a of about 0.5 and of 1e-3 at the start of the hold: thickness [m], load [N], duration [s]
CASES = {"h/a 0.5": (50e-6, 0.2, 20000.0), "h/a 0.001": (150e-9, 60.0, 20000.0)}


def modulus(s):
    """g(s) = 1/(s J(s)) of the film."""
    G1, G2, eta1, eta2 = TRUTH.values()
    return 1 / (1 / G1 + 1 / (G2 + eta2 * s) + 1 / (eta1 * s))


@functools.cache
def approach(name, steps=100):
    """Of the oracle, at ``steps`` equal steps and the start."""
    thickness, load, duration = CASES[name]
    ball = float(BALL.compliance())
    body = abel.Layered(TRUTH["G1"], 0.3, thickness, float(STEEL.G), 0.3, ball)
    march = abel.march_step_load(load, duration, steps, body, modulus, float(BALL.radius))
    return np.array([contact.approach for contact in march])


def hold(name, noise, steps=100, seed=0):
    depth = approach(name, steps) * (1 + noise * np.random.default_rng(seed).standard_normal(steps + 1))
    _, load, duration = CASES[name]
    t = np.linspace(0.0, duration, steps + 1)
    return fitting.IndentationData(t=t, load=np.full(t.size, load), depth=depth)


def fit(name, data, **options):
    # the film is strained beyond 0.2 in the thin case; the oracle is as linear as the solver
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return fitting.fit_indentation(
            data, indenter=BALL, nu=0.3, layer=CASES[name][0], substrate=STEEL, **options
        )


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name == "h/a 0.5" else pytest.mark.long) for name in CASES],
)
def test_noisy_hold_is_fitted_within_its_intervals(name):
    found = fit(name, hold(name, 0.005), weights="relative")
    print(f"\n{name}\n{found.summary()}")
    for key, value in TRUTH.items():
        low, high = found.intervals[key]
        assert low <= value <= high, key
    assert found.identified["G1"] and found.identified["eta2"] and not found.misfit
    assert "conditional on thickness" in found.summary() and found.runs[0] > 0
    assert max(found.film.bias.values()) < 0.2
    # the oracle itself, without noise: what is off is the bias of discretisation
    exact = fit(name, hold(name, 0.0), sigma=0.005 * approach(name))
    for key, value in TRUTH.items():
        bias = abs(np.log(exact.values[key] / value)) / found.sd_log[key]
        print(f"{key}: bias over standard error {bias:.3f}, of its own estimate {found.film.bias[key]:.3f}")
        assert bias < 0.2, key


@pytest.mark.slow
def test_a_film_between_known_layers():
    """The oracle's film in three parts, of which the middle one is sought."""
    thickness, sigma = CASES["h/a 0.5"][0], 0.005 * approach("h/a 0.5")
    known = jc.Layer(jc.Burgers(**TRUTH, nu=0.3), thickness / 4)
    layers, fixed = [known, thickness / 2, known], {"G2": TRUTH["G2"], "eta1": TRUTH["eta1"]}
    found = fitting.fit_indentation(
        hold("h/a 0.5", 0.0), indenter=BALL, nu=0.3, layers=layers, substrate=STEEL, sigma=sigma, fixed=fixed
    )
    for key in ("G1", "eta2"):
        assert abs(np.log(found.values[key] / TRUTH[key])) < 0.2 * found.sd_log[key], key


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"layer": -1.0}, "layer"),
        ({"layer": 1e-6}, "substrate"),
        ({"substrate": STEEL}, "layer"),
        ({"layer": 1e-6, "substrate": STEEL, "rise": 1.0}, "rise"),
        ({"layer": 1e-6, "substrate": 210e9}, "substrate: expected a material .*, got float"),
        ({"layer": 1e-6, "layers": [1e-6], "substrate": STEEL}, "layers: expected it or layer"),
        ({"layers": [1e-6, 2e-6], "substrate": STEEL}, "layers: expected one thickness"),
        ({"layers": [1e-6, jc.Layer(STEEL, -1e-6)], "substrate": STEEL}, "thickness"),
    ],
)
def test_bad_films_are_named(options, word):
    t = np.linspace(0.0, 10.0, 11)
    data = fitting.IndentationData(t=t, load=np.ones(11), depth=1e-6 * (1 + t))
    with pytest.raises(ValueError, match=word):
        fitting.fit_indentation(data, indenter=BALL, nu=0.3, **options)
