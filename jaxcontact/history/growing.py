"""Memory of layers whose thickness changes in time: films that form or wear.

The displacement is remembered, and only what changes is answered by the layers as they are now, of thickness h(t):

    du = C_0(h) * dp + sum_k lambda_k C_k(h) * d eta_k,      eta_k' = p - lambda_k eta_k

(C_k, lambda_k and eta_k of ``history.recursive``; the rates do not depend on h). What is assumed:

- thickness changes alike everywhere, given in time, whatever the pressure;
- a change of thickness by itself moves nothing. What forms fits itself to the surface as it lies there, deformed and
  under pressure, and is not strained by the pressure under which it forms; what wears is a slice of the deformed
  film, of one thickness everywhere, and what it was shortened by is not given back;
- what forms creeps from then on as the film around it: it takes over the film's eta_k;
- displacement and approach are counted from the surface as the growth alone would have left it.

Over a step the layers are taken as they are in its middle, which is of second order in the step. Each step builds its
kernels, so that it costs many times that of a film that stays as it is; time still grows as the number of steps.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.exponential import ramps
from jaxcontact._support.pytree import pytree
from jaxcontact.history.memory import Memory, Prediction, deepest_strain
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.inputs.grid import Grid
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.operators.base import Operator
from jaxcontact.operators.kernels import Film, Kernels, build


class GrowthStep(NamedTuple):
    """dt [s], and the layers' thicknesses in the middle of the step [m], (layers,)."""

    dt: Array
    thicknesses: Array


class Grown(NamedTuple):
    """eta (K, nx, ny); displacement (nx, ny), both scaled; film: that of the last step's kernels."""

    eta: Array
    displacement: Array
    film: Film | None


class Coming(NamedTuple):
    """Between prediction and update: eta and displacement left by all earlier pressure, the step's operator and film."""

    eta: Array
    earlier: Array
    operator: Operator
    film: Film | None


@pytree
class GrowingMemory(Memory):
    """Increments over kernels built anew for each step; kernels: those of the first thicknesses."""

    body: LayeredHalfSpace
    indenter: Indenter
    grid: Grid
    kernels: Kernels

    def start(self, shape: tuple[int, int]) -> Grown:
        eta = jnp.zeros((self.kernels.rates.size, *shape))
        return Grown(eta, jnp.zeros(shape), jax.tree.map(jnp.zeros_like, self.kernels.film))

    def predict(self, fields: Grown, pressure: Array, step: GrowthStep) -> Prediction:
        k = build(self.body.with_thicknesses(step.thicknesses), self.indenter, self.grid)
        decay, old, new = ramps(self.kernels.rates * step.dt)
        eta = decay[:, None, None] * fields.eta + jnp.tensordot(step.dt * old, pressure, 0)
        change = jnp.tensordot(k.mix, eta - fields.eta, 1)
        earlier = fields.displacement + k.family.total(jnp.concatenate([-pressure[None], change]))
        operator = k.family.combined([1.0, *(k.mix @ (step.dt * new))])
        return Prediction(operator, earlier, Coming(eta, earlier, operator, k.film))

    def update(self, fields: Coming, pressure: Array, step: GrowthStep) -> Grown:
        new = step.dt * ramps(self.kernels.rates * step.dt)[2]
        displacement = fields.earlier + fields.operator(pressure)
        return Grown(fields.eta + jnp.tensordot(new, pressure, 0), displacement, fields.film)

    def observe(self, fields: Grown, pressure: Array, step: GrowthStep) -> dict[str, Array]:
        """The strain of a film that has always been as thick as in the middle of the step."""
        if fields.film is None:
            return {"film_strain": jnp.zeros(())}
        weights = fields.film.weights
        strain = weights[0] * pressure + jnp.tensordot(weights[1:], fields.eta, 1)
        return {"film_strain": deepest_strain(fields.film.coefficients, strain)}
