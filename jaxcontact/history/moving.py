"""Memory that moves past the indenter.

Fields are kept in the indenter's frame. Over a body that the indenter crosses with velocity v they obey

    u = C_0 * p + sum_k lambda_k C_k * eta_k,      d eta_k/dt - v . grad eta_k = p - lambda_k eta_k,

so that the Fourier mode k of eta_k decays at the complex rate lambda_k - i k . v. For a pressure linear
over a step dt the update is exact: with z = (lambda - i k . v) dt and the integrals of the exponential,

    eta(t + dt) = exp(-z) eta + dt psi(z) p(t) + dt phi2(z) p(t + dt),

for any step, sub-pixel or many pixels, and without any error where p is steady. (Theory: the exponential
integrator of ``history.recursive`` along the characteristics, in Fourier space.)

The modes are those of the zero-padded grid. Behind the window, in the padding, an absorbing layer takes a
share of the fields for each length that they move, so that nothing wraps around; what it takes is summed
up and bounds what was left out. Along a periodic axis there is no padding, and what leaves on one side comes in on
the other: the indenter has others like it before and behind.

With friction the traction mu p e, e the unit vector of the motion, is remembered as p is, by the components of e and at
rates of its own.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.exponential import ramps
from jaxcontact._support.pytree import pytree
from jaxcontact.history.memory import Memory, Prediction
from jaxcontact.history.observables import Observer, clearance, energies, truncation_of
from jaxcontact.history.step_error import Delayed
from jaxcontact.operators import spectral
from jaxcontact.operators.base import Operator
from jaxcontact.operators.film import deepest_strain
from jaxcontact.operators.kernels import Kernels
from jaxcontact.operators.moving import Moving
from jaxcontact.operators.rubbing import Rubbing

ABSORPTION = 40.0  # the layer lets exp(-40) through
ABSORB_AFTER = 1 / 32  # of the padded length moved
NEVER = 1e9  # cells: nothing was lost


class Shift(NamedTuple):
    """Displacement of the indenter along x and y; y is None when it moves along x only."""

    x: Array
    y: Array | None


class Motion(NamedTuple):
    """One step: dt [s], the shift in it [cells along x], and the unit vector of the velocity at its end, (2,)."""

    dt: Array
    shift: Shift
    direction: Array


def along(shape: tuple[int, int], shift: Shift, ratio: Array | float) -> tuple[Array, Array]:
    """k . shift, and the rate at which modes without a direction die, on the padded grid of ``shape``.

    Both (1, mx), or (my/2 + 1, mx) where the shift has a y. ratio: dy/dx. The highest mode of an even
    grid stands for both signs of its wavenumber: it cannot be moved, only wiped out as it would be.
    """
    mx, my = shape
    m = 2.0 * jnp.pi * jnp.fft.fftfreq(mx)
    highest = (jnp.arange(mx) == mx // 2) & (mx % 2 == 0)
    phase, loss = jnp.where(highest, 0.0, m) * shift.x, jnp.where(highest, jnp.abs(m * shift.x), 0.0)
    if shift.y is None:
        return phase[None], loss[None]
    n = 2.0 * jnp.pi * jnp.fft.rfftfreq(my) / ratio
    highest = (jnp.arange(n.size) == my // 2) & (my % 2 == 0)
    phase = phase + (jnp.where(highest, 0.0, n) * shift.y)[:, None]
    return phase, loss + jnp.where(highest, jnp.abs(n * shift.y), 0.0)[:, None]


def step_weights(rates: Array, motion: Motion, shape: tuple[int, int], ratio: Array) -> tuple[Array, ...]:
    """Weights of eta, p(t) and p(t + dt) of the module's update, each (K, 1 or my/2 + 1, mx)."""
    phase, loss = along(shape, motion.shift, ratio)
    decay, old, new = ramps((rates * motion.dt)[:, None, None] + jax.lax.complex(loss, -phase))
    return decay, motion.dt * old, motion.dt * new


