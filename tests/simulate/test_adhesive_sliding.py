"""``slide`` with adhesion: the limits of slow and fast sliding, the balance of energy, and derivatives."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from peeling import BALL, NU, REACH, UNITS, WORK, G, approaching, indent, solid

import jaxcontact as jc

LAW = jc.ExponentialAdhesion(WORK, REACH)
N, WIDTH, STIFFENING = 48, 6.0, 3.0
GRID = jc.Grid.square(n=N, width=WIDTH * UNITS.radius)
STEPS, STEP = 16, 0.5  # of the indenter, in units of radius


def slid(speed, body=None, control=None, law=LAW):
    """A slide of eight units of radius at a speed [units of radius over the retardation time]."""
    times = np.arange(STEPS + 1) * STEP / speed
    control = approaching(np.ones(STEPS + 1)) if control is None else control
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.slide(
            solid(STIFFENING) if body is None else body, BALL, control, times, velocity=speed * UNITS.radius,
            grid=GRID, adhesion=law, save="last",
        )  # fmt: skip


def resting(modulus):
    """Load in units on an elastic half-space, by ``indent``, whose oracles are those of ``test_adhesion``."""
    body = jc.LayeredHalfSpace([], jc.Elastic(modulus, NU))
    return float(indent(body, approaching([1.0]), [0.0], N, WIDTH, LAW)[0][0])


@pytest.mark.long
def test_slow_sliding_takes_the_relaxed_load_and_fast_sliding_the_glassy_one():
    """At a low speed the body has time to relax, at a high speed it responds with its glassy modulus; in between the load is
    between the two limits, and the hysteresis force is largest."""
    slow, middle, fast = (slid(speed) for speed in (1e-2, 1.0, 1e4))
    loads = [float(h.load[-1]) / UNITS.load for h in (slow, middle, fast)]
    relaxed, glassy = resting(G), resting(STIFFENING * G)
    assert loads[0] == pytest.approx(relaxed, abs=2e-4) and loads[2] == pytest.approx(glassy, rel=2e-3)
    assert relaxed + 0.1 < loads[1] < glassy - 0.5
    for history in (slow, middle, fast):
        assert not np.any(history.status) and int(history.jumps[-1]) == 0
    assert float(middle.hysteresis_force[-1]) > 10.0 * float(slow.hysteresis_force[-1])


@pytest.mark.slow
def test_what_the_indenter_is_pushed_with_heats_the_dashpots():
    """Force times speed, from the slopes of the profile, against the dissipation of the internal variables, with attraction
    at both edges; and the adhesive contact resists more than that without adhesion under the same load."""
    history = slid(1.0)
    speed = float(history.velocity[-1, 0])
    power = float(history.hysteresis_power[-1])
    assert float(history.hysteresis_force[-1]) * speed == pytest.approx(power, rel=5e-3)
    assert float(history.load[-1]) < 0.0 and float(history.pressure.min()) < 0.0
    assert float(history.hysteresis_force[-1]) > 0.15 * UNITS.load
    assert history.in_contact.shape == (N, N) and 0 < int(np.sum(history.in_contact)) < N * N // 4
    assert history.friction_coefficient[-1] == 0.0 and "jump energy" in history.summary()


@pytest.mark.slow
def test_a_vanishing_attraction_leaves_the_contact_of_the_other_method():
    """BiCGSTAB on the whole operator finds the contact without adhesion, and none of the repetition."""
    weak, none = slid(1.0, law=jc.ExponentialAdhesion(1e-6 * WORK, REACH)), slid(1.0, law=None)
    assert not np.any(weak.status) and not np.any(none.status)
    np.testing.assert_allclose(weak.load, none.load, rtol=2e-5)
    np.testing.assert_allclose(weak.pressure, none.pressure, atol=1e-4 * float(none.pressure.max()))


@pytest.mark.slow
def test_on_an_elastic_body_sliding_changes_nothing():
    body = jc.LayeredHalfSpace([], jc.Elastic(G, NU))
    path = np.linspace(1.0, -0.5, STEPS + 1)
    history = slid(0.7, body, approaching(path))
    loads, _ = indent(body, approaching(path), np.arange(STEPS + 1.0), N, WIDTH, LAW)
    np.testing.assert_allclose(history.load / UNITS.load, loads, atol=1e-6)
    assert np.all(history.hysteresis_force == 0.0) and not np.any(history.status)


@pytest.mark.long
def test_a_load_that_nothing_carries_separates_the_surfaces():
    """The pull-off load of the relaxed contact is between 1.5 and 2 units, and in motion below 3 units."""
    loads = np.linspace(0.5, -3.0, STEPS + 1)
    history = slid(1.0, control=jc.Load(loads * UNITS.load))
    status = np.asarray(history.status)
    assert status[0] == 0 and status[-1] == jc.Status.PULLED_OFF and np.all(history.pressure == 0.0)
    assert int(history.jumps[-1]) == 1 and float(history.hysteresis_force[-1]) == 0.0


@pytest.mark.long
@pytest.mark.parametrize("load_controlled", [True, False])
def test_derivatives_are_those_of_central_differences(load_controlled):
    """The approach (or load) and the hysteresis force, differentiated by a modulus, the work of adhesion, its range, the
    speed and the control, in reverse and forward mode."""
    grid, times = jc.Grid.square(n=32, width=5.0 * UNITS.radius), 0.4 * np.arange(4.0)

    def ends(q):
        body = jc.LayeredHalfSpace([], jc.StandardLinearSolid(3.0 * G * q[0], 1.5 * G, 1.5 * G, nu=NU))
        law = jc.ExponentialAdhesion(WORK * q[1], REACH * q[2])
        loads, path = jnp.array([-0.3, -0.1, 0.2, 0.4]), jnp.array([0.1, 0.4, 0.3, 0.2])
        control = (
            jc.Load(loads * q[4] * UNITS.load)
            if load_controlled
            else jc.Approach(path * q[4] * UNITS.approach)
        )
        history = jc.slide(
            body, BALL, control, times, velocity=q[3] * UNITS.radius, grid=grid, adhesion=law, tolerance=1e-10,
            save="last", max_iterations=2000,
        )  # fmt: skip
        free = history.approach[-1] / UNITS.approach if load_controlled else history.load[-1] / UNITS.load
        return jnp.stack([free, history.hysteresis_force[-1] / UNITS.load])

    at, step = jnp.ones(5), 1e-5
    run = jax.jit(ends)
    backward = jax.jit(jax.jacrev(ends))(at)
    moved = [(run(at.at[i].add(step)) - run(at.at[i].add(-step))) / (2.0 * step) for i in range(5)]
    np.testing.assert_allclose(backward, jnp.stack(moved, 1), atol=1e-6 * np.abs(backward).max())
    if not load_controlled:
        np.testing.assert_allclose(
            jax.jit(jax.jacfwd(ends))(at), backward, atol=1e-7 * np.abs(backward).max()
        )


def steady(speed, body=None, control=None, law=LAW, grid=GRID, **options):
    """The steady state at a speed [units of radius over the retardation time]."""
    control = jc.Approach(UNITS.approach) if control is None else control
    body = solid(STIFFENING) if body is None else body
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.slide_steady(
            body, BALL, control, velocity=speed * UNITS.radius, grid=grid, adhesion=law, **options
        )


@pytest.mark.slow
def test_the_steady_state_is_the_end_of_a_long_slide_and_pays_for_the_dashpots():
    """The march of ``slide``, which has no wake in closed form; and force times speed against the dissipation."""
    film = jc.Layer(solid(STIFFENING).substrate, UNITS.radius)  # whose history does not leave the grid
    body = jc.LayeredHalfSpace([film], jc.Elastic(2.0 * G, 0.3))
    found, marched = steady(1.0, body), slid(1.0, body)
    assert int(found.status) == 0 and float(found.pressure.min()) < 0.0
    assert float(found.load) == pytest.approx(float(marched.load[-1]), abs=5e-4 * UNITS.load)
    assert float(found.hysteresis_force) == pytest.approx(float(marched.hysteresis_force[-1]), rel=5e-4)
    size = float(np.abs(marched.pressure).max())
    np.testing.assert_allclose(found.pressure, marched.pressure, atol=3e-3 * size)
    power = float(found.hysteresis_power)
    assert float(found.hysteresis_force) * float(found.velocity[0]) == pytest.approx(power, rel=5e-3)
    attraction = np.asarray(LAW.traction(np.maximum(found.gap, 0.0)))
    assert np.all(np.asarray(found.contact_pressure)[~np.asarray(found.in_contact)] == 0.0)
    carried = np.asarray(found.pressure) + attraction  # the solver averages the attraction between cells
    inside = np.asarray(found.in_contact)
    near = np.abs(np.asarray(found.contact_pressure) - carried)[inside]
    assert np.median(near) < 0.02 * size and 30 < inside.sum() < 600


@pytest.mark.slow
@pytest.mark.parametrize(
    "control",
    [jc.Approach(0.6 * UNITS.approach), jc.Load(-1.2 * UNITS.load)],
    ids=["approach", "load"],
)
def test_on_an_elastic_body_the_steady_state_is_the_contact_at_rest(control):
    grid = jc.Grid.square(n=20, width=6.0 * UNITS.radius)
    body = jc.LayeredHalfSpace([], jc.Elastic(G, NU))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rest = jc.indent(body, BALL, control, [0.0], grid=grid, adhesion=LAW)
    found = steady(0.7, body, control, grid=grid)
    assert not np.any(rest.status) and int(found.status) == 0 and float(found.hysteresis_force) == 0.0
    np.testing.assert_allclose(
        found.pressure, rest.pressure[0], atol=1e-6 * float(np.abs(rest.pressure).max())
    )
    assert float(found.approach) == pytest.approx(float(rest.approach[0]), abs=1e-6 * UNITS.approach)


@pytest.mark.long
def test_derivatives_of_the_steady_state_are_those_of_central_differences():
    grid = jc.Grid.square(n=24, width=5.5 * UNITS.radius)

    def of(q):
        body = jc.LayeredHalfSpace([], jc.StandardLinearSolid(3.0 * G * q[0], 1.5 * G, 1.5 * G, nu=NU))
        law = jc.ExponentialAdhesion(WORK * q[1], REACH * q[2])
        found = jc.slide_steady(
            body, BALL, jc.Load(-0.5 * q[4] * UNITS.load), velocity=q[3] * UNITS.radius, grid=grid, adhesion=law,
            tolerance=1e-11, max_iterations=4000,
        )  # fmt: skip
        return jnp.stack([found.approach / UNITS.approach, found.hysteresis_force / UNITS.load])

    at, step = jnp.ones(5), 1e-5
    run = jax.jit(of)
    backward = jax.jit(jax.jacrev(of))(at)
    moved = [(run(at.at[i].add(step)) - run(at.at[i].add(-step))) / (2.0 * step) for i in range(5)]
    np.testing.assert_allclose(backward, jnp.stack(moved, 1), atol=1e-6 * np.abs(backward).max())
    np.testing.assert_allclose(jax.jit(jax.jacfwd(of))(at), backward, atol=1e-6 * np.abs(backward).max())


SMALL = jc.Grid.square(n=24, width=7.0 * UNITS.radius)
DISSIMILAR = jc.LayeredHalfSpace([], jc.Elastic(G, 0.2))  # the traction of friction moves its surface


@pytest.mark.slow
def test_friction_is_that_of_the_pressure_that_contact_carries_and_moves_the_surface():
    """The contact pressure is that of a contact without adhesion on the surface that the attraction has drawn up, a height
    field, by the other solver, whose operator has the friction in it."""
    control = jc.Approach(0.5 * UNITS.approach)
    weak = jc.ExponentialAdhesion(0.4 * WORK, 0.7 * REACH)
    found = steady(0.7, DISSIMILAR, control, law=weak, grid=SMALL, friction=0.3)
    assert int(found.status) == 0
    attraction = np.asarray(found.contact_pressure - found.pressure)
    drawn = jc.deflection(DISSIMILAR, SMALL, attraction, [0.0]).displacement.reshape(SMALL.shape)
    surface = np.asarray(found.profile) - np.asarray(drawn)
    deeper = jc.Approach(0.5 * UNITS.approach - surface.min())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        other = jc.slide_steady(
            DISSIMILAR, jc.HeightField(-surface), deeper, velocity=UNITS.radius, grid=SMALL, friction=0.3
        )
    size = float(other.pressure.max())
    np.testing.assert_allclose(found.contact_pressure, other.pressure, atol=1e-5 * size)
    np.testing.assert_allclose(found.traction[0], 0.3 * np.asarray(other.pressure), atol=1e-5 * size)
    assert float(found.coulomb_force) == pytest.approx(0.3 * float(other.load), rel=1e-6)
    skew = np.abs(np.asarray(other.pressure) - np.asarray(other.pressure)[::-1]).max()
    assert skew > 0.02 * size and float(found.load) < 0.3 * float(other.load)


@pytest.mark.long
def test_a_shear_strength_acts_on_all_of_the_contact_and_without_attraction_friction_is_what_it_was():
    control = jc.Approach(0.5 * UNITS.approach)
    sheared = steady(0.7, DISSIMILAR, control, grid=SMALL, friction=0.1, shear_strength=1e5)
    force = 0.1 * float(jnp.sum(sheared.contact_pressure)) * float(SMALL.cell_area)
    assert int(sheared.status) == 0
    assert float(sheared.coulomb_force) == pytest.approx(force + 1e5 * float(sheared.contact_area), rel=1e-9)
    assert float(np.asarray(sheared.traction).sum() * SMALL.cell_area) == pytest.approx(sheared.coulomb_force)
    weak, none = (
        steady(0.7, DISSIMILAR, control, law=law, grid=SMALL, friction=0.3)
        for law in (jc.ExponentialAdhesion(1e-8 * WORK, REACH), None)
    )
    np.testing.assert_allclose(weak.pressure, none.pressure, atol=1e-6 * float(none.pressure.max()))
    assert float(weak.coulomb_force) == pytest.approx(float(none.coulomb_force), rel=1e-6)


@pytest.mark.long
def test_derivatives_with_friction_are_those_of_central_differences():
    grid = jc.Grid.square(n=20, width=6.0 * UNITS.radius)

    def of(q):
        body = jc.LayeredHalfSpace([], jc.StandardLinearSolid(3.0 * G * q[0], 1.5 * G, 1.5 * G, nu=0.3))
        law = jc.ExponentialAdhesion(WORK * q[1], REACH * q[2])
        found = jc.slide_steady(
            body, BALL, jc.Load(-0.5 * q[4] * UNITS.load), velocity=UNITS.radius, grid=grid, adhesion=law,
            friction=0.2 * q[3], shear_strength=2e4 * q[5], tolerance=1e-11, max_iterations=4000,
        )  # fmt: skip
        return jnp.stack([found.approach / UNITS.approach, found.coulomb_force / UNITS.load])

    at, step = jnp.ones(6), 1e-5
    run = jax.jit(of)
    backward = jax.jit(jax.jacrev(of))(at)
    moved = [(run(at.at[i].add(step)) - run(at.at[i].add(-step))) / (2.0 * step) for i in range(6)]
    np.testing.assert_allclose(backward, jnp.stack(moved, 1), atol=1e-6 * np.abs(backward).max())
    np.testing.assert_allclose(jax.jit(jax.jacfwd(of))(at), backward, atol=1e-6 * np.abs(backward).max())


@pytest.mark.long
def test_friction_in_a_slide_tends_to_that_of_the_steady_state():
    """A film: its history does not leave the grid, and a traction displaces its surface along the normal too."""
    film = jc.Layer(jc.StandardLinearSolid(2.0 * G, 2.0 * G, 2.0 * G, nu=0.3), 0.7 * UNITS.radius)
    body = jc.LayeredHalfSpace([film], jc.Elastic(2.0 * G, 0.3))
    control, grid = jc.Approach(0.5 * UNITS.approach), jc.Grid.square(n=24, width=7.0 * UNITS.radius)
    weak = jc.ExponentialAdhesion(0.4 * WORK, 0.7 * REACH)
    options = {"grid": grid, "friction": 0.3, "shear_strength": 2e4}
    found, times = steady(1.0, body, control, law=weak, **options), 0.25 * np.arange(25)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        history = jc.slide(
            body, BALL, control, times, velocity=UNITS.radius, adhesion=weak, save="last", **options
        )
    assert int(found.status) == 0 and not np.any(history.status)
    assert float(history.load[-1]) == pytest.approx(float(found.load), abs=1e-3 * UNITS.load)
    assert float(history.coulomb_force[-1]) == pytest.approx(float(found.coulomb_force), rel=1e-3)
    assert float(history.hysteresis_force[-1]) == pytest.approx(float(found.hysteresis_force), rel=2e-2)
    size = float(found.contact_pressure.max())
    np.testing.assert_allclose(history.contact_pressure, found.contact_pressure, atol=1e-2 * size)
    np.testing.assert_allclose(history.traction, found.traction, atol=4e-3 * size)
    at_rest = steady(1.0, body, control, law=weak, grid=grid)
    assert np.abs(found.pressure - at_rest.pressure).max() > 0.05 * size  # what friction does to the pressure


@pytest.mark.long
def test_derivatives_of_a_slide_with_friction_are_those_of_central_differences():
    grid, times = jc.Grid.square(n=16, width=6.0 * UNITS.radius), 0.4 * np.arange(3.0)

    def of(q):
        body = jc.LayeredHalfSpace([], jc.StandardLinearSolid(3.0 * G * q[0], 1.5 * G, 1.5 * G, nu=0.3))
        law = jc.ExponentialAdhesion(WORK * q[1], REACH * q[2])
        history = jc.slide(
            body, BALL, jc.Approach(jnp.array([0.3, 0.5, 0.6]) * q[4] * UNITS.approach), times,
            velocity=UNITS.radius, grid=grid, adhesion=law, friction=0.2 * q[3], shear_strength=2e4 * q[5],
            tolerance=1e-11, max_iterations=4000, save="last",
        )  # fmt: skip
        return jnp.stack([history.load[-1] / UNITS.load, history.coulomb_force[-1] / UNITS.load])

    at, step = jnp.ones(6), 1e-5
    run = jax.jit(of)
    forward = jax.jit(jax.jacfwd(of))(at)
    moved = [(run(at.at[i].add(step)) - run(at.at[i].add(-step))) / (2.0 * step) for i in range(6)]
    np.testing.assert_allclose(forward, jnp.stack(moved, 1), atol=1e-6 * np.abs(forward).max())
    np.testing.assert_allclose(jax.jit(jax.jacrev(of))(at), forward, atol=1e-6 * np.abs(forward).max())


@pytest.mark.long
@pytest.mark.parametrize("velocity", [0.7, -0.7])
def test_the_speed_of_a_steady_slide_has_no_effect_on_an_elastic_body(velocity):
    """The derivative by the speed is zero in forward mode too, in which the contact with friction is a linear system whose
    right side is zero."""
    body, grid = jc.LayeredHalfSpace([], jc.Elastic(G, NU / 2.0)), jc.Grid.square(16, WIDTH * UNITS.radius)

    def load(velocity):
        steady = jc.slide_steady(
            body, BALL, jc.Approach(UNITS.approach), velocity=velocity, friction=0.3, grid=grid, adhesion=LAW
        )
        return steady.load

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert float(jax.jacfwd(load)(velocity)) == 0.0
        slopes = np.asarray(jax.jacfwd(load)(np.array([velocity, 0.0])))
    assert slopes[0] == 0.0 and np.isfinite(slopes[1])
