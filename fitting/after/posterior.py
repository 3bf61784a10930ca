"""The posterior of a material's parameters given the data of a fit, by Hamiltonian Monte Carlo.

    p(x | data) ~ (1 + (RSS(x) - RSS_0)/(w^2 RSS_0))^(-n/2)          exp(-(RSS(x) - RSS_0)/(2 w^2)) with known sigma

x are the logarithms of the parameters (of the compliances of a series), and the nuisance parameters of an indentation;
RSS_0 is the smallest sum of squares and w the factor by which the fit widened its intervals for correlated noise. The
standard deviation of the points is integrated out with the prior 1/s. For a model that is linear in x this is Student's
t distribution with n - p degrees of freedom, whose intervals are those of the profiles (A. Gelman et al., Bayesian Data
Analysis, 2013, sec. 14.2). The prior is uniform in x between the bounds of the fit; an open side ends some decades
beyond the range of the data, which matters only where they do not bound a parameter.
"""

import dataclasses
import functools
import importlib
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import Partial

from fitting.after.propagation import Propagated
from fitting.inference.result import Fit, Landscape
from fitting.models.structure import Compressibility
from fitting.views import sheet, text
from jaxcontact._compile.programs import compiler_options

# Hamiltonian Monte Carlo sampling of the posterior of a fit: its density, the starts of the chains, and the chains.
#
# The density is that of ``Density`` over coordinates x between ``low`` and ``high``; the sampler moves in z, x = low
# + (high - low)/(1 + exp(-z)). It is the No-U-Turn sampler of numpyro (M. D. Hoffman, A. Gelman, J. Mach. Learn. Res.
# 15 (2014) 1593), which is imported only here.


APART = 2.0  # distance of the starts of the chains, in standard deviations
WIDEST = 0.5  # largest standard deviation in z used for the starts, where the curvature is uninformative
ACCEPTED = 0.9  # target acceptance probability of the step size adaptation


@functools.partial(
    jax.tree_util.register_dataclass, meta_fields=[],
    data_fields=["residual", "held", "free", "logs", "low", "high", "rss", "widening", "points", "known"],
)  # fmt: skip
@dataclasses.dataclass(frozen=True)
class Density:
    """Posterior density of the coordinates of a fit.

    residual (n,): function of the values (k,); held (k,): the values of coordinates that are held; free (p,): places of
    the coordinates; logs (p,): which of them are logarithms; low, high (p,): bounds of the uniform prior; rss: the
    minimum; widening: factor on the noise variance; points: n; known: whether sigma is known.
    """

    residual: Partial
    held: Array
    free: Array
    logs: Array
    low: Array
    high: Array
    rss: Array
    widening: Array
    points: Array
    known: Array

    def coordinates(self, z: Array) -> Array:
        """Return the coordinates x (p,) of z (p,)."""
        return self.low + (self.high - self.low) * jax.nn.sigmoid(z)

    def values(self, x: Array) -> Array:
        """Return the compliances and nuisance parameters (k,) of coordinates (p,)."""
        own = jnp.where(self.logs, jnp.exp(jnp.where(self.logs, x, 0.0)), x)
        return self.held.at[self.free].set(own)

    def residual_at(self, z: Array) -> Array:
        """Return the weighted residuals (n,) at z (p,)."""
        return self.residual(self.values(self.coordinates(z)))

    def potential(self, z: Array) -> Array:
        """Return the negative log density of z (p,), up to a constant."""
        r = self.residual_at(z)
        rise = (r @ r - self.rss) / self.widening
        estimated = 0.5 * self.points * jnp.log1p(jnp.maximum(rise / self.rss, -0.5))
        by_data = jnp.where(self.known, 0.5 * rise, estimated)
        return by_data - jnp.sum(jax.nn.log_sigmoid(z) + jax.nn.log_sigmoid(-z))


def sampler() -> Any:
    """Return the NUTS sampler of numpyro; ImportError that names the package to install."""
    try:
        return importlib.import_module("numpyro.infer.hmc").hmc
    except ImportError:
        raise ImportError("posterior needs numpyro: pip install 'jaxcontact[bayes]'") from None


def starts(density: Density, chains: int, seed: int) -> Array:
    """Return starts z (chains, p) about the best fit, spread according to the curvature there, within the prior."""
    best = np.asarray(density.held)[np.asarray(density.free)]
    x = np.where(density.logs, np.log(np.maximum(best, 1e-300)), best)
    share = np.clip((x - density.low) / (density.high - density.low), 0.02, 0.98)
    z = np.log(share / (1.0 - share))
    curvature, axes = np.linalg.eigh(np.asarray(_curvature(jnp.asarray(z), density)))
    size = np.minimum(1.0 / np.sqrt(np.maximum(curvature, 1e-300)), WIDEST)
    random = np.random.default_rng(seed).standard_normal((chains, z.size))
    return jnp.asarray(z + APART * (random * size) @ axes.T)


