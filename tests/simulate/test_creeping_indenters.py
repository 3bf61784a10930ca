"""Indenters that creep or are coated: both surfaces of a contact with a memory of their own.

The oracles are rigid indenters on one body: two equal bodies have twice the compliance of one, and a surface a million times
as stiff as the other is rigid.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tolerances import MODES

import jaxcontact as jc

GRID = jc.Grid.square(n=16, width=2.2e-3)
# few cells and steps: both sides of a comparison have the same ones
pytestmark = pytest.mark.filterwarnings(
    "ignore:.*cells across", "ignore:.*time steps", "ignore:.*film strain"
)
TIMES = np.array([0.0, 0.0, 0.5, 2.0, 2.0, 6.0])
LOADS = jc.Load(np.array([0.0, 0.05, 0.05, 0.12, 0.03, 0.03]))
R = 5e-3


def solid(factor=1.0):
    return jc.StandardLinearSolid(G1=1e6 * factor, G2=5e5 * factor, eta2=4e5 * factor, nu=0.4)


def burgers(factor=1.0):
    return jc.Burgers(G1=2e6 * factor, G2=1e6 * factor, eta1=6e6 * factor, eta2=8e5 * factor, nu=0.35)


def coated(factor=1.0):
    film = jc.StandardLinearSolid(G1=2e6 * factor, G2=8e5 * factor, eta2=5e5 * factor, nu=0.45)
    base = jc.Elastic(G=5e6 * factor, nu=0.3)
    return jc.LayeredHalfSpace([jc.Layer(film, 1.5e-4)], base)


def as_body(material):
    return material if isinstance(material, jc.LayeredHalfSpace) else jc.LayeredHalfSpace([], material)


def close(found, expected, rtol):
    """Each quantity of two histories agrees, relative to its largest value."""
    for name in ("pressure", "displacement", "approach", "load", "smooth_area"):
        a, b = (np.asarray(getattr(each, name)) for each in (found, expected))
        np.testing.assert_allclose(a, b, rtol=0.0, atol=rtol * np.max(np.abs(b)), err_msg=name)


PATH = jc.Approach(np.array([0.0, 2e-5, 2e-5, 3e-5, 1.5e-5, 1.5e-5]))


@pytest.mark.slow
@pytest.mark.parametrize(
    "control", [LOADS, pytest.param(PATH, marks=pytest.mark.long)], ids=["load", "approach"]
)
def test_a_creeping_ball_on_a_stiff_base_is_a_rigid_ball_on_that_solid(control):
    base = jc.LayeredHalfSpace([], jc.Elastic(G=1e12, nu=0.4))
    found = jc.indent(base, jc.Sphere(R, solid()), control, TIMES, grid=GRID)
    expected = jc.indent(as_body(solid()), jc.Sphere(R), control, TIMES, grid=GRID)
    close(found, expected, 1e-4)
    close(found, expected, 3e-6)  # of the base there is a millionth
    assert np.max(np.abs(found.indenter_displacement - found.displacement)) < 1e-5 * np.max(
        found.displacement
    )


@pytest.mark.long
def test_a_rigid_ball_in_a_gel_on_a_stiff_flat_is_a_rigid_ball_on_that_gel_on_a_rigid_base():
    gel = jc.LayeredHalfSpace([jc.Layer(solid(), 4e-4)], None)
    base = jc.LayeredHalfSpace([], jc.Elastic(G=1e12, nu=0.4))
    found = jc.indent(base, jc.Sphere(R, gel), LOADS, TIMES, grid=GRID)
    close(found, jc.indent(gel, jc.Sphere(R), LOADS, TIMES, grid=GRID), 1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("material", [burgers, pytest.param(coated, marks=pytest.mark.long)])
def test_two_equal_bodies_are_one_of_half_the_moduli_under_a_rigid_ball(material):
    found = jc.indent(as_body(material()), jc.Sphere(R, material()), LOADS, TIMES, grid=GRID)
    expected = jc.indent(as_body(material(0.5)), jc.Sphere(R), LOADS, TIMES, grid=GRID)
    close(found, expected, 1e-6)
    np.testing.assert_allclose(found.indenter_displacement, found.displacement / 2.0, atol=1e-12)
    np.testing.assert_allclose(found.indenter_film_strain, found.film_strain, atol=1e-9)
    np.testing.assert_allclose(2.0 * found.film_strain, expected.film_strain, rtol=1e-6)
    np.testing.assert_allclose(found.time_step_error, expected.time_step_error, rtol=1e-5, atol=1e-12)


STEADY = jc.Load(0.05)


def maxwell():
    return jc.Maxwell(G=1e6, eta=1e6, nu=0.4)


@pytest.mark.long
@pytest.mark.parametrize("make", [solid, coated])
def test_slide_steady_of_a_creeping_ball_on_a_stiff_flat_is_hertz_with_the_relaxed_modulus(make):
    flat = jc.StandardLinearSolid(G1=1e12, G2=1e12, eta2=1e11, nu=0.4)
    found = jc.slide_steady(as_body(flat), jc.Sphere(R, make()), STEADY, velocity=1e-3, grid=GRID)
    expected = jc.slide_steady(as_body(make()), jc.Sphere(R), STEADY, velocity=0.0, grid=GRID)
    close(found, expected, 3e-6)
    np.testing.assert_allclose(found.indenter_film_strain, expected.film_strain, rtol=1e-5, atol=1e-12)
    assert 0.0 < abs(found.hysteresis_force) < 1e-6 * found.load
    assert abs(found.lateral_force[0]) < 1e-6 * found.load


@pytest.mark.slow
def test_slide_steady_of_a_creeping_ball_on_a_stiff_flat_converges_to_hertz():
    """Approach, radius and largest pressure of Hertz with the relaxed modulus, on 64 cells across 1.25 times the contact."""
    flat = jc.StandardLinearSolid(G1=1e12, G2=1e12, eta2=1e11, nu=0.4)
    G = 1e6 * 5e5 / 1.5e6
    a = (3.0 * 0.05 * R * 0.6 / (8.0 * G)) ** (1.0 / 3.0)
    grid = jc.Grid.square(n=64, width=2.5 * a)
    found = jc.slide_steady(as_body(flat), jc.Sphere(R, solid()), STEADY, velocity=1e-3, grid=grid)
    assert int(found.status) == 0
    np.testing.assert_allclose(found.approach, a**2 / R, rtol=1e-3)
    np.testing.assert_allclose(found.contact_radius, a, rtol=1e-3)
    np.testing.assert_allclose(found.peak_pressure, 1.5 * 0.05 / (np.pi * a**2), rtol=1e-3)
    assert 0.0 < abs(found.hysteresis_force) < 1e-6 * found.load
    assert abs(found.lateral_force[0]) < 1e-6 * found.load


@pytest.mark.slow
def test_slide_of_two_creeping_surfaces_tends_to_slide_steady():
    body, ball = as_body(solid(1.5)), jc.Sphere(R, solid())
    times = np.array([0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 12.0])
    end = jc.slide(body, ball, STEADY, times, velocity=2e-4, grid=GRID, substeps=4)
    steady = jc.slide_steady(body, ball, STEADY, velocity=2e-4, grid=GRID)
    np.testing.assert_allclose(end.pressure[-1], steady.pressure, atol=2e-3 * np.max(steady.pressure))
    np.testing.assert_allclose(
        end.indenter_displacement[-1], steady.indenter_displacement, atol=2e-3 * np.max(steady.displacement)
    )
    np.testing.assert_allclose(end.hysteresis_force[-1], steady.hysteresis_force, rtol=1e-2)
    # the force from slopes and the power from the dashpots agree within the error of the grid
    np.testing.assert_allclose(steady.hysteresis_force * 2e-4, steady.hysteresis_power, rtol=2e-2)


@pytest.mark.slow
def test_slide_of_a_creeping_ball_on_a_stiff_flat_is_its_indentation():
    flat = jc.StandardLinearSolid(G1=1e12, G2=1e12, eta2=1e11, nu=0.4)
    found = jc.slide(as_body(flat), jc.Sphere(R, solid()), LOADS, TIMES, velocity=1e-4, grid=GRID)
    expected = jc.indent(as_body(solid()), jc.Sphere(R), LOADS, TIMES, grid=GRID)
    close(found, expected, 1e-5)
    assert np.max(np.abs(found.hysteresis_force)) < 1e-6 * np.max(found.load)


# Coefficients of friction that are a number and a field. With 0.6 the pressure changes by a fifth.
MU = [0.6, 0.6 * np.linspace(0.5, 1.0, 256).reshape(GRID.shape)]
RUBBED = ("pressure", "displacement", "approach", "lateral_force", "hysteresis_force", "coulomb_force")


def alike(found, expected, rtol, names=RUBBED):
    for name in names:
        a, b = (np.asarray(getattr(each, name)) for each in (found, expected))
        np.testing.assert_allclose(a, b, rtol=0.0, atol=rtol * np.max(np.abs(b)), err_msg=name)


@pytest.mark.long
@pytest.mark.parametrize("friction", [MU[0], pytest.param(MU[1], marks=pytest.mark.long)])
def test_slide_steady_with_friction_of_a_ball_coated_with_its_own_material_is_that_of_the_elastic_ball(
    friction,
):
    """Askew, over a body that creeps and is dissimilar, whose hysteresis contains a part by the traction."""
    steel = jc.Elastic(G=1.2e6, nu=0.45)
    coat, body = jc.LayeredHalfSpace([jc.Layer(steel, 1.5e-4)], steel), as_body(solid(1.5))
    given = {"velocity": (1e-4, -2e-4), "grid": GRID, "friction": friction}
    found = jc.slide_steady(body, jc.Sphere(R, coat), STEADY, **given)
    alike(found, jc.slide_steady(body, jc.Sphere(R, steel), STEADY, **given), 1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("friction", [MU[0], pytest.param(MU[1], marks=pytest.mark.long)])
def test_slide_steady_with_friction_of_a_creeping_ball_is_that_of_a_ball_of_its_relaxed_modulus(friction):
    body, relaxed = as_body(solid(1.5)), jc.Elastic(G=1e6 * 5e5 / 1.5e6, nu=0.4)
    given = {"velocity": 2e-4, "grid": GRID, "friction": friction}
    found = jc.slide_steady(body, jc.Sphere(R, solid()), STEADY, **given)
    alike(found, jc.slide_steady(body, jc.Sphere(R, relaxed), STEADY, **given), 1e-10)


@pytest.mark.long
def test_friction_under_a_creeping_ball_on_a_stiff_flat_is_that_of_a_stiff_ball_which_moves_the_other_way():
    """The traction on the ball is the opposite of that on the flat. At a constant approach the pressure of a contact that
    does not change its size is G(t) times that of unit modulus (E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438),
    and the displacement by the traction, whatever the modulus, the same at all times."""
    flat, unit = as_body(jc.Elastic(G=1e13, nu=0.4)), as_body(jc.Elastic(G=1.0, nu=0.4))
    control, times, velocity = jc.Approach(2e-5), np.array([0.0, 0.25, 0.5, 1.0]), np.array([1e-4, -5e-5])
    given = {"grid": GRID, "friction": MU[0]}
    found = jc.slide(flat, jc.Sphere(R, solid()), control, times, velocity=velocity, substeps=16, **given)
    expected = jc.slide_steady(unit, jc.Sphere(R), control, velocity=-velocity, **given)
    for t, pressure, moved in zip(times, found.pressure, found.indenter_displacement, strict=True):
        size = np.max(expected.pressure)
        np.testing.assert_allclose(pressure / solid().relaxation(t), expected.pressure, atol=3e-4 * size)
        np.testing.assert_allclose(moved, expected.displacement, atol=3e-4 * np.max(expected.displacement))
    same = jc.slide_steady(unit, jc.Sphere(R), control, velocity=velocity, **given)
    assert np.max(np.abs(same.pressure - expected.pressure)) > 0.1 * np.max(same.pressure)


@pytest.mark.long
@pytest.mark.parametrize("friction", MU[:2])
def test_slide_with_friction_of_two_creeping_surfaces_tends_to_slide_steady(friction):
    body, ball = as_body(solid(1.5)), jc.Sphere(R, coated())
    times = np.array([0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 12.0])
    given = {"velocity": 2e-4, "grid": GRID, "friction": friction}
    end = jc.slide(body, ball, STEADY, times, substeps=4, **given)
    steady = jc.slide_steady(body, ball, STEADY, **given)
    for name in (*RUBBED, "indenter_displacement", "indenter_film_strain"):
        a, b = np.asarray(getattr(end, name))[-1], np.asarray(getattr(steady, name))
        rtol = 1e-2 if name.endswith("_force") else 2e-3
        np.testing.assert_allclose(a, b, rtol=0.0, atol=rtol * np.max(np.abs(b)), err_msg=name)


@pytest.mark.long
@pytest.mark.parametrize("steady", [True, False])
def test_gradients_of_friction_under_a_creeping_ball(steady):
    """By the ball's moduli and viscosity, and the coefficient: both modes and central differences."""

    def last(values):
        ball = jc.Sphere(R, jc.StandardLinearSolid(1e6 * values[0], 5e5 * values[1], 4e5 * values[2], nu=0.4))
        given = {"velocity": 2e-4, "grid": GRID, "friction": 0.6 * values[3], "tolerance": 1e-12}
        if steady:
            found = jc.slide_steady(as_body(solid(1.5)), ball, STEADY, **given)
            return jnp.stack([found.approach * 1e5, found.lateral_force[0] * 1e4])
        found = jc.slide(as_body(solid(1.5)), ball, STEADY, [0.0, 0.5, 1.0], **given)
        return jnp.stack([found.approach[-1] * 1e5, found.lateral_force[-1, 0] * 1e4])

    at, step = jnp.ones(4), 1e-5
    run = jax.jit(last)
    backward, forward = jax.jit(jax.jacrev(last))(at), jax.jit(jax.jacfwd(last))(at)
    moved = [(run(at.at[i].add(step)) - run(at.at[i].add(-step))) / (2.0 * step) for i in range(4)]
    np.testing.assert_allclose(forward, backward, atol=MODES * np.abs(backward).max())
    np.testing.assert_allclose(backward, np.stack(moved, 1), atol=1e-6 * np.abs(backward).max())


