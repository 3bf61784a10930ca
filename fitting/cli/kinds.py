"""Kinds of fits as commands: the reader and the fit of each, and the fit of a file, also for commands that serve several."""

import argparse
from typing import Any

from fitting.cli import flags
from fitting.cli.flags import FACE, Kind
from fitting.data.creep import read_creep
from fitting.data.growth import read_growth
from fitting.data.indentation import read_force, read_indentation
from fitting.data.moduli import read_oscillation, read_relaxation
from fitting.data.stiffness import read_stiffness
from fitting.data.sweeps import read_sweeps
from fitting.fits.cause import relaxation_cause
from fitting.fits.creep import fit_creep
from fitting.fits.force import fit_force
from fitting.fits.force_history import MODELS
from fitting.fits.growth import fit_growth
from fitting.fits.indentation import fit_indentation
from fitting.fits.master import LAWS, fit_master
from fitting.fits.modulus import fit_oscillation, fit_relaxation
from fitting.fits.poroelastic import fit_poroelastic
from fitting.fits.prony import fit_maxwell, fit_prony
from fitting.fits.spectrum import fit_spectrum
from fitting.fits.stiffness import CONTACTS, fit_stiffness

SERIES = "a generalised Maxwell model with these relaxation times [s], or auto, in place of --model"
EACH = "one for each file, separated by commas, or one for all"
EACH_FILE = {"required": True, "type": str, "metavar": "X,X,..."}
RAMP = (
    "duration [s] of a ramp at constant speed from t = 0 on, in place of the measured depths before the hold"
)
CONVENTION = 'convention of the compliance, "J" (gamma/tau) or "1/(2G)"; --tension is that of D'
KINDS = {
    "creep": Kind(read_creep, fit_creep, more=("exclude", "resample", "tension"), words={"convention": CONVENTION}),
    "prony": Kind(
        read_creep, fit_prony, more=("tau", "exclude", "resample", "tension"), without=("instantaneous", "flow"),
        words={"tau": "retardation times [s]; by default chosen by BIC", "convention": CONVENTION},
    ),
    "relaxation": Kind(
        read_relaxation, fit_relaxation, more=("exclude", "resample", "tension", "tau", "spectrum"),
        without=("convention",), words={"tau": SERIES},
    ),
    "oscillation": Kind(
        read_oscillation, fit_oscillation, more=("exclude", "tension", "tau", "spectrum"), without=("convention",),
        words={"tau": SERIES}, weights="proportional",
    ),
    "indentation": Kind(
        read_indentation, fit_indentation, more=("resample", "in_contact", "ball"), without=("rise",),
        words={
            "segment": "approach, hold or retract; repeat to select several",
            "bulk_modulus": "bulk modulus of the material [Pa], in place of --nu",
            "adhesion": "of an adhesive ball: the work of adhesion [J/m2] (0), or fit or jkr to fit it (Elastic,"
                        " --control depth)",
            "layer": "thickness of a film [m]; by default a half-space",
            "thickness": "thickness of a sample on a rigid base [m], such as a gel in a dish; in place of --layer",
            "unbonded": "the sample or film slides on its base without friction; by default it is bonded",
        },
        weights="absolute", nu=0.3,
    ),
    "force": Kind(
        read_force, fit_force, more=("pyramid",), nu=0.5, either=((("radius", "cone", "pyramid", "punch"), False),),
        words={
            "radius": "a ball of this radius [m]",
            "cone": {"type": float, "help": "a cone of this half-angle [degrees]"},
            "punch": {"action": "store", "type": float, "metavar": "R", "help": "a flat punch of this radius [m]"},
            "spring_constant": "spring constant of the cantilever [N/m], where the file does not state it",
            "sensitivity": "sensitivity of the deflection [m/V], where the file does not state it",
            "model": {"default": None, "help": f"viscoelastic material, fitted to approach and retraction:"
                      f" {', '.join(MODELS)}; by default an elastic modulus is fitted to the approach"},
            "adhesion": {"default": None, "metavar": "auto", "help": "auto: choose Hertz, DMT, Maugis or JKR by the Tabor"
                         " number of the fit, for a ball on a half-space; by default no adhesion"},
            "polynomials": "also fit the polynomials in common use for thin samples, and print their error",
            "substrate_modulus": "Young's modulus of the base below a sample with a --thickness [Pa], such as 70e9 of glass;"
                                 " rigid by default",
            "substrate_nu": {"default": flags.Usual(0.22), "help": "Poisson's ratio of that base"},
            "unbonded": "the sample slides on its base without friction; by default it is bonded",
        },
    ),
    "stiffness": Kind(
        read_stiffness, fit_stiffness, more=("tip",), without=("epsilon",), nu=0.3,
        either=((("radius", "cone", "punch"), True), (("area", "area_nm"), False)),
        words={
            "radius": "radius of a ball [m]",
            "cone": "half-angle of a cone [degrees], or berkovich",
            "punch": {"action": "store", "type": float, "metavar": "R", "help": "radius of a flat punch [m]"},
            "substrate_modulus": "Young's modulus of the substrate below the film [Pa]; rigid by default",
            "contact": {"choices": CONTACTS, "metavar": None},
            "unbonded": "the film slides on the substrate without friction; by default it is bonded",
        },
    ),
    "poroelastic": Kind(
        read_indentation, fit_poroelastic, more=("in_contact",), without=("rise", "punch"),
        either=((("radius", "cone"), True),),
        words={
            "radius": "radius of a ball [m]",
            "cone": "half-angle of a cone [degrees], or berkovich",
            "segment": "approach, hold or retract; repeat to select several",
            "ramp": f"{RAMP}; 0: a step",
            "unbonded": "the sample slides on its base without friction; by default it is bonded",
        },
    ),
    "cause": Kind(
        read_indentation, relaxation_cause, more=("in_contact",), without=("rise", "punch"),
        either=((("radius", "cone"), True),),
        words={
            "radius": "radius of a ball [m]",
            "cone": "half-angle of a cone [degrees], or berkovich",
            "segment": "approach, hold or retract; repeat to select several",
            "ramp": {"metavar": "T,T,...", "help": f"{RAMP}, {EACH}; 0: a step"},
        },
    ),
    "master": Kind(
        read_sweeps, fit_master, more=("tension",), without=("convention", "nu"),
        words={
            "column": "column of a quantity (omega, storage, loss, complex, delta, tan_delta, t, modulus, J, temperature)",
            "temperature": {"type": str, "metavar": "T,T,...", "help": "temperature of each file [K], separated by commas,"
                            " where the files do not state it"},
            "law": {"default": None, "metavar": "LAW",
                    "help": f"law of the shift factor: {' or '.join(LAWS)}; by default the one of lower BIC"},
        },
    ),
    "growth": Kind(
        read_growth, fit_growth, more=("exclude",), without=("initial", "contact"),
        words={
            "stress": EACH_FILE | {"help": f"stress that drives the growth [Pa], {EACH}"},
            "temperature": EACH_FILE | {"help": f"temperature [K], {EACH}"},
            "induction": "time [s] before which there is neither growth nor removal, the same for all curves: a number, or"
                         " fit (0)",
        },
    ),
}  # fmt: skip
SEVERAL = ("creep", "relaxation", "oscillation", "indentation")  # kinds of curves that several commands serve
SERIES_FLAGS = ("tau", "spectrum")  # of the commands of a modulus alone
USUAL_NU = 0.3


