"""Observables of sliding beyond the pressure: horizontal force, pressure centre, energies. All scaled.

Force. The pressure acts normal to the indenter's surface z = approach - f(x, y), so that it pushes the
indenter with the lateral force

    F = -int p grad f dA.

It opposes the motion where the pressure leans to the leading side. With friction the traction q = mu p e displaces the
surface as well, by u_q, and the pressure acts as if on the profile f + u_q. The hysteresis force is the part that
the pressure needs for the displacement that it causes itself,

    F_h = -int p grad (f + u_q) dA = int p grad u_p dA,

which is zero on an elastic body, and times the speed the power of the dashpots in the steady state. The difference,
int p grad u_q dA, is of the order of Dundurs' constant times mu W times a slope of the profile. Linear theory knows such
terms in part only (the slope under the traction and the elastic part of the slip velocity are of the same order), so that
the totals below leave them out: the coefficient of friction of an elastic body is mu.

Sign convention of all results of sliding and rolling: a force against the motion of the indenter and a power that is lost
are positive. Totals, with Coulomb's force F_c = int mu p dA against the motion:

    tangential_force = F_h + F_c,      power = hysteresis_power + friction_power,      friction_power = F_c |v|.

Energy. The body is a chain of springs and dashpots (``history.recursive``): with rates
d eta_k = p - lambda_k eta_k, taken with the material,

    stored = 1/2 <p, C_0 p> + 1/2 sum_k lambda_k <eta_k, (lambda_k C_k) eta_k>,
    dissipated = sum_k <d eta_k, (lambda_k C_k) d eta_k>,

and -F_h . v + load * rate of approach = d stored/dt + dissipated as long as nothing leaves the window. In the
steady state, where the track carries stored energy away to dissipate it later, the dashpots take

    -F_h . v = sum_k <p, (lambda_k C_k) d eta_k>.

The sums are taken over Fourier modes (Parseval).
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree
from jaxcontact.operators import spectral

# weights of the differences across 2, 4 and 6 cells in a slope of sixth order
SIXTH = 45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0
WALL = 1.0  # a profile steeper than this is a wall, on which linear theory says nothing

NOISE = 1e-5  # of the largest pressure: below it a traction may be an error of the solver


@pytree
class Observer:
    """slopes of the profile and cell coordinates, each (2, nx, ny) [in units of dx]; ratio: dy/dx, ()."""

    slopes: Array
    places: Array
    ratio: Array

    @classmethod
    def of(cls, profile: Array, ratio: Array, periodic: spectral.Periodic = spectral.FREE) -> "Observer":
        nx, ny = profile.shape
        slopes = jnp.stack(
            [_slope(profile, axis, wraps, (1.0, ratio)[axis]) for axis, wraps in enumerate(periodic)]
        )
        x, y = jnp.arange(nx) - (nx - 1) / 2, (jnp.arange(ny) - (ny - 1) / 2) * ratio
        places = jnp.stack([jnp.broadcast_to(x[:, None], (nx, ny)), jnp.broadcast_to(y, (nx, ny))])
        return cls(jnp.where(jnp.abs(slopes) < WALL, slopes, 0.0), places, jnp.asarray(ratio))

    def hysteresis(self, pressure: Array, by_traction: Array | None, direction: Array) -> Array:
        """Return F_h against the motion, (); by_traction: the displacement u_q, (nx, ny), None without friction."""
        slopes = self.slopes
        if by_traction is not None:
            along_x, along_y = (_central(by_traction, axis, False) for axis in (0, 1))
            slopes = slopes + jnp.stack([along_x, along_y / self.ratio])  # bent at the edge of contact
        return jnp.sum(jnp.tensordot(direction, slopes, 1) * pressure)

    def surface(self, pressure: Array, direction: Array) -> tuple[Array, Array, Array]:
        """Return the lateral force (2,), the centre (2,), and the peak ahead of the axis, ()."""
        total = jnp.sum(pressure)
        force = -jnp.sum(self.slopes * pressure, (1, 2))
        centre = jnp.sum(self.places * pressure, (1, 2)) / jnp.where(total > 0.0, total, 1.0)
        ahead = jnp.tensordot(direction, self.places, 1) >= 0.0
        return force, centre, jnp.max(jnp.where(ahead, pressure, 0.0))


def _central(field: Array, axis: int, wraps: bool) -> Array:
    """Return central differences, (nx, ny), one-sided at the ends of an axis that is not periodic; 0 along a single cell."""
    if field.shape[axis] == 1:
        return jnp.zeros_like(field)
    if wraps:
        return (jnp.roll(field, -1, axis) - jnp.roll(field, 1, axis)) / 2.0
    return jnp.asarray(jnp.gradient(field, axis=axis))


def _slope(field: Array, axis: int, wraps: bool, side: Array | float) -> Array:
    """Return the slope along an axis of cells of a side, (nx, ny).

    It is of sixth order: that of a wave of eight cells is 0.15 % too small, and that of central differences 10 %. Central
    differences are used near a wall, which thus does not act beyond its neighbours, and in the three cells at each end of an
    axis that is not periodic.
    """
    n, ahead = field.shape[axis], lambda k: jnp.roll(field, -k, axis)
    central = _central(field, axis, wraps)
    if n <= 2 * len(SIXTH):
        return central / side
    sixth = sum((w * (ahead(k) - ahead(-k)) for k, w in enumerate(SIXTH, 1)), start=jnp.zeros_like(field))
    wall = jnp.abs(ahead(1) - field) >= WALL * side  # between a cell and the next
    reach = range(-len(SIXTH), len(SIXTH))
    smooth = ~jnp.any(jnp.stack([jnp.roll(wall, -k, axis) for k in reach]), 0)
    if not wraps:
        inside = (jnp.arange(n) >= len(SIXTH)) & (jnp.arange(n) < n - len(SIXTH))
        smooth = smooth & jnp.expand_dims(inside, 1 - axis)
    return jnp.where(smooth, sixth, central) / side


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
    """Free cells [along x] between the contact and the window's sides -x, +x; -y, +y, (2, 2).

    With adhesion the tractions of cells that do not touch are those of the attraction up to the solver's tolerance.
    """
    pressed = pressure > NOISE * jnp.max(jnp.abs(pressure))
    rows, columns = jnp.any(pressed, 1), jnp.any(pressed, 0)
    free = lambda active: jnp.where(jnp.any(active), jnp.argmax(active), active.size)
    along_x = jnp.stack([free(rows), free(rows[::-1])])
    return jnp.stack([along_x, jnp.stack([free(columns), free(columns[::-1])]) * ratio])


def truncation_of(tails: Array, lost: Array, clear: Array) -> tuple[Array, Array]:
    """Return the largest displacement in contact due to history that left the window, and whether it may lie under the
    contact.

    tails: response at offsets along x, (K, nx), falling with the distance; lost: sums of that history, (K,);
    clear: cells between the contact and where history was lost, (2, 2) as in ``clearance``.
    """
    nearest = jnp.min(clear)
    distance = jnp.clip(nearest, 0, tails.shape[1] - 1).astype(int)
    return jnp.sum(jnp.abs(tails[:, distance]) * jnp.abs(lost)), nearest <= 0.0
