"""Files that no instrument should write, and people do: read right, or refused with one line that says what to do.

One truth, a Burgers creep curve, is written here in many ways; no number may come out of them that is not its own.
"""

import json

import numpy as np
import pytest
from layouts import each, rows, save, table

import fitting
from jaxcontact.__main__ import main

T = np.geomspace(0.5, 40.0, 24)
J = 1 / 2e5 - np.expm1(-T / 4.0) / 1e5 + T / 5e6
S = 0 * T + 1000.0
GAMMA = J * S
FULL = {"form": "{:.13g}"}
BODY = rows(T, J, **FULL)
LINES = BODY.splitlines()
HEAD = "t [s],J [1/Pa]\n"
PLAIN = HEAD + BODY
HALVES = "\n".join(LINES[:12]) + "\n", "\n".join(LINES[12:]) + "\n"


MARKS = PLAIN.replace(",", ";").replace(".", ",")


def curve(header, t=T / 60, y=1e3 * J, **style):
    """The curve in min and 1/kPa, unless said otherwise."""
    return table(header, t, y, **FULL, **style)


READ = {
    "on its side": "t [s]," + ",".join(map(repr, T.tolist())) + "\nJ [1/Pa]," + ",".join(map(repr, J.tolist())) + "\n",
    "on its side, units in cells": "film 7\n,"
    + ",".join(f"{t!r} s" for t in T.tolist())
    + "\nCreep compliance (1/Pa),"
    + ",".join(map(repr, J.tolist()))
    + "\nTemperature (°C),"
    + ",".join(["21"] * T.size),
    "stray cells": "t [s];J [1/Pa];;;20\n" + LINES[0].replace(",", ";") + ";;;80\n"
    + BODY[len(LINES[0]) + 1 :].replace(",", ";"),
    "stray words": HEAD.replace(",", ";") + LINES[0].replace(",", ";") + ";;film;of;today;by;me\n"
    + BODY[len(LINES[0]) + 1 :].replace(",", ";"),
    "statistics after it": PLAIN + "\nSeries,maximum\nx,2e-5\ns,1e-6\n",
    "UTF-8 mark, CRLF": b"\xef\xbb\xbf" + PLAIN.replace("\n", "\r\n").encode(),
    "UTF-8 mark before sep=": b"\xef\xbb\xbfsep=;\r\n" + PLAIN.replace(",", ";").encode(),
    "UTF-16, other end first": b"\xfe\xff" + PLAIN.encode("utf-16-be"),
    "UTF-16, German, tabs": curve("Zeit [min]\tNachgiebigkeit [1/kPa]", sep="\t", comma=True).encode("utf-16"),
    "line ends doubled": PLAIN.replace("\n", "\r\r\n"),
    "mark where files were joined": HEAD + "\ufeff".join(HALVES),
    "page feed": HEAD + "\f".join(HALVES),
    "invisible blank": "\u200b" + PLAIN,
    "blanks that do not break": PLAIN.replace(",", "\u00a0"),
    "blanks and tabs in turn": "t [s]\t J [1/Pa]\n" + "".join(
        line.replace(",", (" ", "\t", "  ", "\t ")[k % 4]) + "\n" for k, line in enumerate(LINES)),
    "rules of a table": "t [s]   J [1/Pa]\n-------  --------\n" + BODY.replace(",", " "),
    "LaTeX": "t & J \\\\\n" + "".join(line.replace(",", " & ") + " \\\\\n" for line in LINES),
    "braces": curve("t {min},J {1/kPa}"),
    "angles": curve("t <min>,J <1/kPa>"),
    "wide brackets": curve("t（min）;J【1/kPa】", sep=";"),
    "in and brackets": curve("t in [min];J in [1/kPa]", sep=";"),
    "stroke and brackets": curve("t / [min];J / [1/kPa]", sep=";"),
    "two kinds of brackets": curve("t ([min]);J ([1/kPa])", sep=";"),
    "a dot": curve("t [min.];J [kPa^-1]", sep=";"),
    "TeX": curve("t [$min$];J [$kPa^{-1}$]", sep=";"),
    "superscripts": curve("t [min];J [kPa⁻¹]", sep=";"),
    "capitals": curve("TIME [MIN],COMPLIANCE [1/KPA]"),
    "symbols, then units": curve("Time,Compliance\nt,J\nmin,1/kPa"),
    "units above the names": curve("min,1/kPa\nt,J"),
    "sample over units": curve("film A,film A\nt [min],J [1/kPa]"),
    "Origin": curve("Time\tCompliance\nmin\t1/kPa\nfilm A\tfilm A", sep="\t"),
    "lines within a cell": curve('"Time\n(min)","J\n(1/kPa)"'),
    "words of lines within a cell": curve('"Creep\ntime [min]";"Creep\ncompliance [1/kPa]"', sep=";"),
    "index of pandas": ",t [s],J [1/Pa]\n" + "".join(f"{k},{line}\n" for k, line in enumerate(LINES)),
    "names of rows from R": '"","t","J"\n' + "".join(f'"{k}",{line}\n' for k, line in enumerate(LINES)),
    "commas at the end of the header": PLAIN.replace("]\n", "],,\n"),
    "overload": HEAD + "3,9.9E37\n".join(HALVES),
    "not a number of an instrument": HEAD + "3,9.91E+37\n".join(HALVES),
    "-999 for nothing": HEAD + "3,-999\n".join(HALVES),
    "signs": HEAD + each(T, J, "{t:+.13g},{J:+.13g}"),
    "time of day beside": "Clock,Time [s],J [1/Pa]\n" + each(T, J, "10:00:{t:05.2f},{t:.13g},{J:.13g}"),
    "date beside": "Datum;t [s];J [1/Pa]\n" + each(T, J, "12.03.2024 10:00;{t:.13g};{J:.13g}"),
    "temperature named t": table("t [°C],time [s],J [1/Pa]", S, T, J, **FULL),
    "temperature named T": table("T,t,J", S, T, J, **FULL),
    "error before": table("t [s],J_err [1/Pa],J [1/Pa]", T, 0.1 * J, J, **FULL),
    "fit beside": table("t [s],J (fit) [1/Pa],J [1/Pa]", T, 1.1 * J, J, **FULL),
    "weeks, per bar": curve("t [weeks],J [1/bar]", T / 604800, 1e5 * J),
    "days, per cent": curve("Zeit in Tagen;J [%/kPa]", T / 86400, 1e5 * J, sep=";", comma=True),
    "mm2 and meganewtons": curve("t [µs];J [m²/MN]", 1e6 * T, 1e6 * J, sep=";"),
    "pressed, not drawn": table("t [s],strain [-],stress [Pa]", T, -GAMMA, -S, **FULL),
    "per mille and gf": table("t [s],strain [‰],stress [gf/cm2]", T, 1e3 * GAMMA, S / 98.0665, **FULL),
}  # fmt: skip

