"""The normal response of a body by wavenumber: its formula, and the function for users.

That of one layer on an elastic half-space or a rigid base is in closed form and exact in time. For constant Poisson's
ratios the response at wavenumber alpha is, in the layer's shear modulus g,

    alpha N(alpha; g) = B0/g + B1/(g + c1) + B2/(g + c2),     c_j = r_j Gs,  B_j, r_j >= 0.

It is the paper's Appendix A (u_z under p) in partial fractions. With x = alpha h, theta = exp(-2x),
kappa = 3 - 4 nu of the layer (c) and the substrate (s), G = g/Gs,

    N = (1 - nu_c)/(g alpha) (N0 + N1 G + N2 G^2)/(D0 + D1 G + D2 G^2),

where all N_i and D_i are sums of positive terms (``OneLayer.modes``): there is no overflow and no
cancellation. The compact forms usually printed lose up to 20 % for thin films and large contrasts.

Since only g depends on time, the elastic-viscoelastic correspondence principle turns each term into
a one-dimensional element, the layer's material in parallel with a spring c_j:

    1/(s (g(s) + c))  ->  J_c(t) = 1/(g0 + c) + sum_k a_k (1 - exp(-rho_k t))

(``bodies.materials.parallel_creep``), again with positive terms only.

A layer that slides on the substrate has one such term, B1 = 4 theta (1 - nu_c) (1 - theta + x (1 + theta))^2/(q f4),
c1 = Gs (1 - nu_c) q/((1 - nu_s) f4), q = 1 - theta^2 + 4 x theta, f4 of ``response.stack``, and B0 = (1 - nu_c)
(1 - theta)^2/q: by its two-port there. On a rigid base B0/g is all.
"""

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.exponential import mean_decay
from jaxcontact._support.pytree import pytree, replace
from jaxcontact.bodies.body import Layer, LayeredHalfSpace, checked_body
from jaxcontact.bodies.materials import Elastic, Material, parallel_creep
from jaxcontact.response.images import Images
from jaxcontact.response.in_time import (
    QUADRATURE_NODES,
    QUADRATURE_WEIGHTS,
    Layered,
    Response,
    Separable,
    Stack,
    check_times,
    film_shapes,
    relative_errors,
    summed_products,
)
from jaxcontact.response.stack import differences, nu_at_first, surface_compliance, surface_creep


@pytree
class Modes:
    """The partial fractions alpha N = own_share/g + sum_j shares_j/(g + springs_j).

    own_share: B0, (...); shares: B_j, (..., 2), both dimensionless; springs: c_j [Pa], (..., 2); one spring below a loose
    layer, none on a rigid base.
    """

    own_share: Array
    shares: Array
    springs: Array


def _roots(c0: Array, c1: Array, c2: Array) -> tuple[Array, Array]:
    """Return the two positive roots of c0 - c1 r + c2 r^2 = 0, the smaller first, without cancellation.

    They coincide for a thick layer when both solids are incompressible; a relative gap of 1e-10 is kept there, for
    the derivatives (it has no effect on the response itself).
    """
    q = c1 + jnp.sqrt(jnp.maximum(c1**2 - 4.0 * c0 * c2, 1e-20 * c1**2))
    return 2.0 * c0 / q, q / (2.0 * c2)


