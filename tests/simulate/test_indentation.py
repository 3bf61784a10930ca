"""Indentation in time: Lee and Radok, Ting, layered creep, second order, recursion against superposition."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tolerances import APPROACH, PEAK, RADIUS, ROUND_OFF, SEPARATION

import jaxcontact as jc
from jaxcontact.history.memory import DirectMemory, RecursiveMemory, rows
from jaxcontact.history.time_loop import Delayed, fine_steps
from jaxcontact.operators.kernels import build_images
from jaxcontact.reference import abel, lee_radok, ting

TAU = 1.0
MAXWELL = jc.Maxwell(80.77e9, 80.77e9 * TAU)
BALL = jc.Sphere(3.5e-3)


def creep(material):
    return lambda t: np.asarray(material.creep(np.asarray(t)))


def relaxation(material):
    return lambda t: np.asarray(material.relaxation(np.asarray(t)))


def quietly(*args, **kwargs):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jc.indent(*args, **kwargs)


def pressure_error(result, material, load, radius, rings=60):
    """L1 distance of the last pressure field to Lee and Radok's at the cell centres, over the load."""
    t = float(result.times[-1])
    a = lambda s: lee_radok.step_radius(s, creep(material), load, radius, 0.3)
    x, y = result.grid.coordinates()
    r = np.asarray(jnp.sqrt(x**2 + y**2))
    edges = np.linspace(0.0, 1.0, 400)
    radii = float(a(t)) * (1.0 - (1.0 - edges) ** 2)
    exact = lee_radok.pressure(radii, t, relaxation(material), a, radius, 0.3)
    field = np.interp(r, radii, exact, right=0.0)
    return float(np.sum(np.abs(np.asarray(result.pressure) - field)) * result.grid.cell_area / load)


@pytest.mark.slow
def test_maxwell_half_space_creep_of_table_3():
    """N = 256, width 2.3 final contact radii each side, 100 steps over 2 tau: approach and pressure in 0.1 %."""
    body, load = jc.LayeredHalfSpace([], MAXWELL), 100.0
    final = float(lee_radok.step_radius(2.0, creep(MAXWELL), load, 3.5e-3, 0.3))
    times = jnp.linspace(0.0, 2.0, 101)
    result = quietly(body, BALL, jc.Load(load), times, grid=jc.Grid.square(256, 2.3 * final), save="last")
    exact = lee_radok.step_approach(np.asarray(times), creep(MAXWELL), load, 3.5e-3, 0.3)
    np.testing.assert_allclose(result.approach, exact, rtol=1e-3)
    error = pressure_error(result, MAXWELL, load, 3.5e-3)
    print(f"Maxwell half-space, 100 steps, N = 256: L1 pressure error {error:.2e} of the load")
    assert error < 1e-3


@pytest.mark.long
def test_papers_film_as_half_space_with_uniform_and_geometric_times(film):
    """The same figure over 7200 s in 150 steps: 0.6 %, nearly all of it space (the spike at the rim).

    In time uniform steps of 48 s are converged; geometric ones grow beyond the relaxation time of 153 s
    and need substeps.
    """
    body, load, radius = jc.LayeredHalfSpace([], film), 60.0, 9.525e-3
    final = float(lee_radok.step_radius(7200.0, creep(film), load, radius, 0.3))
    grid = jc.Grid.square(256, 2.3 * final)

    def error(times, substeps=1):
        result = quietly(
            body, jc.Sphere(radius), jc.Load(load), times, grid=grid, save="last", substeps=substeps
        )
        return pressure_error(result, film, load, radius)

    uniform = jnp.linspace(0.0, 7200.0, 151)
    geometric = jnp.append(0.0, jnp.geomspace(1.0, 7200.0, 150))
    measured = {
        "uniform": error(uniform),
        "uniform, 4 substeps": error(uniform, 4),
        "geometric": error(geometric),
        "geometric, 4 substeps": error(geometric, 4),
    }
    print("film as half-space, 150 steps to 7200 s, N = 256, L1 pressure error:", measured)
    assert measured["uniform, 4 substeps"] < 1e-2
    assert abs(measured["uniform"] - measured["uniform, 4 substeps"]) < 3e-4
    assert measured["geometric, 4 substeps"] < measured["geometric"] / 4


