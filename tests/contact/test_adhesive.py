"""Contact with adhesion at an instant: equilibrium, energy, an independent minimisation, derivatives."""

import dataclasses
from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize

import jaxcontact as jc
from jaxcontact.bodies.laws import RampedAttraction
from jaxcontact.contact import implicit
from jaxcontact.contact.adhesive import Attraction, Start
from jaxcontact.contact.normal import Problem
from jaxcontact.operators.kernels import on_grid
from jaxcontact.response.images import Images

TOLERANCE, MOST = jnp.asarray(1e-12), jnp.asarray(4000)
EXPONENTIAL = jc.ExponentialAdhesion(0.02, 0.15)
DUGDALE = RampedAttraction(0.02, 0.1, 0.07)
GRIDS = {"free": (False, False), "strip": (False, True), "periodic": (True, True)}


@lru_cache
def operator_of(shape, periodic):
    """A half-space of compliance (1 - nu)/G = 1 on unit cells."""
    images = Images(jnp.zeros(0), jnp.ones((1, 1)))
    return on_grid(jc.Grid(shape, (1.0, 1.0), periodic), images)[0].combined([1.0])


def problem_of(gap, target, law=EXPONENTIAL, *, load=False, periodic=(False, False)):
    gap = jnp.asarray(gap)
    operator = operator_of(gap.shape, periodic)
    return Problem(operator, gap, jnp.asarray(target), jnp.min(gap), load, Attraction(law, periodic))


def nothing(shape):
    return Start(jnp.zeros(shape), jnp.zeros(shape, bool), jnp.asarray(True))


@jax.jit
def solved(problem, start):
    return implicit.solve_attracted(problem, start, TOLERANCE, MOST)


def bumps(shape):
    x, y = np.meshgrid(*(np.arange(n) - (n - 1) / 2 + 0.1 for n in shape), indexing="ij")
    rough = 0.05 * np.random.RandomState(3).rand(*shape)
    return 0.02 * (x**2 + (y**2 if shape[1] > 1 else 0.0)) + rough


def points(gap, periodic):
    """Gaps at Gauss points between neighbours and the part of a cell that each stands for, by rolling copies."""
    t = 0.5 - 0.5 / np.sqrt(3.0)
    fields, weights = [gap], [np.ones(gap.shape)]
    for axis, wraps in enumerate(periodic):
        if gap.shape[axis] == 1:
            continue
        ahead = [np.roll(f, -1, axis) for f in fields]
        if not wraps:
            last = [slice(None)] * 2
            last[axis] = -1
            for f, a in zip(fields, ahead, strict=True):
                a[tuple(last)] = f[tuple(last)]
        fields = [(1 - s) * f + s * a for f, a in zip(fields, ahead, strict=True) for s in (t, 1 - t)]
        weights = [0.5 * w for w in weights for _ in range(2)]
    return fields, weights


@pytest.mark.parametrize(
    "law", [EXPONENTIAL, jc.DugdaleAdhesion(0.02, 0.1), DUGDALE], ids=["exponential", "Dugdale", "ramp"]
)
def test_a_law_does_its_work(law):
    """energy(g) is the integral of traction from g on, and at zero the work; stiffness its slope."""
    g = np.linspace(0.0, 4.0, 400001)
    s = np.asarray(law.traction(g))
    left = np.concatenate([np.cumsum(((s[1:] + s[:-1]) / 2 * np.diff(g))[::-1])[::-1], [0.0]])
    np.testing.assert_allclose(law.energy(g), left, atol=2e-6)
    assert float(law.energy(0.0)) == pytest.approx(0.02, rel=1e-12)
    assert float(law.largest_traction) == pytest.approx(s[0])
    smooth = np.abs(np.diff(s, 2)) < 1e-9
    slopes = np.asarray(law.stiffness(g))[1:-1]
    np.testing.assert_allclose(slopes[smooth], -np.gradient(s, g)[1:-1][smooth], atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "load", [pytest.param(False, marks=pytest.mark.long), True], ids=["approach", "load"]
)
@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=pytest.mark.long if kind == "free" else ()) for kind in GRIDS]
)
def test_tractions_balance_and_surfaces_do_not_overlap(kind, load):
    """p_c >= 0, g >= 0, p_c g = 0, p = p_c - s(g) with s from the energy's own numerical derivative, u = K p."""
    periodic = GRIDS[kind]
    gap = bumps((16, 1) if kind == "strip" else (12, 11))
    target = 0.4 if load else 0.25
    problem = problem_of(gap, target, load=load, periodic=periodic)
    found = solved(problem, nothing(gap.shape))
    g = np.asarray(problem.gap + found.displacement - found.approach)
    p, contact = np.asarray(found.pressure), np.asarray(found.contact_pressure)
    assert float(found.error) < 1e-9
    np.testing.assert_allclose(found.displacement, problem.operator(found.pressure), atol=1e-9)
    energy = lambda g: sum(
        np.sum(w * 0.02 * np.exp(-f / 0.15)) for f, w in zip(*points(g, periodic), strict=True)
    )
    if all(periodic):  # of points that no square of a free grid has a copy, the rest is the same
        s = np.array([(energy(g + 1e-6 * e) - energy(g - 1e-6 * e)) / -2e-6 for e in units(gap.shape)])
        np.testing.assert_allclose(p, contact - s.reshape(gap.shape), atol=1e-8)
    assert np.all(g[contact > 0] < 1e-12) and np.all(g > -1e-12) and np.all(contact >= 0) and np.any(contact)
    assert np.all(p[g > 1e-9] < 0)
    if load:
        assert p.sum() == pytest.approx(0.4, rel=1e-9)


