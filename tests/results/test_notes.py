"""Notes on results: the words of a plain call's warnings, kept by every transformation, file and export."""

import csv
import dataclasses
import pickle
import re
import threading
import warnings
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bodies import GLASS, STEEL
from test_storage import made_up

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact._support.prefixes import told_apart
from jaxcontact._support.terminal import recorded_warnings
from jaxcontact.reference import hertz
from jaxcontact.results import storage
from jaxcontact.results.notes import Diagnostics, Note

UNDER_NO_CONTACT = jc.InteriorFields, jc.Deflection
RESULTS = {name: kind for name, kind in storage.result_classes().items() if kind not in UNDER_NO_CONTACT}
BALL = jc.Sphere(5e-3, STEEL)
GRID = jc.Grid.square(n=16, width=300e-6)


def troubled(kind):
    """A result with one note of each kind, as numbers, and these notes, as words; cells are 2 um x 3 um."""
    made, last = made_up(kind), "times" in {field.name for field in dataclasses.fields(kind)}
    over_time = lambda values: np.array(values if last else values[-1])
    area = 6e-12 * 25 * np.pi  # of 25 pi cells: 10 across
    result = dataclasses.replace(
        made,
        status=over_time([0, 0, 2]),
        film_strain=over_time([0.1, 0.2, 0.3125]),
        contact_area=over_time([0.0, area, area / 4.0]),
        diagnostics=Diagnostics(np.float64(0.07), np.float64(2e-4), np.bool_(True), np.int64(3)),
        **({"times": np.array([0.0, 5.0, 7.5])} if last else {}),
    )
    first, at = (
        (", the first is step 3 of 3 (t = 7.5 s)", ", at step 3 of 3 (t = 7.5 s)") if last else ("", "")
    )
    size = 3 if last else 1
    # of these, results without adhesion have none of its fields
    optional = {"jumps", "cohesive_cells"} & {f.name for f in dataclasses.fields(kind) if f.default is None}
    result = dataclasses.replace(result, **dict.fromkeys(optional))
    adhesive, smallest = (), f"smallest contact{at}"
    if kind in (jc.AdhesiveHistory, jc.AdhesiveSlidingHistory):
        result = dataclasses.replace(
            result,
            jumps=np.array([0, 1, 1]),
            cohesive_cells=np.array([5.0, 1.5, 5.0]),
            contact_area=np.array([0.0, area / 4.0, area / 16.0]),  # may shrink to nothing before separation
        )
        smallest = "largest contact, at step 2 of 3 (t = 5 s)"
        adhesive = (
            "the contact jumps in 1 of 3 steps, first at step 2 of 3 (t = 5 s): derivatives exclude a change of the time of"
            " jumps",
            "1.5 cells across the zone of attraction at the edge of contact: below 3 pull-off depends on the grid",
        )
    return result, (
        f"1 of {size} steps{first}: contact at the edge of the grid: use a wider grid",
        f"film strain reaches 0.31{at}: above 0.2 linear theory is inaccurate",
        "the shared decay rates have a relative error of up to 0.07: pass kernels with more nodes",
        "the response on the grid has a relative error of up to 0.0002: its fit by images is inaccurate",
        *adhesive,
        f"only 5.0 cells across the {smallest}: fewer than 10 are too coarse",
        'grid="auto": widened 3 times, to 1.2e-05 m',
    )


@pytest.fixture(params=RESULTS.values(), ids=RESULTS)
def told(request):
    return troubled(request.param)


WAYS = {
    "plain": lambda result: result,
    "jit": jax.jit(lambda result: result),
    "vmap": lambda result: jax.tree.map(lambda a: a[1], jax.vmap(lambda i: result)(jnp.arange(2))),
    "lax.map": lambda result: jax.tree.map(lambda a: a[1], jax.lax.map(lambda i: result, jnp.arange(2))),
    "pickle": lambda result: pickle.loads(pickle.dumps(result)),
}


@pytest.mark.parametrize("way", WAYS)
def test_every_result_keeps_its_notes_through_every_transformation(told, way):
    result, expected = told
    assert WAYS[way](result).notes == expected
    assert all(f"note: {note}" in str(result) for note in expected)


