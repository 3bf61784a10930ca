"""The command ``jaxcontact fit propagate``: a prediction from a fit, with the band of its uncertainty."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from fitting.after.propagation import propagate
from fitting.cli import flags, kinds
from fitting.data.indentation import probe_of
from fitting.views import band_picture, output
from fitting.views.text import in_flags

FILES = ("propagated.csv", "propagated.png")
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


def run(options: argparse.Namespace) -> int:
    """Fit the curve, print its summary and the prediction, and write both."""
    output.check_directory(options, (*output.RESULTS, *FILES))
    found_at = _abscissae(options)
    _check_contact(options)
    options = kinds.checked(options, CONTACT if options.of == "depth" else ())
    result = _result(options, found_at)
    fit = kinds.fitted(options, options.file)
    if fit.refused:
        raise ValueError(
            f"{options.file}: the fit is rejected, so that no result can be propagated: {fit.refused[0]}"
        )
    with flags.about(options.file):
        band = propagate(fit, result)
    rows = np.column_stack([found_at, band.value, band.sd, band.low, band.high])
    print(in_flags(fit.summary()))
    _print(options.of, rows, fit.level)
    names = _named(options.of)
    output.leave(
        fit,
        options.directory,
        {"file": Path(options.file).name, "propagated": dict(zip(names, rows.T.tolist(), strict=True))},
    )
    wanted = RESULTS[options.of]
    heads = [
        "{} [{}]".format(*wanted.over),
        *(f"{one} [{wanted.unit}]" for one in (wanted.name, "sd", "low", "high")),
    ]
    output.write_table(options.directory / FILES[0], heads, rows)
    figure = band_picture.draw(RESULTS[options.of], found_at, band, fit.level)
    output.write(options.directory / FILES[1], lambda path: figure.savefig(path, dpi=150, format="png"))
    print(f"in {options.directory}: {', '.join(FILES)}, and summary.json, curve.csv, fit.png of the fit")
    return 0


def _abscissae(options: argparse.Namespace) -> np.ndarray:
    """Return the times or frequencies of the result, (k,)."""
    flag, other = (
        ("--frequencies", "--times") if RESULTS[options.of].over is OMEGA else ("--times", "--frequencies")
    )
    text = getattr(options, flag[2:])
    if text is None or getattr(options, other[2:]) is not None:
        raise ValueError(f"{flag}: expected values for --of {options.of}, and no {other}")
    at = np.array([flags.number(flag, one) for one in text.split(",")])
    if not np.all(np.isfinite(at) & (at >= 0)):
        raise ValueError(f"{flag}: expected finite values >= 0, got {text}")
    return at


def _check_contact(options: argparse.Namespace) -> None:
    """Raise ValueError unless a load, and what it needs, is given for a depth alone."""
    if options.of != "depth":
        if options.load is not None:
            raise ValueError(f"--load: expected with --of depth, got --of {options.of}")
        return
    kinds.indenter_of(options)
    if options.load is None or not options.load > 0:
        raise ValueError(f"--of depth: expected --load > 0 N, got {options.load}")
    kinds.check_substrate(options)
    if options.thickness is not None:
        raise ValueError("--thickness: expected a --layer on a substrate for --of depth")
    if kinds.adhesion_of(options) != 0.0:
        raise ValueError(
            f"--adhesion: expected 0 for --of depth, which is that of a contact without adhesion, got {options.adhesion}"
        )
    if options.bulk_modulus is not None and options.layer is None:
        raise ValueError("--bulk-modulus: expected --nu for the depth on a half-space")


def _result(options: argparse.Namespace, at: np.ndarray) -> Callable[..., Any]:
    """Return the requested function of a material."""
    x, of = jnp.asarray(at), options.of
    if of in ("storage", "loss"):
        part = jnp.real if of == "storage" else jnp.imag
        return lambda material: part(material.complex_modulus(x))
    if of != "depth":
        return lambda material: getattr(material, of)(x)
    return _on_half_space(options, x) if options.layer is None else _on_film(options, at)


def _on_half_space(options: argparse.Namespace, times: Any) -> Callable[..., Any]:
    """Return the depth (k,) under a constant load on a half-space, as a function of a material (``data/indentation.py``)."""
    indenter = kinds.indenter_of(options)
    probe = probe_of(indenter)

    def depth(material: Any) -> Any:
        compliance = (1.0 - material.nu) * material.creep(times) + indenter.compliance()
        return (options.load * compliance / probe.size) ** (1.0 / probe.power)

    return depth


def _on_film(options: argparse.Namespace, at: np.ndarray) -> Callable[..., Any]:
    """Return the depth (k,) under a constant load on a film, as a function of a material, by the contact solver.

    The grid is that of the material of the fit, which calls the function first with known values.
    """
    indenter, load = kinds.indenter_of(options), jc.Load(options.load)
    substrate = kinds.substrate_of(options)
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


def _print(of: str, rows: np.ndarray, level: float) -> None:
    """Print the prediction."""
    wanted = RESULTS[of]
    print(f"{of} with its {100 * level:g} % band")
    for at, value, _, low, high in rows:
        print(f"  {at:.6g} {wanted.over[1]}: {value:.5g}, {low:.5g} to {high:.5g} {wanted.unit}")


def _named(of: str) -> tuple[str, ...]:
    """Return the keys of the prediction in summary.json."""
    wanted = RESULTS[of]
    return ("t_s" if wanted.over is not OMEGA else "omega_rad_per_s", wanted.column, "sd", "low", "high")
