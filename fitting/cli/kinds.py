"""Kinds of curves that several commands serve: the flags, the reader and the fit of each."""

import argparse
from typing import Any, NamedTuple

from fitting.cli import flags, indentation_command
from fitting.fits.creep import fit_creep
from fitting.fits.modulus import fit_oscillation, fit_relaxation
from fitting.inference.result import Fit
from fitting.io.modulus_reader import read_oscillation, read_relaxation


class Modulus(NamedTuple):
    """Reader and fit of a modulus; timed: whether it is measured over time."""

    reader: Any
    fit: Any
    timed: bool


MODULI = {
    "relaxation": Modulus(read_relaxation, fit_relaxation, True),
    "oscillation": Modulus(read_oscillation, fit_oscillation, False),
}
KINDS = ("creep", *MODULI, "indentation")
# weights of each kind unless others are given
WEIGHTS = {
    "creep": "estimated",
    "relaxation": "estimated",
    "oscillation": "proportional",
    "indentation": "absolute",
}
# flags of some kinds alone, by their names in the options
ALONE = {
    ("creep",): ("stress", "convention"),
    ("creep", "relaxation"): ("start",),
    ("creep", "relaxation", "indentation"): ("resample",),
    ("creep", "relaxation", "oscillation"): ("tension", "exclude"),
    ("indentation",): indentation_command.TEST,
}
USUAL = {"convention": flags.CONVENTION, **indentation_command.USUAL}  # those with a default


def add_kind(parser: Any, flag: str = "--of") -> None:
    """Add the flag for the kind of the curves; creep by default."""
    usual = "; ".join(f"{name} {weights}" for name, weights in WEIGHTS.items() if weights != "estimated")
    what = f"kind of the curves (creep); weights by default: estimated, except {usual}"
    parser.add_argument(flag, dest="kind", default="creep", choices=KINDS, help=what)


def add_curves(parser: Any, title: str = "of an indentation") -> None:
    """Add the flags for reading and weighting curves of any kind; title: of those for the curve and the contact of an
    indentation."""
    flags.add_creep(parser)
    group = parser.add_argument_group(title)
    indentation_command.add_test(group)
    parser.set_defaults(weights="", nu=None)


def checked(options: argparse.Namespace, free: tuple[str, ...] = ()) -> argparse.Namespace:
    """Return the options with the defaults of the kind; ValueError for a flag that its curves do not have, except for
    those in ``free``."""
    for kinds, names in ALONE.items():
        chosen = {one: getattr(options, one, None) for one in names if one not in free}
        given = [one for one, value in chosen.items() if value and value != USUAL.get(one)]
        if options.kind not in kinds and given:
            raise ValueError(
                f"--{given[0].replace('_', '-')}: expected for {' and '.join(kinds)} alone, got a curve of {options.kind}"
            )
    filled = {"weights": options.weights or WEIGHTS[options.kind]}
    if options.nu is None and options.bulk_modulus is None and options.kind != "indentation":
        filled["nu"] = 0.3
    return argparse.Namespace(**vars(options) | filled)


def fitted(options: argparse.Namespace, file: str) -> Fit:
    """Return the fit of a file, of options that are ``checked``."""
    if options.kind == "indentation":
        return indentation_command.fitted(options, file)
    data, given = read(options, file)
    fit = fit_creep if options.kind == "creep" else MODULI[options.kind].fit
    with flags.about(file):
        return fit(data, options.model, **given, **flags.known(options))


def read(options: argparse.Namespace, file: str) -> tuple[Any, dict[str, Any]]:
    """Return a curve, and the keyword arguments that all fits of it share."""
    if options.kind == "indentation":
        return indentation_command.read(options, file)
    if options.kind == "creep":
        return flags.crept(options, file)
    modulus = MODULI[options.kind]
    start = {"start": options.start} if modulus.timed else {}
    data, nu = flags.moduli(options, file, modulus.reader, **start)
    return data, flags.weighting(options, flags.averaged(data)) | {"nu": nu}
