"""Files that are whole or absent, and npz files: written part by part, read only if they are what they claim."""

import math
import os
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

HIGHEST_COMPRESSION = 1040  # deflate packs zeros 1032 times at most; what claims more is forged


@dataclass(frozen=True)
class Stacked:
    """An array in parts along its first axis, which are never in memory together.

    shape, dtype: of the whole; parts: gives the parts, in order.
    """

    shape: tuple[int, ...]
    dtype: np.dtype
    parts: Callable[[], Iterator[np.ndarray]]


def write_whole(path: Path, write: Callable[[Path], Any]) -> None:
    """Write beside, then rename: a reader never meets half a file, and a failure leaves none."""
    partial = path.with_name(path.name + ".part")
    try:
        write(partial)
        os.replace(partial, path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def write_npz(path: Path, arrays: Mapping[str, Any]) -> None:
    """Arrays, and whatever numpy makes an array of, by their names; equal arrays give equal files."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, values in arrays.items():
            # a ZipInfo of its own has a fixed date, where a bare name would have today's
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                _write_array(member, values if isinstance(values, Stacked) else _one_part(values))


def read_npz(path: Path, *names: str) -> dict[str, np.ndarray]:
    """The arrays in a file, or those of them that are named.

    Raises ValueError for what is no npz file, is cut off, or claims more than it has; OSError for what cannot
    be read at all.
    """
    with path.open("rb") as file:
        try:
            return dict(_members(file, names))
        except Exception as error:  # what zipfile, zlib and numpy raise for broken bytes has no common base
            raise ValueError(
                f"{path}: not an npz file of arrays; accepted: a file written by jaxcontact.save"
            ) from error


def _one_part(values: Any) -> Stacked:
    array = np.asarray(values, order="C")
    return Stacked(array.shape, array.dtype, lambda: iter([array]))


def _write_array(member: IO[bytes], array: Stacked) -> None:
    descr = np.lib.format.dtype_to_descr(array.dtype)
    header = {"descr": descr, "fortran_order": False, "shape": array.shape}
    np.lib.format.write_array_header_1_0(member, header)
    for part in array.parts():
        member.write(np.ascontiguousarray(part).data if part.size else b"")


def _members(file: IO[bytes], names: tuple[str, ...]) -> Iterator[tuple[str, np.ndarray]]:
    with zipfile.ZipFile(file) as archive:
        for info in archive.infolist():
            name = info.filename.removesuffix(".npy")
            if not names or name in names:
                with archive.open(info) as member:
                    _check_size(member, info)
                    member.seek(0)
                    yield name, np.lib.format.read_array(member, allow_pickle=False)


def _check_size(member: IO[bytes], info: zipfile.ZipInfo) -> None:
    """Refuse an array whose header claims what its bytes do not have, before memory is set aside for it."""
    major, _ = np.lib.format.read_magic(member)
    read = {1: np.lib.format.read_array_header_1_0, 2: np.lib.format.read_array_header_2_0}[major]
    shape, _, dtype = read(member)
    claimed = math.prod(shape) * dtype.itemsize + member.tell()
    if claimed != info.file_size or claimed > HIGHEST_COMPRESSION * info.compress_size:
        raise ValueError(f"{info.filename}: {shape} of {dtype} in {info.compress_size} bytes")
