"""Compute the table of the page explorer.html: 4096 runs of a ball on a coating that creeps, on steel.

    python docs/explorer/table.py          # about ten minutes on two idle cores; it continues after an interruption

Ball, film and substrate are linear and the ball is a paraboloid. With lengths along the surface in units of the film
thickness h, approaches in h**2/R and pressures in G1 h/R, a run therefore depends on four numbers only: the load
W R/(G1 h**3), the stiffness G1/G of the film relative to steel, its softening G1/G2, and the ratio of its times of
flow, eta1/G1, and of delay, eta2/G2. The time is represented by the compliance G1 J(t), of which the results are smooth
functions. The page interpolates the logarithms of the results with cubic polynomials over the logarithms of the inputs.
"""

import base64
import itertools
import json
import os
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

os.environ.setdefault("NPROC", "1")  # one thread of XLA for each case; read by jax

import jax
import jaxcontact as jc
import numpy as np
from scipy.optimize import brentq

PAGE = Path(__file__).with_name("page")
STEEL = jc.Elastic.from_young(210e9, nu=0.3)
NU = 0.4  # of the film
FLOWN = (
    10.0  # the last time is that at which the flow is this multiple of the first strain
)
NODES, STEPS = 6, 5  # times in the table, and steps between them
CELLS = 63
RADIUS = 1e3  # of the ball, in film thicknesses; the results do not depend on it
AXES = {
    "load": np.geomspace(2.5e-3, 2.5e5, 16),
    "softening": np.geomspace(0.1, 10.0, 8),
    "flow": np.geomspace(1.0, 1e5, 8),
    "stiffness": np.geomspace(1e8, 1e10, 4) / float(STEEL.G),
}
QUANTITIES = ("approach", "contact_radius")


def compliance(t: Any, softening: float, flow: float) -> Any:
    """Return G1 J(t) of the film, for a time in units of its delay."""
    return 1.0 - softening * np.expm1(-t) + t / flow


def times_of(values: np.ndarray, softening: float, flow: float) -> np.ndarray:
    """Return the times at which G1 J has given values, the first of which is 1."""
    longest = flow * values[-1]
    later = [
        brentq(lambda t, J=J: compliance(t, softening, flow) - J, 0.0, longest)
        for J in values[1:]
    ]
    return np.array([0.0, *later])


@jax.jit
def compiled(body: Any, ball: Any, load: Any, times: Any, grid: Any) -> tuple:
    history = jc.indent(body, ball, jc.Load(load), times, grid=grid, save="last")
    return history.approach, history.contact_radius, history.status


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Return the dimensionless results (NODES,) of one case, a value for each of AXES."""
    softening, flow = case["softening"], case["flow"]
    G1 = case["stiffness"] * float(STEEL.G)
    film = jc.Burgers(
        G1=G1, G2=G1 / softening, eta1=G1 * flow, eta2=G1 / softening, nu=NU
    )
    body = jc.LayeredHalfSpace([jc.Layer(film, thickness=1.0)], substrate=STEEL)
    ball, load = jc.Sphere(radius=RADIUS, material=STEEL), case["load"] * G1 / RADIUS
    fine = np.geomspace(1.0, 1.0 + softening + FLOWN, STEPS * (NODES - 1) + 1)
    times = times_of(fine, softening, flow)
    grid = jc.Grid.around(body, ball, jc.Load(load), times, n=CELLS)
    approach, radius, status = compiled(
        *jax.tree.map(np.float64, (body, ball, load, times)), grid
    )
    if np.any(status):
        raise RuntimeError(jc.Status(int(np.max(status))).message)
    scaled = approach * RADIUS, radius
    return {
        name: np.asarray(values)[::STEPS]
        for name, values in zip(QUANTITIES, scaled, strict=True)
    }


def packed(values: np.ndarray) -> dict[str, Any]:
    """Return the logarithms of an array as 16-bit numbers between their limits."""
    logs = np.log(values)
    low, high = float(logs.min()), float(logs.max())
    whole = np.round((logs - low) / (high - low) * 65535).astype("<u2")
    return {
        "low": low,
        "high": high,
        "values": base64.b64encode(whole.tobytes()).decode(),
    }


def main(folder: str) -> None:
    names, values = zip(*AXES.items(), strict=True)
    cases = [
        dict(zip(names, map(float, case), strict=True))
        for case in itertools.product(*values)
    ]
    with ThreadPoolExecutor(os.cpu_count()) as threads:  # they share one compiled program
        study = jc.sweep(run, cases, folder, executor=threads)
    if study.failures:
        sys.exit(str(study))
    table = {
        "axes": {name: [float(a[0]), float(a[-1]), a.size] for name, a in AXES.items()},
        "flown": FLOWN,
        "nodes": NODES,
        "steel": float(STEEL.G),
        "quantities": {name: packed(study.stacked(name)) for name in QUANTITIES},
    }
    text = f"// Written by docs/explorer/table.py\nconst TABLE = {json.dumps(table)};\n"
    (PAGE / "table.js").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(
        sys.argv[1]
        if sys.argv[1:]
        else str(Path(tempfile.gettempdir()) / "jaxcontact-explorer")
    )
