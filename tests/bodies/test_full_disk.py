"""Files on a disk that is full: the error names the file, and nothing is left or overwritten.

The limit on the size of files that a process may write (setrlimit) makes the system refuse a write in the middle of
each file, as a full disk does, with an error that has no name of a file in it.
"""

import csv
import errno
import importlib
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from full_disk import limited
from test_storage import made_up

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact._support.files import write_npz, write_whole
from jaxcontact.paper import comparison, reproduce
from jaxcontact.shell import sweep
from jaxcontact.simulate.sweep import sweep_of


def written_table(path):
    sweep._write_table(path, ["x"], [{"x": number} for number in range(9999)])


def figure():
    return made_up(jc.ContactHistory).plot()


WRITERS = {
    "result.npz": lambda path: jc.write_result(made_up(jc.ContactHistory), path),
    "result.nc": lambda path: jc.write_result(made_up(jc.ContactHistory), path),
    "case.npz": lambda path: write_whole(path, lambda part: write_npz(part, {"a": np.zeros(9999)})),
    "picture.png": lambda path: comparison.save(figure(), path),
    "study.csv": lambda path: write_whole(path, written_table),
    "text.json": lambda path: write_whole(path, lambda part: part.write_text(" " * 99999)),
    "report.html": lambda path: reproduce.write(path.parent),
    "function.json": lambda path: sweep_of(dict, [], path.parent, {"f": "0" * 99999}),
}


@pytest.mark.parametrize("name", WRITERS)
def test_the_error_names_the_file_and_no_part_of_it_is_left(name, tmp_path):
    if name.endswith(".nc"):
        pytest.importorskip("h5netcdf", reason="NetCDF is the extra jaxcontact[io]")
    path = tmp_path / name
    figure()  # a first picture writes the cache of fonts
    with limited(1000), pytest.raises(OSError) as caught:
        WRITERS[name](path)
    assert str(path) in str(caught.value) and ".part" not in str(caught.value)
    assert caught.value.errno == errno.EFBIG
    assert not list(tmp_path.iterdir())


def test_no_part_of_the_bytecode_of_a_module_is_kept(tmp_path, monkeypatch):
    """Python does not notice that its cache of a module is cut short; whoever imports the module next would fail."""
    (tmp_path / "long_module.py").write_text(f"text = {'x' * 9999!r}")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("sys.dont_write_bytecode", False)
    monkeypatch.setattr("sys.pycache_prefix", str(tmp_path / "bytecode"))
    with limited(1000):
        importlib.import_module("long_module")
    assert not list(tmp_path.rglob("*.pyc")) and not sys.dont_write_bytecode


def test_files_for_paraview_name_the_one_that_fails(tmp_path):
    with limited(300), pytest.raises(OSError, match=r"film_0\.vtr'$"):
        jc.write_result(made_up(jc.ContactHistory), tmp_path / "film.pvd")
    assert [path.name for path in tmp_path.rglob("*")] == ["film"]


@pytest.mark.parametrize("name", ["no such folder/y.toml", "y.toml"])
def test_new_names_the_file_that_was_asked_for(name, tmp_path, capfd):
    with limited(1000):
        assert main(["new", str(tmp_path / name)]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert str(tmp_path / name) in line and ".part" not in line
    assert not list(tmp_path.iterdir())


STUDY = """
[sweep]
"control.load" = {loads}
[substrate]
material = "elastic"
E = 210e9
nu = 0.3
[indenter]
shape = "sphere"
radius = 9.5e-3
[control]
load = 1.0
[times]
values = [0.0]
[grid]
n = 16
"""


@pytest.fixture
def swept(tmp_path, monkeypatch, capfd):
    """The command, with cases that cost nothing; (status, what it said on stderr, loads in the table)."""
    one = lambda f, cases, out, parts, **_: sweep_of(
        lambda case: {"v": case["control.load"]}, cases, out, parts, executor=ThreadPoolExecutor(1)
    )  # fmt: skip
    monkeypatch.setattr(sweep, "sweep_of", one)
    monkeypatch.setattr(sweep.advice, "check", lambda *_: None)

    def run(loads, *arguments, file="study.toml", text=STUDY):
        path = tmp_path / file
        path.parent.mkdir(exist_ok=True)
        path.write_text(text.format(loads=loads))
        status = main(["sweep", str(path), "-o", str(tmp_path / "out"), *arguments])
        with (tmp_path / "out" / "study.csv").open() as table:
            return (
                status,
                capfd.readouterr().err,
                [float(row["control.load"]) for row in csv.DictReader(table)],
            )

    return run


def test_fewer_values_leave_the_table_of_a_study_as_it_is(swept, tmp_path):
    assert swept([1.0, 2.0, 3.0])[::2] == (0, [1.0, 2.0, 3.0])
    status, said, loads = swept([1.0, 4.0])
    assert (status, loads) == (2, [1.0, 2.0, 3.0])
    assert "study.csv: found 2 cases that" in said and "--force leaves them out" in said
    assert swept([3.0, 2.0, 1.0, 4.0])[::2] == (0, [3.0, 2.0, 1.0, 4.0])
    assert swept([1.0], "--force")[::2] == (0, [1.0])
    assert len(list((tmp_path / "out").glob("*.npz"))) == 4


def test_a_study_may_move_and_another_is_told_by_what_differs(swept):
    assert swept([1.0])[0] == 0
    assert swept([1.0, 2.0], file="elsewhere/renamed.toml")[::2] == (0, [1.0, 2.0])
    status, said, _ = swept([1.0, 2.0], text=STUDY.replace("210e9", "211e9"))
    assert status == 2 and "[substrate] differ; take another folder" in said


@pytest.mark.slow
def test_nothing_is_converted_or_drawn_over_what_is_there(tmp_path, capfd):
    """Each kind of file: refused by its name, and by --force written. A film for ParaView is a folder as well."""
    result = str(jc.write_result(made_up(jc.ContactHistory), tmp_path / "result.npz"))
    commands = [["plot", result, "-o", name] for name in ("a.png",)]
    commands += [["convert", result, "-o", name] for name in ("a.nc", "a.npz", "a.pvd")]
    for command in commands:
        command[-1] = str(tmp_path / command[-1])
        assert main(command) == 0
    (tmp_path / "a.pvd").unlink()
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    capfd.readouterr()
    for command in commands:
        assert main(command) == 2
        assert "already exists" in capfd.readouterr().err
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before
    assert all(main([*command, "--force"]) == 0 for command in commands)


def test_a_report_is_not_begun_among_the_summaries_of_other_runs(tmp_path, capsys, monkeypatch):
    from jaxcontact.paper import reproduce

    monkeypatch.setattr(reproduce, "run", lambda *_: pytest.fail("nothing may be computed"))
    (tmp_path / "other").mkdir()
    for content in ('{"case": "mine.toml", "status": 0}', "[]", "", "{"):
        (tmp_path / "other" / "summary.json").write_text(content)
        assert main(["reproduce", "figure_4", "-o", str(tmp_path)]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert (
            f"{tmp_path / 'other' / 'summary.json'} is not the summary of a reproduction; choose another directory"
            in line
        )
    assert [path.name for path in tmp_path.rglob("*")] == ["other", "summary.json"]
    (tmp_path / "alone").mkdir()
    (tmp_path / "alone" / "report.html").write_text("mine")
    assert main(["reproduce", "figure_4", "-o", str(tmp_path / "alone")]) == 2
    assert "report.html already exists" in capsys.readouterr().err
