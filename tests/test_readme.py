"""What the README says can be run runs as written. The two set-up commands are run by .ci/run."""

import re
import shlex
import warnings
from pathlib import Path

import pytest

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact.cases import reproduce

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
PYTHON = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
COMMANDS = [
    shlex.split(line, comments=True)[1:]
    for block in re.findall(r"```sh\n(.*?)```", README, re.DOTALL)
    for line in block.splitlines()
    if line.startswith("jaxcontact ")
]
HERE = {  # the other commands, and what runs them
    "python3 -m venv": ".ci/run, both",
    ".ci/run": "itself",
    "python -m sphinx": "test_docs.py",
    "python -m http.server": "the standard library",
    "jupyter nbconvert": "test_notebooks.py",
    "jaxcontact ": "below",
}


@pytest.mark.slow
def test_python_blocks_of_the_readme_run(capsys, tmp_path, monkeypatch):
    pytest.importorskip("h5netcdf", reason="NetCDF is the extra jaxcontact[io]")
    monkeypatch.chdir(tmp_path)
    assert len(PYTHON) == 7
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        exec("\n".join(PYTHON), {"__name__": "__main__"})
    assert "Burgers(" in capsys.readouterr().out
    assert len(list(tmp_path.glob("creep/*.vtr"))) == 31


@pytest.mark.slow
def test_commands_of_the_readme_run(capsys, tmp_path, monkeypatch):
    """With the case files as from the root of a checkout but few cells and cases; the paper's figures stand aside."""
    cases = tmp_path / "jaxcontact" / "cases"
    (cases / "studies").mkdir(parents=True)
    packaged = Path(jc.__file__).parent / "cases"
    for path in packaged.rglob("*.toml"):
        few = path.read_text().replace("n = 256", "n = 32").replace("count = 6", "count = 2")
        (cases / path.relative_to(packaged)).write_text(few)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("jaxcontact.commands.look.CASES", cases)
    asked = []
    monkeypatch.setattr(
        "jaxcontact.cases.reproduce.main", lambda names, directory, force: asked.extend(names) or 0
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


def test_every_command_of_the_readme_is_run_somewhere():
    for block in re.findall(r"```sh\n(.*?)```", README, re.DOTALL):
        for line in block.splitlines():
            assert line.startswith(tuple(HERE)), line


def test_pictures_and_links_of_the_readme_are_there():
    targets = re.findall(r"\]\(([^)]+)\)", README)
    assert len(targets) >= 4
    for target in targets:
        assert target.startswith("http") or (ROOT / target).is_file(), target
