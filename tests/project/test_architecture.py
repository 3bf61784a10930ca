"""Data flows one way: a module imports only from lower layers."""

import ast
import functools
import re
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import jaxcontact as jc

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "jaxcontact"

# a folder, or a module of the root, imports from itself and from those before it
LAYERS = [
    "_support",
    "reference",
    "_compile",
    "bodies",
    "response",
    "indenters",
    "operators",
    "contact",
    "history",
    "results",
    "simulate",
    "abc",
    "_names",  # the public names
    "",  # the package itself, which takes them from there
    "paper",
    "shell",
    "__main__",
]
FITTING_LAYERS = ["views", "data", "models", "search", "inference", "fits", "after", "cli", ""]


@functools.cache
def tree_of(path: Path) -> ast.Module:
    """A file's syntax tree, which no test changes: each file is read once."""
    return ast.parse(path.read_text())


def name_of(path: Path, package: Path = PACKAGE) -> str:
    return ".".join(path.relative_to(package).with_suffix("").parts).removesuffix(".__init__")


def imports(path: Path, package: str) -> list[str]:
    """Full names of what a file imports from ``package``, function bodies included."""
    found = []
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == package:
            found += [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            found += [alias.name for alias in node.names if alias.name.split(".")[0] == package]
    return found


def module_of(imported: str, package: Path = PACKAGE) -> str:
    """The module of the package that an imported name lives in."""
    parts = imported.split(".")[1:]
    while parts:
        path = package.joinpath(*parts)
        if path.is_dir() or path.with_suffix(".py").exists():
            break
        parts = parts[:-1]
    return ".".join(parts)


SOURCES = sorted(PACKAGE.rglob("*.py"))


def folder(module: str) -> str:
    """The part of a package that a module belongs to: a folder, or a module of the root; "" for the package itself."""
    return module.split(".")[0].removeprefix("__init__")


@functools.cache
def imported_modules(package: Path) -> dict[str, set[str]]:
    """What each module of a package imports from it, in functions too."""
    paths = {name_of(path, package): path for path in package.rglob("*.py")}
    return {
        name: {module_of(full, package) or "__init__" for full in imports(path, package.name)}
        for name, path in paths.items()
    }


@pytest.mark.parametrize("name", ["jaxcontact", "fitting"])
def test_there_is_no_import_circle(name):
    TopologicalSorter(imported_modules(ROOT / name)).prepare()


@pytest.mark.parametrize("name, layers", [("jaxcontact", LAYERS), ("fitting", FITTING_LAYERS)])
def test_folders_import_only_from_those_below(name, layers):
    for module, found in imported_modules(ROOT / name).items():
        for target in found:
            assert layers.index(folder(target)) <= layers.index(folder(module)), f"{module} imports {target}"


VERB = {"slide_steady", "SteadySliding", "steady-sliding"}  # its function, its result and its kind of case
FIELDS = {"approach", "load", "contact_area", "contact_radius", "film_strain", "peak_pressure", "power"}
UNITS = {"m", "N", "m2", "Pa", "m/m", "1", "W"}


def words(tree: ast.Module) -> set[str]:
    """Return the names and the strings in the code of a module, without its docstrings."""
    found = set()
    docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            found.add(node.value)
        named = {ast.Name: "id", ast.Attribute: "attr", ast.alias: "name"}.get(type(node))
        found |= {getattr(node, named)} if named else set()
    return found


def declared(tree: ast.Module) -> set[str]:
    """Return the fields that stand beside a unit, in an item of a dictionary, a tuple or a call."""
    pairs: list[list[ast.AST]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Dict):
            pairs += [[key, value] for key, value in zip(node.keys, node.values, strict=True) if key]
        elif isinstance(node, ast.Tuple):
            pairs.append(list(node.elts))
        elif isinstance(node, ast.Call):
            pairs.append(list(node.args))
    found = set()
    for first, *others in filter(None, pairs):
        is_text = isinstance(first, ast.Constant) and isinstance(first.value, str)
        given = {c.value for one in others for c in ast.walk(one) if isinstance(c, ast.Constant)}
        found |= {first.value.replace(" ", "_")} & FIELDS if is_text and given & UNITS else set()
    return found


def test_one_module_knows_the_verbs_and_one_declares_fields():
    """Steady sliding stands for any verb; the package's list of names and the reproduction of the paper do not count."""
    knowing, declaring = [], []
    for path in SOURCES:
        name, tree = name_of(path), tree_of(path)
        if folder(name) in ("", "_names", "paper"):
            continue
        defined = {node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}
        knowing += [name] if VERB & words(tree) and not VERB & defined else []
        declaring += [name] if len(declared(tree)) >= 3 else []
    assert knowing == ["shell.case_schema"]
    assert declaring == ["_support.fields"]


def test_the_oracles_share_no_code_with_the_package():
    for path in (PACKAGE / "reference").glob("*.py"):
        assert all(name.startswith("jaxcontact.reference") for name in imports(path, "jaxcontact")), path


def test_contact_and_march_see_operators_and_memories_by_their_protocols_alone():
    """No spectrum, no kernel, no response: what they import is closed under these few modules."""
    own = {
        "_support.pytree",
        "_support.reductions",
        "_support.status",
        "operators.operator",
        "history.memory",
    }
    own |= {"history.time_loop", "history.normal_step", "_support.exponential", "operators.coupled"}
    steppers = [PACKAGE / "history" / f"{name}.py" for name in ("time_loop", "normal_step", "friction_step")]
    for path in [*(PACKAGE / "contact").glob("*.py"), *steppers]:
        found = {module_of(name) for name in imports(path, "jaxcontact")}
        assert {name for name in found if folder(name) != "contact"} <= own, path
        assert "fft" not in path.read_text() and "spectrum" not in path.read_text(), path


def test_layers_are_counted_in_one_place():
    """What a body is made of is asked of its response; ``layers`` itself checks them."""
    for path in {*SOURCES, *(ROOT / "fitting").rglob("*.py")}:
        if "response" not in path.parts and path != PACKAGE / "bodies" / "body.py":
            assert not re.search(r"\.layers\b", code_of(path)), path


def test_no_public_function_hides_a_module():
    modules = {name_of(path).split(".")[0] for path in SOURCES}
    assert not modules & set(jc.__all__)


def code_of(path: Path) -> str:
    """A file without its comments and docstrings."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            node.value.value = ""
    return ast.unparse(tree)


def test_only_plotting_imports_matplotlib():
    allowed = {
        PACKAGE / "results" / name
        for name in (
            "plotting.py",
            "figures.py",
        )
    } | {PACKAGE / "paper" / "comparison.py"}
    for path in set(SOURCES) - allowed:
        assert not imports(path, "matplotlib"), path


def test_importing_jaxcontact_waits_for_nothing_that_takes_long():
    heavy = (
        "matplotlib",
        "scipy.fft",
        "scipy.ndimage",
        "scipy.optimize",
        "scipy.sparse",
        "scipy.stats",
        "xarray",
    )
    code = (
        f"import sys, jaxcontact; jaxcontact.indent; print([name for name in {heavy} if name in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"


def test_derivative_rules_of_the_contact_live_in_one_module():
    """Those of ``transformed.py`` are of any program, for the compiler."""
    words = ("custom_jvp", "custom_vjp", "custom_linear_solve", "custom_root")
    for path in SOURCES:
        used = any(f"jax.{word}" in path.read_text() or f"lax.{word}" in path.read_text() for word in words)
        assert not used or path.name in ("implicit.py", "transformed.py"), path


def test_fitting_uses_public_names_and_what_both_stand_on():
    common = (
        "jaxcontact._support.exponential.",
        "jaxcontact.bodies.materials",
        "jaxcontact._compile.programs",
        "jaxcontact._support.files",
        "jaxcontact._support.plugins",
        "jaxcontact._support.prefixes.",
        "jaxcontact._support.pytree.as_float64",
        "jaxcontact._support.pytree.require_real",
        "jaxcontact._support.status.",
        "jaxcontact._support.terminal.",
    )
    for path in (ROOT / "fitting").rglob("*.py"):
        own = [name for name in imports(path, "jaxcontact") if not name.startswith(common)]
        assert all(name.count(".") <= 1 for name in own), path


@pytest.mark.parametrize("name", ["jaxcontact", "fitting"])
def test_comparisons_state_their_absolute_tolerance(name):
    """That of numpy and jax is 1e-8 in whatever unit: ten nanometres for a length."""
    for path in (ROOT / name).rglob("*.py"):
        for node in ast.walk(tree_of(path)):
            called = getattr(node, "func", None)
            word = getattr(called, "attr", getattr(called, "id", ""))
            if (
                word in ("isclose", "allclose", "assert_allclose")
                and getattr(getattr(called, "value", None), "id", "") != "math"
            ):
                assert any(key.arg == "atol" for key in node.keywords), f"{path}:{node.lineno}"
