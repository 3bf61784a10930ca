"""Maps of force curves: moduli, verdicts and files, from curves with a known modulus and known faults."""

import csv
import json
import subprocess
import sys

import numpy as np
import pytest

import fitting
import jaxcontact as jc
from fitting.cli import maps
from fitting.fits import force_map
from jaxcontact.__main__ import main
from tests.support.force_curves import RADIUS as ADHESIVE
from tests.support.force_curves import UNITS, WORK, force_curve
from tests.support.maps_of_curves import RADIUS, adhesive, simulated
from tests.support.thin_samples import LAYER, noisy, thin
from tests.support.thin_samples import E as THIN_E
from tests.support.thin_samples import T as THIN_T

BALL = jc.Sphere(RADIUS)
MAP = simulated(96, 200, faulty=0.25, seed=5)
STEP = 1.5e-6  # between the curves of the scan [m]
T = np.linspace(0.0, 1.0, 300)
Z = np.linspace(-1e-6, 1e-6, 300)


@pytest.fixture(scope="module")
def fitted():
    depth, load, times, *_ = MAP
    x, y = (STEP * v.ravel() for v in np.meshgrid(np.arange(12.0), np.arange(8.0)))
    return fitting.fit_map(depth, load, times, indenter=BALL, x=x, y=y)


def alone(k):
    """The approach of a curve of the map."""
    depth, load, times, *_ = MAP
    on = np.isfinite(depth[k])
    marks = np.full(on.sum(), "approach")
    return fitting.IndentationData(t=times[k, on], load=load[k, on], depth=depth[k, on], marks=marks)


def test_good_curves_are_accepted_with_intervals_that_hold_the_truth_and_bad_ones_are_not(fitted):
    *_, E, touch, kinds = MAP
    good = kinds == "good"
    assert np.all(fitted.accepted[good]) and all(why == "" for why in np.array(fitted.reasons)[good])
    # a jump that looks like correlated noise is accepted by fit_force as well
    wrong = np.flatnonzero(fitted.accepted & ~good)
    assert wrong.size <= 1 and all(
        fitting.fit_force(alone(k), indenter=BALL).verdict == "accepted" for k in wrong
    )
    low, high = fitted.youngs_interval[good].T
    assert np.mean((low < E[good]) & (high > E[good])) >= 0.87  # 63 to 72 of 72 with a probability of 0.99
    low, high = fitted.contact_interval[good].T
    assert np.mean((low < touch[good]) & (high > touch[good])) >= 0.87
    np.testing.assert_allclose(fitted.youngs_modulus[good], E[good], rtol=0.04, atol=0.0)
    reasons = {kind: " ".join(np.array(fitted.reasons)[kinds == kind]) for kind in set(kinds)}
    assert "spikes:" in reasons["spikes"] and "a flat end" in reasons["saturated"]
    assert "no indentation" in reasons["no contact"]
    largest = 16.0 / 9.0 * E * np.sqrt(RADIUS) * (2e-6 - touch) ** 1.5
    assert np.median((fitted.noise / largest)[good]) == pytest.approx(0.01, rel=0.05)


@pytest.mark.slow
def test_a_curve_has_the_fit_of_fit_force(fitted):
    kinds = MAP[-1]
    good = np.flatnonzero(kinds == "good")[:4]
    for k in [*good, *(np.flatnonzero(kinds == kind)[0] for kind in ("saturated", "jump", "step", "spikes"))]:
        fit = fitting.fit_force(alone(k), indenter=BALL)
        assert fit.verdict == fitted.verdict[k]
        assert [words[:40] for words in fit.refused[:1]] == [fitted.reasons[k][:40]] * bool(fit.refused)
        if fit.verdict == "accepted":
            value, low, high = fit.youngs_modulus
            assert fitted.youngs_modulus[k] == pytest.approx(value, rel=1e-4)
            assert np.diff(np.log(fitted.youngs_interval[k]))[0] == pytest.approx(
                np.log(high / low), rel=0.05
            )
            point, first, last = fit.nuisances["contact_point"]
            assert fitted.contact_point[k] == pytest.approx(point, rel=1e-4)
            assert np.diff(fitted.contact_interval[k])[0] == pytest.approx(last - first, rel=0.05)
            assert fitted.r2[k] == pytest.approx(fit.r2, abs=1e-6)


