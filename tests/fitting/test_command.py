"""The fit commands as a user meets them: results, and every malformed file refused in one line, status 2."""

import argparse
import functools
import json

import numpy as np
import pytest
from test_progress import Terminal
from test_readers import MALFORMED, write

from fitting.cli.flags import Kind, add, arguments, options_of
from fitting.cli.kinds import KINDS
from fitting.views.text import HEADS
from jaxcontact.__main__ import main
from tests.support.tables import curve_of, read_back

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
        assert word in error or HEADS.get(word, word) in error, error
    assert "film.csv" in error or "convention" in options
    assert not out.exists()


@pytest.mark.slow
def test_a_fit_run_twice_writes_the_same_bytes(tmp_path):
    """The tables, JSON and pictures of a fit of noisy data are equal in two runs."""
    noisy = J * (1.0 + 0.01 * np.random.default_rng(3).standard_normal(T.size))
    path = table(tmp_path / "film.csv", "t [s],J [1/Pa]", T, noisy)
    for out in ("one", "other"):
        assert main(["fit", "creep", path, "-o", str(tmp_path / out)]) == 0
    written = {file.name: file.read_bytes() for file in (tmp_path / "one").iterdir()}
    assert len(written) >= 3
    assert written == {file.name: file.read_bytes() for file in (tmp_path / "other").iterdir()}


def test_there_are_forty_malformed_files():
    assert len(MALFORMED) >= 40


