"""Flash temperature against quadrature of the moving point source, Jaeger's closed forms, and exact scalings."""

from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

import jaxcontact as jc

K, KAPPA, HALF = 50.0, 1.4e-5, 4e-4  # [W/(m K)], [m2/s], half the side of the square source [m]
GRID = jc.Grid.square(32, 3.2e-3)


FILM = jc.ThermalFilm(1e-6, 1.0, 1e-6)


def rise(flux, grid=GRID, velocity=0.0, conductivity=K, diffusivity=KAPPA, film=None):
    return jc.flash_temperature(
        flux, grid, velocity=velocity, conductivity=conductivity, diffusivity=diffusivity, film=film
    )


def square(grid=GRID, half=HALF):
    x, y = grid.coordinates()
    return jnp.where((abs(x) < half) & (abs(y) < half), 1e6, 0.0)


def along_ray(angle, point, velocity):
    """The rise at a point by the part of a uniform square source in one direction, per unit angle and flux.

    A point source of unit power at a distance r makes exp(-v (r + x)/(2 kappa))/(2 pi k r) (Jaeger 1942), which
    is integrated in closed form along a ray from the point.
    """
    direction = np.array([np.cos(angle), np.sin(angle)])
    with np.errstate(divide="ignore"):
        crossings = np.sort((np.array([[-HALF], [HALF]]) - point) / direction, axis=0)
    first, last = max(crossings[0].max(), 0.0), crossings[1].min()
    if last <= first:
        return 0.0
    decay = velocity * (1.0 - direction[0]) / (2.0 * KAPPA)
    if decay * last < 1e-9:
        return (last - first) / (2.0 * np.pi * K)
    return (np.exp(-decay * first) - np.exp(-decay * last)) / (2.0 * np.pi * K * decay)


def jaeger(point, velocity):
    """The rise of a moving square source of unit flux by quadrature over the angle, split where it is not smooth."""
    corners = [np.arctan2(sy * HALF - point[1], sx * HALF - point[0]) for sx in (-1, 1) for sy in (-1, 1)]
    near_axis = [side * 10.0**-power for power in range(7) for side in (-1.0, 1.0)]
    ends = np.unique([*corners, *near_axis, -np.pi, 0.0, np.pi])
    parts = [quad(along_ray, a, b, (point, velocity), epsabs=0, epsrel=1e-9)[0] for a, b in pairwise(ends)]
    return 1e6 * sum(parts)


@pytest.mark.filterwarnings("ignore::scipy.integrate.IntegrationWarning")
@pytest.mark.parametrize("peclet", [0.0, 1e-6, 0.1, 1.0, 10.0, 1e3])
def test_a_moving_square_source_is_that_of_jaegers_integral(peclet):
    velocity = 2.0 * KAPPA * peclet / HALF
    field, axis = np.asarray(rise(square(), velocity=velocity)), np.asarray(GRID.axes()[0])
    for i, j in [(16, 16), (12, 17), (19, 14), (5, 16), (26, 15), (15, 25), (1, 1)]:
        assert field[i, j] == pytest.approx(jaeger((axis[i], axis[j]), velocity), abs=1e-7 * field.max())


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::scipy.integrate.IntegrationWarning")
@pytest.mark.parametrize("along_x", [True, False])
def test_only_the_side_along_the_motion_counts_in_the_peclet_number_of_a_cell(along_x):
    """Cells 16 times as long across the motion as along it, Peclet numbers 100 along it (1600 by the longer side)."""
    sides, shape = (HALF / 8.0, 2.0 * HALF), (48, 5)
    velocity = 2.0 * KAPPA * 100.0 / sides[0]
    grid = jc.Grid(shape, sides) if along_x else jc.Grid(shape[::-1], sides[::-1])
    flux = square(grid)
    assert int(jnp.sum(flux > 0.0)) == 16
    field = np.asarray(rise(flux, grid, velocity=(velocity, 0.0) if along_x else (0.0, velocity)))
    field, axis = field if along_x else field.T, (np.arange(48) - 23.5) * sides[0]
    for i, j in [(24, 2), (17, 2), (31, 2), (5, 2), (30, 1), (10, 3), (40, 4)]:
        exact = jaeger((axis[i], (j - 2.0) * sides[1]), velocity)
        assert field[i, j] == pytest.approx(exact, abs=1e-7 * field.max())


