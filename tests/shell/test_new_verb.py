"""A public function as a seam: a creep test that only this file knows, from its case file to its stored result."""

import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact._support.pytree import pytree, replace
from jaxcontact.shell.case_file import read_case
from jaxcontact.shell.case_schema import (
    ITERATIONS,
    KINDS,
    LOAD_ON,
    POSITIVE,
    SAVE,
    TIMES_KEYS,
    TOLERANCE,
    Key,
    Kind,
)
from jaxcontact.simulate.indent import Indentation
from jaxcontact.simulate.run import marched


@pytree
class HoldHistory(jc.ContactHistory):
    """The result of a creep test."""


@pytree
class Hold(Indentation):
    """An indentation whose load rises in proportion to time and is then held."""

    @classmethod
    def of(cls, body, indenter, control, times, grid, *, rise, **given):
        times = np.asarray(times)
        share = np.minimum((times - times[0]) / rise, 1.0)
        return super().of(body, indenter, jc.Load(share * np.asarray(control.value)), times, grid, **given)

    def planned(self):
        return replace(super().planned(), result_class=HoldHistory)


def press_and_hold(
    body, indenter, control, times, *, rise, grid, tolerance=1e-8, max_iterations=500, save="all"
):
    """Compute the contact under a load that rises in proportion to time and is then held."""
    given = {"tolerance": tolerance, "max_iterations": max_iterations, "save": save}
    return marched(Hold.of(body, indenter, control, times, grid, rise=rise, **given))


RECORD = Kind(
    press_and_hold,
    HoldHistory,
    {"rise": Key(POSITIVE, "time in which the load rises [s]", required=True, example=900.0)},
    {"load": LOAD_ON},
    {"tolerance": TOLERANCE, "max_iterations": ITERATIONS, "save": SAVE},
    example="polymer_coating",
    memory=3.0,
    stationary=True,
    times=TIMES_KEYS,
    march=Hold.of,
)


@pytest.fixture
def case(monkeypatch, tmp_path):
    """A template of the new kind, made smaller."""
    monkeypatch.setitem(KINDS, "press-and-hold", RECORD)
    path = tmp_path / "hold.toml"
    assert main(["new", "press-and-hold", str(path)]) == 0
    lines = path.read_text().splitlines()
    small = {"n = ": "n = 32", "steps = ": "steps = 8"}
    path.write_text("\n".join(next((to for at, to in small.items() if x.startswith(at)), x) for x in lines))
    return path


# 5 % of the peak after the first
@pytest.mark.filterwarnings("ignore:the time steps have an estimated error")
@pytest.mark.slow
def test_the_record_of_a_verb_is_all_that_files_and_commands_need(case, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["check", str(case)]) == 0
    assert main(["run", str(case), "-o", str(out)]) == 0
    assert main(["plot", str(out / "result.npz"), "-o", str(tmp_path / "hold.png")]) == 0
    assert main(["convert", str(out / "result.npz"), "-o", str(tmp_path / "hold.pvd")]) == 0
    found = jc.read_result(out / "result.npz")
    assert type(found) is HoldHistory and "HoldHistory of 9 times" in found.summary()
    np.testing.assert_allclose(found.load, 5e-3 * np.minimum(found.times / 900.0, 1.0), rtol=1e-9)
    given = jc.indent(**arguments_of(case), control=jc.Load(found.load), times=found.times)
    np.testing.assert_allclose(found.approach, given.approach, rtol=1e-9)


def arguments_of(path):
    read = read_case(path)
    return {"body": read.body, "indenter": read.indenter, "grid": read.grid}
