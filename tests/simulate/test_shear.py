"""Partial slip: Cattaneo and Mindlin, Mindlin and Deresiewicz, Spence, CONTACT, and the law of friction itself."""

import functools

import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact.reference import cattaneo_mindlin, hertz

G, RADIUS, LOAD, MU = 1e9, 10e-3, 10.0, 0.3
HELD = MU * LOAD
LOOP = (0.6, -0.6, 0.6)  # of what friction holds


@functools.cache
def sheared(n, nu, *shares):
    """A rigid ball on a half-space, uncoupled: the load, then shares of what friction holds; contact radius and history."""
    body = jc.LayeredHalfSpace([], jc.Elastic(G, nu))
    a = float(hertz.contact_radius(LOAD, RADIUS, (1 - nu) / G))
    push = jc.TangentialLoad(np.outer([0.0, *shares], [HELD, 0.0]))
    times = np.arange(1.0 + len(shares))
    grid = jc.Grid.square(n, 2.6 * a)
    ball = jc.Sphere(RADIUS)
    return a, jc.shear(body, ball, jc.Load(LOAD), push, times, friction=MU, grid=grid, coupled=False)


def stick_radius(history, step):
    return np.sqrt(np.sum(history.stick[step]) * float(history.grid.cell_area) / np.pi)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n", "traction", "shift"),
    [(64, 6e-3, 3e-4), pytest.param(256, 1e-3, 1e-5, marks=pytest.mark.long)],
)
def test_cattaneo_and_mindlin(n, traction, shift):
    """nu = 0, where it is exact, at 60 % of what friction can hold: traction in L1, displacement, stick radius."""
    a, history = sheared(n, 0.0, *LOOP)
    assert np.all(history.converged)
    x, y = history.grid.coordinates()
    exact = cattaneo_mindlin.traction(np.hypot(x, y), a, MU * 1.5 * LOAD / (np.pi * a**2), 0.6)
    q = np.asarray(history.traction[1])
    assert np.sum(np.abs(q[0] - exact)) / np.sum(exact) < traction
    assert np.max(np.abs(q[1])) < 1e-6 * np.max(exact)
    exact = cattaneo_mindlin.displacement(a, HELD, 0.6, 2.0 / G)
    assert float(history.tangential_displacement[1, 0]) == pytest.approx(exact, rel=shift)
    half_a_cell = 0.5 * float(history.grid.spacing[0])
    assert stick_radius(history, 1) == pytest.approx(cattaneo_mindlin.stick_radius(a, 0.6), abs=half_a_cell)
    np.testing.assert_allclose(history.tangential_load[1], [0.6 * HELD, 0.0], atol=1e-7 * HELD)


@pytest.mark.slow
def test_a_tangential_load_that_friction_cannot_hold_has_a_status_of_its_own():
    with pytest.warns(UserWarning, match="friction cannot hold"):
        _, history = sheared(64, 0.0, 0.6, 1.01, 1.01)
    assert [*history.status] == [0, 0, jc.Status.GROSS_SLIP, jc.Status.GROSS_SLIP]


def test_poissons_ratio_turns_the_traction_by_a_few_percent():
    """nu = 0.3: 3.4 % of mu p0 across the load, and 5e-4 less displacement than Mindlin has (theory: slip turns)."""
    a, history = sheared(64, 0.3, *LOOP)
    peak = MU * 1.5 * LOAD / (np.pi * a**2)
    assert np.max(np.abs(history.traction[1, 1])) / peak == pytest.approx(0.034, abs=0.001)
    mindlin = cattaneo_mindlin.displacement(a, HELD, 0.6, 1.7 / G)
    assert 2e-4 < 1.0 - float(history.tangential_displacement[1, 0]) / mindlin < 1e-3


@pytest.mark.slow
def test_mindlin_and_deresiewicz_loop():
    """The energy of a cycle between 60 % there and back; no more is lost on the way out and back than in it."""
    a, history = sheared(64, 0.0, *LOOP)
    exact = cattaneo_mindlin.loop_energy(a, HELD, 0.6, 2.0 / G)
    assert float(history.dissipated[3] - history.dissipated[1]) == pytest.approx(exact, rel=0.01)
    np.testing.assert_allclose(history.traction[3], history.traction[1], atol=1e-4 * np.max(history.traction))
    shift = history.tangential_displacement[:, 0]
    np.testing.assert_allclose(shift[2:], [-shift[1], shift[1]], rtol=1e-4)


