"""Fits of the work of adhesion to approach and retraction, on half-spaces against closed forms."""

import dataclasses
import math

import jax
import numpy as np
import pytest
from force_curves import NU, RADIUS, SHIFT, UNITS, WORK, E, G, branch, force_curve

import fitting
import jaxcontact as jc
from fitting.data.contact import sample_noise
from fitting.data.indentation import read_pull_off
from fitting.models.adhesive_contact import scaled_load
from jaxcontact.reference import maugis

BALL = jc.Sphere(RADIUS)


def fitted(data, adhesion="JKR", **keywords):
    given = {"indenter": BALL, "nu": NU, "control": "depth", "contact_point": "fit"} | keywords
    return fitting.fit_indentation(data, "Elastic", adhesion=adhesion, **given)


def first_points(data, n):
    return fitting.IndentationData(
        t=data.t[:n], load=data.load[:n], depth=data.depth[:n], marks=data.segments[:n]
    )


@pytest.mark.parametrize("parameter", [0.1, 0.5, 1.0, 2.0, 10.0, None])
def test_the_model_is_the_closed_form_on_the_stable_branch(parameter):
    """Against the reference, which finds the outer radius by another method; within 1e-4 of the largest load."""
    approach, load = branch(parameter)
    far = approach > approach[0] + 1e-3
    found = jax.jit(scaled_load)(approach, parameter)
    np.testing.assert_allclose(np.asarray(found)[far], load[far], atol=1e-4 * load.max())


@pytest.mark.parametrize("mode", [jax.jacfwd, jax.jacrev])
def test_load_and_stiffness_of_short_range_are_those_of_the_radius_of_contact(mode):
    """P = a^3 - (6 a^3)^(1/2) and d = a^2 - 2/3 (6 a)^(1/2), with dP/dd = (dP/da)/(dd/da), on the stable branch."""
    a = 6.0 ** (-1.0 / 3.0) * np.geomspace(1.001, 1e4, 200)
    approach, load = a**2 - 2.0 / 3.0 * np.sqrt(6.0 * a), a**3 - np.sqrt(6.0 * a**3)
    stiffness = (3.0 * a**2 - 1.5 * np.sqrt(6.0 * a)) / (2.0 * a - np.sqrt(6.0 / a) / 3.0)
    np.testing.assert_allclose(np.asarray(scaled_load(approach, None)), load, rtol=1e-11, atol=1e-12)
    slope = np.diag(np.asarray(mode(lambda x: scaled_load(x, None))(approach)))
    np.testing.assert_allclose(slope, stiffness, rtol=1e-9)


def test_the_model_has_a_derivative_beyond_the_end_of_the_branch():
    """There the radius is held, as under a flat punch: dP/d(approach) = 2 E* a, which is 1.5 a in these units."""
    end = 6.0 ** (-1.0 / 3.0)
    loads = np.asarray(jax.jit(scaled_load)(np.array([-1.2, -1.1, 2.0]), None))
    assert (loads[1] - loads[0]) / 0.1 == pytest.approx(1.5 * end, rel=1e-6)


def test_a_force_curve_gives_back_modulus_work_and_contact_point():
    fit = fitted(force_curve(None, noise=1e-5))
    assert fit.verdict == "accepted" and fit.identified == {"G": True, "work": True}
    assert fit.values["G"] == pytest.approx(G, rel=1e-4) and fit.values["work"] == pytest.approx(
        WORK, rel=1e-4
    )
    assert fit.nuisances["contact_point"][0] == pytest.approx(SHIFT, abs=1e-11)
    assert (
        fit.law is None and math.isnan(fit.tabor_number) and fit.material == jc.Elastic(fit.values["G"], NU)
    )
    assert fit.pull_off[0] == pytest.approx(1.5 * UNITS.load, rel=5e-3)


