"""How the site is built: python -m sphinx docs site.

The recipes are run, which takes some minutes; with -t stored the site shows the outputs that are in the page.
"""

import base64
import inspect
import io
import json
import re
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
from docutils import nodes
from docutils.utils.math import latex2mathml
from PIL import Image

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path.insert(0, str(ROOT))
sys.path.insert(0, str(HERE))

from jaxcontact import __version__  # noqa: E402

import recipes  # noqa: E402
from equations import EQUATIONS  # noqa: E402

project, author, release = "jaxcontact", "The jaxcontact developers", __version__
version = release
copyright = author  # shown at the foot of each page
extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "myst_nb",
]
if tags.has("linked"):  # noqa: F821  # the names of other packages become links; this needs a network
    extensions.append("sphinx.ext.intersphinx")
intersphinx_mapping = {
    "python": ("https://docs.python.org/3/", None),
    "jax": ("https://docs.jax.dev/en/latest/", None),
    "numpy": ("https://numpy.org/doc/stable/", None),
    "matplotlib": ("https://matplotlib.org/stable/", None),
    "pandas": ("https://pandas.pydata.org/docs/", None),
    "xarray": ("https://docs.xarray.dev/en/stable/", None),
}
linkcheck_anchors = False
linkcheck_timeout, linkcheck_retries = 20, 2
exclude_patterns = ["README.md", "paper"]
html_theme = "furo"
html_title = f"jaxcontact {release}"
html_math_renderer = "mathml"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_extra_path = ["../jaxcontact/shell/playground/page"]
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"

# Notebooks as they were committed: tests/project/test_notebooks.py runs them.
nb_execution_mode = "off"
nb_merge_streams = True
myst_enable_extensions = ["dollarmath", "deflist", "attrs_inline"]
myst_heading_anchors = 3
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

# Signatures read as they were written.
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
napoleon_numpy_docstring = False
napoleon_use_rtype = False
napoleon_use_param = False  # names that share an explanation share an entry
# ... of attributes too: as fields ``ivar``, all names but the last would be taken for a type, and linked.
napoleon_custom_sections = [("Attributes", "params_style")]
python_maximum_signature_line_length = 88
python_use_unqualified_type_names = True

SECTION = re.compile(r"(Args|Attributes|Example|Raises|Returns):$")


def _formulas(lines: list[str]) -> list[str]:
    """Indented blocks of a docstring, its formulas: in LaTeX those of EQUATIONS, and others as literal text.

    reStructuredText would take them for prose.
    """
    out: list[str] = []
    block: list[str] = []
    inside = False
    for line in [*lines, "."]:
        indented = line.startswith("    ")
        if block and line and not indented:
            out += _formula_or_text(block)
            block = []
        inside = bool(SECTION.match(line)) or (inside and (indented or not line))
        if block or (indented and not inside and (not out or not out[-1])):
            block.append(line)
        else:
            out.append(line if ">>>" in line else _plain_bars(line))
    return out[:-1]


def _formula_or_text(block: list[str]) -> list[str]:
    """The lines of a block as a directive."""
    text = " ".join(" ".join(block).split())
    if text not in EQUATIONS:
        return [".. code-block:: text", "", *block, ""]
    return [".. math::", "", f"    {EQUATIONS[text]}", ""]


def _in_order(thing: Any, lines: list[str]) -> list[str]:
    """The entries of the section on arguments in the order of the signature, each by its first name."""
    if "Args:" not in lines:
        return lines
    first = lines.index("Args:") + 1
    last = next(
        (i for i in range(first, len(lines)) if lines[i] and lines[i][0] != " "),
        len(lines),
    )
    entries: list[list[str]] = []
    for line in lines[first:last]:
        if (line.startswith("    ") and line[4:5] not in ("", " ")) or not entries:
            entries.append([])
        entries[-1].append(line)
    try:
        order = list(inspect.signature(thing).parameters)
    except (TypeError, ValueError):
        return lines
    place = lambda entry: next(
        (
            i
            for i, name in enumerate(order)
            if re.match(rf"\W*{name}\b", entry[0].strip())
        ),
        len(order),
    )
    trimmed = [
        entry[: next(i for i in range(len(entry), 0, -1) if entry[i - 1].strip())]
        for entry in entries
    ]
    return [
        *lines[:first],
        *(line for entry in sorted(trimmed, key=place) for line in entry),
        "",
        *lines[last:],
    ]


def _plain_bars(line: str) -> str:
    """|v| is no substitution, outside of literals."""
    parts = line.split("``")
    return "``".join(
        part if i % 2 else part.replace("|", r"\|") for i, part in enumerate(parts)
    )