@pytest.mark.long
def test_adhesion_and_friction_under_a_ball_coated_with_its_own_material():
    """Steady and over time, with Coulomb's friction and a shear strength."""
    steel = jc.Elastic(G=1.2e6, nu=0.45)
    coat, body = jc.LayeredHalfSpace([jc.Layer(steel, 1.5e-4)], steel), as_body(solid(1.5))
    given = {
        "velocity": 2e-4,
        "grid": GRID,
        "friction": 0.4,
        "adhesion": jc.DugdaleAdhesion(work=0.02, strength=4e3),
        "shear_strength": 2e3,
    }
    names = (*RUBBED, "contact_pressure")
    found, expected = (jc.slide_steady(body, jc.Sphere(R, solid), STEADY, **given) for solid in (coat, steel))
    alike(found, expected, 1e-6, names)
    times = [0.0, 0.5, 1.0]
    found, expected = (jc.slide(body, jc.Sphere(R, each), STEADY, times, **given) for each in (coat, steel))
    alike(found, expected, 1e-6, names)


FLOWING_FILM = jc.LayeredHalfSpace([jc.Layer(burgers(), 1e-4)], solid())


@pytest.mark.slow
@pytest.mark.parametrize("material", [maxwell(), pytest.param(FLOWING_FILM, marks=pytest.mark.long)])
def test_slide_steady_refuses_an_indenter_that_flows(material):
    with pytest.raises(ValueError, match="flow without limit"):
        jc.slide_steady(as_body(solid()), jc.Sphere(R, material), STEADY, velocity=1e-4, grid=GRID)
    traced = jax.jit(
        lambda G: (
            jc.slide_steady(
                as_body(solid()),
                jc.Sphere(R, jax.tree.map(lambda leaf: leaf * G, material)),
                STEADY,
                velocity=1e-4,
                grid=GRID,
            ).status
        )
    )
    assert traced(1.0) == jc.Status.NOT_STEADY


