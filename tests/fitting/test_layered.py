"""Indentation of a film through the contact solver, against the axisymmetric march by Abel transforms."""

import functools
import warnings

import numpy as np
import pytest
from bodies import BALL, STEEL
from tolerances import DENSE

import fitting
import jaxcontact as jc
from fitting.search import press
from jaxcontact.reference import abel, lee_radok

TRUTH = {"G1": 0.75e9, "G2": 13.89e6, "eta1": 3148.6e9, "eta2": 120.9e9}
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


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
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


@pytest.mark.long
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


@pytest.mark.long
@pytest.mark.parametrize("control", ["load", "depth"])
def test_two_thousand_samples_of_a_ramp_and_a_hold(control):
    """On a film far thicker than the contact is wide, where Lee and Radok's integral is the truth. The ramp ends
    between the times that the solver would march through if they were chosen without a look at the load."""
    truth = {"G1": 3000.0, "G2": 3000.0, "eta2": 9000.0}
    creep = lambda s: 1 / truth["G1"] + -np.expm1(-s * truth["G2"] / truth["eta2"]) / truth["G2"]
    t = np.linspace(0.0, 21.0, 2101)
    course = [0.0, 1.03, 21.0], [0.0, 4e-7, 4e-7]
    depth = lee_radok.history_radius(t, creep, *course, 25e-6, 0.45, 0.0) ** 2 / 25e-6
    data = fitting.IndentationData(t=t, load=np.interp(t, *course), depth=depth)
    found = fitting.fit_indentation(
        data, "StandardLinearSolid", indenter=jc.Sphere(radius=25e-6), nu=0.45, layer=0.1, substrate=STEEL,
        control=control, sigma=1e-3 * (data.load if control == "depth" else depth).max(),
    )  # fmt: skip
    print(f"\n{found.summary()}")
    for key, value in truth.items():
        low, high = found.intervals[key]
        assert low <= value <= high, key  # though the error of the grid is more than that of the data
        assert abs(found.values[key] / value - 1) < DENSE, key


def test_a_drive_of_straight_lines_is_marched_through_as_it_is():
    """Its corner is a time of the march, and the noise of the samples is averaged between two of them."""
    t = np.linspace(0.0, 1.0, 2001)
    exact = np.interp(t, [0.0, 0.0525, 1.0], [0.0, 1.0, 1.0])
    noise = 0.01 * np.random.default_rng(0).standard_normal(t.size)
    knots = press.march_times(t, exact)
    assert np.abs(knots - 0.0525).min() < 1e-12 and knots.size <= press.MARCHED
    np.testing.assert_allclose(press.polygon(t, exact, knots), np.interp(knots, t, exact), atol=1e-12)
    knots = press.march_times(t, exact + noise)
    assert np.abs(knots - 0.0525).min() < 0.005
    late = knots > 0.3
    off = press.polygon(t, exact + noise, knots)[late] - 1.0
    samples = np.diff(np.append(knots, 1.0))[late].mean() * 2000
    # least squares by straight lines: sqrt(3) of the variance over the samples in an interval, where all are equal
    assert off.std() < 1.5 * 3**0.25 * 0.01 / np.sqrt(samples)
    assert press.turns(t, noise / 0.1) == []  # a held drive, and nothing but noise, turns nowhere


@pytest.mark.long
def test_a_film_pressed_from_first_contact_on():
    """An elastic film under a ball up to chi = sqrt(R d)/h = 1.1, 0.2 % of noise, against solutions by Abel transforms at
    each load: its load is steeper than Hertz's, which is no late contact, and few cells are in its first contacts."""
    R, h, G, nu, n = 5e-6, 1e-6, 2e4, 0.45, 30
    body = abel.Layered(G, nu, h, 1e9, 0.3, 0.0)
    radii = np.linspace(0.05, 1.0, n) * 1.5e-6
    contacts = [abel.solve_radius(a, body, R) for a in radii]
    load, exact = (np.array([0.0, *(getattr(one, key) for one in contacts)]) for key in ("load", "approach"))
    assert 1.0 < np.sqrt(R * exact[-1]) / h < 1.2
    depth = exact + 0.002 * exact[-1] * np.random.default_rng(3).standard_normal(n + 1)
    data = fitting.IndentationData(t=np.arange(n + 1.0), load=load, depth=depth)
    found = fitting.fit_indentation(
        data, "Elastic", indenter=jc.Sphere(radius=R), nu=nu, layer=h, substrate=jc.Elastic(1e9, 0.3), grid=20
    )
    low, high = found.intervals["G"]
    assert low <= G <= high and found.values["G"] == pytest.approx(G, rel=0.01) and not found.refused
    left = np.sum(~found.kept & (data.load > 0.0) & (data.depth > 0.0))
    assert found.film.grid.shape == (20, 20) and 0 < left < n / 3
    assert f"{left} points not fitted, at which the contact is fewer than 4 cells across" in found.notes


@pytest.mark.parametrize("grid", [128.5, True, 8, "64", jc.Grid((32, 16), (1e-6, 1e-6))])
def test_a_grid_that_is_none_is_named(grid):
    t = np.linspace(0.0, 10.0, 11)
    data = fitting.IndentationData(t=t, load=np.ones(11), depth=1e-6 * (1 + t))
    with pytest.raises(ValueError, match="grid: expected a"):
        fitting.fit_indentation(data, indenter=BALL, nu=0.3, layer=1e-6, substrate=STEEL, grid=grid)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"layer": -1.0}, "layer"),
        ({"layer": 1e-6}, "substrate"),
        ({"substrate": STEEL}, "layer"),
        ({"layer": 1e-6, "substrate": STEEL, "rise": 1.0}, "rise"),
        ({"layer": 1e-6, "substrate": 210e9}, "substrate: expected a material .*, got float"),
        (
            {"layer": 1e-6, "layers": [1e-6], "substrate": STEEL},
            "layers: expected exactly one of layers and layer",
        ),
        ({"layers": [1e-6, 2e-6], "substrate": STEEL}, "layers: expected one thickness"),
        ({"layers": [1e-6, jc.Layer(STEEL, -1e-6)], "substrate": STEEL}, "thickness"),
    ],
)
def test_bad_films_are_named(options, word):
    t = np.linspace(0.0, 10.0, 11)
    data = fitting.IndentationData(t=t, load=np.ones(11), depth=1e-6 * (1 + t))
    with pytest.raises(ValueError, match=word):
        fitting.fit_indentation(data, indenter=BALL, nu=0.3, **options)


@pytest.mark.long
@pytest.mark.parametrize("share", [0.4, 0.1])
def test_a_film_that_is_strained_far_has_a_note(share):
    """A film on a base that does not yield is strained by its indentation over its thickness."""
    ball, h = jc.Sphere(1e-4), 1e-5
    depth = h * share * np.linspace(0.2, 1.0, 12)
    factor = np.asarray(fitting.thin_layer_factor(ball, depth, h, 0.3))
    load = 8.0 / 3.0 * 1e6 / 0.7 * np.sqrt(1e-4) * depth**1.5 * factor
    data = fitting.IndentationData(np.arange(12.0), load, depth)
    given = {"indenter": ball, "nu": 0.3, "layer": h, "substrate": STEEL, "control": "depth", "grid": 24}
    found = fitting.fit_indentation(data, "Elastic", **given)
    assert found.values["G"] == pytest.approx(1e6, rel=0.02)
    told = [note for note in found.notes if "strain of the top layer" in note]
    assert len(told) == (share > 0.2)
    assert not told or "reaches 0.4:" in told[0]
