"""Figures of runs through public names alone, to compare two commits: equal behaviour is equal to 1e-12.

    PYTHONPATH=OLD python tests/benchmarks/figures.py > old.json
    PYTHONPATH=NEW python tests/benchmarks/figures.py > new.json
    python tests/benchmarks/figures.py old.json new.json

The last command prints the largest relative difference of each figure, and fails above 1e-12.
"""

import json
import sys
import warnings
from pathlib import Path

import numpy as np

LIMIT = 1e-12


def figures() -> dict[str, list[float]]:
    import jax
    import jax.numpy as jnp

    import fitting
    import jaxcontact as jc

    steel = jc.Elastic.from_young(210e9, nu=0.3)
    film = jc.Burgers(G1=0.75e9, G2=13.89e6, eta1=3.1486e12, eta2=120.9e9, nu=0.3)
    body = jc.LayeredHalfSpace([jc.Layer(film, thickness=150e-9)], substrate=steel)
    ball = jc.Sphere(radius=9.525e-3, material=steel)
    found: dict[str, list[float]] = {}

    def add(name, result):
        for part in ("approach", "load", "iterations", "contact_area", "film_strain"):
            found[f"{name}: {part}"] = np.ravel(getattr(result, part)).tolist()
        p = np.asarray(result.pressure)
        found[f"{name}: peak pressure"] = np.ravel(p.max(axis=(-1, -2))).tolist()
        found[f"{name}: sum of p^2"] = np.ravel((p**2).sum(axis=(-1, -2))).tolist()

    times = jnp.linspace(0.0, 7200.0, 151)
    grid = jc.Grid.around(body, ball, jc.Load(60.0), times, n=256)
    add(
        "README's first command (film, 150 steps, 256 x 256)",
        jc.indent(body, ball, jc.Load(60.0), times, grid=grid),
    )
    for load in (10.0, 60.0, 500.0):
        at = np.zeros(1)
        around = jc.Grid.around(body, ball, jc.Load(load), at, n=128)
        add(f"film at once, {load:g} N", jc.indent(body, ball, jc.Load(load), at, grid=around))
    fixed = jc.Grid.square(n=256, width=620e-6)
    add("film, 150 steps, fixed grid", jc.indent(body, ball, jc.Load(60.0), times, grid=fixed, save="last"))
    maxwell = jc.LayeredHalfSpace([], jc.Maxwell(80.77e9, 80.77e9))
    wide, short = jc.Grid.square(64, 700e-6), jnp.linspace(0.0, 2.0, 21)
    add("Maxwell half-space", jc.indent(maxwell, jc.Sphere(3.5e-3), jc.Load(100.0), short, grid=wide))
    small = jc.Grid.square(64, 620e-6)
    held = jc.indent(body, ball, jc.Approach(2.55e-6), times[::15], grid=small, substeps=3)
    add("film, approach held", held)
    quasi = jc.indent(body, ball, jc.Load(60.0), times[::15], grid=small, correspondence="quasi-elastic")
    add("film, quasi-elastic", quasi)
    slid = jc.slide(body, ball, jc.Load(60.0), times[::15], velocity=0.4e-6, grid=small, substeps=4)
    add("slide", slid)
    for part in ("tangential_force", "power"):
        found[f"slide: {part}"] = np.ravel(getattr(slid, part)).tolist()
    oblique = jc.slide_steady(body, ball, jc.Load(60.0), velocity=(1e-6, 0.5e-6), grid=small)
    add("steady sliding", oblique)
    add(
        "steady half-space",
        jc.slide_steady(maxwell, jc.Sphere(3.5e-3), jc.Load(100.0), velocity=1e-4, grid=wide),
    )

    def peak(film):
        other = jc.LayeredHalfSpace([jc.Layer(film, thickness=150e-9)], substrate=steel)
        return jnp.max(jc.indent(other, ball, jc.Load(60.0), times[::15], grid=small, save="last").pressure)

    found["gradient of the last peak pressure"] = [float(v) for v in jax.tree.leaves(jax.grad(peak)(film))]
    t = np.linspace(10.0, 7200.0, 200)
    noise = 1.0 + 0.01 * np.random.default_rng(0).standard_normal(t.size)
    fit = fitting.fit_creep(
        fitting.CreepData(t=t, J=np.asarray(film.creep(t)) * noise), model=jc.Burgers, weights="relative"
    )
    fits = {"creep": fit} | other_fits()
    for name, one in fits.items():
        found[f"fit, {name}: values"] = [v for v in one.values.values() if np.isfinite(v)]
        found[f"fit, {name}: intervals"] = [
            v for pair in one.intervals.values() for v in pair if np.isfinite(v)
        ]
    return found | friction_and_stresses(body, ball)


