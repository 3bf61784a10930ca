"""Measured curves: frozen, checked once, in SI units."""

import dataclasses
from typing import Any

import numpy as np

from fitting.data.clock import since_load
from fitting.data.contact import FirstTouch, find_contact
from fitting.data.probe import probe_of
from fitting.data.segments import SEGMENTS, infer
from fitting.views.curve_picture import draw
from fitting.views.in_words import described

CONVENTIONS = ("J", "1/(2G)", "D")
ERRORS = ("sigma_depth", "sigma_load")
DEVIATIONS = (*ERRORS, "scatter_depth", "scatter_load")


def array(name: str, value: object, like: np.ndarray | None = None) -> np.ndarray:
    """A finite float array (n,), n >= 5; ValueError with its name otherwise."""
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


def _deviations(name: str, value: object, like: np.ndarray) -> np.ndarray:
    """Standard deviations (n,), > 0."""
    found = array(name, value, like)
    if np.any(found <= 0):
        raise ValueError(f"{name}: expected standard deviations > 0, got {found.min():g}")
    return found


def times(value: object) -> np.ndarray:
    t = array("t", value)
    if np.any(np.diff(t) < 0):
        raise ValueError("t: expected times that do not decrease; the readers sort, the data classes do not")
    if np.unique(t).size < 5:
        raise ValueError(f"t: expected at least 5 different times, got {np.unique(t).size}")
    return t


@dataclasses.dataclass(frozen=True, eq=False)
class CreepData:
    """A creep curve: compliance J(t) after a stress step, or strain under a stress history.

    Args:
        t: (n,) [s], >= 0, not decreasing; repeated times are repeated measurements.
        J: (n,) [1/Pa] > 0; or else
        strain: (n,), with
        stress: a pair (times, values [Pa]), piecewise linear, a repeated time being a jump, or an array (n,)
            measured at t. The stress is zero before its first time.
        convention: what J or strain/stress is: "J" = gamma/tau in shear; "1/(2G)" as phi in the paper's
            Eq. (14); "D" = strain/stress in tension, J = 2 (1 + nu) D. ``compliance`` is J in each case.
        notes: what a reader took and mended.
        nu: Poisson's ratio of a tensile test, for "D" only.
        sigma: (n,) standard deviations of J or strain, if they are known; ``fit_creep`` takes them.
        scatter: (n,) the same up to a common factor, which a fit finds; ``resample`` gives them.
        start: of J, when the load began on the clock of t [s], from which t counts in the result; 0 if it does already.
            None takes t as the time since the load, and adds a note if their spacing suggests an earlier start of the
            clock (``fitting/data/clock.py``).

    Raises:
        ValueError: anything else, with what was expected and what came.

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

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)
        put("t", times(self.t))
        if self.J is not None:
            since, late = since_load(self.t, self.start)
            put("t", since)
            put("start", 0.0)
            put("notes", (*self.notes, *late))
        elif self.start is not None:
            raise ValueError(f"start: goes with J, as the stress has times of its own; got {self.start!r}")
        if self.t[0] < 0:
            raise ValueError(f"t: expected times >= 0, got {self.t[0]:g}")
        _check_convention(self.convention, self.nu)
        if (self.J is None) == (self.strain is None):
            raise ValueError("CreepData: expected either J, or strain and stress; got both or none")
        for name in ("sigma", "scatter"):
            if getattr(self, name) is not None:
                put(name, _deviations(name, getattr(self, name), self.t))
        if self.J is not None:
            if self.stress is not None:
                raise ValueError("stress: goes with strain, not with J")
            put("J", array("J", self.J, self.t))
            if np.any(self.J <= 0):
                raise ValueError(f"J: expected > 0, got {self.J.min():g}")
            return
        put("strain", array("strain", self.strain, self.t))
        put("stress", _history(self.stress, self.t))

    def __repr__(self) -> str:
        stress = None if self.stress is None else self.stress[1]
        rows = [
            ("t", self.t, "s"),
            ("J", self.J, "1/Pa"),
            ("strain", self.strain, ""),
            ("stress", stress, "Pa"),
        ]
        rows += [("sigma", self.sigma, ""), ("scatter", self.scatter, "")]
        head = f"CreepData: {self.t.size} points, convention {self.convention}"
        return described(head, rows, self.notes)

    @property
    def compliance(self) -> np.ndarray | None:
        """Shear creep compliance J = gamma/tau [1/Pa], (n,), whatever the convention of the input."""
        return None if self.J is None else self.J * self._factor

    @property
    def response(self) -> np.ndarray:
        """What is fitted, (n,): J [1/Pa], or the strain, times 2 for "1/(2G)" and 2 (1 + nu) for "D"."""
        values: Any = self.strain if self.J is None else self.J
        return values * self._factor

    @property
    def error(self) -> np.ndarray | None:
        """Standard deviation of the response, (n,), None if it is not known."""
        return None if self.sigma is None else self.sigma * self._factor

    @property
    def _factor(self) -> float:
        """From the convention to gamma/tau."""
        return {"J": 1.0, "1/(2G)": 2.0, "D": 2.0 * (1.0 + (self.nu or 0.0))}[self.convention]


def _check_convention(convention: str, nu: float | None) -> None:
    if convention not in CONVENTIONS:
        raise ValueError(f"convention: expected one of {sorted(CONVENTIONS)}, got {convention!r}")
    if convention == "D" and (nu is None or not -1.0 < nu <= 0.5):
        raise ValueError(f"nu: expected -1 < nu <= 0.5 for a tensile compliance (convention 'D'), got {nu!r}")
    if convention != "D" and nu is not None:
        raise ValueError(f"nu: goes with convention 'D', not with {convention!r}; got {nu!r}")


def _history(stress: object, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(knots, values) of the stress, checked."""
    if stress is None:
        raise ValueError("stress: expected (times, values) or an array as long as t, got None")
    knots, values = stress if isinstance(stress, tuple) and len(stress) == 2 else (t, stress)
    knots, values = np.array(knots, dtype=float), np.array(values, dtype=float)
    if knots.ndim != 1 or knots.shape != values.shape or knots.size == 0:
        raise ValueError(
            f"stress: expected times and values of one length, got {knots.shape} and {values.shape}"
        )
    if not (np.all(np.isfinite(knots)) and np.all(np.isfinite(values)) and np.all(np.diff(knots) >= 0)):
        raise ValueError("stress: expected finite values at times that do not decrease")
    if np.all(values == 0):
        raise ValueError("stress: expected a stress that is not zero throughout")
    return knots, values


