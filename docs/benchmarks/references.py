"""Write problems.json: the benchmark problems with their inputs and reference values.

    python docs/benchmarks/references.py

Reference values are closed forms, solutions by another method, or numbers printed in a publication; none comes from the
solver that the benchmarks test. Lengths are in m, loads in N, stresses in Pa, times in s.
"""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from jaxcontact.reference import (
    abel,
    cattaneo_mindlin,
    hertz,
    hunter,
    layered_solid,
    lee_radok,
    maugis,
    ting,
)
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar
from scipy.special import ive, jv, kve

FILE = Path(__file__).with_name("problems.json")
CONTACT_MECHANICS = "K. L. Johnson, Contact Mechanics, Cambridge University Press (1985)"


def problem(
    title: str,
    source: str,
    method: str,
    inputs: dict,
    references: dict[str, tuple[float, str, float]],
) -> dict[str, Any]:
    """Return a problem as it is written; references: by name the value, its unit and the relative tolerance."""
    values = {
        name: {"value": float(value), "unit": unit, "tolerance": tolerance}
        for name, (value, unit, tolerance) in references.items()
    }
    return {
        "title": title,
        "source": source,
        "method": method,
        "inputs": inputs,
        "references": values,
    }


def hertz_ball() -> dict:
    inputs = {"shear_modulus": 1e9, "poisson": 0.3, "radius": 10e-3, "load": 10.0}
    load, radius, compliance = 10.0, 10e-3, 0.7 / 1e9
    return problem(
        "Hertz: a rigid ball on an elastic half-space", f"{CONTACT_MECHANICS}, section 4.2", "closed form", inputs,
        {
            "approach": (hertz.approach(load, radius, compliance), "m", 1e-3),
            "contact_radius": (hertz.contact_radius(load, radius, compliance), "m", 1e-2),
            "peak_pressure": (hertz.peak_pressure(load, radius, compliance), "Pa", 2e-3),
        },
    )  # fmt: skip


def line_contact() -> dict:
    G, nu, radius, half = 1e9, 0.3, 10e-3, 1e-4
    per_length = np.pi * half**2 * G / (2.0 * radius * (1.0 - nu))
    inputs = {
        "shear_modulus": G,
        "poisson": nu,
        "radius": radius,
        "load_per_length": per_length,
    }
    return problem(
        "Line contact of a rigid cylinder in plane strain", f"{CONTACT_MECHANICS}, section 4.2", "closed form", inputs,
        {
            "half_width": (half, "m", 5e-3),
            "peak_pressure": (2.0 * per_length / (np.pi * half), "Pa", 2e-3),
        },
    )  # fmt: skip


def westergaard() -> dict:
    G, nu, length, amplitude = 1e9, 0.3, 1e-3, 1e-6
    full = 2.0 * np.pi / length * amplitude * G / (1.0 - nu)
    share = 0.15
    inputs = {
        "shear_modulus": G, "poisson": nu, "wavelength": length, "amplitude": amplitude, "mean_pressure": share * full,
    }  # fmt: skip
    return problem(
        "Westergaard: a rigid wave on a half-space in partial contact", "H. M. Westergaard, J. Appl. Mech. 6 (1939) A49",
        "closed form", inputs,
        {
            "peak_pressure": (2.0 * share * full / np.sqrt(share), "Pa", 2e-3),
            "contact_width": (2.0 * length / np.pi * np.arcsin(np.sqrt(share)), "m", 2e-2),
        },
    )  # fmt: skip


