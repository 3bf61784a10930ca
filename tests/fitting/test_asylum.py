"""Force curves of Asylum: ARDF maps and Igor waves, written here byte by byte from known curves, and read back."""

import struct
import sys
import zlib

import numpy as np
import pytest

import fitting
from fitting.data import force_curves
from fitting.data.force_curves import curves_in
from jaxcontact.__main__ import main
from tests.support.tables import read_back

K, INVOLS = 0.3, 50e-9  # [N/m], [m/V]
HALF_ANGLE, NU = np.deg2rad(20.0), 0.5
RATE, DWELL_RATE, DWELL = 2000.0, 100.0, 0.4  # [1/s], [1/s], [s]
SPEED, BACK = 4e-6, 8e-6  # of the base [m/s]
REACH = 1.2e-6  # of the base, above the sample
NOTE = {
    "SpringConstant": K, "InvOLS": INVOLS, "NumPtsPerSec": RATE, "VelocitySynch": 0, "ApproachVelocity": SPEED,
    "RetractVelocity": BACK, "Velocity": 1.0, "DwellTime": DWELL, "DwellRate": DWELL_RATE, "UseDwellRate": 1,
    "XOffset": 3e-6, "YOffset": -1e-6, "FastScanSize": 6e-6, "SlowScanSize": 1e-6, "Path": "C:Users:gel",
}  # fmt: skip


def deflection(z, E):
    """Deflection of the lever [m] at places of its base, a cone on a half-space (Sneddon): k d = C (z - d)^2."""
    C = 2.0 / np.pi * np.tan(HALF_ANGLE) * E / (1.0 - NU**2)
    z = np.maximum(z, 0.0)
    return z + K / (2.0 * C) - np.sqrt((K / (2.0 * C)) ** 2 + z * K / C)


def ramp(E, deepest=8e-7, away=30, dwell=True):
    """Times, places of the base (from first contact, inwards), deflections and last samples of the segments.

    The deflection drifts in the dwell, whose samples are far apart, and the base rests away from the sample afterwards.
    """
    n, m = round((REACH + deepest) / SPEED * RATE), round(DWELL * DWELL_RATE) if dwell else 0
    b = round((REACH + deepest) / BACK * RATE)
    t = np.concatenate([
        np.arange(n) / RATE, n / RATE + np.arange(m) / DWELL_RATE,
        n / RATE + m / DWELL_RATE + np.arange(b + away) / RATE,
    ])  # fmt: skip
    z = np.concatenate([
        -REACH + SPEED * np.arange(n) / RATE, np.full(m, deepest), deepest - BACK * np.arange(b) / RATE,
        np.full(away, -REACH),
    ])  # fmt: skip
    d = deflection(z, E)
    d[n : n + m] *= 1.0 - 0.1 * np.linspace(0, 1, m)
    parts = [n, m, b, away] if dwell else [n, b, away]
    return t, z, d, np.cumsum(parts) - 1


def noted(changes):
    return "".join(f"{key}: {value}\r" for key, value in (NOTE | changes).items()).encode("cp1252")


# ARDF


def chunk(name, body=b"", flags=0):
    rest = struct.pack("<I4sI", 16 + len(body), name.encode(), flags) + body
    return struct.pack("<I", zlib.crc32(rest)) + rest


def table(name, entries, stride, spare=2):
    """A table with unused entries of zeros."""
    body = b"".join(entries) + bytes(stride * spare)
    count = len(body) // stride
    return chunk(name, struct.pack("<QII", 32 + len(body), count, stride)) + body


def word(text, size=32):
    return text.encode("cp1252").ljust(size, b"\0")


