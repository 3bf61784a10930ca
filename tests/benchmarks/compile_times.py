"""What a first call costs: the processor time to trace, lower and compile its programs, and how much there is to compile.

    python -m tests.benchmarks.compile_times              # every case: twenty minutes of processor time
    python -m tests.benchmarks.compile_times shear roll   # selected cases

Each case runs in processes of its own without a store of compiled programs, with the compiler options of a user. The time
is that of the first call less that of the second, the smaller one of two runs. ``kernels`` counts the functions that are
compiled one by one, and ``operations`` those of the optimised programs, inside of fusions as well.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import fitting
import jaxcontact as jc
from tests.support.bodies import BALL, BODY, FILM, STEEL

RUNS = 2
NO_CODE = {"parameter", "constant", "get-tuple-element", "tuple", "bitcast", "while", "conditional", "call"}
OPERATION = re.compile(r"^\s+(?:ROOT )?%?[\w.-]+ = .*?([a-z][\w-]*)\(")


def film(n: int = 128) -> jax.Array:
    """``indent`` of the Burgers film on steel, 31 times within two hours."""
    times, grid = jnp.linspace(0.0, 7200.0, 31), jc.Grid.square(n, 600e-6)
    return jc.indent(BODY, BALL, jc.Load(60.0), times, grid=grid).pressure


def half_space(n: int = 128) -> jax.Array:
    """``indent`` of steel, once."""
    steel, grid = jc.LayeredHalfSpace([], STEEL), jc.Grid.square(n, 600e-6)
    return jc.indent(steel, BALL, jc.Load(60.0), [0.0], grid=grid).pressure


def slid(n: int = 128) -> jax.Array:
    """``slide_steady`` of that film."""
    grid = jc.Grid.square(n, 600e-6)
    return jc.slide_steady(BODY, BALL, jc.Load(60.0), velocity=1e-7, grid=grid).pressure


def rubbed(n: int = 128) -> jax.Array:
    """``rub`` of that film, which wears."""
    times, grid = np.linspace(0.0, 7200.0, 11), jc.Grid.square(n, 600e-6)
    return jc.rub(BODY, BALL, jc.Load(60.0), times, velocity=0.1, law=jc.Archard(1e-22), grid=grid).thickness


def creep_fitted() -> float:
    """``fit_creep`` of 60 points."""
    times = np.geomspace(1.0, 1e5, 60)
    noise = 1.0 + 0.005 * np.random.default_rng(0).standard_normal(60)
    return fitting.fit_creep(fitting.CreepData(times, np.asarray(FILM.creep(times)) * noise)).material.G1


def film_fitted() -> float:
    """``fit_indentation`` of a hold of 21 points on that film, through the contact solver on 32 x 32 cells."""
    times = np.linspace(0.0, 2e4, 21)
    grid = jc.Grid.square(32, 600e-6)
    noise = 1.0 + 0.005 * np.random.default_rng(0).standard_normal(21)
    depth = np.asarray(jc.indent(BODY, BALL, jc.Load(60.0), times, grid=grid, save="last").approach) * noise
    data = fitting.IndentationData(t=times, load=np.full(21, 60.0), depth=depth)
    given = {"nu": 0.3, "weights": "relative", "layer": 150e-9, "substrate": STEEL}
    return fitting.fit_indentation(data, indenter=BALL, **given).material.G1


def sheared(friction: Any) -> jax.Array:
    """A number from the tractions of ``shear`` of that film."""
    push = jc.TangentialLoad(np.stack([[0.0, 5.0, -5.0, 0.0], np.zeros(4)], 1))
    grid, times = jc.Grid.square(32, 400e-6), np.arange(4.0)
    found = jc.shear(BODY, BALL, jc.Load(40.0), push, times, friction=friction, grid=grid)
    return jnp.sum(found.traction**2) / 1e12


def rolled(friction: Any) -> jax.Array:
    """The tangential load of a ball that rolls steadily over steel."""
    grid, steel = jc.Grid.square(32, 400e-6), jc.LayeredHalfSpace([], STEEL)
    return jc.roll_steady(
        steel, BALL, jc.Load(20.0), velocity=1.0, creepage=(1e-3, 0.0), friction=friction, grid=grid
    ).tangential_load[0]


def line_rolled(friction: Any) -> jax.Array:
    """The same of a cylinder in plane strain."""
    grid, steel = jc.Grid((64, 1), (3e-4 / 64, 1e-3), periodic=(False, True)), jc.LayeredHalfSpace([], STEEL)
    cylinder, creepage = jc.Cylinder(10e-3, 1e-3), (1e-3, 0.0)
    return jc.roll_steady(
        steel, cylinder, jc.Load(20.0), velocity=1.0, creepage=creepage, friction=friction, grid=grid
    ).tangential_load[0]


CASES: dict[str, Callable[[], Any]] = {
    "film": film,
    "half-space": half_space,
    "slide_steady": slid,
    "rub": rubbed,
    "fit creep": creep_fitted,
    "fit indentation, film": film_fitted,
    "shear": lambda: sheared(0.3),
    "shear, gradient": lambda: jax.grad(sheared)(0.3),
    "roll": lambda: rolled(0.3),
    "roll, line": lambda: line_rolled(0.3),
    "roll, line, gradient": lambda: jax.grad(line_rolled)(0.3),
}


def measure(name: str) -> float:
    """Return the processor time of the first call of a case less that of the second [s]."""
    seconds = []
    for _ in range(2):
        began = time.process_time()
        jax.block_until_ready(CASES[name]())
        seconds.append(time.process_time() - began)
    return seconds[0] - seconds[1]


def in_process(name: str, flags: str = "") -> float:
    """``measure`` in a process of its own, with flags of the compiler."""
    environment = os.environ | {"JAX_ENABLE_COMPILATION_CACHE": "false", "XLA_FLAGS": flags}
    code = f"from tests.benchmarks.compile_times import measure; print(measure({name!r}))"
    command = [sys.executable, "-W", "ignore", "-c", code]
    return float(subprocess.check_output(command, env=environment, text=True).split()[-1])


def counts(name: str) -> dict[str, int]:
    """Return the number of kernels and of operations in all compiled programs of a case."""
    with tempfile.TemporaryDirectory() as folder:
        in_process(name, f"--xla_dump_to={folder} --xla_dump_hlo_as_text")
        kernels = sum(
            path.read_text().count("\ndefine ptr @") for path in Path(folder).glob("*.ir-no-opt.ll")
        )
        texts = [path.read_text() for path in Path(folder).glob("*cpu_after_optimizations.txt")]
    found = (OPERATION.match(line) for text in texts for line in text.splitlines())
    return {"kernels": kernels, "operations": sum(1 for each in found if each and each[1] not in NO_CODE)}


def main() -> None:
    for name in sys.argv[1:] or CASES:
        seconds = min(in_process(name) for _ in range(RUNS))
        print(json.dumps({"case": name, "cpu_s": round(seconds, 1), **counts(name)}), flush=True)


if __name__ == "__main__":
    main()
