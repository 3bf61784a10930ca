"""Files as instruments and people write them: each is read right, or refused with one line that says what to do.

Every file is made here from one truth, a Burgers creep curve, or a curve of a ball pressed into something; what
is read is compared with that truth.
"""

import gzip
import re
from pathlib import Path

import numpy as np
import pytest
from layouts import (
    GERMAN,
    TRIOS,
    agilent,
    anton_paar,
    each,
    hysitron,
    jpk,
    optics11,
    rows,
    save,
    table,
    trios,
)

import fitting

T = np.geomspace(0.5, 40.0, 24)
J = 1 / 2e5 - np.expm1(-T / 4.0) / 1e5 + T / 5e6
SIGMA = 1000.0
S = 0 * T + SIGMA
STRAIN = J * SIGMA
RECOVERED = J[-1] - 0.5 * J
CREEP = ("Creep - 1", [1286 + T, T, S, 100 * STRAIN, J])
RECOVERY = ("Creep recovery - 2", [1326 + T, T, 0 * T, 100 * RECOVERED * SIGMA, RECOVERED])
INTERVAL = [T, T, S, 100 * STRAIN, J]
REST = [40 + T, T, 0 * T, 100 * RECOVERED * SIGMA, RECOVERED]
BODY = rows(T, J)
PLAIN = "t [s],J [1/Pa]\n" + BODY
HALVES = rows(T[:9], J[:9]), rows(T[9:], J[9:])

