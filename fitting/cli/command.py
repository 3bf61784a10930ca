"""The commands ``jaxcontact fit ...``: creep, indentation, force, map, stiffness, relaxation, oscillation, master, growth,
prony, compare, batch, propagate and design.

Each prints a summary and writes summary.json, curve.csv and fit.png in DIR. Bad input is a ValueError of one line,
which the command line prints; options in the message are replaced by the corresponding flags.
"""

import argparse
import math
from collections.abc import Callable
from typing import Any

import jaxcontact as jc
from fitting.cli import (
    batch_command,
    flags,
    force_command,
    further_commands,
    growth_command,
    map_command,
    master_command,
    stiffness_command,
)
from fitting.fits.creep import compare, fit_creep
from fitting.fits.indentation import fit_indentation
from fitting.fits.maxwell import fit_maxwell
from fitting.fits.modulus import fit_oscillation, fit_relaxation
from fitting.fits.prony import fit_prony
from fitting.fits.spectrum import fit_spectrum
from fitting.io.modulus_reader import read_oscillation, read_relaxation
from fitting.io.readers import read_indentation
from fitting.views import output

MODELS = "Maxwell,StandardLinearSolid,Burgers"


def main(arguments: list[str]) -> int:
    """Run the fit command of the arguments after ``fit`` and return 0; ValueError on bad input, SystemExit on bad
    usage."""
    parser = argparse.ArgumentParser(
        prog="jaxcontact fit", description="Identify material parameters from measured curves."
    )
    add_parser(parser.add_subparsers(required=True, metavar="KIND"))
    options = parser.parse_args(arguments)
    return options.command(options)


def add_parser(kinds: Any) -> None:
    """Add the commands to subparsers."""
    for name, command, what in (
        ("creep", _creep, "a creep curve: time and compliance, or strain and stress"),
        ("prony", _prony, "a creep curve: series of retardation times"),
        ("compare", _compare, "a creep curve or a modulus: comparison of several models"),
        (
            "batch",
            batch_command.run,
            "many curves: a folder of results for each, a table and a report of all",
        ),
        (
            "propagate",
            further_commands.carry,
            "prediction from a creep curve, at other times or under a ball, with a confidence band",
        ),
    ):
        parser = _add(kinds, name, what)
        flags.add_file(parser, several=command is batch_command.run)
        _add_own(parser, command)
        flags.add_creep(parser)
        parser.set_defaults(command=command)
    further_commands.add_design(_add(kinds, "design", "planning: the shortest creep tests for a material"))
    _add_indentation(_add(kinds, "indentation", "indentation by a ball, cone or punch: time, load and depth"))
    force_command.add_force(_add(kinds, "force", "Young's modulus from a force curve of a microscope"))
    several = "Young's modulus from the force curves of a map or a folder: one table and one figure"
    map_command.add_map(_add(kinds, "map", several))
    over_depth = "modulus over depth from a continuous stiffness measurement: depth, stiffness and load"
    stiffness_command.add_stiffness(_add(kinds, "stiffness", over_depth))
    _add_moduli(kinds)
    growth_command.add_growth(_add(kinds, "growth", "growth kinetics of a film: time and thickness"))


def _add_own(parser: Any, command: Callable[..., int]) -> None:
    """Add the flags of one of the commands for creep curves that the others do not have."""
    if command is _prony:
        parser.add_argument(
            "--tau", metavar="T,T,...", help="retardation times [s]; by default chosen by BIC"
        )
        return
    if command is _compare:
        what = f"models to compare ({MODELS})"
        parser.add_argument("--models", default=MODELS, metavar="M,M,...", help=what)
        batch_command.add_kind(parser)
        flags.add_known(parser)
        return
    flags.add_model(parser, laws=True)
    if command is batch_command.run:
        batch_command.add_kind(parser)
    if command is further_commands.carry:
        further_commands.add_carry(parser)


def _add(kinds: Any, name: str, what: str) -> Any:
    """Add a command with its description."""
    return kinds.add_parser(name, help=what, description=f"{what[0].upper()}{what[1:]}.")


def _add_moduli(kinds: Any) -> None:
    relaxation = _add(kinds, "relaxation", "a relaxation modulus over time")
    flags.add_file(relaxation)
    flags.add_model(relaxation, laws=True)
    flags.add_test(relaxation, "t, modulus")
    relaxation.set_defaults(command=_relaxation)
    oscillation = _add(kinds, "oscillation", "storage and loss modulus over frequency")
    flags.add_file(oscillation)
    flags.add_model(oscillation, laws=True)
    errors = "relative, absolute, or a standard deviation of the moduli [Pa]"
    columns = "omega, storage, loss, complex, delta, tan_delta"
    flags.add_common(oscillation, "relative", errors, columns, window="angular frequencies [rad/s]")
    flags.add_exclude(oscillation)
    flags.add_volume(oscillation)
    flags.add_segment(
        oscillation, "one of several sweeps, by name or position from 0; repeat to join several"
    )
    oscillation.set_defaults(command=_oscillation)
    series = "a generalised Maxwell model with these relaxation times [s], or auto, in place of --model"
    for parser in (relaxation, oscillation):
        parser.add_argument("--tau", metavar="T,T,...", help=series)
        smooth = "a continuous relaxation spectrum with what the data resolve of it, in place of --model"
        parser.add_argument("--spectrum", action="store_true", help=smooth)
    several = "time-temperature superposition: curves at several temperatures"
    master_command.add_master(_add(kinds, "master", several))


