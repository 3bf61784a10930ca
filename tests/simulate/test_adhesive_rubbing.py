"""``rub`` with adhesion: the contact of ``indent`` where nothing wears, that of ``slide_steady`` at the end of a path, wear
by the pressure that contact carries, derivatives."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from peeling import BALL, UNITS, G
from test_adhesive_films import GRID, LAW, along, averages, film, pressed, thickness

import jaxcontact as jc

CREEPS = jc.StandardLinearSolid(0.9 * G, 0.45 * G, 0.45 * G, nu=0.45)
PATH, TIMES, SPEED = [1.0, 0.8, 0.7], np.array([0.0, 0.4, 0.8]), 2e-6


def rubbed(coefficient, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.rub(
            film(thickness(swing=0.3), CREEPS), BALL, along(PATH), TIMES, velocity=SPEED, law=jc.Archard(coefficient),
            friction=0.3, grid=GRID, adhesion=LAW, **options,
        )  # fmt: skip


@pytest.mark.slow
def test_without_wear_it_is_the_contact_at_rest_and_wear_is_that_of_the_pressure_that_contact_carries():
    """Archard: the volume is the coefficient times the way times the sum of net pressure and attraction in contact, here
    from the gap and averages of the law that are written out; what is pulled across a gap does not wear."""
    rest = pressed(film(thickness(swing=0.3), CREEPS), along(PATH), TIMES)
    still, worn = rubbed(0.0), rubbed(1e-15)
    assert not np.any(rest.status) and not np.any(still.status) and not np.any(worn.status)
    size = float(np.abs(rest.pressure).max())
    # The kernels of a film that may wear are a series in all thicknesses from none to twice the largest, here of twelve
    # terms, that of a film that stays in those it has, of six; their errors are 1e-6 and below 1e-5 of the response, of
    # which near the edge of contact the attraction makes ten times as much. (Eight terms for both made 1.4e-3.)
    np.testing.assert_allclose(still.pressure, rest.pressure, atol=1e-4 * size)
    assert np.all(still.thickness == still.thickness[0]) and np.all(still.jumps == rest.jumps)

    matrix, weights = averages(GRID.shape[0])
    carried = []
    for gap, pressure in zip(np.maximum(worn.gap, 0.0), np.asarray(worn.pressure), strict=True):
        at_points = np.outer(weights, weights) * np.asarray(LAW.traction(matrix @ gap @ matrix.T))
        carried.append(pressure + matrix.T @ at_points @ matrix)
    carried = np.array(carried)
    np.testing.assert_allclose(worn.contact_pressure, carried, atol=1e-5 * size)
    forces = np.sum(carried, (1, 2)) * float(GRID.cell_area)
    assert np.all(forces > 2.0 * np.abs(worn.load))
    lost = np.asarray(worn.thickness[0] - worn.thickness[-1])
    volume = 1e-15 * SPEED * np.trapezoid(forces, TIMES)
    assert lost.sum() * float(GRID.cell_area) == pytest.approx(volume, rel=1e-5)
    apart = np.all(np.asarray(worn.contact_pressure) == 0.0, 0)
    assert np.all(lost[apart] == 0.0) and np.any(np.asarray(worn.pressure)[:, apart] < -0.1 * size)
    work = np.asarray(worn.friction_work).sum() * float(GRID.cell_area)
    assert work == pytest.approx(0.3 * SPEED * np.trapezoid(forces, TIMES), rel=1e-5)


@pytest.mark.long
def test_a_shear_strength_acts_on_all_that_touches_beside_friction_and_drives_growth():
    """Work: the strength times the way times the area in contact, here of the cells whose gap is zero. Growth by shear
    stress at a given temperature: exp(-(Q - tau V)/(k T)) times the rate, in contact alone, without friction."""
    strength = 2e4 * np.linspace(1.0, 2.0, GRID.shape[0])[:, None] * np.ones(GRID.shape)
    plain, sheared = rubbed(0.0), rubbed(0.0, shear_strength=strength)
    touching = np.asarray(plain.gap) <= 1e-9 * float(plain.approach.max())
    assert 20 < touching[0].sum() < touching.size / 30
    np.testing.assert_array_equal(touching, plain.contact_pressure > 0.0)
    work = np.trapezoid(touching * strength, TIMES, axis=0) * SPEED
    np.testing.assert_allclose(sheared.friction_work - plain.friction_work, work, atol=1e-9 * work.max())
    np.testing.assert_allclose(sheared.pressure, plain.pressure, atol=1e-9 * float(plain.pressure.max()))

    # Q/(k T) = 20 and tau V/(k T) = 1 .. 2
    temperature, boltzmann = 300.0, 1.380649e-23
    law = jc.StressActivated(
        1e-3, 20.0 * boltzmann * temperature, boltzmann * temperature / 2e4, temperature, stress="shear"
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        grown = jc.rub(
            film(thickness(swing=0.3), CREEPS), BALL, along(PATH), TIMES, velocity=SPEED, law=law, grid=GRID,
            adhesion=LAW, shear_strength=strength,
        )  # fmt: skip
    stays = np.all(touching, 0)
    rate = 1e-3 * np.exp(-20.0 + strength / 2e4)
    assert float((rate * TIMES[-1]).max()) < 1e-2 * float(grown.thickness[0].min())  # touches as before
    added = np.asarray(grown.thickness[-1] - grown.thickness[0])
    np.testing.assert_allclose(added[stays], (rate * TIMES[-1])[stays], rtol=1e-9)


@pytest.mark.long
def test_the_end_of_a_path_over_a_creeping_film_is_steady_sliding():
    """With 1, 2, 4 and 8 substeps a cell the load differs by 2.6e-3, -0.5e-3, -0.8e-3 and -0.9e-3 units: the first is the
    error of the time steps, the last that of cells at rest in the body beside cells at rest under the indenter. The pressure
    differs by the latter: in the mean by 5.0, 2.4, 1.3 and 0.6 % with cells of 0.4, 0.27, 0.2 and 0.13 units, nearly as the
    second power of the cell, and most, by 5 % with cells of 0.2, in single cells at the edge, which the contact enters or
    leaves at once. A longer way (32 cells) changes neither."""
    n, steps = 40, 16
    grid, solid = jc.Grid.square(n=n, width=8.0 * UNITS.radius), jc.StandardLinearSolid(G, G, G, nu=0.45)
    body, cell = film(0.5 * UNITS.radius, solid), 0.2 * UNITS.radius
    control, speed = jc.Approach(0.8 * UNITS.approach), 0.4 * UNITS.radius
    places = cell * (np.arange(steps + 1) - steps / 2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        steady = jc.slide_steady(body, BALL, control, velocity=speed, grid=grid, adhesion=LAW)
        run = jc.rub(
            body, BALL, control, (places - places[0]) / speed, path=places, law=None, grid=grid, adhesion=LAW, save="last",
            substeps=4,
        )  # fmt: skip
    assert int(steady.status) == 0 and not np.any(run.status)
    assert float(run.load[-1]) == pytest.approx(float(steady.load), abs=1e-3 * UNITS.load)
    shifted = np.roll(np.asarray(steady.pressure), steps // 2, 0)
    assert float(steady.hysteresis_force) > 0.04 * UNITS.load
    assert np.sum(np.abs(run.pressure - shifted)) < 1.5e-2 * np.sum(np.abs(shifted))
    np.testing.assert_allclose(run.pressure, shifted, atol=5.5e-2 * np.abs(shifted).max())
    assert not np.allclose(shifted, shifted[::-1], atol=0.2 * shifted.max())


@pytest.mark.long
def test_derivatives_are_those_of_central_differences():
    """By the modulus of the film, the work and range of the attraction, the coefficient of wear and the approach."""

    def ends(q):
        solid = jc.StandardLinearSolid(0.9 * G * q[0], 0.45 * G, 0.45 * G, nu=0.45)
        law = jc.ExponentialAdhesion(LAW.work * q[1], LAW.range * q[2])
        control, wear = jc.Approach(jnp.asarray(PATH) * q[4] * UNITS.approach), jc.Archard(1e-11 * q[3])
        options = {"grid": GRID, "adhesion": law, "tolerance": 1e-11, "max_iterations": 2000}
        run = jc.rub(
            film(thickness(swing=0.3), solid),
            BALL,
            control,
            TIMES,
            velocity=1e-3 * SPEED,
            law=wear,
            **options,
        )
        lost = jnp.sum(run.thickness[0] - run.thickness[-1]) / UNITS.radius
        return jnp.stack([run.load[-1] / UNITS.load, lost * 1e3])

    at, step = jnp.ones(5), 1e-5
    run = jax.jit(ends)
    backward = jax.jit(jax.jacrev(ends))(at)
    moved = [(run(at.at[i].add(step)) - run(at.at[i].add(-step))) / (2.0 * step) for i in range(5)]
    np.testing.assert_allclose(backward, jnp.stack(moved, 1), atol=1e-6 * np.abs(backward).max())
    np.testing.assert_allclose(jax.jit(jax.jacfwd(ends))(at), backward, atol=1e-6 * np.abs(backward).max())
