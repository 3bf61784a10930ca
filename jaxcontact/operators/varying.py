"""Operators of a film whose thickness h varies in the plane.

The body at a point is taken for a uniform one of the thickness there, and the operator is made symmetric. With the kernels
as a series in the thickness, K(h) = sum_n T_n(xi(h)) K_n in Chebyshev polynomials,

    u = 1/2 sum_n [T_n(xi(h)) K_n p + K_n (T_n(xi(h)) p)].

The operator obeys reciprocity, <q, K p> = <p, K q>, and for a uniform thickness it is that of the uniform body. It is exact
to first order in the slope of the thickness: a film with a slope of 0.06 is within 0.3 % of a finite element solution, one
with 0.16 within 1 %.

The variable of the series is xi ~ log(1 + h/c), c the size of a cell: linear in h where the film is thin on the grid, where
the kernels are linear in h too, and logarithmic where it is thick, where they vary over lengths of the order of h. The
nodes include both ends of the range, so that a bare base is answered as such. A series of n terms costs n convolutions:
three or four of them suffice where the film is thin on the grid (``operators.thickness_kernels``).

On a grid that is periodic along both axes the operator is that of the pressures and displacements of zero mean. A mean
pressure p0 moves the surface by w(x) p0: without its mean, the film's compliance in uniaxial strain times its thickness less
what the film, which presses sideways, lifts the surface where it is thick (``response.body.sideways_compliance``). By
reciprocity, displacement is then from the mean of the surface but for mean(w p).
"""

from __future__ import annotations

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact.operators import distributed, spectral
from jaxcontact.operators.base import Corner, Family, Linear, Operator
from jaxcontact.operators.convolution import FLOOR, cell_ratio, confined_compliance

FINENESS = 256.0  # the range of log(1 + h/c) is rounded outwards to multiples of one over this


@pytree
class WindowSpectra:
    """Spectra on a smaller grid, as those of ``Varying`` or, with an axis of the members, of ``VaryingFamily``."""

    spectra: Array
    circulant: Array


@pytree
class Varying(Operator):
    """The operator of the module.

    spectra (n, my/2 + 1, mx): of K_n on the padded grid, real; circulant: of the mean operator, as in ``Convolution``;
    shares (n - 1, nx, ny): T_1, T_2, ... at each cell; uneven (nx, ny): w, used on a grid that is periodic along both axes;
    window: the spectra on a smaller grid, or None.
    """

    spectra: Array
    circulant: Array
    shares: Array
    uneven: Array
    window: WindowSpectra | None
    periodic: spectral.Periodic = static(default=spectral.FREE)

    symmetric = True

    def __call__(self, pressure: Array) -> Array:
        total = self.field(self.waves(pressure), pressure.shape)
        return total - jnp.mean(total) + self.of_mean_pressure(pressure) if all(self.periodic) else total

    def waves(self, pressure: Array) -> Array:
        """Return the spectra of all K_n and T_n p in the place of p under the sum, and of K_n p/2, (n, my/2 + 1, mx)."""
        if all(self.periodic):
            pressure = pressure - jnp.mean(pressure)
        fields = jnp.concatenate([pressure[None], self.shares * pressure / 2.0])
        waves = spectral.transform(fields, self.periodic)
        whole = jnp.sum(self.spectra * waves, 0)
        return jnp.concatenate([whole[None], self.spectra[1:] * waves[0] / 2.0])

    def field(self, waves: Array, shape: tuple[int, ...]) -> Array:
        """Return the displacement (nx, ny) from the spectra of ``waves``."""
        whole, *parts = spectral.inverse(waves, shape, self.periodic)
        return whole + sum(share * part for share, part in zip(self.shares, parts, strict=True))

    def of_mean_pressure(self, pressure: Array) -> Array:
        """Return the displacement by a mean pressure, and the mean displacement, on a periodic grid, (nx, ny)."""
        return self.uneven * jnp.mean(pressure) + jnp.mean(self.uneven * pressure)

    def tangent(self, change: Operator, pressure: Array) -> Array:
        """Return the change of K p: the operator is bilinear in its spectra and the shares."""
        apply = lambda operator: operator(pressure)
        return jax.jvp(apply, (self,), (change,))[1]

    def transpose(self) -> Varying:
        return self

    def preconditioner(self) -> Linear:
        """The inverse of the mean operator's circulant, its small and negative eigenvalues raised."""
        floor = FLOOR * jnp.mean(jnp.abs(self.circulant))
        inverse = 1.0 / jnp.maximum(self.circulant, floor)
        return lambda r: spectral.apply_circulant(inverse, r)

    def confined_compliance(self, shape: tuple[int, ...]) -> Array:
        return confined_compliance(self.circulant, shape)

    def cell_ratio(self, shape: tuple[int, ...]) -> Array | float:
        return cell_ratio(self.circulant, shape)

    def window_shape(self, shape: tuple[int, ...]) -> tuple[int, int] | None:
        none = self.window is None or distributed.devices() > 1
        return None if none else spectral.window_shape(shape, self.periodic)

    def restricted(self, corner: Corner) -> Varying:
        """The same film, as thick as it is in the window."""
        assert self.window is not None
        (n, *shape), held = self.shares.shape, jax.lax.stop_gradient(self.shares)
        nx, ny = spectral.window_shape(tuple(shape), self.periodic)
        shares = jax.lax.dynamic_slice(held, (0, *corner), (n, nx, ny))
        return Varying(
            self.window.spectra, self.window.circulant, shares, jnp.zeros((nx, ny)), None, self.periodic
        )

    def even(self) -> Varying:
        return self

    def plus_even(self, share: Array | float) -> Varying:
        more = lambda parts: jax.tree.map(lambda a: (1.0 + share) * a, parts)
        given = self.spectra, self.circulant, self.uneven, self.window
        return replace(
            self, **dict(zip(("spectra", "circulant", "uneven", "window"), map(more, given), strict=True))
        )


