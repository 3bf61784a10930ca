"""Which experiment would determine the parameters: Cramer-Rao bounds of creep tests not yet made.

The standard deviations of the logarithms of the parameters are those of least squares with the stated
noise, from the exact Jacobian of the response to a stress of one: a hold, or a hold and the recovery
after it. Where none is long enough the design says so.
"""

import functools
import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting import models

SHORTEST, LONGEST = 0.02, 100.0  # durations tried, over tau
TRIED, HALVINGS = 40, 20
SAMPLINGS = ("even", "logarithmic")


class Experiment(NamedTuple):
    """sampling: "even" or "logarithmic" times; share: of the duration that is hold, the rest is recovery;
    duration [s], inf where no duration up to the longest tried serves; sd {parameter: of its log} there."""

    sampling: str
    share: float
    duration: float
    sd: dict[str, float]


class Design(NamedTuple):
    """Experiments that reach ``target``, shortest first; those that cannot, last."""

    target: float
    noise: float
    weights: str
    points: int
    experiments: tuple[Experiment, ...]

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


def design(
    material: Any, *, target: float = 0.1, noise: float = 0.01, weights: str = "relative", points: int = 200,
    first: float = 1.0, shares: tuple[float, ...] = (1.0, 0.5, 0.2), parameters: tuple[str, ...] | None = None,
) -> Design:  # fmt: skip
    """The shortest creep tests that would give each parameter to sd(log) <= target.

    material: one of those that can be fitted, or a fit, about as the truth is expected to be. noise: of
    each point, as a share of its value (weights "relative") or of the largest ("absolute"); points: their
    number; first [s]: the first of logarithmic times; shares: of the duration that is hold; parameters:
    those wanted, all by default. Raises ValueError on bad input.
    """
    material = getattr(material, "material", material)
    model = models.resolve(type(material))
    names = tuple(models.PARTS[model])
    values = np.array([float(getattr(material, name)) for name in names])
    wanted = names if parameters is None else tuple(parameters)
    _check(names, values, wanted, target, noise, weights, points, first, shares)
    spans = _time_scale(dict(zip(names, values, strict=True)))
    scene = functools.partial(_sd, model, names, values, noise, weights, points, first)
    found = [
        _shortest(scene, sampling, share, spans, [names.index(n) for n in wanted], target, names)
        for sampling in SAMPLINGS
        for share in shares
    ]
    return Design(target, noise, weights, points, tuple(sorted(found, key=lambda e: e.duration)))


def bounds(
    material: Any, t: Any, *, noise: float = 0.01, weights: str = "relative", hold: float = math.inf
) -> dict[str, float]:
    """sd of the log parameters from samples at t (n,) [s] of a test that is unloaded after ``hold`` [s]."""
    model = models.resolve(type(material))
    names = tuple(models.PARTS[model])
    values = np.array([float(getattr(material, name)) for name in names])
    return dict(
        zip(names, _bounds(model, names, values, np.asarray(t, float), hold, noise, weights), strict=True)
    )


def _bounds(
    model: type, names: tuple, values: np.ndarray, t: np.ndarray, hold: float, noise: float, weights: str
):
    response, J = _jacobian(jnp.log(values), jnp.asarray(t), jnp.asarray(hold), model, names)
    response, J = np.asarray(response), np.asarray(J)
    weight = 1.0 / (noise * (np.abs(response) if weights == "relative" else np.max(np.abs(response))))
    J = J * np.broadcast_to(weight, response.shape)[:, None]
    size = np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    _, s, V = np.linalg.svd(J / size, full_matrices=False)
    return np.sqrt(np.sum((V / np.maximum(s, 1e-300)[:, None]) ** 2, 0)) / size


@functools.partial(jax.jit, static_argnames=("model", "names"))
def _jacobian(u: Array, t: Array, hold: Array, model: type, names: tuple) -> tuple[Array, Array]:
    """Response (n,) to a stress of one, taken off after ``hold``, and its Jacobian in log parameters."""

    def response(u: Array) -> Array:
        creep = model(**dict(zip(names, jnp.exp(u), strict=True))).creep
        return creep(t) - jnp.where(t >= hold, creep(jnp.maximum(t - hold, 0.0)), 0.0)

    return response(u), jax.jacfwd(response)(u)


def _sd(
    model: type, names: tuple, values: np.ndarray, noise: float, weights: str, points: int, first: float,
    sampling: str, share: float, T: float,
) -> np.ndarray:  # fmt: skip
    """sd of the log parameters of one experiment of duration T."""
    even = np.arange(1, points + 1) * T / points
    hold = share * T if share < 1.0 else math.inf
    if sampling == "even":
        t = even
    elif share == 1.0:
        t = np.geomspace(min(first, 0.1 * T), T, points)
    else:
        half = points // 2
        a, b = np.geomspace(min(first, 0.1 * hold), 0.999 * hold, half), T - hold
        t = np.concatenate([a, hold + np.geomspace(min(first, 0.1 * b), b, points - half)])
    return _bounds(model, names, values, t, hold, noise, weights)


def _shortest(
    scene: Any, sampling: str, share: float, tau: float, wanted: list[int], target: float, names: tuple
) -> Experiment:
    """By a scan over log durations, then bisection at the first that serves."""
    good = lambda T: bool(np.all(scene(sampling, share, T)[wanted] <= target))
    tried = tau * np.geomspace(SHORTEST, LONGEST, TRIED)
    k = next((k for k, T in enumerate(tried) if good(T)), None)
    if k is None:
        sd = scene(sampling, share, tried[-1])
        return Experiment(sampling, share, math.inf, dict(zip(names, map(float, sd), strict=True)))
    low, high = tried[max(k - 1, 0)], tried[k]
    for _ in range(HALVINGS if k else 0):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if good(middle) else (middle, high)
    return Experiment(
        sampling, share, float(high), dict(zip(names, map(float, scene(sampling, share, high)), strict=True))
    )


def _time_scale(values: dict[str, float]) -> float:
    """The retardation time [s], or that in which flow catches up with the spring."""
    if "G2" in values:
        return values["eta2"] / values["G2"]
    return values.get("eta", 1.0) / values["G"]


def _check(names, values, wanted, target, noise, weights, points, first, shares) -> None:
    if not np.all(np.isfinite(values) & (values > 0)):
        raise ValueError(
            f"material: expected finite parameters > 0, got {dict(zip(names, values, strict=True))}"
        )
    if not wanted or set(wanted) - set(names):
        raise ValueError(f"parameters: expected some of {list(names)}, got {list(wanted)}")
    if not (target > 0 and noise > 0 and first > 0 and points >= 5):
        raise ValueError(
            f"target, noise, first > 0 and points >= 5 expected, got {target}, {noise}, {first}, {points}"
        )
    if weights not in ("relative", "absolute"):
        raise ValueError(f'weights: expected "relative" or "absolute", got {weights!r}')
    if not shares or any(not 0.0 < share <= 1.0 for share in shares):
        raise ValueError(f"shares: expected numbers in (0, 1], got {shares}")
