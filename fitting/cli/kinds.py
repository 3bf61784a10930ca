"""Kinds of curves that several commands serve: the flags, the reader and the fit of each."""

import argparse
from typing import Any, NamedTuple

import jaxcontact as jc
from fitting.cli import flags
from fitting.fits.creep import fit_creep
from fitting.fits.indentation import fit_indentation
from fitting.fits.modulus import fit_oscillation, fit_relaxation
from fitting.inference.result import Fit
from fitting.read.indentation import read_indentation
from fitting.read.modulus import read_oscillation, read_relaxation
from fitting.views import output

# The command ``jaxcontact fit indentation``: a material from time, load and depth of an indentation.


# defaults of flags that other kinds of tests do not have, by the names of options
USUAL_INDENTATION = {
    "ball_nu": 0.3, "substrate_nu": 0.3, "control": "load", "adhesion": "0", "contact_point": "0", "drift": "0",
    "machine_compliance": "0",
}  # fmt: skip
# all these flags
TEST = (
    "curve", "spring_constant", "in_contact", "radius", "punch", "cone", "ball_modulus", "bulk_modulus", "layer",
    "thickness", "substrate_modulus", *USUAL_INDENTATION,
)  # fmt: skip


def add_indentation(parser: Any) -> None:
    """Add the flags of ``fit indentation``."""
    flags.add_file(parser)
    flags.add_model(parser)
    errors = "absolute, estimated, proportional, relative, or a standard deviation in m (load control) or N"
    flags.add_common(
        parser, "absolute", errors, "t, load, depth, height, separation, sigma_depth, sigma_load"
    )
    flags.add_resample(parser)
    flags.add_segment(parser, "approach, hold or retract; repeat to select several")
    parser.add_argument("--nu", type=float, help="Poisson's ratio of the material (0.3, with a note)")
    add_test(parser)
    parser.set_defaults(command=run)


def add_test(parser: Any) -> None:
    """Add the flags for the curve, the indenter and the sample, which other kinds of tests do not have."""
    _add_curve(parser)
    _add_indenter(parser)
    bulk = "bulk modulus of the material [Pa], in place of --nu"
    parser.add_argument("--bulk-modulus", type=float, metavar="PA", help=bulk)
    control = "prescribed quantity, load or depth (load)"
    parser.add_argument("--control", default=USUAL_INDENTATION["control"], metavar="C", help=control)
    _add_sample(parser)
    adhesive = "of an adhesive ball: the work of adhesion [J/m2] (0), or fit or jkr to fit it (Elastic, --control depth)"
    parser.add_argument("--adhesion", default=USUAL_INDENTATION["adhesion"], metavar="W", help=adhesive)
    for name, what in (
        ("contact_point", "offset of the depth [m]"),
        ("drift", "drift of the depth [m/s]"),
        ("machine_compliance", "compliance of the instrument [m/N]"),
    ):
        flag, words = f"--{name.replace('_', '-')}", f"{what}: a number, or fit (0)"
        parser.add_argument(flag, default=USUAL_INDENTATION[name], metavar="X", help=words)


def _add_curve(parser: Any) -> None:
    """Add the flags that select a curve and its points."""
    parser.add_argument("--curve", metavar="C", help="one of several curves, by name or position from 0")
    spring = "spring constant of the cantilever [N/m]"
    parser.add_argument("--spring-constant", type=float, metavar="K", help=spring)
    taken = "leave out the points before contact, found from the load or given as a depth [m]"
    parser.add_argument("--in-contact", nargs="?", const="seen", metavar="DEPTH", help=taken)


def _add_sample(parser: Any) -> None:
    """Add the flags for a film or a thin sample, and for what lies below it."""
    film = "thickness of a film [m]; by default a half-space"
    parser.add_argument("--layer", type=float, metavar="H", help=film)
    thin = "thickness of a sample bonded to a rigid base [m], such as a gel in a dish; in place of --layer"
    parser.add_argument("--thickness", type=float, metavar="H", help=thin)
    modulus = "Young's modulus of the substrate [Pa]"
    parser.add_argument("--substrate-modulus", type=float, metavar="E", help=modulus)
    nu = "Poisson's ratio of the substrate (0.3)"
    parser.add_argument(
        "--substrate-nu", type=float, default=USUAL_INDENTATION["substrate_nu"], metavar="NU", help=nu
    )


def _add_indenter(parser: Any) -> None:
    """Add the flags for the indenter."""
    parser.add_argument("--radius", type=float, metavar="R", help="radius of the ball or of the --punch [m]")
    parser.add_argument("--punch", action="store_true", help="a flat punch of that radius in place of a ball")
    cone = "a cone in place of a ball: half-angle [degrees], or berkovich"
    parser.add_argument("--cone", metavar="A", help=cone)
    modulus = "Young's modulus of the indenter [Pa]; rigid by default"
    parser.add_argument("--ball-modulus", type=float, metavar="E", help=modulus)
    nu = "Poisson's ratio of the indenter (0.3)"
    parser.add_argument("--ball-nu", type=float, default=USUAL_INDENTATION["ball_nu"], metavar="NU", help=nu)


def run(options: argparse.Namespace) -> int:
    """Fit an indentation curve and write the results."""
    indenter_of(options)
    check_substrate(options)
    output.check_directory(options)
    return output.finish(options, fitted_indentation(options, options.file))