def sheared(body, ball, push=0.012, **given):
    loads = push * np.array([[0.0, 0.0], [0.0, 0.0], [0.5, 0.0], [1.0, 0.4], [1.0, 0.4]])
    given = {"friction": 0.4, "grid": GRID} | given
    return jc.shear(body, ball, jc.Load(0.05), jc.TangentialLoad(loads), [0.0, 0.5, 1.0, 2.0, 4.0], **given)


SHEARED = (
    "pressure",
    "displacement",
    "traction",
    "slip",
    "approach",
    "tangential_displacement",
    "dissipated",
)


@pytest.mark.long
@pytest.mark.parametrize("coupled", [False, True])
@pytest.mark.parametrize("material", [burgers, coated])
def test_shear_of_two_equal_bodies_is_that_on_twice_the_compliance(material, coupled):
    expected = sheared(as_body(material(0.5)), jc.Sphere(R), coupled=False)
    found = sheared(as_body(material()), jc.Sphere(R, material()), coupled=coupled)
    for name in SHEARED:
        a, b = (np.asarray(getattr(each, name)) for each in (found, expected))
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-6 * np.max(np.abs(b)), err_msg=name)
    if not coupled:  # with coupling the traction raises one surface and lowers the other
        np.testing.assert_allclose(found.indenter_displacement, found.displacement / 2.0, atol=1e-11)


