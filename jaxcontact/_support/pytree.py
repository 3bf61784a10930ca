"""Frozen dataclasses registered with jax as pytrees of arrays."""

import dataclasses
import functools
from typing import Any, TypeVar, dataclass_transform

import jax
import jax.numpy as jnp
import numpy as np

T = TypeVar("T")
SHOWN = 8  # largest size of an array printed with all its numbers
WIDEST = 110  # length of a printed line


def static(**kwargs: Any) -> Any:
    """Declare a field that is part of the tree's structure (a shape, a flag, a name), not a leaf."""
    return dataclasses.field(metadata={"static": True}, **kwargs)


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field, static))
def pytree(cls: type[T]) -> type[T]:
    """Make ``cls`` a frozen dataclass whose fields are leaves, except those made by ``static``.

    Values are not checked at construction, because jax rebuilds these objects with tracers, None and plain objects inside;
    only masked entries and units are refused.
    Unless the class defines its own ``repr``, it is printed with its fields, an array of more than a few numbers by its
    shape and range.
    """
    if cls.__repr__ is object.__repr__:
        cls.__repr__ = _in_words  # type: ignore[method-assign]
    made = _register(dataclasses.dataclass(frozen=True, repr=False)(cls))
    construct = made.__init__

    @functools.wraps(construct)
    def initialise(self: Any, *args: Any, **kwargs: Any) -> None:
        construct(self, *args, **kwargs)
        for name, value in vars(self).items():
            refuse_masked(name, value)

    made.__init__ = initialise  # type: ignore[method-assign]
    return made


