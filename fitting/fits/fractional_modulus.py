"""Fractional laws fitted to a modulus over time or frequency, in the coordinates log G, log V and alpha.

With the springpot's modulus V (i omega)^alpha, in closed form,

    springpot     G* = V (i omega)^alpha               G(t) = V t^-alpha/Gamma(1 - alpha)
    Kelvin-Voigt  G* = G + V (i omega)^alpha           G(t) = G + V t^-alpha/Gamma(1 - alpha)
    Maxwell       1/G* = 1/G + 1/(V (i omega)^alpha)   G(t) = G E_alpha(-(t/tau)^alpha),  tau = (V/G)^(1/alpha)

with the Mittag-Leffler function E_alpha. Source: A. Jaishankar, G. H. McKinley, Proc. R. Soc. A 469 (2013) 20120284.
"""

import dataclasses
import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import gammaln
from jax.tree_util import Partial

import jaxcontact as jc
from fitting.fits.fractional import ORDERS, Law, LawSpace, orders
from fitting.models.search_space import Landscape
from fitting.models.structure import Sought
from fitting.search.nonlinear import Objective

EDGE = 25.0  # e-folds beyond the range of the data at which log G and log V are bounded
STARTS = tuple(itertools.product((0.2, 0.5, 0.8), (0.0, 0.5, 1.0)))  # alpha, place of the transition


@dataclasses.dataclass(frozen=True, eq=False)
class Relaxed:
    """A modulus over times [s] or angular frequencies [rad/s] x (n,), G' followed by G'' of an oscillation.

    y (n,): the modulus over its largest value ``unit`` [Pa].
    """

    relaxed: bool
    x: np.ndarray
    y: np.ndarray
    unit: float

    @property
    def span(self) -> tuple[float, float]:
        """Shortest and longest time [s] of the data."""
        low, high = float(self.x.min()), float(self.x.max())
        return (low, high) if self.relaxed else (1.0 / high, 1.0 / low)

    def bounded(self, sought: Sought) -> Sought:
        """Return the sought law with bounds of alpha, its material approximated over the times of the data."""
        assert isinstance(sought.structure, Law)
        law = dataclasses.replace(sought.structure, span=self.span)
        return sought._replace(structure=law, table=orders(sought.table))

    def space(self, sought: Sought) -> LawSpace:
        """Return the search space of log G, log V and alpha, in SI units."""
        size, (first, last) = np.log(self.unit), np.log(self.span)
        reach = (size - EDGE + min(first, 0.0), size + EDGE + max(last, 0.0))
        whole = {"G": (size - EDGE, size + EDGE), "V": reach, "alpha": (ORDERS[0], 1.0)}
        whole["alpha"] = (ORDERS[0], ORDERS[1] if self.relaxed else 1.0)
        names = sought.structure.where
        box = [_within(whole[name], name, sought.table[name]) for name in names]
        return LawSpace.of(sought.structure, np.array(box), np.array([name != "alpha" for name in names]))

    def starts(self, law: Law) -> list[np.ndarray]:
        """Return starting coordinates from pairs of alpha and the place of the transition on the logarithmic time axis."""
        first, last = np.log(self.span)
        pairs = STARTS if "G" in law.where else STARTS[::3]
        return [self._start(law, alpha, first + place * (last - first)) for alpha, place in pairs]

    def _start(self, law: Law, alpha: float, log_tau: float) -> np.ndarray:
        """Return the coordinates of a law whose spring and springpot are equal at a time."""
        size = np.log(self.unit)
        if law.model is jc.FractionalKelvinVoigt:
            size = np.log(np.median(np.abs(self.y)) * self.unit)
        at = {"G": size, "V": size + alpha * log_tau, "alpha": alpha}
        return np.array([at[name] for name in law.where])

    def objective(self, space: LawSpace, weights: np.ndarray) -> Objective:
        """Return the least-squares objective for weights (n,) of y."""
        kind = {"model": space.structure.model, "relaxed": self.relaxed}
        arrays = self.x, self.y, weights, np.log(self.unit)
        return Objective(
            lambda theta: np.asarray(_residual(theta, *arrays, **kind)),
            lambda theta, free: np.asarray(_slopes(theta, *arrays, **kind))[:, free],
            *space.bounds,
            floor=1e-26 * float(np.sum((weights * self.y) ** 2)),
        )

    def landscape(self, space: LawSpace, theta: np.ndarray, weights: np.ndarray) -> Landscape:
        """Return the residuals as a function of the parameters about theta (m,), relative to their best values."""
        values = space.values(theta)
        box = np.stack([space.values(end) for end in space.bounds], -1) / values[:, None]
        run = functools.partial(
            _at_values, space.structure.model, self.relaxed, tuple(space.logarithmic.tolist())
        )
        arrays = values, self.x, self.y, weights, np.log(self.unit)
        return Landscape(Partial(run, *arrays), np.ones(values.size), box, values)