@pytest.mark.slow
def test_creep_writes_what_it_says(tmp_path, capsys):
    path, out = table(tmp_path / "film.csv", "t [s],J [1/GPa]", T, 1e9 * J), tmp_path / "out"
    assert main(["fit", "creep", path, "-o", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "Burgers fit of 200 points" in printed and "weights: estimated" in printed
    summary = json.loads((out / "summary.json").read_text())
    for key, value in TRUTH.items():
        assert summary["parameters"][key] == pytest.approx(value, rel=1e-6)
    curve = np.genfromtxt(out / "curve.csv", delimiter=",", skip_header=1)
    np.testing.assert_allclose(curve[:, 2], J, rtol=1e-6)
    names = (out / "curve.csv").read_text().splitlines()[0].split(",")
    assert names == ["t [s]", "J [1/Pa]", "fitted [1/Pa]", "residual [standard deviations]"]
    assert (out / "fit.png").stat().st_size > 10000
    assert "not empty" in refused(["fit", "creep", path, "-o", str(out)], capsys)


def test_residuals_of_a_curve_are_in_standard_deviations(tmp_path):
    """With noise of 1 % in proportion: the fit less the data, over 1 % of the data."""
    noise = 0.01 * np.random.default_rng(3).standard_normal(T.size)
    path, out = table(tmp_path / "film.csv", "t [s],J [1/GPa]", T, 1e9 * J * (1.0 + noise)), tmp_path / "out"
    assert main(["fit", "creep", path, "-o", str(out), "--weights", "relative"]) == 0
    _, measured, fitted, residual = np.genfromtxt(out / "curve.csv", delimiter=",", skip_header=1).T
    expected = (fitted - measured) / measured / 0.01
    slope = residual @ expected / (expected @ expected)
    assert slope == pytest.approx(1.0, abs=0.2)
    np.testing.assert_allclose(residual, slope * expected, atol=0.1)


@pytest.mark.slow
def test_a_known_parameter_is_fixed_from_the_shell(tmp_path):
    path, out = table(tmp_path / "film.csv", "t [s],J [1/GPa]", T, 1e9 * J), tmp_path / "out"
    out.mkdir()
    (out / "old.txt").touch()
    assert main(["fit", "creep", path, "-o", str(out), "--force", "--fix", "G2=13.89e6"]) == 0
    assert json.loads((out / "summary.json").read_text())["fixed"] == ["G2"]


@pytest.mark.slow
def test_indentation_writes_what_it_says(tmp_path, capsys):
    depth = (3 * (1 - NU) * J / (8 * np.sqrt(R))) ** (2 / 3)
    path, out = (
        table(tmp_path / "hold.csv", "t [s],load [N],depth [um]", T, T**0, 1e6 * depth),
        tmp_path / "out",
    )
    assert main(["fit", "indentation", path, "-o", str(out), "--radius", str(R)]) == 0
    printed = capsys.readouterr().out
    assert "load control" in printed and "conditional on nu = 0.3" in printed
    written = read_back(out / "curve.csv", curve_of("depth", "m"))
    np.testing.assert_allclose(written["depth [m]"], depth, rtol=1e-6)
    summary = json.loads((out / "summary.json").read_text())
    for key, value in TRUTH.items():
        assert summary["parameters"][key] == pytest.approx(value, rel=1e-6)
    assert summary["indenter_radius_m"] == R


def test_a_berkovich_tip_from_the_shell(tmp_path, capsys):
    """P = 4 tan(a)/pi depth^2/((1 - nu) J), pi tan(a)^2 = 24.494."""
    depth = np.sqrt((1 - NU) * J * np.pi / (4 * np.sqrt(24.494 / np.pi)))
    path, out = (
        table(tmp_path / "hold.csv", "t [s],load [N],depth [um]", T, T**0, 1e6 * depth),
        tmp_path / "out",
    )
    assert main(["fit", "indentation", path, "-o", str(out), "--cone", "berkovich"]) == 0
    assert "cone of half-angle 70.3 degrees" in capsys.readouterr().out
    found = json.loads((out / "summary.json").read_text())["parameters"]
    for key, value in TRUTH.items():
        assert found[key] == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize(
    ("given", "word"),
    [
        ([], "--radius"),
        (["--radius", "-1"], "radius"),
        (["--radius", "0.01", "--nu", "0.7"], "nu"),
        (
            ["--radius", "0.01", "--nu", "0.3", "--bulk-modulus", "1e6"],
            "exactly one of --nu and --bulk-modulus",
        ),
        (["--radius", "0.01", "--cone", "70"], "--cone"),
        (["--cone", "blunt"], "--cone"),
        (["--cone", "120"], "half-angle"),
        (["--radius", "0.01", "--layer", "1e-6"], "--substrate-modulus"),
        (["--radius", "0.01", "--layer", "-1", "--substrate-modulus", "2e11"], "layer"),
        (["--radius", "0.01", "--ball-modulus", "-5"], "--ball-modulus"),
        (["--radius", "0.01", "--ball-nu", "0.2"], "--ball-modulus"),
        (["--radius", "0.01", "--substrate-nu", "0.2"], "--substrate-modulus"),
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


class Taken(Exception):
    """Ends a command where it would fit."""


@pytest.fixture
def taken(monkeypatch):
    """The data and options that a command line brings to the fit."""

    for name in ("creep", "indentation"):

        @functools.wraps(KINDS[name].fit)
        def stop(data, model, **options):
            raise Taken(data, options)

        monkeypatch.setitem(KINDS, name, KINDS[name]._replace(fit=stop))

    def run(*arguments):
        with pytest.raises(Taken) as caught:
            main(["fit", *map(str, arguments)])
        return caught.value.args

    return run


def lines(path, header, *columns, **options):
    np.savetxt(path, np.column_stack(columns), header=header, comments="", fmt="%.10g", **options)
    return path


def test_flags_of_a_creep_file(tmp_path, taken):
    """A clock that runs before the load, a constant stress in tension, a window, standard deviations."""
    t, out = np.linspace(100.0, 120.0, 21), ["-o", tmp_path / "out"]
    strain = 1e-3 * (1.0 + 0.1 * (t - 100.0))
    path = lines(tmp_path / "a.csv", "time [s],strain [-],sd", t, strain, 1e-5 * t, delimiter=",")
    flags = ["--start", "100", "--stress", "1e3", "--tension", "0.5", "--window", ":115"]
    data, options = taken("creep", path, *out, *flags, "--column", "sigma=sd")
    assert data.t[0] == 0.0 and data.t[-1] == 15.0 and options["nu"] == 0.5
    np.testing.assert_allclose(data.response / data.stress[1][-1], 3.0 * strain[:16] / 1e3, rtol=1e-9)
    np.testing.assert_allclose(data.error, 3.0 * 1e-5 * t[:16], rtol=1e-9)
    assert options["weights"] is None and options.get("sigma") is None


def test_flags_of_segments_and_marks(tmp_path, taken):
    t = np.arange(1, 8)
    block = "".join(f"{x},{x / 2}e-3\n" for x in t)
    path = tmp_path / "b.csv"
    path.write_text(
        "[step]\nfirst\ntime [s],J [1/Pa]\n" + block + "[step]\nsecond\ntime [s],J [1/Pa]\n" + block
    )
    data, _ = taken("creep", path, "-o", tmp_path / "out", "--segment", "second")
    assert data.t.size == 7 and any("second" in note for note in data.notes)
    path.write_text("time [s];J [1/Pa]\n" + "".join(f"{x};{x},500\n" for x in t))
    data, _ = taken("creep", path, "-o", tmp_path / "out", "--decimal", ",")
    assert data.J[0] == 1.5


def test_flags_of_a_force_curve(tmp_path, taken):
    """Contact at 3 um after 2 s in air, 1 um/s; cantilever of 0.5 N/m: depth = height - load/k."""
    t = np.arange(0.0, 12.0, 0.02)
    depth = 1e-6 * np.minimum(t, 8.0) + 1e-6
    load = 2e-7 * np.maximum(depth * 1e6 - 3.0, 0.0) ** 1.5
    path = lines(tmp_path / "c.csv", "t [s],load [N],height [m]", t, load, depth + load / 0.5, delimiter=",")
    flags = ["-o", tmp_path / "out", "--radius", "1e-5", "--spring-constant", "0.5"]
    data, _ = taken("indentation", path, *flags)
    assert data.t.size == 600
    data, _ = taken("indentation", path, *flags, "--in-contact", "--segment", "approach", "--window", ":3")
    assert "before it left out" in " ".join(data.notes) and "leaves them out" not in " ".join(data.notes)
    assert data.load[0] == 0.0 and data.t[-1] == pytest.approx(3.0, abs=0.03)
    np.testing.assert_allclose(data.load[5:], 2e-7 * (1e6 * data.depth[5:]) ** 1.5, rtol=0.1)


def test_air_is_not_fitted_as_contact(tmp_path, capsys):
    """5 s in air and contact at 3 um, which gave a modulus 2.3 times too small; the flag that helps is named."""
    t = np.arange(0.0, 20.0, 0.02)
    rng = np.random.default_rng(3)
    load = 5e-6 * np.clip(t - 5.0, 0.0, 2.0) + 2e-8 * rng.standard_normal(t.size)
    depth = 0.6e-6 * np.minimum(t, 5.0) + 1e-6 * np.clip(t - 5.0, 0.0, 2.0) ** (2 / 3) + 1e-9
    path = lines(tmp_path / "d.csv", "t [s],load [N],depth [m]", t, load, depth, delimiter=",")
    error = refused(
        ["fit", "indentation", str(path), "-o", str(tmp_path / "out"), "--radius", "1e-4"], capsys
    )
    assert "points before it" in error and "--in-contact" in error and "in_contact()" not in error


@pytest.mark.parametrize(
    ("text", "flag"),
    [
        ("time [s],strain [-]\n" + "".join(f"{x},{x}\n" for x in range(1, 8)), "--stress"),
        ("time [s],tensile strain [-],tensile stress [Pa]\n" + "".join(f"{x},{x},3\n" for x in range(1, 8)), "--tension"),
        ("time [s],J [1/Pa]\n" + "".join(f"{x},{x}\n" for x in range(100, 108)), "--start"),
        ("time [s],J [1/Pa],J(t) [1/Pa]\n" + "".join(f"{x},{x},{x}\n" for x in range(1, 8)), "--column"),
        ("1,2\n" + "".join(f"{x},{x}\n" for x in range(2, 9)), "--column t=0"),
        ("time [s],J [1/Pa]\n" + "".join(f"{x},{8 - abs(x - 4)}\n" for x in range(0, 12)), "--window 0:"),
        ("time [s];J [1/Pa]\n0;900\n" + "".join(f"{x};{x},500\n" for x in range(1, 8)), "--decimal"),
    ],
)  # fmt: skip
def test_errors_name_flags(text, flag, tmp_path, capsys):
    path = tmp_path / "film.csv"
    path.write_text(text)
    error = refused(["fit", "creep", str(path), "-o", str(tmp_path / "out")], capsys)
    assert flag in error, error
    assert "=None" not in error and "columns=" not in error and "units=" not in error


def test_a_poissons_ratio_out_of_range_is_named_by_its_flag(tmp_path, capsys):
    path = tmp_path / "film.csv"
    path.write_text("time [s],J [1/Pa]\n" + "".join(f"{x},{x}\n" for x in range(1, 8)))
    error = refused(["fit", "creep", str(path), "-o", str(tmp_path / "out"), "--tension", "0.6"], capsys)
    assert "--tension: expected -1 < Poisson's ratio <= 0.5, got 0.6" in error


def noisy_burgers(path, seed, G1=0.75e9):
    """40 points of the material with 1 % of noise."""
    t = np.geomspace(10.0, 40000.0, 40)
    creep = 1 / G1 - np.expm1(-13.89e6 / 120.9e9 * t) / 13.89e6 + t / 3148.6e9
    noise = 1 + 0.01 * np.random.default_rng(seed).standard_normal(t.size)
    return table(path, "t [s],J [1/GPa]", t, 1e9 * creep * noise)


@pytest.mark.slow
def test_compare_ranks_the_models(tmp_path, capsys):
    path, out = noisy_burgers(tmp_path / "film.csv", 1), tmp_path / "out"
    assert main(["fit", "compare", path, "-o", str(out), "--models", "Maxwell,Burgers"]) == 0
    printed = capsys.readouterr().out
    assert printed.index("Burgers") < printed.index("Maxwell") and "rejected" in printed
    summary = json.loads((out / "summary.json").read_text())
    assert [fit["model"] for fit in summary["models"]] == ["Burgers", "Maxwell"]
    assert summary["model"] == "Burgers" and summary["models"][0]["bic"] < summary["models"][1]["bic"]
    read_back(out / "curve.csv", curve_of("J", "1/Pa"))


@pytest.mark.slow
def test_prony_from_the_shell(tmp_path, capsys):
    path, out = noisy_burgers(tmp_path / "film.csv", 1), tmp_path / "out"
    assert main(["fit", "prony", path, "-o", str(out), "--tau", "1000,8704"]) == 0
    assert json.loads((out / "summary.json").read_text())["tau_s"] == [1000.0, 8704.0]
    read_back(out / "curve.csv", curve_of("J", "1/Pa"))
    capsys.readouterr()
    assert "--tau" in refused(["fit", "prony", path, "-o", str(out / "b"), "--tau", "1000,x"], capsys)
    assert main(["fit", "prony", path, "-o", str(tmp_path / "chosen")]) == 0
    assert "chosen by BIC" in capsys.readouterr().out


def test_a_terminal_says_what_is_fitted_and_nothing_of_it_stays(tmp_path, monkeypatch, capsys):
    file, terminal = table(tmp_path / "film.csv", "t [s],J [1/Pa]", T, J), Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    assert main(["fit", "creep", file, "-o", str(tmp_path / "out")]) == 0
    shown = terminal.getvalue().split("\r")
    assert f"fitting {file} ..." in shown and not shown[-1].strip()
    assert "fitting" not in capsys.readouterr().out


def read_wear(path, *, columns: dict | None = None, speed: float | None = None, decimal: str | None = None):
    """Read a wear test.

    Args:
        path: a file.
        columns: {"t": header, "depth": ...}.
        speed: of sliding [m/s]; None: that of the file.
        decimal: the decimal mark.
    """


def fit_wear(data, *, offset: float | str = 0.0, smooth: bool = False, level: float = 0.95):
    """Fit a wear test.

    Args:
        data: the curve.
        offset: of the depth [m], a number or "fit". It is held otherwise.
        smooth: whether the depth is smoothed.
        level: confidence level.
    """


def test_a_new_kind_of_fit_has_its_flags_and_arguments_from_its_functions():
    kind, parser = Kind(read_wear, fit_wear), argparse.ArgumentParser()
    options = options_of(kind)
    assert list(options) == ["offset", "smooth", "level", "column", "speed", "decimal"]
    assert options["speed"]["help"] == "of sliding [m/s]; by default that of the file"
    assert options["column"]["help"] == "column of a quantity (t, depth)"
    assert options["offset"]["help"].startswith("of the depth [m], a number or fit")
    assert "(0.95)" in options["level"]["help"]
    add(parser, kind, options)
    given = parser.parse_args(["--offset", "1e-6", "--smooth", "--column", "t=0", "--speed", "2"])
    assert arguments(fit_wear, kind, given) == {"offset": 1e-6, "smooth": True, "level": 0.95}
    assert arguments(read_wear, kind, given) == {"columns": {"t": 0}, "speed": 2.0, "decimal": None}
    with pytest.raises(ValueError, match="--offset: expected a number, got 'far'"):
        arguments(fit_wear, kind, parser.parse_args(["--offset", "far"]))