FACTOR = "units={'J'"
CSV = "save the table as CSV"
# name: (file, the remedy)
REFUSED = {
    "factor in the unit": (curve("t [min],J [10^-3 1/Pa]"), FACTOR),
    "factor in the unit, E": (curve("t [min],J [1e-3/Pa]"), FACTOR),
    "factor in the unit, minus": (curve("t [min],J (x10⁻³ Pa⁻¹)"), FACTOR),
    "factor before the name": (curve("t [min],1e3 J [1/Pa]"), FACTOR),
    "factor after the name": (curve("t [min],J x 10^3 [1/Pa]"), FACTOR),
    "factor behind": (curve("t [min],J [1/Pa] (x 1e-3)"), FACTOR),
    "factor of the time": (curve("t [10^3 s],J [1/Pa]"), "units={'t'"),
    "factor in a line below": (curve("t,J\nmin,1/Pa\n,x 1e-3"), "'x 1e-3 1/Pa'"),
    "log t": (curve("log t [s],J [1/kPa]", np.log10(T)), "write its values"),
    "log10(t)": (curve("log10(t),J [1/kPa]", np.log10(T)), "write its values"),
    "lg t/s": (curve("lg t/s;J/(1/kPa)", np.log10(T), sep=";"), "write its values"),
    "log of the unit": (curve("t [log s],J [1/kPa]", np.log10(T)), "expected a unit among s"),
    "log J": (curve("t [min],log J", y=np.log10(J)), "write its values"),
    "root of the time": (curve("sqrt(t) [s],J [1/kPa]", T**0.5), "write its values"),
    "relative": (curve("t [min],J/J0", y=J / J[0]), "expected a unit among 1/Pa"),
    "normalised": (curve("t [min],J_norm", y=J / J[0]), "expected a unit among 1/Pa"),
    "any unit": (curve("t [min],J [a.u.]"), "expected a unit among 1/Pa"),
    "time over a time": (curve("t/tau,J [1/kPa]"), "expected a unit among s"),
    "temperature for time": (curve("t [°C],J [1/kPa]"), "expected a unit among s"),
    "minutes or months": (curve("Time [M],J [1/kPa]"), "expected a unit among s"),
    "modulus": (curve("t [min],modulus [MPa]", y=1 / J), "columns={'J'"),
    "modulus named compliance": (curve("t [min],J [N/mm2]", y=1 / J), "expected a unit among 1/Pa"),
    "creep modulus": (curve("t [h],creep modulus [MPa]", y=1 / J), "nu= for J"),
    "complex modulus": (table("Frequency [Hz],|G*| [Pa],tan(δ)", T, 1 / J, 0.1 / J), "read_oscillation"),
    "load and depth": (table("Time (s),Load (mN),Depth (nm)", T, S, J), "read_indentation"),
    "complex compliance": (table("t [s],J' [1/Pa],J'' [1/Pa]", T, J, J), "columns={'J'"),
    "flow curve": (table("Shear rate [1/s],Viscosity [Pa.s],Shear stress [Pa]", T, J, S), "columns="),
    "rate of strain": (table("t [s],strain rate [1/s],stress [Pa]", T, GAMMA, S), "columns="),
    "one header twice, side by side": (table("t [s],J [1/Pa],t [s],J [1/Pa]", T, J, T, 2 * J), "segment="),
    "side by side, by pandas": (table("t [s],J [1/Pa],t [s].1,J [1/Pa].1", T, J, T, 2 * J), "segment="),
    "repeats": (table("t [s],J_1 [1/Pa],J_2 [1/Pa]", T, J, 2 * J), "columns={'J'"),
    "mean and deviation": (table("t [s],J mean [1/Pa],J SD [1/Pa]", T, J, J), "columns={'J'"),
    "time in two units": (table("t [s],t [min],J [1/Pa]", T, T / 60, J), "columns={'t'"),
    "numbers of rows without a name": (HEAD + each(T, J, "7,{t:.6g},{J:.6g}"), "name each column once"),
    "a column without a name": (HEAD + each(T, J, "{t:.6g},{J:.6g},25"), "name each column once"),
    "header on every page": (HEAD + HEAD.join(HALVES), "segment="),
    "another unit on the next page": (HEAD + HALVES[0] + curve("t [min],J [1/kPa]"), "segment="),
    "another separator half-way": (HEAD + HALVES[0] + HALVES[1].replace(",", ";"), "write all lines in one dialect"),
    "another decimal mark half-way": (PLAIN.replace(",", ";")[:500] + MARKS[500:], "write all lines in one dialect"),
    "another decimal mark before": (PLAIN.replace(",", ";")[:200] + "\n" + MARKS[230:], "write all lines in one dialect"),
    "thousands unquoted": ("t [ms],J [1/Pa]\n" + each(1e3 * T, J, "{t:,.3f},{J:.9g}"), "expected 2 columns"),
    "error of a formula": (HEAD + "3,#DIV/0!\n".join(HALVES), "line 14"),
    "overload in words": (HEAD + "3,OVL\n".join(HALVES), "line 14"),
    "too narrow a column": (HEAD + "3,########\n".join(HALVES), "line 14"),
    "below a limit": (HEAD + "3,<1e-5\n".join(HALVES), "line 14"),
    "remark behind a row": (PLAIN.replace(LINES[3], LINES[3] + " # late"), "line 5"),
    "units in the cells": ("t,J\n" + each(T, J, "{t:.6g} s,{J:.6g} 1/Pa"), CSV),
    "powers in the cells": (HEAD + each(T, J, "{t:.6g} s,{J:.6f}x10^-6"), CSV),
    "errors in the cells": (HEAD + each(T, J, "{t:.6g},{J:.6g} ± 1e-7"), CSV),
    "one quoted cell a row": (HEAD + "".join(f'"{line}"\n' for line in LINES), CSV),
    "pipes": (PLAIN.replace(",", "|"), CSV),
    "times of day": ("t,J [1/Pa]\n" + each(T, J, "2024-03-12T10:00:{t:06.3f},{J:.9g}"), CSV),
    "seconds since 1970": (table("Time [s],J [1/Pa]", 1.7e9 + T, J, form="{:.15g}"), "start="),
    "days of a workbook": (table("Time,J [1/Pa]", 45000.5 + T / 86400, J, form="{:.15g}"), "start="),
    "HTML named xls": ("<html><table>\n<tr><td>0.5</td><td>6e-6</td></tr>\n</table></html>", CSV),
    "JSON": (json.dumps({"t": T.tolist(), "J": J.tolist()}, indent=1), CSV),
    "JSON, pairs": (json.dumps(np.stack([T, J], 1).tolist()), CSV),
    "RTF": ("{\\rtf1\\ansi t [s]\\tab J [1/Pa]\\par\n" + BODY.replace("\n", "\\par\n"), CSV),
    "PDF": (b"%PDF-1.4\n%\xe2\xe3\n1 0 0 1 72 720 Tm\n0 0 0 rg\n", CSV),
    "pointer to a large file": ("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n", CSV),
    "array of numpy": (b"\x93NUMPY\x01\x00" + np.stack([T, J]).tobytes(), "export it as text or CSV"),
    "a zero byte": (PLAIN[:99] + "\0" + PLAIN[99:], "export it as text or CSV"),
    "times below zero": (table("t [s],J [1/Pa]", -T, J), "window=(0, None)"),
    "compliance below zero": (table("t [s],J [1/Pa]", T, -J), "expected values > 0"),
    "one time throughout": (table("t [s],J [1/Pa]", S, J), "at least 5 different times"),
    "one row": (HEAD + "1,2e-5\n", "at least 5 values"),
    "mark and nothing else": (b"\xef\xbb\xbf", "empty file"),
}  # fmt: skip

