"""The report of the reproductions: a single HTML file, with embedded pictures, of all cases in a directory."""

import base64
import json
import re
from html import escape
from pathlib import Path
from typing import Any

from jaxcontact._support.npz import write_whole
from jaxcontact._support.version import __version__

PAPER = (
    "Wang, Ghanbarzadeh, Xu, Liu and de Boer, <i>Time-Dependent Contact Behaviour of ZDDP-Derived Tribofilms:"
    " A Viscoelastic Layered Model Approach</i>, Tribology Letters 2025,"
    ' <a href="https://doi.org/10.1007/s11249-025-01990-5">doi 10.1007/s11249-025-01990-5</a>'
)
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1b1f24; max-width: 62rem; margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.7rem; line-height: 1.2 } h2 { margin-top: 3rem; border-bottom: 1px solid #d0d7de }
table { border-collapse: collapse; width: 100%; font-size: .86rem; font-variant-numeric: tabular-nums }
th, td { padding: .3rem .6rem; text-align: left; border-bottom: 1px solid #e4e8ec; vertical-align: top }
th { background: #f4f6f8 } td.number { text-align: right; white-space: nowrap }
img { display: block; max-width: 100%; margin: 1rem auto } .scroll { overflow-x: auto }
.yes { color: #0b5394; font-weight: 600 } .no { background: #b45309; color: #fff; padding: 0 .4em; font-weight: 600 }
.remark, footer { color: #57606a; font-size: .9rem }
"""
PAGE = "report.html"
COLUMNS = (
    "quantity",
    "reference",
    "expected",
    "computed",
    "difference",
    "tolerance",
    "verdict",
    "why this tolerance",
)


def write(directory: Path) -> Path:
    """Write directory/report.html from every NAME/summary.json and picture below it, and return its path."""
    cases = [read(path.parent) for path in summaries(directory)]
    cases.sort(key=lambda case: [int(part) for part in re.findall(r"\d+", case["case"])])
    path = directory / PAGE
    write_whole(path, lambda partial: partial.write_text(page(cases), encoding="utf-8"))
    return path


def summaries(directory: Path) -> list[Path]:
    """Return the files from which the report of a directory is made."""
    return sorted(directory.glob("*/summary.json"))


def is_case_summary(summary: Path) -> bool:
    """Return whether a file is the summary of a reproduced case, and not that of another run."""
    try:
        found = json.loads(summary.read_text(encoding="utf-8"))
        return {"case", "title", "cells_per_side", "duration [s]", "holds", "rows", "remarks"} <= found.keys()
    except (ValueError, AttributeError):
        return False


def read(folder: Path) -> dict[str, Any]:
    """Return the summary of one case, with its pictures as data URLs."""
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    images = [base64.b64encode(path.read_bytes()).decode("ascii") for path in sorted(folder.glob("*.png"))]
    return summary | {"images": [f"data:image/png;base64,{image}" for image in images]}


def page(cases: list[dict[str, Any]]) -> str:
    """Return the HTML page."""
    rows = [row for case in cases for row in case["rows"] if row["expected"] is not None]
    held, seconds = sum(row["holds"] for row in rows), sum(case["duration [s]"] for case in cases)
    verdict = "All" if held == len(rows) else f'<span class="no">{held}</span> of'
    body = "\n".join(
        [
            "<h1>The paper, figure by figure</h1>",
            f"<p>{verdict} {len(rows)} comparisons hold. {len(cases)} cases, {seconds:.0f} s in all.</p>",
            f"<p>All results are computed with jaxcontact {__version__} and compared with {PAPER}, and with"
            " independent solutions that share no code with it. The paper's figures are curves without data, so where"
            " it prints no number the reference is an exact solution, or the shape that it describes.</p>",
            _overview(cases),
            *map(_section, cases),
            "<footer><p>Made by <code>jaxcontact reproduce</code>. The difference is computed/expected - 1;"
            " a row without an expected value is given for information only.</p></footer>",
        ]
    )
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>jaxcontact: the paper, figure'
        f" by figure</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def _overview(cases: list[dict[str, Any]]) -> str:
    """Return a table with one line for each case."""
    lines = []
    for case in cases:
        compared = [row for row in case["rows"] if row["expected"] is not None]
        link = f'<a href="#{escape(case["case"])}">{escape(case["title"])}</a>'
        held = f"{sum(row['holds'] for row in compared)} of {len(compared)}"
        lines.append(
            (
                link,
                str(case["cells_per_side"]),
                f"{case['duration [s]']:.1f} s",
                held,
                _verdict(case["holds"]),
            )
        )
    return _table(("case", "cells a side", "time taken", "comparisons that hold", "verdict"), lines)


def _section(case: dict[str, Any]) -> str:
    """Return pictures, comparisons and remarks of one case."""
    title = escape(case["title"])
    images = [f'<img src="{image}" alt="{title}">' for image in case["images"]]
    remarks = [f'<p class="remark">{escape(remark)}</p>' for remark in case["remarks"]]
    table = _table(COLUMNS, [_cells(row) for row in case["rows"]])
    taken = f"<p>{case['cells_per_side']} x {case['cells_per_side']} cells, {case['duration [s]']:.1f} s.</p>"
    return "\n".join([f'<h2 id="{escape(case["case"])}">{title}</h2>', *images, taken, table, *remarks])


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    difference, tolerance = row["relative_difference"], row["relative_tolerance"]
    return (
        escape(row["quantity"]),
        escape(row["source"]),
        _value(row["expected"]),
        _value(row["found"]),
        "-" if difference is None else f"{100.0 * difference:+.4f} %",
        "-" if tolerance is None else f"{100.0 * tolerance:.3g} %",
        "-" if row["expected"] is None else _verdict(row["holds"]),
        escape(row["reason"]),
    )


def _value(value: float | bool | None) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}"


def _verdict(holds: bool) -> str:
    return '<span class="yes">holds</span>' if holds else '<span class="no">does NOT hold</span>'


def _table(head: tuple[str, ...], lines: list[tuple[str, ...]]) -> str:
    """Return a table of cells that are already HTML, with numbers aligned to the right."""
    number = re.compile(r"[-+]?[\d.]+(e[-+]\d+)?( %| s)?$")
    rows = [
        "<tr>"
        + "".join(f"<td{' class=number' if number.match(cell) else ''}>{cell}</td>" for cell in line)
        + "</tr>"
        for line in lines
    ]
    names = "<tr>" + "".join(f"<th>{name}</th>" for name in head) + "</tr>"
    return "\n".join(['<div class="scroll"><table>', names, *rows, "</table></div>"])
