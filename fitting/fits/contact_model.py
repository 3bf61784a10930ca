"""Which contact model a force curve needs: Hertz, DMT, Maugis or JKR, by the Tabor number that the fit itself finds.

    mu = (R w^2/(E*^2 z^3))^(1/3),     z = w/s,

with the work of adhesion w, the strength s of the attraction (Dugdale) and the contact modulus E* of a ball of radius R on a
half-space. Maugis's theory holds for every mu; where mu is small it is that of Derjaguin, Muller and Toporov (DMT), where it
is large that of Johnson, Kendall and Roberts (JKR), and without tension that of Hertz. A tension below the noise of a point
also shifts the contact point of Hertz's theory and so its modulus, which the interval of the modulus includes
(``unseen_tension``). The limits of mu are those of the
map of K. L. Johnson, J. A. Greenwood, J. Colloid Interface Sci. 192 (1997) 326. The interval of mu from the fit of Maugis's
theory decides; where it includes a limit, the curve does not tell the theories on both sides apart, and the result is
Maugis's.
"""

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import jaxcontact as jc
from fitting.data.contact import baseline, directions, sample_noise
from fitting.data.indentation import IndentationData, read_pull_off, zeroed
from fitting.fits.adhesion import AdhesiveFit, body_of, fit_adhesive
from fitting.inference.noise import two_sided
from fitting.inference.result import plain
from fitting.models.adhesive_contact import JKR
from fitting.search.press import Instrument

DMT_BELOW, JKR_ABOVE = 0.1, 5.0  # of the Tabor number
SEEN = 5.0  # least tension in standard deviations of the noise, as of ``read_pull_off``
DMT_PARAMETER = 0.01  # Maugis's lambda at which his theory is that of DMT within a percent
FAINT = 0.01  # tension over the largest load below which adhesion hardly changes the modulus
FEW = 10  # fewest points of a retraction
# trial tensions over the largest force, as multiples of ``SEEN`` standard deviations, and trial contact points beside that
# of Hertz over the largest depth
TENSIONS, SHIFTS = np.linspace(0.0, 1.5, 61), np.linspace(-0.15, 0.15, 121)


class Candidate(NamedTuple):
    """A model that was fitted: name, Young's modulus [Pa], work of adhesion [J/m2], BIC and verdict."""

    name: str
    youngs_modulus: float
    work: float
    bic: float
    verdict: str


