"""A body: layers, perfectly bonded, on a half-space."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact import _checks
from jaxcontact._pytree import is_concrete, pytree, replace
from jaxcontact.materials import Elastic, KelvinVoigt, Material


@pytree
class Layer:
    """A layer of a material.  thickness: h [m]."""

    material: Material
    thickness: Array | float


@pytree
class LayeredHalfSpace:
    """Layers, the top one first, on a substrate; no layers make it a half-space."""

    layers: Sequence[Layer]
    substrate: Material

    def surface_material(self) -> Material:
        """The material that the indenter touches."""
        return self.layers[0].material if self.layers else self.substrate


def checked_body(body: LayeredHalfSpace) -> LayeredHalfSpace:
    """The body with its layers as a tuple; ``ValueError`` for what cannot be computed."""
    _checks.require(
        isinstance(body, LayeredHalfSpace),
        f"body: expected a LayeredHalfSpace, got {type(body).__name__};"
        " a half-space is LayeredHalfSpace([], substrate=material)",
    )
    _checks.require(
        isinstance(body.layers, list | tuple),
        f"body.layers: expected a list of Layer, got {type(body.layers).__name__}",
    )
    layers = tuple(body.layers)
    _checks.require(
        len(layers) <= 1,
        f"body: expected at most one layer, got {len(layers)}: stacks cannot be computed yet",
    )
    check_material("substrate", body.substrate)
    for layer in layers:
        _checks.require(
            isinstance(layer, Layer),
            f"body.layers: expected Layer(material, thickness), got {type(layer).__name__}",
        )
        check_material("layer", layer.material)
        _checks.positive("layer thickness [m]", layer.thickness)
        _checks.require(
            isinstance(body.substrate, Elastic),
            f"substrate: expected Elastic under a layer, got {type(body.substrate).__name__}:"
            " a layer on a creeping substrate cannot be computed yet",
        )
    return replace(body, layers=layers)


def check_material(where: str, material: Material) -> None:
    """Moduli and viscosities above zero, nu in (-1, 0.5]."""
    _checks.require(
        isinstance(material, Material),
        f"{where}: expected a material (Elastic, Burgers, Maxwell, ...), got {type(material).__name__}",
    )
    _checks.poisson_ratio(f"{where} nu", material.nu)
    free = ("J0", "fluidity", "J")
    for name, value in vars(material).items():
        if name != "nu":
            check = _checks.non_negative if name in free else _checks.positive
            check(f"{where} {type(material).__name__} {name}", value)
    if hasattr(material, "tau"):
        _check_relaxation_times(where, material)


def _check_relaxation_times(where: str, material: Material) -> None:
    J, tau = np.shape(material.J), np.shape(material.tau)  # type: ignore[attr-defined]
    _checks.require(tau == J, f"{where} Prony: expected J and tau of one shape, got {J} and {tau}")


def long_wave_compliance(body: LayeredHalfSpace) -> Array:
    """(1 - nu)(J0 + sum J_i) of the substrate [1/Pa]: what a very wide contact meets; never zero."""
    spectrum = body.substrate.spectrum()
    return (1.0 - body.substrate.nu) * (spectrum.instantaneous + jnp.sum(spectrum.amplitudes))


def is_rigid_at_first(body: LayeredHalfSpace) -> bool:
    """True for a body that a step load cannot dent at once (J(0) = 0 at its surface)."""
    material = body.surface_material()
    if isinstance(material, KelvinVoigt):
        return True
    instantaneous = material.spectrum().instantaneous  # under jit not even a constant's is known
    return is_concrete(instantaneous) and float(instantaneous) == 0.0