def units(shape):
    for i in range(int(np.prod(shape))):
        one = np.zeros(int(np.prod(shape)))
        one[i] = 1.0
        yield one.reshape(shape)


@pytest.mark.slow
def test_the_energy_changes_by_load_times_approach():
    gap = bumps((12, 11))

    def energy(approach, start):
        problem = problem_of(gap, approach)
        found = solved(problem, start)
        g = jnp.maximum(problem.gap + found.displacement - found.approach, 0.0)
        stored = 0.5 * jnp.sum(found.pressure * found.displacement)
        return float(stored - problem.law.energy(g)), found

    _, middle = energy(0.2, nothing(gap.shape))
    start = Start(middle.pressure, middle.contact_pressure > 0, jnp.asarray(False))
    (above, _), (below, _) = energy(0.2 + 1e-5, start), energy(0.2 - 1e-5, start)
    assert (above - below) / 2e-5 == pytest.approx(float(jnp.sum(middle.pressure)), rel=1e-6)


@pytest.mark.slow
def test_a_rough_periodic_contact_is_that_of_an_independent_minimisation():
    """64 x 64 cells under a load: the gaps of least energy by scipy's L-BFGS-B, with transforms and averages of its own."""
    n, work, reach, load = 64, 0.02, 0.2, 20.0
    noise = np.random.RandomState(5).randn(n, n)
    q = np.hypot(*np.meshgrid(2 * np.pi * np.fft.fftfreq(n), 2 * np.pi * np.fft.fftfreq(n), indexing="ij"))
    spectrum = np.where((q > 0) & (q < 1.0), np.maximum(q, 0.15) ** -1.8, 0.0)
    heights = np.fft.ifft2(np.fft.fft2(noise) * spectrum).real
    f = 0.5 * heights / heights.std()
    f -= f.min()
    stiffness = q  # K^(q) = 1/q: pressure over displacement

    def energy(g):
        g = g.reshape(n, n)
        u = g - f
        pressure = np.fft.ifft2(stiffness * np.fft.fft2(u)).real
        total, slope = 0.5 * np.sum(u * pressure) + load / n**2 * g.sum(), pressure + load / n**2
        t = 0.5 - 0.5 / np.sqrt(3.0)
        for a in (t, 1 - t):
            for b in (t, 1 - t):
                along = (1 - a) * g + a * np.roll(g, -1, 0)
                at = (1 - b) * along + b * np.roll(along, -1, 1)
                left = 0.25 * work * np.exp(-at / reach)
                total -= left.sum()
                back = (1 - b) * left + b * np.roll(left, 1, 1)
                slope = slope + ((1 - a) * back + a * np.roll(back, 1, 0)) / reach
        return total, slope.ravel()

    problem = problem_of(f, load, jc.ExponentialAdhesion(work, reach), load=True, periodic=(True, True))
    found = solved(problem, nothing(f.shape))
    ours = np.asarray(problem.gap + found.displacement - found.approach)
    start = np.maximum(ours + 0.02 * np.random.RandomState(0).rand(n, n), 0.0)  # not our own state
    options = {"maxiter": 20000, "maxfun": 40000, "ftol": 1e-16, "gtol": 1e-10, "maxcor": 30}
    best = minimize(
        energy, start.ravel(), jac=True, method="L-BFGS-B", bounds=[(0, None)] * n**2, options=options
    )
    g = best.x.reshape(n, n)
    assert energy(ours.ravel())[0] == pytest.approx(best.fun, rel=1e-6)
    assert energy(ours.ravel())[0] <= best.fun + 1e-9 * abs(best.fun)
    np.testing.assert_allclose(ours, g, atol=1e-6 * f.max())
    touching = np.asarray(found.contact_pressure) > 0
    assert 0.02 < touching.mean() < 0.9 and np.mean(touching != (g < 1e-7)) < 2e-3


