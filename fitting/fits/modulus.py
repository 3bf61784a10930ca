"""Fit of a material to a relaxation modulus over time, or to storage and loss moduli over frequency.

Both follow from the compliances that every fit in this package varies (``structure.py``): G(t) from the modes of
``halfspace.relaxation_modes``, and G' + i G'' = 1/J* with

    J*(omega) = j0 + sum_i j_i/(1 + i omega tau_i) + f/(i omega).

Neither is linear in the compliances, so the fit begins from several retardation times and retarded fractions.
"""

import dataclasses
import functools
import itertools
import math
from collections.abc import Iterable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy import special

import jaxcontact as jc
from fitting.data.curves import check_kind, evaluation_times
from fitting.data.moduli import OscillationData, RelaxationData
from fitting.data.weights import choose_weights
from fitting.fits.laws import OwnModulus, Relaxed, moduli
from fitting.inference import noise
from fitting.inference.result import Fit, FitProblem, conclude, least_squares
from fitting.inference.sample import Sample, Solved
from fitting.models.halfspace import relaxation_modes
from fitting.models.parameters import NUISANCES, Parameters, spectrum
from fitting.models.structure import (
    LAWS,
    Law,
    OwnLaw,
    Sought,
    Structure,
    by_name,
    creep_structure,
    own_structure,
    structure_of,
)
from fitting.search import nonlinear
from fitting.search.nonlinear import Objective
from fitting.views import sheet
from jaxcontact.bodies.materials import Material

FINE = 200  # points of a line of the figure
NAMES, COLOURS = ("G'", "G''"), (sheet.VIOLET, sheet.GREEN)


