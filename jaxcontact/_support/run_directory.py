"""Exclusive ownership of an output directory: one run writes to it at a time, and nothing is overwritten without --force.

The lock is an operating system lock on an open file, so it ends with the process that holds it, however that ends.
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
    """The directory is in use or not empty; the message is one line for the user."""


@contextlib.contextmanager
def claimed(directory: Path, *, force: bool, resume: bool) -> Iterator[bool]:
    """Claim ``directory`` for a run, creating it if needed and removing it if it stays empty; True if it was not empty.

    Raises DirectoryTakenError when another run uses it, when it is not empty and neither ``force`` nor
    ``resume`` is set, and when there is nothing to resume.
    """
    if directory.exists() and not directory.is_dir():
        raise DirectoryTakenError(f"{directory}: found a file, accepted: a directory, new or empty")
    is_new = not directory.exists()
    directory.mkdir(parents=True, exist_ok=True)
    try:
        with locked(directory):
            yield _check_free(directory, force=force, resume=resume)
    finally:
        if is_new:
            with contextlib.suppress(OSError):  # it is not empty
                directory.rmdir()


def _check_free(directory: Path, *, force: bool, resume: bool) -> bool:
    found = {path.name for path in directory.iterdir()} - {LOCK}
    if resume and found and UNFINISHED not in found:
        raise DirectoryTakenError(
            f"{directory}: found no unfinished run and no finished one of this case, accepted with --resume: the"
            " directory of a run of this case, or a new one"
        )
    if found and not (force or resume):
        hint = "--resume continues the run that was stopped there, " if UNFINISHED in found else ""
        raise DirectoryTakenError(
            f"{directory}: found a directory that is not empty; {hint}--force overwrites it"
        )
    return bool(found)


@contextlib.contextmanager
def locked(directory: Path) -> Iterator[None]:
    """Hold the lock of a directory; its lock file exists for as long."""
    path = directory / LOCK
    with contextlib.ExitStack() as stack:
        file = stack.enter_context(path.open("a"))
        while True:
            if not _try_lock(file):
                raise DirectoryTakenError(
                    f"{directory}: found another run in progress there, accepted: another directory, or wait for its end"
                )
            if path.exists() and os.path.samestat(os.fstat(file.fileno()), path.stat()):
                break
            # the opened file has been removed by a run that ended
            file = stack.enter_context(path.open("a"))
        try:
            yield
        finally:
            if sys.platform == "win32":
                file.close()  # Windows cannot remove an open file
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
    """Return False if another process holds the lock. On a file system without locks it is never held."""
    try:
        _lock(file)
    except OSError as error:
        if error.errno in (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES):
            return False
        if error.errno not in (errno.ENOSYS, errno.ENOTSUP, errno.ENOLCK):
            raise
    return True
