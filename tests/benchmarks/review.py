"""The faults that a review found in an earlier state: what each was, what it is now, and what is right.

    python -m tests.benchmarks.review            # all lines, in about eight minutes of CPU time
    python -m tests.benchmarks.review 5 7 19     # selected lines

Lines are numbered as in the review: 1 to 4 on derivatives, 5 to 11 on numbers of simulations, 12 to 27 on fits, 28 to 33
on files and commands, 37 to 40 on pages, further functions, studies and memory. Each is measured here as a user would, by a
call of the package or of its command, and compared with a closed form or with a value from another method. Some have
findings of the same kind in other places, seen since then. A line has the tests that hold it; the script checks that they
are there, and does not run them. It ends with status 1 where a line does not hold.

Files of measurements and of instruments are those of ``shared/data`` beside a checkout; what needs them is left out, with
a word, where they are missing.
"""

import argparse
import ast
import contextlib
import functools
import io
import json
import math
import pickle
import re
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy import optimize

import fitting
import jaxcontact as jc
from jaxcontact.__main__ import main as shell
from jaxcontact.reference import abel
from tests.benchmarks import coverage

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # where tests have their common inputs
from force_curves import NU as NU_OF_CURVE
from force_curves import RADIUS, WORK, force_curve

TESTS = Path(__file__).parents[1]
DATA = next((d for above in TESTS.parents if (d := above / "shared" / "data").is_dir()), None)
STEEL = jc.Elastic(80e9, 0.3)
SLS = {"G1": 1e9, "G2": 0.6e9, "eta2": 12e9}
HALF_SPACE = jc.LayeredHalfSpace([], jc.Elastic(1e9, 0.3))


class Finding(NamedTuple):
    """A measured value of a line: what, its value then, now and the right one, in words, and whether it holds."""

    what: str
    was: str
    now: str
    right: str
    holds: bool


class Line(NamedTuple):
    """A line of the review: its subject, the tests that hold it, and the function that measures it."""

    subject: str
    tests: tuple[str, ...]
    measure: Callable[[], Iterator[Finding]] | None


LINES: dict[str, Line] = {}


def line(number: str, subject: str, *tests: str) -> Callable[[Any], Any]:
    """Enter a function that yields findings as the line ``number``; tests: "file::function" below tests/."""

    def entered(measure: Callable[[], Iterator[Finding]]) -> Callable[[], Iterator[Finding]]:
        LINES[number] = Line(subject, tests, measure)
        return measure

    return entered


def held(number: str, subject: str, *tests: str) -> None:
    """Enter a line that is not measured here, for which its tests answer."""
    LINES[number] = Line(subject, tests, None)


def missing_tests(tests: tuple[str, ...]) -> list[str]:
    """Return those of the named tests that are not in their files."""
    return [test for test in tests if test.split("::")[1] not in functions_of(TESTS / test.split("::")[0])]


@functools.cache
def functions_of(path: Path) -> frozenset[str]:
    """Return the names of the functions of a file, none where it does not exist."""
    if not path.is_file():
        return frozenset()
    nodes = ast.walk(ast.parse(path.read_text()))
    return frozenset(node.name for node in nodes if isinstance(node, ast.FunctionDef))


def within(what: str, was: str, now: float, right: float, tolerance: float, unit: str = "") -> Finding:
    """Return the finding of a number that has to agree with another within a relative tolerance."""
    word = lambda value: f"{value:.5g} {unit}".strip()
    good = bool(abs(now - right) <= tolerance * abs(right))
    return Finding(what, was, word(now), f"{word(right)} ({100 * tolerance:g} %)", good)


def at_most(what: str, was: str, now: float, limit: float, unit: str = "") -> Finding:
    """Return the finding of a number that may not exceed a limit."""
    return Finding(what, was, f"{now:.3g} {unit}".strip(), f"<= {limit:g} {unit}".strip(), bool(now <= limit))


def refused(what: str, was: str, call: Callable[[], Any], words: str) -> Finding:
    """Return the finding of a call that has to end with a ``ValueError`` of these words (a regular expression)."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            now = f"accepted: {str(call())[:60]}"
    except ValueError as error:
        now = str(error)
    except Exception as error:  # any other kind is what a user should not see
        now = f"{type(error).__name__}: {error}"
    good = bool(re.search(words, now)) and not now.startswith("accepted")
    return Finding(what, was, f"refused: {now[:70]}" if good else now[:90], "refused", good)


def verdict(what: str, was: str, fit: Any, right: str, words: str = "") -> Finding:
    """Return the finding of a fit's verdict; words: a regular expression that a reason or a note has to match."""
    said = (*fit.refused, *fit.notes)
    fitting_words = [each for each in said if words and re.search(words, each)]
    good = fit.verdict == right and (not words or bool(fitting_words))
    now = f"{fit.verdict}: {(fitting_words or [*said, ''])[0][:70]}"
    return Finding(what, was, now, f"{right}, with its reason" if words else right, good)


