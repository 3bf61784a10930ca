"""Reader of force curves of atomic force microscopes: of Bruker here, of others by the library afmformats, which is imported
on first use."""

import contextlib
import functools
import importlib
import logging
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fitting.data.contact import tip_depth
from fitting.data.drag import UNTIMED
from fitting.data.segments import label
from fitting.io import bruker
from fitting.io.nanoscope import is_nanoscope
from fitting.io.places import Place, chosen

SUFFIXES = (".jpk-force", ".jpk-force-map", ".jpk-qi-data", ".jpk-qi-series", ".ibw", ".h5", ".hdf5")
HEADS = ("Force-Distance Curve", "# afmformats")  # first lines of files of AFM Workshop and of afmformats


def is_force_curve(path: str | os.PathLike) -> bool:
    """Return whether the file name ends like that of a force curve, or the file begins like one of Bruker."""
    return os.fspath(path).lower().endswith(SUFFIXES) or is_nanoscope(os.fspath(path))


def is_force_text(path: str | os.PathLike) -> bool:
    """Return whether a text file is a force curve of AFM Workshop or afmformats, whose first lines are ``HEADS``."""
    name = os.fspath(path)
    return name.lower().endswith((".csv", ".tab")) and _first_line(name).startswith(HEADS)


def _first_line(name: str) -> str:
    try:
        with open(name, encoding="utf-8", errors="replace") as file:
            return file.readline().strip()
    except OSError:
        return ""


def read(
    path: str | os.PathLike, curve: int | str | None, spring_constant: float | None,
    sensitivity: float | None = None, untimed: bool = False,
) -> dict[str, Any]:  # fmt: skip
    """Return the fields of an ``IndentationData``: depth from the tip position, or from height and load.

    Args:
        path: a file of JPK, Igor, HDF5 or Bruker.
        curve: position, from 0, of one of several curves.
        spring_constant: [N/m], where the file does not state it.
        sensitivity: of the deflection [m/V], likewise.
        untimed: whether a curve without times is accepted; its points are then numbered.

    Raises:
        ImportError: afmformats is not installed; the message says what to install.
        ValueError: not such a file, no times, or several curves and no choice.
    """
    name = os.fspath(path)
    if not Path(name).is_file():
        raise ValueError(f"{name}: cannot be read: expected a file")
    if is_nanoscope(name):
        return bruker.read(name, curve, spring_constant, sensitivity)
    curves = _load(name, spring_constant, sensitivity)
    data = curves[chosen(name, len(curves), curve)]
    if "time" not in data and not untimed:
        raise ValueError(
            f"{name}: expected times, got {sorted(data.columns)}: take load and depth from afmformats "
            "and make IndentationData(t=..., load=..., depth=...)"
        )
    load = np.asarray(data["force"], dtype=float)
    t = np.asarray(data["time"], dtype=float) if "time" in data else np.arange(load.size, dtype=float)
    notes = () if "time" in data else (UNTIMED,)
    k = data.metadata.get("spring constant", spring_constant)
    if "tip position" in data:
        depth, note = -np.asarray(data["tip position"], dtype=float), "depth from the tip position"
    else:
        height = next(key for key in ("height (measured)", "height (piezo)") if key in data)
        depth, note = tip_depth(name, t, load, np.asarray(data[height], dtype=float), k)
    marks = _marks(data, load, depth)
    return {
        "t": t,
        "load": load,
        "depth": depth,
        "marks": marks,
        "notes": (f"{data.modality} curve by afmformats", note, *notes),
    }


def places(path: str | os.PathLike) -> list[Place]:
    """Return the curves of a file with their places; one curve for a text file."""
    name = os.fspath(path)
    if is_nanoscope(name):
        return bruker.places(name)
    if not (is_force_curve(name) or is_force_text(name)):
        return [Place(0, math.nan, math.nan)]
    known = [one.metadata for one in _load(name, None, None)]
    of = lambda metadata, key: float(metadata.get(key, math.nan))
    return [Place(k, of(one, "position x"), of(one, "position y")) for k, one in enumerate(known)]


def _load(name: str, spring_constant: float | None, sensitivity: float | None) -> Any:
    """Return the curves of a file; the last files are kept."""
    return _loaded(name, Path(name).stat().st_mtime_ns, spring_constant, sensitivity)


@functools.lru_cache(maxsize=2)
def _loaded(name: str, _: int, spring_constant: float | None, sensitivity: float | None) -> Any:
    try:
        library = importlib.import_module("afmformats")
    except ImportError:
        raise ImportError(
            f"{name}: force curves of microscopes need afmformats: pip install 'jaxcontact[afm]'"
        ) from None
    # its own errors do not derive from Exception, and its formats raise various others
    errors = (Exception, library.errors.AFMFileFormatError, library.errors.MissingMetaDataError)
    known = {"spring constant": spring_constant, "sensitivity": sensitivity}
    given = {key: value for key, value in known.items() if value is not None}
    try:
        with _without_tracebacks():
            return library.load_data(name, meta_override=given or None)
    except errors as error:
        if missing := [key for key in known if key in getattr(error, "meta_keys", ())]:
            flags = " and ".join(f"{key.replace(' ', '_')}=" for key in missing)
            raise ValueError(
                f"{name}: the file does not state the {' and the '.join(missing)}: give {flags}"
            ) from None
        what = (str(error) or type(error).__name__).splitlines()[0][:200]
        raise ValueError(f"{name}: afmformats cannot read it: {what}") from None


@contextlib.contextmanager
def _without_tracebacks() -> Iterator[None]:
    """Silence the library's own report of the errors that are raised here in one line."""
    speaker = logging.getLogger("afmformats.formats")
    silent, speaker.disabled = speaker.disabled, True
    try:
        yield
    finally:
        speaker.disabled = silent


def _marks(data: Any, load: np.ndarray, depth: np.ndarray) -> np.ndarray | None:
    return label([str(mark) for mark in data["segment"]], load, depth) if "segment" in data else None
