"""Images: a response as a staircase in depth, built from the responses of half-spaces at depths below the surface.

A response alpha N(alpha) is written as

    alpha N = sum_j H_j (exp(-z_j alpha) - exp(-z_{j+1} alpha)),      z_0 = 0 < z_1 < ... < z_J < z_{J+1} = infinity.

Each exponential is the response of a half-space at a depth (an "image"), whose integral over a cell has a
closed form (``response.coefficients``). The first height is the limit of short waves and the last one the value
at wavenumber zero, both exact; the others are a damped linear least-squares fit. All results are therefore
differentiable in the response; depths and wavenumbers carry no derivative. Every other wavenumber
is fitted, and the error is measured at the rest.

Images must reach far below a film that is G times as stiff as its substrate: it bends under waves of
h G^(1/3), and its resistance to stretching has an effect up to h G. Largest measured errors relative to the response
over all wavenumbers and times, for films that creep fourfold: 3e-9 for G up to 10, 1e-7 at 1e3, 1e-6 at 1e6.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.custom_batching import sequential_vmap

from jaxcontact._support.pytree import pytree

# Linear least squares whose matrix carries no derivative, so that solutions are linear in the target.
#
# A batch of matrices (under ``jax.vmap``) is decomposed one after the other: jaxlib distributes a batch of
# decompositions over the threads that run the program and waits for them in one of those threads, so that two
# simultaneous batches on two cores deadlock (jaxlib 0.10.1).


class Decomposition(NamedTuple):
    """A singular value decomposition, matrix = left diag(values) right.

    left (n, m), values (m,) in descending order, right (m, m).
    """

    left: Array
    values: Array
    right: Array

    def truncated(self, target: Array, cutoff: float) -> Array:
        """Return the x (..., m) of least norm that minimises |matrix x - target|, targets (..., n).

        Singular values below ``cutoff`` times the largest are discarded.
        """
        kept = self.values > cutoff * self.values[0]
        return (
            jnp.where(kept, 1.0 / jnp.where(kept, self.values, 1.0), 0.0) * (target @ self.left) @ self.right
        )

    def normal(self, target: Array, cutoff: float) -> Array:
        """Return the x (m,) with matrix^T matrix x = target (m,), without the components that ``truncated`` discards."""
        kept = self.values > cutoff * self.values[0]
        return (
            jnp.where(kept, 1.0 / jnp.where(kept, self.values, 1.0), 0.0) ** 2 * (self.right @ target)
        ) @ self.right

    def damped(self, target: Array, damping: float) -> Array:
        """Return the x (..., m) that minimises |matrix x - target|^2 + damping^2 |x|^2, targets (..., n)."""
        return self.values / (self.values**2 + damping**2) * (target @ self.left) @ self.right


def decomposed(matrix: Array) -> Decomposition:
    """Return the decomposition of a matrix (n, m), n >= m."""
    return _one_by_one(jax.lax.stop_gradient(matrix))


@sequential_vmap
def _one_by_one(matrix: Array) -> Decomposition:
    return Decomposition(*jnp.linalg.svd(matrix, full_matrices=False))


IMAGES = 64
NODES = 501
LONGEST, SHORTEST = 1e-10, 40.0  # range of alpha h in which a response is fitted
BEYOND = 1e5  # alpha h at which every image has decayed
SPARSE = 4.0  # factor of the logarithmic spacing of depths beyond the longest bending wave
# response relative to that to shorter waves, below which it is not what its error is relative to
FAINT = 1e-6
DAMPING = 1e-13  # of the heights, relative to the expected response


@pytree
class Images:
    """The depths and heights of a fitted response.

    depths: z_1 to z_J [m], (J,); heights: H_0 to H_J, (..., J + 1), in 1/Pa or the unit of the response.
    """

    depths: Array
    heights: Array

    def at(self, wavenumber: Array) -> Array:
        """Return the response at wavenumbers (n,) [rad/m], (..., n)."""
        return self.heights @ staircase(self.depths, wavenumber).T


@pytree
class Ladder:
    """The wavenumbers and depths of a fit, and the sizes to which its errors are relative.

    wavenumbers: (n,) [rad/m], zero first and the limit of short waves last; depths: (J,) [m]; at_nodes, (n - 2,),
    and at_steps, (J - 1,): expected size of the response at the wavenumbers between the ends, and at about
    1/depth, in its own unit; errors are relative to it.
    """

    wavenumbers: Array
    depths: Array
    at_nodes: Array
    at_steps: Array


def fit_wavenumbers(thinnest: Array | float, whole: Array | float) -> Array:
    """Return zero, wavenumbers [rad/m] from far below 1/(all layers) to far above 1/(top layer), and the short-wave
    limit, (n,).
    """
    return jnp.concatenate(
        [
            jnp.zeros(1),
            log_spaced(LONGEST / whole, SHORTEST / thinnest, NODES),
            jnp.full(1, BEYOND / thinnest),
        ]
    )


def log_spaced(low: Array | float, high: Array | float, count: int) -> Array:
    """Return points evenly spaced in their logarithm, (count,)."""
    return jnp.asarray(low) * (high / low) ** np.linspace(0.0, 1.0, count)


def image_depths(first: Array | float, bent: Array, last: Array) -> Array:
    """Return depths from the first on, densely spaced up to ``bent`` and sparsely from there to the last, (IMAGES,)."""
    first, bent, last = (jnp.log(a) for a in (jnp.asarray(first), bent, jnp.maximum(bent, last)))
    dense, sparse = bent - first, (last - bent) / SPARSE
    position = jnp.linspace(0.0, dense + sparse, IMAGES)
    return jnp.exp(first + jnp.minimum(position, dense) + SPARSE * jnp.maximum(position - dense, 0.0))


def staircase(depths: Array, wavenumber: Array) -> Array:
    """Return exp(-z_j alpha) - exp(-z_{j+1} alpha), (n, J + 1)."""
    upper = jnp.exp(-wavenumber[:, None] * jnp.append(0.0, depths))
    within = -jnp.expm1(-wavenumber[:, None] * jnp.diff(depths, prepend=0.0))
    return upper * jnp.append(within, jnp.ones((wavenumber.size, 1)), 1)


def fit_images(values: Array, ladder: Ladder, damping: float = DAMPING) -> Images:
    """Return the least-squares images of responses alpha N at the ladder's wavenumbers, (..., n)."""
    ladder = jax.lax.stop_gradient(ladder)
    relative = staircase(ladder.depths, ladder.wavenumbers[1:-1:2])
    at_nodes, at_steps = ladder.at_nodes[::2], ladder.at_steps
    last, first = values[..., :1], values[..., -1:]
    matrix = relative[:, 1:-1] * at_steps / at_nodes[:, None]
    rest = (values[..., 1:-1:2] - first * relative[:, 0] - last * relative[:, -1]) / at_nodes
    between = decomposed(matrix).damped(rest, damping) * at_steps
    heights = jnp.concatenate([first, between, last], -1)
    return Images(ladder.depths, heights)


