"""Reference values of the problems with sliding, friction, rolling, wear and frictional heat."""

from itertools import pairwise

import numpy as np
from jaxcontact.reference import (
    cattaneo_mindlin,
    hertz,
    hunter,
)
from reference_form import problem
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ive, kve


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
