"""Two hundred random contacts with friction, and their residuals by code that shares nothing with the solver.

    python -m tests.benchmarks.friction_problems [--cells N ...] [--only NUMBER ...]

Balls and rough balls on half-spaces, on elastic films and on films that creep; moduli in ratios from 1e-2 to 1e3, Poisson's
ratios from 0 to 0.49, coefficients of friction from 0.05 to 1; histories of six steps in which the load changes and the
tangential force or displacement turns and reverses, from a tenth of what makes all cells slip to a hundred times that.

On half-spaces the displacements are those of rectangles under uniform tractions in closed form (A. E. H. Love, Phil.
Trans. R. Soc. A 228 (1929) 377; K. L. Johnson, Contact Mechanics, eqs. 3.18 and 3.75), summed by an FFT of numpy. On
films the slip and the gap of the result are taken as they are.
"""

import argparse
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import jaxcontact as jc

STEPS = 6
RADIUS = 5e-3
CONTROLS = [
    (normal, tangential) for normal in ("load", "approach") for tangential in ("force", "displacement")
]
HALF_SPACE, FILM, CREEPING_FILM = "half-space", "film", "creeping film"
ITERATIONS = 300  # more are none of a solver that converges
RESIDUAL = 1e-7  # as measured by the functions below; the solver's own tolerance is 1e-8
CLASSES = [
    *[(body, 32, control, 12) for body in (HALF_SPACE, FILM, CREEPING_FILM) for control in CONTROLS],
    *[(HALF_SPACE, 48, control, 7) for control in CONTROLS],
    (FILM, 64, CONTROLS[0], 8),
    (CREEPING_FILM, 64, CONTROLS[1], 8),
    (HALF_SPACE, 128, CONTROLS[0], 8),
    (HALF_SPACE, 256, CONTROLS[0], 4),
]  # fmt: skip


class FrictionProblem(NamedTuple):
    """A call of ``jc.shear``, with what its residuals need: the names of its class and the elastic constants.

    sheared: G and nu of body and indenter; depth [m]: a displacement of the size of the approach.
    """

    number: int
    name: str
    body: jc.LayeredHalfSpace
    indenter: jc.HeightField
    normal: jc.Load | jc.Approach
    tangential: jc.TangentialLoad | jc.TangentialDisplacement
    friction: float
    grid: jc.Grid
    constants: tuple[tuple[float, float], tuple[float, float]]
    depth: float

    def run(self, **options: object) -> jc.ShearHistory:
        """Solve it."""
        times = np.arange(float(STEPS))
        arguments = self.body, self.indenter, self.normal, self.tangential, times
        return jc.shear(*arguments, friction=self.friction, grid=self.grid, **options)


def problems() -> Iterator[FrictionProblem]:
    """All two hundred, the same in each run."""
    number = 0
    for body, n, control, count in CLASSES:
        for _ in range(count):
            yield problem(number, body, n, control)
            number += 1


