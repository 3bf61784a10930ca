"""Design of creep tests by Cramer-Rao bounds of the parameters, and of a second hold that tells why a gel relaxes.

The standard deviations of the logarithms of the parameters are those of least squares with the stated noise, from the
exact Jacobian of the response to a unit stress: a hold, or a hold followed by recovery. Relative noise is a fraction of
the strain under load; the residual strain in recovery is a difference from the strain at the end of the hold and has
the error of the latter. Where no test is long enough the design says so.
"""

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.fits.cause import RelaxationCause, named_at
from fitting.models.structure import Compressibility, Structure, of_material

SHORTEST, LONGEST = 0.02, 100.0  # shortest and longest trial durations over tau
TRIED, HALVINGS = 40, 20
SAMPLINGS = ("even", "logarithmic")


class CreepTest(NamedTuple):
    """A creep test and the accuracy it would give.

    Attributes:
        sampling: "even" or "logarithmic" times.
        share: fraction of the duration that is hold; the rest is recovery.
        duration: [s], inf where no duration up to the longest tried is sufficient.
        sd: {parameter: standard deviation of its logarithm} at this duration, or at the one with the smallest of the largest
            standard deviations where none is sufficient.
    """

    sampling: str
    share: float
    duration: float
    sd: dict[str, float]


class Design(NamedTuple):
    """Creep tests that reach a target accuracy of the parameters; ``print`` shows them as a table.

    Attributes:
        target, noise, weights, points: as requested.
        experiments: the planned tests, the shortest first, and at the end those that cannot reach the target.
    """

    target: float
    noise: float
    weights: str
    points: int
    experiments: tuple[CreepTest, ...]

    def __str__(self) -> str:
        lines = [
            f"{100 * self.noise:g} % {self.weights} noise, {self.points} points, "
            f"sd of every log parameter below {self.target:g}:"
        ]
        for e in self.experiments:
            kind = "hold" if e.share == 1.0 else f"hold {e.share:.0%}, recovery {1 - e.share:.0%}"
            sds = ", ".join(f"{name} {sd:.2g}" for name, sd in e.sd.items())
            need = f"{e.duration:.4g} s" if math.isfinite(e.duration) else "no duration is sufficient"
            lines.append(f"  {kind}, {e.sampling} times: {need} ({sds})")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)


RATIOS = (1.5, 2.0, 3.0, 5.0, 8.0)  # of the depths that are tried


class HoldDesign(NamedTuple):
    """What a second hold would tell about the cause of a relaxation; ``print`` shows it as a table.

    Attributes:
        depth: of the first hold [m].
        ratio: least of the tried ratios of the depths from which on every possible cause is named; inf where none is enough.
        named: {ratio: {cause: what would be named}}.
    """

    depth: float
    ratio: float
    named: dict[float, dict[str, str]]

    def __str__(self) -> str:
        lines = [
            f"second hold beside that at {self.depth:.4g} m, longer in proportion to the square of the contact radius:"
        ]
        for ratio, said in self.named.items():
            words = ", ".join(f"{cause} named {name}" for cause, name in said.items())
            lines.append(f"  at {ratio * self.depth:.4g} m ({ratio:g} times): {words}")
        enough = (
            f"from {self.ratio:g} times the depth on"
            if math.isfinite(self.ratio)
            else "no depth that was tried"
        )
        return "\n".join([*lines, f"tells the cause: {enough}"])

    def __repr__(self) -> str:
        return str(self)


def design(
    material: Any, *, target: float = 0.1, noise: float = 0.01, weights: str = "relative", points: int = 200,
    first: float = 1.0, shares: tuple[float, ...] = (1.0, 0.5, 0.2), parameters: tuple[str, ...] | None = None,
) -> Any:  # fmt: skip
    """Find the shortest creep tests that would determine each parameter to a given accuracy.

    For the result of ``relaxation_cause`` find the depth of a second hold that would tell the cause, with the noise of the
    holds so far; the other arguments are not used.

    Args:
        material: one of those that can be fitted, or a fit, close to the expected material; or a ``RelaxationCause``.
        target: largest standard deviation of the logarithm of a parameter.
        noise: standard deviation of each point, relative to its value (weights "relative"; in recovery, to the value
            at the end of the hold) or to the largest value ("absolute").
        weights: "relative" or "absolute".
        points: number of points.
        first: the first of logarithmic times [s].
        shares: fractions of the duration that are hold, the rest being recovery; one test is found for each.
        parameters: the parameters to determine, all by default.

    Returns:
        The tests, shortest first, a ``Design``; or what second holds at several depths would tell.

    Raises:
        ValueError: a material with infinite parameters, or values outside their range.

    Example:
        >>> found = fitting.design(jc.Maxwell(G=1e6, eta=1e8), target=0.01, shares=(1.0,))
        >>> print(f"{found.experiments[0].sampling} times for {found.experiments[0].duration:.0f} s")
        even times for 28 s
    """
    if isinstance(material, RelaxationCause):
        named = {ratio: named_at(material, ratio) for ratio in RATIOS}
        good = [all(cause == name for cause, name in named[ratio].items()) for ratio in RATIOS]
        enough = next((ratio for k, ratio in enumerate(RATIOS) if all(good[k:])), math.inf)
        return HoldDesign(material.depths[0], enough, named)
    material = getattr(material, "material", material)
    law, values = of_material(material)
    wanted = tuple(values) if parameters is None else tuple(parameters)
    if not all(math.isfinite(value) and value > 0 for value in values.values()):
        raise ValueError(f"material: expected finite parameters > 0, got {values}")
    if not wanted or set(wanted) - set(values):
        raise ValueError(f"parameters: expected some of {list(values)}, got {list(wanted)}")
    if not (target > 0 and noise > 0 and first > 0 and points >= 5):
        raise ValueError(
            f"target, noise, first > 0 and points >= 5 expected, got {target}, {noise}, {first}, {points}"
        )
    if weights not in ("relative", "absolute"):
        raise ValueError(f'weights: expected "relative" or "absolute", got {weights!r}')
    if not shares or any(not 0.0 < share <= 1.0 for share in shares):
        raise ValueError(f"shares: expected numbers in (0, 1], got {shares}")

    # durations are tried about the longest retardation time, or the time after which flow exceeds the elastic strain
    if law.tau is not None:
        span = float(law.tau[-1])
    elif "G2" in values:
        span = values["eta2"] / values["G2"]
    else:
        span = values.get("eta", 1.0) / values["G"]

    def shortest(sampling: str, share: float) -> CreepTest:
        sd = lambda T: _bounds(law, values, *_times(T, points, first, sampling, share), noise, weights)
        return CreepTest(sampling, share, *_shortest(sd, span, wanted, target))

    found = [shortest(sampling, share) for sampling in SAMPLINGS for share in shares]
    return Design(target, noise, weights, points, tuple(sorted(found, key=lambda e: e.duration)))


