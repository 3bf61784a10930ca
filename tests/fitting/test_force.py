"""Force curves: modulus, contact point and baseline of curves that other solutions made, and the verdicts."""

import json

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import fitting
import jaxcontact as jc
from fitting.data.indentation import paraboloid_note
from fitting.fits.force import trend_words
from jaxcontact.__main__ import main
from jaxcontact.reference import abel
from tests.support.layouts import optics11
from tests.support.tables import curve_of, read_back
from tests.support.thin_samples import DEEP, RADIUS, E, T, Z, curve, noisy, thin

BALL = jc.Sphere(RADIUS)


def hertz(depth, nu=0.5):
    return 4.0 / 3.0 * E / (1.0 - nu**2) * np.sqrt(RADIUS) * np.maximum(depth, 0.0) ** 1.5


@pytest.mark.slow
@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_a_thin_sample_is_recovered_within_three_thousandths(nu):
    depth, load = thin(nu, 1.5)
    for seed in range(2):
        fit = fitting.fit_force(curve(noisy(load, seed), depth), indenter=BALL, nu=nu, thickness=1e-6)
        assert not fit.refused
        assert fit.values["G"] == pytest.approx(E / 2.0 / (1.0 + nu), rel=3e-3)
        assert fit.youngs_modulus[0] == pytest.approx(E, rel=3e-3)
        low, high = fit.nuisances["contact_point"][1:]
        assert high - low < 0.02 * depth.max()


@pytest.mark.slow
def test_a_sample_on_an_elastic_base_is_recovered():
    """A layer a third as stiff as its base, up to a contact as wide as the thickness, by the other solution."""
    nu, h, G = 0.4, 1e-6, E / 2.8
    body = abel.Layered(1.0, nu, 1.0, 3.0, 0.2)
    found = [abel.solve_radius(a, body, 1.0, modes=16) for a in np.geomspace(0.05, 1.5, 20)]
    deep, known = np.array([(one.approach, one.load) for one in found]).T
    depth = Z * 0.9 * h**2 / RADIUS
    scaled = np.maximum(depth, 0.0) * RADIUS / h**2
    ratio = np.exp(CubicSpline(np.log(deep), np.log(known / deep**1.5))(np.log(np.maximum(scaled, deep[0]))))
    load = noisy(G * h**3 / RADIUS * ratio * scaled**1.5, 0)
    base = jc.Elastic(3.0 * G, 0.2)
    fit = fitting.fit_force(curve(load, depth), indenter=BALL, nu=nu, thickness=h, substrate=base)
    low, high = fit.intervals["G"]
    assert not fit.refused and low < G < high and high / low < 1.02
    assert "in shear" in fit.summary()
    rigid = fitting.fit_force(curve(load, depth), indenter=BALL, nu=nu, thickness=h)
    assert rigid.values["G"] < 0.9 * G


@pytest.mark.parametrize("tip", [BALL, jc.Cone(0.6), jc.FlatPunch(2e-6)], ids=["ball", "cone", "punch"])
def test_the_laws_of_a_half_space(tip):
    """Hertz, Love and Boussinesq as printed in K. L. Johnson, Contact Mechanics, 1985, for E/(1 - nu^2)."""
    d, plane = np.maximum(Z * DEEP, 0.0), E / (1.0 - 0.4**2)
    laws = {
        "Sphere": hertz(d, 0.4),
        "Cone": 2.0 / np.pi * plane * np.tan(0.6) * d**2,
        "FlatPunch": 4e-6 * plane * d,
    }
    load = noisy(laws[type(tip).__name__], 3)
    fit = fitting.fit_force(curve(load), indenter=tip, nu=0.4)
    low, high = fit.youngs_modulus[1:]
    assert not fit.refused and low < E < high and high / low < 1.02
    low, high = fit.nuisances["contact_point"][1:]
    assert low < 0.0 < high