@pytest.mark.long
def test_shear_of_a_creeping_ball_on_a_stiff_base_is_the_opposite_one_of_a_stiff_ball_on_the_solid():
    stiff = jc.Elastic(G=1e12, nu=0.4)
    for material in (solid(), coated()):
        found = sheared(jc.LayeredHalfSpace([], stiff), jc.Sphere(R, material), tolerance=1e-10)
        expected = sheared(as_body(material), jc.Sphere(R), push=-0.012, tolerance=1e-10)
        for name in SHEARED:
            sign = -1.0 if name in ("traction", "slip", "tangential_displacement") else 1.0
            a, b = (np.asarray(getattr(each, name)) for each in (found, expected))
            np.testing.assert_allclose(a, sign * b, rtol=0.0, atol=1e-4 * np.max(np.abs(b)), err_msg=name)
        size = np.max(np.abs(expected.displacement))
        np.testing.assert_allclose(
            found.indenter_displacement, found.displacement, rtol=0.0, atol=1e-5 * size
        )


@pytest.mark.long
def test_rub_under_a_creeping_ball_is_the_wear_of_a_stiff_ball_on_the_solid():
    """Where all of the deformation is the ball's, a film that wears and an indenter that wears open the same gap."""
    law, given = jc.Archard(4e-12), {"velocity": 1.0, "grid": GRID, "substeps": 4}
    stiff = jc.Elastic(G=1e12, nu=0.4)
    times, film = np.array([0.0, 1.0, 2.0, 4.0]), jc.LayeredHalfSpace([jc.Layer(stiff, 1e-4)], stiff)
    found = jc.rub(film, jc.Sphere(R, solid()), STEADY, times, law=law, **given)
    expected = jc.rub(as_body(solid()), jc.Sphere(R), STEADY, times, law=law, wears="indenter", **given)
    assert np.min(expected.thickness) < -1e-6
    size = np.max(-expected.thickness)
    np.testing.assert_allclose(found.thickness - 1e-4, expected.thickness, rtol=0.0, atol=1e-4 * size)
    np.testing.assert_allclose(found.pressure, expected.pressure, atol=1e-4 * np.max(expected.pressure))
    own = jc.rub(
        jc.LayeredHalfSpace([], stiff),
        jc.Sphere(R, solid()),
        STEADY,
        times,
        law=law,
        wears="indenter",
        **given,
    )
    np.testing.assert_allclose(own.pressure, expected.pressure, atol=1e-4 * np.max(expected.pressure))


