"""Case files: one simulation as a TOML file, in SI units.

``SECTIONS``, ``MATERIALS`` and ``SHAPES`` are the schema: for every key what it accepts, what it means,
and whether it must be there. ``read_case`` turns a file into the objects of the package, or raises a
``CaseError`` of one line that names the file, the key, what was found and what is accepted.
"""

import difflib
import math
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jaxcontact import geometry, materials
from jaxcontact.controls import Approach, Control, Load
from jaxcontact.grid import Grid
from jaxcontact.layers import Layer, LayeredHalfSpace

Table = dict[str, Any]


class CaseError(ValueError):
    """A case file that cannot be run; the message is one line for the user."""


@dataclass(frozen=True)
class Accept:
    """What a value may be: a test, and the same in words."""

    test: Callable[[Any], bool]
    words: str


@dataclass(frozen=True)
class Key:
    """A key of a table: what it accepts, what it means, whether it must be there."""

    accept: Accept
    meaning: str
    required: bool = False


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_whole(value: Any, low: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= low


def _all_numbers(value: Any, low: float = -math.inf) -> bool:
    return isinstance(value, list) and bool(value) and all(_is_number(v) and v >= low for v in value)


def _pair(value: Any, test: Callable[[Any], bool]) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(test, value))


def _is_load(value: Any) -> bool:
    """A load, or a history of loads that is positive somewhere."""
    values = value if isinstance(value, list) else [value]
    return _all_numbers(values, 0.0) and max(values) > 0


def one_of(*names: str) -> Accept:
    """One of some words."""
    return Accept(lambda v: v in names, " | ".join(f'"{name}"' for name in names))


def whole(low: int) -> Accept:
    """A whole number, not below ``low``."""
    return Accept(lambda v: _is_whole(v, low), f"a whole number of at least {low}")


POSITIVE = Accept(lambda v: _is_number(v) and v > 0, "a number > 0")
NOT_NEGATIVE = Accept(lambda v: _is_number(v) and v >= 0, "a number >= 0")
NUMBER = Accept(_is_number, "a number")
POISSON = Accept(lambda v: _is_number(v) and -1 < v <= 0.5, "a number with -1 < nu <= 0.5")
LOAD = Accept(_is_load, "a number > 0, or a list of numbers >= 0 that are not all zero")
NUMBERS = Accept(lambda v: _is_number(v) or _all_numbers(v), "a number or a list of numbers")
POSITIVE_LIST = Accept(lambda v: _all_numbers(v) and min(v) > 0, "a list of numbers > 0")
NOT_NEGATIVE_LIST = Accept(lambda v: _all_numbers(v, 0.0), "a list of numbers >= 0")
TIMES = Accept(
    lambda v: _all_numbers(v) and sorted(v) == v, "a list of numbers that do not decrease, one or more"
)
SHAPE = Accept(lambda v: _pair(v, lambda n: _is_whole(n, 4)), "[nx, ny], whole numbers of at least 4")
SPACING = Accept(lambda v: _pair(v, POSITIVE.test), "[dx, dy], numbers > 0")
TEXT = Accept(lambda v: isinstance(v, str), "text")
TABLE = Accept(lambda v: isinstance(v, dict), "a table")

G = Key(POSITIVE, "shear modulus [Pa]", required=True)
ETA = Key(POSITIVE, "viscosity [Pa s]", required=True)
NU = Key(POISSON, "Poisson's ratio, 0.3 when absent")

MATERIALS: dict[str, tuple[type, dict[str, Key]]] = {
    "elastic": (
        materials.Elastic,
        {"G": Key(POSITIVE, "shear modulus [Pa]"), "E": Key(POSITIVE, "Young's modulus [Pa]"), "nu": NU},
    ),
    "maxwell": (materials.Maxwell, {"G": G, "eta": ETA, "nu": NU}),
    "kelvin-voigt": (materials.KelvinVoigt, {"G": G, "eta": ETA, "nu": NU}),
    "standard-linear-solid": (materials.StandardLinearSolid, {"G1": G, "G2": G, "eta2": ETA, "nu": NU}),
    "burgers": (materials.Burgers, {"G1": G, "G2": G, "eta1": ETA, "eta2": ETA, "nu": NU}),
    "prony": (
        materials.Prony,
        {
            "J0": Key(NOT_NEGATIVE, "instantaneous compliance [1/Pa]", required=True),
            "J": Key(NOT_NEGATIVE_LIST, "delayed compliances [1/Pa]", required=True),
            "tau": Key(POSITIVE_LIST, "retardation times [s]", required=True),
            "fluidity": Key(NOT_NEGATIVE, "rate of flow [1/(Pa s)], 0 when absent"),
            "nu": NU,
        },
    ),
}

