"""The commands ``jaxcontact fit ...``: creep, prony, indentation, force, map, stiffness, poroelastic, relaxation,
oscillation, master, growth, cause, compare, batch, together, posterior, propagate and design.

Each prints a summary and writes summary.json, curve.csv and fit.png in DIR. Bad input is a ValueError of one line,
which the command line prints; options in the message are replaced by the corresponding flags. A kind of fit is an entry of
``kinds.KINDS``, from which ``flags`` makes its command; those that read several files, or do more than fit, follow here.
"""

import argparse
import dataclasses
from pathlib import Path
from typing import Any

from fitting.after.planning import design
from fitting.cli import after, flags, kinds, maps
from fitting.cli.kinds import KINDS
from fitting.fits.compare import compare
from fitting.fits.master import LAWS
from fitting.fits.together import fit_together
from fitting.views import output
from fitting.views.text import in_flags
from jaxcontact._support.terminal import Parser

MODELS = "Maxwell,StandardLinearSolid,Burgers"
CAUSE = ("summary.json",)
TOGETHER = ("creep", "relaxation", "oscillation")  # kinds that one material is fitted to

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
    "poroelastic": (
        "hold.csv -o gel --radius 50e-6 --viscosity 0.9e-3",
        "hold.csv -o gel --cone 70 --network",
    ),
    "cause": (
        "shallow.csv deep.csv -o gel --radius 50e-6 --in-contact",
        "shallow.csv deep.csv -o gel --cone 70 --ramp 0.1,0.3",
    ),
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
    for name, what, command in (
        ("creep", "a creep curve: time and compliance, or strain and stress", _fit),
        ("prony", "a creep curve: series of retardation times", _fit),
        ("indentation", "indentation by a ball, cone or punch: time, load and depth", _fit),
        ("force", "Young's modulus from a force curve of a microscope", _fit),
        ("map", "Young's modulus from the force curves of a map or a folder: one table and one figure", maps.run_map),
        ("stiffness", "modulus over depth from a continuous stiffness measurement: depth, stiffness and load", _fit),
        ("poroelastic", "a gel: the force at a constant depth, with the ramp to it: time, load and depth", _fit),
        ("cause", "what makes a gel relax, its network or its solvent, from holds at several constant depths", _cause),
        ("relaxation", "a relaxation modulus over time", _fit),
        ("oscillation", "storage and loss modulus over frequency", _fit),
        ("master", "time-temperature superposition: curves at several temperatures", _master),
        ("growth", "growth kinetics of a film: time and thickness", _growth),
        ("compare", "a creep curve, a modulus or an indentation: comparison of several models", _compare),
        ("batch", "many curves: a folder of results for each, a table and a report of all", maps.run_batch),
        ("together", "one material from several tests of it: creep, relaxation and oscillation", _together),
        ("posterior", "draws from the posterior of the parameters of a fit", after.run_posterior),
        ("propagate", "prediction from a fit, at other times or of another contact, with a confidence band",
         after.run_propagate),
        ("design", "planning: the shortest creep tests for a material", after.run_design),
    ):  # fmt: skip
        parser = commands.add_parser(
            name,
            help=what,
            description=f"{what[0].upper()}{what[1:]}.",
            epilog="\n  ".join(
                ["examples:", *(f"jaxcontact fit {name} {words}" for words in EXAMPLES[name])]
            ),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        parser.set_defaults(command=command, kind=name)
        if name == "map":
            maps.add_map(parser)
        elif name == "design":
            after.add_design(parser)
        else:
            what = "CSV, TSV or an export with columns that name their units"
            if name == "force":
                what = "a file of JPK, Asylum, Bruker or AFM Workshop, or text"
            flags.add_file(
                parser, name in ("batch", "together", "master", "growth", "cause"), name != "force", what
            )
            if name in KINDS:
                flags.add(parser, KINDS[name], flags.options_of(KINDS[name]))
                continue
            # a command for several kinds of curves
            without: tuple[str, ...] = ("model",) if name == "compare" else ()
            if name == "compare":
                models = f"models to compare ({MODELS})"
                parser.add_argument("--models", default=MODELS, metavar="M,M,...", help=models)
            if name == "together":
                what = f"kind of each file, in their order ({', '.join(TOGETHER)})"
                parser.add_argument("--of", required=True, metavar="KIND,KIND,...", help=what)
                without = ("weights",)
            if name == "posterior":
                count = "draws of each of four chains (1000)"
                parser.add_argument("--samples", type=int, default=1000, metavar="N", help=count)
                parser.add_argument(
                    "--seed", type=int, default=0, metavar="K", help="of the random numbers (0)"
                )
            if name == "propagate":
                after.add_propagate(parser)
            flag = {"propagate": "--data", "together": None}.get(name, "--of")
            kinds.add_kinds(parser, flag, TOGETHER if name == "together" else kinds.SEVERAL, without)


def _fit(options: argparse.Namespace) -> int:
    """Fit a file and write the results."""
    kind, more = KINDS[options.kind], {}
    if options.directory is None:
        options.directory = Path(f"{Path(options.file).name.split('.')[0]}-fit")
    assumed = kinds.check_contact(options)
    output.check_directory(options)
    found = kinds.fitted(kind, options, options.file)
    if assumed:
        print(assumed)
        more = {"assumed": assumed}
    return output.finish(options, found, more)


def _compare(options: argparse.Namespace) -> int:
    """Fit each model, print the table, and write the fit of lowest BIC with the summaries of all models."""
    if options.kind == "relaxation":  # estimated weights differ between the models
        options.weights = options.weights or "proportional"
    kind, options = kinds.checked(options)
    output.check_directory(options)
    data, given = kinds.read(kind, options, options.file)
    with flags.about(options.file):
        table = compare(data, options.models.split(","), **given)
    print(table)
    models = {"models": [fit.to_dict() for fit in table.fits]}
    return output.finish(options, table.fits[0], models, table.plot())


def _together(options: argparse.Namespace) -> int:
    """Fit one material to all files and write the results."""
    names = options.of.split(",")
    if len(options.file) < 2:
        raise ValueError(
            f"{options.file[0]}: expected several files, got one: jaxcontact fit {names[0]} fits it"
        )
    if len(names) != len(options.file) or not set(names) <= set(TOGETHER):
        raise ValueError(
            f"--of: expected a kind for each of {len(options.file)} files, of {', '.join(TOGETHER)}, got {options.of}"
        )
    if options.window is not None and len({name == "oscillation" for name in names}) > 1:
        raise ValueError(
            f"--window: expected none for a sweep over frequency beside a test over time, got {options.window}"
        )
    output.check_directory(options)
    # the fit weighs each test by itself
    options.weights = "estimated"
    data, given = zip(
        *(kinds.read(KINDS[name], options, file) for name, file in zip(names, options.file, strict=True)), strict=True
    )  # fmt: skip
    files = ", ".join(options.file)
    with flags.about(files):
        wanted = ("model", "fixed", "bounds", "nu", "level")
        found = fit_together(data, **{name: given[0][name] for name in wanted})
    more = {"files": [Path(file).name for file in options.file], "kinds": names}
    return output.finish(argparse.Namespace(**vars(options) | {"file": files}), found, more)


def _growth(options: argparse.Namespace) -> int:
    """Read one curve of each file at its stress and temperature, fit, write."""
    output.check_directory(options)
    count, held = len(options.file), {}
    for name in ("stress", "temperature"):
        values = flags.numbers(f"--{name}", getattr(options, name))
        if len(values) not in (1, count):
            raise ValueError(
                f"--{name}: expected one number, or {count} for as many files, got {len(values)}"
            )
        held[name] = values * (count if len(values) == 1 else 1)
    kind = KINDS["growth"]
    data = [
        flags.read(kind, file, options, stress=stress, temperature=T)
        for file, stress, T in zip(options.file, held["stress"], held["temperature"], strict=True)
    ]
    given = flags.arguments(kind.fit, kind, options) | flags.weighting(kind, options, data[0])
    if "sigma" in given:
        data = [dataclasses.replace(one, sigma=given["sigma"]) for one in data]
        del given["sigma"]
    with flags.about(", ".join(options.file)):
        found = kind.fit(data, **given)
    print(in_flags(found.summary()))
    return _leave(options, found)


def _cause(options: argparse.Namespace) -> int:
    """Read a hold of each file, print what makes the gel relax, and for a single hold which second depth would tell."""
    output.check_directory(options, CAUSE)
    kind = KINDS["cause"]
    data = [kinds.read(kind, options, file)[0] for file in options.file]
    given = flags.arguments(kind.fit, kind, options)
    with flags.about(", ".join(options.file)):
        found = kind.fit(data, **given)
    print(found.summary())
    if len(data) == 1:
        print(design(found))
    options.directory.mkdir(parents=True, exist_ok=True)
    files = {"files": [Path(file).name for file in options.file]}
    output.write_json(options.directory / CAUSE[0], found.to_dict() | files)
    print(f"in {options.directory}: {CAUSE[0]}")
    return 0


def _master(options: argparse.Namespace) -> int:
    """Read the curves, superpose them by each law, and write the one of lower BIC."""
    output.check_directory(options)
    count = len(options.file)
    held: list[float | None] = [None] * count
    if options.temperature is not None:
        held = [*flags.numbers("--temperature", options.temperature)]
        if len(held) != count:
            raise ValueError(f"--temperature: expected {count}, one for each file, got {len(held)}")
    kind = KINDS["master"]
    data = [
        curve
        for file, T in zip(options.file, held, strict=True)
        for curve in flags.read(kind, file, options, temperature=T)
    ]
    laws = list(LAWS) if options.law is None else [options.law]
    if options.law is None and (options.fix or options.bound):
        raise ValueError("--fix, --bound: expected a --law whose parameters they name, got none")
    given = flags.arguments(kind.fit, kind, options)
    with flags.about(", ".join(options.file)):
        fits = [kind.fit(data, **(given | {"law": law})) for law in laws]
    found = min(fits, key=lambda fit: fit.bic)
    print(in_flags(found.summary()))
    for other in (fit for fit in fits if fit is not found):
        values = ", ".join(f"{name} = {value:.4g}" for name, value in other.values.items())
        print(
            f"{other.model.__name__}, {other.verdict}: {values}, rms deviation {other.deviation:.2g} K,"
            f" BIC higher by {other.bic - found.bic:.1f}"
        )
    return _leave(options, found)


def _leave(options: argparse.Namespace, found: Any) -> int:
    """Write the results of several files."""
    output.leave(found, options.directory, {"files": [Path(file).name for file in options.file]})
    print(f"in {options.directory}: summary.json, curve.csv, fit.png")
    return 0
