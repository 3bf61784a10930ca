"""What mistakes are made with: a right call of each function, in which one thing is changed."""

from types import SimpleNamespace

import numpy as np
from bodies import BODY, FILM, STEEL

import jaxcontact as jc

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


def rub(
    body=BODY,
    law=jc.Archard(1e-18),  # noqa: B008
    velocity=0.1,
    indenter=BALL,
    times=TIMES,
    **keywords,
):
    given = {"grid": GRID} | keywords
    return jc.rub(body, indenter, LOAD, times, velocity=velocity, law=law, **given)


def varying(shape=(8, 8), value=1e-7, layers=1, substrate=STEEL):
    return jc.LayeredHalfSpace([jc.Layer(FILM, np.full(shape, value))] * layers, substrate)


def gel(bonded=False, thickness=1e-6, substrate=None):
    """A layer on a rigid base, loose as a rule."""
    return jc.LayeredHalfSpace([jc.Layer(FILM, thickness, bonded)], substrate)


def pressed(body=BODY, pressure=np.ones((8, 8)), times=TIMES, **keywords):  # noqa: B008
    return jc.deflection(body, GRID, pressure, times, **keywords)


def uneven(axis):
    """A film on steel whose thickness varies along one axis of ``GRID``."""
    thickness = 1e-7 + 1e-8 * np.arange(8.0)
    return jc.LayeredHalfSpace(
        [jc.Layer(FILM, np.broadcast_to(np.expand_dims(thickness, 1 - axis), (8, 8)))], STEEL
    )


def rough(grid=GRID, **keywords):
    return jc.self_affine(grid, **{"shortest": 2e-4, "longest": 5e-4} | keywords)


DRAWN = SimpleNamespace(
    pressure=np.eye(8), in_contact=np.eye(8) > 0.0, gap=1.0 - np.eye(8), grid=GRID, status=np.array(0)
)


def on(material):
    return jc.LayeredHalfSpace([], material)
