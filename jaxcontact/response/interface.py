"""The interface of a body's response to a pressure wave, as a function of wavenumber and time.

``Response`` has one class for each kind of formula: ``normal.HalfSpace``, ``one_layer``, and ``in_time`` for stacks.
``Separable`` is the form that the march in time needs.
"""

import abc

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import pytree
from jaxcontact.response.images import Images

QUADRATURE_NODES, QUADRATURE_WEIGHTS = np.polynomial.legendre.leggauss(5)  # for means over a time interval
DEFAULT_NODES = 2  # decay rates a band
CHECK_TIMES = np.geomspace(1e-3, 1e2, 16)  # over 1/rate: where errors are measured


@pytree
class Separable:
    """The response alpha N(alpha, t) as a sum of products of functions of wavenumber and of time.

    At the wavenumbers of the response,

        u = C_0 * p + sum_k lambda_k C_k * eta_k,     eta_k' = p - lambda_k eta_k,
        lambda_k C_k = sum_m mix[m, k] S_m [1/(Pa s)].

    rates: lambda_k [1/s], (K,), zero for steady-state viscous flow; terms: C_0 and M shapes S_m, (M + 1, n); mix: (M, K).
    S_1 is that of the top layer on a rigid base (of a half-space: a number), and own_factors its factors: at once [1/Pa]
    and, as in mix, for each rate [1/(Pa s)], (K + 1,). error: the largest relative error of the sum of products, over
    wavenumbers and over times up to the horizon, (); horizon: the latest time for which the sum is valid [s], (), inf if
    there is no limit.
    """

    rates: Array
    terms: Array
    mix: Array
    own_factors: Array
    error: Array
    horizon: Array | float = float("inf")


def relative_errors(found: Array, exact: Array) -> Array:
    """Return |found - exact|/exact, zero where both are zero, as of a body that cannot be compressed on a rigid base."""
    return jnp.abs(found - exact) / jnp.where(exact == 0.0, 1.0, exact)


def check_times(rates: Array) -> Array:
    """Times [s] spread around every rate [1/s], zero without any."""
    positive = jnp.where(rates > 0.0, rates, jnp.max(rates, initial=1.0))
    return (jnp.asarray(CHECK_TIMES)[:, None] / positive).ravel() if rates.size else jnp.zeros(1)


def products(separable: Separable, terms: Array, times: Array) -> Array:
    """The sum of products at times (t, 1) of terms (M + 1, n) in the place of its own, (t, n)."""
    growth = times * phi1(times * separable.rates)
    return terms[0] + growth @ separable.mix.T @ terms[1:]


class Response(abc.ABC):
    """The normal response of one kind of body: alpha N(alpha, t) [1/Pa], N = displacement/pressure.

    The pressure is a unit step at t = 0; ``start`` and ``end`` [s] are the limits of a mean over time.
    """

    @abc.abstractmethod
    def mean_response(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return the mean of alpha N over start <= t <= end; arguments broadcast; wavenumber >= 0 [rad/m].

        At wavenumber zero it is that of the substrate alone, with zero derivative with respect to the wavenumber. On a
        rigid base it is there the displacement under a uniform pressure over that and over the thickness of all layers.
        """

    @abc.abstractmethod
    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return ``mean_response`` with 1/J(t) in place of moduli in the elastic response (the paper, section 2.3)."""

    @abc.abstractmethod
    def wavenumbers(self) -> Array:
        """Return the wavenumbers at which ``expand`` needs the response, (n,) [rad/m]; they carry no derivative."""

    @abc.abstractmethod
    def separate(self, nodes: int) -> Separable:
        """Return the sum of products with ``nodes`` decay rates per band, static."""

    @abc.abstractmethod
    def expand(self, values: Array) -> Images:
        """Return images of responses given at ``wavenumbers``, (..., n) [any unit]; errors are relative to the
        response."""

    @abc.abstractmethod
    def expand_shapes(self, start: Array, film: Array, rest: Array) -> Images:
        """Return images, at the depths of ``expand``, of C_0, of the top layer's shape S_1 and of the other S_m.

        Each has a first axis, (m, n) with m >= 0; the heights are in that order, (M, J + 1).
        """

    def expand_separable(self, separable: Separable) -> Images:
        """Return images of C_0 and of all shapes of ``separate``, heights (M + 1, J + 1)."""
        return self.expand_shapes(separable.terms[:1], separable.terms[1:2], separable.terms[2:])
