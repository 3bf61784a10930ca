"""The commands ``jaxcontact fit design`` and ``jaxcontact fit propagate``."""

import argparse
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from fitting.after.planning import design
from fitting.after.propagation import propagate
from fitting.cli import flags
from fitting.fits.creep import fit_creep
from fitting.models.structure import Volume, resolve
from fitting.views import output

RESULTS = {"creep": "J_1_per_Pa", "relaxation": "G_Pa", "depth": "depth_m"}  # results and their columns


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
    parser.set_defaults(command=_design)


def add_carry(parser: Any) -> None:
    """Add the flags of ``fit propagate`` beyond those of ``fit creep``."""
    what = (
        "creep J(t), relaxation G(t), or depth of a rigid ball on a half-space under a constant load (creep)"
    )
    parser.add_argument("--of", default="creep", choices=tuple(RESULTS), help=what)
    parser.add_argument("--times", required=True, metavar="T,T,...", help="times of the result [s]")
    parser.add_argument("--load", type=float, metavar="P", help="load on the ball [N]")
    parser.add_argument("--radius", type=float, metavar="R", help="radius of the ball [m]")


def _design(options: argparse.Namespace) -> int:
    """Print the table of tests."""
    structure = resolve(options.model)
    values = {name: flags.number("--value", text) for name, text in flags.pairs("--value", options.value)}
    if set(values) != set(structure.where) or not all(value > 0 for value in values.values()):
        raise ValueError(f"--value: expected one > 0 for each of {', '.join(structure.where)}, got {values}")
    material = structure.material(values, Volume("nu", 0.3))
    print(
        design(
            material, target=options.target, noise=options.noise, points=options.points, first=options.first
        )
    )
    return 0


def carry(options: argparse.Namespace) -> int:
    """Fit the creep curve, print its summary and the propagated result, and write both."""
    output.check_directory(options, (*output.RESULTS, "propagated.csv"))
    times = np.array([flags.number("--times", text) for text in options.times.split(",")])
    if not np.all(np.isfinite(times) & (times >= 0)):
        raise ValueError(f"--times: expected finite times >= 0 s, got {options.times}")
    result = _result(options, jnp.asarray(times))
    data, given = flags.crept(options, options.file)
    with flags.about(options.file):
        found = fit_creep(data, options.model, **given, **flags.known(options))
    if found.refused:
        raise ValueError(
            f"{options.file}: the fit is rejected, so that no result can be propagated: {found.refused[0]}"
        )
    band = propagate(found, result)
    name, rows = RESULTS[options.of], np.column_stack([times, band.value, band.sd, band.low, band.high])
    print(f"{options.of} with its {100 * found.level:g} % band")
    for t, value, _, low, high in rows:
        print(f"  {t:.6g} s: {value:.5g}, {low:.5g} to {high:.5g}  [{name}]")
    output.leave(found, options.directory, {"file": Path(options.file).name})
    header = f"t_s,{name},sd,low,high"
    save = lambda path: np.savetxt(path, rows, delimiter=",", header=header, comments="")
    output.write(options.directory / "propagated.csv", save)
    print(f"in {options.directory}: propagated.csv, and summary.json, curve.csv, fit.png of the fit")
    return 0


def _result(options: argparse.Namespace, times: Any) -> Any:
    """Return the requested function of a material."""
    given = (options.load, options.radius)
    if options.of != "depth":
        if given != (None, None):
            raise ValueError(f"--load and --radius: expected with --of depth, got --of {options.of}")
        return lambda material: getattr(material, options.of)(times)
    if None in given or not min(given) > 0:
        raise ValueError(
            f"--of depth: expected --load > 0 N and --radius > 0 m, got {given[0]} and {given[1]}"
        )
    size = 3.0 * options.load / (8.0 * options.radius**0.5)  # depth^(3/2) = 3 (1 - nu) P J/(8 sqrt(R))
    return lambda material: (size * (1.0 - material.nu) * material.creep(times)) ** (2.0 / 3.0)