def _within(whole: tuple[float, float], name: str, bounds: tuple[float, float]) -> tuple[float, float]:
    """Return the range of a coordinate restricted to the bounds of its parameter."""
    with np.errstate(divide="ignore"):
        low, high = bounds if name == "alpha" else map(float, np.log(bounds))
    return (low, high) if low == high else (max(whole[0], low), min(whole[1], high))


def modulus(model: type, values: dict, x: Array, relaxed: bool) -> Array:
    """Return G(t) (1, n) at times x [s], or G' and G'' (2, n) at angular frequencies x [rad/s]."""
    V, alpha, G = values["V"], values["alpha"], values.get("G")
    if relaxed:
        if model is jc.FractionalMaxwell:
            strain = jc.FractionalKelvinVoigt(G=1.0, V=V / G, alpha=alpha).creep(x)  # 1 - E_alpha
            return (G * (1.0 - strain))[None]
        pot = V * jnp.exp(-alpha * jnp.log(x) - gammaln(1.0 - alpha))
        return (pot if G is None else G + pot)[None]
    pot = V * jnp.exp(alpha * jnp.log(x)) * jnp.exp(0.5j * jnp.pi * alpha)
    if model is jc.FractionalMaxwell:
        pot = G * pot / (G + pot)
    found = pot if G is None or model is jc.FractionalMaxwell else G + pot
    return jnp.stack([found.real, found.imag])


@functools.partial(jax.jit, static_argnames=("model", "relaxed"))
def _residual(
    theta: Array, x: Array, y: Array, weights: Array, log_unit: Array, *, model: type, relaxed: bool
) -> Array:
    """Return the weighted residuals (n,) at coordinates (m,), of which the last two are log V and alpha."""
    *spring, log_V, alpha = theta
    values = {"V": jnp.exp(log_V - log_unit), "alpha": alpha}
    values |= {"G": jnp.exp(spring[0] - log_unit)} if spring else {}
    once = x if relaxed else x[: x.size // 2]
    return weights * (modulus(model, values, once, relaxed).ravel() - y)


@functools.partial(jax.jit, static_argnames=("model", "relaxed"))
def _slopes(theta: Array, *arrays: Array, model: type, relaxed: bool) -> Array:
    """Return the Jacobian (n, m) of the residuals."""
    return jax.jacfwd(lambda at: _residual(at, *arrays, model=model, relaxed=relaxed))(jnp.asarray(theta))


def _at_values(model: type, relaxed: bool, logs: tuple[bool, ...], unit: Array, *rest: Array) -> Array:
    """Return the weighted residuals at parameters relative to ``unit``, which come last."""
    *arrays, values = rest
    by_log = np.array(logs)
    theta = jnp.where(by_log, jnp.log(values * unit), values * unit)
    return _residual(theta, *arrays, model=model, relaxed=relaxed)
