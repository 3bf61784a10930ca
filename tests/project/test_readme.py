"""The commands and blocks of the README and of the pages that continue it run as written.

The two set-up commands are run by .ci/run, the blocks of *Start here* and *How do I?* by ``test_docs.py``.
"""

import re
import shlex
import warnings
from pathlib import Path

import pytest

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact.paper import reproduce

ROOT = Path(__file__).parents[2]
README, SHELL, PYTHON, DEVELOPERS = (
    (ROOT / name).read_text()
    for name in ("README.md", "docs/shell.md", "docs/python.md", "docs/developers.md")
)
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)
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
    """The shown text was printed on another processor: its numbers agree to the digits shown, or in the last one."""
    exec("\n".join(BLOCK.findall(README)), {"__name__": "__main__"})
    printed = capsys.readouterr().out
    (shown,) = re.findall(r"```text\n(.*?)```", README, re.DOTALL)
    assert printed.startswith(shown)
    assert "Burgers(" in printed


@pytest.mark.slow
def test_the_page_on_python_runs(capsys, tmp_path, monkeypatch):
    pytest.importorskip("h5netcdf", reason="NetCDF is the extra jaxcontact[io]")
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        exec("\n".join(BLOCK.findall(PYTHON)), {"__name__": "__main__"})
    out = capsys.readouterr().out
    assert "Burgers(" in out and "converged: " in out
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


def test_pictures_and_links_of_the_readme_are_there():
    targets = re.findall(r"\]\(([^)]+)\)", README)
    assert len(targets) >= 20
    for target in targets:
        assert target.startswith("http") or (ROOT / target).is_file(), target
