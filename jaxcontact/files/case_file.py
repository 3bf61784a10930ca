"""Case files: one experiment as a TOML file, in SI units, or with a unit behind the number: "150 nm".

``read_case`` turns a file into the objects of the package by the schema in ``case_schema``, or raises a ``CaseError`` of one
line that names the file, the key, what was found and what is accepted. ``case_tables`` checks keys and values.
"""

import functools
import operator
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from jaxcontact._support.npz import read_npy
from jaxcontact.files.case_keys import LARGEST, LAWS, MATERIALS, SHAPES, Key, Keys, choice
from jaxcontact.files.case_schema import KINDS, CasePart, sections_of
from jaxcontact.files.case_tables import (
    CaseError,
    Table,
    check_table,
    kind_of,
    read_tables,
    tables_named,
    tables_of,
    with_si_values,
)
from jaxcontact.files.chosen_times import LAST, kept_unless_said
from jaxcontact.indenters import shapes
from jaxcontact.inputs import materials
from jaxcontact.inputs.controls import Approach, Control, Load, TangentialDisplacement, TangentialLoad
from jaxcontact.inputs.grid import Grid
from jaxcontact.inputs.layers import Layer, LayeredHalfSpace, at_its_thickest
from jaxcontact.results.labels import stored_fields
from jaxcontact.verbs.experiment import TimedExperiment
from jaxcontact.verbs.setup import ContactSetup, Options, Settings

OPTIONS = {field.name for field in fields(Options)}


@dataclass(frozen=True)
class Case:
    """An experiment as read: the arguments of the function that runs it.

    kind: of ``KINDS``; tables: the file as it stood, without what is absent there; times: a single zero for a steady
    state; motion: what the function of this kind takes beyond those of ``indent``; options: the keywords of its solver;
    kept: of which times a run writes maps (``files.chosen_times``).
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
        return KINDS[self.kind].verb(**self._given())

    def experiment(self) -> TimedExperiment | None:
        """Return the checked experiment, to march in blocks; None for a steady state. Raises ValueError as ``run``."""
        march = KINDS[self.kind].march
        setup, settings, further = self.arguments()
        return None if march is None else march(setup, settings, **further)

    def arguments(self) -> tuple[ContactSetup, Settings, Table]:
        """Return the contact, the settings of its solution, and the further arguments of the function of this kind."""
        defaults = {
            name: key.default for name, key in KINDS[self.kind].solver.items() if key.default is not None
        }
        given = self.motion | defaults | self.options
        static = {name: given.pop(name) for name in OPTIONS & given.keys()}
        settings = Settings(given.pop("tolerance"), given.pop("max_iterations"), options=Options(**static))
        return ContactSetup(self.body, self.indenter, self.control, self.times, self.grid), settings, given

    @property
    def body_for_estimates(self) -> LayeredHalfSpace:
        """The body with layers of one thickness each, the largest."""
        return at_its_thickest(self.body)

    def _given(self) -> Table:
        given = {"body": self.body, "indenter": self.indenter, "control": self.control, "grid": self.grid}
        over_time = {} if KINDS[self.kind].times is None else {"times": self.times}
        return given | over_time | self.motion | self.options


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
    body = _body(tables, sections, folder)
    indenter = _indenter(tables["indenter"], sections["indenter"], folder)
    times = _times(tables["times"], sections["times"]) if "times" in sections else np.zeros(1)
    control = _control(tables["control"], times.size)
    if adhesive and not {"width", "shape"} & tables.get("grid", {}).keys():
        raise CaseError("grid.width: missing; accepted with [adhesion]: width, or shape and spacing")
    grid = _grid(tables.get("grid", {}), sections["grid"], body, indenter, control, times)
    motion = _motion(kind, tables, times.size, folder)
    if adhesive:
        law, values = _choose("adhesion", tables["adhesion"], "law", sections["adhesion"], LAWS)
        motion["adhesion"] = law(**values)
    options = dict(tables.get("solver", {}))
    fields = stored_fields(_result(kind, tables))
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


def _body(tables: Table, sections: dict[str, Keys], folder: Path) -> LayeredHalfSpace:
    layers = [
        Layer(_material(where, table, sections["layer"]), _thickness(where, table["thickness"], folder))
        for where, table in tables_named("layer", tables)
    ]
    return LayeredHalfSpace(layers, _material("substrate", tables["substrate"], sections["substrate"]))


def _thickness(where: str, value: Any, folder: Path) -> Any:
    if isinstance(value, str):
        return _field(f"{where}.thickness", folder / value, "thicknesses (nx, ny) [m]")
    return float(value)


def _indenter(table: Table, own: Keys, folder: Path) -> shapes.Indenter:
    chosen, values = _choose("indenter", table, "shape", own, SHAPES)
    material = None
    if "material" in table:
        elastic = {"material": Key(choice("elastic"), "elastic when absent")}
        material = _material("indenter.material", {"material": "elastic"} | table["material"], elastic)
    if "heights" in values:
        values["heights"] = _field("indenter.heights", folder / values["heights"], "heights (nx, ny) [m]")
    return chosen(**values, material=material)


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


def _control(table: Table, nt: int) -> Control:
    name = _one_of(table, "load", "approach")
    value = _over_times(f"control.{name}", table[name], "a number", nt)
    return (Load if name == "load" else Approach)(value)


TANGENTIAL: dict[str, Callable[..., Any]] = {
    "tangential_load": TangentialLoad,
    "tangential_displacement": TangentialDisplacement,
}


def _motion(kind: str, tables: Table, nt: int, folder: Path) -> Table:
    """Return the arguments of the function of this kind beyond those of ``indent``."""
    table, control = tables.get("experiment", {}), tables["control"]
    motion = {name: value for name, value in table.items() if name != "kind"}
    if "velocity" in motion:
        motion["velocity"] = _over_times("experiment.velocity", motion["velocity"], "[x, y]", nt)
    if isinstance(motion.get("friction"), str):
        path = folder / motion["friction"]
        motion["friction"] = _field("experiment.friction", path, "coefficients of friction (nx, ny)")
    motion |= _parts(kind, tables)
    tangential = KINDS[kind].tangential
    if tangential is None:
        return motion
    keyword, names = tangential
    name = _one_of(control, *names)
    value = _over_times(f"control.{name}", control[name], "[x, y]", nt)
    return motion | {keyword: TANGENTIAL.get(name, np.asarray)(value)}


def _parts(kind: str, tables: Table) -> Table:
    """Return the arguments that further tables describe; the objects of tables of one argument are added."""
    found: dict[str, list[Any]] = {}
    for name, part in KINDS[kind].parts.items():
        for _, table in tables_named(name, tables):
            found.setdefault(part.argument, []).append(_part(part, table))
    needed = [name for name, part in KINDS[kind].parts.items() if part.added]
    if needed and KINDS[kind].parts[needed[0]].argument not in found:
        names = ", ".join(f"[{name}]" for name in needed)
        raise CaseError(f"[{needed[0]}]: missing; accepted: one or more of {names}")
    return {argument: functools.reduce(operator.add, objects) for argument, objects in found.items()}


def _part(part: CasePart, table: Table) -> Any:
    absent = {name: None for name, key in part.keys.items() if not key.required and key.default is None}
    return part.makes(**absent | {name: _as_float(value) for name, value in table.items()})


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
