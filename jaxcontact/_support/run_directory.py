"""Whose directory it is: one run writes into it at a time, and over nothing without being told to.

The lock is the operating system's on an open file, so it ends with the process that holds it, however that ends.
"""

import contextlib
import errno
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO

LOCK, UNFINISHED = ".lock", "unfinished"


class DirectoryTakenError(ValueError):
    """The directory is not free; the message is one line for the user."""


@contextlib.contextmanager
def claimed(directory: Path, *, force: bool, resume: bool) -> Iterator[bool]:
    """Hold ``directory`` for a run, made if need be and removed if it stays empty; True when it held something.

    Raises DirectoryTakenError when another run holds it, when it is not empty and neither ``force`` nor
    ``resume`` is set, and when there is nothing to resume.
    """
    if directory.exists() and not directory.is_dir():
        raise DirectoryTakenError(f"{directory}: found a file, accepted: a directory, new or empty")
    is_new = not directory.exists()
    directory.mkdir(parents=True, exist_ok=True)
    try:
        with locked(directory):
            yield _taken(directory, force=force, resume=resume)
    finally:
        if is_new:
            with contextlib.suppress(OSError):  # it is not empty
                directory.rmdir()


def _taken(directory: Path, *, force: bool, resume: bool) -> bool:
    found = {path.name for path in directory.iterdir()} - {LOCK}
    if resume and found and UNFINISHED not in found:
        raise DirectoryTakenError(
            f"{directory}: found no unfinished run, accepted with --resume: the directory of a stopped run,"
            " or a new one"
        )
    if found and not (force or resume):
        hint = "--resume goes on with the run that was stopped there, " if UNFINISHED in found else ""
        raise DirectoryTakenError(
            f"{directory}: found a directory that is not empty; {hint}--force overwrites it"
        )
    return bool(found)


@contextlib.contextmanager
def locked(directory: Path) -> Iterator[None]:
    """Hold the lock of a directory; its file is there as long."""
    path = directory / LOCK
    with contextlib.ExitStack() as stack:
        file = stack.enter_context(path.open("a"))
        while True:
            if not _try_lock(file):
                raise DirectoryTakenError(
                    f"{directory}: found another run at work there, accepted: another directory, or that run's end"
                )
            if path.exists() and os.path.samestat(os.fstat(file.fileno()), path.stat()):
                break
            # a run that ended has removed the file that was opened
            file = stack.enter_context(path.open("a"))
        try:
            yield
        finally:
            if sys.platform == "win32":
                file.close()  # an open file cannot be removed there
            path.unlink(missing_ok=True)


if sys.platform == "win32":
    import msvcrt

    def _lock(file: IO[str]) -> None:
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(file: IO[str]) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _try_lock(file: IO[str]) -> bool:
    """False when another process holds it. A file system without locks has none to hold."""
    try:
        _lock(file)
    except OSError as error:
        if error.errno in (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES):
            return False
        if error.errno not in (errno.ENOSYS, errno.ENOTSUP, errno.ENOLCK):
            raise
    return True
