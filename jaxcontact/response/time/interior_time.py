"""Fields at a depth of a viscoelastic body after a history of tractions on its surface.

With a traction t that is linear between times t_n and steps on at the first, what is at a depth at the last time T is

    sum_n F_n * (t(t_n) - t(t_(n-1))),      F_n: the mean of F(alpha, lag) over T - t_n <= lag <= T - t_(n-1),

F the step responses of ``response.interior`` by the correspondence principle, on the contour of ``response.stack``; strain
is multiplied by the modulus there, so that no relaxation is left to be done. All F_n are nearly combinations of a few,

    F_n ~ sum_m shares_nm F_(n_m),

which a QR decomposition with column pivots picks, from some wavenumbers, so that the tractions of the past are mixed into
as many fields before they meet a kernel. Largest error of a function over lags and wavenumbers, of its largest value: the
paper's film 1e-11; two layers and a substrate that creep over nine decades 4e-10 for equal time steps, 6e-5 for lags from a
millionth of the time to all of it.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.response.interior import transfer
from jaxcontact.response.stack import compliances_on_contour, mean_in_time, spectra
from jaxcontact.response.time.rational import least_squares, pivots

KEPT = 16  # lags whose kernels stand for all,
SAMPLED = 32  # and wavenumbers by which they are picked


class Lags(NamedTuple):
    """Bounds [s] of how long ago the tractions changed, (nt,) each; None: now, so that the body is as stiff as at first."""

    start: Array
    end: Array


class KernelsAtLags(NamedTuple):
    """The kernels F of the module's formula at the picked lags.

    kernels: the functions of ``Transfer``, (13, M, n); shares (nt, M); exact: F_n at all lags, (nt, 13, s), at the
    wavenumbers of ``sampled``, by which errors are measured.
    """

    kernels: Array
    shares: Array
    exact: Array


def lags_before_the_last(times: Array) -> Lags:
    """Return the lags of the changes between times (nt,) [s]; the first change is the step at times[0]."""
    ago = times[-1] - times
    return Lags(ago, jnp.append(ago[:1], ago[:-1]))


def sampled(count: int) -> slice:
    """Return which of ``count`` wavenumbers those are at which all lags are computed, about ``SAMPLED`` of them."""
    return slice(None, None, -(-count // SAMPLED))


def kernels_at_lags(body: LayeredHalfSpace, wavenumber: Array, z: Array, lags: Lags | None) -> KernelsAtLags:
    """Return the kernels at wavenumbers (n,) [rad/m] for the depth z [m], ()."""
    some = sampled(wavenumber.size)
    if lags is None:
        kernels = _at_first(body, wavenumber, z)
        return KernelsAtLags(kernels[:, None], jnp.ones((1, 1)), kernels[None, :, some])
    exact = jax.lax.map(lambda lag: _mean(body, wavenumber[some], z, Lags(*lag)), tuple(lags))
    picked, shares = _mixing(exact)
    means = jax.lax.map(lambda n: _mean(body, wavenumber, z, Lags(lags.start[n], lags.end[n])), picked)
    return KernelsAtLags(jnp.moveaxis(means, 0, 1), shares, exact)


def _mixing(means: Array) -> tuple[Array, Array]:
    """Return the representative lags, (M,), and their shares in each lag, (nt, M), from means (nt, 13, n)."""
    count = means.shape[0]
    if count <= KEPT:
        return jnp.arange(count), jnp.eye(count)
    scale = jnp.max(jnp.abs(jax.lax.stop_gradient(means)), (0, 2), keepdims=True)
    rows = (means / jnp.where(scale > 0.0, scale, 1.0)).reshape(count, -1)
    picked = pivots(rows.T, KEPT)
    return picked, least_squares(rows[picked].T, rows.T).T


def _at_first(body: LayeredHalfSpace, wavenumber: Array, z: Array) -> Array:
    """The elastic response, (13, n)."""
    return jnp.stack(transfer(body, wavenumber, z, spectra(body).instantaneous[:, None]))


def _mean(body: LayeredHalfSpace, wavenumber: Array, z: Array, lag: Lags) -> Array:
    """The mean over one interval of lags, (13, n)."""

    def on_contour(t: Array) -> Array:
        soft = compliances_on_contour(body, t)[:, None]
        return jnp.stack(transfer(body, wavenumber[:, None], z, soft))

    return mean_in_time(on_contour, lag.start, lag.end)
