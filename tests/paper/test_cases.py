"""The reproductions: they run, they write, and a wrong reference makes them fail."""

import dataclasses
import functools
import json

import pytest

from jaxcontact.paper import figure_4, reproduce, speed_map, tribofilm
from jaxcontact.paper.comparison import Row

N = 64
SABOTAGED = (
    figure_4.CASE,
    *(pytest.param(case, marks=pytest.mark.slow) for case in (tribofilm.FIGURE_12, speed_map.CASE)),
)


@functools.lru_cache
def simulated(name):
    case = next(case for case in reproduce.CASES if case.name == name)
    return case.simulate(N)


def failures(case, references):
    return {row.quantity for row in case.compare(simulated(case.name), references) if not row.holds}


@pytest.mark.slow
@pytest.mark.parametrize("case", SABOTAGED, ids=lambda case: case.name)
def test_every_wrong_reference_is_noticed(case):
    right = failures(case, case.references)
    for key, value in case.references.items():
        wrong = failures(case, {**case.references, key: 1.1 * value})
        assert any(key in quantity for quantity in wrong), key
        assert right <= wrong, key


@pytest.mark.slow
@pytest.mark.parametrize("case", SABOTAGED, ids=lambda case: case.name)
def test_all_but_the_counted_radii_hold_on_a_coarse_grid(case):
    bad = [name for name in failures(case, case.references) if "p0" not in name and "a at" not in name]
    assert not [name for name in bad if "a/a0" not in name and "a0 [um]" not in name and "p(" not in name]


def replaced(case, references):
    return dataclasses.replace(case, references=references, simulate=lambda n: simulated(case.name))


@pytest.mark.slow
def test_exit_status_and_files(tmp_path, capsys):
    name = "approach/approach0 at E1/E2 = 0.5"
    sound = {**figure_4.REFERENCES}

    def compare(found, references):
        return [row for row in figure_4.compare(found, references) if row.quantity == name]

    case = dataclasses.replace(replaced(figure_4.CASE, sound), compare=compare)
    wrong = dataclasses.replace(case, references={**sound, name: 1.01 * sound[name]})
    assert reproduce.main(["figure_4"], tmp_path / "right", n=N, cases=[case]) == 0
    assert reproduce.main([], tmp_path / "wrong", n=N, cases=[wrong]) == 1
    assert "NO" in capsys.readouterr().out
    summary = json.loads((tmp_path / "wrong" / "figure_4" / "summary.json").read_text())
    assert summary["holds"] is False
    assert (tmp_path / "wrong" / "figure_4" / "figure_4.png").stat().st_size > 1000
    assert reproduce.main([], tmp_path / "wrong", n=N, cases=[case]) == 2


def test_unknown_case_is_refused(tmp_path, capsys):
    assert reproduce.main(["figure_99"], tmp_path) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "figure_4" in error
    assert "figure_12" in error


def test_a_row_that_is_not_a_number_does_not_hold():
    assert not Row("x", "paper", 1.0, float("nan"), 0.1).holds


# 14 s of processor time each, the long ones 35 s
QUICK = (
    "figure_4",
    *(pytest.param(f"figure_{n}", marks=pytest.mark.long) for n in (6, 9, 10, 11, 12)),
)  # fmt: skip
SLIDING = ("figure_13", "figure_14", "figure_15", "speed_map", "claims")


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_the_quick_figures_hold_at_full_size(name, tmp_path):
    """As ``jaxcontact reproduce NAME``: every comparison, on 256 cells a side."""
    assert reproduce.main([name], tmp_path) == 0


@pytest.mark.long
def test_the_reproduction_of_sliding_on_64_cells_a_side(tmp_path):
    """At the paper's 256 it takes a quarter of an hour: ``jaxcontact reproduce``."""
    cases = [replaced(case, case.references) for case in reproduce.CASES if case.name in SLIDING]
    assert reproduce.main(list(SLIDING), tmp_path, n=N, cases=cases) == 0