@pytest.mark.slow
def test_second_order_in_the_time_step():
    """Halving the step divides the L1 error in pressure by four (against a fine march on the same grid)."""
    body, load = jc.LayeredHalfSpace([], MAXWELL), 100.0
    final = float(lee_radok.step_radius(2.0, creep(MAXWELL), load, 3.5e-3, 0.3))
    grid = jc.Grid.square(48, 2.4 * final)

    def run(n, longest=160):
        # the last time again and again: steps of no length, so that one program serves all
        times = jnp.minimum(jnp.arange(longest + 1) * 2.0 / n, 2.0)
        return quietly(body, BALL, jc.Load(load), times, grid=grid, save="last", tolerance=1e-10).pressure

    fine = run(160)
    errors = [float(jnp.sum(jnp.abs(run(n) - fine)) / jnp.sum(fine)) for n in (10, 20, 40)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    print("L1 error in time with 10, 20, 40 steps:", errors, "orders", orders)
    assert np.all(orders > 1.8)
    assert errors[0] < 4e-3


@pytest.mark.slow
def test_approach_of_lee_and_radok_under_a_growing_load():
    body = jc.LayeredHalfSpace([], MAXWELL)
    times = np.linspace(0.0, 2.0, 21)
    loads = 20.0 + 60.0 * times
    result = quietly(body, BALL, jc.Load(loads), times, grid=jc.Grid.square(96, 480e-6))
    a = lee_radok.history_radius(times[1:], creep(MAXWELL), times, loads, 3.5e-3, 0.3)
    np.testing.assert_allclose(result.approach[1:], a**2 / 3.5e-3, rtol=1.5e-3)


@pytest.mark.slow
def test_relaxation_of_a_half_space_keeps_its_contact_and_follows_the_modulus():
    body, times = jc.LayeredHalfSpace([], MAXWELL), np.array([0.0, 0.3, 1.0, 2.0])
    result = quietly(body, BALL, jc.Approach(3e-6), times, grid=jc.Grid.square(64, 260e-6), substeps=8)
    assert len(set(np.asarray(result.contact_area).tolist())) == 1
    np.testing.assert_allclose(result.load / result.load[0], np.exp(-times), rtol=2e-3)


@pytest.mark.slow
def test_unloading_against_ting():
    """Depth up and down again: load within 0.5 % of its peak, loss of contact included."""
    body = jc.LayeredHalfSpace([], MAXWELL)
    times = np.linspace(0.0, 2.0, 81)
    depth = lambda t: 4e-6 * np.minimum(t, 2.0 - t)
    rate = lambda t: 4e-6 * np.where(np.asarray(t) < 1.0, 1.0, -1.0)
    result = quietly(body, BALL, jc.Approach(depth(times)), times, grid=jc.Grid.square(96, 280e-6))
    when = times[4:77:4]
    exact = np.array(
        [float(np.squeeze(ting.load(t, relaxation(MAXWELL), depth, rate, 1.0, 3.5e-3, 0.3))) for t in when]
    )
    ours = np.asarray(result.load)[4:77:4]
    assert np.max(np.abs(ours - exact)) < 5e-3 * np.max(exact)
    assert float(result.load[-1]) == 0.0


@pytest.mark.slow
def test_re_contact_remembers_the_imprint():
    """After a pause out of contact the ball meets its own imprint: touching later, more so the sooner."""
    body = jc.LayeredHalfSpace([], jc.StandardLinearSolid(2e9, 2e9, 2e9))
    grid = jc.Grid.square(48, 400e-6)
    times = np.array([0.0, 5.0, 5.0, 5.5, 5.5])
    approaches = np.array([5e-6, 5e-6, -1e-6, -1e-6, 5e-6])
    pause = lambda wait: quietly(
        body, BALL, jc.Approach(approaches), np.array([0, 5.0, 5.0, 5.0 + wait, 5.0 + wait]), grid=grid
    )
    soon, late = pause(0.2), pause(20.0)
    assert float(soon.load[2]) == 0.0 == float(soon.load[3])
    assert times.size == soon.load.size
    assert float(soon.load[4]) < float(late.load[4]) < float(late.load[0]) * (1 + 1e-6)
    assert float(late.load[4]) == pytest.approx(float(late.load[0]), rel=1e-6)


@pytest.mark.versions
@pytest.mark.parametrize(("load", "approach", "peak", "radius", "papers"), [
    pytest.param(10.0, 0.780865e-6, 0.630787e9, 89.94e-6, 0.7796e-6, marks=pytest.mark.slow),
    (60.0, 2.55166e-6, 1.16724e9, 160.207e-6, 2.5468e-6),
    pytest.param(500.0, 10.41896e-6, 2.39395e9, 320.06e-6, 10.4002e-6, marks=pytest.mark.slow),
])  # fmt: skip
def test_tribofilm_at_once(body, ball, load, approach, peak, radius, papers):
    """Table 4 and 5 at t = 0, N = 256: the truth in 0.05 %, peak pressure 0.2 %, the paper's own in 0.3 %."""
    result = quietly(body, ball, jc.Load(load), np.zeros(1), grid=jc.Grid.square(256, 2.6 * radius))
    assert float(result.approach[0]) == pytest.approx(approach, rel=APPROACH)
    assert float(result.approach[0]) == pytest.approx(papers, rel=3e-3)
    assert float(jnp.max(result.pressure)) == pytest.approx(peak, rel=PEAK)
    assert float(result.contact_radius[0]) == pytest.approx(radius, rel=RADIUS)


@pytest.mark.parametrize("ratio", [1e-3, 0.03, 0.3, 1.0, 10.0])
def test_elastic_layer_against_the_axisymmetric_solution(ratio):
    """h/a from 1e-3 to 10, a layer a tenth as stiff as its substrate, rigid ball."""
    Gs, R, a = 80e9, 10e-3, 150e-6
    oracle_body = abel.Layered(8e9, 0.3, ratio * a, Gs, 0.3)
    oracle = abel.solve_radius(a, oracle_body, R)
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(8e9, 0.3), ratio * a)], jc.Elastic(Gs, 0.3))
    result = quietly(body, jc.Sphere(R), jc.Load(oracle.load), np.zeros(1), grid=jc.Grid.square(128, 2.5 * a))
    assert float(result.approach[0]) == pytest.approx(oracle.approach, rel=APPROACH)
    assert float(jnp.max(result.pressure)) == pytest.approx(
        float(np.squeeze(abel.pressure(0.0, oracle))), rel=2 * PEAK
    )
    assert float(result.contact_radius[0]) == pytest.approx(a, rel=RADIUS)


