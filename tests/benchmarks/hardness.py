"""A rough surface of given hardness, side by side with the saturated pressure of Tamaas.

    python -m tests.benchmarks.hardness --peer PYTHON [--cells 64 128 256]

PYTHON is an interpreter in which Tamaas is installed, by default this one. Both codes press a self-affine surface, periodic
along both axes, on a half-space, with 0 <= p <= H at every point and the same mean pressure. Both take the displacement from
the same Fourier series (2 p/(E* k) for every wave of the grid), so that their fields are equal but for the solvers'
tolerances. The columns are the shares of the cells in contact and at the hardness by either code, the number of cells on
which the two disagree, the largest difference of the pressure over H, and that of the dent over its largest value (by Tamaas
it is the overlap of the elastic surfaces).
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import jaxcontact as jc

E_STAR, HARDNESS, MEAN = 1e9, 60e6, 12e6
PEER = """
import sys, numpy as np, tamaas
given = np.load(sys.argv[1])
n = given["heights"].shape[0]
# its steps of steepest descent need a response of the order of one: E* = 2 and waves of 2 pi
length, modulus = float(given["width"]) / (2 * np.pi), float(given["E_star"]) / 2
model = tamaas.Model(tamaas.model_type.basic_2d, [2 * np.pi] * 2, [n, n])
model.E, model.nu = 2.0, 0.0
solver = tamaas.KatoSaturated(model, given["heights"] / length, 1e-12, float(given["hardness"]) / modulus)
solver.max_iter = 20_000
solver.solve(float(given["mean"]) / modulus)
model.solveNeumann()
np.savez(sys.argv[2], pressure=modulus * np.array(model.traction), displacement=length * np.array(model.displacement))
"""


def by_tamaas(python: str, heights: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray] | str:
    """Return pressure [Pa] and displacement [m] (n, n) of Tamaas, or why there are none."""
    with tempfile.TemporaryDirectory() as folder:
        given, found = (str(Path(folder, name)) for name in ("given.npz", "found.npz"))
        np.savez(given, heights=heights, width=width, E_star=E_STAR, hardness=HARDNESS, mean=MEAN)
        done = subprocess.run([python, "-c", PEER, given, found], capture_output=True, text=True, check=False)
        if done.returncode:
            return done.stderr.strip().splitlines()[-1]
        with np.load(found) as fields:
            return fields["pressure"], fields["displacement"]


def row(n: int, python: str) -> str:
    """Return a line of the table for a grid of n x n cells over the same width."""
    width = 64e-6
    grid = jc.Grid((n, n), (width / n, width / n), periodic=True)
    heights = np.asarray(jc.self_affine(grid, hurst=0.8, rms_slope=0.1, shortest=8e-6, longest=32e-6, seed=0))
    theirs = by_tamaas(python, heights, width)
    if isinstance(theirs, str):
        return f"skipped: {theirs}"
    body = jc.LayeredHalfSpace([], jc.Elastic(G=0.5 * E_STAR, nu=0.0))
    ours = jc.indent(
        body, jc.HeightField(heights), jc.Load(MEAN * width**2), [0.0], grid=grid, hardness=HARDNESS, tolerance=1e-12,
        max_iterations=5000,
    )  # fmt: skip
    if int(ours.status[0]):
        return f"| {n} | status {int(ours.status[0])} |"
    p, q = np.asarray(ours.pressure[0]), theirs[0]
    # what the elastic surfaces overlap, beyond the gap of the cells that touch below the hardness, is the dent
    overlap = heights - theirs[1]
    elastic = (q > 0.0) & (q < (1.0 - 1e-9) * HARDNESS)
    dent = np.where(q >= (1.0 - 1e-9) * HARDNESS, overlap - overlap[elastic].mean(), 0.0)
    cells = [(np.mean(x > 0.0), np.mean(x >= (1.0 - 1e-9) * HARDNESS)) for x in (p, q)]
    other = np.sum((p > 0.0) != (q > 0.0))
    deepest = float(np.max(ours.dent))
    shares = ", ".join(f"{100 * a:.3f} and {100 * b:.3f}" for a, b in cells)
    return (
        f"| {n} | {shares} | {other} | {np.max(np.abs(p - q)) / HARDNESS:.1e}"
        f" | {np.max(np.abs(dent - np.asarray(ours.dent[0]))) / deepest:.1e} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peer", default=sys.executable)
    parser.add_argument("--cells", type=int, nargs="+", default=(64, 128, 256))
    asked = parser.parse_args()
    print(
        "| cells | touching and at hardness, ours and theirs [%] | other cells | pressure | dent |\n|---|---|---|---|---|"
    )
    for n in asked.cells:
        print(row(n, asked.peer), flush=True)


if __name__ == "__main__":
    main()
