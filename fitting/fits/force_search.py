"""Preparation of a force curve, and the search for modulus, contact point and baseline."""

import dataclasses
from typing import Any, NamedTuple

import numpy as np

import jaxcontact as jc
from fitting.data.contact import baseline, signs
from fitting.data.indentation import IndentationData
from fitting.data.probe import probe_of
from fitting.data.segments import noise, smooth
from fitting.data.weights import choose_weights
from fitting.inference.evidence import Assessment, Sample, Solved
from fitting.models import thin_layer
from fitting.models.force_curve import PARTS, ForceCurve, residuals, slopes, unit_forces
from fitting.models.layered_contact import RIGID, Base
from fitting.models.search_space import SearchSpace
from fitting.models.structure import CLASSICAL, Sought
from fitting.models.thin_layer import ThinLayer
from fitting.search import padding
from fitting.search.nonlinear import Objective

MOST = 1000  # largest number of points, or means of neighbours
EDGE = 30.0  # bound of the logarithm of the scaled compliance
TRIALS = 80  # trial contact points
BASE = 3.0  # longest baseline, in largest depths
LEAST = 10  # fewest points
QUIET = (
    3.0  # running median of the load over the standard deviation of its noise below which there is no contact
)
NUISANCES = dict(zip((*PARTS, "drag"), ("m", "N", "N/s", "N s/m"), strict=True))


