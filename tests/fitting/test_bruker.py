"""Binary force curves of Bruker: files written here from known curves, byte by byte, and read back as moduli."""

import json

import numpy as np
import pytest

import fitting
import jaxcontact as jc
from fitting.data import force_curves
from fitting.data.contact import ForceCurve
from fitting.data.force_curves import curves_in
from jaxcontact.__main__ import main

K, SENSITIVITY, ZSENS, SENSOR = 0.2, 40e-9, 13e-9, 900e-9  # [N/m], [m/V]
LSB = 0.000375  # [V]
RAMP, REACH = 2e-6, 1.2e-6  # [m]: of the base, and its place at first contact
NU, HALF_ANGLE = 0.5, np.deg2rad(20.0)
OFFSET = 2048  # of the samples


def deflection(z, E):
    """Deflection of the lever [m] at places of its base, a cone on a half-space (Sneddon): k d = C (z - d)^2."""
    C = 2.0 / np.pi * np.tan(HALF_ANGLE) * E / (1.0 - NU**2)
    z = np.maximum(z, 0.0)
    return z + K / (2.0 * C) - np.sqrt((K / (2.0 * C)) ** 2 + z * K / C)


def branches(there, back):
    """Places of the base from the contact [m], as stored: approach and retraction, both from the turning point outwards."""
    return [RAMP - REACH - RAMP * np.arange(n) / n for n in (there, back)]


def channel(name, soft, scale, samples, stated, extra=""):
    return (
        f"\\*Ciao force image list\r\n\\Data offset: {{}}\r\n\\Data length: {samples.nbytes}\r\n\\Bytes/pixel: 2\r\n"
        f'\\Samps/line: {stated}\r\n\\Spring Constant: {K}\r\n\\@4:Image Data: S [X] "{name}"\r\n'
        f"\\@4:Z scale: V [{soft}] ({scale:.10f} V/LSB) 2.500000 V\r\n"
        f"\\@4:Ramp size: V [Sens. Zsens] (0.006713867 V/LSB) {RAMP / ZSENS:.4f} V\r\n{extra}"
    )


def write(path, channels, mode="Force", extra="", changes=()):
    """A file of channels (name, sensitivity, scale, samples, stated numbers of samples)."""
    head = (
        "\\*Force file list\r\n\\Version: 0x09200000\r\n\\*Scanner list\r\n"
        f"\\@Sens. Zsens: V {1e9 * ZSENS:.5f} nm/V\r\n\\*Ciao scan list\r\n\\Operating mode: {mode}\r\n"
        f"\\Scan Size: 2000 nm\r\n\\X Offset: -300 nm\r\n\\Y Offset: 50 nm\r\n{extra}"
        f"\\@Sens. DeflSens: V {1e9 * SENSITIVITY:.5f} nm/V\r\n\\@Sens. ZsensSens: V {1e9 * SENSOR:.4f} nm/V\r\n"
        "\\*Ciao force list\r\n\\Scan rate: 0.5\r\n"
        f"\\Forward vel.: {RAMP / ZSENS / 1.0:.5f}\r\n\\Reverse vel.: {RAMP / ZSENS / 0.5:.5f}\r\n"
    )
    place, body = OFFSET, b""
    for one in channels:
        head += channel(*one).format(place)
        body += one[3].tobytes()
        place += one[3].nbytes
    head += "\\*File list end\r\n"
    for old, new in changes:
        assert old in head
        head = head.replace(old, new)
    path.write_bytes(head.encode("latin-1").ljust(OFFSET - 1, b"\x1a") + b"\x1a" + body)
    return path


def volts(E, places):
    """Voltage of the detector, with an offset and noise of 5 pN."""
    noise = np.random.default_rng(0).standard_normal(places.size) * 5e-12 / K
    return (deflection(places, E) + noise) / SENSITIVITY + 0.3


def ramp(path, E=2e4, there=600, back=900, stated=None, **changes):
    """A single curve with samples of two bytes and the height of the ramp."""
    samples = np.round(volts(E, np.concatenate(branches(there, back))) / LSB).astype("<i2")
    stated = stated or f"{there} {back}"
    return write(path, [("Deflection Error", "Sens. DeflSens", LSB, samples, stated)], **changes)


@pytest.mark.parametrize("stated", ["600 900", "900 600"])
def test_a_ramp_becomes_a_modulus(tmp_path, stated):
    data = fitting.read_force(ramp(tmp_path / "gel.001", stated=stated))
    assert [int((data.segments == name).sum()) for name in ("approach", "retract")] == [600, 900]
    assert data.t[599:601] == pytest.approx([599 / 600, 1.0]) and data.t[-1] == pytest.approx(1.5, rel=1e-3)
    z = np.concatenate([branches(600, 900)[0][::-1], branches(600, 900)[1]])
    np.testing.assert_allclose(data.load, K * (deflection(z, 2e4) + 0.3 * SENSITIVITY), atol=3e-11)
    depth = z - deflection(z, 2e4)
    np.testing.assert_allclose(data.depth - data.depth[0], depth - depth[0], atol=3e-10)
    fit = fitting.fit_force(data, indenter=jc.Cone(HALF_ANGLE), nu=NU)
    assert not fit.refused and fit.youngs_modulus[0] == pytest.approx(2e4, rel=5e-3)
    assert any("height from the ramp of 2e-06 m" in note for note in data.notes)


