"""Choice among the curves of a file of a microscope, and their places."""

from typing import NamedTuple


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
