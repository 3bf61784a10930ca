"""Force curves fitted by nanite beside ``fit_map`` and ``fit_force``: modulus and time of a curve.

    python -m tests.benchmarks.by_nanite [--python PYTHON] [--curves 128]      # simulated, of a ball, 1 % of noise
    python -m tests.benchmarks.by_nanite --file VOLUME --cone 18               # a force volume

PYTHON is the interpreter of an environment with nanite, which need not have this project; where it has none the command
says so and ends. Both get the same depths and loads of the approaches and fit Hertz's model with nu = 0.5; nanite has equal
weights of all points, subtracts the offset of the baseline, and starts from its own contact point. Times are of the
processor, without import and, of ``fit_map``, with and without compilation.
"""

import argparse
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

POISSON = 0.5


def by_nanite(given: str, result: str) -> None:
    """Fit the curves of the file ``given`` and write their moduli [Pa] and processor times [s] to ``result``."""
    import nanite

    curves = np.load(given)
    own = {"R": float(curves["size"])} if curves["ball"] else {"alpha": float(curves["size"])}
    key = "hertz_para" if curves["ball"] else "hertz_cone"
    moduli, spent = [], []
    for depth, load in zip(curves["depth"], curves["load"], strict=True):
        on = np.isfinite(depth)
        data = {
            "force": load[on], "tip position": -depth[on], "height (measured)": -depth[on],
            "time": np.arange(on.sum()) * 1e-3, "segment": np.zeros(on.sum(), dtype=np.uint8),
        }  # fmt: skip
        about = {"path": given, "enum": len(moduli), "imaging mode": "force-distance", "spring constant": 1.0}
        started = time.process_time()
        one = nanite.Indentation(data, about)
        try:
            one.apply_preprocessing(["compute_tip_position", "correct_force_offset", "correct_tip_offset"])
            start = one.get_initial_fit_parameters(model_key=key)
            for name, value in {"nu": POISSON, **own}.items():
                start[name].set(value=value, vary=False)
            one.fit_model(model_key=key, params_initial=start, weight_cp=0)
            moduli.append(one.fit_properties["params_fitted"]["E"].value)
        except BaseException:  # some of its errors do not derive from Exception
            moduli.append(np.nan)
        spent.append(time.process_time() - started)
    np.savez(result, moduli=moduli, spent=spent, version=nanite.__version__)


def beside(
    python: str, depth: np.ndarray, load: np.ndarray, ball: bool, size: float
) -> dict[str, np.ndarray]:
    """Return the results of ``by_nanite`` in the interpreter ``python``; SystemExit with the reason where it has none."""
    found = subprocess.run([python, "-c", "import nanite"], capture_output=True, text=True, check=False)
    if found.returncode:
        reason = found.stderr.strip().splitlines()[-1]
        raise SystemExit(
            f"skipped: {python} has no nanite ({reason}); name another interpreter with --python"
        )
    with tempfile.TemporaryDirectory() as folder:
        given, result = (str(Path(folder) / name) for name in ("given.npz", "result.npz"))
        np.savez(given, depth=depth, load=load, ball=ball, size=size)
        subprocess.run([python, "-W", "ignore", __file__, "--worker", given, result], check=True)
        return dict(np.load(result))


def main() -> None:
    """Print the comparison."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", default=sys.executable, help="interpreter with nanite")
    parser.add_argument("--curves", type=int, default=128)
    parser.add_argument("--file", help="a force volume instead of simulated curves")
    parser.add_argument("--radius", type=float, help="of the ball [m]")
    parser.add_argument("--cone", type=float, help="half-angle [degrees]")
    parser.add_argument("--worker", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        by_nanite(*options.worker)
        return

    import fitting
    import jaxcontact as jc
    from fitting.data import force_curves
    from tests.support.maps_of_curves import RADIUS, simulated

    truth = None
    if options.file:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            read = [
                fitting.read_force(options.file, curve=one.curve) for one in force_curves.places(options.file)
            ]
        curves = [one.only("approach") for one in read]
        longest = max(one.t.size for one in curves)
        depth, load, times = np.full((3, len(curves), longest), np.nan)
        for k, one in enumerate(curves):
            depth[k, : one.t.size], load[k, : one.t.size], times[k, : one.t.size] = one.depth, one.load, one.t
    else:
        depth, load, times, truth, _, _ = simulated(options.curves, 512, faulty=0.0)
    ball = options.cone is None
    size = (options.radius or RADIUS) if ball else options.cone
    tip = jc.Sphere(radius=size) if ball else jc.Cone(half_angle=np.radians(size))
    other = beside(options.python, depth, load, ball, size)

    spent = []
    for _ in range(2):  # the second time without compilation
        started = time.process_time()
        found = fitting.fit_map(depth, load, times, indenter=tip, nu=POISSON)
        spent.append((time.process_time() - started) / len(depth))
    each, alone = [], 0.0
    for k in range(min(16, len(depth))):
        on = np.isfinite(depth[k])
        data = fitting.IndentationData(t=times[k, on], load=load[k, on], depth=depth[k, on])
        started = time.process_time() if k else 0.0
        each.append(fitting.fit_force(data, indenter=tip, nu=POISSON).youngs_modulus[0])
        alone += time.process_time() - started if k else 0.0

    E, peer = found.youngs_modulus, other["moduli"]
    low, high = found.youngs_interval.T
    accepted = found.accepted
    print(f"{len(depth)} curves of up to {depth.shape[1]} points; nanite {other['version']} has a modulus of"
          f" {np.isfinite(peer).sum()}, fit_map accepts {accepted.sum()}")  # fmt: skip
    print(f"processor time of a curve: nanite {1e3 * np.mean(other['spent']):.1f} ms, fit_map {1e3 * spent[1]:.1f} ms"
          f" ({1e3 * spent[0]:.1f} ms with compilation), fit_force {1e3 * alone / (len(each) - 1):.0f} ms")  # fmt: skip
    rms = lambda x: np.sqrt(np.mean(x**2))
    size_of = lambda x: f"median {np.median(abs(x)):.2%}, rms {rms(x):.2%}, largest {np.max(abs(x)):.2%}"
    both = accepted & np.isfinite(peer)
    print(f"nanite against fit_map, {both.sum()} curves: {size_of((peer / E - 1)[both])};"
          f" in {np.mean(((low < peer) & (peer < high))[both]):.1%} it is within the 95 % interval")  # fmt: skip
    print(f"fit_force against fit_map, {len(each)} curves: {size_of(np.array(each) / E[: len(each)] - 1)}")
    if truth is not None:
        print(f"nanite against the truth: {size_of((peer / truth - 1)[both])}")
        print(f"fit_map against the truth: {size_of((E / truth - 1)[both])}; within the interval in"
              f" {np.mean(((low < truth) & (truth < high))[both]):.1%}")  # fmt: skip


if __name__ == "__main__":
    main()
