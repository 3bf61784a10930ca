"""Case files of shear, sliding and rolling: the same numbers as through Python, all of a run or nothing."""

import dataclasses
import inspect
import json
import signal
import threading
import time
from importlib.resources import files
from pathlib import Path

import jax
import numpy as np
import pytest
from matplotlib.figure import Figure
from test_storage import GRID, assert_same, made_up

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact._support.terminal import interruptible
from jaxcontact.shell import case_schema
from jaxcontact.shell.advice import footprint_of
from jaxcontact.shell.case_file import caption_of, read_case, write_under

SOLIDS = """
[substrate]
material = "elastic"
E = 210e9
[indenter]
shape = "sphere"
radius = 9.5e-3
[grid]
n = 16
width = 250e-6
"""
TIMES = "[times]\nvalues = [0.0, 1.0, 2.0]\n"
TEXTS = {
    "shear": '[experiment]\nkind = "shear"\nfriction = 0.3\ncoupled = false\n[control]\nload = [20.0, 20.0, 18.0]\n'
    "tangential_load = [[0.0, 0.0], [3.0, 1.0], [-3.0, 1.0]]\n[solver]\nsubsteps = 2\n" + TIMES,
    "sliding": '[experiment]\nkind = "sliding"\nvelocity = [[0.0, 0.0], [1e-5, 0.0], [1e-5, 2e-5]]\n'
    "friction = 0.2\n[control]\nload = 20.0\n" + TIMES,
    "rubbing": '[experiment]\nkind = "rubbing"\nvelocity = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.0]]\nfriction = 0.2\n'
    '[layer]\nmaterial = "elastic"\nG = "20 GPa"\nthickness = "h.npy"\n[control]\nload = 20.0\n[[growth]]\n'
    'rate = "10 pm/s"\nactivation_energy = "2e-21 J"\n'
    'activation_volume = "4 A3"\nstress = "shear"\n[[growth]]\nrate = 1e-12\nactivation_energy = 0.0\n'
    "activation_volume = 0.0\ntemperature = 373.0\n[removal]\nrate = 1e-3\n[wear]\ncoefficient = 1e-19\n[thermal]\n"
    "ambient = 373.0\nconductivity = 46.0\n[solver]\nthickest = 3e-7\n" + TIMES,
    "steady-sliding": '[experiment]\nkind = "steady-sliding"\nvelocity = [1.0, -1.0]\n[control]\nload = 20.0\n',
    "steady-rolling": '[experiment]\nkind = "steady-rolling"\nvelocity = 2.0\nfriction = "mu.npy"\n[control]\n'
    "load = 20.0\ntangential_load = [1.0, 0.0]\n[solver]\ntolerance = 1e-7\n",
}
STEEL, LOAD, TANGENTIAL = jc.Elastic.from_young(210e9), jc.Load(20.0), jc.TangentialLoad
MU = 0.3 + 0.01 * np.arange(256.0).reshape(16, 16) / 256.0
FILM = 1e-7 * MU
IN_PYTHON = {
    "shear": {
        "control": jc.Load([20.0, 20.0, 18.0]), "tangential": TANGENTIAL([[0.0, 0.0], [3.0, 1.0], [-3.0, 1.0]]),
        "times": [0.0, 1.0, 2.0], "friction": 0.3, "coupled": False, "substeps": 2,
    },
    "sliding": {
        "control": LOAD, "times": [0.0, 1.0, 2.0], "velocity": [[0.0, 0.0], [1e-5, 0.0], [1e-5, 2e-5]],
        "friction": 0.2,
    },
    "rubbing": {
        "body": jc.LayeredHalfSpace([jc.Layer(jc.Elastic(20e9), FILM)], STEEL),
        "control": LOAD, "times": [0.0, 1.0, 2.0],
        "velocity": [[0.0, 0.0], [0.1, 0.0], [0.1, 0.0]], "friction": 0.2, "thickest": 3e-7,
        "thermal": jc.Thermal(373.0, 46.0),
        "law": jc.StressActivated(1e-11, 2e-21, 4e-30, None, "shear") + jc.StressActivated(1e-12, 0.0, 0.0, 373.0)
        + jc.ProportionalRemoval(1e-3) + jc.Archard(1e-19),
    },
    "steady-sliding": {"control": LOAD, "velocity": (1.0, -1.0)},
    "steady-rolling": {
        "control": LOAD, "velocity": 2.0, "friction": MU, "creepage": TANGENTIAL((1.0, 0.0)), "tolerance": 1e-7,
    },
}  # fmt: skip
VERBS = {
    "shear": jc.shear,
    "sliding": jc.slide,
    "rubbing": jc.rub,
    "steady-sliding": jc.slide_steady,
    "steady-rolling": jc.roll_steady,
}