def test_signs_and_the_depth_of_the_contact_are_those_of_the_file():
    load = noisy(hertz(Z * DEEP), 1)
    fit = fitting.fit_force(curve(-load, 3e-6 - Z * DEEP), indenter=BALL)
    value, low, high = fit.nuisances["contact_point"]
    assert low < value < high and value == pytest.approx(3e-6, abs=0.01 * DEEP)
    assert fit.youngs_modulus[0] == pytest.approx(E, rel=5e-3)


def test_a_long_curve_is_thinned_and_its_baseline_cut():
    t = np.linspace(0.0, 10.0, 5001)
    depth = np.linspace(-9e-6, 1e-6, t.size)
    load = hertz(depth) + 1e-11 * np.random.default_rng(0).standard_normal(t.size)
    fit = fitting.fit_force(fitting.IndentationData(t=t, load=load, depth=depth), indenter=BALL)
    assert fit.youngs_modulus[0] == pytest.approx(E, rel=5e-3) and fit.fitted.size <= 1000
    assert any("baseline" in note for note in fit.notes) and any("means of" in note for note in fit.notes)


def test_the_retract_is_left_out():
    load, depth = hertz(Z * DEEP), Z * DEEP
    both = fitting.IndentationData(
        t=np.append(T, 1.0 + T[1:]),
        load=np.append(load, 0.6 * load[-2::-1]),
        depth=np.append(depth, depth[-2::-1]),
    )
    assert fitting.fit_force(both, indenter=BALL).youngs_modulus[0] == pytest.approx(E, rel=1e-4)


@pytest.mark.slow
def test_a_slight_trend_widens_the_interval_and_a_strong_one_is_rejected_in_a_users_words():
    """A sample that stiffens with depth by a factor 1 + c d."""
    d = np.maximum(Z, 0.0)
    slight = fitting.fit_force(curve(noisy(hertz(d * DEEP) * (1.0 + 0.15 * d), 0)), indenter=BALL)
    plain = fitting.fit_force(curve(noisy(hertz(d * DEEP), 0)), indenter=BALL)
    width = lambda fit: np.log(fit.youngs_modulus[2] / fit.youngs_modulus[1])
    assert not plain.refused and not slight.refused and width(slight) > 4.0 * width(plain)
    assert any("rises by" in note and "a thin sample" in note for note in slight.notes)
    strong = fitting.fit_force(curve(noisy(hertz(d * DEEP) * (1.0 + 8.0 * d**2), 0)), indenter=BALL)
    assert (
        strong.verdict == "rejected" and "stiffen" in strong.refused[0] and "--thickness" in strong.refused[0]
    )
    assert not strong.identified["G"]


@pytest.mark.parametrize(
    ("softer", "words"), [(np.log(2.0), "falls by 50.0 %"), (-np.log(2.0), "rises by 100.0 %")]
)
def test_a_modulus_that_is_halved_falls_by_half(softer, words):
    assert words in trend_words(0.01, softer, False, 1e-9, thin=False)


def test_curves_without_contact_or_baseline_say_so():
    rng = np.random.default_rng(5)
    flat = fitting.fit_force(curve(1e-11 * rng.standard_normal(T.size) + 1e-12 * T), indenter=BALL)
    assert flat.refused and "no indentation" in flat.refused[0]
    begun = fitting.fit_force(curve(noisy(hertz((Z + 1.0) * DEEP), 0)), indenter=BALL)
    assert begun.refused and "no baseline" in begun.refused[0]


def test_the_polynomials_are_printed_with_their_deviation():
    depth, load = thin(0.5, 1.5)
    fit = fitting.fit_force(curve(noisy(load, 0), depth), indenter=BALL, thickness=1e-6, polynomials=True)
    E0, off = fit.polynomials["Dimitriadis 2002"]
    assert off > 0.15 and pytest.approx(fit.youngs_modulus[0] * (1.0 + off)) == E0
    assert "Garcia and Garcia 2018: E = " in fit.summary()


