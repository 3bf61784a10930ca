"""The command line as a user meets it: results, refusals in one line, Ctrl-C."""

import inspect
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import types
import warnings
from pathlib import Path

import jax
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact.commands.interrupts import signals_interrupt
from jaxcontact.commands.status import tell
from jaxcontact.files.case_file import read_case
from jaxcontact.files.run_directory import claimed

ROOT = Path(__file__).parents[1]

pytestmark = pytest.mark.versions

CASE = """
[layer]
material = "burgers"
G1 = 0.75e9
G2 = 13.89e6
eta1 = 3.1486e12
eta2 = 120.9e9
nu = 0.3
thickness = 150e-9
[substrate]
material = "elastic"
E = 210e9
nu = 0.3
[indenter]
shape = "sphere"
radius = 9.525e-3
[control]
load = 10.0
[times]
end = 600.0
steps = 6
[grid]
n = 32
width = 300e-6
"""

BAD = {
    "missing key": ("radius = 9.525e-3\n", "", "radius"),
    "negative thickness": ("150e-9", "-150e-9", "thickness"),
    "nu above one half": ("eta2 = 120.9e9\nnu = 0.3", "eta2 = 120.9e9\nnu = 0.6", "nu"),
    "text for a number": ("load = 10.0", 'load = "ten"', "load"),
    "unknown key": ("thickness", "thicknes", "thickness"),
    "unsorted times": ("end = 600.0\nsteps = 6", "values = [0.0, 2.0, 1.0]", "times"),
    "negative load": ("load = 10.0", "load = -10.0", "oad"),
    "contact at the edge": ("width = 300e-6", "width = 100e-6", "edge"),
    "grid too coarse": ("width = 300e-6", "width = 9000e-6", "cells"),
    "broken TOML": ("[control]", "[control", "case.toml"),
}


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    return path


def test_a_run_writes_what_indent_gives(case, tmp_path, capfd):
    out = tmp_path / "out"
    assert main(["run", str(case), "-o", str(out)]) == 0
    steel = jc.Elastic.from_young(210e9)
    film = jc.Burgers(0.75e9, 13.89e6, 3.1486e12, 120.9e9)
    body = jc.LayeredHalfSpace([jc.Layer(film, 150e-9)], steel)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        expected = jc.indent(
            body,
            jc.Sphere(9.525e-3),
            jc.Load(10.0),
            np.linspace(0.0, 600.0, 7),
            grid=jc.Grid.square(32, 300e-6),
        )
    with np.load(out / "result.npz") as arrays:
        np.testing.assert_allclose(arrays["approach"], expected.approach, rtol=1e-10)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["approach_end_m"] == pytest.approx(float(expected.approach[-1]), rel=1e-10)
    assert {p.name for p in out.glob("*.png")} >= {"pressure_profiles.png", "history.png", "surface.png"}
    assert all((out / p).stat().st_size > 5000 for p in out.glob("*.png"))
    assert "film strain" in capfd.readouterr().err


def test_nothing_is_overwritten_without_force(case, tmp_path, capfd):
    out = tmp_path / "out"
    out.mkdir()
    (out / "summary.json").write_text("mine")
    assert main(["run", str(case), "-o", str(out)]) == 2
    assert (out / "summary.json").read_text() == "mine"
    assert capfd.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_line_and_status_2_and_leaves_earlier_results(name, case, tmp_path, capfd):
    old, new, words = BAD[name]
    assert old in CASE
    case.write_text(CASE.replace(old, new))
    out = tmp_path / "out"
    out.mkdir()
    (out / "summary.json").write_text("mine")
    assert main(["run", str(case), "-o", str(out), "--force"]) == 2
    errors = [line for line in capfd.readouterr().err.splitlines() if "warning" not in line]
    assert len(errors) == 1 and words in errors[0]
    assert "case.toml" in errors[0]
    assert (out / "summary.json").read_text() == "mine"


def test_a_missing_file_is_one_line(tmp_path, capfd):
    assert main(["run", str(tmp_path / "none.toml"), "-o", str(tmp_path / "out")]) == 2
    assert capfd.readouterr().err.count("\n") == 1


def test_not_converged_is_status_3_and_says_so(case, tmp_path, capfd):
    case.write_text(CASE + "[solver]\nmax_iterations = 1\n")
    assert main(["run", str(case), "-o", str(tmp_path / "out")]) == 3
    assert "converge" in capfd.readouterr().err


