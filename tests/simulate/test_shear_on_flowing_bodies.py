"""Verbs with friction on bodies that flow: a layer on its own material is a half-space, and what is off is told."""

import numpy as np
import pytest

import jaxcontact as jc

MAXWELL = jc.Maxwell(G=1e9, eta=1e9, nu=0.4)
GRID, BALL, LOAD = jc.Grid.square(16, 400e-6), jc.Sphere(5e-3), jc.Load(0.5)
BODIES = [jc.LayeredHalfSpace([], MAXWELL), jc.LayeredHalfSpace([jc.Layer(MAXWELL, 2e-5)], MAXWELL)]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_shear_of_a_layer_on_its_own_material():
    times, push = [0.0, 0.3, 0.6], jc.TangentialLoad([[0.0, 0.0], [0.05, 0.0], [0.1, 0.02]])
    plain, layered = (jc.shear(b, BALL, LOAD, push, times, friction=0.5, grid=GRID) for b in BODIES)
    assert not np.any(layered.status) and not np.any(plain.status)
    size = np.max(np.abs(plain.tangential_displacement))
    np.testing.assert_allclose(
        layered.tangential_displacement, plain.tangential_displacement, atol=1e-4 * size
    )
    np.testing.assert_allclose(layered.approach, plain.approach, rtol=1e-4)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_shear_beyond_the_latest_time_of_the_response_is_told():
    """An elastic layer on a Maxwell substrate, before and after the horizon of its response."""
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9), 2e-5)], MAXWELL)
    shift = jc.TangentialDisplacement([[0.0, 0.0], [1e-8, 0.0], [1e-8, 0.0]])
    # under a load the contact would outgrow the grid first, which has a status of its own
    approach = jc.Approach(2e-6)
    status = jc.shear(body, BALL, approach, shift, [0.0, 0.1, 1e5], friction=0.5, grid=GRID).status
    assert int(status[1]) == 0 and int(status[2]) == jc.Status.NOT_RESOLVED


FAST = 1e3  # m/s: a crossing takes 4e-7 of the relaxation time
GLASS = jc.LayeredHalfSpace([], jc.Elastic(1e9, nu=0.4))
MU = 0.5


def steady(body, velocity, grid=GRID):
    return jc.slide_steady(body, BALL, LOAD, velocity=velocity, friction=MU, grid=grid)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_steady_sliding_with_friction_of_a_layer_on_its_own_material():
    """Where the material relaxes by a third in a crossing; the force exceeds Coulomb's by that of hysteresis."""
    plain, layered = (steady(body, 1e-4) for body in BODIES)
    for name in ("pressure", "approach", "tangential_force", "hysteresis_force", "approach_drift"):
        ours, exact = (np.asarray(getattr(state, name)) for state in (layered, plain))
        np.testing.assert_allclose(ours, exact, atol=1e-5 * np.max(np.abs(exact)), err_msg=name)
    assert float(plain.hysteresis_force) > 0.01 * MU * 0.5
    assert not int(plain.status) and not int(layered.status)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_fast_steady_sliding_with_friction_is_that_of_an_elastic_body():
    """Of the modulus at once, under the traction mu p, which moves the pressure; also of an elastic layer on a fluid."""
    grid = jc.Grid.square(24, 400e-6)
    elastic = steady(GLASS, 1.0, grid)
    on_fluid = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9, nu=0.4), 2e-5)], MAXWELL)
    for body in (*BODIES, on_fluid):
        fast = steady(body, FAST, grid)
        np.testing.assert_allclose(fast.pressure, elastic.pressure, atol=1e-5 * np.max(elastic.pressure))
        np.testing.assert_allclose(fast.approach, elastic.approach, rtol=1e-5)
        np.testing.assert_allclose(fast.tangential_force, MU * 0.5, rtol=1e-4)
    offset = np.asarray(elastic.pressure - elastic.pressure[::-1])
    # what friction does to the pressure is not lost here
    assert np.max(offset) > 0.01 * np.max(elastic.pressure)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_sliding_with_friction_of_a_layer_on_its_own_material():
    times = [0.0, 0.1, 0.4]
    slid = lambda body: jc.slide(body, BALL, LOAD, times, velocity=2e-5, friction=MU, grid=GRID)
    plain, layered = (slid(body) for body in BODIES)
    assert not np.any(layered.status) and not np.any(plain.status)
    for name in ("pressure", "approach", "tangential_force"):
        ours, exact = (np.asarray(getattr(history, name)) for history in (layered, plain))
        np.testing.assert_allclose(ours, exact, atol=1e-4 * np.max(np.abs(exact)), err_msg=name)
    elastic = jc.slide(GLASS, BALL, LOAD, times, velocity=2e-5, friction=MU, grid=GRID)
    np.testing.assert_allclose(plain.approach[0], elastic.approach[0], rtol=1e-6)
    assert float(plain.approach[-1]) > 1.2 * float(elastic.approach[-1])


def rolled(body, velocity):
    creepage = (3e-3, 0.0)
    return jc.roll_steady(body, BALL, LOAD, velocity=velocity, creepage=creepage, friction=MU, grid=GRID)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_rolling_on_a_layer_on_its_own_material():
    """Slow enough for the material to relax in the contact, and so fast that it is elastic."""
    for velocity in (1e-4, FAST):
        plain, layered = (rolled(body, velocity) for body in BODIES)
        assert not int(plain.status) and not int(layered.status)
        for name in ("traction", "pressure", "tangential_load"):
            ours, exact = (np.asarray(getattr(state, name)) for state in (layered, plain))
            np.testing.assert_allclose(ours, exact, atol=1e-4 * np.max(np.abs(exact)), err_msg=name)
    elastic = rolled(GLASS, 1.0)
    np.testing.assert_allclose(plain.tangential_load, elastic.tangential_load, atol=2e-3 * MU * 0.5)
    np.testing.assert_allclose(plain.approach, elastic.approach, rtol=1e-4)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_an_inaccurate_response_is_told_by_steady_states_with_friction():
    """A plate on an incompressible fluid layer on steel, all far thinner than the contact: it sinks at rates as the sixth
    power of the wavenumber, and images are off by more than 1 % in the end."""
    steel, fluid = jc.Elastic.from_young(210e9, nu=0.3), jc.Maxwell(G=1e9, eta=1e9, nu=0.5)
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(30e9), 1e-6), jc.Layer(fluid, 5e-6)], steel)
    flat, load = jc.Sphere(0.1), jc.Load(2.0)
    more = {"friction": MU, "grid": GRID, "velocity": 1e-4}
    for state in (
        jc.slide_steady(body, flat, load, **more),
        jc.roll_steady(body, flat, load, creepage=(1e-3, 0.0), **more),
    ):
        assert float(state.diagnostics.image_error) > 0.01 and int(state.status) == jc.Status.NOT_RESOLVED
