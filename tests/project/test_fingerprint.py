"""Functions told apart by content: equal in another process, place and file; another by anything that they compute with."""

import builtins
import importlib
import json
import os
import subprocess
import sys
import types
import zipfile

import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact._support import fingerprint

# what f is, what is put in its place, by what, and the part that a message names
KINDS = {
    "constant": ("def f(case): return {'v': 2.0 * case['x']}", "2.0", "2.1", "f"),
    "text": ("def f(case): return {'v': len('steel')}", "steel", "steal", "f"),
    "operator": ("def f(case): return {'v': 2.0 * case['x']}", "*", "+", "f"),
    "attribute": ("def f(case): return case.mean()", "mean", "sum", "f"),
    "jump": ("def f(case): return 1 if case['x'] else 2", "if case['x']", "if not case['x']", "f"),
    "default": ("def f(case, k=1.0): return k", "k=1.0", "k=2.0", "f"),
    "keyword": ("def f(case, *, k=1.0): return k", "k=1.0", "k=2.0", "f"),
    "name of a keyword in a call": ("def f(case): return dict(a=1, b=2)", "a=1, b=2", "b=1, a=2", "f"),
    "set": ("def f(case): return case['x'] in {'a', 'b', 'c', 'd'}", "'d'}", "'e'}", "f"),
    "set held": ("S = {'a', 'b', 'c', 'd'}\ndef f(case): return S", "'d'}", "'e'}", "S"),
    "global": ("K = 1.0\ndef f(case): return K", "1.0", "1.1", "K"),
    "ninth digit": ("K = 1.00000000001\ndef f(case): return K", "0001", "0002", "K"),
    "sign of zero": ("K = 0.0\ndef f(case): return K", "= 0.0", "= -0.0", "K"),
    "number or truth": ("K = 1\ndef f(case): return K", "= 1", "= True", "K"),
    "helper": ("def g(x): return x + 1\ndef f(case): return g(1)", "x + 1", "x + 2", "g"),
    "helper of a helper": (
        "def h(x): return x + 1\ndef g(x): return h(x)\ndef f(case): return g(1)", "x + 1", "x + 2", "h",
    ),
    "constant of a helper": ("K = 1.0\ndef g(x): return K\ndef f(case): return g(1)", "1.0", "2.0", "K"),
    "recursive helpers": (
        "def g(x): return h(x) if x else 1\ndef h(x): return g(x - 1)\ndef f(case): return g(1)",
        "else 1", "else 2", "g",
    ),
    "nested": ("def f(case):\n    def g(x): return x + 1\n    return g(1)", "x + 1", "x + 2", "f"),
    "lambda": ("g = lambda x: x + 1\ndef f(case): return g(1)", "x + 1", "x + 2", "g"),
    "lambda in a list": ("gs = [lambda x: x + 1]\ndef f(case): return gs[0](1)", "x + 1", "x + 2", "gs"),
    "closure": (
        "def made(k):\n    def f(case): return k\n    return f\nf = made(1.0)", "made(1.0)", "made(2.0)", "k",
    ),
    "closure over a function": (
        "def made(g):\n    def f(case): return g(1)\n    return f\nf = made(lambda x: x + 1)", "x + 1", "x + 2", "g",
    ),
    "small array": ("import numpy as np\nA = np.ones(3)\ndef f(case): return A", "ones(3)", "zeros(3)", "A"),
    "large array": (
        "import numpy as np\nA = np.arange(5000.0)\nA[2500] = 0.0\ndef f(case): return A", "= 0.0", "= 1e-9", "A",
    ),
    "type of an array": (
        "import numpy as np\nA = np.zeros(3, 'f8')\ndef f(case): return A", "f8", "f4", "A",
    ),
    "shape of an array": (
        "import numpy as np\nA = np.zeros((2, 3))\ndef f(case): return A", "(2, 3)", "(3, 2)", "A",
    ),
    "jax array": (
        "import jax.numpy as jnp\nA = jnp.full(2000, 1.0)\ndef f(case): return A", "1.0", "1.0000000001", "A",
    ),
    "random generator": (
        "import numpy as np\nR = np.random.default_rng(1)\ndef f(case): return R", "rng(1)", "rng(2)", "R",
    ),
    "body": (
        "import jaxcontact as jc\nB = jc.LayeredHalfSpace([], jc.Elastic(G=1e9, nu=0.3))\ndef f(case): return B",
        "0.3", "0.31", "B",
    ),
    "control": ("import jaxcontact as jc\nB = jc.Load(1.0)\ndef f(case): return B", "Load", "Approach", "B"),
    "partial": (
        "from functools import partial\ndef g(x, k): return k\nP = partial(g, k=1.0)\ndef f(case): return P(1)",
        "k=1.0", "k=2.0", "P",
    ),
    "function of a partial": (
        "from functools import partial\ndef g(x, k): return k\nP = partial(g, k=1.0)\ndef f(case): return P(1)",
        "return k", "return -k", "g",
    ),
    "object": (
        "class C:\n    def __init__(self, k): self.k = k\nO = C(1.0)\ndef f(case): return O.k", "C(1.0)", "C(2.0)", "O",
    ),
    "method": (
        "class C:\n    def m(self): return 1.0\nO = C()\ndef f(case): return O.m()", "1.0", "2.0", "C.m",
    ),
    "inherited": (
        "class A:\n    def m(self): return 1.0\nclass C(A): pass\ndef f(case): return C().m()", "1.0", "2.0", "A.m",
    ),
    "bound method": (
        "class C:\n    def __init__(self, k): self.k = k\n    def m(self): return self.k\nM = C(1.0).m\n"
        "def f(case): return M()", "C(1.0)", "C(2.0)", "M",
    ),
    "dataclass": (
        "from dataclasses import dataclass, field\n@dataclass\nclass C:\n    k: float = 1.0\n"
        "    l: list = field(default_factory=list)\ndef f(case): return C()", "= 1.0", "= 2.0", "C",
    ),
    "slots": (
        "class C:\n    __slots__ = ('k',)\n    def __init__(self, k): self.k = k\nO = C(1.0)\ndef f(case): return O.k",
        "C(1.0)", "C(2.0)", "O",
    ),
    "enum": (
        "from enum import Enum\nclass C(Enum):\n    A = 1\n    B = 2\ndef f(case): return C.A", "A = 1", "A = 3", "C",
    ),
    "named tuple": (
        "from typing import NamedTuple\nclass C(NamedTuple):\n    a: float\nO = C(1.0)\ndef f(case): return O",
        "C(1.0)", "C(2.0)", "O",
    ),
    "class inside": (
        "def f(case):\n    class C:\n        def m(self): return 1.0\n    return C().m()", "1.0", "2.0", "f",
    ),
    "tables": ("T = {'a': [1, (2, {'b': 3.0})]}\ndef f(case): return T", "3.0", "4.0", "T"),
    "jitted": (
        "import jax\n@jax.jit\ndef g(x): return x + 1\ndef f(case): return g(1)", "x + 1", "x + 2", "g",
    ),
    "vmapped": (
        "import jax\nG = jax.vmap(lambda x: x + 1)\ndef f(case): return G(1)", "x + 1", "x + 2", "fun",
    ),
    "differentiated": (
        "import jax\nG = jax.grad(lambda x: x * x)\ndef f(case): return G(1.0)", "x * x", "x * x * x", "fun",
    ),
    "cached": (
        "from functools import cache\n@cache\ndef g(x): return x + 1\ndef f(case): return g(1)", "x + 1", "x + 2", "g",
    ),
    "decorated": (
        "from functools import wraps\ndef twice(g):\n    @wraps(g)\n    def inner(*a): return 2 * g(*a)\n    return inner\n"
        "@twice\ndef f(case): return 1.0", "1.0", "1.5", "f (2)",
    ),
    "module": ("import other\ndef f(case): return other.helper(1)", "other.helper", "other.changed", "f"),
    "imported inside a long function": (
        "def f(case):\n    " + "\n    ".join(f"case.a{i} = {i}.5" for i in range(300))
        + "\n    from other import helper\n    return helper(1)", "helper", "changed", "f",
    ),
    "imported inside": (
        "def f(case):\n    from other import helper\n    return helper(1)", "helper", "changed", "f",
    ),
}  # fmt: skip
OTHER = "K = 1.0\ndef helper(x): return x + K\ndef changed(x): return x - K\n"


