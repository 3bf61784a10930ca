"""Relaxation moduli, and storage and loss moduli, against closed forms and independent least squares."""

import json

import numpy as np
import pytest
from scipy import optimize, stats

import fitting
import jaxcontact as jc
from fitting.search import nonlinear
from jaxcontact.__main__ import main

TRUTH = {"G1": 2e5, "G2": 1e5, "eta1": 5e6, "eta2": 4e5}
T = np.geomspace(0.02, 60.0, 60)
OMEGA = np.geomspace(0.02, 50.0, 30)


def relaxation(t, G1, G2, eta1, eta2):
    """G(t) of Burgers: its two rates are the roots of the characteristic polynomial."""
    a, b, c = eta2 / G1, G2 / G1 + eta2 / eta1 + 1.0, G2 / eta1
    rates = -np.roots([a, b, c]).real
    return sum(np.exp(-r * t) / (1 / G1 + G2 / (G2 - eta2 * r) ** 2) for r in rates)


def dynamic(omega, G1, G2, eta1, eta2):
    """G' + i G'' of Burgers: springs and dashpots in series."""
    return 1.0 / (1 / G1 + 1 / (G2 + 1j * omega * eta2) + 1 / (1j * omega * eta1))


def noise(n, seed):
    return 1.0 + 0.01 * np.random.default_rng(seed).standard_normal(n)


def relaxed(seed=None, **options):
    G = relaxation(T, **TRUTH) * (1.0 if seed is None else noise(T.size, seed))
    return fitting.RelaxationData(t=T, modulus=G, **options)


@pytest.mark.slow
def test_a_standard_solid_relaxes_to_its_springs_in_series():
    """G(t) = Gs + (G1 - Gs) exp(-t (G1 + G2)/eta2), Gs = G1 G2/(G1 + G2); in tension E = 2 (1 + nu) G."""
    series = 2e5 * 1e5 / 3e5
    G = series + (2e5 - series) * np.exp(-T * 3e5 / 4e5)
    for data in (
        fitting.RelaxationData(t=T, modulus=G),
        fitting.RelaxationData(t=T, modulus=2.8 * G, convention="E", nu=0.4),
    ):
        found = fitting.fit_relaxation(data, weights="relative")
        assert found.model is jc.StandardLinearSolid
        for name, value in {"G1": 2e5, "G2": 1e5, "eta2": 4e5}.items():
            np.testing.assert_allclose(found.values[name], value, rtol=1e-6)
        np.testing.assert_allclose(found.modulus(T), G, rtol=1e-6)


def scipy_cost(residual, start, fixed=None):
    """Least squares over the logarithms of the parameters, some of them held."""
    names = [name for name in TRUTH if name not in (fixed or {})]
    whole = lambda u: dict(zip(names, np.exp(u), strict=True)) | (fixed or {})
    start = np.log([start[name] for name in names])
    run = optimize.least_squares(lambda u: residual(whole(u)), start, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return 2 * run.cost


def weights_of(fit, measured, size):
    """The weights of the residuals, which are reciprocals of fitted values (n,), as converged."""
    weight = fit.residuals / (fit.fitted - measured)
    np.testing.assert_allclose(weight * size, 1.0, rtol=1e-3)
    return weight


def test_relaxation_has_the_optimum_and_the_profile_of_scipy():
    data = relaxed(seed=3)
    found = fitting.fit_relaxation(data, "Burgers", weights="proportional")
    weight = weights_of(found, data.modulus, np.abs(found.fitted))
    residual = lambda p: weight * (relaxation(T, **p) - data.modulus)
    cost = scipy_cost(residual, TRUTH)
    np.testing.assert_allclose(found.rss, cost, rtol=1e-8)
    assert found.widening == 1.0 and found.verdict == "accepted" and all(found.identified.values())
    rise = stats.f.ppf(0.95, 1, T.size - 4) / (T.size - 4)
    for end in found.intervals["eta1"]:
        height = scipy_cost(residual, found.values, {"eta1": end}) / cost - 1
        np.testing.assert_allclose(height / rise, 1.0, rtol=1e-2)


def least_of_a_standard_solid(t, G, G1, weight):
    """Least weighted RSS with G(0) = ``G1``: the level is linear, and the relaxation time is on a fine grid."""
    decay = np.exp(-t[:, None] / np.geomspace(1e-4, 1e6, 20001))
    slope, left = (1 - decay) * weight[:, None], (G[:, None] - G1 * decay) * weight[:, None]
    level = np.clip(np.sum(slope * left, 0) / np.maximum(np.sum(slope**2, 0), 1e-300), 0, G1)
    return np.min(np.sum((left - slope * level) ** 2, 0))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 5])