def bounds(
    material: Any, t: Any, *, noise: float = 0.01, weights: str = "relative", hold: float = math.inf
) -> dict[str, float]:
    """Return the sd of the log parameters from samples at t (n,) [s] of a test that is unloaded after ``hold`` [s].

    noise: as in ``design``.
    """
    law, values = of_material(material)
    return _bounds(law, values, np.asarray(t, float), hold, noise, weights)


def _bounds(
    law: Structure, values: dict[str, float], t: np.ndarray, hold: float, noise: float, weights: str
) -> dict[str, float]:
    """Return the bounds from the singular values of the weighted Jacobian."""
    u = jnp.log(jnp.array(list(values.values())))
    response, J = map(np.asarray, _jacobian(u, jnp.asarray(t), jnp.asarray(hold), law))
    size = np.abs(response)
    if math.isfinite(hold):  # residual strain is a difference from the strain under load, whose error it has
        loaded = np.abs(np.asarray(_jacobian(u, jnp.array([hold]), jnp.asarray(math.inf), law)[0]))
        size = np.maximum(size, np.where(t >= hold, loaded, 0.0))
    J = J / (noise * (size if weights == "relative" else np.full(size.shape, size.max())))[:, None]
    size = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    _, s, V = np.linalg.svd(J / size, full_matrices=False)
    sd = np.sqrt(np.sum((V / np.maximum(s, 1e-300)[:, None]) ** 2, 0)) / size
    return dict(zip(values, map(float, sd), strict=True))


@functools.partial(jax.jit, static_argnames="law")
def _jacobian(u: Array, t: Array, hold: Array, law: Structure) -> tuple[Array, Array]:
    """Return the response (n,) to a unit stress that is removed after ``hold``, and its Jacobian in log parameters."""

    def response(u: Array) -> Array:
        creep = law.material(dict(zip(law.where, jnp.exp(u), strict=True)), Compressibility("nu", 0.0)).creep
        return creep(t) - jnp.where(t >= hold, creep(jnp.maximum(t - hold, 0.0)), 0.0)

    return response(u), jax.jacfwd(response)(u)


def _times(T: float, points: int, first: float, sampling: str, share: float) -> tuple[np.ndarray, float]:
    """Return the samples of one test of duration T, and the time of unloading."""
    hold = share * T if share < 1.0 else math.inf
    if sampling == "even":
        return np.arange(1, points + 1) * T / points, hold
    if share == 1.0:
        return np.geomspace(min(first, 0.1 * T), T, points), hold
    half, rest = points // 2, T - hold
    loaded = np.geomspace(min(first, 0.1 * hold), 0.999 * hold, half)
    return np.append(loaded, hold + np.geomspace(min(first, 0.1 * rest), rest, points - half)), hold


def _shortest(
    sd: Callable[[float], dict[str, float]], span: float, wanted: tuple[str, ...], target: float
) -> tuple[float, dict[str, float]]:
    """Return the duration [s] and its sd, by a scan over log durations, then bisection at the first sufficient one."""
    good = lambda T: all(sd(T)[name] <= target for name in wanted)
    tried = span * np.geomspace(SHORTEST, LONGEST, TRIED)
    k = next((k for k, T in enumerate(tried) if good(T)), None)
    if k is None:  # the best of the durations that were tried
        largest = lambda found: max(found[name] for name in wanted)
        return math.inf, min(map(sd, tried), key=largest)
    low, high = tried[max(k - 1, 0)], tried[k]
    for _ in range(HALVINGS if k else 0):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if good(middle) else (middle, high)
    return float(high), sd(high)
