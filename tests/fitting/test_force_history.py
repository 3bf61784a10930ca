"""Viscoelastic fits to approach and retraction, against quadratures of Ting's integrals and the contact solver."""

import dataclasses
import json
import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import fitting
import jaxcontact as jc
from fitting.fits import force_history
from jaxcontact.__main__ import main
from tests.support import depth_laws, thin_samples, ting_curves
from tests.support.force_curves import UNITS, G, force_curve
from tests.support.tables import curve_of, read_back

RADIUS, ANGLE, DEEP, NU = 5e-6, 1.0, 1e-6, 0.5
BALL, CONE = jc.Sphere(RADIUS), jc.Cone(ANGLE)
SLOPES = {
    BALL: ting_curves.half_space(8.0 * RADIUS**0.5 / 3.0, 1.5, NU),
    CONE: ting_curves.half_space(4.0 * np.tan(ANGLE) / np.pi, 2.0, NU),
}
SOLID = ting_curves.solid(2000.0, 1000.0, 1.0)  # G1 = G2 = 2 kPa, eta2 = 4 kPa s
SLS = {"G1": 2000.0, "G2": 2000.0, "eta2": 4000.0}
SPRING = ting_curves.kelvin_voigt(500.0, 1000.0, 0.3)
KELVIN_VOIGT = {"G": 500.0, "V": 1000.0, "alpha": 0.3}


def curve(G, slope, turn=1.0, power=1.0, noise=0.01, seed=0, points=200):
    """A curve with baselines before and after, and the noise-free force."""
    before = 0.8 * turn
    t = np.linspace(0.0, 2.0 * (turn + before), points)
    since = t - before
    depth = DEEP * np.where(since < turn, since / turn, 2.0 - since / turn)
    force = ting_curves.force(since, G, DEEP, turn, slope, power)
    rough = noise * np.random.default_rng(seed).standard_normal(points)
    load = force + force.max() * (rough + 0.1 + 0.02 * t / t[-1])
    return fitting.IndentationData(t=t, load=load, depth=depth + 2e-6), force


def holds(fit, truth):
    return all(low <= truth[name] <= high for name, (low, high) in fit.intervals.items())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tip", "model", "truth", "G", "power"),
    [
        (BALL, jc.StandardLinearSolid, SLS, SOLID, 1.0),
        pytest.param(CONE, jc.StandardLinearSolid, SLS, SOLID, 1.0, marks=pytest.mark.slow),
        pytest.param(BALL, jc.FractionalKelvinVoigt, KELVIN_VOIGT, SPRING, 1.0 / 0.7, marks=pytest.mark.slow),
        (CONE, "Springpot", {"V": 1000.0, "alpha": 0.2}, ting_curves.kelvin_voigt(0.0, 1e3, 0.2), 1.0 / 0.8),
    ],
    ids=["ball, solid", "cone, solid", "ball, fractional", "cone, springpot"],
)
def test_a_curve_of_tings_integrals_gives_its_material_back(tip, model, truth, G, power):
    data, force = curve(G, SLOPES[tip], power=power)
    fit = fitting.fit_force(data, indenter=tip, nu=NU, model=model)
    assert not fit.refused and holds(fit, truth)
    value, low, high = fit.nuisances["contact_point"]
    assert low < 2e-6 < high and value == pytest.approx(2e-6, abs=0.02 * DEEP)
    # the force of the model is nearer to the noise-free one than the noise
    assert np.max(np.abs(fit.model_force - force)) < 0.006 * force.max()
    assert fit.relaxation(1.0) == pytest.approx(G(1.0), rel=0.03)


@pytest.mark.slow
def test_without_noise_the_parameters_are_exact_to_a_thousandth():
    data, force = curve(SOLID, SLOPES[BALL], noise=0.0, points=400)
    fit = fitting.fit_force(data, indenter=BALL, nu=NU, model="StandardLinearSolid", weights="absolute")
    assert np.max(np.abs(fit.model_force - force)) < 3e-4 * force.max()
    assert fit.values["G1"] == pytest.approx(2000.0, rel=2e-3)
    assert fit.values["eta2"] == pytest.approx(4000.0, rel=1e-2)


