"""What a second process brings to a sweep: wall time of many small cases on one and on two processes.

    python -m tests.benchmarks.bench_sweep [CASES]

Each case is a creeping film of 64 x 64 cells and 31 times. Programs are in the store before; the start of the processes
is in the times.
"""

import sys
import tempfile
import time
import warnings

import loky
import numpy as np

import jaxcontact as jc
from tests.benchmarks.problems import BALL, FILM, STEEL, WIDTH


def creep(case: dict) -> dict:
    """The approach of the paper's ball on a film, of a thickness and under a load."""
    warnings.simplefilter("ignore")  # that the film is shortened by more than its thickness
    body = jc.LayeredHalfSpace([jc.Layer(FILM, thickness=case["thickness"])], substrate=STEEL)
    times, grid = np.linspace(0.0, 7200.0, 31), jc.Grid.square(64, WIDTH)
    history = jc.indent(body, BALL, jc.Load(case["load"]), times, grid=grid)
    return {"approach": history.approach}


def seconds(cases: list[dict], processes: int) -> float:
    """Of a sweep from processes that have to be started."""
    loky.get_reusable_executor().shutdown(kill_workers=True)
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        study = jc.sweep(creep, cases, folder, processes=processes)
        assert not study.failures
        return time.perf_counter() - start


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    thicknesses = np.geomspace(50e-9, 500e-9, count).tolist()
    cases = [
        {"thickness": thickness, "load": load}
        for thickness, load in zip(thicknesses, np.linspace(20.0, 60.0, count).tolist(), strict=True)
    ]
    seconds(cases[:2], 2)
    one, two = seconds(cases, 1), seconds(cases, 2)
    print(f"{count} cases: {one:.1f} s on one process, {two:.1f} s on two: {one / two:.2f} times as fast")
