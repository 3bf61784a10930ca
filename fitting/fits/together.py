"""One material for several tests: creep, relaxation and oscillation, fitted at once.

Every test has an error of its own, s_k times that of its weights. The likeliest material is that of the least

    sum over the tests of n_k log RSS_k,

which is least squares with each test's weights over s_k, s_k^2 = RSS_k/(n_k (1 - p/n)), found in turns (G. E. P. Box,
N. R. Draper, Biometrika 52 (1965) 355, for tests without common noise). Intervals are profiles with these s_k held.
"""

import dataclasses
import functools
import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.data.curves import CreepData
from fitting.data.moduli import OscillationData, RelaxationData
from fitting.fits import modulus
from fitting.fits.creep import fit_weights, measured_curve
from fitting.inference import evidence, noise
from fitting.inference.correlation import lag_one
from fitting.inference.estimating import estimate, off_bounds
from fitting.inference.evidence import Judged, Sample, Solved
from fitting.inference.result import Fit, findings
from fitting.models.coordinates import Coordinates, Space
from fitting.models.history import Step, columns, merge
from fitting.models.structure import Structure, Volume, limits, structure_of
from fitting.search import nonlinear, padding, profiles
from fitting.search.nonlinear import Best, Objective
from fitting.views import fit_picture

SHARES = (0.1, 0.5, 0.9)
TURNS, STILL = 50, 1e-6  # of the weights, and their change that is none
LEAST = 1e-9  # standard deviation of a point, as a share of what its weight says


class Part(NamedTuple):
    """A test: kind, curve, weight and label as ``modulus.Weighed`` has them; arrays: what the residuals take, scaled and
    padded; unit: of the response, in that of the curve."""

    kind: str
    curve: tuple[str, str, np.ndarray, np.ndarray]
    weight: np.ndarray
    label: str
    arrays: tuple[Any, Array, Array]
    unit: float


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class JointFit(Fit):
    """The fit of one material to several tests; ``Fit`` has what it shares with other fits.

    ``data``, ``curves`` and ``errors`` are in the order given; ``curve``, ``fitted`` and ``residuals`` hold all
    tests one after the other, each over its own scale and standard deviation.

    Attributes:
        curves: (name, unit, times or frequencies, values, fitted) of each test.
        errors: (k,) s_k, over what the weights of each test say.
        starts: (sought, agreed): minima that were sought, and those as low as this one.
    """

    curves: tuple[tuple[str, str, np.ndarray, np.ndarray, np.ndarray], ...]
    errors: tuple[float, ...]
    starts: tuple[int, int]

    def to_dict(self) -> dict[str, Any]:
        """As ``Fit.to_dict``, with the tests and their errors."""
        tests = [
            {"response": name, "unit": unit, "points": values.size, "standard_deviation_over_weights": s}
            for (name, unit, _, values, _), s in zip(self.curves, self.errors, strict=True)
        ]
        return super().to_dict() | {"tests": tests, "starts": self.starts[0], "starts_agreed": self.starts[1]}

    def plot(self, path: Any = None) -> Any:
        """Figure with the data and the fit of every test, and the verdict; saved where a path is given."""
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
        return [*lines, f"  {self.starts[1]} of {self.starts[0]} starts came to this minimum"]