def beyond_the_film(point, velocity, film, base):
    """The rise at a point by a uniform square source of 1 MW/m2 on a film, less that on a half-space of its material.

    Fourier integral over the reflection at the base, in polar wavenumbers; (conductivity, diffusivity) of the base.
    """
    (k2, kappa2), h, k1, kappa1 = base, film.thickness, film.conductivity, film.diffusivity
    nodes, weights = np.polynomial.legendre.leggauss(16)
    panels = lambda ends: [
        np.ravel(a)
        for a in (
            (ends[:-1, None] + np.diff(ends)[:, None] * (1 + nodes) / 2),
            np.diff(ends)[:, None] * weights / 2,
        )
    ]
    alpha, d_alpha = panels(
        np.concatenate([[0.0], np.geomspace(1e-6, 1e-2, 12), np.linspace(0.02, 20.0, 150)]) / h
    )
    angle, d_angle = panels(
        np.pi / 2 + np.pi / 2 * np.array([-1, -0.5, -0.1, -0.01, -1e-3, 0, 1e-3, 0.01, 0.1, 0.5, 1])
    )
    kx, ky = alpha[:, None] * np.cos(angle), alpha[:, None] * np.sin(angle)
    s1, s2 = (np.sqrt(alpha[:, None] ** 2 - 1j * velocity * kx / kappa) for kappa in (kappa1, kappa2))
    part = np.exp(-2.0 * s1 * h) * (k1 * s1 - k2 * s2) / (k1 * s1 + k2 * s2)
    change = 2.0 * part / (1.0 - part) / (k1 * s1)
    flux = 4e6 * np.sin(kx * HALF) / kx * np.sin(ky * HALF) / ky
    waves = change * flux * np.exp(1j * kx * point[0]) * 2.0 * np.cos(ky * point[1]) * alpha[:, None]
    return float((d_alpha @ waves.real @ d_angle) / (4.0 * np.pi**2))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::scipy.integrate.IntegrationWarning")
@pytest.mark.parametrize("velocity", [0.0, pytest.param(0.05, marks=pytest.mark.slow), 1.0])
@pytest.mark.parametrize(("cells", "conducts"), [(0.5, 0.1), (0.5, 10.0), (2.0, 0.1), (8.0, 10.0)])
def test_a_moving_square_source_on_a_film_is_that_of_the_fourier_integral(cells, conducts, velocity):
    """The film has K and KAPPA; its half-space is Jaeger's integral, and the rest the reflection at the base."""
    film, base = jc.ThermalFilm(cells * 1e-4, K, KAPPA), (K / conducts, KAPPA / 3.0)
    field = jc.flash_temperature(
        square(), GRID, velocity=velocity, conductivity=base[0], diffusivity=base[1], film=film
    )
    axis = np.asarray(GRID.axes()[0])
    for i, j in [(16, 16), (12, 17), (5, 16), (26, 15), (15, 25)]:
        point = axis[i], axis[j]
        expected = jaeger(point, velocity) + beyond_the_film(point, velocity, film, base)
        assert field[i, j] == pytest.approx(expected, abs=1e-3 * float(field.max()))


