"""The tables of a case file: reading them, checking their keys and values, and converting values with units to SI."""

import difflib
import re
import reprlib
import tomllib
from pathlib import Path
from typing import Any

from jaxcontact.files.case_keys import LAWS, MATERIALS, SHAPES, TABLE, TABLES, Accept, Key, Keys
from jaxcontact.files.case_schema import KIND, KINDS, OPTIONAL_SECTIONS, SEVERAL, sections_of
from jaxcontact.files.quantities import in_si

Table = dict[str, Any]


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
        raise CaseError(
            f"{path}: {reason}; expected a TOML file of a case, or a name that jaxcontact cases lists"
        ) from error
    except (
        ValueError,
        RecursionError,
    ) as error:  # a decoding error, a number of too many digits, too deep a list
        raise CaseError(f"{path}: not TOML: {error}{_quoted(text, str(error))}") from error


def _quoted(text: str, error: str) -> str:
    """Return advice for a line that TOML cannot read because its value is text without quotes (450 GPa), "" for others."""
    place = re.search(r"line (\d+)", error)
    lines = text.splitlines()
    line = lines[int(place[1]) - 1] if place and int(place[1]) <= len(lines) else ""
    found = re.fullmatch(r"\s*([\w.\-]+)\s*=\s*([^\s\"'\[{#=][^\"'\[\]{}#=]*?)\s*(?:#.*)?", line)
    if found is None:
        return ""
    return f'; expected text, and a number with a unit, in quotes: {found[1]} = "{found[2]}"'


def tables_named(name: str, tables: Table) -> list[tuple[str, Table]]:
    """Return the tables of a section that may be given several times, each with its name: of layers from the top down."""
    given = tables.get(name, [])
    if isinstance(given, list):
        return [(f"{name}[{i}]", table) for i, table in enumerate(given)]
    return [(name, given)]


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
    return _keys_by_table(sections).get("substrate" if "material" in between else table, {}).get(name)


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
    for name, value in table.items():
        if name not in keys:
            raise CaseError(f"{_path(where, name)}: unknown key; {_suggestion(name, list(keys))}")
        if not keys[name].accept.test(value):
            raise CaseError(f"{_path(where, name)}: found {shown(value)}, accepted: {keys[name].words}")
    for name, key in keys.items():
        if key.required and name not in table:
            raise CaseError(f"{_path(where, name)}: missing; accepted: {key.words}")


def _path(where: str, name: str) -> str:
    return f"{where}.{name}" if where else f"[{name}]"


def _suggestion(name: str, known: list[str]) -> str:
    close = difflib.get_close_matches(name, known, n=1) or difflib.get_close_matches(name.lower(), known, n=1)
    hint = f'did you mean "{close[0]}"? ' if close else ""
    return f"{hint}accepted: {', '.join(known)}"


def shown(value: Any) -> str:
    """Return the value as found, on one line of at most 60 characters."""
    try:
        text = f'"{value}"' if isinstance(value, str) else reprlib.repr(value)
    except ValueError:  # Python writes no whole number of over 4300 digits
        text = "a number of too many digits"
    text = " ".join(text.split())
    return text if len(text) <= 60 else text[:57] + "..."
