"""Influence coefficients in three directions: quadrature of point loads, and the layered response behind them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tolerances import ROUND_OFF

import jaxcontact as jc
from jaxcontact._support.exponential import phi1
from jaxcontact.operators.coupled import Tangential, TractionOperator
from jaxcontact.reference.layered_solid import surface_response
from jaxcontact.response.coefficients import TangentialImages, tangential_coefficients
from jaxcontact.response.stack import step_responses
from jaxcontact.response.tangential import separate_tangential, tangential_images, tangential_wavenumbers

GRID = jc.Grid((6, 5), (2.0, 3.0))
NODES, WEIGHTS = np.polynomial.legendre.leggauss(60)


def buried_point(x, y, z):
    """Inverse transforms of exp(-z alpha) times m^2/alpha^3, n^2/alpha^3, m n/alpha^3, i m/alpha^2 and i n/alpha^2."""
    r = np.sqrt(x**2 + y**2 + z**2)
    second = lambda a, b, same: (same / (r + z) - a * b / (r * (r + z) ** 2)) / (2 * np.pi)
    first = lambda a: -a / (2 * np.pi * r * (r + z))
    return second(x, x, 1.0), second(y, y, 1.0), second(x, y, 0.0), first(x), first(y)


coefficients = jax.jit(lambda images: tangential_coefficients(GRID, images))


@pytest.mark.parametrize("z", [0.0, 0.7, 5.0])
def test_coefficients_are_integrals_of_point_loads_over_a_cell(z):
    """All five kinds, off the loaded cell, by Gauss quadrature (z = 0: Cerruti and Boussinesq)."""
    for kind, (L, T, K) in enumerate([(1, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1), (0, 0, 1)]):
        weights = np.array([[L, L], [T, T], [K, K]], float)  # the second is of exp(-z alpha) - 1
        k = coefficients(TangentialImages(np.array([0.0, z]), weights))
        ours = np.asarray((k.xx, k.xx, k.xy, k.x, k.y)[kind])
        for i, j in [(1, 0), (2, 1), (0, 3), (5, 4)]:
            x, y = 2.0 * i + NODES[:, None], 3.0 * j + 1.5 * NODES
            exact = np.sum(1.5 * WEIGHTS[:, None] * WEIGHTS * buried_point(x, y, z)[kind])
            assert float(ours[i, j]) == pytest.approx(exact, abs=1e-13)


def test_the_operator_is_the_sum_over_cells():
    """Nine entries with their signs at all offsets, rows and columns of unlike number; draws and sinks reciprocally."""
    rng = np.random.default_rng(0)
    shape, (L, T, K) = (7, 10), (0.7, 1.0, 0.2)
    grid = jc.Grid(shape, (1.0, 1.5))
    q, p = rng.normal(size=(2, *shape)), rng.normal(size=shape)

    @jax.jit
    def kernels_and_products():
        kernels = tangential_coefficients(grid, TangentialImages(jnp.zeros(1), jnp.array([[L], [T], [K]])))
        operator = TractionOperator(None, Tangential.of(kernels, coupled=True))
        of_tractions = operator.tangential_from_tangential(q), operator.normal_from_tangential(q)
        return kernels, *of_tractions, operator.tangential_from_normal(p)

    kernels, drawn_along, sunk, drawn_by_pressure = kernels_and_products()
    i, j = (np.arange(n)[:, None] - np.arange(n) for n in shape)
    at = lambda k, odd_x, odd_y: (
        np.asarray(k)[abs(i)[:, None, :, None], abs(j)[None, :, None, :]]
        * (np.sign(i)[:, None, :, None] if odd_x else 1)
        * (np.sign(j)[None, :, None, :] if odd_y else 1)
    )
    sum_of = lambda k, f: np.einsum("ijab,ab->ij", k, f)
    xx, yy, xy = at(kernels.xx, 0, 0), at(kernels.yy, 0, 0), at(kernels.xy, 1, 1)
    x, y = at(kernels.x, 1, 0), at(kernels.y, 0, 1)
    along = [sum_of(xx, q[0]) + sum_of(xy, q[1]), sum_of(xy, q[0]) + sum_of(yy, q[1])]
    np.testing.assert_allclose(drawn_along, along, rtol=ROUND_OFF, atol=ROUND_OFF)
    np.testing.assert_allclose(drawn_by_pressure, [sum_of(x, p), sum_of(y, p)], atol=ROUND_OFF)
    np.testing.assert_allclose(sunk, -sum_of(x, q[0]) - sum_of(y, q[1]), atol=ROUND_OFF)
    assert np.sum(drawn_by_pressure * q) == pytest.approx(float(np.sum(sunk * p)), rel=ROUND_OFF)


@jax.jit
def fitted(body):
    L, K, _, T = step_responses(body, tangential_wavenumbers(body), 0.0)
    return tangential_images(body, jnp.stack([L, T, K])[:, None])


@pytest.mark.parametrize("ratio", [1e-4, 0.1, 4.0, 300.0])
@pytest.mark.parametrize(("nu", "bound"), [(0.3, 4e-6), (0.5, 1e-4)])
def test_images_stand_for_the_layered_response(ratio, nu, bound):
    """Against the interface conditions, alpha h from 1e-6 to 1e3; 4e-8 (nu = 0.5: 7e-7) up to a ratio of 30."""
    body = jc.LayeredHalfSpace((jc.Layer(jc.Elastic(ratio, nu), 1.0),), jc.Elastic(1.0, 0.3))
    images = fitted(body)
    alpha = np.geomspace(1e-6, 1e3, 150)
    weights, depths = np.asarray(images.weights[:, 0]), np.asarray(images.depths)
    ours = weights[:, :1] + weights[:, 1:] @ np.expm1(-depths[1:, None] * alpha)
    exact = surface_response(
        np.tile([ratio, 1.0], (150, 1)), np.tile([nu, 0.3], (150, 1)), np.ones((150, 1)), alpha, 0 * alpha
    )
    entries = alpha * np.array([exact[:, 0, 0].real, exact[:, 1, 1].real, exact[:, 0, 2].imag])
    size = np.sqrt(alpha * entries[0] * exact[:, 2, 2].real)
    error = np.max(np.abs(ours - entries) / np.stack([entries[0], entries[1], size]))
    assert error < (bound if ratio > 30.0 else bound / 50.0)


@pytest.mark.slow
@pytest.mark.parametrize(("substrate", "bound"), [(1e9, 1e-8), (2e7, 2e-6)])
def test_the_sum_of_products_is_the_response_in_time(substrate, bound):
    """Of a creeping film on a softer or stiffer substrate, from a hundredth to a hundred of its times."""
    film = jc.StandardLinearSolid(G1=1e9, G2=0.3e9, eta2=1e9, nu=0.4)
    body = jc.LayeredHalfSpace((jc.Layer(film, 1.0),), jc.Elastic(substrate, 0.3))
    separable = jax.jit(separate_tangential)(body)
    t, some = np.geomspace(0.03, 300.0, 13), np.arange(1, 402, 40)
    growth = t[:, None] * phi1(t[:, None] * separable.rates)
    ours = separable.terms[:, 0] + np.einsum("tk,mk,cmn->tcn", growth, separable.mix, separable.terms[:, 1:])
    alpha = np.asarray(tangential_wavenumbers(body))[some]
    exact = np.asarray(jc.frequency_response(body, alpha, 0.0, t[:, None])) * alpha[:, None, None]
    entries = np.stack([exact[..., 0, 0].real, exact[..., 1, 1].real, exact[..., 0, 2].imag], 1)
    assert np.max(np.abs(ours[..., some] - entries) / entries[:, :1]) < bound
