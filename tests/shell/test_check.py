"""What ``check`` says of a case before it is run, and the cases that ``new`` writes."""

import json
import re

import pytest
from mistakes_in_case_files import FILES, written
from test_command_line import BAD, CASE, READY_MADE, TRACED
from tolerances import FORETOLD_STRAIN

from jaxcontact.__main__ import main
from jaxcontact.shell.case_file import read_case
from jaxcontact.shell.case_schema import KINDS, sections_of

pytestmark = pytest.mark.versions


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    return path


SLOW = TRACED | {"adhesive_bead", "growing_tribofilm"}
BEYOND = {"tribofilm_creep", "tribofilm_relaxation"}


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, marks=pytest.mark.slow if p.stem in SLOW else ()) for p in READY_MADE],
    ids=lambda path: path.stem,
)
def test_a_ready_made_case_is_checked_without_running(path, capfd, monkeypatch):
    """Without a warning, but that the paper's films are shortened by several times their thickness."""
    monkeypatch.setattr("jaxcontact.shell.run.plan_of", None)
    assert main(["check", str(path)]) == 0
    out, err = capfd.readouterr()
    assert "can run" in out
    if path.stem in BEYOND:
        assert err.count("\n") == 1 and "linear theory is inaccurate" in err
    else:
        assert err == ""