# name: (file, options of read_creep); each holds T, J
COMPLIANCE = {
    "savetxt": (table("# t [h],J [1/MPa]", T / 3600, 1e6 * J), {}),
    "savetxt, other order": (table("# J [1/Pa],t [s]", J, T), {}),
    "savetxt, blanks": (table("# t[h] J[1/MPa]", T / 3600, 1e6 * J, sep=" "), {}),
    "savetxt, commas over blanks": (table("# t [s], J [1/kPa]", T, 1e3 * J, sep=" "), {}),
    "header among remarks": (table("# film 3\n# stress: 10 Pa\n#\n# J [1/kPa]\tt [min]", 1e3 * J, T / 60, sep="\t"), {}),
    "MATLAB remark": (table("% J [1/Pa], t [s]", J, T), {}),
    "slashes": (table("// J [1/Pa], t [s]", J, T), {}),
    "remark among the numbers": ("t [s],J [1/Pa]\n" + "# 7.0, 9e-5\n".join(HALVES), {}),
    "units below": (table("Time\tCompliance\nmin\t1/kPa", T / 60, 1e3 * J, sep="\t"), {}),
    "units below, brackets": (table("Time;Compliance\n[min];[1/kPa]\n", T / 60, 1e3 * J, sep=";"), {}),
    "units below, parentheses": (table("J,t\n(1/kPa),(min)", 1e3 * J, T / 60), {}),
    "TRIOS": (trios(CREEP), {}),
    "TRIOS csv": (trios(CREEP, sep=","), {}),
    "TRIOS, step by name": (trios(CREEP, RECOVERY), {"segment": "Creep - 1"}),
    "TRIOS, step by position": (trios(RECOVERY, CREEP), {"segment": 1}),
    "RheoCompass": (anton_paar(INTERVAL).encode("utf-16"), {}),
    "RheoCompass, decimal commas": (anton_paar(INTERVAL, comma=True).encode("utf-16"), {}),
    "RheoCompass, German": (anton_paar(INTERVAL, comma=True, names=GERMAN), {}),
    "RheoCompass, interval by name": (anton_paar(INTERVAL, REST), {"segment": "Interval 1"}),
    "RheoCompass, interval by position": (anton_paar(INTERVAL, REST), {"segment": 0}),
    "German": (table("Zeit [s];Nachgiebigkeit [1/Pa]", T, J, sep=";", comma=True), {}),
    "German, tabs": (table("Zeit t [s]\tNachgiebigkeit J [1/Pa]", T, J, sep="\t", comma=True), {}),
    "German, blanks": (table("Zeit/s  Nachgiebigkeit/(1/Pa)", T, J, sep="   ", comma=True), {}),
    "German thousands": (
        "t [ms];J [1/Pa]\n" + each(1e3 * T, J, "{t:,.4f};{J:.9g}").translate(str.maketrans(",.", ".,")), {}),
    "Swiss thousands": ("t [ms];J [1/Pa]\n" + each(1e3 * T, J, "{t:,.4f};{J:.9g}").replace(",", "'"), {}),
    "thin blanks": ("t [ms];J [1/Pa]\n" + each(1e3 * T, J, "{t:,.4f};{J:.9g}").replace(",", "\u202f"), {}),
    "thousands in quotes": ("t [ms],J [1/Pa]\n" + each(1e3 * T, J, '"{t:,.4f}",{J:.9g}'), {}),
    "decimal commas in quotes": (
        "t [s],J [1/Pa]\n" + each(T, J, '"{t:.9g}";"{J:.9g}"').translate(str.maketrans(".;", ",,")), {}),
    "both marks possible, told": (
        table("t [ms];J [1/GPa]", 1e3 * T, 1e9 * J, sep=";", form="{:.3f}", comma=True), {"decimal": ","}),
    "three decimals everywhere": (table("t [ms];J [1/GPa]", 1e3 * T, 1e9 * J, sep=";", form="{:.3f}"), {}),
    "quotes": (table('"Time, s","Compliance, 1/Pa"', T, J), {}),
    "names of two words, blanks": (table("Step time (s) Creep compliance (1/Pa)", T, J, sep=" "), {}),
    "wide blanks over tabs": (table("Step time [s]     J(t) [1/Pa]", T, J, sep="\t"), {}),
    "mixed blanks and tabs": (table("t [s]\tJ [1/Pa]", T, J, sep="\t").replace("\t", "   ", 3), {}),
    "DIN": (table("t/s;J/(1/GPa)", T, 1e9 * J, sep=";"), {}),
    "underscores": (table("step_time_min,creep_compliance_1_per_MPa", T / 60, 1e6 * J), {}),
    "in": (table("time in h;compliance in mm²/N", T / 3600, 1e6 * J, sep=";"), {}),
    "days and cm2/dyn": (table("Time [days],J [cm^2/dyn]", T / 86400, 1e-1 * J), {}),
    "temperature beside": (table("t\tT\tJ\ns\tC\t1/Pa", T, 0 * T + 25, J, sep="\t"), {}),
    "numbered rows": (table("No.;t [s];J [1/Pa]", np.arange(24), T, J, sep=";"), {}),
    "date above, a column empty": (
        "Mon Apr 29 10:41:06 2019\nrun 3 of 17\nt [s]\tnote\tJ [1/Pa]\n" + each(T, J, "{t:.9g}\t\t{J:.9g}"), {}),
    "words beside": (PLAIN.replace("\n", ",remark\n"), {}),
    "separators at the end": (PLAIN.replace("\n", ",\n"), {}),
    "statistics at the end": (PLAIN + "\nMean,1.2e-5\nS.D.,3e-6\n", {}),
    "words at the end": (PLAIN + "End of data\n", {}),
    "missing at places": ("t [s],J [1/Pa]\n" + "2.5,---\n".join(HALVES), {}),
    "downwards": (table("t [s],J [1/Pa]", T[::-1], J[::-1]), {}),
    "second half first": ("t [s],J [1/Pa]\n" + HALVES[1] + HALVES[0], {}),
    "Excel's first line": ("sep=;\n" + table("t [s];J [1/Pa]", T, J, sep=";"), {}),
    "UTF-16 without mark": (PLAIN.encode("utf-16-le"), {}),
    "Latin-1": (table("Öl, 20 °C\nZeit (s);Nachgiebigkeit (1/Pa)", T, J, sep=";").encode("latin-1"), {}),
    "old Mac": (PLAIN.replace("\n", "\r"), {}),
    "Fortran": (table("t [s]  J [1/Pa]", T, J, sep="  ", form="{:.8E}").replace("E", "D"), {}),
    "typographic minus": (PLAIN.replace("-", "−"), {}),
    "no header, told": (BODY, {"columns": {"t": 0, "J": 1}}),
    "foreign names, told": (
        table("clock;y", T / 60, 1e9 * J, sep=";"),
        {"columns": {"t": "clock", "J": "y"}, "units": {"t": "min", "J": "1/GPa"}}),
    "foreign name with a unit": (table("t [s],y [1/GPa]", T, 1e9 * J), {"columns": {"J": "y [1/GPa]"}}),
    "foreign name over units": (table("x;J\nh;1/MPa", T / 3600, 1e6 * J, sep=";"), {"columns": {"t": "x"}}),
    "before the trigger": ("t [s],J [1/Pa]\n-1,2e-9\n-0.5,3e-9\n" + BODY, {"window": (0, None)}),
    "running clock": (table("t [s],J [1/Pa]", 1286 + T, J), {"start": 1286}),
    "tensile": (table("t [s],D(t) [1/MPa]", T, 1e6 * J / 2.6), {"nu": 0.3}),
    "tensile by a neutral name": (table("t [s],compliance [1/Pa]", T, J / 3), {"nu": 0.5, "convention": "D"}),
}  # fmt: skip

