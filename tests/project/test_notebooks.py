"""The notebooks: each runs from clean on a CPU, and what is committed is the outcome of a whole run."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[2] / "notebooks").glob("*.ipynb"))
# run in .ci/run, the others before a release
FIRST = {"1_first_contact"}
LARGEST = 500_000  # bytes of a committed notebook, so that a clone stays small


def cells(path, kind="code"):
    return [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == kind]


def outputs(path):
    return [output for cell in cells(path) for output in cell["outputs"]]


def test_there_are_notebooks():
    assert NOTEBOOKS


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_committed_outputs_are_of_one_run_and_hold_figures(path):
    counts = [cell["execution_count"] for cell in cells(path)]
    assert counts == list(range(1, len(counts) + 1))
    assert sum("image/png" in output.get("data", {}) for output in outputs(path)) >= 2
    assert not [output for output in outputs(path) if output["output_type"] == "error"]
    assert path.stat().st_size < LARGEST


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_teaches_in_words(path):
    words = sum(len("".join(cell["source"]).split()) for cell in cells(path, "markdown"))
    assert words > 150


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, marks=pytest.mark.slow if p.stem in FIRST else pytest.mark.long) for p in NOTEBOOKS],
    ids=lambda path: path.stem,
)
def test_a_notebook_runs_from_clean(path, tmp_path):
    """Time is printed, not tested: it depends on who else is at work. Each is meant to take under 60 s."""
    pytest.importorskip("nbconvert", reason="notebooks are the extra jaxcontact[notebooks]")
    environment = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}
    command = [
        sys.executable,
        "-m",
        "nbconvert",
        "--to",
        "notebook",
        "--execute",
        "--output-dir",
        tmp_path,
        path,
    ]
    began = time.perf_counter()
    done = subprocess.run(
        command,
        env=environment | {"JAX_PLATFORMS": "cpu"},
        cwd=path.parent,
        capture_output=True,
        text=True,
        timeout=900,
    )
    print(f"\n{path.name}: {time.perf_counter() - began:.0f} s")
    assert done.returncode == 0, done.stderr[-3000:]
    pictures = [
        sum("image/png" in out.get("data", {}) for out in outputs(p)) for p in (path, tmp_path / path.name)
    ]
    assert pictures[0] == pictures[1], "the committed outputs are of another version: run it again"
