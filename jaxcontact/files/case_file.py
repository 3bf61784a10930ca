"""Case files: one simulation as a TOML file, in SI units.

``read_case`` turns a file into the objects of the package by the schema in ``case_schema``, or raises a
``CaseError`` of one line that names the file, the key, what was found and what is accepted.
"""

import difflib
import reprlib
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jaxcontact import indenters, materials
from jaxcontact.controls import Approach, Control, Load
from jaxcontact.files.case_schema import (
    LARGEST,
    MATERIALS,
    REQUIRED_SECTIONS,
    SECTIONS,
    SHAPES,
    TABLE,
    TABLES,
    Key,
    choice,
)
from jaxcontact.files.npz import read_npy
from jaxcontact.grid import Grid
from jaxcontact.layers import Layer, LayeredHalfSpace

Table = dict[str, Any]


class CaseError(ValueError):
    """A case file that cannot be run; the message is one line for the user."""


@dataclass(frozen=True)
class Case:
    """A simulation as read: the arguments of ``simulation.simulate``; options: its keywords.

    tables: the file as it stood, without what is absent there.
    """

    tables: Table
    body: LayeredHalfSpace
    indenter: indenters.Indenter
    control: Control
    times: np.ndarray
    grid: Grid
    options: Table


def read_case(path: Path) -> Case:
    """The case in a TOML file. Raises CaseError for a file that is missing, broken or wrong."""
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise CaseError(
            f"{path}: {reason}; expected a TOML file of a case, or a name that jaxcontact cases lists"
        ) from error
    except (
        ValueError,
        RecursionError,
    ) as error:  # a decoding error, a number of too many digits, too deep a list
        raise CaseError(f"{path}: not TOML: {error}") from error
    try:
        return _case(tables, path.parent)
    except ValueError as error:
        raise CaseError(f"{path}: {error}") from error


def _case(tables: Table, folder: Path) -> Case:
    sections = {name: Key(TABLE, "", name in REQUIRED_SECTIONS) for name in SECTIONS} | {
        "layer": Key(TABLES, "")
    }
    _check_table("", tables, sections)
    for name in ("grid", "solver", "control", "times"):
        _check_table(name, tables.get(name, {}), SECTIONS[name])
    body = _body(tables)
    indenter = _indenter(tables["indenter"], folder)
    times = _times(tables["times"])
    control = _control(tables["control"], times.size)
    grid = _grid(tables.get("grid", {}), body, indenter, control, times)
    return Case(tables, body, indenter, control, times, grid, dict(tables.get("solver", {})))


def _check_table(where: str, table: Table, keys: dict[str, Key]) -> None:
    """No unknown key, no missing one, and each value as accepted."""
    for name, value in table.items():
        if name not in keys:
            raise CaseError(f"{_path(where, name)}: unknown key; {_suggestion(name, list(keys))}")
        if not keys[name].accept.test(value):
            raise CaseError(f"{_path(where, name)}: found {_show(value)}, accepted: {keys[name].words}")
    for name, key in keys.items():
        if key.required and name not in table:
            raise CaseError(f"{_path(where, name)}: missing; accepted: {key.words}")


def _path(where: str, name: str) -> str:
    return f"{where}.{name}" if where else f"[{name}]"


def _suggestion(name: str, known: list[str]) -> str:
    close = difflib.get_close_matches(name, known, n=1) or difflib.get_close_matches(name.lower(), known, n=1)
    hint = f'did you mean "{close[0]}"? ' if close else ""
    return f"{hint}accepted: {', '.join(known)}"


def _show(value: Any) -> str:
    """The value as found, on one line and not too long."""
    try:
        text = f'"{value}"' if isinstance(value, str) else reprlib.repr(value)
    except ValueError:  # Python writes no whole number of over 4300 digits
        text = "a number of too many digits"
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."


def _choose(where: str, table: Table, key: str, own: dict[str, Key], choices: dict[str, Any]) -> Any:
    """The class that ``table[key]`` names, and the values of its parameters, all checked."""
    if key not in table or not own[key].accept.test(table[key]):
        _check_table(where, {k: v for k, v in table.items() if k == key}, {key: own[key]})
    chosen, parameters = choices[table[key]]
    _check_table(where, table, own | parameters)
    return chosen, {name: _as_float(table[name]) for name in parameters if name in table}


def _as_float(value: Any) -> Any:
    """Whole numbers as floats, since jax has none of over 64 bits; lists as arrays; text as it is."""
    if isinstance(value, list):
        return np.array(value, dtype=float)
    return float(value) if isinstance(value, int) else value


def _material(where: str, table: Table, own: dict[str, Key]) -> Any:
    chosen, values = _choose(where, table, "material", own, MATERIALS)
    if "nu" in values and "bulk_modulus" in values:
        raise CaseError(f"{where}.nu: found both nu and bulk_modulus; accepted: one of them")
    if chosen is not materials.Elastic:
        return _same_length(where, chosen(**values))
    if ("G" in values) == ("E" in values):
        found = "both" if "G" in values else "neither"
        raise CaseError(f"{where}.G: found {found} G and E; accepted: one of them, a number > 0 [Pa]")
    return chosen.from_young(**values) if "E" in values else chosen(**values)