@pytree
class OneLayer(Layered):
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
            return Modes(film_shapes(self.body, wavenumber), none, none)
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

    def _parallel_creep(self, modes: Modes) -> tuple[Array, Array, Array]:
        """Return J_c(0), the a_k [1/Pa] and the rho_k [1/s] of the layer in parallel with each spring, (..., 2, m)."""
        if self.substrate is None:
            none = jnp.zeros((*modes.springs.shape, 0))
            return modes.springs, none, none
        return parallel_creep(self.layer.material.spectrum(), modes.springs)

    def _alpha_N(self, modes: Modes, zero: Array, J: Array, J_c: Array) -> Array:
        """Return alpha N from the layer's creep J, (...), and its creep in parallel with each spring, (..., 2)."""
        total = modes.own_share * J + jnp.sum(modes.shares * J_c, -1)
        return jnp.where(zero, surface_creep(self.body.base).instantaneous, total)

    def mean_response(self, wavenumber: Array, start: Array, end: Array) -> Array:
        # broadcast only after the modes and rates are found, which are expensive and the same at all times
        wavenumber, start, end = (jnp.asarray(a, float) for a in (wavenumber, start, end))
        modes, zero = self._modes_and_zero(wavenumber)
        first, amplitudes, rho = self._parallel_creep(modes)
        decay = mean_decay(rho, start[..., None, None], end[..., None, None])
        J = self.layer.material.spectrum().mean_creep(start, end)
        return self._alpha_N(modes, zero, J, first + jnp.sum(amplitudes * (1.0 - decay), -1))

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
        parallel = J[..., None] / (1.0 + modes.springs[..., None, :] * J[..., None])
        values = modes.own_share[..., None] * J + jnp.sum(modes.shares[..., None, :] * parallel, -1)
        mean = jnp.sum(values * QUADRATURE_WEIGHTS, -1) / 2.0
        return jnp.where(zero, surface_creep(self.body.base).instantaneous, mean)

    def separate(self, nodes: int) -> Separable:
        """Return a sum of products over bands of the decay rates of the layer in parallel with the substrate.

        The rates rho_k depend weakly on the wavenumber, through the springs c_j(alpha): each lies in a band [rho_k(c_min),
        rho_k(c_max)], within which

            exp(-rho t) ~ sum_m l_m(log rho) exp(-lambda_m t),

        with l_m the Lagrange polynomials on Chebyshev nodes log lambda_m. All wavenumbers then share the rates lambda_m. An
        unlimited flow is lambda = 0 with the fluidity for lambda C. For the paper's film one node a band is good to 4e-8,
        two to 5e-11; for a film as stiff as its substrate two give 3e-4, three 8e-5.
        """
        modes, zero = self._modes_and_zero(self.wavenumbers())
        first, amplitudes, rho = self._parallel_creep(modes)
        spectrum = self.layer.material.spectrum()

        def alpha_N(J: Array, decay: Array) -> Array:
            return self._alpha_N(modes, zero, J, first + jnp.sum(amplitudes * (1.0 - decay), -1))

        # The layer's own creep: one shape in alpha for all its rates. At wavenumber zero nothing is delayed.
        own_rates, fluidities = spectrum.rates_and_fluidities()
        shapes, rates = [jnp.where(zero, 0.0, modes.own_share)], [own_rates]

        # Its creep in parallel with the springs, band by band: sum_j B_j a_jk (1 - exp(-rho_jk t)).
        delayed = jnp.where(zero[:, None, None], 0.0, modes.shares[..., None] * amplitudes)
        points, least = np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes), float(np.finfo(float).tiny)
        for k in range(rho.shape[-1]):
            # A material that may flow but has no fluidity, or one too small for its rates to be normal numbers, has a band
            # of zeros: it is kept as the one rate zero with rho itself, so that the derivative with respect to the fluidity
            # is there.
            still = jnp.max(rho[..., k]) <= least
            log_rho = jnp.log(jnp.where(still, 1.0, jnp.maximum(rho[..., k], least)))

            # Chebyshev nodes log lambda_m of the band, and the Lagrange polynomials l_m(log rho) times lambda_m.
            low, high = jnp.min(log_rho), jnp.max(log_rho)
            middle, half = (low + high) / 2.0, jnp.maximum((high - low) / 2.0, 1e-6)
            xi = (log_rho - middle) / half
            common, weights = jnp.exp(middle + half * points), []
            for m in range(nodes):
                value = jnp.ones_like(xi)
                for other in np.delete(points, m):
                    value = value * (xi - other) / (points[m] - other)
                weights.append(common[m] * value)
            polynomials = jnp.stack(weights)
            factors = jnp.where(still, jnp.zeros_like(polynomials).at[0].set(rho[..., k]), polynomials)

            shapes += list(jnp.sum(delayed[..., k] * factors, -1))
            rates.append(jnp.where(still, 0.0, common))

        # lambda_k C_k: the fluidities times the own shape, and one shape for each rate of the bands.
        bands = jnp.eye(len(shapes) - 1)
        mix = jnp.zeros((len(shapes), own_rates.size + len(shapes) - 1))
        mix = mix.at[0, : own_rates.size].set(fluidities).at[1:, own_rates.size :].set(bands)
        start = alpha_N(spectrum.instantaneous, jnp.ones(()))
        own_factors = jnp.append(spectrum.instantaneous, mix[0])
        found = Separable(
            jnp.concatenate(rates), jnp.stack([start, *shapes]), mix, own_factors, jnp.zeros(())
        )

        # The largest relative error, against the exact response at times spread around every rate.
        times = check_times(found.rates)[:, None]
        exact = alpha_N(spectrum.creep(times), jnp.exp(-rho * times[..., None, None]))
        return replace(
            found, error=jnp.max(relative_errors(summed_products(found, found.terms, times), exact))
        )


@pytree
class HalfSpace(Response):
    """A half-space of one material, elastic or viscoelastic: alpha N = (1 - nu) J(t) at every wavenumber.

    J. Boussinesq; the correspondence is exact. With a bulk modulus in place of nu, the creep is ``stack.surface_creep``,
    which is exact as well.
    """

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
        creep, share = surface_creep(self.material), jnp.ones(())
        # the factor apart, so that S_1 is multiplied by the material's own creep
        if self.material.bulk_modulus is None:
            creep, share = self.material.spectrum(), 1.0 - nu_at_first(self.material)
        rates, fluidities = creep.rates_and_fluidities()
        terms = share * jnp.stack([creep.instantaneous, jnp.ones(())])[:, None]
        own_factors = jnp.append(creep.instantaneous, fluidities)
        return Separable(rates, terms, fluidities[None], own_factors, jnp.zeros(()))

    def expand(self, values: Array) -> Images:
        """Return a single image at the surface."""
        return Images(jnp.zeros(0), values)

    def expand_shapes(self, start: Array, film: Array, rest: Array) -> Images:
        """Return the same image as ``expand``."""
        return self.expand(jnp.concatenate([start, film, rest]))


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
    everywhere = lambda a: a[:, None, None] * ones
    found = surface_compliance(
        everywhere(compliances), everywhere(poissons), thickness * ones[None], wavenumber
    )
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
