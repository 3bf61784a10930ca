"""Text of a file as numbered lines, for various encodings."""

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from fitting.io import workbook
from fitting.io.names import LOOKUP

PACKED = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"\x1f\x8b")  # xlsx and ods, xls, gz
WORKBOOK, SHEETS = PACKED[:2], (".xlsx", ".xlsm", ".xls", ".xlsb", ".ods")
# first characters of HTML, XML, JSON, RTF and PDF; a line in angle brackets without a closing tag ("<Mach-1 File>") is text
MARKUP = re.compile(r"<[?!]|<(?=[\s\S]*?(?:</|/>))|[{]|\[\s*[\[{]|%PDF")
INVISIBLE = str.maketrans("", "", "\ufeff\u200b")  # byte-order marks within joined files, zero-width spaces
OPEN = re.compile(r'(?:^|[,;\t])\s*"[^"]*$')  # a quoted cell that continues on the next line
LONGEST = 4  # largest number of lines of such a cell
JAPANESE = tuple(name for name in LOOKUP if len(name) > 1 and min(name) > "\u3000")
REMARK = re.compile(r"\s*(#+|//+|%+(?=\s*\w))\s?")


class Line(NamedTuple):
    """A line of a file: number, from 1; text, without a comment mark; remark: whether it had one."""

    number: int
    text: str
    remark: bool


def read_lines(path: str | os.PathLike) -> list[Line]:
    """Return the lines that are not blank; a line that begins with #, // or % is a remark.

    Raises:
        ValueError: no such file, not text, or nothing in it.
    """
    name = os.fspath(path)
    whole = decode(name).translate(INVISIBLE)
    if MARKUP.match(whole.lstrip()):
        raise ValueError(
            f"{name}: expected rows of numbers, got {whole.strip()[:12]!r}: save the table as CSV"
        )
    found = [_line(number, text) for number, text in _joined(whole.splitlines()) if text.strip(" \t\r\n,;")]
    if not any(line.text.strip() and not line.remark for line in found):
        raise ValueError(f"{name}: expected a table, got an empty file")
    return found


def _joined(texts: list[str]) -> Iterator[tuple[int, str]]:
    """Yield numbers and texts of lines, joining those within a quoted cell ("Time" over "(s)" in a workbook)."""
    k = 0
    while k < len(texts):
        size = 1
        if OPEN.search(texts[k]):
            size = next((n for n in range(2, LONGEST + 1) if _closed(texts[k : k + n])), 1)
        yield k + 1, " ".join(texts[k : k + size])
        k += size


def _closed(texts: list[str]) -> bool:
    """Return whether every quoted cell ends within these lines."""
    whole = " ".join(texts)
    return whole.count('"') % 2 == 0 and not OPEN.search(whole)


def _line(number: int, text: str) -> Line:
    mark = REMARK.match(text)
    return Line(number, text[mark.end() :] if mark else text, bool(mark))


def decode(name: str) -> str:
    """Return the text of a file in UTF-8 or UTF-16, with or without byte-order mark, else in Shift JIS where it has names
    of columns in Japanese, else in Latin-1."""
    try:
        raw = Path(name).read_bytes()
    except OSError as error:
        raise ValueError(f"{name}: cannot be read: {error.strerror}") from None
    if raw.startswith(WORKBOOK) and name.lower().endswith(SHEETS):
        return workbook.as_text(name)
    if raw.startswith(PACKED):
        raise ValueError(f"{name}: expected text, got binary data (a workbook or an archive): save a CSV")
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16", errors="replace")
    if raw and raw[1::2].count(0) > 0.8 * len(raw[1::2]):
        return raw.decode("utf-16-le", errors="replace")
    if b"\0" in raw:
        raise ValueError(f"{name}: expected text, got binary data: export it as text or CSV")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return _japanese(raw) or raw.decode("latin-1")


def _japanese(raw: bytes) -> str | None:
    """Return the text in Shift JIS, None where it is in another encoding."""
    try:
        text = raw.decode("cp932")
    except UnicodeDecodeError:
        return None
    return text if any(name in text for name in JAPANESE) else None