def test_the_summary_the_dictionary_and_the_figure(tmp_path):
    fit = fitting.fit_force(curve(noisy(hertz(Z * DEEP), 2)), indenter=BALL)
    assert "E     =" in fit.summary() and "contact point" in fit.summary()
    found = json.loads(fit.to_json())
    assert found["youngs_modulus_Pa"]["low"] < E < found["youngs_modulus_Pa"]["high"]
    top, bottom, below = fit.plot(tmp_path / "fit.png").axes
    assert "E = 1.2" in below.texts[0].get_text() and "contact point at" in below.texts[0].get_text()
    assert top.get_ylabel() == "force [nN]" and bottom.get_ylabel() == "residual [pN]"
    assert bottom.get_xlabel().startswith("depth below the contact point [")


@pytest.mark.long
def test_intervals_hold_the_modulus_and_the_contact_point():
    held = np.zeros(2)
    clean, count = hertz(Z * DEEP), 120
    for seed in range(count):
        fit = fitting.fit_force(curve(noisy(clean, 100 + seed, 0.01, 0.005)), indenter=BALL)
        low, high = fit.youngs_modulus[1:]
        first, last = fit.nuisances["contact_point"][1:]
        held += [low < E < high, first < 0.0 < last]
    assert np.all(np.abs(held / count - 0.95) < 3.0 * np.sqrt(0.95 * 0.05 / count))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"thickness": -1.0}, "thickness: expected > 0 m, got -1.0"),
        ({"thickness": 1e-6, "nu": -0.1}, "nu: expected 0 to 0.5 for a thin layer, got -0.1"),
        (
            {"thickness": 1e-6, "indenter": jc.Sphere(1e-6, jc.Elastic(1e9, 0.3))},
            "indenter: expected a rigid one",
        ),
        ({"thickness": 1e-9}, "thickness: expected a sample with .* up to 10, got"),
    ],
    ids=["thickness", "nu", "material", "too thin"],
)
def test_mistakes(given, message):
    with pytest.raises(ValueError, match=message):
        fitting.fit_force(curve(hertz(Z * DEEP)), **{"indenter": BALL} | given)


def test_other_data_and_curves_without_approach():
    with pytest.raises(ValueError, match="data: expected IndentationData, got list"):
        fitting.fit_force([], indenter=BALL)
    falling = fitting.IndentationData(
        t=T, load=hertz(-Z * DEEP), depth=-Z * DEEP, marks=np.full(T.size, "retract")
    )
    with pytest.raises(ValueError, match="data: expected"):
        fitting.fit_force(falling, indenter=BALL)


@pytest.mark.slow
def test_the_command_from_a_file_to_a_modulus(tmp_path, capsys, here):
    rows = np.column_stack([T, 1e9 * noisy(hertz(Z * DEEP), 0), 1e9 * Z * DEEP])
    np.savetxt(tmp_path / "bead.csv", rows, delimiter=",", header="t [s],load [nN],depth [nm]", comments="")
    assert main(["fit", "force", "bead.csv", "--radius", str(RADIUS)]) == 0
    found = json.loads((tmp_path / "bead-fit" / "summary.json").read_text())
    assert found["youngs_modulus_Pa"]["low"] < E < found["youngs_modulus_Pa"]["high"]
    assert (tmp_path / "bead-fit" / "fit.png").exists()
    read_back(tmp_path / "bead-fit" / "curve.csv", curve_of("load", "N", "depth [m]"))
    capsys.readouterr()
    assert main(["fit", "force", "bead.csv", "-o", "plain"]) == 0
    assert "a four-sided pyramid of 35 degrees is assumed" in capsys.readouterr().out
    found = json.loads((tmp_path / "plain" / "summary.json").read_text())
    area = np.pi * np.tan(found["indenter_half_angle_rad"]) ** 2
    assert area == pytest.approx(4.0 * np.tan(np.radians(35.0)) ** 2)
    known = ["fit", "force", "bead.csv", "-o", "known"]
    assert main([*known, "--spring-constant-error", "0.1"]) == 0
    wider = json.loads((tmp_path / "known" / "summary.json").read_text())["youngs_modulus_Pa"]
    assert np.log(wider["high"] / wider["value"]) > 0.19
    assert main([*known, "--force", "--sensitivity-error", "7"]) == 2
    assert "--sensitivity-error: expected a relative standard deviation" in capsys.readouterr().err
    assert main([*known, "--force", "--sensitivity-error", "0.1"]) == 2
    assert "--spring-constant: expected the spring constant" in capsys.readouterr().err