def problem(number: int, body: str, n: int, control: tuple[str, str]) -> FrictionProblem:
    """One of a class, drawn by its number."""
    rng = np.random.default_rng(number)
    log_uniform = lambda low, high: float(np.exp(rng.uniform(np.log(low), np.log(high))))
    young, nu = log_uniform(1e8, 3e11), rng.uniform(0.0, 0.49)
    ratio, nu_indenter = log_uniform(1e-2, 1e3), rng.uniform(0.0, 0.49)
    friction = log_uniform(0.05, 1.0)
    width = 400e-6
    a = width / 2.0 * rng.uniform(0.35, 0.75)
    depth = a**2 / RADIUS
    contrast, thickness, nu_film = log_uniform(1e-2, 10.0), a * log_uniform(0.1, 2.0), rng.uniform(0.0, 0.48)
    grid = jc.Grid.square(n, width)
    heights = _heights(rng, grid, depth)
    material, other = jc.Elastic.from_young(young, nu), jc.Elastic.from_young(ratio * young, nu_indenter)
    layers = _layers(body, rng, contrast * young, nu_film, thickness)
    softest = young * (min(1.0, contrast) if layers else 1.0)
    modulus = 1.0 / ((1 - nu**2) / softest + (1 - nu_indenter**2) / (ratio * young))
    load = 4.0 / 3.0 * modulus * a**3 / RADIUS
    level = np.where(rng.uniform(size=STEPS) < 0.5, 1.0, rng.uniform(0.5, 1.0, STEPS))
    way = _way(rng)
    if control[1] == "force":
        share = rng.uniform(0.1, 0.97) if control[0] == "load" else rng.uniform(0.05, 0.4)
        tangential = jc.TangentialLoad(share * friction * load * level[:, None] * way)
    else:
        tangential = jc.TangentialDisplacement(log_uniform(0.1, 100.0) * friction * depth * way)
    return FrictionProblem(
        number=number,
        name=f"{body} {n} {control[0]} {control[1]}",
        body=jc.LayeredHalfSpace(layers, substrate=material),
        indenter=jc.HeightField(heights, other),
        normal=jc.Load(load * level) if control[0] == "load" else jc.Approach(depth * level),
        tangential=tangential,
        friction=friction,
        grid=grid,
        constants=((young / (2 + 2 * nu), nu), (ratio * young / (2 + 2 * nu_indenter), nu_indenter)),
        depth=depth,
    )


def _heights(rng: np.random.Generator, grid: jc.Grid, depth: float) -> np.ndarray:
    """Those of the ball, half of the time with waves of up to half its depth of contact."""
    x, y = (np.asarray(c) for c in grid.coordinates())
    heights = -(x**2 + y**2) / (2 * RADIUS) * np.ones(grid.shape)
    if rng.uniform() < 0.5:
        for _ in range(12):
            wavelength, angle, phase = rng.uniform(30e-6, 150e-6), *rng.uniform(0.0, 2 * np.pi, 2)
            along = x * np.cos(angle) + y * np.sin(angle)
            amplitude = rng.uniform(0.0, 0.15) * depth * wavelength / 150e-6
            heights = heights + amplitude * np.cos(2 * np.pi * along / wavelength + phase)
    return heights


def _layers(body: str, rng: np.random.Generator, young: float, nu: float, thickness: float) -> list[jc.Layer]:
    """None, an elastic one, or one whose shear modulus falls to a share of its first value over the steps."""
    share, tau = rng.uniform(0.1, 0.8), np.exp(rng.uniform(-1.0, 2.0))
    if body == HALF_SPACE:
        return []
    if body == FILM:
        return [jc.Layer(jc.Elastic.from_young(young, nu), thickness)]
    G1 = young / (2 + 2 * nu)
    G2 = G1 * share / (1 - share)
    return [jc.Layer(jc.StandardLinearSolid(G1=G1, G2=G2, eta2=G2 * tau, nu=nu), thickness)]


def _way(rng: np.random.Generator) -> np.ndarray:
    """Positions, (STEPS, 2) of length up to one: there and back along a line, with turns."""
    angle = rng.uniform(0.0, 2 * np.pi) + np.cumsum(rng.choice([0.0, 0.0, 0.3, np.pi / 2], STEPS))
    size = rng.uniform(0.2, 1.0, STEPS) * rng.choice([1.0, 1.0, -1.0], STEPS)
    size[0] *= rng.integers(0, 2)
    return size[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)


def rectangle(dx: float, dy: float, n: int) -> dict[str, np.ndarray]:
    """Integrals over a rectangle of 1/r, x^2/r^3, y^2/r^3, xy/r^3, x/r^2, y/r^2, at offsets from -(n - 1) to n - 1."""
    x, y = np.meshgrid((np.arange(2 * n) - n + 0.5) * dx, (np.arange(2 * n) - n + 0.5) * dy, indexing="ij")
    r = np.hypot(x, y)
    yy, xx = x * np.arcsinh(y / np.abs(x)), y * np.arcsinh(x / np.abs(y))
    corners = {"r": xx + yy, "xx": xx, "yy": yy, "xy": -r}
    corners |= {"x": y * np.log(r) + x * np.arctan(y / x), "y": x * np.log(r) + y * np.arctan(x / y)}
    return {name: np.diff(np.diff(f, axis=0), axis=1) for name, f in corners.items()}


