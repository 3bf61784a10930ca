"""Flags of the fit commands, from the signatures and docstrings of ``read_*`` and ``fit_*``, and the arguments of these.

A parameter of a reader or a fit that is a number, a word or a switch is a flag of its name, with the default of the
signature and the first sentence of its docstring as help. FORMS has the parameters that the shell writes otherwise, such as
an indenter; ``Kind`` states which arguments have no flag, which flags a command has beside them, and which help texts
differ from the docstrings.
"""

import argparse
import contextlib
import dataclasses
import inspect
import math
import re
import types
import typing
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from tqdm import tqdm

import jaxcontact as jc
from fitting.data.exclusion import exclude
from fitting.data.weights import KINDS as WEIGHTS
from fitting.inference.resampling import resample
from fitting.models.structure import CLASSICAL, LAWS
from fitting.views.text import in_flags

FACE = 35.0  # half-angle of the pyramid that is assumed unless a tip is given [degrees]


class Kind(NamedTuple):
    """A kind of fit as a command: its reader and its fit.

    more: flags of FORMS that are added; without: parameters and options that have no flag; words: help, or keywords of
    argparse, by the names of options; weights: the default ones; nu: Poisson's ratio that is assumed, with a note, where
    none is given; either: options that exclude each other, and whether one of them is needed.
    """

    reader: Callable[..., Any]
    fit: Callable[..., Any]
    more: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    words: dict[str, Any] = {}  # noqa: RUF012
    weights: str = "estimated"
    nu: float | None = None
    either: tuple[tuple[tuple[str, ...], bool], ...] = ()


# 1. values of single flags


def number(flag: str, text: str) -> float:
    """Return a number; ValueError that names the flag."""
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{flag}: expected a number, got {text!r}") from None


def numbers(flag: str, text: str) -> list[float]:
    """Return the numbers of "1,2,3"."""
    return [number(flag, one) for one in text.split(",")]


def place(text: str) -> int | str:
    """Return a position, or a name."""
    return int(text) if text.isdigit() else text


def pairs(flag: str, texts: list[str]) -> dict[str, str]:
    """Return {name: value} of each "name=value"."""
    for text in texts:
        if "=" not in text:
            raise ValueError(f"{flag}: expected NAME=..., got {text!r}")
    return {name: value for name, _, value in (text.partition("=") for text in texts)}


def span(flag: str, text: str) -> tuple[float | None, float | None]:
    """Return the ends of "low:high", None for an empty one."""
    low, mark, high = text.partition(":")
    if not mark:
        raise ValueError(f"{flag}: expected LOW:HIGH, got {text!r}")
    return number(flag, low) if low else None, number(flag, high) if high else None


def half_angle(flag: str, text: Any) -> float:
    """Return a half-angle [rad]; ValueError unless it is between 0 and 90 degrees."""
    degrees = number(flag, text)
    if not 0.0 < degrees < 90.0:
        raise ValueError(f"{flag}: expected a half-angle between 0 and 90 degrees, got {degrees:g}")
    return math.radians(degrees)


class Usual(float):
    """The default of a flag, which a number that was given is not, however equal."""


def elastic(options: argparse.Namespace, name: str) -> jc.Elastic | None:
    """Return the elastic material of ``--name-modulus`` and ``--name-nu``, or None without a modulus."""
    E, nu = (getattr(options, f"{name}_{one}", None) for one in ("modulus", "nu"))
    if E is None:
        if nu is not None and not isinstance(nu, Usual):
            raise ValueError(
                f"--{name}-modulus: expected Young's modulus in Pa with --{name}-nu {nu:g}, got none, which is rigid"
            )
        return None
    assert nu is not None
    if not (E > 0 and -1.0 < nu <= 0.5):
        raise ValueError(f"--{name}-modulus: expected a modulus > 0 and -1 < nu <= 0.5, got {E:g} and {nu:g}")
    return jc.Elastic.from_young(E, nu)


