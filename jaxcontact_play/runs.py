"""The runs that the page asks for, which may do so before there is a solver."""

import functools
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeAlias

from jaxcontact_play.presets import PRESETS

Answer: TypeAlias = dict[str, Any]  # in JSON's types
Solver: TypeAlias = Callable[[str, tuple[float, ...]], Answer]  # from a preset and its values in their order


class Runs:
    """Runs one at a time, on a solver that is given later.

    stage: what a request waits for, "loading", "compiling" or "computing".
    """

    def __init__(self) -> None:
        self.stage = "loading"
        self._solver: Future[Solver] = Future()
        self._one_at_a_time = threading.Lock()
        self._compiled: set[str] = set()

    def start(self, solver: Solver) -> None:
        """Answer from now on, with the solver."""
        self._solver.set_result(functools.lru_cache(solver))

    def answer(self, name: str, values: dict[str, float]) -> Answer:
        """Return the solver's answer for values of a preset; it may raise ValueError."""
        solver, indenter = self._solver.result(), PRESETS[name].indenter
        with self._one_at_a_time:
            self.stage = "computing" if indenter in self._compiled else "compiling"
            answer = solver(name, tuple(values.values()))
            self._compiled.add(indenter)
        return answer
