"""Run the recipes of how_do_i.md and write what each prints below it.

    python docs/recipes.py                     # all recipes: some minutes
    python docs/recipes.py "compute a line contact"

The output of a recipe is a block of text that follows its block of Python.
"""

import contextlib
import io
import os
import re
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

PAGE = Path(__file__).with_name("how_do_i.md")
PYTHON = re.compile(r"```python\n(.*?)```\n", re.DOTALL)
OUTPUT = re.compile(r"\n```text\n(.*?)```\n", re.DOTALL)
LONGEST = 18  # lines of output that the page shows


def setup_and_recipes() -> tuple[str, dict[str, str]]:
    """Return the lines that all recipes follow, and the text of each recipe by its heading."""
    setup, *parts = re.split(
        r"^### ", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE
    )
    return PYTHON.findall(setup)[0], {part.partition("\n")[0]: part for part in parts}


def printed(setup: str, recipe: str) -> str:
    """Return what a recipe prints, in a folder of its own."""
    before, out = Path.cwd(), io.StringIO()
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(out):
        os.chdir(folder)
        try:
            exec(setup + PYTHON.findall(recipe)[0], {"__name__": "__main__"})
        finally:
            os.chdir(before)
    return out.getvalue()


def shown(output: str) -> str:
    """Return an output as the page shows it: its first lines."""
    lines = [line.rstrip() for line in output.strip("\n").splitlines()]
    return "\n".join(lines[:LONGEST] + (["..."] if len(lines) > LONGEST else [])) + "\n"


def with_output(recipe: str, output: str) -> str:
    """Return the text of a recipe with its output, which replaces the one that is there."""
    code = PYTHON.search(recipe)
    assert code is not None
    return (
        recipe[: code.end()]
        + f"\n```text\n{output}```\n"
        + OUTPUT.sub("", recipe[code.end() :], count=1)
    )


def run(names: Iterable[str] = ()) -> Iterator[tuple[str, str]]:
    """Run some or all recipes, and yield the heading of each and the whole page with its output and those before it."""
    page = PAGE.read_text(encoding="utf-8")
    setup, recipes = setup_and_recipes()
    for name in names or recipes:
        text = recipes[name]
        page = page.replace(text, with_output(text, shown(printed(setup, text))))
        yield name, page


def main(names: list[str]) -> None:
    for name, page in run(names):
        PAGE.write_text(page, encoding="utf-8")
        print(name, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
