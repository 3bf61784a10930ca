"""The text of a case, with all defaults filled in and the meaning of each value as a comment."""

import json
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Any

from jaxcontact.files.case_file import Case
from jaxcontact.files.case_keys import LAWS, MATERIALS, SHAPES, Key, Keys
from jaxcontact.files.case_schema import KINDS, PARTS, sections_of
from jaxcontact.files.case_tables import tables_named

Table = dict[str, Any]


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
    blocks = {
        name: _parts(name, keys, case)
        if name in PARTS
        else [Section(f"[{name}]", *_section(name, keys, case))]
        for name, keys in sections.items()
        if name != "layer"
    }
    if "adhesion" in blocks and "adhesion" not in case.tables:
        blocks["adhesion"] = [Section("# no [adhesion]: the surfaces do not attract each other")]
    layers = [_solid(table, sections["layer"]) for _, table in tables_named("layer", case.tables)]
    heading = "[[layer]]" if isinstance(case.tables.get("layer"), list) else "[layer]"
    none = [Section("# no [layer]: the body is a half-space")]
    first = [*blocks.pop("experiment"), *([Section(heading, *layer) for layer in layers] or none)]
    solids = [*blocks.pop("substrate"), *blocks.pop("indenter")]
    others = [block for name in blocks for block in blocks[name]]
    if case.indenter.material is None:
        rigid = Section("# no [indenter.material]: the indenter is rigid")
        return [*first, *solids, *others, rigid]
    own = {"material": "elastic"} | case.tables["indenter"]["material"]
    elastic = sections["substrate"] | MATERIALS["elastic"][1]
    return [*first, *solids, Section("[indenter.material]", *_filled(own, elastic)), *others]


def _parts(name: str, keys: Keys, case: Case) -> list[Section]:
    """Return the tables of a section that describes an argument; a comment where there is none."""
    heading = f"[[{name}]]" if isinstance(case.tables.get(name), list) else f"[{name}]"
    given = [Section(heading, *_filled(table, keys)) for _, table in tables_named(name, case.tables)]
    return given or [Section(f"# no [{name}]", {}, keys)]


def _section(name: str, keys: Keys, case: Case) -> tuple[Table, Keys]:
    """Return the values and keys of a section."""
    table = case.tables.get(name, {})
    if name == "substrate":
        return _solid(table, keys)
    if name == "indenter":
        values = {key: value for key, value in table.items() if key != "material"}
        return _filled(values, keys | SHAPES[table["shape"]][1])
    if name == "adhesion" and table:
        return _filled(table, keys | LAWS[table["law"]][1])
    if name == "times":
        return _filled(table, {"values": keys["values"]} if "values" in table else keys)
    if name == "grid":
        return _grid(case, keys)
    if "save" in keys:
        return _filled({"save": case.kept} | table, keys)
    return _filled(table, keys)


def _solid(table: Table, keys: Keys) -> tuple[Table, Keys]:
    """Return the values and keys of a layer or the substrate."""
    own = MATERIALS[table["material"]][1] | keys
    return _filled(
        table, {name: key for name, key in own.items() if name != "nu" or "bulk_modulus" not in table}
    )


def _filled(table: Table, keys: Keys) -> tuple[Table, Keys]:
    """Return the table in the order of the keys, with defaults for missing keys."""
    defaults = {name: key.default for name, key in keys.items() if key.default is not None}
    values = defaults | table
    order = ["material", "shape", "law", *keys]
    return {name: values[name] for name in dict.fromkeys(order) if name in values}, keys


def _grid(case: Case, keys: Keys) -> tuple[Table, Keys]:
    """Return the grid, with the width, or two spacings, chosen from the expected contact where none is given."""
    table, spacing = dict(case.tables.get("grid", {})), [float(d) for d in case.grid.spacing]
    if not {"shape", "width"} & table.keys() and spacing[0] != spacing[1]:
        table = {"shape": list(case.grid.shape), "spacing": spacing}
    if "shape" in table:
        return _filled(table, {name: keys[name] for name in ("shape", "spacing", "periodic")})
    table.setdefault("width", float(case.grid.width[0]))
    return _filled(table, keys)


def block_text(block: Section) -> str:
    """Return a table as text, with the meaning of each line as a comment."""
    lines = [f"{key} = {_toml(value)}" for key, value in block.values.items()]
    width = max((len(line) for line in lines if len(line) < 60), default=0)
    meanings = [_meaning(key, value, block.keys[key]) for key, value in block.values.items()]
    rows = [f"{line:{width}}  # {meaning}" for line, meaning in zip(lines, meanings, strict=True)]
    return "\n".join([block.heading, *rows]) + "\n"


def _meaning(name: str, value: Any, key: Key) -> str:
    """Return the meaning of a value: for a material, a shape or an experiment, the first line of its docstring."""
    if name == "kind":
        return (KINDS[value].verb.__doc__ or "").split("\n")[0].rstrip(".")
    if isinstance(value, str) and name in ("material", "shape", "law"):  # the shape of a grid is two numbers
        return ((MATERIALS | SHAPES | LAWS)[value][0].__doc__ or "").split("  ")[0].split("\n")[0].rstrip(".")
    choices = f"; {key.accept.words}" if " | " in key.accept.words else ""
    return key.meaning.split("; absent: ")[0] + choices


def _toml(value: Any) -> str:
    """Return a value of a case file as TOML: text, a number, a boolean, or a list of them."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, list):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    if isinstance(value, bool | int):
        return str(value).lower()
    return _number(Decimal(f"{value:.12g}" if float(f"{value:.12g}") == value else repr(value)))


def _number(value: Decimal) -> str:
    """Return a number with a point, or for very large or small ones with a power of ten that is a multiple of 3: 150e-9."""
    power = 3 * (value.adjusted() // 3)
    if value and (power < -3 or power > 3):
        return f"{value.scaleb(-power).normalize():f}e{power}"
    plain = f"{value:f}"
    return plain if "." in plain else f"{plain}.0"
