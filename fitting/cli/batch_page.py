"""HTML report of a batch: a table of all fits, a small plot of each, and the files that failed."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from fitting.views import report

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1b1f24; max-width: 64rem; margin: 1.5rem auto; padding: 0 1rem }
h1 { font-size: 1.5rem; line-height: 1.25 } h2 { font-size: 1.15rem; margin-top: 2.2rem }
table { border-collapse: collapse; width: 100%; font-size: .87rem; font-variant-numeric: tabular-nums }
th, td { padding: .35rem .6rem; text-align: left; border-bottom: 1px solid #d8dee4; vertical-align: top }
th { background: #f4f6f8 } td, li, figcaption { overflow-wrap: anywhere } small { color: #57606a; display: block }
span.accepted { color: #0b5394; font-weight: 600 } span.rejected, .failed { color: #9a3412; font-weight: 600 }
.many { display: grid; grid-template-columns: repeat(auto-fill, minmax(11rem, 1fr)); gap: 1rem }
figure { margin: 0 } svg { width: 100%; height: auto; border: 1px solid #d8dee4 } figcaption { font-size: .85rem }
text { font: 9px system-ui, sans-serif; fill: #57606a } circle { fill: #57606a; opacity: .6 }
polyline { fill: none; stroke: #0b5394; stroke-width: 1.6 } .rejected polyline { stroke: #9a3412 }
@media (max-width: 40rem) {
  thead { display: none } tr { display: block; padding: .5rem 0; border-bottom: 2px solid #d8dee4 }
  td { display: grid; grid-template-columns: 6rem 1fr; border: 0; padding: .15rem 0 }
  td::before { content: attr(data-of); color: #57606a }
}
"""
WIDTH, HEIGHT, EDGE, FOOT = 200.0, 140.0, 6.0, 14.0  # size of a plot and its margins
MOST = 150  # largest number of plotted points of a curve


def page(model: str, outcomes: Sequence[Any], kind: str = "creep") -> str:
    """Return the HTML page of the outcomes, a sequence of ``batch_command.FileFit``, for curves of a kind."""
    fits = [one for one in outcomes if one.fit is not None]
    failed = [one for one in outcomes if one.fit is None]
    accepted = sum(not one.fit.refused for one in fits)
    over = "over time" if kind != "oscillation" else "over the logarithm of the angular frequency"
    body = [
        f"<h1>{escape(model)} fits of {len(outcomes)} {kind} curves</h1>",
        f"<p>Fits accepted: {accepted}; fits rejected: {len(fits) - accepted}; files that could not be read or fitted:"
        f" {len(failed)}. Intervals are those of the profile likelihood at {100 * fits[0].fit.level:g} %. No parameter is"
        " determined by a rejected fit.</p>",
        *_failures(failed),
        "<h2>Parameters</h2>",
        _table(fits),
        "<h2>Curves</h2>",
        f"<p>Data (dots) and fit (line) {over}; the numbers in the corners are the limits of the axes.</p>",
        f'<div class="many">{"".join(map(_figure, fits))}</div>',
    ]
    head = f"<title>{escape(model)} fits of {len(outcomes)} {kind} curves</title>\n<style>{STYLE}</style>"
    view = '<meta name="viewport" content="width=device-width, initial-scale=1">'
    start = f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n{view}\n{head}\n</head>'
    return f"{start}\n<body>\n" + "\n".join(body) + "\n</body>\n</html>\n"


def _failures(failed: Sequence[Any]) -> list[str]:
    """Return the list of the files without a fit, with the reasons."""
    if not failed:
        return []
    rows = "".join(f"<li>{escape(one.error)}</li>" for one in failed)
    return [f'<h2 class="failed">Not fitted</h2>\n<ul>{rows}</ul>']


def _table(fits: Sequence[Any]) -> str:
    """Return the table of the fits: parameters and verdict of each."""
    structure = fits[0].fit.structure
    names = list(fits[0].fit.values)
    heads = ["file", *(f"{name} [{structure.unit(name)}]" for name in names), "verdict"]
    head = "".join(f"<th>{escape(one)}</th>" for one in heads)
    rows = "\n".join(_row(one, names, heads) for one in fits)
    return f"<table><thead><tr>{head}</tr></thead>\n<tbody>\n{rows}\n</tbody></table>"


def _row(one: Any, names: list[str], heads: list[str]) -> str:
    fit = one.fit
    why = "".join(f"<small>{escape(reason)}</small>" for reason in fit.refused)
    cells = [
        f'<a href="{quote(one.folder)}/fit.png">{escape(one.file)}</a>',
        *(_parameter(fit, name) for name in names),
        f'<span><span class="{fit.verdict}">{fit.verdict}</span>, {report.in_words(fit)}{why}</span>',
    ]
    return "<tr>" + "".join(
        f'<td data-of="{escape(head, quote=True)}">{cell}</td>' for head, cell in zip(heads, cells, strict=True)
    ) + "</tr>"  # fmt: skip


def _parameter(fit: Any, name: str) -> str:
    """Return the value and interval of a parameter, or the interval alone if it is not determined."""
    if name in fit.fixed:
        return f"<span>{fit.values[name]:.4g}<small>held</small></span>"
    between = escape(report.span(*fit.intervals[name]))
    if fit.identified[name]:
        return f"<span>{fit.values[name]:.4g}<small>{between}</small></span>"
    return f"<span>not determined<small>{between}</small></span>"


def _figure(one: Any) -> str:
    """Return a small plot of data and fit of a curve."""
    name, unit, t, measured = one.fit.curve
    some = np.unique(np.linspace(0, t.size - 1, min(t.size, MOST)).round().astype(int))
    low, high = min(0.0, measured.min()), max(measured.max(), one.fit.fitted.max())
    symbol, over = one.fit.abscissa
    at = t if symbol == "t" else np.log(t)
    x = EDGE + (WIDTH - 2 * EDGE) * (at - at.min()) / np.ptp(at)
    place = lambda y: HEIGHT - FOOT - EDGE - (HEIGHT - 2 * FOOT - EDGE) * (y - low) / (high - low)
    data = "".join(f'<circle cx="{x[i]:.1f}" cy="{place(measured)[i]:.1f}" r="1.6"/>' for i in some)
    rows = np.split(some, np.flatnonzero(np.diff(x[some]) < 0) + 1)  # G' and G''
    lines = "".join(
        f'<polyline points="{" ".join(f"{x[i]:.1f},{place(one.fit.fitted)[i]:.1f}" for i in row)}"/>'
        for row in rows
    )
    corners = (
        f'<text x="4" y="11">{high:.3g} {escape(unit)}</text><text x="4" y="{HEIGHT - 4:g}">{low:.3g} at {t[0]:.3g} {over}'
        f'</text><text x="{WIDTH - 4:g}" y="{HEIGHT - 4:g}" text-anchor="end">{t[-1]:.4g} {over}</text>'
    )
    file, verdict = escape(Path(one.file).name, quote=True), one.fit.verdict
    return (
        f'<figure class="{verdict}"><svg viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img"'
        f' aria-label="{escape(name)} of {file}">'
        f"{data}{lines}{corners}</svg>\n"
        f'<figcaption>{file}: <span class="{verdict}">{verdict}</span></figcaption></figure>'
    )
