"""Measured creep curves: immutable, validated once, in SI units."""

import dataclasses
import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.views.text import described
from jaxcontact._support.pytree import require_real

# Detection of whether the times of a curve count from the load, since J(t) and G(t) are functions of the time since
# loading.
#
# The clock of an instrument may have started earlier. Then the first time is late: many sample intervals after zero
# where samples are evenly spaced. Times whose spacing grows in proportion to them, as in logarithmic sampling, count
# from the load whatever the first of them is. Late times of even spacing may count from the load too, with the first
# samples left out, and the times alone do not distinguish the two cases, so the caller must decide.


LATE = 5.0  # largest first time, in sample intervals, if the clock starts with the load
EVENLY = 2.5  # the same for even spacing, where one or two samples may be missing
EVEN = 0.2  # largest relative difference of even spacings
FIRST = 9  # number of spacings examined
ALIKE = 0.3  # relative tolerance of spacing that grows with time


def counts_from_zero(t: np.ndarray) -> bool:
    """Return whether the clock appears to start with the load: an early first sample, or growing spacing."""
    different = np.unique(t[np.isfinite(t)])
    if different.size < 3:
        return True
    gaps = np.diff(different)
    first = gaps[:FIRST]
    even = first.max() - first.min() < EVEN * first.max()
    if different[0] <= (EVENLY if even else LATE) * gaps[0] * (1.0 + 1e-9):
        return True
    middle = different.size // 2
    grown = (different[middle + 1] - different[middle]) / gaps[0]
    return bool(abs(grown / (different[middle] / different[0]) - 1) < ALIKE and grown > 1 + ALIKE)