@pytest.mark.parametrize("ending", [".npz", ".nc"])
def test_every_result_keeps_its_notes_in_files_and_exports(told, ending, tmp_path):
    result, expected = told
    xarray = pytest.importorskip("xarray", reason="NetCDF is the extra jaxcontact[io]")
    path = jc.write_result(result, tmp_path / f"result{ending}")
    assert jc.read_result(path).notes == expected
    assert result.to_xarray().attrs["notes"].split("\n") == list(expected)
    if ending == ".npz":
        with np.load(path) as arrays:
            assert str(arrays["notes"]).split("\n") == list(expected)
    else:
        with xarray.open_dataset(path, engine="h5netcdf", decode_times=False) as file:
            assert file.attrs["notes"].split("\n") == list(expected)


@pytest.mark.parametrize("ending", [".npz", ".nc"])
def test_a_result_without_notes_has_none_in_its_file(ending, tmp_path):
    pytest.importorskip("h5netcdf", reason="NetCDF is the extra jaxcontact[io]")
    made = made_up(jc.SteadySliding)
    fine = dataclasses.replace(made, status=np.asarray(0), film_strain=np.asarray(0.1), cohesive_cells=None)
    assert fine.notes == jc.read_result(jc.write_result(fine, tmp_path / f"a{ending}")).notes == ()
    assert "note" not in str(fine)


def test_a_file_without_diagnostics_is_read(tmp_path):
    """As earlier versions wrote it: what the fields tell is noted, the rest is not known."""
    result, expected = troubled(jc.ContactHistory)
    path = jc.write_result(result, tmp_path / "a.npz")
    with np.load(path) as file:
        arrays = dict(file)
    np.savez(path, **{k: v for k, v in arrays.items() if k not in (*storage.DIAGNOSTICS, "notes")})
    assert jc.read_result(path).notes == expected[:2]


def test_of_many_runs_the_worst_note_of_each_kind_is_shown_with_their_number():
    """Five runs with strains of 0.1, 0.25, 0.4, 0.3 and nan; the one that is nan is out of range."""
    result, _ = troubled(jc.SteadySliding)
    each = lambda strain, status: dataclasses.replace(
        result, film_strain=strain, status=status, diagnostics=Diagnostics()
    )
    many = jax.vmap(each)(jnp.array([0.1, 0.25, 0.4, 0.3, jnp.nan]), jnp.array([0, 0, 0, 0, 7]))
    strain, range_ = sorted(many.notes, key=lambda note: "range" in note)
    assert strain.startswith("3 of 5 runs, worst in run 2: film strain reaches 0.4: above 0.2")
    assert range_.startswith("1 of 5 runs, worst in run 4: 1 of 1 steps: a value is outside its range")
    assert [len(jax.tree.map(lambda a, i=i: a[i], many).notes) for i in range(5)] == [0, 1, 1, 1, 1]
    grids = jax.vmap(jax.vmap(each))(jnp.array([[0.1, 0.1], [0.1, 0.5]]), jnp.zeros((2, 2), int))
    assert grids.notes[0].startswith("1 of 4 runs, worst in run (1, 1): film strain reaches 0.5")


@pytest.mark.slow
def test_a_ball_pressed_in_by_more_than_a_third_of_its_radius_is_noted():
    """By a contact radius of 0.4 and of 0.3 of the ball's; not for another indenter, nor for a cylinder's plane strain."""
    made = made_up(jc.ContactHistory)
    for share, radius, said in ((0.4, 5e-3, True), (0.3, 5e-3, False), (0.4, np.inf, False)):
        area = np.full(3, np.pi * (share * 5e-3) ** 2)
        told = Diagnostics(ball_radius=np.float64(radius), single_contact=np.bool_(False))
        notes = dataclasses.replace(made, contact_area=area, diagnostics=told).notes
        assert any("0.4 of the ball's radius" in note for note in notes) == said
    ball, body = jc.Sphere(1e-4), jc.LayeredHalfSpace([], jc.Elastic(1e9, nu=0.3))
    with pytest.warns(UserWarning, match="0.41 of the ball's radius: above a third"):
        jc.indent(body, ball, jc.Approach(0.17e-4), [0.0], grid=jc.Grid.square(24, 1.2e-4))

    # of an ellipsoid the half-axis along the smaller radius, as in Hertz's contact
    load = 4.8
    long, short, _ = hertz.ellipse(load, (3e-4, 1e-4), 0.7e-9)
    assert 0.36 < short / 1e-4 < 0.44
    with pytest.warns(UserWarning, match=f"{short / 1e-4:.2f} of the ball's radius"):
        grid = jc.Grid((24, 24), (long / 10.0, short / 10.0))
        jc.indent(body, jc.Ellipsoid((3e-4, 1e-4)), jc.Load(load), [0.0], grid=grid)


