"""Stacks of layers against all their interface conditions, the closed form of one layer, and Laplace inversion."""

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest
from bodies import FILM, STEEL
from laplace import inverted
from tolerances import ROUND_OFF

import jaxcontact as jc
from jaxcontact.operators import kernels as gridded
from jaxcontact.reference.layered_solid import surface_response
from jaxcontact.response.in_time import Stack, separate, summed_products
from jaxcontact.response.normal import response_of
from jaxcontact.response.stack import mean_response, step_response, surface_compliance


def closed_form(body, wavenumber, start, end):
    """One layer in closed form."""
    return response_of(body).mean_response(wavenumber, start, end)


def solid(J0, fluidity=0.0, J=(), tau=(), nu=0.3):
    """A material of four retardation times, some without strength: all stacks below share one program."""
    J, tau = np.append(J, np.zeros(4 - len(J))), np.append(tau, np.geomspace(0.1, 1.0, 4)[len(tau) :])
    return jc.Prony(J0=J0, J=J, tau=tau, nu=nu, fluidity=fluidity)


RUBBER = solid(1e-9, J=(2e-8, 1e-7, 4e-7, 4e-7), tau=(1e-5, 1e-3, 0.1, 10.0), nu=0.49)
STACKS = {
    "stiff coating on rubber": (solid(1 / 80e9, nu=0.2), 1e-6, RUBBER),
    "rubber on glass": (RUBBER, 1e-3, solid(1 / 30e9, nu=0.22)),
    "Burgers on Maxwell": (solid(1e-9, 2e-11, (3e-9,), (0.3,)), 1e-6, solid(5e-10, 1e-9, nu=0.35)),
}

compliance = jax.jit(surface_compliance)
responses = jax.jit(step_response)
separated = jax.jit(lambda body, wavenumber: separate(body, wavenumber, 32, 12))


def entries(stack, m, n):
    """The 3 x 3 surface response from L, K, N, T [1/Pa] (theory: in-plane, coupling, normal, transverse)."""
    alpha = np.hypot(m, n)
    c, s = m / alpha, n / alpha
    L, K, N, T = (np.asarray(entry) for entry in stack)
    rows = [
        [L * c**2 + T * s**2, (L - T) * c * s, 1j * K * c],
        [(L - T) * c * s, L * s**2 + T * c**2, 1j * K * s],
        [-1j * K * c, -1j * K * s, N],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1)) / alpha[..., None, None]


def test_nine_responses_of_200_random_stacks_meet_all_interface_conditions():
    """Up to four layers, elastic or with loss, moduli over three decades, alpha h from 1e-3 to 20."""
    rng = np.random.default_rng(0)
    moduli = 10.0 ** rng.uniform(6, 9, (200, 5)) * np.exp(
        1j * rng.uniform(0, 1.4, (200, 1)) * (np.arange(200) % 2)[:, None]
    )
    nu = rng.uniform(0.0, 0.5, (200, 5))
    nu[::9, 0], nu[::11, 4] = 0.5, 0.5
    alpha, angle = 10.0 ** rng.uniform(3, 8, 200), rng.uniform(0, 2 * np.pi, 200)
    thickness = 10.0 ** rng.uniform(-3, 1.3, (200, 4)) / alpha[:, None]
    thickness[::3, rng.integers(0, 4)] = 0.0  # no layer at all
    m, n = alpha * np.cos(angle), alpha * np.sin(angle)
    exact = surface_response(moduli, nu, thickness, m, n)
    ours = entries(compliance(1.0 / moduli.T, nu.T, thickness.T, alpha), m, n)
    size = np.sqrt(np.abs(np.einsum("...ii->...i", exact)))
    assert np.max(np.abs(ours - exact) / (size[:, :, None] * size[:, None, :])) < 1e-13


def test_one_layer_is_the_closed_form():
    """Stiffness ratios from 1e-8 to 1e8, alpha h from 1e-8 to 1e4, incompressible solids too."""
    x = jnp.geomspace(1e-8, 1e4, 80)

    def both(ratio, nu_c, nu_s):
        body = jc.LayeredHalfSpace((jc.Layer(jc.Elastic(ratio, nu_c), 1.0),), jc.Elastic(1.0, nu_s))
        stack = surface_compliance(jnp.stack([1.0 / ratio, 1.0]), jnp.stack([nu_c, nu_s]), jnp.ones(1), x)
        return stack.normal, closed_form(body, x, 0.0, 0.0)

    cases = np.meshgrid(10.0 ** np.arange(-8.0, 9.0), [0.0, 0.3, 0.4999, 0.5], [0.0, 0.3, 0.5])
    ours, exact = jax.jit(jax.vmap(both))(*(jnp.asarray(case.ravel()) for case in cases))
    np.testing.assert_allclose(ours, exact, rtol=ROUND_OFF)


