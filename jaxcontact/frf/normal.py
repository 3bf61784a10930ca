"""Normal response of a layer bonded to a half-space, in the layer's modulus and in time.

For constant Poisson's ratios the response at wavenumber alpha is, in the layer's shear modulus g,

    alpha N(alpha; g) = B0/g + B1/(g + c1) + B2/(g + c2),     c_j = r_j Gs,  B_j, r_j >= 0.

It is the paper's Appendix A (u_z under p) in partial fractions. With x = alpha h, theta = exp(-2x),
kappa = 3 - 4 nu of the layer (c) and the substrate (s), G = g/Gs,

    N = (1 - nu_c)/(g alpha) (N0 + N1 G + N2 G^2)/(D0 + D1 G + D2 G^2),

where all N_i and D_i are sums of positive terms (``_polynomials``): nothing overflows, nothing
cancels. The compact forms usually printed lose up to 20 % for thin films and large contrasts.

Since only g depends on time, the elastic-viscoelastic correspondence principle turns each term into
a one-dimensional element, the layer's material in parallel with a spring c_j:

    1/(s (g(s) + c))  ->  J_c(t) = 1/(g0 + c) + sum_k a_k (1 - exp(-rho_k t)),

with rho_k the relaxation rates of the material with a compliance 1/c in series, and
a_k = 1/(c (1 + c h'(-rho_k))): again sums of positive terms only.
"""

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact import _checks
from jaxcontact._pytree import pytree
from jaxcontact.layers import LayeredHalfSpace, checked_body
from jaxcontact.materials import Spectrum, relaxation_rates

SERIES_BELOW = 0.7
QUADRATURE_NODES, QUADRATURE_WEIGHTS = np.polynomial.legendre.leggauss(5)


@pytree
class Modes:
    """alpha N = film/g + sum_j amplitude_j/(g + stiffness_j).

    film: B0, (...); amplitude: B_j, (..., 2), both without unit; stiffness: c_j [Pa], (..., 2).
    """

    film: Array
    amplitude: Array
    stiffness: Array


def _sinh_excess(y: Array) -> Array:
    """sinh(y) - y without cancellation, used below 2 SERIES_BELOW."""
    terms, power = jnp.zeros_like(y), y**3 / 6.0
    for n in range(2, 11):
        terms = terms + power
        power = power * y**2 / (2 * n * (2 * n + 1))
    return terms


def _differences(x: Array) -> tuple[Array, Array]:
    """f3 = 1 - theta^2 - 4 x theta and f4 = (1 - theta)^2 - 4 x^2 theta, exact for all x."""
    small = x < SERIES_BELOW
    low, high = jnp.where(small, x, SERIES_BELOW), jnp.where(small, SERIES_BELOW, x)
    theta = jnp.exp(-2.0 * low)
    f3 = 2.0 * theta * _sinh_excess(2.0 * low)
    f4 = 4.0 * theta * _sinh_excess(low) * (jnp.sinh(low) + low)
    theta = jnp.exp(-2.0 * high)
    g3 = -jnp.expm1(-4.0 * high) - 4.0 * high * theta
    g4 = jnp.expm1(-2.0 * high) ** 2 - 4.0 * high**2 * theta
    return jnp.where(small, f3, g3), jnp.where(small, f4, g4)


def _polynomials(
    x: Array, kc: Array | float, ks: Array | float
) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """(N0, N1, N2) and (D0, D1, D2) of the module's formula; kc, ks are the two kappas."""
    theta = jnp.exp(-2.0 * x)
    E1, E2 = -jnp.expm1(-2.0 * x), -jnp.expm1(-4.0 * x)
    f3, f4 = _differences(x)
    xt = 4.0 * x * theta
    D = (
        kc * (1.0 + theta**2) + (kc**2 + 1.0) * theta + x * xt,
        E1 * ((1.0 + kc * ks) + (kc + ks) * theta) + (ks - 1.0) * x * xt,
        ks * f4,
    )
    N = (
        (kc - 1.0) * E2 + f3,
        1.0 + kc * ks + (kc + ks) * theta**2 - xt * (ks - 1.0),
        ks * (E2 + xt),
    )
    return N, D


def _roots(c0: Array, c1: Array, c2: Array) -> tuple[Array, Array]:
    """The two positive roots of c0 - c1 r + c2 r^2 = 0, the smaller first, without cancellation.

    They meet for a thick layer when both solids are incompressible; a gap of 1e-10 is kept there, for
    the derivatives (the response itself does not feel it).
    """
    q = c1 + jnp.sqrt(jnp.maximum(c1**2 - 4.0 * c0 * c2, 1e-20 * c1**2))
    return 2.0 * c0 / q, q / (2.0 * c2)


def layer_modes(body: LayeredHalfSpace, wavenumber: Array) -> Modes:
    """The partial fractions of alpha N for one layer on an elastic substrate, wavenumber > 0 [rad/m]."""
    layer, substrate = body.layers[0], body.substrate
    nu_c, nu_s = layer.material.nu, substrate.nu
    Gs = 1.0 / substrate.spectrum().instantaneous
    (N0, N1, N2), (D0, D1, D2) = _polynomials(
        wavenumber * layer.thickness, 3.0 - 4.0 * nu_c, 3.0 - 4.0 * nu_s
    )
    r1, r2 = _roots(D0, D1, D2)
    z1, z2 = _roots(N0, N1, N2)  # the zeros interlace with the poles: z1 < r1 < z2 < r2
    lead = (1.0 - nu_c) * N2 / (D2 * (r2 - r1))
    B1 = lead * (r1 - z1) * (z2 - r1) / r1
    B2 = lead * (r2 - z1) * (r2 - z2) / r2
    return Modes((1.0 - nu_c) * N0 / D0, jnp.stack([B1, B2], -1), jnp.stack([r1, r2], -1) * Gs)