def applied(kernel: np.ndarray, field: np.ndarray) -> np.ndarray:
    """The sum of a kernel (2 n - 1, 2 n - 1) over a field (n, n)."""
    n = len(field)
    size = (3 * n, 3 * n)
    full = np.fft.irfft2(np.fft.rfft2(kernel, size) * np.fft.rfft2(field, size), size)
    return full[n - 1 : 2 * n - 1, n - 1 : 2 * n - 1]


class ClosedForms:
    """Relative displacements of two half-spaces under tractions on the cells."""

    def __init__(self, problem: FrictionProblem) -> None:
        f = rectangle(*(float(s) for s in problem.grid.spacing), problem.grid.shape[0])
        over = lambda strength: sum(strength(G, nu) / (2 * np.pi * G) for G, nu in problem.constants)
        direct, turned = over(lambda G, nu: 1 - nu), over(lambda G, nu: nu)
        body, indenter = ((1 - 2 * nu) / (4 * np.pi * G) for G, nu in problem.constants)
        self.xx, self.yy = direct * f["r"] + turned * f["xx"], direct * f["r"] + turned * f["yy"]
        self.xy, self.zz = turned * f["xy"], direct * f["r"]
        self.x, self.y = (body - indenter) * f["x"], (body - indenter) * f["y"]

    def tangential(self, p: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Displacement along the surface, (2, nx, ny)."""
        x = applied(self.xx, q[0]) + applied(self.xy, q[1]) - applied(self.x, p)
        y = applied(self.xy, q[0]) + applied(self.yy, q[1]) - applied(self.y, p)
        return np.stack([x, y])

    def normal(self, p: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Displacement of the surfaces away from each other, (nx, ny)."""
        return applied(self.zz, p) + applied(self.x, q[0]) + applied(self.y, q[1])


class Residuals(NamedTuple):
    """The largest of all steps, of order of the tolerance where the laws hold.

    friction: mean distance from Coulomb's law, as a displacement over the coefficient of friction times the depth;
    contact: mean gap under pressure, and the largest penetration, over the depth; bound: the largest
    (|q| - mu p)/(mu p0); total: what is missing of the prescribed loads and displacements, in parts of their largest.
    """

    friction: float
    contact: float
    bound: float
    total: float


def residuals(problem: FrictionProblem, history: jc.ShearHistory, steps: list[int]) -> Residuals:
    """From the fields of a history at some of its steps."""
    p, q = np.asarray(history.pressure), np.asarray(history.traction)
    gaps, slips = np.asarray(history.gap), np.asarray(history.slip)
    closed = ClosedForms(problem) if problem.name.startswith(HALF_SPACE) else None
    if closed:
        gaps, slips = _by_closed_forms(problem, history, closed, p, q)
    each = [_residuals(problem, p[k], q[k], gaps[k], slips[k]) for k in steps]
    totals = [_total(problem, history, k) for k in steps]
    return Residuals(*np.max(each, 0), max(totals))


def _by_closed_forms(
    problem: FrictionProblem, history: jc.ShearHistory, closed: ClosedForms, p: np.ndarray, q: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gaps (nt, nx, ny) and slips (nt, 2, nx, ny)."""
    approach, way = np.asarray(history.approach), np.asarray(history.tangential_displacement)
    heights = np.asarray(problem.indenter.heights)
    pairs = list(zip(p, q, strict=True))
    sunk = np.stack([closed.normal(*pair) for pair in pairs])
    moved = np.stack([closed.tangential(*pair) for pair in pairs]) - way[:, :, None, None]
    slips = np.diff(moved, axis=0, prepend=0.0 * moved[:1])
    return sunk + np.max(heights) - heights - approach[:, None, None], slips


def _residuals(
    problem: FrictionProblem, p: np.ndarray, q: np.ndarray, gap: np.ndarray, slip: np.ndarray
) -> tuple[float, float, float]:
    mu, depth, bound = problem.friction, problem.depth, problem.friction * p
    if not np.any(p > 0.0):
        return 0.0, max(0.0, float(np.max(-gap))) / depth, float(np.max(np.abs(q)))
    stiffness = np.mean(bound[p > 0.0]) / (mu * depth)
    tried = q - stiffness * slip
    size = np.hypot(*tried)
    kept = tried * np.minimum(1.0, bound / np.where(size > 0.0, size, 1.0))
    wrong = np.sum(bound * np.hypot(*(q - kept))) / np.sum(bound) / stiffness / (mu * depth)
    penetration = np.max(np.where(p > 0.0, 0.0, -gap))
    contact = max(np.sum(p * np.abs(gap)) / np.sum(p), penetration) / depth
    return float(wrong), float(contact), float(np.max(np.hypot(*q) - bound) / np.max(bound))


def _total(problem: FrictionProblem, history: jc.ShearHistory, step: int) -> float:
    area = float(problem.grid.cell_area)
    forces = np.sum(np.asarray(history.traction)[step], (1, 2)) * area
    way, asked = np.asarray(history.tangential_displacement)[step], np.asarray(problem.tangential.value)
    found = forces if isinstance(problem.tangential, jc.TangentialLoad) else way
    tangential = np.max(np.abs(found - asked[step])) / np.max(np.abs(asked))
    load, given = np.sum(np.asarray(history.pressure)[step]) * area, np.asarray(problem.normal.value)
    found = load if isinstance(problem.normal, jc.Load) else float(history.approach[step])
    return float(max(tangential, abs(found - given[step]) / np.max(given)))


def report(chosen: list[FrictionProblem]) -> bool:
    """Print a line for each problem and the worst of all; whether all have converged."""
    lines, fine = [], True
    for each in chosen:
        begin = time.perf_counter()
        history = each.run()
        status, iterations = np.asarray(history.status), np.asarray(history.iterations)
        held = [k for k in range(STEPS) if status[k] != jc.Status.GROSS_SLIP]
        first = next((k for k in range(STEPS) if status[k] == jc.Status.GROSS_SLIP), STEPS)
        worst = residuals(each, history, [k for k in held if k < first])
        allowed = np.isin(status, (0, jc.Status.GROSS_SLIP, jc.Status.TOO_COARSE))
        # nothing determines its shift
        allowed |= (status == jc.Status.INHERITED) & (np.arange(STEPS) > first)
        good = bool(np.all(allowed))
        good &= bool(np.max(iterations[held], initial=0) <= ITERATIONS and max(worst) < RESIDUAL)
        lines.append((*worst, np.max(iterations[held], initial=0), np.mean(iterations)))
        fine &= good
        print(
            f"{each.number:4d} {each.name:38s} mu {each.friction:.3f} status {status} iterations {iterations} "
            + " ".join(f"{value:.1e}" for value in worst)
            + f" {time.perf_counter() - begin:.1f} s" + ("" if good else "  <--"),
            flush=True,
        )  # fmt: skip
    names = (*Residuals._fields, "iterations")
    print(
        "worst:",
        ", ".join(f"{name} {value:.2g}" for name, value in zip(names, np.max(lines, 0)[:5], strict=True)),
    )
    print("mean of the iterations:", np.mean(lines, 0)[5])
    return fine


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, nargs="*", help="only grids of so many cells along a side")
    parser.add_argument("--only", nargs="*", type=int, help="only problems of these numbers")
    asked = parser.parse_args()
    jc.enable_compilation_cache()
    chosen = [
        p
        for p in problems()
        if (not asked.cells or p.grid.shape[0] in asked.cells) and (not asked.only or p.number in asked.only)
    ]
    raise SystemExit(0 if report(chosen) else 1)
