"""The fit commands beyond the fit of one file: batches, several tests, predictions, posteriors and the design of tests."""

import csv
import json
from html import escape
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from test_command import noisy_burgers, refused, table

from jaxcontact.__main__ import main
from tests.support.tables import read_back


@pytest.mark.slow
def test_nothing_stops_a_batch(tmp_path, capsys):
    """Three curves of two moduli, one file of words: a folder for each fit, a line for each file."""
    (tmp_path / "other").mkdir()
    paths = [noisy_burgers(tmp_path / "a.csv", 1), str(tmp_path / 'wo"rds, of.csv')]
    paths += [noisy_burgers(tmp_path / "other" / "a.csv", 2, G1=0.5e9)]
    Path(paths[1]).write_text("nothing here\n")
    out = tmp_path / "out"
    assert main(["fit", "batch", *paths, "-o", str(out)]) == 3  # one of them could not be fitted
    printed = capsys.readouterr().out
    rows = json.loads((out / "summary.json").read_text())["fits"]
    assert [row["error"] is None for row in rows] == [True, False, True]
    assert "expected rows" in rows[1]["error"] and rows[1]["error"] in printed
    for row, G1 in ((rows[0], 0.75e9), (rows[2], 0.5e9)):
        low, high = row["intervals"]["G1_Pa"]
        assert low < G1 < high and row["verdict"] == "accepted"
    assert (out / "0_a" / "fit.png").exists() and (out / "2_a" / "summary.json").exists()
    with open(out / "table.csv", newline="") as file:
        table = list(csv.reader(file))
    assert [row[0] for row in table] == ["file", *paths] and len({len(row) for row in table}) == 1
    assert table[0][1:4] == ["G1 [Pa]", "G1 low [Pa]", "G1 high [Pa]"]
    assert table[2][-2:] == ["failed", rows[1]["error"]]
    page = (out / "report.html").read_text()
    assert page.count("<svg") == 2 and escape(rows[1]["error"]) in page and 'href="0_a/fit.png"' in page
    assert "accepted: 2; fits rejected: 0; files that could not be read or fitted: 1." in page
    assert "<img" not in page and "<script" not in page
    # well formed
    ElementTree.fromstring(page.partition("<body>")[2].join(["<body>", ""]).partition("</html>")[0])
    assert "no other file" in refused(["fit", "batch", paths[1], paths[1], "-o", str(out / "x")], capsys)


def flowing(path):
    """A Maxwell fluid of 2e5 Pa and 1e6 Pa s, with the error that is stated, and the weighted least squares of it by
    numpy: (1/G, 1/eta) and their covariance."""
    t = np.linspace(0.5, 10.0, 40)
    exact = 1 / 2e5 + t / 1e6
    J = exact + 1e-7 * np.random.default_rng(1).standard_normal(t.size)
    np.savetxt(path, np.column_stack([t, J]), delimiter=",", header="t [s],J [1/Pa]", comments="")
    A = np.column_stack([np.ones(t.size), t]) / 1e-7
    return np.linalg.lstsq(A, J / 1e-7, rcond=None)[0], np.linalg.inv(A.T @ A)


@pytest.mark.slow
def test_what_follows_from_a_fit_from_the_shell(tmp_path, capsys):
    """J(t) at later times with its band as linear least squares has it; the depth of a ball as Hertz and Radok have it."""
    x, covariance = flowing(tmp_path / "gel.csv")
    start = [
        "fit",
        "propagate",
        str(tmp_path / "gel.csv"),
        "--model",
        "Maxwell",
        "--weights",
        "1e-7",
        "--times",
        "0,100",
    ]
    assert main([*start, "-o", str(tmp_path / "J")]) == 0
    value, sd = np.loadtxt(tmp_path / "J" / "propagated.csv", delimiter=",", skiprows=1).T[1:3]
    at = np.column_stack([np.ones(2), [0.0, 100.0]])
    np.testing.assert_allclose(value, at @ x, rtol=1e-6)
    np.testing.assert_allclose(sd, np.sqrt(np.einsum("ni,ij,nj->n", at, covariance, at)), rtol=1e-5)
    ball = ["--of", "depth", "--load", "1e-6", "--radius", "1e-3", "--nu", "0.5"]
    assert main([*start, *ball, "-o", str(tmp_path / "ball")]) == 0
    depth = np.loadtxt(tmp_path / "ball" / "propagated.csv", delimiter=",", skiprows=1)[:, 1]
    np.testing.assert_allclose(depth, (3 * 0.5 * 1e-6 / (8 * np.sqrt(1e-3)) * at @ x) ** (2 / 3), rtol=1e-6)
    assert (
        tmp_path / "ball" / "propagated.png"
    ).exists() and "depth with its 95 % band" in capsys.readouterr().out
    summary = json.loads((tmp_path / "ball" / "summary.json").read_text())
    np.testing.assert_allclose(summary["propagated"]["depth_m"], depth, rtol=1e-12)
    sticky = ["--data", "indentation", *ball, "--adhesion", "0.1"]
    for wrong, word in (
        (["--of", "depth"], "--radius"),
        (["--load", "1"], "--of depth"),
        (sticky, "without adhesion"),
    ):
        assert word in refused([*start, *wrong, "-o", str(tmp_path / "no")], capsys)
    assert "--times" in refused([*start[:-1], "1,-2", "-o", str(tmp_path / "no")], capsys)


