"""Steady sliding over a film whose thickness varies across the track: limits, a long pass in time, energy, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:only", "ignore:film strain")]
BASE, BALL = jc.Elastic(G=80e9, nu=0.3), jc.Sphere(1e-3)
FILM = jc.StandardLinearSolid(G1=2e9, G2=1e9, eta2=1e9, nu=0.35)  # relaxes over 0.3 to 1 s
GRID = jc.Grid((24, 16), (2.5e-6, 2.5e-6))
LOAD, SPEED = jc.Load(0.15), 15e-6
ACROSS = 4e-7 * (1.0 + 0.15 * np.cos(2 * np.pi * (np.arange(16) - 6.5) / 16))
VARYING = np.broadcast_to(ACROSS, GRID.shape)


def slid(thickness, velocity=SPEED, film=FILM, **options):
    body = jc.LayeredHalfSpace([jc.Layer(film, thickness)], BASE)
    given = {"grid": GRID, "tolerance": 1e-10} | options
    return jc.slide_steady(body, BALL, LOAD, velocity=velocity, **given)


def test_a_uniform_map_is_the_layer():
    layer, varying = slid(4e-7), slid(np.full(GRID.shape, 4e-7))
    for field in (
        "pressure",
        "displacement",
        "approach",
        "film_strain",
        "hysteresis_force",
        "hysteresis_power",
    ):
        expected = np.asarray(getattr(layer, field))
        found, largest = getattr(varying, field), np.abs(expected).max()
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * largest, err_msg=field)
    assert layer.friction_coefficient > 1e-4


@pytest.mark.parametrize(("velocity", "G"), [(1.0, 2e9), (0.0, 2e9 / 3.0)], ids=["fast", "at rest"])
def test_limits_are_those_of_elastic_films(velocity, G):
    """By ``indent``, whose operator is symmetric: the film's instantaneous and its relaxed modulus."""
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(G, 0.35), VARYING)], BASE)
    elastic = jc.indent(body, BALL, LOAD, [0.0], grid=GRID, tolerance=1e-10)
    found = slid(VARYING, velocity)
    np.testing.assert_allclose(found.pressure, elastic.pressure[0], atol=1e-3 * float(elastic.pressure.max()))
    assert float(found.approach) == pytest.approx(float(elastic.approach[0]), rel=1e-4)
    uniform = slid(float(ACROSS.mean()), velocity)
    assert np.abs(uniform.pressure - found.pressure).max() > 0.02 * float(found.pressure.max())


@pytest.mark.long
def test_a_long_pass_becomes_the_steady_state():
    """In the frame of the body, by ``rub`` without a law: the memory of another module, which no wave number convects."""
    wide = jc.Grid((64, 16), (2.5e-6, 2.5e-6))
    path = np.arange(-55e-6, 55.1e-6, 2.5e-6)
    times = (path - path[0]) / SPEED
    thickness = np.broadcast_to(ACROSS, wide.shape)
    body = jc.LayeredHalfSpace([jc.Layer(FILM, thickness)], BASE)
    run = jc.rub(body, BALL, LOAD, times, path=path, law=None, grid=wide, substeps=4, save="last")
    steady = slid(thickness, grid=wide)
    moved = np.roll(np.asarray(run.pressure), -22, 0)  # by the 55 um of the last position
    off = np.abs(moved - steady.pressure).max() / float(steady.pressure.max())
    assert off < 0.02
    backwards = np.abs(moved - slid(thickness, -SPEED, grid=wide).pressure).max() / float(
        steady.pressure.max()
    )
    assert backwards > 4.0 * off


def test_the_power_of_the_force_is_that_of_the_dashpots():
    """Nearly: the force is a sum over the cells of a small contact. And that of the way back is as large."""
    run = slid(VARYING)
    ratio = lambda run: float(run.hysteresis_power) / (float(run.hysteresis_force) * SPEED)
    assert ratio(run) == pytest.approx(1.0, rel=0.05)
    reverse = slid(VARYING, -SPEED)
    np.testing.assert_allclose(reverse.pressure[::-1], run.pressure, atol=1e-6 * float(run.pressure.max()))


@pytest.mark.long
def test_derivatives_by_thickness_and_speed():
    def found(scale):
        run = slid(jnp.broadcast_to(ACROSS * scale[:16], GRID.shape), SPEED * scale[16], tolerance=1e-11)
        return jnp.stack([jnp.sum(run.pressure**2) * 1e-18, run.approach * 1e6])

    one, run = jnp.ones(17), jax.jit(found)
    reverse = jax.jit(jax.jacrev(found))(one)
    for direction in (np.append(np.linspace(-1.0, 1.0, 16), 0.0), np.eye(17)[16]):
        _, forward = jax.jvp(run, (one,), (jnp.asarray(direction),))
        np.testing.assert_allclose(reverse @ direction, forward, rtol=1e-7)
        difference = (run(one + 1e-4 * direction) - run(one - 1e-4 * direction)) / 2e-4
        np.testing.assert_allclose(forward, difference, rtol=1e-4, atol=1e-6 * np.abs(forward).max())
