"""Which contact model a force curve needs: Hertz, DMT, Maugis or JKR, by the Tabor number that the fit itself finds.

    mu = (R w^2/(E*^2 z^3))^(1/3),     z = w/s,

with the work of adhesion w, the strength s of the attraction (Dugdale) and the contact modulus E* of a ball of radius R on a
half-space. Maugis's theory holds for every mu; where mu is small it is that of Derjaguin, Muller and Toporov (DMT), where it
is large that of Johnson, Kendall and Roberts (JKR), and without tension that of Hertz. The limits of mu are those of the
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
from fitting.inference.result import plain
from fitting.models.adhesive_contact import JKR
from fitting.search.press import Instrument

DMT_BELOW, JKR_ABOVE = 0.1, 5.0  # of the Tabor number
SEEN = 5.0  # least tension in standard deviations of the noise, as of ``read_pull_off``
DMT_PARAMETER = 0.01  # Maugis's lambda at which his theory is that of DMT within a percent
FAINT = 0.01  # tension over the largest load below which adhesion hardly changes the modulus
FEW = 10  # fewest points of a retraction


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

    if back.sum() < FEW:
        words = (
            "the curve has no retraction, and without its tension adhesion is not seen: the approach alone does not tell"
            " Hertz from the others"
        )
        model = ContactModel(
            "cannot tell",
            ("Hertz", "DMT", "Maugis", "JKR"),
            None,
            math.nan,
            spread,
            load,
            math.nan,
            (),
            words,
        )
        return dataclasses.replace(elastic(), contact_model=model)
    tension = -float(np.min(turned.load[back]))
    try:
        read_pull_off(turned)
    except ValueError:
        most = SEEN * spread / (1.5 * math.pi * radius)
        words = (
            f"no tension above {SEEN:g} standard deviations of the noise ({SEEN * spread:.3g} N) in the retraction, so that"
            f" the work of adhesion is below about {most:.2g} J/m2"
        )
        model = ContactModel("Hertz", ("Hertz",), None, tension, spread, load, most, (), words)
        return dataclasses.replace(elastic(), contact_model=model)

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
