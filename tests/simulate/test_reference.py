"""The oracles agree with published tables, with each other and with their own limits."""

import numpy as np
import pytest

from jaxcontact.reference import abel, hertz, lee_radok, ting

EXACT = 1e-9  # relative: closed forms and converged quadrature
TABLE = 2e-7  # relative: as many digits as the tables print
FILM = 2e-4  # relative: radius and peak pressure on a very thin film as tabulated
MARCH = 1.5e-4  # relative: 40 steps in time

STEEL = 210e9 / 2.6
NU = 0.3
BALL = 9.525e-3


def maxwell_creep(t):
    return (1.0 + t) / 1e9


def maxwell_relaxation(t):
    return 1e9 * np.exp(-t)


def burgers_modulus(s):
    return 1.0 / (1.0 / 0.75e9 + 1.0 / (13.89e6 + 120.9e9 * s) + 1.0 / (3.1486e12 * s))


def disc_integral(pressure, a):
    """2 pi int p r dr with r = a sin, smooth at the edge."""
    x, w = np.polynomial.legendre.leggauss(80)
    angle = np.pi / 4 * (1 + x)
    area = 2 * np.pi * a**2 * np.sin(angle) * np.cos(angle)
    return np.pi / 4 * np.sum(w * pressure(a * np.sin(angle)) * area)


def test_hertz_pressure_carries_the_load_and_gives_the_papers_figures():
    A = hertz.compliance((STEEL, NU))
    a = hertz.contact_radius(20.0, 18e-3, A)
    assert a == pytest.approx(105.373e-6, rel=1e-5)
    assert hertz.peak_pressure(20.0, 18e-3, A) == pytest.approx(860.03e6, rel=1e-5)
    assert disc_integral(lambda r: hertz.pressure(r, 20.0, 18e-3, A), a) == pytest.approx(20.0, rel=EXACT)
    assert hertz.load_for_approach(a**2 / 18e-3, 18e-3, A) == pytest.approx(20.0, rel=EXACT)


def test_displacement_outside_meets_the_inside_and_decays_as_a_point_load():
    A = hertz.compliance((STEEL, NU))
    a = hertz.contact_radius(20.0, BALL, A)
    near = hertz.displacement(np.array([a, a * (1 + 1e-10)]), 20.0, BALL, A)
    assert near[1] == pytest.approx(near[0], rel=1e-8)
    far = hertz.displacement(1e3 * a, 20.0, BALL, A)
    assert far == pytest.approx(20.0 * A / (2 * np.pi * 1e3 * a), rel=1e-5)


def test_flat_punch_gives_one_load_at_its_approach():
    assert hertz.punch_approach(4.0, 1e-3, 1e-9) == pytest.approx(1e-6, rel=EXACT)
    total = disc_integral(lambda r: hertz.punch_pressure(r, 4.0, 1e-3), 1e-3)
    assert total == pytest.approx(4.0, rel=EXACT)


def test_maxwell_contact_grows_as_published_and_its_pressure_carries_the_load():
    def radius(t):
        return lee_radok.step_radius(t, maxwell_creep, 1.0, BALL, NU)

    assert radius(2.0) / radius(0.0) == pytest.approx(3 ** (1 / 3), rel=EXACT)

    def pressure(r):
        return lee_radok.pressure(r, 2.0, maxwell_relaxation, radius, BALL, NU)

    total = disc_integral(pressure, radius(2.0))
    assert total == pytest.approx(1.0, rel=1e-3)  # the disc rule crosses the kink at the first radius
    first = lee_radok.pressure(0.0, 0.0, maxwell_relaxation, radius, BALL, NU)
    assert first == pytest.approx(hertz.peak_pressure(1.0, BALL, 0.7e-9), rel=EXACT)


def test_load_histories_that_jump_are_step_loads_and_a_falling_load_is_refused():
    t = np.array([0.0, 1.0, 3.0])
    jump = lee_radok.history_radius(t, maxwell_creep, [0.0, 0.0], [1.0, 2.0], BALL, NU)
    assert jump == pytest.approx(lee_radok.step_radius(t, maxwell_creep, 2.0, BALL, NU), rel=EXACT)
    ramp = lee_radok.history_radius(2.0, maxwell_creep, [0.0, 2.0], [0.0, 1.0], BALL, NU)
    assert ramp**3 == pytest.approx(0.375 * BALL * 0.7 * 2e-9, rel=EXACT)
    with pytest.raises(ValueError, match="never decreases"):
        lee_radok.history_radius(t, maxwell_creep, [0.0, 1.0], [1.0, 0.5], BALL, NU)


