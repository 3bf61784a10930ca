"""Coordinates, residuals and starting values of the search for the parameters of a body from fields of its contact.

The coordinates are the logarithms of the parameters, and the nuisance parameters of the instrument over their units. The
sum of squares can have several minima. It is therefore evaluated first at quasi-random points within a factor of
exp(``SCAN``) about the start, on a grid with half the cells along each axis; local searches begin at the start and at the
best of these points. The optimum is accepted if at least two searches end there; where the first ones do not agree, two
more begin at both sides of the best optimum. On the grid of the model the slope of the sum of squares changes wherever a
cell enters the contact, so that it has several local minima within the error of the grid. Two optima are therefore the
same if they differ by no more than this error and the noise allow. Optima of the same sum of squares at other parameters
lead to rejection.

The images of pressure, gap and displacement at the best optimum are corrected for the error of the grid
(``field_grids.py``), and the search goes on with the corrected images. Contact images are not corrected: the error of their
edge is not a smooth function of the size of the cells, and a correction would be uneven along the edge.
"""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from fitting.data.fields import ContactData
from fitting.fits.field_grids import Finer, coarser, finer
from fitting.inference import pixels
from fitting.inference.evidence import Sample
from fitting.models.imaging import View
from fitting.models.pressing import PressedImages
from fitting.models.search_space import ParameterSpace
from fitting.models.structure import Sought
from fitting.search import nonlinear
from fitting.search.nonlinear import Best, Objective
from fitting.search.uncertainty import inverse

RANGE = 7.0  # e-folds about the start within which a parameter is sought
TURNS = 3  # of estimating the noise
MARGIN = 3  # cells at the edge of the model's grid that are not compared
ALIGN = {"none": (), "shift": ("shift_x", "shift_y"), "shift and rotation": ("shift_x", "shift_y", "angle")}
START = {"shift_x": 0.0, "shift_y": 0.0, "angle": 0.0, "blur": 1.0, "width": 0.7, "errors": 0.02}
BOX = {
    "shift_x": (-math.inf, math.inf), "shift_y": (-math.inf, math.inf), "angle": (-0.25 * math.pi, 0.25 * math.pi),
    "blur": (0.0, 50.0), "width": (0.02, 50.0), "errors": (1e-4, 0.4),
}  # fmt: skip
SCAN = 3.0  # e-folds about the start over which the sum of squares is evaluated first
POINTS = 8  # number of these points for one parameter; doubled for each further one, up to four times as many
SEARCHES = 3  # local searches from the best of these points, besides that from the start
BESIDE = 0.4  # log parameters between the best optimum and the starts beside it
SURE = 2.0  # standard deviations by which noise may move a log parameter
EQUAL = 1e-4  # relative difference of sums of squares of equally good optima
APART = 0.2  # distance in log parameters below which two starting values are the same


