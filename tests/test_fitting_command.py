"""The fit commands as a user meets them: results, and every malformed file refused in one line, status 2."""

import json

import numpy as np
import pytest
from test_fitting_readers import MALFORMED, write

from jaxcontact.__main__ import main

TRUTH = {"G1_Pa": 0.75e9, "G2_Pa": 13.89e6, "eta1_Pa_s": 3148.6e9, "eta2_Pa_s": 120.9e9}
R, NU = 9.525e-3, 0.3
T = np.linspace(0.0, 40000.0, 200)
J = 1 / 0.75e9 - np.expm1(-13.89e6 / 120.9e9 * T) / 13.89e6 + T / 3148.6e9


def table(path, header, *columns):
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="")
    return str(path)


def flags(options):
    """Command line flags of a reader's options."""
    given = []
    for kind, pairs in options.items():
        if kind == "convention":
            given += ["--convention", pairs]
        else:
            given += [part for key, text in pairs.items() for part in (f"--{kind[:-1]}", f"{key}={text}")]
    return given


def refused(arguments, capsys):
    """The one line on stderr of a command that ends with status 2."""
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert printed.err.count("\n") == 1 and printed.out == ""
    return printed.err


@pytest.mark.parametrize("name", MALFORMED)
def test_malformed_files_are_one_line_and_status_2(name, tmp_path, capsys):
    text, words, options = MALFORMED[name]
    path, out = write(tmp_path, text), tmp_path / "out"
    error = refused(["fit", "creep", str(path), "-o", str(out), *flags(options)], capsys)
    for word in words:
        assert word in error, error
    assert "film.csv" in error or "convention" in options
    assert not out.exists()


def test_there_are_forty_malformed_files():
    assert len(MALFORMED) >= 40


def test_creep_writes_what_it_says(tmp_path, capsys):
    path, out = table(tmp_path / "film.csv", "t [s],J [1/GPa]", T, 1e9 * J), tmp_path / "out"
    assert main(["fit", "creep", path, "-o", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "Burgers fit of 200 points" in printed and "weights: relative" in printed
    summary = json.loads((out / "summary.json").read_text())
    for key, value in TRUTH.items():
        assert summary["parameters"][key] == pytest.approx(value, rel=1e-6)
    curve = np.genfromtxt(out / "curve.csv", delimiter=",", skip_header=1)
    np.testing.assert_allclose(curve[:, 2], J, rtol=1e-6)
    assert (out / "fit.png").stat().st_size > 10000
    assert "not empty" in refused(["fit", "creep", path, "-o", str(out)], capsys)
    assert main(["fit", "creep", path, "-o", str(out), "--force", "--fix", "G2=13.89e6"]) == 0
    assert json.loads((out / "summary.json").read_text())["fixed"] == ["G2"]


def test_indentation_writes_what_it_says(tmp_path, capsys):
    depth = (3 * (1 - NU) * J / (8 * np.sqrt(R))) ** (2 / 3)
    path, out = (
        table(tmp_path / "hold.csv", "t [s],load [N],depth [um]", T, T**0, 1e6 * depth),
        tmp_path / "out",
    )
    assert main(["fit", "indentation", path, "-o", str(out), "--radius", str(R)]) == 0
    printed = capsys.readouterr().out
    assert "load control" in printed and "conditional on nu = 0.3" in printed
    summary = json.loads((out / "summary.json").read_text())
    for key, value in TRUTH.items():
        assert summary["parameters"][key] == pytest.approx(value, rel=1e-6)
    assert summary["indenter_radius_m"] == R


@pytest.mark.parametrize(
    ("given", "word"),
    [
        ([], "--radius"),
        (["--radius", "-1"], "radius"),
        (["--radius", "0.01", "--nu", "0.7"], "nu"),
        (["--radius", "0.01", "--layer", "1e-6"], "--substrate-modulus"),
        (["--radius", "0.01", "--layer", "-1", "--substrate-modulus", "2e11"], "layer"),
        (["--radius", "0.01", "--ball-modulus", "-5"], "--ball-modulus"),
        (["--radius", "0.01", "--drift", "much"], "--drift"),
        (["--radius", "0.01", "--weights", "log"], "--weights"),
        (["--radius", "0.01", "--fix", "G1"], "--fix"),
        (["--radius", "0.01", "--fix", "G9=1"], "G9"),
        (["--radius", "0.01", "--bound", "G1=2"], "--bound"),
        (["--radius", "0.01", "--bound", "G1=2:1"], "G1"),
        (["--radius", "0.01", "--model", "Zener"], "Zener"),
        (["--radius", "0.01", "--control", "force"], "control"),
        (["--radius", "0.01", "--column", "depth=9"], "9"),
    ],
)
def test_bad_options_are_one_line_and_status_2(given, word, tmp_path, capsys):
    path = table(tmp_path / "hold.csv", "t [s],load [N],depth [m]", T, T**0, 1e-6 * (1 + T))
    error = refused(["fit", "indentation", path, "-o", str(tmp_path / "out"), *given], capsys)
    assert word in error
