"""Half-space indentation fits against Lee and Radok's and Ting's solutions, which share no code with them."""

import dataclasses
import json

import numpy as np
import pytest
from scipy import integrate, optimize, stats

import fitting
import jaxcontact as jc
from fitting.models.halfspace import Curve, evaluate, linear, relaxation_modes
from jaxcontact.__main__ import main
from jaxcontact.bodies.materials import Spectrum
from jaxcontact.reference import lee_radok, ting

TRUTH = {"G1": 0.75e9, "G2": 13.89e6, "eta1": 3148.6e9, "eta2": 120.9e9}
R, NU = 9.525e-3, 0.3
KNOTS, LOADS = np.array([0.0, 600.0, 40000.0]), np.array([0.0, 1.0, 1.2])
BALL = jc.Sphere(radius=R, material=jc.Elastic.from_young(210e9))
RIGID = jc.Sphere(radius=R)
TIMES = np.concatenate([[0.0], np.linspace(200.0, 40000.0, 200)])


def creep(t):
    return 1 / TRUTH["G1"] - np.expm1(-TRUTH["G2"] / TRUTH["eta2"] * t) / TRUTH["G2"] + t / TRUTH["eta1"]


def relaxation(t):
    """G(t) of the two rates of h(s) = s/G1 + 1/eta1 + s/(G2 + eta2 s) [Pa], the oracle's own."""
    G1, G2, eta1, eta2 = TRUTH.values()
    a, b, c = eta2 / G1, G2 / G1 + eta2 / eta1 + 1.0, G2 / eta1
    rates = -np.roots([a, b, c])
    slope = lambda s: 1 / G1 + G2 / (G2 + eta2 * s) ** 2
    return sum(np.exp(-r * np.asarray(t)) / slope(-r) for r in rates)


def depth_of(times, knots=KNOTS, loads=LOADS, ball=BALL):
    radius = lee_radok.history_radius(times, creep, knots, loads, R, NU, float(ball.compliance()))
    return radius**2 / R


def hold(noise=0.0, seed=0, t=TIMES, **options):
    depth = depth_of(t, **options)
    depth = depth * (1 + noise * np.random.default_rng(seed).standard_normal(t.size))
    return fitting.IndentationData(t=t, load=np.interp(t, KNOTS, LOADS), depth=depth)


def fit(data, indenter=BALL, **options):
    return fitting.fit_indentation(data, model=jc.Burgers, indenter=indenter, nu=NU, **options)


@pytest.mark.versions
def test_load_control_recovers_lee_and_radok():
    found = fit(hold())
    for name, value in TRUTH.items():
        np.testing.assert_allclose(found.values[name], value, rtol=1e-6)
    assert found.identified["eta1"] and not found.misfit and found.r2 > 1 - 1e-12
    np.testing.assert_allclose(found.predict(TIMES), creep(TIMES), rtol=1e-6)


def test_load_step_at_the_first_sample():
    t = np.linspace(5.0, 40005.0, 201)
    depth = lee_radok.step_approach(t - 5.0, creep, 1.0, R, NU)
    data = fitting.IndentationData(t=t, load=np.ones(t.size), depth=depth)
    for name, value in fit(data, RIGID).values.items():
        np.testing.assert_allclose(value, TRUTH[name], rtol=1e-6)


def test_a_part_of_a_curve_has_the_load_before_it_as_history():
    """With its load as a step at the first point, G1 would be 24 times too small."""
    data = hold()
    for part in (data.window(5000.0, None), data.window(1000.0, None).window(5000.0, None)):
        found = fit(part)
        for name, value in TRUTH.items():
            np.testing.assert_allclose(found.values[name], value, rtol=1e-5)
        assert "the curve from 0 to 5000 s is taken as history, and not fitted" in " ".join(found.notes)
        assert found.kept.sum() == part.t.size


