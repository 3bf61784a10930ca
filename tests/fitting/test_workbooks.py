"""Workbooks, clock times, names in other languages, and a stress stated above the columns."""

import datetime

import numpy as np
import pytest

import fitting

T = np.arange(0.0, 60.0, 3.0)
J = 1e-6 * (1.0 + T)
STRESS = 50.0


def rows(*columns, form="{:.9g}", sep=","):
    return "".join(sep.join(form.format(value) for value in row) + "\n" for row in zip(*columns, strict=True))


def read(folder, text, **options):
    path = folder / "curve.csv"
    path.write_text(text, encoding="utf-8")
    return fitting.read_creep(path, **options)


@pytest.mark.parametrize(
    "names",
    [
        "Temps [s],Complaisance de fluage [1/Pa]", "Tiempo (s),Complianza de fluencia (1/Pa)",
        "\u6642\u9593[s],\u30af\u30ea\u30fc\u30d7\u30b3\u30f3\u30d7\u30e9\u30a4\u30a2\u30f3\u30b9[1/Pa]",
        "Time,Compliance\n\ns,1/Pa", "Time,Compliance\nInterval 1,Interval 1\ns,1/Pa",
    ],
    ids=["French", "Spanish", "Japanese", "units two rows below", "a row between"],
)  # fmt: skip
def test_a_compliance_under_other_names(tmp_path, names):
    data = read(tmp_path, f"{names}\n" + rows(T, J))
    np.testing.assert_allclose(data.t, T)
    np.testing.assert_allclose(data.J, J)


@pytest.mark.parametrize(
    "names",
    [
        "Temps [s],D\u00e9formation [%],Contrainte [Pa]", "Tiempo [s],Deformaci\u00f3n [%],Esfuerzo cortante [Pa]",
        "\u6642\u9593 [\u79d2],\u3072\u305a\u307f [%],\u305b\u3093\u65ad\u5fdc\u529b [Pa]",
    ],
    ids=["French", "Spanish", "Japanese"],
)  # fmt: skip
def test_strain_and_stress_under_other_names(tmp_path, names):
    data = read(tmp_path, f"{names}\n" + rows(T, 100.0 * STRESS * J, 0.0 * T + STRESS), start=0.0)
    np.testing.assert_allclose(data.strain, STRESS * J)


@pytest.mark.parametrize("names", ["\u79d2", "[hh:mm:ss]", ""], ids=["seconds", "clock", "none"])
def test_times_as_hours_minutes_and_seconds(tmp_path, names):
    clock = [str(datetime.timedelta(seconds=3 * k)) for k in range(500, 1300, 20)]
    t = np.arange(1500.0, 3900.0, 60.0)
    text = f"Time {names},J [1/Pa]\n" + "".join(
        f"{a},{b:.9g}\n" for a, b in zip(clock, 1e-6 * t, strict=True)
    )
    data = read(tmp_path, text, start=0.0)
    np.testing.assert_allclose(data.t, t)


def test_tenths_of_a_second_with_either_mark(tmp_path):
    for mark, sep in ((".", ","), (",", ";")):
        text = f"Time{sep}J [1/Pa]\n" + "".join(f"0:00:{k:02d}{mark}5{sep}{2 + k}\n" for k in range(9))
        np.testing.assert_allclose(read(tmp_path, text, start=0.0).t, np.arange(9) + 0.5)


@pytest.mark.parametrize(
    ("line", "stress"),
    [
        ("Stress: 100 Pa", 100.0), ("Shear stress,100,Pa", 100.0), ("# stress = 10 kPa", 1e4),
        ("Contrainte : 0,1 kPa", 100.0), ("Applied stress (kPa): 0.1", 100.0),
        ("Shear stress [100 Pa]: 100 Pa", None), ("Normal force: 100 N", None),
    ],
    ids=["colon", "cells", "remark", "French", "unit first", "two", "force"],
)  # fmt: skip
def test_a_stress_in_the_head_of_the_file(tmp_path, line, stress):
    text = f"Sample: gel\n{line}\nDate: 3 May\n\nTime [s],Strain [-]\n" + rows(T, 100.0 * J)
    if stress is None:
        with pytest.raises(ValueError, match="stress="):
            read(tmp_path, text)
        return
    data = read(tmp_path, text, start=0.0)
    np.testing.assert_allclose(data.stress[1], stress)


