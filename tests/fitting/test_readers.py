"""Readers: good files in many dresses, and a table of malformed ones, each a one-line ValueError."""

import numpy as np
import pytest

import fitting

pytestmark = pytest.mark.versions

T = np.arange(1.0, 13.0)
J = 1e-9 * (1 + T)


def write(tmp_path, text, name="film.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return path


def body(header, rows=None, separator=","):
    rows = [(f"{t:g}", f"{j:g}") for t, j in zip(T, 1 + T, strict=True)] if rows is None else rows
    return "\n".join([header, *(separator.join(row) for row in rows)]) + "\n"


def good_rows():
    return [[f"{t:g}", f"{1 + t:g}"] for t in T]


def changed(row, column, cell):
    rows = good_rows()
    rows[row][column] = cell
    return body("t [s],J [1/GPa]", rows)


GOOD = {
    "brackets": (body("t [s],J [1/GPa]"), 1.0),
    "parentheses": (body("Time (s),Compliance (GPa^-1)"), 1.0),
    "underscores": (body("time_s,J_1_per_GPa"), 1.0),
    "superscript": (body("Time [s],Creep Compliance [GPa⁻¹]"), 1.0),
    "call": (body("t [s],J(t) [1/GPa]"), 1.0),
    "hours": (body("Time [h],J [1/GPa]"), 3600.0),
    "tabs": (body("t [s]\tJ [1/GPa]", separator="\t"), 1.0),
    "semicolons": (body("t [s];J [1/GPa]", separator=";"), 1.0),
    "decimal commas": (
        body(
            "t [s];J [1/GPa]",
            [(f"{t:.1f}".replace(".", ","), f"{1 + t:.1f}".replace(".", ",")) for t in T],
            ";",
        ),
        1.0,
    ),
    "preamble": ("Exported on a Monday\n\nPoints = 12\n" + body("t [s],J [1/GPa]"), 1.0),
    "comments": ("# a remark\n" + body("t [s],J [1/GPa]"), 1.0),
    "bom": ("\ufeff" + body("t [s],J [1/GPa]"), 1.0),
    "crlf": (body("t [s],J [1/GPa]").replace("\n", "\r\n"), 1.0),
    "quotes": (body('"t [s]","J [1/GPa]"'), 1.0),
}


@pytest.mark.parametrize("name", GOOD)
def test_good_files(tmp_path, name):
    text, scale = GOOD[name]
    data = fitting.read_creep(write(tmp_path, text))
    np.testing.assert_allclose(data.t, scale * T, rtol=1e-12)
    np.testing.assert_allclose(data.J, J, rtol=1e-12)
    says_shear = "J" in text.replace("\ufeff", "")
    assert len(data.notes) == (0 if says_shear else 1)
    assert says_shear or "taken as shear" in data.notes[0]


def test_columns_and_units_are_taken_as_given(tmp_path):
    rows = [("x", f"{1 + t:g}", f"{t:g}") for t in T]
    path = write(tmp_path, body("label,q,clock", rows))
    data = fitting.read_creep(path, columns={"t": "clock", "J": 1}, units={"t": "min", "J": "1/GPa"})
    np.testing.assert_allclose(data.t, 60 * T)
    np.testing.assert_allclose(data.J, J)


def test_numbers_without_a_header_need_places_and_say_what_unit_was_taken(tmp_path):
    path = write(tmp_path, "\n".join(f"{j:g},{t:g}" for t, j in zip(T, J, strict=True)))
    with pytest.raises(ValueError, match=r"line 1: no header.*columns=\{'t': 0, 'J': 1\}"):
        fitting.read_creep(path)
    data = fitting.read_creep(path, columns={"t": 1, "J": 0})
    np.testing.assert_allclose(data.t, T)
    np.testing.assert_allclose(data.J, J)
    assert any("no unit, taken as 1/Pa" in note for note in data.notes)


def test_unsorted_repeated_and_missing_are_mended_and_said(tmp_path):
    rows = [[f"{t:g}", f"{1 + t:g}"] for t in np.arange(1.0, 41.0)]
    rows[3], rows[7] = rows[7], rows[3]
    rows[20][1], rows[21][1] = "nan", "-2"
    rows[30][0] = rows[29][0]
    data = fitting.read_creep(write(tmp_path, body("t [s],J [1/GPa]", rows)))
    assert data.t.size == 38 and np.all(np.diff(data.t) >= 0)
    said = " | ".join(data.notes)
    for phrase in ("NaN cell", "<= 0", "line 22", "line 23", "sorted", "1 repeated times"):
        assert phrase in said
    kept = {float(t): j for t, j in zip(data.t, data.J, strict=True)}
    np.testing.assert_allclose(kept[4.0], 5e-9)  # values moved with their times


def test_strain_and_stress_columns(tmp_path):
    rows = [(f"{t:g}", f"{0.1 * t:g}", "2") for t in T]
    data = fitting.read_creep(write(tmp_path, body("t [s],strain [%],stress [kPa]", rows)))
    np.testing.assert_allclose(data.strain, 1e-3 * T)
    np.testing.assert_allclose(data.stress[1], 2000.0)


def test_indentation_units(tmp_path):
    rows = [(f"{10 * t:g}", f"{2 * t:g}", f"{t:g}", "0.1", "0.2") for t in T]
    header = "Depth (nm)\tLoad (µN)\tTime (s)\tDepth (V)\tLoad (V)"
    path = write(tmp_path, "Run 5\n\n" + body(header, rows, "\t"), encoding="latin-1")
    data = fitting.read_indentation(path)
    np.testing.assert_allclose(data.depth, 1e-8 * T)
    np.testing.assert_allclose(data.load, 2e-6 * T)


H = "t [s],J [1/GPa]"
# name: (text, words the message must hold, reader's options)
MALFORMED = {
    "empty": ("", ["empty"], {}),
    "blank lines": ("\n\n \n", ["empty"], {}),
    "only comments": ("# a\n# b\n", ["empty"], {}),
    "header only": (H + "\n", ["line 1", "numbers"], {}),
    "prose": ("a letter\nto someone\n", ["numbers"], {}),
    "one column": ("t [s]\n1\n2\n3\n4\n5\n6\n", ["numbers"], {}),
    "binary": (b"\x89PNG\r\n\x1a\n\0\0\0", ["binary"], {}),
    "one row": (H + "\n1,2\n", ["at least 5"], {}),
    "four rows": (H + "\n1,2\n2,3\n3,4\n4,5\n", ["at least 5"], {}),
    "word in a cell": (changed(4, 1, "oops"), ["line 6", "J [1/GPa]", "oops"], {}),
    "word in time": (changed(2, 0, "soon"), ["line 4", "t [s]", "soon"], {}),
    "two numbers in a cell": (changed(4, 1, "1 2"), ["line 6", "1 2"], {}),
    "infinite": (changed(4, 1, "inf"), ["line 6", "finite"], {}),
    "minus infinite": (changed(4, 0, "-inf"), ["line 6", "t [s]", "finite"], {}),
    "overflow": (changed(4, 1, "1e999"), ["line 6", "finite"], {}),
    "negative time": (changed(0, 0, "-1"), ["line 2", "t [s]", "-1"], {}),
    "short row": (body(H, [*good_rows()[:3], ["4"], *good_rows()[4:]]), ["line 5"], {}),
    "long row": (body(H, [*good_rows()[:3], ["4", "5", "6"], *good_rows()[4:]]), ["line 5", "2 columns"], {}),
    "all NaN": (body(H, [[f"{t:g}", "nan"] for t in T]), ["line 2", "NaN", "12 of 12"], {}),
    "a third NaN": (body(H, [[f"{t:g}", "nan" if t > 8 else "1"] for t in T]), ["line 10", "NaN"], {}),
    "empty cells": (body(H, [[f"{t:g}", "" if t > 8 else "1"] for t in T]), ["line 10", "empty"], {}),
    "J all zero": (body(H, [[f"{t:g}", "0"] for t in T]), ["line 2", "<= 0"], {}),
    "J all negative": (body(H, [[f"{t:g}", "-3"] for t in T]), ["line 2", "<= 0"], {}),
    "a third negative": (body(H, [[f"{t:g}", "-3" if t > 8 else "1"] for t in T]), ["line 10", "<= 0"], {}),
    "one time throughout": (body(H, [["5", "1"] for _ in T]), ["different times"], {}),
    "unknown time unit": (body("t [fortnight],J [1/GPa]"), ["line 1", "fortnight"], {}),
    "modulus for compliance": (body("t [s],J [GPa]"), ["line 1", "'GPa'", "1/Pa"], {}),
    "unknown compliance unit": (body("t [s],J [1/bananas]"), ["line 1", "bananas"], {}),
    "empty unit": (body("t [s],J []"), ["line 1", "unit"], {}),
    "no time column": (body("x [s],J [1/GPa]"), ["line 1", "'t'", "none"], {}),
    "no compliance column": (body("t [s],y [1/GPa]"), ["line 1", "'J'", "none"], {}),
    "two time columns": (
        body("t [s],time [s],J [1/GPa]", [("1", "1", "1")] * 12),
        ["line 1", "time [s]"],
        {},
    ),
    "two compliance columns": (
        body("t [s],J [1/GPa],J [1/MPa]", [("1", "1", "1")] * 12),
        ["line 1", "J [1/MPa]"],
        {},
    ),
    "wrong column name": (body(H), ["line 1", "clock"], {"columns": {"t": "clock"}}),
    "column out of range": (body(H), ["columns", "9"], {"columns": {"t": 9}}),
    "column used twice": (body(H), ["different columns"], {"columns": {"t": 0, "J": 0}}),
    "unknown column key": (body(H), ["columns", "time"], {"columns": {"time": 0}}),
    "unknown unit key": (body(H), ["units", "time"], {"units": {"time": "s"}}),
    "unknown unit given": (body(H), ["line 1", "parsec"], {"units": {"t": "parsec"}}),
    "name without header": (
        "1,2\n2,3\n3,4\n4,5\n5,6\n6,7\n",
        ["no header", "clock"],
        {"columns": {"t": "clock"}},
    ),
    "unknown convention": (body(H), ["convention", "E"], {"convention": "E"}),
    "unclosed bracket": (body("t [s,J [1/GPa"), ["line 1"], {}),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_malformed_files(tmp_path, name):
    text, words, options = MALFORMED[name]
    path = write(tmp_path, text)
    with pytest.raises(ValueError) as caught:
        fitting.read_creep(path, **options)
    message = str(caught.value)
    assert "\n" not in message and len(message) < 400
    for word in words:
        assert word in message, message
    assert "film.csv" in message or options.get("convention")


def test_missing_file_and_folder(tmp_path):
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(ValueError, match="cannot be read"):
            fitting.read_creep(path)


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({"t": T}, "J"),
        ({"t": T, "J": J, "strain": J}, "J"),
        ({"t": T, "J": -J}, "J"),
        ({"t": T, "J": J[:-1]}, "J"),
        ({"t": T[::-1], "J": J}, "t:"),
        ({"t": T, "J": np.where(T > 5, np.nan, J)}, "index 5"),
        ({"t": T, "J": ["a"] * 12}, "J"),
        ({"t": T, "strain": J}, "stress"),
        ({"t": T, "strain": J, "stress": 0 * J}, "stress"),
        ({"t": T, "strain": J, "stress": ([1.0, 0.0], [1.0, 1.0])}, "stress"),
        ({"t": T, "J": J, "stress": J}, "stress"),
        ({"t": T, "J": J, "convention": "E"}, "convention"),
    ],
)
def test_containers_refuse(fields, word):
    with pytest.raises(ValueError, match=word):
        fitting.CreepData(**fields)