def expected_sizes(values: Array) -> Array:
    """Return responses (..., n) at growing wavenumbers, at least ``FAINT`` of those to shorter waves."""
    return jnp.maximum(values, FAINT * jax.lax.cummax(values, axis=values.ndim - 1, reverse=True))


def image_errors(fitted: Array, values: Array) -> Array:
    """Return the largest relative errors at the wavenumbers that were not fitted, (...); zero if there are none.

    fitted and values: (..., n) at the wavenumbers of a ladder. Errors are relative to the values, and where these are less
    than ``FAINT`` of those to shorter waves, as for a layer on a rigid base, to that.
    """
    sizes = expected_sizes(values)
    error = (fitted[..., 2:-1:2] - values[..., 2:-1:2]) / sizes[..., 2:-1:2]
    return jnp.max(jnp.abs(error), -1, initial=0.0)


# Images as sums of Gaussians, which are products of factors for x, y and the depth.
#
# With t = exp(v), the response of an image at depth z at a distance (x, y) is
#
#     1/sqrt(x^2 + y^2 + z^2) = 1/(2 sqrt(pi)) int_{-inf}^{inf} t^(-1/2) exp(-(x^2 + y^2 + z^2)/(4 t)) dv,
#
# and each factor has a closed form over a cell,
#
#     int_{x1}^{x2} exp(-x^2/(4 t)) dx = sqrt(pi t) (erf(x2/(2 sqrt t)) - erf(x1/(2 sqrt t))).
#
# So the steps between images are ``staircase`` at z^2 for the depth and 1/(4 t) for the
# wavenumber. The trapezoidal rule in v converges geometrically: its relative error is exp(-pi^2/step), 1e-13 at a
# step of 0.33 and 1e-17 at one of 0.25. This accuracy is needed because the heights of a stiff film alternate in
# sign, with magnitudes up to 1e10 times the first.


POINTS = 384
NEGLECTED = 1e-15  # smallest length represented, relative to a cell


def over_cells(n: int, t: Array, width: Array | float = 1.0) -> Array:
    """Return the integral of exp(-x^2/(4 t)) over each of n cells of a width, the first centred at x = 0, (n, points)."""
    root = 2.0 * jnp.sqrt(t) / width
    upper = jax.scipy.special.erf((jnp.arange(n) + 0.5)[:, None] / root)
    return jnp.sqrt(jnp.pi * t) * jnp.diff(upper, axis=0, prepend=-upper[:1])
