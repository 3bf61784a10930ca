"""The frozen table: values, intervals, verdicts and messages over all cases, data and kinds of fits, to compare two commits.

    PYTHONPATH=OLD python tests/benchmarks/figures.py -o old.json
    PYTHONPATH=NEW python tests/benchmarks/figures.py -o new.json
    python tests/benchmarks/figures.py old.json new.json

Names of ``SECTIONS`` behind the first two make a part of the table of it. All goes through
public names and commands, on small grids. The last prints the largest relative difference of each list of numbers that is
above its tolerance, and each text that differs; its status is 1 where there is any. The tolerance is 1e-9 of the largest
number of a list, or 1e-6 (that of the solvers) in a result whose number of iterations differs. Large fields are kept as
their sum, sum of squares, least and largest value, and a sum with weights that change over the cells. Real data lie in
``shared/data`` beside the project or above it; without them that section has no entries, which the comparison says.

It is no test: it shows that a change of structure changes no result.
"""

import argparse
import contextlib
import io
import json
import re
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
DATA = next((p / "shared" / "data" for p in ROOT.parents if (p / "shared" / "data").is_dir()), None)
LIMIT, SOLVER_LIMIT = 1e-9, 1e-6
WHOLE = 64  # the largest number of entries of an array that is kept as it is
# entries of a summary that differ between two runs of one commit, or name it
PASSING = re.compile(r"wall_time|seconds|version|digest|date|platform|processor|file$")


class Table:
    """The recorded results: ``numbers`` and ``texts``, lists by name."""

    def __init__(self) -> None:
        self.numbers: dict[str, list[float]] = {}
        self.texts: dict[str, list[str]] = {}
        self.seconds: dict[str, float] = {}

    def call(self, name: str, f: Callable[[], Any]) -> Any:
        """Call f and keep its result, its warnings and its error; return the result, or None."""
        began = time.process_time()
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                found = f()
            except Exception as error:
                found = None
                self.text(f"{name}: error", f"{type(error).__name__}: {error}")
            if found is not None:
                self.keep(name, found)
        for each in caught:
            if not issubclass(each.category, DeprecationWarning):
                self.text(f"{name}: warning", str(each.message))
        self.seconds[name] = time.process_time() - began
        return found

    def keep(self, name: str, found: Any) -> None:
        """Keep every public field and every text of a result, a fit or a table."""
        if isinstance(found, dict):
            for key, value in found.items():
                self.keep(f"{name}: {key}", value)
        elif isinstance(found, str):
            self.text(name, found)
        elif hasattr(found, "values") and hasattr(found, "intervals"):  # a fit
            self.keep(name, {"values": dict(found.values), "intervals": dict(found.intervals)})
            for part in ("rss", "misfit", "lag1", "verdict", "material", "notes"):
                with contextlib.suppress(AttributeError):
                    self.keep(f"{name}: {part}", getattr(found, part))
            self.text(f"{name}: text", str(found))
        elif hasattr(found, "__dataclass_fields__") or hasattr(found, "_fields"):
            for part in getattr(found, "__dataclass_fields__", None) or found._fields:
                if not part.startswith("_"):
                    self.keep(f"{name}: {part}", getattr(found, part))
            for part in (
                "contact_area",
                "contact_radius",
                "film_strain",
                "peak_pressure",
                "power",
                "tangential_force",
            ):
                if isinstance(getattr(type(found), part, None), property):
                    with contextlib.suppress(Exception):
                        self.keep(f"{name}: {part}", getattr(found, part))
            if type(found).__str__ is not object.__str__ and "History" in type(found).__name__:
                self.text(f"{name}: text", str(found))
        elif isinstance(found, list | tuple) and found and not all(isinstance(v, int | float) for v in found):
            for index, value in enumerate(found):
                self.keep(f"{name}[{index}]", value)
        else:
            self.array(name, found)

    def array(self, name: str, found: Any) -> None:
        """Keep numbers, or sums that stand for them."""
        try:
            values = np.asarray(found)
        except Exception:
            return
        if values.dtype.kind in "US":
            self.text(name, " ".join(map(str, values.ravel())))
            return
        if values.dtype.kind not in "biufc" or not values.size:
            return
        flat = values.ravel()
        flat = np.concatenate([flat.real, flat.imag]) if values.dtype.kind == "c" else flat.astype(float)
        if flat.size > WHOLE:
            weights = np.sin(1.0 + np.arange(flat.size) * 0.7)
            fine = np.where(np.isfinite(flat), flat, 0.0)
            flat = np.array(
                [fine.sum(), fine @ fine, fine.min(), fine.max(), weights @ fine, np.isfinite(flat).sum()]
            )
            # one number of its own each, since they have scales of their own
            for part, value in zip(
                ("sum", "squares", "least", "largest", "weighted", "finite"), flat, strict=True
            ):
                self.numbers[f"{name} ({part})"] = [float(value)]
            return
        self.numbers[name] = [float(v) for v in flat]

    def text(self, name: str, text: str) -> None:
        self.texts.setdefault(name, []).extend(text.splitlines())


