"""The identity of a function by its content, so that stored results are never taken for those of another function.

The identity is a table of parts, {name: digest}, one for each function, class, module and named value that the function
reaches, so that a message can name what differs:

- a function: its compiled code, defaults and attributes, the values that it closes over and those of the globals it names;
- a class: everything in it and its bases; an object: its class and the state that pickle would store; arrays by their bytes;
- a module of the user, also one imported when the function is called: all its members, since code may reach any of them;
- an installed package: its version, and functions and methods in it that the user has replaced; jaxcontact and fitting by
  a digest of their sources.

The code is the code that runs, not that of a file, which may have changed after it was imported; comments, line numbers
and names of files are not part of it. What cannot be compared, or may read anything by its name in a text (``importlib``,
``eval``), is refused. Files and environment variables that the function reads are not part of the identity.
"""

import builtins
import copyreg
import dis
import enum
import functools
import hashlib
import importlib
import importlib.metadata
import importlib.util
import pickle
import sys
import time
import types
from pathlib import Path
from typing import Any, NoReturn

import jax
import numpy as np

OWN = ("jaxcontact", "fitting")
REMEDY = 'pass version="...", a text that identifies the version of f'
# what these, or a function of these modules, read is not known beforehand
BY_TEXT = (
    eval,
    exec,
    globals,
    __import__,
)
BY_TEXT_MODULES = ("importlib", "runpy", "pkgutil", "pydoc")
BY_TEXT_ATTRIBUTES = {"__globals__", "__builtins__", "f_globals", "f_builtins"}
DERIVED = {  # attributes of classes and modules that Python derives, or that say where they are defined
    "__module__", "__qualname__", "__dict__", "__weakref__", "__doc__", "__firstlineno__", "__static_attributes__",
    "__annotations__", "__annotate__", "__annotate_func__", "__annotations_cache__", "__conditional_annotations__",
    "__dataclass_fields__", "__dataclass_params__", "__abstractmethods__", "_abc_impl", "__parameters__", "__orig_bases__",
    "__name__", "__builtins__", "__cached__", "__file__", "__loader__", "__package__", "__path__", "__spec__",
    "__warningregistry__",
}  # fmt: skip
PLAIN = (bool, int, float, complex, str, bytes, bytearray, range, type(None), type(...), type(NotImplemented))
METHODS = (types.FunctionType, staticmethod, classmethod, property)
WRAPPERS = (type(functools.lru_cache(len)), type(jax.jit(len)))  # identified by the function that they wrap
DESCRIPTORS = (
    types.MethodDescriptorType, types.WrapperDescriptorType, types.ClassMethodDescriptorType, types.MethodWrapperType,
    types.GetSetDescriptorType, types.MemberDescriptorType,
)  # fmt: skip


def parts_of(f: types.FunctionType) -> dict[str, str]:
    """Return the identity of a function, {name of a part: digest}; the first part is ``f``, its own code.

    Raises:
        ValueError: f reaches a value whose content cannot be compared, such as an open file; the message names it.
    """
    while True:
        loaded, identity = len(sys.modules), _Identity()
        identity.of(f, "f")
        # otherwise f imports modules when it is called, which are now members of others
        if len(sys.modules) == loaded:
            return identity.parts


def packages_of(*names: str) -> dict[str, str]:
    """Return the parts of an identity that stand for packages of this project, by the digests of their sources."""
    return {f"the sources of {name}": source_digest(name) for name in names}


def differing(one: dict[str, str], other: dict[str, str]) -> list[str]:
    """Return the names of the parts in which two identities differ: only common ones if any differ, since others follow."""
    common = [name for name in one if name in other and one[name] != other[name]]
    return common or [name for name in {**one, **other} if (name in one) != (name in other)]


