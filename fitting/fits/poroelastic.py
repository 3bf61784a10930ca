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

    F(t) = sum_j dF0_j v(t - s_j) (1 - rho + rho g(D (t - s_j)/a^2)) - F0 rho v e,      rho = (1 - 2 nu)/(2 (1 - nu)),
    e = 0.27 (D ramp/a^2) exp(-D (t - ramp)/(0.45 a^2)).

The sum is exact for the relaxation of the network. The solvent is further than that, by e, because the contact is smaller
in the ramp: numerical solutions of a ball that lets no solvent through (tests/support/poroelastic_contact.py) agree with e
to within 0.003 for ramps of 0.01 to 0.1 a^2/D. The intervals are widened by what an error of ``UNSURE`` of e does to the
parameters; e of a cone is taken as that of a ball. With the radius of each increment in place of that of the hold the force
would be 10 % of F0 - Finf too low.

The zeros of force and depth are those of the data. Where the ramp was measured they are checked by it (``zeros``).
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
from fitting.data.contact import sample_noise
from fitting.data.curves import check_kind
from fitting.data.indentation import IndentationData, check_depth, paraboloid_note, probe_of
from fitting.data.weights import choose_weights
from fitting.inference.noise import two_sided
from fitting.inference.result import Fit, FitProblem, conclude, least_squares, no_moves, plain
from fitting.inference.sample import Sample
from fitting.models.parameters import Parameters
from fitting.models.structure import ParameterList, Sought, limits
from fitting.models.thin_layer import check_unbonded, thin_layer_factor
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
UNSURE = {1.5: 0.1, 2.0: 0.5}  # relative error of ``growing``, under a ball and under a cone
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


def growing(values: tuple, after: Array, ramp: Any, square: Any) -> Array:
    """Return rho v e, by how much of F0 the growth of the contact in a ramp [s] reduces the force at times [s] after it."""
    nu, D, relaxed, tau = values
    rho = (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))
    network = relaxed + (1.0 - relaxed) * jnp.exp(-after / tau)
    return rho * network * 0.27 * jnp.minimum(D * ramp / square, 1.0) * jnp.exp(-D * after / (0.45 * square))


# 1. The holds of a measured curve.


class Hold(NamedTuple):
    """The force at a constant depth, and how the depth was reached.

    t, load (n,): [s], [N], t from the contact on; depth [m] of the hold; tip: its contact; since (m,) [s]: the times of the
    increments of the ramp, and parts (m,) of F0 that they apply; ramp: duration [s] of the ramp; sigma (n,) or None;
    unknown: whether the ramp is neither measured nor given, and a step at t = 0 stands for it; cut: whether the curve was
    cut at a contact that was found; before (3, k): times, forces and depths of the points before the hold.
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
    cut: bool = False
    before: np.ndarray = np.zeros((3, 0))

    @property
    def lags(self) -> np.ndarray:
        """Times (n, m) [s] since the increments."""
        return np.maximum(self.t[:, None] - self.since, 0.0)

    @classmethod
    def of(cls, data: Any, indenter: Any, ramp: float | None) -> "Hold":
        """Return the hold of a curve; ValueError where there is none."""
        check_kind(data, IndentationData)
        deepest = float(np.max(data.depth))
        if not deepest > 0.0:
            raise ValueError(
                "depth: expected depths > 0 m where the indenter presses, got"
                f" {np.min(data.depth):.3g} to {deepest + 0.0:.3g} m"
            )
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
        depth, load = float(np.mean(data.depth[first:last])), float(np.median(data.load[first:last]))
        if not load > 0.0:
            raise ValueError(
                f"load: expected forces > 0 N where the indenter presses, got {load:.3g} N in the hold"
            )
        tip = _tip(indenter, depth)
        check_depth(indenter, depth)

        # The ramp before it: points in contact of the curve, of the part that was cut off, or a given duration.
        earlier = np.stack([data.t, data.load, data.depth])[:, :first]
        if data.whole is not None and first == 0:
            earlier = data.whole[:, data.whole[0] < data.t[0]]
        (t, _, d), start = earlier, data.t[first]
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
                   end - begin, sigma, ramp is None and not np.any(d > 0.0), data.cut,
                   earlier - [[begin], [0.0], [0.0]])  # fmt: skip

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

    inputs: lags and parts of the increments (n, m), a^2, F0/G, the duration of the ramp and the time after it (n,),
    a factor of the effect of the growing contact, the coefficients of g (3, n), and the units (k,).
    """
    lags, parts, square, size, ramp, after, factor, curve, unit = inputs
    own = {name: theta[i] * unit[i] if name in ("nu", "relaxed") else jnp.exp(theta[i]) * unit[i]
           for i, name in enumerate(names)}  # fmt: skip
    values = own["nu"], own["D"], own.get("relaxed", 1.0), own.get("tau", 1.0)
    step = relaxation(values, lags, square[:, None], tuple(one[:, None] for one in curve))
    return own["G"] * size * (jnp.sum(parts * step, -1) - factor * growing(values, after, ramp, square))


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
            "  D after the curves of Hu et al.; solutions of this contact by two methods give 0.6 of it (docs/limits.md)",
        ]


