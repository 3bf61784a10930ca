"""Surfaces that yield: 0 <= p <= H, and the dents that stay."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import lsq_linear

import jaxcontact as jc
from jaxcontact._support.status import Status
from jaxcontact.history.memory import Way
from jaxcontact.history.motion import carried_past

pytestmark = pytest.mark.filterwarnings(
    "ignore:only .* cells across", "ignore:.* steps, the first", "ignore:the time steps"
)
N, WIDTH = 12, 1.2e-3
GRID = jc.Grid.square(n=N, width=WIDTH)
STEEL, BALL = jc.Elastic.from_young(70e9, 0.3), jc.Sphere(5e-3)
BODY = jc.LayeredHalfSpace([], substrate=STEEL)
HARDNESS = 2e9
RISE = np.array([100.0, 200.0, 300.0, 400.0])


def press(control, times=None, *, body=BODY, grid=GRID, hardness=HARDNESS, indenter=BALL, **given):
    times = jnp.arange(float(np.size(control.value))) if times is None else times
    given = {"tolerance": 1e-10} | given
    return jc.indent(body, indenter, control, times, grid=grid, hardness=hardness, **given)


@functools.cache
def compliances(n=N, width=WIDTH):
    """Displacements of a half-space under unit pressure on single cells, by the primitive x log(y + r) + y log(x + r)."""
    x, y = (a.ravel() * width / n for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    dx, dy = (np.abs(a[:, None] - a[None, :]) for a in (x, y))
    primitive = lambda u, v: u * np.log(v + np.hypot(u, v)) + v * np.log(u + np.hypot(u, v))
    half = width / n / 2
    high, low = (dx + half, dy + half), (dx - half, dy - half)
    sums = primitive(*high) + primitive(*low) - primitive(high[0], low[1]) - primitive(low[0], high[1])
    return sums * (1 - 0.3**2) / (np.pi * 70e9)


def bounded(gap, approach, hardness, compliance=1.0):
    """Pressures of least energy between zero and a hardness at an approach, by bounded least squares in GPa and um;
    compliance: that of the half-space over that of steel."""
    scaled = compliance * compliances() * 1e9 / 1e-6
    root = np.linalg.cholesky(scaled)
    right = np.linalg.solve(root, (approach - gap.ravel()) / 1e-6)
    found = lsq_linear(root.T, right, (0.0, hardness / 1e9), method="bvls", tol=1e-15)
    return found.x.reshape(N, N) * 1e9


def creep(t):
    """J of the solids below over that of steel, and its integral from zero."""
    delayed = -np.expm1(-t)
    return 1.0 + delayed, t + (t - delayed)


@pytest.mark.long
def test_a_batch_of_hardnesses_is_one_after_the_other():
    """Two that yield and one that does not, pressed and unloaded, with their derivatives; one out of range."""
    run = lambda hardness: press(jc.Load(np.array([100.0, 300.0, 100.0])), hardness=hardness)
    slope = jax.grad(lambda hardness: run(hardness).approach[-1])
    hardnesses = jnp.array([1.5e9, 2e9, 10e9, -1.0])
    batch, slopes = jax.jit(jax.vmap(run))(hardnesses), jax.vmap(slope)(hardnesses[:3])
    assert np.all(batch.status[:3] == 0) and np.all(batch.status[3] == Status.OUT_OF_RANGE)
    for i in range(3):
        alone = run(float(hardnesses[i]))
        assert (float(alone.dent.max()) > 0.0) == (i < 2)
        np.testing.assert_allclose(batch.dent[i], alone.dent, atol=1e-8 * float(alone.approach.max()))
        np.testing.assert_allclose(batch.pressure[i], alone.pressure, atol=1e-7 * float(alone.pressure.max()))
        assert float(slopes[i]) == pytest.approx(float(slope(float(hardnesses[i]))), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("creeps", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_hardness_pressures_and_dents_of_a_load_cycle_equal_bounded_least_squares(creeps):
    """With creep each pressure is linear over a step, so that its displacement takes the mean of J over the step."""
    loads, times = np.array([200.0, 300.0, 450.0, 150.0, 500.0]), np.array([0.0, 0.3, 0.9, 1.6, 3.0])
    G = 70e9 / 2.6
    solid = jc.StandardLinearSolid(G1=G, G2=G, eta2=G, nu=0.3) if creeps else STEEL
    body = jc.LayeredHalfSpace([], substrate=solid)
    history = press(jc.Load(jnp.asarray(loads)), times, body=body)
    profile, area, steps = np.asarray(BALL.profile(GRID)), GRID.cell_area, np.zeros((5, N * N))
    dent = np.zeros((N, N))
    for i, t in enumerate(times):
        mean = np.ones(i + 1)
        if creeps:
            mean[0] = creep(t)[0]
            ends = creep(t - times[: i + 1])[1]
            mean[1:] = -np.diff(ends) / np.diff(times[: i + 1])
        before = np.sum(steps[:i], 0)
        gap = profile + dent
        gap = gap + (compliances() @ (mean[:i] @ steps[:i] - mean[i] * before)).reshape(N, N)
        approach = float(history.approach[i])
        pressure = bounded(gap, approach, HARDNESS, mean[i])
        left = gap + mean[i] * (compliances() @ pressure.ravel()).reshape(N, N) - approach
        dent = dent + np.where(pressure >= HARDNESS, np.maximum(-left, 0.0), 0.0)
        steps[i] = pressure.ravel() - before
        assert pressure.sum() * area == pytest.approx(loads[i], rel=1e-6)
        np.testing.assert_allclose(history.pressure[i], pressure, atol=1e-6 * HARDNESS)
        np.testing.assert_allclose(history.dent[i], dent, atol=1e-6 * dent.max() + 1e-18)
    assert np.all(np.asarray(history.status) == 0) and np.sum(dent > 1e-8) > 2
    assert np.min(history.gap) > -1e-8 * np.max(history.approach)
    assert "peak dent" in history.summary() and np.max(history.pressure) == pytest.approx(HARDNESS, rel=1e-12)


@pytest.mark.slow
def test_hardness_over_the_surface_at_a_given_approach_equals_bounded_least_squares():
    rng = np.random.default_rng(3)
    hardness = 1e9 * (1.0 + rng.random((N, N)))
    rough = jc.HeightField(-np.asarray(BALL.profile(GRID)) + 0.4e-6 * rng.random((N, N)))
    history = press(jc.Approach(jnp.array([12e-6])), indenter=rough, hardness=hardness)
    profile = np.asarray(rough.profile(GRID))
    pressure = bounded(profile, 12e-6, hardness.ravel())
    np.testing.assert_allclose(history.pressure[0], pressure, atol=1e-6 * pressure.max())
    assert 5 < np.sum(pressure == hardness) < np.sum(pressure > 0.0)


def test_hardness_second_loading_to_the_same_load_changes_nothing():
    history = press(jc.Load(jnp.array([400.0, 100.0, 0.0, 200.0, 400.0])), tolerance=1e-12)
    first, last = np.asarray(history.dent[0]), np.asarray(history.dent[-1])
    assert float(np.max(last - first)) <= 1e-9 * np.max(first)
    for i in (1, 2, 3):  # nor does what comes between
        np.testing.assert_array_equal(history.dent[i], history.dent[0])
    np.testing.assert_allclose(history.pressure[-1], history.pressure[0], atol=1e-7 * HARDNESS)
    profile = np.asarray(BALL.profile(GRID))
    touch = np.min(profile + first) - np.min(profile)
    assert np.max(history.pressure[2]) == 0.0
    assert float(history.approach[2]) == pytest.approx(touch, rel=1e-12)


@pytest.mark.slow
def test_hardness_work_of_a_load_cycle_is_that_of_the_dents():
    """sum of load x change of approach = sum of H x volume of the dents, but for the steps."""
    rise = np.linspace(0.0, 24e-6, 129)
    history = press(jc.Approach(jnp.array(np.concatenate([rise, rise[-2::-1]]))), save="last")
    load, approach = np.asarray(history.load), np.concatenate([rise, rise[-2::-1]])
    work = lambda f, d: np.sum((f[1:] + f[:-1]) / 2 * np.diff(d))
    lost = HARDNESS * GRID.cell_area * float(jnp.sum(history.dent))
    assert work(load, approach) == pytest.approx(lost, rel=1e-4)
    # neither the dent nor the loads depend on the steps: every fourth of them is a cycle of longer steps
    assert 1e-4 < abs(work(load[::4], approach[::4]) / lost - 1.0) < 1e-3


def test_hardness_far_below_the_elastic_pressure_gives_load_over_area():
    history = press(jc.Load(jnp.array([20.0, 30.0, 40.0, 50.0, 60.0])), hardness=1e8)
    spare = 1e8 * np.asarray(history.contact_area) - np.asarray(history.load)
    assert np.all(spare >= -1e-6) and np.all(spare < 8 * 1e8 * GRID.cell_area)  # of one ring of cells
    # also where a whole number of cells carries the load, 20 to 60
    assert np.all(np.asarray(history.status) == 0)
    # the area is then that of the profile below the approach, 2 pi R d
    assert pytest.approx(2 * np.pi * 5e-3 * float(history.approach[-1]), rel=0.1) == 60.0 / 1e8


@pytest.mark.slow
def test_hardness_above_all_pressures_gives_the_elastic_contact():
    loads, times = jc.Load(jnp.append(RISE, 100.0)), jnp.arange(5.0)
    elastic = jc.indent(BODY, BALL, loads, times, grid=GRID, tolerance=1e-13)
    history = press(loads, hardness=1e15, tolerance=1e-13)
    np.testing.assert_allclose(history.pressure, elastic.pressure, atol=1e-9 * np.max(elastic.pressure))
    np.testing.assert_allclose(history.approach, elastic.approach, rtol=1e-11)
    assert np.all(np.asarray(history.dent) == 0.0) and elastic.dent is None


@pytest.mark.parametrize("length", [1e-9, 1.0])
def test_hardness_does_not_depend_on_the_units_of_length(length):
    ball, grid = jc.Sphere(length), jc.Grid.square(n=N, width=0.24 * length)
    loads = jnp.array([4.0, 16.0, 8.0, 12.0, 18.0]) * 1e6 * length**2
    history = press(jc.Load(loads), indenter=ball, grid=grid)
    same = press(jc.Load(loads / length**2 * 25e-6), indenter=BALL, grid=jc.Grid.square(n=N, width=1.2e-3))
    assert np.max(same.dent) > 0.0
    np.testing.assert_allclose(history.dent / length, same.dent / 5e-3, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(history.pressure, same.pressure, atol=1e-8 * HARDNESS)


def test_hardness_load_above_that_of_the_grid_has_a_status():
    history = press(jc.Load(jnp.array([300.0, 400.0, 2e9 * WIDTH**2 * 1.01, 400.0, 300.0])))
    above, inherited = jc.Status.LOAD_ABOVE_HARDNESS, jc.Status.INHERITED
    assert list(np.asarray(history.status)) == [0, 0, above, inherited, inherited]


@pytest.mark.slow
def test_hardness_a_punch_carries_at_most_the_hardness_times_its_area():
    punch, most = jc.FlatPunch(0.1 * WIDTH * np.sqrt(32 / np.pi) / 1.2), 2e9 * 32 * float(GRID.cell_area)
    history = press(jc.Load(most * jnp.array([0.9, 0.999, 1.001])), indenter=punch)
    assert list(np.asarray(history.status)) == [0, 0, jc.Status.LOAD_ABOVE_HARDNESS]


@pytest.mark.long
@pytest.mark.parametrize("control", [jc.Load, pytest.param(jc.Approach, marks=pytest.mark.long)])
def test_hardness_gradients_of_pressure_and_dent(control):
    """By forward and reverse mode and by differences, for load or approach, hardness, radius, material, and a change of the
    hardness over the surface."""
    pattern = 0.1 * np.cos(0.9 * np.arange(N) + 0.4)[:, None] * np.sin(1.3 * np.arange(N))
    top = jnp.array([300.0, 380.0, 150.0]) if control is jc.Load else jnp.array([12e-6, 15e-6, 9e-6])
    weights = np.random.default_rng(0).random((2, N, N))

    def outcome(q):
        solid = jc.StandardLinearSolid(G1=27e9 * q[3], G2=60e9, eta2=60e9 * q[4], nu=0.3)
        body = jc.LayeredHalfSpace([], substrate=solid)
        history = press(
            control(top * q[0]),
            body=body,
            hardness=1.6e9 * (q[1] + pattern * (q[5] - 1.0)),
            indenter=jc.Sphere(5e-3 * q[2]),
            tolerance=1e-13,
        )
        pressure, dent = history.pressure / 1e9, history.dent / 1e-6
        return jnp.stack(
            [
                jnp.sum(weights[0] * pressure[-1]),
                jnp.sum(weights[1] * dent[1]),
                jnp.sum(weights[1] * dent[2]),
                history.approach[2] / 1e-6,
                history.load[2] / 100.0,
            ]
        )

    at = jnp.ones(6)
    forward, reverse = jax.jit(jax.jacfwd(outcome))(at), jax.jit(jax.jacrev(outcome))(at)
    np.testing.assert_allclose(forward, reverse, atol=1e-7 * np.max(np.abs(forward)))
    central = jax.jit(outcome)
    for i, step in enumerate(1e-5 * np.eye(6)):
        slope = (central(at + step) - central(at - step)) / 2e-5
        np.testing.assert_allclose(forward[:, i], slope, rtol=1e-6, atol=1e-6 * np.max(np.abs(slope)))
    assert np.max(np.abs(forward[1])) > 0.1


@pytest.mark.slow
def test_hardness_below_zero_that_is_traced_has_a_status():
    loads = jc.Load(jnp.append(RISE, 100.0))
    traced = jax.jit(lambda h: press(loads, hardness=h).status)(-1e9)
    assert np.all(np.asarray(traced) == jc.Status.OUT_OF_RANGE)


# In sliding and rubbing the dent stays behind in the track.


WIDE = jc.Grid.square(n=32, width=1.6e-3)
CELL = 1.6e-3 / 32


def slid(hardness, **given):
    given = {"velocity": CELL, "grid": WIDE, "tolerance": 1e-10} | given
    return jc.slide(BODY, BALL, jc.Load(350.0), jnp.arange(11.0), hardness=hardness, **given)


@pytest.mark.long
def test_hardness_leaves_a_track_that_stays_behind():
    """Steps of a cell: dent and hardness of the body move on by a cell, and nothing changes behind the contact."""
    hardness = np.where(np.arange(32)[:, None] < 19, 2e9, 1.6e9) * np.ones((32, 32))
    history = slid(hardness)
    dent, pressure = np.asarray(history.dent), np.asarray(history.pressure)
    assert np.all(np.asarray(history.status) == 0) and np.min(history.gap) > -1e-8 * np.max(history.approach)
    for i in range(11):
        moved = hardness[np.minimum(np.arange(32) + i, 31)]
        assert np.all(pressure[i] <= moved * (1 + 1e-12)) and np.any(np.isclose(pressure[i], moved, 1e-12))
    for i in range(1, 11):
        still = pressure[i][:-1] < 0.99 * 1.6e9
        come = dent[i - 1][1:]
        np.testing.assert_allclose(dent[i][:-1][still], come[still], atol=1e-12 * np.max(dent))
    behind, ahead = dent[-1][5:9, 16], dent[-1][24:, 16]
    assert np.min(behind) > 1e-7 and np.max(ahead) == 0.0


def test_hardness_work_of_ploughing_is_that_of_the_track():
    """Force x way + load x sinking less the energy stored is the sum of H x volume of the dents."""
    history = slid(np.full((32, 32), 2e9))
    force, approach, stored, volume = (
        np.asarray(a)
        for a in (
            history.tangential_force,
            history.approach,
            history.stored_energy,
            jnp.sum(history.dent, (1, 2)),
        )
    )
    work = CELL * np.sum((force[1:] + force[:-1]) / 2) + 350.0 * (approach[-1] - approach[0])
    lost = 2e9 * (volume[-1] - volume[0]) * WIDE.cell_area
    assert work - (stored[-1] - stored[0]) == pytest.approx(lost, rel=0.012) and force[-1] > 0.8


@pytest.mark.slow
def test_carried_past_moves_a_field_between_cells():
    n = 64
    ratio, x = jnp.asarray(2.0), 2 * np.pi * np.arange(n) / n
    wave = lambda a, b: jnp.asarray(np.sin(x[:, None] + a) * np.cos(x[None, :] + b))
    both = lambda field, sx, sy, **given: carried_past(
        field, Way(jnp.asarray(sx), None if sy is None else jnp.asarray(sy)), ratio, **given
    )
    round_ = {"periodic": (True, True), "beyond": "constant"}
    # ratio: a move along y by two cells along x is one of its cells
    moved = both(wave(0.0, 0.0), 3.3, -2.6, **round_)
    exact = wave(3.3 * 2 * np.pi / n, -1.3 * 2 * np.pi / n)
    # held at the crests
    assert np.max(np.abs(moved - exact)) < 6e-4 and np.median(np.abs(moved - exact)) < 3e-6
    assert np.max(jnp.abs(moved)) <= np.max(jnp.abs(wave(0.0, 0.0)))
    np.testing.assert_array_equal(
        both(wave(0.0, 0.0), -5.0, 4.0, **round_), np.roll(wave(0.0, 0.0), (5, -2), (0, 1))
    )
    ramp = jnp.asarray(np.arange(1.0, 9.0)[:, None] * np.ones((8, 3)))
    open_ = {"periodic": (False, False)}
    np.testing.assert_array_equal(
        both(ramp, 2.0, None, beyond="constant", **open_)[:, 0], [3, 4, 5, 6, 7, 8, 0, 0]
    )
    np.testing.assert_array_equal(both(ramp, -20.0, None, beyond="edge", **open_)[:, 0], np.ones(8))
    np.testing.assert_allclose(
        both(ramp, 0.25, None, beyond="edge", **open_)[1:5, 0], [2.25, 3.25, 4.25, 5.25]
    )


@pytest.mark.long
def test_hardness_tracks_are_the_same_in_the_frames_of_indenter_and_body():
    film = jc.Layer(jc.Elastic.from_young(20e9, 0.3), 50e-6)
    body, times = jc.LayeredHalfSpace([film], substrate=STEEL), jnp.arange(5.0)
    given = {"grid": WIDE, "hardness": 1e9, "tolerance": 1e-11}
    moving = jc.slide(body, BALL, jc.Load(150.0), times, velocity=CELL, **given)
    path = (np.arange(5) - 2) * CELL
    rubbed = jc.rub(body, BALL, jc.Load(150.0), times, path=path, law=None, **given)
    for i in range(5):
        for name, scale in (("dent", float(jnp.max(moving.dent))), ("pressure", 1e9), ("gap", 1e-5)):
            here, there = np.asarray(getattr(moving, name)[i]), np.asarray(getattr(rubbed, name)[i])
            moved = np.roll(there, -(i - 2), 0)
            np.testing.assert_allclose(here[3:-3], moved[3:-3], atol=1e-6 * scale)
    np.testing.assert_allclose(moving.approach, rubbed.approach, rtol=1e-7)


@pytest.mark.long
def test_hardness_of_a_film_that_wears_in_place():
    """Wear under p = H is that of Archard's law at this pressure, and its gap is closed."""
    film = jc.LayeredHalfSpace([jc.Layer(jc.Elastic.from_young(20e9, 0.3), 50e-6)], substrate=STEEL)
    times, loads = jnp.arange(5.0), np.linspace(150.0, 300.0, 5)
    worn = jc.rub(
        film,
        BALL,
        jc.Load(loads),
        times,
        velocity=1.0,
        law=jc.Archard(1e-17),
        grid=WIDE,
        hardness=5e8,
        tolerance=1e-10,
    )
    assert np.all(np.asarray(worn.status) == 0) and float(worn.peak_dent[-1]) > 1e-7
    assert np.min(worn.gap) > -1e-7 * np.max(worn.approach)
    volume = np.sum(worn.thickness[0] - worn.thickness[-1]) * WIDE.cell_area
    assert float(volume) == pytest.approx(1e-17 * np.sum((loads[1:] + loads[:-1]) / 2), rel=1e-2)
    assert np.all(np.diff(np.asarray(worn.peak_dent)) >= 0.0)


