"""``indent`` with adhesion: closed forms, layers, unloading after a dwell, separation, notes, derivatives."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from peeling import BALL, NU, RADIUS, UNITS, WORK, E, G, approaching, dugdale, indent

from peeling import peeled, peeled_at_once, retracted, solid  # isort: skip
from scipy.optimize import brentq, minimize_scalar

import jaxcontact as jc
from jaxcontact.contact.adhesive import Attraction
from jaxcontact.reference import abel, maugis

GEL = jc.LayeredHalfSpace([], jc.Elastic(G, NU))


def exponential(tabor, modulus=E):
    return jc.ExponentialAdhesion(WORK, np.cbrt(RADIUS * WORK**2 / modulus**2) / tabor)


def quietly(*arguments, **keywords):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.indent(*arguments, **keywords)


def along(approaches, law, body=GEL, n=64, width=5.0, times=None, **keywords):
    """Loads and radii along approaches, all in units of the closed forms."""
    times = np.arange(len(approaches), dtype=float) if times is None else np.asarray(times)
    grid = jc.Grid.square(n=n, width=width * UNITS.radius)
    control = jc.Approach(np.asarray(approaches) * UNITS.approach)
    return quietly(body, BALL, control, times, grid=grid, adhesion=law, save="last", **keywords)


def test_the_closed_forms_have_the_published_pull_off_loads():
    """Maugis's theory at four parameters, and Johnson, Kendall and Roberts's as its limit, against each other."""
    for parameter, lowest in ((0.1, -1.9506), (0.5, -1.7182), (1.0, -1.6007), (2.0, -1.5346)):
        found = minimize_scalar(
            lambda a, p=parameter: float(maugis.maugis(p, a)[0]), bounds=(0.05, 1.6), method="bounded"
        )
        assert found.fun == pytest.approx(lowest, abs=6e-5)
    a = np.linspace(0.5, 2.0, 4)
    np.testing.assert_allclose(maugis.maugis(200.0, a), maugis.jkr(a), atol=2e-2)
    load, approach = maugis.jkr(np.cbrt(1.5))
    assert (float(load), float(approach)) == pytest.approx((-1.5, -(1.5 ** (2 / 3)) / 3.0))
    assert law_in_units(1.0) == pytest.approx(1.0)


def law_in_units(parameter):
    """The parameter lambda of the strength that belongs to it, from its definition."""
    s = maugis.strength(parameter, WORK, RADIUS, E)
    return 2.0 * s * np.cbrt(RADIUS / (np.pi * WORK * (4.0 * E / 3.0) ** 2))


def test_the_edge_term_of_the_layered_reference_is_that_of_johnson_kendall_and_roberts():
    half_space = abel.Layered(G, NU, 1e-6, G, NU)
    for a in (0.5, 1.0, 1.5):
        found = abel.adhesive_contact(a * UNITS.radius, half_space, RADIUS, WORK)
        wanted = maugis.jkr(a)
        assert found.load / UNITS.load == pytest.approx(float(wanted[0]), abs=1e-12)
        assert found.approach / UNITS.approach == pytest.approx(float(wanted[1]), abs=1e-12)


CASES = {0.1: (9.0, 2), 0.5: (5.6, 3), 1.0: (4.9, 3), 2.0: (4.9, 3)}


@pytest.mark.slow
@pytest.mark.parametrize(
    "parameter", [pytest.param(each, marks=() if each == 0.5 else pytest.mark.long) for each in CASES]
)
def test_the_branch_and_the_pull_off_load_are_those_of_maugis(parameter):
    """256 x 256 cells, under an approach down past the lowest load."""
    width, degree = CASES[parameter]
    of = lambda a: maugis.maugis(parameter, a)
    a_lowest = minimize_scalar(lambda a: float(of(a)[0]), bounds=(0.05, 1.6), method="bounded").x
    lowest, at = map(float, of(a_lowest))
    window = at + np.array([0.2, 0.1, 0.0, -0.1, -0.2])
    approaches = np.concatenate([[1.5, 0.8, 0.2], window])
    law = jc.DugdaleAdhesion(WORK, maugis.strength(parameter, WORK, RADIUS, E))
    found = along(approaches, law, n=256, width=width)
    loads, radii = np.asarray(found.load) / UNITS.load, np.asarray(found.contact_radius) / UNITS.radius
    assert np.all(found.status == jc.Status.FINE) and int(found.jumps[-1]) == 0
    grid = np.linspace(0.01, 2.5, 4000)
    stable = grid[int(np.argmin(of(grid)[1])) :]
    for k, approach in enumerate(approaches):
        if approach < of(stable[0])[1] + 0.02:
            continue  # past the end of the branch with contact
        a = brentq(lambda a, d=approach: float(of(a)[1]) - d, stable[0], 2.5)
        assert abs(loads[k] - float(of(a)[0])) < 0.005 * abs(lowest)
        assert radii[k] == pytest.approx(a, rel=0.005)
    assert loads.min() == pytest.approx(lowest, rel=0.01)
    fit = np.polyfit(window - at, loads[3:], degree)
    roots = np.roots(np.polyder(fit))
    assert np.min(np.abs(roots)) < 0.01  # of the lowest load's approach, which is -0.43 to -0.53


@pytest.mark.slow
@pytest.mark.parametrize(
    "tabor, lowest, tolerance",
    [
        pytest.param(0.05, -2.0, 0.02, id="DMT"),
        pytest.param(5.0, -1.5, 0.02, id="JKR", marks=pytest.mark.long),
    ],
)
def test_the_limits_of_long_and_short_range(tabor, lowest, tolerance):
    if tabor < 1.0:
        found = along(np.linspace(0.0, -0.6, 7), exponential(tabor), n=64, width=36.0)
    else:
        approaches = np.concatenate([[1.0, 0.3], np.linspace(-0.25, -0.75, 9)])
        found = along(approaches, exponential(tabor), n=128, width=4.2)
    assert float(found.load.min()) / UNITS.load == pytest.approx(lowest, rel=tolerance)


@pytest.mark.long
@pytest.mark.parametrize(
    ("ratio", "thickness"),
    [
        (10.0, 3.0),
        *(
            pytest.param(*each, marks=pytest.mark.long)
            for each in ((0.1, 0.3), (0.1, 1.0), (0.1, 3.0), (10.0, 0.3), (10.0, 1.0))
        ),
    ],
)
def test_the_pull_off_load_on_a_film_is_that_of_the_edge_term(ratio, thickness):
    """Films of 0.1 and 10 times the modulus of their base, at a Tabor number of 5 of the film's modulus."""
    layered = abel.Layered(G, NU, thickness * UNITS.radius, G / ratio, 0.3)
    of = lambda a: abel.adhesive_contact(a * UNITS.radius, layered, RADIUS, WORK)
    a = minimize_scalar(lambda a: of(a).load, bounds=(0.2, 3.0), method="bounded").x
    lowest, at = of(a).load / UNITS.load, of(a).approach / UNITS.approach
    reach = of(1.3 * a).approach / UNITS.approach - at
    body = jc.LayeredHalfSpace(
        [jc.Layer(jc.Elastic(G, NU), thickness * UNITS.radius)], jc.Elastic(G / ratio, 0.3)
    )
    approaches = at + reach * np.array([1.0, 0.6, 0.3, 0.1, 0.05, 0.0, -0.05])
    approaches = np.concatenate([[max(approaches[0], 0.2)], approaches])  # begin in contact
    found = along(approaches, exponential(5.0), body, n=128, width=3.6 * a, max_iterations=1000)
    assert np.all(found.status == jc.Status.FINE)
    assert float(found.load.min()) / UNITS.load == pytest.approx(lowest, rel=0.03)


