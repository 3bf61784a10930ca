"""Fits of a creeping film with its work of adhesion, to curves of the solver on a finer grid with shorter steps."""

import warnings

import numpy as np
import pytest
from force_curves import NU, RADIUS, SHIFT, UNITS, WORK, G

import fitting
import jaxcontact as jc

TRUTH = {"G1": 3.0 * G, "G2": 1.5 * G, "eta2": 1.5 * G, "work": WORK}
BASE, THICKNESS, BALL = jc.Elastic(20.0 * G, 0.3), UNITS.radius, jc.Sphere(RADIUS)
REACH = np.cbrt(RADIUS * WORK**2 * ((1.0 - NU) / (2.0 * G)) ** 2) / 1.5
APPROACH, DWELL, RETRACTION = 16, 10, 60


def path():
    """Times [s] and approach, in units, of approach, dwell and retraction."""
    ways = (
        np.linspace(-1.0, 1.5, APPROACH),
        np.full(DWELL, 1.5),
        np.linspace(1.5, -3.5, RETRACTION + 1)[1:],
    )
    ends = np.linspace(0.0, 1.0, APPROACH), np.linspace(1.4, 5.0, DWELL), np.linspace(5.333, 25.0, RETRACTION)
    return np.concatenate(ends), np.concatenate(ways)


def curve(load, seed):
    """Return a curve with 0.5 % of noise, and a contact point."""
    times, way = path()
    noise = 0.005 * np.abs(load).max() * np.random.default_rng(seed).standard_normal(load.size)
    marks = np.repeat(["approach", "retract"], [APPROACH + DWELL, RETRACTION])
    return fitting.IndentationData(
        t=times, load=load + noise, depth=way * UNITS.approach + SHIFT, marks=marks
    )


def fitted(data, model="StandardLinearSolid", **keywords):
    given = {"indenter": BALL, "nu": NU, "layer": THICKNESS, "substrate": BASE, "control": "depth"}
    given |= {"contact_point": "fit", "bounds": {"G1": (None, 20.0 * G)}}
    given |= {"adhesion": jc.ExponentialAdhesion(0.6 * WORK, REACH)}
    return fitting.fit_indentation(data, model, **given | keywords)


@pytest.mark.long
def test_a_creeping_film_and_its_work_of_adhesion_are_found():
    times, way = path()
    body = jc.LayeredHalfSpace(
        [jc.Layer(jc.StandardLinearSolid(*list(TRUTH.values())[:3], nu=NU), THICKNESS)], BASE
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        clean = jc.indent(
            body, BALL, jc.Approach(way * UNITS.approach), times, grid=jc.Grid.square(n=96, width=8.0 * UNITS.radius),
            adhesion=jc.ExponentialAdhesion(WORK, REACH), save="last", substeps=4, max_iterations=2000,
        )  # fmt: skip
        fit = fitted(curve(np.asarray(clean.load), 0))
    assert not np.any(clean.status) and fit.verdict == "accepted" and all(fit.identified.values())
    for name, value in TRUTH.items():
        low, high = fit.intervals[name]
        assert low < value < high and fit.values[name] == pytest.approx(value, rel=0.06)
    assert high - low < 0.2 * WORK
    assert isinstance(fit.material, jc.StandardLinearSolid) and float(fit.law.work) == fit.values["work"]
    assert fit.film.thickness == THICKNESS and any("range of the attraction is held" in n for n in fit.notes)


def test_what_a_fit_of_a_creeping_film_does_not_take_is_refused():
    data = curve(np.linspace(-1e-6, 1e-6, APPROACH + DWELL + RETRACTION), 0)
    with pytest.raises(
        ValueError, match=r'model: expected one of .* got Elastic: adhesion="JKR" fits an elastic'
    ):
        fitted(data, "Elastic")
    with pytest.raises(ValueError, match="control: expected \"depth\" with a law of adhesion, got 'load'"):
        fitted(data, control="load")
    with pytest.raises(
        ValueError, match="bounds: expected an upper bound of G1 up to the modulus of the base"
    ):
        fitted(data, bounds=None)
    with pytest.raises(ValueError, match="substrate: expected Elastic with nu beside a fit of the work"):
        fitted(data, substrate=jc.Maxwell(1e9, 1e9, nu=0.3))
    with pytest.raises(ValueError, match="grid: expected none with a fit of the work of adhesion"):
        fitted(data, grid=64)