def test_an_interval_does_not_end_where_one_of_several_branches_does(seed):
    """Ten points of a solid of two times: beyond the end of the optimum's branch, another is far below the level."""
    t, noise = np.geomspace(1.0, 100.0, 10), 1 + 0.01 * np.random.default_rng(seed).standard_normal(10)
    G = 1e5 * (0.4 + 0.7 * np.exp(-t) + 0.3 * np.exp(-t / 50)) * noise
    level = 1.0 - 1e-5
    found = fitting.fit_relaxation(
        fitting.RelaxationData(t=t, modulus=G), weights="proportional", level=level
    )
    rise = stats.f.ppf(level, 1, 7) / 7 * found.widening**2
    weight = weights_of(found, G, found.fitted)
    height = lambda G1: np.sqrt((least_of_a_standard_solid(t, G, G1, weight) / found.rss - 1) / rise)
    np.testing.assert_allclose(height(found.intervals["G1"][0]), 1.0, rtol=1e-2)
    assert height(found.intervals["G1"][0] * 0.9) > 1.0 and height(1e12) < 0.6
    assert found.intervals["G1"][1] == np.inf


@pytest.mark.slow
def test_oscillation_has_the_optimum_of_scipy(tmp_path):
    G = dynamic(OMEGA, **TRUTH)
    off = np.random.default_rng(1).standard_normal((2, OMEGA.size))
    G = G + 0.01 * np.abs(G) * (off[0] + 1j * off[1])
    order = np.random.default_rng(0).permutation(OMEGA.size)  # as a sweep may come
    data = fitting.OscillationData(omega=OMEGA[order], storage=G.real[order], loss=G.imag[order])
    found = fitting.fit_oscillation(data, "Burgers")

    parts = lambda values: np.append(values.real, values.imag)
    size = np.tile(np.hypot(*np.split(found.fitted, 2)), 2)
    weight = weights_of(found, parts(G), size)
    residual = lambda p: weight * parts(dynamic(OMEGA, **p) - G)

    np.testing.assert_allclose(found.rss, scipy_cost(residual, TRUTH), rtol=1e-8)
    for name, value in TRUTH.items():
        low, high = found.intervals[name]
        assert low < value < high, name
    np.testing.assert_allclose(found.modulus(OMEGA), dynamic(OMEGA, **found.values), rtol=1e-9)
    loaded = json.loads(found.to_json())
    assert loaded["starts"] == 18 and loaded["verdict"] == "accepted"
    assert "omega = 0.02 to 50 rad/s" in found.summary()
    found.plot(tmp_path / "fit.png")
    assert (tmp_path / "fit.png").stat().st_size > 10000


def test_a_kelvin_voigt_solid_oscillates():
    """G' = G, G'' = omega eta."""
    data = fitting.OscillationData(omega=OMEGA, storage=np.full(30, 1e5), loss=4e5 * OMEGA)
    found = fitting.fit_oscillation(data, "KelvinVoigt")
    np.testing.assert_allclose([found.values["G"], found.values["eta"]], [1e5, 4e5], rtol=1e-6)
    with pytest.raises(ValueError, match="does not relax"):
        fitting.fit_relaxation(relaxed(), "KelvinVoigt")


