"""Mistakes in the shell: what is said names flags, and nothing that is written in Python."""

import re

import numpy as np
import pytest

from jaxcontact.__main__ import main

T = np.linspace(0.0, 40.0, 41)
J = 1e-6 * (1.0 + T)
KEYWORDS = (
    "start|segment|curve|stress|nu|sigma|weights|columns|units|window|decimal|convention|control|spring_constant|fixed|bounds|"
    "film|grid|layer|indenter|bulk_modulus|contact_point|machine_compliance|tau|level|per_decade|model"
)
# a keyword with its value that no flag stands before, a call, a dictionary, a module
PYTHON = re.compile(
    rf"(?<![-\w])(?:{KEYWORDS})=|\w\(\)|\{{'|\bjc\.|\bdata\.|\bNone\b|fit_prony|\bread_|contact_point|bulk_modulus"
    r"|machine_compliance|spring_constant|in_contact|per_decade|IndentationData|---"
)


def file(folder, name, header, *columns):
    np.savetxt(folder / name, np.column_stack(columns), delimiter=",", header=header, comments="")
    return str(folder / name)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    make = lambda name, header, *columns: file(folder, name, header, *columns)
    air = np.maximum(T - 20.0, 0.0) ** 1.5 + 0.01 * np.sin(37.0 * T)
    return {
        "creep": make("creep.csv", "t [s],J [1/Pa]", T, J),
        "plain": make("plain.csv", "0,1e-6", T[1:], J[1:]),
        "late": make("late.csv", "t [s],J [1/Pa]", 300.0 + T, J),
        "strain": make("strain.csv", "t [s],strain [-]", T, J),
        "tensile": make("tensile.csv", "t [s],D(t) [1/Pa]", T, J),
        "begun": make("begun.csv", "t [s],strain [-],stress [Pa]", 300.0 + T, J, np.ones(T.size)),
        "falls": make("falls.csv", "t [s],J [1/Pa]", T, 1e-6 * np.minimum(T + 1.0, 60.0 - 1.4 * T)),
        "before": make("before.csv", "t [s],J [1/Pa]", T - 3.0, J),
        "ends": make("ends.csv", "t [s],J [1/Pa],stress [Pa]", T, J, np.where(T < 20.0, 1.0, 0.0)),
        "negative": make("negative.csv", "t [s],J [1/Pa]", T, np.where(T < 8.0, -J, J)),
        "modulus": make("modulus.csv", "t [s],G(t) [Pa]", T, 1e6 / (1.0 + T)),
        "sweep": make("sweep.csv", "frequency,G' [Pa],G'' [Pa]", 1.0 + T, 1e6 + T, 1e5 + T),
        "press": make("press.csv", "t [s],load [N],depth [m]", T, air, 1e-6 * T),
        "height": make("height.csv", "t [s],load [N],height [m]", T, air, 1e-6 * T),
        "bare": make("bare.csv", "t [s],load,depth", T, air, 1e3 * T),
        "unload": make("unload.csv", "t [s],load [N],depth [m]", T, 1.0 - T / 41.0, 1e-6 * (1.0 + T)),
    }


