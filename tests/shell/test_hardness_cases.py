"""Case files with a hardness: what is read, checked, run and stored."""

import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact.shell.case_file import case_text, read_case

CASE = """
[experiment]
hardness = "2 GPa"
[substrate]
material = "elastic"
E = "70 GPa"
nu = 0.3
[indenter]
shape = "sphere"
radius = "5 mm"
[control]
load = [200.0, 400.0, 100.0]
[times]
values = [0.0, 1.0, 2.0]
[grid]
n = 32
width = "1.2 mm"
"""


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    return path


def test_a_case_has_a_hardness_or_a_map_of_it(case, capfd):
    read = read_case(case)
    assert read.motion["hardness"] == 2e9 and "hardness" in case_text(read)
    assert main(["check", str(case)]) == 0 and capfd.readouterr().err == ""
    np.save(case.parent / "hard.npy", np.full((32, 32), 3e9))
    case.write_text(CASE.replace('"2 GPa"', '"hard.npy"'))
    assert np.array_equal(read_case(case).motion["hardness"], np.full((32, 32), 3e9))
    case.write_text(CASE.replace('"2 GPa"', "-1.0"))
    assert main(["check", str(case)]) == 2
    assert "experiment.hardness: found -1.0, accepted: a number > 0" in capfd.readouterr().err


@pytest.mark.slow
def test_a_run_stores_the_dents_that_indent_gives(case, tmp_path, capfd):
    assert main(["run", str(case), "-o", str(tmp_path / "out")]) == 0
    stored, given = jc.read_result(tmp_path / "out" / "result.npz"), read_case(case)
    wanted = given.run()
    np.testing.assert_allclose(stored.dent, wanted.dent, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(stored.peak_dent, wanted.peak_dent, rtol=1e-12)
    jc.write_result(wanted, tmp_path / "stored.nc")
    np.testing.assert_array_equal(jc.read_result(tmp_path / "stored.nc").dent, wanted.dent)
    labelled = wanted.to_xarray()["dent"]
    assert labelled.dims == ("time", "x", "y") and labelled.attrs["units"] == "m"
    assert wanted.plot().axes
