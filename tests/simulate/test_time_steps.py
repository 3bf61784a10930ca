"""The estimate of the error of the time steps, its note and status, and the automatic number of substeps."""

import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.response.stack import surface_creep
from jaxcontact.shell.advice import foretold_step_error
from tests.support.time_steps import (
    BALL,
    cases,
    half_space,
    largest_error,
    reference,
    solid,
    swaying_case,
    true_error,
)

TEN = half_space(solid(10.0))
SMALL = jc.Grid.square(n=16, width=200e-6)
pytestmark = pytest.mark.filterwarnings("ignore:only .* cells across")
QUIET = pytest.mark.filterwarnings("ignore:.*steps, the first", "ignore:.*time steps have an estimated error")
HEAT = "ignore:.*steps, the first", "ignore:.*time steps have", "ignore:.*film strain"


def relaxed(times, grid=SMALL, **more):
    """Return the load on the half-space at a constant approach, and the exact one: G(t)/G(0) of the load at first."""
    run = jc.indent(TEN, BALL, jc.Approach(1e-6), times, grid=grid, **more)
    t = np.asarray(times)
    return run, run.load[0] * (0.1 + 0.9 * np.exp(-10.0 * t))  # 1/G(t): 1 + 9 (1 - exp(-t)) in 1/G(0)


@pytest.mark.slow
@QUIET
@pytest.mark.parametrize("times, status", [([0.0, 10.0], [0, 12]), ([0.0, 100.0], [0, 0])])
def test_a_relaxation_in_a_single_step_knows_its_error(times, status):
    """89 % after ten retardation times, 8 % after a hundred; the load is exact in closed form."""
    run, exact = relaxed(times)
    off = 1.0 - float(run.load[-1] / exact[-1])
    assert off == pytest.approx({10.0: 0.89, 100.0: 0.082}[times[-1]], abs=0.01)
    assert run.status.tolist() == status
    assert off / 2.0 < run.time_step_error[-1] < 2.0 * off


@pytest.mark.slow
@QUIET
def test_an_error_that_the_body_has_forgotten_has_no_status():
    run, exact = relaxed([0.0, 3.0, 10.0, 100.0])
    assert run.status.tolist() == [0, 12, 12, 0]
    assert abs(float(run.load[-1] / exact[-1]) - 1.0) < 2e-3 and run.time_step_error[-1] < 0.01


def test_a_note_above_one_per_cent():
    with pytest.warns(
        UserWarning, match='time steps have an estimated error of 8.* % of the pressure.*substeps="auto"'
    ):
        relaxed([0.0, 100.0])


@pytest.mark.slow
def test_automatic_substeps_of_a_relaxation():
    run, exact = relaxed([0.0, 0.3, 1.0], substeps="auto")
    assert np.all(run.converged) and run.diagnostics.refined in (4, 16) and not run.notes
    np.testing.assert_allclose(run.load, exact, rtol=0.01)
    elastic = jc.indent(
        half_space(jc.Elastic(1e9, 0.3)), BALL, jc.Approach(1e-6), [0.0, 9.0], grid=SMALL, substeps="auto"
    )
    assert elastic.diagnostics.refined == 1 and not np.any(elastic.time_step_error)


def test_automatic_substeps_that_do_not_suffice_have_a_note(monkeypatch):
    monkeypatch.setattr("jaxcontact.simulate.run.REFINED", (1,))
    with pytest.warns(
        UserWarning, match='estimated error of 8.* % of the pressure.*"auto" has no smaller ones'
    ):
        relaxed([0.0, 100.0], substeps="auto")


@pytest.mark.slow
def test_automatic_substeps_say_what_they_cannot_judge():
    """A thickness that is given over time has an effect of its own, which the estimate leaves out."""
    layer = jc.Layer(jc.Elastic(1e9, 0.3), thickness=np.array([20e-6, 10e-6]))
    body = jc.LayeredHalfSpace([layer], jc.Elastic(80e9, 0.3))
    with pytest.warns(UserWarning, match="1 substeps without an estimate of a part of their error"):
        jc.indent(body, BALL, jc.Load(1.0), [0.0, 1.0], grid=SMALL, substeps="auto")


