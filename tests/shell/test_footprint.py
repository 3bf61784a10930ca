"""What a run is said to need, against what the operating system saw it use."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from test_command_line import CASE
from test_stopped_runs import text_of

from jaxcontact.__main__ import main
from jaxcontact.shell.advice import container_memory, footprint_of, machine_memory
from jaxcontact.shell.case_file import read_case
from jaxcontact.shell.finished_steps import FinishedSteps

ROOT = Path(__file__).parents[2]
RUNS = {
    "large kernels": CASE.replace("n = 32", "n = 1024").replace("steps = 6", "steps = 4"),
    "tables of the direct superposition": CASE.replace("steps = 6", "steps = 200")
    + '[solver]\ncorrespondence = "quasi-elastic"\n',
    "fields of 0.4 GB, which go to disk": CASE.replace("n = 32", "n = 128").replace(
        "steps = 6", "steps = 1500"
    ),
}

# A process begins with the peak of the one that starts it, which may be these tests: a small one starts it instead.
PEAK_OF = """
import os, resource, subprocess, sys
done = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
print(done.returncode, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss is in kB on Linux alone")
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            n, marks=pytest.mark.long if "tables" in n or "kernels" in n or "disk" in n else pytest.mark.slow
        )
        for n in RUNS
    ],
)
def test_the_memory_of_a_run_is_what_was_said(name, tmp_path):
    path, out = tmp_path / "case.toml", tmp_path / "out"
    path.write_text(RUNS[name])
    case = read_case(path)
    command = [
        sys.executable,
        "-c",
        PEAK_OF,
        sys.executable,
        "-m",
        "jaxcontact",
        "run",
        str(path),
        "-o",
        str(out),
    ]
    as_a_user = os.environ | {"XLA_FLAGS": ""}
    told = subprocess.run(command, cwd=ROOT, env=as_a_user, capture_output=True, text=True, check=True).stdout
    status, kilobytes = map(int, told.split())
    assert status == 0
    assert 1 / 1.5 < kilobytes * 1024 / footprint_of(case).memory < 1.5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "save"),
    [
        ("indentation", "all"),
        ("indentation", "last"),
        pytest.param("indentation", "few", marks=pytest.mark.long),
        pytest.param("shear", "few", marks=pytest.mark.long),
        pytest.param("sliding", "all", marks=pytest.mark.long),
    ],
)
def test_the_disk_that_a_run_takes_is_what_was_said(kind, save, tmp_path, monkeypatch):
    """Just before the finished steps are removed the result is there as well."""
    path, out, sizes = tmp_path / "case.toml", tmp_path / "out", []
    text = text_of(kind, steps=100).replace("n = 16", "n = 32").replace('[solver]\nsave = "few"\n', "")
    path.write_text(f'{text}[solver]\nsave = "{save}"\n')
    arrays = lambda: sum(file.stat().st_size for file in out.rglob("*.npz"))
    monkeypatch.setattr(FinishedSteps, "remove", lambda steps: sizes.append(arrays()))
    assert main(["run", str(path), "-o", str(out)]) == 0
    assert sizes[-1] == pytest.approx(footprint_of(read_case(path)).disk, rel=0.1)


def test_memory_is_that_of_the_container_where_it_has_less(tmp_path):
    """Of the limits of a control group and those above it the least holds; "max" is none."""
    groups, own = tmp_path / "cgroup", tmp_path / "own"
    (groups / "batch" / "job").mkdir(parents=True)
    own.write_text("0::/batch/job\n")
    assert container_memory(groups, own) == float("inf")
    for part, limit in (("batch/job", "max"), ("batch", "4000000000"), (".", "8000000000")):
        (groups / part / "memory.max").write_text(limit + "\n")
    assert container_memory(groups, own) == 4e9
    assert container_memory(groups, Path("/none")) == float("inf")
    assert 1e8 < machine_memory() < 1e14
