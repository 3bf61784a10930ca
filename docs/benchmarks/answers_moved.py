"""The benchmark problems with sliding, friction, rolling, wear and frictional heat, solved with jaxcontact."""

from types import SimpleNamespace as Inputs
from typing import Any

import jaxcontact as jc
import numpy as np
from shared_inputs import NOW, WIDTH, elastic, line, of_contact


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
