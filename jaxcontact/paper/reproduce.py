"""The command ``jaxcontact reproduce [NAME ...] -o DIR``: run the cases, print and write the results.

The exit status is 0 if every row of every case holds, 1 if one does not, 2 if a case cannot be run.
"""

import base64
import json
import re
import sys
import time
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from jaxcontact._support.files import write_whole
from jaxcontact._support.terminal import working
from jaxcontact._support.version import __version__
from jaxcontact.paper import claims, figure_4, figure_6, sliding, speed_map, tribofilm
from jaxcontact.paper.comparison import Reproduction, as_dict, table, value_as_text

# The report of the reproductions: a single HTML file, with embedded pictures, of all cases in a directory.


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
                _verdict_cell(case["holds"]),
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
        value_as_text(row["expected"]),
        value_as_text(row["found"]),
        "-" if difference is None else f"{100.0 * difference:+.4f} %",
        "-" if tolerance is None else f"{100.0 * tolerance:.3g} %",
        "-" if row["expected"] is None else _verdict_cell(row["holds"]),
        escape(row["reason"]),
    )


def _verdict_cell(holds: bool) -> str:
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


CASES: tuple[Reproduction, ...] = (
    figure_4.CASE,
    figure_6.CASE,
    tribofilm.FIGURE_9,
    tribofilm.FIGURE_10,
    tribofilm.FIGURE_11,
    tribofilm.FIGURE_12,
    sliding.FIGURE_13,
    sliding.FIGURE_14,
    sliding.FIGURE_15,
    speed_map.CASE,
    claims.CASE,
)
N = 256  # cells along each side, as in the paper


def main(
    names: Sequence[str],
    directory: Path,
    *,
    force: bool = False,
    n: int = N,
    cases: Sequence[Reproduction] = CASES,
) -> int:
    """Run the named cases, or all; each writes directory/NAME/summary.json and its picture.

    directory/report.html is rewritten from all the cases in the directory.
    """
    known = {case.name: case for case in cases}
    unknown = [name for name in names if name not in known]
    if unknown:
        return _reject(f"unknown case {unknown[0]!r}; expected one of {', '.join(known)}")
    chosen = [known[name] for name in names] or list(cases)
    for case in chosen:
        summary = Path(directory) / case.name / "summary.json"
        if summary.exists() and not force:
            return _reject(f"{summary} already exists; choose another directory, or use --force")
    for summary in summaries(Path(directory)):
        if not is_case_summary(summary):
            return _reject(
                f"{summary} is not the summary of a reproduction; choose another directory for its report"
            )
    page = Path(directory) / PAGE
    if page.exists() and not summaries(Path(directory)) and not force:
        return _reject(f"{page} already exists; choose another directory, or use --force")
    holds = [run(case, Path(directory), n) for case in chosen]
    print(f"\n{write(Path(directory))}")
    return 0 if all(holds) else 1


def _reject(reason: str) -> int:
    print(f"jaxcontact reproduce: {reason}", file=sys.stderr)
    return 2


def run(case: Reproduction, directory: Path, n: int = N) -> bool:
    """Run one case and write its results; return True if every row holds."""
    began = time.perf_counter()
    with working(f"{case.name}: compiling and running"):
        simulated = case.simulate(n)
    rows = case.compare(simulated, case.references)
    seconds = time.perf_counter() - began
    holds = all(row.holds for row in rows)
    print(f"\n{case.title} ({case.name}, N = {n}, {seconds:.1f} s)\n\n{table(rows)}\n")
    for remark in case.remarks:
        print(f"  {remark}")
    compared, failed = sum(row.expected is not None for row in rows), sum(not row.holds for row in rows)
    verdict = (
        f"{failed} of {compared} comparisons do NOT hold." if failed else f"All {compared} comparisons hold."
    )
    print(f"  {verdict}", flush=True)
    folder = directory / case.name
    folder.mkdir(parents=True, exist_ok=True)
    case.draw(simulated, folder)
    summary = {
        "case": case.name,
        "title": case.title,
        "cells_per_side": n,
        "duration [s]": round(seconds, 3),
        "holds": holds,
        "rows": [as_dict(row) for row in rows],
        "remarks": list(case.remarks),
    }
    text = json.dumps(summary, indent=2) + "\n"
    write_whole(folder / "summary.json", lambda partial: partial.write_text(text, encoding="utf-8"))
    return holds
