"""An on-disk cache of exported JAX programs, so that later processes of the command line skip tracing.

A compiled program is found on disk (``compilation_cache``) only by its text, and jax needs two seconds, of a run of
seven, to produce that text. Here the text is stored too (``jax.export``), under a name derived from everything that it
depends on: the function, its static arguments, the structure and types of its arrays, the sources of the packages, the
versions of the libraries that trace it and jax's settings. The results are identical bit for bit.

A file is a checksum, a line of JSON that describes the structure of the result, and the text of the program. Reading it
executes nothing: JSON names only classes of this project, whose instances are filled with plain values. The folder must
belong to the user and be writable by nobody else, since whoever can write to it determines what is computed.
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
"""Bytes on disk; the least recently used files are removed first."""
OWN = ("jaxcontact", "fitting")
StoredTrace: TypeAlias = tuple[Any, bytes]  # a tree that JSON can describe, and the text of a program
TRACED_BY = ("jax", "jaxlib", "numpy", "scipy")

SETTLING_TIME = 10.0
"""Seconds: if sources changed less than this before the process started, it may run older ones."""

FAST_COMPILE = {"xla_cpu_use_fusion_emitters": False, "xla_backend_optimization_level": 2}
"""Compiler options with which programs compile in half to three quarters of the time and run equally fast."""

UNOPTIMISED = FAST_COMPILE | {"xla_backend_optimization_level": 0}
"""Compiler options with which programs compile in less than half the time; a run takes two to three times as long."""

_folder: Path | None = None


class UntrustedFolderError(OSError):
    """A folder that other users could have written to; the message is one line for the user."""


@contextmanager
def kept_traces(folder: Path) -> Iterator[None]:
    """Load programs of concrete arrays from the folder, and store new ones there, within this context.

    Raises OSError if the folder cannot be made, UntrustedFolderError if it belongs to, or can be written by, other users.
    """
    global _folder
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    if not _is_private(folder):
        raise UntrustedFolderError(
            f"{folder}: found a folder that another user owns or may write to, so traced programs are not stored there;"
            " accepted: a folder of your own (chmod go-w), or another JAX_COMPILATION_CACHE_DIR"
        )
    _folder = folder
    try:
        yield
    finally:
        _folder = None


class Program:
    """A compiled function of pytrees of arrays and static keywords, defined in a module, whose trace can be cached on
    disk.

    It has the compiler options of ``FAST_COMPILE``, or of ``UNOPTIMISED`` if it is not ``optimised``. Within jax's
    transformations, where jax accepts no options for a part of a program, it is ``jax.jit`` of the function, ``compiled``.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        static_argnames: tuple[str, ...] = (),
        optimised: bool = True,
    ):
        functools.update_wrapper(self, function)
        self.function, self.static_argnames, self.optimised = function, static_argnames, optimised
        self.compiled = jax.jit(function, static_argnames=static_argnames)
        self._loaded: dict[str, Callable[..., Any]] = {}

    def __call__(self, *args: Any, **static: Any) -> Any:
        name = _name(self.function, args, static)
        if name is None:
            return (self._compiled_fast if _is_outermost(args) else self.compiled)(*args, **static)
        if name not in self._loaded:
            self._loaded[name] = self._find(name, args, static)
        return self._loaded[name](*args)

    @functools.cached_property
    def _compiled_fast(self) -> Callable[..., Any]:
        return jax.jit(self.function, static_argnames=self.static_argnames, compiler_options=self._options())

    def _options(self) -> dict[str, Any]:
        return fast_compile_options() if self.optimised else unoptimised_options()

    def _find(self, name: str, args: Any, static: dict[str, Any]) -> Callable[..., Any]:
        """Return the program of that name, loaded or traced."""
        result, text = _load_or_make(name, lambda: _traced(functools.partial(self.compiled, **static), args))
        call = jax.jit(export.deserialize(bytearray(text)).call, compiler_options=self._options())
        structure = jax.tree.structure(result)
        return lambda *args: jax.tree.unflatten(structure, call(*jax.tree.leaves(args)))


