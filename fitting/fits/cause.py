"""What makes a gel relax: its network, its solvent, or both, from holds at different depths or with different radii.

The network relaxes over times of its own; the solvent migrates over times in proportion to a^2, with the contact radius a.
So one relaxation v(t) of the network and one diffusivity D must describe all holds,

    F_h(t) = c_h sum_j dF0_hj v(t - s_j) (1 - rho + rho g(D (t - s_j)/a_h^2)),
    v(t) = x_0 + sum_k x_k exp(-t/tau_k),      x >= 0,

with the ramps, g and rho of ``poroelastic.py``. The shape of v is free, since networks relax in many ways: times tau_k over
the whole range of the data, three in a decade. So the shape of a single curve tells nothing, and what is concluded follows
from the scaling of the times alone. The factors c_h are free too, because an error of the contact point changes the modulus
of each depth; with ``same_modulus`` they are equal, and the forces tell more.

At given rho and D the best x >= 0 is a linear problem. chi2(rho, D) is computed over a grid and again, finer, about its
minimum, with the noise of each hold from a fit of v to that hold alone, and with less weight where neighbouring residuals
are correlated. The share of the solvent in the relaxation, for every (rho, D),

    s = S/(S + N),      S, N: -log of the factors by which solvent and network reduce the force from the first to the last
                        point, as a mean over the holds,

is 0 for rho = 0 (a network alone) and 1 for constant v (solvent alone). Its interval is that of all (rho, D) whose chi2 is
within ``WITHIN`` of the least one, and the cause is

    viscoelastic    where it ends below ``SMALL``, and a network alone is within ``RISE`` of the least chi2
    poroelastic     where it begins above 1 - ``SMALL``, and solvent alone is within ``RISE``
    both            where chi2 of either alone exceeds the least one by more than ``RISE``
    cannot tell     else, or where the contact radii are alike, no model describes the holds, or nothing relaxes
"""

import dataclasses
import math
from typing import Any, NamedTuple

import numpy as np
import scipy

from fitting.data.weights import nonnegative
from fitting.fits.poroelastic import Hold, holds_of, master_curve
from fitting.inference.noise import lag_one
from fitting.inference.result import plain

RISE = 16.0  # of chi2 above which a single cause is excluded
WITHIN = 6.0  # of chi2 within which a share of the solvent is possible, a level of 99 % for one side
ALIKE = 1.3  # ratio of the squares of the contact radii below which holds are alike
SMALL = 0.2  # share of the relaxation below which a cause is left out
PER_DECADE, BEYOND = 3, 3.0  # relaxation times of the network, and their range over that of the data
POINTS = 100  # means over intervals of log time that stand for a hold
STEPS_D, STEPS_RHO, MOST_RHO = 5, 15, 0.5  # of the grid: of D in a decade, and of rho up to that of nu = 0
RANGE_D = (
    0.02,
    30.0,
)  # of D: least D times the longest hold over a^2, and largest D times the first time over a^2
ZOOMS, CLOSER = 3, 5  # finer grids about the minimum, and the ratio of their steps
TURNS = 6  # alternations between x and the factors of the holds
FLOOR = 0.005  # least error of a force over the largest one, that of the models
MISFIT = 1.5  # chi2 of a point above which no model describes the holds
FLAT = 5.0  # standard deviations of the noise of a mean by which a force must relax


class Means(NamedTuple):
    """A hold as means over intervals of log time.

    y (n,): force over ``unit`` [N]; weights (n,): over the noise; lags (n, m) [s] and parts (m,) of the ramp;
    square: a^2 [m2]; curve: of g; decays (n, m, k): those of the network, times parts, the constant first.
    """

    y: np.ndarray
    weights: np.ndarray
    lags: np.ndarray
    decays: np.ndarray
    square: float
    curve: tuple[float, float, float]
    unit: float

    @property
    def network(self) -> np.ndarray:
        """Columns (n, k) of the network alone."""
        return self.decays.sum(1)

    def solvent(self, D: float) -> np.ndarray:
        """Columns (n, k) of network times solvent for rho = 1."""
        g = np.asarray(master_curve(D * self.lags / self.square, self.curve))
        return np.einsum("nmk,nm->nk", self.decays, g)


