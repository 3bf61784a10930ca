"""Study files: a case file with a table [sweep], which gives keys of the case and the values that they take.

    [sweep]
    method = "grid"                                  # every combination; or "latin-hypercube", with samples and seed
    "control.load" = [10.0, 60.0]                    # these values
    "layer[0].thickness" = {from = "100 nm", to = "1 um", count = 4, log = true}     # or a range

Values are in SI, or texts with a unit, which are read as SI numbers here: tables and figures of the study have the numbers.

A list in a case is a single value (a vector, a history), so variations need a table of their own.
"""

import copy
import itertools
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from jaxcontact.shell.case_file import (
    Case,
    CaseError,
    Table,
    case_of,
    check_table,
    read_tables,
    shown,
    si_value,
)
from jaxcontact.shell.case_keys import FLAG, NUMBER, Key, Keys, choice, whole_number
from jaxcontact.shell.finished_steps import fingerprint

MOST_CASES = 10**5

OPTIONS: Keys = {
    "method": Key(choice("grid", "latin-hypercube"), "how values are combined", default="grid"),
    "samples": Key(whole_number(1, MOST_CASES), "cases of a Latin hypercube"),
    "seed": Key(whole_number(0, 2**32 - 1), "of the Latin hypercube", default=0),
}
RANGE: Keys = {
    "from": Key(NUMBER, "the first value", required=True),
    "to": Key(NUMBER, "the last value", required=True),
    "count": Key(whole_number(2, MOST_CASES), "how many values, both ends included; for a grid"),
    "log": Key(FLAG, "whether they are evenly spaced in their logarithm", default=False),
}


@dataclass(frozen=True)
class CaseStudy:
    """A case, and the values of the keys that vary.

    path, tables: of its file, without [sweep]; cases: {dotted key: value} of each case; fingerprints: one for each case,
    including the contents of the files that it names.
    """

    path: Path
    tables: Table
    cases: tuple[Table, ...]
    fingerprints: tuple[str, ...]


def read_study(path: Path) -> CaseStudy:
    """Read a study from a TOML file and check every case of it. Raises CaseError, which names file and key."""
    tables = read_tables(path)
    try:
        cases = _combined(tables.pop("sweep", {}))
    except ValueError as error:
        raise CaseError(f"{path}: {error}") from error
    return CaseStudy(
        path, tables, cases, tuple(fingerprint(varied(tables, values, path)) for values in cases)
    )


def varied(tables: Table, values: Table, path: Path) -> Case:
    """Return the case of the tables with other values. Raises CaseError, which names them."""
    tables = copy.deepcopy(tables)
    try:
        for dotted, value in values.items():  # into an existing table or a new one
            *parents, name = dotted.split(".")
            table: Any = tables
            for part in parents:
                named = re.fullmatch(r"(\w+)\[(\d+)\]", part)
                if named is None:
                    table = table.setdefault(part, {})
                else:
                    group = table.get(named[1])
                    inside = isinstance(group, list) and int(named[2]) < len(group)
                    table = group[int(named[2])] if inside else None
                if not isinstance(table, dict):
                    accepted = 'a table of the case, as in "layer[0]"'
                    raise CaseError(f"{part}: found no such table; accepted: {accepted}")
            table[name] = value
        return case_of(tables, path)
    except CaseError as error:
        words = str(error).removeprefix(f"{path}: ")
        raise CaseError(f"{path}: [sweep] {in_words(values)}: {words}") from error


def in_words(values: Table) -> str:
    """Return the varied values of a case in one line."""
    return ", ".join(f"{key} = {shown(value)}" for key, value in values.items())