@pytest.mark.slow
def test_few_cells_across_a_long_contact_are_noted():
    """A roller's contact is few cells wide and many long. Hertz's line contact has a half-width b = 2 sqrt(P R/(pi E*)) and
    the peak p0 = 2 P/(pi b) under a load P per length; with 2.3 cells across, the largest pressure is 10 % too small."""
    body, R, per_length = jc.LayeredHalfSpace([], jc.Elastic(80e9, nu=0.3)), 10e-3, 5e4
    half = 2.0 * np.sqrt(per_length * R / (np.pi * 2.0 * 80e9 / 0.7))
    peak = 2.0 * per_length / (np.pi * half)
    found = {}
    for cells in (2.3, 5.3, 12.0):
        dx = 2.0 * half / cells
        grid = jc.Grid((32, 64), (dx, dx), periodic=(False, True))
        roller = jc.Cylinder(R, length=64 * dx)
        rolled, notes = said(
            lambda g=grid, r=roller: jc.indent(
                body, r, jc.Load(per_length * 64 * g.spacing[1]), [0.0], grid=g
            )
        )
        found[cells] = float(rolled.peak_pressure[0]) / peak - 1.0, int(rolled.status[0]), " ".join(notes)
    assert found[2.3][0] < -0.09 and found[2.3][1] == jc.Status.TOO_COARSE
    assert found[5.3][1] == 0 and "only 6.0 cells across the smallest contact" in found[5.3][2]
    assert abs(found[12.0][0]) < 0.01 and found[12.0][1:] == (0, "")

    # cells that are not square, and an ellipse: seven cells along x
    for indenter, spacing in ((jc.Sphere(1e-3), (3e-6, 1e-6)), (jc.Ellipsoid((1e-3, 8e-3)), (2e-6, 2e-6))):
        pressed, notes = said(
            lambda i=indenter, d=spacing: jc.indent(body, i, jc.Load(0.3), [0.0], grid=jc.Grid((16, 64), d))
        )
        across = int(np.sum(np.any(np.asarray(pressed.pressure[0]) > 0.0, 1)))
        assert across <= 8 and np.sum(np.any(np.asarray(pressed.pressure[0]) > 0.0, 0)) > 15
        assert any(re.search("only [5-8][.0-9]* cells across", note) for note in notes)


@pytest.mark.slow
def test_a_roller_pressed_in_by_more_than_a_third_of_its_radius_is_noted():
    """As a ball is, in plane strain and with ends: a parabola is then 3 % lower than the circle."""
    rubber, R = jc.LayeredHalfSpace([], jc.Elastic(1e6, nu=0.3)), 1e-3
    for load, share in (
        (1e6 / 0.7 * np.pi * 0.16 * R / 2.0, 0.4),
        (1e6 / 0.7 * np.pi * 0.09 * R / 2.0, 0.3),
    ):
        strip = jc.Grid((48, 1), (R / 40.0, R), periodic=(False, True))
        row = jc.Grid((48, 4), (R / 40.0, R / 4.0), periodic=(False, True))
        for grid in (strip, row):
            _, notes = said(
                lambda g=grid, w=load: jc.indent(rubber, jc.Cylinder(R, R), jc.Load(w * R), [0.0], grid=g)
            )
            assert any("of the roller's radius" in note for note in notes) == (share > 1.0 / 3.0)