def ardf(
    path, curves, shape, steps=(2e-6, 5e-7, 1 / RATE), units=("m", "m", "s"), segments="Ext;Dwell;Ret;Away;",
    channels=(("Raw", "m", -1.0), ("Defl", "m", 1.0), ("ZSnsr", "m", 1.0)), down=False, back=False, lines=None,
    changes=None, volumes=1,
):  # fmt: skip
    """Write a map. curves: {(line, point): result of ``ramp``}; channels: name, unit, factor; lines: those recorded."""
    rows, points = shape
    text = noted(changes or {})
    text = chunk("TEXT", struct.pack("<II", 0, len(text)) + text + bytes(5))
    contents, texts = 32 + 24 * (2 + volumes), 32 + 32 * 3
    start = 16 + contents + texts
    out = chunk("ARDF")
    first = start + len(text)
    order = [line for line in range(rows) if lines is None or line in lines]
    order = order[::-1] if down else order
    order_points = range(points)[::-1] if back else range(points)

    def volume(at, kind):
        head = table("VOLM", [chunk("NSET", struct.pack("<Q", len(order) * points))], 24)
        head += table("TTOC", [], 32)
        head += chunk("VDEF", struct.pack("<II24x3d", points, rows, *steps) + b"".join(map(word, units))
                      + word(segments) + struct.pack("<Q", segments.count(";")))  # fmt: skip
        head += b"".join(chunk("VCHN", word(name) + word(unit)) for name, unit, _ in channels)
        head += chunk("XDEF", struct.pack("<II", 0, 8) + word("Time;X;;", 72))
        after = at + len(head) + 32 + 40 * rows + 16
        data, offsets = b"", []
        for line in order:
            offsets.append((line, after + len(data)))
            for point in order_points:
                _, z, d, ends = curves[line, point]
                body = b""
                for number, (name, _, factor) in enumerate(channels):
                    samples = (factor * (d if name == "Defl" else z)).astype("<f4")
                    last = [0, *ends, 0, 0, 0][:5] if len(ends) < 4 else [0, *ends]
                    body += chunk("VDAT", struct.pack("<10I", 7, line, point, samples.size, number, *last)
                                  + samples.tobytes())  # fmt: skip
                label = word(f"Line{line}Point{point}", 30)
                body = chunk("VNAM", struct.pack("<4I", 7, line, point, len(label)) + label) + body
                body += chunk("XDAT", bytes(12))
                here = after + len(data)
                data += (
                    chunk("VSET", struct.pack("<4I2Q", 7, line, point, kind, 0, here + 48 + len(body))) + body
                )
        voff = [chunk("VOFF", struct.pack("<IIQQ", 7, line, 0, offset)) for line, offset in offsets]
        return head + table("VTOC", voff, 40, rows - len(voff)) + chunk("MLOV") + data

    parts, at = [], first
    for k in range(volumes):
        parts.append((at, volume(at, 2 if volumes == 1 else 10 + k)))
        at += len(parts[-1][1])
    out += table("FTOC", [chunk("VOLM", struct.pack("<Q", place)) for place, _ in parts], 24)
    out += table("TTOC", [chunk("TOFF", struct.pack("<QQ", 0, start))], 32)
    assert len(out) == start
    path.write_bytes(out + text + b"".join(one for _, one in parts))
    return path


def moduli(shape):
    return {(line, point): 1e4 * (1 + line + 3 * point) for line, point in np.ndindex(*shape)}


def a_map(path, shape=(2, 3), **options):
    dwell = "Dwell" in options.get("segments", "Dwell")
    curves = {
        key: ramp(E, 8e-7 - 5e-8 * key[0], dwell=dwell) for key, E in moduli(shape).items()
    }  # of several lengths
    return curves, ardf(path, curves, shape, **options)


def same(data, curve):
    """Assert that a read curve is a written one, without its rest away from the sample."""
    t, z, d, ends = curve
    size = ends[-2] + 1
    np.testing.assert_allclose(data.t, t[:size], rtol=1e-12)
    np.testing.assert_allclose(data.load, K * d[:size], rtol=2e-6, atol=1e-18)
    depth = z - d - (z - d)[0]
    np.testing.assert_allclose(data.depth, depth[:size], atol=1e-12)
    names = ["approach", "hold", "retract"] if len(ends) == 4 else ["approach", "retract"]
    counts = np.diff([0, *(ends[:-1] + 1)])
    assert data.segments.tolist() == np.repeat(names, counts).tolist()


