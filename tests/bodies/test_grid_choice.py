"""Grids that are chosen for the user: around the expected contact, and wider when the contact outgrows them."""

import warnings

import jax
import numpy as np
import pytest
from bodies import FILM, GLASS, STEEL

import jaxcontact as jc
from jaxcontact.indenters.shapes import ROLLER_END_FACTOR
from jaxcontact.simulate import indent

BALL = jc.Sphere(5e-3)


def small(*given):
    return AROUND(*given, n=48)


AROUND = jc.Grid.around


@pytest.mark.parametrize("periodic", [False, True, (True, False)])
def test_a_square_is_the_grid_of_its_cells(periodic):
    assert jc.Grid.square(8, 4e-6, periodic=periodic) == jc.Grid((8, 8), (5e-7, 5e-7), periodic)


FILMS = [(nu, h) for nu in (0.3, 0.45, 0.49) for h in (4e-7, 1e-5, 1e-4, 1.3e-3)]


@pytest.mark.filterwarnings("ignore:film strain", "ignore:only")
@pytest.mark.parametrize(
    "control",
    [jc.Load(2.0), jc.Approach(1e-6)],
    ids=["load", "approach"],
)
@pytest.mark.slow
def test_a_grid_around_a_film_of_any_thickness_holds_its_contact_and_not_much_more(control):
    """Thicknesses of 0.01 to 10 contact radii, solved; a film that nearly keeps its volume moves aside."""
    thickest, thinnest = 0.0, np.inf
    for nu, h in FILMS:
        body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9, nu), h)], STEEL)
        ball = jc.Sphere(5e-3, STEEL)
        grid = jc.Grid.around(body, ball, control, [0.0], n=32)
        solved = jc.indent(
            body, ball, control, [0.0], grid=grid, kernels=jc.kernels(body, ball, grid, nodes=6), save="last"
        )
        radius = float(solved.contact_radius[0])
        thickest, thinnest = max(thickest, h / radius), min(thinnest, h / radius)
        assert int(solved.status[0]) == 0, (nu, h)
        assert 0.1 < 2.0 * radius / float(grid.width[0]) < 0.6, (nu, h)
    assert thinnest < 0.011 and thickest > 9.0


MELT = jc.Maxwell(1e9, 1e11)
INDENTERS = {
    "ball": jc.Sphere(5e-3, STEEL),
    "cone": jc.Cone(np.radians(85.0), STEEL),
    "roller": jc.Cylinder(5e-3, 2e-3, STEEL),
    "punch": jc.FlatPunch(5e-4, STEEL),
}
BODIES = {
    "half-space": (jc.LayeredHalfSpace([], jc.Elastic(1e9)), [0.0]),
    "the paper's film": (jc.LayeredHalfSpace([jc.Layer(FILM, 150e-9)], STEEL), [0.0, 600.0, 7200.0]),
    "thick film": (jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e8), 1e-3)], STEEL), [0.0]),
    "film that keeps its volume": (
        jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e7, 0.49), 2e-5)], STEEL),
        [0.0],
    ),
    "stiff coating": (jc.LayeredHalfSpace([jc.Layer(jc.Elastic(8e10), 2e-5)], jc.Elastic(1e9)), [0.0]),
    "layer on a melt": (jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9), 1e-4)], MELT), [0.0, 100.0, 2000.0]),
}


def half_widths(name, indenter, control):
    body, times = BODIES[name]
    return INDENTERS[indenter].half_widths(body, control, np.array(times))


