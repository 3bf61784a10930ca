"""The interface of a body's response to a pressure wave, as a function of wavenumber and time."""

import abc

import numpy as np
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.response.influence.images import Images

QUADRATURE_NODES, QUADRATURE_WEIGHTS = np.polynomial.legendre.leggauss(5)  # for means over a time interval


@pytree
class Separable:
    """The response alpha N(alpha, t) as a sum of products of functions of wavenumber and of time.

    At the wavenumbers of the response,

        u = C_0 * p + sum_k lambda_k C_k * eta_k,     eta_k' = p - lambda_k eta_k,
        lambda_k C_k = sum_m mix[m, k] S_m [1/(Pa s)].

    rates: lambda_k [1/s], (K,), zero for steady-state viscous flow; terms: C_0 and M shapes S_m, (M + 1, n); mix: (M, K).
    film: the factors of the first shape, that of the film on a rigid base (for a half-space, a number): at once [1/Pa] and,
    as in mix, for each rate [1/(Pa s)], (K + 1,). error: the largest relative error of the sum of products, over
    wavenumbers and over times up to the horizon, (); horizon: the latest time for which the sum is valid [s], (), inf if
    there is no limit.
    """

    rates: Array
    terms: Array
    mix: Array
    film: Array
    error: Array
    horizon: Array | float = float("inf")


class Response(abc.ABC):
    """The normal response of one kind of body: alpha N(alpha, t) [1/Pa], N = displacement/pressure.

    The pressure is a unit step at t = 0; ``start`` and ``end`` [s] are the limits of a mean over time.
    """

    @abc.abstractmethod
    def step(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return the mean of alpha N over start <= t <= end; arguments broadcast; wavenumber >= 0 [rad/m].

        At wavenumber zero it is that of the substrate alone, with zero derivative with respect to the wavenumber.
        """

    @abc.abstractmethod
    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return ``step`` with 1/J(t) in place of moduli in the elastic response (the paper, section 2.3)."""

    @abc.abstractmethod
    def wavenumbers(self) -> Array:
        """Return the wavenumbers at which ``expand`` needs the response, (n,) [rad/m]; they carry no derivative."""

    @abc.abstractmethod
    def separate(self, nodes: int) -> Separable:
        """Return the sum of products with ``nodes`` decay rates per band, static."""

    @abc.abstractmethod
    def expand(self, values: Array) -> Images:
        """Return images of responses given at ``wavenumbers``, (..., n) [any unit], with errors relative to ``step``."""

    @abc.abstractmethod
    def expand_shapes(self, shapes: Array) -> Images:
        """Return images, at the depths of ``expand``, of the shapes of ``separate``, (M, n), the film's first."""