def fit_together(
    data: Sequence[CreepData | RelaxationData | OscillationData], model: type | str = jc.Burgers, *, tau: Any = None,
    fixed: dict[str, float] | None = None, bounds: dict[str, tuple] | None = None, nu: float = 0.3,
    level: float = 0.95,
) -> JointFit:  # fmt: skip
    """Fit one material to several tests of it, each with an error of its own, which is estimated.

    Within a test the weights are those of ``fit_creep`` and ``fit_relaxation`` by default (errors a + b J; the
    standard deviations of a creep test that has them), and relative for an oscillation. No point is left out.

    Args:
        data: creep, relaxation and oscillation tests, two or more.
        model: a material class or its name.
        tau: retardation times (k,) [s] of ``jc.Prony``, which needs them.
        fixed: {parameter: value} [Pa, Pa s, or SI of a series] of any subset.
        bounds: {parameter: (low, high)} of any subset, None for an open side.
        nu: Poisson's ratio to carry along.
        level: of the intervals.

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
    table = limits(structure, fixed, bounds)
    duration, unit = max(map(_duration, data)), _compliance(data[0])
    space = modulus.material_space(structure, table, unit, duration)
    p = space.free.size
    parts = [_part(one, unit, duration) for one in data]
    for part in parts:
        evidence.check(level, part.weight.size, p)
    best, objective, errors, parts = _search(space, parts, _taus(data, duration))
    judged = _judge(parts, errors, best, off_bounds(objective, best), p, level)
    ends = profiles.profile(objective, best, judged.levels())
    still = lambda name: np.zeros(best.theta.size)
    found = estimate(space, best, still, ends, judged.slopes, objective.residual)
    fields = findings(
        structure, table, level, Volume.of(nu, None), judged, found, [space.names[i] for i in space.free]
    )
    notes = dict.fromkeys([*(note for one in data for note in one.notes), *fields["notes"]])
    _, scaled = _scaled(parts, errors)
    return JointFit(
        **fields | {"notes": tuple(notes)}, data=data,
        weights=", ".join(dict.fromkeys(part.label for part in parts)) + ", of each test apart",
        curve=("response", "-", np.concatenate([part.curve[2] for part in parts]), scaled), duration=duration,
        starts=(best.starts, best.agreed), curves=_curves(parts, errors, judged.evidence.residuals),
        errors=tuple(errors.tolist()),
    )  # fmt: skip


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
    """That a scaled one stands for [1/Pa]."""
    if not isinstance(one, CreepData):
        return 1.0 / float(np.max(np.abs(one.shear)))
    stress = 1.0 if one.J is not None else float(np.max(np.abs(one.stress[1])))
    return float(np.max(np.abs(one.response))) / stress


def _taus(data: tuple, duration: float) -> np.ndarray:
    """Retardation times over the duration to start from: from the shortest that any test sees."""
    first = [1.0 / one.omega[-1] if isinstance(one, OscillationData) else one.t[one.t > 0][0] for one in data]
    return np.geomspace(min(0.1, max(min(first) / duration, 1e-8)), 3.0, 8)


def _part(one: Any, unit: float, duration: float) -> Part:
    """A test, scaled by a compliance [1/Pa] and a time [s]."""
    if isinstance(one, CreepData):
        weight, label = fit_weights(one, None, None)
        curve, kind, response = measured_curve(one), "creep", unit
        t = padding.repeated(one.t / duration)
        x: Any = Step(t)
        if one.J is None:
            knots, stress = one.stress
            response = unit * float(np.max(np.abs(stress)))
            at, values = padding.repeated(knots / duration), padding.repeated(stress * unit / response)
            x = merge(t, at, values)
    else:
        relaxes = isinstance(one, RelaxationData)
        kind, curve, weight, label, _ = modulus.weigh(one, "estimated" if relaxes else "relative", None)
        x = padding.repeated(curve[2] / duration if relaxes else curve[2] * duration)
        response = 1.0 / unit
    y, scaled = padding.repeated(curve[3] / response), padding.without_weight(weight * response)
    return Part(kind, curve, weight, label, (x, y, scaled), response)


def _search(
    space: Space, parts: list[Part], taus: np.ndarray
) -> tuple[Best, Objective, np.ndarray, list[Part]]:
    """The least squares from several starts, and on, in turns with the errors (k,) and the estimated weights of the
    tests."""
    errors = np.ones(len(parts))
    objective = _objective(space, parts, errors)
    first = nonlinear.minimise_from(objective, modulus.starts(space, itertools.product(taus, SHARES)))
    best, objective, errors = _turns(space, parts, first, errors)
    for _ in range(evidence.TURNS if any(part.label == "estimated" for part in parts) else 0):
        last, parts = parts, _reweighed(parts, errors, best, off_bounds(objective, best), space.free.size)
        best, objective, errors = _turns(space, parts, best, errors)
        if all(evidence.close(new.weight, old.weight) for new, old in zip(parts, last, strict=True)):
            break
    best = best._replace(starts=first.starts, agreed=first.agreed, others=first.others)
    return best, objective, errors, parts


def _turns(
    space: Space, parts: list[Part], best: Best, errors: np.ndarray
) -> tuple[Best, Objective, np.ndarray]:
    """The least squares and the errors (k,) of the tests in turns, until the errors stand still."""
    sizes = np.array([part.weight.size for part in parts])
    ends, dof = np.cumsum(sizes)[:-1], sizes * (1.0 - space.free.size / sizes.sum())
    for _ in range(TURNS):
        now = [float(np.sqrt(r @ r / n)) for r, n in zip(np.split(best.residual, ends), dof, strict=True)]
        factors = np.maximum(np.array(now), LEAST / errors)
        errors = errors * factors
        objective = _objective(space, parts, errors)
        best = nonlinear.minimise(objective, best.theta)
        if np.all(np.abs(factors - 1.0) < STILL):
            break
    return best, objective, errors


def _reweighed(parts: list[Part], errors: np.ndarray, best: Best, inside: np.ndarray, p: int) -> list[Part]:
    """The tests with estimated weights that agree with the residuals."""
    found = []
    for part, s, residual, jacobian in zip(parts, errors, *_split(parts, best), strict=True):
        kept = np.ones(residual.size, dtype=bool)
        solved = Solved(s * residual, s * jacobian, inside, kept, part.weight, None)
        weight = _sample(part, 1.0).reweighed(solved, p) if part.label == "estimated" else part.weight
        x, y, _ = part.arrays
        arrays = (x, y, padding.without_weight(weight * part.unit))
        found.append(part._replace(weight=weight, arrays=arrays))
    return found


def _split(parts: list[Part], best: Best) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Residuals and Jacobian of each test."""
    ends = np.cumsum([part.weight.size for part in parts])[:-1]
    return np.split(best.residual, ends), np.split(best.jacobian, ends)


