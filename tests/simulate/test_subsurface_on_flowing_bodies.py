"""Fields below the surface of bodies that flow or are stiff, against Airy's stress function and de Hoog's inversion."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from laplace import inverted

import jaxcontact as jc
from jaxcontact.response.interior import Lags, Transfer, subsurface_images

NAMES = ("t_zz", "t_rz", "u_rz", "u_zz")
MAXWELL, ELASTIC = jc.Maxwell(G=1.0, eta=1.0, nu=0.3), jc.Elastic(1.0, 0.3)
SOLID, BURGERS = jc.StandardLinearSolid(1.0, 0.3, 0.03, 0.4), jc.Burgers(1.0, 0.5, 10.0, 0.5, 0.45)
BODIES = {
    "elastic on Maxwell": (ELASTIC, MAXWELL),
    "soft elastic on Maxwell": (jc.Elastic(0.01, 0.3), MAXWELL),
    "slow Maxwell on Maxwell": (jc.Maxwell(1.0, 1e3, 0.3), MAXWELL),
    "standard solid on Burgers": (SOLID, BURGERS),
    "Burgers on an elastic solid": (BURGERS, ELASTIC),
}


def basis(alpha, z, side):
    """F = exp(-+alpha z) and z F with their first three derivatives, (2, 4)."""
    k = side * alpha
    powers = k ** np.arange(4)
    return np.array([powers, z * powers + np.arange(4) * k ** np.maximum(np.arange(4) - 1, 0)])


def conditions(alpha, z, G, nu, sides, offsets):
    """-s_zz, |s_xz|, alpha |u_x| and alpha u_z of each function of F(z) exp(i alpha x), plane strain, (4, functions)."""
    F = np.concatenate(
        [
            basis(alpha, z, side) * np.exp(side * alpha * (z - at))
            for side, at in zip(sides, offsets, strict=True)
        ]
    ).T
    along = ((1 - nu) * F[2] + nu * alpha**2 * F[0]) / (2 * G)
    down = ((1 - nu) * F[3] - (2 - nu) * alpha**2 * F[1]) / (2 * G * alpha)
    return np.array([alpha**2 * F[0], alpha * F[1], along, down])


def under_pressure(alpha, z, moduli, poissons, h=1.0):
    """The same at depth z of a layer of thickness h on a half-space under a pressure of 1 on the surface, (4,)."""
    layer = lambda z: conditions(alpha, z, moduli[0], poissons[0], (-1, 1), (0.0, h))
    base = lambda z: conditions(alpha, z, moduli[1], poissons[1], (-1,), (h,))
    matrix = np.zeros((6, 6), complex)
    matrix[:2, :4], matrix[2:, :4], matrix[2:, 4:] = layer(0.0)[:2], layer(h), -base(h)
    scale = np.max(np.abs(matrix), 0)
    rows = np.max(np.abs(matrix / scale), 1)
    found = np.linalg.solve(matrix / scale / rows[:, None], np.array([1.0, 0, 0, 0, 0, 0]) / rows) / scale
    return layer(z) @ found[:4] if z < h else base(z) @ found[4:]


def exactly(solids, alpha, z, t):
    """``NAMES`` at t after a step of pressure, without signs of the second and third, (4, n)."""

    def transform(s):
        moduli = [1.0 / (s * complex(solid.laplace_compliance(s))) for solid in solids]
        return np.array([under_pressure(a, z, moduli, [s.nu for s in solids]) for a in alpha]).T.ravel() / s

    return inverted(transform, t).reshape(4, -1)


@pytest.mark.long
@pytest.mark.parametrize("name", BODIES)
def test_what_reaches_a_depth_is_right_or_known_to_be_off(name):
    """From a thirtieth to 4000 relaxation times of MAXWELL, in the layer, just above its lower side, and below it."""
    film, base = BODIES[name]
    body, program = jc.LayeredHalfSpace([jc.Layer(film, 1.0)], base), jax.jit(subsurface_images)
    alpha, index = np.geomspace(1e-3, 10.0, 21), [Transfer._fields.index(each) for each in NAMES]
    for t in (0.03, 1.0, 100.0, 4000.0):
        for z in (0.5, 0.99, 1.5):
            images = program(body, jnp.asarray(z), Lags(jnp.array([t]), jnp.array([t])))
            decayed = np.exp(-np.outer(images.depths, alpha))
            ours = images.weights[:, 0] @ decayed + np.outer(
                images.slope_weights[:, 0], alpha * np.exp(-alpha * z)
            )
            ours, theirs = np.asarray(ours)[index], exactly((film, base), alpha, z, t)
            ours[[1, 2]], theirs[[1, 2]] = np.abs(ours[[1, 2]]), np.abs(theirs[[1, 2]])
            power = np.array([2, 2, 1, 1])[:, None]
            longer = np.maximum.accumulate(np.abs(theirs) * alpha**power, -1) / alpha**power
            size = np.repeat([longer[:2].max(0), longer[2:].max(0)], 2, 0)
            error = float(images.error(jnp.array([[0.0, 0.0, 1.0]])))
            # of the largest component, the stress along the surface included; below of these alone
            assert error < 1e-3
            assert np.max(np.abs(ours - theirs) / size) < 1e-2, (t, z, error)


@pytest.mark.slow
def test_a_response_that_is_not_resolved_is_told():
    """A film 1e13 times as stiff as what lies below it, beyond the reach of the images."""
    grid = jc.Grid.square(8, 1e-3)
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e13, 0.3), 1e-4)], ELASTIC)
    with pytest.warns(UserWarning, match="the response below the surface has a relative error of up to"):
        inside = jc.subsurface(body, grid, np.ones(grid.shape), depths=[5e-5, 1.5e-4])
    assert jc.Status.NOT_RESOLVED in np.asarray(inside.status) and len(inside.notes) == 1


def test_status_and_notes_follow_from_the_error():
    grid, stress = jc.Grid.square(4, 1.0), np.zeros((2, 3, 3, 4, 4))
    fields = lambda error: jc.InteriorFields(
        grid, np.array([0.0, 1.0]), stress, stress[:, 0], np.array(error)
    )
    assert fields([1e-5, 0.0]).notes == () and not np.any(fields([1e-5, 0.0]).status)
    assert "error of up to 0.002" in fields([2e-3, 0.0]).notes[0] and not np.any(fields([2e-3, 0.0]).status)
    assert (
        list(fields([0.0, 0.3]).status) == [0, jc.Status.NOT_RESOLVED] and len(fields([0.0, 0.3]).notes) == 1
    )
