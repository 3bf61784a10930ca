"""Quantities with units in case files: read as the numbers in SI units that they say."""

import math

import pytest
from test_command_line import CASE

from jaxcontact.__main__ import main
from jaxcontact.shell import case_schema
from jaxcontact.shell.case_file import case_text, read_case
from jaxcontact.shell.case_schema import UNITS, in_si

WITH_UNITS = {
    "thickness = 150e-9": 'thickness = "150 nm"',
    "radius = 9.525e-3": 'radius = "9.525 mm"',
    "G1 = 0.75e9": 'G1 = "0.75 GPa"',
    "eta1 = 3.1486e12": 'eta1 = "3148.6 GPa s"',
    "E = 210e9": 'E = "210 GPa"',
    "load = 10.0": 'load = "10e3 mN"',
    "end = 600.0": 'end = "10 min"',
    "width = 300e-6": 'width = "300 µm"',
}


def test_a_case_with_units_is_the_case_in_si_units(tmp_path):
    """Number for number, and shown without units."""
    text = CASE
    for plain, with_unit in WITH_UNITS.items():
        assert plain in text
        text = text.replace(plain, with_unit)
    (tmp_path / "plain.toml").write_text(CASE)
    (tmp_path / "units.toml").write_text(text, encoding="utf-8")
    plain, units = read_case(tmp_path / "plain.toml"), read_case(tmp_path / "units.toml")
    assert units.tables == plain.tables
    assert case_text(units) == case_text(plain)


def test_units_stand_in_lists_and_in_several_layers(tmp_path):
    text = CASE.replace("[layer]", "[[layer]]").replace("load = 10.0", 'load = ["0 N", "20 mN", 0.03]')
    text = text.replace("end = 600.0\nsteps = 6", 'values = [0.0, "1 h", "1 d"]').replace(
        "150e-9", '"0.15 um"'
    )
    (tmp_path / "case.toml").write_text(text)
    case = read_case(tmp_path / "case.toml")
    assert list(case.control.value) == [0.0, 0.02, 0.03]
    assert list(case.times) == [0.0, 3600.0, 86400.0]
    assert case.body.layers[0].thickness == 150e-9


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("2.5 mN", "N", 2.5e-3),
        ("-4nm", "m", -4e-9),
        ("1.5 1/GPa", "1/Pa", 1.5e-9),
        ("36 mm/h", "m/s", 1e-5),
        ("90 deg", "rad", math.pi / 2),
        ("2 1/(MPa s)", "1/(Pa s)", 2e-6),
        ("50 mJ/m2", "J/m2", 0.05),
        ("50 mN/m", "J/m2", 0.05),
    ],
)
def test_a_quantity_is_its_number_in_si(text, unit, value):
    assert in_si(text, unit) == pytest.approx(value, rel=1e-15)


def test_every_quantity_of_the_schema_has_its_units():
    groups = [keys for kind in case_schema.KINDS for keys in case_schema.sections_of(kind).values()]
    groups += [keys for _, keys in (case_schema.MATERIALS | case_schema.SHAPES | case_schema.LAWS).values()]
    assert {key.unit for keys in groups for key in keys.values()} - {None} == set(UNITS)


@pytest.mark.parametrize("wrong", ["150 kg", "150", "nm", "1e5000 nm", "150 nm nm"])
def test_another_dimension_is_one_line_and_status_2(wrong, tmp_path, capfd):
    (tmp_path / "case.toml").write_text(CASE.replace("150e-9", f'"{wrong}"'))
    assert main(["check", str(tmp_path / "case.toml")]) == 2
    error = capfd.readouterr().err
    assert error.count("\n") == 1
    assert f'layer.thickness: found "{wrong}", accepted: a number > 0' in error


def test_a_case_with_an_oblong_contact_reads_back_with_the_grid_it_has(tmp_path):
    """The grid chosen for a roller is as long as the roller, and as wide as its contact."""
    roller = 'shape = "cylinder"\nlength = 5e-3'
    text = CASE.replace('shape = "sphere"', roller).replace("width = 300e-6\n", "")
    assert roller in text and "width" not in text
    paths = [tmp_path / name for name in ("case.toml", "shown.toml")]
    paths[0].write_text(text)
    case = read_case(paths[0])
    paths[1].write_text(case_text(case))
    again = read_case(paths[1])
    assert case.grid.width[1] > 5e-3 > 10.0 * case.grid.width[0]
    assert (again.grid.shape, again.grid.spacing) == (case.grid.shape, case.grid.spacing)