@pytest.mark.parametrize("ending", ["npz", "nc"])
def test_a_history_with_friction_comes_back_from_its_file(ending, tmp_path):
    _, history = sheared(64, 0.3, *LOOP)
    again = jc.read_result(jc.write_result(history, tmp_path / f"loop.{ending}"))
    assert isinstance(again, jc.ShearHistory)
    for name in ("traction", "slip", "stick", "tangential_load", "dissipated", "pressure"):
        np.testing.assert_array_equal(getattr(again, name), getattr(history, name))
    assert again.stick.dtype == bool


@functools.cache
def compressed():
    """CONTACT's example spence35 (release 2707): load (k/45)^3 N, k = 1 to 35, on 45 x 45 cells of 0.2 mm."""
    body, k = jc.LayeredHalfSpace([], jc.Elastic(0.5e6, 0.0)), np.arange(1.0, 36.0)
    ball, still = jc.Sphere(1e-3 / (2 * 0.004116)), jc.TangentialLoad((0.0, 0.0))
    grid = jc.Grid((45, 45), (0.2e-3, 0.2e-3))
    return jc.shear(body, ball, jc.Load((k / 45) ** 3), still, k, friction=0.2986, grid=grid, tolerance=1e-9)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:.*cells across")
def test_compression_with_friction_is_that_of_contact():
    """Fully coupled, in increments: 225 cells stick, approach 0.09874 mm, peak 0.02392 MPa."""
    history = compressed()
    assert int(np.sum(history.stick[-1])) == 225
    assert float(history.load[-1]) == pytest.approx(0.4705, abs=5e-5)
    assert float(history.approach[-1]) == pytest.approx(0.09874e-3, abs=5e-9)
    assert float(np.max(history.pressure[-1])) == pytest.approx(0.02392e6, abs=5.0)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*cells across")
def test_compression_with_friction_is_that_of_spence():
    """Stick radius one half of the contact radius, peak 1.31 of Hertz's (D. A. Spence, J. Elast. 5 (1975) 297)."""
    history = compressed()
    assert stick_radius(history, -1) / float(history.contact_radius[-1]) == pytest.approx(0.5, abs=0.02)
    frictionless = hertz.peak_pressure(float(history.load[-1]), 1e-3 / (2 * 0.004116), 1.0 / 0.5e6)
    assert float(np.max(history.pressure[-1])) / frictionless == pytest.approx(1.31, rel=0.01)


def law_of_friction(history, mu):
    """The largest deviations from |q| <= mu p, slip opposite to traction where it slips, and no slip in stick."""
    p, q, slip = (np.asarray(a) for a in (history.pressure, history.traction, history.slip))
    bound, size, slid = mu * p, np.hypot(*np.moveaxis(q, 1, 0)), np.hypot(*np.moveaxis(slip, 1, 0))
    stick, slips = np.asarray(history.stick), (p > 0.0) & ~np.asarray(history.stick)
    too_large = np.max(size - bound) / np.max(bound)
    turned = np.max(np.where(slips, np.sum(q * slip, 1) + bound * slid, 0.0)) / np.max(bound * slid)
    crept = np.max(np.where(stick, slid, 0.0)) / np.max(slid)
    return too_large, turned, crept


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*cells across")
def test_coupled_compression_obeys_the_law_of_friction():
    assert max(law_of_friction(compressed(), 0.2986)) < 1e-6


@pytest.mark.long
def test_rough_surface_dragged_round_a_corner_and_off_obeys_the_law_of_friction():
    """On a layer, with a coefficient of friction that varies: along x, along y, and then until every cell slips."""
    n, grid = 48, jc.Grid.square(48, 480e-6)
    x, y = (np.asarray(a) for a in grid.coordinates())
    waves = np.cos(2 * np.pi * x / 95e-6) * np.cos(2 * np.pi * (y + 0.3 * x) / 120e-6)
    heights = 0.5e-6 * waves - (x**2 + y**2) / (2 * 20e-3)
    mu = 0.2 + 0.1 * (x > y) * np.ones((n, n))
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9, 0.3), 20e-6)], jc.Elastic(20e9, 0.3))
    drag = jc.TangentialDisplacement([[0.0, 0.0], [2e-7, 0.0], [2e-7, 2e-7], [3e-4, -4e-4]])
    history = jc.shear(
        body,
        jc.HeightField(heights),
        jc.Load(5.0),
        drag,
        np.arange(4.0),
        friction=mu,
        grid=grid,
        coupled=False,
    )
    assert np.all(history.converged)
    assert 0 < np.sum(history.stick[1]) < np.sum(history.pressure[1] > 0.0)
    assert max(law_of_friction(history, mu)) < 1e-6
    loads = np.asarray(history.tangential_load)
    assert loads[1, 0] > 10 * abs(loads[1, 1]) and loads[2, 1] > 0.5 * loads[1, 0]
    held = np.sum(mu * np.asarray(history.pressure[3])) * float(grid.cell_area)
    assert not np.any(history.stick[3])
    np.testing.assert_allclose(loads[3], [0.6 * held, -0.8 * held], rtol=2e-3)


