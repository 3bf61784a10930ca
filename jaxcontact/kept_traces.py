"""What jax traced, kept on disk: the next process of the command line need not trace it again.

A compiled program is found on disk (``compilation_cache``) only by its text, and to write that text takes jax two
seconds of a run of seven. Here the text is kept too (``jax.export``), under a name made of all that it follows from: the
function, its static arguments, the structure and types of its arrays, the sources of the packages, the versions of
what traces it and jax's settings. Its results are the same, bit for bit.
"""

import functools
import hashlib
import importlib.metadata
import importlib.util
import io
import os
import pickle
import sys
import tempfile
import time
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
from jax import export

from jaxcontact._pytree import is_concrete

LARGEST = 64 << 20
"""Bytes on disk; what was used longest ago goes first."""
TRACED_BY = ("jax", "jaxlib", "numpy", "scipy")

SETTLED = 10.0
"""Seconds: sources changed later than that before this process began may not be those that it runs."""

HASTE = {"xla_cpu_use_fusion_emitters": False}
"""Options of jax's compiler: many programs compile in half the time and run as fast; the march, in four times that."""

_began = time.time()
_folder: Path | None = None


@contextmanager
def kept_traces(folder: Path) -> Iterator[None]:
    """Within, programs of arrays that are known are taken from the folder, and kept there when they are not yet.

    Raises OSError where the folder cannot be made.
    """
    global _folder
    folder.mkdir(parents=True, exist_ok=True)
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
        text, result = _kept(name, lambda: _traced(functools.partial(self.compiled, **static), args))
        options = _haste() if self.in_haste else None
        call = jax.jit(export.deserialize(bytearray(text)).call, compiler_options=options)
        structure = jax.tree.structure(result)
        return lambda *args: jax.tree.unflatten(structure, call(*jax.tree.leaves(args)))


def shapes(function: Callable[..., Any], *args: Any) -> Any:
    """``jax.eval_shape`` of a function of a module, kept as a program is."""
    name = _name(function, args, {"shapes": True})
    if name is None:
        return jax.eval_shape(function, *args)

    def told() -> tuple[list[tuple[Any, str]], Any]:
        leaves, structure = jax.tree.flatten(jax.eval_shape(function, *args))
        return [(leaf.shape, str(leaf.dtype)) for leaf in leaves], _marked(structure)

    each, result = _kept(name, told)
    return jax.tree.unflatten(jax.tree.structure(result), [jax.ShapeDtypeStruct(*one) for one in each])


def _traced(function: Callable[..., Any], args: Any) -> tuple[bytes, Any]:
    """The text of a program of the leaves of its arguments, and its result with numbers for leaves."""
    leaves, structure = jax.tree.flatten(args)
    results = []

    def of_leaves(*leaves: Any) -> tuple[Any, ...]:
        flat, result = jax.tree.flatten(function(*jax.tree.unflatten(structure, leaves)))
        results.append(result)
        return tuple(flat)

    text = export.export(jax.jit(of_leaves))(*leaves).serialize()
    return bytes(text), _marked(results[0])


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
    """A digest of the sources of packages; nothing where they may have changed since they were read."""
    digest, latest = hashlib.sha256(), 0.0
    for name in sorted(packages):
        folder = Path(str(sys.modules[name].__file__)).parent
        for path in sorted(folder.rglob("*.py")):
            digest.update(f"{path.relative_to(folder)}\0".encode() + path.read_bytes())
            latest = max(latest, path.stat().st_mtime)
    return digest.digest() if latest < _began - SETTLED else b""


@functools.cache
def _settings() -> bytes:
    """What jax reads of its surroundings, and the versions of those whose numbers are in a program."""
    said = sorted(f"{k}={v}" for k, v in os.environ.items() if k.startswith(("JAX_", "XLA_")))
    versions = [importlib.metadata.version(name) for name in TRACED_BY]
    return repr((said, versions, sys.version_info[:2], jax.config.jax_enable_x64)).encode()  # type: ignore[attr-defined]


def _kept(name: str, make: Callable[[], Any]) -> Any:
    """What is in the file of that name, or made and put there."""
    assert _folder is not None
    kept = _read(_folder / name)
    if kept is None:
        kept = make()
        _write(_folder / name, kept)
    return kept


def _read(path: Path) -> Any:
    """What is in a file, and its use noted; None where it is not there or not whole."""
    try:
        digest, _, content = path.read_bytes().partition(b"\n")
    except OSError:
        return None
    with suppress(OSError):  # of a folder that may only be read
        path.touch()
    return pickle.loads(content) if hashlib.sha256(content).hexdigest().encode() == digest else None


def _write(path: Path, kept: Any) -> None:
    """Into a file, whole or not at all; the oldest others go where they would be too many."""
    content = pickle.dumps(kept)
    with suppress(OSError):  # a full disk: trace again the next time
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as half:
            half.write(hashlib.sha256(content).hexdigest().encode() + b"\n" + content)
        os.replace(half.name, path)
        _forget(path.parent)


def _forget(folder: Path) -> None:
    """Remove what was used longest ago, until the rest is small enough."""
    files = sorted(folder.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
    total = 0
    for path in files:
        total += path.stat().st_size
        if total > LARGEST:
            path.unlink(missing_ok=True)
