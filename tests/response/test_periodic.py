"""Periodic grids and plane strain against closed forms: Westergaard, full contact, line contact of Hertz."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc

NU, J0, J1, TAU = 0.3, 1e-9, 3e-9, 2.0
SOLID = jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=1.0 / J0, G2=1.0 / J1, eta2=TAU / J1, nu=NU))
TIMES = np.array([0.0, 0.5, 1.0])
CREEP = J0 + J1 * (1.0 - np.exp(-TIMES / TAU))
LENGTH, AMPLITUDE = 1e-3, 1e-6
WAVENUMBER = 2.0 * np.pi / LENGTH
FULL = WAVENUMBER * AMPLITUDE / ((1.0 - NU) * J0)  # mean pressure that flattens the wave at once
WAVES = jc.Grid(shape=(128, 4), spacing=(LENGTH / 128, LENGTH / 32), periodic=True)
ROUGH = jc.Grid(shape=(16, 12), spacing=(1e-6, 1e-6), periodic=True)
STRIP = jc.Grid(shape=(16, 12), spacing=(1e-6, 1e-6), periodic=(False, True))
LINE = jc.Grid(shape=(16, 1), spacing=(1e-6, 1e-6), periodic=(False, True))


def wave(grid):
    x, y = grid.coordinates()
    return AMPLITUDE * jnp.cos(WAVENUMBER * x) + 0.0 * y


def press(load, body=SOLID, grid=WAVES, indenter=None, times=TIMES, **more):
    indenter = jc.HeightField(wave(grid)) if indenter is None else indenter
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.indent(
            body, indenter, jc.Load(load), times, grid=grid, tolerance=1e-10, substeps=40, **more
        )


def area_of(grid):
    return float(grid.width[0] * grid.width[1])


# waves ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_wave_in_partial_contact_has_the_pressure_of_westergaard_and_its_contact_creeps_with_the_compliance():
    """p = 2 pm cos(kx/2) sqrt(sin^2(ka/2) - sin^2(kx/2))/sin^2(ka/2), sin^2(ka/2) = pm/p*, p* = k amplitude/((1 - nu) J).

    Contact grows under a held load, so that it is at all times that of an elastic solid of compliance J(t). Source:
    H. M. Westergaard, J. Appl. Mech. 6 (1939) A49.
    """
    mean = 0.15 * FULL
    history = press(mean * area_of(WAVES))
    assert np.all(np.asarray(history.status) == jc.Status.FINE)
    x = np.asarray(WAVES.axes()[0])
    sine = np.sqrt(mean / FULL)
    inside = np.sqrt(np.maximum(sine**2 - np.sin(WAVENUMBER * x / 2.0) ** 2, 0.0))
    exact = 2.0 * mean * np.cos(WAVENUMBER * x / 2.0) * inside / sine**2
    found = np.asarray(history.pressure)[0]
    assert np.ptp(found, axis=1).max() < 1e-6 * mean
    assert np.mean(np.abs(found[:, 0] - exact)) < 1e-3 * mean
    np.testing.assert_allclose(found.max(), exact.max(), rtol=1e-3)
    half = np.arcsin(np.sqrt(mean / FULL * CREEP / J0)) / WAVENUMBER * 2.0
    width = np.asarray(history.contact_area) / float(WAVES.width[1])
    np.testing.assert_allclose(width / 2.0, half, atol=float(WAVES.spacing[0]))
    np.testing.assert_allclose(np.mean(np.asarray(history.displacement), (1, 2)), 0.0, atol=1e-12 * AMPLITUDE)


@pytest.mark.slow
def test_a_flattened_wave_relaxes_with_the_modulus():
    """In full contact p - pm = G(t) k amplitude/(1 - nu) cos(k x), with a load above the full one."""
    history = press(1.2 * FULL * area_of(WAVES))
    relaxed = 1.0 / (J0 + J1)
    modulus = relaxed + (1.0 / J0 - relaxed) * np.exp(-TIMES / TAU * (J0 + J1) / J0)
    shape = np.asarray(wave(WAVES)) * WAVENUMBER / (1.0 - NU)
    exact = 1.2 * FULL + shape * modulus[:, None, None]
    assert np.all(np.asarray(history.status) == jc.Status.FINE)
    np.testing.assert_allclose(history.pressure, exact, rtol=0.0, atol=2e-4 * FULL)
    np.testing.assert_allclose(history.pressure[0], exact[0], rtol=0.0, atol=1e-9 * FULL)
    mean_gap_at_first_touch = jnp.max(wave(WAVES))
    np.testing.assert_allclose(history.approach, mean_gap_at_first_touch, rtol=1e-9)


@pytest.mark.slow
def test_a_wave_drawn_over_a_solid_in_full_contact_meets_its_complex_modulus():
    """p - pm = k amplitude/(1 - nu) Re[G*(k v) exp(-i k x)] in the indenter's frame; the loss modulus is friction."""
    speed, grid = 1.7 / WAVENUMBER / TAU, jc.Grid(shape=(32, 5), spacing=(LENGTH / 32, 1e-4), periodic=True)
    load = 1.5 * FULL * area_of(grid)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        steady = jc.slide_steady(
            SOLID, jc.HeightField(wave(grid)), jc.Load(load), velocity=speed, grid=grid, tolerance=1e-10
        )
    omega = WAVENUMBER * speed
    modulus = 1.0 / (J0 + J1 / (1.0 + 1j * omega * TAU))
    x = np.asarray(grid.axes()[0])[:, None]
    # a material point meets cos k(X - v t), the real part of exp(-i k X) exp(i omega t)
    exact = 1.5 * FULL + WAVENUMBER * AMPLITUDE / (1.0 - NU) * np.real(modulus * np.exp(-1j * WAVENUMBER * x))
    exact = np.broadcast_to(exact, (32, 5))
    assert int(steady.status) == jc.Status.FINE
    np.testing.assert_allclose(steady.pressure, exact, rtol=0.0, atol=1e-8 * FULL)
    power = 0.5 * area_of(grid) * (WAVENUMBER * AMPLITUDE) ** 2 / (1.0 - NU) * modulus.imag * speed
    np.testing.assert_allclose(steady.power, power, rtol=1e-7)
    np.testing.assert_allclose(steady.hysteresis_force * speed, power, rtol=2e-6)  # of slopes of the profile


