"""Bodies, grids and results that several of the benchmark problems share."""

from types import SimpleNamespace as Inputs
from typing import Any

import jaxcontact as jc
import numpy as np

NOW = np.zeros(1)
WIDTH = 1e-3  # of a slice in plane strain


def elastic(inputs: Inputs) -> jc.LayeredHalfSpace:
    return jc.LayeredHalfSpace([], jc.Elastic(inputs.shear_modulus, inputs.poisson))


def line(n: int, width: float) -> jc.Grid:
    """Return a grid in plane strain."""
    return jc.Grid((n, 1), (width / n, WIDTH), periodic=(False, True))


def of_contact(history: jc.ContactHistory) -> dict[str, Any]:
    """Return the quantities of a round contact at the last time."""
    return {
        "approach": history.approach[-1],
        "contact_radius": history.contact_radius[-1],
        "peak_pressure": history.peak_pressure[-1],
        "load": history.load[-1],
    }
