"""Force curves of an adhesive ball on an elastic half-space from closed forms, with noise."""

import functools

import numpy as np

import fitting
from jaxcontact.reference import maugis

RADIUS, G, NU, WORK = 5e-6, 1e6, 0.5, 50e-3
E = 2.0 * G / (1.0 - NU)
UNITS = maugis.units(WORK, RADIUS, E)
SHIFT = 30e-9  # of the measured depth [m]


@functools.cache
def branch(parameter):
    """Approach and load of the stable branch under an approach, in units; parameter: lambda, None for JKR."""
    a = np.linspace(0.02, 3.5, 500)
    load, approach = maugis.jkr(a) if parameter is None else maugis.maugis(parameter, a)
    end = int(np.argmin(approach))
    return approach[end:], load[end:]


def force_curve(parameter, noise=0.01, seed=0, n=60, shift=SHIFT, known=False):
    """Approach to and retraction from 2.5 units, that jumps into contact at zero and breaks at the end of the branch; the
    standard deviation of the load in units is ``noise``."""
    approach, load = branch(parameter)
    down = np.linspace(-1.5, 2.5, n)
    up = down[::-1]
    loads = np.concatenate(
        [
            np.where(down < 0.0, 0.0, np.interp(down, approach, load)),
            np.where(up < approach[0], 0.0, np.interp(up, approach, load)),
        ]
    )
    loads = loads + noise * np.random.default_rng(seed).standard_normal(2 * n)
    depth = np.concatenate([down, up]) * UNITS.approach + shift
    sigma = np.full(2 * n, noise * UNITS.load) if known else None
    marks = np.repeat(["approach", "retract"], n)
    t = 0.01 * np.arange(2 * n)
    return fitting.IndentationData(t=t, load=loads * UNITS.load, depth=depth, marks=marks, sigma_load=sigma)
