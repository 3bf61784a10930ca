"""Solve the five problems of gradients.json with jaxcontact: values, derivatives, and the cost of a gradient in runs.

    python docs/benchmarks/gradients.py                       # all problems: some minutes
    python docs/benchmarks/gradients.py surface-heights       # one of them
    python docs/benchmarks/gradients.py -o answers.json       # also written as JSON
    python docs/benchmarks/gradients.py --cost -o costs.json  # measure the cost of a gradient instead
    python docs/benchmarks/gradients.py --check FILE          # the answers of another code, in the same form

Answers are a JSON object {problem: {quantity: value}}. The cost is the processor time of the value with its gradient over
that of the value alone, both compiled before, in one process. Exit status 1 means that an answer is not within the
tolerance of its problem.
"""

import json
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace as Inputs
from typing import Any, NamedTuple

import answers
import jax
import jax.numpy as jnp
import jaxcontact as jc
import numpy as np
from shared_inputs import NOW

HERE = Path(__file__).parent
PROBLEMS = json.loads((HERE / "gradients.json").read_text(encoding="utf-8"))
OURS = HERE / "jaxcontact_gradients.json"
COSTS = HERE / "jaxcontact_costs.json"


class Calculation(NamedTuple):
    """A differentiable calculation.

    run: function of a pytree of parameters that returns the value; at: the parameters; slopes: function of the gradient
    that returns the derivatives by name.
    """

    run: Callable[[Any], jax.Array]
    at: Any
    slopes: Callable[[Any], dict[str, Any]]


def of_inputs(
    run: Callable[[Inputs], jax.Array], inputs: Inputs, *names: str
) -> Calculation:
    """Return the calculation whose parameters are the logarithms of some of the inputs."""

    def scaled(logs: dict) -> jax.Array:
        factors = {name: getattr(inputs, name) * jnp.exp(logs[name]) for name in names}
        return run(Inputs(**{**vars(inputs), **factors}))

    by_name = lambda gradient: {f"by_{name}": gradient[name] for name in names}
    return Calculation(scaled, dict.fromkeys(names, 0.0), by_name)


def film_thickness(inputs: Inputs) -> Calculation:
    def body(given: Inputs) -> jc.LayeredHalfSpace:
        film = jc.Layer(
            jc.Elastic(given.film_shear_modulus, given.film_poisson), given.thickness
        )
        return jc.LayeredHalfSpace(
            [film], jc.Elastic(given.substrate_shear_modulus, given.substrate_poisson)
        )

    ball, load = jc.Sphere(inputs.radius), jc.Load(inputs.load)
    grid = jc.Grid.around(body(inputs), ball, load, NOW, n=128)
    x, y = grid.coordinates()
    square = 1.0 - (np.asarray(x) ** 2 + np.asarray(y) ** 2) / inputs.measured_radius**2
    measured = (
        1.5
        * inputs.load
        / (np.pi * inputs.measured_radius**2)
        * np.sqrt(np.maximum(square, 0.0))
    )

    def misfit(given: Inputs) -> jax.Array:
        pressure = jc.indent(body(given), ball, load, NOW, grid=grid).pressure[0]
        return jnp.sum((pressure - measured) ** 2) / np.sum(measured**2)

    return of_inputs(misfit, inputs, "thickness", "film_shear_modulus")


def burgers_parameters(inputs: Inputs) -> Calculation:
    def body(given: Inputs) -> jc.LayeredHalfSpace:
        return jc.LayeredHalfSpace(
            [], jc.Burgers(given.G1, given.G2, given.eta1, given.eta2, given.poisson)
        )

    ball, load, times = (
        jc.Sphere(inputs.radius),
        jc.Load(inputs.load),
        np.asarray(inputs.times),
    )
    grid = jc.Grid.around(body(inputs), ball, load, times, n=64)

    def misfit(given: Inputs) -> jax.Array:
        approach = jc.indent(
            body(given), ball, load, times, grid=grid, save="last"
        ).approach
        return jnp.mean(jnp.log(approach / np.asarray(inputs.measured_approach)) ** 2)

    return of_inputs(misfit, inputs, "G1", "G2", "eta1", "eta2")


def surface_heights(inputs: Inputs) -> Calculation:
    body = jc.LayeredHalfSpace([], jc.Elastic(inputs.shear_modulus, inputs.poisson))
    grid = jc.Grid(
        (256, 4), (inputs.wavelength / 256, inputs.wavelength / 256), periodic=True
    )
    x, _ = grid.coordinates()
    angle = 2.0 * np.pi * np.asarray(x) / inputs.wavelength * np.ones(grid.shape)
    load = jc.Load(inputs.mean_pressure * float(grid.width[0] * grid.width[1]))

    def mean_gap(heights: jax.Array) -> jax.Array:
        wave = jc.HeightField(inputs.amplitude * heights)
        return jnp.mean(jc.indent(body, wave, load, NOW, grid=grid).gap)

    def slopes(gradient: np.ndarray) -> dict[str, Any]:
        return {
            "along_the_wave": np.sum(gradient * np.cos(angle)),
            "along_half_its_length": np.sum(gradient * np.cos(2.0 * angle)),
        }

    return Calculation(mean_gap, np.cos(angle), slopes)