@pytest.mark.parametrize("standard_errors", [2.0, 4.5])
def test_a_constant_beside_the_load_changes_nothing(standard_errors):
    """Up to several standard errors of the median at the end of the retraction, which tell nothing of themselves."""
    data = force_curve(None, noise=0.02)
    beside = standard_errors * 1.25 * 0.02 * UNITS.load / math.sqrt(6.0)
    fit, other = fitted(data), fitted(dataclasses.replace(data, load=data.load + beside))
    for name in ("G", "work"):
        assert other.values[name] == pytest.approx(fit.values[name], rel=1e-7)
        assert other.intervals[name] == pytest.approx(fit.intervals[name], rel=1e-6)


def test_the_interval_has_the_error_of_the_zero_of_the_load():
    """Half its width is (w^2 + (z s)^2)^(1/2): w without this error, of a curve that ends in contact, and s the change with
    a load that is counted from another zero by one standard error of the median of 12 points."""
    data = force_curve(None, noise=0.02, n=120)
    end = data.load[-12:]
    whole, cut = fitted(data), dataclasses.replace(data, load=data.load - np.median(end))
    cut = first_points(cut, 240 - 18)
    alone = fitted(cut)
    assert any("ends in contact" in note for note in alone.notes)
    assert alone.values == pytest.approx(whole.values, rel=1e-4)
    error = 1.25 * sample_noise(data.load) / math.sqrt(12.0)
    moved = fitted(dataclasses.replace(cut, load=cut.load + error))
    for name, value in whole.values.items():
        half, least = (
            0.5 * math.log(fit.intervals[name][1] / fit.intervals[name][0]) for fit in (whole, alone)
        )
        shift = math.log(moved.values[name] / alone.values[name])
        # the change by the zero is taken as linear, and the noise estimated from fewer points: measured 0.7 and 1.4 %
        assert half == pytest.approx(math.hypot(least, 1.96 * shift), rel=0.01)
        assert name == "G" or half > 1.3 * least
        k = ["G", "work"].index(name)
        variance = [fit.estimate.covariance[k, k] / value**2 for fit in (whole, alone)]
        assert variance[0] == pytest.approx(variance[1] + shift**2, rel=0.02)


def test_the_work_of_separation_has_the_error_of_the_zero_of_the_load():
    """By the work of the same curve with a load that is counted from another zero."""
    data, error = force_curve(None, noise=0.002, n=400), 0.01 * UNITS.load
    moved = read_pull_off(dataclasses.replace(data, load=data.load + error))
    alone, both = read_pull_off(data), read_pull_off(data, error)
    assert both.work == alone.work
    assert both.work_sd == pytest.approx(math.hypot(alone.work_sd, moved.work - alone.work), rel=0.03)
    assert both.work_sd > 5.0 * alone.work_sd


@pytest.mark.slow
def test_a_known_contact_point_tells_the_strength_of_the_attraction():
    fit = fitted(force_curve(1.0, noise=0.003), "fit", contact_point=SHIFT)
    strength = maugis.strength(1.0, WORK, RADIUS, E)
    assert (
        fit.identified["strength"] and fit.intervals["strength"][0] < strength < fit.intervals["strength"][1]
    )
    assert isinstance(fit.law, jc.DugdaleAdhesion) and fit.tabor_number == pytest.approx(0.864, rel=0.2)
    assert not any("not identified" in note for note in fit.notes)


@pytest.mark.slow
def test_a_range_that_the_curve_does_not_tell_is_named_and_the_work_allows_for_it():
    """With the contact point unknown, JKR describes a curve of lambda = 0.3 within its noise, with 21 % too much work."""
    data = force_curve(0.3)
    short, free = fitted(data), fitted(data, "fit")
    assert short.verdict == "accepted" and short.values["work"] > 1.15 * WORK
    assert not free.identified["strength"] and free.intervals["work"][0] < WORK < free.intervals["work"][1]
    assert any(note.startswith("the range of the attraction is not identified") for note in free.notes)
    assert "strength not identifiable" in free.summary()


