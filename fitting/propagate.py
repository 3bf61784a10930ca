"""A fit's uncertainty carried into a result, by gradients.

    var f = g^T C g,   g = df/dp + sum over q of the nuisances' share,

with p = (j0, j2, f, j2/tau) the compliances that were fitted and C their covariance. A nuisance q
(Poisson's ratio, a film's thickness) with a standard deviation s acts twice: in f itself, and through
the parameters, which were fitted at the assumed q:  (df/dq + df/dp dp/dq)^2 s^2.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy import stats

from fitting import models, uncertainty
from fitting.halfspace import FLOW, LOGS
from fitting.indentation_result import IndentationFit
from fitting.nonlinear import inverse
from fitting.result import CreepFit

LEAST = 1e-9  # share of the largest compliance: an infinite parameter has no slope, this has


class Propagated(NamedTuple):
    """value, sd, low, high: arrays of the shape of f's result; shares: {cause: sd from it alone}."""

    value: np.ndarray
    sd: np.ndarray
    low: np.ndarray
    high: np.ndarray
    shares: dict[str, np.ndarray]


def propagate(
    fit: CreepFit | IndentationFit,
    f: Callable[..., Array],
    *,
    spread: dict[str, tuple[float, float] | float] | None = None,
) -> Propagated:
    """The band of f(material), at the fit's level, from the uncertainty of a fit.

    f: a differentiable function of a material, to a number or an array. spread: {"nu": sd} varies
    Poisson's ratio about the fit's; {"thickness": sd} [m] also gives f the film's thickness as its second
    argument, about that of the fit, or (value, sd) where the fit has none. Linear in the compliances:
    where a parameter is not determined the band says so by its width. Raises ValueError on bad input.
    """
    p, covariance = _parameters(fit)
    spread = spread or {}
    values, sds = _spread(fit, spread)
    model, where = fit.model, models.PARTS[fit.model]
    thick = "thickness" in spread

    def result(p: Array, q: dict[str, Array]) -> Array:
        material = model(**{name: 1.0 / p[part] for name, part in where.items()}, nu=q["nu"])
        return jnp.asarray(f(material, q["thickness"]) if thick else f(material), dtype=float)

    used = sorted(where.values())
    some = lambda x, q: result(jnp.asarray(p).at[jnp.array(used)].set(x), q)
    start = jnp.asarray(p)[jnp.array(used)]
    value = np.asarray(some(start, values))
    by_p, by_q = jax.jacfwd(some, argnums=(0, 1))(start, values)
    by_p = np.asarray(by_p)
    C = covariance[np.ix_(used, used)]
    shares = {"data": np.sqrt(np.maximum(np.einsum("...i,ij,...j->...", by_p, C, by_p), 0.0))}
    for name, sd in sds.items():
        moved = np.asarray(by_q[name]) + by_p @ _response(fit, name)[used]
        shares[name] = np.abs(moved) * sd
    total = np.sqrt(sum(share**2 for share in shares.values()))
    z = stats.norm.ppf(0.5 + 0.5 * fit.level)
    return Propagated(value, total, value - z * total, value + z * total, shares)


def _parameters(fit: CreepFit | IndentationFit) -> tuple[np.ndarray, np.ndarray]:
    """Compliances (4,) in SI, off zero, and their covariance."""
    if isinstance(fit, IndentationFit):
        theta, covariance, press, _ = fit._state
        unit = press.unit * np.array([1.0, 1.0, 1 / press.duration, 1 / press.duration])
        p = np.array(theta[:4])
        p[list(LOGS)] = np.exp(p[list(LOGS)])
        slope = np.where(np.arange(4) == FLOW, 1.0, p)
        C = covariance[:4, :4] * np.outer(slope, slope)
    elif isinstance(fit, CreepFit):
        scaled, best = fit._state[:2]
        unit = scaled.compliance * np.array([1.0, 1.0, 1 / scaled.time, 1 / scaled.time])
        p = np.asarray(best.parts)
        problem = scaled.problem
        lower, upper = np.append(problem.lower, problem.ratio[0]), np.append(problem.upper, problem.ratio[1])
        free = np.flatnonzero(lower < upper)
        J = np.asarray(uncertainty.jacobian(problem, best.parts, best.tau))[:, free]
        spread = (1.0 if fit.weights == "sigma" else fit.noise) * fit.widening
        C = np.zeros((4, 4))
        C[np.ix_(free, free)] = inverse(J) * spread**2
    else:
        raise ValueError(f"fit: expected a CreepFit or an IndentationFit, got {type(fit).__name__}")
    return np.maximum(p, LEAST * p.max()) * unit, C * np.outer(unit, unit)


def _spread(fit: Any, spread: dict) -> tuple[dict[str, Array], dict[str, float]]:
    """Values of nu and thickness, and the standard deviations given."""
    film = getattr(fit, "film", None)
    known = {"nu": float(fit.material.nu), "thickness": film.thickness if film else None}
    values, sds = {"nu": jnp.asarray(known["nu"])}, {}
    for name, given in spread.items():
        if name not in known:
            raise ValueError(f"spread: expected keys among {list(known)}, got {name!r}")
        value, sd = given if isinstance(given, tuple) else (known[name], given)
        if value is None or not (np.isfinite(sd) and sd >= 0):
            raise ValueError(f"spread[{name!r}]: expected sd >= 0, or (value, sd), got {given!r}")
        if known[name] is not None and value != known[name]:
            raise ValueError(f"spread[{name!r}]: the fit was made at {known[name]:g}, got {value:g}")
        values[name], sds[name] = jnp.asarray(float(value)), float(sd)
    return values, sds


def _response(fit: Any, name: str) -> np.ndarray:
    """d (compliances in SI)/d nuisance (4,): none for creep, where neither nu nor a thickness enters."""
    if isinstance(fit, CreepFit):
        return np.zeros(4)
    theta, _, press, moves = fit._state
    unit = press.unit * np.array([1.0, 1.0, 1 / press.duration, 1 / press.duration])
    p = np.array(theta[:4])
    p[list(LOGS)] = np.exp(p[list(LOGS)])
    return np.where(np.arange(4) == FLOW, 1.0, p) * moves(name)[:4] * unit
