"""The selection of the response formula for a body."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.exponential import mean_decay
from jaxcontact._support.pytree import pytree
from jaxcontact.bodies.body import Layer, LayeredHalfSpace, checked_body
from jaxcontact.bodies.materials import Elastic, KelvinVoigt, Material, Rigid, Spectrum, parallel_creep
from jaxcontact.response import in_time
from jaxcontact.response.half_space import (
    QUADRATURE_NODES,
    QUADRATURE_WEIGHTS,
    HalfSpace,
    Response,
    Separable,
    may_flow,
)
from jaxcontact.response.images import Images
from jaxcontact.response.in_time import separate, separate_bands, stiffness_contrast
from jaxcontact.response.stack import (
    alpha_N,
    differences,
    film_creep,
    film_shape,
    mean_response,
    nu_at_first,
    solids,
    surface_compliance,
    surface_creep,
)

# One layer bonded to an elastic half-space: its response as a function of the layer's modulus, exact in time.
#
# For constant Poisson's ratios the response at wavenumber alpha is, in the layer's shear modulus g,
#
#     alpha N(alpha; g) = B0/g + B1/(g + c1) + B2/(g + c2),     c_j = r_j Gs,  B_j, r_j >= 0.
#
# It is the paper's Appendix A (u_z under p) in partial fractions. With x = alpha h, theta = exp(-2x),
# kappa = 3 - 4 nu of the layer (c) and the substrate (s), G = g/Gs,
#
#     N = (1 - nu_c)/(g alpha) (N0 + N1 G + N2 G^2)/(D0 + D1 G + D2 G^2),
#
# where all N_i and D_i are sums of positive terms (``OneLayer.modes``): there is no overflow and no
# cancellation. The compact forms usually printed lose up to 20 % for thin films and large contrasts.
#
# Since only g depends on time, the elastic-viscoelastic correspondence principle turns each term into
# a one-dimensional element, the layer's material in parallel with a spring c_j:
#
#     1/(s (g(s) + c))  ->  J_c(t) = 1/(g0 + c) + sum_k a_k (1 - exp(-rho_k t))
#
# (``spectrum.parallel_creep``), again with positive terms only.
#
# A layer that slides on the substrate has one such term, B1 = 4 theta (1 - nu_c) (1 - theta + x (1 + theta))^2/(q f4),
# c1 = Gs (1 - nu_c) q/((1 - nu_s) f4), q = 1 - theta^2 + 4 x theta, f4 of ``response.stack``, and B0 = (1 - nu_c)
# (1 - theta)^2/q: by its two-port there. On a rigid base B0/g is all.


@pytree
class Modes:
    """The partial fractions alpha N = film/g + sum_j amplitude_j/(g + stiffness_j).

    film: B0, (...); amplitude: B_j, (..., 2), both dimensionless; stiffness: c_j [Pa], (..., 2); one mode for a loose layer,
    none on a rigid base.
    """

    film: Array
    amplitude: Array
    stiffness: Array


def _roots(c0: Array, c1: Array, c2: Array) -> tuple[Array, Array]:
    """Return the two positive roots of c0 - c1 r + c2 r^2 = 0, the smaller first, without cancellation.

    They coincide for a thick layer when both solids are incompressible; a relative gap of 1e-10 is kept there, for
    the derivatives (it has no effect on the response itself).
    """
    q = c1 + jnp.sqrt(jnp.maximum(c1**2 - 4.0 * c0 * c2, 1e-20 * c1**2))
    return 2.0 * c0 / q, q / (2.0 * c2)


class Elements(NamedTuple):
    """The modes at wavenumbers (n,), a mask of zero wavenumbers, and ``parallel_creep`` of the modes' stiffnesses."""

    modes: Modes
    zero: Array
    first: Array
    amplitude: Array
    rates: Array


