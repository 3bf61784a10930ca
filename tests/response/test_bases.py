"""Rigid bases and loose layers: the transforms against 60 digits and closed forms, creep, uniform pressure, derivatives."""

import functools

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest
from laplace import inverted

import jaxcontact as jc
from jaxcontact.response.interior import transfer
from jaxcontact.response.stack import spectra

BASES = {"rigid": None, "elastic": (7.0, 0.2)}


def equations(nu):
    """d/dz of (U, W, S, P), u_r = i U, u_z = W, sigma_rz = i S, sigma_zz = P, for a wave of alpha = 1 and G = 1.

    From Hooke's law, S = U' + W and P = (lambda + 2) W' - lambda U, and equilibrium, P' = S and
    S' = (lambda + 2) U - lambda W'; Lame's lambda is eliminated, so that nu = 1/2 is included.
    """
    nu = mp.mpmathify(nu)
    q, r = (1 - 2 * nu) / (2 * (1 - nu)), nu / (1 - nu)
    return mp.matrix([[0, -1, 1, 0], [r, 0, 0, q], [4 * (1 - q), 0, 0, -r], [0, 0, 1, 0]])


def through(nu, x):
    """The states after a distance x: exp(x A), by Jordan's form of A, for which B = A^2 - 1 has B^2 = 0."""
    A, x = equations(nu), mp.mpmathify(x)
    B = A * A - mp.eye(4)
    s, c = mp.sinh(x), mp.cosh(x)
    return c * mp.eye(4) + s * A + x * s / 2 * B + (x * c - s) / 2 * A * B


@functools.cache
def states(layers, base, depth=None):
    """The response (U, W) per traction (tau, p) on the surface, of layers (G, nu, h, bonded) on (G, nu) or a rigid base.

    All conditions at once in 60-digit arithmetic: tractions on the surface, continuity at the interfaces, of a loose layer
    no shear on both sides and continuity of W and P. depth: (layer, z) of further states (U, W, S, P) to return.
    """
    with mp.workdps(60):
        solids = [*((G, nu) for G, nu, _, _ in layers), *([base] if base else [])]
        size = 4 * len(layers) + (2 if base else 0)
        matrix, right, row = mp.zeros(size, size), mp.zeros(size, 2), 2
        matrix[0, 2], matrix[1, 3] = solids[0][0], solids[0][0]
        right[0, 0], right[1, 1] = -1, -1
        for i, (G, nu, h, bonded) in enumerate(layers):
            above = through(nu, h)
            below = None
            if i + 1 < len(solids):
                below = mp.eye(4)
                # the half-space: the states that decay, which (A - 1)^2 leaves of any
                if i + 1 == len(layers):
                    rest = equations(solids[-1][1]) - mp.eye(4)
                    below = (rest * rest)[:, 0:2]
            held = [0, 1, 2, 3] if bonded else [1, 3]
            if below is None:
                held = [0, 1] if bonded else [1]
            conditions = [(k, True, below is not None) for k in held]
            if not bonded:
                conditions += [(2, True, False)] + ([(2, False, True)] if below is not None else [])
            for k, upper, lower in conditions:
                for c in range(4 if upper else 0):
                    matrix[row, 4 * i + c] = above[k, c] * (G if k > 1 else 1)
                for c in range(below.cols if lower else 0):
                    matrix[row, 4 * i + 4 + c] = -below[k, c] * (solids[i + 1][0] if k > 1 else 1)
                row += 1
        assert row == size
        found = [mp.lu_solve(matrix, right[:, i]) for i in range(2)]
        if depth is not None:
            i, z = depth
            G, nu = solids[i]
            there = [through(nu, z) * each[4 * i : 4 * i + 4, 0] for each in found]
            return [[float(s[0]), float(s[1]), float(G * s[2]), float(G * s[3])] for s in there]
        return [[float(each[0]), float(each[1])] for each in found]


def built(layers, base):
    """The body of the oracle's layers; its wavenumber is 1."""
    below = None if base is None else jc.Elastic(*base)
    return jc.LayeredHalfSpace([jc.Layer(jc.Elastic(G, nu), h, bonded) for G, nu, h, bonded in layers], below)


STACKS = [
    ((1.0, 0.3, 0.4, False), (3.0, 0.1, 0.7, True), (0.2, 0.4, 0.3, False)),
    ((3.0, 0.1, 0.7, True), (1.0, 0.5, 0.4, False), (0.2, 0.4, 0.3, True)),
]
ONE = [
    ((1.0, nu, x, bonded),)
    for nu in (0.0, 0.3, 0.4999, 0.5)
    for x in (1e-6, 1e-3, 0.3, 2.0, 12.0)
    for bonded in (True, False)
]


