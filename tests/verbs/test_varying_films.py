"""Films whose thickness varies in the plane: reciprocity, finite elements, limits, growth, derivatives, messages."""

import fem_film
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact._support.pytree import as_float64
from jaxcontact.operators.thickness_kernels import compiled_varying

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
    body = jc.LayeredHalfSpace((jc.Layer(film, float(np.max(thickness))),), base)
    given = as_float64((body, jc.HeightField(np.zeros(grid.shape)), grid, thickness))
    kernels = compiled_varying(*given, terms=terms)
    here, scale = kernels.at(jnp.asarray(thickness)), kernels.uniform.scale
    operator = here.family.combined([1.0, *np.zeros(len(here.mix))])
    return lambda p: np.asarray(operator(jnp.asarray(p))) * float(scale.compliance * scale.length), kernels


@pytest.mark.parametrize("name", GRIDS)
def test_reciprocity(name):
    grid = GRIDS[name]
    apply, _ = operator_of(grid, wavy(grid), FILM, BASE)
    p, q = np.random.default_rng(0).random((2, *grid.shape))
    assert np.sum(q * apply(p)) == pytest.approx(np.sum(p * apply(q)), rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", GRIDS)
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
GAUSSIAN = lambda x: np.exp(
    -((((x) + 0.25) % 1 - 0.5) ** 2) / (2 * 0.08**2)
)  # where the thickness is steepest


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
