"""The schema of case files: the tables of each kind of experiment, their keys, and all that files and commands know of it.

``KINDS`` has the experiments with their tables; ``MATERIALS``, ``SHAPES`` and ``LAWS`` have the keys that may stand beside
"material", "shape" and "law". ``case_file`` reads and writes by them, so that the two cannot differ.
"""

import dataclasses
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Any

import numpy as np

from jaxcontact._support import plugins
from jaxcontact._support.fields import FIELDS, TIME
from jaxcontact._support.prefixes import PREFIXES
from jaxcontact.bodies import laws, materials
from jaxcontact.bodies.laws import ArrheniusShift, DugdaleAdhesion, ExponentialAdhesion, Thermal, WLFShift
from jaxcontact.indenters import shapes
from jaxcontact.results.contact import (
    AdhesiveHistory,
    AdhesiveSlidingHistory,
    ContactHistory,
    RubbingHistory,
    ShearHistory,
    SlidingHistory,
    SteadyRolling,
    SteadySliding,
)
from jaxcontact.simulate.indent import Indentation, indent
from jaxcontact.simulate.roll_steady import roll_steady
from jaxcontact.simulate.rub import RubExperiment, rub
from jaxcontact.simulate.run import Experiment
from jaxcontact.simulate.shear import Shearing, shear
from jaxcontact.simulate.slide import Sliding, slide
from jaxcontact.simulate.slide_steady import slide_steady

# The choice of the times at which a run stores its maps.
#
# A map takes about a thousand times the space of the other results of a step, and few maps are ever examined. With
# "few" ``result.npz`` is the complete history at a few of the times, and ``course.npz`` has lines and scalars at all
# of them. By default a run keeps all maps if their total size is small, and a few otherwise.


FEW, ALL, LAST = "few", "all", "last"  # values of "save" in a case file and on the command line
MOST = 9  # number of maps kept with "few"
COURSE = "course.npz"  # the file with all times, where maps are kept at a few
SMALL = 32e6  # total size of the maps of a run, in bytes, up to which all are kept by default


def chosen(kept: str, count: int) -> np.ndarray:
    """Return the indices of those of ``count`` times whose maps are kept, in order; an empty array for "last".

    A few times are evenly spaced in their index, including the first and the last: logarithmic where the times are.
    """
    if kept == LAST:
        return np.zeros(0, int)
    return np.unique(
        np.linspace(0, count - 1, min(MOST, count) if kept == FEW else count).round().astype(int)
    )


def kept_unless_said(fields: Iterable[str], shape: tuple[int, int], count: int) -> str:
    """Return "all" if the maps of those fields at ``count`` times take no more than ``SMALL``, else "few"."""
    return ALL if maps_of(fields, count) * 8.0 * shape[0] * shape[1] <= SMALL else FEW


def maps_of(fields: Iterable[str], count: int) -> int:
    """Return the number of maps, of one number per cell, of those fields at ``count`` times; a vector has two."""
    dims = [FIELDS[name].dimensions for name in fields]
    return sum((1 + ("direction" in dim)) * (count if "time" in dim else 1) for dim in dims if "x" in dim)


def at_times(arrays: Mapping[str, np.ndarray], indices: np.ndarray) -> dict[str, np.ndarray]:
    """Return the arrays of a history at some of its times; slip, an increment per step, is summed between them."""
    picked = {
        name: values[indices] if _over_time(name, values) else values for name, values in arrays.items()
    }
    if "slip" in arrays and _over_time("slip", arrays["slip"]):
        begins = np.append(0, indices[:-1] + 1)
        picked["slip"] = np.add.reduceat(arrays["slip"][: indices[-1] + 1], begins)
    return picked