def command(*words: str) -> tuple[int, str, dict[str, Any]]:
    """Return the status of ``jaxcontact fit ...``, what it prints, and its summary, none where it ends before it."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        out, text = Path(folder) / "out", io.StringIO()
        with contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
            status = shell(["fit", *words, "-o", str(out)])
        summary = out / "summary.json"
        return status, text.getvalue(), json.loads(summary.read_text()) if summary.is_file() else {}


def kind(name: str) -> str:
    """Return the path of a file that reproduces that of an instrument."""
    if DATA is None:
        raise FileNotFoundError("no folder shared/data beside the checkout")
    return str(DATA / "kinds" / name)


def disagreement(f: Callable[[Any], Any], at: Any, change: Any, step: float = 1e-4) -> np.ndarray:
    """Return the relative differences of each output of f between forward mode and central differences, of two steps."""
    f = programs(f)
    forward = np.asarray(jax.jvp(f, (at,), (change,))[1])
    slope = lambda h: (np.asarray(f(at + h * change)) - np.asarray(f(at - h * change))) / (2.0 * h)
    # without the error in step^2
    return np.abs(forward / ((4.0 * slope(step) - slope(2.0 * step)) / 3.0) - 1.0)


programs = functools.cache(jax.jit)


# ---- derivatives --------------------------------------------------------------------------------------------------------


@line(
    "1",
    "the derivative of fields by depth",
    "simulate/test_subsurface.py::test_the_derivative_of_the_displacement_by_depth_is_the_strain_of_hookes_law",
)
def _depths() -> Iterator[Finding]:
    grid, film = jc.Grid((8, 8), (20e-6, 20e-6)), jc.Elastic(1e9, 0.4)
    body = jc.LayeredHalfSpace([jc.Layer(film, 30e-6)], jc.Elastic(20e9, 0.3))
    x, y = grid.coordinates()
    pressure = 1e7 * jnp.exp(-(x**2 + y**2) / (40e-6) ** 2)

    @jax.jit
    def slope(z: Any) -> Any:
        """The change of the displacement with depth by automatic differentiation, and by the stresses."""
        fields = lambda z: jc.subsurface(body, grid, pressure, depths=z[None])
        stress = fields(z).stress[0]
        strain = (stress[2, 2] - film.nu * (stress[0, 0] + stress[1, 1])) / (2.0 * film.G * (1.0 + film.nu))
        return jax.jacfwd(lambda z: fields(z).displacement[0, 2])(z), strain

    for share, was in ((0.0, "260 %"), (0.01, "38 %"), (0.1, "1.7 %")):
        derivative, strain = slope(jnp.asarray(30e-6 * share))
        off = float(jnp.max(jnp.abs(derivative - strain)) / jnp.max(jnp.abs(strain)))
        yield at_most(f"du_z/dz and Hooke's law, z/h = {share:g}", was, 100 * off, 0.1, "%")


@line(
    "2",
    "derivatives by the spacing of verbs with a velocity",
    "simulate/test_every_derivative.py::test_both_modes_and_central_differences_agree",
)
def _spacing() -> Iterator[Finding]:
    body = jc.LayeredHalfSpace([], jc.StandardLinearSolid(2e9, 1e9, 40e9, nu=0.35))
    ball, control = jc.Sphere(5e-3, STEEL), jc.Load(0.12)

    def steady(factor: Any) -> Any:
        grid = jc.Grid((15, 13), (13e-6 * factor, 15e-6))
        run = jc.slide_steady(body, ball, control, velocity=2e-6, grid=grid, tolerance=1e-11)
        return jnp.stack([run.approach / 3e-6, run.power / 5e-9])

    off = disagreement(steady, jnp.asarray(1.0), jnp.asarray(1.0))
    yield at_most("slide_steady, approach", "-0.0087 for +0.0239", off[0], 1e-5)
    yield at_most("slide_steady, power", "1.028 for 0.278", off[1], 1e-5)


@line(
    "3",
    "films on creeping substrates, by nu and thickness",
    "response/test_stack.py::test_images_of_creeping_bodies_have_the_derivatives_of_the_response",
)
def _creeping_base() -> Iterator[Finding]:
    grid, times = jc.Grid((15, 13), (13e-6, 15e-6)), np.array([0.0, 8.0, 110.0])

    def approach(factors: Any) -> Any:
        film, base = (
            jc.StandardLinearSolid(**SLS, nu=0.4 * factors[0]),
            jc.StandardLinearSolid(2e9, 1e9, 40e9, nu=0.35),
        )
        body = jc.LayeredHalfSpace([jc.Layer(film, 6e-6 * factors[1])], base)
        run = jc.indent(body, jc.Sphere(5e-3, STEEL), jc.Load(0.12), times, grid=grid, tolerance=1e-11)
        return run.approach[-1] / 3e-6

    for k, name in enumerate(("nu", "thickness")):
        # the step is long because a delayed response has a noise of 5e-7
        off = disagreement(approach, jnp.ones(2), jnp.eye(2)[k], 1e-3)
        yield at_most(
            f"approach by {name} of the film", "4 to 21 % off" if k == 0 else "off", float(off), 1e-4
        )


held(
    "4",
    "every verb by every leaf, and after a step that ran away",
    "simulate/test_every_derivative.py::test_both_modes_and_central_differences_agree",
    "simulate/test_rub.py::test_behind_a_step_that_is_too_long_the_derivatives_are_as_finite_as_the_values",
)


# ---- simulations --------------------------------------------------------------------------------------------------------


@line(
    "5",
    "comparisons with absolute tolerances",
    "simulate/test_units_of_length.py::test_kernels_of_cells_of_another_size_are_refused_at_half_a_nanometre",
    "bodies/test_surface_files.py::test_a_scan_of_pixels_of_two_nanometres_is_not_that_of_cells_of_eight",
    "project/test_architecture.py::test_comparisons_state_their_absolute_tolerance",
)
def _nanometres() -> Iterator[Finding]:
    tip, control = jc.Sphere(50e-9), jc.Load(1e-9)
    own, other = (jc.Grid((12, 12), (dx, dx)) for dx in (0.5e-9, 1e-9))
    kernels = jc.kernels(HALF_SPACE, tip, other)
    press = lambda: jc.indent(HALF_SPACE, tip, control, [0.0], grid=own, kernels=kernels)
    yield refused("kernels of 1 nm on cells of 0.5 nm", "accepted, approach 37 % off", press, "kernels|grid")
    other = jc.LayeredHalfSpace([], jc.Elastic(2e9, 0.3))
    press = lambda: jc.indent(other, tip, control, [0.0], grid=own, kernels=jc.kernels(HALF_SPACE, tip, own))
    yield refused("kernels of half the modulus", "accepted, approach 59 % off", press, "kernels")


@line(
    "6a",
    "the error of time steps that are too long",
    "simulate/test_time_steps.py::test_a_relaxation_in_a_single_step_knows_its_error",
    "simulate/test_time_steps.py::test_an_error_that_the_body_has_forgotten_has_no_status",
    "simulate/test_time_steps.py::test_shear_and_slide_know_the_error_of_a_relaxation",
    "simulate/test_time_steps.py::test_automatic_substeps_of_a_relaxation",
    "shell/test_check.py::test_check_foretells_the_error_of_the_time_steps",
)
def _time_steps() -> Iterator[Finding]:
    """G(t)/G(0) = 0.1 + 0.9 exp(-10 t) of 1/G(0) (1 + 9 (1 - exp(-t))), at a given approach."""
    body = jc.LayeredHalfSpace([], jc.StandardLinearSolid(1e9, 1e9 / 9.0, 1e9 / 9.0, 0.3))
    grid, ball, depth = jc.Grid.square(n=16, width=200e-6), jc.Sphere(5e-3), jc.Approach(1e-6)
    for last, was, status in ((10.0, "89 %, status 0", 12), (100.0, "8 %, status 0, no note", 0)):
        run = jc.indent(body, ball, depth, [0.0, last], grid=grid)
        off = 1.0 - float(run.load[-1] / run.load[0]) / (0.1 + 0.9 * math.exp(-10.0 * last))
        told, found = float(run.time_step_error[-1]), int(run.status[-1])
        good = off / 2.0 < told < 2.0 * off and found == status and bool(run.notes)
        now = f"{100 * off:.2g} %, estimated {100 * told:.2g} %, status {found}, {len(run.notes)} note"
        yield Finding(f"relaxation in one step of {last:g} s", was, now, "estimate, note, status", good)
    run = jc.indent(body, ball, depth, [0.0, 0.3, 1.0], grid=grid, substeps="auto")
    exact = 0.1 + 0.9 * np.exp(-10.0 * np.array([0.0, 0.3, 1.0]))
    off = float(np.max(np.abs(run.load / run.load[0] / exact - 1.0)))
    yield at_most('substeps="auto" of a relaxation', "none", 100 * off, 1.0, "%")


@line(
    "6b",
    "the error of the reduced time",
    "simulate/test_time_steps.py::test_automatic_substeps_of_a_film_that_friction_warms",
)
def _reduced_time() -> Iterator[Finding]:
    film = jc.Layer(jc.Maxwell(G=5e8, eta=2e13, nu=0.3), thickness=40e-6)
    body = jc.LayeredHalfSpace([film], substrate=jc.Elastic.from_young(210e9))
    times = np.linspace(0.0, 400.0, 9)
    speed = np.interp(times, [0.0, 200.0, 400.0], [0.0, 0.3, 0.05])
    heat = jc.Thermal(ambient=350.0, conductivity=1.0, share=0.5, shift=jc.ArrheniusShift(1.5e-19, 350.0))
    run = lambda substeps: jc.rub(
        body,
        jc.Sphere(10e-3),
        jc.Load(2.0),
        times,
        velocity=np.stack([speed, 0.0 * speed], -1),
        law=None,
        grid=jc.Grid.square(n=16, width=900e-6),
        friction=0.3,
        thermal=heat,
        substeps=substeps,
    )
    fine, found = run(128), run("auto")
    off = float(np.max(np.abs(found.approach / fine.approach - 1.0)))
    taken = found.diagnostics.refined
    yield Finding(
        "approach of a warmed film, auto",
        "30 %, 1 substep",
        f"{100 * off:.2g} %, {taken} substeps",
        "<= 1 %",
        off < 0.01,
    )


@line(
    "7",
    "the contact area on cells that are not square",
    "contact/test_contact_area.py::test_hertz_at_random_places_on_cells_that_are_not_square",
    "contact/test_contact_area.py::test_the_edge_of_a_line_contact_on_cells_that_are_not_square",
)
def _oblong_cells() -> Iterator[Finding]:
    for aspect, was in ((1.0, "0.02 %"), (3.0, "-2.3 %"), (7.0, "-4 %")):
        shape, sides = (int(14 * aspect), 14), (1.0, aspect)
        grid, rng, errors = jc.Grid(shape, sides), np.random.default_rng(5), []
        body = jc.LayeredHalfSpace([], jc.Elastic(1.0, 0.3))
        kernels = jc.kernels(body, jc.HeightField(jnp.zeros(shape)), grid)
        for _ in range(8):
            a, centre = 4.0 * aspect * (0.9 + 0.2 * rng.random()), rng.random(2) - 0.5
            x, y = (
                (np.arange(n) - (n - 1) / 2 - c) * d for n, c, d in zip(shape, centre, sides, strict=True)
            )
            heights = -(x[:, None] ** 2 + y[None, :] ** 2) / 2e3
            load = jc.Load(8.0 / 3.0 / 0.7 * a**3 / 1e3)
            run = jc.indent(body, jc.HeightField(heights), load, [0.0], grid=grid, kernels=kernels)
            errors.append(float(run.smooth_area[0]) / (math.pi * a**2) - 1.0)
        off = 100 * abs(float(np.mean(errors)))
        yield at_most(f"mean area, aspect {aspect:g}, 8 cells across", was, off, 0.25, "%")


@line(
    "8",
    "masked arrays",
    "project/test_masked_arrays.py::test_a_mask_is_refused_with_the_number_of_its_entries",
    "project/test_masked_arrays.py::test_a_quantity_is_refused_with_its_unit",
)
def _masks() -> Iterator[Finding]:
    spike = np.ma.array(np.zeros((8, 8)), mask=np.eye(8, dtype=bool))
    t = np.ma.array(np.arange(1.0, 9.0), mask=np.arange(8) == 3)
    grid = jc.Grid((8, 8), (1e-6, 1e-6))
    for what, call in (
        ("HeightField", lambda: jc.HeightField(spike)),
        ("Load", lambda: jc.Load(t)),
        ("CreepData", lambda: fitting.CreepData(t=np.arange(8.0), J=t, start=0.0)),
        ("surface_statistics", lambda: jc.surface_statistics(spike, grid)),
        ("minimise", lambda: fitting.minimise(lambda p: jnp.sum(p["x"] ** 2), {"x": t})),
        ("hardness", lambda: jc.indent(HALF_SPACE, jc.Sphere(1e-3), jc.Load(1e-3), [0.0], grid=grid, hardness=spike + 1e9)),
    ):  # fmt: skip
        yield refused(what, "mask lost", call, "masked")
    quantity = np.ones(2).view(type("Quantity", (np.ndarray,), {"unit": "mN", "to": None}))
    yield refused("a load in mN", "unit lost", lambda: jc.Load(quantity), "unit")


@line(
    "9",
    "materials of spectra over tens of decades",
    "fitting/test_fitting_maxwell.py::test_spectra_over_tens_of_decades_give_the_creep_of_mpmath",
)
def _decades() -> Iterator[Finding]:
    """J(0) is the inverse of the sum of all moduli, J(inf) that of the equilibrium modulus."""
    tau = np.logspace(-10, 20, 16)
    G, rest = 10 ** np.linspace(9, 5, 16), 3e7
    t = np.geomspace(tau[0] / 3.0, 3.0 * tau[-1], 150)
    data = fitting.RelaxationData(t, rest + np.exp(-t[:, None] / tau) @ G, start=0.0)
    fit = fitting.fit_maxwell(data, tau, weights="relative")
    found = [fit.values[f"G{i + 1}"] for i in range(16)]
    J = fit.material.creep(np.array([0.0, 1e25]))
    right = (sum(found) + fit.values["Ge"]) / fit.values["Ge"]
    yield within("J(inf)/J(0), 30 decades", "1.44 for 19.7", float(J[1] / J[0]), right, 1e-6)


held(
    "10",
    "the order of statuses",
    "simulate/test_inherited_status.py::test_of_every_pair_of_statuses_the_one_that_the_documentation_lists_first_is_reported",
)


@line(
    "11",
    "wear through the film to its base",
    "results/test_rubbed_films.py::test_wear_down_to_the_base_has_a_note_with_its_time_and_its_share_of_the_contact",
)
def _worn_through() -> Iterator[Finding]:
    thin = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9, 0.3), 2e-7)], jc.Elastic.from_young(210e9))
    run = jc.rub(
        thin,
        jc.Sphere(5e-3),
        jc.Load(1.0),
        np.linspace(0.0, 10.0, 11),
        velocity=0.1,
        law=jc.Archard(4e-15),
        grid=jc.Grid((24, 24), (12e-6, 12e-6)),
        substeps=4,
    )
    told = [note for note in run.notes if "worn to its base" in note]
    yield Finding("a film worn to its base", "silent", (told or ["silent"])[0][:80], "a note", bool(told))


# ---- fits ---------------------------------------------------------------------------------------------------------------


@functools.cache
def creep_curve(seed: int = 0, size: float = 0.01) -> fitting.CreepData:
    """Return a creep curve of a standard solid, 60 points, with noise in proportion."""
    t = np.linspace(1.0, 100.0, 60)
    J = coverage.creep(t, **SLS) * (1.0 + size * np.random.default_rng(seed).standard_normal(60))
    return fitting.CreepData(t=t, J=J, start=0.0)


@line(
    "12", "a stated sigma", "fitting/test_conclusion.py::test_a_stated_sigma_is_compared_with_the_residuals"
)
def _stated_sigma() -> Iterator[Finding]:
    data = creep_curve()
    right = 0.01 * coverage.creep(data.t, **SLS)
    for factor, was in ((1.0, "accepted"), (0.1, "accepted"), (10.0, "accepted")):
        fit = fitting.fit_creep(data, "StandardLinearSolid", sigma=factor * right)
        named = any("stated sigma" in words for words in (*fit.refused, *fit.notes))
        low, high = fit.intervals["G1"]
        now = f"chi2 {fit.chi2:.3g}, {fit.verdict}{', named' if named else ''}, G1 {high / low - 1:.1%} wide"
        shown = f"{fit.chi2:.2g}"[:3] in fit.summary()
        good = (named == (factor != 1.0)) and shown
        yield Finding(f"sigma {factor:g} times the true one", was, now, "named unless 1", good)


@line(
    "13",
    "the pull-off force",
    "fitting/test_adhesive_curve.py::test_the_pull_off_is_that_of_the_fitted_curve_and_not_the_lowest_reading",
)
def _pull_off() -> Iterator[Finding]:
    truth, inside = 1.5 * math.pi * WORK * RADIUS, 0
    for seed in range(8):
        fit = fitting.fit_indentation(
            force_curve(None, noise=1.5 * 0.08, seed=seed),
            "Elastic",
            adhesion="JKR",
            indenter=jc.Sphere(RADIUS),
            nu=NU_OF_CURVE,
            control="depth",
            contact_point="fit",
        )
        inside += fit.pull_off[1] <= truth <= fit.pull_off[2]
    yield Finding("intervals that hold 3/2 pi w R", "1 of 8", f"{inside} of 8", ">= 7 of 8", inside >= 7)


@line(
    "14",
    "creep moduli",
    "fitting/test_foreign_files.py::test_a_creep_modulus_is_the_inverse_of_a_tensile_compliance",
    "fitting/test_foreign_files.py::test_a_creep_modulus_under_a_longer_name_is_no_relaxation_modulus",
    "fitting/test_kinds_of_files.py::test_the_modulus_of_a_creep_test_is_not_read_as_a_relaxation_modulus",
)
def _creep_modulus() -> Iterator[Finding]:
    """D = 1e-9 (t/s)^0.2 [1/Pa] in tension; J = 2 (1 + nu) D, whose springpot has V = 1/(2 (1 + nu) 1e-9 Gamma(1.2))."""
    t = np.geomspace(1.0, 1e4, 25)
    right = 1.0 / (2.7e-9 * math.gamma(1.2))
    with tempfile.TemporaryDirectory() as folder:
        for name in ("Creep modulus [MPa]", "Kriechmodul [MPa]", "Creep Modulus of film A [MPa]"):
            path = Path(folder) / "creep.csv"
            path.write_text(f"t [s],{name}\n" + "".join(f"{a:.9g},{1e3 / a**0.2:.9g}\n" for a in t))
            chosen = lambda key: {"columns": {key: name}} if "film" in name else {}  # noqa: B023
            read = lambda: fitting.read_relaxation(path, **chosen("modulus"))  # noqa: B023
            yield refused(f"{name} as a relaxation", "16 % off", read, "creep")
            data = fitting.read_creep(path, convention="D", nu=0.35, start=0.0, **chosen("creep_modulus"))
            fit = fitting.fit_creep(data, "Springpot", weights="relative")
            yield within(f"{name} as creep", "-", fit.values["V"], right, 1e-3, "Pa s^a")


@line(
    "15",
    "rows at one frequency beside a sweep",
    "fitting/test_foreign_files.py::test_rows_at_one_frequency_are_no_part_of_a_sweep",
    "fitting/test_foreign_files.py::test_an_index_column_and_a_turn_divide_a_table",
    "fitting/test_kinds_of_files.py::test_the_right_value",
)
def _time_sweep() -> Iterator[Finding]:
    _, _, found = command("oscillation", kind("sweep_then_time_sweep.csv"), "--model", "StandardLinearSolid")
    yield within(
        "a sweep, then rows over time: G1", "917, accepted", found["parameters"]["G1_Pa"], 1500.0, 0.01, "Pa"
    )
    words = (
        "oscillation",
        kind("sweep_recovery_sweep.csv"),
        "--model",
        "StandardLinearSolid",
        "--segment",
        "2",
    )
    found = command(*words)[2]
    yield within(
        "the third of three parts: G1", "inseparable", found["parameters"]["G1_Pa"], 3000.0, 0.01, "Pa"
    )


@line(
    "16",
    "a contact area that the file states",
    "fitting/test_kinds_of_files.py::test_the_area_of_the_file_is_compared_with_another",
)
def _stated_area() -> Iterator[Finding]:
    words = "stiffness", kind("nanodma_like.txt"), "--cone", "berkovich", "--tip-modulus", "1141e9"
    found = command(*words)[2]
    yield within(
        "Young's modulus", "three times it", found["youngs_modulus_Pa"]["value"] / 1e9, 67.8, 0.002, "GPa"
    )


@line(
    "17",
    "joined repeats",
    "fitting/test_conclusion.py::test_joined_runs_have_the_variation_between_them_in_the_intervals",
    "fitting/test_together.py::test_tests_that_differ_by_a_factor_are_rejected",
)
def _repeats() -> Iterator[Finding]:
    t, rng, inside = np.repeat(np.linspace(2.0, 100.0, 30), 2), np.random.default_rng(6), 0
    for _ in range(40):
        J = np.tile(1.0 + 0.01 * rng.standard_normal(2), 30) * coverage.creep(t, **SLS)
        J = J * (1.0 + 0.002 * rng.standard_normal(60))
        fit = fitting.fit_creep(fitting.CreepData(t=t, J=J, start=0.0), "StandardLinearSolid")
        inside += fit.intervals["G1"][0] <= SLS["G1"] <= fit.intervals["G1"][1]
    yield Finding("intervals that hold G1", "40 %", f"{inside} of 40", ">= 35 of 40", inside >= 35)


@line(
    "18",
    "searches that end too early",
    "fitting/test_modulus.py::test_a_search_that_takes_more_than_sixty_steps_ends_at_the_least_squares",
    "fitting/test_modulus.py::test_a_search_that_does_not_converge_is_not_accepted",
    "fitting/test_modulus.py::test_a_minimum_that_a_single_start_reached_has_a_note",
)
def _long_searches() -> Iterator[Finding]:
    """Burgers relaxations, sum of two exponentials; the least squares of scipy from the truth is the oracle."""

    def relaxation(t: np.ndarray, G1: float, G2: float, eta1: float, eta2: float) -> np.ndarray:
        a, b = eta1 / G1 + eta1 / G2 + eta2 / G2, eta1 * eta2 / (G1 * G2)
        root = math.sqrt(a * a - 4.0 * b)
        fast, slow = (a + root) / (2.0 * b), (a - root) / (2.0 * b)
        share = lambda r: (eta1 - eta1 * eta2 / G2 * r) / root
        return share(slow) * np.exp(-slow * t) - share(fast) * np.exp(-fast * t)

    rng, missed = np.random.default_rng(8), 0
    for _ in range(12):
        G1, G2 = 10 ** rng.uniform(5, 7, 2)
        true = {
            "G1": G1,
            "G2": G2,
            "eta1": G1 * 10 ** rng.uniform(0, 2),
            "eta2": G2 * 10 ** rng.uniform(-1, 1),
        }
        t = np.geomspace(0.05, 50.0, 45)
        G = relaxation(t, **true) * (1.0 + 0.005 * rng.standard_normal(45))
        off = lambda p: relaxation(t, **dict(zip(true, np.exp(p), strict=True))) / G - 1.0  # noqa: B023
        best = 2.0 * optimize.least_squares(off, np.log(list(true.values())), xtol=1e-12, ftol=1e-12).cost
        data = fitting.RelaxationData(t=t, modulus=G, start=0.0)
        fit = fitting.fit_relaxation(data, "Burgers", weights="relative")
        missed += float(np.sum((fit.modulus(t) / G - 1.0) ** 2)) > 1.001 * best
    yield at_most("of 12 Burgers relaxations, optima missed", "4 of 77", missed, 0)


@line(
    "19",
    "clean short curves",
    "fitting/test_verdict.py::test_short_clean_curves_of_the_right_model_stand",
    "fitting/test_verdict.py::test_the_probability_of_a_trend_is_that_of_simulated_noise",
    "fitting/test_verdict.py::test_a_wrong_model_of_few_points_is_still_rejected",
)
def _short_curves() -> Iterator[Finding]:
    for n, was in ((6, "10 to 27 %"), (8, "5 to 8 %"), (10, "2 to 11 %")):
        row = coverage.Row("StandardLinearSolid", 6, "relative", "even", case=f"{n} points")
        t, clean = coverage.times(row), coverage.creep(coverage.times(row), **coverage.truth(row))
        J = clean * (1.0 + 0.01 * np.random.default_rng(n).standard_normal((300, n)))
        found = fitting.fit_creep_batch(t, J, row.model, weights="relative", start=0.0)
        yield at_most(f"rejected, {n} points", was, 100 * float(found.refused.mean()), 2.0, "%")


@line(
    "20",
    "noise that changes along the curve",
    "fitting/test_conclusion.py::test_noise_that_changes_along_the_curve_is_estimated",
    "fitting/test_conclusion.py::test_noise_of_one_size_is_seldom_found_to_change",
    "fitting/test_verdict.py::test_intervals_allow_for_the_place_at_which_the_noise_changes",
)
def _changing_noise() -> Iterator[Finding]:
    row = coverage.Row("StandardLinearSolid", 6, "stepped", "even")
    found = coverage.covered(row, 60)
    shares = ", ".join(f"{name} {100 * share:.0f} %" for name, share in found.held.items())
    yield Finding(
        "intervals that hold the truth, 60 sets",
        "75 to 81 %",
        shares,
        ">= 87 %",
        min(found.held.values()) >= 0.87,
    )


@line(
    "21",
    "an induction time that is left out",
    "fitting/test_growth.py::test_an_induction_time_that_is_left_out_is_named_and_fitted_on_request",
    "fitting/test_growth.py::test_curves_of_the_right_kinetics_have_no_common_shape",
)
def _induction() -> Iterator[Finding]:
    """dh/dt = g - r h from the induction time on: h = g/r (1 - exp(-r (t - t0)))."""
    law = {"rate": 1e-3, "activation_energy": 1e-19, "activation_volume": 2e-28, "removal_rate": 1e-3}
    t, data = np.linspace(0.0, 7200.0, 25), []
    rng = np.random.default_rng(1)
    for stress, temperature in ((1e8, 363.0), (2e8, 373.0), (3e8, 373.0), (2e8, 383.0)):
        energy = law["activation_energy"] - law["activation_volume"] * stress
        growth = law["rate"] * math.exp(-energy / (1.380649e-23 * temperature))
        h = growth / law["removal_rate"] * -np.expm1(-law["removal_rate"] * np.maximum(t - 600.0, 0.0))
        h = h * (1.0 + 0.03 * rng.standard_normal(25)) + 0.01 * h.max() * rng.standard_normal(25)
        data.append(fitting.GrowthData(t, h, stress=stress, temperature=temperature))
    yield verdict(
        "growth after 600 s, fitted without",
        "accepted",
        fitting.fit_growth(data),
        "rejected",
        "common shape|trend",
    )
    fit = fitting.fit_growth(data, induction="fit")
    yield within("the induction time, fitted", "not offered", fit.induction[0], 600.0, 0.1, "s")


@line(
    "22",
    "what explains less than a constant",
    "fitting/test_verdict.py::test_what_explains_less_than_a_constant_is_rejected_in_every_kind_of_fit",
)
def _worse_than_a_constant() -> Iterator[Finding]:
    rng = np.random.default_rng(3)
    depth = np.linspace(2e-8, 4e-7, 40)
    falling = 1e5 * np.abs(1.0 - 0.8 * depth / depth[-1]) * (1.0 + 0.3 * rng.standard_normal(40))
    fit = fitting.fit_stiffness(fitting.StiffnessData(depth, np.abs(falling)), indenter=jc.Sphere(5e-6))
    yield verdict(f"stiffness, R2 {fit.r2:.2g}", "accepted at -1.3", fit, "rejected", "constant")
    omega = np.geomspace(0.1, 10.0, 30)
    G = 1e5 * 1j * omega / (1 + 1j * omega) + 3e5 * (rng.standard_normal(30) + 1j * rng.standard_normal(30))
    data = fitting.OscillationData(omega=omega, storage=G.real, loss=G.imag)
    fit = fitting.fit_oscillation(data, "Maxwell", weights="absolute")
    yield verdict("errors of 300 % of |G*|", "accepted", fit, "rejected", "signal|constant")


@line(
    "23",
    "the leverage of an end",
    "fitting/test_verdict.py::test_a_point_that_decides_a_parameter_alone_is_no_outlier",
    "fitting/test_together.py::test_a_point_that_would_determine_a_parameter_alone_is_no_outlier",
)
def _clean_film() -> Iterator[Finding]:
    """The stiffness of a film from a Legendre-Galerkin solution of another module, with 0.2 % of noise."""
    body, radii = abel.Layered(2e9, 0.35, 1e-6, 30e9, 0.2, 0.0), np.geomspace(0.1, 2.5, 40) * 1e-6
    depth = np.array([abel.solve_radius(a, body, 5e-6, 20).approach for a in radii])
    known = np.array([1.0 / abel.punch_compliance(a, body, 20) for a in radii])
    rejected = 0
    for seed in range(8):
        measured = known * (1.0 + 0.002 * np.random.default_rng(seed).standard_normal(40))
        fit = fitting.fit_stiffness(
            fitting.StiffnessData(depth, measured),
            indenter=jc.Sphere(5e-6),
            nu=0.35,
            thickness=1e-6,
            substrate=jc.Elastic(30e9, 0.2),
            weights="relative",
        )
        rejected += bool(fit.refused)
    yield at_most("of 8 clean films, rejected", "1 of 5", rejected, 0)


@line(
    "24",
    "holds that are short beside their ramp",
    "fitting/test_contact_points.py::test_a_hold_that_is_short_beside_its_ramp_is_found",
)
def _short_holds() -> Iterator[Finding]:
    words = "--cone", "berkovich", "--segment", "hold", "--nu", "0.3", "--model", "StandardLinearSolid"
    for name in ("hold_30_5_30.csv", "hold_36_2_5.csv"):
        data = fitting.read_indentation(kind(name))
        start = float(name.split("_")[1])
        found = data.t[data.segments == "hold"]
        yield within(f"{name}: begin of the hold", "at 97 % of the load", float(found[0]), start, 0.01, "s")
    found = command("indentation", kind("hold_30_5_30.csv"), *words)[2]
    yield within("hold_30_5_30.csv: G1", "-", found["parameters"]["G1_Pa"] / 1e9, 2.0, 0.02, "GPa")


@line(
    "25",
    "inputs of fits in other units, clocks and sizes",
    "fitting/test_indentation_fits.py::test_depths_in_other_units_are_refused",
    "fitting/test_stiffness.py::test_depths_in_other_units_are_refused",
    "fitting/test_indentation_fits.py::test_a_hold_with_a_clock_of_its_own_has_a_note_on_its_ramp",
    "fitting/test_adhesive_curve.py::test_a_curve_in_other_units_or_with_another_sign_is_refused",
    "fitting/test_modulus.py::test_a_standard_deviation_far_from_the_data_is_refused",
    "fitting/test_modulus.py::test_a_curve_is_not_evaluated_before_the_load",
    "fitting/test_modulus.py::test_a_column_of_stresses_is_not_read_as_a_modulus",
    "fitting/test_modulus.py::test_very_many_points_end_at_the_least_squares",
)
def _odd_inputs() -> Iterator[Finding]:
    data = creep_curve()
    good = force_curve(None, noise=0.01)
    deep = fitting.IndentationData(t=good.t, load=good.load, depth=1e3 * good.depth, marks=good.marks)
    jkr = functools.partial(
        fitting.fit_indentation,
        model="Elastic",
        adhesion="JKR",
        indenter=jc.Sphere(RADIUS),
        nu=NU_OF_CURVE,
        control="depth",
        contact_point="fit",
    )
    yield refused("JKR, depths in nm taken as um", "accepted", lambda: jkr(deep), "depth")
    depth = np.linspace(5e-8, 1e-6, 50)
    wrong = fitting.StiffnessData(depth=1e3 * depth, stiffness=1e8 * np.sqrt(depth))
    stiff = lambda: fitting.fit_stiffness(wrong, indenter=jc.Sphere(5e-6))
    yield refused("stiffness, depths in mm", "accepted, G 32 times too small", stiff, "depth")
    over = lambda: fitting.fit_creep(data, "StandardLinearSolid", sigma=1e300)
    yield refused("sigma = 1e300", "an error of numpy", over, "sigma")
    fit = fitting.fit_creep(data, "StandardLinearSolid")
    yield refused("band at t < 0", "a number", lambda: fit.band(np.array([-1.0])), "t: expected")
    t = np.linspace(1e-3, 1e2, 300_000)
    G = 1e6 * (1.0 + 2.0 * np.exp(-t / 7.0)) * (1.0 + 0.01 * np.random.default_rng(0).standard_normal(t.size))
    began = time.process_time()
    many = fitting.fit_relaxation(fitting.RelaxationData(t, G, start=0.0), "StandardLinearSolid")
    spent = time.process_time() - began
    off = abs(many.values["G1"] / 3e6 - 1.0)
    now = f"G1 {100 * off:.2g} % off, {spent:.0f} s"
    yield Finding("300,000 points", "54 s for a million", now, "< 20 s, 0.1 %", spent < 20.0 and off < 1e-3)


@line(
    "26",
    "master curves without overlap, relaxations over 43 decades",
    "fitting/test_fitting_master.py::test_curves_that_do_not_overlap_are_named",
    "fitting/test_modulus.py::test_a_relaxation_over_43_decades_is_found_wherever_it_lies",
)
def _no_overlap() -> Iterator[Finding]:
    curves, rng = [], np.random.default_rng(2)
    for place, temperature in enumerate((300.0, 320.0, 340.0)):
        omega = np.geomspace(1.0, 3.0, 12)
        x = omega * 10.0 ** (-1.5 * place)  # of a power law of 0.4: moduli that no other curve has
        G = 1e6 * (1j * x) ** 0.4 * (1.0 + 0.005 * rng.standard_normal(12))
        curves.append(fitting.OscillationData(omega, G.real, G.imag, temperature=temperature))
    yield verdict(
        "three curves apart", "accepted", fitting.fit_master(curves, reference=320.0), "rejected", "overlap"
    )
    t = np.geomspace(1e-20, 1e23, 87)
    tau, G1, G2 = 1e18, 1e9, 1e7
    rest = G1 * G2 / (G1 + G2)
    G = (rest + (G1 - rest) * np.exp(-t / tau)) * (1.0 + 0.01 * np.random.default_rng(1).standard_normal(87))
    data = fitting.RelaxationData(t=t, modulus=G, start=0.0)
    fit = fitting.fit_relaxation(data, "StandardLinearSolid", weights="relative")
    yield within("eta2 of 43 decades", "optimum missed", fit.values["eta2"], tau * (G1 + G2), 0.05, "Pa s")


@line(
    "27",
    "fits that pickle, misfits in notes",
    "fitting/test_conclusion.py::test_every_kind_of_result_can_be_pickled",
    "fitting/test_conclusion.py::test_fits_come_back_from_a_process_pool",
    "fitting/test_creep.py::test_misfit_is_flagged_and_widens",
)
def _pickles() -> Iterator[Finding]:
    fit = fitting.fit_creep(creep_curve(), "StandardLinearSolid")
    back = pickle.loads(pickle.dumps(fit))
    yield Finding(
        "a fit, pickled and back",
        "an error",
        f"G1 {back.values['G1']:.5g}",
        "the same",
        back.values == fit.values,
    )
    fit = fitting.fit_creep(creep_curve(size=1e-4), "Maxwell")
    said = (*fit.refused, *fit.notes)
    named = [words for words in said if "misfit" in words.lower() or "trend" in words]
    yield Finding(
        "a Maxwell fluid for a solid", "printed only", (named or ["nothing"])[0][:70], "in notes", bool(named)
    )


# ---- files and commands -------------------------------------------------------------------------------------------------


@line("28", "one file at several temperatures", "fitting/test_kinds_of_files.py::test_the_right_value")
def _temperatures() -> Iterator[Finding]:
    found = command("master", kind("creep_temperatures.csv"), "--reference", "373.15")[2].get(
        "parameters", {}
    )
    yield within("creep at four temperatures: c1", "refused", found.get("c1", math.nan), 10.0, 0.02)
    words = *(kind(f"dynamic_{T}K.csv") for T in (277, 294, 310)), "--temperature", "277.15,294.15,310.15"
    found = command("master", *words, "--tension", "0.35", "--reference", "294.15")[2].get("parameters", {})
    yield within("tension, from |E*| and phase: c1", "refused", found.get("c1", math.nan), 12.0, 0.03)


@line(
    "29",
    "a film far below the contact, a parameter at its bound",
    "fitting/test_kinds_of_files.py::test_one_line_with_the_remedy",
    "fitting/test_stiffness.py::test_a_parameter_at_the_end_of_its_range_has_a_note",
)
def _deep_film() -> Iterator[Finding]:
    words = "stiffness", kind("csm_deep_film.csv"), "--cone", "berkovich", "--tip-modulus", "1141e9"
    status, said, _ = command(*words, "--thickness", "2e-7", "--substrate-modulus", "165e9")
    now = f"status {status}: {said.strip()[-70:]}"
    good = status == 2 and "20 thicknesses" in said and said.count("\n") == 1
    yield Finding("film of 200 nm", "min() arg is an empty sequence", now, "one line, a remedy", good)


@line(
    "30",
    "workbooks, texts and tables of other layouts",
    "fitting/test_kinds_of_files.py::test_the_right_value",
    "fitting/test_kinds_of_files.py::test_the_second_pair_of_digitised_columns",
    "fitting/test_kinds_of_files.py::test_a_table_on_its_side_has_the_values_of_the_same_curve",
    "fitting/test_workbooks.py::test_a_sheet_is_chosen_before_the_others_are_read",
    "fitting/test_asylum.py::test_a_wave_has_the_clock_that_it_states",
    "fitting/test_asylum.py::test_the_curves_of_a_map_have_values_times_and_places",
    "bodies/test_surface_files.py::test_a_unit_is_given_where_a_file_has_none",
    "bodies/test_surface_files.py::test_missing_points_are_filled_on_request",
    "bodies/test_surface_files.py::test_a_line_scan_is_a_surface_of_constant_height_along_y",
)
def _layouts() -> Iterator[Finding]:
    ball = "--radius", "3e-3", "--nu", "0.5", "--model", "Elastic"
    for name in (
        "book_stray_header.xlsx",
        "book_stray_rows.xlsx",
        "book_statistics_after.xlsx",
        "mach1_like.txt",
    ):
        found = command("indentation", kind(name), *ball)[2].get("parameters", {})
        yield within(f"{name}: G", "refused", found.get("G_Pa", math.nan), 2e4, 1e-3, "Pa")


@line(
    "31",
    "tables that are written are read back",
    "fitting/test_further_commands.py::test_every_table_is_read_back_by_pandas",
)
def _tables() -> Iterator[Finding]:
    import pandas

    with tempfile.TemporaryDirectory() as folder:
        words = [
            "fit",
            "oscillation",
            kind("tension_294K.csv"),
            "--tension",
            "0.35",
            "--model",
            "StandardLinearSolid",
        ]
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            shell([*words, "-o", f"{folder}/out"])
        table = pandas.read_csv(Path(folder) / "out" / "curve.csv")
        numbers = all(pandas.api.types.is_numeric_dtype(kind) for kind in table.dtypes)
        rows = len(fitting.read_oscillation(kind("tension_294K.csv"), convention="E", nu=0.35).omega)
    now = f"{table.shape[1]} columns of numbers, {len(table)} rows"
    yield Finding(
        "curve.csv of a sweep", "no CSV", now, f"numbers, {rows} rows", numbers and len(table) == rows
    )


held(
    "32",
    "studies of values with units",
    "shell/test_study_files.py::test_a_study_of_values_with_units_is_drawn_and_what_has_no_picture_is_said",
)
held(
    "33",
    "words of messages",
    "results/test_notes.py::test_a_film_strain_just_above_the_limit_is_not_printed_as_the_limit",
    "results/test_notes.py::test_a_number_in_a_message_lies_on_its_side_of_the_limit",
    "fitting/test_kinds_of_files.py::test_a_tilt_without_times_is_per_sample",
    "fitting/test_verdict.py::test_a_verdict_has_words",
    "fitting/test_kinds_of_files.py::test_a_relaxation_with_its_stress_or_its_strain_is_read",
    "results/test_summaries.py::test_a_step_without_a_result_prints_no_numbers_and_does_not_hide_the_largest_of_the_others",
    "shell/test_case_units.py::test_a_quantity_is_its_number_in_si",
)


# ---- pages, further functions, studies, memory --------------------------------------------------------------------------


@line(
    "37",
    "sources of published values",
    "project/test_benchmark_problems.py::test_the_page_has_the_table_of_the_files",
)
def _sources() -> Iterator[Finding]:
    docs = TESTS.parent / "docs"
    text = (docs / "benchmarks.md").read_text() + "".join(
        p.read_text() for p in docs.glob("benchmarks/*.json")
    )
    yield Finding(
        "author of the paper",
        "L. Wang",
        "D. Wang" if "D. Wang et al." in text else "?",
        "D. Wang",
        "L. Wang" not in text,
    )
    told = "Hayes" in (docs / "thin_samples.md").read_text()
    yield Finding(
        "Hayes's printed table", "not mentioned", "mentioned" if told else "not mentioned", "mentioned", told
    )
    yield Finding(
        "flash temperature of 166.8 K",
        "a reference",
        "none" if "166.8" not in text else "there",
        "none",
        "166.8" not in text,
    )


@line(
    "38",
    "stresses on periodic grids, fractional laws, Peclet numbers",
    "simulate/test_subsurface_on_periodic_grids.py::test_a_strip_of_pressure_in_plane_strain",
    "bodies/test_mittag_leffler.py::test_creep_and_relaxation_are_the_inverse_transforms_of_the_modulus",
    "simulate/test_heat.py::test_only_the_side_along_the_motion_counts_in_the_peclet_number_of_a_cell",
    "shell/test_storage.py::test_a_netcdf_file_names_the_version_and_has_no_internal_numbers_among_its_attributes",
)
def _further() -> Iterator[Finding]:
    """A wave of pressure p cos(k x): sigma_zz = -p (1 + k z) exp(-k z) cos(k x); a springpot: |G*| = V omega^a."""
    grid = jc.Grid((32, 1), (1e-6, 1e-3), periodic=(True, True))
    k = 2.0 * math.pi / 32e-6
    x = np.asarray(grid.coordinates()[0])
    run = jc.subsurface(HALF_SPACE, grid, 1e6 * np.cos(k * x), depths=np.array([5e-6]))
    found = float(np.max(np.abs(run.stress[0, 2, 2])) / np.max(np.abs(np.cos(k * x))))
    right = 1e6 * (1.0 + k * 5e-6) * math.exp(-k * 5e-6)
    yield within("a wave in plane strain, sigma_zz", "refused", found, right, 2e-3, "Pa")
    law = jc.Springpot(3.0, 0.4, nu=0.3)
    yield within(
        "|G*| of a springpot", "not offered", abs(complex(law.complex_modulus(2.0))), 3.0 * 2.0**0.4, 1e-9
    )
    right = 3.0 * 2.0**-0.4 / math.gamma(0.6)
    yield within("G(t) of a springpot", "not offered", float(law.relaxation(2.0)), right, 1e-9)


@line(
    "39",
    "designs, batches, sweeps and minima",
    "fitting/test_propagate.py::test_a_design_that_no_duration_satisfies_shows_the_best_one",
    "fitting/test_propagate.py::test_a_value_that_is_not_known_has_no_standard_deviation",
    "fitting/test_minimise.py::test_a_start_at_a_maximum_or_a_saddle_is_left",
    "fitting/test_further_commands.py::test_nothing_stops_a_batch",
    "fitting/test_map.py::test_a_folder_becomes_a_table_and_a_figure_and_is_continued",
    "shell/test_command_line.py::test_plot_and_convert_take_a_saved_result_and_overwrite_nothing",
    "project/test_fingerprint.py::test_a_function_is_another_by_anything_that_it_computes_with",
    "simulate/test_studies.py::test_a_cluster_without_workers_is_waited_for_with_a_word",
    "simulate/test_studies.py::test_a_killed_worker_of_ones_own_executor_costs_no_other_case",
    "shell/test_command_line.py::test_a_finished_run_has_nothing_left_to_resume_and_that_is_no_error",
)
def _studies() -> Iterator[Finding]:
    found = fitting.minimise(lambda p: jnp.cos(p["x"]), {"x": 0.0}, scale=1.0)
    yield within("cos x from its maximum", "+1, converged", float(found.value), -1.0, 1e-8)
    solid = jc.StandardLinearSolid(G1=1e6, G2=2e6, eta2=2e7, nu=0.3)
    test = next(
        one
        for one in fitting.design(solid, target=1e-4, shares=(1.0,), points=50).experiments
        if one.sampling == "even"
    )

    def bound(duration: float) -> float:
        """The largest standard deviation of a log parameter, by Cramer and Rao, of 50 points of 1 %."""
        t, p = np.arange(1, 51) * duration / 50, np.log([1e6, 2e6, 2e7])
        J = lambda u: np.exp(-u[0]) - np.exp(-u[1]) * np.expm1(-t * np.exp(u[1] - u[2]))
        columns = [(J(p + 1e-5 * e) - J(p - 1e-5 * e)) / (2e-5 * 0.01 * J(p)) for e in np.eye(3)]
        return float(np.sqrt(np.diag(np.linalg.inv(np.array(columns) @ np.array(columns).T))).max())

    best = min(bound(duration) for duration in np.geomspace(0.2, 1000.0, 200))
    yield within(
        "the best design where none suffices", "that of the longest", max(test.sd.values()), best, 0.05
    )
    with tempfile.TemporaryDirectory() as folder:
        bad, good = Path(folder) / "bad.csv", Path(folder) / "good.csv"
        bad.write_text("t [s],J [1/Pa]\n1,x\n")
        data = creep_curve()
        good.write_text(
            "t [s],J [1/Pa]\n" + "".join(f"{a:.9g},{b:.9g}\n" for a, b in zip(data.t, data.J, strict=True))
        )
        status = command("batch", "creep", str(bad), str(good), "--model", "StandardLinearSolid")[0]
    yield Finding(
        "fit batch with an input that fails", "status 0", f"status {status}", "status 3", status == 3
    )


@line(
    "40",
    "memory maps of a long process",
    "project/test_memory_maps.py::test_programs_are_released_before_half_of_the_limit_and_give_the_same_results",
    "project/test_memory_maps.py::test_a_process_that_solves_300_problems_of_different_shapes_lives",
)
def _memory_maps() -> Iterator[Finding]:
    """What a process does at a limit that it reaches with its first programs, in place of hours at that of the system."""
    script = (
        "import jax, jax.numpy as jnp, jaxcontact as jc\n"
        "from jaxcontact._compile.programs import watch_memory_maps\n"
        "seen = watch_memory_maps()\n"
        "seen.limit = 2 * seen._count() + 100; seen.allowed = 0.5 * seen.limit\n"
        "kept = [jax.jit(lambda x, n=n: jnp.sort(jnp.cumsum(x) * x) + n) for n in range(60)]\n"
        "for n, run in enumerate(kept): run(jnp.ones(n + 3)).block_until_ready()\n"
        "print(seen.releases, seen._count(), seen.limit)\n"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    releases, maps, limit = (float(word) for word in run.stdout.split()) if run.stdout else (0.0, 1.0, 0.0)
    now = f"{releases:.0f} releases, {maps:.0f} maps of {limit:.0f}"
    yield Finding("programs of 60 shapes", "dies", now, "below the limit", releases > 0 and maps < limit)


# ---- the table ----------------------------------------------------------------------------------------------------------


def main() -> int:
    """Print each line with its values, and return 1 where one does not hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("lines", nargs="*", metavar="LINE", help=f"among {', '.join(LINES)}; all when absent")
    options = parser.parse_args()
    if unknown := [each for each in options.lines if each not in LINES]:
        parser.error(f"expected lines among {', '.join(LINES)}, got {', '.join(unknown)}")
    broken = []
    for number in options.lines or LINES:
        subject, tests, measure = LINES[number]
        absent, began = missing_tests(tests), time.process_time()
        print(f"{number:>3} {subject}", flush=True)
        for test in absent:
            print(f"      no test {test}")
        good = not absent
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                for found in measure() if measure else ():
                    good = good and found.holds
                    word = "holds" if found.holds else "DOES NOT HOLD"
                    print(
                        f"      {found.what}: was {found.was}; is {found.now}; right {found.right}: {word}",
                        flush=True,
                    )
        except FileNotFoundError as error:
            print(f"      not measured: {error}")
        except Exception as error:
            good = False
            print(f"      DOES NOT HOLD: {type(error).__name__}: {error}")
        by = f"held by {len(tests)} test{'s' if len(tests) > 1 else ''}"
        print(
            f"      {'holds' if good else 'DOES NOT HOLD'}, {by}, {time.process_time() - began:.0f} s",
            flush=True,
        )
        broken += [] if good else [number]
        jax.clear_caches()
    print(f"{len(broken)} lines do not hold{': ' if broken else ''}{', '.join(broken)}")
    return int(bool(broken))


if __name__ == "__main__":
    sys.exit(main())
