"""Displacement due to the past tractions of steady rolling: ``verbs.steady.wake`` in three directions.

Tractions that are steady in the frame of the indenter have left, at rate lambda_k, an eta_k of their own, and the surface
is moved by

    u = C_0 * t + sum_k lambda_k C_k * eta_k,      t = (q_x, q_y, p),

with the entries of ``operators.coupled``. On an elastic body that is C_0 alone. What lies farther behind than the grid is
long is felt as points, or in plane strain as lines: of alpha (L, T, K) at wavenumber zero

    xx:  (L y^2 + T x^2)/(2 pi r^3),      xy:  (T - L) x y/(2 pi r^3),      x:  -K x/(2 pi r^2),

or xx: -L ln(r^2)/(2 pi), yy: -T ln(r^2)/(2 pi), x: -K sign(x)/2 (see
``response.influence.tangential_coefficients`` and ``tangential_lines``).
Of the displacement along the surface rolling takes differences along the track alone, so that it is known but for a
constant where a body flows or in plane strain.
"""

from __future__ import annotations

import math

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import pytree, replace
from jaxcontact.operators.base import Operator
from jaxcontact.operators.coupled import Coupled, Tangential
from jaxcontact.operators.traction_kernels import TractionKernels, scaled_coefficients
from jaxcontact.verbs.experiment import Experiment
from jaxcontact.verbs.steady.wake import Wake, doubled, on_grid


@pytree
class RolledSurface:
    """Tractions on the cells -> displacement of a surface that they have rolled over for ever, scaled.

    normal: p -> displacement under it; plane (3, my/2 + 1, mx): spectra of xx, yy, xy; coupling (2, my/2 + 1, mx): of x
    and y, or None; relaxed: the operator of tractions that have stood for as long as the grid takes to pass.
    """

    normal: Operator
    plane: Array
    coupling: Array | None
    relaxed: Coupled

    def moved(self, q: Array, p: Array) -> Array:
        """Tangential displacement, (2, nx, ny)."""
        tangential = self.relaxed.tangential
        xx, yy, xy = self.plane
        x, y = tangential.transform(q)
        spectra = jnp.stack([xx * x + xy * y, xy * x + yy * y])
        if self.coupling is not None:
            spectra = spectra + self.coupling * tangential.transform(p)
        return tangential.inverse(spectra, p.shape)

    def normal_from_tangential(self, q: Array) -> Array:
        """Normal displacement under a tangential traction, (nx, ny)."""
        if self.coupling is None:
            return jnp.zeros(q.shape[-2:])
        tangential = self.relaxed.tangential
        return tangential.inverse(-jnp.sum(self.coupling * tangential.transform(q), 0), q.shape[-2:])


def elastic_surface(kernels: TractionKernels, normal: Operator) -> RolledSurface:
    """Return the surface with its instantaneous response alone."""
    tangential = kernels.family.combined(jnp.zeros(1 + len(kernels.mix)).at[0].set(1.0))
    coupling = None if tangential.coupling is None else 1j * tangential.coupling
    return RolledSurface(normal, tangential.plane, coupling, Coupled(normal, tangential))


def creeping_surface(
    experiment: Experiment, kernels: TractionKernels, wake: Wake, normal: Operator, *, coupled: bool
) -> RolledSurface:
    """Return the surface with the wake of past tractions; ``wake`` is that of the pressure."""
    grid, scale, at_once = experiment.grid, kernels.normal.scale, elastic_surface(kernels, normal)
    wide = replace(grid, shape=doubled(grid.shape, grid.periodic))
    coefficients = scaled_coefficients(kernels.expansion, experiment.indenter, wide, scale)
    shapes = Tangential.of(coefficients, coupled=coupled, periodic=grid.periodic)
    lasting = kernels.expansion.separable.terms[:, 1:, 0] @ kernels.mix
    track = _Track(wake, kernels.rates, kernels.mix, lasting)
    time = wake.crossing_time
    stood = jnp.append(1.0, kernels.mix @ (time * phi1(kernels.rates * time)))
    relaxed = Coupled(normal, kernels.family.combined(stood))
    plane, coupling = at_once.plane + track.spectra(shapes.plane, track.far_plane()), None
    if at_once.coupling is not None and shapes.coupling is not None:
        coupling = at_once.coupling + track.spectra(1j * shapes.coupling, track.far_coupling())
    return RolledSurface(normal, plane, coupling, relaxed)


@pytree
class _Track:
    """The track of past tractions at tangential rates (K,).

    mix: (M, K); lasting (3, K): lambda_k C_k of alpha (L, T, K) at wavenumber zero.
    """

    wake: Wake
    rates: Array
    mix: Array
    lasting: Array

    def spectra(self, shapes: Array, far: list[Array]) -> Array:
        """Return the wake of entries from the spectra of S_m on the doubled grid and the response to far sources.

        shapes: (M + 1, n, MY/2 + 1, MX); far: n fields (mx, my).
        """
        mixed = jnp.tensordot(self.mix, self.wake.passage(self.rates), 1)
        shape, periodic = self.wake.shape, self.wake.periodic
        near = jnp.sum(shapes[1:] * mixed[:, None], 0)
        return jnp.stack([on_grid(n, shape, periodic, f) for n, f in zip(near, far, strict=True)])

    def far_plane(self) -> list[Array]:
        """xx, yy and xy, (mx, my) each."""
        L, T, _ = self.lasting * (self._cell() / (2.0 * math.pi))
        sum_of = lambda strengths, felt: jnp.tensordot(strengths, felt, 1)
        if self.wake.line:
            felt = self.wake.varying(
                self.rates, lambda x, y: -jnp.log(_square(x, y)), lambda r: -2.0 * jnp.log(r)
            )
            return [sum_of(L, felt), sum_of(T, felt), sum_of(0.0 * L, felt)]
        (ex, ey), cube = self.wake.direction, lambda x, y: _square(x, y) ** 1.5
        xx = self.wake.beyond(self.rates, lambda x, y: x**2 / cube(x, y), ex**2)
        yy = self.wake.beyond(self.rates, lambda x, y: y**2 / cube(x, y), ey**2)
        xy = self.wake.beyond(self.rates, lambda x, y: x * y / cube(x, y), ex * ey)
        return [sum_of(L, yy) + sum_of(T, xx), sum_of(T, yy) + sum_of(L, xx), sum_of(T - L, xy)]

    def far_coupling(self) -> list[Array]:
        """x and y, (mx, my) each."""
        strength = -self.lasting[2] * self._cell()
        ex, ey = self.wake.direction
        if self.wake.line:
            flows = self.rates == 0.0
            rates, length = jnp.where(flows, 1.0, self.rates), jnp.exp(-self.rates * self.wake.crossing_time)
            felt = jnp.sum(jnp.where(flows, 0.0, strength * length / rates)) * ex / 2.0
            return [felt, jnp.zeros(())]
        x = self.wake.beyond(self.rates, lambda x, y: x / _square(x, y), ex)
        y = self.wake.beyond(self.rates, lambda x, y: y / _square(x, y), ey)
        return [jnp.tensordot(strength / (2.0 * math.pi), each, 1) for each in (x, y)]

    def _cell(self) -> Array | float:
        """Area of a cell in squares of its side along x, or in plane strain its side; nothing where creep ends far off."""
        if not self.wake.far_off:
            return 0.0
        return 1.0 if self.wake.line else self.wake.ratio


def _square(x: Array, y: Array) -> Array:
    """r^2 of places far off."""
    return jnp.maximum(x**2 + y**2, 1.0)