@pytest.mark.long
@pytest.mark.parametrize(
    "stiffening, dwell, law, n",
    [
        pytest.param(3.0, 2.0, exponential(5.0, 3.0 * E), 128, marks=pytest.mark.long),
        (10.0, 4.0, dugdale(4.0), 64),
    ],
)
def test_fast_unloading_after_a_long_dwell_takes_more_load(stiffening, dwell, law, n):
    """Without time to relax; the zone of attraction of the relaxed solid with E0/Einf = 10 is a third of a cell."""
    lowest, at, a1 = peeled_at_once(stiffening, dwell)
    part = np.array([0.3, 0.6, 0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2])
    path = np.concatenate([[dwell, dwell], dwell + (at - dwell) * part])
    times = np.concatenate([[0.0, 1e6], 1e6 + 1e-7 * np.arange(1, part.size + 1)])
    loads, found = indent(solid(stiffening), approaching(path), times, n, 2.6 * a1, law)
    assert np.all(found.status == jc.Status.FINE)
    assert loads.min() == pytest.approx(lowest, rel=0.02)


@pytest.mark.long
def test_retraction_at_a_finite_speed_takes_the_load_of_a_crack_in_a_relaxed_solid():
    """Greenwood's theory of a crack and that of Greenwood and Johnson of its contact, 38 % above JKR."""
    lowest, found = retracted(3.0, 2.0, 1.0, 0.1, 64, 4.5, 120, -1.2)
    assert np.all(found.status == jc.Status.FINE)
    assert lowest == pytest.approx(peeled(3.0, 2.0, 1.0, 0.1), rel=0.02) and lowest < -2.0


