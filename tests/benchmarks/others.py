"""Hertz's contact by Tamaas, where it is installed, in the same process as the unit of its ratio.

python -m tests.benchmarks.others N
"""

import json
import sys

import numpy as np

from tests.benchmarks.measure import median_time, unit


def tamaas_hertz(n: int) -> dict[str, object]:
    """A ball on a half-space without a period, to 1e-8; {"skipped": why} where there is no Tamaas."""
    try:
        import tamaas
    except ImportError as error:
        return {"problem": "hertz by Tamaas", "n": n, "skipped": str(error)}
    width, radius, load = 600e-6, 9.525e-3, 60.0
    x = (np.arange(n) - (n - 1) / 2) * width / n
    surface = -(x[:, None] ** 2 + x[None, :] ** 2) / (2.0 * radius)
    model = tamaas.Model(tamaas.model_type.basic_2d, [width, width], [n, n])
    model.E, model.nu = 210e9 / 2.0, 0.3  # two alike bodies as one
    tamaas.ModelFactory.registerNonPeriodic(model, "free")
    solver = tamaas.PolonskyKeerRey(model, surface, 1e-8)
    solver.setIntegralOperator("free")
    seconds, convolution = median_time(lambda: solver.solve(load / width**2), 1), unit(n)
    peak = float(np.max(model.traction))
    return {"problem": "hertz by Tamaas", "n": n, "steps": 1, "convolution_ms": 1e3 * convolution,
            "ratio": seconds / convolution, "seconds": seconds, "peak_pressure_Pa": peak}  # fmt: skip


if __name__ == "__main__":
    print(json.dumps(tamaas_hertz(int(sys.argv[1]))))
