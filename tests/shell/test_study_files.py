"""Studies from the shell: the cases of a file, each with the figures of its own run, whatever dies or fails on the way."""

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from test_experiments import SOLIDS, TEXTS, assert_same_arguments, instead, written  # noqa: F401
from test_storage import made_up

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact.shell.case_file import read_tables
from jaxcontact.shell.case_schema import KINDS
from jaxcontact.shell.sweep import figures_by, labels_of, read_study
from tests.support.tables import read_back

CASE = SOLIDS + "[control]\nload = 1.0\n[times]\nvalues = [0.0]\n"


@pytest.fixture
def study(tmp_path):
    """A study file of an elastic contact, with a table [sweep]."""

    def write(sweep, case=CASE):
        path = tmp_path / "study.toml"
        path.write_text(f"[sweep]\n{sweep}\n{case}")
        return path

    return write


def table(folder):
    """The rows of a study as pandas reads them, without empty cells."""
    return [row.dropna().to_dict() for _, row in read_back(folder / "study.csv").iterrows()]


def test_a_grid_has_every_combination_and_the_last_key_varies_fastest(study):
    keys = '"control.load" = {from = 1.0, to = 100.0, count = 3, log = true}\nindenter.radius = [1e-3, 2e-3]'
    expected = [(load, radius) for load in (1.0, 10.0, 100.0) for radius in (1e-3, 2e-3)]
    cases = read_study(study(keys)).cases
    assert [tuple(case.values()) for case in cases] == expected
    assert all(list(case) == ["control.load", "indenter.radius"] for case in cases)
    linear = read_study(study('"control.load" = {from = 10, to = 60, count = 6}')).cases
    assert [case["control.load"] for case in linear] == [10.0, 20.0, 30.0, 40.0, 50.0, 60.0]


def test_a_latin_hypercube_has_one_sample_in_each_stratum_of_each_key(study):
    keys = (
        '"control.load" = {from = 1.0, to = 1e4, log = true}\n"grid.n" = [16, 24]\nmethod = "latin-hypercube"'
    )
    cases = read_study(study(f"{keys}\nsamples = 40\nseed = 3")).cases
    decades = np.log10([case["control.load"] for case in cases]) / 4.0
    assert sorted(np.floor(40 * decades)) == list(range(40))
    assert [case["grid.n"] for case in cases].count(16) == 20
    assert read_study(study(f"{keys}\nsamples = 40\nseed = 3")).cases == cases
    assert read_study(study(f"{keys}\nsamples = 40\nseed = 4")).cases != cases


def test_a_value_may_be_a_vector_a_history_or_that_of_one_layer_among_several(study):
    layers = '[[layer]]\nmaterial = "elastic"\nE = 1e9\nthickness = 1e-6\n' * 2
    vectors = '"control.tangential_load" = [[1.0, 0.0], [[0.0, 0.0], [2.0, 0.0]]]\n"layer[1].E" = [2e9]'
    shear = CASE.replace("[0.0]", "[0.0, 1.0]").replace(
        "[control]", "[control]\ntangential_load = [0.0, 0.0]"
    )
    text = f'{shear}[experiment]\nkind = "shear"\nfriction = 0.3\n{layers}'
    cases = read_study(study(vectors, text)).cases
    assert [case["control.tangential_load"] for case in cases] == [[1.0, 0.0], [[0.0, 0.0], [2.0, 0.0]]]


def test_values_with_units_are_the_numbers_that_they_stand_for(study):
    """In lists, in vectors and at the ends of ranges, of layers and of the material of the indenter."""
    shear = CASE.replace("[0.0]", "[0.0, 1.0]").replace(
        "[control]", "[control]\ntangential_load = [0.0, 0.0]"
    )
    layer = '[[layer]]\nmaterial = "elastic"\nE = 1e9\nthickness = 1e-6\n'
    text = f'{shear}[experiment]\nkind = "shear"\nfriction = 0.3\n{layer}'
    for given, plain in (
        ('"control.load" = ["500 mN", 1.0, "2 kN"]', '"control.load" = [0.5, 1.0, 2e3]'),
        (
            '"layer[0].thickness" = {from = "100 nm", to = "10 um", count = 3, log = true}',
            '"layer[0].thickness" = {from = 1e-7, to = 1e-5, count = 3, log = true}',
        ),
        ('"control.tangential_load" = [["1 mN", "-2 N"]]', '"control.tangential_load" = [[1e-3, -2.0]]'),
        (
            '"substrate.E" = ["3 GPa"]\n"layer[0].E" = ["2 MPa"]',
            '"substrate.E" = [3e9]\n"layer[0].E" = [2e6]',
        ),
        ('"experiment.friction" = [0.1]', '"experiment.friction" = [0.1]'),
    ):
        found, expected = read_study(study(given, text)), read_study(study(plain, text))
        for case, other in zip(found.cases, expected.cases, strict=True):
            assert list(case) == list(other)
            np.testing.assert_allclose([*case.values()], [*other.values()], rtol=1e-12)
    assert read_study(study('"indenter.shape" = ["sphere"]', text)).cases == ({"indenter.shape": "sphere"},)