def layers(ratio: float) -> dict:
    G, nu, radius, a = 80e9, 0.3, 10e-3, 150e-6
    body = abel.Layered(ratio * G, nu, a, G, nu)
    contact = abel.solve_radius(a, body, radius)
    inputs = {
        "layer_shear_modulus": ratio * G, "layer_poisson": nu, "thickness": a, "substrate_shear_modulus": G,
        "substrate_poisson": nu, "radius": radius, "load": float(contact.load),
    }  # fmt: skip
    kind = "compliant" if ratio < 1.0 else "stiff"
    return problem(
        f"A rigid ball on a {kind} elastic layer as thick as the contact radius",
        "Configuration of M. R. O'Sullivan, R. B. King, J. Tribol. 110 (1988) 235",
        "Abel transform and Legendre-Galerkin solution of the axisymmetric contact", inputs,
        {
            "approach": (contact.approach, "m", 1e-3),
            "contact_radius": (a, "m", 1e-2),
            "peak_pressure": (np.squeeze(abel.pressure(0.0, contact)), "Pa", 5e-3),
        },
    )  # fmt: skip


def pavement() -> dict:
    young, poisson, thick = (
        np.array([3000e6, 200e6, 40e6]),
        np.array([0.3, 0.35, 0.4]),
        np.array([0.15, 0.6]),
    )
    shear = young / (2.0 * (1.0 + poisson))
    radius, pressure = 0.15, 1.1e6
    lift = lambda k: float(
        layered_solid.surface_response(shear, poisson, thick, k, 0.0)[2, 2].real
    )
    ends = np.concatenate([[1e-9], np.geomspace(1e-3, 3000.0, 120)])
    parts = [
        quad(lambda k: lift(k) * jv(1, k * radius), *pair, limit=200)[0]
        for pair in pairwise(ends)
    ]
    inputs = {
        "youngs_moduli": young.tolist(), "poissons": poisson.tolist(), "thicknesses": thick.tolist(),
        "load_radius": radius, "pressure": pressure,
    }  # fmt: skip
    return problem(
        "A pavement of three layers under a uniform round load: displacement at the centre",
        "Type of A. Jones, Highway Research Board Bulletin 342 (1962) 176",
        "Hankel integral of a solution of the boundary-value problem for each wavenumber", inputs,
        {"displacement": (pressure * radius * sum(parts), "m", 1e-3)},
    )  # fmt: skip


def lee_and_radok() -> dict:
    G, nu, load, radius = 1e9, 0.3, 100.0, 3.5e-3
    inputs = {
        "shear_modulus": G,
        "viscosity": G,
        "poisson": nu,
        "radius": radius,
        "load": load,
        "time": 2.0,
    }
    creep = lambda t: (1.0 + np.asarray(t)) / G
    return problem(
        "Lee and Radok: creep of a Maxwell half-space under a ball with a constant load",
        "E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438", "closed form", inputs,
        {
            "contact_radius": (lee_radok.step_radius(2.0, creep, load, radius, nu), "m", 5e-3),
            "approach": (lee_radok.step_approach(2.0, creep, load, radius, nu), "m", 2e-3),
        },
    )  # fmt: skip


def ting_unloading() -> dict:
    G, nu, radius, rate = 1e9, 0.3, 3.5e-3, 4e-6
    relaxation = lambda t: G * np.exp(-np.asarray(t))
    depth = lambda t: rate * np.minimum(t, 2.0 - t)
    speed = lambda t: rate * np.where(np.asarray(t) < 1.0, 1.0, -1.0)
    load = lambda t: float(
        np.squeeze(ting.load(t, relaxation, depth, speed, 1.0, radius, nu))
    )
    inputs = {
        "shear_modulus": G, "viscosity": G, "poisson": nu, "radius": radius, "rate": rate, "time_of_reversal": 1.0,
    }  # fmt: skip
    return problem(
        "Ting: a ball pressed into a Maxwell half-space and withdrawn at the same rate",
        "T. C. T. Ting, J. Appl. Mech. 33 (1966) 845", "closed form, with quadratures", inputs,
        {
            "load_at_reversal": (load(1.0), "N", 5e-3),
            "load_at_1.2_s": (load(1.2), "N", 1e-2),
        },
    )  # fmt: skip


