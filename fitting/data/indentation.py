"""Measured indentation curves: immutable, validated once, in SI units."""

import dataclasses
from typing import Any

import numpy as np

from fitting.data.contact import FirstTouch, find_contact
from fitting.data.curves import array, deviations, times, window_note
from fitting.data.drag import find_drag, without
from fitting.data.probe import probe_of
from fitting.data.segments import SEGMENTS, infer
from fitting.views.curve_picture import draw
from fitting.views.in_words import described

ERRORS = ("sigma_depth", "sigma_load")
DEVIATIONS = (*ERRORS, "scatter_depth", "scatter_load")
LEAVE_OUT = "in_contact() leaves them out"  # end of the note of a reader on points before contact


@dataclasses.dataclass(frozen=True, eq=False)
class IndentationData:
    """An indentation curve: load and depth over time.

    Args:
        t: (n,) [s], not decreasing.
        load: (n,) [N].
        depth: (n,) [m].
        notes: remarks of a reader or a method on what was read, left out and corrected.
        marks: (n,) of "approach", "hold", "retract" where the file marks its segments, else None.
        sigma_depth: (n,) standard deviations of the depth [m], if known; ``fit_indentation`` uses them under load
            control.
        sigma_load: (n,) standard deviations of the load [N], if known; used under depth control.
        scatter_depth, scatter_load: (n,) standard deviations up to a common factor, which a fit estimates; set by
            ``resample``.
        whole: (3, m): time, load and depth of the curve from which this one was taken, with the same zeros;
            None if nothing was left out. ``plot`` shows it, and a fit takes the part before the first point as history.
        cut: whether the curve begins at first contact because ``in_contact`` cut it there.

    Raises:
        ValueError: any other input, with the expected and the received value.

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
                object.__setattr__(self, name, deviations(name, getattr(self, name), self.t))
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
        """Segment of each point, (n,) of "approach", "hold", "retract": as the file marks them, else inferred from the
        curve."""
        if self.marks is not None:
            return self.marks
        found = self.contact
        return infer(self.t, found.load_sign * self.load, found.depth_sign * self.depth)

    @property
    def contact(self) -> FirstTouch:
        """First contact according to the load, with respect to the zeros of this curve; see ``fitting.data.contact``."""
        return find_contact(self.t, self.load, self.depth)

    def only(self, *segments: str) -> "IndentationData":
        """Return the points of some segments, or all points if no name is given.

        Args:
            segments: of "approach", "hold", "retract".

        Returns:
            The points, with a note. ``fit_indentation`` takes the curve before the first of them, from contact on, as the
            history of the material (``whole``).

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
        """Return the points from ``begin`` to ``end`` [s], None for an open side.

        Returns:
            The points, with a note; t is unchanged. The curve before them remains the history, as in ``only``.

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
        return self._take(keep, window_note((begin, end), "s", keep))

    def in_contact(
        self, depth: float | None = None, indenter: Any = None, film: bool = False
    ) -> "IndentationData":
        """Return the curve from first contact on, with time, load and depth counted from there.

        The first contact, the zero of the load and the signs come from ``fitting.data.contact``. The first point is the
        contact itself, (0, 0, 0), between two samples. The curve ends where the retract has removed the load. A curve
        that was already cut at contact, or that begins in contact, is returned unchanged.

        Args:
            depth: known measured depth of first contact [m].
            indenter: as in ``fit_indentation``, for the law of the first load; None: a ball.
            film: whether a film is to be fitted, on which the load rises more steeply than on a half-space.

        Returns:
            The points, with notes; the same data if they begin in contact.

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
        """Return the curve from the contact on, with zeros and signs of the contact."""
        t = self.t - found.t
        load = found.load_sign * (self.load - found.load)
        depth = found.depth_sign * (self.depth - found.depth)
        first, last = found.before, found.before + _unloaded(load[found.before :])
        take = lambda y: np.concatenate([[0.0], y[first:last]])
        again = lambda y: None if y is None else np.concatenate([y[first : first + 1], y[first:last]])
        notes = [
            f"contact at {found.t:.4g} s and {found.depth:.4g} m: {first} points before it left out,"
            f" {found.load:.3g} N subtracted from the load"
        ]
        notes += [f"{what} with the other sign" for what, sign in
                  (("load", found.load_sign), ("depth", found.depth_sign)) if sign < 0]  # fmt: skip
        notes += [f"{t.size - last} points after the contact left out"] if last < t.size else []
        earlier = [note for note in self.notes if not note.endswith(LEAVE_OUT)]
        return IndentationData(
            t=take(t), load=take(load), depth=take(depth), notes=(*earlier, *notes), marks=again(self.marks), cut=True,
            **{name: again(getattr(self, name)) for name in DEVIATIONS},
            whole=self.whole_curve() * [[1], [found.load_sign], [found.depth_sign]]
            - [[found.t], [found.load_sign * found.load], [found.depth_sign * found.depth]],
        )  # fmt: skip

    def without_drag(self, coefficient: float | None = None) -> "IndentationData":
        """Return the curve without the viscous drag on its cantilever, load - b d(depth)/dt.

        In liquid the drag shifts the baselines of approach and retraction apart, and leaves the load as soon as the tip
        stops; derived in ``fitting.data.drag``.

        Args:
            coefficient: b [N s/m]; None: from the baselines of approach and retraction.

        Returns:
            All points, with a note that states b and its standard deviation.

        Raises:
            ValueError: a negative coefficient, no baselines of approach and retraction, or a curve read from a file without
                times.

        Example:
            >>> t = np.arange(200.0)
            >>> depth = 1e-8 * np.minimum(t, 199 - t)  # to 1 um and back, never in contact until 0.9 um
            >>> force = 1e-3 * np.maximum(depth - 0.9e-6, 0) + np.where(t < 100, 5e-11, -5e-11)  # drag 5 mN s/m
            >>> curve = fitting.IndentationData(t=t, load=force, depth=depth).without_drag()
            >>> print(curve.notes[0])
            drag of 0.005 N s/m subtracted from the load
        """
        if coefficient is None:
            found = find_drag(self)
            return self.without_drag(found.coefficient)._noted(
                f"drag read from the baselines (sd {found.sd:.2g} N s/m)"
            )
        if not 0.0 <= coefficient < np.inf:
            raise ValueError(f"coefficient: expected a drag >= 0 N s/m, got {coefficient!r}")
        whole = self.whole
        if whole is not None:
            t, load, depth = whole
            measured = IndentationData(t=t, load=load, depth=depth, notes=self.notes)
            whole = np.stack([t, without(measured, coefficient), depth])
        return dataclasses.replace(self, load=without(self, coefficient), whole=whole)._noted(
            f"drag of {coefficient:.4g} N s/m subtracted from the load"
        )

    def _noted(self, note: str) -> "IndentationData":
        return dataclasses.replace(self, notes=(*self.notes, note))

    def whole_curve(self) -> np.ndarray:
        """Return ``whole``, or this curve, (3, m)."""
        return np.stack([self.t, self.load, self.depth]) if self.whole is None else self.whole

    def _take(self, keep: np.ndarray, note: str) -> "IndentationData":
        """Return some of the points, with a note."""
        if keep.sum() < 5:
            raise ValueError(f"expected at least 5 points, got: {note}")
        some = {name: getattr(self, name) for name in ("t", "load", "depth", "marks", *DEVIATIONS)}
        fields = {name: None if y is None else y[keep] for name, y in some.items()}
        return IndentationData(**fields, notes=(*self.notes, note), whole=self.whole_curve(), cut=self.cut)

    def plot(self) -> Any:
        """Return a figure of load and depth over time, with points that were left out in grey.

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
    """Return the number of points until the load has returned to zero after its maximum."""
    top = int(np.argmax(load))
    back = np.flatnonzero(load[top:] <= 0)
    return top + int(back[0]) if back.size else load.size
