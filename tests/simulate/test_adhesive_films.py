"""``indent`` with adhesion on a film whose thickness varies in the plane: a dense minimisation, the film of one thickness,
the balance of energy, separation, derivatives."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from peeling import BALL, NU, REACH, UNITS, WORK, G
from scipy.optimize import minimize

import jaxcontact as jc
from jaxcontact.operators.kernels import build_varying

LAW = jc.ExponentialAdhesion(0.5 * WORK, 0.5 * REACH)
GRID = jc.Grid.square(n=16, width=6.0 * UNITS.radius)
SOFT, BASE = jc.Elastic(0.3 * G, 0.45), jc.Elastic(G, NU)


def thickness(mean=0.4, swing=0.5, grid=GRID):
    """Thickness in units of the contact radius, with a hill beside the axis of the ball."""
    x, y = (a / UNITS.radius for a in grid.coordinates())
    return mean * UNITS.radius * (1.0 + swing * jnp.cos(2.0 * x + 0.5) * jnp.cos(1.5 * y))


def film(h, solid=SOFT):
    return jc.LayeredHalfSpace([jc.Layer(solid, h)], BASE)


def pressed(body, control, times=None, grid=GRID, law=LAW, **options):
    times = np.arange(np.size(control.value), dtype=float) if times is None else times
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.indent(body, BALL, control, times, grid=grid, adhesion=law, **options)


def along(path):
    return jc.Approach(np.asarray(path) * UNITS.approach)


def averages(n):
    """The matrix from values of n cells to the two Gauss points between neighbours, and at the ends."""
    t = 0.5 - 0.5 / np.sqrt(3.0)
    ends = np.pad(np.eye(n), ((1, 1), (0, 0)), mode="edge")
    weights = np.r_[0.25, np.full(n - 1, 0.5), 0.25]
    rows = [(1.0 - s) * ends[:-1] + s * ends[1:] for s in (t, 1.0 - t)]
    return np.concatenate(rows), np.tile(weights, 2)


@pytest.mark.slow
def test_the_contact_is_the_minimum_of_the_energy_by_a_dense_matrix():
    """Gaps of least energy by L-BFGS-B, with the matrix of the film and averages of the attraction written out."""
    h, path = thickness(), [1.0, 0.5, 0.1]
    found = pressed(film(h), along(path), tolerance=1e-10)
    assert not np.any(found.status) and 0 < np.sum(found.in_contact[-1]) < 40
    kernels, (n, _) = build_varying(film(float(h.max())), BALL, GRID, h), GRID.shape
    units = np.eye(n * n).reshape(n * n, n, n)

    @jax.jit
    def columns(kernels):
        here = kernels.at(h)
        return jax.lax.map(here.family.combined([1.0] + [0.0] * len(here.mix)), units)

    matrix = np.asarray(columns(kernels)).reshape(n * n, n * n).T
    stiff = np.linalg.inv((matrix + matrix.T) / 2.0)
    length, compliance = float(kernels.scale.length), float(kernels.scale.compliance)
    (A, weights), profile = averages(n), np.asarray(found.profile) / length
    work, reach = LAW.work * compliance / length, LAW.range / length
    gap = np.maximum(np.asarray(found.gap[0]) / length, 0.0)
    for k, approach in enumerate(np.asarray(found.approach) / length):

        def energy(g, approach=approach):
            u = g + (approach - profile).ravel()
            attracted = work * np.outer(weights, weights) * np.exp(-(A @ g.reshape(n, n) @ A.T) / reach)
            slope = A.T @ (attracted / reach) @ A
            return 0.5 * u @ stiff @ u - attracted.sum(), stiff @ u + slope.ravel()

        options = {"maxiter": 20000, "maxfun": 20000, "ftol": 1e-15, "gtol": 1e-9, "maxcor": 50}
        least = minimize(
            energy, gap.ravel(), jac=True, bounds=[(0.0, None)] * n**2, options=options, method="L-BFGS-B"
        )
        gap = least.x.reshape(n, n)
        pressure = (stiff @ (gap - profile + approach).ravel()).reshape(n, n) / compliance
        np.testing.assert_allclose(found.gap[k], gap * length, atol=1e-5 * UNITS.approach)
        np.testing.assert_allclose(found.pressure[k], pressure, atol=1e-4 * np.abs(pressure).max())


CREEPING = jc.StandardLinearSolid(0.9 * G, 0.45 * G, 0.45 * G, nu=0.45)


@pytest.mark.slow
# of the first the program is that of the test above, of the second that of the test below
@pytest.mark.parametrize(
    "load_controlled, solid",
    [
        (False, SOFT),
        pytest.param(True, CREEPING, marks=pytest.mark.slow),
        pytest.param(False, CREEPING, marks=pytest.mark.long),
    ],
    ids=["approach", "load, creeping", "approach, creeping"],
)
def test_a_map_of_one_thickness_is_the_film_of_that_thickness(load_controlled, solid):
    h = 0.4 * UNITS.radius
    control = jc.Load(np.array([0.2, 0.1, -0.3]) * UNITS.load) if load_controlled else along([1.0, 0.6, 0.3])
    one = pressed(film(h, solid), control)
    map_ = pressed(film(np.full(GRID.shape, h), solid), control)
    assert not np.any(one.status) and not np.any(map_.status)
    for name in ("pressure", "load", "approach", *(["viscous_energy"] if solid is CREEPING else [])):
        wanted = np.asarray(getattr(one, name))
        np.testing.assert_allclose(getattr(map_, name), wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())


@pytest.mark.slow
def test_a_load_that_no_contact_carries_separates_film_and_ball():
    found = pressed(film(thickness(), CREEPING), jc.Load(np.array([0.2, -0.2, -4.0]) * UNITS.load))
    assert list(found.status) == [0, 0, jc.Status.PULLED_OFF] and not np.any(found.pressure[-1])


@pytest.mark.slow
def test_jumps_and_the_film_take_what_a_cycle_on_a_creeping_film_costs():
    """In and out at a finite speed, then at rest apart: the area of the curve is what both have lost."""
    path = np.concatenate([np.linspace(-1.6, 0.6, 40), np.linspace(0.6, -2.4, 70)[1:], [-2.4]])
    times = np.append(0.05 * np.arange(path.size - 1), 1e4)
    solid = jc.StandardLinearSolid(0.6 * G, 1.2 * G, 1.2 * G, nu=0.45)
    found = pressed(film(thickness(swing=0.3), solid), along(path), times, save="last")
    lost = np.trapezoid(np.asarray(found.load), np.asarray(found.approach))
    assert not np.any(found.status) and lost > 0.0
    viscous, jumps = float(found.viscous_energy[-1]), float(found.jump_energy[-1])
    assert viscous > 0.1 * lost
    assert viscous + jumps == pytest.approx(lost, rel=0.02)


@pytest.mark.long
@pytest.mark.parametrize("load_controlled", [True, False])
def test_derivatives_are_those_of_central_differences(load_controlled):
    """By the modulus of the film, the swing of its thickness, work and range of the attraction and the control."""

    def ends(q):
        solid = jc.StandardLinearSolid(0.6 * G * q[0], 0.9 * G, 0.9 * G, nu=0.45)
        h = 0.4 * UNITS.radius * (1.0 + q[1] * (thickness(1.0) / UNITS.radius - 1.0))
        law = jc.ExponentialAdhesion(LAW.work * q[2], LAW.range * q[3])
        given = (
            jnp.array([0.1, -0.1]) * UNITS.load if load_controlled else jnp.array([1.0, 0.6]) * UNITS.approach
        )
        control = (jc.Load if load_controlled else jc.Approach)(given * q[4])
        options = {"grid": GRID, "adhesion": law, "tolerance": 1e-11, "max_iterations": 2000}
        found = jc.indent(film(h, solid), BALL, control, [0.0, 1.0], **options)
        free = found.approach[-1] / UNITS.approach if load_controlled else found.load[-1] / UNITS.load
        return jnp.stack([free, found.pressure[-1].max() * UNITS.radius**2 / UNITS.load])

    at, step = jnp.ones(5), 1e-5
    run = jax.jit(ends)
    backward = jax.jit(jax.jacrev(ends))(at)
    moved = [(run(at.at[i].add(step)) - run(at.at[i].add(-step))) / (2.0 * step) for i in range(5)]
    np.testing.assert_allclose(backward, jnp.stack(moved, 1), atol=1e-6 * np.abs(backward).max())
    np.testing.assert_allclose(jax.jit(jax.jacfwd(ends))(at), backward, atol=1e-6 * np.abs(backward).max())
