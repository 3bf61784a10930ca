"""What jax compiled, kept on disk: the next process starts without compiling it again."""

import hashlib
import json
import os
import platform
from contextlib import suppress
from pathlib import Path

import filelock
import jax
import jaxlib
import platformdirs
from jax.experimental.compilation_cache import compilation_cache

from jaxcontact._support.npz import write_whole
from jaxcontact._support.version import __version__

CHECKED = ".checked.json"
LARGEST = 1 << 30
"""Bytes on disk; what was used longest ago goes first."""


def enable_compilation_cache(folder: str | os.PathLike | None = None) -> Path:
    """Keep the programs that jax compiles from now on, and take those that are there.

    A run that waits ten seconds for the compiler waits for less than one the second time, in another process too;
    its numbers are the same, bit for bit. Programs belong to one kind of processor, one jaxlib and one version of
    this package, each with a folder of its own, of at most 1 GiB. Several processes may use it at once. The
    command line calls this by itself. Programs that were cut off on disk are removed, and compiled again.

    Args:
        folder: where; by default where jax was told to already (``JAX_COMPILATION_CACHE_DIR``), or else the user's
            folder for such things (on Linux ``~/.cache/jaxcontact``).

    Returns:
        The folder in use.

    Raises:
        OSError: the folder cannot be made or written.

    Example:
        >>> folder = jc.enable_compilation_cache()  # doctest: +SKIP
    """
    chosen: str | None = jax.config.jax_compilation_cache_dir  # type: ignore[attr-defined]
    if folder is None and chosen:
        if (own := local_folder()) is not None and own.is_dir():
            remove_unreadable(own)
        return Path(chosen)
    root = platformdirs.user_cache_path("jaxcontact") if folder is None else Path(folder)
    used = root / _fingerprint()
    used.mkdir(parents=True, exist_ok=True)
    mend(used)
    remove_unreadable(used)
    jax.config.update("jax_compilation_cache_dir", str(used))
    jax.config.update("jax_compilation_cache_max_size", LARGEST)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    compilation_cache.reset_cache()  # jax reads the settings once, when it compiles for the first time
    return used


def local_folder() -> Path | None:
    """Return the folder of this machine that programs are kept in; None where there is none, or an address (gs://...)."""
    chosen: str | None = jax.config.jax_compilation_cache_dir  # type: ignore[attr-defined]
    return Path(chosen) if chosen and "://" not in chosen else None


def _fingerprint() -> str:
    """A name for this kind of processor, this jaxlib and this version: a program may crash on another."""
    processor = hashlib.sha256(_processor().encode()).hexdigest()[:12]
    return f"{platform.machine()}-{processor}-jaxlib-{jaxlib.__version__}-{__version__}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    told = ("model name", "flags", "Features", "CPU part")
    return "\n".join(sorted({line for line in lines if line.startswith(told)}))


def mend(folder: Path) -> None:
    """Remove what a killed process left half written: jax stores an entry, then the time of its last use."""
    with filelock.FileLock(folder / ".lockfile", timeout=10):  # jax's own lock of this folder
        for entry in folder.glob("*-cache"):
            if not entry.with_name(entry.name.removesuffix("-cache") + "-atime").exists():
                entry.unlink()


def remove_unreadable(folder: Path) -> None:
    """Remove programs that were cut off: jax would fail to read them in every run, and never write them again.

    Each is unpacked once, when it is new or has changed; ``CHECKED`` remembers its size and time. What cannot be
    removed or remembered stays as it is.
    """
    with suppress(OSError, filelock.Timeout), filelock.FileLock(folder / ".lockfile", timeout=10):
        path = folder / CHECKED
        before, now = _checked(path), _states(folder)
        bad = [
            name for name, state in now.items() if before.get(name) != state and not _unpacks(folder / name)
        ]
        for name in bad:
            del now[name]
            for part in (name, name.removesuffix("-cache") + "-atime"):
                (folder / part).unlink(missing_ok=True)
        if now != before:
            write_whole(path, lambda partial: partial.write_text(json.dumps(now), encoding="utf-8"))


def _states(folder: Path) -> dict[str, list[int]]:
    """Return the size and the time of the last change of each program."""
    with os.scandir(folder) as entries:
        found = {entry.name: entry.stat() for entry in entries if entry.name.endswith("-cache")}
    return {name: [each.st_size, each.st_mtime_ns] for name, each in found.items()}


def _checked(path: Path) -> dict[str, list[int]]:
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return {}


def _unpacks(path: Path) -> bool:
    """Return whether a program is whole. Where jax's way to unpack it has changed, it counts as such."""
    try:
        from jax._src.compilation_cache import decompress_executable

        return bool(decompress_executable(path.read_bytes()))
    except (OSError, ImportError):
        return True
    except Exception:  # zlib and the libraries of zstd have no common base
        return False
