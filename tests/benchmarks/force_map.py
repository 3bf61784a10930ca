"""A map of 16,384 simulated force curves: time, memory, coverage, wrong verdicts, and agreement with ``fit_force``.

    python -m tests.benchmarks.force_map [COUNT [COMPARED]]

Run it with an empty JAX_COMPILATION_CACHE_DIR to include the compilation, which is then stated to be included. The machine,
its cores and its load are printed with the times; the processor time tells what a machine without other work needs.
"""

import os
import platform
import resource
import sys
import time

import numpy as np

import fitting
import jaxcontact as jc
from tests.support.maps_of_curves import RADIUS, simulated


def main(count=16384, compared=200):
    depth, load, times, E, touch, kinds = simulated(count)
    ball = jc.Sphere(radius=RADIUS)
    print(
        f"{count} curves of up to {depth.shape[1]} points; {platform.platform()}, {cpu()}, {os.cpu_count()} cores,"
    )
    print(
        f"load before: {os.getloadavg()[0]:.1f}; compilation cache: {os.environ.get('JAX_COMPILATION_CACHE_DIR', 'none')}"
    )
    wall, processor = time.perf_counter(), time.process_time()
    found = fitting.fit_map(depth, load, times, indenter=ball)
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"wall time {wall:.1f} s, processor time {processor:.1f} s (half: {0.5 * processor:.1f} s on two free cores),"
          f" load after: {os.getloadavg()[0]:.1f}, largest memory {memory:.2f} GB")  # fmt: skip
    good, accepted = kinds == "good", found.accepted
    both = good & accepted
    low, high = found.youngs_interval.T
    print(
        f"coverage of the moduli of accepted good curves: {100 * np.mean((low < E)[both] & (high > E)[both]):.2f} %"
    )
    low, high = found.contact_interval.T
    print(
        f"coverage of their contact points: {100 * np.mean((low < touch)[both] & (high > touch)[both]):.2f} %"
    )
    print(f"good curves rejected: {np.sum(good & ~accepted)} of {good.sum()}")
    for kind in sorted(set(kinds) - {"good"}):
        print(f"{kind}: {np.sum(accepted & (kinds == kind))} of {np.sum(kinds == kind)} accepted")
    print(f"bad curves accepted: {np.sum(accepted & ~good)} of {np.sum(~good)}")
    if compared:
        against_fit_force(found, depth, load, times, ball, kinds, compared)


def against_fit_force(found, depth, load, times, ball, kinds, compared):
    """Print the largest differences to ``fit_force`` on good and bad curves in equal parts."""
    rng = np.random.default_rng(1)
    some = [rng.choice(np.flatnonzero(which), min(compared // 2, which.sum()), replace=False)
            for which in (kinds == "good", kinds != "good")]  # fmt: skip
    modulus, width, other = [], [], []
    for k in np.concatenate(some):
        on = np.isfinite(depth[k])
        data = fitting.IndentationData(
            t=times[k, on], load=load[k, on], depth=depth[k, on], marks=np.full(on.sum(), "approach")
        )
        try:
            fit = fitting.fit_force(data, indenter=ball)
        except ValueError:
            other += [] if found.verdict[k] == "failed" else [k]
            continue
        if fit.verdict != found.verdict[k]:
            other.append(k)
        elif fit.verdict == "accepted":
            value, low, high = fit.youngs_modulus
            own = found.youngs_interval[k]
            modulus.append(found.youngs_modulus[k] / value - 1.0)
            width.append(np.log(own[1] / own[0]) / np.log(high / low))
    count = sum(one.size for one in some)
    print(f"against fit_force on {count} curves, {len(modulus)} accepted by both: moduli differ by up to"
          f" {np.max(np.abs(modulus)):.1e}, widths of intervals are {np.min(width):.3f} to {np.max(width):.3f} times its,"
          f" other verdicts: {len(other)} {[(int(k), kinds[k]) for k in other]}")  # fmt: skip


def cpu():
    """Return the name of the processor."""
    try:
        with open("/proc/cpuinfo") as file:
            return next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