def test_heights_in_another_unit_than_metres_are_noted():
    """A wave of 0.2 um over 16 um in micrometres has slopes of 1e5; a punch with walls is steep at its edge alone."""
    grid = jc.Grid.square(32, 16e-6)
    x, y = (np.asarray(c) for c in grid.coordinates())
    wave = 0.2 * np.cos(2.0 * np.pi * x / 16e-6) * np.cos(2.0 * np.pi * y / 16e-6)
    body = jc.LayeredHalfSpace([], jc.Elastic(1e9, nu=0.3))

    def steep(heights):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            notes = jc.indent(body, jc.HeightField(heights), jc.Load(1e-3), [0.0], grid=grid).notes
        return [note for note in notes if "slope above 1" in note]

    assert len(steep(wave)) == 1 and steep(1e-6 * wave) == []
    assert steep(np.where(x**2 + y**2 < 4e-6**2, 0.0, -1e-3)) == []


@pytest.mark.slow
def test_a_size_that_is_rounded_by_much_is_noted():
    """A cylinder of 20 um along cells of 1.5 um takes 14 of them, 5 % more; along cells of 2 um it has its length. The cells
    under a punch are those of a circle with nearly its radius."""
    body, cylinder = jc.LayeredHalfSpace([], jc.Elastic(1e9, nu=0.3)), jc.Cylinder(1e-3, length=20e-6)
    grids = [jc.Grid((16, 16), (2e-6, side)) for side in (1.5e-6, 2e-6)]
    with pytest.warns(UserWarning, match="rounded to whole cells, by 5 %: use a finer grid"):
        jc.indent(body, cylinder, jc.Load(8e-3), [0.0], grid=grids[0])
    # no warning, which would be an error
    exact = jc.indent(body, cylinder, jc.Load(8e-3), [0.0], grid=grids[1])
    assert exact.diagnostics.size_error == pytest.approx(0.0, abs=1e-12)
    for cells in (3.0, 7.6):
        x, y = np.meshgrid(*[np.arange(-7.5, 8.0)] * 2)
        counted = np.sqrt(np.sum(x**2 + y**2 <= cells**2) / np.pi) / cells - 1.0
        found = jc.FlatPunch(cells * 1e-6).size_error(jc.Grid.square(16, 16e-6))
        assert float(found) == pytest.approx(abs(counted), rel=1e-9)


def test_inside_a_transformation_there_are_no_words_yet():
    result, _ = troubled(jc.ContactHistory)
    with pytest.raises(ValueError, match=r"notes: expected a result with known values.*read them outside"):
        jax.jit(lambda result: len(result.notes))(result)
    with pytest.raises(ValueError, match="notes: expected"):
        _ = jax.eval_shape(lambda: result).notes


def said(call):
    """What a call gives, and what it warns of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = call()
    return result, tuple(str(one.message) for one in caught)


def test_a_plain_call_warns_in_the_words_of_its_notes_and_names_the_line_of_its_caller():
    """Hertz: a = (3 W R/(4 E*))^(1/3), 40 and 108 um under 1 and 20 N, on cells of 18.75 um."""
    call = lambda: jc.indent(GLASS, BALL, jc.Load([20.0, 1.0]), [0.0, 1.0], grid=GRID)
    history, (words,) = said(call)
    assert history.notes == (words,)
    few = re.fullmatch(
        r"only ([\d.]+) cells across the smallest contact, at step 2 of 2 \(t = 1 s\): .*", words
    )
    modulus = 1.0 / (0.75 / (2.0 * 30e9) + 0.91 / 210e9)
    hertz = (3.0 * 1.0 * 5e-3 / (4.0 * modulus)) ** (1.0 / 3.0)
    assert float(few[1]) == pytest.approx(2.0 * hertz / 18.75e-6, rel=0.15)  # by whole cells
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    assert {one.filename for one in caught} == {__file__}


COATED = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9, nu=0.3), 1e-6)], substrate=STEEL)
WIDE = jc.Grid.square(n=32, width=400e-6)


def pressed(approach, kernels=None):
    return jc.indent(COATED, BALL, jc.Approach(approach), [0.0], grid=WIDE, kernels=kernels)


@pytest.mark.long
def test_a_design_under_jit_says_that_its_film_is_strained():
    """Newton's method for an approach at which the load is 100 N; the film is 0.3 um shorter for each um of approach."""

    @jax.jit
    def newton(approach):
        (load, history), slope = jax.value_and_grad(
            lambda approach: ((history := pressed(approach)).load[0], history), has_aux=True
        )(approach)
        return approach - (load - 100.0) / slope, history

    approach = 0.3e-6
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(6):
            approach, history = newton(approach)
    assert float(history.load[0]) == pytest.approx(100.0, rel=1e-6)
    (note,) = history.notes
    strain = float(re.match(r"film strain reaches ([\d.]+): above 0.2", note)[1])
    assert strain > 0.2 and strain == pytest.approx(float(history.film_strain[0]), rel=0.05)


