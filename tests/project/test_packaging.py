"""What is shipped: wheel and sdist build, and the wheel works where there is no source."""

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import jaxcontact as jc

ROOT = Path(__file__).parents[2]
CASE = """
[substrate]
material = "elastic"
E = 210e9
[indenter]
shape = "sphere"
radius = 9.5e-3
[control]
load = 10.0
[times]
values = [0.0]
[grid]
n = 32
"""
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}


def call(*command, cwd):
    done = subprocess.run(command, cwd=cwd, env=ENVIRONMENT, capture_output=True, text=True)
    assert done.returncode == 0, f"{command}: {done.stdout[-2000:]} {done.stderr[-2000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """sdist, wheel and the names of the files in the repository; built from a copy, since building leaves files."""
    pytest.importorskip("build")
    folder = tmp_path_factory.mktemp("built")
    files = call("git", "ls-files", cwd=ROOT).split() if (ROOT / ".git").exists() else []
    if not files:
        shutil.copytree(
            ROOT, folder / "copy", ignore=shutil.ignore_patterns(".*", "__pycache__", "*.egg-info")
        )
    for name in files:
        (folder / "copy" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / "copy" / name)
    call(sys.executable, "-m", "build", "-o", folder / "dist", folder / "copy", cwd=folder)
    (sdist,), (wheel,) = (folder / "dist").glob("*.tar.gz"), (folder / "dist").glob("*.whl")
    return sdist, wheel, files


@pytest.mark.slow
def test_the_sdist_has_every_file_of_the_repository(built):
    """So that its tests, documentation and notebooks run; the wheel is built from it."""
    sdist, _, files = built
    if not files:
        pytest.skip("the list of files is that of git")
    with tarfile.open(sdist) as file:
        found = {name.partition("/")[2] for name in file.getnames()}
    assert not set(files) - found and "jaxcontact/cases/tribofilm_creep.toml" in found


@pytest.mark.slow
def test_the_wheel_runs_a_case_where_there_is_no_source(built, tmp_path):
    _, wheel, _ = built
    with zipfile.ZipFile(wheel) as file:
        names = set(file.namelist())
        (metadata,) = (name for name in names if name.endswith(".dist-info/METADATA"))
        lines = file.read(metadata).decode().splitlines()
        assert "License-Expression: MIT" in lines
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        required = {
            Requirement(line.removeprefix("Requires-Dist: ")) for line in lines if "Requires-Dist" in line
        }
        assert required.issuperset(map(Requirement, project["dependencies"]))
    ours = (
        "py.typed",
        "style.mplstyle",
        "cases/tribofilm_creep.toml",
        "shell/playground/page/explorer.html",
    )
    wanted = ["fitting/py.typed", *(f"jaxcontact/{name}" for name in ours)]
    assert names.issuperset(wanted) and not any(name.startswith("tests/") for name in names)

    # with what the package depends on from here, which takes a minute to install; a package that is installed here in
    # development is not found on that path
    venv.create(tmp_path / "clean", with_pip=True)
    binaries = tmp_path / "clean" / ("Scripts" if os.name == "nt" else "bin")
    ask = "import sysconfig; print(sysconfig.get_path('purelib'))"
    (packages,) = call(binaries / "python", "-c", ask, cwd=tmp_path).split()
    (Path(packages) / "dependencies.pth").write_text(sysconfig.get_path("purelib"))
    install = "-m", "pip", "install", "-q", "--no-compile", "--no-deps", "--ignore-installed"
    call(binaries / "python", *install, wheel, cwd=tmp_path)
    (tmp_path / "case.toml").write_text(CASE)
    command = binaries / "jaxcontact"
    assert "tribofilm_creep.toml" in call(command, "cases", cwd=tmp_path)
    assert "can run" in call(command, "check", "case.toml", cwd=tmp_path)
    assert "1 of 1 steps" in call(command, "run", "case.toml", "-o", "out", cwd=tmp_path)
    assert (tmp_path / "out" / "history.png").stat().st_size > 5000
    where = call(
        binaries / "python", "-c", "import fitting, jaxcontact; print(jaxcontact.__file__)", cwd=tmp_path
    )
    assert str(tmp_path) in where


def test_the_paper_has_the_sections_and_the_length_that_its_journal_asks_for_and_all_its_references():
    """Of https://joss.readthedocs.io/en/latest/paper.html; how the work was done is for its authors to declare."""
    text = (ROOT / "docs/paper/paper.md").read_text(encoding="utf-8").split("---", 2)[2]
    sections = ["Summary", "Statement of need", "State of the field", "Software design"]
    sections += ["Research impact statement", "References"]
    assert re.findall(r"^# (.*)$", text, re.MULTILINE) == sections
    assert 750 <= len(text.split()) <= 1750
    entries = re.findall(r"@\w+\{(\w+)", (ROOT / "docs/paper/paper.bib").read_text(encoding="utf-8"))
    assert set(re.findall(r"@(\w+)", text)) == set(entries)


def test_what_services_read_of_the_project_says_the_same_as_the_package():
    """Version, licence, authors, keywords and Python of pyproject.toml, CITATION.cff and codemeta.json."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    meta = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    (author,) = project["authors"]
    assert project["version"] == meta["version"] == jc.__version__
    assert f"version: {jc.__version__}\n" in citation and f"license: {project['license']}\n" in citation
    assert meta["license"].endswith(f"/{project['license']}") and meta["keywords"] == project["keywords"]
    assert meta["author"] == [{"@type": "Organization", **author}] and f'name: "{author["name"]}"' in citation
    assert meta["description"] == project["description"]
    assert meta["programmingLanguage"]["version"] == project["requires-python"]


def test_the_files_of_the_hosting_service_are_there_and_name_no_address():
    """Forms, workflow and set-ups are YAML; what is run is a command of the repository; no address is invented."""
    yaml = pytest.importorskip("yaml", reason="comes with the extra jaxcontact[docs]")
    read = lambda name: yaml.safe_load((ROOT / name).read_text(encoding="utf-8"))
    forms = [read(f".github/ISSUE_TEMPLATE/{path.name}") for path in (ROOT / ".github").glob("*/[0-9]*.yml")]
    assert len(forms) == 3 and all({"name", "description", "body"} <= set(form) for form in forms)
    steps = read(".github/workflows/check.yml")["jobs"]["check"]["steps"]
    assert [step["run"] for step in steps if "run" in step] == [".ci/run"] and (ROOT / ".ci/run").is_file()
    check = (ROOT / ".ci/run").read_text(encoding="utf-8")
    for hook in read(".pre-commit-config.yaml")["repos"][0]["hooks"]:
        assert hook["entry"] in check, hook
    site = read(".readthedocs.yaml")["build"]["commands"][-1]
    assert site.split(" docs ")[0] in (ROOT / "docs/developers.md").read_text(encoding="utf-8")
    extras = set(tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"])
    (pip,) = read(".binder/environment.yml")["dependencies"][-1]["pip"]
    assert set(re.findall(r"\w+", pip.partition("[")[2])) <= extras
    for path in (ROOT / ".github").rglob("*.*"):
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"https?://|\w@\w+\.\w", text), path
