"""The tables that commands write, as pandas reads them."""

import pytest

RESIDUAL = "residual [standard deviations]"


def read_back(path, columns=None):
    """A table as pandas reads it, with a name for every column and no row that is shifted; columns: their names."""
    pandas = pytest.importorskip("pandas", reason="the extra that reads tables back")
    found = pandas.read_csv(path)
    assert not any(name.startswith("Unnamed") for name in found.columns) and len(found.columns) > 1
    # otherwise the rows have more cells than the line of names
    assert isinstance(found.index, pandas.RangeIndex)
    if columns is not None:
        assert list(found.columns) == columns
    return found


def curve_of(name, unit, over="t [s]"):
    """The names of the columns of the curve.csv of one quantity."""
    return [over, f"{name} [{unit}]", f"fitted [{unit}]", RESIDUAL]
