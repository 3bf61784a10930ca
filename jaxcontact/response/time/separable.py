"""The response in time as a sum of products: alpha N(alpha, t) ~ C_0(alpha) + sum_k C_k(alpha) f_k(t).

The decay rates of a layered body depend weakly on the wavenumber, through the stiffness c_j(alpha) of
``response.one_layer``: each lies in a band [rho(c_min), rho(c_max)]. Within a band

    exp(-rho t) ~ sum_m l_m(log rho) exp(-lambda_m t),

with l_m the Lagrange polynomials on Chebyshev nodes log lambda_m. All wavenumbers then share the rates
lambda_m, and the hereditary integral becomes a handful of fields

    eta_k' = p - lambda_k eta_k,      u = C_0 * p + sum_k lambda_k C_k * eta_k,

where an unlimited flow is lambda = 0 with the fluidity for lambda C. The film's own creep is one shape
in alpha for all its rates, so fields are mixed before they meet a kernel. For the paper's film one node
a band is good to 4e-8, two to 5e-11; for a film as stiff as its substrate two give 3e-4, three 8e-5.
"""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import replace
from jaxcontact.inputs.spectrum import Spectrum
from jaxcontact.response.base import Separable
from jaxcontact.response.half_space import own_creep

DEFAULT_NODES = 2
CHECK_TIMES = np.geomspace(1e-3, 1e2, 16)


def separate_bands(
    start: Array,
    film: Array,
    spectrum: Spectrum,
    amplitude: Array,
    rho: Array,
    nodes: int,
    exact: Callable[[Array], Array],
) -> Separable:
    """The separable form of start + film sum_i J_i (...) + sum_jk amplitude_jk (1 - exp(-rho_jk t)).

    start, film: (n,) over wavenumbers; spectrum: of the film; amplitude [1/Pa] and rho [1/s]: (n, elements,
    bands); nodes: rates a band, static; exact: the response at times (m, 1), to measure the error.
    """
    own_rates, fluidities = own_creep(spectrum)
    shapes, rates = [film], [own_rates]
    for k in range(rho.shape[-1]):
        common, flow = _band(rho[..., k], nodes)
        shapes += list(jnp.sum(amplitude[..., k] * flow, -1))
        rates.append(common)
    bands = jnp.eye(len(shapes) - 1)
    mix = jnp.zeros((len(shapes), own_rates.size + len(shapes) - 1))
    mix = mix.at[0, : own_rates.size].set(fluidities).at[1:, own_rates.size :].set(bands)
    own = jnp.append(spectrum.instantaneous, mix[0])
    result = Separable(jnp.concatenate(rates), jnp.stack([start, *shapes]), mix, own, jnp.zeros(()))
    return replace(result, error=separation_error(result, exact))


def _band(rho: Array, nodes: int) -> tuple[Array, Array]:
    """Common rates lambda_m, (nodes,), and lambda_m times the share l_m of each, (nodes, *rho.shape).

    A material that may flow but has no fluidity, or one too small for its rates to be normal numbers, has a band of
    zeros: it is kept as the one rate zero with rho itself, so that the derivative with respect to the fluidity is there.
    """
    least = float(np.finfo(float).tiny)
    still = jnp.max(rho) <= least
    log_rho = jnp.log(jnp.where(still, 1.0, jnp.maximum(rho, least)))
    low, high = jnp.min(log_rho), jnp.max(log_rho)
    middle, half = (low + high) / 2.0, jnp.maximum((high - low) / 2.0, 1e-6)
    points = np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes)
    xi = (log_rho - middle) / half
    common = jnp.exp(middle + half * points)
    each = jnp.stack([common[m] * _lagrange(points, m, xi) for m in range(nodes)])
    return jnp.where(still, 0.0, common), jnp.where(still, jnp.zeros_like(each).at[0].set(rho), each)


def _lagrange(points: np.ndarray, m: int, x: Array) -> Array:
    """The polynomial that is one at points[m] and zero at the others."""
    value = jnp.ones_like(x)
    for other in np.delete(points, m):
        value = value * (x - other) / (points[m] - other)
    return value


def separation_error(separable: Separable, exact: Callable[[Array], Array]) -> Array:
    """Largest relative deviation from the exact response at times spread around every rate."""
    times = check_times(separable.rates)[:, None]
    return jnp.max(jnp.abs(products(separable, separable.terms, times) / exact(times) - 1.0))


def check_times(rates: Array) -> Array:
    """Times [s] spread around every rate [1/s], zero without any."""
    positive = jnp.where(rates > 0.0, rates, jnp.max(rates, initial=1.0))
    return (jnp.asarray(CHECK_TIMES)[:, None] / positive).ravel() if rates.size else jnp.zeros(1)


def products(separable: Separable, terms: Array, times: Array) -> Array:
    """The sum of products at times (t, 1) of terms (M + 1, n) in the place of its own, (t, n)."""
    growth = times * phi1(times * separable.rates)
    return terms[0] + growth @ separable.mix.T @ terms[1:]
