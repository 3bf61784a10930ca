"""Self-affine surfaces, and rough bodies on periodic grids."""

import numpy as np
import pytest

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


@pytest.mark.slow
def test_the_area_of_a_rough_contact_is_between_persson_and_the_asperities_and_that_of_boundary_elements():
    """kappa = A E* slope/W at small loads: 1.596 (Persson 2001), 2.507 (Bush, Gibson, Thomas 1975), 2.0 to 2.2 computed.

    Of the 1024 x 1024 cells of ``benchmarks/bench_rough.py`` it is 1.98 to 2.18, less half the cells of the rim as in
    V. A. Yastrebov, G. Anciaux, J.-F. Molinari, Tribol. Int. 114 (2017) 161.
    """
    n, slope, modulus = 256, 0.1, 1e9
    grid = jc.Grid(shape=(n, n), spacing=(1e-6, 1e-6), periodic=True)
    heights = jc.self_affine(grid, rms_slope=slope, shortest=8e-6, longest=64e-6, seed=0)
    body = jc.LayeredHalfSpace([], jc.Elastic(G=modulus / 4.0, nu=0.5))
    loads = np.array([0.08, 0.04, 0.02])
    control = jc.Load(loads * modulus * slope * float(grid.width[0]) ** 2)
    history = jc.indent(body, jc.HeightField(heights), control, np.arange(3.0), grid=grid, tolerance=1e-6)
    inside = np.asarray(history.pressure) > 0.0
    rim = sum(np.sum(inside != np.roll(inside, 1, axis), (1, 2)) for axis in (1, 2))
    area = (np.sum(inside, (1, 2)) - (np.pi - 1.0 + np.log(2.0)) / 24.0 * rim) / n**2
    kappa = area / loads
    assert np.all(np.asarray(history.status) == jc.Status.FINE)
    assert np.all(kappa > np.sqrt(8.0 / np.pi)) and np.all(kappa < np.sqrt(2.0 * np.pi))
    assert np.all(np.diff(kappa) > 0.0)  # it rises as the load falls
    np.testing.assert_allclose(kappa, 2.1, rtol=0.1)