@pytest.mark.long
def test_a_study_of_values_with_units_is_drawn_and_what_has_no_picture_is_said(study, tmp_path, capfd):
    """The table has numbers; a study of words says why it has no picture, and none of an earlier study stays."""
    out = tmp_path / "out"
    command = ["sweep", str(tmp_path / "study.toml"), "-o", str(out), "--processes", "1", "--force"]
    study('"control.load" = ["1 N", "2 N"]\n"indenter.radius" = ["9.5 mm"]')
    assert main(command) == 0
    assert [row["control.load"] for row in table(out)] == [1.0, 2.0]
    assert (out / "study.png").exists() and "no picture" not in capfd.readouterr().out
    study(
        '"control.load" = ["1 N"]\n"indenter.radius" = ["9.5 mm"]\n"indenter.shape" = ["sphere", "flat-punch"]'
    )
    main(command)
    assert "no picture: cases: expected numbers that vary, got indenter.shape" in capfd.readouterr().out
    assert not (out / "study.png").exists()


def test_a_case_is_another_where_a_file_that_it_names_has_changed(study, tmp_path):
    heights = CASE.replace('"sphere"\nradius = 9.5e-3', '"height-field"\nheights = "rough.npy"')
    np.save(tmp_path / "rough.npy", np.zeros((16, 16)))
    before = read_study(study('"control.load" = [1.0, 2.0]', heights)).fingerprints
    np.save(tmp_path / "rough.npy", np.ones((16, 16)))
    after = read_study(study('"control.load" = [1.0, 2.0]', heights)).fingerprints
    assert len({*before, *after}) == 4


@pytest.mark.slow
@pytest.mark.parametrize("kind", TEXTS)
def test_the_figures_of_a_case_of_each_kind_are_those_of_its_result(kind, written, instead):  # noqa: F811
    """Solids, motion and control come from the file, the load from the study; a step that is not fine is a failure."""
    path, asked = written(kind), []
    made = made_up(KINDS[kind].result)
    fine = dataclasses.replace(made, status=np.zeros(np.shape(made.status), int))
    instead(kind, lambda **arguments: asked.append(arguments) or fine)
    figures = figures_by(read_tables(path), str(path))
    found = figures({"control.load": 25.0, "fingerprint": ""})
    assert_same_arguments({"control": jc.Load(25.0)}, {"control": asked[0]["control"]})
    for name, unit in (("approach", "m"), ("load", "N"), ("film_strain", "m_per_m")):
        values = np.ravel(getattr(made, name))
        kept = {"": 0} if "steady" in kind else {"_start": 0, "_end": -1, "_largest": -1}
        assert all(found[f"{name}{when}_{unit}"] == values[index] for when, index in kept.items())
    instead(kind, lambda **arguments: dataclasses.replace(made, status=fine.status + 2))
    with pytest.raises(RuntimeError, match="contact at the edge of the grid"):
        figures({"control.load": 25.0})