def verbs(table: Table) -> None:
    """Every verb on half-spaces and films, elastic and creeping, under loads and approaches."""
    import jax
    import jax.numpy as jnp

    import jaxcontact as jc

    steel = jc.Elastic.from_young(210e9, nu=0.3)
    law = jc.Burgers(G1=0.75e9, G2=13.89e6, eta1=3.1486e12, eta2=120.9e9, nu=0.3)
    solid = jc.StandardLinearSolid(G1=1e9, G2=5e8, eta2=5e10, nu=0.35)
    film = jc.LayeredHalfSpace([jc.Layer(law, 150e-9)], steel)
    thick = jc.LayeredHalfSpace([jc.Layer(solid, 20e-6)], jc.Elastic(5e9, nu=0.3))
    creeping = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(5e9, nu=0.3), 20e-6)], solid)
    stack = jc.LayeredHalfSpace([jc.Layer(solid, 10e-6), jc.Layer(jc.Elastic(3e9, nu=0.3), 15e-6)], steel)
    bodies = {
        "steel": jc.LayeredHalfSpace([], steel), "SLS": jc.LayeredHalfSpace([], solid), "film": film, "thick film": thick,
        "film on SLS": creeping, "stack": stack,
    }  # fmt: skip
    k = jnp.geomspace(1e2, 1e7, 11)
    ball, load, times = jc.Sphere(9.525e-3, material=steel), jc.Load(60.0), np.array([0.0, 20.0, 60.0, 120.0])
    grid, oblong = jc.Grid.square(32, 1.2e-3), jc.Grid((32, 24), (40e-6, 50e-6))
    grids = {"film": jc.Grid.square(32, 500e-6), "steel": jc.Grid.square(32, 600e-6)}
    grids |= dict.fromkeys(("SLS", "film on SLS"), jc.Grid.square(32, 3e-3))
    call = table.call
    for name, body in bodies.items():
        own = grids.get(name, grid)
        pressed = call(f"indent {name}", lambda b=body, g=own: jc.indent(b, ball, load, times, grid=g))
        if pressed is not None:
            last = np.asarray(pressed.pressure)[-1]
            inside = lambda b=body, g=own, p=last: jc.subsurface(b, g, p, depths=[0.0, 5e-6, 60e-6])
            call(f"subsurface {name}", inside)
        call(
            f"slide_steady {name}",
            lambda b=body, g=own: jc.slide_steady(b, ball, load, velocity=1e-5, grid=g),
        )
        for t in (0.0, 30.0):
            call(f"normal_response {name} at {t:g} s", lambda b=body, t=t: jc.normal_response(b, k, t))
            both = lambda b=body, t=t: jc.frequency_response(b, k, 0.3 * k, t)
            call(f"frequency_response {name} at {t:g} s", both)
    sls, coated, g = bodies["SLS"], film, grids["film"]
    call("indent approach", lambda: jc.indent(thick, ball, jc.Approach(4e-6), times, grid=grid, substeps=3))
    call("indent oblong", lambda: jc.indent(thick, ball, load, times, grid=oblong, save="last"))
    call(
        "indent quasi-elastic",
        lambda: jc.indent(thick, ball, load, times, grid=grid, correspondence="quasi-elastic"),
    )
    call(
        "indent unloading",
        lambda: jc.indent(sls, ball, jc.Load(np.array([60.0, 40.0, 10.0, 0.0])), times, grid=grid),
    )
    around = lambda: jc.indent(film, ball, load, times, grid=jc.Grid.around(film, ball, load, times, n=32))
    call("indent around", around)
    for name, shape in {
        "cone": jc.Cone(1.5), "flat punch": jc.FlatPunch(200e-6), "cylinder": jc.Cylinder(9.5e-3, length=1e-3)
    }.items():  # fmt: skip
        call(
            f"indent {name}",
            lambda s=shape: jc.indent(bodies["steel"], s, load, np.zeros(1), grid=grids["steel"]),
        )
    rough = jc.Grid((32, 32), (1e-5, 1e-5), periodic=True)
    heights = call(
        "self_affine", lambda: jc.self_affine(rough, rms_slope=0.02, shortest=4e-5, longest=3.2e-4)
    )
    call("surface_statistics", lambda: jc.surface_statistics(heights, rough))
    field = call(
        "indent rough, periodic",
        lambda: jc.indent(bodies["SLS"], jc.HeightField(heights), jc.Load(2.0), times, grid=rough),
    )
    for f in (jc.contact_statistics, jc.contact_clusters, jc.pressure_histogram):
        call(f.__name__, lambda f=f: f(field))
    soft, bead = jc.LayeredHalfSpace([], jc.Elastic(1e6, nu=0.5)), jc.Sphere(1e-5)
    near = jc.Grid.square(32, 16e-6)
    for name, sticks in {
        "Dugdale": jc.DugdaleAdhesion(0.02, 3e4),
        "exponential": jc.ExponentialAdhesion(0.02, 6e-7),
    }.items():
        ramp = jc.Approach(np.array([0.0, 2e-7, 1e-7, -1e-7]))
        call(
            f"indent {name}", lambda a=sticks, c=ramp: jc.indent(soft, bead, c, times, grid=near, adhesion=a)
        )
    call("slide", lambda: jc.slide(thick, ball, load, times, velocity=1e-6, grid=grid, substeps=2))
    call(
        "slide, friction",
        lambda: jc.slide(sls, ball, load, times, velocity=1e-6, grid=grids["SLS"], friction=0.2),
    )
    call("slide_steady oblique", lambda: jc.slide_steady(coated, ball, load, velocity=(1e-6, 5e-7), grid=g))
    call(
        "slide_steady, friction",
        lambda: jc.slide_steady(sls, ball, load, velocity=1e-4, grid=grids["SLS"], friction=0.3),
    )
    strokes = 6e-6 * np.sin(np.linspace(0.0, 2.5 * np.pi, 7))
    to_and_fro = jc.TangentialDisplacement(np.stack([strokes, 0.0 * strokes], -1))
    seven = np.linspace(0.0, 100.0, 7)
    for coupled in (False, True):
        looped = lambda c=coupled: jc.shear(
            film, ball, load, to_and_fro, seven, friction=0.3, grid=g, coupled=c
        )
        call(f"shear, coupled {coupled}", looped)
    pulled = jc.TangentialLoad((6.0, 2.0))
    call(
        "shear under a load",
        lambda: jc.shear(sls, ball, load, pulled, times, friction=0.3, grid=grids["SLS"]),
    )
    for name in ("steel", "SLS"):
        own = grids.get(name, grid)
        rolled = lambda n=name, o=own: jc.roll_steady(
            bodies[n], ball, load, velocity=1e-4, creepage=(5e-4, 0.0), friction=0.3, grid=o
        )
        call(f"roll_steady {name}", rolled)
    for name, kept in {"Archard": jc.Archard(1e-18), "friction": jc.Archard(1e-18)}.items():
        more = {} if name == "Archard" else {"friction": 0.1}
        rubbed = lambda k=kept, m=more: jc.rub(film, ball, load, times, velocity=0.05, law=k, grid=g, **m)
        call(f"rub {name}", rubbed)
    flux = 1e6 * np.exp(-((np.arange(32) - 15.5) ** 2) / 20.0)[:, None] * np.ones(32)
    warm = {"conductivity": 50.0, "diffusivity": 1.3e-5}
    for velocity in (0.0, 0.5):
        call(
            f"flash_temperature at {velocity:g}",
            lambda v=velocity: jc.flash_temperature(flux, grid, velocity=v, **warm),
        )
    hot, cold = jc.ThermalBody(46.0, 1.2e-5, velocity=0.5), jc.ThermalBody(1.0, 5e-7)
    call("heat_partition", lambda: jc.heat_partition(flux, grid, hot, cold))

    def outcome(body):
        found = jc.indent(body, ball, load, times[:2], grid=jc.Grid.square(16, 1.2e-3), save="last")
        return {"peak": jnp.max(found.pressure), "approach": found.approach[-1]}

    call("sensitivity", lambda: str(jc.sensitivity(outcome, thick)))
    call(
        "gradient", lambda: [float(v) for v in jax.tree.leaves(jax.grad(lambda b: outcome(b)["peak"])(thick))]
    )