def friction_and_stresses(body, ball) -> dict[str, list[float]]:
    """A shear loop, rolling of alike bodies, and stresses below the surface, on fixed grids."""
    import jaxcontact as jc

    grid, found = jc.Grid.square(48, 500e-6), {}
    strokes = 6e-6 * np.sin(np.linspace(0.0, 2.5 * np.pi, 11))
    loop = jc.shear(
        body, ball, jc.Load(60.0), jc.TangentialDisplacement(np.stack([strokes, 0.0 * strokes], -1)),
        np.linspace(0.0, 100.0, 11), friction=0.3, grid=grid, coupled=False,
    )  # fmt: skip
    traction = np.asarray(loop.traction)
    found["shear: tangential load"] = np.ravel(loop.tangential_load).tolist()
    found["shear: sum of traction^2"] = (traction**2).sum(axis=(1, 2, 3)).tolist()
    found["shear: cells that stick"] = np.asarray(loop.stick).sum(axis=(1, 2)).tolist()
    steel = jc.LayeredHalfSpace([], jc.Elastic.from_young(210e9, nu=0.3))
    rolled = jc.roll_steady(
        steel, ball, jc.Load(60.0), velocity=1.0, creepage=(5e-4, 0.0), friction=0.3, grid=jc.Grid.square(48, 260e-6)
    )  # fmt: skip
    found["rolling: sum of traction^2"] = (np.asarray(rolled.traction) ** 2).sum(axis=(1, 2)).tolist()
    pressed = jc.indent(body, ball, jc.Load(60.0), np.zeros(1), grid=grid, save="last").pressure
    depths = [50e-9, 150e-9, 5e-6, 60e-6]
    inside = jc.subsurface(body, grid, pressed, depths=depths)
    found["subsurface: largest von Mises"] = np.asarray(inside.von_mises).max(axis=(1, 2)).tolist()
    found["subsurface: sum of displacement^2"] = (
        (np.asarray(inside.displacement) ** 2).sum(axis=(1, 2, 3)).tolist()
    )
    return found


def other_fits() -> dict:
    """Fits of four further kinds of data."""
    import fitting
    import jaxcontact as jc

    random = np.random.default_rng(1)
    noisy = lambda y: np.asarray(y) * (1.0 + 0.01 * random.standard_normal(np.shape(y)))
    t, omega = np.geomspace(1.0, 1e4, 80), np.geomspace(1e-4, 1.0, 40)
    solid = jc.StandardLinearSolid(G1=1e6, G2=5e5, eta2=1e8, nu=0.3)
    G = np.asarray(solid.complex_modulus(omega))
    depth = (3 * 0.7 * np.asarray(solid.creep(t - t[0])) * 1e-2 / (8 * np.sqrt(1e-3))) ** (2 / 3)
    soft = jc.Sphere(radius=1e-3)
    return {
        "relaxation": fitting.fit_relaxation(
            fitting.RelaxationData(t=t, modulus=noisy(solid.relaxation(t))), weights="absolute"
        ),
        "oscillation": fitting.fit_oscillation(
            fitting.OscillationData(omega=omega, storage=noisy(G.real), loss=noisy(G.imag)), weights="absolute"
        ),
        "series": fitting.fit_prony(
            fitting.CreepData(t=t, J=noisy(solid.creep(t))), [30.0, 300.0, 3000.0], weights="absolute"
        ),
        "indentation": fitting.fit_indentation(
            fitting.IndentationData(t=t, load=np.full(t.size, 1e-2), depth=noisy(depth)),
            model=jc.StandardLinearSolid, indenter=soft, nu=0.3, weights="absolute",
        ),
    }  # fmt: skip


def compare(old: dict[str, list[float]], new: dict[str, list[float]]) -> bool:
    """Print the largest relative difference of each figure; whether all are below the limit."""
    assert old.keys() == new.keys()
    worst = 0.0
    for name, values in old.items():
        a, b = np.array(values), np.array(new[name])
        scale = np.max(np.abs(a)) or 1.0
        difference = float(np.max(np.abs(a - b)) / scale)
        worst = max(worst, difference)
        print(f"{difference:.1e}  {name}")
    print(f"worst {worst:.1e}, limit {LIMIT:g}")
    return worst <= LIMIT


if __name__ == "__main__":
    if len(sys.argv) == 3:
        sys.exit(not compare(*(json.loads(Path(path).read_text()) for path in sys.argv[1:])))
    warnings.simplefilter("ignore")
    json.dump(figures(), sys.stdout)
