"""The area of contact of any number of patches, on any kind of grid, against closed forms and finer grids."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from oblique_edges import line_contact, on_grid, rectangles, rows
from scipy.special import ellipe, ellipk

import jaxcontact as jc
from jaxcontact.contact import edge
from jaxcontact.reference import ting

E, NU = 2.0, 0.25
BODY = jc.LayeredHalfSpace([], jc.Elastic(0.5 * E * (1.0 - NU), NU))  # plane-strain modulus E
pytestmark = pytest.mark.filterwarnings("ignore:.*cells across", "ignore:.*film strain")
FREE, PERIODIC = (False, False), (True, True)
contact_cells, memory_factor = (
    jax.jit(edge.contact_cells, static_argnums=3),
    jax.jit(edge.memory_factor, static_argnums=2),
)


def area_in_cells(heights, load, grid):
    """The area under a rigid surface with these heights, [cells]; cells of the grid are 1 m^2 or as it says."""
    history = jc.indent(
        BODY, jc.HeightField(jnp.asarray(heights)), jc.Load(load), [0.0], grid=grid, tolerance=1e-10
    )
    assert int(history.status[0]) in (0, 3)
    return float(history.smooth_area[0] / grid.cell_area)


# without a solver: pressure and gap as they are given ------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "periodic"),
    [*(((7, 12), kind) for kind in (FREE, PERIODIC, (True, False), (False, True))), ((9, 1), (False, True))],
)
def test_full_contact_is_the_whole_grid(shape, periodic):
    full = contact_cells(jnp.ones(shape), jnp.zeros(shape), jnp.asarray(0.3), periodic)
    np.testing.assert_allclose(full, shape[0] * shape[1], rtol=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(16, 16), pytest.param((9, 1), marks=pytest.mark.slow)])
def test_without_contact_the_area_and_its_derivatives_are_zero(shape):
    area = lambda p, g, c: contact_cells(p, g, c, FREE)
    value, slopes = jax.jit(jax.value_and_grad(area, (0, 1, 2)))(jnp.zeros(shape), jnp.ones(shape), 0.3)
    assert float(value) == 0.0
    for slope in slopes:
        np.testing.assert_array_equal(slope, 0.0)


def disc(n, centre, radius, across=1.0):
    """Pressure and gap of a paraboloid on a bed of springs, whose level is linear through the edge."""
    i, j = np.arange(n)[:, None] - centre[0], (np.arange(n)[None, :] - centre[1]) * across
    depth = (radius**2 - i**2 - j**2) / (2.0 * radius)
    return jnp.asarray(np.maximum(depth, 0.0)), jnp.asarray(np.maximum(-depth, 0.0))


@pytest.mark.parametrize("across", [1.0, 0.6])
@pytest.mark.parametrize("count", [1, 4, 16])
def test_the_correction_follows_the_number_of_patches(count, across):
    """So many discs on one periodic grid have the area of one, so many times; each to a tenth of a cell along its edge."""
    p, g = disc(24, (11.3, 11.6), 5.2, across)
    one = float(contact_cells(p, g, jnp.asarray(1.0), PERIODIC))
    many = contact_cells(*(jnp.tile(a, (count, 3)) for a in (p, g)), jnp.asarray(1.0), PERIODIC)
    np.testing.assert_allclose(many, 3 * count * one, rtol=1e-13)  # of 16 x 3 the tiles are in two batches
    assert one == pytest.approx(np.pi * 5.2**2 / across, abs=0.1 * 2.0 * np.pi * 5.2 / across)


@pytest.mark.parametrize("shift", [(12, 0), (0, 12), (12, 12)])
def test_a_patch_across_the_sides_of_a_periodic_grid_is_whole(shift):
    p, g = disc(24, (11.3, 11.6), 5.2)
    there = contact_cells(jnp.roll(p, shift, (0, 1)), jnp.roll(g, shift, (0, 1)), jnp.asarray(1.0), PERIODIC)
    np.testing.assert_allclose(there, contact_cells(p, g, jnp.asarray(1.0), PERIODIC), rtol=1e-13)


@pytest.mark.slow
def test_the_side_of_a_grid_is_no_edge_of_the_contact():
    """A band from side to side has as many cells a row, and half a disc at a side is half of the whole one."""
    p, g = disc(25, (12.0, 12.0), 6.3)
    whole = float(contact_cells(p, g, jnp.asarray(1.0), FREE))
    doubled = [jnp.concatenate([a[12:0:-1], a[12:13], a[13:]])[12:] for a in (p, g)]
    half = contact_cells(*doubled, jnp.asarray(1.0), FREE)  # its first row is cut in the middle
    row = 2.0 * 6.3
    assert float(half) == pytest.approx((whole + row) / 2.0, abs=0.25)
    band = [jnp.broadcast_to(a[:, 12:13], (25, 9)) for a in (p, g)]
    np.testing.assert_allclose(
        contact_cells(*band, jnp.asarray(1.0), FREE),
        contact_cells(*band, jnp.asarray(1.0), (False, True)),
        rtol=1e-13,
    )


@pytest.mark.slow
def test_the_area_moves_steadily_while_cells_enter():
    """A disc that grows by 1/50 of a cell a step: no jump of the area, and its slope stays within a third."""
    radii = np.arange(4.0, 7.0, 0.02)
    areas = np.array(
        [float(contact_cells(*disc(20, (9.27, 9.61), r), jnp.asarray(1.0), FREE)) for r in radii]
    )
    slopes = np.diff(areas) / (2.0 * np.pi * 0.02 * (radii[1:] - 0.01))
    assert np.all(np.abs(slopes - 1.0) < 0.4)
    assert abs(np.mean(slopes) - 1.0) < 0.02


def test_the_memory_of_a_cell_is_local_and_scales_with_its_history():
    rng = np.random.default_rng(1)
    u = jnp.asarray(rng.normal(size=(12, 9)))
    for periodic in (FREE, PERIODIC):
        np.testing.assert_allclose(memory_factor(2.5 * u, u, periodic), 3.5, rtol=1e-12)
        np.testing.assert_array_equal(memory_factor(-u, u, periodic), 1.0)
        np.testing.assert_array_equal(memory_factor(u, 0.0 * u, periodic), 1.0)


HELD = 0.86001  # displacement of a cell of 1 under unit pressure for E* = 1, its neighbours held


@pytest.mark.parametrize(("a", "b"), [(0, 1), (1, 1), (1, 2), (1, 3), (2, 3)])
def test_the_edge_of_a_line_contact_in_any_direction(a, b):
    """Solved row by row, for eight places of the edge among the cells: the half-width to 0.0025 of a cell, in the mean to
    0.002, and its slope to 1 %."""
    length, period, places = np.hypot(a, b), int(60 * np.hypot(a, b)), 8
    kernel, widths = rows(a, b, period), 25.0 + np.arange(places) / (np.hypot(a, b) * places)
    fields = [[on_grid(f, a, b) for f in line_contact(width, kernel, length, period)] for width in widths]
    area = jax.jit(lambda p, g: contact_cells(p, g, jnp.asarray(HELD), PERIODIC))
    errors = np.array([float(area(*f)) for f in fields]) / (2.0 * period * length) - widths
    slopes = np.diff(np.append(errors, errors[0])) / (widths[1] - widths[0])
    assert abs(np.mean(errors)) < 0.002 and np.max(np.abs(errors)) < 0.0025
    assert np.max(np.abs(slopes)) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("across", [
    pytest.param(1.5, marks=pytest.mark.long), 3.0, pytest.param(7.0, marks=pytest.mark.long)
])  # fmt: skip
@pytest.mark.parametrize(("a", "b"), [(0, 1), (1, 0), (1, 1), (1, 3), (3, 1), (6, 1)])
def test_the_edge_of_a_line_contact_on_cells_that_are_not_square(a, b, across):
    """As above on cells of 1 by ``across``, in parts of the extent of a cell across the edge; and with the axes exchanged.

    The compliance is that of a rectangle whose neighbours are held, from the harmonic mean of the spectrum of a truncated
    kernel, whose longest waves are negative and raised.
    """
    length, places = np.hypot(a, b * across), 8
    extent = np.hypot(b * across, a * across) / length  # of a cell across the edge
    period = 2 * int(np.ceil(30.0 * extent * length / across))
    kernel, step = rows(a, b, period, across), across / length / places
    widths = 25.0 * extent + step * np.arange(places)
    offsets = np.minimum(np.arange(129), 129 - np.arange(129))
    spectrum = np.fft.fft2(rectangles(offsets[:, None].astype(float), offsets[None, :] * across, across)).real
    held = jnp.asarray(1.0 / np.mean(1.0 / np.maximum(spectrum, 1e-3 * spectrum.mean())))
    area = jax.jit(lambda p, g: contact_cells(p, g, held, PERIODIC, across))
    turned = jax.jit(lambda p, g: contact_cells(p, g, held, PERIODIC, 1.0 / across))
    errors = []
    for width in widths:
        p, g = (on_grid(f, a, b) for f in line_contact(width, kernel, length / across, period))
        found = float(area(p, g))
        errors.append(found * across / (2.0 * period * length) - width)
        assert found == pytest.approx(float(turned(p.T, g.T)), rel=1e-12)
    assert abs(np.mean(errors)) < 0.0065 * extent and np.max(np.abs(errors)) < 0.009 * extent
    if 0 in (a, b):
        assert abs(np.mean(errors)) < 0.001 * extent and np.max(np.abs(errors)) < 0.0025 * extent


# Hertz -----------------------------------------------------------------------------------------------------


def paraboloid(n, centre, radii=(1.0, 1.0), spacing=(1.0, 1.0)):
    i, j = ((np.arange(n) - (n - 1) / 2) * d - c for c, d in zip(centre, spacing, strict=True))
    return -(i[:, None] ** 2 / radii[0] + j[None, :] ** 2 / radii[1]) / 2.0


def shifted(n, radius, count=8):
    """Radii within a tenth of one, and places within a cell."""
    rng = np.random.default_rng(n)
    for _ in range(count):
        yield radius * (1.0 + 0.1 * (2.0 * rng.random() - 1.0)), rng.random(2) - 0.5


def solver(n):
    """log load, heights (n, n) -> area [cells]."""
    grid = jc.Grid.square(n, float(n))
    kernels = jc.kernels(BODY, jc.HeightField(jnp.zeros((n, n))), grid)

    def area(log_load, heights):
        load, indenter = jc.Load(jnp.exp(log_load)), jc.HeightField(heights)
        history = jc.indent(BODY, indenter, load, [0.0], grid=grid, tolerance=1e-10, kernels=kernels)
        return history.smooth_area[0]

    return area


@pytest.mark.slow
@pytest.mark.parametrize(("n", "radius", "cells"), [
    pytest.param(12, 1.5, 0.07, marks=pytest.mark.slow), (12, 2.5, 0.03),
    pytest.param(24, 5.0, 0.008, marks=pytest.mark.long),
    pytest.param(48, 10.0, 0.005, marks=pytest.mark.slow), pytest.param(96, 20.0, 0.0025, marks=pytest.mark.long),
])  # fmt: skip
def test_hertz_at_random_places_on_the_grid(n, radius, cells):
    """W = 4 E a^3/(3 R): the error of the radius, in cells, decreases with the size of the cells."""
    area = jax.jit(solver(n))
    for a, centre in shifted(n, radius):
        found = area(np.log(4.0 / 3.0 * E * a**3 / 1e3), jnp.asarray(paraboloid(n, centre, (1e3, 1e3))))
        assert float(jnp.sqrt(found / jnp.pi)) == pytest.approx(a, abs=cells)


@pytest.mark.long
@pytest.mark.parametrize(("n", "radius", "mean", "spread"), [
    (12, 2.5, 0.04, 0.1), pytest.param(24, 5.0, 0.015, 0.025, marks=pytest.mark.long), (48, 10.0, 0.004, 0.008),
    pytest.param(96, 20.0, 0.001, 0.0025, marks=pytest.mark.long),
])  # fmt: skip
def test_the_slope_of_hertz_at_random_places_on_the_grid(n, radius, mean, spread):
    """dA/d log W = 2/3 A: the mean and root-mean-square error of the slope fall to a third with half the cell, and a step
    of 2 % in the load, over which cells enter, gives the same mean."""
    slope, area = jax.jit(jax.value_and_grad(solver(n))), jax.jit(solver(n))
    errors, steps = [], []
    for a, centre in shifted(n, radius):
        heights, at = jnp.asarray(paraboloid(n, centre, (1e3, 1e3))), np.log(4.0 / 3.0 * E * a**3 / 1e3)
        exact = 2.0 / 3.0 * np.pi * a**2
        errors.append(float(slope(at, heights)[1]) / exact - 1.0)
        steps.append(float(area(at + 0.01, heights) - area(at - 0.01, heights)) / 0.02 / exact - 1.0)
    for found in (errors, steps):
        assert abs(np.mean(found)) < mean
        assert np.sqrt(np.mean(np.square(found))) < spread


@pytest.mark.slow
@pytest.mark.parametrize("spacing", [(1.0, 1.0), (1.0, 1.6)])
def test_an_elliptical_contact_is_that_of_hertz(spacing):
    """K. L. Johnson, Contact Mechanics (1985), Eqs. (4.26) to (4.28), semi-axes a = 9 m and b = 5 m."""
    a, b, n = 9.0, 5.0, 30
    m = 1.0 - (b / a) ** 2
    A = b / (a**2 * m) * (ellipk(m) - ellipe(m))
    B = b / (a**2 * m) * ((a / b) ** 2 * ellipe(m) - ellipk(m))
    pressure = 0.01 * E  # p0
    heights = paraboloid(n, (0.21, -0.37), (0.5 * E / (A * pressure), 0.5 * E / (B * pressure)), spacing)
    grid = jc.Grid(shape=(n, n), spacing=spacing)
    found = area_in_cells(heights, 2.0 / 3.0 * pressure * np.pi * a * b, grid) * spacing[0] * spacing[1]
    assert found == pytest.approx(np.pi * a * b, rel=0.01 * spacing[1])


@pytest.mark.slow
@pytest.mark.parametrize(
    "across", [7.0, *(pytest.param(ratio, marks=pytest.mark.long) for ratio in (1 / 7, 1 / 3, 1.5, 3.0))]
)
def test_hertz_at_random_places_on_cells_that_are_not_square(across):
    """W = 4 E a^3/(3 R) with 12 of the longer sides across: the mean error of the area, as on square cells, and that of its
    slope by the load, which is 2/3 of it."""
    sides = (1.0, across) if across > 1.0 else (1.0 / across, 1.0)
    shape = tuple(int(18 * max(sides) / side) // 2 * 2 for side in sides)
    grid, errors, slopes = jc.Grid(shape, sides), [], []
    kernels = jc.kernels(BODY, jc.HeightField(jnp.zeros(shape)), grid)

    def area(log_load, heights):
        load, indenter = jc.Load(jnp.exp(log_load)), jc.HeightField(heights)
        history = jc.indent(BODY, indenter, load, [0.0], grid=grid, tolerance=1e-10, kernels=kernels)
        return history.smooth_area[0]

    found, rng = jax.jit(jax.value_and_grad(area)), np.random.default_rng(5)
    for _ in range(6):
        a, centre = 6.0 * max(sides) * (0.9 + 0.2 * rng.random()), rng.random(2) - 0.5
        x, y = ((np.arange(n) - (n - 1) / 2 - c) * d for n, c, d in zip(shape, centre, sides, strict=True))
        heights = -(x[:, None] ** 2 + y[None, :] ** 2) / 2e3
        value, slope = found(np.log(4.0 / 3.0 * E * a**3 / 1e3), jnp.asarray(heights))
        errors.append(float(value) / (np.pi * a**2) - 1.0)
        slopes.append(float(slope) / (2.0 / 3.0 * np.pi * a**2) - 1.0)
    assert abs(np.mean(errors)) < 1e-3
    assert abs(np.mean(slopes)) < 0.01 and np.sqrt(np.mean(np.square(slopes))) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("n", [24, 48, 96])
def test_on_a_thin_film_the_radius_is_accurate_to_a_twelfth_of_a_cell(n):
    """A compressible film bonded to a rigid base, 1/500 of the contact radius thick: pressure in proportion to the depth,
    and a^2 = 2 R d (K. L. Johnson, Contact Mechanics, 1985, section 5.8). The error is of first order: see *Limitations*."""
    ball, a = jc.Sphere(1e-3), 1e-5
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e6, 0.3), 2e-3 * a)], substrate=None)
    for width in (3.0, 3.09, 3.21):
        history = jc.indent(body, ball, jc.Approach(a**2 / 2e-3), [0.0], grid=jc.Grid.square(n, width * a))
        assert not np.any(history.status)
        assert abs(float(history.contact_radius[0]) - a) < width * a / n / 12.0


@pytest.mark.slow
def test_sixteen_contacts_have_sixteen_times_the_area_of_hertz():
    """Paraboloids 16 cells apart with contacts of radius 3, on a periodic grid: the neighbours take little of the load."""
    tile = np.tile(paraboloid(16, (0.2, -0.3), (1e3, 1e3)), (4, 4))
    heights = np.maximum(tile, -(20.0**2) / 2e3)
    load = 4.0 / 3.0 * E * 3.0**3 / 1e3
    one = area_in_cells(heights[:16, :16], load, jc.Grid((16, 16), (1.0, 1.0), periodic=True))
    many = area_in_cells(heights, 16.0 * load, jc.Grid((64, 64), (1.0, 1.0), periodic=True))
    assert many == pytest.approx(16.0 * one, rel=4e-3)  # the compliance of a cell follows the grid
    assert one == pytest.approx(np.pi * 9.0, rel=0.04)


@pytest.mark.slow
def test_the_half_width_of_a_line_contact_moves_between_the_cells():
    """a^2 = 4 P' R/(pi E), for edges at five places within a cell."""
    grid = jc.Grid(shape=(32, 1), spacing=(1.0, 1.0), periodic=(False, True))
    for a in np.linspace(6.0, 7.0, 5):
        history = jc.indent(
            BODY, jc.Cylinder(1e3, 1.0), jc.Load(np.pi * E * a**2 / 4e3), [0.0], grid=grid, tolerance=1e-10
        )
        assert float(history.contact_radius[0]) == pytest.approx(a, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("load", [0.0015, 0.005])
def test_a_rough_contact_has_the_area_of_a_finer_grid(load):
    """Self-affine heights, band-limited, and the same waves on four times as many points: cells counted there, with the
    error of counting along the edge removed (V. A. Yastrebov et al., Tribol. Int. 114 (2017) 161)."""
    n, fine = 48, 192
    coarse = jc.Grid((n, n), (1.0, 1.0), periodic=True)
    heights = np.asarray(jc.self_affine(coarse, rms_slope=0.05, shortest=8.0, longest=24.0))
    waves = np.fft.fftshift(np.fft.fft2(heights))
    more = np.fft.ifft2(np.fft.ifftshift(np.pad(waves, (fine - n) // 2))).real * (fine / n) ** 2
    history = jc.indent(
        BODY, jc.HeightField(jnp.asarray(more)), jc.Load(load * E * n**2), [0.0],
        grid=jc.Grid((fine, fine), (n / fine, n / fine), periodic=True),
    )  # fmt: skip
    exact = float(jc.contact_statistics(history).corrected_fraction[0]) * n**2
    found = area_in_cells(heights, load * E * n**2, coarse)
    assert 0.02 < exact / n**2 < 0.4
    assert found == pytest.approx(exact, rel=0.015)


# memory ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_half_space_that_relaxes_under_a_held_approach_keeps_its_radius():
    """E. H. Lee and J. R. M. Radok, J. Appl. Mech. 27 (1960) 438: only the pressure relaxes, here to a twentieth."""
    film = jc.Burgers(G1=1e9, G2=0.1e9, eta1=100e9, eta2=1e9, nu=0.3)
    body, times = jc.LayeredHalfSpace([], film), np.append(0.0, np.geomspace(0.05, 600.0, 40))
    grid = jc.Grid.square(24, 240e-6)
    history = jc.indent(body, jc.Sphere(5e-3), jc.Approach(1.3e-6), times, grid=grid, substeps=4)
    assert float(history.load[-1]) < 0.06 * float(history.load[0])
    np.testing.assert_allclose(history.contact_radius, history.contact_radius[0], rtol=1e-6)
    assert float(history.contact_radius[0]) == pytest.approx(np.sqrt(5e-3 * 1.3e-6), abs=0.03 * 10e-6)


@pytest.mark.slow
def test_a_ball_pressed_and_withdrawn_on_a_half_space_that_creeps():
    """T. C. T. Ting, J. Appl. Mech. 33 (1966) 845, by ``reference.ting``: the radius while the contact grows, to 0.05 of a
    cell, and while it shrinks, to 0.25 of a cell."""
    solid = jc.StandardLinearSolid(G1=1e9, G2=0.3e9, eta2=3e9, nu=0.3)
    rate, peak, cell = 0.05e-6, 20.0, 10e-6
    depth = lambda t: rate * np.minimum(t, 2.0 * peak - t)
    speed = lambda t: np.where(t < peak, rate, -rate)
    times = np.linspace(0.0, 32.0, 65)
    control = jc.Approach(np.asarray(depth(times)))
    body, grid = jc.LayeredHalfSpace([], solid), jc.Grid.square(32, 32 * cell)
    history = jc.indent(body, jc.Sphere(5e-3), control, times, grid=grid, substeps=4)
    relaxation = lambda t: np.asarray(solid.relaxation(t))
    for i in range(16, 57, 8):
        exact = ting.contact_radius(times[i], relaxation, depth, speed, peak, 5e-3)
        bound = 0.05 if times[i] <= peak else 0.25
        assert float(history.contact_radius[i]) == pytest.approx(exact, abs=bound * cell), times[i]


# no load ---------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("indenter", [jc.Sphere(5e-3), jc.Cone(1.4)])
def test_the_approach_at_first_touch_is_zero_with_zero_gradient(indenter):
    """Its lowest point lies between the centres of cells on an even grid."""
    grid, body = jc.Grid.square(8, 80e-6), jc.LayeredHalfSpace([], jc.Elastic(1e9, 0.3))

    def approach(scale):
        turned = jax.tree.map(lambda leaf: leaf * scale, indenter)
        return jc.indent(body, turned, jc.Load(jnp.array([0.0, 1e-3])), [0.0, 1.0], grid=grid).approach

    (first, loaded), (slope, _) = jax.jvp(approach, (1.0,), (1.0,))
    assert float(first) == 0.0 and float(loaded) > 0.0
    assert float(slope) == 0.0


@pytest.mark.slow
def test_first_touch_of_sampled_heights_is_at_the_highest_of_them():
    """The approach at which a surface of given samples bears nothing, as the limit of small loads."""
    rng, grid = np.random.default_rng(3), jc.Grid.square(8, 8.0)
    heights = jc.HeightField(jnp.asarray(1e-3 * rng.random((8, 8)) + 0.5))
    history = jc.indent(BODY, heights, jc.Load(jnp.array([0.0, 1e-9, 1e-3])), [0.0, 1.0, 2.0], grid=grid)
    first, small, _ = np.asarray(history.approach)
    assert first == 0.0
    assert 0.0 < small < 1e-8