def test_layers_that_change_nothing():
    """Layers of the substrate's material; quarters of one layer; any stack at alpha = 0; a thick top layer."""
    x = np.append(0.0, np.geomspace(1e-6, 1e4, 199))
    half_space = lambda j, nu: j * np.array([1 - nu, 0.5 - nu, 1 - nu, 1])
    stack = lambda j, nu, h: np.array(compliance(*(np.tile(a, (200, 1)).T + 0j for a in (j, nu, h)), x))
    same = stack([3.0] * 5, [0.3] * 5, [0.25, 1.0, 0.1, 0.0])
    np.testing.assert_allclose(same, half_space(3.0, 0.3)[:, None] * np.ones(200), rtol=1e-14)
    quarters = stack([3.0] * 4 + [0.2], [0.4] * 4 + [0.3], [0.25] * 4)
    whole = stack([3.0, 7.0, 8.0, 9.0, 0.2], [0.4] * 4 + [0.3], [1.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(quarters, whole, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(whole[:, 0], half_space(0.2, 0.3), rtol=1e-15)
    np.testing.assert_allclose(whole[:, -1], half_space(3.0, 0.4), rtol=1e-15)


@pytest.mark.long
def test_fifty_graded_layers():
    """48 sublayers of a film that stiffens tenfold with depth: exact, bounded to alpha h = 1e4, second order."""
    x = np.array([1e-3, 0.1, 2.0, 1e4])
    depth = (np.arange(48) + 0.5) / 48
    profile = lambda z: 0.01 * 10.0**z

    def graded(layers):
        middle = (np.floor(depth * layers) + 0.5) / layers
        G = np.append(profile(middle), 1.0)
        return G, np.asarray(
            compliance(1.0 / G[:, None], np.full((49, 1), 0.3), np.full((48, 1), 1 / 48), x).normal
        )

    G, finest = graded(48)
    exact = surface_response(np.tile(G, (4, 1)), np.full((4, 49), 0.3), np.full((4, 48), 1 / 48), x, 0.0 * x)
    np.testing.assert_allclose(finest / x, exact[:, 2, 2].real, rtol=1e-12)
    assert np.all(finest <= 0.7 / G[0]) and np.all(finest >= 0.7)
    coarse, middle = (graded(layers)[1][2] for layers in (12, 24))
    assert (coarse - middle) / (middle - finest[2]) == pytest.approx(4.0, rel=0.05)


@jax.jit
def gradient(G, nu, h, alpha):
    """Of alpha (L + 2 K + 3 N + 4 T) with respect to all moduli, Poisson's ratios, thicknesses, and alpha."""

    def total(G, nu, h, alpha):
        L, K, N, T = surface_compliance(1.0 / G, nu, h, alpha)
        return L + 2.0 * K + 3.0 * N + 4.0 * T

    return jax.grad(total, argnums=(0, 1, 2, 3))(G, nu, h, alpha)


@pytest.mark.parametrize("x", [1e-4, 0.5, 8.0])
def test_gradients_to_every_modulus_ratio_and_thickness(x):
    """Reverse mode against central differences of the interface conditions."""
    G, nu, h = np.array([2.0, 0.03, 0.5, 1.0]), np.array([0.2, 0.45, 0.5, 0.3]), np.array([0.3, 1.0, 0.7])
    ours = np.concatenate(gradient(G, nu, h, x)[:3])
    point, steps = np.concatenate([G, nu, h]), 1e-4 * np.eye(11) * np.concatenate([G, np.ones(4), h])
    both = np.stack([point + steps, point - steps])
    m, n = x * np.ones((2, 11)), np.zeros((2, 11))
    moved = x * surface_response(both[..., :4], both[..., 4:8], both[..., 8:], m, n)
    parts = [moved[..., 0, 0], 2.0 * moved[..., 2, 0] * 1j, 3.0 * moved[..., 2, 2], 4.0 * moved[..., 1, 1]]
    total = np.sum(parts, 0).real
    difference = (total[0] - total[1]) / (2.0 * np.diag(steps))
    np.testing.assert_allclose(ours, difference, rtol=1e-6, atol=1e-8 * np.max(np.abs(difference)))


@pytest.mark.parametrize("modulus", [1e-8, 1.0, 1e8, np.inf])
def test_gradients_are_finite_at_no_wavenumber_and_no_thickness(modulus):
    G, nu = np.array([2.0, modulus, 0.5, 1.0]), np.array([0.2, 0.3, 0.5, 0.3])
    for h in (0.0, 1.0):
        for alpha in (0.0, 1e-8, 1e4):
            derivatives = gradient(G, nu, np.array([1.0, h, 0.5]), alpha)
            assert all(np.all(np.isfinite(d)) for d in derivatives)


@pytest.mark.slow
def test_step_and_its_means_of_one_layer_in_closed_form():
    """A film as stiff as its substrate, at once and over twelve decades of time."""
    film = solid(1 / FILM.G1, 1 / FILM.eta1, (1 / FILM.G2,), (FILM.eta2 / FILM.G2,))
    body = jc.LayeredHalfSpace((jc.Layer(film, 1.0),), solid(1 / 0.75e9))
    known = jc.LayeredHalfSpace((jc.Layer(FILM, 1.0),), jc.Elastic(0.75e9, 0.3))
    x, end = np.array([0.0, 0.7]), np.append(0.0, np.geomspace(1e-3, 1e9, 6))[:, None]
    start = end * np.array([0.0, 1e-6, 0.5, 0.8, 1.0 - 1e-9, 1.0])[:, None, None]
    exact = jax.jit(closed_form)(known, x, start, end)
    np.testing.assert_allclose(jax.jit(mean_response)(body, x, start, end), exact, rtol=2e-12)
    np.testing.assert_allclose(responses(body, x, end), exact[-1], rtol=1e-13)


def transform(film, thickness, substrate, wavenumber):
    """alpha N(s)/s from the interface conditions and the materials' parameters, for mpmath's s."""
    nu = np.array([film.nu, substrate.nu])

    def modulus(solid, s):
        return 1.0 / (solid.J0 + solid.fluidity / s + np.sum(solid.J / (1.0 + solid.tau * s)))

    def at(s):
        moduli = np.array([modulus(film, complex(s)), modulus(substrate, complex(s))])
        response = surface_response(moduli, nu, np.array([thickness]), np.array(wavenumber), np.array(0.0))
        return mp.mpc(wavenumber * response[2, 2]) / s

    return at


@pytest.mark.parametrize("name", STACKS)
def test_step_response_against_numerical_laplace_inversion(name):
    """Six decades of time by de Hoog's method on the interface conditions: no formula is shared."""
    film, thickness, substrate = STACKS[name]
    body = jc.LayeredHalfSpace((jc.Layer(film, thickness),), substrate)
    wavenumber, t = np.array([0.02, 1.5]) / thickness, np.geomspace(1e-5, 10.0, 7)
    invert = lambda f, t: float(mp.invertlaplace(f, t, method="dehoog", degree=10))
    exact = [[invert(transform(film, thickness, substrate, a), ti) for a in wavenumber] for ti in t]
    np.testing.assert_allclose(responses(body, wavenumber, t[:, None]), exact, rtol=1e-9)


def sum_of_products(response, t):
    """C_0 + sum_m S_m sum_k mix[m, k] (1 - exp(-lambda_k t))/lambda_k at times (n, 1)."""
    rates = np.asarray(response.rates)
    growth = np.where(rates > 0.0, -np.expm1(-rates * t) / np.where(rates > 0.0, rates, 1.0), t)
    return np.asarray(response.terms[0] + growth @ response.mix.T @ response.terms[1:])


X = np.concatenate([[0.0], np.geomspace(1e-5, 40.0, 240), [1e5]])  # alpha h


@pytest.mark.slow
def test_three_equal_layers_in_time_are_one():
    """The paper's film as three layers of 50 nm; on a rigid base the first of them creeps as it does alone."""
    three = jc.LayeredHalfSpace((jc.Layer(FILM, 50e-9),) * 3, STEEL)
    one = jc.LayeredHalfSpace((jc.Layer(FILM, 150e-9),), STEEL)
    response = separated(three, X / 150e-9)
    t = np.append(0.0, np.geomspace(1.0, 1e7, 40))[:, None]
    error = np.max(np.abs(sum_of_products(response, t) / jax.jit(closed_form)(one, X / 150e-9, t, t) - 1.0))
    assert error < 1e-8 and error < 3.0 * float(response.error)
    np.testing.assert_allclose(response.mix[0, :1], 1.0 / FILM.eta2)
    np.testing.assert_allclose(response.mix[0, -1], 1.0 / FILM.eta1)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "bound"), list(zip(STACKS, [2e-3, 5e-7, 1e-4], strict=True)))
def test_sums_of_products_are_as_good_as_they_say(name, bound):
    """Six decades; at alpha = 0 the substrate's own creep; at other times and wavenumbers."""
    film, thickness, substrate = STACKS[name]
    body = jc.LayeredHalfSpace((jc.Layer(film, thickness),), substrate)
    t = np.append(0.0, np.geomspace(1e-5, 10.0, 50))[:, None]
    response = separated(body, X / thickness)
    found = sum_of_products(response, t)
    error = np.max(np.abs(found / responses(body, X / thickness, t) - 1.0))
    assert error < bound and error < 3.0 * float(response.error)
    np.testing.assert_allclose(found[:, 0], (1 - substrate.nu) * substrate.creep(t[:, 0]), rtol=bound)


def product(body, wavenumber, t):
    """``sum_of_products`` in jax."""
    return sum_of_products_in_jax(separate(body, wavenumber, 32, 12), t)


def sum_of_products_in_jax(response, t):
    z = response.rates * t
    growth = jnp.where(z == 0.0, t, -jnp.expm1(-z) / jnp.where(z == 0.0, 1.0, response.rates))
    return response.terms[0] + growth @ response.mix.T @ response.terms[1:]


@pytest.mark.long
def test_derivatives_of_the_sum_of_products():
    """With respect to every parameter of each of three equal layers, which only together make a response."""
    three = jc.LayeredHalfSpace((jc.Layer(FILM, 50e-9),) * 3, STEEL)
    t, x = np.geomspace(10.0, 1e6, 9)[:, None], X[::24] / 150e-9
    scaled = lambda f: lambda logs: jnp.log(f(jax.tree.map(lambda a, b: a * jnp.exp(b), three, logs), x, t))
    zero = jax.tree.map(lambda a: 0.0, three)
    ours, exact = (jax.jit(jax.jacfwd(scaled(f)))(zero) for f in (product, step_response))
    for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(exact), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)


