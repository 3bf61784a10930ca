"""The commands ``jaxcontact fit ...``: creep, prony, indentation, force, map, stiffness, relaxation, oscillation, master,
growth, compare, batch, together, posterior, propagate and design.

Each prints a summary and writes summary.json, curve.csv and fit.png in DIR. Bad input is a ValueError of one line,
which the command line prints; options in the message are replaced by the corresponding flags.
"""

import argparse
from collections.abc import Callable
from typing import Any

from fitting.cli import (
    design_command,
    flags,
    force_command,
    growth_command,
    kinds,
    maps,
    master_command,
    posterior_command,
    propagate_command,
    stiffness_command,
    together_command,
)
from fitting.fits.creep import compare, fit_creep
from fitting.fits.modulus import fit_oscillation, fit_relaxation
from fitting.fits.prony import fit_maxwell, fit_prony
from fitting.fits.spectrum import fit_spectrum
from fitting.read.modulus import read_oscillation, read_relaxation
from fitting.views import output
from jaxcontact._support.usage import Parser

MODELS = "Maxwell,StandardLinearSolid,Burgers"

EXAMPLES = {
    "creep": ("film.csv -o film --model StandardLinearSolid", "film.csv -o film --stress 1e3 --start 20"),
    "prony": ("film.csv -o film", "film.csv -o film --tau 1,10,100"),
    "compare": ("film.csv -o film", "sweep.csv -o sweep --of oscillation --models Maxwell,FractionalMaxwell"),
    "batch": (
        "a.csv b.csv -o films",
        "holds -o gels --of indentation --radius 5e-6 --nu 0.5 --segment hold --model StandardLinearSolid",
    ),
    "together": ("creep.csv sweep.csv -o melt --of creep,oscillation --model Burgers",),
    "posterior": ("film.csv -o film", "sweep.csv -o melt --of oscillation --model Maxwell"),
    "propagate": (
        "film.csv -o film --times 1e4,1e5",
        "sweep.csv -o melt --data oscillation --model Maxwell --of relaxation --times 1,10,100",
        "film.csv -o film --of depth --times 1e4 --load 1e-3 --radius 1e-3 --layer 1e-6 --substrate-modulus 210e9",
    ),
    "design": ("--model Maxwell --value G=1e6 --value eta=1e8",),
    "indentation": (
        "hold.txt -o gel --radius 5e-6 --nu 0.5 --model Maxwell",
        "hold.txt -o film --cone berkovich --layer 1e-6 --substrate-modulus 70e9",
    ),
    "force": ("curve.jpk-force --radius 5e-6", "curve.txt --pyramid 35 --thickness 8e-6 --polynomials"),
    "map": ("map.jpk-force-map -o map --radius 5e-6",),
    "stiffness": ("csm.txt -o film --cone berkovich --thickness 1e-6 --substrate-modulus 170e9",),
    "relaxation": ("gel.csv -o gel --model StandardLinearSolid", "gel.csv -o gel --tau auto"),
    "oscillation": ("sweep.csv -o melt --tau auto", "sweep.csv -o melt --spectrum"),
    "master": ("sweeps.csv -o melt --reference 400", "a.csv b.csv c.csv -o melt --temperature 350,370,390"),
    "growth": ("a.csv b.csv -o film --stress 3e8,9e8 --temperature 353",),
}  # arguments of each command, which its help shows


def main(arguments: list[str]) -> int:
    """Run the fit command of the arguments after ``fit`` and return 0; ValueError on bad input, SystemExit on bad
    usage."""
    parser = Parser(prog="jaxcontact fit", description="Identify material parameters from measured curves.")
    add_parser(parser.add_subparsers(required=True, metavar="KIND"))
    options = parser.parse_args(arguments)
    return options.command(options)