@pytest.mark.long
def test_a_depth_on_a_film_from_the_shell(tmp_path):
    """A film fifty times as thick as the radius of the ball is a half-space: Hertz and Radok, within the cells."""
    x, _ = flowing(tmp_path / "gel.csv")
    film = [
        "--layer",
        "0.05",
        "--substrate-modulus",
        "70e9",
        "--radius",
        "1e-3",
        "--load",
        "1e-6",
        "--nu",
        "0.5",
    ]
    words = ["--model", "Maxwell", "--weights", "1e-7", "--of", "depth", "--times", "0,10", *film]
    assert main(["fit", "propagate", str(tmp_path / "gel.csv"), "-o", str(tmp_path / "out"), *words]) == 0
    depth, sd = np.loadtxt(tmp_path / "out" / "propagated.csv", delimiter=",", skiprows=1).T[1:3]
    exact = (3 * 0.5 * 1e-6 / (8 * np.sqrt(1e-3)) * (x[0] + x[1] * np.array([0.0, 10.0]))) ** (2 / 3)
    np.testing.assert_allclose(depth, exact, rtol=5e-3)
    assert np.all(sd > 0.0)


def sweep(path, seed=3):
    """Moduli of the fluid of ``flowing``, with 1 % of noise."""
    omega, rng = np.geomspace(0.05, 20.0, 15), np.random.default_rng(seed)
    G = 2e5 * 5j * omega / (1 + 5j * omega)
    G = G + 0.01 * np.abs(G) * (rng.standard_normal(15) + 1j * rng.standard_normal(15))
    return table(path, "frequency [rad/s],storage modulus [Pa],loss modulus [Pa]", omega, G.real, G.imag)


@pytest.mark.slow
def test_several_tests_and_further_predictions_from_the_shell(tmp_path, capsys):
    """Creep and oscillation of one fluid together, and its moduli and relaxation, as of the exact fluid."""
    flowing(tmp_path / "gel.csv")
    files = [str(tmp_path / "gel.csv"), sweep(tmp_path / "sweep.csv")]
    out, start = tmp_path / "both", ["fit", "together", *files, "--model", "Maxwell"]
    assert main([*start, "--of", "creep,oscillation", "-o", str(out)]) == 0
    summary = json.loads((out / "summary.json").read_text())
    low, high = summary["intervals"]["eta_Pa_s"]
    assert low < 1e6 < high and high < 1.02 * low and summary["kinds"] == ["creep", "oscillation"]
    capsys.readouterr()
    for wrong in ("creep", "creep,indentation"):
        assert "--of" in refused([*start, "--of", wrong, "-o", str(tmp_path / "no")], capsys)
    window = ["--of", "creep,oscillation", "--window", "1:100"]  # of seconds, or of rad/s
    assert "--window: expected none" in refused([*start, *window, "-o", str(tmp_path / "no")], capsys)
    start = ["fit", "propagate", files[1], "--data", "oscillation", "--model", "Maxwell"]
    for of, at, exact in (
        ("relaxation", ("--times", "1,10"), 2e5 * np.exp([-0.2, -2.0])),
        ("loss", ("--frequencies", "1,100"), 2e5 * np.array([5 / 26, 500 / 250001])),
    ):
        assert main([*start, "--of", of, *at, "-o", str(tmp_path / of)]) == 0
        value, sd = np.loadtxt(tmp_path / of / "propagated.csv", delimiter=",", skiprows=1).T[1:3]
        assert np.all(np.abs(value - exact) < 4 * sd) and np.all(sd < 0.03 * exact)
    capsys.readouterr()
    assert "--frequencies" in refused(
        [*start, "--of", "loss", "--times", "1", "-o", str(tmp_path / "no")], capsys
    )
    assert "--stress" in refused(
        [*start, "--times", "1", "--stress", "2", "-o", str(tmp_path / "no")], capsys
    )


