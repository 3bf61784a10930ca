"""Case files: one experiment as a TOML file, in SI units, or with a unit behind the number: "150 nm".

``read_case`` turns a file into the objects of the package by the schema in ``case_schema``, or raises a ``CaseError`` of one
line that names the file, the key, what was found and what is accepted. It checks each key and each value before it makes an
object.
"""

import difflib
import functools
import json
import operator
import re
import reprlib
import textwrap
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from jaxcontact._support.fields import FIELDS, stored_fields
from jaxcontact._support.files import read_npy
from jaxcontact._support.prefixes import prefixed
from jaxcontact.bodies import materials
from jaxcontact.bodies.body import Layer, LayeredHalfSpace, at_its_thickest
from jaxcontact.bodies.controls import Approach, Control, Load, TangentialDisplacement, TangentialLoad
from jaxcontact.bodies.grid import Grid
from jaxcontact.indenters import shapes
from jaxcontact.shell.case_schema import (
    BASES,
    BONDED,
    KIND,
    KINDS,
    LARGEST,
    LAST,
    LAWS,
    MATERIAL,
    MATERIALS,
    OPTIONAL_SECTIONS,
    PARTS,
    SEVERAL,
    SHAPES,
    TABLE,
    TABLES,
    THICKNESS,
    Accept,
    Key,
    Keys,
    choice,
    in_si,
    kept_unless_said,
    sections_of,
    take_up_material,
)
from jaxcontact.simulate.run import Experiment

# The tables of a case file: reading them, checking their keys and values, and converting values with units to SI.


Table = dict[str, Any]
# fields of results that a contact without adhesion does not have
ADHESIVE_FIELDS = ("contact_pressure", "jumps", "jump_energy", "cohesive_cells", "tabor_number")


class CaseError(ValueError):
    """A case file that cannot be run; the message is one line for the user."""


def read_tables(path: Path) -> Table:
    """Return the contents of a TOML file; CaseError for a file that is missing or broken."""
    text = ""
    try:
        text = path.read_text(encoding="utf-8-sig")
        return tomllib.loads(text)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        packaged = [case.stem for case in (Path(__file__).parents[1] / "cases").rglob("*.toml")]
        close = difflib.get_close_matches(str(path), packaged, n=1)
        raise CaseError(
            f"{path}: {reason}; expected a TOML file of a case, or a name that jaxcontact cases lists"
            + (f'; did you mean "{close[0]}"?' if close else "")
        ) from error
    # a decoding error, a number of too many digits, too deep a list
    except (ValueError, RecursionError) as error:
        place = re.search(r"line (\d+)", str(error))
        lines = text.splitlines()
        line = lines[int(place[1]) - 1] if place and int(place[1]) <= len(lines) else ""
        # the usual mistake is a value that is text without quotes (450 GPa)
        unquoted = re.fullmatch(r"\s*([\w.\-]+)\s*=\s*([^\s\"'\[{#=][^\"'\[\]{}#=]*?)\s*(?:#.*)?", line)
        advice = ""
        if unquoted is not None:
            corrected = f'{unquoted[1]} = "{unquoted[2]}"'
            advice = f"; expected text, and a number with a unit, in quotes: {corrected}"
        raise CaseError(f"{path}: not TOML: {error}{advice}") from error


def tables_named(name: str, tables: Table) -> list[tuple[str, Table]]:
    """Return the tables of a section that may be given several times, each with its name: of layers from the top down."""
    given = tables.get(name, [])
    if isinstance(given, list):
        return [(f"{name}[{i}]", table) for i, table in enumerate(given)]
    return [(name, given)]


def coats_of(tables: Table) -> list[tuple[str, Table]]:
    """Return the layers on the indenter, each with its name."""
    return tables_named("indenter.layer", {"indenter.layer": tables.get("indenter", {}).get("layer", [])})


def kind_of(tables: Table) -> tuple[str, dict[str, Keys]]:
    """Return the kind of experiment, and its tables with their keys; CaseError for a key of another kind."""
    every = {name: keys for kind in KINDS for name, keys in sections_of(kind).items()}
    check_table("", tables, {name: Key(_accepted(name), "") for name in every})
    kind = tables.get("experiment", {}).get("kind", KIND.default)
    check_table("experiment", {"kind": kind}, {"kind": KIND})
    own = sections_of(kind)
    for name, table in tables.items():
        _check_of_kind(kind, f"[{name}]", {other: name in sections_of(other) for other in KINDS})
        for key in table if name in ("experiment", "control", "solver") else ():
            having = {other: key in sections_of(other).get(name, {}) for other in KINDS}
            _check_of_kind(kind, f"{name}.{key}", having)
    return kind, own


