"""Sliding in time: limits, symmetries, order, energy, memory of earlier passes, and what is refused."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tolerances import TIGHT_SOLVER

import jaxcontact as jc
from jaxcontact import kernels as make_kernels
from jaxcontact import slide as public_slide
from jaxcontact.contact.normal import Problem, solve
from jaxcontact.history.memory import Motion, RecursiveMemory, Way, step_weights

TIMES = jnp.linspace(0.0, 600.0, 13)
GRID = jc.Grid.square(64, 500e-6)
SMALL = jc.Grid.square(32, 500e-6)
LOAD = jc.Load(60.0)


def slide(body, ball, control=LOAD, times=TIMES, *, velocity, grid=GRID, tolerance=1e-12, **more):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return public_slide(
            body, ball, control, times, velocity=velocity, grid=grid, tolerance=tolerance, **more
        )


def indent(*args, **more):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.indent(*args, **more)


def apart(a, b):
    """Largest difference of two pressure fields over their peak."""
    return float(jnp.max(jnp.abs(a - b)) / jnp.max(b))


@pytest.mark.long
def test_speed_zero_is_indentation(body, ball):
    still = slide(body, ball, velocity=0.0, tolerance=1e-13)
    pressed = indent(body, ball, LOAD, TIMES, grid=GRID, tolerance=1e-13)
    assert apart(still.pressure, pressed.pressure) < 1e-10
    np.testing.assert_allclose(still.approach, pressed.approach, rtol=1e-10)
    np.testing.assert_array_equal(still.tangential_force, 0.0)


@pytest.mark.slow
def test_great_speed_is_the_glassy_film(body, ball, film, steel):
    """At 1 m/s the film has no time to creep, also where the same place was long under load at rest."""
    fast = slide(body, ball, times=TIMES * 4e-6, velocity=1.0)
    glass = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(film.G1, film.nu), 150e-9)], steel)
    elastic = indent(glass, ball, LOAD, jnp.zeros(1), grid=GRID, tolerance=1e-12, save="last")
    assert apart(fast.pressure, elastic.pressure) < 1e-4
    # 600 s at rest, then away by a third of the grid within 0.1 s: fresh film under the indenter
    times = jnp.append(jnp.linspace(0.0, 600.0, 5), 600.0 + jnp.linspace(0.0, 0.8, 8))
    velocity = jnp.zeros((13, 2)).at[5:, 0].set(5e-4)
    away = slide(body, ball, times=times, velocity=velocity)
    assert apart(away.pressure[4], elastic.pressure) > 0.1
    assert apart(away.pressure[-1], elastic.pressure) < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.4e-6, 1.6e-6])
def test_long_transient_is_the_steady_state(body, ball, speed):
    run = slide(body, ball, times=TIMES * 8.0, velocity=speed, substeps=1 if speed < 1e-6 else 4)
    with pytest.warns(UserWarning, match="film strain"):
        steady = jc.slide_steady(body, ball, LOAD, velocity=speed, grid=GRID, tolerance=1e-12)
    np.testing.assert_allclose(jnp.max(run.pressure[-1]), jnp.max(steady.pressure), rtol=2e-3)
    np.testing.assert_allclose(run.tangential_force[-1], steady.tangential_force, rtol=1e-2)
    np.testing.assert_allclose(run.approach[-1], steady.approach, rtol=1e-4)


@pytest.mark.slow
@pytest.mark.versions
def test_direction_reversed_mirrors_the_field(body, ball):
    forth, back = (slide(body, ball, velocity=v) for v in (0.4e-6, -0.4e-6))
    assert apart(back.pressure[:, ::-1], forth.pressure) < 1e-10
    np.testing.assert_allclose(back.tangential_force, forth.tangential_force, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(back.pressure_centre[:, 0], -forth.pressure_centre[:, 0], atol=1e-15)
    assert float(forth.pressure_centre[-1, 0]) > 1e-6  # ahead
    assert float(forth.tangential_force[-1]) > 0.0  # against the motion


@pytest.mark.slow
def test_x_y_and_the_diagonal_agree(body, ball):
    v = 0.4e-6
    number = slide(body, ball, velocity=v)
    x, y, diagonal = (
        slide(body, ball, velocity=jnp.asarray(d) * jnp.ones((13, 1)))
        for d in ((v, 0.0), (0.0, v), (v / np.sqrt(2.0), v / np.sqrt(2.0)))
    )
    assert apart(x.pressure, number.pressure) < 1e-10
    assert apart(y.pressure.swapaxes(1, 2), x.pressure) < 1e-8
    # nobody is mirrored here, so that the grid shows: 64 cells, the contact 42 across
    np.testing.assert_allclose(jnp.max(diagonal.pressure[-1]), jnp.max(x.pressure[-1]), rtol=2e-3)
    np.testing.assert_allclose(diagonal.approach, x.approach, rtol=1e-4)
    np.testing.assert_allclose(diagonal.tangential_force[-1], x.tangential_force[-1], rtol=1e-2)
    assert apart(diagonal.pressure.swapaxes(1, 2), diagonal.pressure) < 1e-8


@pytest.mark.long
def test_second_order_in_the_step(body, ball):
    """Half a pixel a step against a quarter and an eighth, while the speed changes."""
    pixel = 500e-6 / 32
    times = jnp.linspace(0.0, 300.0, 13)
    speed = pixel / 2.0 / 25.0 * (1.0 + 0.5 * jnp.sin(times / 60.0))
    velocity = jnp.stack([speed, 0.0 * speed], -1)
    coarse, middle, fine = (
        slide(body, ball, times=times, velocity=velocity, grid=SMALL, substeps=k, save="last").pressure
        for k in (1, 2, 4)
    )
    ratio = apart(coarse, middle) / apart(middle, fine)
    print(f"half against quarter pixel {apart(coarse, middle):.1e}, ratio {ratio:.2f}")
    assert apart(coarse, middle) < 1e-3
    assert 3.5 < ratio < 4.6


@pytest.mark.long
def test_doubling_the_window_changes_the_peak_by_less_than_a_thousandth(body, ball):
    """Forty minutes at 0.4 um/s, a track of two windows: nothing that left comes back or is missed."""
    narrow = slide(body, ball, times=TIMES * 4.0, velocity=0.4e-6, save="last")
    wide = slide(
        body, ball, times=TIMES * 4.0, velocity=0.4e-6, save="last", grid=jc.Grid.square(128, 1000e-6)
    )
    change = float(jnp.max(narrow.pressure) / jnp.max(wide.pressure) - 1.0)
    print(f"film, window doubled: peak pressure {change:.1e}")
    assert abs(change) < 1e-3
    assert abs(change) < 1e-5  # measured
    assert float(narrow.truncation_bound[-1]) < 1e-4 * float(narrow.approach[-1])


@pytest.mark.long
def test_doubling_the_window_of_a_half_space(ball, film):
    """A half-space misses what left the window: stated, and within the bound that the result gives."""
    half = jc.LayeredHalfSpace([], film)
    times = jnp.linspace(0.0, 14400.0, 61)
    run = lambda n, width: slide(
        half, ball, times=times, velocity=0.4028e-6, save="last", grid=jc.Grid.square(n, width)
    )
    narrow, wide = run(64, 5e-3), run(128, 10e-3)
    change = float(jnp.max(narrow.pressure) / jnp.max(wide.pressure) - 1.0)
    missed = float(wide.approach[-1] - narrow.approach[-1])
    print(f"half-space, window doubled: peak {change:.1e}, approach {missed / float(wide.approach[-1]):.1e}")
    print(f"bound of what was dropped {float(narrow.truncation_bound[-1]) / float(narrow.approach[-1]):.1e}")
    assert abs(change) < 0.05
    assert 0.0 <= missed <= float(narrow.truncation_bound[-1])


@pytest.mark.slow
def test_work_done_is_energy_stored_and_dissipated(body, ball):
    """Force times speed plus load times rate of approach, from 30 s on; the film starts to slide at 200 s."""
    times = jnp.linspace(0.0, 600.0, 61)
    velocity = jnp.stack([jnp.where(times > 200.0, 0.2e-6, 0.0), 0.0 * times], -1)
    run = slide(body, ball, times=times, velocity=velocity, grid=SMALL)
    since = slice(3, None)
    integral = lambda values: float(jnp.trapezoid(values[since], times[since]))
    work = integral(run.tangential_force * jnp.abs(run.velocity[:, 0]))
    work += 60.0 * float(run.approach[-1] - run.approach[3])
    stored, spent = float(run.stored_energy[-1] - run.stored_energy[3]), integral(run.power)
    print(f"work {work:.4e} J, stored {stored:.4e} J, dissipated {spent:.4e} J")
    np.testing.assert_allclose(work, stored + spent, rtol=1e-2)
    assert abs(stored) > 0.05 * work and spent > 0.05 * work


def in_the_bodys_frame(body, ball, places, times, grid, margin):
    """An oracle: fields at rest in the body, the indenter moved by whole cells; (nt, nx, ny) in its frame."""
    n, dx = grid.shape[0], float(grid.spacing[0])
    wide = jc.Grid(shape=(n + 2 * margin, n), spacing=grid.spacing)
    k = make_kernels(body, ball, wide)
    memory, (x, y) = RecursiveMemory(k), wide.axes()
    eta, pressure, found = memory.start(wide.shape), jnp.zeros(wide.shape), []
    target = jnp.asarray(60.0 * float(k.scale.compliance) / dx**2)

    @jax.jit
    def step(eta, pressure, dt, place):
        coming = memory.predict(eta, pressure, dt)
        profile = ((x[:, None] - place * dx) ** 2 + y**2) / (2.0 * 9.525e-3) / dx
        problem = Problem(
            coming.operator, profile + coming.earlier, target, jnp.zeros(()), load_controlled=True
        )
        pressure = solve(problem, pressure, jnp.asarray(1e-10), jnp.asarray(500)).pressure
        return memory.update(coming.fields, pressure, dt), pressure

    for dt, place in zip(np.diff(times, prepend=0.0), places, strict=True):
        eta, pressure = step(eta, pressure, float(dt), float(place))
        found.append(pressure[margin + place : margin + place + n] / k.scale.compliance)
    return jnp.stack(found)


@pytest.mark.long
def test_reciprocating_remembers_earlier_passes(body, ball):
    """Eight cells forth and back, a cell each 20 s, against a march in the body's own frame."""
    forth = np.append(np.arange(9), np.arange(7, -1, -1))
    times = 20.0 * jnp.arange(17)
    pixel = 500e-6 / 64
    oracle = in_the_bodys_frame(body, ball, forth, np.asarray(times), GRID, 8)
    # a jump of the velocity is two equal times
    twice = jnp.append(times[:9], times[8:])
    velocity = jnp.zeros((18, 2)).at[:9, 0].set(pixel / 20.0).at[9:, 0].set(-pixel / 20.0)
    run = slide(body, ball, times=twice, velocity=velocity, tolerance=1e-10)
    once = slide(body, ball, times=twice, velocity=jnp.abs(velocity), tolerance=1e-10)
    returned = apart(run.pressure[-1], oracle[-1])
    print(f"after the return {returned:.1e}, without it {apart(once.pressure[-1], oracle[-1]):.1e}")
    assert apart(run.pressure[8], oracle[8]) < 0.02
    assert returned < 0.02
    assert apart(once.pressure[-1], oracle[-1]) > 0.1