@pytest.mark.slow
def test_a_posterior_from_the_shell(tmp_path, capsys):
    """Its interval is about that of the profile, and the table has the draws."""
    pytest.importorskip("numpyro")
    out = tmp_path / "out"
    words = ["--of", "oscillation", "--model", "Maxwell", "--samples", "500"]
    assert main(["fit", "posterior", sweep(tmp_path / "sweep.csv"), "-o", str(out), *words]) == 0
    summary = json.loads((out / "summary.json").read_text())
    draws = read_back(out / "posterior.csv", ["G [Pa]", "eta [Pa s]"]).to_numpy()
    assert draws.shape == (2000, 2) and (out / "posterior.png").exists()
    ends = np.quantile(draws, [0.025, 0.975], axis=0).T
    np.testing.assert_allclose(ends, list(summary["posterior"]["intervals"].values()), rtol=1e-6)
    np.testing.assert_allclose(ends, list(summary["intervals"].values()), rtol=5e-3)
    assert "effective draws" in capsys.readouterr().out


@pytest.mark.slow
def test_a_folder_of_holds_is_a_table(tmp_path, capsys):
    """Steps of the load on two solids, each depth that of Hertz and Radok; of the other files one has numbers."""
    folder, t = tmp_path / "holds", np.linspace(0.0, 10.0, 40)
    folder.mkdir()
    for name, G in (("a", 1e3), ("b", 2e3)):
        creep = (1.5 - 0.5 * np.exp(-t / 2.0)) / G
        depth = (3 * 0.5 * 2e-9 * creep / (8 * np.sqrt(5e-6))) ** (2 / 3)
        depth = depth + 2e-10 * np.random.default_rng(len(name)).standard_normal(t.size)
        table(folder / f"{name}.csv", "t [s],load [N],depth [m]", t, np.full(t.size, 2e-9), depth)
    (folder / "c.csv").write_text("a,b\n1,2\n3,4\n")
    (folder / "notes.txt").write_text("taken on 12 May at 20.5 degrees\n")
    (folder / "fit.png").write_bytes(b"\x89PNG\r\n\x1a\n\0\0")
    (folder / "summary.json").write_text('{"fits": [1, 2, 3]}\n')
    words = ["--of", "indentation", "--radius", "5e-6", "--nu", "0.5", "--model", "StandardLinearSolid"]
    assert main(["fit", "batch", str(folder), "-o", str(tmp_path / "out"), *words]) == 3
    said = capsys.readouterr().out
    assert said.count("accepted, describes the data") == 2
    assert (
        "3 of 6 files without rows of numbers, and images, left out: fit.png, notes.txt, summary.json" in said
    )
    rows = list(csv.DictReader((tmp_path / "out" / "table.csv").read_text().splitlines()))
    assert [row["verdict"] for row in rows] == ["accepted", "accepted", "failed"]
    for row, G in zip(rows, (1e3, 2e3), strict=False):
        assert float(row["G1 low [Pa]"]) < G < float(row["G1 high [Pa]"]) < 1.1 * float(row["G1 low [Pa]"])
    file = str(folder / "a.csv")
    assert "--radius" in refused(["fit", "batch", file, "-o", str(tmp_path / "no"), "--radius", "1"], capsys)


