"""Progress bars on a terminal, silent if the stream is not one (``disable=None``).

The first steps include compilation: until they are done the bar reads "compiling", and its rate and remaining time are
measured from the steps after them.
"""

from types import TracebackType
from typing import Any, Self, TextIO

from tqdm import tqdm


def working(what: str, file: TextIO | None = None) -> Any:
    """Show a line that describes the work in progress; a context manager."""
    return tqdm(desc=what, bar_format="{desc} ...", file=file, disable=None, leave=False)


class Progress:
    """A progress bar on stderr over ``total`` units, of which ``done`` were done before; a context manager."""

    def __init__(self, total: int, unit: str, done: int = 0, file: TextIO | None = None) -> None:
        self._options = {"total": total, "unit": unit, "file": file, "disable": None, "leave": False}
        self._done, self._bar = done, tqdm(desc="compiling", initial=done, **self._options)
        self._compiling = True

    def advance(self, count: int) -> None:
        """Report that ``count`` more units are done."""
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