def since_load(t: np.ndarray, start: float | None) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the times (n,) since the load, which began at ``start`` [s] on their clock, and notes.

    Without a start the times count from the load, and a note says so if their spacing suggests otherwise.

    Raises:
        ValueError: a start after the first of the times.
    """
    if start is None:
        note = (
            f"t begins late, at {t[0]:g} s, and is taken as the time since the load;"
            f" give start={t[0]:g} if the load began then, start=0 if not"
        )
        return t, () if counts_from_zero(t) else (note,)
    if not (np.isfinite(start) and start <= t[0]):
        raise ValueError(f"start: expected a time not after the first of t, {t[0]:g} s, got {start!r}")
    return t - start, ()


CONVENTIONS = ("J", "1/(2G)", "D")


def array(name: str, value: object, like: np.ndarray | None = None) -> np.ndarray:
    """Return a finite float array (n,), n >= 5; ValueError with its name otherwise."""
    require_real(name, value)
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: expected numbers, got {type(value).__name__}") from None
    if array.ndim != 1 or array.size < 5:
        raise ValueError(f"{name}: expected a 1-d array of at least 5 values, got shape {array.shape}")
    if like is not None and array.shape != like.shape:
        raise ValueError(f"{name}: expected {like.size} values as in t, got {array.size}")
    if not np.all(np.isfinite(array)):
        k = int(np.argmax(~np.isfinite(array)))
        raise ValueError(f"{name}: expected finite values, got {array[k]} at index {k}")
    array.setflags(write=False)
    return array


def check_kind(data: object, kind: type) -> None:
    """Raise ValueError unless the data are of this kind."""
    if not isinstance(data, kind):
        raise ValueError(f"data: expected {kind.__name__}, got {type(data).__name__}")


def given_twice(data: Sequence[Any]) -> tuple[int, int] | None:
    """Return the places of two curves of a list that are the same, None where all are different."""
    arrays = [
        [np.asarray(value) for value in vars(one).values() if isinstance(value, np.ndarray | float)]
        for one in data
    ]
    for (i, first), (j, second) in itertools.combinations(enumerate(arrays), 2):
        if len(first) == len(second) and all(map(np.array_equal, first, second)):
            return i, j
    return None


def window_note(limits: tuple[float | None, float | None], unit: str, keep: np.ndarray) -> str:
    """Return the note on the points keep (n,) bool that lie between limits, None for an open side."""
    begin, end = (
        word if one is None else f"{one:g} {unit}"
        for one, word in zip(limits, ("the first", "the last"), strict=True)
    )
    return f"window from {begin} to {end} taken: {keep.sum()} of {keep.size} points"


def deviations(name: str, value: object, like: np.ndarray) -> np.ndarray:
    """Return standard deviations (n,), > 0."""
    found = array(name, value, like)
    if np.any(found <= 0):
        raise ValueError(f"{name}: expected standard deviations > 0, got {found.min():g}")
    return found


def times(value: object) -> np.ndarray:
    """Return times (n,) that do not decrease, at least 5 of them different; ValueError otherwise."""
    t = array("t", value)
    if np.any(np.diff(t) < 0):
        raise ValueError("t: expected times that do not decrease; the readers sort, the data classes do not")
    if np.unique(t).size < 5:
        raise ValueError(f"t: expected at least 5 different times, got {np.unique(t).size}")
    return t


def evaluation_times(value: Any) -> np.ndarray:
    """Return times [s], or frequencies, of any shape at which a fitted curve is evaluated; ValueError unless all are finite
    and >= 0."""
    require_real("t", value)
    try:
        t = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"t: expected finite times (or frequencies) >= 0, got {value!r}") from None
    wrong = t[~(np.isfinite(t) & (t >= 0.0))]
    if wrong.size:
        raise ValueError(f"t: expected finite times (or frequencies) >= 0, got {wrong[0]:g}")
    return t


def absolute(temperature: Any) -> float | None:
    """Return a temperature [K], or None where none is given; ValueError unless it is > 0 K."""
    if temperature is None:
        return None
    known = np.ndim(temperature) == 0 and np.asarray(temperature).dtype.kind in "fiu"
    if not (known and 0.0 < float(temperature) < math.inf):
        raise ValueError(f"temperature: expected a number > 0 K, got {temperature!r}")
    return float(temperature)


@dataclasses.dataclass(frozen=True, eq=False)
class CreepData:
    """A creep curve: compliance J(t) after a stress step, or strain under a stress history.

    Args:
        t: (n,) [s], >= 0, not decreasing; repeated times are repeated measurements.
        J: (n,) [1/Pa] > 0; or else
        strain: (n,), with
        stress: a pair (times, values [Pa]), piecewise linear, a repeated time being a jump, or an array (n,)
            measured at t. The stress is zero before its first time.
        convention: meaning of J or strain/stress: "J" = gamma/tau in shear; "1/(2G)", as phi in Eq. (14)
            of Wang et al. (2025); "D" = strain/stress in tension, J = 2 (1 + nu) D. ``compliance`` is J in each case.
        notes: remarks of a reader on what was read and corrected.
        nu: Poisson's ratio of a tensile test, for "D" only.
        sigma: (n,) standard deviations of J or strain, if known; ``fit_creep`` uses them.
        scatter: (n,) standard deviations up to a common factor, which a fit estimates; set by ``resample``.
        start: time [s] of loading on the clock of t, which is subtracted, for J only; 0 if t counts from the load.
            None takes t as the time since the load, and adds a note if the spacing suggests that the clock started
            earlier (``fitting/data/curves.py``).
        temperature: of the test [K], for ``fit_master``.

    Raises:
        ValueError: any other input, with the expected and the received value.

    Example:
        >>> data = fitting.CreepData(t=[1, 2, 3, 4, 5], J=[2, 3, 4, 5, 6], convention="D", nu=0.5)
        >>> print(data.compliance)
        [ 6.  9. 12. 15. 18.]
    """

    t: np.ndarray
    J: np.ndarray | None = None
    strain: np.ndarray | None = None
    stress: Any = None
    convention: str = "J"
    notes: tuple[str, ...] = ()
    nu: float | None = None
    sigma: np.ndarray | None = None
    scatter: np.ndarray | None = None
    start: float | None = None
    temperature: float | None = None

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)
        put("t", times(self.t))
        if self.J is not None:
            since, late = since_load(self.t, self.start)
            put("t", since)
            put("start", 0.0)
            put("notes", (*self.notes, *late))
        elif self.start is not None:
            raise ValueError(
                f"start: expected none with strain and stress, whose times are given; got {self.start!r}"
            )
        if self.t[0] < 0:
            raise ValueError(f"t: expected times >= 0, got {self.t[0]:g}")
        if self.convention not in CONVENTIONS:
            raise ValueError(f"convention: expected one of {sorted(CONVENTIONS)}, got {self.convention!r}")
        tensile = self.convention == "D"
        if tensile and (self.nu is None or not -1.0 < self.nu <= 0.5):
            raise ValueError(
                f"nu: expected -1 < nu <= 0.5 for a tensile compliance (convention 'D'), got {self.nu!r}"
            )
        if not tensile and self.nu is not None:
            raise ValueError(
                f"nu: expected none with convention {self.convention!r}, only 'D' needs it; got {self.nu!r}"
            )
        put("temperature", absolute(self.temperature))
        if (self.J is None) == (self.strain is None):
            raise ValueError("CreepData: expected either J, or strain and stress; got both or none")
        for name in ("sigma", "scatter"):
            if getattr(self, name) is not None:
                put(name, deviations(name, getattr(self, name), self.t))
        if self.J is not None:
            if self.stress is not None:
                raise ValueError("stress: expected none with J, got a stress")
            put("J", array("J", self.J, self.t))
            if np.any(self.J <= 0):
                raise ValueError(f"J: expected > 0, got {self.J.min():g}")
            return
        put("strain", array("strain", self.strain, self.t))
        if self.stress is None:
            raise ValueError("stress: expected (times, values) or an array as long as t, got None")
        is_pair = isinstance(self.stress, tuple) and len(self.stress) == 2
        knots, values = self.stress if is_pair else (self.t, self.stress)
        require_real("stress", [knots, values])
        knots, values = np.array(knots, dtype=float), np.array(values, dtype=float)
        if knots.ndim != 1 or knots.shape != values.shape or knots.size == 0:
            raise ValueError(
                f"stress: expected times and values of one length, got {knots.shape} and {values.shape}"
            )
        if not (np.all(np.isfinite(knots)) and np.all(np.isfinite(values)) and np.all(np.diff(knots) >= 0)):
            raise ValueError("stress: expected finite values at times that do not decrease")
        if np.all(values == 0):
            raise ValueError("stress: expected a stress that is not zero throughout")
        put("stress", (knots, values))

    def __repr__(self) -> str:
        stress = None if self.stress is None else self.stress[1]
        rows = [
            ("t", self.t, "s"),
            ("J", self.J, "1/Pa"),
            ("strain", self.strain, ""),
            ("stress", stress, "Pa"),
        ]
        rows += [
            ("sigma", self.sigma, ""),
            ("scatter", self.scatter, ""),
            ("temperature", self.temperature, "K"),
        ]
        head = f"CreepData: {self.t.size} points, convention {self.convention}"
        return described(head, rows, self.notes)

    @property
    def compliance(self) -> np.ndarray | None:
        """Shear creep compliance J = gamma/tau [1/Pa], (n,), whatever the convention of the input."""
        return None if self.J is None else self.J * self._factor

    @property
    def response(self) -> np.ndarray:
        """The fitted quantity (n,): J [1/Pa], or the strain, times 2 for "1/(2G)" and 2 (1 + nu) for "D"."""
        values: Any = self.strain if self.J is None else self.J
        return values * self._factor

    @property
    def curve(self) -> tuple[str, str, np.ndarray, np.ndarray]:
        """Name, unit, times and values of the fitted quantity."""
        name, unit = ("J", "1/Pa") if self.J is not None else ("strain", "-")
        return name, unit, self.t, self.response

    @property
    def error(self) -> np.ndarray | None:
        """Standard deviation of the response, (n,), None if it is not known."""
        return None if self.sigma is None else self.sigma * self._factor

    @property
    def _factor(self) -> float:
        """Factor from the convention to gamma/tau."""
        return {"J": 1.0, "1/(2G)": 2.0, "D": 2.0 * (1.0 + (self.nu or 0.0))}[self.convention]
