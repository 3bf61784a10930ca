"""Cones and flat punches: Sneddon's formulas with the creep and relaxation of Burgers, and Ting's for a cone let go."""

import numpy as np
import pytest
from scipy import integrate, optimize

import fitting
import jaxcontact as jc

TRUTH = {"G1": 2e6, "G2": 1e6, "eta1": 3e8, "eta2": 4e7}
NU, ANGLE, R = 0.4, np.radians(70.3), 1e-4
T = np.concatenate([[0.0], np.geomspace(0.5, 900.0, 60)])
PROBES = {  # P = size depth^power G/(1 - nu) of an elastic half-space
    "cone": (jc.Cone(ANGLE), 2, 4 * np.tan(ANGLE) / np.pi),
    "punch": (jc.FlatPunch(R), 1, 4 * R),
}


def creep(t):
    return 1 / TRUTH["G1"] - np.expm1(-TRUTH["G2"] / TRUTH["eta2"] * t) / TRUTH["G2"] + t / TRUTH["eta1"]


def relaxation(t):
    """G(t) by the two roots of its characteristic polynomial."""
    G1, G2, eta1, eta2 = TRUTH.values()
    rates = -np.roots([eta2 / G1, G2 / G1 + eta2 / eta1 + 1.0, G2 / eta1])
    slope = lambda s: 1 / G1 + G2 / (G2 + eta2 * s) ** 2
    return sum(np.exp(-r * np.asarray(t)) / slope(-r) for r in rates)


def fit(load, depth, indenter, t=T, **options):
    data = fitting.IndentationData(t=t, load=load, depth=depth)
    return fitting.fit_indentation(data, "Burgers", indenter=indenter, nu=NU, **options)


def agree(found, rtol=1e-6):
    for name, value in TRUTH.items():
        assert found.values[name] == pytest.approx(value, rel=rtol), name


@pytest.mark.slow
@pytest.mark.parametrize("name", PROBES)
def test_a_held_load_creeps_and_a_held_depth_relaxes(name):
    probe, power, size = PROBES[name]
    agree(fit(np.full(T.size, 1e-3), (1e-3 * (1 - NU) * creep(T) / size) ** (1 / power), probe))
    depth = np.full(T.size, 1e-6)
    found = fit(size * depth**power * relaxation(T) / (1 - NU), depth, probe, control="depth")
    agree(found)
    assert found.to_dict()["indenter_half_angle_rad" if name == "cone" else "indenter_radius_m"] > 0


@pytest.mark.slow
def test_a_punch_that_is_drawn_back_follows_the_linear_integral():
    """P = 4 R/(1 - nu) int G(t - s) d(depth): its contact stays as wide, so nothing of Ting's is needed."""
    t = np.linspace(0.0, 100.0, 101)
    depth = 1e-6 * np.minimum(t, 100.0 - t / 2) / 50.0
    turn = 100.0 / 1.5
    rise = lambda now: integrate.quad(lambda s: relaxation(now - s), 0.0, min(now, turn))[0] / 50.0
    fall = lambda now: (
        integrate.quad(lambda s: relaxation(now - s), turn, now)[0] / 100.0 if now > turn else 0.0
    )
    knots = np.union1d(t, [turn])
    load = 4 * R / (1 - NU) * 1e-6 * np.array([rise(now) - fall(now) for now in knots])
    depth = np.interp(knots, [0.0, turn, 100.0], [0.0, 1e-6 * turn / 50.0, 1e-6])
    agree(fit(load, depth, jc.FlatPunch(R), t=knots, control="depth"), rtol=1e-5)


@pytest.mark.slow
def test_a_cone_that_is_drawn_back_follows_ting():
    """P = size/(1 - nu) int_0^t1 G(t - s) d(depth^2), int_t1^t G(t - s) d(depth) = 0, after the turn at 60 s."""
    turn, v = 60.0, 1e-8
    size, t = PROBES["cone"][2], np.linspace(0.0, 80.0, 401)
    G = lambda now, s: relaxation(now - s)

    def load(now):
        last = now
        if now > turn:
            fall = integrate.quad(lambda s: G(now, s), turn, now)[0]
            left = lambda t1: integrate.quad(lambda s: G(now, s), t1, turn)[0] - fall
            last = optimize.brentq(left, 0.0, turn) if left(0.0) > 0 else 0.0
        return size / (1 - NU) * integrate.quad(lambda s: G(now, s) * 2 * v**2 * s, 0.0, last)[0]

    depth = v * np.minimum(t, 2 * turn - t)
    found = fit(np.array([load(now) for now in t]), depth, PROBES["cone"][0], t=t, control="depth")
    agree(found, rtol=1e-2)  # power and depth linear between samples: second order in the step
    assert any("Ting" in note for note in found.notes)


def test_a_punch_on_a_film_is_refused():
    with pytest.raises(ValueError, match="expected a Sphere or a Cone on a film, got FlatPunch"):
        fit(np.ones(T.size), 1e-6 * (1 + T), jc.FlatPunch(R), layer=1e-6, substrate=jc.Elastic(1e9))


def pressed_ball(deepest: float) -> tuple[np.ndarray, np.ndarray]:
    """Depth and load of a rigid sphere, no paraboloid, of R = 1 m on a half-space of E = 1 Pa, nu = 0.5.

    Sneddon (1965), sec. 6: the profile 1 - (1 - r^2)^(1/2) by Abel's transform.
    """
    a = np.linspace(0.0, deepest, 400)
    log = np.log((1.0 + a) / (1.0 - a))
    return a / 2.0 * log, ((a**2 + 1.0) / 2.0 * log - a) / 0.75


@pytest.mark.slow
@pytest.mark.parametrize(("deepest", "deep"), [(0.7, True), (0.3, False)])
def test_a_ball_that_is_no_paraboloid_has_a_note_with_the_error_of_the_modulus(deepest, deep):
    depth, load = pressed_ball(deepest)
    t = np.linspace(0.0, 1.0, 400)
    curve = fitting.IndentationData(t[1:], load[1:], depth[1:])
    baseline = np.linspace(-0.3, 0.0, 100)
    whole = fitting.IndentationData(
        np.linspace(0.0, 1.0, 499), np.append(0.0 * baseline, load[1:]), np.append(baseline, depth[1:])
    )
    ball = jc.Sphere(1.0)
    force = fitting.fit_force(whole, indenter=ball)
    both = (force, fitting.fit_indentation(curve, "Elastic", indenter=ball, nu=0.5, control="depth"))
    for fit in both:
        off = 1.0 - 3.0 * fit.values["G"]
        told = [note for note in fit.notes if "radius of the ball" in note]
        assert len(told) == deep
        if deep:
            assert 0.03 < off < 0.07 and "up to 6.1 % too low" in told[0]  # 1 - 0.607/10 at the largest depth
        else:
            assert off < 0.011
