"""Minimisation: known minima, scipy, bounds, unsound regions, resumed searches, and a contact designed by gradients."""

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest
from scipy.optimize import minimize, rosen, rosen_der

import fitting
import jaxcontact as jc


def rosenbrock(p):
    x = p["x"]
    return jnp.sum(100.0 * (x[1:] - x[:-1] ** 2) ** 2 + (1.0 - x[:-1]) ** 2)


START = {"x": np.array([-1.2, 1.0, -0.5, 0.8])}


@pytest.mark.versions
def test_a_curved_valley_ends_where_scipy_ends():
    found = fitting.minimise(rosenbrock, START, tolerance=1e-7)
    wanted = minimize(rosen, START["x"], jac=rosen_der, method="BFGS", options={"gtol": 1e-9})
    assert found.converged
    np.testing.assert_allclose(found.point["x"], wanted.x, atol=1e-5)
    assert found.evaluations < 120
    assert found.values[-1] == found.value < found.values[0]


def test_parameters_of_unlike_size_cost_no_more_steps():
    even = fitting.minimise(lambda p: (p["a"] - 3.0) ** 2 + (p["b"] - 2.0) ** 2, {"a": 1.0, "b": 1.0})
    unlike = fitting.minimise(
        lambda p: (p["a"] / 1e9 - 3.0) ** 2 + (p["b"] / 1e-9 - 2.0) ** 2, {"a": 1e9, "b": 1e-9}
    )
    assert len(unlike.values) == len(even.values)
    assert float(unlike.point["a"]) == pytest.approx(3e9, rel=1e-4)
    assert float(unlike.point["b"]) == pytest.approx(2e-9, rel=1e-4)


@pytest.mark.parametrize(
    ("bounds", "wanted"),
    [((0.0, None), 0.0), ((None, 2.0), -1.0), ((0.5, 2.0), 0.5), ((-4.0, 4.0), -1.0), (None, -1.0)],
)
def test_a_bounded_minimum_is_inside_or_approaches_the_bound(bounds, wanted):
    tried = []

    def loss(x):
        jax.debug.callback(lambda v: tried.append(float(v)), x)
        return (x + 1.0) ** 2

    found = fitting.minimise(loss, 1.0, bounds=bounds, tolerance=1e-6)
    low, high = bounds or (None, None)
    assert all((low is None or low <= x) and (high is None or x <= high) for x in tried)
    assert float(found.point) == pytest.approx(wanted, abs=2e-3)


@pytest.mark.parametrize("method", ["lbfgs", optax.adam(0.3)], ids=["lbfgs", "adam"])
@pytest.mark.parametrize("kind", ["nan", "status"])
def test_steps_into_an_unsound_region_are_shortened(method, kind):
    """The loss falls towards x = 2; from there on it has no value, or its contact has failed and it lies."""

    def loss(x):
        failed = x > 2.0
        if kind == "nan":
            return jnp.where(failed, jnp.nan, (x - 1.9) ** 2)
        return jnp.where(failed, -100.0, (x - 1.9) ** 2), jnp.where(failed, 1, 0)

    found = fitting.minimise(loss, 0.5, method=method, steps=300)
    assert float(found.point) == pytest.approx(1.9, abs=1e-3)
    assert found.value >= 0.0


def test_a_kink_does_not_stop_the_line_search():
    found = fitting.minimise(lambda p: jnp.abs(p[0] - 1.0) + 0.1 * p[1] ** 2, np.array([3.0, 4.0]), steps=100)
    np.testing.assert_allclose(found.point, [1.0, 0.0], atol=1e-3)


def test_a_resumed_search_is_the_undisturbed_one(tmp_path):
    whole = fitting.minimise(rosenbrock, START, steps=25)
    fitting.minimise(rosenbrock, START, steps=9, state=tmp_path / "search.npz")
    resumed = fitting.minimise(rosenbrock, START, steps=25, state=tmp_path / "search.npz")
    np.testing.assert_array_equal(resumed.values, whole.values)
    np.testing.assert_array_equal(resumed.point["x"], whole.point["x"])
    with pytest.raises(ValueError, match="belongs to a search with other parameters"):
        fitting.minimise(rosenbrock, {"x": 2.0 * START["x"]}, state=tmp_path / "search.npz")
    (tmp_path / "search.npz").write_text("no")
    with pytest.raises(ValueError, match="not the state of a search"):
        fitting.minimise(rosenbrock, START, state=tmp_path / "search.npz")


def test_one_program_is_compiled_for_all_steps():
    traces = []

    def loss(p):
        traces.append(1)
        return rosenbrock(p)

    fitting.minimise(loss, START, steps=30)
    assert len(traces) == 1