@pytest.mark.long
def test_a_coating_that_wears_is_the_profile_of_a_ball_that_wears():
    """A coating of the ball's own material along a path, and an uncoated ball in place; on a body that is stiff all of the
    displacement is the ball's."""
    steel, times = jc.Elastic(G=2e6, nu=0.4), np.array([0.0, 2.0, 4.0])
    coat = jc.LayeredHalfSpace([jc.Layer(steel, 1e-4)], steel)
    given = {"law": jc.Archard(4e-12), "grid": GRID, "substeps": 4, "wears": "indenter"}
    body = as_body(jc.Elastic(G=1e12, nu=0.4))
    expected = jc.rub(body, jc.Sphere(R, steel), STEADY, times, velocity=1.0, **given)
    assert np.min(expected.thickness) < -1e-6
    # 1 m/s, beyond the grid
    found = jc.rub(body, jc.Sphere(R, coat), STEADY, times, path=[0.0, 2.0, 0.0], **given)
    size = np.max(-expected.thickness)
    np.testing.assert_allclose(found.thickness - 1e-4, expected.thickness, rtol=0.0, atol=1e-4 * size)
    np.testing.assert_allclose(found.pressure, expected.pressure, atol=1e-4 * np.max(expected.pressure))
    of_ball = found.indenter_displacement
    np.testing.assert_allclose(of_ball, found.displacement, atol=1e-5 * np.max(of_ball))
    assert np.max(found.film_strain) == 0.0 < np.min(found.indenter_film_strain[1:])