def test_the_shape_of_the_scan_its_table_its_arrays_and_its_pictures(fitted, tmp_path):
    pandas, xarray = pytest.importorskip("pandas"), pytest.importorskip("xarray")
    assert fitted.shape == (8, 12)
    shown = fitted.over_scan(fitted.values["G"])
    assert np.isnan(shown).sum() == np.sum(~fitted.accepted)
    fitted.to_csv(tmp_path / "map.csv")
    table = pandas.read_csv(tmp_path / "map.csv", keep_default_na=False, na_values=[""])
    np.testing.assert_allclose(table["E [Pa]"], fitted.youngs_modulus, rtol=1e-9, atol=0.0)
    assert list(table["verdict"]) == list(fitted.verdict) and table["x [m]"].max() == pytest.approx(11 * STEP)
    fitted.to_netcdf(tmp_path / "map.nc")
    with xarray.open_dataset(tmp_path / "map.nc", engine="h5netcdf") as stored:
        assert stored.youngs_modulus.dims == ("y", "x") and stored.youngs_modulus.attrs["units"] == "Pa"
        np.testing.assert_array_equal(stored.verdict.values.ravel() == 0, fitted.accepted)
        np.testing.assert_allclose(stored.x, STEP * np.arange(12.0))
    axes = fitted.plot(tmp_path / "map.png").axes
    assert axes[0].get_xlabel() == "x [µm]" and "Young's modulus" in axes[0].get_title()
    assert axes[0].collections[1].get_array().size == fitted.accepted.sum()
    labels = [text.get_text() for text in axes[2].get_legend().get_texts()]
    assert labels[0] == f"accepted: {fitted.accepted.sum()}" and len(labels) == 3
    # the modulus has a logarithmic scale, with ticks at plain numbers [kPa] within it; a verdict is seen by its colour
    # E = 3 G of an incompressible sample
    low, high = np.array([np.nanmin(shown), np.nanmax(shown)]) * 3.0 / 1e3
    scale = next(one for one in axes[3:] if one.get_ylabel() == "Young's modulus [kPa]").yaxis
    ticks = [float(tick.get_text()) for tick in scale.get_ticklabels()]
    assert (
        sum(0.999 * low <= tick <= 1.001 * high for tick in ticks) >= 2
        and scale.get_minorticklocs().size == 0
    )
    colours = [tuple(one.get_facecolor()[0]) for one in axes[2].collections]
    assert len(set(colours)) == 3
    # the scan of 12 x 8 places, each whole, is drawn with little margin on each side
    assert 8 * STEP < np.ptp(axes[0].get_ylim()) < 1.2 * 9 * STEP and axes[0].get_aspect() == 1.0
    assert 12 * STEP < np.ptp(axes[0].get_xlim()) < 1.2 * 13 * STEP
    assert (tmp_path / "map.png").stat().st_size > 1e4
    assert (
        f"{fitted.accepted.sum()} of 96 curves accepted" in fitted.summary()
        and "MapFit: 96 curves" in repr(fitted)
    )


@pytest.mark.slow
def test_a_map_that_was_stopped_is_continued_from_its_store(fitted, tmp_path, monkeypatch):
    depth, load, times, *_ = MAP
    whole, calls = force_map.fitted_batches, []

    def stopped(*given):
        yield next(whole(*given))
        raise KeyboardInterrupt

    monkeypatch.setattr(force_map, "fitted_batches", stopped)
    with pytest.raises(KeyboardInterrupt):
        fitting.fit_map(depth, load, times, indenter=BALL, store=tmp_path)
    assert len(list(tmp_path.glob("*.npz"))) == 1

    def counted(rows, *given):
        calls.append(len(rows.units))
        return whole(rows, *given)

    monkeypatch.setattr(force_map, "fitted_batches", counted)
    again = fitting.fit_map(depth, load, times, indenter=BALL, store=tmp_path)
    fitting.fit_map(depth, load, times, indenter=BALL, store=tmp_path)  # nothing is left to do
    fitting.fit_map(depth[:3], load[:3], times[:3], indenter=BALL, nu=0.3, store=tmp_path)  # other options
    failed = int(np.sum(fitted.verdict == "failed"))
    assert calls == [96 - failed - force_map.BATCH, 3]
    np.testing.assert_allclose(again.youngs_modulus, fitted.youngs_modulus, rtol=1e-9, atol=0.0)
    assert again.shape is None and "number of the curve" in again.plot().axes[0].get_xlabel()