def test_a_wrong_material_is_refused():
    found = fitting.fit_relaxation(relaxed(seed=1), "Maxwell", weights="relative")
    assert found.verdict == "rejected" and not any(found.identified.values())


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: relaxed(convention="E"), "nu"),
        (lambda: relaxed(nu=0.3), "nu"),
        (lambda: relaxed(convention="K"), "convention"),
        (lambda: fitting.RelaxationData(t=-T, modulus=T), "t:"),
        (lambda: fitting.RelaxationData(t=T - 1.0, modulus=T), "t: expected times >= 0"),
        (lambda: fitting.OscillationData(omega=OMEGA - 1, storage=OMEGA, loss=OMEGA), "omega"),
        (lambda: fitting.OscillationData(omega=OMEGA, storage=T, loss=OMEGA), "storage"),
        (lambda: fitting.fit_relaxation(relaxed(), "Zener"), "model"),
        (lambda: fitting.fit_relaxation(relaxed(), "Prony"), "tau"),
        (
            lambda: fitting.fit_oscillation(
                fitting.OscillationData(omega=OMEGA, storage=OMEGA, loss=OMEGA), weights="estimated"
            ),
            "weights",
        ),
    ],
)
def test_bad_input_is_named(call, word):
    with pytest.raises(ValueError, match=word):
        call()


@pytest.mark.slow
def test_a_relaxation_test_from_the_shell(tmp_path, capsys):
    """E(t) in kPa over minutes, with the strain put on after two of them; tension must be said."""
    path, out = tmp_path / "gel.csv", tmp_path / "out"
    E = 2 * 1.5 * relaxation(T, **TRUTH)
    np.savetxt(path, np.column_stack([T / 60 + 2, E / 1e3]), delimiter=",", header="t [min],E(t) [kPa]")
    arguments = ["fit", "relaxation", str(path), "-o", str(out), "--model", "Burgers", "--start", "120"]
    assert main(arguments) == 2
    assert "--tension NU" in capsys.readouterr().err
    assert main([*arguments, "--tension", "0.5"]) == 0
    summary = json.loads((out / "summary.json").read_text())
    for name, value in TRUTH.items():
        assert summary["parameters"][f"{name}_Pa" + "_s" * name.startswith("eta")] == pytest.approx(
            value, rel=1e-5
        )
    assert summary["verdict"] == "accepted" and (out / "fit.png").exists()
    with pytest.raises(ValueError, match="read_relaxation"):
        fitting.read_creep(path)


def sweep_of(heading, *columns, under="", sep="\t"):
    rows = "".join(sep.join(f"{value:.9g}" for value in row) + "\n" for row in zip(*columns, strict=True))
    return f"{heading}\n{under}{rows}"


F, W, G = OMEGA / (2 * np.pi), OMEGA, dynamic(OMEGA, **TRUTH)
SWEEPS = {
    "f in Hz, units below, beside a load F": sweep_of(
        "F,f,G',G''\nN,Hz,kPa,kPa", np.ones(F.size), F, G.real / 1e3, G.imag / 1e3, sep=","
    ),
    "Hz and kPa": sweep_of("Frequency [Hz],G' [kPa],G'' [kPa]", F, G.real / 1e3, G.imag / 1e3, sep=","),
    "TRIOS": sweep_of(
        "Angular frequency,Step time,Temperature,Storage modulus,Loss modulus,Tan(delta)", W, W, 0 * W + 25, G.real,
        G.imag, G.imag / G.real, under="rad/s,s,°C,Pa,Pa,\n", sep=","),
    "RepTate": "T=25;Mw=94.9;\n" + sweep_of("w\tG'\tG''", W, G.real, G.imag, under="[rad/s]\t[Pa]\t[Pa]\n"),
    "Anton Paar": sweep_of(
        "Point No.\tFrequency\tStorage Modulus\tLoss Modulus\tComplex Viscosity", np.arange(W.size), F, G.real / 1e6,
        G.imag / 1e6, W, under="\t[Hz]\t[MPa]\t[MPa]\t[mPa·s]\n"),
    "German": sweep_of("Kreisfrequenz [1/s];Speichermodul [Pa];Verlustmodul [Pa]", W, G.real, G.imag, sep=";"),
    "marks of a printer, falling": sweep_of("omega [rad/s]\tG′ [Pa]\tG″ [Pa]", W[::-1], G.real[::-1], G.imag[::-1]),
    "|G*| and delta": sweep_of(
        "Frequency [Hz]\tComplex Modulus [kPa]\tPhase angle [°]", F, np.abs(G) / 1e3, np.degrees(np.angle(G))),
    "|G*| and a bare delta": sweep_of(
        "freq,|G*|,δ", F, np.abs(G), np.degrees(np.angle(G)), under="Hz,Pa,°\n", sep=","),
    "|G*| and tan delta": sweep_of("omega [rad/s],|G*| [Pa],Tan(delta)", W, np.abs(G), G.imag / G.real, sep=","),
    "G' and tan delta": sweep_of("Kreisfrequenz [rad/s];Speichermodul [Pa];Verlustfaktor [1]", W, G.real,
        G.imag / G.real, sep=";"),
    "tension": sweep_of("Frequency (Hz)\tE' (Pa)\tE'' (Pa)", F, 2.8 * G.real, 2.8 * G.imag),
}  # fmt: skip


