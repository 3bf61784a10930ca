"""Force curve of an elastic sample: baseline, contact point and indentation, scaled for the search.

    force = G size d^p f(d)/(1 - nu) + baseline + tilt t,     d = max(depth - contact point, 0)

size and p of the indenter are those of ``data/probe.py``, and f is the factor of a thin layer (``thin_layer.py``), 1 on a
half-space. On an elastic base f depends on G as well; its series is linear in log G about a value of the search, which is
repeated until it stays. In scaled form G size/((1 - nu) load unit) depth unit^p = 1/J.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from fitting.models.thin_layer import ThinLayer

PARTS = ("contact_point", "baseline", "tilt")  # coordinates after the two compliances


class ForceCurve(NamedTuple):
    """Scaled samples (n,) of an approach: t, depth, load and weights; power of the depth; layer in scaled depths;
    extra: compliance of the indenter over 1 - nu, scaled; rise: derivative of the layer's series with respect to log G on
    an elastic base, 0 on a rigid one; at: log J at which the series holds."""

    t: Array
    depth: Array
    load: Array
    weights: Array
    power: Array | float
    layer: ThinLayer
    extra: Array | float
    rise: Array | float = 0.0
    at: Array | float = 0.0


def indentation_force(theta: Array, depth: Array, curve: ForceCurve) -> Array:
    """Return the scaled force without the baseline at scaled depths from contact on, of any shape."""
    inside = depth > 0.0
    safe = jnp.where(inside, depth, 1.0)
    layer = curve.layer._replace(series=curve.layer.series + curve.rise * (curve.at - theta[0]))
    force = safe**curve.power * layer.factor(safe) / (jnp.exp(theta[0]) + curve.extra)
    return jnp.where(inside, force, 0.0)


@jax.jit
def residuals(theta: Array, curve: ForceCurve) -> Array:
    """Return the weighted force of the model minus the measured one, (n,); theta = (log J, 0, *``PARTS``)."""
    model = indentation_force(theta, curve.depth - theta[2], curve) + theta[3] + theta[4] * curve.t
    return curve.weights * (model - curve.load)


@jax.jit
def slopes(theta: Array, curve: ForceCurve) -> Array:
    """Return the derivative (n, 5) of the residuals."""
    return jax.jacfwd(residuals)(theta, curve)


@jax.jit
def unit_forces(points: Array, curve: ForceCurve) -> Array:
    """Return the scaled indentation forces (k, n) at J = 1 for trial contact points (k,)."""
    return jax.vmap(lambda point: indentation_force(jnp.zeros(1), curve.depth - point, curve))(points)
