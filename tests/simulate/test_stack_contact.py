"""Contact on several layers and on substrates that creep, against axisymmetric solutions from interface conditions."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bodies import FILM, STEEL
from tolerances import APPROACH, PEAK

import jaxcontact as jc
from jaxcontact.reference import abel
from jaxcontact.shell.case_file import case_text, read_case

RADIUS, A = 10e-3, 100e-6  # of the ball and of the contact [m]
BALL = jc.Sphere(RADIUS)
SOFT = jc.StandardLinearSolid(G1=2e9, G2=1e9, eta2=4e11, nu=0.4)

ELASTIC = {  # moduli [Pa] and nu of the layers and the half-space, thicknesses over the contact's radius
    "hard on soft on hard": ([100e9, 1e9, 80e9], [0.2, 0.45, 0.3], [0.1, 0.5]),
    "soft on hard on soft": ([1e9, 100e9, 3e9], [0.3, 0.2, 0.4], [0.3, 0.02]),
    "three, thin below thick": ([10e9, 1e8, 5e9, 80e9], [0.3, 0.5, 0.25, 0.3], [1.0, 0.01, 0.2]),
}


FILMS = [jc.LayeredHalfSpace([jc.Layer(FILM, 150e-9 / n)] * n, STEEL) for n in (1, 3)]


def body_of(solids, thicknesses):
    layers = [jc.Layer(solid, h) for solid, h in zip(solids, thicknesses, strict=False)]
    return jc.LayeredHalfSpace(layers, solids[-1])


@pytest.mark.slow
@pytest.mark.parametrize("name", ELASTIC)
def test_elastic_stacks_against_the_axisymmetric_solution(name):
    """Approach, peak and radius under the load of a contact of known radius."""
    moduli, poissons, thicknesses = (np.array(part) for part in ELASTIC[name])
    oracle = abel.solve_radius(A, abel.LayerStack(moduli, poissons, thicknesses * A), RADIUS)
    solids = [jc.Elastic(*each) for each in zip(moduli, poissons, strict=True)]
    run = jc.indent(
        body_of(solids, thicknesses * A), BALL, jc.Load(oracle.load), [0.0], grid=jc.Grid.square(96, 2.6 * A)
    )
    assert float(run.approach[0]) == pytest.approx(oracle.approach, rel=APPROACH)
    assert float(run.pressure.max()) == pytest.approx(float(abel.pressure(0.0, oracle)[0]), rel=2 * PEAK)
    assert float(run.contact_radius[0]) == pytest.approx(A, rel=1.5e-2)


CREEPING = {
    "film on a creeping substrate": ([FILM, SOFT], [0.3]),
    "elastic film on a creeping substrate": ([jc.Elastic(5e9, 0.2), SOFT], [0.2]),
    "creeping film on a soft layer on steel": ([FILM, SOFT, STEEL], [0.2, 0.4]),
}


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:film strain")
@pytest.mark.parametrize("name", CREEPING)
def test_growing_contact_on_creeping_stacks_against_the_axisymmetric_march(name):
    """A step load for 600 s, 24 steps of both; the march's own error is 1e-4."""
    solids, thicknesses = CREEPING[name][0], np.array(CREEPING[name][1]) * A
    at = lambda s: np.array([complex(s / solid.spectrum().transform(s)) for solid in solids])
    moduli = lambda s: at(s) if np.iscomplexobj(s) else at(s + 0j).real
    pile = abel.LayerStack(moduli(1.0), np.array([float(solid.nu) for solid in solids]), thicknesses)
    contacts = abel.march_step_load(1.0, 600.0, 24, pile, moduli, RADIUS, modes=24)
    times, width = jnp.linspace(0.0, 600.0, 25), 2.8 * contacts[-1].radius
    run = jc.indent(body_of(solids, thicknesses), BALL, jc.Load(1.0), times, grid=jc.Grid.square(96, width))
    for i in (0, 6, 24):
        assert float(run.approach[i]) == pytest.approx(contacts[i].approach, rel=2 * APPROACH)
        assert float(run.contact_radius[i]) == pytest.approx(contacts[i].radius, rel=2e-2)


def agree(stack, single, rtol):
    """Approach, shortening of the film and pressure, relative to the largest."""
    for name in ("approach", "film_strain"):
        np.testing.assert_allclose(getattr(stack, name), getattr(single, name), rtol=rtol)
    np.testing.assert_allclose(stack.pressure, single.pressure, atol=rtol * float(single.pressure.max()))


