"""An elastic bulk modulus in place of Poisson's ratio: a material creeps in shear and keeps its volume."""

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest
from bodies import STEEL
from tolerances import APPROACH

import jaxcontact as jc
from jaxcontact.reference import abel
from jaxcontact.reference.layered_solid import surface_response
from jaxcontact.response.in_time import separate
from jaxcontact.response.stack import surface_creep
from jaxcontact.response.tangential import separate_tangential

K, H = 1.625e9, 150e-9
PARAMETERS = {"G1": 0.75e9, "G2": 13.89e6, "eta1": 3.1486e12, "eta2": 120.9e9}
FILM = jc.Burgers(**PARAMETERS, bulk_modulus=K)
ON_STEEL = jc.LayeredHalfSpace([jc.Layer(FILM, H)], STEEL)
TIMES = np.array([1.0, 60.0, 600.0, 7200.0, 1e6])

response = jax.jit(jc.normal_response)


def modulus(s, eta1=3.1486e12):
    """G(s) of the paper's film for mpmath's s [Pa]."""
    G1, G2, eta2 = PARAMETERS["G1"], PARAMETERS["G2"], PARAMETERS["eta2"]
    return 1 / (1 / mp.mpf(G1) + 1 / (G2 + eta2 * s) + 1 / (eta1 * s))


def inverted(transform, t):
    return float(mp.invertlaplace(transform, t, method="dehoog", degree=10))


def surface(t, K=K):
    """(1 - nu(s))/G(s)/s in time: the compliance of the half-space [1/Pa], nu = (3 K - 2 G)/(6 K + 2 G)."""

    def transform(s):
        G = modulus(s)
        return (1 - (3 * K - 2 * G) / (6 * K + 2 * G)) / G / s

    return inverted(transform, t)


def test_half_space_against_laplace_inversion():
    half_space = jc.LayeredHalfSpace([], FILM)
    np.testing.assert_allclose(response(half_space, 1.0, TIMES), [surface(t) for t in TIMES], rtol=1e-9)


def test_every_material_takes_one():
    """After a long time a fluid is incompressible and a solid has the ratio of its moduli: (1 - nu) J."""
    solids = [
        jc.Maxwell(G=1e9, eta=1e10, bulk_modulus=K),
        jc.KelvinVoigt(G=1e9, eta=1e10, bulk_modulus=K),
        jc.StandardLinearSolid(G1=1e9, G2=1e9, eta2=1e10, bulk_modulus=K),
        jc.Prony(J0=1e-9, J=np.array([1e-9]), tau=np.array([10.0]), bulk_modulus=K),
    ]
    for solid in solids:
        J = float(solid.creep(1e6))
        nu = 0.5 if isinstance(solid, jc.Maxwell) else (3 * K * J - 2) / (6 * K * J + 2)
        found = jax.jit(lambda solid: surface_creep(solid).creep(1e6))(solid)
        assert float(found) == pytest.approx((1 - nu) * J, rel=1e-4)
    assert solids[0].scaled(2.0).bulk_modulus == 2.0 * K


def film_transform(x):
    """alpha N(s)/s of the film on steel, from all interface conditions."""

    def at(s):
        G = complex(modulus(s))
        nu = np.array([(3 * K - 2 * G) / (6 * K + 2 * G), 0.3])
        stack = surface_response(np.array([G, STEEL.G]), nu, np.array([H]), np.array(x / H), np.array(0.0))
        return mp.mpc(x / H * stack[2, 2]) / s

    return at


X = np.array([1e-3, 0.05, 0.8, 5.0])  # alpha h


@pytest.mark.slow
def test_film_against_laplace_inversion():
    exact = [[inverted(film_transform(x), t) for x in X] for t in TIMES]
    np.testing.assert_allclose(response(ON_STEEL, X / H, TIMES[:, None]) * X / H, exact, rtol=1e-9)


