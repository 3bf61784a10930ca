"""Poroelastic relaxation: modulus, drained Poisson's ratio and diffusivity of a gel from the force at a constant depth.

A gel whose network is filled with a solvent is incompressible at first. At constant depth the solvent then leaves the
region below the indenter, over a time of the order of a^2/D with the contact radius a, and the force relaxes as

    F(t) = Finf + (F0 - Finf) g(D t/a^2),      F0/Finf = 2 (1 - nu),

    ball    F0 = 16/3 G a d,  a^2 = R d,                g = 0.491 exp(-0.908 sqrt(x)) + 0.509 exp(-1.679 x)
    cone    F0 = 4 G a d,     a = (2/pi) d tan(theta),  g = 0.493 exp(-0.822 sqrt(x)) + 0.507 exp(-1.348 x)

for a half-space and a rigid indenter that lets no solvent through (Y. Hu, X. Zhao, J. J. Vlassak, Z. Suo, Appl. Phys.
Lett. 96 (2010) 121904). nu is that of the drained network, and D = 2 (1 - nu)/(1 - 2 nu) G k/eta with the permeability k
and the viscosity eta of the solvent. Where the network relaxes as well, the force is taken as the product of both
relaxations (D. G. T. Strange, T. L. Fletcher, K. Tonsomboon, H. Brawn, X. Zhao, M. L. Oyen, Appl. Phys. Lett. 102 (2013)
031913), here with

    v(t) = relaxed + (1 - relaxed) exp(-t/tau).

The depth is reached in a ramp. Its increments relax one by one, each over the contact radius a of the hold:

    F(t) = sum_j dF0_j v(t - s_j) (1 - rho + rho g(D (t - s_j)/a^2)),      rho = (1 - 2 nu)/(2 (1 - nu)),

which is exact for the relaxation of the network, but not for the migration, since the contact grows in the ramp. Compared
with numerical solutions of the growing contact (tests/support/poroelastic_contact.py), the force after the ramp is off by
at most 0.7 % of F0 - Finf where the whole surface is drained, for ramps of 0.01 to 0.3 a^2/D, and 1.2 and 3 % too high for
ramps of 0.03 and 0.1 a^2/D where no solvent passes through the indenter, over some times the duration of the ramp. With the
radius of each increment in place of that of the hold it is 10 % too low in the former case. The intervals are widened by
what an error of this size and course does to the parameters:

    error/(F0 - Finf) = 0.007 exp(-3 sqrt(x)) + 0.35 (D ramp/a^2) exp(-x/5),      x = (t - ramp)/ramp.
"""

import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.data.indentation import IndentationData, paraboloid_note, probe_of
from fitting.data.weights import choose_weights
from fitting.inference.conclusion import FitProblem, conclude, least_squares
from fitting.inference.noise import two_sided
from fitting.inference.result import Fit, plain
from fitting.inference.sample import Sample
from fitting.models.parameters import Parameters
from fitting.models.structure import ParameterList, Sought, limits
from fitting.models.thin_layer import thin_layer_factor
from fitting.search import nonlinear
from fitting.search.nonlinear import Objective
from fitting.views import sheet

# c, b1, b2 of g(x) = c exp(-b1 sqrt(x)) + (1 - c) exp(-b2 x), and F0 over G a d
MASTER = {jc.Sphere: ((0.491, 0.908, 1.679), 16.0 / 3.0), jc.Cone: ((0.493, 0.822, 1.348), 4.0)}
DIMENSIONS = {"G": "Pa", "nu": "", "D": "m2/s", "relaxed": "", "tau": "s"}
STEADY = 0.02  # change of the depth within a hold, relative to it
INCREMENTS = 48  # of the ramp
FEWEST = 8  # points of a hold
REACH = math.log(1e4)  # of log D and log tau about those of the durations
WIDEST = 0.1  # ramp over a^2/D up to which its error was determined
THIN = 0.1  # stiffening by the base beyond which a fit is rejected


