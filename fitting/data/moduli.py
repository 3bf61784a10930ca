"""Measured moduli, relaxation over time or storage and loss over frequency, validated and in SI units; and their readers."""

import dataclasses
import os
import re
from collections.abc import Sequence

import numpy as np

from fitting.data import cleaning, loading_time
from fitting.data.cleaning import (
    DRIFT,
    MODULUS,
    STORAGE,
    TIME,
    Series,
    Wanted,
    build,
    curves_of,
    having,
    heated,
    once,
)
from fitting.data.curves import absolute, array, since_load, times
from fitting.data.table import Table, read_table, says_shear
from fitting.views.text import described

CONVENTIONS = ("G", "E")


@dataclasses.dataclass(frozen=True, eq=False)
class RelaxationData:
    """Relaxation modulus, stress over strain after a strain step.

    Args:
        t: (n,) [s] since the step, > 0 or from 0 on, not decreasing.
        modulus: (n,) [Pa].
        convention: "G" in shear; "E" in tension, E = 2 (1 + nu) G.
        nu: Poisson's ratio, for "E" only.
        notes: remarks on what was read and corrected.
        start: time [s] of the strain step on the clock of t, which is subtracted; 0 if t counts from the step.
            None takes t as the time since the step, and adds a note if the spacing suggests that the clock started
            earlier (``fitting/data/curves.py``).
        temperature: of the test [K], for ``fit_master``.
        scatter: (n,) standard deviations up to a common factor, which a fit estimates; set by ``resample``.

    Raises:
        ValueError: any other input, with the expected and the received value.

    Example:
        >>> data = fitting.RelaxationData(t=[1, 2, 3, 4, 5], modulus=[9, 6, 4, 3, 2], convention="E", nu=0.5)
        >>> print(data.shear[0])
        3.0
    """

    t: np.ndarray
    modulus: np.ndarray
    convention: str = "G"
    nu: float | None = None
    notes: tuple[str, ...] = ()
    start: float | None = None
    temperature: float | None = None
    scatter: np.ndarray | None = None

    def __post_init__(self) -> None:
        since, late = since_load(times(self.t), self.start)
        for name, value in {"t": since, "start": 0.0, "notes": (*self.notes, *late)}.items():
            object.__setattr__(self, name, value)
        if self.t[0] < 0:
            raise ValueError(f"t: expected times >= 0, got {self.t[0]:g}")
        object.__setattr__(self, "modulus", array("modulus", self.modulus, self.t))
        if self.scatter is not None:
            object.__setattr__(self, "scatter", array("scatter", self.scatter, self.t))
        factor(self.convention, self.nu)
        object.__setattr__(self, "temperature", absolute(self.temperature))

    def __repr__(self) -> str:
        head = f"RelaxationData: {self.t.size} points, convention {self.convention}"
        rows = [("t", self.t, "s"), ("modulus", self.modulus, "Pa"), ("temperature", self.temperature, "K")]
        rows.append(("scatter", self.scatter, ""))
        return described(head, rows, self.notes)

    @property
    def shear(self) -> np.ndarray:
        """Relaxation modulus in shear G(t) [Pa], (n,)."""
        return self.modulus * factor(self.convention, self.nu)