def test_derivatives_by_the_rate_of_the_top_layer_are_free_of_magnified_rounding():
    """By what sets the rate, the second modulus, relative to the response (measured: 1e-9; before, up to 2e-7)."""
    base = jc.StandardLinearSolid(2e9, 1e9, 40e9, nu=0.35)
    film = lambda q: jc.Layer(jc.StandardLinearSolid(1e9, 0.6e9 * jnp.exp(q), 12e9, nu=0.4), 6e-6)
    t, k = jnp.array([0.0, 8.0, 20.0])[:, None], slice(1, None, 8)
    body = lambda q: jc.LayeredHalfSpace((film(q),), base)

    def ours_and_exact(q):
        response = response_of(body(q))
        separated = response.separate(2)
        exact = step_response(body(q), response.wavenumbers()[k], t)
        return summed_products(separated, separated.terms[:, k], t), exact

    (_, size), (ours, exact) = jax.jit(lambda q: jax.jvp(ours_and_exact, (q,), (1.0,)))(0.0)
    np.testing.assert_allclose(ours / size, exact / size, atol=1e-8)


@pytest.mark.slow
def test_a_batch_of_films_is_each_film_alone():
    """Two films in two layers each, under vmap and one by one; and without layers the substrate."""
    t, x = np.geomspace(10.0, 1e6, 5)[:, None], X[::24] / 150e-9
    film = lambda G1: jc.Burgers(G1, FILM.G2, FILM.eta1, FILM.eta2)
    body = lambda G1: jc.LayeredHalfSpace((jc.Layer(FILM, 50e-9), jc.Layer(film(G1), 100e-9)), STEEL)
    moduli = jnp.array([0.5e9, 2e9])
    batch = jax.jit(jax.vmap(lambda G1: product(body(G1), x, t)))(moduli)
    for values, G1 in zip(batch, moduli, strict=True):
        np.testing.assert_allclose(values, responses(body(G1), x, t), rtol=1e-7)
    alone = responses(jc.LayeredHalfSpace((), FILM), x, t)
    np.testing.assert_allclose(alone, 0.7 * FILM.creep(t) * np.ones_like(x), rtol=1e-13)


