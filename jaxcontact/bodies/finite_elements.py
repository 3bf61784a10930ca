"""Materials as text for finite-element programs: the Prony table of the relaxation modulus, in each program's convention.

A material with a discrete spectrum relaxes as

    G(t) = Ge + sum_i G_i exp(-t/tau_i),      G0 = Ge + sum_i G_i,

with the relaxation times tau_i, which are shorter than the retardation times of its creep. The programs take

    Abaqus    E0, nu0 and g_i = G_i/G0, k_i = K_i/K0:       *VISCOELASTIC, TIME=PRONY
    ANSYS     E0, nu0 and alpha_i = G_i/G0 (and K_i/K0):    TB,PRONY
    COMSOL    Ge, Ke and G_i (and K_i) in Pa:               Generalized Maxwell

With a constant Poisson's ratio the bulk modulus relaxes in proportion to G; with a bulk modulus K it is elastic, and
nu0 = (3 K - 2 G0)/(6 K + 2 G0).

Sources: Abaqus Analysis User's Guide, Time domain viscoelasticity; ANSYS Material Reference, Viscoelasticity; COMSOL
Structural Mechanics Module User's Guide, Viscoelasticity.
"""

import math
import re
from typing import Any, NamedTuple

import numpy as np

from jaxcontact._support import checks

# unit of length, of stress and of density of a consistent system with seconds, in SI
SYSTEMS = {
    "m": ("m, kg, s, N, Pa", 1.0, 1.0, "Pa", "kg/m3"),
    "mm": ("mm, tonne, s, N, MPa", 1e6, 1e12, "MPa", "tonne/mm3"),
    "um": ("um, kg, s, uN, MPa", 1e6, 1e18, "MPa", "kg/um3"),
}
LEAST = 1e-12  # part of G0 below which a term is left out
FAR = 1e3  # time of flow over the longest time of interest from which a solid's series is one of a solid
PROBES = 200  # times at which the error of an approximation is measured


class Table(NamedTuple):
    """The relaxation modulus of a material: Ge [Pa], G_i [Pa] (n,) and tau_i [s] (n,), with either nu or K [Pa].

    words: lines of comment on where the table comes from.
    """

    equilibrium: float
    moduli: np.ndarray
    times: np.ndarray
    nu: float | None
    bulk_modulus: float | None
    words: tuple[str, ...] = ()

    @property
    def instantaneous(self) -> float:
        """G0 [Pa]."""
        return self.equilibrium + float(np.sum(self.moduli))

    def relaxation(self, t: np.ndarray) -> np.ndarray:
        """Return G(t) [Pa], t (n,) [s]."""
        return self.equilibrium + np.exp(-t[:, None] / self.times) @ self.moduli

    def nu_at(self, G: float) -> float:
        """Return Poisson's ratio where the shear modulus is G [Pa]."""
        if self.bulk_modulus is None:
            assert self.nu is not None
            return self.nu
        return (3.0 * self.bulk_modulus - 2.0 * G) / (6.0 * self.bulk_modulus + 2.0 * G)

    @property
    def bulk_relaxes(self) -> bool:
        """Whether the bulk modulus relaxes with G; an incompressible one is infinite."""
        return self.bulk_modulus is None and self.nu != 0.5


def table(
    name: str, equilibrium: Any, weights: Any, rates: Any, nu: Any, bulk_modulus: Any, long_term: float
) -> Table:
    """Return the table of a material from its relaxation modes G(t) = Ge + sum_k w_k exp(-rho_k t).

    Terms below ``LEAST`` of G0 are left out, and one of rate zero is part of Ge. long_term: as in ``ending_at``. ValueError
    for a modulus that is not finite at t = 0.
    """
    values = [np.asarray(value, float) for value in (equilibrium, weights, rates)]
    Ge, w, rho = float(values[0]), np.atleast_1d(values[1]), np.atleast_1d(values[2])
    G0 = Ge + float(np.sum(w))
    checks.require(
        math.isfinite(G0) and G0 > 0.0,
        f"{name}: expected a finite modulus at t = 0 for a Prony table, got {G0:.3g} Pa: give it an instantaneous"
        " compliance, as jc.StandardLinearSolid has in place of jc.KelvinVoigt",
    )
    Ge += float(np.sum(w[rho <= 0.0]))
    keep = (rho > 0.0) & (w > LEAST * G0)
    order = np.argsort(-rho[keep])
    moduli, times = w[keep][order], 1.0 / rho[keep][order]
    words: tuple[str, ...] = ()
    if not Ge > LEAST * G0:
        Ge = 0.0
    if Ge == 0.0 and moduli.size:
        words = (
            f"a fluid: the modulus relaxes to zero with the longest time, {times[-1]:.6g} s (viscosity"
            f" {moduli @ times:.6g} Pa s)",
        )
    known = None if bulk_modulus is None else float(bulk_modulus)
    return ending_at(Table(Ge, moduli, times, None if known else float(nu), known, words), long_term)


