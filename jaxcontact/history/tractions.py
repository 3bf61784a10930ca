"""The memory of tractions: the recursion of ``history.recursive`` in three directions.

    u = C_0 * t + sum_k lambda_k C_k * eta_k,      eta_k' = t - lambda_k eta_k,      t = (q_x, q_y, p).

The normal displacement under the pressure keeps the rates, fields and kernels that it has in ``indent``; all that the
tangential kernels touch has rates and fields of its own.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.exponential import ramps
from jaxcontact._support.pytree import pytree
from jaxcontact.history.memory import Memory, Prediction
from jaxcontact.history.recursive import RecursiveMemory
from jaxcontact.history.step_error import Delayed
from jaxcontact.operators.coupled import Coupled
from jaxcontact.operators.traction_kernels import TractionKernels


class TractionFields(NamedTuple):
    """pressure: of ``RecursiveMemory``, (K, nx, ny); traction: eta of (q_x, q_y, p), (K', 3, nx, ny)."""

    pressure: Array
    traction: Array


@pytree
class TractionMemory(Memory):
    """Exact exponential recursion for tractions (3, nx, ny) of q_x, q_y and p; fields: ``TractionFields``; step: dt [s]."""

    kernels: TractionKernels

    @property
    def normal(self) -> RecursiveMemory:
        """The memory of the pressure alone."""
        return RecursiveMemory(self.kernels.normal)

    def start(self, shape: tuple[int, int]) -> TractionFields:
        return TractionFields(self.normal.start(shape), jnp.zeros((self.kernels.rates.size, 3, *shape)))

    def predict(self, fields: TractionFields, traction: Array, dt: Array) -> Prediction:
        k = self.kernels
        pressed = self.normal.predict(fields.pressure, traction[2], dt)
        decay, old, new = ramps(k.rates * dt)
        eta = decay[:, None, None, None] * fields.traction + jnp.tensordot(dt * old, traction, 0)
        mixed = jnp.tensordot(k.mix, eta, 1)
        operator = k.family.combined(jnp.append(1.0, k.mix @ (dt * new)))
        normal = pressed.earlier + k.family.normal_from_earlier(mixed)
        earlier = jnp.concatenate([k.family.tangential_from_earlier(mixed), normal[None]])
        return Prediction(Coupled(pressed.operator, operator), earlier, TractionFields(pressed.fields, eta))

    def update(self, fields: TractionFields, traction: Array, dt: Array) -> TractionFields:
        new = dt * ramps(self.kernels.rates * dt)[2]
        pressure = self.normal.update(fields.pressure, traction[2], dt)
        return TractionFields(pressure, fields.traction + jnp.tensordot(new, traction, 0))

    def delayed(self, fields: TractionFields, pressure: Array) -> Delayed:
        return self.normal.delayed(fields.pressure, pressure)

    def observe(self, fields: TractionFields, traction: Array, dt: Array) -> dict[str, Array]:
        return self.normal.observe(fields.pressure, traction[2], dt)
