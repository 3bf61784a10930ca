"""Fig. 11: the surface at a constant approach, of the film on steel (a) and of the film as a half-space (b).

The figure shows the sum of both surfaces' displacements, which in the contact equals the ball's
shape; the ball contributes about 1 % on the half-space. References: Hertz's displacement inside and outside
the contact for the half-space, at all times; for the film, at t = 0 and in its limit, the ball's shape.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jaxcontact.paper import comparison, tribofilm
from jaxcontact.paper.comparison import EXACT, Reproduction, Row, described, report, worst
from jaxcontact.paper.tribofilm import Trace
from jaxcontact.reference import hertz

FILM, HALF = "(a) film, 2.5468 um", "(b) half-space, 36.1380 um"
REFERENCES = {
    f"{FILM}: displacement on the axis [um]": 2.5468,
    f"{HALF}: load at 0 s [N]": 60.0201,
}


def simulate(n: int) -> dict[str, Trace]:
    """Simulate two of the runs of Fig. 10."""
    return {FILM: tribofilm.relaxation(True, 2.5468, n), HALF: tribofilm.relaxation(False, 36.1380, n)}


def compare(found: dict[str, Trace], references: Mapping[str, float]) -> list[Row]:
    """Compare the film, whose surface conforms to the ball increasingly, and the half-space, whose surface is constant."""
    film, half = found[FILM], found[HALF]

    # The film: the ball's shape on the axis, and the mean distance between ball and surface over |x| < sqrt(2 R approach).
    inside = film.distance < np.sqrt(2.0 * tribofilm.RADIUS * film.approach[0])
    ball = film.distance**2 / (2.0 * tribofilm.RADIUS)
    gap = np.mean((ball - film.approach[:, None] + film.displacement)[:, inside], axis=1)
    on_axis, middle = f"{FILM}: displacement on the axis [um]", len(film.x) // 2
    depth = (film.displacement[:, middle] + ball[middle]) * 1e6
    depth = references[on_axis] * worst(depth / references[on_axis])

    # The half-space: Hertz's displacement inside and outside the contact, at all times.
    load = f"{HALF}: load at 0 s [N]"
    A = (1.0 - tribofilm.NU) * float(tribofilm.FILM.creep(0.0)) + tribofilm.BALL_COMPLIANCE
    surface = hertz.displacement(half.distance, references[load], tribofilm.RADIUS, A)
    ratio = worst((half.displacement / surface).ravel())
    moved = float(np.max(np.abs(half.displacement - half.displacement[0])) / half.approach[0])
    along = f"{HALF}: displacement along x over Hertz's, worst of all positions and times"
    unchanged = f"{HALF}: surface unchanged (moves by less than 0.01 % of the approach)"
    conformal = f"{FILM}: increasingly conformal (mean gap within 220 um falls)"
    return [
        Row(on_axis, EXACT, references[on_axis], depth, 0.0005, comparison.GRID),
        described(conformal, comparison.never_rises(gap)),
        report(f"{FILM}: mean gap within 220 um at 0 s [nm]", gap[0] * 1e9, "zero is conformal"),
        report(f"{FILM}: mean gap within 220 um at 7200 s [nm]", gap[-1] * 1e9, "zero is conformal"),
        report(f"{FILM}: film strain at 7200 s [-]", film.strain[-1], comparison.STRAINED),
        Row(load, EXACT, references[load], float(half.load[0]), 0.001, comparison.GRID),
        Row(along, EXACT, 1.0, ratio, 0.001, comparison.GRID),
        described(unchanged, moved < 1e-4),
        report(f"{HALF}: largest change over the approach [-]", moved, "zero is unchanged"),
        comparison.solved(found.values()),
    ]


def draw(found: dict[str, Trace], directory: Path) -> None:
    """Draw the surface along x at six times, downwards into the body, with the ball at its constant approach."""
    figure, axes = comparison.panels(2)
    for ax, (name, trace) in zip(axes, found.items(), strict=True):
        comparison.over_time(ax, trace, -trace.displacement * 1e6, tribofilm.SHOWN)
        ball = (trace.distance**2 / (2.0 * tribofilm.RADIUS) - trace.approach[0]) * 1e6
        ax.plot(trace.x * 1e6, ball, "k:", linewidth=1.0, label="ball")
        ax.set_ylim(-1.05e6 * trace.approach[0], 0.25e6 * trace.approach[0])
        comparison.finish(ax, "x [µm]", "surface [µm]", name.replace("um", "µm"))
    comparison.save(figure, directory / "figure_11.png")


CASE = Reproduction(
    "figure_11",
    "Fig. 11: surface at a constant approach",
    REFERENCES,
    simulate,
    compare,
    draw,
    tribofilm.REMARKS,
)
