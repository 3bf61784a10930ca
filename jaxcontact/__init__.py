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

from jaxcontact._compile import installed_jax, memory_maps  # noqa: E402
from jaxcontact._support import fitting_alias  # noqa: E402

installed_jax.silence_the_compiler()
installed_jax.warn_of_a_known_fault()
memory_maps.watch()
fitting_alias.install()

from jaxcontact._compile.compilation_cache import enable_compilation_cache as enable_compilation_cache  # noqa: E402
from jaxcontact._support.citation import cite as cite  # noqa: E402
from jaxcontact._support.status import Status as Status  # noqa: E402
from jaxcontact._support.version import __version__ as __version__  # noqa: E402
from jaxcontact.files.storage import load as load  # noqa: E402
from jaxcontact.files.storage import save as save  # noqa: E402
from jaxcontact.indenters.shapes import Cone as Cone  # noqa: E402
from jaxcontact.indenters.shapes import Cylinder as Cylinder  # noqa: E402
from jaxcontact.indenters.shapes import FlatPunch as FlatPunch  # noqa: E402
from jaxcontact.indenters.shapes import HeightField as HeightField  # noqa: E402
from jaxcontact.indenters.shapes import Sphere as Sphere  # noqa: E402
from jaxcontact.inputs.adhesion import DugdaleAdhesion as DugdaleAdhesion  # noqa: E402
from jaxcontact.inputs.adhesion import ExponentialAdhesion as ExponentialAdhesion  # noqa: E402
from jaxcontact.inputs.controls import Approach as Approach  # noqa: E402
from jaxcontact.inputs.controls import Load as Load  # noqa: E402
from jaxcontact.inputs.controls import TangentialDisplacement as TangentialDisplacement  # noqa: E402
from jaxcontact.inputs.controls import TangentialLoad as TangentialLoad  # noqa: E402
from jaxcontact.inputs.fractional import FractionalKelvinVoigt as FractionalKelvinVoigt  # noqa: E402
from jaxcontact.inputs.fractional import FractionalMaxwell as FractionalMaxwell  # noqa: E402
from jaxcontact.inputs.fractional import Springpot as Springpot  # noqa: E402
from jaxcontact.inputs.grid import Grid as Grid  # noqa: E402
from jaxcontact.inputs.laws import Archard as Archard  # noqa: E402
from jaxcontact.inputs.laws import ProportionalRemoval as ProportionalRemoval  # noqa: E402
from jaxcontact.inputs.laws import StressActivated as StressActivated  # noqa: E402
from jaxcontact.inputs.layers import Graded as Graded  # noqa: E402
from jaxcontact.inputs.layers import Layer as Layer  # noqa: E402
from jaxcontact.inputs.layers import LayeredHalfSpace as LayeredHalfSpace  # noqa: E402
from jaxcontact.inputs.materials import Burgers as Burgers  # noqa: E402
from jaxcontact.inputs.materials import Elastic as Elastic  # noqa: E402
from jaxcontact.inputs.materials import KelvinVoigt as KelvinVoigt  # noqa: E402
from jaxcontact.inputs.materials import Maxwell as Maxwell  # noqa: E402
from jaxcontact.inputs.materials import Prony as Prony  # noqa: E402
from jaxcontact.inputs.materials import StandardLinearSolid as StandardLinearSolid  # noqa: E402
from jaxcontact.inputs.roughness import self_affine as self_affine  # noqa: E402
from jaxcontact.inputs.shifts import ArrheniusShift as ArrheniusShift  # noqa: E402
from jaxcontact.inputs.shifts import WLFShift as WLFShift  # noqa: E402
from jaxcontact.inputs.surface_files import Surface as Surface  # noqa: E402
from jaxcontact.inputs.surface_files import read_surface as read_surface  # noqa: E402
from jaxcontact.inputs.thermal import Thermal as Thermal  # noqa: E402
from jaxcontact.operators.kernels import kernels as kernels  # noqa: E402
from jaxcontact.response.body import normal_response as normal_response  # noqa: E402
from jaxcontact.response.wavevector import frequency_response as frequency_response  # noqa: E402
from jaxcontact.results.contact import AdhesiveHistory as AdhesiveHistory  # noqa: E402
from jaxcontact.results.contact import ContactHistory as ContactHistory  # noqa: E402
from jaxcontact.results.friction import ShearHistory as ShearHistory  # noqa: E402
from jaxcontact.results.friction import SteadyRolling as SteadyRolling  # noqa: E402
from jaxcontact.results.interior import InteriorFields as InteriorFields  # noqa: E402
from jaxcontact.results.rough_contact import ContactClusters as ContactClusters  # noqa: E402
from jaxcontact.results.rough_contact import ContactStatistics as ContactStatistics  # noqa: E402
from jaxcontact.results.rough_contact import PressureHistogram as PressureHistogram  # noqa: E402
from jaxcontact.results.rough_contact import contact_clusters as contact_clusters  # noqa: E402
from jaxcontact.results.rough_contact import contact_statistics as contact_statistics  # noqa: E402
from jaxcontact.results.rough_contact import pressure_histogram as pressure_histogram  # noqa: E402
from jaxcontact.results.rubbing import RubbingHistory as RubbingHistory  # noqa: E402
from jaxcontact.results.sliding import AdhesiveSlidingHistory as AdhesiveSlidingHistory  # noqa: E402
from jaxcontact.results.sliding import SlidingHistory as SlidingHistory  # noqa: E402
from jaxcontact.results.sliding import SteadySliding as SteadySliding  # noqa: E402
from jaxcontact.results.topography import SurfaceStatistics as SurfaceStatistics  # noqa: E402
from jaxcontact.results.topography import surface_statistics as surface_statistics  # noqa: E402
from jaxcontact.verbs.flash_temperature import ThermalFilm as ThermalFilm  # noqa: E402
from jaxcontact.verbs.flash_temperature import flash_temperature as flash_temperature  # noqa: E402
from jaxcontact.verbs.heat_partition import ThermalBody as ThermalBody  # noqa: E402
from jaxcontact.verbs.heat_partition import heat_partition as heat_partition  # noqa: E402
from jaxcontact.verbs.indent import indent as indent  # noqa: E402
from jaxcontact.verbs.roll_steady import roll_steady as roll_steady  # noqa: E402
from jaxcontact.verbs.rub import rub as rub  # noqa: E402
from jaxcontact.verbs.sensitivity import Sensitivity as Sensitivity  # noqa: E402
from jaxcontact.verbs.sensitivity import sensitivity as sensitivity  # noqa: E402
from jaxcontact.verbs.shear import shear as shear  # noqa: E402
from jaxcontact.verbs.slide import slide as slide  # noqa: E402
from jaxcontact.verbs.slide_steady import slide_steady as slide_steady  # noqa: E402
from jaxcontact.verbs.studies import Study as Study  # noqa: E402
from jaxcontact.verbs.studies import sweep as sweep  # noqa: E402
from jaxcontact.verbs.subsurface import subsurface as subsurface  # noqa: E402

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
    "DugdaleAdhesion",
    "Elastic",
    "ExponentialAdhesion",
    "FlatPunch",
    "FractionalKelvinVoigt",
    "FractionalMaxwell",
    "Graded",
    "Grid",
    "HeightField",
    "InteriorFields",
    "KelvinVoigt",
    "Layer",
    "LayeredHalfSpace",
    "Load",
    "Maxwell",
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
    "enable_compilation_cache",
    "flash_temperature",
    "frequency_response",
    "heat_partition",
    "indent",
    "kernels",
    "load",
    "normal_response",
    "pressure_histogram",
    "read_surface",
    "roll_steady",
    "rub",
    "save",
    "self_affine",
    "sensitivity",
    "shear",
    "slide",
    "slide_steady",
    "subsurface",
    "surface_statistics",
    "sweep",
]