NAMES = "t [s],strain [-],stress [Pa]"
# the same truth as strain under a step of stress
STRAINED = {
    "percent": (table("t [s],strain [%],stress [kPa]", T, 100 * STRAIN, 1e-3 * S), {}),
    "microstrain": (table("t [s],γ [µm/m],τ [Pa]", T, 1e6 * STRAIN, S), {}),
    "German": (
        table("Zeit;Deformation;Schubspannung\ns;%;kPa", T, 100 * STRAIN, 1e-3 * S, sep=";", comma=True), {}),
    "RepTate": (
        table("chem=PE;T=150;stress=1000;\nt\tstrain\tstress\tT\ns\t-\tPa\tC", T, STRAIN, S, 0 * T + 150, sep="\t"), {}),
    "RepTate, stress above": (table("stress=1000;\nt\tgamma", T, STRAIN, sep="\t").replace("\t", "   ", 4), {}),
    "strain alone, stress told": (table("t [s],strain [-]", T, STRAIN), {"stress": SIGMA}),
    "running clock, start told": (table(NAMES, 1286 + T, STRAIN, S), {"start": 1286.0}),
    "stress later, start told": (NAMES + "\n0,0,0\n1,0,0\n2,0,0\n" + rows(2 + T, STRAIN, S), {"start": 2.0}),
    "tension": (table("t [s],axial strain [-],stress [Pa]", T, STRAIN / 2.6, S), {"nu": 0.3}),
    "TRIOS": (trios((CREEP[0], CREEP[1][:4]), names=TRIOS[0][:4], units=TRIOS[1][:4]), {}),
}  # fmt: skip