def _add_indentation(press: Any) -> None:
    flags.add_file(press)
    flags.add_model(press)
    errors = "absolute, estimated, relative, or a standard deviation in m (load control) or N"
    flags.add_common(press, "absolute", errors, "t, load, depth, height, sigma_depth, sigma_load")
    flags.add_resample(press)
    flags.add_segment(press, "approach, hold or retract; repeat to select several")
    press.add_argument("--curve", metavar="C", help="one of several curves, by name or position from 0")
    press.add_argument(
        "--spring-constant", type=float, metavar="K", help="spring constant of the cantilever [N/m]"
    )
    taken = "leave out the points before contact, found from the load or given as a depth [m]"
    press.add_argument("--in-contact", nargs="?", const="seen", metavar="DEPTH", help=taken)
    _add_indenter(press)
    press.add_argument("--nu", type=float, help="Poisson's ratio of the material (0.3)")
    press.add_argument(
        "--bulk-modulus", type=float, metavar="PA", help="bulk modulus of the material [Pa], in place of --nu"
    )
    press.add_argument(
        "--control", default="load", metavar="C", help="prescribed quantity, load or depth (load)"
    )
    press.add_argument(
        "--layer", type=float, metavar="H", help="thickness of a film [m]; by default a half-space"
    )
    thin = "thickness of a sample bonded to a rigid base [m], such as a gel in a dish; in place of --layer"
    press.add_argument("--thickness", type=float, metavar="H", help=thin)
    press.add_argument(
        "--substrate-modulus", type=float, metavar="E", help="Young's modulus of the substrate [Pa]"
    )
    press.add_argument(
        "--substrate-nu", type=float, default=0.3, metavar="NU", help="Poisson's ratio of the substrate (0.3)"
    )
    _add_adhesion(press)
    for name, what in (
        ("contact-point", "offset of the depth [m]"),
        ("drift", "drift of the depth [m/s]"),
        ("machine-compliance", "compliance of the instrument [m/N]"),
    ):
        press.add_argument(f"--{name}", default="0", metavar="X", help=f"{what}: a number, or fit (0)")
    press.set_defaults(command=_indentation)


def _add_adhesion(press: Any) -> None:
    sticks = "of an adhesive ball: the work of adhesion [J/m2] (0), or fit or jkr to fit it (Elastic, --control depth)"
    press.add_argument("--adhesion", default="0", metavar="W", help=sticks)


def _add_indenter(press: Any) -> None:
    press.add_argument("--radius", type=float, metavar="R", help="radius of the ball or of the --punch [m]")
    press.add_argument("--punch", action="store_true", help="a flat punch of that radius in place of a ball")
    press.add_argument(
        "--cone", metavar="A", help="a cone in place of a ball: half-angle [degrees], or berkovich"
    )
    press.add_argument(
        "--ball-modulus",
        type=float,
        metavar="E",
        help="Young's modulus of the indenter [Pa]; rigid by default",
    )
    press.add_argument(
        "--ball-nu", type=float, default=0.3, metavar="NU", help="Poisson's ratio of the indenter (0.3)"
    )


def _creep(options: argparse.Namespace) -> int:
    """Fit a creep curve and write the results."""
    output.check_directory(options)
    data, given = flags.crept(options, options.file)
    with flags.about(options.file):
        found = fit_creep(data, options.model, **given, **flags.known(options))
    return output.finish(options, found)


def _prony(options: argparse.Namespace) -> int:
    """Fit a series of retardation times and write the results."""
    output.check_directory(options)
    data, given = flags.crept(options, options.file)
    with flags.about(options.file):
        found = fit_prony(data, _times(options.tau), **given)
    return output.finish(options, found)


def _relaxation(options: argparse.Namespace) -> int:
    """Fit a relaxation modulus and write the results."""
    output.check_directory(options)
    data, nu = flags.moduli(options, options.file, read_relaxation, start=options.start)
    return _fit_modulus(options, fit_relaxation, data, nu)


def _oscillation(options: argparse.Namespace) -> int:
    """Fit storage and loss moduli and write the results."""
    output.check_directory(options)
    data, nu = flags.moduli(options, options.file, read_oscillation)
    return _fit_modulus(options, fit_oscillation, data, nu)


