"""Data flows one way: a module imports only from lower layers."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "jaxcontact"

LAYERS = {
    "_pytree": 0,
    "_checks": 1,
    "reference": 0,
    "grid": 2,
    "controls": 2,
    "spectral": 2,
    "contact.window": 1,
    "materials": 2,
    "layers": 3,
    "frf.normal": 4,
    "frf.separable": 5,
    "geometry": 5,
    "influence": 6,
    "kernels": 7,
    "contact.normal": 3,
    "contact.nonsymmetric": 4,
    "contact.implicit": 5,
    "history.recursive": 8,
    "history.superposition": 9,
    "history.march": 10,
    "sliding.observables": 3,
    "sliding.transport": 9,
    "sliding.track": 10,
    "sliding.results": 4,
    "sliding.steady": 10,
    "slide": 12,
    "steady_sliding": 12,
    "results": 3,
    "plotting": 5,
    "sensitivity": 6,
    "indentation": 11,
    "_version": 0,
    "citation": 1,
    "storage": 5,
    "case_schema": 6,
    "case_file": 12,
    "case_text": 13,
    "case_advice": 13,
    "simulation": 13,
    "saving": 14,
}
FITTING_LAYERS = {
    "_exponential": 0,
    "units": 0,
    "weights": 0,
    "evidence": 0,
    "uncertainty": 0,
    "report": 0,
    "structure": 0,
    "data": 1,
    "history": 1,
    "coordinates": 1,
    "nonlinear": 1,
    "readers": 2,
    "varpro": 2,
    "result": 2,
    "halfspace": 3,
    "creep_search": 3,
    "press": 3,
    "half_space_search": 4,
    "layered": 4,
    "creep": 4,
    "batch": 4,
    "planning": 4,
    "propagation": 4,
    "layered_search": 5,
    "prony": 5,
    "indentation": 6,
    "command": 7,
    "__init__": 8,
}
TOP = 20  # the package itself; above it saving, cases and the command line


def name_of(path: Path, package: Path = PACKAGE) -> str:
    return ".".join(path.relative_to(package).with_suffix("").parts).removesuffix(".__init__")


def layer(module: str) -> int:
    if module.split(".")[0] in ("reference", "cases"):
        return 0 if module.startswith("reference") else TOP + 1
    if module.split(".")[0] in ("__main__", "commands"):
        return TOP + 3 + (module == "__main__")
    return LAYERS.get(module, TOP)


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


def test_every_module_has_a_layer():
    for path in SOURCES:
        module = name_of(path)
        known = module in LAYERS or module.split(".")[0] in (
            "reference",
            "cases",
            "commands",
            "__main__",
            "__init__",
        )
        is_package_docstring = path.name == "__init__.py"
        assert known or is_package_docstring, module


def test_modules_import_only_from_lower_layers():
    for path in SOURCES:
        module = name_of(path)
        if module in ("__init__",) or path.name == "__init__.py":
            continue
        for imported in imports(path, "jaxcontact"):
            target = module_of(imported)
            within_cases = any(
                module.startswith(part) and target.startswith(part) for part in ("cases", "commands")
            )
            lazy_plot = module == "results" and target in ("plotting", "")
            if not (within_cases or lazy_plot):
                assert layer(target) < layer(module), f"{module} imports {target}"


def imported_modules(package: Path) -> dict[str, set[str]]:
    """What each module of a package imports from it, in functions too."""
    paths = {name_of(path, package): path for path in package.rglob("*.py")}
    return {
        name: {module_of(full, package) or "__init__" for full in imports(path, package.name)}
        for name, path in paths.items()
    }


@pytest.mark.parametrize("name", ["jaxcontact", "fitting"])
def test_there_is_no_import_circle(name):
    graph = imported_modules(ROOT / name)
    graph.get("results", set()).discard("plotting")  # imports matplotlib, so a function of results does it
    TopologicalSorter(graph).prepare()


def test_fitting_imports_only_from_lower_layers():
    for module, found in imported_modules(ROOT / "fitting").items():
        for target in found:
            assert FITTING_LAYERS[target] < FITTING_LAYERS[module], f"{module} imports {target}"


def classes(folder: Path) -> list[str]:
    trees = [ast.parse(path.read_text()) for path in folder.rglob("*.py")]
    return [node.name for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]


def test_no_class_of_fitting_has_the_name_of_another():
    own, others = classes(ROOT / "fitting"), classes(PACKAGE)
    assert len(set(own)) == len(own) and not set(own) & set(others)


def test_the_oracles_share_no_code_with_the_package():
    for path in (PACKAGE / "reference").glob("*.py"):
        assert all(name.startswith("jaxcontact.reference") for name in imports(path, "jaxcontact")), path


def test_contact_knows_nothing_of_response_functions():
    for path in (PACKAGE / "contact").glob("*.py"):
        assert not any(word in path.read_text() for word in ("jaxcontact.frf", "jaxcontact.materials")), path


def test_only_plotting_imports_matplotlib():
    allowed = {PACKAGE / "plotting.py", PACKAGE / "cases" / "pictures.py"}
    for path in set(SOURCES) - allowed:
        assert not imports(path, "matplotlib"), path


def test_derivative_rules_live_in_one_module():
    words = ("custom_jvp", "custom_vjp", "custom_linear_solve", "custom_root")
    for path in SOURCES:
        used = any(f"jax.{word}" in path.read_text() or f"lax.{word}" in path.read_text() for word in words)
        assert not used or path.name == "implicit.py", path


def test_fitting_uses_only_public_names():
    for path in (ROOT / "fitting").glob("*.py"):
        assert all(name.count(".") <= 1 for name in imports(path, "jaxcontact")), path


def test_functions_are_short():
    for path in [*SOURCES, *(ROOT / "fitting").rglob("*.py")]:
        most = 40 if path.parent.name == "fitting" else 100
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef):
                doc = ast.get_docstring(node) or ""
                length = node.end_lineno - node.lineno - doc.count("\n")
                assert length <= most, f"{path.name}: {node.name} has {length} lines"