@pytest.mark.slow
def test_the_history_begins_at_contact():
    """The gel G1 = G2 = 1 kPa, tau = 1 s under a ramp of 1 s, whose depth follows from quad, after 2 s in air."""
    J = lambda t: (2.0 - np.exp(-t)) / 1e3
    t = np.concatenate([np.linspace(-2.0, 0.98, 150), np.linspace(1.0, 6.0, 60)])
    strain = [integrate.quad(lambda s, x=x: J(x - s), 0.0, np.clip(x, 0.0, 1.0))[0] for x in t]
    in_contact = (3.0 / 16.0 * np.array(strain) * 1e-9 / np.sqrt(5e-6)) ** (2 / 3)
    depth = np.where(t < 0.0, 1e-7 * t, in_contact)
    curve = fitting.IndentationData(t=t + 5.0, load=1e-9 * np.clip(t, 0.0, 1.0), depth=depth + 1e-6)
    for control in ("load", "depth"):
        part = curve.in_contact(1e-6).only("hold")
        found = fitting.fit_indentation(
            part, "StandardLinearSolid", indenter=jc.Sphere(5e-6), nu=0.5, control=control
        )
        np.testing.assert_allclose(list(found.values.values()), 1e3, rtol=0.02)


def test_a_load_that_is_there_before_the_first_point_is_mentioned():
    t = np.linspace(5.0, 40005.0, 60)
    depth = lee_radok.step_approach(t - 5.0, creep, 1.0, R, NU)
    late = fit(fitting.IndentationData(t=t, load=np.ones(t.size), depth=depth), RIGID)
    assert "taken as applied in a step at its time, t = 5 s" in " ".join(late.notes)


@pytest.mark.slow
def test_depth_control_recovers_lee_and_radok():
    """The depth after a step load drives the model; depth^(3/2) linear between samples is second order."""
    errors = []
    for n in (200, 400):
        t = np.linspace(0.0, 40000.0, n + 1)
        depth = lee_radok.step_approach(t, creep, 1.0, R, NU)
        data = fitting.IndentationData(t=t, load=np.ones(t.size), depth=depth)
        values = fit(data, RIGID, control="depth").values
        errors.append(max(abs(values[name] / TRUTH[name] - 1) for name in TRUTH))
    print(f"\nlargest error of a parameter, 200 and 400 steps: {errors[0]:.1e}, {errors[1]:.1e}")
    assert errors[1] < 3e-3 and 3.0 < errors[0] / errors[1] < 5.0


def unloading(n):
    """Depth up and down a parabola, by Ting's solution."""
    t = np.linspace(0.0, 9000.0, n)
    depth = lambda s: 1e-6 * (1 - (np.asarray(s) / 6000.0 - 1) ** 2)
    rate = lambda s: -2e-6 / 6000.0 * (np.asarray(s) / 6000.0 - 1)
    loads = [0.0] + [ting.load(s, relaxation, depth, rate, 6000.0, R, NU) for s in t[1:]]
    return t, depth(t), np.array(loads)