INDENTATION, RELAXATION, SWEEP = fitting.read_indentation, fitting.read_relaxation, fitting.read_oscillation
# name: (reader, file, the remedy)
OTHERS = {
    "force in capitals": (INDENTATION, table("TIME (S),LOAD (MN),DEPTH (NM)", T, S, J), "'MN'"),
    "way of the piezo": (INDENTATION, table("Time (s),Force (nN),Piezo (nm)", T, S, J), "spring_constant="),
    "deflection in volts": (INDENTATION, table("Time (s),Deflection (V),Depth (nm)", T, S, J), "columns={'load'"),
    "mass for force": (INDENTATION, table("Time (s),Load (g),Depth (nm)", T, S, J), "expected a unit among N"),
    "letters lost": (INDENTATION, table("Time (s),Load (\ufffdN),Depth (nm)", T, S, J), "expected a unit among N"),
    "factor of the load": (INDENTATION, table("Time (s),Load (1e-6 N),Depth (nm)", T, S, J), "units={'load'"),
    "creep for indentation": (INDENTATION, PLAIN, "read_creep reads it"),
    "creep for relaxation": (RELAXATION, PLAIN, "read_creep reads it"),
    "log of a modulus": (RELAXATION, table("t [s],log G(t) [Pa]", T, 5 - np.log(T)), "write its values"),
    "modulus over its first": (RELAXATION, table("t [s],G(t)/G0", T, J[0] / J), "expected a unit among Pa"),
    "sweep for relaxation": (RELAXATION, table("Frequency [Hz],G' [Pa],G'' [Pa]", T, S, S), "read_oscillation reads it"),
    "log of a frequency": (SWEEP, table("log omega [rad/s],G' [Pa],G'' [Pa]", T, S, S), "write its values"),
    "sweep of strain": (SWEEP, table("Strain [%],G' [Pa],G'' [Pa]", T, S, S), "columns={'omega'"),
    "sweep of time": (SWEEP, table("Time [s],Frequency [Hz],G' [Pa],G'' [Pa]", T, S, S, S), "a frequency sweep"),
}  # fmt: skip