def test_the_interval_of_a_contact_point_ends_where_two_minima_have_different_heights():
    """Noise of 5 % of the pull-off force. At the upper end two minima exist, and a fit at this contact point finds the
    higher one: its RSS has risen by at least as much as at the other end, and by less than 10 % more."""
    data = force_curve(None, noise=-0.05 * float(branch(None)[1].min()), seed=104)
    # without the points out of contact, whose median is the zero of the load, with an error that the ends would have too
    data = first_points(data, 120 - 9)
    fit = fitted(data)
    _, *ends = fit.nuisances["contact_point"]
    low, high = (fitted(data, contact_point=point).rss - fit.rss for point in ends)
    assert 0.99 * low < high < 1.1 * low


@pytest.mark.parametrize("shift", [-20e-6, 20e-6])
def test_the_zero_of_the_measured_depth_is_arbitrary(shift):
    fit = fitted(force_curve(None, noise=1e-5, shift=shift))
    assert fit.values["work"] == pytest.approx(WORK, rel=1e-4) and fit.verdict == "accepted"
    assert fit.nuisances["contact_point"][0] == pytest.approx(shift, abs=1e-10)


def test_pull_off_and_work_of_separation_are_those_of_the_curve():
    """Without noise against the closed form; with noise within three of the stated standard deviations."""
    approach, load = branch(None)
    tension = load < 0.0
    work = -np.trapezoid(load[tension], approach[tension]) * UNITS.load * UNITS.approach
    exact = read_pull_off(force_curve(None, noise=1e-9, n=600))
    assert exact.force == pytest.approx(1.5 * UNITS.load, rel=1e-3)
    assert exact.work == pytest.approx(work, rel=0.02)
    works = [read_pull_off(force_curve(None, seed=k)).work for k in range(200)]
    one = read_pull_off(force_curve(None))
    assert np.std(works) == pytest.approx(one.work_sd, rel=0.35)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.02, 0.05, 0.08])
def test_the_pull_off_is_that_of_the_fitted_curve_and_not_the_lowest_reading(noise):
    """JKR's is 3/2 pi w R at any modulus; noise as a fraction of it. The lowest reading is 2, 9, 17 % below it."""
    truth, values, inside, works = 1.5 * np.pi * WORK * RADIUS, [], [], []
    approach, load = branch(None)
    work = -np.trapezoid(np.minimum(load, 0.0), approach) * UNITS.load * UNITS.approach
    for seed in range(20):
        fit = fitted(force_curve(None, noise=1.5 * noise, seed=seed))
        value, low, high = fit.pull_off
        values.append(value / truth)
        inside.append(low < truth < high)
        works.append(fit.separation_work[1] < work < fit.separation_work[2])
    assert abs(np.mean(values) - 1.0) < 0.2 * noise and np.std(values) < 0.4 * noise
    assert np.sum(inside) >= 17 and np.sum(works) >= 17


@pytest.mark.slow
def test_the_pull_off_of_a_finite_range_is_the_least_load_of_maugis():
    """Against the closed form of the reference on a fine grid of radii, with its interval."""
    load, _ = maugis.maugis(1.0, np.linspace(0.02, 2.0, 4000))
    truth = -load.min() * UNITS.load
    fit = fitted(force_curve(1.0, noise=0.003), "fit", contact_point=SHIFT)
    value, low, high = fit.pull_off
    assert value == pytest.approx(truth, rel=3e-3) and low < truth < high and high / low < 1.01


