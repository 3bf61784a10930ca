"""Numerical inversion of Laplace transforms."""

import numpy as np


def inverted(transform, t):
    """The inverse Laplace transform of F(s) [complex array -> array] at t by de Hoog's accelerated Fourier series.

    F. R. de Hoog, J. H. Knight, A. N. Stokes, SIAM J. Sci. Stat. Comput. 3 (1982) 357; by epsilon's algorithm.
    """
    half, terms = 2.0 * t, 24
    shift = -np.log(1e-10) / (2.0 * half)
    s = shift + 1j * np.pi * np.arange(2 * terms + 1) / half
    a = np.array([transform(one) for one in s])
    series = a * np.exp(1j * np.pi * t / half * np.arange(s.size))[:, None]
    series[0] /= 2.0
    table = [np.zeros((s.size + 1, a.shape[1]), complex), np.cumsum(series, 0)]
    for _ in range(2 * terms):
        step = table[-1][1:] - table[-1][:-1]
        table.append(table[-2][1:-1] + 1.0 / np.where(step == 0.0, 1e-300, step))
    return np.exp(shift * t) / half * table[-1][0].real
