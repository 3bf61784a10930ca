"""A caption that states what a case computes, placed below each picture of its run."""

import textwrap
from typing import Any

import numpy as np

from jaxcontact._support.fields import FIELDS
from jaxcontact._support.prefixes import prefixed
from jaxcontact.files.case_file import Case
from jaxcontact.files.case_schema import KINDS
from jaxcontact.files.case_tables import tables_named

CONTROLS = ("load", "approach", "tangential_load", "tangential_displacement")
LETTERS = 17.0  # letters per inch at the size below
SIZE, SHADE = (
    7.0,
    "0.45",
)  # size of the letters in points, and a grey that is legible on white and on dark pages


def caption_of(case: Case) -> str:
    """Return a caption such as "sphere of 500 µm on burgers, 5 µm, on elastic; load 5 mN; to 3600 s; 128 x 128 cells"."""
    tables = case.tables
    indenter = tables["indenter"]
    radius = f" of {_amount(indenter['radius'], 'm')}" if "radius" in indenter else ""
    layers = [
        f"{table['material']}, {_amount(table['thickness'], 'm')}"
        for _, table in tables_named("layer", tables)
    ]
    body = ", on ".join([*layers, tables["substrate"]["material"]])
    controls = [
        f"{name.replace('_', ' ')} {_amount(tables['control'][name], FIELDS[name].unit)}"
        for name in CONTROLS
        if name in tables["control"]
    ]
    velocity = tables.get("experiment", {}).get("velocity")
    motion = [] if velocity is None else [f"velocity {_amount(velocity, 'm/s')}"]
    duration = "steady" if KINDS[case.kind].times is None else f"to {case.times[-1]:g} s"
    cells = "{} x {} cells".format(*case.grid.shape)
    return "; ".join([f"{indenter['shape']}{radius} on {body}", *controls, *motion, duration, cells])


def write_under(figure: Any, caption: str) -> None:
    """Write the caption at the foot of a figure, in as many lines as its width requires."""
    lines = textwrap.fill(caption, int(LETTERS * figure.get_figwidth()))
    figure.supxlabel(lines, fontsize=SIZE, color=SHADE)


def _amount(value: Any, unit: str) -> str:
    """Return one number with an SI prefix, several numbers by their range, and text (a file name) unchanged."""
    if isinstance(value, str):
        return value
    low, high = float(np.min(value)), float(np.max(value))
    return prefixed(high, unit) if low == high else f"{prefixed(low, unit)} to {prefixed(high, unit)}"
