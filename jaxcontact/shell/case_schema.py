"""The schema of case files: the tables of each kind of experiment, and all that files and commands know of it.

``KINDS`` has the experiments, each with its tables, of the keys in ``case_keys``. ``case_file`` reads by it, ``case_text``
writes by it, so that the two cannot differ.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from jaxcontact.bodies import laws
from jaxcontact.bodies.laws import ArrheniusShift, Thermal, WLFShift
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
from jaxcontact.shell.case_keys import (
    APPROACH,
    BASE,
    BONDED,
    CORRESPONDENCE,
    COUPLED,
    CREEPAGE,
    HARDNESS,
    ITERATIONS,
    LAWS,
    LOAD_ON,
    LOAD_WITH_ADHESION,
    MATERIAL,
    MORE_ITERATIONS,
    MOST_CELLS,
    MOST_TIMES,
    NOT_NEGATIVE,
    NUMBER,
    OVER_THE_BODY,
    PERIODIC,
    POSITIVE,
    SAVE,
    SHAPE,
    SHAPES,
    SHARE,
    SHEAR_STRENGTH,
    SLIDE_FRICTION,
    SLIP_FRICTION,
    SPACING,
    SPEED,
    SPEEDS,
    STEADY_APPROACH,
    STEADY_LOAD,
    SUBSTEPS,
    TABLE,
    TABLES,
    TANGENTIAL,
    THICKNESS,
    TIMES,
    TOLERANCE,
    Accept,
    Key,
    Keys,
    choice,
    or_file,
    whole_number,
)
from jaxcontact.simulate.indent import Indentation, indent
from jaxcontact.simulate.roll_steady import roll_steady
from jaxcontact.simulate.rub import RubExperiment, rub
from jaxcontact.simulate.run import Experiment
from jaxcontact.simulate.shear import Shearing, shear
from jaxcontact.simulate.slide import Sliding, slide
from jaxcontact.simulate.slide_steady import slide_steady

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
