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
    for part in ("tangential_force", "power", "truncation_bound"):
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
    found["fit: values"] = [v for v in fit.values.values() if np.isfinite(v)]
    found["fit: intervals"] = [v for pair in fit.intervals.values() for v in pair if np.isfinite(v)]
    return found


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
