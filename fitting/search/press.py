"""A checked and scaled indentation fit, ready for the search, and its model where the body has layers: the contact solver.

Times are scaled by the duration, load and depth by their largest values, and compliance so that a half-space has
depth^power = int J dP.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy
from jax import Array

import jaxcontact as jc
from fitting.data.contact import find_contact, sample_noise
from fitting.data.curves import check_kind
from fitting.data.indentation import IndentationData, Probe, check_depth, probe_of, with_earlier
from fitting.data.weights import choose_weights
from fitting.models import adhesive_contact
from fitting.models.halfspace import surface
from fitting.models.parameters import Parameters, instrument_offset, spectrum
from fitting.models.structure import Sought, columns
from fitting.models.thin_layer import LARGEST, Base, ThinLayer
from fitting.search import varpro
from fitting.search.nonlinear import Best, Objective
from jaxcontact._compile.programs import Program
from jaxcontact._support.prefixes import told_apart
from jaxcontact.bodies.materials import Spectrum

AIR, AIR_SHARE = 5, 0.02  # points before contact that may be fitted, as a number and as a fraction of all
TIMES = np.geomspace(3e-3, 3.0, 7)  # initial retardation times over the duration
SHARED = np.array([0.45, 0.45, 0.1])  # initial shares of the instantaneous, retarded and viscous parts
VISIBLE = 1e-2  # smallest scaled compliance of a part at these starts
LEAST = 1e-8  # least scaled fluidity, or branch, of a film: at zero the decay rates are not differentiable
STEPPED = 0.1  # fraction of the largest load from which a first point has a note on when it was applied
LEAST_LOAD = 0.5  # fraction of the largest load below which the contact certainly shrinks


REPLACED = 0.1  # largest difference of a load that replaces the measured one, over the hold, without a note


class Instrument(NamedTuple):
    """Contributions of the instrument to the measured depth.

    contact_point [m], drift [m/s] and machine_compliance [m/N], each a known number or "fit".
    """

    contact_point: float | str = 0.0
    drift: float | str = 0.0
    machine_compliance: float | str = 0.0

    def box(self, sizes: np.ndarray) -> np.ndarray:
        """Return the bounds (3, 2) relative to ``sizes`` (3,) in SI units, equal where a value is known."""
        ends = []
        for name, value, size in zip(self._fields, self, sizes, strict=True):
            if isinstance(value, str) and value.lower() == "fit":
                ends.append((0.0 if name == "machine_compliance" else -1.0, 1.0))
                continue
            if isinstance(value, str) or not np.isfinite(value):
                raise ValueError(f'{name}: expected a number or "fit", got {value!r}')
            ends.append((value / size, value / size))
        return np.array(ends)


class Pressing(NamedTuple):
    """Indenter, control and body of an indentation test.

    indenter; control: the prescribed quantity, "load" or "depth"; rise [s]: of a load that replaces the measured one,
    or None; adhesion: work of adhesion [J/m2]; film: whether the body is a film on a substrate; thickness [m] of a
    layer on a rigid base, or None; unbonded: whether the layer slides on its base.
    """

    indenter: Any
    control: str
    rise: float | None
    adhesion: float
    film: bool
    thickness: float | None = None
    unbonded: bool = False

    @property
    def stiffened(self) -> bool:
        """True if a base makes the load rise more steeply than on a half-space."""
        return self.film or self.thickness is not None

    @property
    def response(self) -> tuple[str, str]:
        """Name and unit of the fitted quantity."""
        return ("depth", "m") if self.control == "load" else ("load", "N")


class Units(NamedTuple):
    """Units that undo the scaling: duration [s], load [N], depth [m], compliance [1/Pa]."""

    duration: float
    load: float
    depth: float
    compliance: float


class IndentationProblem(NamedTuple):
    """An indentation test ready for a search.

    t, load, depth (n,): scaled; kept (n,) bool: the fitted points; weights (n,): 0 elsewhere, and their label; space:
    of the search; notes; layer: the factor of a thin layer on a rigid base over scaled depths.
    """

    data: IndentationData
    sought: Sought
    pressing: Pressing
    probe: Probe
    units: Units
    t: np.ndarray
    load: np.ndarray
    depth: np.ndarray
    kept: np.ndarray
    weights: np.ndarray
    label: str
    space: Parameters
    notes: tuple[str, ...]
    layer: ThinLayer | None = None

    @property
    def rates(self) -> np.ndarray | None:
        """Scaled 1/tau_i (k,) of a series with given times, else None."""
        tau = self.sought.structure.tau
        return None if tau is None else self.units.duration / tau

    @property
    def extra(self) -> float:
        """Scaled compliance that the indenter adds to J at once."""
        return float(indenter_creep(self.pressing.indenter).instantaneous) / self._per_unit

    @property
    def own(self) -> Spectrum | None:
        """Scaled creep of an indenter beyond ``extra``, None of one that does not creep."""
        creep = indenter_creep(self.pressing.indenter)
        if not creep.rates.size and creep.fluidity is None:
            return None
        flow = 0.0 if creep.fluidity is None else creep.fluidity * self.units.duration / self._per_unit
        return Spectrum(
            jnp.zeros(()),
            creep.amplitudes / self._per_unit,
            creep.rates * self.units.duration,
            jnp.asarray(flow),
        )

    @property
    def _per_unit(self) -> float:
        """The compliance of a surface [1/Pa] that adds one to the scaled J."""
        return self.sought.volume.one_minus_nu * self.units.compliance

    @property
    def bulk(self) -> float | None:
        """Scaled bulk modulus, None for a constant nu."""
        volume = self.sought.volume
        return volume.value * self.units.compliance if volume.name == "bulk_modulus" else None

    @property
    def pull(self) -> float:
        """Scaled 6 pi w R of the work of adhesion w, 0 without adhesion."""
        work, indenter = self.pressing.adhesion, self.pressing.indenter
        return 6.0 * np.pi * work * float(indenter.radius) / self.units.load if work else 0.0

    @property
    def measured(self) -> np.ndarray:
        """The fitted quantity (n,): depth under load control, load under depth control."""
        return self.depth if self.pressing.control == "load" else self.load


def indenter_creep(indenter: Any) -> Spectrum:
    """Return the creep (1 - nu) J [1/Pa] of an indenter of one material, which adds to that of a half-space."""
    material = indenter.material
    if material is None:
        return Spectrum(jnp.zeros(()), jnp.zeros(0), jnp.zeros(0))
    if isinstance(material, jc.LayeredHalfSpace):
        raise ValueError(
            "indenter material: expected one material or None, got LayeredHalfSpace: how a coated indenter creeps depends on"
            " the size of the contact; simulate it with indent"
        )
    bulk = material.bulk_modulus
    share = 1.0 - material.nu if bulk is None else 0.5
    c = surface(material.spectrum(), bulk)
    flow = None if c.fluidity is None else share * c.fluidity
    return Spectrum(share * c.instantaneous, share * c.amplitudes, c.rates, flow)


def prepare(
    data: IndentationData, sought: Sought, pressing: Pressing, instrument: Instrument, weights: str | None, sigma: Any
) -> IndentationProblem:  # fmt: skip
    """Check and scale a test; ValueError with the expected and the received value."""
    probe, control, model = probe_of(pressing.indenter), pressing.control, sought.structure.model

    # 1. Checks of the data and of the choices. Depths beyond the diameter of a ball are in other units.
    check_kind(data, IndentationData)
    if control not in ("load", "depth"):
        raise ValueError(f'control: expected "load" or "depth", got {control!r}')
    rise = pressing.rise
    if rise is not None and not (control == "load" and 0.0 <= rise < data.t[-1] - data.t[0]):
        raise ValueError(f"rise: expected 0 <= rise < the duration, under load control, got {rise!r} s")
    if not pressing.film:  # the grid of a film has checks of its own
        check_depth(pressing.indenter, float(np.ptp(data.depth)))

    # 2. The curve with its history before the selected points, and which of these are in contact and after the rise.
    selected = np.ones(data.t.size, dtype=bool)
    if rise is None:
        data, selected = with_earlier(data)
    work = adhesive_contact.check(pressing.adhesion, data, pressing.indenter, control, model)
    pressing = pressing._replace(adhesion=work)
    t = data.t - data.t[0]
    kept = selected & ((data.load > 0) | (work > 0)) & (data.depth > 0) & (t >= (rise or 0.0))
    if kept.sum() < 5:
        raise ValueError(
            f"data: expected at least 5 points in contact (load and depth > 0), got {kept.sum()}"
        )

    # 3. Weights, units and coordinates.
    if np.shape(sigma) == (selected.sum(),):  # given for the selected points
        sigma = np.insert(np.asarray(sigma, dtype=float), 0, np.full(np.sum(~selected), np.max(sigma)))
    weight, label = indentation_weights(data, kept, control, weights, sigma)
    P, d, T = float(data.load.max()), float(data.depth.max()), float(t[-1])
    layer, stiffer = None, 1.0
    if pressing.thickness is not None:
        # The factor of a layer on a rigid base, and its value at the largest depth; all of that is indentation where the
        # instrument adds nothing, and must lie within the table.
        thin = ThinLayer.of(
            pressing.indenter, pressing.thickness, sought.volume.value, Base(bonded=not pressing.unbonded)
        )
        chi = float(thin.chi(d))
        if chi > LARGEST and instrument == Instrument():
            raise ValueError(
                "thickness: expected a sample with chi (sqrt(R depth)/thickness of a ball) up to"
                f" {LARGEST:g}, got {told_apart(chi, LARGEST, 3)} at the largest depth of {d:.3g} m"
            )
        layer, stiffer = thin.scaled(d), float(jnp.exp(thin.log_factor(d)))
    # compliance [1/Pa] that a scaled compliance of one stands for
    units = Units(T, P, d, probe.size * d**probe.power * stiffer / (sought.volume.one_minus_nu * P))
    # the search space: compliances, above zero at their open end for a film, then the instrument's contributions
    structure, own = sought.structure, sought.structure.units(units.compliance, units.duration)
    sizes = units.depth / np.array([1.0, units.duration, units.load])
    box = np.concatenate([structure.box(sought.table) / own[:, None], instrument.box(sizes)])
    least = LEAST if pressing.film else 0.0
    space = Parameters.of_compliances(structure, box, np.append(own, sizes), least=least)

    # 4. Checks of the contact: under a prescribed load it must not shrink, and it must begin at the first point.
    last = float(data.load[-1])
    if probe.power > 1.0 and control == "load" and rise is None and last < LEAST_LOAD * P:
        raise ValueError(
            f"data: load control requires a growing contact, got a load that falls from {P:g} to {last:g} N;"
            ' leave out the unloading by segment=("approach", "hold"), or use control="depth"'
        )
    if not work and not data.cut:  # under adhesion the load falls before it rises
        found = find_contact(data.t, data.load, data.depth, power=probe.power, film=pressing.stiffened)
        # number of samples that each resampled point represents
        scatter = data.scatter_depth
        samples = np.ones(kept.size) if scatter is None else (scatter.max() / scatter) ** 2
        fitted = round(float(np.sum((kept * samples)[: found.before])))
        if fitted > max(AIR, AIR_SHARE * np.sum(kept * samples)):
            raise ValueError(
                f"data: expected a curve from contact on, got {fitted} points before it, at {found.t:.4g} s and"
                f" {found.depth:.4g} m: data.in_contact({'film=True' if pressing.stiffened else ''}) leaves them out"
            )

    # 5. Notes: points that are not fitted, and a body that creeps under a load whose history before is not known.
    notes = []
    count = np.sum(selected & ~kept)
    if count:
        notes.append(f"{count} points before contact or during the rise not fitted")
    if rise is not None:
        hold = float(data.load[kept].mean())
        off = np.abs(data.load / hold - (np.minimum(t / rise, 1.0) if rise else 1.0))
        most = int(np.argmax(off))
        if off[most] > REPLACED:
            notes.append(
                f"the load that replaces the measured one, with a rise in {rise:g} s, differs from it by up to"
                f" {100.0 * off[most]:.0f} % of the hold, at t = {data.t[most]:g} s"
            )
    elastic = set(sought.structure.where.values()) == {0}
    if not elastic and rise is None and data.load[0] >= STEPPED * P:
        began = f"the first point has {100 * data.load[0] / P:.0f} % of the largest load, taken as applied in"
        if data.t[0] <= 0.0:
            notes.append(
                f"{began} a step at t = 0: after a ramp, whose time changes the moduli, give the curve with its ramp and"
                ' take the hold from it, only("hold")'
            )
        else:
            notes.append(
                f"{began} a step at its time, t = {data.t[0]:g} s: if applied before, the curve should begin there"
            )
    response = data.depth if control == "load" else data.load
    return IndentationProblem(
        data, sought, pressing, probe, units, t / T, data.load / P, data.depth / d, kept,
        weight * float(response.max()), label, space, tuple(notes), layer,
    )  # fmt: skip


def indentation_weights(
    data: IndentationData, kept: np.ndarray, control: str, weights: str | None, sigma: Any
) -> tuple[np.ndarray, str]:
    """Return the weights (n,) [1/unit of the response], zero for points that are not fitted, and their label."""
    kind = "depth" if control == "load" else "load"
    response, scatter = getattr(data, kind), getattr(data, f"scatter_{kind}")
    if weights is None and sigma is None:
        sigma = getattr(data, f"sigma_{kind}")
        weights = "absolute" if sigma is None and scatter is None else None
    if sigma is not None:
        weights, sigma = None, np.broadcast_to(np.asarray(sigma, dtype=float), response.shape)[kept]
    some, chosen = None if scatter is None else scatter[kept], np.zeros(response.shape)
    since = data.t - data.t[0]
    chosen[kept], label = choose_weights(since[kept], response[kept], weights, sigma, some)
    return chosen, label


def start(
    press: IndentationProblem, y: np.ndarray, weights: np.ndarray, history: Any, least: float
) -> np.ndarray:
    """Return coordinates (m,) near the weighted least-squares fit of y (n,) by the columns of ``history`` at the samples.

    Logarithmic coordinates start at log(least) or above.
    """
    space = press.space
    box = _linear_box(space)
    if space.structure.tau is None:
        _, x, tau, _ = varpro.solve(_search(press, y, weights, history))
        found = np.append(x, x[1] / tau)[varpro.PLACES[len(box)]]
    else:
        A = weights[:, None] * np.asarray(columns(history, press.rates))
        low, high = box.T
        found = scipy.optimize.lsq_linear(A, weights * y, (low, np.maximum(high, low + 1e-300))).x
    return space.near(found, least)


def spread_starts(
    press: IndentationProblem, y: np.ndarray, weights: np.ndarray, history: Any
) -> list[np.ndarray]:
    """Return further starting coordinates if a retardation time is sought.

    For each of ``TIMES`` they are the least-squares solution with tau held, and the same total compliance at the end
    divided in the proportions ``SHARED``.
    """
    space = press.space
    if space.structure.tau is not None or space.structure.branches == 0:
        return []
    x = np.asarray(varpro.solve_each(_search(press, y, weights, history), TIMES))
    even = np.outer(x.sum(1), SHARED)
    x, times = np.concatenate([x, even]), np.tile(TIMES, 2)
    return [space.near(np.append(row, row[1] / tau), VISIBLE) for row, tau in zip(x, times, strict=True)]


def _search(press: IndentationProblem, y: np.ndarray, weights: np.ndarray, history: Any) -> varpro.TauProblem:
    return varpro.tau_problem(y, weights, history, press.t, _linear_box(press.space))


def _linear_box(space: Parameters) -> np.ndarray:
    """Return the bounds (size, 2) of the compliances, with those of the search at open sides of linear coordinates."""
    own = space.material
    low, high = space.box[own].T
    return np.stack([np.where(space.logarithmic[own], low, space.lower[own]), high], -1)


class Medium(NamedTuple):
    """The indented body: thickness [m], substrate, grid of the solver, and whether the layer slides on the substrate.

    discretisation (m,): the discretisation bias of the coordinates that remains; bias: {coordinate: that bias over its
    standard error}. For a half-space None, zero and empty.
    """

    thickness: float | None = None
    substrate: Any = None
    grid: Any = None
    discretisation: np.ndarray = np.zeros(1)
    bias: dict[str, float] = {}  # noqa: RUF012
    unbonded: bool = False


class Found(NamedTuple):
    """Result of the search of an indentation fit.

    press: the test; best: the optimum and objective; notes; moves(name) (m,): derivative of the coordinates with
    respect to a quantity held in the fit; medium: the indented body; residual (n,): function of the coordinates, None
    where it is expensive; slow: the optimum with the relaxed compliance at the edge of an adhesive contact; against:
    reasons for rejecting the fit.
    """

    press: IndentationProblem
    best: Best
    objective: Objective
    notes: tuple[str, ...]
    moves: Callable[[str], np.ndarray]
    medium: Medium
    residual: Callable[[Any], Any] | None = None
    slow: Best | None = None
    against: tuple[str, ...] = ()


MARCHED = 96  # number of march times if there are more samples
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
    if t.size <= MARCHED:
        return t
    ends = [0, *turns(t, drive), t.size - 1]
    each = max(MARCHED // 2 // (len(ends) - 1), 2)
    after = [low + np.geomspace(1, high - low, each) for low, high in itertools.pairwise(ends)]
    evenly = np.searchsorted(t, np.linspace(0.0, t[-1], MARCHED // 2))
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