def add_kinds(parser: Any, flag: str | None, names: tuple[str, ...], without: tuple[str, ...] = ()) -> None:
    """Add the flag for the kind of the curves, if any, and all flags of these kinds, each once."""
    if flag:
        usual = "; ".join(f"{one} {KINDS[one].weights}" for one in names if KINDS[one].weights != "estimated")
        what = f"kind of the curves (creep); weights by default: estimated, except {usual}"
        parser.add_argument(flag, dest="kind", default="creep", choices=names, help=what)
    contact = parser
    if "indentation" in names:
        predicted = ", or of the contact that is predicted" if flag == "--data" else ""
        contact = parser.add_argument_group(f"of an indentation{predicted}")
    taken = {*without, *SERIES_FLAGS}
    for name in names:
        options = {one: given for one, given in flags.options_of(KINDS[name]).items() if one not in taken}
        flags.add(contact if name == "indentation" else parser, KINDS[name]._replace(either=()), options)
        taken |= options.keys()
    parser.set_defaults(kinds=names, **({"kind": "creep"} if flag else {}))
    if flag:
        parser.set_defaults(weights="", nu=None)


def checked(options: argparse.Namespace, free: tuple[str, ...] = ()) -> tuple[Kind, argparse.Namespace]:
    """Return the kind of the curves, and the options with its defaults; ValueError for a flag that its curves do not have,
    except for those in ``free``."""
    flags_of = {name: flags.options_of(KINDS[name]) for name in options.kinds}
    for name, value in vars(options).items():
        having = [one for one, own in flags_of.items() if name in own]
        if not having or options.kind in having or name in free or not value:
            continue
        if value != flags_of[having[0]][name].get("default"):
            raise ValueError(
                f"--{name.replace('_', '-')}: expected for {' and '.join(having)} alone, got a curve of {options.kind}"
            )
    kind = KINDS[options.kind]
    filled: dict[str, Any] = {"weights": options.weights or kind.weights}
    if options.nu is None and options.bulk_modulus is None and options.kind != "indentation":
        filled["nu"] = USUAL_NU
    return kind, argparse.Namespace(**vars(options) | filled)


