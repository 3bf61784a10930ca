"""What ``check`` foretells of a ball on a film, against solved contacts and against Hertz."""

import numpy as np
import pytest
from bodies import STEEL
from tolerances import FORETOLD_RADIUS, FORETOLD_STRAIN, QUADRATURE

import jaxcontact as jc
from jaxcontact.indenters.predicted_contact import predicted

BALL = jc.Sphere(5e-3, STEEL)
FILMS = [(nu, G, h) for nu in (0.3, 0.49) for G in (1e7, 1e9, 3e11) for h in (1e-7, 1e-5, 1e-4, 1e-3)]
CONTROLS = {"load": jc.Load(20.0), "approach": jc.Approach(4e-6)}


def agrees(film, h, control, times):
    """The prediction beside a solve on 32 x 32 cells around it."""
    body = jc.LayeredHalfSpace([jc.Layer(film, h)], STEEL)
    found = predicted(body, BALL.outline(), control, times)
    grid = jc.Grid.square(n=32, width=2.8 * found.radius)
    kernels = jc.kernels(body, BALL, grid, nodes=6)  # some films are far stiffer than the steel
    solved = jc.indent(body, BALL, control, times, grid=grid, save="last", kernels=kernels, substeps=8)
    assert int(np.max(solved.status)) == 0
    assert found.radius == pytest.approx(float(np.max(solved.contact_radius)), rel=FORETOLD_RADIUS)
    factor = found.film_strain / float(np.max(solved.film_strain))
    assert 1.0 / FORETOLD_STRAIN < factor < FORETOLD_STRAIN, (film, h, factor)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:film strain", "ignore:only", "ignore:the contact radius reaches")
@pytest.mark.parametrize("name", CONTROLS)
def test_an_elastic_film_from_a_thousandth_to_ten_times_as_thick_as_its_contact_is_wide(name):
    for nu, G, h in FILMS:
        agrees(jc.Elastic(G, nu), h, CONTROLS[name], np.zeros(1))


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:film strain", "ignore:only", "ignore:the contact radius reaches")
@pytest.mark.filterwarnings("ignore:the time steps have an estimated error")
@pytest.mark.parametrize("name", ["load", "approach"])
def test_a_film_that_creeps_fourfold(name):
    times = np.array([0.0, 1.0, 5.0, 20.0, 50.0, 100.0, 200.0])
    for nu, G, h in FILMS:
        film = jc.Burgers(G1=G, G2=G / 3, eta1=G * 500, eta2=G / 3 * 20, nu=nu)
        agrees(film, h, CONTROLS[name], times)


def test_a_half_space_is_that_of_hertz():
    """a^3 = 3 W R/(4 E*) and a^2 = R approach; no film, no strain."""
    body, W, modulus = jc.LayeredHalfSpace([], STEEL), 20.0, 210e9 / (2.0 * (1.0 - 0.3**2))
    loaded = predicted(body, BALL.outline(), jc.Load(W), np.zeros(1))
    assert loaded.radius == pytest.approx((3.0 * W * 5e-3 / (4.0 * modulus)) ** (1.0 / 3.0), rel=QUADRATURE)
    moved = predicted(body, BALL.outline(), jc.Approach(1e-6), np.zeros(1))
    assert moved.radius == pytest.approx((5e-3 * 1e-6) ** 0.5, rel=QUADRATURE)
    assert loaded.film_strain == moved.film_strain == 0.0


def test_nothing_presses_nothing_down():
    film = jc.LayeredHalfSpace([jc.Layer(jc.KelvinVoigt(G=1e6, eta=1e7, nu=0.3), 1e-5)], STEEL)
    assert predicted(film, BALL.outline(), jc.Load(0.0), np.zeros(1)).film_strain == 0.0
    at_once = predicted(film, jc.Sphere(5e-3).outline(), jc.Load(1.0), np.array([0.0]))
    assert at_once.film_strain == 0.0 < at_once.radius  # of a film that is rigid at first, on steel