def indenter_of(options: argparse.Namespace) -> Any:
    """Return the ball, punch, cone or pyramid of the flags."""
    solid = elastic(options, "ball") or elastic(options, "tip")
    punch, cone, assumes_pyramid = getattr(options, "punch", None), options.cone, hasattr(options, "pyramid")
    if cone is None and options.radius is not None:
        return (jc.FlatPunch if punch else jc.Sphere)(options.radius, solid)
    if isinstance(punch, float):
        return jc.FlatPunch(punch, solid)
    if cone is None and not assumes_pyramid:
        raise ValueError("--radius: expected the radius of the ball in m, or a --cone, got none")
    if cone is None:  # the cone of equal area: 4 tan(face)^2 d^2 = pi tan(cone)^2 d^2
        face = half_angle("--pyramid", FACE if options.pyramid is None else options.pyramid)
        return jc.Cone(math.atan(2.0 / math.sqrt(math.pi) * math.tan(face)))
    if options.radius is not None or punch:
        raise ValueError("--cone: expected no --radius and no --punch beside it")
    if str(cone).lower() == "berkovich":
        return jc.Cone.berkovich(solid)
    return jc.Cone(half_angle("--cone", cone), solid)


def adhesion_of(options: argparse.Namespace) -> Any:
    """Return the work of adhesion [J/m2] of the flags, or a word that says how it is found."""
    return _number_or("--adhesion", options.adhesion, "fit", "jkr", "auto")


def _area(options: argparse.Namespace) -> list[float] | None:
    """Return the coefficients of an area function in SI, or None."""
    if options.area is not None:
        return numbers("--area", options.area)
    if options.area_nm is None:
        return None
    given = numbers("--area-nm", options.area_nm)
    powers = [2.0, *(0.5**k for k in range(len(given) - 1))]
    return [c * 1e-9 ** (2.0 - power) for c, power in zip(given, powers, strict=True)]


# 2. forms of parameters and steps that are no plain number, word or switch


class Form(NamedTuple):
    """Flags of a parameter, by the names of their options with the keywords of argparse, and its value of the options;
    without a value the flags are those of a step between reader and fit."""

    flags: dict[str, dict[str, Any]]
    value: Callable[[argparse.Namespace], Any] | None = None


_float = lambda metavar, text: {"type": float, "metavar": metavar, "help": text}
_several = lambda metavar, text: {"action": "append", "default": [], "metavar": metavar, "help": text}
TIP = {
    "radius": _float("R", "radius of the ball or of the --punch [m]"),
    "punch": {"action": "store_true", "help": "a flat punch of that radius in place of a ball"},
    "cone": {"metavar": "A", "help": "a cone in place of a ball: half-angle [degrees], or berkovich"},
}
FORMS = {
    "model": Form(
        {"model": {"default": "Burgers", "metavar": "M"}},  # the help depends on the fit
        lambda o: o.model,
    ),
    "columns": Form(
        {"column": _several("KIND=HEADER", "")},  # the help has the kinds of the reader
        lambda o: {kind: place(text) for kind, text in pairs("--column", o.column).items()},
    ),
    "units": Form(
        {"unit": _several("KIND=UNIT", "unit of a quantity, which takes precedence over the header")},
        lambda o: pairs("--unit", o.unit),
    ),
    "window": Form({"window": {"metavar": "BEGIN:END"}}, lambda o: o.window and span("--window", o.window)),
    "segment": Form(
        {"segment": {"action": "append", "metavar": "S"}},
        lambda o: o.segment and [place(one) for one in o.segment],
    ),
    "curve": Form({"curve": {"metavar": "C"}}, lambda o: None if o.curve is None else place(o.curve)),
    "fixed": Form(
        {"fix": _several("NAME=VALUE", "hold a parameter at a value")},
        lambda o: {name: number("--fix", text) for name, text in pairs("--fix", o.fix).items()},
    ),
    "bounds": Form(
        {"bound": _several("NAME=LOW:HIGH", "bounds of a parameter; one side may be empty")},
        lambda o: {name: span("--bound", text) for name, text in pairs("--bound", o.bound).items()},
    ),
    "weights": Form({"weights": {"metavar": "W"}}),  # its value depends on the data: ``weighting``
    "indenter": Form(TIP, indenter_of),
    "substrate": Form(
        {
            "substrate_modulus": _float("E", "Young's modulus of the substrate [Pa]"),
            "substrate_nu": _float("NU", "Poisson's ratio of the substrate") | {"default": Usual(0.3)},
        },
        lambda o: elastic(o, "substrate"),
    ),
    "adhesion": Form(
        {"adhesion": {"default": "0", "metavar": "W"}},
        adhesion_of,
    ),
    "ramp": Form({"ramp": {"metavar": "T"}}, lambda o: _one_or_each("--ramp", o.ramp)),
    "errors": Form(
        {
            f"{name}_error": _float("E", f"relative standard deviation of the {name.replace('_', ' ')}, which enters the"
                                      " interval of the modulus") | {"default": 0.0}
            for name in ("spring_constant", "sensitivity")
        },
        lambda o: {
            name: value for name in ("spring_constant", "sensitivity") if (value := getattr(o, f"{name}_error")) != 0.0
        },
    ),
    "area": Form(
        {
            "area": {"metavar": "C0,C1,...", "help": "area function of the tip, c0 d^2 + c1 d + c2 d^(1/2) + c3 d^(1/4)"
                     " ..., in SI: c0 [-], c1 [m], c2 [m^1.5] ..."},
            "area_nm": {"metavar": "C0,C1,...", "help": "the same in powers of nm, as instruments print them: c0 [-],"
                        " c1 [nm], c2 [nm^1.5] ..."},
        },
        _area,
    ),
    "tau": Form(
        {"tau": {"metavar": "T,T,..."}},
        lambda o: None if o.tau is None or o.tau.lower() == "auto" else numbers("--tau", o.tau),
    ),
    "ball": Form({
        "ball_modulus": _float("E", "Young's modulus of the indenter [Pa]; rigid by default"),
        "ball_nu": _float("NU", "Poisson's ratio of the indenter") | {"default": Usual(0.3)},
    }),
    "tip": Form({
        "tip_modulus": _float("E", "Young's modulus of the tip [Pa], such as 1141e9 of diamond; rigid by default"),
        "tip_nu": _float("NU", "Poisson's ratio of the tip") | {"default": Usual(0.07)},
    }),
    "pyramid": Form({"pyramid": _float(
        "A", f"a four-sided pyramid of this half-angle between axis and face [degrees] (the default, {FACE:g})"
    )}),
    "spectrum": Form({"spectrum": {"action": "store_true", "help": "a continuous relaxation spectrum with what the data"
                                   " resolve of it, in place of --model"}}),
    "exclude": Form({"exclude": {"metavar": "X,X,...", "help": "leave out single points, by their times [s] or angular"
                                 " frequencies [rad/s], before --resample"}}),
    "resample": Form({"resample": _float("N", "average the samples to N points per decade of time")}),
    "tension": Form({"tension": _float("NU", "the test is in tension, with this Poisson's ratio")}),
    "in_contact": Form({"in_contact": {"nargs": "?", "const": "seen", "metavar": "DEPTH", "help": "leave out the points"
                                       " before contact, found from the load or given as a depth [m]"}}),
}  # fmt: skip


