"""Verbs with friction on bodies that flow: a layer on its own material is a half-space, and what is off is told."""

import numpy as np
import pytest

import jaxcontact as jc

MAXWELL = jc.Maxwell(G=1e9, eta=1e9, nu=0.4)
GRID, BALL, LOAD = jc.Grid.square(16, 400e-6), jc.Sphere(5e-3), jc.Load(0.5)
BODIES = [jc.LayeredHalfSpace([], MAXWELL), jc.LayeredHalfSpace([jc.Layer(MAXWELL, 2e-5)], MAXWELL)]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_shear_of_a_layer_on_its_own_material():
    times, push = [0.0, 0.3, 0.6], jc.TangentialLoad([[0.0, 0.0], [0.05, 0.0], [0.1, 0.02]])
    plain, layered = (jc.shear(b, BALL, LOAD, push, times, friction=0.5, grid=GRID) for b in BODIES)
    assert not np.any(layered.status) and not np.any(plain.status)
    size = np.max(np.abs(plain.tangential_displacement))
    np.testing.assert_allclose(
        layered.tangential_displacement, plain.tangential_displacement, atol=1e-4 * size
    )
    np.testing.assert_allclose(layered.approach, plain.approach, rtol=1e-4)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_shear_beyond_the_latest_time_of_the_response_is_told():
    """An elastic layer on a Maxwell substrate, before and after the horizon of its response."""
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9), 2e-5)], MAXWELL)
    shift = jc.TangentialDisplacement([[0.0, 0.0], [1e-8, 0.0], [1e-8, 0.0]])
    # under a load the contact would outgrow the grid first, which has a status of its own
    approach = jc.Approach(2e-6)
    status = jc.shear(body, BALL, approach, shift, [0.0, 0.1, 1e5], friction=0.5, grid=GRID).status
    assert int(status[1]) == 0 and int(status[2]) == jc.Status.NOT_RESOLVED
