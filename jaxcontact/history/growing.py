"""Memory of films whose thickness changes in time: films that form or wear, alike everywhere or not.

The displacement is remembered, and only what changes is answered by the layers as they are now, of thickness h(t):

    du = C_0(h) * dp + sum_k lambda_k C_k(h) * d eta_k,      eta_k' = p - lambda_k eta_k

(C_k, lambda_k and eta_k of ``history.recursive``; the rates do not depend on h). What is assumed:

- the thickness is given in time, whatever the pressure;
- a change of thickness by itself moves nothing. What forms fits itself to the surface as it lies there, deformed and
  under pressure, and is not strained by the pressure under which it forms; what wears is a slice of the deformed
  film, of one thickness everywhere, and what it was shortened by is not given back;
- what forms creeps from then on as the film around it: it takes over the film's eta_k;
- of layers that grow alike everywhere, displacement and approach are counted from the surface as the growth alone would
  have left it. Where the thickness varies in the plane growth raises the surface: displacement is that of the surface,
  elastic and viscous displacement less (h - h at first), and approach is counted from where the film is touched at first.

Over a step the layers are taken as they are in its middle, which is of second order in the step. For layers that grow alike
everywhere each step builds its kernels, so that it costs many times that of a film that stays as it is; for a film that
varies in the plane the kernels are a series in the thickness, made once. Time grows as the number of steps.
"""

import abc
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.exponential import ramps
from jaxcontact._support.pytree import pytree
from jaxcontact.history.memory import Memory, Prediction
from jaxcontact.history.step_error import Delayed
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.inputs.grid import Grid
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.operators.base import Operator
from jaxcontact.operators.film import Film, VaryingFilm
from jaxcontact.operators.kernels import Kernels, build
from jaxcontact.operators.thickness_kernels import VaryingKernels


class GrowthStep(NamedTuple):
    """dt [s], and the layers' thicknesses in the middle of the step [m], (layers,)."""

    dt: Array
    thicknesses: Array


class ThicknessStep(NamedTuple):
    """dt [s], and the thickness of a film that varies in the plane before and after the step [m], (nx, ny)."""

    dt: Array
    before: Array
    after: Array


class Grown(NamedTuple):
    """eta (K, nx, ny); displacement (nx, ny), both scaled; film and shares (``Delayed``): of the last step's kernels."""

    eta: Array
    displacement: Array
    film: Film | VaryingFilm | None
    shares: Array


class PredictedFields(NamedTuple):
    """Between prediction and update: eta and displacement left by all earlier pressure, the step's operator and kernels."""

    eta: Array
    earlier: Array
    operator: Operator
    kernels: Kernels


class IncrementalMemory(Memory):
    """The increments of the module over kernels that may be others at each step; rates (K,) [1/s]: those of all of them."""

    @property
    @abc.abstractmethod
    def rates(self) -> Array:
        """lambda_k [1/s], (K,)."""

    @abc.abstractmethod
    def kernels_at(self, step: Any) -> Kernels:
        """Return the kernels of the body as it is in the middle of a step."""

    def raised(self, step: Any) -> Array | float:
        """Return how far growth has raised the surface at the end of a step since the start, scaled."""
        return 0.0

    def predict(self, fields: Grown, pressure: Array, step: Any) -> Prediction:
        k = self.kernels_at(step)
        decay, old, new = ramps(self.rates * step.dt)
        eta = decay[:, None, None] * fields.eta + jnp.tensordot(step.dt * old, pressure, 0)
        change = jnp.tensordot(k.mix, eta - fields.eta, 1)
        earlier = fields.displacement + k.family.total(jnp.concatenate([-pressure[None], change]))
        operator = k.family.combined([1.0, *(k.mix @ (step.dt * new))])
        return Prediction(operator, earlier, PredictedFields(eta, earlier, operator, k), self.raised(step))

    def update(self, fields: PredictedFields, pressure: Array, step: Any) -> Grown:
        new = step.dt * ramps(self.rates * step.dt)[2]
        displacement = fields.earlier + fields.operator(pressure)
        kernels = fields.kernels
        shares = kernels.delayed_shares(jax.lax.stop_gradient(pressure))
        return Grown(fields.eta + jnp.tensordot(new, pressure, 0), displacement, kernels.film, shares)

    def delayed(self, fields: Grown, pressure: Array) -> Delayed:
        return Delayed(self.rates, fields.shares)

    def observe(self, fields: Grown, pressure: Array, step: Any) -> dict[str, Array]:
        """Return the strain of a film that has always been as thick as in the middle of the step."""
        if fields.film is None:
            return {"film_strain": jnp.zeros(())}
        return {"film_strain": fields.film.strain(pressure, fields.eta)}


@pytree
class GrowingMemory(IncrementalMemory):
    """Layers that grow alike everywhere, over kernels built anew for each step; kernels: those of the first thicknesses."""

    body: LayeredHalfSpace
    indenter: Indenter
    grid: Grid
    kernels: Kernels

    @property
    def rates(self) -> Array:
        return self.kernels.rates

    def start(self, shape: tuple[int, int]) -> Grown:
        eta = jnp.zeros((self.kernels.rates.size, *shape))
        return Grown(eta, jnp.zeros(shape), jax.tree.map(jnp.zeros_like, self.kernels.film), eta[:, 0, 0])

    def kernels_at(self, step: GrowthStep) -> Kernels:
        return build(self.body.with_thicknesses(step.thicknesses), self.indenter, self.grid)


@pytree
class VaryingMemory(IncrementalMemory):
    """A film whose thickness varies in the plane and in time; at_first: its thickness at the start [m], (nx, ny).

    What grows raises the surface, and what is worn away lowers it.
    """

    kernels: VaryingKernels
    at_first: Array

    @property
    def rates(self) -> Array:
        return self.kernels.uniform.rates

    def start(self, shape: tuple[int, int]) -> Grown:
        film = jax.tree.map(jnp.zeros_like, self.kernels.at(self.at_first).film)
        return Grown(jnp.zeros((self.rates.size, *shape)), jnp.zeros(shape), film, jnp.zeros(self.rates.size))

    def kernels_at(self, step: ThicknessStep) -> Kernels:
        return self.kernels.at((step.before + step.after) / 2.0)

    def raised(self, step: ThicknessStep) -> Array:
        return (step.after - self.at_first) / self.kernels.uniform.scale.length
