"""The structure of a checkout in numbers, to compare two commits.

    python tests/benchmarks/structure.py [CHECKOUT]

Knowing a verb is taken to be naming steady sliding (its function, its result or its kind of case) in code, outside the
modules that define it, the package's list of public names and the reproduction of the paper. Declaring fields is taken to
be giving the units of at least three of ``FIELDS``, in a dictionary or in calls. Both count modules; docstrings and
comments do not count.
"""

import ast
import re
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

PACKAGES = ("jaxcontact", "fitting")
VERB = {"slide_steady", "SteadySliding", "steady-sliding"}
FIELDS = {"approach", "load", "contact_area", "contact_radius", "film_strain", "peak_pressure", "power"}
UNITS = {"m", "N", "m2", "Pa", "m/m", "1", "W"}
NO_SENTENCE = re.compile(r"(What|Of|Where|How|Whether|Why) ")


def modules(folder: Path) -> dict[str, ast.Module]:
    """Return the modules of a folder by their dotted names."""
    name = lambda path: ".".join(path.relative_to(folder.parent).with_suffix("").parts).removesuffix(
        ".__init__"
    )
    return {name(path): ast.parse(path.read_text()) for path in sorted(folder.rglob("*.py"))}


def functions(tree: ast.AST) -> Iterator[ast.FunctionDef]:
    return (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))


def length(function: ast.FunctionDef) -> int:
    """Return the number of lines without the docstring."""
    doc = ast.get_docstring(function, clean=False)
    return function.end_lineno - function.lineno + 1 - (len(doc.splitlines()) if doc else 0)


def arguments(function: ast.FunctionDef) -> int:
    given = function.args
    return len([*given.posonlyargs, *given.args, *given.kwonlyargs])


def words(tree: ast.Module) -> set[str]:
    """Return the names and strings in the code of a module."""
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
        name = (
            first.value.replace(" ", "_")
            if isinstance(first, ast.Constant) and isinstance(first.value, str)
            else ""
        )
        given = {c.value for one in others for c in ast.walk(one) if isinstance(c, ast.Constant)}
        found |= {name} & FIELDS if given & UNITS else set()
    return found


def defines(tree: ast.Module) -> set[str]:
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}


def circles(package: str, trees: dict[str, ast.Module]) -> int:
    """Return 0 if no module imports itself by way of others, in functions too, and else 1."""
    graph: dict[str, set[str]] = {name: set() for name in trees}
    for name, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == package:
                for alias in node.names:
                    full = f"{node.module}.{alias.name}"
                    graph[name].add(full if full in trees else node.module)
            elif isinstance(node, ast.Import):
                graph[name] |= {alias.name for alias in node.names} & trees.keys()
    try:
        TopologicalSorter(graph).prepare()
    except CycleError:
        return 1
    return 0


def sentences(trees: dict[str, ast.Module]) -> str:
    """Return how many public docstrings of modules, classes and functions begin with a sentence or a noun phrase."""
    nodes = [
        n for tree in trees.values() for n in ast.walk(tree) if hasattr(n, "body") and hasattr(n, "name")
    ]
    public = [
        n for n in nodes if isinstance(n, ast.FunctionDef | ast.ClassDef) and not n.name.startswith("_")
    ]
    docs = [doc for node in (*trees.values(), *public) if (doc := ast.get_docstring(node))]
    good = sum(not NO_SENTENCE.match(doc) and doc.split("\n\n")[0].rstrip()[-1] in ".:)?" for doc in docs)
    return f"{good} of {len(docs)}"


def report(root: Path, package: str) -> dict[str, object]:
    """Return the figures of one package."""
    trees = modules(root / package)
    own = [one for tree in trees.values() for one in functions(tree)]
    sizes = {name: tree_lines(root, name) for name, tree in trees.items()}
    code = (path for path in (root / package).iterdir() if path.suffix == ".py" or list(path.rglob("*.py")))
    inside = [path.stem for path in code]
    listed = words(trees[package])
    long = max(own, key=length)
    private = [one for one in own if one.name not in listed]
    other = {name: tree for name, tree in trees.items() if ".paper" not in name and name != package}
    knowing = [name for name, tree in other.items() if VERB & words(tree) and not VERB & defines(tree)]
    return {
        "modules": len(trees),
        "lines": sum(sizes.values()),
        "names at the root": sum(not name.startswith("_") for name in inside),
        "longest module": max((size, name) for name, size in sizes.items()),
        "longest function": (length(long), long.name),
        "arguments of a function that is not public": max((arguments(one), one.name) for one in private),
        "circles": circles(package, trees),
        "know a verb": knowing,
        "declare a field": [name for name, tree in other.items() if len(declared(tree)) >= 3],
        "docstrings that begin with a sentence": sentences(trees),
    }


def tree_lines(root: Path, name: str) -> int:
    path = root.joinpath(*name.split("."))
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return len(path.read_text().splitlines())


if __name__ == "__main__":
    checkout = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[2]
    for one in PACKAGES:
        print(one, *(f"  {key}: {value}" for key, value in report(checkout, one).items()), sep="\n")
