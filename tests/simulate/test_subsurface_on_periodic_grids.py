"""Fields below the surface on grids that are periodic along both axes, and in plane strain."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc

WIDTH = 2.0 * np.pi
GRID = jc.Grid((16, 12), (WIDTH / 16, WIDTH / 12), periodic=True)
ELASTIC = {"film": jc.Elastic(2.0, 0.3), "base": jc.Elastic(1.0, 0.4)}


def test_a_wave_of_pressure_on_a_half_space():
    """sigma_zz = -p (1 + k z) e^-kz, sigma_xx = -p (1 - k z) e^-kz, sigma_xz = -p k z e^-kz tan, about the mean."""
    nu, G, k = 0.3, 2.0, 2.0
    x, z = np.asarray(GRID.axes()[0]), np.array([0.0, 0.3, 1.0])
    wave, mean = 0.5 * np.cos(k * x)[:, None] * np.ones(12), 1.0
    inside = jc.subsurface(jc.LayeredHalfSpace([], jc.Elastic(G, nu)), GRID, mean + wave, depths=z)
    kz, decay = (k * z)[:, None, None], np.exp(-k * z)[:, None, None]
    sine = 0.5 * np.sin(k * x)[:, None] * np.ones(12)
    stress, around = inside.stress, mean * nu / (1.0 - nu)
    np.testing.assert_allclose(stress[:, 2, 2], -mean - wave * (1.0 + kz) * decay, atol=1e-12)
    np.testing.assert_allclose(stress[:, 0, 0], -around - wave * (1.0 - kz) * decay, atol=1e-12)
    np.testing.assert_allclose(stress[:, 1, 1], -around - 2.0 * nu * wave * decay, atol=1e-12)
    np.testing.assert_allclose(stress[:, 0, 2], -sine * kz * decay, atol=1e-12)
    moved = wave * ((1.0 - nu) + 0.5 * kz) * decay / (G * k)
    np.testing.assert_allclose(inside.displacement[:, 2], moved, atol=1e-12)


def smooth_tractions():
    """Waves of two lengths in all three directions, with means."""
    x, y = (np.asarray(a) for a in GRID.coordinates())
    return np.stack(
        [
            0.3 + np.cos(x + 2 * y),
            0.2 * np.sin(2 * x - y) + 0.1,
            1.0 + np.sin(x) * np.cos(y) + 0.2 * np.cos(2 * y),
        ]
    )


@pytest.mark.slow
@pytest.mark.parametrize("base", [ELASTIC["base"], None], ids=["elastic", "rigid"])
def test_equilibrium_and_hookes_law(base):
    """In the film and below: derivatives along the surface by the grid's waves, along depth by differences."""
    h, film = 0.8, ELASTIC["film"]
    body, step = jc.LayeredHalfSpace([jc.Layer(film, h)], base), 1e-3
    q_x, q_y, p = smooth_tractions()
    places = [(0.4, film)] + ([] if base is None else [(1.1, base)])
    z = np.concatenate([[0.0], *[[a - step, a, a + step] for a, _ in places]])
    inside = jc.subsurface(body, GRID, p, np.stack([q_x, q_y]), depths=z)
    np.testing.assert_allclose(inside.stress[0, :, 2], -np.stack([q_x, q_y, p]), atol=1e-12)
    waves = [2j * np.pi * np.fft.fftfreq(n, d) for n, d in zip(GRID.shape, GRID.spacing, strict=True)]

    def gradient(below, here, above):
        """d/dx_j of a field (..., nx, ny), j last."""
        F = np.fft.fft2(here)
        along = [np.fft.ifft2(F * waves[0][:, None]).real, np.fft.ifft2(F * waves[1]).real]
        return np.stack([*along, (above - below) / (2.0 * step)], -1)

    for i, (_, solid) in enumerate(places):
        stress, moved = (np.asarray(a)[1 + 3 * i : 4 + 3 * i] for a in (inside.stress, inside.displacement))
        assert np.max(np.abs(np.trace(gradient(*stress), axis1=1, axis2=-1))) < 1e-5
        slopes = np.moveaxis(gradient(*moved), -1, 1)
        strain = (slopes + slopes.swapaxes(0, 1)) / 2.0
        G, nu = solid.G, solid.nu
        dilation = np.trace(strain) * np.eye(3)[:, :, None, None]
        hooke = 2.0 * G * (strain + nu / (1.0 - 2.0 * nu) * dilation)
        off = hooke - stress[1]
        if base is not None:  # displacement is relative to the mean, whose uniform strain is not in it
            off = off - np.mean(off, (-1, -2), keepdims=True)
        assert np.max(np.abs(off)) < 1e-5


@pytest.mark.slow
def test_the_mean_of_a_creeping_layer_on_a_rigid_base():
    """A uniform pressure and shear after a step: what is left of the layer below shortens and shears."""
    body = jc.LayeredHalfSpace([jc.Layer(jc.Maxwell(2.0, 3.0, nu=0.4), 0.8)], None)
    pressure = np.full((2, 16, 12), 0.5)
    traction = np.broadcast_to(np.array([0.2, 0.0])[:, None, None], (2, 2, 16, 12))
    inside = jc.subsurface(body, GRID, pressure, traction, depths=[0.0, 0.5, 0.8], times=[0.0, 6.0])
    J, below = 0.5 + 6.0 / 3.0, np.array([0.8, 0.3, 0.0])
    np.testing.assert_allclose(
        np.mean(inside.displacement[:, 2], (-1, -2)), below * J * 0.5 * 0.2 / 1.2, atol=1e-10
    )
    np.testing.assert_allclose(np.mean(inside.displacement[:, 0], (-1, -2)), below * J * 0.2, atol=1e-10)


