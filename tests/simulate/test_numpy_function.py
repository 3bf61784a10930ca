"""Calculations and products with their Jacobian, called with numpy alone."""

import numpy as np
import pytest

import jaxcontact as jc

GRID, TIMES = jc.Grid.square(12, 260e-6), [0.0, 5.0]


def pressed(x):
    """A film that creeps under a ball: outputs of both shapes, and one that is no real number."""
    film = jc.StandardLinearSolid(x["G1"], 1e9, 4e9, nu=0.4)
    body = jc.LayeredHalfSpace([jc.Layer(film, x["thickness"])], jc.Elastic.from_young(210e9))
    history = jc.indent(body, jc.Sphere(5e-3), jc.Load(x["loads"]), TIMES, grid=GRID, tolerance=1e-12)
    return {"approach": history.approach, "peak": history.peak_pressure[-1], "status": history.status}


X = {"G1": 1e9, "thickness": 40e-6, "loads": [0.5, 0.6]}
COTANGENTS = {"approach": np.array([0.3, 1.0]) * 1e6, "peak": 1e-8}


def differences(function, x, cotangents, name, index, step=1e-5):
    """Return the central difference of the sum of cotangent times output, by an element of an input."""

    def total(factor):
        changed = {key: np.array(value, float) for key, value in x.items()}
        changed[name][index] *= factor
        found = function.apply(changed)
        return sum(float(np.sum(v * found[key])) for key, v in cotangents.items())

    width = 2.0 * step * float(np.asarray(x[name])[index])
    return (total(1.0 + step) - total(1.0 - step)) / width


@pytest.mark.slow
def test_products_are_central_differences_and_everything_is_numpy():
    function = jc.NumpyFunction(pressed)
    values, products = function.apply(X), function.vjp(X, COTANGENTS)
    assert {type(v) for v in (*values.values(), *products.values())} == {np.ndarray}
    assert not np.any(values["status"]) and values["status"].dtype.kind == "i"
    assert {name: v.shape for name, v in products.items()} == {"G1": (), "thickness": (), "loads": (2,)}
    for name, index in (("G1", ()), ("thickness", ()), ("loads", 0), ("loads", 1)):
        expected = differences(function, X, COTANGENTS, name, index)
        assert products[name][index] == pytest.approx(expected, rel=1e-5), name


def test_outputs_without_cotangent_count_as_zero():
    function = jc.NumpyFunction(lambda x: {"square": x["a"] ** 2, "triple": 3.0 * x["a"], "cells": 7})
    assert function.apply({"a": 2})["cells"] == 7
    np.testing.assert_allclose(function.vjp({"a": [1, 2]}, {"square": [1, 10]})["a"], [2.0, 40.0], rtol=1e-15)
    found = function.vjp({"a": 2}, {"square": 1, "triple": 1.0})["a"]
    assert float(found) == pytest.approx(7.0, rel=1e-15)
    assert float(function.vjp({"a": 2}, {})["a"]) == 0.0


HALF_SPACE = jc.LayeredHalfSpace([], jc.Elastic.from_young(210e9, 0.3))


def hertz(x):
    history = jc.indent(
        HALF_SPACE, jc.Sphere(x["radius"]), jc.Load(x["load"]), [0.0], grid=jc.Grid.square(24, 330e-6)
    )
    misfit = (history.approach[0] / 1.5e-6 - 1.0) ** 2
    return {"misfit": misfit, "approach": history.approach[0], "status": history.status[0]}


HERTZ = jc.NumpyFunction(hertz)


@pytest.mark.slow
def test_the_derivatives_of_a_hertz_contact_are_those_of_its_closed_form():
    """Approach = (9 W^2/(16 R E*^2))^(1/3), on a grid with about 20 cells across the contact.

    The set of cells in contact is constant in a derivative, which moves the slopes by 3 % on so coarse a grid.
    """
    x = {"radius": 9.5e-3, "load": 40.0}
    approach, slopes = HERTZ.apply(x)["approach"], HERTZ.vjp(x, {"approach": 1.0})
    exact = np.cbrt(9.0 * 40.0**2 / (16.0 * 9.5e-3 * (210e9 / 0.91) ** 2))
    assert float(approach) == pytest.approx(exact, rel=2e-3)
    by_load, by_radius = (float(slopes[name] * x[name] / approach) for name in ("load", "radius"))
    assert by_load == pytest.approx(2.0 / 3.0, rel=4e-2)
    # twice the curvature and load: twice the approach
    assert by_load - by_radius == pytest.approx(1.0, rel=1e-6)


@pytest.mark.slow
def test_an_optimiser_of_scipy_finds_the_load_of_an_approach():
    from scipy.optimize import minimize

    at = lambda x: {"radius": 9.5e-3, "load": 10.0 * x[0]}
    found = minimize(
        lambda x: float(HERTZ.apply(at(x))["misfit"]), [2.0],
        jac=lambda x: 10.0 * HERTZ.vjp(at(x), {"misfit": 1.0})["load"][None], tol=1e-10,
    )  # fmt: skip
    exact = 4.0 / 3.0 * 210e9 / 0.91 * np.sqrt(9.5e-3 * 1.5e-6**3)
    assert 10.0 * found.x[0] == pytest.approx(exact, rel=3e-3)


def test_inputs_out_of_range_are_seen_in_the_outputs():
    """The values are not known where f is compiled: no error, but no number either."""
    found = HERTZ.apply({"radius": -1e-3, "load": 40.0})
    assert found["status"] == jc.Status.OUT_OF_RANGE and np.isnan(found["approach"])