@pytest.mark.slow
def test_unloading_is_tings():
    t, depth, load = unloading(601)
    data = fitting.IndentationData(t=t, load=load, depth=depth)
    found = fit(data, RIGID, control="depth")
    assert any("Ting" in note for note in found.notes)
    np.testing.assert_allclose(found.fitted, load[found.kept], atol=2e-4 * load.max())
    for name, value in TRUTH.items():
        np.testing.assert_allclose(found.values[name], value, rtol=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("rates", [pytest.param(None, marks=pytest.mark.long), np.array([9.0, 0.7])])
def test_unloading_has_exact_slopes(rates):
    """The Jacobian through t1(t) against central differences; times that are sought, and times that are given."""
    t, depth, load = unloading(61)
    scaled = [a / a.max() for a in (t, load, depth)]
    curve = Curve(*scaled, np.ones(t.size), 0.0, 0.0, None, 1.5, int(np.argmax(depth)), rates=rates)
    theta = (
        np.array([-2.0, 1.0, 0.5, -0.5, 0.0, 0.0, 0.0])
        if rates is None
        else np.array([0.2, 2.0, 1.0, 0.5, 0.0, 0.0, 0.0])
    )
    exact = np.asarray(linear(theta, np.arange(4), curve, "ting")[1])
    for i in range(4):
        step = np.zeros(7)
        step[i] = 1e-4
        up, down = (np.asarray(evaluate(theta + s, curve, "ting")) for s in (step, -step))
        np.testing.assert_allclose(exact[:, i], (up - down) / 2e-4, atol=2e-3 * np.abs(exact[:, i]).max())


def test_relaxation_of_any_number_of_branches_inverts_the_creep():
    """int_0^t G(t - s) J(s) ds = t, with G of the code and J written here; one branch and the flow are absent."""
    j0, j, rates = 0.15, np.array([0.5, 0.0, 2.0]), np.array([50.0, 3.0, 0.2])
    decay, G = (np.asarray(a) for a in relaxation_modes(Spectrum(0.1, j, rates, 0.0), 0.05)[::-1])
    J = lambda s: j0 - np.expm1(-rates * s) @ j
    for t in (0.01, 1.0, 20.0):
        product = lambda s, t=t: G @ np.exp(-decay * (t - s)) * J(s)
        total = integrate.quad(product, 0.0, t, points=[1e-3 * t, 0.01 * t, 0.1 * t], epsabs=1e-13)[0]
        np.testing.assert_allclose(total, t, rtol=1e-9)


def scipy_cost(data, fixed=None):
    """Least squares of the relative depth by scipy alone, the load history's integral in closed form."""
    names = [n for n in TRUTH if n not in (fixed or {})]
    A, t, d = float(BALL.compliance()), data.t[1:], data.depth[1:]

    def ramp(p, s):
        """int_0^s J."""
        tau = p["eta2"] / p["G2"]
        return s / p["G1"] + (s + tau * np.expm1(-s / tau)) / p["G2"] + s**2 / (2 * p["eta1"])

    def residual(u):
        p = dict(zip(names, np.exp(u), strict=True)) | (fixed or {})
        first, later = 1.0 / 600.0, 0.2 / 39400.0
        after = np.maximum(t - 600.0, 0.0)
        integral = (1 - NU) * (first * (ramp(p, t) - ramp(p, after)) + later * ramp(p, after))
        total = integral + A * np.interp(t, KNOTS, LOADS)
        return (0.375 / np.sqrt(R) * total) ** (2 / 3) / d - 1

    start = np.log([TRUTH[n] for n in names])
    return 2 * optimize.least_squares(residual, start, xtol=1e-14, ftol=1e-14, gtol=1e-14).cost


def test_optimum_and_intervals_are_those_of_scipy():
    data = hold(noise=0.005, seed=3)
    found = fit(data, weights="relative")
    cost = scipy_cost(data)
    np.testing.assert_allclose(found.rss, cost, rtol=1e-8)
    rise = stats.f.ppf(0.95, 1, 196) / 196
    for name in ("G1", "eta1"):
        for end in found.intervals[name]:
            height = scipy_cost(data, fixed={name: end}) / cost - 1
            np.testing.assert_allclose(height / rise, 1.0, rtol=1e-2)


@pytest.mark.long
def test_intervals_cover_the_truth():
    """60 seeds of 0.5 % noise: each interval holds the truth as often as a 95 % one should (binomial, 3 sd)."""
    found = [fit(hold(noise=0.005, seed=seed), weights="relative") for seed in range(60)]
    for name, value in TRUTH.items():
        covered = sum(f.intervals[name][0] <= value <= f.intervals[name][1] for f in found)
        assert covered >= 60 * 0.95 - 3 * np.sqrt(60 * 0.95 * 0.05), (name, covered)


@pytest.mark.slow
def test_a_short_hold_does_not_determine_the_flow():
    t = np.concatenate([[0.0], np.linspace(36.0, 7200.0, 200)])
    opened = 0
    for seed in range(10):
        found = fit(hold(noise=0.005, seed=seed, t=t), weights="relative")
        low, high = found.intervals["eta1"]
        assert low > 0
        opened += np.isinf(high) and not found.identified["eta1"]
    assert opened >= 8


@pytest.mark.slow
@pytest.mark.parametrize("control", ["load", "depth"])
def test_nuisances_are_recovered(control):
    """Contact point, drift and machine compliance put into the measured depth are found again."""
    t = np.concatenate([[0.0], np.geomspace(1.0, 40000.0, 400)])
    load = np.interp(t, KNOTS, LOADS)
    depth = depth_of(t, ball=RIGID) + 2e-6 + 5e-11 * t + 3e-6 * load
    data = fitting.IndentationData(t=t, load=load, depth=depth)
    names = ("contact_point", "machine_compliance")
    found = fit(data, RIGID, control=control, drift=5e-11, **dict.fromkeys(names, "fit"))
    truth = {"contact_point": 2e-6, "machine_compliance": 3e-6}
    for name, value in truth.items():
        np.testing.assert_allclose(found.nuisances[name][0], value, rtol=0.02)
    np.testing.assert_allclose(found.values["G2"], TRUTH["G2"], rtol=0.02)


@pytest.mark.slow
def test_ramp_is_oyens_factor():
    """With rise=t_R the fit of depths from Oyen's closed form (her Eq. for t >= t_R) is exact."""
    rise, tau = 3000.0, TRUTH["eta2"] / TRUTH["G2"]
    t = np.linspace(0.0, 40000.0, 201)
    factor = tau / rise * np.expm1(rise / tau)
    integral = (
        1 / TRUTH["G1"] + (1 - factor * np.exp(-t / tau)) / TRUTH["G2"] + (t - rise / 2) / TRUTH["eta1"]
    )
    depth = np.where(t < rise, 1e-9, 0.375 * (1 - NU) / np.sqrt(R) * np.maximum(integral, 0)) ** (2 / 3)
    data = fitting.IndentationData(t=t, load=np.minimum(t / rise, 1.0), depth=depth)
    for name, value in fit(data, RIGID, rise=rise).values.items():
        np.testing.assert_allclose(value, TRUTH[name], rtol=1e-6)
    step = fit(data, RIGID, rise=0.0)
    assert any("differs from it by up to 100 % of the hold, at t = 0 s" in note for note in step.notes)
    assert abs(step.values["G1"] / TRUTH["G1"] - 1) > 0.1


SERIES = {"J0": 1e-9, "J1": 2e-8, "J2": 3e-8, "J3": 7e-8, "fluidity": 3e-13}
SERIES_TIMES = np.array([100.0, 1500.0, 12000.0])


def series_creep(t):
    J = np.array([SERIES[f"J{i}"] for i in (1, 2, 3)])
    return (
        SERIES["J0"]
        - np.expm1(-np.asarray(t)[..., None] / SERIES_TIMES) @ J
        + SERIES["fluidity"] * np.asarray(t)
    )


@pytest.mark.parametrize(
    ("control", "accuracy"), [("load", 1e-6), pytest.param("depth", 2e-3, marks=pytest.mark.slow)]
)
def test_a_series_is_recovered_under_either_control(control, accuracy):
    """Depths of a step load by Lee and Radok; under depth control they are linear between the samples."""
    t = np.concatenate([[0.0], np.geomspace(1.0, 40000.0, 800)])
    depth = lee_radok.step_approach(t, series_creep, 1.0, R, NU)
    data = fitting.IndentationData(t=t, load=np.ones(t.size), depth=depth)
    found = fitting.fit_indentation(data, jc.Prony, tau=SERIES_TIMES, indenter=RIGID, nu=NU, control=control)
    for name, value in SERIES.items():
        np.testing.assert_allclose(found.values[name], value, rtol=accuracy, err_msg=name)
    np.testing.assert_allclose(found.predict(t), series_creep(t), rtol=accuracy)
    assert found.material.tau.tolist() == SERIES_TIMES.tolist() and len(found.covariance()) == 5


@pytest.mark.slow
def test_fixed_bounds_and_other_models():
    data = hold(noise=0.005)
    found = fit(data, weights="relative", fixed={"G2": 1.4e7}, bounds={"eta1": (None, 2.5e12)})
    assert found.values["G2"] == pytest.approx(1.4e7, rel=1e-12) and found.fixed == ("G2",)
    assert found.values["eta1"] == pytest.approx(2.5e12) and not found.identified["eta1"]
    solid = fitting.fit_indentation(data, "StandardLinearSolid", indenter=BALL, nu=NU, weights="relative")
    assert solid.rss > 1.5 * fit(data, weights="relative").rss and solid.misfit


@pytest.mark.slow
def test_report(tmp_path):
    found = fit(hold(noise=0.005), weights="relative")
    text = found.summary()
    for phrase in ("load control", "weights: relative", "conditional on nu = 0.3", "forward and", "1 points"):
        assert phrase in text
    loaded = json.loads(found.to_json())
    assert loaded["parameters"]["G1_Pa"] == found.values["G1"] and loaded["forward_runs"] > 0
    low, high = found.band(TIMES)
    assert np.all((low < found.predict(TIMES)) & (found.predict(TIMES) < high))
    found.plot(tmp_path / "fit.png")
    assert (tmp_path / "fit.png").stat().st_size > 10000


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ({"control": "force"}, "control"),
        ({"nu": 0.6}, "nu"),
        ({"indenter": jc.Cylinder(1e-3, 1e-3)}, "indenter"),
        ({"indenter": jc.Cone(2.0)}, "half-angle"),
        ({"indenter": jc.Sphere(radius=-1.0)}, "radius"),
        ({"weights": "log"}, "weights"),
        ({"drift": "yes"}, "drift"),
        ({"rise": -1.0}, "rise"),
        ({"rise": 1.0, "control": "depth"}, "rise"),
        ({"level": 2.0}, "level"),
        ({"model": "Zener"}, "model"),
        ({"fixed": {"E": 1.0}}, "fixed"),
        ({"model": jc.Prony}, "tau"),
        ({"tau": [1.0]}, "tau"),
    ],
)
def test_bad_options_are_named(options, word):
    with pytest.raises(ValueError, match=word):
        fitting.fit_indentation(hold(), **({"indenter": BALL, "nu": NU} | options))