def test_lengths_in_micrometres_are_not_taken_as_metres(tmp_path, capsys):
    rows = np.column_stack([T, 1e9 * noisy(hertz(Z * DEEP), 0), 1e9 * Z * DEEP])
    file = tmp_path / "bead.csv"
    np.savetxt(file, rows, delimiter=",", header="t [s],load [nN],depth [nm]", comments="")
    call = ["fit", "force", str(file), "-o", str(tmp_path / "out")]
    assert main([*call, "--radius", "5"]) == 2
    assert "--radius: expected a length in m, got 5 m, and 5 um is --radius 5e-6" in capsys.readouterr().err
    assert main([*call, "--radius", "5e-6", "--thickness", "8"]) == 2
    assert "--thickness 8e-6" in capsys.readouterr().err
    call[1] = "indentation"
    film = ["--radius", "5e-6", "--substrate-modulus", "7e10", "--layer", "8"]
    for wrong in (["--radius", "5"], film):
        assert main([*call, *wrong]) == 2
        assert f"{wrong[-1]} um is {wrong[-2]} {wrong[-1]}e-6" in capsys.readouterr().err


WORKSHOP = "Force-Distance Curve\nFile Format:\t3\n\nMode:\tSingle\nPoint:\t1\n\n"


def test_a_file_of_afm_workshop_without_times(tmp_path):
    pytest.importorskip("afmformats")
    k, load = 0.5, hertz(Z * DEEP)
    height = 5e-6 - Z * DEEP - load / k
    columns = "Extend Z-Sense(nm),Extend Force(nN),Retract Z-Sense(nm),Retract Force(nN)\n"
    rows = "".join(
        f"{1e9 * z:.6f},{1e9 * F:.9f},{1e9 * z:.6f},{1e9 * F:.9f}\n"
        for z, F in zip(height, load, strict=True)
    )
    path = tmp_path / "single.csv"
    path.write_text(WORKSHOP + columns + rows)
    data = fitting.read_force(path, spring_constant=k)
    assert any("no times" in note for note in data.notes)
    assert fitting.fit_force(data, indenter=BALL).youngs_modulus[0] == pytest.approx(E, rel=1e-3)


def test_optics11_with_depths_of_zero_before_contact_is_fitted_over_the_way(tmp_path):
    k, load, path = 0.5, hertz(Z * DEEP), tmp_path / "chiaro.txt"
    head, names, rows = optics11(T, load, Z * DEEP, k).partition("Auxiliary\n")
    rows = [row.split("\t") for row in rows.splitlines()]
    for row in rows:
        row[2] = f"{max(float(row[2]), 0.0):.9g}"
    path.write_text(head + names + "\n".join("\t".join(row) for row in rows) + "\n")
    fit = fitting.fit_force(fitting.read_force(path), indenter=BALL)
    assert fit.verdict == "accepted"
    assert fit.youngs_modulus[0] == pytest.approx(E, rel=1e-3)
    assert fit.nuisances["contact_point"][0] == pytest.approx(DEEP, rel=1e-3)  # from the first sample
    with pytest.raises(ValueError, match="column 'height'"):
        fitting.read_force(path, columns={"height": "Way"})


