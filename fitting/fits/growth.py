"""Fit of growth kinetics to the thickness of a film over time, at one or several stresses and temperatures."""

import dataclasses
import functools
import itertools
import math
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy
from jax import Array

import jaxcontact as jc
from fitting.data.curves import evaluation_times
from fitting.data.growth import GrowthData
from fitting.data.weights import choose_weights
from fitting.inference import verdict
from fitting.inference.noise import chance_of_gain, log_likelihood, two_sided
from fitting.inference.result import Fit, FitProblem, conclude, least_squares, plain
from fitting.inference.sample import Sample
from fitting.models.parameters import Parameters
from fitting.models.structure import ParameterList, Sought, limits
from fitting.search import nonlinear
from fitting.search.nonlinear import Objective, linear_sd
from fitting.views import sheet, text
from jaxcontact._support.exponential import phi1

# Stress-activated growth of a film with removal in proportion to its thickness, in closed form.


BOLTZMANN = 1.380649e-23  # J/K, exact
BARRIER = 500.0  # activation energy over kT above which nothing grows
DIMENSIONS = {"rate": "m/s", "activation_energy": "J", "activation_volume": "m3", "removal_rate": "1/s"}


@functools.partial(jax.tree_util.register_dataclass, data_fields=list(DIMENSIONS), meta_fields=[])
@dataclasses.dataclass(frozen=True)
class GrowthKinetics:
    """Kinetics of a film that grows by a stress-activated process and is removed in proportion to its thickness.

        dh/dt = R - removal_rate h,     R = rate exp(-(activation_energy - activation_volume stress)/(k T))
        h(t) = initial exp(-removal_rate t) + R (1 - exp(-removal_rate t))/removal_rate

    at constant stress and temperature T; k is Boltzmann's constant.

    Source: N. N. Gosvami et al., Science 348 (2015) 102; J. Zhang, H. Spikes, Tribol. Lett. 63 (2016) 24.

    Args:
        rate: pre-exponential factor [m/s].
        activation_energy: [J].
        activation_volume: [m3].
        removal_rate: [1/s]; 0 without removal.

    Example:
        >>> kinetics = fitting.GrowthKinetics(1e-2, 1.2e-19, 4e-30, 1e-4)
        >>> print(f"{kinetics.thickness(3600.0, stress=1e9, temperature=373.0):.3g} m")
        4.99e-09 m
    """

    rate: Array | float
    activation_energy: Array | float
    activation_volume: Array | float
    removal_rate: Array | float

    def growth_rate(self, stress: Any, temperature: Any) -> Array:
        """Return R [m/s] at a stress [Pa] and a temperature [K], of any shapes that broadcast."""
        energy = self.activation_energy - self.activation_volume * jnp.asarray(stress)
        return self.rate * jnp.exp(-energy / (BOLTZMANN * jnp.asarray(temperature)))

    def thickness(self, t: Any, stress: Any, temperature: Any, initial: Any = 0.0) -> Array:
        """Return the thickness h(t) [m] at times t [s], with an initial thickness [m]; the shapes must broadcast."""
        t = jnp.asarray(t, dtype=float)
        decay = self.removal_rate * t
        return initial * jnp.exp(-decay) + self.growth_rate(stress, temperature) * t * phi1(decay)

    def law(self, temperature: float | None = None, stress: str = "pressure") -> Any:
        """Return the law for ``jaxcontact.rub`` at a temperature [K], by default that of the contact.

        stress: the stress that drives the growth, "pressure" or "shear".
        """
        grown = (self.rate, self.activation_energy, self.activation_volume)
        return jc.StressActivated(*grown, temperature, stress=stress) + jc.ProportionalRemoval(
            self.removal_rate
        )


# The thickness of a film that grows in a contact, with the pressure of the contact on the film as it grows.


FIELDS = ("body", "indenter", "grid", "velocity", "friction", "radius", "thickest")


