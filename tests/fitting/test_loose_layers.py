"""Fits of samples that slide on their base: the factor against published and independent forces, and each fit."""

import json

import jax.numpy as jnp
import numpy as np
import pytest

import fitting
import jaxcontact as jc
from fitting.models.thin_layer import Base, compliance
from jaxcontact.__main__ import main

# f of F = E h^3/((1 - nu^2) R) f(R d/h^2) at nu 0.5, bonded by N. Hermanowicz, Int. J. Mech. Sci. 193 (2021) 106138, loose
# by an axisymmetric solution that shares no code with the package
FORCES = {False: {0.1: 0.06581, 1.0: 6.82264, 10.0: 2224.5}, True: {0.1: 0.05521, 1.0: 3.3394, 10.0: 314.86}}
BALL, h = jc.Sphere(radius=1e-3), 2e-5


@pytest.mark.parametrize("unbonded", [True, False])
def test_factor_against_the_force_law_of_thin_gels(unbonded):
    for x, f in FORCES[unbonded].items():
        depth = x * h**2 / 1e-3
        expected = f / (4.0 / 3.0 * x**1.5)  # over Hertz's force at the same depth
        found = fitting.thin_layer_factor(BALL, depth, h, 0.5, unbonded=unbonded)
        np.testing.assert_allclose(found, expected, rtol=2e-3)


@pytest.mark.parametrize("base", [None, jc.Elastic(7.0, 0.2), jc.Elastic(0.01, 0.4)])
def test_compliance_is_that_of_the_contact_solver(base):
    """H of a loose layer by two formulas; the oracle of the second is in tests/response/test_bases.py."""
    x, nu = np.geomspace(1e-6, 15.0, 60), 0.35
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(2.0, nu), 1.0, bonded=False)], base)
    exact = np.asarray(jc.normal_response(body, x)) * x * 2.0 / (1.0 - nu) - 1.0
    ours = Base(bonded=False) if base is None else Base(2.0 / base.G, base.nu, bonded=False)
    np.testing.assert_allclose(compliance(x, nu, ours), exact, rtol=1e-7, atol=1e-12)


def loose_forces(G, depth, nu=0.5):
    """The force on the ball on a loose layer, by the factor that the test above compares."""
    factor = np.asarray(fitting.thin_layer_factor(BALL, depth, h, nu, unbonded=True))
    return 8.0 / 3.0 * G / (1.0 - nu) * np.sqrt(1e-3) * depth**1.5 * factor


@pytest.mark.slow
def test_force_curve_of_a_loose_gel():
    """The modulus comes back; bonded, the same curve gives a smaller one; misuse is refused."""
    t = np.linspace(0.0, 1.0, 301)
    depth = 1e-6 * t
    load = loose_forces(500.0, np.maximum(depth - 4e-7, 0.0))
    curve = fitting.IndentationData(t=t, load=load, depth=depth)
    fit = fitting.fit_force(curve, indenter=BALL, thickness=h, unbonded=True)
    np.testing.assert_allclose(fit.values["G"], 500.0, rtol=1e-3)
    assert "loose on a rigid base" in str(fit) and fit.unbonded
    stuck = fitting.fit_force(curve, indenter=BALL, thickness=h)
    assert stuck.values["G"] < 480.0 and "bonded to a rigid base" in str(stuck)
    with pytest.raises(ValueError, match="unbonded: expected False without a layer, got True"):
        fitting.fit_force(curve, indenter=BALL, unbonded=True)
    with pytest.raises(ValueError, match="polynomials: expected False with unbonded"):
        fitting.fit_force(curve, indenter=BALL, thickness=h, unbonded=True, polynomials=True)
    with pytest.raises(ValueError, match="unbonded: expected True or False, got 'yes'"):
        fitting.fit_force(curve, indenter=BALL, thickness=h, unbonded="yes")


