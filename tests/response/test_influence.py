"""Influence coefficients against direct quadrature, closed forms and the paper's own procedure."""

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j0, j1
from tolerances import ALTERNATING, IMAGES, ROUND_OFF

import jaxcontact as jc
from jaxcontact.operators import spectral
from jaxcontact.operators.kernels import image_weights
from jaxcontact.reference import refined_grid
from jaxcontact.response import coefficients as influence
from jaxcontact.response.images import Images
from jaxcontact.response.normal import response_of

# one program a shape, not one an operation
influence_coefficients = jax.jit(influence.influence_coefficients)


def images_at_once(body):
    response = response_of(body)
    return response.expand(response.mean_response(response.wavenumbers(), 0.0, 0.0))


images_of = jax.jit(images_at_once)


@jax.jit
def coefficients(body, grid, t=0.0):
    heights = image_weights(body, jc.Sphere(1.0), jnp.asarray(t), jnp.asarray(t), quasi_elastic=False)
    return influence.influence_coefficients(grid, Images(images_at_once(body).depths, heights))


@jax.jit
def fitted_and_exact(body, wavenumbers):
    return images_at_once(body).at(wavenumbers), response_of(body).mean_response(wavenumbers, 0.0, 0.0)


@pytest.mark.parametrize(
    ("ratio", "bound"),
    [(1e-3, IMAGES), (0.0093, IMAGES), (1.0, IMAGES), (10.0, IMAGES), (1e3, 2e-7), (1e6, 2e-6)],
)
def test_images_fit_the_response_at_wavenumbers_between_the_nodes(ratio, bound):
    h, g = 150e-9, 0.75e9
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(g, 0.3), h)], jc.Elastic(g / ratio, 0.3))
    np.testing.assert_allclose(*fitted_and_exact(body, np.geomspace(1e-12, 1e4, 1501) / h), rtol=bound)


def test_love_element_by_quadrature():
    """The surface image is the displacement of a uniformly loaded rectangle: int 1/(2 pi r) dA."""
    grid = jc.Grid(shape=(8, 6), spacing=(1.0, 0.7))
    ours = influence_coefficients(grid, Images(jnp.zeros(0), jnp.ones((1, 1))))[0]
    for i, j in [(1, 0), (3, 2), (7, 5)]:
        row = lambda x, j=j: quad(lambda y: 1 / np.hypot(x, y), (j - 0.5) * 0.7, (j + 0.5) * 0.7)[0]
        expected = quad(row, i - 0.5, i + 0.5)[0] / (2 * np.pi)
        assert float(ours[i, j]) == pytest.approx(expected, rel=1e-10)
    centre = (0.5 * np.arcsinh(0.7) + 0.35 * np.arcsinh(1 / 0.7)) * 4 / (2 * np.pi)
    assert float(ours[0, 0]) == pytest.approx(centre, rel=1e-12)


def seen_at(z, i, j):
    """A uniform pressure on a unit cell at an offset, seen from a depth: four corners of Love's integral."""

    def corner(x, y):
        r = mpmath.sqrt(x**2 + y**2 + z**2)
        logs = x * mpmath.asinh(y / mpmath.hypot(x, z)) + y * mpmath.asinh(x / mpmath.hypot(y, z))
        return logs - (z * mpmath.atan(x * y / (z * r)) if z else 0)

    half = mpmath.mpf(0.5)
    corners = [(a * b, corner(i + a * half, j + b * half)) for a in (1, -1) for b in (1, -1)]
    return sum(sign * value for sign, value in corners) / (2 * mpmath.pi)


@pytest.mark.parametrize(
    ("ratio", "cells", "bound"),
    [
        (1e-3, 10.0, ROUND_OFF),
        (0.0093, 0.016, ROUND_OFF),
        (1.0, 1e-6, ROUND_OFF),
        (10.0, 1.0, ROUND_OFF),
        (1e3, 1.0, ALTERNATING),
        (1e6, 200.0, ROUND_OFF),
    ],
)
def test_the_sum_over_images_in_forty_digits(ratio, cells, bound):
    """The heights of stiff films alternate, at up to 1e10 times the first."""
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(0.75e9, 0.3), cells)], jc.Elastic(0.75e9 / ratio, 0.3))
    images = images_of(body)
    ours = np.asarray(influence_coefficients(jc.Grid(shape=(64, 64), spacing=(1.0, 1.0)), images))
    with mpmath.workdps(40):
        heights, depths = (
            [mpmath.mpf(a) for a in np.asarray(part).tolist()] for part in (images.heights, images.depths)
        )
        for i, j in [(0, 0), (1, 0), (43, 63)]:
            seen = [seen_at(z, i, j) for z in (mpmath.mpf(0), *depths)] + [0]
            exact = sum(height * (seen[k] - seen[k + 1]) for k, height in enumerate(heights))
            assert abs(ours[i, j] - float(exact)) < bound * ours[0, 0], (i, j)