@pytest.mark.slow
def test_the_sum_of_products_of_a_film_is_as_good_as_it_says():
    """What a march uses, against the response just inverted."""
    x = np.concatenate([[0.0], np.geomspace(1e-5, 40.0, 60), X, [1e5]])
    found = jax.jit(lambda x: separate(ON_STEEL, x, 32, 12))(x / H)
    rates, t = np.asarray(found.rates), TIMES[:, None]
    growth = np.where(rates > 0, -np.expm1(-rates * t) / np.where(rates > 0, rates, 1.0), t)
    sums = (found.terms[0] + growth @ found.mix.T @ found.terms[1:])[:, -5:-1]
    assert np.max(np.abs(sums / response(ON_STEEL, X / H, t) / X * H - 1.0)) < 2e-8
    assert float(found.error) < 2e-8


def test_a_fluid_film_on_a_rigid_base_is_squeezed_out():
    """alpha N = x/K + x^3 t/(3 eta) under long waves: it keeps its volume, and creeps only as it flows aside."""
    eta, x = 1e9, 0.05
    fluid = jc.Maxwell(G=1e6, eta=eta, bulk_modulus=100e9)
    body = jc.LayeredHalfSpace([jc.Layer(fluid, H)], jc.Elastic(1e18, 0.0))
    t = np.array([1e3, 2e3])
    found = np.asarray(response(body, x / H, t)) * x / H
    assert (found[1] - found[0]) / (t[1] - t[0]) == pytest.approx(x**3 / (3 * eta), rel=3 * x**2)


@pytest.mark.slow
def test_an_elastic_solid_with_a_bulk_modulus_is_that_with_its_poisson_ratio():
    """K = 2 G (1 + nu)/(3 (1 - 2 nu)), as layer, substrate and half-space, in all nine entries."""
    G, nu = 2e9, 0.37
    given = jc.Elastic(G, bulk_modulus=2 * G * (1 + nu) / (3 * (1 - 2 * nu)))
    known = jc.Elastic(G, nu)
    layers = lambda solid: jc.LayeredHalfSpace([jc.Layer(solid, H), jc.Layer(FILM, H)], solid)
    nine = [
        jax.jit(jc.frequency_response)(layers(solid), X / H, 0.3 * X / H, 10.0) for solid in (given, known)
    ]
    np.testing.assert_allclose(*nine, rtol=1e-12, atol=1e-12 * float(np.max(np.abs(nine[0]))))
    alone = lambda solid: jc.LayeredHalfSpace([jc.Layer(solid, H)], STEEL)
    np.testing.assert_allclose(*(response(alone(solid), X / H, 0.0) for solid in (given, known)), rtol=1e-12)


def test_tangential_creep_of_a_half_space():
    """In the plane (1 - nu) j, across j, coupled (1/2 - nu) j, by Laplace inversion: what ``shear`` remembers."""
    found = jax.jit(separate_tangential)(jc.LayeredHalfSpace((), FILM))
    rates, t = np.asarray(found.rates), TIMES[:, None]
    growth = np.where(rates > 0, -np.expm1(-rates * t) / np.where(rates > 0, rates, 1.0), t) @ found.mix.T
    along, across, coupled = (f[0, 0] + growth @ f[1:, 0] for f in np.asarray(found.terms))
    exact = np.array([surface(t) for t in TIMES])
    np.testing.assert_allclose(along, exact, rtol=1e-9)
    np.testing.assert_allclose(across, FILM.creep(TIMES), rtol=1e-12)
    np.testing.assert_allclose(coupled, exact - FILM.creep(TIMES) / 2, atol=1e-9 * exact[-1])


def pressed(K, nt=3):
    """A rigid ball on the film's material as a half-space, under a step load of 1 N."""
    body = jc.LayeredHalfSpace([], jc.Burgers(**PARAMETERS, bulk_modulus=K))
    times = jnp.linspace(0.0, 600.0, nt)
    grid = jc.Grid.square(32, 500e-6)
    return jc.indent(body, jc.Sphere(10e-3), jc.Load(1.0), times, grid=grid, tolerance=1e-10, substeps=8)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:only", "ignore:the time steps have an estimated error")