ATTRACTIONS = {"exponential": EXPONENTIAL, "ramp": DUGDALE}
ALL = [(kind, load, name) for kind in GRIDS for load in (False, True) for name in ATTRACTIONS]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "load", "name"),
    [pytest.param(*one, marks=() if one == ("strip", False, "ramp") else pytest.mark.long) for one in ALL],
)
def test_derivatives_are_those_of_central_differences(kind, load, name):
    law = ATTRACTIONS[name]
    gap = jnp.asarray(bumps((16, 1) if kind == "strip" else (10, 9)))
    target = 0.4 if load else 0.25
    base = problem_of(gap, target, law, load=load, periodic=GRIDS[kind])
    start = solved(base, nothing(gap.shape))
    start = Start(start.pressure, start.contact_pressure > 0, jnp.asarray(False))
    parameters = [getattr(law, field.name) for field in dataclasses.fields(law)]

    def outcome(q):
        laws = type(law)(*(q[2 + i] * value for i, value in enumerate(parameters)))
        problem = dataclasses.replace(
            base,
            operator=jax.tree.map(lambda a: q[0] * a, base.operator),
            gap=gap * q[1],
            lowest=jnp.min(gap * q[1]),
            target=target * q[-1],
            law=Attraction(laws, GRIDS[kind]),
        )
        found = implicit.solve_attracted(problem, start, TOLERANCE, MOST)
        sums = jnp.sum(found.pressure), jnp.sum(found.pressure**2), jnp.sum(found.contact_pressure**2)
        return jnp.stack([*sums, found.approach, found.displacement[3, 0]])

    at = jnp.ones(3 + len(parameters))
    forward, reverse = jax.jit(jax.jacfwd(outcome))(at), jax.jit(jax.jacrev(outcome))(at)
    np.testing.assert_allclose(forward, reverse, rtol=1e-6, atol=1e-8)
    run, step = jax.jit(outcome), 2e-6  # a larger one takes points of the ramp across its end
    central = np.stack([(run(at + step * e) - run(at - step * e)) / (2 * step) for e in jnp.eye(at.size)], 1)
    np.testing.assert_allclose(forward, central, atol=2e-6 * np.abs(central).max())


@pytest.mark.long
def test_a_derivative_under_a_load_is_nan_where_only_the_approach_makes_the_state_stable():
    """Past the lowest load a state is stable under an approach alone; the load then has no derivative to speak of."""
    gap = bumps((12, 11))
    start, loads = nothing(gap.shape), []
    for approach in np.linspace(0.3, -0.6, 31):
        found = solved(problem_of(gap, approach), start)
        start = Start(found.pressure, found.contact_pressure > 0, jnp.asarray(False))
        loads.append((float(jnp.sum(found.pressure)), approach, found))
    lowest = int(np.argmin([one[0] for one in loads]))
    assert 3 < lowest < 28
    load, approach, found = loads[lowest + 2]
    assert np.any(np.asarray(found.contact_pressure) > 0)  # still in contact
    again = Start(found.pressure, found.contact_pressure > 0, jnp.asarray(False))

    def energy_of(approach):
        return jnp.sum(solved(problem_of(gap, approach), again).pressure ** 2)

    def under_load(load, most):
        problem = problem_of(gap, load, load=True)
        return implicit.solve_attracted(problem, again, jnp.asarray(1e-2), most).approach

    assert np.isfinite(jax.grad(energy_of)(approach))
    assert np.isnan(jax.grad(partial(under_load, most=jnp.asarray(0)))(load))


@pytest.mark.slow
def test_a_tensile_load_beyond_the_lowest_separates():
    gap = bumps((12, 11))
    found = solved(problem_of(gap, 0.0, load=True), nothing(gap.shape))
    assert np.any(np.asarray(found.contact_pressure) > 0) and abs(float(jnp.sum(found.pressure))) < 1e-9
    start = Start(found.pressure, found.contact_pressure > 0, jnp.asarray(False))
    gone = solved(problem_of(gap, -5.0, load=True), start)
    assert bool(gone.separated) and not np.any(np.asarray(gone.pressure)) and float(gone.approach) == 0.0
    apart = Start(gone.pressure, gone.contact_pressure > 0, jnp.asarray(False))
    assert bool(solved(problem_of(gap, -0.01, load=True), apart).separated)
    assert not bool(solved(problem_of(gap, 0.2, load=True), apart).separated)


@pytest.mark.slow
def test_an_extended_operator_acts_as_the_operator_does_and_has_an_inverse():
    rng = np.random.RandomState(1)
    for shape, periodic in [((9, 8), (False, False)), ((11, 1), (False, True)), ((9, 6), (True, True))]:
        operator = operator_of(shape, periodic)

        @jax.jit
        def there_and_back(p, operator=operator, shape=shape):
            forward, inverse, padded = operator.extended(shape)
            field = forward(jnp.zeros(padded).at[: shape[0], : shape[1]].set(p))
            return field[: shape[0], : shape[1]], operator(p), inverse(field)[: shape[0], : shape[1]]

        p = rng.randn(*shape)
        inside, expected, back = there_and_back(p)
        if all(periodic):
            inside = inside - jnp.mean(inside)
        np.testing.assert_allclose(inside, expected, atol=1e-12)
        np.testing.assert_allclose(back, p, atol=1e-9)
