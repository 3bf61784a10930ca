"""Results in files: npz with numpy only, NetCDF (named dimensions, units) with the extra ``jaxcontact[io]``.

Both hold the same fields under the same names. In NetCDF every field has its dimensions, its unit and its
meaning, and the case is in the attributes; xarray and MATLAB read it directly. ParaView reads collections of VTK files.
"""

import base64
import dataclasses
import io
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ElementTree, SubElement

import jax.numpy as jnp
import numpy as np

from jaxcontact._support.fields import (
    arrays_of,
    dataset,
    derived_of,
    fields_of,
    numbers_of,
    status_names,
    stored_fields,
)
from jaxcontact._support.files import read_npz, write_npz, write_whole
from jaxcontact.bodies.grid import Grid
from jaxcontact.results.contact import ContactHistory, Deflection, InteriorFields, SteadyContact
from jaxcontact.results.notes import Diagnostics

# Results for ParaView: a collection ``press.pvd`` of one VTK file for each time, ``press/press_0.vtr`` and so on.
#
# The points are the cell centres, z into the body [m]; fields of the surface lie at z = 0. Each field has its unit in
# its name, ``pressure [Pa]``; a tangential vector has a z component of zero, and a stress nine components by rows.
# Scalars of a time are field data. Format: VTK's XML files,
# https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html


AXES = ("depth", "y", "x")  # of the points, in VTK's order: the last varies fastest
Field = tuple[str, np.ndarray, tuple[str, ...]]  # name with unit, values, names of its dimensions


def write_collection(path: Path, result: Any) -> None:
    """Write a result at each of its times, then the collection file."""
    arrays = arrays_of(result)
    values = arrays | derived_of(result)
    fields = [
        (f"{name} [{field.symbol}]", values[name], field.dimensions_of(values[name].ndim))
        for name, field in fields_of(arrays).items()
        if name in values
    ]
    # the times with maps: all, or the last; a steady state has one
    times = arrays.get("times", np.zeros(1))
    maps = arrays.get("pressure", arrays["displacement"])
    folder = pieces_folder(path)
    folder.mkdir(exist_ok=True)
    root = _file("Collection")
    collection = SubElement(root, "Collection")
    for count, index in enumerate(range(times.size) if maps.ndim == 3 else [times.size - 1]):
        piece = folder / f"{path.stem}_{count}.vtr"
        at_one_time = [
            (name, field[index], dims[1:]) if dims[:1] == ("time",) else (name, field, dims)
            for name, field, dims in fields
        ]
        _write(piece, _rectilinear_grid(arrays, at_one_time))
        file = f"{folder.name}/{piece.name}"
        SubElement(collection, "DataSet", timestep=repr(float(times[index])), part="0", file=file)
    _write(path, root)


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


def _rectilinear_grid(arrays: dict[str, np.ndarray], fields: list[Field]) -> Element:
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


def _file(kind: str) -> Element:
    return Element("VTKFile", type=kind, version="1.0", byte_order="LittleEndian", header_type="UInt64")


Result = ContactHistory | SteadyContact | InteriorFields | Deflection
KIND = "kind"  # the class name of a stored result
STATUS_NAMES = "status_names"  # names of the statuses 0, 1, ...
NOTES = "notes"  # one line each; the notes of a loaded result are formed from the diagnostics
DIAGNOSTICS = tuple(field.name for field in dataclasses.fields(Diagnostics))
NUMBERS = "diagnostics"  # the variable of a NetCDF file whose attributes are the diagnostics
PERIODIC, SPACING = "grid_periodic", "grid_spacing"  # along x and y, stored for a periodic grid only

RESERVED = {  # names of axes and attributes in the files of any result
    *("x", "y", "time", "depth", "direction", "row", "column", "component"),
    *(
        "grid",
        "saved",
        KIND,
        STATUS_NAMES,
        PERIODIC,
        SPACING,
        NOTES,
        NUMBERS,
        *DIAGNOSTICS,
        "Conventions",
        "source",
    ),
}


def result_classes() -> dict[str, type]:
    """Return the classes of results by name: ``ContactHistory``, its subclasses and those of ``SteadyContact``, a user's own
    included, ``InteriorFields`` and ``Deflection``."""
    found: list[type] = []
    pending: list[type] = [ContactHistory, *SteadyContact.__subclasses__()]
    while pending:
        found.append(pending.pop(0))
        pending += found[-1].__subclasses__()
    return {cls.__name__: cls for cls in (*found, InteriorFields, Deflection)}


def has_times(cls: type) -> bool:
    """Return whether the results of a class are a history over times."""
    return "times" in stored_fields(cls)


