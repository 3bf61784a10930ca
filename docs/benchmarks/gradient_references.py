"""Write gradients.json: five problems of design and identification with their values and derivatives.

    python docs/benchmarks/gradient_references.py

Values are closed forms or solutions by another method, none by the solver that the benchmarks test. A derivative is that
by the logarithm of a parameter, p df/dp, in the unit of the value, and is computed by central differences of those
values at two steps, which are extrapolated to a step of zero. Lengths are in m, loads in N, stresses in Pa, times in s.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from jaxcontact.reference import abel, hertz, hunter, lee_radok
from reference_form import problem
from scipy.optimize import brentq

FILE = Path(__file__).with_name("gradients.json")
STEP = 1e-3  # of a logarithm
AGREEMENT = 1e-4  # between the derivatives at one step and at two
BOLTZMANN = 1.380649e-23
NODES, WEIGHTS = np.polynomial.legendre.leggauss(80)
UNIT_NODES, UNIT_WEIGHTS = (NODES + 1.0) / 2.0, WEIGHTS / 2.0  # on (0, 1)


def derivative(f: Callable[[float], float]) -> float:
    """Return f'(0) from central differences at two steps; RuntimeError if they do not agree."""
    near, far = ((f(h) - f(-h)) / (2.0 * h) for h in (STEP, 2.0 * STEP))
    if abs(far - near) > AGREEMENT * abs(near):
        raise RuntimeError(f"central differences at two steps: {near:g} and {far:g}")
    return (4.0 * near - far) / 3.0  # Richardson's extrapolation


def by_logarithms(
    f: Callable[[dict], float], inputs: dict, names: tuple[str, ...]
) -> dict[str, float]:
    """Return the derivatives of f(inputs) by the logarithms of some of the inputs."""
    scaled = lambda name, log: {**inputs, name: inputs[name] * np.exp(log)}
    return {
        f"by_{name}": derivative(lambda log, name=name: f(scaled(name, log)))
        for name in names
    }


def differentiated(
    texts: tuple[str, str, str],
    inputs: dict,
    quantity: tuple[str, str],
    value: float,
    derivatives: dict[str, float],
    tolerances: tuple[float, float],
) -> dict[str, Any]:
    """Return a problem as it is written. quantity: its name and unit; tolerances: of the value and of the derivatives."""
    name, unit = quantity
    references = {name: (value, unit, tolerances[0])}
    references |= {by: (slope, unit, tolerances[1]) for by, slope in derivatives.items()}
    return problem(*texts, inputs, references)


def film_thickness() -> dict:
    inputs = {
        "film_shear_modulus": 1e9, "film_poisson": 0.4, "thickness": 40e-6, "substrate_shear_modulus": 80e9,
        "substrate_poisson": 0.3, "radius": 5e-3, "load": 2.0, "measured_radius": 100e-6,
    }  # fmt: skip

    def misfit(given: dict) -> float:
        body = abel.Layered(
            given["film_shear_modulus"], given["film_poisson"], given["thickness"],
            given["substrate_shear_modulus"], given["substrate_poisson"],
        )  # fmt: skip
        contact = abel.solve_load(given["load"], body, given["radius"])
        a, b = contact.radius, given["measured_radius"]
        measured = lambda r: (
            1.5
            * given["load"]
            / (np.pi * b**2)
            * np.sqrt(np.maximum(1.0 - (r / b) ** 2, 0.0))
        )

        def over_disk(f: Callable[[np.ndarray], np.ndarray], edge: float) -> float:
            """Return int_0^edge f(r) r dr; with r = edge sqrt(1 - u^2) a root at the edge is smooth in u."""
            r = edge * np.sqrt(1.0 - UNIT_NODES**2)
            return edge**2 * float(np.sum(UNIT_WEIGHTS * UNIT_NODES * f(r)))

        squares = over_disk(lambda r: abel.pressure(r, contact) ** 2, a)
        product = over_disk(lambda r: abel.pressure(r, contact) * measured(r), min(a, b))
        norm = over_disk(lambda r: measured(r) ** 2, b)
        return (squares - 2.0 * product + norm) / norm

    names = ("thickness", "film_shear_modulus")
    return differentiated(
        (
            "Thickness and modulus of an elastic film from a map of the pressure under a rigid ball",
            "Configuration of M. R. O'Sullivan, R. B. King, J. Tribol. 110 (1988) 235; the measured pressure is that of"
            " Hertz for the load and measured_radius, and the misfit int (p - p_m)^2 dA / int p_m^2 dA",
            "Abel transform and Legendre-Galerkin solution of the axisymmetric contact; central differences",
        ),
        inputs, ("misfit", "1"), misfit(inputs), by_logarithms(misfit, inputs, names), (1e-2, 1e-2),
    )  # fmt: skip