@pytest.mark.parametrize("down", [False, True])
@pytest.mark.parametrize("back", [False, True])
def test_the_curves_of_a_map_have_values_times_and_places(tmp_path, down, back):
    """Curves are in the order of space, from the lower left corner, whatever the direction in which the scan went."""
    curves, path = a_map(tmp_path / "gel.ARDF", down=down, back=back)
    places = force_curves.places(path)
    # three points 2 um apart about x = 3 um, two lines 0.5 um apart about y = -1 um
    assert [(round(1e9 * one.x), round(1e9 * one.y)) for one in places] == [
        (1000, -1250), (3000, -1250), (5000, -1250), (1000, -750), (3000, -750), (5000, -750),
    ]  # fmt: skip
    for one, key in zip(places, np.ndindex(2, 3), strict=True):
        data = fitting.read_force(path, curve=one.curve)
        same(data, curves[key])
        assert any(
            "2000 samples/s, 100 samples/s in the dwell, dwell of 0.4 s" in note for note in data.notes
        )
    with pytest.raises(ValueError, match="got 6: choose with curve= from 0 to 5"):
        fitting.read_force(path)
    with pytest.raises(ValueError, match="curve: expected 0 to 5, got 6"):
        fitting.read_force(path, curve=6)


def test_units_of_scan_clock_and_channels(tmp_path):
    """Steps in um and ms, a height in nm, and the deflection in volts."""
    _, path = a_map(
        tmp_path / "gel.ardf", steps=(2.0, 0.5, 1e3 / RATE), units=("um", "um", "ms"),
        channels=(("Defl", "V", 1 / INVOLS), ("ZSnsr", "nm", 1e9)),
    )  # fmt: skip
    _, other = a_map(tmp_path / "other.ardf")
    for k in range(6):
        mine, usual = (fitting.read_force(one, curve=k) for one in (path, other))
        np.testing.assert_allclose(mine.t, usual.t, rtol=1e-12)
        np.testing.assert_allclose(mine.load, usual.load, rtol=1e-6, atol=1e-18)
        np.testing.assert_allclose(mine.depth, usual.depth, atol=1e-12)
    here, there = (np.array([one[1:] for one in force_curves.places(p)]) for p in (path, other))
    np.testing.assert_allclose(here, there, rtol=1e-12)


def test_a_map_without_dwell_or_steps_takes_them_from_the_note(tmp_path):
    curves, path = a_map(tmp_path / "gel.ardf", segments="Ext;Ret;Away;", steps=(0.0, 0.0, 0.0))
    same(fitting.read_force(path, curve=4), curves[1, 1])
    places = force_curves.places(path)
    # 6 um over three points and 1 um over two lines
    np.testing.assert_allclose(
        [places[0].x, places[2].x, places[0].y, places[3].y], [0, 6e-6, -1.5e-6, -5e-7]
    )


def test_given_constants_come_before_those_of_the_file(tmp_path):
    _, path = a_map(tmp_path / "gel.ardf")
    usual = fitting.read_force(path, curve=2)
    other = fitting.read_force(path, curve=2, spring_constant=2 * K, sensitivity=1.5 * INVOLS)
    np.testing.assert_allclose(other.load, 3.0 * usual.load)
    _, bare = a_map(tmp_path / "bare.ardf", changes={"SpringConstant": "NaN"})
    with pytest.raises(ValueError, match="does not state the spring constant: give spring_constant="):
        fitting.read_force(bare, curve=0)
    np.testing.assert_allclose(fitting.read_force(bare, curve=2, spring_constant=K).load, usual.load)


def test_a_stopped_scan_and_a_map_of_the_way_back_are_noted(tmp_path):
    curves, path = a_map(tmp_path / "part.ardf", lines=[1], down=True)
    assert [round(1e9 * one.y) for one in force_curves.places(path)] == [-750] * 3
    data = fitting.read_force(path, curve=1)
    same(data, curves[1, 1])
    assert "3 of the 6 curves of the map are in the file" in data.notes
    _, both = a_map(tmp_path / "both.ardf", volumes=2)
    assert len(force_curves.places(both)) == 6
    assert any("the first of 2 maps" in note for note in fitting.read_force(both, curve=0).notes)


