"""Reader of the binary force curves and force volumes of Bruker's microscopes.

The samples of a channel follow the header (``nanoscope.py``) at its "Data offset": little-endian integers of 2 or 4 bytes,
for each curve the approach and then the retraction, both from the turning point outwards. In volts and in metres they are

    sample x scale [V/LSB],    sample x scale [V/LSB] x sensitivity [m/V],

with the deflection times the spring constant as force. The height is that of the sensor, or else of the ramp, whose
samples are equidistant.

Sources: Bruker, help page "Force Volume Image File Format"; B. Pittenger (Bruker) on the scale of the height sensor, forum
"The Nanoscale World", January 2012. The headers state 2 bytes also where a sample has 4, so the width follows from the
length of the data. In files of version 9.2 a force volume has samples of 1/256 LSB and a single curve such of 1 LSB, which
no parameter states; it follows from the range of the converter, 16 bits of 1 LSB. On both the largest deflection then
agrees with the trigger threshold.
"""

import functools
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fitting.data.contact import tip_depth
from fitting.io.nanoscope import IMAGE, HeaderSection, ScopeHeader, first_line, read_header
from fitting.io.places import Place, chosen

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


def read(
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
    curves = _load(name)
    place = chosen(name, len(curves.deflection.raw), curve)
    channel = curves.header.all(CHANNEL)[0]
    k = spring_constant or channel.number("spring constant") or 0.0
    s = sensitivity or curves.header.sensitivity(curves.deflection.sensitivity) or 0.0
    missing = [what for what, value in (("spring constant", k), ("sensitivity", s)) if not value]
    if missing:
        flags = " and ".join(f"{what.replace(' ', '_')}=" for what in missing)
        raise ValueError(f"{name}: the file does not state the {' and the '.join(missing)}: give {flags}")
    raw = curves.deflection.raw[place]
    order, t = _order(curves, raw.size), _times(curves, raw.size)
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


def places(name: str) -> list[Place]:
    """Return the places of the curves: of a force volume in rows in the order in which they are stored."""
    curves = _load(name)
    scan = curves.header.one("ciao scan list")
    x, y = (scan.metres(f"{axis} offset") for axis in "xy")
    x, y = (math.nan if value is None else value for value in (x, y))
    count, columns = len(curves.deflection.raw), curves.columns
    step = (scan.metres("scan size") or math.nan) / columns if count > 1 else 0.0
    return [Place(k, x + step * (k % columns), y + step * (k // columns)) for k in range(count)]


def _load(name: str) -> ForceVolume:
    """Return the curves of a file; the last files are kept."""
    return _loaded(name, Path(name).stat().st_mtime_ns)


@functools.lru_cache(maxsize=2)
def _loaded(name: str, _: int) -> ForceVolume:
    if first_line(name).startswith(IMAGE):
        raise ValueError(f"{name}: expected force curves, got an image of NanoScope")
    header = read_header(name)
    mode = header.one("ciao scan list").values.get("operating mode", CURVES[0])
    if mode not in CURVES:
        raise ValueError(
            f"{name}: expected a force curve or a force volume, got the operating mode {mode!r}, such as of a PeakForce"
            " capture, whose height oscillates and is not stored: export its curves as text"
        )
    columns, rows = _grid(header) if mode == CURVES[1] else (1, 1)
    deflection, sensor = (_section(header, word) for word in ("deflection", "height sensor"))
    if deflection is None:
        found = [one.values.get("image data", "?").split('"')[-2:][0] for one in header.all(CHANNEL)]
        raise ValueError(
            f"{name}: expected a channel of the deflection, got {', '.join(found) or 'no channel'}"
        )
    samples = deflection.integers("samps/line")
    whole = sum(samples) if len(samples) > 1 else 2 * sum(samples)
    bent = _channel(name, deflection, columns * rows, whole)
    height = _channel(name, sensor, columns * rows, whole) if sensor else None
    return ForceVolume(bent, height, _approach(bent.raw[0], samples), header, columns)


def _section(header: ScopeHeader, word: str) -> HeaderSection | None:
    """Return the first channel whose name has a word, or None."""
    found = (one for one in header.all(CHANNEL) if word in one.values.get("image data", ""))
    return next(found, None)


def _grid(header: ScopeHeader) -> tuple[int, int]:
    """Return the numbers of columns and rows of a force volume."""
    image, scan = header.one("ciao image list"), header.one("ciao scan list")
    columns = (image.integers("samps/line") or scan.integers("samps/line") or [1])[0]
    return columns, (image.integers("number of lines") or scan.integers("lines") or [1])[0]


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


def _approach(raw: np.ndarray, samples: list[int]) -> int:
    """Return the number of samples of the approach.

    Files state two numbers in an order that differs among descriptions. Both parts begin at the turning point, so that
    the deflection jumps where the second begins.
    """
    jump = lambda first: abs(float(raw[first]) - float(raw[first - 1])) if 0 < first < raw.size else -1.0
    return max(samples[:2], key=jump)


def _order(curves: ForceVolume, size: int) -> np.ndarray:
    """Return the places of the samples (size,) in their order in time."""
    first = curves.approach
    return np.concatenate([np.arange(first)[::-1], np.arange(first, size)])


def _times(curves: ForceVolume, size: int) -> np.ndarray:
    """Return the times of the samples (size,) [s], from the speeds of the ramp or else from its frequency."""
    force = curves.header.one("ciao force list")
    ramp = curves.header.all(CHANNEL)[0].number("ramp size")
    half = 0.5 / (force.number("scan rate") or math.nan)
    speeds = [force.number(f"{way} vel.") for way in ("forward", "reverse")]
    there, back = (ramp / speed if ramp and speed else half for speed in speeds)
    first = curves.approach
    return np.concatenate(
        [there * np.arange(first) / first, there + back * np.arange(size - first) / (size - first)]
    )


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