class Base:
    """Base of classes that users extend: a subclass without the decorator ``pytree`` cannot be made, and says why."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        name = type(self).__name__
        raise TypeError(
            f"{name}: expected the decorator jaxcontact.abc.pytree above its class, got a class without it"
        )


def refuse_masked(name: str, value: Any) -> None:
    """Raise ValueError for a numpy array with masked entries or a quantity with a unit, or a list or tuple with one.

    Conversions to other arrays drop a mask without a word, and the values beneath it, often spikes, would be computed
    with. An array whose mask is empty is accepted. They drop the unit of a quantity of astropy (``unit``) or pint
    (``units``) likewise, and 5 mN would be 5 N; labelled arrays, which have no method ``to``, are accepted."""
    if isinstance(value, list | tuple):
        for each in value:
            refuse_masked(name, each)
    elif isinstance(value, np.ma.MaskedArray) and (masked := int(np.ma.count_masked(value))):
        raise ValueError(
            f"{name}: expected numbers without masked entries, got {masked} masked of {value.size}: fill or cut them"
        )
    elif hasattr(value, "to") and (hasattr(value, "unit") or hasattr(value, "units")):
        unit = getattr(value, "unit", None) or getattr(value, "units", None)
        raise ValueError(
            f"{name}: expected plain numbers in SI, got a quantity with the unit {str(unit)!r}: convert it"
        )


def require_real(name: str, value: Any) -> None:
    """Raise ValueError for an array that a conversion to float64 would change without a word, or a list or tuple with one.

    It drops the imaginary part of complex numbers, and turns dates and durations into counts of their unit, which pandas
    stores in nanoseconds: a minute would last 6e10 s. Text that states numbers is refused too, and
    what ``refuse_masked`` refuses.
    """
    refuse_masked(name, value)
    if isinstance(value, list | tuple):
        for each in value:
            require_real(name, each)
        return
    kind = getattr(getattr(value, "dtype", None), "kind", None)
    if kind == "c" or isinstance(value, complex):
        raise ValueError(
            f"{name}: expected real numbers, got complex numbers: take their real part or modulus"
        )
    if kind == "m" or kind == "M":
        what = "durations" if kind == "m" else "dates"
        first = "" if kind == "m" else "subtract the first and "
        raise ValueError(
            f"{name}: expected numbers, got {what} ({value.dtype}): {first}divide by numpy.timedelta64(1, 's')"
        )
    if kind in ("U", "S") or isinstance(value, str | bytes):
        try:
            np.asarray(value, dtype=float)
        except ValueError:
            return  # the conversion fails, and the caller says what it expected
        raise ValueError(f"{name}: expected numbers, got text")


def _in_words(obj: Any) -> str:
    """Return the text of an object with its fields."""
    fields = dataclasses.fields(obj)
    parts = [f"{field.name}={value_in_words(getattr(obj, field.name))}" for field in fields]
    return _enclosed(f"{type(obj).__name__}(", parts, ")")


def _enclosed(head: str, parts: list[str], tail: str) -> str:
    """Return the parts in one line, or one line each where that would be too long."""
    line = f"{head}{', '.join(parts)}{tail}"
    if len(line) <= WIDEST and "\n" not in line:
        return line
    return "\n".join([head, *(f"  {part},".replace("\n", "\n  ") for part in parts), tail])


def value_in_words(value: Any) -> str:
    """Return a few numbers as they are, an array by its shape and range, and other objects by their ``repr``."""
    if isinstance(value, tuple) or (isinstance(value, list) and not _is_list_of_numbers(value)):
        head, tail = "()" if isinstance(value, tuple) else "[]"
        return _enclosed(head, list(map(value_in_words, value)), tail)
    if not isinstance(value, list | np.ndarray | np.generic | jax.Array) or not is_concrete(value):
        return getattr(value, "__qualname__", None) or repr(value)
    array = np.asarray(value)
    if array.size <= SHOWN or array.dtype.kind not in "biuf":
        return repr(array.tolist())
    shape = " x ".join(map(str, array.shape))
    return f"<{shape} from {np.min(array):.6g} to {np.max(array):.6g}>"


def _register(cls: type[T]) -> type[T]:
    """Register a dataclass as a tree of its non-static fields.

    ``jax.tree_util.register_dataclass`` is not used: up to jax 0.10 at least, its structures of two classes with
    equally many fields compare equal (only their hashes differ), so that in about one of fifty runs jit used the program
    compiled for a ``Load`` for an ``Approach`` as well.
    """
    fields = dataclasses.fields(cls)  # type: ignore[arg-type]
    names = [field.name for field in fields if not field.metadata.get("static")]
    fixed = [field.name for field in fields if field.metadata.get("static")]

    def flatten(obj: T) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        # integers as floats: jax.grad accepts no integers, and users write ``Load(60)``
        given = (getattr(obj, name) for name in names)
        leaves = tuple(float(leaf) if type(leaf) is int else leaf for leaf in given)
        return leaves, tuple(getattr(obj, name) for name in fixed)

    def flatten_with_keys(obj: T) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        leaves, aux = flatten(obj)
        return tuple(zip(map(jax.tree_util.GetAttrKey, names), leaves, strict=True)), aux

    def unflatten(aux: tuple[Any, ...], leaves: tuple[Any, ...]) -> T:
        return cls(**dict(zip(names, leaves, strict=True)), **dict(zip(fixed, aux, strict=True)))

    jax.tree_util.register_pytree_with_keys(cls, flatten_with_keys, unflatten, flatten)
    return cls


def replace(obj: T, **changes: Any) -> T:
    """Return a copy of ``obj`` with some fields changed."""
    return dataclasses.replace(obj, **changes)  # type: ignore[type-var]


def is_concrete(*trees: Any) -> bool:
    """Return whether no leaf is a tracer, so that values can be inspected."""
    return not any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(trees))


def as_float64(tree: T) -> T:
    """Return the tree with every leaf, and every list of numbers, as a float64 array."""
    return jax.tree.map(_leaf_as_float64, tree, is_leaf=_is_list_of_numbers)


def untupled(values: Any) -> Any:
    """Return a tuple of numbers, which jax takes for a tree, as a list, and anything else unchanged."""
    return list(values) if isinstance(values, tuple) else values


def _is_list_of_numbers(node: Any) -> bool:
    return isinstance(node, list) and bool(node) and all(isinstance(item, _NUMBERS) for item in node)


_NUMBERS = (int, float, np.number, np.ndarray, jax.Array)


def _leaf_as_float64(leaf: Any) -> Any:
    require_real("array", leaf)
    if is_concrete(leaf):
        # ``jnp.asarray`` would compile a program for each shape
        return jax.device_put(np.asarray(leaf, dtype=np.float64))
    return jnp.asarray(leaf, dtype=jnp.float64)