def fits(table: Table) -> None:
    """Every kind of fit on data from closed forms with noise, with each kind of weights, and what follows a fit."""
    import fitting
    import jaxcontact as jc

    random = np.random.default_rng(1)
    noisy = lambda y, s=0.01: np.asarray(y) * (1.0 + s * random.standard_normal(np.shape(y)))
    t, omega = np.geomspace(1.0, 1e4, 60), np.geomspace(1e-4, 1.0, 30)
    solid = jc.StandardLinearSolid(G1=1e6, G2=5e5, eta2=1e8, nu=0.3)
    burgers = jc.Burgers(G1=1e6, G2=5e5, eta1=3e10, eta2=1e8, nu=0.3)
    G = np.asarray(solid.complex_modulus(omega))
    creep = fitting.CreepData(t=t, J=noisy(burgers.creep(t)))
    relaxation = fitting.RelaxationData(t=t, modulus=noisy(solid.relaxation(t)))
    swept = fitting.OscillationData(omega=omega, storage=noisy(G.real), loss=noisy(G.imag))
    call = table.call
    for weights in (None, "relative", "absolute"):
        call(f"fit_creep, weights {weights}", lambda w=weights: fitting.fit_creep(creep, weights=w))
    for model in ("Maxwell", "StandardLinearSolid", "KelvinVoigt", "Springpot", "FractionalMaxwell"):
        call(f"fit_creep {model}", lambda m=model: fitting.fit_creep(creep, m))
    call("fit_creep, fixed", lambda: fitting.fit_creep(creep, fixed={"G1": 1e6}))
    call(
        "fit_creep, few points",
        lambda: fitting.fit_creep(fitting.CreepData(t=t[:6], J=np.asarray(creep.J)[:6])),
    )
    call("compare", lambda: str(fitting.compare(creep, ["Maxwell", "StandardLinearSolid", "Burgers"])))
    call("fit_relaxation", lambda: fitting.fit_relaxation(relaxation))
    call("fit_relaxation Springpot", lambda: fitting.fit_relaxation(relaxation, "Springpot"))
    for name in ("fit_oscillation", "fit_maxwell", "fit_spectrum"):
        call(name, lambda n=name: getattr(fitting, n)(swept))
    call("fit_maxwell of a relaxation", lambda: fitting.fit_maxwell(relaxation))
    call("fit_prony", lambda: fitting.fit_prony(creep, [30.0, 300.0, 3000.0]))
    call("fit_together", lambda: fitting.fit_together([relaxation, swept], "StandardLinearSolid"))
    many = np.asarray(burgers.creep(t)) * (1.0 + 0.01 * random.standard_normal((3, t.size)))
    call("fit_creep_batch", lambda: str(fitting.fit_creep_batch(t, many, weights="relative", intervals=True)))
    soft = jc.Sphere(radius=1e-3)
    depth = (3 * 0.7 * np.asarray(solid.creep(t - t[0])) * 1e-2 / (8 * np.sqrt(1e-3))) ** (2 / 3)
    held = fitting.IndentationData(t=t, load=np.full(t.size, 1e-2), depth=noisy(depth))
    sls = {"model": jc.StandardLinearSolid, "indenter": soft, "nu": 0.3}
    call("fit_indentation", lambda: fitting.fit_indentation(held, **sls))
    call("fit_indentation, contact point", lambda: fitting.fit_indentation(held, contact_point="fit", **sls))
    base = {"layer": 1e-3, "substrate": jc.Elastic(1e9, nu=0.3)}
    call("fit_indentation of a layer", lambda: fitting.fit_indentation(held, **sls, **base))
    height = np.linspace(-1e-6, 1e-6, 200)
    force = 16.0 / 3.0 * 1e3 * 2.0 * np.sqrt(5e-6) * np.clip(height, 0.0, None) ** 1.5
    noise = 0.01 * force.max() * random.standard_normal(200)
    curve = fitting.IndentationData(t=np.linspace(0.0, 1.0, 200), load=force + noise, depth=height)
    call("fit_force", lambda: fitting.fit_force(curve, indenter=jc.Sphere(5e-6)))
    call("fit_force on a layer", lambda: fitting.fit_force(curve, indenter=jc.Sphere(5e-6), thickness=5e-6))
    depths = np.linspace(1e-7, 2e-6, 40)
    stiff = noisy(2.0 * 1e9 / 0.7 * 2.0 * np.sqrt(1e-5 * depths))
    stiffness = fitting.StiffnessData(depth=depths, stiffness=stiff)
    call("fit_stiffness", lambda: fitting.fit_stiffness(stiffness, indenter=jc.Sphere(1e-5)))
    grown = []
    for stress, temperature in ((3e8, 353.0), (5e8, 353.0), (5e8, 373.0)):
        rate = 1e-2 * np.exp(-(1.3e-19 - 4e-29 * stress) / (1.380649e-23 * temperature)) * 1e9
        times = np.linspace(60.0, 7200.0, 20)
        h = rate * times * 1e-9 + 5e-10 * random.standard_normal(20)
        grown.append(fitting.GrowthData(times, h, stress=stress, temperature=temperature))
    call("fit_growth", lambda: fitting.fit_growth(grown))
    sweeps = []
    for temperature in (283.0, 293.0, 303.0):
        shift = 10.0 ** (-12.0 * (temperature - 293.0) / (110.0 + temperature - 293.0))
        G = np.asarray(burgers.complex_modulus(omega * shift))
        data = fitting.OscillationData(
            omega=omega, storage=noisy(G.real), loss=noisy(G.imag), temperature=temperature
        )
        sweeps.append(data)
    call("fit_master", lambda: fitting.fit_master(sweeps, reference=293.0))
    fit = fitting.fit_creep(creep)
    call("propagate", lambda: str(fitting.propagate(fit, lambda m: m.creep(100.0))))
    call("design", lambda: str(fitting.design(burgers)))
    sampled = lambda: str(fitting.posterior(fit, samples=100, warmup=100, chains=2))
    call("posterior", sampled)
    call("minimise", lambda: fitting.minimise(lambda x: (x - 3.0) ** 2 + 1.0, 1.0))