@pytest.mark.parametrize("name", SWEEPS)
def test_a_frequency_sweep_is_read_as_it_was_written(name, tmp_path):
    path = tmp_path / "sweep.txt"
    path.write_text(SWEEPS[name])
    data = fitting.read_oscillation(path, nu=0.4 if name == "tension" else None)
    np.testing.assert_allclose(data.omega, OMEGA, rtol=1e-8)
    np.testing.assert_allclose(data.shear, G, rtol=1e-8)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (sweep_of("Frequency\tG' [Pa]\tG'' [Pa]", F, G.real, G.imag), "'Hz'.* or 'rad/s'"),
        (sweep_of("Frequency [1/s]\tG' [Pa]\tG'' [Pa]", F, G.real, G.imag), "'Hz'.* or 'rad/s'"),
        (SWEEPS["tension"], "nu="),
        (SWEEPS["RepTate"] + SWEEPS["RepTate"].partition("[Pa]\n")[2], "segment="),
        (sweep_of("w [rad/s]\tG' [Pa]", W, G.real), "'loss'"),
        (sweep_of("w [rad/s]\t|G*| [Pa]\tPhase angle", W, np.abs(G), np.angle(G)), "'deg'.* or 'rad'"),
        (sweep_of("w [rad/s]\t|G*| [Pa]\tdelta", W, np.abs(G), np.angle(G)), "'deg'.* or 'rad'"),
        (sweep_of("w [rad/s]\t|G*| [Pa]\tδ [nm]", W, np.abs(G), np.angle(G)), "expected a unit among"),
        (
            sweep_of("w [rad/s]\t|G*| [Pa]\tPhase angle [rad]", W, np.abs(G), 57 * np.angle(G)),
            "between 0 and 90°",
        ),
        (sweep_of("w [rad/s]\t|E*| [Pa]\tTan(delta)", W, np.abs(G), G.imag / G.real), "nu="),
    ],
)
def test_a_sweep_that_could_mean_two_things_is_refused(text, word, tmp_path):
    path = tmp_path / "sweep.txt"
    path.write_text(text)
    with pytest.raises(ValueError, match=word):
        fitting.read_oscillation(path)


@pytest.mark.slow
def test_a_frequency_sweep_from_the_shell(tmp_path):
    path, out = tmp_path / "sweep.csv", tmp_path / "out"
    path.write_text(SWEEPS["Hz and kPa"])
    assert main(["fit", "oscillation", str(path), "-o", str(out)]) == 0
    summary = json.loads((out / "summary.json").read_text())
    for name, value in TRUTH.items():
        unit = "Pa_s" if name.startswith("eta") else "Pa"
        assert summary["parameters"][f"{name}_{unit}"] == pytest.approx(value, rel=1e-5)
    assert (out / "curve.csv").read_text().startswith("omega [rad/s]")
    with pytest.raises(ValueError, match="read_oscillation"):
        fitting.read_creep(path)


