"""What the rest of the package asks of a body: its response to a pressure wave, in wavenumber and time."""

import abc

import numpy as np
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.layers import Layer
from jaxcontact.inputs.materials import Material
from jaxcontact.inputs.spectrum import Spectrum
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
    (M, K). The first shape is that of the film on a rigid base (of a half-space: a number), with the fluidities of
    ``Response.film_creep`` in mix[0]. error: the largest relative error of the
    sum of products, over wavenumbers and over times up to the horizon, (); horizon: the latest time for which it is made
    [s], () inf without one.
    """

    rates: Array
    terms: Array
    mix: Array
    error: Array
    horizon: Array | float = float("inf")


class Response(abc.ABC):
    """The normal response of one kind of body: alpha N(alpha, t) [1/Pa], N = displacement/pressure.

    Pressure steps on at t = 0; ``start`` and ``end`` [s] bound the times over which a mean is taken.
    """

    @abc.abstractmethod
    def step(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Mean of alpha N over start <= t <= end; arguments broadcast; wavenumber >= 0 [rad/m].

        At wavenumber zero it is ``wide`` in the mean, with zero derivative in the wavenumber.
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

    @abc.abstractmethod
    def wide(self, t: Array | float) -> Array:
        """Compliance [1/Pa] that a contact far wider than the layers meets after a time t [s]."""

    @abc.abstractmethod
    def narrow(self, t: Array | float) -> Array:
        """Compliance [1/Pa] that a contact far narrower than the top layer meets."""

    @abc.abstractmethod
    def springs(self, t: Array | float) -> Array:
        """Compliance [m/Pa] of the layers as a bed of springs; zero without layers."""

    @abc.abstractmethod
    def long_term(self) -> Array:
        """``wide`` without unlimited flow, after a very long time: a scale that is never zero."""

    @abc.abstractmethod
    def flows(self) -> Array:
        """Whether the surface sinks without limit under a load, () bool."""

    @abc.abstractmethod
    def stiffness_ratio(self) -> Array:
        """The film's modulus at first over that of what it lies on; zero without one, or where it is rigid at first."""

    @abc.abstractmethod
    def surface(self) -> Material:
        """The material that the indenter touches."""

    @abc.abstractmethod
    def film(self) -> Layer | None:
        """The film whose shortening is reported; None without one."""

    @abc.abstractmethod
    def film_creep(self) -> Spectrum:
        """The creep of the film on a rigid base, whose shape is ``on_rigid_base``; of a half-space, its own."""

    @abc.abstractmethod
    def on_rigid_base(self) -> Array:
        """alpha N of the film on a rigid base over ``film_creep``, at ``wavenumbers``, (n,)."""

    @abc.abstractmethod
    def creeps_far(self) -> bool:
        """Whether creep may be felt however far from a load: that of a half-space, or of a substrate."""

    @abc.abstractmethod
    def rigid_at_first(self) -> Array | bool:
        """Whether a step load cannot dent the surface at once, J(0) = 0; a bool where the class tells."""