def test_unloading_under_load_control_is_refused():
    load = np.append(np.ones(200), 0.1)
    data = fitting.IndentationData(t=np.linspace(0, 4e4, 201), load=load, depth=hold().depth)
    with pytest.raises(ValueError, match="requires a growing contact"):
        fit(data)


def load_of(depth, t, p, radius, nu):
    """Load (n,) under a growing depth by Lee and Radok, depth^(3/2) linear in between, summed over all pairs of times."""
    G1, G2, eta1, eta2 = p
    a, b, c = eta2 / G1, G2 / G1 + eta2 / eta1 + 1.0, G2 / eta1
    power, load = depth**1.5, np.zeros(t.size)
    for r in -np.roots([a, b, c]):
        weight = 1.0 / (1 / G1 + G2 / (G2 - eta2 * r) ** 2)
        begin, end = (np.exp(-r * np.maximum(t[:, None] - s, 0.0)) for s in (t[:-1], t[1:]))
        kernel = np.where(t[:, None] > t[:-1], (end - begin) / (r * np.diff(t)), 0.0)
        load += weight.real * (kernel @ np.diff(power) + power[0] * np.exp(-r * t)).real
    return 8.0 * np.sqrt(radius) / (3.0 * (1.0 - nu)) * load


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_no_start_finds_a_lower_minimum(seed):
    """Load 3 % off under depth control, where the first start stops 1 to 2 % above the least squares of scipy from
    twelve starts, with no instantaneous compliance at all."""
    truth = (2338.0, 4335.0, 1.279e5, 222.8)
    t = np.linspace(0.0, 10.0, 60)
    ramp = lambda s: s / truth[0] + (s + 0.0514 * np.expm1(-s / 0.0514)) / truth[1] + s**2 / (2.0 * truth[2])
    growth = 1e-8 * (ramp(t) - ramp(np.maximum(t - 1.0, 0.0)))
    depth = (3 * 0.5 / (8 * np.sqrt(1e-5)) * growth) ** (2 / 3)
    load = 1e-8 * np.minimum(t, 1.0) * (1.0 + 0.03 * np.random.default_rng(seed).standard_normal(t.size))
    data = fitting.IndentationData(t=t, load=load, depth=depth)
    found = fitting.fit_indentation(data, indenter=jc.Sphere(radius=1e-5), nu=0.5, control="depth")
    residual = lambda u: (load_of(depth, t, np.exp(u), 1e-5, 0.5) / load.max() - load / load.max())[1:]
    rng = np.random.default_rng(0)
    starts = np.log(truth) + rng.uniform(-1.5, 1.5, (12, 4))
    limits = np.log(truth)[:, None] + np.array([-9.0, 9.0])
    costs = [2 * optimize.least_squares(residual, u, bounds=(*limits.T,), xtol=1e-12).cost for u in starts]
    assert found.rss <= min(costs) * (1 + 1e-5)
    sought, agreed = found.starts
    assert 1 <= agreed < sought
    assert f"{agreed} of {sought} starts converged to this minimum" in found.summary()