def write_result(result: Result, path: str | Path, **case: Any) -> Path:
    """Write a result to a file, replacing an existing one atomically (for ParaView, each of its files).

    Args:
        result: ``ContactHistory``, ``AdhesiveHistory``, ``RubbingHistory``, ``ShearHistory``, ``SlidingHistory``,
            ``AdhesiveSlidingHistory``, ``SteadySliding``, ``SteadyRolling``, ``InteriorFields`` or ``Deflection``; the
            values of a ``save`` function are not stored.
        path: a file name ending in ``.npz`` or ``.nc``, or in ``.pvd`` for ParaView: an animation over all times, one
            file each in a folder of the same name beside it (with ``_vtr`` behind the name if that folder holds other
            things, as a run's does), for viewing only: it cannot be loaded again.
        case: the inputs of the result, under any names except those of its own arrays (``body=body,
            indenter=ball``): numbers, text and objects of this package are stored as attributes of a NetCDF file
            (``body.layers.0.material.G1``) and as arrays of an npz file.

    Returns:
        The path.

    Raises:
        ValueError: another ending, another kind of result, or one made by ``jax.vmap``; a name of ``case`` that the file
            itself uses (``load``, ``times``, ``x``, ...), or a value that is not a number, text or an object of
            this package. Nothing is written then.
        OSError: the file cannot be written; the message names it.
        ImportError: ``.nc`` without the extra ``jaxcontact[io]``.

    Example:
        >>> import tempfile
        >>> glass, grid = jc.LayeredHalfSpace([], jc.Elastic(30e9)), jc.Grid.square(n=16, width=300e-6)
        >>> history = jc.indent(glass, jc.Sphere(5e-3), jc.Load(20.0), [0.0], grid=grid)
        >>> path = jc.write_result(history, tempfile.mkdtemp() + "/glass.npz", body=glass)
    """
    path = Path(path)
    classes = result_classes()
    if type(result).__name__ not in classes:
        raise ValueError(
            f"result: expected {', '.join(classes)}, got {type(result).__name__}; pass the result of indent, for instance"
        )
    write = _format(path, {".npz": _write_npz, ".nc": _write_netcdf, ".pvd": None})
    arrays = arrays_of(result)
    _check_arrays(type(result), arrays | _of_grid(result.grid))
    inputs = _inputs(case)
    if write is None:
        write_collection(path, result)
        return path
    notes = inputs | {STATUS_NAMES: status_names()} | notes_of(result)
    arrays |= numbers_of(result)
    write_whole(path, lambda partial: write(partial, arrays, notes))
    return path


def read_result(path: str | Path) -> Any:
    """Return the result in a file that ``write_result`` or the command line wrote.

    Args:
        path: a file name ending in ``.npz`` or ``.nc``.

    Returns:
        The saved result, with numpy arrays as its fields. For a run that kept maps at a few times, it is the history at
        these times, scalars and maps alike, as given by its ``times``; ``course.npz`` beside it has the scalars at all
        times.

    Raises:
        ValueError: another ending, or a file that is no such result.
        OSError: a file that cannot be read.
        ImportError: ``.nc`` without the extra ``jaxcontact[io]``.

    Example:
        >>> import tempfile
        >>> glass, grid = jc.LayeredHalfSpace([], jc.Elastic(30e9)), jc.Grid.square(n=16, width=300e-6)
        >>> history = jc.indent(glass, jc.Sphere(5e-3), jc.Load(20.0), [0.0], grid=grid)
        >>> again = jc.read_result(jc.write_result(history, tempfile.mkdtemp() + "/glass.npz"))
        >>> bool(np.all(again.pressure == history.pressure))
        True
    """
    path = Path(path)
    arrays, kind = _format(path, {".npz": _read_npz, ".nc": _read_netcdf})(path)
    if not kind and "times" in arrays:
        raise ValueError(
            f"{path}: found the time series of a run without maps, which numpy.load reads;"
            " accepted: the result.npz beside it, which has the maps"
        )
    classes = result_classes()
    if kind not in classes:
        raise ValueError(
            f"{path}: found no result of jaxcontact; accepted: a file written by jaxcontact.write_result"
        )
    cls = classes[kind]
    if cls is InteriorFields:  # files of earlier versions do not have it
        arrays.setdefault("response_error", np.full(np.shape(arrays.get("depths")), np.nan))
    try:
        _check_arrays(cls, arrays)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    own = {field.name for field in dataclasses.fields(cls)}
    others: dict[str, Any] = {"saved": None} if "saved" in own else {}
    if "diagnostics" in own:
        others["diagnostics"] = Diagnostics(**{name: arrays[name] for name in DIAGNOSTICS if name in arrays})
    stored = {name: arrays[name] for name in stored_fields(cls) if name in arrays}
    return cls(**stored, **others, grid=_grid(arrays))


