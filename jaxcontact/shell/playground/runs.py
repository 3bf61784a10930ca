"""The runs that the page asks for, one at a time."""

import functools
import threading
from collections.abc import Callable
from typing import Any, TypeAlias

from jaxcontact.shell.playground.presets import PRESETS

Answer: TypeAlias = dict[str, Any]  # in JSON's types
Solver: TypeAlias = Callable[[str, tuple[float, ...]], Answer]  # from a preset and its values in their order


class Runs:
    """Runs of a solver, one at a time.

    stage: what a request waits for, "compiling" or "computing".
    """

    def __init__(self, solver: Solver) -> None:
        self.stage = "compiling"
        self._solver = functools.lru_cache(solver)
        self._one_at_a_time = threading.Lock()
        self._compiled: set[str] = set()

    def answer(self, name: str, values: dict[str, float]) -> Answer:
        """Return the solver's answer for values of a preset; it may raise ValueError."""
        indenter = PRESETS[name].indenter
        with self._one_at_a_time:
            self.stage = "computing" if indenter in self._compiled else "compiling"
            answer = self._solver(name, tuple(values.values()))
            self._compiled.add(indenter)
        return answer