def test_a_creep_test_is_designed_from_the_shell(capsys):
    """A fluid whose spring and dashpot are both wanted to 1 %: the hold takes the time that numpy asks for."""
    values = ["--value", "G=1e6", "--value", "eta=1e8"]
    assert main(["fit", "design", "--model", "Maxwell", *values, "--target", "0.01", "--points", "50"]) == 0
    line = next(
        line for line in capsys.readouterr().out.splitlines() if line.startswith("  hold, even times")
    )
    duration = float(line.partition("times: ")[2].partition(" s")[0])
    t = np.arange(1, 51) * duration / 50
    J = 1e-6 + t / 1e8
    A = np.column_stack([1e-6 + 0 * t, t / 1e8]) / (0.01 * J[:, None])
    sd = np.sqrt(np.diag(np.linalg.inv(A.T @ A)))
    np.testing.assert_allclose(sd.max(), 0.01, rtol=1e-3)
    refusal = refused(["fit", "design", "--model", "Maxwell", "--value", "G=1"], capsys)
    assert "--value" in refusal and "got G=1" in refusal


@pytest.mark.slow
def test_every_table_is_read_back_by_pandas(tmp_path):
    """The measured values of each curve.csv are those of the file, under one name with its unit for each quantity."""
    t, omega = np.geomspace(0.1, 100.0, 30), np.geomspace(0.1, 100.0, 20)
    G = 1e5 * 1j * omega / (1j * omega + 0.5)
    files = {name: str(tmp_path / f"{name}.csv") for name in ("creep", "oscillation", "relaxation", "hold")}
    table(files["creep"], "t [s],J [1/Pa]", t, (1.0 + 0.5 * t) / 1e5)
    table(files["oscillation"], "omega [rad/s],G' [Pa],G'' [Pa]", omega, G.real, G.imag)
    table(files["relaxation"], "t [s],G(t) [Pa]", t, 1e5 * np.exp(-0.5 * t) + 1e4)
    out = lambda name: str(tmp_path / f"out {name}")
    maxwell = ["--model", "Maxwell"]
    main(["fit", "creep", files["creep"], "-o", out("c"), *maxwell])
    main(["fit", "oscillation", files["oscillation"], "-o", out("o"), *maxwell])
    main(["fit", "relaxation", files["relaxation"], "-o", out("r"), "--model", "StandardLinearSolid"])
    main(
        [
            "fit",
            "together",
            files["creep"],
            files["oscillation"],
            "--of",
            "creep,oscillation",
            "-o",
            out("t"),
            *maxwell,
        ]
    )
    main(["fit", "batch", files["creep"], files["hold"], "-o", out("b"), *maxwell])
    main(["fit", "propagate", files["creep"], "-o", out("p"), "--times", "1,10", *maxwell])
    creep = read_back(tmp_path / "out c" / "curve.csv")
    np.testing.assert_allclose(creep["t [s]"], t, rtol=1e-9)
    np.testing.assert_allclose(creep["J [1/Pa]"], (1.0 + 0.5 * t) / 1e5, rtol=1e-9)
    sweep = read_back(tmp_path / "out o" / "curve.csv")
    assert len(sweep) == omega.size
    np.testing.assert_allclose(sweep["omega [rad/s]"], omega, rtol=1e-9)
    np.testing.assert_allclose(sweep["G' [Pa]"] + 1j * sweep["G'' [Pa]"], G, rtol=1e-9)
    np.testing.assert_allclose(sweep["fitted G' [Pa]"], G.real, rtol=1e-4)
    np.testing.assert_allclose(read_back(tmp_path / "out r" / "curve.csv")["t [s]"], t, rtol=1e-9)
    joint = read_back(tmp_path / "out t" / "curve.csv")
    assert joint.groupby("quantity").size().to_dict() == {"J": 30, "G'": 20, "G''": 20}
    second = joint[joint["quantity"] == "G''"]
    np.testing.assert_allclose(second["measured"], G.imag, rtol=1e-9)
    assert set(second["unit"]) == {"Pa"} and set(second["unit of the abscissa"]) == {"rad/s"}
    rows = read_back(tmp_path / "out b" / "table.csv")
    assert list(rows["verdict"]) == ["accepted", "failed"] and {"G [Pa]", "G low [Pa]", "eta [Pa s]"} <= set(
        rows.columns
    )
    assert rows["G [Pa]"][0] == pytest.approx(1e5, rel=1e-6) and np.isnan(rows["G [Pa]"][1])
    predicted = read_back(tmp_path / "out p" / "propagated.csv")
    assert list(predicted.columns) == ["t [s]", "J [1/Pa]", "sd [1/Pa]", "low [1/Pa]", "high [1/Pa]"]
    np.testing.assert_allclose(predicted["J [1/Pa]"], [1.5e-5, 6e-5], rtol=1e-6)