def _number_or(flag: str, text: Any, *words: str) -> Any:
    """Return a number, one of the words, or None."""
    return text if text is None or text.lower() in words else number(flag, text)


def _one_or_each(flag: str, text: str | None) -> float | list[float] | None:
    """Return the number of "1", the numbers of "1,2,3", or None."""
    values = None if text is None else numbers(flag, text)
    return values[0] if values and len(values) == 1 else values


# 3. flags of a kind, from its signatures and docstrings


def options_of(kind: Kind) -> dict[str, dict[str, Any]]:
    """Return the keywords of argparse for each option of a kind of fit."""
    found: dict[str, dict[str, Any]] = {}
    for function in (kind.fit, kind.reader):
        for name, parameter in inspect.signature(function).parameters.items():
            if name in kind.without:
                continue
            if name in FORMS and name != "tau":
                own = {one: dict(given) for one, given in FORMS[name].flags.items()}
                first = next(iter(own.values()))
                if not first.get("help"):
                    first["help"] = _help(function, name, kind)
            elif _is_plain(parameter.annotation):
                own = {name: _plain(parameter) | {"help": _words(function, name)}}
            else:
                continue
            found |= {one: given for one, given in own.items() if one not in found}
    for name in kind.more:
        found |= {one: dict(given) for one, given in FORMS[name].flags.items()}
    found = {one: given for one, given in found.items() if one not in kind.without}
    if "nu" in found and kind.nu is not None:
        found["nu"] |= {"default": None, "help": f"Poisson's ratio of the sample ({kind.nu:g}, with a note)"}
    if "weights" in found:
        found["weights"]["default"] = kind.weights
    for name, said in kind.words.items():
        if name in found:
            found[name] = {**found[name], **({"help": said} if isinstance(said, str) else said)}
    for given in found.values():  # the default stands in brackets at the end
        default, text = given.get("default"), given.get("help") or ""
        if default not in (None, [], 0.0, "") and "(" + str(default) not in text:
            given["help"] = f"{text} ({default:g})" if isinstance(default, float) else f"{text} ({default})"
    return found


