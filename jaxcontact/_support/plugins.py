"""Plug-ins: what other installed distributions add to case files and to readers, by entry points.

A distribution names its objects in its ``pyproject.toml``,

    [project.entry-points."jaxcontact.materials"]
    two-kelvin = "my_package.materials:TwoKelvin"

and an object is imported when it is first used, never by ``import jaxcontact``.
"""

import functools
import sys
from importlib import metadata
from typing import Any

MATERIALS, READERS = "jaxcontact.materials", "jaxcontact.readers"


def names(group: str) -> tuple[str, ...]:
    """Return the names of the plug-ins of a group, in alphabetical order; nothing is imported."""
    return tuple(sorted(_entries(group, tuple(sys.path))))


def load(group: str, name: str) -> Any:
    """Import and return the object that a plug-in names.

    Raises:
        ValueError: it cannot be imported; the message names the distribution.
    """
    entry = _entries(group, tuple(sys.path))[name]
    try:
        return entry.load()
    except Exception as error:  # whatever a module of somebody else raises when it is imported
        reason = (str(error) or type(error).__name__).splitlines()[0][:120]
        raise ValueError(
            f"plug-in {name!r} of {origin(entry)}: expected {entry.value} to be importable, got: {reason}"
        ) from error


def origin(entry: metadata.EntryPoint) -> str:
    """Return the name of the distribution of an entry point."""
    return entry.dist.name if entry.dist is not None else "an unknown distribution"


@functools.lru_cache(maxsize=8)
def _entries(group: str, path: tuple[str, ...]) -> dict[str, metadata.EntryPoint]:
    """Return the entry points of a group by their names; ``path`` is ``sys.path``, which decides what is installed."""
    return {entry.name: entry for entry in metadata.entry_points(group=group)}
