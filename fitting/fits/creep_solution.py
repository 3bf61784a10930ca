"""Search of a classical creep fit in the form that ``conclusion.py`` takes: optimum, profiles and combinations."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jax.tree_util import Partial

from fitting.data.curves import CreepData
from fitting.inference.evidence import Assessment, Sample, Solved
from fitting.inference.unsupported import SupportedPoints, keep_all, leave_out
from fitting.models.search_space import Landscape, SearchSpace
from fitting.models.structure import Sought, Structure
from fitting.search import creep_search, padding
from fitting.search.creep_search import Optimum, Scaled
from fitting.search.uncertainty import linear_sd
from fitting.search.varpro import PLACES, TauSearch

SINGLY = 64  # most times of which each has a run of its own, with the program that every fit compiles for its duration
OTHERS = 5  # functions before J(t) in a profile
ROUND_OFF = 1e-14  # of a compliance in scaled units


@dataclasses.dataclass(frozen=True, eq=False)
class CreepSearch:
    """A creep curve in scaled units, and the rule that selects the fitted points."""

    data: CreepData
    structure: Structure
    scaled: Scaled
    choose: Callable[..., SupportedPoints]

    @classmethod
    def of(cls, data: CreepData, sought: Sought, sample: Sample) -> "CreepSearch":
        """Return the search for a classical material; points are left out where the weights are estimated."""
        scaled = creep_search.scale(data, sample.weights, sought.structure, sought.table)
        return cls(data, sought.structure, scaled, leave_out if sample.robust else keep_all)

    @property
    def space(self) -> SearchSpace:
        """The compliances (j0, j2, f, j2/tau), over their units."""
        compliance, time = self.scaled.compliance, self.scaled.time
        box = np.stack([np.asarray(side) for side in self.scaled.problem.limits], -1)
        unit = compliance / np.array([1.0, 1.0, time, time])
        own = np.isin(np.arange(4), PLACES[self.structure.size])
        return SearchSpace.linear(self.structure, box, unit, own)

    def solve(self, weights: np.ndarray) -> Solved:
        """Return the optimum with weights (n,) [1/unit of the response], with the residuals and the Jacobian at all
        points."""
        padded = padding.without_weight(weights * float(np.max(np.abs(self.data.response))))
        problem, n = self.scaled.problem._replace(weights=padded), weights.size
        kept, fewer, best = self.choose(problem, n)
        residual = np.asarray(creep_search.residuals(problem, best))[:n]
        free, inside = places(problem), creep_search.strictly_inside(best.parts, *problem.limits)
        J = np.asarray(creep_search.jacobian(problem, best))[:n, free]
        found = Extents(fewer, best, self.scaled)
        return Solved(
            np.asarray(best.parts), residual, J, np.asarray(inside)[free], kept, weights,
            lambda assessment: found.at(assessment, self.data.t[-1:]), found,
        )  # fmt: skip


def places(problem: TauSearch) -> np.ndarray:
    """Return the places of the fitted compliances among (j0, j2, f, j2/tau)."""
    lower, upper = (np.asarray(side) for side in problem.limits)
    return np.flatnonzero(lower < upper)


class Extents(NamedTuple):
    """Profile likelihoods about the optimum of a problem in the units ``scaled``."""

    problem: TauSearch
    best: Optimum
    scaled: Scaled

    def at(self, assessment: Assessment, t: np.ndarray) -> np.ndarray:
        """Return the ends (5 + k, 2) of the intervals of ``creep_search.profile`` at times t (k,) [s].

        Many times are padded so that only a few values of k are compiled.
        """
        times = t / self.scaled.time
        times = padding.repeated(times) if t.size > SINGLY else times
        levels = assessment.levels(self._gradients(times)[places(self.problem)])
        if not 0 < t.size <= SINGLY:
            return self._profile(levels, times)[: OTHERS + t.size]
        each = range(OTHERS, levels.size)
        rows = [self._profile(levels[[*range(OTHERS), k]], times[[k - OTHERS]]) for k in each]
        return np.concatenate([rows[0], *(row[OTHERS:] for row in rows[1:])])

    def _profile(self, levels: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return the ends (5 + k, 2) at scaled times (k,) for levels (5 + k,), which are often the same."""
        same = np.ptp(levels) <= 1e-12 * levels[0]
        return np.asarray(creep_search.profile(self.problem, self.best, levels[0] if same else levels, times))

    def creep(self, assessment: Assessment, t: np.ndarray) -> np.ndarray:
        """Return the limits (2, k) of J [1/Pa] at times t (k,) [s]."""
        return self.at(assessment, t)[OTHERS:].T * self.scaled.compliance

    def combinations(self, ends: np.ndarray, slopes: np.ndarray) -> dict[str, Any]:
        """Return {name: (value, sd, low, high)} of J0 [1/Pa], slope0 [1/(Pa s)] and J(T) [1/Pa], with T the duration.

        ends (6, 2): the interval ends at T, scaled, of which those that are zero have errors of round-off; slopes (m, k):
        the whitened Jacobian of the fitted compliances.
        """
        (j0, j2, f, ratio), tau = np.asarray(self.best.parts), float(self.best.tau)
        free, whole = places(self.problem), np.zeros((len(slopes), 4))
        whole[:, free] = slopes
        gradients = self._gradients(np.ones(1))[:, [0, 4, 5]].T
        sd = linear_sd(whole, gradients, np.isin(np.arange(4), free))
        values = [j0, ratio + f, j0 - j2 * math.expm1(-1.0 / tau) + f]
        ends = np.where(ends > ROUND_OFF, ends, 0.0)[[0, 4, 5]]
        units = self.scaled.compliance * np.array([1.0, 1.0 / self.scaled.time, 1.0])
        rows = zip(("J0", "slope0", "J(T)"), values, sd, ends, units, strict=True)
        return {name: tuple(float(u) for u in (v * k, s * k, *(e * k))) for name, v, s, e, k in rows}

    def landscape(self, space: SearchSpace) -> Landscape:
        """Return the residuals as a function of the compliances of the material."""
        own = space.material
        residual = Partial(creep_search.residuals_at, self.problem)
        box = np.stack(space.bounds, -1)[own]
        return Landscape(residual, np.asarray(self.best.parts)[own], box, space.unit[own])

    def _gradients(self, times: np.ndarray) -> np.ndarray:
        """Return the gradients of j0, j2, f, j2/tau, slope0 and J(times) with respect to (j0, j2, f, j2/tau), (4, m),
        scaled."""
        (_, j2, _, _), tau = np.asarray(self.best.parts), float(self.best.tau)
        decay, one = np.exp(-times / tau), np.ones(times.size)
        # with tau = j2/ratio, d tau = tau (dj2/j2 - dratio/ratio)
        turn = -decay * times / tau if j2 > 0 else 0.0 * times
        creep = np.stack([one, 1.0 - decay + turn, times, -turn * tau])
        return np.column_stack([np.eye(4), [0.0, 0.0, 1.0, 1.0], creep])
