"""The command ``jaxcontact sweep``: run the cases of a study and write their figures to one table.

A study file is a case file with a table [sweep], which gives keys of the case and the values that they take:

    [sweep]
    method = "grid"                                  # every combination; or "latin-hypercube", with samples and seed
    "control.load" = [10.0, 60.0]                    # these values
    "layer[0].thickness" = {from = "100 nm", to = "1 um", count = 4, log = true}     # or a range

Values are in SI, or texts with a unit, which are read as SI numbers here: tables and figures of the study have the numbers.
A list in a case is a single value (a vector, a history), so variations need a table of their own.

Each case is stored as soon as it is done, so that the same command continues a study that was stopped for any reason.
"""

import argparse
import contextlib
import copy
import csv
import itertools
import json
import math
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from jaxcontact._compile.compilation_cache import enable_compilation_cache
from jaxcontact._support import files
from jaxcontact._support.files import write_whole
from jaxcontact._support.status import Status
from jaxcontact._support.terminal import FINE, NOT_CONVERGED, exit_status, print_error, signal_of, tell
from jaxcontact._support.version import __version__
from jaxcontact.results.summaries import figures_in, values_of
from jaxcontact.shell import advice
from jaxcontact.shell.case_file import (
    Case,
    CaseError,
    Table,
    case_of,
    check_table,
    kind_of,
    read_tables,
    shown,
    si_value,
    unit_of,
)
from jaxcontact.shell.case_schema import FLAG, NUMBER, Key, Keys, choice, whole_number
from jaxcontact.shell.finished_steps import fingerprint
from jaxcontact.simulate.sweep import FUNCTION, Study, sweep_of

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
        if "." not in name:
            raise CaseError(
                f"sweep.{name}: unknown key; accepted: {', '.join(OPTIONS)}, and keys of the case by their table, as in"
                ' "control.load"'
            )
        if isinstance(value, list) and value:
            continue
        if not isinstance(value, dict):
            accepted = "a list of values, or a range {from, to, count, log}"
            raise CaseError(f"sweep.{name}: found {shown(value)}, accepted: {accepted}")
        # a Latin hypercube has as many values of each key as samples, so that its ranges have no count
        keys = {key: own for key, own in RANGE.items() if key != "count" or not latin}
        check_table(f"sweep.{name}", value, keys)
        if not latin and "count" not in value:
            raise CaseError(f"sweep.{name}.count: missing; accepted: {RANGE['count'].words}")
        if value["to"] <= value["from"] or (value.get("log") and value["from"] <= 0):
            lowest = "0 < from < to, since log = true" if value.get("log") else "from < to"
            raise CaseError(f"sweep.{name}: found {value['from']:g} to {value['to']:g}, accepted: {lowest}")
    if not given:
        raise CaseError('[sweep]: missing; accepted: keys and their values, as "control.load" = [10.0, 60.0]')
    if not latin and len(options) > ("method" in options):
        name = next(name for name in options if name != "method")
        raise CaseError(f'sweep.{name}: found with a grid, accepted: with method = "latin-hypercube"')
    if latin and "samples" not in options:
        raise CaseError(f"sweep.samples: missing; accepted: {OPTIONS['samples'].words}")
    if latin:  # each sample has a stratum of every key to itself; from a list, equally many of each value
        random = np.random.default_rng(options.get("seed", 0))
        samples = scipy.stats.qmc.LatinHypercube(len(given), seed=random).random(options["samples"])
        return tuple(
            {
                name: value[int(share * len(value))] if isinstance(value, list) else _between(value, share)
                for (name, value), share in zip(given.items(), shares, strict=True)
            }
            for shares in samples
        )
    # every combination; the last key varies fastest
    counts = [len(value) if isinstance(value, list) else value["count"] for value in given.values()]
    if math.prod(counts) > MOST_CASES:
        raise CaseError(f"[sweep]: found {math.prod(counts)}, accepted: up to {MOST_CASES} cases")
    columns = [
        value
        if isinstance(value, list)
        else [_between(value, share) for share in np.linspace(0.0, 1.0, count)]
        for value, count in zip(given.values(), counts, strict=True)
    ]
    return tuple(dict(zip(given, row, strict=True)) for row in itertools.product(*columns))


