"""CPU and wall time of each command ``jaxcontact fit ...`` in a process of its own, cold and warm.

    python -m tests.benchmarks.commands [--only BEGIN] [--repeat 3]

Cold is the first run, with an empty store of compiled programs; warm is the smallest of the following ones. Both contain the
start of Python, the file and the figure. The files are simulated in a temporary folder: creep, relaxation and oscillation
of 60 points, force curves of 800 and a hold of 200.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import jaxcontact as jc

MATERIAL = jc.Burgers(G1=2e5, G2=1e5, eta1=5e6, eta2=4e5, nu=0.5)
BALL = 5e-6  # radius [m]
HOLD = ["--radius", "5e-6", "--nu", "0.5", "--model", "StandardLinearSolid"]
COMMANDS = {
    "creep": ["creep", "creep.csv"],
    "creep, fractional": ["creep", "creep.csv", "--model", "FractionalMaxwell"],
    "prony": ["prony", "creep.csv"],
    "relaxation": ["relaxation", "relaxation.csv"],
    "relaxation, generalised Maxwell": ["relaxation", "relaxation.csv", "--tau", "auto"],
    "relaxation, spectrum": ["relaxation", "relaxation.csv", "--spectrum"],
    "oscillation": ["oscillation", "oscillation.csv"],
    "oscillation, generalised Maxwell": ["oscillation", "oscillation.csv", "--tau", "auto"],
    "master, WLF": ["master", "350.csv", "370.csv", "390.csv", "--temperature", "350,370,390"],
    "indentation": ["indentation", "hold.csv", *HOLD],
    "indentation, film": ["indentation", "hold.csv", *HOLD, "--layer", "2e-6", "--substrate-modulus", "7e10"],
    "force": ["force", "force.csv", "--radius", "5e-6"],
    "force, thin sample": ["force", "force.csv", "--radius", "5e-6", "--thickness", "4e-6"],
    "map of four curves": ["map", *["force.csv"] * 4, "--radius", "5e-6", "--processes", "1"],
    "stiffness": ["stiffness", "csm.csv", "--radius", "5e-6"],
    "stiffness, film": ["stiffness", "csm.csv", "--radius", "5e-6", "--thickness", "fit", "--substrate-modulus", "7e10"],
    "growth": ["growth", "growth.csv", "--stress", "3e8", "--temperature", "353"],
    "compare": ["compare", "creep.csv"],
    "batch of two": ["batch", "creep.csv", "again.csv"],
    "together": ["together", "creep.csv", "oscillation.csv", "--of", "creep,oscillation"],
    "posterior": ["posterior", "creep.csv"],
    "propagate": ["propagate", "creep.csv", "--times", "1e3,1e4"],
    "propagate, depth in a film": ["propagate", "creep.csv", "--of", "depth", "--times", "1e3", "--load", "1e-3", "--radius",
                                   "1e-3", "--layer", "1e-6", "--substrate-modulus", "2.1e11"],
    "design": ["design", "--model", "Maxwell", "--value", "G=1e6", "--value", "eta=1e8"],
}  # fmt: skip


def write(folder: Path) -> None:
    """Write the simulated files."""
    rng = np.random.default_rng(0)
    noisy = lambda y: np.asarray(y) * (1.0 + 0.01 * rng.standard_normal(np.shape(y)))
    save = lambda name, header, *columns: np.savetxt(
        folder / name, np.column_stack(columns), delimiter=",", header=header, comments=""
    )
    t = np.geomspace(0.1, 1000.0, 60)
    for name in ("creep.csv", "again.csv"):
        save(name, "t [s],J [1/Pa]", t, noisy(MATERIAL.creep(t)))
    save("relaxation.csv", "t [s],G(t) [Pa]", t, noisy(MATERIAL.relaxation(t)))
    omega = np.geomspace(1e-3, 10.0, 60)
    G = np.asarray(MATERIAL.complex_modulus(omega))
    save("oscillation.csv", "omega [rad/s],G' [Pa],G'' [Pa]", omega, noisy(G.real), noisy(G.imag))
    for T in (350.0, 370.0, 390.0):
        a = 10.0 ** (-8.0 * (T - 370.0) / (100.0 + T - 370.0))
        G = np.asarray(MATERIAL.complex_modulus(a * omega))
        save(f"{T:g}.csv", "omega [rad/s],G' [Pa],G'' [Pa]", omega, noisy(G.real), noisy(G.imag))
    t = np.linspace(0.0, 20.0, 200)
    load = 1e-8 * np.minimum(t / 2.0, 1.0)
    solid = jc.StandardLinearSolid(G1=2e3, G2=1e3, eta2=4e3, nu=0.5)
    history = np.concatenate([[0.0], np.diff(load)])  # of 3 load (1 - nu)/(8 R^(1/2)) J, by superposition
    J = np.asarray(solid.creep(np.maximum(t[:, None] - t, 0.0))) * (t[:, None] >= t)
    save(
        "hold.csv",
        "t [s],load [N],depth [m]",
        t,
        load,
        noisy((3.0 / 16.0 / BALL**0.5 * J @ history) ** (2 / 3)),
    )
    z = np.concatenate([np.linspace(-2e-6, 1e-6, 400), np.linspace(1e-6, -2e-6, 400)])
    force = 16.0 / 9.0 * 2e3 * BALL**0.5 * np.maximum(z, 0.0) ** 1.5
    save(
        "force.csv",
        "t [s],load [N],depth [m]",
        0.001 * np.arange(800),
        noisy(force) + 5e-12 * rng.standard_normal(800),
        z,
    )
    depth = np.geomspace(2e-8, 4e-7, 80)
    save(
        "csm.csv",
        "depth [m],stiffness [N/m],load [N]",
        depth,
        noisy(1e11 * (BALL * depth) ** 0.5),
        1e11 * depth,
    )
    save("growth.csv", "t [s],thickness [nm]", t, noisy(5.0 + 80.0 * (1.0 - np.exp(-t / 8.0))))


def seconds(arguments: list[str], folder: Path) -> tuple[float, float]:
    """CPU and wall time [s] of a command and its processes, whose store of programs is in the folder."""
    environment = {k: v for k, v in os.environ.items() if k != "JAX_COMPILATION_CACHE_DIR"}
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    where = [] if arguments[0] == "design" else ["-o", "out", "--force"]
    done = subprocess.run(
        [sys.executable, "-m", "jaxcontact", "fit", *arguments, *where], cwd=folder, capture_output=True, text=True,
        env=environment | {"XDG_CACHE_HOME": str(folder / "store")}, check=False,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"{' '.join(arguments)}: {done.stderr.strip()}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", default="")
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    print(
        "| command | cold: CPU [s] | wall [s] | warm: CPU [s] | wall [s] |\n|---|---|---|---|---|", flush=True
    )
    for name, arguments in COMMANDS.items():
        if not name.startswith(options.only):
            continue
        with tempfile.TemporaryDirectory() as place:
            write(Path(place))
            cold = seconds(arguments, Path(place))
            warm = np.min([seconds(arguments, Path(place)) for _ in range(options.repeat)], axis=0)
        print(f"| {name} | {cold[0]:.1f} | {cold[1]:.1f} | {warm[0]:.1f} | {warm[1]:.1f} |", flush=True)


if __name__ == "__main__":
    main()