@pytest.mark.slow
def test_the_recursion_answers_all_that_the_closed_form_answers(body):
    """At instants to 1e-12, and with the paper's substitution."""
    closed, stack = response_of(body), Stack(tuple(body.layers), body.substrate)
    x, t = closed.wavenumbers()[::20], jnp.array([0.0, 30.0, 7200.0])[:, None]
    np.testing.assert_allclose(stack.mean_response(x, t, t), closed.mean_response(x, t, t), rtol=ROUND_OFF)
    pairs = [stack.quasi_elastic(x, t, 2.0 * t), closed.quasi_elastic(x, t, 2.0 * t)]
    np.testing.assert_allclose(*pairs, rtol=ROUND_OFF)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:film strain")
def test_a_run_on_the_recursion_is_the_run_on_the_closed_form(body, ball, monkeypatch):
    """Kernels, march and results take whatever response they are given: equal to the separation error."""
    grid, times = jc.Grid.square(24, 600e-6), jnp.array([0.0, 300.0, 900.0])
    run = lambda **more: jc.indent(body, ball, jc.Load(60.0), times, grid=grid, tolerance=1e-10, **more)
    closed = run()
    monkeypatch.setattr(gridded, "response_of", lambda body: Stack(body.layers, body.substrate))
    recursed = run(kernels=jax.jit(gridded.build)(body, ball, grid))
    np.testing.assert_allclose(recursed.approach, closed.approach, rtol=1e-6)
    np.testing.assert_allclose(recursed.film_strain, closed.film_strain, rtol=1e-6)


