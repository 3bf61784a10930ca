"""Times of creep fits: one of 30000 points, and 200 curves at once against a loop. Run as a script."""

import time

import numpy as np

import fitting


def burgers(t):
    return 1 / 0.75e9 + -np.expm1(-t * 1.389e7 / 120.9e9) / 1.389e7 + t / 3148.6e9


def timed(call):
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def main():
    rng = np.random.default_rng(0)
    t = np.linspace(0.0, 40000.0, 30000)
    big = fitting.CreepData(t=t, J=burgers(t) * (1 + 0.01 * rng.standard_normal(t.size)))
    for label in ("with compilation", "after compilation"):
        seconds, fit = timed(lambda: fitting.fit_creep(big, weights="relative"))
        print(f"30000 points, fit and intervals, {label}: {seconds:.3f} s")
    print(f"  band at 200 times: {timed(lambda: fit.band(t[::150]))[0]:.3f} s with compilation")
    t = np.arange(1, 201) * 200.0
    J = burgers(t) * (1 + 0.01 * rng.standard_normal((200, 200)))
    curves = [fitting.CreepData(t=t, J=row) for row in J]
    fitting.fit_creep(curves[0], weights="relative")
    loop = timed(lambda: [fitting.fit_creep(c, weights="relative") for c in curves])[0]
    for intervals in (False, True):
        many = lambda intervals=intervals: fitting.fit_creep_batch(
            t, J, weights="relative", intervals=intervals
        )
        many()
        batch = timed(many)[0]
        print(
            f"200 curves: loop {loop:.3f} s, one call (intervals {intervals}) {batch:.3f} s, {loop / batch:.1f} times"
        )


if __name__ == "__main__":
    main()
