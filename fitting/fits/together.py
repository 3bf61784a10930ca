"""Fit of one material to several tests at once: creep, relaxation and oscillation.

The intervals are profile likelihoods in which the error scale of each test is held.
"""

import dataclasses
import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.data.creep import CreepData
from fitting.data.curves import given_twice
from fitting.data.moduli import OscillationData, RelaxationData
from fitting.fits import modulus
from fitting.fits.creep import creep_sample
from fitting.inference import noise, verdict
from fitting.inference.noise import basis, lag_one, within
from fitting.inference.result import Fit, FitProblem, conclude, solution
from fitting.inference.sample import REWEIGHTINGS, Assessment, Curve, Sample, Solved, assess
from fitting.models.parameters import Parameters, spectrum
from fitting.models.structure import Sought, Step, columns, merge, structure_of
from fitting.search import nonlinear
from fitting.search.nonlinear import Best, Objective
from fitting.views import sheet

# Joint least-squares fit of one material to several tests, each with an error scale of its own.
#
# The standard deviations of test k are s_k times those implied by its weights. The maximum-likelihood material
# minimises
#
#     sum over the tests of n_k log RSS_k,
#
# which is least squares with each test's weights divided by s_k, s_k^2 = RSS_k/(n_k (1 - p/n)), found by iteration
# (G. E. P. Box, N. R. Draper, Biometrika 52 (1965) 355, for tests without common noise).


TURNS, STILL = 50, 1e-6  # iterations of the error scales at most, and their relative change at convergence
LEAST_SCALE = 1e-9  # smallest error scale s_k


class Part(NamedTuple):
    """One of several tests that are fitted together.

    kind: "creep", "relaxation" or "oscillation"; sample; x, y: the scaled and padded arguments of the residuals; unit:
    of the response, in that of the sample.
    """

    kind: str
    sample: Sample
    x: Any
    y: Array
    unit: float

    def with_weights(self, weights: np.ndarray) -> "Part":
        """Return the test with new weights (n,)."""
        return self._replace(sample=self.sample._replace(weights=weights))

    @property
    def arrays(self) -> tuple[Any, Any, Any]:
        """The arguments of the residual function: abscissae, values and weights."""
        return self.x, self.y, nonlinear.without_weight(self.sample.weights * self.unit)


