"""The commands ``jaxcontact fit creep FILE -o DIR`` and ``jaxcontact fit indentation FILE -o DIR``.

Each prints the summary and leaves summary.json, curve.csv and fit.png in DIR. Bad input is a ValueError
of one line, for the command line to show; what it says of options it says of flags.
"""

import argparse
import contextlib
import json
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting.creep import fit_creep
from fitting.indentation import fit_indentation
from fitting.readers import read_creep, read_indentation
from fitting.structure import CLASSICAL
from fitting.weights import KINDS

# what the readers and fits call an option, and its flag
FLAGS = (
    (r"columns=\{'(\w+)': (?:\.\.\.|'([^']*)')\}", r"--column \1=\2"),
    (r"columns=\{('\w+': \d+(?:, )?)+\} for instance", "--column t=0 and so on"),
    (r"units=\{'(\w+)': \.\.\.\}", r"--unit \1=..."),
    (r"\bunits=", "--unit"),
    (r"window=\(([^,]*), ([^)]*)\)", r"--window \1:\2"),
    (r"decimal='\.' or ','", "--decimal . or --decimal ,"),
    (r"convention='D' and nu=|convention='D', nu=|\bnu=(?= for J)", "--tension NU"),
    (r"\b(start|segment|curve|stress)=", r"--\1"),
    (r"\bspring_constant=", "--spring-constant"),
    (r"(data\.)?in_contact\(\)", "--in-contact"),
)


def main(arguments: list[str]) -> int:
    """Fit as the arguments after ``fit`` say; 0. Raises ValueError on bad input, SystemExit on bad usage."""
    parser = argparse.ArgumentParser(prog="jaxcontact fit", description="Material parameters from data.")
    add_parser(parser.add_subparsers(required=True, metavar="KIND"))
    options = parser.parse_args(arguments)
    return options.command(options)


def add_parser(kinds: Any) -> None:
    """Add ``creep`` and ``indentation`` to subparsers."""
    creep = kinds.add_parser("creep", help="a creep curve: time and compliance, or strain and stress")
    errors = "estimated, relative, absolute, or a standard deviation in the unit of the data in SI"
    _add_common(creep, "estimated", errors, "t, J, strain, stress, sigma: standard deviations")
    creep.add_argument("--convention", default="J", metavar="C", help='"J" (gamma/tau) or "1/(2G)"')
    creep.add_argument(
        "--tension", type=float, metavar="NU", help="a tensile test, J = 2 (1 + NU) strain/stress"
    )
    creep.add_argument("--nu", type=float, default=0.3, help="Poisson's ratio to carry along (0.3)")
    creep.add_argument("--stress", type=float, metavar="S", help="constant, of a file of strain alone [Pa]")
    creep.add_argument(
        "--start", type=float, metavar="T", help="when the load began, on the file's clock [s]"
    )
    _add_segment(creep, "a step or interval of several, by name or position from 0; repeat to join")
    creep.set_defaults(command=_creep)
    press = kinds.add_parser("indentation", help="a ball: time, load and depth")
    errors = "absolute, estimated, relative, or a standard deviation in m (load control) or N"
    _add_common(press, "absolute", errors, "t, load, depth, height")
    _add_segment(press, "approach, hold or retract; repeat for several")
    press.add_argument("--curve", metavar="C", help="which of several curves, by name or position from 0")
    press.add_argument("--spring-constant", type=float, metavar="K", help="of the cantilever [N/m]")
    press.add_argument(
        "--in-contact",
        nargs="?",
        const="seen",
        metavar="DEPTH",
        help="leave out what is before contact, as the load shows it or from a depth [m]",
    )
    press.add_argument("--radius", type=float, metavar="R", help="of the ball [m]")
    press.add_argument("--ball-modulus", type=float, metavar="E", help="Young's modulus [Pa]; rigid without")
    press.add_argument("--ball-nu", type=float, default=0.3, metavar="NU", help="of the ball (0.3)")
    press.add_argument("--nu", type=float, default=0.3, help="Poisson's ratio of the material (0.3)")
    press.add_argument("--control", default="load", metavar="C", help="load or depth: what is given (load)")
    press.add_argument("--layer", type=float, metavar="H", help="thickness of a film [m]; else a half-space")
    press.add_argument("--substrate-modulus", type=float, metavar="E", help="Young's, under a film [Pa]")
    press.add_argument("--substrate-nu", type=float, default=0.3, metavar="NU", help="under a film (0.3)")
    for name, unit in (("contact-point", "m"), ("drift", "m/s"), ("machine-compliance", "m/N")):
        press.add_argument(f"--{name}", default="0", metavar="X", help=f"in the depth [{unit}], or fit (0)")
    press.set_defaults(command=_indentation)