# name: (file, words of the one line, options)
REFUSED = {
    "no header": (BODY, ["no header", "columns=", "units="], {}),
    "creep and recovery": (trios(CREEP, RECOVERY), ["segment=", "Creep - 1", "Creep recovery - 2"], {}),
    "two intervals": (anton_paar(INTERVAL, REST), ["segment=", "Interval 1", "Interval 2"], {}),
    "two curves under one header": (PLAIN + BODY, ["segment=", "line 26"], {}),
    "gnuplot blocks": (table("# t [s] J [1/Pa]", T, J, sep=" ") + "\n\n" + rows(T, 2 * J, sep=" "), ["segment="], {}),
    "two headers": (PLAIN * 2, ["segment="], {}),
    "no such segment": (anton_paar(INTERVAL, REST), ["segment", "Interval 3"], {"segment": "Interval 3"}),
    "recovery of RepTate": (
        table("rec=1;stress=10;\nt\tstrain\tstress\tT\ns\t-\tPa\tC", T, J, sep="\t"), ["4 columns", "got 2"], {}),
    "recovery after creep": (
        table("t [s],J [1/Pa]", np.append(T, 40 + T), np.append(J, J[-1] - 0.8 * J)),
        ["falls after 40 s", "window=(0, 40)"], {}),
    "two stresses in words": (
        table("# stress = 10 kPa\n# stress: 20 kPa\n# t [s],strain [-]", T, STRAIN), ["stress="], {}),
    "a stress in words without a unit": (table("# stress = 10\n# t [s],strain [-]", T, STRAIN), ["stress="], {}),
    "strain without stress": (table("t [s],strain [-]", T, STRAIN), ["stress="], {}),
    "stress before the file": (table(NAMES, 1286 + T, STRAIN, S), ["start="], {}),
    "no stress": (table(NAMES, T, STRAIN, 0 * T), ["stress"], {}),
    "strain against the stress": (table(NAMES, T, -STRAIN, S), ["strain", "sign"], {}),
    "clock from before the load": (table("t [s],J [1/Pa]", 1286 + T, J), ["start="], {}),
    "start after the end": (PLAIN, ["start", "100"], {"start": 100.0}),
    "tensile compliance": (table("t [s],D(t) [1/Pa]", T, J), ["D(t)", "nu="], {}),
    "tensile strain": (table("t [s],ε [-],σ [Pa]", T, STRAIN, S), ["ε", "nu="], {}),
    "tensile strain, German": (
        table("Zeit;Dehnung;Zugspannung\ns;%;MPa", T, STRAIN, S, sep=";"), ["Dehnung", "nu="], {}),
    "tensile by position": (table("t [s],D(t) [1/Pa]", T, J), ["nu="], {"columns": {"J": 1}}),
    "nu for shear": (PLAIN, ["nu", "convention='D'"], {"nu": 0.3}),
    "tension without nu": (
        table("t [s],y [1/Pa]", T, J), ["nu"], {"columns": {"J": "y [1/Pa]"}, "convention": "D"}),
    "relaxation": (table("t [s],G(t) [Pa]", T, 1 / J), ["relaxation modulus"], {}),
    "tensile relaxation": (table("t [s],E(t) [MPa]", T, 1 / J), ["relaxation modulus"], {}),
    "oscillation": (table("Frequency [Hz],G' [Pa],G'' [Pa]", T, 1 / J, 0.1 / J), ["storage modulus: read_oscillation"], {}),
    "commas for two things": (
        table("t [s],J [1/MPa]", T, 1e6 * J, form="{:.3f}", comma=True), ["expected 2 columns, got 4"], {}),
    "both marks possible": (
        re.sub(r"(;\d+)\.", r"\1,", table("t [s];J [1/MPa]", 1 + T, 1e6 * J, sep=";", form="{:.3f}")), ["decimal="], {}),
    "thousands or decimals": (
        "t [s];J [1/MPa]\n" + each(1500 * T, 1e6 * J, "{t:,.0f};{J:.0f}"), ["decimal="], {}),
    "thousands in quotes or decimals": (
        "t [s],J [1/TPa]\n" + each(3000 * T, 1e9 * J, '"{t:,.0f}","{J:,.0f}"'), ["decimal="], {}),
    "clock times in hours": ("t [h],J [1/Pa]\n" + each(T, J, "00:00:{t:05.2f},{J:.6g}"), ["number of h", "hh:mm:ss"], {}),
    "words among the numbers": ("t [s],J [1/Pa]\n" + "page 2\n".join(HALVES), ["line 11", "t [s]"], {}),
    "cut off": (PLAIN + "41.5", ["line 26", "expected 2 columns"], {}),
    "workbook": (b"PK\x03\x04\x14\x00\x06\x00xl/workbook.xml", ["workbook", "CSV"], {}),
    "old workbook": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1\0\0", ["workbook", "CSV"], {}),
    "packed": (gzip.compress(PLAIN.encode()), ["archive"], {}),
    "picture": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", ["binary"], {}),
    "modulus in the unit": (table("t [s],compliance [GPa]", T, J), ["'GPa'", "1/Pa"], {}),
    "unknown unit below": (table("t,J\nfortnight,1/Pa", T, J), ["fortnight"], {}),
    "unknown units below": (table("t;J\nmoons;bananas", T, J, sep=";"), ["moons"], {}),
    "MPa or mPa": (table("t [s],strain [-],stress [MPA]", T, STRAIN, S), ["MPA"], {}),
    "window without points": (PLAIN, ["at least 5"], {"window": (100.0, None)}),
    "window the wrong way": (PLAIN, ["window"], {"window": (9.0, 1.0)}),
    "unknown decimal mark": (PLAIN, ["decimal"], {"decimal": ";"}),
}  # fmt: skip

