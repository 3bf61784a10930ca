"""Maps of force curves with known moduli and known faults, by closed forms in numpy alone."""

import numpy as np

RADIUS = 5e-6
WAY = 2e-6  # of the tip [m]
FAULTS = ("no contact", "saturated", "jump", "step", "spikes")


def simulated(count, points=512, *, noise=0.01, faulty=0.05, seed=0):
    """Return depth and load (count, points) padded with nan, times (count, points), Young's moduli (count,), contact points
    and the kind of each curve: "good" or one of ``FAULTS``.

    Hertz for a ball of 5 um and nu = 0.5, F = 16/9 E R^(1/2) d^(3/2) (K. L. Johnson, Contact Mechanics, 1985), with a
    baseline, a tilt and white noise of a fraction of the largest force. Moduli scatter by a factor of 1.8, contact points
    between 0.35 and 0.65 of the way, and curves have 3/4 of the points to all.
    """
    rng = np.random.default_rng(seed)
    E = 1e3 * np.exp(0.6 * rng.standard_normal(count))
    kinds = np.full(count, "good", dtype="<U12")
    for place, k in enumerate(rng.permutation(count)[: round(faulty * count)]):
        kinds[k] = FAULTS[place % len(FAULTS)]
    depth, load, times = np.full((3, count, points), np.nan)
    touch = WAY * rng.uniform(0.35, 0.65, count)
    for k in range(count):
        n = int(rng.integers(3 * points // 4, points + 1))
        s = np.linspace(0.0, 1.0, n)
        d = WAY * s
        force = 16.0 / 9.0 * E[k] * np.sqrt(RADIUS) * np.maximum(d - touch[k], 0.0) ** 1.5
        top = force.max()
        if kinds[k] == "no contact":
            force = np.zeros(n)
        elif kinds[k] == "saturated":  # the photodiode ends at a part of the force
            force = np.minimum(force, rng.uniform(0.3, 0.7) * top)
        elif kinds[k] == "jump":  # in contact
            beyond = d > touch[k] + rng.uniform(0.3, 0.8) * (WAY - touch[k])
            force = force + rng.uniform(0.2, 0.6) * rng.choice([-1.0, 1.0]) * top * beyond
        elif kinds[k] == "step":  # in the baseline
            force = force + rng.uniform(0.15, 0.4) * rng.choice([-1.0, 1.0]) * top * (
                d > touch[k] * rng.uniform(0.3, 0.8)
            )
        force = force + top * (
            rng.uniform(-0.2, 0.2) + rng.uniform(-0.05, 0.05) * s + noise * rng.standard_normal(n)
        )
        if kinds[k] == "spikes":
            at = rng.choice(n, int(rng.integers(3, 9)), replace=False)
            force[at] += top * rng.uniform(0.5, 3.0, at.size) * rng.choice([-1.0, 1.0], at.size)
        depth[k, :n], load[k, :n], times[k, :n] = d, force, s
    return depth, load, times, E, touch, kinds


def adhesive(count, points=256, *, noise=0.01, faulty=0.05, seed=0):
    """Return depth and load (count, 2 points) padded with nan, times likewise, E* (count,), works of adhesion (count,),
    contact points and the kind of each curve: "good" or one of ``FAULTS``.

    Approach to and retraction from 2 to 4 units of a ball of 5 um in contact with a half-space, by the theory of Johnson,
    Kendall and Roberts (K. L. Johnson, Contact Mechanics, 1985, section 5.5) for contacts of radius a:

        F = 4 E* a^3/(3 R) - (8 pi w E* a^3)^(1/2),     depth = a^2/R - (2 pi w a/E*)^(1/2).

    The surfaces jump into contact at depth zero and part where the depth is least. Each segment has 3/4 of ``points`` to
    all of them.
    """
    rng = np.random.default_rng(seed)
    E = 1.3e6 * np.exp(0.6 * rng.standard_normal(count))
    work = 0.02 * np.exp(0.3 * rng.standard_normal(count))
    touch = rng.uniform(-1e-7, 1e-7, count)
    kinds = np.full(count, "good", dtype="<U12")
    for place, k in enumerate(rng.permutation(count)[: round(faulty * count)]):
        kinds[k] = FAULTS[place % len(FAULTS)]
    depth, load, times = np.full((3, count, 2 * points), np.nan)
    for k in range(count):
        n = int(rng.integers(3 * points // 4, points + 1))
        unit = np.cbrt(np.pi**2 * work[k] ** 2 * RADIUS / (4 / 3 * E[k]) ** 2)
        first, deepest = -rng.uniform(2.5, 4.0) * unit, rng.uniform(2.0, 4.0) * unit
        down = np.linspace(first, deepest, n)
        up = down[::-1]
        # the stable branch begins where the depth is least
        least = np.cbrt(np.pi * work[k] * RADIUS**2 / (8.0 * E[k]))
        a = np.linspace(least, 2.0 * np.sqrt(RADIUS * deepest) + 4.0 * least, 3000)
        branch = a**2 / RADIUS - np.sqrt(2.0 * np.pi * work[k] * a / E[k])
        force = 4.0 * E[k] * a**3 / (3.0 * RADIUS) - np.sqrt(8.0 * np.pi * work[k] * E[k] * a**3)
        force = np.concatenate([
            np.where(down < 0.0, 0.0, np.interp(down, branch, force)),
            np.where(up < branch[0], 0.0, np.interp(up, branch, force)),
        ])  # fmt: skip
        top, size, sign = force.max(), np.abs(force).max(), rng.choice([-1.0, 1.0])
        if kinds[k] == "no contact":
            force = np.zeros(2 * n)
        elif kinds[k] == "saturated":
            force = np.minimum(force, rng.uniform(0.3, 0.7) * top)
        elif kinds[k] == "jump":  # in contact, during the approach
            at = np.searchsorted(down, rng.uniform(0.3, 0.8) * deepest)
            force[at:] += rng.uniform(0.2, 0.6) * sign * size
        elif kinds[k] == "step":  # in the baseline of the approach
            at = np.searchsorted(down, first * rng.uniform(0.3, 0.8))
            force[at:] += rng.uniform(0.15, 0.4) * sign * size
        force = force + size * (rng.uniform(-0.2, 0.2) + noise * rng.standard_normal(2 * n))
        if kinds[k] == "spikes":
            at = rng.choice(2 * n, int(rng.integers(3, 9)), replace=False)
            force[at] += size * rng.uniform(0.5, 3.0, at.size) * rng.choice([-1.0, 1.0], at.size)
        depth[k, : 2 * n], load[k, : 2 * n] = np.append(down, up) + touch[k], force
        times[k, : 2 * n] = np.arange(2 * n) / n
    return depth, load, times, E, work, touch, kinds
