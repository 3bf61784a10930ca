"""Steady sliding: the limit of a long run, as one contact problem.

From the top: ``Wake``, the operator of a pressure that has always slid over the body; ``FilmWake``, that operator over a
film whose thickness varies across the track; ``FrictionWake``, the displacement under the traction; and the public function
``slide_steady``, whose program ``_run`` makes the operator, solves the contact once, and computes forces and powers.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.programs import Program
from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace, static
from jaxcontact._support.reductions import lowest_point
from jaxcontact._support.status import Status, most_serious
from jaxcontact.bodies.body import LayeredHalfSpace, separate_map
from jaxcontact.bodies.controls import Approach, Control
from jaxcontact.bodies.grid import Grid
from jaxcontact.bodies.laws import Adhesion
from jaxcontact.contact import nonsymmetric
from jaxcontact.contact.adhesive import Drag
from jaxcontact.contact.implicit import solve_contact
from jaxcontact.contact.normal import Problem
from jaxcontact.history.memory import Observer, RecursiveMemory, Way, phase_and_loss
from jaxcontact.history.motion import (
    as_array,
    as_vector,
    check_along_x,
    check_shape_of_velocity,
    check_sliding_friction,
    unit_vectors,
)
from jaxcontact.history.normal_step import contact_outcome, initial_adhesion, solve_step, status_of
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.operators import spectral
from jaxcontact.operators.kernels import (
    Errors,
    FrictionKernels,
    Kernels,
    VaryingFilmStrain,
    build_surface,
    deepest_strain,
    friction_kernels,
    friction_kernels_of_indenter,
    joint_errors,
)
from jaxcontact.operators.operator import Family, Operator, series_entries
from jaxcontact.response.stack import creeps_far, is_fluid
from jaxcontact.response.tangential import tangential_expansion
from jaxcontact.results.contact import SteadySliding, with_totals
from jaxcontact.simulate.run import Experiment, reported

# The displacement under an indenter in steady sliding, as one operator on its pressure.
#
# A pressure that is steady in the indenter's frame has left, at rate lambda_k, the history
#
#     eta_k(x) = int_0^T exp(-lambda_k s) p(x + v s) ds,      u = C_0 * p + sum_k lambda_k C_k * eta_k,
#
# with T to infinity. In Fourier space u/p is then the complex compliance at the frequency -k . v. Here T is the time to
# cross the grid, so that each mode has the factor T phi(z), phi = (1 - exp(-z))/z, z = (lambda_k - i k . v) T: finite for
# every rate and mode, unlimited flow included, and without wrapping around on a grid of twice the size, where the
# kernel is made, and then cut to the offsets on the grid.
#
# What lies farther behind has no effect through a film on an elastic or rigid base. A half-space or a substrate that
# creeps has an additional displacement as of a line of point sources, with lambda_k C_k at wavenumber zero, (1 - nu)
# fluidity_k for a half-space,
#
#     C_far(x) = (lambda_k C_k)(0)/(2 pi) int_T^infinity exp(-lambda_k s)/|x + v s| ds.
#
# For lambda = 0 this grows with the logarithm of the length of the track, the same everywhere: the
# pressure is steady, while the approach drifts by (1 - nu) fluidity W/(2 pi v) for each e-fold.
#
# In plane strain these are line sources, and in place of 1/(2 pi |r|) stands -ln(|r|/d)/pi with the datum d of
# ``response.coefficients``. For lambda = 0 the surface would tilt without limit: there is no steady
# state.
#
# On a periodic grid T is infinity, eta_k/p = 1/(lambda_k - i k . v), and each indenter runs in the tracks of others.


AT_REST = 1e-30  # smallest speed in a quotient [cells/s]
FAR_NODES, FAR_WEIGHTS = np.polynomial.legendre.leggauss(40)  # in the logarithm of the distance
FAR_REACH = 14.0  # range of the integrals over the track beyond the grid, in e-folds of the distance


@pytree
class Wake:
    """The wake of an indenter in steady sliding.

    kernels: of the grid; shapes: spectra of S_m on the doubled grid, (M, MY/2 + 1, MX); velocity (2,) [cells
    along x per second]; ratio: dy/dx; far_off: ``stack.creeps_far``; shape: (nx, ny) of the grid; across:
    whether the velocity may have a y, without which its modes are the same for all wavenumbers along y, with
    one row in place of MY/2 + 1. Along a periodic axis neither grid is padded or doubled.
    """

    kernels: Kernels
    shapes: Array
    velocity: Array
    ratio: Array
    far_off: bool = static()
    shape: tuple[int, int] = static()
    across: bool = static()

    @property
    def periodic(self) -> spectral.Periodic:
        return self.kernels.family.periodic

    @property
    def crossing_time(self) -> Array:
        """T [s] to cross the grid along the velocity."""
        sides = jnp.stack([self.shape[0] * jnp.ones(()), self.shape[1] * self.ratio])
        return 1.0 / jnp.maximum(jnp.max(jnp.abs(self.velocity) / sides), AT_REST)

    @property
    def line(self) -> bool:
        """True in plane strain."""
        return self.shape[1] == 1

    @property
    def length(self) -> Array:
        """Length of the track within the grid, [cells along x]."""
        return self.speed * self.crossing_time

    @property
    def speed(self) -> Array:
        """[cells along x per second], never quite zero."""
        square = jnp.sum(self.velocity**2)
        return jnp.sqrt(jnp.maximum(square, AT_REST**2))

    @property
    def direction(self) -> Array:
        """Unit vector of the velocity, zero at rest, (2,)."""
        return unit_vectors(self.velocity)

    def move(self, time: Array | float) -> Way:
        """Return the move of the indenter in a time [s]."""
        return Way(self.velocity[0] * time, self.velocity[1] * time if self.across else None)

    def symbols(self) -> Array:
        """Return eta_k over p at each mode [s], (K, 1 or MY/2 + 1, MX) on the doubled grid."""
        if all(self.periodic):
            phase, loss = phase_and_loss(self.shape, self.move(1.0), self.ratio)
            z = self.kernels.rates[:, None, None] + jax.lax.complex(loss, -phase)
            # 1/z; zero for a mean pressure on a fluid, which does nothing on a periodic grid
            return jnp.where(z == 0.0, 0.0, 1.0 / jnp.where(z == 0.0, 1.0, z))
        return self.passage(self.kernels.rates)

    def passage(self, rates: Array) -> Array:
        """Return eta_k over p for any rates (K,), as ``symbols``, on a grid that is not periodic along both axes."""
        T = self.crossing_time
        padded = spectral.padded_shape(doubled(self.shape, self.periodic), self.periodic)
        phase, loss = phase_and_loss(padded, self.move(T), self.ratio)
        return T * phi1((rates * T)[:, None, None] + jax.lax.complex(loss, -phase))

    def kernel(self, weights: Array, symbols: Array) -> Array:
        """Return the spectrum (my/2 + 1, mx) of sum_k weights_k lambda_k C_k * eta_k over p, with weights (K,)."""
        mixed = jnp.tensordot(self.kernels.mix * weights, symbols, 1)
        near = jnp.sum(self.shapes * mixed, 0)
        if not self.far_off or all(self.periodic):
            return spectrum_on_grid(near, self.shape, self.periodic)
        return spectrum_on_grid(near, self.shape, self.periodic, jnp.tensordot(weights, self.far(), 1))

    def without_history(self, weights: Array) -> Array:
        """Return the spectrum (my/2 + 1, mx) of C_0 + sum_k weights_k lambda_k C_k."""
        mixed = jnp.append(1.0, self.kernels.mix @ weights)
        return jnp.tensordot(mixed, self.kernels.family.spectrum, 1)

    def circulant(self) -> Array:
        """Return C_0 + sum_k lambda_k C_k/(lambda_k + 1/T - i k . v), for the preconditioner, (ny/2 + 1, nx).

        The damping 1/T stands for the end of the track; each term has a real part above zero.
        """
        parts = self.kernels.family.circulant
        own = jnp.tensordot(self.kernels.mix.T, parts[1:], 1)
        phase, loss = phase_and_loss(self.shape, self.move(1.0), self.ratio)
        damping = (self.kernels.rates + 1.0 / self.crossing_time)[:, None, None]
        return parts[0] + jnp.sum(own / (damping + jax.lax.complex(loss, -phase)), 0)

    def operator(self, symbols: Array) -> Operator:
        """Return the operator from the pressure to the displacement: C_0 and all that earlier pressure has left."""
        ones = jnp.ones(self.kernels.rates.size)
        spectrum = self.without_history(0.0 * ones) + self.kernel(ones, symbols)
        return Operator(spectrum[None], self.circulant(), periodic=self.periodic)

    def lost_power(self, symbols: Array, pressure: Array) -> Array:
        """Return the power that the dashpots of the body dissipate, ()."""
        lost = spectral.convolve(self.lost_spectrum(symbols), pressure, self.periodic)
        return jnp.sum(pressure * lost)

    def lost_spectrum(self, symbols: Array) -> Array:
        """Return the spectrum (my/2 + 1, mx) of sum_k lambda_k C_k (p - lambda_k eta_k), a speed of dashpots, over p."""
        rates = self.kernels.rates
        speeds = self.without_history(jnp.ones_like(rates)) - self.without_history(jnp.zeros_like(rates))
        return speeds - self.kernel(rates, symbols)

    def film_strain(self, symbols: Array, pressure: Array) -> Array:
        """Return the shortening of the film over its thickness at its deepest point, (); zero without a film."""
        film = self.kernels.film_strain
        if film is None:
            return jnp.zeros(())
        history = spectral.convolve(self.film_history(symbols), pressure, self.periodic)
        return deepest_strain(film.coefficients, film.weights[0] * pressure + history)

    def film_history(self, symbols: Array) -> Array:
        """Return the spectrum (my/2 + 1, mx) of the film's weighted history over p; there is a film."""
        assert self.kernels.film_strain is not None
        return spectrum_on_grid(
            jnp.tensordot(self.kernels.film_strain.weights[1:], symbols, 1), self.shape, self.periodic
        )

    def far(self) -> Array:
        """Return the part of lambda_k C_k * eta_k over p that is older than T, in wrap-around order, (K, mx, my)."""
        square = lambda x, y: jnp.maximum(x**2 + y**2, 1.0)
        if self.line:
            varying = self.varying(
                self.kernels.rates, lambda x, y: -jnp.log(square(x, y)), lambda r: -2.0 * jnp.log(r)
            )
            # the part that is the same in all cells, zero for a flow; the doubled grid has twice the datum of the grid
            rates, T = self.kernels.rates, self.crossing_time
            flows = rates == 0.0
            way = jnp.exp(-rates * T) * jnp.log(self.length / (2.0 * self.shape[0])) + jnp.log(2.0)
            tail = exponential_integral(jnp.where(flows, 1.0, rates * T))
            uniform = jnp.where(flows, 0.0, -2.0 * (way + tail) / jnp.where(flows, 1.0, rates))
            beyond = varying + uniform[:, None, None]
        else:
            beyond = self.beyond(self.kernels.rates, lambda x, y: 1.0 / jnp.sqrt(square(x, y)))
        return self._point_strength()[:, None, None] * beyond

    def beyond(
        self, rates: Array, pattern: Callable[[Array, Array], Array], ahead: Array | float = 1.0
    ) -> Array:
        """Return int_T^infinity exp(-lambda_k s) pattern(x + v s) ds, up to a constant where lambda_k is zero, (K, mx, my).

        The pattern is ``ahead``/r straight ahead. x, y in cells along x.
        """
        flows = rates == 0.0
        tail = exponential_integral(jnp.where(flows, 1.0, rates * self.crossing_time)) / self.speed
        uniform = jnp.where(flows, 0.0, tail)
        return self.varying(rates, pattern, lambda r: ahead / r) + ahead * uniform[:, None, None]

    def varying(
        self, rates: Array, pattern: Callable[[Array, Array], Array], ahead: Callable[[Array], Array]
    ) -> Array:
        """Return int_T^infinity exp(-lambda_k s) (pattern(x + v s) - ahead(|v| s)) ds, (K, mx, my)."""
        mx, my = spectral.padded_shape(self.shape, self.periodic)
        x = offsets(mx)[:, None] + jnp.zeros(my)
        y = offsets(my)[None, :] * self.ratio + jnp.zeros((mx, 1))
        T, (vx, vy) = self.crossing_time, self.velocity

        def add(total: Array, node: tuple[Array, Array]) -> tuple[Array, None]:
            s = T * jnp.exp(node[0])
            varying = pattern(x + vx * s, y + vy * s) - ahead(self.speed * s)
            return total + node[1] * s * jnp.exp(-rates * s)[:, None, None] * varying, None

        nodes = (FAR_REACH * (FAR_NODES + 1.0) / 2.0, FAR_WEIGHTS * FAR_REACH / 2.0)
        zero = jnp.zeros((rates.size, mx, my))
        return jax.lax.scan(add, zero, jax.tree.map(jnp.asarray, nodes))[0]

    def drift(self, total: Array) -> Array:
        """Return the growth of the approach for each e-fold of the length of the track, under a sum of pressures, ()."""
        if not self.far_off or any(self.periodic):
            return jnp.zeros(())
        flows = self.kernels.rates == 0.0
        return jnp.sum(jnp.where(flows, self._point_strength(), 0.0)) * total / self.speed

    def _point_strength(self) -> Array:
        """Return the displacement rate at a distance of one cell from a cell of unit pressure, (K,); that of a strip without
        its factor ln(1/d^2)."""
        cell = 1.0 if self.line else self.ratio
        return self.kernels.at_zero @ self.kernels.mix * cell / (2.0 * jnp.pi)