def _combined(sweep: Any) -> tuple[Table, ...]:
    """Return the cases of a table [sweep]."""
    if not isinstance(sweep, dict):
        raise CaseError(f"[sweep]: found {shown(sweep)}, accepted: a table")
    given = dict(_flat(sweep))
    options = {name: given.pop(name) for name in OPTIONS if name in given}
    for name, value in given.items():
        if "." not in name:  # refused below
            continue
        if isinstance(value, dict):  # a range: its ends are quantities, its count and scale are not
            ends = {end: si_value(name, value[end]) for end in ("from", "to") if end in value}
            given[name] = value | ends
        else:
            given[name] = si_value(name, value)
    check_table("sweep", options, OPTIONS)
    latin = options.get("method") == "latin-hypercube"
    for name, value in given.items():
        _check_values(name, value, latin)
    if not given:
        raise CaseError('[sweep]: missing; accepted: keys and their values, as "control.load" = [10.0, 60.0]')
    if not latin and len(options) > ("method" in options):
        name = next(name for name in options if name != "method")
        raise CaseError(f'sweep.{name}: found with a grid, accepted: with method = "latin-hypercube"')
    if latin and "samples" not in options:
        raise CaseError(f"sweep.samples: missing; accepted: {OPTIONS['samples'].words}")
    return tuple(_sampled(given, options) if latin else _grid(given))


def _flat(table: Table, above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and their values, since TOML reads an unquoted dotted key as nested tables."""
    for name, value in table.items():
        nested = isinstance(value, dict) and value and all(isinstance(v, dict | list) for v in value.values())
        yield from _flat(value, f"{above}{name}.") if nested else [(above + name, value)]


def _check_values(name: str, value: Any, latin: bool) -> None:
    """Check that the value is a list, or a range with a count for a grid and without one for a Latin hypercube."""
    if "." not in name:
        raise CaseError(
            f"sweep.{name}: unknown key; accepted: {', '.join(OPTIONS)}, and keys of the case by their table, as in"
            ' "control.load"'
        )
    if isinstance(value, list) and value:
        return
    if not isinstance(value, dict):
        accepted = "a list of values, or a range {from, to, count, log}"
        raise CaseError(f"sweep.{name}: found {shown(value)}, accepted: {accepted}")
    check_table(f"sweep.{name}", value, {key: RANGE[key] for key in RANGE if key != "count" or not latin})
    if not latin and "count" not in value:
        raise CaseError(f"sweep.{name}.count: missing; accepted: {RANGE['count'].words}")
    if value["to"] <= value["from"] or (value.get("log") and value["from"] <= 0):
        lowest = "0 < from < to, since log = true" if value.get("log") else "from < to"
        raise CaseError(f"sweep.{name}: found {value['from']:g} to {value['to']:g}, accepted: {lowest}")


def _grid(given: Table) -> Iterator[Table]:
    """Yield every combination; the last key varies fastest."""
    counts = [len(value) if isinstance(value, list) else value["count"] for value in given.values()]
    if math.prod(counts) > MOST_CASES:
        raise CaseError(f"[sweep]: found {math.prod(counts)}, accepted: up to {MOST_CASES} cases")
    columns = [
        value
        if isinstance(value, list)
        else [_between(value, share) for share in np.linspace(0.0, 1.0, count)]
        for value, count in zip(given.values(), counts, strict=True)
    ]
    for row in itertools.product(*columns):
        yield dict(zip(given, row, strict=True))


def _sampled(given: Table, options: Table) -> Iterator[Table]:
    """Yield samples of which each has a stratum of every key to itself; from a list, equally many of each value."""
    random = np.random.default_rng(options.get("seed", 0))
    for shares in scipy.stats.qmc.LatinHypercube(len(given), seed=random).random(options["samples"]):
        yield {
            name: value[int(share * len(value))] if isinstance(value, list) else _between(value, share)
            for (name, value), share in zip(given.items(), shares, strict=True)
        }


def _between(given: Table, share: float) -> float:
    """Return a value of a range, rounded to twelve digits so that it is the same on every machine."""
    low, high = float(given["from"]), float(given["to"])
    value = low * (high / low) ** share if given.get("log") else low + (high - low) * share
    return float(f"{value:.12g}")
