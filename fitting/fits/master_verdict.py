"""Verdict on a superposition: whether the shifted curves agree, and whether their shifts follow a law."""

import dataclasses

import numpy as np
from scipy import special

from fitting.fits.master_search import Shifting
from fitting.inference.evidence import Assessment, Sample, Solved
from fitting.models.master_curve import Sweeps

CHANCE = 1e-3  # probability that a difference is found significant by chance
SIMILAR = (
    0.03  # rms difference of curves, relative to the modulus, that repeated loading of a rheometer leaves
)
NEGLIGIBLE = 1e-6  # likewise, below which a difference is rounding or the flexibility of the spline
STRAYED = 0.05  # probability above which a deviation from a law counts as chance in the intervals
WITHIN = 0.5  # rms deviation from a law [K] that the temperature control of a rheometer leaves


class MasterSample(Sample):
    """The points of all curves, of which ``apart`` and ``off_law`` judge the trends in place of the common tests."""

    def assess(self, solved: Solved, p: int, level: float) -> Assessment:
        """Return the evidence without reasons for rejection."""
        found = super().assess(solved, p, level)
        return found._replace(evidence=dataclasses.replace(found.evidence, refused=()))


def apart(shifting: Shifting, theta: np.ndarray) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the reason why curves with free shift factors do not superpose, and a note on smaller differences; () if
    there are none.

    A parabola in x is added to every part of every curve; the curves do not superpose where these describe the residuals
    better than chance and differ by more than rheometers do.
    """
    sweeps, residual, J = shifting.sweeps, shifting.residual(theta), shifting.slopes(theta)
    Q = np.linalg.qr(J)[0]
    A = _parabolas(sweeps)
    A -= Q @ (Q.T @ A)
    U, s, _ = np.linalg.svd(A, full_matrices=False)
    U = U[:, s > 1e-6 * s[0]]
    systematic = U @ (U.T @ residual)
    rise, q = float(systematic @ systematic), U.shape[1]
    rss, dof = float(residual @ residual) - rise, residual.size - J.shape[1] - q
    rms = float(np.sqrt(rise / residual.size))
    if rms <= NEGLIGIBLE or not exceeds(rise, q, rss, dof):
        return (), ()
    size = np.sqrt(np.bincount(sweeps.which, systematic**2) / np.bincount(sweeps.which))
    worst = int(np.argmax(size))
    text = (
        f"with the best shift factors the curves differ systematically by {100 * rms:.2g} % of the modulus, most at"
        f" {sweeps.temperature[worst]:.5g} K ({100 * size[worst]:.2g} %)"
    )
    if rms <= SIMILAR:
        return (), (f"{text}, which is within the {100 * SIMILAR:g} % of repeated loading of a rheometer",)
    hint = "" if shifting.vertical else "; vertical factors may help"
    return (f"the curves do not superpose: {text}{hint}",), ()


def gaps(shifting: Shifting, theta: np.ndarray) -> tuple[str, ...]:
    """Return the reasons why shift factors are not determined: temperatures between which no values of the modulus are
    common, and factors at the end of their search; () if there are none.

    Curves that share no value cannot be brought onto each other. With vertical factors, which change the values, they must
    share a range of the shifted abscissa.
    """
    sweeps, found = shifting.sweeps, []
    shift = shifting.shifts(theta)[0]
    first = sweeps.part == 0
    values = (sweeps.x + shift[sweeps.which]) if shifting.vertical else sweeps.y
    ends = np.array(
        [
            (values[on].min(), values[on].max())
            for on in (first & (sweeps.which == k) for k in range(shift.size))
        ]
    )
    order = np.argsort(ends[:, 0])
    reached = np.maximum.accumulate(ends[order, 1])
    for k in np.flatnonzero(ends[order[1:], 0] > reached[:-1] + SIMILAR):
        below = order[: k + 1][np.argmax(ends[order[: k + 1], 1])]
        one, two = sorted((sweeps.temperature[below], sweeps.temperature[order[k + 1]]))
        found.append(
            f"the curves at {one:.5g} and {two:.5g} K do not overlap: their shift factors follow from the smoothness of the"
            " master curve alone; measure at temperatures between them, or over more decades"
        )
    low, high = (bound[: shifting.count[0]] for bound in shifting.space().bounds)
    width = high - low
    own = theta[: shifting.count[0]]
    at_end = np.flatnonzero((own - low < 1e-6 * width) | (high - own < 1e-6 * width))
    if at_end.size:
        shown = ", ".join(f"{sweeps.temperature[sweeps.others[k]]:.5g} K" for k in at_end)
        found.append(
            f"the shift factors at {shown} are at the end of their search: the curves do not determine them"
        )
    return tuple(found)


def _parabolas(sweeps: Sweeps) -> np.ndarray:
    """Return the columns 1, x and x^2 of every part of every curve, (n, k)."""
    columns = []
    for block in np.unique(sweeps.block):
        for part in range(sweeps.parts):
            on = (sweeps.block == block) & (sweeps.part == part)
            x = np.where(on, sweeps.x - np.mean(sweeps.x[on]), 0.0)
            columns += [on.astype(float), x, x**2]
    return np.stack(columns, -1)


def exceeds(rise: float, q: int, rss: float, dof: int, chance: float = CHANCE) -> bool:
    """Return whether q further parameters lower the RSS by more than chance (F test); rss: with them, of dof."""
    return bool(dof > 0 and special.fdtrc(q, dof, max(rise, 0.0) / q * dof / max(rss, 1e-300)) < chance)


def deviation(temperature: np.ndarray, law: np.ndarray, free: np.ndarray) -> float:
    """Return the rms deviation of free ln a_T (m,) from those of a law, as a temperature [K].

    A factor common to all temperatures, such as the error of the reference curve, is no deviation.
    """
    off = free - law - np.mean(free - law)
    return float(np.sqrt(np.mean((off / np.gradient(law, temperature)) ** 2)))


def strayed(
    temperature: np.ndarray, place: int, law: np.ndarray, rise: np.ndarray, slopes: np.ndarray, away: float
) -> np.ndarray:
    """Return how errors of every temperature (m,), of the size that the deviation from a law shows, change its coordinates
    (k, m).

    law (m,): ln a_T; rise (m, k): its derivatives; place: of the reference temperature; slopes (n, c): derivatives of the
    residuals with free shift factors, which come first; away: deviation [K]. The squares of a row add up to the variance.
    """
    m, k = rise.shape
    others = np.delete(np.arange(m), place)
    Q = np.linalg.qr(slopes[:, m - 1 :])[0]
    root = slopes[:, : m - 1] - Q @ (Q.T @ slopes[:, : m - 1])
    moved = np.eye(m)[others] - np.eye(m)[place]  # an error of the reference moves all others
    size = away * np.sqrt(m / (m - 1.0 - k)) * np.abs(np.gradient(law, temperature))
    return np.linalg.lstsq(root @ rise[others], root @ moved, rcond=None)[0] * size


def off_law(name: str, away: float, rise: float, q: int, rss: float, dof: int) -> tuple[str, ...]:
    """Return the reason why shift factors do not follow a law, () if they do; away: rms deviation [K]."""
    if away <= WITHIN or not exceeds(rise, q, rss, dof):
        return ()
    return (
        f"the shift factors do not follow the {name} law: they deviate by {away:.2g} K (rms), more than chance and more"
        f" than the {WITHIN:g} K that temperature control leaves",
    )