def _sample(part: Part, s: float) -> Sample:
    """The data of a test, with weights over its error s."""
    *_, x, measured = part.curve
    second = np.cumsum(np.diff(x, prepend=x[0]) < 0) if part.kind == "oscillation" else None
    return Sample.of(x, measured, part.weight / s, part.label, second)


def _objective(space: Space, parts: list[Part], errors: np.ndarray) -> Objective:
    """With the errors (k,) of the tests."""
    at, sizes = space.point, tuple(part.weight.size for part in parts)
    kinds = tuple(part.kind for part in parts)
    arrays = tuple(
        (x, y, w / s) for (x, y, w), s in zip((part.arrays for part in parts), errors, strict=True)
    )
    return Objective(
        lambda theta: _evaluate(at(theta), arrays, kinds, sizes),
        lambda theta, free: _slopes(at(theta), free, arrays, kinds, sizes),
        *space.bounds, floor=1e-26 * sum(float(np.sum((y * w) ** 2)) for _, y, w in arrays),
    )  # fmt: skip


def _residual(point: Coordinates, arrays: tuple, kinds: tuple[str, ...], sizes: tuple[int, ...]) -> Array:
    """Weighted (n,), of all tests."""
    each = []
    for (x, y, weight), kind, size in zip(arrays, kinds, sizes, strict=True):
        if kind == "creep":
            c = point.compliances()
            parts = jnp.concatenate([jnp.stack([c.spring]), c.retarded, jnp.stack([c.flow])])
            one = weight * (columns(x, c.rates) @ parts - y)
        else:
            one = modulus.residual(point, x, y, weight, kind)
        each.append(one[:size])
    return jnp.concatenate(each)


@functools.partial(jax.jit, static_argnames=("kinds", "sizes"))
def _evaluate(point: Coordinates, arrays: tuple, kinds: tuple[str, ...], sizes: tuple[int, ...]) -> Array:
    return _residual(point, arrays, kinds, sizes)


@functools.partial(jax.jit, static_argnames=("kinds", "sizes"))
def _slopes(
    point: Coordinates, free: Array, arrays: tuple, kinds: tuple[str, ...], sizes: tuple[int, ...]
) -> Array:
    """Their Jacobian (n, k) with respect to the coordinates at the places ``free`` (k,)."""
    some = lambda values: _residual(point.moved(free, values), arrays, kinds, sizes)
    return jax.jacfwd(some)(point.vector()[free])


def _scaled(parts: list[Part], errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights and responses (n,) of all tests, over the unit and standard deviation of each."""
    weight = [part.weight * part.unit / s for part, s in zip(parts, errors, strict=True)]
    return np.concatenate(weight), np.concatenate([part.curve[3] / part.unit for part in parts])


def _judge(
    parts: list[Part], errors: np.ndarray, best: Best, inside: np.ndarray, p: int, level: float
) -> Judged:
    """Return the judgement on the residuals of all tests: the noise of each test is judged apart, and a
    test that is not described refuses the fit."""
    n, samples = best.residual.size, [_sample(part, s) for part, s in zip(parts, errors, strict=True)]
    rows = list(zip(samples, *_split(parts, best), strict=True))
    noises = [sample.noise(r, J, inside, p) for sample, r, J in rows]
    each = [
        evidence.judged(sample, r, J, inside, found, p, level).evidence
        for (sample, r, J), found in zip(rows, noises, strict=True)
    ]
    # their parameters are shared: s^2 of each test is RSS/(n_k (1 - p/n))
    shares = [(r.size - p) / (r.size * (1.0 - p / n)) for _, r, _ in rows]
    shift = np.cumsum([0, *(sample.blocks[-1] + 1 for sample in samples)])
    blocks = np.concatenate([sample.blocks + k for sample, k in zip(samples, shift, strict=False)])
    weight, scaled = _scaled(parts, errors)
    whole = Sample.of(np.concatenate([sample.t for sample in samples]), scaled, weight, "", blocks)
    found = noise.joined(noises, best.jacobian, shares, lag_one(best.residual, blocks), float(n - p))
    judged = evidence.judged(whole, best.residual, best.jacobian, inside, found, p, level)
    refused = tuple(
        f"{part.curve[0]}: {why}" for part, test in zip(parts, each, strict=True) for why in test.refused
    )
    quality = judged.evidence._replace(
        refused=refused, r2=min(test.r2 for test in each), misfit=any(test.misfit for test in each)
    )
    return judged._replace(evidence=quality)


def _curves(parts: list[Part], errors: np.ndarray, residuals: np.ndarray) -> tuple:
    """(name, unit, over, values, fitted) of each test."""
    ends = np.cumsum([part.weight.size for part in parts])[:-1]
    rows = zip(parts, errors, np.split(residuals, ends), strict=True)
    return tuple((*part.curve, part.curve[3] + s * r / part.weight) for part, s, r in rows)