def test_a_ball_on_a_half_space_against_lee_and_radok():
    """a^3 = 3 R W A(t)/8 and approach a^2/R, with A(t) by Laplace inversion; and the derivative by K."""
    run = pressed(K)
    radius = (3 * 10e-3 * surface(600.0) / 8) ** (1 / 3)
    assert float(run.approach[-1]) == pytest.approx(radius**2 / 10e-3, rel=2e-3)
    slope = jax.grad(lambda log_K: jnp.log(pressed(jnp.exp(log_K)).approach[-1]))(np.log(K))
    step = 1e-3
    exact = (np.log(surface(600.0, K * (1 + step))) - np.log(surface(600.0, K * (1 - step)))) / (3 * step)
    assert float(slope) == pytest.approx(exact, rel=1e-3)


@pytest.mark.slow
def test_derivatives_of_a_film_by_all_its_parameters():
    """Of the sum of products that a march uses, against differences of the inverted transform."""
    x, t = jnp.array([0.8, 0.05]), 600.0

    def ours(film):
        found = separate(jc.LayeredHalfSpace([jc.Layer(film, H)], STEEL), jnp.append(x, 40.0) / H, 32, 12)
        safe = jnp.where(found.rates > 0, found.rates, 1.0)
        growth = jnp.where(found.rates > 0, -jnp.expm1(-safe * t) / safe, t)
        return (found.terms[0] + growth @ found.mix.T @ found.terms[1:])[0]

    slopes = jax.jit(jax.grad(ours))(FILM)
    for name in (*PARAMETERS, "bulk_modulus"):
        value = getattr(FILM, name)
        moved = [jc.Burgers(**{**PARAMETERS, "bulk_modulus": K, name: value * f}) for f in (1.001, 0.999)]
        up, down = (float(response(jc.LayeredHalfSpace([jc.Layer(m, H)], STEEL), 0.8 / H, t)) for m in moved)
        exact = (up - down) / (0.002 * value) * 0.8 / H
        assert float(getattr(slopes, name)) == pytest.approx(exact, rel=1e-4, abs=1e-7 * up * 0.8 / H / value)


class Bulky(abel.LayerStack):
    """Its solids keep their bulk moduli, whatever becomes of their shear moduli."""

    def with_modulus(self, moduli):
        bulk = np.array([K, 175e9])
        return self._replace(moduli=moduli, poissons=(3 * bulk - 2 * moduli) / (6 * bulk + 2 * moduli))


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:film strain")
def test_growing_contact_on_a_film_against_the_axisymmetric_march():
    """A film of a third of the contact's radius under a step load for 600 s; the march's own error is 1e-4."""
    steel = float(STEEL.G)

    def moduli(s):
        both = np.array([complex(s / FILM.spectrum().transform(s)), steel])
        return both if np.iscomplexobj(s) else both.real

    pile = Bulky(np.ones(2), np.zeros(2), np.array([30e-6])).with_modulus(moduli(1.0))
    contacts = abel.march_step_load(1.0, 600.0, 24, pile, moduli, 10e-3, modes=24)
    body = jc.LayeredHalfSpace([jc.Layer(FILM, 30e-6)], STEEL)
    times, grid = jnp.linspace(0.0, 600.0, 25), jc.Grid.square(96, 2.8 * contacts[-1].radius)
    run = jc.indent(body, jc.Sphere(10e-3), jc.Load(1.0), times, grid=grid)
    for i in (0, 6, 24):
        assert float(run.approach[i]) == pytest.approx(contacts[i].approach, rel=2 * APPROACH)
        assert float(run.contact_radius[i]) == pytest.approx(contacts[i].radius, rel=2e-2)