@pytest.mark.slow
def test_an_elastic_and_a_viscous_sample_are_limits():
    """The force of an elastic sample is the same in both directions, of a viscous one eta dF/dt, and 0 on the way back."""
    data, _ = curve(lambda t: 1000.0 + 0.0 * t, SLOPES[BALL], noise=0.002)
    fit = fitting.fit_force(data, indenter=BALL, nu=NU, model="Springpot")
    assert not fit.refused and fit.intervals["alpha"][1] < 0.01
    elastic = fitting.fit_force(data, indenter=BALL, nu=NU)
    assert fit.relaxation(1.0) == pytest.approx(elastic.values["G"], rel=0.01)
    assert not any("approach and retraction differ" in note for note in elastic.notes)

    t = np.linspace(0.0, 2.0, 401)
    depth = np.where(t < 1.0, t, 2.0 - t)
    y = (np.arange(200) + 0.5) / 200.0
    stiff = np.full(200, 2.0 / 200.0)  # F = depth^2
    force = force_history.contact_force(jnp.array([3e4]), jnp.array([1e4]), t, depth, y, stiff)
    assert np.allclose(force[:201], 3.0 * 2.0 * depth[:201], atol=0.03)
    assert np.allclose(force[202:], 0.0, atol=1e-9)


@pytest.mark.slow
def test_a_second_approach_before_the_contact_is_lost_is_that_of_the_contact_solver():
    """Approach, half way back, and a deeper approach: an independent march of the whole surface."""
    times = np.linspace(0.0, 3.0, 31)
    depth = np.interp(times, [0.0, 1.0, 1.4, 3.0], [0.0, 1.0, 0.55, 1.3])
    material = jc.StandardLinearSolid(G1=2.0, G2=1.0, eta2=0.5, nu=0.5)
    body = jc.LayeredHalfSpace([jc.Layer(material, thickness=1.0)], substrate=material)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a coarse solution and of large strains
        solved = jc.indent(
            body, jc.Sphere(1.0), jc.Approach(depth), times, grid=jc.Grid.square(n=32, width=2.8), save="last"
        )
    weights, rates = (
        jnp.array([2.0 / 3.0, 4.0 / 3.0]),
        jnp.array([0.0, 6.0]),
    )  # G1 G2/(G1 + G2), (G1 + G2)/eta2
    fine = np.linspace(0.0, 3.0, 301)
    history = force_history.History(
        fine, np.interp(fine, times, depth), jnp.arange(301), 1.5, 2.0, None, 0.0, jnp.zeros(3)
    )
    force = force_history.contact_force(
        weights, rates, history.t, history.depth, *history.elements(jnp.asarray(1.3), 64)
    )
    assert np.max(np.abs(8.0 / 3.0 / 0.5 * force[::10] - solved.load)) < 0.006 * np.max(solved.load)


@pytest.mark.slow
def test_a_thin_sample_is_that_of_another_solution():
    """The elastic law by the Legendre-Galerkin solution, in Ting's integrals."""
    deep, load = thin_samples.elastic(NU, 0.05, 2.0)
    h = 2e-6
    depths, forces = deep * h**2 / RADIUS, load * h**3 / RADIUS
    ratio = CubicSpline(np.log(depths), np.log(forces / depths**1.5))
    law = lambda d: np.exp(ratio(np.log(np.maximum(d, depths[0])))) * d**1.5
    slope = lambda d: (law(d * (1.0 + 1e-5)) - law(d * (1.0 - 1e-5))) / (2e-5 * d)
    data, force = curve(SOLID, slope, noise=0.005)
    fit = fitting.fit_force(data, indenter=BALL, nu=NU, model="StandardLinearSolid", thickness=h)
    assert not fit.refused and holds(fit, SLS)
    assert np.max(np.abs(fit.model_force - force)) < 0.004 * force.max()
    thick = fitting.fit_force(data, indenter=BALL, nu=NU, model="StandardLinearSolid")
    assert thick.relaxation(1.0) > 1.5 * fit.relaxation(1.0)


