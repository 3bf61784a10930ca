"""Force curves and creep of thin samples bonded to a rigid base, by the Legendre-Galerkin solution of ``reference.abel``."""

import functools

import numpy as np
from scipy.interpolate import CubicSpline

import fitting
from jaxcontact.reference import abel

# a force curve
RADIUS, DEEP, E = 5e-6, 1e-6, 1.2e3  # of the ball [m], largest depth on a half-space [m], modulus [Pa]
LAYER = 1e-6  # thickness [m]
T = np.linspace(0.0, 1.0, 400)
Z = np.linspace(-1.0, 1.0, 400)  # depth over the largest

# creep of a gel in a dish
BEAD, HEIGHT, PEAK, GEL_NU = 25e-6, 20e-6, 4e-7, 0.5  # radius [m], thickness [m], load [N], Poisson's ratio
GEL = {"G1": 1000.0, "G2": 1500.0, "eta2": 9000.0}
TIMES = np.concatenate([np.linspace(0.0, 1.0, 26), np.geomspace(1.05, 60.0, 75)])


@functools.cache
def elastic(nu, narrow, wide):
    """Depth and force (24,) of a ball over contact radii of the given range; radius, thickness and G are 1."""
    body = abel.Layered(1.0, nu, 1.0, 1e12, 0.3)
    found = [abel.solve_radius(a, body, 1.0, modes=16) for a in np.geomspace(narrow, wide, 24)]
    depth, force = np.array([(one.approach, one.load) for one in found]).T
    return depth, force


@functools.cache
def thin(nu, chi):
    """(depth, load) of a ball on a layer, up to sqrt(R depth)/thickness = chi."""
    deep, load = elastic(nu, 0.05, 2.0 * chi)
    depth = Z * (chi * LAYER) ** 2 / RADIUS
    scaled = np.maximum(depth, 0.0) * RADIUS / LAYER**2
    known = np.exp(CubicSpline(np.log(deep), np.log(load / deep**1.5))(np.log(np.maximum(scaled, deep[0]))))
    return depth, E / 2.0 / (1.0 + nu) * LAYER**3 / RADIUS * known * scaled**1.5


def noisy(load, seed, proportional=0.002, floor=0.0005):
    """The load with a tilted baseline and noise."""
    rng, top = np.random.default_rng(seed), load.max()
    noise = np.hypot(proportional * load, floor * top) * rng.standard_normal(load.size)
    return load + noise + top * (0.1 + 0.05 * T)


def curve(load, depth=Z * DEEP):
    """A force curve of one second."""
    return fitting.IndentationData(t=T, load=load, depth=depth)


def gel_law(nu):
    """Depth [m] and force [N] over G [Pa] of a bead on the elastic gel."""
    depth, force = elastic(nu, 0.03, 2.6)
    return depth * HEIGHT**2 / BEAD, force * HEIGHT**3 / BEAD


def spline(x, y):
    """y over x in logarithms; 0 where x is not positive."""
    line = CubicSpline(np.log(x), np.log(y))
    return lambda at: np.where(at > 0, np.exp(line(np.log(np.maximum(at, x[0])))), 0.0)


def gel_creep(t, G1, G2, eta2):
    """(load, depth) of a bead on a gel under a load that rises for a second and is held; int J dP in closed form."""
    tau = eta2 / G2
    once = lambda s: s / G1 + (s - tau * (1.0 - np.exp(-s / tau))) / G2
    depth, force = gel_law(GEL_NU)
    path = once(t) - once(np.maximum(t - 1.0, 0.0))
    return PEAK * np.minimum(t, 1.0), spline(force, depth)(PEAK * path)


def gel_data(load, depth, t=TIMES):
    """An indentation curve of the gel."""
    return fitting.IndentationData(t=t, load=load, depth=depth, cut=True)