@pytest.mark.parametrize("name", READ)
def test_the_truth_is_read(tmp_path, name):
    data = fitting.read_creep(save(tmp_path, READ[name]))
    stress = 1.0 if data.stress is None else data.stress[1][-1]
    np.testing.assert_allclose(data.t, T, rtol=1e-9)
    np.testing.assert_allclose(data.response / stress, J, rtol=1e-9)


@pytest.mark.parametrize(
    ("read", "text", "remedy"),
    [(fitting.read_creep, *case) for case in REFUSED.values()] + list(OTHERS.values()),
    ids=[*REFUSED, *OTHERS],
)
def test_what_could_be_read_wrong_is_refused_with_a_remedy(tmp_path, read, text, remedy):
    with pytest.raises(ValueError) as error:
        read(save(tmp_path, text))
    message = str(error.value)
    assert "film.csv" in message and "\n" not in message and len(message) < 500
    assert remedy in message, message


def test_the_remedy_reads_the_file(tmp_path):
    """What a message advises gives the truth."""
    for text, options in (
        (REFUSED["factor in the unit"][0], {"units": {"J": "1/kPa"}}),
        (REFUSED["factor behind"][0], {"columns": {"J": 1}, "units": {"J": "1/kPa"}}),
        (REFUSED["factor in a line below"][0], {"units": {"J": "1/kPa"}}),
        (REFUSED["header on every page"][0], {"segment": [0, 1]}),
        (REFUSED["time in two units"][0], {"columns": {"t": "t [min]"}}),
        (REFUSED["repeats"][0], {"columns": {"J": "J_1 [1/Pa]"}}),
    ):
        data = fitting.read_creep(save(tmp_path, text), **options)
        np.testing.assert_allclose(data.t, T, rtol=1e-7)
        np.testing.assert_allclose(data.J, J, rtol=1e-7)