@pytest.mark.long
def test_hardness_gradients_of_a_track():
    """By forward and reverse mode and by differences, for load, hardness, radius and velocity."""
    weights = np.random.default_rng(1).random((32, 32))

    def outcome(q):
        history = jc.slide(
            jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=27e9, G2=60e9, eta2=60e9, nu=0.3)),
            jc.Sphere(5e-3 * q[2]),
            jc.Load(400.0 * q[0]),
            jnp.arange(4.0),
            velocity=0.7 * CELL * q[3],
            grid=WIDE,
            hardness=1.8e9 * q[1],
            tolerance=1e-13,
        )
        dent = history.dent / 1e-6
        return jnp.stack(
            [
                jnp.sum(weights * dent[-1]),
                jnp.sum(weights * history.pressure[-1]) / 1e10,
                history.tangential_force[-1],
            ]
        )

    at = jnp.ones(4)
    run = jax.jit(outcome)
    forward, reverse = jax.jit(jax.jacfwd(outcome))(at), jax.jit(jax.jacrev(outcome))(at)
    np.testing.assert_allclose(forward, reverse, atol=1e-7 * np.max(np.abs(forward)))
    for i, step in enumerate(1e-5 * np.eye(4)):
        slope = (run(at + step) - run(at - step)) / 2e-5
        np.testing.assert_allclose(forward[:, i], slope, rtol=1e-6, atol=1e-6 * np.max(np.abs(slope)))


