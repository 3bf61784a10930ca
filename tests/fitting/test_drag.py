"""Viscous drag on a cantilever in liquid: curves from the equation of motion of the lever, integrated by scipy."""

import dataclasses
import functools
import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import fitting
import jaxcontact as jc
from fitting.data.contact import find_drag
from jaxcontact.__main__ import main
from tests.support.force_curves import UNITS, force_curve

E, RADIUS, SPRING, DRAG, SPEED = 2e4, 2.5e-6, 0.03, 5e-6, 5e-5  # Pa, m, N/m, N s/m, m/s
BALL, NOISE = jc.Sphere(RADIUS), 10e-12


@functools.cache
def ramp(drag=DRAG, n=400, start=3e-6, top=4e-9):
    """(t, load, depth) of a lever whose base approaches and retracts at a constant speed: the deflection times the spring
    constant is the force of Hertz plus the drag at the velocity of the tip."""
    stiff = 4.0 / 3.0 * E / 0.75 * np.sqrt(RADIUS)
    high = (top / stiff) ** (2.0 / 3.0) + top / SPRING
    turn = (start + high) / SPEED
    base = lambda t: np.where(t < turn, SPEED * t - start, high - SPEED * (t - turn))
    moving = lambda t, d: (SPRING * (base(t) - d) - stiff * np.maximum(d, 0.0) ** 1.5) / drag
    t = np.linspace(0.0, 2.0 * turn, 2 * n)
    begin = [-start - drag * SPEED / SPRING]
    d = solve_ivp(moving, (0.0, t[-1]), begin, "LSODA", t, rtol=1e-8, atol=1e-15, max_step=turn / 100).y[0]
    return t, SPRING * (base(t) - d), d


def curve(seed=0, shift=0.0, flip=1.0, **given):
    """The curve with an error of the deflection; shift: of the load in the retraction."""
    t, load, depth = ramp(**given)
    error = NOISE * np.random.default_rng(seed).standard_normal(t.size)
    load = load + error + np.where(t < 0.5 * t[-1], 0.0, shift)
    return fitting.IndentationData(t=t, load=flip * load, depth=flip * (depth - error / SPRING))


@pytest.mark.slow
@pytest.mark.parametrize("flip", [1.0, -1.0], ids=["inwards", "outwards"])
def test_the_drag_and_the_modulus_are_recovered(flip):
    """A tip that slows down in contact loses its drag, by which the modulus would be 2 % too large."""
    plain = fitting.fit_force(curve(flip=flip), indenter=BALL)
    assert plain.youngs_modulus[1] > E and any('drag="fit" subtracts it' in note for note in plain.notes)
    fit = fitting.fit_force(curve(flip=flip), indenter=BALL, drag="fit")
    assert not fit.refused and "drag = " in fit.summary()
    for (_, low, high), true in ((fit.youngs_modulus, E), (fit.nuisances["drag"], DRAG)):
        assert low < true < high < 1.1 * low
    given = fitting.fit_force(curve(flip=flip), indenter=BALL, drag=DRAG)
    assert given.youngs_modulus[0] == pytest.approx(fit.youngs_modulus[0], rel=2e-3)
    assert "drag_N_s_per_m" in json.loads(fit.to_json())["nuisances"]


@pytest.mark.slow
def test_the_tension_of_a_tip_that_sticks_is_no_drag():
    """A constant force of 5 % of the unit of load beside JKR's curve, which parts below the depth of the first contact."""
    data = force_curve(None, n=400)
    speed = np.ptp(data.depth) / np.ptp(data.t[:400])
    force = 0.05 * UNITS.load * np.where(data.segments == "approach", 1.0, -1.0)
    found = find_drag(dataclasses.replace(data, load=data.load + force))
    assert found.coefficient == pytest.approx(force[0] / speed, abs=3.0 * found.sd)
    assert found.sd < 0.05 * force[0] / speed
    fit = fitting.fit_force(data, indenter=jc.Sphere(5e-6))
    assert not any("drag" in note for note in fit.notes)