def test_cut_and_damaged_files_are_refused_in_one_line(tmp_path):
    _, path = a_map(tmp_path / "gel.ardf")
    whole = path.read_bytes()
    names = [
        b"FTOC",
        b"TOFF",
        b"TEXT",
        b"VDEF",
        b"VCHN",
        b"VTOC",
        b"VOFF",
        b"MLOV",
        b"VSET",
        b"VNAM",
        b"VDAT",
    ]
    cuts = [0, 5, 16, *(whole.index(name) + extra for name in names for extra in (0, 20)), len(whole) - 40]
    for cut in cuts:
        other = tmp_path / f"cut{cut}.ardf"
        other.write_bytes(whole[:cut])
        with pytest.raises(ValueError, match=rf"cut{cut}.ardf: .*") as error:
            fitting.read_force(other, curve=5)
        assert "\n" not in str(error.value)
    for name in (b"TEXT", b"VDEF", b"VSET", b"VDAT"):
        place = whole.index(name) + 12
        other = tmp_path / f"damaged{place}.ardf"
        other.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(ValueError, match=f"the check sum of {name.decode()} does not agree"):
            fitting.read_force(other, curve=0)
    (tmp_path / "other.ardf").write_bytes(b"no force curves at all")
    with pytest.raises(ValueError, match="expected ARDF of an ARDF file"):
        fitting.read_force(tmp_path / "other.ardf")
    _, flat = a_map(tmp_path / "flat.ardf", channels=(("Raw", "m", 1.0), ("Amp", "m", 1.0)))
    with pytest.raises(ValueError, match=r"expected channels of the deflection .* got Raw \[m\], Amp \[m\]"):
        fitting.read_force(flat, curve=0)