def test_a_stored_curve_is_fitted_again_with_another_spring_constant_or_other_segments(tmp_path):
    noise = 2e-11 * np.random.default_rng(0).standard_normal(T.size)
    load = 16.0 / 9.0 * 1e3 * np.sqrt(RADIUS) * np.maximum(Z, 0.0) ** 1.5 + noise
    marks = {n: np.where(np.arange(T.size) < n, "approach", "retract") for n in (T.size, 280)}

    def width(spring_constant, points=T.size):
        curve = fitting.IndentationData(t=T, load=load, depth=Z, marks=marks[points])
        found = fitting.fit_map(
            [curve], indenter=BALL, weights="absolute", errors={"sensitivity": 0.05}, store=tmp_path,
            spring_constant=spring_constant, processes=1,
        )  # fmt: skip
        return np.ptp(np.log(found.youngs_interval[0])), found.depth[0]

    stiff, deep = width(1.0)
    assert width(0.01)[0] > 1.5 * stiff
    assert width(1.0, 280)[1] < 0.95 * deep
    assert width(1.0) == (stiff, deep)


def test_arguments_that_do_not_fit_together_are_refused(tmp_path):
    depth, load, times, *_ = MAP
    for words, given in {
        "load: expected rows": {"depth": depth},
        "load: expected 96 curves": {"depth": depth, "load": load[:5]},
        "t: expected 200 times": {"depth": depth, "load": load, "t": times[0, :7]},
        "shape: expected rows x columns = 96": {"depth": depth, "load": load, "shape": (9, 9)},
        "x: expected 96 places": {"depth": depth, "load": load, "x": [0.0]},
        "adhesion: expected": {"depth": depth, "load": load, "adhesion": "DMT"},
        "level: expected": {"depth": depth, "load": load, "level": 95},
        "nu: expected -1 < nu <= 0.5, got 0.7": {"depth": depth, "load": load, "nu": 0.7},
        "nu: expected -1 < nu <= 0.5, got -1.5": {"depth": depth, "load": load, "nu": -1.5},
        "processes: expected a whole number from 1 on or None, got 0": {"depth": depth, "load": load, "processes": 0},
        "weights: expected one of estimated, absolute, got 'relative'": {
            "depth": depth, "load": load, "weights": "relative",
        },
        "weights: expected one of estimated, absolute, or sigma=...; got both": {
            "depth": depth, "load": load, "weights": "absolute", "sigma": 1e-11,
        },
        "sigma: expected a standard deviation > 0 N, a number": {"depth": depth, "load": load, "sigma": -1e-11},
        "drag: expected a coefficient": {"depth": depth, "load": load, "drag": -1.0},
        r"bounds\['G'\]: expected 0 <= low < high": {"depth": depth, "load": load, "bounds": {"G": (5.0, 2.0)}},
        "bounds: Elastic has parameters": {"depth": depth, "load": load, "bounds": {"E": (1.0, 2.0)}},
        "bounds: JKR has parameters": {
            "depth": depth, "load": load, "bounds": {"E": (1.0, 2.0)}, "adhesion": "JKR",
        },
    }.items():  # fmt: skip
        with pytest.raises(ValueError, match=words):
            fitting.fit_map(**given, indenter=BALL, store=tmp_path / "store")
        assert not (tmp_path / "store").exists()
    with pytest.raises(ValueError, match="adhesion: expected a Sphere, got Cone"):
        fitting.fit_map(depth, load, indenter=jc.Cone(0.3), adhesion="JKR", store=tmp_path / "store")
    assert not (tmp_path / "store").exists()
    few = fitting.fit_map(depth[:1, :4], load[:1, :4], indenter=BALL)
    assert few.verdict[0] == "failed" and "at least 10 points" in few.reasons[0]


