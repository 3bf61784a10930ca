"""Rubbing: films and indenters that form and wear by a law, against closed forms and integrations of their own."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:only", "ignore:film strain")]
BASE = jc.Elastic(G=80e9, nu=0.3)
FILM = jc.Elastic(G=20e9, nu=0.3)
LINE = jc.Grid((32, 1), (4e-6, 1e-3), periodic=(False, True))
ROLLER = jc.Cylinder(5e-3, length=1e-3)
FLAT = jc.Grid((8, 8), (1e-6, 1e-6), periodic=True)
PUNCH = jc.HeightField(np.zeros((8, 8)))
TIMES = np.linspace(0.0, 100.0, 6)
KELVIN = 1.380649e-23 * 373.0


def on_a_line(law, thickness=1e-6, times=TIMES, load=50.0, velocity=0.1, film=FILM, **options):
    body = jc.LayeredHalfSpace([jc.Layer(film, thickness)], BASE)
    load = jc.Load(load)
    return jc.rub(
        body, ROLLER, load, times, velocity=velocity, law=law, grid=LINE, tolerance=1e-11, **options
    )


def in_full_contact(law, thickness=1e-8, times=TIMES, load=0.01, **options):
    """Of a flat punch on all of a periodic grid: the pressure is load/area everywhere."""
    body = jc.LayeredHalfSpace([jc.Layer(FILM, thickness)], BASE)
    return jc.rub(
        body, PUNCH, jc.Load(load), times, velocity=0.1, law=law, grid=FLAT, thickest=4e-8, **options
    )


def test_archard_wears_coefficient_times_load_times_path():
    load, speed = np.linspace(20.0, 60.0, 6), np.linspace(0.05, 0.2, 6)
    velocity = np.stack([0.6 * speed, 0.8 * speed], -1)
    worn = on_a_line(jc.Archard(2e-18), load=load, velocity=velocity)
    volume = np.sum(worn.thickness[0] - worn.thickness, (1, 2)) * LINE.cell_area
    product = load * speed
    path = np.append(0.0, np.cumsum((product[1:] + product[:-1]) / 2 * np.diff(TIMES)))
    np.testing.assert_allclose(volume, 2e-18 * path, rtol=1e-4, atol=1e-30)
    work = worn.friction_work.sum()
    assert work == 0.0 and np.all(worn.converged)


def test_removal_of_a_film_adds_nothing_to_an_indenter_that_is_worn():
    """Below its first surface there is no film to remove: the volume is Archard's, coefficient x load x path."""
    half_space = jc.LayeredHalfSpace([], BASE)
    law = jc.Archard(2e-18) + jc.ProportionalRemoval(rate=0.005)
    worn = jc.rub(
        half_space, ROLLER, jc.Load(50.0), TIMES, velocity=0.1, law=law, grid=LINE, wears="indenter"
    )
    assert np.all(worn.status == 0)
    np.testing.assert_allclose(
        -worn.thickness[-1].sum() * LINE.cell_area, 2e-18 * 50.0 * 0.1 * 100.0, rtol=1e-3
    )


def test_an_indenter_worn_in_plane_strain_against_an_integration_of_its_own():
    """A rigid roller on a half-space: influence of strips in closed form, sets of contact, fine midpoint steps."""
    coefficient, load, n, dx = 2e-17, 50.0, 32, 4e-6
    half_space = jc.LayeredHalfSpace([], BASE)
    run = jc.rub(
        half_space, ROLLER, jc.Load(load), TIMES, velocity=0.1, law=jc.Archard(coefficient), grid=LINE, tolerance=1e-11,
        wears="indenter", substeps=4,
    )  # fmt: skip
    x = (np.arange(n) - (n - 1) / 2) * dx
    ends = lambda s: np.where(s == 0.0, 0.0, s * np.log(np.abs(np.where(s == 0.0, 1.0, s))))
    offsets = np.subtract.outer(x, x)
    strips = -(1 - 0.3) / (np.pi * 80e9) * (ends(offsets + dx / 2) - ends(offsets - dx / 2))

    def pressed(gap):
        active = np.ones(n, bool)
        for _ in range(200):
            m = active.sum()
            matrix = np.block(
                [[strips[np.ix_(active, active)], -np.ones((m, 1))], [dx * np.ones((1, m)), np.zeros((1, 1))]]
            )
            found = np.linalg.solve(matrix, np.append(-gap[active], load / 1e-3))
            p = np.zeros(n)
            p[active] = found[:-1]
            if np.all(p >= 0.0):
                break
            active &= p > 0.0
        outside = strips @ p + gap - found[-1]
        assert np.all(outside[~active] >= -1e-12)
        return p

    wear, profile, fine = np.zeros(n), x**2 / (2 * 5e-3), 100.0 / 400
    for _ in range(400):
        middle = wear + fine / 2 * coefficient * 0.1 * pressed(profile + wear)
        wear = wear + fine * coefficient * 0.1 * pressed(profile + middle)
    np.testing.assert_allclose(-run.thickness[-1, :, 0], wear, atol=2e-3 * wear.max())
    np.testing.assert_allclose(
        run.pressure[-1, :, 0], pressed(profile + wear), atol=5e-3 * pressed(profile).max()
    )
    assert run.pressure[-1].max() < 0.8 * run.pressure[0].max()