@dataclasses.dataclass(frozen=True, eq=False)
class OscillationData:
    """Storage and loss moduli over angular frequency.

    Args:
        omega: (n,) angular frequency [rad/s] > 0, in any order; the points are sorted by it. At least two are different.
        storage: (n,) G' or E' [Pa].
        loss: (n,) G'' or E'' [Pa].
        convention: "G" in shear; "E" in tension, E = 2 (1 + nu) G.
        nu: Poisson's ratio, for "E" only.
        notes: remarks on what was read and corrected.
        temperature: of the test [K], for ``fit_master``.

    Attributes:
        reordered: whether the points had another order.

    Raises:
        ValueError: any other input, with the expected and the received value.

    Example:
        >>> data = fitting.OscillationData(omega=[1, 2, 3, 4, 5], storage=[1, 2, 3, 4, 5], loss=[1, 1, 1, 1, 1])
        >>> print(data.shear[0])
        (1+1j)
    """

    omega: np.ndarray
    storage: np.ndarray
    loss: np.ndarray
    convention: str = "G"
    nu: float | None = None
    notes: tuple[str, ...] = ()
    temperature: float | None = None
    reordered: bool = dataclasses.field(default=False, init=False)

    def __post_init__(self) -> None:
        omega = array("omega", self.omega)
        order = np.argsort(omega, kind="stable")
        if not omega[order[0]] > 0:
            raise ValueError(f"omega: expected frequencies > 0 rad/s, got {omega[order[0]]:g}")
        if np.ptp(omega) == 0.0:
            raise ValueError(f"omega: expected several frequencies, got {omega[0]:g} rad/s throughout")
        object.__setattr__(self, "reordered", bool(np.any(np.diff(omega) < 0)))
        factor(self.convention, self.nu)
        for name in ("omega", "storage", "loss"):
            object.__setattr__(self, name, array(name, getattr(self, name), omega)[order])
        object.__setattr__(self, "temperature", absolute(self.temperature))

    def __repr__(self) -> str:
        head = f"OscillationData: {self.omega.size} points, convention {self.convention}"
        rows = [("omega", self.omega, "rad/s"), ("storage", self.storage, "Pa"), ("loss", self.loss, "Pa")]
        rows.append(("temperature", self.temperature, "K"))
        return described(head, rows, self.notes)

    @property
    def shear(self) -> np.ndarray:
        """Complex shear modulus G' + i G'' [Pa], (n,) complex."""
        return (self.storage + 1j * self.loss) * factor(self.convention, self.nu)


def factor(convention: str, nu: float | None) -> float:
    """Return the factor from a modulus of this convention to shear; ValueError unless convention and nu are consistent."""
    if convention not in CONVENTIONS:
        raise ValueError(f"convention: expected one of {', '.join(CONVENTIONS)}, got {convention!r}")
    if convention == "E" and (nu is None or not -1.0 < nu <= 0.5):
        raise ValueError(f"nu: expected -1 < nu <= 0.5 for a tensile modulus (convention 'E'), got {nu!r}")
    if convention != "E" and nu is not None:
        raise ValueError(f"nu: expected none with convention {convention!r}, only 'E' needs it; got {nu!r}")
    return 1.0 if convention == "G" else 0.5 / (1.0 + (nu or 0.0))


OMEGA = Wanted("omega", ("angular frequency", "frequency"))
LOSS = Wanted("loss", ("loss modulus", "tensile loss modulus"))
COMPLEX = Wanted("complex", ("complex modulus", "tensile complex modulus"))
ANGLE = Wanted("delta", ("phase angle", "delta"))
FACTOR = Wanted("tan_delta", ("loss factor",))
# in order of preference
PAIRS = (
    (STORAGE, LOSS),
    (COMPLEX, ANGLE),
    (COMPLEX, FACTOR),
    (STORAGE, ANGLE),
    (STORAGE, FACTOR),
)
STRESS_NAMES, STRAIN_NAMES = ("stress", "tensile stress"), ("strain", "tensile strain")
CHANGING = 0.03  # change of the logarithm of a modulus above which a test shows whether the stress is proportional to it
STANDING = 0.2  # change of the logarithm of the stress over that of the modulus, below which it is not
# initial parts of the names of tensile columns
TENSILE = ("e(t)", "e'", 'e"', "e*", "|e*|", "estor", "eloss", "erelax", "tensile")

# in a heading of more words than the names of creep moduli in table.py, such as "Creep modulus of film A"
OF_CREEP = re.compile(
    r"creep[ _-]*(modulus|stiffness)|kriech[ _-]*modul|module de fluage|クリープ弾性率", re.IGNORECASE
)