@pytest.mark.long
def test_slow_retraction_pulls_off_at_that_of_the_relaxed_modulus():
    approaches = np.array([2.0, 1.0, 0.3, 0.0, -0.2, -0.3, -0.4, -0.5, -0.6])
    times = 1e5 * np.arange(approaches.size)
    grid = jc.Grid.square(n=128, width=5.0 * UNITS.radius)
    control = jc.Approach(approaches * UNITS.approach)
    found = quietly(solid(3.0), BALL, control, times, grid=grid, adhesion=exponential(4.0), save="last")
    assert float(found.load.min()) / UNITS.load == pytest.approx(-1.5, rel=0.02)


@pytest.mark.long
@pytest.mark.parametrize("control", [
    pytest.param(jc.Approach(9.0 * UNITS.approach), marks=pytest.mark.long), jc.Load(20.0 * UNITS.load)
], ids=["approach", "load"])  # fmt: skip
def test_a_vanishing_work_of_adhesion_leaves_the_contact_without_it(control):
    """The search without adhesion is another method. The range reaches beyond the grid, where so weak an attraction does not
    matter. The derivative by the work is that of a contact under a given small traction: the same for every small work."""
    grid = jc.Grid.square(n=24, width=9.0 * UNITS.radius)
    gap = 2.0 * UNITS.approach

    def contact(work):
        law = None if work is None else jc.ExponentialAdhesion(work, gap)
        return quietly(GEL, BALL, control, [0.0], grid=grid, adhesion=law)

    without = contact(None)
    assert int(without.status[0]) == 0
    force = lambda work: contact(work).load[0] + contact(work).approach[0] * UNITS.load / UNITS.approach
    slopes = []
    for part in (1e-6, 1e-10, 1e-16):
        found = contact(part * WORK)
        assert int(found.status[0]) == 0
        largest = float(np.max(without.pressure))
        # a millionth of the work changes the pressure by less than a hundred thousandth, beside the tolerance of 1e-8
        np.testing.assert_allclose(
            found.pressure, without.pressure, atol=1e-5 * max(part * 1e6, 1e-2) * largest
        )
        slopes.append(float(jax.grad(force)(part * WORK)))
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-4)
    assert slopes[1] == pytest.approx(slopes[2], rel=1e-6)
    # an attraction that matters at the edge of the grid is reported there
    assert int(contact(0.1 * WORK).status[0]) == 2


@pytest.mark.long
def test_a_load_below_the_lowest_pulls_off_and_the_result_says_so():
    loads = np.array([0.5, 0.0, -1.0, -1.4, -1.9, -1.9, 0.0, 0.5])
    grid = jc.Grid.square(n=32, width=9.0 * UNITS.radius)
    control = jc.Load(loads * UNITS.load)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = jc.indent(GEL, BALL, control, np.arange(8.0), grid=grid, adhesion=exponential(1.0))
    notes = " ".join(str(one.message) for one in told)
    assert "tensile load" in notes and "the contact jumps in 2 of 8 steps" in notes
    assert "edge of the grid" not in notes
    gone = found.status == jc.Status.PULLED_OFF
    assert np.asarray(gone).tolist() == [False] * 4 + [True] * 3 + [False]
    assert not np.any(found.pressure[4:7]) and not np.any(found.contact_area[4:7])
    np.testing.assert_allclose(found.load[:4], loads[:4] * UNITS.load, atol=1e-6 * UNITS.load)
    assert np.asarray(found.jumps).tolist() == [0, 0, 0, 0, 1, 1, 1, 2]
    assert np.any(found.pressure[2] < 0) and np.any(found.pressure[2] > 0)
    contact = np.asarray(found.gap[2]) < 1e-9 * RADIUS
    assert contact.sum() * grid.cell_area == pytest.approx(float(found.contact_area[2]))


