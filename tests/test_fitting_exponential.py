"""The integrals of the exponential against 40 digits, on both sides of where the series ends."""

import jax
import mpmath
import numpy as np
import pytest

from fitting._exponential import SERIES, phi1, phi2

Z = [0.0, 1e-12, 1e-6, 1e-3, 0.999 * SERIES, SERIES, 0.3, 1.0, 30.0, 1e4]


def exact(z, order):
    """int_0^1 (1 - s)^(order - 1) exp(-z s) ds by its hypergeometric function."""
    with mpmath.workdps(40):
        return mpmath.hyp1f1(1, order + 1, -mpmath.mpf(z)) / order


@pytest.mark.parametrize(("phi", "order"), [(phi1, 1), (phi2, 2)])
def test_integrals_of_the_exponential(phi, order):
    np.testing.assert_allclose(phi(np.array(Z)), [float(exact(z, order)) for z in Z], rtol=1e-14)
    slopes = [float(mpmath.diff(lambda z: exact(z, order), z)) for z in Z]
    np.testing.assert_allclose(jax.vmap(jax.grad(phi))(np.array(Z)), slopes, rtol=1e-12)
