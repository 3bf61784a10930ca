"""Graded layers against the differential equations of a solid whose modulus varies with depth."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bodies import STEEL
from scipy.integrate import solve_ivp

import jaxcontact as jc

NU, H = 0.3, 1e-6


def modulus(depth, G=1e9, growth=2.5):
    """Grows exponentially with depth over H [Pa]."""
    return G * jnp.exp(growth * depth / H)


def body(layers, **profile):
    film = jc.Graded(lambda depth: jc.Elastic(modulus(depth, **profile), NU), H, layers=layers)
    return jc.LayeredHalfSpace([film], STEEL)


def continuous(x, G=1e9, growth=2.5):
    """alpha N [1/Pa] at alpha H = x, from the equations of equilibrium as a Riccati equation in depth.

    Under u = (i U, W), (sigma_xz, sigma_zz) = (i T, S), all times exp(i alpha x): with lambda + 2 mu = M and
    d/dz = ', U' = T/mu - alpha W, W' = (S + lambda alpha U)/M, T' = alpha (M U alpha - lambda W'), S' = alpha T. The
    compliance Y in (U, W) = Y (T, S) is carried from deep below, where it is that of nothing, up to the surface.
    """
    ratio = 2.0 * NU / (1.0 - 2.0 * NU)

    def slope(z, y):  # z and 1/alpha in units of H, moduli in units of G
        mu = np.exp(growth * z) if z < 1.0 else float(STEEL.G) / G
        lame, M = ratio * mu, (ratio + 2.0) * mu
        Y, AB = y.reshape(2, 2), np.array([[0.0, -x], [x * lame / M, 0.0]])
        C = x**2 * np.diag([M - lame**2 / M, 0.0])
        return (AB @ Y + np.diag([1.0 / mu, 1.0 / M]) - Y @ C @ Y + Y @ AB.T).ravel()

    y = np.zeros(4)
    for start, end in ((1.0 + 30.0 / x, 1.0), (1.0 - 1e-12, 0.0)):
        y = solve_ivp(slope, (start, end), y, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    return -x * y[3] / G


X = np.array([0.2, 3.0])
scaled = jax.jit(lambda body, x: jc.normal_response(body, x / H) * x / H)


def test_sublayers_converge_with_the_square_of_their_number():
    exact = np.array([continuous(x) for x in X])
    errors = [scaled(body(n), X) / exact - 1.0 for n in (8, 16)]
    np.testing.assert_allclose(errors[0] / errors[1], 4.0, rtol=0.03)
    assert np.all(np.abs(errors[1]) < 2e-3)


@pytest.mark.slow
def test_derivatives_flow_through_the_profile():
    """With respect to the modulus on top and its growth, against differences of the continuous solid."""
    at = lambda G, growth: scaled(body(12, G=G, growth=growth), X)
    ours = jax.jacrev(at, argnums=(0, 1))(1e9, 2.5)
    moved = lambda x, dG, dg: continuous(x, 1e9 * (1.0 + dG), 2.5 + dg)
    to_G = [(moved(x, 1e-3, 0.0) - moved(x, -1e-3, 0.0)) / 2e6 for x in X]
    to_growth = [(moved(x, 0.0, 1e-3) - moved(x, 0.0, -1e-3)) / 2e-3 for x in X]
    np.testing.assert_allclose(ours, [to_G, to_growth], rtol=1e-2)


def test_fifty_sublayers_at_waves_far_shorter_than_the_film():
    """No overflow at alpha h = 1e4, where the response is that of the uppermost sublayer."""
    top = 1e9 * np.exp(2.5 * 0.5 / 50)
    assert float(scaled(body(50), 1e4)) == pytest.approx((1.0 - NU) / top, rel=1e-12)


def test_a_profile_of_one_material_is_that_layer():
    """And of the substrate's, no layer at all; also where it creeps."""
    film = jc.Burgers(G1=0.75e9, G2=13.89e6, eta1=3.1486e12, eta2=120.9e9, nu=0.3)
    alone = lambda layer: jc.LayeredHalfSpace([layer], STEEL)
    response = jax.jit(lambda body: jc.normal_response(body, X / H, 600.0))
    cut, whole = alone(jc.Graded(lambda depth: film, H, layers=3)), alone(jc.Layer(film, H))
    np.testing.assert_allclose(response(cut), response(whole), rtol=1e-10)
    same = jc.LayeredHalfSpace([jc.Graded(lambda depth: STEEL, H, layers=3)], STEEL)
    np.testing.assert_allclose(response(same), 0.7 / float(STEEL.G) * H / X, rtol=1e-12)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:only", "ignore:film strain")
def test_a_graded_film_that_creeps_is_pressed_as_its_sublayers(tmp_path):
    """A fluid on a solid: the profile is asked at the middle of each sublayer, and sees a depth as a number."""
    fluid, solid = jc.Maxwell(1e9, 1e12), jc.Elastic(2e9, 0.3)
    film = jc.Graded(lambda depth: fluid if depth < 0.5 * H else solid, H, layers=2)
    bodies = (
        jc.LayeredHalfSpace([film], STEEL),
        jc.LayeredHalfSpace([jc.Layer(fluid, 0.5 * H), jc.Layer(solid, 0.5 * H)], STEEL),
    )
    run = lambda body: jc.indent(
        body, jc.Sphere(10e-3), jc.Load(0.5), [0.0, 500.0], grid=jc.Grid.square(16, 200e-6), save="last"
    )
    graded, layered = map(run, bodies)
    assert float(graded.approach[1]) > 1.02 * float(graded.approach[0])
    np.testing.assert_array_equal(graded.approach, layered.approach)
    with np.load(jc.write_result(graded, tmp_path / "graded.npz", body=bodies[0])) as file:
        assert str(file["body.layers.0.profile"]).endswith("<lambda>")