def with_si_values(tables: Table, sections: dict[str, Keys]) -> Table:
    """Return the tables with numbers in SI units in place of text with a unit."""
    keys = _keys_by_table(sections)
    converted = {name: _plain_table(name, table, keys.get(name, {})) for name, table in tables.items()}
    ball = tables.get("indenter", {}).get("material")
    if isinstance(ball, dict):
        converted["indenter"]["material"] = _plain_table("indenter.material", ball, keys["substrate"])
    coats = coats_of(tables)
    if coats:
        given = tables["indenter"]["layer"]
        plain = [_plain_table(where, table, keys["layer"]) for where, table in coats]
        converted["indenter"]["layer"] = plain if isinstance(given, list) else plain[0]
    for name in SEVERAL:
        if isinstance(tables.get(name), list):
            converted[name] = [
                _plain_table(where, table, keys[name]) for where, table in tables_named(name, tables)
            ]
    return converted


def unit_of(dotted: str, sections: dict[str, Keys]) -> str | None:
    """Return the SI unit of a key such as "layer[0].thickness"; None of text, counts, plain numbers and unknown keys."""
    key = _key_of(dotted, sections)
    return None if key is None else key.unit


def si_value(dotted: str, value: Any) -> Any:
    """Return a value in [sweep] of a key such as "layer[0].thickness", with SI numbers in place of texts with a unit.

    The key may be one of any kind of experiment. Raises CaseError for a text that is no quantity of its dimension.
    """
    for kind in KINDS:
        key = _key_of(dotted, sections_of(kind))
        if key is not None:
            return _plain(f"sweep.{dotted}", value, key)
    return value


def _key_of(dotted: str, sections: dict[str, Keys]) -> Key | None:
    table, *between, name = re.sub(r"\[\d+\]", "", dotted).split(".")
    own = "layer" if "layer" in between else "substrate" if "material" in between else table
    return _keys_by_table(sections).get(own, {}).get(name)


def _keys_by_table(sections: dict[str, Keys]) -> dict[str, Keys]:
    """Return the keys of each table with those of all materials, shapes and laws that may stand in it."""
    solid = {name: key for _, keys in MATERIALS.values() for name, key in keys.items()}
    shape = {name: key for _, keys in SHAPES.values() for name, key in keys.items()}
    law = {name: key for _, keys in LAWS.values() for name, key in keys.items()}
    beside = {"layer": solid, "substrate": solid, "indenter": shape, "adhesion": law}
    return {name: own | beside.get(name, {}) for name, own in sections.items()}


def _plain_table(where: str, table: Any, keys: Keys) -> Any:
    """Return a table with plain numbers for its quantities; anything else is returned unchanged."""
    if not isinstance(table, dict):
        return table
    return {
        name: _plain(_path(where, name), value, keys[name]) if name in keys else value
        for name, value in table.items()
    }


def _plain(where: str, value: Any, key: Key) -> Any:
    """Return the number in SI of a text with a unit, also in lists."""
    if key.unit is None or (key.file and isinstance(value, str) and value.endswith(".npy")):
        return value
    if isinstance(value, list):
        return [_plain(where, item, key) for item in value]
    if not isinstance(value, str):
        return value
    try:
        return in_si(value, key.unit)
    except ValueError as error:
        raise CaseError(f"{where}: found {shown(value)}, accepted: {key.words}, or {error}") from error


def _check_of_kind(kind: str, path: str, having: dict[str, bool]) -> None:
    others = [f'"{other}"' for other, has in having.items() if has]
    if others and not having[kind]:
        raise CaseError(
            f'{path}: found with experiment.kind = "{kind}", accepted: with {" or ".join(others)}'
        )


def tables_of(sections: dict[str, Keys]) -> Keys:
    """Return the keys of the file itself, which are its tables."""
    return {name: Key(_accepted(name), "", name not in OPTIONAL_SECTIONS) for name in sections}


def _accepted(section: str) -> Accept:
    return TABLES if section in SEVERAL else TABLE


def check_table(where: str, table: Table, keys: dict[str, Key]) -> None:
    """Raise CaseError for an unknown key, a missing one, or a value that its key does not accept."""
    for mistake in _mistakes_in_table(where, table, keys):
        raise CaseError(mistake)


def _mistakes_in_table(where: str, table: Table, keys: Keys) -> Iterator[str]:
    """Yield a line for each unknown key, value that its key does not accept, and missing key."""
    meant = set()
    for name, value in table.items():
        if name not in keys:
            near = lambda text: difflib.get_close_matches(text, list(keys), n=1)
            close = near(name) or near(name.lower())
            meant.update(close)
            hint = f'did you mean "{close[0]}"? ' if close else ""
            yield f"{_path(where, name)}: unknown key; {hint}accepted: {', '.join(keys)}"
        elif not keys[name].accept.test(value):
            yield f"{_path(where, name)}: found {shown(value)}, accepted: {keys[name].words}"
    for name, key in keys.items():
        if key.required and name not in table and name not in meant:  # a misspelt one is not missing
            yield f"{_path(where, name)}: missing; accepted: {key.words}"


