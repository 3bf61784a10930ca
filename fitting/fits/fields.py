"""Identification of the parameters of a body from measured fields of a contact.

The model is ``jc.indent`` on a grid of its own, seen through the instrument (``imaging.py``). The fit is a least squares
of means over blocks of pixels, divided by the standard deviations that their residuals show (``pixels.py``), over the
logarithms of the parameters and the nuisance parameters of the instrument; the Jacobian is that of forward mode through
the solver. Solutions with half and three quarters of the cells along each axis estimate the error of the grid, by which the
intervals are widened.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from fitting.data.fields import ContactData
from fitting.inference import pixels, student
from fitting.inference.conclusion import FitProblem, conclude, solution
from fitting.inference.evidence import Sample
from fitting.inference.result import Fit
from fitting.models.imaging import View
from fitting.models.pressing import BodyParameters, PressedImages
from fitting.models.search_space import ParameterSpace
from fitting.models.structure import Sought, limits
from fitting.search import nonlinear, profiles
from fitting.search.nonlinear import Best, Objective
from fitting.views import field_picture

RANGE = 7.0  # e-folds about the start within which a parameter is sought
COARSER = (1 / 2, 3 / 4)  # cells along each axis of the grids that tell the error, over those of the fit
TURNS = 3  # of estimating the noise
MARGIN = 3  # cells at the edge of the model's grid that are not compared
ALIGN = {"none": (), "shift": ("shift_x", "shift_y"), "shift and rotation": ("shift_x", "shift_y", "angle")}
NOISE = ("constant", "estimated")
START = {"shift_x": 0.0, "shift_y": 0.0, "angle": 0.0, "blur": 1.0, "width": 0.7, "errors": 0.02}
BOX = {
    "shift_x": (-math.inf, math.inf), "shift_y": (-math.inf, math.inf), "angle": (-0.25 * math.pi, 0.25 * math.pi),
    "blur": (0.0, 50.0), "width": (0.02, 50.0), "errors": (1e-4, 0.4),
}  # fmt: skip


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class FieldFit(Fit):
    """The fit of a body to fields; ``material`` is the body, and ``Fit`` has what it shares with other fits.

    Attributes:
        view: {nuisance parameter: value}: shift_x, shift_y [m] (where the image shows the origin of the model), angle
            [rad], blur [m], width [m] of the edge in a contact image, and errors, the share of misread pixels.
        view_intervals: {nuisance parameter: (low, high)}, of the linearised model.
        blocks: {field: b}: the values of the fit are means over b x b pixels.
        grid_error: {parameter: relative change that is the estimated error of the grid}, by which the intervals are widened.
    """

    view: dict[str, float]
    view_intervals: dict[str, tuple[float, float]]
    blocks: dict[str, int]
    grid_error: dict[str, float]
    images: Any = dataclasses.field(repr=False)

    def predict(self, name: Any) -> np.ndarray:
        """Return the image (nt, nx, ny) of a field as the fitted model has it; of a contact image the probability."""
        return self.images(None)[0][self._known(name)]

    def band(self, name: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return limits (low, high) of ``predict(name)``, each (nt, nx, ny), at the level of the fit, linearised in the
        parameters of the body."""
        images, slopes = self.images(True)
        relative = self.covariance() / np.outer(self.estimate.best, self.estimate.best)
        slope = np.asarray(slopes[self._known(name)])
        half = student.two_sided(self.level) * np.sqrt(
            np.maximum(np.einsum("kxyz,kl,lxyz->xyz", slope, relative, slope), 0)
        )
        low, high = images[name] - half, images[name] + half
        return (np.maximum(low, 0.0), np.minimum(high, 1.0)) if name == "contact" else (low, high)

    def _known(self, name: Any) -> str:
        if name not in self.data.fields:
            raise ValueError(f"name: expected one of {list(self.data.fields)}, got {name!r}")
        return str(name)

    def plot(self, path: Any = None) -> Any:
        """Return a figure of data, model and difference of every field at its last time; saved where a path is given."""
        return field_picture.draw(self, path)

    def to_dict(self) -> dict[str, Any]:
        """Return what ``Fit.to_dict`` has, with the nuisance parameters, the blocks and the error of the grid."""
        own = {"view": self.view, "view_intervals": {k: list(v) for k, v in self.view_intervals.items()}}
        return super().to_dict() | own | {"blocks": self.blocks, "grid_error": self.grid_error}

    def _nuisance_lines(self) -> list[str]:
        return [
            f"  {name:7s} = {value:.4g}, {100 * self.level:g} % interval {self.view_intervals[name][0]:.4g} to"
            f" {self.view_intervals[name][1]:.4g}"
            for name, value in self.view.items()
        ]


