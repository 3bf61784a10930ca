"""Simulated gels with a known cause of their relaxation, and how many ``fitting.relaxation_cause`` names rightly.

    python -m tests.benchmarks.poroelastic_causes                 # 20 gels of each kind
    python -m tests.benchmarks.poroelastic_causes --gels 100
    python -m tests.benchmarks.poroelastic_causes --coverage 100  # parameters of fit_poroelastic within their intervals
    python -m tests.benchmarks.poroelastic_causes --design 20     # gels told at the second depth that fitting.design states

Nothing of the generator is shared with the package: forces are sums over increments of the depth with the formulas of Hu
et al. in ``tests/support/poroelastic_contact.py``, and a network with one or two relaxation times. Depths differ by a factor
of 3, ramps take 1 to 10 % of a^2/D at the smaller depth (of the shortest time of a network), and the noise has 2 % of the
force, at 500 points of a hold. Where both causes act, each has at least a fifth of the relaxation (of the logarithm of
F0/Finf), and their times are within a factor of ten. For the coverage the forces after a ramp are those of a contact that
grows under a sealed ball (``ramp_error``, with a random error of 15 % of it).
"""

import argparse
import time

import numpy as np

import fitting
import jaxcontact as jc
from tests.support.poroelastic_contact import BALL, hu, ramp_error

KINDS = ("viscoelastic", "poroelastic", "both")
BEAD = jc.Sphere(50e-6)


def step_force(lag, a, G, nu, D, parts, times):
    """F(t)/(16/3 G a d) after a step: the product of solvent and network (parts of times, the rest stays)."""
    solvent = 1.0 if nu is None else (1 + (1 - 2 * nu) * hu(D * lag / a**2, BALL)) / (2 * (1 - nu))
    network = 1 - sum(parts) + sum(p * np.exp(-lag / tau) for p, tau in zip(parts, times, strict=True))
    return solvent * network


def gel(kind, rng):
    """Return the properties of a random gel: G, nu, D, parts and times of the network."""
    G, D = 10 ** rng.uniform(3, 5), 10 ** rng.uniform(-11, -9)
    a2 = 50e-6 * 3e-6
    centre = a2 * 3**0.5 / D
    if kind == "both":
        total = rng.uniform(np.log(1.4), np.log(2.5))
        share = rng.uniform(0.2, 0.8)
        share = min(share, 0.95 * np.log(2.0) / total)
        nu = 1 - 0.5 * np.exp(share * total)  # log of 2 (1 - nu)
        fall = 1 - np.exp(-(1 - share) * total)
    else:
        nu = rng.uniform(0.05, 0.35) if kind == "poroelastic" else None
        fall = 0.0 if kind == "poroelastic" else rng.uniform(0.25, 0.6)
    tau = centre * 10 ** rng.uniform(-1, 1)
    count = int(rng.integers(1, 3))
    parts = fall * rng.dirichlet(np.full(count, 3.0)) if fall else np.zeros(0)
    times = tau * 10 ** rng.uniform(-0.3, 0.3, count) if fall else np.zeros(0)
    return G, nu, D, parts, times


def holds_of(properties, rng, depths=(3e-6, 9e-6), noise=0.02, points=500, sealed=False):
    """Return a curve with ramp and hold at each depth; sealed: with the growing contact of a sealed ball in the ramp."""
    G, nu, D, parts, times = properties
    found = []
    scales = [50e-6 * depth / D for depth in depths]
    longest = max([*(scales if nu is not None else []), *times])
    ramp = scales[0] * rng.uniform(0.01, 0.1)
    if nu is None:  # of the time of the network, which is that of a solvent within a factor of ten
        ramp = float(np.min(times)) * rng.uniform(0.01, 0.1)
    for depth in depths:
        a = np.sqrt(50e-6 * depth)
        up = np.linspace(0, ramp, 20)[:-1]
        t = np.append(up, ramp + np.geomspace(0.05 * ramp, 6 * longest, points))
        middle = ramp * ((np.arange(500) + 0.5) / 500) ** (2 / 3)
        force = np.array([
            np.mean(step_force(np.maximum(one - middle, 0), a, G, nu, D, parts, times) * (middle <= one)) for one in t
        ])  # fmt: skip
        if sealed:
            rho, R = (1 - 2 * nu) / (2 * (1 - nu)), D * ramp / a**2
            error = (1 + 0.15 * rng.standard_normal()) * ramp_error(R, np.maximum(D * t / a**2 - R, 0.0))
            force -= rho * error * np.minimum(t / ramp, 1.0) ** 2.5
        force = 16 / 3 * G * a * depth * force
        force = force * (1 + noise * rng.standard_normal(t.size))
        found.append(fitting.IndentationData(t=t, load=force, depth=np.minimum(t / ramp, 1.0) * depth))
    return found


