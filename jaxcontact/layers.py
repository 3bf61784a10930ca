"""A body: layers, perfectly bonded, on a half-space."""

from collections.abc import Sequence

import numpy as np
from jax import Array

from jaxcontact import _checks
from jaxcontact._checks import Verdict
from jaxcontact._pytree import pytree, replace
from jaxcontact.materials import Material


@pytree
class Layer:
    """A layer of a material.

    Args:
        material: any material.
        thickness: h [m] > 0, a number.

    Example:
        >>> film = jc.Layer(jc.Maxwell(G=1e9, eta=1e12), thickness=150e-9)
    """

    material: Material
    thickness: Array | float


@pytree
class LayeredHalfSpace:
    """Layers, the top one first, on a substrate; no layers make it a half-space.

    Args:
        layers: a list of ``Layer``, empty for a half-space.
        substrate: a material.

    Example:
        >>> steel = jc.Elastic.from_young(210e9, nu=0.3)
        >>> film = jc.Layer(jc.Maxwell(G=1e9, eta=1e12), thickness=150e-9)
        >>> body = jc.LayeredHalfSpace([film], substrate=steel)
    """

    layers: Sequence[Layer]
    substrate: Material


def checked_body(body: LayeredHalfSpace) -> tuple[LayeredHalfSpace, Verdict]:
    """The body with its layers as a tuple, and whether its values are in their ranges.

    Raises ValueError for what cannot be computed.
    """
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
    valid = check_material("substrate", body.substrate)
    for layer in layers:
        valid = valid & _check_layer(layer)
    return replace(body, layers=layers), valid


def _check_layer(layer: Layer) -> Verdict:
    _checks.require(
        isinstance(layer, Layer),
        f"body.layers: expected Layer(material, thickness), got {type(layer).__name__}",
    )
    shape = np.shape(layer.thickness)
    _checks.require(shape == (), f"layer thickness [m]: expected a number, got shape {shape}")
    thick = _checks.positive("layer thickness [m]", layer.thickness)
    return check_material("layer", layer.material) & thick


def check_material(where: str, material: Material) -> Verdict:
    """Moduli and viscosities above zero, nu in (-1, 0.5], one number each; a spectrum of one shape."""
    _checks.require(
        isinstance(material, Material),
        f"{where}: expected a material (Elastic, Burgers, Maxwell, ...), got {type(material).__name__}",
    )
    kind = type(material).__name__
    valid = _checks.poisson_ratio(f"{where} nu", material.nu)
    for name, value in vars(material).items():
        listed = name in material.lists
        _checks.require(
            np.ndim(value) <= listed,
            f"{where} {kind} {name}: expected {'a list' if listed else 'a number'}, got shape {np.shape(value)}",
        )
        if name != "nu":
            check = _checks.non_negative if name in material.may_be_zero else _checks.positive
            valid = valid & check(f"{where} {kind} {name}", value)
    shapes = [np.shape(getattr(material, name)) for name in material.lists]
    _checks.require(
        len(set(shapes)) <= 1,
        f"{where} {kind}: expected {' and '.join(material.lists)} of one shape, got {' and '.join(map(str, shapes))}",
    )
    return valid
