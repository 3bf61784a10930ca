"""The command ``jaxcontact fit together``: one material from several tests of it."""

import argparse
from pathlib import Path
from typing import Any

from fitting.cli import flags, kinds
from fitting.fits.together import fit_together
from fitting.views import output

ALLOWED = ("creep", *kinds.MODULI)


def add_together(parser: Any) -> None:
    """Add the flags of ``fit together`` beyond the files and the model."""
    what = f"kind of each file, in their order ({', '.join(ALLOWED)})"
    parser.add_argument("--of", required=True, metavar="KIND,KIND,...", help=what)
    flags.add_creep(parser, weights=False)


def run(options: argparse.Namespace) -> int:
    """Fit one material to all files and write the results."""
    names = options.of.split(",")
    if len(options.file) < 2:
        raise ValueError(
            f"{options.file[0]}: expected several files, got one: jaxcontact fit {names[0]} fits it"
        )
    if len(names) != len(options.file) or not set(names) <= set(ALLOWED):
        raise ValueError(
            f"--of: expected a kind for each of {len(options.file)} files, of {', '.join(ALLOWED)}, got {options.of}"
        )
    if options.window is not None and len({name == "oscillation" for name in names}) > 1:
        raise ValueError(
            f"--window: expected none for a sweep over frequency beside a test over time, got {options.window}"
        )
    output.check_directory(options)
    # the fit weighs each test by itself
    of_kind = lambda kind: argparse.Namespace(
        **vars(options) | {"kind": kind, "weights": kinds.WEIGHTS[kind]}
    )
    data = [kinds.read(of_kind(name), file)[0] for name, file in zip(names, options.file, strict=True)]
    files = ", ".join(options.file)
    with flags.about(files):
        nu = flags.nu_of(options)
        found = fit_together(data, options.model, nu=nu, level=options.level, **flags.known(options))
    more = {"files": [Path(file).name for file in options.file], "kinds": names}
    return output.finish(argparse.Namespace(**vars(options) | {"file": files}), found, more)