class Tests(NamedTuple):
    """Several tests that are fitted together, with weights divided by the error scales ``errors`` (k,) of the tests.

    This is the sample of a joint fit. As one curve the tests follow one another, each divided by its unit. rates (k,):
    scaled 1/tau_i of a series with given times, else None.
    """

    parts: tuple[Part, ...]
    errors: np.ndarray
    rates: np.ndarray | None

    @property
    def fewest_points(self) -> int:
        """Number of points of the smallest test."""
        return min(part.sample.fewest_points for part in self.parts)

    @property
    def label(self) -> str:
        """Labels of the weights of the tests."""
        return ", ".join(dict.fromkeys(part.sample.label for part in self.parts)) + ", of each test apart"

    @property
    def own_weights(self) -> list[np.ndarray]:
        """Weights (n,) of each test before division by its error scale."""
        return [part.sample.weights * s for part, s in zip(self.parts, self.errors, strict=True)]

    @property
    def ends(self) -> np.ndarray:
        """Indices among all points at which each test except the last ends."""
        return np.cumsum([part.sample.t.size for part in self.parts])[:-1]

    def curve(self, kept: np.ndarray) -> Curve:
        """Return all tests as one curve; no point is left out."""
        values = [part.sample.measured / part.unit for part in self.parts]
        return "response", "-", np.concatenate([part.sample.t for part in self.parts]), np.concatenate(values)

    def noise_notes(self, assessment: Assessment) -> tuple[str, ...]:
        """Return notes on standard deviations that were stated for a test and are contradicted by its error scale, the
        square of which is chi2 per degree of freedom."""
        n, p, notes = assessment.evidence.residuals.size, assessment.evidence.p, []
        for part, s in zip(self.parts, self.errors, strict=True):
            dof = part.sample.t.size * (1.0 - p / n)
            side = verdict.contradicted(float(s) ** 2 * dof, dof) if part.sample.known else 0
            if side:
                size = "too small for" if side > 0 else "larger than"
                notes.append(
                    f"the stated sigma of {part.sample.name} is {size} the scatter of its points: chi2 per degree of freedom"
                    f" is {float(s) ** 2:.3g}; the intervals follow from the scatter"
                )
        return tuple(notes)

    def each(self, solved: Solved) -> list[tuple[Sample, Solved]]:
        """Return the sample and the residuals of each test."""
        rows = zip(
            self.parts, *(np.split(y, self.ends) for y in (solved.residual, solved.jacobian)), strict=True
        )
        every = lambda sample: np.ones(sample.t.size, dtype=bool)
        return [
            (part.sample, Solved(solved.theta, r, J, solved.inside, every(part.sample), part.sample.weights))
            for part, r, J in rows
        ]

    def scaled(self, factors: np.ndarray) -> "Tests":
        """Return the tests with their error scales multiplied by factors (k,)."""
        rows = zip(self.parts, factors, strict=True)
        parts = tuple(part.with_weights(part.sample.weights / factor) for part, factor in rows)
        return self._replace(parts=parts, errors=self.errors * factors)

    def reweighed(self, solved: Solved, p: int) -> "Tests":
        """Return the tests with weights that follow from the solution."""
        rows = zip(self.parts, self.errors, self.own_weights, self.each(solved), strict=True)
        parts = []
        for part, s, weights, (sample, own) in rows:
            alone = own._replace(residual=s * own.residual, jacobian=s * own.jacobian, weights=weights)
            parts.append(part.with_weights(sample.reweighed(alone, p) / s) if sample.adjustable else part)
        return self._replace(parts=tuple(parts))

    def curves(self, solved: Solved) -> tuple:
        """Return (name, unit, over, values, fitted) of each test."""
        return tuple(
            (one.name, one.unit, one.t, one.measured, one.measured + own.residual / one.weights)
            for one, own in self.each(solved)
        )

    def assess(self, solved: Solved, p: int, level: float) -> Assessment:
        """Return the evidence of all tests; their noise is estimated separately, and one rejected test rejects the
        joint fit."""
        rows, n = self.each(solved), solved.residual.size
        noises = [sample.noise(own, p) for sample, own in rows]
        # a test alone determines less than all of them
        parts = np.split(basis(solved.jacobian[:, solved.inside]), self.ends)
        quality = [
            assess(sample, own, found, p, level, Q).evidence
            for (sample, own), found, Q in zip(rows, noises, parts, strict=True)
        ]
        # the parameters are shared, so s^2 of each test is RSS_k/(n_k (1 - p/n))
        shares = [(own.residual.size - p) / (own.residual.size * (1.0 - p / n)) for _, own in rows]
        # all tests as one sample
        weight = np.concatenate([part.sample.weights * part.unit for part in self.parts])
        shift = np.cumsum([0, *(part.sample.blocks[-1] + 1 for part in self.parts)])
        blocks = [part.sample.blocks + k for part, k in zip(self.parts, shift, strict=False)]
        of_all_tests = Sample.of(self.curve(solved.kept), weight, "", np.concatenate(blocks))
        lag1 = lag_one(solved.residual, of_all_tests.blocks)
        found = noise.joined(noises, solved.jacobian, shares, lag1, float(n - p))
        assessment = assess(of_all_tests, solved, found, p, level)
        refused = tuple(
            f"{sample.name}: {why}"
            for (sample, _), one in zip(rows, quality, strict=True)
            for why in one.refused
        )
        r2, misfit = min(one.r2 for one in quality), any(one.misfit for one in quality)
        evidence = dataclasses.replace(assessment.evidence, refused=refused, r2=r2, misfit=misfit)
        return assessment._replace(evidence=evidence)