def time_series_of(arrays: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arrays of a history that have a value at every time, except maps, with the axis x of lines."""
    return {
        name: values
        for name, values in arrays.items()
        if name == "x" or (_over_time(name, values) and "y" not in FIELDS[name].dimensions)
    }


def _over_time(name: str, values: Any) -> bool:
    """Return whether an array, a field or an axis of a result, has a value for each time."""
    dims = FIELDS[name].dimensions if name in FIELDS else ()
    return dims[:1] == TIME and len(values.shape) >= len(dims)


# The keys of tables: the values that each accepts, its meaning, and its default; materials, shapes and laws.


@dataclass(frozen=True)
class Accept:
    """The values that a key accepts: a test, and its description."""

    test: Callable[[Any], bool]
    words: str


@dataclass(frozen=True)
class Key:
    """A key of a table: the values it accepts, its meaning, whether it is required, and its default.

    file: whether the name of a .npy file may stand for the value; example: the value of a required key in a template whose
    ready-made case does not have it.
    """

    accept: Accept
    meaning: str
    required: bool = False
    default: Any = None
    file: bool = False
    example: Any = None

    @property
    def unit(self) -> str | None:
        """The SI unit of its value, which stands in its meaning; None of text, counts and plain numbers."""
        unit = re.search(r"\[([^\[\],]+)\]", self.meaning)
        return None if unit is None or self.accept is TEXT else unit.group(1)

    @property
    def words(self) -> str:
        """The accepted values, the meaning and the default, for a message."""
        absent = "" if self.default is None else f", {str(self.default).lower()} when absent"
        return f"{self.accept.words}: {self.meaning}{absent}" if self.meaning else self.accept.words


def or_file(accept: Accept) -> Accept:
    """A value, or the name of a .npy file with one value for each cell."""
    named = lambda v: isinstance(v, str) and v.endswith(".npy")
    return Accept(lambda v: named(v) or accept.test(v), f"{accept.words}, or a .npy file")


SMALLEST, LARGEST = 1e-30, 1e30  # of any quantity: products and squares of them stay within float64
MOST_CELLS, MOST_TIMES, MOST_ITERATIONS = 2**16, 10**7, 10**9  # along an axis; in a run; of a step


def _is_number(value: Any) -> bool:
    """A number, not so large that it must be a slip; whole numbers may have any number of digits here."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST


def _all_numbers(value: Any, low: float = -math.inf) -> bool:
    return isinstance(value, list) and bool(value) and all(_is_number(v) and v >= low for v in value)


def _pair(value: Any, test: Callable[[Any], bool]) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(test, value))


def _is_load(value: Any) -> bool:
    """A load, or a history of loads that is positive somewhere."""
    values = value if isinstance(value, list) else [value]
    return _all_numbers(values, 0.0) and max(values) >= SMALLEST


def _is_vector(value: Any) -> bool:
    return _pair(value, _is_number)


def _is_flag(value: Any) -> bool:
    return isinstance(value, bool)


def choice(*names: str) -> Accept:
    """One of some words."""
    return Accept(lambda v: v in names, " | ".join(f'"{name}"' for name in names))


def whole_number(low: int, high: int) -> Accept:
    """A whole number from ``low`` to ``high``."""
    test = lambda v: isinstance(v, int) and not isinstance(v, bool) and low <= v <= high
    return Accept(test, f"a whole number from {low} to {high}")


