"""Results for ParaView: a collection ``press.pvd`` of one VTK file for each time, ``press/press_0.vtr`` and so on.

The points are the cell centres, z into the body [m]; fields of the surface lie at z = 0. Each field has its unit in its
name, ``pressure [Pa]``; a tangential vector has a z component of zero, and a stress nine components by rows. Scalars of a
time are field data. Format: VTK's XML files,
https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html
"""

import base64
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ElementTree, SubElement

import numpy as np

from jaxcontact._support.fields import fields_of
from jaxcontact._support.npz import write_whole
from jaxcontact.results.labels import arrays_of, derived_of

AXES = ("depth", "y", "x")  # of the points, in VTK's order: the last varies fastest
Field = tuple[str, np.ndarray, tuple[str, ...]]  # name with unit, values, names of its dimensions


def write_collection(path: Path, result: Any) -> None:
    """Write a result at each of its times, then the collection file."""
    arrays = arrays_of(result)
    fields = list(_fields(result, arrays))
    folder = pieces_folder(path)
    folder.mkdir(exist_ok=True)
    pieces: dict[str, float] = {}
    for index, time in _times(arrays).items():
        piece = folder / f"{path.stem}_{len(pieces)}.vtr"
        _write(piece, _grid(arrays, [_at(field, index) for field in fields]))
        pieces[f"{folder.name}/{piece.name}"] = time
    _write(path, _collection(pieces))


def pieces_folder(path: Path) -> Path:
    """Return the folder for the VTK files of a collection: ``v`` for ``v.pvd``, or ``v_vtr``, ``v_vtr_vtr``, ... where that
    is a file or a folder of other things, such as the results of a run."""
    folder = path.with_suffix("")
    while folder.exists() and not (
        folder.is_dir()
        and all(re.fullmatch(rf"{re.escape(path.stem)}_\d+\.vtr", p.name) for p in folder.iterdir())
    ):
        folder = folder.with_name(folder.name + "_vtr")
    return folder


def _write(path: Path, root: Element) -> None:
    write_whole(path, lambda part: ElementTree(root).write(part, "utf-8", xml_declaration=True))


def _fields(result: Any, arrays: dict[str, np.ndarray]) -> Iterator[Field]:
    known, values = fields_of(arrays), arrays | derived_of(result)
    for name in known:
        if name in values:
            field = known[name]
            yield f"{name} [{field.symbol}]", values[name], field.dimensions_of(values[name].ndim)


def _times(arrays: dict[str, np.ndarray]) -> dict[int, float]:
    """Return the times with maps by their index: all, or the last; a steady state has one."""
    times = arrays.get("times", np.zeros(1))
    every = range(times.size) if arrays.get("pressure", np.zeros(())).ndim == 3 else [times.size - 1]
    return {index: float(times[index]) for index in every}


def _at(field: Field, index: int) -> Field:
    """Return a field at one time."""
    name, values, dims = field
    return (name, values[index], dims[1:]) if dims[:1] == ("time",) else field


def _grid(arrays: dict[str, np.ndarray], fields: list[Field]) -> Element:
    """Return a grid of the cell centres, with the fields on them."""
    root = _file("RectilinearGrid")
    axes = [arrays["x"], arrays["y"], arrays.get("depths", np.zeros(1))]
    extent = " ".join(f"0 {axis.size - 1}" for axis in axes)
    grid = SubElement(root, "RectilinearGrid", WholeExtent=extent)
    numbers = [(name, values) for name, values, dims in fields if "x" not in dims]
    _add(grid, "FieldData", numbers, of_tuples=True)
    piece = SubElement(grid, "Piece", Extent=extent)
    _add(piece, "PointData", [(field[0], _on_points(field)) for field in fields if "x" in field[2]])
    _add(piece, "Coordinates", zip("xyz", axes, strict=True))
    return root


def _on_points(field: Field) -> np.ndarray:
    """Return values with one row for each point and its components as columns."""
    _, values, dims = field
    axes = [axis for axis in AXES if axis in dims]
    components = [dim for dim in dims if dim not in AXES]
    rows = values.transpose([dims.index(dim) for dim in [*axes, *components]])
    rows = rows.reshape(int(np.prod([values.shape[dims.index(axis)] for axis in axes])), -1)
    return np.pad(rows, ((0, 0), (0, 1))) if components == ["direction"] else rows


def _add(
    parent: Element, kind: str, arrays: Iterable[tuple[str, np.ndarray]], of_tuples: bool = False
) -> None:
    """Add arrays in base64, each preceded by its number of bytes."""
    element = SubElement(parent, kind)
    for name, values in arrays:
        values = np.asarray(values, "<f8")
        attributes = {"type": "Float64", "Name": name, "format": "binary"}
        if of_tuples:
            attributes |= {"NumberOfTuples": "1", "NumberOfComponents": str(values.size)}
        elif values.ndim == 2:
            attributes |= {"NumberOfComponents": str(values.shape[1])}
        data = np.array(values.nbytes, "<u8").tobytes() + values.tobytes()
        SubElement(element, "DataArray", attributes).text = base64.b64encode(data).decode()


def _collection(pieces: dict[str, float]) -> Element:
    root = _file("Collection")
    collection = SubElement(root, "Collection")
    for file, time in pieces.items():
        SubElement(collection, "DataSet", timestep=repr(time), part="0", file=file)
    return root


def _file(kind: str) -> Element:
    return Element("VTKFile", type=kind, version="1.0", byte_order="LittleEndian", header_type="UInt64")