def add_parser(commands: Any) -> None:
    """Add the commands to subparsers."""
    for name, command, what in (
        ("creep", _creep, "a creep curve: time and compliance, or strain and stress"),
        ("prony", _prony, "a creep curve: series of retardation times"),
    ):
        parser = _add(commands, name, what)
        flags.add_file(parser)
        if command is _prony:
            times = "retardation times [s]; by default chosen by BIC"
            parser.add_argument("--tau", metavar="T,T,...", help=times)
        else:
            flags.add_model(parser, laws=True)
        flags.add_creep(parser)
        parser.set_defaults(command=command)
    pressed = "indentation by a ball, cone or punch: time, load and depth"
    kinds.add_indentation(_add(commands, "indentation", pressed))
    force_command.add_force(_add(commands, "force", "Young's modulus from a force curve of a microscope"))
    several = "Young's modulus from the force curves of a map or a folder: one table and one figure"
    maps.add_map(_add(commands, "map", several))
    over_depth = "modulus over depth from a continuous stiffness measurement: depth, stiffness and load"
    stiffness_command.add_stiffness(_add(commands, "stiffness", over_depth))
    _add_moduli(commands)
    growth_command.add_growth(_add(commands, "growth", "growth kinetics of a film: time and thickness"))
    _add_further(commands)


def _add_further(commands: Any) -> None:
    """Add the commands for several curves, and for what follows from a fit."""
    for name, command, what in (
        ("compare", _compare, "a creep curve, a modulus or an indentation: comparison of several models"),
        ("batch", maps.run_batch, "many curves: a folder of results for each, a table and a report of all"),
        ("together", together_command.run, "one material from several tests of it: creep, relaxation and oscillation"),
        ("posterior", posterior_command.run, "draws from the posterior of the parameters of a fit"),
        (
            "propagate",
            propagate_command.run,
            "prediction from a fit, at other times or of another contact, with a confidence band",
        ),
    ):  # fmt: skip
        parser = _add(commands, name, what)
        flags.add_file(parser, several=name in ("batch", "together"))
        if name == "compare":
            models = f"models to compare ({MODELS})"
            parser.add_argument("--models", default=MODELS, metavar="M,M,...", help=models)
            flags.add_known(parser)
        else:
            flags.add_model(parser, laws=name != "together")
        if name == "together":
            together_command.add_together(parser)
        else:
            kinds.add_kind(parser, "--data" if name == "propagate" else "--of")
        if name == "posterior":
            posterior_command.add_posterior(parser)
        if name == "propagate":
            propagate_command.add_propagate(parser)
            kinds.add_curves(parser, "of an indentation, or of the contact that is predicted")
        elif name != "together":
            kinds.add_curves(parser)
        parser.set_defaults(command=command)
    design_command.add_design(_add(commands, "design", "planning: the shortest creep tests for a material"))


def _add(commands: Any, name: str, what: str) -> Any:
    """Add a command with its description and its examples."""
    lines = [f"jaxcontact fit {name} {words}" for words in EXAMPLES[name]]
    return commands.add_parser(
        name,
        help=what,
        description=f"{what[0].upper()}{what[1:]}.",
        epilog="\n  ".join(["examples:", *lines]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def _add_moduli(commands: Any) -> None:
    relaxation = _add(commands, "relaxation", "a relaxation modulus over time")
    flags.add_file(relaxation)
    flags.add_model(relaxation, laws=True)
    flags.add_test(relaxation, "t, modulus")
    flags.add_resample(relaxation)
    relaxation.set_defaults(command=_relaxation)
    oscillation = _add(commands, "oscillation", "storage and loss modulus over frequency")
    flags.add_file(oscillation)
    flags.add_model(oscillation, laws=True)
    errors = "proportional, relative, absolute, or a standard deviation of the moduli [Pa]"
    columns = "omega, storage, loss, complex, delta, tan_delta"
    flags.add_common(oscillation, "proportional", errors, columns, window="angular frequencies [rad/s]")
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
    master_command.add_master(_add(commands, "master", several))


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
    given, held = flags.weighting(options, flags.averaged(data)), flags.known(options)
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
    if options.kind == "relaxation":  # estimated weights differ between the models
        options.weights = options.weights or "proportional"
    options = kinds.checked(options)
    output.check_directory(options)
    data, given = kinds.read(options, options.file)
    with flags.about(options.file):
        table = compare(data, options.models.split(","), **flags.known(options), **given)
    print(table)
    return output.finish(options, table.fits[0], {"models": [fit.to_dict() for fit in table.fits]})