@pytest.mark.long
def test_another_number_of_points_does_not_compile_again_and_a_turn_takes_few_runs():
    """Depth up and down again: thousands of forward runs, each number of points with programs of its own, in the past."""
    counts, rng = [], np.random.default_rng(0)
    for n in (150, 190):
        t = np.linspace(0.0, 9.0, n)
        depth = 1e-6 * (1 - (t / 6.0 - 1) ** 2)
        load = 1e-3 * (depth / 1e-6) ** 1.5 * (0.7 + 0.3 * np.exp(-t / 3.0)) + 1e-6 * rng.standard_normal(n)
        data = fitting.IndentationData(t=t, load=load, depth=depth)
        found = fit(data, RIGID, control="depth")
        assert any("Ting" in note for note in found.notes) and sum(found.runs) < 2000
        counts.append(linear.compiled._cache_size())
    assert counts[0] == counts[1]


@pytest.mark.slow
def test_a_file_s_own_errors_weigh_its_points(tmp_path):
    """depth = m (1/G)^(2/3) under a held load is linear: by numpy's weighted mean, where half of the depths are off and
    said to be so; 95 % are 1.96 standard errors of that mean. The error has the depth's unit."""
    t, P = np.linspace(0.0, 10.0, 40), 60.0
    m = (3 * (1 - NU) * P / (8 * np.sqrt(R))) ** (2 / 3)
    x = (1e-9) ** (2 / 3)
    sigma = np.where(t < 5, 1e-3, 3e-2) * m * x
    depth = m * x + sigma * np.random.default_rng(4).standard_normal(t.size)
    path = tmp_path / "hold.csv"
    rows = np.column_stack([t, np.full(t.size, P * 1e3), depth * 1e9, sigma * 1e9])
    np.savetxt(path, rows, delimiter=",", header="t [s],load [mN],depth [nm],error", comments="")
    data = fitting.read_indentation(path, columns={"sigma_depth": "error"})
    np.testing.assert_allclose(data.window(1.0, None).sigma_depth, sigma[t >= 1.0], rtol=1e-12)
    found = fitting.fit_indentation(data, "Elastic", indenter=RIGID, nu=NU)
    weight = m / sigma
    mean, sd = np.sum(weight**2 * depth / m) / np.sum(weight**2), 1 / np.sqrt(np.sum(weight**2))
    np.testing.assert_allclose(found.values["G"], mean ** (-1.5), rtol=1e-9)
    ends = sorted((mean + 1.959964 * sd * np.array([-1, 1])) ** (-1.5))
    assert found.widening == 1.0 and found.weights == "sigma"
    np.testing.assert_allclose(found.intervals["G"], ends, rtol=1e-6)
    with pytest.raises(ValueError, match="sigma_load: expected standard deviations > 0"):
        fitting.IndentationData(t=t, load=depth, depth=depth, sigma_load=0 * t)