class _Identity:
    """A traversal of everything that a value consists of; it collects ``parts``."""

    def __init__(self) -> None:
        self.parts: dict[str, str] = {}
        # of functions, classes, modules, with them, so that ids last
        self.labels: dict[int, tuple[str, Any]] = {}
        self.packages: set[str] = set()  # those already searched for replaced functions
        self.open: list[int] = []  # the containers around the current value
        self.place: list[str] = []  # the names around the current value, for messages

    def of(self, value: Any, name: str = "") -> str:
        """Return the digest of a value, or its label if it is a part of its own; name: of the variable that holds it."""
        if name:
            self.place.append(name)
        if id(value) in self.labels:
            found = self.labels[id(value)][0]
        elif (known := self._installed(value)) is not None:
            found = known
        elif isinstance(value, types.FunctionType | type | types.ModuleType):
            full = value.__name__ if isinstance(value, types.ModuleType) else value.__qualname__
            own = full.rpartition("<locals>.")[2]
            found = self._label(self.place[-1] if len(self.place) == 1 or "<" in own else own, "")
            self.labels[id(value)] = found, value  # before its content, which may lead back to it
            if isinstance(value, types.FunctionType):
                self.parts[found] = self._function(value)
            else:
                self.parts[found] = self._class(value) if isinstance(value, type) else self._module(value)
        else:
            found = self._value(value)
            if name and not name.startswith("."):
                found = self._label(name, found)
        if name:
            self.place.pop()
        return found

    def _label(self, name: str, content: str) -> str:
        """Record a part under its name, with a number behind it where a part of other content has that name."""
        label, count = name, 1
        while label in self.parts and (not content or self.parts[label] != content):
            count += 1
            label = f"{name} ({count})"
        self.parts[label] = content
        return label

    def _value(self, value: Any) -> str:
        """Return the digest of a value that is no function, class or module."""
        kind, of = type(value), self.of
        if kind in PLAIN:
            return _digest(kind.__name__, hex(value) if kind is int else repr(value))
        if id(value) in self.open:  # a container inside itself
            return _digest("again", len(self.open) - self.open.index(id(value)))
        if value is sys.modules or isinstance(value, jax.core.Tracer):
            self._refuse("sys.modules" if value is sys.modules else "a value that jax is tracing")
        self.open.append(id(value))
        if isinstance(value, jax.Array):
            is_key = jax.dtypes.issubdtype(value.dtype, jax.dtypes.prng_key)
            held = np.asarray(jax.random.key_data(value) if is_key else value)
            found = _digest("jax", value.dtype, getattr(value, "weak_type", False), of(held))
        elif kind is np.ndarray or isinstance(value, np.generic):
            content = of(value.tolist()) if value.dtype.hasobject else np.ascontiguousarray(value).tobytes()
            found = _digest(kind.__name__, value.dtype.descr, value.dtype.name, value.shape, content)
        elif kind in (list, tuple):
            found = _digest(kind.__name__, *map(of, value))
        elif kind in (dict, types.MappingProxyType):
            found = _digest("dict", *(of(each) for item in value.items() for each in item))
        elif kind in (set, frozenset):
            found = _digest(kind.__name__, *sorted(map(of, value)))
        elif kind is types.CodeType:
            counts = (value.co_argcount, value.co_posonlyargcount, value.co_kwonlyargcount, value.co_flags)
            names = (value.co_names, value.co_varnames, value.co_freevars, value.co_cellvars)
            found = _digest(
                "code", counts, names, value.co_code, value.co_exceptiontable, of(value.co_consts)
            )
        elif kind is types.MethodType:
            found = _digest("method", of(value.__func__), of(value.__self__))
        elif kind in (staticmethod, classmethod):
            found = _digest(kind.__name__, of(value.__func__))
        elif kind is property:
            found = _digest("property", of(value.fget), of(value.fset), of(value.fdel))
        elif kind is types.BuiltinFunctionType:
            found = _digest("bound", value.__name__, of(value.__self__))
        elif isinstance(value, enum.Enum):
            found = _digest("enum", of(kind), value.name)
        elif kind in DESCRIPTORS:
            found = _digest("descriptor", value.__name__, of(value.__objclass__))
        elif kind in WRAPPERS:
            found = _digest("wrapped", of(value.__wrapped__))
        else:
            found = self._object(value)
        self.open.pop()
        return found

    def _object(self, value: Any) -> str:
        """Return the digest of any other object, from its class and the state that pickle would store."""
        kind = type(value)
        reduce = copyreg.dispatch_table.get(kind)
        try:
            reduced = reduce(value) if reduce else value.__reduce_ex__(4)
        # TypeError for a file, a lock or a generator; pickle's other errors have no common class
        except Exception:
            self._refuse(f"a {kind.__module__}.{kind.__qualname__}")
        if isinstance(reduced, str):  # the name of a global variable of a package
            module = pickle.whichmodule(value, reduced)  # type: ignore[attr-defined]
            return self._reference(module, reduced) or self._refuse(f"{reduced}, known by its name")
        make, arguments, state, *contents = (*reduced, *(None,) * 5)[:5]
        listed = [None if each is None else list(each) for each in contents]
        return _digest(
            "object", self.of(kind), self.of(make), self.of(arguments), self.of(listed), self._state(state)
        )

    def _state(self, state: Any) -> str:
        """Return the digest of attributes, independent of the order in which they were set."""
        # of a class with slots
        if isinstance(state, tuple) and len(state) == 2 and isinstance(state[1], dict):
            return _digest("slots", self._state(state[0]), self._state(state[1]))
        if not isinstance(state, dict):
            return self.of(state)
        return _digest(
            "state", *(x for name in sorted(state, key=str) for x in (name, self.of(state[name], f".{name}")))
        )

    def _function(self, f: types.FunctionType) -> str:
        pieces = [self.of(f.__code__)]
        self.place.append("its defaults")
        pieces.append(self.of((f.__defaults__, f.__kwdefaults__)))
        self.place.pop()
        for name, cell in zip(f.__code__.co_freevars, f.__closure__ or (), strict=True):
            try:
                content = cell.cell_contents
            except ValueError:  # a variable without a value yet
                continue
            pieces.append(self.of(content, name))
        # the globals of an installed function belong to its package
        if _package(f.__globals__.get("__name__")):
            return _digest("function", *pieces)
        pieces.append(self._state(vars(f)))
        variables, attributes, modules = _reads(f.__code__, f.__globals__.get("__package__"))
        for name in sorted(variables - {"__name__"}):  # which every class body reads
            value = f.__globals__.get(name, getattr(builtins, name, "missing"))
            pieces.append(self.of(value, name))
            modules |= {"sys"} if value is sys else set()
            # its numbers, which may be replaced too
            if isinstance(value, types.ModuleType) and _package(value.__name__):
                own = {each: vars(value)[each] for each in attributes & vars(value).keys()}
                pieces.append(self._state({each: own[each] for each in own if type(own[each]) in PLAIN}))
        for name in sorted(modules):
            if "sys" in modules and "modules" in attributes:
                self._refuse("a use of sys.modules, which may read anything")
            if reference := self._reference(name, name):
                pieces.append(reference)
                continue
            try:
                module = importlib.import_module(name)
                inside = (
                    {f"{name}.{each}" for each in attributes if each.isidentifier()}
                    if hasattr(module, "__path__")
                    else set()
                )
                more = [
                    importlib.import_module(each) for each in sorted(inside) if importlib.util.find_spec(each)
                ]
            except ImportError as error:
                raise ValueError(
                    f"f: imports {name}, which cannot be imported here: {error}; {REMEDY}"
                ) from error
            pieces += [self.of(each) for each in (module, *more)]
        if found := BY_TEXT_ATTRIBUTES & attributes:
            self._refuse(f"a use of {min(found)}, which may read anything")
        return _digest("function", *pieces)

    def _module(self, module: types.ModuleType) -> str:
        members = sorted(vars(module).keys() - DERIVED)
        return _digest("module", *(x for name in members for x in (name, self.of(vars(module)[name], name))))

    def _class(self, cls: type) -> str:
        made = {name: value for name, value in vars(cls).items() if name not in DERIVED}
        if issubclass(cls, enum.Enum):  # its members and its methods
            made = {name: value for name, value in made.items() if isinstance(value, METHODS)}
            made |= {"members": [(each.name, each.value) for each in cls]}
        fields = getattr(cls, "__dataclass_fields__", {}).values()
        about = [(each.name, each.init, each.kw_only is True, dict(each.metadata)) for each in fields]
        bases = [base for base in cls.__bases__ if base is not object]
        return _digest("class", self.of(type(cls)), self.of(bases), self.of(about), self._state(made))

    def _installed(self, value: Any) -> str | None:
        """Return a reference to what an installed package defines under a name; None for everything else."""
        if isinstance(value, types.ModuleType):
            return self._reference(value.__name__, value.__name__)
        if not callable(value):
            return None
        if any(value is each for each in BY_TEXT):
            self._refuse(f"a use of {value.__name__}, which may read anything")
        scope = getattr(value, "__globals__", None)  # unlike __module__, not that of a function that it wraps
        module = scope.get("__name__") if isinstance(scope, dict) else getattr(value, "__module__", None)
        name = getattr(value, "__qualname__", getattr(value, "__name__", None))
        if isinstance(value, np.ufunc) and not isinstance(module, str):
            module = pickle.whichmodule(value, value.__name__)  # type: ignore[attr-defined]
        if not isinstance(module, str) or not isinstance(name, str):
            return None
        found: Any = sys.modules.get(module)
        for each in name.split("."):
            found = getattr(found, each, None)
        return self._reference(module, f"{module}.{name}") if found is value else None

    def _reference(self, module: str, name: str) -> str | None:
        """Return the digest of a name in an installed package, which becomes a part; None for a module of the user."""
        package = _package(module)
        if package is None:
            return None
        top = module.partition(".")[0]
        if top in BY_TEXT_MODULES:
            self._refuse(f"a use of {name}, which may read anything")
        self.parts |= packages_of(top) if top in OWN else {f"the version of {package[0]}": package[1]}
        if top not in self.packages:
            self.packages.add(top)
            self._replaced(top)
        return _digest("name", name)

    def _replaced(self, top: str) -> None:
        """Record the functions and methods of a package that are defined in a module of the user."""
        modules = {name: module for name, module in sys.modules.items() if name.partition(".")[0] == top}
        for name, module in sorted(modules.items()):
            classes = [
                each for each in vars(module).values() if isinstance(each, type) and each.__module__ == name
            ]
            owners: list[Any] = [module, *classes]
            for owner in owners:
                for member, value in list(vars(owner).items()):
                    inner: Any = value.fget if isinstance(value, property) else value
                    inner = (
                        inner.__wrapped__ if type(inner) in (*WRAPPERS, staticmethod, classmethod) else inner
                    )
                    scope = inner.__globals__ if isinstance(inner, types.FunctionType) else None
                    home = scope.get("__name__") if isinstance(scope, dict) else None
                    of_the_user = (
                        home in sys.modules and vars(sys.modules[home]) is scope and not _package(home)
                    )
                    if of_the_user:
                        self.of(value, f"{owner.__name__}.{member}")

    def _refuse(self, found: str) -> NoReturn:
        where = " in ".join(dict.fromkeys(reversed(self.place)))
        raise ValueError(
            f"f: expected values that can be compared by content, got {found} ({where}); {REMEDY}"
        )


