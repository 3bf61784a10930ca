"""Header of the files of NanoScope, the software of Bruker's microscopes (earlier Veeco and Digital Instruments).

The header is text of lines that begin with a backslash and ends with Ctrl-Z. A line ``*NAME`` begins a section, and a
section has parameters ``LABEL: VALUE``. A label may begin with ``@`` and the number of a group. The value is then one of

    V [SENSITIVITY] (SCALE V/LSB) VALUE V,    V VALUE nm/V,    S [NAME] "title",

where LSB is the unit of the stored integers, 16 bits of the whole range, and SENSITIVITY is the label of another parameter
(NanoScope 8.10 User Guide, General Format for CIAO Parameter Objects).
"""

import re
from typing import NamedTuple

FORCE, IMAGE = (
    b"\\*Force file list",
    b"\\*File list",
)  # first lines of force curves, and of images without any
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
    """Return the beginning of a file, b"" if it cannot be read."""
    try:
        with open(name, "rb") as file:
            return file.read(len(FORCE))
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