def given(kind):
    body, ball = jc.LayeredHalfSpace([], STEEL), jc.Sphere(9.5e-3)
    return {"body": body, "indenter": ball, "grid": jc.Grid.square(16, 250e-6)} | IN_PYTHON[kind]


@pytest.fixture
def written(tmp_path):
    """A case of a kind as a file, with what it names beside it."""

    def write(kind, *changes):
        np.save(tmp_path / "mu.npy", MU)
        np.save(tmp_path / "h.npy", FILM)
        text = TEXTS[kind] + SOLIDS
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "case.toml").write_text(text)
        return tmp_path / "case.toml"

    return write


@pytest.fixture
def instead(monkeypatch):
    """Another function in place of the one that runs a kind."""

    def put(kind, verb):
        monkeypatch.setitem(case_schema.KINDS, kind, dataclasses.replace(case_schema.KINDS[kind], verb=verb))

    return put


def assert_same_arguments(a, b):
    """Trees alike, whether a list or an array has the numbers."""
    assert set(a) == set(b)
    for name in a:
        kinds = [type(tree[name]) for tree in (a, b) if dataclasses.is_dataclass(tree[name])]
        assert len(set(kinds)) <= 1, name
        leaves = [np.concatenate([np.ravel(x) for x in jax.tree.leaves(tree[name])]) for tree in (a, b)]
        np.testing.assert_allclose(*leaves, rtol=1e-15, err_msg=name)


@pytest.mark.parametrize("kind", TEXTS)
def test_a_case_is_the_arguments_of_its_function(kind, written, instead):
    """Which they fit, and read back from what --show prints they are the same."""
    instead(kind, lambda **arguments: arguments)
    case = read_case(written(kind))
    assert_same_arguments(case.run(), given(kind))
    inspect.signature(VERBS[kind]).bind(**case.run())


@pytest.mark.parametrize("kind", TEXTS)
def test_a_shown_case_reads_back_with_every_default(kind, written, instead, tmp_path, capsys):
    instead(kind, lambda **arguments: arguments)
    path = written(kind)
    assert main(["run", "--show", str(path)]) == 0
    (tmp_path / "shown.toml").write_text(capsys.readouterr().out)
    shown = read_case(tmp_path / "shown.toml").run()
    own = read_case(path).run()
    assert_same_arguments({name: shown[name] for name in own}, own)
    defaults = inspect.signature(VERBS[kind]).parameters
    assert all(shown[name] == defaults[name].default for name in set(shown) - set(own))
    assert set(shown) >= {"tolerance", "max_iterations"}


def test_a_grid_may_be_periodic(written, instead):
    instead("sliding", lambda **arguments: arguments["grid"])
    whole = read_case(written("sliding", ("n = 16", "n = 16\nperiodic = true"))).run()
    assert whole == jc.Grid((16, 16), (250e-6 / 16, 250e-6 / 16), periodic=True)
    line = "shape = [16, 1]\nspacing = [1e-6, 1e-3]\nperiodic = [false, true]"
    assert read_case(written("sliding", ("n = 16\nwidth = 250e-6", line))).run() == jc.Grid(
        (16, 1), (1e-6, 1e-3), periodic=(False, True)
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=[pytest.mark.long] if "rolling" in kind else []) for kind in TEXTS]
)
def test_a_run_gives_the_numbers_that_python_gives(kind, written, tmp_path, capfd):
    out = tmp_path / "out"
    assert main(["check", str(written(kind))]) == 0
    assert main(["run", str(written(kind)), "-o", str(out)]) == 0
    assert "16 x 16 cells" in capfd.readouterr().out
    expected, found = VERBS[kind](**given(kind)), jc.read_result(out / "result.npz")
    assert type(found) is type(expected)
    assert {name for name, value in vars(found).items() if value is None} == {
        name for name, value in vars(expected).items() if value is None
    }
    for name, value in vars(expected).items():
        # blocks of steps are another program than one call, and round differently: within the tolerance of the
        # solver, 1e-7; the error is what rounding leaves of the residual
        if value is not None and name not in ("grid", "saved", "diagnostics", "error"):
            scale = np.max(np.abs(value), initial=0.0)
            np.testing.assert_allclose(
                getattr(found, name), value, rtol=1e-10, atol=1e-7 * scale, err_msg=name
            )


