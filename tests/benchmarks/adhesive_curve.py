"""Fit of the work of adhesion to measured force curves of a ball of 7.5 um on PDMS.

python -m tests.benchmarks.adhesive_curve FILE ...

The files are those of the public repository github.com/Tour712/Nanoindentation_Analysis (folders data/PDMS and
data/PDMS_10-1), in which a table of position of the piezo [um], displacement of the force sensor [nm] and time [ms]
follows a line "eoh". Its scripts give the radius of the ball and the stiffness of the sensor, 3.01 N/m. The files have no
licence and are not part of this project.
"""

import sys
import warnings

import numpy as np

import fitting
import jaxcontact as jc

STIFFNESS, RADIUS, NU = 3.01, 7.5e-6, 0.5
EVERY = 4  # samples


def read(path):
    """Approach and retraction as ``IndentationData``."""
    with open(path, encoding="latin1") as file:
        table = file.read().split("eoh")[1].strip().replace(",", ".")
    rows = [line.split("\t")[:3] for line in table.splitlines()]
    piezo, sensor, t = np.array(rows, float).T[:, ::EVERY] * np.array([[1e-6], [1e-9], [1e-3]])
    load = STIFFNESS * sensor
    marks = np.where(np.arange(t.size) <= np.argmax(load), "approach", "retract")
    return fitting.IndentationData(t=t, load=load, depth=piezo - sensor, marks=marks)


def main(paths):
    given = {"indenter": jc.Sphere(RADIUS), "nu": NU, "control": "depth", "contact_point": "fit"}
    warnings.simplefilter("ignore")
    for path in paths:
        curve = read(path)
        for name, data in (("both", curve), ("retraction", curve.only("retract"))):
            fit = fitting.fit_indentation(data, "Elastic", adhesion="JKR", **given)
            print(f"{path} {name}\n{fit.summary()}\n", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