@pytest.mark.long
def test_a_thin_sample_and_a_cone_of_a_map_are_those_of_fit_force():
    depth, force = thin(0.5, 1.5)
    loads = np.array([noisy(force, seed) for seed in range(4)])
    bead, many = jc.Sphere(5e-6), np.tile(depth, (4, 1))
    found = fitting.fit_map(many, loads, THIN_T, indenter=bead, thickness=LAYER)
    assert np.all(found.accepted)
    np.testing.assert_allclose(found.youngs_modulus, THIN_E, rtol=4e-3, atol=0.0)
    errors = {"errors": {"spring_constant": 0.1, "sensitivity": 0.03}, "spring_constant": 0.1}
    # Love's cone, K. L. Johnson, Contact Mechanics, 1985
    sharp = 2.0 / np.pi * THIN_E / 0.75 * np.tan(0.6) * np.maximum(depth, 0.0) ** 2
    sharp = np.array([noisy(sharp, seed) for seed in range(4)])
    cones = fitting.fit_map(many, sharp, THIN_T, indenter=jc.Cone(0.6), **errors)
    np.testing.assert_allclose(cones.youngs_modulus, THIN_E, rtol=2e-2, atol=0.0)
    marks = np.full(THIN_T.size, "approach")
    data, other = (
        fitting.IndentationData(t=THIN_T, load=force, depth=depth, marks=marks)
        for force in (loads[0], sharp[0])
    )
    for one, fit in (
        (found, fitting.fit_force(data, indenter=bead, thickness=LAYER)),
        (cones, fitting.fit_force(other, indenter=jc.Cone(0.6), **errors)),
    ):
        value, low, high = fit.youngs_modulus
        assert fit.verdict == one.verdict[0] and one.youngs_modulus[0] == pytest.approx(value, rel=1e-3)
        assert np.diff(np.log(one.youngs_interval[0]))[0] == pytest.approx(np.log(high / low), rel=0.1)


@pytest.mark.slow
def test_the_work_of_adhesion_of_a_map_and_options_that_fit_curves_one_by_one():
    curves = [force_curve(None, seed=seed) for seed in range(2)]
    found = fitting.fit_map(
        [*curves, "no curve"], indenter=jc.Sphere(ADHESIVE), nu=0.5, adhesion="JKR", processes=1
    )
    assert list(found.verdict) == ["accepted", "accepted", "failed"] and found.reasons[2] == "no curve"
    low, high = found.intervals["work"][:2].T
    assert np.all((low > 0.98 * WORK) & (low < 1.01 * WORK) & (high > 0.99 * WORK) & (high < 1.02 * WORK))
    assert (
        found.noise[0] == pytest.approx(0.01 * UNITS.load, rel=0.3) and "work of adhesion" in found.summary()
    )
    assert (
        found.plot().axes[2].get_ylabel().startswith("work of adhesion") and "work [J/m2]" in found.table()[0]
    )
    depth, load, times, *_ = MAP
    k = int(np.flatnonzero(MAP[-1] == "good")[0])
    one = fitting.fit_map(depth[[k]], load[[k]], times[[k]], indenter=BALL, weights="absolute", processes=1)
    fit = fitting.fit_force(alone(k), indenter=BALL, weights="absolute")
    np.testing.assert_allclose(
        [one.youngs_modulus[0], *one.youngs_interval[0]], fit.youngs_modulus, rtol=1e-9, atol=0.0
    )


@pytest.mark.slow
def test_adhesive_curves_of_a_map_are_fitted_together_as_each_alone(monkeypatch):
    depth, load, times, E, work, touch, kinds = adhesive(60, 192, faulty=0.25, seed=4)
    whole, alone = force_map.fitted_alone, []
    monkeypatch.setattr(
        force_map, "fitted_alone", lambda data, **given: alone.append(data) or whole(data, **given)
    )
    found = fitting.fit_map(depth, load, times, indenter=BALL, adhesion="JKR", processes=1)
    good = kinds == "good"
    assert np.sum(good & ~found.accepted) <= 1 and not np.any(found.accepted[~good])
    # the program leaves curves without a pull-off, and those in doubt, as saturated ones are
    assert len(alone) <= 3 * 2 + 6
    both = good & found.accepted
    for ends, truth in (
        (found.intervals["G"], E / 4.0), (found.intervals["work"], work), (found.contact_interval, touch),
    ):  # fmt: skip
        low, high = ends[both].T
        assert (
            np.mean((low < truth[both]) & (high > truth[both])) >= 0.85
        )  # 39 of 45 with a probability of 0.99
    reasons = {kind: " ".join(np.array(found.reasons)[kinds == kind]) for kind in set(kinds)}
    assert (
        "spikes:" in reasons["spikes"] and "a jump by" in reasons["jump"] and "trend" in reasons["saturated"]
    )
    assert "tension above" in reasons["no contact"] and "a jump by" in reasons["step"]

    curves = force_map.data_of(depth, load, times)
    names = ("numbers", "verdict", "reason")
    some = [
        *np.flatnonzero(both)[:4],
        *(np.flatnonzero(kinds == kind)[0] for kind in ("jump", "step", "spikes")),
    ]
    for k in some:
        numbers, verdict, reason = (
            whole(
                curves[k], indenter=BALL, nu=0.5, thickness=None, substrate=None, unbonded=False, weights=None,
                sigma=None, bounds=None, level=0.95, adhesion="JKR",
            )[name] for name in names
        )  # fmt: skip
        assert verdict == found.verdict[k] and reason[:10] == found.reasons[k][:10]
        own = [
            found.values["G"][k],
            *found.intervals["G"][k],
            found.values["work"][k],
            *found.intervals["work"][k],
        ]
        # each of the two searches places an end of an interval to within a hundredth of the level of the profile
        np.testing.assert_allclose(np.array(own)[[0, 3]], numbers[[0, 3]], rtol=3e-4)
        np.testing.assert_allclose(
            np.diff(np.log(own))[[1, 4]], np.diff(np.log(numbers[:6]))[[1, 4]], rtol=0.05
        )
        assert found.contact_point[k] == pytest.approx(numbers[6], abs=0.02 * (numbers[8] - numbers[7]))
        assert np.diff(found.contact_interval[k])[0] == pytest.approx(numbers[8] - numbers[7], rel=0.05)
        np.testing.assert_allclose([found.r2[k], found.noise[k], found.depth[k]], numbers[9:12], rtol=1e-3)


