"""The response in time as a sum of products: alpha N(alpha, t) ~ C_0(alpha) + sum_k C_k(alpha) f_k(t).

The decay rates of a layered body depend weakly on the wavenumber, through the stiffness c_j(alpha) of
``frf.normal``: each lies in a band [rho(c_min), rho(c_max)]. Within a band

    exp(-rho t) ~ sum_m l_m(log rho) exp(-lambda_m t),

with l_m the Lagrange polynomials on Chebyshev nodes log lambda_m. All wavenumbers then share the rates
lambda_m, and the hereditary integral becomes a handful of fields

    eta_k' = p - lambda_k eta_k,      u = C_0 * p + sum_k lambda_k C_k * eta_k,

where an unlimited flow is lambda = 0 with the fluidity for lambda C. The film's own creep is one shape
in alpha for all its rates, so fields are mixed before they meet a kernel. For the paper's film one node
a band is good to 4e-8, two to 5e-11; for a film as stiff as
its substrate two give 3e-4, three 8e-5.
"""

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._pytree import pytree, replace
from jaxcontact.frf.normal import layer_modes, parallel_creep, scaled_response
from jaxcontact.layers import LayeredHalfSpace
from jaxcontact.materials import Spectrum

DEFAULT_NODES = 2
CHECK_TIMES = np.geomspace(1e-3, 1e2, 16)


@pytree
class SeparableResponse:
    """rates: lambda_k [1/s], (K,); terms: C_0 and M shapes S_m, (M + 1, n); mix: (M, K), so that

    lambda_k C_k = sum_m mix[m, k] S_m [1/(Pa s)]. The first shape is the material's own: a half-space's
    1 - nu, or the layer on a rigid base times its modulus, with its fluidities in mix[0].
    error: largest relative error of the sum of products, over wavenumbers and times, ().
    """

    rates: Array
    terms: Array
    mix: Array
    error: Array


def separate(body: LayeredHalfSpace, wavenumber: Array, nodes: int = DEFAULT_NODES) -> SeparableResponse:
    """The separable form at the given wavenumbers > 0, (n,) [rad/m].

    nodes: rates per band, static, 1 to 8; more for a film stiffer than its substrate.
    """
    own_rates, fluidities = _own(body.surface_material().spectrum())
    if not body.layers:
        own = (1.0 - body.substrate.nu) * jnp.ones_like(wavenumber)
        start = own * body.substrate.spectrum().instantaneous
        return SeparableResponse(own_rates, jnp.stack([start, own]), fluidities[None], jnp.zeros(()))
    modes = layer_modes(body, wavenumber)
    spectrum = body.layers[0].material.spectrum()
    first, amplitude, rho = parallel_creep(spectrum, modes.stiffness)
    start = modes.film * spectrum.instantaneous + jnp.sum(modes.amplitude * first, -1)
    shapes, rates = [modes.film], [own_rates]
    for k in range(rho.shape[-1]):
        common, flow = _band(rho[..., k], nodes)
        shapes += list(jnp.sum(modes.amplitude * amplitude[..., k] * flow, -1))
        rates.append(common)
    bands = jnp.eye(len(shapes) - 1)
    mix = jnp.zeros((len(shapes), own_rates.size + len(shapes) - 1))
    mix = mix.at[0, : own_rates.size].set(fluidities).at[1:, own_rates.size :].set(bands)
    result = SeparableResponse(jnp.concatenate(rates), jnp.stack([start, *shapes]), mix, jnp.zeros(()))
    return replace(result, error=_error(body, wavenumber, result))


def _own(spectrum: Spectrum) -> tuple[Array, Array]:
    """A material's own rates [1/s] and their fluidities J_i/tau_i [1/(Pa s)], unlimited flow last."""
    rates, fluidities = spectrum.rates, spectrum.amplitudes * spectrum.rates
    if spectrum.fluidity is None:
        return rates, fluidities
    return jnp.append(rates, 0.0), jnp.append(fluidities, spectrum.fluidity)


def _band(rho: Array, nodes: int) -> tuple[Array, Array]:
    """Common rates lambda_m, (nodes,), and lambda_m times the share l_m of each, (nodes, *rho.shape).

    A material that may flow but has no fluidity has a band of zeros: it is kept as the one rate zero with
    rho itself, so that the derivative with respect to the fluidity is there.
    """
    still = jnp.max(rho) == 0.0
    log_rho = jnp.log(jnp.where(still, 1.0, rho))
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


def _error(body: LayeredHalfSpace, wavenumber: Array, response: SeparableResponse) -> Array:
    """Largest relative deviation from the exact response at times spread around every rate."""
    positive = jnp.where(response.rates > 0.0, response.rates, jnp.max(response.rates, initial=1.0))
    times = (CHECK_TIMES[:, None] / positive).ravel() if response.rates.size else jnp.zeros(1)
    when = jnp.asarray(times)[:, None]
    exact = scaled_response(body, wavenumber, when, when)
    z = times[:, None] * response.rates
    small = z < 1e-8
    growth = times[:, None] * jnp.where(small, 1.0, -jnp.expm1(-z) / jnp.where(small, 1.0, z))
    separable = response.terms[0] + growth @ response.mix.T @ response.terms[1:]
    return jnp.max(jnp.abs(separable / exact - 1.0))
