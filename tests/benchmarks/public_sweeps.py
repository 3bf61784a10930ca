"""Fits to public rheometer files beside scipy: the second table of ``docs/public_data.md``.

    python -m tests.benchmarks.public_sweeps FOLDER

FOLDER holds the files of ``MODELS`` and ``SERIES``, which are not part of this project; in ``Maxwell.gt`` the heading sxy, a
stress, is replaced by modulus, since the strain is 1. Classical and fractional models are
fitted by scipy from twelve starts, generalised Maxwell models by non-negative least squares at the same times.
"""

import sys
from pathlib import Path

import numpy as np
from scipy import optimize

from tests.benchmarks.public_files import fitted_points

SWEEP = "--column omega=0 --column storage=1 --column loss=2"
GT = "--column t=t --column modulus=modulus --unit t=s --unit modulus=Pa"
STRESS = 10.0  # [Pa] of the creep test
MODELS = [  # file, words of the command, moduli or strain of the parameters x over s = i omega or over t, start
    (
        "data_freq.csv", f"oscillation {SWEEP} --model FractionalKelvinVoigt --weights relative",
        lambda x, s: x[0] + x[1] * s ** min(x[2], 1.0), (1.0, 0.1, 0.5),
    ),
    (
        "silk_feedstock.tts", f"oscillation {SWEEP} --model Burgers --weights relative",
        lambda x, s: 1 / (1 / x[0] + 1 / (s * x[2]) + 1 / (x[1] + s * x[3])), (1e4, 1e4, 2e3, 1e3),
    ),
    (
        "Acierno_iPB116.tts", f"oscillation {SWEEP} --model FractionalMaxwell --weights relative",
        lambda x, s: 1 / (1 / x[0] + 1 / (x[1] * s ** min(x[2], 1.0))), (1e5, 1e3, 0.9),
    ),
    (
        "CM3_Creep.creep", "creep --weights absolute",
        lambda x, t: STRESS * (1 / x[0] + t / x[2] - np.expm1(-t * x[1] / x[3]) / x[1]), (4e4, 3e3, 4e4, 6e4),
    ),
    ("Maxwell.gt", f"relaxation {GT} --model Maxwell", lambda x, t: x[0] * np.exp(-t * x[0] / x[1]), (2.0, 2.0)),
]  # fmt: skip
DECADES = ",".join(f"1e{k}" for k in range(-2, 29))
SERIES = [
    ("silk_feedstock.tts", f"oscillation {SWEEP} --tau auto"),
    ("Acierno_iPB116.tts", f"oscillation {SWEEP} --tau auto"),
    ("DOWLDPEL150R_160C.tts", f"oscillation {SWEEP} --tau auto"),
    ("freq_user_master.csv", "oscillation --tension 0.35 --tau auto"),
    ("time_user_master.csv", f"relaxation --tension 0.35 --weights relative --tau {DECADES}"),
    ("test1.gt", "relaxation --column t=0 --column modulus=1 --weights relative --tau auto"),
]


def measured(points, words):
    """Return the abscissa (s = i omega, or t), the data and their weights: relative, or one for all in creep."""
    x, y, *loss = points
    if loss:
        x, y = 1j * x, y + 1j * loss[0]
    return x, y, 1 / np.abs(y) if "--weights absolute" not in words else np.full(y.size, 1 / np.abs(y).max())


def best(model, x, y, weight, start):
    """Return the parameters of the smallest misfit of twelve starts."""

    def off(logs):
        left = weight * (model(np.exp(logs), x) - y)
        return np.concatenate([left.real, left.imag])

    rng = np.random.default_rng(0)
    starts = [np.log(start) + spread * rng.normal(size=len(start)) for spread in [0.0] + 11 * [1.0]]
    ends = [optimize.least_squares(off, one, xtol=1e-14, ftol=1e-14, gtol=1e-14) for one in starts]
    return np.exp(min(ends, key=lambda end: end.cost).x)


def series(tau, x, y, weight):
    """Return the moduli Ge, G1, ... >= 0 of the smallest misfit, at these times."""
    parts = np.exp(-x[:, None] / tau) if np.isrealobj(x) else x[:, None] * tau / (1 + x[:, None] * tau)
    rows = weight[:, None] * np.hstack([np.ones((x.size, 1)), parts])
    rows, data = (
        np.concatenate([rows.real, rows.imag]),
        np.concatenate([(weight * y).real, (weight * y).imag]),
    )
    size = np.linalg.norm(rows, axis=0)
    return optimize.nnls(rows / size, data, maxiter=10000)[0] / size


def row(file, words, find):
    """Return a line of the table."""
    kind, *more = words.split()
    own, points = fitted_points("fit", kind, str(file), *more)
    if points is None:
        return f"| {file.name} | {own}"
    ours = np.array(list(own["parameters"].values()))
    theirs = find(own, *measured(points, words))
    scale = theirs if own["tau_s"] is None else theirs.max()
    shown = ", ".join(f"{value:.4g}" for value in ours[:5])
    return f"| {file.name} | {words} | {shown} | {own['verdict']} | {100 * np.max(np.abs(ours - theirs) / scale):.2g} %"


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    for file, words, model, start in MODELS:
        print(row(folder / file, words, lambda _, *d, m=model, s=start: best(m, *d, s)), flush=True)
    for file, words in SERIES:
        print(row(folder / file, words, lambda own, *d: series(np.array(own["tau_s"]), *d)), flush=True)
