"""Fits to public force curves beside those of scipy and nanite: the first table of ``docs/public_data.md``.

    python -m tests.benchmarks.public_files FOLDER [BEGIN]

FOLDER holds the files of ``CURVES``, which are not part of this project; BEGIN selects files by the begin of their names.
A line has the modulus with its interval, the verdict, the modulus with ``--weights absolute``, that of scipy at the same
points by a search of the contact point, that of scipy with a constant baseline, and that of nanite, where installed: of the
same part of the approach, with a constant baseline after the drift of the whole one is removed; the differences of the first
and the second pair; and the reasons of a rejection.
"""

import contextlib
import io
import json
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
from scipy import optimize

from jaxcontact.__main__ import main

BALL, PYRAMID, SHARP = ("--radius", 5e-6), ("--pyramid", 35.0), ("--pyramid", 18.0)
CURVES = [  # file, curve, tip
    ("fmt-jpk-fd_spot3-0192.jpk-force", 0, PYRAMID),
    ("fmt-hdf5-fd_version_0.13.3.h5", 0, BALL),
    ("fmt-igor-fd_SiN_FD_plot.ibw", 0, PYRAMID),
    ("fmt-igor-fd_U3_3_p10004.ibw", 0, BALL),
    ("fmt-jpk-fd_flipsign_2015.05.22-15.31.49.352.jpk-force", 0, PYRAMID),
    *(("fmt-jpk-fd_map-data-reference-points.jpk-force-map", k, BALL) for k in range(3)),
    *(("fmt-jpk-fd_map1d_2016-11-07.jpk-force-map", k, BALL) for k in (0, 4)),
    *(("fmt-jpk-fd_map2x2_extracted.jpk-force-map", k, PYRAMID) for k in (0, 3)),
    ("fmt-jpk-fd_map_bad_2013-05-27_1.jpk-force-map", 0, BALL),
    ("fmt-jpk-fd_2020.02.07-16.29.05.036.jpk-qi-data", 0, PYRAMID),
    ("fmt-jpk-fd_qi-data-2021.04.13.jpk-qi-series", 0, PYRAMID),
    ("fmt-jpk-fd_single_tilted-baseline-drift-mitotic_2021-01-29.jpk-force", 0, BALL),
    ("fmt-jpk-fd_single_tilted-baseline-shift-adyp_2023-06-26.jpk-force", 0, BALL),
    ("fmt-jpk-fd_single_bad_2017-01-16_1.jpk-force", 0, BALL),
    ("fmt-jpk-fd_single_bad_GWAT_2017-10-17.jpk-force", 0, BALL),
    ("fmt-jpk-cc_pr14-brain-2021.06.30.jpk-force", 0, BALL),
    ("fmt-jpk-cc_pr14-polymergel-2021.06.30.jpk-force", 0, BALL),
    ("fmt-jpk-sr_cell1-0008.jpk-force", 0, BALL),
    ("AFM_contact_test.txt", 0, BALL),
    ("AFM_relaxation.txt", 0, BALL),
    ("20200904_Egel4-Z1.0_00025.spm", 0, SHARP),
    *(("20200903_Egel2.0_00023.spm", k, SHARP) for k in (5, 100)),
    *((f"cr00{number}.000", 0, SHARP) for number in ("028", "037", "041", "043", "082", "175")),
    ("BrukerMultimode_20240527_test.000", 0, SHARP),
    ("DPPC-DSPC_100times00154.021", 0, SHARP),
]


def fitted_points(*words):
    """Return the summary of a command ``fit`` with the first two columns of its curve, or the message of its error."""
    message = io.StringIO()
    with tempfile.TemporaryDirectory() as out, contextlib.redirect_stderr(message):
        with contextlib.redirect_stdout(io.StringIO()):
            if main([*words, "-o", out, "--force"]):
                return message.getvalue().splitlines()[-1].split(": ", 3)[-1], None
        # abscissa and data, of an oscillation both moduli
        columns = (0, 1, 2) if words[1] == "oscillation" else (0, 1)
        points = np.loadtxt(Path(out) / "curve.csv", delimiter=",", skiprows=1, usecols=columns).T
        return json.loads((Path(out) / "summary.json").read_text()), points