@pytest.mark.slow
def test_estimated_weights_are_those_of_creep_under_a_flat_punch():
    """The depth of a rigid punch under constant load is (1 - nu) P J(t)/(4 R) (I. N. Sneddon, Int. J. Eng. Sci. 3 (1965)
    47), so the fit is that of the creep curve, by another search; both begin with weights from the same differences."""
    t = np.linspace(0.0, 100.0, 61)
    J = 1e-6 * (0.1 - 0.9 * np.expm1(-t / 20.0))
    J = J + 1e-8 * np.hypot(0.3, 1e6 * J) * np.random.default_rng(7).standard_normal(t.size)
    scale, load = (1.0 - 0.3) * 2e-2 / (4.0 * 1e-3), np.full(t.size, 2e-2)
    creep = fitting.fit_creep(fitting.CreepData(t=t, J=J), "StandardLinearSolid", weights="estimated")
    data = fitting.IndentationData(t=t, load=load, depth=scale * J)
    punch = jc.FlatPunch(radius=1e-3)
    found = fitting.fit_indentation(data, "StandardLinearSolid", indenter=punch, nu=0.3, weights="estimated")
    assert creep.kept.all()
    for name, value in creep.values.items():
        assert found.values[name] == pytest.approx(value, rel=1e-6), name
        assert found.intervals[name] == pytest.approx(creep.intervals[name], rel=2e-3), name


