"""A ball that sticks: Johnson, Kendall and Roberts by root finding, a standard linear solid by its differential equation,
and forces of finite range in place of all of it. None shares code with the fit."""

import json

import jax
import numpy as np
import pytest
from scipy import integrate, optimize, special

import fitting
import jaxcontact as jc
from fitting.models import adhesive_contact
from jaxcontact.__main__ import main

R, NU, W = 5e-6, 0.5, 1e-4  # a bead on a gel
BEAD = jc.Sphere(radius=R)
G, G_LATE, TAU = 20e3, 5e3, 2.0  # G(t) = G_LATE + (G - G_LATE) exp(-t/TAU)
TRUTH = {"G1": G, "G2": G * G_LATE / (G - G_LATE), "eta2": TAU * G**2 / (G - G_LATE)}
PULL_OFF = -1.5 * np.pi * W * R
T = np.concatenate([[0.0], np.geomspace(0.02, 40.0, 90)])


def modulus(shear):
    return 2 * shear / (1 - NU)


def jkr_depth(a, shear=G, work=W):
    return a**2 / R - np.sqrt(2 * np.pi * a * work / modulus(shear))


def jkr_radius(load, shear=G, work=W):
    """The stable one: a^3 = (R/K)(P + 3 pi w R + sqrt(6 pi w R P + (3 pi w R)^2)), K = 4/3 E*."""
    three = 3 * np.pi * work * R
    return (R / (4 / 3 * modulus(shear)) * (load + three + np.sqrt(2 * three * load + three**2))) ** (1 / 3)


def radius_at(depth, shear=G, work=W):
    """The stable radius at a depth >= 0 by bisection; jkr_depth is least below ``least``."""
    least = (2 * np.pi * work * R**2 / modulus(shear)) ** (1 / 3) / 2
    return optimize.brentq(lambda a: jkr_depth(a, shear, work) - depth, least, R, xtol=1e-18)


def held(load):
    """a(t) of the solid under a load P(t): its equation P + TAU P' = E_late (F + TAU E/E_late F') in
    F = 2 (a depth - a^3/(3 R)) (for a unit modulus), an elastic JKR edge of modulus G."""
    E, late = modulus(G), modulus(G_LATE)
    slope = lambda t, F: (load(t) + TAU * (load(t + 1e-6) - load(t - 1e-6)) / 2e-6 - late * F) / (TAU * E)
    run = integrate.solve_ivp(slope, (0.0, T[-1]), [load(0.0) / E], t_eval=T, rtol=1e-11, atol=1e-40)
    off = lambda a, F: 2 * (a * jkr_depth(a) - a**3 / (3 * R)) - F
    turn = jkr_radius(PULL_OFF)  # where F is least
    return np.array([optimize.brentq(off, turn, R, (F,), xtol=1e-18) for F in run.y[0]])


def fit(load, depth, t=T, model="StandardLinearSolid", work=W, **options):
    data = fitting.IndentationData(t=t, load=load, depth=depth)
    return fitting.fit_indentation(data, model, indenter=BEAD, nu=NU, adhesion=work, **options)


@pytest.mark.slow
def test_a_load_on_a_solid_that_hardly_creeps_is_jkr():
    """Loads from the jump into contact, also below zero, on a Maxwell fluid of very high viscosity."""
    load = np.linspace(0.9 * PULL_OFF, 20e-9, T.size)
    a = jkr_radius(load)
    found = fit(load, jkr_depth(a), T, "Maxwell", fixed={"eta": 1e20})
    np.testing.assert_allclose(found.values["G"], G, rtol=1e-9)
    assert found.kept.sum() == np.sum(jkr_depth(a) > 0)


def test_depths_of_a_solid_that_hardly_creeps_are_jkrs():
    depth = np.linspace(0.0, 4e-7, T.size)
    a = np.array([radius_at(d) for d in depth])
    load = 2 * modulus(G) * (a * depth - a**3 / (3 * R))
    np.testing.assert_allclose(load[0], -4 / 3 * np.pi * W * R, rtol=1e-9)  # at depth zero
    found = fit(load, depth, T, "Maxwell", control="depth", fixed={"eta": 1e20})
    np.testing.assert_allclose(found.values["G"], G, rtol=1e-9)


