"""jaxcontact: differentiable time-dependent contact with a viscoelastic layered half-space.

Importing it switches jax to float64: the kernels span some sixteen decades, and in float32
the film's contribution would be lost next to the substrate's. On a CPU it also makes jax run programs synchronously.
"""

import os

# XLA's errors are raised in Python. Its log also has a harmless message for each program loaded from the cache on disk
# (https://github.com/openxla/xla/issues/44565). XLA reads this variable when jax is first imported, maybe before this.
os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")

import jax

jax.config.update("jax_enable_x64", True)
# Programs dispatched asynchronously compete for jax's threads with the Fourier transforms inside them, and all run
# slower.
jax.config.update("jax_cpu_enable_async_dispatch", False)

from jaxcontact._compile import installed_jax, programs  # noqa: E402
from jaxcontact._support import fitting_alias  # noqa: E402

installed_jax.silence_the_compiler()
installed_jax.warn_of_a_known_fault()
programs.watch_memory_maps()
fitting_alias.install()

from jaxcontact import abc as abc  # noqa: E402
from jaxcontact._compile.compilation_cache import enable_compilation_cache as enable_compilation_cache  # noqa: E402
from jaxcontact._support.status import Status as Status  # noqa: E402
from jaxcontact._support.version import __version__ as __version__  # noqa: E402
from jaxcontact._support.version import cite as cite  # noqa: E402
from jaxcontact.bodies.body import Graded as Graded  # noqa: E402
from jaxcontact.bodies.body import Layer as Layer  # noqa: E402
from jaxcontact.bodies.body import LayeredHalfSpace as LayeredHalfSpace  # noqa: E402
from jaxcontact.bodies.controls import Approach as Approach  # noqa: E402
from jaxcontact.bodies.controls import Load as Load  # noqa: E402
from jaxcontact.bodies.controls import TangentialDisplacement as TangentialDisplacement  # noqa: E402
from jaxcontact.bodies.controls import TangentialLoad as TangentialLoad  # noqa: E402
from jaxcontact.bodies.grid import Grid as Grid  # noqa: E402
from jaxcontact.bodies.laws import Archard as Archard  # noqa: E402
from jaxcontact.bodies.laws import ArrheniusShift as ArrheniusShift  # noqa: E402
from jaxcontact.bodies.laws import DugdaleAdhesion as DugdaleAdhesion  # noqa: E402
from jaxcontact.bodies.laws import ExponentialAdhesion as ExponentialAdhesion  # noqa: E402
from jaxcontact.bodies.laws import ProportionalRemoval as ProportionalRemoval  # noqa: E402
from jaxcontact.bodies.laws import StressActivated as StressActivated  # noqa: E402
from jaxcontact.bodies.laws import Thermal as Thermal  # noqa: E402
from jaxcontact.bodies.laws import WLFShift as WLFShift  # noqa: E402
from jaxcontact.bodies.materials import Burgers as Burgers  # noqa: E402
from jaxcontact.bodies.materials import Elastic as Elastic  # noqa: E402
from jaxcontact.bodies.materials import FractionalKelvinVoigt as FractionalKelvinVoigt  # noqa: E402
from jaxcontact.bodies.materials import FractionalMaxwell as FractionalMaxwell  # noqa: E402
from jaxcontact.bodies.materials import FractionalZener as FractionalZener  # noqa: E402
from jaxcontact.bodies.materials import KelvinVoigt as KelvinVoigt  # noqa: E402
from jaxcontact.bodies.materials import Maxwell as Maxwell  # noqa: E402
from jaxcontact.bodies.materials import Prony as Prony  # noqa: E402
from jaxcontact.bodies.materials import Springpot as Springpot  # noqa: E402
from jaxcontact.bodies.materials import StandardLinearSolid as StandardLinearSolid  # noqa: E402
from jaxcontact.bodies.surfaces import Surface as Surface  # noqa: E402
from jaxcontact.bodies.surfaces import read_surface as read_surface  # noqa: E402
from jaxcontact.bodies.surfaces import self_affine as self_affine  # noqa: E402
from jaxcontact.indenters.shapes import Cone as Cone  # noqa: E402
from jaxcontact.indenters.shapes import Cylinder as Cylinder  # noqa: E402
from jaxcontact.indenters.shapes import Ellipsoid as Ellipsoid  # noqa: E402
from jaxcontact.indenters.shapes import FlatPunch as FlatPunch  # noqa: E402
from jaxcontact.indenters.shapes import HeightField as HeightField  # noqa: E402
from jaxcontact.indenters.shapes import Sphere as Sphere  # noqa: E402
from jaxcontact.operators.kernels import kernels as kernels  # noqa: E402
from jaxcontact.response.normal import normal_response as normal_response  # noqa: E402
from jaxcontact.response.tangential import frequency_response as frequency_response  # noqa: E402
from jaxcontact.results.contact import AdhesiveHistory as AdhesiveHistory  # noqa: E402
from jaxcontact.results.contact import AdhesiveSlidingHistory as AdhesiveSlidingHistory  # noqa: E402
from jaxcontact.results.contact import ContactHistory as ContactHistory  # noqa: E402
from jaxcontact.results.contact import RubbingHistory as RubbingHistory  # noqa: E402
from jaxcontact.results.contact import ShearHistory as ShearHistory  # noqa: E402
from jaxcontact.results.contact import SlidingHistory as SlidingHistory  # noqa: E402
from jaxcontact.results.contact import SteadyRolling as SteadyRolling  # noqa: E402
from jaxcontact.results.contact import SteadySliding as SteadySliding  # noqa: E402
from jaxcontact.results.deformation import Deflection as Deflection  # noqa: E402
from jaxcontact.results.deformation import InteriorFields as InteriorFields  # noqa: E402
from jaxcontact.results.storage import read_result as read_result  # noqa: E402
from jaxcontact.results.storage import write_result as write_result  # noqa: E402
from jaxcontact.results.surface_statistics import ContactClusters as ContactClusters  # noqa: E402
from jaxcontact.results.surface_statistics import ContactStatistics as ContactStatistics  # noqa: E402
from jaxcontact.results.surface_statistics import PressureHistogram as PressureHistogram  # noqa: E402
from jaxcontact.results.surface_statistics import SurfaceStatistics as SurfaceStatistics  # noqa: E402
from jaxcontact.results.surface_statistics import contact_clusters as contact_clusters  # noqa: E402
from jaxcontact.results.surface_statistics import contact_statistics as contact_statistics  # noqa: E402
from jaxcontact.results.surface_statistics import pressure_histogram as pressure_histogram  # noqa: E402
from jaxcontact.results.surface_statistics import surface_statistics as surface_statistics  # noqa: E402
from jaxcontact.simulate.deflection import deflection as deflection  # noqa: E402
from jaxcontact.simulate.indent import indent as indent  # noqa: E402
from jaxcontact.simulate.roll_steady import roll_steady as roll_steady  # noqa: E402
from jaxcontact.simulate.rub import rub as rub  # noqa: E402
from jaxcontact.simulate.sensitivity import NumpyFunction as NumpyFunction  # noqa: E402
from jaxcontact.simulate.sensitivity import Sensitivity as Sensitivity  # noqa: E402
from jaxcontact.simulate.sensitivity import sensitivity as sensitivity  # noqa: E402
from jaxcontact.simulate.shear import shear as shear  # noqa: E402
from jaxcontact.simulate.slide import slide as slide  # noqa: E402
from jaxcontact.simulate.slide_steady import slide_steady as slide_steady  # noqa: E402
from jaxcontact.simulate.subsurface import subsurface as subsurface  # noqa: E402
from jaxcontact.simulate.sweep import Study as Study  # noqa: E402
from jaxcontact.simulate.sweep import sweep as sweep  # noqa: E402
from jaxcontact.simulate.temperature import ThermalBody as ThermalBody  # noqa: E402
from jaxcontact.simulate.temperature import ThermalFilm as ThermalFilm  # noqa: E402
from jaxcontact.simulate.temperature import flash_temperature as flash_temperature  # noqa: E402
from jaxcontact.simulate.temperature import heat_partition as heat_partition  # noqa: E402

load, save = read_result, write_result  # their former names

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
