"""Solve the benchmark problems of problems.json with jaxcontact.

    python docs/benchmarks/answers.py                  # all problems: some minutes
    python docs/benchmarks/answers.py hertz ting       # some of them
    python docs/benchmarks/answers.py -o answers.json  # also written as JSON
    python docs/benchmarks/answers.py --check FILE     # the answers of another code, in the same form

Answers are a JSON object {problem: {quantity: value}} in the units of problems.json; a code may leave out problems.
Exit status 1 means that an answer is not within the tolerance of its problem.
"""

import argparse
import json
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace as Inputs
from typing import Any

import jaxcontact as jc
import numpy as np

PROBLEMS = json.loads(
    Path(__file__).with_name("problems.json").read_text(encoding="utf-8")
)
OURS = Path(__file__).with_name("jaxcontact.json")
NOW = np.zeros(1)
WIDTH = 1e-3  # of a slice in plane strain


def elastic(inputs: Inputs) -> jc.LayeredHalfSpace:
    return jc.LayeredHalfSpace([], jc.Elastic(inputs.shear_modulus, inputs.poisson))


def line(n: int, width: float) -> jc.Grid:
    """Return a grid in plane strain."""
    return jc.Grid((n, 1), (width / n, WIDTH), periodic=(False, True))


def of_contact(history: jc.ContactHistory) -> dict[str, Any]:
    """Return the quantities of a round contact at the last time."""
    return {
        "approach": history.approach[-1],
        "contact_radius": history.contact_radius[-1],
        "peak_pressure": history.peak_pressure[-1],
        "load": history.load[-1],
    }


def hertz(inputs: Inputs) -> dict[str, Any]:
    ball, load = jc.Sphere(inputs.radius), jc.Load(inputs.load)
    grid = jc.Grid.around(elastic(inputs), ball, load, NOW, n=128)
    return of_contact(jc.indent(elastic(inputs), ball, load, NOW, grid=grid))


def line_contact(inputs: Inputs) -> dict[str, Any]:
    roller, load = (
        jc.Cylinder(inputs.radius, WIDTH),
        jc.Load(inputs.load_per_length * WIDTH),
    )
    history = jc.indent(elastic(inputs), roller, load, NOW, grid=line(256, 3e-4))
    return {
        "half_width": history.contact_radius[0],
        "peak_pressure": history.peak_pressure[0],
    }


def westergaard(inputs: Inputs) -> dict[str, Any]:
    length = inputs.wavelength
    grid = jc.Grid((256, 4), (length / 256, length / 256), periodic=True)
    x, y = grid.coordinates()
    wave = jc.HeightField(
        inputs.amplitude * np.cos(2.0 * np.pi * np.asarray(x) / length)
        + 0.0 * np.asarray(y)
    )
    area = float(grid.width[0] * grid.width[1])
    history = jc.indent(
        elastic(inputs), wave, jc.Load(inputs.mean_pressure * area), NOW, grid=grid
    )
    width = history.smooth_area[0] / grid.width[1]
    return {"peak_pressure": history.peak_pressure[0], "contact_width": width}


def layer(inputs: Inputs) -> dict[str, Any]:
    film = jc.Layer(
        jc.Elastic(inputs.layer_shear_modulus, inputs.layer_poisson), inputs.thickness
    )
    body = jc.LayeredHalfSpace(
        [film], jc.Elastic(inputs.substrate_shear_modulus, inputs.substrate_poisson)
    )
    ball, load = jc.Sphere(inputs.radius), jc.Load(inputs.load)
    grid = jc.Grid.around(body, ball, load, NOW, n=128)
    return of_contact(jc.indent(body, ball, load, NOW, grid=grid))


def pavement(inputs: Inputs) -> dict[str, Any]:
    solids = [
        jc.Elastic.from_young(E, nu)
        for E, nu in zip(inputs.youngs_moduli, inputs.poissons, strict=True)
    ]
    layers = [
        jc.Layer(*pair) for pair in zip(solids[:-1], inputs.thicknesses, strict=True)
    ]
    grid, parts = jc.Grid.square(65, 0.32), 12
    x, y = (np.asarray(each) for each in grid.coordinates())
    steps = ((np.arange(parts) + 0.5) / parts - 0.5) * float(grid.spacing[0])
    inside = (
        np.hypot(x + steps[:, None, None, None], y + steps[:, None, None])
        < inputs.load_radius
    )
    share = inside.mean((0, 1))
    total = inputs.pressure * np.pi * inputs.load_radius**2
    pressure = share * total / (share.sum() * float(grid.cell_area))
    fields = jc.subsurface(
        jc.LayeredHalfSpace(layers, solids[-1]), grid, pressure, depths=[0.0]
    )
    return {"displacement": fields.displacement[0, 2, 32, 32]}