def test_standard_deviations_of_a_descending_sweep_are_refused_with_the_order_that_they_would_get():
    """An array follows the points as they were given, and the data sort them."""
    omega, sigma = OMEGA[::-1], np.where(OMEGA[::-1] > 1.0, 3e4, 300.0)
    G = dynamic(omega, **TRUTH)
    data = fitting.OscillationData(omega, G.real, G.imag)
    for fit in (fitting.fit_oscillation, lambda data, **given: fitting.fit_maxwell(data, [1.0], **given)):
        with pytest.raises(ValueError, match="frequencies in ascending order"):
            fit(data, weights=None, sigma=sigma)
    ascending = fitting.OscillationData(omega[::-1], G.real[::-1], G.imag[::-1])
    assert data.reordered and not ascending.reordered
    assert fitting.fit_maxwell(ascending, [1.0], sigma=sigma[::-1]).weights == "sigma"


def test_standard_deviations_of_each_part_of_a_modulus():
    """A spring: the modulus is the mean of G' that these weigh, whatever the errors of G'' are (numpy.average)."""
    sizes = np.geomspace(1.0, 30.0, OMEGA.size)
    sigma = np.stack([1e3 * sizes, 3e4 / sizes])
    storage, loss = [[1e6], [0.0]] + sigma * np.random.default_rng(3).standard_normal(sigma.shape)
    data = fitting.OscillationData(OMEGA, storage, loss)
    found = fitting.fit_oscillation(data, "Elastic", sigma=sigma)
    assert found.values["G"] == pytest.approx(np.average(storage, weights=sigma[0] ** -2.0), rel=1e-8)
    low, high = found.intervals["G"]
    assert high - low == pytest.approx(2.0 * 1.96 * np.sum(sigma[0] ** -2.0) ** -0.5, rel=1e-3)
    for shape in ((3,), (OMEGA.size, 2)):
        with pytest.raises(
            ValueError, match=r"sigma: expected a number, .* values, or those of G' and of G''"
        ):
            fitting.fit_oscillation(data, "Elastic", sigma=np.ones(shape))


def test_moduli_at_one_frequency_are_refused():
    with pytest.raises(ValueError, match="expected several frequencies, got 2 rad/s throughout"):
        fitting.OscillationData([2.0] * 6, [1.0] * 6, [1.0] * 6)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["relaxation", pytest.param("oscillation", marks=pytest.mark.slow)])
def test_models_of_a_modulus_are_ranked(kind, tmp_path, capsys):
    """A standard linear solid is the best of three, and the command prints the same table."""
    solid, x = jc.StandardLinearSolid(2e6, 1e6, 3e6, nu=0.3), np.geomspace(1e-2, 1e2, 40)
    e = 1.0 + 0.01 * np.random.default_rng(0).standard_normal((2, 40))
    path = tmp_path / "test.csv"
    if kind == "relaxation":
        G = np.asarray(solid.relaxation(x)) * e[0]
        data = fitting.RelaxationData(t=x, modulus=G)
        rows = "t [s],relaxation modulus [Pa]\n" + "".join(f"{a},{b}\n" for a, b in zip(x, G, strict=True))
    else:
        G = np.asarray(solid.complex_modulus(x))
        data = fitting.OscillationData(x, G.real * e[0], G.imag * e[1])
        both = zip(x, data.storage, data.loss, strict=True)
        rows = "omega [rad/s],G' [Pa],G'' [Pa]\n" + "".join(f"{a},{b},{c}\n" for a, b, c in both)
    table = fitting.compare(
        data, ["Maxwell", "StandardLinearSolid", "KelvinVoigt"][: 2 + (kind == "oscillation")]
    )
    assert table.fits[0].model is jc.StandardLinearSolid and table.fits[0].bic < table.fits[1].bic - 10.0
    with pytest.raises(ValueError, match="weights: expected"):
        fitting.compare(data, ["Maxwell"], weights="estimated")
    path.write_text(rows)
    flags = ["--of", kind, "--models", "Maxwell,StandardLinearSolid", "-o", str(tmp_path / "out")]
    main(["fit", "compare", str(path), *flags, *(["--start", "0"] if kind == "relaxation" else [])])
    assert capsys.readouterr().out.splitlines()[1].startswith("StandardLinearSolid")


