"""Compute the numbers of the page explorer.html: 5120 runs of a ball on a coating that creeps, on steel.

    python docs/explorer/table.py          # about half an hour on two idle cores; it continues after an interruption

Ball, film and substrate are linear and the ball is a paraboloid. With lengths along the surface in units of the film
thickness h, approaches in h**2/R and pressures in G1 h/R, a run therefore depends on four numbers only: the load
W R/(G1 h**3), the stiffness G1/G of the film relative to steel, its softening G1/G2, and the ratio of its times of
flow, eta1/G1, and of delay, eta2/G2. The time is represented by the compliance G1 J(t), of which the results are smooth
functions. The shape of the pressure also depends on how fast the film creeps, and is kept at times in units of its delay.
The page interpolates with cubic polynomials over the logarithms of the inputs.
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

PAGE = Path(__file__).parents[2] / "jaxcontact" / "shell" / "playground" / "page"
STEEL = jc.Elastic.from_young(210e9, nu=0.3)
NU = 0.4  # of the film
FLOWN = (
    10.0  # the last time is that at which the flow is this multiple of the first strain
)
NODES, STEPS = 6, 10  # times in the table, and steps between them
CELLS = 63
RADIUS = 1e3  # of the ball, in film thicknesses; the results do not depend on it
AXES = {
    "load": np.geomspace(2.5e-3, 2.5e5, 16),
    "softening": np.geomspace(0.1, 10.0, 8),
    "flow": np.geomspace(1.0, 1e5, 8),
    "stiffness": np.geomspace(1e8, 1e10, 4) / float(STEEL.G),
}
QUANTITIES = ("approach", "contact_radius")
SHAPE_AXES = {
    "load": np.geomspace(2.5e-3, 2.5e5, 8),
    "softening": np.geomspace(0.1, 10.0, 4),
    "flow": np.geomspace(1.0, 1e5, 8),
    "stiffness": AXES["stiffness"],
}
SHAPE_TIMES = np.geomspace(1e-2, 1e3, 11)  # in units of the delay
SHAPE = np.array([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0])
"""The pressure over its mean is sqrt(1 - u) g(u), where u = (r/a)**2 and the cubic polynomial g has its values here."""


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
    history = jc.indent(
        body, ball, jc.Load(load), times, grid=grid, save="all", substeps=2
    )
    middle = history.pressure[:, grid.shape[0] // 2 :, grid.shape[1] // 2]
    return history.approach, history.contact_radius, middle, history.status


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Return the dimensionless results of one case, which has a value for each of AXES.

    approach and contact_radius: (NODES,), at the compliances of the table; shape (4, 11): g at SHAPE and SHAPE_TIMES.
    """
    softening, flow = case["softening"], case["flow"]
    G1 = case["stiffness"] * float(STEEL.G)
    film = jc.Burgers(
        G1=G1, G2=G1 / softening, eta1=G1 * flow, eta2=G1 / softening, nu=NU
    )
    body = jc.LayeredHalfSpace([jc.Layer(film, thickness=1.0)], substrate=STEEL)
    ball, load = jc.Sphere(radius=RADIUS, material=STEEL), case["load"] * G1 / RADIUS
    fine = np.geomspace(1.0, 1.0 + softening + FLOWN, STEPS * (NODES - 1) + 1)
    nodes = times_of(fine, softening, flow)
    last = nodes[-1]  # from there on the shape stays as it is
    between = (
        nodes[:11] + nodes[1:12]
    ) / 2.0  # one program for all cases: as many times in each
    times = np.union1d(nodes, np.where(last > SHAPE_TIMES, SHAPE_TIMES, between))
    grid = jc.Grid.around(body, ball, jc.Load(load), times, n=CELLS)
    inputs = jax.tree.map(np.float64, (body, ball, load, times))
    *results, status = map(np.asarray, compiled(*inputs, grid))
    if np.any(status):
        raise RuntimeError(jc.Status(int(np.max(status))).message)
    approach, radius, middle = results
    x, mean = grid.axes()[0][grid.shape[0] // 2 :], load / (np.pi * radius**2)
    at = np.searchsorted(times, nodes[::STEPS])
    at_shape = np.searchsorted(times, np.minimum(SHAPE_TIMES, last))
    return {
        "approach": approach[at] * RADIUS,
        "contact_radius": radius[at],
        "shape": np.transpose(
            [shape((x / radius[i]) ** 2, middle[i] / mean[i]) for i in at_shape]
        ),
    }


def shape(u: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Return g at SHAPE, of the cubic polynomial g of which sqrt(1 - u) g(u) fits a pressure best, with u = (r/a)**2."""
    inside = u < 0.98
    edge = np.sqrt(1.0 - u[inside])[:, None]
    powers = np.arange(4)
    best, *_ = np.linalg.lstsq(edge * u[inside, None] ** powers, pressure[inside])
    return SHAPE[:, None] ** powers @ best


def packed(values: np.ndarray, kind: str) -> dict[str, Any]:
    """Return an array as whole numbers of a kind, "<u2" or "u1", between the limits of its values."""
    low, high = float(values.min()), float(values.max())
    largest = np.iinfo(kind).max
    whole = np.round((values - low) / (high - low) * largest).astype(kind)
    return {
        "low": low,
        "high": high,
        "values": base64.b64encode(whole.tobytes()).decode(),
    }


def studied(axes: dict[str, np.ndarray], folder: Path) -> Any:
    """Return the study of all cases of some axes, or end with the failures."""
    cases = [
        dict(zip(axes, map(float, case), strict=True))
        for case in itertools.product(*axes.values())
    ]
    with ThreadPoolExecutor(os.cpu_count()) as threads:  # they share one compiled program
        study = jc.sweep(run, cases, folder, executor=threads)
    if study.failures:
        sys.exit(str(study))
    return study


def limits(axes: dict[str, np.ndarray]) -> dict[str, list[float]]:
    return {name: [float(a[0]), float(a[-1]), a.size] for name, a in axes.items()}


def main(folder: Path) -> None:
    results, shapes = (
        studied(axes, folder / name)
        for name, axes in {"results": AXES, "shapes": SHAPE_AXES}.items()
    )
    table = {
        "axes": limits(AXES),
        "flown": FLOWN,
        "nodes": NODES,
        "steel": float(STEEL.G),
        "quantities": {
            name: packed(np.log(results.stacked(name)), "<u2") for name in QUANTITIES
        },
        "shape": {
            "axes": limits(SHAPE_AXES),
            "times": limits({"": SHAPE_TIMES})[""],
            "values": [
                packed(g, "u1") for g in np.moveaxis(shapes.stacked("shape"), 1, 0)
            ],
        },
    }
    text = f"// Written by docs/explorer/table.py\nconst TABLE = {json.dumps(table)};\n"
    (PAGE / "numbers.js").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(
        Path(sys.argv[1])
        if sys.argv[1:]
        else Path(tempfile.gettempdir()) / "jaxcontact-explorer"
    )