@dataclasses.dataclass
class FieldSearch:
    """The search of a fit: coordinates theta are log parameters (k,), then nuisance parameters over their units (q,)."""

    data: ContactData
    sought: Sought
    pressing: PressedImages
    coarse: tuple[PressedImages, ...]
    finer: tuple[Finer, ...]
    nuisances: tuple[str, ...]
    units: np.ndarray
    blur: float
    start: np.ndarray
    space: ParameterSpace
    noise: str
    scale: dict[str, float]
    known: dict[str, np.ndarray]
    blocks: dict[str, pixels.Blocks]
    errors: tuple[dict[str, np.ndarray], ...] = ()

    @classmethod
    def of(
        cls, data: ContactData, sought: Sought, parameters: Mapping[str, float], model: tuple[Any, Any, float],
        align: tuple[str, ...], blur: Any, noise: str,
    ) -> "FieldSearch":  # fmt: skip
        """Return the search from checked input."""
        indenter, grid, tolerance = model
        contact = ("width", "errors") if "contact" in data.fields else ()
        nuisances = (*align, *(("blur",) if blur == "fitted" else ()), *contact)
        pixel = float(data.grid.spacing[0])
        units = np.array([1.0 if name in ("angle", "errors") else pixel for name in nuisances])
        press = lambda indenter, own: PressedImages(
            sought.structure.model, tuple(parameters), (indenter, data.control, jnp.asarray(data.times)),
            tuple(data.fields), data.grid, own, tolerance,
        )  # fmt: skip
        known = {name: np.isfinite(field) & _within(data.grid, grid) for name, field in data.fields.items()}
        logs = np.array([math.log(np.clip(value, *sought.table[name])) for name, value in parameters.items()])
        return cls(
            data, sought, press(indenter, grid), coarser(press, indenter, grid), finer(press, indenter, grid), nuisances,
            units,
            0.0 if blur == "fitted" else float(blur),
            np.append(logs, [START[name] for name in nuisances]), _space(sought, logs, nuisances, units), noise,
            {name: float(np.nanmax(np.abs(field))) or 1.0 for name, field in data.fields.items()}, known,
            {name: pixels.Blocks.of(own, pixels.least_size(own)) for name, own in known.items()},
        )  # fmt: skip

    @property
    def k(self) -> int:
        """Number of parameters of the body."""
        return len(self.sought.structure.where)

    def view(self, theta: np.ndarray) -> View:
        """Return the nuisance parameters in SI."""
        own = {"shift_x": 0.0, "shift_y": 0.0, "angle": 0.0, "blur": self.blur, "width": 1.0, "errors": 0.0}
        own |= dict(zip(self.nuisances, theta[self.k :] * self.units, strict=True))
        one = lambda name: jnp.asarray(own[name], dtype=float)
        return View(jnp.stack([one("shift_x"), one("shift_y")]), *(one(name) for name in View._fields[1:]))

    def images(self, theta: np.ndarray, pressing: PressedImages | None = None) -> dict[str, np.ndarray]:
        """Return the corrected images of the model, or those on another grid."""
        images = (pressing or self.pressing).images(theta[: self.k], self.view(theta))
        if pressing is not None or not self.errors:
            return images
        mean = {name: np.mean([one[name] for one in self.errors], 0) for name in images if name != "contact"}
        return images | {name: images[name] + error for name, error in mean.items()}

    def vector(self, images: Mapping[str, Any]) -> np.ndarray:
        """Return block means (..., n) of all fields, in parts of their largest value."""
        means = [
            self.blocks[name].means(np.asarray(images[name])) / self.scale[name] for name in self.data.fields
        ]
        return np.concatenate(means, -1)

    def measured(self) -> np.ndarray:
        """Return the block means of the data, (n,)."""
        return self.vector(
            {name: np.where(own, self.data.fields[name], 0.0) for name, own in self.known.items()}
        )

    def slopes(self, theta: np.ndarray) -> np.ndarray:
        """Return the Jacobian (n, m) of ``vector(images(theta))``."""
        own, views = self.pressing.image_slopes(theta[: self.k], self.view(theta), self.nuisances)
        rows = [self.vector(own)]
        for name, unit in zip(self.nuisances, self.units, strict=True):
            rows.append(unit * self.vector({field: view[name] for field, view in views.items()})[None])
        return np.concatenate(rows).T

    def objective(self, weights: np.ndarray) -> Objective:
        """Return the least squares with weights (n,)."""
        measured = self.measured()
        return Objective(
            lambda theta: weights * (self.vector(self.images(theta)) - measured),
            lambda theta, free: (weights[:, None] * self.slopes(theta))[:, free],
            *self.space.bounds, ftol=1e-7,
        )  # fmt: skip

    def weights(self, theta: np.ndarray, first: bool = False) -> np.ndarray:
        """Return the reciprocal standard deviations (n,) that the residuals at theta show, or rather, at the first turn,
        differences of neighbours."""
        images, found = self.images(theta), []
        for name, field in self.data.fields.items():
            blocks = self.blocks[name]
            measured = blocks.means(np.where(self.known[name], field, 0.0)) / self.scale[name]
            fitted = blocks.means(images[name]) / self.scale[name]
            shape = self.shape(name, images[name])
            residual = np.diff(measured, append=measured[0]) / math.sqrt(2.0) if first else fitted - measured
            kind = (
                self.noise
                if name != "contact" and name not in (self.data.sigma or {}) and not first
                else "constant"
            )
            found.append(pixels.deviations(kind, residual, shape, fitted) * math.sqrt(blocks.inflation))
        return 1.0 / np.concatenate(found)

    def shape(self, name: str, image: np.ndarray) -> np.ndarray:
        """Return the standard deviations (n,) of block means up to a factor."""
        return np.sqrt(self.blocks[name].means(self.variance(name, image)))

    def variance(self, name: str, image: np.ndarray) -> np.ndarray:
        """Return the variances (nt, nx, ny) of pixels up to a factor."""
        if name == "contact":
            return np.maximum(image * (1.0 - image), 1e-5)
        return (self.data.sigma or {}).get(name, np.ones(image.shape)) ** 2

    def solve(self) -> tuple[Best, np.ndarray]:
        """Return the optimum and weights (n,) that agree with its residuals."""
        if not np.all(np.isfinite(self.vector(self.images(self.start)))):
            status = self.pressing.status(tuple(self.start[: self.k].tolist()))
            raise ValueError(f"parameters: expected a start that can be computed, got: {status.message}")
        first = self.weights(self.start, True)
        found = self.several(first, [self.start, *self.scanned(first)])
        best = found
        self.correct(best.theta)
        images = self.images(best.theta)
        for name, field in self.data.fields.items():
            residual = (images[name] - np.where(self.known[name], field, 0.0)) / np.sqrt(
                self.variance(name, images[name])
            )
            self.blocks[name] = pixels.chosen(residual, self.known[name])
        for _ in range(TURNS):
            weights = self.weights(best.theta)
            best = nonlinear.minimise(self.objective(weights), best.theta)
        # the correction and the weights have moved the other optima as well
        moved = [nonlinear.minimise(self.objective(weights), theta) for theta in found.others]
        others = self.different(best, moved, weights)
        return best._replace(starts=found.starts, agreed=found.agreed, others=others), weights

    def several(self, weights: np.ndarray, starts: list[np.ndarray]) -> Best:
        """Return the best of the optima from several starts, with those that differ from it as ``others``."""
        objective = self.objective(weights)
        found = [
            nonlinear.minimise(objective, start)
            for start in starts
            if np.all(np.isfinite(objective.at(start)))
        ]
        best = min(found, key=lambda one: one.rss)
        if sum(self.same(best, found, weights)) < 2:
            beside = np.where(np.arange(best.theta.size) < self.k, BESIDE, 0.0)
            found += [nonlinear.minimise(objective, best.theta + sign * beside) for sign in (-1.0, 1.0)]
            best = min(found, key=lambda one: one.rss)
        others = self.different(best, found, weights)
        return best._replace(starts=len(found), agreed=len(found) - len(others), others=others)

    def same(self, best: Best, found: list[Best], weights: np.ndarray) -> list[bool]:
        """Return whether each optimum lies within the noise and the error of the grid about the best one."""
        reach = SURE * self.deviations(best) + np.nan_to_num(self.coarse_change(best, weights)[: self.k])
        return [bool(np.all(np.abs(one.theta - best.theta)[: self.k] <= reach)) for one in found]

    def different(self, best: Best, found: list[Best], weights: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the coordinates (m,) of the optima that are not the best one."""
        same = self.same(best, found, weights)
        return tuple(one.theta for one, equal in zip(found, same, strict=True) if not equal)

    def deviations(self, best: Best) -> np.ndarray:
        """Return the standard deviations (k,) of the log parameters in the linearised model."""
        variance, free = np.zeros(best.theta.size), self.space.free
        scale = best.rss / max(best.residual.size - free.size, 1)
        variance[free] = scale * np.maximum(np.diag(inverse(best.jacobian)), 0.0)
        return np.sqrt(variance[: self.k])

    def scanned(self, weights: np.ndarray) -> list[np.ndarray]:
        """Return the best starting values among quasi-random points, at least ``APART`` from each other and the start."""
        free = self.space.free[self.space.free < self.k]
        if not free.size:
            return []
        from scipy.stats import qmc  # takes half a second to import

        count = POINTS * 2 ** min(free.size - 1, 2)
        unit = qmc.Sobol(free.size, scramble=False).random(count) + 0.5 / count
        points = np.tile(self.start, (count, 1))
        points[:, free] = np.clip(
            self.start[free] + SCAN * (2.0 * unit - 1.0), self.space.lower[free], self.space.upper[free]
        )
        measured, coarse = self.measured(), self.coarse[0]
        rss = [np.sum((weights * (self.vector(self.images(at, coarse)) - measured)) ** 2) for at in points]
        kept = [self.start]
        for i in np.argsort(rss):  # nan is last
            far = min(np.max(np.abs(points[i] - one)) for one in kept) > APART
            if np.isfinite(rss[i]) and far and len(kept) <= SEARCHES:
                kept.append(points[i])
        return kept[1:]

    def doubts(self, best: Best, rss: list[float]) -> tuple[str, ...]:
        """Return the reasons for rejecting an optimum, () if there are none; rss: of the other optima."""
        found = []
        if best.agreed < 2:
            found.append(
                f"only one of {best.starts} searches from different starting values ended at the best optimum: begin"
                " elsewhere, or narrow the bounds"
            )
        equal = [
            theta for theta, one in zip(best.others, rss, strict=True) if one <= best.rss * (1.0 + EQUAL)
        ]
        if equal:
            names = ", ".join(
                f"{name} = {math.exp(value):.4g}"
                for name, value in zip(self.sought.structure.where, equal[0][: self.k], strict=True)
            )
            found.append(f"other parameters describe the data as well: {names}")
        return tuple(found)

    def coarse_change(self, best: Best, weights: np.ndarray) -> np.ndarray:
        """Return the largest change (m,) of the coordinates between the grid and coarser ones; nan where one fails.

        The error of the edge of contact oscillates with its place among the cells, so that a single coarser grid may show
        none by chance. The widths of these grids therefore differ.
        """
        own = self.vector(self.images(best.theta))
        changes = (self.vector(self.images(best.theta, one)) - own for one in self.coarse)
        return np.max([np.abs(self.moved(best, weights * change)) for change in changes], axis=0)

    def moved(self, best: Best, change: np.ndarray) -> np.ndarray:
        """Return the change (m,) of the optimum with a change (n,) of the weighted residuals."""
        return nonlinear.moved(best, self.space.free, change)

    def correct(self, theta: np.ndarray) -> None:
        """Set the errors of the images at theta, as each finer grid has them; none if a solution fails."""
        own = self.images(theta, self.pressing)
        images = [self.images(theta, one.pressing) for one in self.finer]
        found = tuple(
            {name: (image[name] - own[name]) / (1.0 - one.share) for name in own}
            for one, image in zip(self.finer, images, strict=True)
        )
        fine = all(np.all(np.isfinite(error)) for one in found for error in one.values())
        self.errors = found if fine else ()

    def grid_error(self, best: Best, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the change (m,) of the coordinates by the correction, and the error (m,) that may be left.

        Of corrected fields this is what the extrapolation adds to the finer grids, and the largest difference between two
        of them, since the error oscillates with the place of the edge of contact among the cells; of contact images it is
        the largest change. nan where a solution failed.
        """
        if not self.errors:
            return (np.full(best.theta.size, np.nan),) * 2
        part = lambda one, kept: {
            name: f if (name == "contact") == kept else 0.0 * f for name, f in one.items()
        }
        change = lambda one, kept: self.moved(best, weights * self.vector(part(one, kept)))
        corrected, kept = (np.array([change(one, k) for one in self.errors]) for k in (False, True))
        mean, share = np.mean(corrected, 0), max(one.share for one in self.finer)
        return mean, share * np.abs(mean) + np.ptp(corrected, 0) + np.max(np.abs(kept), 0)

    def sample(self, weights: np.ndarray) -> Sample:
        """Return the block means as a curve over time; lines of blocks along y are series."""
        t, lines, before = [], [], 0
        for name in self.data.fields:
            blocks = self.blocks[name]
            t.append(np.broadcast_to(self.data.times[:, None, None], blocks.kept.shape)[blocks.kept])
            lines.append(blocks.lines() + before)
            before += blocks.kept.size
        curve = "field over its maximum", "", np.concatenate(t), self.measured()
        # the standard deviations were estimated from the same residuals, which cannot contradict them
        return Sample.of(curve, weights, "sigma", np.concatenate(lines))._replace(final=True)

    def notes(self, theta: np.ndarray, moved: np.ndarray, left: np.ndarray) -> tuple[str, ...]:
        """Return remarks on blocks of pixels and the error of the grid, and those of the solver."""
        sizes = ", ".join(f"{blocks.size} x {blocks.size} of {name}" for name, blocks in self.blocks.items())
        most, worst = (100.0 * float(np.max(np.abs(one[: self.k]))) for one in (moved, left))
        return (
            f"the values that were fitted are means over blocks of pixels: {sizes}",
            "standard deviations were estimated from the residuals of each field",
            f"the error of the grid, up to {most:.2g} % of a parameter, was corrected by solutions on finer grids; the"
            f" intervals include what may be left of it, up to {worst:.2g} %",
            *self.pressing.notes(tuple(theta[: self.k].tolist())),
        )


def _within(image: jc.Grid, model: jc.Grid) -> np.ndarray:
    """Return which pixels (nx, ny) lie on the grid of the model, ``MARGIN`` cells off its edge."""
    x, y = (np.asarray(axis) for axis in image.axes())
    inside = [
        np.abs(axis) < 0.5 * float(n * d) - MARGIN * float(d)
        for axis, n, d in zip((x, y), model.shape, model.spacing, strict=True)
    ]
    return inside[0][:, None] & inside[1][None, :]


def _space(sought: Sought, logs: np.ndarray, nuisances: tuple[str, ...], units: np.ndarray) -> ParameterSpace:
    """Return the box of the search."""
    with np.errstate(divide="ignore"):
        table = np.log(np.array(list(sought.table.values())))
    own = np.stack([np.maximum(table[:, 0], logs - RANGE), np.minimum(table[:, 1], logs + RANGE)], -1)
    own = np.where((table[:, 0] == table[:, 1])[:, None], table, own)
    box = np.concatenate([own, np.array([BOX[name] for name in nuisances]).reshape(-1, 2)])
    material = np.arange(len(box)) < logs.size
    return ParameterSpace(
        structure=sought.structure, lower=box[:, 0], upper=box[:, 1], unit=np.append(np.ones(logs.size), units),
        logarithmic=material, material=material,
        names=(*sought.structure.where, *("" for _ in nuisances)), open=np.ones((len(box), 2), dtype=bool),
    )  # fmt: skip