def _fit_modulus(options: argparse.Namespace, fit: Callable[..., Any], data: Any, nu: float) -> int:
    """Fit a model, or a series of relaxation times, and write the results."""
    given, held = flags.weighting(options, False), flags.known(options)
    if options.spectrum and (options.tau is not None or any(held.values())):
        raise ValueError("--spectrum: expected no --tau, no --fix and no --bound beside it, got some")
    if options.tau is not None and any(held.values()):
        raise ValueError("--tau: expected no --fix and no --bound beside it, got some")
    with flags.about(options.file):
        if options.spectrum:
            found: Any = fit_spectrum(data, nu=nu, **given)
        elif options.tau is None:
            found = fit(data, options.model, nu=nu, **given, **held)
        else:
            found = fit_maxwell(data, _times(options.tau), nu=nu, **given)
    return output.finish(options, found)


def _times(text: str | None) -> list[float] | None:
    """Return the times of a series, None for those chosen automatically."""
    if text is None or text.lower() == "auto":
        return None
    return [flags.number("--tau", one) for one in text.split(",")]


def _compare(options: argparse.Namespace) -> int:
    """Fit each model, print the table, and write the fit of lowest BIC with the summaries of all models."""
    output.check_directory(options)
    if options.of == "creep":
        data, given = flags.crept(options, options.file)
    else:
        reader = batch_command.MODULI[options.of][0]
        start = {"start": options.start} if options.of == "relaxation" else {}
        data, nu = flags.moduli(options, options.file, reader, **start)
        default = options.weights.lower() == "estimated"
        given = flags.weighting(options, False) | {"nu": nu} | ({"weights": "relative"} if default else {})
    with flags.about(options.file):
        table = compare(data, options.models.split(","), **flags.known(options), **given)
    print(table)
    return output.finish(options, table.fits[0], {"models": [fit.to_dict() for fit in table.fits]})


def _indentation(options: argparse.Namespace) -> int:
    """Fit an indentation curve and write the results."""
    indenter = _indenter(options)
    if options.layer is not None and options.substrate_modulus is None:
        raise ValueError("--substrate-modulus: expected Young's modulus in Pa under a --layer, got none")
    output.check_directory(options)
    data = flags.resampled(options, options.file, _indented(options, indenter))
    extra: dict[str, Any] = {"adhesion": _adhesion(options), "thickness": options.thickness}
    for name in ("contact_point", "drift", "machine_compliance"):
        text = getattr(options, name)
        extra[name] = text if text.lower() == "fit" else flags.number(f"--{name.replace('_', '-')}", text)
    if options.layer is not None:
        substrate = _elastic("--substrate-modulus", options.substrate_modulus, options.substrate_nu)
        extra |= {"layer": options.layer, "substrate": substrate}
    nu = 0.3 if options.nu is None and options.bulk_modulus is None else options.nu
    driven = "load" if options.control.lower() == "depth" else "depth"
    has_sigma = any(getattr(data, f"{kind}_{driven}") is not None for kind in ("sigma", "scatter"))
    with flags.about(options.file):
        found = fit_indentation(
            data, options.model, indenter=indenter, nu=nu, bulk_modulus=options.bulk_modulus,
            control=options.control, **flags.weighting(options, has_sigma, "absolute"), **flags.known(options), **extra,
        )  # fmt: skip
    return output.finish(options, found)


def _adhesion(options: argparse.Namespace) -> Any:
    """Return the work of adhesion, or how it is fitted."""
    fitted = options.adhesion.lower() in ("fit", "jkr")
    return options.adhesion if fitted else flags.number("--adhesion", options.adhesion)


def _indenter(options: argparse.Namespace) -> Any:
    """Return the indenter."""
    solid = (
        _elastic("--ball-modulus", options.ball_modulus, options.ball_nu) if options.ball_modulus else None
    )
    if options.cone is None:
        if options.radius is None:
            raise ValueError("--radius: expected the radius of the ball in m, or a --cone, got none")
        return (jc.FlatPunch if options.punch else jc.Sphere)(options.radius, solid)
    if options.radius is not None or options.punch:
        raise ValueError("--cone: expected no --radius and no --punch beside it")
    if options.cone.lower() == "berkovich":
        return jc.Cone.berkovich(solid)
    return jc.Cone(math.radians(flags.number("--cone", options.cone)), solid)


def _indented(options: argparse.Namespace, indenter: Any) -> Any:
    """Return the curve, from contact on if requested; segments and window then refer to the remaining points."""
    curve = None if options.curve is None else flags.place(options.curve)
    of_file = {"curve": curve, "spring_constant": options.spring_constant}
    if options.in_contact is None:
        return flags.read(read_indentation, options.file, options, segment=options.segment, **of_file)
    window, options.window = options.window, None
    data = flags.read(read_indentation, options.file, options, **of_file)
    depth = None if options.in_contact == "seen" else flags.number("--in-contact", options.in_contact)
    stiffened = options.layer is not None or options.thickness is not None
    with flags.about(options.file):
        data = data.in_contact(depth, indenter, stiffened).only(*(options.segment or ()))
        return data.window(*flags.span("--window", window)) if window else data


def _elastic(flag: str, E: float, nu: float) -> jc.Elastic:
    if not (E > 0 and -1.0 < nu <= 0.5):
        raise ValueError(f"{flag}: expected a modulus > 0 and -1 < nu <= 0.5, got {E:g} and {nu:g}")
    return jc.Elastic.from_young(E, nu)
