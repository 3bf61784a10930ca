"""The structure of a checkout in numbers, to compare two commits: sizes, and what one call enters.

    python tests/benchmarks/structure.py [CHECKOUT]

Each figure is that of jaxcontact / fitting. What a call enters is the first call in a fresh process without caches: every
code object of both packages that runs, lambdas, nested functions, comprehensions and class bodies included, but nothing
that an import runs, at any time. Its depth is the largest number of such frames on the stack. Arguments are made before.

Lines are those of files. A comment counts if it stands on a line of its own inside a function. A private function (its name
begins with one underscore) counts as called once if one place of its module outside of it, and no other module, names it.
A class counts as one without a method if no function stands in its body; fields and inherited methods are none.
"""

import argparse
import ast
import io
import json
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import tokenize
from collections import Counter
from collections.abc import Callable
from pathlib import Path

PACKAGES = ("jaxcontact", "fitting")


def static(folder: Path) -> dict[str, float]:
    """Return the figures of the sources of a package, without running them."""
    paths = sorted(folder.rglob("*.py"))
    texts = [path.read_text(encoding="utf-8") for path in paths]
    trees = [ast.parse(text) for text in texts]
    lines = [len(text.splitlines()) for text in texts]
    comments, functions, private, once = 0, [], 0, 0
    imported = {
        a.name for tree in trees for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) for a in n.names
    }
    classes = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
    for text, tree in zip(texts, trees, strict=True):
        own = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
        functions += own
        inside = {line for node in own for line in range(node.body[0].lineno, node.end_lineno + 1)}
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            alone = token.type == tokenize.COMMENT and token.line.lstrip().startswith("#")
            comments += alone and token.start[0] in inside
        hidden = [node for node in own if node.name.startswith("_") and not node.name.startswith("__")]
        uses = _names(tree)
        private += len(hidden)
        once += sum(
            uses[node.name] - _names(node)[node.name] == 1 and node.name not in imported for node in hidden
        )
    is_function = lambda node: isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    bare = [node for node in classes if not any(map(is_function, node.body))]
    tuples = [
        node for node in classes if any(ast.unparse(base).endswith("NamedTuple") for base in node.bases)
    ]
    long = [node.end_lineno - node.body[0].lineno + 1 - _doc_lines(node) for node in functions]
    return {
        "files": len(paths),
        "lines": sum(lines),
        "median lines a file": statistics.median(lines),
        "functions": len(functions),
        "lines of a function without docstring, mean": round(statistics.mean(long), 1),
        "lines of a function without docstring, longest": max(long),
        "classes": len(classes),
        "classes without a method": len(bare),
        "named tuples": len(tuples),
        "named tuples without a method": sum(node in bare for node in tuples),
        "private functions": private,
        "private functions called once": once,
        "comments inside code, % of lines": round(100.0 * comments / sum(lines), 2),
    }


def _names(tree: ast.AST) -> Counter[str]:
    """Return how often names stand in code, those of variables and of attributes."""
    nodes = (node for node in ast.walk(tree) if isinstance(node, ast.Name | ast.Attribute))
    return Counter(node.id if isinstance(node, ast.Name) else node.attr for node in nodes)


def _doc_lines(node: ast.FunctionDef) -> int:
    first = node.body[0]
    is_doc = (
        isinstance(first, ast.Expr)
        and isinstance(first.value, ast.Constant)
        and isinstance(first.value.value, str)
    )
    return first.end_lineno - first.lineno + 1 if is_doc else 0


def prepared(name: str) -> Callable[[], object]:
    """Return a call whose arguments are ready, through public names alone; small, since its path is what counts."""
    import numpy as np

    import fitting
    import jaxcontact as jc

    steel = jc.Elastic.from_young(210e9, nu=0.3)
    film = jc.Burgers(G1=0.75e9, G2=13.89e6, eta1=3.1486e12, eta2=120.9e9, nu=0.3)
    ball, load, grid = jc.Sphere(9.525e-3, material=steel), jc.Load(60.0), jc.Grid.square(32, 620e-6)
    elastic, coated = jc.LayeredHalfSpace([], steel), jc.LayeredHalfSpace([jc.Layer(film, 150e-9)], steel)
    if name == "indent, elastic":
        return lambda: jc.indent(elastic, ball, load, np.zeros(1), grid=grid)
    if name == "indent, film, three times":
        return lambda: jc.indent(coated, ball, load, np.array([0.0, 60.0, 600.0]), grid=grid)
    if name == "slide_steady":
        return lambda: jc.slide_steady(coated, ball, load, velocity=1e-6, grid=grid)
    random = np.random.default_rng(0)
    if name == "fit_creep":
        t = np.linspace(10.0, 7200.0, 100)
        data = fitting.CreepData(
            t=t, J=np.asarray(film.creep(t)) * (1.0 + 0.01 * random.standard_normal(t.size))
        )
        return lambda: fitting.fit_creep(data)
    depth = np.linspace(-1e-6, 1e-6, 200)
    # Hertz, G = 1 kPa, nu = 0.5
    force = 16.0 / 3.0 * 1e3 * 2.0 * np.sqrt(5e-6) * np.clip(depth, 0.0, None) ** 1.5
    noisy = force + 0.01 * force.max() * random.standard_normal(depth.size)
    curve = fitting.IndentationData(t=np.linspace(0.0, 1.0, depth.size), load=noisy, depth=depth)
    return lambda: fitting.fit_force(curve, indenter=jc.Sphere(5e-6))