RANGE = f"up to {LARGEST:g}"
POSITIVE = Accept(
    lambda v: _is_number(v) and v >= SMALLEST, f"a number > 0, from {SMALLEST:g} to {LARGEST:g}"
)
NOT_NEGATIVE = Accept(lambda v: _is_number(v) and v >= 0, f"a number >= 0, {RANGE}")
POISSON = Accept(lambda v: _is_number(v) and -1 < v <= 0.5, "a number with -1 < nu <= 0.5")
NUMBER = Accept(_is_number, f"a number, {RANGE}")
SHARE = Accept(lambda v: _is_number(v) and 0 <= v <= 1, "a number from 0 to 1")
LOAD = Accept(_is_load, f"a number > 0, or a list of numbers >= 0 that are not all zero, {RANGE}")
NUMBERS = Accept(lambda v: _is_number(v) or _all_numbers(v), f"a number or a list of numbers, {RANGE}")
POSITIVE_LIST = Accept(lambda v: _all_numbers(v) and min(v) >= SMALLEST, f"a list of numbers > 0, {RANGE}")
NOT_NEGATIVE_LIST = Accept(lambda v: _all_numbers(v, 0.0), f"a list of numbers >= 0, {RANGE}")
TIMES = Accept(
    lambda v: _all_numbers(v) and sorted(v) == v, "a list of numbers that do not decrease, one or more"
)
SHAPE = Accept(
    lambda v: _pair(v, whole_number(1, MOST_CELLS).test),
    f"[nx, ny], whole numbers from 4 to {MOST_CELLS}; ny = 1 with periodic = [false, true]",
)
SPACING = Accept(lambda v: _pair(v, POSITIVE.test), "[dx, dy], numbers > 0")
POSITIVE_PAIR = Accept(lambda v: _pair(v, POSITIVE.test), f"[x, y], numbers > 0, {RANGE}")
VECTOR = Accept(_is_vector, f"[x, y], numbers {RANGE}")
VECTORS = Accept(
    lambda v: isinstance(v, list) and bool(v) and (_is_vector(v) or all(map(_is_vector, v))),
    f"[x, y], or a list of them, numbers {RANGE}",
)
SPEED = Accept(lambda v: _is_number(v) or _is_vector(v), f"a number, along x, or [x, y], {RANGE}")
SPEEDS = Accept(
    lambda v: _is_number(v) or VECTORS.test(v), f"a number, along x, or [x, y], or a list of those, {RANGE}"
)
COEFFICIENT = Accept(
    lambda v: NOT_NEGATIVE.test(v) or isinstance(v, str), f"a number >= 0, {RANGE}, or a .npy file"
)
FLAG = Accept(_is_flag, "true or false")
PERIODIC = Accept(lambda v: _is_flag(v) or _pair(v, _is_flag), "true, false or [x, y] of them")
TEXT = Accept(lambda v: isinstance(v, str), "text")
TABLE = Accept(lambda v: isinstance(v, dict), "a table")
TABLES = Accept(
    lambda v: isinstance(v, dict) or (isinstance(v, list) and all(isinstance(one, dict) for one in v)),
    "a table, or a [[table]] for each",
)

G = Key(POSITIVE, "shear modulus [Pa]", required=True)
ETA = Key(POSITIVE, "viscosity [Pa s]", required=True)
NU = Key(POISSON, "Poisson's ratio", default=0.3)
VOLUME = {"nu": NU, "bulk_modulus": Key(POSITIVE, "elastic bulk modulus [Pa], in place of nu")}

MATERIALS: dict[str, tuple[type, dict[str, Key]]] = {
    "elastic": (
        materials.Elastic,
        {"G": Key(POSITIVE, "shear modulus [Pa]"), "E": Key(POSITIVE, "Young's modulus [Pa]"), "nu": NU},
    ),
    "maxwell": (materials.Maxwell, {"G": G, "eta": ETA} | VOLUME),
    "kelvin-voigt": (materials.KelvinVoigt, {"G": G, "eta": ETA} | VOLUME),
    "standard-linear-solid": (materials.StandardLinearSolid, {"G1": G, "G2": G, "eta2": ETA} | VOLUME),
    "burgers": (materials.Burgers, {"G1": G, "G2": G, "eta1": ETA, "eta2": ETA} | VOLUME),
    "prony": (
        materials.Prony,
        {
            "J0": Key(NOT_NEGATIVE, "instantaneous compliance [1/Pa]", required=True),
            "J": Key(NOT_NEGATIVE_LIST, "delayed compliances [1/Pa]", required=True),
            "tau": Key(POSITIVE_LIST, "retardation times [s]", required=True),
            "fluidity": Key(NOT_NEGATIVE, "fluidity [1/(Pa s)]", default=0.0),
        }
        | VOLUME,
    ),
}

# what may lie below all layers
BASES: dict[str, tuple[type, dict[str, Key]]] = MATERIALS | {"rigid": (materials.Rigid, {})}

RADIUS = Key(POSITIVE, "radius [m]", required=True)

SHAPES: dict[str, tuple[type, dict[str, Key]]] = {
    "sphere": (shapes.Sphere, {"radius": RADIUS}),
    "ellipsoid": (
        shapes.Ellipsoid,
        {"radii": Key(POSITIVE_PAIR, "radii of curvature along x and y [m]", required=True)},
    ),
    "cylinder": (
        shapes.Cylinder,
        {"radius": RADIUS, "length": Key(POSITIVE, "length along y [m]", required=True)},
    ),
    "cone": (
        shapes.Cone,
        {
            "half_angle": Key(
                POSITIVE, "angle between axis and side [rad], 1.227 for Berkovich", required=True
            )
        },
    ),
    "flat-punch": (shapes.FlatPunch, {"radius": RADIUS}),
    "height-field": (
        shapes.HeightField,
        {"heights": Key(TEXT, "a .npy file of heights (nx, ny) [m], relative to the case", required=True)},
    ),
}

