"""Gels on glass, stuck and loose: the force on a ball, uniform pressure on a periodic grid, fields below, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc

# f of F = E h^3/((1 - nu^2) R) f(R d/h^2) at nu 0.5: of a bonded layer by N. Hermanowicz, Int. J. Mech. Sci. 193 (2021)
# 106138, of a loose one by an axisymmetric solution that shares no code with the package
FORCES = {True: {0.1: 0.06581, 1.0: 6.82264, 10.0: 2224.5}, False: {0.1: 0.05521, 1.0: 3.3394, 10.0: 314.86}}


# the programs of loose layers are others; in the default tests their response is that of tests/response/test_bases.py
LOOSE_TOO = pytest.mark.parametrize("bonded", [True, pytest.param(False, marks=pytest.mark.slow)])


def gel(bonded=True, nu=0.5, h=0.01, E=3.0):
    return jc.LayeredHalfSpace([jc.Layer(jc.Elastic.from_young(E, nu=nu), h, bonded)], None)


@pytest.mark.slow
@LOOSE_TOO
def test_force_on_a_ball(bonded):
    """Within 0.2 % on 96 x 96 cells at x = R d/h^2 of 0.1 to 10; the grid of ``Grid.around`` holds the contact."""
    body, ball, h = gel(bonded), jc.Sphere(1.0), 0.01
    for x, f in FORCES[bonded].items():
        press = jc.Approach(x * h**2)
        grid = jc.Grid.square(n=96, width=3.6 * np.sqrt(x) * h)
        history = jc.indent(body, ball, press, [0.0], grid=grid)
        assert history.status[0] == 0
        np.testing.assert_allclose(history.load[0], 3.0 * h**3 / 0.75 * f, rtol=2e-3)
        around = jc.Grid.around(body, ball, press, [0.0], n=32)
        assert 0.1 < 2.0 * history.contact_radius[0] / around.width[0] < 0.7


@pytest.mark.slow
@LOOSE_TOO
def test_uniform_pressure_on_a_periodic_grid(bonded):
    """Under a flat body the approach is h p J (1 - 2 nu)/(2 (1 - nu)), by load and by approach."""
    grid, h, times = jc.Grid.square(n=8, width=1.0), 0.3, np.array([0.0, 1.0, 4.0])
    grid = jc.Grid(grid.shape, grid.spacing, periodic=True)
    soft = jc.Maxwell(2.0, 3.0, nu=0.4)
    body = jc.LayeredHalfSpace([jc.Layer(soft, h, bonded)], None)
    flat = jc.HeightField(jnp.zeros(grid.shape))
    pressed = jc.indent(body, flat, jc.Load(0.01), times, grid=grid, substeps=1)
    expected = h * 0.01 * 0.2 / 1.2 * (1 / 2 + times / 3)
    np.testing.assert_allclose(pressed.approach, expected, rtol=1e-8)
    np.testing.assert_allclose(pressed.pressure, 0.01, rtol=1e-8)
    held = jc.indent(body, flat, jc.Approach(expected), times, grid=grid)
    np.testing.assert_allclose(held.load, 0.01, rtol=1e-6)


def test_waves_on_a_periodic_grid_have_their_transform():
    """A wave of heights that touches everywhere, on a rigid base: its pressure is the wave over N(k), about the mean."""
    shape, width, h = (16, 16), 1.0, 0.3
    grid = jc.Grid(shape, (width / 16, width / 16), periodic=True)
    body, k = gel(nu=0.3, h=h), 2.0 * np.pi / width
    x = np.asarray(grid.axes()[0])
    wave = 1e-3 * np.cos(k * x)[:, None] * np.ones(16)
    history = jc.indent(body, jc.HeightField(wave), jc.Load(0.1), [0.0], grid=grid)
    expected = 0.1 + wave / float(jc.normal_response(body, k))
    assert expected.min() > 0.0
    np.testing.assert_allclose(history.pressure[0], expected, rtol=1e-6)


@pytest.mark.slow
def test_an_incompressible_gel_that_fills_a_periodic_grid():
    """Its mean cannot move: an approach up to the mean gap is met, one beyond it is refused."""
    grid = jc.Grid((16, 16), (1 / 16, 1 / 16), periodic=True)
    wave = 1e-3 * (1.0 - np.cos(2 * np.pi * np.asarray(grid.axes()[0])))[:, None] * np.ones(16)
    for bonded in (True, False):
        body = gel(bonded, h=0.3)
        history = jc.indent(body, jc.HeightField(wave), jc.Approach(0.5e-3), [0.0], grid=grid)
        displaced = history.displacement[0] if hasattr(history, "displacement") else None
        assert history.status[0] == 0 and history.load[0] > 0.0
        assert displaced is None or abs(float(jnp.mean(displaced))) < 1e-12
        with pytest.raises(ValueError, match=r"expected less than 0\.00098.* on a periodic grid"):
            jc.indent(body, jc.HeightField(wave), jc.Approach(1.1e-3), [0.0], grid=grid)
    compressible = gel(nu=0.3, h=0.3)
    pressed = jc.indent(compressible, jc.HeightField(wave), jc.Approach(3e-3), [0.0], grid=grid)
    assert pressed.status[0] == 0
    np.testing.assert_allclose(
        jnp.mean(pressed.pressure),
        (3e-3 - 0.980785e-3) / float(jc.normal_response(compressible, 0.0)),
        rtol=1e-6,
    )


@pytest.mark.slow
@pytest.mark.parametrize("bonded", [True, False])
def test_fields_below_a_pressure(bonded):
    """On the base the displacement into it is zero and, if bonded, along it, else the shear; the load is carried."""
    body, grid, h = gel(bonded, nu=0.4, h=0.4), jc.Grid.square(n=48, width=6.0), 0.4
    x, y = grid.coordinates()
    pressure = np.where(np.asarray(x**2 + y**2) < 0.25, 1.0, 0.0)
    inside = jc.subsurface(body, grid, pressure, depths=np.array([0.0, 0.2, h]))
    scale = float(jnp.max(jnp.abs(inside.displacement[0])))
    on_base, stress = inside.displacement[-1], inside.stress[-1]
    assert float(jnp.max(jnp.abs(on_base[2]))) < 1e-5 * scale
    sheared, moved = float(jnp.max(jnp.abs(stress[:2, 2]))), float(jnp.max(jnp.abs(on_base[:2])))
    assert (moved < 1e-5 * scale and sheared > 0.05) if bonded else (sheared < 1e-5 and moved > 0.05 * scale)
    carried = -jnp.sum(inside.stress[:, 2, 2], (-1, -2)) / jnp.sum(pressure)
    np.testing.assert_allclose(carried, 1.0, atol=5e-3)


def force(theta, bonded, base):
    """The force on a ball, elastic at first and after creep, for (G, thickness, eta, base's G)."""
    G, h, eta, base_G = theta
    below = None if base is None else jc.Elastic(base_G, 0.2)
    body = jc.LayeredHalfSpace([jc.Layer(jc.Maxwell(G, eta, nu=0.45), h, bonded)], below)
    grid = jc.Grid.square(n=16, width=0.05)
    press = jc.Approach(jnp.array([1e-4, 1.5e-4]))
    return jc.indent(body, jc.Sphere(1.0), press, jnp.array([0.0, 1.0]), grid=grid, tolerance=1e-12).load


@pytest.mark.long
@pytest.mark.parametrize(
    ("bonded", "base"),
    [
        pytest.param(False, None, marks=pytest.mark.long),
        (True, None),
        pytest.param(False, 1, marks=pytest.mark.long),
    ],
)
def test_derivatives_of_a_contact(bonded, base):
    """Forward and reverse against central differences, 1e-6."""
    theta, f = jnp.array([1.0, 0.012, 2.0, 5.0]), jax.jit(lambda x: force(x, bonded, base))
    steps = 1e-5 * np.diag(np.asarray(theta))
    differences = np.stack([(f(theta + s) - f(theta - s)) / (2 * s.sum()) for s in steps], 1)
    scale = np.max(np.abs(differences) * np.asarray(theta), 1, keepdims=True) / np.asarray(theta)
    for derivative in (jax.jacfwd, jax.jacrev):
        found = np.asarray(jax.jit(derivative(f))(theta))
        assert np.max(np.abs(found - differences) / scale) < 1e-6


@pytest.mark.long
def test_sliding_and_growth_on_a_rigid_base():
    """A ball that slides on a creeping gel, a gel that grows, and quasi-elastic creep run."""
    soft = jc.Prony(J0=0.3, J=[0.5], tau=[1.0], nu=0.45)
    ball, grid, times = jc.Sphere(1.0), jc.Grid.square(n=24, width=0.036), np.array([0.0, 0.5])
    for bonded in (True, False):
        body = jc.LayeredHalfSpace([jc.Layer(soft, 0.02, bonded)], None)
        steady = jc.slide_steady(body, ball, jc.Load(1e-5), velocity=0.02, grid=grid)
        assert steady.status == 0
        still = jc.indent(
            body, ball, jc.Load(1e-5), times, grid=grid, substeps=4, correspondence="quasi-elastic"
        )
        exact = jc.indent(body, ball, jc.Load(1e-5), times, grid=grid, substeps=4)
        np.testing.assert_allclose(still.approach, exact.approach, rtol=1e-3)
    growing = jc.LayeredHalfSpace([jc.Layer(soft, np.array([0.02, 0.021]))], None)
    assert jc.indent(growing, ball, jc.Load(1e-5), times, grid=grid, substeps=4).status[-1] == 0
