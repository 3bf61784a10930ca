"""What jax traced, kept on disk: the next process of the command line need not trace it again.

A compiled program is found on disk (``compilation_cache``) only by its text, and to write that text takes jax two
seconds of a run of seven. Here the text is kept too (``jax.export``), under a name made of all that it follows from: the
function, its static arguments, the structure and types of its arrays, the sources of the packages, the versions of
what traces it and jax's settings. Its results are the same, bit for bit.

A file is a checksum, a line of JSON that describes the structure of the result, and the text of the program. Reading it
executes nothing: JSON names classes of this project alone, whose instances it fills with plain values. The folder must
belong to the user and be writable by nobody else, since whoever writes into it decides what is computed.
"""

import dataclasses
import functools
import hashlib
import importlib.metadata
import importlib.util
import io
import json
import os
import pickle
import stat
import sys
import tempfile
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
from jax import export

from jaxcontact._support import sources as source_files
from jaxcontact._support.pytree import is_concrete

LARGEST = 64 << 20
"""Bytes on disk; what was used longest ago goes first."""
OWN = ("jaxcontact", "fitting")
Kept: TypeAlias = tuple[Any, bytes]  # a tree that JSON can describe, and bytes
TRACED_BY = ("jax", "jaxlib", "numpy", "scipy")

SETTLED = 10.0
"""Seconds: sources changed later than that before this process began may not be those that it runs."""

HASTE = {"xla_cpu_use_fusion_emitters": False}
"""Options of jax's compiler: many programs compile in half the time and run as fast; the march, in four times that."""

_folder: Path | None = None


class UntrustedFolderError(OSError):
    """A folder that others could have written into; the message is one line for the user."""


@contextmanager
def kept_traces(folder: Path) -> Iterator[None]:
    """Within, programs of arrays that are known are taken from the folder, and kept there when they are not yet.

    Raises OSError where the folder cannot be made, UntrustedFolderError where it belongs to, or can be written by, others.
    """
    global _folder
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    if not _is_private(folder):
        raise UntrustedFolderError(
            f"{folder}: found a folder that another user owns or may write into, so traced programs are not kept there;"
            " accepted: one of your own (chmod go-w), or another JAX_COMPILATION_CACHE_DIR"
        )
    _folder = folder
    try:
        yield
    finally:
        _folder = None


