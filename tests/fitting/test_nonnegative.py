"""Least squares with values >= 0 by the conditions of the minimum, also where the first method gives up."""

import numpy as np
import pytest
import scipy

from fitting.data.weights import nonnegative


@pytest.mark.parametrize("gives_up", [False, True])
def test_the_conditions_of_the_minimum_hold(gives_up, monkeypatch):
    if gives_up:

        def nnls(*_, **__):
            raise RuntimeError("Maximum number of iterations reached.")

        monkeypatch.setattr(scipy.optimize, "nnls", nnls)
    rng = np.random.default_rng(0)
    for _ in range(20):
        s = np.linspace(0.0, 1.0, 60)
        A = s[:, None] ** rng.uniform(0.5, 3.5, 7)  # nearly alike, as the powers of a film
        y = s**1.5 + 0.05 * rng.standard_normal(60)
        x = nonnegative(A, y)
        slope = A.T @ (A @ x - y)
        assert np.all(x >= 0.0) and np.all(slope > -1e-6) and np.all(np.abs(slope[x > 1e-12]) < 1e-6)
