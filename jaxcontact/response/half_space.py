"""The half-space: alpha N = (1 - nu) J(t) at every wavenumber (J. Boussinesq; the correspondence is exact).

With a bulk modulus in place of nu, the creep is ``response.stack.surface_creep``, which is exact as well.
"""

import abc

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.bodies.materials import Material, Spectrum
from jaxcontact.response.images import Images
from jaxcontact.response.stack import surface_creep, surface_parts

# The interface of a body's response to a pressure wave, as a function of wavenumber and time.


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
    def expand_shapes(self, shapes: Array) -> Images:
        """Return images, at the depths of ``expand``, of the shapes of ``separate``, (M, n), the film's first."""


@pytree
class HalfSpace(Response):
    """A half-space of one material, elastic or viscoelastic."""

    material: Material

    def mean_response(self, wavenumber: Array, start: Array, end: Array) -> Array:
        mean = surface_creep(self.material).mean_creep(jnp.asarray(start, float), jnp.asarray(end, float))
        return mean * jnp.ones_like(jnp.asarray(wavenumber, float))

    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return ``mean_response``: for a half-space of constant nu the substitution is exact."""
        return self.mean_response(wavenumber, start, end)

    def wavenumbers(self) -> Array:
        """Return one arbitrary wavenumber, since the response does not depend on it."""
        return jnp.ones(1)

    def separate(self, nodes: int) -> Separable:
        """Return the sum of products, exact for any ``nodes``."""
        share, creep = surface_parts(self.material)
        rates, fluidities = own_creep(creep)
        terms = share * jnp.stack([creep.instantaneous, jnp.ones(())])[:, None]
        film = jnp.append(creep.instantaneous, fluidities)
        return Separable(rates, terms, fluidities[None], film, jnp.zeros(()))

    def expand(self, values: Array) -> Images:
        """Return a single image at the surface."""
        return Images(jnp.zeros(0), values)

    def expand_shapes(self, shapes: Array) -> Images:
        """Return the same image as ``expand``."""
        return self.expand(shapes)


def own_creep(spectrum: Spectrum) -> tuple[Array, Array]:
    """Return a material's own rates [1/s] and their fluidities J_i/tau_i [1/(Pa s)], steady-state flow last."""
    rates, fluidities = spectrum.rates, spectrum.amplitudes * spectrum.rates
    if spectrum.fluidity is None:
        return rates, fluidities
    return jnp.append(rates, 0.0), jnp.append(fluidities, spectrum.fluidity)


def may_flow(material: Material) -> Array:
    """Return whether a material has steady-state viscous flow, () bool."""
    fluidity = material.spectrum().fluidity
    return jnp.zeros((), bool) if fluidity is None else jnp.asarray(fluidity) > 0.0
