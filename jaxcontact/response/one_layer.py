"""One layer bonded to an elastic half-space: its response as a function of the layer's modulus, exact in time.

For constant Poisson's ratios the response at wavenumber alpha is, in the layer's shear modulus g,

    alpha N(alpha; g) = B0/g + B1/(g + c1) + B2/(g + c2),     c_j = r_j Gs,  B_j, r_j >= 0.

It is the paper's Appendix A (u_z under p) in partial fractions. With x = alpha h, theta = exp(-2x),
kappa = 3 - 4 nu of the layer (c) and the substrate (s), G = g/Gs,

    N = (1 - nu_c)/(g alpha) (N0 + N1 G + N2 G^2)/(D0 + D1 G + D2 G^2),

where all N_i and D_i are sums of positive terms (``_polynomials``): there is no overflow and no
cancellation. The compact forms usually printed lose up to 20 % for thin films and large contrasts.

Since only g depends on time, the elastic-viscoelastic correspondence principle turns each term into
a one-dimensional element, the layer's material in parallel with a spring c_j:

    1/(s (g(s) + c))  ->  J_c(t) = 1/(g0 + c) + sum_k a_k (1 - exp(-rho_k t))

(``spectrum.parallel_creep``), again with positive terms only.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.exponential import mean_decay
from jaxcontact._support.pytree import pytree
from jaxcontact.inputs.layers import Layer, LayeredHalfSpace
from jaxcontact.inputs.materials import Material
from jaxcontact.inputs.spectrum import parallel_creep
from jaxcontact.response.base import QUADRATURE_NODES, QUADRATURE_WEIGHTS, Response, Separable
from jaxcontact.response.influence.images import Images
from jaxcontact.response.layer import differences
from jaxcontact.response.time import ladder
from jaxcontact.response.time.separable import separate_bands
from jaxcontact.response.volume import nu_at_first, surface_creep


@pytree
class Modes:
    """The partial fractions alpha N = film/g + sum_j amplitude_j/(g + stiffness_j).

    film: B0, (...); amplitude: B_j, (..., 2), both dimensionless; stiffness: c_j [Pa], (..., 2).
    """

    film: Array
    amplitude: Array
    stiffness: Array


def _polynomials(
    x: Array, kc: Array | float, ks: Array | float
) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Return (N0, N1, N2) and (D0, D1, D2) of the module's formula; kc, ks are the two kappas."""
    theta = jnp.exp(-2.0 * x)
    E1, E2 = -jnp.expm1(-2.0 * x), -jnp.expm1(-4.0 * x)
    f3, f4 = differences(x)
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
    """A layer of constant Poisson's ratio on an elastic substrate, in closed form."""

    layer: Layer
    substrate: Material

    @property
    def body(self) -> LayeredHalfSpace:
        return LayeredHalfSpace((self.layer,), self.substrate)

    def modes(self, wavenumber: Array) -> Modes:
        """Return the partial fractions of alpha N, wavenumber > 0 [rad/m]."""
        nu_c, nu_s = nu_at_first(self.layer.material), nu_at_first(self.substrate)
        kappas = 3.0 - 4.0 * nu_c, 3.0 - 4.0 * nu_s
        (N0, N1, N2), (D0, D1, D2) = _polynomials(wavenumber * self.layer.thickness, *kappas)
        r1, r2 = _roots(D0, D1, D2)
        z1, z2 = _roots(N0, N1, N2)  # the zeros interlace with the poles: z1 < r1 < z2 < r2
        lead = (1.0 - nu_c) * N2 / (D2 * (r2 - r1))
        B1 = lead * (r1 - z1) * (z2 - r1) / r1
        B2 = lead * (r2 - z1) * (r2 - z2) / r2
        Gs = 1.0 / self.substrate.spectrum().instantaneous
        return Modes((1.0 - nu_c) * N0 / D0, jnp.stack([B1, B2], -1), jnp.stack([r1, r2], -1) * Gs)

    def _modes_and_zero(self, wavenumber: Array) -> tuple[Modes, Array]:
        """Return the modes at wavenumbers >= 0, and a mask of zero wavenumbers, where the modes are those of another
        wavenumber.
        """
        zero = wavenumber == 0.0
        return self.modes(jnp.where(zero, 1.0 / self.layer.thickness, wavenumber)), zero

    def step(self, wavenumber: Array, start: Array, end: Array) -> Array:
        # broadcast only after the modes and rates are found, which are expensive and the same at all times
        wavenumber, start, end = (jnp.asarray(a, float) for a in (wavenumber, start, end))
        elements, creep = self._elements(wavenumber), self.layer.material.spectrum().mean_creep(start, end)
        decay = mean_decay(elements.rates, start[..., None, None], end[..., None, None])
        return self._total(elements, decay, creep)

    def _elements(self, wavenumber: Array) -> Elements:
        modes, zero = self._modes_and_zero(wavenumber)
        return Elements(modes, zero, *parallel_creep(self.layer.material.spectrum(), modes.stiffness))

    def _total(self, elements: Elements, decay: Array, creep: Array) -> Array:
        """Return alpha N from exp(-rate t) of the elements, (..., 2, m), and the layer's J, (...)."""
        modes, zero, first, amplitude, _ = elements
        parallel = first + jnp.sum(amplitude * (1.0 - decay), -1)
        total = modes.film * creep + jnp.sum(modes.amplitude * parallel, -1)
        return jnp.where(zero, surface_creep(self.substrate).instantaneous, total)

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
        return jnp.where(zero, surface_creep(self.substrate).instantaneous, mean)

    def wavenumbers(self) -> Array:
        return ladder.wavenumbers(self.body)

    def separate(self, nodes: int) -> Separable:
        """Return a sum of products over bands of the decay rates of the film in parallel with the substrate.

        See ``response.time.separable``.
        """
        elements = self._elements(self.wavenumbers())
        modes, zero, _, amplitude, rates = elements
        delayed = jnp.where(zero[:, None, None], 0.0, modes.amplitude[..., None] * amplitude)
        creep = self.layer.material.spectrum()
        exact = lambda t: self._total(elements, jnp.exp(-rates * t[..., None, None]), creep.creep(t))
        start = self._total(elements, jnp.ones(()), creep.instantaneous)
        return separate_bands(start, jnp.where(zero, 0.0, modes.film), creep, delayed, rates, nodes, exact)

    def expand(self, values: Array) -> Images:
        return ladder.expand(self.body, values)

    def expand_shapes(self, shapes: Array) -> Images:
        return ladder.expand_shapes(self.body, shapes)
