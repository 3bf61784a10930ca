"""The quantiles that intervals stand on, against scipy.stats."""

import numpy as np
import pytest
from scipy import stats

from fitting.inference import student


@pytest.mark.parametrize("dof", [1, 3, 17, np.inf])
def test_student_and_its_squares(dof):
    law, square = (stats.norm, stats.chi2(1)) if np.isinf(dof) else (stats.t(dof), stats.f(1, dof))
    for level in (0.5, 0.95, 1.0 - 1e-6):
        assert student.two_sided(level, dof) == pytest.approx(law.ppf(0.5 + 0.5 * level), rel=1e-9)
        assert student.two_sided(level, dof) ** 2 == pytest.approx(square.ppf(level), rel=1e-9)
        assert student.share_within(student.two_sided(level, dof), dof) == pytest.approx(level, rel=1e-12)
