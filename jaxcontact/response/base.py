"""The interface of a response: the displacement under a pressure wave, by wavenumber and time."""

import abc

import numpy as np
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.response.influence.images import Images

QUADRATURE_NODES, QUADRATURE_WEIGHTS = np.polynomial.legendre.leggauss(
    5
)  # for means over an interval of time


@pytree
class Separable:
    """alpha N(alpha, t) as a sum of products, at the wavenumbers of its response, so that

        u = C_0 * p + sum_k lambda_k C_k * eta_k,     eta_k' = p - lambda_k eta_k,
        lambda_k C_k = sum_m mix[m, k] S_m [1/(Pa s)].

    rates: lambda_k [1/s], (K,), zero for a flow without limit; terms: C_0 and M shapes S_m, (M + 1, n); mix:
    (M, K). film: what the first of the shapes, that of the film on a rigid base (of a half-space: a number), is
    multiplied by at once [1/Pa] and in mix, by rate [1/(Pa s)], (K + 1,). error: the largest relative error of the sum of
    products, over wavenumbers and over times up to the horizon, (); horizon: the latest time for which it is made [s],
    () inf without one.
    """

    rates: Array
    terms: Array
    mix: Array
    film: Array
    error: Array
    horizon: Array | float = float("inf")


class Response(abc.ABC):
    """The normal response of one kind of body: alpha N(alpha, t) [1/Pa], N = displacement/pressure.

    Pressure steps on at t = 0; ``start`` and ``end`` [s] bound the times over which a mean is taken.
    """

    @abc.abstractmethod
    def step(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Mean of alpha N over start <= t <= end; arguments broadcast; wavenumber >= 0 [rad/m].

        At wavenumber zero it is that of the substrate alone, with zero derivative in the wavenumber.
        """

    @abc.abstractmethod
    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """As ``step``, with 1/J(t) for moduli inside the elastic response (the paper, section 2.3)."""

    @abc.abstractmethod
    def wavenumbers(self) -> Array:
        """Where the response is to be known to be put on a grid, (n,) [rad/m]; they carry no derivative."""

    @abc.abstractmethod
    def separate(self, nodes: int) -> Separable:
        """The sum of products with ``nodes`` decay rates a band, static."""

    @abc.abstractmethod
    def expand(self, values: Array) -> Images:
        """Images of responses given at ``wavenumbers``, (..., n) [any unit], close to them relative to ``step``."""

    @abc.abstractmethod
    def expand_shapes(self, shapes: Array) -> Images:
        """The same of the shapes of ``separate``, (M, n), the film's first; at the depths of ``expand``."""
