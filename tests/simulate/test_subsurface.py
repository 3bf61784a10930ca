"""Below the surface: Hertz on the axis, a pavement, and the field equations themselves by differences."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.response.interior import kernels_at_lags, lags_before_the_last, transfer
from jaxcontact.simulate.subsurface import _fields


def disc(grid, radius, profile, parts=12):
    """Means over the cells of a round load of total 1, by subdivision."""
    x, y = (np.asarray(a) for a in grid.coordinates())
    steps = ((np.arange(parts) - (parts - 1) / 2) / parts)[:, None, None, None] * np.asarray(grid.spacing[0])
    r = np.hypot(x + steps, y + np.swapaxes(steps, 0, 1)) / radius
    mean = np.mean(np.where(r < 1.0, profile(r), 0.0), (0, 1))
    return mean / (np.sum(mean) * float(grid.cell_area))


@pytest.mark.slow
def test_hertz_on_the_axis():
    """K. L. Johnson, Contact Mechanics, Eqs. 3.45: within 0.5 % of the peak; the largest shear 0.48 a deep."""
    grid, nu, z = jc.Grid.square(65, 2.4), 0.3, np.array([0.0, 0.1, 0.3, 0.48, 1.0, 2.0])
    p = disc(grid, 1.0, lambda r: np.sqrt(1.0 - np.minimum(r, 1.0) ** 2)) * 2.0 / 3.0 * np.pi
    inside = jc.subsurface(jc.LayeredHalfSpace([], jc.Elastic(1.0, nu)), grid, p, depths=z)
    stress = np.asarray(inside.stress)[..., 32, 32]
    down = -1.0 / (1.0 + z**2)
    around = -(1.0 + nu) * (1.0 - z * np.arctan2(1.0, z)) - 0.5 * down
    np.testing.assert_allclose(stress[:, 2, 2], down, atol=5e-3)
    np.testing.assert_allclose(stress[:, 0, 0], around, atol=5e-3)
    np.testing.assert_allclose(stress[:, 1, 1], around, atol=5e-3)
    np.testing.assert_allclose(stress[:, [0, 0, 1], [1, 2, 2]], 0.0, atol=1e-12)
    size, place = inside.peak
    assert float(size) == pytest.approx(0.620, abs=0.002)
    np.testing.assert_allclose(place, [0.0, 0.0, 0.48], atol=1e-12)
    assert float(inside.displacement[0, 2, 32, 32]) == pytest.approx(np.pi / 4 * 0.7, rel=5e-4)


@pytest.mark.slow
def test_three_layers_under_a_uniform_disc():
    """A pavement, 3000, 200 and 40 MPa under 1.1 MPa on a radius of 150 mm: 1.0508 mm at the centre."""
    grid = jc.Grid.square(65, 0.32)
    p = disc(grid, 0.15, np.ones_like) * 1.1e6 * np.pi * 0.15**2
    young = jc.Elastic.from_young
    layers = (jc.Layer(young(3000e6, 0.30), 0.15), jc.Layer(young(200e6, 0.35), 0.6))
    tractions = jnp.concatenate([jnp.zeros((2, 65, 65)), jnp.asarray(p)[None]])
    inside = _fields(jc.LayeredHalfSpace(layers, young(40e6, 0.4)), grid, tractions[None], jnp.zeros(1), None)
    assert float(inside.displacement[0, 2, 32, 32]) == pytest.approx(1.0508e-3, abs=5e-8)
    np.testing.assert_allclose(inside.interfaces, [0.15, 0.75])


H, SPACING = 0.6, 0.02
SOLIDS = {"film": jc.Elastic(5.0, 0.2), "base": jc.Elastic(1.0, 0.45)}


@functools.cache
def smooth():
    """A smooth load in all three directions on a layer, with neighbours in depth a cell apart, in film and base."""
    n = 48
    grid = jc.Grid.square(n, n * SPACING)
    x, y = (np.asarray(a) for a in grid.coordinates())
    hill = np.exp(-25.0 * (x**2 + y**2))
    tractions = np.array([(0.5 + x) * hill, (0.3 - y) * hill, (1.0 + x * y) * hill])
    return tractions, inside_of(SOLIDS["film"], SOLIDS["base"], tractions)


def inside_of(film, base, tractions, times=None):
    """Below tractions (3, n, n), or (nt, 3, n, n), on a film."""
    n = tractions.shape[-1]
    middles = np.array([0.2, 0.9])
    z = np.concatenate([middles - SPACING, middles, middles + SPACING, [0.0, H - 1e-9, H]])
    body, grid = jc.LayeredHalfSpace([jc.Layer(film, H)], base), jc.Grid.square(n, n * SPACING)
    return jc.subsurface(body, grid, tractions[..., 2, :, :], tractions[..., :2, :, :], depths=z, times=times)


def gradient(field):
    """d/dx_j of a field (3 depths, ..., nx, ny) at the middle depth, by central differences, j last."""
    along = [(np.roll(field[1], -1, a) - np.roll(field[1], 1, a)) / (2 * SPACING) for a in (-2, -1)]
    return np.stack([*along, (field[2] - field[0]) / (2 * SPACING)], -1)[..., 8:-8, 8:-8, :]


@pytest.mark.slow
@pytest.mark.parametrize(("solid", "at"), [("film", 0), ("base", 1)])
def test_equilibrium_and_hookes_law_by_differences(solid, at):
    """In film and base: div sigma = 0, and the stress is that of the strain of the displacement."""
    _, inside = smooth()
    stress, moved = (np.asarray(field)[at:6:2] for field in (inside.stress, inside.displacement))
    slopes = gradient(stress)
    assert np.max(np.abs(np.trace(slopes, axis1=1, axis2=-1))) < 0.01 * np.max(np.abs(slopes))
    strain = np.moveaxis(gradient(moved), -1, 1)
    strain = (strain + strain.swapaxes(0, 1)) / 2
    G, nu = SOLIDS[solid].G, SOLIDS[solid].nu
    dilation = np.trace(strain) * np.eye(3)[:, :, None, None]
    hooke = 2 * G * (strain + nu / (1 - 2 * nu) * dilation)
    there = stress[1][..., 8:-8, 8:-8]
    assert np.max(np.abs(hooke - there)) < 0.01 * np.max(np.abs(there))


@pytest.mark.slow
def test_tractions_on_the_surface_and_across_the_interface():
    """sigma_iz is minus the traction on the surface; it and the displacement go through the interface unbroken."""
    tractions, inside = smooth()
    stress, moved = np.asarray(inside.stress), np.asarray(inside.displacement)
    np.testing.assert_allclose(stress[6, :, 2], -tractions, atol=1e-6)
    np.testing.assert_allclose(stress[7, :, 2], stress[8, :, 2], atol=2e-6)
    np.testing.assert_allclose(moved[7], moved[8], atol=2e-6 * np.max(moved))
    assert np.max(np.abs(stress[7, 0, 0] - stress[8, 0, 0])) > 0.05  # along it the stress jumps
    np.testing.assert_array_equal(stress, np.swapaxes(stress, 1, 2))


FILM = jc.Burgers(G1=2.0, G2=1.0, eta1=20.0, eta2=1.5, nu=0.3)
BASE = jc.Burgers(G1=3.0, G2=2.0, eta1=50.0, eta2=1.0, nu=0.2)


def in_exponential_growth(solid, s):
    """The elastic solid whose compliance is s J(s): what a creeping one is under tractions that grow as exp(s t)."""
    soft = 1 / solid.G1 + 1 / (solid.eta1 * s) + 1 / (solid.G2 + solid.eta2 * s)
    return jc.Elastic(1 / soft, solid.nu)


def growing(s):
    """Times, and what rises as exp(s t) to 1 at the last of them, in 120 linear pieces."""
    times = np.append(0.0, 14 / s - np.append(np.geomspace(14 / s, 1e-3 / s, 120)[1:], 0.0))
    return times, np.exp(s * (times - times[-1]))


@pytest.mark.slow
def test_a_wave_of_growing_tractions_meets_an_elastic_body(s=0.5):
    """Of all that reaches a depth in the film or the substrate, both of which creep."""
    body = jc.LayeredHalfSpace([jc.Layer(FILM, H)], BASE)
    times, rise = growing(s)
    soft = 1 / np.array([[in_exponential_growth(solid, s).G] for solid in (FILM, BASE)])
    alpha = jnp.linspace(0.0, 5.0, 50)
    for z in (0.2, 0.9):
        memory = jax.jit(kernels_at_lags)(body, alpha, z, lags_before_the_last(jnp.asarray(times)))
        ours = jnp.einsum("n,nm,fma->fa", np.diff(rise, prepend=0.0), memory.shares, memory.kernels)
        theirs = jnp.stack(transfer(body, alpha, z, soft))
        assert float(jnp.max(jnp.abs(ours - theirs) / jnp.max(jnp.abs(theirs), 1)[:, None])) < 5e-4


@pytest.mark.long
def test_under_growing_tractions_a_creeping_body_is_an_elastic_one(s=0.5):
    """All that is below the surface, of a film and a substrate that creep."""
    tractions, _ = smooth()
    times, rise = growing(s)
    inside = inside_of(FILM, BASE, rise[:, None, None, None] * tractions, times)
    expected = inside_of(in_exponential_growth(FILM, s), in_exponential_growth(BASE, s), tractions)
    at_first = inside_of(jc.Elastic(FILM.G1, FILM.nu), jc.Elastic(BASE.G1, BASE.nu), tractions)
    for name, tolerance, creep in (("stress", 2e-4, 0.01), ("displacement", 5e-4, 0.3)):
        ours, theirs, stiff = (np.asarray(getattr(each, name)) for each in (inside, expected, at_first))
        size = np.max(np.abs(theirs), (1, -1, -2), keepdims=True)
        assert np.max(np.abs(ours - theirs) / size) < tolerance
        assert np.max(np.abs(stiff - theirs) / size) > creep


@pytest.mark.long
def test_one_material_creeps_without_changing_its_stresses():
    """Layer and substrate of one material under a load that rises in a time: int J(T - t) dp/dt is in closed form."""
    tractions, _ = smooth()
    times = np.linspace(0.0, 1.5, 121)
    risen = (times / times[-1])[:, None, None, None] * tractions
    inside = inside_of(FILM, FILM, risen, times)
    elastic = inside_of(jc.Elastic(FILM.G1, FILM.nu), jc.Elastic(FILM.G1, FILM.nu), tractions)
    np.testing.assert_allclose(inside.stress, elastic.stress, atol=1e-6)
    x = FILM.G2 * times[-1] / FILM.eta2
    mean = 1 / FILM.G1 + (1 - (1 - np.exp(-x)) / x) / FILM.G2 + times[-1] / (2 * FILM.eta1)
    crept = np.asarray(elastic.displacement) * FILM.G1 * mean
    np.testing.assert_allclose(inside.displacement, crept, atol=3e-6 * np.max(crept))


@pytest.mark.slow
def test_surface_displacement_is_that_of_the_contact(steel):
    """At depth zero, of a coated body under the pressure of ``indent``."""
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9, 0.4), 50e-6)], steel)
    grid = jc.Grid.square(32, 500e-6)
    history = jc.indent(body, jc.Sphere(9.525e-3), jc.Load(10.0), [0.0], grid=grid)
    inside = jc.subsurface(body, grid, history.pressure[-1], depths=[0.0])
    ours, contacts = inside.displacement[0, 2], history.displacement[-1]
    np.testing.assert_allclose(ours, contacts, atol=1e-6 * float(np.max(contacts)))


SLS = jc.StandardLinearSolid(1e9, 1e9, 1e10, nu=0.4)
# body, times, and (J of G, nu) above and below the interface at 30 um; where film and base are of one material the stresses
# do not change under a constant load, so that the strain is that of J at the last time
STRAINED = {
    "half-space": (jc.LayeredHalfSpace([], jc.Elastic(1e9, 0.4)), None, [(1e-9, 0.4)] * 2),
    "elastic film": (
        jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9, 0.4), 30e-6)], jc.Elastic(20e9, 0.3)),
        None,
        [(1e-9, 0.4), (1 / 20e9, 0.3)],
    ),
    "film that creeps": (
        jc.LayeredHalfSpace([jc.Layer(SLS, 30e-6)], SLS),
        np.array([0.0, 5.0, 20.0]),
        [(1e-9 * (2.0 - np.exp(-2.0)), 0.4)] * 2,
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("name", STRAINED)
def test_the_derivative_of_the_displacement_by_depth_is_the_strain_of_hookes_law(name):
    """From the surface to below the film, in both modes, and by central differences inside each material."""
    body, times, solids = STRAINED[name]
    grid, z = jc.Grid.square(8, 160e-6), 30e-6 * np.array([0.0, 1e-6, 0.01, 0.033, 0.1, 0.2, 0.5, 0.97, 1.2])
    x, y = (np.asarray(a) for a in grid.coordinates())
    pressure = 1e7 * np.exp(-(x**2 + y**2) / (40e-6) ** 2) * (1.0 + x / 200e-6)
    traction = 0.3 * np.stack([pressure, np.zeros_like(pressure)])
    if times is not None:
        pressure, traction = (np.stack([f] * len(times)) for f in (pressure, traction))

    @jax.jit
    def fields(z):
        inside = jc.subsurface(body, grid, pressure, traction, depths=z, times=times)
        return inside.displacement, inside.stress

    (_, stress), (slope, of_stress) = jax.jvp(fields, (jnp.asarray(z),), (jnp.ones(z.size),))
    compliance, nu = (np.where(z < 30e-6, *pair) for pair in zip(*solids, strict=True))
    sxx, syy, szz = (np.asarray(stress)[:, i, i] for i in range(3))
    trace = (nu / (1 + nu))[:, None, None] * (sxx + syy + szz)
    strain = 0.5 * compliance[:, None, None] * (szz - trace)
    size = np.max(np.abs(strain), (1, 2))[:, None]
    found = np.asarray(slope)[:, 2]
    assert np.max(np.abs(found - strain).reshape(z.size, -1) / size) < 1e-5
    # equilibrium under a uniform traction in each cell: at the surface no derivative of sigma_zz by depth
    assert np.max(np.abs(of_stress[0, 2, 2])) < 1e-5 * np.max(np.abs(of_stress[:, 2, 2]))
    reverse = jax.jit(jax.grad(lambda z: jnp.sum(fields(z)[0][:, 2, 3, 4])))(jnp.asarray(z))
    np.testing.assert_allclose(reverse, found[:, 3, 4], rtol=1e-7)
    # by central differences, inside one material
    step = 1e-4 * z[2:]
    ahead, behind = (
        fields(jnp.asarray(np.append(z[:2], z[2:] + step))),
        fields(jnp.asarray(np.append(z[:2], z[2:] - step))),
    )
    for one, two, given in zip(ahead, behind, (slope, of_stress), strict=True):
        rate = np.asarray(one - two)[2:] / (2 * step).reshape(-1, *[1] * (one.ndim - 1))
        difference = np.max(np.abs(rate - np.asarray(given)[2:]).reshape(step.size, -1), 1)
        assert np.max(difference / np.max(np.abs(rate).reshape(step.size, -1), 1)) < 1e-5


def test_the_von_mises_stress_of_no_stress_has_a_derivative_of_zero():
    """And that of uniaxial stress is its size, with the derivative 1."""
    grid = jc.Grid((2, 1), (1e-6, 1e-6))
    stress = jnp.zeros((1, 3, 3, 2, 1)).at[0, 2, 2, 0, 0].set(-3e6)
    largest = lambda stress: jc.InteriorFields(grid, jnp.zeros(1), stress, jnp.zeros((1, 3, 2, 1))).von_mises
    np.testing.assert_allclose(largest(stress)[0, :, 0], [3e6, 0.0])
    for mode in (jax.jacfwd, jax.jacrev):
        slopes = mode(largest)(stress)[0, :, 0, 0]  # (2, 3, 3, 2, 1)
        assert not np.any(slopes[1])
        np.testing.assert_allclose(slopes[0, 2, 2, 0, 0], -1.0, rtol=1e-14)


@pytest.mark.slow
def test_the_derivative_by_a_shallow_depth_is_that_of_the_displacement():
    """At a thousandth of the height of the films; the images are chosen by the depth and must not move with it."""
    films = [jc.Layer(jc.Elastic(1e9, 0.4), 30e-6), jc.Layer(jc.Elastic(5e9, 0.3), 20e-6)]
    body = jc.LayeredHalfSpace(films, jc.Elastic.from_young(210e9, 0.3))
    grid = jc.Grid((15, 13), (13e-6, 15e-6))
    x, y = grid.coordinates()
    pressure = 1e7 * jnp.exp(-(x**2 + 0.5 * y**2) / (50e-6) ** 2)
    seen = jax.jit(lambda z: jc.subsurface(body, grid, pressure, depths=jnp.reshape(z, 1)).displacement[0])
    z, step = 0.1e-6, 1e-9
    slope = jax.jvp(seen, (z,), (1.0,))[1]
    difference = (seen(z + step) - seen(z - step)) / (2.0 * step)
    np.testing.assert_allclose(slope, difference, atol=2e-7 * float(jnp.max(jnp.abs(difference))))
