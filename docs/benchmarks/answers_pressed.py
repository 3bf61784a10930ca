"""The benchmark problems in which a body is pressed, with and without adhesion, solved with jaxcontact."""

from types import SimpleNamespace as Inputs
from typing import Any

import jaxcontact as jc
import numpy as np
from shared_inputs import NOW, WIDTH, elastic, line, of_contact


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