@pytree
class OneLayer(Response):
    """A layer of constant Poisson's ratio on an elastic substrate or a rigid base, in closed form."""

    layer: Layer
    substrate: Material | None

    @property
    def body(self) -> LayeredHalfSpace:
        return LayeredHalfSpace((self.layer,), self.substrate)

    def modes(self, wavenumber: Array) -> Modes:
        """Return the partial fractions of alpha N, wavenumber > 0 [rad/m]."""
        if self.substrate is None:  # any wavenumber
            none = jnp.zeros((*wavenumber.shape, 0))
            return Modes(in_time.film_shapes(self.body, wavenumber), none, none)
        nu_c, nu_s = nu_at_first(self.layer.material), nu_at_first(self.substrate)
        kc, ks = 3.0 - 4.0 * nu_c, 3.0 - 4.0 * nu_s

        # u_z under p of Appendix A as (N0 + N1 G + N2 G^2)/(D0 + D1 G + D2 G^2), each coefficient a sum of positive terms.
        x = wavenumber * self.layer.thickness
        theta, E1, E2 = jnp.exp(-2.0 * x), -jnp.expm1(-2.0 * x), -jnp.expm1(-4.0 * x)
        f3, f4 = differences(x)
        xt = 4.0 * x * theta
        Gs = 1.0 / self.substrate.spectrum().instantaneous
        if not self.layer.bonded:
            q = E2 + xt
            B1 = 4.0 * theta * (1.0 - nu_c) * (E1 + x * (1.0 + theta)) ** 2 / (q * f4)
            c1 = Gs * (1.0 - nu_c) * q / ((1.0 - nu_s) * f4)
            return Modes((1.0 - nu_c) * E1**2 / q, B1[..., None], c1[..., None])
        D0 = kc * (1.0 + theta**2) + (kc**2 + 1.0) * theta + x * xt
        D1 = E1 * ((1.0 + kc * ks) + (kc + ks) * theta) + (ks - 1.0) * x * xt
        D2 = ks * f4
        N0 = (kc - 1.0) * E2 + f3
        N1 = 1.0 + kc * ks + (kc + ks) * theta**2 - xt * (ks - 1.0)
        N2 = ks * (E2 + xt)

        # Poles G = -r and zeros G = -z, which interlace, z1 < r1 < z2 < r2, so that the residues B_j are products of
        # positive differences.
        r1, r2 = _roots(D0, D1, D2)
        z1, z2 = _roots(N0, N1, N2)
        lead = (1.0 - nu_c) * N2 / (D2 * (r2 - r1))
        B1 = lead * (r1 - z1) * (z2 - r1) / r1
        B2 = lead * (r2 - z1) * (r2 - z2) / r2
        return Modes((1.0 - nu_c) * N0 / D0, jnp.stack([B1, B2], -1), jnp.stack([r1, r2], -1) * Gs)

    def _modes_and_zero(self, wavenumber: Array) -> tuple[Modes, Array]:
        """Return the modes at wavenumbers >= 0, and a mask of zero wavenumbers, where the modes are those of another
        wavenumber; on a rigid base they are those of wavenumber zero (``Response.mean_response``) as well.
        """
        if self.substrate is None:
            return self.modes(wavenumber), jnp.zeros(wavenumber.shape, bool)
        zero = wavenumber == 0.0
        return self.modes(jnp.where(zero, 1.0 / self.layer.thickness, wavenumber)), zero

    def mean_response(self, wavenumber: Array, start: Array, end: Array) -> Array:
        # broadcast only after the modes and rates are found, which are expensive and the same at all times
        wavenumber, start, end = (jnp.asarray(a, float) for a in (wavenumber, start, end))
        elements, creep = self._elements(wavenumber), self.layer.material.spectrum().mean_creep(start, end)
        decay = mean_decay(elements.rates, start[..., None, None], end[..., None, None])
        return self._alpha_N(elements, decay, creep)

    def _elements(self, wavenumber: Array) -> Elements:
        modes, zero = self._modes_and_zero(wavenumber)
        if self.substrate is None:
            none = jnp.zeros((*wavenumber.shape, 0, 0))
            return Elements(modes, zero, modes.amplitude, none, none)
        return Elements(modes, zero, *parallel_creep(self.layer.material.spectrum(), modes.stiffness))

    def _alpha_N(self, elements: Elements, decay: Array, creep: Array) -> Array:
        """Return alpha N from exp(-rate t) of the elements, (..., 2, m), and the layer's J, (...)."""
        modes, zero, first, amplitude, _ = elements
        parallel = first + jnp.sum(amplitude * (1.0 - decay), -1)
        total = modes.film * creep + jnp.sum(modes.amplitude * parallel, -1)
        return jnp.where(zero, surface_creep(self.body.base).instantaneous, total)

    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return the response with the paper's substitution of phi(t) for 1/(2G), a mean by five-point Gauss quadrature.

        Its error is 2.5e-6 for the paper's film on steel, and about 1 % for a film as stiff as its substrate.
        """
        wavenumber, start, end = jnp.broadcast_arrays(
            *(jnp.asarray(a, float) for a in (wavenumber, start, end))
        )
        modes, zero = self._modes_and_zero(wavenumber)
        t = (start + end)[..., None] / 2.0 + (end - start)[..., None] / 2.0 * QUADRATURE_NODES
        J = self.layer.material.creep(t)
        parallel = J[..., None] / (1.0 + modes.stiffness[..., None, :] * J[..., None])
        values = modes.film[..., None] * J + jnp.sum(modes.amplitude[..., None, :] * parallel, -1)
        mean = jnp.sum(values * QUADRATURE_WEIGHTS, -1) / 2.0
        return jnp.where(zero, surface_creep(self.body.base).instantaneous, mean)

    def wavenumbers(self) -> Array:
        return in_time.wavenumbers(self.body)

    def separate(self, nodes: int) -> Separable:
        """Return a sum of products over bands of the decay rates of the film in parallel with the substrate.

        See ``response.in_time``.
        """
        elements = self._elements(self.wavenumbers())
        modes, zero, _, amplitude, rates = elements
        delayed = jnp.where(zero[:, None, None], 0.0, modes.amplitude[..., None] * amplitude)
        creep = self.layer.material.spectrum()
        exact = lambda t: self._alpha_N(elements, jnp.exp(-rates * t[..., None, None]), creep.creep(t))
        start = self._alpha_N(elements, jnp.ones(()), creep.instantaneous)
        return separate_bands(start, jnp.where(zero, 0.0, modes.film), creep, delayed, rates, nodes, exact)

    def expand(self, values: Array) -> Images:
        return in_time.expand(self.body, values)

    def expand_shapes(self, shapes: Array) -> Images:
        return in_time.expand_shapes(self.body, shapes)


# The response of any stack of layers on a half-space, computed by recursion.
#
# For one layer on an elastic substrate it agrees with the closed form of ``OneLayer`` to 1e-12, so that no
# other module depends on which of them is used.


RATES_A_NODE, SHAPES_A_NODE = 12, 4  # ``response.in_time`` gives the accuracy of 24 rates and 8 shapes


@pytree
class Stack(Response):
    """One or more layers on a substrate or a rigid base; layers: the top one first."""

    layers: tuple[Layer, ...]
    substrate: Material | None

    @property
    def body(self) -> LayeredHalfSpace:
        return LayeredHalfSpace(self.layers, self.substrate)

    def mean_response(self, wavenumber: Array, start: Array, end: Array) -> Array:
        return mean_response(self.body, wavenumber, start, end)

    def quasi_elastic(self, wavenumber: Array, start: Array, end: Array) -> Array:
        """Return the mean over an interval by five-point Gauss quadrature."""
        wavenumber, start, end = (jnp.asarray(a, float)[..., None] for a in (wavenumber, start, end))
        t = (start + end) / 2.0 + (end - start) / 2.0 * QUADRATURE_NODES
        compliances = jnp.stack([solid.creep(t) for solid in solids(self.body)])
        return jnp.sum(alpha_N(self.body, wavenumber, compliances) * QUADRATURE_WEIGHTS, -1) / 2.0

    def wavenumbers(self) -> Array:
        return in_time.wavenumbers(self.body)

    def separate(self, nodes: int) -> Separable:
        """Return a sum of products with fixed rates, about four per decade."""
        rates, shapes = RATES_A_NODE * nodes, SHAPES_A_NODE * nodes
        return separate(self.body, self.wavenumbers(), rates, shapes)

    def expand(self, values: Array) -> Images:
        return in_time.expand(self.body, values)

    def expand_shapes(self, shapes: Array) -> Images:
        return in_time.expand_shapes(self.body, shapes)


def response_of(body: LayeredHalfSpace) -> Response:
    """Return the response of a body that has passed ``checked_body``."""
    if not body.layers:
        return HalfSpace(body.base)
    layers = body.sublayers()
    if len(layers) == 1 and isinstance(body.substrate, Elastic | None):
        film = layers[0].material
        # the closed form needs a Poisson's ratio that is independent of time: prescribed, or that of an elastic solid
        if film.bulk_modulus is None or isinstance(film, Elastic):
            return OneLayer(layers[0], body.substrate)
    return Stack(layers, body.substrate)


def sideways_compliance(body: LayeredHalfSpace, thickness: Array, wavenumber: Array) -> Array:
    """Return how far a uniform pressure lifts the surface where a film is thicker, over pressure and excess of thickness,
    for excesses that are waves of a wavenumber [rad/m], [1/Pa] of its shape.

    Under a pressure p the film, which cannot widen, presses sideways with s p, s = nu/(1 - nu). Where its thickness exceeds
    the mean ``thickness`` [m] by h', equilibrium along the surface needs the traction s p dh'/dx, to which the body with a
    film of the mean thickness responds: by s alpha K(alpha) p h', K the coupling of ``response.stack``, at first. It is
    exact to first order in h'.
    """
    (film,), base = body.sublayers(), body.base
    solids = film.material, base
    compliances = jnp.stack([solid.spectrum().instantaneous for solid in solids])
    poissons = jnp.stack([nu_at_first(solid) for solid in solids])
    ones = jnp.ones_like(wavenumber)
    spread = lambda a: a[:, None, None] * ones
    found = surface_compliance(spread(compliances), spread(poissons), thickness * ones[None], wavenumber)
    return poissons[0] / (1.0 - poissons[0]) * found.coupling


def normal_response(body: LayeredHalfSpace, k: Array, t: Array | float = 0.0) -> Array:
    """Return N(k, t): normal surface displacement per amplitude of a pressure wave applied as a step at t = 0.

    At k = 0 the response of a half-space is infinite, and ``inf`` is returned, with zero derivative;
    k N stays finite. On a rigid base (substrate None) it is the displacement under a uniform pressure over that, the sum
    of h J (1 - 2 nu)/(2 (1 - nu)) of the layers, which cannot widen. It is the limit for long waves if all layers are
    bonded; along a long wave a loose layer can widen, and N tends to h J (1 - nu)/2 (one layer). Source:
    Wang et al., Tribology Letters 2025, doi 10.1007/s11249-025-01990-5, Appendix A (u_z under p), with the correspondence
    principle of section 2.3 applied exactly.

    Args:
        body: a ``LayeredHalfSpace``.
        k: wavenumber [rad/m], >= 0, of any shape.
        t: time [s], >= 0; broadcasts with k.

    Returns:
        N [m/Pa] of the broadcast shape; nan where a value traced by jit or vmap is outside its range.

    Raises:
        ValueError: an invalid or unsupported body, a negative k or a negative t.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> float(jc.normal_response(glass, 1e6) * 1e6)     # (1 - nu)/G
        2.5e-11
    """
    body, valid = checked_body(body)
    valid = valid & checks.non_negative("k [rad/m]", k) & checks.non_negative("t [s]", t)
    k, t = jnp.asarray(k, float), jnp.asarray(t, float)
    safe, response = jnp.where(k == 0.0, 1.0, k), response_of(body)
    if body.substrate is None:
        scaled = response.mean_response(*jnp.broadcast_arrays(k, t, t))
        found = scaled * jnp.where(k == 0.0, body.height, 1.0 / safe)
    else:
        found = jnp.where(k == 0.0, jnp.inf, response.mean_response(safe, t, t) / safe)
    return jnp.where(valid, found, jnp.nan)


# Properties of a body that follow from its materials, independent of the formula of its response.
#
# The compliance for contacts much wider than the layers is that of the substrate, and for contacts much narrower than
# the top layer that of its material. Both are compliances of half-spaces, (1 - nu) J(t) at a constant Poisson's ratio
# (``response.stack.surface_creep``).


@pytree
class BodyLimits:
    """Facts about layers, the top one first, on a substrate or a rigid base; made by ``limits_of``."""

    layers: tuple[Layer, ...]
    substrate: Material | None

    @property
    def solids(self) -> list[Material]:
        """The materials from the top to the substrate, without a rigid base."""
        below = [] if self.substrate is None else [self.substrate]
        return [*(layer.material for layer in self.layers), *below]

    @property
    def film(self) -> Layer | None:
        """The layer whose shortening is reported, the top one; None without layers."""
        return self.layers[0] if self.layers else None

    @property
    def surface(self) -> Material:
        """The material that the indenter touches."""
        return self.solids[0]

    @property
    def creeps_far(self) -> bool:
        """True if creep may have an effect at any distance from a load: that of a half-space or of a substrate."""
        return not self.layers or not isinstance(self.substrate, Elastic | None)

    def film_creep(self) -> Spectrum:
        """The creep of the film on a rigid base, which multiplies ``film_shape``; of a body with a film."""
        assert self.film is not None
        return film_creep(self.film)

    def film_shape(self, wavenumber: Array) -> Array:
        """alpha N of the film on a rigid base over its creep, at wavenumbers [rad/m]; zero without a film."""
        if self.film is None:
            return jnp.zeros_like(wavenumber)
        return film_shape(self.film, wavenumber)

    def long_wave_compliance(self, t: Array | float) -> Array:
        """Return the compliance [1/Pa] at a time t [s] of the substrate, for contacts much wider than the layers; zero on
        a rigid base."""
        base = Rigid() if self.substrate is None else self.substrate
        return surface_creep(base).creep(t)

    def short_wave_compliance(self, t: Array | float) -> Array:
        """Return the compliance [1/Pa] at a time t [s] of the top layer, for contacts much narrower than it."""
        return surface_creep(self.surface).creep(t)

    def relaxed_compliance(self) -> Array:
        """Return the relaxed compliance of the substrate, or of the top layer on a rigid base, without its steady-state flow
        [1/Pa], which is never zero."""
        creep = surface_creep(self.surface if self.substrate is None else self.substrate)
        return creep.instantaneous + jnp.sum(jnp.where(creep.rates > 0.0, creep.amplitudes, 0.0))

    def is_fluid(self) -> Array:
        """Return whether the surface displacement grows without limit under a load, () bool."""
        return jnp.any(jnp.stack([may_flow(solid) for solid in self.solids]))

    def has_zero_instantaneous_compliance(self) -> Array | bool:
        """Return whether a solid has J(0) = 0 and does not respond to a step load instantaneously.

        The result is a bool where the class of the material determines it.
        """
        if any(isinstance(solid, KelvinVoigt) for solid in self.solids):
            return True
        return _has_zero_instantaneous_compliance(self.solids)

    def stiffness_ratio(self) -> Array:
        """The largest initial modulus of a layer over that of a solid below it, (); zero without layers."""
        return (
            stiffness_contrast(LayeredHalfSpace(self.layers, self.substrate))
            if self.layers
            else jnp.zeros(())
        )


def limits_of(body: LayeredHalfSpace) -> BodyLimits:
    """Return the facts about a body that has passed ``checked_body``."""
    return BodyLimits(body.sublayers(), body.substrate)


@jax.jit  # one program of every check instead of one for each operation
def _has_zero_instantaneous_compliance(solids: list[Material]) -> Array:
    return jnp.any(jnp.stack([solid.spectrum().instantaneous == 0.0 for solid in solids]))
