"""Files that reproduce what real ones did: the right value from the command line, or one line that names the remedy.

The files are in ``shared/data/kinds`` beside a checkout, or in the folder of the environment variable JAXCONTACT_KINDS; the
right values are those of its PROVENANCE.md: closed forms from which the files were computed.
"""

import json
import math
import os
import re
from pathlib import Path

import numpy as np
import pytest

import fitting
from jaxcontact.__main__ import main
from tests.support.tables import curve_of, read_back

pandas = pytest.importorskip("pandas", reason="the extra that reads tables back")

ABOVE = [above / "shared" / "data" / "kinds" for above in Path(__file__).resolve().parents]
GIVEN = os.environ.get("JAXCONTACT_KINDS")
KINDS = next((folder for folder in ([Path(GIVEN)] if GIVEN else ABOVE) if folder.is_dir()), None)
here = pytest.mark.skipif(KINDS is None, reason="needs the folder shared/data/kinds")
SLS = ["--model", "StandardLinearSolid"]
BALL = ["--radius", "3e-3", "--nu", "0.5", "--model", "Elastic"]
DIAMOND = ["--cone", "berkovich", "--tip-modulus", "1141e9"]
COLD = ["--temperature", "277.15,294.15,310.15", "--tension", "0.35", "--reference", "294.15"]

# name: (words of the command, {key of parameters in summary.json: (value, relative tolerance)})
VALUES = {
    "sweep, then time sweep": (
        ["oscillation", "@sweep_then_time_sweep.csv", *SLS],
        {"G1_Pa": (1500.0, 0.01)},
    ),
    "sweep, first of three": (
        ["oscillation", "@sweep_recovery_sweep.csv", *SLS, "--segment", "0"],
        {"G1_Pa": (1500.0, 0.01), "G2_Pa": (3000.0, 0.02), "eta2_Pa_s": (3000.0, 0.02)},
    ),
    "sweep, third of three": (
        ["oscillation", "@sweep_recovery_sweep.csv", *SLS, "--segment", "2"],
        {"G1_Pa": (3000.0, 0.01), "G2_Pa": (6000.0, 0.02), "eta2_Pa_s": (6000.0, 0.02)},
    ),
    "creep at several temperatures": (
        ["master", "@creep_temperatures.csv", "--reference", "373.15"],
        {"c1": (10.0, 0.02), "c2_K": (50.0, 0.02)},
    ),
    "tension at several temperatures": (
        ["master", "@tension_277K.csv", "@tension_294K.csv", "@tension_310K.csv", *COLD],
        {"c1": (12.0, 0.03), "c2_K": (110.0, 0.03)},
    ),
    "dynamic modulus and phase angle": (
        ["master", "@dynamic_277K.csv", "@dynamic_294K.csv", "@dynamic_310K.csv", *COLD],
        {"c1": (12.0, 0.03), "c2_K": (110.0, 0.03)},
    ),
    "stiffness without a film": (
        ["stiffness", "@csm_deep_film.csv", *DIAMOND],
        {"youngs_modulus": (150e9, 0.005)},
    ),
    "a stated contact area": (
        ["stiffness", "@nanodma_like.txt", *DIAMOND],
        {"youngs_modulus": (67.8e9, 0.002)},
    ),
    "a stray cell in the header": (["indentation", "@book_stray_header.xlsx", *BALL], {"G_Pa": (2e4, 1e-4)}),
    "stray cells in rows": (["indentation", "@book_stray_rows.xlsx", *BALL], {"G_Pa": (2e4, 1e-4)}),
    "statistics on a sheet after it": (
        ["indentation", "@book_statistics_after.xlsx", *BALL],
        {"G_Pa": (2e4, 1e-4)},
    ),
    "statistics, by the name of the sheet": (
        ["indentation", "@book_statistics_after.xlsx", *BALL, "--curve", "Test 1"],
        {"G_Pa": (2e4, 1e-4)},
    ),
    "Mach-1": (["indentation", "@mach1_like.txt", *BALL], {"G_Pa": (2e4, 1e-4)}),
}
COLUMNS = {
    "stiffness": curve_of("stiffness", "N/m", "depth [m]"),
    "indentation": curve_of("depth", "m"),
}
# name: (words of the command, the words of its one line)
REMEDIES = {
    "which sweep": (["oscillation", "@sweep_recovery_sweep.csv", *SLS], r"--segment among 0 \(1\), 1 \(2\), 2 \(3\)"),
    "a film far below the contact": (
        ["stiffness", "@csm_deep_film.csv", *DIAMOND, "--thickness", "2e-7", "--substrate-modulus", "165e9"],
        r"at most 20 thicknesses, got one of 22.3: --window :1\.7\d+e-06 keeps .*; without it the sample is a half-space",
    ),
    "columns without known names": (
        ["relaxation", "@digitised.csv", "--model", "FractionalMaxwell"],
        r"'X', 'Y'.*--column t=HEADER",
    ),
    "which pair of columns": (
        ["relaxation", "@digitised.csv", "--column", "t=X", "--column", "modulus=Y"],
        r"--segment among 0 \(20 C\), 1 \(40 C\)",
    ),
}  # fmt: skip


def shell(words, out):
    return main(["fit", *(word.replace("@", f"{KINDS}/") for word in words), "-o", str(out)])