def wake_of(body: LayeredHalfSpace, grid: Grid, kernels: Kernels, velocity: Array, *, across: bool) -> Wake:
    """Return the wake of a pressure in the surface of a body, at a velocity (2,) [cells along x per second].

    kernels: of that surface; across: as in ``Wake``. The wake of a half-space reaches beyond the grid, so that its kernels
    are computed once more on the doubled one.
    """
    far_off = creeps_far(body)
    if not far_off or all(grid.periodic):
        shapes = extended(kernels, grid.shape)
    else:
        wide = replace(grid, shape=doubled(grid.shape, grid.periodic))
        shapes = build_surface(body, wide, kernels.scale, kernels.nodes).family.spectrum[1:]
    return Wake(kernels, shapes, velocity, grid.spacing[1] / grid.spacing[0], far_off, grid.shape, across)


def extended(kernels: Kernels, shape: tuple[int, int]) -> Array:
    """Return the spectra of the S_m of a film on the doubled grid, with kernels that are zero beyond the grid."""
    periodic, spectra = kernels.family.periodic, kernels.family.spectrum[1:]
    if all(periodic):
        return spectra
    nx, ny = doubled(shape, periodic)
    kernel = spectral.inverse(spectra, shape, periodic)
    wide = jnp.pad(kernel, ((0, 0), (0, nx - shape[0]), (0, ny - shape[1])))
    return spectral.kernel_spectrum(wide, periodic)


