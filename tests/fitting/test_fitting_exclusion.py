"""Points left out by hand: the fit is that of the other points alone."""

import numpy as np
import pytest

import fitting
from fitting.cli.command import main

T = np.geomspace(0.1, 100.0, 30)


def relaxing(t=T):
    return 1e5 + 4e5 * np.exp(-t / 3.0)


@pytest.mark.slow
def test_the_fit_is_that_of_the_other_points():
    values = relaxing() * (1.0 + 0.01 * np.random.default_rng(0).standard_normal(T.size))
    values[7], values[20] = 5e6, 1.0
    keep = np.delete(np.arange(T.size), [7, 20])
    whole = fitting.RelaxationData(T, values, start=0.0)
    data = fitting.exclude(whole, [1.03 * T[7], T[20]])
    assert data.t == pytest.approx(T[keep]) and data.modulus == pytest.approx(values[keep])
    assert "excluded by hand: 2 of 30 points, at t = 0.5" in data.notes[-1]
    alone = fitting.RelaxationData(T[keep], values[keep], start=0.0)
    fits = [fitting.fit_relaxation(one, weights="relative") for one in (data, alone, whole)]
    assert fits[0].values == fits[1].values and fits[0].verdict == "accepted"
    assert abs(fits[2].values["G1"] / fits[0].values["G1"] - 1.0) > 0.05


def test_every_kind_of_data():
    omega = fitting.exclude(fitting.OscillationData(T[::-1], T[::-1], 2 * T[::-1], temperature=300.0), [T[3]])
    assert omega.omega == pytest.approx(np.delete(T, 3)) and omega.loss == pytest.approx(2 * np.delete(T, 3))
    assert omega.temperature == 300.0
    strain = fitting.CreepData(t=T, strain=T, stress=([0.0, 50.0], [1.0, 2.0]), sigma=0.1 * T)
    some = fitting.exclude(strain, [100.0])
    assert some.t.size == 29 and some.sigma.size == 29 and some.stress[0].size == 2
    grown = fitting.GrowthData(T, T * 1e-9, stress=1e8, temperature=300.0)
    assert fitting.exclude(grown, [0.1]).thickness[0] == pytest.approx(T[1] * 1e-9)


def test_bad_input():
    data = fitting.RelaxationData(T, relaxing(), start=0.0)
    with pytest.raises(ValueError, match=r"exclude: expected values of t from 0.1 to 100 s, got 200"):
        fitting.exclude(data, [200.0])
    with pytest.raises(ValueError, match="exclude: expected at least 5 points left, got 4 of 30"):
        fitting.exclude(data, T[:26])
    with pytest.raises(ValueError, match="data: expected one of CreepData"):
        fitting.exclude([1, 2], [1.0])


@pytest.mark.slow
def test_the_shell(tmp_path, capsys):
    path, G = tmp_path / "gel.csv", relaxing()
    G[10] *= 3.0
    path.write_text("t [s],G(t) [Pa]\n" + "".join(f"{t:.9g},{v:.9g}\n" for t, v in zip(T, G, strict=True)))
    words = [
        "relaxation",
        str(path),
        "--model",
        "StandardLinearSolid",
        "--start",
        "0",
        "--weights",
        "relative",
    ]
    assert main([*words, "--exclude", f"{T[10]:.6g}", "-o", str(tmp_path / "out")]) == 0
    assert "excluded by hand: 1 of 30 points" in capsys.readouterr().out
    with pytest.raises(ValueError, match=r"gel.csv: --exclude: expected values of t"):
        main([*words, "--exclude", "1e9", "-o", str(tmp_path / "other")])
    with pytest.raises(ValueError, match="--exclude: expected a number, got 'first'"):
        main([*words, "--exclude", "first", "-o", str(tmp_path / "other")])
