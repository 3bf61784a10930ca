"""Identification of the parameters of a body from measured fields of a contact.

The model is ``jc.indent`` on a grid of its own, seen through the instrument (``imaging.py``). The fit is a least squares
of means over blocks of pixels, divided by the standard deviations that their residuals show (``pixels.py``), over the
logarithms of the parameters and the nuisance parameters of the instrument; the Jacobian is that of forward mode through
the solver. Solutions on grids with twice the cells along each axis correct the images for the error of the grid; the
intervals are widened by what the correction may leave of it.
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting.data.fields import ContactData
from fitting.fits.field_search import ALIGN, SURE, FieldSearch
from fitting.inference import student
from fitting.inference.conclusion import FitProblem, conclude, solution
from fitting.inference.result import Fit
from fitting.models.pressing import BodyParameters
from fitting.models.structure import Sought, limits
from fitting.search import profiles
from fitting.views import field_picture

NOISE = ("constant", "estimated")
NARROW = 0.05  # half interval of a log parameter below which the model is taken as linear


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class FieldFit(Fit):
    """The fit of a body to fields; ``material`` is the body, and ``Fit`` has what it shares with other fits.

    Attributes:
        view: {nuisance parameter: value}: shift_x, shift_y [m] (where the image shows the origin of the model), angle
            [rad], blur [m], width [m] of the edge in a contact image, and errors, the share of misread pixels.
        view_intervals: {nuisance parameter: (low, high)}, of the linearised model.
        blocks: {field: b}: the values of the fit are means over b x b pixels.
        grid_error: {parameter: relative change that the error of the grid may cause after its correction}, by which the
            intervals are widened.
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
        relative = self.estimate.covariance / np.outer(self.estimate.best, self.estimate.best)
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
    for the model of the instrument, and ``fitting/inference/pixels.py`` for that of the noise. A pixel of a contact
    image is a Bernoulli variable, whose probability rises across the edge and is limited by a share of misread pixels.

    The sum of squares can have several minima. It is first evaluated at quasi-random points, and local searches begin at the
    start and at the best of these. The fit is rejected if only one search ended at the best optimum, or if other
    parameters describe the data as well.

    Args:
        data: the fields, in pixels of their own.
        body: function from {parameter: value} to the body, which JAX can trace. It may use a parameter in several places
            or derive other quantities from it, such as a viscosity as modulus times time.
        parameters: {name: value > 0 at which the search begins} in SI units.
        indenter: as of ``jc.indent``.
        grid: ``jc.Grid`` of the model.
        units: {name: unit} for what is printed, such as {"G": "Pa"}.
        fixed: {name: value} of parameters that are held.
        bounds: {name: (low, high)} of any subset, None for an open side. The search ends at factors of 1000 about the start
            in any case, where the interval is reported as open.
        align: which of the image's displacements are fitted: "none", "shift" or "shift and rotation". The search begins
            at zero. A round contact does not determine the rotation.
        blur: standard deviation of the Gaussian blur of the instrument [m], in addition to the average over a pixel; or
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
        >>> truth = jc.indent(plate({"G": 2e9}), ball, jc.Load(1.0), [0.0], grid=jc.Grid.square(80, 320e-6))
        >>> pixels = np.asarray(truth.pressure).reshape(1, 20, 4, 20, 4).mean((2, 4))  # a film averages over its pixels
        >>> noise = 1e6 * np.random.default_rng(0).standard_normal((1, 20, 20))
        >>> data = fitting.ContactData([0.0], jc.Load(1.0), {"pressure": pixels + noise}, image)
        >>> fit = fitting.fit_fields(data, plate, {"G": 1e9}, indenter=ball, grid=grid, units={"G": "Pa"})
        >>> low, high = fit.intervals["G"]
        >>> low < 2e9 < high
        True
    """
    _check(data, parameters, grid, align, blur, noise)
    names = tuple(parameters)
    structure = BodyParameters.of(body, {name: (units or {}).get(name, "") for name in names})  # type: ignore[arg-type]
    sought = Sought(structure, limits(structure, fixed, bounds), None)
    search = FieldSearch.of(data, sought, parameters, (indenter, grid, tolerance), ALIGN[align], blur, noise)
    return _concluded(search, level)


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


def _concluded(search: FieldSearch, level: float) -> FieldFit:
    """Return the fit with intervals at a level."""
    best, weights = search.solve()
    moved, left = search.grid_error(best, weights)
    objective, k = search.objective(weights), search.k
    others = [float(np.sum(objective.at(theta) ** 2)) for theta in best.others]
    traced = np.arange(best.theta.size) < k
    traced[:k] &= SURE * search.deviations(best) > NARROW
    solved = solution(objective, best, weights)._replace(
        profile=lambda assessment: profiles.profile(objective, best, assessment.levels(), traced),
        left=left, notes=search.notes(best.theta, moved, left), against=search.doubts(best, others),
    )  # fmt: skip
    duration = float(np.ptp(search.data.times))
    found = conclude(
        FitProblem(search.data, search.sought, search.space, search.sample(weights), duration, level), solved
    )
    ends = found.ends[k:] * search.units[:, None]
    return found.fit(
        FieldFit,
        view=dict(zip(search.nuisances, (best.theta[k:] * search.units).tolist(), strict=True)),
        view_intervals={n: (float(a), float(b)) for n, (a, b) in zip(search.nuisances, ends, strict=True)},
        blocks={name: blocks.size for name, blocks in search.blocks.items()},
        grid_error=dict(zip(search.sought.structure.where, left[:k].tolist(), strict=True)),
        images=functools.partial(_images, search, best.theta),
    )


def _images(search: FieldSearch, theta: np.ndarray, slopes: Any) -> tuple[Any, Any]:
    """Return the images of the model, and with ``slopes`` their derivatives by the parameters of the body."""
    own = search.pressing.image_slopes(theta[: search.k], search.view(theta), ())[0] if slopes else None
    return search.images(theta), own