entries = jax.jit(lambda body: (jc.frequency_response(body, 1.0, 0.0), jc.normal_response(body, 1.0)))


@pytest.mark.slow
@pytest.mark.parametrize("base", BASES)
def test_all_entries_against_sixty_digits(base):
    """Bonded and loose, one layer at alpha h from 1e-6 to 12 and stacks, to 1e-12 (K relative to the root of L N)."""
    base = BASES[base]
    for layers in [*ONE, *STACKS]:
        (U_tau, W_tau), (U_p, W_p) = states(layers, base)
        body = built(layers, base)
        found, normal = map(np.asarray, entries(body))
        size = np.sqrt(U_tau * W_p)
        np.testing.assert_allclose(found[0, 0].real, U_tau, rtol=1e-12)
        np.testing.assert_allclose(found[2, 2].real, W_p, rtol=1e-12)
        assert abs(found[0, 2] - 1j * U_p) < 1e-12 * size and abs(found[2, 0] + 1j * W_tau) < 1e-12 * size
        np.testing.assert_allclose(normal, W_p, rtol=1e-12)


def test_loose_layer_on_a_rigid_base_in_closed_form():
    """N = (1 - nu)/(G alpha) (cosh 2x - 1)/(sinh 2x + 2x), T = 1/(G alpha tanh x), in 40 digits."""
    alpha, h, G, nu = 3e5, 2e-6, 4.0, 0.4
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(G, nu), h, bonded=False)], None)
    x = mp.mpf(alpha) * mp.mpf(h)
    N = (1 - nu) / G * (mp.cosh(2 * x) - 1) / (mp.sinh(2 * x) + 2 * x) / alpha
    np.testing.assert_allclose(jc.normal_response(body, alpha), float(N), rtol=1e-13)
    across = jc.frequency_response(body, alpha, 0.0)[1, 1].real
    np.testing.assert_allclose(across, float(1 / (G * alpha * mp.tanh(x))), rtol=1e-13)


@pytest.mark.parametrize("base", BASES)
def test_states_at_a_depth(base):
    """Displacements and tractions inside a stack with loose layers, at and between its interfaces."""
    layers, base = STACKS[0], BASES[base]
    body, tops = built(layers, base), np.cumsum([0.0, 0.4, 0.7])
    for i, z in ((0, 0.25), (1, 0.3), (2, 0.1), (2, 0.3 if base is None else 0.2)):
        (U_tau, W_tau, S_tau, P_tau), (U_p, W_p, S_p, P_p) = states(layers, base, (i, z))
        j = spectra(body).instantaneous[:, None]
        t = jax.jit(transfer)(body, jnp.ones(1), jnp.asarray(tops[i] + z), j)
        ours = [t.u_rr, t.u_zr, t.t_rr, t.t_zr, t.u_rz, t.u_zz, t.t_rz, t.t_zz]
        exact = [U_tau, W_tau, -S_tau, -P_tau, U_p, W_p, -S_p, -P_p]
        np.testing.assert_allclose(np.ravel(ours), exact, rtol=1e-11, atol=1e-13)


def test_a_uniform_pressure_shortens_layers_that_cannot_widen():
    """k = 0 on a rigid base: h J (1 - 2 nu)/(2 (1 - nu)) of each layer, bonded or loose; zero for nu = 1/2."""
    top, low = jc.Maxwell(2.0, 3.0, nu=0.4), jc.Elastic(5.0, 0.2)
    for bonded in (True, False):
        body = jc.LayeredHalfSpace([jc.Layer(top, 0.3, bonded), jc.Layer(low, 0.7, bonded)], None)
        expected = 0.3 * (1 / 2 + 4.0 / 3.0) * 0.2 / 1.2 + 0.7 / 5.0 * 0.6 / 1.6
        np.testing.assert_allclose(jc.normal_response(body, 0.0, 4.0), expected, rtol=1e-12)
        one = jc.LayeredHalfSpace([jc.Layer(top, 0.3, bonded)], None)
        np.testing.assert_allclose(jc.normal_response(one, 0.0, 4.0), expected - 0.7 / 5.0 * 0.6 / 1.6)
        stuck = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(5.0, 0.5), 0.3, bonded)], None)
        assert jc.normal_response(stuck, 0.0) == 0.0
    bonded = jc.LayeredHalfSpace([jc.Layer(low, 0.7)], None)
    np.testing.assert_allclose(
        np.diag(np.asarray(jc.frequency_response(bonded, 0.0, 0.0))).real, [0.14, 0.14, 0.7 / 5.0 * 0.375]
    )
    np.testing.assert_allclose(jc.normal_response(bonded, 1e-5), 0.7 / 5.0 * 0.375, rtol=1e-8)