def creeping_layer() -> dict:
    film = {"G1": 0.75e9, "G2": 13.89e6, "eta1": 3.1486e12, "eta2": 120.9e9, "nu": 0.3}
    steel, thickness, load, radius = 210e9 / 2.6, 50e-6, 0.2, 9.525e-3
    modulus = lambda s: (
        1.0
        / (
            1.0 / film["G1"]
            + 1.0 / (film["eta1"] * s)
            + 1.0 / (film["G2"] + film["eta2"] * s)
        )
    )
    body = abel.Layered(film["G1"], film["nu"], thickness, steel, 0.3)
    last = abel.march_step_load(load, 600.0, 40, body, modulus, radius)[
        -1
    ]  # accurate to 6e-5
    inputs = {
        **{f"layer_{name}": value for name, value in film.items()}, "thickness": thickness, "substrate_shear_modulus": steel,
        "substrate_poisson": 0.3, "radius": radius, "load": load, "time": 600.0,
    }  # fmt: skip
    return problem(
        "A ball on a layer of a Burgers material: contact after ten minutes",
        "Model of L. Wang et al., Tribology Letters 2025, doi 10.1007/s11249-025-01990-5, for a thicker layer",
        "march in Abel densities of the axisymmetric contact", inputs,
        {"contact_radius": (last.radius, "m", 1e-2), "approach": (last.approach, "m", 1e-3)},
    )  # fmt: skip


def tribofilm() -> dict:
    steel, load = 210e9 / 2.6, 60.0
    body = abel.Layered(0.75e9, 0.3, 150e-9, steel, 0.3, 0.7 / steel)
    contact = abel.solve_load(load, body, 9.525e-3)
    inputs = {
        "film_shear_modulus": 0.75e9, "film_poisson": 0.3, "thickness": 150e-9, "substrate_shear_modulus": steel,
        "substrate_poisson": 0.3, "ball_shear_modulus": steel, "ball_poisson": 0.3, "radius": 9.525e-3, "load": load,
    }  # fmt: skip
    return problem(
        "A steel ball on a tribofilm of 150 nm on steel, at the first instant",
        "L. Wang et al., Tribology Letters 2025, doi 10.1007/s11249-025-01990-5, Tables 4 and 5",
        "Abel transform and Legendre-Galerkin solution of the axisymmetric contact", inputs,
        {
            "approach": (contact.approach, "m", 1e-3),
            "contact_radius": (contact.radius, "m", 1e-2),
            "peak_pressure": (np.squeeze(abel.pressure(0.0, contact)), "Pa", 3e-3),
        },
    )  # fmt: skip


def sliding_line() -> dict:
    J0, J1, tau, nu, radius, half, speed = 1.0, 4.0, 1.0, 0.3, 1.0, 0.1, 0.1
    exact = hunter.of_half_width(half, speed, radius, J0, J1, tau, nu)
    inputs = {
        "instantaneous_compliance": J0, "delayed_compliance": J1, "retardation_time": tau, "poisson": nu,
        "radius": radius, "speed": speed, "load_per_length": exact.load,
    }  # fmt: skip
    return problem(
        "Hunter: a cylinder that slides steadily over a standard linear solid", "S. C. Hunter, J. Appl. Mech. 28 (1961) 611",
        "closed form", inputs,
        {"friction_coefficient": (exact.friction, "1", 2e-3), "contact_width": (2.0 * half, "m", 1e-2)},
    )  # fmt: skip


