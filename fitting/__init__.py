"""Material parameters from creep and indentation data, with what the data can and cannot tell."""

import jaxcontact  # noqa: F401  # before jax, which reads what it sets when it is first imported
from fitting.batch import BatchFit as BatchFit
from fitting.batch import fit_creep_batch as fit_creep_batch
from fitting.bayes import Posterior as Posterior
from fitting.bayes import posterior as posterior
from fitting.creep import Comparison as Comparison
from fitting.creep import CreepFit as CreepFit
from fitting.creep import compare as compare
from fitting.creep import fit_creep as fit_creep
from fitting.data import CreepData as CreepData
from fitting.data import IndentationData as IndentationData
from fitting.indentation import IndentationFit as IndentationFit
from fitting.indentation import fit_indentation as fit_indentation
from fitting.minimising import Minimum as Minimum
from fitting.minimising import minimise as minimise
from fitting.modulus import ModulusFit as ModulusFit
from fitting.modulus import fit_oscillation as fit_oscillation
from fitting.modulus import fit_relaxation as fit_relaxation
from fitting.modulus_data import OscillationData as OscillationData
from fitting.modulus_data import RelaxationData as RelaxationData
from fitting.modulus_reader import read_oscillation as read_oscillation
from fitting.modulus_reader import read_relaxation as read_relaxation
from fitting.planning import Design as Design
from fitting.planning import design as design
from fitting.prony import PronyFit as PronyFit
from fitting.prony import fit_prony as fit_prony
from fitting.propagation import Propagated as Propagated
from fitting.propagation import propagate as propagate
from fitting.readers import read_creep as read_creep
from fitting.readers import read_indentation as read_indentation
from fitting.resampling import resample as resample
from fitting.together import JointFit as JointFit
from fitting.together import fit_together as fit_together

__all__ = [
    "BatchFit",
    "Comparison",
    "CreepData",
    "CreepFit",
    "Design",
    "IndentationData",
    "IndentationFit",
    "JointFit",
    "Minimum",
    "ModulusFit",
    "OscillationData",
    "Posterior",
    "PronyFit",
    "Propagated",
    "RelaxationData",
    "compare",
    "design",
    "fit_creep",
    "fit_creep_batch",
    "fit_indentation",
    "fit_oscillation",
    "fit_prony",
    "fit_relaxation",
    "fit_together",
    "minimise",
    "posterior",
    "propagate",
    "read_creep",
    "read_indentation",
    "read_oscillation",
    "read_relaxation",
    "resample",
]