@pytest.mark.slow
@QUIET
@pytest.mark.parametrize("steps", [0.1, 0.5])
def test_a_load_from_zero_knows_the_error_of_its_first_step(steps):
    """The peak pressure of a ball on a Maxwell half-space, of the modulus G and the time 1 s, under a load that grows
    in proportion to time, in closed form: the sum over the growing contact of G(t - s) 4/(pi (1 - nu) R) da/ds, with
    a^3 as t + t^2/2. The time step is much shorter than the time in which the pressure relaxes.
    """
    modulus, radius = 1e9, 5e-3
    half = half_space(jc.Maxwell(modulus, modulus, 0.3))
    times, t = np.array([0.0, steps]), np.linspace(0.0, steps ** (1 / 3), 4001) ** 3  # even in a at first
    load = 8 / 3 * modulus * (60e-6) ** 3 / (0.7 * radius) / (steps + steps**2 / 2.0)  # per second
    run = jc.indent(half, BALL, jc.Load(load * times), times, grid=jc.Grid.square(n=47, width=150e-6))
    edge = (3 / 8 * 0.7 * radius / modulus * load * (t + t**2 / 2.0)) ** (1 / 3)
    left = np.exp(-(steps - (t[1:] + t[:-1]) / 2.0))
    exact = 4.0 * modulus / (np.pi * 0.7 * radius) * np.sum(left * np.diff(edge))
    once = jc.indent(
        half_space(jc.Elastic(modulus, 0.3)),
        BALL,
        jc.Load(8 / 3 * modulus * (60e-6) ** 3 / 0.7 / radius),
        [0.0],
        grid=jc.Grid.square(n=47, width=150e-6),
    )
    of_grid = float(once.peak_pressure[0]) / (4.0 * modulus * 60e-6 / (np.pi * 0.7 * radius))
    off = abs(float(run.peak_pressure[1]) / of_grid / exact - 1.0)
    assert off / 2.0 < run.time_step_error[1] < 2.0 * off


@pytest.mark.slow
@QUIET
def test_shear_and_slide_know_the_error_of_a_relaxation():
    """As the same relaxation in ``indent``: without tangential load, and at a speed that moves the contact by nothing."""
    given = BALL, jc.Approach(1e-6), [0.0, 10.0]
    indented = jc.indent(TEN, *given, grid=SMALL)
    sheared = jc.shear(
        TEN, *given[:2], jc.TangentialLoad([0.0, 0.0]), given[2], friction=0.3, grid=SMALL, coupled=False
    )
    slid = jc.slide(TEN, *given, velocity=1e-12, grid=SMALL)
    for run in (sheared, slid):
        np.testing.assert_allclose(run.time_step_error, indented.time_step_error, rtol=1e-3)
        assert run.status.tolist() == [0, 12]


@pytest.mark.slow
@QUIET
@pytest.mark.filterwarnings("ignore:the length or radius of the indenter")
def test_a_held_tangential_displacement_relaxes_in_the_estimate_too():
    """A punch under a constant load, whose pressure is constant, and a displacement that is held: the tangential load
    decays as G(t)/G(0) = (1 + exp(-2 t))/2.
    """
    push = jc.TangentialDisplacement([1e-8, 0.0])
    body = half_space(jc.StandardLinearSolid(1e9, 1e9, 1e9, 0.3))
    punch, times = jc.FlatPunch(60e-6), [0.0, 1.0]
    run = jc.shear(body, punch, jc.Load(1.0), push, times, friction=0.9, grid=SMALL, coupled=False)
    exact = (1.0 + np.exp(-2.0)) / 2.0
    off = abs(float(run.tangential_load[-1, 0] / run.tangential_load[0, 0]) / exact - 1.0)
    assert off > 0.03 and off / 1.5 < run.time_step_error[-1] < 2.0 * off


PRONY = half_space(jc.Springpot(V=400.0, alpha=0.3, nu=0.5).prony(1.0, 100.0))


@pytest.mark.slow
@QUIET
@pytest.mark.parametrize("body, radius, load, width, times", [
    pytest.param(PRONY, 1e-3, 1e-5, 600e-6, [0.0, 1.0, 10.0, 100.0], marks=pytest.mark.long),
    (TEN, 5e-3, [0.02, 0.05, 0.2], 300e-6, [0.0, 0.3, 0.6]),
], ids=["constant load", "load that grows"])  # fmt: skip
def test_the_largest_error_of_the_pressure_under_a_load(body, radius, load, width, times):
    """The error is local: the centre and the edge differ in its sign. A constant load, and one that grows several-fold in a
    step, on bodies that soften about tenfold.
    """
    ball, grid = jc.Sphere(radius), jc.Grid.square(n=24, width=width)
    run = lambda substeps: jc.indent(body, ball, jc.Load(load), times, grid=grid, substeps=substeps)
    fine = run(32)
    for substeps in (1, 2):
        coarse = run(substeps)
        off = np.max(np.abs(coarse.pressure - fine.pressure), (1, 2)) / fine.peak_pressure
        assert np.max(off) / 1.2 < np.max(coarse.time_step_error) < 3.0 * np.max(off)


