"""A body: layers on a half-space or on a rigid base, bonded to what lies below them or sliding on it."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import is_concrete, pytree, replace, static
from jaxcontact.bodies.materials import Elastic, Material, Rigid, check_material


@pytree
class Layer:
    """A layer of a material.

    Args:
        material: any material.
        thickness: h [m] > 0, a number. In ``indent`` it may be (nt,), linear between the times, for a film that grows or
            wears uniformly (the assumptions are stated in ``history.memory``), and, for the only layer on an elastic
            substrate, (nx, ny) on the grid or (nt, nx, ny), >= 0, for a film that varies in the plane. Such a film lies on
            a flat base: its surface is higher where it is thicker, and the base is bare where the thickness is 0
            (``operators.kernels``). Growth of (nt, nx, ny) raises the surface, so that a given approach presses it in
            deeper; with (nt,) approach and displacement are counted from the surface as growth alone would leave it. In
            ``slide_steady`` it may vary along y, across the track.
        bonded: False, static, for a layer that slides without friction on what is below it and does not lift off: at its
            lower side the shear traction is zero, and the normal displacement and traction are continuous. Such a layer
            needs one thickness. A net tangential force moves it as a free membrane, without bound, so that ``shear`` and
            ``roll_steady`` refuse it.

    Example:
        >>> film = jc.Layer(jc.Maxwell(G=1e9, eta=1e12), thickness=150e-9)
    """

    material: Material
    thickness: Array | float
    bonded: bool = static(default=True)


@pytree
class Graded:
    """A layer whose material varies with depth, divided into equal sublayers with the material at their mid-depth.

    The error of the response decreases with the square of the number of sublayers. Derivatives with respect to all
    numbers that the profile uses are available. The film strain of a run is that of the uppermost sublayer.

    Args:
        profile: function from the depth below the layer's top [m] to a material, of the same or another class at each.
        thickness: h [m] > 0, a number.
        layers: number of sublayers, static, 1 to 1000.
        bonded: as of ``Layer``, at the lower side of the last sublayer.

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
    bonded: bool = static(default=True)

    def cut(self) -> list[Layer]:
        """Return the sublayers, the top one first."""
        each = jnp.asarray(self.thickness, float) / self.layers
        below = [True] * (self.layers - 1) + [self.bonded]
        return [Layer(self.profile((i + 0.5) * each), each, below[i]) for i in range(self.layers)]


@pytree
class LayeredHalfSpace:
    """Layers, the top one first, on a substrate; without layers it is a half-space.

    Args:
        layers: a list of ``Layer`` and ``Graded``, empty for a half-space.
        substrate: a material, or None for a rigid base below at least one layer. On a rigid base displacement has a value
            of its own, and not one relative to a mean or to a distant point: the response to a uniform pressure is the
            shortening of the layers, which cannot widen (``response.stack``).

    Example:
        >>> steel = jc.Elastic.from_young(210e9, nu=0.3)
        >>> film = jc.Layer(jc.Maxwell(G=1e9, eta=1e12), thickness=150e-9)
        >>> body = jc.LayeredHalfSpace([film], substrate=steel)
        >>> gel = jc.Layer(jc.Elastic(G=1e3, nu=0.5), thickness=10e-6, bonded=False)
        >>> on_glass = jc.LayeredHalfSpace([gel], substrate=None)
    """

    layers: Sequence[Layer | Graded]
    substrate: Material | None

    @property
    def base(self) -> Material:
        """The material below all layers, ``Rigid`` where the substrate is None."""
        return Rigid() if self.substrate is None else self.substrate

    @property
    def loose(self) -> bool:
        """Whether a layer slides on what is below it."""
        return not all(layer.bonded for layer in self.layers)

    @property
    def height(self) -> Array | np.float64:
        """The thickness of all layers [m], ()."""
        thicknesses = [layer.thickness for layer in self.layers]
        # known ones by numpy: a sum by jax is traced inside jit, whatever is known
        module: Any = np if is_concrete(thicknesses) else jnp
        return sum((module.asarray(h, float) for h in thicknesses), module.zeros(()))

    def sublayers(self) -> tuple[Layer, ...]:
        """Return the layers, the top one first, with each graded layer divided into sublayers."""
        return tuple(
            part for layer in self.layers for part in (layer.cut() if isinstance(layer, Graded) else [layer])
        )

    def with_thicknesses(self, thicknesses: Array) -> Self:
        """Return the body with other thicknesses (layers,) [m] of its layers, none of which may be graded."""
        pairs = zip(self.sublayers(), thicknesses, strict=True)
        return replace(self, layers=tuple(replace(layer, thickness=h) for layer, h in pairs))


