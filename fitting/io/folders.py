"""The files of a folder that may hold curves."""

import itertools
from pathlib import Path

from fitting.io import afm
from fitting.io.cells import is_data, split
from fitting.io.nanoscope import IMAGE, first_line
from fitting.io.text import SHEETS, read_lines

ROWS = 2  # rows of numbers from which a text may be a curve
DIALECTS = tuple(itertools.product((None, ",", ";", "\t"), ".,"))
SHOWN = 5  # names of files in a note


def curves_in(folder: str) -> tuple[list[str], str]:
    """Return the files of a folder that may hold curves, by name, and a note on the others, "" if there are none.

    Raises:
        ValueError: no file that may hold a curve.
    """
    inside = sorted(one for one in Path(folder).iterdir() if one.is_file() and not one.name.startswith("."))
    found = [one for one in inside if may_hold_a_curve(one)]
    others = [one.name for one in inside if one not in found]
    shown = ", ".join(others[:SHOWN]) + (", ..." if len(others) > SHOWN else "")
    if not found:
        raise ValueError(f"{folder}: expected a folder with files of curves, got {shown or 'an empty one'}")
    what = "files without rows of numbers, and images, left out"
    return list(
        map(str, found)
    ), f"{folder}: {len(others)} of {len(inside)} {what}: {shown}" if others else ""


def may_hold_a_curve(path: Path) -> bool:
    """Return whether a file is a force curve of a microscope, a workbook, or text with rows of numbers."""
    if first_line(str(path)).startswith(IMAGE):
        return False
    if afm.is_force_curve(path) or path.suffix.lower() in SHEETS:
        return True
    try:
        lines = read_lines(path)
    except ValueError:  # not text, or of another kind
        return False
    rows = (line for line in lines if any(is_data(split(line.text, mark), point) for mark, point in DIALECTS))
    return len(list(itertools.islice(rows, ROWS))) == ROWS