def burgers_parameters() -> dict:
    times = [0.0, 1.0, 3.0, 10.0, 30.0, 60.0, 120.0, 200.0, 300.0, 450.0, 600.0]
    true = {"G1": 1e9, "G2": 0.5e9, "eta1": 400e9, "eta2": 30e9}
    inputs = {"poisson": 0.4, "radius": 5e-3, "load": 1.0, "times": times}

    def approach(given: dict) -> np.ndarray:
        t = np.asarray(times)
        tau = given["eta2"] / given["G2"]
        creep = lambda t: (
            1.0 / given["G1"] + t / given["eta1"] + (1.0 - np.exp(-t / tau)) / given["G2"]
        )
        return np.asarray(
            lee_radok.step_approach(
                t, creep, inputs["load"], inputs["radius"], inputs["poisson"]
            )
        )

    inputs["measured_approach"] = approach(true).tolist()
    misfit = lambda given: float(
        np.mean(np.log(approach(given) / inputs["measured_approach"]) ** 2)
    )
    inputs |= {"G1": 1.5e9, "G2": 0.4e9, "eta1": 250e9, "eta2": 60e9}
    return differentiated(
        (
            "Four parameters of a Burgers half-space from the approach of a ball over time",
            "E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438; the misfit is the mean over the times of"
            " ln(approach/measured_approach)^2",
            "closed form; central differences",
        ),
        inputs, ("misfit", "1"), misfit(inputs), by_logarithms(misfit, inputs, tuple(true)), (1e-2, 4e-2),
    )  # fmt: skip


def surface_heights() -> dict:
    G, nu, length, amplitude, share = 1e9, 0.3, 1e-3, 1e-6, 0.15
    full = 2.0 * np.pi / length * amplitude * G / (1.0 - nu)
    inputs = {
        "shear_modulus": G, "poisson": nu, "wavelength": length, "amplitude": amplitude, "mean_pressure": share * full,
    }  # fmt: skip

    def mean_gap(first: float, second: float) -> float:
        """Return the mean gap for heights of amplitude (first cos t + second cos 2 t).

        With t = 2 pi x/wavelength, contact at |t| < t_e, C = cos t_e and p* = full,

            p = sqrt((1 + cos t) (cos t - C)) (b0 + b1 cos t),   b1 = 4 p* second,   b0 = p* (first - 2 (1 - C) second),

        is the real part on the unit circle of a function that is analytic inside it, whose imaginary part in the contact
        is proportional to the slope of the heights. Its value at the centre is the mean of the pressure. Without the
        second wave it is Westergaard's solution. The mean gap is the height at t = 0 less the displacement there, whose
        mean is zero, u = -amplitude/(pi p*) int p ln(2 sin(|t|/2)) dt.
        """

        def factors(C: float) -> tuple[float, float]:
            return full * (first - 2.0 * (1.0 - C) * second), 4.0 * full * second

        def mean(C: float) -> float:
            b0, b1 = factors(C)
            return 0.5 * ((1.0 - C) * b0 + (1.0 + (1.0 - C**2) / 2.0 - C) * b1 / 2.0)

        C = brentq(lambda C: mean(C) - share * full, -0.5, 1.0 - 1e-9, xtol=1e-15)
        b0, b1 = factors(C)
        # substituted so that the integrand is smooth at the logarithm and at the root
        t = np.arccos(C) * UNIT_NODES**3 * (4.0 - 3.0 * UNIT_NODES)
        dt = np.arccos(C) * 12.0 * UNIT_NODES**2 * (1.0 - UNIT_NODES) * UNIT_WEIGHTS
        pressure = np.sqrt((1.0 + np.cos(t)) * (np.cos(t) - C)) * (b0 + b1 * np.cos(t))
        lifted = (
            2.0 / (np.pi * full) * np.sum(pressure * np.log(2.0 * np.sin(t / 2.0)) * dt)
        )
        return float(amplitude * (first + second + lifted))

    slopes = {
        "along_the_wave": derivative(lambda e: mean_gap(1.0 + e, 0.0)),
        "along_half_its_length": derivative(lambda e: mean_gap(1.0, e)),
    }
    return differentiated(
        (
            "Heights of a wavy surface in partial contact: its mean gap",
            "H. M. Westergaard, J. Appl. Mech. 6 (1939) A49. All heights are parameters; given are the derivatives by e of"
            " heights amplitude (cos t + e d), t = 2 pi x/wavelength, along the wave with d = cos t, and along half its"
            " length with d = cos 2 t",
            "closed form; central differences",
        ),
        inputs, ("mean_gap", "m"), mean_gap(1.0, 0.0), slopes, (1e-2, 4e-2),
    )  # fmt: skip