def mistakes_in_tables(tables: Table) -> Iterator[str]:
    """Yield a line for each table, key and value of a case that does not belong where it is.

    ``case_of`` raises for one of them, and for values that do not suit each other.
    """
    if "sweep" in tables:
        return
    every = {name: Key(_accepted(name), "") for kind in KINDS for name in sections_of(kind)}
    right = {
        name: table for name, table in tables.items() if name in every and every[name].accept.test(table)
    }
    try:
        kind, _ = kind_of(right)
    except CaseError as error:  # which tables and keys are right depends on the kind
        yield from _mistakes_in_table("", tables, every)
        yield str(error)
        return
    sections = sections_of(kind, adhesive="adhesion" in tables)
    yield from _mistakes_in_table("", tables, every | tables_of(sections))

    # each table that is there, with its name and its keys
    found: list[tuple[str, Table, Keys]] = [
        (name, right[name], sections[name])
        for name in ("experiment", "grid", "solver", "control", "times")
        if name in right
    ]
    for name, part in KINDS[kind].parts.items():
        found += [(where, table, part.keys) for where, table in tables_named(name, right)]

    # those of a material, shape or law have the keys of the one that they choose, too
    ball = right.get("indenter", {})
    solid, layers = ball.get("material"), ball.get("layer", [])
    choosing: list[tuple[list[tuple[str, Table]], str, Keys, Any]] = [
        (tables_named("layer", right), "material", sections["layer"], MATERIALS),
        (tables_named("substrate", right), "material", sections["substrate"], BASES),
        (tables_named("indenter", right), "shape", sections["indenter"], SHAPES),
        (coats_of(right) if TABLES.test(layers) else [], "material", COAT, MATERIALS),
        (tables_named("adhesion", right), "law", sections.get("adhesion", {}), LAWS),
    ]
    if isinstance(solid, dict):
        named = [("indenter.material", {"material": "elastic"} | solid)]
        choosing.append((named, "material", _keys_of_ball(), MATERIALS))
    for named, key, own, choices in choosing:
        for where, table in named:
            if own[key].accept.test(table.get(key)):
                found.append((where, table, own | choices[table[key]][1]))
            else:  # the other keys are those of a material, shape or law that is not known
                found.append((where, {key: table[key]} if key in table else {}, {key: own[key]}))

    for where, table, keys in found:
        plain = dict(table)
        for name in [name for name in table if name in keys]:
            try:
                plain[name] = _plain(_path(where, name), table[name], keys[name])
            except CaseError as error:  # a text that is no quantity is one mistake, not also a value
                yield str(error)
                keys = keys | {name: Key(Accept(lambda value: True, ""), "")}
        yield from _mistakes_in_table(where, plain, keys)


def _path(where: str, name: str) -> str:
    return f"{where}.{name}" if where else f"[{name}]"


def shown(value: Any) -> str:
    """Return the value as found, on one line of at most 60 characters."""
    try:
        text = f'"{value}"' if isinstance(value, str) else reprlib.repr(value)
    except ValueError:  # Python writes no whole number of over 4300 digits
        text = "a number of too many digits"
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."


@dataclass(frozen=True)
class Case:
    """An experiment as read: the arguments of the function that runs it.

    kind: of ``KINDS``; tables: the file as it stood, without what is absent there; times: a single zero for a steady
    state; motion: what the function of this kind takes beyond those of ``indent``; options: the keywords of its solver;
    kept: of which times a run writes maps (``shell.case_schema``).
    """

    kind: str
    tables: Table
    body: LayeredHalfSpace
    indenter: shapes.Indenter
    control: Control
    times: np.ndarray
    grid: Grid
    motion: Table
    options: Table
    kept: str

    @property
    def result(self) -> type:
        """The class of its result."""
        return _result(self.kind, self.tables)

    def run(self) -> Any:
        """Return the result of the function that runs an experiment of this kind."""
        given = {"body": self.body, "indenter": self.indenter, "control": self.control, "grid": self.grid}
        over_time = {} if KINDS[self.kind].times is None else {"times": self.times}
        return KINDS[self.kind].verb(**given, **over_time, **self.motion, **self.options)

    def experiment(self) -> Experiment | None:
        """Return the checked experiment, to march in blocks; None for a steady state. Raises ValueError as ``run``."""
        march = KINDS[self.kind].march
        return None if march is None else march(**self.arguments(), **self.motion)

    def arguments(self) -> Table:
        """Return the contact and the options of its solution, as arguments of ``Experiment.of``."""
        keys = KINDS[self.kind].solver.items()
        defaults = {name: key.default for name, key in keys if key.default is not None}
        contact = {"body": self.body, "indenter": self.indenter, "control": self.control}
        return contact | {"times": self.times, "grid": self.grid} | defaults | self.options

    @property
    def body_for_estimates(self) -> LayeredHalfSpace:
        """The body with layers of one thickness each, the largest."""
        return at_its_thickest(self.body)