def fitted_indentation(options: argparse.Namespace, file: str) -> Any:
    """Return the fit of a file."""
    data, given = read_indentation_file(options, file)
    with flags.about(file):
        return fit_indentation(data, options.model, **given, **flags.known(options))


def read_indentation_file(options: argparse.Namespace, file: str) -> tuple[Any, dict[str, Any]]:
    """Return the curve, and the keyword arguments that fits of all models share."""
    flags.check_metres(options, radius=1.0, layer=0.1, thickness=0.1)
    check_substrate(options)
    indenter = indenter_of(options)
    data = flags.resampled(options, file, _indented(options, file, indenter))
    extra: dict[str, Any] = {"adhesion": adhesion_of(options), "thickness": options.thickness}
    for name in ("contact_point", "drift", "machine_compliance"):
        text = getattr(options, name)
        extra[name] = text if text.lower() == "fit" else flags.number(f"--{name.replace('_', '-')}", text)
    if options.layer is not None:
        extra |= {"layer": options.layer, "substrate": substrate_of(options)}
    nu = options.nu
    if options.bulk_modulus is None:
        data, nu = flags.assume_nu(data, nu, flags.NU)
    driven = "load" if options.control.lower() == "depth" else "depth"
    has_sigma = any(getattr(data, f"{kind}_{driven}") is not None for kind in ("sigma", "scatter"))
    given = {"indenter": indenter, "nu": nu, "bulk_modulus": options.bulk_modulus, "control": options.control}
    return data, given | flags.weighting(options, has_sigma, "absolute") | extra


def check_substrate(options: argparse.Namespace) -> None:
    """Raise ValueError for a layer without a substrate, or a substrate without a layer."""
    if options.layer is not None and options.substrate_modulus is None:
        raise ValueError("--substrate-modulus: expected Young's modulus in Pa under a --layer, got none")
    if options.layer is None and options.substrate_modulus is not None:
        raise ValueError(
            "--layer: expected the thickness of the film in m on a --substrate-modulus, got none"
        )


def substrate_of(options: argparse.Namespace) -> jc.Elastic:
    """Return the substrate."""
    return _elastic("--substrate-modulus", options.substrate_modulus, options.substrate_nu)


def adhesion_of(options: argparse.Namespace) -> Any:
    """Return the work of adhesion, or how it is fitted."""
    fitted = options.adhesion.lower() in ("fit", "jkr")
    return options.adhesion if fitted else flags.number("--adhesion", options.adhesion)


def indenter_of(options: argparse.Namespace) -> Any:
    """Return the indenter."""
    E = options.ball_modulus
    solid = None if E is None else _elastic("--ball-modulus", E, options.ball_nu)
    if options.cone is None:
        if options.radius is None:
            raise ValueError("--radius: expected the radius of the ball in m, or a --cone, got none")
        return (jc.FlatPunch if options.punch else jc.Sphere)(options.radius, solid)
    if options.radius is not None or options.punch:
        raise ValueError("--cone: expected no --radius and no --punch beside it")
    if options.cone.lower() == "berkovich":
        return jc.Cone.berkovich(solid)
    return jc.Cone(flags.half_angle("--cone", flags.number("--cone", options.cone)), solid)


def _indented(options: argparse.Namespace, file: str, indenter: Any) -> Any:
    """Return the curve, from contact on if requested; segments and window then refer to the remaining points."""
    curve = None if options.curve is None else flags.place(options.curve)
    of_file = {"curve": curve, "spring_constant": options.spring_constant}
    if options.in_contact is None:
        return flags.read(read_indentation, file, options, segment=options.segment, **of_file)
    window, options.window = options.window, None
    data = flags.read(read_indentation, file, options, **of_file)
    depth = None if options.in_contact == "seen" else flags.number("--in-contact", options.in_contact)
    stiffened = options.layer is not None or options.thickness is not None
    with flags.about(file):
        data = data.in_contact(depth, indenter, stiffened).only(*(options.segment or ()))
        return data.window(*flags.span("--window", window)) if window else data


def _elastic(flag: str, E: float, nu: float) -> jc.Elastic:
    if not (E > 0 and -1.0 < nu <= 0.5):
        raise ValueError(f"{flag}: expected a modulus > 0 and -1 < nu <= 0.5, got {E:g} and {nu:g}")
    return jc.Elastic.from_young(E, nu)


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
    ("indentation",): TEST,
}
USUAL = {"convention": flags.CONVENTION, **USUAL_INDENTATION}  # those with a default


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
    add_test(group)
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
        return fitted_indentation(options, file)
    data, given = read(options, file)
    fit = fit_creep if options.kind == "creep" else MODULI[options.kind].fit
    with flags.about(file):
        return fit(data, options.model, **given, **flags.known(options))


def read(options: argparse.Namespace, file: str) -> tuple[Any, dict[str, Any]]:
    """Return a curve, and the keyword arguments that all fits of it share."""
    if options.kind == "indentation":
        return read_indentation_file(options, file)
    if options.kind == "creep":
        return flags.crept(options, file)
    modulus = MODULI[options.kind]
    start = {"start": options.start} if modulus.timed else {}
    data, nu = flags.moduli(options, file, modulus.reader, **start)
    return data, flags.weighting(options, flags.averaged(data)) | {"nu": nu}
