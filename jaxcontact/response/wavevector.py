"""All nine entries of the surface response at a wavevector."""

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.pytree import as_float64
from jaxcontact.inputs.layers import LayeredHalfSpace, checked_body
from jaxcontact.response.stack import SurfaceCompliance, all_steps


def frequency_response(body: LayeredHalfSpace, kx: Array, ky: Array, t: Array | float = 0.0) -> Array:
    """Return the displacement (x, y, z) of the surface per amplitude of a traction wave (x, y, z) applied as a step at t
    = 0.

    With alpha^2 = kx^2 + ky^2, c = kx/alpha, s = ky/alpha and the four functions L (in the plane of the
    wavevector), T (transverse), N (normal) and K (coupling) of ``response.stack``, each of (alpha, t),

            | L c^2 + T s^2    (L - T) c s      i K c |
        u = | (L - T) c s      L s^2 + T c^2    i K s | t
            | -i K c           -i K s           N     |

    for fields exp(i (kx x + ky y)), z into the body and tractions on the body: (sigma_xz, sigma_yz, sigma_zz) =
    -t, t_z the pressure. The matrix is Hermitian (reciprocity). For a half-space alpha (L, K, N, T) = J (1 - nu,
    1/2 - nu, 1 - nu, 1).

    Source: Wang et al., Tribology Letters 2025, doi 10.1007/s11249-025-01990-5, Appendix A, whose nine functions agree
    with these after correction of its misprints: Eq. (1) must read sigma_xz = -q_x (the functions are for a traction +q_x
    on the body); B-bar(2),m in R3 to R6 must be B(2),m; theta is exp(-2 alpha h), with nu_1, nu_2 those of coating and
    substrate. In their printed form they overflow for thick layers and lose all significant digits for
    thin ones; this function uses the recursion of ``response.stack``, whose relative error is 4e-14 at all times.

    At the wavevector zero the displacement of a half-space is unbounded, and the direction is undefined. The diagonal
    entries are then ``inf``, and the others 0, which is their mean over all directions; the derivatives are zero.

    Args:
        body: a ``LayeredHalfSpace``.
        kx, ky: components of the wavevector [rad/m], of shapes that broadcast.
        t: time [s], >= 0, of a shape that broadcasts with them.

    Returns:
        (..., 3, 3) complex [m/Pa], displacement first; nan where a value traced by jit or vmap is outside its range.

    Raises:
        ValueError: an invalid or unsupported body, a wavevector that is not finite, or a negative t.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> response = jc.frequency_response(glass, 1e6, 0.0)
        >>> response.shape, f"{response[1, 1].real * 1e6:.4e}"     # 1/G in the transverse direction
        ((3, 3), '3.3333e-11')
    """
    body, valid = checked_body(body)
    valid = valid & checks.finite("kx [rad/m]", kx) & checks.finite("ky [rad/m]", ky)
    valid = valid & checks.non_negative("t [s]", t)
    body, kx, ky, t = as_float64((body, kx, ky, t))
    return jnp.where(valid, _response(body, *jnp.broadcast_arrays(kx, ky, t)), jnp.nan)


@jax.jit
def _response(body: LayeredHalfSpace, kx: Array, ky: Array, t: Array) -> Array:
    at_zero = (kx == 0.0) & (ky == 0.0)
    kx = jnp.where(at_zero, 1.0, kx)
    alpha = jnp.hypot(kx, ky)
    response = _matrix(all_steps(body, alpha, t), kx / alpha, ky / alpha) / alpha[..., None, None]
    unbounded = jnp.where(jnp.eye(3, dtype=bool), jnp.inf, 0.0)
    return jnp.where(at_zero[..., None, None], unbounded, response)


def _matrix(compliance: SurfaceCompliance, c: Array, s: Array) -> Array:
    """Return alpha times the matrix of ``frequency_response``, (..., 3, 3)."""
    L, K, N, T = compliance
    rows = [
        [L * c**2 + T * s**2, (L - T) * c * s, 1j * K * c],
        [(L - T) * c * s, L * s**2 + T * c**2, 1j * K * s],
        [-1j * K * c, -1j * K * s, N],
    ]
    return jnp.stack([jnp.stack([entry + 0j for entry in row], -1) for row in rows], -2)