@pytest.mark.slow
def test_a_step_load_creeps_as_the_solids_equation_says():
    found = fit(np.full(T.size, 5e-9), jkr_depth(held(lambda t: 5e-9)))
    for name, value in TRUTH.items():
        np.testing.assert_allclose(found.values[name], value, rtol=1e-6, err_msg=name)
    assert found.verdict == "accepted" and not any("Tabor" in note for note in found.notes)
    assert found.slow_edge["G2"] > 1.2 * TRUTH["G2"]  # an edge that creeps pulls harder


@pytest.mark.slow
def test_a_held_depth_relaxes_as_the_modulus_and_begins_below_it():
    """At a depth that is held the edge that closes at once stands still: the load is that of JKR times G(t)/G."""
    a = radius_at(2e-7)
    load = 2 * (a * 2e-7 - a**3 / (3 * R)) * (modulus(G_LATE) + modulus(G - G_LATE) * np.exp(-T / TAU))
    found = fit(load, np.full(T.size, 2e-7), control="depth")
    for name, value in TRUTH.items():
        np.testing.assert_allclose(found.values[name], value, rtol=1e-6, err_msg=name)


@pytest.mark.slow
@pytest.mark.parametrize("control", ["load", "depth"])
def test_no_adhesion_is_the_limit_of_little(control):
    depth = (3 * (1 - NU) / (8 * np.sqrt(R)) * 5e-9 / G * (1 + T / 10)) ** (2 / 3)
    load = np.full(T.size, 5e-9)
    none = fit(load, depth, work=0.0, control=control)
    little = fit(load, depth, work=1e-30, control=control)
    for name, value in none.values.items():
        np.testing.assert_allclose(little.values[name], value, rtol=1e-6)
    np.testing.assert_allclose(little.fitted, none.fitted, rtol=1e-10)
    assert none.slow_edge == {} and none.to_dict()["slow_edge"] == {}


def test_noise_stays_within_the_intervals():
    depth = jkr_depth(held(lambda t: 5e-9 * (1 + t / 40)))
    noise = 5e-10 * np.random.default_rng(3).standard_normal(T.size)
    found = fit(5e-9 * (1 + T / 40), depth + noise)
    for name, value in TRUTH.items():
        low, high = found.intervals[name]
        assert low < value < high and high / low < 1.3, name


@pytest.mark.slow
def test_a_contact_point_is_found_beside_adhesion():
    load = 5e-9 * (1 + T / 40)
    found = fit(load, jkr_depth(held(lambda t: 5e-9 * (1 + t / 40))) + 3e-8, contact_point="fit")
    np.testing.assert_allclose(found.nuisances["contact_point"][0], 3e-8, rtol=1e-4)
    np.testing.assert_allclose(found.values["G2"], TRUTH["G2"], rtol=1e-4)


def test_a_contact_that_shrinks_is_refused():
    load = 5e-9 * (1 - 0.4 * T / T[-1])
    depth = (3 * (1 - NU) / (8 * np.sqrt(R)) * load / G) ** (2 / 3)
    found = fit(load, depth)
    assert found.verdict == "rejected" and any("the edge recedes" in reason for reason in found.refused)


@pytest.mark.parametrize(
    ("work", "modulus", "lives", "words"),
    [
        (1e-4, 8e4, 10.0, ()),
        (1e-4, 1e9, 1.0, ("Tabor's parameter is 0.0", "the edge may creep by a further")),
        (1e-4, 8e4, 1e6, ("the edge may creep by a further",)),
    ],
)
def test_what_jkr_leaves_out_is_said(work, modulus, lives, words):
    said = adhesive_contact.doubts(work, R, 1e-6, modulus, lives)
    assert len(said) == len(words) and all(word in note for word, note in zip(words, said, strict=True))
    assert "surface tension" in adhesive_contact.doubts(work, R, 3e-6, 8e4, 1.0)[-1]