def sliding_friction(inputs: Inputs) -> Calculation:
    grid = jc.Grid((256, 1), (0.36 / 256, 0.5), periodic=(False, True))

    def friction(given: Inputs) -> jax.Array:
        delayed = given.delayed_compliance
        solid = jc.StandardLinearSolid(
            1.0 / given.instantaneous_compliance,
            1.0 / delayed,
            given.retardation_time / delayed,
            given.poisson,
        )
        body, roller = jc.LayeredHalfSpace([], solid), jc.Cylinder(given.radius, 0.5)
        load = jc.Load(0.5 * given.load_per_length)
        return jc.slide_steady(
            body, roller, load, velocity=given.speed, grid=grid
        ).friction_coefficient

    names = (
        "instantaneous_compliance",
        "delayed_compliance",
        "radius",
        "speed",
        "load_per_length",
    )
    return of_inputs(friction, inputs, *names)


def growth_kinetics(inputs: Inputs) -> Calculation:
    solid = jc.Elastic(inputs.shear_modulus, inputs.poisson)
    body = jc.LayeredHalfSpace([jc.Layer(solid, inputs.thickness)], solid)
    ball, load, times = (
        jc.Sphere(inputs.radius),
        jc.Load(inputs.load),
        np.linspace(0.0, inputs.time, 6),
    )
    grid = jc.Grid.around(body, ball, load, NOW, n=48)

    def grown(given: Inputs) -> jax.Array:
        law = jc.StressActivated(
            given.growth_rate,
            given.activation_energy,
            given.activation_volume,
            given.temperature,
        ) + jc.ProportionalRemoval(given.removal_rate)
        history = jc.rub(
            body, ball, load, times, velocity=given.speed, law=law, grid=grid, save="last"
        )
        return jnp.sum(history.thickness - inputs.thickness) * grid.cell_area

    return of_inputs(
        grown,
        inputs,
        "growth_rate",
        "activation_energy",
        "activation_volume",
        "removal_rate",
    )


SOLVERS: dict[str, Callable[[Inputs], Calculation]] = {
    "film-thickness": film_thickness,
    "burgers-parameters": burgers_parameters,
    "surface-heights": surface_heights,
    "sliding-friction": sliding_friction,
    "growth-kinetics": growth_kinetics,
}


def calculation(name: str) -> Calculation:
    """Return the calculation of a problem."""
    return SOLVERS[name](Inputs(**PROBLEMS[name]["inputs"]))


def quantities(name: str, value: Any, slopes: dict[str, Any]) -> dict[str, float]:
    """Return the value and the derivatives of a problem under the names of gradients.json."""
    first = next(iter(PROBLEMS[name]["references"]))
    return {key: float(number) for key, number in {first: value, **slopes}.items()}


def answer(name: str) -> dict[str, float]:
    """Return the value and the derivatives of a problem, computed by jaxcontact."""
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore"
        )  # of strains or edges beyond what users are warned of
        run, at, slopes = calculation(name)
        value, gradient = jax.jit(jax.value_and_grad(run))(at)
    return quantities(name, value, slopes(jax.tree.map(np.asarray, gradient)))


def cost(name: str, repeats: int = 7) -> dict[str, float]:
    """Return the number of parameters, and the processor time of value and gradient over that of the value.

    The two programs run alternately, and the shortest times count, since other programs of the machine disturb them.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run, at, _ = calculation(name)
        programs = jax.jit(run), jax.jit(jax.value_and_grad(run))
        for program in programs:
            jax.block_until_ready(program(at))
    times: list[list[float]] = [[], []]
    for _ in range(repeats):
        for program, taken in zip(programs, times, strict=True):
            began = time.process_time()
            jax.block_until_ready(program(at))
            taken.append(time.process_time() - began)
    forward, both = map(min, times)
    print(
        f"{name}: run {1e3 * forward:.1f} ms, value and gradient {1e3 * both:.1f} ms: {both / forward:.2f} runs"
    )
    parameters = sum(np.size(leaf) for leaf in jax.tree.leaves(at))
    return {"parameters": parameters, "runs": round(both / forward, 1)}


def cost_table() -> str:
    """Return the table of the cost of a gradient, in Markdown."""
    lines = [
        "| problem | parameters | runs, jaxcontact | runs, differences |",
        "|" + "---|" * 4,
    ]
    for name, measured in json.loads(COSTS.read_text(encoding="utf-8")).items():
        count = measured["parameters"]
        lines.append(f"| `{name}` | {count} | {measured['runs']:.1f} | {count + 1} |")
    return "\n".join(lines)


def tables() -> str:
    """Return the tables of our answers and of the cost of a gradient, in Markdown."""
    ours = json.loads(OURS.read_text(encoding="utf-8"))
    return answers.table(ours, PROBLEMS) + "\n\n" + cost_table()


def main(arguments: Sequence[str] | None = None) -> int:
    return answers.command(
        "Solve the problems with gradients, or check answers.",
        PROBLEMS,
        answer,
        tables,
        arguments,
        cost,
    )


if __name__ == "__main__":
    sys.exit(main())
