"""Grids that are chosen for the user: around the expected contact, and wider when the contact outgrows them."""

import warnings

import jax
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact import indentation

GLASS, BALL = jc.LayeredHalfSpace([], jc.Elastic(30e9, 0.25)), jc.Sphere(5e-3)


def small(*given):
    return AROUND(*given, n=32)


AROUND = jc.Grid.around


@pytest.mark.slow
def test_a_grid_of_its_own_holds_the_contact(monkeypatch):
    """The ball's estimate is good: no widening, and Hertz's approach."""
    monkeypatch.setattr(jc.Grid, "around", small)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        history = jc.indent(GLASS, BALL, jc.Load(20.0), [0.0], grid="auto")
    assert float(history.approach[0]) == pytest.approx(1.919e-6, rel=2e-3)


def test_a_grid_that_the_contact_outgrows_is_widened(monkeypatch):
    """From an estimate of a fifth of the contact: 1.5^4 is wide enough, and only the last grid's verdict counts."""
    monkeypatch.setattr(jc.Grid, "around", lambda *given: jc.Grid.square(32, 260e-6 / 5.0))
    with pytest.warns(UserWarning) as caught:
        history = jc.indent(GLASS, BALL, jc.Load(20.0), [0.0], grid="auto")
    assert [str(one.message) for one in caught] == ['grid="auto": widened 4 times, to 0.000263 m']
    assert bool(history.converged[0])
    assert float(history.approach[0]) == pytest.approx(1.919e-6, rel=2e-3)


@pytest.mark.filterwarnings("ignore:grid=")
def test_what_cannot_be_widened_enough_says_so(monkeypatch):
    monkeypatch.setattr(jc.Grid, "around", lambda *given: jc.Grid.square(32, 10e-6))
    with pytest.warns(UserWarning, match="edge of the grid"):
        history = jc.indent(GLASS, BALL, jc.Load(20.0), [0.0], grid="auto")
    assert int(history.status[0]) == jc.Status.AT_EDGE
    assert float(history.grid.width[0]) == pytest.approx(10e-6 * indentation.WIDER**4)


@pytest.mark.parametrize("transform", [jax.vmap, jax.jit])
def test_traced_values_have_no_width(transform):
    """Neither ``Grid.around`` nor "auto" can choose by numbers that are not there yet."""
    loads = np.array([10.0, 20.0])
    around = lambda load: jc.Grid.around(GLASS, BALL, jc.Load(load), [0.0]).spacing[0]
    with pytest.raises(ValueError, match="expected values that are known"):
        transform(around)(loads)
    auto = lambda load: jc.indent(GLASS, BALL, jc.Load(load), [0.0], grid="auto").approach
    with pytest.raises(ValueError, match="expected a Grid inside jit"):
        transform(auto)(loads[0] if transform is jax.jit else loads)


def test_a_height_field_has_its_own_grid():
    with pytest.raises(ValueError, match="a HeightField comes with its own grid; expected Grid"):
        jc.indent(GLASS, jc.HeightField(np.zeros((8, 8))), jc.Load(1.0), [0.0], grid="auto")
