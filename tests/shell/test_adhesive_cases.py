"""Case files with a table [adhesion]: what is read, checked, run and stored."""

import json
import math

import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact.shell.case_file import read_case

CASE = """
[substrate]
material = "standard-linear-solid"
G1 = 2e6
G2 = 2e6
eta2 = 2e6
nu = 0.5
[indenter]
shape = "sphere"
radius = 5e-6
[adhesion]
law = "dugdale"
work = "50 mJ/m2"
strength = 0.3e6
[control]
load = [1e-6, 0.0, -0.5e-6]
[times]
values = [0.0, 0.4, 0.8]
[grid]
n = 32
width = 8e-6
"""


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    return path


def tabor(G, z=50e-3 / 0.3e6):
    """(R w^2/(E*^2 z^3))^(1/3) with E* = 2 G/(1 - nu)."""
    return math.cbrt(5e-6 * 50e-3**2 / (4.0 * G) ** 2) / z


def test_a_case_has_the_law_and_tensile_loads(case):
    read = read_case(case)
    assert read.motion["adhesion"] == jc.DugdaleAdhesion(work=0.05, strength=0.3e6)
    assert read.control.value[-1] == -0.5e-6 and read.result is jc.AdhesiveHistory


@pytest.mark.slow
def test_check_prints_the_tabor_number_at_both_ends(case, capfd):
    """The creep compliance 1/G1 + (1 - exp(-t))/G2 doubles in the end, of which 55 % come within 0.8 s."""
    assert main(["check", str(case)]) == 0
    out, err = capfd.readouterr()
    last = 1.0 / (1.0 / 2e6 + (1.0 - math.exp(-0.8)) / 2e6)
    assert (
        f"Tabor number of the surface: {tabor(2e6):.2g} at first, {tabor(last):.2g} with" in out and err == ""
    )


def test_check_warns_of_an_edge_and_a_contact_that_the_grid_does_not_resolve(case, capfd):
    case.write_text(CASE.replace("0.3e6", "3e6").replace("width = 8e-6", "width = 2e-6"))
    assert main(["check", str(case)]) == 0
    err = capfd.readouterr().err
    assert "cells across the zone of attraction at the edge of contact" in err
    assert "grid.width: the contact may grow to" in err


def test_a_load_is_not_tensile_without_adhesion(case, capfd):
    plain = CASE[: CASE.index("[adhesion]")] + CASE[CASE.index("[control]") :]
    case.write_text(plain)
    assert main(["check", str(case)]) == 2
    assert "control.load: found [1e-06, 0.0, -5e-07], accepted: a number > 0" in capfd.readouterr().err


@pytest.mark.slow
def test_sliding_has_adhesion_with_and_without_friction(case, capfd):
    sliding = '[experiment]\nkind = "sliding"\nvelocity = 1e-6\n'
    case.write_text(sliding + CASE)
    read = read_case(case)
    assert read.result is jc.AdhesiveSlidingHistory and read.motion["adhesion"].work == 0.05
    assert main(["check", str(case)]) == 0 and "Tabor number of the surface" in capfd.readouterr().out
    case.write_text(sliding + "friction = 0.3\nshear_strength = 1e4\n" + CASE)
    read = read_case(case)
    assert main(["check", str(case)]) == 0 and (read.motion["friction"], read.motion["shear_strength"]) == (
        0.3,
        1e4,
    )


SHEARED = CASE.replace(
    "load = [1e-6, 0.0, -0.5e-6]", "load = 1e-6\ntangential_load = [[0, 0], [1e-8, 0], [2e-8, 0]]"
)
AT_ONCE = CASE.replace("load = [1e-6, 0.0, -0.5e-6]", "load = 1e-7").replace(
    "[times]\nvalues = [0.0, 0.4, 0.8]\n", ""
)
OTHERS = {
    "shear": 'kind = "shear"\nfriction = 0.3\nshear_strength = "0.1 MPa"\ncoupled = false\n' + SHEARED,
    "rubbing": 'kind = "rubbing"\nvelocity = 1e-6\nshear_strength = 1e5\nwears = "indenter"\n[wear]\n'
    "coefficient = 1e-18\n" + CASE,
    "steady sliding": 'kind = "steady-sliding"\nvelocity = 1e-5\nfriction = 0.2\nshear_strength = 1e4\n'
    + AT_ONCE,
    "steady rolling": 'kind = "steady-rolling"\nvelocity = 1e-5\nfriction = 0.2\nshear_strength = 1e4\n'
    + AT_ONCE.replace("load = 1e-7", "load = 1e-7\ncreepage = [0.05, 0.0]"),
}