@pytest.mark.slow
def test_check_foretells_the_films_strain(case, tmp_path, capfd):
    """Its number is that of the run which follows, nearly, and the warning is there for both or for neither."""
    assert main(["check", str(case)]) == 0
    out, err = capfd.readouterr()
    foretold = float(re.search(r"film strain: about (\S+)", out)[1])
    assert main(["run", str(case), "-o", str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    solved = summary["film_strain_largest_m_per_m"]
    assert 1.0 / FORETOLD_STRAIN < foretold / solved < FORETOLD_STRAIN
    assert solved > 0.2 and "inaccurate" in err and any("inaccurate" in note for note in summary["warnings"])


def test_check_says_of_what_it_foretells_no_strain(case, capfd):
    several = CASE.replace("[layer]", "[[layer]]").replace(
        "[substrate]", '[[layer]]\nmaterial = "elastic"\nE = 1e9\nnu = 0.3\nthickness = 1e-6\n[substrate]'
    )
    case.write_text(several)
    assert main(["check", str(case)]) == 0
    out, err = capfd.readouterr()
    assert (
        "film strain: estimated only for a ball pressed on a single film, not for this case" in out
        and err == ""
    )


CHECKED = {
    "coarse grid": ("n = 32", "n = 8", "grid.n"),
    "narrow grid": ("width = 300e-6", "width = 150e-6", "grid.width"),
}


@pytest.mark.parametrize("name", CHECKED)
def test_check_warns_and_is_not_an_error(name, case, capfd):
    old, new, words = CHECKED[name]
    case.write_text(CASE.replace(old, new))
    assert main(["check", str(case)]) == 0
    out, err = capfd.readouterr()
    assert "2 warnings" in out  # the other is of the film's strain
    assert err.count("\n") == 2 and words in err


RELAXES = """
[substrate]
material = "standard-linear-solid"
G1 = 1e9
G2 = 0.111e9
eta2 = 0.111e9
nu = 0.3
[indenter]
shape = "sphere"
radius = 5e-3
[control]
approach = 1e-6
[times]
values = [0.0, 3.0, 10.0, 100.0]
[grid]
n = 24
width = 200e-6
"""


def test_check_foretells_the_error_of_the_time_steps(case, capfd):
    """A relaxation with a time of 0.1 s in steps of 3 s and more loses contact; a film of 150 nm on steel, whose compliance
    is that of the steel, has an error of 0.1 % in three steps of 200 s, and no warning."""
    case.write_text(RELAXES)
    assert main(["check", str(case)]) == 0
    err = capfd.readouterr().err
    assert "an error of the pressure of about 100 %" in err and "shortest relaxation time 0.0999 s" in err
    case.write_text(RELAXES.replace("3.0, 10.0, 100.0", "0.1, 0.3, 1.0"))
    assert main(["check", str(case)]) == 0
    assert "solver.substeps = 8 or more" in capfd.readouterr().err
    case.write_text(CASE.replace("steps = 6", "steps = 3"))
    assert main(["check", str(case)]) == 0
    assert "times:" not in capfd.readouterr().err


def test_check_asks_for_the_unit_of_a_layer_that_is_thick_beyond_sense(case, capfd):
    case.write_text(CASE.replace("thickness = 150e-9", "thickness = 150"))
    assert main(["check", str(case)]) == 0
    assert "layer.thickness: found 150 m, 5e+05 times the grid's width" in capfd.readouterr().err


SOLID = 'material = "standard-linear-solid"\nG1 = 1e9\nG2 = 1e7\neta2 = 1e6\nnu = 0.3\n'  # relaxes to 1 %
SLIDES = f"""[experiment]
kind = "steady-sliding"
velocity = VELOCITY
[substrate]
{SOLID}[layer]
{SOLID}thickness = 1e-3
[indenter]
shape = "sphere"
radius = RADIUS
[control]
load = 1.0
[grid]
n = 128
width = 600e-6
"""


@pytest.mark.parametrize(
    ("velocity", "modulus"), [("1e3", 1e9), ("1e-6", 1.0 / (1e-9 + 1e-7)), ("0.0", 1.0 / (1e-9 + 1e-7))]
)
def test_check_takes_the_modulus_of_the_speed_in_steady_sliding(velocity, modulus, case, capfd):
    """A half-space of a solid: Hertz's contact with the modulus at once if it slides fast, the relaxed one if slowly."""
    case.write_text(SLIDES.replace("VELOCITY", velocity).replace("RADIUS", "5e-3"))
    assert main(["check", str(case)]) == 0
    found = re.search(r"the contact may grow to (\S+) m", capfd.readouterr().err)
    diameter = 2.0 * (0.75 * 5e-3 * (1.0 - 0.3) / (2.0 * modulus)) ** (1.0 / 3.0)
    if diameter < 600e-6:
        assert found is None
    else:
        assert float(found[1]) == pytest.approx(diameter, rel=0.02)


def test_check_warns_of_a_ball_that_is_pressed_in_deep(case, capfd):
    """The contact radius is Hertz's, more than a third of the radius of the smaller ball."""
    for radius, deep in ((50e-6, True), (5e-3, False)):
        case.write_text(SLIDES.replace("VELOCITY", "1e3").replace("RADIUS", f"{radius:g}"))
        assert main(["check", str(case)]) == 0
        contact = (0.75 * radius * (1.0 - 0.3) / 2e9) ** (1.0 / 3.0)
        assert (contact > radius / 3.0) == deep
        found = re.search(r"contact radius may reach (\S+) of the ball's radius", capfd.readouterr().err)
        assert (found is not None) == deep
        if deep:
            assert float(found[1]) == pytest.approx(contact / radius, rel=0.02)


@pytest.mark.parametrize("name", ["missing key", "unknown key", "text for a number", "broken TOML"])
def test_check_refuses_what_run_refuses(name, case, capfd):
    old, new, words = BAD[name]
    case.write_text(CASE.replace(old, new))
    assert main(["check", str(case)]) == 2
    out, err = capfd.readouterr()
    assert words in err and out == ""
    if name == "unknown key":
        assert 'did you mean "thickness"?' in err


@pytest.mark.parametrize("kind", KINDS)
def test_a_new_case_reads_as_it_is_and_names_every_key_of_its_kind(kind, tmp_path, capfd):
    path = tmp_path / "mine.toml"
    assert main(["new", kind, str(path)]) == 0
    assert read_case(path).kind == kind
    text = path.read_text()
    sections = sections_of(kind)
    if "# no [layer]" in text:
        del sections["layer"]
    if "# no [adhesion]" in text:
        del sections["adhesion"]
    for name, keys in sections.items():
        assert f"[{name}]" in text
        assert all(re.search(rf"^(# )?{key} = |^\[{name}\.{key}\]", text, re.M) for key in keys), name
    assert main(["new", str(path)]) == 2
    assert "--force" in capfd.readouterr().err and path.read_text() == text


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=pytest.mark.slow if kind != "indentation" else ()) for kind in KINDS]
)
def test_a_new_case_is_checked_without_warning(kind, tmp_path, capfd):
    path = tmp_path / "mine.toml"
    assert main(["new", kind, str(path)]) == main(["check", str(path)]) == 0
    assert capfd.readouterr().err == ""