def read_case(path: Path) -> Case:
    """The case in a TOML file. Raises CaseError for a file that is missing, broken or wrong."""
    return case_of(read_tables(path), path)


def case_of(tables: Table, path: Path) -> Case:
    """The case in the tables of a file. Raises CaseError for one that is wrong."""
    try:
        return _case(tables, path.parent)
    except ValueError as error:
        raise CaseError(f"{path}: {error}") from error


def _case(tables: Table, folder: Path) -> Case:
    if "sweep" in tables:
        raise CaseError(
            "[sweep]: found a study, accepted: a single case; jaxcontact sweep checks and runs a study"
        )
    # the keys of every table, with those of materials of plug-ins, and the values in SI
    ball = tables.get("indenter", {})
    ball = ball if isinstance(ball, dict) else {}
    solids = [("substrate", tables.get("substrate")), ("indenter.material", ball.get("material"))]
    for _, solid in [*tables_named("layer", tables), *coats_of({"indenter": ball}), *solids]:
        if isinstance(solid, dict) and isinstance(solid.get("material"), str):
            take_up_material(solid["material"])
    kind, sections = kind_of(tables)
    adhesive = "adhesion" in tables
    sections = sections_of(kind, adhesive=True) if adhesive else sections
    tables = with_si_values(tables, sections)
    check_table("", tables, tables_of(sections))
    for name in ("experiment", "grid", "solver", "control", "times"):
        check_table(name, tables.get(name, {}), sections.get(name, {}))
    for name, part in KINDS[kind].parts.items():
        for where, table in tables_named(name, tables):
            check_table(where, table, part.keys)
    # the arguments of the function, in the order of their dependence
    layers = [
        _layer(where, table, sections["layer"], folder) for where, table in tables_named("layer", tables)
    ]
    base = _material("substrate", tables["substrate"], sections["substrate"])
    if isinstance(base, materials.Rigid) and not layers:
        raise CaseError(
            'substrate.material: found "rigid" without a [layer]; accepted: a rigid base below layers'
        )
    body = LayeredHalfSpace(layers, None if isinstance(base, materials.Rigid) else base)
    table = tables["indenter"]
    chosen, values = _choose("indenter", table, "shape", sections["indenter"], SHAPES)
    solid = None
    if "material" in table:
        solid = _material("indenter.material", {"material": "elastic"} | table["material"], _keys_of_ball())
    coats = [_layer(where, each, COAT, folder) for where, each in coats_of(tables)]
    if "heights" in values:
        values["heights"] = _field("indenter.heights", folder / values["heights"], "heights (nx, ny) [m]")
    indenter = chosen(**values, material=LayeredHalfSpace(coats, solid) if coats else solid)
    times = _times(tables["times"], sections["times"]) if "times" in sections else np.zeros(1)
    name = _one_of(tables["control"], "load", "approach")
    value = _over_times(f"control.{name}", tables["control"][name], "a number", times.size)
    control = (Load if name == "load" else Approach)(value)
    if adhesive and not {"width", "shape"} & tables.get("grid", {}).keys():
        raise CaseError("grid.width: missing; accepted with [adhesion]: width, or shape and spacing")
    grid = _grid(tables.get("grid", {}), sections["grid"], body, indenter, control, times)

    # the arguments beyond those of ``indent``: the values of [experiment] and the names of files of maps in it
    motion = {name: value for name, value in tables.get("experiment", {}).items() if name != "kind"}
    if "velocity" in motion:
        motion["velocity"] = _over_times("experiment.velocity", motion["velocity"], "[x, y]", times.size)
    for name, meaning in MAPS.items():
        if isinstance(motion.get(name), str):
            motion[name] = _field(f"experiment.{name}", folder / motion[name], meaning)
    # what further tables describe; the objects of tables of one argument are added
    described: dict[str, list[Any]] = {}
    parts = KINDS[kind].parts
    for name, part in parts.items():
        absent = {key: None for key, own in part.keys.items() if not own.required and own.default is None}
        for _, given in tables_named(name, tables):
            values = {key: _as_float(value) for key, value in given.items()}
            described.setdefault(part.argument, []).append(part.makes(**absent | values))
    needed = [name for name, part in parts.items() if part.added]
    if needed and parts[needed[0]].argument not in described:
        missing = ", ".join(f"[{name}]" for name in needed)
        raise CaseError(f"[{needed[0]}]: missing; accepted: one or more of {missing}")
    motion |= {argument: functools.reduce(operator.add, objects) for argument, objects in described.items()}
    tangential = KINDS[kind].tangential
    if tangential is not None:
        keyword, names = tangential
        name = _one_of(tables["control"], *names)
        value = _over_times(f"control.{name}", tables["control"][name], "[x, y]", times.size)
        motion[keyword] = TANGENTIAL.get(name, np.asarray)(value)
    if adhesive:
        law, values = _choose("adhesion", tables["adhesion"], "law", sections["adhesion"], LAWS)
        motion["adhesion"] = law(**values)

    # the options of the solution, and the times whose maps are kept, by the size of all of them
    options = dict(tables.get("solver", {}))
    lacking = {"dent": "hardness" not in motion, "indenter_displacement": indenter.surface() is None}
    lacking |= {} if adhesive else dict.fromkeys(ADHESIVE_FIELDS, True)
    fields = [name for name in stored_fields(_result(kind, tables)) if not lacking.get(name, False)]
    kept = options.pop("save", None) or kept_unless_said(fields, grid.shape, times.size)
    options |= {"save": LAST} if kept == LAST else {}  # or the function gives all, for a run to choose from
    return Case(kind, tables, body, indenter, control, times, grid, motion, options, kept)


