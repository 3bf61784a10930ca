"""A digest of the sources of a package, which distinguishes two states of it with the same version."""

import functools
import hashlib
import importlib.util
import sys
import time
from pathlib import Path

START_TIME = time.time()
COMPILED = (".pyc", ".so", ".pyd")  # the files of an installation without sources


def files_of(package: str, *endings: str) -> list[Path]:
    """Return the files of a package with these suffixes, in a fixed order; an empty list for a package in an archive."""
    folder = _folder(package)
    found = (path for ending in endings for path in folder.rglob(f"*{ending}"))
    return sorted(path for path in found if "__pycache__" not in path.parts)


def last_change(paths: list[Path]) -> float:
    """Return the time of the last change [s], including the inode's, since copying tools can reset the modification time."""
    return max((max(path.stat().st_mtime, path.stat().st_ctime) for path in paths), default=0.0)


def digest(package: str, paths: list[Path]) -> str:
    """Return a digest of the contents of files and of their names within the package."""
    folder, found = _folder(package), hashlib.sha256()
    for path in paths:
        content = path.read_bytes()
        found.update(f"{path.relative_to(folder).as_posix()}\0{len(content)}\0".encode() + content)
    return found.hexdigest()


@functools.cache
def identity(package: str) -> str:
    """Return a digest of the program code of a package, as this process runs it.

    It is computed from the sources; from the compiled files if there are none; from the archive for a package inside one.

    Raises:
        ValueError: the sources have changed since this process started, so that the code it runs is not that on disk.
    """
    paths = files_of(package, ".py") or files_of(package, *COMPILED)
    if not paths:
        archive = next(parent for parent in _folder(package).parents if parent.is_file())
        return hashlib.sha256(archive.read_bytes()).hexdigest()
    if last_change(paths) > START_TIME:
        raise ValueError(
            f"{package}: its sources in {_folder(package)} have changed since this process started;"
            " restart Python, so that the running code is the same as the sources"
        )
    return digest(package, paths)


def _folder(package: str) -> Path:
    module = sys.modules.get(package)
    file = module.__file__ if module else importlib.util.find_spec(package).origin  # type: ignore[union-attr]
    return Path(str(file)).parent