class Program:
    """A compiled function of a module, of pytrees of arrays and static keywords; its trace can be kept.

    To jax's transformations, and outside ``kept_traces``, it is ``jax.jit`` of the function, ``compiled``; with the
    options of ``HASTE`` where it is ``in_haste`` and nothing is traced around it.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        static_argnames: tuple[str, ...] = (),
        in_haste: bool = False,
    ):
        functools.update_wrapper(self, function)
        self.function, self.static_argnames, self.in_haste = function, static_argnames, in_haste
        self.compiled = jax.jit(function, static_argnames=static_argnames)
        self._met: dict[str, Callable[..., Any]] = {}

    def __call__(self, *args: Any, **static: Any) -> Any:
        name = _name(self.function, args, static)
        if name is None:
            in_haste = self.in_haste and _is_outermost(args)
            return (self._compiled_in_haste if in_haste else self.compiled)(*args, **static)
        if name not in self._met:
            self._met[name] = self._found(name, args, static)
        return self._met[name](*args)

    @functools.cached_property
    def _compiled_in_haste(self) -> Callable[..., Any]:
        return jax.jit(self.function, static_argnames=self.static_argnames, compiler_options=_haste())

    def _found(self, name: str, args: Any, static: dict[str, Any]) -> Callable[..., Any]:
        """The program of that name."""
        result, text = _kept(name, lambda: _traced(functools.partial(self.compiled, **static), args))
        options = _haste() if self.in_haste else None
        call = jax.jit(export.deserialize(bytearray(text)).call, compiler_options=options)
        structure = jax.tree.structure(result)
        return lambda *args: jax.tree.unflatten(structure, call(*jax.tree.leaves(args)))


def shapes(function: Callable[..., Any], *args: Any) -> Any:
    """``jax.eval_shape`` of a function of a module, kept as a program is."""
    name = _name(function, args, {"shapes": True})
    if name is None:
        return jax.eval_shape(function, *args)

    def told() -> Kept:
        leaves, structure = jax.tree.flatten(jax.eval_shape(function, *args))
        return ([(leaf.shape, str(leaf.dtype)) for leaf in leaves], _marked(structure)), b""

    (each, result), _ = _kept(name, told)
    return jax.tree.unflatten(jax.tree.structure(result), [jax.ShapeDtypeStruct(*one) for one in each])


def _traced(function: Callable[..., Any], args: Any) -> Kept:
    """Return the result of a program with numbers for leaves, and its text, of the leaves of its arguments."""
    leaves, structure = jax.tree.flatten(args)
    results = []

    def of_leaves(*leaves: Any) -> tuple[Any, ...]:
        flat, result = jax.tree.flatten(function(*jax.tree.unflatten(structure, leaves)))
        results.append(result)
        return tuple(flat)

    text = export.export(jax.jit(of_leaves))(*leaves).serialize()
    return _marked(results[0]), bytes(text)


def _marked(structure: Any) -> Any:
    """A tree of this structure that can be written: its leaves are numbers."""
    return jax.tree.unflatten(structure, range(structure.num_leaves))


def _name(function: Callable[..., Any], args: Any, static: dict[str, Any]) -> str | None:
    """Of the file; None for what is not kept: where parts are not known, or not told by the packages' sources."""
    if _folder is None or not _is_outermost(args) or not _can_be_kept():
        return None
    leaves, structure = jax.tree.flatten(args)
    kinds = [str(jax.typeof(leaf)) for leaf in leaves]
    package, own = function.__module__.partition(".")[0], __name__.partition(".")[0]
    packages, said = frozenset((package, own)), io.BytesIO()
    try:
        _Writer(said, packages).dump(
            (function.__module__, function.__qualname__, static, kinds, _marked(structure))
        )
    except (pickle.PicklingError, AttributeError):  # of a lambda the latter
        return None
    sources = _sources(packages)
    digest = hashlib.sha256(said.getvalue() + sources + _settings())
    return f"{function.__name__}-{digest.hexdigest()}" if sources else None


def _is_outermost(args: Any) -> bool:
    """Whether nothing is being traced around a call: jax takes options of its compiler only there."""
    return is_concrete(args, jnp.zeros(()))


@functools.cache
def _haste() -> dict[str, Any]:
    """``HASTE``, where this compiler knows these options."""
    try:
        jax.jit(lambda: 0, compiler_options=HASTE)()
    except jax.errors.JaxRuntimeError:
        return {}
    return HASTE


@functools.cache
def _can_be_kept() -> bool:
    """Whether jax can write programs down here: on a processor, of whose solvers it promises to know them again."""
    return jax.default_backend() == "cpu" and importlib.util.find_spec("flatbuffers") is not None


class _Writer(pickle.Pickler):
    """Writes trees of the packages' own classes: what a user's function or class does, its name does not tell."""

    def __init__(self, file: io.BytesIO, packages: frozenset[str]):
        super().__init__(file)
        self.packages = packages
        self.fast = True  # equal trees, equal bytes, whichever of their parts are one object

    def reducer_override(self, obj: Any) -> Any:
        """Refuses what is foreign; all else as ever."""
        of_code = isinstance(obj, (type, types.FunctionType, types.BuiltinFunctionType, functools.partial))
        if of_code and str(obj.__module__).partition(".")[0] not in self.packages:
            raise pickle.PicklingError
        return NotImplemented


@functools.cache
def _sources(packages: frozenset[str]) -> bytes:
    """Return a digest of the sources of packages; nothing where one has none, or they may have changed since.

    A program is kept only where its sources are found: without them two states of a package look the same.
    """
    files = {name: source_files.files_of(name, ".py") for name in sorted(packages)}
    latest = max(map(source_files.last_change, files.values()))
    if not all(files.values()) or latest >= source_files.BEGAN - SETTLED:
        return b""
    return "".join(source_files.digest(name, paths) for name, paths in files.items()).encode()


@functools.cache
def _settings() -> bytes:
    """What jax reads of its surroundings, and the versions of those whose numbers are in a program."""
    said = sorted(f"{k}={v}" for k, v in os.environ.items() if k.startswith(("JAX_", "XLA_")))
    versions = [importlib.metadata.version(name) for name in TRACED_BY]
    return repr((said, versions, sys.version_info[:2], jax.config.jax_enable_x64)).encode()  # type: ignore[attr-defined]