@pytest.fixture
def long_case(case):
    """Of forty steps, which are eight blocks."""
    case.write_text(CASE.replace("steps = 6", "steps = 40").replace("n = 32", "n = 16"))
    return case


def assert_same_files(a, b):
    """Bit for bit; but the time that each run took is its own."""
    summaries = []
    for folder in (a, b):
        summary = json.loads((folder / "summary.json").read_text())
        assert summary.pop("wall_time_s") > 0.0
        summaries.append(summary)
    assert summaries[0] == summaries[1]
    names = {path.name for path in a.iterdir()}
    assert names == {path.name for path in b.iterdir()} and "result.npz" in names
    for name in names - {"summary.json"}:
        assert (a / name).read_bytes() == (b / name).read_bytes(), name


@pytest.fixture
def interrupted(long_case, tmp_path, monkeypatch):
    """A run into a new directory, ended by a real signal once ten steps of forty are finished."""

    def run(number):
        finished = []

        def update(bar, count):
            finished.append(count)
            if sum(finished) >= 10:
                signal.raise_signal(number)

        # a shell starts its background jobs with Ctrl-C ignored
        # whoever runs the tests may have them ignored, as nohup does
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        others = {other: signal.signal(other, signal.SIG_DFL) for other in (signal.SIGTERM, signal.SIGHUP)}
        try:
            with monkeypatch.context() as patch:
                patch.setattr("tqdm.tqdm.update", update)
                status = main(["run", str(long_case), "-o", str(tmp_path / "out")])
        finally:
            signal.signal(signal.SIGINT, before)
            for other, handler in others.items():
                signal.signal(other, handler)
        return tmp_path / "out", status, sum(finished)

    return run


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_keeps_the_finished_steps(name, interrupted, capfd):
    number = signal.Signals[name]
    out, status, finished = interrupted(number)
    assert status == 128 + number
    assert json.loads((out / "summary.json").read_text())["interrupted"] is True
    with np.load(out / "result.npz") as arrays:
        assert arrays["approach"].size == finished < 40
        assert np.all(np.diff(arrays["approach"]) >= -1e-12)
    (error,) = [line for line in capfd.readouterr().err.splitlines() if "error" in line]
    assert f"{name}: {finished} of 41 steps" in error and "--resume" in error


def test_a_run_that_was_stopped_or_killed_goes_on_to_the_same_files(
    interrupted, long_case, tmp_path, monkeypatch
):
    """What SIGKILL leaves is the files as they are at that moment: here, at every renaming of one."""
    killed, moves = [], []

    def replace(source, target, move=os.replace):
        if len(moves) in (1, 6, 7):  # before the first checkpoint, a third block, a fourth checkpoint
            killed.append(tmp_path / f"killed_{len(moves)}")
            shutil.copytree(tmp_path / "out", killed[-1])
        moves.append(target.name)
        move(source, target)

    with monkeypatch.context() as patch:
        patch.setattr("os.replace", replace)
        out, status, _ = interrupted(signal.SIGTERM)
    assert status == 143 and len(killed) == 3
    assert main(["run", str(long_case), "-o", str(tmp_path / "whole")]) == 0
    for stopped in (out, *killed):
        assert main(["run", str(long_case), "-o", str(stopped), "--resume"]) == 0
        assert_same_files(stopped, tmp_path / "whole")


def started(case, out, cache):
    """``jaxcontact run`` in a process of its own, and a function that waits until it has finished more steps."""
    environment = os.environ | {
        "JAX_COMPILATION_CACHE_DIR": str(cache), "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        "TF_CPP_MIN_LOG_LEVEL": "3",
    }  # fmt: skip
    command = [sys.executable, "-m", "jaxcontact", "run", str(case), "-o", str(out), "--resume"]
    checkpoint = out / "unfinished" / "checkpoint.npz"
    before = checkpoint.stat().st_mtime_ns if checkpoint.exists() else 0
    process = subprocess.Popen(command, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True)

    def wait():
        while not (checkpoint.exists() and checkpoint.stat().st_mtime_ns > before):
            assert process.poll() is None, process.stderr.read()
            time.sleep(0.01)

    return process, wait