@pytest.mark.slow
def test_a_strip_of_pressure_in_plane_strain():
    """K. L. Johnson, Contact Mechanics, 1985, Eqs. 2.30: uniform pressure on a strip, exact at all cells."""
    n, dx, nu, p = 32, 0.1, 0.3, 2.0
    grid, body = (
        jc.Grid((n, 1), (dx, 1.0), periodic=(False, True)),
        jc.LayeredHalfSpace([], jc.Elastic(3.0, nu)),
    )
    x, z = np.asarray(grid.axes()[0]), np.array([0.05, 0.4, 1.5])
    a = 5 * dx
    inside = jc.subsurface(body, grid, np.where(np.abs(x) < a, p, 0.0)[:, None], depths=z)
    first, second = (np.arctan2(z[:, None], x - edge) for edge in (a, -a))
    angle, sines = 2.0 * (first - second), np.sin(2 * first) - np.sin(2 * second)
    xx, zz = -p / (2 * np.pi) * (angle + sines), -p / (2 * np.pi) * (angle - sines)
    xz = p / (2 * np.pi) * (np.cos(2 * first) - np.cos(2 * second))
    stress = np.asarray(inside.stress)[..., 0]
    np.testing.assert_allclose(stress[:, 0, 0], xx, atol=1e-10)
    np.testing.assert_allclose(stress[:, 2, 2], zz, atol=1e-10)
    np.testing.assert_allclose(stress[:, 0, 2], xz, atol=1e-10)
    np.testing.assert_allclose(stress[:, 1, 1], nu * (xx + zz), atol=1e-10)
    np.testing.assert_allclose(stress[:, 1, [0, 2]], 0.0, atol=1e-12)


@pytest.mark.long
def test_a_layer_in_plane_strain():
    """Equilibrium and Hooke's law by differences, under pressure and shear; the surface as of ``deflection``."""
    n, dx, h = 96, 0.02, 0.6
    grid, film = jc.Grid((n, 1), (dx, 1.0), periodic=(False, True)), ELASTIC["film"]
    body = jc.LayeredHalfSpace([jc.Layer(film, h)], ELASTIC["base"])
    x = np.asarray(grid.axes()[0])[:, None]
    hill = np.exp(-25.0 * x**2)
    q, p = np.stack([(0.5 + x) * hill, 0.4 * hill]), (1.0 + x) * hill
    inside = jc.subsurface(body, grid, p, q, depths=np.array([0.2 - dx, 0.2, 0.2 + dx]))
    stress, moved = (np.asarray(field)[..., 0] for field in (inside.stress, inside.displacement))

    def gradient(field):
        along = (np.roll(field[1], -1, -1) - np.roll(field[1], 1, -1)) / (2 * dx)
        return np.stack([along, 0.0 * along, (field[2] - field[0]) / (2 * dx)], -1)[..., 4:-4, :]

    slopes = gradient(stress)
    assert np.max(np.abs(np.trace(slopes, axis1=1, axis2=-1))) < 0.01 * np.max(np.abs(slopes))
    strain = np.moveaxis(gradient(moved), -1, 1)
    strain = (strain + strain.swapaxes(0, 1)) / 2.0
    hooke = 2.0 * film.G * (strain + film.nu / (1 - 2 * film.nu) * np.trace(strain) * np.eye(3)[:, :, None])
    there = stress[1][..., 4:-4]
    assert np.max(np.abs(hooke - there)) < 0.01 * np.max(np.abs(there))
    alone = jc.subsurface(body, grid, p, depths=[0.0])
    surface = jc.deflection(body, grid, p, [0.0])
    np.testing.assert_allclose(alone.displacement[0, 2], surface.displacement[0], rtol=1e-5)


@pytest.mark.slow
def test_stresses_under_a_moving_pressure():
    """In the frame of the body, at times that resolve the motion; at the surface as of ``deflection``."""
    body = jc.LayeredHalfSpace([jc.Layer(jc.Maxwell(1.0, 2.0, nu=0.4), 0.3)], jc.Elastic(20.0, 0.3))
    grid, v, times = jc.Grid((48, 16), (0.05, 0.05)), 0.5, np.linspace(0.0, 1.0, 41)
    x, y = (np.asarray(a) for a in grid.coordinates())
    bump = lambda at: np.exp(-60.0 * ((x - at) ** 2 + y**2))
    still = jc.subsurface(
        body, grid, np.stack([bump(v * t - 0.25) for t in times]), depths=[0.0, 0.3], times=times
    )
    moving = jc.deflection(body, grid, bump(-0.25), times, velocity=v)
    shifted = np.asarray(moving.displacement[-1])[:-10]  # the load has moved by ten cells
    np.testing.assert_allclose(still.displacement[0, 2][10:], shifted, atol=3e-3 * shifted.max())


@pytest.mark.long
def test_derivatives_on_a_periodic_grid():
    """By depth, thickness and modulus, forward and reverse, against differences."""
    q_x, q_y, p = smooth_tractions()

    def f(theta):
        z, h, G = theta
        body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(G, 0.3), h)], None)
        inside = jc.subsurface(body, GRID, p, np.stack([q_x, q_y]), depths=z[None])
        return jnp.stack([inside.stress[0, 0, 0, 3, 4], inside.displacement[0, 2, 5, 6]])

    theta, g = jnp.array([0.3, 0.8, 2.0]), jax.jit(f)
    steps = 1e-5 * np.diag(np.asarray(theta))
    differences = np.stack([(g(theta + s) - g(theta - s)) / (2 * s.sum()) for s in steps], 1)
    for derivative in (jax.jacfwd, jax.jacrev):
        np.testing.assert_allclose(jax.jit(derivative(f))(theta), differences, rtol=1e-6, atol=1e-9)