CALLS = ("indent, elastic", "indent, film, three times", "slide_steady", "fit_creep", "fit_force")


def entered(root: Path, call: Callable[[], object]) -> dict[str, object]:
    """Run a call and return what it enters: {package: [files, functions]}, and the largest depth."""
    seen: dict[int, object] = {}  # code objects by their ids, since alike ones are equal
    folders = tuple(str(root / name) + os.sep for name in PACKAGES)
    depth = deepest = importing = 0

    def follow(frame, event, argument):
        nonlocal depth, deepest, importing
        code = frame.f_code
        if code.co_name == "_find_and_load" and "importlib" in code.co_filename:
            importing += {"call": 1, "return": -1}.get(event, 0)
        elif not importing and code.co_filename.startswith(folders):
            if event == "call":
                seen[id(code)] = code
                depth += 1
                deepest = max(depth, deepest)
            elif event == "return":
                depth -= 1

    threading.setprofile(follow)
    sys.setprofile(follow)
    try:
        call()
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    found: dict[str, object] = {"depth": deepest}
    for name, folder in zip(PACKAGES, folders, strict=True):
        own = [code for code in seen.values() if code.co_filename.startswith(folder)]
        found[name] = [
            len({code.co_filename for code in own}),
            len(own),
            len({(c.co_filename, c.co_qualname) for c in own}),
        ]
    return found


def in_a_fresh_process(root: Path, name: str) -> dict[str, object]:
    """Return what a call enters, in a process that finds no cache of compiled programs."""
    with tempfile.TemporaryDirectory() as nowhere:
        env = {key: value for key, value in os.environ.items() if not key.startswith("JAX_")}
        env |= {
            "PYTHONPATH": str(root),
            "XDG_CACHE_HOME": nowhere,
            "HOME": nowhere,
            "PYTHONWARNINGS": "ignore",
        }
        command = [sys.executable, str(Path(__file__).resolve()), str(root), name]
        done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{name}: {done.stderr}")
    return json.loads(done.stdout.splitlines()[-1])


def main(root: Path) -> None:
    """Print every figure of a checkout."""
    print("jaxcontact / fitting")
    both = [static(root / name) for name in PACKAGES]
    for figure in both[0]:
        print(f"  {figure}: {both[0][figure]} / {both[1][figure]}")
    tests = sorted((root / "tests").rglob("*.py"))
    print(f"  files of tests: {len(tests)}, lines: {sum(len(p.read_text().splitlines()) for p in tests)}")
    for name in CALLS:
        found = in_a_fresh_process(root, name)
        (files, functions, names), (more_files, more_functions, more_names) = (
            found["jaxcontact"],
            found["fitting"],
        )
        total = f"together {files + more_files} files, {functions + more_functions} functions"
        print(f"  {name}: files {files} / {more_files}, functions {functions} / {more_functions}; {total},")
        print(f"    of {names + more_names} different names, depth {found['depth']}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    here = Path(__file__).resolve().parents[2]
    parser.add_argument("checkout", nargs="?", type=Path, default=here, help="by default that of this file")
    parser.add_argument(
        "call", nargs="?", choices=CALLS, metavar="CALL", help="print only what this call enters, as JSON"
    )
    options = parser.parse_args()
    checkout = options.checkout.resolve()
    if not all((checkout / name).is_dir() for name in PACKAGES):
        parser.error(f"expected a checkout with the folders {' and '.join(PACKAGES)}, got {checkout}")
    if options.call:
        print(json.dumps(entered(checkout, prepared(options.call))))
    else:
        main(checkout)