@pytree
class VaryingFamily(Family):
    """Several such operators.

    spectra (n, m, my/2 + 1, mx) and circulant (n, m, ny/2 + 1, nx): of the terms of the series of each member; shares:
    T_0, T_1, ... at each cell, (n, nx, ny); uneven (m, nx, ny): w of each; window: the first two on a smaller grid, or None.
    """

    spectra: Array
    circulant: Array
    shares: Array
    uneven: Array
    window: WindowSpectra | None
    periodic: spectral.Periodic = static(default=spectral.FREE)

    def combined(self, weights: Sequence[Array | float]) -> Varying:
        mixed = lambda a: sum(w * a[:, k] for k, w in enumerate(weights))
        mean = lambda a: jnp.tensordot(jnp.mean(self.shares, (1, 2)), mixed(a), 1)
        uneven = sum(w * part for w, part in zip(weights, self.uneven, strict=True))
        window = self.window
        if window is not None:
            window = jax.lax.stop_gradient(WindowSpectra(mixed(window.spectra), mean(window.circulant)))
        spectra, circulant = mixed(self.spectra), mean(self.circulant)
        return Varying(spectra, circulant, self.shares[1:], uneven, window, self.periodic)

    def circulants(self, pressure: Array) -> Array:
        sums = jnp.sum(self.shares * pressure, (1, 2))
        mean = sums / jnp.where(sums[0] > 0.0, sums[0], 1.0)  # the first share is one everywhere
        return jnp.tensordot(mean, self.circulant, 1)

    def total(self, fields: Array) -> Array:
        shape, first = self.shares.shape[1:], self.spectra.shape[1] - len(fields)
        if not len(fields):
            return jnp.zeros(shape)
        members = [self._member(first + k) for k in range(len(fields))]
        waves = sum(member.waves(field) for member, field in zip(members, fields, strict=True))
        total = members[0].field(waves, shape)
        if all(self.periodic):
            pairs = zip(members, fields, strict=True)
            total = total - jnp.mean(total) + sum(member.of_mean_pressure(field) for member, field in pairs)
        return total

    def _member(self, index: int) -> Varying:
        parts = self.spectra[:, index], self.circulant[0, index], self.shares[1:], self.uneven[index]
        return Varying(*parts, None, self.periodic)


@pytree
class ThicknessSeries:
    """The variable xi of the module and its nodes.

    length: c [m]; low, high: the range of log(1 + h/c) in which the series is made, (); count: its terms, static.
    """

    length: Array
    low: Array
    high: Array
    count: int = static()

    @classmethod
    def of(cls, thickness: Array, length: Array | float, count: int) -> ThicknessSeries:
        """Return the series for all values of a thickness.

        The range is rounded outwards, so that it does not follow small changes of the thickness, and carries no derivative.
        The length carries one, on which results do not depend but for the error of the series.
        """
        held = jax.lax.stop_gradient(jnp.log1p(jnp.asarray(thickness) / length))
        low, high = jnp.floor(FINENESS * jnp.min(held)), jnp.floor(FINENESS * jnp.max(held)) + 1.0
        return cls(jnp.asarray(length, float), low / FINENESS, high / FINENESS, count)

    def nodes(self) -> Array:
        """Return the thicknesses at which the kernels are to be known [m], (n,), all above zero."""
        return self._thickness(self._points())

    def spread(self, count: int) -> Array:
        """Return thicknesses over the whole range, ends included [m], (count,)."""
        return self._thickness(jnp.linspace(-1.0, 1.0, count))

    def shares(self, thickness: Array) -> Array:
        """Return T_0 to T_(n-1) of a thickness (...), (n, ...)."""
        middle, half = (self.low + self.high) / 2.0, (self.high - self.low) / 2.0
        return _polynomials((jnp.log1p(thickness / self.length) - middle) / half, self.count)

    def coefficients(self, values: Array) -> Array:
        """Return the coefficients of the series through values at the nodes, both (n, ...)."""
        ends = jnp.ones(self.count).at[jnp.array([0, -1])].set(0.5)
        matrix = 2.0 / (self.count - 1) * ends[:, None] * ends * _polynomials(self._points(), self.count)
        return jnp.tensordot(matrix, values, 1)

    def _points(self) -> Array:
        return jnp.cos(jnp.pi * jnp.arange(self.count) / (self.count - 1))

    def _thickness(self, xi: Array) -> Array:
        middle, half = (self.low + self.high) / 2.0, (self.high - self.low) / 2.0
        return self.length * jnp.expm1(middle + half * xi)


def _polynomials(xi: Array, count: int) -> Array:
    """Return the first Chebyshev polynomials of xi (...), (count, ...)."""
    values = [jnp.ones_like(xi), xi]
    for _ in range(count - 2):
        values.append(2.0 * xi * values[-1] - values[-2])
    return jnp.stack(values[:count])