def module_of(source, name="study"):
    made = types.ModuleType(name)
    made.__dict__["__file__"] = f"{name}.py"
    exec(compile(source, f"/somewhere/{name}.py", "exec"), made.__dict__)
    return made


@pytest.fixture
def other(monkeypatch):
    """Another module of the user, which f may import."""
    monkeypatch.setitem(sys.modules, "other", module_of(OTHER, "other"))
    return sys.modules["other"]


def parts(source, name="study"):
    return fingerprint.parts_of(module_of(source, name).f)


@pytest.mark.parametrize("kind", KINDS)
def test_a_function_is_another_by_anything_that_it_computes_with(kind, other):
    source, before, after, told = KINDS[kind]
    assert source.count(before) == 1 or kind == "module" or kind.startswith("imported inside")
    changed = source.replace(before, after)
    assert fingerprint.differing(parts(source), parts(changed)) != []
    assert told in fingerprint.differing(parts(source), parts(changed))


@pytest.mark.parametrize("kind", KINDS)
def test_a_function_is_the_same_elsewhere_in_a_moved_file(kind, other):
    source = KINDS[kind][0]
    moved = "\n\n# a comment\nunused = 1\n" + source.replace("\n", "\n\n")
    assert parts(source) == parts(moved, "moved") == parts(source, "__main__")