@pytest.mark.slow
@pytest.mark.filterwarnings(
    "ignore:film strain", "ignore:only", "ignore:the time steps have an estimated error"
)
def test_a_film_as_three_equal_layers_is_the_film():
    """Pressed for two hours: to the error of the shared rates."""
    grid, times, ball = jc.Grid.square(32, 620e-6), jnp.linspace(0.0, 7200.0, 4), jc.Sphere(9.525e-3, STEEL)
    single, stack = (jc.indent(body, ball, jc.Load(60.0), times, grid=grid) for body in FILMS)
    agree(stack, single, 1e-6)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:film strain", "ignore:only")
def test_a_film_as_three_equal_layers_slides_as_the_film():
    grid, ball = jc.Grid.square(32, 620e-6), jc.Sphere(9.525e-3, STEEL)
    given = ball, jc.Load(60.0)
    single, stack = (
        jc.slide_steady(body, *given, velocity=1e-6, grid=grid, tolerance=1e-9) for body in FILMS
    )
    agree(stack, single, 1e-6)
    assert float(stack.tangential_force) == pytest.approx(float(single.tangential_force), rel=1e-5)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:film strain", "ignore:only")
def test_layers_of_the_substrates_own_material_slide_as_the_half_space():
    """A half-space that creeps, as two layers on itself: pressed, slid over and in steady sliding."""
    grid, times = jc.Grid.square(32, 4.0 * A), jnp.linspace(0.0, 400.0, 5)
    bodies = (
        jc.LayeredHalfSpace([], SOFT),
        jc.LayeredHalfSpace([jc.Layer(SOFT, 30e-6), jc.Layer(SOFT, 20e-6)], SOFT),
    )
    marched = [jc.slide(body, BALL, jc.Load(0.1), times, velocity=1e-7, grid=grid) for body in bodies]
    steady = [jc.slide_steady(body, BALL, jc.Load(0.1), velocity=1e-7, grid=grid) for body in bodies]
    for single, stack in (marched, steady):
        np.testing.assert_allclose(stack.approach, single.approach, rtol=2e-6)
        np.testing.assert_allclose(stack.tangential_force, single.tangential_force, rtol=2e-5, atol=1e-9)


CASE = """
[[layer]]
material = "maxwell"
G = 1e9
eta = 1e12
bulk_modulus = 5e9
thickness = 50e-9
[[layer]]
material = "elastic"
G = 2e9
thickness = 100e-9
[substrate]
material = "maxwell"
G = 1e10
eta = 1e14
[indenter]
shape = "sphere"
radius = 10e-3
[control]
load = 1.0
[times]
end = 60.0
steps = 3
[grid]
width = 100e-6
"""


def test_a_case_file_lists_its_layers_from_the_top_down(tmp_path):
    """And the case as text reads back as the same body."""
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    case = read_case(path)
    layers = [jc.Layer(jc.Maxwell(1e9, 1e12, bulk_modulus=5e9), 50e-9), jc.Layer(jc.Elastic(2e9), 100e-9)]
    assert case.body == jc.LayeredHalfSpace(layers, jc.Maxwell(1e10, 1e14))
    path.write_text(case_text(case))
    assert read_case(path).body == case.body


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:only", "ignore:film strain")
def test_derivatives_by_every_parameter_of_every_solid():
    """Reverse mode against central differences: two layers that creep on a half-space that creeps, pressed for 600 s."""
    solids = [jc.Maxwell(2e9, 4e12, 0.3), jc.StandardLinearSolid(1e9, 1e9, 3e11, 0.45), SOFT]
    body = body_of(solids, np.array([20e-6, 30e-6]))
    leaves, structure = jax.tree.flatten(body)
    grid, times = jc.Grid.square(16, 3.6 * A), jnp.array([0.0, 300.0, 600.0])

    @jax.jit
    def approach(logs):
        moved = jax.tree.unflatten(structure, [a * jnp.exp(q) for a, q in zip(leaves, logs, strict=True)])
        run = jc.indent(moved, BALL, jc.Load(0.5), times, grid=grid, tolerance=1e-12, save="last")
        return jnp.log(run.approach[-1])

    ours, step = jax.jit(jax.grad(approach))(jnp.zeros(len(leaves))), 1e-3
    central = [(approach(step * e) - approach(-step * e)) / (2 * step) for e in jnp.eye(len(leaves))]
    np.testing.assert_allclose(ours, central, rtol=2e-3, atol=2e-5)
    assert np.all(np.abs(ours) > 1e-4)
