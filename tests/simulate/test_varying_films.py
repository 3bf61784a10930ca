"""Films whose thickness varies in the plane: reciprocity, finite elements, limits, growth, derivatives, messages."""

import fem_film
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact._support.pytree import as_float64
from jaxcontact.operators.kernels import build_varying

pytestmark = pytest.mark.filterwarnings("ignore:only", "ignore:film strain")
BASE = jc.Elastic(G=80e9, nu=0.3)
FILM = jc.StandardLinearSolid(G1=1e9, G2=5e8, eta2=1e10, nu=0.35)
GRIDS = {
    "free": jc.Grid.square(16, 80e-6),
    "periodic": jc.Grid((16, 12), (3e-6, 3e-6), periodic=True),
    "strip": jc.Grid((16, 12), (3e-6, 3e-6), periodic=(False, True)),
    "plane strain": jc.Grid((24, 1), (3e-6, 3e-6), periodic=(False, True)),
    "periodic plane strain": jc.Grid((24, 1), (3e-6, 3e-6), periodic=True),
}
TIMES = np.linspace(0.0, 40.0, 5)


def wavy(grid, mean=5e-7, part=0.5):
    """A thickness (nx, ny) that varies along both axes."""
    x, y = (np.asarray(a) for a in grid.coordinates())
    waves = np.cos(2 * np.pi * x / grid.width[0]) * np.cos(2 * np.pi * y / grid.width[1] + 0.4)
    return mean * (1.0 + part * waves)


def press(thickness, grid, film=FILM, base=BASE, times=TIMES, load=None, **options):
    ball = jc.Cylinder(1e-3, length=1e-2) if grid.plane_strain else jc.Sphere(1e-3)
    control = load or jc.Load(0.01 if grid.plane_strain else 0.3)
    body = jc.LayeredHalfSpace([jc.Layer(film, thickness)], base)
    return jc.indent(body, ball, control, times, grid=grid, tolerance=1e-11, **options)


def operator_of(grid, thickness, film, base, terms=4):
    """The elastic operator [m/Pa] of a film of varying thickness under a rigid indenter."""
    body = jc.LayeredHalfSpace((jc.Layer(film, float(np.max(thickness)) or 1e-6),), base)
    given = as_float64((body, jc.HeightField(np.zeros(grid.shape)), grid, thickness))
    kernels = build_varying(*given, terms=terms)
    here, scale = kernels.at(jnp.asarray(thickness)), kernels.scale
    operator = here.family.combined([1.0, *np.zeros(len(here.mix))])
    return lambda p: np.asarray(operator(jnp.asarray(p))) * float(scale.compliance * scale.length), kernels


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name in ("free", "periodic plane strain") else pytest.mark.slow)
        for name in GRIDS
    ],
)
def test_reciprocity(name):
    grid = GRIDS[name]
    apply, _ = operator_of(grid, wavy(grid), FILM, BASE)
    p, q = np.random.default_rng(0).random((2, *grid.shape))
    assert np.sum(q * apply(p)) == pytest.approx(np.sum(p * apply(q)), rel=1e-12)


@pytest.mark.filterwarnings("ignore:the time steps have an estimated error")  # which both runs share
@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long if name != "free" else ()) for name in GRIDS]
)
def test_a_uniform_map_is_the_layer(name):
    """Held, and over times; the pressure, the displacement, the approach and the film's strain."""
    grid = GRIDS[name]
    layer = press(5e-7, grid)
    for shape in (grid.shape, (5, *grid.shape)):
        varying = press(np.full(shape, 5e-7), grid)
        for field in ("pressure", "displacement", "approach", "film_strain", "smooth_area"):
            expected = np.asarray(getattr(layer, field))
            np.testing.assert_allclose(
                getattr(varying, field),
                expected,
                rtol=1e-6,
                atol=1e-6 * np.abs(expected).max(),
                err_msg=field,
            )


# film over base modulus, mean thickness and waves in a period, slope, largest error in parts of the range of displacement:
# theory's figures for the symmetrised operator
FEM = [
    (0.1, 0.02, 1, 0.0009),
    (0.1, 0.05, 1, 0.0057),
    (0.1, 0.1, 1, 0.014),
    (0.1, 0.05, 4, 0.051),
    (10.0, 0.02, 1, 0.0028),
    (10.0, 0.05, 1, 0.0084),
    (10.0, 0.1, 1, 0.052),
    (10.0, 0.05, 4, 0.109),
]
PERIODIC = jc.Grid((128, 1), (1 / 128, 1 / 128), periodic=True)
X = np.arange(128) / 128
# where the thickness is steepest
GAUSSIAN = lambda x: np.exp(-((((x) + 0.25) % 1 - 0.5) ** 2) / (2 * 0.08**2))


