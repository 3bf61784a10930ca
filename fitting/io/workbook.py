"""Workbooks (.xlsx, .xls, .ods) as text, by the library python-calamine, which is imported on first use."""

import datetime
import importlib
from typing import Any


def as_text(name: str) -> str:
    """Return the rows of all sheets with tabs between cells; the name of each of several sheets stands above it.

    Raises:
        ValueError: python-calamine is not installed, or cannot read the file; the message says what to do.
    """
    try:
        library = importlib.import_module("python_calamine")
    except ImportError:
        raise ValueError(
            f"{name}: a workbook needs python-calamine: pip install 'jaxcontact[workbooks]', or save the sheet as CSV"
        ) from None
    try:
        book = library.CalamineWorkbook.from_path(name)
        sheets = {sheet: book.get_sheet_by_name(sheet).to_python() for sheet in book.sheet_names}
    except Exception as error:  # its errors have no common base
        what = (str(error) or type(error).__name__).splitlines()[0][:200]
        raise ValueError(f"{name}: not a workbook that can be read ({what}): save the sheet as CSV") from None
    filled = {sheet: rows for sheet, rows in sheets.items() if rows}
    parts = ["\n".join("\t".join(map(_cell, row)) for row in rows) for rows in filled.values()]
    if len(parts) > 1:
        parts = [f"[step]\n{sheet}\n{part}" for sheet, part in zip(filled, parts, strict=True)]
    return "\n".join(parts) + "\n"


def _cell(value: Any) -> str:
    """Return a cell as text: numbers in full, times of day and durations as seconds in hh:mm:ss, without line breaks."""
    if isinstance(value, datetime.timedelta):
        minutes, seconds = divmod(value.total_seconds(), 60.0)
        return f"{int(minutes // 60)}:{int(minutes % 60):02d}:{seconds:09.6f}"
    if isinstance(value, datetime.time):
        return f"{value.hour}:{value.minute:02d}:{value.second + 1e-6 * value.microsecond:09.6f}"
    return repr(value) if isinstance(value, float) else " ".join(str(value).split())