def test_the_error_of_the_drag_is_in_the_interval():
    """A retraction whose noise is fifty times larger leaves the fit of the approach as it is."""
    data = curve()
    more = 50.0 * NOISE * np.random.default_rng(1).standard_normal(data.t.size)
    loud = fitting.IndentationData(
        data.t, data.load + np.where(data.t < 0.5 * data.t[-1], 0, more), data.depth
    )
    fit = fitting.fit_force(loud, indenter=BALL, drag="fit")
    b, low, high = fit.nuisances["drag"]
    assert high - low > 0.2 * b
    known = fitting.fit_force(loud, indenter=BALL, drag=b)
    assert known.youngs_modulus[0] == pytest.approx(fit.youngs_modulus[0])
    moduli = [fitting.fit_force(loud, indenter=BALL, drag=end).youngs_modulus[0] for end in (low, high)]
    width = lambda one: np.log(one.youngs_modulus[2] / one.youngs_modulus[1])
    # to the second order that the linear propagation of the error of the drag leaves out
    assert width(fit) == pytest.approx(np.hypot(width(known), np.log(moduli[0] / moduli[1])), rel=0.05)
    assert any("standard deviation of the drag" in note for note in fit.notes)


@pytest.mark.long
def test_intervals_hold_the_drag_and_the_modulus():
    held, count = np.zeros(2), 100
    for seed in range(count):
        fit = fitting.fit_force(curve(seed), indenter=BALL, drag="fit")
        rows = ((fit.youngs_modulus, E), (fit.nuisances["drag"], DRAG))
        held += [low < true < high for (_, low, high), true in rows]
    assert np.all(np.abs(held / count - 0.95) < 3.0 * np.sqrt(0.95 * 0.05 / count))


@pytest.mark.slow
def test_baselines_without_drag_have_no_note_and_a_drift_is_no_drag():
    dry = curve(drag=1e-8)
    assert not any("drag" in note for note in fitting.fit_force(dry, indenter=BALL).notes)
    assert fitting.fit_force(dry, indenter=BALL, drag="fit").nuisances["drag"][0] < 0.02 * DRAG
    with pytest.raises(
        ValueError, match=r"drag: expected a baseline of the approach above .* got it .* pN below"
    ):
        fitting.fit_force(curve(drag=1e-8, shift=500e-12), indenter=BALL, drag="fit")


@pytest.mark.parametrize(
    ("drag", "message"),
    [
        (-1e-6, "drag: expected a coefficient >= 0 N s/m, .* got -1e-06"),
        ("auto", "drag: expected a coefficient >= 0 N s/m, .* got 'auto'"),
        ("fit", "drag: expected a curve with approach and retraction, got one without"),
    ],
)
def test_mistakes(drag, message):
    t, load, depth = (one[:400] for one in ramp())
    with pytest.raises(ValueError, match=message):
        fitting.fit_force(fitting.IndentationData(t, load, depth), indenter=BALL, drag=drag)


def test_numbered_points_have_no_velocity(tmp_path):
    """Of a file without times, which is read, a drag in N s/m cannot be subtracted."""
    data = curve()
    path = tmp_path / "untimed.csv"
    rows = np.column_stack([1e9 * data.load, 1e9 * data.depth])
    np.savetxt(path, rows, delimiter=",", header="load [nN],depth [nm]", comments="")
    untimed = fitting.read_force(path)
    assert not any("drag" in note for note in fitting.fit_force(untimed, indenter=BALL).notes)
    for drag in ("fit", DRAG):
        with pytest.raises(ValueError, match="drag: expected a curve with times"):
            fitting.fit_force(untimed, indenter=BALL, drag=drag)


@pytest.mark.slow
def test_the_command(tmp_path, capsys):
    data = curve()
    rows = np.column_stack([data.t, 1e9 * data.load, 1e9 * data.depth])
    file = tmp_path / "bead.csv"
    np.savetxt(file, rows, delimiter=",", header="t [s],load [nN],depth [nm]", comments="")
    call = ["fit", "force", str(file), "--radius", str(RADIUS), "-o"]
    assert main([*call, str(tmp_path / "plain")]) == 0
    assert "--drag fit subtracts it" in capsys.readouterr().out
    assert main([*call, str(tmp_path / "bare"), "--drag", "fit"]) == 0
    found = json.loads((tmp_path / "bare" / "summary.json").read_text())["youngs_modulus_Pa"]
    assert found["low"] < E < found["high"]
    assert main([*call, str(tmp_path / "bad"), "--drag", "much"]) == 2
    assert "--drag: expected a number, got 'much'" in capsys.readouterr().err