def add(parser: Any, kind: Kind, options: dict[str, dict[str, Any]]) -> None:
    """Add the options of a kind to a parser."""
    groups = {
        name: group
        for names, needed in kind.either
        for group in [parser.add_mutually_exclusive_group(required=needed)]
        for name in names
    }
    for name, given in options.items():
        given = given | {"help": given["help"].replace("%", "%%")}
        groups.get(name, parser).add_argument(f"--{name.replace('_', '-')}", **given)


def _is_plain(annotation: Any) -> bool:
    """Return whether a value is a number, a word, a switch, or one of them or None."""
    return set(typing.get_args(annotation) or [annotation]) <= {float, int, str, bool, types.NoneType}


def _plain(parameter: inspect.Parameter) -> dict[str, Any]:
    """Return the keywords of argparse for a plain parameter."""
    kinds = set(typing.get_args(parameter.annotation) or [parameter.annotation])
    default = parameter.default if parameter.default is not parameter.empty else None
    if bool in kinds:
        return {"action": "store_true"}
    if str in kinds and float in kinds:  # a number or a word, which ``arguments`` converts
        return {"default": default if default is None else f"{default:g}", "metavar": "X"}
    if str in kinds:
        return {"default": default, "metavar": "NAME"}
    return {"type": float, "default": default, "metavar": "X"}


def _entry(function: Callable[..., Any], name: str) -> str:
    """Return what the docstring of a function says of a parameter, with what another one of its module says to which it
    refers."""
    text = re.search(
        rf"^ {{4}}(?:\w+, )*{name}(?:, \w+)*:(.*(?:\n {{8}}.*)*)",
        (inspect.getdoc(function) or "").partition("Args:")[2],
        re.MULTILINE,
    )
    said = " ".join(text[1].split()) if text else ""
    other = re.match(r"as in ``(\w+)``", said)
    known = other and function.__globals__.get(other[1])
    return _entry(known, name) if known else said


def _words(function: Callable[..., Any], name: str) -> str:
    """Return the first sentence on a parameter, in the words of the shell."""
    text = re.split(r"\.(?: |$)", _entry(function, name))[0]
    for python, shell in (
        (r"; None: ", "; by default "), (r", None for an open side", "; one side may be empty"),
        (r"^\(begin, end\)", "begin and end"), (r"``(\w+)=``", r"--\1"), (r"``(?:jc\.)?([^`]*)``", r"\1"),
        (r"\"(\w[\w-]*)\"", r"\1"),
    ):  # fmt: skip
        text = re.sub(python, shell, text)
    return text


def _help(function: Callable[..., Any], name: str, kind: Kind) -> str:
    """Return the help of a parameter that has a form: of weights, columns and a model what the fit takes."""
    said = _entry(function, name)
    if name == "model":
        lawful = "fractional" in said or "Springpot" in said
        return (
            f"material model: {', '.join([*(one.__name__ for one in CLASSICAL), *(LAWS if lawful else ())])}"
        )
    if name == "weights":
        taken = [one for one in WEIGHTS if f'"{one}"' in said] or WEIGHTS
        taken = sorted(taken, key=lambda one: one != kind.weights)
        return f"{', '.join(taken)}, or a standard deviation in the unit of the data in SI"
    if name == "columns":
        keys = dict.fromkeys(re.findall(r'"(\w+)"', said))
        return f"column of a quantity ({', '.join(keys)})".replace("sigma)", "sigma: standard deviations)")
    return _words(function, name)


# 4. arguments of readers and fits from the options


def arguments(function: Callable[..., Any], kind: Kind, options: argparse.Namespace) -> dict[str, Any]:
    """Return the keyword arguments of a reader or a fit; without those that depend on data, ``weights`` and ``sigma``."""
    found = {}
    for name, parameter in inspect.signature(function).parameters.items():
        form = FORMS.get(name)
        if name in kind.without or (form and not form.value):
            continue
        if form and form.value and all(hasattr(options, one) for one in {*form.flags} - {*kind.without}):
            found[name] = form.value(options)
        elif not form and _is_plain(parameter.annotation) and hasattr(options, name):
            value = getattr(options, name)
            mixed = {str, float} <= set(typing.get_args(parameter.annotation) or ())
            found[name] = _number_or(f"--{name.replace('_', '-')}", value, "fit") if mixed else value
    return found


