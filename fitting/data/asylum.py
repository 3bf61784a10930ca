"""Force curves of Asylum Research's microscopes: single curves in Igor binary waves (.ibw), and maps in ARDF files.

Both kinds hold the same: channels of samples at equal times (ZSnsr or Raw, the place of the base; Defl, the deflection), the
last sample of each segment, and a note of lines "name: value" with calibration, clock and place. Waves are opened by the
library igor2, ARDF files here.

**Clock.** Samples are a step apart that the file states (the scale of the wave; the third dimension of the map), which is
1/NumPtsPerSec; a dwell at the surface may be sampled at a rate of its own (UseDwellRate, DwellRate). With n samples in the
approach, m in the dwell and the steps s and s',

    t_i = i s (approach),    n s + (i - n) s' (dwell),    n s + m s' + (i - n - m) s (retraction).

**Place.** A map states the step between its points, scan size / (points - 1), and for each curve its line and point, counted
in space from the lower left corner, whatever the direction of the scan. A wave states the place of the scanner.

Sources: the layout of ARDF files as found by M. Poss, "ARDF to Matlab" (MATLAB Central File Exchange 80212, 2018), and by
R. J. Sheridan, magic-afm; the meaning of the segments and of the rates from Asylum's procedures for Igor (ForcePlot).
"""

import importlib
import itertools
import math
import mmap
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fitting.data.contact import tip_depth
from jaxcontact._support.files import kept_until_changed

METRES = {"m": 1.0, "um": 1e-6, "µm": 1e-6, "nm": 1e-9, "pm": 1e-12}
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}
HEIGHTS = ("ZSnsr", "ZSensor", "LVDT", "Raw", "Height")  # the sensor before the drive
DEFLECTIONS = ("Defl", "Deflection")
TOWARDS, BACK = ("ext", "1"), ("ret", "-1")  # names of segments in maps begin so; directions in waves
# relative differences of speeds and dwells, and of rates, above which a note has what is stated
AGREE, SAME = 0.1, 0.02
FEWEST = 5  # samples of a ramp


class Recording(NamedTuple):
    """A file of Asylum.

    path; note: its settings by name; step: between samples [s]; segments: their names in time; places: (x, y) of each curve
    [m]; curve: position -> (samples (n,) by channel and their unit, last sample of each segment after a leading 0); notes.
    """

    path: str
    note: dict[str, str]
    step: float
    segments: tuple[str, ...]
    places: list[tuple[float, float]]
    curve: Callable[[int], tuple[dict[str, tuple[np.ndarray, str]], list[int]]]
    notes: tuple[str, ...] = ()

    def number(self, name: str) -> float:
        """Return a number of the note, nan if there is none."""
        return stated(self.note, name)


def stated(note: dict[str, str], name: str) -> float:
    """Return a number of a note, nan if there is none."""
    try:
        return float(note[name])
    except (KeyError, ValueError):
        return math.nan


@kept_until_changed
def load_asylum(name: str) -> Recording:
    """Return the curves of a file; the last files are kept.

    Raises:
        ImportError: a wave without igor2; the message says what to install.
        ValueError: a file that is cut or damaged, or has no force curve.
    """
    return load_map(name) if name.lower().endswith(".ardf") else load_wave(name)