# a line contact --------------------------------------------------------------------------------------------


def test_a_line_contact_is_that_of_hertz():
    """a^2 = 2 P' R (1 - nu) J/pi, p0 = 2 P'/(pi a), and the approach from the surface at a distance d:
    (1 - nu) J P'/pi (ln(2 d/a) + 1/2). K. L. Johnson, Contact Mechanics (1985), sections 4.2 and 5.6."""
    n, radius, half, dy, compliance = 256, 1e-2, 1e-4, 3e-3, (1.0 - NU) * CREEP
    load = np.pi * half**2 / (2.0 * radius * compliance[0])
    half = half * np.sqrt(CREEP / J0)
    grid = jc.Grid(shape=(n, 1), spacing=(6e-4 / n, dy), periodic=(False, True))
    history = press(load * dy, grid=grid, indenter=jc.Cylinder(radius, dy))
    assert np.all(np.asarray(history.status) == jc.Status.FINE)
    x, cell = np.asarray(grid.axes()[0]), float(grid.spacing[0])
    p0 = 2.0 * load / np.pi / half[0]
    exact = p0 * np.sqrt(np.maximum(1.0 - (x / half[0]) ** 2, 0.0))
    found = np.asarray(history.pressure)[0, :, 0]
    assert np.sum(np.abs(found - exact)) < 1e-3 * np.sum(exact)
    np.testing.assert_allclose(found.max(), p0, rtol=1e-3)
    np.testing.assert_allclose(history.contact_radius, half, atol=cell / 10.0)
    approach = compliance * load / np.pi * (np.log(2.0 * n * cell / half) + 0.5)
    np.testing.assert_allclose(history.approach, approach, rtol=1e-4)


# derivatives, and free space ------------------------------------------------------------------------------


def on_half_space(stiffer, thicker):
    return jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=80e9 * stiffer, G2=1e11, eta2=1e11 * thicker))


def on_film(stiffer, thicker):
    film = jc.StandardLinearSolid(G1=1e9 * stiffer, G2=1e9, eta2=1e9, nu=0.3)
    return jc.LayeredHalfSpace([jc.Layer(film, 1e-6 * thicker)], jc.Elastic.from_young(210e9, nu=0.3))


def load(grid, profile):
    return jc.Load(2e6 * area_of(grid))