def shapes(function: Callable[..., Any], *args: Any) -> Any:
    """Return ``jax.eval_shape`` of a function defined in a module, cached on disk like a program."""
    name = _name(function, args, {"shapes": True})
    if name is None:
        return jax.eval_shape(function, *args)

    def evaluated() -> StoredTrace:
        leaves, structure = jax.tree.flatten(jax.eval_shape(function, *args))
        return ([(leaf.shape, str(leaf.dtype)) for leaf in leaves], _with_numbered_leaves(structure)), b""

    (each, result), _ = _load_or_make(name, evaluated)
    return jax.tree.unflatten(jax.tree.structure(result), [jax.ShapeDtypeStruct(*one) for one in each])


def _traced(function: Callable[..., Any], args: Any) -> StoredTrace:
    """Return the result's tree with numbers as leaves, and the text of the program as a function of its arguments'
    leaves.
    """
    leaves, structure = jax.tree.flatten(args)
    results = []

    def of_leaves(*leaves: Any) -> tuple[Any, ...]:
        flat, result = jax.tree.flatten(function(*jax.tree.unflatten(structure, leaves)))
        results.append(result)
        return tuple(flat)

    text = export.export(jax.jit(of_leaves))(*leaves).serialize()
    return _with_numbered_leaves(results[0]), bytes(text)


def _with_numbered_leaves(structure: Any) -> Any:
    """Return a tree of this structure that can be stored: its leaves are numbers."""
    return jax.tree.unflatten(structure, range(structure.num_leaves))


def _name(function: Callable[..., Any], args: Any, static: dict[str, Any]) -> str | None:
    """Return the file name of a program; None if it is not cached because some part is not identified by the packages'
    sources.
    """
    on_a_mesh = not jax.sharding.get_abstract_mesh().empty
    if _folder is None or on_a_mesh or not _is_outermost(args) or not _can_export():
        return None
    leaves, structure = jax.tree.flatten(args)
    kinds = [str(jax.typeof(leaf)) for leaf in leaves]
    package, own = function.__module__.partition(".")[0], __name__.partition(".")[0]
    packages, content = frozenset((package, own)), io.BytesIO()
    try:
        _Writer(content, packages).dump(
            (function.__module__, function.__qualname__, static, kinds, _with_numbered_leaves(structure))
        )
    except (pickle.PicklingError, AttributeError):  # the latter for a lambda
        return None
    sources = _sources(packages)
    digest = hashlib.sha256(content.getvalue() + sources + _settings())
    return f"{function.__name__}-{digest.hexdigest()}" if sources else None


def _is_outermost(args: Any) -> bool:
    """Return whether a call is not within a trace: only there does jax accept compiler options."""
    return is_concrete(args, jnp.zeros(()))


@functools.cache
def fast_compile_options() -> dict[str, Any]:
    """Return ``FAST_COMPILE`` as far as it applies."""
    return _applicable(FAST_COMPILE)


@functools.cache
def unoptimised_options() -> dict[str, Any]:
    """Return ``UNOPTIMISED`` as far as it applies."""
    return _applicable(UNOPTIMISED)


