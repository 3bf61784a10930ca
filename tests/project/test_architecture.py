"""Data flows one way: a module imports only from lower layers."""

import ast
import re
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from structure import report

import jaxcontact as jc

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "jaxcontact"

# a folder, or a module of the root, imports from itself and from those before it
LAYERS = [
    "_support",
    "reference",
    "_compile",
    "inputs",
    "response",
    "indenters",
    "operators",
    "contact",
    "history",
    "results",
    "verbs",
    "files",
    "",  # the package itself, with its public names
    "paper",
    "commands",
    "__main__",
]
FITTING_LAYERS = ["views", "data", "io", "models", "search", "inference", "fits", "after", "cli", ""]


def name_of(path: Path, package: Path = PACKAGE) -> str:
    return ".".join(path.relative_to(package).with_suffix("").parts).removesuffix(".__init__")


def imports(path: Path, package: str) -> list[str]:
    """Full names of what a file imports from ``package``, function bodies included."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
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


def test_one_module_knows_the_verbs_and_one_declares_fields():
    found = report(ROOT, "jaxcontact")
    assert found["know a verb"] == ["jaxcontact.files.case_schema"]
    assert found["declare a field"] == ["jaxcontact._support.fields"]


def test_the_oracles_share_no_code_with_the_package():
    for path in (PACKAGE / "reference").glob("*.py"):
        assert all(name.startswith("jaxcontact.reference") for name in imports(path, "jaxcontact")), path


def test_contact_and_march_see_operators_and_memories_by_their_protocols_alone():
    """No spectrum, no kernel, no response: what they import is closed under these few modules."""
    own = {"_support.pytree", "_support.reductions", "_support.status", "operators.base", "history.memory"}
    own |= {"history.march", "history.pressing", "history.adhering"}
    steppers = [
        PACKAGE / "history" / f"{name}.py" for name in ("march", "pressing", "shear_march", "adhering")
    ]
    for path in [*(PACKAGE / "contact").glob("*.py"), *steppers]:
        found = {module_of(name) for name in imports(path, "jaxcontact")}
        assert {name for name in found if folder(name) != "contact"} <= own, path
        assert "fft" not in path.read_text() and "spectrum" not in path.read_text(), path


def test_layers_are_counted_in_one_place():
    """What a body is made of is asked of its response; ``layers`` itself checks them."""
    for path in {*SOURCES, *(ROOT / "fitting").rglob("*.py")}:
        if "response" not in path.parts and path.name != "layers.py":
            assert not re.search(r"(?<!inputs)\.layers\b", code_of(path)), path


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
            "picture_style.py",
            "plotting.py",
            "figures.py",
            "rough_figures.py",
            "adhesion_figures.py",
            "contact_section.py",
            "stress_panels.py",
            "study_figures.py",
            "time_series.py",
        )
    } | {PACKAGE / "paper" / "pictures.py"}
    for path in set(SOURCES) - allowed:
        assert not imports(path, "matplotlib"), path


def test_importing_jaxcontact_waits_for_nothing_that_takes_long():
    heavy = ("matplotlib", "scipy.fft", "scipy.ndimage", "scipy.sparse", "scipy.stats", "xarray")
    code = f"import sys, jaxcontact; print([name for name in {heavy} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"


def test_derivative_rules_live_in_one_module():
    words = ("custom_jvp", "custom_vjp", "custom_linear_solve", "custom_root")
    for path in SOURCES:
        used = any(f"jax.{word}" in path.read_text() or f"lax.{word}" in path.read_text() for word in words)
        assert not used or path.name == "implicit.py", path


def test_fitting_uses_public_names_and_what_both_stand_on():
    common = (
        "jaxcontact._support.exponential.",
        "jaxcontact.inputs.spectrum",
        "jaxcontact._compile.kept_traces",
        "jaxcontact._support.npz",
        "jaxcontact._support.prefixes.",
        "jaxcontact._support.status.PRECEDENCE",
        "jaxcontact._support.usage.",
    )
    for path in (ROOT / "fitting").rglob("*.py"):
        own = [name for name in imports(path, "jaxcontact") if not name.startswith(common)]
        assert all(name.count(".") <= 1 for name in own), path