@functools.partial(
    jax.tree_util.register_dataclass, data_fields=list(FIELDS), meta_fields=["stress", "substeps"]
)
@dataclasses.dataclass(frozen=True, repr=False)
class RubbedContact:
    """The contact in which growth curves were measured, for ``fit_growth(contact=...)``.

    The film is rubbed in place (``jaxcontact.rub``): its thickness changes the pressure, which drives its growth. The
    measured thickness is the mean over all cells whose centres lie within ``radius`` of the axis.

    Args:
        body: a ``LayeredHalfSpace`` with one ``Layer`` on an elastic substrate; the thickness of the layer is replaced by
            the initial thickness of each curve.
        indenter: the indenter.
        grid: the ``Grid``, whose cells should be well below the contact radius: about 24 across the grid suffice for a fit.
        velocity: rubbing velocity [m/s].
        friction: coefficient of friction.
        radius: of the area over which the thickness is measured [m]; at least half the diagonal of a cell.
        thickest: largest thickness that the film may reach in the search [m], with a margin.
        stress: the stress that drives the growth, "pressure" or "shear" for friction x pressure.
        substeps: steps between two points of a curve.

    Example:
        >>> steel, film = jc.Elastic.from_young(210e9), jc.Elastic.from_young(40e9)
        >>> body = jc.LayeredHalfSpace([jc.Layer(film, 0.0)], substrate=steel)
        >>> contact = fitting.RubbedContact(body, jc.Sphere(9.5e-3, steel), jc.Grid.square(n=16, width=400e-6), velocity=0.1,
        ...                                 friction=0.1, radius=30e-6, thickest=5e-7, stress="shear")
        >>> kinetics = fitting.GrowthKinetics(1e-2, 1.04e-19, 4e-29, 1e-3)
        >>> h = contact.thickness(kinetics, [600.0, 1200.0], load=60.0, temperature=373.0)
        >>> bool(h[1] > h[0] > 1e-9)
        True
    """

    body: Any
    indenter: Any
    grid: Any
    velocity: Any
    friction: Any
    radius: Any
    thickest: Any
    stress: str = "pressure"
    substeps: int = 1

    def __repr__(self) -> str:
        cells = " x ".join(map(str, self.grid.shape))
        return (
            f"RubbedContact of a {type(self.indenter).__name__} at {self.velocity:.4g} m/s on {cells} cells, thickness"
            f" within {self.radius:.4g} m, growth by {self.stress}"
        )

    def thickness(
        self, kinetics: GrowthKinetics, t: Any, *, load: Any, temperature: Any, initial: Any = 0.0
    ) -> Array:
        """Return the mean thickness [m] at times t (n,) [s] under a load [N] at a temperature [K], (n,).

        It is nan from a time on at which there is no solution, or the film is thicker than ``thickest``.
        """
        run = self.run(kinetics, t, load=load, temperature=temperature, initial=initial)
        usable = [jc.Status.FINE, jc.Status.STEP_TOO_LONG, jc.Status.INHERITED]
        failed = jnp.cumsum(~jnp.isin(run.status, jnp.array(usable))) > 0
        found: Array = jnp.where(failed, jnp.nan, run.saved)[1:]
        return found

    def run(
        self, kinetics: GrowthKinetics, t: Any, *, load: Any, temperature: Any, initial: Any = 0.0
    ) -> Any:
        """Return the ``RubbingHistory`` of a curve at the times 0 and t, with the mean thickness in ``saved``."""
        law, measured = kinetics.law(temperature, stress=self.stress), self.cells()
        t, (film,) = jnp.asarray(t, dtype=float), self.body.sublayers()
        body = jc.LayeredHalfSpace([jc.Layer(film.material, initial, film.bonded)], self.body.substrate)

        def mean_thickness(step: Any) -> Array:
            return jnp.sum(measured * step.thickness)

        return jc.rub(
            body, self.indenter, jc.Load(load), jnp.append(0.0, t), velocity=self.velocity, law=law, grid=self.grid,
            friction=self.friction, thickest=self.thickest, substeps=self.substeps,
            save=mean_thickness,
        )  # fmt: skip

    def cells(self) -> Array:
        """Return the weight of each cell in the mean, (nx, ny)."""
        x, y = self.grid.coordinates()
        inside = (x**2 + (0.0 if self.grid.plane_strain else y**2)) <= jnp.asarray(self.radius) ** 2
        return jnp.where(inside, 1.0, 0.0) / jnp.maximum(jnp.sum(inside), 1)

    def check(self) -> None:
        """Raise ValueError where the thickness would be measured at no cell."""
        if not np.any(np.asarray(self.cells()) > 0.0):
            raise ValueError(
                f"contact radius [m]: expected one that contains the centre of a cell, got {float(self.radius):g}"
            )


# Coordinates, residuals and starting values of the search for growth kinetics.
#
# The search is over log rate, activation energy over k T0, activation volume over k T0/s0 and removal rate times the
# duration, with T0 a mean temperature and s0 the largest stress of the data. The logarithm of the growth rate is
# linear in the first three, so that the valley in which they compensate each other is straight, and the search and
# its profiles follow it however narrow the range of temperatures and stresses is.


