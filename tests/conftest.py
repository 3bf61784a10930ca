"""Shared pieces of the tests: the paper's film, ball and substrate."""

import sys
from pathlib import Path

import jax
import pytest

import jaxcontact as jc

sys.path.insert(0, str(Path(__file__).parent))


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