@pytest.mark.slow
def test_errors_of_the_kernels_are_noted_where_they_are_given(tmp_path):
    """Not the size of the errors is tested here but that they are told, also by jit and in files."""
    ready = jc.kernels(COATED, BALL, WIDE)
    worse = dataclasses.replace(
        ready, separation_error=jnp.asarray(0.005), image_errors=jnp.array([[0.0, 3e-4]])
    )
    history, words = said(lambda: pressed(0.1e-6, worse))
    assert (
        words == history.notes and "error of up to 0.005" in words[0] and "error of up to 0.0003" in words[1]
    )
    assert jax.jit(lambda kernels: pressed(0.1e-6, kernels))(worse).notes == words
    assert jc.read_result(jc.write_result(history, tmp_path / "a.npz")).notes == words


@pytest.mark.slow
def test_a_rough_surface_has_no_note_on_few_cells():
    """Its patches are of all sizes; the ball on the same cells has one."""
    x, y = GRID.coordinates()
    heights = -(x**2 + y**2) / (2 * 5e-3)
    rough = jax.jit(lambda: jc.indent(GLASS, jc.HeightField(heights), jc.Load(1.0), [0.0], grid=GRID))()
    ball = jax.jit(lambda: jc.indent(GLASS, jc.Sphere(5e-3), jc.Load(1.0), [0.0], grid=GRID))()
    np.testing.assert_allclose(rough.pressure, ball.pressure, rtol=1e-6)
    assert rough.notes == () and "cells across" in ball.notes[0]


