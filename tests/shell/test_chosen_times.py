"""What a run writes with --save few: maps of a few times, which the file names itself, and lines and numbers of all."""

import json

import numpy as np
import pytest
from test_command_line import CASE

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact.shell.advice import footprint_of
from jaxcontact.shell.case_file import read_case
from jaxcontact.shell.case_schema import at_times, chosen

FILE = "result.npz"


@pytest.fixture
def long_case(tmp_path):
    """Of 41 times on 16 x 16 cells: a ball on steel under a load that rises."""
    path = tmp_path / "case.toml"
    load = f"load = {np.linspace(2.0, 10.0, 41).tolist()}"
    text = CASE[CASE.index("[substrate]") :].replace("steps = 6", "steps = 40").replace("n = 32", "n = 16")
    path.write_text(text.replace("load = 10.0", load))
    return path


@pytest.mark.slow
def test_a_run_keeps_nine_maps_and_the_course_of_all_times(long_case, tmp_path, capfd):
    """Bit for bit those of the run that keeps all, which ``test_command_line`` holds against ``indent``."""
    out, whole = tmp_path / "few", tmp_path / "all"
    assert main(["run", str(long_case), "-o", str(whole)]) == 0
    assert main(["run", str(long_case), "-o", str(out), "--save", "few"]) == 0
    assert "maps of 9 of 41 times" in capfd.readouterr().out
    few, every, course = (np.load(path) for path in (out / FILE, whole / FILE, out / "course.npz"))
    assert every["pressure"].shape == (41, 16, 16) and not (whole / "course.npz").exists()
    np.testing.assert_allclose(few["times"], np.linspace(0.0, 600.0, 9), rtol=1e-14)
    for name in ("pressure", "displacement", "approach", "iterations", "pressure_line"):
        np.testing.assert_array_equal(few[name], every[name][::5], err_msg=name)
    for name in course.files:
        np.testing.assert_array_equal(course[name], every[name], err_msg=name)
    assert set(every.files) - set(course.files) == {
        "y",
        "notes",
        "separation_error",
        "image_error",
        "single_contact",
        "widenings",
        "refined",
        "unjudged",
        "profile",
        "pressure",
        "displacement",
        "case",
        "kind",
        "stiff_film",
        "thickness_error",
        "thickness_slope",
        "narrow_growth",
        "relative_step_error",
        "ball_radius",
        "roller_length",
        "elongation",
        "walled",
        "bare_from",
        "bare_share",
        "coldest",
        "size_error",
        "steep_share",
        "step_limit",
    }
    summary = json.loads((out / "summary.json").read_text())
    assert set(summary["arrays_in_course_npz"]) == set(course.files)
    assert summary["approach_end_m"] == course["approach"][-1]
    assert jc.read_result(out / FILE).pressure.shape == (9, 16, 16)
    assert main(["convert", str(out / FILE), "-o", str(tmp_path / "few.pvd")]) == 0
    said = capfd.readouterr()
    assert said.out.strip() == str(tmp_path / "few.pvd") and "result.npz: 9 of 41 times" in said.err
    assert len(list((tmp_path / "few_vtr").glob("*.vtr"))) == 9
    assert main(["convert", str(whole / FILE), "-o", str(tmp_path / "all.pvd")]) == 0
    assert capfd.readouterr().err == ""


@pytest.mark.slow
def test_another_choice_leaves_no_course_of_the_run_before(long_case, tmp_path):
    out = tmp_path / "out"
    assert main(["run", str(long_case), "-o", str(out), "--save", "few"]) == 0
    assert main(["run", str(long_case), "-o", str(out), "--save", "last", "--force"]) == 0
    result = jc.read_result(out / FILE)
    assert result.pressure.shape == (16, 16) and result.approach.shape == (41,)
    assert not (out / "course.npz").exists() and 'save = "last"' in str(np.load(out / FILE)["case"])


@pytest.mark.slow
def test_a_run_that_does_not_say_keeps_all_maps_up_to_32_megabytes(long_case):
    """Pressure and displacement at 41 times, and the profile, of 8 bytes a cell: 219 x 219 cells are 31.8 MB."""
    small = long_case.read_text()
    of = lambda text: (long_case.write_text(text), read_case(long_case))[1]
    assert of(small).kept == of(small.replace("n = 16", "n = 219")).kept == "all"
    large = small.replace("n = 16", "n = 222")
    assert of(large).kept == "few" and "save" not in of(large).options
    assert footprint_of(of(large)).disk < 0.4 * footprint_of(of(small.replace("n = 16", "n = 219"))).disk
    for said in ("all", "few", "last"):
        for text in (small, large):
            assert of(f'{text}[solver]\nsave = "{said}"\n').kept == said


def test_what_is_chosen_has_the_ends_and_equal_steps():
    assert chosen("few", 1).tolist() == [0] and chosen("few", 5).tolist() == [0, 1, 2, 3, 4]
    assert chosen("few", 17).tolist() == list(range(0, 17, 2))
    assert chosen("all", 40).tolist() == list(range(40)) and chosen("last", 40).size == 0
    for count in range(10, 60):
        picked = chosen("few", count)
        assert picked.size == 9 and picked[0] == 0 and picked[-1] == count - 1
        assert np.ptp(np.diff(picked)) <= 1


def test_slip_between_two_chosen_times_is_that_of_all_steps_between():
    """So that the sum of it stays the whole way slipped."""
    slip = np.arange(20.0).reshape(5, 2, 2, 1) ** 2
    picked = at_times({"slip": slip, "times": np.arange(5.0)}, np.array([0, 3, 4]))
    np.testing.assert_allclose(picked["slip"], [slip[0], slip[1] + slip[2] + slip[3], slip[4]])
    assert picked["times"].tolist() == [0.0, 3.0, 4.0]
