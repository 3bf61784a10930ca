"""Creep files with a stress beside the compliance, against closed forms of ramps of Maxwell and Burgers materials."""

import numpy as np
import pytest

import fitting

G, ETA = 1e5, 5e6
RATE = 10.0  # Pa/s


def ramp_strain(t):
    """Maxwell under a stress RATE t: int_0^t (1/G + (t - s)/eta) RATE ds."""
    return RATE * (t / G + t**2 / (2.0 * ETA))


def write(path, **columns):
    heads = {
        "t": "Time [s]",
        "stress": "Shear stress [Pa]",
        "strain": "Shear strain [-]",
        "J": "Compliance [1/Pa]",
    }
    rows = "".join(",".join(f"{x:.9g}" for x in row) + "\n" for row in zip(*columns.values(), strict=True))
    path.write_text(",".join(heads[key] for key in columns) + "\n" + rows)
    return path


def noisy(y, noise, seed):
    return y * (1.0 + noise * np.random.default_rng(seed).standard_normal(y.size))


@pytest.mark.parametrize("with_strain", [True, False])
@pytest.mark.parametrize("begin", [0.0, 1.0])
def test_a_ramp_is_fitted_under_its_stress(tmp_path, with_strain, begin):
    """Its compliance column is strain over stress, which read as J(t) gives eta = 1e7 for 5e6."""
    t = np.linspace(begin, 100.0, 101)
    stress = RATE * t
    strain = noisy(ramp_strain(t), 0.002, 4)
    with np.errstate(invalid="ignore"):
        J = np.where(t > 0.0, strain / np.where(t > 0.0, stress, 1.0), 1.0 / G)
    columns = {"t": t, "stress": stress} | ({"strain": strain} if with_strain else {}) | {"J": J}
    data = fitting.read_creep(write(tmp_path / "ramp.csv", **columns))
    assert data.J is None and any("varies" in note for note in data.notes)
    fit = fitting.fit_creep(data, "Maxwell")
    assert not fit.refused
    for name, value in {"G": G, "eta": ETA}.items():
        low, high = fit.intervals[name]
        assert low <= value <= high and fit.values[name] == pytest.approx(value, rel=0.01), name


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_constant_stress_stays_creep(tmp_path, noise):
    t = np.geomspace(0.1, 100.0, 61)
    stress, J = noisy(np.full(t.size, 50.0), noise, 2), noisy(1.0 / G + t / ETA, noise, 3)
    data = fitting.read_creep(write(tmp_path / "creep.csv", t=t, stress=stress, strain=J * stress, J=J))
    assert data.stress is None
    np.testing.assert_allclose(data.J, J, rtol=1e-8)
    alone = fitting.read_creep(write(tmp_path / "alone.csv", t=t, J=J))
    np.testing.assert_array_equal(data.J, alone.J)


def test_creep_and_recovery_with_a_compliance_column(tmp_path):
    """The strain after the stress has ended is under the history of it."""
    t = np.linspace(1.0, 200.0, 200)
    stress = np.where(t <= 100.0, 50.0, 0.0)
    strain = 50.0 * (np.where(t <= 100.0, 1.0 / G, 0.0) + np.minimum(t, 100.0) / ETA)
    path = write(tmp_path / "both.csv", t=t, stress=stress, strain=strain, J=np.maximum(strain, 1e-9) / 50.0)
    data = fitting.read_creep(path)
    assert data.stress is not None and data.strain[-1] == pytest.approx(50.0 * 100.0 / ETA)
    path = write(tmp_path / "alone.csv", t=t, stress=stress, J=np.maximum(strain, 1e-9) / 50.0)
    with pytest.raises(ValueError, match=r"stress.*ends.*window="):
        fitting.read_creep(path)
    held = fitting.read_creep(path, window=(0.0, 100.0))
    assert held.stress is None and held.t.size == 100


def test_a_stress_measured_from_the_first_step_of_its_ramp_on_rises_from_zero(tmp_path):
    """Without a compliance, likewise: no step to the first stress."""
    t = np.linspace(5.0, 100.0, 20)
    data = fitting.read_creep(write(tmp_path / "ramp.csv", t=t, stress=RATE * t, strain=ramp_strain(t)))
    fit = fitting.fit_creep(data, "Maxwell", weights="relative")
    assert fit.values["G"] == pytest.approx(G, rel=1e-6) and fit.values["eta"] == pytest.approx(ETA, rel=1e-6)