def test_a_file_of_afm_workshop_in_volts_asks_for_its_constants_in_one_line(tmp_path, capfd, caplog):
    pytest.importorskip("afmformats")
    path = tmp_path / "single.csv"
    columns = "Extend Z-Sense(nm),Extend T-B(V),Retract Z-Sense(nm),Retract T-B(V)\n"
    path.write_text(WORKSHOP + columns + "".join(f"{k},0.1,{k},0.1\n" for k in range(20)))
    assert main(["fit", "force", str(path), "-o", str(tmp_path / "fit")]) == 2
    said = capfd.readouterr().err
    assert said.endswith("spring constant and the sensitivity: give --spring-constant and --sensitivity\n")
    assert said.count("\n") == 1 and not caplog.records


@pytest.mark.parametrize("header", ["depth [nm],force [nN]\n", ""])
def test_a_table_without_times(tmp_path, header):
    path, load = tmp_path / "table.csv", hertz(Z * DEEP)
    rows = zip(Z * DEEP, load, strict=True)
    path.write_text(header + "".join(f"{1e9 * z:.6f},{1e9 * F:.9f}\n" for z, F in rows))
    given = {} if header else {"columns": {"depth": 0, "load": 1}, "units": {"depth": "nm", "load": "nN"}}
    data = fitting.read_force(path, **given)
    assert np.array_equal(data.t, np.arange(400.0))
    assert any("no times" in note for note in data.notes)
    assert fitting.fit_force(data, indenter=BALL).youngs_modulus[0] == pytest.approx(E, rel=1e-3)
    with pytest.raises(ValueError, match="'t'"):
        fitting.read_indentation(path, columns={"load": "force [nN]"} if header else {"load": 1})


def calibrated(spring=0.05, sensitivity=1.0, k=0.02):
    """A curve of a soft lever that deflects about as far as it indents, read with factors of the true calibration."""
    true = noisy(hertz(Z * DEEP), 3)
    height = Z * DEEP + true / k
    deflection = sensitivity * true / k
    return curve(spring * deflection, height - deflection)


@pytest.mark.slow
@pytest.mark.parametrize(
    "errors", [{"spring_constant": 0.1}, {"sensitivity": 0.05}, {"spring_constant": 0.1, "sensitivity": 0.05}]
)
def test_errors_of_the_calibration_enter_the_interval(errors):
    """The change of the modulus is that of fits to curves read with another calibration."""
    k = float(hertz(DEEP)) / DEEP  # deflection = indentation at the largest force
    read = lambda spring=1.0, sensitivity=1.0: calibrated(spring * k, sensitivity, k)
    fit = lambda data, **given: fitting.fit_force(data, indenter=BALL, **given)
    plain, wide = fit(read()), fit(read(), errors=errors, spring_constant=k)
    changes = {
        "spring_constant": fit(read(spring=1.01)).values["G"] / fit(read(spring=0.99)).values["G"],
        "sensitivity": fit(read(sensitivity=1.01)).values["G"] / fit(read(sensitivity=0.99)).values["G"],
    }
    assert changes["sensitivity"] > 1.03  # more than in proportion, since the depth decreases
    sd = np.sqrt(sum((np.log(changes[name]) / 0.02 * error) ** 2 for name, error in errors.items()))
    G, (low, high), (inner, outer) = wide.values["G"], wide.intervals["G"], plain.intervals["G"]
    assert plain.values["G"] == G
    assert np.log(high / G) == pytest.approx(np.hypot(1.96 * sd, np.log(outer / G)), rel=0.01)
    assert np.log(G / low) == pytest.approx(np.hypot(1.96 * sd, np.log(G / inner)), rel=0.01)
    assert wide.youngs_modulus[2] == pytest.approx(3.0 * high) and "calibration" in wide.notes[-1]