def exponential_integral(x: Array) -> Array:
    """E1(x) = int_x^infinity exp(-t)/t dt, x > 0: the series below 1.5, the continued fraction above.

    jax.scipy.special.exp1 takes a minute for an array that holds both 1e-6 and 1 (jax 0.10).
    """
    small = x < 1.5
    low, high = jnp.where(small, x, 1.5), jnp.where(small, 1.5, x)
    series, power = -jnp.euler_gamma - jnp.log(low), jnp.ones_like(low)
    for k in range(1, 25):
        power = -power * low / k
        series = series - power / k
    tail = jnp.zeros_like(high)
    for k in range(50, 0, -1):
        tail = k**2 / (high + 2 * k + 1 - tail)
    return jnp.where(small, series, jnp.exp(-high) / (high + 1.0 - tail))


def doubled(shape: tuple[int, int], periodic: spectral.Periodic) -> tuple[int, int]:
    """Return the shape with twice as many cells along each axis that is not periodic."""
    nx, ny = (n if wraps else 2 * n for n, wraps in zip(shape, periodic, strict=True))
    return nx, ny


def offsets(length: int) -> np.ndarray:
    """Return the offsets of a kernel in wrap-around order, (length,)."""
    i = np.arange(length)
    return np.where(i < (length + 1) // 2, i, i - length)


def cut(wide: Array, shape: tuple[int, int], target: tuple[int, int]) -> Array:
    """Return a kernel in wrap-around order on fewer offsets, of the shape ``target``; zero at offsets that do not occur
    between two cells of a grid of ``shape``."""
    for axis in (0, 1):
        at = offsets(target[axis])
        kept = jnp.asarray(np.abs(at) < shape[axis])
        taken = jnp.take(wide, jnp.asarray(at % wide.shape[axis]), axis=axis)
        wide = taken * (kept[:, None] if axis == 0 else kept[None, :])
    return wide


def spectrum_on_grid(
    symbol: Array, shape: tuple[int, int], periodic: spectral.Periodic, far: Array | float = 0.0
) -> Array:
    """Return the spectrum (my/2 + 1, mx) of an operator on the grid from its symbol on the doubled one, (1 or MY/2 + 1, MX).

    far: the kernel of its far part, (mx, my), which is added; not on a grid that is periodic along both axes.
    """
    MX, MY = spectral.padded_shape(doubled(shape, periodic), periodic)
    symbol = jnp.broadcast_to(symbol, (MY // 2 + 1, MX))
    if all(periodic):
        return symbol
    padded = spectral.padded_shape(shape, periodic)
    rows = jnp.swapaxes(jnp.fft.ifft(symbol, axis=-1), -1, -2)
    near = cut(jnp.fft.irfft(rows, n=MY, axis=-1), shape, padded)
    return jnp.swapaxes(jnp.fft.rfft2(near + cut(far + 0.0 * near, shape, padded)), -1, -2)


# The wake over a film whose thickness varies across the track of a steady slide, and not along it.
#
# Along the track the body is then everywhere the same, so that the state is steady in the frame of the indenter. With
# the kernels as a series in the thickness (``operators.kernels``) each term has a wake of its own, whose kernel K_n
# is not even:
#
#     u = 1/2 sum_n [T_n(xi(h)) K_n p + K_n (T_n(xi(h)) p)],
#
# whose transpose is the operator of the motion reversed.


@pytree
class FilmWake:
    """The wake over a film whose thickness varies across the track; its methods are those of ``Wake`` that depend on it.

    terms: the wakes of the terms of the series, with a first axis (n, ...); one: that of a film of one thickness, for all
    that does not depend on the thickness; shares: T_0, T_1, ... at each cell, (n, nx, ny); film: the strain of the film.
    """

    terms: Wake
    one: Wake
    shares: Array
    film: VaryingFilmStrain

    def operator(self, symbols: Array) -> Operator:
        """As ``Wake`` does."""
        found = jax.vmap(lambda wake: wake.operator(symbols))(self.terms)
        mean = jnp.tensordot(jnp.mean(self.shares, (1, 2)), found.circulant, 1)
        return self._varying(found.spectra[:, 0], mean)

    def lost_power(self, symbols: Array, pressure: Array) -> Array:
        """As ``Wake`` does."""
        spectra = jax.vmap(lambda wake: wake.lost_spectrum(symbols))(self.terms)
        return jnp.sum(pressure * self._varying(spectra, spectra[0])(pressure))

    def film_strain(self, symbols: Array, pressure: Array) -> Array:
        """As ``Wake`` does, with a film that is as thick everywhere as at its deepest point."""
        history = spectral.convolve(self.one.film_history(symbols), pressure, self.one.periodic)
        weights = jnp.stack([self.film.weights[0], jnp.ones(())])
        return replace(self.film, weights=weights).strain(pressure, history[None])

    def _varying(self, spectra: Array, circulant: Array) -> Operator:
        entries = series_entries(len(spectra))
        return Operator(spectra, circulant, self.shares[1:], periodic=self.one.periodic, entries=entries)


def film_wake_of(experiment: Experiment, kernels: Kernels, velocity: Array, thickness: Array) -> FilmWake:
    """Return the wake over a film of thickness (nx, ny) [m] at a velocity (2,) along x [cells per second]."""
    body, grid = experiment.body, experiment.grid
    here, varying = kernels.at(thickness), kernels.varying
    assert varying is not None

    def of_term(spectra: Array, circulants: Array) -> Wake:
        family = Family(spectra[:, None], circulants[:, None], periodic=varying.family.periodic)
        return wake_of(body, grid, replace(kernels, family=family), velocity, across=False)

    terms = jax.vmap(of_term, 1)(varying.family.spectra, varying.family.circulants)
    one = wake_of(body, grid, kernels, velocity, across=False)
    return FilmWake(terms, one, varying.series.shares(thickness), here.film_strain)


# What friction adds to the wake: the normal displacement under the traction.
#
# The traction mu p e, e the unit vector of the velocity, leaves a history of its own, at the rates of the tangential
# response,
#
#     u = C_0 * mu p + sum_k lambda_k C_k * mu eta_k,
#
# C the normal displacement under a traction along e. What lies beyond the grid acts on a half-space or a substrate that
# creeps as a line of points, as the pressure does, each with K/(2 pi) (r . e)/r^2 in place of N/(2 pi r).


@pytree
class FrictionWake:
    """The normal displacement of both surfaces under the traction.

    wake: of the pressure; of_body: kernels of friction of the body on the doubled grid; direction: e, (2,), zero at rest;
    of_indenter: those of an indenter that creeps or is coated, on the grid, else None. The indenter is at rest in the frame
    of the traction and has relaxed.
    """

    wake: Wake
    of_body: FrictionKernels
    direction: Array
    of_indenter: FrictionKernels | None

    def added_to(self, operator: Operator) -> Operator:
        """Return the operator with friction."""
        return self.of_body.added_to(operator, self.spectrum())

    def displacement(self, pressure: Array) -> Array:
        """Return the normal displacement of both surfaces under the traction alone, (nx, ny)."""
        return spectral.convolve(self.spectrum(), self.of_body.sheared(pressure), self.wake.periodic)

    def displacement_of_indenter(self, pressure: Array) -> Array | float:
        """Return the part of ``displacement`` of an indenter that creeps or is coated, (nx, ny); 0 of any other."""
        if self.of_indenter is None:
            return 0.0
        return spectral.convolve(self.relaxed(), self.of_body.sheared(pressure), self.wake.periodic)

    def coulomb_force(self, pressure: Array) -> Array:
        """Return the sum of mu p against the motion, (); zero at rest."""
        return self.of_body.coulomb_force(pressure) * jnp.sum(self.direction**2)

    def drift(self, pressure: Array) -> Array:
        """Return the drift of the approach by friction, as ``Wake.drift`` does by the pressure."""
        if not self.wake.far_off:
            return jnp.zeros(())
        flows = self.of_body.rates == 0.0
        strength = self.of_body.point_strength() * self.wake.ratio / (2.0 * jnp.pi)
        total = jnp.sum(self.of_body.sheared(pressure))
        return jnp.sum(jnp.where(flows, strength, 0.0)) * total / self.wake.speed

    def _along_velocity(self, spectra: Array) -> Array:
        """Return the spectra for a traction along the velocity, from those for x and y, (..., 2, my/2 + 1, mx)."""
        return jnp.tensordot(spectra, self.direction, ((-3,), (0,)))

    def relaxed(self) -> Array:
        """Return the spectrum (my/2 + 1, mx) of the indenter's displacement over p, under a traction that lasts for ever."""
        assert self.of_indenter is not None
        spectra, rates = self.of_indenter.spectra(self.wake.shape), self.of_indenter.rates
        times = jnp.where(rates > 0.0, 1.0 / jnp.where(rates > 0.0, rates, 1.0), 0.0)
        return self._along_velocity(spectra[0] + jnp.tensordot(times, self.of_indenter.lasting(spectra), 1))

    def spectrum(self) -> Array:
        """Return the spectrum (my/2 + 1, mx) of ``displacement`` over p, or over mu p where mu varies."""
        # the body: C_0, the track on the grid and, if it creeps far, that beyond
        shape, periodic, kernels = self.wake.shape, self.wake.periodic, self.of_body
        found = self._along_velocity(kernels.spectra(shape)[0])
        if kernels.rates.size:
            wide = self._along_velocity(kernels.lasting(kernels.spectra(doubled(shape, periodic))))
            near = jnp.sum(wide * self.wake.passage(kernels.rates), 0)
            far = self._far() if self.wake.far_off else 0.0
            found = found + spectrum_on_grid(near, shape, periodic, far)
        return found if self.of_indenter is None else found + self.relaxed()

    def _far(self) -> Array:
        """Return the displacement over p due to the track beyond the grid, in wrap-around order, (mx, my)."""
        e = self.direction
        ahead = lambda x, y: (e[0] * x + e[1] * y) / jnp.maximum(x**2 + y**2, 1.0)
        strength = self.of_body.point_strength() * self.wake.ratio / (2.0 * jnp.pi)
        return jnp.tensordot(strength, self.wake.beyond(self.of_body.rates, ahead), 1)


# largest change of the thickness along the track that counts as none, over the largest thickness
UNIFORM = 1e-9


def slide_steady(
    body: LayeredHalfSpace,
    indenter: Indenter,
    control: Control,
    *,
    velocity: Array | float,
    grid: Grid,
    tolerance: Array | float = 1e-8,
    max_iterations: Array | int = 500,
    kernels: Kernels | None = None,
    friction: Array | float | None = None,
    adhesion: Adhesion | None = None,
    shear_strength: Array | float | None = None,
) -> SteadySliding:
    """Compute the steady state of an indenter that slides over a body at constant velocity.

        u(x) = int_0^infinity dK/ds * p(x + v s) ds,   g = profile + u - approach >= 0,   p >= 0,   p g = 0

    The steady state is the solution of a single contact problem with an unsymmetric kernel, and is differentiable. At
    zero velocity a body without steady-state flow is fully relaxed. On a half-space with steady-state flow under a load
    the pressure is steady, while the approach grows; see ``approach_drift`` of the result.

    With friction, the traction mu p along the velocity also causes normal displacement unless the two solids are
    elastically similar, and changes the pressure, on elastic bodies too (K. L. Johnson, Contact Mechanics, 1985, section
    7.1).

    Args:
        body: as in ``indent``; the thickness of the only layer on an elastic substrate may also vary across the track,
            (nx, ny) with equal values along x, if the velocity is a number and there is no friction. The film's surface is
            then higher where it is thicker.
        indenter, grid, tolerance, max_iterations, kernels: as in ``indent``. Kernels of a half-space save little
            time, since its wake is computed on a larger grid. The surface of an indenter that creeps or is coated is at rest
            in its own frame, so that in the steady state it has relaxed; its material does not flow without limit.
        control: as in ``indent``, with a single value.
        velocity: velocity of the indenter over the body [m/s], of any magnitude: a number (along x) or (2,).
        friction: coefficient of Coulomb friction mu >= 0, a number or (nx, ny) in the frame of the indenter; all of the
            contact slips. It needs a grid that is not periodic. With None, and at zero velocity, there is no traction.
            ``friction_coefficient`` of the result is the total, which includes hysteresis.
        adhesion: as in ``indent``; the control may then be negative. Coulomb's friction is mu times the pressure that
            contact carries, the net pressure plus the attraction (``contact_pressure`` of the result). The surfaces approach
            from a distance, under a load from a contact that is pressed with the size of the load; a state that is reached
            only from a closer contact is found at the end of a long ``slide``. The contact is the fixed point of a sequence
            (``contact.adhesive``), which converges for E0/Einf of up to 10, otherwise the status is 1.
        shear_strength: with adhesion, a shear stress tau [Pa] >= 0, a number or (nx, ny), of all of the contact, beside that
            of Coulomb's law: q = mu p_c + tau where the surfaces touch. None for zero. Cells that touch count whole, as in
            ``shear``.

    Since there is no time integration, there are no arguments ``times``, ``save``, ``substeps`` and ``checkpoint``.

    Returns:
        A ``SteadySliding``; under jit, its status is 6 if there is no steady state. Warnings are as in ``indent``.

    Raises:
        ValueError: invalid or unsupported input; a case without steady state, i.e. a body with steady-state flow at zero
            velocity or on a periodic grid, or a half-space with such flow under a fixed approach or in plane strain; a
            viscoelastic half-space or substrate on a grid that is periodic along one axis with several cells along it.

    Example:
        >>> rubber = jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=1e6, G2=1e6, eta2=1e6, nu=0.5))
        >>> grid = jc.Grid.square(n=24, width=4e-3)
        >>> steady = jc.slide_steady(rubber, jc.Sphere(5e-3), jc.Load(0.1), velocity=5e-4, grid=grid)
        >>> bool(steady.friction_coefficient > 0.0)
        True
    """
    # one velocity and one value of the control
    velocity = as_array(velocity)
    check_shape_of_velocity(velocity)
    check_along_x(np.shape(velocity), grid)
    name, shape = type(control).__name__, np.shape(getattr(control, "value", 0.0))
    checks.require(shape == (), f"{name}: expected one number in the steady state, got shape {shape}")
    body, film_map, valid = separate_map(body, getattr(grid, "shape", ()), 1)
    friction = 0.0 if friction is None and shear_strength is not None else friction
    experiment = Experiment.of(
        body, indenter, control, np.zeros(1), grid, tolerance=tolerance, max_iterations=max_iterations, kernels=kernels,
        film_map=film_map, adhesion=adhesion, shear_strength=shear_strength,
    )  # fmt: skip
    valid = valid & check_steady(experiment, experiment.body, velocity)
    valid = valid & check_sliding_friction(friction, grid, experiment.body, experiment.indenter)
    flows = experiment.indenter.flows()
    checks.require(
        not is_concrete(flows) or not bool(flows),
        "indenter material: expected one that does not flow without limit: its surface stays in the contact, where it creeps"
        " indefinitely, so that there is no steady state",
    )

    # a film that stays as it is in the frame of the indenter: its thickness varies across the track alone
    if film_map is not None:
        thickness = film_map.values
        checks.require(
            np.shape(velocity) == () and not all(grid.periodic) and not film_map.over_times,
            "layer thickness in the plane: expected (nx, ny) with a number as velocity, along x, on a grid that is not"
            f" periodic along both axes, got shape {thickness.shape}, a velocity of shape {np.shape(velocity)}, periodic="
            f"{grid.periodic}",
        )
        checks.require(
            friction is None and kernels is None,
            "layer thickness in the plane: expected no friction and no kernels",
        )
        change = jnp.max(jnp.abs(thickness - thickness[:1]))
        constant = change <= UNIFORM * jnp.max(thickness)
        if not is_concrete(change):
            valid = valid & constant
        else:
            checks.require(
                bool(constant),
                "layer thickness [m]: expected one that varies along y alone, across the track, got changes along x by up"
                f" to {float(change):g}: the film would move through the frame of the indenter; rub with path= computes it",
            )
    experiment = experiment.also(valid)
    result, errors = _run(experiment.with_kernels(), *as_float64((velocity, friction)))
    return reported(result, errors, experiment)


def check_steady(experiment: Experiment, body: LayeredHalfSpace, velocity: Array) -> Verdict:
    """A finite velocity; ValueError where there is no steady state. body: of a surface that moves through the contact."""
    finite = checks.finite("velocity [m/s]", velocity)
    grid = experiment.grid
    checks.require(
        not creeps_far(body) or all(grid.periodic) or not any(grid.periodic) or grid.plane_strain,
        "grid: expected one that is periodic along both axes, along none, or in plane strain, under a half-space or"
        f" substrate that creeps, got periodic={grid.periodic} with {tuple(grid.shape)} cells; slide takes it",
    )
    fluid = is_fluid(body)
    if not is_concrete(fluid, velocity) or not bool(fluid):
        return finite
    checks.require(
        bool(np.any(np.asarray(velocity) != 0.0)),
        "velocity [m/s]: expected not 0: the body flows without limit, so that at rest the contact grows"
        " indefinitely and there is no steady state",
    )
    checks.require(
        not _tilts_or_thins(grid, body),
        "body: expected one that does not flow without limit, on this grid: in plane strain a half-space tilts indefinitely"
        " under an indenter, and on a periodic grid the body creeps indefinitely under the mean pressure",
    )
    checks.require(
        not creeps_far(body) or not isinstance(experiment.control, Approach),
        "control: expected a Load on a half-space or substrate that flows without limit: it creeps indefinitely, so that"
        " under a fixed approach the load decreases to zero and there is no steady state",
    )
    return finite


def _tilts_or_thins(grid: Grid, body: LayeredHalfSpace) -> bool:
    """Return whether a fluid body could have no steady state on this grid."""
    return all(grid.periodic) or (grid.plane_strain and creeps_far(body))


@functools.partial(Program, work=lambda experiment, *_: 8.0 * experiment.work)
def _run(experiment: Experiment, velocity: Array, friction: Array | None) -> tuple[SteadySliding, Errors]:
    """Solve the steady contact and compute all fields of its result; compiled once for equal shapes and flags."""
    # the wake: the response of a body that pressure in this place has passed over for ever
    kernels, grid = experiment.kernels, experiment.grid
    vector = as_vector(velocity)
    cells_per_second = vector / kernels.scale.length
    wake: Wake | FilmWake
    if experiment.film_map is not None:
        wake = film_wake_of(experiment, kernels, cells_per_second, experiment.film_map.values)
    else:
        wake = wake_of(experiment.body, grid, kernels, cells_per_second, across=velocity.ndim > 0)
    one = wake.one if isinstance(wake, FilmWake) else wake
    scale, symbols, direction = one.kernels.scale, one.symbols(), one.direction
    operator = wake.operator(symbols)

    # the traction moves the surface too: in one operator with the pressure or, with adhesion, separately as a drag, which
    # follows the pressure that contact carries; friction over a film of varying thickness is refused by ``slide_steady``
    sheared_wake, drag, mu = None, None, jnp.zeros(()) if friction is None else friction
    if friction is not None and not isinstance(wake, FilmWake):
        wide = replace(grid, shape=doubled(grid.shape, grid.periodic))
        coefficient = friction if experiment.adhesion is None else jnp.ones(())
        expansion = tangential_expansion(experiment.body)
        of_body = friction_kernels(expansion, experiment.indenter, wide, scale, coefficient)
        of_indenter = friction_kernels_of_indenter(experiment.indenter, grid, scale, coefficient)
        sheared_wake = FrictionWake(wake, of_body, direction, of_indenter)
        if experiment.adhesion is None:
            operator = sheared_wake.added_to(operator)
        else:
            strength = jnp.zeros(()) if experiment.shear_strength is None else experiment.shear_strength
            strength = scale.from_si("pressure", strength)
            drag = Drag(replace(operator, spectra=sheared_wake.spectrum()[None]), mu, strength)

    # an indenter that creeps is at rest in its own frame: under a steady pressure it has relaxed
    indenter = None if kernels.indenter is None else RecursiveMemory(kernels.indenter)
    if indenter is not None:
        operator = operator.plus(indenter.steady_operator())

    # the contact, with adhesion from a distance
    profile = experiment.profile / scale.length
    target, solver = experiment.target(scale), (experiment.tolerance, experiment.max_iterations)
    problem = Problem(operator, profile, target, lowest_point(profile), experiment.load_controlled)
    adheres: dict[str, Array] = {}
    if experiment.adhesion is None:
        start = nonsymmetric.cold_start(jax.lax.stop_gradient(problem))
        solution = solve_contact(problem, start, *solver)
    else:
        law = experiment.attraction(scale)
        problem = replace(problem, law=law, drag=drag)
        solution, _, adhesion_numbers = solve_step(
            problem, jnp.zeros_like(profile), initial_adhesion(law, profile), *solver
        )
        adheres = {
            "contact_pressure": solution.carried,
            "cohesive_cells": adhesion_numbers["cohesive_cells"],
        } | {name: values[0] for name, values in experiment.tabor_number.items()}
    status = status_of(problem, solution, experiment.tolerance, experiment.edges)
    status = with_no_steady_state(status, experiment, experiment.body, vector)
    status = most_serious((jnp.asarray(experiment.indenter.flows()), Status.NOT_STEADY), status=status)

    # forces and powers (``history.memory``): the hysteresis force is that of the pressure on the slope of the profile and of
    # what moves the surface apart from the body's memory of the pressure: the traction, and an indenter that creeps
    p, zero = solution.pressure, jnp.zeros(())
    sheared = p if drag is None else drag.traction(solution.carried)
    displaced = None if sheared_wake is None else sheared_wake.displacement(sheared)
    if drag is not None:
        adheres["shear_strength"] = jnp.broadcast_to(drag.strength, profile.shape)
    shown: dict[str, Array] = {}
    if indenter is not None:
        eta = indenter.steady(p)
        pressed = indenter.displacement(eta, p)
        displaced = pressed if displaced is None else displaced + pressed
        moved = pressed if sheared_wake is None else pressed + sheared_wake.displacement_of_indenter(sheared)
        strain = indenter.observe(eta, p, zero)["film_strain"]
        shown = {"indenter_displacement": moved, "indenter_film_strain": strain}
    observer = Observer.of(experiment.indenter.profile(grid) / scale.length, one.ratio, one.periodic)
    pushed, centre, leading = observer.surface(p, direction)
    hysteresis, lost = zero, wake.lost_power(symbols, p)
    if one.kernels.rates.size:
        # a wall at the contact, as of a punch, has no slope on the grid: there by the work of the force in the steady state
        speed = jnp.sqrt(jnp.maximum(jnp.sum(cells_per_second**2), AT_REST**2))
        by_slopes = observer.hysteresis(p, displaced, direction)
        hysteresis = jnp.where(observer.walled(p, direction), lost / speed, by_slopes)
    fields = (
        contact_outcome(problem, solution)
        | shown
        | adheres
        | {
            "profile": problem.gap,
            "displacement": solution.displacement,
            "film_strain": wake.film_strain(symbols, p),
            "lateral_force": pushed,
            "hysteresis_force": hysteresis,
            "coulomb_force": zero if sheared_wake is None else sheared_wake.coulomb_force(sheared),
            "approach_drift": one.drift(jnp.sum(p))
            + (zero if sheared_wake is None else sheared_wake.drift(sheared)),
            "pressure_centre": centre,
            "leading_peak": leading,
            "hysteresis_power": lost,
            "status": status,
        }
    )
    in_si = with_totals(scale.to_si(**fields), vector)
    errors = kernels.errors()
    if sheared_wake is not None:
        tangential = [sheared_wake.of_body, sheared_wake.of_indenter]
        errors = joint_errors(kernels, *(each.expansion for each in tangential if each is not None))
    mu = jnp.broadcast_to(mu, profile.shape)
    return SteadySliding(grid=grid, velocity=vector, friction=mu, **in_si), errors


def with_no_steady_state(
    status: Array, experiment: Experiment, body: LayeredHalfSpace, velocity: Array
) -> Array:
    """Return the status, ``NOT_STEADY`` where a body that flows without limit has no steady state; body: as in
    ``check_steady``."""
    sinks = creeps_far(body) and not experiment.load_controlled
    endless = ~jnp.any(velocity != 0.0) | sinks | _tilts_or_thins(experiment.grid, body)
    return most_serious((is_fluid(body) & endless, Status.NOT_STEADY), status=status)
