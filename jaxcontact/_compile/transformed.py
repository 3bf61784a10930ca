"""Derivatives and batches of compiled programs outside jit, which have the options of the compiler of the program as well.

jax accepts options of the compiler only for a function that it calls at once, and not for a part of what it records. Outside
``jax.jit``, ``jax.vmap`` and ``jax.jvp`` call a function at once, but ``jax.grad``, ``jax.vjp`` and ``jax.linearize`` record
its linear part, which they evaluate, or transpose and evaluate, later. The gradient of a shear would be compiled in 32 s of
processor time without options, and in 7 s with those of its first calls. A program is therefore called here as a function
with a derivative rule of its own:

    y, residuals = linearised(x),        dy = linear(residuals, dx),        x_bar = transposed(residuals, y_bar),

of which each is a program with options. ``linear`` is recorded as one operation, ``LINEAR``, which is compiled when it is
evaluated. Where jit records it, it is part of what jit compiles.
"""

from __future__ import annotations

import contextlib
import functools
import math
import types
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero
from jax.extend.core import Literal, Primitive, jaxpr_as_fun
from jax.interpreters import ad, batching, mlir

from jaxcontact._compile.collection import paused_collection

Arrays = Sequence[Any]
Shapes = Sequence[jax.ShapeDtypeStruct]


class Linear:
    """A linear function of some arrays, ``moving``, which depends on others, ``fixed``.

    function: takes both lists and returns a list of arrays with the given shapes. compiled: makes a program of a function
    and the number of members of a batch that a call has. Transposed and batched functions are made once, so that they are
    compiled once.
    """

    def __init__(
        self,
        function: Callable[[Arrays, Arrays], Arrays],
        shapes: Shapes,
        compiled: Callable[[Callable[..., Any], int], Callable[..., Any]],
        members: int = 1,
    ):
        self.function, self.shapes, self.compiled, self.members = function, tuple(shapes), compiled, members
        self.program = compiled(function, members)
        self._derived = dict[Any, Any]()

    def __call__(self, fixed: Arrays, moving: Arrays) -> list[Any]:
        return LINEAR.bind(*fixed, *moving, linear=self, count=len(fixed))

    @classmethod
    def recorded(
        cls,
        function: Callable[[Arrays, Arrays], Arrays],
        fixed: Shapes,
        moving: Shapes,
        compiled: Callable[[Callable[..., Any], int], Callable[..., Any]],
        members: int = 1,
    ) -> tuple[Linear, list[bool]]:
        """Return the linear function of which jax records this one, without results that are always zero, and of each result
        whether it is left.

        A result is left if the operation that returns it takes a moving array, or what depends on one.
        """
        with paused_collection():
            found = jax.make_jaxpr(function)(list(fixed), list(moving))
        dependent = set(found.jaxpr.invars[len(fixed) :])
        is_dependent = lambda each: not isinstance(each, Literal) and each in dependent
        for equation in found.jaxpr.eqns:
            if any(is_dependent(each) for each in equation.invars):
                dependent.update(equation.outvars)
        left = [is_dependent(each) for each in found.jaxpr.outvars]
        shapes = [jax.ShapeDtypeStruct(each.aval.shape, each.aval.dtype) for each in found.jaxpr.outvars]
        of_arrays = jaxpr_as_fun(found)
        chosen = lambda fixed, moving: _where(left, of_arrays(*fixed, *moving))
        return cls(chosen, _where(left, shapes), compiled, members), left

    def transposed(self, given: tuple[bool, ...], fixed: Shapes, moving: Shapes) -> tuple[Linear, list[bool]]:
        """Return the transposed function of the outputs that are ``given``, for arrays of these shapes, and of each moving
        array whether it has a cotangent other than zero."""

        def function(fixed: Arrays, cotangents: Arrays) -> Arrays:
            def chosen(*moving: Any) -> list[Any]:
                return _where(given, self.function(fixed, moving))

            return list(jax.linear_transpose(chosen, *moving)(list(cotangents)))

        def make() -> tuple[Linear, list[bool]]:
            return Linear.recorded(function, fixed, _where(given, self.shapes), self.compiled, self.members)

        return self._kept((given, fixed, moving), make)

    def batched(self, axes: tuple[int | None, ...], arrays: Shapes, count: int) -> Batched:
        """Return the function of arrays of which an axis counts the members of a batch, with the axes of its results.

        axes: of the fixed and the moving arrays, of these shapes; None for an array that all members share.
        """

        def make() -> Batched:
            batch = list[bool]()  # of each result, whether the members differ in it

            def noted(fixed: Arrays, moving: Arrays) -> Arrays:
                found = self.function(fixed, moving)
                batch[:] = [_is_batch(each) for each in found]
                return found

            in_axes = list(axes[:count]), list(axes[count:])
            shapes = jax.eval_shape(
                jax.vmap(noted, in_axes=in_axes), list(arrays[:count]), list(arrays[count:])
            )
            out_axes = [0 if each else None for each in batch]
            shapes = [
                each if axis == 0 else own
                for each, axis, own in zip(shapes, out_axes, self.shapes, strict=True)
            ]
            function = jax.vmap(self.function, in_axes=in_axes, out_axes=out_axes)
            sequences = lambda fixed, moving: function(list(fixed), list(moving))
            size = next(
                array.shape[axis] for array, axis in zip(arrays, axes, strict=True) if axis is not None
            )
            return Linear(sequences, shapes, self.compiled, size * self.members), out_axes

        return self._kept((axes, arrays, count), make)

    def _kept(self, key: Any, make: Callable[[], Any]) -> Any:
        if key not in self._derived:
            self._derived[key] = make()
        return self._derived[key]