def search(space: Parameters, tests: Tests, starts: Sequence[np.ndarray]) -> tuple[Tests, Solved]:
    """Return the least-squares solution from several starts, alternating with the error scales and the weights
    that follow from it."""
    first = nonlinear.minimise_from(_objective(space, tests), starts)
    tests, solved = _turns(space, tests, first)
    for _ in range(REWEIGHTINGS if any(part.sample.adjustable for part in tests.parts) else 0):
        last, tests = tests, tests.reweighed(solved, space.free.size)
        tests, solved = _turns(space, tests, solved.search_result[0])
        rows = zip(tests.parts, tests.own_weights, last.own_weights, strict=True)
        if all(part.sample.agree(new, old) for part, new, old in rows):
            break
    best, objective = solved.search_result
    return tests, solution(objective, best.after(first), solved.weights)


def _turns(space: Parameters, tests: Tests, best: Best) -> tuple[Tests, Solved]:
    """Alternate the least-squares solution and the error scales of the tests until the scales have converged."""
    sizes = np.array([part.sample.t.size for part in tests.parts])
    dof = sizes * (1.0 - space.free.size / sizes.sum())
    for _ in range(TURNS):
        rows = zip(np.split(best.residual, tests.ends), dof, strict=True)
        factors = np.maximum([float(np.sqrt(r @ r / n)) for r, n in rows], LEAST_SCALE / tests.errors)
        tests = tests.scaled(factors)
        objective = _objective(space, tests)
        best = nonlinear.minimise(objective, best.theta)
        if np.all(np.abs(factors - 1.0) < STILL):
            break
    return tests, solution(objective, best, np.concatenate([part.sample.weights for part in tests.parts]))


def _objective(space: Parameters, tests: Tests) -> Objective:
    """Return the least-squares objective of all tests, each divided by its error scale."""
    xs, measured, weights = zip(*(part.arrays for part in tests.parts), strict=True)
    begins = np.cumsum([0, *(y.size for y in measured)])
    points = np.concatenate(
        [k + np.arange(part.sample.t.size) for k, part in zip(begins, tests.parts, strict=False)]
    )
    return Objective.of(
        _responses, (xs, tests.rates), np.concatenate(measured), np.concatenate(weights), space, points=points,
        static=(tuple(part.kind for part in tests.parts),),
    )  # fmt: skip


def _responses(theta: Array, inputs: tuple[tuple, Array | None], kinds: tuple[str, ...]) -> Array:
    """Return the scaled responses (n,) of all tests one after the other, padded; inputs: their abscissae, and the rates of
    a series with given times."""
    each, (xs, rates) = [], inputs
    for x, kind in zip(xs, kinds, strict=True):
        if kind == "creep":
            c = spectrum(theta, rates)
            flow = jnp.asarray(c.fluidity)
            each.append(
                columns(x, c.rates) @ jnp.concatenate([c.instantaneous[None], c.amplitudes, flow[None]])
            )
        else:
            each.append(modulus.modulus_of(theta, (x, rates), kind))
    return jnp.concatenate(each)


