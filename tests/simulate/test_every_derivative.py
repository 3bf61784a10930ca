"""Every verb by every leaf of its arguments, each field of the result apart: both modes and central differences."""

import pytest

from tests.benchmarks.derivatives import SCENARIOS, faults, measured

AT_ONCE = ("flash_temperature, oblique",)
SLOW = ("slide_steady, half-space",)


def marked(name):
    marks = () if name in AT_ONCE else pytest.mark.slow if name in SLOW else pytest.mark.long
    return pytest.param(name, marks=marks)


@pytest.mark.parametrize("name", [marked(name) for name in SCENARIOS])
def test_both_modes_and_central_differences_agree(name):
    assert not faults(SCENARIOS[name], measured(SCENARIOS[name]))
