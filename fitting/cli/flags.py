"""Command-line flags shared by the fit commands, their conversion to keyword arguments, and errors in terms of flags."""

import argparse
import contextlib
import dataclasses
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from tqdm import tqdm

from fitting.data.exclusion import exclude
from fitting.data.weights import KINDS
from fitting.fits.fractional import LAWS
from fitting.inference.resampling import resample
from fitting.models.structure import CLASSICAL
from fitting.read.creep import read_creep
from fitting.views.text import in_flags

CONVENTION, NU = "J", 0.3  # of a compliance, and Poisson's ratio, unless others are given


def add_segment(parser: Any, what: str) -> None:
    """Add the flag that selects segments of a file."""
    parser.add_argument("--segment", action="append", metavar="S", help=what)


def add_file(parser: Any, several: bool = False) -> None:
    """Add the input file and the output directory."""
    what = "CSV, TSV or an export with columns that name their units"
    parser.add_argument("file", metavar="FILE", help=what, **({"nargs": "+"} if several else {}))
    parser.add_argument(
        "-o", dest="directory", type=Path, metavar="DIR", required=True, help="directory of the results"
    )
    parser.add_argument("--force", action="store_true", help="overwrite the contents of DIR")


def add_common(parser: Any, weights: str, text: str, kinds: str, window: str = "times [s]") -> None:
    """Add the flags for reading a file and weighting a fit, without those for weights if the default ``weights`` is "";
    window: the quantity by which points are selected."""
    if weights:
        parser.add_argument("--weights", default=weights, metavar="W", help=f"{text} ({weights})")
    parser.add_argument(
        "--level", type=float, default=0.95, metavar="L", help="confidence level of the intervals (0.95)"
    )
    selected = f"selected {window}; one side may be empty"
    parser.add_argument("--window", metavar="BEGIN:END", help=selected)
    add_places(parser, kinds)


def add_places(parser: Any, kinds: str) -> None:
    """Add the flags for the columns of a file."""
    parser.add_argument("--decimal", metavar="MARK", help='decimal mark, "." or ",", if it is ambiguous')
    _add_pairs(parser, "column", "KIND=HEADER", f"column of a quantity ({kinds})")
    _add_pairs(parser, "unit", "KIND=UNIT", "unit of a quantity, which takes precedence over the header")


def add_model(parser: Any, laws: bool = False) -> None:
    """Add the flags for the model, with fractional laws if ``laws``, and for known parameters."""
    names = ", ".join([*(cls.__name__ for cls in CLASSICAL), *(LAWS if laws else ())])
    parser.add_argument("--model", default="Burgers", metavar="M", help=f"material model: {names} (Burgers)")
    add_known(parser)


def add_known(parser: Any) -> None:
    """Add the flags for fixed and bounded parameters."""
    _add_pairs(parser, "fix", "NAME=VALUE", "hold a parameter at a value")
    add_bounds(parser)


def add_bounds(parser: Any) -> None:
    """Add the flag for bounded parameters."""
    _add_pairs(parser, "bound", "NAME=LOW:HIGH", "bounds of a parameter; one side may be empty")


def _add_pairs(parser: Any, flag: str, form: str, what: str) -> None:
    parser.add_argument(f"--{flag}", action="append", default=[], metavar=form, help=what)


def add_test(parser: Any, kinds: str, weights: str = "estimated") -> None:
    """Add the flags for reading and weighting a curve over time; weights: the default, "" for no such flag."""
    errors = (
        "estimated, proportional, relative, absolute, or a standard deviation in the unit of the data in SI"
    )
    add_common(parser, weights, errors, kinds)
    add_exclude(parser)
    add_volume(parser)
    parser.add_argument("--start", type=float, metavar="T", help="time of loading on the file's clock [s]")
    add_segment(
        parser, "one of several steps or intervals, by name or position from 0; repeat to join several"
    )


def add_resample(parser: Any) -> None:
    """Add the flag for resampling."""
    what = "average the samples to N points per decade of time"
    parser.add_argument("--resample", type=float, metavar="N", help=what)


def add_exclude(parser: Any) -> None:
    """Add the flag that leaves out single points."""
    what = "leave out single points, by their times [s] or angular frequencies [rad/s], before --resample"
    parser.add_argument("--exclude", metavar="X,X,...", help=what)


def excluded(options: argparse.Namespace, file: str, data: Any) -> Any:
    """Return the data without the points of ``--exclude``."""
    if options.exclude is None:
        return data
    with about(file):
        return exclude(data, [number("--exclude", text) for text in options.exclude.split(",")])


def add_volume(parser: Any) -> None:
    """Add the flags for Poisson's ratio."""
    parser.add_argument(
        "--tension", type=float, metavar="NU", help="the test is in tension, with this Poisson's ratio"
    )
    parser.add_argument(
        "--nu", type=float, default=NU, help="Poisson's ratio of the resulting material (0.3)"
    )


def add_creep(parser: Any, weights: bool = True) -> None:
    """Add the flags for reading and, if ``weights``, weighting a creep curve."""
    columns = "t, J, strain, stress, sigma: standard deviations"
    add_test(parser, columns, "estimated" if weights else "")
    parser.add_argument(
        "--convention",
        default=CONVENTION,
        metavar="C",
        help='convention of the compliance, "J" (gamma/tau) or "1/(2G)" (J)',
    )
    add_resample(parser)
    parser.add_argument(
        "--stress", type=float, metavar="S", help="constant stress of a file with strain alone [Pa]"
    )


