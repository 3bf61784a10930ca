"""Data flows one way: a module imports only from lower layers."""

import ast
import re
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import jaxcontact as jc

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "jaxcontact"

LAYERS = {
    "_pytree": 0,
    "_exponential": 0,
    "_version": 0,
    "_sources": 0,
    "fingerprint": 1,
    "_installed_jax": 0,
    "_checks": 1,
    "_progress": 0,
    "_recorded_warnings": 0,
    "_status": 1,
    "_scale": 1,
    "citation": 1,
    "compilation_cache": 1,
    "kept_traces": 1,
    "studies": 3,
    "reference": 0,
    "reference.layered_solid": -1,
    # what a user makes
    "grid": 2,
    "controls": 2,
    "heat": 3,
    "roughness": 3,
    "topography": 4,
    "surface_files": 3,
    "spectrum": 1,
    "materials": 2,
    "fractional": 3,
    "layers": 3,
    # wavenumber and time
    "response.linear_fit": 0,
    "response.gaussians": 0,
    "response.images": 1,
    "response.coefficients": 3,
    "response.line_coefficients": 3,
    "response.strip_coefficients": 4,
    "response.periodic": 3,
    "response.base": 4,
    "response.half_space": 5,
    "response.separable": 6,
    "response.one_layer": 7,
    "response.volume": 3,
    "response.layer": 0,
    "response.stack": 4,
    "response.band": 5,
    "response.rational": 7,
    "response.wavevector": 5,
    "response.tangential_coefficients": 3,
    "response.tangential_lines": 4,
    "response.tangential_images": 5,
    "response.tangential_time": 8,
    "response.interior": 5,
    "response.interior_time": 8,
    "response.interior_coefficients": 9,
    "response.ladder": 6,
    "response.layered": 8,
    "response.body": 9,
    "indenters": 10,
    "predicted_contact": 9.5,
    # traction -> displacement on a grid
    "operators.spectral": 0,
    "operators.base": 0,
    "operators.convolution": 1,
    "operators.moving": 2,
    "operators.kernels": 11,
    "operators.coupled": 4,
    "operators.traction_kernels": 12,
    "operators.rubbing": 13,
    # what is solved at an instant
    "contact.window": 1,
    "contact.linear": 1,
    "contact.edge": 1,
    "contact.law": 1,
    "contact.normal": 2,
    "contact.nonsymmetric": 3,
    "contact.implicit": 5,
    "contact.friction": 2,
    "contact.partial_slip": 4,
    # what the body remembers, and the march
    "history.memory": 1,
    "history.march": 6,
    "history.recursive": 12,
    "history.growing": 12,
    "history.superposition": 12,
    "sliding.observables": 2,
    "history.moving": 14,
    # the verbs
    "labels": 2,
    "notes": 2,
    "summaries": 3,
    "rough_contact": 4,
    "results": 4,
    "_experiment": 13,
    "indentation": 14,
    "sliding.results": 5,
    "sliding.track": 15,
    "sliding.wake": 15,
    "sliding.rubbed_wake": 16,
    "sliding.transient": 17,
    "sliding.steady": 17,
    "slipping.results": 5,
    "slipping.memory": 13,
    "slipping.march": 14,
    "slipping.shearing": 15,
    "slipping.rolled": 16,
    "slipping.rolling_contact": 17,
    "slipping.rolling": 18,
    "interior_fields": 10,
    # round about
    "picture_style": 0,
    "plotting": 6,
    "sensitivities": 7,
    "rough_figures": 10,
    "figures": 11,
    "simulation": 15,
    "files.npz": 0,
    "files.chosen_times": 3,
    "files.quantities": 0,
    "files.run_directory": 0,
    "files.paraview": 3,
    "files.storage": 11,
    "files.case_schema": 19,
    "files.case_file": 20,
    "files.case_text": 21,
    "files.template": 22,
    "footprint": 21,
    "files.advice": 22,
    "files.finished_steps": 21,
    "files.run_figures": 4,
    "files.captions": 21,
    "files.run_results": 22,
    "files.study_file": 22,
    "fitting": 23,  # another name of the package above this one
}
FITTING_LAYERS = {
    "units": 0,
    "clock": 0,
    "weights": 0,
    "correlation": -3,
    "noise": -2,
    "verdict": -1,
    "evidence": 0,
    "padding": 0,
    "uncertainty": -4,
    "report": 0,
    "axis_units": -1,
    "student": -3,
    "search_coordinates": 0,
    "minimising": 2,
    "in_words": -3,
    "fit_picture": 1,
    "structure": 0,
    "segments": -1,
    "curve_picture": 0,
    "contact": 0,
    "adhesion": 1,
    "data": 1,
    "history": 1,
    "search_space": 0.5,
    "coordinates": 1,
    "nonlinear": 1,
    "profiles": 2,
    "resampling": 2,
    "varpro": 2,
    "result": 2,
    "halfspace": 3,
    "creep_search": 3,
    "probe": 0,
    "press": 3,
    "modulus_data": 2,
    "conclusion": 3,
    "creep_solution": 5,
    "modulus": 4,
    "half_space_search": 4,
    "layered": 4,
    "unsupported": 4,
    "fractional": 4,
    "creep": 5.5,
    "batch": 4,
    "planning": 4,
    "propagation": 4,
    "sampling": 0,
    "bayes": 5,
    "joint_search": 5,
    "together": 6,
    "layered_search": 5,
    "prony": 6,
    "files": 0,
    "files.text": 0,
    "files.cells": 1,
    "files.names": 1,
    "files.header": 2,
    "files.afm": 2,
    "files.table": 3,
    "files.columns": 4,
    "files.mending": 5,
    "files.onset": 5,
    "files.constancy": 5,
    "readers": 6,
    "indentation": 6,
    "flags": 7,
    "modulus_reader": 7,
    "shell_words": 0,
    "output": 1,
    "batch_page": 1,
    "batch_command": 8,
    "further_commands": 8,
    "command": 9,
    "__init__": 10,
}
TOP = 22  # the package itself; above it saving, cases and the command line