@pytest.mark.slow
def test_compared_models_of_an_indentation_rank_the_true_one_first(tmp_path, capsys):
    data = hold(0.003, t=np.concatenate([KNOTS[:2], np.linspace(800.0, 40000.0, 50)]))
    with pytest.raises(ValueError, match="an indentation, got 'estimated'"):
        fitting.compare(data, indenter=RIGID, nu=NU, weights="estimated")
    rows = "".join(f"{t},{P},{d}\n" for t, P, d in zip(data.t, data.load, data.depth, strict=True))
    (tmp_path / "hold.csv").write_text("t [s],load [N],depth [m]\n" + rows)
    flags = [
        "--models",
        "Maxwell,Burgers",
        "--of",
        "indentation",
        "--radius",
        str(R),
        "--ball-modulus",
        "210e9",
    ]
    out = tmp_path / "out"
    assert main(["fit", "compare", str(tmp_path / "hold.csv"), *flags, "-o", str(out)]) == 0
    assert capsys.readouterr().out.splitlines()[1].startswith("Burgers")
    best, other = json.loads((out / "summary.json").read_text())["models"]
    low, high = best["intervals"]["G2_Pa"]
    assert low < TRUTH["G2"] < high < 1.2 * low
    # each fit is that of its model alone
    alone = fitting.fit_indentation(data, "Maxwell", indenter=BALL, nu=NU)
    assert other["model"] == "Maxwell" and other["bic"] == pytest.approx(alone.bic, rel=1e-6)
    assert best["bic"] < other["bic"] - 10.0
    assert fitting.compare(data, ["Maxwell"], indenter=BALL, nu=NU).fits[0].bic == pytest.approx(alone.bic)


def test_a_hold_with_a_clock_of_its_own_has_a_note_on_its_ramp():
    """A hold cut from its ramp, with the clock set to zero; with the ramp as history there is no note."""
    t, load = np.linspace(0.0, 3000.0, 61), np.minimum(np.linspace(0.0, 3000.0, 61) / 600.0, 1.0)
    depth = depth_of(t, np.array([0.0, 600.0, 3000.0]), np.array([0.0, 1.0, 1.0]))
    whole, on = fitting.IndentationData(t=t, load=load, depth=depth), t >= 600.0
    alone = fitting.IndentationData(t=t[on] - 600.0, load=load[on], depth=depth[on])
    run = lambda data: fitting.fit_indentation(data, "StandardLinearSolid", indenter=BALL, nu=NU)
    notes = run(alone).notes
    assert any("taken as applied in a step at t = 0" in note and "ramp" in note for note in notes)
    assert not any("applied in" in note for note in run(whole).notes)


def test_depths_in_other_units_are_refused():
    data = hold()
    wrong = dataclasses.replace(data, depth=1e3 * data.depth)
    with pytest.raises(ValueError, match="depth: expected less than 2 times the radius of the ball"):
        fit(wrong)
