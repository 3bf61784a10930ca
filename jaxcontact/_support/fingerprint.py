"""The identity of a function by its content: its code, and every value that the code is known to read.

The same function has the same identity in every process, on every machine and wherever in its file it is defined. The
identity is a table of parts, one for each function, class and constant that is reached, so that a message can name what
differs. Functions and classes of installed packages are identified by name and version, those of jaxcontact and fitting
by a digest of all sources, everything else by content: arrays by type, shape and bytes, sets in an order independent
of hashes, objects by their class and the state that pickle would store.

Values that the code reads in ways not visible in it (a file, ``globals()["name"]``, an environment variable) are not
part of the identity.
"""

import builtins
import contextlib
import copyreg
import dis
import enum
import functools
import hashlib
import importlib
import importlib.metadata
import importlib.util
import pickle
import struct
import sys
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import jax
import numpy as np

from jaxcontact._support import code_reads, sources

OWN = ("jaxcontact", "fitting")
REMEDY = 'pass version="...", a text that identifies the version of f'
READ_BY_TEXT = ("eval", "exec", "globals", "__import__")  # what they read is not known before they run
SOURCE_ATTRIBUTES = ("__firstlineno__", "__static_attributes__")  # stored in a class body from Python 3.13 on
WRAPPERS = (type(functools.lru_cache(len)), type(jax.jit(len)))  # identified by the function that they wrap
DESCRIPTORS = (
    types.MethodDescriptorType,
    types.WrapperDescriptorType,
    types.ClassMethodDescriptorType,
    types.MethodWrapperType,
    types.GetSetDescriptorType,
    types.MemberDescriptorType,
)
IGNORED_CLASS_ATTRIBUTES = {  # attributes derived by Python, or describing where a class is defined
    "__module__", "__qualname__", "__dict__", "__weakref__", "__doc__", "__firstlineno__", "__static_attributes__",
    "__annotations__", "__annotate__", "__annotate_func__", "__annotations_cache__", "__dataclass_fields__",
    "__dataclass_params__", "__abstractmethods__", "_abc_impl", "__parameters__", "__orig_bases__",
}  # fmt: skip


def parts_of(f: types.FunctionType) -> dict[str, str]:
    """Return the identity of a function, {name of a part: digest}; the first part is ``f``, its own code.

    Raises:
        ValueError: f reaches a value whose content cannot be compared, such as an open file; the message names it.
    """
    identity = _Identity()
    identity.named("f", f)
    return identity.parts


def packages_of(*names: str) -> dict[str, str]:
    """Return the parts of an identity that stand for packages of this project, by the digests of their sources."""
    return {f"the sources of {name}": sources.identity(name) for name in names}


def differing(one: dict[str, str], other: dict[str, str]) -> list[str]:
    """Return the names of the parts in which two identities differ: only common ones if any differ, since others follow."""
    common = [name for name in one if name in other and one[name] != other[name]]
    return common or [name for name in {**one, **other} if (name in one) != (name in other)]