def _result(kind: str, tables: Table) -> type:
    """Return the class of the result of a case."""
    own = KINDS[kind]
    return own.adhesive if own.adhesive is not None and "adhesion" in tables else own.result


def _choose(where: str, table: Table, key: str, own: dict[str, Key], choices: dict[str, Any]) -> Any:
    """The class that ``table[key]`` names, and the values of its parameters, all checked."""
    if key not in table or not own[key].accept.test(table[key]):
        check_table(where, {k: v for k, v in table.items() if k == key}, {key: own[key]})
    chosen, parameters = choices[table[key]]
    check_table(where, table, own | parameters)
    return chosen, {name: _as_float(table[name]) for name in parameters if name in table}


def _as_float(value: Any) -> Any:
    """Whole numbers as floats, since jax has none of over 64 bits; lists as arrays; text as it is."""
    if isinstance(value, list):
        return np.array(value, dtype=float)
    return float(value) if isinstance(value, int) else value


def _material(where: str, table: Table, own: dict[str, Key]) -> Any:
    chosen, values = _choose(where, table, "material", own, BASES if where == "substrate" else MATERIALS)
    if "nu" in values and "bulk_modulus" in values:
        raise CaseError(f"{where}.nu: found both nu and bulk_modulus; accepted: one of them")
    if chosen is not materials.Elastic:
        material = chosen(**values)
        if isinstance(material, materials.Prony) and np.shape(material.J) != np.shape(material.tau):
            found = f"{np.size(material.tau)} for {np.size(material.J)} in J"
            raise CaseError(f"{where}.tau: found {found}; accepted: as many numbers as in J")
        return material
    if ("G" in values) == ("E" in values):
        found = "both" if "G" in values else "neither"
        raise CaseError(f"{where}.G: found {found} G and E; accepted: one of them, a number > 0 [Pa]")
    return chosen.from_young(**values) if "E" in values else chosen(**values)


def _keys_of_ball() -> Keys:
    """Return the keys of [indenter.material]; at each call, since a plug-in adds to ``MATERIALS``."""
    return {"material": Key(choice(*MATERIALS), "elastic when absent")}


def _layer(where: str, table: Table, own: Keys, folder: Path) -> Layer:
    material, thickness = _material(where, table, own), table["thickness"]
    if isinstance(thickness, str):
        thickness = _field(f"{where}.thickness", folder / thickness, "thicknesses (nx, ny) [m]")
    else:
        thickness = float(thickness)
    return Layer(material, thickness, table.get("bonded", True))


def _field(where: str, path: Path, meaning: str) -> np.ndarray:
    """The numbers in a .npy file: two-dimensional, finite."""
    accepted = f"accepted: a .npy file of finite {meaning}"
    try:
        field = read_npy(path)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not a .npy file of numbers"
        raise CaseError(f"{where}: {path}: {reason}; {accepted}") from error
    if field.dtype.kind not in "fiu" or field.ndim != 2:
        raise CaseError(f"{where}: {path}: not a two-dimensional array of numbers; {accepted}")
    if not np.all(np.abs(field) <= LARGEST):
        raise CaseError(
            f"{where}: {path}: found values that are not finite or not below {LARGEST:g}; {accepted}"
        )
    return field.astype(float)