Batched = tuple[Linear, list[int | None]]
"""A batched function, and the axis of each of its results that counts the members: 0, or None for one that all share."""

LINEAR = Primitive("linear_program")
"""The operation ``linear(fixed, moving)`` of arrays, of which the first ``count`` are fixed."""

LINEAR.multiple_results = True


def _evaluated(*arrays: Any, linear: Linear, count: int) -> Arrays:
    return linear.program(list(arrays[:count]), list(arrays[count:]))


def _part_of_a_program(*arrays: Any, linear: Linear, count: int) -> Arrays:
    return linear.function(arrays[:count], arrays[count:])


def _with_tangents(primals: Arrays, tangents: Arrays, *, linear: Linear, count: int) -> Any:
    """The derivative by all arrays, for second derivatives."""
    moves = [type(tangent) is not ad.Zero for tangent in tangents]

    def of(*moving: Any) -> Arrays:
        return _evaluated(*_merged(moves, moving, _where(moves, primals, False)), linear=linear, count=count)

    return jax.jvp(of, tuple(_where(moves, primals)), tuple(_where(moves, tangents)))


def _with_batches(arrays: Arrays, axes: Arrays, *, linear: Linear, count: int) -> Any:
    batched, out_axes = linear.batched(tuple(axes), _shapes(arrays), count)
    return batched(arrays[:count], arrays[count:]), out_axes


def _transposed(cotangents: Arrays, *arrays: Any, linear: Linear, count: int) -> Arrays:
    given = tuple(type(each) is not ad.Zero for each in cotangents)
    if not any(given):
        return [None] * len(arrays)
    fixed, moving = arrays[:count], arrays[count:]
    shapes = _shapes([each.aval if ad.is_undefined_primal(each) else each for each in moving])
    transposed, left = linear.transposed(given, _shapes(fixed), shapes)
    found = iter(transposed(fixed, _where(given, cotangents)))
    each_of = [next(found) if own else None for own in left]
    wanted = [ad.is_undefined_primal(each) for each in moving]
    return [None] * count + [each if own else None for each, own in zip(each_of, wanted, strict=True)]


LINEAR.def_impl(_evaluated)
LINEAR.def_abstract_eval(
    lambda *_, linear, count: [jax.core.ShapedArray(each.shape, each.dtype) for each in linear.shapes]
)
ad.primitive_jvps[LINEAR] = _with_tangents
ad.primitive_transposes[LINEAR] = _transposed
batching.primitive_batchers[LINEAR] = _with_batches
mlir.register_lowering(LINEAR, mlir.lower_fun(_part_of_a_program, multiple_results=True))


def differentiable(
    function: Callable[[Arrays], Any],
    call: Callable[[Arrays], Any],
    compiled: Callable[[Callable[..., Any], int], Callable[..., Any]],
) -> Callable[[Arrays], Any]:
    """Return ``call``, a compiled program of ``function`` of a list of arrays, with the derivatives of ``function``.

    compiled: makes a program of a function, as for ``Linear``. ``moves`` says of each array whether the derivative is by
    it; there are programs for each choice.
    """

    @jax.custom_jvp
    def called(arrays: Arrays) -> Any:
        return call(arrays)

    @functools.cache
    def program_of_tangents(moves: tuple[bool, ...]) -> Callable[..., Any]:
        def pushed(fixed: Arrays, moving: Arrays, tangents: Arrays) -> Any:
            of = lambda moving: function(_merged(moves, moving, fixed))
            found, derivative = jax.jvp(of, (moving,), (tangents,))
            # jit returns no tangents of integers
            real = lambda each: None if each.dtype == jax.dtypes.float0 else each
            return found, jax.tree.map(real, derivative)

        return compiled(pushed, 1)

    @functools.cache
    def program_of_linear_part(moves: tuple[bool, ...]) -> Callable[..., Any]:
        def linearised(fixed: Arrays, moving: Arrays) -> Any:
            def of(moving: Arrays) -> Any:
                found = function(_merged(moves, moving, fixed))
                return [leaf for leaf in jax.tree.leaves(found) if is_real(leaf)], found

            _, linear, found = jax.linearize(of, moving, has_aux=True)
            residuals, structure = jax.tree.flatten(linear)

            @functools.cache
            def linear_of(fixed: Shapes, moving: Shapes) -> tuple[Linear, list[bool]]:
                """Return the linear function, and of each of its results whether it depends on what moves."""
                of_arrays = lambda fixed, moving: jax.tree.unflatten(structure, fixed)(moving)
                return Linear.recorded(of_arrays, fixed, moving, compiled)

            # jax keeps it with the program, in the structure of the result, and releases both with its caches
            return found, jax.tree_util.Partial(linear_of, *residuals)

        return compiled(linearised, 1)

    @functools.partial(called.defjvp, symbolic_zeros=True)
    def derivative(primals: Any, tangents: Any) -> Any:
        (arrays,), (given,) = primals, tangents
        moves = tuple(type(tangent) is not SymbolicZero for tangent in given)
        fixed, moving, given = _where(moves, arrays, False), _where(moves, arrays), _where(moves, given)
        # Forward mode, whose tangents have values, needs no residuals.
        if all(_has_values(each) for each in given):
            found, tree = program_of_tangents(moves)(fixed, moving, given)
            derivatives = iter(jax.tree.leaves(tree))
            return found, jax.tree.map(
                lambda leaf: next(derivatives) if is_real(leaf) else _zero(leaf), found
            )
        found, linear = program_of_linear_part(moves)(fixed, moving)
        residuals, linear_of = linear.args, linear.func
        linear, depends = linear_of(_shapes(residuals), _shapes(moving))
        derivatives, known = iter(linear(residuals, given)), iter(depends)
        derivative_of = lambda leaf: next(derivatives) if is_real(leaf) and next(known) else _zero(leaf)
        return found, jax.tree.map(derivative_of, found)

    return called


