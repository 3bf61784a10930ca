"""The command line as a user meets it: results, and refusals in one line."""

import inspect
import io
import json
import os
import re
import subprocess
import sys
import types
import warnings
from pathlib import Path

import jax
import numpy as np
import pytest
from test_progress import Terminal

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact.shell.case_file import read_case
from jaxcontact.shell.case_schema import KINDS

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


@pytest.mark.slow
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
    printed = capfd.readouterr()
    assert "film strain" in printed.err and "\nnote: film strain above 0.2\n" in printed.out
    assert summary["warnings"] == list(expected.notes) == list(jc.read_result(out / "result.npz").notes)


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
TRACED = {"fretting_coating", "rolling_wheel", "sliding_film"}  # their check traces a function, for seconds


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
    signature = inspect.signature(KINDS[a.kind].verb).parameters
    expected = {name: a.options.get(name, signature[name].default) for name in b.options}
    assert b.options == expected and len(b.options) >= 2
    assert a.kind == b.kind and set(a.motion) <= set(b.motion)
    lines = [line for line in shown.read_text().splitlines() if "=" in line and not line.startswith("#")]
    assert all("  # " in line for line in lines)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[] if n == "rolling_wheel" else [pytest.mark.long]) for n in sorted(TRACED)],
)
def test_a_ready_made_case_runs(name, tmp_path, capfd):
    """The ball of ``fretting_coating`` sticks in its middle and loses energy, the wheel creeps forward as it brakes, and
    the ball over the film is pushed back by more than Coulomb's friction."""
    assert main(["run", name, "-o", str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["status"] == 0 and summary["warnings"] == []
    if name == "fretting_coating":
        assert 0.0 < summary["sticking_share_end_m2_per_m2"] < 1.0 and summary["dissipated_end_J"] > 0.0
    elif name == "rolling_wheel":
        assert summary["creepage_x_m_per_m"] > 0.0
        power = summary["tangential_load_x_N"] * summary["creepage_x_m_per_m"] * 10.0
        assert summary["power_W"] == pytest.approx(power, rel=1e-6)
    else:
        assert summary["tangential_force_end_N"] > summary["coulomb_force_end_N"]
        assert summary["friction_coefficient_end_N_per_N"] > 0.3
        assert summary["coulomb_force_end_N"] == pytest.approx(0.3 * summary["load_end_N"], rel=1e-6)


def test_plot_and_convert_take_a_saved_result_and_overwrite_nothing(case, tmp_path, capfd):
    out = tmp_path / "out"
    assert main(["run", str(case), "-o", str(out)]) == 0
    assert main(["plot", str(out / "result.npz")]) == 0
    assert (out / "result.png").read_bytes().startswith(b"\x89PNG")
    assert main(["plot", str(out / "result.npz")]) == 2
    assert "--force" in capfd.readouterr().err
    assert main(["plot", str(out / "result.npz"), "-o", str(tmp_path / "a.svg")]) == 0
    assert "pressure [" in (tmp_path / "a.svg").read_text()
    assert main(["plot", str(out / "summary.json")]) == 2
    film = tmp_path / "press.pvd"
    assert main(["convert", str(out / "result.npz"), "-o", str(film)]) == 0
    assert film.read_text().count(".vtr") == len(list((tmp_path / "press").iterdir())) == 7
    of_the_run = sorted(out.iterdir())
    beside = tmp_path / "out.pvd"  # its pieces would otherwise lie in the folder of the run
    assert main(["convert", str(out / "result.npz"), "-o", str(beside)]) == 0
    assert main(["convert", str(out / "result.npz"), "-o", str(beside)]) == 2
    assert main(["convert", str(out / "result.npz"), "-o", str(beside), "--force"]) == 0
    assert sorted(out.iterdir()) == of_the_run
    pieces = re.findall('file="(.*?)"', beside.read_text())
    assert len(pieces) == 7 and all((tmp_path / piece).exists() for piece in pieces)
    history = jc.read_result(out / "result.npz")
    summary = json.loads((out / "summary.json").read_text())
    assert history.pressure.shape == (7, 32, 32)
    assert float(history.approach[-1]) == summary["approach_end_m"]
    assert set(summary["arrays_in_result_npz"]) == set(np.load(out / "result.npz").files) - {"kind", "case"}


def test_a_finished_run_has_nothing_left_to_resume_and_that_is_no_error(case, tmp_path, capfd):
    """Status 0 and the same files; another case, or a run whose result is gone, is refused as before."""
    out = tmp_path / "out"
    command = ["run", str(case), "-o", str(out), "--resume"]
    assert main(command) == 0
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    capfd.readouterr()
    assert main(command) == 0
    assert "7 of 7 steps are finished; --resume has nothing left to compute" in capfd.readouterr().out
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    text = case.read_text()
    case.write_text(text.replace("load = 10.0", "load = 11.0"))
    assert main(command) == 2
    assert "found no unfinished run and no finished one of this case" in capfd.readouterr().err
    case.write_text(text)
    (out / "result.npz").unlink()
    assert main(command) == 2


def test_run_without_a_place_for_results_says_so(case, capfd):
    assert main(["run", str(case)]) == 2
    assert "-o DIR" in capfd.readouterr().err


@pytest.mark.parametrize("no_color", ["", "1"])
def test_an_error_is_red_on_a_terminal_unless_its_user_wants_no_colour(no_color, monkeypatch):
    monkeypatch.setenv("NO_COLOR", no_color)
    terminal, pipe = Terminal(), io.StringIO()
    for stream in (terminal, pipe):
        monkeypatch.setattr("sys.stderr", stream)
        assert main(["check", "no such error: file"]) == 2
    plain = pipe.getvalue()
    assert plain.startswith("jaxcontact: error: ") and "\x1b" not in plain
    red = plain.replace("error", "\x1b[31merror\x1b[0m", 1)
    assert terminal.getvalue() == (plain if no_color else red)


def test_a_packaged_case_goes_by_its_name_and_a_file_of_that_name_before_it(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert main(["check", "maxwell_half_space"]) == 0
    assert "cases/maxwell_half_space.toml: can run" in capfd.readouterr().out
    Path("maxwell_half_space").write_text("[nothing]\n")
    assert main(["check", "maxwell_half_space"]) == 2
    assert "nothing" in capfd.readouterr().err
    assert main(["check", "no_such_case"]) == 2
    assert capfd.readouterr().err.endswith("a name that jaxcontact cases lists\n")
    assert main(["check", "maxwel_half_space"]) == 2
    assert 'did you mean "maxwell_half_space"?' in capfd.readouterr().err


@pytest.mark.parametrize(
    "name", ["*", "?ilm_map", "[a-z]*", "**", "../cases/film", "C:\\missing", "/missing", ""]
)
@pytest.mark.parametrize(
    "command", [["run", "--show"], ["check"], ["sweep", "-o", "out"]], ids=lambda command: command[0]
)
def test_a_name_is_no_pattern_and_a_path_of_another_system_is_a_missing_file(
    name, command, tmp_path, capfd, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert main([*command, name]) == 2
    printed, complaint = capfd.readouterr()
    assert printed == "" and complaint.count("\n") == 1 and complaint.startswith("jaxcontact: error: ")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_name_that_the_console_cannot_show_is_shown_by_its_numbers(tmp_path):
    path = tmp_path / "Öl_Ω.toml"
    path.write_text(CASE.replace('"burgers"', '"burgers"  # Ω'), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "jaxcontact", "check", str(path)], capture_output=True,
        env=os.environ | {"PYTHONIOENCODING": "cp1252", "PYTHONUTF8": "0"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Öl_\\u03a9.toml: can run".encode("cp1252") in done.stdout and b"Traceback" not in done.stderr
