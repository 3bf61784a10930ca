"""Every error of user input that jaxcontact can raise, in one table, read as a newcomer would.

Each row is a mistake and the words that must come back. ``test_no_error_is_missing_from_the_table`` finds every place
of the package that raises and fails for one that no row reaches.
"""

import ast
import re
import sys
import traceback
from pathlib import Path
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact.files.case_file import CaseError, read_case

PACKAGE = Path(jc.__file__).parent
STEEL, FILM = jc.Elastic.from_young(210e9), jc.Burgers(0.75e9, 13.89e6, 3.1486e12, 120.9e9)
BODY = jc.LayeredHalfSpace([jc.Layer(FILM, 150e-9)], STEEL)
FLOWS = jc.LayeredHalfSpace([], FILM)
BALL, LOAD, TIMES, GRID = jc.Sphere(9.5e-3), jc.Load(60.0), np.array([0.0, 1.0]), jc.Grid.square(8, 600e-6)
PERIODIC = jc.Grid(GRID.shape, GRID.spacing, periodic=True)
LINE = jc.Grid((8, 1), GRID.spacing, periodic=(False, True))
STEEL_BALL, ROLLER = jc.Sphere(9.5e-3, STEEL), jc.Cylinder(9.5e-3, length=1e-3)
KERNELS = jc.Burgers  # never looked at


def indent(body=BODY, indenter=BALL, control=LOAD, times=TIMES, grid=GRID, **keywords):
    return jc.indent(body, indenter, control, times, grid=grid, **keywords)


def slide(velocity, control=LOAD, times=TIMES, **keywords):
    return jc.slide(BODY, BALL, control, times, velocity=velocity, grid=GRID, **keywords)


def steady(velocity, body=BODY, control=LOAD, indenter=BALL, **keywords):
    return jc.slide_steady(body, indenter, control, velocity=velocity, **{"grid": GRID} | keywords)


def on_steel():
    return jc.LayeredHalfSpace([], STEEL)


def shear(tangential=jc.TangentialLoad((1.0, 0.0)), body=FLOWS, friction=0.3, **keywords):  # noqa: B008
    given = {"friction": friction, "grid": GRID} | keywords
    return jc.shear(body, STEEL_BALL, LOAD, tangential, TIMES, **given)


def roll(creepage=(1e-3, 0.0), velocity=1.0, control=LOAD, body=on_steel, indenter=BALL, **keywords):
    given = {"friction": 0.3, "grid": GRID} | keywords
    return jc.roll_steady(body(), indenter, control, velocity=velocity, creepage=creepage, **given)


def rough(grid=GRID, **keywords):
    return jc.self_affine(grid, **{"shortest": 2e-4, "longest": 5e-4} | keywords)


DRAWN = SimpleNamespace(pressure=np.eye(8), gap=1.0 - np.eye(8), grid=GRID, status=np.array(0))


def on(material):
    return jc.LayeredHalfSpace([], material)