def test_choosing_a_column_of_logarithms_does_not_make_them_times(tmp_path):
    """A caller who names the column of log t is told what is in it, not taken at his word."""
    for name in ("log t", "log10(t)", "root of the time"):
        with pytest.raises(ValueError, match="write its values"):
            fitting.read_creep(save(tmp_path, REFUSED[name][0]), columns={"t": 0})


IN_A_SHELL = {  # the same remedies, as flags
    "factor in the unit": "--unit J=",
    "modulus": "--column J=",
    "times below zero": "--window 0:",
    "header on every page": "--segment",
    "log10(t)": "write its values",
    "JSON": CSV,
    "creep modulus": "--tension",
}


@pytest.mark.parametrize("name", IN_A_SHELL)
def test_the_command_line_says_the_same_line(tmp_path, capsys, name):
    path, out = save(tmp_path, REFUSED[name][0]), tmp_path / "out"
    assert main(["fit", "creep", str(path), "-o", str(out)]) == 2
    said = capsys.readouterr().err
    assert IN_A_SHELL[name] in said and "film.csv" in said and said.count("\n") == 1
    assert not out.exists()


KIND = {
    "creep": ("t [s]", "J [1/Pa]"),
    "relaxation": ("t [s]", "G(t) [Pa]"),
    "oscillation": ("omega [rad/s]", "G' [Pa]", "G'' [Pa]"),
    "indentation": ("t [s]", "load [N]", "depth [m]"),
    "stiffness": ("depth [m]", "stiffness [N/m]", "load [N]"),
    "growth": ("t [s]", "thickness [nm]"),
}
COMMANDS = {
    "creep": [], "relaxation": [], "oscillation": [], "indentation": ["--radius", "1e-6"], "stiffness": ["--radius", "1e-6"],
    "growth": ["--stress", "1e8", "--temperature", "300"],
}  # fmt: skip