def check_contact(options: argparse.Namespace) -> str:
    """Raise ValueError for an impossible indenter or sample; return a sentence where the indenter is assumed."""
    if not hasattr(options, "radius"):
        return ""
    if hasattr(options, "layer"):
        flags.indenter_of(options)
        flags.check_metres(options, radius=1.0, layer=0.1, thickness=0.1)
        if options.layer is not None and options.substrate_modulus is None:
            raise ValueError("--substrate-modulus: expected Young's modulus in Pa under a --layer, got none")
        if options.layer is None and options.substrate_modulus is not None:
            raise ValueError(
                "--layer: expected the thickness of the film in m on a --substrate-modulus, got none"
            )
        return ""
    if not hasattr(options, "pyramid"):
        flags.check_metres(options, radius=1.0, punch=1.0, thickness=0.1)
        return ""
    flags.check_metres(options, radius=1e-2, punch=1e-2, thickness=0.1)  # of a microscope
    flags.indenter_of(options)
    if any(getattr(options, name) is not None for name in ("radius", "punch", "cone", "pyramid")):
        return ""
    return (
        f"no tip given: a four-sided pyramid of {FACE:g} degrees is assumed, to which the modulus is conditional; give"
        " --radius, --cone, --pyramid or --punch"
    )


def fitted(kind: Kind, options: argparse.Namespace, file: str, **reading: Any) -> Any:
    """Return the fit of a file; reading: arguments of the reader beside those of the flags."""
    data, given = read(kind, options, file, **reading)
    fit: Any = kind.fit
    spectrum, tau = getattr(options, "spectrum", False), getattr(options, "tau", None)
    if kind.fit in (fit_relaxation, fit_oscillation) and (spectrum or tau is not None):
        # a series or a spectrum in place of a model
        known = given["fixed"] or given["bounds"]
        if spectrum and (tau is not None or known):
            raise ValueError("--spectrum: expected no --tau, no --fix and no --bound beside it, got some")
        if known:
            raise ValueError("--tau: expected no --fix and no --bound beside it, got some")
        fit = fit_spectrum if spectrum else fit_maxwell
        left = ("model", "fixed", "bounds", *(("tau",) if spectrum else ()))
        given = {name: value for name, value in given.items() if name not in left}
    with flags.about(file):
        return fit(data, **given)


def read(kind: Kind, options: argparse.Namespace, file: str, **reading: Any) -> tuple[Any, dict[str, Any]]:
    """Return a curve, and the keyword arguments of its fit."""
    if kind.reader is read_indentation:
        check_contact(options)
        reading |= {"segment": options.segment}
    if getattr(options, "in_contact", None) is None or kind.reader is not read_indentation:
        data = flags.read(kind, file, options, **reading)
    else:  # segments and window refer to the points that remain
        data = flags.read(kind, file, options, segment=None, window=None)
        depth = None if options.in_contact == "seen" else flags.number("--in-contact", options.in_contact)
        stiffened = any(getattr(options, name, None) is not None for name in ("layer", "thickness"))
        with flags.about(file):
            data = data.in_contact(depth, flags.indenter_of(options), stiffened).only(
                *(options.segment or ())
            )
            data = data.window(*flags.span("--window", options.window)) if options.window else data
    data = flags.averaged(kind, file, options, data)
    given = flags.arguments(kind.fit, kind, options)
    if "nu" in given:
        data, given["nu"] = flags.nu_of(kind, options, data)
    return data, given | flags.weighting(kind, options, data)