def test_new_without_a_kind_is_an_indentation(tmp_path):
    assert main(["new", str(tmp_path / "mine.toml")]) == 0
    assert read_case(tmp_path / "mine.toml").kind == "indentation"


SEVERAL = {  # mistakes that can stand in one file: old, new and the beginning of the line
    "a typo": ("thickness", "thicknes", 'layer.thicknes: unknown key; did you mean "thickness"?'),
    "a negative modulus": ("0.75e9", "-0.75e9", "layer.G1: found -750000000.0, accepted: a number > 0"),
    "an unknown unit": ("120.9e9", '"120.9 GPas"', 'layer.eta2: found "120.9 GPas", accepted: a number'),
    "an unknown material": ('"elastic"', '"elastik"', 'substrate.material: found "elastik", accepted: "elas'),
    "no radius": ("radius = 9.525e-3", "", "indenter.radius: missing; accepted: a number > 0"),
    "another dimension": ("load = 10.0", 'load = "10 mm"', 'control.load: found "10 mm", accepted: a number'),
    "half a step": ("steps = 6", "steps = 6.5", "times.steps: found 6.5, accepted: a whole number"),
    "an unknown table": ("[grid]", "[gird]", '[gird]: unknown key; did you mean "grid"?'),
}


@pytest.mark.parametrize("names", [*([name] for name in SEVERAL), list(SEVERAL)], ids=lambda names: names[-1])
def test_check_names_all_mistakes_of_a_file_with_a_line_for_each(names, case, capfd):
    text = CASE
    for old, new, _ in map(SEVERAL.get, names):
        assert text.count(old) == 1
        text = text.replace(old, new)
    case.write_text(text)
    assert main(["check", str(case)]) == 2
    lines = capfd.readouterr().err.splitlines()
    assert len(lines) == len(names)
    for *_, words in map(SEVERAL.get, names):
        assert sum(line.startswith(f"jaxcontact: error: {case}: {words}") for line in lines) == 1


@pytest.mark.parametrize(
    "names", [["a typo"], ["a typo", "no radius", "an unknown table"]], ids=["one", "three"]
)
def test_run_names_the_first_mistake_and_how_many_there_are(names, case, capfd):
    text = CASE
    for old, new, _ in map(SEVERAL.get, names):
        text = text.replace(old, new)
    case.write_text(text)
    assert main(["run", str(case), "-o", str(case.parent / "out")]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert sum(words in line for *_, words in map(SEVERAL.get, names)) == 1
    more = f"; and {len(names) - 1} more, which jaxcontact check {case} lists"
    assert line.endswith(more) if len(names) > 1 else " more, which" not in line


@pytest.mark.parametrize("name", FILES)
def test_check_begins_with_the_mistake_for_which_a_file_cannot_be_read(name, tmp_path, capfd):
    path, words = written(name, tmp_path)
    with pytest.raises(ValueError, match=words) as refused:
        read_case(path)
    assert main(["check", str(path)]) == 2
    lines = capfd.readouterr().err.splitlines()
    assert lines[0] == f"jaxcontact: error: {' '.join(str(refused.value).split())}"
    assert all(line.startswith(f"jaxcontact: error: {path}: ") for line in lines)
    assert len(set(lines)) == len(lines) <= 3