def _flat(table: Table, above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and their values, since TOML reads an unquoted dotted key as nested tables."""
    for name, value in table.items():
        nested = isinstance(value, dict) and value and all(isinstance(v, dict | list) for v in value.values())
        yield from _flat(value, f"{above}{name}.") if nested else [(above + name, value)]


def _between(given: Table, share: float) -> float:
    """Return a value of a range, rounded to twelve digits so that it is the same on every machine."""
    low, high = float(given["from"]), float(given["to"])
    value = low * (high / low) ** share if given.get("log") else low + (high - low) * share
    return float(f"{value:.12g}")


# The command.


# stored with the varied values, so that a change in a file that the case names is detected
CASE = "fingerprint"
TABLE, SUMMARY, PICTURE = "study.csv", "summary.json", "study.png"
DRAWN = ("peak_pressure", "contact_radius", "approach")  # at the end of each case


def run_study(options: argparse.Namespace) -> int:
    """Compute the missing cases of a study, write its table and return the exit status."""
    study = read_study(options.study)
    directory, table = options.directory, options.directory / TABLE
    # the directory is new, empty, or that of a study
    if directory.is_dir() and any(directory.iterdir()) and not (directory / FUNCTION).exists():
        raise files.DirectoryTakenError(
            f"{directory}: found a directory that is not empty, accepted: a new one, or that of this study"
        )
    if table.exists() and not options.force:  # with no case that the new one would lack
        names = list(study.cases[0])
        requested = {tuple(str(value) for value in _varying(case).values()) for case in study.cases}
        with table.open(newline="", encoding="utf-8") as file:
            written = [tuple(row.get(name) for name in names) for row in csv.DictReader(file)]
        dropped = [row for row in written if row not in requested]
        if dropped:
            raise files.DirectoryTakenError(
                f"{table}: found {len(dropped)} cases that {study.path} does not have; --force leaves them out of the"
                " table (their results stay in the directory), or take another directory"
            )
    advice.check(varied(study.tables, study.cases[0], study.path), study.path)
    compute = figures_by(study.tables, str(study.path.resolve()))
    cases = [values | {CASE: mark} for values, mark in zip(study.cases, study.fingerprints, strict=True)]
    # each entry of the case distinguishes studies in a folder, independent of where its file lies
    entries = {f"[{name}]": value for name, value in study.tables.items()}
    identity = {name: json.dumps(value, sort_keys=True, default=str) for name, value in entries.items()}
    try:
        with contextlib.ExitStack() as stack:
            executor = None  # processes of this machine
            if options.scheduler is not None:  # workers of Dask, which keep their compiled programs
                try:
                    from distributed import Client
                except ImportError as error:
                    raise ImportError("--scheduler: needs the extra jaxcontact[cluster]") from error
                client = stack.enter_context(Client(options.scheduler))
                client.run(enable_compilation_cache)
                executor = client.get_executor()
            where = {"executor": executor, "processes": options.processes}
            found = sweep_of(compute, cases, options.directory, identity, **where)
    except KeyboardInterrupt as interrupt:
        reason = "finished cases are kept; the same command continues"
        name = signal_of(interrupt).name
        return print_error(f"{study.path}: interrupted by {name}: {reason}", exit_status(interrupt))
    except ValueError as error:
        raise CaseError(f"{study.path}: {error}") from error

    # a row for each case: the varied values, and its figures with their notes or the failure
    rows: list[dict[str, Any]] = []
    for index, values in enumerate(study.cases):
        row = {"case": index} | _varying(values)
        if index in found.failures:
            rows.append(row | {"failure": found.failures[index]})
            continue
        notes = found.notes.get(index, ())
        figures = {name: value.item() for name, value in found[index].items()}
        rows.append(row | figures | {"warnings_count": len(notes), "notes": "; ".join(notes)})
    names = list(dict.fromkeys(name for row in rows for name in row if name != "failure"))
    write_whole(options.directory / TABLE, lambda path: _write_table(path, [*names, "failure"], rows))
    summary = {
        "jaxcontact_version": __version__,
        "study": study.path.name,
        "varied": list(study.cases[0]),
        "cases_count": len(found),
        "failed_count": len(found.failures),
        "notes": found.notes_in_words(),
        "failures": [study.cases[i] | {"case": i, "failure": why} for i, why in found.failures.items()],
    }
    text = json.dumps(summary, indent=2, ensure_ascii=False) + "\n"
    write_whole(options.directory / SUMMARY, lambda path: path.write_text(text, encoding="utf-8"))
    undrawn = _draw(study, found, options.directory / PICTURE)
    counts = [f"note: {line}" for line in found.notes_in_words()]
    counts += [f"no picture: {undrawn}"] if undrawn else []
    tell(
        "\n".join([f"{len(found.done())} of {len(found)} cases, in {options.directory / TABLE}", *counts]),
        sys.stdout,
    )
    for index, why in found.failures.items():
        tell(f"jaxcontact: warning: case {index}, {in_words(study.cases[index])}: {why}", sys.stderr)
    if not found.failures:
        return FINE
    reason = f"{len(found.failures)} of {len(found)} cases failed; the same command tries them again"
    return print_error(f"{study.path}: {reason}", NOT_CONVERGED)


def figures_by(tables: dict[str, Any], path: str) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """Return the function that runs a case of the tables with other values and returns its figures."""

    def figures(values: dict[str, Any]) -> dict[str, Any]:
        changed = {key: value for key, value in values.items() if key != CASE}
        case = varied(tables, changed, Path(path))
        advice.check(case, Path(path))
        result = case.run()
        status = np.atleast_1d(np.asarray(result.status))
        if np.any(status):  # a case that fails has no figures
            step = int(np.argmax(status > 0))
            where = f"step {step + 1} of {status.size}: " if status.size > 1 else ""
            raise RuntimeError(where + Status(int(status[step])).message)
        return figures_in(values_of(result), hasattr(result, "times"))

    return figures


def _varying(case: dict[str, Any]) -> dict[str, Any]:
    return {key: json.dumps(value) if isinstance(value, list) else value for key, value in case.items()}


def _draw(study: CaseStudy, found: Study, path: Path) -> str | None:
    """Draw the main figures over one or two varied numbers; return the reason if there is nothing to draw.

    Without a picture of these cases, an earlier one of other cases is removed.
    """
    from jaxcontact.results.plotting import studies_figure, varied_numbers
    from jaxcontact.shell.finished_steps import write_picture

    path.unlink(missing_ok=True)
    done = found.done()
    if not done:
        return "every case failed"
    try:
        numbers = varied_numbers(study.cases)
    except ValueError as error:
        return str(error)
    if not 1 <= len(numbers) <= 2:
        return f"expected one or two numbers that vary, got {len(numbers)}" + "".join(
            f", {n}" for n in numbers
        )
    # the values at the end, or those of a steady state: peak_pressure_end_Pa or peak_pressure_Pa
    titles = {}
    for name in found[done[0]]:
        for own in DRAWN:
            *end, unit = name.removeprefix(own + "_").split("_")
            if name.startswith(own) and (not end or end[0] == "end"):
                titles[name] = f"{own.replace('_', ' ')}{' at the end' if end else ''} [{unit}]"
    if not titles:
        return f"the cases have none of {', '.join(DRAWN)}"
    labels = labels_of(study.cases, study.tables)
    cases = [{labels[name]: value for name, value in case.items()} for case in study.cases]
    drawn = {title: found.stacked(name) for name, title in titles.items()}
    write_picture(path, studies_figure(cases, drawn))
    return None


def labels_of(cases: Sequence[dict[str, Any]], tables: dict[str, Any]) -> dict[str, str]:
    """Return the varied keys with their units, for axes; tables: of the case file."""
    _, sections = kind_of(tables)
    units = {name: unit_of(name, sections) for case in cases for name in case}
    return {name: f"{name} [{unit}]" if unit else name for name, unit in units.items()}


def _write_table(path: Path, names: list[str], rows: list[dict[str, Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names, restval="")
        writer.writeheader()
        writer.writerows(rows)