@pytest.mark.parametrize("which", ["depth", "total"])
def test_the_slopes_are_those_of_central_differences(which):
    f, x = {"depth": (adhesive_contact.at_depth, 0.01), "total": (adhesive_contact.under_load, -0.01)}[which]
    x, neck, step = x + np.array([0.0, 0.1, 1.0]), np.array([0.3, 0.2, 0.7]), 1e-5
    by_first = jax.jvp(lambda x: f(x, neck)[0], (x,), (np.ones(3),))[1]
    by_neck = jax.jvp(lambda neck: f(x, neck)[0], (neck,), (np.ones(3),))[1]
    np.testing.assert_allclose(
        by_first, (f(x + step, neck)[0] - f(x - step, neck)[0]) / (2 * step), rtol=1e-6
    )
    np.testing.assert_allclose(by_neck, (f(x, neck + step)[0] - f(x, neck - step)[0]) / (2 * step), rtol=1e-6)


@pytest.mark.slow
def test_the_command_line(tmp_path):
    a = jkr_radius(5e-9)
    rows = "".join(f"{t}\t{5e-9}\t{jkr_depth(a) * (1 + 1e-4 * np.sin(37 * t)):.8g}\n" for t in T)
    (tmp_path / "bead.txt").write_text("Time (s)\tLoad (N)\tDepth (m)\n" + rows)
    flags = ["--model", "Maxwell", "--radius", str(R), "--nu", "0.5", "--adhesion", str(W)]
    assert main(["fit", "indentation", str(tmp_path / "bead.txt"), "-o", str(tmp_path / "out"), *flags]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["adhesion_J_per_m2"] == W and "G_Pa" in summary["slow_edge"]


def influence(edges):
    """Displacements at the middles of rings (n, n) of an axisymmetric half-space of E* = 1 per pressure on each:
    4/pi int s/(r + s) K ds, its logarithm at s = r taken exactly."""
    r, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    x, weight = np.polynomial.legendre.leggauss(6)
    s = (r[:, None] + half[:, None] * x)[None]
    own = r[:, None, None]
    smooth = s / (own + s) * special.ellipkm1(((own - s) / (own + s)) ** 2) + 0.5 * np.log(np.abs(own - s))
    whole = lambda y: y * np.log(np.abs(y)) - y
    log = whole(edges[None, 1:] - r[:, None]) - whole(edges[None, :-1] - r[:, None])
    return 4 / np.pi * ((smooth @ weight) * half - 0.5 * log), r


def cohesive_loads(depths, dt, late, tau, work, reach, n, width=1.35):
    """Loads (m,) of a ball of radius 1 at depths that follow each other after dt, on a solid whose creep for E* goes from 1
    to 1/late with the time tau. Surfaces a gap g apart pull by work/reach exp(-g/reach) and push where they overlap.
    Newton on the gap, from that of JKR."""
    edges = np.linspace(0.0, width, n + 1)
    A, r = influence(edges)
    decay, extra = np.exp(-dt / tau), 1 / late - 1.0
    mean = (1 - decay) * tau / dt  # the pressure is linear in a step
    peak = work / reach
    pull = lambda g: peak * np.exp(-np.maximum(g, 0.0) / reach)
    pressure = lambda g: np.where(g > 0, -pull(g), -peak * (1 + 50 * g / reach))
    slope = lambda g: np.where(g > 0, pull(g) / reach, -50 * peak / reach)
    a = optimize.brentq(
        lambda a: a**2 - np.sqrt(2 * np.pi * a * work) - depths[0], 0.5 * (2 * np.pi * work) ** (1 / 3), 2
    )
    out = np.maximum(r / a, 1.0)
    hertz = a**2 / np.pi * ((2 - out**2) * np.arcsin(1 / out) + np.sqrt(out**2 - 1))
    drawn = 2 / np.pi * (a**2 - depths[0]) * np.arcsin(1 / out)
    g = np.where(r < a, -0.02 * reach, r**2 / 2 - depths[0] + hertz - drawn)
    retarded, before, loads = np.zeros(n), None, []
    for depth in depths:
        first = before is None
        share = 0.0 if first else extra * (1 - mean)
        past = retarded if first else decay * retarded + extra * (mean - decay) * before
        base = r**2 / 2 - depth + A @ past
        for k in range(300):
            left = g - base - A @ ((1 + share) * pressure(g))
            if np.max(np.abs(left)) < 1e-8:
                break
            step = -np.linalg.solve(np.eye(n) - A * ((1 + share) * slope(g)), left)
            g = g + step * min(1.0, (0.5 if k < 60 else 0.1) * reach / np.max(np.abs(step[g < 5 * reach])))
        assert np.max(np.abs(left)) < 1e-8
        before = pressure(g)
        retarded = past + share * before
        loads.append(np.pi * np.diff(edges**2) @ before)
    return np.array(loads)


@pytest.mark.long
def test_the_edge_that_closes_at_once_is_what_forces_of_short_range_do():
    """Neither JKR nor a rule for the edge is in the oracle: pressures follow from gaps, the solid remembers them."""
    work, late, tau, v = 0.05, 0.4, 1.0, 0.5
    t = np.linspace(0.0, 1.0, 51)

    def theory(edge, late):
        times = np.linspace(0.0, 1.0, 4001)
        creep = 1 + edge * (1 / late - 1) * -np.expm1(-times / tau)
        least = 0.5 * (2 * np.pi * work * creep) ** (1 / 3)
        of = lambda a, d, J: a**2 - np.sqrt(2 * np.pi * a * work * J) - d
        a = np.array(
            [optimize.brentq(of, low, 2, (v * s, J)) for low, s, J in zip(least, times, creep, strict=True)]
        )
        F, middle = 2 * (a * v * times - a**3 / 3), 0.5 * (times[1:] + times[:-1])
        G = lambda s: late + (1 - late) * np.exp(-s / (tau * late))
        return np.array(
            [F[0] * G(s) + np.sum((G(s - middle) * np.diff(F))[times[1:] <= s + 1e-9]) for s in t]
        )

    off = lambda loads, edge, late: np.sqrt(np.mean((loads - theory(edge, late)) ** 2))
    errors = []
    for tabor, n in ((3.0, 400), (5.0, 700)):
        reach = work ** (2 / 3) / tabor
        elastic = cohesive_loads(v * t, t[1], 1.0, tau, work, reach, n)
        creeping = cohesive_loads(v * t, t[1], late, tau, work, reach, n)
        errors.append((off(elastic, 0.0, 1.0), off(creeping, 0.0, late), off(creeping, 1.0, late)))
        print(
            f"\nTabor {tabor:g}: elastic off by {errors[-1][0]:.4f}, at once {errors[-1][1]:.4f}, slow {errors[-1][2]:.4f}"
        )
    assert errors[1][0] < errors[0][0] and errors[1][1] < 0.75 * errors[0][1]
    assert errors[1][1] < 0.25 * errors[1][2]


RISING = {"load": np.linspace(0.0, 5e-9, T.size), "depth": np.linspace(1e-8, 2e-7, T.size)}
AIR = {
    "load": np.append(np.zeros(30), np.linspace(PULL_OFF, 5e-9, 61)),
    "depth": np.linspace(-1e-7, 2e-7, 91),
}


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"work": -1.0}, r"adhesion: expected a work of adhesion >= 0 J/m2, got -1"),
        ({"work": "fit"}, r"model: expected Elastic with a fit of the work of adhesion, got 'Maxwell'"),
        ({"indenter": jc.Cone.berkovich()}, r"adhesion: expected a Sphere, got Cone"),
        ({"model": "KelvinVoigt"}, r"adhesion: a Kelvin-Voigt solid has J\(0\) = 0"),
        ({"load": -RISING["load"]}, r"adhesion: expected a load above zero, got"),
        (
            {"load": RISING["load"] + 1.1 * PULL_OFF},
            r"no load below the pull-off of 0.0001 J/m2, -2.356e-09 N, got -2.592e-09 N",
        ),
        (
            {**AIR, "control": "depth"},
            r"expected a curve from the jump into contact on, got 30 points at a depth below zero and a load that"
            r" falls by 2.36e-09 N before it rises",
        ),
        ({"depth": RISING["depth"][::-1], "control": "depth"}, r"got a depth that falls by 1.9e-07 m"),
        (
            {"layer": 1e-6, "substrate": jc.Elastic(1e9)},
            r"adhesion: expected none with a layer, got 0.0001 J/m2",
        ),
    ],
)
def test_what_the_theory_is_not_for_is_refused(changed, message):
    given = {"work": W, "model": "Maxwell", "indenter": BEAD, **RISING} | changed
    data = fitting.IndentationData(t=T, load=given.pop("load"), depth=given.pop("depth"))
    with pytest.raises(ValueError, match=message):
        fitting.fit_indentation(data, given.pop("model"), nu=NU, adhesion=given.pop("work"), **given)