def ending_at(found: Table, long_term: float) -> Table:
    """Return the table with a modulus at long times of at least ``long_term`` of that at t = 0, 0 to 0.5: the terms with the
    longest times lose what the spring gains."""
    checks.require(0.0 <= long_term <= 0.5, f"long_term: expected 0 to 0.5, got {long_term!r}")
    G0, Ge, moduli = found.instantaneous, found.equilibrium, found.moduli.copy()
    missing = float(long_term) * G0 - Ge
    if missing <= 0.0 or not moduli.size:
        return found
    for i in reversed(range(moduli.size)):
        taken = min(missing, float(moduli[i]) * (1.0 - 1e-3))
        moduli[i], missing, Ge = moduli[i] - taken, missing - taken, Ge + taken
    words = (
        f"long_term: the modulus ends at {Ge / G0:.6g} of that at t = 0, which changes G(t) by at most"
        f" {long_term * G0:.4g} Pa"
    )
    return found._replace(equilibrium=Ge, moduli=moduli, words=(*found.words, words))


def _about(found: Table, program: str, comment: str) -> list[str]:
    """Return the lines of comment that state the convention of a table."""
    if found.bulk_relaxes:
        volume = "Poisson's ratio is constant: the bulk modulus relaxes in proportion to the shear modulus"
    elif found.bulk_modulus is None:
        volume = "incompressible: use elements for incompressible materials"
    else:
        volume = f"the bulk modulus is elastic, {found.bulk_modulus:.6g} Pa; Poisson's ratio is that at t = 0"
    lines = [
        f"viscoelastic material for {program}, written by jaxcontact",
        "G(t) = Ge + sum_i G_i exp(-t/tau_i): shear relaxation modulus and relaxation times (not retardation times)",
        f"G(0) = {found.instantaneous:.9g} Pa, G(inf) = Ge = {found.equilibrium:.9g} Pa, {found.times.size} terms",
        volume, *found.words,
    ]  # fmt: skip
    return [f"{comment} {line}" for line in lines]


def _density(density: float | None) -> float | None:
    """Return the density as a number of Python, whose text has nothing else in it."""
    if density is None:
        return None
    checks.positive("density [kg/m3]", density)
    return float(density)


def _system(units: str) -> tuple[str, float, float, str, str]:
    checks.require(
        units in SYSTEMS, f"units: expected one of {', '.join(SYSTEMS)} (the unit of length), got {units!r}"
    )
    return SYSTEMS[units]


def abaqus(found: Table, name: str, units: str, density: float | None) -> str:
    """Return the keywords of Abaqus; ValueError for a name that would be read as something else there."""
    checks.require(
        isinstance(name, str) and re.fullmatch(r"[A-Za-z][A-Za-z0-9_. -]{0,79}", name) is not None,
        f"name: expected a letter and up to 79 letters, digits, spaces, _, . or -, got {name!r}",
    )
    system, stress, mass, pascal, rho = _system(units)
    density = _density(density)
    G0, nu = found.instantaneous, found.nu_at(found.instantaneous)
    E0 = 2.0 * (1.0 + nu) * G0 / stress
    lines = [
        *_about(found, "Abaqus", "**"),
        f"** units: {system}; time in s" + ("" if density is None else f"; density in {rho}"),
        f"** *ELASTIC: Young's modulus at t = 0 [{pascal}], Poisson's ratio at t = 0",
        f"*MATERIAL, NAME={name}",
    ]
    if density is not None:
        lines += ["*DENSITY", f"{density / mass!r},"]
    lines += ["*ELASTIC, MODULI=INSTANTANEOUS", f"{E0!r}, {nu!r}"]
    if found.times.size:
        lines += [
            "** *VISCOELASTIC: g_i = G_i/G(0), k_i = K_i/K(0), tau_i [s]; relaxation needs a *VISCO or dynamic step",
            "*VISCOELASTIC, TIME=PRONY",
        ]
        for G, tau in zip(found.moduli, found.times, strict=True):
            g = float(G / G0)
            lines.append(f"{g!r}, {g if found.bulk_relaxes else 0.0!r}, {float(tau)!r}")
    return "\n".join(lines) + "\n"