@pytest.mark.parametrize("stress", ["pressure", "shear"])
def test_growth_at_a_pressure_that_does_not_change_is_the_integral(stress):
    rate, energy, volume, friction = 1e-2, 1.0e-19, 4e-30, 0.2
    law = jc.StressActivated(rate, energy, volume, 373.0, stress=stress)
    run = in_full_contact(law, friction=friction)
    pressure = 0.01 / (8e-6) ** 2
    driver = pressure if stress == "pressure" else friction * pressure
    expected = 1e-8 + TIMES * rate * np.exp(-(energy - volume * driver) / KELVIN)
    np.testing.assert_allclose(run.thickness[:, 3, 4], expected, rtol=1e-6)
    np.testing.assert_allclose(run.friction_work, friction * pressure * 0.1 * 100.0, rtol=1e-9)
    assert expected[-1] > 1.2e-8


def test_growth_and_removal_reach_their_steady_state():
    """dh/dt = g - r h: h = g/r + (h0 - g/r) exp(-r t)."""
    growth, removal = 1e-10, 0.05
    law = jc.StressActivated(growth, 0.0, 0.0, 373.0) + jc.ProportionalRemoval(removal)
    times = np.linspace(0.0, 200.0, 41)
    run = in_full_contact(law, times=times, substeps=2)
    expected = 2e-9 + 8e-9 * np.exp(-removal * times)
    np.testing.assert_allclose(run.thickness[:, 0, 0], expected, rtol=1e-6)
    np.testing.assert_allclose(run.thickness[-1], 2e-9, rtol=1e-3)


def test_second_order_in_the_step():
    law = jc.StressActivated(1e-9, 0.0, 4e-30, 373.0) + jc.Archard(5e-18)

    def at_the_end(steps):
        times = 100.0 * np.minimum(np.arange(13) / steps, 1.0)
        run = on_a_line(law, times=times, film=jc.Maxwell(20e9, 2e12, 0.3), thickest=2e-6)
        return np.asarray(run.thickness[-1, :, 0])

    coarse, middle, fine = map(at_the_end, (3, 6, 12))
    centre = slice(12, 20)  # cells in contact throughout
    ratio = np.linalg.norm((coarse - middle)[centre]) / np.linalg.norm((middle - fine)[centre])
    assert ratio == pytest.approx(4.0, rel=0.35)


@pytest.mark.parametrize("removal", [0.05, 5.0])
def test_removal_is_exact_for_steps_of_any_length(removal):
    """h = g/r + (h0 - g/r) exp(-r t) under a constant pressure: r dt = 1 and 100."""
    law = jc.StressActivated(4e-9 * removal, 0.0, 0.0, 373.0) + jc.ProportionalRemoval(removal)
    run = in_full_contact(law)
    expected = 4e-9 + 6e-9 * np.exp(-removal * TIMES)
    np.testing.assert_allclose(run.thickness[:, 2, 5], expected, rtol=1e-7)
    assert np.all(run.converged) and run.step_error[-1] < 1e-12


