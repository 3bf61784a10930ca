"""What a case computes, in a line that stands under each picture of its run."""

import textwrap
from typing import Any

import numpy as np

from jaxcontact._support.fields import FIELDS
from jaxcontact._support.prefixes import prefixed
from jaxcontact.files.case_file import Case, layer_tables
from jaxcontact.files.case_schema import KINDS

CONTROLS = ("load", "approach", "tangential_load", "tangential_displacement")
LETTERS = 17.0  # that one inch holds, at the size below
SIZE, SHADE = 7.0, "0.45"  # of the letters in points, and their grey: legible on paper and on a dark page


def caption_of(case: Case) -> str:
    """What is computed: "sphere of 500 µm on burgers, 5 µm, on elastic; load 5 mN; to 3600 s; 128 x 128 cells"."""
    tables = case.tables
    indenter = tables["indenter"]
    radius = f" of {_amount(indenter['radius'], 'm')}" if "radius" in indenter else ""
    layers = [f"{table['material']}, {_amount(table['thickness'], 'm')}" for _, table in layer_tables(tables)]
    body = ", on ".join([*layers, tables["substrate"]["material"]])
    pushed = [
        f"{name.replace('_', ' ')} {_amount(tables['control'][name], FIELDS[name].unit)}"
        for name in CONTROLS
        if name in tables["control"]
    ]
    velocity = tables.get("experiment", {}).get("velocity")
    moved = [] if velocity is None else [f"velocity {_amount(velocity, 'm/s')}"]
    course = "steady" if KINDS[case.kind].times is None else f"to {case.times[-1]:g} s"
    cells = "{} x {} cells".format(*case.grid.shape)
    return "; ".join([f"{indenter['shape']}{radius} on {body}", *pushed, *moved, course, cells])


def write_under(figure: Any, caption: str) -> None:
    """The caption at the foot of a figure, in as many lines as its width needs."""
    lines = textwrap.fill(caption, int(LETTERS * figure.get_figwidth()))
    figure.supxlabel(lines, fontsize=SIZE, color=SHADE)


def _amount(value: Any, unit: str) -> str:
    """One number with its unit's prefix, several by their range, text (a file) as it is."""
    if isinstance(value, str):
        return value
    low, high = float(np.min(value)), float(np.max(value))
    return prefixed(high, unit) if low == high else f"{prefixed(low, unit)} to {prefixed(high, unit)}"