def test_ting_without_memory_is_hertz_up_and_down():
    args = (lambda t: 1e9 + 0 * t, lambda t: 1e-6 * (1 - np.abs(t - 1)), lambda t: 1e-6 * np.sign(1 - t), 1.0)
    for t in (0.5, 1.0, 1.6):
        expected = hertz.load_for_approach(args[1](t), BALL, 0.7e-9)
        assert ting.load(t, *args, BALL, NU) == pytest.approx(expected, rel=1e-7)
        assert ting.contact_radius(t, *args, BALL) == pytest.approx(np.sqrt(BALL * args[1](t)), rel=1e-7)


def test_ting_on_a_maxwell_body_matches_times_in_closed_form_and_lets_go():
    args = (maxwell_relaxation, lambda t: 1e-6 * t, lambda t: 1e-6 * np.sign(1 - t), 1.0)
    # int_t1^1 e^tau dtau = int_1^t e^tau dtau
    t1 = np.log(2 * np.e - np.exp(1.3))
    assert ting.matching_time(1.3, args[0], args[2], 1.0) == pytest.approx(t1, rel=EXACT)
    assert ting.load(1.9, *args, BALL, NU) == 0.0


@pytest.mark.parametrize(
    ("ratio", "a", "approach", "centre"),
    [
        (0.25, 1.44699739, 1.54468897, 0.50713761),
        (0.5, 1.20660765, 1.22712805, 0.70468227),
        (1.0, 1.0, 1.0, 1.0),
        (2.0, 0.81847754, 0.82686997, 1.47543690),
        (4.0, 0.65808788, 0.68206400, 2.28346598),
    ],
)
def test_layer_as_thick_as_the_contact_gives_the_table_of_osullivan_and_king(ratio, a, approach, centre):
    A = 0.7 / STEEL
    a0 = hertz.contact_radius(20.0, 18e-3, A)
    found = abel.solve_load(20.0, abel.Layered(ratio * STEEL, NU, a0, STEEL, NU), 18e-3, modes=30)
    assert found.radius / a0 == pytest.approx(a, rel=TABLE)
    assert found.approach / hertz.approach(20.0, 18e-3, A) == pytest.approx(approach, rel=TABLE)
    peak = abel.pressure(0.0, found)[0] / hertz.peak_pressure(20.0, 18e-3, A)
    assert peak == pytest.approx(centre, rel=TABLE)


@pytest.mark.parametrize(
    ("load", "approach", "peak"),
    [
        (60.0, 2.55166e-6, 1.16724e9),
        pytest.param(10.0, 0.780865e-6, 0.630787e9, marks=pytest.mark.slow),
        pytest.param(500.0, 10.41896e-6, 2.39395e9, marks=pytest.mark.slow),
    ],
)
def test_tribofilm_under_a_steel_ball(load, approach, peak):
    film = abel.Layered(0.75e9, NU, 150e-9, STEEL, NU, 0.7 / STEEL)
    found = abel.solve_load(load, film, BALL)
    assert found.approach == pytest.approx(approach, rel=3e-6)
    assert abel.pressure(0.0, found)[0] == pytest.approx(peak, rel=FILM)


def test_punch_on_the_creeping_film_as_tabulated():
    body = abel.Layered(1.0, NU, 0.5, STEEL, NU)
    start = abel.punch_creep(1e-9, 1.0, body, burgers_modulus)
    assert start * 1e9 == pytest.approx(0.05542577, rel=TABLE)
    for t, ratio in ((10.0, 1.06226299), (600.0, 4.61646409), (7200.0, 32.04241505)):
        assert abel.punch_creep(t, 1.0, body, burgers_modulus) / start == pytest.approx(ratio, rel=TABLE)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("thickness", "load", "radii", "approaches"),
    [
        (50e-6, 0.2, (75.5027, 115.0027, 148.7259), (0.361528, 0.784127, 1.273746)),
        (10e-6, 1.0, (82.3671, 120.8646, 154.2471), (0.386192, 0.796635, 1.280290)),
    ],
)
def test_contact_growing_on_the_creeping_layer_as_tabulated(thickness, load, radii, approaches):
    body = abel.Layered(1.0, NU, thickness, STEEL, NU)
    contacts = abel.march_step_load(load, 2000.0, 40, body, burgers_modulus, BALL)
    for i, a, approach in zip((0, 12, 40), radii, approaches, strict=True):
        assert contacts[i].radius == pytest.approx(a * 1e-6, rel=MARCH)
        assert contacts[i].approach == pytest.approx(approach * 1e-6, rel=MARCH / 3)