@pytest.mark.filterwarnings("ignore:.*steps, the first")
def test_a_step_that_is_too_long_says_so():
    run = on_a_line(jc.Archard(4e-16), thickness=4e-6)
    assert jc.Status.STEP_TOO_LONG in np.asarray(run.status).tolist()
    thick = in_full_contact(jc.StressActivated(1e-9, 0.0, 0.0, 373.0))
    assert int(thick.status[-1]) == jc.Status.TOO_THICK


@pytest.mark.long
def test_automatic_substeps_of_a_law_that_is_too_stiff_for_one():
    """Wear of a cylinder that one step between two times cannot follow: against many short steps."""
    law, times = jc.Archard(2e-17), np.array([0.0, 50.0, 100.0])
    given = {"thickness": 4e-6, "times": times}
    found = on_a_line(law, substeps="auto", **given)
    assert np.all(found.converged)
    fine = on_a_line(law, substeps=200, **given)
    off = np.abs(found.thickness[-1] - fine.thickness[-1]).max()
    assert off < 0.01 * np.ptp(fine.thickness[-1]) and off < 2.0 * found.step_error[-1]


def test_automatic_substeps_that_are_not_enough_have_a_note(monkeypatch):
    """An error of 4 %, with which a run with a given number of substeps has no note."""
    monkeypatch.setattr("jaxcontact.simulate.run.REFINED", (1,))
    with pytest.warns(UserWarning, match='an estimated error of 4.1 %.*substeps="auto" has no smaller ones'):
        run = on_a_line(jc.Archard(2e-17), substeps="auto", thickness=4e-6, times=np.array([0.0, 25.0, 50.0]))
    assert np.all(run.converged)


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True)
class Oxidation:
    """A law of a user: no base class, no check."""

    speed: float

    def rate(self, step):
        return self.speed * jnp.exp(-step.thickness / 1e-8)


def test_a_law_of_a_user_adds_to_others():
    """dh/dt = s exp(-h/d): h = d log(exp(h0/d) + s t/d)."""
    run = in_full_contact(Oxidation(1e-10) + jc.Archard(0.0), substeps=8)
    expected = 1e-8 * np.log(np.exp(1.0) + 1e-10 * TIMES / 1e-8)
    off = np.abs(run.thickness[:, 0, 0] - expected)
    assert np.all(off < 2e-4 * expected)
    assert np.all(off <= run.step_error + 1e-15) and run.step_error[-1] < 50 * off.max()


@pytest.mark.long
def test_derivatives_by_law_load_and_speed():
    """Forward and reverse mode, and central differences, of final thickness and pressure."""
    point = jnp.array([1e-9, 2e-20, 4e-30, 5e-18, 50.0, 0.1])

    def found(scale):
        rate, energy, volume, wear, load, speed = scale * point
        law = jc.StressActivated(rate, energy, volume, 373.0) + jc.Archard(wear)
        times = np.linspace(0.0, 60.0, 4)
        film = jc.Maxwell(20e9, 2e12, 0.3)
        run = on_a_line(law, times=times, load=load, velocity=speed, film=film, thickest=2e-6)
        return jnp.stack([jnp.sum(run.thickness[-1] ** 2) * 1e12, jnp.sum(run.pressure[-1] ** 2) * 1e-18])

    one = jnp.ones(6)
    forward, reverse = jax.jit(jax.jacfwd(found))(one), jax.jit(jax.jacrev(found))(one)
    np.testing.assert_allclose(reverse, forward, rtol=1e-7, atol=1e-7 * np.abs(forward).max())
    run = jax.jit(found)
    for i in range(6):
        step = 1e-4 * np.eye(6)[i]
        difference = (run(one + step) - run(one - step)) / 2e-4
        np.testing.assert_allclose(
            forward[:, i], difference, rtol=1e-4, atol=1e-4 * np.abs(forward).max(1).min()
        )


DISC = jc.Grid.square(16, 64e-6)


def heated(law, thermal, friction=0.3, load=2.0, velocity=2.0, **options):
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(G=1e9, nu=0.3), 1e-7)], BASE)
    times = np.linspace(0.0, 10.0, 3)
    return jc.rub(
        body, jc.Sphere(2e-3), jc.Load(load), times, velocity=velocity, law=law, grid=DISC, friction=friction,
        thermal=thermal, thickest=3e-7, **options,
    )  # fmt: skip