def test_a_retraction_that_ends_in_contact_keeps_its_zero_of_the_load():
    """The branch down to a radius of 0.56, before the contact breaks: no part of it has a load of zero."""
    load, depth = maugis.jkr(np.linspace(2.0, 0.56, 60))
    load = load + 0.01 * np.random.default_rng(0).standard_normal(60)
    curve = fitting.IndentationData(
        t=np.arange(60.0), load=UNITS.load * load, depth=UNITS.approach * depth, marks=["retract"] * 60
    )
    fit = fitted(curve)
    assert fit.intervals["work"][0] < WORK < fit.intervals["work"][1]
    assert fit.intervals["G"][0] < G < fit.intervals["G"][1]
    assert fit.pull_off[0] == pytest.approx(1.5 * UNITS.load, rel=0.02)
    assert any("ends in contact" in note for note in fit.notes)


def test_a_curve_without_pull_off_or_of_another_kind_is_refused():
    plain = force_curve(None)
    none = fitting.IndentationData(t=plain.t, load=np.abs(plain.load), depth=plain.depth, marks=plain.marks)
    with pytest.raises(ValueError, match="adhesion: expected a retraction with a tension above"):
        fitted(none)
    with pytest.raises(ValueError, match=r"adhesion: expected a retraction .* got no retraction"):
        fitted(plain.only("approach"))
    with pytest.raises(ValueError, match='adhesion: expected "fit", "JKR"'):
        fitted(plain, "DMT")
    with pytest.raises(ValueError, match='control: expected "depth"'):
        fitted(plain, control="load")
    with pytest.raises(
        ValueError, match="model: expected Elastic with a fit of the work of adhesion, got 'Maxwell'"
    ):
        fitting.fit_indentation(plain, jc.Maxwell, indenter=BALL, nu=NU, control="depth", adhesion="fit")
    with pytest.raises(
        ValueError, match=r"weights: expected None, .absolute. or sigma with adhesion, got 'estimated'"
    ):
        fitted(plain, weights="estimated")
    with pytest.raises(ValueError, match="tau: expected none with a fit of the work of adhesion"):
        fitted(plain, tau=[1.0])
    with pytest.raises(ValueError, match="adhesion: expected a Sphere, got Cone"):
        fitted(plain, indenter=jc.Cone(1.2))
    with pytest.raises(ValueError, match='adhesion: expected "fit", "JKR" or a work of adhesion'):
        fitted(plain, jc.ExponentialAdhesion(WORK, 1e-9))


@pytest.mark.long
def test_intervals_of_modulus_and_work_cover_the_truth():
    """300 simulated curves of short range: the 95 % intervals contain the truth in 92 to 98 %."""
    inside = []
    for seed in range(300):
        fit = fitted(force_curve(None, seed=seed))
        truth = {"G": G, "work": WORK}
        inside.append([fit.intervals[name][0] < truth[name] < fit.intervals[name][1] for name in truth])
    share = np.mean(inside, axis=0)
    assert np.all((share > 0.92) & (share < 0.98)), share


@pytest.mark.slow
def test_an_offset_of_the_load_is_removed_and_its_error_enters_the_intervals():
    """100 curves whose load has an offset of 5 % of the pull-off load."""
    inside = []
    for seed in range(100):
        plain = force_curve(None, seed=seed)
        moved = dataclasses.replace(plain, load=plain.load + 0.05 * UNITS.load)
        fit = fitted(moved)
        inside.append(fit.intervals["work"][0] < WORK < fit.intervals["work"][1])
    assert np.mean(inside) > 0.92


def hysteretic(part, noise=1e-3, n=60):
    """A curve whose work of adhesion is a part of ``WORK`` on the approach."""
    curve = force_curve(None, noise=noise, n=n)
    units = maugis.units(part * WORK, RADIUS, E)
    load, approach = maugis.jkr(np.linspace(0.02, 6.0, 2000))
    end = int(np.argmin(approach))
    down = (curve.depth[:n] - SHIFT) / units.approach
    there = np.where(down < 0.0, 0.0, np.interp(down, approach[end:], load[end:])) * units.load
    there = there + noise * UNITS.load * np.random.default_rng(3).standard_normal(n)
    return dataclasses.replace(curve, load=np.append(there, curve.load[n:]))


