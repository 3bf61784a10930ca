"""The schema of case files: for every key what it accepts, what it means, and what holds when it is absent.

``KINDS`` has the experiments, each with its tables; ``MATERIALS``, ``SHAPES`` and ``LAWS`` what may stand beside "material",
"shape" and "law". ``case_file`` reads by it, ``case_text`` writes by it, so that the two cannot differ.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from jaxcontact.files.case_heat import NO_SHIFT, SHIFTS, heat_of
from jaxcontact.files.chosen_times import ALL, FEW, LAST
from jaxcontact.indenters import shapes
from jaxcontact.inputs import laws, materials
from jaxcontact.inputs.adhesion import DugdaleAdhesion, ExponentialAdhesion
from jaxcontact.results.contact import AdhesiveHistory, ContactHistory
from jaxcontact.results.friction import ShearHistory, SteadyRolling
from jaxcontact.results.rubbing import RubbingHistory
from jaxcontact.results.sliding import SlidingHistory, SteadySliding
from jaxcontact.verbs.experiment import TimedExperiment
from jaxcontact.verbs.indent import Indentation, indent
from jaxcontact.verbs.roll_steady import roll_steady
from jaxcontact.verbs.rub import RubExperiment, rub
from jaxcontact.verbs.shear import Shearing, shear
from jaxcontact.verbs.slide import Sliding, slide
from jaxcontact.verbs.slide_steady import slide_steady


@dataclass(frozen=True)
class Accept:
    """What a value may be: a test, and the same in words."""

    test: Callable[[Any], bool]
    words: str


@dataclass(frozen=True)
class Key:
    """A key of a table: the values it accepts, its meaning, whether it is required, and its default.

    file: whether the name of a .npy file may stand for the value.
    """

    accept: Accept
    meaning: str
    required: bool = False
    default: Any = None
    file: bool = False

    @property
    def unit(self) -> str | None:
        """The SI unit of its value, which stands in its meaning; None of text, counts and plain numbers."""
        unit = re.search(r"\[([^\[\],]+)\]", self.meaning)
        return None if unit is None or self.accept is TEXT else unit.group(1)

    @property
    def words(self) -> str:
        """What it accepts and means, for a message."""
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


def _is_whole(value: Any, low: int, high: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high


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
    return Accept(lambda v: _is_whole(v, low, high), f"a whole number from {low} to {high}")


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
            "fluidity": Key(NOT_NEGATIVE, "rate of flow [1/(Pa s)]", default=0.0),
        }
        | VOLUME,
    ),
}

RADIUS = Key(POSITIVE, "radius [m]", required=True)

SHAPES: dict[str, tuple[type, dict[str, Key]]] = {
    "sphere": (shapes.Sphere, {"radius": RADIUS}),
    "cylinder": (
        shapes.Cylinder,
        {"radius": RADIUS, "length": Key(POSITIVE, "length along y [m]", required=True)},
    ),
    "cone": (
        shapes.Cone,
        {"half_angle": Key(POSITIVE, "between axis and side [rad], 1.227 for Berkovich", required=True)},
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

MATERIAL = Key(choice(*MATERIALS), "the model, whose parameters stand beside it", required=True)

LOAD_ON = Key(LOAD, "normal load [N], constant or one per time")
LOAD_WITH_ADHESION = Key(NUMBERS, "normal load [N], constant or one per time, negative in tension")
APPROACH = Key(NUMBERS, "approach from first touch [m], constant or one per time")
STEADY_LOAD = Key(POSITIVE, "normal load [N]")
STEADY_APPROACH = Key(NUMBER, "approach from first touch [m]")
TANGENTIAL = {
    "tangential_load": Key(VECTORS, "tangential load on the indenter [N], constant or one per time"),
    "tangential_displacement": Key(
        VECTORS, "displacement of the indenter from first touch [m], constant or one per time"
    ),
}
CREEPAGE = {
    "creepage": Key(VECTOR, "slip velocity of the indenter over the body, as rigid bodies, over the speed"),
    "tangential_load": Key(VECTOR, "tangential load on the indenter [N], in place of creepage"),
}

OVER_THE_BODY = "velocity of the indenter over the body [m/s]"
SLIP_FRICTION = Key(COEFFICIENT, "coefficient of friction, or a file of one per cell (nx, ny)", required=True)
SLIDE_FRICTION = Key(
    COEFFICIENT, "coefficient of friction, or a file of one per cell (nx, ny); none when absent"
)
COUPLED = Key(FLAG, "whether tractions cause normal, and pressure tangential, displacement", default=True)

TOLERANCE = Key(POSITIVE, "dimensionless error of a step", default=1e-8)
ITERATIONS = Key(whole_number(1, MOST_ITERATIONS), "largest number of iterations of a step", default=500)
MORE_ITERATIONS = Key(ITERATIONS.accept, ITERATIONS.meaning, default=2000)
SUBSTEPS = Key(whole_number(1, 1000), "number of inner steps between two times", default=1)
CORRESPONDENCE = Key(choice("exact", "quasi-elastic"), "time dependence of the response", default="exact")
SAVE = Key(
    choice(ALL, FEW, LAST),
    "times of the stored maps: all, at most nine, or the last; absent: all up to 32 MB, else nine",
)

Keys = dict[str, Key]


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
        "shift": Key(choice(NO_SHIFT, *SHIFTS), "how heat changes the body's times", default=NO_SHIFT),
        "shift_energy": Key(NOT_NEGATIVE, 'activation energy [J] of shift = "arrhenius"'),
        "shift_c1": Key(POSITIVE, 'c1 of shift = "wlf"'),
        "shift_c2": Key(POSITIVE, 'c2 [K] of shift = "wlf"'),
        "shift_reference": Key(POSITIVE, "temperature at which the body has its own times [K]"),
    },
)
RUBBING_PARTS = {
    "growth": CasePart(
        "law",
        laws.StressActivated,
        {
            "rate": Key(POSITIVE, "rate constant [m/s]", required=True),
            "activation_energy": Key(NOT_NEGATIVE, "energy at no stress [J]", required=True),
            "activation_volume": Key(NUMBER, "energy that stress saves, over the stress [m3]", required=True),
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

    verb: the function that runs it; result: the class of its result; beside: the keys beside "kind"; control: the keys of
    what is prescribed; solver: the keys of the function's options; example: the name of a ready-made case, of which
    common tables are taken if it is of another kind; memory: measured at 256 x 256 on a viscoelastic layer, bytes of work
    arrays for each byte of the kernels in a march, in a steady state fields of the grid; tangential: keyword of the
    tangential control and the keys of which one must be given; adhesive: the class of its result with a table [adhesion],
    None for a verb without adhesion; stationary: whether the indenter does not move over the
    body; times, march: the keys of times, and the class that checks the arguments for a march in blocks; None for a
    steady state; thickness: the key of a layer; parts: further tables.
    """

    verb: Callable[..., Any]
    result: type
    beside: Keys
    control: Keys
    solver: Keys
    example: str
    memory: float
    tangential: tuple[str, tuple[str, str]] | None = None
    adhesive: type | None = None
    stationary: bool = False
    times: Keys | None = None
    march: type[TimedExperiment] | None = None
    thickness: Key = Key(POSITIVE, "thickness [m]", required=True)
    parts: Mapping[str, CasePart] = field(default_factory=dict)