@pytest.mark.long
def test_friction_heats_the_surface_and_heat_drives_growth(tmp_path):
    """The temperature is that of ``flash_temperature`` at rest, which has oracles of its own; growth follows Arrhenius."""
    law = jc.StressActivated(1e-9, 2e-20, 0.0, None)
    run = heated(law, jc.Thermal(ambient=350.0, conductivity=46.0, share=0.6))
    flux = 0.6 * 0.3 * run.pressure[0] * 2.0
    rise = jc.flash_temperature(flux, DISC, velocity=0.0, conductivity=46.0, diffusivity=1e-5)
    np.testing.assert_allclose(run.temperature[0] - 350.0, rise, rtol=1e-6)
    assert rise.max() > 5.0
    speed = np.where(run.pressure[0] > 0.0, 1e-9 * np.exp(-2e-20 / (1.380649e-23 * run.temperature[0])), 0.0)
    np.testing.assert_allclose(
        run.thickness[-1] - run.thickness[0], 10.0 * speed, rtol=2e-2, atol=1e-2 * 10.0 * speed.max()
    )
    again = jc.read_result(jc.write_result(run, tmp_path / "hot.npz"))
    np.testing.assert_array_equal(again.temperature, run.temperature)
    cold = heated(jc.Archard(0.0), None)
    assert cold.temperature is None
    assert jc.read_result(jc.write_result(cold, tmp_path / "cold.npz")).temperature is None
    work = np.sum(cold.friction_work) * DISC.cell_area
    assert work == pytest.approx(0.3 * 2.0 * 2.0 * 10.0, rel=1e-6)


@pytest.mark.long
def test_derivatives_of_a_heated_film():
    """Of final thickness, peak pressure and peak temperature by all that growth under shear stress, removal and heat depend
    on: forward and reverse mode, and central differences."""
    point = jnp.array([4e-9, 2e-20, 2e-29, 1e-2, 2.0, 2.0, 46.0])

    def found(scale):
        rate, energy, volume, removal, load, speed, conductivity = scale * point
        law = jc.StressActivated(rate, energy, volume, None, stress="shear") + jc.ProportionalRemoval(removal)
        run = heated(law, jc.Thermal(350.0, conductivity), load=load, velocity=speed, tolerance=1e-11)
        peak = jnp.max(run.pressure[-1]) * 1e-9
        return jnp.stack([jnp.max(run.thickness[-1]) * 1e7, peak, jnp.max(run.temperature[-1]) * 1e-2])

    one, run = jnp.ones(7), jax.jit(found)
    forward, reverse = jax.jit(jax.jacfwd(found))(one), jax.jit(jax.jacrev(found))(one)
    np.testing.assert_allclose(reverse, forward, rtol=1e-7, atol=1e-7 * np.abs(forward).max())
    differences = [(run(one + step) - run(one - step)) / 2e-4 for step in 1e-4 * np.eye(7)]
    np.testing.assert_allclose(forward, np.stack(differences, 1), rtol=1e-4, atol=1e-5)
    assert np.all(np.abs(forward[0]) > 3e-4)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("kelvin", "noted"), [(100.0, True), (373.0, False)])
@pytest.mark.long
def test_degrees_celsius_are_noticed(kelvin, noted):
    law = jc.StressActivated(1e-9, 0.0, 0.0, kelvin)
    run = jax.jit(lambda: in_full_contact(law))()
    assert any(note.startswith("a temperature of 100 K") for note in run.notes) == noted
    hot = jax.jit(lambda: heated(jc.Archard(0.0), jc.Thermal(kelvin, 46.0)))()
    assert any(note.startswith("a temperature of 100 K") for note in hot.notes) == noted


def test_what_save_keeps_of_a_rubbing():
    run = heated(jc.Archard(1e-18), None, save=lambda step: step.thickness.min())
    every = heated(jc.Archard(1e-18), None)
    np.testing.assert_allclose(run.saved, every.thickness.min((1, 2)), rtol=1e-12)
    np.testing.assert_array_equal(run.thickness, every.thickness[-1])


CREEPING = jc.StandardLinearSolid(G1=1e9, G2=1e9, eta2=4e9, nu=0.3)