HOLD = ["--segment", "hold", "--model", "StandardLinearSolid"]
AFM = [
    "indentation",
    "--radius",
    "5e-6",
    "--nu",
    "0.5",
    "--control",
    "depth",
    "--model",
    "StandardLinearSolid",
]
BALL = ["indentation", "--radius", "3e-3", "--nu", "0.5", "--model", "Elastic"]
PYRAMID = ["--cone", "berkovich", "--tip-modulus", "1141e9"]
COMMANDS = {  # of the files of shared/data; every other one is fitted as a creep curve
    "creep_asphalt/*": [
        "creep",
        "--column",
        "t=0",
        "--column",
        "J=1",
        "--unit",
        "t=s",
        "--unit",
        "J=1/GPa",
        "--window",
        "0:230",
    ],
    "creep_spruce_wood/*": ["creep", "--segment", "0", "--tension", "0.3"],
    "indent_hysitron*/*": ["indentation", "--cone", "berkovich", "--nu", "0.3", *HOLD],
    "indent_*/*": AFM,
    "pyvisco_ansys/*.csv": ["relaxation", "--tension", "0.35"],
    "edge/c_approach.csv": ["force", "--radius", "5e-6"],
    "kinds/sweep_*": ["oscillation"],
    "kinds/dynamic_*": ["oscillation"],
    "kinds/ampt_*": ["oscillation"],
    "kinds/tension_*": ["oscillation"],
    "kinds/hold_*": ["indentation", "--cone", "berkovich", "--nu", "0.3", *HOLD],
    "kinds/creep_temperatures.csv": ["master", "--reference", "373.15"],
    "kinds/csm_*": ["stiffness", *PYRAMID],
    "kinds/nanodma*": ["stiffness", *PYRAMID],
    "kinds/book_*": BALL,
    "kinds/mach1*": BALL,
    "kinds/digitised.csv": ["relaxation"],
    "kinds/force_*": ["force", "--radius", "5e-6"],
}


