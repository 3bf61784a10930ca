"""A body: layers, perfectly bonded, on a half-space."""

from collections.abc import Callable, Sequence
from typing import Any, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact.inputs.materials import Material


@pytree
class Layer:
    """A layer of a material.

    Args:
        material: any material.
        thickness: h [m] > 0, a number; in ``indent`` also (nt,) over its times, linear between them: a film that
            grows or wears, alike everywhere (``history.growing`` says what is assumed).

    Example:
        >>> film = jc.Layer(jc.Maxwell(G=1e9, eta=1e12), thickness=150e-9)
    """

    material: Material
    thickness: Array | float


@pytree
class Graded:
    """A layer whose material varies with depth, cut into equal sublayers with the material of their middle.

    The response converges with the square of the number of sublayers. Derivatives flow to whatever numbers the
    profile closes over. The film strain of a run is that of the uppermost sublayer.

    Args:
        profile: from a depth below the layer's top [m] to a material, of the same or another class at each.
        thickness: h [m] > 0, a number.
        layers: number of sublayers, static, 1 to 1000.

    Example:
        >>> softer_on_top = lambda depth: jc.Elastic(G=1e9 + 4e9 * depth / 150e-9)
        >>> film = jc.Graded(softer_on_top, thickness=150e-9, layers=8)
        >>> body = jc.LayeredHalfSpace([film], substrate=jc.Elastic.from_young(210e9))
        >>> f"{jc.normal_response(body, 1e12) * 1e12 * 1e9:.3f} /GPa"      # 0.7/G of the uppermost
        '0.560 /GPa'
    """

    profile: Callable[[Any], Material] = static()
    thickness: Array | float
    layers: int = static(default=16)

    def cut(self) -> list[Layer]:
        """The sublayers, the top one first."""
        each = jnp.asarray(self.thickness, float) / self.layers
        return [Layer(self.profile((i + 0.5) * each), each) for i in range(self.layers)]


@pytree
class LayeredHalfSpace:
    """Layers, the top one first, on a substrate; no layers make it a half-space.

    Args:
        layers: a list of ``Layer`` and ``Graded``, empty for a half-space.
        substrate: a material.

    Example:
        >>> steel = jc.Elastic.from_young(210e9, nu=0.3)
        >>> film = jc.Layer(jc.Maxwell(G=1e9, eta=1e12), thickness=150e-9)
        >>> body = jc.LayeredHalfSpace([film], substrate=steel)
    """

    layers: Sequence[Layer | Graded]
    substrate: Material

    def sublayers(self) -> tuple[Layer, ...]:
        """The layers, the top one first, with each graded one cut."""
        return tuple(
            part for layer in self.layers for part in (layer.cut() if isinstance(layer, Graded) else [layer])
        )

    def with_thicknesses(self, thicknesses: Array) -> Self:
        """The body with other thicknesses (layers,) [m] of its layers, none of them graded."""
        pairs = zip(self.sublayers(), thicknesses, strict=True)
        return replace(self, layers=tuple(replace(layer, thickness=h) for layer, h in pairs))


def checked_body(body: LayeredHalfSpace) -> tuple[LayeredHalfSpace, Verdict]:
    """The body with its layers as a tuple of ``Layer``, and whether its values are in their ranges.

    Raises ValueError for what cannot be computed.
    """
    checks.require(
        isinstance(body, LayeredHalfSpace),
        f"body: expected a LayeredHalfSpace, got {type(body).__name__};"
        " a half-space is LayeredHalfSpace([], substrate=material)",
    )
    checks.require(
        isinstance(body.layers, list | tuple),
        f"body.layers: expected a list of Layer, got {type(body.layers).__name__}",
    )
    valid = check_material("substrate", body.substrate)
    for layer in body.layers:
        valid = valid & _check_layer(layer)
    layers = body.sublayers()
    for each in layers:
        valid = valid & check_material("layer", each.material)
    return replace(body, layers=layers), valid