WORK = Key(POSITIVE, "work of adhesion [J/m2]", required=True)

LAWS: dict[str, tuple[type, dict[str, Key]]] = {
    "exponential": (
        ExponentialAdhesion,
        {"work": WORK, "range": Key(POSITIVE, "range of the attraction [m]", required=True)},
    ),
    "dugdale": (
        DugdaleAdhesion,
        {"work": WORK, "strength": Key(POSITIVE, "traction between the surfaces [Pa]", required=True)},
    ),
}


def take_up_material(name: str) -> None:
    """Add the material of a plug-in (``jaxcontact.materials``) to ``MATERIALS`` and ``BASES`` unless it is there.

    Its keys are the fields of the class: positive numbers, or as ``may_be_zero`` and ``lists`` of the class say, required
    where they have no default. Units stand in ``units`` of the class, such as {"G": "Pa"}, and let text have a unit.

    Raises:
        ValueError: the plug-in cannot be imported, or is no material.
    """
    if name in MATERIALS or name not in plugins.names(plugins.MATERIALS):
        return
    found = plugins.load(plugins.MATERIALS, name)
    if not (isinstance(found, type) and issubclass(found, materials.Material)):
        raise ValueError(f"plug-in {name!r}: expected a subclass of jaxcontact.abc.Material, got {found!r}")
    keys = {}
    for each in dataclasses.fields(found):  # type: ignore[arg-type]
        zero, several = each.name in found.may_be_zero, each.name in found.lists
        unit = getattr(found, "units", {}).get(each.name)
        own = Key(
            {(False, False): POSITIVE, (False, True): POSITIVE_LIST, (True, False): NOT_NEGATIVE}.get(
                (zero, several), NOT_NEGATIVE_LIST
            ),
            f"{each.name} [{unit}]" if unit in UNITS else each.name,
        )
        keys[each.name] = dataclasses.replace(
            VOLUME.get(each.name, own),
            required=each.default is dataclasses.MISSING,
            default=each.default if isinstance(each.default, int | float) else None,
        )
    MATERIALS[name] = BASES[name] = found, keys


MATERIAL = Key(
    Accept(lambda v: v in MATERIALS, f"{choice(*MATERIALS).words}, or a material of a plug-in"),
    "the material model, whose parameters are keys of the same table",
    required=True,
)

BASE = Key(
    Accept(lambda v: v in BASES, f"{choice(*BASES).words}, or a material of a plug-in"),
    "the material model, whose parameters are keys of the same table, or a rigid base below layers",
    required=True,
)
BONDED = Key(
    FLAG, "whether it is bonded to what is below it or slides on that without friction", default=True
)

LOAD_ON = Key(LOAD, "normal load [N], constant or one for each time")
LOAD_WITH_ADHESION = Key(NUMBERS, "normal load [N], constant or one for each time, negative in tension")
APPROACH = Key(NUMBERS, "approach from first contact [m], constant or one for each time")
STEADY_LOAD = Key(POSITIVE, "normal load [N]")
STEADY_APPROACH = Key(NUMBER, "approach from first contact [m]")
TANGENTIAL = {
    "tangential_load": Key(VECTORS, "tangential load on the indenter [N], constant or one for each time"),
    "tangential_displacement": Key(
        VECTORS, "displacement of the indenter from first contact [m], constant or one for each time"
    ),
}
CREEPAGE = {
    "creepage": Key(
        VECTOR, "slip velocity of the indenter over the body, both taken as rigid, over the speed"
    ),
    "tangential_load": Key(VECTOR, "tangential load on the indenter [N], in place of creepage"),
}

