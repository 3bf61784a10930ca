"""The direct superposition of all earlier steps: the oracle of the recursion, and the paper's method.

    u(t_n) = sum_{j <= n} Kbar(n, j) * (p_j - p_{j-1}),

with Kbar(n, j) the mean of the kernel K(t_n - s) over t_{j-1} <= s <= t_j: exact for a pressure linear
over each step. Time and memory grow with the square and the first power of the number of steps.
Each kernel is a weighted sum of the same images, so only their weights depend on (n, j).
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.history.memory import Memory, Prediction
from jaxcontact.history.step_error import Delayed
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.operators.film import deepest_strain
from jaxcontact.operators.kernels import ImageKernels, image_weights
from jaxcontact.response.limits import limits_of


@pytree
class LagRow:
    """One step n of the tables: its index, the image weights (n_steps, J) and the film's J (n_steps,)."""

    index: Array
    weights: Array
    film: Array


@pytree
class DirectMemory(Memory):
    """Fields: the pressure increments of all steps, (n_steps, nx, ny); step: a ``LagRow``; surface: the delayed
    compliance of the material at the surface."""

    images: ImageKernels
    n_steps: Array  # an array of that length, for its shape alone
    surface: Delayed

    def start(self, shape: tuple[int, int]) -> Array:
        return jnp.zeros((self.n_steps.shape[0], *shape))

    def predict(self, increments: Array, pressure: Array, row: LagRow) -> Prediction:
        """Return the prediction; the kernel of the present step acts on the whole new pressure, so the old one is taken
        back."""
        now = row.weights[row.index]
        past = jnp.where(jnp.arange(self.n_steps.shape[0])[:, None] <= row.index, row.weights, 0.0)
        earlier = self.images.family.total(
            jnp.tensordot(past.T, increments, 1) - now[:, None, None] * pressure
        )
        operator = self.images.family.combined(list(now))
        return Prediction(operator, earlier, increments.at[row.index].add(-pressure))

    def update(self, increments: Array, pressure: Array, row: LagRow) -> Array:
        return increments.at[row.index].add(pressure)

    def delayed(self, increments: Array, pressure: Array) -> Delayed:
        return self.surface

    def observe(self, increments: Array, pressure: Array, row: LagRow) -> dict[str, Array]:
        if self.images.film_coefficients is None:
            return {"film_strain": jnp.zeros(())}
        strain = jnp.tensordot(row.film, increments, 1) / self.images.scale.compliance
        return {"film_strain": deepest_strain(self.images.film_coefficients, strain)}


def rows(body: LayeredHalfSpace, indenter: Indenter, times: Array, *, quasi_elastic: bool) -> LagRow:
    """The tables for all steps, stacked: weights (n, n, J) and film (n, n); zero where j > n."""
    before = jnp.append(times[:1], times[:-1])
    start = jnp.maximum(times[:, None] - times[None, :], 0.0)
    end = jnp.maximum(times[:, None] - before[None, :], 0.0)
    weights = image_weights(body, indenter, start, end, quasi_elastic=quasi_elastic)
    limits, n = limits_of(body), times.shape[0]
    film = jnp.zeros((n, n))
    if limits.film is not None:
        film = jnp.tril(limits.film_creep().mean_creep(start, end))
    return LagRow(jnp.arange(n), weights, film)