@functools.partial(jax.tree_util.register_dataclass, data_fields=list(DIMENSIONS), meta_fields=[])
@dataclasses.dataclass(frozen=True)
class Poroelastic:
    """A gel that relaxes as its solvent migrates and, with ``relaxed`` below one, as its network relaxes.

    Args:
        G: shear modulus at t = 0 [Pa].
        nu: Poisson's ratio of the drained network.
        D: diffusivity [m2/s].
        relaxed: G(inf)/G(0) of the network.
        tau: its relaxation time [s].

    Example:
        >>> gel = fitting.Poroelastic(G=10e3, nu=0.2, D=1e-10)
        >>> ball, t = jc.Sphere(50e-6), np.array([0.0, 1e6])
        >>> print(gel.force(t, depth=5e-6, indenter=ball) * 1e6)       # 16/3 G sqrt(R d) d, and that over 2 (1 - nu)
        [4.21637021 2.63523138]
    """

    G: Array | float
    nu: Array | float
    D: Array | float
    relaxed: Array | float = 1.0
    tau: Array | float = 1.0

    def force(self, t: Any, depth: float, indenter: Any) -> Array:
        """Return the force [N] at times t [s] of any shape after a depth [m] was applied in one step."""
        tip = _tip(indenter, depth)
        t = jnp.asarray(t, dtype=float)
        return (
            self.G
            * tip.force
            * relaxation((self.nu, self.D, self.relaxed, self.tau), t, tip.radius**2, tip.curve)
        )

    def permeability(self, viscosity: float) -> Array:
        """Return the permeability [m2] for a viscosity of the solvent [Pa s]."""
        return jnp.asarray(self.D) * viscosity * (1.0 - 2.0 * self.nu) / (2.0 * (1.0 - self.nu) * self.G)


class Tip(NamedTuple):
    """Contact radius [m] at a depth, F0/G [m2], the coefficients of g, and the power of F0 over the depth."""

    radius: float
    force: float
    curve: tuple[float, float, float]
    power: float


def _tip(indenter: Any, depth: float) -> Tip:
    """Return the contact of an indenter at a depth [m]; ValueError for other indenters than a rigid ball or cone."""
    if type(indenter) not in MASTER:
        raise ValueError(f"indenter: expected a Sphere or a Cone, got {type(indenter).__name__}")
    if indenter.material is not None:
        raise ValueError("indenter: expected a rigid one, got one with a material")
    power = probe_of(indenter).power
    curve, size = MASTER[type(indenter)]
    if isinstance(indenter, jc.Sphere):
        a = math.sqrt(float(indenter.radius) * depth)
    else:
        a = 2.0 / math.pi * depth * math.tan(float(indenter.half_angle))
    return Tip(a, size * a * depth, curve, power)


def master_curve(x: Array, curve: Any) -> Array:
    """Return g(x), x = D t/a^2 >= 0 of any shape, with finite derivatives at x = 0."""
    c, b1, b2 = curve
    root = jnp.sqrt(jnp.where(x > 0.0, x, 1.0)) * (x > 0.0)
    return c * jnp.exp(-b1 * root) + (1.0 - c) * jnp.exp(-b2 * x)


def relaxation(values: tuple, t: Array, square: Any, curve: Any) -> Array:
    """Return F(t)/F0 at times t >= 0 [s] after a step; values: nu, D, relaxed and tau; square: a^2 [m2]."""
    nu, D, relaxed, tau = values
    rho = (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))
    network = relaxed + (1.0 - relaxed) * jnp.exp(-t / tau)
    return network * (1.0 - rho + rho * master_curve(D * t / square, curve))


# 1. The holds of a measured curve.


