"""Forward model of a ball on a viscoelastic film on an elastic substrate: the contact solver itself."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy
from jax import Array

import jaxcontact as jc
from fitting.data.contact import sample_noise
from fitting.models.parameters import instrument_offset, spectrum
from fitting.search.press import IndentationProblem, Units
from jaxcontact._compile.programs import Program

TIMES = 96  # number of march times if there are more samples
CORNER = 0.02  # smallest deviation of a turn from a straight line, as a fraction of the largest drive
ABOVE_NOISE = 5.0  # and the same in standard deviations of the noise


class Coating(NamedTuple):
    """The layered body of an indentation fit.

    above: known layers above that of the sought material; thickness [m] of that layer; below: known layers below it;
    substrate; interface: a layer without material, of whose ``bonded`` that layer has the value.
    """

    above: tuple[Any, ...]
    thickness: Any
    below: tuple[Any, ...]
    substrate: Any
    interface: Any = jc.Layer(None, None)  # type: ignore[arg-type]

    @property
    def unbonded(self) -> bool:
        return not self.interface.bonded

    @classmethod
    def of(cls, layer: Any, layers: Sequence[Any] | None, substrate: Any, unbonded: bool = False) -> Coating:
        """Return the coating from the arguments of ``fit_indentation``; ValueError unless the solver supports it."""
        if (layer is None) == (layers is None):
            raise ValueError(
                f"layers: expected exactly one of layers and layer, got {layers!r} and {layer!r}"
            )
        rows = [layer] if layers is None else list(layers)
        sought = [i for i, row in enumerate(rows) if not isinstance(row, jc.Layer | jc.Graded)]
        if len(sought) != 1:
            raise ValueError(
                f"layers: expected one thickness [m] and otherwise Layer or Graded, got {layers!r}"
            )
        thickness = rows[sought[0]]
        if not (isinstance(thickness, int | float | np.number) and np.isfinite(thickness) and thickness > 0):
            raise ValueError(f"layer: expected a thickness > 0 m, got {thickness!r}")
        if not hasattr(substrate, "creep"):
            raise ValueError(f"substrate: expected a material under a layer, got {type(substrate).__name__}")
        interface = jc.Layer(None, None, bonded=not unbonded)  # type: ignore[arg-type]
        found = cls(
            tuple(rows[: sought[0]]), float(thickness), tuple(rows[sought[0] + 1 :]), substrate, interface
        )
        jc.normal_response(found.body(substrate), 1.0)  # raises ValueError for invalid known layers
        return found

    def body(self, material: Any) -> Any:
        """Return the layered half-space with this material in the sought layer."""
        own = jc.Layer(material, self.thickness, self.interface.bonded)
        layers = [*self.above, own, *self.below]
        return jc.LayeredHalfSpace(layers, self.substrate)


class FilmTest(NamedTuple):
    """Inputs of the solver beside the coordinates, in SI units except for the scaled quantities.

    times (m,) of the march, drive: the control there; t, load, response, weights (n,): the samples, with ``response``
    the fitted quantity; correction (n,): added to the model; rates (k,): 1/tau_i of a series with given times, else None;
    all scaled. units: the units that undo the scaling.
    """

    indenter: Any
    coating: Coating
    volume: dict[str, Array]
    grid: jc.Grid
    times: Array
    drive: Any
    t: Array
    load: Array
    response: Array
    weights: Array
    correction: Array
    units: Units
    rates: Array | None


class Mesh(NamedTuple):
    """Discretisation: cells x cells over ``width`` [m]; fine: number of march steps between samples."""

    cells: int
    width: float
    fine: int = 1


def scene(press: IndentationProblem, coating: Coating, mesh: Mesh) -> FilmTest:
    """Return the solver's inputs on a mesh."""
    kind, driven = (jc.Load, press.load) if press.pressing.control == "load" else (jc.Approach, press.depth)
    knots = march_times(press.t, driven)
    t, grid = divided(knots, mesh.fine), jc.Grid.square(n=mesh.cells, width=mesh.width)
    least = 0.0 if kind is jc.Load else -np.inf  # negative loads are noise
    drive = kind(np.interp(t, knots, np.maximum(polygon(press.t, driven, knots), least)))
    numbers = FilmTest(
        press.pressing.indenter, coating, press.sought.volume.keyword, grid, t, drive, press.t, press.load,
        press.measured, press.weights, np.zeros(press.t.size), press.units, press.rates,
    )  # fmt: skip
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=float), numbers)