@pytest.mark.slow
def test_the_contact_of_a_cone_and_of_a_roller_is_foretold():
    """Against Sneddon's cone, Hertz's line contact, and both on a bed of springs as soft as the film after two hours."""
    slope, W = np.tan(np.radians(85.0)), 5.0
    compliance = 0.7e-9 + float(INDENTERS["cone"].compliance())
    springs = float(FILM.creep(7200.0)) * 0.4 / 1.4 * 150e-9
    load, approach = jc.Load(W), jc.Approach(1e-6)
    rollers = {
        ("half-space", load): np.sqrt(2.0 * W / 2e-3 * 5e-3 * compliance / np.pi),
        ("the paper's film", load): (1.5 * W / 2e-3 * 5e-3 * springs) ** (1.0 / 3.0),
    }
    for (name, control), radius in rollers.items():
        found = half_widths(name, "roller", control)[0]
        assert found == pytest.approx(ROLLER_END_FACTOR * radius, rel=0.05), name
    cones = {load: np.sqrt(W * compliance * slope / np.pi), approach: 2e-6 * slope / np.pi}
    for control, radius in cones.items():
        assert half_widths("half-space", "cone", control)[0] == pytest.approx(radius, rel=0.02), control
    # on steel, the contact of a steel cone is 4 % wider
    film = jc.LayeredHalfSpace([jc.Layer(FILM, 150e-9)], jc.Elastic(1e15))
    found = jc.Cone(np.radians(85.0)).half_widths(film, load, np.array([0.0, 7200.0]))[0]
    assert found == pytest.approx((3.0 * W * springs * slope / np.pi) ** (1.0 / 3.0), rel=0.02)
    rigid_at_first = jc.LayeredHalfSpace([jc.Layer(jc.KelvinVoigt(1e6, 1e7, 0.3), 1e-5)], STEEL)
    point = jc.Cone(np.radians(85.0)).half_widths(rigid_at_first, load, np.array([0.0]))[0]
    assert 0.0 < point < cones[load]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("control", [jc.Load(5.0), jc.Approach(1e-6)], ids=["load", "approach"])
@pytest.mark.parametrize("indenter", INDENTERS)
@pytest.mark.parametrize("name", BODIES)
def test_every_contact_fits_its_grid_and_fills_a_good_part_of_it(name, indenter, control):
    """Solved on 32 x 32 cells: never at the edge, and 10 to 60 % of the width along x and along y."""
    body, times = BODIES[name]
    grid = AROUND(body, INDENTERS[indenter], control, times, n=32)
    solved = jc.indent(body, INDENTERS[indenter], control, times, grid=grid, tolerance=1e-6)
    assert jc.Status.AT_EDGE not in np.asarray(solved.status).tolist()
    touches = np.any(np.asarray(solved.pressure) > 0.0, 0)
    for axis in (0, 1):
        assert 0.1 < np.mean(np.any(touches, axis)) < 0.6


@pytest.mark.parametrize("control", [jc.Load(2.0), jc.Approach(1e-6)], ids=["load", "approach"])
def test_the_grid_around_a_film_that_grows_is_that_around_the_thickest(control):
    width = lambda h: jc.Grid.around(
        jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9, 0.4), h)], STEEL), jc.Sphere(5e-3), control, [0.0, 1.0]
    ).width[0]
    assert width(np.array([1e-6, 5e-6])) == width(5e-6)


@pytest.mark.slow
def test_a_grid_of_its_own_holds_the_contact(monkeypatch):
    """The ball's estimate is good: no widening, and Hertz's approach."""
    monkeypatch.setattr(jc.Grid, "around", small)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        history = jc.indent(GLASS, BALL, jc.Load(20.0), [0.0], grid="auto")
    assert float(history.approach[0]) == pytest.approx(1.919e-6, rel=2e-3)


@pytest.mark.slow
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
    assert float(history.grid.width[0]) == pytest.approx(10e-6 * indent.WIDER**4)


@pytest.mark.parametrize("transform", [jax.vmap, jax.jit])
def test_traced_values_have_no_width(transform):
    """Neither ``Grid.around`` nor "auto" can choose by numbers that are not there yet."""
    loads = np.array([10.0, 20.0])
    around = lambda load: jc.Grid.around(GLASS, BALL, jc.Load(load), [0.0]).spacing[0]
    with pytest.raises(ValueError, match="expected known values"):
        transform(around)(loads)
    auto = lambda load: jc.indent(GLASS, BALL, jc.Load(load), [0.0], grid="auto").approach
    with pytest.raises(ValueError, match="expected a Grid inside jit"):
        transform(auto)(loads[0] if transform is jax.jit else loads)


def test_a_height_field_has_its_own_grid():
    with pytest.raises(ValueError, match="a HeightField defines its own grid; expected Grid"):
        jc.indent(GLASS, jc.HeightField(np.zeros((8, 8))), jc.Load(1.0), [0.0], grid="auto")