def _digest(*pieces: Any) -> str:
    found = hashlib.sha256()
    for piece in pieces:
        content = piece if isinstance(piece, bytes) else str(piece).encode("utf-8", "surrogatepass")
        found.update(f"{len(content)}:".encode() + content)
    return found.hexdigest()


def _reads(code: types.CodeType, package: str | None) -> tuple[set[str], set[str], set[str]]:
    """Return the names of the global variables, attributes and modules that code, and functions defined in it, read."""
    variables, attributes, modules = set[str](), set[str](), set[str]()
    listed = [each for each in dis.get_instructions(code) if each.opname != "EXTENDED_ARG"]
    for index, each in enumerate(listed):
        # after its level, the number of dots before the name, and its list of names
        if each.opname == "IMPORT_NAME":
            modules.add(importlib.util.resolve_name("." * listed[index - 2].argval + each.argval, package))
        elif each.opcode in dis.hasname:
            is_attribute = each.opname.endswith(("_ATTR", "_METHOD", "IMPORT_FROM"))
            (attributes if is_attribute else variables).add(each.argval)
    attributes |= {each for each in code.co_consts if isinstance(each, str)}  # as getattr takes them
    for nested in [each for each in code.co_consts if isinstance(each, types.CodeType)]:
        for found, more in zip((variables, attributes, modules), _reads(nested, package), strict=True):
            found |= more
    return variables, attributes, modules


