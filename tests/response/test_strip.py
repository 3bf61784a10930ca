"""Grids that are periodic along one axis: against quadrature, plane strain, free space, and the same grid turned."""

import warnings

import jax.numpy as jnp
import numpy as np
import pytest
from bodies import STEEL
from scipy import integrate, special

import jaxcontact as jc
from jaxcontact.response.coefficients import strip_coefficients
from jaxcontact.response.images import Images

FILM = jc.StandardLinearSolid(G1=1e9, G2=1e9, eta2=1e9, nu=0.3)
ON_FILM = jc.LayeredHalfSpace([jc.Layer(FILM, 3e-6)], STEEL)
ALONG_Y = (False, True)
DEPTHS, HEIGHTS = [0.0, 1e-3, 0.7, 5.0, 300.0], [1.0, 0.5, 2.0, 0.3, 1.5]
IMAGES = Images(jnp.array(DEPTHS[1:]), jnp.array(HEIGHTS))


def press(body, indenter, load, grid, times=(0.0, 1.0), **more):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.indent(body, indenter, jc.Load(load), list(times), grid=grid, tolerance=1e-10, **more)


def under_a_wave(k, x, dx):
    """sum_j H_j (K0 at z_j - K0 at z_{j+1})/pi over the cell at x, by adaptive quadrature; in ln s near s = 0."""
    image = lambda s, z: special.k0(k * np.hypot(s, z))
    total = 0.0
    for height, upper, lower in zip(HEIGHTS, DEPTHS, [*DEPTHS[1:], np.inf], strict=True):
        step = lambda s, a=upper, b=lower: image(s, a) - image(s, b)
        near = lambda v, f=step: f(np.exp(v)) * np.exp(v)
        if x:
            total += height * integrate.quad(step, x - dx / 2.0, x + dx / 2.0, epsabs=1e-14)[0]
        else:
            total += 2.0 * height * integrate.quad(near, -40.0, np.log(dx / 2.0), epsabs=1e-14, limit=400)[0]
    return total / np.pi