PYTHON = {
    "a material for a body": (lambda: indent(body=FILM), r"body: expected a LayeredHalfSpace, got Burgers"),
    "a layer outside a list": (
        lambda: indent(body=jc.LayeredHalfSpace(jc.Layer(FILM, 1e-7), STEEL)),
        r"expected a list of Layer, got Layer",
    ),
    "a material for a layer": (
        lambda: indent(body=jc.LayeredHalfSpace([FILM], STEEL)),
        r"expected Layer\(.*Burgers",
    ),
    "a film too stiff for its images": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9), 1e-6)], jc.Elastic(2e2))),
        r"layer: expected at most 1e\+06 times the substrate's modulus, got 5e\+06 times",
    ),
    "a thickness over the plane": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Layer(FILM, np.full((8, 8), 1e-7))], STEEL)),
        r"layer thickness \[m\]: expected a number, got shape \(8, 8\): a response belongs to one thickness everywhere\."
        r" Give the film's mean here and its uneven top as the heights of a HeightField",
    ),
    "a thickness over other times": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Layer(FILM, np.full(3, 1e-7))], STEEL)),
        r"layer thickness \[m\]: expected a number or shape \(2,\) as times, got \(3,\)",
    ),
    "a thickness that vanishes": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Layer(FILM, [1e-7, 0.0])], STEEL)),
        r"layer thickness \[m\]: expected > 0",
    ),
    "the quasi-elastic way for a film that grows": (
        lambda: indent(
            body=jc.LayeredHalfSpace([jc.Layer(FILM, [1e-7, 2e-7])], STEEL), correspondence="quasi-elastic"
        ),
        r"layer thickness over times: expected no kernels",
    ),
    "a film that grows under what slides": (
        lambda: steady(1.0, body=jc.LayeredHalfSpace([jc.Layer(FILM, [1e-7, 2e-7])], STEEL)),
        r"layer thickness \[m\]: expected a number, got shape \(2,\); over times it is for a Layer in indent",
    ),
    "a material for a profile": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Graded(FILM, 1e-7)], STEEL)),
        r"Graded profile: expected a function of depth, got Burgers",
    ),
    "no sublayers": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Graded(lambda depth: FILM, 1e-7, layers=0)], STEEL)),
        r"Graded layers: expected 1 to 1000, got 0",
    ),
    "a number for a material": (
        lambda: indent(body=on(210e9)),
        r"substrate: expected a material .*got float",
    ),
    "a negative thickness": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Layer(FILM, -1e-7)], STEEL)),
        r"thickness \[m\]: .*> 0, got -1e-07",
    ),
    "a negative modulus": (
        lambda: indent(body=on(jc.Elastic(-1.0))),
        r"substrate Elastic G: expected > 0, got -1",
    ),
    "a negative compliance": (
        lambda: indent(body=on(jc.Prony(-1.0, jnp.ones(1), jnp.ones(1)))),
        r"Prony J0: expected >= 0, got -1",
    ),
    "nu above one half": (
        lambda: indent(body=on(jc.Elastic(1e9, nu=0.6))),
        r"nu: expected -1 < nu <= 0.5, got 0.6",
    ),
    "a fractional law that is not cut": (
        lambda: indent(body=on(jc.Springpot(1e9, 0.5))),
        r"got Springpot: its prony\(shortest, longest\) is one",
    ),
    "a cut from no time": (lambda: jc.Springpot(1e9, 0.5).prony(0.0, 1.0), r"shortest: expected > 0, got 0"),
    "a cut backwards": (
        lambda: jc.Springpot(1e9, 0.5).prony(1.0, 1.0),
        r"longest: expected more than shortest = 1 s, got 1",
    ),
    "a cut by half": (
        lambda: jc.Springpot(1e9, 0.5).prony(1.0, 2.0, 0.5),
        r"tolerance: expected > .*, got 0.5",
    ),
    "a springpot below zero": (
        lambda: jc.Springpot(-1e9, 0.5).prony(1.0, 2.0),
        r"V: expected > 0, got -1e\+09",
    ),
    "a springpot that is a dashpot": (
        lambda: jc.Springpot(1e9, 1.0).prony(1.0, 2.0),
        r"alpha: expected > 0 and <= 0.999, got 1",
    ),
    "nu and a bulk modulus": (
        lambda: indent(body=on(jc.Elastic(1e9, nu=0.3, bulk_modulus=1e9))),
        r"substrate Elastic: expected one of nu and bulk_modulus, got both",
    ),
    "neither nu nor a bulk modulus": (
        lambda: indent(body=on(jc.Elastic(1e9, nu=None))),
        r"expected one of nu and bulk_modulus, got neither",
    ),
    "a bulk modulus below zero": (
        lambda: indent(body=on(jc.Elastic(1e9, bulk_modulus=-1e9))),
        r"Elastic bulk_modulus: expected > 0, got -1e\+09",
    ),
    "a bulk modulus the quasi-elastic way": (
        lambda: indent(body=on(jc.Maxwell(1e9, 1e9, bulk_modulus=1e9)), correspondence="quasi-elastic"),
        r'correspondence: expected "exact" with a bulk modulus',
    ),
    "times of a Prony series": (
        lambda: indent(body=on(jc.Prony(1.0, jnp.ones(2), jnp.ones(1)))),
        r"expected J and tau of one shape",
    ),
    "a number for an indenter": (lambda: indent(indenter=9.5e-3), r"indenter: expected a Sphere.*got float"),
    "a negative radius": (lambda: indent(indenter=jc.Sphere(-1.0)), r"radius \[m\]: expected > 0, got -1"),
    "a cylinder's radius": (
        lambda: indent(indenter=jc.Cylinder(0.0, 1.0)),
        r"cylinder radius \[m\]: expected > 0",
    ),
    "a cylinder's length": (
        lambda: indent(indenter=jc.Cylinder(1.0, 0.0)),
        r"cylinder length \[m\]: expected > 0",
    ),
    "a cone as blunt as a plane": (lambda: indent(indenter=jc.Cone(2.0)), r"cone pi/2 - half-angle \[rad\]"),
    "a punch's radius": (
        lambda: indent(indenter=jc.FlatPunch(jnp.nan)),
        r"punch radius \[m\]: expected > 0, got nan",
    ),
    "a creeping ball": (
        lambda: indent(indenter=jc.Sphere(1.0, FILM)),
        r"indenter material: expected Elastic or None",
    ),
    "heights of another grid": (
        lambda: indent(indenter=jc.HeightField(jnp.zeros((4, 4)))),
        r"expected shape \(8, 8\)",
    ),
    "a number for a control": (lambda: indent(control=60.0), r"control: expected Load or Approach, got 60.0"),
    "a load of another length": (
        lambda: indent(control=jc.Load([1.0, 2.0, 3.0])),
        r"number or shape \(2,\) as times",
    ),
    "an infinite load": (lambda: indent(control=jc.Load(np.inf)), r"Load \[N\]: expected >= 0, got inf"),
    "a negative load": (lambda: indent(control=jc.Load(-1.0)), r"Load \[N\]: expected >= 0, got -1"),
    "no load at all": (lambda: indent(control=jc.Load(0.0)), r"expected > 0 at some time, got 0"),
    "one time, not in an array": (
        lambda: indent(times=7200.0),
        r"times \[s\]: expected a 1-d array .* shape \(\)",
    ),
    "times that decrease": (
        lambda: indent(times=[0.0, 2.0, 1.0]),
        r"times that do not decrease, got \[0.0, 2.0, 1.0\]",
    ),
    "a number for a grid": (lambda: indent(grid=256), r"grid: expected a Grid, got int"),
    "a grid of three axes": (
        lambda: indent(grid=jc.Grid((4, 4, 4), (1.0, 1.0))),
        r"expected two whole numbers",
    ),
    "one spacing": (lambda: indent(grid=jc.Grid((4, 4), (1.0,))), r"grid spacing: expected \(dx, dy\)"),
    "a negative spacing": (
        lambda: indent(grid=jc.Grid((4, 4), (1.0, -1.0))),
        r"grid spacing \[m\]: expected > 1e-30",
    ),
    "a word for save": (
        lambda: indent(save="first"),
        r"""save: expected "all", "last" or a function, got 'first'""",
    ),
    "no substeps": (lambda: indent(substeps=0), r"substeps: expected 1 to 1000, got 0"),
    "a word for checkpoint": (
        lambda: indent(checkpoint="bloks"),
        r"""checkpoint: expected "pressures" or "blocks", got 'bloks'""",
    ),
    "kernels of other cells across": (
        lambda: indent(kernels=jc.kernels(BODY, BALL, jc.Grid((8, 8), (75e-6, 150e-6)))),
        r"kernels: expected those of cells of \(7.5e-05, 7.5e-05\) m, got \(7.5e-05, 0.00015\)",
    ),
    "kernels of another shape": (
        lambda: indent(kernels=jc.kernels(BODY, BALL, jc.Grid((8, 9), GRID.spacing))),
        r"kernels: expected those of a grid of \(8, 8\) cells, got \(8, 9\)",
    ),
    "heights with a gap": (
        lambda: indent(indenter=jc.HeightField(np.where(np.eye(8) > 0, np.nan, 0.0))),
        r"heights \[m\]: expected finite numbers, got 64 values from 0 to 0, 8 of them not finite",
    ),
    "a punch smaller than a cell": (
        lambda: indent(indenter=jc.FlatPunch(1e-9)),
        r"punch radius \[m\]: expected to cover a cell's centre, cells are 7.5e-05 m, got 1e-09",
    ),
    "a cylinder shorter than a cell": (
        lambda: indent(indenter=jc.Cylinder(1e-2, 1e-9)),
        r"cylinder length \[m\]: expected to cover",
    ),
    "a tolerance that says nothing": (
        lambda: indent(tolerance=10.0),
        r"tolerance: expected > 0 and <= 0.01, got 10",
    ),
    "no iterations": (lambda: indent(max_iterations=0), r"max_iterations: expected 1 to 1000000000, got 0"),
    "a grid of no size that can be multiplied": (
        lambda: indent(grid=jc.Grid.square(8, 1e100)),
        r"grid spacing \[m\]: expected > 1e-30 and <= 1e\+30",
    ),
    "a modulus for each of several films": (
        lambda: indent(body=on(jc.Elastic(np.array([1e9, 2e9])))),
        r"substrate Elastic G: expected a number, got shape \(2,\)",
    ),
    "an approach without a value": (
        lambda: indent(control=jc.Approach(np.nan)),
        r"Approach \[m\]: expected finite numbers, got nan",
    ),
    "kernels of wider cells": (
        lambda: indent(kernels=jc.kernels(BODY, BALL, jc.Grid.square(GRID.shape[0], 2 * GRID.width[0]))),
        "kernels: expected those of cells of",
    ),
    "statistics of what is no contact": (
        lambda: jc.contact_statistics(BALL),
        r"result: expected that of indent, slide, slide_steady, \.\.\., got Sphere",
    ),
    "a histogram without bins": (
        lambda: jc.pressure_histogram(DRAWN, bins=0),
        r"bins: expected 1 to 10000, got 0",
    ),
    "patches at a time that is not there": (
        lambda: jc.contact_clusters(DRAWN, step=1),
        r"step: expected -1 to 0, got 1",
    ),
    "patches of many runs": (
        lambda: jc.contact_clusters(SimpleNamespace(**vars(DRAWN) | {"status": np.zeros(2)})),
        r"result: expected that of one run, outside jit, got a status of shape \(2,\)",
    ),
    "statistics of heights of another grid": (
        lambda: jc.surface_statistics(np.zeros((4, 8)), GRID),
        r"heights: expected shape \(8, 8\), got \(4, 8\)",
    ),
    "statistics of heights with a gap": (
        lambda: jc.surface_statistics(np.where(np.eye(8) > 0, np.nan, 0.0), GRID),
        r"heights \[m\]: expected finite numbers",
    ),
    "statistics of a line of heights": (
        lambda: jc.surface_statistics(np.zeros((8, 1)), LINE),
        r"heights, grid: expected known ones with more than one cell along y, got \(8, 1\) cells",
    ),
    "a word for correspondence": (
        lambda: indent(correspondence="fast"),
        r"""or "quasi-elastic", got 'fast'""",
    ),
    "a rigid ball on Kelvin-Voigt": (
        lambda: indent(body=on(jc.KelvinVoigt(1.0, 1.0))),
        r"expected an elastic indenter",
    ),
    "kernels, quasi-elastic": (
        lambda: indent(correspondence="quasi-elastic", kernels=KERNELS),
        r"""kernels: expected correspondence="exact" """,
    ),
    "too many nodes": (lambda: jc.kernels(BODY, BALL, GRID, nodes=9), r"nodes: expected 1 to 8, got 9"),
    "a grid without cells": (
        lambda: jc.Grid.square(0, 1.0),
        r"n: expected a whole number of at least 4, got 0",
    ),
    "a word for a grid": (
        lambda: jc.indent(BODY, BALL, LOAD, TIMES, grid="wide"),
        r"grid: expected a Grid, or \"auto\" without kernels, got 'wide'",
    ),
    "a grid of its own under jit": (
        lambda: jax.jit(lambda w: jc.indent(BODY, BALL, jc.Load(w), TIMES, grid="auto").load)(1.0),
        r"grid: expected a Grid inside jit, vmap and grad, got \"auto\"",
    ),
    "Grid.around under vmap": (
        lambda: jax.vmap(lambda w: jc.Grid.around(BODY, BALL, jc.Load(w), TIMES).spacing[0])(jnp.ones(2)),
        "Grid.around: expected values that are known, got some that jit, vmap or grad trace",
    ),
    "a number in Grid.around": (
        lambda: jc.Grid.around(BODY, BALL, 60.0, TIMES),
        r"control: .*order body.*got float",
    ),
    "a grid around nothing": (
        lambda: jc.Grid.around(BODY, BALL, jc.Approach(-1.0), TIMES),
        r"approach > 0 at some time",
    ),
    "a grid around heights": (
        lambda: jc.Grid.around(BODY, jc.HeightField(jnp.zeros((4, 4))), LOAD, TIMES),
        r"expected Grid\(shape=heights.shape",
    ),
    "a negative wavenumber": (lambda: jc.normal_response(BODY, -1.0), r"k \[rad/m\]: expected >= 0, got -1"),
    "a negative time": (lambda: jc.normal_response(BODY, 1.0, -1.0), r"t \[s\]: expected >= 0, got -1"),
    "a wavevector without end": (
        lambda: jc.frequency_response(BODY, np.inf, 0.0),
        r"kx \[rad/m\]: expected finite numbers, got inf",
    ),
    "half a wavevector": (
        lambda: jc.frequency_response(BODY, 1.0, np.nan),
        r"ky \[rad/m\]: expected finite numbers, got nan",
    ),
    "a wave before its time": (
        lambda: jc.frequency_response(BODY, 1.0, 1.0, -1.0),
        r"t \[s\]: expected >= 0",
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
    "a function of steps with friction": (
        lambda: shear(save=lambda step: step.load),
        r'save: expected "all" or "last"',
    ),
    "pressure on another grid": (
        lambda: jc.subsurface(BODY, GRID, np.ones(3), depths=[0.0]),
        r"pressure: expected shape \(8, 8\), got \(3,\)",
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
    "friction over the plane in sliding": (
        lambda: steady(1.0, friction=np.full((8, 8), 0.3)),
        r"friction: expected a number, got shape \(8, 8\)",
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
        r"grid: expected one that is not periodic along x, .* in shear, got periodic=\(True, True\)",
    ),
    "rolling on a periodic grid": (lambda: roll(grid=PERIODIC), r"not periodic along x, .* in roll_steady"),
    "rolling on a grid periodic across": (
        lambda: roll(grid=jc.Grid((8, 8), (1e-6, 1e-6), periodic=(False, True))),
        r"along y in plane strain alone, in roll_steady, got periodic=\(False, True\) with \(8, 8\) cells",
    ),
    "stresses under a periodic grid": (
        lambda: jc.subsurface(BODY, PERIODIC, np.ones((8, 8)), depths=[0.0]),
        r"not periodic in subsurface",
    ),
    "a rough line": (
        lambda: rough(grid=LINE),
        r"grid: expected one of known spacing with more than one cell",
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
    "a list for a result": (lambda: jc.save([1.0], "a.npz"), r"result: expected ContactHistory.*got list"),
    "a result as text": (
        lambda: jc.load("result.txt"),
        r"result.txt: found .txt, accepted: .* in .npz or .nc",
    ),
}


@pytest.mark.parametrize("name", PYTHON)
def test_a_mistake_in_python_is_named_with_what_was_expected_and_what_came(name):
    mistake, words = PYTHON[name]
    with pytest.raises(ValueError, match=words) as caught:
        mistake()
    assert_reads_well(str(caught.value))


def assert_reads_well(message):
    """One line, not long, that says what would be right; no traceback's jargon."""
    assert "\n" not in message and len(message) < 320, message
    assert re.search(r"expected|accepted|did you mean|overwrites|pass |install", message), message
    assert not re.search(r"Traceback|NoneType|Tracer|object at 0x", message), message


CASE = """
[layer]
material = "burgers"
G1 = 0.75e9
G2 = 13.89e6
eta1 = 3.1486e12
eta2 = 120.9e9
thickness = 150e-9
[substrate]
material = "elastic"
E = 210e9
[indenter]
shape = "sphere"
radius = 9.525e-3
[control]
load = 10.0
[times]
end = 600.0
steps = 6
[grid]
n = 32
width = 300e-6
"""
PRONY = 'material = "prony"\nJ0 = 1.0\nJ = [1.0, 2.0]\ntau = [1.0]\n'
LAYER = CASE[CASE.index('material = "burgers"') : CASE.index("thickness")]
BALL_TEXT = 'shape = "sphere"\nradius = 9.525e-3'
FILES = {
    "not TOML": ("[grid]", "[grid", r"not TOML: "),
    "a typo": ("thickness", "thicknes", r'layer.thicknes: unknown key; did you mean "thickness"\?'),
    "a typo in a section": ("[grid]", "[gird]", r'\[gird\]: unknown key; did you mean "grid"\?'),
    "both laws of volume": (
        "thickness",
        "nu = 0.3\nbulk_modulus = 1e9\nthickness",
        r"layer.nu: found both nu and bulk_modulus; accepted: one of them",
    ),
    "text for a number": ("10.0", '"ten"', r'control.load: found "ten", accepted: a number > 0'),
    "a missing key": (
        "thickness = 150e-9",
        "",
        r"layer.thickness: missing; accepted: a number > 0, from 1e-30 to 1e\+30: thickness \[m\]",
    ),
    "an unknown material": (
        '"elastic"',
        '"steel"',
        r'substrate.material: found "steel", accepted: "elastic" \|',
    ),
    "both G and E": (
        "E = 210e9",
        "E = 210e9\nG = 80e9",
        r"substrate.G: found both G and E; accepted: one of them",
    ),
    "neither G nor E": ("E = 210e9", "", r"found neither G and E; accepted: one of them"),
    "a Prony series": (LAYER, PRONY, r"layer.tau: found 1 for 2 in J; accepted: as many numbers as in J"),
    "no heights": (
        BALL_TEXT,
        'shape = "height-field"\nheights = "none.npy"',
        r"indenter.heights: .*No such file",
    ),
    "heights that are no array": (
        BALL_TEXT,
        'shape = "height-field"\nheights = "case.toml"',
        r"not a .npy file",
    ),
    "heights in a line": (
        BALL_TEXT,
        'shape = "height-field"\nheights = "line.npy"',
        r"not a two-dimensional array",
    ),
    "heights with holes": (
        BALL_TEXT,
        'shape = "height-field"\nheights = "holes.npy"',
        r"found values that are not finite",
    ),
    "no grid for heights": (
        f"{BALL_TEXT}|n = 32\nwidth = 300e-6",
        'shape = "height-field"\nheights = "good.npy"|',
        r"grid.shape: missing",
    ),
    "both controls": (
        "load = 10.0",
        "load = 10.0\napproach = 1e-6",
        r"\[control\]: found both load and approach",
    ),
    "a load of another length": (
        "10.0",
        "[1.0, 2.0]",
        r"control.load: found 2 values; accepted: a number, or 7 values",
    ),
    "times twice": (
        "end = 600.0",
        "values = [0.0]\nend = 1.0",
        r"times.values: found with end, steps; accepted: values alone",
    ),
    "no end": ("end = 600.0", "", r"times.end: missing"),
    "a first time": ("end = 600.0", "end = 600.0\nfirst = 1.0", r'accepted: with spacing = "logarithmic"'),
    "a late first time": (
        "end = 600.0",
        'end = 600.0\nspacing = "logarithmic"\nfirst = 1e3',
        r"times.first: found 1000, accepted: .* end = 600",
    ),
    "a shape alone": (
        "n = 32\nwidth = 300e-6",
        "shape = [32, 32]",
        r"grid.spacing: missing; accepted: \[dx, dy\]",
    ),
    "a shape and n": (
        "width = 300e-6",
        "shape = [8, 8]\nspacing = [1e-6, 1e-6]",
        r"grid.n: found with shape",
    ),
}


def also(experiment, words, control="", old="", new=""):
    """A row: an [experiment], what stands in [control] beside the load, and one more change."""
    return (
        f"[control]|load = 10.0|{old}",
        f"[experiment]\n{experiment}\n[control]|load = 10.0\n{control}|{new}",
        words,
    )


SHEAR, PUSH = 'kind = "shear"\nfriction = 0.3', "tangential_load = [1.0, 0.0]"
STEADY, NO_TIMES = 'kind = "steady-sliding"\nvelocity = 1.0', ("[times]\nend = 600.0\nsteps = 6\n", "")
FILES |= {
    "an unknown experiment": also(
        'kind = "rub"', r'experiment.kind: found "rub", accepted: "indentation" \| "shear"'
    ),
    "friction of an indentation": also(
        "friction = 0.3",
        r'experiment.friction: found with experiment.kind = "indentation", accepted: with "shear" or',
    ),
    "no friction in shear": also(
        'kind = "shear"', r"experiment.friction: missing; accepted: a number >= 0", PUSH
    ),
    "friction that pushes": also(
        'kind = "shear"\nfriction = -0.1', r"friction: found -0.1, accepted: a number >= 0", PUSH
    ),
    "friction in no file": also(
        'kind = "shear"\nfriction = "mu.npy"', r"experiment.friction: .*mu.npy: No such file", PUSH
    ),
    "a word for coupled": also(
        f'{SHEAR}\ncoupled = "no"', r'coupled: found "no", accepted: true or false', PUSH
    ),
    "shear without a push": also(
        SHEAR,
        r"\[control\]: found neither tangential_load nor tangential_displacement; accepted: one of tangential_load \[N\]",
    ),
    "a push without direction": also(
        SHEAR,
        r"control.tangential_load: found 5.0, accepted: \[x, y\], or a list of them",
        "tangential_load = 5.0",
    ),
    "two pushes for seven times": also(
        SHEAR,
        r"tangential_load: found 2 values; accepted: \[x, y\], or 7 values as times",
        "tangential_load = [[0.0, 0.0], [1.0, 0.0]]",
    ),
    "creepage in shear": also(
        SHEAR,
        r'control.creepage: found with experiment.kind = "shear", accepted: with "steady-rolling"',
        "creepage = [1.0, 0.0]",
    ),
    "sliding without velocity": also(
        'kind = "sliding"', r"experiment.velocity: missing; accepted: a number, along x"
    ),
    "a velocity in space": also(
        'kind = "sliding"\nvelocity = [1.0, 0.0, 0.0]',
        r"experiment.velocity: found \[1.0, 0.0, 0.0\], accepted: a number",
    ),
    "times of a steady state": also(
        STEADY,
        r'\[times\]: found with experiment.kind = "steady-sliding", accepted: with "indentation" or "shear"',
    ),
    "substeps of a steady state": also(
        STEADY,
        r'solver.substeps: found with experiment.kind = "steady-sliding"',
        "",
        NO_TIMES[0],
        "[solver]\nsubsteps = 2\n",
    ),
    "a load over the times of a steady state": also(
        STEADY,
        r"control.load: found \[10.0, 1.0\], accepted: a number > 0",
        "",
        f"{NO_TIMES[0]}|load = 10.0",
        "|load = [10.0, 1.0]",
    ),
    "a steady state that rolls by nothing": also(
        'kind = "steady-rolling"\nvelocity = 1.0\nfriction = 0.3',
        r"found neither creepage nor tangential_load; accepted: one of creepage and tangential_load \[N\]",
        "",
        *NO_TIMES,
    ),
    "a length for a load": (
        "load = 10.0",
        'load = "10 mm"',
        'control.load: found "10 mm", accepted: a number > 0.*normal load.*or text with a unit: "1 N", pN, nN',
    ),
    "a word for periodic": (
        "width = 300e-6",
        'periodic = "y"',
        r"periodic: found \"y\", accepted: true, false or \[x, y\]",
    ),
    "a periodic grid of no width": (
        "width = 300e-6",
        "periodic = true",
        r"grid.width: missing; accepted with periodic",
    ),
}


def written(name, folder):
    for file, values in {"line": [1.0], "holes": [[np.nan]], "good": [[1.0]]}.items():
        np.save(folder / f"{file}.npy", np.array(values))
    text, (old, new, words) = CASE, FILES[name]
    for a, b in zip(old.split("|"), new.split("|"), strict=True):
        assert a in text
        text = text.replace(a, b)
    (folder / "case.toml").write_text(text)
    return folder / "case.toml", words


@pytest.mark.parametrize("name", FILES)
def test_a_mistake_in_a_case_file_is_named_with_file_and_key(name, tmp_path):
    path, words = written(name, tmp_path)
    with pytest.raises(CaseError, match=words) as caught:
        read_case(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    if name != "not TOML":  # the parser's own words, with line and column
        assert_reads_well(message.replace(str(tmp_path), ""))


def shell(folder, *words):
    """The mistakes that only the command line can make; the files are there."""
    (folder / "case.toml").write_text(CASE)
    (folder / "kelvin.toml").write_text(
        '[substrate]\nmaterial = "kelvin-voigt"\nG = 1.0\neta = 1.0\n' + CASE[CASE.index("[indenter]") :]
    )
    far = '[experiment]\nkind = "sliding"\nvelocity = 1.0\n' + CASE
    (folder / "far.toml").write_text(far)
    (folder / "large.toml").write_text(CASE.replace("n = 32", "n = 65536"))
    (folder / "bad.npz").write_text("no arrays")
    np.savez(folder / "other.npz", a=1.0)
    np.savez(folder / "part.npz", kind="ContactHistory")
    np.savez(folder / "course.npz", times=[0.0], approach=[1e-6])
    for number, (sweep, _) in enumerate(STUDIES.values()):
        (folder / f"study_{number}.toml").write_text(f"{sweep}\n{CASE}")
    (folder / "full").mkdir(exist_ok=True)
    (folder / "full" / "mine.txt").write_text("mine")
    return main([str(folder / word[1:]) if word.startswith("@") else word for word in words])


STUDIES = {
    "a study of nothing": ("", r"\[sweep\]: missing; accepted: keys and their values"),
    "a number for a study": ("sweep = 1", r"\[sweep\]: found 1, accepted: a table"),
    "a key without its table": (
        "[sweep]\nload = [1.0]",
        r"sweep.load: unknown key; accepted: method, samples, seed,",
    ),
    "one value": (
        '[sweep]\n"control.load" = 1.0',
        r"sweep.control.load: found 1.0, accepted: a list of values, or",
    ),
    "no value": (
        '[sweep]\n"control.load" = []',
        r"sweep.control.load: found \[\], accepted: a list of values, or",
    ),
    "a range without count": (
        '[sweep]\n"control.load" = {from = 1, to = 2}',
        r"sweep.control.load.count: missing; accepted: a whole number from 2",
    ),
    "a range by steps": (
        '[sweep]\n"control.load" = {from = 1, to = 2, steps = 3}',
        r"sweep.control.load.steps: unknown key; accepted: from, to, count, log",
    ),
    "a range down": (
        '[sweep]\n"control.load" = {from = 2, to = 1, count = 3}',
        r"sweep.control.load: found 2 to 1, accepted: from < to",
    ),
    "a logarithm of nothing": (
        '[sweep]\n"control.load" = {from = 0, to = 1, count = 3, log = true}',
        r"found 0 to 1, accepted: 0 < from < to, since log = true",
    ),
    "samples of a grid": (
        '[sweep]\nsamples = 3\n"control.load" = [1.0]',
        r'sweep.samples: found with a grid, accepted: with method = "latin-hypercube"',
    ),
    "a hypercube of no size": (
        '[sweep]\nmethod = "latin-hypercube"\n"control.load" = [1.0]',
        r"sweep.samples: missing; accepted: a whole number from 1",
    ),
    "too many cases": (
        '[sweep]\n"control.load" = {from = 1, to = 2, count = 400}\n"grid.n" = {from = 1, to = 2, count = 400}',
        r"\[sweep\]: found 160000, accepted: up to 100000 cases",
    ),
    "a layer that is not there": (
        '[sweep]\n"layer[3].thickness" = [1e-6]',
        r"\[sweep\] layer\[3\].thickness = 1e-06: layer\[3\]: found no such table",
    ),
    "a value that no case takes": (
        '[sweep]\n"control.load" = [1.0, -1.0]',
        r"\[sweep\] control.load = -1.0: control.load: found -1.0, accepted: a number > 0",
    ),
}

SHELL = {
    **{
        name: (["sweep", f"@study_{i}.toml", "-o", "@out"], words)
        for i, (name, (_, words)) in enumerate(STUDIES.items())
    },
    "a study in a directory of others": (
        ["sweep", "film_map", "-o", "@full"],
        r"full: found a directory that is not empty, accepted: a new one, or that of this study",
    ),
    "a study to run": (
        ["run", "film_map", "-o", "@out"],
        r"\[sweep\]: found a study, accepted: by jaxcontact sweep",
    ),
    "processes without number": (
        ["sweep", "film_map", "-o", "@out", "--processes", "0"],
        r"processes: expected 1 to 10000, got 0",
    ),
    "no such case": (["run", "@none.toml", "-o", "@out"], r"none.toml: No such file.*expected a TOML file"),
    "no place for results": (["run", "@case.toml"], r"-o: missing; accepted: -o DIR"),
    "results into a file": (
        ["run", "@case.toml", "-o", "@case.toml"],
        r"found a file, accepted: a directory",
    ),
    "results over others": (["run", "@case.toml", "-o", "@full"], r"not empty; --force overwrites it"),
    "nothing to resume": (
        ["run", "@case.toml", "-o", "@full", "--resume"],
        r"found no unfinished run, accepted",
    ),
    "too large a run": (
        ["check", "@large.toml"],
        r"large.toml: grid: found .* GB of memory, accepted: up to .* GB",
    ),
    "what a run would refuse": (["check", "@kelvin.toml"], r"kelvin.toml: .*expected an elastic indenter"),
    "the same, run": (["run", "@kelvin.toml", "-o", "@out"], r"kelvin.toml: .*expected an elastic indenter"),
    "what its function would refuse": (
        ["check", "@far.toml"],
        r"far.toml: velocity: expected steps of at most 0.5 of the grid's width, got",
    ),
    "the same function, run": (["run", "@far.toml", "-o", "@out"], r"far.toml: velocity: expected steps of"),
    "a picture as text": (["plot", "@part.npz", "-o", "@a.txt"], r"found .txt, accepted: .pdf, .png, .svg"),
    "a picture over another": (["plot", "@case.npz", "-o", "@full.png"], r"is there already"),
    "a new case over another": (["new", "@full.png"], r"is there already"),
    "no such result": (["plot", "@none.npz"], r"No such file.*none.npz"),
    "a result that is none": (["plot", "@bad.npz"], r"not an npz file of arrays; accepted"),
    "somebody else's arrays": (["plot", "@other.npz"], r"found no result of jaxcontact; accepted"),
    "half a result": (["plot", "@part.npz"], r"times: missing; accepted"),
    "a course for a result": (
        ["plot", "@course.npz"],
        r"course.npz: found the course of a run.*numpy.load.*; accepted: the result.npz beside it",
    ),
    "a file over another": (["convert", "@other.npz", "-o", "@full.png"], r"is there already"),
    "no folder to write into": (
        ["convert", "@other.npz", "-o", "@none/film.nc"],
        r"found no folder .*none, accepted: a name in one that is there",
    ),
    "a film to be converted": (["convert", "@film.pvd", "-o", "@film.nc"], r"found .pvd, accepted"),
    "an unknown figure": (
        ["reproduce", "figure_99", "-o", "@out"],
        r"unknown case 'figure_99'; expected one of figure_4",
    ),
}


@pytest.mark.parametrize("name", SHELL)
def test_a_mistake_in_the_shell_is_one_line_and_status_2(name, tmp_path, capfd):
    words, answer = SHELL[name]
    (tmp_path / "full.png").write_text("mine")
    assert shell(tmp_path, *words) == 2
    out, err = capfd.readouterr()
    assert re.search(answer, err) and out == ""
    assert err.count("\n") == 1


CHECKS = (
    *("require", "positive", "non_negative", "poisson_ratio", "not_decreasing"),
    *("finite", "between", "whole", "one_of", "somewhere_positive"),
)
ELSEWHERE = {  # reached by no row, and why
    "_checks.py": "the checks themselves",
    **{
        f"surface_files.py: {name}": "test_surface_files.py" for name in ("read_surface", "_read", "_library")
    },
    "storage.py: _xarray": "test_storage.py, without the extra",
    "labels.py: extra": "test_summaries.py, without the extra",
    "results.py: _check_one": "test_summaries.py, many runs",
    **{
        f"studies.py: {name}": "test_studies.py"
        for name in ("sweep", "_checked", "_check_function", "_call", "__getitem__", "stacked")
    },
    **{
        f"storage.py: {name}": "test_storage.py, forged files"
        for name in ("_check_arrays", "_check_notes", "_check_axis", "_count_of_times", "_read_netcdf")
    },
    "npz.py: _members": "test_storage.py, forged files",
    "npz.py: _array": "test_storage.py, forged files",
    "kept_traces.py: reducer_override": "caught beside it: test_kept_traces.py",
    "interrupts.py: _raise": "needs a signal: test_command_line.py",
    "run_directory.py: locked": "needs two runs: test_command_line.py",
    "finished_steps.py: standing": "needs a stopped run: test_command_line.py",
    "sweep.py: run_study": "a folder of another study: test_study_files.py",
    "sweep.py: _executor": "without the extra",
    "sweep.py: figures": "test_study_files.py",
    "sweep.py: _trusted": "a solve that fails: test_study_files.py",
    "advice.py: check_disk": "needs a full disk: test_command_line.py",
    "sensitivities.py: plot": "needs a computed table: test_gradients.py",
    "case_file.py: _indenter": "a word of the schema",
    "results.py: peak_pressure": "an AttributeError: test_summaries.py",
}


def raising_places():
    """(file, first line, last line, function) of everything that raises or checks, but not within the oracles."""
    for path in PACKAGE.rglob("*.py"):
        if "reference" in path.parts or path.name == "_checks.py":
            continue
        functions = [
            node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)
        ]
        for function in functions:
            for node in ast.walk(function):
                called = node.func if isinstance(node, ast.Call) else None
                checks = getattr(called, "attr", getattr(called, "id", "")) in CHECKS
                if checks or (isinstance(node, ast.Raise) and node.exc is not None):
                    yield path.name, node.lineno, node.end_lineno, function.name


def test_no_error_is_missing_from_the_table(tmp_path, monkeypatch):
    reached = set()

    def note(error):
        while error is not None:
            frames = traceback.extract_tb(error.__traceback__)
            reached.update((Path(frame.filename).name, frame.lineno) for frame in frames)
            error = error.__cause__

    # main complains while it handles the error
    monkeypatch.setattr("jaxcontact.__main__.complain", lambda *_: note(sys.exc_info()[1]))

    (tmp_path / "full.png").write_text("mine")
    for mistake, _ in PYTHON.values():
        with pytest.raises(ValueError) as caught:
            mistake()
        note(caught.value)
    for name in FILES:
        with pytest.raises(CaseError) as caught:
            read_case(written(name, tmp_path)[0])
        note(caught.value)
    for words, _ in SHELL.values():
        shell(tmp_path, *words)
    missing = [
        f"{file}:{first} {function}"
        for file, first, last, function in raising_places()
        if not any((file, line) in reached for line in range(first, last + 1))
        and f"{file}: {function}" not in ELSEWHERE
    ]
    assert not missing, "\n".join(missing)