# A ball: 1 s in air, pressed for 2 s, held for 3 s, drawn back for 1 s
CLOCK = np.linspace(0.0, 7.0, 141)
DEPTH = np.interp(CLOCK, [0, 1, 3, 6, 7], [-1e-6, 0.0, 2e-6, 2.4e-6, -1e-6])
LOAD = 1e-6 * np.interp(CLOCK, [0, 1, 3, 6, 6.8, 7], [0.0, 0.0, 4.0, 4.0, 0.0, 0.0])
MARKS = np.digitize(CLOCK, [3.0, 6.0])
SEGMENTS = np.array(["approach", "hold", "retract"])[MARKS]
K = 0.5  # cantilever [N/m]
HEIGHT = 5e-5 - DEPTH - LOAD / K
CONSTANT = f"# springConstant: {K}\n"
TRIPLE = "Time (s),Load (N),Depth (m)"

# name: (file, options of read_indentation); each holds CLOCK, LOAD, DEPTH
PRESSED = {
    "remark as header": (table("# Depth,Load,Time", DEPTH, LOAD, CLOCK), {}),
    "Hysitron": (hysitron(CLOCK, LOAD, DEPTH), {}),
    "Optics11": (optics11(CLOCK, LOAD, DEPTH, K), {}),
    "Agilent": (agilent(CLOCK, LOAD, DEPTH, MARKS), {}),
    "JPK with the separation of tip and sample": (jpk(CLOCK, LOAD, HEIGHT, MARKS, "", -DEPTH), {}),
    "CSM": (
        table("CSM\nSample:\tfilm\n\nTime\tPd\tFn\n[s]\t[nm]\t[mN]", CLOCK, 1e9 * DEPTH, 1e3 * LOAD, sep="\t"), {}),
    "German": (
        table("Zeit in s;Kraft in mN;Eindringtiefe in µm", CLOCK, 1e3 * LOAD, 1e6 * DEPTH, sep=";", comma=True), {}),
    "DIN": (table("t/s;F/gf;h/Å", CLOCK, LOAD / 9.80665e-3, 1e10 * DEPTH, sep=";"), {}),
    "kgf and mm": (
        table("Time [min],Force [kgf],Displacement [mm]", CLOCK / 60, LOAD / 9.80665, 1e3 * DEPTH), {}),
    "segments numbered": (table("time_s,force_N,depth_m,segment", CLOCK, LOAD, DEPTH, MARKS), {}),
    "no units, told": (
        table("Time,Load,Depth", CLOCK, 1e6 * LOAD, 1e9 * DEPTH), {"units": {"load": "uN", "depth": "nm"}}),
    "second of two curves": (table(TRIPLE, CLOCK, 2 * LOAD, DEPTH) + rows(CLOCK, LOAD, DEPTH), {"curve": 1}),
}  # fmt: skip
NOT_PRESSED = {
    "height and force": (table("# height [m],force [N]", HEIGHT, LOAD), ["'t'", "columns="], {}),
    "height without a header": (rows(HEIGHT[::-1], LOAD, LOAD), ["no header", "columns="], {}),
    "height without a cantilever": (
        table("# height (measured) [m]\tforce [N]\ttime [s]", HEIGHT, LOAD, CLOCK, sep="\t"), ["spring_constant="], {}),
    "JPK without a cantilever": (jpk(CLOCK, LOAD, HEIGHT, MARKS, ""), ["spring_constant="], {}),
    "AFM workshop": (
        table("Force-Distance Curve\nDate:\tFriday\n\nExtend Z-Sense(nm),Extend Force(nN),Retract Force(nN)",
              HEIGHT, LOAD, LOAD), ["'t'", "columns="], {}),
    "NT-MDT": (rows(-8e3 + CLOCK, LOAD, LOAD, sep="\t", comma=True), ["no header"], {}),
    "no load": (table("Time (s),Depth (nm)", CLOCK, DEPTH), ["'load'", "columns="], {}),
    "no depth": (table("Time (s),Load (nN)", CLOCK, LOAD), ["'depth'"], {}),
    "nm without a unit": (table("Time,Load,Depth", CLOCK, LOAD, 1e9 * DEPTH), ["Depth", "units="], {}),
    "two curves": (table(TRIPLE, CLOCK, LOAD, DEPTH) * 2, ["curve="], {}),
    "two loads": (
        table("Time (s),Load (N),Force (N),Depth (m)", CLOCK, LOAD, LOAD, DEPTH), ["Load (N)", "Force (N)"], {}),
    "depth in volts": (table("Time (s),Load (N),Depth (V)", CLOCK, LOAD, DEPTH), ["'V'"], {}),
    "no such segment": (table(TRIPLE, CLOCK, LOAD, DEPTH), ["segment", "pause"], {"segment": "pause"}),
}  # fmt: skip


DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
# name: what the times are multiplied by, and the accuracy that the digits allow
EDGE = {
    "comment_col": (1.0, 1e-4), "footer2": (1.0, 1e-5), "german": (1.0, 1e-5), "kpa_h": (1.0, 1e-5),
    "savetxt": (1.0, 1e-12), "savetxt_swapped": (1.0, 1e-12), "synJ": (1.0, 0.01), "synSS": (1.0, 0.01),
    "thousands_de": (1e3, 1e-4), "t0_noise": (1.0, 1e-5),
}  # fmt: skip


@pytest.mark.parametrize("name", EDGE)
def test_edge_sets_are_read_right(name):
    """One truth: G1 2e5, G2 1e5 Pa, eta1 5e6, eta2 4e5 Pa s; two sets have 0.2 % of noise."""
    path = DATA / "edge" / f"{name}.csv"
    if not path.exists():
        pytest.skip("the edge sets are not beside the project")
    scale, accuracy = EDGE[name]
    data = fitting.read_creep(path)
    t = data.t[data.t > 0] / scale
    truth = 1 / 2e5 - np.expm1(-t / 4.0) / 1e5 + t / 5e6
    measured = data.response / (1.0 if data.strain is None else data.stress[1][-1])
    np.testing.assert_allclose(measured[data.t > 0], truth, rtol=accuracy)
    assert t[-1] == pytest.approx(40.0, rel=1e-5)
    if data.stress is not None:
        assert data.stress[0][0] == 0.0  # the stress began half a second before the first sample
    if name == "t0_noise":
        assert (data.t[0], data.J[0]) == (0.0, 3e-9)


@pytest.mark.slow
def test_numbers_of_unknown_meaning_are_not_taken_for_compliance():
    """Time and a deformation in an unknown unit, without a header, creep and recovery (provenance)."""
    path = DATA / "creep_asphalt" / "creep-test.csv"
    if not path.exists():
        pytest.skip("the asphalt is not beside the project")
    with pytest.raises(ValueError, match=r"no header.*columns="):
        fitting.read_creep(path)
    with pytest.raises(ValueError, match=r"falls after 23\d.*window="):
        fitting.read_creep(path, columns={"t": 0, "J": 1})
    creep = fitting.read_creep(path, columns={"t": 0, "J": 1}, window=(0, 230))
    assert creep.t[-1] == pytest.approx(230, abs=0.2)


