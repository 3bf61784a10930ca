"""A map of 16,384 simulated force curves: time, memory, coverage, wrong verdicts, and agreement with ``fit_force``.

    python -m tests.benchmarks.force_map [COUNT [COMPARED]]
    python -m tests.benchmarks.force_map --adhesive [COUNT [COMPARED]]

With ``--adhesive`` the curves have an approach and a retraction with adhesion (JKR), 1024 unless COUNT is given, and are
compared with ``fit_indentation``.

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
from fitting.fits.force_map import data_of
from tests.support.maps_of_curves import RADIUS, adhesive, simulated


def main(count=16384, compared=200, *, jkr=False):
    if jkr:
        depth, load, times, E, work, touch, kinds = adhesive(count)
    else:
        depth, load, times, E, touch, kinds = simulated(count)
    ball = jc.Sphere(radius=RADIUS)
    print(
        f"{count} curves of up to {depth.shape[1]} points; {platform.platform()}, {cpu()}, {os.cpu_count()} cores,"
    )
    print(
        f"load before: {os.getloadavg()[0]:.1f}; compilation cache: {os.environ.get('JAX_COMPILATION_CACHE_DIR', 'none')}"
    )
    wall, processor = time.perf_counter(), used()
    found = fitting.fit_map(depth, load, times, indenter=ball, adhesion="JKR" if jkr else None)
    wall, processor = time.perf_counter() - wall, used() - processor
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"wall time {wall:.1f} s, processor time {processor:.1f} s (half: {0.5 * processor:.1f} s on two free cores),"
          f" load after: {os.getloadavg()[0]:.1f}, largest memory {memory:.2f} GB")  # fmt: skip
    good, accepted = kinds == "good", found.accepted
    both = good & accepted
    truths = {"moduli": (found.intervals["G"], E / 4.0 if jkr else E / 3.0)}  # nu = 0.5
    if jkr:
        truths["works of adhesion"] = found.intervals["work"], work
    truths["contact points"] = found.contact_interval, touch
    for name, (ends, truth) in truths.items():
        low, high = ends.T
        inside = np.mean((low < truth)[both] & (high > truth)[both])
        print(f"coverage of the {name} of accepted good curves: {100 * inside:.2f} %")
    print(f"good curves rejected: {np.sum(good & ~accepted)} of {good.sum()}")
    for kind in sorted(set(kinds) - {"good"}):
        print(f"{kind}: {np.sum(accepted & (kinds == kind))} of {np.sum(kinds == kind)} accepted")
    print(f"bad curves accepted: {np.sum(accepted & ~good)} of {np.sum(~good)}")
    if compared:
        against_single_fits(found, data_of(depth, load, times), ball, kinds, compared)


def used():
    """Return the processor time [s] of this process and of those that it has waited for."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def against_single_fits(found, curves, ball, kinds, compared):
    """Print the largest differences to ``fit_force``, or with adhesion ``fit_indentation``, on good and bad curves in equal
    parts."""
    rng = np.random.default_rng(1)
    some = [rng.choice(np.flatnonzero(which), min(compared // 2, which.sum()), replace=False)
            for which in (kinds == "good", kinds != "good")]  # fmt: skip
    names = list(found.values)
    differences, widths, other = {name: [] for name in names}, {name: [] for name in names}, []
    for k in np.concatenate(some):
        try:
            if found.adhesion:
                fit = fitting.fit_indentation(
                    curves[k], jc.Elastic, control="depth", adhesion="JKR", contact_point="fit", indenter=ball, nu=0.5
                )  # fmt: skip
            else:
                fit = fitting.fit_force(curves[k], indenter=ball)
        except ValueError:
            other += [] if found.verdict[k] == "failed" else [k]
            continue
        if fit.verdict != found.verdict[k]:
            other.append(k)
        elif fit.verdict == "accepted":
            for name in names:
                differences[name].append(found.values[name][k] / fit.values[name] - 1.0)
                own, (low, high) = found.intervals[name][k], fit.intervals[name]
                widths[name].append(np.log(own[1] / own[0]) / np.log(high / low))
    count = sum(one.size for one in some)
    for name in names:
        width = np.sort(widths[name])
        print(f"{name} against single fits of {count} curves, {width.size} accepted by both: differs by up to"
              f" {np.max(np.abs(differences[name])):.1e}, widths of intervals are {width[0]:.3f} to {width[-1]:.3f} times,"
              f" {np.sum(np.abs(width - 1.0) > 0.1)} of them by more than 10 % different")  # fmt: skip
    print(f"other verdicts: {len(other)} {[(int(k), kinds[k]) for k in other]}")


def cpu():
    """Return the name of the processor."""
    try:
        with open("/proc/cpuinfo") as file:
            return next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()


if __name__ == "__main__":
    jkr, *numbers = sys.argv[1:] if sys.argv[1:2] == ["--adhesive"] else ["", *sys.argv[1:]]
    main(*map(int, numbers or ([1024] if jkr else [])), jkr=bool(jkr))
