"""Start-up times: the user CPU time [s] of a new process before it computes anything, the least of several runs.

    python -m tests.benchmarks.bench_start

Importing jax, and jaxcontact with its names; the help of the command; README's first command and a fit of 20 points,
with an empty store of programs and then with what the first run left in it. A loop of ten million additions tells how
fast the machine is.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import jaxcontact as jc


def seconds(*arguments: str, folder: Path) -> float:
    """CPU time of a process of this Python, whose store of programs is in the folder."""
    environment = {k: v for k, v in os.environ.items() if k != "JAX_COMPILATION_CACHE_DIR"}
    start = os.times().children_user
    subprocess.run(
        [sys.executable, *arguments],
        check=True,
        capture_output=True,
        env=environment | {"XDG_CACHE_HOME": str(folder)},
    )
    return os.times().children_user - start


def creep_file(path: Path) -> str:
    """20 points of a Burgers material with one percent of noise."""
    material = jc.Burgers(G1=2e5, G2=1e5, eta1=5e6, eta2=4e5, nu=0.5)
    t = np.geomspace(0.1, 100.0, 20)
    J = np.asarray(material.creep(t)) * (1.0 + 0.01 * np.random.default_rng(0).normal(size=20))
    np.savetxt(path, np.column_stack([t, J]), header="t [s], J [1/Pa]", delimiter=",")
    return str(path)


def main() -> None:
    start = time.perf_counter()
    sum(range(10**7))
    print(f"ten million additions: {time.perf_counter() - start:.2f} s")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for code in ("import jax", "import jaxcontact; jaxcontact.indent"):
            print(f"{code}: {min(seconds('-c', code, folder=folder) for _ in range(5)):.2f} s")
        helps = [seconds("-m", "jaxcontact", "--help", folder=folder) for _ in range(5)]
        print(f"jaxcontact --help: {min(helps):.2f} s")
        run = ("-m", "jaxcontact", "run", "polymer_coating", "-o", str(folder / "out"), "--force")
        fit = (
            "-m",
            "jaxcontact",
            "fit",
            "creep",
            creep_file(folder / "creep.csv"),
            "-o",
            str(folder / "fit"),
            "--force",
        )
        for what, command in (("README's first command", run), ("a fit of 20 points", fit)):
            first = seconds(*command, folder=folder)
            again = [seconds(*command, folder=folder) for _ in range(3)]
            print(f"{what}: first run {first:.1f} s, then {min(again):.1f} s")


if __name__ == "__main__":
    main()