TELL = """
import json, sys, types
sys.path.insert(0, "TESTS")
import test_fingerprint as t
sys.modules["other"] = t.module_of(t.OTHER, "other")
print(json.dumps({kind: t.parts(values[0]) for kind, values in t.KINDS.items()}))
"""


@pytest.mark.slow
def test_it_is_the_same_in_processes_that_hash_differently():
    tests = os.path.dirname(__file__)
    told = [
        subprocess.run(
            [sys.executable, "-c", TELL.replace("TESTS", tests)],
            env=os.environ | {"PYTHONHASHSEED": seed}, capture_output=True, text=True, check=True,
        ).stdout
        for seed in ("1", "2")
    ]  # fmt: skip
    assert json.loads(told[0]) == json.loads(told[1]) and len(json.loads(told[0])) == len(KINDS)


@pytest.mark.parametrize("name", ["helper", "K"])
@pytest.mark.parametrize(
    "source",
    [
        "import other\ndef f(case): return other.helper(1)",
        "from other import helper as g\ndef f(case): return g(1)",
        "def f(case):\n    import other\n    return other.helper(1)",
        KINDS["imported inside a long function"][0],
        "def f(case):\n    from other import helper as g\n    return g(1)",
    ],
)
def test_what_another_module_of_the_user_holds_belongs_to_f(source, name, other, monkeypatch):
    before = parts(source)
    text = OTHER.replace("x + K", "x + 2 * K") if name == "helper" else OTHER.replace("1.0", "1.5")
    monkeypatch.setitem(sys.modules, "other", module_of(text, "other"))
    assert fingerprint.differing(before, parts(source)) == [name]