THICKNESS = Key(POSITIVE, "thickness [m]", required=True)
OVER_THE_BODY = "velocity of the indenter over the body [m/s]"
SLIP_FRICTION = Key(
    COEFFICIENT, "coefficient of friction, or a file with one for each cell (nx, ny)", required=True
)
SLIDE_FRICTION = Key(
    COEFFICIENT, "coefficient of friction, or a file with one for each cell (nx, ny); none when absent"
)
HARDNESS = Key(
    or_file(POSITIVE),
    "hardness [Pa] of surfaces that yield, or a file with one for each cell (nx, ny); none when absent",
    file=True,
)
SHEAR_STRENGTH = Key(
    or_file(NOT_NEGATIVE),
    "shear stress [Pa], beside that of friction, of all that touches under a table [adhesion], or a file with one for each"
    " cell (nx, ny); none when absent",
    file=True,
)
COUPLED = Key(FLAG, "whether tractions cause normal, and pressure tangential, displacement", default=True)

TOLERANCE = Key(POSITIVE, "dimensionless error of a step", default=1e-8)
ITERATIONS = Key(whole_number(1, MOST_ITERATIONS), "largest number of iterations of a step", default=500)
MORE_ITERATIONS = Key(ITERATIONS.accept, ITERATIONS.meaning, default=2000)
SUBSTEPS = Key(whole_number(1, 1000), "number of inner steps between two times", default=1)
CORRESPONDENCE = Key(
    choice("exact", "quasi-elastic"), "method for the time dependence of the response", default="exact"
)
SAVE = Key(
    choice(ALL, FEW, LAST),
    "times of the stored maps: all, at most nine, or the last; absent: all up to 32 MB, else nine",
)

Keys = dict[str, Key]


# Quantities with units as text, "150 nm" or "2.5 mN", converted to SI units.
#
# The conversion is decimal throughout, so that "150 nm" is the floating-point number 150e-9 exactly.


MICRO = str.maketrans("µμ", "uu")


def _prefixed(unit: str, sign: int = 1) -> dict[str, Decimal]:
    """Return the unit with each of the prefixes; sign -1 for a reciprocal unit."""
    return {unit.replace("?", prefix): Decimal(10) ** (sign * power) for prefix, power in PREFIXES.items()}


LENGTHS = {"nm": Decimal("1e-9"), **_prefixed("?m"), "cm": Decimal("1e-2")}
SECONDS = {"s": Decimal(1), "min": Decimal(60), "h": Decimal(3600), "d": Decimal(86400)}
ELECTRONVOLT, AVOGADRO = Decimal("1.602176634e-19"), Decimal("6.02214076e23")  # exact, SI 2019
UNITS = {  # by the SI unit of a key: the units accepted after a number
    "m": LENGTHS,
    "s": SECONDS | {f"{prefix}s": Decimal(10) ** PREFIXES[prefix] for prefix in ("m", "u", "n")},
    "N": _prefixed("?N"),
    "Pa": _prefixed("?Pa"),
    "Pa s": _prefixed("?Pa s"),
    "1/Pa": _prefixed("1/?Pa", -1),
    "1/(Pa s)": _prefixed("1/(?Pa s)", -1),
    "m/s": {f"{length}/{time}": LENGTHS[length] / SECONDS[time] for length in LENGTHS for time in SECONDS},
    "1/m": _prefixed("1/?m", -1),
    "1/s": {f"1/{unit}": 1 / size for unit, size in SECONDS.items()},
    "J": {"J": Decimal(1), "eV": ELECTRONVOLT, "kJ/mol": Decimal(1000) / AVOGADRO},
    "m3": {"m3": Decimal(1), "nm3": Decimal("1e-27"), "A3": Decimal("1e-30"), "Å3": Decimal("1e-30")},
    "K": {"K": Decimal(1)},
    "W/(m K)": {"W/(m K)": Decimal(1)},
    "m2/s": {"m2/s": Decimal(1), "mm2/s": Decimal("1e-6")},
    "J/m2": {f"{energy}/{area}": size for energy, size in _prefixed("?J").items() for area in ("m2", "m^2")}
    | {f"{force}/m": size for force, size in _prefixed("?N").items()},
    "rad": {"rad": Decimal(1), "mrad": Decimal("1e-3"), "deg": Decimal(math.pi) / 180},
}
NUMBER_AND_UNIT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*(.*?)\s*")


