"""The contacts of the page of ``jaxcontact play``, with the limits of its sliders: a creeping film on a substrate under a
ball, a bead or a roller, in SI units."""

import functools
import math
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

import jaxcontact as jc
from jaxcontact._compile.programs import Program

SPAN = 10.0
"""A slider goes from its default over this number to its default times this number."""

HOUR = 3600.0


@dataclass(frozen=True)
class Preset:
    """An example of the page: a body that is pressed onto a film on a substrate.

    indenter, film, substrate: their names on the page; nu: Poisson's ratio of the film; values: the default of each
    slider, by name. Of these stiffness is the shear modulus at first [Pa]; softening the growth of the compliance within
    the delay [s], as a share of the first; flow the time [s] in which it flows as much as its first strain; thickness
    and radius are in m; load in N, or N/m on a roller.
    """

    indenter: str
    film: str
    nu: float
    substrate: str
    values: dict[str, float]


PRESETS = {
    "ZDDP film on steel": Preset(
        "ball", "film", 0.3, "steel",
        {"load": 10e-3, "radius": 1e-3, "thickness": 150e-9, "stiffness": 2e9, "softening": 4.0, "delay": 100.0,
         "flow": 2.0 * HOUR},
    ),
    "Gel under a bead": Preset(
        "bead", "gel", 0.49, "glass",
        {"load": 1e-9, "radius": 25e-6, "thickness": 50e-6, "stiffness": 1e3, "softening": 1.0, "delay": 10.0,
         "flow": 10.0 * HOUR},
    ),
    "Rubber roller": Preset(
        "roller", "rubber", 0.49, "steel",
        {"load": 1e3, "radius": 50e-3, "thickness": 10e-3, "stiffness": 1e6, "softening": 0.5, "delay": 10.0,
         "flow": 100.0 * HOUR},
    ),
}  # fmt: skip


def checked(request: object) -> tuple[str, dict[str, float]]:
    """Return the preset and the values of a request; ValueError, in one line, if it is not one of the page's sliders."""
    if not isinstance(request, dict) or request.keys() != {"preset", "values"}:
        raise ValueError("request: expected an object with preset and values")
    name, values = request["preset"], request["values"]
    if not isinstance(name, str) or name not in PRESETS:
        raise ValueError(f"preset: expected one of {', '.join(PRESETS)}, got {str(name)[:40]!r}")
    defaults = PRESETS[name].values
    if not isinstance(values, dict) or values.keys() != defaults.keys():
        raise ValueError(f"values: expected an object with {', '.join(defaults)}")
    for key, default in defaults.items():
        value, low, high = values[key], default / SPAN, default * SPAN
        number = value if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan
        if not low * (1.0 - 1e-9) <= number <= high * (1.0 + 1e-9):
            raise ValueError(f"{key}: expected a number from {low:g} to {high:g}, got {str(value)[:40]}")
    return name, {key: float(values[key]) for key in defaults}


TIMES = np.append(0.0, [*np.outer([1.0, 10.0, 100.0, 1000.0], [1.0, 2.0, 3.0, 5.0]).ravel(), 1e4])
"""Times [s] under the load."""

STEEL = jc.Elastic.from_young(210e9, nu=0.3)
SUBSTRATES = {"steel": STEEL, "glass": jc.Elastic.from_young(70e9, nu=0.22)}


def solve(name: str, values: tuple[float, ...]) -> dict[str, Any]:
    """Return the results of a preset's contact in JSON's types and SI units, with its notes in words."""
    body, indenter, load = contact(name, **dict(zip(PRESETS[name].values, values, strict=True)))
    grid = jc.Grid.around(body, indenter, jc.Load(load), TIMES, n=48)
    if isinstance(indenter, jc.Cylinder):
        grid = jc.Grid((96, 1), (grid.width[0] / 96, 1.0), periodic=(False, True))
    history = _indented(*jax.tree.map(np.float64, (body, indenter, load)), grid)
    status = int(np.max(history.status))
    middle = history.grid.shape[1] // 2
    return {
        "times": TIMES.tolist(),
        "x": np.asarray(history.grid.axes()[0]).tolist(),
        "pressure": _finite(history.pressure[:, :, middle]),
        "approach": _finite(history.approach),
        "contact_radius": _finite(history.contact_radius),
        "strain": _finite(np.max(history.film_strain)),
        "failure": jc.Status(status).message if status else "",
        "notes": list(map(str, history.notes)),
    }


def contact(
    name: str,
    stiffness: float,
    softening: float,
    delay: float,
    flow: float,
    thickness: float,
    radius: float,
    load: float,
) -> tuple[jc.LayeredHalfSpace, Any, float]:
    """Return a preset's body, indenter and load, for values in SI units; the load of a roller is that on a metre.

    The film follows the Burgers model: its compliance grows by the share softening within the delay, and as much as at
    first in the time of flow.
    """
    preset = PRESETS[name]
    second = stiffness / softening
    film = jc.Burgers(G1=stiffness, G2=second, eta1=stiffness * flow, eta2=second * delay, nu=preset.nu)
    body = jc.LayeredHalfSpace([jc.Layer(film, thickness)], SUBSTRATES[preset.substrate])
    roller = preset.indenter == "roller"
    return body, jc.Cylinder(radius, 1.0, STEEL) if roller else jc.Sphere(radius, STEEL), load


# The first figure waits for the compiler; on grids as small as these a run takes a tenth of a second all the same.
@functools.partial(Program, optimised=False)
def _indented(body: jc.LayeredHalfSpace, indenter: Any, load: Any, grid: jc.Grid) -> jc.ContactHistory:
    return jc.indent(body, indenter, jc.Load(load), TIMES, grid=grid, substeps=2)


def _finite(values: Any) -> Any:
    """Return numbers as lists, with None for those that a failed run does not have."""
    array = np.asarray(values).astype(object)
    array[~np.isfinite(np.asarray(values))] = None
    return array.tolist()