REFUSED = {
    "file": ("H = __import__('sys').__stderr__\ndef f(case): return H", r"TextIOWrapper \(H in f\)"),
    "lock": ("import threading\nL = threading.Lock()\ndef f(case): return L", r"lock \(L in f\)"),
    "generator": ("G = (x for x in ())\ndef f(case): return G", r"generator \(G in f\)"),
    "inside an object": (
        "class C: pass\nO = C()\nO.log = __import__('sys').__stderr__\ndef f(case): return O",
        r"TextIOWrapper \(\.log in O in f\)",
    ),
    "closed over": (
        "def made(h):\n    def f(case): return h\n    return f\nf = made(__import__('sys').__stderr__)",
        r"TextIOWrapper \(h in f\)",
    ),
    "in a default": ("def f(case, log=__import__('sys').__stderr__): pass", r"\(its defaults in f\)"),
    "read from globals": ("K = 1.0\ndef f(case): return globals()['K']", r"a use of globals.*\(globals in f\)"),
    "evaluated": ("K = 1.0\ndef g(x): return eval(x)\ndef f(case): return g('K')", r"a use of eval.*\(eval in g in f\)"),
    "imported by a text": ("def f(case): return __import__('other').helper(1)", r"a use of __import__"),
    "imported by a function": (
        "import importlib\ndef f(case): return importlib.import_module('other')", "a use of importlib",
    ),
    "imported by a name": (
        "from importlib import import_module as load\ndef f(case): return load('other').helper(1)",
        r"a use of importlib.import_module.*\(load in f\)",
    ),
    "imported by what f imports": (
        "def f(case):\n    from importlib import import_module\n    return import_module('other').K", "a use of importlib",
    ),
    "imported by a partial": (
        "import importlib, functools\nP = functools.partial(importlib.import_module, 'other')\ndef f(case): return P().K",
        r"a use of importlib.import_module.*\(P in f\)",
    ),
    "imported by a lambda in a list": (
        "import importlib\nL = [lambda name: importlib.import_module(name)]\ndef f(case): return L[0]('other').K",
        r"a use of importlib.*\(importlib in L in f\)",
    ),
    "taken from the loaded modules": ("import sys\ndef f(case): return sys.modules['other'].K", "a use of sys.modules"),
    "taken from them by a text": (
        "def f(case):\n    import sys as s\n    return getattr(s, 'modules')['other'].K", "a use of sys.modules",
    ),
    "held loaded modules": ("from sys import modules as M\ndef f(case): return M['other'].K", r"got sys.modules \(M in f\)"),
    "globals of another function": (
        "import other\ndef f(case): return other.helper.__globals__['K']", "a use of __globals__",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", REFUSED)
def test_what_has_no_content_to_compare_is_refused_by_its_name(kind, other, tmp_path):
    source, told = REFUSED[kind]
    f = module_of(source).f
    with pytest.raises(ValueError, match=f'{told}.*; pass version="'):
        jc.sweep(f, [], tmp_path)
    assert len(jc.sweep(f, [], tmp_path, version="1")) == 0


# what f is; and what then changes, in words of Python that f does not see: each time another value of f
FOOLS = {
    "constant of a module, by its name in a text": (
        "import other\ndef f(case): return getattr(other, 'K')", "other.K = 9.0",
    ),
    "in the table of a module": ("import other\ndef f(case): return vars(other)['K']", "other.K = 9.0"),
    "in the dictionary of a module": ("import other\ndef f(case): return other.__dict__['K']", "other.K = 9.0"),
    "by the getter of an attribute": (
        "import other, operator\nG = operator.attrgetter('K')\ndef f(case): return G(other)", "other.K = 9.0",
    ),
    "module in a list": ("import other\nM = [other]\ndef f(case): return M[0].helper(1)", "other.K = 9.0"),
    "module in an object": (
        "import other, types\nO = types.SimpleNamespace(m=other)\ndef f(case): return O.m.helper(1)", "other.K = 9.0",
    ),
    "module of a module": ("import package\ndef f(case): return package.inner.value()", "package.inner.K = 9.0"),
    "module that f imports from a package": (
        "def f(case):\n    from package import inner\n    return inner.value()", "import package.inner as i; i.K = 9.0",
    ),
    "module that f imports by its dotted name": (
        "def f(case):\n    import package.inner as i\n    return i.value()", "import package.inner as i; i.K = 9.0",
    ),
    "module that f imports in a helper of another": (
        "import package\ndef f(case): return package.late()", "import package.inner as i; i.K = 9.0",
    ),
    "function of a module, replaced": ("import other\ndef f(case): return other.helper(1)", "other.helper = other.changed"),
    "method, replaced": (
        "class C:\n    def m(self): return 1.0\nO = C()\ndef f(case): return O.m()", "C.m = lambda self: 2.0",
    ),
    "inherited method, replaced": (
        "class A:\n    def m(self): return 1.0\nclass C(A): pass\ndef f(case): return C().m()", "A.m = lambda self: 2.0",
    ),
    "method of one object, replaced": (
        "class C:\n    def m(self): return 1.0\nO = C()\ndef f(case): return O.m()", "O.m = lambda: 2.0",
    ),
    "property, replaced": (
        "class C:\n    k = property(lambda self: 1.0)\nO = C()\ndef f(case): return O.k", "C.k = property(lambda self: 2.0)",
    ),
    "code of a helper, replaced": (
        "def g(): return 1.0\ndef f(case): return g()", "g.__code__ = (lambda: 2.0).__code__",
    ),
    "default of a helper, replaced": ("def g(k=1.0): return k\ndef f(case): return g()", "g.__defaults__ = (2.0,)"),
    "attribute of a helper": ("def g(): return g.k\ng.k = 1.0\ndef f(case): return g()", "g.k = 2.0"),
    "function of numpy, replaced": (
        "import numpy as np\ndef f(case): return float(np.mean([1.0, 3.0]))", "np.mean = lambda values: 9.0",
    ),
    "number of numpy, replaced": ("import numpy as np\ndef f(case): return np.pi", "np.pi = 3.0"),
    "method of this package, replaced": (
        "import jaxcontact as jc\ndef f(case): return float(jc.Elastic(1e9, nu=0.3).creep(0.0))",
        "jc.Elastic.creep = lambda self, t: 9.0",
    ),
    "method of a part of this package that f does not name": (
        "import jaxcontact as jc\ndef f(case): return jc.LayeredHalfSpace([], jc.Elastic(1e9)).substrate.creep(0.0)",
        "import jaxcontact.bodies.materials as m; m.Elastic.creep = lambda self, t: 9.0",
    ),
    "function of this package, replaced by a compiled one": (
        "import jax, jaxcontact as jc\ndef f(case): return jc.sweep(1)",
        "import jaxcontact.simulate.sweep as s; jc.sweep = jax.jit(lambda x: 9.0)",
    ),
    "built-in function, replaced": ("import builtins as b\ndef f(case): return abs(-1.0)", "b.abs = lambda x: 9.0"),
    "partial of a method": (
        "import functools\nclass C:\n    k = 1.0\n    def m(self, x): return self.k * x\nO = C()\n"
        "P = functools.partial(O.m, 2.0)\ndef f(case): return P()", "O.k = 3.0",
    ),
    "partial of a partial": (
        "import functools as t\ndef g(x, y): return x + y\nP = t.partial(t.partial(g, 1.0), y=2.0)\ndef f(case): return P()",
        "P.keywords['y'] = 3.0",
    ),
    "one of two lambdas on a line": ("a, b = lambda: 1.0, lambda: 2.0\ndef f(case): return a()", "a, b = b, a"),
    "lambda in a table": ("T = {'a': lambda: 1.0}\ndef f(case): return T['a']()", "T['a'] = lambda: 2.0"),
    "variable of a closure": (
        "def made():\n    k = 1.0\n    def put(v):\n        nonlocal k\n        k = v\n    return (lambda: k), put\n"
        "g, put = made()\ndef f(case): return g()", "put(2.0)",
    ),
    "attribute of a class": ("class C:\n    k = 1.0\ndef f(case): return C.k", "C.k = 2.0"),
    "attribute of a metaclass": (
        "class M(type):\n    k = 1.0\nclass C(metaclass=M): pass\ndef f(case): return C.k", "M.k = 2.0",
    ),
    "list that grows": ("L = [1.0]\ndef f(case): return sum(L)", "L.append(2.0)"),
    "what a module gives for unknown names": (
        "import other\nother.__getattr__ = lambda name: 1.0\ndef f(case): return other.unknown",
        "other.__getattr__ = lambda name: 2.0",
    ),
    "helper of a notebook, defined anew in a later cell": (
        "def g(x): return x\ndef f(case): return g(1.0)", "def g(x): return 2.0 * x",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", FOOLS)
@pytest.mark.parametrize("name", ["__main__", "study"])
def test_a_function_that_gives_another_value_is_another(kind, name, tmp_path, monkeypatch):
    """The value of f itself, before and after, is the judge; a change back restores the identity."""
    (tmp_path / "other.py").write_text(OTHER)
    (tmp_path / "package").mkdir()
    late = "from . import inner\ndef late():\n    from .inner import value\n    return value()\n"
    (tmp_path / "package" / "__init__.py").write_text(
        late if kind.startswith("module of") else late.partition("\n")[2]
    )
    (tmp_path / "package" / "inner.py").write_text("K = 1.0\ndef value(): return K\n")
    monkeypatch.syspath_prepend(tmp_path)
    for module in ("other", "package", "package.inner"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    for owner, attribute in (
        (np, "mean"),
        (np, "pi"),
        (jc.Elastic, "creep"),
        (jc, "sweep"),
        (builtins, "abs"),
    ):
        monkeypatch.setattr(owner, attribute, getattr(owner, attribute))  # restored at the end
    source, change = FOOLS[kind]
    made = module_of(source, name)
    monkeypatch.setitem(sys.modules, name, made)
    value_of = lambda: None if "sweep" in source and jc.sweep is before[1] else made.f({})
    before = fingerprint.parts_of(made.f), jc.sweep
    first = value_of()
    assert fingerprint.parts_of(made.f) == before[0]
    exec(compile(change, "a later cell", "exec"), made.__dict__)
    assert value_of() != first
    assert fingerprint.differing(before[0], fingerprint.parts_of(made.f)) != []
    for module in ("other", "package", "package.inner"):
        sys.modules.pop(module, None)


def test_a_file_that_has_changed_since_it_was_imported_is_not_what_runs(tmp_path, monkeypatch):
    """Edited on the disk: the same function until it is imported anew, then another; a comment makes none."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    file = tmp_path / "edited.py"
    file.write_text("K = 1.0\ndef helper(): return K\n")
    f = module_of("import edited\ndef f(case): return edited.helper()").f
    before = fingerprint.parts_of(f)
    for text, changes in (
        ("# a comment\n\nK = 1.0\ndef helper(): return K\n", False),
        ("K = 1.5\ndef helper(): return K\n", True),
    ):
        file.write_text(text)
        value = f({})
        assert value == 1.0 and fingerprint.parts_of(f) == before
        importlib.reload(sys.modules["edited"])
        assert (f({}) != value) == (fingerprint.differing(before, fingerprint.parts_of(f)) != []) == changes
    del sys.modules["edited"]


def test_cases_may_be_added_to_the_script_that_has_f():
    """Globals that f does not name are not part of it, nor are the attributes of results that share their names."""
    source = "def f(case): return case.times.load\n"
    assert parts(source) == parts(source + "cases = [1, 2]\ntimes = [3.0]\ndef load(): pass\n")


def test_a_module_that_cannot_be_imported_is_named(tmp_path):
    f = module_of("def f(case):\n    import nowhere_at_all\n    return nowhere_at_all.x").f
    with pytest.raises(
        ValueError, match=r'imports nowhere_at_all, which cannot be imported here.*; pass version="'
    ):
        jc.sweep(f, [], tmp_path)


def test_sources_that_changed_since_this_process_started_are_refused(tmp_path, monkeypatch):
    """Results would be recorded as those of the new sources, which this process does not run."""
    fingerprint.source_digest.cache_clear()
    monkeypatch.setattr(fingerprint, "START_TIME", 0.0)
    with pytest.raises(
        ValueError, match=r"jaxcontact: its sources in .* have changed since this process started"
    ):
        jc.sweep(module_of("def f(case): return {}").f, [], tmp_path)


def test_a_package_without_sources_is_known_by_its_compiled_files_or_its_archive(tmp_path, monkeypatch):
    monkeypatch.setattr(fingerprint, "START_TIME", 1e12)
    monkeypatch.syspath_prepend(tmp_path)
    told = []
    for number, content in enumerate((b"one", b"two", b"one")):
        folder = tmp_path / f"compiled_{number}"
        folder.mkdir()
        (folder / "__init__.pyc").write_bytes(content)
        made = types.ModuleType(folder.name)
        made.__file__ = str(folder / "__init__.pyc")
        monkeypatch.setitem(sys.modules, folder.name, made)
        told.append(fingerprint.source_digest(folder.name))
    assert told[0] == told[2] != told[1]
    for number, text in enumerate(("a = 1", "a = 2")):
        with zipfile.ZipFile(tmp_path / f"{number}.zip", "w") as archive:
            archive.writestr(f"zipped_{number}/__init__.py", text)
        monkeypatch.syspath_prepend(tmp_path / f"{number}.zip")
        importlib.import_module(f"zipped_{number}")
        told.append(fingerprint.source_digest(f"zipped_{number}"))
    assert len(set(told)) == 4


def test_equal_values_are_equal_whichever_way_they_came_about():
    one = fingerprint._Identity()
    assert one.of(np.ones((2, 3))) == one.of(np.asfortranarray(np.ones((2, 3)))) == one.of(np.ones((3, 2)).T)
    assert one.of({3, 1, 2}) == one.of({2, 3, 1}) != one.of(frozenset({1, 2, 3})) != one.of({1, 2})
    assert one.of([1, [2]]) == one.of([1, [2]]) != one.of([[1], 2]) != one.of([1, 2])
    inside = [1]
    inside.append(inside)
    other = [1]
    other.append(other)
    assert one.of(inside) == one.of(other) != one.of([1, [1]])
    assert one.of([inside, inside]) != one.of(inside)