RADIUS = Key(POSITIVE, "radius [m]", required=True)

SHAPES: dict[str, tuple[type, dict[str, Key]]] = {
    "sphere": (geometry.Sphere, {"radius": RADIUS}),
    "cylinder": (
        geometry.Cylinder,
        {"radius": RADIUS, "length": Key(POSITIVE, "length along y [m]", required=True)},
    ),
    "flat-punch": (geometry.FlatPunch, {"radius": RADIUS}),
    "height-field": (
        geometry.HeightField,
        {"heights": Key(TEXT, "a .npy file of heights (nx, ny) [m], relative to the case", required=True)},
    ),
}

MATERIAL = Key(one_of(*MATERIALS), "the model, whose parameters stand beside it", required=True)

SECTIONS: dict[str, dict[str, Key]] = {
    "layer": {"material": MATERIAL, "thickness": Key(POSITIVE, "thickness [m]", required=True)},
    "substrate": {"material": MATERIAL},
    "indenter": {
        "shape": Key(one_of(*SHAPES), "the shape, whose sizes stand beside it", required=True),
        "material": Key(TABLE, "a table of an elastic material; rigid when absent"),
    },
    "control": {
        "load": Key(LOAD, "normal load [N], held or one per time"),
        "approach": Key(NUMBERS, "approach from first touch [m], held or one per time"),
    },
    "times": {
        "end": Key(POSITIVE, "the last time [s]; the first is 0"),
        "steps": Key(whole(1), "number of steps to the end"),
        "spacing": Key(one_of("uniform", "logarithmic"), "uniform when absent"),
        "first": Key(POSITIVE, "the first time after 0 of logarithmic spacing [s]"),
        "values": Key(TIMES, "the times themselves [s], in place of the others"),
    },
    "grid": {
        "n": Key(whole(4), "cells along x and y, 256 when absent"),
        "width": Key(POSITIVE, "width along x and y [m]; from the expected contact when absent"),
        "shape": Key(SHAPE, "cells along x and y, in place of n; with spacing"),
        "spacing": Key(SPACING, "size of a cell [m]; with shape"),
    },
    "solver": {
        "tolerance": Key(POSITIVE, "dimensionless error of a step, 1e-8 when absent"),
        "max_iterations": Key(whole(1), "iterations of a step, 500 when absent"),
        "substeps": Key(
            Accept(lambda v: _is_whole(v, 1) and v <= 1000, "a whole number from 1 to 1000"),
            "inner steps between two times, 1 when absent",
        ),
        "correspondence": Key(one_of("exact", "quasi-elastic"), "exact when absent"),
        "save": Key(one_of("all", "last"), "fields kept: those of all times (when absent) or of the last"),
    },
}
REQUIRED_SECTIONS = ("substrate", "indenter", "control", "times")


@dataclass(frozen=True)
class Case:
    """A simulation as read: the arguments of ``simulation.simulate``; options: its keywords."""

    body: LayeredHalfSpace
    indenter: geometry.Indenter
    control: Control
    times: np.ndarray
    grid: Grid
    options: Table


def read_case(path: Path) -> Case:
    """The case in a TOML file. Raises CaseError for a file that is missing, broken or wrong."""
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise CaseError(f"{path}: {reason}; expected a TOML file of a case") from error
    except tomllib.TOMLDecodeError as error:
        raise CaseError(f"{path}: not TOML: {error}") from error
    try:
        return _case(tables, path.parent)
    except ValueError as error:
        raise CaseError(f"{path}: {error}") from error


def _case(tables: Table, folder: Path) -> Case:
    sections = {name: Key(TABLE, "", name in REQUIRED_SECTIONS) for name in SECTIONS}
    _check_table("", tables, sections)
    for name in ("grid", "solver", "control", "times"):
        _check_table(name, tables.get(name, {}), SECTIONS[name])
    body = _body(tables)
    indenter = _indenter(tables["indenter"], folder)
    times = _times(tables["times"])
    control = _control(tables["control"], times.size)
    grid = _grid(tables.get("grid", {}), body, indenter, control, times)
    return Case(body, indenter, control, times, grid, dict(tables.get("solver", {})))


def _check_table(where: str, table: Table, keys: dict[str, Key]) -> None:
    """No unknown key, no missing one, and each value as accepted."""
    for name, value in table.items():
        if name not in keys:
            raise CaseError(f"{_path(where, name)}: unknown key; {_suggestion(name, list(keys))}")
        if not keys[name].accept.test(value):
            raise CaseError(f"{_path(where, name)}: found {_show(value)}, accepted: {_words(keys[name])}")
    for name, key in keys.items():
        if key.required and name not in table:
            raise CaseError(f"{_path(where, name)}: missing; accepted: {_words(key)}")