PUSH = {"friction": 0.3, "grid": GRID}
VERBS = {
    "indent": lambda load: jc.indent(GLASS, BALL, jc.Load(load), [0.0], grid=GRID),
    "slide": lambda load: jc.slide(GLASS, BALL, jc.Load(load), [0.0], velocity=1e-3, grid=GRID),
    "slide_steady": lambda load: jc.slide_steady(GLASS, BALL, jc.Load(load), velocity=1e-3, grid=GRID),
    "shear": lambda load: jc.shear(
        GLASS, BALL, jc.Load(load), jc.TangentialLoad((0.1, 0.0)), [0.0], coupled=False, **PUSH
    ),
    "roll_steady": lambda load: jc.roll_steady(
        GLASS, BALL, jc.Load(load), velocity=1.0, creepage=(1e-4, 0.0), coupled=False, **PUSH
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "verb",
    [
        "indent",
        "roll_steady",
        *(pytest.param(name, marks=pytest.mark.long) for name in ("slide", "slide_steady", "shear")),
    ],
)
def test_every_verb_tells_the_same_plainly_and_under_jit_and_vmap(verb, tmp_path):
    call = VERBS[verb]
    result, words = said(lambda: call(1.0))
    assert words == result.notes and "cells across the smallest contact" in words[0]
    compiled, silent = said(lambda: jax.jit(call)(1.0))
    assert silent == () and compiled.notes == words
    many, silent = said(lambda: jax.vmap(call)(jnp.array([1.0, 60.0])))
    assert silent == () and jax.tree.map(lambda a: a[0], many).notes == words
    assert f"run 0: {words[0]}" in many.notes[0]
    assert jc.read_result(jc.write_result(compiled, tmp_path / "a.npz")).notes == words


# studies


def strained(case):
    """As a function does that solves a contact and whose film strain is the case's."""
    warnings.warn(f"tried {case['strain']:g}")
    for _ in range(2 if case["strain"] > 0.2 else 0):
        warnings.warn(Note(f"film strain reaches {case['strain']:g}", "film strain above 0.2"))
    return {"strain": case["strain"]}


@pytest.mark.slow
@pytest.mark.parametrize("executor", [None, ThreadPoolExecutor(2)], ids=["processes", "threads"])
def test_a_study_keeps_the_warnings_of_its_cases(executor, tmp_path):
    """Each once, also where a case issues it again, and read from the folder as well."""
    cases = [{"strain": strain} for strain in (0.1, 0.3, 0.4)]
    for _ in range(2):
        study = jc.sweep(strained, cases, tmp_path, executor=executor)
        assert study.notes == {
            0: ("tried 0.1",),
            1: ("tried 0.3", "film strain reaches 0.3"),
            2: ("tried 0.4", "film strain reaches 0.4"),
        }
        assert "\nnote: 2 of 3 cases: film strain above 0.2\n" in str(study)
        assert list(study[0]) == ["strain"] and study.stacked("strain").tolist() == [0.1, 0.3, 0.4]


def test_threads_that_record_warnings_at_once_each_have_their_own():
    """They leave in the order in which they entered, which loses warnings for good with ``warnings.catch_warnings``."""
    entered, left = threading.Event(), threading.Event()

    def first():
        with recorded_warnings() as caught:
            warnings.warn("first")
            entered.wait(10)
        left.set()
        return list(caught)

    def second():
        with recorded_warnings() as caught:
            warnings.warn("second")
            entered.set()
            left.wait(10)
            warnings.warn("second again")
        return list(caught)

    show = warnings.showwarning
    with ThreadPoolExecutor(2) as pool:
        found = [task.result() for task in (pool.submit(first), pool.submit(second))]
    assert found == [["first"], ["second", "second again"]]
    assert warnings.showwarning is show
    with pytest.warns(UserWarning, match="third"):
        warnings.warn("third")


STUDY = """
[sweep]
"control.approach" = [0.1e-6, 0.5e-6, 0.6e-6]
[[layer]]
material = "elastic"
G = 1e9
nu = 0.3
thickness = 1e-6
[substrate]
material = "elastic"
E = 210e9
nu = 0.3
[indenter]
shape = "sphere"
radius = 5e-3
[control]
approach = 0.1e-6
[times]
values = [0.0]
[grid]
n = 32
width = 400e-6
"""


@pytest.mark.long
def test_a_study_from_the_shell_ends_with_the_number_of_its_notes(tmp_path, capfd):
    path, out = tmp_path / "study.toml", tmp_path / "out"
    path.write_text(STUDY)
    assert main(["sweep", str(path), "-o", str(out), "--processes", "1"]) == 0
    assert "note: 2 of 3 cases: film strain above 0.2\n" in capfd.readouterr().out
    with (out / "study.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    notes = [row["notes"].split("; ") for row in rows]
    assert [str(len(each)) for each in notes] == [row["warnings_count"] for row in rows]
    assert ["film strain reaches 0." in row["notes"] for row in rows] == [False, True, True]


@pytest.mark.parametrize("limit", [0.2, 1.0 / 3.0, 3.0, 1e-4])
@pytest.mark.parametrize("off", [1e-12, 1e-6, 1e-3, 0.3])
def test_a_number_in_a_message_lies_on_its_side_of_the_limit(limit, off):
    for value in (limit * (1.0 + off), limit * (1.0 - off)):
        for digits in (1, 2):
            shown = float(told_apart(value, limit, digits))
            assert (shown > limit) == (value > limit) and shown != limit
            assert shown == pytest.approx(value, rel=0.5 * 10.0 ** (1 - digits))


@pytest.mark.slow
def test_a_film_strain_just_above_the_limit_is_not_printed_as_the_limit():
    """The strain is proportional to the approach, so that a second run has any strain that is wanted."""
    film = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e6, 0.3), 1e-6)], jc.Elastic(1e9, 0.3))
    run = lambda depth: jc.indent(
        film, jc.Sphere(1e-4), jc.Approach(depth), [0.0], grid=jc.Grid.square(16, 2e-5)
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        depth = 1e-7
        for _ in range(4):
            depth *= 0.2003 / float(run(depth).film_strain[0])
        (note,) = [note for note in run(depth).notes if "strain" in note]
    assert float(note.split("reaches ")[1].split(":")[0]) > 0.2