def test_of_a_map_with_adhesion_what_it_does_not_take_is_refused():
    depth, load, times, *_ = MAP
    for given in ({"thickness": 1e-6}, {"errors": {"spring_constant": 0.1}}, {"drag": "fit"}):
        (name,) = given
        with pytest.raises(ValueError, match=f"adhesion: expected no {name} beside it in a map"):
            fitting.fit_map(depth, load, times, indenter=BALL, adhesion="JKR", **given)


@pytest.mark.long
def test_of_a_large_map_the_intervals_hold_and_the_bad_curves_are_found():
    depth, load, times, E, _, kinds = simulated(1000, 512, faulty=0.1, seed=11)
    found = fitting.fit_map(depth, load, times, indenter=BALL)
    good = kinds == "good"
    both = good & found.accepted
    low, high = found.youngs_interval[both].T
    assert 0.93 <= np.mean((low < E[both]) & (high > E[both])) <= 0.97
    assert np.mean(found.accepted[~good]) <= 0.01 and np.mean(~found.accepted[good]) <= 0.02


def write(path, E, seed):
    """A curve of a ball of 5 um on a half-space of nu = 0.5 (Hertz), with noise."""
    load = 16.0 / 9.0 * E * np.sqrt(5e-6) * np.maximum(Z, 0.0) ** 1.5
    load = load + 2e-3 * 4e-9 * np.random.default_rng(seed).standard_normal(T.size)
    rows = (f"{t:.6g}\t{1e9 * P:.6g}\t{1e9 * d:.6g}\n" for t, P, d in zip(T, load, Z, strict=True))
    path.write_text("Time (s)\tLoad (nN)\tDepth (nm)\n" + "".join(rows))


UNGUARDED = """
import fitting, jaxcontact as jc, numpy as np
z = np.linspace(-1e-6, 1e-6, 60)
load = 16 / 9 * 1e3 * np.sqrt(5e-6) * np.maximum(z, 0.0) ** 1.5 * np.ones((2, 1))
load += 2e-11 * np.random.default_rng(0).standard_normal((2, 60))
found = fitting.fit_map(np.tile(z, (2, 1)), load, indenter=jc.Sphere(5e-6), sigma=2e-11, processes=2)
print("ran once", *np.round(found.youngs_modulus))
"""