def body_at_first(body: LayeredHalfSpace, count: int) -> tuple[LayeredHalfSpace, Array | None, Verdict]:
    """The body as it is at the first of ``count`` times, its thicknesses over them (count, layers), and if they are > 0.

    None: they stay as they are. Whatever else may be wrong with the body, ``checked_body`` says.
    """
    layers = (
        body.layers if isinstance(body, LayeredHalfSpace) and isinstance(body.layers, list | tuple) else ()
    )
    moving = [layer for layer in layers if isinstance(layer, Layer) and np.ndim(layer.thickness) == 1]
    if not moving:
        return body, None, True
    valid: Verdict = True
    for layer in moving:
        shape = np.shape(layer.thickness)
        checks.require(
            shape == (count,),
            f"layer thickness [m]: expected a number or shape ({count},) as times, got {shape}",
        )
        valid = valid & checks.positive("layer thickness [m]", layer.thickness)
    first = lambda layer: replace(layer, thickness=jnp.asarray(layer.thickness, float)[0])
    at_first = replace(body, layers=tuple(first(a) if any(a is b for b in moving) else a for a in layers))
    over_times = [
        jnp.broadcast_to(jnp.asarray(part.thickness, float), (count,))
        for layer in layers
        for part in (layer.cut() if isinstance(layer, Graded) else [layer])
    ]
    return at_first, jnp.stack(over_times, 1), valid


def at_its_thickest(body: LayeredHalfSpace) -> LayeredHalfSpace:
    """The body with each layer that grows or wears as thick as it ever is; concrete values only."""
    layers = body.layers if isinstance(body, LayeredHalfSpace) else ()
    if not any(isinstance(layer, Layer) and np.ndim(layer.thickness) == 1 for layer in layers):
        return body
    at_most = lambda layer: replace(layer, thickness=float(np.max(np.asarray(layer.thickness))))
    return replace(body, layers=tuple(at_most(layer) for layer in layers))


def _check_layer(layer: Layer | Graded) -> Verdict:
    """All but the material."""
    checks.require(
        isinstance(layer, Layer | Graded),
        f"body.layers: expected Layer(material, thickness), got {type(layer).__name__}",
    )
    shape = np.shape(layer.thickness)
    checks.require(
        len(shape) < 2,
        f"layer thickness [m]: expected a number, got shape {shape}: a response belongs to one thickness everywhere."
        " Give the film's mean here and its uneven top as the heights of a HeightField, and bound what is left by runs"
        " with the least and the largest thickness",
    )
    checks.require(
        shape == (),
        f"layer thickness [m]: expected a number, got shape {shape}; over times it is for a Layer in indent alone",
    )
    if isinstance(layer, Graded):
        kind = type(layer.profile).__name__
        checks.require(callable(layer.profile), f"Graded profile: expected a function of depth, got {kind}")
        checks.whole("Graded layers", layer.layers, 1, 1000)
    return checks.positive("layer thickness [m]", layer.thickness)


def thickest(body: LayeredHalfSpace) -> float:
    """The largest thickness of a layer at any time [m], 0 without layers."""
    return max((float(np.max(layer.thickness)) for layer in body.layers), default=0.0)


def check_material(where: str, material: Material) -> Verdict:
    """Moduli and viscosities above zero, nu in (-1, 0.5] or a bulk modulus, one number each; a spectrum of one shape."""
    cut = ": its prony(shortest, longest) is one" if hasattr(material, "prony") else ""
    checks.require(
        isinstance(material, Material),
        f"{where}: expected a material (Elastic, Burgers, Maxwell, ...), got {type(material).__name__}{cut}",
    )
    kind = type(material).__name__
    nu, K = material.nu, material.bulk_modulus
    checks.require(
        (nu is None) != (K is None),
        f"{where} {kind}: expected one of nu and bulk_modulus, got {'neither' if nu is None else 'both'}",
    )
    valid = True if nu is None else checks.poisson_ratio(f"{where} nu", nu)
    given = {name: value for name, value in vars(material).items() if value is not None}
    for name, value in given.items():
        listed = name in material.lists
        checks.require(
            np.ndim(value) <= listed,
            f"{where} {kind} {name}: expected {'a list' if listed else 'a number'}, got shape {np.shape(value)}",
        )
        if name != "nu":
            check = checks.non_negative if name in material.may_be_zero else checks.positive
            valid = valid & check(f"{where} {kind} {name}", value)
    shapes = [np.shape(getattr(material, name)) for name in material.lists]
    checks.require(
        len(set(shapes)) <= 1,
        f"{where} {kind}: expected {' and '.join(material.lists)} of one shape, got {' and '.join(map(str, shapes))}",
    )
    return valid