def exactly(body, alpha, t):
    """alpha N(alpha, t) by the conditions at all interfaces at complex frequencies and de Hoog's inversion."""
    solids = [*(layer.material for layer in body.layers), body.substrate]
    thicknesses = np.broadcast_to([layer.thickness for layer in body.layers], (alpha.size, len(body.layers)))

    def transform(s):
        moduli = [complex(1.0 / (s * solid.laplace_compliance(s))) for solid in solids]
        poissons = [complex(solid.nu_at(1.0 / G)) for solid, G in zip(solids, moduli, strict=True)]
        each = np.broadcast_to(moduli, (alpha.size, len(solids)))
        found = surface_response(each, np.broadcast_to(poissons, each.shape), thicknesses, alpha, 0.0 * alpha)
        return found[:, 2, 2] * alpha / s

    return inverted(transform, t)


def random_body(rng):
    """One to three layers of one to six terms, with and without flow, some with a bulk modulus, on any substrate."""

    def material(creeps):
        volume = (
            {"bulk_modulus": 10 ** rng.uniform(9, 10)}
            if rng.random() < 0.3
            else {"nu": rng.uniform(0.1, 0.499)}
        )
        stiffness = 10 ** rng.uniform(7.5, 10.5)
        if not creeps:
            return jc.Elastic(stiffness, **volume)
        terms = rng.integers(1, 7)
        fluidity = rng.choice([0.0, 0.0, 10 ** rng.uniform(-3, 0), 1e-200]) / stiffness
        J, tau = 10 ** rng.uniform(-1, 1, terms) / stiffness, np.sort(10 ** rng.uniform(-1, 2, terms))
        return jc.Prony(1.0 / stiffness, J, tau, fluidity=fluidity, **volume)

    count = rng.choice([1, 1, 1, 2, 3])
    layers = [jc.Layer(material(True), 10 ** rng.uniform(-6, -4)) for _ in range(count)]
    return jc.LayeredHalfSpace(tuple(layers), material(rng.random() < 0.3))