def read_relaxation(
    path: str | os.PathLike, *, columns: dict | None = None, units: dict | None = None,
    convention: str = "G", nu: float | None = None, start: float | None = None,
    segment: int | str | Sequence[int | str] | None = None,
    window: tuple[float | None, float | None] | None = None, decimal: str | None = None,
) -> RelaxationData:  # fmt: skip
    """Read time and relaxation modulus, G(t) or E(t).

    Rows in which a column of strain beside it still rises are left out, and the step is taken in the middle of the rise,
    which is right for relaxation times of at least twice the rise (to 1 %).

    Args:
        path: a text file.
        columns: columns that the header does not identify: {"t": header or position from 0, "modulus": ...}.
        units: {"t": "min", "modulus": "kPa"}; they take precedence over the header.
        convention: "G" in shear, or "E" = 2 (1 + nu) G in tension, which needs nu.
        nu: Poisson's ratio of a tensile test. It is required for a column that is named as tensile.
        start: time [s] of the strain step on the file's clock; after a rise of the strain, that of its middle.
        segment: the step or interval of a file with several, by name or position from 0; several are joined.
        window: (begin, end) [s] of the file's clock, None for an open side.
        decimal: the decimal mark, "." or ",", if it is ambiguous.

    Returns:
        The curve in SI, with notes on what was read and corrected.

    Raises:
        ValueError: a file that cannot be read, in a message of one line.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "gel.csv"
        >>> _ = file.write_text("t [min],G(t) [kPa]\\n" + "".join(f"{t},{9 - t}\\n" for t in range(1, 7)))
        >>> data = fitting.read_relaxation(file)
        >>> print(data.t[0], data.modulus[0])
        60.0 8000.0
    """
    table = read_table(path, decimal, columns, units, ("t", "modulus"))
    parts = curves_of(table, (TIME, MODULUS), "read_relaxation", segment, True)
    taken = heated(table, cleaning.choose(table.path, "segment", parts, segment), None)
    check_relaxing(table, taken)
    strain = _beside(table, taken, STRAIN_NAMES)
    if strain is not None:
        taken, start = loading_time.after_rise(taken, *strain, start)
    return relaxation_of(table.path, taken, convention, nu, start, window)


def check_relaxing(table: Table, taken: Series) -> None:
    """Raise ValueError for the modulus of a creep test: stress over strain at a constant stress, 1/D(t).

    In a relaxation the stress is proportional to the modulus. A column of the stress, or else the modulus times a column of
    the strain, shows whether it is; their units do not matter.
    """
    for names in (STRESS_NAMES, STRAIN_NAMES):
        beside = _beside(table, taken, names)
        if beside is None:
            continue
        _, values = beside
        modulus = taken.values["modulus"]
        stress = values if names == STRESS_NAMES else values * modulus
        known = np.isfinite(stress) & np.isfinite(modulus) & (stress > 0.0) & (modulus > 0.0)
        if np.count_nonzero(known) < cleaning.LEAST:
            continue
        # without the first and last tenth, such as a rise of the stress and the noise at the end
        change, own = (np.ptp(np.quantile(np.log(one[known]), (0.1, 0.9))) for one in (stress, modulus))
        if own > CHANGING and change < STANDING * own:
            raise ValueError(
                f"{table.path}: column {taken.columns['modulus'].label!r}: expected a relaxation modulus, got one that"
                " changes while the stress does not, as in creep: read_creep reads it from strain and stress, or as"
                " columns={'creep_modulus': ...}"
            )
        return


def _beside(table: Table, taken: Series, names: Sequence[str]) -> tuple[str, np.ndarray] | None:
    """Return heading and magnitudes (n,) of a column of one of these kinds beside the rows taken, in any unit; None if there
    is none."""
    lines = set(taken.lines.tolist())
    for block in table.blocks:
        for place, kind in enumerate(block.kinds):
            if kind in names and block.header is not None:
                values = np.abs(block.numbers(place, lines, table.dialect.decimal))
                if values.size == taken.lines.size:
                    return block.header.cells[place], values
    return None


