"""Indenters that creep or are coated, in case files."""

import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.shell.case_file import CaseError, case_text, read_case, si_value

CASE = """
[substrate]
material = "elastic"
E = "210 GPa"
nu = 0.3
[indenter]
shape = "sphere"
radius = "9.5 mm"
[[indenter.layer]]
material = "burgers"
G1 = "0.75 GPa"
G2 = "1 GPa"
eta1 = 6e12
eta2 = 1e11
thickness = "150 nm"
[indenter.material]
E = 210e9
nu = 0.3
[control]
load = 1.0
[times]
values = [0.0, 60.0]
[grid]
n = 16
width = 120e-6
"""


@pytest.fixture
def read(tmp_path):
    def reader(text):
        path = tmp_path / "case.toml"
        path.write_text(text)
        return read_case(path)

    return reader


@pytest.mark.slow
def test_a_coated_ball_is_that_of_python(read):
    case = read(CASE)
    steel = jc.Elastic.from_young(210e9, nu=0.3)
    film = jc.Layer(jc.Burgers(0.75e9, 1e9, 6e12, 1e11), 150e-9)
    ball = jc.Sphere(9.5e-3, jc.LayeredHalfSpace([film], steel))
    grid = jc.Grid.square(16, 120e-6)
    expected = jc.indent(
        jc.LayeredHalfSpace([], steel), ball, jc.Load(1.0), [0.0, 60.0], grid=grid, substeps=8
    )
    found = jc.indent(case.body, case.indenter, case.control, case.times, grid=case.grid, substeps=8)
    np.testing.assert_allclose(found.pressure, expected.pressure, rtol=1e-12)
    assert float(found.indenter_film_strain[1]) > float(found.indenter_film_strain[0]) > 0.0


def test_the_text_of_a_case_reads_back(read):
    for text in (CASE, CASE.replace("[indenter.material]\nE = 210e9\nnu = 0.3\n", "")):
        case = read(text)
        again = read(case_text(case))
        assert again.tables == read(case_text(again)).tables
        assert again.indenter == case.indenter


def test_a_ball_that_creeps_and_a_gel_on_a_rigid_ball(read):
    creeping = CASE[: CASE.index("[[indenter.layer]]")] + CASE[CASE.index("[control]") :]
    creeping += '[indenter.material]\nmaterial = "maxwell"\nG = "1 MPa"\neta = 1e9\n'
    assert read(creeping).indenter.material == jc.Maxwell(1e6, 1e9)
    bare = read(CASE.replace("[indenter.material]\nE = 210e9\nnu = 0.3\n", ""))
    assert bare.indenter.material.substrate is None
    assert si_value("indenter.layer[0].thickness", "150 nm") == pytest.approx(150e-9)
    assert si_value("indenter.material.G", "1 GPa") == pytest.approx(1e9)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('thickness = "150 nm"', "", r"indenter.layer\[0\].thickness: missing"),
        ('thickness = "150 nm"', 'thickness = "150 nN"', r"indenter.layer\[0\].thickness: found \"150 nN\""),
        ('material = "burgers"', 'material = "burger"', r"indenter.layer\[0\].material: found \"burger\""),
        ("E = 210e9\nnu = 0.3", 'material = "rigid"', r"indenter.material.material: found \"rigid\""),
        ("E = 210e9\nnu = 0.3", "E = 210e9\nnu = 0.3\nG1 = 1.0", r"indenter.material.G1"),
    ],
)
def test_mistakes_are_named(read, old, new, message):
    with pytest.raises(CaseError, match=message):
        read(CASE.replace(old, new, 1))