@pytest.mark.parametrize("name", COMPLIANCE)
def test_compliance_is_read_right(tmp_path, name):
    text, options = COMPLIANCE[name]
    data = fitting.read_creep(save(tmp_path, text), **options)
    np.testing.assert_allclose(data.t, T, rtol=5e-6)
    np.testing.assert_allclose(data.compliance, J, rtol=2e-7)


def test_what_was_chosen_and_what_was_left_is_said(tmp_path):
    text = (
        trios(CREEP, RECOVERY) + "[step]\nTime sweep - 3\nStep time\tTorque\ns\tN.m\n" + rows(T, T, sep="\t")
    )
    data = fitting.read_creep(save(tmp_path, text), segment="Creep - 1", window=(1.0, 1300))
    said = " | ".join(data.notes)
    for phrase in (
        "'Step time' taken, not 'Time'",
        "segment taken: Creep - 1",
        "window from 1 s to 1300 s taken: 20 of 24 points",
        "1 other blocks",
    ):
        assert phrase in said
    assert data.t[0] > 1.0


@pytest.mark.parametrize("name", STRAINED)
def test_strain_under_a_step_of_stress_is_read_right(tmp_path, name):
    text, options = STRAINED[name]
    data = fitting.read_creep(save(tmp_path, text), **options)
    np.testing.assert_allclose(data.t, T, rtol=5e-6)
    np.testing.assert_allclose(data.response, STRAIN, rtol=2e-7)
    knots, values = data.stress
    assert knots[0] == 0.0  # the stress is there from zero on
    np.testing.assert_allclose(values, SIGMA)


def test_a_stress_that_rises_between_two_samples_is_said(tmp_path):
    text = NAMES + "\n0,0,0\n1,0,0\n" + rows(1.5 + T, STRAIN, S)
    data = fitting.read_creep(save(tmp_path, text))
    np.testing.assert_allclose(data.stress[0][:2], [0.0, 1.0])  # none at 1 s of the file, all at 2 s
    np.testing.assert_allclose(data.stress[1][:2], [0.0, SIGMA])
    assert any("rises between 1 and 2 s" in note and "start=" in note for note in data.notes)


@pytest.mark.parametrize("options", [{}, {"start": 10.0}])
def test_the_strain_before_the_load_is_the_zero_of_the_strain(tmp_path, options):
    """An instrument whose strain was not set to zero: 0.5 % before a step of stress at 10 s, and after it in addition to the
    creep. A strain that still moves is not subtracted, with a note."""
    idle, t = np.linspace(0.0, 9.0, 10), np.append(9.0, 9.99 + T)
    times, stress = np.append(idle[:-1], t), np.concatenate([np.zeros(10), 0 * T + SIGMA])
    strain = np.concatenate([np.zeros(10), STRAIN])
    head = "t [s],strain [-],stress [Pa]"
    right = fitting.read_creep(save(tmp_path, table(head, times, strain, stress)), **options)
    data = fitting.read_creep(save(tmp_path, table(head, times, strain + 0.005, stress)), **options)
    np.testing.assert_allclose(data.strain, right.strain, atol=1e-12)
    assert any("the strain before the load, 0.005, is subtracted" in note for note in data.notes)
    moving = strain + np.where(times <= 9.0, 0.005 * np.exp(-times / 5.0), 0.0)
    data = fitting.read_creep(save(tmp_path, table(head, times, moving, stress)), **options)
    assert any("the strain before the load changes" in note for note in data.notes)


