"""jaxcontact: differentiable time-dependent contact with a viscoelastic layered half-space.

Importing it switches jax to float64: the kernels span some sixteen decades, and in float32
the film's contribution would be lost next to the substrate's. On a CPU it also makes jax run programs synchronously.

Public names are imported when one of them is first used, and jax with them, since the command line answers ``--help``
without. Where jax is not imported yet, its settings are made as soon as it is, by whatever module imports it first.
"""

import importlib
import os
import typing

# XLA's errors are raised in Python. Its log also has a harmless message for each program loaded from the cache on disk
# (https://github.com/openxla/xla/issues/44565). XLA reads this variable when jax is first imported, maybe before this.
os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")

from jaxcontact._support import at_import
from jaxcontact._support.version import __version__ as __version__

at_import.prepare()

if typing.TYPE_CHECKING:
    from jaxcontact._names import *
else:

    def __getattr__(name):
        if not name.startswith("_"):
            names = vars(importlib.import_module("jaxcontact._names"))
            globals().update({each: value for each, value in names.items() if not each.startswith("_")})
            if name in globals():
                return globals()[name]
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    def __dir__():
        return sorted({*globals(), *__all__})


# what the reference shows; tests/project/test_public_api.py holds the same names
__all__ = [
    "AdhesiveHistory",
    "AdhesiveSlidingHistory",
    "Approach",
    "Archard",
    "ArrheniusShift",
    "Burgers",
    "Cone",
    "ContactClusters",
    "ContactHistory",
    "ContactStatistics",
    "Cylinder",
    "Deflection",
    "DugdaleAdhesion",
    "Elastic",
    "Ellipsoid",
    "ExponentialAdhesion",
    "FlatPunch",
    "FractionalKelvinVoigt",
    "FractionalMaxwell",
    "FractionalZener",
    "Graded",
    "Grid",
    "HeightField",
    "InteriorFields",
    "KelvinVoigt",
    "Layer",
    "LayeredHalfSpace",
    "Load",
    "Maxwell",
    "NumpyFunction",
    "PressureHistogram",
    "Prony",
    "ProportionalRemoval",
    "RubbingHistory",
    "Sensitivity",
    "ShearHistory",
    "SlidingHistory",
    "Sphere",
    "Springpot",
    "StandardLinearSolid",
    "Status",
    "SteadyRolling",
    "SteadySliding",
    "StressActivated",
    "Study",
    "Surface",
    "SurfaceStatistics",
    "TangentialDisplacement",
    "TangentialLoad",
    "Thermal",
    "ThermalBody",
    "ThermalFilm",
    "WLFShift",
    "cite",
    "contact_clusters",
    "contact_statistics",
    "deflection",
    "enable_compilation_cache",
    "flash_temperature",
    "frequency_response",
    "heat_partition",
    "indent",
    "kernels",
    "normal_response",
    "pressure_histogram",
    "read_result",
    "read_surface",
    "roll_steady",
    "rub",
    "self_affine",
    "sensitivity",
    "shear",
    "slide",
    "slide_steady",
    "subsurface",
    "surface_statistics",
    "sweep",
    "write_result",
]