def name_of(path: Path, package: Path = PACKAGE) -> str:
    return ".".join(path.relative_to(package).with_suffix("").parts).removesuffix(".__init__")


def layer(module: str) -> int:
    if module.split(".")[0] in ("reference", "cases"):
        return LAYERS.get(module, 0) if module.startswith("reference") else TOP + 1
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
            lazy_plot = module in ("results", "interior_fields") and target in ("figures", "")
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
    for module in ("results", "interior_fields"):
        graph.get(module, set()).discard("figures")  # imports matplotlib, so a function of results does it
    TopologicalSorter(graph).prepare()


def test_fitting_imports_only_from_lower_layers():
    for module, found in imported_modules(ROOT / "fitting").items():
        for target in found:
            assert FITTING_LAYERS[target] < FITTING_LAYERS[module], f"{module} imports {target}"


def test_the_oracles_share_no_code_with_the_package():
    for path in (PACKAGE / "reference").glob("*.py"):
        assert all(name.startswith("jaxcontact.reference") for name in imports(path, "jaxcontact")), path


def test_contact_and_march_see_operators_and_memories_by_their_protocols_alone():
    """No spectrum, no kernel, no response: what they import is closed under these few modules."""
    own = {
        "_pytree",
        "_status",
        "contact.window",
        "contact.linear",
        "contact.edge",
        "contact.law",
        "contact.normal",
        "contact.nonsymmetric",
        "contact.implicit",
        "contact.friction",
        "contact.partial_slip",
    }
    for path in [*(PACKAGE / "contact").glob("*.py"), PACKAGE / "history" / "march.py"]:
        found = {module_of(name) for name in imports(path, "jaxcontact")}
        assert found <= own | {"operators.base", "history.memory", "contact"}, path
        assert "fft" not in path.read_text() and "spectrum" not in path.read_text(), path


def test_layers_are_counted_in_one_place():
    """What a body is made of is asked of its response; ``layers`` itself checks them."""
    for path in {*SOURCES, *(ROOT / "fitting").rglob("*.py")}:
        if path.parent.name != "response" and path.name != "layers.py":
            assert not re.search(r"(?<!jaxcontact)\.layers\b", code_of(path)), path


def test_names_are_used_once():
    """No public function hides a module, and no two classes bear one name."""
    modules = {name_of(path).split(".")[0] for path in SOURCES}
    assert not modules & set(jc.__all__)
    classes = [
        node.name
        for path in [*SOURCES, *(ROOT / "fitting").rglob("*.py")]
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ClassDef)
    ]
    assert sorted(set(classes)) == sorted(classes)


def code_of(path: Path) -> str:
    """A file without its comments and docstrings."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            node.value.value = ""
    return ast.unparse(tree)


def test_only_plotting_imports_matplotlib():
    allowed = {
        PACKAGE / name
        for name in ("picture_style.py", "plotting.py", "figures.py", "rough_figures.py", "cases/pictures.py")
    }
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
        "jaxcontact._exponential.",
        "jaxcontact.spectrum",
        "jaxcontact.kept_traces",
        "jaxcontact.files.npz",
    )
    for path in (ROOT / "fitting").rglob("*.py"):
        own = [name for name in imports(path, "jaxcontact") if not name.startswith(common)]
        assert all(name.count(".") <= 1 for name in own), path


def test_functions_are_short():
    for path in [*SOURCES, *(ROOT / "fitting").rglob("*.py")]:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef):
                doc = ast.get_docstring(node) or ""
                length = node.end_lineno - node.lineno - doc.count("\n")
                assert length <= 40, f"{path.name}: {node.name} has {length} lines"