@pytest.mark.slow
def test_a_study_is_one_table_and_what_fails_is_in_it_and_is_status_3(study, tmp_path, capfd):
    """100 times the load reaches the edge of the grid. Started again, it computes what failed and nothing else."""
    path, out = study('"control.load" = [1.0, 2000.0, 8.0]'), tmp_path / "out"
    made = []
    for _ in range(2):
        assert main(["sweep", str(path), "-o", str(out), "--processes", "1"]) == 3
        printed, complaint = capfd.readouterr()
        assert "2 of 3 cases" in printed and complaint.count("\n") == 2
        assert "case 1, control.load = 2000.0: RuntimeError: contact at the edge" in complaint
        assert "study.toml: 1 of 3 cases failed" in complaint
        made.append({file.name: file.stat().st_mtime_ns for file in out.glob("*.npz")})
    assert len(made[0]) == 2 and made[0] == made[1]
    first, failed, last = table(out)
    assert float(last["load_end_N"]) == pytest.approx(8.0, rel=1e-12)
    ratio = float(last["approach_end_m"]) / float(first["approach_end_m"])
    assert ratio == pytest.approx(8.0 ** (2.0 / 3.0), rel=0.02)  # Hertz, on few cells
    assert "approach_end_m" not in failed and "contact at the edge" in failed["failure"]
    assert json.loads((out / "summary.json").read_text())["failed_count"] == 1


@pytest.mark.slow
def test_a_directory_holds_one_study(study, tmp_path, capfd):
    out = tmp_path / "out"
    assert main(["sweep", str(study('"control.load" = [1.0]')), "-o", str(out), "--processes", "1"]) == 0
    other = study('"control.load" = [1.0]', CASE.replace("9.5e-3", "9e-3"))
    assert main(["sweep", str(other), "-o", str(out)]) == 2
    assert "study.toml: out: " in capfd.readouterr().err
    longer = study('"control.load" = [1.0, 2.0]')
    assert main(["sweep", str(longer), "-o", str(out), "--processes", "1"]) == 0
    assert [float(row["control.load"]) for row in table(out)] == [1.0, 2.0]


@pytest.mark.long
def test_a_study_killed_in_the_middle_goes_on_to_the_table_of_an_undisturbed_one(study, tmp_path):
    path = study('"control.load" = {from = 1.0, to = 12.0, count = 12}')
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    command = [sys.executable, "-m", "jaxcontact", "sweep", str(path), "--processes", "1", "-o"]
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen([*command, str(killed)], **silent, start_new_session=True)
    while len(list(killed.glob("*.npz"))) < 3:
        time.sleep(0.02)
        assert process.poll() is None
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    kept = {file: file.stat().st_mtime_ns for file in killed.glob("*.npz")}
    for folder in (killed, whole):
        subprocess.run([*command, str(folder)], **silent, check=True)
    assert (killed / "study.csv").read_bytes() == (whole / "study.csv").read_bytes()
    assert {file: file.stat().st_mtime_ns for file in kept} == kept and len(kept) < 12


@pytest.mark.long
def test_a_study_on_a_cluster_of_which_a_worker_dies_is_the_same(study, tmp_path):
    distributed = pytest.importorskip("distributed", reason="the extra cluster")
    path = study('"control.load" = {from = 1.0, to = 8.0, count = 8}')
    assert main(["sweep", str(path), "-o", str(tmp_path / "here"), "--processes", "1"]) == 0
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        victim = next(iter(cluster.workers.values())).pid
        command = [sys.executable, "-m", "jaxcontact", "sweep", str(path), "-o", str(tmp_path / "there")]
        process = subprocess.Popen([*command, "--scheduler", cluster.scheduler_address])
        while not list((tmp_path / "there").glob("*.npz")):
            time.sleep(0.02)
            assert process.poll() is None
        os.kill(victim, signal.SIGKILL)
        assert process.wait(timeout=120) == 0
    for here, there in zip(table(tmp_path / "here"), table(tmp_path / "there"), strict=True):
        assert here.pop("notes", "") == there.pop("notes", "")
        assert there == pytest.approx(here, rel=1e-12)


@pytest.mark.slow
def test_the_study_that_comes_with_the_package_is_read():
    path = Path(jc.__file__).parent / "cases" / "studies" / "film_map.toml"
    study = read_study(path)
    assert len(study.cases) == 36 and study.cases[-1] == {"control.load": 60.0, "layer.thickness": 1.6e-6}


def test_axes_of_the_figure_of_a_study_have_units(study):
    given = {
        "indenter.radius": "[m]",
        "layer.2.G": "[Pa]",
        "layer[1].thickness": "[m]",
        "substrate.nu": "",
        "indenter.material.E": "[Pa]",
        "grid.n": "",
    }
    tables = read_study(study('"indenter.radius" = [0.2, 0.3]')).tables
    found = labels_of([dict.fromkeys(given, 1.0)], tables)
    assert {name: label.removeprefix(name).strip() for name, label in found.items()} == given