class Hold(NamedTuple):
    """The force at a constant depth, and how the depth was reached.

    t, load (n,): [s], [N], t from the contact on; depth [m] of the hold; tip: its contact; since (m,) [s]: the times of the
    increments of the ramp, and parts (m,) of F0 that they apply; ramp: duration [s] of the ramp; sigma (n,) or None;
    unknown: whether the ramp is neither measured nor given, and a step at t = 0 stands for it.
    """

    t: np.ndarray
    load: np.ndarray
    depth: float
    tip: Tip
    since: np.ndarray
    parts: np.ndarray
    ramp: float
    sigma: np.ndarray | None
    unknown: bool = False

    @property
    def lags(self) -> np.ndarray:
        """Times (n, m) [s] since the increments."""
        return np.maximum(self.t[:, None] - self.since, 0.0)

    @classmethod
    def of(cls, data: Any, indenter: Any, ramp: float | None) -> "Hold":
        """Return the hold of a curve; ValueError where there is none."""
        if not isinstance(data, IndentationData):
            raise ValueError(f"data: expected IndentationData, got {type(data).__name__}")
        deepest = float(np.max(data.depth))
        if not deepest > 0.0:
            raise ValueError(f"depth: expected depths > 0 m, got at most {deepest:g}")
        # the hold is the longest run of points within STEADY of the median of the deep ones
        deep = float(np.median(data.depth[data.depth > (1.0 - STEADY) * deepest]))
        steady = np.abs(data.depth - deep) <= STEADY * deep
        edges = np.flatnonzero(np.diff(np.concatenate([[0], steady.astype(int), [0]])))
        first, last = max(
            zip(edges[::2], edges[1::2], strict=True), key=lambda run: run[1] - run[0], default=(0, 0)
        )
        if last - first < FEWEST:
            raise ValueError(
                f"data: expected a hold of at least {FEWEST} points at a constant depth (within {100 * STEADY:g} %), got"
                f" {last - first}"
            )
        depth = float(np.mean(data.depth[first:last]))
        tip = _tip(indenter, depth)

        # The ramp before it: points in contact of the curve, of the part that was cut off, or a given duration.
        t, d = data.t[:first], data.depth[:first]
        if data.whole is not None and first == 0:
            before = data.whole[0] < data.t[0]
            t, d = data.whole[0][before], data.whole[2][before]
        start = data.t[first]
        if ramp is not None:
            if not (0.0 <= ramp <= start):
                raise ValueError(f"ramp: expected 0 to {start:g} s, the begin of the hold, got {ramp!r}")
            begin, knots, depths = 0.0, np.array([0.0, ramp]), np.array([0.0, depth])
        elif np.any(d > 0.0):
            # from the last point that is not in contact, by linear extrapolation where the first one is already
            touching = int(np.flatnonzero(d <= 0.0)[-1]) + 1 if np.any(d <= 0.0) else 0
            t, d = t[touching:], d[touching:]
            # and to the depth of the hold, which is reached between two points
            before, after = t[-1] - t[0], start - t[-1]
            speed = max((d[-1] - d[0]) / max(before, 1e-300), (depth - d[-1]) / max(after, 1e-300))
            knots, depths = np.append(t, min(t[-1] + (depth - d[-1]) / speed, start)), np.append(d, depth)
            if d[0] > 0.0:
                first_speed = (depths[1] - d[0]) / max(knots[1] - t[0], 1e-300)
                knots, depths = (
                    np.append(t[0] - d[0] / max(first_speed, 1e-300), knots),
                    np.append(0.0, depths),
                )
            begin = float(knots[0])
        else:
            begin, knots, depths = 0.0, np.zeros(2), np.array([0.0, depth])
        end = float(knots[-1])
        if end > begin:
            nodes = np.linspace(begin, end, INCREMENTS + 1)
            share = (np.maximum(np.interp(nodes, knots, depths), 0.0) / depth) ** tip.power
            since, parts = 0.5 * (nodes[1:] + nodes[:-1]), np.diff(share, prepend=0.0)[1:]
            parts[0] += share[0]
        else:
            since, parts = np.full(1, begin), np.ones(1)
        on = slice(first, last)
        hold = data.t[on] >= end
        sigma = None if data.sigma_load is None else data.sigma_load[on][hold]
        return cls(data.t[on][hold] - begin, data.load[on][hold], depth, tip, since - begin, parts / parts.sum(),
                   end - begin, sigma, ramp is None and not np.any(d > 0.0))  # fmt: skip

    def with_ramp(self, ramp: float) -> "Hold":
        """Return the hold after a ramp [s] at constant speed from t = 0 on."""
        nodes = np.linspace(0.0, 1.0, INCREMENTS + 1)
        parts = np.diff(nodes**self.tip.power)
        return self._replace(
            since=0.5 * (nodes[1:] + nodes[:-1]) * ramp, parts=parts, ramp=ramp, unknown=False
        )


