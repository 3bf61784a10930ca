"""Reference values of the problems in which a body is pressed, with and without adhesion."""

from itertools import pairwise

import numpy as np
from jaxcontact.reference import (
    abel,
    hertz,
    layered_solid,
    lee_radok,
    maugis,
    ting,
)
from reference_form import CONTACT_MECHANICS, problem
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar
from scipy.special import jv


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
        "Model of D. Wang et al., Tribology Letters 2025, doi 10.1007/s11249-025-01990-5, for a thicker layer",
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
        "D. Wang et al., Tribology Letters 2025, doi 10.1007/s11249-025-01990-5, Tables 4 and 5",
        "Abel transform and Legendre-Galerkin solution of the axisymmetric contact", inputs,
        {
            "approach": (contact.approach, "m", 1e-3),
            "contact_radius": (contact.radius, "m", 1e-2),
            "peak_pressure": (np.squeeze(abel.pressure(0.0, contact)), "Pa", 3e-3),
        },
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