def parallel_creep(spectrum: Spectrum, stiffness: Array) -> tuple[Array, Array, Array]:
    """Creep of a material in parallel with springs c, J_c(t) = start + sum_k a_k (1 - exp(-rho_k t)).

    Returns start [1/Pa], (...); a [1/Pa], (..., m); rho [1/s], (..., m) for stiffness (...) [Pa].
    """
    c = stiffness[..., None]
    rho = relaxation_rates(spectrum, 1.0 / stiffness)
    amplitude = 1.0 / (c * (1.0 + c * spectrum.slope(-rho)))
    J0 = spectrum.instantaneous
    return J0 / (1.0 + stiffness * J0), amplitude, rho


def mean_decay(rate: Array, start: Array, end: Array) -> Array:
    """Mean of exp(-rate t) over start <= t <= end; its value where the two coincide."""
    z = rate * (end - start)
    small = z < 1e-5
    safe = jnp.where(small, 1.0, z)
    return jnp.exp(-rate * start) * jnp.where(small, 1.0 - z / 2.0 + z**2 / 6.0, -jnp.expm1(-safe) / safe)


def _mean_creep(spectrum: Spectrum, start: Array, end: Array) -> Array:
    """Mean of J(t) over an interval, times of any shape."""
    decay = mean_decay(spectrum.rates, start[..., None], end[..., None])
    flow = 0.0 if spectrum.fluidity is None else spectrum.fluidity * (start + end) / 2.0
    return spectrum.instantaneous + jnp.sum(spectrum.amplitudes * (1.0 - decay), -1) + flow


def scaled_response(body: LayeredHalfSpace, wavenumber: Array, start: Array, end: Array) -> Array:
    """alpha N [1/Pa]: mean over start <= t <= end [s] of the response to a pressure that steps on at t = 0.

    wavenumber [rad/m], start and end broadcast. At wavenumber 0 it is the substrate's
    (1 - nu) J, reached linearly; its derivative with respect to the wavenumber is given as zero there.
    """
    # not broadcast before the modes and rates are found: those are dear, and the same at all times
    wavenumber, start, end = (jnp.asarray(a, float) for a in (wavenumber, start, end))
    substrate = (1.0 - body.substrate.nu) * _mean_creep(body.substrate.spectrum(), start, end)
    if not body.layers:
        return substrate * jnp.ones_like(wavenumber)
    zero = wavenumber == 0.0
    modes = layer_modes(body, jnp.where(zero, 1.0 / body.layers[0].thickness, wavenumber))
    spectrum = body.layers[0].material.spectrum()
    first, amplitude, rho = parallel_creep(spectrum, modes.stiffness)
    decay = mean_decay(rho, start[..., None, None], end[..., None, None])
    springs = first + jnp.sum(amplitude * (1.0 - decay), -1)
    total = modes.film * _mean_creep(spectrum, start, end) + jnp.sum(modes.amplitude * springs, -1)
    return jnp.where(zero, substrate, total)


def quasi_elastic_response(body: LayeredHalfSpace, wavenumber: Array, start: Array, end: Array) -> Array:
    """As ``scaled_response``, but with 1/J(t) for the layer's modulus inside the elastic response.

    This is the paper's substitution of phi(t) for 1/(2G) (section 2.3). It is exact for a
    half-space, and within 2.5e-6 for the paper's film on steel; for a film as stiff as its substrate
    it is off by about 1 %. The mean over an interval is taken with five Gauss points.
    """
    wavenumber, start, end = jnp.broadcast_arrays(*(jnp.asarray(a, float) for a in (wavenumber, start, end)))
    if not body.layers:
        return scaled_response(body, wavenumber, start, end)
    zero = wavenumber == 0.0
    modes = layer_modes(body, jnp.where(zero, 1.0 / body.layers[0].thickness, wavenumber))
    t = (start + end)[..., None] / 2.0 + (end - start)[..., None] / 2.0 * QUADRATURE_NODES
    J = body.layers[0].material.creep(t)
    springs = J[..., None] / (1.0 + modes.stiffness[..., None, :] * J[..., None])
    values = modes.film[..., None] * J + jnp.sum(modes.amplitude[..., None, :] * springs, -1)
    mean = jnp.sum(values * QUADRATURE_WEIGHTS, -1) / 2.0
    return jnp.where(zero, scaled_response(body, jnp.zeros_like(start), start, end), mean)


def normal_response(body: LayeredHalfSpace, k: Array, t: Array | float = 0.0) -> Array:
    """N(k, t) [m/Pa]: normal surface displacement per unit pressure amplitude that steps on at t = 0.

    k [rad/m] and t [s] broadcast. At k = 0 the response of a half-space is infinite, and ``inf`` is
    what it returns, with zero derivative; k N stays finite (``frf.normal.scaled_response``).

    Raises ValueError for a body that cannot be computed, a negative k or a negative t.
    Source: the paper's Appendix A (u_z under p) with the correspondence principle of its section 2.3
    made exact.
    """
    body = checked_body(body)
    _checks.non_negative("k [rad/m]", k)
    _checks.non_negative("t [s]", t)
    k, t = jnp.asarray(k, float), jnp.asarray(t, float)
    safe = jnp.where(k == 0.0, 1.0, k)
    return jnp.where(k == 0.0, jnp.inf, scaled_response(body, safe, t, t) / safe)