def relaxation_of(
    path: str, taken: Series, convention: str, nu: float | None, start: float | None,
    window: tuple[float | None, float | None] | None, temperature: float | None = None,
) -> RelaxationData:  # fmt: skip
    """Return the relaxation test of a series of times and moduli."""
    convention, taken = _tension(path, taken, convention, nu)
    taken = loading_time.shift(path, taken, start)
    loading_time.check_clock(path, taken, start)
    taken = cleaning.ordered(cleaning.complete(path, cleaning.window(taken, window)))
    taken = cleaning.check_times(path, taken)
    t, modulus = taken.values["t"], taken.values["modulus"]
    fields = {
        "t": t,
        "modulus": modulus,
        "convention": convention,
        "nu": nu,
        "notes": once(taken.notes),
        "start": 0.0,
        "temperature": temperature,
    }
    return build(path, RelaxationData, **fields)


def read_oscillation(
    path: str | os.PathLike, *, columns: dict | None = None, units: dict | None = None,
    convention: str = "G", nu: float | None = None, segment: int | str | Sequence[int | str] | None = None,
    window: tuple[float | None, float | None] | None = None, decimal: str | None = None,
) -> OscillationData:  # fmt: skip
    """Read a frequency sweep: storage and loss modulus, G' and G'' or E' and E''.

    Where a file lacks one of them, it may have |G*| or G' with the phase angle delta or tan delta.

    Args:
        path: a text file.
        columns: columns that the header does not identify: {"omega": header or position from 0, "storage": ...,
            "loss": ...}, or "complex", "delta", "tan_delta" in place of these.
        units: {"omega": "Hz", "storage": "kPa"}; they take precedence over the header. A column of frequencies
            without rad/s or Hz is read only with its unit.
        convention: "G" in shear, or "E" = 2 (1 + nu) G in tension, which needs nu.
        nu: Poisson's ratio of a tensile test. It is required for a column that is named as tensile.
        segment: the sweep of a file with several (temperatures, say), by name or position from 0; several are joined.
        window: (begin, end) [rad/s], None for an open side.
        decimal: the decimal mark, "." or ",", if it is ambiguous.

    Returns:
        The moduli in SI over angular frequency, with notes on what was read and corrected.

    Raises:
        ValueError: a file that cannot be read, in a message of one line.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "gel.csv"
        >>> rows = "".join(f"{f},{2 * f},{f}\\n" for f in range(1, 7))
        >>> _ = file.write_text("Frequency [Hz],G' [kPa],G'' [kPa]\\n" + rows)
        >>> data = fitting.read_oscillation(file)
        >>> print(round(data.omega[0], 3), data.storage[0], data.loss[0])
        6.283 2000.0 1000.0
    """
    keys = ("omega", *(one.key for one in (STORAGE, LOSS, COMPLEX, ANGLE, FACTOR)))
    table = read_table(path, decimal, columns, units, keys)
    parts = curves_of(table, (OMEGA, *pair_of(table)), "read_oscillation", segment, True)
    parts = swept(parts, 1 if segment is None else 0)
    taken = heated(table, cleaning.choose(table.path, "segment", parts, segment), DRIFT)
    return oscillation_of(table, taken, convention, nu, window)


def swept(parts: list[Series], most: float) -> list[Series]:
    """Return the frequency sweeps of a file, or all its parts where it has no sweep, or more than ``most``.

    Rows at one frequency are a test over time, strain or temperature, whose moduli are not those of the sweep.
    """
    divided = [cleaning.sweeps(part) if not part.error else ([part], []) for part in parts]
    moving = [one for some, _ in divided for one in some]
    still = [one for _, some in divided for one in some]
    parted = lambda part: [run for one in cleaning.runs(part) for run in cleaning.turned(one)]
    moving = [run for part in moving for run in ([part] if part.error else parted(part))]
    if not still or not 0 < len(moving) <= most:
        return sorted(moving + still, key=lambda part: int(part.lines[0]))
    lines = ", ".join(f"{part.lines[0]} to {part.lines[-1]}" for part in still)
    return [part.say(f"rows at one frequency, beside the sweep, left out: lines {lines}") for part in moving]


