"""Materials with an elastic volume response: compliances of half-space and film, in time and at a frequency.

With the shear compliance j = 1/G and the bulk modulus K in place of a constant nu, the half-space has

    (1 - nu) j = j/2 + (3/2)/(G + 3 K),

and a layer in uniaxial strain, per unit thickness,

    (1 - 2 nu)/(2 (1 - nu)) j = 1/(K + 4 G/3) = (3/4)/(G + 3 K/4):

the material itself, and the material in parallel with springs. In time each is a sum of exponentials, exactly.
"""

import jax.numpy as jnp
from jax import Array

from jaxcontact.inputs.materials import Material
from jaxcontact.inputs.spectrum import Spectrum, parallel_creep
from jaxcontact.response.layer import two_port, uniaxial


def nu_at_first(material: Material) -> Array:
    """Return Poisson's ratio of the instantaneous elastic response, ()."""
    return material.nu_at(material.spectrum().instantaneous)


def surface_creep(material: Material) -> Spectrum:
    """Return the creep of the surface of a half-space: (1 - nu) j."""
    if material.bulk_modulus is None:
        return _scaled(material.spectrum(), 1.0 - nu_at_first(material))
    return _with_springs(material.spectrum(), 0.5, 1.5, 3.0 * material.bulk_modulus)


def surface_parts(material: Material) -> tuple[Array, Spectrum]:
    """Return a factor and a creep whose product is ``surface_creep``: for a constant nu, 1 - nu and the material's own."""
    if material.bulk_modulus is None:
        return 1.0 - nu_at_first(material), material.spectrum()
    return jnp.ones(()), surface_creep(material)


def uniaxial_strain_creep(material: Material) -> Spectrum:
    """Return the creep of a layer in uniaxial strain, per unit thickness."""
    if material.bulk_modulus is None:
        return _scaled(material.spectrum(), uniaxial(nu_at_first(material)))
    return _with_springs(material.spectrum(), 0.0, 0.75, 0.75 * material.bulk_modulus)


def film_creep(material: Material) -> Spectrum:
    """Return the creep that belongs to ``film_shape``."""
    return material.spectrum() if material.bulk_modulus is None else uniaxial_strain_creep(material)


def film_shape(material: Material, x: Array) -> Array:
    """Return alpha N of a layer on a rigid base over its ``film_creep``, at x = alpha h.

    The product of the two is exact for a constant nu. With a bulk modulus, it is exact at t = 0 and in the limit of waves
    much longer than the layer's thickness.
    """
    nu = nu_at_first(material)
    own = two_port(x, nu).A[2]
    return own if material.bulk_modulus is None else own / uniaxial(nu)


def film_compliance(material: Material, j: Array) -> Array:
    """Return ``film_creep`` at the frequency at which the shear compliance is j [1/Pa]."""
    if material.bulk_modulus is None:
        return j
    return 3.0 * j / (3.0 * material.bulk_modulus * j + 4.0)


def _scaled(spectrum: Spectrum, factor: Array | float) -> Spectrum:
    flow = None if spectrum.fluidity is None else factor * spectrum.fluidity
    return Spectrum(factor * spectrum.instantaneous, factor * spectrum.amplitudes, spectrum.rates, flow)


def _with_springs(spectrum: Spectrum, free: float, parallel: float, stiffness: Array) -> Spectrum:
    """Return free times the material plus ``parallel`` times the material in parallel with springs [Pa]."""
    alone = _scaled(spectrum, free)
    start, amplitudes, rates = parallel_creep(spectrum, jnp.asarray(stiffness, float))
    return Spectrum(
        alone.instantaneous + parallel * start,
        jnp.concatenate([alone.amplitudes, parallel * amplitudes]),
        jnp.concatenate([alone.rates, rates]),
        alone.fluidity if free else None,
    )