def holds_of(data: Any, indenter: Any, ramp: Any) -> list[Hold]:
    """Return the holds of one or several curves, with one indenter and ramp for all or for each."""
    curves = list(data) if isinstance(data, list | tuple) else [data]
    if not curves:
        raise ValueError("data: expected at least one curve, got none")
    each = []
    for name, given in (("indenter", indenter), ("ramp", ramp)):
        several = list(given) if isinstance(given, list | tuple | np.ndarray) else [given] * len(curves)
        if len(several) != len(curves):
            raise ValueError(
                f"{name}: expected one, or one for each of {len(curves)} curves, got {len(several)}"
            )
        each.append(several)
    return [Hold.of(one, tip, rise) for one, tip, rise in zip(curves, *each, strict=True)]


# 2. The fit.


def _forces(theta: Array, inputs: tuple, names: tuple[str, ...]) -> Array:
    """Return the forces (n,) at the coordinates log G, nu, log D and, with a network that relaxes, relaxed and log tau.

    inputs: lags and parts of the increments (n, m), a^2 and F0/G (n,), the coefficients of g (3, n), and the units (k,).
    """
    lags, parts, square, size, curve, unit = inputs
    own = {name: theta[i] * unit[i] if name in ("nu", "relaxed") else jnp.exp(theta[i]) * unit[i]
           for i, name in enumerate(names)}  # fmt: skip
    values = own["nu"], own["D"], own.get("relaxed", 1.0), own.get("tau", 1.0)
    step = relaxation(values, lags, square[:, None], tuple(one[:, None] for one in curve))
    return own["G"] * size * jnp.sum(parts * step, -1)


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PoroelasticFit(Fit):
    """The fit of the force at constant depths by poroelastic relaxation; ``Fit`` has what it shares with other fits.

    Its parameters are the shear modulus "G" [Pa] at t = 0, the drained Poisson's ratio "nu", the diffusivity "D" [m2/s] and,
    with ``network=True``, "relaxed" and "tau" [s] of the network; ``material`` is a ``Poroelastic``.

    Attributes:
        indenters, depths [m], radii [m], ramps [s]: of each hold; radii are those of the contact.
        which (n,): the hold of each point.
        permeability: (value, low, high) [m2] where a viscosity was given, else None.
        viscosity: of the solvent [Pa s], or None.
    """

    indenters: tuple[Any, ...]
    depths: tuple[float, ...]
    radii: tuple[float, ...]
    ramps: tuple[float, ...]
    which: np.ndarray
    permeability: tuple[float, float, float] | None
    viscosity: float | None

    def predict(self, t: Any, hold: int = 0) -> np.ndarray:
        """Return the force [N] at times t [s] after a step to the depth of one of the holds."""
        return np.asarray(self.material.force(t, self.depths[hold], self.indenters[hold]))

    def band(self, t: Any) -> tuple[np.ndarray, np.ndarray]:
        """Raise ValueError: a band of the force is not computed."""
        raise ValueError("band: expected a fit of a creep curve or a modulus, got a poroelastic one")

    def plot(self, path: Any = None) -> Any:
        """Return a figure of the forces over time, each over that at its first point, and of the residuals; saved where a
        path is given."""
        _, _, t, measured = self.curve

        def panel(top: Any, bottom: Any) -> None:
            for k in np.unique(self.which):
                on = self.which == k
                label = f"{1e6 * self.depths[k]:.3g} µm"
                first = self.fitted[on][0]
                (line,) = top.plot(t[on], self.fitted[on] / first, label=label)
                top.plot(t[on], measured[on] / first, ".", markersize=3, color=line.get_color(), alpha=0.5)
                bottom.plot(t[on], 100.0 * (measured[on] - self.fitted[on]) / first, ".", markersize=3)
            top.set_xscale("log")
            top.set_ylabel("force over the first one")
            top.legend(title="depth")
            bottom.set_ylabel("residual [%]")
            bottom.set_xlabel("time since contact [s]")

        return sheet.draw(self, path, panel, ())

    def to_dict(self) -> dict[str, Any]:
        """Return ``Fit.to_dict`` with depths, contact radii, ramps and permeability."""
        k = self.permeability
        row = None if k is None else dict(zip(("value", "low", "high"), map(plain, k), strict=True))
        return super().to_dict() | {
            "depths_m": list(self.depths), "contact_radii_m": list(self.radii), "ramps_s": list(self.ramps),
            "permeability_m2": row, "viscosity_Pa_s": self.viscosity,
        }  # fmt: skip

    def _choices(self) -> list[str]:
        return [*super()._choices(), probe_of(self.indenters[0]).words]

    def _combination_lines(self) -> list[str]:
        G, nu = self.values["G"], self.values["nu"]
        lines = [f"  F0/Finf = {2.0 * (1.0 - nu):.4g}, Young's modulus {3.0 * G:.5g} Pa undrained"
                 f" and {2.0 * (1.0 + nu) * G:.5g} Pa drained"]  # fmt: skip
        if self.permeability is not None:
            k, low, high = self.permeability
            lines.append(
                f"  permeability = {k:.4g} m2, {low:.4g} to {high:.4g}, for {self.viscosity:.4g} Pa s"
            )
        return lines

    def _conditions(self) -> list[str]:
        D, rows = self.values["D"], []
        for k, (depth, a, ramp) in enumerate(zip(self.depths, self.radii, self.ramps, strict=True)):
            end = float(self.curve[2][self.which == k].max())
            rows.append(
                f"  hold at {depth:.4g} m: contact radius {a:.4g} m, a^2/D = {a * a / D:.4g} s, ramp {ramp * D / a**2:.2g}"
                f" and hold up to {end * D / a**2:.2g} times that"
            )
        return [
            *rows,
            "  the sample is a half-space and drained far away; the indenter lets no solvent through",
        ]