def checked_body(body: LayeredHalfSpace) -> tuple[LayeredHalfSpace, Verdict]:
    """Return the body with its layers as a tuple of ``Layer``, and whether its values are in their ranges.

    Raises ValueError for a body that cannot be computed.
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
    checks.require(
        body.substrate is not None or len(body.layers) > 0,
        "body: expected at least one layer on a rigid base, substrate=None, got none: nothing would deform",
    )
    valid = check_material("substrate", body.base)
    for layer in body.layers:
        checks.require(
            isinstance(layer, Layer | Graded),
            f"body.layers: expected Layer(material, thickness), got {type(layer).__name__}",
        )
        shape = np.shape(layer.thickness)
        checks.require(
            len(shape) < 2,
            f"layer thickness [m]: expected a number, got shape {shape}: a thickness that varies in the plane is for a Layer"
            " in indent, rub and, where it varies across the track alone, slide_steady. A film that moves past the indenter"
            " is for rub with path=; tangential traction and fields below the surface need one thickness",
        )
        checks.require(
            shape == (),
            f"layer thickness [m]: expected a number, got shape {shape}; only a Layer in indent accepts one value per time",
        )
        checks.require(
            isinstance(layer.bonded, bool | np.bool_),
            f"layer bonded: expected True or False, got {layer.bonded!r}",
        )
        if isinstance(layer, Graded):
            kind = type(layer.profile).__name__
            checks.require(
                callable(layer.profile), f"Graded profile: expected a function of depth, got {kind}"
            )
            checks.whole("Graded layers", layer.layers, 1, 1000)
        valid = valid & checks.positive("layer thickness [m]", layer.thickness)

    # a graded layer is cut only when all of it is in order
    layers = body.sublayers()
    for each in layers:
        valid = valid & check_material("layer", each.material)
    return replace(body, layers=layers), valid


def check_bonded(body: LayeredHalfSpace, where: str) -> None:
    """Raise ValueError for a body with a loose layer, which has no finite response to a net tangential force."""
    checks.require(
        not body.loose,
        f"{where}: expected bonded layers, got one with bonded=False: under a net tangential force a layer that slides on"
        " what is below it moves as a free membrane, without bound",
    )


def _given_layers(body: Any) -> Sequence[Any]:
    """Return the layers of a body before its check: none of what is no body, whose errors are left to ``checked_body``."""
    given = body.layers if isinstance(body, LayeredHalfSpace) else ()
    return given if isinstance(given, list | tuple) else ()


def body_at_first(body: LayeredHalfSpace, count: int) -> tuple[LayeredHalfSpace, Array | None, Verdict]:
    """Return the body at the first of ``count`` times, its layers' thicknesses over time, and whether these are > 0.

    The thicknesses are (count, layers), or None if all are constant.
    """
    layers = _given_layers(body)
    varying = [layer for layer in layers if isinstance(layer, Layer) and np.ndim(layer.thickness) == 1]
    if not varying:
        return body, None, True
    valid: Verdict = True
    for layer in varying:
        shape = np.shape(layer.thickness)
        checks.require(
            shape == (count,),
            f"layer thickness [m]: expected a number or shape ({count},) as times, got {shape}",
        )
        valid = valid & checks.positive("layer thickness [m]", layer.thickness)
    first = lambda layer: replace(layer, thickness=jnp.asarray(layer.thickness, float)[0])
    at_first = replace(body, layers=tuple(first(a) if any(a is b for b in varying) else a for a in layers))
    over_times = [
        jnp.broadcast_to(jnp.asarray(part.thickness, float), (count,))
        for layer in layers
        for part in (layer.cut() if isinstance(layer, Graded) else [layer])
    ]
    return at_first, jnp.stack(over_times, 1), valid


class ThicknessMap(NamedTuple):
    """The thickness of a film that varies in the plane [m], (nx, ny) or (nt, nx, ny)."""

    values: Array

    @property
    def over_times(self) -> bool:
        return self.values.ndim == 3

    @property
    def at_first(self) -> Array:
        """The thickness at the first time, (nx, ny)."""
        return self.values[0] if self.over_times else self.values


def over_the_plane(body: LayeredHalfSpace, shape: tuple[int, ...]) -> LayeredHalfSpace:
    """Return the body with the thickness of its only layer at all cells of a grid; other bodies as they are."""
    layers = _given_layers(body)
    if len(layers) != 1 or not isinstance(layers[0], Layer):
        return body
    if np.ndim(layers[0].thickness) > 0:
        return body
    everywhere = jnp.broadcast_to(jnp.asarray(layers[0].thickness, float), shape)
    return replace(body, layers=(replace(layers[0], thickness=everywhere),))


def separate_map(
    body: LayeredHalfSpace, shape: tuple[int, ...], count: int
) -> tuple[LayeredHalfSpace, ThicknessMap | None, Verdict]:
    """Return the body with a film of one thickness, the thickness that varies in the plane, and whether it is in range.

    shape: that of the grid; count: the number of times. The one thickness is the largest, without derivative. None: no
    thickness varies in the plane. Raises ValueError for a thickness that cannot be computed.
    """
    layers = _given_layers(body)
    if not any(isinstance(layer, Layer) and np.ndim(layer.thickness) > 1 for layer in layers):
        return body, None, True
    on = "a rigid base" if body.substrate is None else type(body.substrate).__name__
    checks.require(
        len(layers) == 1 and isinstance(body.substrate, Elastic),
        "body: expected one Layer on an Elastic substrate where its thickness varies in the plane, got"
        f" {len(layers)} on {on}",
    )
    checks.require(
        not body.loose,
        "body: expected a bonded layer where its thickness varies in the plane, got bonded=False",
    )
    (layer,), expected = layers, (tuple(shape), (count, *shape))
    checks.require(
        np.shape(layer.thickness) in expected,
        f"layer thickness [m]: expected a number or shape {' or '.join(map(str, expected))} as the grid and the times, got"
        f" {np.shape(layer.thickness)}",
    )
    valid = checks.non_negative("layer thickness [m]", layer.thickness)
    values = jnp.asarray(layer.thickness, float)
    largest = jax.lax.stop_gradient(jnp.max(values))
    one = jnp.where(largest > 0.0, largest, 1.0)  # without any film its thickness does not matter
    return replace(body, layers=(replace(layer, thickness=one),)), ThicknessMap(values), valid


def at_its_thickest(body: LayeredHalfSpace) -> LayeredHalfSpace:
    """Return the body with each layer at its largest thickness, for estimates; concrete values only.

    A layer that has no thickness anywhere is left out.
    """
    layers = _given_layers(body)
    if not all(isinstance(layer, Layer) for layer in layers):
        return body
    at_most = [float(np.max(np.asarray(layer.thickness))) for layer in layers]
    if not any(np.ndim(layer.thickness) > 0 for layer in layers) and 0.0 not in at_most:
        return body
    there = [(layer, h) for layer, h in zip(layers, at_most, strict=True) if h != 0.0]
    return replace(body, layers=tuple(replace(layer, thickness=h) for layer, h in there))


def thickest(body: LayeredHalfSpace) -> float:
    """Return the largest thickness of any layer at any time [m], 0 without layers."""
    return max((float(np.max(layer.thickness)) for layer in body.layers), default=0.0)