def fitted(file, curve, tip, *more):
    """Return the summary of ``fit force`` with its depths and loads, or the message of its error."""
    return fitted_points("fit", "force", str(file), "--curve", str(curve), tip[0], str(tip[1]), *more)


def half_angle(tip):
    """Return the half-angle [rad] of the cone whose area is that of a pyramid."""
    return np.arctan(2 / np.sqrt(np.pi) * np.tan(np.radians(tip[1])))


def by_scipy(points, tip, tilt=1.0):
    """Return Young's modulus [Pa] of the best contact point, with a tilted baseline, or with tilt = 0 a constant one."""
    depth, load = points
    ball = tip[0] == "--radius"
    size = 4 / 3 * tip[1] ** 0.5 if ball else 2 / np.pi * np.tan(half_angle(tip))

    def best(contact):
        rise = size / 0.75 * np.maximum(depth - contact, 0) ** (1.5 if ball else 2.0)
        basis = np.stack([rise / rise.max(), np.ones(depth.size), np.linspace(0, tilt, depth.size)], 1)
        found = np.linalg.lstsq(basis, load, rcond=None)[0]
        return np.sum((basis @ found - load) ** 2), abs(found[0]) / rise.max()

    trial = np.linspace(0, 0.99 * depth.max(), 200)
    near = trial[np.argmin([best(contact)[0] for contact in trial])]
    ends = near + np.array([-1, 1]) * trial[1]
    return best(
        optimize.minimize_scalar(lambda c: best(c)[0] * 1e18, bounds=ends, options={"xatol": 1e-13}).x
    )[1]


def by_nanite(file, curve, tip, length):
    """Return Young's modulus [Pa] by nanite over the last depths of the approach, of this length [m]."""
    import nanite

    one = nanite.load_group(file)[curve]
    steps, options = ["compute_tip_position", "correct_force_offset", "correct_tip_offset"], {}
    if "time" in one:
        options = {"correct_force_slope": {"region": "baseline", "strategy": "drift"}}
    one.apply_preprocessing([*steps, *options], options=options)
    own = {"R": tip[1]} if tip[0] == "--radius" else {"alpha": np.degrees(half_angle(tip))}
    key = "hertz_para" if "R" in own else "hertz_cone"
    start = one.get_initial_fit_parameters(model_key=key)
    for name, value in {"nu": 0.5, **own}.items():
        start[name].set(value=value, vary=False)
    last = np.min(one["tip position"])
    one.fit_model(model_key=key, params_initial=start, weight_cp=0, range_x=(last - 1e-9, last + length))
    return one.fit_properties["params_fitted"]["E"].value


def other(*given):
    """Return the modulus by nanite, nan where it has none."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return by_nanite(*given)
    except BaseException:  # some of its errors do not derive from Exception
        return np.nan


def row(file, curve, tip):
    """Return a line of the table."""
    (own, _), (equal, points) = fitted(file, curve, tip), fitted(file, curve, tip, "--weights", "absolute")
    start = f"| {file.name} | {curve} | {tip[0][2:]} |"
    if isinstance(own, str):
        return f"{start} {own}"
    E, same = own["youngs_modulus_Pa"], equal["youngs_modulus_Pa"]["value"]
    ends = ", ".join("any" if E[end] is None else f"{E[end]:.3g}" for end in ("low", "high"))
    peers = by_scipy(points, tip), by_scipy(points, tip, 0.0), other(file, curve, tip, points[0].max())
    shown = " | ".join(f"{value:.4g}" for value in (same, *peers))
    differ = " | ".join(f"{100 * (one / two - 1):.2g} %" for one, two in ((same, peers[0]), peers[1:]))
    return f"{start} {E['value']:.4g} [{ends}] | {own['verdict']} | {shown} | {differ} | {own['reasons']}"


if __name__ == "__main__":
    for file, curve, tip in CURVES:
        if file.startswith(tuple(sys.argv[2:]) or ""):
            print(row(Path(sys.argv[1]) / file, curve, tip), flush=True)
