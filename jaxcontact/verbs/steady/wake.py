"""The displacement behind an indenter in steady sliding, as one operator.

A pressure that is steady in the indenter's frame has left, at rate lambda_k, the history

    eta_k(x) = int_0^T exp(-lambda_k s) p(x + v s) ds,      u = C_0 * p + sum_k lambda_k C_k * eta_k,

with T to infinity. In Fourier space it is the complex modulus at the frequency -k . v. Here T is the
time to cross the grid, so that each mode has the factor T phi(z), phi = (1 - exp(-z))/z, z = (lambda_k - i k . v) T:
finite for every rate and mode, unlimited flow included, and without wrapping around on a grid of twice
the size, where the kernel is made, and then cut to the offsets on the grid.

What lies farther behind is out of a film's reach. A half-space or a substrate that creeps feels it as a line of
point sources, with lambda_k C_k at wavenumber zero, (1 - nu) fluidity_k for a half-space,

    C_far(x) = (lambda_k C_k)(0)/(2 pi) int_T^infinity exp(-lambda_k s)/|x + v s| ds.

For lambda = 0 this grows with the logarithm of the length of the track, the same everywhere: the
pressure is steady, while the approach drifts by (1 - nu) fluidity W/(2 pi v) for each e-fold.

In plane strain these are line sources, and in place of 1/(2 pi |r|) stands -ln(|r|/d)/pi with the datum d of
``response.influence.line_coefficients``. For lambda = 0 the surface would tilt without limit: there is no steady state.

On a periodic grid T is infinity, eta_k/p = 1/(lambda_k - i k . v), and each indenter runs in the tracks of others.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support.exponential import phi1
from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact.history.moving import Shift, along
from jaxcontact.operators import spectral
from jaxcontact.operators.film import deepest_strain
from jaxcontact.operators.kernels import Kernels, build
from jaxcontact.operators.moving import Moving
from jaxcontact.response.limits import limits_of
from jaxcontact.verbs.experiment import Experiment

AT_REST = 1e-30  # cells per second: slower is this
FAR_NODES, FAR_WEIGHTS = np.polynomial.legendre.leggauss(40)
FAR_REACH = 14.0  # e-folds of distance


@pytree
class Wake:
    """The wake of an indenter in steady sliding.

    kernels: of the grid; shapes: spectra of S_m on the doubled grid, (M, MY/2 + 1, MX); velocity (2,) [cells
    along x per second]; ratio: dy/dx; far_off: ``Response.creeps_far``; shape: (nx, ny) of the grid; across:
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
        return self.kernels.family.members.periodic

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
        square = jnp.sum(self.velocity**2)
        return self.velocity / jnp.sqrt(jnp.where(square > 0.0, square, 1.0))

    def shift(self, time: Array | float) -> Shift:
        """The way in a time."""
        return Shift(self.velocity[0] * time, self.velocity[1] * time if self.across else None)

    def symbols(self) -> Array:
        """eta_k over p at each mode [s], (K, 1 or MY/2 + 1, MX) on the doubled grid."""
        if all(self.periodic):
            phase, loss = along(self.shape, self.shift(1.0), self.ratio)
            return _reciprocal(self.kernels.rates[:, None, None] + jax.lax.complex(loss, -phase))
        return self.passage(self.kernels.rates)

    def passage(self, rates: Array) -> Array:
        """The same for other rates, on a grid that is not periodic."""
        T = self.crossing_time
        padded = spectral.padded_shape(doubled(self.shape, self.periodic), self.periodic)
        phase, loss = along(padded, self.shift(T), self.ratio)
        return T * phi1((rates * T)[:, None, None] + jax.lax.complex(loss, -phase))

    def kernel(self, weights: Array, symbols: Array) -> Array:
        """Spectrum (my/2 + 1, mx) of sum_k weights_k lambda_k C_k * eta_k over p, (K,) weights."""
        mixed = jnp.tensordot(self.kernels.mix * weights, symbols, 1)
        near = jnp.sum(self.shapes * mixed, 0)
        if not self.far_off or all(self.periodic):
            return on_grid(near, self.shape, self.periodic)
        return on_grid(near, self.shape, self.periodic, jnp.tensordot(weights, self.far(), 1))

    def without_history(self, weights: Array) -> Array:
        """Spectrum (my/2 + 1, mx) of C_0 + sum_k weights_k lambda_k C_k."""
        members = self.kernels.family.members
        return jnp.tensordot(jnp.append(1.0, self.kernels.mix @ weights), members.spectrum, 1)

    def circulant(self) -> Array:
        """For the preconditioner, (ny/2 + 1, nx): C_0 + sum_k lambda_k C_k/(lambda_k + 1/T - i k . v).

        The damping 1/T stands for the end of the track; each term has a real part above zero.
        """
        parts = self.kernels.family.members.circulant
        own = jnp.tensordot(self.kernels.mix.T, parts[1:], 1)
        phase, loss = along(self.shape, self.shift(1.0), self.ratio)
        damping = (self.kernels.rates + 1.0 / self.crossing_time)[:, None, None]
        return parts[0] + jnp.sum(own / (damping + jax.lax.complex(loss, -phase)), 0)

    def operator(self, symbols: Array) -> Moving:
        """Pressure -> displacement, C_0 and all that was left behind."""
        ones = jnp.ones(self.kernels.rates.size)
        spectrum = self.without_history(0.0 * ones) + self.kernel(ones, symbols)
        return Moving(spectrum, self.circulant(), self.periodic)

    def lost_power(self, symbols: Array, pressure: Array) -> Array:
        """Return the power that the dashpots take up, ()."""
        lost = spectral.convolve(self.lost_spectrum(symbols), pressure, self.periodic)
        return jnp.sum(pressure * lost)

    def lost_spectrum(self, symbols: Array) -> Array:
        """Return the spectrum (my/2 + 1, mx) of the speed on which the pressure works: lambda_k C_k (p - lambda_k eta_k)."""
        rates = self.kernels.rates
        speeds = self.without_history(jnp.ones_like(rates)) - self.without_history(jnp.zeros_like(rates))
        return speeds - self.kernel(rates, symbols)

    def film_strain(self, symbols: Array, pressure: Array) -> Array:
        """Shortening of the film over its thickness at its deepest point; zero without a film."""
        film = self.kernels.film
        if film is None:
            return jnp.zeros(())
        history = spectral.convolve(self.film_history(symbols), pressure, self.periodic)
        return deepest_strain(film.coefficients, film.weights[0] * pressure + history)

    def film_history(self, symbols: Array) -> Array:
        """Return the spectrum (my/2 + 1, mx) of the film's weighted history over p; there is a film."""
        assert self.kernels.film is not None
        return on_grid(jnp.tensordot(self.kernels.film.weights[1:], symbols, 1), self.shape, self.periodic)

    def far(self) -> Array:
        """lambda_k C_k * eta_k over p from beyond T, wrapped like the padded kernel, (K, mx, my)."""
        square = lambda x, y: jnp.maximum(x**2 + y**2, 1.0)
        if self.line:
            varying = self.varying(
                self.kernels.rates, lambda x, y: -jnp.log(square(x, y)), lambda r: -2.0 * jnp.log(r)
            )
            beyond = varying + self._uniform_of_lines()[:, None, None]
        else:
            beyond = self.beyond(self.kernels.rates, lambda x, y: 1.0 / jnp.sqrt(square(x, y)))
        return self._point_strength()[:, None, None] * beyond

    def _uniform_of_lines(self) -> Array:
        rates, T = self.kernels.rates, self.crossing_time
        flows = rates == 0.0
        # the doubled grid has twice the datum of the grid
        way = jnp.exp(-rates * T) * jnp.log(self.length / (2.0 * self.shape[0])) + jnp.log(2.0)
        tail = exponential_integral(jnp.where(flows, 1.0, rates * T))
        return jnp.where(flows, 0.0, -2.0 * (way + tail) / jnp.where(flows, 1.0, rates))

    def beyond(
        self, rates: Array, pattern: Callable[[Array, Array], Array], ahead: Array | float = 1.0
    ) -> Array:
        """int_T^infinity exp(-lambda_k s) pattern(x + v s) ds, but for a constant where lambda is zero, (K, mx, my).

        The pattern is ``ahead``/r straight ahead. x, y in cells along x.
        """
        flows = rates == 0.0
        tail = exponential_integral(jnp.where(flows, 1.0, rates * self.crossing_time)) / self.speed
        uniform = jnp.where(flows, 0.0, tail)
        return self.varying(rates, pattern, lambda r: ahead / r) + ahead * uniform[:, None, None]

    def varying(
        self, rates: Array, pattern: Callable[[Array, Array], Array], ahead: Callable[[Array], Array]
    ) -> Array:
        """int_T^infinity exp(-lambda_k s) (pattern(x + v s) - ahead(|v| s)) ds, (K, mx, my)."""
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
        """Growth of the approach for each e-fold of the track's length, under a sum of pressures."""
        if not self.far_off or any(self.periodic):
            return jnp.zeros(())
        flows = self.kernels.rates == 0.0
        return jnp.sum(jnp.where(flows, self._point_strength(), 0.0)) * total / self.speed

    def _point_strength(self) -> Array:
        """Displacement rate at a distance of one cell from a cell of unit pressure, (K,); of a strip without ln(1/d^2)."""
        cell = 1.0 if self.line else self.ratio
        return self.kernels.at_zero @ self.kernels.mix * cell / (2.0 * jnp.pi)


