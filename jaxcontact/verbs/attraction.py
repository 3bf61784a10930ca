"""The scaled law of adhesion of an experiment over time, and its Tabor numbers."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.scale import Scale
from jaxcontact.contact.attraction import Attraction
from jaxcontact.indenters.shapes import Sphere
from jaxcontact.inputs.adhesion import Adhesion
from jaxcontact.response.limits import limits_of
from jaxcontact.verbs.experiment import Experiment


def attraction_of(law: Adhesion, experiment: Experiment, scale: Scale) -> Attraction:
    """Return a law of adhesion on the grid of an experiment, scaled."""
    return Attraction(law.scaled(scale.length, scale.compliance), experiment.grid.periodic)


def tabor_numbers(law: Adhesion, experiment: Experiment) -> Array:
    """Return the Tabor number of a ball with the compliance of the surface at each time, (nt,); nan without a ball."""
    times, indenter = experiment.times, experiment.indenter
    if not isinstance(indenter, Sphere):
        return jnp.full(times.shape, jnp.nan)
    compliance = limits_of(experiment.body).short_wave_compliance(times - times[0]) + indenter.compliance()
    return law.tabor_number(indenter.radius, 2.0 / compliance)
