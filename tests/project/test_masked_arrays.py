"""Masked arrays, quantities with units, complex numbers, dates and text: no entry drops a mask, beneath which values are
often spikes or fill values of 1e20, a unit or an imaginary part."""

import jax
import numpy as np
import pytest
from right_calls import BALL, BODY, FILM, GRID, LOAD, STEEL, indent, roll, rub, shear, slide, steady

import fitting
import jaxcontact as jc

MASKED = r"expected numbers without masked entries, got 1 masked of {}"
T = np.arange(1.0, 9.0)
MAP = np.full((8, 8), 1e-7)


def masked(values):
    """The values with their last one masked, which becomes a spike."""
    found = np.ma.array(values, dtype=float, copy=True)
    found.flat[-1] = 1e20
    found.mask = np.zeros(found.shape, bool)
    found.mask.flat[-1] = True
    return found


def thick(thickness):
    return jc.LayeredHalfSpace([jc.Layer(FILM, thickness)], STEEL)


def moduli(values, **more):
    return fitting.RelaxationData(T, values, start=0.0, **more)


CALLS = {  # of a good array, which the call accepts, and which is refused with a mask
    "heights": (MAP, jc.HeightField),
    "heights of a surface": (MAP, lambda heights: jc.Surface(heights, GRID)),
    "load": (np.ones(2), jc.Load),
    "approach": (np.ones(2), jc.Approach),
    "tangential load": (np.ones(2), jc.TangentialLoad),
    "thickness": (MAP, thick),
    "thickness in a list": ([MAP], lambda one: thick(one[0])),
    "compliances": (np.ones(2), lambda J: jc.Prony(J0=1.0, J=J, tau=[1.0, 2.0])),
    "retardation times": (np.array([1.0, 2.0]), lambda tau: jc.Prony(J0=1.0, J=[1.0, 1.0], tau=tau)),
    "times": (np.array([0.0, 1.0]), lambda t: indent(times=t)),
    "times of a grid": (np.array([0.0, 1.0]), lambda t: jc.Grid.around(BODY, BALL, LOAD, t)),
    "velocity of slide": (np.array([1e-6, 0.0]), slide),
    "friction of slide": (np.full((8, 8), 0.1), lambda mu: slide(1e-6, friction=mu)),
    "velocity of slide_steady": (np.array([1e-6, 0.0]), steady),
    "friction of shear": (np.full((8, 8), 0.1), lambda mu: shear(friction=mu)),
    "creepage": (np.array([1e-3, 0.0]), roll),
    "velocity of rub": (np.array([0.1, 0.1]), lambda v: rub(velocity=v)),
    "path of rub": (np.array([0.0, 1e-6]), lambda path: rub(velocity=None, path=path)),
    "pressure": (MAP, lambda p: jc.subsurface(BODY, GRID, p, depths=[0.0, 1e-6])),
    "depths": (np.array([0.0, 1e-6]), lambda z: jc.subsurface(BODY, GRID, MAP, depths=z)),
    "traction": (
        np.zeros((2, 8, 8)), lambda q: jc.subsurface(BODY, GRID, MAP, depths=[0.0], traction=q),
    ),
    "heat": (
        MAP, lambda q: jc.flash_temperature(q, GRID, velocity=0.0, conductivity=50.0, diffusivity=1e-5),
    ),
    "surface_statistics": (MAP * np.arange(8), lambda h: jc.surface_statistics(h, GRID)),
    "work of adhesion": (np.array([0.1, 0.1]), lambda w: jc.DugdaleAdhesion(work=w, strength=1e6)),
    "creep": (T, FILM.creep),
    "relaxation": (T, FILM.relaxation),
    "complex_modulus": (T, FILM.complex_modulus),
    "creep of a power law": (T, jc.Springpot(1.0, 0.5).creep),
    "normal_response": (T, lambda k: jc.normal_response(BODY, k, 1.0)),
    "t of CreepData": (T, lambda t: fitting.CreepData(t, J=T)),
    "J": (T, lambda J: fitting.CreepData(T, J=J, start=0.0)),
    "strain": (T, lambda e: fitting.CreepData(T, strain=e, stress=T)),
    "stress": (T, lambda s: fitting.CreepData(T, strain=T, stress=s)),
    "stress and its times": (T, lambda s: fitting.CreepData(T, strain=T, stress=(T, s))),
    "sigma": (T, lambda s: fitting.CreepData(T, J=T, sigma=s, start=0.0)),
    "modulus": (T, moduli),
    "loss": (T, lambda G: fitting.OscillationData(T, T, G)),
    "depth": (T, lambda d: fitting.IndentationData(T, load=T, depth=d)),
    "stiffness": (T, lambda s: fitting.StiffnessData(depth=T, stiffness=s)),
    "growth": (T, lambda h: fitting.GrowthData(T, 1e-9 * h, stress=2e8, temperature=373.0)),
    "times of ContactData": (
        np.array([0.0, 1.0]), lambda t: fitting.ContactData(t, jc.Load(1.0), {"pressure": np.ones((2, 8, 8))}, GRID),
    ),
    "sigma of ContactData": (
        np.ones((8, 8)),
        lambda s: fitting.ContactData([0.0], jc.Load(1.0), {"pressure": MAP}, GRID, sigma={"pressure": s}),
    ),
    "J of a batch": (np.stack([1.0 + T, 2.0 + T]), lambda J: fitting.fit_creep_batch(T, J, weights="relative")),
    "sigma of a fit": (T, lambda s: fitting.fit_relaxation(moduli(10.0 - T), "Maxwell", sigma=s)),
    "tau": (np.array([1.0, 3.0]), lambda tau: fitting.fit_maxwell(moduli(10.0 - T), tau, weights="relative")),
    "tau of a series": (
        np.array([1.0, 3.0]), lambda tau: fitting.fit_prony(fitting.CreepData(T, J=T, start=0.0), tau, weights="relative"),
    ),
    "start of minimise": (np.ones(2), lambda x: fitting.minimise(lambda p: p["x"] @ p["x"], {"x": x}, steps=1)),
    "bounds of minimise": (
        np.full(2, 2.0),
        lambda high: fitting.minimise(lambda p: p["x"] @ p["x"], {"x": np.ones(2)}, bounds={"x": (None, high)}, steps=1),
    ),
    "points to exclude": (np.array([2.0, 3.0]), lambda at: fitting.exclude(moduli(T), at)),
}  # fmt: skip


