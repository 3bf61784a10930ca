"""Force curves of samples whose local modulus is stated over the depth, by numerical integration of the force.

dF/dd = E(d)/(1 - nu^2) d(size d^p)/dd with a local E(d), so that the apparent modulus, which the law of a homogeneous sample
has at the force F(d), is a mean of E from the contact to d. ``film`` is instead a layer on an elastic base, by the
Legendre-Galerkin solution of ``reference.abel``.
"""

import functools

import numpy as np
from scipy.interpolate import CubicSpline

import fitting
import jaxcontact as jc
from jaxcontact.reference import abel

RADIUS, ANGLE, DEEP, E, NU, POINTS = 5e-6, 1.0, 1e-6, 1e3, 0.5, 400
# power of the depth, and force over E d^p/(1 - nu^2)
TIPS = {
    "ball": (jc.Sphere(RADIUS), 1.5, 4.0 / 3.0 * RADIUS**0.5),
    "cone": (jc.Cone(ANGLE), 2.0, 2.0 / np.pi * np.tan(ANGLE)),
    "punch": (jc.FlatPunch(RADIUS), 1.0, 2.0 * RADIUS),
}
# local modulus over E, at depths over DEEP
LOCAL = {
    "stiffens": ("ball", lambda s: 1.0 + 21.0 * s**2),
    "stiffens evenly": ("ball", lambda s: 1.0 + 6.0 * s),
    "softens": ("ball", lambda s: 1.0 - 0.8 * np.minimum(s, 1.0)),
    "skin": ("ball", lambda s: 1.0 + 4.0 * np.exp(-5.0 * s)),
    "cone": ("cone", lambda s: 1.0 + 6.0 * s),
    "punch": ("punch", lambda s: 1.0 + 3.0 * np.exp(-3.0 * s)),
}
# modulus of the base over that of the film
FILMS = {"film on a stiff base": 30.0, "film on a soft base": 1.0 / 30.0}
CHI = 1.5  # largest contact radius over the thickness of a film, about
SHAPES = (*LOCAL, *FILMS)


@functools.cache
def apparent(shape):
    """The tip of a sample, and its apparent modulus over E as a function of depths over DEEP, up to 1.5."""
    if shape in FILMS:
        body = abel.Layered(1.0, NU, 1.0, FILMS[shape], NU)
        found = [abel.solve_radius(a, body, 1.0, modes=16) for a in np.geomspace(0.02, 3.0 * CHI, 40)]
        deep, force = np.array([(one.approach, one.load) for one in found]).T
        line = CubicSpline(
            np.log(deep), np.log(force / (16.0 / 3.0 * deep**1.5))
        )  # of a film of G = 1: E = 3
        return "ball", lambda s: np.exp(line(np.log(np.maximum(s * CHI**2, deep[0]))))
    tip, local = LOCAL[shape]
    p, edges = TIPS[tip][1], np.linspace(0.0, 1.5, 6001)
    middle = 0.5 * (edges[1:] + edges[:-1])
    force = np.cumsum(local(middle) * np.diff(edges**p))
    return tip, lambda s: np.interp(s, edges[1:], force / edges[1:] ** p)


def curve(shape, noise, size, seed):
    """A force curve with a tilted baseline, and its tip; size: standard deviation of the noise over the largest force."""
    tip, modulus = apparent(shape)
    indenter, p, factor = TIPS[tip]
    z, rng = np.linspace(-1.0, 1.0, POINTS), np.random.default_rng([seed, 43])
    s = np.maximum(z, 0.0)
    load = factor * E / (1.0 - NU**2) * modulus(np.maximum(s, 1e-9)) * (DEEP * s) ** p
    top, white = load.max(), rng.standard_normal(POINTS)
    if noise == "correlated":
        for k in range(1, POINTS):
            white[k] = 0.6 * white[k - 1] + 0.8 * white[k]
    sd = size * (np.hypot(load, 0.2 * top) if noise == "proportional" else top)
    t = 1e-3 * np.arange(POINTS)
    load = load + sd * white + top * (0.1 + 0.02 * t / t[-1])
    return fitting.IndentationData(t=t, load=load, depth=DEEP * z), indenter


def held(fit, shape):
    """Whether each row of the table of a fit holds the modulus at its depth (5,), and log E over the truth (5,)."""
    at, found, low, high = np.array(fit.modulus_over_depth).T
    truth = E * apparent(shape)[1](at / DEEP)
    return (low <= truth) & (truth <= high), np.log(found / truth)