def approach(grid, profile):
    return jc.Approach(0.4 * jnp.mean(profile))


@pytest.mark.parametrize(
    "body_of, grid, control_of",
    [
        pytest.param(on_half_space, ROUGH, load, id="half-space, periodic, load", marks=pytest.mark.slow),
        pytest.param(on_film, ROUGH, approach, id="film, periodic, approach", marks=pytest.mark.slow),
        pytest.param(on_film, LINE, load, id="film, plane strain, load", marks=pytest.mark.long),
        pytest.param(on_film, STRIP, load, id="film, periodic along y, load", marks=pytest.mark.long),
    ],
)
def test_derivatives_are_those_of_central_differences(body_of, grid, control_of):
    """Of the squares of pressure under a control, heights and a body that change, with creep; under jit, and mapped."""
    x, y = grid.coordinates()
    bumps = 1e-9 * (jnp.cos(2.0 * np.pi * (x + 0.1e-6) / 4e-6) + jnp.sin(2.0 * np.pi * (x + 2.0 * y) / 16e-6))
    profile = jc.HeightField(bumps - x**2 / 1e-2).profile(grid)

    def squares(change):
        more, taller, *body = change
        rough = jc.HeightField(taller * bumps - x**2 / 1e-2)
        control = jax.tree.map(lambda value: more * value, control_of(grid, profile))
        history = jc.indent(
            body_of(*body), rough, control, [0.0, 1.0], grid=grid, save="last", tolerance=1e-12
        )
        return jnp.sum(history.pressure**2) * 1e-12

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        gradient = np.asarray(jax.jit(jax.grad(squares))(jnp.ones(4)))
        step = 1e-5
        ends = np.asarray(jax.jit(jax.vmap(squares))(1.0 + step * jnp.concatenate([jnp.eye(4), -jnp.eye(4)])))
    assert np.all(gradient != 0.0)
    np.testing.assert_allclose(gradient, (ends[:4] - ends[4:]) / (2.0 * step), rtol=1e-5)


@pytest.mark.long
def test_a_small_contact_in_a_large_cell_is_that_of_free_space():
    """A ball on a creeping film, 10 cells across a radius: within the error of either grid, and its neighbours' share."""
    steel, film = jc.Elastic.from_young(210e9, nu=0.3), jc.StandardLinearSolid(0.75e9, 13.89e6, 120.9e9)
    body, ball = jc.LayeredHalfSpace([jc.Layer(film, 5e-6)], steel), jc.Sphere(1e-3, steel)
    free = jc.Grid.square(128, 150e-6)
    both = [
        press(0.005, body, grid, ball, [0.0, 100.0])
        for grid in (free, jc.Grid(free.shape, free.spacing, periodic=True))
    ]
    peaks = [np.max(history.pressure, (1, 2)) for history in both]
    np.testing.assert_allclose(*peaks, rtol=2e-3)
    np.testing.assert_allclose(both[0].smooth_area, both[1].smooth_area, rtol=4e-3)
    np.testing.assert_allclose(both[0].film_strain, both[1].film_strain, rtol=2e-3)


@pytest.mark.long
def test_a_long_slide_over_a_periodic_film_becomes_the_steady_one():
    steel, film = jc.Elastic.from_young(210e9, nu=0.3), jc.StandardLinearSolid(1e9, 2e9, 1e9)
    body, ball = jc.LayeredHalfSpace([jc.Layer(film, 5e-6)], steel), jc.Sphere(1e-3, steel)
    grid = jc.Grid(shape=(32, 27), spacing=(3e-6, 3e-6), periodic=True)
    given, moving = {"grid": grid, "tolerance": 1e-10}, {"velocity": (2e-5, 1e-5)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        late = jc.slide(body, ball, jc.Load(0.02), [0.0, 20.0], substeps=80, save="last", **given, **moving)
        steady = jc.slide_steady(body, ball, jc.Load(0.02), **given, **moving)
    assert int(late.status[-1]) == int(steady.status) == jc.Status.FINE
    np.testing.assert_allclose(late.pressure, steady.pressure, rtol=0.0, atol=1e-5 * np.max(steady.pressure))
    np.testing.assert_allclose(late.friction_coefficient[-1], steady.friction_coefficient, rtol=1e-4)
    np.testing.assert_allclose(late.power[-1], steady.power, rtol=1e-4)