def against_fem(film, mean, waves):
    """The largest error, and that of a film of the mean thickness, in parts of the range of the displacement."""
    thickness = lambda x: mean * (1 + 0.5 * np.cos(2 * np.pi * waves * x))
    exact = fem_film.surface_displacement(thickness, GAUSSIAN, (film, 0.35), (1.0, 0.3), X)
    found = []
    for h in (thickness(X), np.full(128, mean)):
        apply, _ = operator_of(PERIODIC, h[:, None], jc.Elastic(film, 0.35), jc.Elastic(1.0, 0.3), terms=6)
        off = apply(GAUSSIAN(X)[:, None])[:, 0] - exact
        found.append(np.abs(off - off.mean()).max() / np.ptp(exact))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("film, mean, waves, error", FEM)
def test_against_finite_elements(film, mean, waves, error):
    pytest.importorskip("skfem")
    varying, uniform = against_fem(film, mean, waves)
    print(f"{film} {mean} {waves}: {varying:.4f}, uniform {uniform:.3f}")
    assert varying < 1.2 * error
    assert waves > 1 or varying < 0.4 * uniform, "a film of one thickness is nearly as good"


@pytest.mark.slow
def test_a_viscoelastic_film_is_the_elastic_one_of_its_short_and_long_times():
    """By the operator after a step of pressure: instantaneous, with ten times the modulus of the base, and after 1e6
    relaxation times, with a tenth; against elastic films, and against finite elements as in ``FEM``."""
    pytest.importorskip("skfem")
    wave, base = lambda x: 0.05 * (1 + 0.5 * np.cos(2 * np.pi * x)), jc.Elastic(1.0, 0.3)
    thickness, p = wave(X)[:, None], GAUSSIAN(X)[:, None]
    film = jc.StandardLinearSolid(G1=10.0, G2=1.0 / 9.9, eta2=1.0, nu=0.35)
    body = jc.LayeredHalfSpace((jc.Layer(film, 0.075),), base)
    given = as_float64((body, jc.HeightField(np.zeros(PERIODIC.shape)), PERIODIC, thickness))
    kernels = build_varying(*given, terms=6)
    here, unit = (
        kernels.at(jnp.asarray(thickness)),
        kernels.scale.compliance * kernels.scale.length,
    )
    late = here.mix @ jnp.where(here.rates > 0.0, 1.0 / here.rates, 0.0)
    for weights, G, error in ((np.zeros(len(here.mix)), 10.0, 0.0084), (late, 0.1, 0.0057)):
        operator = here.family.combined([1.0, *weights])
        found = lambda p, operator=operator: np.asarray(operator(jnp.asarray(p))) * float(unit)
        varying = p - p.mean()  # what a mean pressure shears between film and base is that of the short time
        expected = operator_of(PERIODIC, thickness, jc.Elastic(G, 0.35), base, terms=6)[0](varying)
        np.testing.assert_allclose(found(varying), expected, atol=1e-4 * np.ptp(expected))
        exact = fem_film.surface_displacement(wave, GAUSSIAN, (G, 0.35), (1.0, 0.3), X)
        off = found(p)[:, 0] - exact
        assert np.abs(off - off.mean()).max() < 1.2 * error * np.ptp(exact)


@pytest.mark.slow
def test_a_patchy_film_is_the_bare_base_and_the_whole_film_far_from_its_edges():
    """Two balls on a periodic body, one on a patch and one beside it, against one of each kind on its own."""
    grid = jc.Grid((64, 1), (2e-6, 1e-3), periodic=True)
    x = np.asarray(grid.coordinates()[0])
    stripe = np.where(x < 0.0, 2e-7, 0.0)
    pressure = np.exp(-(((x - 32e-6) / 6e-6) ** 2)) + np.exp(-(((x + 32e-6) / 6e-6) ** 2))
    found = [
        operator_of(grid, h, FILM, BASE)[0](pressure)[:, 0]
        for h in (stripe, 0.0 * stripe, 2e-7 + 0.0 * stripe)
    ]
    patchy, bare, whole = (u - u.mean() for u in found)
    bare_there, film_there = np.abs(x[:, 0] - 32e-6) < 15e-6, np.abs(x[:, 0] + 32e-6) < 15e-6
    lift = lambda u, v, mask: np.ptp((u - v)[mask]) / np.ptp(whole)
    assert lift(patchy, bare, bare_there) < 0.01 and lift(patchy, whole, film_there) < 0.01
    assert lift(patchy, whole, bare_there) > 0.2