def partial_slip() -> dict:
    G, radius, load, mu, share = 1e9, 10e-3, 10.0, 0.3, 0.6
    a = float(hertz.contact_radius(load, radius, 1.0 / G))
    inputs = {
        "shear_modulus": G, "poisson": 0.0, "radius": radius, "load": load, "friction": mu,
        "tangential_load": share * mu * load,
    }  # fmt: skip
    return problem(
        "Cattaneo and Mindlin: partial slip of a ball, and one cycle of its load",
        "R. D. Mindlin, J. Appl. Mech. 16 (1949) 259; R. D. Mindlin, H. Deresiewicz, J. Appl. Mech. 20 (1953) 327",
        "closed form, exact for Poisson's ratio 0", inputs,
        {
            "tangential_displacement": (cattaneo_mindlin.displacement(a, mu * load, share, 2.0 / G), "m", 2e-3),
            "stick_radius": (cattaneo_mindlin.stick_radius(a, share), "m", 2e-2),
            "energy_of_a_cycle": (cattaneo_mindlin.loop_energy(a, mu * load, share, 2.0 / G), "J", 1e-2),
        },
    )  # fmt: skip


def compression_with_friction() -> dict:
    inputs = {
        "shear_modulus": 0.5e6, "poisson": 0.0, "radius": 1e-3 / (2 * 0.004116), "friction": 0.2986,
        "load": float((35 / 45) ** 3), "steps": 35, "cell": 0.2e-3,
    }  # fmt: skip
    return problem(
        "Spence: compression with friction, in 35 increments with the load as the third power of the step",
        "D. A. Spence, J. Elast. 5 (1975) 297; example spence35 of CONTACT, release 2707 (Vtech CMCC)",
        "printed by CONTACT on the same grid of 45 x 45 cells", inputs,
        {
            "sticking_cells": (225, "1", 1e-9),
            "approach": (0.09874e-3, "m", 1e-4),
            "peak_pressure": (0.02392e6, "Pa", 3e-4),
        },
    )  # fmt: skip


ROLLER = {"shear_modulus": 80e9, "poisson": 0.3, "radius": 10e-3, "friction": 0.3}


def carter() -> dict:
    half, share = 1e-4, 0.3
    compliance = 2.0 * (1.0 - 0.3) / 80e9
    per_length = np.pi * half**2 / (2.0 * 10e-3 * compliance)
    inputs = ROLLER | {
        "load_per_length": per_length,
        "creepage": share * 0.3 * half / 10e-3,
    }
    return problem(
        "Carter: force of a cylinder that rolls over its like with creepage", "F. W. Carter, Proc. R. Soc. A 112 (1926) 151",
        "closed form", inputs, {"force_over_limit": (1.0 - (1.0 - share) ** 2, "1", 5e-3)},
    )  # fmt: skip


def free_rolling() -> dict:
    G, nu, half, radius = 1e9, 0.2, 1e-4, 10e-3
    beta = (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))
    per_length = np.pi * half**2 / (2.0 * radius) * G / (1.0 - nu)
    eta = np.log((1.0 + beta) / (1.0 - beta)) / (2.0 * np.pi)
    angle = brentq(lambda t: t + np.sin(t) * np.cos(t) - np.pi / 4.0, 0.0, 1.0)
    inputs = {
        "shear_modulus": G, "poisson": nu, "radius": radius, "load_per_length": per_length, "high_friction": 3.0,
        "low_friction": 0.01,
    }  # fmt: skip
    return problem(
        "Bentall and Johnson: free rolling of a rigid cylinder on an elastic half-space",
        "R. H. Bentall, K. L. Johnson, Int. J. Mech. Sci. 9 (1967) 389", "closed form in both limits of friction", inputs,
        {
            "creepage_at_high_friction": (2.0 * eta * half / radius / np.sqrt(1.0 + 4.0 * eta**2), "1", 2e-2),
            "creepage_at_low_friction": (beta * np.cos(angle) * half / radius, "1", 2e-2),
        },
    )  # fmt: skip


