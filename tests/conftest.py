"""Shared pieces of the tests: the paper's film, ball and substrate, and one store of compiled programs."""

import os
import sys
import tempfile
from pathlib import Path

import pytest

# Equal programs of two files, and of the processes that tests start, are compiled once in a session: jax reads these
# when it is first imported. A folder of your own, JAX_COMPILATION_CACHE_DIR=~/.cache/jax, serves the next session too.
COMPILED = tempfile.TemporaryDirectory(prefix="jaxcontact-tests-")
os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", COMPILED.name)
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.1")
# it writes a screen of names of processor features to stderr for each program that it finds there
os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")

import jax  # noqa: E402

import jaxcontact as jc  # noqa: E402

sys.path.insert(0, str(Path(__file__).parent))


def pytest_unconfigure():
    COMPILED.cleanup()


@pytest.fixture(scope="session")
def steel():
    return jc.Elastic.from_young(210e9, nu=0.3)


@pytest.fixture(scope="session")
def film():
    """The paper's film, Eq. (14) with J = 2 phi."""
    return jc.Burgers(G1=0.75e9, G2=13.89e6, eta1=3.1486e12, eta2=120.9e9, nu=0.3)


@pytest.fixture(scope="session")
def ball(steel):
    return jc.Sphere(radius=9.525e-3, material=steel)


@pytest.fixture(scope="session")
def body(film, steel):
    return jc.LayeredHalfSpace([jc.Layer(film, thickness=150e-9)], substrate=steel)


@pytest.fixture(autouse=True, scope="module")
def compiled_programs_are_dropped():
    """After each file of tests: some thousand of them exhaust the memory maps that a process may have."""
    yield
    jax.clear_caches()