def volume(path):
    """A force volume of 2 x 1 curves: samples of four bytes, 1/256 LSB of the deflection, and a height sensor."""
    places = np.concatenate(branches(500, 500))
    raw = np.stack([np.round(256 * volts(E, places) / LSB) for E in (1e4, 3e4)]).astype("<i4")
    raw[:, 499] = -(2**31)  # the first sample in time was not taken
    height = np.stack([np.round(places / SENSOR / LSB)] * 2).astype("<i4")
    channels = [
        ("Deflection Error", "Sens. DeflSens", LSB, raw, "500 500"),
        ("Height Sensor", "Sens. ZsensSens", LSB, height, "500 500"),
    ]
    return write(path, channels, mode="Force Volume", extra="\\Samps/line: 2\r\n\\Lines: 1\r\n")


def test_the_curves_of_a_force_volume_have_places_and_heights_of_the_sensor(tmp_path):
    path = volume(tmp_path / "map.spm")
    with pytest.raises(ValueError, match="got 2: choose with curve= from 0 to 1"):
        fitting.read_force(path)
    assert [one.curve for one in force_curves.places(path)] == [0, 1]
    np.testing.assert_allclose(
        [(one.x, one.y) for one in force_curves.places(path)], [(-3e-7, 5e-8), (7e-7, 5e-8)]
    )
    for k, E in enumerate((1e4, 3e4)):
        data = fitting.read_force(path, curve=k)
        assert data.t.size == 999
        z = np.concatenate([branches(500, 500)[0][:-1][::-1], branches(500, 500)[1]])
        np.testing.assert_allclose(data.load, K * (deflection(z, E) + 0.3 * SENSITIVITY), atol=3e-11)
        depth = z - deflection(z, E)
        np.testing.assert_allclose(data.depth - data.depth[0], depth - depth[0], atol=5e-10)
        assert any("1/256 LSB" in note for note in data.notes)
        assert any(
            "height from the sensor, over 1.996e-06 m; the ramp is 2e-06 m" in note for note in data.notes
        )


def test_given_constants_come_before_those_of_the_file(tmp_path):
    path = ramp(tmp_path / "gel.001")
    usual = fitting.read_force(path)
    other = fitting.read_force(path, spring_constant=2 * K, sensitivity=1.5 * SENSITIVITY)
    np.testing.assert_allclose(other.load, 3.0 * usual.load)
    with pytest.raises(ValueError, match="does not state the spring constant: give spring_constant="):
        fitting.read_force(
            ramp(tmp_path / "gel.002", changes=[(f"Spring Constant: {K}", "Spring Constant: 0")])
        )


@pytest.mark.parametrize(
    "changes, message",
    [
        ([("*Force file list", "*File list")], "expected force curves, got an image of NanoScope"),
        ([("mode: Force", "mode: Image")], "PeakForce capture"),
        ([("length: 3000", "length: 3400")], "a hold between them is not read"),
        ([("offset: 2048", "offset: 2050")], "expected 5050 bytes, got 5048: the file is cut"),
        ([("Deflection Error", "Friction")], "expected a channel of the deflection, got friction"),
        ([("Ramp size", "Ramp")], "expected a height sensor or the size of the ramp"),
    ],
)
def test_other_files_are_refused_in_one_line(tmp_path, changes, message):
    with pytest.raises(ValueError, match=message) as error:
        fitting.read_force(ramp(tmp_path / "gel.spm", changes=changes))
    assert "\n" not in str(error.value) and "gel.spm" in str(error.value)


def test_the_sign_of_the_load_on_a_stiff_sample_is_that_of_the_last_push():
    """The tip snaps in by 5 nm and then stands, while a sensitivity that is too large reduces the apparent depth."""
    depth = np.concatenate([np.linspace(0, 4e-7, 500), np.linspace(4.05e-7, 4e-7, 100)])
    load = np.concatenate([np.zeros(500), np.linspace(-1e-9, 9e-9, 100)])
    marks = np.full(600, "approach")
    data = fitting.IndentationData(t=np.arange(600.0), load=load, depth=depth, marks=marks)
    found = ForceCurve.approach(data)
    assert found.load[-1] == -1e-9 and not any("load" in note for note in found.notes)


def test_the_command_takes_a_file_to_a_modulus(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ramp(tmp_path / "gel.001")
    assert main(["fit", "force", "gel.001", "--cone", "20"]) == 0
    assert "verdict: accepted" in capsys.readouterr().out
    assert main(["fit", "force", "gel.001", "--column", "t=a", "-o", "other"]) != 0
    assert "--column, --unit, --decimal: expected none for a force curve" in capsys.readouterr().err
    found = json.loads((tmp_path / "gel-fit" / "summary.json").read_text())
    assert found["youngs_modulus_Pa"]["value"] == pytest.approx(2e4, rel=5e-3)


def test_images_in_a_folder_are_left_out(tmp_path):
    ramp(tmp_path / "gel.001")
    ramp(tmp_path / "scan.002", changes=[("*Force file list", "*File list")])
    found, note = curves_in(str(tmp_path))
    assert found == [str(tmp_path / "gel.001")] and "1 of 2 files" in note and note.endswith(": scan.002")


def test_the_names_of_older_versions_are_known(tmp_path):
    """One number of samples for both parts, other names of sensitivities, and times from the frequency of the ramp."""
    older = [("Sens. DeflSens", "Sens. Deflection"), ("Sens. Zsens:", "Sens. Zscan:")]
    older += [("[Sens. Zsens]", "[Sens. Zscan]"), ("Forward vel.", "Way"), ("Reverse vel.", "Back")]
    old = fitting.read_force(ramp(tmp_path / "old.000", back=600, stated="600", changes=older))
    new = fitting.read_force(ramp(tmp_path / "new.000", back=600))
    np.testing.assert_allclose([old.load, old.depth], [new.load, new.depth], rtol=1e-12)
    assert old.t[600] == pytest.approx(1.0) and old.t[-1] == pytest.approx(2.0, rel=2e-3)