@pytest.mark.slow
def test_a_kelvin_voigt_element_relaxes_within_the_time_of_a_sample():
    """G(t) = G + eta delta(t): the force is G P + eta dP/dt in the approach."""
    t = np.linspace(0.0, 2.0, 300)
    depth = np.where(t < 1.2, t - 0.2, 2.2 - t) * DEEP
    d = np.maximum(depth, 0.0)
    G, eta = 1000.0, 100.0
    # elements q = G w + eta dw/dt, until they vanish: |w| decays with eta/G once free, so that q = 0
    size = 4.0 * np.tan(ANGLE) / np.pi / (1.0 - NU)
    y = (np.arange(2000) + 0.5) / 2000.0 * DEEP
    rate = np.where(t < 1.2, 1.0, -1.0) * DEEP
    q = np.maximum(G * np.maximum(depth[:, None] - y, 0.0) + eta * rate[:, None] * (depth[:, None] > y), 0.0)
    force = 2.0 * size * q.mean(1) * DEEP
    load = force + 0.003 * force.max() * np.random.default_rng(2).standard_normal(300)
    fit = fitting.fit_force(
        fitting.IndentationData(t=t, load=load, depth=depth), indenter=CONE, nu=NU, model="KelvinVoigt"
    )
    assert d.max() > 0.0 and not fit.refused
    assert fit.values["G"] == pytest.approx(G, rel=0.02)
    assert fit.values["eta"] == pytest.approx(eta, rel=0.1)
    assert any("without an instantaneous compliance" in note for note in fit.notes)


@pytest.mark.slow
def test_derivatives_of_the_force_in_both_modes():
    t = jnp.linspace(0.0, 2.0, 60)
    depth = jnp.where(t < 1.0, t, 2.0 - t)
    layer = fitting.models.thin_layer.ThinLayer.of(BALL, 2e-6, NU)
    layer = layer._replace(scale=layer.scale * DEEP**layer.power)
    curve = force_history.History(t, depth, jnp.arange(60), 1.5, 2.0, layer, 0.0, jnp.array([0.0, 0.0, 0.02]))
    shape = jnp.sin(jnp.arange(60.0))
    for model, theta in (
        ("StandardLinearSolid", [0.1, 0.0, 0.0, 0.3, 0.0512, 0.0, 0.0, 0.0]),
        ("FractionalKelvinVoigt", [0.1, 0.3, 0.31, 0.0512, 0.0, 0.0, 0.0]),
    ):
        run = lambda x, model=model: shape @ force_history.indentation_force(x, curve, model, 2)
        x = jnp.array(theta)
        forward, reverse = jax.jit(jax.jacfwd(run))(x), jax.jit(jax.grad(run))(x)
        step, value = 1e-6, jax.jit(run)
        some = [i for i in range(x.size - 3) if model != "StandardLinearSolid" or i != 2]
        central = [(value(x.at[i].add(step)) - value(x.at[i].add(-step))) / (2.0 * step) for i in some]
        assert np.allclose(forward, reverse, rtol=1e-9, atol=1e-10)
        assert np.allclose(forward[jnp.array(some)], jnp.array(central), rtol=1e-4, atol=1e-6)
    many = jax.vmap(run)(jnp.stack([x, x + 0.01]))
    assert many[0] == pytest.approx(float(value(x)), rel=1e-12)


@pytest.mark.slow
def test_a_retraction_that_pulls_is_left_out_with_a_note():
    data, force = curve(SOLID, SLOPES[BALL], noise=0.003)
    lost = np.flatnonzero(force > 0.0)[-1]
    for share, words in ((0.05, "the part that pulls left out"), (0.5, "its contact left out")):
        load = data.load.copy()
        load[lost : lost + 15] -= share * force.max()
        other = fitting.IndentationData(t=data.t, load=load, depth=data.depth)
        fit = fitting.fit_force(other, indenter=BALL, nu=NU, model="StandardLinearSolid")
        assert any(words in note for note in fit.notes), fit.notes
        assert not fit.refused and fit.relaxation(1.0) == pytest.approx(SOLID(1.0), rel=0.05)


