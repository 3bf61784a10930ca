"""Derivatives through contact and time: reverse equals forward equals central differences."""

import dataclasses
import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc

STEEL = jc.Elastic.from_young(210e9)
FILM = jc.Burgers(0.75e9, 13.89e6, 3.1486e12, 120.9e9)
TIMES = jnp.linspace(0.0, 1600.0, 5)
GRID = jc.Grid.square(32, 560e-6)
NAMES = ("G1", "G2", "eta1", "eta2", "nu", "thickness", "substrate", "radius", "ball", "control")
VALUES = jnp.array([0.75e9, 13.89e6, 3.1486e12, 120.9e9, 0.3, 150e-9, 80e9, 9.525e-3, 80e9, 1.0])


def outputs(log_values, control):
    """approach or load, smooth area, film strain and sum of p^2, all of order one, from log parameters."""
    G1, G2, eta1, eta2, nu, h, Gs, R, Gb, value = jnp.exp(log_values)
    body = jc.LayeredHalfSpace([jc.Layer(jc.Burgers(G1, G2, eta1, eta2, nu), h)], jc.Elastic(Gs, 0.3))
    given = jc.Load(60.0 * value) if control == "load" else jc.Approach(2.5e-6 * value)
    r = jc.indent(body, jc.Sphere(R, jc.Elastic(Gb, 0.3)), given, TIMES, grid=GRID, tolerance=1e-12)
    scalar = r.approach[-1] / 3e-6 if control == "load" else r.load[-1] / 60.0
    return jnp.stack(
        [scalar, r.smooth_area[-1] / 1e-7, r.film_strain[-1], jnp.sum((r.pressure[-1] / 1e9) ** 2) / 100]
    )


@pytest.mark.parametrize("control", ["load", "approach"])
def test_reverse_forward_and_central_differences_agree(control):
    f = jax.jit(lambda q: outputs(q, control))
    q = jnp.log(VALUES)
    forward, reverse = jax.jit(jax.jacfwd(f))(q), jax.jit(jax.jacrev(f))(q)
    np.testing.assert_allclose(reverse, forward, rtol=1e-8, atol=1e-10)
    # the least-squares images move within their error of 1e-8, which a smaller step would magnify
    step = 1e-4
    for i, name in enumerate(NAMES):
        central = (f(q.at[i].add(step)) - f(q.at[i].add(-step))) / (2 * step)
        np.testing.assert_allclose(forward[:, i], central, rtol=5e-5, atol=5e-6, err_msg=name)


def test_no_contact_and_zero_load_have_zero_gradients():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")

        def peak(film, control):
            body = jc.LayeredHalfSpace([jc.Layer(film, 150e-9)], STEEL)
            return jnp.max(jc.indent(body, jc.Sphere(9.5e-3), control, TIMES, grid=GRID).pressure)

        gradient = jax.grad(peak)(FILM, jc.Approach(-1e-6))
        assert all(float(leaf) == 0.0 for leaf in jax.tree.leaves(gradient))
        lifted = jax.grad(lambda v: jc.indent(
            jc.LayeredHalfSpace([], FILM), jc.Sphere(9.5e-3), jc.Load(v), TIMES[:2], grid=GRID
        ).pressure[-1].sum())(jnp.array([1.0, 0.0]))  # fmt: skip
        assert np.all(np.isfinite(lifted))


def test_an_integer_load_has_a_gradient():
    f = lambda radius: jc.indent(
        jc.LayeredHalfSpace([], STEEL), jc.Sphere(radius), jc.Load(60), np.zeros(1), grid=jc.Grid.square(64, 330e-6)
    ).approach[0]
    gradient = jax.grad(f)(9.525e-3)
    expected = -f(9.525e-3) / (3 * 9.525e-3)  # approach ~ R^(-1/3)
    assert float(gradient) == pytest.approx(float(expected), rel=5e-3)


def test_a_field_differentiates_with_respect_to_heights():
    x, y = GRID.coordinates()
    heights = -(x**2 + y**2) / 0.02
    body = jc.LayeredHalfSpace([jc.Layer(FILM, 150e-9)], STEEL)
    f = lambda h: jnp.sum(
        (
            jc.indent(
                body, jc.HeightField(h), jc.Load(60.0), np.zeros(1), grid=GRID, tolerance=1e-12
            ).pressure
            / 1e9
        )
        ** 2
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        direction = jnp.cos(x * 3e4) * jnp.cos(y * 2e4) * 1e-9
        slope = float(jnp.sum(jax.grad(f)(heights) * direction))
        central = float(f(heights + 1e-3 * direction) - f(heights - 1e-3 * direction)) / 2e-3
    assert slope == pytest.approx(central, rel=1e-5)


def test_dataclass_fields_are_leaves():
    assert len(jax.tree.leaves(jc.LayeredHalfSpace([jc.Layer(FILM, 1.0)], STEEL))) == 8
    assert dataclasses.is_dataclass(FILM)