@pytest.mark.slow
def test_the_command(tmp_path, here, capsys):
    """``--unbonded`` in the shell, and in the summary."""
    t = np.linspace(0.0, 1.0, 201)
    depth = 1e-6 * t
    rows = np.column_stack([t, 1e9 * loose_forces(500.0, np.maximum(depth - 4e-7, 0.0)), 1e9 * depth])
    np.savetxt(tmp_path / "gel.csv", rows, delimiter=",", header="t [s],load [nN],depth [nm]", comments="")
    assert main(["fit", "force", "gel.csv", "--radius", "1e-3", "--thickness", "2e-5", "--unbonded"]) == 0
    found = json.loads((tmp_path / "gel-fit" / "summary.json").read_text())
    assert found["unbonded"] and abs(found["youngs_modulus_Pa"]["value"] / 1500.0 - 1.0) < 1e-3
    assert "loose on a rigid base" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("substrate", [None, pytest.param(jc.Elastic(G=2e3, nu=0.3), marks=pytest.mark.slow)])
def test_stiffness_over_depth_of_a_loose_film(substrate):
    """Data by differences of the force of the contact solver on a grid; the modulus within their error of a per cent."""
    G, nu, thickness = 500.0, 0.45, 2e-5
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(G, nu), thickness, bonded=False)], substrate)
    depth = np.linspace(2e-7, 1.5e-6, 14)
    grid = jc.Grid.square(n=64, width=2.6 * np.sqrt(1e-3 * depth[-1]) * 1.1)
    near = np.sort(np.concatenate([0.98 * depth, 1.02 * depth]))
    load = np.asarray(jc.indent(body, BALL, jc.Approach(near), np.arange(28.0), grid=grid).load)
    data = fitting.StiffnessData(depth=depth, stiffness=(load[1::2] - load[::2]) / (0.04 * depth))
    given = {"indenter": BALL, "nu": nu, "thickness": thickness, "substrate": substrate}
    fit = fitting.fit_stiffness(data, **given, unbonded=True)
    np.testing.assert_allclose(fit.values["G"], G, rtol=0.01)
    assert "loose on" in str(fit)
    assert abs(fitting.fit_stiffness(data, **given).values["G"] / G - 1.0) > 0.05


@pytest.mark.slow
def test_creep_of_a_loose_gel():
    """A step of load on a Maxwell gel: J(t) from the inverse of the elastic force; bonded the fit has other moduli."""
    t = np.linspace(0.0, 10.0, 41)
    J, load = (1.0 + t / 8.0) / 500.0, 3e-6
    depths = np.geomspace(1e-9, 2e-5, 4000)
    depth = np.interp(load * J, loose_forces(1.0, depths), depths)
    data = fitting.IndentationData(t=t, load=np.full(t.size, load), depth=depth)
    fit = fitting.fit_indentation(data, "Maxwell", indenter=BALL, nu=0.5, thickness=h, unbonded=True)
    np.testing.assert_allclose([fit.values["G"], fit.values["eta"]], [500.0, 4000.0], rtol=1e-3)
    assert "loose on a rigid base" in str(fit)
    with pytest.raises(ValueError, match="unbonded: expected none with a fit of the work"):
        fitting.fit_indentation(
            data, "Elastic", indenter=BALL, control="depth", adhesion="JKR", layer=1e-5,
            substrate=jc.Elastic(1e6, 0.3), unbonded=True,
        )  # fmt: skip


@pytest.mark.long
def test_creep_of_a_loose_film_by_the_contact_solver():
    """``layer=`` with an elastic base: data of ``indent`` on a finer grid."""
    t, nu, base = np.linspace(0.0, 4.0, 9), 0.45, jc.Elastic(G=5e3, nu=0.3)
    body = jc.LayeredHalfSpace([jc.Layer(jc.Maxwell(500.0, 4000.0, nu=nu), h, bonded=False)], base)
    grid = jc.Grid.square(n=96, width=1.5e-4)
    run = jc.indent(body, BALL, jc.Load(jnp.full(t.size, 1e-7)), t, grid=grid)
    data = fitting.IndentationData(t=t, load=np.full(t.size, 1e-7), depth=np.asarray(run.approach))
    fit = fitting.fit_indentation(
        data, "Maxwell", indenter=BALL, nu=nu, layer=h, substrate=base, unbonded=True
    )
    np.testing.assert_allclose([fit.values["G"], fit.values["eta"]], [500.0, 4000.0], rtol=0.02)
    assert "slides on what is below it" in str(fit)