@pytest.mark.long
def test_the_energy_lost_in_a_cycle_on_an_elastic_body_is_that_of_its_jumps():
    """Over approach and retraction in small steps, -int P d(approach); nothing else is lost in an elastic body."""
    approaches = np.concatenate([np.linspace(-1.6, 0.0, 60), np.linspace(0.0, -1.6, 60)[1:]])
    found = along(approaches, exponential(2.0), n=32)
    d, load = np.asarray(found.approach), np.asarray(found.load)
    lost = np.sum((load[1:] + load[:-1]) / 2 * np.diff(d))
    unit = UNITS.load * UNITS.approach
    assert np.all(found.converged) and int(found.jumps[-1]) == 2
    assert 0.05 < lost / unit < 1.0
    assert float(found.jump_energy[-1]) == pytest.approx(lost, abs=0.15 * lost)
    assert np.max(np.abs(found.viscous_energy)) < 1e-4 * lost  # an elastic body


@pytest.mark.long
def test_the_energy_that_a_held_punch_dissipates_is_that_of_a_maxwell_arm():
    """Under a fixed displacement d the load relaxes from P0 to P1 as exp(-t/tau), tau = eta2/(G1 + G2), and 1/2 (P0 - P1) d
    (1 - exp(-2 t/tau)) is lost in the dashpot."""
    first, second, viscosity, depth = 3e6, 1.5e6, 2e6, 20e-9
    times = np.array([0.0, 0.2, 0.5, 1.0, 30.0])
    body = jc.LayeredHalfSpace([], jc.StandardLinearSolid(first, second, viscosity, nu=NU))
    grid = jc.Grid.square(n=24, width=3.0 * UNITS.radius)
    law = jc.ExponentialAdhesion(WORK * 1e-2, exponential(1.0).range)
    punch = jc.FlatPunch(UNITS.radius)
    found = quietly(body, punch, jc.Approach(np.full(5, depth)), times, grid=grid, adhesion=law, substeps=32)
    load = np.asarray(found.load)
    rate = (first + second) / viscosity  # of relaxation
    np.testing.assert_allclose(load, load[-1] + (load[0] - load[-1]) * np.exp(-rate * times), rtol=1e-4)
    lost = 0.5 * (load[0] - load[-1]) * depth * -np.expm1(-2.0 * rate * times)
    np.testing.assert_allclose(found.viscous_energy, lost, rtol=3e-4, atol=1e-6 * lost.max())


@pytest.mark.long
def test_jumps_and_the_body_take_what_a_cycle_on_a_viscoelastic_solid_costs():
    """In and out at a finite speed, then at rest apart: the area of the curve is what both have lost."""
    path = np.concatenate([np.linspace(-1.6, 0.5, 70), np.linspace(0.5, -2.4, 130)[1:], [-2.4]])
    times = np.append(0.05 * np.arange(path.size - 1), 1e4)
    grid = jc.Grid.square(n=32, width=5.0 * UNITS.radius)
    control = jc.Approach(path * UNITS.approach)
    found = quietly(solid(1.5), BALL, control, times, grid=grid, adhesion=exponential(2.5), save="last")
    lost = np.trapezoid(np.asarray(found.load), np.asarray(found.approach))
    assert int(found.jumps[-1]) == 2 and np.all(found.converged)
    viscous, jumps = float(found.viscous_energy[-1]), float(found.jump_energy[-1])
    assert viscous > 0.2 * lost and jumps > 0.05 * lost
    assert viscous + jumps == pytest.approx(lost, rel=0.01)
    assert np.all(np.diff(found.viscous_energy) > -1e-6 * lost)


@pytest.mark.slow
def test_a_coarse_grid_is_told_of():
    grid = jc.Grid.square(n=16, width=5.0 * UNITS.radius)
    control = jc.Approach(UNITS.approach)
    with pytest.warns(
        UserWarning, match="cells across the zone of attraction.*may be pinned at rows of cells"
    ):
        found = jc.indent(GEL, BALL, control, [0.0], grid=grid, adhesion=exponential(5.0))
    cells = float(exponential(5.0).zone_length(E)) / float(grid.spacing[0])
    assert float(found.cohesive_cells[0]) == pytest.approx(cells, rel=0.05)
    assert float(exponential(5.0).tabor_number(RADIUS, E)) == pytest.approx(5.0)


