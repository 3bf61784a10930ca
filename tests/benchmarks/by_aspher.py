"""Elastic contacts by jaxcontact and by the modes of ASPHER in turn, in one process: a ball and a rough surface.

    python -m tests.benchmarks.by_aspher hertz 512               # on one core
    python -m tests.benchmarks.by_aspher rough 256 --cores 2

ASPHER (pip install aspher, which compiles it and needs Eigen) has to be importable. Both codes have a tolerance of 1e-8, in
their own measures, and the same loads. The times are minima of wall time [s], without the kernels of jaxcontact and without
the set-up of ``ContactSolver``; the nested mode of ASPHER is set up in each call. A line has the times of jaxcontact and of
the modes of ASPHER, the ratio of the shortest of these to that of jaxcontact, and the largest difference of the pressures.
"""

import argparse
import json
import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import jaxcontact as jc
from jaxcontact._compile.programs import optimised_at_once

TOLERANCE = 1e-8
MODULUS = 1e9  # contact modulus E* [Pa]
SLOPE = 0.1  # root mean square of the slopes of the rough surface
ROUNDS = 2  # in which the codes take turns


def problem(kind: str, n: int) -> tuple[jc.abc.Indenter, jc.Grid, np.ndarray, list[float]]:
    """Return the indenter, the grid, the gap [m] and the loads [N]."""
    if kind == "hertz":
        grid, ball, radius = jc.Grid.square(n, 1.0), jc.Sphere(1.0), 0.25
        return ball, grid, np.asarray(ball.profile(grid)), [4.0 / 3.0 * MODULUS * radius**3]
    width = n * 1e-6
    period = jc.Grid((n, n), (1e-6, 1e-6), periodic=True)
    heights = jc.self_affine(period, hurst=0.8, rms_slope=SLOPE, shortest=8e-6, longest=width / 4.0, seed=0)
    surface = jc.HeightField(heights)
    loads = [share * MODULUS * SLOPE * width**2 for share in (0.04, 0.16)]
    grid = jc.Grid.square(n, width)
    return surface, grid, np.asarray(surface.profile(grid)), loads


def least_time(call: Callable[[], Any], repeats: int) -> float:
    """Return the least time of some calls [s]."""
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - began)
    return min(seconds)


def row(kind: str, n: int, load_number: int) -> dict[str, Any]:
    """Return the figures of one load."""
    import aspher

    indenter, grid, gap, loads = problem(kind, n)
    body, load = jc.LayeredHalfSpace([], jc.Elastic(MODULUS / 4.0, 0.5)), loads[load_number]
    width = grid.width[0]
    given = {"grid": grid, "kernels": jc.kernels(body, indenter, grid), "tolerance": TOLERANCE}
    ours = lambda: np.asarray(jc.indent(body, indenter, jc.Load(load), [0.0], **given).pressure[0])

    solver = aspher.ContactSolver(n, float(width), MODULUS, backend="fft")
    flat, mean = np.ascontiguousarray((gap - gap.min()).ravel()), float(load / width**2)
    nested = {"domain_size": float(width), "E_star": MODULUS, "tol": TOLERANCE, "backend": "fft"}
    modes: dict[str, Callable[[], Any]] = {
        "fourier": lambda: solver.solve(flat, mean, tol=TOLERANCE, precond="fourier"),
        "fourier-fft": lambda: solver.solve(flat, mean, tol=TOLERANCE, precond="fourier-fft"),
        "nested": lambda: aspher.solve_nested(n, flat, mean, **nested, precision="float_then_double"),
    }

    pressure, repeats = ours(), max(3, int(40 * (256 / n) ** 2))
    seconds = {"ours": np.inf} | dict.fromkeys(modes, np.inf)
    for _ in range(ROUNDS):
        seconds["ours"] = min(seconds["ours"], least_time(ours, repeats))
        for name, call in modes.items():
            seconds[name] = min(seconds[name], least_time(call, max(1, repeats // 4)))
    best = min(modes, key=seconds.__getitem__)
    apart = np.abs(np.asarray(modes[best]().pressure).reshape(n, n) - pressure).max() / pressure.max()
    figures = {"in contact": np.mean(pressure > 0.0), **seconds}
    figures |= {"ratio": seconds[best] / seconds["ours"], "difference": apart}
    return {"problem": kind, "cells": n} | {name: float(f"{value:.3g}") for name, value in figures.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description="Time jaxcontact and ASPHER in one process.")
    parser.add_argument("kind", choices=["hertz", "rough"])
    parser.add_argument("cells", type=int)
    parser.add_argument("--cores", type=int, default=1)
    given = parser.parse_args()
    # before either code makes its threads
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: given.cores])
    os.environ["OMP_NUM_THREADS"] = str(given.cores)
    with optimised_at_once():
        for load_number in range(1 if given.kind == "hertz" else 2):
            print(json.dumps(row(given.kind, given.cells, load_number)), flush=True)


if __name__ == "__main__":
    main()