class Trail(NamedTuple):
    """Position of the track towards the sides -x, +x; -y, +y, each (2, 2) [cells along x].

    reach: how far the track reaches from the indenter; inside: how far inside the window's side the place
    is where history was lost through it, if it was.
    """

    reach: Array
    inside: Array


class Fields(NamedTuple):
    """State of a moving memory.

    eta: spectra (K, my/2 + 1, mx); pressure: the last one's spectrum; sheared: that of ``Rubbing.sheared``, or None where it
    is the same; moved: (2,), share of the padded lengths
    since the last absorption; lost: sums of what was absorbed, decaying as it would have, (K,); trail: where
    it lay; truncation_bound, overlaps: bound on the displacement in contact that lost history would still cause, and
    whether it may lie under the contact, ().
    """

    eta: Array
    pressure: Array
    sheared: Array | None
    moved: Array
    lost: Array
    trail: Trail
    truncation_bound: Array
    overlaps: Array


@pytree
class MovingMemory(Memory):
    """Fields: ``Fields``; step: a ``Motion``. One spectrum for each rate.

    spectra: C_0 and lambda_k C_k, (K + 1, my/2 + 1, mx), those of the pressure before those of the traction; circulants:
    of the former alone; rates [1/s], (K,); sources: of eta_k, in parts of p, p e_x and p e_y, (K, 3); rubbed: C_0 of the
    traction along x and y, (2, my/2 + 1, mx), and rubbing: friction, or both None; tails: lambda_k C_k [1/s] at offsets
    along x, (K, nx); ratio: dy/dx, ().
    """

    spectra: Array
    circulants: Array
    rates: Array
    sources: Array
    rubbed: Array | None
    rubbing: Rubbing | None
    tails: Array
    ratio: Array
    kernels: Kernels
    observer: Observer

    @property
    def inherits(self) -> bool:
        """True if there is any rate, as in ``RecursiveMemory``."""
        return self.rates.shape[0] > 0

    @property
    def _periodic(self) -> spectral.Periodic:
        return self.kernels.family.members.periodic

    def _padded(self, shape: tuple[int, ...]) -> tuple[int, int]:
        return spectral.padded_shape(shape, self._periodic)

    def start(self, shape: tuple[int, int]) -> Fields:
        mx, my = self._padded(shape)
        zero = jnp.zeros((my // 2 + 1, mx), complex)
        return Fields(
            jnp.broadcast_to(zero, (self.rates.size, *zero.shape)),
            zero,
            zero if self._varies else None,
            jnp.zeros(2),
            jnp.zeros(self.rates.size),
            Trail(jnp.zeros((2, 2)), jnp.full((2, 2), -NEVER)),
            jnp.zeros(()),
            jnp.zeros((), bool),
        )

    def predict(self, fields: Fields, pressure: Array, motion: Motion) -> Prediction:
        shape = pressure.shape
        fields = absorb(fields, motion, self.ratio, shape, self._periodic)
        decay, old, new = step_weights(self.rates, motion, self._padded(shape), self.ratio)
        eta = decay * fields.eta + old * self._source(motion, fields)
        earlier = spectral.inverse(jnp.sum(self.spectra[1:] * eta, 0), shape, self._periodic)
        on_grid = step_weights(self.kernels.rates, motion, shape, self.ratio)[2]
        now = lambda parts, weights: parts[0] + jnp.sum(parts[1:] * weights, 0)
        of_pressure, of_traction = self._shares(motion)
        operator: Operator = Moving(
            now(self.spectra, new * of_pressure), now(self.circulants, on_grid), self._periodic
        )
        if self.rubbed is not None and self.rubbing is not None:
            kernel = jnp.tensordot(motion.direction, self.rubbed, 1)
            kernel = kernel + jnp.sum(self.spectra[1:] * (new * of_traction), 0)
            operator = self.rubbing.added_to(operator, kernel)
        lost = fields.lost * jnp.exp(-self.rates * motion.dt)
        fields = fields._replace(eta=eta, lost=lost, trail=moved_on(fields.trail, motion.shift))
        return Prediction(operator, earlier, fields)

    def update(self, fields: Fields, pressure: Array, motion: Motion) -> Fields:
        new = step_weights(self.rates, motion, self._padded(pressure.shape), self.ratio)[2]
        fields = fields._replace(pressure=spectral.transform(pressure, self._periodic))
        if self.rubbing is not None and self._varies:
            sheared = spectral.transform(self.rubbing.sheared(pressure), self._periodic)
            fields = fields._replace(sheared=sheared)
        clear = clearance(pressure, self.ratio)
        trail = with_losses(fields.trail, clear)
        truncation_bound, overlaps = truncation_of(self.tails, fields.lost, clear - trail.inside)
        return fields._replace(
            eta=fields.eta + new * self._source(motion, fields),
            trail=trail,
            truncation_bound=truncation_bound,
            overlaps=overlaps,
        )

    @property
    def _varies(self) -> bool:
        """True if the coefficient of friction is a field."""
        return self.rubbing is not None and self.rubbing.weights is not None

    def _shares(self, motion: Motion) -> tuple[Array, Array]:
        """Return how much of pressure and traction each field takes in during a step, (K, 1, 1) each."""
        of_traction = self.sources[:, 1:] @ motion.direction
        return self.sources[:, 0, None, None], of_traction[:, None, None]

    def _source(self, motion: Motion, fields: Fields) -> Array:
        """Return the spectrum that each field takes in under the last tractions, (K, my/2 + 1, mx)."""
        of_pressure, of_traction = self._shares(motion)
        if fields.sheared is None:
            return (of_pressure + of_traction) * fields.pressure
        return of_pressure * fields.pressure + of_traction * fields.sheared

    def _by_traction(self, fields: Fields, motion: Motion, shape: tuple[int, int]) -> Array | None:
        """Return the displacement u_q of ``history.observables`` under the traction, (nx, ny); None without friction."""
        if self.rubbed is None:
            return None
        k, last = self.kernels.rates.size, fields.pressure if fields.sheared is None else fields.sheared
        spectrum = jnp.tensordot(motion.direction, self.rubbed, 1) * last
        spectrum = spectrum + jnp.sum(self.spectra[1 + k :] * fields.eta[k:], 0)
        return spectral.inverse(spectrum, shape, self._periodic)

    def delayed(self, fields: Fields, pressure: Array) -> Delayed:
        """Return that of the pressure; friction adds little to it."""
        return Delayed(self.kernels.rates, self.kernels.delayed_shares(pressure))

    def observe(self, fields: Fields, pressure: Array, motion: Motion) -> dict[str, Array]:
        """Return the observables of ``history.observables`` beside the strain of the film."""
        k, padded = self.kernels.rates.size, self._padded(pressure.shape)
        spectra, eta = self.spectra[: k + 1].real, fields.eta[:k]
        stored, dissipated = energies(spectra, self.rates[:k], eta, fields.pressure, padded)
        force, centre, leading_peak = self.observer.surface(pressure, motion.direction)
        hysteresis, coulomb = self._against_the_motion(fields, pressure, motion)
        return {
            "film_strain": self._film_strain(fields, pressure),
            "lateral_force": force,
            "hysteresis_force": hysteresis,
            "coulomb_force": coulomb,
            "pressure_centre": centre,
            "leading_peak": leading_peak,
            "stored_energy": stored,
            "hysteresis_power": dissipated,
            "truncation_bound": fields.truncation_bound,
        }

    def _against_the_motion(self, fields: Fields, pressure: Array, motion: Motion) -> tuple[Array, Array]:
        """Return hysteresis force and Coulomb's against the motion, () each."""
        hysteresis = coulomb = jnp.zeros(())
        if self.inherits:
            by_traction = self._by_traction(fields, motion, pressure.shape)
            hysteresis = self.observer.hysteresis(pressure, by_traction, motion.direction)
        if self.rubbing is not None:
            coulomb = self.rubbing.coulomb_force(pressure) * jnp.sum(motion.direction**2)
        return hysteresis, coulomb

    def _film_strain(self, fields: Fields, pressure: Array) -> Array:
        film = self.kernels.film
        if film is None:
            return jnp.zeros(())
        history = jnp.tensordot(film.weights[1:], fields.eta[: self.kernels.rates.size], 1)
        history = spectral.inverse(history, pressure.shape, self._periodic)
        return deepest_strain(film.coefficients, film.weights[0] * pressure + history)


def moving_memory(
    kernels: Kernels, profile: Array, ratio: Array, rubbing: Rubbing | None = None
) -> MovingMemory:
    """The memory with one spectrum for each rate; profile: (nx, ny), scaled; rubbing: of friction, on the grid."""
    shape = profile.shape
    own = lambda a: jnp.concatenate([a[:1], jnp.tensordot(kernels.mix.T, a[1:], 1)])
    spectra, rates = own(kernels.family.members.spectrum), kernels.rates
    sources, rubbed = jnp.zeros((rates.size, 3)).at[:, 0].set(1.0), None
    if rubbing is not None:
        all_of_it = rubbing.spectra(shape)
        rubbed, lasting = all_of_it[0], rubbing.lasting(all_of_it)
        spectra = jnp.concatenate([spectra, lasting[:, 0], lasting[:, 1]])
        rates = jnp.concatenate([rates, rubbing.rates, rubbing.rates])
        sources = jnp.concatenate([sources, jnp.repeat(jnp.eye(3)[1:], rubbing.rates.size, 0)])
    return MovingMemory(
        spectra,
        own(kernels.family.members.circulant),
        rates,
        sources,
        rubbed,
        rubbing,
        spectral.inverse(spectra[1:], shape, kernels.family.members.periodic)[:, :, 0],
        ratio,
        kernels,
        Observer.of(profile, ratio, kernels.family.members.periodic),
    )


def absorption(n: int, padded: int) -> Array:
    """Per cell moved: zero in the window of n cells, a bump in the padding if there is any, (padded,)."""
    i = jnp.arange(padded)
    length = padded - n + 1
    bump = jnp.sin(jnp.pi * (i - n + 1) / length) ** 2 * (2.0 * ABSORPTION / length)
    return jnp.where(i < n, 0.0, bump)


def absorb(
    fields: Fields, motion: Motion, ratio: Array, shape: tuple[int, int], periodic: spectral.Periodic
) -> Fields:
    """Let the absorbing layer act for the way moved since it last did, once that is long enough."""
    if all(periodic):
        return fields
    (nx, ny), (mx, my) = shape, spectral.padded_shape(shape, periodic)
    across = motion.shift.y is not None
    way_y = jnp.abs(motion.shift.y) / (ratio * my) if across else jnp.zeros(())
    moved = fields.moved + jnp.stack([jnp.abs(motion.shift.x) / mx, way_y])

    def act(fields: Fields) -> tuple[Array, Array]:
        rows = jnp.fft.ifft(fields.eta, axis=-1) * jnp.exp(-absorption(nx, mx) * mx * moved[0])
        if across and not periodic[1]:
            share = jnp.exp(-absorption(ny, my) * my * moved[1])[:, None]
            rows = jnp.fft.rfft(share * jnp.fft.irfft(rows, n=my, axis=-2), axis=-2)
        eta = jnp.fft.fft(rows, axis=-1)
        return eta, fields.lost + (fields.eta - eta)[:, 0, 0].real

    due = jnp.max(moved) >= ABSORB_AFTER
    eta, lost = jax.lax.cond(due, act, lambda f: (f.eta, f.lost), fields)
    return fields._replace(eta=eta, moved=jnp.where(due, 0.0, moved), lost=lost)


def moved_on(trail: Trail, shift: Shift) -> Trail:
    """The trail from the indenter's new place."""
    moved = jnp.stack([shift.x, jnp.zeros_like(shift.x) if shift.y is None else shift.y])
    away = moved[:, None] * jnp.array([1.0, -1.0])
    return Trail(jnp.maximum(trail.reach + away, 0.0), trail.inside - away)


def with_losses(trail: Trail, clear: Array) -> Trail:
    """The trail, where the end of the track with the contact upon it is now beyond the window's side."""
    return trail._replace(inside=jnp.where(trail.reach > clear, jnp.maximum(trail.inside, 0.0), trail.inside))