def viscoelastic_rolling() -> dict:
    J0, J1, tau, radius, half, speed, creepage = 1e-6, 4e-6, 1.0, 10e-3, 1e-3, 1e-3, 1e-3
    contact = hunter.of_half_width(half, speed, radius, J0, J1, tau, 0.5)
    zeta, z = contact.zeta, half / (tau * speed)
    c1 = creepage / (0.5 * (J0 + J1))
    rows = [
        [ive(0, zeta), -zeta * (ive(0, zeta) + ive(1, zeta))],
        [kve(0, z), z * (kve(1, z) - kve(0, z))],
    ]
    c0, _ = np.linalg.solve(rows, [-c1 * ive(1, zeta), c1 * kve(1, z)])
    inputs = {
        "instantaneous_compliance": J0, "delayed_compliance": J1, "retardation_time": tau, "poisson": 0.5,
        "radius": radius, "speed": speed, "creepage": creepage, "load_per_length": contact.load, "friction": 20.0,
    }  # fmt: skip
    return problem(
        "Tractive rolling without slip on an incompressible standard linear solid",
        "Method of S. C. Hunter, J. Appl. Mech. 28 (1961) 611; problem of G. Wang, K. Knothe, Acta Mech. 79 (1989) 37",
        "closed form in Bessel functions", inputs,
        {
            "force_per_length": (np.pi * half * c0, "N/m", 2e-2),
            "rolling_resistance_per_length": (contact.friction * contact.load, "N/m", 2e-2),
        },
    )  # fmt: skip


def kalker() -> dict:
    inputs = {"shear_modulus": 80e9, "poisson": 0.25, "radius": 10e-3, "load": 10.0}
    return problem(
        "Kalker: creepage coefficients of a ball that rolls over its like without slip",
        "J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, Kluwer (1990), Table E3",
        "printed there", inputs,
        {"C11": (4.12, "1", 2e-2), "C22": (3.67, "1", 2e-2)},
    )  # fmt: skip


def jkr() -> dict:
    inputs = {
        "shear_modulus": 1e6,
        "poisson": 0.5,
        "radius": 5e-6,
        "work_of_adhesion": 50e-3,
    }
    return problem(
        "Johnson, Kendall and Roberts: pull-off load of a rigid ball",
        "K. L. Johnson, K. Kendall, A. D. Roberts, Proc. R. Soc. A 324 (1971) 301",
        "closed form, in the limit of a short range of adhesion (here a Tabor number of 5)", inputs,
        {"pull_off_load": (-1.5 * np.pi * 50e-3 * 5e-6, "N", 2e-2)},
    )  # fmt: skip


def maugis_dugdale() -> dict:
    G, nu, radius, work = 1e6, 0.5, 5e-6, 50e-3
    units = maugis.units(work, radius, 2.0 * G / (1.0 - nu))
    of = lambda a: maugis.maugis(1.0, a)
    lowest = minimize_scalar(
        lambda a: float(of(a)[0]), bounds=(0.05, 1.6), method="bounded"
    )
    pressed = brentq(lambda a: float(of(a)[1]) - 0.8, 0.9, 2.5)
    inputs = {
        "shear_modulus": G, "poisson": nu, "radius": radius, "work_of_adhesion": work,
        "cohesive_stress": maugis.strength(1.0, work, radius, 2.0 * G / (1.0 - nu)),
        "approach": 0.8 * units.approach, "approach_at_pull_off": float(of(lowest.x)[1]) * units.approach,
    }  # fmt: skip
    return problem(
        "Maugis: a ball with a cohesive zone of constant stress, lambda = 1",
        "D. Maugis, J. Colloid Interface Sci. 150 (1992) 243",
        "closed form", inputs,
        {
            "pull_off_load": (lowest.fun * units.load, "N", 1e-2),
            "load_at_the_approach": (float(of(pressed)[0]) * units.load, "N", 1e-2),
        },
    )  # fmt: skip