COAT = {"material": MATERIAL, "thickness": THICKNESS, "bonded": BONDED}  # the keys of a layer on the indenter


UNITS = {
    "load": " [N]",
    "approach": " [m]",
    "tangential_load": " [N]",
    "tangential_displacement": " [m]",
    "creepage": "",
}


def _one_of(table: Table, *names: str) -> str:
    """The one of some keys of [control] that is there."""
    found = [name for name in names if name in table]
    if len(found) != 1:
        words = f"both {names[0]} and {names[1]}" if found else f"neither {names[0]} nor {names[1]}"
        accepted = " and ".join(name + UNITS[name] for name in names)
        raise CaseError(f"[control]: found {words}; accepted: one of {accepted}")
    return found[0]


def _over_times(where: str, value: Any, one: str, nt: int) -> np.ndarray:
    """A value held, or a list of one for each time; one: what a single one is."""
    single = isinstance(value, list) and one != "a number" and not isinstance(value[0], list)
    if isinstance(value, list) and not single and len(value) != nt:
        raise CaseError(f"{where}: found {len(value)} values; accepted: {one}, or {nt} values as times")
    return np.array(value, dtype=float)


MAPS = {  # keys of [experiment] whose values may be files
    "friction": "coefficients of friction (nx, ny)",
    "shear_strength": "shear strengths (nx, ny) [Pa]",
    "hardness": "hardnesses (nx, ny) [Pa]",
}
TANGENTIAL: dict[str, Callable[..., Any]] = {
    "tangential_load": TangentialLoad,
    "tangential_displacement": TangentialDisplacement,
}


def _times(table: Table, own: Keys) -> np.ndarray:
    """Return the times from the values, or steps from 0 to the end, uniform or logarithmic from ``first``."""
    if "values" in table:
        if len(table) > 1:
            others = ", ".join(name for name in table if name != "values")
            raise CaseError(f"times.values: found with {others}; accepted: values alone, or end and steps")
        return np.array(table["values"], dtype=float)
    logarithmic = table.get("spacing") == "logarithmic"
    for name in ("end", "steps") + (("first",) if logarithmic else ()):
        if name not in table:
            raise CaseError(f"times.{name}: missing; accepted: {own[name].words}")
    end, steps = float(table["end"]), table["steps"]
    if not logarithmic:
        if "first" in table:
            raise CaseError('times.first: found with uniform spacing; accepted: with spacing = "logarithmic"')
        return np.linspace(0.0, end, steps + 1)
    if table["first"] > end:
        raise CaseError(f"times.first: found {table['first']:g}, accepted: a number not above end = {end:g}")
    return np.append(0.0, np.geomspace(float(table["first"]), end, steps))


def _grid(table: Table, own: Keys, body: Any, indenter: Any, control: Control, times: np.ndarray) -> Grid:
    wraps = table.get("periodic", own["periodic"].default)
    periodic = tuple(wraps) if isinstance(wraps, list) else wraps
    if ("shape" in table) != ("spacing" in table):
        name = "spacing" if "shape" in table else "shape"
        raise CaseError(f"grid.{name}: missing; accepted: {own[name].words}")
    if "shape" in table:
        extra = [name for name in ("n", "width") if name in table]
        if extra:
            raise CaseError(f"grid.{extra[0]}: found with shape; accepted: shape and spacing, or n and width")
        return Grid(tuple(table["shape"]), tuple(map(float, table["spacing"])), periodic)
    n = table.get("n", own["n"].default)
    if "width" in table:
        cell = float(table["width"]) / n
        return Grid((n, n), (cell, cell), periodic)
    if periodic not in (False, (False, False)):
        raise CaseError("grid.width: missing; accepted with periodic: width, or shape and spacing")
    if isinstance(indenter, shapes.HeightField):
        raise CaseError(
            "grid.shape: missing; accepted with a height field: shape and spacing, or n and width"
        )
    return Grid.around(body, indenter, control, times, n=n)


# The text of a case, with all defaults filled in and the meaning of each value as a comment.


@dataclass(frozen=True)
class Section:
    """A table of a case file: its heading, its values and all keys that it may have; or only a comment as its heading."""

    heading: str
    values: Table = field(default_factory=dict)
    keys: Keys = field(default_factory=dict)


def case_text(case: Case) -> str:
    """Return TOML that reads back as the same case; each line has its meaning and unit as a comment."""
    return "\n".join(block_text(block) for block in blocks_of(case))