@pytest.mark.parametrize("name", CALLS)
def test_a_mask_is_refused_with_the_number_of_its_entries(name):
    good, call = CALLS[name]
    bad = [masked(good[0])] if isinstance(good, list) else masked(good)
    with pytest.raises(ValueError, match=MASKED.format(np.size(good))):
        call(bad)


class Quantity(np.ndarray):
    """What arrays of astropy and quantities of pint have in common: numbers, a unit, and a conversion."""

    unit = "mm"

    def to(self, unit):
        raise NotImplementedError(unit)


@pytest.mark.parametrize(
    "name", ["heights", "load", "times", "velocity of slide", "pressure", "J", "depth", "stiffness"]
)
def test_a_quantity_is_refused_with_its_unit(name):
    good, call = CALLS[name]
    with pytest.raises(
        ValueError, match="expected plain numbers in SI, got a quantity with the unit 'mm': convert it"
    ):
        call(np.asarray(good).view(Quantity))


def test_an_empty_mask_is_no_mask():
    assert float(jc.surface_statistics(np.ma.array(MAP * np.arange(8)), GRID).rms_slope) > 0.0
    np.testing.assert_array_equal(moduli(np.ma.array(T)).modulus, T)


def test_masked_pixels_of_a_measured_field_are_missing():
    data = fitting.ContactData([0.0], jc.Load(1.0), {"pressure": masked(np.ones((8, 8)))}, GRID)
    assert np.isnan(data.fields["pressure"][0, -1, -1]) and np.isfinite(data.fields["pressure"]).sum() == 63


MADE = {  # what only constructs, and is checked by the call that takes it
    "heights": lambda heights: indent(indenter=jc.HeightField(heights)),
    "load": lambda load: indent(control=jc.Load(load), times=[0.0, 1.0]),
    "approach": lambda approach: indent(control=jc.Approach(approach), times=[0.0, 1.0]),
    "tangential load": lambda load: shear(tangential=jc.TangentialLoad(load)),
    "thickness": lambda thickness: indent(body=thick(thickness)),
    "thickness in a list": lambda one: indent(body=thick(one[0])),
    "compliances": lambda J: indent(
        body=jc.LayeredHalfSpace([], jc.Prony(J0=1.0, J=J, tau=[1.0, 2.0], nu=0.3))
    ),
    "retardation times": lambda tau: indent(
        body=jc.LayeredHalfSpace([], jc.Prony(J0=1.0, J=[1.0, 1.0], tau=tau, nu=0.3))
    ),
    "growth": lambda h: fitting.GrowthData(T, h, stress=2e8, temperature=373.0),
    "work of adhesion": lambda work: indent(adhesion=jc.DugdaleAdhesion(work=work, strength=1e6)),
}


@pytest.mark.parametrize("name", CALLS)
def test_complex_numbers_dates_durations_and_text_are_refused(name):
    # numpy converts each of them to floats: the real part, a count of nanoseconds, the number that the text states
    good, call = CALLS[name]
    call = MADE.get(name, call)
    listed = isinstance(good, list)
    array = np.asarray(good[0] if listed else good)
    for bad, words in (
        (array + 1e-9j, "expected real numbers, got complex numbers"),
        (np.round(array).astype("m8[ns]"), r"expected numbers, got durations \(timedelta64\[ns\]\)"),
        (np.round(array).astype("M8[ns]"), r"expected numbers, got dates \(datetime64\[ns\]\)"),
        (array.astype(str), "expected numbers, got text"),
    ):
        with pytest.raises(ValueError, match=words):
            call([bad] if listed else bad)


def test_complex_numbers_are_refused_under_jit():
    with pytest.raises(ValueError, match="expected real numbers, got complex numbers"):
        jax.jit(lambda load: indent(control=jc.Load(load)).approach)(1.0 + 1e-9j)
