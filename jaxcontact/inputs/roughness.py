"""Self-affine rough surfaces.

A surface of given power spectrum is filtered white noise, a sum of independent Gaussian waves at the wavevectors k of
the grid with

    C(k) = <|h^(k)|^2> ~ k^(-2 - 2 H)      2 pi/longest <= |k| <= 2 pi/shortest,
    C(k) = C(2 pi/longest)                 0 < |k| < 2 pi/longest,
    C(k) = 0                               beyond, and for the mean.

The heights are Gaussian and periodic along both axes. Source: B. N. J. Persson, O. Albohr, U. Tartaglino,
A. I. Volokitin, E. Tosatti, J. Phys.: Condens. Matter 17 (2005) R1.
"""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import is_concrete
from jaxcontact.inputs.grid import Grid, check_grid

ROUNDING = 1e-9  # relative tolerance in comparisons of wavelengths with those of the grid


def self_affine(
    grid: Grid, hurst: float = 0.8, rms_slope: Any = 0.1, *, shortest: float, longest: float, seed: int = 0
) -> Array:
    """Generate the heights of a random self-affine surface, for a ``HeightField``; the module gives the spectrum.

    The slope is that of the trigonometric polynomial through the heights, rms over both directions,
    sqrt(mean |grad h|^2), and is met exactly. The random numbers are those of ``numpy.random.RandomState``, whose
    stream numpy guarantees: a seed gives the same surface on every machine, up to round-off.

    Args:
        grid: a ``Grid``; concrete. The heights are periodic over it, so that a periodic grid can use them as they are.
        hurst: H, 0 to 1.
        rms_slope: >= 0; the heights are proportional to it.
        shortest: shortest wavelength [m], from two cells to the grid's width; eight cells or more resolve it.
        longest: wavelength [m] above which the spectrum is flat, up to the grid's width.
        seed: whole number from 0 to 2^32 - 1.

    Returns:
        Heights (nx, ny) [m] of mean zero.

    Raises:
        ValueError: an argument outside these ranges.

    Example:
        >>> grid = jc.Grid(shape=(64, 64), spacing=(1e-6, 1e-6), periodic=True)
        >>> heights = jc.self_affine(grid, hurst=0.8, rms_slope=0.1, shortest=4e-6, longest=32e-6)
        >>> rough = jc.HeightField(heights)
    """
    valid = _check(grid, hurst, rms_slope, shortest, longest, seed)
    k = _wavenumbers(grid)
    within = (k > 0.0) & (k <= 2.0 * np.pi / shortest * (1.0 + ROUNDING))
    amplitude = np.where(within, np.maximum(k, 2.0 * np.pi / longest) ** (-1.0 - hurst), 0.0)
    spectrum = np.fft.fft2(np.random.RandomState(seed).standard_normal(grid.shape)) * amplitude
    slope = np.sqrt(np.sum((k * np.abs(spectrum)) ** 2)) / k.size  # by Parseval
    return jnp.asarray(np.fft.ifft2(spectrum).real / slope) * jnp.where(valid, rms_slope, jnp.nan)


def _wavenumbers(grid: Grid) -> np.ndarray:
    """Return |k| of the grid's waves [rad/m], (nx, ny)."""
    along_x, along_y = (np.fft.fftfreq(n, float(d)) for n, d in zip(grid.shape, grid.spacing, strict=True))
    return 2.0 * np.pi * np.hypot(along_x[:, None], along_y)


def _check(grid: Grid, hurst: float, rms_slope: Any, shortest: float, longest: float, seed: int) -> Verdict:
    """Raise ValueError for arguments that define no such surface."""
    check_grid(grid)
    checks.require(
        is_concrete(grid) and not grid.plane_strain,
        f"grid: expected a known spacing and more than one cell along y, got {tuple(grid.shape)} cells",
    )
    checks.between("hurst", hurst, 0.0, 1.0)
    two_cells, width = 2.0 * max(map(float, grid.spacing)), max(map(float, grid.width))
    checks.between("shortest [m]", shortest, two_cells * (1.0 - ROUNDING), width)
    checks.between("longest [m]", longest, shortest * (1.0 - ROUNDING), width * (1.0 + ROUNDING))
    checks.whole("seed", seed, 0, 2**32 - 1)
    return checks.non_negative("rms_slope", rms_slope)
