"""Creep curves: compliance, or strain under a stress, over time, validated once and in SI units; and their reader."""

import dataclasses
import os
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.data import cleaning, loading_time
from fitting.data import units as unit_table
from fitting.data.cleaning import (
    COMPLIANCE,
    CREEP_MODULUS,
    TIME,
    Series,
    Wanted,
    build,
    check_holdings,
    curves_of,
    having,
    heated,
    locate,
    once,
    stated_number,
)
from fitting.data.curves import absolute, array, deviations, since_load, times
from fitting.data.table import Block, Table, kind_of, number, read_table, says_shear
from fitting.views.text import described
from jaxcontact._support.pytree import require_real

CONVENTIONS = ("J", "1/(2G)", "D")


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


# Flow ramps and flow curves in the export of a rheometer, which are no creep tests although they have stress and
# strain.


NAMED = re.compile(
    r"flow\s*(?:ramp|sweep|curve|step)|shear\s*rate\s*(?:ramp|sweep)|viscosity\s*curve|flie(?:ß|ss)kurve|viskositätskurve"
    r"|courbe\s*d.écoulement|curva\s*de\s*flujo|流動曲線|フローカーブ",
    re.IGNORECASE,
)
RISE = 1.5  # least factor of the stress from the first quarter to the middle, and from there to the end


def sorted_out(table: Table, parts: list[Series], chosen: bool) -> list[Series]:
    """Return the curves of a creep file without its flow ramps, all of them where some are ``chosen`` by the caller.

    Raises:
        ValueError: the file has nothing else.
    """
    blocks = [block for block in table.blocks if _flows(block, table.dialect.decimal)]
    lines = {line for block in blocks for line, _ in block.rows}
    flowing = [part for part in parts if int(part.lines[0]) in lines]
    if not flowing or chosen:
        return parts
    left = [part for part in parts if int(part.lines[0]) not in lines]
    if not left:
        refuse(table.path, flowing[0])
    names = ", ".join(part.name or f"line {part.lines[0]}" for part in flowing)
    return [part.say(f"flow ramps left out: {names}") for part in left]


def check(table: Table, part: Series) -> None:
    """Raise ValueError for a chosen curve that is a flow ramp."""
    blocks = [block for block in table.blocks if any(line == part.lines[0] for line, _ in block.rows)]
    if blocks and _flows(blocks[0], table.dialect.decimal):
        refuse(table.path, part)


def refuse(path: str, part: Series) -> None:
    """Raise ValueError that says why a curve is no creep test."""
    name = f" ({part.name})" if part.name else ""
    raise ValueError(
        f"{path}: line {part.lines[0]}: expected a creep test, got a flow ramp{name}, whose rate is changed: it has no"
        " compliance, and its viscosity is not fitted here"
    )