def _where(chosen: Sequence[bool], values: Arrays, wanted: bool = True) -> list[Any]:
    """Return the values that are chosen, or those that are not."""
    return [value for value, each in zip(values, chosen, strict=True) if each == wanted]


def _merged(chosen: Sequence[bool], values: Arrays, others: Arrays) -> list[Any]:
    """Return the list of which ``_where`` gives these values and these others."""
    some, rest = iter(values), iter(others)
    return [next(some) if each else next(rest) for each in chosen]


def _shapes(arrays: Arrays) -> tuple[jax.ShapeDtypeStruct, ...]:
    return tuple(jax.ShapeDtypeStruct(jnp.shape(each), jnp.result_type(each)) for each in arrays)


def _has_values(array: Any) -> bool:
    """Return whether this is an array or a batch of one, with which jax computes at once; others are taken for recorded."""
    return not isinstance(_unbatched(array), jax.core.Tracer)


def is_recorded(arrays: Arrays) -> bool:
    """Return whether one of these is an array of a function that jax records, maybe in a batch or a derivative.

    Within ``jax.ensure_compile_time_eval`` arrays of constants alone have values also while jax records.
    """
    for array in arrays:
        while isinstance(array, jax.core.Tracer):
            # jax has no public names for these
            if type(array).__name__ == "DynamicJaxprTracer":
                return True
            array = getattr(array, "val", getattr(array, "primal", None))
    return False


def encloses_tracers(structure: Any) -> bool:
    """Return whether a function in the structure of a tree uses, without taking it, an array of what is transformed."""
    _, fixed = structure.node_data() or (None, None)
    found, seen = jax.tree.leaves(fixed), set[int]()
    while found:
        each = found.pop()
        if isinstance(each, jax.core.Tracer):
            return True
        # a function may be in its own closure
        if id(each) in seen:
            continue
        seen.add(id(each))
        if isinstance(each, functools.partial):
            found += jax.tree.leaves((each.func, each.args, each.keywords))
        # a bound method, and an object that is called
        found += jax.tree.leaves(getattr(each, "__self__", None))
        if not isinstance(each, type | types.ModuleType):
            found += jax.tree.leaves(getattr(each, "__dict__", None))
        for cell in getattr(each, "__closure__", None) or ():
            # a name that has no value yet
            with contextlib.suppress(ValueError):
                found += jax.tree.leaves(cell.cell_contents)
    return any(map(encloses_tracers, structure.children()))


def members(arrays: Arrays) -> int:
    """Return how many members a batch of arrays within ``jax.vmap`` has, 1 for arrays that are none."""
    sizes = [(math.prod(jnp.shape(_unbatched(each))), math.prod(jnp.shape(each))) for each in arrays]
    return max([1, *(every // max(own, 1) for every, own in sizes)])


def _unbatched(array: Any) -> Any:
    """Return the array of all members of a batch, and any other array itself."""
    while _is_batch(array):
        array = array.val
    return array


def _is_batch(array: Any) -> bool:
    """Return whether this is a batch within ``jax.vmap``, for which jax has no public name."""
    return type(array).__name__ == "BatchTracer"


def is_real(leaf: Any) -> bool:
    """Return whether an array is of real or complex numbers, and so has a derivative."""
    return bool(jnp.issubdtype(jnp.result_type(leaf), jnp.inexact))


def _zero(leaf: Any) -> SymbolicZero:
    return SymbolicZero(jax.typeof(leaf).to_tangent_aval())
