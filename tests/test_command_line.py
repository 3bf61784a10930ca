"""The command line as a user meets it: results, refusals in one line, Ctrl-C."""

import json
import signal
import warnings

import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.__main__ import main

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


def test_ctrl_c_keeps_the_finished_steps(case, tmp_path, monkeypatch):
    """A real signal, sent by the progress bar once ten steps of forty are finished."""
    case.write_text(CASE.replace("steps = 6", "steps = 40"))
    out = tmp_path / "out"
    finished = []

    def update(bar, count):
        finished.append(count)
        if sum(finished) >= 10:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("tqdm.tqdm.update", update)
    assert main(["run", str(case), "-o", str(out)]) == 130
    assert json.loads((out / "summary.json").read_text())["interrupted"] is True
    with np.load(out / "result.npz") as arrays:
        assert arrays["approach"].size == sum(finished) < 40
        assert np.all(np.diff(arrays["approach"]) >= -1e-12)
