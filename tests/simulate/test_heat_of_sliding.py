"""Heat of friction in ``slide``: the flash temperature, which has oracles of its own, and creep in reduced time."""

import numpy as np
import pytest

import jaxcontact as jc

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:only", "ignore:film strain")]
GRID = jc.Grid.square(24, 200e-6)
FILM = jc.StandardLinearSolid(G1=1e9, G2=1e9, eta2=1e6, nu=0.3)
TIMES, SPEED = np.linspace(0.0, 2e-3, 11), 0.05


def slid(film, thermal, times=TIMES):
    body = jc.LayeredHalfSpace([jc.Layer(film, 2e-6)], jc.Elastic(80e9, 0.3))
    given = {"friction": 0.3, "thermal": thermal, "grid": GRID, "tolerance": 1e-10}
    return jc.slide(body, jc.Sphere(2e-3), jc.Load(0.5), times, velocity=SPEED, **given)


def test_the_temperature_is_that_of_a_flux_which_moves():
    run = slid(FILM, jc.Thermal(350.0, 46.0, share=0.6, diffusivity=1.2e-6))
    flux = 0.6 * 0.3 * SPEED * run.pressure[-1]
    rise = jc.flash_temperature(flux, GRID, velocity=SPEED, conductivity=46.0, diffusivity=1.2e-6)
    np.testing.assert_allclose(run.temperature[-1] - 350.0, rise, rtol=1e-9)
    assert run.peak_temperature[-1] == pytest.approx(350.0 + float(rise.max()), rel=1e-12)
    assert np.mean(rise[:12]) > 1.1 * np.mean(rise[12:])  # hotter behind
    with pytest.raises(AttributeError, match="slide was called without thermal="):
        slid(FILM, None).peak_temperature  # noqa: B018


@pytest.mark.filterwarnings("ignore:the time steps have an estimated error")
def test_at_one_temperature_the_film_has_the_times_of_the_shifted_material():
    """No heat enters the body, which is warm: pressures, forces and powers are those of the material with J(t/a_T)."""
    shift = jc.ArrheniusShift(activation_energy=1.2e-19, reference=300.0)
    factor = np.exp(1.2e-19 / 1.380649e-23 * (1 / 350.0 - 1 / 300.0))
    warm = slid(FILM, jc.Thermal(350.0, 46.0, share=0.0, shift=shift, diffusivity=1.2e-5))
    plain = slid(FILM.shifted(factor), None)
    np.testing.assert_allclose(warm.pressure[1:], plain.pressure[1:], atol=1e-8 * float(plain.pressure.max()))
    np.testing.assert_allclose(warm.hysteresis_power[1:], plain.hysteresis_power[1:], rtol=1e-6)
    np.testing.assert_allclose(warm.hysteresis_force[1:], plain.hysteresis_force[1:], rtol=1e-6)
    cold = slid(FILM, None)
    assert np.abs(warm.pressure - cold.pressure).max() > 0.05 * cold.pressure.max()


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:the time steps have an estimated error")
def test_a_long_step_after_a_quick_rise_of_the_load_is_at_the_temperature_of_its_start():
    """Against steps of a twentieth: a rise of the temperature that ends with that of the load is not carried on."""
    shift = jc.ArrheniusShift(activation_energy=1.2e-19, reference=350.0)
    thermal = jc.Thermal(350.0, 1.0, shift=shift, diffusivity=1.2e-6)
    film = jc.StandardLinearSolid(G1=1e9, G2=1e9, eta2=2e7, nu=0.3)
    body = jc.LayeredHalfSpace([jc.Layer(film, 2e-6)], jc.Elastic(80e9, 0.3))
    given = {"velocity": SPEED, "friction": 0.3, "thermal": thermal, "grid": GRID}
    long, short = np.array([0.0, 5e-5, 1e-4, 1e-3, 1.9e-3]), np.linspace(0.0, 1.9e-3, 39)
    coarse, fine = (
        jc.slide(body, jc.Sphere(2e-3), jc.Load(np.minimum(times / 1e-4, 1.0) * 0.5), times, **given)
        for times in (long, short)
    )
    np.testing.assert_allclose(
        np.asarray(coarse.approach)[[3, 4]], np.asarray(fine.approach)[[20, 38]], rtol=0.02
    )