@pytest.mark.slow
@pytest.mark.parametrize(("h", "load", "table"), [
    (50e-6, 0.2, [(155.0, 91.1194e-6, 0.509166e-6), (600.0, 115.0027e-6, 0.784127e-6), (2000.0, 148.7259e-6, 1.273746e-6)]),
    (10e-6, 1.0, [(155.0, 97.4761e-6, 0.528176e-6), (600.0, 120.8646e-6, 0.796635e-6), (2000.0, 154.2471e-6, 1.280290e-6)]),
])  # fmt: skip
def test_creeping_layer_against_the_axisymmetric_march(film, steel, h, load, table):
    """Growing contact on a Burgers layer: an independent march in Abel densities (accuracy 2e-5)."""
    body = jc.LayeredHalfSpace([jc.Layer(film, h)], steel)
    times = jnp.append(0.0, jnp.geomspace(5.0, 2000.0, 40))
    times = jnp.sort(jnp.append(times, jnp.array([155.0, 600.0])))
    result = quietly(body, jc.Sphere(9.525e-3), jc.Load(load), times, grid=jc.Grid.square(96, 400e-6))
    for t, a, approach in table:
        i = int(jnp.argmin(jnp.abs(times - t)))
        assert float(result.approach[i]) == pytest.approx(approach, rel=APPROACH)
        assert float(result.contact_radius[i]) == pytest.approx(a, abs=0.05 * 400e-6 / 96)


@jax.jit
def step(memory, fields, old, new, inputs):
    coming = memory.predict(fields, old, inputs)
    return coming.earlier + coming.operator(new), memory.update(coming.fields, new, inputs)