@jax.jit
def _curvature(z: Array, density: Density) -> Array:
    """Return the Gauss-Newton Hessian (p, p) of the potential, without the prior."""
    J = jax.jacfwd(density.residual_at)(z)
    noise = jnp.where(density.known, 1.0, density.rss / density.points) * density.widening
    return J.T @ J / noise


def run(keys: Array, z: Array, density: Density, warmup: int, samples: int) -> tuple[Array, Array]:
    """Return coordinates (chains, samples, p) and divergence flags (chains, samples) of chains from z (chains, p)."""
    return _compiled()(keys, z, density, warmup=warmup, samples=samples)


@functools.cache
def _compiled() -> Any:
    return jax.jit(_chains, static_argnames=("warmup", "samples"), compiler_options=compiler_options())


def _chains(keys: Array, z: Array, density: Density, warmup: int, samples: int) -> tuple[Array, Array]:
    begin, step = sampler()(density.potential, algo="NUTS")

    def chain(key: Array, z: Array) -> tuple[Array, Array]:
        state = begin(
            z, num_warmup=warmup, dense_mass=True, target_accept_prob=ACCEPTED,
            forward_mode_differentiation=True, rng_key=key,
        )  # fmt: skip

        def go(state: Any, _: None) -> tuple[Any, tuple[Array, Array]]:
            state = step(state)
            return state, (density.coordinates(state.z), state.diverging)

        return jax.lax.scan(go, state, None, warmup + samples)[1]

    x, astray = jax.vmap(chain)(keys, z)
    return x[:, warmup:], astray[:, warmup:]


# the largest R-hat, and the least effective sample size, of chains that have mixed
MIXED, ENOUGH = 1.05, 200.0
ASTRAY = 0.02  # largest fraction of divergent draws


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Posterior:
    """Draws of a material's parameters from their posterior, by converged chains.

    Attributes:
        fit: the fit whose posterior was sampled.
        samples: {parameter: (s,)} of the parameters that were not held [SI], chain after chain.
        intervals: {parameter: (low, high)}, equal-tailed, at the fit's level.
        medians: {parameter: value}.
        prior: {parameter: (low, high)}: the range over which the prior is uniform in the logarithm.
        open: parameters whose profile extends beyond the prior; on that side the interval is that of the prior.
        r_hat, ess: {parameter: split R-hat of its logarithm | effective sample size}.
        nuisances: {nuisance: (s,)} of those that were fitted [SI].
        divergent: fraction of divergent draws.
        draws: compliances (s, m) [SI], as the fit's structure lists them.
    """

    fit: Fit
    samples: dict[str, np.ndarray]
    intervals: dict[str, tuple[float, float]]
    medians: dict[str, float]
    prior: dict[str, tuple[float, float]]
    open: tuple[str, ...]
    r_hat: dict[str, float]
    ess: dict[str, float]
    nuisances: dict[str, np.ndarray]
    divergent: float
    draws: np.ndarray = dataclasses.field(repr=False)

    def propagate(self, f: Callable[..., Array], most: int = 1000) -> Propagated:
        """Return the band of f(material) over the draws, without linearisation.

        Args:
            f: a function of a material that jax can trace, to a number or an array.
            most: largest number of draws used, evenly spaced.

        Returns:
            Median, standard deviation, and equal-tailed limits at the fit's level.

        Example:
            >>> t = np.linspace(0.5, 10.0, 40)
            >>> fit = fitting.fit_creep(fitting.CreepData(t=t, J=1e-6 * (1 + t)), "Maxwell", sigma=1e-8)
            >>> band = fitting.posterior(fit).propagate(lambda material: material.creep(100.0))
            >>> print(f"J(100 s) = {band.value:.3g} 1/Pa")
            J(100 s) = 0.000101 1/Pa
        """
        structure, material = self.fit.structure, self.fit.material
        held = "nu" if material.bulk_modulus is None else "bulk_modulus"
        volume = Compressibility(held, getattr(material, held))
        run = lambda row: jnp.asarray(f(structure.material(structure.parameters(row), volume)), dtype=float)
        rows = self.draws[np.linspace(0, len(self.draws) - 1, min(most, len(self.draws))).astype(int)]
        found = np.asarray(jax.lax.map(run, jnp.asarray(rows)))
        low, value, high = np.quantile(found, _shares(self.fit.level), axis=0)
        sd = np.std(found, axis=0)
        return Propagated(value, sd, low, high, {"data": sd})

    def __repr__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        """Return a line for each parameter with its interval and that of the profile."""
        some = next(iter(self.samples.values()))
        lines = [
            f"posterior of the {self.fit.model.__name__} fit: {some.size} draws, even prior in the logarithms;"
            f" {100 * self.fit.level:g} % intervals, and those of the profile"
        ]
        for name, (low, high) in self.intervals.items():
            unit, profile = self.fit.structure.unit(name), text.span(*self.fit.intervals[name])
            lines.append(
                f"  {name:5s} = {self.medians[name]:11.5g} {unit:5s} {low:.5g} to {high:.5g} (profile {profile});"
                f" R-hat {self.r_hat[name]:.3f}, {self.ess[name]:.0f} effective draws"
            )
        for name in self.open:
            low, high = self.prior[name]
            lines.append(
                f"  {name}: not bounded by the data on a side, where its interval is that of the prior,"
                f" {low:.3g} to {high:.3g}"
            )
        return "\n".join(lines)