@pytest.mark.slow
def test_the_radius_of_a_ball_is_found_from_its_approach():
    """The approach under a load is that of Hertz for a known radius."""
    body, grid = jc.LayeredHalfSpace([], jc.Elastic(1e6, nu=0.5)), jc.Grid.square(48, 4e-3)
    wanted, load = 5e-3, 0.05

    target = (9.0 * load**2 / (16.0 * wanted * 4e6**2)) ** (1.0 / 3.0)  # Hertz with E* = 2 G/(1 - nu) = 4 MPa

    def loss(ball):
        history = jc.indent(body, ball, jc.Load(load), [0.0], grid=grid, save="last")
        return (history.approach[0] / target - 1.0) ** 2, history.status

    found = fitting.minimise(loss, jc.Sphere(3e-3), bounds=jc.Sphere((1e-3, 1e-2)), tolerance=1e-4)
    assert float(found.point.radius) == pytest.approx(wanted, rel=5e-3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"start": 3.0, "bounds": (0.0, 1.0)}, "inside the bounds"),
        ({"start": 0.0}, "expected a scale or bounds"),
        ({"start": {}}, "without any"),
        ({"start": {"a": 1.0, "b": "steel"}}, r"start\['b'\]: expected a number"),
        ({"start": 1.0, "bounds": (2.0, 1.0)}, "low < high"),
        ({"start": {"b": 1.0}, "bounds": {"a": (0.0, 1.0)}}, "a tree like start"),
        ({"start": 1.0, "scale": -1.0}, "expected > 0"),
        ({"start": 1.0, "method": "newton"}, "optax transformation"),
        ({"start": 1.0, "steps": 0}, "at least 1"),
        ({"start": 1.0, "tolerance": 0.0}, "more than 0"),
        ({"start": -1.0}, "finite loss"),
    ],
)
def test_mistakes_are_named(arguments, words):
    with pytest.raises(ValueError, match=words):
        fitting.minimise(lambda x: jnp.log(x), **arguments)


def test_the_history_is_drawn_and_printed():
    found = fitting.minimise(rosenbrock, START, steps=5)
    assert "not converged: stopped after 5 steps" in str(found)
    panels = found.plot().axes
    assert [panel.get_yscale() for panel in panels] == ["log", "log"]
    np.testing.assert_array_equal(panels[0].lines[0].get_ydata(), found.values)


@pytest.mark.parametrize(
    "changed",
    [
        {"bounds": (0.0, 4.0)},
        {"bounds": (0.5, 1.5)},
        {"loss": lambda x: (x - 1.25) ** 2 + 5.0 * (x - 1.0) ** 2},
    ],
    ids=["wider bounds", "narrower bounds", "another loss"],
)
def test_a_state_is_not_that_of_another_loss_or_of_other_bounds(tmp_path, changed):
    """The two searches have the same start, at the same coordinate, with the same loss there."""
    given = {
        "loss": lambda x: (x - 1.25) ** 2,
        "start": 1.0,
        "bounds": (0.0, 2.0),
        "state": tmp_path / "s.npz",
    }
    fitting.minimise(**given)
    with pytest.raises(ValueError, match="another loss or other bounds"):
        fitting.minimise(**given | changed)


def test_a_truncated_state_and_a_loss_of_several_numbers_are_named(tmp_path):
    path = tmp_path / "s.npz"
    fitting.minimise(rosenbrock, START, steps=3, state=path)
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(ValueError, match="is damaged, or not the state of a search"):
        fitting.minimise(rosenbrock, START, state=path)
    with pytest.raises(ValueError, match=r"loss: expected one number, got shape \(4,\)"):
        fitting.minimise(lambda p: p["x"] ** 2, START)


@pytest.mark.parametrize("unit", [1e-20, 1e-30, 1e-60])
def test_the_unit_of_the_loss_does_not_matter(unit):
    """Squares of displacements in metres; no step was taken from a gradient of 1e-29, and the search said it converged."""
    found = fitting.minimise(lambda p: unit * jnp.sum((p - 2.0) ** 2), jnp.array([1.0, 10.0]))
    assert found.converged
    np.testing.assert_allclose(found.point, 2.0, rtol=1e-4)


def test_a_start_at_a_maximum_or_a_saddle_is_left():
    """cos x from 0, whose minimum is at pi, and x^2 - y^2 + y^4, whose minima are at y^2 = 1/2."""
    found = fitting.minimise(lambda p: jnp.cos(p["x"]), {"x": 0.0}, scale=1.0)
    assert found.converged and found.value == pytest.approx(-1.0, abs=1e-8)
    saddle = lambda p: p["x"] ** 2 - p["y"] ** 2 + p["y"] ** 4
    found = fitting.minimise(saddle, {"x": 0.0, "y": 0.0}, scale=1.0)
    assert found.converged and found.value == pytest.approx(-0.25, abs=1e-8)
    assert fitting.minimise(lambda p: p["x"] ** 2, {"x": 0.0}, scale=1.0).value == 0.0