@pytest.mark.slow
def test_calibration_drag_signs_and_held_parameters():
    data, _ = curve(SOLID, SLOPES[BALL], noise=0.003)
    known = {"indenter": BALL, "nu": NU, "model": "StandardLinearSolid", "fixed": {"G2": 2000.0}}
    fit = fitting.fit_force(data, **known)
    assert fit.values["G2"] == pytest.approx(2000.0, rel=1e-12)
    assert fit.intervals["G1"][0] < 2000.0 < fit.intervals["G1"][1]
    other = fitting.IndentationData(t=data.t, load=-data.load, depth=-data.depth)
    turned = fitting.fit_force(other, **known)
    assert turned.values["G1"] == pytest.approx(fit.values["G1"], rel=1e-6)
    assert turned.nuisances["contact_point"][0] == pytest.approx(-fit.nuisances["contact_point"][0], rel=1e-6)
    assert turned.nuisances["slope"][0] == pytest.approx(-fit.nuisances["slope"][0], rel=1e-3)
    wide = fitting.fit_force(data, **known, errors={"spring_constant": 0.1})
    low, high = wide.intervals["G1"]
    assert np.log(high / low) / 2.0 == pytest.approx(0.196, abs=0.01)
    assert wide.intervals["G2"] == fit.intervals["G2"]  # held


@pytest.mark.slow
def test_what_follows_from_a_fit_includes_the_error_of_the_calibration():
    """All compliances have the error of the spring constant in common: that of the creep at any time is the same."""
    data, _ = curve(SOLID, SLOPES[BALL], noise=0.003)
    known = {"indenter": BALL, "nu": NU, "model": "StandardLinearSolid"}
    sharp = fitting.fit_force(data, **known)
    wide = fitting.fit_force(data, **known, errors={"spring_constant": 0.1})
    for t in (1e-3, 1.0, 10.0):
        found, without = (fitting.propagate(fit, lambda m, t=t: m.creep(t)) for fit in (wide, sharp))
        assert found.sd**2 - without.sd**2 == pytest.approx((0.1 * found.value) ** 2, rel=1e-6)


def test_what_a_viscoelastic_fit_does_not_take():
    data, _ = curve(SOLID, SLOPES[BALL])
    for words, given in (
        ("model: expected one of StandardLinearSolid", {"model": "FractionalMaxwell"}),
        (
            "substrate: expected none",
            {"model": "Maxwell", "thickness": 1e-6, "substrate": jc.Elastic(1e9, 0.3)},
        ),
        ("fixed: expected none without", {"fixed": {"G": 1.0}}),
        (
            "bounds: StandardLinearSolid has parameters",
            {"model": "StandardLinearSolid", "bounds": {"G": (1.0, 2.0)}},
        ),
    ):
        with pytest.raises(ValueError, match=words):
            fitting.fit_force(data, indenter=BALL, nu=NU, **given)
    untimed = fitting.IndentationData(t=data.t, load=data.load, depth=data.depth, numbered=True)
    with pytest.raises(ValueError, match="expected a curve with times"):
        fitting.fit_force(untimed, indenter=BALL, nu=NU, model="Springpot")