@pytest.mark.parametrize("kind", KIND)
def test_the_wrong_command_names_the_right_one(tmp_path, capsys, kind):
    path = tmp_path / "data.csv"
    path.write_text(",".join(KIND[kind]) + "\n" + rows(*[np.arange(1.0, 9.0) for _ in KIND[kind]]))
    for command in KIND.keys() - {kind}:
        if {command, kind} == {"growth", "indentation"}:
            continue  # an indentation has a depth over time, which may be that of a film
        status = main(["fit", command, str(path), "-o", str(tmp_path / "out"), *COMMANDS[command]])
        assert status == 2 and f"jaxcontact fit {kind} reads it" in capsys.readouterr().err, command
    if kind not in ("stiffness", "growth", "creep"):
        assert main(["fit", "compare", str(path), "-o", str(tmp_path / "out")]) == 2
        assert f"--of {kind} reads it" in capsys.readouterr().err


OMEGA = np.geomspace(0.1, 100.0, 16)
MODULUS = 1e5 * 1j * OMEGA / (1j * OMEGA + 0.5)
NAMES = "omega [rad/s],G' [Pa],G'' [Pa]"


def swept(omega, G, header=NAMES, *more):
    return table(header, *more, omega, G.real, G.imag, **FULL)


def with_rows_at_one_frequency(scatter):
    """The sweep, and twelve rows of another state at 6.28 rad/s, whose measured value scatters."""
    still = 6.28 * (1.0 + scatter * np.random.default_rng(0).standard_normal(12))
    return np.append(OMEGA, still), np.append(MODULUS, np.full(12, 3e4 + 1e3j))


@pytest.mark.parametrize("scatter", [0.0, 1e-5, 1e-3])
def test_rows_at_one_frequency_are_no_part_of_a_sweep(tmp_path, scatter):
    data = fitting.read_oscillation(save(tmp_path, swept(*with_rows_at_one_frequency(scatter))))
    np.testing.assert_allclose(data.omega, OMEGA, rtol=1e-8)
    np.testing.assert_allclose(data.shear, MODULUS, rtol=1e-8)
    assert any("at one frequency, beside the sweep, left out: lines 18 to 29" in note for note in data.notes)


def test_a_sweep_that_repeats_each_frequency_is_whole(tmp_path):
    data = fitting.read_oscillation(save(tmp_path, swept(np.repeat(OMEGA, 3), np.repeat(MODULUS, 3))))
    assert data.omega.size == 48


def test_an_index_column_and_a_turn_divide_a_table(tmp_path):
    """Two sweeps of different states, told apart by the index of a segment, or by the way back."""
    both = np.append(OMEGA, OMEGA), np.append(MODULUS, 2.0 * MODULUS)
    index = table(
        "SegIndex;omega [rad/s];G' [Pa];G'' [Pa]", both[0], both[1].real, both[1].imag, sep=";", **FULL
    )
    lines = index.splitlines()
    marked = [lines[0], *(f"{1 + k // 16}|{k % 16};{line}" for k, line in enumerate(lines[1:]))]
    back = swept(np.append(OMEGA, OMEGA[::-1]), np.append(MODULUS, 2.0 * MODULUS[::-1]))
    for text in ("\n".join(marked) + "\n", back):
        path = save(tmp_path, text)
        with pytest.raises(ValueError, match="expected one curve, got 2: choose with segment="):
            fitting.read_oscillation(path)
        for place, factor in ((0, 1.0), (1, 2.0)):
            data = fitting.read_oscillation(path, segment=place)
            np.testing.assert_allclose(data.shear, factor * MODULUS, rtol=1e-8)