@pytest.mark.long
def test_derivatives_of_a_creeping_film_are_those_of_central_differences():
    """Work, range, modulus, thickness, load, radius and viscosity, over three steps under a load, in both modes."""
    grid = jc.Grid.square(n=16, width=5.0 * UNITS.radius)
    times = jnp.array([0.0, 0.5, 1.5])

    def outcome(q):
        film = jc.StandardLinearSolid(G1=2e6 * q[0], G2=1e6, eta2=1e6 * q[1], nu=0.45)
        layer = jc.Layer(film, 0.5 * UNITS.radius * q[2])
        body = jc.LayeredHalfSpace([layer], jc.Elastic(3e6, 0.3))
        law = jc.ExponentialAdhesion(WORK * q[3], exponential(1.0).range * q[4])
        load = jc.Load(jnp.array([1.0, 1.0, -1.0]) * UNITS.load * q[5])
        ball = jc.Sphere(RADIUS * q[6])
        found = jc.indent(body, ball, load, times, grid=grid, adhesion=law, tolerance=1e-11)
        return jnp.stack([found.approach[-1] / UNITS.approach, found.smooth_area[-1] / UNITS.radius**2])

    at = jnp.ones(7)
    run = jax.jit(outcome)
    forward = jax.jit(jax.jacfwd(outcome))(at)
    one = jax.jit(jax.grad(lambda q: outcome(q)[0]))(at)
    np.testing.assert_allclose(one, forward[0], rtol=1e-6, atol=1e-8)
    step = 1e-5
    central = np.stack([(run(at + step * e) - run(at - step * e)) / (2 * step) for e in jnp.eye(7)], 1)
    np.testing.assert_allclose(forward, central, atol=2e-6 * np.abs(central).max())


STEPS = 19  # of three tests, which share a program


@pytest.mark.slow
def test_a_long_range_on_a_stiff_body_needs_cells_shorter_than_the_way_on_which_the_gap_of_the_ball_grows_by_it():
    """sqrt(2 R z) in cells, at a distance where nothing deforms; the attraction is too small by 1/(3 n^2), n that number."""
    stiff, radius, reach = jc.LayeredHalfSpace([], jc.Elastic(1e12, 0.3)), 1e-3, 20e-9
    law = jc.ExponentialAdhesion(work=1e-3, range=reach)
    for cell, resolved in ((4e-6, False), (1e-6, True)):
        grid = jc.Grid.square(n=32, width=32 * cell)
        apart = jc.Approach(np.full(STEPS, -3.0 * reach))
        given = {"grid": grid, "adhesion": law, "save": "last"}
        history = quietly(stiff, jc.Sphere(radius), apart, np.arange(float(STEPS)), **given)
        cells = np.sqrt(2.0 * radius * reach) / cell
        assert float(history.cohesive_cells[0]) == pytest.approx(cells, rel=1e-3)
        assert any("zone of attraction" in note for note in history.notes) != resolved
        x, y = (np.asarray(each) for each in grid.coordinates())
        exact = -np.sum(1e-3 / reach * np.exp(-3.0 - (x**2 + y**2) / (2.0 * radius * reach))) * float(
            grid.cell_area
        )
        assert float(history.load[0]) / exact == pytest.approx(np.exp(-1.0 / (3.0 * cells**2)), rel=0.02)


@pytest.mark.slow
def test_a_step_a_thousand_times_longer_than_the_last_does_not_start_from_its_extrapolation():
    """The solid is relaxed after 1e3 retardation times as after 1e6; its pressure fell by 9 units in the first of them."""
    found = along([1.0, 1.0, 1.0], exponential(1.0), solid(10.0), n=16, width=8.0, times=[0.0, 1e3, 1e6])
    load = np.asarray(found.load) / UNITS.load
    assert np.all(found.converged) and load[0] > 8.0 and load[2] == pytest.approx(load[1], abs=0.02)