@pytest.mark.slow
def test_a_process_that_is_killed_twice_ends_as_if_it_had_not_been(case, tmp_path):
    case.write_text(CASE.replace("steps = 6", "steps = 1000").replace("n = 32", "n = 16"))
    out, whole = tmp_path / "out", tmp_path / "whole"
    for number in (signal.SIGKILL, signal.SIGTERM):
        process, wait = started(case, out, tmp_path / "cache")
        wait()
        process.send_signal(number)
        errors = [line for line in process.communicate()[1].splitlines() if "error" in line]
        # what Python can still say itself it says as an exit status, as a shell would for the other
        assert process.returncode == (-number if number == signal.SIGKILL else 128 + number)
        assert len(errors) == (number == signal.SIGTERM)
    assert main(["run", str(case), "-o", str(out), "--resume"]) == 0
    assert main(["run", str(case), "-o", str(whole)]) == 0
    assert_same_files(out, whole)


def test_another_case_does_not_go_on_from_the_steps(interrupted, long_case, capfd):
    out, _, _ = interrupted(signal.SIGTERM)
    long_case.write_text(long_case.read_text().replace("load = 10.0", "load = 11.0"))
    capfd.readouterr()
    assert main(["run", str(long_case), "-o", str(out)]) == 2
    assert "--resume goes on" in capfd.readouterr().err
    assert main(["run", str(long_case), "-o", str(out), "--resume"]) == 2
    assert "steps of another case" in capfd.readouterr().err
    assert main(["run", str(long_case), "-o", str(out), "--force"]) == 0
    assert not (out / "unfinished").exists()


def test_one_run_at_a_time_writes_into_a_directory(case, tmp_path, capfd):
    out = tmp_path / "out"
    with claimed(out, force=False, resume=False):
        for way in ([], ["--force"], ["--resume"]):
            assert main(["run", str(case), "-o", str(out), *way]) == 2
            errors = capfd.readouterr().err.splitlines()
            assert len(errors) == 1 and "another run" in errors[0]
    assert not out.exists()
    out.mkdir()
    (out / ".lock").touch()  # as a killed run leaves it
    assert main(["run", str(case), "-o", str(out)]) == 0
    assert not (out / ".lock").exists()