def thin_sample(inputs: Inputs) -> dict[str, Any]:
    gel = jc.Layer(jc.Elastic(inputs.shear_modulus, inputs.poisson), inputs.thickness)
    dish = jc.Elastic(1e6 * inputs.shear_modulus, 0.3)
    body, bead, depth = (
        jc.LayeredHalfSpace([gel], dish),
        jc.Sphere(inputs.radius),
        jc.Approach(inputs.approach),
    )
    grid = jc.Grid.around(body, bead, depth, NOW, n=128)
    return of_contact(jc.indent(body, bead, depth, NOW, grid=grid))


def tribofilm(inputs: Inputs) -> dict[str, Any]:
    film = jc.Layer(
        jc.Elastic(inputs.film_shear_modulus, inputs.film_poisson), inputs.thickness
    )
    body = jc.LayeredHalfSpace(
        [film], jc.Elastic(inputs.substrate_shear_modulus, inputs.substrate_poisson)
    )
    ball = jc.Sphere(
        inputs.radius, material=jc.Elastic(inputs.ball_shear_modulus, inputs.ball_poisson)
    )
    grid = jc.Grid.around(body, ball, jc.Load(inputs.load), NOW, n=256)
    return of_contact(jc.indent(body, ball, jc.Load(inputs.load), NOW, grid=grid))


def maxwell(inputs: Inputs) -> jc.LayeredHalfSpace:
    return jc.LayeredHalfSpace(
        [], jc.Maxwell(inputs.shear_modulus, inputs.viscosity, inputs.poisson)
    )


def lee_radok(inputs: Inputs) -> dict[str, Any]:
    times, ball, load = (
        np.linspace(0.0, inputs.time, 41),
        jc.Sphere(inputs.radius),
        jc.Load(inputs.load),
    )
    grid = jc.Grid.around(maxwell(inputs), ball, load, times, n=128)
    return of_contact(jc.indent(maxwell(inputs), ball, load, times, grid=grid))


def ting(inputs: Inputs) -> dict[str, Any]:
    turn, rate = inputs.time_of_reversal, inputs.rate
    times = np.linspace(0.0, 1.2 * turn, 61)
    depth = jc.Approach(rate * np.minimum(times, 2.0 * turn - times))
    ball = jc.Sphere(inputs.radius)
    grid = jc.Grid.around(maxwell(inputs), ball, depth, times, n=96)
    load = jc.indent(maxwell(inputs), ball, depth, times, grid=grid).load
    return {"load_at_reversal": load[50], "load_at_1.2_s": load[-1]}


def creeping_layer(inputs: Inputs) -> dict[str, Any]:
    names = ("G1", "G2", "eta1", "eta2", "nu")
    material = jc.Burgers(*(getattr(inputs, f"layer_{name}") for name in names))
    substrate = jc.Elastic(inputs.substrate_shear_modulus, inputs.substrate_poisson)
    body = jc.LayeredHalfSpace([jc.Layer(material, inputs.thickness)], substrate)
    ball, load, times = (
        jc.Sphere(inputs.radius),
        jc.Load(inputs.load),
        np.append(0.0, np.geomspace(5.0, inputs.time, 30)),
    )
    grid = jc.Grid.around(body, ball, load, times, n=128)
    return of_contact(jc.indent(body, ball, load, times, grid=grid))


def standard_solid(inputs: Inputs) -> jc.LayeredHalfSpace:
    delayed = inputs.delayed_compliance
    solid = jc.StandardLinearSolid(
        1.0 / inputs.instantaneous_compliance,
        1.0 / delayed,
        inputs.retardation_time / delayed,
        inputs.poisson,
    )
    return jc.LayeredHalfSpace([], solid)


