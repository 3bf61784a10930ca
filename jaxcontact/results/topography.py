"""Statistics of rough surfaces: heights, slopes, curvatures and the power spectrum.

Along a periodic axis, derivatives are those of the trigonometric polynomial through the heights, and the spectrum is that
of its waves. Along any other axis they are finite differences of interior cells, and the spectrum uses a Hann window,
which smooths it: a spectrum k^(-2 - 2 H) is returned as (1 + 2 (1 + H)^2/(3 m^2)) k^(-2 - 2 H) at the m-th wave of a
square. Heights on a periodic axis that do not match at its two ends have a step there, which adds to slopes, curvatures
and spectrum; a warning says so if its root mean square is above ``STEP`` times that of the differences between neighbours.
The two-dimensional spectrum

    C(k) = <|h^(k)|^2> dx dy/(nx ny),      mean h^2 = integral of C(k) d^2k/(2 pi)^2,

is averaged over directions. Source: B. N. J. Persson, O. Albohr, U. Tartaglino, A. I. Volokitin, E. Tosatti, J. Phys.:
Condens. Matter 17 (2005) R1 (whose C is this one over (2 pi)^2).
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from jaxcontact._support import checks
from jaxcontact._support.pytree import is_concrete, pytree
from jaxcontact.inputs.grid import Grid, check_grid
from jaxcontact.results.summaries import InWords

STEP = 4.0  # of the differences between neighbours: a step where a periodic axis begins again


@pytree
class SurfaceStatistics(InWords):
    """Statistics of a rough surface.

    rms_height () [m] with respect to the mean height; rms_slope (), sqrt(mean |grad h|^2); rms_curvature () [1/m], that of
    the mean curvature (h_xx + h_yy)/2; spectrum (n,) [m^4]: the power spectral density C, averaged over rings in the plane
    of wavevectors, which are as wide as the smallest |k| of the grid; wavenumber (n,) [rad/m]: the mean |k| of each ring.
    """

    rms_height: np.ndarray
    rms_slope: np.ndarray
    rms_curvature: np.ndarray
    wavenumber: np.ndarray
    spectrum: np.ndarray


def surface_statistics(heights: Any, grid: Grid) -> SurfaceStatistics:
    """Compute the statistics of heights on a grid, such as those of a ``HeightField`` (formulas in ``results.topography``).

    Args:
        heights: (nx, ny) [m], with known values (not inside jit).
        grid: the ``Grid`` of the heights. Whether it is periodic decides how derivatives and spectrum are computed. Heights
            that do not match at the ends of a periodic axis have a step there, and a warning is issued.

    Returns:
        ``SurfaceStatistics``.

    Raises:
        ValueError: heights of another shape or not finite, or traced arguments.

    Example:
        >>> grid = jc.Grid(shape=(64, 64), spacing=(1e-6, 1e-6), periodic=True)
        >>> heights = jc.self_affine(grid, rms_slope=0.1, shortest=8e-6, longest=32e-6)
        >>> round(float(jc.surface_statistics(heights, grid).rms_slope), 9)
        0.1
    """
    h = _checked(heights, grid)
    for axis in np.flatnonzero(grid.periodic).tolist():
        _warn_of_step(h, axis, "xy"[axis])
    h = h - np.mean(h)
    (dx, dy), (x, y) = map(float, grid.spacing), grid.periodic
    slopes = _derivative(h, -2, dx, x, 1), _derivative(h, -1, dy, y, 1)
    bend_x = _inside(_derivative(h, -2, dx, x, 2), -1, y)
    bend_y = _inside(_derivative(h, -1, dy, y, 2), -2, x)
    return SurfaceStatistics(
        np.sqrt(np.mean(h**2)),
        np.sqrt(np.mean(slopes[0] ** 2) + np.mean(slopes[1] ** 2)),
        np.sqrt(np.mean(((bend_x + bend_y) / 2.0) ** 2)),
        *_spectrum(h, grid),
    )


def _warn_of_step(h: np.ndarray, axis: int, name: str) -> None:
    """Warn if the heights have a step where a periodic axis begins again."""
    size = lambda change: float(np.sqrt(np.mean(change**2)))
    step, usual = size(np.take(h, 0, axis) - np.take(h, -1, axis)), size(np.diff(h, axis=axis))
    if step > STEP * usual:
        warnings.warn(
            f"the heights do not match at the two ends of the periodic {name} axis: a step of {step:.3g} m, {usual:.3g} m"
            " between neighbours, adds to slopes, curvatures and spectrum; give a grid that is not periodic",
            stacklevel=3,
        )


def _derivative(h: np.ndarray, axis: int, spacing: float, periodic: bool, order: int) -> np.ndarray:
    """Return a derivative along an axis; along an axis that is not periodic it is shorter by ``order``."""
    if not periodic:
        return np.diff(h, order, axis) / spacing**order
    k = np.moveaxis(2.0 * np.pi * np.fft.fftfreq(h.shape[axis], spacing)[:, None], 0, axis)
    return np.fft.ifft((1j * k) ** order * np.fft.fft(h, axis=axis), axis=axis).real


def _inside(field: np.ndarray, axis: int, periodic: bool) -> np.ndarray:
    """Return the field without the first and last cell along an axis that is not periodic."""
    return field if periodic else np.moveaxis(np.moveaxis(field, axis, 0)[1:-1], 0, axis)


def _spectrum(h: np.ndarray, grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Return wavenumbers [rad/m] and C [m^4] of the module, averaged over rings, up to the highest wave of both axes."""
    waves_of_axes = [_waves(n, float(d)) for n, d in zip(grid.shape, grid.spacing, strict=True)]
    k = np.hypot(waves_of_axes[0][:, None], waves_of_axes[1])
    width, highest = min(a[1] for a in waves_of_axes), min(np.max(np.abs(a)) for a in waves_of_axes)
    ring = np.rint(k / width).astype(int)
    count = int(np.rint(highest / width))
    ring = np.where(
        ring <= count, ring, 0
    ).ravel()  # ring 0 holds the mean, which is zero, and all higher waves
    sums = lambda values: np.bincount(ring, values.ravel(), count + 1)[1:]
    waves, transformed = sums(np.ones(k.shape)), np.fft.fft2(h * _window(grid))
    squares = (transformed.real**2 + transformed.imag**2) * grid.cell_area / h.size
    return sums(k) / waves, sums(squares) / waves


def _waves(n: int, spacing: float) -> np.ndarray:
    return 2.0 * np.pi * np.fft.fftfreq(n, spacing)


def _window(grid: Grid) -> np.ndarray:
    """Return a window (nx, ny) of mean square one: a Hann window along axes that are not periodic."""
    hann = lambda n: np.sqrt(8.0 / 3.0) * np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2
    x, y = (np.ones(n) if wraps else hann(n) for n, wraps in zip(grid.shape, grid.periodic, strict=True))
    return x[:, None] * y


def _checked(heights: Any, grid: Grid) -> np.ndarray:
    """Return the heights as floats, after checking them against the grid."""
    check_grid(grid)
    checks.require(
        is_concrete(heights, grid) and not grid.plane_strain,
        f"heights, grid: expected known values and more than one cell along y, got {tuple(grid.shape)} cells",
    )
    checks.require(
        np.shape(heights) == tuple(grid.shape),
        f"heights: expected shape {tuple(grid.shape)}, got {np.shape(heights)}",
    )
    checks.finite("heights [m]", heights)
    return np.asarray(heights, float)
