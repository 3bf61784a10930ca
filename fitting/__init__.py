"""Identification of material parameters from creep and indentation data, with their uncertainty and identifiability."""

import jaxcontact  # noqa: F401  # before jax, which reads what it sets when it is first imported
from fitting.after.planning import Design as Design
from fitting.after.planning import design as design
from fitting.after.posterior import Posterior as Posterior
from fitting.after.posterior import posterior as posterior
from fitting.after.propagation import Propagated as Propagated
from fitting.after.propagation import propagate as propagate
from fitting.data.creep import CreepData as CreepData
from fitting.data.creep import read_creep as read_creep
from fitting.data.exclusion import exclude as exclude
from fitting.data.fields import ContactData as ContactData
from fitting.data.growth import GrowthData as GrowthData
from fitting.data.growth import read_growth as read_growth
from fitting.data.indentation import IndentationData as IndentationData
from fitting.data.indentation import read_force as read_force
from fitting.data.indentation import read_indentation as read_indentation
from fitting.data.moduli import OscillationData as OscillationData
from fitting.data.moduli import RelaxationData as RelaxationData
from fitting.data.moduli import read_oscillation as read_oscillation
from fitting.data.moduli import read_relaxation as read_relaxation
from fitting.data.stiffness import StiffnessData as StiffnessData
from fitting.data.stiffness import read_stiffness as read_stiffness
from fitting.data.sweeps import read_sweeps as read_sweeps
from fitting.fits.adhesion import AdhesiveFit as AdhesiveFit
from fitting.fits.cause import RelaxationCause as RelaxationCause
from fitting.fits.cause import relaxation_cause as relaxation_cause
from fitting.fits.compare import compare as compare
from fitting.fits.creep import BatchFit as BatchFit
from fitting.fits.creep import CreepFit as CreepFit
from fitting.fits.creep import fit_creep as fit_creep
from fitting.fits.creep import fit_creep_batch as fit_creep_batch
from fitting.fits.fields import FieldFit as FieldFit
from fitting.fits.fields import fit_fields as fit_fields
from fitting.fits.force import ForceFit as ForceFit
from fitting.fits.force import fit_force as fit_force
from fitting.fits.force_history import ViscoelasticForceFit as ViscoelasticForceFit
from fitting.fits.force_map import MapFit as MapFit
from fitting.fits.force_map import fit_map as fit_map
from fitting.fits.growth import GrowthFit as GrowthFit
from fitting.fits.growth import GrowthKinetics as GrowthKinetics
from fitting.fits.growth import RubbedContact as RubbedContact
from fitting.fits.growth import fit_growth as fit_growth
from fitting.fits.indentation import IndentationFit as IndentationFit
from fitting.fits.indentation import fit_indentation as fit_indentation
from fitting.fits.master import MasterFit as MasterFit
from fitting.fits.master import fit_master as fit_master
from fitting.fits.modulus import ModulusFit as ModulusFit
from fitting.fits.modulus import fit_oscillation as fit_oscillation
from fitting.fits.modulus import fit_relaxation as fit_relaxation
from fitting.fits.poroelastic import Poroelastic as Poroelastic
from fitting.fits.poroelastic import PoroelasticFit as PoroelasticFit
from fitting.fits.poroelastic import fit_poroelastic as fit_poroelastic
from fitting.fits.prony import MaxwellFit as MaxwellFit
from fitting.fits.prony import PronyFit as PronyFit
from fitting.fits.prony import fit_maxwell as fit_maxwell
from fitting.fits.prony import fit_prony as fit_prony
from fitting.fits.spectrum import SpectrumFit as SpectrumFit
from fitting.fits.spectrum import fit_spectrum as fit_spectrum
from fitting.fits.stiffness import StiffnessFit as StiffnessFit
from fitting.fits.stiffness import fit_stiffness as fit_stiffness
from fitting.fits.together import JointFit as JointFit
from fitting.fits.together import fit_together as fit_together
from fitting.inference.resampling import resample as resample
from fitting.inference.result import Comparison as Comparison
from fitting.models.thin_layer import thin_layer_factor as thin_layer_factor
from fitting.search.minimising import Minimum as Minimum
from fitting.search.minimising import minimise as minimise

__all__ = [
    "AdhesiveFit",
    "BatchFit",
    "Comparison",
    "ContactData",
    "CreepData",
    "CreepFit",
    "Design",
    "FieldFit",
    "ForceFit",
    "GrowthData",
    "GrowthFit",
    "GrowthKinetics",
    "IndentationData",
    "IndentationFit",
    "JointFit",
    "MapFit",
    "MasterFit",
    "MaxwellFit",
    "Minimum",
    "ModulusFit",
    "OscillationData",
    "Poroelastic",
    "PoroelasticFit",
    "Posterior",
    "PronyFit",
    "Propagated",
    "RelaxationCause",
    "RelaxationData",
    "RubbedContact",
    "SpectrumFit",
    "StiffnessData",
    "StiffnessFit",
    "ViscoelasticForceFit",
    "compare",
    "design",
    "exclude",
    "fit_creep",
    "fit_creep_batch",
    "fit_fields",
    "fit_force",
    "fit_growth",
    "fit_indentation",
    "fit_map",
    "fit_master",
    "fit_maxwell",
    "fit_oscillation",
    "fit_poroelastic",
    "fit_prony",
    "fit_relaxation",
    "fit_spectrum",
    "fit_stiffness",
    "fit_together",
    "minimise",
    "posterior",
    "propagate",
    "read_creep",
    "read_force",
    "read_growth",
    "read_indentation",
    "read_oscillation",
    "read_relaxation",
    "read_stiffness",
    "read_sweeps",
    "relaxation_cause",
    "resample",
    "thin_layer_factor",
]
