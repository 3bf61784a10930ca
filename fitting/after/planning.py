"""Which experiment would determine the parameters: Cramer-Rao bounds of creep tests not yet made.

The standard deviations of the logarithms of the parameters are those of least squares with the stated
noise, from the exact Jacobian of the response to a stress of one: a hold, or a hold and the recovery
after it. Relative noise is a share of the strain under load: what is left of it in recovery has the error of the
strain at the end of the hold, of which it is a difference. Where no test is long enough the design says so.
"""

import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.models.structure import Structure, Volume, of_material

SHORTEST, LONGEST = 0.02, 100.0  # durations tried, over tau
TRIED, HALVINGS = 40, 20
SAMPLINGS = ("even", "logarithmic")


class CreepTest(NamedTuple):
    """A test and what it would tell.

    Attributes:
        sampling: "even" or "logarithmic" times.
        share: of the duration that is hold, the rest is recovery.
        duration: [s], inf where no duration up to the longest tried serves.
        sd: {parameter: of its log} there.
    """

    sampling: str
    share: float
    duration: float
    sd: dict[str, float]


class Design(NamedTuple):
    """Creep tests that reach a target; as text a table.

    Attributes:
        target, noise, weights, points: as asked for.
        experiments: shortest first; those that cannot reach it, last.
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
            need = f"{e.duration:.4g} s" if math.isfinite(e.duration) else "no duration serves"
            lines.append(f"  {kind}, {e.sampling} times: {need} ({sds})")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)


def design(
    material: Any, *, target: float = 0.1, noise: float = 0.01, weights: str = "relative", points: int = 200,
    first: float = 1.0, shares: tuple[float, ...] = (1.0, 0.5, 0.2), parameters: tuple[str, ...] | None = None,
) -> Design:  # fmt: skip
    """The shortest creep tests that would give each parameter to a wanted accuracy.

    Args:
        material: one of those that can be fitted, or a fit, about as the truth is expected to be.
        target: largest standard deviation of the logarithm of a parameter.
        noise: of each point, as a share of its value (weights "relative"; in recovery, of the value at the end of the
            hold) or of the largest ("absolute").
        weights: "relative" or "absolute".
        points: their number.
        first: the first of logarithmic times [s].
        shares: of the duration that is hold, the rest being recovery; one test is sought for each.
        parameters: those wanted, all by default.

    Returns:
        The tests, shortest first.

    Raises:
        ValueError: a material with infinite parameters, or values outside their range.

    Example:
        >>> found = fitting.design(jc.Maxwell(G=1e6, eta=1e8), target=0.01, shares=(1.0,))
        >>> print(f"{found.experiments[0].sampling} times for {found.experiments[0].duration:.0f} s")
        even times for 28 s
    """
    material = getattr(material, "material", material)
    law, values = of_material(material)
    wanted = tuple(values) if parameters is None else tuple(parameters)
    _check(values, wanted, target, noise, weights, points, first, shares)
    span = _time_scale(law, values)

    def shortest(sampling: str, share: float) -> CreepTest:
        sd = lambda T: _bounds(law, values, *_times(T, points, first, sampling, share), noise, weights)
        return CreepTest(sampling, share, *_shortest(sd, span, wanted, target))

    found = [shortest(sampling, share) for sampling in SAMPLINGS for share in shares]
    return Design(target, noise, weights, points, tuple(sorted(found, key=lambda e: e.duration)))


def bounds(
    material: Any, t: Any, *, noise: float = 0.01, weights: str = "relative", hold: float = math.inf
) -> dict[str, float]:
    """sd of the log parameters from samples at t (n,) [s] of a test that is unloaded after ``hold`` [s]; noise as of
    ``design``."""
    law, values = of_material(material)
    return _bounds(law, values, np.asarray(t, float), hold, noise, weights)


def _bounds(
    law: Structure, values: dict[str, float], t: np.ndarray, hold: float, noise: float, weights: str
) -> dict[str, float]:
    """By the singular values of the weighted Jacobian."""
    u = jnp.log(jnp.array(list(values.values())))
    response, J = map(np.asarray, _jacobian(u, jnp.asarray(t), jnp.asarray(hold), law))
    size = np.abs(response)
    if math.isfinite(hold):  # a strain that is left is the difference from that under load, and has its error
        loaded = np.abs(np.asarray(_jacobian(u, jnp.array([hold]), jnp.asarray(math.inf), law)[0]))
        size = np.maximum(size, np.where(t >= hold, loaded, 0.0))
    J = J / (noise * (size if weights == "relative" else np.full(size.shape, size.max())))[:, None]
    size = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    _, s, V = np.linalg.svd(J / size, full_matrices=False)
    sd = np.sqrt(np.sum((V / np.maximum(s, 1e-300)[:, None]) ** 2, 0)) / size
    return dict(zip(values, map(float, sd), strict=True))


@functools.partial(jax.jit, static_argnames="law")
def _jacobian(u: Array, t: Array, hold: Array, law: Structure) -> tuple[Array, Array]:
    """Response (n,) to a stress of one, taken off after ``hold``, and its Jacobian in log parameters."""

    def response(u: Array) -> Array:
        creep = law.material(dict(zip(law.where, jnp.exp(u), strict=True)), Volume("nu", 0.0)).creep
        return creep(t) - jnp.where(t >= hold, creep(jnp.maximum(t - hold, 0.0)), 0.0)

    return response(u), jax.jacfwd(response)(u)


def _times(T: float, points: int, first: float, sampling: str, share: float) -> tuple[np.ndarray, float]:
    """Samples of one test of duration T, and when it is unloaded."""
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
    """Duration [s] and its sd, by a scan over log durations, then bisection at the first that serves."""
    good = lambda T: all(sd(T)[name] <= target for name in wanted)
    tried = span * np.geomspace(SHORTEST, LONGEST, TRIED)
    k = next((k for k, T in enumerate(tried) if good(T)), None)
    if k is None:
        return math.inf, sd(tried[-1])
    low, high = tried[max(k - 1, 0)], tried[k]
    for _ in range(HALVINGS if k else 0):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if good(middle) else (middle, high)
    return float(high), sd(high)


def _time_scale(law: Structure, values: dict[str, float]) -> float:
    """The longest retardation time [s], or that in which flow catches up with the spring."""
    if law.tau is not None:
        return float(law.tau[-1])
    if "G2" in values:
        return values["eta2"] / values["G2"]
    return values.get("eta", 1.0) / values["G"]


def _check(values, wanted, target, noise, weights, points, first, shares) -> None:
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