def posterior(
    fit: Fit, *, samples: int = 1000, warmup: int = 1000, chains: int = 4, seed: int = 0, decades: float = 4.0
) -> Posterior:
    """Draw from the posterior of a fit's parameters, with the No-U-Turn sampler of numpyro.

    Weights, correlation and bounds are those of the fit (``fitting.after.posterior``).

    Args:
        fit: of creep, a series, a modulus, several tests together, or an indentation of a half-space; it
            must not be rejected.
        samples: number of draws of each chain.
        warmup: number of adaptation steps of each chain before the draws.
        chains: number of chains, at least 2.
        seed: of the random numbers; equal seeds give equal draws.
        decades: number of decades by which the prior extends beyond the best fit and the range of the data, on an
            open side.

    Returns:
        Draws, intervals and how well the chains mixed.

    Raises:
        ImportError: without numpyro, the extra ``jaxcontact[bayes]``.
        ValueError: chains that have not converged, a rejected fit, or a fit whose residuals require the contact
            solver.

    Example:
        >>> t = np.linspace(0.5, 10.0, 40)
        >>> noise = 1 + 0.01 * np.random.default_rng(0).standard_normal(40)
        >>> fit = fitting.fit_creep(fitting.CreepData(t=t, J=1e-6 * (1 + t) * noise), "Maxwell", weights="relative")
        >>> found = fitting.posterior(fit)
        >>> low, high = found.intervals["G"]
        >>> fit.intervals["G"][0] < found.medians["G"] < fit.intervals["G"][1]
        True
    """
    if not isinstance(fit, Fit):
        raise ValueError(f"fit: expected the result of a fit, got {type(fit).__name__}")
    if fit.refused:
        raise ValueError(f"fit: expected an accepted fit, got one that is rejected: {fit.refused[0]}")
    land = fit.estimate.landscape
    if land is None:
        raise ValueError(
            "fit: expected a fit of creep, a modulus or a half-space: sampling for a film would need thousands of"
            " runs of the contact solver"
        )
    if not (samples >= 100 and warmup >= 100 and chains >= 2 and decades > 0):
        got = f"{samples}, {warmup}, {chains}, {decades}"
        raise ValueError(f"samples, warmup >= 100, chains >= 2 and decades > 0 expected, got {got}")
    sampler()

    # the prior: ranges (p, 2) of the free coordinates, logarithms of compliances and nuisance parameters themselves
    free = np.flatnonzero(land.box[:, 1] > land.box[:, 0])
    logs, far, best = free < fit.structure.size, 10.0**decades, land.best[free]
    low, high = np.where(best > 0, np.minimum(best, 1.0), 1.0) / far, np.maximum(best, 1.0) * far
    box = land.box[free].copy()
    box[:, 0] = np.where(logs, np.maximum(box[:, 0], low), box[:, 0])
    box[:, 1] = np.where(logs, np.minimum(box[:, 1], high), box[:, 1])
    box = np.where(logs[:, None], np.log(np.where(logs[:, None], box, 1.0)), box)

    noise = (fit.rss, fit.widening**2, float(fit.residuals.size), fit.stated)
    of_data = land.residual, land.best, free, logs, *box.T, *noise
    density = Density(*(jax.tree.map(jnp.asarray, part) for part in of_data))
    z = starts(density, chains, seed)
    x, astray = run(jax.random.split(jax.random.key(seed), chains), z, density, warmup, samples)
    return _gather(fit, land, free, box, np.asarray(x), float(np.mean(astray)))