def both_ways(body, ball, grid, times, pressures):
    """Displacements from given pressures by the recursion and by the direct superposition."""
    kernels = jc.kernels(body, ball, grid)
    one = RecursiveMemory(kernels)
    dt = fine_steps(times, 1)
    unused = Delayed(jnp.zeros(1), jnp.zeros(1))  # of the estimate of the error of the steps
    two = DirectMemory(build_images(body, ball, grid), unused, times.size)
    table = jax.jit(rows, static_argnames="quasi_elastic")(body, ball, times, quasi_elastic=False)
    first, second, p = one.start(grid.shape), two.start(grid.shape), jnp.zeros(grid.shape)
    ours, direct = [], []
    for n in range(times.size):
        row = jax.tree.map(lambda a, n=n: a[n], table)
        u, first = step(one, first, p, pressures[n], dt[n, 0])
        v, second = step(two, second, p, pressures[n], row)
        p = pressures[n]
        ours.append(u)
        direct.append(v)
    return jnp.stack(ours), jnp.stack(direct)


TIMES = jnp.array([0.0, 3.0, 3.0, 40.0, 300.0, 301.0, 5000.0])


@pytest.mark.slow
def test_recursion_equals_superposition_for_given_pressures_and_kernels(film):
    """A half-space has one kernel in space, so both ways use the same: equal to round-off."""
    body, grid = jc.LayeredHalfSpace([], film), jc.Grid.square(12, 1e-4)
    pressures = jnp.asarray(np.random.default_rng(5).random((TIMES.size, 12, 12)))
    ours, direct = both_ways(body, jc.Sphere(1e-2), grid, TIMES, pressures)
    np.testing.assert_allclose(ours, direct, rtol=ROUND_OFF)


@pytest.mark.slow
def test_recursion_equals_superposition_with_exact_kernels_to_the_separation_error(body, ball):
    grid = jc.Grid.square(12, 1e-4)
    pressures = jnp.asarray(np.random.default_rng(5).random((TIMES.size, 12, 12)))
    ours, direct = both_ways(body, ball, grid, TIMES, pressures)
    np.testing.assert_allclose(ours, direct, rtol=SEPARATION)


@pytest.mark.long
def test_quasi_elastic_equals_exact_for_the_papers_film(body, ball):
    times, grid = jnp.linspace(0.0, 7200.0, 9), jc.Grid.square(32, 600e-6)
    exact = quietly(body, ball, jc.Load(60.0), times, grid=grid)
    quasi = quietly(body, ball, jc.Load(60.0), times, grid=grid, correspondence="quasi-elastic")
    np.testing.assert_allclose(quasi.approach, exact.approach, rtol=1e-6)
    np.testing.assert_allclose(quasi.film_strain, exact.film_strain, rtol=1e-5)
    assert float(jnp.max(jnp.abs(quasi.pressure - exact.pressure))) < 1e-5 * float(jnp.max(exact.pressure))


def test_film_strain_is_that_of_a_bed_of_springs_and_warns(body, ball, film):
    """Thin film: shortening/h = (1 - 2 nu)/(2 (1 - nu)) J p at first; above 0.2 there is a warning."""
    grid = jc.Grid.square(256, 416e-6)
    with pytest.warns(UserWarning, match="film strain"):
        result = jc.indent(body, ball, jc.Load(60.0), np.zeros(1), grid=grid)
    expected = 0.4 / 1.4 / film.G1 * float(jnp.max(result.pressure))
    assert float(result.film_strain[0]) == pytest.approx(expected, rel=2e-3)


@pytest.mark.long
def test_substeps_save_and_kernels_change_nothing_but_the_cost(body, ball):
    times, grid = jnp.linspace(0.0, 900.0, 4), jc.Grid.square(24, 600e-6)
    whole = quietly(body, ball, jc.Load(60.0), times, grid=grid, substeps=3)
    fine = quietly(body, ball, jc.Load(60.0), jnp.linspace(0.0, 900.0, 10), grid=grid)
    np.testing.assert_allclose(whole.approach, fine.approach[::3], rtol=1e-7)
    last = quietly(
        body,
        ball,
        jc.Load(60.0),
        times,
        grid=grid,
        substeps=3,
        save="last",
        kernels=jc.kernels(body, ball, grid),
    )
    np.testing.assert_allclose(last.pressure, whole.pressure[-1], rtol=1e-9)
    peaks = quietly(body, ball, jc.Load(60.0), times, grid=grid, substeps=3, save=lambda o: o.pressure.max())
    assert peaks.saved.shape == (4,)