def test_what_is_ignored_stays_ignored():
    """``nohup jaxcontact run`` survives the hangup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with signals_interrupt():
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGHUP, before)


def test_nobody_needs_to_listen():
    """After a hangup the terminal is gone; here the reader of a pipe."""
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as stream:
        tell("a line", stream)
        tell("another", stream)


ABSURD = {
    "a thousand million steps": (
        "steps = 6",
        "steps = 1_000_000_000",
        "times.steps: found 1000000000, accepted",
    ),
    "ten million cells": ("n = 32", "n = 10_000_000", "grid.n: found 10000000, accepted"),
    "2^70 cells": ("n = 32", f"n = {2**70}", "grid.n: found 1180591620717411303424, accepted"),
    "twenty digits": (
        "[grid]",
        f"[solver]\nmax_iterations = {'9' * 20}\n[grid]",
        "solver.max_iterations: found",
    ),
    "400 digits": ("load = 10.0", f"load = 1{'0' * 400}", "control.load: found 1"),
    "5000 digits": ("load = 10.0", f"load = 1{'0' * 5000}", "not TOML"),
    "5000 hexadecimal digits": (
        "load = 10.0",
        f"load = 0x1{'0' * 5000}",
        "control.load: found a number of too many",
    ),
    "5000 brackets": ("load = 10.0", f"load = {'[' * 5000}{']' * 5000}", "not TOML"),
    "a width beyond all bounds": ("width = 300e-6", "width = 1e300", "grid.width: found 1e+300, accepted"),
    "more memory than there is": ("n = 32", "n = 65536", "GB of this machine"),
}


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize("name", ABSURD)
def test_what_no_machine_can_do_is_one_line_before_anything_is_computed(name, command, case, tmp_path, capfd):
    old, new, words = ABSURD[name]
    assert old in CASE
    case.write_text(CASE.replace(old, new))
    out = tmp_path / "out"
    assert main([command, str(case), *(["-o", str(out)] if command == "run" else [])]) == 2
    errors = capfd.readouterr().err.splitlines()
    assert len(errors) == 1 and errors[0].startswith(f"jaxcontact: error: {case}: ") and words in errors[0]
    assert len(errors[0]) < 400 + len(str(case)) and not out.exists()


def test_a_full_disk_is_known_before_the_run(case, tmp_path, monkeypatch, capfd):
    for free, status in ((1e5, 2), (1e6, 0)):
        usage = types.SimpleNamespace(free=free)
        monkeypatch.setattr("shutil.disk_usage", lambda path, usage=usage: usage)
        assert main(["run", str(case), "-o", str(tmp_path / "out")]) == status
    assert re.search(
        "found a run that needs .* MB on disk, accepted: up to the 0.1 MB", capfd.readouterr().err
    )


def test_an_editor_may_mark_the_file_as_utf_8(case):
    plain = read_case(case)
    case.write_bytes(b"\xef\xbb\xbf" + CASE.encode())
    assert read_case(case).tables == plain.tables


READY_MADE = sorted((Path(jc.__file__).parent / "cases").glob("*.toml"))


@pytest.mark.parametrize("path", READY_MADE, ids=lambda path: path.stem)
def test_a_shown_case_reads_back_as_the_same_case(path, tmp_path, capsys):
    assert main(["run", "--show", str(path)]) == 0
    shown = tmp_path / "shown.toml"
    shown.write_text(capsys.readouterr().out)
    a, b = read_case(path), read_case(shown)
    assert jax.tree.structure((a.body, a.indenter, a.control, a.grid)) == jax.tree.structure(
        (b.body, b.indenter, b.control, b.grid)
    )
    leaves = (jax.tree.leaves((c.body, c.indenter, c.control, c.times, c.grid)) for c in (a, b))
    for x, y in zip(*leaves, strict=True):
        np.testing.assert_allclose(x, y, rtol=1e-14)
    signature = inspect.signature(jc.indent).parameters
    assert b.options == {name: signature[name].default for name in b.options} and len(b.options) == 5
    lines = [line for line in shown.read_text().splitlines() if "=" in line and not line.startswith("#")]
    assert all("  # " in line for line in lines)


def test_a_ready_made_case_is_checked_without_running_and_without_warning(capfd, monkeypatch):
    monkeypatch.setattr("jaxcontact.commands.run.prepare", None)
    for path in READY_MADE:
        assert main(["check", str(path)]) == 0
    out, err = capfd.readouterr()
    assert out.count("can run") == len(READY_MADE) == 3
    assert err == ""


CHECKED = {
    "coarse grid": ("n = 32", "n = 8", "grid.n"),
    "narrow grid": ("width = 300e-6", "width = 150e-6", "grid.width"),
    "long steps": ("steps = 6", "steps = 3", "substeps = 2"),
}


@pytest.mark.parametrize("name", CHECKED)
def test_check_warns_and_is_not_an_error(name, case, capfd):
    old, new, words = CHECKED[name]
    case.write_text(CASE.replace(old, new))
    assert main(["check", str(case)]) == 0
    out, err = capfd.readouterr()
    assert "1 warning" in out
    assert err.count("\n") == 1 and words in err


@pytest.mark.parametrize("name", ["missing key", "unknown key", "text for a number", "broken TOML"])
def test_check_refuses_what_run_refuses(name, case, capfd):
    old, new, words = BAD[name]
    case.write_text(CASE.replace(old, new))
    assert main(["check", str(case)]) == 2
    out, err = capfd.readouterr()
    assert words in err and out == ""
    if name == "unknown key":
        assert 'did you mean "thickness"?' in err


def test_plot_draws_a_saved_result_and_overwrites_nothing(case, tmp_path, capfd):
    out = tmp_path / "out"
    assert main(["run", str(case), "-o", str(out)]) == 0
    assert main(["plot", str(out / "result.npz")]) == 0
    assert (out / "result.png").read_bytes().startswith(b"\x89PNG")
    assert main(["plot", str(out / "result.npz")]) == 2
    assert "--force" in capfd.readouterr().err
    assert main(["plot", str(out / "result.npz"), "-o", str(tmp_path / "a.svg")]) == 0
    assert "pressure [" in (tmp_path / "a.svg").read_text()
    assert main(["plot", str(out / "summary.json")]) == 2
    history = jc.load(out / "result.npz")
    summary = json.loads((out / "summary.json").read_text())
    assert history.pressure.shape == (7, 32, 32)
    assert float(history.approach[-1]) == summary["approach_end_m"]
    assert set(summary["arrays_in_result_npz"]) == set(np.load(out / "result.npz").files) - {"kind", "case"}


def test_run_without_a_place_for_results_says_so(case, capfd):
    assert main(["run", str(case)]) == 2
    assert "-o DIR" in capfd.readouterr().err


def test_cite_and_cases_print(capfd):
    assert main(["cite"]) == 0
    assert "10.1007/s11249-025-01990-5" in capfd.readouterr().out
    assert main(["cases"]) == 0
    assert capfd.readouterr().out.count(".toml") == 3
