"""Indentation curves, validated once and in SI units; and their readers, of text files and force curves of microscopes."""

import dataclasses
import functools
import itertools
import math
import operator
import os
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

import jaxcontact as jc
from fitting.data import cleaning, force_curves
from fitting.data.cleaning import (
    DEPTH,
    LOAD,
    Wanted,
    build,
    curves_of,
    having,
    once,
    stated_facts,
    stated_number,
)
from fitting.data.contact import (
    IN_A_ROW,
    SEGMENTS,
    UNTIMED,
    FirstTouch,
    find_contact,
    find_drag,
    held,
    infer,
    label,
    named,
    sample_noise,
    tip_depth,
    without,
)
from fitting.data.curves import array, deviations, times, window_note
from fitting.data.table import is_data, read_table
from fitting.views.sheet import draw_curve
from fitting.views.text import described

# Indenter geometry: P = size depth^power/((1 - nu) J) on a half-space of compliance J.
#
#     ball of radius R            P = 8 sqrt(R)/3 depth^(3/2)/((1 - nu) J)         (Hertz)
#     cone of half-angle a        P = 4 tan(a)/pi depth^2/((1 - nu) J)             (Love; Sneddon)
#     flat punch of radius R      P = 4 R depth/((1 - nu) J)                       (Boussinesq)
#
# Source: I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47. A pyramid is replaced by the cone of equal area at every depth
# (``jc.Cone.berkovich``). For a viscoelastic half-space J is replaced by the hereditary integral of Lee and Radok.


WIDE = 1.0 / 3.0  # contact radius over the radius of a ball
FORCE, STIFFNESS = 1.0 / 10.0, 1.0 / 6.0  # orders of ``paraboloid_note``


class Probe(NamedTuple):
    """Law of an indenter.

    power, size: of the formula in the module's docstring; widest: function from a depth [m] to the largest contact
    radius [m], also on a film; words: description; key: name of its size in the JSON, with the value.
    """

    power: float
    size: float
    widest: Callable[[float], float]
    words: str
    key: dict[str, float]


def probe_of(indenter: Any) -> Probe:
    """Return the law of an indenter; ValueError unless it is a ball, a cone or a flat punch of valid size."""
    if isinstance(indenter, jc.Cone):
        angle = float(indenter.half_angle)
        if not 0.0 < angle < 0.5 * math.pi:
            raise ValueError(f"indenter: expected a half-angle between 0 and pi/2, got {angle:g}")
        slope = math.tan(angle)
        words = f"cone of half-angle {math.degrees(angle):.4g} degrees"
        return Probe(
            2.0, 4.0 * slope / math.pi, functools.partial(operator.mul, slope), words,
            {"indenter_half_angle_rad": angle},
        )  # fmt: skip
    if not isinstance(indenter, jc.Sphere | jc.FlatPunch):
        raise ValueError(f"indenter: expected a Sphere, a Cone or a FlatPunch, got {type(indenter).__name__}")
    radius = float(indenter.radius)
    if not radius > 0:
        raise ValueError(f"indenter: expected a radius > 0, got {indenter.radius}")
    key = {"indenter_radius_m": radius}
    if isinstance(indenter, jc.FlatPunch):
        return Probe(
            1.0, 4.0 * radius, functools.partial(_constant, radius), f"flat punch of R = {radius:.4g} m", key
        )
    widest = functools.partial(_ball, radius)
    return Probe(1.5, 8.0 * math.sqrt(radius) / 3.0, widest, f"ball of R = {radius:.4g} m", key)


def _constant(radius: float, depth: float) -> float:
    """Return the contact radius [m] of a punch, which does not depend on the depth [m]."""
    return radius


def _ball(radius: float, depth: float) -> float:
    """Return the largest contact radius [m] of a ball at a depth [m]."""
    return math.sqrt(1.5 * radius * depth)


