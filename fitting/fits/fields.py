"""Identification of the parameters of a body from measured fields of a contact.

The model is ``jc.indent`` on a grid of its own, seen through the instrument (``observed``). The fit is a least squares
of means over blocks of pixels, divided by the standard deviations that their residuals show (``block_deviations``), over the
logarithms of the parameters and the nuisance parameters of the instrument; the Jacobian is that of forward mode through
the solver. Solutions on grids with twice the cells along each axis correct the images for the error of the grid; the
intervals are widened by what the correction may leave of it.
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.data.curves import check_kind
from fitting.data.fields import ContactData
from fitting.inference.noise import two_sided
from fitting.inference.result import Fit, FitProblem, conclude, solution
from fitting.inference.sample import Sample
from fitting.models.parameters import Parameters
from fitting.models.structure import ParameterList, Sought, limits
from fitting.search import nonlinear
from fitting.search.nonlinear import Best, Objective, inverse
from fitting.views import sheet, text
from jaxcontact import Grid
from jaxcontact._support.status import LARGEST_ERROR, REFINED

# The image that an instrument records of the fields of a contact: blurred, shifted and rotated, at its own pixels.
#
# A pixel at x in the image shows the place X = R(-angle) (x - shift) of the contact, R the rotation by an angle about
# the origin of the model's grid: the model's origin is seen at ``shift``, and its x axis at ``angle``. A blurred
# field is
#
#     f * N(0, w^2 + h^2/12 - H^2/12),
#
# w the standard deviation of the instrument's blur, h the pixel, which averages over its area, and H the cell of the
# model where its values are averages over cells, as those of the pressure are. The convolution is exact for the
# trigonometric polynomial of the field continued evenly beyond its grid; values between cells follow by cubic
# convolution (R. G. Keys, IEEE Trans. Acoust. Speech Signal Process. 29 (1981) 1153).
#
# A pixel of a contact image is read as "in contact" with the probability
#
#     P = e + (1 - 2 e) Phi(d/s),
#
# d the signed distance to the edge of contact (positive inside), s the width of the transition and e the share of
# misread pixels. Near the edge pressure rises as the root of the distance and the gap as its power 3/2 (K. L.
# Johnson, Contact Mechanics, 1985, sec. 4.2), so that p^2/a - g^(2/3)/b is a signed distance, with a and b the slopes
# of p^2 and g^(2/3) at the edge. On a grid its zero lies up to a tenth of a cell beside the edge; a constant is
# therefore added to d for which the area of contact is ``smooth_area``, whose edge is accurate to a hundredth of a
# cell. An instrument that blurs the image before it decides sees the level 1/2 of the blurred coverage.


NEAR = 0.1  # share of the largest p^2 and g^(2/3) over which the weights of the slopes at the edge decay
SOFT = 0.5  # transition of the coverage of a cell, in cells
FAR = 1e-6  # coverage beyond which the distance is not taken from it
LEAST_INTENSITY = 1e-30
SHIFTS = "shift_x", "shift_y"
NEWTON = 3  # iterations for the constant that is added to the distance


class View(NamedTuple):
    """Nuisance parameters: shift (2,) [m], angle [rad], blur [m], width s [m], errors e."""

    shift: Array
    angle: Array
    blur: Array
    width: Array
    errors: Array

    def moved(self, values: dict[str, Array]) -> "View":
        """Return the view with other values () of some parameters, of which shift_x and shift_y are two."""
        shift = jnp.stack([values.get(name, own) for name, own in zip(SHIFTS, self.shift, strict=True)])
        return self._replace(shift=shift, **{name: v for name, v in values.items() if name not in SHIFTS})

    def part(self, name: str) -> Array:
        """Return the value () of a parameter."""
        return self.shift[SHIFTS.index(name)] if name in SHIFTS else jnp.asarray(getattr(self, name))


def pixels(grid: Grid, view: View) -> tuple[Array, Array]:
    """Return the places X and Y [m] in the contact, (nx, ny), that the pixels of a grid show."""
    x, y = grid.coordinates()
    x, y = x - view.shift[0], y - view.shift[1]
    c, s = jnp.cos(view.angle), jnp.sin(view.angle)
    return c * x + s * y, c * y - s * x


def observed(name: str, fields: dict[str, Array], model: Grid, image: Grid, view: View) -> Array:
    """Return what a field of the model, (nt, nx, ny) on its grid, looks like in the pixels of the image."""
    pixel = (image.spacing[0] ** 2 / 12.0, image.spacing[1] ** 2 / 12.0)
    at = pixels(image, view)
    if name == "contact":
        distance = jax.vmap(functools.partial(signed_distance, model=model))(
            fields["pressure"], fields["gap"]
        )
        distance = jax.vmap(functools.partial(with_area, grid=model))(distance, fields["smooth_area"])
        seen = jax.vmap(lambda d: sampled(_blurred_edge(d, model, view.blur), model, *at))(distance)
        return view.errors + (1.0 - 2.0 * view.errors) * jax.scipy.stats.norm.cdf(seen / view.width)
    cell = [d**2 / 12.0 if name == "pressure" else 0.0 for d in model.spacing]
    variance = [view.blur**2 + own - less for own, less in zip(pixel, cell, strict=True)]
    return jax.vmap(lambda f: sampled(blurred(f, model, *variance), model, *at))(fields[name])


def blurred(field: Array, grid: Grid, along_x: Array, along_y: Array) -> Array:
    """Return a field (nx, ny) convolved with a Gaussian of these variances [m^2], which may be slightly negative."""
    nx, ny = field.shape
    even = jnp.concatenate([field, field[::-1]], 0)
    even = jnp.concatenate([even, even[:, ::-1]], 1)
    kx = 2.0 * jnp.pi * jnp.fft.fftfreq(2 * nx, 1.0)[:, None] / grid.spacing[0]
    ky = 2.0 * jnp.pi * jnp.fft.rfftfreq(2 * ny, 1.0)[None, :] / grid.spacing[1]
    factor = jnp.exp(-0.5 * (along_x * kx**2 + along_y * ky**2))
    return jnp.fft.irfft2(factor * jnp.fft.rfft2(even), s=even.shape)[:nx, :ny]


def sampled(field: Array, grid: Grid, x: Array, y: Array) -> Array:
    """Return a field (nx, ny) at places x, y [m] of any shape by cubic convolution, constant beyond the grid."""
    cells = []
    for place, d, n in zip((x, y), grid.spacing, field.shape, strict=True):
        # the cell below a place, with one below and two above it in the grid, and the rest
        at = jnp.clip(place / d + (n - 1) / 2.0, 1.0, n - 2.0 - 1e-9)
        below = jnp.floor(jax.lax.stop_gradient(at)).astype(int)
        cells.append((below, at - below))
    (i, u), (j, v) = cells
    rows = [sum(w * field[i + a, j + b] for b, w in _keys(v)) for a, _ in _keys(u)]
    return jnp.asarray(sum(w * row for (_, w), row in zip(_keys(u), rows, strict=True)))


def _keys(t: Array) -> list[tuple[int, Array]]:
    """Return the weights of the cells -1, 0, 1 and 2 for a place t after the cell 0."""
    return [
        (-1, 0.5 * t * (-1.0 + t * (2.0 - t))),
        (0, 1.0 + 0.5 * t**2 * (3.0 * t - 5.0)),
        (1, 0.5 * t * (1.0 + t * (4.0 - 3.0 * t))),
        (2, 0.5 * t**2 * (t - 1.0)),
    ]


def signed_distance(pressure: Array, gap: Array, model: Grid) -> Array:
    """Return the distance [m] to the edge of contact, (nx, ny), positive inside; exact to first order near the edge."""
    inside, outside = (pressure / _most(pressure)) ** 2, _power(gap / _most(gap))
    return inside / _edge_slope(inside, model) - outside / _edge_slope(outside, model)


def with_area(distance: Array, area: Array, grid: Grid) -> Array:
    """Return the signed distance (nx, ny) plus the constant for which the area of contact [m^2] is ``area``, ()."""
    soft = SOFT * grid.spacing[0]
    change = jnp.zeros(())
    for _ in range(NEWTON):
        at = (distance + change) / soft
        excess = jnp.sum(jax.scipy.stats.norm.cdf(at)) * grid.cell_area - area
        slope = jnp.sum(jax.scipy.stats.norm.pdf(at)) * grid.cell_area / soft
        change = change - jnp.clip(excess / jnp.maximum(slope, LEAST_INTENSITY), -soft, soft)
    return distance + change


def _most(field: Array) -> Array:
    return jnp.maximum(jnp.max(field), LEAST_INTENSITY)


def _power(gap: Array) -> Array:
    """Return gap^(2/3), with derivative zero in contact."""
    open_ = gap > 1e-12
    return jnp.where(open_, jnp.where(open_, gap, 1.0) ** (2.0 / 3.0), 0.0)


def _edge_slope(field: Array, grid: Grid) -> Array:
    """Return the mean slope [1/m] of a field that is zero on one side of an edge, where it is small but not zero."""
    along_x = (field[2:, 1:-1] - field[:-2, 1:-1]) / (2.0 * grid.spacing[0])
    along_y = (field[1:-1, 2:] - field[1:-1, :-2]) / (2.0 * grid.spacing[1])
    inner = field[1:-1, 1:-1]
    square = along_x**2 + along_y**2
    weight = jnp.where(inner > 0.0, jnp.exp(-inner / NEAR), 0.0)
    root = jnp.sqrt(
        jnp.sum(weight * square) / jnp.maximum(jnp.sum(weight), LEAST_INTENSITY) + LEAST_INTENSITY
    )
    return jnp.maximum(root, 1e-3 / (grid.spacing[0] * grid.shape[0]))


def _blurred_edge(distance: Array, model: Grid, blur: Array) -> Array:
    """Return the signed distance to the level 1/2 of the blurred coverage, (nx, ny)."""
    soft = SOFT * model.spacing[0]
    whole = jnp.sqrt(soft**2 + blur**2)
    covered = blurred(jax.scipy.stats.norm.cdf(distance / soft), model, blur**2, blur**2)
    known = (covered > FAR) & (covered < 1.0 - FAR)
    level = whole * jax.scipy.stats.norm.ppf(jnp.where(known, covered, 0.5))
    return jnp.where(known, level, distance)


# The fields of an indentation in the image of an instrument, and their derivatives by forward mode.


NEEDED = {
    "contact": ("pressure", "gap", "smooth_area")
}  # fields of the solver for one in an image; else the same


class BodyParameters(ParameterList):
    """The parameters of a body, whose ``model`` is a function from {parameter: value} to the body."""

    def material(self, values: dict[str, Any], volume: Any) -> Any:
        """Return the body with these parameters."""
        return self.model(values)

    def times(self, values: np.ndarray) -> float:
        """Return nan: a body has no single retardation time."""
        return float("nan")


class PressedImages:
    """Images of an indentation as functions of log parameters (k,) and a ``View``.

    body: from {parameter: value} to the body; setting: indenter, control and times; seen: names of the fields in the image;
    image, grid: the pixels and the cells of the model. The last histories are kept, so that varying the view alone solves
    no contact.
    """

    def __init__(
        self, body: Callable, names: tuple[str, ...], setting: tuple[Any, Any, Any], seen: tuple[str, ...],
        image: jc.Grid, grid: jc.Grid, tolerance: float, substeps: int,
    ) -> None:  # fmt: skip
        self.seen, self.image, self.grid = seen, image, grid
        self.given = (setting, grid, tolerance)
        needed = tuple(sorted({own for name in seen for own in NEEDED.get(name, (name,))}))
        self.static = {"body": body, "names": names, "needed": needed, "substeps": substeps}
        self._store()

    def _store(self) -> None:
        """Keep the last solution and its derivatives."""
        self.history = functools.lru_cache(maxsize=2)(self._history)
        self.slopes = functools.lru_cache(maxsize=1)(self._slopes)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without the stored solutions, which cannot be pickled and are computed again."""
        return {name: value for name, value in vars(self).items() if name not in ("history", "slopes")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._store()

    def _history(self, logs: tuple[float, ...]) -> tuple[dict[str, Array], jc.ContactHistory]:
        """Return the fields, and the whole history."""
        return _run(jnp.asarray(logs), *self.given, **self.static)

    def status(self, logs: tuple[float, ...]) -> jc.Status:
        """Return the largest status."""
        return jc.Status(int(np.max(self.history(logs)[1].status)))

    def step_error(self, logs: tuple[float, ...]) -> float:
        """Return the largest estimated relative error of the pressure due to the time steps."""
        return float(np.max(self.history(logs)[1].time_step_error))

    def notes(self, logs: tuple[float, ...]) -> tuple[str, ...]:
        """Return the notes of the solver."""
        return tuple(self.history(logs)[1].notes)

    def _slopes(self, logs: tuple[float, ...]) -> dict[str, Array]:
        """Return derivatives of the fields (k, nt, nx, ny) with respect to log parameters."""
        return _moved(jnp.asarray(logs), *self.given, **self.static)

    def images(self, logs: np.ndarray, view: View) -> dict[str, np.ndarray]:
        """Return {name: (nt, nx, ny)}, nan where the solver has failed."""
        key = tuple(logs.tolist())
        fields, bad = self.history(key)[0], 0.0 if self.status(key) == jc.Status.FINE else np.nan
        seen = _see(fields, view, self.grid, self.image, seen=self.seen)
        return {name: np.asarray(image) + bad for name, image in seen.items()}

    def image_slopes(self, logs: np.ndarray, view: View, varied: tuple[str, ...]) -> tuple[dict, dict]:
        """Return {name: (k, nt, nx, ny)} with respect to log parameters, and {name: {parameter: (nt, nx, ny)}} with
        respect to the ``varied`` parameters of the view."""
        key = tuple(logs.tolist())
        given = self.history(key)[0], self.slopes(key), view, {name: view.part(name) for name in varied}
        return _tangents(*given, self.grid, self.image, seen=self.seen)


@functools.partial(jax.jit, static_argnames=("body", "names", "needed", "substeps"))
def _run(
    logs: Array, setting: tuple[Any, Any, Any], grid: jc.Grid, tolerance: float, *,
    body: Callable, names: tuple[str, ...], needed: tuple[str, ...], substeps: int,
) -> tuple[dict[str, Array], jc.ContactHistory]:  # fmt: skip
    """Return the fields (nt, nx, ny) of an indentation, and its whole history; setting: indenter, control and times."""
    values = dict(zip(names, jnp.exp(logs), strict=True))
    history = jc.indent(body(values), *setting, grid=grid, tolerance=tolerance, substeps=substeps)
    return {name: getattr(history, name) for name in needed}, history


@functools.partial(jax.jit, static_argnames=("body", "names", "needed", "substeps"))
def _moved(logs: Array, *given: Any, **static: Any) -> dict[str, Array]:
    """Return the derivatives (k, nt, nx, ny) of the fields with respect to log parameters (k,)."""
    slopes = jax.jacfwd(lambda at: _run(at, *given, **static)[0])(logs)
    return {name: jnp.moveaxis(value, -1, 0) for name, value in slopes.items()}


@functools.partial(jax.jit, static_argnames=("seen",))
def _see(
    fields: dict[str, Array], view: View, grid: jc.Grid, image: jc.Grid, *, seen: tuple[str, ...]
) -> dict[str, Array]:
    """Return the images of the fields that are seen."""
    return {name: observed(name, fields, grid, image, view) for name in seen}


@functools.partial(jax.jit, static_argnames=("seen",))
def _tangents(
    fields: dict[str, Array], moved: dict[str, Array], view: View, varied: dict[str, Array], grid: jc.Grid,
    image: jc.Grid, *, seen: tuple[str, ...],
) -> tuple[dict[str, Array], dict[str, dict[str, Array]]]:  # fmt: skip
    """Return the derivatives of the images along changes (k, nt, nx, ny) of the fields, and with respect to the values
    ``varied`` of the view."""
    one = lambda change: jax.jvp(lambda f: _see(f, view, grid, image, seen=seen), (fields,), (change,))[1]
    shown = lambda values: _see(fields, view.moved(values), grid, image, seen=seen)
    return jax.vmap(one)(moved), jax.jacfwd(shown)(varied) if varied else {name: {} for name in seen}


# Grids that tell the error of the grid in a fit to fields.
#
# The error of pressures, gaps and parameters falls with the square of the size of the cells, but for a part that
# oscillates with the place of the edge of contact among the cells. With images f on cells of a size H, and f' on
# cells of a size r H, the error is estimated as (Richardson's extrapolation)
#
#     f(0) - f = (f' - f)/(1 - r^2).
#
# The mean over two finer grids of slightly different widths corrects the images of the fit. Coarser grids are used to
# begin the search.


WIDER = 1.0, 1.03, 1.06, 1.09, 1.12  # widths, over that of the fit, of grids of half the cells
COARSER = 1 / 2, 3 / 4  # cells along each axis, over those of the fit, where the width cannot differ
FINER = (2.0, 1.0), (2.0, 1.06)  # cells along each axis and width of the finer grids, over those of the fit
FINER_HERE = (2.0, 1.0), (1.5, 1.0)  # the same where the width cannot differ

Press = Callable[[Any, jc.Grid], PressedImages]


class Finer(NamedTuple):
    """The contact on a finer grid; share: r^2, the part of the error that it leaves."""

    pressing: PressedImages
    share: float


def coarser(press: Press, indenter: Any, grid: jc.Grid) -> tuple[PressedImages, ...]:
    """Return the contact on coarser grids, with different places of the edge of contact among their cells."""
    changes = [(share, 1.0) for share in COARSER] if _fixed(indenter, grid) else [(0.5, w) for w in WIDER]
    return tuple(_pressed(press, indenter, grid, *change) for change in changes)


def finer(press: Press, indenter: Any, grid: jc.Grid) -> tuple[Finer, ...]:
    """Return the contact on finer grids."""
    changes = FINER_HERE if _fixed(indenter, grid) else FINER
    return tuple(
        Finer(_pressed(press, indenter, grid, *change), (change[1] / change[0]) ** 2) for change in changes
    )


def _fixed(indenter: Any, grid: jc.Grid) -> bool:
    """Return whether the width is a period, or the heights of the indenter are not known beyond it."""
    return any(grid.periodic) or isinstance(indenter, jc.HeightField)


def _pressed(press: Press, indenter: Any, grid: jc.Grid, share: float, wider: float) -> PressedImages:
    """Return the contact on a grid of another width with a share of the cells along each axis."""
    shape = tuple(max(int(share * n), 4) for n in grid.shape)
    spacing = tuple(wider * d * n / m for d, n, m in zip(grid.spacing, grid.shape, shape, strict=True))
    own = jc.Grid(shape, spacing, grid.periodic)
    return press(_on_grid(indenter, grid, own), own)


def _on_grid(indenter: Any, grid: jc.Grid, own: jc.Grid) -> Any:
    """Return the indenter for another grid of the same width: heights between cells follow by cubic convolution."""
    if not isinstance(indenter, jc.HeightField):
        return indenter
    heights = sampled(jnp.asarray(indenter.heights), grid, *own.coordinates())
    return dataclasses.replace(indenter, heights=heights)


# Images as samples of independent values: means over blocks of pixels, and the variance of their noise.
#
# Neighbouring pixels of a blurred or interpolated image are correlated, and as many values as pixels would make
# intervals too short. The residuals of a first fit are averaged over blocks of b x b pixels, with the least b for
# which neighbouring blocks are correlated by no more than ``ALLOWED``; what correlation is left along x raises the
# variance by 1 + 2 rho, and that along y is taken into account as in any series (``noise.py``). The variance of a
# block mean is estimated from the residuals of all blocks of the field, so that it holds whatever the correlation
# within the blocks. Frames of different times are taken as independent.
#
# The likelihood of a contact image is that of Bernoulli variables of probability P: its score is that of weighted
# residuals (y - P)/sqrt(P (1 - P)), and the iteration on the weights converges to the estimate of maximum likelihood
# (P. McCullagh, J. A. Nelder, Generalized Linear Models, 1989, sec. 2.5 and 9.2). A factor on the variance, estimated
# too, accounts for correlated errors.


ALLOWED = 0.12  # correlation of neighbouring blocks
SIZES = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32)
MOST = 16384  # blocks per field
LEAST_BLOCKS = 64  # blocks per field, if it has so many pixels
SURE_CORRELATION = 2.5  # standard errors of a correlation below which it is chance
SMALL = 1e-12