@pytest.mark.slow
def test_an_elastic_fit_points_to_a_model_and_has_a_table_over_the_depth():
    data, _ = curve(SOLID, SLOPES[BALL])
    fit = fitting.fit_force(data, indenter=BALL, nu=NU)
    assert any("approach and retraction differ" in note and "model=" in note for note in fit.notes)
    assert fit.modulus_over_depth == ()

    z = np.linspace(-1.0, 1.0, 400)
    d = DEEP * np.maximum(z, 0.0)
    stiffer = (
        16.0 / 9.0 * 1e3 * np.sqrt(RADIUS) * d**1.5 * (1.0 + 9.0 * (d / DEEP) ** 2)
    )  # E from 1 to 10 kPa
    rng = np.random.default_rng(1)
    load = stiffer + stiffer.max() * 1e-3 * rng.standard_normal(400)
    fit = fitting.fit_force(
        fitting.IndentationData(t=np.linspace(0.0, 1.0, 400), load=load, depth=DEEP * z), indenter=BALL
    )
    assert fit.refused
    at, found, low, high = np.array(fit.modulus_over_depth).T
    truth = 1e3 * (1.0 + 9.0 * (at / DEEP) ** 2)
    assert at.size == 5 and np.all(np.abs(found / truth - 1.0)[1:] < 0.15)
    assert np.all((low < truth) & (truth < high)) and np.all(high[1:] < 2.0 * low[1:])
    assert "apparent modulus over the depth" in fit.summary()
    assert len(json.loads(fit.to_json())["modulus_over_depth"]) == 5

    # on a loose layer, which is 0.6 times as stiff as a bonded one
    thin = {"nu": 0.45, "thickness": 2e-6, "unbonded": True}
    factor = np.asarray(fitting.thin_layer_factor(BALL, d, thin["thickness"], 0.45, unbonded=True))
    load = stiffer * factor + (stiffer * factor).max() * 1e-5 * rng.standard_normal(400)
    fit = fitting.fit_force(
        fitting.IndentationData(t=np.linspace(0.0, 1.0, 400), load=load, depth=DEEP * z),
        indenter=BALL,
        **thin,
    )
    at, found, *_ = np.array(fit.modulus_over_depth).T
    truth = 0.75 * (1.0 - 0.45**2) * 16.0 / 9.0 * 1e3 * (1.0 + 9.0 * (at / DEEP) ** 2)
    np.testing.assert_allclose(
        found, truth, rtol=0.06
    )  # the logarithm of this modulus is no spline of five rows


@pytest.mark.slow
@pytest.mark.parametrize(
    "shape, seeds", [(lambda s: 1.0 - 0.6 * s, (0, 1, 6)), (lambda s: 1.0 + 9.0 * s**2, (0, 6, 11))]
)
def test_a_table_over_the_depth_does_not_begin_far_above_the_sample(shape, seeds):
    """With noise a contact too early and a modulus that begins near zero describe a curve as well as the true ones."""
    z = np.linspace(-1.0, 1.0, 400)
    s = np.maximum(z, 0.0)
    for seed in seeds:
        load = 16.0 / 9.0 * 1e3 * shape(s) * np.sqrt(RADIUS) * (DEEP * s) ** 1.5
        load = load + 3e-3 * load.max() * np.random.default_rng(seed).standard_normal(400)
        data = fitting.IndentationData(t=1e-3 * np.arange(400.0), load=load, depth=DEEP * z)
        at, found, low, high = np.array(fitting.fit_force(data, indenter=BALL).modulus_over_depth).T
        truth = 1e3 * shape(at / DEEP)
        # the noise moves the contact point, from which the depth counts (measured: by up to 2 %)
        assert at[-1] == pytest.approx(DEEP, abs=0.05 * DEEP)
        assert np.all((low < truth) & (truth < high)) and np.all(np.abs(found / truth - 1.0)[1:] < 0.15)


@pytest.mark.slow
def test_intervals_over_the_depth_of_a_film_on_a_soft_base_include_a_steep_fall_from_the_contact():
    """A softer base makes the modulus fall steeply where the contact begins. Of 60 curves 72 to 90 % of the 95 % intervals
    hold the modulus, by depth. Intervals of a spline in the depth alone, without one in its root, held it in 0 to 7 % at
    four of the five depths."""
    inside, off = [], []
    for seed in range(6):
        data, tip = depth_laws.curve("film on a soft base", "proportional", 0.01, seed)
        found = depth_laws.held(
            fitting.fit_force(data, indenter=tip, nu=depth_laws.NU), "film on a soft base"
        )
        inside.append(found[0])
        off.append(found[1])
    assert np.mean(inside) > 0.6 and np.max(np.abs(off)) < 0.06