def read_asylum(
    name: str, place: int, spring_constant: float | None, sensitivity: float | None
) -> dict[str, Any]:
    """Return the fields of an ``IndentationData`` of the curve at a position.

    The segments before the approach and after the retraction (a dwell away from the sample) are left out.

    Args:
        name: of the file.
        place: position of the curve in the file.
        spring_constant: [N/m], instead of the one in the file.
        sensitivity: of the deflection [m/V], likewise.

    Raises:
        ValueError: no deflection or height, or no spring constant or sensitivity where it is needed.
    """
    file = load_asylum(name)
    samples, ends = file.curve(place)

    # force = k d; the file states d with its own sensitivity, or the volts of the detector
    deflection = next((samples[key] for key in DEFLECTIONS if key in samples), None)
    heights = [(key, *samples[key]) for key in HEIGHTS if key in samples and samples[key][1] in METRES]
    if deflection is None or not heights:
        raise ValueError(
            f"{name}: expected channels of the deflection (Defl) and of the height (ZSnsr or Raw) in m, got"
            f" {', '.join(f'{key} [{unit}]' for key, (_, unit) in samples.items()) or 'none'}"
        )
    bent, unit = deflection
    k, own = spring_constant or file.number("SpringConstant"), file.number("InvOLS")
    if unit in METRES:
        factor = METRES[unit] * (sensitivity / own if sensitivity else 1.0)
    elif unit == "V":
        factor = sensitivity or own
    else:
        raise ValueError(f"{name}: expected a deflection in m or V, got {unit!r}")
    missing = [
        what
        for what, value in (("spring_constant=", k), ("sensitivity=", factor))
        if not 0.0 < value < math.inf
    ]
    if missing == ["sensitivity="] and sensitivity:
        raise ValueError(f"{name}: sensitivity: expected a file that states its own InvOLS, got {own:g} m/V")
    if missing:
        what = " and the ".join(one.rstrip("=").replace("_", " ") for one in missing)
        raise ValueError(f"{name}: the file does not state the {what}: give {' and '.join(missing)}")
    channel, z, unit = heights[0]
    height, load = METRES[unit] * z.astype(float), k * factor * bent.astype(float)

    # what is between approach and retraction is a hold
    marks, found = np.full(load.size, "", "<U8"), segments_of(file.segments, ends, load.size)
    for kind, begin, end in found:
        marks[begin:end] = kind
    t, notes = clock(file, marks, height)
    if not found:
        marks[:] = "unknown"
    keep = (marks != "") & np.isfinite(load) & np.isfinite(height)
    if keep.sum() < FEWEST:
        raise ValueError(f"{name}: curve {place}: expected at least {FEWEST} samples, got {keep.sum()}")
    if not keep.all():
        notes += (
            f"{load.size - keep.sum()} samples that are away from the sample or were not taken left out",
        )
    depth, note = tip_depth(name, t[keep], load[keep], height[keep], k)
    return {
        "t": t[keep],
        "load": load[keep],
        "depth": depth,
        "marks": marks[keep] if found else None,
        "notes": (f"force curve of Asylum, height from {channel}", note, *notes, *file.notes),
    }


def segments_of(names: tuple[str, ...], ends: list[int], size: int) -> list[tuple[str, int, int]]:
    """Return (segment, begin, end) of approach, hold and retraction, [] where the file does not state them.

    ends: a leading 0 and the last sample of each segment.

    Example:
        >>> segments_of(("Ext", "Dwell", "Ret", "Away"), [0, 9, 14, 24, 30], 31)
        [('approach', 0, 10), ('hold', 10, 15), ('retract', 15, 25)]
    """
    bounds = [0, *(one + 1 for one in ends[1:])]
    names = tuple(one.strip().lower() for one in names[: len(bounds) - 1])
    there = [k for k, one in enumerate(names) if one.startswith(TOWARDS)]
    back = [k for k, one in enumerate(names) if one.startswith(BACK)]
    if not there or any(high <= low for low, high in itertools.pairwise(bounds)) or bounds[-1] > size:
        return []
    last = next((k for k in back if k > there[0]), len(names))
    kinds = {k: "hold" for k in range(there[0] + 1, last)} | {there[0]: "approach"}
    kinds |= {k: "retract" for k in back}
    return [(kinds[k], bounds[k], bounds[k + 1]) for k in sorted(kinds)]


