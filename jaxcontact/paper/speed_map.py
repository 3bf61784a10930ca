"""The speed map of the tribofilm: its steady state from 1e-9 to 1 m/s under four loads.

This is not a figure of the paper, which extrapolates to engine speeds from runs of up to 1.6 mm/s. Here the steady state
is computed at each speed. The paper's conclusion that the film's contact depends on time only below about
1 um/s is tested by the speed at which the peak pressure is 1 % below that of the glassy film.
"""

import warnings
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from jaxcontact.paper import comparison, tribofilm
from jaxcontact.paper.comparison import Reproduction, Row, compared, described, report

LOADS = (1.0, 10.0, 60.0, 500.0)  # [N]
SPEEDS = np.append(10.0 ** np.arange(-9.0, -5.0, 0.25), 10.0 ** np.arange(-5.0, 0.5))  # [m/s]
WIDTHS = 7.0  # width of the grid in contact radii at t = 0
REFERENCES = {
    "W = 10 N: p0 of the glassy film [GPa]": 0.63079,
    "W = 60 N: p0 of the glassy film [GPa]": 1.16724,
    "W = 500 N: p0 of the glassy film [GPa]": 2.39394,
}


class Sweep(NamedTuple):
    """The results for one load over ``SPEEDS``: peak [Pa], radius [m], friction, strain, shift of the centre over a,
    status.
    """

    peak: np.ndarray
    radius: np.ndarray
    friction: np.ndarray
    strain: np.ndarray
    shift: np.ndarray
    status: np.ndarray

    def speed_of_change(self, share: float) -> float:
        """Return the speed [m/s] at which the peak is this share below that of the highest speed."""
        below = 1.0 - self.peak / self.peak[-1]
        return float(10.0 ** np.interp(-share, -below, np.log10(SPEEDS)))


@lru_cache(maxsize=8)
def sweep(load: float, n: int) -> Sweep:
    """Compute the steady states under one load."""
    body, ball = tribofilm.ON_STEEL, tribofilm.BALL
    radius = ball.estimated_radius(body, jc.Load(load), np.zeros(1))
    grid = jc.Grid.square(n, WIDTHS * radius)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        runs = [jc.slide_steady(body, ball, jc.Load(load), velocity=v, grid=grid) for v in SPEEDS]
    gather = lambda value: np.array([float(value(run)) for run in runs])
    return Sweep(
        peak=gather(lambda run: jnp.max(run.pressure)),
        radius=gather(lambda run: run.contact_radius),
        friction=gather(lambda run: run.friction_coefficient),
        strain=gather(lambda run: run.film_strain),
        shift=gather(lambda run: run.pressure_centre[0] / run.contact_radius),
        status=gather(lambda run: run.status),
    )


def simulate(n: int) -> dict[str, Sweep]:
    """Compute the steady states under all loads."""
    return {f"W = {load:g} N": sweep(load, n) for load in LOADS}


def compare(found: dict[str, Sweep], references: Mapping[str, float]) -> list[Row]:
    """Compare the glassy limit with the axisymmetric solution, and report the speeds at which creep becomes significant."""
    rows = []
    for name, run in found.items():
        key = f"{name}: p0 of the glassy film [GPa]"
        if key in references:
            rows.append(
                compared(references, key, run.peak[-1] / 1e9, 0.003, "some 70 cells across at N = 256")
            )
        onset = run.speed_of_change(0.01) * 1e6
        rows += [
            described(f"{name}: peak within 1 % of the glassy one above 2 um/s", onset < 2.0),
            described(f"{name}: but not below 0.5 um/s", onset > 0.5),
            report(f"{name}: speed at which the peak is 1 % lower [um/s]", onset, "-"),
            report(f"{name}: 5 % lower [um/s]", run.speed_of_change(0.05) * 1e6, "-"),
            report(f"{name}: largest friction coefficient [-]", np.max(run.friction), "hysteresis alone"),
            report(f"{name}: at [um/s]", SPEEDS[np.argmax(run.friction)] * 1e6, "-"),
            report(
                f"{name}: film strain there [-]", run.strain[np.argmax(run.friction)], comparison.STRAINED
            ),
            report(f"{name}: film strain at 1 m/s [-]", run.strain[-1], "-"),
        ]
    solved = all(np.all(run.status == 0) for run in found.values())
    return [*rows, described("every speed converged inside the grid", solved)]


def draw(found: dict[str, Sweep], directory: Path) -> None:
    """Draw peak, shift of the pressure, friction and film strain against the speed."""
    figure, axes = comparison.panels(4)
    labels = list(found)
    panels = (
        ("peak over that of the glassy film [-]", [run.peak / run.peak[-1] for run in found.values()]),
        ("pressure centre over contact radius [-]", [run.shift for run in found.values()]),
        ("friction coefficient by hysteresis [-]", [run.friction for run in found.values()]),
        ("film strain [-]", [run.strain for run in found.values()]),
    )
    for ax, (label, curves) in zip(axes, panels, strict=True):
        comparison.profiles(ax, SPEEDS, curves, labels)
        ax.set_xscale("log")
        ax.axvline(1e-6, color="0.5", linestyle=":", linewidth=1.0)
        comparison.finish(ax, "speed [m/s]", label, "dotted: 1 µm/s")
    for ax in axes[2:]:
        ax.set_yscale("log")
    axes[2].set_ylim(1e-7, 1e-1)
    comparison.save(figure, directory / "speed_map.png")


CASE = Reproduction(
    "speed_map",
    "The speed map of the tribofilm, 1e-9 to 1 m/s",
    REFERENCES,
    simulate,
    compare,
    draw,
    tribofilm.REMARKS,
)