@pytest.mark.long
@pytest.mark.parametrize("noise, size", [("constant", 0.001), ("correlated", 0.003)])
def test_intervals_of_the_modulus_over_the_depth_hold_it(noise, size):
    """Of 40 simulated curves at least 85 % of the intervals hold the true modulus at each depth: three standard errors
    (3.4 %) below 95 %. Intervals that take the contact point as known hold it less often, and those of correlated noise in
    80 % where the contact points are weighted by the integral of the density over the moduli (measured: 97 %)."""
    inside = []
    for seed in range(40):
        data, tip = depth_laws.curve("stiffens", noise, size, seed)
        fit = fitting.fit_force(data, indenter=tip, nu=depth_laws.NU)
        assert fit.refused
        inside.append(depth_laws.held(fit, "stiffens")[0])
    assert np.all(np.mean(inside, 0) >= 0.85)


@pytest.mark.slow
def test_the_command_fits_a_pyramid(tmp_path, capsys):
    face = np.radians(35.0)
    cone = np.arctan(2.0 / np.sqrt(np.pi) * np.tan(face))  # of equal area
    data, _ = curve(SOLID, ting_curves.half_space(4.0 * np.tan(cone) / np.pi, 2.0, NU))
    file = tmp_path / "curve.csv"
    np.savetxt(
        file, np.column_stack([data.t, data.load, data.depth]), delimiter=",", header="t [s],load [N],depth [m]",
        comments="",
    )  # fmt: skip
    words = ["fit", "force", str(file), "-o", str(tmp_path / "out"), "--pyramid", "35"]
    assert main([*words, "--model", "StandardLinearSolid", "--fix", "G2=2000"]) == 0
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert found["model"] == "StandardLinearSolid" and found["verdict"] == "accepted"
    assert found["intervals"]["eta2_Pa_s"][0] < 4000.0 < found["intervals"]["eta2_Pa_s"][1]
    assert "slope_N_per_m" in found["nuisances"] and (tmp_path / "out" / "fit.png").exists()
    read_back(tmp_path / "out" / "curve.csv", curve_of("load", "N"))
    assert main([*words, "--force"]) == 0
    assert "--model fits" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize(
    ("parameter", "noise", "name"),
    [
        pytest.param(None, 0.0002, "JKR", marks=pytest.mark.long),
        (1.0, 0.003, "Maugis"),
        pytest.param(0.05, 0.003, "DMT", marks=pytest.mark.long),
        pytest.param(None, 0.01, "cannot tell", marks=pytest.mark.long),
    ],
)
def test_the_contact_model_follows_from_the_tabor_number(parameter, noise, name):
    """Maugis's lambda is 1.157 times the Tabor number; curves by ``reference.maugis``."""
    data = force_curve(parameter, noise, n=120)
    fit = fitting.fit_force(data, indenter=jc.Sphere(5e-6), nu=0.5, adhesion="auto")
    found = fit.contact_model
    assert found.name == name and len(found.candidates) == 3, found.lines()
    assert (len(found.possible) > 1) == (name == "cannot tell")
    if parameter is not None:
        assert found.tabor[1] < parameter / 1.157 < found.tabor[2]
    if name == "DMT":  # whose modulus is 2 % too low here, with an interval of 0.25 %
        low, high = fit.intervals["G"]
        assert low < G < high and "the result is Maugis's all the same" in found.words
    assert f"contact model: {name}" in fit.summary() and "Tabor number" in found.words
    assert json.loads(fit.to_json())["contact_model"]["possible"] == list(found.possible)


@pytest.mark.slow
def test_the_command_chooses_a_contact_model(tmp_path, capsys):
    data = force_curve(1.0, 0.003, n=120)
    rows = "".join(
        f"{t:.9g},{P:.9g},{d:.9g}\n" for t, P, d in zip(data.t, data.load, data.depth, strict=True)
    )
    (tmp_path / "curve.csv").write_text("Time (s),Load (N),Depth (m)\n" + rows)
    words = [
        "fit",
        "force",
        str(tmp_path / "curve.csv"),
        "--radius",
        "5e-6",
        "--adhesion",
        "auto",
        "-o",
        str(tmp_path / "out"),
    ]
    assert main(words) == 0
    assert "contact model: Maugis" in capsys.readouterr().out


