"""The command ``jaxcontact fit design``: creep tests that determine an expected material."""

import argparse
from typing import Any

from fitting.after.planning import design
from fitting.cli import flags
from fitting.models.structure import Volume, resolve


def add_design(parser: Any) -> None:
    """Add the flags of ``fit design``."""
    parser.add_argument(
        "--model", default="Burgers", metavar="M", help="model of the expected material (Burgers)"
    )
    what = "value of a parameter of the material in SI, such as G1=2e9; one for each parameter"
    parser.add_argument("--value", action="append", default=[], metavar="NAME=VALUE", help=what)
    target = "largest standard deviation of the logarithm of each parameter (0.1)"
    parser.add_argument("--target", type=float, default=0.1, metavar="SD", help=target)
    noise = "standard deviation of a point relative to its value (0.01)"
    parser.add_argument("--noise", type=float, default=0.01, metavar="S", help=noise)
    parser.add_argument(
        "--points", type=int, default=200, metavar="N", help="number of points of the test (200)"
    )
    parser.add_argument(
        "--first", type=float, default=1.0, metavar="T", help="first of the logarithmic times [s] (1)"
    )
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> int:
    """Print the table of tests."""
    structure = resolve(options.model)
    values = {name: flags.number("--value", text) for name, text in flags.pairs("--value", options.value)}
    if set(values) != set(structure.where) or not all(value > 0 for value in values.values()):
        given = ", ".join(f"{name}={value:g}" for name, value in values.items()) or "none"
        raise ValueError(f"--value: expected one > 0 for each of {', '.join(structure.where)}, got {given}")
    material = structure.material(values, Volume("nu", 0.3))
    print(
        design(
            material, target=options.target, noise=options.noise, points=options.points, first=options.first
        )
    )
    return 0
