"""Creep and relaxation of a thin bonded layer, against another axisymmetric solution, quadrature and the contact solver."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

import fitting
import jaxcontact as jc
from tests.support.thin_samples import BEAD as R
from tests.support.thin_samples import GEL as TRUE
from tests.support.thin_samples import GEL_NU as NU
from tests.support.thin_samples import HEIGHT as H
from tests.support.thin_samples import PEAK, gel_creep, gel_data, gel_law, spline
from tests.support.thin_samples import TIMES as T

BALL = jc.Sphere(R)


def fitted(load, depth, t=T, **given):
    data = gel_data(load, depth, t)
    given = {"indenter": BALL, "nu": NU, "thickness": H} | given
    return fitting.fit_indentation(data, "StandardLinearSolid", **given)


@pytest.mark.parametrize("control", ["load", "depth"])
def test_a_sample_too_thin_for_the_table_is_refused(control):
    """A contact that is more than ten times as wide as the sample is thick."""
    with pytest.raises(ValueError, match=r"up to 10, got 12.5 at the largest depth of 1e-06 m"):
        fitted(1e-3 * T, 1e-6 * T / T[-1], control=control, thickness=4e-7)


@pytest.mark.slow
def test_a_viscoelastic_gel_in_a_dish_is_recovered_from_creep():
    load, depth = gel_creep(T, **TRUE)
    noise = 2e-3 * depth.max() * np.random.default_rng(3).standard_normal(T.size)
    fit = fitted(load, depth + noise * (T > 0))
    assert not fit.refused
    for name, value in TRUE.items():
        low, high = fit.intervals[name]
        assert low < value < high and high / low < 1.04
    assert "bonded to a rigid base" in fit.summary()
    assert any("of the thickness" in note for note in fit.notes)


def _kernel(now, slope):
    """The integrand of Lee and Radok at a time, with G(t) of the standard linear solid in closed form."""
    G1, G2, eta2 = TRUE.values()
    end = G1 * G2 / (G1 + G2)
    return lambda s: (end + (G1 - end) * np.exp(-(now - s) * (G1 + G2) / eta2)) * slope(s)


def test_a_retardation_time_of_zero_is_reported():
    load, depth = gel_creep(T, **TRUE)
    fit = dataclasses.replace(fitted(load, depth), tau=0.0)
    assert fit.t_over_tau == np.inf and "T/tau" not in fit.summary()


@pytest.mark.slow
def test_relaxation_at_a_given_depth_agrees_with_quadrature():
    """The load of a ramp and hold of the depth, with the integral of Lee and Radok by adaptive quadrature."""
    t = np.concatenate([np.linspace(0.0, 1.0, 41), np.geomspace(1.1, 30.0, 20)])
    depth = 4e-6 * np.minimum(t, 1.0)
    force = spline(*gel_law(NU))
    slope = lambda s: (force(4e-6 * (s + 1e-4)) - force(4e-6 * (s - 1e-4))) / 2e-4
    load = [quad(_kernel(now, slope), 1e-4, min(now, 1.0), limit=60)[0] for now in t[1::5]]
    some = np.append(0, np.arange(t.size)[1::5])
    whole = np.interp(t, t[some], np.append(0.0, load))  # the points between are not fitted
    sigma = np.where(np.isin(np.arange(t.size), some), 1e-12, 1e-2)
    fit = fitted(whole, depth, t, control="depth", sigma=sigma)
    for name, value in TRUE.items():
        assert fit.values[name] == pytest.approx(value, rel=5e-3), name


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:film strain", "ignore:the contact radius")
def test_the_depth_under_a_load_is_that_of_the_contact_solver():
    """On a base a thousand million times as stiff; the solver's error is that of its grid."""
    gel = jc.StandardLinearSolid(**TRUE, nu=0.3)
    body = jc.LayeredHalfSpace([jc.Layer(gel, H)], jc.Elastic(1e12, 0.3))
    times = jnp.array([0.0, 1.0, 6.0, 30.0])
    load = 0.3 * PEAK
    run = jc.indent(body, BALL, jc.Load(load), times, grid=jc.Grid.square(n=96, width=50e-6), substeps=4)
    t = np.append(0.0, np.geomspace(1e-3, 30.0, 60))
    steps = np.asarray(gel.creep(jnp.asarray(t)))
    depth, force = gel_law(0.3)
    exact = spline(force, depth)(load * steps)
    known = np.interp(np.asarray(times), t, exact)
    np.testing.assert_allclose(np.asarray(run.approach), known, rtol=5e-3)
    fit = fitted(np.full(t.size, load), exact, t, nu=0.3)
    assert fit.values["G2"] == pytest.approx(TRUE["G2"], rel=1e-4)


@pytest.mark.slow
def test_the_spread_of_the_thickness_is_that_of_fits_at_other_thicknesses():
    load, depth = gel_creep(T, **TRUE)
    fit = fitted(load, depth)
    near = [fitted(load, depth, thickness=H * factor) for factor in (0.99, 1.01)]
    change = abs(near[1].values["G1"] - near[0].values["G1"]) / 0.02  # dG1/dln h
    band = fitting.propagate(fit, lambda material, h: material.G1 + 0.0 * h, spread={"thickness": 0.01 * H})
    assert band.shares["thickness"] == pytest.approx(0.01 * change, rel=1e-2)
    near = [fitted(load, depth, nu=nu) for nu in (0.49, 0.5)]
    change = abs(near[1].values["G1"] - near[0].values["G1"]) / 0.01
    at = fitted(load, depth, nu=0.495)
    band = fitting.propagate(at, lambda material: material.G1, spread={"nu": 0.001})
    assert band.shares["nu"] == pytest.approx(0.001 * change, rel=2e-2)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"layer": 1e-6, "substrate": jc.Elastic(1e9, 0.3)}, "thickness: expected no layer"),
        ({"nu": None, "bulk_modulus": 1e9}, "bulk_modulus: expected nu with a thickness"),
        ({"indenter": jc.Sphere(R, jc.Elastic(1e9, 0.3))}, "indenter: expected a rigid one on a thin layer"),
        ({"nu": -0.1}, "nu: expected 0 to 0.5 for a thin layer"),
    ],
    ids=["layer", "bulk modulus", "elastic ball", "nu"],
)
def test_mistakes(given, message):
    load, depth = gel_creep(T, **TRUE)
    with pytest.raises(ValueError, match=message):
        fitted(load, depth, **given)
