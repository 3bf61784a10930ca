"""Fits do not depend on the units of length, force and time: parameters, intervals, verdict and notes are those of the data
in another unit, which an absolute tolerance in SI units anywhere would change."""

import re

import numpy as np
import pytest

import fitting
import jaxcontact as jc

QUANTITY = re.compile(
    r"-?\d[\d.]*(e[+-]?\d+)?( to -?\d[\d.]*(e[+-]?\d+)?)? ?[pnµmkMGT]?(1/\(?Pa( s\))?|Pa s|Pa|m/s|N/s|m|N|s)\b"
)
UNITS = [(1e-3, 1e-6, 1e-2), (30.0, 1e4, 1e3)]  # of length, force and time, in those of the first data


def noisy(values, seed):
    return values * (1.0 + 0.005 * np.random.default_rng(seed).standard_normal(values.shape))


def creep(length, force, time):
    """A standard linear solid, J in 1/Pa."""
    stress = force / length**2
    t = np.geomspace(1.0, 1e3, 60)
    J = noisy(1e-6 + 3e-6 * -np.expm1(-t / 80.0), 1)
    data = fitting.CreepData(time * t, J=J / stress, start=0.0)
    return fitting.fit_creep(data, "StandardLinearSolid", weights="relative")


def indentation(length, force, time):
    """A load that rises in 5 s and is held: depth^1.5 of a ball on a Maxwell fluid."""
    t = np.concatenate([np.linspace(0.0, 5.0, 20), np.linspace(6.0, 200.0, 60)])
    load = np.minimum(t / 5.0, 1.0) * 1e-3
    held = load * 1e-6 + 1e-3 / 1e8 * np.where(t < 5.0, t**2 / 10.0, t - 2.5)
    depth = noisy((3.0 * (1.0 - 0.4) / (8.0 * np.sqrt(1e-4)) * held) ** (2.0 / 3.0), 2)
    data = fitting.IndentationData(time * t, load=force * load, depth=length * depth)
    return fitting.fit_indentation(
        data, "Maxwell", indenter=jc.Sphere(1e-4 * length), nu=0.4, weights="relative"
    )


def force(length, force, time):
    """Approach to an elastic solid of 1 MPa from 1 um above it."""
    t = np.linspace(0.0, 1.0, 120)
    depth = 3e-6 * t
    load = 16.0 / 9.0 * 1e6 * np.sqrt(5e-6) * np.maximum(depth - 1e-6, 0.0) ** 1.5
    load = load + 2e-3 * load.max() * np.random.default_rng(3).standard_normal(t.size)
    data = fitting.IndentationData(time * t, load=force * load, depth=length * depth)
    return fitting.fit_force(data, indenter=jc.Sphere(5e-6 * length), nu=0.5)


@pytest.mark.parametrize("fit", [creep, indentation, force])
@pytest.mark.parametrize("units", UNITS)
def test_a_fit_in_other_units_is_the_same(fit, units):
    length, newton, time = units
    one, other = fit(1.0, 1.0, 1.0), fit(*units)
    modulus = newton / length**2
    for name, value in one.values.items():
        unit = modulus * (time if name.startswith("eta") else 1.0)
        assert other.values[name] == pytest.approx(unit * value, rel=1e-5), name
        np.testing.assert_allclose(np.array(other.intervals[name]) / unit, one.intervals[name], rtol=1e-3)
    assert other.verdict == one.verdict == "accepted"
    notes = [[QUANTITY.sub("#", note) for note in each.notes] for each in (one, other)]
    assert notes[0] == notes[1]