def shell(table: Table, name: str, words: list[str], hidden: dict[str, str]) -> None:
    """Run a command and keep its status, output and summary; hidden: texts that differ between runs, and their names."""
    from jaxcontact.__main__ import main

    out, err = io.StringIO(), io.StringIO()
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        hidden = {folder: "OUT"} | hidden
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                status = main([*words, "-o", f"{folder}/out"] if words[0] in ("run", "fit") else words)
            except SystemExit as end:
                status = end.code
        if isinstance(status, int) and status >= 128:  # a signal that was meant for this script
            raise KeyboardInterrupt
        table.numbers[f"{name}: status"] = [float(status or 0)]
        for stream, text in (("out", out.getvalue()), ("err", err.getvalue())):
            for found, word in hidden.items():
                text = text.replace(found, word)
            table.text(f"{name}: {stream}", text)
        summary = Path(folder, "out", "summary.json")
        if summary.exists():
            found = json.loads(summary.read_text())
            table.keep(
                name,
                {key: value for key, value in found.items() if value is not None and not PASSING.search(key)},
            )
    table.seconds[name] = time.process_time() - began


def data(table: Table) -> None:
    """Every file of real and made-up measurements through the command that fits its kind."""
    files = sorted(DATA.rglob("*")) if DATA else []
    for path in files:
        if path.is_file() and path.suffix in (".csv", ".txt", ".xlsx", ".MPL"):
            kind = next((words for pattern, words in COMMANDS.items() if path.match(pattern)), ["creep"])
            shell(
                table,
                f"{path.parent.name}/{path.name}",
                ["fit", kind[0], str(path), *kind[1:]],
                {str(DATA): "DATA"},
            )
    if DATA:
        kinds = DATA / "kinds"
        three = [str(kinds / f"tension_{kelvin}K.csv") for kelvin in (277, 294, 310)]
        more = ["--temperature", "277.15,294.15,310.15", "--tension", "0.35", "--reference", "294.15"]
        shell(table, "master of three files", ["fit", "master", *three, *more], {str(DATA): "DATA"})