@pytest.mark.slow
@pytest.mark.parametrize(("phase", "common"), [(0.0, True), (0.01, False)])
def test_common_errors_of_both_moduli_have_a_note(phase, common):
    """An error of the amplitude multiplies G' and G'' by one factor: of 80 sweeps 82 % of the intervals held G1."""
    rng = np.random.default_rng(4)
    own = 1.0 + 0.01 * rng.standard_normal(30) + 1j * phase * rng.standard_normal(30)
    G = dynamic(OMEGA, **TRUTH) * own
    data = fitting.OscillationData(OMEGA, G.real, G.imag)
    G1, G2, eta1, eta2 = TRUTH.values()
    tau = -1.0 / np.roots([eta2 / G1, G2 / G1 + eta2 / eta1 + 1.0, G2 / eta1]).real
    for fit in (fitting.fit_oscillation(data, "Burgers"), fitting.fit_maxwell(data, tau, equilibrium=False)):
        told = [note for note in fit.notes if "have common errors" in note]
        assert len(told) == common
        assert not told or "up to 1.4 times" in told[0]


def test_independent_errors_of_each_modulus_are_not_common_ones_and_outliers_have_a_frequency():
    """3 % of G' and, apart from it, 3 % of G'': near a plateau these hardly change the phase. All reasons are in rad/s."""
    rng, omega = np.random.default_rng(1), np.geomspace(1e-3, 1e2, 25)
    G = 1.0 / (1.0 / 2e5 + 1.0 / (1e5 + 4e5j * omega))  # a standard solid
    storage, loss = (part * (1.0 + 0.03 * rng.standard_normal(25)) for part in (G.real, G.imag))
    fit = fitting.fit_oscillation(fitting.OscillationData(omega, storage, loss), "StandardLinearSolid")
    assert not any("have common errors" in note for note in fit.notes)
    storage[12] *= 2.0
    spoiled = fitting.fit_oscillation(fitting.OscillationData(omega, storage, loss), "StandardLinearSolid")
    assert any(f"at omega = {omega[12]:.4g} rad/s" in reason for reason in spoiled.refused)


SLOW = {"G1": 407277.0, "G2": 853877.0, "eta1": 1332924.8, "eta2": 231084.9}


def slowly_found():
    """A relaxation for which a search of at most 60 steps ends 25 % above the least sum of squares."""
    t = np.geomspace(0.222, 29.5, 45)
    return fitting.RelaxationData(t=t, modulus=relaxation(t, **SLOW) * noise(45, 0))


@pytest.mark.slow
def test_a_search_that_takes_more_than_sixty_steps_ends_at_the_least_squares():
    """The optimum of scipy from the true values."""
    data = slowly_found()
    best = scipy_cost(lambda p: relaxation(data.t, **p) / data.modulus - 1.0, SLOW)
    fit = fitting.fit_relaxation(data, "Burgers", weights="relative")
    found = np.sum((fit.modulus(data.t) / data.modulus - 1.0) ** 2)
    assert found == pytest.approx(best, rel=1e-6) and fit.verdict == "accepted"


@pytest.mark.slow
def test_a_minimum_that_a_single_start_reached_has_a_note():
    """A Burgers relaxation of which one of 18 searches reaches the least squares, and an exact one that more reach."""
    rng, t = np.random.default_rng(12), np.geomspace(0.05, 50.0, 25)
    true = {"G1": 10 ** rng.uniform(5, 7), "G2": 10 ** rng.uniform(5, 7)}
    true |= {"eta1": true["G1"] * 10 ** rng.uniform(0, 2), "eta2": true["G2"] * 10 ** rng.uniform(-1, 1)}
    alone = relaxation(t, **true) * (1.0 + 0.005 * rng.standard_normal(25))
    fit = lambda G: fitting.fit_relaxation(
        fitting.RelaxationData(t=t, modulus=G, start=0.0), "Burgers", weights="relative"
    )
    assert any("only 1 of 18 starts reached the best minimum" in note for note in fit(alone).notes)
    assert not any("starts reached" in note for note in fit(relaxation(t, **TRUTH)).notes)