def paraboloid_note(
    indenter: Any, depth: float, order: float = FORCE, *, thickness: float | None = None
) -> tuple[str, ...]:
    """Return a note where a ball is pressed in so deep [m] that a paraboloid does not describe it, on a half-space or a
    layer of a thickness [m].

    On a half-space the fitted quantity is that of the paraboloid times 1 - order depth/R - ..., with the order 1/10 of the
    force and 1/6 of its derivative by the depth, from the exact solution of I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47.
    The contact with a bonded layer is wider, on an incompressible one by about

        a^2 = R depth (1 + 1.16 chi/(1 + 0.18 chi)),     chi = sqrt(R depth)/thickness,

    a fit to the solution in ``jaxcontact.reference.abel``.
    """
    if not isinstance(indenter, jc.Sphere) or not depth > 0.0 or too_deep(indenter, depth):
        return ()
    radius = float(indenter.radius)
    share, chi = depth / radius, math.sqrt(radius * depth) / (thickness or math.inf)
    wide = math.sqrt(share * (1.0 + 1.16 * chi / (1.0 + 0.18 * chi)))
    if not wide > WIDE:
        return ()
    error = f"on a half-space the modulus is up to {100.0 * order * share:.2g} % too low"
    if thickness is None:
        return (
            f"the depth reaches {share:.2g} of the radius of the ball, for which the model has a paraboloid: {error}",
        )
    return (
        f"the contact radius reaches up to {wide:.2g} of the radius of the ball, for which the model has a paraboloid:"
        f" {error}, on a thin sample the error is not known",
    )


STRAIN = 0.2  # depth over thickness beyond which linear elasticity is doubtful