def sliding_friction() -> dict:
    J0, J1, tau, nu, radius, speed = 1.0, 4.0, 1.0, 0.3, 1.0, 0.1
    load = hunter.of_half_width(0.1, speed, radius, J0, J1, tau, nu).load
    inputs = {
        "instantaneous_compliance": J0, "delayed_compliance": J1, "retardation_time": tau, "poisson": nu,
        "radius": radius, "speed": speed, "load_per_length": load,
    }  # fmt: skip
    friction = lambda given: hunter.of_load(
        given["load_per_length"], given["speed"], given["radius"], given["instantaneous_compliance"],
        given["delayed_compliance"], given["retardation_time"], given["poisson"],
    ).friction  # fmt: skip
    names = (
        "instantaneous_compliance",
        "delayed_compliance",
        "radius",
        "speed",
        "load_per_length",
    )
    return differentiated(
        (
            "Friction of a cylinder that slides steadily over a standard linear solid",
            "S. C. Hunter, J. Appl. Mech. 28 (1961) 611",
            "closed form; central differences",
        ),
        inputs, ("friction_coefficient", "1"), friction(inputs), by_logarithms(friction, inputs, names), (2e-3, 2e-2),
    )  # fmt: skip


def growth_kinetics() -> dict:
    inputs = {
        "shear_modulus": 1e9, "poisson": 0.3, "radius": 5e-3, "load": 2.0, "thickness": 0.1e-9, "speed": 0.1,
        "time": 100.0, "temperature": 373.0, "growth_rate": 1e-7, "activation_energy": 6.5e-20,
        "activation_volume": 4e-28, "removal_rate": 5e-3,
    }  # fmt: skip
    compliance = (1.0 - inputs["poisson"]) / inputs["shear_modulus"]
    a = float(hertz.contact_radius(inputs["load"], inputs["radius"], compliance))
    peak = float(hertz.peak_pressure(inputs["load"], inputs["radius"], compliance))

    def grown(given: dict) -> float:
        """Return int (h - h0) dA: film and substrate are of one material, so that the pressure remains that of Hertz,
        and what grows is a thousandth of the approach, whose relief changes the pressure little.

        With c the removal rate, h(t) = r(p)/c (1 - exp(-c t)) + h0 exp(-c t), and with b = peak pressure times
        activation volume over k T, int exp(b sqrt(1 - (r/a)^2)) dA = 2 pi a^2 ((b - 1) exp(b) + 1)/b^2.
        """
        thermal, removal = BOLTZMANN * given["temperature"], given["removal_rate"]
        b = given["activation_volume"] * peak / thermal
        over_area = 2.0 * np.pi * a**2 * ((b - 1.0) * np.exp(b) + 1.0) / b**2
        rate = (
            given["growth_rate"]
            * np.exp(-given["activation_energy"] / thermal)
            * over_area
        )
        duration = -np.expm1(-removal * given["time"]) / removal
        return float(duration * (rate - removal * given["thickness"] * np.pi * a**2))

    names = ("growth_rate", "activation_energy", "activation_volume", "removal_rate")
    return differentiated(
        (
            "Kinetics of a film that grows by stress-activated growth and proportional removal under a ball",
            "Law of N. N. Gosvami et al., Science 348 (2015) 102, dh/dt = growth_rate exp(-(activation_energy -"
            " activation_volume p)/(k T)) - removal_rate h in the contact; the value is the volume grown",
            "closed form; central differences",
        ),
        inputs, ("grown_volume", "m3"), grown(inputs), by_logarithms(grown, inputs, names), (1e-2, 2e-2),
    )  # fmt: skip


PROBLEMS = {
    "film-thickness": film_thickness,
    "burgers-parameters": burgers_parameters,
    "surface-heights": surface_heights,
    "sliding-friction": sliding_friction,
    "growth-kinetics": growth_kinetics,
}


def main() -> None:
    FILE.write_text(
        json.dumps({name: make() for name, make in PROBLEMS.items()}, indent=1) + "\n",
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