def read(reader: Callable[..., Any], file: str, options: argparse.Namespace, **given: Any) -> Any:
    """Return the data of a file; error messages name flags."""
    columns = {kind: place(text) for kind, text in pairs("--column", options.column)}
    window = options.window and span("--window", options.window)
    places = {"columns": columns, "units": dict(pairs("--unit", options.unit)), "window": window}
    try:
        return reader(file, decimal=options.decimal, **places, **given)
    except ValueError as error:
        raise ValueError(_other_kind(in_flags(str(error)), options)) from error


def _other_kind(message: str, options: argparse.Namespace) -> str:
    """Return a message that names another command, for a command of several kinds of curves with the flag of the kind."""
    if not hasattr(options, "kind"):
        return message
    flag = "--data" if hasattr(options, "frequencies") else "--of"
    return re.sub(
        r"jaxcontact fit (creep|relaxation|oscillation|indentation) reads it", rf"{flag} \1 reads it", message
    )


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
        if value is not None and value > limit:
            flag = f"--{name.replace('_', '-')}"
            raise ValueError(
                f"{flag}: expected a length in m, got {value:g} m, and {value:g} um is {flag} {value:g}e-6"
            )


def place(text: str) -> int | str:
    """Return a position, or a name."""
    return int(text) if text.isdigit() else text


def half_angle(flag: str, degrees: float) -> float:
    """Return a half-angle [rad]; ValueError unless it is between 0 and 90 degrees."""
    if not 0.0 < degrees < 90.0:
        raise ValueError(f"{flag}: expected a half-angle between 0 and 90 degrees, got {degrees:g}")
    return math.radians(degrees)


def number(flag: str, text: str) -> float:
    """Return a number; ValueError that names the flag."""
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{flag}: expected a number, got {text!r}") from None


def weighting(options: argparse.Namespace, has_sigma: bool, usual: str = "estimated") -> dict[str, Any]:
    """Return weights or sigma, and the level; standard deviations in a file take precedence over the default weights."""
    level = {"level": options.level}
    if options.weights.lower() in KINDS:
        kind = options.weights.lower()
        return level | {"weights": None if has_sigma and kind == usual else kind}
    try:
        return level | {"weights": None, "sigma": float(options.weights)}
    except ValueError:
        raise ValueError(
            f"--weights: expected {', '.join(KINDS)} or a number, got {options.weights!r}"
        ) from None


def known(options: argparse.Namespace) -> dict[str, Any]:
    """Return fixed values and bounds."""
    return {
        "fixed": {name: number("--fix", text) for name, text in pairs("--fix", options.fix)},
        "bounds": bounds(options),
    }


def bounds(options: argparse.Namespace) -> dict[str, tuple[float | None, float | None]]:
    """Return the bounds."""
    return {name: span("--bound", text) for name, text in pairs("--bound", options.bound)}


def pairs(flag: str, texts: list[str]) -> list[tuple[str, str]]:
    """Return (name, value) of each "name=value"."""
    for text in texts:
        if "=" not in text:
            raise ValueError(f"{flag}: expected NAME=..., got {text!r}")
    return [(name, value) for name, _, value in (text.partition("=") for text in texts)]


def span(flag: str, text: str) -> tuple[float | None, float | None]:
    """Return the ends of "low:high", None for an empty one."""
    low, mark, high = text.partition(":")
    if not mark:
        raise ValueError(f"{flag}: expected LOW:HIGH, got {text!r}")
    return number(flag, low) if low else None, number(flag, high) if high else None


def crept(options: argparse.Namespace, file: str) -> tuple[Any, dict[str, Any]]:
    """Return a creep curve, and the keyword arguments that all fits of it share."""
    if options.tension is not None and options.convention != CONVENTION:
        raise ValueError(f"--convention: expected none with --tension, got {options.convention}")
    tensile = {} if options.tension is None else {"nu": options.tension, "convention": "D"}
    data = read(
        read_creep, file, options, stress=options.stress, start=options.start,
        segment=options.segment and [place(one) for one in options.segment],
        **{"convention": options.convention, **tensile},
    )  # fmt: skip
    data = resampled(options, file, excluded(options, file, data))
    return data, {"nu": nu_of(options)} | weighting(
        options, data.sigma is not None or data.scatter is not None
    )


def moduli(
    options: argparse.Namespace, file: str, reader: Callable[..., Any], **given: Any
) -> tuple[Any, float]:
    """Return a relaxation test or a frequency sweep, and Poisson's ratio of the material."""
    tensile = {} if options.tension is None else {"nu": options.tension, "convention": "E"}
    segment = options.segment and [place(one) for one in options.segment]
    data = read(reader, file, options, segment=segment, **tensile, **given)
    data = excluded(options, file, data)
    if "start" in given:  # measured over time
        data = resampled(options, file, data)
    return data, nu_of(options)


def assume_nu(data: Any, nu: float | None, usual: float) -> tuple[Any, float]:
    """Return the curve of an indenter and Poisson's ratio, the usual one with a note where none is given."""
    if nu is not None:
        return data, nu
    note = f"no --nu given: Poisson's ratio is taken as {usual:g}, on which the modulus is conditional: E goes with 1 - nu^2"
    return dataclasses.replace(data, notes=(*data.notes, note)), usual


def nu_of(options: argparse.Namespace) -> float:
    """Return Poisson's ratio of the material; ValueError for one beside that of a test in tension."""
    if options.tension is None:
        return options.nu
    if options.nu not in (NU, options.tension):
        raise ValueError(f"--nu: expected none with --tension {options.tension:g}, got {options.nu:g}")
    return options.tension


def averaged(data: Any) -> bool:
    """Return whether the data have the errors of means (``resample``)."""
    return getattr(data, "scatter", None) is not None


def resampled(options: argparse.Namespace, file: str, data: Any) -> Any:
    """Return the data resampled according to ``--resample``."""
    if options.resample is None:
        return data
    with about(file):
        return resample(data, options.resample)
