"""The command ``jaxcontact fit growth``: growth kinetics from the curves of one or several files."""

import argparse
import dataclasses
from pathlib import Path
from typing import Any

from fitting.cli import flags
from fitting.fits.growth import fit_growth
from fitting.read.growth import read_growth
from fitting.views import output
from fitting.views.text import in_flags


def add_growth(parser: Any) -> None:
    """The flags of ``fit growth``."""
    flags.add_file(parser, several=True)
    each = "one for each file, separated by commas, or one for all"
    parser.add_argument(
        "--stress", required=True, metavar="S,S,...", help=f"stress that drives the growth [Pa], {each}"
    )
    parser.add_argument("--temperature", required=True, metavar="T,T,...", help=f"temperature [K], {each}")
    parser.add_argument(
        "--start", type=float, metavar="T", help="time at which growth began, on the clock of the files [s]"
    )
    parser.add_argument(
        "--induction",
        metavar="T",
        help="time before which there is neither growth nor removal [s], the same for all curves: a number, or fit (0)",
    )
    errors = "estimated, proportional, relative, absolute, or a standard deviation in m"
    flags.add_common(parser, "estimated", errors, "t, thickness, sigma: standard deviations")
    flags.add_exclude(parser)
    flags.add_segment(
        parser, "one of several steps or intervals, by name or position from 0; repeat to join several"
    )
    flags.add_known(parser)
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> int:
    """Read, fit, write."""
    output.check_directory(options)
    stress, temperature = (_each(options, name) for name in ("stress", "temperature"))
    segment = options.segment and [flags.place(one) for one in options.segment]
    data = [
        flags.read(read_growth, file, options, stress=s, temperature=T, start=options.start, segment=segment)
        for file, s, T in zip(options.file, stress, temperature, strict=True)
    ]
    data = [flags.excluded(options, file, one) for file, one in zip(options.file, data, strict=True)]
    given = flags.weighting(options, data[0].sigma is not None)
    if "sigma" in given:
        data = [dataclasses.replace(one, sigma=given["sigma"]) for one in data]
        del given["sigma"]
    wait = options.induction
    wait = wait if wait in (None, "fit") else flags.number("--induction", wait)
    with flags.about(", ".join(options.file)):
        found = fit_growth(data, **given, **flags.known(options), induction=wait)
    print(in_flags(found.summary()))
    output.leave(found, options.directory, {"files": [Path(file).name for file in options.file]})
    print(f"in {options.directory}: summary.json, curve.csv, fit.png")
    return 0


def _each(options: argparse.Namespace, name: str) -> list[float]:
    """A number for each file; ValueError for another count."""
    values = [flags.number(f"--{name}", text) for text in getattr(options, name).split(",")]
    count = len(options.file)
    if len(values) not in (1, count):
        raise ValueError(f"--{name}: expected one number, or {count} for as many files, got {len(values)}")
    return values * (count if len(values) == 1 else 1)