def ansys(found: Table, number: int, units: str, density: float | None) -> str:
    """Return the commands of ANSYS (APDL)."""
    checks.whole("number", number, 1, 999999)
    system, stress, mass, pascal, rho = _system(units)
    density = _density(density)
    G0, nu = found.instantaneous, found.nu_at(found.instantaneous)
    lines = [
        *_about(found, "ANSYS", "!"),
        f"! units: {system}; time in s" + ("" if density is None else f"; density in {rho}"),
        f"! EX, PRXY: Young's modulus [{pascal}] and Poisson's ratio at t = 0",
        f"MP,EX,{number},{2.0 * (1.0 + nu) * G0 / stress!r}",
        f"MP,PRXY,{number},{nu!r}",
    ]
    if density is not None:
        lines.append(f"MP,DENS,{number},{density / mass!r}")
    kinds = (("SHEAR", "G_i/G(0)"), *((("BULK", "K_i/K(0)"),) if found.bulk_relaxes else ()))
    for kind, ratio in kinds if found.times.size else ():
        lines += [
            f"! TBDATA: pairs of {ratio} and tau_i [s], three in a line",
            f"TB,PRONY,{number},1,{found.times.size},{kind}",
        ]
        pairs = [
            f"{float(G / G0)!r},{float(tau)!r}" for G, tau in zip(found.moduli, found.times, strict=True)
        ]
        lines += [f"TBDATA,{2 * i + 1},{','.join(pairs[i : i + 3])}" for i in range(0, len(pairs), 3)]
    return "\n".join(lines) + "\n"


def comsol(found: Table, density: float | None) -> str:
    """Return the table of branches of COMSOL's generalized Maxwell model, in SI, with the elastic part as comments."""
    density = _density(density)
    Ge, nu = found.equilibrium, found.nu_at(found.equilibrium)
    bulk: float = found.bulk_modulus or 0.0
    share = 0.0
    if found.bulk_relaxes:
        share = 2.0 * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu))
        bulk = share * Ge
    lines = [
        *_about(found, "COMSOL", "%"),
        "% units: SI (Pa, s)" + ("" if density is None else f"; density {density!r}[kg/m^3]"),
        "% Linear Elastic Material, specified by bulk and shear modulus, which are those of long times:",
        f"% G = {Ge!r}[Pa]",
        f"% K = {bulk!r}[Pa]"
        if nu != 0.5 or found.bulk_modulus
        else "% K = infinite: Nearly/fully incompressible",
    ]
    if not found.times.size:
        return "\n".join(lines) + "\n"
    if Ge == 0.0:
        lines.append(
            "% no stationary solution exists without a long-term modulus: use a time-dependent study, or long_term="
        )
    both = found.bulk_relaxes
    strains = "Volumetric and deviatoric" if both else "Deviatoric"
    lines += [
        f"% Viscoelasticity, Generalized Maxwell, viscoelastic strains: {strains}",
        "% branch   G_m [Pa]   tau_m [s]" + ("   K_m [Pa]" if both else ""),
    ]
    for m, (G, tau) in enumerate(zip(found.moduli, found.times, strict=True), 1):
        lines.append(f"{m} {float(G)!r} {float(tau)!r}" + (f" {float(share * G)!r}" if both else ""))
    return "\n".join(lines) + "\n"


def of_law(
    found: Table,
    name: str,
    exact: Any,
    solid: bool,
    shortest: float,
    longest: float,
    tolerance: float,
    long_term: float,
) -> Table:
    """Return the table of a series that approximates a law between two times [s], with the error in words.

    exact: function of t [s] that returns G(t) [Pa] of the law; solid: whether it tends to a modulus > 0, so that a flow far
    beyond the longest time is taken as that modulus; long_term: as in ``ending_at``, of the table of the law and so after
    this.
    """
    found = found._replace(words=())  # the series is a fluid, the law may be none
    flow = float(found.times[-1])
    if found.equilibrium == 0.0 and solid and flow > FAR * longest:
        found = found._replace(
            equilibrium=float(found.moduli[-1]), moduli=found.moduli[:-1], times=found.times[:-1]
        )
    found = ending_at(found, long_term)
    G0, words = found.instantaneous, found.words
    if found.equilibrium == 0.0:
        words = *words, f"beyond {longest:g} s the table flows (with a time of {flow:.6g} s)"
    t = np.geomspace(shortest, longest, PROBES)
    error = float(np.max(np.abs(found.relaxation(t) / np.asarray(exact(t)) - 1.0)))
    return found._replace(words=(
        f"{name} from {shortest:g} to {longest:g} s: G(t) of this table is within {error:.2g} of the law there (creep within"
        f" {tolerance:g}); below {shortest:g} s it tends to {G0:.6g} Pa", *words,
    ))  # fmt: skip