def fit_fields(
    data: ContactData, body: Callable[[dict[str, Any]], jc.LayeredHalfSpace], parameters: Mapping[str, float], *,
    indenter: Any, grid: jc.Grid, units: Mapping[str, str] | None = None, fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None, align: str = "shift", blur: float | str = 0.0, noise: str = "constant",
    level: float = 0.95, tolerance: float = 1e-8,
) -> FieldFit:  # fmt: skip
    """Identify parameters of a body from measured fields of its contact with a known indenter.

    The images of ``jc.indent(body(p), indenter, data.control, data.times, grid=grid)`` are fitted to the data over the
    logarithms of the parameters p and over the nuisance parameters of the instrument. See ``fitting/models/imaging.py``
    for the model of the instrument, and ``fitting/inference/pixels.py`` for that of the noise. The intervals from a contact
    image can be too short on coarse grids, where the error of the contact's edge is not known well enough.

    Args:
        data: the fields, in pixels of their own.
        body: function from {parameter: value} to the body, which JAX can trace. It may use a parameter in several places
            or derive others from it (a viscosity as modulus times time, say), which names of leaves could not express.
        parameters: {name: value > 0 at which the search begins} in SI units.
        indenter: as of ``jc.indent``.
        grid: of the model.
        units: {name: unit} for what is printed, such as {"G": "Pa"}.
        fixed: {name: value} of parameters that are held.
        bounds: {name: (low, high)} of any subset, None for an open side. The search ends at factors of 1000 about the start
            in any case, where the interval is reported as open.
        align: which of the image's displacements are fitted: "none", "shift" or "shift and rotation". The search begins with
            none. A round contact does not determine the rotation.
        blur: standard deviation of the Gaussian blur of the instrument [m], which is beyond the average over a pixel; or
            "fitted".
        noise: "constant" or "estimated", (a^2 + b^2 f^2)^(1/2) of a value f, for fields of which the data give no sigma.
        level: of the intervals.
        tolerance: of the solver.

    Returns:
        The body with the intervals of its parameters, and how well the model describes the data.

    Raises:
        ValueError: wrong input, or a start at which the solver fails.

    Example:
        >>> plate = lambda p: jc.LayeredHalfSpace([], substrate=jc.Elastic(G=p["G"], nu=0.3))
        >>> ball, grid, image = jc.Sphere(5e-3), jc.Grid.square(32, 400e-6), jc.Grid.square(20, 320e-6)
        >>> truth = jc.indent(plate({"G": 2e9}), ball, jc.Load(1.0), [0.0], grid=image)
        >>> noise = 1e6 * np.random.default_rng(0).standard_normal((1, 20, 20))
        >>> data = fitting.ContactData([0.0], jc.Load(1.0), {"pressure": np.asarray(truth.pressure) + noise}, image)
        >>> fit = fitting.fit_fields(data, plate, {"G": 1e9}, indenter=ball, grid=grid, units={"G": "Pa"})
        >>> low, high = fit.intervals["G"]
        >>> low < 2e9 < high
        True
    """
    _check(data, parameters, grid, align, blur, noise)
    names = tuple(parameters)
    structure = BodyParameters.of(body, {name: (units or {}).get(name, "") for name in names})  # type: ignore[arg-type]
    sought = Sought(structure, limits(structure, fixed, bounds), None)
    search = _FieldSearch.of(data, sought, parameters, (indenter, grid, tolerance), ALIGN[align], blur, noise)
    return search.fit(level)


