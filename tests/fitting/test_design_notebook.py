"""The designs of notebook 17: the cells as they are in the notebook, against simulations and finer grids."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

NOTEBOOK = Path(__file__).parents[2] / "notebooks" / "17_inverse_design.ipynb"
CELLS = {cell["id"]: "".join(cell["source"]) for cell in json.loads(NOTEBOOK.read_text())["cells"]}
RECIPES = [name for name in CELLS if name.endswith("-design")]


def design(name):
    """Run the first cell and that of a design, and return their variables."""
    variables = {}
    exec(CELLS["d17-head"].replace("%matplotlib inline", ""), variables)
    exec(CELLS[f"d17-{name}-design"], variables)
    return variables


@pytest.mark.parametrize("name", RECIPES)
def test_a_recipe_has_at_most_25_lines(name):
    assert len([line for line in CELLS[name].splitlines() if line.strip()]) <= 25


def creep_depth(values, times, load, radius, nu):
    """Depth of a rigid flat punch of a given radius under steps of the load: Johnson, Contact Mechanics, Eq. (3.36),
    with J(t)/2 in place of 1/(2 G)."""
    G1, G2, eta1, eta2 = values
    creep = lambda t: (
        1.0 / G1 + (1.0 - np.exp(-np.maximum(t, 0.0) * G2 / eta2)) / G2 + np.maximum(t, 0.0) / eta1
    )
    depth = np.zeros_like(times)
    for begin, step in zip(
        np.append(0.0, 0.5 * (times[1:] + times[:-1])), np.diff(load, prepend=0.0), strict=True
    ):
        depth += step * creep(times - begin) * (times >= begin)
    return depth * (1.0 - nu) / (4.0 * radius)


@pytest.mark.long
def test_the_designed_load_history_shortens_the_intervals_of_simulated_tests():
    """200 simulated tests each, fitted by scipy: the standard deviations of log eta1 and log eta2 are those predicted, the
    95 % intervals hold, and those of a constant hold are at least 1.5 times longer."""
    d = design("d")
    truth = np.log([d["film"].G1, d["film"].G2, d["film"].eta1, d["film"].eta2])
    times, rng, scatter = np.asarray(d["times"]), np.random.default_rng(8), []
    for at_knots in (d["hold"], d["found"].point):
        load = np.interp(times, d["knots"], at_knots)
        model = lambda logs, load=load: creep_depth(np.exp(logs), times, load, d["punch"], d["film"].nu)
        predicted, errors = np.asarray(d["deviations"](at_knots)), []
        for _ in range(200):
            noisy = model(truth) + d["noise"] * rng.standard_normal(times.size)
            solved = least_squares(lambda logs: (model(logs) - noisy) / d["noise"], truth, method="lm")  # noqa: B023
            errors.append(solved.x - truth)
        within = np.mean(np.abs(errors) < 1.96 * predicted, axis=0)
        assert np.all((within > 0.90) & (within < 0.99))
        scatter.append(np.std(errors, axis=0))
    assert np.all(scatter[0][2:] > 1.5 * scatter[1][2:])


@pytest.mark.long
def test_the_designed_film_has_a_uniform_pressure_on_a_finer_grid():
    b = design("b")
    history = b["under_ball"](b["found"].point, b["finer"])
    inside = np.hypot(*map(np.asarray, b["finer"].coordinates())) < b["middle"]
    p = np.asarray(history.pressure[0])[inside]
    assert int(history.status[0]) == 0
    assert np.std(p) < 0.01 * np.mean(p)


@pytest.mark.long
def test_the_designed_indenter_has_the_wanted_pressure_on_a_finer_grid():
    """1 % of the root mean square; and the load, which is that of the wanted pressure in closed form,
    pi a b peak (2/3 + 2/15)."""
    e = design("e")
    p, fine = np.asarray(e["pressed"](e["found"].point, e["fine"]).pressure[0]), e["fine"]
    x, y = (np.asarray(axis) for axis in fine.coordinates())
    s = (x / e["a"]) ** 2 + (y / e["b"]) ** 2
    wanted = e["peak"] * np.sqrt(np.maximum(1.0 - s, 0.0)) * (1.0 + 0.5 * s)
    assert np.sqrt(np.sum((p - wanted) ** 2) / np.sum(wanted**2)) < 0.01
    load = np.pi * e["a"] * e["b"] * e["peak"] * (2.0 / 3.0 + 2.0 / 15.0)
    assert np.sum(p) * float(fine.cell_area) == pytest.approx(load, rel=2e-3)


@pytest.mark.long
def test_the_designed_surface_follows_the_law_on_a_finer_grid():
    a = design("a")
    loads = a["more_loads"]
    area, status = a["areas"](a["found"].point, 2 * a["cells"], loads)
    wanted = 0.3 * a["side"] ** 2 * (loads / loads[-1]) ** 0.8
    assert np.max(status) == 0
    assert np.max(np.abs(area / wanted - 1.0)) < 0.05


@pytest.mark.long
def test_the_graded_film_has_the_wanted_largest_stress_on_a_finer_grid():
    """At depths between the interfaces as well; 1 % of the wanted stress."""
    c = design("c")
    deep = np.sort(np.append(c["thick"] * np.linspace(0.25, 1.5, 26), c["sides"]))
    inside, status = c["stresses"](c["found"].point, c["twice"], deep)
    assert np.max(status) == 0
    assert np.max(inside.von_mises) == pytest.approx(float(c["wanted"]), rel=0.01)
    before = np.max(c["stresses"](c["uniform"], c["twice"], deep)[0].von_mises)
    assert np.max(inside.von_mises) < 0.68 * before