def blocks_of(case: Case) -> list[Section]:
    """Return the tables of a case in order, with all defaults filled in."""
    sections = sections_of(case.kind)
    blocks: dict[str, list[Section]] = {}
    for name, keys in sections.items():
        table = case.tables.get(name, {})
        if name == "layer":
            continue
        if name in PARTS:
            heading = f"[[{name}]]" if isinstance(table, list) else f"[{name}]"
            given = [Section(heading, *_filled(each, keys)) for _, each in tables_named(name, case.tables)]
            blocks[name] = given or [Section(f"# no [{name}]", {}, keys)]
            continue
        if name == "substrate":
            section = _solid(table, keys)
        elif name == "indenter":
            values = {key: value for key, value in table.items() if key not in ("material", "layer")}
            section = _filled(values, keys | SHAPES[table["shape"]][1])
        elif name == "adhesion" and table:
            section = _filled(table, keys | LAWS[table["law"]][1])
        elif name == "times":
            section = _filled(table, {"values": keys["values"]} if "values" in table else keys)
        elif name == "grid":
            # the width, or two spacings, chosen from the expected contact where none is given
            spacing = [float(d) for d in case.grid.spacing]
            if not {"shape", "width"} & table.keys() and spacing[0] != spacing[1]:
                table = {"shape": list(case.grid.shape), "spacing": spacing}
            if "shape" in table:
                section = _filled(table, {key: keys[key] for key in ("shape", "spacing", "periodic")})
            else:
                section = _filled({"width": float(case.grid.width[0])} | table, keys)
        else:
            section = _filled({"save": case.kept} | table if "save" in keys else table, keys)
        blocks[name] = [Section(f"[{name}]", *section)]
    if "adhesion" in blocks and "adhesion" not in case.tables:
        blocks["adhesion"] = [Section("# no [adhesion]: the surfaces do not attract each other")]
    layers = [_solid(table, sections["layer"]) for _, table in tables_named("layer", case.tables)]
    heading = "[[layer]]" if isinstance(case.tables.get("layer"), list) else "[layer]"
    none = [Section("# no [layer]: the body is a half-space")]
    first = [*blocks.pop("experiment"), *([Section(heading, *layer) for layer in layers] or none)]
    solids = [*blocks.pop("substrate"), *blocks.pop("indenter")]
    others = [block for name in blocks for block in blocks[name]]
    solids += [Section("[[indenter.layer]]", *_solid(table, COAT)) for _, table in coats_of(case.tables)]
    if "material" not in case.tables["indenter"]:
        return [*first, *solids, *others, Section("# no [indenter.material]: the indenter is rigid")]
    own = {"material": "elastic"} | case.tables["indenter"]["material"]
    return [*first, *solids, Section("[indenter.material]", *_solid(own, {"material": MATERIAL})), *others]


def _solid(table: Table, keys: Keys) -> tuple[Table, Keys]:
    """Return the values and keys of a layer or the substrate."""
    own = BASES[table["material"]][1] | keys
    return _filled(
        table, {name: key for name, key in own.items() if name != "nu" or "bulk_modulus" not in table}
    )


def _filled(table: Table, keys: Keys) -> tuple[Table, Keys]:
    """Return the table in the order of the keys, with defaults for missing keys."""
    defaults = {name: key.default for name, key in keys.items() if key.default is not None}
    values = defaults | table
    order = ["material", "shape", "law", *keys]
    return {name: values[name] for name in dict.fromkeys(order) if name in values}, keys


def block_text(block: Section) -> str:
    """Return a table as text, with the meaning of each line as a comment."""
    lines, meanings = [], []
    for name, value in block.values.items():
        key = block.keys[name]
        lines.append(f"{name} = {_toml(value)}")
        # of a material, a shape, a law or an experiment, the first line of its docstring
        if name == "kind":
            meaning = (KINDS[value].verb.__doc__ or "").split("\n")[0].rstrip(".")
        elif isinstance(value, str) and name in ("material", "shape", "law"):  # a grid's shape is two numbers
            documented = (BASES | SHAPES | LAWS)[value][0].__doc__ or ""
            meaning = documented.split("  ")[0].split("\n")[0].rstrip(".")
        else:
            choices = f"; {key.accept.words}" if " | " in key.accept.words else ""
            meaning = key.meaning.split("; absent: ")[0] + choices
        meanings.append(meaning)
    width = max((len(line) for line in lines if len(line) < 60), default=0)
    rows = [f"{line:{width}}  # {meaning}" for line, meaning in zip(lines, meanings, strict=True)]
    return "\n".join([block.heading, *rows]) + "\n"


