"""Fits of curves whose indenter creeps, or is coated, of a material that is known."""

import numpy as np
import pytest

import fitting
import jaxcontact as jc

SOUGHT = jc.StandardLinearSolid(G1=2e6, G2=1e6, eta2=2e7, nu=0.4)
RUBBER = jc.StandardLinearSolid(G1=1.5e6, G2=3e6, eta2=3e7, nu=0.3)


def hold(ball, t, rise):
    """Depths [m] under 5 mN, which rises linearly, as the contact solver has them, and their data."""
    load = 5e-3 * np.minimum(t / rise, 1.0)
    body = jc.LayeredHalfSpace([], SOUGHT)
    grid = jc.Grid.around(body, ball, jc.Load(5e-3), t, n=32)
    depth = jc.indent(body, ball, jc.Load(load), t, grid=grid, substeps=4, save="last").approach
    return fitting.IndentationData(t=t[1:], load=load[1:], depth=np.asarray(depth)[1:])


@pytest.mark.filterwarnings("ignore:only .* cells", "ignore:.* steps, the first", "ignore:the time steps")
@pytest.mark.slow
@pytest.mark.parametrize("control", ["load", "depth"])
def test_a_ball_that_creeps_adds_its_known_compliance(control):
    """The moduli within the error of the simulated curve, and off by a half where the ball is taken as rigid."""
    t = np.concatenate([np.linspace(0.0, 2.0, 21), np.geomspace(2.2, 100.0, 30)])
    ball = jc.Sphere(2e-3, RUBBER)
    data = hold(ball, t, 2.0)
    fit = fitting.fit_indentation(data, "StandardLinearSolid", indenter=ball, nu=0.4, control=control)
    for name in ("G1", "G2", "eta2"):
        assert fit.values[name] == pytest.approx(getattr(SOUGHT, name), rel=0.03)
    rigid = fitting.fit_indentation(
        data, "StandardLinearSolid", indenter=jc.Sphere(2e-3), nu=0.4, control=control
    )
    assert rigid.values["G1"] < 0.7 * SOUGHT.G1


def test_a_coated_ball_on_a_half_space_is_refused():
    coat = jc.LayeredHalfSpace([jc.Layer(RUBBER, 1e-6)], jc.Elastic(1e9))
    t = np.linspace(0.0, 1.0, 20)
    data = fitting.IndentationData(t=t, load=1e-3 * (t + 0.1), depth=1e-6 * (t + 0.1))
    with pytest.raises(ValueError, match="indenter material: expected one material or None"):
        fitting.fit_indentation(data, indenter=jc.Sphere(1e-3, coat), nu=0.4)
