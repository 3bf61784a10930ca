"""Films up to a million times as stiff as what they lie on: a hard coating on rubber or on a gel.

Such a film bends under waves of h G^(1/3), G the ratio of the moduli, and is stretched under those of h G.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import j1
from tolerances import APPROACH, PEAK, SOLVER

import jaxcontact as jc
from jaxcontact.operators.kernels import build
from jaxcontact.reference import abel
from jaxcontact.response.coefficients import influence_coefficients
from jaxcontact.response.normal import response_of

BASE, RADIUS, A = 1e6, 10e-3, 100e-6  # modulus of the substrate [Pa], the ball's and the contact's radii [m]


def coated(film, thickness):
    return jc.LayeredHalfSpace((jc.Layer(film, thickness),), jc.Elastic(BASE, 0.45))


def solid(modulus):
    """A film whose modulus falls to a quarter, with a time of 1 s."""
    rest = modulus / 3.0
    return jc.StandardLinearSolid(G1=modulus, G2=rest, eta2=rest, nu=0.3)


def exact(modulus, thickness, contact=A):
    """The axisymmetric contact on an elastic film."""
    return abel.solve_radius(contact, abel.Layered(modulus, 0.3, thickness, BASE, 0.45), RADIUS)


def corner(x, y, body, alpha, weights):
    """Displacement at a corner of a rectangle under unit pressure, by rays from it:

    2 pi u = sum over its two wedges of int rho [A + int (alpha N - A) J1(alpha rho)/alpha d alpha] d theta.
    """
    A = abel.surface_compliance(body)
    excess = weights * (abel.scaled_response(alpha, body) - A) / alpha
    nodes, shares = np.polynomial.legendre.leggauss(20)
    total = 0.0
    for near, far in ((x, y), (y, x)):
        angle = np.arctan2(far, near)
        theta = 0.5 * angle * (1.0 + nodes)
        rho = near / np.cos(theta)
        total += 0.5 * angle * shares @ (A * rho + rho * (j1(np.outer(rho, alpha)) @ excess))
    return total / (2.0 * np.pi)


@pytest.mark.slow
@pytest.mark.parametrize(("ratio", "cells"), [(0.01, 0.2), (1e4, 0.2), (1e4, 5.0), (1e6, 5.0)])
def test_coefficients_by_numerical_hankel_integrals(ratio, cells):
    """Of the cell itself, its neighbour and a distant one, for films of a fifth of a cell and of five."""
    dx = A / 20.0
    h, grid = cells * dx, jc.Grid.square(32, 32 * dx)
    response = response_of(coated(jc.Elastic(ratio * BASE, 0.3), h))
    images = response.expand(response.mean_response(response.wavenumbers(), 0.0, 0.0))
    ours = np.asarray(influence_coefficients(grid, images))
    oracle = abel.Layered(ratio * BASE, 0.3, h, BASE, 0.45)
    alpha, weights = abel._waves(abel.CUTOFF / h, min(0.5 / h, 1.0 / (10.0 * dx)))
    at = lambda x, y: np.sign(x * y) * corner(abs(x), abs(y), oracle, alpha, weights)
    for i, j in [(0, 0), (1, 0), (20, 7)]:
        x, y = np.array([i - 0.5, i + 0.5]) * dx, np.array([j - 0.5, j + 0.5]) * dx
        expected = at(x[1], y[1]) - at(x[0], y[1]) - at(x[1], y[0]) + at(x[0], y[0])
        assert abs(ours[i, j] - expected) < 2e-9 * ours[0, 0], (i, j)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ratio", "thickness"),
    [pytest.param(1e4, 1e-3, marks=pytest.mark.long), (1e4, 10.0), (1e5, 1.0), (1e6, 1e-3), (1e6, 10.0)],
)
def test_creeping_film_against_the_axisymmetric_solution(ratio, thickness):
    """At first and, under a load or at an approach, after a long time: elastic films of the two moduli."""
    h = thickness * A
    first, late = exact(ratio * BASE, h), exact(ratio * BASE / 4.0, h)
    body, grid, ball = coated(solid(ratio * BASE), h), jc.Grid.square(96, 3.0 * A), jc.Sphere(RADIUS)
    ready = jc.kernels(body, ball, grid, nodes=8)
    times = jnp.array([0.0, 1e9])
    loaded = jc.indent(body, ball, jc.Load([first.load, late.load]), times, grid=grid, kernels=ready)
    held = jc.indent(
        body, ball, jc.Approach([first.approach, late.approach]), times, grid=grid, kernels=ready
    )
    np.testing.assert_allclose(loaded.approach, [first.approach, late.approach], rtol=APPROACH)
    np.testing.assert_allclose(held.load, [first.load, late.load], rtol=2 * APPROACH)
    for run in (loaded, held):
        assert np.all(run.converged)
        peaks = [float(abel.pressure(0.0, contact)[0]) for contact in (first, late)]
        np.testing.assert_allclose(run.pressure.max((1, 2)), peaks, rtol=2 * PEAK)


@pytest.mark.slow
def test_images_measure_their_error_at_all_times():
    """Between the wavenumbers where they are fitted; a thousandfold creep, incompressible solids, vmap."""
    grid = jc.Grid.square(8, A)

    def errors(ratio, nu):
        film = jc.StandardLinearSolid(G1=ratio, G2=ratio / 999.0, eta2=1.0, nu=nu)
        body = jc.LayeredHalfSpace((jc.Layer(film, 1e-6),), jc.Elastic(1.0, 0.5))
        return build(body, jc.Sphere(RADIUS), grid, 8).image_error

    each, batch = jax.jit(errors), jax.jit(jax.vmap(errors))
    ratios = jnp.array([1e-2, 1.0, 1e2, 1e4, 1e6])
    for nu in (0.0, 0.5):
        found = batch(ratios, jnp.full(5, nu))
        assert np.all(found < np.array([1e-6, 1e-6, 1e-6, 1e-6, 2e-5])), found
        np.testing.assert_allclose(found[3:], [each(r, nu) for r in ratios[3:]], rtol=0.1)


@pytest.mark.long
def test_derivatives_of_the_approach_by_modulus_and_thickness():
    """A ratio of 1e5, as thick as the contact is wide: against differences of the axisymmetric solution."""
    modulus, load = 1e5 * BASE, exact(1e5 * BASE, A).load
    grid = jc.Grid.square(96, 3.0 * A)

    def approach(logs):
        body = coated(jc.Elastic(modulus * jnp.exp(logs[0]), 0.3), A * jnp.exp(logs[1]))
        return jnp.log(jc.indent(body, jc.Sphere(RADIUS), jc.Load(load), [0.0], grid=grid).approach[0])

    ours = jax.jit(jax.grad(approach))(jnp.zeros(2))
    layered = lambda G, h: abel.Layered(modulus * np.exp(G), 0.3, A * np.exp(h), BASE, 0.45)
    other = lambda G, h: np.log(abel.solve_load(load, layered(G, h), RADIUS, modes=30).approach)
    by_modulus = (other(1e-3, 0.0) - other(-1e-3, 0.0)) / 2e-3
    by_thickness = (other(0.0, 1e-3) - other(0.0, -1e-3)) / 2e-3
    np.testing.assert_allclose(ours, [by_modulus, by_thickness], rtol=1e-4)


@pytest.mark.slow
def test_a_response_that_is_off_on_the_grid_is_said_to_be():
    body, ball, grid = coated(jc.Elastic(BASE, 0.3), A), jc.Sphere(RADIUS), jc.Grid.square(32, 3.0 * A)
    worse = jc.kernels(body, ball, grid)
    worse = type(worse)(**vars(worse) | {"image_errors": jnp.array([[0.0, 2e-4]])})
    with pytest.warns(UserWarning, match="error of up to 0.0002"):
        jc.indent(body, ball, jc.Approach(1e-6), [0.0], grid=grid, kernels=worse)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:1 of 1 steps", "ignore:only")
def test_what_counts_as_contact_at_an_approach_touches():
    """On a few cells of a stiff film: no cell is left with a pressure of round-off beside an open gap."""
    film = jc.Layer(jc.Elastic(6.48e9, 0.3), 0.228e-6)
    body, grid = jc.LayeredHalfSpace([film], jc.Elastic(BASE, 0.3)), jc.Grid.square(48, 48e-6)
    for approach in np.geomspace(0.02e-6, 5e-6, 20):
        found = jc.indent(body, jc.Sphere(50e-6), jc.Approach(approach), [0.0], grid=grid)
        gap = np.asarray(found.gap)[np.asarray(found.pressure) > 0.0]
        np.testing.assert_allclose(gap / approach, 0.0, atol=SOLVER)