@pytest.mark.long
def test_similar_solids_do_not_feel_the_coupling():
    """Two of one material: the shear does not move the pressure, and the coupled solution is the uncoupled one."""
    material = jc.Elastic(G, 0.3)
    body, ball = jc.LayeredHalfSpace([], material), jc.Sphere(RADIUS, material)
    grid = jc.Grid.square(24, 1.2e-3)
    both = [
        jc.shear(
            body, ball, jc.Load(LOAD), jc.TangentialLoad((0.5 * HELD, 0.2 * HELD)), [0.0], friction=MU, grid=grid,
            coupled=coupled,
        )
        for coupled in (True, False)
    ]  # fmt: skip
    for name in ("pressure", "traction", "slip", "approach", "tangential_displacement"):
        one, other = (np.asarray(getattr(history, name)) for history in both)
        np.testing.assert_allclose(one, other, atol=1e-6 * np.max(np.abs(other)))


@pytest.mark.slow
def test_creeping_half_space_under_a_punch_that_sticks_moves_with_its_creep_compliance():
    """nu = 0.5 has no coupling, and the contact does not change: displacement over load follows J(t) in all directions."""
    material = jc.StandardLinearSolid(G1=1e6, G2=0.5e6, eta2=1e6, nu=0.5)
    body, times = jc.LayeredHalfSpace([], material), np.array([0.0, 0.5, 2.0, 10.0])
    history = jc.shear(
        body, jc.FlatPunch(1e-3), jc.Load(1.0), jc.TangentialLoad((0.3, 0.1)), times, friction=1e3,
        grid=jc.Grid.square(16, 3e-3), coupled=False,
    )  # fmt: skip
    creep = np.asarray(material.creep(times)) / float(material.creep(0.0))
    np.testing.assert_allclose(history.approach / history.approach[0], creep, rtol=1e-7)
    shift = np.asarray(history.tangential_displacement)
    np.testing.assert_allclose(shift, shift[0] * creep[:, None], rtol=1e-6)
    assert np.all(history.stick[-1] == (history.pressure[-1] > 0.0))
    assert shift[0, 0] / shift[0, 1] == pytest.approx(3.0, rel=1e-6)


@pytest.mark.long
def test_creeping_film_under_a_punch_that_sticks_relaxes_to_the_film_of_its_long_term_modulus():
    """All sticks, so that the way does not matter: at once and at last the film is an elastic one of G(0), G(infinity)."""
    film = jc.StandardLinearSolid(G1=1e8, G2=0.5e8, eta2=1e8, nu=0.3)  # relaxes to a third, within 2 s
    grid, times = jc.Grid.square(16, 3e-3), np.array([0.0, 0.3, 1.0, 3.0, 10.0, 40.0])

    def pushed(material, times):
        body = jc.LayeredHalfSpace([jc.Layer(material, 0.4e-3)], jc.Elastic(3e8, 0.4))
        load, push = jc.Load(1.0), jc.TangentialLoad((0.3, 0.1))
        return jc.shear(body, jc.FlatPunch(1e-3), load, push, times, friction=1e3, grid=grid, coupled=False)

    shift = np.asarray(pushed(film, times).tangential_displacement)
    for G, ours in ((1e8, shift[0]), (1e8 / 3, shift[-1])):
        elastic = pushed(jc.Elastic(G, 0.3), times[:1])
        np.testing.assert_allclose(ours, elastic.tangential_displacement[0], rtol=1e-6)
    assert np.all(np.diff(shift, axis=0) > 0.0)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:1 of 1 steps")
def test_sheared_heights_end_with_their_grid_and_a_ball_does_not():
    body, grid = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25)), jc.Grid.square(12, 12e-6)
    push = jc.TangentialLoad((1e-3, 0.0))
    for indenter, status in ((jc.HeightField(np.zeros(grid.shape)), 0), (jc.Sphere(1.0), jc.Status.AT_EDGE)):
        history = jc.shear(body, indenter, jc.Load(0.1), push, [0.0], friction=0.3, grid=grid, coupled=False)
        assert history.pressure[0, 0, 6] > 0.0 and history.status[0] == status