class ContactModel(NamedTuple):
    """The contact model of a force curve, with what decided.

    name: "Hertz", "DMT", "Maugis", "JKR" or "cannot tell"; possible: the models that the data allow, several where they do
    not tell; tabor: the Tabor number (value, low, high), None without tension or retraction; tension: the largest one
    [N], nan without a retraction; noise: standard deviation of a load [N]; load: the largest one [N]; largest_work: bound
    of the work of adhesion [J/m2] by the noise, where no tension is seen; candidates: the models that were fitted; words:
    the decision as text.
    """

    name: str
    possible: tuple[str, ...]
    tabor: tuple[float, float, float] | None
    tension: float
    noise: float
    load: float
    largest_work: float
    candidates: tuple[Candidate, ...]
    words: str

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers for JSON."""
        return {
            "name": self.name, "possible": list(self.possible),
            "tabor_number": self.tabor and [plain(v) for v in self.tabor],
            "tension_N": plain(self.tension), "noise_N": self.noise, "largest_load_N": self.load,
            "largest_work_J_per_m2": plain(self.largest_work), "in_words": self.words,
            "candidates": [
                {"name": one.name, "youngs_modulus_Pa": one.youngs_modulus, "work_J_per_m2": one.work, "bic": plain(one.bic),
                 "verdict": one.verdict}
                for one in self.candidates
            ],
        }  # fmt: skip

    def lines(self) -> list[str]:
        """Return the lines of a summary."""
        rows = [
            f"    {one.name}: E = {one.youngs_modulus:.4g} Pa, work = {one.work:.4g} J/m2, BIC {one.bic:.1f}, {one.verdict}"
            for one in self.candidates
        ]
        return [f"  contact model: {self.name}; {self.words}", *rows]


class UnseenTension(NamedTuple):
    """A tension that the approach allows though no point of the retraction has it.

    best, largest [N]: the tension that describes the approach best, and the end of its interval; factors: least and largest
    ratio of the contact modulus and that of Hertz for tensions of the interval; seen: whether zero is far outside of it.
    """

    best: float
    largest: float
    factors: tuple[float, float]
    seen: bool

    def in_words(self) -> str:
        """Return by how much the modulus is lower."""
        return f"with which the modulus is lower by up to {100.0 * (1.0 - self.factors[0]):.2g} %, as its interval includes"


def unseen_tension(fit: Any, spread: float) -> UnseenTension:
    """Return the tension T that the approach of an elastic fit to a ball allows, in the limit of DMT,

        force = c max(depth - p, 0)^(3/2) - T [depth > p] + b + k i

    by least squares over c, b, k and trial p and T; spread: standard deviation of a load [N]. The interval of T allows for
    the correlation of neighbouring residuals.
    """
    top = float(np.max(fit.force))
    x, y, n = fit.depth / float(np.max(fit.depth)), fit.force / top, fit.force.size
    tensions = TENSIONS * min(SEEN * spread / top, 1.0)
    squares, moduli = np.full((2, tensions.size, SHIFTS.size), np.inf)
    for j, shift in enumerate(SHIFTS):
        A = np.stack([np.maximum(x - shift, 0.0) ** 1.5, np.ones(n), np.linspace(0.0, 1.0, n)], -1)
        pulled = y[:, None] + tensions * (x > shift)[:, None]
        found = np.linalg.lstsq(A, pulled, rcond=None)[0]
        squares[:, j], moduli[:, j] = np.sum((A @ found - pulled) ** 2, 0), found[0]
    rows, place = np.arange(tensions.size), np.argmin(squares, 1)
    squares, moduli = squares[rows, place], moduli[rows, place]
    residual = (fit.force - fit.model_force) / top
    lag = max(float(residual[1:] @ residual[:-1] / max(residual @ residual, 1e-300)), 0.0)
    least = int(np.argmin(squares))
    variance = squares[least] / max(n - 5, 1) * (1.0 + lag) / max(1.0 - lag, 1e-3)
    excess = (squares - squares[least]) / max(variance, 1e-300)
    allowed = np.flatnonzero(excess <= two_sided(fit.level) ** 2)
    ratios = np.maximum(moduli[allowed] / moduli[0], 1e-3) if moduli[0] > 0.0 else np.ones(1)
    factors = min(float(ratios.min()), 1.0), max(float(ratios.max()), 1.0)
    return UnseenTension(
        float(tensions[least]) * top, float(tensions[allowed[-1]]) * top, factors, bool(excess[0] > SEEN**2)
    )


def with_unseen_tension(fit: Any, body: Any, unseen: UnseenTension) -> Any:
    """Return an elastic fit whose intervals include the moduli with an unseen tension, unless it is rejected."""
    if fit.refused:
        return fit
    own, share = body.own, 1.0 - fit.nu
    # of the shear modulus, beside the compliance of the ball
    of = lambda G, factor: share / max((share / G + own) / factor - own, 1e-300)
    low, high = fit.intervals["G"]
    low, high = of(low, unseen.factors[0]), of(high, unseen.factors[1]) if math.isfinite(high) else high
    E = fit.youngs_modulus[0], 2.0 * (1.0 + fit.nu) * low, 2.0 * (1.0 + fit.nu) * high
    sd = max(map(abs, map(math.log, unseen.factors))) / two_sided(fit.level)
    covariance = fit.estimate.covariance + np.outer(sd * fit.estimate.best, sd * fit.estimate.best)
    return dataclasses.replace(
        fit, intervals=fit.intervals | {"G": (low, high)}, youngs_modulus=E,
        sd_log=fit.sd_log | {"G": math.hypot(fit.sd_log["G"], sd)},
        estimate=fit.estimate._replace(covariance=covariance),
    )  # fmt: skip


def choose_contact_model(
    data: IndentationData, *, indenter: Any, nu: float, weights: str | None, sigma: Any,
    bounds: dict[str, tuple] | None, level: float, elastic: Callable[[], Any],
) -> Any:  # fmt: skip
    """Return the fit of the contact model that a curve needs, with its ``contact_model``; for ``fit_force``.

    elastic: function that returns the fit without adhesion.
    """
    body = body_of(indenter, nu)
    radius = float(indenter.radius)

    # The curve with load and depth positive inwards, and the zero of the load from the end of the retraction.
    back = data.segments == "retract"
    inward, pushed = directions(data)
    turned = dataclasses.replace(
        data, load=pushed * (data.load - baseline(data.load[~back])), depth=inward * data.depth, marks=data.segments,
        whole=None,
    )  # fmt: skip
    turned, _ = zeroed(turned)
    spread, load = sample_noise(turned.load), float(np.max(turned.load))

    every: tuple[str, ...] = ("Hertz", "DMT", "Maugis", "JKR")
    if back.sum() < FEW:
        hertz = elastic()
        unseen = unseen_tension(hertz, spread)
        words = (
            "the curve has no retraction, and without its tension adhesion is not seen: the approach alone does not tell"
            f" Hertz from the others; it allows a tension up to {unseen.largest:.2g} N, {unseen.in_words()}"
        )
        model = ContactModel("cannot tell", every, None, math.nan, spread, load, math.nan, (), words)
        return dataclasses.replace(with_unseen_tension(hertz, body, unseen), contact_model=model)
    tension = -float(np.min(turned.load[back]))
    try:
        read_pull_off(turned)
    except ValueError:
        most = SEEN * spread / (1.5 * math.pi * radius)
        words = (
            f"no tension above {SEEN:g} standard deviations of the noise ({SEEN * spread:.3g} N) in the retraction, so that"
            f" the work of adhesion is below about {most:.2g} J/m2"
        )
        hertz = elastic()
        unseen = unseen_tension(hertz, spread)
        name, possible = ("cannot tell", every) if unseen.seen else ("Hertz", every[:1])
        if unseen.seen:
            words += f", but the approach is described better with a tension of {unseen.best:.2g} N from the contact on,"
            words += f" {unseen.in_words()}: a mean of several curves tells whether it is there"
        else:
            words += f"; the approach allows a tension up to {unseen.largest:.2g} N, {unseen.in_words()}"
        model = ContactModel(name, possible, None, tension, spread, load, most, (), words)
        return dataclasses.replace(with_unseen_tension(hertz, body, unseen), contact_model=model)

    # Maugis's theory, whose strength and work give the Tabor number with its interval, and the limits for comparison.
    known = None if bounds is None else {name: pair for name, pair in bounds.items() if name == "G"}
    instrument = Instrument(contact_point="fit")
    # errors that follow the load are estimated in elastic fits alone: points out of contact have no weight here
    weights = None if weights == "estimated" else weights
    fitted = functools.partial(
        fit_adhesive, turned, body=body, instrument=instrument, weights=weights, sigma=sigma, bounds=known, level=level,
    )  # fmt: skip
    maugis, jkr = fitted("fit"), fitted("jkr")
    G, work, strength = (maugis.values[name] for name in ("G", "work", "strength"))
    modulus = float(body.modulus(G))
    number = lambda s: (
        float(jc.DugdaleAdhesion(work, s).tabor_number(radius, modulus)) if 0.0 < s < math.inf else s
    )
    tabor = (number(strength), *(number(s) for s in maugis.intervals["strength"]))
    # lambda = 2 s (R/(pi w K^2))^(1/3), K = 4 E*/3
    least = 0.5 * DMT_PARAMETER * float(np.cbrt(math.pi * work * (4.0 * modulus / 3.0) ** 2 / radius))
    dmt = fitted("fit", fixed={"strength": least})
    fits: dict[str, AdhesiveFit] = {"DMT": dmt, "Maugis": maugis, "JKR": jkr}
    candidates = tuple(
        Candidate(name, 2.0 * (1.0 + nu) * fit.values["G"], fit.values["work"], fit.bic, fit.verdict)
        for name, fit in fits.items()
    )

    # the models that the interval of the Tabor number includes
    ranges = {"DMT": (0.0, DMT_BELOW), "Maugis": (DMT_BELOW, JKR_ABOVE), "JKR": (JKR_ABOVE, math.inf)}
    _, low, high = tabor
    possible = tuple(name for name, (begin, end) in ranges.items() if low <= end and high >= begin)
    if maugis.refused and jkr.refused and dmt.refused:
        name, found = "cannot tell", maugis
        reason = "no model of adhesion describes the curve, so that its Tabor number means nothing"
        possible = tuple(fits)
    elif len(possible) == 1:
        name = possible[0]
        limit = fits[name]
        within = all(
            low <= limit.values[each] <= high
            for each, (low, high) in maugis.intervals.items()
            if each in JKR._fields
        )
        found = limit if within else maugis
        reason = {
            "DMT": f"below {DMT_BELOW:g}", "JKR": f"above {JKR_ABOVE:g}",
            "Maugis": f"between {DMT_BELOW:g} and {JKR_ABOVE:g}",
        }[name]  # fmt: skip
        reason = f"the interval of the Tabor number is {reason}"
        if not within:
            reason += f"; the result is Maugis's all the same, since modulus or work of {name} are outside of its intervals"
    else:
        name, found = "cannot tell", maugis
        works = [fits[one].values["work"] for one in possible]
        reason = (
            f"the interval of the Tabor number includes {' and '.join(possible)}, between which the work of adhesion differs"
            f" by {100.0 * (max(works) / min(works) - 1.0):.2g} %; the result is Maugis's, whose intervals allow for that"
        )
    words = (
        f"Tabor number {tabor[0]:.3g}, {100 * level:g} % interval {tabor[1]:.3g} to {tabor[2]:.3g}; tension"
        f" {tension:.3g} N, {100.0 * tension / load:.2g} % of the largest load; {reason}"
    )
    if tension < FAINT * load:
        words += (
            f"; the tension is below {100 * FAINT:g} % of the load, so that Hertz has nearly the same modulus"
        )
    model = ContactModel(name, possible, tabor, tension, spread, load, math.nan, candidates, words)
    return dataclasses.replace(found, contact_model=model)