def oscillation_of(
    table: Table, taken: Series, convention: str, nu: float | None,
    window: tuple[float | None, float | None] | None, temperature: float | None = None,
) -> OscillationData:  # fmt: skip
    """Return the frequency sweep of a series of frequencies with a pair of moduli or angles."""
    path = table.path
    # a frequency that could be in rad/s as well as in Hz
    column = taken.columns["omega"]
    said = "omega" in table.units or re.search("rad|hz", column.unit or "", re.IGNORECASE)
    if column.name == "frequency" and not said:
        raise ValueError(
            f"{path}: column {column.label!r}: expected a frequency in rad/s or Hz, got neither: give"
            " units={'omega': 'Hz'} or 'rad/s'"
        )
    convention, taken = _tension(path, taken, convention, nu)
    taken = cleaning.complete(path, cleaning.window(taken, window), positive=("omega",))
    # a phase angle without a unit, or outside 0 to 90 degrees
    if "delta" in taken.columns:
        column = taken.columns["delta"]
        if column.unit is None:
            raise ValueError(
                f"{path}: column {column.label!r}: expected a phase angle in ° or rad, got neither: give"
                " units={'delta': 'deg'} or 'rad'"
            )
        most = float(np.nanmax(np.abs(taken.values["delta"])))
        if most >= 0.5 * np.pi:
            raise ValueError(
                f"{path}: column {column.label!r}: expected phase angles between 0 and 90°, got {np.degrees(most):.4g}°"
            )
    # a test over time, strain or temperature
    omega = taken.values["omega"]
    if omega.size > 1 and np.ptp(omega) == 0.0:
        raise ValueError(
            f"{path}: omega: expected several frequencies, got {omega[0]:g} rad/s throughout: a sweep of something"
            " else? give a frequency sweep"
        )
    # G' and G'' from one of the pairs
    values = taken.pick(np.argsort(omega, kind="stable")).values
    if "loss" not in values:
        tan = values["tan_delta"] if "tan_delta" in values else np.tan(values["delta"])
        storage = values["storage"] if "storage" in values else values["complex"] / np.hypot(1.0, tan)
        values = {"omega": values["omega"], "storage": storage, "loss": storage * tan}
    fields = values | {"convention": convention, "nu": nu, "notes": once(taken.notes)}
    return build(path, OscillationData, **fields, temperature=temperature)


def pair_of(table: Table) -> tuple[Wanted, Wanted]:
    """Return the preferred pair of columns that a block has completely; columns named by the caller come first."""
    named = sorted(PAIRS, key=lambda pair: -sum(one.key in table.columns for one in pair))
    complete = [pair for pair in named if having(table, *pair)]
    return (complete or named)[0]


def _tension(path: str, taken: Series, convention: str, nu: float | None) -> tuple[str, Series]:
    """Return the convention that the column declares; a tensile modulus is never taken as a shear modulus."""
    columns = [column for key, column in taken.columns.items() if key not in ("t", "omega", "temperature")]
    tensile = [
        c for c in columns if c.shown.lower().startswith(TENSILE) or (c.name or "").startswith("tensile")
    ]
    label = (tensile or columns)[0].label
    for column in columns:
        creep = "creep modulus" in (column.name or "") or OF_CREEP.search(column.label) is not None
        if creep or column.name in ("stress", "tensile stress"):
            what = (
                "a creep modulus: read_creep(columns={'creep_modulus': ...}) reads it"
                if creep
                else "a stress"
            )
            raise ValueError(f"{path}: column {column.label!r}: expected a modulus of this test, got {what}")
    if tensile and nu is None:
        raise ValueError(f"{path}: column {label!r}: a tensile test needs nu= for E = 2 (1 + nu) G, got none")
    if tensile:
        return "E", taken.say(f"{label}: tension, E = 2 (1 + nu) G with nu = {nu:g}")
    moduli = [column for column in columns if column.name not in ("phase angle", "delta", "loss factor")]
    if (
        convention == "G"
        and nu is None
        and not any(says_shear(c.shown) or c.shown.lower().startswith(("g", "|g")) for c in moduli)
    ):
        return convention, taken.say(f"{label}: taken as shear; for tension give convention='E' and nu=")
    return convention, taken