def cases(table: Table) -> None:
    """Every case file that comes with the package, of fewer cells and steps: the check, the run and its summary."""
    import jaxcontact

    with tempfile.TemporaryDirectory() as folder:
        for path in sorted((Path(jaxcontact.__file__).parent / "cases").glob("*.toml")):
            text = path.read_text()
            text = re.sub(r"(?m)^n = (\d+)", lambda found: f"n = {min(int(found[1]), 48)}", text)
            if "tangential_displacement" not in text:  # a history, one value for each step
                text = re.sub(r"(?m)^steps = (\d+)", lambda found: f"steps = {min(int(found[1]), 6)}", text)
            small = Path(folder, path.name)
            small.write_text(text)
            shell(table, f"check {path.stem}", ["check", str(small)], {folder: "CASES"})
            shell(table, f"run {path.stem}", ["run", str(small)], {folder: "CASES"})


def messages(table: Table) -> None:
    """Every message of the tables of mistakes in tests/support."""
    sys.path.insert(0, str(ROOT / "tests" / "support"))
    import mistakes_in_case_files
    import mistakes_in_the_shell
    import mistakes_of_motion
    import mistakes_of_pressing

    from jaxcontact.__main__ import main

    for name, (mistake, _) in (mistakes_of_pressing.PRESSING | mistakes_of_motion.MOTION).items():
        table.call(f"mistake: {name}", lambda f=mistake: f() and None)
    for tables, in_shell in ((mistakes_in_case_files.FILES, False), (mistakes_in_the_shell.SHELL, True)):
        for name in tables:
            with tempfile.TemporaryDirectory() as folder:
                out, err = io.StringIO(), io.StringIO()
                if in_shell:
                    (Path(folder) / "full.png").write_text("mine")
                with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                    try:
                        if in_shell:
                            mistakes_in_the_shell.shell(Path(folder), *tables[name][0])
                        else:
                            main(["check", str(mistakes_in_case_files.written(name, Path(folder))[0])])
                    except SystemExit:
                        pass
                table.text(f"mistake: {name}", (out.getvalue() + err.getvalue()).replace(folder, "FOLDER"))