def warmed(film, thermal, times, **options):
    body = jc.LayeredHalfSpace([jc.Layer(film, 2e-6)], BASE)
    given = {"velocity": 0.0, "friction": 0.3, "law": jc.Archard(0.0), "tolerance": 1e-11, "thickest": 4e-6}
    ball, load = jc.Sphere(0.5e-3), jc.Load(0.05)
    return jc.rub(body, ball, load, times, grid=DISC, thermal=thermal, **(given | options))


@pytest.mark.filterwarnings("ignore:the time steps have an estimated error")  # which both runs share
@pytest.mark.long
def test_a_body_at_one_temperature_has_the_times_of_the_shifted_material():
    """At rest the contact is at ambient temperature: ln a_T = E/k (1/T - 1/T0), and log10 a_T of WLF."""
    times = np.linspace(0.0, 8.0, 5)
    arrhenius = jc.ArrheniusShift(activation_energy=1.2e-19, reference=373.0)
    wlf = jc.WLFShift(c1=10.0, c2=100.0, reference=373.0)
    factors = (np.exp(1.2e-19 / 1.380649e-23 * (1 / 390.0 - 1 / 373.0)), 10.0 ** (-10.0 * 17.0 / 117.0))
    for shift, factor in zip((arrhenius, wlf), factors, strict=True):
        run = warmed(CREEPING, jc.Thermal(390.0, 46.0, shift=shift), times)
        expected = warmed(CREEPING.shifted(factor), None, times)
        np.testing.assert_allclose(
            run.pressure[1:], expected.pressure[1:], atol=1e-7 * float(run.pressure.max())
        )
        assert 0.02 < factor < 0.5


@pytest.mark.long
def test_a_contact_that_warms_creeps_in_reduced_time():
    """The load is held while the speed rises: the contact is that of the same film without heat at the reduced times, the
    integrals of 1/a_T at the mean temperature of the contact."""
    times = np.linspace(0.0, 4.0, 33)
    velocity = np.stack([1.25 * times, 0.0 * times], -1)
    shift = jc.ArrheniusShift(activation_energy=5e-20, reference=350.0)
    run = warmed(CREEPING, jc.Thermal(350.0, 46.0, shift=shift), times, velocity=velocity)
    mean = [t[p > 0.0].mean() for t, p in zip(run.temperature, run.pressure, strict=True)]
    speeds = np.exp(-5e-20 / 1.380649e-23 * (1.0 / np.array(mean) - 1.0 / 350.0))
    reduced = np.append(0.0, np.cumsum((speeds[1:] + speeds[:-1]) / 2.0 * np.diff(times)))
    assert speeds[-1] > 1.5
    expected = warmed(CREEPING, None, reduced)
    unshifted = warmed(CREEPING, None, times)
    off = lambda other: float(np.max(np.abs(run.approach - other.approach)))
    assert off(expected) < 1e-2 * off(unshifted)


@pytest.mark.filterwarnings("ignore:the time steps")
@pytest.mark.parametrize(
    "velocity, path",
    [
        ([[0.1, 0.0], [-0.1, 0.0], [0.1, 0.0]], 5.0),  # |v| linear to zero and back
        (
            [[0.1, 0.0], [0.0, 0.1], [-0.1, 0.0]],
            10.0 * (1.0 + np.arcsinh(1.0) / np.sqrt(2.0)) / np.sqrt(2.0) / np.sqrt(2.0),
        ),
    ],
    ids=["a reversal", "a quarter turn"],
)
def test_wear_and_work_follow_the_path_where_the_direction_changes_within_a_step(velocity, path):
    """coefficient x load x path, with the integral of |v| in closed form; whatever the substeps."""
    body, grid = jc.LayeredHalfSpace([], jc.Elastic(G=1e9, nu=0.3)), jc.Grid.square(n=16, width=120e-6)
    for substeps in (1, 3):
        worn = jc.rub(
            body, jc.Sphere(2e-3), jc.Load(0.1), [0.0, 50.0, 100.0], velocity=np.array(velocity), law=jc.Archard(1e-18),
            grid=grid, wears="indenter", friction=0.2, substeps=substeps,
        )  # fmt: skip
        assert np.all(worn.status == jc.Status.FINE)
        assert -np.sum(worn.thickness[-1]) * grid.cell_area == pytest.approx(1e-18 * 0.1 * path, rel=1e-9)
        assert np.sum(worn.friction_work) * grid.cell_area == pytest.approx(0.2 * 0.1 * path, rel=1e-9)