def march_times(t: np.ndarray, drive: np.ndarray) -> np.ndarray:
    """Return the samples t (n,) themselves, or a subset if there are many.

    Half of the subset is evenly spaced and half logarithmically spaced after each turn of the drive (n,), where a
    creeping material responds fastest.
    """
    if t.size <= TIMES:
        return t
    ends = [0, *turns(t, drive), t.size - 1]
    each = max(TIMES // 2 // (len(ends) - 1), 2)
    after = [low + np.geomspace(1, high - low, each) for low, high in itertools.pairwise(ends)]
    evenly = np.searchsorted(t, np.linspace(0.0, t[-1], TIMES // 2))
    return t[np.unique(np.concatenate([ends, evenly, *after]).astype(int))]


def turns(t: np.ndarray, drive: np.ndarray) -> list[int]:
    """Return the samples, without the ends, between which the drive (n,) is nearly straight (Douglas and Peucker 1973)."""
    least = max(CORNER, ABOVE_NOISE * sample_noise(drive))
    found, pieces = [], [(0, t.size - 1)]
    while pieces:
        low, high = pieces.pop()
        off = np.abs(drive[low:high] - np.interp(t[low:high], t[[low, high]], drive[[low, high]]))
        if off.size and off.max() > least:
            middle = low + int(np.argmax(off))
            found.append(middle)
            pieces += [(low, middle), (middle, high)]
    return sorted(found)


def polygon(t: np.ndarray, drive: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Return the drive at the knots (m,), a subset of the samples.

    It is the least-squares fit of all samples (n,) by straight lines between the knots, which averages their noise and
    is exact for a piecewise linear drive.
    """
    if knots.size == t.size:
        return drive
    hats = scipy.interpolate.make_interp_spline(knots, np.eye(knots.size), k=1)
    return np.linalg.lstsq(hats(t), drive)[0]


def divided(knots: np.ndarray, fine: int) -> np.ndarray:
    """Return the knots with each interval divided into ``fine`` parts."""
    shares = np.arange(fine) / fine
    return np.append((knots[:-1, None] + np.diff(knots)[:, None] * shares).ravel(), knots[-1])


def _march(film: FilmTest) -> float:
    """Return the work of a march in cell steps, of which ``Program`` decides; a derivative takes as much longer to compile
    as to run."""
    return float(math.prod(film.grid.shape) * film.times.size)


def respond(theta: Array, film: FilmTest) -> tuple[Array, Array, Array, Array]:
    """Return the scaled depth (or load) at the samples (n,), and status, contact radius [m] and strain of the top layer at
    the march times (m,)."""
    c = spectrum(theta, film.rates)
    material = jc.Prony(
        J0=c.instantaneous * film.units.compliance,
        J=c.amplitudes * film.units.compliance,
        tau=film.units.duration / c.rates,
        fluidity=jnp.asarray(c.fluidity) * film.units.compliance / film.units.duration,
        **film.volume,
    )
    body = film.coating.body(material)
    offset, drive = instrument_offset(theta, film.t, film.load), film.drive
    by_load = isinstance(drive, jc.Load)
    if by_load:
        control: Any = jc.Load(drive.value * film.units.load)
    else:
        control = jc.Approach((drive.value - jnp.interp(film.times, film.t, offset)) * film.units.depth)
    times = film.times * film.units.duration
    run = jc.indent(body, film.indenter, control, times, grid=film.grid, save="last")
    found = run.approach / film.units.depth if by_load else run.load / film.units.load
    found = jnp.interp(film.t, film.times, found)
    return (found + offset if by_load else found), run.status, run.contact_radius, run.film_strain


@functools.partial(Program, work=lambda theta, film: _march(film))
def evaluate(theta: Array, film: FilmTest) -> Array:
    """Return the scaled depth (or load) at the samples (n,), for a mesh on which it is needed once."""
    return respond(theta, film)[0]


@Program
def linearise(theta: Array, free: Array, film: FilmTest) -> tuple[Array, Array, Array, Array, Array]:
    """Return the weighted residuals (n,), their Jacobian (n, k) with respect to the coordinates at the places ``free`` (k,),
    and status, contact radius [m] and strain of the top layer at the march times (m,).

    A fit runs it some seventy times. The tangents take a quarter of the time of the march that they share, and one program
    compiles in half the time of two.
    """

    def some(x: Array) -> tuple[Array, tuple[Array, ...]]:
        found, status, radius, strain = respond(theta.at[free].set(x), film)
        residual = film.weights * (found + film.correction - film.response)
        return residual, (residual, status, radius, strain)

    jacobian, (residual, *others) = jax.jacfwd(some, has_aux=True)(theta[free])
    return residual, jacobian, *others


@functools.partial(Program, static_argnames=("name",), work=lambda theta, film, name: _march(film))
def nuisance_slope(theta: Array, film: FilmTest, name: str) -> Array:
    """Return the derivative (n,) of the weighted response with respect to nu, bulk modulus or thickness."""

    def some(thickness: Array, volume: dict[str, Array]) -> Array:
        changed = film._replace(coating=film.coating._replace(thickness=thickness), volume=volume)
        return film.weights * respond(theta, changed)[0]

    held = film.coating.thickness, film.volume
    return jax.jacfwd(some, 0)(*held) if name == "thickness" else jax.jacfwd(some, 1)(*held)[name]


@functools.partial(Program, optimised=False)
def elastic(
    J: Array, volume: dict[str, Array], indenter: Any, coating: Coating, load: Array, grid: Any
) -> Array:
    """Return the approach and contact radius [m] on an elastic film of compliance J [1/Pa], of a few runs."""
    body = coating.body(jc.Elastic(1.0 / J, **volume))
    run = jc.indent(body, indenter, jc.Load(load), jnp.zeros(1), grid=grid, save="last")
    return jnp.stack([run.approach[0], run.contact_radius[0]])
