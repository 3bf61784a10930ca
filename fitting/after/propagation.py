"""Propagation of a fit's uncertainty to a result, by gradients.

    var f = g^T C g + sum_q (df/dq + df/dp dp/dq)^2 s_q^2,   g = df/dp,

with p the fitted compliances (``structure.py``) and C their covariance. A quantity q that was held in the fit
(Poisson's ratio, a film's thickness), with standard deviation s_q, acts twice: in f itself, and through the parameters,
which were fitted at the assumed q.
"""

import warnings
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.inference import noise
from fitting.inference.result import Fit
from fitting.models.structure import Compressibility
from fitting.views.text import described


class Propagated(NamedTuple):
    """A result with its uncertainty.

    Attributes:
        value, sd, low, high: arrays of the shape of the result.
        shares: {cause: sd due to it alone}, "data" and the quantities that were varied.
    """

    value: np.ndarray
    sd: np.ndarray
    low: np.ndarray
    high: np.ndarray
    shares: dict[str, np.ndarray]

    def __repr__(self) -> str:
        rows = [(name, getattr(self, name), "") for name in ("value", "sd", "low", "high")]
        rows += [(f"sd from {cause}", sd, "") for cause, sd in self.shares.items()]
        return described("Propagated, in the unit of the result:", rows)


def propagate(
    fit: Fit,
    f: Callable[..., Array],
    *,
    spread: dict[str, tuple[float, float] | float] | None = None,
) -> Propagated:
    """Return the band of f(material), at the level of the fit, from the uncertainty of the fit.

    The result is linearised in the compliances; where a parameter is not identifiable the band is wide. Far beyond the data,
    where a result is not linear within the uncertainty of the compliances, the band is too narrow on one side: after creep
    for three retardation times with 2 % noise, that of G' at 0.12 over their duration held the truth in 89 of 120 cases,
    after five in 77 of 80. ``Posterior.propagate`` is not linearised.

    Args:
        fit: result of ``fit_creep``, ``fit_prony``, ``fit_indentation`` or ``fit_growth``.
        f: a differentiable function of a material, or of ``GrowthKinetics``, to a number or an array.
        spread: standard deviations of given quantities, whose effect is added to the band. {"nu": sd}, or
            {"bulk_modulus": sd} [Pa] for a fit with a bulk modulus: about the value of the fit. {"thickness": sd} [m]:
            f is then called with the thickness of the film as a second argument, about that of the fit; {"thickness":
            (value, sd)} if the fit has no film.

    Returns:
        Value, standard deviation and band, in the shape and unit of f's result; all are nan where the value is not finite.

    Raises:
        ValueError: an object that is not a fit, a result with zero derivative, or a spread of an unknown quantity.

    Example:
        >>> t = np.linspace(0.0, 10.0, 21)
        >>> data = fitting.CreepData(t=t, J=1e-6 * (1.0 + t))
        >>> fit = fitting.fit_creep(data, "Maxwell", sigma=1e-8)
        >>> band = fitting.propagate(fit, lambda material: material.creep(100.0))
        >>> print(f"J(100 s) = {band.value:.4g} +- {band.sd:.1g} 1/Pa")
        J(100 s) = 0.000101 +- 7e-08 1/Pa
    """
    if not isinstance(fit, Fit):
        raise ValueError(f"fit: expected the result of a fit, got {type(fit).__name__}")
    spread, structure, film = spread or {}, fit.structure, getattr(fit, "film", None)
    # values of the held volumetric parameter, unless a law has none, and of the thickness; standard deviations given
    held = None
    if hasattr(fit.material, "bulk_modulus"):
        held = "nu" if fit.material.bulk_modulus is None else "bulk_modulus"
    volume = {held: float(getattr(fit.material, held))} if held else {}
    known = volume | {"thickness": film.thickness if film else None}
    values, sds = {name: jnp.asarray(value) for name, value in volume.items()}, {}
    for name, given in spread.items():
        if name not in known:
            raise ValueError(f"spread: expected keys among {list(known)}, got {name!r}")
        middle, sd = given if isinstance(given, tuple) else (known[name], given)
        if middle is None or not (np.isfinite(sd) and sd >= 0):
            raise ValueError(f"spread[{name!r}]: expected sd >= 0, or (value, sd), got {given!r}")
        if known[name] is not None and middle != known[name]:
            raise ValueError(f"spread[{name!r}]: the fit was made at {known[name]:g}, got {middle:g}")
        values[name], sds[name] = jnp.asarray(float(middle)), float(sd)
    thick = "thickness" in spread

    def result(p: Array, q: dict[str, Array]) -> Array:
        volume = Compressibility(held, q[held]) if held else None
        material = structure.material(structure.parameters(p), volume)
        return jnp.asarray(f(material, q["thickness"]) if thick else f(material), dtype=float)

    start = jnp.asarray(structure.off_zero(fit.estimate.best, fit.duration))
    value = np.asarray(result(start, values))
    by_p, by_q = jax.jacfwd(result, argnums=(0, 1))(start, values)
    by_p = np.asarray(by_p)
    variance = np.einsum("...i,ij,...j->...", by_p, fit.covariance(), by_p)
    shares = {"data": np.sqrt(np.maximum(variance, 0.0))}
    for name, sd in sds.items():
        shares[name] = np.abs(np.asarray(by_q[name]) + by_p @ fit.moves(name)) * sd
    # An error where the whole result has zero derivative; a warning where a part has, since its sd would be 0.
    slopes = np.any(by_p != 0.0, axis=-1) | np.any(
        [np.asarray(slope) != 0.0 for slope in by_q.values()], axis=0
    )
    finite = np.isfinite(value)
    without = int(np.sum(~slopes & finite))
    why = "a count of cells (contact_area) has none; smooth_area and contact_radius have one"
    if without and without == np.sum(finite):
        raise ValueError(f"f: expected a result that depends smoothly on the material, got slope 0: {why}")
    if without:
        warnings.warn(f"f: {without} of {value.size} values have slope 0, and sd 0: {why}", stacklevel=2)
    # a value that is not known has no standard deviation either
    shares = {cause: np.where(np.isfinite(value), share, np.nan) for cause, share in shares.items()}
    total = np.sqrt(sum(share**2 for share in shares.values()))
    z = noise.two_sided(fit.level)
    return Propagated(value, total, value - z * total, value + z * total, shares)