class Blocks(NamedTuple):
    """The blocks of a field: size b; kept (nt, mx, my) bool: those whose pixels are all measured; inflation: factor on the
    variance for the correlation along x."""

    size: int
    kept: np.ndarray
    inflation: float = 1.0

    @classmethod
    def of(cls, known: np.ndarray, size: int) -> "Blocks":
        """Return the blocks of pixels known (nt, nx, ny) bool."""
        return cls(size, _means(known.astype(float), size) == 1.0)

    def means(self, values: np.ndarray) -> np.ndarray:
        """Return the means (..., n) over the blocks that are kept, of values (..., nt, nx, ny)."""
        return _means(values, self.size)[..., self.kept]

    def lines(self) -> np.ndarray:
        """Return labels (n,), equal for the blocks of a line along y of a frame."""
        return np.broadcast_to(
            np.arange(self.kept[..., 0].size).reshape(*self.kept.shape[:2], 1), self.kept.shape
        )[self.kept]


def _means(values: np.ndarray, size: int) -> np.ndarray:
    """Return means over size x size pixels of values (..., nx, ny); incomplete blocks at the end are left out."""
    nx, ny = (n // size for n in values.shape[-2:])
    cut = values[..., : nx * size, : ny * size]
    return cut.reshape(*values.shape[:-2], nx, size, ny, size).mean((-3, -1))


def least_size(known: np.ndarray) -> int:
    """Return the size of blocks that leaves no more than ``MOST`` of them."""
    return next(size for size in SIZES if known.sum() <= MOST * size**2 or size == SIZES[-1])


def chosen(residual: np.ndarray, known: np.ndarray) -> Blocks:
    """Return the least blocks whose means are hardly correlated, from standardised residuals (nt, nx, ny) of pixels."""
    filled, least = np.where(known, residual, 0.0), least_size(known)
    for size in (size for size in SIZES if size >= least):
        blocks = Blocks.of(known, size)
        along_x, along_y = (_neighbours(_means(filled, size), blocks.kept, axis) for axis in (1, 2))
        allowed = max(ALLOWED, SURE_CORRELATION / np.sqrt(max(blocks.kept.sum(), 1)))
        last = known.sum() < LEAST_BLOCKS * (size + 1) ** 2
        if max(along_x, along_y) <= allowed or last:
            break
    return blocks._replace(inflation=1.0 + 2.0 * max(along_x, 0.0))


def _neighbours(values: np.ndarray, kept: np.ndarray, axis: int) -> float:
    """Return the correlation of neighbours along an axis of values (nt, mx, my)."""
    a, on = np.moveaxis(values, axis, 0), np.moveaxis(kept, axis, 0)
    both = on[1:] & on[:-1]
    total = float(np.mean(values[kept] ** 2)) if kept.any() else 0.0
    return float(np.mean((a[1:] * a[:-1])[both])) / total if total > 0 and both.any() else 0.0


def block_deviations(kind: str, residual: np.ndarray, shape: np.ndarray, fitted: np.ndarray) -> np.ndarray:
    """Return standard deviations (n,) of values from their residuals (n,).

    kind: "constant" up to ``shape`` (n,), or "estimated", (a^2 + b^2 fitted^2)^(1/2).
    """
    square, level = residual**2, fitted**2
    if kind == "estimated":
        # a and b >= 0 by iterated weighted least squares of the squared residuals
        variance = np.full(square.size, square.mean() + SMALL)
        for _ in range(8):
            columns = np.stack([np.ones(level.size), level], -1) / variance[:, None]
            a, b = np.linalg.lstsq(columns, square / variance, rcond=None)[0]
            if a <= 0:
                a, b = 0.0, np.sum(square) / np.sum(level)
            elif b < 0:
                a, b = square.mean(), 0.0
            variance = np.maximum(a + b * level, 1e-6 * square.mean() + SMALL**2)
        shape = np.sqrt(variance)
    return shape * np.sqrt(max(float(np.mean(square / shape**2)), SMALL**2))


# Coordinates, residuals and starting values of the search for the parameters of a body from fields of its contact.
#
# The coordinates are the logarithms of the parameters, and the nuisance parameters of the instrument over their
# units. The sum of squares can have several minima. It is therefore evaluated first at quasi-random points within a
# factor of exp(``SCAN``) about the start, on a grid with half the cells along each axis; local searches begin at the
# start and at the best of these points. The optimum is accepted if at least two searches end there; where the first
# ones do not agree, two more begin at both sides of the best optimum. On the grid of the model the slope of the sum
# of squares changes wherever a cell enters the contact, so that it has several local minima within the error of the
# grid. Two optima are therefore the same if they differ by no more than this error and the noise allow. Optima of the
# same sum of squares at other parameters lead to rejection.
#
# The images of pressure, gap and displacement at the best optimum are corrected for the error of the grid
# (``finer``), and the search goes on with the corrected images. Contact images are not corrected: the error
# of their edge is not a smooth function of the size of the cells, and a correction would be uneven along the edge.


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
    space: Parameters
    noise: str
    scale: dict[str, float]
    known: dict[str, np.ndarray]
    blocks: dict[str, Blocks]
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
        logs = np.array([math.log(np.clip(value, *sought.table[name])) for name, value in parameters.items()])
        # The pressure is linear within a step: the times of the images are divided until that holds at the start.
        for substeps in REFINED:
            press = lambda indenter, own, substeps=substeps: PressedImages(
                sought.structure.model, tuple(parameters), (indenter, data.control, jnp.asarray(data.times)),
                tuple(data.fields), data.grid, own, tolerance, substeps,
            )  # fmt: skip
            pressing = press(indenter, grid)
            if not pressing.step_error(tuple(logs.tolist())) > LARGEST_ERROR:
                break
        known = {name: np.isfinite(field) & _within(data.grid, grid) for name, field in data.fields.items()}
        return cls(
            data, sought, pressing, coarser(press, indenter, grid), finer(press, indenter, grid), nuisances,
            units,
            0.0 if blur == "fitted" else float(blur),
            np.append(logs, [START[name] for name in nuisances]), _space(sought, logs, nuisances, units), noise,
            {name: float(np.nanmax(np.abs(field))) or 1.0 for name, field in data.fields.items()}, known,
            {name: Blocks.of(own, least_size(own)) for name, own in known.items()},
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
            found.append(block_deviations(kind, residual, shape, fitted) * math.sqrt(blocks.inflation))
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
            self.blocks[name] = chosen(residual, self.known[name])
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

    def notes(self, theta: np.ndarray, moved: np.ndarray, systematic: np.ndarray) -> tuple[str, ...]:
        """Return remarks on blocks of pixels and the error of the grid, and those of the solver."""
        sizes = ", ".join(f"{blocks.size} x {blocks.size} of {name}" for name, blocks in self.blocks.items())
        most, worst = (100.0 * float(np.max(np.abs(one[: self.k]))) for one in (moved, systematic))
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


def _space(sought: Sought, logs: np.ndarray, nuisances: tuple[str, ...], units: np.ndarray) -> Parameters:
    """Return the box of the search."""
    with np.errstate(divide="ignore"):
        table = np.log(np.array(list(sought.table.values())))
    own = np.stack([np.maximum(table[:, 0], logs - RANGE), np.minimum(table[:, 1], logs + RANGE)], -1)
    own = np.where((table[:, 0] == table[:, 1])[:, None], table, own)
    box = np.concatenate([own, np.array([BOX[name] for name in nuisances]).reshape(-1, 2)])
    material = np.arange(len(box)) < logs.size
    unit = np.append(np.ones(logs.size), units)
    return Parameters.of(sought.structure, box, unit=unit, logarithmic=material, material=material)


# The figure of a fit to fields: data, model and difference.


@sheet.styled
def draw(fit: Any, path: Any) -> Any:
    """Return a Figure of a ``FieldFit``: a row for every field, at its last time with data."""
    from matplotlib.figure import Figure

    fields, grid = fit.data.fields, fit.data.grid
    figure = Figure(figsize=(10.0, 3.2 * len(fields) + 0.6), layout="constrained")
    figure.suptitle(
        "\n".join(text.parameter(fit, name) for name in fit.values), family="monospace", fontsize="small"
    )
    half = [0.5e6 * float(w) for w in grid.width]
    extent = (-half[0], half[0], -half[1], half[1])
    for row, (name, field) in enumerate(fields.items()):
        time = int(np.flatnonzero(np.isfinite(field).any((1, 2)))[-1])
        data, model = field[time], fit.predict(name)[time]
        for column, (title, image) in enumerate(
            (("data", data), ("model", model), ("difference", data - model))
        ):
            axes = figure.add_subplot(len(fields), 3, 3 * row + column + 1)
            shown = axes.imshow(image.T, origin="lower", extent=extent)
            axes.set(
                title=f"{name}, {title}, t = {fit.data.times[time]:.4g} s", xlabel="x [µm]", ylabel="y [µm]"
            )
            figure.colorbar(shown, ax=axes)
    if path is not None:
        figure.savefig(path, dpi=150)
    return figure


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
        half = two_sided(self.level) * np.sqrt(
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
        return draw(self, path)

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
    logarithms of the parameters p and over the nuisance parameters of the instrument. Each time between two images is
    divided into substeps until the error by the time steps is below 1 % of the pressure at the start of the search. See
    ``fitting/fits/fields.py`` for the models of the instrument and of the noise. A pixel of a contact image is a Bernoulli
    variable, whose probability rises across the edge and is limited by a share of misread pixels.

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

    # the optimum, and its intervals by profiles of those parameters whose deviations are not small
    best, weights = search.solve()
    moved, systematic = search.grid_error(best, weights)
    objective, k = search.objective(weights), search.k
    others = [float(np.sum(objective.at(theta) ** 2)) for theta in best.others]
    traced = np.arange(best.theta.size) < k
    traced[:k] &= SURE * search.deviations(best) > NARROW
    solved = solution(objective, best, weights)._replace(
        find_ends=lambda assessment: nonlinear.profile(objective, best, assessment.levels(), traced),
        systematic=systematic, notes=search.notes(best.theta, moved, systematic), against=search.doubts(best, others),
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
        grid_error=dict(zip(search.sought.structure.where, systematic[:k].tolist(), strict=True)),
        images=functools.partial(_images, search, best.theta),
    )


def _check(data: Any, parameters: Any, grid: Any, align: Any, blur: Any, noise: Any) -> None:
    check_kind(data, ContactData)
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


def _images(search: FieldSearch, theta: np.ndarray, slopes: Any) -> tuple[Any, Any]:
    """Return the images of the model, and with ``slopes`` their derivatives by the parameters of the body."""
    own = search.pressing.image_slopes(theta[: search.k], search.view(theta), ())[0] if slopes else None
    return search.images(theta), own