@pytest.mark.slow
def test_different_works_of_approach_and_retraction_are_rejected_together_and_the_retraction_gives_its_own():
    curve = hysteretic(0.3)
    both, back = fitted(curve), fitted(curve.only("retract"))
    assert both.verdict == "rejected" and any("fit the retraction alone" in why for why in both.refused)
    assert back.verdict == "accepted" and back.values["work"] == pytest.approx(WORK, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("parameter", [0.3, 2.0])
def test_a_trend_of_a_range_that_the_model_does_not_have_widens_the_interval_of_the_work(parameter):
    """JKR with a known contact point, for curves of finite range: 18 and 2 % too much work."""
    fit = fitted(force_curve(parameter, noise=1e-3, seed=1, n=150), contact_point=SHIFT)
    assert fit.verdict == "accepted" and any(
        "trend" in note and "which the intervals include" in note for note in fit.notes
    )
    low, high = fit.intervals["work"]
    assert low < WORK < high and fit.intervals["G"][0] < G < fit.intervals["G"][1]
    assert fit.values["work"] > 1.02 * WORK  # the bias that the interval has to hold


@pytest.mark.slow
def test_a_trend_above_a_twentieth_of_the_largest_force_is_rejected():
    """A load that is 10 % larger for each unit of depth, as a sample that stiffens with depth."""
    curve = force_curve(None, noise=1e-3, n=100)
    deep = np.maximum((curve.depth - SHIFT) / UNITS.approach, 0.0)
    fit = fitted(dataclasses.replace(curve, load=curve.load * (1.0 + 0.1 * deep**2)).only("retract"))
    assert fit.verdict == "rejected" and any(
        "with half the contact or a range of the attraction" in why for why in fit.refused
    )


def test_a_retraction_that_begins_under_tension_is_fitted():
    """A bead that sticks so much that the load is a third of the pull-off at the largest depth, and zero once it is off."""
    back = force_curve(None, noise=1e-3, seed=2, n=200).only("retract")
    lowest, n = int(np.argmin(back.load)), 150
    some = (back.load < 0.3 * back.load[lowest]) | (np.arange(back.t.size) > lowest)
    step = np.arange(1, n + 1)
    t = np.append(back.t[some], back.t[-1] + step * np.diff(back.t[-2:]))
    depth = np.append(back.depth[some], back.depth[-1] + step * np.diff(back.depth[-2:]))
    apart = 1e-3 * back.load.max() * np.random.default_rng(3).standard_normal(n)
    load = np.append(back.load[some], apart)
    assert 0.2 < load[0] / load.min() < 0.5 and np.median(load) > load[0]
    fit = fitted(fitting.IndentationData(t=t, load=load, depth=depth, marks=np.full(t.size, "retract")))
    # from half a curve, with 0.1 % of noise
    for name, value in (("G", G), ("work", WORK)):
        assert fit.values[name] == pytest.approx(value, rel=0.05)


@pytest.mark.parametrize(
    ("load", "depth", "message"),
    [
        (1.0, 1e3, r"depth: expected a contact less deep than the radius of the ball, 5e-06 m"),
        (-1.0, 1.0, r"load: expected the largest loads at the largest depths"),
        (1.0, -1.0, r"depth: expected one that grows during the approach"),
        (-1.0, -1.0, r"depth: expected one that grows during the approach"),
    ],
)
@pytest.mark.parametrize("marked", [True, False])
def test_a_curve_in_other_units_or_with_another_sign_is_refused(load, depth, message, marked):
    plain = force_curve(None)
    marks = plain.marks if marked else None
    wrong = fitting.IndentationData(t=plain.t, load=load * plain.load, depth=depth * plain.depth, marks=marks)
    with pytest.raises(ValueError, match=message if marked else "expected"):
        fitted(wrong)
