"""The HTML report of the reproductions: self-contained, and nothing is left out of it."""

import html
import json
from html.parser import HTMLParser

import pytest

from jaxcontact.paper import reproduce
from jaxcontact.paper.comparison import Reproduction, Row

VOID = {"meta", "img"}
ROWS = [
    Row("approach < 1 [um]", "paper", 2.0, 2.001, 0.01, "the paper's grid"),
    Row("peak [GPa]", "exact solution", 3.0, 3.3, 0.01, "solver & grid"),
    Row("contact grows", "described in the paper", True, True, reason="yes or no"),
    Row("strain [-]", "-", None, 0.4, reason="no reference"),
]


def draw(found, directory):
    (directory / "picture.png").write_bytes(b"a picture")


def case(name, rows):
    return Reproduction(
        name, f"Fig. {name[-1]} <here>", {}, lambda n: None, lambda *_: rows, draw, ("a remark",)
    )


class Page(HTMLParser):
    """Tags that are open, addresses of what would be fetched, and the text of the cells."""

    def __init__(self, text):
        super().__init__()
        self.open, self.sources, self.cells = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)
        self.sources += [value for name, value in attributes if name == "src"]
        if tag == "td":
            self.cells.append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "td" in self.open:
            self.cells[-1] += data


@pytest.fixture
def written(tmp_path, capsys):
    assert reproduce.main([], tmp_path, n=8, cases=[case("figure_2", ROWS[:1]), case("figure_9", ROWS)]) == 1
    return tmp_path


def test_every_comparison_appears_with_its_verdict(written):
    text = (written / "report.html").read_text()
    page = Page(text)
    assert page.open == []
    for path in written.glob("*/summary.json"):
        summary = json.loads(path.read_text())
        assert html.escape(summary["title"]) in text
        for row in summary["rows"]:
            assert page.cells.count(row["quantity"]) == (2 if row["quantity"] == ROWS[0].quantity else 1)
    wanted = [
        "peak [GPa]",
        "exact solution",
        "3",
        "3.3",
        "+10.0000 %",
        "1 %",
        "does NOT hold",
        "solver & grid",
    ]
    start = page.cells.index("peak [GPa]")
    assert page.cells[start : start + 8] == wanted
    assert '<span class="no">4</span> of 5 comparisons hold' not in text
    assert '<span class="no">3</span> of 4 comparisons hold' in text


def test_pictures_are_inside_the_file(written):
    sources = Page((written / "report.html").read_text()).sources
    assert len(sources) == 2
    assert all(source == "data:image/png;base64,YSBwaWN0dXJl" for source in sources)


def test_a_later_run_of_one_case_keeps_the_others_in_the_report(written, capsys):
    reproduce.main([], written, n=8, cases=[case("figure_10", ROWS[:1])])
    text = (written / "report.html").read_text()
    places = [text.index(f'<h2 id="{name}">') for name in ("figure_2", "figure_9", "figure_10")]
    assert places == sorted(places)
    assert "All 5" not in text and reproduce.COLUMNS[0] in text