def _add_segment(parser: Any, what: str) -> None:
    parser.add_argument("--segment", action="append", metavar="S", help=what)


def _add_common(parser: Any, weights: str, text: str, kinds: str) -> None:
    parser.add_argument(
        "file", metavar="FILE", help="CSV, TSV or an export with columns that name their units"
    )
    parser.add_argument(
        "-o", dest="directory", type=Path, metavar="DIR", required=True, help="where results go"
    )
    parser.add_argument("--force", action="store_true", help="overwrite what is in DIR")
    names = ", ".join(cls.__name__ for cls in CLASSICAL)
    parser.add_argument("--model", default="Burgers", metavar="M", help=f"{names} (Burgers)")
    parser.add_argument("--weights", default=weights, metavar="W", help=f"{text} ({weights})")
    parser.add_argument("--level", type=float, default=0.95, metavar="L", help="of the intervals (0.95)")
    parser.add_argument("--window", metavar="BEGIN:END", help="times that are taken [s], one may be empty")
    parser.add_argument("--decimal", metavar="MARK", help='"." or ",", where the numbers read both ways')
    for flag, form, what in (
        ("fix", "NAME=VALUE", "hold a parameter"),
        ("bound", "NAME=LOW:HIGH", "bound a parameter, one side may be empty"),
        ("column", "KIND=HEADER", f"where a quantity is ({kinds})"),
        ("unit", "KIND=UNIT", "its unit, before what the header says"),
    ):
        parser.add_argument(f"--{flag}", action="append", default=[], metavar=form, help=what)


def _creep(options: argparse.Namespace) -> int:
    """Read, fit, write."""
    tensile = {} if options.tension is None else {"nu": options.tension, "convention": "D"}
    data = _read(
        read_creep, options, stress=options.stress, start=options.start,
        segment=options.segment and [_place(one) for one in options.segment],
        **{"convention": options.convention, **tensile},
    )  # fmt: skip
    nu = options.nu if options.tension is None else options.tension
    return _finish(options, lambda: fit_creep(data, nu=nu, **_choices(options, data.sigma is not None)))


def _indentation(options: argparse.Namespace) -> int:
    """Read, fit, write."""
    if options.radius is None:
        raise ValueError("--radius: expected the radius of the ball in m, got none")
    if options.layer is not None and options.substrate_modulus is None:
        raise ValueError("--substrate-modulus: expected Young's modulus in Pa under a --layer, got none")
    ball = options.ball_modulus and _elastic("--ball-modulus", options.ball_modulus, options.ball_nu)
    data = _indented(options)
    extra: dict[str, Any] = {}
    for name in ("contact_point", "drift", "machine_compliance"):
        text = getattr(options, name)
        extra[name] = text if text == "fit" else _float(f"--{name.replace('_', '-')}", text)
    if options.layer is not None:
        substrate = _elastic("--substrate-modulus", options.substrate_modulus, options.substrate_nu)
        extra |= {"layer": options.layer, "substrate": substrate}
    call = lambda: fit_indentation(
        data, indenter=jc.Sphere(options.radius, ball or None), nu=options.nu, control=options.control,
        **_choices(options, False), **extra,
    )  # fmt: skip
    return _finish(options, call)


def _indented(options: argparse.Namespace) -> Any:
    """The curve, from contact on where that is asked for; segments and the window are of what is left."""
    curve = None if options.curve is None else _place(options.curve)
    of_file = {"curve": curve, "spring_constant": options.spring_constant}
    if options.in_contact is None:
        return _read(read_indentation, options, segment=options.segment, **of_file)
    window, options.window = options.window, None
    data = _read(read_indentation, options, **of_file)
    depth = None if options.in_contact == "seen" else _float("--in-contact", options.in_contact)
    with _about(options.file):
        data = data.in_contact(depth).only(*(options.segment or ()))
        return data.window(*_range("--window", window)) if window else data


