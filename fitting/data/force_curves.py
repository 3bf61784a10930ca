"""Reader of force curves of atomic force microscopes: of Bruker here, of Asylum by ``fitting.data.asylum``, of others by the
library afmformats, which is imported on first use."""

import importlib
import itertools
import logging
import math
import os
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fitting.data import asylum
from fitting.data.contact import UNTIMED, label, tip_depth
from fitting.data.table import SHEETS, is_data, read_lines, split
from jaxcontact._support.files import kept_until_changed

# Header of the files of NanoScope, the software of Bruker's microscopes (earlier Veeco and Digital Instruments).
#
# The header is text of lines that begin with a backslash and ends with Ctrl-Z. A line ``*NAME`` begins a section, and
# a section has parameters ``LABEL: VALUE``. A label may begin with ``@`` and the number of a group. The value is then
# one of
#
#     V [SENSITIVITY] (SCALE V/LSB) VALUE V,    V VALUE nm/V,    S [NAME] "title",
#
# where LSB is the unit of the stored integers, 16 bits of the whole range, and SENSITIVITY is the label of another
# parameter (NanoScope 8.10 User Guide, General Format for CIAO Parameter Objects).


# first lines of force curves, and of images without any
FORCE, IMAGE = b"\\*Force file list", b"\\*File list"
LONGEST = 1 << 20  # bytes in which a header must end
PARAMETER = re.compile(r"\\@?(?:\d+:)?(?P<label>[^:]+):(?P<value>.*)")
NUMBER = r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?"
SCALE = re.compile(rf"\[(?P<sensitivity>[^\]]*)\]\s*\((?P<scale>{NUMBER})")
LAST = re.compile(rf"(?P<number>{NUMBER})\s*(?P<unit>\S*)\s*$")
METRES = {
    "": 1e-9,
    "nm": 1e-9,
    "pm": 1e-12,
    "um": 1e-6,
    "~m": 1e-6,
    "µm": 1e-6,
}  # nm where the unit is left out


class HeaderSection(NamedTuple):
    """A section: name, without the asterisk; values of its parameters by label, both in lower case."""

    name: str
    values: dict[str, str]

    def number(self, *labels: str) -> float | None:
        """Return the last number of the first parameter that the section has, or None."""
        found = self._last(*labels)
        return float(found["number"]) if found else None

    def metres(self, *labels: str) -> float | None:
        """Return a length [m], or a sensitivity [m/V], likewise."""
        found = self._last(*labels)
        unit = found["unit"].removesuffix("/v") if found else None
        return float(found["number"]) * METRES[unit] if found and unit in METRES else None

    def integers(self, label: str) -> list[int]:
        """Return the integers of a parameter, [] if the section does not have it."""
        return [int(text) for text in re.findall(r"\d+", self.values.get(label, ""))]

    def scale(self, label: str) -> tuple[float, str] | None:
        """Return the volts of an LSB and the label of the sensitivity, or None."""
        found = SCALE.search(self.values.get(label, ""))
        return (float(found["scale"]), found["sensitivity"]) if found else None

    def _last(self, *labels: str) -> re.Match | None:
        texts = [self.values[label] for label in labels if label in self.values]
        return LAST.search(texts[0]) if texts else None


class ScopeHeader(NamedTuple):
    """The sections of a file in their order."""

    sections: list[HeaderSection]

    def all(self, name: str) -> list[HeaderSection]:
        """Return the sections of a name."""
        return [section for section in self.sections if section.name == name]

    def one(self, name: str) -> HeaderSection:
        """Return the first section of a name, an empty one if there is none."""
        return next(iter(self.all(name)), HeaderSection(name, {}))

    def sensitivity(self, label: str) -> float | None:
        """Return a sensitivity [m/V], or None."""
        found = (
            section.metres(label.lower()) for section in self.sections if label.lower() in section.values
        )
        return next(found, None)


def is_nanoscope(name: str) -> bool:
    """Return whether a file begins like one of NanoScope."""
    return first_line(name).startswith((FORCE, IMAGE))


def first_line(name: str) -> bytes:
    """Return the first line of a file, at most 80 bytes of it, b"" if it cannot be read."""
    try:
        with open(name, "rb") as file:
            return file.readline(80)
    except OSError:
        return b""