def wake_of(experiment: Experiment, kernels: Kernels, velocity: Array, *, across: bool) -> Wake:
    """The wake at a velocity in cells per second; that of a half-space reaches beyond the grid."""
    grid, far_off = experiment.grid, limits_of(experiment.body).creeps_far
    if not far_off or all(grid.periodic):
        shapes = extended(kernels, grid.shape)
    else:
        wide = replace(grid, shape=doubled(grid.shape, grid.periodic))
        again = build(experiment.body, experiment.indenter, wide, kernels.nodes)
        shapes = again.family.members.spectrum[1:]
    return Wake(kernels, shapes, velocity, grid.spacing[1] / grid.spacing[0], far_off, grid.shape, across)


def extended(kernels: Kernels, shape: tuple[int, int]) -> Array:
    """Spectra of the S_m of a film on the doubled grid: beyond the grid they have died away."""
    periodic, spectra = kernels.family.members.periodic, kernels.family.members.spectrum[1:]
    if all(periodic):
        return spectra
    nx, ny = doubled(shape, periodic)
    kernel = spectral.inverse(spectra, shape, periodic)
    wide = jnp.pad(kernel, ((0, 0), (0, nx - shape[0]), (0, ny - shape[1])))
    return spectral.kernel_spectrum(wide, periodic)