def there_and_back(body, ball, grid):
    """Ten minutes forth, ten back and ten forth over a stroke [m] that nothing knows beforehand."""
    times = jnp.concatenate([600.0 * leg + jnp.linspace(0.0, 600.0, 7) for leg in range(3)])
    rate = jnp.repeat(jnp.asarray([1.0, -1.0, 1.0]), 7)[:, None] * jnp.asarray([1.0, 0.0]) / 600.0
    return jax.jit(lambda v: slide(body, ball, times=times, velocity=v * rate, grid=grid, tolerance=1e-9))


@pytest.mark.long
def test_coming_back_to_what_left_the_grid_is_marked(body, ball):
    """Against a wider window; half the contact's width is 0.34 of it: held, just held, lost, far out and back."""
    small, large = (there_and_back(body, ball, g) for g in (SMALL, jc.Grid((128, 32), SMALL.spacing)))
    for share, held in ((0.15, True), (0.25, True), (0.4, False), (0.5, False), (1.3, False)):
        run, wide = small(share * 500e-6), large(share * 500e-6)
        missed = apart(run.pressure[-1], wide.pressure[-1, 48:80])
        bound = float(run.truncation_bound[-1] / run.approach[-1])
        print(
            f"stroke {share} of the window: pressure {missed:.1e}, bound {bound:.1e}, {np.unique(run.status)}"
        )
        assert np.all(np.asarray(run.status) == 0) == held
        assert missed < 1e-2 or run.status[-1] == 5
        assert abs(float(wide.approach[-1] - run.approach[-1])) < float(
            run.truncation_bound[-1]
        ) + 1e-5 * float(run.approach[-1])
    assert missed > 0.05  # there was something to be missed