def depth_notes(indenter: Any, depth: float, thickness: float | None) -> tuple[str, ...]:
    """Return notes where a tip is pressed in so deep [m] that the theory of a half-space or of a layer of a thickness [m]
    is doubtful."""
    found = paraboloid_note(indenter, depth, thickness=thickness)
    if thickness is None or depth <= STRAIN * thickness:
        return found
    return (
        *found,
        f"the depth is {depth / thickness:.2g} of the thickness: beyond {STRAIN:g} linear elasticity is doubtful",
    )


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
        contact_found: whether that contact was found from the load, and not given. The zero of the depth then has an error,
            so that ``fit_indentation`` fits it.
        numbered: whether t numbers the points of a file without times, so that nothing has a velocity.

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
    contact_found: bool = False
    numbered: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", times(self.t))
        object.__setattr__(self, "load", array("load", self.load, self.t))
        object.__setattr__(self, "depth", array("depth", self.depth, self.t))
        for name in DEVIATIONS:
            if getattr(self, name) is not None:
                object.__setattr__(self, name, deviations(name, getattr(self, name), self.t))
        if self.marks is not None:
            marks = np.asarray(self.marks)
            if marks.shape != self.t.shape or not set(marks.tolist()) <= set(SEGMENTS):
                raise ValueError(f"marks: expected {self.t.size} of {', '.join(SEGMENTS)}; got {marks.shape}")
            object.__setattr__(self, "marks", marks)

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

    @functools.cached_property
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
        # the curve from the contact on, with its zeros and signs
        t = self.t - found.t
        load = found.load_sign * (self.load - found.load)
        way = found.depth_sign * (self.depth - found.depth)
        # up to the point at which the load has returned to zero after its maximum
        first = found.before
        top = first + int(np.argmax(load[first:]))
        back = np.flatnonzero(load[top:] <= 0)
        last = top + int(back[0]) if back.size else load.size
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
            t=take(t), load=take(load), depth=take(way), notes=(*earlier, *notes), marks=again(self.marks), cut=True,
            contact_found=depth is None, numbered=self.numbered,
            **{name: again(getattr(self, name)) for name in DEVIATIONS},
            whole=self.whole_curve() * [[1], [found.load_sign], [found.depth_sign]]
            - [[found.t], [found.load_sign * found.load], [found.depth_sign * found.depth]],
        )  # fmt: skip

    def without_drag(self, coefficient: float | None = None) -> "IndentationData":
        """Return the curve without the viscous drag on its cantilever, load - b d(depth)/dt.

        In liquid the drag shifts the baselines of approach and retraction apart, and leaves the load as soon as the tip
        stops; derived in ``fitting.data.contact``.

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
            measured = IndentationData(t=t, load=load, depth=depth, numbered=self.numbered)
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
        kept = {"whole": self.whole_curve()} | origin_of(self)
        return IndentationData(**fields, **kept, notes=(*self.notes, note))

    def plot(self) -> Any:
        """Return a figure of load and depth over time, with points that were left out in grey.

        Returns:
            A matplotlib Figure.

        Example:
            >>> data = fitting.IndentationData(t=range(8), load=range(8), depth=range(8))
            >>> len(data.window(2, None).plot().axes)
            3
        """
        return draw_curve(self)


# The part of a curve before the points that were selected from it: history of the material, which a fit does not
# compare.
#
# The response of a viscoelastic material to a hold depends on the loading before it. With that left out, as if the
# load of the hold had been applied in one step, a ramp of half a relaxation time changes moduli by a third, and a
# hold that is fitted from one and a half relaxation times on by more than a factor of two, without any sign of it in
# the residuals.


MOST = 200  # largest number of points of the history, evenly spaced in those of the curve


def origin_of(data: IndentationData) -> dict[str, bool]:
    """Return the fields that parts and means of a curve have in common with it."""
    return {"cut": data.cut, "contact_found": data.contact_found, "numbered": data.numbered}


def with_earlier(data: IndentationData) -> tuple[IndentationData, np.ndarray]:
    """Return a curve with the points in contact before its first one, and which of its points it had already, (n,)."""
    # the whole curve from contact to the first point, the contact included
    earlier = np.zeros((3, 0))
    if data.whole is not None and not data.cut:
        touching = data.whole[:, find_contact(*data.whole).before :]
        earlier = _thinned(touching[:, touching[0] < data.t[0]])
    elif data.whole is not None and data.t[0] > 0.0:  # the contact is at zero
        some = data.whole[:, (data.whole[0] > 0.0) & (data.whole[0] < data.t[0])]
        earlier = np.concatenate([np.zeros((3, 1)), _thinned(some)], 1)
    t, load, depth = earlier
    n = t.size
    if n == 0:
        return data, np.ones(data.t.size, dtype=bool)
    # the history is not compared, so that its standard deviations have no effect
    errors = {
        name: np.concatenate([np.full(n, values.max()), values])
        for name in DEVIATIONS
        if (values := getattr(data, name)) is not None
    }
    marks = None if data.marks is None else np.concatenate([np.full(n, "approach"), data.marks])
    note = f"the curve from {t[0]:.4g} to {data.t[0]:.4g} s is taken as history, and not fitted"
    longer = IndentationData(
        t=np.append(t, data.t), load=np.append(load, data.load), depth=np.append(depth, data.depth), marks=marks,
        notes=(*data.notes, note), whole=data.whole, **origin_of(data), **errors,
    )  # fmt: skip
    return longer, np.arange(longer.t.size) >= n


def _thinned(points: np.ndarray) -> np.ndarray:
    """Return at most ``MOST`` of points (3, n), the first and the last included."""
    n = points.shape[1]
    return points[:, np.unique(np.linspace(0, n - 1, min(n, MOST)).round().astype(int))] if n else points


# Contact and pull-off of an adhesive force curve, read from the curve itself without a model of the contact.
#
# The zero of the load is that after the pull-off, at the end of the retraction (``zeroed``). On the approach the
# contact begins with the jump that brings the load to its lowest value, or, where none is seen, where the load leaves
# its noise and drift. On the retraction it ends where the load, after its lowest value, has lost ``LOST`` of it: a
# contact of short range that is retracted at a given depth breaks at 5/9 of the lowest load (K. L. Johnson, Contact
# Mechanics, 1985, section 5.5), and under a soft spring earlier.


SURE = 5.0  # standard deviations of the noise by which a load differs from zero
ONSET = 0.02  # fraction of the largest load, below which the zero of the load may drift
NEAR = 0.92  # fraction of the lowest load within which points determine it
TAIL = 10  # part of the retraction at its end, 1/TAIL, out of contact
# change of the load along that part, relative to the lowest load, of a curve that is out of contact
FLAT = 0.05
MEDIAN = 1.25  # standard error of a median over that of a mean
FEWEST = 6  # points that determine it


class PullOff(NamedTuple):
    """Quantities read from an adhesive force curve.

    force [N]: an estimate of the largest tension of the retraction, from which searches start; it is too large by about a
    standard deviation of the noise, since it follows from the lowest readings. work [J] and its standard deviation by
    noise: that of the tension over the depth in which the retraction is in tension; work_end [J]: largest error of the work
    from the depth at which the contact breaks, which is known to within the distance of two points. contact (n,) bool: the
    points in contact.
    """

    force: float
    work: float
    work_sd: float
    work_end: float
    contact: np.ndarray

    def separation_work(self, quantile: float) -> tuple[float, float, float]:
        """Return the work of separation and the limits of its interval [J], at a quantile of the normal distribution."""
        half = quantile * self.work_sd + self.work_end
        return self.work, self.work - half, self.work + half


def zeroed(data: IndentationData) -> tuple[IndentationData, float]:
    """Return the curve with the load counted from its median at the end of the retraction, and the standard error of that
    zero [N]; the curve as it is, and 0, where this end is in contact.

    The zero is also moved where it is zero within the noise: it may be off by several standard errors there, and a work of
    adhesion depends on it more than on the noise of the points in contact.
    """
    back = np.flatnonzero(data.segments == "retract")
    if back.size < FEWEST:
        return data, 0.0
    tail = back[-max(back.size // TAIL, 4) :]
    zero, spread = float(np.median(data.load[tail])), sample_noise(data.load) / np.sqrt(tail.size)
    first, second = np.array_split(data.load[tail], 2)
    change = abs(float(np.median(second) - np.median(first)))
    flat = change <= max(2.0 * SURE * spread, FLAT * abs(zero - float(data.load[back].min())))
    if not flat or np.any(held(data.load[back] - zero)[-tail.size :]):
        note = "the retraction ends in contact, so that the zero of the load is taken as given"
        return dataclasses.replace(data, notes=(*data.notes, note)), 0.0
    note = f"zero of the load: {zero:.4g} N, the median of the last {tail.size} points of the retraction"
    notes = (*data.notes, note) if abs(zero) >= SURE * MEDIAN * spread else data.notes
    return dataclasses.replace(data, load=data.load - zero, notes=notes), MEDIAN * spread


DEEPEST = 2.0  # depth over the radius of a ball, beyond which it is in other units


def too_deep(indenter: Any, depth: float) -> tuple[str, ...]:
    """Return the reason against a largest depth [m] beyond the diameter of a ball, which is in other units."""
    if not (isinstance(indenter, jc.Sphere) and depth > DEEPEST * float(indenter.radius)):
        return ()
    return (
        f"depth: expected less than {DEEPEST:g} times the radius of the ball, {float(indenter.radius):.3g} m, got"
        f" {depth:.3g} m: expected a depth in m and not in mm, um or nm, and a radius in m",
    )


def check_depth(indenter: Any, depth: float) -> None:
    """Raise ValueError for a depth that is ``too_deep``."""
    for reason in too_deep(indenter, depth):
        raise ValueError(reason)


# of the least load, which a retraction of the right sign does not have at its largest depths
LEAST_AT_ONCE = 0.75


def check_signs(data: IndentationData, radius: float) -> None:
    """Raise ValueError for an adhesive force curve whose load or depth has the wrong sign, or whose depth is larger than
    the radius of the ball [m], as in other units."""
    for name, sign, words in (("approach", 1.0, "grows"), ("retract", -1.0, "falls")):
        depth = data.depth[data.segments == name]
        if depth.size >= FEWEST and sign * (np.mean(depth[-2:]) - np.mean(depth[:2])) < 0.0:
            raise ValueError(
                f"depth: expected one that {words} during the {name}, got {depth[0]:.3g} to {depth[-1]:.3g} m: give the"
                " depth, and the load, with the other sign"
            )
    back = np.flatnonzero(data.segments == "retract")
    if back.size < FEWEST:
        return
    load, depth = data.load[back], data.depth[back]
    # with the other sign the load is least where it is deepest; that of an adhesive contact, which may be a tension
    # there too, is least at the pull-off
    order = np.argsort(depth)
    deep, deepest = order[-max(back.size // TAIL, 2) :], float(np.mean(load[order[-3:]]))
    if float(np.mean(load[deep])) < float(np.median(load)) and deepest < LEAST_AT_ONCE * float(np.min(load)):
        raise ValueError(
            f"load: expected the largest loads at the largest depths, got {np.mean(load[deep]):.3g} N there and"
            f" {np.median(load):.3g} N on average over the retraction: give the load with the other sign"
        )
    way = float(np.ptp(depth[held(load)]))
    if way > radius:
        raise ValueError(
            f"depth: expected a contact less deep than the radius of the ball, {radius:.3g} m, got {way:.3g} m: expected a"
            " depth in m and not in mm, um or nm"
        )


def read_pull_off(data: IndentationData, zero_sd: float = 0.0) -> PullOff:
    """Return what an adhesive force curve tells without a model; ValueError for a curve without a pull-off.

    zero_sd: standard deviation of the zero of the load [N].
    """
    marks, load = data.segments, data.load
    back = np.flatnonzero(marks == "retract")
    spread = sample_noise(load)
    if back.size < FEWEST or not load[back].min() < -SURE * spread:
        found = "no retraction" if back.size < FEWEST else f"a lowest load of {load[back].min():.3g} N"
        raise ValueError(
            f"adhesion: expected a retraction with a tension above {SURE:g} standard deviations of the noise"
            f" ({SURE * spread:.3g} N), got {found}"
        )
    contact = np.ones(load.size, dtype=bool)
    contact[back] = held(load[back])
    there = np.flatnonzero(marks == "approach")
    if there.size:
        # from the jump into contact, or from where the load leaves its noise and drift
        before = load[there]
        least = max(SURE * spread, ONSET * float(before.max()))
        lowest, apart = int(np.argmin(before)), np.flatnonzero(before <= least)
        first = int(apart[-1]) + 1 if apart.size else 0
        contact[there] = np.arange(before.size) >= (lowest if before[lowest] < -least else first)
    # the largest tension, from a parabola through the points near it
    depth, after, on = data.depth[back], load[back], contact[back]
    lowest, near = int(np.argmin(after)), np.flatnonzero(on & (after < NEAR * after.min()))
    force = -float(after[lowest])
    if near.size >= FEWEST:
        x = depth[near] - depth[lowest]
        x = x / max(float(np.ptp(x)), 1e-300)
        A = np.stack([np.ones(x.size), x, x**2], -1)
        force = -float(np.min(A @ np.linalg.lstsq(A, after[near], rcond=None)[0]))
    return PullOff(force, *_work(depth, after, on, spread, zero_sd), contact)


def _work(
    depth: np.ndarray, load: np.ndarray, contact: np.ndarray, spread: float, zero_sd: float
) -> tuple[float, float, float]:
    """Return the work of the tension, its standard deviation, and its largest error from the depth at which the contact
    breaks, which is half way to the next point or up to that from it.

    The standard deviation is that of noise ``spread`` that is independent from point to point and of the zero of the load.
    """
    on = np.flatnonzero(contact)
    tension = np.flatnonzero(load[on] < 0.0)
    on = on[tension[0] :] if tension.size else on[:0]
    if on.size == 0:
        return 0.0, 0.0, 0.0
    steps = -np.diff(depth[on])
    weights = 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps))
    half = 0.5 * abs(float(depth[on[-1]] - depth[on[-1] + 1])) if on[-1] + 1 < depth.size else 0.0
    weights[-1] += half
    end = half * float(np.median(np.abs(load[on[-IN_A_ROW:]])))
    sd = np.hypot(spread * np.sqrt(np.sum(weights**2)), zero_sd * np.sum(weights))
    return -float(weights @ load[on]), float(sd), end


CLOCK = Wanted("t", ("time", "step time"))
HEIGHT = Wanted("height", ("height", "smoothed height", "commanded height"))
SEPARATION = Wanted("separation", ("separation",))
AIR = 5  # number of points before contact below which no note is made
SPRING_FACT = r"(?im)^(?:spring\s?constant|k \(N/m\))[\s:=,]*([0-9.eE+-]+)(?:\s*N/m)?\s*$"  # JPK, Optics11


def read_indentation(
    path: str | os.PathLike, *, columns: dict | None = None, units: dict | None = None,
    segment: str | Sequence[str] | None = None, window: tuple[float | None, float | None] | None = None,
    curve: int | str | None = None, spring_constant: float | None = None, decimal: str | None = None,
) -> IndentationData:  # fmt: skip
    """Read time, load and depth of an indentation, or of a force curve.

    The curve is returned as measured; its method ``in_contact`` removes the points before contact.
    The depth of a force curve without one is the separation of tip and sample with the other sign, or else follows from
    the height and the cantilever, depth = z - load/k, counted from the first sample.

    Args:
        path: a text file (Hysitron, Optics11, Agilent, CSM, JPK text and others), or a force curve of a
            microscope: of Bruker, of Asylum (ARDF; Igor with igor2), or (JPK, HDF5) through the library afmformats.
        columns: as in ``read_creep``, with the keys "t", "load", "depth", "height", "separation" (of tip and sample), and
            "sigma_depth" and "sigma_load" for columns of standard deviations, in the unit of depth or load if they have
            none of their own.
        units: {"load": "uN", "depth": "nm"}; they take precedence over the header.
        segment: the selected segments: "approach", "hold", "retract", or several of them.
        window: (begin, end) [s] of the file's clock, None for an open side.
        curve: which of several curves in the file, by position from 0 or by name.
        spring_constant: of the cantilever [N/m], where the file does not state it.
        decimal: the decimal mark, "." or ",", if it is ambiguous.

    Returns:
        The curve in SI, with notes on what was read and corrected.

    Raises:
        ValueError: a file that cannot be read, in a message of one line.
        ImportError: a microscope's format without afmformats, or igor2.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "hold.txt"
        >>> rows = "".join(f"{t}\\t2\\t{3 + t}\\n" for t in range(6))
        >>> _ = file.write_text("Time (s)\\tLoad (uN)\\tDepth (nm)\\n" + rows)
        >>> print(fitting.read_indentation(file).load.max())
        2e-06
    """
    if force_curves.is_force_curve(path):
        _require_no_text_options(path, columns or units or decimal)
        found = force_curves.read(path, curve, spring_constant)
        data = build(os.fspath(path), IndentationData, **found)
    else:
        data = _indentation_text(path, columns, units, curve, spring_constant, decimal)
    data = data.only(segment) if isinstance(segment, str) else data.only(*(segment or ()))
    data = data.window(*window) if window else data
    before = data.contact.before
    if before <= AIR:
        return data
    note = f"{before} of {data.t.size} points are before contact: {LEAVE_OUT}"
    return dataclasses.replace(data, notes=(*data.notes, note))


def read_force(
    path: str | os.PathLike, *, curve: int | str | None = None, spring_constant: float | None = None,
    sensitivity: float | None = None, columns: dict | None = None, units: dict | None = None,
    window: tuple[float | None, float | None] | None = None, decimal: str | None = None,
) -> IndentationData:  # fmt: skip
    """Read a force curve for ``fit_force``, with its baseline and all segments.

    Args:
        path: a force curve of Bruker (NanoScope: a ramp or a force volume), of Asylum (ARDF; an Igor wave with igor2), or
            of JPK, AFM Workshop or HDF5 through the library afmformats, or a text file as in ``read_indentation``, which
            needs no times here.
        curve: which of several curves in the file, by position from 0 or by name.
        spring_constant: of the cantilever [N/m], where the file does not state it.
        sensitivity: of the deflection [m/V], where the file does not state it.
        columns, units, decimal: as in ``read_indentation``, for a text file.
        window: (begin, end) [s] of the file's clock, None for an open side.

    Returns:
        The curve in SI. If the file has no times, the points are numbered in their place, with a note.

    Raises:
        ValueError: a file that cannot be read, in a message of one line.
        ImportError: a microscope's format without afmformats, or igor2.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "curve.txt"
        >>> rows = "".join(f"{t}\\t{max(t - 9, 0)}\\t{10 * t}\\n" for t in range(20))
        >>> _ = file.write_text("Time (s)\\tLoad (nN)\\tDepth (nm)\\n" + rows)
        >>> print(fitting.read_force(file).load.max())
        1e-08
    """
    if force_curves.is_force_curve(path) or force_curves.is_force_text(path):
        _require_no_text_options(path, columns or units or decimal)
        data = build(
            os.fspath(path),
            IndentationData,
            **force_curves.read(path, curve, spring_constant, sensitivity, untimed=True),
        )
    else:
        given = path, columns, units, curve, spring_constant, decimal
        data = _indentation_text(*given, untimed=True)
        if "depth" not in (columns or {}) and np.ptp(data.depth[: data.depth.size // 20 + 2]) == 0.0:
            # Optics11 writes zeros before its own contact point, where a baseline needs the way
            data = _indentation_text(*given, untimed=True, raised=True)
    return data.window(*window) if window else data


def _require_no_text_options(path: str | os.PathLike, given: Any) -> None:
    """Raise ValueError if options for text files are given with a force curve of a microscope."""
    if given:
        raise ValueError(
            f"{os.fspath(path)}: columns, units, decimal: expected none for a force curve; they apply to text files"
        )


def _indentation_text(
    path: str | os.PathLike, columns: dict | None, units: dict | None, curve: int | str | None,
    spring_constant: float | None, decimal: str | None, untimed: bool = False, raised: bool = False,
) -> IndentationData:  # fmt: skip
    """Read a text file with all segments, without selection.

    untimed: whether a file without times is accepted; raised: whether a height is preferred to a depth.
    """
    keys = ("t", "load", "depth", "height", "separation", *ERRORS)
    table = read_table(path, decimal, columns, units, keys)
    untimed = untimed and not having(table, CLOCK)
    if untimed and "t" not in table.columns:
        # with a last column of times that numbers the rows
        blocks, count, places = [], itertools.count(), table.columns
        for block in table.blocks:
            rows = [(line, cells + [""] * (block.width - len(cells))) for line, cells in block.rows]
            rows = [
                (line, [*cells, str(next(count))] if is_data(cells, table.dialect.decimal) else cells)
                for line, cells in rows
            ]
            head = block.header
            if head:
                head = head._replace(cells=[*head.cells, "time"], units=[*head.units, "s"])
            else:
                places = {**places, "t": block.width}
            blocks.append(block._replace(header=head, width=block.width + 1, rows=rows))
        table = table._replace(blocks=blocks, columns=places, units={**table.units, "t": "s"})
    # the depth in its own column, or the separation of tip and sample, or the height of the base
    way = DEPTH
    if "height" in table.columns:
        way = HEIGHT
    elif not having(table, DEPTH) or raised or "separation" in table.columns:
        way = next((one for one in (SEPARATION, HEIGHT) if having(table, one)), DEPTH)
    errors = [
        Wanted(key, kind.names)
        for key, kind in zip(ERRORS, (DEPTH, LOAD), strict=True)
        if key in table.columns
    ]
    parts = curves_of(table, (CLOCK, LOAD, way, *errors), "read_indentation", curve)
    parts = [
        part._replace(marks=(part.name,) * part.lines.size) if named(part.name) else part for part in parts
    ]
    one = all(named(part.name) and not part.error for part in parts) and curve is None
    taken = cleaning.join(parts) if one else cleaning.choose(table.path, "curve", parts, curve)
    taken = cleaning.ordered(cleaning.complete(table.path, taken))
    t, load = taken.values["t"], taken.values["load"]
    depth = taken.values[way.key]
    if way is SEPARATION:
        depth, taken = -depth, taken.say(f"depth from {taken.columns[way.key].label!r}, with the other sign")
    if way is HEIGHT:
        k = spring_constant or stated_number(SPRING_FACT, taken.before)
        depth, note = tip_depth(table.path, t, load, depth, k)
        taken = taken.say(note) if note else taken
    marks = label(taken.marks, load, depth) if taken.marks else None
    notes = once((*taken.notes, *stated_facts(taken.before), *([UNTIMED] if untimed else [])))
    known = {key: taken.values[key] for key in ERRORS if key in taken.values}
    return build(
        table.path,
        IndentationData,
        t=t,
        load=load,
        depth=depth,
        marks=marks,
        notes=notes,
        numbered=untimed,
        **known,
    )