def test_limits_of_a_film():
    """A film of the base's material, a very thick one, and a thin one: a resistance h (1/k1 - k1/k2^2) under the flux."""
    flux, there = square(), {"velocity": 0.2, "conductivity": K, "diffusivity": KAPPA}
    bare = rise(flux, velocity=0.2)
    largest = float(bare.max())
    same = jc.flash_temperature(flux, GRID, **there, film=jc.ThermalFilm(3e-5, K, KAPPA))
    np.testing.assert_allclose(same, bare, atol=1e-6 * largest)
    thick = jc.flash_temperature(flux, GRID, **there, film=jc.ThermalFilm(1.0, 10.0, 1e-6))
    np.testing.assert_allclose(
        thick, rise(flux, velocity=0.2, conductivity=10.0, diffusivity=1e-6), rtol=2e-3, atol=1e-3 * largest
    )
    h, k1 = 1e-7, 1.0
    thin = jc.flash_temperature(flux, GRID, **there | {"velocity": 0.0}, film=jc.ThermalFilm(h, k1, 1e-6))
    added = 1e6 * h * (1.0 / k1 - k1 / K**2)
    inside = slice(13, 19)
    np.testing.assert_allclose((thin - rise(flux))[inside, inside], added, rtol=2e-2)


@pytest.mark.slow
def test_a_band_on_a_film_is_a_long_rectangle():
    line, plane = jc.Grid((16, 1), (1e-4, 1e-3), periodic=(False, True)), jc.Grid((16, 201), (1e-4, 1e-3))
    flux, film = jnp.zeros((16, 1)).at[6:9].set(1e6), jc.ThermalFilm(1.5e-4, 5.0, 2e-6)
    there = {"velocity": 0.3, "conductivity": K, "diffusivity": KAPPA, "film": film}
    long = jc.flash_temperature(jnp.broadcast_to(flux, (16, 201)), plane, **there)[:, 100]
    band = jc.flash_temperature(flux, line, **there)[:, 0]
    np.testing.assert_allclose(long, band, atol=1e-4 * float(band.max()))


@pytest.mark.slow
def test_derivatives_by_a_film_agree_with_differences():
    flux = jnp.asarray(np.random.RandomState(1).rand(32, 32))

    def total(p):
        film = jc.ThermalFilm(p[0], p[1], p[2])
        field = jc.flash_temperature(flux, GRID, velocity=p[3], conductivity=K, diffusivity=KAPPA, film=film)
        return jnp.sum(flux**2 * field)

    at = jnp.array([1.5e-4, 5.0, 2e-6, 0.3])
    reverse, forward = jax.jit(jax.grad(total))(at), jax.jit(jax.jacfwd(total))(at)
    np.testing.assert_allclose(reverse, forward, rtol=1e-8)
    run = jax.jit(total)
    for i in range(4):
        step = jnp.zeros(4).at[i].set(1e-4 * at[i])
        assert reverse[i] == pytest.approx(
            float((run(at + step) - run(at - step)) / (2e-4 * at[i])), rel=1e-4
        )


@pytest.mark.versions
def test_a_disc_at_rest_has_the_closed_form_at_its_centre():
    grid = jc.Grid.square(129, 2.58e-3)
    x, y = grid.coordinates()
    disc = jnp.where(x**2 + y**2 < 1e-6, 1e6, 0.0)
    area = jnp.sum(disc) * grid.cell_area / 1e6  # of the cells; the centre's rise goes with the radius
    assert rise(disc, grid)[64, 64] == pytest.approx(1e6 * np.sqrt(area / np.pi) / K, rel=1e-3)


def test_a_fast_band_has_jaegers_largest_rise():
    speed, grid = 400.0, jc.Grid((201, 1), (1e-5, 1e-3), periodic=(False, True))
    x, _ = grid.coordinates()
    half = 50.5 * 1e-5
    band = jnp.where(abs(x) < half, 1e6, 0.0)
    field = rise(band, grid, speed)
    # Peclet number 7e3: the limit of no diffusion along x
    largest = 2e6 / K * np.sqrt(2.0 * KAPPA * half / (np.pi * speed))
    edge = int(jnp.argmax(field[:, 0]))
    # at a centre, not at the end
    assert field[edge, 0] == pytest.approx(largest * np.sqrt(1.0 - 0.25 / 50.5), rel=3e-3)
    assert x[edge, 0] < -0.98 * half