@dataclasses.dataclass(frozen=True, eq=False)
class IndentationData:
    """An indentation curve, load and depth over time.

    Args:
        t: (n,) [s], not decreasing.
        load: (n,) [N].
        depth: (n,) [m].
        notes: what a reader or a method took and mended.
        marks: (n,) of "approach", "hold", "retract" where the file marks its segments, else None.
        sigma_depth: (n,) standard deviations of the depth [m], if they are known; ``fit_indentation`` takes
            them under load control.
        sigma_load: (n,) likewise of the load [N], under depth control.
        scatter_depth, scatter_load: (n,) the same up to a common factor, which a fit finds; ``resample`` gives them.
        whole: (3, m): time, load and depth of the curve that this one was taken from, with the same zeros;
            None if nothing was left out. ``plot`` shows it.
        cut: whether the curve begins at first contact because ``in_contact`` cut it there.

    Raises:
        ValueError: anything else, with what was expected and what came.

    Example:
        >>> data = fitting.IndentationData(t=range(7), load=[0, 1, 2, 2, 2, 2, 2], depth=[0, 1, 2, 3, 3, 3, 3])
        >>> print(*data.segments)
        approach approach hold hold hold hold hold
        >>> print(data.only("hold").load)
        [2. 2. 2. 2. 2.]
    """

    t: np.ndarray
    load: np.ndarray
    depth: np.ndarray
    notes: tuple[str, ...] = ()
    marks: np.ndarray | None = None
    whole: np.ndarray | None = None
    sigma_depth: np.ndarray | None = None
    sigma_load: np.ndarray | None = None
    scatter_depth: np.ndarray | None = None
    scatter_load: np.ndarray | None = None
    cut: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", times(self.t))
        object.__setattr__(self, "load", array("load", self.load, self.t))
        object.__setattr__(self, "depth", array("depth", self.depth, self.t))
        for name in DEVIATIONS:
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _deviations(name, getattr(self, name), self.t))
        if self.marks is not None:
            object.__setattr__(self, "marks", _marks(self.marks, self.t))

    def __repr__(self) -> str:
        rows = [("t", self.t, "s"), ("load", self.load, "N"), ("depth", self.depth, "m")]
        units = {"sigma_depth": "m", "sigma_load": "N", "scatter_depth": "", "scatter_load": ""}
        rows += [(name, getattr(self, name), unit) for name, unit in units.items()]
        if self.marks is not None:
            counts = dict(zip(*np.unique(self.marks, return_counts=True), strict=True))
            rows.append(("marks", ", ".join(f"{count} of {name}" for name, count in counts.items()), ""))
        return described(f"IndentationData: {self.t.size} points", rows, self.notes)

    @property
    def segments(self) -> np.ndarray:
        """(n,) of "approach", "hold", "retract": as the file marks them, else as the course shows."""
        if self.marks is not None:
            return self.marks
        found = self.contact
        return infer(self.t, found.load_sign * self.load, found.depth_sign * self.depth)

    @property
    def contact(self) -> FirstTouch:
        """The first contact as the load shows it, in the zeros of this curve; see ``fitting.data.contact``."""
        return find_contact(self.t, self.load, self.depth)

    def only(self, *segments: str) -> "IndentationData":
        """The points of some segments; all of them without a name.

        Args:
            segments: of "approach", "hold", "retract".

        Returns:
            The points, with a note. The load before them is in no history: it counts as a step at the first.

        Raises:
            ValueError: another name, or fewer than 5 points.

        Example:
            >>> data = fitting.IndentationData(t=range(7), load=[1, 2, 2, 2, 2, 1, 0], depth=[1, 2, 3, 3, 3, 2, 1])
            >>> data.only("approach", "hold").notes
            ('approach and hold taken: 5 of 7 points',)
        """
        if not segments:
            return self
        segments = tuple(name.lower() if isinstance(name, str) else name for name in segments)
        for name in segments:
            if name not in SEGMENTS:
                raise ValueError(f"segment: expected one of {', '.join(SEGMENTS)}; got {name!r}")
        keep = np.isin(self.segments, segments)
        return self._take(keep, f"{' and '.join(segments)} taken: {keep.sum()} of {keep.size} points")

    def window(self, begin: float | None = None, end: float | None = None) -> "IndentationData":
        """The points from ``begin`` to ``end`` [s], None for an open side.

        Returns:
            The points, with a note; t as it was.

        Raises:
            ValueError: begin is not before end, or fewer than 5 points.

        Example:
            >>> data = fitting.IndentationData(t=range(8), load=range(8), depth=range(8))
            >>> print(data.window(2, None).t[0])
            2.0
        """
        low, high = -np.inf if begin is None else begin, np.inf if end is None else end
        if not low < high:
            raise ValueError(f"window: expected begin < end, got {begin!r} and {end!r}")
        keep = (self.t >= low) & (self.t <= high)
        return self._take(keep, f"{begin} to {end} s taken: {keep.sum()} of {keep.size} points")

    def in_contact(
        self, depth: float | None = None, indenter: Any = None, film: bool = False
    ) -> "IndentationData":
        """The curve from first contact on, with time, load and depth counted from there.

        The first contact, the zero of the load and the signs come from ``fitting.data.contact``. The first point is the
        contact itself, (0, 0, 0), between two samples. The curve ends where a retract has unloaded it. A curve that
        was cut at contact before, or that begins in contact, stays as it is.

        Args:
            depth: of first contact [m] as measured, where it is known.
            indenter: as of ``fit_indentation``, for the law of the first load; None: a ball.
            film: whether a film is to be fitted, on which the load rises more steeply than on a half-space.

        Returns:
            The points, with notes on what was taken; the same data if they begin in contact.

        Raises:
            ValueError: the depth of contact is outside the curve, or fewer than 5 points follow.

        Example:
            >>> t = np.arange(40.0)
            >>> air = fitting.IndentationData(t=t, load=np.maximum(t - 9.5, 0) ** 1.5, depth=t)
            >>> print(round(air.contact.depth, 3), air.in_contact().t.size)
            9.5 31
        """
        if depth is not None and not self.depth.min() <= depth < self.depth.max():
            limits = f"{self.depth.min():g} to {self.depth.max():g} m"
            raise ValueError(f"depth: expected a contact within the curve, {limits}; got {depth!r}")
        if self.cut and depth is None:
            return self
        power = 1.5 if indenter is None else probe_of(indenter).power
        found = find_contact(self.t, self.load, self.depth, depth, power, film)
        if not found.before:
            return dataclasses.replace(
                self, notes=(*self.notes, "the curve begins in contact: all points taken")
            )
        return self._zeroed(found)

    def _zeroed(self, found: FirstTouch) -> "IndentationData":
        """From the contact on, in its zeros and signs."""
        t = self.t - found.t
        load = found.load_sign * (self.load - found.load)
        depth = found.depth_sign * (self.depth - found.depth)
        first, last = found.before, found.before + _unloaded(load[found.before :])
        take = lambda y: np.concatenate([[0.0], y[first:last]])
        again = lambda y: None if y is None else np.concatenate([y[first : first + 1], y[first:last]])
        notes = [
            f"contact at {found.t:.4g} s and {found.depth:.4g} m: {first} points before it left out,"
            f" {found.load:.3g} N taken off the load"
        ]
        notes += [f"{what} with the other sign" for what, sign in
                  (("load", found.load_sign), ("depth", found.depth_sign)) if sign < 0]  # fmt: skip
        notes += [f"{t.size - last} points after the contact left out"] if last < t.size else []
        return IndentationData(
            t=take(t), load=take(load), depth=take(depth), notes=(*self.notes, *notes), marks=again(self.marks), cut=True,
            **{name: again(getattr(self, name)) for name in DEVIATIONS},
            whole=self.whole_curve() * [[1], [found.load_sign], [found.depth_sign]]
            - [[found.t], [found.load_sign * found.load], [found.depth_sign * found.depth]],
        )  # fmt: skip

    def whole_curve(self) -> np.ndarray:
        """(3, m): ``whole``, or this curve."""
        return np.stack([self.t, self.load, self.depth]) if self.whole is None else self.whole

    def _take(self, keep: np.ndarray, note: str) -> "IndentationData":
        """Some of the points, with a note."""
        if keep.sum() < 5:
            raise ValueError(f"expected at least 5 points, got: {note}")
        some = {name: getattr(self, name) for name in ("t", "load", "depth", "marks", *DEVIATIONS)}
        fields = {name: None if y is None else y[keep] for name, y in some.items()}
        return IndentationData(**fields, notes=(*self.notes, note), whole=self.whole_curve(), cut=self.cut)

    def plot(self) -> Any:
        """Load and depth over time, what was left out in grey.

        Returns:
            A matplotlib Figure.

        Example:
            >>> data = fitting.IndentationData(t=range(8), load=range(8), depth=range(8))
            >>> len(data.window(2, None).plot().axes)
            3
        """
        return draw(self)


def _marks(value: Any, t: np.ndarray) -> np.ndarray:
    marks = np.asarray(value)
    if marks.shape != t.shape or not set(marks.tolist()) <= set(SEGMENTS):
        raise ValueError(f"marks: expected {t.size} of {', '.join(SEGMENTS)}; got {marks.shape}")
    return marks


def _unloaded(load: np.ndarray) -> int:
    """Points until the load is back at zero after its greatest."""
    top = int(np.argmax(load))
    back = np.flatnonzero(load[top:] <= 0)
    return top + int(back[0]) if back.size else load.size