class ApproachCurve(NamedTuple):
    """The approach of a force curve: t [s], load [N] and depth [m], (n,), positive inwards, from the first point on.

    each: number of samples in a point; zero [m]: inward depth of the first point; inward: its sign in the file; notes.
    """

    t: np.ndarray
    load: np.ndarray
    depth: np.ndarray
    each: int
    zero: float
    inward: int
    notes: tuple[str, ...]

    @classmethod
    def of(cls, data: IndentationData) -> "ApproachCurve":
        """Return the approach of a curve; ValueError for fewer than 10 points."""
        some = data.segments == "approach"
        marked = some.sum() >= LEAST
        if not marked:  # up to the largest depth
            some = np.ones(data.t.size, dtype=bool)
        t, load, depth = data.t[some], data.load[some], data.depth[some]
        force = load - baseline(load)
        inward, pushed = signs(force, depth)
        if marked:  # on a stiff sample the largest depth may be where the tip snaps in
            pushed = -1 if force[-1] < 0 else 1
        zero, depth, load = inward * depth[0], inward * (depth - depth[0]), pushed * load
        stop = int(np.argmax(depth)) + 1
        if stop < LEAST:
            rise, scatter = float(np.max(np.abs(smooth(force)))), noise(load)
            if some.sum() >= LEAST and rise <= QUIET * scatter:  # the directions above follow from noise
                raise ValueError(
                    f"data: expected a force that rises with depth, got one within {rise:.2g} N of its baseline, where its"
                    f" noise is {scatter:.2g} N: no contact in the curve"
                )
            raise ValueError(
                f"data: expected an approach of at least {LEAST} points with a force that rises with depth, got {stop} of"
                f" {some.size} points up to the largest depth"
            )
        notes = [] if stop == some.size else [f"approach: {stop} of {some.size} points"]
        notes += [
            f"{name} with the other sign" for name, sign in (("depth", inward), ("load", pushed)) if sign < 0
        ]
        return cls(t[:stop] - t[0], load[:stop], depth[:stop], 1, float(zero), inward, tuple(notes))

    def since(self, first: int) -> "ApproachCurve":
        """Return the curve from a point on."""
        depth, t = self.depth[first:], self.t[first:]
        return self._replace(
            t=t - t[0], load=self.load[first:], depth=depth - depth[0], zero=self.zero + depth[0]
        )

    def thinned(self, most: int = MOST) -> "ApproachCurve":
        """Return means of neighbouring points, at most ``most``."""
        each = -(-self.t.size // most)
        count = self.t.size // each
        mean = lambda y: y[y.size - count * each :].reshape(count, each).mean(1)
        t, load, depth = (mean(y) for y in (self.t, self.load, self.depth))
        moved = self._replace(t=t - t[0], load=load, depth=depth - depth[0], each=each * self.each)
        return moved._replace(zero=self.zero + float(depth[0]))


class Setup(NamedTuple):
    """Indenter, sample and spring of a force curve.

    sought: the elastic solid; thickness [m] of a bonded layer, None for a half-space; substrate: its elastic base, None for
    a rigid one; guess: shear modulus [Pa] of the layer at which the factor of an elastic base is linearised.
    """

    indenter: Any
    sought: Sought
    thickness: float | None
    substrate: jc.Elastic | None = None
    guess: float = 0.0

    @property
    def base(self) -> Base:
        """The base of a layer, with the modulus of the layer at the guess."""
        if self.substrate is None:
            return RIGID
        return Base(self.guess / float(self.substrate.G), float(self.substrate.nu))

    @classmethod
    def of(
        cls, indenter: Any, nu: float, thickness: float | None, bounds: Any, substrate: Any = None
    ) -> "Setup":
        """Return the checked setup; ValueError on bad input."""
        probe_of(indenter)
        if substrate is not None and (thickness is None or not isinstance(substrate, jc.Elastic)):
            got = "no thickness" if thickness is None else type(substrate).__name__
            raise ValueError(f"substrate: expected Elastic, below a sample with a thickness, got {got}")
        if thickness is not None:
            thin_layer.check(thickness, nu)
            if indenter.material is not None:
                raise ValueError("indenter: expected a rigid one on a thin layer, got one with a material")
        structure = CLASSICAL[jc.Elastic]
        return cls(indenter, Sought.of(structure, None, bounds, nu), thickness, substrate)


class ForceSample(Sample):
    """The points of a force curve, whose trends ``force_verdict.py`` judges in place of the common tests."""

    def assess(self, solved: Solved, p: int, level: float) -> Assessment:
        """Return the evidence without reasons for rejection."""
        found = super().assess(solved, p, level)
        return found._replace(evidence=dataclasses.replace(found.evidence, refused=()))


class ForceProblem(NamedTuple):
    """A scaled force curve with its search space.

    units (load [N], depth [m], duration [s], compliance [1/Pa]); sample: load over depth [m].
    """

    approach: ApproachCurve
    setup: Setup
    curve: ForceCurve
    units: tuple[float, float, float, float]
    space: SearchSpace
    sample: Sample

    @classmethod
    def of(cls, approach: ApproachCurve, setup: Setup, weights: str | None, sigma: Any) -> "ForceProblem":
        """Return the scaled problem of an approach; ValueError where nothing changes in it."""
        probe, share = probe_of(setup.indenter), setup.sought.volume.share
        load, depth, T = float(np.ptp(approach.load)), float(approach.depth[-1]), float(approach.t[-1])
        if not (load > 0 and depth > 0 and T > 0):
            raise ValueError(
                f"data: expected load, depth and time to change, got ranges {load:g} N, {depth:g} m, {T:g} s"
            )
        base = float(np.median(approach.load[: max(approach.load.size // 10, 5)]))
        compliance = probe.size * depth**probe.power / (share * load)
        units = load, depth, T, compliance
        rise, at = 0.0, 0.0
        if setup.base.ratio:
            kind = thin_layer.kind_of(setup.indenter)
            rise = thin_layer.table(setup.sought.volume.value, setup.base, True)[kind][1]
            at = -np.log(setup.guess * compliance)
        extra = float(setup.indenter.compliance()) / share / compliance
        above = approach.load - base
        weight, label = choose_weights(approach.t, above, weights, sigma)
        curve = ForceCurve(
            approach.t / T,
            approach.depth / depth,
            above / load,
            weight * load,
            probe.power,
            _layer(setup, depth),
            extra,
            rise,
            at,
        )
        sample = ForceSample.of(("load", "N", approach.depth, above), weight, label)
        return cls(approach, setup, curve, units, _space(setup, units), sample)

    @property
    def padded(self) -> ForceCurve:
        """The curve, padded to a common length."""
        arrays = {
            name: padding.repeated(np.asarray(getattr(self.curve, name))) for name in ("t", "depth", "load")
        }
        return self.curve._replace(weights=padding.without_weight(self.curve.weights), **arrays)

    def objective(self, weights: np.ndarray) -> Objective:
        """Return the least-squares objective for weights (n,) [1/N]."""
        curve, n, space = (
            self._replace(curve=self.curve._replace(weights=weights * self.units[0])).padded,
            weights.size,
            self.space,
        )
        return Objective(
            lambda theta: np.asarray(residuals(theta, curve))[:n],
            lambda theta, free: np.asarray(slopes(theta, curve))[:n, free],
            *space.bounds,
            floor=1e-26 * float(np.sum((weights * self.sample.measured) ** 2)),
        )

    def starts(self) -> list[np.ndarray]:
        """Return coordinates (5,) at the three best local minima over trial contact points; the rest is linear."""
        points = np.linspace(0.0, 1.0, TRIALS, endpoint=False)
        n = self.sample.t.size
        forces = np.asarray(unit_forces(points, self.padded))[:, :n]
        inside = np.isfinite(forces).all(
            1
        )  # at a deeper contact point the largest depth is smaller, and so is chi
        chi = f"expected a sample with chi (sqrt(R depth)/thickness of a ball) up to {thin_layer.LARGEST:g}, got more"
        if not np.any(inside):
            raise ValueError(f"thickness: {chi} for every contact point on a way of {self.units[1]:.3g} m")
        found = [_linear(force, self.curve, point) for force, point in zip(forces, points, strict=True)]
        rss = np.array([one[0] for one in found])
        rss[~inside] = np.inf
        lowest = [
            i for i in range(TRIALS) if rss[i] <= rss[max(i - 1, 0)] and rss[i] <= rss[min(i + 1, TRIALS - 1)]
        ]
        best = sorted((i for i in lowest if np.isfinite(rss[i])), key=lambda i: rss[i])[:3]
        if not best:
            raise ValueError(
                "data: expected a force that rises with depth, got none: no contact in the curve, or a sample too stiff to"
                " indent"
            )
        if (
            not inside.all() and best[0] <= np.argmax(inside) + 1
        ):  # the best one lies at or beyond the end of the layer's law
            raise ValueError(
                f"thickness: {chi} for the contact point that describes the curve: leave out the deep points with a window,"
                " or take the sample as a half-space"
            )
        return [np.clip(found[i][1], *self.space.bounds) for i in best]


def _linear(force: np.ndarray, curve: ForceCurve, point: float) -> tuple[float, np.ndarray]:
    """Return the weighted RSS and the coordinates (5,) for a contact point; inf where the sample would pull."""
    w = np.asarray(curve.weights)
    if not np.all(np.isfinite(force)) or not np.any(force > 0.0):
        return np.inf, np.zeros(5)
    A = np.stack([force, np.ones(w.size), np.asarray(curve.t)], -1) * w[:, None]
    x = np.linalg.lstsq(A, w * curve.load, rcond=None)[0]
    if not x[0] > 0.0:
        return np.inf, np.zeros(5)
    return float(np.sum((A @ x - w * curve.load) ** 2)), np.array([-np.log(x[0]), 0.0, point, x[1], x[2]])


def _layer(setup: Setup, depth: float) -> ThinLayer:
    """Return the factor over depths in units of ``depth``; 1 on a half-space."""
    if setup.thickness is None:
        return ThinLayer(np.zeros(2), 0.0, 1.0)
    layer = ThinLayer.of(setup.indenter, setup.thickness, setup.sought.volume.value, setup.base)
    return layer._replace(scale=layer.scale * depth**layer.power)


def _space(setup: Setup, units: tuple[float, float, float, float]) -> SearchSpace:
    """Return the box of log J, the fluidity (held at 0), contact point, baseline and tilt."""
    load, depth, T, compliance = units
    structure = setup.sought.structure
    low, high = structure.box(setup.sought.table)[0] / compliance
    with np.errstate(divide="ignore"):
        ends = np.clip(np.log([low, high]), -EDGE, EDGE)
    box = np.array([ends, [0.0, 0.0], [0.0, 1.0], [-2.0, 2.0], [-4.0, 4.0]])
    material = np.array([True, True, False, False, False])
    names = (next(iter(structure.where)), "", *PARTS)
    unit = np.array([compliance, compliance / T, depth, load, load / T])
    return SearchSpace(
        structure=structure, lower=box[:, 0], upper=box[:, 1], unit=unit,
        logarithmic=np.arange(5) == 0, material=material, names=names,
        open=np.stack([np.array([low == 0.0, *[False] * 4]), np.array([np.isinf(high), *[False] * 4])], -1),
    )  # fmt: skip


def trimmed(approach: ApproachCurve, setup: Setup) -> ApproachCurve:
    """Return the approach with at most ``BASE`` largest depths of baseline before the contact, with a note."""
    coarse = approach.thinned(200)
    problem = ForceProblem.of(coarse, setup, "absolute", None)
    point = problem.starts()[0][2] * problem.units[1]
    begin = point - BASE * (approach.depth[-1] - point)
    first = int(np.argmax(approach.depth >= begin))
    if first == 0:
        return approach
    note = f"baseline: {first} points further than {BASE:g} largest depths from the contact left out"
    return approach.since(first)._replace(notes=(*approach.notes, note))