SHARES = 0.1, 0.5, 0.9  # retarded fractions of the starts
SHORTEST, LONGEST = 3e-3, 3.0  # retardation times of the starts over the duration, of data over few decades
FIRST = 0.3  # the shortest one over the first time, where that is less
EACH = 6, 1.0  # fewest retardation times of the starts, and their number in a decade
MANY = 1000  # number of points above which the search begins with some of them
LEAST = 1e-6  # smallest scaled compliance of a logarithmic coordinate at a start
SWEPT = ("proportional", "relative", "absolute")  # weights of moduli over frequency


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ModulusFit(Fit):
    """Result of the fit of a modulus; the attributes common to all fits are documented in ``Fit``.

    Attributes:
        starts: (number of local searches, number that reached this minimum).
    """

    starts: tuple[int, int]

    @property
    def abscissa(self) -> tuple[str, str]:
        """The symbol and the unit of the abscissa of the data."""
        return ("t", "s") if self.relaxed else ("omega", "rad/s")

    @property
    def since(self) -> np.ndarray:
        """The times [s] that the data cover; of an oscillation, the reciprocals of its angular frequencies."""
        return self.curve[2] if self.relaxed else 1.0 / self.data.omega[::-1]

    @property
    def relaxed(self) -> bool:
        """True if the data are a relaxation modulus over time."""
        return isinstance(self.data, RelaxationData)

    def modulus(self, at: Any) -> np.ndarray:
        """Return the shear modulus of the fit: G [Pa] at times [s], or G' + i G'' [Pa] at angular frequencies [rad/s]."""
        found = self._parts(jnp.asarray(self.estimate.best), jnp.asarray(evaluation_times(at)))
        return np.asarray(found[0] if self.relaxed else found[0] + 1j * found[1])

    def modulus_band(self, at: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the limits (low, high) of G (k,), or of G' + i G'' (k,), at times or frequencies (k,), linearised in the
        logarithm of each part, at the fit's level."""
        at = jnp.asarray(evaluation_times(at))
        start = jnp.asarray(self.structure.off_zero(self.estimate.best, self.duration))
        best = np.asarray(self._parts(start, at))
        slope = np.asarray(jax.jacfwd(lambda values: jnp.log(self._parts(values, at)))(start))
        wide = noise.two_sided(self.level) * np.sqrt(
            np.maximum(np.einsum("pni,ij,pnj->pn", slope, self.covariance(), slope), 0.0)
        )
        with np.errstate(over="ignore"):
            low, high = best * np.exp(-wide), best * np.exp(wide)
        return (low[0], high[0]) if self.relaxed else (low[0] + 1j * low[1], high[0] + 1j * high[1])

    def _parts(self, values: Array, at: Array) -> Array:
        """Return G (1, k), or G' and G'' (2, k), of the list of values of the structure."""
        c = self.structure.compliances(values)
        if isinstance(self.structure, Law):
            return moduli(c, at, self.relaxed)
        if self.relaxed:
            return _relaxed_modulus(c, at)[None]
        found = _complex_modulus(c, at)
        return jnp.stack([found.real, found.imag])

    def plot(self, path: Any = None) -> Any:
        """Return a figure of the moduli with the fit and its band, tan delta or J(t), residuals and verdict; save it where
        a path is given."""
        _, _, x, y = self.curve
        count = 1 if self.relaxed else 2
        names = ("G(t)",) if self.relaxed else NAMES
        rows = list(zip(*(np.split(one, count) for one in (x, y, sheet.deviations(self))), strict=True))
        known = rows[0][0][rows[0][0] > 0.0]
        line = np.geomspace(known.min(), known.max(), FINE)
        model, band = self.modulus(line), self.modulus_band(line)
        part = lambda values, k: values if self.relaxed else (values.real, values.imag)[k]

        def panel(top: Any, bottom: Any) -> None:
            for k, (name, colour, (at, values, residual)) in enumerate(
                zip(names, COLOURS, rows, strict=False)
            ):
                on = at > 0.0
                measured = np.where(values > 0.0, values, np.nan)
                top.loglog(at[on], measured[on], ".", markersize=4, color=colour, label=name)
                top.loglog(line, part(model, k), color=colour, linewidth=1.0)
                top.fill_between(
                    line, part(band[0], k), part(band[1], k), color=colour, alpha=0.3, linewidth=0
                )
                bottom.semilogx(at[on], residual[on], ".", markersize=4, color=colour)
            positive = [np.min(values[values > 0.0]) for _, values, _ in rows if np.any(values > 0.0)]
            low = min([*positive, *(float(np.min(part(model, k))) for k in range(count))])
            top.set(ylabel=f"{', '.join(names)} [Pa]", ylim=(0.5 * low, 2.0 * float(np.max(y))))
            top.legend(title=f"{self.model.__name__}, {100 * self.level:g} % band", fontsize="small")
            over = "t [s]" if self.relaxed else "ω [rad/s]"
            bottom.set(xlabel=over, ylabel=sheet.RESIDUAL)

        def loss_factor(axes: Any) -> None:
            """Plot tan delta = G''/G' of data and fit."""
            (at, storage, _), (_, loss, _) = rows
            with np.errstate(divide="ignore", invalid="ignore"):
                factor = np.where((storage > 0.0) & (loss > 0.0), loss / storage, np.nan)
            fitted = model.imag / model.real
            axes.semilogx(at, factor, ".", markersize=4, color="0.4", label="data")
            axes.semilogx(line, fitted, color=sheet.BLUE, label=self.model.__name__)
            axes.set(xlabel="ω [rad/s]", ylabel="tan δ = G''/G' [-]")
            if fitted.min() > 0.0 and fitted.max() > sheet.STEEP * fitted.min():
                sheet.logarithmic(axes, fitted)
            axes.legend(fontsize="small")

        return sheet.draw(
            self, path, panel, (functools.partial(sheet.compliance, self) if self.relaxed else loss_factor,)
        )

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with the numbers of starts."""
        return super().to_dict() | {"starts": self.starts[0], "starts_agreed": self.starts[1]}

    def _conditions(self) -> list[str]:
        sought, agreed = self.starts
        return [f"  {agreed} of {sought} starts converged to this minimum"]


def fit_relaxation(
    data: RelaxationData, model: type | str | Material = jc.StandardLinearSolid, *, tau: Any = None,
    weights: str | None = None, sigma: Any = None, fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None, nu: float = 0.3, level: float = 0.95,
) -> ModulusFit:  # fmt: skip
    """Fit a material to a relaxation modulus G(t) or E(t).

    Args:
        data: the curve, n points.
        model: a material class or its name; ``jc.Springpot``, ``jc.FractionalKelvinVoigt`` and ``jc.FractionalMaxwell``
            too; or an instance of any material, of one's own too, as in ``fit_creep``.
        tau: retardation times (k,) [s]; required for ``jc.Prony``.
        weights: "estimated" (the default without a sigma), "proportional", "relative" or "absolute", as in ``fit_creep``,
            except that no point is left out.
        sigma: in place of weights, the known standard deviation of G(t) [Pa], a number or (n,).
        fixed: {parameter: value} [Pa, Pa s, or the SI unit of a series] of any subset.
        bounds: {parameter: (low, high)} of any subset, None for an open side.
        nu: Poisson's ratio that the returned material is given.
        level: confidence level of the intervals.

    Returns:
        The material with its intervals, and how well the data determine it.

    Raises:
        ValueError: bad values, too few points, or Kelvin-Voigt, which does not relax.

    Example:
        >>> t = np.linspace(0.0, 10.0, 21)
        >>> data = fitting.RelaxationData(t=t, modulus=1e6 * np.exp(-t / 3.0))
        >>> fit = fitting.fit_relaxation(data, "Maxwell", weights="relative")
        >>> print(f"G = {fit.values['G']:.4g} Pa, eta = {fit.values['eta']:.4g} Pa s")
        G = 1e+06 Pa, eta = 3e+06 Pa s
    """
    check_kind(data, RelaxationData)
    structure = _structure(model, tau, data)
    check_relaxes(structure)
    if weights is None and sigma is None and data.scatter is None:
        weights = "estimated"
    return _fit(data, weighted_sample(data, weights, sigma), Sought.of(structure, fixed, bounds, nu), level)


def fit_oscillation(
    data: OscillationData, model: type | str | Material = jc.StandardLinearSolid, *, tau: Any = None,
    weights: str | None = "proportional", sigma: Any = None, fixed: dict[str, float] | None = None,
    bounds: dict[str, tuple] | None = None, nu: float = 0.3, level: float = 0.95,
) -> ModulusFit:  # fmt: skip
    """Fit a material to storage and loss moduli over frequency.

    Args:
        data: the moduli at n frequencies.
        model: a material class or its name; ``jc.Springpot``, ``jc.FractionalKelvinVoigt`` and ``jc.FractionalMaxwell``
            too; or an instance of any material, of one's own too, as in ``fit_creep``.
        tau: retardation times (k,) [s]; required for ``jc.Prony``.
        weights: "proportional" (the default: errors of both are a fraction of the fitted |G*|), "relative" (of the measured
            |G*|) or "absolute", as in ``fit_creep``.
        sigma: in place of weights, the known standard deviation of G' and G'' [Pa], a number, or for data whose
            frequencies ascend (n,) of both or (2, n) of each.
        fixed: {parameter: value} [Pa, Pa s, or the SI unit of a series] of any subset.
        bounds: {parameter: (low, high)} of any subset, None for an open side.
        nu: Poisson's ratio that the returned material is given.
        level: confidence level of the intervals.

    Returns:
        The material with its intervals, and how well the data determine it.

    Raises:
        ValueError: bad values or too few points.

    Example:
        >>> omega = np.geomspace(0.1, 10.0, 11)
        >>> G = 1e6 * 1j * omega / (1 + 1j * omega)  # a Maxwell fluid of 1e6 Pa and 1e6 Pa s
        >>> data = fitting.OscillationData(omega=omega, storage=G.real, loss=G.imag)
        >>> fit = fitting.fit_oscillation(data, "Maxwell")
        >>> print(f"G = {fit.values['G']:.4g} Pa, eta = {fit.values['eta']:.4g} Pa s")
        G = 1e+06 Pa, eta = 1e+06 Pa s
    """
    check_kind(data, OscillationData)
    structure = _structure(model, tau, data)
    if weights not in (None, *SWEPT):
        raise ValueError(f"weights: expected {', '.join(SWEPT)}, or sigma=..., got {weights!r}")
    weighted = weighted_sample(data, None if sigma is not None else weights, sigma)
    return _fit(data, weighted, Sought.of(structure, fixed, bounds, nu), level)


def check_relaxes(structure: Structure) -> None:
    """Raise ValueError for a model that has no relaxation modulus."""
    if structure.model is jc.KelvinVoigt:
        raise ValueError(
            "model: a Kelvin-Voigt solid does not relax: expected StandardLinearSolid or another"
        )


def weighted_sample(
    data: RelaxationData | OscillationData, weights: str | None, sigma: Any
) -> tuple[str, Sample, float]:
    """Return the kind of test, the fitted sample in shear (G(t), or G' followed by G''), and the duration [s].

    ValueError unless exactly one choice of weights is made.
    """
    if isinstance(data, RelaxationData):
        weight, label = choose_weights(data.t, data.shear, weights, sigma, data.scatter)
        sample = Sample.of(("G", "Pa", data.t, data.shear), weight, label)
        return "relaxation", sample, float(data.t[-1])
    if np.ndim(sigma) > 0 and data.reordered:  # values for the points as they were given, or as they are now?
        raise ValueError(
            "sigma: expected a number, or frequencies in ascending order, got values for points that were sorted by"
            " frequency"
        )
    n = data.omega.size
    if sigma is not None:
        if np.shape(sigma) not in ((), (n,), (2, n)):
            raise ValueError(
                f"sigma: expected a number, {n} values, or those of G' and of G'' (2, {n}), got shape {np.shape(sigma)}"
            )
        sigma = np.broadcast_to(sigma, (2, n)).ravel()
    both = np.append(data.omega, data.omega)
    weight, label = choose_weights(both, np.tile(np.abs(data.shear), 2), weights, sigma)
    curve = ("G', G''", "Pa", both, np.append(data.shear.real, data.shear.imag))
    second = np.cumsum(np.diff(both, prepend=both[0]) < 0)  # G'' begins where the frequencies start again
    return "oscillation", Sample.of(curve, weight, label, second, paired=True), 1.0 / float(data.omega[0])


def _fit(data: Any, weighted: tuple[str, Sample, float], sought: Sought, level: float) -> ModulusFit:
    """Scale the data, search for the optimum and return the fit."""
    kind, sample, duration = weighted
    largest = float(np.max(np.abs(sample.measured)))

    # 1. A fractional law, or a material of one's own, has a search of its own.
    if isinstance(sought.structure, Law):
        relaxed, own = kind == "relaxation", isinstance(sought.structure, OwnLaw)
        if relaxed and not own and not data.t[0] > 0.0:
            raise ValueError(
                f"t: expected times > 0 for a fractional law, got {data.t[0]:g}; leave such points out"
            )
        scale = OwnModulus if own else Relaxed
        search = scale(relaxed, np.asarray(sample.t), sample.measured / largest, largest)
        solved, found = search.concluded(
            data, sought, sample, duration, level, functools.partial(alike, data)
        )
        best = solved.search_result.best
        return found.fit(ModulusFit, starts=(best.starts, best.agreed))

    # 2. The scaled problem of a classical material; of many points, a few for the comparison of starts.
    unit = 1.0 / largest
    known = sample.t[sample.t > 0.0]
    first = float(known.min()) / duration if kind == "relaxation" else 1.0 / (float(known.max()) * duration)
    space = material_space(sought, unit, duration, first)
    problem = FitProblem(data, sought, space, sample, duration, level)
    scaled = sample.t / duration if kind == "relaxation" else sample.t * duration
    tau = sought.structure.tau
    rates = None if tau is None else duration / tau
    of = lambda weights: _objective(kind, space, rates, scaled, sample.measured * unit, weights / unit)
    few = None
    if kind == "relaxation" and scaled.size > MANY:  # evenly over the logarithm of time, and over the points
        n = scaled.size
        near = np.searchsorted(sample.t, np.geomspace(known.min(), known.max(), MANY // 2))
        some = np.unique(np.append(np.linspace(0, n - 1, MANY // 2).astype(int), np.minimum(near, n - 1)))
        some_measured, some_weights = sample.measured[some] * unit, sample.weights[some] / unit
        few = _objective(kind, space, rates, scaled[some], some_measured, some_weights)

    # 3. The search, from retardation times evenly over the logarithm of time, then intervals and verdict.
    shortest = min(SHORTEST, FIRST * first)
    count = max(EACH[0], math.ceil(EACH[1] * math.log10(LONGEST / shortest)))
    times = np.geomspace(shortest, LONGEST, count)
    solved = least_squares(problem, of, starts(space, itertools.product(times, SHARES)), few)
    best, objective = solved.search_result
    landscape = space.landscape(best.theta, objective.residual)
    found = conclude(problem, solved._replace(notes=alike(data, solved), landscape=landscape))
    return found.fit(ModulusFit, starts=(best.starts, best.agreed))


def alike(data: RelaxationData | OscillationData, solved: Solved) -> tuple[str, ...]:
    """Return a note where G' and G'' of a frequency have the same error, that of the amplitude.

    A fit takes them as independent, with the mean variance of amplitude and phase. What the amplitude alone determines
    then has an interval that is too short by the square root of the variance of the amplitude over this mean. Where G'
    and G'' are of different size, independent errors of so many percent of each change the phase less than the amplitude
    as well: there the more likely of both descriptions decides.
    """
    if isinstance(data, RelaxationData):
        return ()
    n = data.omega.size
    off = solved.residual / solved.weights
    relative = (off[:n] + 1j * off[n:]) / data.shear
    size, phase = (float(np.mean(part**2)) for part in (relative.real, relative.imag))
    if not size > phase * special.fdtri(n, n, 0.99) or _apart(off.reshape(2, n), data.shear, size * phase):
        return ()
    short = math.sqrt(2.0 * size / (size + phase))
    return (
        f"errors of |G*| ({100 * math.sqrt(size):.2g} %) exceed those of the phase ({math.sqrt(phase):.2g} rad), so that G'"
        f" and G'' have common errors: the intervals may be up to {short:.2g} times too short",
    )


def _apart(off: np.ndarray, modulus: np.ndarray, product: float) -> bool:
    """Return whether errors (2, n) of G' and G'' are independent parts of each; product: of the variances of amplitude
    and phase.

    They are not correlated then, and more likely than independent errors of amplitude and phase: n normal errors have a
    likelihood of the power -n/2 of the product of their two variances, in one volume of errors relative to |G*|.
    """
    sizes = np.maximum(np.abs([modulus.real, modulus.imag]), 1e-12 * np.abs(modulus))
    own = off / sizes
    variances = np.mean(own**2, 1)
    correlation = np.mean(own[0] * own[1]) / math.sqrt(np.prod(variances))
    volume = np.mean(np.log(sizes[0] * sizes[1] / np.abs(modulus) ** 2))
    alike = correlation > special.ndtri(0.99) / math.sqrt(modulus.size)
    return bool(not alike and np.prod(variances) * math.exp(2.0 * volume) < product)


def _structure(model: Any, tau: Any, data: Any) -> Structure:
    """Return the structure of a classical or fractional material, of a series with given times, or of an instance of any
    material."""
    if isinstance(model, Material):
        return own_structure(model, data)
    law = by_name(model, LAWS.values()) if isinstance(model, str) else model
    return creep_structure(law) if tau is None and law in LAWS.values() else structure_of(model, tau)


def material_space(sought: Sought, unit: float, duration: float, first: float) -> Parameters:
    """Return the search space of the material parameters alone, in units of compliance [1/Pa] and time [s].

    first: the first time over the duration, with which the range of the rates increases.
    """
    units = sought.structure.units(unit, duration)
    box = np.concatenate([sought.structure.box(sought.table) / units[:, None], np.zeros((len(NUISANCES), 2))])
    units = np.append(units, np.ones(len(NUISANCES)))
    return Parameters.of_compliances(sought.structure, box, units, decades=-math.log(first))


def starts(space: Parameters, pairs: Iterable[tuple[float, float]]) -> list[np.ndarray]:
    """Return starting coordinates from pairs of tau over the duration and the retarded fraction; for a series, equal
    compliances."""
    structure = space.structure
    if structure.tau is not None:
        even = np.append(np.ones(1 + structure.branches) / (1 + structure.branches), 0.1)
        return [space.near(even, LEAST)]
    if structure.branches == 0:
        return [space.near(np.array([1.0, flow]), LEAST) for flow in (0.1, 1.0, 10.0)]
    return [space.near(np.array([1.0, share, 1.0 - share, share / tau]), LEAST) for tau, share in pairs]


def _objective(
    kind: str, space: Parameters, rates: np.ndarray | None, x: np.ndarray, y: np.ndarray, weight: np.ndarray
) -> Objective:
    """Return the least-squares objective of scaled data, which are padded internally; rates (k,): of given times."""
    inputs, measured = (nonlinear.repeated(x), rates), nonlinear.repeated(y)
    padded, points = nonlinear.without_weight(weight), slice(x.size)
    return Objective.of(modulus_of, inputs, measured, padded, space, points=points, static=(kind,))


def modulus_of(theta: Array, inputs: tuple[Array, Array | None], kind: str) -> Array:
    """Return the scaled response (n,) of one kind of test at scaled times or frequencies x (n,); inputs: x, and the rates
    of a series with given times."""
    x, rates = inputs
    c = spectrum(theta, rates)
    if kind == "relaxation":
        return _relaxed_modulus(c, x)
    model = _complex_modulus(c, x)
    second = jnp.arange(x.size) >= jnp.argmax(jnp.append(jnp.diff(x) < 0, True)) + 1
    return jnp.where(second, model.imag, model.real)


@jax.jit
def _relaxed_modulus(c: Any, t: Array) -> Array:
    """Return G at times t of any shape."""
    weights, rates = relaxation_modes(c, jnp.zeros(()))
    return jnp.exp(-t[..., None] * rates) @ weights


@jax.jit
def _complex_modulus(c: Any, omega: Array) -> Array:
    """Return G' + i G'' at angular frequencies omega of any shape."""
    delayed = jnp.sum(c.amplitudes / (1.0 + 1j * omega[..., None] / c.rates), -1)
    return 1.0 / (c.instantaneous + delayed + c.fluidity / (1j * omega))
