"""Line contacts whose edges lie in any rational direction of a grid, solved as problems of one dimension.

Cells have the sides 1 and ``across``. The cells (i, j) of a grid with b i - a j = n form a row along (a, b across).
Under a cylinder whose axis has this direction all cells of a row have the same pressure, so that only the rows'
mutual displacements are needed. They are sums over a row of those of uniformly loaded rectangles (A. E. H. Love,
Phil. Trans. R. Soc. A 228 (1929) 377), less the logarithm of the length of the row, to which a prescribed load is
indifferent. No code of jaxcontact is used.
"""

import numpy as np
import scipy.linalg

HALF_LENGTH = 1500.0  # of a row, in cells


def rectangles(x, y, across=1.0):
    """Displacements (n,) at places from the centre of a rectangle of 1 by ``across`` under unit pressure; E* = 1."""
    corner = lambda a, b: a * np.arcsinh(b / np.abs(a)) + b * np.arcsinh(a / np.abs(b))
    return (
        corner(x + 0.5, y + across / 2)
        - corner(x - 0.5, y + across / 2)
        - corner(x + 0.5, y - across / 2)
        + corner(x - 0.5, y - across / 2)
    ) / np.pi


def rows(a, b, count, across=1.0):
    """Displacements (count,) of the row 0, 1, ... by unit pressure on the row 0."""
    length = np.hypot(a, b * across)
    most = int(HALF_LENGTH * max(across, 1.0) / length)
    steps, found = np.arange(-most, most + 1), []
    for n in range(count):
        if n * across > 25 * length * max(length, across):  # seen from there the row is a line
            found.append(-2.0 * across / (np.pi * length) * np.log(n * across / length))
            continue
        i, j = next((i, (b * i - n) // a) for i in range(n + a + 1) if (b * i - n) % a == 0) if a else (n, 0)
        nearest = round((i * a + j * b * across**2) / length**2)
        i, j = i - nearest * a, j - nearest * b
        along = (i * a + j * b * across**2) / length
        ends = (most + 0.5) * length + np.array([1.0, -1.0]) * along
        x, y = (i + steps * a).astype(float), (j + steps * b) * across
        found.append(rectangles(x, y, across).sum() - across * np.log(2.0 * ends).sum() / (np.pi * length))
    return np.array(found)


def line_contact(half_width, displacements, length, period):
    """Pressure and gap (period,) on rows at n/length, n from -period//2, under a cylinder of radius 1 on E* = 1.

    length: of a row between two cells, over ``across``. The load is that of Hertz for this half width, pi a^2/4 (K. L.
    Johnson, Contact Mechanics, 1985, Eq. 4.43).
    """
    x = (np.arange(period) - period // 2) / length
    operator, profile = scipy.linalg.toeplitz(displacements[:period]), 0.5 * x**2
    touching = np.abs(x) < half_width
    for _ in range(50):
        (inside,) = np.nonzero(touching)
        one = np.ones((inside.size, 1))
        system = np.block([[operator[np.ix_(inside, inside)], -one], [one.T, np.zeros((1, 1))]])
        solved = np.linalg.solve(system, np.append(-profile[inside], 0.25 * np.pi * half_width**2 * length))
        pressure = np.zeros(period)
        pressure[inside] = solved[:-1]
        gap = np.where(touching, 0.0, operator @ pressure + profile - solved[-1])
        wrong = np.where(touching, pressure <= 0.0, gap < 0.0)
        if not wrong.any():
            return pressure, gap
        touching ^= wrong
    raise AssertionError("expected the set of contact to settle")


def on_grid(rows_, a, b):
    """The periodic field (period, period) whose cells of a row have its value."""
    i, j = np.indices((rows_.size, rows_.size))
    return rows_[(b * i - a * j + rows_.size // 2) % rows_.size]