def _means(hold: Hold, tau: np.ndarray, modulus: float | None = None) -> Means:
    """Return a hold in means, with weights from a fit of the network to it alone; unit: F0/G times a modulus [Pa], or the
    first force."""
    t = hold.t
    since = np.maximum(t - hold.ramp, 0.0)
    least = max(float(since[since > 0.0].min(initial=np.inf)), 1e-6 * float(since.max()))
    place = np.log(np.maximum(since, least))
    edges = np.linspace(place[0], float(place[-1]) + 1e-9, POINTS + 1)
    which = np.digitize(place, edges) - 1
    _, which, count = np.unique(which, return_inverse=True, return_counts=True)
    mean = lambda values: np.bincount(which, values) / count
    y, at = mean(hold.load), mean(t)
    unit = float(y[0]) if modulus is None else modulus * hold.tip.force
    lags = np.maximum(at[:, None] - hold.since, 0.0)
    decays = np.exp(-lags[:, :, None] / tau)
    decays = np.concatenate([np.ones((*lags.shape, 1)), decays], -1) * hold.parts[:, None]
    root = np.sqrt(count)
    A = decays.sum(1)
    x = nonnegative(A * root[:, None], y / unit * root)
    residual = (A @ x - y / unit) * root
    spread = math.sqrt(float(residual @ residual) / max(y.size - int(np.count_nonzero(x)), 1))
    blocks = np.zeros(y.size, dtype=int)
    alike = max(lag_one(residual, blocks), 0.0)
    alike = min(alike, 0.95) if alike > 2.0 / math.sqrt(y.size) else 0.0
    sigma = np.hypot(spread / root, FLOOR * float(y[0]) / unit) * math.sqrt((1.0 + alike) / (1.0 - alike))
    return Means(y / unit, 1.0 / sigma, lags, decays, hold.tip.radius**2, hold.tip.curve, unit)


class Trial(NamedTuple):
    """The best network and factors at one (rho, D): chi2, share, rho, D [m2/s], x (k,) and the factors (h,)."""

    chi2: float
    share: float
    rho: float
    D: float
    x: np.ndarray
    factors: np.ndarray


class Evidence(NamedTuple):
    """The models of all holds: the best of each cause, and the interval of the share of the solvent."""

    viscoelastic: Trial
    poroelastic: Trial
    both: Trial
    share: tuple[float, float]
    D: tuple[float, float]
    points: int


def _normal(one: Means, A: np.ndarray, B: np.ndarray) -> np.ndarray:
    return (A * one.weights[:, None] ** 2).T @ B


def _search(holds: list[Means], D: np.ndarray, rho: np.ndarray, constant: bool, same: bool) -> list[Trial]:
    """Return the best network, or a constant one, at every pair of D (d,) and rho (r,); same: whether all factors are 1."""
    found = []
    columns = slice(0, 1) if constant else slice(None)
    for value in D:
        # normal matrices of the columns at rho = 0 and rho = 1, from which those at every rho follow
        parts = []
        for one in holds:
            P, Q, y = one.network[:, columns], one.solvent(value)[:, columns], one.y[:, None]
            parts.append((
                _normal(one, P, P), _normal(one, P, Q), _normal(one, Q, Q), _normal(one, P, y)[:, 0],
                _normal(one, Q, y)[:, 0], float(np.sum((one.weights * one.y) ** 2)), P, Q,
            ))  # fmt: skip
        factors = np.ones(len(holds))
        for share in rho:
            grams = [
                (1 - share) ** 2 * PP + share * (1 - share) * (PQ + PQ.T) + share**2 * QQ
                for PP, PQ, QQ, *_ in parts
            ]
            rights = [(1 - share) * Py + share * Qy for *_, Py, Qy, _, _, _ in parts]
            squares = [one[5] for one in parts]
            last = math.inf
            for _ in range(TURNS if len(holds) > 1 and not same else 1):
                M = sum(c * c * one for c, one in zip(factors, grams, strict=True))
                right = sum(c * one for c, one in zip(factors, rights, strict=True))
                R = np.linalg.cholesky(M + 1e-11 * np.trace(M) * np.eye(len(M)))
                x = nonnegative(R.T, scipy.linalg.solve_triangular(R, right, lower=True))
                ahead = [(x @ b, x @ g @ x) for g, b in zip(grams, rights, strict=True)]
                if not same:
                    factors = np.array([xb / max(xgx, 1e-300) for xb, xgx in ahead])
                chi2 = sum(
                    yy - 2.0 * c * xb + c * c * xgx
                    for yy, c, (xb, xgx) in zip(squares, factors, ahead, strict=True)
                )
                if last - chi2 < 1e-3:
                    break
                last = chi2
            # by how much solvent and network reduce the force
            S = N = 0.0
            for *_, P, Q in parts:
                gained = (1 - share) * P[[0, -1], 0] + share * Q[[0, -1], 0]
                S -= math.log(gained[1] / gained[0])
                v = P[[0, -1]] @ x
                N -= math.log(max(v[1], 1e-300) / max(v[0], 1e-300))
            found.append(Trial(float(chi2), S / max(S + N, 1e-300), float(share), float(value), x, factors))
    return found