@pytest.mark.slow
@pytest.mark.parametrize(
    "shape, spacing", [((16, 10), (1.0, 1.0)), ((8, 65), (3.0, 0.2)), ((32, 6), (1.0, 900.0))]
)
def test_the_coefficients_of_waves_are_integrals_of_bessel_functions(shape, spacing):
    """Square cells, flat ones and long ones; under the waves and between, an odd and an even number of cells."""
    coefficients = strip_coefficients(jc.Grid(shape, spacing, ALONG_Y), IMAGES)
    rows = np.fft.rfft(coefficients, axis=1)
    np.testing.assert_allclose(rows.imag, 0.0, atol=1e-13 * np.max(rows.real))
    for i in (0, 1, shape[0] - 1):
        for wave in (1, shape[1] // 2):
            k = 2.0 * np.pi * wave / (shape[1] * spacing[1])
            exact = under_a_wave(k, i * spacing[0], spacing[0])
            np.testing.assert_allclose(rows[i, wave].real, exact, atol=1e-11 * np.max(rows[:, 1].real))


@pytest.mark.slow
def test_a_wave_that_is_long_along_the_free_axis_has_the_response_of_the_solid():
    """The sum over all cells along x is N(k) = sum_j H_j (exp(-z_j k) - exp(-z_{j+1} k))/k: 60 cells decay by 1e-16."""
    shape, spacing = (60, 10), (1.0, 1.0)
    rows = np.fft.rfft(strip_coefficients(jc.Grid(shape, spacing, ALONG_Y), IMAGES), axis=1).real[:, 1:]
    k = 2.0 * np.pi * np.arange(1, 6) / 10.0
    decayed = np.exp(-np.outer([*DEPTHS, np.inf], k))
    exact = HEIGHTS @ (decayed[:-1] - decayed[1:]) / k
    np.testing.assert_allclose(2.0 * np.sum(rows, 0) - rows[0], exact, rtol=1e-12)


@pytest.mark.slow
def test_what_is_the_same_along_the_periodic_axis_is_in_plane_strain():
    """A roller on a creeping film, with 5 cells along it and with one."""
    roller, width = jc.Cylinder(1e-3, 1.0, STEEL), 40e-6
    many, one = (jc.Grid((48, n), (1e-6, width / n), ALONG_Y) for n in (5, 1))
    rows, line = (press(ON_FILM, roller, 0.1, grid) for grid in (many, one))
    assert np.all(np.asarray(rows.status) == jc.Status.FINE)
    peak = np.max(line.pressure)
    np.testing.assert_allclose(rows.pressure, np.broadcast_to(line.pressure, (2, 48, 5)), atol=1e-7 * peak)
    for name in ("approach", "film_strain", "contact_area"):
        np.testing.assert_allclose(getattr(rows, name), getattr(line, name), rtol=1e-7)


def test_coefficients_turn_with_the_grid():
    upright = strip_coefficients(jc.Grid((16, 10), (1.0, 2.0), ALONG_Y), IMAGES)
    turned = strip_coefficients(jc.Grid((10, 16), (2.0, 1.0), (True, False)), IMAGES)
    np.testing.assert_allclose(turned, upright.T, rtol=1e-13)


@pytest.mark.slow
def test_a_grid_turned_by_90_degrees_gives_the_turned_result():
    """A rough roller along y, and along x; on a creeping film, pushed along its axis, with unlike cells."""
    shape, spacing = (24, 12), (1e-6, 1.5e-6)
    bumps = np.asarray(jc.self_affine(jc.Grid(shape, spacing), rms_slope=0.01, shortest=6e-6, longest=12e-6))
    x = (np.arange(shape[0]) - 11.5) * spacing[0]
    heights = bumps - x[:, None] ** 2 / 2e-2
    upright = press(ON_FILM, jc.HeightField(heights), 0.1, jc.Grid(shape, spacing, ALONG_Y))
    turned = press(
        ON_FILM, jc.HeightField(heights.T), 0.1, jc.Grid(shape[::-1], spacing[::-1], (True, False))
    )
    assert np.all(np.asarray(upright.status) == jc.Status.FINE) and np.ptp(upright.pressure[0, 12]) > 0.0
    atol = 1e-7 * np.max(upright.pressure)
    np.testing.assert_allclose(np.swapaxes(turned.pressure, 1, 2), upright.pressure, rtol=0.0, atol=atol)
    np.testing.assert_allclose(turned.approach, upright.approach, rtol=1e-7)
    np.testing.assert_allclose(turned.film_strain, upright.film_strain, rtol=1e-7)


@pytest.mark.long
def test_a_small_contact_in_a_long_cell_is_that_of_free_space():
    """A ball on a creeping film, 15 cells across; the period is 10 times as wide as the contact."""
    ball = jc.Sphere(1e-3, STEEL)
    free = jc.Grid((64, 150), (3e-6, 3e-6))
    both = [press(ON_FILM, ball, 0.01, grid) for grid in (free, jc.Grid(free.shape, free.spacing, ALONG_Y))]
    peaks = [np.max(history.pressure, (1, 2)) for history in both]
    np.testing.assert_allclose(*peaks, rtol=3e-3)
    np.testing.assert_allclose(both[0].smooth_area, both[1].smooth_area, rtol=5e-3)
    np.testing.assert_allclose(both[0].film_strain, both[1].film_strain, rtol=3e-3)


@pytest.mark.slow
def test_a_long_slide_over_a_film_becomes_the_steady_one():
    """A ball in a row of balls along y, over four widths of the grid, aslant."""
    ball, grid = jc.Sphere(1e-3, STEEL), jc.Grid((32, 27), (3e-6, 3e-6), ALONG_Y)
    body = jc.LayeredHalfSpace([jc.Layer(jc.StandardLinearSolid(1e9, 2e9, 1e9), 5e-6)], STEEL)
    given = {"grid": grid, "tolerance": 1e-10, "velocity": (2e-5, 1e-5)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        late = jc.slide(body, ball, jc.Load(0.02), [0.0, 20.0], substeps=80, save="last", **given)
        steady = jc.slide_steady(body, ball, jc.Load(0.02), **given)
    assert int(late.status[-1]) == int(steady.status) == jc.Status.FINE
    np.testing.assert_allclose(late.pressure, steady.pressure, rtol=0.0, atol=1e-4 * np.max(steady.pressure))
    np.testing.assert_allclose(late.friction_coefficient[-1], steady.friction_coefficient, rtol=1e-4)
    np.testing.assert_allclose(late.power[-1], steady.power, rtol=1e-4)