class _Identity:
    """A traversal of everything that a value consists of; it collects ``parts``."""

    def __init__(self) -> None:
        self.parts: dict[str, str] = {}
        self.labels: dict[int, str] = {}  # of the functions and classes visited, by their ids
        self.kept: list[
            Any
        ] = []  # references to the same objects, since an id is unique only while its object exists
        self.open: list[int] = []  # the containers around the current value
        self.place: list[str] = []  # the name of the current value, for messages

    def of(self, value: Any) -> bytes:
        """Return the digest of a value."""
        simple = _simple(value)
        if simple is not None:
            return simple
        if id(value) in self.open:  # a container inside itself
            return _digest("again", len(self.open) - self.open.index(id(value)))
        self.open.append(id(value))
        try:
            return self._compound(value)
        finally:
            self.open.pop()

    def named(self, name: str, value: Any, attributes: frozenset[str] = frozenset()) -> bytes:
        """Return the digest of a variable's value, recorded as a part; attributes: those read from it, if it is a module."""
        with self._at(name):
            if isinstance(value, types.ModuleType) and not _package(value.__name__):
                return self._of_module(name, value, attributes)
            if isinstance(value, types.FunctionType | type | types.ModuleType):
                return self.of(value)
            content = self.of(value)
        label = self._unique_label(name, content.hex())
        self.parts[label] = content.hex()
        return _digest("part", label)

    def _compound(self, value: Any) -> bytes:
        if (foreign := self._foreign(value)) is not None:
            return foreign
        match value:
            case types.FunctionType():
                return self._part(value, self._function)
            case type():
                return self._part(value, self._class)
            case types.CodeType():
                return self._code(value)
            case types.MethodType():
                return _digest("method", self.of(value.__func__), self.of(value.__self__))
            case staticmethod() | classmethod():
                return _digest(type(value).__name__, self.of(value.__func__))
            case property():
                return _digest("property", *map(self.of, (value.fget, value.fset, value.fdel)))
            case functools.cached_property():
                return _digest("cached_property", self.of(value.func))
            case types.BuiltinFunctionType():
                return _digest("bound", value.__name__, self.of(value.__self__))
            case types.MappingProxyType():
                return self.of(dict(value))
            case enum.Enum():
                return _digest("enum", self.of(type(value)), value.name)
        if isinstance(value, DESCRIPTORS):
            return _digest("descriptor", value.__name__)
        if isinstance(value, WRAPPERS):
            return _digest("wrapped", self.of(value.__wrapped__))  # type: ignore[union-attr]
        return self._data(value)

    def _data(self, value: Any) -> bytes:
        kind = type(value)
        if kind in (list, tuple):
            return _digest(kind.__name__, *map(self.of, value))
        if kind is dict:
            return _digest("dict", *(self.of(each) for item in value.items() for each in item))
        if kind in (set, frozenset):
            return _digest(kind.__name__, *sorted(map(self.of, value)))
        if kind is np.ndarray or isinstance(value, np.generic):
            return self._array(value)
        if isinstance(value, jax.Array):
            return self._jax_array(value)
        return self._object(value)

    def _array(self, value: Any) -> bytes:
        about = (type(value).__name__, repr(value.dtype.descr), value.dtype.name, repr(value.shape))
        if value.dtype.hasobject:
            return _digest(*about, self.of(value.tolist()))
        return _digest(*about, np.ascontiguousarray(value).tobytes())

    def _jax_array(self, value: jax.Array) -> bytes:
        if isinstance(value, jax.core.Tracer):
            self._reject("a value that jax is tracing")
        if jax.dtypes.issubdtype(value.dtype, jax.dtypes.prng_key):
            return _digest("key", str(value.dtype), self._array(np.asarray(jax.random.key_data(value))))
        return _digest("jax", str(value.weak_type), self._array(np.asarray(value)))

    def _object(self, value: Any) -> bytes:
        """Return the digest of any other object, from its class and the state that pickle would store."""
        reduce = copyreg.dispatch_table.get(type(value))
        try:
            reduced = reduce(value) if reduce else value.__reduce_ex__(4)
        except (
            Exception
        ):  # TypeError for a file, a lock or a generator; pickle's other errors have no common class
            self._reject(f"a {type(value).__module__}.{type(value).__qualname__}")
        if isinstance(reduced, str):  # the name of a global variable
            package = _package(pickle.whichmodule(value, reduced))  # type: ignore[attr-defined]
            return (
                self._reference(package, reduced)
                if package
                else self._reject(f"{reduced}, known by its name")
            )
        make, arguments, state, items, pairs = (*reduced, *(None,) * 5)[:5]
        contents = [list(each) if each is not None else None for each in (items, pairs)]
        pieces = map(self.of, (make, arguments, *contents))
        return _digest("object", self.of(type(value)), *pieces, self._state(state))

    def _state(self, state: Any) -> bytes:
        """Return the digest of the state of an object, independent of the order in which its attributes were set."""
        if isinstance(state, tuple) and len(state) == 2 and isinstance(state[1], dict):
            return _digest("slots", self._state(state[0]), self._state(state[1]))
        if not isinstance(state, dict):
            return self.of(state)
        pieces = []
        for name in sorted(state, key=str):
            with self._at(f".{name}"):
                pieces += [self.of(name), self.of(state[name])]
        return _digest("state", *pieces)

    def _part(self, value: Any, content: Any) -> bytes:
        """Return a reference to a function or class, whose content is a separate part."""
        if id(value) not in self.labels:
            own = value.__qualname__.rpartition("<locals>.")[2]
            name = self.place[-1] if not self.place[1:] or "<" in own else own
            label = self.labels[id(value)] = self._unique_label(name)
            self.kept.append(value)
            self.parts[label] = ""
            with self._at(label):
                self.parts[label] = content(value).hex()
        return _digest("part", self.labels[id(value)])

    def _function(self, f: types.FunctionType) -> bytes:
        code, attributes = f.__code__, code_reads.names(f.__code__)
        pieces = [self._code(code)]
        for place, value in (("its defaults", f.__defaults__), ("its defaults", f.__kwdefaults__)):
            with self._at(place):
                pieces.append(self.of(value))
        for name, cell in zip(code.co_freevars, f.__closure__ or (), strict=True):
            held = [cell.cell_contents] if _is_set(cell) else []
            pieces += [self._variable(code, name, value, attributes) for value in held]
        if not _package(_home(f)):  # the globals of an installed function belong to its package
            pieces += [self._state(vars(f)), *self._globals(f, attributes)]
        return _digest("function", *pieces)

    def _globals(self, f: types.FunctionType, attributes: frozenset[str]) -> Iterator[bytes]:
        # without __name__, which every class body reads
        for name in sorted(code_reads.globals_read(f.__code__) - {"__name__"}):
            if name in f.__globals__:
                yield self._variable(f.__code__, name, f.__globals__[name], attributes)
            elif name in READ_BY_TEXT:
                self._reject(f"a use of {name}, which may read anything", name)
            else:
                yield _digest("builtin" if hasattr(builtins, name) else "missing", name)
        for name in sorted(code_reads.modules_imported(f.__code__, f.__globals__.get("__package__"))):
            package = _package(name)
            yield self._reference(package, name) if package else self.named(name, _module(name), attributes)

    def _variable(self, code: types.CodeType, name: str, value: Any, attributes: frozenset[str]) -> bytes:
        own = isinstance(value, types.ModuleType) and not _package(value.__name__)
        if own and name in code_reads.used_whole(code):
            self._reject(f"the module {value.__name__}, used other than by an attribute", name)
        return self.named(name, value, attributes)

    def _of_module(self, name: str, module: types.ModuleType, attributes: frozenset[str]) -> bytes:
        """Return the digest of those members of a user's module that a function may read."""
        if id(module) in self.open:
            return _digest("module", name)
        self.open.append(id(module))
        members = sorted(attributes & vars(module).keys())
        pieces = [self.named(member, vars(module)[member], attributes) for member in members]
        self.open.pop()
        return _digest("module", *members, *pieces)

    def _class(self, cls: type) -> bytes:
        made = {name: value for name, value in vars(cls).items() if name not in IGNORED_CLASS_ATTRIBUTES}
        if issubclass(cls, enum.Enum):  # its members and its methods
            made = {name: value for name, value in made.items() if isinstance(value, types.FunctionType)}
            made |= {"members": [(each.name, each.value) for each in cls]}
        fields = getattr(cls, "__dataclass_fields__", {}).values()
        about = [(each.name, each.init, each.kw_only is True, dict(each.metadata)) for each in fields]
        bases = [base for base in cls.__bases__ if base is not object]
        return _digest("class", self.of(type(cls)), self.of(bases), self.of(about), self._state(made))

    def _code(self, code: types.CodeType) -> bytes:
        """Return the digest of the operations of code, independent of its file, line numbers and name."""
        pieces: list[Any] = []
        instructions = code_reads.instructions(code)
        for each, following in zip(instructions, [*instructions[1:], instructions[-1]], strict=True):
            if following.argval in SOURCE_ATTRIBUTES and following.opname.startswith("STORE"):
                continue
            pieces.append(each.opname)
            # by index: dis does not resolve the argument of every instruction that refers to a constant (KW_NAMES)
            is_constant = each.opcode in dis.hasconst and each.arg is not None
            pieces.append(self.of(code.co_consts[each.arg or 0]) if is_constant else str(each.arg))
        counts = (code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)
        names = (code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
        return _digest("code", repr(counts), repr(names), code.co_exceptiontable, *pieces)

    def _foreign(self, value: Any) -> bytes | None:
        """Return the digest of an object that an installed package defines under a name; None for everything else."""
        if isinstance(value, types.ModuleType):
            package = _package(value.__name__)
            if package is None:
                self._reject(f"the module {value.__name__}, used other than by an attribute")
            return self._reference(package, value.__name__)
        if not isinstance(value, types.FunctionType | type) and not callable(value):
            return None
        module, name = _home(value), getattr(value, "__qualname__", getattr(value, "__name__", None))
        if isinstance(value, np.ufunc) and not isinstance(module, str):
            module = pickle.whichmodule(value, value.__name__)  # type: ignore[attr-defined]
        package = _package(module)
        found: Any = sys.modules.get(module or "")
        for each in str(name).split("."):
            found = getattr(found, each, None)
        return self._reference(package, f"{module}.{name}") if package and found is value else None

    def _reference(self, package: tuple[str, str], name: str) -> bytes:
        top, version = package
        if top in OWN:
            self.parts |= packages_of(top)
        else:
            self.parts[f"the version of {top}"] = version
        return _digest("name", name)

    def _unique_label(self, name: str, content: str | None = None) -> str:
        """Return a label that no part with other content has."""
        label, count = name, 1
        while label in self.parts and (content is None or self.parts[label] != content):
            count += 1
            label = f"{name} ({count})"
        return label

    @contextlib.contextmanager
    def _at(self, name: str) -> Iterator[None]:
        self.place.append(name)
        yield
        self.place.pop()

    def _reject(self, found: str, *place: str) -> NoReturn:
        where = " in ".join(dict.fromkeys(reversed([*self.place, *place])))
        raise ValueError(
            f"f: expected values that can be compared by content, got {found} ({where}); {REMEDY}"
        )


def _digest(kind: str, *pieces: Any) -> bytes:
    found = hashlib.sha256()
    for piece in (kind, *pieces):
        content = piece if isinstance(piece, bytes) else str(piece).encode("utf-8", "surrogatepass")
        found.update(struct.pack("<Q", len(content)))
        found.update(content)
    return found.digest()


def _simple(value: Any) -> bytes | None:
    """Return the digest of a value without parts, or None."""
    kind = type(value)
    if kind is float:
        return _digest("float", struct.pack("<d", value))
    if kind is complex:
        return _digest("complex", struct.pack("<dd", value.real, value.imag))
    if kind in (bytes, bytearray):
        return _digest(kind.__name__, bytes(value))
    if kind in (bool, int, str, range) or value is None or value is ... or value is NotImplemented:
        return _digest(kind.__name__, value)
    return None


def _is_set(cell: types.CellType) -> bool:
    """Return whether a variable that a function closes over has a value yet."""
    try:
        cell.cell_contents  # noqa: B018
    except ValueError:
        return False
    return True


def _home(value: Any) -> str | None:
    """Return the name of the module that a function or class is defined in, unaffected by wrapping."""
    scope = getattr(value, "__globals__", None)
    return scope.get("__name__") if isinstance(scope, dict) else getattr(value, "__module__", None)


@functools.cache
def _package(module: str | None) -> tuple[str, str] | None:
    """Return (name, version) of the installed package of a module; None for a module of the user."""
    top = str(module).partition(".")[0]
    if module is None or top in ("__main__", "__mp_main__"):
        return None
    if top in OWN:
        return top, ""
    if top in sys.stdlib_module_names or top in sys.builtin_module_names:
        return "Python", "{}.{}".format(*sys.version_info)
    found = sys.modules.get(top)
    try:
        spec = getattr(found, "__spec__", None) or importlib.util.find_spec(top)
    except (ImportError, ValueError):
        return None
    places = [spec.origin or "", *(spec.submodule_search_locations or ())] if spec else []
    installed = any({"site-packages", "dist-packages"} & {*Path(place).parts} for place in places)
    return (top, _version(top)) if installed else None


def _version(top: str) -> str:
    try:
        return importlib.metadata.version(top)
    except importlib.metadata.PackageNotFoundError:
        distributions = importlib.metadata.packages_distributions().get(top, [])
        return " ".join(importlib.metadata.version(each) for each in distributions)


def _module(name: str) -> types.ModuleType:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ValueError(f"f: imports {name}, which cannot be imported here: {error}; {REMEDY}") from error