def _package(module: str | None) -> tuple[str, str] | None:
    """Return (name, version) of the installed package of a module; None for a module of the user."""
    return None if module is None else _top_package(module.partition(".")[0])


@functools.cache
def _top_package(top: str) -> tuple[str, str] | None:
    if top in ("__main__", "__mp_main__"):
        return None
    if top in OWN:
        return top, ""
    if top in sys.stdlib_module_names or top in sys.builtin_module_names:
        return "Python", "{}.{}".format(*sys.version_info)
    try:
        spec = getattr(sys.modules.get(top), "__spec__", None) or importlib.util.find_spec(top)
    except (ImportError, ValueError):
        return None
    places = [spec.origin or "", *(spec.submodule_search_locations or ())] if spec else []
    if not any({"site-packages", "dist-packages"} & {*Path(place).parts} for place in places):
        return None
    try:
        return top, importlib.metadata.version(top)
    # a distribution of another name; looking for it takes a second
    except importlib.metadata.PackageNotFoundError:
        names = importlib.metadata.packages_distributions().get(top, [])
        return top, " ".join(importlib.metadata.version(each) for each in names)


# A digest of the sources of a package, which distinguishes two states of it with the same version.


START_TIME = time.time()
COMPILED = (".pyc", ".so", ".pyd")  # the files of an installation without sources