def pressed(body, ball, grid):
    history = jc.indent(body, ball, STEADY, TIMES[:4], grid=grid, tolerance=1e-11)
    return history.pressure[-1], history.approach[-1], history.indenter_film_strain[-1]


def slid(body, ball, grid):
    history = jc.slide(body, ball, STEADY, [0.0, 1.0, 2.0], velocity=2e-4, grid=grid, tolerance=1e-11)
    return history.pressure[-1], history.hysteresis_force[-1], history.indenter_film_strain[-1]


def slid_for_ever(body, ball, grid):
    found = jc.slide_steady(body, ball, STEADY, velocity=2e-4, grid=grid, tolerance=1e-11)
    return found.pressure, found.hysteresis_force, found.indenter_film_strain


def rolled_for_ever(body, ball, grid):
    found = rolled(body, ball, grid=grid, tolerance=1e-11, coupled=False)
    return found.pressure, found.tangential_load[0], found.hysteresis_power


def sheared_in_steps(body, ball, grid):
    found = sheared(body, ball, grid=grid, tolerance=1e-11, coupled=False)
    return found.pressure[-1], found.tangential_displacement[-1, 0], found.indenter_film_strain[-1]


@pytest.mark.long
@pytest.mark.parametrize("verb", [pressed, sheared_in_steps, rolled_for_ever, slid, slid_for_ever])
def test_derivatives_by_each_leaf_of_the_indenters_material(verb):
    """Both modes against central differences, in relative changes of film, thickness and base of a coated ball."""
    grid = jc.Grid.square(n=12, width=2.2e-3)
    leaves, tree = jax.tree.flatten(coated())
    leaves = np.array(leaves)
    at_first = verb(as_body(solid(1.5)), jc.Sphere(R, coated()), grid)
    weights = np.cos(0.37 * np.arange(at_first[0].size)).reshape(at_first[0].shape) + 0.5
    sizes = [jnp.sum(jnp.abs(weights * at_first[0])), jnp.abs(at_first[1]), jnp.abs(at_first[2])]

    @jax.jit
    def numbers(factors):
        ball = jc.Sphere(R, jax.tree.unflatten(tree, list(leaves * factors)))
        p, number, strain = verb(as_body(solid(1.5)), ball, grid)
        return jnp.stack([jnp.sum(weights * p) / sizes[0], number / sizes[1], strain / sizes[2]])

    one, step = np.ones(leaves.size), 1e-4
    forward = np.asarray(jax.jit(jax.jacfwd(numbers))(one))
    reverse = np.asarray(jax.jit(jax.jacrev(numbers))(one))
    differences = [(numbers(one + e) - numbers(one - e)) / (2.0 * step) for e in step * np.eye(leaves.size)]
    expected = np.stack(differences, 1)
    # each of the seven counts, but the viscosity where the indenter has relaxed
    assert np.sum(np.max(np.abs(expected), 0) > 1e-4) == leaves.size - (verb is slid_for_ever)
    for found in (forward, reverse):
        assert np.all(np.abs(found - expected) < 1e-6 * np.max(np.abs(expected)))
    if verb is not rolled_for_ever:
        # the errors of the tangents of pressure and friction add up over the steps (measured: 1.6e-8)
        modes = 4.0 * MODES if verb is sheared_in_steps else MODES
        np.testing.assert_allclose(reverse, forward, rtol=0.0, atol=modes * np.max(np.abs(expected)))


@pytest.mark.slow
@pytest.mark.parametrize(
    "material",
    [
        pytest.param(solid(), marks=pytest.mark.long),
        pytest.param(burgers(), marks=pytest.mark.long),
        coated(),
    ],
)
def test_a_grid_around_holds_the_contact_of_a_creeping_ball(material):
    """The estimate is made with the largest compliance of the ball, so that the contact is a part of the width."""
    grid = jc.Grid.around(as_body(solid()), jc.Sphere(R, material), LOADS, TIMES, n=24)
    history = jc.indent(as_body(solid()), jc.Sphere(R, material), LOADS, TIMES, grid=grid)
    assert not np.any(history.status == jc.Status.AT_EDGE)
    assert np.max(history.contact_radius) > 0.15 * grid.width[0]