def test_what_is_refused(body, ball):
    with pytest.raises(ValueError, match=r"velocity: expected a number, shape \(2,\) or \(13, 2\)"):
        jc.slide(body, ball, LOAD, TIMES, velocity=jnp.zeros(3), grid=GRID)
    with pytest.raises(ValueError, match="finite"):
        jc.slide(body, ball, LOAD, TIMES, velocity=np.inf, grid=GRID)
    with pytest.raises(ValueError, match="pass substeps=4 or more"):
        jc.slide(body, ball, LOAD, TIMES, velocity=2.0 * 500e-6 / 50.0, grid=GRID)
    stroke = 1.2e-6 * np.sign(np.linspace(1.0, -1.0, 13))[:, None] * np.array([1.0, 0.0])
    with pytest.raises(ValueError, match="widths away: a grid"):
        jc.slide(body, ball, LOAD, TIMES, velocity=stroke, grid=GRID)
    often = np.where(np.arange(6001) % 10 < 5, 1.0, -1.0)[:, None] * np.array([0.17 * 500e-6, 0.0])
    with pytest.raises(ValueError, match="widths away: a grid"):
        jc.slide(body, ball, LOAD, np.arange(6001.0), velocity=often, grid=GRID)


@pytest.mark.slow
def test_a_step_too_far_is_marked_where_values_are_unknown():
    half = jc.LayeredHalfSpace([], jc.StandardLinearSolid(1.0, 0.5, 1.0))
    grid, times = jc.Grid.square(16, 3.0), jnp.linspace(0.0, 2.0, 5)
    status = jax.jit(
        lambda v: slide(half, jc.Sphere(10.0), jc.Load(0.05), times, velocity=v, grid=grid).status
    )
    np.testing.assert_array_equal(status(2.9), 0)
    np.testing.assert_array_equal(status(3.1), [0, 4, 4, 4, 4])


