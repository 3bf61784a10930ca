"""Lee and Radok's solution for a rigid sphere or punch on a viscoelastic half-space, for a non-decreasing contact.

`creep` is J(t) [1/Pa] and `relaxation` G(t) [Pa], numpy callables of t >= 0 [s]; Poisson's ratio nu is constant.
Lengths in m, loads in N. Source: E. H. Lee and J. R. M. Radok, J. Appl. Mech. 27 (1960) 438.
An elastic indenter adds its compliance A_ind = (1 - nu)/G to (1 - nu) J(t) in every formula for the radius.
"""

import numpy as np

NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)
HALVINGS = 24  # number of panels graded towards the present time, to resolve a fast relaxation
BISECTIONS = 90


def graded(n):
    """Return nodes and weights on [0, 1] for n panels that halve towards 1, where a function is not smooth."""
    ends = np.concatenate([1.0 - 0.5 ** np.arange(n + 1), [1.0]])
    half, mid = 0.5 * np.diff(ends), 0.5 * (ends[1:] + ends[:-1])
    return (mid[:, None] + half[:, None] * NODES).ravel(), (half[:, None] * WEIGHTS).ravel()


def step_radius(t, creep, load, radius, nu, indenter_compliance=0.0):
    """Return a(t) = [3 R W ((1 - nu) J(t) + A_ind) / 8]^(1/3) [m] under a load W applied at t = 0."""
    return np.cbrt(0.375 * radius * load * ((1.0 - nu) * creep(np.asarray(t, float)) + indenter_compliance))


def step_approach(t, creep, load, radius, nu, indenter_compliance=0.0):
    """Return delta = a(t)^2 / R [m] under a step load."""
    return step_radius(t, creep, load, radius, nu, indenter_compliance) ** 2 / radius


def history_radius(t, creep, times, loads, radius, nu, indenter_compliance=0.0):
    """Return a(t) [m] for a non-decreasing, piecewise linear load: a^3 = (3R/8) int [(1 - nu) J(t - tau) + A_ind] dW.

    `loads[0]` is a step at `times[0]`; two equal times are a jump. After the last time the load is constant.
    """
    if np.any(np.diff(np.asarray(loads)) < 0):
        raise ValueError("Lee and Radok's solution needs a load that never decreases")
    t = np.asarray(t, float)
    cubes = _jump(t, creep, times[0], loads[0], nu, indenter_compliance)
    for i in range(1, len(times)):
        step = loads[i] - loads[i - 1]
        if times[i] == times[i - 1]:
            cubes = cubes + _jump(t, creep, times[i], step, nu, indenter_compliance)
        else:
            cubes = cubes + _ramp(t, creep, times[i - 1], times[i], step, nu, indenter_compliance)
    return np.cbrt(0.375 * radius * cubes)


def _jump(t, creep, start, step, nu, extra):
    """Return the contribution of a load step at `start` to the integral."""
    return np.where(t >= start, step * ((1.0 - nu) * creep(np.maximum(t - start, 0.0)) + extra), 0.0)


def _ramp(t, creep, start, end, step, nu, extra):
    """Return the contribution of a load that increases by `step` between `start` and `end`, by graded Gauss quadrature."""
    last = np.clip(t, start, end)
    x, w = graded(HALVINGS)
    tau = start + (last - start)[..., None] * x
    mean = ((1.0 - nu) * creep(np.maximum(t[..., None] - tau, 0.0)) + extra) @ w
    return np.where(t > start, step * (last - start) / (end - start) * mean, 0.0)


def _arrival(contact_radius, target, t):
    """Return the time in [0, t] at which the non-decreasing a(tau) reaches `target`, by bisection."""
    low, high = np.zeros_like(target), np.full_like(target, t)
    for _ in range(BISECTIONS):
        mid = 0.5 * (low + high)
        below = contact_radius(mid) < target
        low, high = np.where(below, mid, low), np.where(below, high, mid)
    return 0.5 * (low + high)


def pressure(r, t, relaxation, contact_radius, radius, nu):
    """Return p(r, t) = 4/(pi (1 - nu) R) int G(t - tau) d sqrt(a(tau)^2 - r^2)_+ [Pa] under a rigid sphere.

    `contact_radius` is the non-decreasing a(tau). The integration variable is y = sqrt(a^2 - r^2) itself, which
    removes the square-root singularity at the first arrival; the step at t = 0 gives G(t) y(0+).
    """
    r = np.atleast_1d(np.asarray(r, float))
    first, last = (np.sqrt(np.maximum(float(contact_radius(s)) ** 2 - r**2, 0.0)) for s in (0.0, t))
    x, w = graded(HALVINGS)
    y = first[:, None] + (last - first)[:, None] * x
    tau = _arrival(contact_radius, np.hypot(y, r[:, None]), float(t))
    growth = (last - first) * (relaxation(t - tau) @ w)
    return 4.0 / (np.pi * (1.0 - nu) * radius) * (relaxation(t) * first + growth)


def punch_approach(t, creep, load, punch_radius, nu):
    """Return delta = (1 - nu) W J(t) / (4 a) [m] of a rigid flat punch of radius a under a step load."""
    return (1.0 - nu) * load * creep(np.asarray(t, float)) / (4.0 * punch_radius)