def read_header(name: str) -> ScopeHeader:
    """Return the header of a file; ValueError where it does not end."""
    with open(name, "rb") as file:
        raw = file.read(LONGEST)
    end = raw.find(b"\x1a")
    if end < 0:
        raise ValueError(
            f"{name}: expected a header of NanoScope that ends with Ctrl-Z, got none: the file is cut"
        )
    sections: list[HeaderSection] = []
    for line in raw[:end].decode("latin-1").splitlines():
        if line.startswith("\\*"):
            sections.append(HeaderSection(line[2:].strip().lower(), {}))
        elif sections and (found := PARAMETER.match(line)):
            sections[-1].values[found["label"].strip().lower()] = found["value"].strip().lower()
    return ScopeHeader(sections)


# Choice among the curves of a file of a microscope, and their places.


class Place(NamedTuple):
    """Place of a curve in its file: position from 0, and coordinates of the scanner [m], nan where the file has none."""

    curve: int
    x: float
    y: float


def chosen(name: str, count: int, curve: int | str | None) -> int:
    """Return the position of the chosen curve; ValueError for several curves and no choice, or one that is not there."""
    if curve is None and count != 1:
        raise ValueError(f"{name}: expected one curve, got {count}: choose with curve= from 0 to {count - 1}")
    if curve is not None and not (isinstance(curve, int) and 0 <= curve < count):
        raise ValueError(f"{name}: curve: expected 0 to {count - 1}, got {curve!r}")
    return curve or 0


# Reader of the binary force curves and force volumes of Bruker's microscopes.
#
# The samples of a channel follow the header (``ScopeHeader``) at its "Data offset": little-endian integers of 2 or 4
# bytes, for each curve the approach and then the retraction, both from the turning point outwards. In volts and in
# metres they are
#
#     sample x scale [V/LSB],    sample x scale [V/LSB] x sensitivity [m/V],
#
# with the deflection times the spring constant as force. The height is that of the sensor, or else of the ramp, whose
# samples are equidistant.
#
# Sources: Bruker, help page "Force Volume Image File Format"; B. Pittenger (Bruker) on the scale of the height
# sensor, forum "The Nanoscale World", January 2012. The headers state 2 bytes also where a sample has 4, so the width
# follows from the length of the data. In files of version 9.2 a force volume has samples of 1/256 LSB and a single
# curve such of 1 LSB, which no parameter states; it follows from the range of the converter, 16 bits of 1 LSB. On
# both the largest deflection then agrees with the trigger threshold.


CHANNEL = "ciao force image list"
MISSING = (-(2**15), -(2**31))  # stored where no sample was taken
CONVERTER = 2**15  # largest sample of the 16 bits of the converter, in LSB
FINE = 256  # parts of an LSB in samples beyond that
CURVES = ("force", "force volume")  # operating modes that ramp the height; others oscillate
LEAST = 5  # least number of samples of a curve


class SampleChannel(NamedTuple):
    """Samples of a channel: raw (curves, n) integers; volts: of one of them; sensitivity: its label; notes."""

    raw: np.ndarray
    volts: float
    sensitivity: str
    notes: tuple[str, ...]


class ForceVolume(NamedTuple):
    """The curves of a file.

    deflection; height: None without a sensor; approach: number of its samples; header; columns: of a force volume.
    """

    deflection: SampleChannel
    height: SampleChannel | None
    approach: int
    header: ScopeHeader
    columns: int


def read_bruker(
    name: str, curve: int | str | None, spring_constant: float | None, sensitivity: float | None
) -> dict[str, Any]:
    """Return the fields of an ``IndentationData``.

    Args:
        name: of the file.
        curve: position, from 0, of one of several curves.
        spring_constant: [N/m], instead of the one in the file.
        sensitivity: of the deflection [m/V], likewise.

    Raises:
        ValueError: no such curves, or no spring constant or sensitivity.
    """
    curves = _load_bruker(name)
    place = chosen(name, len(curves.deflection.raw), curve)
    channel = curves.header.all(CHANNEL)[0]
    k = spring_constant or channel.number("spring constant") or 0.0
    s = sensitivity or curves.header.sensitivity(curves.deflection.sensitivity) or 0.0
    missing = [what for what, value in (("spring constant", k), ("sensitivity", s)) if not value]
    if missing:
        flags = " and ".join(f"{what.replace(' ', '_')}=" for what in missing)
        raise ValueError(f"{name}: the file does not state the {' and the '.join(missing)}: give {flags}")
    raw = curves.deflection.raw[place]
    # both parts begin at the turning point, so that the approach is stored backwards
    first, size = curves.approach, raw.size
    order = np.concatenate([np.arange(first)[::-1], np.arange(first, size)])
    # times of the samples from the speeds of the ramp, or else from its frequency
    force, ramp = curves.header.one("ciao force list"), channel.number("ramp size")
    half = 0.5 / (force.number("scan rate") or math.nan)
    speeds = [force.number(f"{way} vel.") for way in ("forward", "reverse")]
    there, back = (ramp / speed if ramp and speed else half for speed in speeds)
    t = np.append(there * np.arange(first) / first, there + back * np.arange(size - first) / (size - first))
    taken = ~np.isin(raw[order], MISSING)
    load = k * s * curves.deflection.volts * raw[order][taken].astype(float)
    height, source = _height(name, curves, place)
    depth, note = tip_depth(name, t[taken], load, height[order][taken], k)
    marks = np.where(np.arange(raw.size) < curves.approach, "approach", "retract")[taken]
    lost = raw.size - int(taken.sum())
    notes = (
        f"force curve of NanoScope, sensitivity of the deflection {1e9 * s:.4g} nm/V",
        note,
        source,
        *curves.deflection.notes,
    )
    notes += (f"{lost} samples that were not taken left out",) if lost else ()
    return {"t": t[taken], "load": load, "depth": depth, "marks": marks, "notes": notes}