def test_bad_errors_of_the_calibration():
    data = curve(noisy(hertz(Z * DEEP), 0))
    for errors, words in (
        ({"drift": 0.1}, "errors: expected keys among spring_constant, sensitivity, got 'drift'"),
        ({"sensitivity": 5}, "expected a relative standard deviation from 0 to 1, got 5"),
        ({"sensitivity": 0.1}, "spring_constant: expected the spring constant of the cantilever"),
    ):
        with pytest.raises(ValueError, match=words):
            fitting.fit_force(data, indenter=BALL, errors=errors)


@pytest.mark.parametrize("k", [-0.1, 0.0, np.nan, np.inf, "0.1", [0.1]])
def test_a_spring_constant_is_a_positive_number(k):
    data = curve(noisy(hertz(Z * DEEP), 0))
    with pytest.raises(ValueError, match="spring_constant: expected > 0 N/m, got"):
        fitting.fit_force(data, indenter=BALL, spring_constant=k)


@pytest.mark.slow
@pytest.mark.parametrize("factor", [1e3, pytest.param(1e9, marks=pytest.mark.long)])
@pytest.mark.parametrize("model", ["Elastic", "Maxwell", "map"])
def test_depths_in_other_units_reject_a_fit(factor, model):
    # a ball whose depth is a hundred times its radius is below the surface; its parabola still describes such a curve,
    # with a modulus that is factor^1.5 too small
    load, depth = noisy(hertz(Z * DEEP), 0), factor * Z * DEEP
    if model == "map":
        fit = fitting.fit_map(depth[None], load[None], indenter=BALL)
        verdict, reason, notes = fit.verdict[0], fit.reasons[0], fit.notes[0]
    else:
        fit = fitting.fit_force(curve(load, depth), indenter=BALL, model=model)
        verdict, reason, notes = fit.verdict, fit.refused[0], fit.notes
    assert verdict == "rejected" and "expected a depth in m and not in mm, um or nm" in reason
    assert not any("paraboloid" in note for note in notes)


@pytest.mark.parametrize("trend", [False, True])
def test_a_propagated_result_has_the_systematic_errors_of_the_interval(trend):
    """A curve whose noise alone allows 0.1 %: an error of 10 % of the spring constant, and a trend of the residuals."""
    load = noisy(hertz(Z * DEEP) * (1.0 + 0.05 * trend * np.maximum(Z, 0.0)), seed=3)
    errors = {} if trend else {"spring_constant": 0.1}
    fit = fitting.fit_force(curve(load), indenter=BALL, errors=errors)
    band = fitting.propagate(fit, lambda material: jnp.log(material.G))
    low, high = np.log(fit.intervals["G"])
    assert high - low > (0.02 if trend else 0.3)
    assert float(band.high - band.low) == pytest.approx(high - low, rel=0.02)
    low, high = fit.band(np.array([1.0]))  # of 1/G
    assert float(np.log(high / low)[0]) == pytest.approx(float(band.high - band.low), rel=0.02)


@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_a_wide_contact_with_a_thin_sample_has_a_note(nu):
    """Contact radii of the other solution: a third of the radius of the ball is passed on a thin sample before 1/9 of it is
    the depth."""
    found = abel.solve_radius(1.5, abel.Layered(1.0, nu, 1.0, 1e12, 0.3), 1.0, modes=16)
    for wide, noted in ((0.42, True), (0.28, False)):
        radius = 1.5e-6 / wide  # of a ball on a layer of 1 um
        depth = found.approach * 1e-12 / radius
        assert depth < radius / 9.0 and not paraboloid_note(jc.Sphere(radius), depth)
        assert bool(paraboloid_note(jc.Sphere(radius), depth, thickness=1e-6)) == noted


def test_a_layer_far_thinner_than_the_contact_is_one_sentence():
    """The law of the layer ends at chi = 10, and no contact point near the true one is inside."""
    for thickness in (1e-9, 1e-7):
        with pytest.raises(
            ValueError, match=r"thickness: expected a sample with chi .* up to 10, got more for"
        ):
            fitting.fit_force(curve(noisy(hertz(Z * DEEP), 0)), indenter=jc.Sphere(5e-6), thickness=thickness)