def causes(gels, seed=0, single=True, verbose=False, same=False, points=500, kinds=KINDS):
    """Print how many gels of each kind are named rightly, from two depths and from the smaller one alone."""
    started = time.perf_counter()
    for kind in kinds:
        for count in (2, 1) if single else (2,):
            said = []
            for k in range(gels):
                rng = np.random.default_rng([seed, KINDS.index(kind), k])
                properties = gel(kind, rng)
                found = fitting.relaxation_cause(
                    holds_of(properties, rng, points=points)[:count], indenter=BEAD, same_modulus=same
                )
                said.append(found.cause)
                if verbose and count == 2 and found.cause != kind:
                    print(k, properties, found)
            table = ", ".join(f"{said.count(name)} {name}" for name in (*KINDS, "cannot tell"))
            print(
                f"{kind}, {count} depths: {table} of {gels} ({time.perf_counter() - started:.0f} s)",
                flush=True,
            )


def coverage(sets, seed=1):
    """Print how often the true G, nu and D are within the intervals of one hold, and the verdicts."""
    inside, accepted = {"G": 0, "nu": 0, "D": 0, "permeability": 0}, 0
    for k in range(sets):
        rng = np.random.default_rng([seed, k])
        properties = gel("poroelastic", rng)
        data = holds_of(properties, rng, depths=(5e-6,), noise=0.01, sealed=True)[0]
        fit = fitting.fit_poroelastic(data, indenter=BEAD, viscosity=1e-3)
        G, nu, D = properties[:3]
        for name, truth in (("G", G), ("nu", nu), ("D", D)):
            low, high = fit.intervals[name]
            inside[name] += low <= truth <= high
        _, low, high = fit.permeability
        inside["permeability"] += low <= D * 1e-3 * (1 - 2 * nu) / (2 * (1 - nu) * G) <= high
        accepted += fit.verdict == "accepted"
    print(
        ", ".join(f"{name} {100 * n / sets:.0f} %" for name, n in inside.items()),
        f"; accepted {accepted} of {sets}",
    )


def designs(gels, seed=0, points=500, smaller=1.2, kinds=KINDS[:2]):
    """Return {kind: (ratios, told, of smaller)}.

    They are the ratios that ``fitting.design`` states for a hold at 3 um, and the numbers of gels named rightly from a
    second hold at that ratio, and at the ratio ``smaller``.
    """

    def named(properties, k, *depths):
        holds = holds_of(properties, np.random.default_rng([seed, k]), depths=depths, points=points)
        return fitting.relaxation_cause(holds, indenter=BEAD)

    found = {}
    for kind in kinds:
        ratios, told, not_told = [], 0, 0
        for k in range(gels):
            properties = gel(kind, np.random.default_rng([seed, KINDS.index(kind), k]))
            ratios.append(fitting.design(named(properties, k, 3e-6)).ratio)
            told += np.isfinite(ratios[-1]) and named(properties, k, 3e-6, 3e-6 * ratios[-1]).cause == kind
            not_told += named(properties, k, 3e-6, 3e-6 * smaller).cause == kind
        found[kind] = ratios, told, not_told
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gels", type=int, default=20)
    parser.add_argument("--coverage", type=int, default=0)
    parser.add_argument("--design", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS)
    parser.add_argument("--single", action="store_true", help="also from the smaller depth alone")
    parser.add_argument("--points", type=int, default=500, help="of a hold")
    parser.add_argument("--same", action="store_true", help="with same_modulus=True")
    parser.add_argument("--verbose", action="store_true")
    options = parser.parse_args()
    if options.design:
        for kind, (ratios, told, smaller) in designs(options.design, options.seed, options.points).items():
            print(f"{kind}: ratios {ratios}; named from it {told}, from 1.2 {smaller}, of {options.design}")
    elif options.coverage:
        coverage(options.coverage, options.seed + 1)
    else:
        causes(
            options.gels,
            options.seed,
            options.single,
            options.verbose,
            options.same,
            options.points,
            options.kinds,
        )