def test_what_does_not_take_an_indenter_that_creeps_refuses_it():
    ball, body = jc.Sphere(R, solid()), as_body(solid())
    coat = jc.Sphere(R, coated())
    wear = jc.Archard(1e-16)
    plain = jc.kernels(body, jc.Sphere(R), GRID)
    refused = {
        "expected Elastic or None": [
            lambda: jc.rub(coated(), coat, STEADY, [0.0, 1.0], path=[0.0, 1e-5], law=wear, grid=GRID),
        ],
        "quasi-elastic": [
            lambda: jc.indent(body, ball, STEADY, [0.0], grid=GRID, correspondence="quasi-elastic")
        ],
        "kernels: expected those of one that creeps": [
            lambda: jc.indent(body, ball, STEADY, [0.0], grid=GRID, kernels=plain)
        ],
        "expected a material, a LayeredHalfSpace or None": [
            lambda: jc.indent(body, jc.Sphere(R, 3.0), STEADY, [0.0], grid=GRID)
        ],
        "a Kelvin-Voigt surface": [
            lambda: jc.indent(
                as_body(jc.KelvinVoigt(G=1e6, eta=1e6, nu=0.4)),
                jc.Sphere(R, jc.KelvinVoigt(G=1e6, eta=1e6, nu=0.4)),
                STEADY,
                [0.0],
                grid=GRID,
            )
        ],
    }
    for message, calls in refused.items():
        for call in calls:
            with pytest.raises(ValueError, match=message):
                call()


def rolled(body, ball, **given):
    given = {"velocity": 2e-4, "creepage": (2e-3, 1e-3), "friction": 0.3, "grid": GRID} | given
    return jc.roll_steady(body, ball, STEADY, **given)


@pytest.mark.long
@pytest.mark.parametrize("coupled", [False, True])
@pytest.mark.parametrize("material", [burgers, coated])
def test_rolling_of_two_equal_rollers_is_that_on_twice_the_compliance(material, coupled):
    """The couplings of two equal solids cancel: with them, too, the contact is that of one body without coupling. With and
    without spin."""
    names = "pressure", "displacement", "traction", "slip_ratio", "approach", "hysteresis_power", "moment"
    moments = []
    for spin in (0.0, 4.0):
        expected = rolled(as_body(material(0.5)), jc.Sphere(R), coupled=False, spin=spin)
        found = rolled(as_body(material()), jc.Sphere(R, material()), coupled=coupled, spin=spin)
        for name in names:
            a, b = (np.asarray(getattr(each, name)) for each in (found, expected))
            np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-6 * np.max(np.abs(b)), err_msg=name)
        # equal surfaces, to rounding; without a film both strains are zero
        np.testing.assert_allclose(found.indenter_film_strain, found.film_strain, rtol=1e-9, atol=1e-15)
        assert found.hysteresis_force > 1e-4 * found.load
        moments.append(float(found.moment))
    assert abs(moments[1] - moments[0]) > 0.1 * abs(moments[1])  # of spin


@pytest.mark.long
def test_derivatives_by_spin_where_both_surfaces_creep():
    """The derivatives of force and moment by creepage and spin, in both modes, are those of central differences."""
    grid = jc.Grid.square(n=12, width=2.2e-3)

    @jax.jit
    def numbers(x):
        found = rolled(
            as_body(solid(1.5)), jc.Sphere(R, coated()), grid=grid, tolerance=1e-11, coupled=False,
            creepage=jnp.stack([2e-3 * x[0], 1e-3]), spin=4.0 * x[1],
        )  # fmt: skip
        return jnp.append(found.tangential_load, found.moment / 3e-4) / 0.05

    one, step = np.ones(2), 1e-4
    forward, reverse = (np.asarray(jax.jit(mode(numbers))(one)) for mode in (jax.jacfwd, jax.jacrev))
    differences = [(numbers(one + e) - numbers(one - e)) / (2.0 * step) for e in step * np.eye(2)]
    expected = np.stack(differences, 1)
    assert np.max(np.abs(expected[:, 1])) > 1e-3
    for found in (forward, reverse):
        assert np.all(np.abs(found - expected) < 1e-6 * np.max(np.abs(expected)))


