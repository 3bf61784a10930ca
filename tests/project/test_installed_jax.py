"""The jax that is installed computes what it says and comes to an end; a release known not to is named on import."""

import importlib
import math
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import jax
import jax.numpy as jnp
import jaxlib
import numpy as np
import pytest
from jax import export
from tolerances import APPROACH

import jaxcontact
from jaxcontact._support.at_import import FAULTS
from jaxcontact.operators.kernels import expansion

pytestmark = pytest.mark.versions
RIGHT = "pip install 'jax>=0.7,!=0.10.2,!=0.11.1', as pyproject.toml says"
ONE_THREAD = "multi_thread_eigen=false" in os.environ.get("XLA_FLAGS", "")
PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]


@pytest.mark.parametrize("reduction", ["sum", "max"])
@pytest.mark.parametrize("columns", [3, 5, 7])
def test_reduced_rows_of_a_matrix_are_those_of_numpy(columns, reduction):
    """jit(vmap(matrix @ row, reduced)), where jaxlib 0.10.2 is wrong beyond the 16384th row (jax issue 39103)."""
    generator = np.random.default_rng(columns)
    matrix = generator.standard_normal((columns, columns))
    rows = generator.standard_normal((20000, columns))
    reduced = jax.jit(jax.vmap(lambda row: getattr(jnp, reduction)(jnp.asarray(matrix) @ row)))
    for count in (16384, 16385, 20000):
        expected = getattr(np, reduction)(rows[:count] @ matrix.T, axis=1)
        wrong = int(np.sum(np.abs(reduced(rows[:count]) - expected) > 1e-12))
        assert wrong == 0, f"jaxlib {jaxlib.__version__}: {wrong} of {count} rows are wrong; {RIGHT}"


@pytest.mark.slow
@pytest.mark.skipif(ONE_THREAD, reason="where programs run on one thread, nothing waits for another")
@pytest.mark.filterwarnings("ignore:film strain")
def test_a_large_run_comes_to_its_end(body, ball):
    """The paper's film, 60 N for 7200 s: reference.abel's march of 50 steps ends at 3.35542 um. jaxlib 0.11.1 hangs."""
    times, grid = jnp.linspace(0.0, 7200.0, 151), jaxcontact.Grid.square(512, 620e-6)
    run = jaxcontact.indent(body, ball, jaxcontact.Load(60.0), times, grid=grid, save="last")
    assert float(run.approach[-1]) == pytest.approx(3.35542e-6, rel=APPROACH)
    assert bool(jnp.all(run.converged))


@pytest.mark.slow
@pytest.mark.parametrize("layers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_many_films_in_one_program_decompose_one_matrix_at_a_time(steel, film, layers):
    """Two batches of decompositions at once wait for each other for ever on two cores."""

    def images(thickness):
        body = jaxcontact.LayeredHalfSpace([jaxcontact.Layer(film, thickness)] * layers, substrate=steel)
        return expansion(body, 1).images

    program = jax.jit(jax.vmap(images)).lower(jnp.geomspace(1e-8, 1e-7, 4)).compile().as_text()
    shapes = re.findall(r"= \(?f64\[([0-9,]*)\][^=]*custom-call\([^\n]*lapack_", program)
    assert shapes and all(len(shape.split(",")) <= 2 for shape in shapes)


@pytest.mark.slow
@pytest.mark.parametrize("platform", ["cuda", "tpu"])
def test_a_run_is_lowered_for_accelerators(body, ball, platform):
    """As far as it goes without one: every operation has a form there, loops stay on the device, no sort of cells."""
    grid, times = jaxcontact.Grid.square(32, 620e-6), jnp.linspace(0.0, 60.0, 3)

    def approach(load):
        return jaxcontact.indent(body, ball, jaxcontact.Load(load), times, grid=grid, save="last").approach[
            -1
        ]

    program = export.export(jax.jit(jax.value_and_grad(approach)), platforms=[platform])(60.0).mlir_module()
    assert "stablehlo.while" in program and "callback" not in program
    shapes = re.findall(r"stablehlo\.sort.*?tensor<([0-9x]+)xf64", program, re.DOTALL)
    assert all(math.prod(map(int, shape.split("x"))) < 32 * 32 for shape in shapes)


SETTINGS = "print(jax.numpy.ones(1).dtype, jax.config.read('jax_cpu_enable_async_dispatch'))"


@pytest.mark.slow
@pytest.mark.parametrize(
    "imported",
    [
        "import jax, jaxcontact",
        "import jaxcontact, sys; assert 'jax' not in sys.modules; import jax",
        "import jaxcontact, importlib.util; importlib.util.find_spec('jax'); import jax.numpy as jnp, jax",
        "import fitting, jax",
    ],
)
def test_importing_jaxcontact_switches_jax_to_float64_whichever_comes_first(imported):
    """The settings are made where jax is imported, also if a program has looked for it before."""
    done = subprocess.run([sys.executable, "-c", f"{imported}; {SETTINGS}"], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("float64 False\n", "")


@pytest.mark.parametrize("version", FAULTS)
def test_a_faulty_release_is_named_on_import_and_excluded_by_the_project(version, monkeypatch):
    monkeypatch.setattr(jaxlib, "__version__", version)
    with pytest.warns(UserWarning, match=rf"jaxlib {version} .*pip install 'jax!={version}'") as caught:
        importlib.reload(jaxcontact)
    assert len(caught) == 1 and "\n" not in str(caught[0].message)
    (required,) = [dependency for dependency in PROJECT["dependencies"] if dependency.startswith("jax>")]
    assert required in RIGHT and f"!={version}" in required
