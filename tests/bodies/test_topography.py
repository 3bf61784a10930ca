"""Statistics of surfaces against waves in closed form and the law that made them."""

import numpy as np
import pytest

import jaxcontact as jc

LENGTH, AMPLITUDE = 96e-6, 1e-7
TORUS = jc.Grid(shape=(96, 64), spacing=(1e-6, 1.5e-6), periodic=True)
KX, KY = 6.0 * np.pi / LENGTH, 10.0 * np.pi / LENGTH  # three waves along x, five along y


def wave(grid):
    x, y = (np.asarray(a) for a in grid.coordinates())
    return AMPLITUDE * np.cos(KX * x + KY * y) + 3e-6


def test_a_wave_has_the_height_slope_and_curvature_of_its_derivatives():
    """a/sqrt 2, a |k|/sqrt 2, a k^2/(2 sqrt 2), from the mean height."""
    found = jc.surface_statistics(wave(TORUS), TORUS)
    square = KX**2 + KY**2
    np.testing.assert_allclose(found.rms_height, AMPLITUDE / np.sqrt(2.0), rtol=1e-9)
    np.testing.assert_allclose(found.rms_slope, AMPLITUDE * np.sqrt(square / 2.0), rtol=1e-9)
    np.testing.assert_allclose(found.rms_curvature, AMPLITUDE * square / np.sqrt(8.0), rtol=1e-9)


@pytest.mark.parametrize("periodic", [False, (True, False), (False, True)])
def test_where_a_surface_ends_its_slope_is_that_of_neighbours(periodic):
    """As before, to the one cell in 240 that has no neighbour: the wave does not end at zero."""
    n = 240
    grid = jc.Grid((n, n), (LENGTH / n, LENGTH / n), periodic)
    found = jc.surface_statistics(wave(grid), grid)
    square = KX**2 + KY**2
    np.testing.assert_allclose(found.rms_slope, AMPLITUDE * np.sqrt(square / 2.0), rtol=1.0 / n)
    np.testing.assert_allclose(found.rms_curvature, AMPLITUDE * square / np.sqrt(8.0), rtol=2.0 / n)


def test_heights_that_do_not_match_at_the_ends_of_a_period_have_a_step():
    """A slope of 0.01 along x, whose step adds to the mean square; the same heights without a period are right."""
    tilted = lambda grid: 0.01 * np.asarray(grid.coordinates()[0]) + 0.0 * np.asarray(grid.coordinates()[1])
    with pytest.warns(
        UserWarning, match="do not match at the two ends of the periodic x axis: a step of 9.5e-07 m"
    ):
        assert jc.surface_statistics(tilted(TORUS), TORUS).rms_slope > 0.05
    along = jc.Grid(TORUS.shape, TORUS.spacing, (False, True))
    np.testing.assert_allclose(jc.surface_statistics(tilted(along), along).rms_slope, 0.01, rtol=1e-9)


def test_the_spectrum_of_a_wave_is_all_at_its_wavenumber():
    """C = a^2 A/4 at k and at -k, in the mean over the waves of a ring, whose number is counted here."""
    found = jc.surface_statistics(wave(TORUS), TORUS)
    at = int(np.argmax(found.spectrum))
    ring = np.rint(np.hypot(3, 5))
    assert at == ring - 1
    i, j = np.meshgrid(np.arange(-40, 41), np.arange(-32, 33))
    waves = np.sum(np.rint(np.hypot(i, j)) == ring)
    np.testing.assert_allclose(found.spectrum[at], 2.0 / waves * AMPLITUDE**2 * LENGTH**2 / 4.0, rtol=1e-9)
    np.testing.assert_allclose(np.delete(found.spectrum, at), 0.0, atol=1e-20 * float(found.spectrum[at]))
    np.testing.assert_allclose(found.wavenumber[at], ring * 2.0 * np.pi / LENGTH, rtol=0.05)


@pytest.mark.parametrize("periodic, within", [(True, 0.02), (False, 0.03)])
def test_the_spectrum_of_a_self_affine_surface_is_the_law_that_made_it(periodic, within):
    """C = c k^(-2 - 2 H) with c from the slope, sum k^2 C = A slope^2; of a cut-out too, blurred by 2 (1 + H)^2/(3 m^2).

    In the mean over 20 surfaces and all rings between the cut-offs; each ring within a few of its statistical errors.
    """
    n, hurst, slope, shortest, longest = 128, 0.7, 0.1, 8, 64
    whole = jc.Grid((n, n), (1e-6, 1e-6), periodic=True)
    k = 2.0 * np.pi * np.hypot(*np.meshgrid(np.fft.fftfreq(n, 1e-6), np.fft.fftfreq(n, 1e-6)))
    law = lambda k: np.maximum(k, 2.0 * np.pi / (longest * 1e-6)) ** (-2.0 - 2.0 * hurst)
    in_law = (k > 0.0) & (k < 2.0 * np.pi / (shortest * 1e-6) * (1.0 + 1e-9))
    scale = slope**2 * (n * 1e-6) ** 2 / np.sum((k**2 * law(np.where(in_law, k, 1.0)))[in_law])
    given = {"hurst": hurst, "rms_slope": slope, "shortest": shortest * 1e-6, "longest": longest * 1e-6}
    grid, part = (whole, n) if periodic else (jc.Grid((96, 96), (1e-6, 1e-6)), 96)
    found = [
        jc.surface_statistics(jc.self_affine(whole, seed=seed, **given)[:part, :part], grid)
        for seed in range(20)
    ]
    if periodic:
        np.testing.assert_allclose([one.rms_slope for one in found], slope, rtol=1e-9)
    at = np.asarray(found[0].wavenumber)
    ratio = np.mean([np.asarray(one.spectrum) for one in found], 0) / (scale * law(at))
    if not periodic:
        ratio = ratio / (1.0 + 2.0 * (1.0 + hurst) ** 2 / (3.0 * (at * part * 1e-6 / (2.0 * np.pi)) ** 2))
    first = 0.8 * longest if periodic else part / 4.5
    inside = (at > 2.0 * np.pi / (first * 1e-6)) & (at < 2.0 * np.pi / (1.15 * shortest * 1e-6))
    assert np.sum(inside) > 5
    np.testing.assert_allclose(np.mean(ratio[inside]), 1.0, atol=within)
    np.testing.assert_allclose(ratio[inside], 1.0, atol=0.25)
