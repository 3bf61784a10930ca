"""The commands ``jaxcontact fit creep FILE -o DIR`` and ``jaxcontact fit indentation FILE -o DIR``.

Each prints the summary and leaves summary.json, curve.csv and fit.png in DIR. Bad input is a ValueError
of one line, for the command line to show.
"""

import argparse
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting.creep import fit_creep
from fitting.indentation import fit_indentation
from fitting.readers import read_creep, read_indentation
from fitting.structure import CLASSICAL


def main(arguments: list[str]) -> int:
    """Fit as the arguments after ``fit`` say; 0. Raises ValueError on bad input, SystemExit on bad usage."""
    parser = argparse.ArgumentParser(prog="jaxcontact fit", description="Material parameters from data.")
    add_parser(parser.add_subparsers(required=True, metavar="KIND"))
    options = parser.parse_args(arguments)
    return options.command(options)


def add_parser(kinds: Any) -> None:
    """Add ``creep`` and ``indentation`` to subparsers."""
    creep = kinds.add_parser("creep", help="a creep curve: time and compliance, or strain and stress")
    _add_common(
        creep, "relative", "relative, absolute, or a standard deviation in the unit of the data in SI"
    )
    creep.add_argument("--convention", default="J", metavar="C", help='"J" (gamma/tau) or "1/(2G)"')
    creep.add_argument("--nu", type=float, default=0.3, help="Poisson's ratio to carry along (0.3)")
    creep.set_defaults(command=_creep)
    press = kinds.add_parser("indentation", help="a ball: time, load and depth")
    _add_common(press, "absolute", "absolute, relative, or a standard deviation in m (load control) or N")
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


def _add_common(parser: Any, weights: str, text: str) -> None:
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
    for flag, form, what in (
        ("fix", "NAME=VALUE", "hold a parameter"),
        ("bound", "NAME=LOW:HIGH", "bound a parameter, one side may be empty"),
        ("column", "KIND=HEADER", "where a quantity is (t, J, strain, stress, load, depth)"),
        ("unit", "KIND=UNIT", "its unit, before what the header says"),
    ):
        parser.add_argument(f"--{flag}", action="append", default=[], metavar=form, help=what)


def _creep(options: argparse.Namespace) -> int:
    """Read, fit, write."""
    data = read_creep(options.file, convention=options.convention, **_places(options))
    return _finish(options, lambda: fit_creep(data, nu=options.nu, **_choices(options)))


def _indentation(options: argparse.Namespace) -> int:
    """Read, fit, write."""
    if options.radius is None:
        raise ValueError("--radius: expected the radius of the ball in m, got none")
    if options.layer is not None and options.substrate_modulus is None:
        raise ValueError("--substrate-modulus: expected Young's modulus in Pa under a --layer, got none")
    ball = options.ball_modulus and _elastic("--ball-modulus", options.ball_modulus, options.ball_nu)
    data = read_indentation(options.file, **_places(options))
    extra: dict[str, Any] = {}
    for name in ("contact_point", "drift", "machine_compliance"):
        text = getattr(options, name)
        extra[name] = text if text == "fit" else _float(f"--{name.replace('_', '-')}", text)
    if options.layer is not None:
        substrate = _elastic("--substrate-modulus", options.substrate_modulus, options.substrate_nu)
        extra |= {"layer": options.layer, "substrate": substrate}
    call = lambda: fit_indentation(
        data, indenter=jc.Sphere(options.radius, ball or None), nu=options.nu, control=options.control,
        **_choices(options), **extra,
    )  # fmt: skip
    return _finish(options, call)


def _elastic(flag: str, E: float, nu: float) -> jc.Elastic:
    if not (E > 0 and -1.0 < nu <= 0.5):
        raise ValueError(f"{flag}: expected a modulus > 0 and -1 < nu <= 0.5, got {E:g} and {nu:g}")
    return jc.Elastic.from_young(E, nu)


def _float(flag: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{flag}: expected a number, got {text!r}") from None


def _choices(options: argparse.Namespace) -> dict[str, Any]:
    """What both fits take alike."""
    known = options.weights in ("relative", "absolute")
    weights: dict[str, Any] = {"weights": options.weights}
    if not known:
        weights = {"weights": None, "sigma": _float("--weights", options.weights)}
    return weights | {
        "model": options.model,
        "level": options.level,
        "fixed": {name: _float("--fix", text) for name, text in _pairs("--fix", options.fix)},
        "bounds": {name: _range(text) for name, text in _pairs("--bound", options.bound)},
    }


def _places(options: argparse.Namespace) -> dict[str, Any]:
    """Columns, by header or by zero-based position, and units."""
    columns = {
        kind: int(text) if text.isdigit() else text for kind, text in _pairs("--column", options.column)
    }
    return {"columns": columns, "units": dict(_pairs("--unit", options.unit))}


def _pairs(flag: str, texts: list[str]) -> list[tuple[str, str]]:
    for text in texts:
        if "=" not in text:
            raise ValueError(f"{flag}: expected NAME=..., got {text!r}")
    return [(name, value) for name, _, value in (text.partition("=") for text in texts)]


def _range(text: str) -> tuple[float | None, float | None]:
    low, mark, high = text.partition(":")
    if not mark:
        raise ValueError(f"--bound: expected NAME=LOW:HIGH, got {text!r}")
    return _float("--bound", low) if low else None, _float("--bound", high) if high else None


def _finish(options: argparse.Namespace, fit: Callable[[], Any]) -> int:
    """Fit, print, and write; errors name the file."""
    directory: Path = options.directory
    if directory.exists() and not directory.is_dir():
        raise ValueError(f"{directory}: found a file, accepted: a directory, new or empty")
    if directory.is_dir() and any(directory.iterdir()) and not options.force:
        raise ValueError(f"{directory}: found a directory that is not empty; --force overwrites it")
    try:
        found = fit()
    except ValueError as error:
        raise ValueError(f"{options.file}: {error}") from error
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
