"""Every module, member and file that a docstring or comment names exists."""

import ast
import importlib
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("jaxcontact", "fitting")
ALIASES = {"jc": "jaxcontact", "jnp": "jax.numpy", "lax": "jax.lax", "np": "numpy"}
OTHERS = ("jax", "numpy", "warnings", "sys", "itertools", "concurrent.futures")  # installed everywhere
FOREIGN = re.compile(r"(xarray|pandas|mpi4py)\.|vm\.max_map_count$|(fitting|jaxcontact\.fitting)\.NAME$")
ENTRY_POINTS = ("jaxcontact.materials", "jaxcontact.readers", "jaxcontact.fitting")
OBJECTS = ("indenter.material", "history.status", "study.notes")  # of an example
DATA = re.compile(r"\.(md|npz|pvd|vtr|toml|mplstyle)$")


def defined() -> tuple[dict[str, set[str]], dict[str, set[str]]]:
    """The names in each module, and the members of each class with those of its bases."""
    names, own, bases = {}, {}, {}
    for path in (p for package in PACKAGES for p in (ROOT / package).rglob("*.py")):
        found = names.setdefault(
            ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"), set()
        )
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                found.add(node.name)
            elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                found.add(node.id)
            elif isinstance(node, ast.alias):
                found.add(node.asname or node.name)
            if isinstance(node, ast.ClassDef):
                own.setdefault(node.name, set()).update(
                    each.name if isinstance(each, ast.FunctionDef) else ast.unparse(target)
                    for each in node.body
                    for target in getattr(each, "targets", [getattr(each, "target", None)])
                    if isinstance(each, ast.FunctionDef) or target is not None
                )
                bases.setdefault(node.name, set()).update(ast.unparse(base) for base in node.bases)
    with_bases = lambda kind: own.get(kind, set()).union(*map(with_bases, bases.get(kind, set()) - {kind}))
    names["jaxcontact"] |= names["jaxcontact._names"]  # from which it takes them
    return names, {kind: with_bases(kind) for kind in own}


def imported(dotted: str) -> bool:
    """Whether a name of another package, or of one of these by its public name, can be imported."""
    first, _, rest = dotted.partition(".")
    parts = f"{ALIASES.get(first, first)}.{rest}".split(".")
    for count in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:count]))
        except ImportError:
            continue
        for name in parts[count:]:
            found = getattr(found, name, None)
        return found is not None
    return False


def test_every_file_that_the_page_for_developers_names_is_there():
    text = (ROOT / "docs" / "developers.md").read_text()
    paths = [
        f"/{p.relative_to(ROOT)}"
        for each in (*PACKAGES, "tests", "docs")
        for p in (ROOT / each).rglob("*.py")
    ]
    for name in re.findall(r"`([\w/]+\.py)`", text):
        assert any(path.endswith(f"/{name}") for path in paths), name


def test_every_module_file_and_member_in_double_backticks_is_there():
    modules, members = defined()
    files = {path.name for folder in (*PACKAGES, "tests", "docs") for path in (ROOT / folder).rglob("*.py")}

    def there(name: str) -> bool:
        if name.endswith(".py"):
            return name.split("/")[-1] in files
        if DATA.search(name) or FOREIGN.match(name) or name in (*ENTRY_POINTS, *OBJECTS):
            return True
        parts = name.split(".")
        if parts[0] in members and parts[1] in members[parts[0]]:
            return True
        for count in range(len(parts), 0, -1):
            for module, found in modules.items():
                if (
                    f".{module}".endswith("." + ".".join(parts[:count]))
                    and {*parts[count : count + 1]} <= found
                ):
                    return True
        return parts[0] in (*ALIASES, *OTHERS, "concurrent") and imported(name)

    assert there("response.stack.surface_creep") and not there("response.body.surface_creep")
    dead = []
    for path in (p for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py"))):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            named = re.findall(r"``([A-Za-z_][\w/]*\.[\w./]*\w)``", line)
            dead += [f"{path.relative_to(ROOT)}:{number}: {name}" for name in named if not there(name)]
    assert not dead, "\n".join(dead)


def test_every_test_that_holds_a_fault_of_the_review_is_there():
    from tests.benchmarks import review

    for number, line in review.LINES.items():
        assert line.tests and not review.missing_tests(line.tests), number
    assert review.missing_tests(("fitting/test_creep.py::test_what_nobody_wrote", "no/file.py::test_x"))