@pytest.mark.slow
def test_a_drag_is_subtracted_before_the_contact_model_is_chosen():
    """A constant force of 5 % of the unit of load, against the motion: the fit is that of the curve without it."""
    data = force_curve(1.0, 0.003, n=120)
    speed = np.abs(np.gradient(data.depth[:120], data.t[:120])).mean()
    force = 0.05 * UNITS.load * np.where(data.segments == "approach", 1.0, -1.0)
    dragged = dataclasses.replace(data, load=data.load + force)
    given = {"indenter": jc.Sphere(5e-6), "nu": 0.5, "adhesion": "auto"}
    plain = fitting.fit_force(data, **given)
    known = fitting.fit_force(dragged, drag=force[0] / speed, **given)
    read = fitting.fit_force(dragged, drag="fit", **given)
    unsaid = fitting.fit_force(dragged, **given)
    for name in ("G", "work"):
        assert known.values[name] == pytest.approx(plain.values[name], rel=0.01)
        assert read.values[name] == pytest.approx(plain.values[name], rel=0.02)
    assert known.verdict == read.verdict == "accepted"
    assert any("error of the drag" in note for note in read.notes)
    assert any('drag="fit" subtracts it' in note for note in unsaid.notes)


@pytest.mark.slow
@pytest.mark.parametrize("pull", [0.0, 0.03])
def test_a_tension_below_the_noise_is_in_the_interval_of_the_modulus(pull):
    """DMT: the force of Hertz less a constant in contact, 0 or three standard deviations of the noise; E = 5 kPa."""
    z = np.linspace(-1.0, 1.0, 400)
    load = 16.0 / 9.0 * 5e3 * np.sqrt(RADIUS) * (DEEP * np.maximum(z, 0.0)) ** 1.5
    load, top = np.append(load, load[::-1]), load.max()
    depth = DEEP * np.append(z, z[::-1])
    held, wide = 0, []
    for seed in range(8):
        noise = 0.01 * top * np.random.default_rng(seed).standard_normal(800)
        data = fitting.IndentationData(np.arange(800) / 400, load - pull * top * (depth > 0.0) + noise, depth)
        fit = fitting.fit_force(data, indenter=BALL, adhesion="auto")
        E, low, high = fit.youngs_modulus
        held += low < 5e3 < high
        assert fit.verdict == "accepted"
        np.testing.assert_allclose(3.0 * np.array(fit.intervals["G"]), [low, high])
        wide.append(E / low - 1.0)
        assert fit.contact_model.name == ("cannot tell" if pull else "Hertz")
    assert held >= 7  # of 95 % intervals
    # the noise makes 0.9 %, and a tension that it may hide 0.8 % where there is none
    assert max(wide) < (0.08 if pull else 0.03)


def test_without_tension_or_retraction_the_contact_model_says_so():
    z = np.linspace(-1.0, 1.0, 300)
    load = 16.0 / 9.0 * 1e3 * np.sqrt(RADIUS) * (DEEP * np.maximum(z, 0.0)) ** 1.5
    both = np.append(load, load[::-1])
    both = both + 0.002 * load.max() * np.random.default_rng(0).standard_normal(600)
    data = fitting.IndentationData(np.linspace(0.0, 2.0, 600), both, DEEP * np.append(z, z[::-1]))
    fit = fitting.fit_force(data, indenter=BALL, adhesion="auto")
    assert fit.contact_model.name == "Hertz" and 0.0 < fit.contact_model.largest_work < 1e-5
    assert fit.youngs_modulus[0] == pytest.approx(1e3, rel=0.02)
    half = fitting.fit_force(data.only("approach"), indenter=BALL, adhesion="auto")
    assert half.contact_model.name == "cannot tell" and "no retraction" in half.summary()
    for words, given in (
        ('expected "auto" or None', {"adhesion": 0.05}),
        ("expected no model", {"model": "Maxwell"}),
        (
            "expected no substrate, spring_constant",
            {"substrate": jc.Elastic(1e9, nu=0.3), "spring_constant": 0.1},
        ),
        ("expected no bounds of work", {"bounds": {"work": (0.0, 1e-3)}}),
    ):
        with pytest.raises(ValueError, match=words):
            fitting.fit_force(data, indenter=BALL, **({"adhesion": "auto"} | given))