@pytest.mark.long
def test_extreme_approaches_of_figure_12(body, ball, film, steel):
    """50 um: Hertz on steel in 1 %; 0.01 nm: the radius stays, the pressure falls as the film relaxes.

    The fall is 57-fold, that of the relaxation modulus, not the 33-fold growth of J: the oracle is the
    layered axisymmetric solution of a punch of the contact's size, inverted by Talbot.
    """
    grid = jc.Grid.square(256, 1.8e-3)
    deep = quietly(body, ball, jc.Approach(50e-6), np.zeros(1), grid=grid)
    assert float(jnp.max(deep.pressure)) == pytest.approx(5.322e9, rel=1e-2)
    times = jnp.append(0.0, jnp.geomspace(10.0, 7200.0, 24))
    shallow = quietly(body, ball, jc.Approach(0.01e-9), times, grid=jc.Grid.square(96, 1.2e-6), substeps=8)
    radius = np.asarray(shallow.contact_radius)
    assert np.all((radius > 0.408e-6 * 0.99) & (radius < 0.415e-6 * 1.02))
    fall = float(shallow.load[0] / shallow.load[-1])
    layered = abel.Layered(film.G1, 0.3, 150e-9, steel.G, 0.3, 0.7 / steel.G)

    def stiffness(s):
        modulus = 1.0 / (1.0 / film.G1 + 1.0 / (film.G2 + film.eta2 * s) + 1.0 / (film.eta1 * s))
        bodies = [layered._replace(layer_modulus=complex(g)) for g in np.ravel(modulus)]
        compliance = np.array([abel.punch_compliance(0.41e-6, b) for b in bodies])
        return 1.0 / (s * compliance.reshape(np.shape(s)))

    relaxed = float(np.squeeze(abel.talbot(stiffness, 7200.0)))
    expected = 1.0 / abel.punch_compliance(0.41e-6, layered) / relaxed
    assert fall == pytest.approx(expected, rel=3e-2)
    assert 50.0 < expected < 62.0


@pytest.mark.long
def test_the_gap_of_many_runs_is_zero_in_contact_in_each():
    """Whatever axes vmap has put before, with the fields of all times or of the last."""
    grid, times, body = jc.Grid.square(16, 2.2e-3), jnp.array([0.0, 300.0]), jc.LayeredHalfSpace([], MAXWELL)
    for save in ("all", "last"):
        run = lambda load, s=save: quietly(body, BALL, jc.Load(load), times, grid=grid, save=s)
        many = jax.jit(jax.vmap(run))(jnp.array([50.0, 60.0]))
        assert many.gap.shape == many.pressure.shape
        outside = jnp.where(many.pressure > 0.0, 0.0, many.gap) / many.approach[0, 0]
        assert float(jnp.max(jnp.abs(many.gap / many.approach[0, 0] - outside))) < 1e-6
        assert float(jnp.max(outside)) > 1.0


@pytest.mark.slow
def test_heights_that_are_constants_are_not_sorted_while_compiling(steel):
    """XLA sorts a constant by itself, for minutes at 256 x 256."""
    heights = np.random.default_rng(0).normal(0.0, 1e-9, (64, 64))
    body, grid = jc.LayeredHalfSpace([], substrate=steel), jc.Grid.square(n=64, width=1e-4)
    run = lambda load: jc.indent(body, jc.HeightField(heights), jc.Load(load), [0.0], grid=grid).approach
    program = jax.jit(run).lower(1e-3).as_text()
    sorts = [part[:1500] for part in program.split('"stablehlo.sort"')[1:]]
    assert "tensor<64x64xf64>" in program
    assert not any("tensor<4096x" in sort or "tensor<64x64x" in sort for sort in sorts)