@functools.cache
def source_digest(package: str) -> str:
    """Return a digest of the program code of a package, as this process runs it.

    It is computed from the sources; from the compiled files if there are none; from the archive for a package inside one.

    Raises:
        ValueError: the sources have changed since this process started, so that the code it runs is not that on disk.
    """
    module = sys.modules.get(package)
    file = module.__file__ if module else importlib.util.find_spec(package).origin  # type: ignore[union-attr]
    folder = Path(str(file)).parent

    # its files in a fixed order; a package in an archive has none
    files = sorted(folder.rglob("*.py")) or sorted(
        path for ending in COMPILED for path in folder.rglob(f"*{ending}") if "__pycache__" not in path.parts
    )
    if not files:
        archive = next(parent for parent in folder.parents if parent.is_file())
        return hashlib.sha256(archive.read_bytes()).hexdigest()

    # the last change, of the inode too, since copying tools can reset the time of the last modification
    stats = [path.stat() for path in files]
    if max(max(stat.st_mtime, stat.st_ctime) for stat in stats) > START_TIME:
        raise ValueError(
            f"{package}: its sources in {folder} have changed since this process started;"
            " restart Python, so that the running code is the same as the sources"
        )

    # their names within the package and their contents
    found = hashlib.sha256()
    for path in files:
        content = path.read_bytes()
        found.update(f"{path.relative_to(folder).as_posix()}\0{len(content)}\0".encode() + content)
    return found.hexdigest()