def hunter(inputs: Inputs) -> dict[str, Any]:
    grid = jc.Grid((512, 1), (0.36 / 512, 0.5), periodic=(False, True))
    roller, load = jc.Cylinder(inputs.radius, 0.5), jc.Load(0.5 * inputs.load_per_length)
    steady = jc.slide_steady(
        standard_solid(inputs), roller, load, velocity=inputs.speed, grid=grid
    )
    return {
        "friction_coefficient": steady.friction_coefficient,
        "contact_width": 2.0 * steady.contact_radius,
    }


def cattaneo_mindlin(inputs: Inputs) -> dict[str, Any]:
    ball, load, Q = jc.Sphere(inputs.radius), jc.Load(inputs.load), inputs.tangential_load
    push = jc.TangentialLoad(np.outer([0.0, Q, -Q, Q], [1.0, 0.0]))
    grid = jc.Grid.around(elastic(inputs), ball, load, NOW, n=192)
    history = jc.shear(
        elastic(inputs),
        ball,
        load,
        push,
        np.arange(4.0),
        friction=inputs.friction,
        grid=grid,
        coupled=False,
    )
    return {
        "tangential_displacement": history.tangential_displacement[1, 0],
        "stick_radius": np.sqrt(np.sum(history.stick[1]) * float(grid.cell_area) / np.pi),
        "energy_of_a_cycle": history.dissipated[3] - history.dissipated[1],
    }


def spence(inputs: Inputs) -> dict[str, Any]:
    k = np.arange(1.0, inputs.steps + 1)
    load, still = (
        jc.Load(inputs.load * (k / inputs.steps) ** 3),
        jc.TangentialLoad((0.0, 0.0)),
    )
    grid = jc.Grid((45, 45), (inputs.cell, inputs.cell))
    history = jc.shear(
        elastic(inputs),
        jc.Sphere(inputs.radius),
        load,
        still,
        k,
        friction=inputs.friction,
        grid=grid,
        tolerance=1e-9,
    )
    return of_contact(history) | {"sticking_cells": np.sum(history.stick[-1])}


def rolling(
    body: Any, inputs: Inputs, grid: jc.Grid, roller: Any = None, **options: Any
) -> jc.SteadyRolling:
    """Return the steady state of a cylinder in plane strain."""
    roller = jc.Cylinder(inputs.radius, WIDTH) if roller is None else roller
    return jc.roll_steady(
        body, roller, jc.Load(inputs.load_per_length * WIDTH), grid=grid, **options
    )


def carter(inputs: Inputs) -> dict[str, Any]:
    roller = jc.Cylinder(
        inputs.radius, WIDTH, jc.Elastic(inputs.shear_modulus, inputs.poisson)
    )
    state = rolling(
        elastic(inputs), inputs, line(192, 3e-4), roller, velocity=1.0, creepage=(inputs.creepage, 0.0),
        friction=inputs.friction, coupled=False,
    )  # fmt: skip
    return {
        "force_over_limit": state.tangential_load[0]
        / (inputs.friction * inputs.load_per_length * WIDTH)
    }


def bentall_johnson(inputs: Inputs) -> dict[str, Any]:
    free = lambda friction: rolling(
        elastic(inputs),
        inputs,
        line(256, 2.6e-4),
        velocity=1.0,
        creepage=jc.TangentialLoad((0.0, 0.0)),
        friction=friction,
    )
    return {
        "creepage_at_high_friction": free(inputs.high_friction).creepage[0],
        "creepage_at_low_friction": free(inputs.low_friction).creepage[0],
    }


def viscoelastic_rolling(inputs: Inputs) -> dict[str, Any]:
    state = rolling(
        standard_solid(inputs), inputs, line(96, 3e-3), velocity=inputs.speed, creepage=(inputs.creepage, 0.0),
        friction=inputs.friction,
    )  # fmt: skip
    return {
        "force_per_length": state.tangential_load[0] / WIDTH,
        "rolling_resistance_per_length": state.hysteresis_force / WIDTH,
    }