def _flows(block: Block, decimal: str) -> bool:
    """Return whether a block has the name of a flow ramp, or a viscosity and a rate beside a stress that keeps changing."""
    if NAMED.search(block.name):
        return True
    if not {"viscosity", "shear rate", "stress"} <= set(block.kinds):
        return False
    stress = np.abs(block.numbers(block.kinds.index("stress"), {line for line, _ in block.rows}, decimal))
    stress = stress[np.isfinite(stress)]
    if stress.size < 8:
        return False
    quarter, middle, last = stress[stress.size // 4], stress[stress.size // 2], stress[-1]
    low, high = min(quarter, last), max(quarter, last)
    return bool(low > 0.0 and RISE * low <= middle and RISE * middle <= high)


STRAIN = Wanted("strain", ("strain", "tensile strain"))
STRESS = Wanted("stress", ("stress", "tensile stress"))
STRESS_FACT = r"(?im)\bstress=([0-9.eE+-]+)\s*;"  # RepTate, in Pa
# "Stress: 100 Pa", "Stress (Pa): 100"
STATED = (
    re.compile(
        r"\W*(?P<name>[^:=;,\t\d]+?)\s*[:=;,\t]+\s*(?P<value>[-+\d.,eE]+)[\s;,\t]*[\[(]?(?P<unit>[^\s;,\])]+)\W*"
    ),
    re.compile(
        r"\W*(?P<name>[^:=;,\t\d\[(]+?)\s*[\[(](?P<unit>[^\s\])]+)[\])]\s*[:=;,\t]+\s*(?P<value>[-+\d.,eE]+)[\s;,\t]*"
    ),
)


def read_creep(
    path: str | os.PathLike, *, columns: dict | None = None, units: dict | None = None, convention: str = "J",
    nu: float | None = None, stress: float | None = None, start: float | None = None,
    segment: int | str | Sequence[int | str] | None = None,
    window: tuple[float | None, float | None] | None = None, decimal: str | None = None,
) -> CreepData:  # fmt: skip
    """Read time and compliance, or time, strain and stress, or time and creep modulus, of a creep test.

    A creep modulus is strain over stress inverted, 1/D(t) (ISO 899-1, in tension): its inverse is the compliance.

    A stress column beside a compliance determines its meaning: J(t) if the stress is constant; if it varies, the
    compliance is the quotient of strain and stress, and the strain is used with the measured stress.

    Args:
        path: a text file: CSV, TSV, exports of rheometers (TRIOS, Anton Paar, RepTate) and others.
        columns: places of columns that the header does not identify: {"t": header or position from 0, "J": ...,
            "strain": ..., "stress": ..., "creep_modulus": ...}, and {"sigma": ...} for a column of standard deviations of J
            or strain, in the unit of these if it has none of its own.
        units: {"t": "h", "J": "1/MPa"}; they take precedence over the header.
        convention: meaning of the compliance: "J" = gamma/tau in shear, "1/(2G)", or "D" = strain/stress in
            tension, which needs nu.
        nu: Poisson's ratio of a tensile test, J = 2 (1 + nu) D; required for a column that is named as tensile
            ("D(t)", "tensile strain").
        stress: the constant stress [Pa] of a file that has strain alone.
        start: time of loading [s] on the file's clock. Without it the file must show it, and a note states the
            time used.
        segment: the step or interval of a file with several, by name or position from 0; several are joined.
        window: (begin, end) [s] of the file's clock, None for an open side.
        decimal: the decimal mark, "." or ",", if it is ambiguous.

    Returns:
        The curve in SI, with notes on what was read and corrected.

    Raises:
        ValueError: a file that cannot be read, in a message of one line.

    Example:
        >>> import pathlib, tempfile
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "film.csv"
        >>> _ = file.write_text("t [min],J [1/MPa]\\n" + "".join(f"{t},{2 + t}\\n" for t in range(1, 7)))
        >>> data = fitting.read_creep(file)
        >>> print(data.t[0], data.J[0])
        60.0 3e-06
    """
    if convention not in CONVENTIONS:
        raise ValueError(f"convention: expected one of {sorted(CONVENTIONS)}, got {convention!r}")
    keys = ("t", "J", "strain", "stress", "creep_modulus", "sigma")
    table = read_table(path, decimal, columns, units, keys)
    parts = curves_of(table, wanted_of(table, stress), "", segment, segment is not None)
    parts = sorted_out(table, parts, segment is not None)
    taken = cleaning.choose(table.path, "segment", parts, segment)
    check(table, taken)
    taken = heated(table, taken, None)
    return creep_of(table, taken, convention, nu, stress, start, window)


def creep_of(
    table: Table, taken: Series, convention: str, nu: float | None, stress: float | None, start: float | None,
    window: tuple[float | None, float | None] | None, temperature: float | None = None,
) -> CreepData:  # fmt: skip
    """Return the creep test of a series with the columns of ``wanted_of``."""
    if "creep_modulus" in taken.values:
        # its inverse is a compliance, of a test in tension unless the column names shear
        column = taken.columns["creep_modulus"]
        if "sigma" in taken.values:
            raise ValueError(
                f"{table.path}: columns['sigma']: expected none beside a creep modulus, got one: it is not that of 1/J"
            )
        shear = column.name == "shear creep modulus"
        inverse = column._replace(
            name="compliance" if shear else "tensile compliance",
            shown="shear compliance" if shear else column.shown,
        )
        values, columns = dict(taken.values), dict(taken.columns)
        modulus, _ = values.pop("creep_modulus"), columns.pop("creep_modulus")
        with np.errstate(divide="ignore"):
            compliance = np.where(modulus > 0.0, 1.0 / modulus, np.nan)
        taken = taken._replace(values=values | {"J": compliance}, columns=columns | {"J": inverse})
        taken = taken.say(f"{column.label}: its inverse is the compliance")
    if "J" in taken.values and "stress" in taken.values:
        taken = cleaning.settle(table.path, taken, window and window[1])
    convention, taken = _tension(table, taken, convention, nu)
    if "strain" in taken.values and "stress" in taken.values:
        taken = loading_time.from_rest(taken, start)
    taken = loading_time.shift(table.path, taken, start)
    fields: dict[str, Any] = {"convention": convention, "nu": nu}
    if "J" in taken.values:
        loading_time.check_clock(table.path, taken, start)
        taken = cleaning.complete(table.path, cleaning.window(taken, window), positive=("J",))
        taken = cleaning.check_times(table.path, cleaning.ordered(taken))
        fields |= {"J": taken.values["J"], "start": 0.0}
        loading_time.check_course(table.path, taken.values["t"], fields["J"])
    else:
        # with a stress, from the file or the caller
        if "stress" in taken.values and stress is not None:
            raise ValueError(
                f"{table.path}: stress: expected none for a file with a column of stress, got {stress!r}"
            )
        if "stress" not in taken.values:
            value = _stated_stress(taken.before) if stress is None else float(stress)
            if not value or not np.isfinite(value):
                raise ValueError(
                    f"{table.path}: stress: expected a stress in Pa that is not zero, got {value!r}"
                )
            constant = {"stress": np.full(taken.lines.size, value)}
            taken = taken._replace(values=taken.values | constant).say(f"constant stress {value:g} Pa")
        taken = cleaning.ordered(cleaning.complete(table.path, taken))
        taken, fields["stress"] = loading_time.loaded(table.path, taken, start)
        taken = cleaning.window(taken, window)
        taken = cleaning.check_times(table.path, taken)
        fields["strain"] = taken.values["strain"]
        loading_time.check_course(table.path, taken.values["t"], fields["strain"], fields["stress"][1])
    fields |= {"sigma": taken.values.get("sigma"), "temperature": temperature}
    return build(table.path, CreepData, t=taken.values["t"], notes=once(taken.notes), **fields)


def wanted_of(table: Table, stress: float | None) -> tuple[Wanted, ...]:
    """Return the wanted columns of a creep test: compliance where a block has it, otherwise strain and stress."""
    some, columns = lambda *wanted: bool(having(table, *wanted)), table.columns
    others = {"J", "strain", "stress"} & set(columns)
    wanted: tuple[Wanted, ...]
    if CREEP_MODULUS.key in columns or (some(CREEP_MODULUS) and not others):
        wanted = TIME, CREEP_MODULUS  # a compliance beside it is 1/D too
    elif some(COMPLIANCE) or not some(STRAIN):
        if not some(COMPLIANCE) and "J" not in columns:
            check_holdings(table, "a creep compliance or strain and stress", "read_creep")
        wanted = TIME, COMPLIANCE
    else:
        alone = stress is not None or _stated_stress(table.blocks[0].before) is not None
        if not some(STRAIN, STRESS) and not alone and "strain" not in columns:
            raise ValueError(
                f"{table.path}: column 'stress': expected one beside the strain, got none: give stress= [Pa]"
            )
        wanted = (TIME, STRAIN, STRESS) if some(STRAIN, STRESS) else (TIME, STRAIN)
    if "sigma" in table.columns:
        wanted = (*wanted, Wanted("sigma", wanted[1].names))
    # the stress, and the strain, in the columns beside a compliance, unless the stress is missing or ambiguous
    if COMPLIANCE in wanted and _is_located(table, STRESS):
        wanted = (*wanted, STRESS, *([STRAIN] if _is_located(table, STRAIN) else []))
    return wanted


def _is_located(table: Table, wanted: Wanted) -> bool:
    """Return whether each block with a compliance has one column of the wanted quantity."""
    blocks = having(table, COMPLIANCE)
    try:
        return bool(blocks) and all(locate(table, block, wanted) for block in blocks)
    except (ValueError, AssertionError):
        return False


def _tension(table: Table, taken: Series, convention: str, nu: float | None) -> tuple[str, Series]:
    """Return the convention that the columns declare; a tensile test is never taken as shear."""
    columns = [taken.columns[key] for key in ("J", "strain", "stress") if key in taken.columns]
    tensile = [column.label for column in columns if (column.name or "").startswith("tensile")]
    if tensile and nu is None:
        raise ValueError(
            f"{table.path}: column {tensile[0]!r}: a tensile test needs nu= for J = 2 (1 + nu) D, got none"
        )
    if tensile and convention == "1/(2G)":
        raise ValueError(f"{table.path}: convention: expected 'D' for {tensile[0]!r}, got {convention!r}")
    if tensile:
        return "D", taken.say(f"{tensile[0]}: tension, J = 2 (1 + nu) D with nu = {nu:g}")
    if nu is not None and convention != "D":
        raise ValueError(
            f"{table.path}: nu: goes with tension, convention='D'; got convention={convention!r}"
        )
    silent = [column.label for column in columns if not says_shear(column.shown)]
    if convention == "J" and len(silent) == len(columns):
        return convention, taken.say(f"{silent[0]}: taken as shear; for tension give convention='D' and nu=")
    return convention, taken


def _stated_stress(text: str) -> float | None:
    """Return the one stress [Pa] that the text above the columns states with its unit ("Stress: 100 Pa"), or None."""
    found = set()
    for parts in filter(None, (form.fullmatch(line) for line in text.splitlines() for form in STATED)):
        if kind_of(parts["name"]) in STRESS.names and unit_table.is_unit("stress", parts["unit"]):
            value = number(parts["value"], ".")
            value = number(parts["value"], ",") if value is None else value
            found |= set() if value is None else {value * unit_table.factor("stress", parts["unit"])}
    return found.pop() if len(found) == 1 else stated_number(STRESS_FACT, text)