def _applicable(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options that ``XLA_FLAGS`` does not set; none for other devices, or a compiler that does not know them."""
    chosen = os.environ.get("XLA_FLAGS", "")
    options = {name: value for name, value in options.items() if f"--{name}=" not in chosen}
    if jax.default_backend() != "cpu":
        return {}
    try:
        jax.jit(lambda: 0, compiler_options=options)()
    except jax.errors.JaxRuntimeError:
        return {}
    return options


@functools.cache
def _can_export() -> bool:
    """Return whether programs can be exported: on a CPU, for whose solvers jax guarantees compatibility."""
    return jax.default_backend() == "cpu" and importlib.util.find_spec("flatbuffers") is not None


class _Writer(pickle.Pickler):
    """A pickler for trees of the packages' own classes only, since a name does not identify a user's function or class."""

    def __init__(self, file: io.BytesIO, packages: frozenset[str]):
        super().__init__(file)
        self.packages = packages
        self.fast = True  # no memo, so that equal trees give equal bytes whether or not they share objects

    def reducer_override(self, obj: Any) -> Any:
        """Reject functions and classes of other packages; handle everything else as usual."""
        of_code = isinstance(obj, (type, types.FunctionType, types.BuiltinFunctionType, functools.partial))
        if of_code and str(obj.__module__).partition(".")[0] not in self.packages:
            raise pickle.PicklingError
        return NotImplemented


@functools.cache
def _sources(packages: frozenset[str]) -> bytes:
    """Return a digest of the sources of packages; empty if a package has none, or if they may have changed since the
    start.

    A program is stored only if its sources are found: without them two states of a package are indistinguishable.
    """
    files = {name: source_files.files_of(name, ".py") for name in sorted(packages)}
    latest = max(map(source_files.last_change, files.values()))
    if not all(files.values()) or latest >= source_files.START_TIME - SETTLING_TIME:
        return b""
    return "".join(source_files.digest(name, paths) for name, paths in files.items()).encode()


@functools.cache
def _settings() -> bytes:
    """Return jax's settings from the environment, and the versions of the libraries that affect a program."""
    variables = sorted(f"{k}={v}" for k, v in os.environ.items() if k.startswith(("JAX_", "XLA_")))
    versions = [importlib.metadata.version(name) for name in TRACED_BY]
    x64 = jax.config.jax_enable_x64  # type: ignore[attr-defined]
    return repr((variables, versions, sys.version_info[:2], x64)).encode()


def _load_or_make(name: str, make: Callable[[], StoredTrace]) -> StoredTrace:
    """Return the contents of the file of that name, or make and store them."""
    assert _folder is not None
    kept = _read(_folder / name)
    if kept is None:
        kept = make()
        _write(_folder / name, kept)
    return kept


def _read(path: Path) -> StoredTrace | None:
    """Return the contents of a file, and update its time; None if it is absent, incomplete, or another user's."""
    try:
        digest, _, content = path.read_bytes().partition(b"\n")
        if hashlib.sha256(content).hexdigest().encode() != digest or not _is_private(path):
            return None
        described, _, text = content.partition(b"\n")
        kept = _restored(json.loads(described)), text
    except (OSError, ValueError, TypeError, KeyError):  # the last three: a file in another format
        return None
    with suppress(OSError):  # a read-only folder
        path.touch()
    return kept


def _write(path: Path, kept: StoredTrace) -> None:
    """Write a file atomically, and remove the oldest files if there are too many."""
    try:
        content = json.dumps(_description(kept[0])).encode() + b"\n" + kept[1]
    except TypeError:  # the structure of the result cannot be described in JSON
        return
    partial = None
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as partial:
            partial.write(hashlib.sha256(content).hexdigest().encode() + b"\n" + content)
        os.replace(partial.name, path)
        _remove_oldest(path.parent)
    except OSError:  # a full disk: the program is traced again the next time
        with suppress(OSError):
            Path(partial.name if partial else "").unlink()


def _is_private(path: Path) -> bool:
    """Return whether a file or folder is the user's and not writable by others; True on systems without owners."""
    if not hasattr(os, "getuid"):
        return True
    found = path.stat()
    return found.st_uid == os.getuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _description(value: Any) -> Any:
    """Return a description of a tree in JSON: containers, dataclasses, functions and classes of this project by name.

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


def _restored(description: Any) -> Any:
    """Return the tree of a description."""
    if not isinstance(description, list):
        return description
    kind, *parts = description
    if kind in ("list", "tuple"):
        return (list if kind == "list" else tuple)(map(_restored, parts))
    if kind == "dict":
        return {_restored(key): _restored(item) for key, item in parts}
    cls = _named(parts[0])
    if kind == "name":
        return cls
    if kind == "tuple of" and issubclass(cls, tuple):
        return cls(*map(_restored, parts[1:]))
    if kind == "object" and dataclasses.is_dataclass(cls):
        return cls(**{name: _restored(value) for name, value in parts[1:]})  # type: ignore[operator]
    raise TypeError(kind)


def _remove_oldest(folder: Path) -> None:
    """Remove the least recently used files until the total size is within the limit."""
    files = sorted(folder.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
    total = 0
    for path in files:
        total += path.stat().st_size
        if total > LARGEST:
            path.unlink(missing_ok=True)