def fit_poroelastic(
    data: Any, *, indenter: Any, network: bool = False, ramp: Any = None, viscosity: float | None = None,
    thickness: float | None = None, weights: str | None = None, sigma: Any = None,
    fixed: dict[str, float] | None = None, bounds: dict[str, tuple] | None = None, level: float = 0.95,
) -> PoroelasticFit:  # fmt: skip
    """Fit modulus, drained Poisson's ratio and diffusivity of a gel to the force at a constant depth.

        F(t) = Finf + (F0 - Finf) g(D t/a^2),      F0/Finf = 2 (1 - nu),

    with the master curves g of Hu et al. (2010) for a ball and a cone, and the ramp before the hold taken into account
    (``fitting/fits/poroelastic.py``). One hold does not tell whether a gel relaxes as its solvent migrates or as its network
    does: ``relaxation_cause`` compares holds of different depths.

    Args:
        data: ``IndentationData`` with ramp and hold, times and depths from the contact on (``in_contact``), or a list of
            them at different depths, which have the parameters in common. The hold is the longest part in which the depth
            changes by less than 2 %; what comes before is its ramp.
        indenter: a rigid ``jc.Sphere`` or ``jc.Cone``, or one for each curve.
        network: whether the network relaxes as well, by a factor "relaxed" with the time "tau".
        ramp: duration [s] of a ramp at constant speed from t = 0 on, or one for each curve, in place of the measured depths
            before the hold; 0: a step. Without it and without points before the hold the depth is applied at t = 0.
        viscosity: of the solvent [Pa s], for the permeability; water has 0.9e-3 at 25 degrees Celsius.
        thickness: of the sample [m]: the fit has a note on the stiffening by a rigid base, and is rejected above 10 % of the
            force, which begins at about a tenth of the thickness in contact radius.
        weights: "estimated" (the default without standard deviations), "proportional", "relative" or "absolute".
        sigma: in its place, the standard deviation of the force [N]; by default that of the data, if any.
        fixed: {parameter: value} of any subset; nu may be 0.
        bounds: {parameter: (low, high)} of any subset, None for an open side; nu is within 0 to 0.5.
        level: confidence level of the intervals.

    Returns:
        The parameters with their intervals, which include the error by the ramp, and how well the data determine them.

    Raises:
        ValueError: bad values, a curve without a hold, or another indenter.

    Example:
        >>> gel, ball = fitting.Poroelastic(G=10e3, nu=0.2, D=1e-10), jc.Sphere(50e-6)
        >>> t = np.geomspace(0.01, 20.0, 60)
        >>> hold = fitting.IndentationData(t=t, load=gel.force(t, 5e-6, ball), depth=np.full(60, 5e-6))
        >>> fit = fitting.fit_poroelastic(hold, indenter=ball, weights="relative")
        >>> print(f"G = {fit.values['G']:.4g} Pa, nu = {fit.values['nu']:.4f}, D = {fit.values['D']:.4g} m2/s")
        G = 1e+04 Pa, nu = 0.2000, D = 1e-10 m2/s
    """
    holds = holds_of(data, indenter, ramp)
    for name, value in (("viscosity", viscosity), ("thickness", thickness)):
        if value is not None and not (np.ndim(value) == 0 and 0.0 < value < math.inf):
            raise ValueError(f"{name}: expected a number > 0 or None, got {value!r}")
    count = [hold.t.size for hold in holds]
    which = np.repeat(np.arange(len(holds)), count)
    joined = lambda name: np.concatenate([getattr(hold, name) for hold in holds])
    t, load = joined("t"), joined("load")
    if weights is None and sigma is None:
        known = all(hold.sigma is not None for hold in holds)
        weights, sigma = (None, joined("sigma")) if known else ("estimated", None)
    apart = t + 2.0 * float(t.max()) * which  # so that no difference spans two curves
    point_weights, label = choose_weights(apart, load, weights, sigma)
    sample = Sample.of(("force", "N", t, load), point_weights, label, which)

    # The search for log G, nu, log D (and relaxed, log tau), about the scales of the holds.
    names = tuple(DIMENSIONS)[: 5 if network else 3]
    structure = ParameterList.of(Poroelastic, {name: DIMENSIONS[name] for name in names}, zeros=("nu",))
    table = limits(structure, fixed, bounds)
    for name, top in (("nu", 0.5), ("relaxed", 1.0)):
        if name in table:
            low, high = table[name]
            if low > top or (high > top and math.isfinite(high)):
                raise ValueError(f"{name}: expected values from 0 to {top:g}, got {low:g} to {high:g}")
            table[name] = (low, min(high, top))
    first = [np.median(hold.load[: max(hold.t.size // 20, 1)]) / hold.tip.force for hold in holds]
    end = max(float(hold.t[-1]) for hold in holds)
    largest = max(hold.tip.radius for hold in holds) ** 2
    unit = {"G": float(np.max(np.abs(first))), "nu": 1.0, "D": largest / end, "relaxed": 1.0, "tau": end}
    logs = np.array([name not in ("nu", "relaxed") for name in names])
    rows = []
    for name, log in zip(names, logs, strict=True):
        low, high = table[name]
        if log and low < high:
            with np.errstate(divide="ignore"):
                low, high = np.clip(np.log([low, high]) - math.log(unit[name]), -REACH, REACH)
        elif log:
            low = high = math.log(low / unit[name])
        rows.append((low, high))
    units = np.array([unit[name] for name in names])
    space = Parameters.of(structure, rows, unit=units, logarithmic=logs, open=logs[:, None])
    n, m = t.size, max(hold.since.size for hold in holds)
    lags, parts = np.zeros((n, m)), np.zeros((n, m))
    for k, hold in enumerate(holds):
        lags[which == k, : hold.since.size], parts[which == k, : hold.since.size] = hold.lags, hold.parts
    per_hold = lambda get: np.repeat([get(hold) for hold in holds], count, axis=0)
    square, size = per_hold(lambda hold: hold.tip.radius**2), per_hold(lambda hold: hold.tip.force)
    curve = per_hold(lambda hold: hold.tip.curve).T
    pad = lambda values: np.pad(
        values, [(0, nonlinear.length(n) - n)] + [(0, 0)] * (values.ndim - 1), mode="edge"
    )
    inputs = (pad(lags), pad(parts), pad(square), pad(size), tuple(map(pad, curve)), units)

    def objective(weights: np.ndarray) -> Objective:
        padded = nonlinear.without_weight(weights)
        return Objective.of(_forces, inputs, pad(load), padded, space, points=slice(n), static=(names,))

    lower, upper = space.bounds
    tried = itertools.product((0.1, 0.3), (-1.0, 1.0, 3.0), *(((0.3, 0.8), (-4.0, -1.0)) if network else ()))
    starts = [np.clip([0.0, *one], lower, upper) for one in tried]
    problem = FitProblem(data, Sought(structure, table, None), space, sample, end, level)
    solved = least_squares(problem, objective, starts)

    # The error by the ramp, as a change of the coordinates; and samples that are thin, or wide beside the ball.
    curves = list(data) if isinstance(data, list | tuple) else [data]
    theta, notes = solved.theta, [note for one in curves for note in one.notes]
    against: list[str] = []
    nu = float(theta[1])
    rho = (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))
    with np.errstate(divide="ignore", invalid="ignore"):
        ramps = per_hold(lambda hold: hold.ramp)
        after = np.where(ramps > 0.0, np.maximum(t - ramps, 0.0) / ramps, np.inf)
    slow = np.minimum(math.exp(float(theta[2])) * unit["D"] * ramps / square, 1.0)
    share = 0.007 * np.exp(-3.0 * np.sqrt(after)) + 0.35 * slow * np.exp(-after / 5.0)
    error = solved.weights * rho * math.exp(float(theta[0])) * unit["G"] * size * share
    left = np.zeros(theta.size)
    if np.any(error > 0.0):
        left[space.free] = np.abs(np.linalg.lstsq(solved.jacobian, error, rcond=1e-12)[0])
    for hold, one in zip(holds, _each(indenter, holds), strict=True):
        notes += paraboloid_note(one, hold.depth)
        if thickness is not None:
            ratio = hold.tip.radius / thickness
            stiffer = float(thin_layer_factor(one, hold.depth, thickness, nu=0.5)) - 1.0
            words = (
                f"contact radius {ratio:.2g} of the thickness: a rigid base raises the force of the incompressible sample by"
                f" {100.0 * stiffer:.2g} %, which the model does not include"
            )
            (against if stiffer > THIN else notes).append(words)
    if np.max(slow) > WIDEST:
        notes.append(
            f"a ramp takes {np.max(slow):.2g} of a^2/D: its effect is known to 3 % of the relaxing part of the force up to"
            f" {WIDEST:g}, and extrapolated beyond; a faster ramp or a deeper hold is better"
        )
    if space.lower[1] < space.upper[1] and nu <= 1e-6:
        notes.append(
            "the force relaxes by half or more, the most that solvent alone can cause with nu >= 0: the network relaxes too"
            " (network=True), or the depth is not constant"
        )
    if any(hold.unknown for hold in holds):
        # what a ramp up to the first point of the hold would change in the parameters, to the first order
        found_at = {name: float(theta[i]) if name in ("nu", "relaxed") else math.exp(float(theta[i])) * unit[name]
                 for i, name in enumerate(names)}  # fmt: skip
        values = found_at["nu"], found_at["D"], found_at.get("relaxed", 1.0), found_at.get("tau", 1.0)
        force = lambda hold: found_at["G"] * hold.tip.force * np.sum(
            hold.parts * np.asarray(relaxation(values, jnp.asarray(hold.lags), hold.tip.radius**2, hold.tip.curve)), -1
        )  # fmt: skip
        change = [force(hold.with_ramp(float(hold.t[0]))) - force(hold) if hold.unknown and hold.t[0] > 0.0
                  else np.zeros(hold.t.size) for hold in holds]  # fmt: skip
        moved = np.zeros(theta.size)
        moved[space.free] = -np.linalg.lstsq(
            solved.jacobian, solved.weights * np.concatenate(change), rcond=1e-12
        )[0]
        changes = [
            f"{name} by {value:+.2g}" + ("" if name in ("nu", "relaxed") else " %")
            for name, value in zip(
                names, np.where(logs, 100.0 * np.expm1(np.clip(moved, -9.0, 9.0)), moved), strict=True
            )
        ]
        first_point = max(float(hold.t[0]) for hold in holds if hold.unknown)
        notes += [
            "no points before the hold: its depth is taken as applied at t = 0 in one step; fit a curve that has its ramp,"
            " or give its duration (ramp, in Python)",
            f"a ramp from t = 0 to the first point, {first_point:.3g} s, would change {', '.join(changes)}",
        ]
    solved = solved._replace(left=left, notes=tuple(notes), against=tuple(against), moves=_no_moves)
    solved = solved._replace(landscape=space.landscape(theta, solved.whole[1].residual))
    found = conclude(problem, solved)

    # The permeability, whose logarithm is log D - log G + log(rho) and has the variance of that combination.
    permeability = None
    if viscosity is not None:
        gel = found.common.material
        found_k = float(gel.permeability(viscosity))
        by_nu = -1.0 / ((1.0 - 2.0 * gel.nu) * (1.0 - gel.nu)) if gel.nu < 0.5 else 0.0
        slope = np.zeros(theta.size)
        slope[:3] = -1.0 / gel.G, by_nu, 1.0 / gel.D
        spread = math.sqrt(max(float(slope @ found.common.estimate.covariance @ slope), 0.0))
        wide = math.exp(min(two_sided(level) * spread, 300.0))
        permeability = (found_k, found_k / wide, found_k * wide)
    return found.fit(
        PoroelasticFit, indenters=tuple(_each(indenter, holds)), depths=tuple(hold.depth for hold in holds),
        radii=tuple(hold.tip.radius for hold in holds), ramps=tuple(hold.ramp for hold in holds), which=which,
        permeability=permeability, viscosity=viscosity,
    )  # fmt: skip


def _each(indenter: Any, holds: Sequence[Hold]) -> list[Any]:
    """Return the indenter of each hold."""
    return list(indenter) if isinstance(indenter, list | tuple) else [indenter] * len(holds)


def _no_moves(name: str) -> np.ndarray:
    """Raise ValueError: the change of the parameters with a held quantity is not computed."""
    raise ValueError(f"spread: a poroelastic fit is conditional on its {name}; fit at other values of it")
