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
