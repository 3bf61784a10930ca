"""Fit of one material to several tests at once: creep, relaxation and oscillation (``joint_search.py``).

The intervals are profile likelihoods in which the error scale of each test is held.
"""

import dataclasses
import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting.data.curves import CreepData
from fitting.data.moduli import OscillationData, RelaxationData
from fitting.fits import joint_search, modulus
from fitting.fits.creep import creep_sample
from fitting.fits.joint_search import Part, Tests
from fitting.inference.conclusion import FitProblem, conclude
from fitting.inference.correlation import within
from fitting.inference.evidence import Solved
from fitting.inference.result import Fit
from fitting.models.history import Step, merge
from fitting.models.structure import Sought, Structure, structure_of
from fitting.search import padding
from fitting.views import fit_picture

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
        return fit_picture.draw_tests(self, path)

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

    Within a test the weights are those of ``fit_creep`` and ``fit_relaxation`` by default (errors a + b J; the
    standard deviations of a creep test that has them), and proportional for an oscillation. No point is left out.

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
    _check(data, structure)
    sought = Sought.of(structure, fixed, bounds, nu)
    duration, unit = max(map(_duration, data)), _compliance(data[0])
    first = _first(data) / duration
    space = modulus.material_space(sought, unit, duration, first)
    tests = Tests(tuple(_part(one, unit, duration) for one in data), np.ones(len(data)))
    problem = FitProblem(data, sought, space, tests, duration, level)
    starts = modulus.starts(space, itertools.product(_taus(first), SHARES))
    tests, solved = joint_search.search(space, tests, starts)
    best, objective = solved.whole
    solved = solved._replace(
        landscape=space.landscape(best.theta, objective.residual),
        notes=[note for one in data for note in one.notes],
        against=_offsets(tests, solved),
    )
    found = conclude(dataclasses.replace(problem, sample=tests), solved)
    return found.fit(
        JointFit, starts=(best.starts, best.agreed), curves=tests.curves(solved),
        errors=tuple(tests.errors.tolist()),
    )  # fmt: skip


def _offsets(tests: Tests, solved: Solved) -> tuple[str, ...]:
    """Return the tests whose residuals have one sign and are large compared with the scatter of neighbours.

    The error scale of such a test grows until it hardly counts, as where an area or a gap is wrong.
    """
    found = []
    for sample, own in tests.each(solved):
        jumps = np.diff(own.residual)[within(sample.blocks)]
        scatter = math.sqrt(float(jumps @ jumps) / (2.0 * jumps.size)) if jumps.size else math.inf
        mean = float(np.mean(own.residual))
        share = float(np.mean(own.residual / sample.weights) / np.mean(np.abs(sample.measured)))
        if abs(mean) > OFFSET * scatter and abs(share) > LEAST:
            found.append(
                f"the tests disagree: {sample.name} is off by {100 * abs(share):.2g} % on average, {abs(mean) / scatter:.2g}"
                " times the scatter of its points"
            )
    return tuple(found)


def _check(data: tuple, structure: Structure) -> None:
    kinds = CreepData | RelaxationData | OscillationData
    if len(data) < 2 or not all(isinstance(one, kinds) for one in data):
        got = ", ".join(type(one).__name__ for one in data) or "none"
        raise ValueError(f"data: expected two or more CreepData, RelaxationData, OscillationData, got {got}")
    if any(isinstance(one, RelaxationData) for one in data):
        modulus.check_relaxes(structure)


def _duration(one: Any) -> float:
    return 1.0 / float(one.omega[0]) if isinstance(one, OscillationData) else float(one.t[-1])


def _compliance(one: Any) -> float:
    """Return the compliance [1/Pa] that a scaled value of one stands for."""
    if not isinstance(one, CreepData):
        return 1.0 / float(np.max(np.abs(one.shear)))
    stress = 1.0 if one.J is not None else float(np.max(np.abs(one.stress[1])))
    return float(np.max(np.abs(one.response))) / stress


def _first(data: tuple) -> float:
    """Return the shortest time [s] that any test resolves."""
    return min(
        float(1.0 / one.omega[-1] if isinstance(one, OscillationData) else one.t[one.t > 0][0])
        for one in data
    )


def _taus(first: float) -> np.ndarray:
    """Return initial retardation times over the duration, from the shortest time ``first`` that any test resolves."""
    return np.geomspace(min(0.1, first), 3.0, max(8, math.ceil(1.0 - math.log10(first))))


def _part(one: Any, unit: float, duration: float) -> Part:
    """Return a test scaled by a compliance [1/Pa] and a time [s]."""
    if isinstance(one, CreepData):
        kind, sample = "creep", creep_sample(one, None, None)
        x, response = _stressed(one, unit, duration)
    else:
        relaxes = isinstance(one, RelaxationData)
        kind, sample, _ = modulus.weighted_sample(one, "estimated" if relaxes else "proportional", None)
        x = padding.repeated(sample.t / duration if relaxes else sample.t * duration)
        response = 1.0 / unit
    return Part(kind, sample, x, padding.repeated(sample.measured / response), response)


def _stressed(one: CreepData, unit: float, duration: float) -> tuple[Any, float]:
    """Return the scaled times of a creep test with its stress, and the unit of its response."""
    t = padding.repeated(one.t / duration)
    if one.J is not None:
        return Step(t), unit
    knots, stress = one.stress
    response = unit * float(np.max(np.abs(stress)))
    at, values = padding.repeated(knots / duration), padding.repeated(stress * unit / response)
    return merge(t, at, values), response
