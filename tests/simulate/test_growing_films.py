"""Films that form or wear: what is assumed, the order in the step, and derivatives by the thickness over time."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tolerances import TIGHT_SOLVER

import jaxcontact as jc

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore:only", "ignore:film strain"),
]
NT, H, G, NU = 9, 1e-7, 1e9, 0.3
GRID = jc.Grid.square(16, 160e-6)
X, Y = (np.asarray(a) for a in GRID.coordinates())
BALL = jc.HeightField(-(X**2 + Y**2) / 20e-3)
PUNCH = jc.HeightField(np.where(X**2 + Y**2 < 50e-6**2, 0.0, -1.0))
TIMES = np.linspace(0.0, 100.0, NT)
GROWING = np.linspace(H, 3 * H, NT)


def approach(thickness, load, times=TIMES, indenter=BALL, eta=1e11, substrate=80e9):
    """Of a Maxwell film, (nt,) [m]; all runs over time share one program."""
    body = jc.LayeredHalfSpace([jc.Layer(jc.Maxwell(G, eta, NU), thickness)], jc.Elastic(substrate, 0.3))
    load = jnp.broadcast_to(jnp.asarray(load, float), (NT,))
    run = jc.indent(body, indenter, jc.Load(load), times, grid=GRID, tolerance=1e-11, save="last")
    return run.approach


def test_a_film_that_keeps_its_thickness_is_the_film():
    np.testing.assert_allclose(approach(np.full(NT, H), 1.0), approach(H, 1.0), rtol=1e-10)


@pytest.mark.long
def test_layers_that_keep_their_thickness_are_the_stack():
    """One thickness over time makes every layer grow in increments; the rest stay as they are."""

    def of_stack(first, second):
        layers = [jc.Layer(jc.Maxwell(G, 1e11, NU), first), jc.Layer(jc.Maxwell(3 * G, 1e12, 0.4), second)]
        body = jc.LayeredHalfSpace(layers, jc.Elastic(80e9, 0.3))
        return jc.indent(body, BALL, jc.Load(1.0), TIMES, grid=GRID, tolerance=1e-11, save="last").approach

    np.testing.assert_allclose(of_stack(np.full(NT, H), 2 * H), of_stack(H, 2 * H), rtol=TIGHT_SOLVER)


def test_an_elastic_film_that_grows_under_a_held_load_moves_nothing():
    """And then meets a higher load with what it has become: under a flat punch as if it had always been so."""
    load = np.where(np.arange(NT) < 6, 1.0, 2.0)
    grown = np.where(np.arange(NT) < 5, GROWING, GROWING[5])
    grows, thick = (approach(h, load, indenter=PUNCH, eta=1e30) for h in (grown, np.full(NT, GROWING[5])))
    np.testing.assert_allclose(grows[:6], grows[0], rtol=1e-9)
    assert float(grows[0]) < 0.95 * float(thick[0])
    np.testing.assert_allclose(grows[6:] - grows[0], thick[6:] - thick[0], rtol=1e-7)


def test_a_flat_punch_on_a_growing_fluid_is_a_growing_bed_of_springs():
    """Thin on a rigid base: approach/p = c (h(0)/G + int h dt/eta), c of uniaxial strain, whatever h(t)."""
    for thickness in (GROWING, GROWING[::-1]):
        found = approach(thickness, 1.0, indenter=PUNCH, substrate=1e17)
        flowed = np.append(0.0, np.cumsum((thickness[1:] + thickness[:-1]) / 2 * np.diff(TIMES))) / 1e11
        exact = (thickness[0] / G + flowed) / (thickness[0] / G)
        np.testing.assert_allclose(found / found[0], exact, rtol=2e-3)


def test_second_order_in_the_step():
    """A load that rises on a film that grows, in 2, 4 and 8 steps: rows of no length stand at the end."""

    def in_steps(n):
        t = np.minimum(np.arange(NT) / n, 1.0)
        return float(approach(H * (1 + 2 * t**2), 1.0 + t**2, times=100.0 * t)[-1])

    coarse, middle, fine = map(in_steps, (2, 4, 8))
    assert (coarse - middle) / (middle - fine) == pytest.approx(4.0, rel=0.3)


def test_derivatives_by_the_thickness_at_every_time():
    last = lambda h: approach(h, np.linspace(1.0, 2.0, NT))[-1]
    slope = jax.jit(jax.grad(last))(jnp.asarray(GROWING))
    for i in (0, 4, NT - 1):
        step = 1e-3 * H * np.eye(NT)[i]
        difference = (last(GROWING + step) - last(GROWING - step)) / (2e-3 * H)
        assert float(slope[i]) == pytest.approx(float(difference), rel=1e-4)
