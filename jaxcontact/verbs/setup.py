"""The arguments of the verbs: the contact that is given, and the settings of its solution, both before validation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from jaxcontact._support import checks
from jaxcontact.indenters.shapes import Indenter
from jaxcontact.inputs.controls import Control
from jaxcontact.inputs.grid import Grid
from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.operators.kernels import Kernels
from jaxcontact.results.contact import ContactStep

Save = str | Callable[[ContactStep], Any]


@dataclass(frozen=True)
class ContactSetup:
    """The contact that a verb is given, not yet validated; the fields are documented in ``indent``."""

    body: LayeredHalfSpace
    indenter: Indenter
    control: Control
    times: Any
    grid: Grid


@dataclass(frozen=True)
class Options:
    """Static options of a run; their meaning is documented in ``indent``."""

    save: Save = "all"
    substeps: int = 1
    correspondence: str = "exact"
    checkpoint: str = "pressures"

    def check(self) -> None:
        """Raises ValueError for an option that is not there."""
        known = self.save in ("all", "last") or callable(self.save)
        checks.require(known, f'save: expected "all", "last" or a function, got {self.save!r}')
        checks.whole("substeps", self.substeps, 1, 1000)
        checks.one_of("correspondence", self.correspondence, "exact", "quasi-elastic")
        checks.one_of("checkpoint", self.checkpoint, "pressures", "blocks")


@dataclass(frozen=True)
class Settings:
    """The settings of a solution, not yet validated; the fields are documented in ``indent``."""

    tolerance: Any = 1e-8
    max_iterations: Any = 500
    kernels: Kernels | None = None
    options: Options = Options()
