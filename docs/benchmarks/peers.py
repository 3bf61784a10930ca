"""Solve the problems that Tamaas, ContactMechanics and ASPHER can solve, where they are installed.

    python docs/benchmarks/peers.py tamaas -o tamaas.json
    python docs/benchmarks/answers.py --check tamaas.json

The packages solve elastic contact without layers, Hertz's in a free space and Westergaard's on a periodic grid; the grids
are those of answers.py. ContactMechanics needs SurfaceTopography as well. ASPHER is compiled when it is installed.
"""

import argparse
import json
from pathlib import Path
from types import SimpleNamespace as Inputs

import numpy as np

PROBLEMS = json.loads(
    Path(__file__).with_name("problems.json").read_text(encoding="utf-8")
)
TOLERANCE = 1e-9


def ball(inputs: Inputs, n: int = 128) -> tuple[np.ndarray, float]:
    """Return the gap of Hertz's problem [m] on a square grid, and the width of the grid [m]."""
    a = np.cbrt(
        3.0
        * inputs.load
        * inputs.radius
        * (1.0 - inputs.poisson)
        / inputs.shear_modulus
        / 8.0
    )
    width = 4.0 * a
    x = (np.arange(n) + 0.5) * width / n - width / 2.0
    return (x[:, None] ** 2 + x**2) / (2.0 * inputs.radius), width


def wave(inputs: Inputs, n: int = 256) -> tuple[np.ndarray, float]:
    """Return the gap of Westergaard's problem [m] on one square period, and the period [m]."""
    x = (np.arange(n) + 0.5) / n
    gap = -inputs.amplitude * np.cos(2.0 * np.pi * x)[:, None] * np.ones(n)
    return gap, inputs.wavelength


def young_of(inputs: Inputs) -> float:
    return 2.0 * inputs.shear_modulus * (1.0 + inputs.poisson)


def round_contact(pressure: np.ndarray, width: float) -> dict[str, float]:
    cell = (width / pressure.shape[0]) ** 2
    return {
        "contact_radius": float(np.sqrt(np.sum(pressure > 0.0) * cell / np.pi)),
        "peak_pressure": float(pressure.max()),
    }


def line_of_contact(pressure: np.ndarray, width: float) -> dict[str, float]:
    touching = np.sum(pressure[:, 0] > 0.0)
    return {
        "peak_pressure": float(pressure.max()),
        "contact_width": float(touching * width / pressure.shape[0]),
    }


def tamaas_pressure(
    inputs: Inputs, gap: np.ndarray, width: float, mean: float, free: bool
) -> np.ndarray:
    import tamaas

    model = tamaas.Model(tamaas.model_type.basic_2d, [width, width], list(gap.shape))
    model.E, model.nu = young_of(inputs), inputs.poisson
    solver = tamaas.PolonskyKeerRey(model, -gap, TOLERANCE)
    if free:
        tamaas.ModelFactory.registerNonPeriodic(model, "free")
        solver.setIntegralOperator("free")
    solver.solve(mean)
    return np.asarray(model.traction)


def contact_mechanics_pressure(
    inputs: Inputs, gap: np.ndarray, width: float, mean: float, free: bool
) -> np.ndarray:
    from ContactMechanics import FreeFFTElasticHalfSpace, PeriodicFFTElasticHalfSpace
    from ContactMechanics.Systems import NonSmoothContactSystem
    from SurfaceTopography import Topography

    modulus = young_of(inputs) / (1.0 - inputs.poisson**2)
    kind = FreeFFTElasticHalfSpace if free else PeriodicFFTElasticHalfSpace
    space = kind(gap.shape, modulus, (width, width))
    system = NonSmoothContactSystem(
        space, Topography(-gap, (width, width), periodic=not free)
    )
    found = system.minimize_proxy(
        external_force=mean * width**2, pentol=TOLERANCE * np.ptp(gap), maxiter=1000
    )
    return np.asarray(found.jac)[: gap.shape[0], : gap.shape[1]] * gap.size / width**2


def aspher_pressure(
    inputs: Inputs, gap: np.ndarray, width: float, mean: float, free: bool
) -> np.ndarray:
    from aspher import ContactSolver

    modulus = young_of(inputs) / (1.0 - inputs.poisson**2)
    solver = ContactSolver(
        len(gap), width, modulus, backend="fft" if free else "periodic"
    )
    found = solver.solve((gap - gap.min()).ravel(), mean, tol=TOLERANCE)
    return np.asarray(found.pressure).reshape(gap.shape)


CODES = {
    "aspher": aspher_pressure,
    "contactmechanics": contact_mechanics_pressure,
    "tamaas": tamaas_pressure,
}


def answers(code: str) -> dict[str, dict[str, float]]:
    """Return the answers of a code to the problems that it can solve."""
    pressure = CODES[code]
    hertz, westergaard = (
        Inputs(**PROBLEMS[name]["inputs"]) for name in ("hertz", "westergaard")
    )
    gap, width = ball(hertz)
    found = {
        "hertz": round_contact(
            pressure(hertz, gap, width, hertz.load / width**2, True), width
        )
    }
    gap, width = wave(westergaard)
    waved = pressure(westergaard, gap, width, westergaard.mean_pressure, False)
    return found | {"westergaard": line_of_contact(waved, width)}


def main() -> None:
    parser = argparse.ArgumentParser(
        description="Solve benchmark problems with another code."
    )
    parser.add_argument("code", choices=sorted(CODES))
    parser.add_argument("-o", "--output", type=Path, required=True)
    given = parser.parse_args()
    given.output.write_text(
        json.dumps(answers(given.code), indent=1) + "\n", encoding="utf-8"
    )


if __name__ == "__main__":
    main()