SECTIONS = {"verbs": verbs, "fits": fits, "data": data, "cases": cases, "messages": messages}


def compare(old: dict[str, Any], new: dict[str, Any]) -> int:
    """Print every difference; return their number."""
    count = 0

    def tell(line: str) -> None:
        nonlocal count
        count += 1
        print(line)

    for kind in ("numbers", "texts"):
        for name in sorted(old[kind].keys() ^ new[kind].keys()):
            tell(f"only in the {'first' if name in old[kind] else 'second'}: {name}")
    other_path = set()  # results of other numbers of iterations
    for name, values in old["numbers"].items():
        if "iterations" in name and values != new["numbers"].get(name):
            other_path.add(name.partition(":")[0])
            print(f"other numbers of iterations: {name}")
    for name in (name for name in old["numbers"] if name in new["numbers"] and "iterations" not in name):
        a, b = np.array(old["numbers"][name]), np.array(new["numbers"][name])
        limit = SOLVER_LIMIT if name.partition(":")[0] in other_path else LIMIT
        if a.shape != b.shape or not np.array_equal(np.isfinite(a), np.isfinite(b)):
            tell(f"{name}: {a.tolist()} became {b.tolist()}")
            continue
        fine = np.isfinite(a)
        scale = np.max(np.abs(a[fine]), initial=0.0) or 1.0
        difference = np.max(np.abs(a[fine] - b[fine]), initial=0.0) / scale
        if difference > limit or not np.array_equal(a[~fine], b[~fine], equal_nan=True):
            tell(f"{difference:.1e} above {limit:g}: {name}")
    for name in (name for name in old["texts"] if name in new["texts"]):
        one, other = old["texts"][name], new["texts"][name]
        if one != other:
            tell(f"text of {name}:")
            for line in one:
                if line not in other:
                    print(f"  - {line}")
            for line in other:
                if line not in one:
                    print(f"  + {line}")
    numbers = sum(map(len, old["numbers"].values()))
    print(f"{count} differences in {numbers} numbers and {len(old['texts'])} texts")
    return count


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="sections to make, or two files to compare")
    parser.add_argument("-o", dest="file", type=Path, help="file of the table; by default it goes to stdout")
    options = parser.parse_args()
    if [name.endswith(".json") for name in options.names] == [True, True]:
        sys.exit(compare(*(json.loads(Path(name).read_text()) for name in options.names)) > 0)
    made = Table()
    for section in options.names or SECTIONS:
        began = time.process_time()
        SECTIONS[section](made)
        if options.file:
            options.file.write_text(json.dumps({"numbers": made.numbers, "texts": made.texts}, indent=1))
        print(f"{section}: {time.process_time() - began:.0f} s of CPU", file=sys.stderr)
    slow = sorted(made.seconds.items(), key=lambda item: -item[1])[:10]
    print("slowest: " + ", ".join(f"{name} {seconds:.0f} s" for name, seconds in slow), file=sys.stderr)
    if not options.file:
        print(json.dumps({"numbers": made.numbers, "texts": made.texts}, indent=1))