@pytest.mark.filterwarnings("ignore:only 9.1 cells across the largest contact")
@pytest.mark.filterwarnings("ignore:the time steps have an estimated error")
@pytest.mark.long
@pytest.mark.parametrize("name", OTHERS)
def test_a_run_of_the_other_verbs_stores_what_python_gives(name, case, capfd):
    case.write_text("[experiment]\n" + OTHERS[name])
    assert main(["check", str(case)]) == 0 and "Tabor number of the surface" in capfd.readouterr().out
    assert main(["run", str(case), "-o", str(case.parent / "out")]) == 0
    read = read_case(case)
    ball, work = jc.Sphere(5e-6), jc.DugdaleAdhesion(0.05, 0.3e6)
    common = {"grid": jc.Grid.square(32, 8e-6), "adhesion": work}
    times, stored = np.array([0.0, 0.4, 0.8]), jc.read_result(case.parent / "out" / "result.npz")
    if name == "shear":
        along = jc.TangentialLoad(np.array([[0, 0], [1e-8, 0], [2e-8, 0]]))
        wanted = jc.shear(
            read.body,
            ball,
            jc.Load(1e-6),
            along,
            times,
            friction=0.3,
            shear_strength=1e5,
            coupled=False,
            **common,
        )
    elif name == "rubbing":
        pressed = jc.Load(np.array([1e-6, 0.0, -0.5e-6]))
        wanted = jc.rub(
            read.body,
            ball,
            pressed,
            times,
            velocity=1e-6,
            law=jc.Archard(1e-18),
            shear_strength=1e5,
            wears="indenter",
            **common,
        )
        assert float(wanted.friction_work.max()) > 0.0  # of the shear strength alone
        np.testing.assert_allclose(stored.friction_work, wanted.friction_work, rtol=1e-9)
    else:
        rolls = name == "steady rolling"
        common |= {"creepage": np.array([0.05, 0.0])} if rolls else {}
        wanted = (jc.roll_steady if rolls else jc.slide_steady)(
            read.body, ball, jc.Load(1e-7), velocity=1e-5, friction=0.2, shear_strength=1e4, **common
        )
    for field in ("load", "approach", "pressure", "tabor_number"):
        value = getattr(wanted, field)
        np.testing.assert_allclose(
            getattr(stored, field), value, rtol=1e-9, atol=1e-9 * np.max(np.abs(value))
        )
    assert np.any(np.asarray(stored.pressure) < 0.0)


@pytest.mark.filterwarnings("ignore:the time steps have an estimated error")
@pytest.mark.slow
def test_a_run_stores_what_indent_gives(case, tmp_path, capfd):
    out = tmp_path / "out"
    assert main(["run", str(case), "-o", str(out)]) == 0
    capfd.readouterr()
    read = read_case(case)
    given = read.body, read.indenter, read.control, read.times
    wanted = jc.indent(*given, grid=read.grid, adhesion=read.motion["adhesion"])
    stored = jc.read_result(out / "result.npz")
    assert isinstance(stored, jc.AdhesiveHistory)
    for name in ("load", "approach", "jumps", "cohesive_cells", "tabor_number"):
        np.testing.assert_allclose(getattr(stored, name), getattr(wanted, name), rtol=1e-9, atol=1e-20)
    np.testing.assert_allclose(stored.tabor_number[0], tabor(2e6), rtol=1e-12)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["tabor_number_start_m_per_m"] == pytest.approx(tabor(2e6))
    assert summary["cohesive_cells_end_m_per_m"] == pytest.approx(float(wanted.cohesive_cells[-1]))
    assert "overview.png" in summary["pictures"] and "tabor number" in stored.summary()
    assert main(["convert", str(out / "result.npz"), "-o", str(out / "result.nc")]) == 0
    again = jc.read_result(out / "result.nc")
    np.testing.assert_array_equal(again.pressure, stored.pressure)
    stored.plot().savefig(tmp_path / "again.png")