def fine(kind):
    """A made-up result of steps that are fine, on the grid of the other tests."""
    result = made_up(case_schema.KINDS[kind].result)
    status, iterations = np.zeros(np.shape(result.status), int), np.ones(np.shape(result.status), int)
    return dataclasses.replace(result, status=status, iterations=iterations)


STEADY = [kind for kind in TEXTS if case_schema.KINDS[kind].march is None]


@pytest.mark.parametrize("kind", STEADY)
def test_a_run_leaves_its_result_a_summary_and_pictures(kind, written, instead, tmp_path, capfd):
    result, out = fine(kind), tmp_path / "out"
    instead(kind, lambda **arguments: result)
    assert main(["run", str(written(kind)), "-o", str(out)]) == 0
    assert_same(jc.read_result(out / "result.npz"), result)
    summary = json.loads((out / "summary.json").read_text())
    last = "end_" if hasattr(result, "times") else ""
    assert summary[f"approach_{last}m"] == np.atleast_1d(result.approach)[-1]
    assert summary["experiment"] == kind and summary["grid_cells_count"] == list(GRID.shape)
    assert {path.name for path in out.iterdir()} == {"result.npz", "summary.json", *summary["pictures"]}
    assert all((out / name).stat().st_size > 5000 for name in summary["pictures"])
    assert set(summary["arrays_in_result_npz"]) == set(np.load(out / "result.npz").files) - {"kind", "case"}
    assert "approach" in capfd.readouterr().out


def test_under_each_picture_stands_what_was_computed(written):
    """In a case's own words and prefixed units, in lines that are no longer than the picture is wide."""
    polymer = Path(str(files("jaxcontact"))) / "cases" / "polymer_coating.toml"
    words = "sphere of 500 µm on burgers, 5 µm, on elastic; load 5 mN; to 3600 s; 128 x 128 cells"
    assert caption_of(read_case(polymer)) == words
    figure = Figure(figsize=(2.0, 2.0))
    write_under(figure, words)
    lines = figure.get_supxlabel().split("\n")
    assert " ".join(lines) == words and len(lines) == 3
    rubbed = "sphere of 9.5 mm on elastic; load 20 N; velocity 0 m/s to 20 µm/s; to 2 s; 16 x 16 cells"
    assert caption_of(read_case(written("sliding"))) == rubbed


@pytest.mark.parametrize(
    ("status", "code", "key"), [(1, 3, "solver"), (2, 2, "grid.width"), (8, 2, "control.tang")]
)
def test_a_step_that_fails_leaves_nothing(status, code, key, written, instead, tmp_path, capfd):
    result = dataclasses.replace(fine("steady-rolling"), status=np.array(status))
    instead("steady-rolling", lambda **arguments: result)
    assert main(["run", str(written("steady-rolling")), "-o", str(tmp_path / "out")]) == code
    assert not (tmp_path / "out").exists()
    error = capfd.readouterr().err
    assert error.count("\n") == 1 and f"case.toml: {key}" in error


def test_ctrl_c_is_heard_while_a_program_runs(written, instead, tmp_path, capfd):
    """And nothing is left; the program itself would not look up before its end."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    over = threading.Event()
    instead("steady-sliding", lambda **arguments: (signal.raise_signal(signal.SIGINT), over.wait(60.0)))
    began = time.perf_counter()
    try:
        assert main(["run", str(written("steady-sliding")), "-o", str(tmp_path / "out")]) == 130
    finally:
        over.set()
        signal.signal(signal.SIGINT, before)
    assert time.perf_counter() - began < 30.0 and not (tmp_path / "out").exists()
    assert "SIGINT: nothing is kept, since steady-sliding runs at once" in capfd.readouterr().err


def test_what_fails_in_a_thread_fails_outside():
    assert interruptible(lambda: 7) == 7
    with pytest.raises(ZeroDivisionError):
        interruptible(lambda: 1 / 0)


@pytest.mark.parametrize("kind", STEADY)
def test_the_disk_that_a_run_takes_is_what_was_said(kind, written, tmp_path):
    result = made_up(case_schema.KINDS[kind].result, grid=jc.Grid.square(64, 250e-6))
    path = jc.write_result(result, tmp_path / "a.npz")
    case = read_case(written(kind, ("n = 16", "n = 64")))
    assert footprint_of(case).disk == pytest.approx(path.stat().st_size, rel=0.1)