def _kept(name: str, make: Callable[[], Kept]) -> Kept:
    """Return what is in the file of that name, or what is made and put there."""
    assert _folder is not None
    kept = _read(_folder / name)
    if kept is None:
        kept = make()
        _write(_folder / name, kept)
    return kept


def _read(path: Path) -> Kept | None:
    """Return what is in a file, and note its use; None where it is not there, not whole, or another user's."""
    try:
        digest, _, content = path.read_bytes().partition(b"\n")
        if hashlib.sha256(content).hexdigest().encode() != digest or not _is_private(path):
            return None
        described, _, text = content.partition(b"\n")
        kept = _described(json.loads(described)), text
    except (OSError, ValueError, TypeError, KeyError):  # of one that was written by something else
        return None
    with suppress(OSError):  # of a folder that may only be read
        path.touch()
    return kept


def _write(path: Path, kept: Kept) -> None:
    """Into a file, whole or not at all; the oldest others go where they would be too many."""
    try:
        content = json.dumps(_description(kept[0])).encode() + b"\n" + kept[1]
    except TypeError:  # of a result with something in its structure that JSON cannot say
        return
    half = None
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as half:
            half.write(hashlib.sha256(content).hexdigest().encode() + b"\n" + content)
        os.replace(half.name, path)
        _forget(path.parent)
    except OSError:  # a full disk: trace again the next time
        with suppress(OSError):
            Path(half.name if half else "").unlink()


def _is_private(path: Path) -> bool:
    """Return whether a file or folder is the user's, and nobody else may write to it; True where there are no owners."""
    if not hasattr(os, "getuid"):
        return True
    found = path.stat()
    return found.st_uid == os.getuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _description(value: Any) -> Any:
    """Return a tree as JSON can say it: containers, dataclasses, functions and classes of this project by their names.

    Raises TypeError for anything else.
    """
    if value is None or type(value) in (bool, int, float, str):
        return value
    if type(value) in (list, tuple):
        return [type(value).__name__, *map(_description, value)]
    if type(value) is dict:
        return ["dict", *([_description(key), _description(item)] for key, item in value.items())]
    if isinstance(value, type | types.FunctionType):
        return ["name", _name_of(value)]
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return ["tuple of", _name_of(type(value)), *map(_description, value)]
    if dataclasses.is_dataclass(value):
        fields = [
            [field.name, _description(getattr(value, field.name))] for field in dataclasses.fields(value)
        ]
        return ["object", _name_of(type(value)), *fields]
    raise TypeError(f"{type(value).__name__} in a structure")


def _name_of(value: Any) -> str:
    name = f"{value.__module__}:{value.__qualname__}"
    if _named(name) is not value:
        raise TypeError(name)
    return name


def _named(name: str) -> Any:
    """Return a class or function of this project. Raises TypeError for any other name."""
    module, _, path = name.partition(":")
    if module.partition(".")[0] not in OWN or module not in sys.modules:
        raise TypeError(name)
    found: Any = sys.modules[module]
    for each in path.split("."):
        found = getattr(found, each, None)
    if not isinstance(found, type | types.FunctionType) or found.__module__ != module:
        raise TypeError(name)
    return found


def _described(said: Any) -> Any:
    """Return the tree of a description."""
    if not isinstance(said, list):
        return said
    kind, *parts = said
    if kind in ("list", "tuple"):
        return (list if kind == "list" else tuple)(map(_described, parts))
    if kind == "dict":
        return {_described(key): _described(item) for key, item in parts}
    cls = _named(parts[0])
    if kind == "name":
        return cls
    if kind == "tuple of" and issubclass(cls, tuple):
        return cls(*map(_described, parts[1:]))
    if kind == "object" and dataclasses.is_dataclass(cls):
        return cls(**{name: _described(value) for name, value in parts[1:]})  # type: ignore[operator]
    raise TypeError(kind)


def _forget(folder: Path) -> None:
    """Remove what was used longest ago, until the rest is small enough."""
    files = sorted(folder.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
    total = 0
    for path in files:
        total += path.stat().st_size
        if total > LARGEST:
            path.unlink(missing_ok=True)
