"""The command ``jaxcontact fit stiffness``: modulus over depth from a continuous stiffness measurement."""

import argparse
from typing import Any

import jaxcontact as jc
from fitting.cli import flags
from fitting.fits.stiffness import CONTACTS, fit_stiffness
from fitting.read.stiffness import read_stiffness
from fitting.views import output


def add_stiffness(parser: Any) -> None:
    """Add the flags of ``fit stiffness``."""
    flags.add_file(parser)
    tips = parser.add_mutually_exclusive_group(required=True)
    tips.add_argument("--radius", type=float, metavar="R", help="radius of a ball [m]")
    tips.add_argument("--cone", metavar="A", help="half-angle of a cone [degrees], or berkovich")
    tips.add_argument("--punch", type=float, metavar="R", help="radius of a flat punch [m]")
    diamond = "Young's modulus of the tip [Pa], such as 1141e9 of diamond; rigid by default"
    parser.add_argument("--tip-modulus", type=float, metavar="E", help=diamond)
    parser.add_argument(
        "--tip-nu", type=float, default=0.07, metavar="NU", help="Poisson's ratio of the tip (0.07)"
    )
    parser.add_argument("--nu", type=float, help="Poisson's ratio of the sample (0.3, with a note)")
    thin = "thickness of a film [m], or fit to fit it; by default a half-space"
    parser.add_argument("--thickness", metavar="H", help=thin)
    base = "Young's modulus of the substrate below the film [Pa]; rigid by default"
    parser.add_argument("--substrate-modulus", type=float, metavar="E", help=base)
    nu = "Poisson's ratio of the substrate (0.3)"
    parser.add_argument("--substrate-nu", type=float, default=0.3, metavar="NU", help=nu)
    usual = "stated where the file has areas, oliver-pharr for a cone, elastic for others"
    how = f"contact radius: {' or '.join(CONTACTS)} ({usual})"
    parser.add_argument("--contact", choices=CONTACTS, help=how)
    areas = parser.add_mutually_exclusive_group()
    area = "area function of the tip, c0 d^2 + c1 d + c2 d^(1/2) + c3 d^(1/4) ..., in SI: c0 [-], c1 [m], c2 [m^1.5] ..."
    areas.add_argument("--area", metavar="C0,C1,...", help=area)
    nano = "the same in powers of nm, as instruments print them: c0 [-], c1 [nm], c2 [nm^1.5] ..."
    areas.add_argument("--area-nm", metavar="C0,C1,...", help=nano)
    beta = "factor on the stiffness of a tip that is not of revolution (1); often 1.034 for Berkovich"
    parser.add_argument("--beta", type=float, default=1.0, metavar="B", help=beta)
    parser.add_argument("--curve", metavar="C", help="one of several curves, by name or position from 0")
    errors = "estimated, proportional, relative, absolute, or a standard deviation in N/m"
    columns = "depth, stiffness, load, area, sigma: standard deviations of the stiffness"
    flags.add_common(parser, "estimated", errors, columns, window="depths [m]")
    flags.add_bounds(parser)
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> int:
    """Fit a contact stiffness over depth and write the results."""
    output.check_directory(options)
    curve = None if options.curve is None else flags.place(options.curve)
    data = flags.read(read_stiffness, options.file, options, curve=curve)
    data, nu = flags.assume_nu(data, options.nu, flags.NU)
    with flags.about(options.file):
        found = fit_stiffness(
            data, indenter=_tip(options), nu=nu, thickness=_thickness(options.thickness),
            substrate=_elastic(options.substrate_modulus, options.substrate_nu), contact=options.contact,
            area=_area(options),
            beta=options.beta, bounds=flags.bounds(options), **flags.weighting(options, data.sigma is not None),
        )  # fmt: skip
    return output.finish(options, found)


def _area(options: argparse.Namespace) -> list[float] | None:
    """Return the coefficients of the area function in SI, None without one."""
    if options.area is not None:
        return [flags.number("--area", text) for text in options.area.split(",")]
    if options.area_nm is None:
        return None
    found = [flags.number("--area-nm", text) for text in options.area_nm.split(",")]
    power = lambda k: 2.0 if k == 0 else 0.5 ** (k - 1)
    return [c * 1e-9 ** (2.0 - power(k)) for k, c in enumerate(found)]


def _thickness(text: str | None) -> float | str | None:
    """Return a thickness, "fit" or None."""
    return text if text is None or text == "fit" else flags.number("--thickness", text)


def _elastic(E: float | None, nu: float) -> jc.Elastic | None:
    """Return an elastic material, None where there is no modulus."""
    return None if E is None else jc.Elastic.from_young(E, nu)


def _tip(options: argparse.Namespace) -> Any:
    """Return the indenter."""
    flags.check_metres(options, radius=1.0, punch=1.0)
    solid = _elastic(options.tip_modulus, options.tip_nu)
    if options.radius is not None:
        return jc.Sphere(options.radius, solid)
    if options.punch is not None:
        return jc.FlatPunch(options.punch, solid)
    if options.cone.lower() == "berkovich":
        return jc.Cone.berkovich(solid)
    if options.cone.isalpha():
        raise ValueError(f"--cone: expected degrees or berkovich, got {options.cone!r}")
    return jc.Cone(flags.half_angle("--cone", flags.number("--cone", options.cone)), solid)
