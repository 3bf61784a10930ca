"""Run the recipes of how_do_i.md and write what each prints below it.

    python docs/recipes.py                     # all recipes: some minutes
    python docs/recipes.py "compute a line contact"

The output of a recipe is a block of text that follows its block of Python. The site shows the recipes of each subject, which
is a heading of the second level, on a page of its own, with a list of all recipes (``write_pages``).
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


def page_of(subject: str) -> str:
    """Return the name of the page of a subject, without ending."""
    return re.sub(r"\W+", "_", subject.lower()).strip("_")


def anchor_of(heading: str) -> str:
    """Return the anchor of a heading, as the site and the hosting service make it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")


def write_pages(page: str, folder: Path) -> str:
    """Write a page for each subject of the text of how_do_i.md, and return its beginning with the list of all recipes.

    The recipes and their anchors are those of the text, so that links to how_do_i.md#... are turned into links to the pages
    by ``linked``.
    """
    head, *subjects = re.split(r"^## ", page, flags=re.MULTILINE)
    title, _, rest = head.partition("\n")
    lines, _, which = rest.partition("\nWhich function:\n")
    shared = re.search(r"```python\n.*?\n```", lines, re.DOTALL)
    assert shared is not None
    setup = (
        "Each recipe follows the lines that all share:\n\n"
        f"<details><summary>show these lines</summary>\n\n{shared[0]}\n\n</details>\n"
    )
    lists, names = [], []
    for subject in subjects:
        heading, _, recipes = subject.partition("\n")
        name, headings = (
            page_of(heading),
            re.findall(r"^### (.*)$", recipes, re.MULTILINE),
        )
        text = re.sub(r"^### ", "## ", recipes, flags=re.MULTILINE)
        text = re.sub(r"\]\((?=[\w/]+\.(?:md|rst|ipynb))", "](../", text)
        text = linked(text.replace("](#", "](../how_do_i.md#"), page)
        (folder / f"{name}.md").write_text(
            f"# {heading}\n\n{setup}\n{text}", encoding="utf-8"
        )
        names.append(f"{folder.name}/{name}")
        entries = "\n".join(
            f"- [{each}]({folder.name}/{name}.md#{anchor_of(each)})" for each in headings
        )
        lists.append(f"## {heading}\n\n{entries}\n")
    toc = "```{toctree}\n:hidden:\n\n" + "\n".join(names) + "\n```\n"
    parts = [
        title,
        "\n".join(lists),
        f"## Which function\n{which}",
        f"## Lines that all recipes share\n{lines}",
        toc,
    ]
    return "\n\n".join(parts)


def linked(text: str, page: str) -> str:
    """Return a text of the site in which links to anchors of how_do_i.md lead to the pages of their subjects."""
    places = {}
    for subject in re.split(r"^## ", page, flags=re.MULTILINE)[1:]:
        name = page_of(subject.partition("\n")[0])
        for heading in re.findall(r"^### (.*)$", subject, re.MULTILINE):
            places[anchor_of(heading)] = f"how_do_i/{name}.md"
    place = lambda found: f"{places.get(found[1], 'how_do_i.md')}#{found[1]}"
    return re.sub(r"how_do_i\.md#([\w-]+)", place, text)


def main(names: list[str]) -> None:
    for name, page in run(names):
        PAGE.write_text(page, encoding="utf-8")
        print(name, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
