"""Intervals from two groups of points whose error scales were estimated separately.

A linear function of the coordinates has the variance v = v_1 + v_2 from the two groups. v_i is proportional to the variance
estimated for group i with nu_i degrees of freedom, so that v has about

    nu = (v_1 + v_2)^2/(v_1^2/nu_1 + v_2^2/nu_2)

degrees of freedom (F. E. Satterthwaite, Biometrics Bull. 2 (1946) 110).
"""

import dataclasses

import numpy as np

from fitting.inference import student


@dataclasses.dataclass(frozen=True, eq=False)
class TwoScales:
    """Two groups of points: Q (n, k), orthonormal columns that span the weighted Jacobian; second (n,) bool, the points of
    the second group; dof (2,): degrees of freedom of their variances, and pooled, the one of the interval to correct."""

    Q: np.ndarray
    second: np.ndarray
    dof: tuple[float, float]
    pooled: float

    def factors(self, directions: np.ndarray, level: float) -> np.ndarray:
        """Return the factors (q,) on the half widths of intervals, at a level, of functions with directions (k, q) of unit
        length."""
        parts = (self.Q @ directions) ** 2
        v = np.stack([parts[~self.second].sum(0), parts[self.second].sum(0)])
        dof = v.sum(0) ** 2 / (v**2 / np.array(self.dof)[:, None]).sum(0)
        whole = student.two_sided(level, self.pooled)
        return np.array([student.two_sided(level, float(one)) for one in dof]) / whole


def degrees_of_freedom(Q: np.ndarray, second: np.ndarray) -> tuple[float, float]:
    """Return the degrees of freedom of the variances of two groups of points: their numbers less their leverages."""
    left = 1.0 - np.sum(Q * Q, 1)
    return float(left[~second].sum()), float(left[second].sum())
