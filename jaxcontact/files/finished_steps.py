"""The finished steps of a run in a folder, where they outlive whatever ends the run.

One file for each block of steps, written once, and ``checkpoint.npz``, which is replaced after each: it says how
many blocks count, and has what the march goes on from. Whenever a run is killed, what the checkpoint counts is
whole, and the run can go on from there.
"""

import functools
import hashlib
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxcontact._version import __version__
from jaxcontact.files.case_file import Case
from jaxcontact.files.npz import Stacked, read_npz, write_npz, write_whole
from jaxcontact.files.storage import arrays_of, stored_fields
from jaxcontact.grid import Grid
from jaxcontact.results import ContactHistory
from jaxcontact.simulation import FinishedBlock

CHECKPOINT = "checkpoint.npz"
MAPS = ("pressure", "displacement")  # kept of the chosen times, and of the last
LINES = ("pressure_line", "displacement_line", "peak_pressure")
SERIES = (*(set(stored_fields(ContactHistory)) - {"profile", *MAPS}), *LINES)


@dataclass(frozen=True)
class Standing:
    """How far a run has come.

    blocks, steps: how many are finished; status: of the step that ended the run, 0 for none; seconds: what it
    took so far; carry: what the march goes on from.
    """

    blocks: int = 0
    steps: int = 0
    status: int = 0
    seconds: float = 0.0
    carry: list[np.ndarray] | None = None


@dataclass(frozen=True)
class FinishedRun:
    """The finished steps, together.

    history: with the maps of the last step; chosen: the indices of the times of ``maps``, none for those of the last
    alone; first_pressure (nx, ny) [Pa]: of the first of them; pressure_line [Pa], displacement_line [m]: along x at the
    row of cells nearest to y = 0, (nt, nx); peak_pressure (nt,) [Pa].
    """

    history: ContactHistory
    chosen: np.ndarray
    first_pressure: np.ndarray | None
    maps: dict[str, Stacked]
    pressure_line: np.ndarray
    displacement_line: np.ndarray
    peak_pressure: np.ndarray


def fingerprint(case: Case) -> str:
    """The same for two cases only if they give the same result: every number in them, and the version."""
    given = (case.body, case.indenter, case.control, case.times, case.grid, case.motion)
    leaves, structure = jax.tree.flatten(given)
    words = f"{__version__} {case.kind} {structure} {sorted(case.options.items())} {case.kept}"
    numbers = b"".join(np.asarray(leaf, dtype=float).tobytes() for leaf in leaves)
    return hashlib.sha256(words.encode() + numbers).hexdigest()


@dataclass(frozen=True)
class FinishedSteps:
    """The finished steps in ``folder`` of the case with that ``fingerprint``; chosen: the times whose maps are kept."""

    folder: Path
    fingerprint: str
    chosen: np.ndarray

    def remove(self) -> None:
        """Forget them all."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def standing(self) -> Standing:
        """How far the run has come. Raises ValueError when the steps are those of another case."""
        if not (self.folder / CHECKPOINT).exists():
            return Standing()
        found = read_npz(self.folder / CHECKPOINT)
        if str(found["case"]) != self.fingerprint:
            raise ValueError(
                f"{self.folder}: found the steps of another case, --save or version of jaxcontact,"
                " accepted with --resume: those of this one"
            )
        blocks, steps, status = found["counts"].tolist()
        carry = [found[name] for name in sorted(found) if name.startswith("carry")]
        return Standing(blocks, steps, status, float(found["seconds"]), carry)

    def add(self, before: Standing, block: FinishedBlock, seconds: float) -> Standing:
        """Keep a block; how far the run has then come."""
        count = block.history.times.size
        if not count:
            return replace(before, status=block.status)
        now = Standing(before.blocks + 1, before.steps + count, block.status, seconds, block.carry)
        arrays = arrays_of(block.history) | _lines(block.history)
        last = {"profile": arrays["profile"]} | {name: arrays[name][-1] for name in MAPS}
        steps = np.isin(before.steps + np.arange(count), self.chosen)
        kept = {name: arrays[name] for name in SERIES} | {name: arrays[name][steps] for name in MAPS}
        self.folder.mkdir(exist_ok=True)
        write_whole(self._block(before.blocks), lambda path: write_npz(path, kept))
        write_whole(self.folder / CHECKPOINT, lambda path: write_npz(path, self._facts(now) | last))
        return now

    def together(self, grid: Grid) -> FinishedRun:
        """All finished steps, of which there is one at least."""
        last = read_npz(self.folder / CHECKPOINT, "counts", "profile", *MAPS)
        blocks = [self._block(index) for index in range(int(last.pop("counts")[0]))]
        series = _joined(blocks)
        lines = {name: series.pop(name) for name in LINES}
        history = ContactHistory(**series, **last, saved=None, grid=grid)
        if not self.chosen.size:
            return FinishedRun(history, self.chosen, None, {}, **lines)
        end = history.times.size - 1  # a run that was stopped ends at none of the chosen
        chosen = np.append(self.chosen[self.chosen < end], end)
        files = blocks if end in self.chosen else [*blocks, self.folder / CHECKPOINT]
        shape = (chosen.size, *grid.shape)
        maps = {
            name: Stacked(shape, np.dtype(float), functools.partial(_parts, files, name)) for name in MAPS
        }
        return FinishedRun(history, chosen, next(_parts(blocks, "pressure"))[0], maps, **lines)

    def _block(self, index: int) -> Path:
        return self.folder / f"{index:06}.npz"

    def _facts(self, now: Standing) -> dict[str, Any]:
        carry = {f"carry_{index:03}": leaf for index, leaf in enumerate(now.carry or [])}
        counts = [now.blocks, now.steps, now.status]
        return {"case": self.fingerprint, "counts": counts, "seconds": now.seconds} | carry


def _lines(history: ContactHistory) -> dict[str, np.ndarray]:
    """Arrays of a block beside its history, see ``FinishedRun``."""
    middle = history.grid.shape[1] // 2
    pressure, displacement = np.asarray(history.pressure), np.asarray(history.displacement)
    lines = (pressure[:, :, middle], displacement[:, :, middle], np.max(pressure, axis=(1, 2)))
    return dict(zip(LINES, lines, strict=True))


def _joined(blocks: list[Path]) -> dict[str, np.ndarray]:
    """What has a value or a line for each step, of all blocks."""
    parts = [read_npz(block, *SERIES) for block in blocks]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _parts(files: list[Path], name: str) -> Iterator[np.ndarray]:
    """The maps of a block at a time; the one of the checkpoint has no axis of time."""
    for file in files:
        maps = read_npz(file, name)[name]
        yield maps[None] if maps.ndim == 2 else maps