def _check(data: Any, parameters: Any, grid: Any, align: Any, blur: Any, noise: Any) -> None:
    if not isinstance(data, ContactData):
        raise ValueError(f"data: expected ContactData, got {type(data).__name__}")
    good = isinstance(parameters, Mapping) and len(parameters) > 0
    if not good or not all(isinstance(v, int | float) and 0.0 < v < math.inf for v in parameters.values()):
        raise ValueError(f"parameters: expected {{name: starting value > 0}}, got {parameters!r}")
    if not isinstance(grid, jc.Grid) or min(grid.shape) < 8:
        raise ValueError(f"grid: expected a Grid of at least 8 x 8 cells, got {grid!r}")
    if align not in ALIGN:
        raise ValueError(f"align: expected one of {', '.join(ALIGN)}; got {align!r}")
    if blur != "fitted" and not (isinstance(blur, int | float) and 0.0 <= blur < math.inf):
        raise ValueError(f"blur: expected a number >= 0 [m] or 'fitted', got {blur!r}")
    if noise not in NOISE:
        raise ValueError(f"noise: expected one of {', '.join(NOISE)}; got {noise!r}")


@dataclasses.dataclass
class _FieldSearch:
    """The search of a fit: coordinates theta are log parameters (k,), then nuisance parameters over their units (q,)."""

    data: ContactData
    sought: Sought
    pressing: PressedImages
    coarse: tuple[PressedImages, ...]
    nuisances: tuple[str, ...]
    units: np.ndarray
    blur: float
    start: np.ndarray
    space: ParameterSpace
    noise: str
    scale: dict[str, float]
    known: dict[str, np.ndarray]
    blocks: dict[str, pixels.Blocks]

    @classmethod
    def of(
        cls, data: ContactData, sought: Sought, parameters: Mapping[str, float], model: tuple[Any, Any, float],
        align: tuple[str, ...], blur: Any, noise: str,
    ) -> "_FieldSearch":  # fmt: skip
        """Return the search from checked input."""
        indenter, grid, tolerance = model
        contact = ("width", "errors") if "contact" in data.fields else ()
        nuisances = (*align, *(("blur",) if blur == "fitted" else ()), *contact)
        pixel = float(data.grid.spacing[0])
        units = np.array([1.0 if name in ("angle", "errors") else pixel for name in nuisances])
        setting = indenter, data.control, jnp.asarray(data.times)
        press = lambda own: PressedImages(
            sought.structure.model, tuple(parameters), setting, tuple(data.fields), data.grid, own, tolerance
        )
        known = {name: np.isfinite(field) & _within(data.grid, grid) for name, field in data.fields.items()}
        logs = np.array([math.log(np.clip(value, *sought.table[name])) for name, value in parameters.items()])
        return cls(
            data, sought, press(grid),
            tuple(press(_coarser(grid, share)) for share in COARSER), nuisances, units,
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
        """Return the images of the model."""
        return (pressing or self.pressing).images(theta[: self.k], self.view(theta))

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
        own, views = self.pressing.image_slopes(theta[: self.k], self.view(theta))
        rows = [self.vector(own)]
        for name, unit in zip(self.nuisances, self.units, strict=True):
            one = lambda view, name=name: (
                np.asarray(view.shift)[..., "xy".index(name[-1])]
                if name in ALIGN["shift"]
                else getattr(view, name)
            )
            rows.append(unit * self.vector({field: one(view) for field, view in views.items()})[None])
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

    def fit(self, level: float) -> FieldFit:
        """Search and conclude."""
        best, weights = self.solve()
        left = self.grid_error(best, weights)
        objective = self.objective(weights)
        traced = np.arange(best.theta.size) < self.k
        solved = solution(objective, best, weights)._replace(
            profile=lambda judged: profiles.profile(objective, best, judged.levels(), traced),
            left=left, notes=self.notes(best.theta, left),
        )  # fmt: skip
        duration = float(np.ptp(self.data.times))
        found = conclude(
            FitProblem(self.data, self.sought, self.space, self.sample(weights), duration, level), solved
        )
        ends = found.ends[self.k :] * self.units[:, None]
        return found.fit(
            FieldFit,
            view=dict(zip(self.nuisances, (best.theta[self.k :] * self.units).tolist(), strict=True)),
            view_intervals={n: (float(a), float(b)) for n, (a, b) in zip(self.nuisances, ends, strict=True)},
            blocks={name: blocks.size for name, blocks in self.blocks.items()},
            grid_error=dict(zip(self.sought.structure.where, left[: self.k].tolist(), strict=True)),
            images=lambda slopes: (
                self.images(best.theta),
                self.pressing.image_slopes(best.theta[: self.k], self.view(best.theta))[0]
                if slopes
                else None,
            ),
        )

    def solve(self) -> tuple[Best, np.ndarray]:
        """Return the optimum and weights (n,) that agree with its residuals."""
        if not np.all(np.isfinite(self.vector(self.images(self.start)))):
            status = jc.Status(self.pressing.history(tuple(self.start[: self.k].tolist()))[1])
            raise ValueError(f"parameters: expected a start that can be computed, got: {status.message}")
        best = nonlinear.minimise(self.objective(self.weights(self.start, True)), self.start)
        images = self.images(best.theta)
        for name, field in self.data.fields.items():
            residual = (images[name] - np.where(self.known[name], field, 0.0)) / np.sqrt(
                self.variance(name, images[name])
            )
            self.blocks[name] = pixels.chosen(residual, self.known[name])
        for _ in range(TURNS):
            weights = self.weights(best.theta)
            best = nonlinear.minimise(self.objective(weights), best.theta)
        return best, weights

    def grid_error(self, best: Best, weights: np.ndarray) -> np.ndarray:
        """Return the largest change (m,) of the coordinates between the grid and coarser ones.

        The error of the edge of contact oscillates with its place among the cells, so that a single coarser grid may show
        none by chance. nan where a coarse solution fails.
        """
        return np.max([self._change(best, weights, one) for one in self.coarse], axis=0)

    def _change(self, best: Best, weights: np.ndarray, coarse: PressedImages) -> np.ndarray:
        """Return the change (m,) of the coordinates with another grid."""
        change = weights * (
            self.vector(self.images(best.theta, coarse)) - self.vector(self.images(best.theta))
        )
        return np.abs(nonlinear.moved(best, self.space.free, change))

    def sample(self, weights: np.ndarray) -> Sample:
        """Return the block means as a curve over time; lines of blocks along y are series."""
        t, lines, before = [], [], 0
        for name in self.data.fields:
            blocks = self.blocks[name]
            t.append(np.broadcast_to(self.data.times[:, None, None], blocks.kept.shape)[blocks.kept])
            lines.append(blocks.lines() + before)
            before += blocks.kept.size
        curve = "field over its maximum", "", np.concatenate(t), self.measured()
        return Sample.of(curve, weights, "sigma", np.concatenate(lines))

    def notes(self, theta: np.ndarray, left: np.ndarray) -> tuple[str, ...]:
        """Return remarks on blocks of pixels and the error of the grid."""
        sizes = ", ".join(f"{blocks.size} x {blocks.size} of {name}" for name, blocks in self.blocks.items())
        worst = 100.0 * float(np.max(left[: self.k]))
        return (
            f"the values that were fitted are means over blocks of pixels: {sizes}",
            "standard deviations were estimated from the residuals of each field",
            f"the intervals include the estimated error of the grid, up to {worst:.2g} % of a parameter",
        )


def _coarser(grid: jc.Grid, share: float) -> jc.Grid:
    """Return a grid of the same width with a share of the cells along each axis."""
    shape = tuple(max(int(share * n), 4) for n in grid.shape)
    spacing = tuple(d * n / m for d, n, m in zip(grid.spacing, grid.shape, shape, strict=True))
    return jc.Grid(shape, spacing, grid.periodic)


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
