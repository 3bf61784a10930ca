"""Self-affine surfaces, and rough bodies on periodic grids."""

import numpy as np

import jaxcontact as jc

N, LENGTH, HURST, SHORTEST, LONGEST = 256, 1e-3, 0.7, 1e-3 / 32, 1e-3 / 4
GRID = jc.Grid(shape=(N, N // 2), spacing=(LENGTH / N, LENGTH / N), periodic=True)


def surface(seed=0, grid=GRID, **keywords):
    given = {"hurst": HURST, "rms_slope": 0.05, "shortest": SHORTEST, "longest": LONGEST} | keywords
    return np.asarray(jc.self_affine(grid, seed=seed, **given))


def wavenumbers(grid=GRID):
    x, y = (2.0 * np.pi * np.fft.fftfreq(n, float(d)) for n, d in zip(grid.shape, grid.spacing, strict=True))
    return x[:, None], y


def test_the_spectrum_is_a_power_law_between_its_ends_and_flat_before():
    """C(k) over many surfaces: k^(-2 - 2 H), by regression; flat within its statistical error; zero elsewhere."""
    squares = np.mean([np.abs(np.fft.fft2(surface(seed))) ** 2 for seed in range(40)], axis=0)
    k = np.hypot(*wavenumbers()) * LENGTH / (2.0 * np.pi)  # waves over the length: 4 to 32
    power = (k > 4.5) & (k < 31.0)
    # the mean logarithm of a mean of 40 exponentials is the same for all waves
    slope = np.polyfit(np.log(k[power]), np.log(squares[power]), 1)[0]
    np.testing.assert_allclose(slope, -2.0 - 2.0 * HURST, atol=0.05)
    flat = squares[(k > 0.0) & (k <= 4.0)]
    at_end = np.exp(np.polyval(np.polyfit(np.log(k[power]), np.log(squares[power]), 1), np.log(4.0)))
    np.testing.assert_allclose(np.mean(flat), at_end, rtol=0.15)
    assert np.max(squares[k > 32.0 + 1e-6]) < 1e-20 * np.max(squares)


def test_the_slope_is_exact_and_heights_are_gaussian():
    """rms slope from the derivatives of the trigonometric polynomial; kurtosis 3, skewness 0 over many surfaces."""
    heights = surface(3)
    for k in wavenumbers():
        assert np.max(np.abs(np.fft.ifft2(1j * k * np.fft.fft2(heights)).imag)) < 1e-12
    gradient = [np.fft.ifft2(1j * k * np.fft.fft2(heights)).real for k in wavenumbers()]
    np.testing.assert_allclose(np.sqrt(np.mean(gradient[0] ** 2 + gradient[1] ** 2)), 0.05, rtol=1e-12)
    many = np.stack([surface(seed) for seed in range(40)])
    normal = many / np.std(many)
    assert abs(np.mean(normal**3)) < 0.1 and abs(np.mean(normal**4) - 3.0) < 0.2
    np.testing.assert_allclose(np.mean(many, (1, 2)), 0.0, atol=1e-12 * np.std(many))


def test_a_seed_names_a_surface():
    """The same again, another for another; in proportion to the slope."""
    assert np.array_equal(surface(5), surface(5))
    assert np.max(np.abs(surface(5) - surface(6))) > np.std(surface(5))
    np.testing.assert_allclose(surface(5, rms_slope=0.1), 2.0 * surface(5), rtol=1e-12)