def _gather(
    fit: Fit, land: Landscape, free: np.ndarray, box: np.ndarray, x: np.ndarray, astray: float
) -> Posterior:
    """Return the posterior from coordinates (chains, samples, p); ValueError where the chains have not converged."""
    structure, size = fit.structure, fit.structure.size
    own = {name: list(free).index(place) for name, place in structure.where.items() if place in free}
    # split R-hat and effective sample size of the logarithm of each parameter
    diagnostics = importlib.import_module("numpyro.diagnostics")
    each = {name: x[:, :, i] for name, i in own.items()}
    with np.errstate(divide="ignore", invalid="ignore"):  # constant chains
        r_hat = {name: float(diagnostics.split_gelman_rubin(rows)) for name, rows in each.items()}
        ess = {name: float(diagnostics.effective_sample_size(rows)) for name, rows in each.items()}
    advice = "a longer warmup, more samples, or narrower bounds"
    worst, least = max(r_hat, key=lambda name: r_hat[name]), min(ess, key=lambda name: ess[name])
    if not r_hat[worst] < MIXED:
        raise ValueError(
            f"chains: not mixed, R-hat of {worst} is {r_hat[worst]:.3g}, expected < {MIXED}: {advice}"
        )
    if not ess[least] > ENOUGH:
        raise ValueError(
            f"chains: {ess[least]:.0f} effective draws of {least}, expected > {ENOUGH:g}: {advice}"
        )
    if astray > ASTRAY:
        raise ValueError(
            f"chains: {astray:.1%} of the steps diverged, expected at most {ASTRAY:.0%}: {advice}"
        )
    draws = _values(land, free, x.reshape(-1, free.size), size)
    ends = _values(land, free, box.T, size)
    samples = {name: np.asarray(structure.parameters(draws.T)[name]) for name in own}
    prior = {name: tuple(sorted(map(float, structure.parameters(ends.T)[name]))) for name in own}
    quantiles = {name: np.quantile(values, _shares(fit.level)).tolist() for name, values in samples.items()}
    is_open = lambda name: fit.intervals[name][0] < prior[name][0] or fit.intervals[name][1] > prior[name][1]
    return Posterior(
        fit=fit, samples=samples, intervals={name: (low, high) for name, (low, _, high) in quantiles.items()},
        medians={name: middle for name, (_, middle, _) in quantiles.items()}, prior=prior,
        open=tuple(filter(is_open, own)), r_hat=r_hat, ess=ess, divergent=astray, draws=draws[:, :size],
        nuisances={land.nuisances[i - size]: draws[:, i] for i in free if i >= size},
    )  # fmt: skip


def _shares(level: float) -> list[float]:
    return [0.5 - 0.5 * level, 0.5, 0.5 + 0.5 * level]


def _values(land: Landscape, free: np.ndarray, x: np.ndarray, size: int) -> np.ndarray:
    """Return compliances and nuisance parameters (s, k) in SI of coordinates (s, p)."""
    values = np.tile(land.best, (len(x), 1))
    values[:, free] = np.where(free < size, np.exp(np.where(free < size, x, 0.0)), x)
    return values * land.unit


# Figure of a posterior: a histogram of each parameter, with its interval and that of the profile likelihood.


BINS = 60


@sheet.styled
def draw(found: Any, units: dict[str, str], profiles: dict[str, tuple[float, float]], level: float) -> Any:
    """Return a Figure of a ``Posterior``; profiles: {parameter: interval of the profile likelihood}."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.5 * len(found.samples), 3.5), layout="constrained")
    for k, (name, values) in enumerate(found.samples.items()):
        axes = figure.add_subplot(1, len(found.samples), k + 1)
        wide = values.max() > 10.0 * values.min()
        edges = (np.geomspace if wide else np.linspace)(values.min(), values.max(), BINS)
        axes.hist(values, edges, color="0.75")
        for place, (ends, colour, what) in enumerate(
            ((found.intervals[name], sheet.VIOLET, "posterior"), (profiles[name], sheet.BLUE, "profile"))
        ):
            shown = np.clip(ends, values.min(), values.max())  # an open side ends with the draws
            height = -0.04 * (1 + place) * axes.get_ylim()[1]
            axes.plot(
                shown, [height, height], color=colour, linewidth=3.0, label=f"{100 * level:g} %, {what}"
            )
        axes.set(xlabel=f"{name} [{units[name]}]", xscale="log" if wide else "linear", yticks=[])
    figure.axes[0].legend(fontsize="small")
    return figure
