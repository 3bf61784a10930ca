"""Cells of a line and the numbers in them, in several dialects of delimited text."""

import csv
import math
import re
from typing import NamedTuple

from fitting.io.text import Line

MISSING = {"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "---", "*"}
SAMPLE = 400  # number of lines that determine the dialect
_DIGITS = {".": r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)", ",": r"(?:[0-9]+,?[0-9]*|,[0-9]+)"}
PLAIN = {mark: re.compile(rf"[+-]?{digits}(?:[eEdD][+-]?[0-9]+)?") for mark, digits in _DIGITS.items()}
GROUPED = {
    ".": re.compile(r"[+-]?[1-9][0-9]{0,2}(?:[,'’][0-9]{3})+(?:\.[0-9]*)?"),
    ",": re.compile(r"[+-]?[1-9][0-9]{0,2}(?:[.'’][0-9]{3})+(?:,[0-9]*)?"),
}
CLOCK = re.compile(r"([0-9]{1,4}):([0-5][0-9]):([0-5][0-9](?:[.,][0-9]+)?)")  # hours, minutes, seconds
INFINITE = re.compile(r"([+-]?)inf(?:inity)?", re.IGNORECASE)
EXPONENT = str.maketrans("dD", "ee")
POINT = str.maketrans("dD,", "ee.")
SPACES = re.compile(r"(?<=[0-9])[\u00a0\u202f\u2009](?=[0-9]{3})")  # spaces between groups of three digits


class Dialect(NamedTuple):
    """Dialect of delimited text: separator of cells, None for any white space; decimal mark, "." or ","."""

    separator: str | None
    decimal: str


def split(text: str, separator: str | None) -> list[str]:
    """Return the cells of a line, stripped; a separator within quotes is text."""
    text = text.strip("\r\n ")
    if separator is None:
        return text.split()
    if '"' not in text:
        return [cell.strip() for cell in text.split(separator)]
    cells = next(csv.reader([text], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip().strip('"') for cell in cells]


def number(cell: str, decimal: str) -> float | None:
    """Return the number in a cell, or None; digits may be grouped by three: "1.512,8" is 1512.8 if "," is the mark.

    A time as hh:mm:ss is a number of seconds.
    """
    clock = CLOCK.fullmatch(cell)
    if clock:
        hours, minutes, seconds = clock.groups()
        return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds.replace(",", "."))
    if not PLAIN[decimal].fullmatch(cell):
        cell = SPACES.sub("", cell.replace("−", "-"))
        if GROUPED[decimal].fullmatch(cell):
            cell = re.sub(rf"['’{'.' if decimal == ',' else ','}]", "", cell)
        elif INFINITE.fullmatch(cell):
            return float(cell)
        elif not PLAIN[decimal].fullmatch(cell):
            return None
    return float(cell.translate(POINT if decimal == "," else EXPONENT))


def is_missing(cell: str) -> bool:
    """Return whether a cell holds no value."""
    return cell.lower() in MISSING


def is_data(row: list[str], decimal: str) -> bool:
    """Return whether a row has two numbers and fewer words, or one number beside missing cells.

    A clock time counts as a number in the first cell alone, since a date has one among its words.
    """
    numbers = sum(
        number(cell, decimal) is not None and (k == 0 or not CLOCK.fullmatch(cell))
        for k, cell in enumerate(row)
    )
    missing = sum(map(is_missing, row))
    words = len(row) - numbers - missing
    if numbers < 2 or any(cell.endswith(":") for cell in row):
        return numbers == 1 and len(row) == 1 + missing > 1
    return words < numbers or (words == numbers and number(row[0], decimal) is not None)


def choose(path: str, lines: list[Line], decimal: str | None) -> Dialect:
    """Return the dialect in which most lines are rows of numbers, and most cells numbers.

    Raises:
        ValueError: no rows of numbers, or an ambiguous decimal mark.
    """
    plain = [line.text for line in lines if not line.remark]
    sample = plain[:: math.ceil(len(plain) / SAMPLE)]
    marks = (decimal,) if decimal else (".", ",")
    ranked = {Dialect(s, mark): _score(sample, s, mark) for s in ("\t", ";", ",", None) for mark in marks}
    best = max(ranked, key=lambda dialect: ranked[dialect])
    if ranked[best][0] == 0:
        what = (
            "expected rows of at least two numbers (no dates) between commas, semicolons, tabs or blanks,"
            " got none: save the table as CSV"
        )
        raise ValueError(f"{path}: line {lines[-1].number}: {what}")
    twin = Dialect(best.separator, "," if best.decimal == "." else ".")
    if ranked.get(twin, ())[:2] == ranked[best][:2] and _doubtful(sample, best, ranked[best], ranked[twin]):
        raise ValueError(
            f"{path}: expected one decimal mark, got numbers that read both ways: give decimal='.' or ','"
        )
    return best


def _score(sample: list[str], separator: str | None, decimal: str) -> tuple[int, float, int]:
    """Return (rows of numbers, fraction of their cells that are numbers or missing, minus grouped numbers)."""
    rows = [row for row in (split(text, separator) for text in sample) if is_data(row, decimal)]
    cells = [cell for row in rows for cell in row]
    fine = sum(is_missing(cell) or number(cell, decimal) is not None for cell in cells)
    grouped = sum(bool(GROUPED[decimal].fullmatch(cell)) for cell in cells)
    return len(rows), round(fine / max(len(cells), 1), 6), -grouped


def _doubtful(sample: list[str], best: Dialect, score: tuple, other: tuple) -> bool:
    """Return whether numbers that the other mark reads as groups of three digits are ambiguous.

    They are not where every number of a column has the mark, as all would be whole thousands.
    """
    if not (score[2] or other[2]):
        return False
    rows = [row for row in (split(text, best.separator) for text in sample) if is_data(row, best.decimal)]
    marked = [{best.decimal in cell for cell in column} for column in zip(*rows, strict=False)]
    return bool(score[2]) or best.separator == best.decimal or {True, False} in marked