def clock(file: Recording, marks: np.ndarray, height: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the times of all samples (n,) [s], and notes on what the file states of its clock.

    marks: segment of each sample; height: of the base (n,) [m].
    """
    rate, held = file.number("NumPtsPerSec"), marks == "hold"
    step = file.step if 0.0 < file.step < math.inf else 1.0 / rate if rate > 0.0 else math.nan
    if not step > 0.0:
        raise ValueError(
            f"{file.path}: expected the step of the samples in s, or NumPtsPerSec in the note, got neither"
        )
    own = not abs(step * rate - 1.0) <= SAME  # a recording with settings of its own, such as a fast map
    notes = [f"{1.0 / step:g} samples/s"]
    if own and rate > 0.0:
        notes[0] += f" ({rate:g} as NumPtsPerSec states)"

    # a dwell is sampled at its own rate where the file says so and this agrees better with the dwell that it states
    dwell, slow = file.number("DwellTime"), 1.0 / (file.number("DwellRate") or math.nan)
    of_hold = step
    if held.any() and file.number("UseDwellRate") == 1.0 and slow > 0.0:
        off = lambda s: abs(math.log(held.sum() * s / dwell)) if dwell > 0.0 else 0.0
        of_hold = min((slow, step), key=off)
        if of_hold != step:
            notes.append(f"{1.0 / slow:g} samples/s in the dwell")
    steps = np.where(held, of_hold, step)
    t = np.concatenate([[0.0], np.cumsum(steps)[:-1]])
    if held.any():
        lasts = held.sum() * of_hold
        notes.append(f"dwell of {lasts:.4g} s")
        if abs(lasts - dwell) > max(AGREE * dwell, 2 * of_hold):
            notes[-1] += f" ({dwell:g} s as the file states)"

    # ramp rates, as measured and as stated
    same = file.number("VelocitySynch") == 1.0
    for kind, setting in (("approach", "ApproachVelocity"), ("retract", "RetractVelocity")):
        some = np.flatnonzero((marks == kind) & np.isfinite(height))
        if own or some.size < FEWEST:
            continue
        speed = abs(height[some[-1]] - height[some[0]]) / (t[some[-1]] - t[some[0]])
        set_to = file.number("Velocity" if same else setting)
        notes.append(f"{kind} at {speed:.3g} m/s")
        if abs(speed - set_to) > AGREE * set_to:
            notes[-1] += f" ({set_to:.3g} m/s as the file states)"
    return t, (", ".join(notes),)


# Waves of Igor. The note is text with carriage returns, channels are the labels of the second dimension, and
#
#     Indexes: 0,1008,2015    Direction: NaN,1,-1
#
# are the last samples of the segments, with 1 towards the sample, 0 at rest and -1 back.


def is_image(name: str) -> bool:
    """Return whether a file is a wave with three dimensions: an image of Asylum has its channels as layers."""
    try:
        with open(name, "rb") as file:
            head = file.read(148)
    except OSError:
        return False
    # version 5, then the sizes of the four dimensions, in the header of the wave behind 64 bytes of that of the file
    return len(head) == 148 and head[:2] == b"\x05\x00" and struct.unpack("<4i", head[132:148])[2] > 0


def load_wave(name: str) -> Recording:
    """Return the curve of an Igor binary wave."""
    try:
        library = importlib.import_module("igor2.binarywave")
    except ImportError:
        raise ImportError(f"{name}: Igor's files need igor2: pip install 'jaxcontact[afm]'") from None
    try:
        wave = library.load(name)["wave"]
    except Exception as error:  # igor2 raises various kinds
        what = (str(error) or type(error).__name__).splitlines()[0][:200]
        raise ValueError(f"{name}: not an Igor binary wave, or one that is cut: {what}") from None
    data, head = np.asarray(wave["wData"]), wave["wave_header"]
    labels = [one.decode("latin-1") for one in wave.get("labels", [[], []])[1] if one]
    if data.ndim != 2 or len(labels) != data.shape[1]:
        what = "an image" if data.ndim == 3 else f"a wave of shape {data.shape} with {len(labels)} labels"
        raise ValueError(
            f"{name}: expected a force curve of Asylum, samples by channels with labels, got {what}"
        )
    note = parsed(bytes(wave["note"]))
    units = lambda key: [b"".join(one).decode("latin-1") for one in np.atleast_2d(head.get(key, [[b""]]))]
    step = float(np.atleast_1d(head["sfA"])[0]) * SECONDS.get(units("dimUnits")[0], math.nan)
    unit = units("dataUnits")[0] or "m"
    ends = [int(one) for one in note.get("Indexes", "").split(",") if one.strip()]
    names = tuple(one.strip() for one in note.get("Direction", "").split(",")[1:] if one.strip())
    samples = {label: (data[:, k], unit) for k, label in enumerate(labels)}
    place = stated(note, "XLVDT"), stated(note, "YLVDT")
    return Recording(name, note, step, names, [place], lambda _: (samples, ends))


def parsed(text: bytes) -> dict[str, str]:
    """Return the settings of a note."""
    lines = text.decode("windows-1252", "replace").replace("\r", "\n").split("\n")
    return {line.split(":", 1)[0].strip(): line.split(":", 1)[1].strip() for line in lines if ":" in line}


# ARDF files. A file is made of chunks, little-endian:
#
#     crc32 (of the rest of the chunk), size (with this head of 16 bytes), name (4 letters), flags
#
# A table is a chunk of 32 bytes that states the size of the whole table and the number and size of its entries, which follow
# and are chunks themselves, with zeros where they are not used. The order is
#
#     ARDF, FTOC (IMAG and VOLM: offsets of images and maps), TTOC (TOFF: offsets of TEXT, the note), images,
#     VOLM (NSET), TTOC, VDEF (size and steps of the scan), VCHN of each channel, XDEF, VTOC (VOFF of each line: the offset
#     of its first curve), MLOV, and for each curve VSET (line, point, offset of the next curve), VNAM, VDAT of each channel.


HEAD, TABLE, ENTRY = struct.Struct("<II4sI"), struct.Struct("<QII"), struct.Struct("<Q")
DEFINITION = struct.Struct("<II24x3d32s32s32s32s")  # points, lines; steps of x, y, t with units; segments
CHANNEL = struct.Struct("<32s32s")  # name, unit
LINE = struct.Struct("<IIQQ")  # number of the curve, line, point, offset
# number of the curve, line, point, kind (trace, retrace), offsets before and after
CURVE = struct.Struct("<IIIIQQ")
# number of the curve, line, point, count, channel; last samples of the segments
SAMPLES = struct.Struct("<5I5i")


class Chunk(NamedTuple):
    """A chunk: name; begin and end of what follows its head."""

    name: str
    begin: int
    end: int


class Pieces(NamedTuple):
    """The chunks of a file: path for messages; raw: its bytes."""

    path: str
    raw: mmap.mmap

    def chunk(self, at: int, *names: str, check_sum: bool = True) -> Chunk:
        """Return the chunk at an offset; ValueError if it is cut, damaged, or none of the names."""
        if at + HEAD.size > len(self.raw):
            raise self._cut(at + HEAD.size)
        crc, size, letters, _ = HEAD.unpack_from(self.raw, at)
        name = letters.decode("latin-1")
        if names and name not in names:
            raise ValueError(
                f"{self.path}: byte {at}: expected {' or '.join(names)} of an ARDF file, got {name!r}: not of this kind, or"
                " damaged"
            )
        if at + size > len(self.raw):
            raise self._cut(at + size)
        if size < HEAD.size or (check_sum and crc != zlib.crc32(self.raw[at + 4 : at + size])):
            raise ValueError(
                f"{self.path}: byte {at}: the check sum of {name} does not agree: the file is damaged"
            )
        return Chunk(name, at + HEAD.size, at + size)

    def fields(self, layout: struct.Struct, one: Chunk) -> tuple[Any, ...]:
        """Return the numbers at the begin of a chunk."""
        if one.begin + layout.size > one.end:
            raise ValueError(
                f"{self.path}: {one.name}: expected {layout.size} bytes, got {one.end - one.begin}"
            )
        return layout.unpack_from(self.raw, one.begin)

    def table(self, at: int, *names: str, check_sum: bool = True) -> tuple[list[tuple[Chunk, int]], int]:
        """Return the used entries of a table with their offsets in the file, and the end of the table."""
        size, count, stride = self.fields(TABLE, self.chunk(at, *names, check_sum=check_sum))
        first = at + HEAD.size + TABLE.size
        if first + count * stride > at + size or at + size > len(self.raw) or (count and stride < HEAD.size):
            raise self._cut(max(first + count * stride, at + size))
        places = range(first, first + count * stride, stride or 1)
        used = [place for place in places if any(self.raw[place : place + HEAD.size])]
        return [(self.chunk(place), place) for place in used], at + size

    def _cut(self, needed: int) -> ValueError:
        return ValueError(
            f"{self.path}: expected {needed} bytes, got {len(self.raw)}: the file is cut or damaged"
        )


def text_of(raw: bytes) -> str:
    return raw.split(b"\0")[0].decode("windows-1252", "replace").strip()


def load_map(name: str) -> Recording:
    """Return the curves of an ARDF file, of its first map, by line and point; their samples are read one by one."""
    with open(name, "rb") as file:
        if Path(name).stat().st_size < HEAD.size:
            raise ValueError(f"{name}: expected an ARDF file, got {Path(name).stat().st_size} bytes")
        pieces = Pieces(name, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    contents, end = pieces.table(pieces.chunk(0, "ARDF").end, "FTOC")
    texts, _ = pieces.table(end, "TTOC")
    note: dict[str, str] = {}
    for one, _ in texts:
        text = pieces.chunk(pieces.fields(struct.Struct("<QQ"), one)[1], "TEXT")
        _, length = pieces.fields(struct.Struct("<II"), text)
        note |= parsed(pieces.raw[text.begin + 8 : min(text.begin + 8 + length, text.end)])
    maps = [pieces.fields(ENTRY, one)[0] for one, _ in contents if one.name == "VOLM"]
    if not maps:
        raise ValueError(f"{name}: expected a map of force curves, got images alone")

    # The definition of the map, and the offset of the first curve of each line; zero where the scan was stopped before.
    _, at = pieces.table(maps[0], "VOLM")
    _, at = pieces.table(at, "TTOC")
    definition: tuple[Any, ...] | None = None
    channels: list[tuple[str, str]] = []
    lines: list[int] = []
    while (one := pieces.chunk(at, check_sum=False)).name != "MLOV":
        if one.name == "VTOC":
            # its own sum is not kept up to date while lines are added, that of an entry is
            entries, at = pieces.table(at, "VTOC", check_sum=False)
            lines = [offset for entry, _ in entries if (offset := pieces.fields(LINE, entry)[3])]
            continue
        one = pieces.chunk(at)
        if one.name == "VDEF":
            definition = pieces.fields(DEFINITION, one)
        elif one.name == "VCHN":
            channels.append(tuple(map(text_of, pieces.fields(CHANNEL, one))))
        at = one.end
    if definition is None:
        raise ValueError(f"{name}: expected the definition (VDEF) of the map, got none")
    points, rows, dx, dy, step, *words = definition
    x_unit, y_unit, t_unit, segments = map(text_of, words)

    # The curves in each line follow one another, those of the way back as a map of their own.
    found: dict[tuple[int, int], int] = {}
    for offset in lines:
        kind, place = None, offset
        for _ in range(points):
            one = pieces.chunk(place, "VSET")
            _, line, point, own, _, following = pieces.fields(CURVE, one)
            if kind is None:
                kind, row = own, line
            if line != row:
                break
            if own == kind:
                found[line, point] = one.end
            place = following
            if (
                not place
                or place + HEAD.size > len(pieces.raw)
                or HEAD.unpack_from(pieces.raw, place)[2] != b"VSET"
            ):
                break
    if not found:
        raise ValueError(f"{name}: expected force curves, got a map without any")
    order = sorted(found)
    # the last one in the file, which is not there if it is cut
    map_curve(pieces, max(found.values()), channels)

    # The scan: its steps, about its centre at the offset of the scan.
    centre = [value if math.isfinite(value := stated(note, f"{axis}Offset")) else 0.0 for axis in "XY"]
    sizes = [stated(note, "FastScanSize"), stated(note, "SlowScanSize")]
    steps = [
        d * METRES.get(unit, math.nan) if d > 0.0 else size / max(count - 1, 1)
        for d, unit, size, count in zip(
            (float(dx), float(dy)), (x_unit, y_unit), sizes, (points, rows), strict=True
        )
    ]
    places = [
        (centre[0] + (point - (points - 1) / 2) * steps[0], centre[1] + (line - (rows - 1) / 2) * steps[1])
        for line, point in order
    ]
    notes = []
    if len(order) < points * rows:
        notes.append(f"{len(order)} of the {points * rows} curves of the map are in the file")
    if len(maps) > 1:
        notes.append(f"the first of {len(maps)} maps in the file is read, the others (the way back) are not")
    return Recording(
        name, note, step * SECONDS.get(t_unit, math.nan), tuple(one for one in segments.split(";") if one), places,
        lambda k: map_curve(pieces, found[order[k]], channels), tuple(notes),
    )  # fmt: skip


def map_curve(
    pieces: Pieces, at: int, channels: list[tuple[str, str]]
) -> tuple[dict[str, tuple[np.ndarray, str]], list[int]]:
    """Return the samples of the channels of a curve with their units, and the last samples of its segments.

    at: offset of what follows the VSET of the curve.
    """
    samples: dict[str, tuple[np.ndarray, str]] = {}
    ends = [0]
    at = pieces.chunk(at, "VNAM").end
    for _ in channels:
        one = pieces.chunk(at, "VDAT")
        _, _, _, count, channel, *last = pieces.fields(SAMPLES, one)
        if one.begin + SAMPLES.size + 4 * count > one.end or channel >= len(channels):
            raise ValueError(
                f"{pieces.path}: byte {at}: expected {count} samples of channel {channel} of {len(channels)}, got"
                f" {one.end - one.begin - SAMPLES.size} bytes"
            )
        name, unit = channels[channel]
        values = np.frombuffer(pieces.raw, "<f4", count, one.begin + SAMPLES.size)
        samples[name] = values, unit
        # five numbers, of which those that are not used are 0
        ends = [0, *sorted({abs(k) for k in last} - {0})]
        at = one.end
    return samples, ends