def bruker_places(name: str) -> list[Place]:
    """Return the places of the curves: of a force volume in rows in the order in which they are stored."""
    curves = _load_bruker(name)
    scan = curves.header.one("ciao scan list")
    x, y = (scan.metres(f"{axis} offset") for axis in "xy")
    x, y = (math.nan if value is None else value for value in (x, y))
    count, columns = len(curves.deflection.raw), curves.columns
    step = (scan.metres("scan size") or math.nan) / columns if count > 1 else 0.0
    return [Place(k, x + step * (k % columns), y + step * (k // columns)) for k in range(count)]


@kept_until_changed
def _load_bruker(name: str) -> ForceVolume:
    """Return the curves of a file; the last files are kept."""
    if first_line(name).startswith(IMAGE):
        raise ValueError(f"{name}: expected force curves, got an image of NanoScope")
    header = read_header(name)
    mode = header.one("ciao scan list").values.get("operating mode", CURVES[0])
    if mode not in CURVES:
        raise ValueError(
            f"{name}: expected a force curve or a force volume, got the operating mode {mode!r}, such as of a PeakForce"
            " capture, whose height oscillates and is not stored: export its curves as text"
        )
    columns, rows = 1, 1
    if mode == CURVES[1]:  # a force volume
        image, scan = header.one("ciao image list"), header.one("ciao scan list")
        columns = (image.integers("samps/line") or scan.integers("samps/line") or [1])[0]
        rows = (image.integers("number of lines") or scan.integers("lines") or [1])[0]
    deflection, sensor = (
        next((one for one in header.all(CHANNEL) if word in one.values.get("image data", "")), None)
        for word in ("deflection", "height sensor")
    )
    if deflection is None:
        found = [one.values.get("image data", "?").split('"')[-2:][0] for one in header.all(CHANNEL)]
        raise ValueError(
            f"{name}: expected a channel of the deflection, got {', '.join(found) or 'no channel'}"
        )
    samples = deflection.integers("samps/line")
    per_curve = sum(samples) if len(samples) > 1 else 2 * sum(samples)
    bent = _channel(name, deflection, columns * rows, per_curve)
    height = _channel(name, sensor, columns * rows, per_curve) if sensor else None
    # The samples of the approach: files state two numbers in an order that differs among descriptions. Both parts begin at
    # the turning point, so that the deflection jumps where the second begins.
    raw = bent.raw[0]
    jump = lambda first: abs(float(raw[first]) - float(raw[first - 1])) if 0 < first < raw.size else -1.0
    return ForceVolume(bent, height, max(samples[:2], key=jump), header, columns)


def _channel(name: str, section: HeaderSection, count: int, samples: int) -> SampleChannel:
    """Return the samples of a channel of ``count`` curves of this number of samples."""
    offset, length = (int(section.number(f"data {word}") or 0) for word in ("offset", "length"))
    scale = section.scale("z scale")
    width = length / max(count * samples, 1)
    if width not in (2, 4) or samples < LEAST or scale is None:
        raise ValueError(
            f"{name}: expected 2 or 4 bytes for each of {count} x {samples} samples of approach and retraction (a hold"
            f" between them is not read), and a scale in V/LSB; got {length} bytes and {section.values.get('z scale')!r}"
        )
    if Path(name).stat().st_size < offset + length:
        raise ValueError(
            f"{name}: expected {offset + length} bytes, got {Path(name).stat().st_size}: the file is cut"
        )
    raw = np.memmap(name, f"<i{width:.0f}", "r", offset, (count, samples))
    largest = np.abs(np.where(np.isin(raw, MISSING), 0, raw)).max()
    if largest <= CONVERTER:
        return SampleChannel(raw, *scale, ())
    note = f"samples taken as 1/{FINE} LSB, since they exceed the 16 bits of the converter"
    return SampleChannel(raw, scale[0] / FINE, scale[1], (note,))


def _height(name: str, curves: ForceVolume, place: int) -> tuple[np.ndarray, str]:
    """Return the height of the base (n,) [m] in the order of the file, and a note on its source."""
    size, first = curves.deflection.raw.shape[1], curves.approach
    section = curves.header.all(CHANNEL)[0]
    volts, found = (
        section.number("ramp size", "z scan size"),
        section.scale("ramp size") or section.scale("z scan size"),
    )
    per_volt = curves.header.sensitivity(found[1]) if found else None
    ramp = volts * per_volt if volts and per_volt else None
    if curves.height is not None and (sensor := curves.header.sensitivity(curves.height.sensitivity)):
        height = sensor * curves.height.volts * curves.height.raw[place].astype(float)
        stated = f"; the ramp is {ramp:.4g} m" if ramp else ""
        return height, f"height from the sensor, over {np.ptp(height):.4g} m{stated}"
    if ramp is None:
        raise ValueError(f"{name}: expected a height sensor or the size of the ramp, got neither")
    parts = [np.arange(first) / first, np.arange(size - first) / (size - first)]
    return -ramp * np.concatenate(parts), f"height from the ramp of {ramp:.4g} m"


ASYLUM = (".ibw", ".ardf")
SUFFIXES = (".jpk-force", ".jpk-force-map", ".jpk-qi-data", ".jpk-qi-series", ".h5", ".hdf5", *ASYLUM)
HEADS = (b"Force-Distance Curve", b"# afmformats")  # first lines of files of AFM Workshop and of afmformats


def is_force_curve(path: str | os.PathLike) -> bool:
    """Return whether the file name ends like that of a force curve, or the file begins like one of Bruker."""
    return os.fspath(path).lower().endswith(SUFFIXES) or is_nanoscope(os.fspath(path))


def is_force_text(path: str | os.PathLike) -> bool:
    """Return whether a text file is a force curve of AFM Workshop or afmformats, whose first lines are ``HEADS``."""
    name = os.fspath(path)
    return name.lower().endswith((".csv", ".tab")) and first_line(name).strip().startswith(HEADS)


def read(
    path: str | os.PathLike, curve: int | str | None, spring_constant: float | None,
    sensitivity: float | None = None, untimed: bool = False,
) -> dict[str, Any]:  # fmt: skip
    """Return the fields of an ``IndentationData``: depth from the tip position, or from height and load.

    Args:
        path: a file of JPK, Asylum (Igor, ARDF), HDF5 or Bruker.
        curve: position, from 0, of one of several curves.
        spring_constant: [N/m], where the file does not state it.
        sensitivity: of the deflection [m/V], likewise.
        untimed: whether a curve without times is accepted; its points are then numbered.

    Raises:
        ImportError: afmformats, or igor2, is not installed; the message says what to install.
        ValueError: not such a file, no times, or several curves and no choice.
    """
    name = os.fspath(path)
    if not Path(name).is_file():
        raise ValueError(f"{name}: cannot be read: expected a file")
    if is_nanoscope(name):
        return read_bruker(name, curve, spring_constant, sensitivity)
    if name.lower().endswith(ASYLUM):
        place = chosen(name, len(asylum.load_asylum(name).places), curve)
        return asylum.read_asylum(name, place, spring_constant, sensitivity)
    curves = _load(name, spring_constant, sensitivity)
    data = curves[chosen(name, len(curves), curve)]
    if "time" not in data and not untimed:
        raise ValueError(
            f"{name}: expected times, got {sorted(data.columns)}: take load and depth from afmformats "
            "and make IndentationData(t=..., load=..., depth=...)"
        )
    load = np.asarray(data["force"], dtype=float)
    t = np.asarray(data["time"], dtype=float) if "time" in data else np.arange(load.size, dtype=float)
    notes = () if "time" in data else (UNTIMED,)
    k = data.metadata.get("spring constant", spring_constant)
    if "tip position" in data:
        depth, note = -np.asarray(data["tip position"], dtype=float), "depth from the tip position"
    else:
        height = next(key for key in ("height (measured)", "height (piezo)") if key in data)
        depth, note = tip_depth(name, t, load, np.asarray(data[height], dtype=float), k)
    segments = [str(mark) for mark in data["segment"]] if "segment" in data else None
    marks = None if segments is None else label(segments, load, depth)
    return {
        "t": t,
        "load": load,
        "depth": depth,
        "marks": marks,
        "notes": (f"{data.modality} curve by afmformats", note, *notes),
        "numbered": "time" not in data,
    }


def places(path: str | os.PathLike) -> list[Place]:
    """Return the curves of a file with their places; one curve for a text file."""
    name = os.fspath(path)
    if is_nanoscope(name):
        return bruker_places(name)
    if name.lower().endswith(ASYLUM):
        return [Place(k, *one) for k, one in enumerate(asylum.load_asylum(name).places)]
    if not (is_force_curve(name) or is_force_text(name)):
        return [Place(0, math.nan, math.nan)]
    known = [one.metadata for one in _load(name, None, None)]
    of = lambda metadata, key: float(metadata.get(key, math.nan))
    return [Place(k, of(one, "position x"), of(one, "position y")) for k, one in enumerate(known)]


@kept_until_changed
def _load(name: str, spring_constant: float | None, sensitivity: float | None) -> Any:
    """Return the curves of a file; the last files are kept."""
    try:
        library = importlib.import_module("afmformats")
    except ImportError:
        raise ImportError(
            f"{name}: force curves of microscopes need afmformats: pip install 'jaxcontact[afm]'"
        ) from None
    # its own errors do not derive from Exception, and its formats raise various others
    errors = (Exception, library.errors.AFMFileFormatError, library.errors.MissingMetaDataError)
    known = {"spring constant": spring_constant, "sensitivity": sensitivity}
    given = {key: value for key, value in known.items() if value is not None}
    # the library reports with a traceback what is raised here in one line
    speaker = logging.getLogger("afmformats.formats")
    silent, speaker.disabled = speaker.disabled, True
    try:
        return library.load_data(name, meta_override=given or None)
    except errors as error:
        if missing := [key for key in known if key in getattr(error, "meta_keys", ())]:
            flags = " and ".join(f"{key.replace(' ', '_')}=" for key in missing)
            raise ValueError(
                f"{name}: the file does not state the {' and the '.join(missing)}: give {flags}"
            ) from None
        what = (str(error) or type(error).__name__).splitlines()[0][:200]
        raise ValueError(f"{name}: afmformats cannot read it: {what}") from None
    finally:
        speaker.disabled = silent


# The files of a folder that may hold curves.


ROWS = 2  # rows of numbers from which a text may be a curve
DIALECTS = tuple(itertools.product((None, ",", ";", "\t"), ".,"))
SHOWN = 5  # names of files in a note


def curves_in(folder: str) -> tuple[list[str], str]:
    """Return the files of a folder that may hold curves, by name, and a note on the others, "" if there are none.

    Raises:
        ValueError: no file that may hold a curve.
    """
    inside = sorted(one for one in Path(folder).iterdir() if one.is_file() and not one.name.startswith("."))
    found = [one for one in inside if may_hold_a_curve(one)]
    others = [one.name for one in inside if one not in found]
    shown = ", ".join(others[:SHOWN]) + (", ..." if len(others) > SHOWN else "")
    if not found:
        raise ValueError(f"{folder}: expected a folder with files of curves, got {shown or 'an empty one'}")
    what = "files without rows of numbers, and images, left out"
    return list(
        map(str, found)
    ), f"{folder}: {len(others)} of {len(inside)} {what}: {shown}" if others else ""


def may_hold_a_curve(path: Path) -> bool:
    """Return whether a file is a force curve of a microscope, a workbook, or text with rows of numbers."""
    if first_line(str(path)).startswith(IMAGE) or asylum.is_image(str(path)):
        return False
    if is_force_curve(path) or path.suffix.lower() in SHEETS:
        return True
    try:
        lines = read_lines(path)
    except ValueError:  # not text, or of another kind
        return False
    rows = (line for line in lines if any(is_data(split(line.text, mark), point) for mark, point in DIALECTS))
    return len(list(itertools.islice(rows, ROWS))) == ROWS
