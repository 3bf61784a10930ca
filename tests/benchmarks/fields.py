"""Coverage of the 95 % intervals of ``fitting.fit_fields`` from maps of pressure and gap and from contact images.

The shear modulus of an elastic film of known thickness on a stiff substrate, under two loads. The data are computed on
a grid of 8 n cells along each axis and averaged over the 2 n pixels, since counting the cells in contact on the pixels
themselves would misplace the edge by more than the fit does. They are blurred by a Gaussian of 1.5 pixels, shifted by a
third of a pixel along x and y (both by ``scipy.ndimage``), and given noise with a standard deviation of 3 % of the
largest value: white, or correlated over 1.5 pixels. A contact image is the blurred coverage with this noise, 1 above
1/2, of which 3 % of the pixels are inverted. The fit is on n cells.

    python -m tests.benchmarks.fields [--n 128] [--sets 100] [--only pressure] [--noise white] [--seed 0] [--exact] [-o FILE]

The contacts of the model are solved at multiples of ``STEP`` of log G, with their derivatives, and interpolated between
them, so that all fits share the solutions; ``--exact`` solves each contact. A row has the coverage, the root mean square
error, the bias and the mean half interval relative to the true value, the share of the half interval that is the
estimated error of the grid, and the share of fits rejected. The exit status is 1 if a coverage is below 92 %.
"""

import argparse
import itertools
import math
import sys
from typing import NamedTuple
from unittest import mock

import jax
import numpy as np
from scipy import ndimage

import fitting
import jaxcontact as jc
from fitting.fits.fields import PressedImages

TRUTH, START, THICKNESS = 1e9, 0.9e9, 20e-6  # [Pa], [Pa], [m]
BOUNDS = {"G": (0.8e9, 1.25e9)}
LOADS, TIMES = [0.1, 0.5], [0.0, 1.0]
WIDTH, RADIUS = 240e-6, 5e-3
FINER = 4  # cells of the truth per pixel, along each axis
BLUR, SHIFT, NOISE = 1.5, 1.0 / 3.0, 0.03
FIELDS, KINDS = ("pressure", "gap", "contact"), ("white", "correlated")
STEP = 0.004  # between the nodes of log G
NODES, NEEDED = {}, ("gap", "pressure", "smooth_area")
LEAST = 0.92


def film(p):
    """Return the body."""
    layer = jc.Layer(jc.Elastic(G=p["G"], nu=0.4), thickness=THICKNESS)
    return jc.LayeredHalfSpace([layer], substrate=jc.Elastic(G=30e9, nu=0.22))


def images(n):
    """Return the image of every field without noise, (nt, 2n, 2n), and its grid."""
    grid, fine = jc.Grid.square(2 * n, WIDTH), jc.Grid.square(2 * n * FINER, WIDTH)
    history = jc.indent(film({"G": TRUTH}), jc.Sphere(RADIUS), jc.Load(LOADS), TIMES, grid=fine)
    assert np.all(np.asarray(history.status) == 0)
    clean = {name: np.asarray(getattr(history, name)) for name in ("pressure", "gap")}
    clean["contact"] = (clean["pressure"] > 0).astype(float)
    mean = lambda f: f.reshape(len(f), 2 * n, FINER, 2 * n, FINER).mean((2, 4))
    clean = {name: mean(field) for name, field in clean.items()}

    def see(name, field):
        moved = ndimage.shift(field, SHIFT, order=1 if name == "contact" else 3, mode="nearest")
        return ndimage.gaussian_filter(moved, BLUR, mode="nearest", truncate=6.0)

    return {name: np.stack([see(name, f) for f in field]) for name, field in clean.items()}, grid


def measured(name, image, rng, kind):
    """Return a noisy image."""
    noise = rng.standard_normal(image.shape)
    if kind == "correlated":
        noise = ndimage.gaussian_filter(noise, (0.0, BLUR, BLUR), mode="wrap")
        noise /= noise.std()
    noisy = image + NOISE * image.max() * noise
    if name != "contact":
        return noisy
    return ((noisy > 0.5) != (rng.random(image.shape) < NOISE)).astype(float)