def in_si(text: str, unit: str) -> float:
    """Return the quantity in ``unit``. Raises ValueError for another dimension or a missing unit."""
    found = NUMBER_AND_UNIT.fullmatch(text)
    known = UNITS[unit]
    written = " ".join(found.group(2).translate(MICRO).split()) if found else ""
    if found is None or written not in known:
        raise ValueError(f'text with a unit: "1 {next(iter(known))}", {", ".join(list(known)[1:6])}, ...')
    return float(Decimal(found.group(1)) * known[written])


# The table [thermal] of a case file: heat of friction, with the law by which it changes the times of the body.


SHIFTS: dict[str, tuple[Any, dict[str, str]]] = {  # by word: the law, and the keys of its arguments
    "arrhenius": (
        ArrheniusShift,
        {"shift_energy": "activation_energy", "shift_reference": "reference"},
    ),
    "wlf": (WLFShift, {"shift_c1": "c1", "shift_c2": "c2", "shift_reference": "reference"}),
}
NO_SHIFT = "none"


def heat_of(shift: str = NO_SHIFT, **given: Any) -> Thermal:
    """Return the ``Thermal`` of a table by its keys, those without a value None; ValueError for keys of another shift."""
    law, names = SHIFTS.get(shift, (None, {}))
    of_shifts = {name: given.pop(name) for name in list(given) if name.startswith("shift_")}
    for name, value in of_shifts.items():
        if (value is None) == (name in names):
            found = "missing" if value is None else "found"
            accepted = ", ".join(names) or "no other key of a shift"
            raise ValueError(f'thermal.{name}: {found} with shift = "{shift}"; accepted: {accepted}')
    own = None if law is None else law(**{names[name]: of_shifts[name] for name in names})
    return Thermal(shift=own, **given)


@dataclass(frozen=True)
class CasePart:
    """A table of a case that describes an argument of the function of its kind.

    argument: its keyword; makes: the class of the object; keys: the keyword arguments of the class; added: whether the
    table may be given several times, and the objects of all tables of that argument are added.
    """

    argument: str
    makes: Callable[..., Any]
    keys: Keys
    added: bool = False


TIMES_KEYS: Keys = {
    "end": Key(POSITIVE, "the last time [s]; the first is 0"),
    "steps": Key(whole_number(1, MOST_TIMES), "number of steps to the end"),
    "spacing": Key(choice("uniform", "logarithmic"), "spacing of the times", default="uniform"),
    "first": Key(POSITIVE, "the first time after 0 of logarithmic spacing [s]"),
    "values": Key(TIMES, "list of the times [s], in place of the other keys"),
}


HEAT = CasePart(
    "thermal",
    heat_of,
    {
        "ambient": Key(POSITIVE, "temperature far from the contact [K]", required=True),
        "conductivity": Key(POSITIVE, "thermal conductivity of the body [W/(m K)]", required=True),
        "share": Key(SHARE, "share of the heat of friction that enters the body", default=1.0),
        "diffusivity": Key(POSITIVE, "thermal diffusivity of the body [m2/s], for sliding"),
        "shift": Key(
            choice(NO_SHIFT, *SHIFTS),
            "law by which temperature changes the retardation times of the body",
            default=NO_SHIFT,
        ),
        "shift_energy": Key(NOT_NEGATIVE, 'activation energy [J] of shift = "arrhenius"'),
        "shift_c1": Key(POSITIVE, 'c1 of shift = "wlf"'),
        "shift_c2": Key(POSITIVE, 'c2 [K] of shift = "wlf"'),
        "shift_reference": Key(
            POSITIVE, "temperature at which the retardation times are those of the materials [K]"
        ),
    },
)
RUBBING_PARTS = {
    "growth": CasePart(
        "law",
        laws.StressActivated,
        {
            "rate": Key(POSITIVE, "rate constant [m/s]", required=True),
            "activation_energy": Key(NOT_NEGATIVE, "activation energy without stress [J]", required=True),
            "activation_volume": Key(NUMBER, "activation volume [m3]", required=True),
            "temperature": Key(POSITIVE, "temperature [K]; that of the contact, by [thermal], when absent"),
            "stress": Key(
                choice("pressure", "shear"), "driving stress; shear: friction x pressure", default="pressure"
            ),
        },
        added=True,
    ),
    "removal": CasePart(
        "law",
        laws.ProportionalRemoval,
        {"rate": Key(NOT_NEGATIVE, "removal per thickness and time [1/s]", required=True)},
        added=True,
    ),
    "wear": CasePart(
        "law",
        laws.Archard,
        {"coefficient": Key(NOT_NEGATIVE, "volume per load and path [1/Pa]", required=True)},
        added=True,
    ),
    "thermal": HEAT,
}