def _zoomed(holds: list[Means], D: np.ndarray, rho: np.ndarray, constant: bool, same: bool) -> list[Trial]:
    """Return the trials of a grid and of finer ones about its minimum."""
    trials = _search(holds, D, rho, constant, same)
    step_D, step_rho = math.log(D[1] / D[0]), rho[1] - rho[0]
    for _ in range(ZOOMS):
        best = min(trials, key=lambda one: one.chi2)
        near = np.linspace(-1.5, 1.5, 3 * CLOSER // 2 + 2)
        own = np.clip(best.rho + step_rho * near, 0.0, MOST_RHO)
        trials += _search(holds, best.D * np.exp(step_D * near), np.unique(own), constant, same)
        step_D, step_rho = step_D / CLOSER, step_rho / CLOSER
    return trials


def times_and_diffusivities(holds: list[Hold]) -> tuple[np.ndarray, np.ndarray]:
    """Return the relaxation times (k,) [s] and the diffusivities (d,) [m2/s] that the data can show."""
    last = max(float(hold.t[-1]) for hold in holds)
    first = min(max(float(hold.t[0] - hold.since[-1]), float(hold.t[-1]) * 1e-5) for hold in holds)
    count = math.ceil(PER_DECADE * math.log10(BEYOND**2 * last / first)) + 1
    squares = np.array([hold.tip.radius for hold in holds]) ** 2
    low, high = RANGE_D[0] * squares.min() / last, RANGE_D[1] * squares.max() / first
    return (
        np.geomspace(first / BEYOND, last * BEYOND, count),
        np.geomspace(low, high, math.ceil(STEPS_D * math.log10(high / low)) + 1),
    )


def weigh(holds: list[Means], D: np.ndarray, same: bool) -> Evidence:
    """Return the evidence of holds for each cause, with diffusivities of the grid D (d,)."""
    rho = np.linspace(0.0, MOST_RHO, STEPS_RHO + 1)
    network = _search(holds, D[:1], rho[:1], False, same)[0]
    solvent = _zoomed(holds, D, rho[1:], True, same)
    every = [network, *solvent, *_zoomed(holds, D, rho[1:], False, same)]
    best = min(every, key=lambda one: one.chi2)
    left = [one for one in every if one.chi2 <= best.chi2 + WITHIN]
    some = [one for one in left if one.rho > 0.0] or left
    return Evidence(
        network, min(solvent, key=lambda one: one.chi2), best,
        (min(one.share for one in left), max(one.share for one in left)),
        (min(one.D for one in some), max(one.D for one in some)), sum(one.y.size for one in holds),
    )  # fmt: skip


def named(found: Evidence, means: list[Means]) -> tuple[str, str]:
    """Return the cause, and the reason in words."""
    low, high = found.share
    squares = np.array([one.square for one in means])
    fallen = [(one.y[:3].mean() - one.y[-3:].mean()) * float(np.median(one.weights)) for one in means]
    if max(fallen) < FLAT:
        return "cannot tell", "the force hardly relaxes in these holds: they are too short, or begin too late"
    if squares.max() < ALIKE * squares.min():
        return "cannot tell", (
            "all holds have the same contact radius, so that times that depend on it and times that do not are alike: a"
            " second depth would tell (fitting.design)"
        )
    least = found.both.chi2
    if least > MISFIT * found.points:
        return "cannot tell", (
            f"no model describes the holds: chi2 per point is {least / found.points:.3g} with network and solvent"
        )
    by_time = "times that do not depend on the contact radius"
    by_area = "times in proportion to its square"
    excluded = [one.chi2 > least + RISE for one in (found.viscoelastic, found.poroelastic)]
    if high < SMALL and not excluded[0]:
        return "viscoelastic", f"{by_time} describe the holds, {by_area} do not"
    if low > 1.0 - SMALL and not excluded[1]:
        return (
            "poroelastic",
            f"times in proportion to the square of the contact radius describe the holds, {by_time} do not",
        )
    if high < SMALL or low > 1.0 - SMALL:
        part, alone = ("solvent", by_time) if high < SMALL else ("network", by_area)
        return "cannot tell", (
            f"{alone} alone do not describe the holds, but the part of the {part} in the relaxation is below {SMALL:g}:"
            " a small second cause, or an error of the model or of the ramp"
        )
    if min(found.viscoelastic.chi2, found.poroelastic.chi2) > least + RISE:
        return "both", f"neither {by_time} nor {by_area} alone describe the holds"
    return "cannot tell", (
        f"a share of the solvent from {low:.2g} to {high:.2g} of the relaxation describes the holds: a second depth further"
        " from the first, a longer hold or less noise would tell (fitting.design)"
    )


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RelaxationCause:
    """The cause of the relaxation of a gel, from ``relaxation_cause``; it prints as text.

    Attributes:
        cause: "viscoelastic", "poroelastic", "both" or "cannot tell".
        reason: in words.
        share: (low, high) of the share of the solvent in the relaxation between first and last points: 0 for a network
            alone, 1 for solvent alone; at a level of 99 % on each side.
        chi2: {"viscoelastic", "poroelastic", "both": least chi2 of each model}, of ``points`` means; a model is excluded
            where it is more than 16 above the least one.
        diffusivity: (best, low, high) [m2/s] with solvent, as far as the data and the grid tell; the best is nan where no
            model with solvent is better than a constant force.
        nu: Poisson's ratio of the drained network, in the best model with solvent, or nan likewise.
        times, relaxation: the relaxation times [s] and parts of the network in the best model, the constant part first.
        depths, radii: [m] of the holds, the radii of the contact.
        holds: the holds, for ``fitting.design``.
    """

    cause: str
    reason: str
    share: tuple[float, float]
    chi2: dict[str, float]
    points: int
    diffusivity: tuple[float, float, float]
    nu: float
    times: np.ndarray
    relaxation: np.ndarray
    depths: tuple[float, ...]
    radii: tuple[float, ...]
    holds: tuple[Hold, ...]
    evidence: Evidence

    def __repr__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        """Return the result as text for the terminal."""
        depths = ", ".join(f"{depth:.4g}" for depth in self.depths)
        D, low, high = self.diffusivity
        chi2 = ", ".join(f"{value:.4g} {name}" for name, value in self.chi2.items())
        lines = [
            f"{self.cause}: {self.reason}",
            f"  {len(self.depths)} holds at {depths} m",
            f"  share of the solvent in the relaxation: {self.share[0]:.2g} to {self.share[1]:.2g}",
            f"  chi2 of {self.points} means: {chi2}",
        ]
        if self.share[1] > 0.0 and math.isfinite(D):
            lines.append(f"  with solvent: D = {D:.4g} m2/s, {low:.3g} to {high:.3g}, nu = {self.nu:.3g}")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers with the unit in every key, ready for JSON."""
        return {
            "cause": self.cause, "reason": self.reason, "share_of_solvent": [plain(v) for v in self.share],
            "chi2": {name: plain(value) for name, value in self.chi2.items()}, "means": self.points,
            "diffusivity_m2_per_s": [plain(v) for v in self.diffusivity], "nu": plain(self.nu),
            "depths_m": list(self.depths), "contact_radii_m": list(self.radii),
        }  # fmt: skip


def relaxation_cause(
    data: Any, *, indenter: Any, ramp: Any = None, same_modulus: bool = False
) -> RelaxationCause:
    """Tell whether a gel relaxes because its network does, because its solvent migrates, or both, from several holds.

    Poroelastic times are in proportion to the square of the contact radius, viscoelastic ones do not depend on it; holds at
    depths (or with balls) that differ by a factor of three usually tell, a single hold does not. The relaxation of the
    network may have any shape (``fitting/fits/cause.py``). ``fitting.design`` of the result states which second depth would
    tell.

    Args:
        data: a list of ``IndentationData`` at different depths or with different indenters, each with ramp and hold as for
            ``fit_poroelastic``.
        indenter: a rigid ``jc.Sphere`` or ``jc.Cone``, or one for each curve.
        ramp: as in ``fit_poroelastic``.
        same_modulus: whether the modulus is the same in all holds, which tells more. It requires contact points known to
            within the noise: an error of 1 % of a depth changes a force by 1.5 %. By default only times are compared.

    Returns:
        The cause, with the share of the solvent in the relaxation and its interval.

    Raises:
        ValueError: bad values, or a curve without a hold.

    Example:
        >>> gel, ball = fitting.Poroelastic(G=10e3, nu=0.2, D=1e-10), jc.Sphere(50e-6)
        >>> t, noise = np.geomspace(0.01, 50.0, 80), np.random.default_rng(0).standard_normal((2, 80))
        >>> holds = [fitting.IndentationData(t=t, load=gel.force(t, d, ball) * (1 + 0.01 * e), depth=np.full(80, d))
        ...          for d, e in zip((2e-6, 6e-6), noise)]
        >>> print(fitting.relaxation_cause(holds, indenter=ball).cause)
        poroelastic
        >>> print(fitting.relaxation_cause(holds[:1], indenter=ball).cause)
        cannot tell
    """
    holds = holds_of(data, indenter, ramp)
    for hold in holds:
        if not np.all(hold.load > 0.0):
            raise ValueError(f"load: expected forces > 0 N in a hold, got {float(np.min(hold.load)):.3g}")
    tau, D = times_and_diffusivities(holds)
    modulus = float(np.mean(holds[0].load[:1])) / holds[0].tip.force if same_modulus else None
    means = [_means(hold, tau, modulus) for hold in holds]
    found = weigh(means, D, same_modulus)
    cause, reason = named(found, means)
    if cause == "both" and any(hold.unknown for hold in holds):
        reason += (
            "; a network alone looks like this too where the ramps differ and are not known: there are no points before a"
            " hold, and a step at t = 0 is assumed (ramp)"
        )
    # holds that do not relax are described best without a solvent, and show neither D nor nu
    solvent = [one for one in (found.both, found.poroelastic) if one.rho > 0.0]
    best_D, rho = math.nan, math.nan
    if solvent:
        best = min(solvent, key=lambda one: one.chi2)
        best_D, rho = best.D, best.rho
    return RelaxationCause(
        cause, reason, found.share,
        {name: getattr(found, name).chi2 for name in ("viscoelastic", "poroelastic", "both")}, found.points,
        (best_D, *found.D), (1.0 - 2.0 * rho) / (2.0 * (1.0 - rho)), tau, found.both.x,
        tuple(hold.depth for hold in holds), tuple(hold.tip.radius for hold in holds), tuple(holds), found,
    )  # fmt: skip


# Which second depth would tell.

MARGIN = 0.7  # of chi2, so that a cause is named in spite of the noise


def named_at(found: RelaxationCause, ratio: float) -> dict[str, str]:
    """Return what ``relaxation_cause`` would name with a second hold at a depth of ``ratio`` times the first one, for each
    single cause that the holds so far do not exclude.

    The second hold is longer than the first in proportion to the square of the contact radius, as is its ramp; both have the
    noise of the first one. The forces are those of the best model of the cause, without noise.
    """
    first = found.holds[0]
    area = ratio if first.tip.power == 1.5 else ratio**2
    size = ratio**first.tip.power
    tip = first.tip._replace(radius=first.tip.radius * math.sqrt(area), force=first.tip.force * size)
    second = first._replace(
        t=first.t * area, since=first.since * area, ramp=first.ramp * area, depth=first.depth * ratio, tip=tip
    )
    pair = [first, second]
    tau, D = times_and_diffusivities(pair)
    least = min(found.chi2.values())
    weight = math.sqrt(MARGIN) * float(np.median(_means(first, found.times).weights))
    said = {}
    for cause in ("viscoelastic", "poroelastic"):
        if found.chi2[cause] > least + RISE:
            continue
        trial, means = getattr(found.evidence, cause), []
        for hold in pair:
            decays = np.exp(-hold.lags[:, :, None] / found.times)[..., : trial.x.size - 1]
            decays = np.concatenate([np.ones((*hold.lags.shape, 1)), decays], -1) * hold.parts[:, None]
            own = Means(hold.load, hold.load, hold.lags, decays, hold.tip.radius**2, hold.tip.curve, 1.0)
            load = ((1.0 - trial.rho) * own.network + trial.rho * own.solvent(trial.D)) @ trial.x
            one = _means(hold._replace(load=load), tau)
            means.append(one._replace(weights=np.full(one.y.size, weight)))
        said[cause] = named(weigh(means, D, False), means)[0]
    return said