def _same_length(where: str, material: Any) -> Any:
    """A Prony material needs one time per compliance."""
    if isinstance(material, materials.Prony) and np.shape(material.J) != np.shape(material.tau):
        found = f"{np.size(material.tau)} for {np.size(material.J)} in J"
        raise CaseError(f"{where}.tau: found {found}; accepted: as many numbers as in J")
    return material


def _body(tables: Table) -> LayeredHalfSpace:
    layers = [
        Layer(_material(where, table, SECTIONS["layer"]), float(table["thickness"]))
        for where, table in layer_tables(tables)
    ]
    return LayeredHalfSpace(layers, _material("substrate", tables["substrate"], SECTIONS["substrate"]))


def layer_tables(tables: Table) -> list[tuple[str, Table]]:
    """The name and the table of each layer: one [layer], or a [[layer]] for each from the top down."""
    given = tables.get("layer", [])
    if isinstance(given, list):
        return [(f"layer[{i}]", table) for i, table in enumerate(given)]
    return [("layer", given)]


def _indenter(table: Table, folder: Path) -> indenters.Indenter:
    chosen, values = _choose("indenter", table, "shape", SECTIONS["indenter"], SHAPES)
    material = None
    if "material" in table:
        own = {"material": Key(choice("elastic"), "elastic when absent")}
        material = _material("indenter.material", {"material": "elastic"} | table["material"], own)
    if "heights" in values:
        values["heights"] = _heights(folder / values["heights"])
    return chosen(**values, material=material)


def _heights(path: Path) -> np.ndarray:
    """The heights in a .npy file: two-dimensional, finite."""
    accepted = "accepted: a .npy file of finite heights (nx, ny) [m]"
    try:
        heights = read_npy(path)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not a .npy file of numbers"
        raise CaseError(f"indenter.heights: {path}: {reason}; {accepted}") from error
    if heights.dtype.kind not in "fiu" or heights.ndim != 2:
        raise CaseError(f"indenter.heights: {path}: not a two-dimensional array of numbers; {accepted}")
    if not np.all(np.abs(heights) <= LARGEST):
        raise CaseError(
            f"indenter.heights: {path}: found values that are not finite or not below {LARGEST:g}; {accepted}"
        )
    return heights.astype(float)


def _control(table: Table, nt: int) -> Control:
    if len(table) != 1:
        found = "both load and approach" if table else "neither load nor approach"
        raise CaseError(f"[control]: found {found}; accepted: one of load [N] and approach [m]")
    ((name, value),) = table.items()
    if isinstance(value, list) and len(value) != nt:
        raise CaseError(
            f"control.{name}: found {len(value)} values; accepted: a number, or {nt} values as times"
        )
    return (Load if name == "load" else Approach)(np.array(value, dtype=float))


def _times(table: Table) -> np.ndarray:
    """From the values, or steps from 0 to the end, uniform or logarithmic from ``first``."""
    if "values" in table:
        if len(table) > 1:
            others = ", ".join(name for name in table if name != "values")
            raise CaseError(f"times.values: found with {others}; accepted: values alone, or end and steps")
        return np.array(table["values"], dtype=float)
    logarithmic = table.get("spacing") == "logarithmic"
    for name in ("end", "steps") + (("first",) if logarithmic else ()):
        if name not in table:
            raise CaseError(f"times.{name}: missing; accepted: {SECTIONS['times'][name].words}")
    end, steps = float(table["end"]), table["steps"]
    if not logarithmic:
        if "first" in table:
            raise CaseError('times.first: found with uniform spacing; accepted: with spacing = "logarithmic"')
        return np.linspace(0.0, end, steps + 1)
    if table["first"] > end:
        raise CaseError(f"times.first: found {table['first']:g}, accepted: a number not above end = {end:g}")
    return np.append(0.0, np.geomspace(float(table["first"]), end, steps))


def _grid(table: Table, body: Any, indenter: Any, control: Control, times: np.ndarray) -> Grid:
    if ("shape" in table) != ("spacing" in table):
        name = "spacing" if "shape" in table else "shape"
        raise CaseError(f"grid.{name}: missing; accepted: {SECTIONS['grid'][name].words}")
    if "shape" in table:
        extra = [name for name in ("n", "width") if name in table]
        if extra:
            raise CaseError(f"grid.{extra[0]}: found with shape; accepted: shape and spacing, or n and width")
        return Grid(shape=tuple(table["shape"]), spacing=tuple(map(float, table["spacing"])))
    n = table.get("n", 256)
    if "width" in table:
        return Grid.square(n, float(table["width"]))
    if isinstance(indenter, indenters.HeightField):
        raise CaseError(
            "grid.shape: missing; accepted with a height field: shape and spacing, or n and width"
        )
    return Grid.around(body, indenter, control, times, n=n)