def solid_run(x):
    """A standard solid as half-space, 16 x 16 cells, in units of order one; four steps."""
    solid = jc.StandardLinearSolid(G1=x[0], G2=0.5 * x[1], eta2=x[2])
    half = jc.LayeredHalfSpace([], solid)
    grid, times = jc.Grid.square(16, 3.0), jnp.linspace(0.0, 2.0, 5)
    velocity = x[5] * jnp.asarray([0.3, 0.1])
    run = slide(
        half,
        jc.Sphere(10.0 * x[3]),
        jc.Load(0.05 * x[4]),
        times,
        velocity=velocity,
        grid=grid,
        tolerance=1e-13,
    )
    forces = jnp.sum(run.tangential_force) + jnp.sum(run.power) + jnp.sum(run.stored_energy)
    return jnp.sum(run.pressure**2) + jnp.sum(run.approach) + 10.0 * forces


@pytest.mark.parametrize("shape", [(6, 4), (5, 4), (6, 3)])
@pytest.mark.parametrize("way", [(0.0, 0.0), (0.3, 0.0), (0.0, 0.3)])
def test_derivatives_of_the_memory_by_a_component_of_the_motion_that_is_zero(shape, way):
    """Those of central differences, of the highest mode of an even grid too, which decays with the size of the motion."""
    rates, still = jnp.asarray([0.0, 0.2]), jnp.zeros(2)

    def weights(way):
        motion = Motion(jnp.asarray(1.5), Way(*way), still)
        return jnp.stack(step_weights(rates, motion, shape, jnp.asarray(1.2)))

    slopes = jax.jit(jax.jacfwd(weights))(jnp.asarray(way))
    differences = [(weights(way + h) - weights(way - h)) / 2e-4 for h in 1e-4 * np.eye(2)]
    np.testing.assert_allclose(slopes, jnp.stack(differences, -1), atol=1e-6)


@pytest.mark.long
def test_derivatives_reverse_forward_and_central():
    """Along one direction in all six parameters."""
    x, direction = jnp.ones(6), jnp.asarray([0.5, -0.3, 0.7, 0.4, -0.6, 0.8])
    gradient = jax.jit(jax.grad(solid_run))(x)
    forward = jax.jit(lambda d: jax.jvp(solid_run, (x,), (d,))[1])(direction)
    np.testing.assert_allclose(gradient @ direction, forward, rtol=1e-8)
    plain, h = jax.jit(solid_run), 1e-5
    central = (plain(x + h * direction) - plain(x - h * direction)) / (2.0 * h)
    np.testing.assert_allclose(forward, central, rtol=1e-5)
    assert abs(float(gradient[5])) > 1e-3 * float(jnp.max(jnp.abs(gradient)))  # the speed matters


@pytest.mark.slow
def test_equal_calls_compile_once(body, ball):
    from jaxcontact.simulate.run import _run

    slide(body, ball, velocity=0.1e-6)
    before = _run.compiled._cache_size()
    slide(body, ball, velocity=0.2e-6, tolerance=1e-9)
    assert _run.compiled._cache_size() == before


@pytest.mark.slow
def test_limits_of_the_solver_are_reported(body, ball):
    """Too few iterations: status 1, never silent."""
    with pytest.warns(UserWarning, match="not converged"), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="film strain")
        run = jc.slide(
            body, ball, LOAD, TIMES, velocity=0.4e-6, grid=GRID, tolerance=TIGHT_SOLVER, max_iterations=1
        )
    assert np.any(np.asarray(run.status) == 1)