def test_the_clock_counts_from_the_load_if_its_samples_show_it(tmp_path):
    """Early samples, or spacing that grows with time, begin with the load; evenly spaced late ones need not."""
    creep = lambda t: 1 / 2e5 - np.expm1(-t / 4.0) / 1e5 + t / 5e6
    even, dense = np.linspace(5.0, 45.0, 400), np.geomspace(0.5, 40.0, 400)
    read = lambda name, t: fitting.read_creep(
        save(tmp_path, table(f"{name} [s],strain [-],stress [Pa]", t, creep(t) * SIGMA, 0 * t + SIGMA))
    )
    for name, t in (("time", dense), ("step time", even)):
        data = read(name, t)
        np.testing.assert_allclose(data.t, t, rtol=1e-8)
        assert data.stress[0][0] == 0.0
    for t in (even, 1286 + dense):
        with pytest.raises(ValueError, match="start="):
            read("time", t)


def test_a_window_is_of_the_clock_of_the_file(tmp_path):
    path = save(tmp_path, table("t [s],J [1/Pa]", 1286 + T, J))
    data = fitting.read_creep(path, start=1286, window=(1287, 1296))
    np.testing.assert_allclose(data.t, T[(T >= 1) & (T <= 10)], atol=1e-5)


def test_creep_and_recovery_under_the_measured_stress(tmp_path):
    """Both steps, joined on the running clock: strain, and the stress that goes back to zero between samples."""
    late = np.linspace(41.0, 80.0, 40)
    steps = trios(
        ("Creep - 1", [T, T, S, 100 * STRAIN]),
        ("Recovery - 2", [late, late - 40, 0 * late, 0 * late + 1.0]),
        names=TRIOS[0][:4],
        units=TRIOS[1][:4],
    )
    options = {"segment": (0, 1), "columns": {"t": "Time"}, "start": 0.0}
    data = fitting.read_creep(save(tmp_path, steps), **options)
    np.testing.assert_allclose(data.t, np.concatenate([T, late]), rtol=1e-8)
    np.testing.assert_allclose(data.stress[1], np.concatenate([[SIGMA], S, 0 * late]))
    assert any("changes between 40 and 41 s, taken as linear" in note for note in data.notes)


@pytest.mark.parametrize("name", PRESSED)
def test_indentation_is_read_right(tmp_path, name):
    text, options = PRESSED[name]
    data = fitting.read_indentation(save(tmp_path, text), **options)
    np.testing.assert_allclose(data.t, CLOCK, atol=1e-8)
    np.testing.assert_allclose(data.load, LOAD, atol=1e-14)
    np.testing.assert_allclose(data.depth, DEPTH, atol=1e-14)
    assert data.marks is None or np.all(data.marks == SEGMENTS)


@pytest.mark.parametrize(
    ("constant", "given"),
    [(CONSTANT, {}), ("", {"spring_constant": K}), (f"# sensitivity: 4.8E-8\n{CONSTANT}", {})],
)
def test_a_force_curve_of_jpk_gives_depth_from_height_and_deflection(tmp_path, constant, given):
    data = fitting.read_indentation(save(tmp_path, jpk(CLOCK, LOAD, HEIGHT, MARKS, constant)), **given)
    np.testing.assert_allclose(data.t, CLOCK, atol=1e-8)
    np.testing.assert_allclose(data.depth - data.depth[0], DEPTH - DEPTH[0], atol=1e-13)
    assert np.all(data.marks == SEGMENTS)


@pytest.mark.parametrize(
    ("read", "case"),
    [(fitting.read_creep, case) for case in REFUSED.values()]
    + [(fitting.read_indentation, case) for case in NOT_PRESSED.values()],
    ids=[*REFUSED, *NOT_PRESSED],
)
def test_what_cannot_be_read_is_one_line_that_says_what_to_do(tmp_path, read, case):
    text, words, options = case
    with pytest.raises(ValueError) as error:
        read(save(tmp_path, text), **options)
    message = str(error.value)
    assert "\n" not in message and len(message) < 500
    assert [word for word in words if word not in message] == [], message
