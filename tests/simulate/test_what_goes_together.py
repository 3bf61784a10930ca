"""The table of Limitations: which body, interface and grid each verb takes, with each of the options.

Every cell is a call. One with "yes" is traced, which runs all checks and builds all programs without compiling them, and
with values that stay known although the trace has others: a check that computes with jax would fail there.
"""

import re
import warnings
from pathlib import Path

import jax
import numpy as np
import pytest

import jaxcontact as jc
from tests.support.bodies import STEEL

DOCS = Path(__file__).parents[2] / "docs/limits.md"
N, WIDTH = 8, 1.6e-3
TIMES = np.array([0.0, 1.0])
SOLID = jc.StandardLinearSolid(G1=2e6, G2=1e6, eta2=1e6, nu=0.4)
ATTRACTION = jc.ExponentialAdhesion(work=0.05, range=1e-5)
HEAT = jc.Thermal(300.0, 0.2, share=0.5, diffusivity=1e-7, shift=jc.ArrheniusShift(8e-20, 300.0))
PATCHY = 1e-4 * np.tile(1.0 + 0.1 * np.sin(np.arange(N))[:, None], (1, N))

on_steel = lambda *layers: jc.LayeredHalfSpace(list(layers), STEEL)
BODIES = {
    "half-space that creeps": jc.LayeredHalfSpace([], SOLID),
    "several layers": on_steel(jc.Layer(SOLID, 1e-4), jc.Layer(jc.Elastic(G=3e6, nu=0.3), 2e-4)),
    "`Graded` layer": on_steel(jc.Graded(lambda depth: jc.Elastic(G=1e6 + 1e9 * depth, nu=0.3), 1e-4)),
    "loose layer (`bonded=False`)": on_steel(jc.Layer(SOLID, 1e-4, bonded=False)),
    "rigid base (`substrate=None`)": jc.LayeredHalfSpace([jc.Layer(SOLID, 1e-4)], None),
    "thickness given over time": on_steel(jc.Layer(SOLID, np.array([1e-4, 1.1e-4]))),
    "thickness that varies in the plane": on_steel(jc.Layer(SOLID, PATCHY)),
}
FILM = on_steel(jc.Layer(SOLID, 1e-4))
INDENTERS = {
    "indenter that creeps": jc.Sphere(5e-3, material=SOLID),
    "coated indenter": jc.Sphere(5e-3, material=on_steel(jc.Layer(SOLID, 5e-5))),
}
CELL = (WIDTH / N, WIDTH / N)
GRIDS = {
    "grid periodic along both axes": jc.Grid((N, N), CELL, periodic=True),
    "grid periodic along y alone": jc.Grid((N, N), CELL, periodic=(False, True)),
    "plane strain": jc.Grid((N, 1), CELL, periodic=(False, True)),
}
OPTIONS = {
    "`friction`": {"friction": 0.3},
    "`adhesion`": {"adhesion": ATTRACTION},
    "`adhesion` with `shear_strength`": {"adhesion": ATTRACTION, "shear_strength": 1e3},
    "`hardness`": {"hardness": 5e4},
    "`thermal` with a shift": {"thermal": HEAT, "friction": 0.3},
}


def called(verb: str, row: str) -> object:
    """Call a verb in the case of a row of the table."""
    body = BODIES.get(row, FILM)
    grid = GRIDS.get(row, jc.Grid((N, N), CELL))
    ball = jc.Cylinder(5e-3, length=8 * WIDTH) if row == "plane strain" else jc.Sphere(5e-3)
    indenter, options = INDENTERS.get(row, ball), dict(OPTIONS.get(row, {}))
    load = jc.Load(0.01)
    if verb == "indent":
        return jc.indent(body, indenter, load, TIMES, grid=grid, **options)
    if verb == "slide":
        return jc.slide(body, indenter, load, TIMES, velocity=1e-4, grid=grid, **options)
    if verb == "slide_steady":
        return jc.slide_steady(body, indenter, load, velocity=1e-4, grid=grid, **options)
    if verb == "shear":
        options = {"friction": 0.3} | options | ({"coupled": False} if "adhesion" in options else {})
        path = jc.TangentialDisplacement(np.array([0.0, 1e-6]))
        return jc.shear(body, indenter, load, path, TIMES, grid=grid, **options)
    if verb == "roll_steady":
        options = {"friction": 0.3} | options
        return jc.roll_steady(body, indenter, load, velocity=1e-2, creepage=(1e-3, 0.0), grid=grid, **options)
    if verb == "rub":
        options = {"friction": 0.3} | options
        return jc.rub(body, indenter, load, TIMES, velocity=0.1, law=jc.Archard(1e-12), grid=grid, **options)
    pressure = np.zeros((2, *grid.shape))
    pressure[:, N // 2, grid.shape[1] // 2] = 1e5
    if verb == "deflection":
        return jc.deflection(body, grid, pressure, TIMES, velocity=1e-4, **options)
    if "friction" in options:
        options["traction"] = options.pop("friction") * np.stack([pressure, 0.0 * pressure], 1)
    if row in INDENTERS:
        options["indenter"] = indenter
    return jc.subsurface(body, grid, pressure, depths=np.array([1e-5]), times=TIMES, **options)


def cells() -> list[tuple[str, str, bool]]:
    """Return row, verb and whether it is taken, of each cell of the table."""
    lines = DOCS.read_text(encoding="utf-8").split("## What goes together")[1].split("\n## ")[0]
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in re.findall(r"^\|.*\|$", lines, re.M)
    ]
    verbs = [name.strip("`") for name in rows[0][1:]]
    return [
        (row, verb, word.startswith("yes"))
        for row, *words in rows[2:]
        for verb, word in zip(verbs, words, strict=True)
    ]


def test_the_table_has_every_case():
    assert {row for row, *_ in cells()} == {*BODIES, *INDENTERS, *GRIDS, *OPTIONS}
    verbs = "indent slide slide_steady shear roll_steady rub subsurface deflection"
    assert {verb for _, verb, _ in cells()} == set(verbs.split())


@pytest.mark.parametrize("row, verb", [(row, verb) for row, verb, taken in cells() if not taken])
def test_what_is_not_taken_is_refused(row, verb):
    if row in INDENTERS and verb == "deflection":
        return  # which has no indenter
    with pytest.raises((ValueError, TypeError), match=r"expected|unexpected keyword argument"):
        called(verb, row)


@pytest.mark.slow
@pytest.mark.parametrize("row, verb", [(row, verb) for row, verb, taken in cells() if taken])
def test_what_is_taken_runs_inside_a_trace(row, verb):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        shapes = jax.eval_shape(lambda: jax.tree.leaves(called(verb, row)))
    assert shapes
