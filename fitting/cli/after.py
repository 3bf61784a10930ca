"""The commands after a fit and before one, ``jaxcontact fit posterior``, ``propagate`` and ``design``: draws from the
posterior, a prediction with its band, and creep tests that determine an expected material."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from fitting.after.planning import design
from fitting.after.posterior import draw, posterior
from fitting.after.propagation import propagate
from fitting.cli import flags, kinds
from fitting.data.indentation import probe_of
from fitting.models.structure import Compressibility, resolve
from fitting.views import output, sheet
from fitting.views.text import in_flags

DRAWS = ("posterior.csv", "posterior.png")


def run_posterior(options: argparse.Namespace) -> int:
    """Fit the curve, draw from the posterior, print the intervals of both, and write them."""
    kind, options = kinds.checked(options)
    output.check_directory(options, (*output.RESULTS, *DRAWS))
    fit = kinds.fitted(kind, options, options.file)
    with flags.about(options.file):
        found = posterior(fit, samples=options.samples, seed=options.seed)
    print(in_flags(fit.summary()))
    print(found.summary())
    key = fit.structure.key
    plain = {
        "medians": {key(name): value for name, value in found.medians.items()},
        "intervals": {key(name): list(ends) for name, ends in found.intervals.items()},
        "prior": {key(name): list(ends) for name, ends in found.prior.items()},
        "not_bounded_by_the_data": list(found.open), "r_hat": dict(found.r_hat),
        "effective_draws": dict(found.ess), "divergent": found.divergent,
    }  # fmt: skip
    output.leave(fit, options.directory, {"file": Path(options.file).name, "posterior": plain})
    units = {name: fit.structure.unit(name) for name in found.samples}
    header = ",".join(f"{name} [{unit}]" for name, unit in units.items())
    rows = np.column_stack(list(found.samples.values()))
    save = lambda path: np.savetxt(path, rows, delimiter=",", header=header, comments="")
    output.write(options.directory / DRAWS[0], save)
    _draw(options, draw(found, units, fit.intervals, fit.level), DRAWS)
    return 0


def _draw(options: argparse.Namespace, figure: Any, files: tuple[str, str]) -> None:
    """Write the figure, the second of the files, and print where all results are."""
    output.write(options.directory / files[1], lambda path: figure.savefig(path, dpi=150, format="png"))
    print(f"in {options.directory}: {', '.join(files)}, and summary.json, curve.csv, fit.png of the fit")


PREDICTION = ("propagated.csv", "propagated.png")
CELLS = 64  # along the side of the grid of a contact with a film
MARCH = 60  # time steps before the first and between the first and the last requested time


class PredictedQuantity(NamedTuple):
    """A predicted quantity: its name on an axis and in the table, unit, and key in JSON; over: name and unit of the
    abscissa."""

    name: str
    unit: str
    column: str
    over: tuple[str, str] = ("t", "s")


OMEGA = ("ω", "rad/s")
RESULTS = {
    "creep": PredictedQuantity("J", "1/Pa", "J_1_per_Pa"),
    "relaxation": PredictedQuantity("G", "Pa", "G_Pa"),
    "storage": PredictedQuantity("G'", "Pa", "storage_Pa", OMEGA),
    "loss": PredictedQuantity("G''", "Pa", "loss_Pa", OMEGA),
    "depth": PredictedQuantity("depth", "m", "depth_m"),
}
# flags of a predicted contact
CONTACT = ("radius", "punch", "cone", "ball_modulus", "ball_nu", "layer", "substrate_modulus", "substrate_nu")


def add_propagate(parser: Any) -> None:
    """Add the flags of ``fit propagate`` beyond those of the fit."""
    what = (
        "creep J(t), relaxation G(t), storage or loss modulus, or depth of an indenter under a constant load (creep); the"
        " indenter and the film are those of an indentation, otherwise --radius, --cone, --layer and so on"
    )
    parser.add_argument("--of", default="creep", choices=tuple(RESULTS), help=what)
    parser.add_argument("--times", metavar="T,T,...", help="times of the result [s]")
    omega = "angular frequencies of a storage or loss modulus [rad/s]"
    parser.add_argument("--frequencies", metavar="W,W,...", help=omega)
    parser.add_argument("--load", type=float, metavar="P", help="load on the indenter [N]")


def run_propagate(options: argparse.Namespace) -> int:
    """Fit the curve, print its summary and the prediction, and write both."""
    output.check_directory(options, (*output.RESULTS, *PREDICTION))
    wanted, of = RESULTS[options.of], options.of
    # the times or frequencies of the result
    flag, other = ("--frequencies", "--times") if wanted.over is OMEGA else ("--times", "--frequencies")
    text = getattr(options, flag[2:])
    if text is None or getattr(options, other[2:]) is not None:
        raise ValueError(f"{flag}: expected values for --of {of}, and no {other}")
    at = np.array(flags.numbers(flag, text))
    if not np.all(np.isfinite(at) & (at >= 0)):
        raise ValueError(f"{flag}: expected finite values >= 0, got {text}")
    # the result as a function of a material
    x = jnp.asarray(at)
    if of == "depth":
        # a contact whose depth follows from a material
        flags.indenter_of(options)
        if options.load is None or not options.load > 0:
            raise ValueError(f"--of depth: expected --load > 0 N, got {options.load}")
        kinds.check_contact(options)
        if options.thickness is not None:
            raise ValueError("--thickness: expected a --layer on a substrate for --of depth")
        if flags.adhesion_of(options) != 0.0:
            raise ValueError(
                "--adhesion: expected 0 for --of depth, which is that of a contact without adhesion, got"
                f" {options.adhesion}"
            )
        if options.bulk_modulus is not None and options.layer is None:
            raise ValueError("--bulk-modulus: expected --nu for the depth on a half-space")
    elif options.load is not None:
        raise ValueError(f"--load: expected with --of depth, got --of {of}")
    kind, options = kinds.checked(options, CONTACT if of == "depth" else ())
    result: Callable[..., Any]
    if of in ("storage", "loss"):
        part = jnp.real if of == "storage" else jnp.imag
        result = lambda material: part(material.complex_modulus(x))
    elif of == "depth":
        result = _on_half_space(options, x) if options.layer is None else _on_film(options, at)
    else:
        result = lambda material: getattr(material, of)(x)
    fit = kinds.fitted(kind, options, options.file)
    if fit.refused:
        raise ValueError(
            f"{options.file}: the fit is rejected, so that no result can be propagated: {fit.refused[0]}"
        )
    with flags.about(options.file):
        band = propagate(fit, result)
    rows = np.column_stack([at, band.value, band.sd, band.low, band.high])
    print(in_flags(fit.summary()))
    print(f"{of} with its {100 * fit.level:g} % band")
    for here, value, _, low, high in rows:
        print(f"  {here:.6g} {wanted.over[1]}: {value:.5g}, {low:.5g} to {high:.5g} {wanted.unit}")
    keys = ("omega_rad_per_s" if wanted.over is OMEGA else "t_s", wanted.column, "sd", "low", "high")
    found = dict(zip(keys, rows.T.tolist(), strict=True))
    output.leave(fit, options.directory, {"file": Path(options.file).name, "propagated": found})
    heads = [f"{one} [{wanted.unit}]" for one in (wanted.name, "sd", "low", "high")]
    heads = ["{} [{}]".format(*wanted.over), *heads]
    output.write_table(options.directory / PREDICTION[0], heads, rows)
    _draw(options, sheet.prediction(wanted, at, band, fit.level), PREDICTION)
    return 0


def _on_half_space(options: argparse.Namespace, times: Any) -> Callable[..., Any]:
    """Return the depth (k,) under a constant load on a half-space, as a function of a material (``data/indentation.py``)."""
    indenter = flags.indenter_of(options)
    probe = probe_of(indenter)

    def depth(material: Any) -> Any:
        compliance = (1.0 - material.nu) * material.creep(times) + indenter.compliance()
        return (options.load * compliance / probe.size) ** (1.0 / probe.power)

    return depth


def _on_film(options: argparse.Namespace, at: np.ndarray) -> Callable[..., Any]:
    """Return the depth (k,) under a constant load on a film, as a function of a material, by the contact solver.

    The grid is that of the material of the fit, which calls the function first with known values.
    """
    indenter, load = flags.indenter_of(options), jc.Load(options.load)
    substrate = flags.elastic(options, "substrate")
    later = at[at > 0.0]
    steps = np.geomspace(0.05 * later.min(), later.max(), MARCH) if later.size else np.zeros(0)
    times, places = np.unique(np.concatenate([[0.0], steps, at]), return_inverse=True)
    grids: list[jc.Grid] = []

    @jax.jit
    def solved(material: Any) -> Any:
        return jc.indent(_coated(material), indenter, load, jnp.asarray(times), grid=grids[0], save="last")

    def _coated(material: Any) -> Any:
        return jc.LayeredHalfSpace([jc.Layer(material, options.layer)], substrate)

    def depth(material: Any) -> Any:
        if not grids:
            grids.append(jc.Grid.around(_coated(material), indenter, load, times, n=CELLS))
            if not bool(jnp.all(solved(material).converged)):
                raise ValueError(
                    "--of depth: expected a contact that the solver can solve, got one that it cannot"
                )
        return solved(material).approach[places[-at.size :]]

    return depth


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


def run_design(options: argparse.Namespace) -> int:
    """Print the table of tests."""
    structure = resolve(options.model)
    values = {
        name: flags.number("--value", text) for name, text in flags.pairs("--value", options.value).items()
    }
    if set(values) != set(structure.where) or not all(value > 0 for value in values.values()):
        given = ", ".join(f"{name}={value:g}" for name, value in values.items()) or "none"
        raise ValueError(f"--value: expected one > 0 for each of {', '.join(structure.where)}, got {given}")
    material = structure.material(values, Compressibility("nu", 0.3))
    print(
        design(
            material, target=options.target, noise=options.noise, points=options.points, first=options.first
        )
    )
    return 0
