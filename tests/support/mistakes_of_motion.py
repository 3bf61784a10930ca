"""Mistakes in what shears, slides and rolls, in periodic grids, what lies below the surface, rough surfaces and files."""

import jax
import numpy as np
from right_calls import (
    BALL,
    BODY,
    FILM,
    FLOWS,
    GRID,
    LINE,
    LOAD,
    PERIODIC,
    ROLLER,
    STEEL,
    STEEL_BALL,
    TIMES,
    gel,
    indent,
    on,
    on_steel,
    pressed,
    roll,
    rough,
    rub,
    shear,
    slide,
    steady,
)

import jaxcontact as jc

TRACK = np.array([-1e-4, 1e-4])
CELL = GRID.spacing[0]
TWICE = jc.NumpyFunction(lambda x: {"b": 2.0 * x["a"], "n": 2})
HOT = jc.Thermal(300.0, 46.0, diffusivity=1e-5)


def moved_inside(velocity, **given):
    return jc.subsurface(BODY, GRID, np.ones((8, 8)), depths=[0.0], times=TIMES, velocity=velocity, **given)


MOTION = {
    "a word for the grid of a steady state": (
        lambda: steady(1e-9, grid="auto"),
        r"grid: expected a Grid, got str",
    ),
    "a velocity along a path": (
        lambda: rub(path=TRACK),
        r"velocity: expected either velocity or path, got both",
    ),
    "neither velocity nor path": (
        lambda: rub(velocity=None),
        r"expected either velocity or path, got neither",
    ),
    "a path of other times": (
        lambda: rub(velocity=None, path=np.zeros(3)),
        r"path \[m\]: expected shape \(2,\) or \(2, 2\) as times, got \(3,\)",
    ),
    "a path that leaves the grid": (
        lambda: rub(velocity=None, path=1e3 * TRACK),
        r"path \[m\]: expected positions within .* of the centre of the grid along x, got 0.1",
    ),
    "a path without end": (
        lambda: rub(velocity=None, path=np.array([0.0, np.inf])),
        r"path \[m\]: expected finite numbers",
    ),
    "a jump of the path": (
        lambda: rub(velocity=None, path=TRACK, times=[1.0, 1.0]),
        r"path \[m\]: expected no move between two equal times, got one",
    ),
    "a path that starts again after a lap": (
        lambda: rub(
            velocity=None, path=np.array([0.0, 2e-4, -2e-4, 0.0]), times=np.arange(4.0), grid=PERIODIC
        ),
        r"path \[m\]: expected positions that go on around the periodic axis x, .* got one of -0.0004 back",
    ),
    "a rough surface on a path": (
        lambda: rub(velocity=None, path=TRACK, indenter=jc.HeightField(np.zeros((8, 8)))),
        r"indenter: expected a Sphere, Ellipsoid, Cone or Cylinder with path, got HeightField",
    ),
    "a path of an indenter that wears": (
        lambda: rub(velocity=None, path=TRACK, wears="indenter"),
        r'path: expected None with wears="indenter" on a body that creeps or yields, got positions',
    ),
    "heat along a path": (
        lambda: rub(velocity=None, path=TRACK, thermal=HOT),
        r"path: expected None with thermal=, got positions",
    ),
    "an indenter that creeps along a path": (
        lambda: rub(velocity=None, path=TRACK, indenter=jc.Sphere(1e-3, FILM)),
        r"indenter material: expected Elastic or None with path= and a film on the body, .* got Burgers",
    ),
    "a coated ball that wears on a number": (
        lambda: rub(body=3.0, indenter=jc.Sphere(1e-3, BODY), wears="indenter"),
        r"body: expected a LayeredHalfSpace, got float",
    ),
    "stresses under a velocity without end": (
        lambda: moved_inside(np.inf),
        r"velocity \[m/s\]: expected finite numbers",
    ),
    "stresses in no inner steps": (
        lambda: moved_inside(CELL, substeps=0),
        r"substeps: expected 1 to 20000, got 0",
    ),
    "a tuple of traced numbers as a tangential load": (
        lambda: jax.jit(lambda q: shear(jc.TangentialLoad((q, 0.0))).approach)(1.0),
        r"TangentialLoad: expected an array inside jit, vmap and grad, got a tuple of traced numbers: join them",
    ),
    "automatic substeps inside jit": (
        lambda: jax.jit(lambda speed: rub(velocity=speed, substeps="auto").approach)(0.1),
        r'substeps: expected a number inside jit, vmap and grad, got "auto"',
    ),
    "a shear strength without adhesion": (
        lambda: steady(1e-9, shear_strength=1e6),
        r"shear_strength: expected None without adhesion, got 1000000\.0",
    ),
    "a shear strength in rubbing without adhesion": (
        lambda: rub(velocity=0.1, shear_strength=1e6),
        r"shear_strength: expected None without adhesion, got 1000000\.0",
    ),
    "a shear strength of another grid": (
        lambda: steady(
            1e-9, adhesion=jc.ExponentialAdhesion(0.05, 1e-9), shear_strength=np.full((4, 4), 1e6)
        ),
        r"shear_strength \[Pa\]: expected a number or shape \(8, 8\), got shape \(4, 4\)",
    ),
    "a traction that presses on surfaces that attract": (
        lambda: shear(adhesion=jc.ExponentialAdhesion(0.05, 1e-9)),
        r"coupled: expected False with adhesion, got True: the traction is computed without its effect on the pressure",
    ),
    "a shear strength below zero": (
        lambda: steady(1e-9, adhesion=jc.ExponentialAdhesion(0.05, 1e-9), shear_strength=-1e6),
        r"shear_strength \[Pa\]: expected >= 0, got -1e\+06",
    ),
    "adhesion with heat": (
        lambda: slide(
            1e-9, adhesion=jc.ExponentialAdhesion(0.05, 1e-9), friction=0.3, thermal=jc.Thermal(300.0, 50.0)
        ),
        r"thermal: expected None with adhesion, got Thermal",
    ),
    "a shift of the times of a ball that creeps in a slide": (
        lambda: jc.slide(
            BODY,
            jc.Sphere(1e-3, jc.Maxwell(1e9, 1e9)),
            LOAD,
            TIMES,
            velocity=1e-9,
            grid=GRID,
            friction=0.3,
            thermal=jc.Thermal(300.0, 50.0, diffusivity=1e-5, shift=jc.ArrheniusShift(1e-19, 300.0)),
        ),
        r"indenter material: expected Elastic or None with a shift in thermal=, got Maxwell",
    ),
    "heat without friction in a slide": (
        lambda: slide(1e-9, thermal=HOT),
        r"friction: expected a coefficient with thermal=, got None",
    ),
    "heat at a velocity that changes": (
        lambda: slide(1e-9 * np.ones((2, 2)), thermal=HOT, friction=0.1),
        r"velocity: expected a number or shape \(2,\) with thermal=, .* got shape \(2, 2\)",
    ),
    "heat that does not spread": (
        lambda: slide(1e-9, thermal=jc.Thermal(300.0, 46.0), friction=0.1),
        r"Thermal diffusivity \[m2/s\]: expected a number in slide, got None",
    ),
    "a diffusivity below zero": (
        lambda: slide(1e-9, thermal=jc.Thermal(300.0, 46.0, diffusivity=-1.0), friction=0.1),
        r"Thermal diffusivity \[m2/s\]: expected > 0",
    ),
    "a normal load along the surface": (lambda: shear(LOAD), r"tangential: expected TangentialLoad or"),
    "a tangential load without direction": (
        lambda: shear(jc.TangentialLoad(5.0)),
        r"TangentialLoad: expected shape \(2,\) or \(2, 2\) as times, got shape \(\)",
    ),
    "a displacement without end": (
        lambda: shear(jc.TangentialDisplacement((np.inf, 0.0))),
        r"TangentialDisplacement: expected finite numbers",
    ),
    "friction that pushes": (lambda: shear(friction=-0.1), r"friction: expected >= 0, got -0.1"),
    "friction on another grid": (
        lambda: shear(friction=np.ones(3)),
        r"friction: expected a number or shape \(8, 8\)",
    ),
    "a word for save of shear": (
        lambda: shear(save="first"),
        r"""save: expected "all", "last" or a function, got 'first'""",
    ),
    "pressure on another grid": (
        lambda: jc.subsurface(BODY, GRID, np.ones(3), depths=[0.0]),
        r"pressure: expected shape \(8, 8\), or one for each time with times=, got \(3,\)",
    ),
    "pressure without end": (
        lambda: jc.subsurface(BODY, GRID, np.full((8, 8), np.inf), depths=[0.0]),
        r"pressure \[Pa\]: expected finite",
    ),
    "traction without direction": (
        lambda: jc.subsurface(BODY, GRID, np.ones((8, 8)), np.ones((8, 8)), depths=[0.0]),
        r"traction: expected shape \(2, 8, 8\)",
    ),
    "traction without end": (
        lambda: jc.subsurface(BODY, GRID, np.ones((8, 8)), np.full((2, 8, 8), np.inf), depths=[0.0]),
        r"traction \[Pa\]: expected finite",
    ),
    "depths of a solid that keeps its volume after a history": (
        lambda: jc.subsurface(
            on(jc.Maxwell(1e9, 1e12, bulk_modulus=1e9)), GRID, np.ones((2, 8, 8)), depths=[0.0], times=TIMES
        ),
        r"times: expected None with a bulk modulus in a solid that creeps",
    ),
    "pressure without times": (
        lambda: jc.subsurface(BODY, GRID, np.ones((8, 8)), depths=[0.0], times=TIMES),
        r"pressure: expected shape \(2, 8, 8\), got \(8, 8\)",
    ),
    "times below the surface that decrease": (
        lambda: jc.subsurface(BODY, GRID, np.ones((2, 8, 8)), depths=[0.0], times=[1.0, 0.0]),
        r"times \[s\]: expected finite times that do not decrease",
    ),
    "the inside of what is rigid at first": (
        lambda: jc.subsurface(on(jc.KelvinVoigt(1.0, 1.0)), GRID, np.ones((8, 8)), depths=[0.0]),
        r"compliance \[1/Pa\] of every solid at first: expected > 0",
    ),
    "a single depth": (
        lambda: jc.subsurface(BODY, GRID, np.ones((8, 8)), depths=1e-6),
        r"depths: expected a 1-d array, got shape \(\)",
    ),
    "a place in a rigid base": (
        lambda: jc.subsurface(gel(), GRID, np.ones((8, 8)), depths=[2e-6]),
        r"depths \[m\]: expected at most 1e-06, where the rigid base begins, got 2e-06",
    ),
    "traction on a loose layer": (
        lambda: jc.subsurface(gel(), GRID, np.ones((8, 8)), np.ones((2, 8, 8)), depths=[0.0]),
        r"traction: expected bonded layers, got one with bonded=False",
    ),
    "a motion below the surface without times": (
        lambda: jc.subsurface(BODY, GRID, np.ones((8, 8)), depths=[0.0], velocity=1.0),
        r"times: expected those of the motion with velocity=, got None",
    ),
    "velocities below the surface on other times": (
        lambda: moved_inside(np.ones(3)),
        r"velocity: expected a number, shape \(2,\) or \(2, 2\) as times, got shape \(3,\)",
    ),
    "a traced motion below the surface of no given steps": (
        lambda: jax.eval_shape(moved_inside, 1.0),
        r"substeps: expected a number where velocity, times or grid are traced by jit, vmap or grad, got None",
    ),
    "long inner steps of a motion below the surface": (
        lambda: moved_inside(3.0 * CELL, substeps=2),
        r"substeps: expected inner steps of at most a cell, 3 or more of them, got 2",
    ),
    "a track of too many inner steps below the surface": (
        lambda: moved_inside(1e5 * CELL),
        r"velocity: expected a track of at most 5000 cells in all, got steps of 1e\+05 cells",
    ),
    "a track below the surface that is too long for a grid": (
        lambda: moved_inside(4500.0 * CELL, substeps=4500),
        r"velocity: expected a track that fits on 4096 cells, got 4508: pass a later start or larger cells",
    ),
    "the inside of a rigid indenter": (
        lambda: jc.subsurface(BODY, GRID, np.ones((8, 8)), depths=[0.0], indenter=jc.Sphere(1.0)),
        r"indenter: expected one with a material, in which there are stresses, got a rigid one in subsurface",
    ),
    "a loose layer that is sheared": (
        lambda: shear(body=gel()),
        r"shear: expected bonded layers, .* moves as a free membrane",
    ),
    "a wheel on a loose layer": (
        lambda: roll(body=gel),
        r"roll_steady: expected bonded layers, .* moves as a free membrane",
    ),
    "friction on a loose layer": (
        lambda: steady(0.1, body=gel(), friction=0.3),
        r"friction: expected bonded layers, .* moves as a free membrane",
    ),
    "a loose layer that is moved as a whole": (
        lambda: jc.frequency_response(gel(), 0.0, 0.0),
        r"wavevector zero: expected bonded layers, .* moves as a free membrane",
    ),
    "a given pressure on another grid": (
        lambda: pressed(pressure=np.ones((3, 8, 8))),
        r"pressure: expected shape \(8, 8\) as the grid or \(2, 8, 8\) as times, got \(3, 8, 8\)",
    ),
    "a given pressure without end": (
        lambda: pressed(pressure=np.full((8, 8), np.inf)),
        r"pressure \[Pa\]: expected finite",
    ),
    "a given pressure at times that decrease": (
        lambda: pressed(times=[1.0, 0.0]),
        r"times \[s\]: expected finite times that do not decrease",
    ),
    "a given pressure on a film that is rigid at first": (
        lambda: pressed(jc.LayeredHalfSpace([jc.Layer(jc.KelvinVoigt(1e6, 1e6), 1e-6)], STEEL)),
        r"layer: a material with J\(0\) = 0 has no bound on its decay rates .* in deflection",
    ),
    "a given pressure with half a step": (
        lambda: pressed(substeps=0),
        r"substeps: expected",
    ),
    "a given pressure that moves along three axes": (
        lambda: pressed(velocity=[1.0, 0.0, 0.0]),
        r"velocity: expected a number, shape \(2,\) or \(2, 2\) as times, got shape \(3,\)",
    ),
    "a given pressure that moves at no known speed": (
        lambda: pressed(velocity=np.nan),
        r"velocity \[m/s\]: expected finite numbers",
    ),
    "a given pressure that leaves the grid far behind": (
        lambda: pressed(velocity=1e6),
        r"times \[s\]: expected steps of at most 500 widths of the grid along the track",
    ),
    "notes on a deflection inside jit": (
        lambda: jax.jit(lambda v: pressed(velocity=v).notes)(1e-5),
        r"notes: expected a result with known values, got one traced",
    ),
    "a place above the surface": (
        lambda: jc.subsurface(BODY, GRID, np.ones((8, 8)), depths=[-1e-6]),
        r"depths \[m\]: expected >= 0",
    ),
    "a ball in plane strain": (
        lambda: indent(grid=LINE),
        r"indenter: expected a Cylinder or a HeightField in plane strain, got Sphere",
    ),
    "a roller that ends within a cell of plane strain": (
        lambda: indent(indenter=jc.Cylinder(9.5e-3, length=1e-6), grid=LINE),
        r"cylinder length \[m\]: expected at least the width 7.5e-05 of plane strain, got 1e-06",
    ),
    "friction in plane strain": (
        lambda: steady(1.0, on_steel(), indenter=ROLLER, grid=LINE, friction=0.3),
        r"friction: expected None on a periodic grid or in plane strain",
    ),
    "friction on another grid in sliding": (
        lambda: steady(1.0, friction=np.full((8, 7), 0.3)),
        r"friction: expected a number or shape \(8, 8\), got shape \(8, 7\)",
    ),
    "friction under a ball with a loose coating": (
        lambda: steady(1.0, on_steel(), indenter=jc.Sphere(1e-3, gel()), friction=0.3),
        r"friction: expected bonded layers, got one with bonded=False",
    ),
    "a ball that flows in steady sliding": (
        lambda: steady(1.0, on_steel(), indenter=jc.Sphere(1e-3, jc.Maxwell(1e9, 1e9))),
        r"indenter material: expected one that does not flow without limit",
    ),
    "negative friction in sliding": (
        lambda: slide(1.0, times=[0.0], friction=-0.3),
        r"friction: expected >= 0, got -0.3",
    ),
    "rolling on a half-space that flows under a line": (
        lambda: roll(body=lambda: FLOWS, indenter=ROLLER, grid=LINE),
        r"body: expected one that does not flow without limit, on this grid",
    ),
    "rolling across a line": (
        lambda: roll(velocity=(1.0, 0.0), indenter=ROLLER, grid=LINE),
        r"velocity: expected one number, along x, in plane strain, got shape \(2,\)",
    ),
    "rolling under a history": (
        lambda: roll(control=jc.Load([1.0])),
        r"Load: expected one number in the steady",
    ),
    "rolling in three directions": (
        lambda: roll(velocity=np.ones(3)),
        r"velocity: expected a number or shape",
    ),
    "rolling at rest": (lambda: roll(velocity=0.0), r"velocity \[m/s\] \(its size\): expected > 0"),
    "rolling by displacement": (
        lambda: roll(creepage=jc.TangentialDisplacement((1e-6, 0.0))),
        r"creepage: expected \(x, y\) or a TangentialLoad, got TangentialDisplacement",
    ),
    "creepage without direction": (
        lambda: roll(creepage=1e-3),
        r"creepage: expected \(x, y\) or a TangentialLoad",
    ),
    "creepage without end": (lambda: roll(creepage=(np.inf, 0.0)), r"creepage: expected finite numbers"),
    "a velocity of another shape": (
        lambda: slide(np.zeros(3)),
        r"velocity: expected a number, shape \(2,\) or \(2, 2\)",
    ),
    "a word for a velocity": (lambda: slide("fast"), "velocity: expected a number or numbers .* 'fast'"),
    "a Kelvin-Voigt film": (
        lambda: indent(
            body=jc.LayeredHalfSpace([jc.Layer(jc.KelvinVoigt(1e9, 1e9), 1e-7)], STEEL), indenter=STEEL_BALL
        ),
        r"layer: a material with J\(0\) = 0",
    ),
    "an infinite velocity": (lambda: slide(np.inf), r"velocity \[m/s\]: expected finite numbers"),
    "a step beyond the grid": (lambda: slide(1.0), r"pass substeps=\d+ or more, or a wider grid"),
    "a track that leaves and comes back": (
        lambda: slide(np.array([[1e-4, 0.0]] * 6 + [[-1e-4, 0.0]] * 6), times=np.arange(12.0) * 2.0),
        r"track that stays",
    ),
    "a steady velocity of another shape": (
        lambda: steady(np.zeros(3)),
        r"velocity: expected a number or shape \(2,\)",
    ),
    "a steady load over time": (
        lambda: steady(1.0, control=jc.Load([1.0, 2.0])),
        r"Load: expected one number",
    ),
    "an infinite steady velocity": (lambda: steady(np.nan), r"velocity \[m/s\]: expected finite"),
    "a steady state at rest": (
        lambda: steady(0.0, body=FLOWS),
        r"expected not 0: the body flows without limit",
    ),
    "a steady approach on a body that flows": (
        lambda: steady(1.0, body=FLOWS, control=jc.Approach(1e-6)),
        r"control: expected a Load on a half-space",
    ),
    "a word for periodic": (
        lambda: indent(grid=jc.Grid((8, 8), (1e-5, 1e-5), periodic="y")),
        r"grid periodic: expected True, False or two of them, got 'y'",
    ),
    "a steady slide of a roller over what creeps far off": (
        lambda: steady(1.0, FLOWS, grid=jc.Grid((8, 8), (1e-5, 1e-5), periodic=(False, True))),
        r"grid: expected one .* substrate that creeps, got periodic=\(False, True\) with \(8, 8\) cells; slide takes it",
    ),
    "a line that ends": (
        lambda: indent(grid=jc.Grid((8, 1), (1e-5, 1e-5))),
        r"grid shape: expected two whole numbers of at least 4, got \(8, 1\)",
    ),
    "kernels of free space on a periodic grid": (
        lambda: indent(kernels=jc.kernels(on_steel(), BALL, GRID), grid=PERIODIC),
        r"kernels: expected those of a grid with periodic=\(True, True\), got periodic=\(False, False\)",
    ),
    "an approach that presses a periodic surface flat": (
        lambda: indent(control=jc.Approach(1.0), grid=PERIODIC),
        r"Approach \[m\]: expected less than .* on a periodic grid, the mean gap at first touch, got 1:",
    ),
    "a velocity across a line": (
        lambda: steady((1.0, 0.0), indenter=ROLLER, grid=LINE),
        r"velocity: expected one number, along x, in plane strain, got shape \(2,\)",
    ),
    "a half-space that flows under a line": (
        lambda: steady(1.0, body=FLOWS, indenter=ROLLER, grid=LINE),
        r"body: expected one that does not flow without limit, on this grid",
    ),
    "friction on a periodic grid": (
        lambda: shear(grid=PERIODIC),
        r"grid: expected a grid not periodic along x, .* in shear, got periodic=\(True, True\)",
    ),
    "a spin along two axes": (lambda: roll(spin=np.zeros(2)), r"spin: expected one number, got shape \(2,\)"),
    "spin in plane strain": (
        lambda: roll(spin=1.0, indenter=ROLLER, grid=LINE),
        r"spin \[1/m\]: expected 0 in plane strain, got 1.0",
    ),
    "spin without end": (lambda: roll(spin=np.inf), r"spin \[1/m\]: expected finite numbers"),
    "rolling on a periodic grid": (lambda: roll(grid=PERIODIC), r"not periodic along x, .* in roll_steady"),
    "rolling on a grid periodic across": (
        lambda: roll(grid=jc.Grid((8, 8), (1e-6, 1e-6), periodic=(False, True))),
        r"along y in plane strain only, in roll_steady, got periodic=\(False, True\) with \(8, 8\) cells",
    ),
    "stresses under a grid that is periodic along one axis": (
        lambda: jc.subsurface(
            BODY, jc.Grid((8, 8), GRID.spacing, periodic=(True, False)), np.ones((8, 8)), depths=[0.0]
        ),
        r"periodic along both axes, or plane strain, got periodic=\(True, False\) with \(8, 8\) cells in subsurface",
    ),
    "heat on a periodic grid": (
        lambda: rub(grid=PERIODIC, thermal=jc.Thermal(373.0, 46.0)),
        r"grid: expected a grid that is not periodic: rub with thermal supports free space only",
    ),
    "notes of what is not computed yet": (
        lambda: jax.eval_shape(indent).notes,
        r"notes: expected a result with known values, got one traced by jit, vmap or grad; read them outside",
    ),
    "notes of stresses that are not computed yet": (
        lambda: jax.eval_shape(lambda: jc.subsurface(BODY, GRID, np.ones((8, 8)), depths=[0.0])).notes,
        r"notes: expected fields with known values, got fields traced",
    ),
    "a name for the body of a picture": (
        lambda: jax.eval_shape(indent).plot("steel"),
        r"body: expected a LayeredHalfSpace or None, got str",
    ),
    "depths for the stresses of a picture": (
        lambda: jax.eval_shape(indent).plot(BODY, [1e-6]),
        r"inside: expected the result of subsurface or None, got list",
    ),
    "a material for the indenter of a picture": (
        lambda: jax.eval_shape(indent).plot(indenter=BODY),
        r"indenter: expected an indenter such as Sphere or None, got LayeredHalfSpace",
    ),
    "a rough line": (
        lambda: rough(grid=LINE),
        r"grid: expected a known spacing and more than one cell",
    ),
    "a surface without dimension": (lambda: rough(hurst=1.2), r"hurst: expected > 0 and <= 1, got 1.2"),
    "a negative slope": (lambda: rough(rms_slope=-0.1), r"rms_slope: expected >= 0, got -0.1"),
    "waves shorter than cells": (lambda: rough(shortest=1e-6), r"shortest \[m\]: expected > .* got 1e-06"),
    "waves longer than the grid": (lambda: rough(longest=1.0), r"longest \[m\]: expected > .* got 1"),
    "half a seed": (lambda: rough(seed=0.5), r"seed: expected 0 to 4294967295, got 0.5"),
    "an output without a name": (
        lambda: jc.sensitivity(lambda body: 1.0, BODY),
        r"f: expected a dict of outputs by name",
    ),
    "a number for a function": (
        lambda: jc.NumpyFunction(1.0),
        r"f: expected a function of a dict.*, got float",
    ),
    "a function of numbers without names": (
        lambda: jc.NumpyFunction(lambda x: x["a"]).apply({"a": 1.0}),
        r"f: expected a dict of outputs by name, got an array",
    ),
    "inputs without names": (
        lambda: TWICE.apply([1.0]),
        r"inputs: expected a dict of numbers by name, got list",
    ),
    "text for a number": (
        lambda: TWICE.apply({"a": "one"}),
        r"inputs: expected a number or an array for a, got str",
    ),
    "masked inputs": (
        lambda: TWICE.apply({"a": np.ma.masked_greater([1.0, 2.0], 1.5)}),
        r"inputs: a: expected numbers without masked entries, got 1 masked of 2",
    ),
    "a cotangent of no output": (
        lambda: TWICE.vjp({"a": 1.0}, {"c": 1.0}),
        r"cotangents: expected names among b, n, got c",
    ),
    "a cotangent of a status": (
        lambda: TWICE.vjp({"a": 1.0}, {"n": 1.0}),
        r"cotangents: expected those of real outputs, got n of int",
    ),
    "a cotangent of another shape": (
        lambda: TWICE.vjp({"a": [1.0, 2.0]}, {"b": 1.0}),
        r"cotangents: expected shape \(2,\) for b, got \(\)",
    ),
    "a list for a result": (
        lambda: jc.write_result([1.0], "a.npz"),
        r"result: expected ContactHistory.*got list",
    ),
    "a result as text": (
        lambda: jc.read_result("result.txt"),
        r"result.txt: found .txt, accepted: .* in .npz or .nc",
    ),
}