@here
@pytest.mark.slow
@pytest.mark.parametrize("name", VALUES)
def test_the_right_value(name, tmp_path):
    words, right = VALUES[name]
    if any(".xlsx" in word for word in words):
        pytest.importorskip("python_calamine", reason="needs jaxcontact[workbooks]")
    assert shell(words, tmp_path / "out") == 0
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert found["verdict"] == "accepted"
    values = {**found["parameters"], "youngs_modulus": found.get("youngs_modulus_Pa", {}).get("value")}
    for key, (value, tolerance) in right.items():
        assert values[key] == pytest.approx(value, rel=tolerance), key
    table = read_back(tmp_path / "out" / "curve.csv", COLUMNS.get(words[0]))
    assert len(table) > 5
    if words[0] == "master" and "creep" in name:
        own = pandas.read_csv(KINDS / "creep_temperatures.csv")
        np.testing.assert_allclose(table["t [s]"], own["Time [s]"], rtol=1e-5)
        np.testing.assert_allclose(table["temperature [K]"], own["Temperature [°C]"] + 273.15, rtol=1e-9)


@here
@pytest.mark.parametrize("name", REMEDIES)
def test_one_line_with_the_remedy(name, tmp_path, capsys):
    words, remedy = REMEDIES[name]
    assert shell(words, tmp_path / "out") == 2
    said = capsys.readouterr().err
    assert re.search(remedy, said) and said.count("\n") == 1, said


@here
def test_the_second_pair_of_digitised_columns(tmp_path):
    """A springpot, 600 Pa t^-0.2, by the name above the columns and by their places in the file."""
    for options in (
        {"columns": {"t": "X", "modulus": "Y"}, "segment": "40 C"},
        {"columns": {"t": 2, "modulus": 3}},
    ):
        data = fitting.read_relaxation(KINDS / "digitised.csv", start=0.0, **options)
        assert data.t.size == 9
        np.testing.assert_allclose(data.modulus, 600.0 * data.t**-0.2, rtol=2e-4)


@here
def test_a_table_on_its_side_has_the_values_of_the_same_curve():
    aside = fitting.read_oscillation(KINDS / "ampt_transposed.csv", convention="E", nu=0.35)
    plain = fitting.read_oscillation(KINDS / "tension_294K.csv", convention="E", nu=0.35)
    # of the complex modulus in the one file and of storage and loss with 1 % of noise in the other; frequencies rounded
    assert np.abs(aside.omega / plain.omega - 1.0).max() < 5e-3
    assert np.abs(np.abs(aside.shear) / np.abs(plain.shear) - 1.0).max() < 0.05


@pytest.mark.slow
@here
def test_a_tilt_without_times_is_per_sample(tmp_path, capsys):
    assert shell(["force", "@force_without_times.csv", "--radius", "5e-6"], tmp_path / "out") == 0
    said = capsys.readouterr().out
    assert re.search(r"tilt = \S+ N per sample", said) and "N/s" not in said and "no --nu given" in said
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert "tilt_N_per_sample" in found["nuisances"] and "tilt_N_per_s" not in found["nuisances"]


@pytest.mark.slow
@here
def test_the_area_of_the_file_is_compared_with_another(tmp_path, capsys):
    """With the ideal area of the tip the modulus is three times that which the file states."""
    words = ["stiffness", "@nanodma_like.txt", *DIAMOND, "--contact", "oliver-pharr"]
    assert shell(words, tmp_path / "out") == 0
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert found["verdict"] == "rejected"
    assert any("states a reduced modulus of 7e+10 Pa" in reason for reason in found["reasons"])


@pytest.mark.parametrize("beside", ["stress", "strain", "both"])
def test_the_modulus_of_a_creep_test_is_not_read_as_a_relaxation_modulus(tmp_path, beside):
    """Power-law creep D = 1e-9 t^0.2 under 5 MPa: V is 1/(1e-9 Gamma(1.2)); stress over strain taken as G(t) gives a V that
    is 7 % larger, with small residuals."""
    t = np.geomspace(1.0, 1e4, 25)
    D = 1e-9 * t**0.2
    columns = {
        "Time [s]": t,
        "Stress [MPa]": np.full(25, 5.0),
        "Strain [%]": 5e8 * D,
        "Modulus [MPa]": 1e-6 / D,
    }
    for name in {"stress": ["Strain [%]"], "strain": ["Stress [MPa]"], "both": []}[beside]:
        del columns[name]
    rows = "".join(",".join(f"{x:.9g}" for x in row) + "\n" for row in zip(*columns.values(), strict=True))
    path = tmp_path / "creep.csv"
    path.write_text(",".join(columns) + "\n" + rows)
    with pytest.raises(ValueError, match="changes while the stress does not, as in creep: read_creep"):
        fitting.read_relaxation(path)
    if beside == "both":
        fit = fitting.fit_creep(fitting.read_creep(path), "Springpot", weights="relative")
        assert fit.values["V"] == pytest.approx(1.0 / (1e-9 * math.gamma(1.2)), rel=1e-3)


@pytest.mark.parametrize("beside", ["Stress [Pa]", "Strain [%]"])
def test_a_relaxation_with_its_stress_or_its_strain_is_read(tmp_path, beside):
    rng, t = np.random.default_rng(0), np.geomspace(1.0, 100.0, 20)
    G = 1e3 * (1.0 + np.exp(-t / 10.0))
    other = (0.01 * G if beside.startswith("Stress") else np.ones(20)) * (
        1.0 + 0.01 * rng.standard_normal(20)
    )
    path = tmp_path / "gel.csv"
    rows = "".join(f"{a:.9g},{b:.9g},{c:.9g}\n" for a, b, c in zip(t, G, other, strict=True))
    path.write_text(f"t [s],G(t) [Pa],{beside}\n" + rows)
    assert fitting.read_relaxation(path).modulus == pytest.approx(G)
