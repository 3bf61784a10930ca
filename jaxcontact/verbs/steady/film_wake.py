"""The wake over a film whose thickness varies across the track of a steady slide, and not along it.

Along the track the body is then everywhere the same, so that the state is steady in the frame of the indenter. With the
kernels as a series in the thickness (``operators.varying``) each term has a wake of its own, whose kernel K_n is not even:

    u = 1/2 sum_n [T_n(xi(h)) K_n p + K_n (T_n(xi(h)) p)],

whose transpose is the operator of the motion reversed.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace
from jaxcontact.operators import spectral
from jaxcontact.operators.base import Corner, Linear
from jaxcontact.operators.film import VaryingFilm
from jaxcontact.operators.kernels import Kernels
from jaxcontact.operators.moving import Moving
from jaxcontact.operators.thickness_kernels import VaryingKernels
from jaxcontact.operators.varying import Varying
from jaxcontact.verbs.experiment import Experiment
from jaxcontact.verbs.steady.wake import Wake, wake_of


@pytree
class MovingVarying(Varying):
    """The operator of the module; spectra and circulant are complex, and there is no window."""

    symmetric = False

    def transpose(self) -> MovingVarying:
        """The same with the motion reversed."""
        return replace(self, spectra=jnp.conj(self.spectra), circulant=jnp.conj(self.circulant))

    def preconditioner(self) -> Linear:
        return self._mean().preconditioner()

    def confined_compliance(self, shape: tuple[int, ...]) -> Array:
        return self._mean().confined_compliance(shape)

    def cell_ratio(self, shape: tuple[int, ...]) -> Array | float:
        return self._mean().cell_ratio(shape)

    def window_shape(self, shape: tuple[int, ...]) -> None:
        """None, as of ``Moving``."""
        return None

    def restricted(self, corner: Corner) -> MovingVarying:
        """The whole: there is no window."""
        return self

    def even(self) -> Varying:
        """The even part, from which a search may start."""
        return Varying(self.spectra.real, self.circulant.real, self.shares, self.uneven, None, self.periodic)

    def plus_even(self, share: Array | float) -> MovingVarying:
        more = lambda a: a + share * a.real
        return replace(self, spectra=more(self.spectra), circulant=more(self.circulant))

    def _mean(self) -> Moving:
        """Return the operator of a film of one thickness with the mean of the circulants, for the search."""
        return Moving(self.spectra[0], self.circulant, self.periodic)


@pytree
class FilmWake:
    """terms: the wakes of the series, with a first axis (n, ...); one: that of a film of one thickness, for all that does
    not depend on the thickness; shares: T_0, T_1, ... at each cell, (n, nx, ny); film: that of the strain."""

    terms: Wake
    one: Wake
    shares: Array
    film: VaryingFilm

    @property
    def kernels(self) -> Kernels:
        return self.one.kernels

    @property
    def ratio(self) -> Array:
        return self.one.ratio

    @property
    def periodic(self) -> spectral.Periodic:
        return self.one.periodic

    @property
    def direction(self) -> Array:
        return self.one.direction

    def symbols(self) -> Array:
        """As of ``Wake``."""
        return self.one.symbols()

    def drift(self, total: Array) -> Array:
        """As of ``Wake``; zero, since the base is elastic."""
        return jnp.zeros(())

    def operator(self, symbols: Array) -> MovingVarying:
        """As of ``Wake``."""
        found = jax.vmap(lambda wake: wake.operator(symbols))(self.terms)
        mean = jnp.tensordot(jnp.mean(self.shares, (1, 2)), found.circulant, 1)
        return self._varying(found.spectrum, mean)

    def lost_power(self, symbols: Array, pressure: Array) -> Array:
        """As of ``Wake``."""
        spectra = jax.vmap(lambda wake: wake.lost_spectrum(symbols))(self.terms)
        return jnp.sum(pressure * self._varying(spectra, spectra[0])(pressure))

    def film_strain(self, symbols: Array, pressure: Array) -> Array:
        """As of ``Wake``, with a film that is as thick everywhere as at its deepest point."""
        history = spectral.convolve(self.one.film_history(symbols), pressure, self.periodic)
        weights = jnp.stack([self.film.weights[0], jnp.ones(())])
        return replace(self.film, weights=weights).strain(pressure, history[None])

    def _varying(self, spectra: Array, circulant: Array) -> MovingVarying:
        none = jnp.zeros(self.shares.shape[1:])
        return MovingVarying(spectra, circulant, self.shares[1:], none, None, self.periodic)


def film_wake_of(
    experiment: Experiment, kernels: VaryingKernels, velocity: Array, thickness: Array
) -> FilmWake:
    """Return the wake at a velocity along x, in cells per second."""
    here, members = kernels.at(thickness), kernels.uniform.family.members

    def of_term(spectrum: Array, circulant: Array) -> Wake:
        family = replace(
            kernels.uniform.family,
            members=replace(members, spectrum=spectrum, circulant=circulant, window=None, wide=None),
        )
        return wake_of(experiment, replace(kernels.uniform, family=family), velocity, across=False)

    terms = jax.vmap(of_term)(kernels.spectra, kernels.circulant)
    one = wake_of(experiment, kernels.uniform, velocity, across=False)
    return FilmWake(terms, one, kernels.series.shares(thickness), here.film)