LARGEST = 200.0  # activation energy and work of the stress over k T0 at which the search ends
REACH = 230.0  # of log rate, likewise, about the logarithm of a growth rate of the data
OPEN = 100.0  # of both, beyond which the end of an interval is that of the search and not of the data
SAME = 1e-6  # singular value below which conditions are the same
FASTEST = 1e4  # removal rate times the duration
STARTS = (0.0, 0.3, 3.0, 30.0)  # removal rates times the duration
WAITS = (0.0, 0.1, 0.25, 0.5)  # induction times of the starts over the duration
LATEST = 0.95  # induction time over the duration at which the search ends
EXPECTED = (20.0, 1.0)  # energy and work over k T0 to start from where the data do not determine them
IN_CONTACT = 1e-9  # relative change of the sum of squares at convergence with a contact, solved to 1e-8
WEAK = 1e-3  # weight of these beside the logarithm of a growth rate
STRUCTURE = ParameterList.of(
    GrowthKinetics, DIMENSIONS, zeros=("activation_energy", "activation_volume", "removal_rate")
)


def _undetermined(middle: float, lost: tuple[int, ...], theta: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return which interval ends (5, 2) say nothing: those that lie as far as the box of the search, from the middle of log
    rate and from an energy and a work of 0, and both of each parameter that the curves do not determine, ``lost``.

    A module function, so that fits can be pickled.
    """
    away = np.abs(ends - np.array([middle, 0.0, 0.0, np.nan, np.nan])[:, None]) >= OPEN
    away[list(lost)] = True
    return away


class Curves(NamedTuple):
    """Growth curves one after the other: each array (n,), in SI; which: the curve of a point."""

    data: tuple[GrowthData, ...]
    t: np.ndarray
    measured: np.ndarray
    stress: np.ndarray
    temperature: np.ndarray
    initial: np.ndarray
    which: np.ndarray

    @classmethod
    def of(cls, data: tuple[GrowthData, ...]) -> "Curves":
        """Return the points of all curves."""
        count = [one.t.size for one in data]
        repeat = lambda name: np.repeat([getattr(one, name) for one in data], count)
        stress, temperature, initial = (repeat(name) for name in ("stress", "temperature", "initial"))
        t, measured = (np.concatenate([getattr(one, name) for one in data]) for name in ("t", "thickness"))
        return cls(data, t, measured, stress, temperature, initial, np.repeat(np.arange(len(data)), count))

    @property
    def duration(self) -> float:
        """Duration of the longest curve [s]."""
        return float(self.t.max())

    @property
    def mean_temperature(self) -> float:
        """Harmonic mean temperature of all points [K]."""
        return 1.0 / float(np.mean(1.0 / self.temperature))

    @property
    def reference(self) -> tuple[float, float]:
        """Mean conditions (stress [Pa], temperature [K]), at which 1/T and stress/T have their mean over all points."""
        mean = self.mean_temperature
        return float(np.mean(self.stress / self.temperature)) * mean, mean

    @property
    def unit(self) -> np.ndarray:
        """SI values (5,) of coordinates of one."""
        energy, end = BOLTZMANN * self.mean_temperature, self.duration
        return np.array([1.0, energy, energy / (float(self.stress.max()) or 1.0), 1.0 / end, end])

    def sample(self, weights: str | None) -> Sample:
        """Return the points with their weights."""
        sigma = None
        if self.data[0].sigma is not None:
            sigma = np.concatenate([one.sigma for one in self.data])
        if weights is None and sigma is None:
            weights = "estimated"
        apart = self.t - 2.0 * self.duration * self.which  # so that no difference spans two curves
        point_weights, label = choose_weights(apart, self.measured, weights, None if weights else sigma)
        return Sample.of(("thickness", "m", self.t, self.measured), point_weights, label, self.which)

    def space(self, table: dict[str, tuple[float, float]], induction: str | float | None) -> Parameters:
        """Return the box of the search from the bounds of the parameters; induction: as in ``fit_growth``."""
        middle = math.log(float(np.max(np.abs(self.measured))) / self.duration)
        widest = [(middle - REACH, middle + REACH), (0.0, LARGEST), (0.0, LARGEST), (0.0, FASTEST)]
        logarithmic = np.arange(4) == 0
        with np.errstate(divide="ignore"):
            given = [
                np.log(table[name]) if log else np.array(table[name])
                for name, log in zip(table, logarithmic, strict=True)
            ]
        rows = [
            _within(own, bound / unit) for own, bound, unit in zip(widest, given, self.unit[:4], strict=True)
        ]
        held = 0.0 if induction is None else induction
        waits = (0.0, LATEST) if isinstance(held, str) else (held / self.duration,) * 2
        # parameters that compensate each other: once one of them is bounded, the bounds give ends to the others, too
        lost = self.lost(table)
        if any(table[list(DIMENSIONS)[i]] != (0.0, math.inf) for i in lost):
            lost = ()
        return Parameters.of(
            STRUCTURE, [*rows, waits], unit=self.unit, logarithmic=np.arange(5) == 0, material=np.arange(5) < 4,
            nuisances=("induction",), undetermined=functools.partial(_undetermined, 0.5 * sum(rows[0]), lost),
        )  # fmt: skip

    def objective(self, space: Parameters, weights: np.ndarray) -> Objective:
        """Return the least squares over the coordinates (5,), with the prescribed stress of each curve."""
        columns = (self.t, self.stress, self.temperature, self.initial)
        inputs = (*map(nonlinear.repeated, columns), self.unit)
        measured, padded = nonlinear.repeated(self.measured), nonlinear.without_weight(weights)
        return Objective.of(_thickness, inputs, measured, padded, space, points=slice(self.t.size))

    def objective_in(self, contact: RubbedContact, space: Parameters, weights: np.ndarray) -> Objective:
        """Return the least squares over the coordinates (5,), with the stress of a contact on the growing film, curve by
        curve."""
        ends = np.cumsum([one.t.size for one in self.data])[:-1]
        each = []
        for one, own in zip(self.data, np.split(weights, ends), strict=True):
            inputs = contact, one.t, (one.load, one.temperature, one.initial), self.unit
            each.append(Objective.of(_thickness_in_contact, inputs, one.thickness, own, space))
        return Objective(
            lambda theta: np.concatenate([one.residual(theta) for one in each]),
            lambda theta, free: np.concatenate([one.jacobian(theta, free) for one in each]),
            *space.bounds, ftol=IN_CONTACT, floor=sum(one.floor for one in each),
        )  # fmt: skip

    def starts(self, space: Parameters) -> list[np.ndarray]:
        """Return starts of the search, coordinates (5,), one for each of several removal rates and induction times.

        With both of these given the thickness is linear in the growth rate of each curve, and the logarithm of the growth
        rate is linear in log rate, energy and work: two linear regressions.
        """
        lower, upper = space.bounds
        removals = np.unique(np.clip(STARTS, lower[3], upper[3]))
        waits = np.unique(np.clip(WAITS if upper[4] > lower[4] else lower[4:], lower[4], upper[4]))
        of_curve = lambda values: np.bincount(self.which, values)
        A = np.concatenate([self._design(), WEAK * np.eye(3)[1:]])
        low, high, found = lower[:3], upper[:3], []
        free = low < high
        for removal, wait in itertools.product(removals, waits):
            since = np.maximum(self.t - wait * self.duration, 0.0)
            decay = removal * since / self.duration
            grown, rest = since * np.asarray(phi1(decay)), self.measured - self.initial * np.exp(-decay)
            speed = of_curve(grown * rest) / of_curve(grown**2)
            y = np.log(np.maximum(speed, 1e-3 * np.max(np.abs(speed))))
            y = np.append(y, WEAK * np.array(EXPECTED))
            x = low.copy()
            if free.any():
                y = y - A[:, ~free] @ x[~free]
                x[free] = scipy.optimize.lsq_linear(A[:, free], y, (low[free], high[free])).x
            found.append(np.clip(np.append(x, [removal, wait]), lower, upper))
        return found

    def _design(self) -> np.ndarray:
        """Return the derivative (curves, 3) of the log growth rate of each curve by log rate, energy and work."""
        first = np.unique(self.which, return_index=True)[1]
        over = self.mean_temperature / self.temperature[first]
        return np.stack(
            [np.ones(first.size), -over, over * self.stress[first] / (self.stress.max() or 1.0)], -1
        )

    def lost(self, table: dict[str, tuple[float, float]]) -> tuple[int, ...]:
        """Return the places of the parameters that the conditions of the curves do not determine, whatever the errors."""
        free = [i for i, name in enumerate(list(DIMENSIONS)[:3]) if table[name][0] < table[name][1]]
        A = self._design()[:, free]
        rank = lambda columns: np.linalg.matrix_rank(columns, tol=SAME)
        return tuple(i for k, i in enumerate(free) if rank(np.delete(A, k, 1)) == rank(A))


def _within(widest: tuple[float, float], given: np.ndarray) -> tuple[float, float]:
    """Return the range of the search of a coordinate: the widest one cut to the given bounds, moved there if they do not
    overlap."""
    low, high = map(float, given)
    if low == high:
        return low, high
    size = widest[1] - widest[0]
    least = widest[0] if high > widest[0] else high - size
    most = widest[1] if low < widest[1] else low + size
    return max(least, low), min(most, high)


def to_si(theta: Array, unit: Array) -> Array:
    """Return parameters in SI from their coordinates, (4,), or with the induction time (5,)."""
    return jnp.append(jnp.exp(theta[:1]), theta[1:]) * unit[: theta.size]


def _thickness(theta: Array, inputs: tuple[Array, ...]) -> Array:
    """Return the thickness (n,) at times, stresses, temperatures and initial thicknesses (n,)."""
    t, stress, temperature, initial, unit = inputs
    *parameters, induction = to_si(theta, unit)
    since = jnp.maximum(t - induction, 0.0)
    return GrowthKinetics(*parameters).thickness(since, stress, temperature, initial)


def _thickness_in_contact(theta: Array, inputs: tuple) -> Array:
    """Return the thickness (n,) of one curve in a ``RubbedContact``, with its load, temperature and initial thickness."""
    contact, t, (load, temperature, initial), unit = inputs
    kinetics = GrowthKinetics(*to_si(theta[:4], unit))
    return contact.thickness(kinetics, t, load=load, temperature=temperature, initial=initial)


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class GrowthFit(Fit):
    """Result of the fit of growth kinetics; the attributes common to all fits are documented in ``Fit``.

    The parameters are "rate" [m/s], "activation_energy" [J], "activation_volume" [m3] and "removal_rate" [1/s],
    ``material`` is a ``GrowthKinetics``, and ``data`` a tuple of curves. ``curve``, ``fitted`` and ``residuals`` hold all
    curves one after the other.

    Attributes:
        reference: (stress [Pa], temperature [K]) of the mean conditions of the data.
        starts: (number of local searches, number that reached this minimum).
        induction: (value, low, high) [s]: time before which the thickness is the initial one; equal values if it was given.
        contact: the contact of the fit, None for prescribed stresses. ``predict``, ``band`` and ``growth_rate`` are those
            at a prescribed stress; ``contact.thickness(material, t, load=..., temperature=...)`` is that in the contact.
    """

    reference: tuple[float, float]
    starts: tuple[int, int]
    induction: tuple[float, float, float] = (0.0, 0.0, 0.0)
    contact: RubbedContact | None = dataclasses.field(default=None, repr=False)
    slopes: np.ndarray = dataclasses.field(repr=False)

    def growth_rate(
        self, stress: float | None = None, temperature: float | None = None
    ) -> tuple[float, float, float]:
        """Return the growth rate without removal R [m/s] and the limits of its interval, linearised in log R.

        stress [Pa] and temperature [K]: by default those of ``reference``.
        """
        at = [
            own if given is None else given
            for given, own in zip((stress, temperature), self.reference, strict=True)
        ]
        best = float(self.material.growth_rate(*at))
        spread = self._spread(lambda kinetics, induction: jnp.log(kinetics.growth_rate(*at)))
        with np.errstate(over="ignore"):
            return best, best * float(np.exp(-spread)), best * float(np.exp(spread))

    def predict(self, t: Any, stress: Any = None, temperature: Any = None, initial: Any = 0.0) -> np.ndarray:
        """Return the thickness [m] at times t [s] of any shape, with an initial thickness [m].

        stress [Pa] and temperature [K]: by default those of ``reference``.
        """
        return np.asarray(self._thickness(t, stress, temperature, initial)(self.material, self.induction[0]))

    def band(
        self, t: Any, stress: Any = None, temperature: Any = None, initial: Any = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the limits (low, high) of the thickness [m] at the fit's level, linearised; arguments as in ``predict``."""
        run = self._thickness(np.atleast_1d(t), stress, temperature, initial)
        best, spread = np.asarray(run(self.material, self.induction[0])), self._spread(run)
        return np.maximum(best - spread, 0.0), best + spread

    def _thickness(
        self, t: Any, stress: Any, temperature: Any, initial: Any
    ) -> Callable[[GrowthKinetics, Any], Array]:
        own = self.reference
        at = own[0] if stress is None else stress, own[1] if temperature is None else temperature
        times = evaluation_times(t)
        return lambda kinetics, induction: kinetics.thickness(
            jnp.maximum(times - induction, 0.0), *at, initial
        )

    def _spread(self, run: Callable[[GrowthKinetics, Any], Array]) -> np.ndarray:
        """Return half the interval of a function of kinetics and induction time at the fit's level, linearised."""
        names = list(self.values)
        free = [i for i, name in enumerate(names) if name not in self.fixed]
        best, unit = self.estimate.best, Curves.of(self.data).unit
        if self.induction[1] < self.induction[2]:
            free.append(4)

        def moved(z: Array) -> Array:
            *parameters, induction = to_si(z, unit)
            return run(GrowthKinetics(*parameters), induction)

        z = np.concatenate([np.log(best[:1]), best[1:] / unit[1:4], [self.induction[0] / unit[4]]])
        gradient = np.asarray(jax.jacfwd(moved)(jnp.asarray(z)))
        sd = linear_sd(self.slopes, np.atleast_2d(gradient)[:, free], np.ones(len(free), dtype=bool))
        return two_sided(self.level) * sd.reshape(gradient.shape[:-1])

    def plot(self, path: Any = None) -> Any:
        """Return a figure of the curves with the fit, the residuals and the parameters; save it where a path is given."""
        ends = np.cumsum([one.t.size for one in self.data])[:-1]
        parts = [np.split(values, ends) for values in (sheet.deviations(self), self.fitted)]

        def panel(top: Any, bottom: Any) -> None:
            for k, (one, residual, fitted) in enumerate(zip(self.data, *parts, strict=True)):
                colour, line = f"C{k % 10}", np.linspace(0.0, one.t[-1], 200)
                top.plot(one.t, one.thickness, ".", markersize=4, color=colour)
                bottom.plot(one.t, residual, ".", markersize=4, color=colour)
                if self.contact is not None:  # the band at a prescribed stress would be another one
                    load = f"{one.load:.4g} N, {one.temperature:.4g} K"
                    top.plot(one.t, fitted, color=colour, label=load)
                    continue
                at = one.stress, one.temperature, one.initial
                label = f"{one.stress / 1e6:.4g} MPa, {one.temperature:.4g} K"
                top.plot(line, self.predict(line, *at), color=colour, label=label)
                low, high = self.band(line, *at)
                if np.all(np.isfinite(high)):
                    top.fill_between(line, low, high, color=colour, alpha=0.2)
            sheet.axis_label(top.yaxis, "thickness", "m", self.curve[3])
            bottom.set(xlabel="t [s]", ylabel=sheet.RESIDUAL)

        return sheet.draw(self, path, panel)

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with the conditions of the curves and the growth rate at their mean."""
        curves = [
            {"stress_Pa": one.stress, "temperature_K": one.temperature, "points": one.t.size}
            for one in self.data
        ]
        rate = dict(zip(("value", "low", "high"), map(plain, self.growth_rate()), strict=True))
        stress, temperature = self.reference
        at = {"stress_Pa": stress, "temperature_K": temperature, "growth_rate_m_per_s": rate}
        own = {"curves": curves, "reference": at, "starts": self.starts[0], "starts_agreed": self.starts[1]}
        own["induction_s"] = plain(self.induction)
        return super().to_dict() | own

    def _points(self) -> str:
        several = f"{len(self.data)} curves, " if len(self.data) > 1 else ""
        return f"{several}{super()._points()}"

    def _nuisance_lines(self) -> list[str]:
        value, low, high = self.induction
        if high > low:
            return [f"  induction time = {value:.5g} s, {low:.4g} to {high:.4g}"]
        return [f"  induction time = {value:.5g} s, given"] if value > 0.0 else []

    def _combination_lines(self) -> list[str]:
        best, low, high = self.growth_rate()
        stress, temperature = self.reference
        interval = text.span(low, high) if math.isfinite(high) else "not determined"
        return [
            f"  growth rate at {stress:.4g} Pa and {temperature:.4g} K = {best:.5g} m/s, {100 * self.level:g} %"
            f" interval {interval}"
        ]

    def _conditions(self) -> list[str]:
        return [f"  {self.starts[1]} of {self.starts[0]} starts converged to this minimum"]


def fit_growth(
    data: GrowthData | Sequence[GrowthData], *, weights: str | None = None, fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None, level: float = 0.95, contact: RubbedContact | None = None,
    induction: str | float | None = None,
) -> GrowthFit:  # fmt: skip
    """Fit rate, activation energy, activation volume and removal rate to growth curves of a film.

        dh/dt = rate exp(-(activation_energy - activation_volume stress)/(k T)) - removal_rate h     for t > induction

    with the constant stress and temperature T of each curve; before the induction time, which is the same for all curves
    and 0 by default, the thickness is the initial one. One error model applies to all curves. A fit is rejected if the
    residuals of several curves have a common shape, or if an induction time describes the curves better than independent
    or correlated errors do without it (ratio of likelihoods, at a level of 0.1 %).

    With ``contact`` the stress is that of the contact on the film as it grows, which each evaluation of the search
    computes with ``jaxcontact.rub``. The search starts from the fit at the prescribed stresses. It takes a few hundred runs
    of each curve, for which a coarse grid is recommended.

    If all curves have the same temperature, activation energy and rate cannot be determined separately, and if all have the
    same stress, activation volume and activation energy. Such parameters are reported as not determined, unless enough
    of them are held by ``fixed``; the growth rate at the conditions of the data, ``GrowthFit.growth_rate()``, is determined
    in any case. From curves in the steady state only the ratio of growth rate and removal rate can be determined.

    Source: N. N. Gosvami et al., Science 348 (2015) 102; J. Zhang, H. Spikes, Tribol. Lett. 63 (2016) 24.

    Args:
        data: one ``GrowthData``, or a sequence of them for several stresses and temperatures.
        weights: "estimated" (the default without standard deviations in the data): standard deviation (a^2 + (b h)^2)^(1/2),
            a and b estimated;
            "proportional" or "relative" (errors are a fraction of the fitted or of the measured thickness) or "absolute"
            (one error for all).
        fixed: {parameter: value} of any subset of "rate" [m/s], "activation_energy" [J], "activation_volume" [m3] and
            "removal_rate" [1/s]; all but the rate may be 0.
        bounds: {parameter: (low, high)} of any subset, None for an open side.
        level: confidence level of the intervals.
        contact: None, or the ``RubbedContact`` of all curves, which then have a load.
        induction: time [s] before which there is neither growth nor removal: "fit", a number, or None for 0. It cannot be
            combined with ``contact``.

    Returns:
        A ``GrowthFit``: the kinetics with the intervals of their parameters, and whether the fit is accepted.

    Raises:
        ValueError: data of another type, standard deviations for some of the curves only, unknown parameters, two choices
            of weights, too few points, or an induction time that is negative or not before the end of the data.

    Example:
        >>> t, kinetics = np.linspace(0.0, 3600.0, 13), fitting.GrowthKinetics(1e-2, 1.2e-19, 4e-30, 5e-4)
        >>> data = [fitting.GrowthData(t, kinetics.thickness(t, stress, temperature), stress=stress, temperature=temperature)
        ...         for stress, temperature in [(3e8, 353.0), (9e8, 353.0), (3e8, 393.0)]]
        >>> fit = fitting.fit_growth(data, weights="absolute")
        >>> print(f"{fit.values['activation_energy']:.4g} J, {fit.values['activation_volume']:.4g} m3")
        1.2e-19 J, 4e-30 m3
    """
    curves = Curves.of(_checked(data))
    energy = (fixed or {}).get("activation_energy", 0.0)
    if isinstance(energy, int | float) and energy > BARRIER * BOLTZMANN * float(curves.temperature.max()):
        raise ValueError(
            f"fixed['activation_energy']: expected an energy [J] of one process, 1 eV being 1.602e-19 J, got {energy:g}"
        )
    sample = curves.sample(weights)
    sought = Sought(STRUCTURE, limits(STRUCTURE, fixed, bounds), None)
    valid = induction is None or induction == "fit"
    if not valid and np.ndim(induction) == 0 and np.asarray(induction).dtype.kind in "fiu":
        valid = 0.0 <= float(induction) < curves.duration  # type: ignore[arg-type]
    if not valid:
        raise ValueError(
            f'induction: expected "fit", None or a time from 0 to the end of the data, {curves.duration:g} s, got'
            f" {induction!r}"
        )
    if induction is not None and contact is not None:
        raise ValueError(f"induction: expected None with contact=, got {induction!r}")
    space = curves.space(sought.table, induction)
    problem = FitProblem(curves.data, sought, space, sample, curves.duration, level)
    solved = least_squares(problem, lambda weights: curves.objective(space, weights), curves.starts(space))
    best, _ = solved.search_result  # before a contact, whose search has a single start
    notes = [note for one in curves.data for note in one.notes]
    lost = ", ".join(list(DIMENSIONS)[i] for i in curves.lost(sought.table))
    if lost:
        temperatures, stresses = (np.unique(values).size for values in (curves.temperature, curves.stress))
        notes.append(
            f"temperatures: {temperatures}, stresses: {stresses}: the curves do not determine {lost} separately, only the"
            " growth rate; hold what is known by fixed=, or add curves at other temperatures or stresses"
        )

    # In a contact the search begins with the parameters at the prescribed stresses.
    if contact is not None:
        if not isinstance(contact, RubbedContact):
            raise ValueError(f"contact: expected RubbedContact or None, got {type(contact).__name__}")
        contact.check()
        without = sum(one.load is None for one in curves.data)
        if without:
            raise ValueError(
                f"load: expected one for every curve with contact=, got none for {without} of {len(curves.data)}"
            )
        start = np.clip(solved.theta, *space.bounds)
        solved = least_squares(problem, lambda weights: curves.objective_in(contact, space, weights), [start])
        kinetics = GrowthKinetics(*to_si(jnp.asarray(solved.theta[:4]), curves.unit))
        said: list[tuple[str, str]] = []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the fit has them as notes
            for one in curves.data:
                given = {"load": one.load, "temperature": one.temperature, "initial": one.initial}
                said += [(note.kind, note) for note in contact.run(kinetics, one.t, **given).notes]
        notes += [f"contact of {line}" for line in text.counted(said, len(curves.data))]

    # Residuals of a shape that all curves have in common reject the fit.
    noise = sample.noise(solved, problem.p)
    against = verdict.reason_of_common_shape(
        solved.residual, solved.jacobian, curves.which, curves.t, noise.white
    )
    if against and induction is None and contact is None:
        against = (f'{against[0]}, as an induction time would be (induction="fit")',)

    # A growth that begins late. Its residuals differ in size from curve to curve, and a correlated noise describes them
    # well. Of the ratio of likelihoods with an induction time and without, each with AR(1) noise, ``chance_of_gain`` is the
    # probability; only half of all fits without such a time gain from one, since it is not negative.
    real = sample.real(solved.residual, problem.p) and sample.size > problem.p + 1
    if induction is None and contact is None and real:
        wider = curves.space(sought.table, "fit")
        starts = [np.append(solved.theta[:4], wait) for wait in WAITS]
        late = least_squares(
            dataclasses.replace(problem, space=wider),
            lambda weights: curves.objective(wider, weights),
            starts,
        )
        likely = lambda found: log_likelihood(found.residual, found.weights, curves.which)
        gain, size = likely(late) - likely(solved), solved.residual.size
        chance = 0.5 * chance_of_gain(gain, size, size - problem.p - 1)
        if chance < verdict.CHANCE:
            against += (
                f"an induction time of {late.theta[4] * curves.duration:.3g} s describes the curves better, as noise"
                f' alone lets it with a probability of {chance:.1g}: fit it by induction="fit"',
            )
    found = conclude(problem, solved._replace(notes=notes, against=against))
    waits = np.array([solved.theta[4], *found.ends[4]]) * curves.unit[4]
    return found.fit(
        GrowthFit,
        induction=tuple(waits.tolist()),
        contact=contact,
        reference=curves.reference,
        starts=(best.starts, best.agreed),
        slopes=found.assessment.slopes,
    )


def _checked(data: Any) -> tuple[GrowthData, ...]:
    """Return the curves; ValueError for other data, or standard deviations of some of the curves only."""
    several = (
        (data,) if isinstance(data, GrowthData) else tuple(data) if isinstance(data, list | tuple) else ()
    )
    if not several or not all(isinstance(one, GrowthData) for one in several):
        got = ", ".join(type(one).__name__ for one in several) or type(data).__name__
        raise ValueError(f"data: expected one GrowthData or a list of them, got {got}")
    known = [one.sigma is not None for one in several]
    if any(known) and not all(known):
        raise ValueError(f"sigma: expected in all curves or in none, got {sum(known)} of {len(known)}")
    return several