class Tabulated(PressedImages):
    """Images whose histories are cubic Hermite polynomials between nodes of log G, kept for each grid."""

    def __init__(self, *given):
        super().__init__(*given)
        self.static["needed"] = NEEDED  # the same programs for all images

    def _node(self, i):
        key = *self.grid.shape, *(float(d) for d in self.grid.spacing), i
        if key not in NODES:
            at = (i * STEP,)
            NODES[key] = *super()._history(at), {n: s[0] for n, s in super()._slopes(at).items()}
        return NODES[key]

    def _ends(self, logs):
        i = math.floor(logs[0] / STEP)
        return logs[0] / STEP - i, self._node(i), self._node(i + 1)

    def _history(self, logs):
        t, (f, history, df), (g, other, dg) = self._ends(logs)
        weights = (
            (1 + 2 * t) * (1 - t) ** 2,
            STEP * t * (1 - t) ** 2,
            t**2 * (3 - 2 * t),
            STEP * t**2 * (t - 1),
        )
        worse = max(history, other, key=lambda one: int(np.max(one.status)))
        return _summed(weights, f, df, g, dg), worse

    def _slopes(self, logs):
        t, (f, _, df), (g, _, dg) = self._ends(logs)
        weights = 6 * t * (t - 1) / STEP, (1 - t) * (1 - 3 * t), 6 * t * (1 - t) / STEP, t * (3 * t - 2)
        return jax.tree.map(lambda x: x[None], _summed(weights, f, df, g, dg))


def _summed(weights, *trees):
    return jax.tree.map(lambda *x: sum(w * one for w, one in zip(weights, x, strict=True)), *trees)


class Covered(NamedTuple):
    """Coverage, relative root mean square error, bias and half interval, share of the grid error, and share rejected."""

    held: float
    rms: float
    bias: float
    half: float
    grid: float
    refused: float


def covered(name, kind, seen, sets, seed=0, exact=False, verbose=False):
    """Return the coverage from a number of noisy images; seen: clean images and their grid."""
    clean, grid = seen
    model = jc.Grid.square(grid.shape[0] // 2, WIDTH)
    setting = {"indenter": jc.Sphere(RADIUS), "grid": model, "blur": BLUR * float(grid.spacing[0])}
    rows = []
    for k in range(sets):
        rng = np.random.default_rng([seed, FIELDS.index(name), KINDS.index(kind), k])
        field = measured(name, clean[name], rng, kind)
        data = fitting.ContactData(TIMES, jc.Load(LOADS), {name: field}, grid)
        with mock.patch("fitting.fits.fields.PressedImages", PressedImages if exact else Tabulated):
            fit = fitting.fit_fields(data, film, {"G": START}, bounds=BOUNDS, **setting)
        low, high = fit.intervals["G"]
        half = 0.5 * math.log(high / low)
        rows.append(
            (low <= TRUTH <= high, math.log(fit.values["G"] / TRUTH), half, fit.grid_error["G"], fit.verdict)
        )
        if verbose:
            print(k, rows[-1], fit.view, fit.blocks, fit.refused, flush=True)
    held, error, half, left, verdict = (np.array(x) for x in zip(*rows, strict=True))
    root = float(np.sqrt(np.mean(error**2)))
    return Covered(
        held.mean(), root, error.mean(), half.mean(), np.mean(left / half), np.mean(verdict == "rejected")
    )


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, default=128, help="cells of the fit along each axis")
    parser.add_argument("--sets", type=int, default=100, help="noisy images of each row")
    parser.add_argument("--only", default="", help="a field: pressure, gap or contact")
    parser.add_argument("--noise", default="", help="white or correlated")
    parser.add_argument("--seed", type=int, default=0, help="of the noise")
    parser.add_argument("--exact", action="store_true", help="solve each contact")
    parser.add_argument("--verbose", action="store_true", help="print each fit")
    parser.add_argument("-o", "--output", help="file to which finished rows are appended")
    options, below, seen = parser.parse_args(), 0, None
    for name, kind in itertools.product(FIELDS, KINDS):
        if not name.startswith(options.only) or not kind.startswith(options.noise):
            continue
        seen = seen or images(options.n)
        found = covered(name, kind, seen, options.sets, options.seed, options.exact, options.verbose)
        below += found.held < LEAST
        text = (
            f"{name:8s} {kind:10s} held {100 * found.held:5.1f} %, rms error {100 * found.rms:.3f} %,"
            f" bias {100 * found.bias:+.3f} %, half interval {100 * found.half:.3f} %,"
            f" of it grid {found.grid:.2f}, rejected {found.refused:.2f}"
        )
        print(text, flush=True)
        if options.output:
            with open(options.output, "a") as file:
                print(text, file=file)
    return int(below > 0)


if __name__ == "__main__":
    sys.exit(main())
