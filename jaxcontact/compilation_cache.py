"""What jax compiled, kept on disk: the next process starts without compiling it again."""

import hashlib
import os
import platform
from pathlib import Path

import filelock
import jax
import jaxlib
import platformdirs
from jax.experimental.compilation_cache import compilation_cache

from jaxcontact._version import __version__

LARGEST = 1 << 30
"""Bytes on disk; what was used longest ago goes first."""


def enable_compilation_cache(folder: str | os.PathLike | None = None) -> Path:
    """Keep the programs that jax compiles from now on, and take those that are there.

    A run that waits ten seconds for the compiler waits for less than one the second time, in another process too;
    its numbers are the same, bit for bit. Programs belong to one kind of processor, one jaxlib and one version of
    this package, each with a folder of its own, of at most 1 GiB. Several processes may use it at once. The
    command line calls this by itself. Import jaxcontact before jax: otherwise jax writes a page of processor features
    to stderr for every program that it takes (https://github.com/openxla/xla/issues/44565; harmless).

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
        return Path(chosen)
    root = platformdirs.user_cache_path("jaxcontact") if folder is None else Path(folder)
    used = root / _fingerprint()
    used.mkdir(parents=True, exist_ok=True)
    mend(used)
    jax.config.update("jax_compilation_cache_dir", str(used))
    jax.config.update("jax_compilation_cache_max_size", LARGEST)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    compilation_cache.reset_cache()  # jax reads the settings once, when it compiles for the first time
    return used


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