def _read(reader: Callable[..., Any], options: argparse.Namespace, **given: Any) -> Any:
    """The data of a file; errors speak of flags."""
    columns = {kind: _place(text) for kind, text in _pairs("--column", options.column)}
    window = options.window and _range("--window", options.window)
    places = {"columns": columns, "units": dict(_pairs("--unit", options.unit)), "window": window}
    try:
        return reader(options.file, decimal=options.decimal, **places, **given)
    except ValueError as error:
        raise ValueError(in_flags(str(error))) from error


def in_flags(message: str) -> str:
    """A message of the readers and fits with the flag for each option that it names."""
    for pattern, flag in FLAGS:
        message = re.sub(pattern, flag, message)
    return message


@contextlib.contextmanager
def _about(file: str) -> Iterator[None]:
    """Errors within name the file, and speak of flags."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{file}: {in_flags(str(error))}") from error


def _place(text: str) -> int | str:
    """A position, or a name."""
    return int(text) if text.isdigit() else text


def _elastic(flag: str, E: float, nu: float) -> jc.Elastic:
    if not (E > 0 and -1.0 < nu <= 0.5):
        raise ValueError(f"{flag}: expected a modulus > 0 and -1 < nu <= 0.5, got {E:g} and {nu:g}")
    return jc.Elastic.from_young(E, nu)


def _float(flag: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{flag}: expected a number, got {text!r}") from None


def _choices(options: argparse.Namespace, has_sigma: bool) -> dict[str, Any]:
    """What both fits take alike; the file's standard deviations go before a default."""
    weights: dict[str, Any] = {"weights": None if has_sigma else options.weights}
    if options.weights not in KINDS:
        weights = {"weights": None, "sigma": _float("--weights", options.weights)}
    return weights | {
        "model": options.model,
        "level": options.level,
        "fixed": {name: _float("--fix", text) for name, text in _pairs("--fix", options.fix)},
        "bounds": {name: _range("--bound", text) for name, text in _pairs("--bound", options.bound)},
    }


def _pairs(flag: str, texts: list[str]) -> list[tuple[str, str]]:
    for text in texts:
        if "=" not in text:
            raise ValueError(f"{flag}: expected NAME=..., got {text!r}")
    return [(name, value) for name, _, value in (text.partition("=") for text in texts)]


def _range(flag: str, text: str) -> tuple[float | None, float | None]:
    low, mark, high = text.partition(":")
    if not mark:
        raise ValueError(f"{flag}: expected LOW:HIGH, got {text!r}")
    return _float(flag, low) if low else None, _float(flag, high) if high else None


def _finish(options: argparse.Namespace, fit: Callable[[], Any]) -> int:
    """Fit, print, and write; errors name the file."""
    directory: Path = options.directory
    if directory.exists() and not directory.is_dir():
        raise ValueError(f"{directory}: found a file, accepted: a directory, new or empty")
    if directory.is_dir() and any(directory.iterdir()) and not options.force:
        raise ValueError(f"{directory}: found a directory that is not empty; --force overwrites it")
    with _about(options.file):
        found = fit()
    print(found.summary())
    directory.mkdir(parents=True, exist_ok=True)
    text = (
        json.dumps(found.to_dict() | {"file": Path(options.file).name}, indent=2, ensure_ascii=False) + "\n"
    )
    _write(directory / "summary.json", lambda path: path.write_text(text, encoding="utf-8"))
    _write(directory / "curve.csv", lambda path: _curve(found, path))
    _write(directory / "fit.png", lambda path: found.plot().savefig(path, dpi=150, format="png"))
    print(f"in {directory}: summary.json, curve.csv, fit.png")
    return 0


def _write(path: Path, write: Callable[[Path], Any]) -> None:
    """Write beside, then rename: a reader never meets half a file."""
    partial = path.with_name(path.name + ".part")
    write(partial)
    os.replace(partial, path)


def _curve(fit: Any, path: Path) -> None:
    """Time, data, fit and weighted residual of every fitted point."""
    name, unit, t, measured = fit.curve
    header = f"t [s],{name} [{unit}],fitted [{unit}],weighted residual"
    columns = np.column_stack([t, measured, fit.fitted, fit.residuals])
    np.savetxt(path, columns, delimiter=",", header=header, comments="")