def archard() -> dict:
    inputs = {
        "film_shear_modulus": 20e9, "film_poisson": 0.3, "thickness": 1e-6, "substrate_shear_modulus": 80e9,
        "substrate_poisson": 0.3, "radius": 5e-3, "length": 1e-3, "load": 50.0, "speed": 0.1, "time": 100.0,
        "wear_coefficient": 2e-18,
    }  # fmt: skip
    return problem(
        "Archard: volume worn from a film under a cylinder in plane strain", "J. F. Archard, J. Appl. Phys. 24 (1953) 981",
        "closed form: coefficient times load times path", inputs,
        {"worn_volume": (2e-18 * 50.0 * 0.1 * 100.0, "m3", 1e-4)},
    )  # fmt: skip


def thin_sample() -> dict:
    G, nu, thickness, radius, a = 1e3, 0.5, 20e-6, 10e-6, 8e-6
    body = abel.Layered(G, nu, thickness, 1e8 * G, 0.3)
    contact = abel.solve_radius(a, body, radius)
    inputs = {
        "shear_modulus": G, "poisson": nu, "thickness": thickness, "radius": radius, "approach": float(contact.approach),
    }  # fmt: skip
    return problem(
        "Indentation of a thin incompressible gel that is bonded to a rigid dish by a bead",
        "Problem of E. K. Dimitriadis et al., Biophys. J. 82 (2002) 2798",
        "Abel transform and Legendre-Galerkin solution of the axisymmetric contact", inputs,
        {"load": (contact.load, "N", 3e-3), "contact_radius": (a, "m", 1e-2)},
    )  # fmt: skip


def flash_temperature() -> dict:
    conductivity, diffusivity, half, speed, power = 50.0, 1.4e-5, 1e-4, 0.56, 10.0

    def along_ray(
        angle: float,
    ) -> float:  # a point source at r makes exp(-v (r + x)/(2 kappa))/(2 pi k r)
        reach = half / max(abs(np.cos(angle)), abs(np.sin(angle)))
        decay = speed * (1.0 + np.cos(angle)) / (2.0 * diffusivity)
        return -np.expm1(-decay * reach) / decay if decay * reach > 1e-12 else reach

    ends = np.concatenate(
        [
            np.linspace(0.0, 0.9 * np.pi, 19),
            np.pi - 0.1 * np.pi * 0.5 ** np.arange(1, 30),
            [np.pi],
        ]
    )
    ends = np.unique([*ends, np.pi / 4, 3 * np.pi / 4])
    angles = 2.0 * sum(quad(along_ray, *pair)[0] for pair in pairwise(ends))
    centre = power / (2.0 * half) ** 2 * angles / (2.0 * np.pi * conductivity)
    inputs = {
        "conductivity": conductivity, "diffusivity": diffusivity, "half_width": half, "speed": speed, "power": power,
    }  # fmt: skip
    return problem(
        "Jaeger: temperature at the centre of a square heat source that moves over a half-space",
        "J. C. Jaeger, Proc. R. Soc. New South Wales 76 (1942) 203", "quadrature of Jaeger's integral", inputs,
        {"temperature_rise": (centre, "K", 5e-3)},
    )  # fmt: skip


PROBLEMS = {
    "hertz": hertz_ball,
    "line-contact": line_contact,
    "westergaard": westergaard,
    "compliant-layer": lambda: layers(0.1),
    "stiff-layer": lambda: layers(4.0),
    "pavement": pavement,
    "thin-sample": thin_sample,
    "tribofilm": tribofilm,
    "lee-radok": lee_and_radok,
    "ting": ting_unloading,
    "creeping-layer": creeping_layer,
    "hunter": sliding_line,
    "cattaneo-mindlin": partial_slip,
    "spence": compression_with_friction,
    "carter": carter,
    "bentall-johnson": free_rolling,
    "viscoelastic-rolling": viscoelastic_rolling,
    "kalker": kalker,
    "jkr": jkr,
    "maugis": maugis_dugdale,
    "archard": archard,
    "jaeger": flash_temperature,
}


def main() -> None:
    FILE.write_text(
        json.dumps({name: make() for name, make in PROBLEMS.items()}, indent=1) + "\n",
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