def _check_arrays(cls: type, arrays: dict[str, np.ndarray]) -> None:
    """Check that all arrays of a result are present, with consistent sizes."""
    optional = {field.name for field in dataclasses.fields(cls) if field.default is None}
    names = [name for name in stored_fields(cls) if name in arrays or name not in optional]
    for name in (*names, "x", "y"):
        if name not in arrays:
            raise ValueError(f"{name}: missing; accepted: a file written by jaxcontact.write_result")
        if arrays[name].dtype.kind not in "bfiu":
            raise ValueError(f"{name}: found {arrays[name].dtype}, accepted: real numbers")

    # the axes: a grid that is periodic along y may have one cell along it
    wraps = False
    if PERIODIC in arrays:
        both, spacing = (np.asarray(arrays.get(name, ())) for name in (PERIODIC, SPACING))
        pairs = both.shape == spacing.shape == (2,) and both.dtype.kind in "biu" and spacing.dtype.kind == "f"
        if not pairs or not np.all((spacing > 0.0) & (spacing < np.inf)):
            raise ValueError(
                f"{PERIODIC}, {SPACING}: expected two numbers each, as written by jaxcontact.write_result"
            )
        wraps = bool(both[1])
    for name in ("x", "y"):
        _check_axis(name, arrays[name], alone=wraps and name == "y")
    sizes = {"x": arrays["x"].size, "y": arrays["y"].size, "direction": 2}
    if cls is InteriorFields:
        sizes |= {"depth": arrays["depths"].size, "row": 3, "column": 3, "component": 3}
        sizes["interface"] = arrays["interfaces"].size if "interfaces" in arrays else 0
    if has_times(cls):
        times = arrays["times"]
        good = times.ndim == 1 and times.size and np.all(np.isfinite(times)) and np.all(np.diff(times) >= 0.0)
        if not good:
            raise ValueError(
                f"times: found an array of shape {times.shape}, accepted: one or more that do not decrease"
            )
        sizes["time"] = times.size

    # each field on its axes; a map may lack that of time (save="last")
    for name in names:
        spec = [dim for dim in fields_of(names)[name].dimensions if dim in sizes]
        without_time = [dim for dim in spec if dim != "time"] if "x" in spec else spec
        whole, last = (tuple(sizes[dim] for dim in dims) for dims in (spec, without_time))
        if arrays[name].shape not in (whole, last):
            raise ValueError(f"{name}: found shape {arrays[name].shape}, accepted: {whole}, as its axes")


def notes_of(result: Any) -> dict[str, Any]:
    """Return what a file stores beside the arrays: the kind, notes, diagnostics, and properties of a periodic grid."""
    stored = {KIND: type(result).__name__, NOTES: "\n".join(result.notes)} | _of_grid(result.grid)
    if not hasattr(result, "diagnostics"):
        return stored
    return stored | {name: float(getattr(result.diagnostics, name)) for name in DIAGNOSTICS}


def _of_grid(grid: Grid) -> dict[str, np.ndarray]:
    if not any(grid.periodic):
        return {}
    return {PERIODIC: np.array(grid.periodic, int), SPACING: np.array([float(d) for d in grid.spacing])}


def _check_axis(name: str, values: np.ndarray, *, alone: bool) -> None:
    """Check that cell centres are equally spaced, so that they form a grid; alone: a single one is accepted."""
    if alone and values.shape == (1,) and np.all(np.isfinite(values)):
        return
    with np.errstate(all="ignore"):  # values that overflow are not equally spaced
        steps = np.diff(values) if values.ndim == 1 else np.zeros(0)
        equal = steps.size > 0 and steps[0] > 0.0 and np.ptp(steps) <= 1e-6 * steps[0] < np.inf
    if not equal:
        raise ValueError(
            f"{name}: found an array of shape {values.shape}, accepted: two or more equally spaced cell centres"
        )


def _grid(arrays: dict[str, np.ndarray]) -> Grid:
    """Return the grid whose cell centres are x and y."""
    axes = arrays["x"], arrays["y"]
    if PERIODIC in arrays:
        dx, dy = arrays[SPACING]
        wraps = bool(arrays[PERIODIC][0]), bool(arrays[PERIODIC][1])
    else:
        dx, dy = (float(axis[-1] - axis[0]) / (len(axis) - 1) for axis in axes)
        wraps = False, False
    return Grid((len(axes[0]), len(axes[1])), (jnp.asarray(dx), jnp.asarray(dy)), wraps)