def _toml(value: Any) -> str:
    """Return a value of a case file as TOML: text, a number, a boolean, or a list of them."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, list):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    if isinstance(value, bool | int):
        return str(value).lower()
    # with a point, or for very large or small ones with a power of ten that is a multiple of 3: 150e-9
    number = Decimal(f"{value:.12g}" if float(f"{value:.12g}") == value else repr(value))
    power = 3 * (number.adjusted() // 3)
    if number and (power < -3 or power > 3):
        return f"{number.scaleb(-power).normalize():f}e{power}"
    plain = f"{number:f}"
    return plain if "." in plain else f"{plain}.0"


# Templates of case files: a ready-made case of a kind, with a commented line for every other key that it may have.
#
# Templates are generated from the schema, as all of case files is, so that they contain every known key and no other.


HEAD = """# {title}
# An example to change: jaxcontact check {name}; jaxcontact run {name} -o out
# Numbers are in SI units; text may have a unit of its own: thickness = "150 nm", load = "2.5 mN", end = "1 h".
# A commented line with ... after the key is an optional key.

"""


def template(kind: str, cases: Path, name: str) -> str:
    """Return a case file of this kind, from its example in the folder of cases; name: the file that it is written to."""
    path = cases / f"{KINDS[kind].example}.toml"
    tables = {table: values for table, values in read_tables(path).items() if table in sections_of(kind)}
    own = {name: key.example for name, key in KINDS[kind].experiment.items() if key.example is not None}
    tables["experiment"] = own | tables.get("experiment", {}) | {"kind": kind}
    case = case_of(tables, path)
    blocks = []
    for block in blocks_of(case):  # with a commented line for each optional key that is absent
        absent = {
            key: own for key, own in block.keys.items() if key not in block.values and own.accept is not TABLE
        }
        blocks.append(
            block_text(block) + "".join(f"# {key} = ...  # {own.meaning}\n" for key, own in absent.items())
        )
    # the materials, the shapes and, with adhesion, its laws, each with its keys
    laws = [("law of [adhesion]", LAWS)] if "adhesion" in sections_of(kind) else []
    for what, choices in [
        ("material of a layer, the substrate or the indenter", BASES),
        ("shape", SHAPES),
        *laws,
    ]:
        rows = [f'#   "{one}": {", ".join(keys) or "no keys"}' for one, (_, keys) in choices.items()]
        blocks.append("\n".join([f"# {what}, and its keys", *rows]) + "\n")
    title = path.read_text(encoding="utf-8").splitlines()[0].lstrip("# ")
    return HEAD.format(title=title, name=name) + "\n".join(blocks)


# A caption that states what a case computes, placed below each picture of its run.


CONTROLS = ("load", "approach", "tangential_load", "tangential_displacement")
LETTERS = 17.0  # letters per inch at the size below
SIZE, SHADE = (
    7.0,
    "0.45",
)  # size of the letters in points, and a grey that is legible on white and on dark pages


def caption_of(case: Case) -> str:
    """Return a caption such as "sphere of 500 µm on burgers, 5 µm, on elastic; load 5 mN; to 3600 s; 128 x 128 cells"."""
    tables = case.tables
    indenter = tables["indenter"]
    radius = f" of {_amount(indenter['radius'], 'm')}" if "radius" in indenter else ""
    layers = [
        f"{table['material']}, {_amount(table['thickness'], 'm')}{'' if table.get('bonded', True) else ', loose'}"
        for _, table in tables_named("layer", tables)
    ]
    body = ", on ".join([*layers, tables["substrate"]["material"]])
    controls = [
        f"{name.replace('_', ' ')} {_amount(tables['control'][name], FIELDS[name].unit)}"
        for name in CONTROLS
        if name in tables["control"]
    ]
    velocity = tables.get("experiment", {}).get("velocity")
    motion = [] if velocity is None else [f"velocity {_amount(velocity, 'm/s')}"]
    duration = "steady" if KINDS[case.kind].times is None else f"to {case.times[-1]:g} s"
    cells = "{} x {} cells".format(*case.grid.shape)
    return "; ".join([f"{indenter['shape']}{radius} on {body}", *controls, *motion, duration, cells])


def write_under(figure: Any, caption: str) -> None:
    """Write the caption at the foot of a figure, in as many lines as its width requires."""
    lines = textwrap.fill(caption, int(LETTERS * figure.get_figwidth()))
    figure.supxlabel(lines, fontsize=SIZE, color=SHADE)


def _amount(value: Any, unit: str) -> str:
    """Return one number with an SI prefix, several numbers by their range, and text (a file name) unchanged."""
    if isinstance(value, str):
        return value
    low, high = float(np.min(value)), float(np.max(value))
    return prefixed(high, unit) if low == high else f"{prefixed(low, unit)} to {prefixed(high, unit)}"
