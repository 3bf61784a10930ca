"""The directories of a batch of fits: nothing is written outside them, and nothing is overwritten."""

import functools
import itertools
import json
from pathlib import Path

import numpy as np
import pytest

from fitting.cli import maps
from fitting.cli.kinds import KINDS
from fitting.cli.maps import folders_of
from jaxcontact.__main__ import main

NAMES = [
    "x/a.csv", "y/a.csv", "1_a.csv", "0_a.csv", "A.CSV", "...csv", "..", ".csv", "a", "report.html.csv", "summary.json",
    "table.csv.txt", "Report.HTML.csv", "..\\b.csv", "a:b.csv", " .csv", "a..csv",
]  # fmt: skip


def test_folders_are_different_and_stay_inside():
    """For every pair and triple of awkward names, and for all at once, also where case is ignored."""
    for files in [
        *itertools.permutations(NAMES, 2),
        *itertools.combinations(NAMES, 3),
        NAMES,
        NAMES[::-1],
        ["a.csv"] * 3,
    ]:
        found = folders_of(files)
        assert len({name.casefold() for name in found}) == len(files), (files, found)
        for name in found:
            assert name == Path(name).name and name not in (".", "..", "") and "\\" not in name, (files, name)
            assert name.casefold() not in maps.BATCH_RESULTS, (files, name)


def test_a_plain_name_keeps_its_folder():
    assert folders_of(["x/a.csv", "y/b.csv"]) == ["a", "b"]
    assert folders_of(["x/a.csv", "y/a.csv"]) == ["0_a", "1_a"]


def maxwell(path, G):
    t = np.linspace(0.5, 10.0, 40)
    path.parent.mkdir(exist_ok=True)
    J = (1 / G + t / 1e6) * (1 + 1e-3 * np.random.default_rng(1).standard_normal(t.size))
    np.savetxt(path, np.column_stack([t, J]), delimiter=",", header="t [s],J [1/Pa]", comments="")
    return str(path)


@pytest.mark.slow
def test_awkward_files_are_all_fitted(tmp_path):
    names = ["x/a.csv", "y/a.csv", "x/1_a.csv", "x/...csv", "x/report.html.csv"]
    moduli = {
        maxwell(tmp_path / name, G): G for name, G in zip(names, (1e5, 2e5, 3e5, 4e5, 5e5), strict=True)
    }
    out = tmp_path / "results" / "out"
    out.parent.mkdir()
    assert main(["fit", "batch", *moduli, "-o", str(out), "--model", "Maxwell"]) == 0
    assert [path.name for path in out.parent.iterdir()] == ["out"]
    assert {path.name for path in out.iterdir() if path.is_file()} == set(maps.BATCH_RESULTS)
    for row in json.loads((out / "summary.json").read_text())["fits"]:
        own = json.loads((out / row["folder"] / "summary.json").read_text())
        assert own["file"] == row["file"]
        assert own["parameters"]["G_Pa"] == pytest.approx(moduli[row["file"]], rel=0.01)


def unfitted():
    """The kind of creep curves with a fit that nothing may reach."""
    fit = functools.wraps(KINDS["creep"].fit)(lambda *_, **__: pytest.fail("fitted"))
    return KINDS["creep"]._replace(fit=fit)


def test_no_command_replaces_what_it_reads(tmp_path, monkeypatch, capsys):
    """The line comes before any fit, and the file stays as it was."""
    monkeypatch.setitem(KINDS, "creep", unfitted())
    monkeypatch.chdir(tmp_path)
    for name, command in (("curve.csv", "creep"), ("table.csv", "batch"), ("a/curve.csv", "batch")):
        path = Path(maxwell(tmp_path / name, 1e5))
        before = path.read_bytes()
        files = [name, maxwell(tmp_path / "a.csv", 1e5)] if command == "batch" else [name]
        assert main(["fit", command, *files, "-o", ".", "--force", "--model", "Maxwell"]) == 2
        assert "would replace it" in capsys.readouterr().err and path.read_bytes() == before


def test_a_folder_in_the_way_is_named_before_any_fit(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(KINDS, "creep", unfitted())
    file, out = maxwell(tmp_path / "a.csv", 1e5), tmp_path / "out"
    (out / "report.html").mkdir(parents=True)
    assert main(["fit", "batch", file, "-o", str(out), "--force"]) == 2
    assert "report.html: expected room" in capsys.readouterr().err
    (out / "report.html").rmdir()
    (out / "a").write_text("")
    assert main(["fit", "batch", file, "-o", str(out), "--force"]) == 2
    assert "a file above it" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["relaxation", pytest.param("oscillation", marks=pytest.mark.slow)])
def test_a_batch_of_moduli_is_the_single_fits(tmp_path, capsys, kind):
    x, files = np.geomspace(0.1, 10.0, 21), []
    for k, eta in enumerate((1e5, 3e5)):
        path = tmp_path / f"gel{k}.csv"
        G = (
            1e5 * np.exp(-x * 1e5 / eta)
            if kind == "relaxation"
            else 1e5 * 1j * x * eta / (1e5 + 1j * x * eta)
        )
        head = "t [s],G(t) [Pa]" if kind == "relaxation" else "omega [rad/s],G' [Pa],G'' [Pa]"
        columns = [x, G] if kind == "relaxation" else [x, G.real, G.imag]
        np.savetxt(path, np.stack(columns, -1), delimiter=",", header=head, comments="", fmt="%.10g")
        files.append(str(path))
    (tmp_path / "broken.csv").write_text("t [s]\n1\n2\n3\n")
    more = ["--start", "0", "--weights", "relative"] if kind == "relaxation" else []
    words = ["--of", kind, "--model", "Maxwell", *more, "-o", str(tmp_path / "out")]
    assert main(["fit", "batch", *files, str(tmp_path / "broken.csv"), *words]) == 3  # the broken one
    printed = capsys.readouterr().out
    assert printed.count("accepted") == 2 and "broken.csv" in printed
    rows = json.loads((tmp_path / "out" / "summary.json").read_text())["fits"]
    assert [row["parameters"]["eta_Pa_s"] for row in rows[:2]] == pytest.approx([1e5, 3e5], rel=1e-6)
    page = (tmp_path / "out" / "report.html").read_text()
    assert f"Maxwell fits of 3 {kind} curves" in page
    assert page.count("<polyline") == (2 if kind == "relaxation" else 4)  # G' and G'' apart
    assert (tmp_path / "out" / "gel0" / "fit.png").stat().st_size > 1e4