def _reciprocal(z: Array) -> Array:
    """1/z, and zero where z is: for a mean pressure, which does nothing on a periodic grid."""
    return jnp.where(z == 0.0, 0.0, 1.0 / jnp.where(z == 0.0, 1.0, z))


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
    """Twice as many cells each way that is not periodic."""
    nx, ny = (n if wraps else 2 * n for n, wraps in zip(shape, periodic, strict=True))
    return nx, ny


def offsets(length: int) -> np.ndarray:
    """The offsets of a kernel in wrap-around order, (length,)."""
    i = np.arange(length)
    return np.where(i < (length + 1) // 2, i, i - length)


def cut(wide: Array, shape: tuple[int, int], target: tuple[int, int]) -> Array:
    """A wrapped kernel as a smaller wrapped one of shape ``target``, zero where no two cells of shape are."""
    for axis in (0, 1):
        at = offsets(target[axis])
        kept = jnp.asarray(np.abs(at) < shape[axis])
        taken = jnp.take(wide, jnp.asarray(at % wide.shape[axis]), axis=axis)
        wide = taken * (kept[:, None] if axis == 0 else kept[None, :])
    return wide


def on_grid(
    symbol: Array, shape: tuple[int, int], periodic: spectral.Periodic, far: Array | float = 0.0
) -> Array:
    """Spectrum (my/2 + 1, mx) of an operator from its symbol on the doubled grid, (1 or MY/2 + 1, MX).

    far: the kernel of its far part, (mx, my), which is added.
    """
    MX, MY = spectral.padded_shape(doubled(shape, periodic), periodic)
    symbol = jnp.broadcast_to(symbol, (MY // 2 + 1, MX))
    if all(periodic):
        return symbol
    padded = spectral.padded_shape(shape, periodic)
    rows = jnp.swapaxes(jnp.fft.ifft(symbol, axis=-1), -1, -2)
    near = cut(jnp.fft.irfft(rows, n=MY, axis=-1), shape, padded)
    return jnp.swapaxes(jnp.fft.rfft2(near + cut(far + 0.0 * near, shape, padded)), -1, -2)