def test_the_command_ends_with_status_2_for_a_cut_file(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, path = a_map(tmp_path / "gel.ardf")
    path.write_bytes(path.read_bytes()[:-3000])
    for words in (["force", "gel.ardf", "--curve", "5"], ["map", "gel.ardf", "-o", "out"]):
        assert main(["fit", *words, "--cone", "20"]) == 2
        message = capsys.readouterr().err.strip()
        assert "the file is cut" in message and "\n" not in message


@pytest.mark.slow
def test_the_command_takes_a_map_to_moduli_at_their_places(tmp_path, capsys, here):
    """The moduli rise with line and point, and are found at the places of their curves, from a scan downwards."""
    a_map(tmp_path / "gel.ardf", down=True, back=True, segments="Ext;Ret;Away;")
    assert main(["fit", "map", "gel.ardf", "-o", "out", "--cone", "20", "--processes", "1"]) == 0
    assert "6 of 6 curves accepted" in capsys.readouterr().out
    rows = read_back("out/map.csv")
    x, y = (rows[key].to_numpy() for key in ("x [m]", "y [m]"))
    line, point = np.round((y + 1.25e-6) / 5e-7), np.round((x - 1e-6) / 2e-6)
    E = rows["E [Pa]"].to_numpy()
    np.testing.assert_allclose(E, 1e4 * (1 + line + 3 * point), rtol=5e-3)


# Igor binary waves


def wave(path, data, labels, note, step=1 / RATE, unit="s"):
    """Write a wave of version 5: samples (n, channels), or (n, m, layers) for an image."""
    body = np.asarray(data, dtype="<f4").tobytes(order="F")
    names = b"".join(word(one) for one in ["", *labels])
    shape = [*data.shape, 0, 0][:4]
    head = struct.pack("<IIIihh6sh32siI", 0, 0, 0, data.size, 2, 0, b"", 1, word("gel"), 0, 0)
    head += (
        struct.pack("<4i4d4d", *shape, step, 1, 1, 1, 0, 0, 0, 0) + word("m", 4) + word(unit, 4) + bytes(12)
    )
    head = head.ljust(320, b"\0")
    sizes = [0, len(names), 0, 0]
    first = [320 + len(body), 0, len(note), 0, 0, 0, 0, 0, *sizes, 0, 0, 0]
    total = np.frombuffer(struct.pack("<hh15i", 5, 0, *first) + head, "<i2").sum(dtype=np.int64)
    check = (-int(total) + 2**15) % 2**16 - 2**15
    path.write_bytes(struct.pack("<hh15i", 5, check, *first) + head + body + note + names)
    return path


def a_wave(path, dwell=True, changes=None, **options):
    pytest.importorskip("igor2", reason="igor2, of the extra afm, is not installed")
    curve = ramp(2e4, dwell=dwell)
    _, z, d, ends = curve
    settings = {
        "Indexes": ",".join(map(str, [0, *ends])), "Direction": "NaN,1,0,-1,0," if dwell else "NaN,1,-1,0,",
        "XLVDT": 7e-6, "YLVDT": -2e-6,
    }  # fmt: skip
    note = noted(settings | (changes or {}))
    return curve, wave(path, np.stack([z, d, z], -1), ["Raw", "Defl", "ZSnsr"], note, **options)


@pytest.mark.parametrize("dwell", [True, False])
def test_a_wave_has_the_clock_that_it_states(tmp_path, dwell):
    curve, path = a_wave(tmp_path / "gel.ibw", dwell)
    data = fitting.read_force(path)
    same(data, curve)
    held = "100 samples/s in the dwell, dwell of 0.4 s, " if dwell else ""
    assert f"2000 samples/s, {held}approach at 4e-06 m/s, retract at 8e-06 m/s" in data.notes
    same(fitting.read_indentation(path), curve)  # which needs times
    place = force_curves.places(path)[0]
    assert (place.x, place.y) == (7e-6, -2e-6)


def test_a_clock_that_contradicts_itself_is_noted(tmp_path):
    """The step of the wave comes before NumPtsPerSec; a dwell is as long as its samples, a speed as the height changes."""
    _, path = a_wave(tmp_path / "gel.ibw", step=1e-3)
    data = fitting.read_force(path)
    assert data.t[100] == pytest.approx(0.1)
    assert any("1000 samples/s (2000 as NumPtsPerSec states)" in note for note in data.notes)
    # the rate of the ramp in the dwell too, where that is as long as the file states
    _, path = a_wave(tmp_path / "even.ibw", changes={"DwellTime": 40 / RATE})
    data = fitting.read_force(path)
    np.testing.assert_allclose(np.diff(data.t), 1 / RATE)
    assert any("2000 samples/s, dwell of 0.02 s, approach" in note for note in data.notes)
    _, path = a_wave(tmp_path / "off.ibw", changes={"UseDwellRate": 0, "ApproachVelocity": 3e-6})
    data = fitting.read_force(path)
    np.testing.assert_allclose(np.diff(data.t), 1 / RATE)
    text = "dwell of 0.02 s (0.4 s as the file states), approach at 4e-06 m/s (3e-06 m/s as the file states)"
    assert any(text in note for note in data.notes)
    _, path = a_wave(tmp_path / "none.ibw", changes={"NumPtsPerSec": "NaN"}, unit="m")
    with pytest.raises(ValueError, match=r"none.ibw: expected the step of the samples in s, or NumPtsPerSec"):
        fitting.read_force(path)
    # without segments in the note they are inferred, as for other files
    _, path = a_wave(tmp_path / "bare.ibw", dwell=False, changes={"Indexes": "", "Direction": ""})
    assert {"approach", "retract"} <= set(fitting.read_force(path).segments)


def test_waves_of_another_kind_are_refused_and_left_out_of_a_folder(tmp_path):
    pytest.importorskip("igor2", reason="igor2, of the extra afm, is not installed")
    path = wave(tmp_path / "scan.ibw", np.zeros((8, 8, 2)), ["Height"], noted({}))
    with pytest.raises(ValueError, match=r"scan.ibw: expected a force curve of Asylum, .* got an image"):
        fitting.read_force(path)
    _, good = a_wave(tmp_path / "gel.ibw")
    found, note = curves_in(str(tmp_path))
    assert found == [str(good)] and note.endswith(": scan.ibw")
    for cut in (1, 70, 500, 3000):
        (tmp_path / "cut.ibw").write_bytes(good.read_bytes()[:cut])
        with pytest.raises(ValueError, match="not an Igor binary wave, or one that is cut") as error:
            fitting.read_force(tmp_path / "cut.ibw")
        assert "\n" not in str(error.value)


def test_without_the_library_a_wave_says_what_to_install(tmp_path, monkeypatch):
    (tmp_path / "gel.ibw").write_bytes(b"\x05\x00")
    monkeypatch.setitem(sys.modules, "igor2", None)
    monkeypatch.setitem(sys.modules, "igor2.binarywave", None)
    with pytest.raises(ImportError, match=r"pip install 'jaxcontact\[afm\]'"):
        fitting.read_force(tmp_path / "gel.ibw")