@pytest.mark.long
@pytest.mark.parametrize("material", [pytest.param(solid, marks=pytest.mark.long), coated])
def test_rolling_of_a_creeping_ball_on_a_stiff_base_is_that_of_a_stiff_ball_on_the_solid(material):
    """Body and indenter exchanged, the coupling changes its sign: so does the displacement along the surface, and with it
    the pressure under which a traction raises the surface."""
    stiff = jc.Elastic(G=1e12, nu=0.4)
    found = rolled(jc.LayeredHalfSpace([], stiff), jc.Sphere(R, material()), creepage=(0.0, 0.0))
    expected = rolled(as_body(material()), jc.Sphere(R), creepage=(0.0, 0.0))
    for name in ("pressure", "displacement", "approach", "hysteresis_power"):
        a, b = (np.asarray(getattr(each, name)) for each in (found, expected))
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-4 * np.max(np.abs(b)), err_msg=name)
    size = np.max(np.abs(expected.traction))
    np.testing.assert_allclose(found.traction, -expected.traction, rtol=0.0, atol=1e-4 * size)


@pytest.mark.slow
def test_forces_on_a_periodic_grid_do_not_depend_on_where_the_contact_is():
    """Its slope at the sides of the grid is that across them, as of the profile."""
    n, side = 16, 1e-3 / 16
    grid = jc.Grid(shape=(n, n), spacing=(side, side), periodic=True)
    x = 2.0 * np.pi * np.arange(n) / n
    heights = 2e-6 * (np.cos(x)[:, None] + np.cos(x))
    given = {"velocity": (3e-4, 1e-4), "grid": grid}
    for_heights = lambda heights: jc.slide(
        as_body(solid(1.5)), jc.HeightField(heights, solid()), jc.Load(5e-4), TIMES[1:3], **given
    )
    at_corner, inside = for_heights(heights), for_heights(np.roll(heights, (n // 2, n // 2), (0, 1)))
    for name in ("approach", "hysteresis_force", "lateral_force"):
        found, expected = (np.asarray(getattr(each, name)) for each in (at_corner, inside))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.max(np.abs(expected)))
    assert inside.hysteresis_force[-1] > 1e-2 * 1e-3 * inside.load[-1]


@pytest.mark.long
def test_a_ball_that_hardly_creeps_ploughs_as_an_elastic_one():
    hardly = jc.StandardLinearSolid(G1=1e6, G2=1e15, eta2=1e14, nu=0.4)
    given = {"times": np.array([0.0, 0.25, 0.5]), "velocity": 4e-4, "grid": GRID, "hardness": 4e4}
    slid = lambda ball: jc.slide(as_body(solid()), jc.Sphere(R, ball), STEADY, **given)
    found, expected = slid(hardly), slid(jc.Elastic(G=1e6, nu=0.4))
    close(found, expected, 1e-6)
    assert np.all(found.peak_dent > 0.0) and np.all(found.status == 0)
    np.testing.assert_allclose(found.dent, expected.dent, rtol=0, atol=1e-6 * np.max(expected.dent))
    np.testing.assert_allclose(found.hysteresis_force[1:], expected.hysteresis_force[1:], rtol=1e-4)


@pytest.mark.long
def test_a_gel_of_the_indenter_on_a_rigid_core_lets_the_approach_exceed_the_mean_gap():
    """As a body on a rigid base it has a mean displacement on a periodic grid, that of its shortening."""
    n, h, approach = 16, 0.3, 3e-3
    grid = jc.Grid((n, n), (1 / n, 1 / n), periodic=True)
    wave = 1e-3 * (1.0 - np.cos(2.0 * np.pi * np.arange(n) / n))[:, None] * np.ones(n)
    gel, base = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1.0, 0.3), h)], None), as_body(jc.Elastic(1e9, 0.3))
    found = jc.indent(base, jc.HeightField(wave, gel), jc.Approach(approach), [0.0], grid=grid)
    assert found.status[0] == 0 and np.min(found.pressure) > 0.0
    shortening = approach - np.mean(found.profile)  # of an oedometer, p h (1 - 2 nu)/(2 G (1 - nu))
    np.testing.assert_allclose(np.mean(found.pressure) * h * 0.4 / 1.4, shortening, rtol=1e-6)
