"""The commands and blocks of the README and of the pages that continue it run as written.

The two set-up commands are run by .ci/run, the blocks of *Start here* and *How do I?* by ``test_docs.py``.
"""

import re
import shlex
import tomllib
import warnings
from pathlib import Path

import pytest
from scripts import assert_printed_as_shown

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact.paper import reproduce

ROOT = Path(__file__).parents[2]
README, SHELL, PYTHON, DEVELOPERS = (
    (ROOT / name).read_text()
    for name in ("README.md", "docs/shell.md", "docs/python.md", "docs/developers.md")
)
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)
OUTPUT = re.compile(r"```text\n(.*?)```", re.DOTALL)
LINES = [
    line
    for page in (README, SHELL, DEVELOPERS)
    for block in re.findall(r"```sh\n(.*?)```", page, re.DOTALL)
    for line in block.splitlines()
]
COMMANDS = [shlex.split(line, comments=True)[1:] for line in LINES if line.startswith("jaxcontact ")]
HERE = {  # the other commands, and what runs them
    "python3 -m venv": ".ci/run, both",
    ".ci/run": "itself",
    "python -m sphinx": "test_docs.py",
    "python -m http.server": "the standard library",
    "jupyter nbconvert": "test_notebooks.py",
    "jaxcontact ": "below",
}


@pytest.mark.slow
def test_the_readmes_ten_lines_print_what_it_shows(capsys):
    """The result and its gradient, shown as they were printed on another processor."""
    exec("\n".join(BLOCK.findall(README)), {"__name__": "__main__"})
    shown = OUTPUT.findall(README)
    assert len(shown) == len(BLOCK.findall(README)) == 2
    assert_printed_as_shown(capsys.readouterr().out, "\n".join(shown))


@pytest.mark.slow
def test_the_page_on_python_runs(capsys, tmp_path, monkeypatch):
    pytest.importorskip("h5netcdf", reason="NetCDF is the extra jaxcontact[io]")
    monkeypatch.chdir(tmp_path)
    session, compared = {"__name__": "__main__"}, 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for block, shown in re.findall(BLOCK.pattern + r"\n*(?:```text\n(.*?)```)?", PYTHON, re.DOTALL):
            exec(block, session)
            out = capsys.readouterr().out
            assert bool(out) == ("print(" in block)
            assert bool(shown) == bool(out)  # all that is printed is shown
            if shown:
                assert_printed_as_shown(out, shown)
                compared += 1
    assert compared == len(OUTPUT.findall(PYTHON)) == 4
    assert len(list(tmp_path.glob("creep/*.vtr"))) == 31


@pytest.mark.slow
def test_commands_of_the_page_on_the_shell_run(capsys, tmp_path, monkeypatch):
    """With the case files as from the root of a checkout but few cells and cases; the paper's figures stand aside."""
    cases = tmp_path / "jaxcontact" / "cases"
    (cases / "studies").mkdir(parents=True)
    packaged = Path(jc.__file__).parent / "cases"
    for path in packaged.rglob("*.toml"):
        few = path.read_text().replace("n = 256", "n = 32").replace("count = 6", "count = 2")
        (cases / path.relative_to(packaged)).write_text(few)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("jaxcontact.shell.look.CASES", cases)
    asked = []
    monkeypatch.setattr(
        "jaxcontact.paper.reproduce.main", lambda names, directory, force: asked.extend(names) or 0
    )
    assert len(COMMANDS) == 12
    for command in COMMANDS:
        if "--help" in command:
            with pytest.raises(SystemExit, match="0"):
                main(command)
        else:
            assert main(command) == 0, command
    assert asked and set(asked) <= {case.name for case in reproduce.CASES}
    assert (tmp_path / "maxwell" / "result.png").stat().st_size > 5000


def test_every_command_is_run_somewhere():
    assert len(LINES) > 15
    for line in LINES:
        assert line.startswith(tuple(HERE)), line


def test_the_readme_is_read_in_two_minutes_and_its_picture_is_drawn_from_its_lines():
    assert 100 <= len(README.splitlines()) <= 140
    drawn = (ROOT / "docs/gallery/draw.py").read_text(encoding="utf-8")
    assert "README.md" in drawn and README.index("docs/gallery/front.png") < README.index("```python")
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    table = README.partition("## Extras")[2].partition("## ")[0]
    assert set(extras) - {"test"} <= set(re.findall(r"`(\w+)`", table))


def test_pictures_and_links_of_the_readme_are_there():
    targets = re.findall(r"\]\(([^)]+)\)", README)
    assert len(targets) >= 20
    for target in targets:
        assert target.startswith("http") or (ROOT / target).is_file(), target
