"""Axes of pictures: what a tick says is the value at it."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from fitting.views import sheet


@pytest.mark.parametrize(
    ("unit", "values", "says", "tick"),
    [
        ("1/Pa", [1e-9, 3.5e-9], "J [1/GPa]", ("2e-09", "2")),
        ("1/Pa", [2e-5, 4e-4], "J [1/MPa]", ("2e-4", "200")),
        ("m", [0.0, -1.2e-7], "J [nm]", ("-1e-7", "-100")),
        ("Pa", [5e5], "J [kPa]", ("2e5", "200")),
        ("N", [3.0], "J [N]", None),
        ("s", [1e-6], "J [s]", None),
        ("1/Pa", [0.0], "J [1/Pa]", None),
    ],
)
def test_a_tick_times_its_unit_is_the_value(unit, values, says, tick):
    axes = Figure().add_subplot()
    axes.plot(values)
    sheet.axis_label(axes.yaxis, "J", unit, np.array(values))
    assert axes.get_ylabel() == says
    if tick is not None:
        assert axes.yaxis.get_major_formatter()(float(tick[0])) == tick[1]