@pytest.mark.slow
def test_a_band_is_a_long_rectangle_and_a_turned_velocity_turns_the_field():
    line, plane = jc.Grid((16, 1), (1e-4, 1e-3), periodic=(False, True)), jc.Grid((16, 401), (1e-4, 1e-3))
    flux = jnp.zeros((16, 1)).at[6:9].set(1e6)
    there = rise(jnp.broadcast_to(flux, (16, 401)), plane, velocity=0.3)[:, 200]
    np.testing.assert_allclose(there, rise(flux, line, velocity=0.3)[:, 0], rtol=1e-7)
    flux = jnp.asarray(np.random.RandomState(0).rand(32, 32))
    np.testing.assert_allclose(
        rise(flux.T, velocity=(0.0, -0.2)), rise(flux, velocity=(-0.2, 0.0)).T, rtol=1e-10
    )
    np.testing.assert_allclose(rise(flux[::-1], velocity=-0.2), rise(flux, velocity=0.2)[::-1], rtol=1e-10)


@pytest.mark.slow
def test_derivatives_agree_with_each_other_and_with_differences():
    flux = jnp.asarray(np.random.RandomState(1).rand(32, 32))
    total = lambda p: jnp.sum(flux**2 * rise(p[0] * flux, velocity=p[1], conductivity=p[2], diffusivity=p[3]))
    at = jnp.array([1e6, 0.3, K, KAPPA])
    reverse, forward = jax.jit(jax.grad(total))(at), jax.jit(jax.jacfwd(total))(at)
    np.testing.assert_allclose(reverse, forward, rtol=1e-9)
    for i in range(4):
        step = jnp.zeros(4).at[i].set(1e-5 * at[i])
        central = (total(at + step) - total(at - step)) / (2e-5 * at[i])
        assert reverse[i] == pytest.approx(float(central), rel=1e-6)
    assert jnp.isfinite(jax.grad(total)(at.at[1].set(0.0))).all()


STEEL, GLASS = jc.ThermalBody(46.0, 1.2e-5), jc.ThermalBody(1.0, 5e-7)


def of_body(flux, body):
    return body.ambient + rise(flux, GRID, body.velocity, body.conductivity, body.diffusivity, body.film)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("first", "second"),
    [
        (STEEL, GLASS),
        (STEEL, jc.ThermalBody(46.0, 1.2e-5, velocity=2.0)),
        (
            jc.ThermalBody(46.0, 1.2e-5, velocity=(0.3, -0.2), ambient=20.0),
            jc.ThermalBody(10.0, 4e-6, velocity=-1.0),
        ),
        (jc.ThermalBody(46.0, 1.2e-5, film=FILM), jc.ThermalBody(46.0, 1.2e-5, velocity=0.5)),
    ],
    ids=["at rest", "one moves", "both move", "a film"],
)
def test_two_bodies_have_one_temperature_in_contact_and_take_all_heat(first, second):
    flux = square() * (1.0 + 0.3 * jnp.asarray(np.random.RandomState(2).rand(32, 32)))
    own, temperature = jc.heat_partition(flux, GRID, first, second)
    np.testing.assert_allclose(temperature, of_body(own, first), rtol=1e-9)
    touching = np.asarray(flux) > 0.0
    assert np.all(own[~touching] == 0.0)
    other = of_body(flux - own, second)
    np.testing.assert_allclose(
        temperature[touching], other[touching], atol=1e-7 * float(jnp.ptp(temperature))
    )
    swapped, _ = jc.heat_partition(flux, GRID, second, first)
    np.testing.assert_allclose(own + swapped, flux, atol=1e-6 * float(flux.max()))