@dataclass(frozen=True)
class Kind:
    """An experiment: all that files, commands and checks know of it.

    verb: the function that runs it; result: the class of its result; experiment: the keys beside "kind"; control: the keys
    of what is prescribed; solver: the keys of the function's options; example: the name of a ready-made case, of which
    common tables are taken if it is of another kind; memory: measured at 256 x 256 on a viscoelastic layer, bytes of work
    arrays for each byte of the kernels in a march, in a steady state fields of the grid; tangential: keyword of the
    tangential control and the keys of which one must be given; adhesive: the class of its result with a table [adhesion],
    None for a verb without adhesion; stationary: whether the indenter does not move over the
    body; times, march: the keys of times, and the function that checks the arguments for a march in blocks; None for a
    steady state; thickness: the key of a layer; parts: further tables.
    """

    verb: Callable[..., Any]
    result: type
    experiment: Keys
    control: Keys
    solver: Keys
    example: str
    memory: float
    tangential: tuple[str, tuple[str, str]] | None = None
    adhesive: type | None = None
    stationary: bool = False
    times: Keys | None = None
    march: Callable[..., Experiment] | None = None
    thickness: Key = THICKNESS
    parts: Mapping[str, CasePart] = field(default_factory=dict)


def _thickness(accept: Accept) -> Key:
    """The thickness of a layer, which may vary in the plane."""
    meaning = "thickness [m], or a file with one for each cell (nx, ny)"
    return Key(or_file(accept), meaning, required=True, file=True)


KINDS: dict[str, Kind] = {
    "indentation": Kind(
        indent,
        ContactHistory,
        {"hardness": HARDNESS},
        {"load": LOAD_ON, "approach": APPROACH},
        {
            "tolerance": TOLERANCE,
            "max_iterations": ITERATIONS,
            "substeps": SUBSTEPS,
            "correspondence": CORRESPONDENCE,
            "save": SAVE,
        },
        example="polymer_coating",
        memory=3.0,
        adhesive=AdhesiveHistory,
        stationary=True,
        times=TIMES_KEYS,
        march=Indentation.of,
        thickness=_thickness(POSITIVE),
    ),
    "shear": Kind(
        shear,
        ShearHistory,
        {"friction": SLIP_FRICTION, "shear_strength": SHEAR_STRENGTH, "coupled": COUPLED},
        {"load": LOAD_ON, "approach": APPROACH} | TANGENTIAL,
        {"tolerance": TOLERANCE, "max_iterations": MORE_ITERATIONS, "substeps": SUBSTEPS, "save": SAVE},
        example="fretting_coating",
        memory=8.0,
        tangential=("tangential", ("tangential_load", "tangential_displacement")),
        adhesive=ShearHistory,
        stationary=True,
        times=TIMES_KEYS,
        march=Shearing.of,
    ),
    "sliding": Kind(
        slide,
        SlidingHistory,
        {
            "velocity": Key(SPEEDS, f"{OVER_THE_BODY}, constant or one for each time", required=True),
            "friction": SLIDE_FRICTION,
            "shear_strength": SHEAR_STRENGTH,
            "hardness": HARDNESS,
        },
        {"load": LOAD_ON, "approach": APPROACH},
        {"tolerance": TOLERANCE, "max_iterations": ITERATIONS, "substeps": SUBSTEPS, "save": SAVE},
        example="sliding_film",
        memory=3.0,
        adhesive=AdhesiveSlidingHistory,
        times=TIMES_KEYS,
        march=Sliding.of,
        parts={"thermal": HEAT},
    ),
    "rubbing": Kind(
        rub,
        RubbingHistory,
        {
            "velocity": Key(
                SPEEDS, "velocity of rubbing in place [m/s], constant or one for each time", required=True
            ),
            "friction": SLIDE_FRICTION,
            "shear_strength": SHEAR_STRENGTH,
            "hardness": HARDNESS,
            "wears": Key(
                choice("film", "indenter"), "whether the laws change the film or the indenter", default="film"
            ),
        },
        {"load": LOAD_ON, "approach": APPROACH},
        {
            "tolerance": TOLERANCE,
            "max_iterations": ITERATIONS,
            "substeps": SUBSTEPS,
            "thickest": Key(
                POSITIVE,
                "largest thickness for which kernels are computed [m]; at least twice the initial one when absent",
            ),
            "save": SAVE,
        },
        example="growing_tribofilm",
        memory=3.0,
        adhesive=RubbingHistory,
        stationary=True,
        times=TIMES_KEYS,
        march=RubExperiment.of,
        thickness=_thickness(NOT_NEGATIVE),
        parts=RUBBING_PARTS,
    ),
    "steady-sliding": Kind(
        slide_steady,
        SteadySliding,
        {
            "velocity": Key(SPEED, OVER_THE_BODY, required=True),
            "friction": SLIDE_FRICTION,
            "shear_strength": SHEAR_STRENGTH,
        },
        {"load": STEADY_LOAD, "approach": STEADY_APPROACH},
        {"tolerance": TOLERANCE, "max_iterations": ITERATIONS},
        example="sliding_film",
        memory=2000.0,
        adhesive=SteadySliding,
    ),
    "steady-rolling": Kind(
        roll_steady,
        SteadyRolling,
        {
            "velocity": Key(SPEED, OVER_THE_BODY, required=True),
            "friction": SLIP_FRICTION,
            "spin": Key(
                NUMBER, "rotation on the body from x to y over the distance rolled [1/m]", default=0.0
            ),
            "shear_strength": SHEAR_STRENGTH,
            "coupled": COUPLED,
        },
        {"load": STEADY_LOAD, "approach": STEADY_APPROACH} | CREEPAGE,
        {"tolerance": TOLERANCE, "max_iterations": MORE_ITERATIONS},
        example="rolling_wheel",
        memory=2500.0,
        tangential=("creepage", ("creepage", "tangential_load")),
        adhesive=SteadyRolling,
    ),
}


