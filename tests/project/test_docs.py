"""The documents: the site builds, what they say can be run runs, and what they say is tested is."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from scripts import DOCS, assert_printed_as_shown, script

import fitting
import jaxcontact as jc

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)
OUTPUT = re.compile(r"```text\n(.*?)```", re.DOTALL)


def recipes():
    """The lines that all recipes follow, and the program and the output of each by its heading."""
    setup, parts = recipes_page.setup_and_recipes()
    found = [{name: block.findall(part) for name, part in parts.items()} for block in (BLOCK, OUTPUT)]
    assert all(len(texts) == 1 for one in found for texts in one.values())
    blocks, outputs = ({name: texts[0] for name, texts in one.items()} for one in found)
    return setup, blocks, outputs


recipes_page = script("recipes.py")
EQUATIONS = script("equations.py").EQUATIONS
SETUP, RECIPES, OUTPUTS = recipes()


def test_there_are_twenty_recipes_of_about_ten_lines():
    assert len(RECIPES) >= 20
    assert max(sum(map(bool, block.splitlines())) for block in RECIPES.values()) <= 16
    assert max(len(line) for block in RECIPES.values() for line in block.splitlines()) <= 90  # no scrolling


def test_each_recipe_is_on_the_page_of_its_subject_and_in_the_list(tmp_path):
    """The pages that the build makes: each link of the list, and each link between recipes, leads to a heading."""
    page = recipes_page.PAGE.read_text(encoding="utf-8")
    listed = recipes_page.write_pages(page, tmp_path)
    pages = {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()}
    assert len(pages) >= 6 and max(text.count("\n## ") for text in pages.values()) <= 16
    headings = {f"{name}#{recipes_page.anchor_of(one)}" for name, text in pages.items()
                for one in re.findall(r"^## (.*)$", text, re.MULTILINE)}  # fmt: skip
    links = re.findall(rf"\]\({tmp_path.name}/(\S+)\)", listed)
    assert len(links) == len(RECIPES) and set(links) == headings
    others = [path.read_text(encoding="utf-8") for path in DOCS.glob("*.md") if path != recipes_page.PAGE]
    between = re.findall(
        r"how_do_i/(\S+?#[^)\s]+)\)", recipes_page.linked("".join([*others, *pages.values()]), page)
    )
    assert len(between) >= 4 and set(between) <= headings
    assert not re.search(r"how_do_i\.md#", recipes_page.linked("".join([*others, *pages.values()]), page))


DEAR = (  # not run in .ci/run
    "identify a film from a measured pressure map",
    "propagate the uncertainty of a fit to a contact simulation",
    "design a contact with optax",
    "differentiate a result with respect to all parameters",
    "compute a fretting cycle with stick and slip",
    "define several layers, or a graded layer",
    "press a rubber-covered roller",
    "compute a contact whose surfaces are both coated",
    "press a film or a metal that yields, with permanent dents",
    "write a law of growth or wear",
    "simulate a film that grows",
    "use a gradient in scipy, or in a program without jax",
    "find out which contact model a force curve needs: Hertz, DMT or JKR",
    "write a law of adhesion",
    "compute the energy lost in a cycle",
    "find out why a run does not converge",
    "press first and slide afterwards",
    "run many cases in one call",
)


@pytest.mark.slow
@pytest.mark.parametrize(
    "heading", [pytest.param(h, marks=pytest.mark.long if h in DEAR else ()) for h in RECIPES]
)
def test_a_recipe_runs_without_a_warning_and_prints_what_the_page_shows(heading, here, capsys):
    """The words are equal, and the numbers within 1e-3: compilers and processors round differently."""
    exec(SETUP + RECIPES[heading], {"__name__": "__main__"})
    assert_printed_as_shown(recipes_page.shown(capsys.readouterr().out), OUTPUTS[heading])


@pytest.mark.slow
def test_the_first_page_runs(here, capsys):
    page = (DOCS / "start.md").read_text()
    exec("\n".join(BLOCK.findall(page)), {"__name__": "__main__"})
    out = capsys.readouterr().out
    assert "13 converged" in out and "REJECTED" not in out and "not determined" not in out
    assert_printed_as_shown(out, "\n".join(OUTPUT.findall(page)))


def test_every_equation_of_the_pages_stands_in_a_docstring():
    sources = [*(ROOT / "jaxcontact").rglob("*.py"), *(ROOT / "fitting").rglob("*.py")]
    text = "\n".join(" ".join(path.read_text().split()) for path in sources)
    assert len(EQUATIONS) > 15 and not [key for key in EQUATIONS if key not in text]


def test_formulas_of_the_pages_are_read_as_they_are_meant():
    r"""The converter to MathML reads ``\frac12 x`` as 12 over x, and sets the subscript of a dotted letter below it."""
    sources = [*DOCS.glob("*.md"), DOCS / "equations.py", *(ROOT / "notebooks").glob("*.ipynb")]
    misread = re.compile(r"\\[dt]?frac\d|\\d?dot *\{?\\*[a-zA-Z]+\}?_")
    found = [(path.name, text) for path in sources for text in misread.findall(path.read_text())]
    assert not found


def test_every_test_that_verification_names_is_there():
    page = (DOCS / "verification.md").read_text()
    named = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", page)
    assert len(named) > 20 and len(named) == page.count("::test_")
    for file, test in named:
        assert f"def {test}(" in (ROOT / file).read_text(), test
    for path in re.findall(r"`(tests/[\w/]+\.py)`", page):
        assert (ROOT / path).is_file(), path


TERMS = """Hertz contact, sphere on flat, spherical indenter, conical indenter, line contact, edge effect, contact stiffness,
von Mises stress, rough surface, real contact area, Persson, Greenwood Williamson, adhesion, JKR, contact angle, capillary,
van der Waals, surface energy, friction coefficient, fretting wear, stick slip, rolling resistance, wear rate, pin on disc,
tribofilm, ZDDP, thin film, multilayer coating, DLC, hydrogel, nanoindentation, Oliver Pharr, creep compliance, loss tangent,
glass transition, plasticity, lubrication, flash temperature, damping, poroelastic"""


def test_a_page_answers_each_term_that_a_tribologist_types():
    """As the search of the site does: all words of the term on one page."""
    pages = [path.read_text().casefold() for path in DOCS.glob("*.md")]
    terms = [term.split() for term in TERMS.casefold().replace("\n", " ").split(", ")]
    assert [term for term in terms if not any(all(word in page for word in term) for page in pages)] == []


@pytest.mark.parametrize("module", [jc, fitting], ids=lambda module: module.__name__)
def test_every_public_name_has_its_place_in_the_reference(module):
    pages = [path.read_text() for path in (DOCS / "api").glob("*.rst")]
    pages = [page for page in pages if f".. currentmodule:: {module.__name__}\n" in page]
    named = re.findall(r"^\.\. auto(?:class|function):: (\w+)$", "\n".join(pages), re.MULTILINE)
    assert sorted(named) == sorted(module.__all__)


@pytest.mark.long
def test_the_site_builds_without_warnings(tmp_path):
    """By the command of the developers' page, but into another folder, and with stored outputs of recipes, which have tests
    of their own."""
    pytest.importorskip("furo", reason="the site is the extra jaxcontact[docs]")
    words = re.search(r"^python -m (sphinx .*?) site ", (DOCS / "developers.md").read_text(), re.MULTILINE)[1]
    command = [sys.executable, "-m", *words.split(), "-tstored", "-d", tmp_path / "trees", tmp_path / "site"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    material = (tmp_path / "site" / "api" / "materials.html").read_text()
    assert 'id="jaxcontact.Burgers.creep"' in material  # inherited
    assert not [path for path in (tmp_path / "site" / "api").glob("*.html") if "_jax." in path.read_text()]
    pages = {path.stem for path in (ROOT / "notebooks").glob("*.ipynb")}
    assert pages == {path.stem for path in (tmp_path / "site" / "notebooks").glob("*.html")}