@pytest.mark.slow
def test_a_search_that_does_not_converge_is_not_accepted(monkeypatch):
    monkeypatch.setattr(nonlinear, "ITERATIONS", 4)
    fit = fitting.fit_relaxation(slowly_found(), "Burgers", weights="relative")
    assert fit.verdict == "rejected" and any("did not converge within 4 steps" in why for why in fit.refused)


@pytest.mark.slow
@pytest.mark.parametrize("tau", [pytest.param(1e-12, marks=pytest.mark.slow), 1e18])
def test_a_relaxation_over_43_decades_is_found_wherever_it_lies(tau):
    """A standard solid: G = Gs + (G1 - Gs) exp(-t/tau), Gs = G1 G2/(G1 + G2), tau = eta2/(G1 + G2)."""
    t = np.geomspace(1e-20, 1e23, 87)
    G1, G2 = 1e9, 1e7
    relaxed = G1 * G2 / (G1 + G2)
    G = (relaxed + (G1 - relaxed) * np.exp(-t / tau)) * noise(t.size, 1)
    fit = fitting.fit_relaxation(
        fitting.RelaxationData(t=t, modulus=G), "StandardLinearSolid", weights="relative"
    )
    assert fit.verdict == "accepted"
    for name, value in {"G1": G1, "G2": G2, "eta2": tau * (G1 + G2)}.items():
        assert fit.intervals[name][0] < value < fit.intervals[name][1], name
        assert fit.values[name] == pytest.approx(value, rel=0.05), name


def test_a_curve_is_not_evaluated_before_the_load():
    fit = fitting.fit_relaxation(relaxed(0), "Burgers", weights="relative")
    for run in (fit.band, fit.predict, fit.modulus, fit.modulus_band):
        with pytest.raises(ValueError, match=r"t: expected finite times \(or frequencies\) >= 0, got -1"):
            run(np.array([1.0, -1.0]))
        with pytest.raises(ValueError, match=r"t: expected finite times .* got nan"):
            run(np.array([float("nan")]))
        with pytest.raises(ValueError, match=r"t: expected finite times .* got 'x'"):
            run("x")
    with pytest.raises(ValueError, match=r"sigma: expected a number or .* values, got 'x'"):
        fitting.fit_relaxation(relaxed(0), "Burgers", sigma="x")


@pytest.mark.parametrize("sigma", [1e300, 1e-300])
def test_a_standard_deviation_far_from_the_data_is_refused(sigma):
    with pytest.raises(ValueError, match="sigma: expected standard deviations in the unit of the data"):
        fitting.fit_relaxation(relaxed(0), "Burgers", sigma=sigma)


@pytest.mark.parametrize("choice", ["Shear Stress (Pa)", 1])
def test_a_column_of_stresses_is_not_read_as_a_modulus(tmp_path, choice):
    rows = "".join(f"{t},{9 - t},{0.01}\n" for t in range(1, 7))
    (tmp_path / "a.csv").write_text("Time (s),Shear Stress (Pa),Shear Strain (-)\n" + rows)
    with pytest.raises(
        ValueError, match="expected a relaxation modulus, got a stress according to the heading"
    ):
        fitting.read_relaxation(tmp_path / "a.csv", columns={"modulus": choice})


def test_very_many_points_end_at_the_least_squares():
    """3000 points, of which the search begins with some, against scipy with all."""
    t = np.linspace(0.01, 60.0, 3000)
    data = fitting.RelaxationData(t=t, modulus=relaxation(t, **TRUTH) * noise(t.size, 3))
    best = scipy_cost(lambda p: relaxation(t, **p) / data.modulus - 1.0, TRUTH)
    fit = fitting.fit_relaxation(data, "Burgers", weights="relative")
    assert np.sum((fit.modulus(t) / data.modulus - 1.0) ** 2) == pytest.approx(best, rel=1e-7)
