"""Retraction of an adhesive ball from a standard linear solid: simulation and published theories of its pull-off load.

A Dugdale zone at the edge of a receding contact is that of a crack that runs at the speed v (R. A. Schapery, Int. J.
Fract. 11 (1975) 141 and 369; J. A. Greenwood, J. Phys. D 37 (2004) 2557). Where v tau is much smaller than the contact, the
solid is relaxed elsewhere, and the contact is that of Johnson, Kendall and Roberts with the work that the crack needs (J. A.
Greenwood, K. L. Johnson, Philos. Mag. A 43 (1981) 697). At high speeds an Abel density peels at once (docs/theory.md).
"""

import warnings

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

import jaxcontact as jc
from jaxcontact.reference import maugis

WORK, RADIUS, G, NU = 50e-3, 5e-6, 1e6, 0.5
E = 2.0 * G / (1.0 - NU)
UNITS = maugis.units(WORK, RADIUS, E)
BALL = jc.Sphere(RADIUS)
REACH = np.cbrt(RADIUS * WORK**2 / E**2)  # range of a Tabor number of 1
# pi E* w/(4 s0^2) over the unit of radius, at a Tabor number of 1
UNIT_ZONE = 0.25 * np.pi / np.cbrt(0.75 * np.pi)
DWELL = 1e6  # relaxation times


def solid(ratio):
    """A half-space of relaxed modulus G and ``ratio`` times that at once, with a retardation time of 1 s."""
    delayed = 1.0 / (1.0 / G - 1.0 / (ratio * G))
    return jc.LayeredHalfSpace([], jc.StandardLinearSolid(ratio * G, delayed, delayed, nu=NU))


def dugdale(tabor):
    """Dugdale's law for a Tabor number of the relaxed solid."""
    return jc.DugdaleAdhesion(WORK, WORK * tabor / REACH)


def indent(body, control, times, n, width, law, **options):
    """Load in units, and the history."""
    grid = jc.Grid.square(n=n, width=width * UNITS.radius)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        history = jc.indent(body, BALL, control, times, grid=grid, adhesion=law, save="last", **options)
    return np.asarray(history.load) / UNITS.load, history


def approaching(values):
    """An approach in units."""
    return jc.Approach(np.asarray(values) * UNITS.approach)


def retracted(ratio, tabor, dwell, speed, n, width, steps, end):
    """Lowest load of a retraction at a speed [units of approach per retardation time] after a long dwell."""
    path = np.concatenate([[dwell, dwell], np.linspace(dwell, end, steps + 1)[1:]])
    times = np.concatenate([[0.0, DWELL], DWELL + (dwell - path[2:]) / speed])
    loads, history = indent(solid(ratio), approaching(path), times, n, width, dugdale(tabor))
    return float(loads.min()), history


def crack(ratio):
    """Effective over true work of adhesion, and v tau over the zone length of the relaxed solid, of a running crack.

    w = s0 int C(c (1 - x)/v) dg_e(x) over a zone of length c, with the opening g_e of an elastic one, whose slope is
    1/2 ln((1 + sqrt x)/(1 - sqrt x)); the relaxed solid around it releases 4 s0^2 c/(pi Einf).
    """
    transit = np.geomspace(1e4, 1e-5, 200)  # c/(v tau)

    def work(transit):
        creep = lambda t: 1.0 / ratio + (1.0 - 1.0 / ratio) * -np.expm1(-t)
        slope = lambda y: creep(transit * (1.0 - y * y)) * np.arctanh(y) * 2.0 * y  # x = y^2
        return 1.0 / quad(slope, 0.0, 1.0, limit=200)[0]

    gain = np.array([work(t) for t in transit])
    return gain, gain / transit


def peeled(ratio, tabor, dwell, speed):
    """Lowest load, in units, of a contact that is relaxed but for its edge, which recedes as a crack."""
    gain, rate = crack(ratio)
    rate = np.log(rate * UNIT_ZONE / tabor**2)
    a = brentq(lambda a: float(maugis.jkr(a)[1]) - dwell, 0.9, 5.0)
    depth, lowest, longest = dwell, 0.0, 2e-4 / speed
    while a > 0.3:
        g = (1.5 * (a * a - depth)) ** 2 / (6.0 * a)  # depth = a^2 - 2/3 sqrt(6 a g)
        lowest = min(lowest, a**3 - a * np.sqrt(6.0 * a * g))
        v = 0.0 if g <= gain[0] else np.exp(np.interp(g, gain, rate)) if g < gain[-1] else 1e12
        step = min(longest, 1e-3 / max(v, 1e-12))
        a, depth = a - v * step, depth - speed * step
    return lowest


def peeled_at_once(ratio, dwell):
    """Lowest load, in units, and its approach, without time to relax: docs/theory.md."""
    slow, quick = 2.0 / E, 2.0 / (ratio * E)
    a1 = brentq(lambda a: float(maugis.jkr(a)[1]) - dwell, 0.9, 9.0) * UNITS.radius
    density = lambda s: 2.0 / (np.pi * slow) * (dwell * UNITS.approach - s**2 / RADIUS)
    drop = lambda a: density(a) + np.sqrt(4.0 * a * WORK / (np.pi * quick))
    whole = lambda a: 2.0 / (np.pi * slow) * (dwell * UNITS.approach * a - a**3 / (3.0 * RADIUS))
    load = lambda a: 2.0 * np.pi * (whole(a) - a * drop(a))
    a = minimize_scalar(load, bounds=(0.05 * a1, a1), method="bounded", options={"xatol": 1e-9 * a1}).x
    return load(a) / UNITS.load, dwell - np.pi * quick / 2.0 * drop(a) / UNITS.approach, a1 / UNITS.radius
