"""The quantiles that intervals stand on, against scipy.stats."""

import numpy as np
import pytest
from scipy import stats

from fitting.inference import noise


@pytest.mark.parametrize("dof", [1, 3, 17, np.inf])
def test_student_and_its_squares(dof):
    law, square = (stats.norm, stats.chi2(1)) if np.isinf(dof) else (stats.t(dof), stats.f(1, dof))
    for level in (0.5, 0.95, 1.0 - 1e-6):
        assert noise.two_sided(level, dof) == pytest.approx(law.ppf(0.5 + 0.5 * level), rel=1e-9)
        assert noise.two_sided(level, dof) ** 2 == pytest.approx(square.ppf(level), rel=1e-9)
        assert noise.share_within(noise.two_sided(level, dof), dof) == pytest.approx(level, rel=1e-12)


@pytest.mark.parametrize("dof", [2, 25, np.inf])
def test_half_widths_hold_a_share_of_a_mixture(dof):
    """Quantiles of random mixtures, some dominated by a member of small share and large variance; of the table as well."""
    rng, law = np.random.default_rng(0), stats.norm if np.isinf(dof) else stats.t(dof)
    share, variance = rng.dirichlet(np.full(9, 0.3), 40), np.exp(rng.normal(0.0, 3.0, (40, 9, 2)))
    for level in (0.5, 0.95, 0.9999):
        for kind, error in ((noise.share_and_slope, 1e-8), (noise.tabulated, 2e-5)):
            half = noise.mixture_half_width(share, variance, level, dof, kind)
            inside = 2.0 * law.cdf(half[:, None] / np.sqrt(variance)) - 1.0
            np.testing.assert_allclose(np.einsum("am,amq->aq", share, inside), level, atol=error)