@pytest.mark.slow
@pytest.mark.parametrize("bonded", [True, False])
def test_hardness_of_a_periodic_layer_on_a_rigid_base_obeys_its_laws(bonded):
    """Waves that are pressed into a layer up to nearly the hardness everywhere, and unloaded. With the displacement by an
    own Fourier series of the closed form for one layer, and its mean by the oedometric modulus, surfaces do not overlap,
    touch where there is pressure, and the dent grows where the pressure is the hardness."""
    G, nu, h, H, n, length = 1e6, 0.4, 1e-4, 2e5, 16, 1e-3
    grid = jc.Grid((n, n), (length / n, length / n), periodic=True)
    x, y = (2.0 * np.pi / length * np.broadcast_to(v, (n, n)) for v in grid.coordinates())
    tip = jc.HeightField(5e-6 * (1.0 - np.cos(x) * np.cos(y)))
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(G, nu), h, bonded=bonded)], None)
    mean = np.array([0.2, 0.5, 0.9, 0.999, 0.5, 0.1]) * H
    found = jc.indent(body, tip, jc.Load(mean * length**2), np.arange(6.0), grid=grid, hardness=H)
    assert not np.any(found.status)
    wave = 2.0 * np.pi * np.fft.fftfreq(n, length / n)
    k = np.hypot(wave[:, None], wave)
    k[0, 0] = 1.0  # of the mean below
    kh, K = k * h, 3.0 - 4.0 * nu
    response = (np.cosh(2 * kh) - 1) / (np.sinh(2 * kh) + 2 * kh)
    if bonded:
        response = (K * np.sinh(2 * kh) - 2 * kh) / (K * np.cosh(2 * kh) + 2 * kh**2 + (1 + K**2) / 2)
    response *= (1.0 - nu) / (G * k)
    response[0, 0] = h * (1.0 - 2.0 * nu) / (2.0 * G * (1.0 - nu))
    p, dent = np.asarray(found.pressure), np.asarray(found.dent)
    elastic = np.fft.ifft2(np.fft.fft2(p) * response).real
    gap = np.asarray(tip.profile(grid)) + elastic + dent - np.asarray(found.approach)[:, None, None]
    size = np.max(dent)
    assert np.max(p) <= H * (1.0 + 1e-12) and np.min(p) == 0.0
    np.testing.assert_allclose(np.mean(p, (1, 2)), mean, rtol=1e-9)
    assert np.min(gap) > -1e-6 * size and np.max(np.where(p > 0.0, gap, 0.0)) < 1e-6 * size
    growth = np.diff(dent, axis=0, prepend=0.0)
    assert np.min(growth) >= 0.0 and np.max(np.where(p < H * (1.0 - 1e-9), growth, 0.0)) == 0.0
    assert np.all(np.max(growth[1:4], (1, 2)) > 0.0) and np.max(growth[4:]) == 0.0


@pytest.mark.parametrize("n", [33, 64])
def test_a_film_under_a_plateau_at_the_hardness_is_shortened_as_in_an_oedometer(n):
    """p/M in the middle, M = 2 G (1 - nu)/(1 - 2 nu): all cells carry H, and a film of a tenth of the contact's radius on a
    rigid base cannot widen there. At the rim it is shortened by half to somewhat more."""
    film = jc.Elastic.from_young(3e9, 0.4)
    body = jc.LayeredHalfSpace([jc.Layer(film, 10e-6)], substrate=None)
    grid, hardness = jc.Grid.square(n=n, width=400e-6), 1e7
    load = jc.Load(hardness * np.pi * (100e-6) ** 2)
    for run in (
        jc.indent(body, BALL, load, [0.0], grid=grid, hardness=hardness),
        jc.slide(body, BALL, load, [0.0, 1.0], velocity=1e-6, grid=grid, hardness=hardness),
    ):
        modulus = 2.0 * film.G * (1.0 - 0.4) / (1.0 - 0.8)
        np.testing.assert_allclose(run.film_strain[0], hardness / modulus, rtol=2e-3)
        assert not np.any(run.status)
