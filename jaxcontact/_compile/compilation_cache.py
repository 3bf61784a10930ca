"""An on-disk cache of compiled programs, so that later processes start without compiling them again."""

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

from jaxcontact._support.files import write_whole
from jaxcontact._support.version import __version__

CHECKED = ".checked.json"
LARGEST = 1 << 30
"""Bytes on disk; the least recently used programs are removed first."""


def enable_compilation_cache(folder: str | os.PathLike | None = None) -> Path:
    """Cache the programs that jax compiles from now on, and use those already in the cache.

    A run that waits ten seconds for the compiler waits for less than one the second time, in another process too;
    its numbers are identical bit for bit. Programs are specific to one kind of processor, one jaxlib and one version of
    this package, each with a folder of its own, of at most 1 GiB. Several processes may use it at once. The
    command line calls this function itself. Programs truncated on disk are removed and compiled again.

    Args:
        folder: location of the cache; by default the one that jax is configured to use (``JAX_COMPILATION_CACHE_DIR``),
            or else the user's cache folder (on Linux ``~/.cache/jaxcontact``).

    Returns:
        The folder in use.

    Raises:
        OSError: the folder cannot be made or written.

    Example:
        >>> folder = jc.enable_compilation_cache()  # doctest: +SKIP
    """
    chosen: str | None = jax.config.jax_compilation_cache_dir  # type: ignore[attr-defined]
    if folder is None and chosen:
        if "://" not in chosen and Path(chosen).is_dir():  # not an address (gs://...)
            remove_unreadable(Path(chosen))
        return Path(chosen)
    # a folder for this kind of processor, this jaxlib and this version, since a program may crash on another
    root = platformdirs.user_cache_path("jaxcontact") if folder is None else Path(folder)
    processor = hashlib.sha256(_processor().encode()).hexdigest()[:12]
    used = root / f"{platform.machine()}-{processor}-jaxlib-{jaxlib.__version__}-{__version__}"
    used.mkdir(parents=True, exist_ok=True)
    remove_incomplete(used)
    remove_unreadable(used)
    jax.config.update("jax_compilation_cache_dir", str(used))
    jax.config.update("jax_compilation_cache_max_size", LARGEST)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    compilation_cache.reset_cache()  # jax reads the settings once, when it compiles for the first time
    return used


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    entries = ("model name", "flags", "Features", "CPU part")
    return "\n".join(sorted({line for line in lines if line.startswith(entries)}))


def remove_incomplete(folder: Path) -> None:
    """Remove entries left incomplete by a killed process: jax stores an entry, then the time of its last use."""
    with filelock.FileLock(folder / ".lockfile", timeout=10):  # jax's own lock of this folder
        for entry in folder.glob("*-cache"):
            if not entry.with_name(entry.name.removesuffix("-cache") + "-atime").exists():
                entry.unlink()


def remove_unreadable(folder: Path) -> None:
    """Remove truncated programs, which jax would fail to read in every run and never write again.

    Each is decompressed once, when it is new or has changed; the file ``CHECKED`` stores its size and time. Programs that
    cannot be removed or recorded are left as they are.
    """
    with suppress(OSError, filelock.Timeout), filelock.FileLock(folder / ".lockfile", timeout=10):
        path = folder / CHECKED
        with os.scandir(folder) as entries:
            found = {entry.name: entry.stat() for entry in entries if entry.name.endswith("-cache")}
        before, now = _checked(path), {name: [one.st_size, one.st_mtime_ns] for name, one in found.items()}
        bad = [
            name
            for name, state in now.items()
            if before.get(name) != state and not _is_complete(folder / name)
        ]
        for name in bad:
            del now[name]
            for part in (name, name.removesuffix("-cache") + "-atime"):
                (folder / part).unlink(missing_ok=True)
        if now != before:
            write_whole(path, lambda partial: partial.write_text(json.dumps(now), encoding="utf-8"))


def _checked(path: Path) -> dict[str, list[int]]:
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return {}


def _is_complete(path: Path) -> bool:
    """Return whether a program is complete; True if jax's function to decompress it is not available."""
    try:
        from jax._src.compilation_cache import decompress_executable

        return bool(decompress_executable(path.read_bytes()))
    except (OSError, ImportError):
        return True
    except Exception:  # the errors of zlib and of the zstd libraries have no common base class
        return False