def _path(where: str, name: str) -> str:
    return f"{where}.{name}" if where else f"[{name}]"


def _words(key: Key) -> str:
    return f"{key.accept.words}: {key.meaning}" if key.meaning else key.accept.words


def _suggestion(name: str, known: list[str]) -> str:
    close = difflib.get_close_matches(name, known, n=1) or difflib.get_close_matches(name.lower(), known, n=1)
    hint = f'did you mean "{close[0]}"? ' if close else ""
    return f"{hint}accepted: {', '.join(known)}"


def _show(value: Any) -> str:
    """The value as found, on one line and not too long."""
    text = f'"{value}"' if isinstance(value, str) else repr(value)
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."


def _choose(where: str, table: Table, key: str, own: dict[str, Key], choices: dict[str, Any]) -> Any:
    """The class that ``table[key]`` names, and the values of its parameters, all checked."""
    if key not in table or not own[key].accept.test(table[key]):
        _check_table(where, {k: v for k, v in table.items() if k == key}, {key: own[key]})
    chosen, parameters = choices[table[key]]
    _check_table(where, table, own | parameters)
    return chosen, {name: table[name] for name in parameters if name in table}


def _material(where: str, table: Table, own: dict[str, Key]) -> Any:
    chosen, values = _choose(where, table, "material", own, MATERIALS)
    if chosen is not materials.Elastic:
        arrays = {k: np.array(v, dtype=float) if isinstance(v, list) else v for k, v in values.items()}
        return _same_length(where, chosen(**arrays))
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
    layers = []
    if "layer" in tables:
        film = _material("layer", tables["layer"], SECTIONS["layer"])
        layers = [Layer(film, tables["layer"]["thickness"])]
    substrate = _material("substrate", tables["substrate"], SECTIONS["substrate"])
    if layers and not isinstance(substrate, materials.Elastic):
        found = tables["substrate"]["material"]
        raise CaseError(f'substrate.material: found "{found}", accepted: "elastic" under a layer')
    return LayeredHalfSpace(layers, substrate)


def _indenter(table: Table, folder: Path) -> geometry.Indenter:
    chosen, values = _choose("indenter", table, "shape", SECTIONS["indenter"], SHAPES)
    material = None
    if "material" in table:
        own = {"material": Key(one_of("elastic"), "elastic when absent")}
        material = _material("indenter.material", {"material": "elastic"} | table["material"], own)
    if "heights" in values:
        values["heights"] = _heights(folder / values["heights"])
    return chosen(**values, material=material)


def _heights(path: Path) -> np.ndarray:
    """The heights in a .npy file: two-dimensional, finite."""
    accepted = "accepted: a .npy file of finite heights (nx, ny) [m]"
    try:
        heights = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        reason = getattr(error, "strerror", None) or "not a .npy file of numbers"
        raise CaseError(f"indenter.heights: {path}: {reason}; {accepted}") from error
    if not isinstance(heights, np.ndarray) or heights.dtype.kind not in "fiu" or heights.ndim != 2:
        raise CaseError(f"indenter.heights: {path}: not a two-dimensional array of numbers; {accepted}")
    if not np.all(np.isfinite(heights)):
        raise CaseError(f"indenter.heights: {path}: found values that are not finite; {accepted}")
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
            raise CaseError(f"times.{name}: missing; accepted: {_words(SECTIONS['times'][name])}")
    end, steps = table["end"], table["steps"]
    if not logarithmic:
        if "first" in table:
            raise CaseError('times.first: found with uniform spacing; accepted: with spacing = "logarithmic"')
        return np.linspace(0.0, end, steps + 1)
    if table["first"] > end:
        raise CaseError(f"times.first: found {table['first']:g}, accepted: a number not above end = {end:g}")
    return np.append(0.0, np.geomspace(table["first"], end, steps))


def _grid(table: Table, body: Any, indenter: Any, control: Control, times: np.ndarray) -> Grid:
    if ("shape" in table) != ("spacing" in table):
        name = "spacing" if "shape" in table else "shape"
        raise CaseError(f"grid.{name}: missing; accepted: {_words(SECTIONS['grid'][name])}")
    if "shape" in table:
        extra = [name for name in ("n", "width") if name in table]
        if extra:
            raise CaseError(f"grid.{extra[0]}: found with shape; accepted: shape and spacing, or n and width")
        return Grid(shape=tuple(table["shape"]), spacing=tuple(map(float, table["spacing"])))
    n = table.get("n", 256)
    if "width" in table:
        return Grid.square(n, float(table["width"]))
    if isinstance(indenter, geometry.HeightField):
        raise CaseError(
            "grid.shape: missing; accepted with a height field: shape and spacing, or n and width"
        )
    return Grid.around(body, indenter, control, times, n=n)