@pytest.mark.slow
def test_at_rest_conductivities_divide_the_heat_and_a_fast_body_takes_nearly_all():
    """Far above a Peclet number of one the moving body takes 1/(1 + rise over rise at rest) of the heat, Jaeger 1942."""
    flux = square()
    own, _ = jc.heat_partition(flux, GRID, STEEL, GLASS)
    np.testing.assert_allclose(own, flux * 46.0 / 47.0, rtol=1e-8)
    shares = [
        float(
            jc.heat_partition(flux, GRID, STEEL, jc.ThermalBody(46.0, 1.2e-5, velocity=v))[0].sum()
            / flux.sum()
        )
        for v in (0.0, 1.0, 10.0)
    ]
    assert shares[0] == pytest.approx(0.5, rel=1e-8) and shares[0] > 3 * shares[1] > 6 * shares[2] > 0.0


@pytest.mark.slow
def test_the_partition_is_differentiable():
    flux = square()

    def hottest(p):
        first, second = jc.ThermalBody(p[0], 1.2e-5), jc.ThermalBody(20.0, p[1], velocity=p[2])
        return jnp.sum(flux * jc.heat_partition(flux, GRID, first, second)[1]) * 1e-6

    at = jnp.array([46.0, 8e-6, 0.3])
    reverse, forward = jax.grad(hottest)(at), jax.jacfwd(hottest)(at)
    np.testing.assert_allclose(reverse, forward, rtol=1e-6)
    for i in range(3):
        step = jnp.zeros(3).at[i].set(1e-4 * at[i])
        assert reverse[i] == pytest.approx(
            float((hottest(at + step) - hottest(at - step)) / (2e-4 * at[i])), rel=1e-4
        )


def test_a_partition_of_what_is_no_body_or_no_heat_is_refused():
    with pytest.raises(ValueError, match="second: expected a ThermalBody, got float"):
        jc.heat_partition(square(), GRID, STEEL, 1.0)
    with pytest.raises(ValueError, match=r"heat_flux \[W/m2\]: expected >= 0"):
        jc.heat_partition(-square(), GRID, STEEL, GLASS)
    with pytest.raises(ValueError, match=r"ThermalBody ambient \[K\]: expected finite"):
        jc.heat_partition(square(), GRID, STEEL, jc.ThermalBody(1.0, 5e-7, ambient=np.inf))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"flux": jnp.zeros((4, 4))}, r"heat_flux \[W/m2\]: expected the grid's shape"),
        ({"velocity": (1.0, 2.0, 3.0)}, r"velocity: expected a number or shape \(2,\), got shape \(3,\)"),
        ({"velocity": 1e3}, "Peclet number"),
        ({"conductivity": 0.0}, r"conductivity \[W/\(m K\)\]: expected > 0"),
        ({"diffusivity": -1.0}, r"diffusivity \[m2/s\]: expected > 0"),
        ({"grid": jc.Grid((32, 32), (1e-4, 1e-4), periodic=True)}, "has no limit"),
        ({"film": 1e-6}, "film: expected ThermalFilm or None, got float"),
        ({"film": jc.ThermalFilm(0.0, 1.0, 1e-6)}, r"ThermalFilm thickness \[m\]: expected > 0"),
        ({"film": FILM, "velocity": (0.0, 1.0)}, r"velocity across x \[m/s\] with film"),
    ],
)
def test_what_has_no_steady_temperature_is_refused(change, words):
    with pytest.raises(ValueError, match=words):
        rise(**{"flux": square(), **change})


def test_a_band_at_rest_is_refused_and_nan_where_values_are_traced():
    line = jc.Grid((16, 1), (1e-4, 1e-3), periodic=(False, True))
    with pytest.raises(ValueError, match="plane strain"):
        rise(jnp.ones((16, 1)), line)
    assert jnp.isnan(jax.jit(lambda k: rise(square(), conductivity=k))(-1.0)).all()