def kalker(inputs: Inputs) -> dict[str, Any]:
    G = inputs.shear_modulus
    ball, load = (
        jc.Sphere(inputs.radius, jc.Elastic(G, inputs.poisson)),
        jc.Load(inputs.load),
    )
    around = jc.Grid.around(elastic(inputs), ball, load, NOW, n=96)
    a = jc.indent(elastic(inputs), ball, load, NOW, grid=around).contact_radius[0]
    grid = jc.Grid.square(64, 2.4 * float(a))
    force = lambda creepage: jc.roll_steady(
        elastic(inputs), ball, load, velocity=1.0, creepage=creepage, friction=5.0, grid=grid, coupled=False
    ).tangential_load / (1e-4 * G * a**2)  # fmt: skip
    return {"C11": force((1e-4, 0.0))[0], "C22": force((0.0, 1e-4))[1]}


def adhesive(
    inputs: Inputs, adhesion: Any, approaches: np.ndarray, n: int, width: float
) -> Any:
    """Return loads at approaches of a rigid ball."""
    grid = jc.Grid.square(n, width)
    times = np.arange(float(approaches.size))
    control = jc.Approach(approaches)
    return jc.indent(
        elastic(inputs),
        jc.Sphere(inputs.radius),
        control,
        times,
        grid=grid,
        adhesion=adhesion,
    ).load


def scales(inputs: Inputs) -> tuple[float, float]:
    """Return the units of radius and approach of adhesive contact, (pi w R^2/K)^(1/3) and radius^2/R, K = 4 E*/3."""
    stiffness = 4.0 / 3.0 * 2.0 * inputs.shear_modulus / (1.0 - inputs.poisson)
    radius = np.cbrt(np.pi * inputs.work_of_adhesion * inputs.radius**2 / stiffness)
    return radius, radius**2 / inputs.radius


def jkr(inputs: Inputs) -> dict[str, Any]:
    E, w = 2.0 * inputs.shear_modulus / (1.0 - inputs.poisson), inputs.work_of_adhesion
    radius, approach = scales(inputs)
    adhesion = jc.ExponentialAdhesion(w, np.cbrt(inputs.radius * w**2 / E**2) / 5.0)
    approaches = approach * np.concatenate([[1.0, 0.3], np.linspace(-0.25, -0.75, 9)])
    return {
        "pull_off_load": np.min(adhesive(inputs, adhesion, approaches, 128, 4.2 * radius))
    }


def maugis(inputs: Inputs) -> dict[str, Any]:
    radius, approach = scales(inputs)
    adhesion = jc.DugdaleAdhesion(inputs.work_of_adhesion, inputs.cohesive_stress)
    pull_off = inputs.approach_at_pull_off + approach * np.linspace(0.1, -0.1, 5)
    approaches = np.concatenate(
        [[1.5 * approach, inputs.approach, 0.2 * approach], pull_off]
    )
    loads = adhesive(inputs, adhesion, approaches, 128, 4.9 * radius)
    return {"pull_off_load": np.min(loads), "load_at_the_approach": loads[1]}


def archard(inputs: Inputs) -> dict[str, Any]:
    film = jc.Layer(
        jc.Elastic(inputs.film_shear_modulus, inputs.film_poisson), inputs.thickness
    )
    body = jc.LayeredHalfSpace(
        [film], jc.Elastic(inputs.substrate_shear_modulus, inputs.substrate_poisson)
    )
    grid = jc.Grid((32, 1), (4e-6, inputs.length), periodic=(False, True))
    roller, times = (
        jc.Cylinder(inputs.radius, inputs.length),
        np.linspace(0.0, inputs.time, 6),
    )
    law = jc.Archard(inputs.wear_coefficient)
    worn = jc.rub(
        body,
        roller,
        jc.Load(inputs.load),
        times,
        velocity=inputs.speed,
        law=law,
        grid=grid,
    )
    return {
        "worn_volume": np.sum(worn.thickness[0] - worn.thickness[-1]) * grid.cell_area
    }


def jaeger(inputs: Inputs) -> dict[str, Any]:
    grid = jc.Grid.square(33, 3.3 * inputs.half_width)
    x, y = (np.asarray(each) for each in grid.coordinates())
    half = inputs.half_width * (1.0 + 1e-9)
    covered = lambda d: np.clip(
        (half - np.abs(d)) / float(grid.spacing[0]) + 0.5, 0.0, 1.0
    )
    flux = inputs.power / (2.0 * inputs.half_width) ** 2 * covered(x) * covered(y)
    rise = jc.flash_temperature(
        flux,
        grid,
        velocity=inputs.speed,
        conductivity=inputs.conductivity,
        diffusivity=inputs.diffusivity,
    )
    return {"temperature_rise": rise[16, 16]}


