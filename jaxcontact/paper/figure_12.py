"""Fig. 12: two extreme constant approaches on the film, 50 um (a) and 0.01 nm (b).

(a) The film has little effect at first (Hertz on steel); then the contact grows. (b) The contact radius is a few times
the film's thickness and stays constant while the pressure relaxes. References: Hertz, and the axisymmetric
Abel solution (``reference.abel``): at t = 0 with the modulus G(0), and for (b) at 7200 s by its inverse
Laplace transform at the final contact radius, 0.0028111 MPa. An elastic film of modulus G(7200 s) gives the
same, one of 1/J(7200 s) gives 0.0052 MPa: at a constant approach the relaxation modulus determines the pressure.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jaxcontact.paper import comparison, tribofilm
from jaxcontact.paper.comparison import EXACT, Reproduction, Row, described, report
from jaxcontact.paper.tribofilm import Trace

DEEP, SHALLOW = "(a) 50 um", "(b) 0.01 nm"
REFERENCES = {
    f"{DEEP}: p0 at 0 s, Hertz on steel [GPa]": 5.322,
    f"{DEEP}: p0 at 0 s [GPa]": 5.28632,
    f"{DEEP}: a at 0 s [um]": 695.958,
    f"{SHALLOW}: p0 at 0 s [MPa]": 0.158992,
    f"{SHALLOW}: a at 0 s [um]": 0.408256,
    f"{SHALLOW}: p0 at 7200 s [MPa]": 0.0028111,
    f"{SHALLOW}: a at 7200 s [um]": 0.415485,
}


def simulate(n: int) -> dict[str, Trace]:
    """Simulate both relaxation runs."""
    return {DEEP: tribofilm.relaxation(True, 50.0, n), SHALLOW: tribofilm.relaxation(True, 1e-5, n)}


def compare(found: dict[str, Trace], references: Mapping[str, float]) -> list[Row]:
    """Compare (a) with Hertz and check its growth; check in (b) that the contact is constant and relaxes."""

    def exact(name, found, tolerance, reason):
        return Row(name, EXACT, references[name], float(found), tolerance, reason)

    deep, shallow = found[DEEP], found[SHALLOW]
    grows = comparison.never_falls(deep.radius) and deep.radius[-1] > deep.radius[0]
    hertz = "the film reduces it by 0.7 %"
    return [
        exact(f"{DEEP}: p0 at 0 s, Hertz on steel [GPa]", deep.peak[0] / 1e9, 0.01, hertz),
        exact(f"{DEEP}: p0 at 0 s [GPa]", deep.peak[0] / 1e9, 0.002, comparison.OFF_AXIS),
        exact(f"{DEEP}: a at 0 s [um]", deep.radius[0] * 1e6, 0.003, comparison.CELLS),
        described(f"{DEEP}: contact grows", grows),
        report(f"{DEEP}: a at 7200 s [um]", deep.radius[-1] * 1e6, "constant approach"),
        report(f"{DEEP}: film strain at 0 s [-]", deep.strain[0], comparison.STRAINED),
        report(f"{DEEP}: film strain at 7200 s [-]", deep.strain[-1], comparison.STRAINED),
        exact(f"{SHALLOW}: p0 at 0 s [MPa]", shallow.peak[0] / 1e6, 0.002, comparison.OFF_AXIS),
        exact(f"{SHALLOW}: a at 0 s [um]", shallow.radius[0] * 1e6, 0.003, comparison.CELLS),
        exact(f"{SHALLOW}: p0 at 7200 s [MPa]", shallow.peak[-1] / 1e6, 0.003, "121 times"),
        exact(f"{SHALLOW}: a at 7200 s [um]", shallow.radius[-1] * 1e6, 0.003, comparison.CELLS),
        described(f"{SHALLOW}: contact stays within 3 %", np.ptp(shallow.radius) < 0.03 * shallow.radius[0]),
        described(f"{SHALLOW}: pressure relaxes all the time", comparison.never_rises(shallow.peak)),
        report(f"{SHALLOW}: film strain at 0 s [-]", shallow.strain[0], "small"),
        comparison.solved(found.values()),
    ]


def draw(found: dict[str, Trace], directory: Path) -> None:
    """Draw the pressure along x at six times."""
    figure, axes = comparison.panels(2)
    comparison.over_time(axes[0], found[DEEP], found[DEEP].pressure / 1e9, tribofilm.SHOWN)
    comparison.over_time(axes[1], found[SHALLOW], found[SHALLOW].pressure / 1e6, tribofilm.SHOWN)
    comparison.finish(axes[0], "x [µm]", "pressure [GPa]", "(a) 50 µm on the film")
    comparison.finish(axes[1], "x [µm]", "pressure [MPa]", "(b) 0.01 nm on the film")
    comparison.save(figure, directory / "figure_12.png")


CASE = Reproduction(
    "figure_12", "Fig. 12: extreme approaches", REFERENCES, simulate, compare, draw, tribofilm.REMARKS
)