def fit_poroelastic(
    data: Any, *, indenter: Any, network: bool = False, ramp: Any = None, viscosity: float | None = None,
    thickness: float | None = None, unbonded: bool = False, weights: str | None = None, sigma: Any = None,
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
        unbonded: whether the sample slides on that base without friction, which then stiffens it less.
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
    check_unbonded(unbonded, thickness)
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
                raise ValueError(f"fixed, bounds: expected {name} from 0 to {top:g}, got {low:g} to {high:g}")
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
    ramps = per_hold(lambda hold: hold.ramp)
    padded = [pad(one) for one in (lags, parts, square, size, ramps, np.maximum(t - ramps, 0.0))]
    inputs = (*padded, 1.0, tuple(map(pad, curve)), units)

    def objective(weights: np.ndarray) -> Objective:
        known = nonlinear.without_weight(weights)
        return Objective.of(_forces, inputs, pad(load), known, space, points=slice(n), static=(names,))

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
    slow = np.minimum(math.exp(float(theta[2])) * unit["D"] * ramps / square, 1.0)
    at = lambda factor: np.asarray(_forces(theta, (*padded, factor, *inputs[7:]), names))[:n]
    unsure = per_hold(lambda hold: UNSURE[hold.tip.power])
    by_ramp = np.zeros(theta.size)
    if np.any(ramps > 0.0):
        error = solved.weights * unsure * (at(1.0) - at(0.0))
        by_ramp[space.free] = np.linalg.lstsq(solved.jacobian, error, rcond=1e-12)[0]
    for hold, one in zip(holds, _each(indenter, holds), strict=True):
        notes += paraboloid_note(one, hold.depth)
        if thickness is not None:
            ratio = hold.tip.radius / thickness
            stiffer = float(thin_layer_factor(one, hold.depth, thickness, nu=0.5, unbonded=unbonded)) - 1.0
            words = (
                f"contact radius {ratio:.2g} of the thickness: a rigid base raises the force of the incompressible sample by"
                f" {100.0 * stiffer:.2g} %, which the model does not include"
            )
            (against if stiffer > THIN else notes).append(words)
    if np.max(slow) > WIDEST:
        notes.append(
            f"a ramp takes {np.max(slow):.2g} of a^2/D: its effect was computed up to {WIDEST:g}, and is extrapolated"
            " beyond; a faster ramp or a deeper hold is better"
        )
    if space.lower[1] < space.upper[1] and nu <= 1e-6:
        notes.append(
            "the force relaxes by half or more, the most that solvent alone can cause with nu >= 0: the network relaxes too"
            " (network=True), or the depth is not constant"
        )
    # The zeros of force and depth, by the ramp where it was measured.
    found_at = {name: float(theta[i]) if name in ("nu", "relaxed") else math.exp(float(theta[i])) * unit[name]
             for i, name in enumerate(names)}  # fmt: skip
    values = found_at["nu"], found_at["D"], found_at.get("relaxed", 1.0), found_at.get("tau", 1.0)
    unchecked = 0
    for hold in holds:
        wrong = zeros(hold, found_at["G"], values)
        unchecked += wrong is None
        against += [wrong] if wrong else []
    by_zero = lambda change: _moved(solved, space.free, logs, names, change)
    if unchecked:
        told = ", ".join(by_zero(0.01 * np.repeat([np.max(hold.load) for hold in holds], count)))
        power, wider = holds[0].tip.power, 1.0 if holds[0].tip.power == 1.5 else 2.0
        notes += [
            "the zeros of force and depth are taken as given, since there are no points of a ramp that could show them",
            f"an offset of 1 % of the largest force changes {told}, one of 1 % of the depth G by {power:g} % and D by"
            f" {wider:g} %",
        ]
    if any(hold.unknown for hold in holds):
        # what a ramp up to the first point of the hold would change in the parameters, to the first order
        def force(hold: Hold) -> np.ndarray:
            square = hold.tip.radius**2
            step = relaxation(values, jnp.asarray(hold.lags), square, hold.tip.curve)
            less = growing(values, jnp.asarray(np.maximum(hold.t - hold.ramp, 0.0)), hold.ramp, square)
            return found_at["G"] * hold.tip.force * np.asarray(jnp.sum(hold.parts * step, -1) - less)

        change = [force(hold.with_ramp(float(hold.t[0]))) - force(hold) if hold.unknown and hold.t[0] > 0.0
                  else np.zeros(hold.t.size) for hold in holds]  # fmt: skip
        changes = by_zero(-np.concatenate(change))
        first_point = max(float(hold.t[0]) for hold in holds if hold.unknown)
        notes += [
            "no points before the hold: its depth is taken as applied at t = 0 in one step; fit a curve that has its ramp,"
            " or give its duration (ramp)",
            f"a ramp from t = 0 to the first point, {first_point:.3g} s, would change {', '.join(changes)}",
        ]
    solved = solved._replace(
        systematic=np.abs(by_ramp),
        notes=tuple(notes),
        against=tuple(against),
        moves=functools.partial(no_moves, "a poroelastic fit"),
    )
    solved = solved._replace(landscape=space.landscape(theta, solved.search_result[1].residual))
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
        systematic = abs(float(np.array([-1.0, by_nu, 1.0]) @ by_ramp[:3]))
        wide = math.exp(min(two_sided(level) * spread + systematic, 300.0))
        permeability = (found_k, found_k / wide, found_k * wide)
    return found.fit(
        PoroelasticFit, indenters=tuple(_each(indenter, holds)), depths=tuple(hold.depth for hold in holds),
        radii=tuple(hold.tip.radius for hold in holds), ramps=tuple(hold.ramp for hold in holds), which=which,
        permeability=permeability, viscosity=viscosity,
    )  # fmt: skip


ELASTIC, RELAXED = 0.01, 0.5  # errors of the force in a ramp, of it and of what it has relaxed
SURE, SIZE = 16.0, 0.01  # change of chi2, and of the force at the hold over it, from which a zero is wrong
FEW, TRIALS = 6, 201  # points of a ramp, and trial depths of contact


def zeros(hold: Hold, G: float, values: tuple) -> str | None:
    """Return in words what is wrong with the zeros of force and depth of a hold, "" where nothing is, None without a ramp of
    at least ``FEW`` points.

    The forces of the ramp are compared with b + k f(t) (depth - e)^p, where f is the part that has not relaxed. The errors
    are the noise and those of f. b = e = 0 is rejected where chi2 is higher by ``SURE``, and b or e change the force at the
    hold by more than ``SIZE`` of it.
    """
    t, load, depth = hold.before
    if hold.unknown or np.sum((depth > 0.0) & (t >= 0.0)) < FEW:
        return None
    # the part that has not relaxed, over the increments that were applied up to each point
    lags = t[:, None] - hold.since
    step = relaxation(values, jnp.asarray(np.maximum(lags, 0.0)), hold.tip.radius**2, hold.tip.curve)
    applied = np.where(lags >= 0.0, hold.parts, 0.0)
    unrelaxed = np.where(
        applied.sum(1) > 0.0, np.sum(applied * np.asarray(step), 1) / np.maximum(applied.sum(1), 1e-300), 1.0
    )
    p, top = hold.tip.power, G * hold.tip.force
    model = lambda e: unrelaxed * (np.maximum(depth - e, 0.0) / hold.depth) ** p
    noise = sample_noise(np.append(load, hold.load))
    sd = np.hypot(noise, (ELASTIC + RELAXED * (1.0 - unrelaxed)) * np.abs(load)) + 1e-6 * top

    def fitted(e: float) -> tuple[float, float, float]:
        """chi2, b and k at a depth of contact."""
        A = np.stack([np.ones(t.size), model(e)], -1) / sd[:, None]
        x = np.linalg.lstsq(A, load / sd, rcond=None)[0]
        r = load / sd - A @ x
        return float(r @ r), float(x[0]), float(x[1])

    trial = np.append(np.linspace(min(float(depth.min()), -0.5 * hold.depth), 0.8 * hold.depth, TRIALS), 0.0)
    chi2, b, _ = np.array([fitted(e) for e in trial]).T
    best = int(np.argmin(chi2))
    own, measured = model(0.0) / sd, load / sd
    off = measured - own * (own @ measured) / max(float(own @ own), 1e-300)
    given = float(off @ off)
    scale = max(chi2[best] / max(t.size - 3, 1), 1.0)
    by_depth = (1.0 - float(trial[best]) / hold.depth) ** p - 1.0
    if given - chi2[best] < SURE * scale or max(abs(b[best]) / top, abs(by_depth)) < SIZE:
        return ""
    better = "in_contact() counts both from the contact"
    if hold.cut:
        way = "deeper" if trial[best] > 0.0 else "less deep"
        off = f"{abs(trial[best]):.3g} m {way}"
        better = f"the contact is {off} than the one of in_contact(); in_contact(depth) takes another"
    return (
        f"the ramp begins at a force of about {b[best]:.3g} N ({100.0 * b[best] / top:.2g} % of the largest) and a depth of"
        f" {trial[best]:.3g} m ({100.0 * trial[best] / hold.depth:.2g} % of that of the hold), not at zero: {better}"
    )


def _moved(
    solved: Any, free: np.ndarray, logs: np.ndarray, names: tuple[str, ...], change: np.ndarray
) -> list[str]:
    """Return in words how the parameters change with the measured forces (n,) [N], to the first order."""
    moved = np.zeros(logs.size)
    moved[free] = np.linalg.lstsq(solved.jacobian, solved.weights * change, rcond=1e-12)[0]
    sizes = np.where(logs, 100.0 * np.expm1(np.clip(moved, -9.0, 9.0)), moved)
    return [
        f"{name} by {value if abs(value) > 1e-9 else 0.0:+.2g}{' %' if log else ''}"
        for name, value, log in zip(names, sizes, logs, strict=True)
    ]


def _each(indenter: Any, holds: Sequence[Hold]) -> list[Any]:
    """Return the indenter of each hold."""
    return list(indenter) if isinstance(indenter, list | tuple) else [indenter] * len(holds)