@pytest.mark.parametrize(
    ("h", "pixel"), [pytest.param(150e-9, 2.4e-6, marks=pytest.mark.slow), (2e-6, 2e-6), (5e-5, 1e-6)]
)
def test_layered_coefficients_against_a_hankel_integral(steel, h, pixel):
    """A ring of loads: the mean displacement on a distant circle from a uniform disc, by quadrature of
    A int (alpha N) 2 J1(alpha b)/(alpha b) J0(alpha r) d alpha, against cells summed over the disc."""
    film = jc.Elastic(0.75e9, 0.3)
    body = jc.LayeredHalfSpace([jc.Layer(film, h)], steel)
    grid = jc.Grid.square(n=64, width=64 * pixel)
    ours = coefficients(body, grid)
    r, b = 20 * pixel, pixel / np.sqrt(np.pi)  # a disc of the cell's area: equal but for (pixel/r)^4

    def film_part(a):
        return float(response_of(body).mean_response(a, 0.0, 0.0)) - 0.7 / float(steel.G)

    far_field = 0.7 / float(steel.G) * pixel**2 / (2 * np.pi * r)
    a = np.linspace(1e-9, 60.0, 400001) / h if h > pixel else None
    if a is not None:
        values = np.asarray(jax.jit(lambda a: response_of(body).mean_response(a, 0.0, 0.0))(a)) - 0.7 / float(
            steel.G
        )
        tail = float(values[-1])
        disc = 2 * j1(a * b) / (a * b)
        film_field = np.trapezoid((values - tail) * disc * j0(a * r), a) * pixel**2 / (2 * np.pi)
        film_field += tail * pixel**2 / (2 * np.pi * r)
        assert float(ours[20, 0]) == pytest.approx(far_field + film_field, rel=2e-3)
    else:
        # a film thinner than the cell is felt only next to it: the far field is the substrate's
        assert float(ours[20, 0]) == pytest.approx(far_field, rel=2e-3)
        assert film_part(1e-3 / h) > 0.0


@pytest.mark.slow
def test_a_film_far_thinner_than_a_cell_adds_its_springs_at_the_centre(steel):
    h, film = 1e-12, jc.Elastic(0.75e9, 0.3)
    grid = jc.Grid.square(n=16, width=16e-6)
    extra = coefficients(jc.LayeredHalfSpace([jc.Layer(film, h)], steel), grid)
    extra = extra - coefficients(jc.LayeredHalfSpace([], steel), grid)
    springs = h * 0.4 / (2 * 0.7 * 0.75e9)
    assert float(extra[0, 0]) == pytest.approx(springs, rel=2e-2)
    assert float(abs(extra[1, 0])) < 0.02 * springs


@pytest.mark.slow
def test_a_layer_far_thicker_than_the_grid_is_a_half_space_of_its_own(steel, film):
    grid = jc.Grid.square(n=16, width=16e-6)
    thick = coefficients(jc.LayeredHalfSpace([jc.Layer(film, 10.0)], steel), grid)
    np.testing.assert_allclose(thick, coefficients(jc.LayeredHalfSpace([], film), grid), rtol=1e-4)


@pytest.mark.long
@pytest.mark.parametrize("t", [0.0, 7200.0])
def test_the_papers_procedure_converges_to_ours(body, t):
    """Eqs. (7)-(10): the central coefficient's error falls with AL, the far field's with chi."""
    grid = jc.Grid.square(n=32, width=32 * 1.6e-6)
    ours = np.asarray(coefficients(body, grid, t))
    respond = jax.jit(lambda a: response_of(body).mean_response(a, t, t))
    errors = {}
    for chi, aliases in [(4, 2), (16, 0), (16, 2)]:
        theirs = refined_grid.coefficients(
            lambda a: np.asarray(respond(a)), grid.shape, grid.spacing, chi=chi, aliases=aliases
        )
        errors[chi, aliases] = abs(theirs[0, 0] / ours[0, 0] - 1.0), abs(theirs[25, 12] / ours[25, 12] - 1.0)
    print(f"t = {t}: error of the centre and of a far coefficient by (chi, AL): {errors}")
    assert errors[16, 2][0] < 0.03 < 0.1 < errors[16, 0][0]
    assert errors[16, 2][1] < 0.06 < errors[4, 2][1]


@pytest.mark.parametrize("shape", [(8, 8), (7, 10), (9, 5), (13, 11)])
def test_convolution_by_fft_is_the_sum_over_cells(shape):
    rng = np.random.default_rng(1)
    kernel, field = rng.random(shape), rng.random(shape)
    expected = np.zeros(shape)
    for a in np.ndindex(shape):
        for b in np.ndindex(shape):
            expected[a] += kernel[abs(a[0] - b[0]), abs(a[1] - b[1])] * field[b]
    convolve = jax.jit(lambda kernel, field: spectral.convolve(spectral.kernel_spectrum(kernel), field))
    ours = convolve(kernel, field)
    np.testing.assert_allclose(ours, expected, rtol=ROUND_OFF)
