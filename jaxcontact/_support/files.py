"""Files that are written atomically, arrays in them (written in parts, validated when read), output directories that belong
to one run at a time, and the contents of files that are kept until these change."""

import contextlib
import errno
import functools
import math
import os
import sys
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, TypeVar

import numpy as np

T = TypeVar("T")
# deflate compresses zeros at most 1032 times; a file that claims more is invalid
HIGHEST_COMPRESSION = 1040


@dataclass(frozen=True)
class Stacked:
    """An array given in parts along its first axis, which are never in memory together.

    shape, dtype: of the complete array; parts: returns an iterator over the parts, in order.
    """

    shape: tuple[int, ...]
    dtype: np.dtype
    parts: Callable[[], Iterator[np.ndarray]]


def write_whole(path: Path, write: Callable[[Path], Any]) -> None:
    """Write a file under a temporary name, then rename it, so that neither readers nor failures leave an incomplete file.

    Raises OSError, which names ``path`` whatever name the error of ``write`` has.
    """
    partial = path.with_name(path.name + ".part")
    try:
        write(partial)
        os.replace(partial, path)
    except OSError as error:
        _remove(partial)
        reason = error.strerror or str(error).replace(str(partial), str(path))
        raise type(error)(error.errno or errno.EIO, reason, str(path)) from error
    except BaseException:
        _remove(partial)
        raise


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):  # the first error is the one to report
        path.unlink()


def write_npz(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays, and anything that numpy converts to an array, by name; equal arrays give equal files."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, values in arrays.items():
            # a ZipInfo has a fixed date, whereas a file name alone would be stored with the current date
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                array = values if isinstance(values, Stacked) else np.asarray(values, order="C")
                parts = array.parts() if isinstance(array, Stacked) else [array]
                descr = np.lib.format.dtype_to_descr(array.dtype)
                header = {"descr": descr, "fortran_order": False, "shape": array.shape}
                np.lib.format.write_array_header_1_0(member, header)
                for part in parts:
                    member.write(np.ascontiguousarray(part).data if part.size else b"")


def read_npz(path: Path, *names: str) -> dict[str, np.ndarray]:
    """Return the arrays in a file, or those that are named.

    Raises ValueError for a file that is not npz, is truncated, or claims more data than it has; OSError for a file that
    cannot be read at all.
    """
    return _read(path, lambda file: dict(_members(file, names)))


def read_npy(path: Path) -> np.ndarray:
    """Return the array in a .npy file. Raises as ``read_npz`` does."""
    return _read(path, lambda file: _array(file, path.stat().st_size))


def _read(path: Path, read: Callable[[IO[bytes]], T]) -> T:
    with path.open("rb") as file:
        try:
            return read(file)
        except (
            Exception
        ) as error:  # the errors of zipfile, zlib and numpy for damaged files have no common base class
            raise ValueError(
                f"{path}: not an {path.suffix.lstrip('.')} file of arrays;"
                " accepted: a file written by jaxcontact.write_result"
            ) from error


def _members(file: IO[bytes], names: tuple[str, ...]) -> Iterator[tuple[str, np.ndarray]]:
    with zipfile.ZipFile(file) as archive:
        for info in archive.infolist():
            name = info.filename.removesuffix(".npy")
            if not names or name in names:
                if info.file_size > HIGHEST_COMPRESSION * info.compress_size:
                    raise ValueError(f"{name}: {info.file_size} bytes out of {info.compress_size}")
                with archive.open(info) as member:
                    yield name, _array(member, info.file_size)


def _array(file: IO[bytes], size: int) -> np.ndarray:
    """Return an array, after checking the size claimed in its header, before memory is allocated for it."""
    major, _ = np.lib.format.read_magic(file)
    header = {1: np.lib.format.read_array_header_1_0, 2: np.lib.format.read_array_header_2_0}[major]
    shape, _, dtype = header(file)
    claimed = math.prod(shape) * dtype.itemsize + file.tell()
    if claimed != size:
        raise ValueError(f"{shape} of {dtype} in {size} bytes")
    file.seek(0)
    return np.lib.format.read_array(file, allow_pickle=False)


# Exclusive ownership of an output directory: one run writes to it at a time, and nothing is overwritten without --force.
#
# The lock is an operating system lock on an open file, so it ends with the process that holds it, however that ends.

LOCK, UNFINISHED = ".lock", "unfinished"


class DirectoryTakenError(ValueError):
    """The directory is in use or not empty; the message is one line for the user."""


def refuse_taken(directory: Path, *, force: bool, resume: bool) -> bool:
    """Raise DirectoryTakenError for a directory that ``claimed`` refuses for what it contains; True if it is not empty."""
    if not directory.exists():
        return False
    if not directory.is_dir():
        raise DirectoryTakenError(f"{directory}: found a file, accepted: a directory, new or empty")
    found = {path.name for path in directory.iterdir()} - {LOCK}
    if resume and found and UNFINISHED not in found:
        raise DirectoryTakenError(
            f"{directory}: found no unfinished run and no finished one of this case, accepted with --resume: the directory"
            " of a run of this case, or a new one"
        )
    if found and not (force or resume):
        hint = "--resume continues the run that was stopped there, " if UNFINISHED in found else ""
        raise DirectoryTakenError(
            f"{directory}: found a directory that is not empty; {hint}--force overwrites it"
        )
    return bool(found)


@contextlib.contextmanager
def claimed(directory: Path, *, force: bool, resume: bool) -> Iterator[bool]:
    """Claim ``directory`` for a run, creating it if needed and removing it if it stays empty; True if it was not empty.

    Raises DirectoryTakenError when another run uses it, when it is not empty and neither ``force`` nor
    ``resume`` is set, and when there is nothing to resume.
    """
    if not directory.is_dir():
        refuse_taken(directory, force=force, resume=resume)
    is_new = not directory.exists()
    directory.mkdir(parents=True, exist_ok=True)
    try:
        with locked(directory):
            yield refuse_taken(directory, force=force, resume=resume)
    finally:
        if is_new:
            with contextlib.suppress(OSError):  # it is not empty
                directory.rmdir()


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


def kept_until_changed(load: Callable[..., T]) -> Callable[..., T]:
    """Return a function of a file's name, and more, whose last two results are kept until the file changes."""
    kept = functools.lru_cache(maxsize=2)(lambda name, changed, *more: load(name, *more))
    return functools.wraps(load)(lambda name, *more: kept(name, Path(name).stat().st_mtime_ns, *more))
