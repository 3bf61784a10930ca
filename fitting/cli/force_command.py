"""The command ``jaxcontact fit force``: Young's modulus from a force curve of a microscope."""

import argparse
import math
from pathlib import Path
from typing import Any

import jaxcontact as jc
from fitting.cli import flags
from fitting.fits.force import ForceFit, fit_force
from fitting.read.indentation import read_force
from fitting.views import output

NU = 0.5  # of gels and cells, which most force curves are of
FACE = 35.0  # half-angle of the pyramid that is assumed unless a tip is given [degrees]


def add_force(parser: Any) -> None:
    """Add the flags of ``fit force``."""
    parser.add_argument("file", metavar="FILE", help="a file of JPK, Asylum, Bruker or AFM Workshop, or text")
    parser.add_argument(
        "-o", dest="directory", type=Path, metavar="DIR", help="directory of the results (NAME-fit)"
    )
    parser.add_argument("--force", action="store_true", help="overwrite the contents of DIR")
    parser.add_argument("--curve", metavar="C", help="which of several curves, by name or position from 0")
    common = "also fit the polynomials in common use for thin samples, and print their error"
    parser.add_argument("--polynomials", action="store_true", help=common)
    add_sample(parser)
    parser.set_defaults(command=run)


def add_sample(parser: Any) -> None:
    """Add the flags for the tip, the sample, the calibration and the columns of force curves."""
    tip = parser.add_mutually_exclusive_group()
    tip.add_argument("--radius", type=float, metavar="R", help="a ball of this radius [m]")
    tip.add_argument("--cone", type=float, metavar="A", help="a cone of this half-angle [degrees]")
    pyramid = (
        f"a four-sided pyramid of this half-angle between axis and face [degrees] (the default, {FACE:g})"
    )
    tip.add_argument("--pyramid", type=float, metavar="A", help=pyramid)
    tip.add_argument("--punch", type=float, metavar="R", help="a flat punch of this radius [m]")
    parser.add_argument("--nu", type=float, help=f"Poisson's ratio of the sample ({NU:g}, with a note)")
    thin = "thickness of a sample bonded to glass or another rigid base [m]; else a half-space"
    parser.add_argument("--thickness", type=float, metavar="H", help=thin)
    base = "Young's modulus of the base below a sample with a --thickness [Pa], such as 70e9 of glass; rigid by default"
    parser.add_argument("--substrate-modulus", type=float, metavar="E", help=base)
    nu = "Poisson's ratio of that base (0.22)"
    parser.add_argument("--substrate-nu", type=float, default=0.22, metavar="NU", help=nu)
    spring = "spring constant of the cantilever [N/m], where the file does not state it"
    parser.add_argument("--spring-constant", type=float, metavar="K", help=spring)
    volt = "sensitivity of the deflection [m/V], where the file does not state it"
    parser.add_argument("--sensitivity", type=float, metavar="S", help=volt)
    for name in ("spring-constant", "sensitivity"):
        what = f"relative standard deviation of the {name.replace('-', ' ')}, which enters the interval of the modulus"
        parser.add_argument(f"--{name}-error", type=float, default=0.0, metavar="E", help=what)
    drag = (
        "viscous drag on the cantilever in liquid [N s/m], which is subtracted: a number, or fit to read it from the"
        " baselines of approach and retraction; not subtracted by default"
    )
    parser.add_argument("--drag", metavar="B", help=drag)
    errors = "estimated, absolute, or a standard deviation in N"
    flags.add_common(parser, "estimated", errors, "t, load, depth, height, separation")
    flags.add_bounds(parser)


def run(options: argparse.Namespace) -> int:
    """Fit a force curve and write the results."""
    if options.directory is None:
        options.directory = Path(f"{Path(options.file).name.split('.')[0]}-fit")
    _, assumed = tip_of(options)
    output.check_directory(options)
    curve = None if options.curve is None else flags.place(options.curve)
    found = fitted(options, options.file, curve)
    if assumed:
        print(assumed)
    return output.finish(options, found, {"assumed": assumed} if assumed else None)


def fitted(options: argparse.Namespace, file: str, curve: int | str | None) -> ForceFit:
    """Return the fit of a curve of a file."""
    given = {"spring_constant": options.spring_constant, "sensitivity": options.sensitivity}
    data = flags.read(read_force, file, options, curve=curve, **given)
    data, nu = flags.assume_nu(data, options.nu, NU)
    calibration = {
        name: value
        for name in ("spring_constant", "sensitivity")
        if (value := getattr(options, f"{name}_error")) != 0.0
    }
    with flags.about(file):
        return fit_force(
            data, indenter=tip_of(options)[0], nu=nu, thickness=options.thickness, substrate=_base(options),
            polynomials=getattr(options, "polynomials", False), bounds=flags.bounds(options), errors=calibration,
            spring_constant=options.spring_constant, drag=_drag(options.drag), **flags.weighting(options, False),
        )  # fmt: skip


def _drag(text: str | None) -> float | str | None:
    """Return a coefficient of drag, "fit" or None."""
    return text if text is None or text == "fit" else flags.number("--drag", text)


def _base(options: argparse.Namespace) -> Any:
    """Return the base of a thin sample, None for a rigid one."""
    E = options.substrate_modulus
    return None if E is None else jc.Elastic.from_young(E, options.substrate_nu)


def tip_of(options: argparse.Namespace) -> tuple[Any, str]:
    """Return the indenter, and a sentence where it is assumed; ValueError for lengths of no microscope."""
    flags.check_metres(options, radius=1e-2, punch=1e-2, thickness=0.1)
    if options.radius is not None:
        return jc.Sphere(options.radius), ""
    if options.punch is not None:
        return jc.FlatPunch(options.punch), ""
    if options.cone is not None:
        return jc.Cone(flags.half_angle("--cone", options.cone)), ""
    face = FACE if options.pyramid is None else options.pyramid
    # the cone of equal area: 4 tan(face)^2 d^2 = pi tan(cone)^2 d^2
    cone = jc.Cone(math.atan(2.0 / math.sqrt(math.pi) * math.tan(flags.half_angle("--pyramid", face))))
    why = (
        f"no tip given: a four-sided pyramid of {FACE:g} degrees is assumed, to which the modulus is conditional; give"
        " --radius, --cone, --pyramid or --punch"
    )
    return cone, why if options.pyramid is None else ""
