"""The contacts of the page of ``jaxcontact play``: a creeping film on a substrate under a ball, a bead or a roller."""

from typing import Any

import jax
import numpy as np

import jaxcontact as jc
from jaxcontact._compile.programs import Program
from jaxcontact.shell.playground.presets import PRESETS

TIMES = np.append(0.0, [*np.outer([1.0, 10.0, 100.0, 1000.0], [1.0, 2.0, 3.0, 5.0]).ravel(), 1e4])
"""Times [s] under the load."""

STEEL = jc.Elastic.from_young(210e9, nu=0.3)
SUBSTRATES = {"steel": STEEL, "glass": jc.Elastic.from_young(70e9, nu=0.22)}


def solve(name: str, values: tuple[float, ...]) -> dict[str, Any]:
    """Return the results of a preset's contact in JSON's types and SI units, with its notes in words."""
    body, indenter, load = contact(name, **dict(zip(PRESETS[name].values, values, strict=True)))
    history = _indented(*jax.tree.map(np.float64, (body, indenter, load)), _grid(body, indenter, load))
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


def _grid(body: jc.LayeredHalfSpace, indenter: Any, load: float) -> jc.Grid:
    grid = jc.Grid.around(body, indenter, jc.Load(load), TIMES, n=48)
    if isinstance(indenter, jc.Cylinder):
        return jc.Grid((96, 1), (grid.width[0] / 96, 1.0), periodic=(False, True))
    return grid


def _indent(body: jc.LayeredHalfSpace, indenter: Any, load: Any, grid: jc.Grid) -> jc.ContactHistory:
    return jc.indent(body, indenter, jc.Load(load), TIMES, grid=grid)


# The first figure waits for the compiler; on grids as small as these a run takes a tenth of a second all the same.
_indented = Program(_indent, optimised=False)


def _finite(values: Any) -> Any:
    """Return numbers as lists, with None for those that a failed run does not have."""
    array = np.asarray(values).astype(object)
    array[~np.isfinite(np.asarray(values))] = None
    return array.tolist()