def test_a_temperature_ramp_is_no_frequency_sweep(tmp_path):
    T = np.repeat(np.linspace(20.0, 100.0, 20), 4)
    text = table("T [°C],f [Hz],E' [MPa],E'' [MPa]", T, np.tile([1, 2, 5, 10], 20), 3e3 - 10 * T, 100 + T)
    with pytest.raises(ValueError, match="expected one temperature within a curve, got 20 to 100"):
        fitting.read_oscillation(save(tmp_path, text), convention="E", nu=0.3)


@pytest.mark.parametrize(
    "head",
    [
        "t [s],Creep modulus [MPa]",
        "t [s],Kriechmodul [MPa]",
        "t [s],Creep compliance [1/Pa],Creep modulus [MPa]",
    ],
)
def test_a_creep_modulus_is_the_inverse_of_a_tensile_compliance(tmp_path, head):
    """ISO 899-1: stress over strain at constant stress, 1/D(t), with J = 2 (1 + nu) D."""
    nu, D = 0.3, J / 2.6
    text = table(head, *([T, D, 1e-6 / D] if "compliance" in head else [T, 1e-6 / D]), **FULL)
    np.testing.assert_allclose(
        fitting.read_creep(save(tmp_path, text), nu=nu, convention="D").compliance, J, rtol=1e-7
    )
    with pytest.raises(ValueError, match="needs nu="):
        fitting.read_creep(save(tmp_path, text))
    name = head.rpartition(",")[2]
    with pytest.raises(ValueError, match=r"got a creep (modulus|compliance).*read_creep"):
        fitting.read_relaxation(save(tmp_path, text), columns={"modulus": name})
    with pytest.raises(ValueError, match=r"read_creep reads it"):
        fitting.read_relaxation(save(tmp_path, text))


@pytest.mark.parametrize(
    "name", ["Creep Modulus E(t) [MPa]", "Creep stiffness [MPa]", "Kriechmodul Folie A [MPa]"]
)
def test_a_creep_modulus_under_a_longer_name_is_no_relaxation_modulus(tmp_path, name):
    """Also where it is chosen as such, as the message on a missing column says."""
    path = save(tmp_path, table(f"t [s],{name}", T, 1e-6 / J, **FULL))
    with pytest.raises(ValueError, match=r"got a creep modulus: read_creep"):
        fitting.read_relaxation(path, columns={"modulus": name})
    data = fitting.read_creep(path, columns={"creep_modulus": name}, nu=0.3)
    np.testing.assert_allclose(data.compliance, 2.6 * J, rtol=1e-7)


def test_a_modulus_under_a_plain_name(tmp_path):
    for head, given, factor in (
        ("t [s],G [Pa]", {}, 1.0),
        ("t [s],modulus [Pa]", {}, 1.0),
        ("t [s],E [Pa]", {"nu": 0.5}, 3.0),
    ):
        data = fitting.read_relaxation(save(tmp_path, table(head, T, 1.0 / J, **FULL)), start=0.0, **given)
        np.testing.assert_allclose(data.shear, 1.0 / J / factor, rtol=1e-7)
    with pytest.raises(
        ValueError, match="expected a relaxation modulus, got a stress according to the heading"
    ):
        path = save(tmp_path, table("t [s],stress [Pa]", T, 1.0 / J, **FULL))
        fitting.read_relaxation(path, columns={"modulus": "stress [Pa]"})


def test_what_an_instrument_states_is_said(tmp_path):
    facts = "k (N/m)\t0.5\nE[eff] (Pa)\t1234\nReduced modulus (GPa): 3.1\nS0\t4\n"
    depth = np.linspace(0.0, 1e-6, 40)
    text = facts + table("Time (s)\tLoad (uN)\tDepth (nm)", 1e7 * depth, 1e6 * depth, 1e9 * depth, sep="\t")
    said = fitting.read_indentation(save(tmp_path, text)).notes
    assert "the instrument states E[eff] (Pa): 1234 Pa" in said
    assert "the instrument states Reduced modulus (GPa): 3.1e+09 Pa" in said
