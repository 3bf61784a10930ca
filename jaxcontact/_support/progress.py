"""Progress on a terminal from the first second; where the stream is none (``disable=None``), silent.

The first steps wait for a program to be compiled: until they are there the bar says so, and its rate and the time
that is left begin with the steps after them.
"""

from types import TracebackType
from typing import Any, Self, TextIO

from tqdm import tqdm


def working(what: str, file: TextIO | None = None) -> Any:
    """A line that says what is going on, for as long as it does: a context manager."""
    return tqdm(desc=what, bar_format="{desc} ...", file=file, disable=None, leave=False)


class Progress:
    """A bar on stderr over ``total`` of a unit, of which ``done`` were there before; a context manager."""

    def __init__(self, total: int, unit: str, done: int = 0, file: TextIO | None = None) -> None:
        self._options = {"total": total, "unit": unit, "file": file, "disable": None, "leave": False}
        self._done, self._bar = done, tqdm(desc="compiling", initial=done, **self._options)
        self._compiling = True

    def advance(self, count: int) -> None:
        """So many more are done."""
        self._done += count
        if self._compiling:
            self._compiling = False
            self._bar.close()
            self._bar = tqdm(initial=self._done, **self._options)
        else:
            self._bar.update(count)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.close()
