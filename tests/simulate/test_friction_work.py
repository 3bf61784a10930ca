"""The work of friction in shear: full sliding under a load that changes, and the work of the external force over a cycle."""

import numpy as np
import pytest

import jaxcontact as jc

pytestmark = pytest.mark.filterwarnings("ignore:.*cells across")
MU, STROKE = 0.3, 20e-3
BODY, BALL, GRID = jc.LayeredHalfSpace([], jc.Elastic(1e9, 0.5)), jc.Sphere(10e-3), jc.Grid.square(16, 9e-4)


def sheared(load, place, times, **options):
    to = jc.TangentialDisplacement(np.stack([place, 0.0 * np.asarray(place)], 1))
    history = jc.shear(BODY, BALL, jc.Load(load), to, times, friction=MU, coupled=False, grid=GRID, **options)
    assert np.all(history.status == 0)
    total = float(np.sum(history.friction_work)) * float(GRID.cell_area)
    assert total == pytest.approx(float(history.dissipated[-1]), rel=1e-12)
    assert np.min(history.friction_work) >= 0.0 and np.min(np.diff(history.dissipated)) >= 0.0
    return history


def ramp(steps):
    """Relative error of int mu W dx, W from 2 to 6 N as the square of the way, in some steps; from full sliding on."""
    s = np.minimum(np.arange(max(steps, 2) + 1) / steps, 1.0)  # one step ends twice: one program serves both
    load, place = np.append(2.0, 2.0 + 4.0 * s**2), np.append(0.0, 0.1e-3 + STROKE * s)
    work = np.asarray(sheared(load, place, np.append(0.0, 1.0 + s)).dissipated)
    return (work[-1] - work[1]) / (MU * STROKE * (2.0 + 4.0 / 3.0)) - 1.0


@pytest.mark.slow
def test_full_sliding_under_a_load_that_rises():
    """Second order in the step: 20 % in one step, a quarter of that in two (the slip of the end alone gives 80 and 35 %)."""
    one, two = ramp(1), ramp(2)
    assert one == pytest.approx(0.2, abs=2e-3) and two == pytest.approx(0.05, abs=1e-3)


@pytest.mark.slow
def test_full_sliding_in_small_steps():
    assert ramp(16) == pytest.approx(0.2 / 16**2, abs=3e-4)


@pytest.mark.slow
@pytest.mark.parametrize("substeps", [1, 3])
def test_a_load_that_is_linear_in_the_way_takes_no_substeps(substeps):
    history = sheared(
        [2.0, 2.0, 6.0, 6.0], [0.0, 0.1e-3, STROKE, STROKE], [0.0, 1.0, 2.0, 2.0], substeps=substeps
    )
    work = float(history.dissipated[-1] - history.dissipated[1])
    assert work == pytest.approx(MU * 4.0 * (STROKE - 0.1e-3), rel=1e-3)


@pytest.mark.slow
def test_a_cycle_in_which_load_and_place_change_costs_the_work_of_the_force():
    """On an elastic body without coupling nothing else is left of the work after a cycle; partial slip to full sliding."""
    errors = []
    for n in (12, 24):
        phase = 2.0 * np.pi * np.arange(2 * n + 1) / n
        load, place = 4.0 + 1.5 * np.cos(phase), 2e-6 * np.sin(phase)
        history = sheared(load, place, np.arange(2.0 * n + 1.0), save="last")
        force = np.asarray(history.tangential_load)[n:, 0]
        work = np.sum((force[1:] + force[:-1]) / 2.0 * np.diff(place[n:]))
        spent = float(history.dissipated[-1] - history.dissipated[n])
        print(f"{n} steps a cycle: {spent:.6g} J of {work:.6g} J")
        errors.append(abs(spent / work - 1.0))
    assert errors[0] < 0.05 and errors[1] < 0.4 * errors[0]


@pytest.mark.slow
@pytest.mark.parametrize("mu", [1e3, 1e6])
def test_a_contact_that_sticks_everywhere_dissipates_nothing(mu):
    """Friction that holds everything; the slip that the solver leaves is no slip."""
    force = np.array([0.0, 0.1, 0.2, 0.0, -0.2, 0.0])
    pushed = jc.TangentialLoad(np.stack([force, 0.0 * force], 1))
    history = jc.shear(
        BODY, BALL, jc.Load(2.0), pushed, np.arange(6.0), friction=mu, coupled=False, grid=GRID
    )
    assert np.all(history.status == 0) and np.all(history.stick == (history.pressure > 0.0))
    assert float(history.dissipated[-1]) == 0.0
