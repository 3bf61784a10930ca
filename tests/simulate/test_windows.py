"""Verbs whose searches begin in a window of the grid (``operators.operator``) against the same on the whole grid alone."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.operators import operator
from jaxcontact.simulate import indent
from tests.support.bodies import BALL, BODY, FILM, STEEL

GRID = jc.Grid((72, 40), (16e-6, 16e-6))
TIMES = np.array([0.0, 600.0, 3600.0])
TIGHT = {"grid": GRID, "tolerance": 1e-11}
# unlike the ball, so that pressure and traction are coupled
RUBBER = jc.LayeredHalfSpace([], jc.Elastic(G=1e9, nu=0.2))


def film(load):
    return jc.indent(BODY, BALL, jc.Load(load), TIMES, **TIGHT).pressure


def uneven_film(load):
    x, y = GRID.coordinates()
    thickness = 150e-9 * (1.0 + 0.3 * jnp.sin(x / 100e-6) * jnp.cos(y / 80e-6))
    body = jc.LayeredHalfSpace([jc.Layer(FILM, thickness)], STEEL)
    return jc.indent(body, BALL, jc.Load(load), TIMES, **TIGHT).pressure


def yielding(load):
    steel = jc.LayeredHalfSpace([], STEEL)
    return jc.indent(steel, BALL, jc.Load(load), [0.0], hardness=0.8e9, **TIGHT).pressure


def sheared(load):
    push = jc.TangentialLoad(np.array([[0.0, 0.0], [0.2, 0.1]]))
    return jc.shear(RUBBER, BALL, jc.Load(load), push, [0.0, 1.0], friction=0.3, **TIGHT).traction


def slid(load):
    return jc.slide_steady(BODY, BALL, jc.Load(load), velocity=1e-8, friction=0.1, **TIGHT).pressure


@pytest.fixture
def windows(monkeypatch):
    """A list with an entry for each search that is recorded with a window."""
    made, restricted = [], operator.Operator.restricted

    def noted(self, corner):
        made.append(corner)
        return restricted(self, corner)

    monkeypatch.setattr(operator.Operator, "restricted", noted)
    jax.clear_caches()
    return made


@pytest.mark.slow
def test_a_single_contact_on_a_small_grid_has_no_window(windows):
    steel = jc.LayeredHalfSpace([], STEEL)
    jc.indent(steel, BALL, jc.Load(20.0), [0.0], grid=GRID)
    assert not windows
    jc.indent(steel, BALL, jc.Load(20.0), np.arange(6.0), grid=GRID)
    assert windows


@pytest.mark.slow
@pytest.mark.parametrize(
    ("verb", "load"),
    [
        (film, 20.0),
        pytest.param(uneven_film, 20.0, marks=pytest.mark.long),
        pytest.param(yielding, 20.0, marks=pytest.mark.long),
        pytest.param(sheared, 2.0, marks=pytest.mark.long),
        pytest.param(slid, 20.0, marks=pytest.mark.long),
    ],
)
def test_the_window_changes_neither_a_result_nor_its_derivative(verb, load, windows, monkeypatch):
    """The contact fits the window in every case. A steady slide has none: it has another preconditioner alone."""
    monkeypatch.setattr(indent, "SINGLE", 0)

    def found():
        jax.clear_caches()
        return jax.jvp(verb, (load,), (1.0,))

    assert operator.window_shape(GRID.shape) == (54, 30)
    value, slope = found()
    count = len(windows)
    monkeypatch.setattr(operator, "SMALL", max(GRID.shape))
    assert operator.window_shape(GRID.shape) is None
    expected, expected_slope = found()
    assert len(windows) == count and (count > 0) == (verb is not slid)
    jax.clear_caches()
    assert 40 < int(jnp.sum(jnp.any(expected.reshape(-1, *GRID.shape) != 0.0, 0))) < 700
    np.testing.assert_allclose(value, expected, atol=1e-8 * float(jnp.max(jnp.abs(expected))))
    np.testing.assert_allclose(slope, expected_slope, atol=1e-6 * float(jnp.max(jnp.abs(expected_slope))))