@pytest.mark.parametrize("code", ["utf-8", "shift_jis", "latin-1"])
def test_the_encodings_of_headers(tmp_path, code):
    """Japanese instruments write Shift JIS; accents of Latin-1 are no Japanese."""
    names = "Fréquence angulaire (rad/s);Module de conservation (Pa);Module de perte (Pa)"
    if code == "shift_jis":
        names = "角周波数 (rad/s);貯蔵弾性率 (Pa);損失弾性率 (Pa)"
    path = tmp_path / "sweep.csv"
    path.write_bytes((names + "\n" + rows(T[1:], J[1:], 2.0 * J[1:]).replace(",", ";")).encode(code))
    np.testing.assert_allclose(fitting.read_oscillation(path).loss, 2.0 * J[1:])


@pytest.mark.parametrize("name", ["Épaisseur", "Espesor", "膜厚", "Schichtdicke"])
def test_a_thickness_under_other_names(tmp_path, name):
    path = tmp_path / "film.csv"
    path.write_text(f"t [s],{name} [nm]\n" + rows(T, 1e9 * J), encoding="utf-8")
    np.testing.assert_allclose(fitting.read_growth(path, stress=3e8, temperature=350.0).thickness, J)


@pytest.fixture
def book():
    openpyxl = pytest.importorskip("openpyxl")
    pytest.importorskip("python_calamine")
    return openpyxl.Workbook()


def test_a_workbook_with_units_below_the_names(tmp_path, book):
    sheet = book.active
    for row in (["Creep test of a gel"], ["Time", "Compliance"], ["s", "1/Pa"], *zip(T, J, strict=True)):
        sheet.append(list(map(lambda cell: cell if isinstance(cell, str) else float(cell), row)))
    book.save(tmp_path / "gel.xlsx")
    data = fitting.read_creep(tmp_path / "gel.xlsx")
    np.testing.assert_allclose(data.J, J, rtol=1e-14)
    np.testing.assert_array_equal(data.t, T)


def test_a_sheet_of_several_is_chosen_by_its_name(tmp_path, book):
    for k, name in enumerate(("first", "second")):
        sheet = book.active if k == 0 else book.create_sheet()
        sheet.title = name
        sheet.append(["Time [hh:mm:ss]", "J [1/Pa]"])
        for t, value in zip(T, J, strict=True):
            sheet.append([datetime.timedelta(seconds=float(t)), (1.0 + k) * float(value)])
    book.save(tmp_path / "two.xlsx")
    data = fitting.read_creep(tmp_path / "two.xlsx", segment="second")
    np.testing.assert_allclose(data.t, T)
    np.testing.assert_allclose(data.J, 2.0 * J, rtol=1e-14)
    with pytest.raises(ValueError, match=r"first.*second"):
        fitting.read_creep(tmp_path / "two.xlsx")


def test_what_is_no_workbook(tmp_path):
    pytest.importorskip("python_calamine")
    (tmp_path / "a.xlsx").write_bytes(b"PK\x03\x04 nothing")
    with pytest.raises(ValueError, match="not a workbook that can be read") as error:
        fitting.read_creep(tmp_path / "a.xlsx")
    assert "\n" not in str(error.value)


def test_without_the_library_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "python_calamine", None)
    (tmp_path / "a.xlsx").write_bytes(b"PK\x03\x04 nothing")
    with pytest.raises(ValueError, match=r"pip install 'jaxcontact\[workbooks\]'"):
        fitting.read_creep(tmp_path / "a.xlsx")


def test_a_sheet_is_chosen_before_the_others_are_read(tmp_path):
    """Columns under equal names, one of which cannot be read: the chosen one is, by name and by position."""
    t, J = np.arange(1.0, 9.0), np.arange(2.0, 10.0)
    good = "t [s],J [1/MPa]\n" + "".join(f"{x},{y}\n" for x, y in zip(t, J, strict=True))
    bad = "t [furlong],J [1/MPa]\n" + "".join(f"{x},{y}\n" for x, y in zip(t, J, strict=True))
    path = tmp_path / "book.csv"
    path.write_text("[step]\nfirst\n" + bad + "[step]\nsecond\n" + good)
    for choice in ("second", 1):
        data = fitting.read_creep(path, segment=choice)
        np.testing.assert_allclose(data.J, 1e-6 * J)
    with pytest.raises(ValueError, match=r"choose with segment= among 0 \(first\), 1 \(second\)"):
        fitting.read_creep(path)
    with pytest.raises(ValueError, match="furlong"):
        fitting.read_creep(path, segment="first")
