"""Shared pieces of the tests: the paper's film, ball and substrate, and one store of compiled programs."""

import contextlib
import gc
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

# Equal programs of two files, and of the processes that tests start, are compiled once in a session: jax reads these
# when it is first imported. A folder of your own, JAX_COMPILATION_CACHE_DIR=~/.cache/jax, serves the next session too.
COMPILED = tempfile.TemporaryDirectory(prefix="jaxcontact-tests-")
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", COMPILED.name)
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")  # thousands take 20 ms each
# in two processes on two cores the threads of numpy's products and of scipy's decompositions would wait for each other
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# it writes a screen of names of processor features to stderr for each program that it finds there
os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")

# Compiling is most of what the tests cost, and takes half as long when programs are not optimised; on one thread equal
# runs are equal bit for bit (on two a transform rounds as its lines are shared). With XLA_FLAGS= programs are those of a
# user, as in .ci/run with the lowest and the highest versions. A compiler that does not know a flag aborts.
# Undivided (the default is 32 threads for each program), a first film or shear takes 8 % less processor time and has a sixth
# fewer memory maps.
FAST_COMPILE = (
    "--xla_backend_optimization_level=0 --xla_cpu_use_fusion_emitters=false --xla_cpu_multi_thread_eigen=false"
    " --xla_cpu_parallel_codegen_split_count=1"
)
if "XLA_FLAGS" not in os.environ:
    compiling = [sys.executable, "-c", "import jax; jax.numpy.zeros(1)"]
    known = subprocess.run(compiling, env=os.environ | {"XLA_FLAGS": FAST_COMPILE}, capture_output=True)
    os.environ["XLA_FLAGS"] = FAST_COMPILE if known.returncode == 0 else ""

# tests share cases and helpers across folders
sys.path[:0] = [str(folder) for folder in sorted(Path(__file__).parent.glob("*/"))]

import bodies  # noqa: E402
import jax  # noqa: E402


def pytest_unconfigure():
    COMPILED.cleanup()


@pytest.fixture(scope="session")
def steel():
    return bodies.STEEL


@pytest.fixture(scope="session")
def film():
    return bodies.FILM


@pytest.fixture(scope="session")
def ball():
    return bodies.BALL


@pytest.fixture(scope="session")
def body():
    return bodies.BODY


@pytest.fixture
def here(tmp_path):
    """The temporary folder as the working directory; ``monkeypatch.chdir`` would drop programs (below)."""
    with contextlib.chdir(tmp_path):
        yield tmp_path


def pytest_collection_finish():
    """Let the garbage collector run less often: tracing creates many objects, hardly any of which are garbage."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 10, 10)


@pytest.fixture(autouse=True, scope="module")
def programs_with_a_replaced_function_reach_no_other_file(request):
    """Drop the programs in memory before and after a file whose tests replace functions: one that was traced before has
    the function itself, one that was traced meanwhile has its replacement. All other files share their programs: to
    trace them again is as dear as to compile them. A process drops them before they exhaust its memory maps
    (jaxcontact/_compile/programs.py)."""
    items = request.session.items
    replaces = any("monkeypatch" in item.fixturenames for item in items if item.path == request.path)
    if replaces:
        jax.clear_caches()
    yield
    if replaces:
        jax.clear_caches()
