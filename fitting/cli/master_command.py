"""The command ``jaxcontact fit master``: time-temperature superposition of the curves of one or several files."""

import argparse
from pathlib import Path
from typing import Any

from fitting.cli import flags
from fitting.fits.master import LAWS, fit_master
from fitting.read.sweeps import read_sweeps
from fitting.views import output
from fitting.views.text import in_flags


def add_master(parser: Any) -> None:
    """Add the flags of ``fit master``."""
    flags.add_file(parser, several=True)
    held = "temperature of each file [K], separated by commas, where the files do not state it"
    parser.add_argument("--temperature", metavar="T,T,...", help=held)
    law = f"law of the shift factor: {' or '.join(LAWS)}; by default the one of lower BIC"
    parser.add_argument("--law", metavar="LAW", help=law)
    at = "reference temperature [K], of which the nearest measured one is taken (the median)"
    parser.add_argument("--reference", type=float, metavar="T", help=at)
    parser.add_argument("--vertical", action="store_true", help="fit vertical factors of the moduli too")
    parser.add_argument(
        "--level", type=float, default=0.95, metavar="L", help="confidence level of the intervals (0.95)"
    )
    selected = "selected angular frequencies [rad/s] or times [s]; one side may be empty"
    parser.add_argument("--window", metavar="BEGIN:END", help=selected)
    flags.add_places(parser, "omega, storage, loss, complex, delta, tan_delta, t, modulus, J, temperature")
    parser.add_argument(
        "--tension", type=float, metavar="NU", help="tests in tension, with this Poisson's ratio"
    )
    flags.add_known(parser)
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> int:
    """Read the curves, superpose them and write the results."""
    output.check_directory(options)
    count = len(options.file)
    held = [None] * count if options.temperature is None else _temperatures(options.temperature, count)
    data = [
        curve
        for file, T in zip(options.file, held, strict=True)
        for curve in flags.read(read_sweeps, file, options, temperature=T, nu=options.tension)
    ]
    laws = list(LAWS) if options.law is None else [options.law]
    if options.law is None and (options.fix or options.bound):
        raise ValueError("--fix, --bound: expected a --law whose parameters they name, got none")
    given = {"reference": options.reference, "vertical": options.vertical, "level": options.level}
    with flags.about(", ".join(options.file)):
        fits = [fit_master(data, law, **given, **flags.known(options)) for law in laws]
    found = min(fits, key=lambda fit: fit.bic)
    print(in_flags(found.summary()))
    for other in (fit for fit in fits if fit is not found):
        values = ", ".join(f"{name} = {value:.4g}" for name, value in other.values.items())
        print(
            f"{other.model.__name__}, {other.verdict}: {values}, rms deviation {other.deviation:.2g} K,"
            f" BIC higher by {other.bic - found.bic:.1f}"
        )
    output.leave(found, options.directory, {"files": [Path(file).name for file in options.file]})
    print(f"in {options.directory}: summary.json, curve.csv, fit.png")
    return 0


def _temperatures(text: str, count: int) -> list[float]:
    """Return a temperature for each file; ValueError for another count."""
    values = [flags.number("--temperature", one) for one in text.split(",")]
    if len(values) != count:
        raise ValueError(f"--temperature: expected {count}, one for each file, got {len(values)}")
    return values