@pytest.mark.long
@pytest.mark.parametrize("count", [40])
def test_random_bodies_against_interface_conditions_and_de_hoogs_inversion(count):
    rng = np.random.default_rng(22)
    for _ in range(count):
        body = random_body(rng)
        alpha, t = np.array([0.01, 0.3, 3.0]) / float(body.layers[0].thickness), 10 ** rng.uniform(-1, 3)
        found = response_of(body).mean_response(alpha, t, t)
        np.testing.assert_allclose(found, exactly(body, alpha, t), rtol=1e-6)


STEEPER = 20.0  # error of derivatives over that of values
SOLID = jc.StandardLinearSolid(1e9, 0.6e9, 12e9, nu=0.4)
FLOWING = jc.Burgers(G1=1e9, G2=0.8e9, eta1=60e9, eta2=8e9, nu=0.38)
ON_MELT = {  # with the longest relaxation time [s], and the error after 500 of them (measured: half of it)
    "on a melt": (
        jc.LayeredHalfSpace((jc.Layer(jc.Elastic(1e9), 1e-4),), jc.Maxwell(1e9, 1e11)),
        100.0,
        2e-5,
    ),
    "over a fluid layer": (
        jc.LayeredHalfSpace((jc.Layer(jc.Elastic(1e9), 1e-4), jc.Layer(jc.Maxwell(1e9, 1e10), 1e-4)), STEEL),
        10.0,
        1e-3,
    ),
    "standard solid over a Burgers layer": (
        jc.LayeredHalfSpace((jc.Layer(SOLID, 5e-5), jc.Layer(FLOWING, 9e-5)), STEEL),
        60.0,
        1e-3,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name == "on a melt" else pytest.mark.long) for name in ON_MELT]
)
def test_layers_over_what_flows_against_interface_conditions_and_de_hoogs_inversion(name):
    """The sum of products and its images, up to a thousand relaxation times, at all wavenumbers from a thousandth of 1/h:
    values, and the derivative along one direction of all leaves against central differences of the oracle."""
    body, relaxation, late = ON_MELT[name]
    leaves, structure = jax.tree.flatten(body)
    along = 1.0 + 0.5 * np.cos(1.7 * np.arange(len(leaves)))
    alpha = np.geomspace(1e-3, 10.0, 9) / 1e-4
    times = relaxation * np.array([0.01, 1.0, 20.0, 500.0])

    def moved(step):
        return jax.tree.unflatten(
            structure, [a * (1.0 + step * c) for a, c in zip(leaves, along, strict=True)]
        )

    def imaged(step):
        expansion = gridded.expansion(moved(step), 2)
        return summed_products(expansion.separable, expansion.images.at(alpha), times[:, None]), expansion

    values, slopes, expansion = jax.jit(lambda step: jax.jvp(imaged, (step,), (1.0,), has_aux=True))(0.0)
    found, known = expansion.separable, np.asarray(response_of(body).wavenumbers())
    assert float(found.horizon) > times[-1] and float(found.error) < 4e-5
    near = np.abs(np.log(known[1:, None] / alpha)).argmin(0) + 1
    step = 1e-3
    for i, (t, bound) in enumerate(zip(times, [5e-6, 5e-6, 4e-5, late], strict=True)):
        exact = exactly(body, alpha, t)
        sums = sum_of_products(found, np.array([[t]]))[0, near]
        np.testing.assert_allclose(sums, exactly(body, known[near], t), rtol=1e-5)
        np.testing.assert_allclose(values[i], exact, rtol=bound)
        one, two = (exactly(moved(c), alpha, t) - exactly(moved(-c), alpha, t) for c in (step, 2.0 * step))
        central = (8.0 * one - two) / (12.0 * step)
        np.testing.assert_allclose(slopes[i] / exact, central / exact, atol=STEEPER * bound)