@pytest.mark.slow
@QUIET
def test_the_foretold_error_is_that_of_a_relaxation_in_closed_form():
    t = np.array([0.0, 0.1, 0.3, 1.0])
    creep = surface_creep(solid(10.0))
    run, exact = relaxed(t, substeps=2)
    off = np.max(np.abs(run.load / exact - 1.0))
    assert foretold_step_error(creep, t, np.full(4, 1e-6), False, 2) == pytest.approx(float(off), rel=0.02)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "index", [9, *(pytest.param(i, marks=pytest.mark.long) for i in (5, 14, 15, 25, 26))]
)
def test_the_estimate_is_within_a_factor_of_three(index):
    case = list(cases())[index]
    coarse = case.run()
    true, found = true_error(coarse, reference(case)), float(np.max(coarse.time_step_error))
    assert true / 3.0 < found < 3.0 * true
    if true < 0.03:
        assert not np.any(coarse.status == jc.Status.STEP_TOO_LONG)


@pytest.mark.long
@pytest.mark.filterwarnings(*HEAT)
def test_automatic_substeps_of_a_film_that_friction_warms():
    """The temperature turns between the times of a Maxwell film, whose times it changes by a factor of a hundred."""
    film = jc.Layer(jc.Maxwell(G=5e8, eta=2e13, nu=0.3), thickness=40e-6)
    body = jc.LayeredHalfSpace([film], substrate=jc.Elastic.from_young(210e9))
    times = np.linspace(0.0, 400.0, 9)
    speed = np.interp(times, [0.0, 200.0, 400.0], [0.0, 0.3, 0.05])
    heat = jc.Thermal(ambient=350.0, conductivity=1.0, share=0.5, shift=jc.ArrheniusShift(1.5e-19, 350.0))
    grid, velocity = jc.Grid.square(n=24, width=900e-6), np.stack([speed, 0.0 * speed], -1)
    given = body, jc.Sphere(10e-3), jc.Load(2.0), times
    run = lambda substeps: jc.rub(
        *given, velocity=velocity, law=None, grid=grid, friction=0.3, thermal=heat, substeps=substeps
    )
    fine, once, found = run(128), run(1), run("auto")
    off = lambda history: float(np.max(np.abs(history.peak_pressure / fine.peak_pressure - 1.0)))
    assert off(once) > 0.05 and np.max(once.time_step_error) > 0.03
    assert found.diagnostics.refined >= 4 and off(found) < 0.015


@pytest.mark.long
@QUIET
@pytest.mark.parametrize("seed", [5, 16, 21])
def test_the_estimate_includes_a_velocity_that_changes_within_a_step(seed):
    """A sine, a random course and a start, with 3 to 22 % of error; the reference has 16 steps in the place of each."""
    case = swaying_case(seed)
    run = case.run()
    error = largest_error(run, case.run(substeps=16))
    assert 0.5 * error < np.max(run.time_step_error) < 2.0 * error
    assert np.any(run.status == 12) == (seed == 16)


@pytest.mark.long
@QUIET
def test_a_velocity_that_reverses_within_a_step():
    """Half a radius of contact forth and back within a step: what the march takes for rest is named."""
    velocity = np.array([[60e-6, 0.0], [60e-6, 0.0], [-60e-6, 0.0]])
    grid = jc.Grid.square(n=24, width=300e-6)
    slid = lambda substeps: jc.slide(
        half_space(solid(10.0)),
        BALL,
        jc.Load(0.2),
        [0.0, 1.0, 3.0],
        velocity=velocity,
        grid=grid,
        substeps=substeps,
    )
    run = slid(1)
    error = largest_error(run, slid(32))
    assert error > 0.2 and run.status[-1] == 12 and np.max(run.time_step_error) > 0.7 * error


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the length or radius of the indenter")
def test_a_punch_pressed_from_zero_on_a_solid_that_is_rigid_at_first():
    """All its pressures are in proportion to the load, which is linear in time: the march is exact in one step. Of the
    approaches, (1 - nu)/(4 a) J * dP for both solids, the ratio is free of the grid.
    """
    solid, steel = jc.KelvinVoigt(1e9, 10e9, 0.4), jc.Elastic(80e9, 0.3)
    times, load = np.array([0.0, 8.0, 20.0]), np.array([0.0, 0.2, 0.25])
    run = jc.indent(half_space(solid), jc.FlatPunch(60e-6, steel), jc.Load(load), times, grid=SMALL)
    ramp = lambda t: np.maximum(t, 0.0) + 10.0 * np.expm1(-np.maximum(t, 0.0) / 10.0)
    crept = 0.6 / 1e9 * (0.2 / 8.0 * ramp(times) + (0.05 / 12.0 - 0.2 / 8.0) * ramp(times - 8.0))
    exact = crept + 0.7 / 80e9 * load
    assert run.approach[2] / run.approach[1] == pytest.approx(exact[2] / exact[1], rel=1e-9)
    assert np.all(run.converged) and np.max(run.time_step_error) < 1e-6