@pytest.mark.slow
def test_no_film_at_all_is_the_bare_base():
    grid = GRIDS["free"]
    bare = jc.indent(
        jc.LayeredHalfSpace([], BASE), jc.Sphere(1e-3), jc.Load(0.3), TIMES[:1], grid=grid, tolerance=1e-11
    )
    none = press(np.zeros(grid.shape), grid, times=TIMES[:1])
    np.testing.assert_allclose(none.pressure, bare.pressure, atol=1e-6 * bare.pressure.max())


@pytest.mark.long
def test_the_pressure_converges_with_the_grid():
    """Of a flat punch in full contact with a wavy film, which no edge of contact makes rough; on a periodic grid."""

    def squares(n):
        grid = jc.Grid((n, 1), (96e-6 / n, 1e-3), periodic=True)
        x = np.asarray(grid.coordinates()[0])
        thickness = 2e-6 * (1 + 0.5 * np.cos(2 * np.pi * x / 48e-6))
        body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(5e9, 0.35), thickness)], BASE)
        punch = jc.HeightField(np.zeros(grid.shape))
        run = jc.indent(body, punch, jc.Load(2000.0), TIMES[:1], grid=grid, tolerance=1e-11)
        assert np.all(run.pressure > 0.0)
        return float(jnp.mean(run.pressure**2))

    coarse, middle, fine = (squares(n) for n in (16, 32, 64))
    assert abs(middle - fine) < 1e-3 * fine and abs(middle - fine) < 0.1 * abs(coarse - middle)


@pytest.mark.long
def test_relief_enters_the_gap_and_growth_raises_the_surface():
    """A film that grows uniformly is that of (nt,), but for the approach; the first touch is that of the relief."""
    grid, growing = GRIDS["free"], np.linspace(5e-7, 8e-7, 5)
    alike, varying = press(growing, grid), press(growing[:, None, None] * np.ones(grid.shape), grid)
    np.testing.assert_allclose(varying.pressure, alike.pressure, atol=2e-5 * alike.pressure.max())
    np.testing.assert_allclose(varying.approach, alike.approach - (growing - growing[0]), rtol=1e-5)
    np.testing.assert_allclose(varying.gap, alike.gap, atol=1e-5 * np.ptp(alike.gap))
    bump = wavy(grid)
    touch = press(bump, grid, times=TIMES[:1], load=jc.Approach(0.0))
    ball = np.asarray(jc.Sphere(1e-3).profile(grid))
    lowest = (ball - bump).min()
    np.testing.assert_allclose(touch.gap[0], ball - bump - lowest + ball.min(), atol=1e-15)


@pytest.mark.long
@pytest.mark.parametrize("over_times", [False, True])
def test_derivatives_by_the_map(over_times):
    """Along a direction in the space of maps: forward, reverse, central differences."""
    grid = GRIDS["plane strain"]
    shape = (5, *grid.shape) if over_times else grid.shape
    grows = np.linspace(1.0, 1.4, 5)[:, None, None] if over_times else 1.0
    change = 1e-7 * np.random.default_rng(1).random(shape)

    first = grows * wavy(grid)

    def found(share):
        run = press(first + share * change, grid)
        return jnp.stack([jnp.sum(run.pressure[-1] ** 2) * 1e-14, run.approach[-1] * 1e7])

    run = jax.jit(found)
    forward, reverse = jax.jit(jax.jacfwd(found))(0.0), jax.jit(jax.jacrev(found))(0.0)
    np.testing.assert_allclose(reverse, forward, rtol=1e-7)
    np.testing.assert_allclose(forward, (run(1e-3) - run(-1e-3)) / 2e-3, rtol=1e-4)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:.*fewer than 3 cells", "ignore:the series")
def test_a_note_tells_of_a_steep_film():
    grid = GRIDS["plane strain"]
    steep = wavy(grid, mean=6e-6)
    with pytest.warns(UserWarning, match="thickness varies with a slope of 0.2[0-9]: above 0.2"):
        press(steep, grid, times=TIMES[:1], film=jc.Elastic(1e9, 0.3))
    with pytest.warns(UserWarning, match="above 0.1 the error of the displacement of a stiff film"):
        press(steep / 2, grid, times=TIMES[:1], film=jc.Elastic(200e9, 0.3))
