"""The response in time as a sum of products: alpha N(alpha, t) ~ C_0(alpha) + sum_k C_k(alpha) f_k(t).

The decay rates of a layered body depend weakly on the wavenumber, through the stiffness c_j(alpha) of
``frf.normal``: each lies in a band [rho(c_min), rho(c_max)]. Within a band

    exp(-rho t) ~ sum_m l_m(log rho) exp(-lambda_m t),

with l_m the Lagrange polynomials on Chebyshev nodes log lambda_m. All wavenumbers then share the rates
lambda_m, and the hereditary integral becomes a handful of fields

    eta_k' = p - lambda_k eta_k,      u = C_0 * p + sum_k lambda_k C_k * eta_k,

where an unlimited flow is lambda = 0 with the fluidity for lambda C. For the paper's film one node a
band is good to 4e-8, three to 1e-13; for a film as stiff as its substrate three give 6e-5.
"""

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._pytree import pytree
from jaxcontact.frf.normal import layer_modes, parallel_creep, scaled_response
from jaxcontact.layers import LayeredHalfSpace

DEFAULT_NODES = 3
CHECK_TIMES = np.geomspace(1e-3, 1e2, 16)


@pytree
class SeparableResponse:
    """rates: lambda_k [1/s], (K,); terms: C_0 [1/Pa] and lambda_k C_k [1/(Pa s)], (K + 1, n).

    film: alpha N of the layer alone on a rigid base, times its modulus, (n,); None without a layer.
    error: largest relative error of the sum of products, over wavenumbers and times, ().
    """

    rates: Array
    terms: Array
    film: Array | None
    error: Array


def separate(body: LayeredHalfSpace, wavenumber: Array, nodes: int = DEFAULT_NODES) -> SeparableResponse:
    """The separable form at the given wavenumbers > 0, (n,) [rad/m].

    nodes: rates per band, static, 1 to 8; more for a film stiffer than its substrate.
    """
    if not body.layers:
        return _half_space(body, wavenumber)
    modes = layer_modes(body, wavenumber)
    spectrum = body.layers[0].material.spectrum()
    first, amplitude, rho = parallel_creep(spectrum, modes.stiffness)
    start = modes.film * spectrum.instantaneous + jnp.sum(modes.amplitude * first, -1)
    own = [modes.film * J * rate for J, rate in zip(spectrum.amplitudes, spectrum.rates, strict=True)]
    rates = [spectrum.rates]
    if spectrum.fluidity is not None:
        own.append(modes.film * spectrum.fluidity)
        rates.append(jnp.zeros(1))
    for k in range(rho.shape[-1]):
        common, share = _band(rho[..., k], nodes)
        own += list(common[:, None] * jnp.sum(modes.amplitude * amplitude[..., k] * share, -1))
        rates.append(common)
    result = SeparableResponse(jnp.concatenate(rates), jnp.stack([start, *own]), modes.film, jnp.zeros(()))
    return SeparableResponse(result.rates, result.terms, modes.film, _error(body, wavenumber, result))


def _half_space(body: LayeredHalfSpace, wavenumber: Array) -> SeparableResponse:
    """No layer: alpha N = (1 - nu) J(t) at every wavenumber, separable as it stands."""
    spectrum = body.substrate.spectrum()
    flow = jnp.zeros(0) if spectrum.fluidity is None else spectrum.fluidity[None]
    weights = [spectrum.instantaneous[None], spectrum.amplitudes * spectrum.rates, flow]
    terms = (1.0 - body.substrate.nu) * jnp.concatenate(weights)
    rates = jnp.concatenate([spectrum.rates, jnp.zeros_like(flow)])
    return SeparableResponse(rates, terms[:, None] * jnp.ones_like(wavenumber), None, jnp.zeros(()))


def _band(rho: Array, nodes: int) -> tuple[Array, Array]:
    """Common rates, (nodes,), and the share l_m of each in exp(-rho t), (nodes, *rho.shape)."""
    log_rho = jnp.log(rho)
    low, high = jnp.min(log_rho), jnp.max(log_rho)
    middle, half = (low + high) / 2.0, jnp.maximum((high - low) / 2.0, 1e-6)
    points = np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes)
    xi = (log_rho - middle) / half
    return jnp.exp(middle + half * points), jnp.stack([_lagrange(points, m, xi) for m in range(nodes)])


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
    separable = response.terms[0] + growth @ response.terms[1:]
    return jnp.max(jnp.abs(separable / exact - 1.0))
