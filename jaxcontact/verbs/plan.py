"""The march of an experiment: its stepper and its steps, and the fields of its result that are known beforehand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any, Self

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact._support.scale import Scale
from jaxcontact.history.march import Carry, Keep, Outcome, Stepper, Steps, march_from_rest
from jaxcontact.operators.kernels import Errors
from jaxcontact.results.contact import ContactHistory, ContactStep
from jaxcontact.results.notes import Diagnostics
from jaxcontact.verbs.setup import Options, Save

ENERGIES = "jump_energy", "viscous_energy"  # without derivatives, those of their units included


def fine_steps(times: Array, substeps: int) -> Array:
    """The inner steps [s], (nt, substeps); the first row has no length."""
    before = jnp.append(times[:1], times[:-1])
    return (times - before)[:, None] / substeps * jnp.ones(substeps)


def fine_values(values: Array, substeps: int) -> Array:
    """Return values (nt, ...) at the ends of the inner steps, (nt, substeps, ...), linear between times."""
    before = jnp.concatenate([values[:1], values[:-1]])
    share = (jnp.arange(1, substeps + 1) / substeps).reshape(-1, *[1] * (values.ndim - 1))
    return before[:, None] + (values - before)[:, None] * share


@pytree
class Plan:
    """A march to be made, and what its result is made of.

    steps: (nt, substeps, ...); errors: of the kernels; course, beside: fields of the result that are known beforehand, in
    SI, with and without a first axis of time; makes: the result of its fields; step: the argument of a ``save`` function.
    """

    stepper: Stepper
    steps: Steps
    scale: Scale
    errors: Errors
    course: dict[str, Array]
    beside: dict[str, Any]
    makes: Callable[..., ContactHistory] = static()
    step: type[ContactStep] = static()

    def to(
        self,
        makes: Callable[..., ContactHistory],
        step: type[ContactStep] = ContactStep,
        *,
        course: dict[str, Array] | None = None,
        beside: dict[str, Any] | None = None,
    ) -> Self:
        """Return the march to another result, with further fields that are known beforehand."""
        course, beside = self.course | (course or {}), self.beside | (beside or {})
        return replace(self, makes=makes, step=step, course=course, beside=beside)

    def marched(self, options: Options) -> ContactHistory:
        """Return the result of the whole march, with the fields that ``options.save`` keeps."""
        state, outcomes = march_from_rest(
            self.stepper, self.steps, self.kept(options.save), options.checkpoint
        )
        return self.result(outcomes, state.carry, state.last.fields)

    def kept(self, save: Save) -> Keep:
        """Return what a march keeps of an outcome: all of it, its numbers, or also the value of a function of it in SI."""
        if save == "all":
            return lambda outcome: outcome
        value = (lambda outcome: save(self.seen(outcome))) if callable(save) else lambda outcome: None
        return lambda outcome: outcome._replace(fields={}, saved=value(outcome))

    def seen(self, outcome: Outcome) -> ContactStep:
        """Return an outcome in SI, for a user's function."""
        profile = outcome.fields.get("moved_profile", self.stepper.profile)
        gap = profile + outcome.fields["displacement"] - outcome.numbers["approach"]
        in_si = self.scale.to_si(gap=gap, **outcome.fields, **outcome.numbers)
        known = {field.name for field in fields(self.step)} & in_si.keys()
        return self.step(**{name: in_si[name] for name in known})

    def result(
        self, outcomes: Outcome, carry: Carry, last: dict[str, Array], rows: slice = slice(None)
    ) -> ContactHistory:
        """Return the result for some rows from their outcomes; last: the fields where outcomes have none."""
        overall = {"profile": self.stepper.profile} | self.stepper.overall(carry.own)
        in_si = self.scale.to_si(**overall, **(outcomes.fields or last), **outcomes.numbers)
        in_si |= {name: jax.lax.stop_gradient(in_si[name]) for name in ENERGIES if name in in_si}
        course = {name: values[rows] for name, values in self.course.items()}
        told = Diagnostics(**self.stepper.told(carry.own))
        return self.makes(saved=outcomes.saved, diagnostics=told, **course, **self.beside, **in_si)