OFFSET = 2.0  # mean residual of a test over the scatter of its points, above which the tests disagree
LEAST = 1e-3  # relative offset below which tests agree
SHARES = (0.1, 0.5, 0.9)


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class JointFit(Fit):
    """Result of the fit of one material to several tests; the attributes common to all fits are documented in ``Fit``.

    ``data``, ``curves`` and ``errors`` are in the order given; ``curve``, ``fitted`` and ``residuals`` hold all tests
    one after the other, each divided by its own scale and standard deviation.

    Attributes:
        curves: (name, unit, times or frequencies, values, fitted) of each test.
        errors: (k,) error scales s_k, relative to the standard deviations implied by the weights of each test.
        starts: (number of local searches, number that reached this minimum).
    """

    curves: tuple[tuple[str, str, np.ndarray, np.ndarray, np.ndarray], ...]
    errors: tuple[float, ...]
    starts: tuple[int, int]

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with the tests and their error scales."""
        tests = [
            {"response": name, "unit": unit, "points": values.size, "standard_deviation_over_weights": s}
            for (name, unit, _, values, _), s in zip(self.curves, self.errors, strict=True)
        ]
        return super().to_dict() | {"tests": tests, "starts": self.starts[0], "starts_agreed": self.starts[1]}

    def plot(self, path: Any = None) -> Any:
        """Return a figure with the data and the fit of every test, and the verdict; save it where a path is given."""
        return sheet.draw_tests(self, path)

    def _points(self) -> str:
        tests = ", ".join(f"{values.size} of {name}" for name, _, _, values, _ in self.curves)
        return f"{self.fitted.size} points: {tests}"

    def _choices(self) -> list[str]:
        return [f"weights: {self.weights}"]

    def _conditions(self) -> list[str]:
        lines = [
            f"  {name}: standard deviation of a point {s:.2g} of what its weight says"
            for (name, *_), s in zip(self.curves, self.errors, strict=True)
        ]
        return [*lines, f"  {self.starts[1]} of {self.starts[0]} starts converged to this minimum"]


def fit_together(
    data: Sequence[CreepData | RelaxationData | OscillationData], model: type | str = jc.Burgers, *, tau: Any = None,
    fixed: dict[str, float] | None = None, bounds: dict[str, tuple] | None = None, nu: float = 0.3,
    level: float = 0.95,
) -> JointFit:  # fmt: skip
    """Fit one material to several tests of it, each with an estimated error scale of its own.

    Within a test the weights are those of ``fit_creep`` and ``fit_relaxation`` by default (standard deviation
    (a^2 + (b J)^2)^(1/2), a and b estimated; the standard deviations of a creep test that has them), and proportional
    for an oscillation. No point is left out.

    Args:
        data: creep, relaxation and oscillation tests, two or more.
        model: a material class or its name.
        tau: retardation times (k,) [s]; required for ``jc.Prony``.
        fixed: {parameter: value} [Pa, Pa s, or the SI unit of a series] of any subset.
        bounds: {parameter: (low, high)} of any subset, None for an open side.
        nu: Poisson's ratio that the returned material is given.
        level: confidence level of the intervals.

    Returns:
        The material with its intervals, and how well it describes each test.

    Raises:
        ValueError: other data, too few points in a test, or Kelvin-Voigt with a relaxation.

    Example:
        >>> t, omega = np.linspace(1.0, 20.0, 20), np.geomspace(0.1, 10.0, 11)
        >>> creep = fitting.CreepData(t=t, J=1e-6 + 1e-6 * t)
        >>> G = 1e6 * 1j * omega / (1 + 1j * omega)
        >>> sweep = fitting.OscillationData(omega=omega, storage=G.real, loss=G.imag)
        >>> fit = fitting.fit_together([creep, sweep], "Maxwell")
        >>> print(f"G = {fit.values['G']:.4g} Pa, eta = {fit.values['eta']:.4g} Pa s")
        G = 1e+06 Pa, eta = 1e+06 Pa s
    """
    if isinstance(data, CreepData | RelaxationData | OscillationData):
        raise ValueError(f"data: expected a list of data sets, got one {type(data).__name__}")
    structure, data = structure_of(model, tau), tuple(data)
    if len(data) < 2 or not all(
        isinstance(one, CreepData | RelaxationData | OscillationData) for one in data
    ):
        got = ", ".join(type(one).__name__ for one in data) or "none"
        raise ValueError(f"data: expected two or more CreepData, RelaxationData, OscillationData, got {got}")
    if any(isinstance(one, RelaxationData) for one in data):
        modulus.check_relaxes(structure)
    sought = Sought.of(structure, fixed, bounds, nu)

    # Units: the longest test, and the compliance that a scaled value of one stands for. first: the shortest time that
    # any test resolves.
    ends = []
    for one in data:
        if isinstance(one, OscillationData):
            ends.append((float(1.0 / one.omega[-1]), 1.0 / float(one.omega[0])))
        else:
            ends.append((float(one.t[one.t > 0][0]), float(one.t[-1])))
    shortest, longest = zip(*ends, strict=True)
    duration = max(longest)
    first = min(shortest) / duration
    if isinstance(data[0], CreepData):
        stress = 1.0 if data[0].J is not None else float(np.max(np.abs(data[0].stress[1])))
        unit = float(np.max(np.abs(data[0].response))) / stress
    else:
        unit = 1.0 / float(np.max(np.abs(data[0].shear)))

    # The search from several retardation times over the duration and shares of the retarded part.
    space = modulus.material_space(sought, unit, duration, first)
    rates = None if structure.tau is None else duration / structure.tau
    tests = Tests(tuple(_part(one, unit, duration) for one in data), np.ones(len(data)), rates)
    problem = FitProblem(data, sought, space, tests, duration, level)
    times = np.geomspace(min(0.1, first), 3.0, max(8, math.ceil(1.0 - math.log10(first))))
    starts = modulus.starts(space, itertools.product(times, SHARES))
    tests, solved = search(space, tests, starts)
    best, objective = solved.search_result

    # A test whose residuals have one sign and are large compared with the scatter of neighbours disagrees with the
    # others: its error scale grows until it hardly counts, as where an area or a gap is wrong.
    against = []
    for sample, own in tests.each(solved):
        jumps = np.diff(own.residual)[within(sample.blocks)]
        scatter = math.sqrt(float(jumps @ jumps) / (2.0 * jumps.size)) if jumps.size else math.inf
        mean = float(np.mean(own.residual))
        share = float(np.mean(own.residual / sample.weights) / np.mean(np.abs(sample.measured)))
        if abs(mean) > OFFSET * scatter and abs(share) > LEAST:
            against.append(
                f"the tests disagree: {sample.name} is off by {100 * abs(share):.2g} % on average,"
                f" {abs(mean) / scatter:.2g} times the scatter of its points"
            )
    notes = [note for one in data for note in one.notes]
    if (same := given_twice(data)) is not None:
        notes.append(
            f"data {same[0]} and {same[1]} are the same curve, which counts twice: the intervals are too narrow"
        )
    solved = solved._replace(
        landscape=space.landscape(best.theta, objective.residual),
        notes=notes,
        against=tuple(against),
    )
    found = conclude(dataclasses.replace(problem, sample=tests), solved)
    return found.fit(
        JointFit, starts=(best.starts, best.agreed), curves=tests.curves(solved),
        errors=tuple(tests.errors.tolist()),
    )  # fmt: skip


def _part(one: Any, unit: float, duration: float) -> Part:
    """Return a test scaled by a compliance [1/Pa] and a time [s]."""
    if isinstance(one, CreepData):
        kind, sample, response = "creep", creep_sample(one, None, None), unit
        t = nonlinear.repeated(one.t / duration)
        x: Any = Step(t)
        if one.J is None:  # a strain under a stress history
            knots, stress = one.stress
            response = unit * float(np.max(np.abs(stress)))
            values = nonlinear.repeated(stress * unit / response)
            x = merge(t, nonlinear.repeated(knots / duration), values)
    else:
        relaxes = isinstance(one, RelaxationData)
        kind, sample, _ = modulus.weighted_sample(one, "estimated" if relaxes else "proportional", None)
        x = nonlinear.repeated(sample.t / duration if relaxes else sample.t * duration)
        response = 1.0 / unit
    return Part(kind, sample, x, nonlinear.repeated(sample.measured / response), response)
