"""What sliding shows beyond the pressure: horizontal force, pressure centre, energies. All scaled.

Force. The pressure acts normal to the indenter's surface z = approach - f(x, y), so that it pushes the
indenter with

    F = -int p grad f dA.

It opposes the motion where the pressure leans to the leading side.

Energy. The body is a chain of springs and dashpots (``history.recursive``): with rates
d eta_k = p - lambda_k eta_k, taken with the material,

    stored = 1/2 <p, C_0 p> + 1/2 sum_k lambda_k <eta_k, (lambda_k C_k) eta_k>,
    dissipated = sum_k <d eta_k, (lambda_k C_k) d eta_k>,

and -F . v + load * rate of approach = d stored/dt + dissipated as long as nothing leaves the window. In the
steady state, where the track carries stored energy away to dissipate it later, the dashpots take

    -F . v = sum_k <p, (lambda_k C_k) d eta_k>.

The sums are taken over Fourier modes (Parseval).
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxcontact._pytree import pytree
from jaxcontact.operators import spectral

WALL = 1.0  # a profile steeper than this is a wall, on which linear theory says nothing


class SlidingStep(NamedTuple):
    """What a step of sliding shows.

    force (2,): on the indenter; centre (2,): of the pressure; leading_peak: of the pressure ahead of the axis;
    stored, dissipated: energy and power of the body; dropped: bound on the displacement in contact that
    the lost history could still cause, (); overlaps: it may lie under the contact.
    """

    force: Array
    centre: Array
    leading_peak: Array
    stored: Array
    dissipated: Array
    dropped: Array
    overlaps: Array


@pytree
class Observer:
    """slopes of the profile and cell coordinates, each (2, nx, ny) [in units of dx]."""

    slopes: Array
    places: Array

    @classmethod
    def of(cls, profile: Array, ratio: Array, periodic: spectral.Periodic = spectral.FREE) -> "Observer":
        nx, ny = profile.shape
        along_x, along_y = (_slope(profile, axis, wraps) for axis, wraps in enumerate(periodic))
        slopes = jnp.stack([along_x, along_y / ratio])
        x, y = jnp.arange(nx) - (nx - 1) / 2, (jnp.arange(ny) - (ny - 1) / 2) * ratio
        places = jnp.stack([jnp.broadcast_to(x[:, None], (nx, ny)), jnp.broadcast_to(y, (nx, ny))])
        return cls(jnp.where(jnp.abs(slopes) < WALL, slopes, 0.0), places)

    def surface(self, pressure: Array, direction: Array) -> tuple[Array, Array, Array]:
        """Force (2,) on the indenter, centre (2,), and peak ahead of the axis, ()."""
        total = jnp.sum(pressure)
        force = -jnp.sum(self.slopes * pressure, (1, 2))
        centre = jnp.sum(self.places * pressure, (1, 2)) / jnp.where(total > 0.0, total, 1.0)
        ahead = jnp.tensordot(direction, self.places, 1) >= 0.0
        return force, centre, jnp.max(jnp.where(ahead, pressure, 0.0))


def _slope(profile: Array, axis: int, wraps: bool) -> Array:
    """By central differences, (nx, ny); at the ends, where the profile does not go on, by those to one side."""
    if wraps:
        return (jnp.roll(profile, -1, axis) - jnp.roll(profile, 1, axis)) / 2.0
    return jnp.asarray(jnp.gradient(profile, axis=axis))


def inner_product(weights: Array, squares: Array, padded: tuple[int, int]) -> Array:
    """sum_x f (K * f) over the padded grid from the spectra of K, (..., my/2 + 1, mx), and |f|^2, likewise."""
    mx, my = padded
    return jnp.sum(jnp.sum(weights * squares, -1) * spectral.both_signs(my), -1) / (mx * my)


def energies(
    spectra: Array, rates: Array, eta: Array, pressure: Array, padded: tuple[int, int]
) -> tuple[Array, Array]:
    """Stored energy and dissipated power of the module's formulas; spectra of C_0 and lambda_k C_k."""
    square = lambda f: f.real**2 + f.imag**2
    speed = pressure - rates[:, None, None] * eta
    springs = inner_product(spectra[1:], square(eta), padded)
    stored = 0.5 * inner_product(spectra[0], square(pressure), padded) + 0.5 * jnp.sum(rates * springs)
    return stored, jnp.sum(inner_product(spectra[1:], square(speed), padded))


def clearance(pressure: Array, ratio: Array) -> Array:
    """Free cells [along x] between the contact and the window's sides -x, +x; -y, +y, (2, 2)."""
    rows, columns = jnp.any(pressure > 0.0, 1), jnp.any(pressure > 0.0, 0)
    free = lambda active: jnp.where(jnp.any(active), jnp.argmax(active), active.size)
    along_x = jnp.stack([free(rows), free(rows[::-1])])
    return jnp.stack([along_x, jnp.stack([free(columns), free(columns[::-1])]) * ratio])


def dropped_share(tails: Array, lost: Array, clear: Array) -> tuple[Array, Array]:
    """What history that left the window may still do: largest displacement in contact, and whether it is under it.

    tails: response at offsets along x, (K, nx), falling with the distance; lost: sums of that history, (K,);
    clear: cells between the contact and where history was lost, (2, 2) as in ``clearance``.
    """
    nearest = jnp.min(clear)
    distance = jnp.clip(nearest, 0, tails.shape[1] - 1).astype(int)
    return jnp.sum(jnp.abs(tails[:, distance]) * jnp.abs(lost)), nearest <= 0.0