@pytest.mark.slow
def test_a_jump_into_contact_is_counted_although_the_search_meets_no_unstable_state():
    """The energy is about that of a march in a quarter of the step, 0.135 units: a step also does work on the way to it."""
    found = along(np.linspace(-1.6, -0.6, STEPS), exponential(2.0), n=32)
    step = int(np.argmin(np.diff(found.load)))
    assert np.all(found.converged) and np.diff(found.load)[step] < -0.8 * UNITS.load
    assert np.flatnonzero(np.diff(found.jumps)).tolist() == [step]
    assert float(found.jump_energy[-1]) / (UNITS.load * UNITS.approach) == pytest.approx(0.135, abs=0.03)


@pytest.mark.slow
def test_the_bound_from_above_is_found_from_a_state_without_contact():
    """Tractions not balanced yet were taken for contact there: 500 iterations for nothing."""
    found = along([0.0], exponential(1.0), jc.LayeredHalfSpace([], jc.Elastic(3.0 * G, NU)), n=16)
    assert found.error[0] < 1e-8 and found.iterations[0] < 100


def test_surfaces_that_separate_far_in_a_step_have_no_rounding_of_the_contact():
    """The displacement, first that of the contact, then falls to that under the attraction at once, or to none."""
    found = along([1.5, -30.0, 1.5] + (STEPS - 3) * [-200.0], exponential(0.5), n=32)
    separated = np.asarray(found.load)[[1, 3]] / UNITS.load
    assert np.all(found.error < 1e-8) and np.all(np.abs(separated) < 1e-11)


@pytest.mark.slow
def test_tractions_left_in_the_padding_count_once_and_over_the_displacement():
    """They were taken for an error of the response as well, over the displacement of a cell (status 1)."""
    film = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(0.2 * G, 0.45), 3.0 * UNITS.radius)], jc.Elastic(G, NU))
    grid, control = (
        jc.Grid.square(n=24, width=7.0 * UNITS.radius),
        jc.Load(np.linspace(0.3, 4.0, 25) * UNITS.load),
    )
    found = quietly(
        film,
        BALL,
        control,
        np.arange(25.0),
        grid=grid,
        adhesion=exponential(0.3),
        save="last",
        tolerance=1e-5,
    )
    assert np.all(found.error < 1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("periodic", [(False, False), (True, True)], ids=["free", "periodic"])
def test_a_step_starts_from_the_last_solution(periodic):
    """A step that changes nothing takes no iteration, also where the mean displacement is taken away."""
    grid = jc.Grid((24, 24), (UNITS.radius / 6,) * 2, periodic)
    rough = UNITS.approach * np.random.RandomState(0).rand(24, 24)
    rough += (
        6.0
        * UNITS.approach
        * sum(np.linspace(-1.0, 1.0, 24).reshape(side) ** 2 for side in ((24, 1), (1, 24)))
    )
    control = jc.Approach(np.full(2, 0.85 * float(rough.mean())))
    found = quietly(
        GEL, jc.HeightField(rough - rough.min()), control, [0.0, 1.0], grid=grid, adhesion=exponential(1.0)
    )
    assert np.all(found.error < 1e-8) and found.iterations[0] > 10 and found.iterations[1] == 0
    assert float(found.load[1]) == pytest.approx(float(found.load[0]), rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("modulus", [1e10, 1e12, 1e14])
def test_the_attraction_of_stiff_bodies_is_met_although_displacements_are_small_beside_the_approach(modulus):
    """Without contact, at a tolerance of 1e-4: the load is that of the undeformed gap."""
    grid, law = jc.Grid.square(n=16, width=16 * 1.5e-6), jc.ExponentialAdhesion(work=1e-3, range=20e-9)
    body, control = jc.LayeredHalfSpace([], jc.Elastic(modulus, 0.3)), jc.Approach([-6e-8])
    given = {"grid": grid, "adhesion": law, "tolerance": 1e-4, "save": "last"}
    found = quietly(body, jc.Sphere(1e-3), control, [0.0], **given)
    x, y = (np.asarray(each) for each in grid.coordinates())
    rigid = np.asarray(jax.jit(Attraction(law, (False, False)).traction)((x**2 + y**2) / 2e-3 + 6e-8))
    assert found.status[0] == 0
    assert float(found.load[0]) == pytest.approx(-np.sum(rigid) * float(grid.cell_area), rel=2e-4)
