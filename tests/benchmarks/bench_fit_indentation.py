"""Times and runs of indentation fits: a half-space, and a film through the contact solver. Run as a script."""

import time
import warnings

import jax.numpy as jnp
import numpy as np

import fitting
import jaxcontact as jc
from tests.support.bodies import BALL, FILM, STEEL


def noisy(t, load, depth):
    return fitting.IndentationData(
        t=t, load=load, depth=depth * (1 + 0.005 * np.random.default_rng(0).standard_normal(t.size))
    )


def report(name, data, **options):
    for label in ("with compilation", "after compilation"):
        start = time.perf_counter()
        fit = fitting.fit_indentation(data, indenter=BALL, nu=0.3, weights="relative", **options)
        seconds = time.perf_counter() - start
        print(f"{name}, {label}: {seconds:.2f} s, {fit.runs[0]} forward and {fit.runs[1]} gradient runs")
    return fit


def main():
    for n in (200, 9000):
        t = np.linspace(0.0, 40000.0, n + 1)
        A = 0.7 * np.asarray(FILM.creep(t)) + float(BALL.compliance())
        depth = (3 * A / (8 * np.sqrt(9.525e-3))) ** (2 / 3)
        report(f"half-space, {n} points", noisy(t, np.ones(t.size), depth))
    t = np.linspace(0.0, 20000.0, 51)
    body = jc.LayeredHalfSpace([jc.Layer(FILM, 150e-9)], substrate=STEEL)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        grid = jc.Grid.square(n=64, width=600e-6)
        run = jc.indent(body, BALL, jc.Load(60.0), jnp.asarray(t), grid=grid, save="last")
        fit = report("film of 150 nm, 51 points", noisy(t, np.full(t.size, 60.0), np.asarray(run.approach)),
                     layer=150e-9, substrate=STEEL)  # fmt: skip
    print(fit.summary())


if __name__ == "__main__":
    main()