BALL = ["--radius", "1e-3"]
FILM = [*BALL, "--layer", "1e-6", "--substrate-modulus", "1e9"]
MISTAKES = [
    ("creep", "creep", "--model", "Nutting"), ("creep", "creep", "--weights", "none"), ("creep", "creep", "--level", "2"),
    ("creep", "creep", "--fix", "G9=1"), ("creep", "creep", "--bound", "G1=3:2"), ("creep", "creep", "--fix", "G1=-1"),
    ("creep", "creep", "--window", "30:10"), ("creep", "creep", "--start", "100"), ("creep", "creep", "--convention", "K"),
    ("creep", "creep", "--column", "q=1"), ("creep", "creep", "--unit", "q=s"), ("creep", "creep", "--unit", "J=kg"),
    ("creep", "creep", "--column", "t=0", "--column", "J=0"), ("creep", "creep", "--column", "J=7"),
    ("creep", "creep", "--segment", "9"), ("creep", "creep", "--resample", "-1"), ("creep", "plain",), ("creep", "late"),
    ("creep", "strain"), ("creep", "strain", "--stress", "0"), ("creep", "tensile"), ("creep", "begun"), ("creep", "falls"),
    ("creep", "before"), ("creep", "ends"), ("creep", "begun", "--stress", "3"), ("creep", "press"), ("creep", "modulus"),
    ("creep", "sweep"), ("creep", "creep", "--tension", "0.4", "--nu", "0.2"),
    ("creep", "creep", "--tension", "0.4", "--convention", "1/(2G)"),
    ("creep", "creep", "--model", "Springpot", "--fix", "alpha=2"), ("creep", "creep", "--window", "39:"),
    ("prony", "creep", "--tau", "-1"), ("compare", "creep", "--models", "Maxwell,Nutting"),
    ("compare", "creep", "--fix", "q=1"), ("relaxation", "modulus", "--model", "Springpot"), ("relaxation", "late"),
    ("relaxation", "modulus", "--tension", "0.7"), ("oscillation", "sweep"), ("oscillation", "creep"),
    ("indentation", "press"), ("indentation", "press", *BALL), ("indentation", "press", *FILM),
    ("indentation", "press", *BALL, "--control", "both"), ("indentation", "press", *BALL, "--in-contact", "1"),
    ("indentation", "press", *BALL, "--nu", "0.3", "--bulk-modulus", "1e9"), ("indentation", "press", *BALL, "--nu", "2"),
    ("indentation", "press", *BALL, "--segment", "pause"), ("indentation", "press", *BALL, "--curve", "4"),
    ("indentation", "press", *BALL, "--drift", "maybe"), ("indentation", "press", *FILM, "--adhesion", "1"),
    ("indentation", "press", *BALL, "--adhesion", "-1"), ("indentation", "press", "--radius", "-1"),
    ("indentation", "press", *BALL, "--layer", "-1", "--substrate-modulus", "1e9"), ("indentation", "height", *BALL),
    ("indentation", "bare", *BALL), ("indentation", "unload", *BALL), ("indentation", "creep", *BALL),
    ("indentation", "press", *BALL, "--substrate-modulus", "1e9"), ("batch", "creep", "--contact-point", "fit"),
    ("compare", "creep", "--control", "depth"), ("posterior", "creep", "--adhesion", "0.1"),
    ("batch", "press", "--of", "indentation", *BALL, "--convention", "1/(2G)"), ("batch", "creep", "--ball-nu", "0.2"),
    ("indentation", "press", *BALL, "--ball-modulus", "0"),
    ("indentation", "press", "--cone", "95"), ("indentation", "press", "--punch", *FILM),
]  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES, ids=" ".join)
def test_a_mistake_is_told_in_the_words_of_the_shell(mistake, files, tmp_path, capsys):
    kind, name, *given = mistake
    assert main(["fit", kind, files[name], "-o", str(tmp_path / "out"), *given]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and not PYTHON.search(error.replace(files[name], "FILE")), error


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (("creep", "negative"), "--window begin:end selects others"),
        (("indentation", "unload", *BALL), "--segment approach --segment hold, or use --control depth"),
        (("force", "press", "--radius", "-1"), "--radius, --punch: expected a radius > 0, got -1.0"),
        (
            ("force", "press", "--pyramid", "95"),
            "--pyramid: expected a half-angle between 0 and 90 degrees, got 95",
        ),
        (
            ("creep", "plain"),
            "the places of the columns, --column t=0 --column J=1, and --unit where these are not SI",
        ),
    ],
    ids=lambda given: given[1] if isinstance(given, tuple) else "",
)
def test_a_mistake_is_told_with_its_remedy(mistake, words, files, tmp_path, capsys):
    kind, name, *given = mistake
    assert main(["fit", kind, files[name], "-o", str(tmp_path / "out"), *given]) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("given", ([], ["-o", "out", "--nu", "1um"], ["-o", "out", "--tau", "3"]))
def test_wrong_usage_is_told_in_one_line(given, files, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["fit", "creep", files["creep"], *given])
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "--help explains the options" in error


@pytest.mark.slow
def test_names_are_taken_in_any_case(files, tmp_path, capsys):
    out = str(tmp_path / "out")
    assert (
        main(["fit", "creep", files["creep"], "-o", out, "--model", "maxwell", "--weights", "RELATIVE"]) == 0
    )
    said = capsys.readouterr().out
    assert "Maxwell fit" in said and "weights: relative" in said and not PYTHON.search(said), said