def _docstring(
    app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    lines[:] = _formulas(_in_order(thing, lines))
    if (
        what == "property" and lines
    ):  # napoleon takes what stands before a colon for a type
        lines[0] = lines[0].replace(": ", " \N{EN DASH} ", 1)


def _signature(
    app: Any, what: str, name: str, thing: Any, options: Any, signature: Any, returns: Any
) -> tuple | None:
    """None for what users are given, and do not make."""
    if inspect.isclass(thing) and "\nArgs:\n" not in (inspect.getdoc(thing) or ""):
        return "", None
    return None


def _skip(
    app: Any, what: str, name: str, thing: Any, skip: bool, options: Any
) -> bool | None:
    """Fields of named tuples: the docstring of the class says what they are."""
    return True if type(thing).__name__ == "_tuplegetter" else None


def _formula(self: Any, node: nodes.Element) -> None:
    """MathML, which browsers draw by themselves: no script, and nothing from elsewhere on the net."""
    block = isinstance(node, nodes.math_block)
    mathml = latex2mathml.tex2mathml(node.astext(), as_block=block)
    self.body.append(f'<div class="math">{mathml}</div>' if block else mathml)
    raise nodes.SkipNode


COURSE = {  # parts of the tutorials, and the numbers of their notebooks
    "First steps": (1, 2, 4),
    "Materials from measurements": (3, 10, 19, 18, 20, 13),
    "Rough surfaces, sliding, friction and rolling": (12, 5, 7, 8),
    "Adhesion": (16,),
    "Tribofilms": (6, 9, 14, 15),
    "Studies and design": (11, 17),
}


def _copy_notebooks() -> None:
    """Into the folder of the pages, where Sphinx finds them, with a page of their first pictures."""
    target = HERE / "notebooks"
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir()
    sources = {
        int(path.stem.partition("_")[0]): path
        for path in (ROOT / "notebooks").glob("*.ipynb")
    }
    if sorted(sources) != sorted(sum(COURSE.values(), ())):
        raise ValueError(f"notebooks {sorted(sources)}: expected those of COURSE")
    parts = []
    for title, numbers in COURSE.items():
        for number in numbers:
            shutil.copy(sources[number], target)
        cards = [_card(sources[number], target) for number in numbers]
        names = "\n".join(f"notebooks/{sources[number].stem}" for number in numbers)
        parts.append(
            f"## {title}\n\n`````{{container}} pictures thumbnails\n{''.join(cards)}`````\n\n"
            f"```{{toctree}}\n:hidden:\n\n{names}\n```\n"
        )
    (target / "gallery.txt").write_text("\n".join(parts), encoding="utf-8")


def _card(source: Path, target: Path) -> str:
    """Return a figure of a notebook's first picture, with its title, and write the picture into a folder."""
    cells = json.loads(source.read_text(encoding="utf-8"))["cells"]
    title = "".join(cells[0]["source"]).partition("\n")[0].lstrip("# ")
    outputs = [output for cell in cells for output in cell.get("outputs", [])]
    pictures = [
        out["data"]["image/png"] for out in outputs if "image/png" in out.get("data", {})
    ]
    if not pictures:
        raise ValueError(f"{source.name}: expected a picture for the gallery")
    picture = Image.open(io.BytesIO(base64.b64decode("".join(pictures[0]))))
    _first_panel(picture.convert("RGBA")).save(target / f"{source.stem}.png")
    name = f"notebooks/{source.stem}"
    return f'```{{figure}} {name}.png\n:alt: ""\n\n[{title}]({name}.ipynb)\n```\n'


def _first_panel(picture: Image.Image) -> Image.Image:
    """Return a wide picture up to the end of its first panel: of the first unbroken run of columns that is wide."""
    pixels, height = np.asarray(picture), picture.height
    if picture.width < 1.8 * height:
        return picture
    drawn = np.any(pixels != pixels[:1, :1], axis=(0, 2))
    ends = np.flatnonzero(np.diff(np.pad(drawn, 1).astype(int)))
    first = next(
        (end for start, end in ends.reshape(-1, 2) if end - start > 0.6 * height),
        picture.width,
    )
    return picture.crop((0, 0, min(int(first) + 6, picture.width), height))


def setup(app: Any) -> None:
    _copy_notebooks()
    page = recipes.PAGE.read_text(encoding="utf-8")
    if not app.tags.has("stored"):
        *_, (_, page) = recipes.run()
    folder = HERE / "how_do_i"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    listed = recipes.write_pages(page, folder)

    def pages_of_recipes(app: Any, name: str, source: list[str]) -> None:
        """Show the list in place of the recipes, and lead links to the recipes to their pages."""
        source[0] = recipes.linked(
            listed if name == recipes.PAGE.stem else source[0], page
        )

    app.connect("source-read", pages_of_recipes)
    app.add_html_math_renderer("mathml", (_formula, None), (_formula, None))
    app.connect(
        "autodoc-process-docstring", _docstring, priority=400
    )  # before napoleon reads the sections
    app.connect("autodoc-process-signature", _signature)
    app.connect("autodoc-skip-member", _skip)
