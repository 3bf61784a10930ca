"""Runs that are stopped: by Ctrl-C, by a signal, by force; and runs that meet in one directory."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from test_command_line import CASE

from jaxcontact.__main__ import main
from jaxcontact._support.files import claimed
from jaxcontact._support.terminal import signals_interrupt, tell

ROOT = Path(__file__).parents[2]


def text_of(kind, steps=40):
    """A case of that kind on 16 x 16 cells; the sheared and the sliding one keep a few maps, between which slip adds up."""
    text = CASE.replace("steps = 6", f"steps = {steps}").replace("n = 32", "n = 16")
    head, few = f'[experiment]\nkind = "{kind}"\nfriction = 0.2\n', '[solver]\nsave = "few"\n'
    if kind == "shear":
        path = np.stack(
            [3e-7 * np.sin(np.arange(steps + 1) / 6.0), 1e-7 * np.cos(np.arange(steps + 1) / 9.0)], 1
        )
        text = text.replace("load = 10.0", f"load = 10.0\ntangential_displacement = {path.tolist()}")
        return head + "coupled = false\n" + text + few
    return head + "velocity = 1e-7\n" + text + few if kind == "sliding" else text


@pytest.fixture
def long_case(tmp_path, request):
    """Of forty steps, which are nine blocks: an indentation, or of the kind that a test names."""
    path = tmp_path / "case.toml"
    path.write_text(text_of(getattr(request, "param", "indentation")))
    return path


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
    """A run into a new directory, ended by a real signal once fifteen steps of forty are finished."""

    def run(number):
        finished = []

        def update(progress, count):
            finished.append(count)
            if sum(finished) >= 15:
                signal.raise_signal(number)

        # a shell starts its background jobs with Ctrl-C ignored
        # whoever runs the tests may have them ignored, as nohup does
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        others = {other: signal.signal(other, signal.SIG_DFL) for other in (signal.SIGTERM, signal.SIGHUP)}
        try:
            with monkeypatch.context() as patch:
                patch.setattr("jaxcontact._support.terminal.Progress.advance", update)
                status = main(["run", str(long_case), "-o", str(tmp_path / "out")])
        finally:
            signal.signal(signal.SIGINT, before)
            for other, handler in others.items():
                signal.signal(other, handler)
        return tmp_path / "out", status, sum(finished)

    return run


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        pytest.param("SIGINT", marks=pytest.mark.versions),
        "SIGTERM",
        pytest.param("SIGHUP", marks=pytest.mark.long),
    ],
)
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


@pytest.mark.slow
@pytest.mark.parametrize(
    "long_case",
    [
        "indentation",
        pytest.param("shear", marks=(pytest.mark.long, pytest.mark.versions)),
        pytest.param("sliding", marks=pytest.mark.long),
    ],
    indirect=True,
)
def test_a_run_that_was_stopped_or_killed_goes_on_to_the_same_files(
    interrupted, long_case, tmp_path, monkeypatch
):
    """What SIGKILL leaves is the files as they are at that moment: here, at every renaming of one."""
    killed, moves = [], []

    def replace(source, target, move=os.replace):
        if tmp_path in Path(target).parents:
            if len(moves) in (1, 4, 5):  # before the first checkpoint, the third block, the third checkpoint
                killed.append(tmp_path / f"killed_{len(moves)}")
                shutil.copytree(tmp_path / "out", killed[-1])
            moves.append(target)
        move(source, target)

    with monkeypatch.context() as patch:
        patch.setattr("os.replace", replace)
        out, status, _ = interrupted(signal.SIGTERM)
    assert status == 143 and len(killed) == 3
    assert main(["run", str(long_case), "-o", str(tmp_path / "whole")]) == 0
    for stopped in (out, *killed):
        assert main(["run", str(long_case), "-o", str(stopped), "--resume"]) == 0
        assert_same_files(stopped, tmp_path / "whole")


SLOWLY = """
import time
from jaxcontact.__main__ import enter
from jaxcontact._support.terminal import Progress
advance = Progress.advance
Progress.advance = lambda self, count: (advance(self, count), time.sleep(1.0))
enter()
"""


def started(case, out, pauses=False):
    """``jaxcontact run`` in a process of its own, and a function that waits until it has finished more steps.

    With pauses, it rests for a second after every block of steps: no machine is so fast that it ends before its signal.
    """
    program = ["-c", SLOWLY] if pauses else ["-m", "jaxcontact"]
    command = [sys.executable, *program, "run", str(case), "-o", str(out), "--resume"]
    checkpoint = out / "unfinished" / "checkpoint.npz"
    before = checkpoint.stat().st_mtime_ns if checkpoint.exists() else 0
    process = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True)

    def wait():
        while not (checkpoint.exists() and checkpoint.stat().st_mtime_ns > before):
            assert process.poll() is None, process.stderr.read()
            time.sleep(0.01)

    return process, wait


@pytest.mark.long
@pytest.mark.parametrize("long_case", ["shear"], indirect=True)
def test_a_process_that_is_killed_twice_ends_as_if_it_had_not_been(long_case, tmp_path):
    """For shear, whose checkpoint has the most fields; the test above resumes all three kinds within one process."""
    out, whole = tmp_path / "out", tmp_path / "whole"
    for number in (signal.SIGKILL, signal.SIGTERM):
        process, wait = started(long_case, out, pauses=True)
        wait()
        process.send_signal(number)
        errors = [line for line in process.communicate()[1].splitlines() if "error" in line]
        assert process.returncode == (-number if number == signal.SIGKILL else 128 + number)
        assert len(errors) == (number == signal.SIGTERM)
    for folder in (out, whole):  # with the programs of the runs before: others may round differently
        process, _ = started(long_case, folder)
        errors = process.communicate()[1]
        assert process.returncode == 0, errors
    assert_same_files(out, whole)


@pytest.mark.slow
def test_another_case_does_not_go_on_from_the_steps(interrupted, long_case, capfd):
    out, _, _ = interrupted(signal.SIGTERM)
    long_case.write_text(long_case.read_text().replace("load = 10.0", "load = 11.0"))
    capfd.readouterr()
    assert main(["run", str(long_case), "-o", str(out)]) == 2
    assert "--resume continues" in capfd.readouterr().err
    assert main(["run", str(long_case), "-o", str(out), "--resume"]) == 2
    assert "steps of another case" in capfd.readouterr().err
    assert main(["run", str(long_case), "-o", str(out), "--force"]) == 0
    assert not (out / "unfinished").exists()


@pytest.mark.slow
def test_one_run_at_a_time_writes_into_a_directory(long_case, tmp_path, capfd):
    out = tmp_path / "out"
    with claimed(out, force=False, resume=False):
        for way in ([], ["--force"], ["--resume"]):
            assert main(["run", str(long_case), "-o", str(out), *way]) == 2
            errors = capfd.readouterr().err.splitlines()
            assert len(errors) == 1 and "another run" in errors[0]
    assert not out.exists()
    out.mkdir()
    (out / ".lock").touch()  # as a killed run leaves it
    assert main(["run", str(long_case), "-o", str(out)]) == 0
    assert not (out / ".lock").exists()


@pytest.mark.versions
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


@pytest.mark.versions
def test_nobody_needs_to_listen():
    """After a hangup the terminal is gone; here the reader of a pipe."""
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as stream:
        tell("a line", stream)
        tell("another", stream)


def cut(path):
    path.write_bytes(path.read_bytes()[:-30])


@pytest.mark.long
def test_a_run_goes_on_from_the_whole_files_where_some_are_damaged(interrupted, long_case, tmp_path, capfd):
    """Each damage to a file of the finished steps: to the same numbers, or refused by its name with a remedy."""
    out, _, _ = interrupted(signal.SIGTERM)
    unfinished = out / "unfinished"
    blocks = sorted(path.name for path in unfinished.glob("0*.npz"))
    newer, older = "checkpoint.npz", "checkpoint_of_odd.npz"
    if len(blocks) % 2:
        newer, older = older, newer
    assert main(["run", str(long_case), "-o", str(tmp_path / "whole")]) == 0
    whole = np.load(tmp_path / "whole" / "result.npz")
    damages = [
        ([newer], True),
        ([older], True),
        ([blocks[-1]], True),
        ([newer, older], False),
        ([blocks[0]], False),
    ]
    for index, (names, goes_on) in enumerate(damages):
        copy = tmp_path / f"copy_{index}"
        shutil.copytree(out, copy)
        for name in names:
            cut(copy / "unfinished" / name)
        capfd.readouterr()
        status = main(["run", str(long_case), "-o", str(copy), "--resume"])
        (line,) = [line for line in capfd.readouterr().err.splitlines() if "damaged" in line]
        assert any(str(copy / "unfinished" / name) in line for name in names)
        if goes_on:
            assert status == 0 and "finished steps are whole, and the run goes on" in line
            with np.load(copy / "result.npz") as found:
                for name in whole.files:
                    np.testing.assert_array_equal(found[name], whole[name])
        else:
            assert status == 2 and "--force starts anew" in line
            kept = f"the first {len(blocks)} blocks of steps beside it are whole, and numpy.load reads them"
            assert (kept in line) == (names != [blocks[0]])
            assert main(["run", str(long_case), "-o", str(copy), "--force"]) == 0
    whole.close()


@pytest.mark.slow
def test_another_state_of_the_package_does_not_go_on_from_the_steps(
    interrupted, long_case, monkeypatch, capfd
):
    out, _, _ = interrupted(signal.SIGTERM)
    monkeypatch.setattr("jaxcontact.shell.finished_steps.source_digest", lambda package: "changed physics")
    capfd.readouterr()
    assert main(["run", str(long_case), "-o", str(out), "--resume"]) == 2
    error = capfd.readouterr().err
    assert "of another state of jaxcontact" in error and "--force starts anew" in error


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGPIPE"), reason="a signal of Unix")
def test_a_reader_that_has_enough_of_the_output_ends_a_command_without_a_message():
    """As in ``jaxcontact cases | head -1``; with buffered lines the error comes at the flush, here at the first line."""
    command = [sys.executable, "-u", "-m", "jaxcontact", "cases"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT)
    process.stdout.close()
    assert process.stderr.read() == b""
    assert process.wait() == 128 + signal.SIGPIPE
    process.stderr.close()