@pytest.mark.parametrize("base", [None, jc.Elastic(7.0, 0.2)], ids=["rigid", "elastic"])
@pytest.mark.parametrize("bonded", [True, False])
@pytest.mark.parametrize(
    "law",
    [
        pytest.param({"nu": 0.4}, id="nu", marks=pytest.mark.slow),
        pytest.param({"bulk_modulus": 5.0}, id="bulk"),
    ],
)
def test_creep_by_the_correspondence_principle(base, bonded, law):
    """A Maxwell layer, by an inverse transform of the elastic 60-digit response with G(s) and nu(s)."""
    times = np.array([0.1, 1.0, 20.0])
    body = jc.LayeredHalfSpace([jc.Layer(jc.Maxwell(1.0, 2.0, **law), 0.7, bonded)], base)

    def transform(s):
        G = 1 / (1 + 1 / (2 * mp.mpmathify(s)))  # of the compliance 1 + t/2
        nu = mp.mpf(0.4) if "nu" in law else (3 * 5 - 2 * G) / (2 * (3 * 5 + G))
        return [complex(elastic_normal(G, nu, mp.mpf(0.7), bonded, base) / s)]

    exact = [inverted(transform, t)[0] for t in times]
    np.testing.assert_allclose(jc.normal_response(body, 1.0, times), exact, rtol=2e-9)


def elastic_normal(G, nu, h, bonded, base):
    """alpha N of one layer at alpha = 1 for complex G and nu, from the layer's state matrix."""
    T = through(nu, h)
    # on the base: U = L tau + K p, W = K tau + N p for tractions (tau, p) = -(S, P) on it; zero for a rigid one
    L = K = N = mp.mpf(0)
    if base is not None:
        j, nub = 1 / mp.mpf(base.G), mp.mpf(base.nu)
        L, K, N = j * (1 - nub), j * (mp.mpf(1) / 2 - nub), j * (1 - nub)
    rows = mp.zeros(4, 4)
    rows[0, 2], rows[1, 3] = G, G  # S = 0 and P = -1 on the surface
    for c in range(4):
        U, W, S, P = T[0, c], T[1, c], G * T[2, c], G * T[3, c]
        rows[2, c] = U + L * S + K * P if bonded else S
        rows[3, c] = W + (K * S if bonded else 0) + N * P
    return mp.lu_solve(rows, mp.matrix([0, -1, 0, 0]))[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    "base", [None, pytest.param(jc.Elastic(7.0, 0.2), marks=pytest.mark.long)], ids=BASES
)
def test_sums_of_products_and_images_of_every_kind(base):
    """What a grid is given stands for the response, to 2e-5: several layers and all kinds of creep."""
    ball, grid = jc.Sphere(1.0), jc.Grid.square(n=8, width=3.0)
    sls = jc.Prony(J0=1.0, J=[2.0], tau=[3.0], nu=0.4)
    for layers in (
        [jc.Layer(jc.Elastic(1.0, 0.5), 0.5, False)],
        [jc.Layer(jc.Elastic(1.0, 0.5), 0.5)],
        [jc.Layer(sls, 0.5, False)],
        [jc.Layer(jc.Maxwell(2.0, 3.0, bulk_modulus=5.0), 0.4, False), jc.Layer(sls, 0.5)],
    ):
        found = jc.kernels(jc.LayeredHalfSpace(layers, base), ball, grid)
        errors = found.errors()
        assert errors.separation < 2e-5 and errors.images < 2e-5


def response_by(theta, base, bonded):
    """N at two wavenumbers and times for (G, eta, nu, h, base's G)."""
    G, eta, nu, h, base_G = theta
    below = None if base is None else jc.Elastic(base_G, 0.2)
    body = jc.LayeredHalfSpace([jc.Layer(jc.Maxwell(G, eta, nu=nu), h, bonded)], below)
    return jc.normal_response(
        body, jnp.array([0.0 if base is None else 0.1, 0.5, 3.0]), jnp.array([0.0, 1.0, 1.0])
    )


@pytest.mark.slow
@pytest.mark.parametrize("base", [None, "elastic"])
@pytest.mark.parametrize("bonded", [True, False])
def test_derivatives_in_both_modes(base, bonded):
    theta, f = jnp.array([1.0, 2.0, 0.4, 0.7, 7.0]), jax.jit(lambda x: response_by(x, base, bonded))
    steps = 1e-5 * np.diag(np.asarray(theta))
    differences = np.stack(
        [(f(theta + s) - f(theta - s)) / (2e-5 * t) for s, t in zip(steps, theta, strict=True)], 1
    )
    for derivative in (jax.jacfwd, jax.jacrev):
        np.testing.assert_allclose(jax.jit(derivative(f))(theta), differences, rtol=1e-6, atol=1e-9)