KIND = Key(
    Accept(KINDS.__contains__, choice(*KINDS).words),
    "the kind of experiment, whose parameters are keys of the same table",
    default="indentation",
)


def sections_of(kind: str, *, adhesive: bool = False) -> dict[str, Keys]:
    """Return the tables of a case of this kind in order, each with its keys; adhesive: a load over time may be tensile."""
    own = KINDS[kind]
    control = own.control | ({"load": LOAD_WITH_ADHESION} if adhesive and own.times else {})
    law = Key(
        choice(*LAWS),
        "attraction between the surfaces, whose parameters are keys of the same table",
        required=True,
    )
    return {
        "experiment": {"kind": KIND} | own.experiment,
        "layer": {"material": MATERIAL, "thickness": own.thickness, "bonded": BONDED},
        "substrate": {"material": BASE},
        "indenter": {
            "shape": Key(
                choice(*SHAPES), "the shape, whose dimensions are keys of the same table", required=True
            ),
            "material": Key(TABLE, "a table of its material, elastic where it names none; rigid when absent"),
            "layer": Key(
                TABLES, "a coating: tables of its layers, as those of the body, from the surface down"
            ),
        },
        **({} if own.adhesive is None else {"adhesion": {"law": law}}),
        "control": control,
        **{name: part.keys for name, part in own.parts.items()},
        **({} if own.times is None else {"times": own.times}),
        "grid": {
            "n": Key(whole_number(4, MOST_CELLS), "cells along x and y", default=256),
            "width": Key(POSITIVE, "width along x and y [m]; chosen from the expected contact if absent"),
            "shape": Key(SHAPE, "cells along x and y, in place of n; with spacing"),
            "spacing": Key(SPACING, "size of a cell [m]; with shape"),
            "periodic": Key(
                PERIODIC,
                "whether the grid is periodic along x, y; [false, true]: plane strain",
                default=False,
            ),
        },
        "solver": own.solver,
    }


PARTS = {name: part for kind in KINDS.values() for name, part in kind.parts.items()}
OPTIONAL_SECTIONS = ("experiment", "layer", "adhesion", "grid", "solver", *PARTS)
SEVERAL = ("layer", *(name for name, part in PARTS.items() if part.added))  # each may be given several times
