"""Fit of growth kinetics to the thickness of a film over time, at one or several stresses and temperatures."""

import dataclasses
import math
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.data.curves import evaluation_times
from fitting.data.growth import GrowthData
from fitting.fits.growth_search import STRUCTURE, Curves, to_si
from fitting.inference import common_shape, student
from fitting.inference.conclusion import FitProblem, conclude, least_squares
from fitting.inference.result import Fit, plain
from fitting.models.kinetics import GrowthKinetics
from fitting.models.rubbed_contact import RubbedContact
from fitting.models.structure import Sought, limits
from fitting.search.uncertainty import linear_sd
from fitting.views import growth_picture, report


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
        """Half the interval of a function of the kinetics and the induction time, at the fit's level."""
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
        return student.two_sided(self.level) * sd.reshape(gradient.shape[:-1])

    def plot(self, path: Any = None) -> Any:
        """Return a figure of the curves with the fit, the residuals and the parameters; save it where a path is given."""
        return growth_picture.draw(self, path)

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
        interval = report.span(low, high) if math.isfinite(high) else "not determined"
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
    residuals of several curves have a common shape, as they have if an induction time is left out.

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
        weights: "estimated" (the default without standard deviations in the data): errors a + b h, estimated;
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
        The kinetics with the intervals of their parameters, and how well the data determine them.

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
    sample = curves.sample(weights)
    sought = Sought(STRUCTURE, limits(STRUCTURE, fixed, bounds), None)
    _check_induction(induction, curves, contact)
    space = curves.space(sought.table, induction)
    problem = FitProblem(curves.data, sought, space, sample, curves.duration, level)
    solved = least_squares(problem, lambda weights: curves.objective(space, weights), curves.starts(space))
    best, _ = solved.whole
    if contact is not None:
        _check_contact(contact, curves)
        start = np.clip(solved.theta, *space.bounds)
        solved = least_squares(problem, lambda weights: curves.objective_in(contact, space, weights), [start])
    notes = [note for one in curves.data for note in one.notes] + curves.notes(sought.table)
    if contact is not None:
        notes += _of_contact(
            contact, curves, GrowthKinetics(*to_si(jnp.asarray(solved.theta[:4]), curves.unit))
        )
    noise = sample.noise(solved, problem.p)
    against = common_shape.reason(solved.residual, solved.jacobian, curves.which, curves.t, noise.white)
    if against and induction is None and contact is None:
        against = (f'{against[0]}, as an induction time would be (induction="fit")',)
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


def _of_contact(contact: RubbedContact, curves: Curves, kinetics: GrowthKinetics) -> list[str]:
    """Return each kind of note on the contacts of the curves, with the number of its curves and the note of the first."""
    notes: list[tuple[str, str]] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the fit has them as notes
        for one in curves.data:
            run = contact.run(
                kinetics, one.t, load=one.load, temperature=one.temperature, initial=one.initial
            )
            notes += [(note.kind, note) for note in run.notes]
    return [f"contact of {line}" for line in report.counted(notes, len(curves.data))]


def _check_induction(induction: Any, curves: Curves, contact: Any) -> None:
    """Raise ValueError for an induction time that is neither None, "fit" nor a time before the end of the data."""
    if induction is None or induction == "fit":
        known = True
    else:
        known = np.ndim(induction) == 0 and np.asarray(induction).dtype.kind in "fiu"
        known = known and 0.0 <= float(induction) < curves.duration
    if not known:
        raise ValueError(
            f'induction: expected "fit", None or a time from 0 to the end of the data, {curves.duration:g} s, got'
            f" {induction!r}"
        )
    if induction is not None and contact is not None:
        raise ValueError(f"induction: expected None with contact=, got {induction!r}")


def _check_contact(contact: Any, curves: Curves) -> None:
    """Raise ValueError for what is no contact, or curves without a load."""
    if not isinstance(contact, RubbedContact):
        raise ValueError(f"contact: expected RubbedContact or None, got {type(contact).__name__}")
    contact.check()
    without = sum(one.load is None for one in curves.data)
    if without:
        raise ValueError(
            f"load: expected one for every curve with contact=, got none for {without} of {len(curves.data)}"
        )


def _checked(data: Any) -> tuple[GrowthData, ...]:
    """The curves; ValueError for other data."""
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