def test_the_slope_in_the_notes_is_that_of_the_film_that_has_formed():
    """A flat film that grows where there is contact has a step at the edge of contact."""
    run = on_a_line(jc.StressActivated(5e-9, 0.0, 0.0, 373.0), thickness=1e-7, thickest=2e-6)
    slope = np.abs(np.diff(run.thickness, axis=1)).max() / 4e-6
    assert slope > 0.02 and float(run.diagnostics.thickness_slope) == pytest.approx(slope, rel=1e-12)


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True)
class Passivation:
    speed: float

    def rate(self, step):
        return self.speed * jnp.exp(-step.thickness / 1e-9)


@pytest.mark.parametrize(("count", "noted"), [(6, True), (161, False)])
@pytest.mark.filterwarnings("ignore:the time steps")
@pytest.mark.long
def test_long_steps_on_a_film_thinner_than_the_approach_are_noted(count, noted):
    """Against h = l log(e^(h0/l) + speed t/l): the error of the thickness is far below the approach, and status 0."""
    times, steel = np.linspace(0.0, 1000.0, count), jc.Elastic(80e9, 0.3)
    body, grid = jc.LayeredHalfSpace([jc.Layer(steel, 1e-9)], steel), jc.Grid.square(24, 300e-6)
    given = {"velocity": 0.1, "law": Passivation(1e-10), "grid": grid, "thickest": 2e-8}
    run = jc.rub(body, jc.Sphere(5e-3), jc.Load(3.0), times, **given)
    error = np.asarray(run.thickness)[:, 0, 0] / 1e-9 - np.log(np.e + 0.1 * times)
    found = [note for note in run.notes if note.startswith("the time steps")]
    assert np.all(run.converged) and (np.abs(error).max() > 0.3) == bool(found) == noted


def test_a_known_path_along_x_may_be_given_inside_jit():
    film = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9, 0.3), 1e-6)], jc.Elastic.from_young(70e9))
    given = {"path": [-1e-6, 0.0, 1e-6], "law": jc.Archard(1e-17), "grid": jc.Grid.square(16, 12e-6)}
    run = lambda load: jc.rub(film, jc.Sphere(1e-4), jc.Load(load), [0.0, 0.5, 1.0], **given).position
    assert jax.eval_shape(run, 1e-3).shape == (3, 2)


@pytest.mark.long
def test_a_film_without_growth_has_no_peaks_by_rounding():
    grid = jc.Grid(shape=(24, 20), spacing=(1e-6, 1.5e-6))
    x, y = (np.asarray(axis) for axis in grid.coordinates())
    thickness = 2e-6 + 0.3e-6 * np.sin(2 * np.pi * y / 30e-6) + 0.1e-6 * np.cos(2 * np.pi * x / 24e-6)
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9, 0.4), thickness)], BASE)
    still = jc.rub(body, jc.Sphere(1e-4), jc.Load(5e-4), [0.0, 1.0], velocity=0.1, law=None, grid=grid)
    np.testing.assert_allclose(still.thickness[-1], thickness, rtol=1e-12)
    assert not any("grown peaks" in note for note in still.notes)


@pytest.mark.long
def test_behind_a_step_that_is_too_long_the_derivatives_are_as_finite_as_the_values():
    """Wear that a step cannot follow, for 120 steps: perturbations grow in each, and would overflow if none were held."""
    times = np.linspace(0.0, 100.0, 120)

    def run(coefficient):
        worn = on_a_line(jc.Archard(coefficient), times=times)
        return (worn.thickness[-1] / 1e-6, worn.approach[-1] / 1e-6, worn.friction_work), worn.status

    values, status = jax.jit(run)(1e-12)
    assert jc.Status.STEP_TOO_LONG in np.asarray(status).tolist()
    forward = jax.jit(jax.jacfwd(lambda c: run(c * 1e-12)[0]))(1.0)
    reverse = jax.jit(jax.grad(lambda c: sum(jnp.sum(term) for term in run(c * 1e-12)[0])))(1.0)
    assert all(np.all(np.isfinite(each)) for each in jax.tree.leaves((values, forward, reverse)))
    assert float(reverse) == pytest.approx(sum(float(np.sum(each)) for each in forward), rel=1e-6)