@pytest.mark.long
@pytest.mark.parametrize(
    "body",
    [
        pytest.param(
            jc.LayeredHalfSpace(
                (jc.Layer(FILM, 5e-6), jc.Layer(jc.StandardLinearSolid(1e9, 1e9, 3e11, 0.45), 1e-5)), STEEL
            ),
            marks=pytest.mark.long,
        ),
        jc.LayeredHalfSpace((jc.Layer(FILM, 5e-6),), jc.Maxwell(80e9, 1e13)),
    ],
    ids=["two layers creep", "layer and substrate creep"],
)
def test_derivatives_of_the_expansion_at_small_steps(body):
    """Both modes and central differences at steps of 1e-4 and 1e-5 in the logarithms of all parameters."""
    leaves, structure = jax.tree.flatten(body)
    alpha, t = np.geomspace(1e-4, 30.0, 160) / 5e-6, np.array([10.0, 300.0, 3000.0])[:, None]

    def mean(logs):
        moved = jax.tree.unflatten(structure, [a * jnp.exp(q) for a, q in zip(leaves, logs, strict=True)])
        response = separate(moved, alpha, 24, 8)
        return jnp.mean(jnp.log(sum_of_products_in_jax(response, t)))

    zero, value = jnp.zeros(len(leaves)), jax.jit(mean)
    reverse, forward = jax.jit(jax.grad(mean))(zero), jax.jit(jax.jacfwd(mean))(zero)
    np.testing.assert_allclose(reverse, forward, rtol=1e-8, atol=1e-12)
    for small in (1e-4, 1e-5):
        central = [float(value(small * e) - value(-small * e)) / (2.0 * small) for e in np.eye(len(leaves))]
        np.testing.assert_allclose(reverse, central, atol=3e-8)


CREEPING = {  # with the largest error of derivatives of the sum of products, and of its images (measured: half of it)
    "standard solids": (
        jc.LayeredHalfSpace(
            (jc.Layer(jc.StandardLinearSolid(1e9, 0.5e9, 10e9, 0.4), 6e-6),),
            jc.StandardLinearSolid(2e9, 1e9, 40e9, 0.35),
        ),
        3e-6,
        1e-5,
    ),
    "softer base": (
        jc.LayeredHalfSpace(
            (jc.Layer(jc.StandardLinearSolid(1e9, 1e8, 2e9, 0.45), 6e-6),),
            jc.StandardLinearSolid(2e8, 1e8, 4e10, 0.35),
        ),
        3e-6,
        2e-5,
    ),
    "elastic on a fluid": (
        jc.LayeredHalfSpace((jc.Layer(jc.Elastic(3e9, 0.3), 20e-6),), jc.Maxwell(2e9, 40e9, 0.4)),
        1e-5,
        1e-5,
    ),
    "standard solid on a Burgers layer": (
        jc.LayeredHalfSpace((jc.Layer(SOLID, 5e-6), jc.Layer(FLOWING, 9e-6)), STEEL),
        1e-5,
        2.5e-5,
        8e-4,  # between the modes: round-off of the reverse one
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("name", CREEPING)
def test_images_of_creeping_bodies_have_the_derivatives_of_the_response(name):
    """By every leaf of film and base, at first and later, from waves of a thousand thicknesses on: first of the sum of
    products, then of its images, against those of the exact response; in reverse mode as in forward mode."""
    body, of_sums, of_images, *of_modes = CREEPING[name]
    leaves, structure = jax.tree.flatten(body)
    k, times = jnp.geomspace(1e2, 3e6, 16), jnp.array([0.0, 3.0, 110.0])[:, None]
    zero = jnp.zeros(len(leaves))

    def moved(logs):
        return jax.tree.unflatten(structure, [a * jnp.exp(q) for a, q in zip(leaves, logs, strict=True)])

    def sums(logs):
        response = response_of(moved(logs)).separate(2)
        return summed_products(response, response.terms[:, ::40], times)

    def steps(logs):
        response = response_of(moved(logs))
        return response.mean_response(response.wavenumbers()[None, ::40], times, times)

    def imaged(logs):
        expansion = gridded.expansion(moved(logs), 2)
        return summed_products(expansion.separable, expansion.images.at(k), times)

    exact = lambda logs: jax.vmap(lambda t: k * jc.normal_response(moved(logs), k, t))(times[:, 0])
    for ours, theirs, bound in ((sums, steps, of_sums), (imaged, exact, of_images)):
        value, slopes = theirs(zero), [jax.jit(jax.jacfwd(f))(zero) for f in (ours, theirs)]
        np.testing.assert_allclose(slopes[0] / value[..., None], slopes[1] / value[..., None], atol=bound)
    at_last = lambda logs: jnp.sum(imaged(logs)[-1] / exact(zero)[-1])
    forward = jnp.sum(slopes[0][-1] / value[-1][:, None], 0)
    np.testing.assert_allclose(
        jax.jit(jax.grad(at_last))(zero), forward, atol=(*of_modes, k.size * of_sums)[0]
    )