def read(kind: Kind, file: str, options: argparse.Namespace, **given: Any) -> Any:
    """Return the data of a file, without excluded points and averaged as the flags say; error messages name flags."""
    own = arguments(kind.reader, kind, options)
    taken = inspect.signature(kind.reader).parameters
    tension = getattr(options, "tension", None)
    if tension is not None and not -1.0 < tension <= 0.5:
        raise ValueError(f"--tension: expected -1 < Poisson's ratio <= 0.5, got {tension:g}")
    if tension is not None and "nu" in taken:
        if own.get("convention", "J") != "J":
            raise ValueError(f"--convention: expected none with --tension, got {options.convention}")
        own["nu"] = tension
        # of compliances and of moduli; None is tension where nu is given
        if taken["convention"].default is not None:
            own["convention"] = {"J": "D", "G": "E"}[taken["convention"].default]
    elif "nu" in own:  # that of a fit
        del own["nu"]
    try:
        data = kind.reader(file, **(own | given))
    except ValueError as error:
        message = in_flags(str(error))
        if hasattr(options, "kinds"):  # of several kinds of curves, with a flag for the kind
            flag = "--data" if hasattr(options, "frequencies") else "--of"
            several = r"jaxcontact fit (creep|relaxation|oscillation|indentation) reads it"
            message = re.sub(several, rf"{flag} \1 reads it", message)
        raise ValueError(message) from error
    if "exclude" in kind.more and options.exclude is not None:
        with about(file):
            data = exclude(data, numbers("--exclude", options.exclude))
    return data


def averaged(kind: Kind, file: str, options: argparse.Namespace, data: Any) -> Any:
    """Return the data resampled according to ``--resample``."""
    if "resample" not in kind.more or options.resample is None:
        return data
    with about(file):
        return resample(data, options.resample)


def weighting(kind: Kind, options: argparse.Namespace, data: Any) -> dict[str, Any]:
    """Return weights or sigma, none without such a flag; standard deviations in the data take precedence over the default
    weights."""
    if not hasattr(options, "weights"):
        return {}
    ends = ("",) if not hasattr(data, "sigma_load") else ()
    if not ends and getattr(options, "control", None):  # of the quantity that is not prescribed
        ends = ("_load" if options.control.lower() == "depth" else "_depth",)
    has = any(
        getattr(data, f"{name}{end}", None) is not None for name in ("sigma", "scatter") for end in ends
    )
    chosen = options.weights.lower()
    if chosen in WEIGHTS:
        return {"weights": None if has and chosen == kind.weights else chosen}
    try:
        return {"weights": None, "sigma": float(chosen)}
    except ValueError:
        raise ValueError(
            f"--weights: expected {', '.join(WEIGHTS)} or a number, got {options.weights!r}"
        ) from None


def nu_of(kind: Kind, options: argparse.Namespace, data: Any) -> tuple[Any, float | None]:
    """Return the data, with a note where Poisson's ratio is assumed, and Poisson's ratio of the material."""
    nu, tension = options.nu, getattr(options, "tension", None)
    if tension is not None:
        if nu not in (0.3, tension):
            raise ValueError(f"--nu: expected none with --tension {tension:g}, got {nu:g}")
        return data, tension
    if nu is None and kind.nu is not None and getattr(options, "bulk_modulus", None) is None:
        nu = kind.nu
        note = f"no --nu given: Poisson's ratio is taken as {nu:g}, on which the modulus is conditional: E goes with"
        note += " 1 - nu^2"
        data = dataclasses.replace(data, notes=(*data.notes, note))
    return data, nu


@contextlib.contextmanager
def about(file: str) -> Iterator[None]:
    """Prefix errors with the file and name flags in them; meanwhile a terminal shows which file is being fitted."""
    try:
        with tqdm(desc=f"fitting {file}", bar_format="{desc} ...", disable=None, leave=False):
            yield
    except ValueError as error:
        raise ValueError(f"{file}: {in_flags(str(error))}") from error


def check_metres(options: argparse.Namespace, **largest: float) -> None:
    """Raise ValueError where a length is so large that it was hardly meant in metres."""
    for name, limit in largest.items():
        value = getattr(options, name, None)
        if isinstance(value, float) and value > limit:
            flag = f"--{name.replace('_', '-')}"
            raise ValueError(
                f"{flag}: expected a length in m, got {value:g} m, and {value:g} um is {flag} {value:g}e-6"
            )


def add_file(parser: Any, several: bool, needed: bool, what: str) -> None:
    """Add the input file, or several, and the output directory."""
    parser.add_argument("file", metavar="FILE", help=what, **({"nargs": "+"} if several else {}))
    where = "directory of the results" if needed else "directory of the results (NAME-fit)"
    parser.add_argument("-o", dest="directory", type=Path, metavar="DIR", required=needed, help=where)
    parser.add_argument("--force", action="store_true", help="overwrite the contents of DIR")