@pytest.mark.long
def test_a_script_without_a_guard_fits_curves_in_processes(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(UNGUARDED)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    said = done.stdout.split()
    assert said[:2] == ["ran", "once"] and len(said) == 4
    assert [float(E) for E in said[2:]] == pytest.approx([1e3, 1e3], rel=0.05)


@pytest.mark.slow
def test_a_folder_becomes_a_table_and_a_figure_and_is_continued(tmp_path, capsys):
    folder, out = tmp_path / "curves", tmp_path / "map"
    folder.mkdir()
    for k, E in enumerate((500.0, 1e3, 0.0)):
        write(folder / f"{k}.txt", E, k)
    (folder / "notes.txt").write_text("no curve\n")
    command = ["fit", "map", str(folder), "-o", str(out), "--radius", "5e-6", "--processes", "1"]
    assert main(command) == 3  # one curve could not be fitted
    no_number = lambda word: pytest.fail(f"{word} is no JSON")
    assert json.loads((out / "options.json").read_text(), parse_constant=no_number)["radius"] == 5e-6
    said = capsys.readouterr().out
    assert "2 of 3 curves accepted" in said and "1 of 4 files without rows of numbers" in said
    # the curves end at a fifth of the radius of the ball
    assert "note: 2 of 3 curves, first: the depth reaches 0.2 of the radius of the ball" in said
    with (out / "map.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["verdict"] for row in rows] == ["accepted", "accepted", "failed"]
    assert "rises with depth" in rows[2]["reason"]
    assert ["radius of the ball" in row["notes"] for row in rows] == [True, True, False]
    for row, E in zip(rows, (500.0, 1e3), strict=False):
        assert float(row["E low [Pa]"]) < E < float(row["E high [Pa]"])
    assert (out / "map.png").stat().st_size > 1e4
    stored = {path: path.stat().st_mtime_ns for path in (out / "curves").glob("*.npz")}
    write(folder / "3.txt", 2e3, 3)
    main(command)
    assert "3 of 4 curves accepted" in capsys.readouterr().out
    assert all(path.stat().st_mtime_ns == when for path, when in stored.items())  # none was fitted again
    with pytest.raises(SystemExit) as ended:
        raise SystemExit(main([*command, "--nu", "0.3"]))
    assert ended.value.code not in (0, None) and "not of a map with these options" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("--nu 0.7", "--nu: expected -1 < nu <= 0.5, got 0.7"),
        ("--bound Q=1:2", "--bound: Elastic has parameters ['G'], got 'Q'"),
        ("--weights proportional", "--weights: expected one of estimated, absolute, got 'proportional'"),
        ("--spring-constant-error 2", "--spring-constant-error: expected a relative standard deviation"),
        ("--processes 0", "--processes: expected a whole number from 1 on or None, got 0"),
        ("--level 95", "--level: expected between 0 and 1, got 95"),
        ("--window 5:2", "--window: expected begin < end, got 5.0 and 2.0"),
    ],
)
def test_a_wrong_option_of_a_map_is_one_line_and_leaves_no_directory(tmp_path, capsys, words, line):
    write(tmp_path / "curve.txt", 500.0, 0)
    out = tmp_path / "map"
    command = ["fit", "map", str(tmp_path / "curve.txt"), "-o", str(out), "--radius", "5e-6"]
    assert main([*command, *words.split()]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and line in said[0]
    assert not out.exists()


def test_an_interrupted_map_says_what_is_finished_and_how_it_continues(tmp_path, capsys, monkeypatch):
    write(tmp_path / "curve.txt", 500.0, 0)
    command = ["fit", "map", str(tmp_path / "curve.txt"), "-o", str(tmp_path / "map"), "--radius", "5e-6"]
    whole = maps.fit_map

    def stopped(*curves, **given):
        whole(*curves, **given)
        raise KeyboardInterrupt

    monkeypatch.setattr(maps, "fit_map", stopped)
    assert main(command) == 130
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert "interrupted by SIGINT: finished batches of curves: 1; the same command with --resume" in said[0]
    monkeypatch.setattr(maps, "fit_map", whole)
    assert main([*command, "--resume"]) == 0


def test_the_results_of_a_map_do_not_replace_one_of_its_curves(tmp_path, capsys):
    write(tmp_path / "map.csv", 500.0, 0)
    before = (tmp_path / "map.csv").read_bytes()
    assert main(["fit", "map", str(tmp_path), "-o", str(tmp_path), "--radius", "5e-6", "--force"]) == 2
    assert "map.csv would replace it" in capsys.readouterr().err
    assert (tmp_path / "map.csv").read_bytes() == before and len(list(tmp_path.iterdir())) == 1


@pytest.mark.slow
def test_short_curves_with_a_jump_or_a_flat_end_are_rejected_alone_and_in_a_map():
    depth, load, times, *_, kinds = simulated(60, 48, faulty=0.5, seed=3)
    found = fitting.fit_map(depth, load, times, indenter=BALL)
    assert np.all(found.accepted[kinds == "good"])
    for kind, words in (("jump", "a jump by"), ("saturated", "a flat end")):
        bad = np.flatnonzero(kinds == kind)
        named = [k for k in bad if words in found.reasons[k]]
        assert not np.any(found.accepted[bad]) and len(named) >= 4
        on = np.isfinite(depth[named[0]])
        marks = np.full(on.sum(), "approach")
        own = {name: v[named[0], on] for name, v in (("t", times), ("load", load), ("depth", depth))}
        alone = fitting.fit_force(fitting.IndentationData(**own, marks=marks), indenter=BALL)
        assert alone.refused[0].startswith(words)