def _thickness(accept: Accept) -> Key:
    """The thickness of a layer, which may vary in the plane."""
    meaning = "thickness [m], or a file of one per cell (nx, ny)"
    return Key(or_file(accept), meaning, required=True, file=True)


KINDS: dict[str, Kind] = {
    "indentation": Kind(
        indent,
        ContactHistory,
        {},
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
        march=Indentation,
        thickness=_thickness(POSITIVE),
    ),
    "shear": Kind(
        shear,
        ShearHistory,
        {"friction": SLIP_FRICTION, "coupled": COUPLED},
        {"load": LOAD_ON, "approach": APPROACH} | TANGENTIAL,
        {"tolerance": TOLERANCE, "max_iterations": MORE_ITERATIONS, "substeps": SUBSTEPS, "save": SAVE},
        example="fretting_coating",
        memory=8.0,
        tangential=("tangential", ("tangential_load", "tangential_displacement")),
        stationary=True,
        times=TIMES_KEYS,
        march=Shearing,
    ),
    "sliding": Kind(
        slide,
        SlidingHistory,
        {
            "velocity": Key(SPEEDS, f"{OVER_THE_BODY}, constant or one per time", required=True),
            "friction": SLIDE_FRICTION,
        },
        {"load": LOAD_ON, "approach": APPROACH},
        {"tolerance": TOLERANCE, "max_iterations": ITERATIONS, "substeps": SUBSTEPS, "save": SAVE},
        example="sliding_film",
        memory=3.0,
        times=TIMES_KEYS,
        march=Sliding,
        parts={"thermal": HEAT},
    ),
    "rubbing": Kind(
        rub,
        RubbingHistory,
        {
            "velocity": Key(
                SPEEDS, "velocity of rubbing in place [m/s], held or one per time", required=True
            ),
            "friction": SLIDE_FRICTION,
            "wears": Key(choice("film", "indenter"), "what the laws change", default="film"),
        },
        {"load": LOAD_ON, "approach": APPROACH},
        {
            "tolerance": TOLERANCE,
            "max_iterations": ITERATIONS,
            "substeps": SUBSTEPS,
            "thickest": Key(
                POSITIVE, "thickness up to which kernels are made [m]; absent: twice that at first or more"
            ),
            "save": SAVE,
        },
        example="growing_tribofilm",
        memory=3.0,
        stationary=True,
        times=TIMES_KEYS,
        march=RubExperiment,
        thickness=_thickness(NOT_NEGATIVE),
        parts=RUBBING_PARTS,
    ),
    "steady-sliding": Kind(
        slide_steady,
        SteadySliding,
        {"velocity": Key(SPEED, OVER_THE_BODY, required=True), "friction": SLIDE_FRICTION},
        {"load": STEADY_LOAD, "approach": STEADY_APPROACH},
        {"tolerance": TOLERANCE, "max_iterations": ITERATIONS},
        example="sliding_film",
        memory=2000.0,
    ),
    "steady-rolling": Kind(
        roll_steady,
        SteadyRolling,
        {
            "velocity": Key(SPEED, OVER_THE_BODY, required=True),
            "friction": SLIP_FRICTION,
            "coupled": COUPLED,
        },
        {"load": STEADY_LOAD, "approach": STEADY_APPROACH} | CREEPAGE,
        {"tolerance": TOLERANCE, "max_iterations": MORE_ITERATIONS},
        example="rolling_wheel",
        memory=2500.0,
        tangential=("creepage", ("creepage", "tangential_load")),
    ),
}
KIND = Key(choice(*KINDS), "what is done, whose parameters stand beside it", default="indentation")


def sections_of(kind: str, *, adhesive: bool = False) -> dict[str, Keys]:
    """Return the tables of a case of this kind in order, each with its keys; adhesive: a load may then be tensile."""
    own = KINDS[kind]
    control = own.control | ({"load": LOAD_WITH_ADHESION} if adhesive and "load" in own.control else {})
    law = Key(
        choice(*LAWS), "attraction between the surfaces, whose parameters stand beside it", required=True
    )
    return {
        "experiment": {"kind": KIND} | own.beside,
        "layer": {"material": MATERIAL, "thickness": own.thickness},
        "substrate": {"material": MATERIAL},
        "indenter": {
            "shape": Key(choice(*SHAPES), "the shape, whose sizes stand beside it", required=True),
            "material": Key(TABLE, "a table of an elastic material; rigid when absent"),
        },
        **({} if own.adhesive is None else {"adhesion": {"law": law}}),
        "control": control,
        **{name: part.keys for name, part in own.parts.items()},
        **({} if own.times is None else {"times": own.times}),
        "grid": {
            "n": Key(whole_number(4, MOST_CELLS), "cells along x and y", default=256),
            "width": Key(POSITIVE, "width along x and y [m]; from the expected contact when absent"),
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