SOLVERS: dict[str, Callable[[Inputs], dict[str, Any]]] = {
    "hertz": hertz, "line-contact": line_contact, "westergaard": westergaard, "compliant-layer": layer,
    "stiff-layer": layer, "pavement": pavement, "thin-sample": thin_sample, "tribofilm": tribofilm,
    "lee-radok": lee_radok, "ting": ting, "creeping-layer": creeping_layer, "hunter": hunter,
    "cattaneo-mindlin": cattaneo_mindlin, "spence": spence, "carter": carter, "bentall-johnson": bentall_johnson,
    "viscoelastic-rolling": viscoelastic_rolling, "kalker": kalker, "jkr": jkr, "maugis": maugis, "archard": archard,
    "jaeger": jaeger,
}  # fmt: skip


def answer(name: str) -> dict[str, float]:
    """Return the quantities of a problem, as problems.json names them, computed by jaxcontact."""
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore"
        )  # some problems have strains or edges beyond what users are warned of
        found = SOLVERS[name](Inputs(**PROBLEMS[name]["inputs"]))
    return {quantity: float(found[quantity]) for quantity in PROBLEMS[name]["references"]}


def outside(name: str, found: dict[str, float]) -> list[str]:
    """Print a problem with its answers; return the quantities that are not within their tolerance."""
    wrong = []
    print(f"{name}: {PROBLEMS[name]['title']}")
    for quantity, reference in PROBLEMS[name]["references"].items():
        if quantity not in found:
            continue
        error = found[quantity] / reference["value"] - 1.0
        verdict = (
            "" if abs(error) <= reference["tolerance"] else "  NOT within the tolerance"
        )
        print(
            f"  {quantity:30} {found[quantity]:14.6g} {reference['unit']:4} reference {reference['value']:14.6g}"
            f"  error {100 * error:+8.3f} %  tolerance {100 * reference['tolerance']:g} %{verdict}",
            flush=True,
        )
        wrong += [quantity] if verdict else []
    return wrong


def table(answers: dict[str, dict[str, float]]) -> str:
    """Return the table of problems, references and answers, in Markdown."""
    lines = [
        "| problem | source; method of the reference | quantity | reference | jaxcontact | error | tolerance |"
    ]
    lines.append("|" + "---|" * 7)
    for name, problem in PROBLEMS.items():
        about = [
            f"{problem['title']} (`{name}`)",
            f"{problem['source']}; {problem['method']}",
        ]
        for quantity, reference in problem["references"].items():
            value, unit, found = (
                reference["value"],
                reference["unit"],
                answers[name][quantity],
            )
            shown = f"{value:.5g} {unit}" if unit != "1" else f"{value:.5g}"
            error = f"{100 * (found / value - 1.0):+.3f} % | {100 * reference['tolerance']:g} %"
            lines.append(
                f"| {' | '.join(about)} | {quantity.replace('_', ' ')} | {shown} | {found:.5g} | {error} |"
            )
            about = ["", ""]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description="Solve the benchmark problems with jaxcontact, or check answers."
    )
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help="problems; all by default"
    )
    parser.add_argument("-o", "--output", type=Path, help="write the answers as JSON")
    parser.add_argument(
        "--check",
        type=Path,
        metavar="FILE",
        help="read the answers of another code from a file",
    )
    parser.add_argument(
        "--table", action="store_true", help="print the table of the documentation"
    )
    given = parser.parse_args(arguments)
    if unknown := [name for name in given.names if name not in PROBLEMS]:
        parser.error(f"no problem {unknown[0]!r}; there are {', '.join(PROBLEMS)}")
    known = json.loads(given.check.read_text(encoding="utf-8")) if given.check else None
    if given.table:
        print(table(json.loads(OURS.read_text(encoding="utf-8"))))
        return 0
    names = given.names or list(PROBLEMS if known is None else known)
    found, wrong = {}, []
    for name in names:
        found[name] = answer(name) if known is None else known[name]
        wrong += outside(name, found[name])
    if given.output:
        given.output.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
