"""Materials of one's own in fits of creep and moduli: the truth, and Burgers' closed form where they are its equal."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
import pytest
from own_classes import TwoKelvin

import fitting
import jaxcontact as jc
from jaxcontact._support.pytree import static
from jaxcontact.abc import Material, Spectrum, pytree


@pytree
class Powers(Material):
    """A spring in series with Kelvin-Voigt elements whose times grow by a whole factor."""

    G: float
    G1: float
    eta: float
    factor: int = static(default=10)
    nu: float = 0.3
    bulk_modulus: float | None = None

    def spectrum(self):
        G1, eta = jnp.asarray(self.G1), jnp.asarray(self.eta)
        rates = G1 / eta / jnp.array([1.0, self.factor])
        return Spectrum(1.0 / jnp.asarray(self.G), jnp.stack([1.0 / G1] * 2), rates)


@pytree
class Zener(Material):
    """A standard solid by its two moduli and its relaxation time, as some books write it."""

    units: ClassVar = {"decay": "s"}

    G_first: float
    G_last: float
    decay: float
    nu: float = 0.3
    bulk_modulus: float | None = None

    def spectrum(self):
        first, last = jnp.asarray(self.G_first), jnp.asarray(self.G_last)
        return Spectrum(1.0 / first, (1.0 / last - 1.0 / first)[None], (last / first / self.decay)[None])


TRUTH = {"G": 2e3, "G1": 4e3, "G2": 8e3, "eta1": 4e3, "eta2": 8e4}
START = TwoKelvin(1e3, 1e4, 1e4, 1e4, 1e5)
T = np.geomspace(0.05, 200.0, 60)


def J(t):
    """Written out."""
    return 1 / 2e3 + (1 - np.exp(-t)) / 4e3 + (1 - np.exp(-t / 10.0)) / 8e3


def test_a_creep_curve_gives_the_parameters_of_a_material_of_ones_own():
    fit = fitting.fit_creep(fitting.CreepData(t=T, J=J(T)), START)
    for name, value in TRUTH.items():
        assert fit.values[name] == pytest.approx(value, rel=1e-5), name
    assert isinstance(fit.material, TwoKelvin) and fit.material.nu == 0.4
    assert "TwoKelvin fit of 60 points" in str(fit) and "4000 Pa s" in str(fit)


@pytest.mark.long
def test_its_intervals_hold_the_truth():
    """95 % intervals of each parameter in fits of 60 noisy curves: 52 or more of 60 hold the truth, but for chance."""
    held = dict.fromkeys(TRUTH, 0)
    for seed in range(60):
        noisy = J(T) * (1.0 + 0.005 * np.random.default_rng(seed).standard_normal(T.size))
        fit = fitting.fit_creep(fitting.CreepData(t=T, J=noisy), START, weights="relative")
        for name, value in TRUTH.items():
            low, high = fit.intervals[name]
            held[name] += low <= value <= high
    assert min(held.values()) >= 52, held


@pytest.mark.slow
def test_other_parameters_of_the_same_solid_describe_it_as_well():
    """The modulus of a Zener solid by its times, against the standard solid fitted to the same noisy data."""
    solid = jc.StandardLinearSolid(G1=3e5, G2=1.5e5, eta2=2e5)
    noise = 1.0 + 0.01 * np.random.default_rng(2).standard_normal(40)
    t = np.geomspace(0.01, 30.0, 40)
    data = fitting.RelaxationData(t=t, modulus=np.asarray(solid.relaxation(t)) * noise)
    own, known = (
        fitting.fit_relaxation(data, model) for model in (Zener(1e5, 1e4, 10.0), "StandardLinearSolid")
    )
    G1, G2, eta2 = (known.values[name] for name in ("G1", "G2", "eta2"))
    assert own.values["G_first"] == pytest.approx(G1, rel=1e-5)
    assert own.values["G_last"] == pytest.approx(G1 * G2 / (G1 + G2), rel=1e-5)
    assert own.values["decay"] == pytest.approx(eta2 / (G1 + G2), rel=1e-5)
    # units by the first letters of a name, or as the class states them
    assert set(own.to_dict()["parameters"]) == {"G_first_Pa", "G_last_Pa", "decay_s"}
    np.testing.assert_allclose(own.modulus(t), known.modulus(t), rtol=1e-6)
    assert own.aic == pytest.approx(known.aic, abs=1e-3)


@pytest.mark.slow
def test_an_oscillation_and_a_history_of_stress():
    solid, omega = jc.StandardLinearSolid(G1=3e5, G2=1.5e5, eta2=2e5), np.geomspace(0.05, 50.0, 25)
    G = np.asarray(solid.complex_modulus(omega))
    swept = fitting.fit_oscillation(
        fitting.OscillationData(omega=omega, storage=G.real, loss=G.imag), Zener(1e5, 1e4, 10.0)
    )
    assert swept.values["decay"] == pytest.approx(2e5 / 4.5e5, rel=1e-5)
    # a ramp of stress for 1 s, and a hold: the strain integrated by hand over J of the Zener solid
    t = np.linspace(0.1, 8.0, 80)
    fine = np.linspace(0.0, 1.0, 20001)
    lag = lambda at: np.clip(at - fine, 0.0, None)
    strain = np.array([
        np.trapezoid(np.where(fine <= at, 100.0 * np.asarray(solid.creep(lag(at))), 0.0), fine) for at in t
    ])  # fmt: skip
    stress = (np.array([0.0, 1.0, 10.0]), np.array([0.0, 100.0, 100.0]))
    crept = fitting.fit_creep(
        fitting.CreepData(t=t, strain=strain, stress=stress), Zener(1e5, 1e4, 10.0), weights="absolute"
    )
    assert crept.values["G_first"] == pytest.approx(3e5, rel=1e-2)
    assert crept.values["G_last"] == pytest.approx(1e5, rel=1e-2)


def test_what_is_no_start_is_refused():
    data = fitting.CreepData(t=T, J=J(T))
    with pytest.raises(
        ValueError, match=r"model: expected numbers > 0 as the start of the search, got G = -1.0"
    ):
        fitting.fit_creep(data, TwoKelvin(-1.0, 1.0, 1.0, 1.0, 1.0))
    with pytest.raises(ValueError, match="fixed: TwoKelvin has parameters"):
        fitting.fit_creep(data, START, fixed={"K": 1.0})
    fixed = fitting.fit_creep(data, START, fixed={"G": 2e3}, bounds={"eta2": (1e4, 1e6)})
    assert fixed.values["G"] == pytest.approx(2e3, rel=1e-12)
    assert fixed.values["eta2"] == pytest.approx(8e4, rel=1e-5)


@pytest.mark.parametrize("start", [(1e6,) * 5, (1.0,) * 5, (30.0, 5e5, 2e2, 1e2, 9e6)])
def test_a_start_far_away_leads_to_the_same_minimum(start):
    """Decades off in all moduli and times; the two elements may be exchanged."""
    fit = fitting.fit_creep(fitting.CreepData(t=T, J=J(T)), TwoKelvin(*start))
    G1, G2, eta1, eta2 = (fit.values[name] for name in ("G1", "G2", "eta1", "eta2"))
    assert fit.values["G"] == pytest.approx(2e3, rel=1e-4)
    assert sorted([(G1, eta1), (G2, eta2)]) == pytest.approx(
        [pytest.approx((4e3, 4e3), rel=1e-3), pytest.approx((8e3, 8e4), rel=1e-3)]
    )


@pytest.mark.slow
def test_it_is_compared_with_others():
    fit = fitting.fit_creep(fitting.CreepData(t=T, J=J(T)), START)
    table = fit.compare("Burgers")
    assert [one.model.__name__ for one in table.fits] == ["TwoKelvin", "Burgers"]
    again = fitting.compare(fit.data, ["Burgers", START])
    assert again.fits[0].values["eta2"] == pytest.approx(8e4, rel=1e-5)


def test_what_would_not_describe_the_measurement_is_refused():
    tensile = fitting.CreepData(t=T, J=J(T), convention="D", nu=0.5)
    with pytest.raises(
        ValueError, match=r"expected a material of nu = 0.5, that of the data in tension, got nu = 0.4"
    ):
        fitting.fit_creep(tensile, START)
    incompressible = TwoKelvin(1e3, 1e4, 1e4, 1e4, 1e5, nu=0.5)
    assert fitting.fit_creep(tensile, incompressible).material.nu == 0.5
    with pytest.raises(ValueError, match="got a bulk modulus"):
        fitting.fit_creep(tensile, TwoKelvin(1e3, 1e4, 1e4, 1e4, 1e5, bulk_modulus=1e9))
    with pytest.raises(ValueError, match="and fit_creep a material of one's own, as an instance"):
        fitting.fit_creep(tensile, TwoKelvin)


def test_a_static_field_is_held():
    J = 1 / 2e3 + (1 - np.exp(-T)) / 4e3 + (1 - np.exp(-T / 10.0)) / 4e3
    fit = fitting.fit_creep(fitting.CreepData(t=T, J=J), Powers(1e3, 1e3, 1e4))
    assert set(fit.values) == {"G", "G1", "eta"} and fit.material.factor == 10
    assert fit.values["eta"] == pytest.approx(4e3, rel=1e-5)
