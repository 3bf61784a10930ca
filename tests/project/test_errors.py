"""Every error of user input that jaxcontact can raise, in four tables, read as a newcomer would.

Each row is a mistake and the words that must come back: mistakes_of_pressing.py, mistakes_of_motion.py,
mistakes_in_case_files.py and mistakes_in_the_shell.py have them. ``test_no_error_is_missing_from_the_tables`` finds
every place of the package that raises and fails for one that no row reaches.
"""

import ast
import functools
import re
import sys
import traceback
from pathlib import Path

import pytest
from mistakes_in_case_files import FILES, written
from mistakes_in_the_shell import SHELL, shell
from mistakes_of_motion import MOTION
from mistakes_of_pressing import PRESSING

import jaxcontact as jc
from jaxcontact.shell.case_file import CaseError, read_case

PACKAGE = Path(jc.__file__).parent
PYTHON = PRESSING | MOTION


@functools.cache
def made(name):
    """A mistake in Python: the error's text, and the places that it passed."""
    with pytest.raises(ValueError) as caught:
        PYTHON[name][0]()
    return str(caught.value), frozenset(places(caught.value))


def places(error):
    """(file, line) of the frames of an error and of its causes."""
    while error is not None:
        for frame in traceback.extract_tb(error.__traceback__):
            yield Path(frame.filename).name, frame.lineno
        error = error.__cause__


@pytest.mark.parametrize("name", PYTHON)
def test_a_mistake_in_python_is_named_with_what_was_expected_and_what_came(name):
    message, _ = made(name)
    assert re.search(PYTHON[name][1], message), message
    assert_reads_well(message)


def assert_reads_well(message):
    """One line, not long, that says what would be right; no traceback's jargon."""
    assert "\n" not in message and len(message) < 320, message
    assert re.search(r"expected|accepted|did you mean|overwrites|pass |install", message), message
    assert not re.search(r"Traceback|NoneType|Tracer|object at 0x", message), message


@pytest.mark.parametrize("name", FILES)
def test_a_mistake_in_a_case_file_is_named_with_file_and_key(name, tmp_path):
    path, words = written(name, tmp_path)
    with pytest.raises(CaseError, match=words) as caught:
        read_case(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    if name != "not TOML":  # the parser's own words, with line and column
        assert_reads_well(message.replace(str(tmp_path), ""))


@pytest.mark.parametrize("name", SHELL)
def test_a_mistake_in_the_shell_is_one_line_and_status_2(name, tmp_path, capfd):
    words, answer = SHELL[name]
    (tmp_path / "full.png").write_text("mine")
    assert shell(tmp_path, *words) == 2
    out, err = capfd.readouterr()
    assert re.search(answer, err) and out == ""
    assert err.count("\n") == 1


CHECKS = (
    *("require", "positive", "non_negative", "poisson_ratio", "not_decreasing"),
    *("finite", "between", "whole", "one_of", "somewhere_positive"),
)
ELSEWHERE = {  # reached by no row, and why
    "checks.py": "the checks themselves",
    "laws.py: rate": "the base of laws",
    "spectral.py: devices": "test_distributed.py, in a mesh",
    "shapes.py: outline": "of a flat punch, whose contact is known and never estimated",
    **{f"temperature.py: {name}": "test_heat.py" for name in ("check", "check_heat", "check_peclet")},
    **{f"temperature.py: {name}": "test_heat.py" for name in ("check", "heat_partition")},
    **{f"surfaces.py: {name}": "test_surface_files.py" for name in ("read_surface", "_read", "_library")},
    "plugins.py: load": "test_plugins.py",
    "pytree.py: __init__": "test_own_classes.py, a class without the decorator",
    "materials.py: __post_init__": "test_own_classes.py, a material without Poisson's ratio",
    **{f"materials.py: {name}": "test_materials.py, factors" for name in ("scaled", "shifted", "from_young")},
    "case_schema.py: take_up_material": "test_plugins.py",
    "storage.py: _xarray": "test_storage.py, without the extra",
    "fields.py: extra": "test_summaries.py, without the extra",
    "contact.py: _check_one": "test_summaries.py, many runs",
    **{
        f"sweep.py: {name}": "test_studies.py"
        for name in (*("sweep", "sweep_of", "_outcomes", "_attempt", "__getitem__", "stacked"),)
    },
    **{f"plotting.py: {name}": "test_studies.py" for name in ("draw_study", "varied_numbers")},
    **{
        f"fingerprint.py: {name}": "test_fingerprint.py" for name in ("_refuse", "_function", "source_digest")
    },
    "storage.py: _inputs": "test_storage.py, every name",
    "files.py: write_whole": "needs a full disk: test_full_disk.py",
    **{
        f"storage.py: {name}": "test_storage.py, forged files"
        for name in ("_check_arrays", "_check_notes", "_check_axis", "_count_of_times", "_read_netcdf")
    },
    "files.py: _members": "test_storage.py, forged files",
    "files.py: _array": "test_storage.py, forged files",
    "terminal.py: _raise": "needs a signal: test_stopped_runs.py",
    "run.py: planned": "a NotImplementedError: a steady state is not marched",
    "files.py: locked": "needs two runs: test_stopped_runs.py",
    "finished_steps.py: resume_point": "needs a stopped run: test_stopped_runs.py",
    "sweep.py: run_study": "a folder of another study: test_study_files.py, test_full_disk.py; an extra that lacks",
    **{f"sweep.py: {name}": "a solve that fails: test_study_files.py" for name in ("figures", "figures_by")},
    "advice.py: check_disk": "needs a full disk: test_command_line.py",
    "sensitivity.py: plot": "needs a computed table: test_gradients.py",
    "contact.py: peak_pressure": "an AttributeError: test_summaries.py",
    **{
        place: "a request or an option of the page: test_play_page.py"
        for place in (
            "server.py: play",
            "__main__.py: _port_number",
            "server.py: checked",
            "server.py: do_POST",
        )
    },
    "__init__.py: __getattr__": "an AttributeError: test_public_api.py",
    "contact.py: largest_over_time": "an AttributeError: test_rubbed_films.py",
}


def raising_places():
    """(file, first line, last line, function) of everything that raises or checks, but not within the oracles."""
    for path in PACKAGE.rglob("*.py"):
        if "reference" in path.parts or path.name == "checks.py":
            continue
        functions = [
            node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)
        ]
        for function in functions:
            for node in ast.walk(function):
                called = node.func if isinstance(node, ast.Call) else None
                checks = getattr(called, "attr", getattr(called, "id", "")) in CHECKS
                if checks or (isinstance(node, ast.Raise) and node.exc is not None):
                    yield path.name, node.lineno, node.end_lineno, function.name


def test_no_error_is_missing_from_the_tables(tmp_path, monkeypatch):
    reached = {place for name in PYTHON for place in made(name)[1]}
    # main complains while it handles the error
    monkeypatch.setattr(
        "jaxcontact.__main__.print_error", lambda *_: reached.update(places(sys.exc_info()[1]))
    )

    (tmp_path / "full.png").write_text("mine")
    for name in FILES:
        with pytest.raises(CaseError) as caught:
            read_case(written(name, tmp_path)[0])
        reached.update(places(caught.value))
    for words, _ in SHELL.values():
        shell(tmp_path, *words)
    missing = [
        f"{file}:{first} {function}"
        for file, first, last, function in raising_places()
        if not any((file, line) in reached for line in range(first, last + 1))
        and f"{file}: {function}" not in ELSEWHERE
    ]
    assert not missing, "\n".join(missing)