def _inputs(case: dict[str, Any]) -> dict[str, Any]:
    """Return the numbers and texts of a case by their dotted names, after checking these against the reserved names."""
    inputs: dict[str, Any] = {}
    taken = RESERVED | {name for cls in result_classes().values() for name in fields_of(stored_fields(cls))}
    for name, value in _flat(case):
        own = name.partition(".")[0]
        if own in taken:
            raise ValueError(
                f"{own}: expected another name, such as case_{own}, got one that the file itself uses"
            )
        if name in inputs:
            raise ValueError(f"{name}: expected each name once, got it twice")
        if not isinstance(value, str) and value.dtype.kind not in "biufcU":
            raise ValueError(f"{name}: expected numbers, text or objects of jaxcontact, got {value.dtype}")
        inputs[name] = value
    return inputs


def _format(path: Path, formats: dict[str, Any]) -> Any:
    if path.suffix not in formats:
        found = path.suffix or "no ending"
        raise ValueError(f"{path}: found {found}, accepted: a file name that ends in {' or '.join(formats)}")
    return formats[path.suffix]


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield numbers and text by dotted names: the fields of dataclasses, the items of lists and dicts."""
    if dataclasses.is_dataclass(value):
        yield name, type(value).__name__
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _flat(item, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list | tuple) and not all(isinstance(item, int | float) for item in value):
        for index, item in enumerate(value):
            yield from _flat(item, f"{name}.{index}")
    elif isinstance(value, str) or value is None:
        yield name, value or "none"
    elif callable(value):  # the profile of a graded layer
        yield name, getattr(value, "__qualname__", type(value).__name__)
    else:
        yield name, np.asarray(value)


def _write_npz(path: Path, arrays: dict[str, np.ndarray], notes: dict[str, Any]) -> None:
    write_npz(path, arrays | notes)


def _read_npz(path: Path) -> tuple[dict[str, np.ndarray], str]:
    arrays = read_npz(path)
    return arrays, str(arrays.get(KIND, ""))


def _xarray() -> Any:
    try:
        import h5netcdf  # noqa: F401
        import h5py  # noqa: F401
        import xarray
    except ImportError as error:
        raise ImportError(
            f"NetCDF needs {error.name}; install it with: pip install 'jaxcontact[io]', or use a name in .npz"
        ) from error
    return xarray


def _write_netcdf(path: Path, arrays: dict[str, np.ndarray], notes: dict[str, Any]) -> None:
    """Write a NetCDF file, made in memory first because the HDF5 library ends the process where a disk is full."""
    _xarray()
    content = io.BytesIO()
    numbers = {name: notes[name] for name in DIAGNOSTICS if name in notes}
    # flag_meanings of the status has the names
    shown = {name: value for name, value in notes.items() if name not in (*numbers, STATUS_NAMES)}
    for name, value in shown.items():  # NetCDF has no truth values
        if np.asarray(value).dtype == bool:
            shown[name] = np.asarray(value, np.int8)
    whole = dataset(arrays, shown)
    if numbers:
        meaning = {"units": "1", "long_name": "numbers from which the notes are formed, as attributes"}
        whole[NUMBERS] = ((), np.int32(len(numbers)), meaning | numbers)
    ordered = whole.transpose(..., "y", "x")  # the order that ParaView expects
    ordered.to_netcdf(content, engine="h5netcdf")
    path.write_bytes(content.getbuffer())


def _read_netcdf(path: Path) -> tuple[dict[str, np.ndarray], str]:
    xarray = _xarray()
    import h5py

    try:
        with h5py.File(path, "r") as file:
            list(file)  # a damaged file fails here; h5netcdf would print an error in its destructor
        with xarray.open_dataset(path, engine="h5netcdf", decode_times=False) as file:
            ordered = file.transpose(..., "x", "y")
            arrays = {str(name): values.to_numpy() for name, values in ordered.variables.items()}
            kind = str(file.attrs.get(KIND, ""))
            beside = dict(file.attrs)  # those of files of earlier versions include the diagnostics
            if arrays.pop(NUMBERS, None) is not None:
                beside |= file[NUMBERS].attrs
            arrays |= {
                name: np.asarray(beside[name]) for name in (PERIODIC, SPACING, *DIAGNOSTICS) if name in beside
            }
    except Exception as error:  # the libraries' errors for damaged files have no common base class
        if isinstance(error, OSError) and error.errno:
            raise
        raise ValueError(
            f"{path}: not a complete NetCDF file; accepted: a file written by jaxcontact.write_result"
        ) from error
    for axis in {"time", "depth"} & set(arrays):
        arrays[f"{axis}s"] = arrays.pop(axis)
    return arrays, kind
