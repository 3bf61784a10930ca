"""The command ``jaxcontact reproduce [NAME ...] -o DIR``: run the cases, print and write the results.

The exit status is 0 if every row of every case holds, 1 if one does not, 2 if a case cannot be run.
"""

import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jaxcontact._support.npz import write_whole
from jaxcontact._support.progress import working
from jaxcontact.paper import (
    claims,
    figure_4,
    figure_6,
    figure_9,
    figure_10,
    figure_11,
    figure_12,
    figure_13,
    figure_14,
    figure_15,
    report,
    speed_map,
)
from jaxcontact.paper.comparison import Reproduction, Row, as_dict, table

CASES: tuple[Reproduction, ...] = (
    figure_4.CASE,
    figure_6.CASE,
    figure_9.CASE,
    figure_10.CASE,
    figure_11.CASE,
    figure_12.CASE,
    figure_13.CASE,
    figure_14.CASE,
    figure_15.CASE,
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
    for summary in report.summaries(Path(directory)):
        if not report.is_case_summary(summary):
            return _reject(
                f"{summary} is not the summary of a reproduction; choose another directory for its report"
            )
    page = Path(directory) / report.PAGE
    if page.exists() and not report.summaries(Path(directory)) and not force:
        return _reject(f"{page} already exists; choose another directory, or use --force")
    holds = [run(case, Path(directory), n) for case in chosen]
    print(f"\n{report.write(Path(directory))}")
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
    print(f"  {_verdict(rows)}", flush=True)
    folder = directory / case.name
    folder.mkdir(parents=True, exist_ok=True)
    case.draw(simulated, folder)
    text = json.dumps(_summary(case, rows, n, seconds), indent=2) + "\n"
    write_whole(folder / "summary.json", lambda partial: partial.write_text(text, encoding="utf-8"))
    return holds


def _verdict(rows: list[Row]) -> str:
    failed = sum(not row.holds for row in rows)
    compared = sum(row.expected is not None for row in rows)
    return (
        f"All {compared} comparisons hold."
        if not failed
        else f"{failed} of {compared} comparisons do NOT hold."
    )


def _summary(case: Reproduction, rows: list[Row], n: int, seconds: float) -> dict[str, Any]:
    return {
        "case": case.name,
        "title": case.title,
        "cells_per_side": n,
        "duration [s]": round(seconds, 3),
        "holds": all(row.holds for row in rows),
        "rows": [as_dict(row) for row in rows],
        "remarks": list(case.remarks),
    }
