"""Contact stiffness over depth: closed forms, the Legendre-Galerkin solution of another module, files and the command."""

import functools
import json

import numpy as np
import pytest

import fitting
import jaxcontact as jc
from fitting.fits.stiffness import Coated, Tip, log_stiffness
from jaxcontact.__main__ import main
from jaxcontact.reference import abel
from tests.support.tables import curve_of, read_back

G, NU, H, R = 2e9, 0.35, 1e-6, 5e-6
SILICON = jc.Elastic(30e9, 0.2)
BALL = jc.Sphere(R)
DIAMOND = 0.93 / 533e9  # (1 - nu)/G [1/Pa]


@functools.cache
def film(tip=0.0, soft=True):
    """(radii, depths, stiffness) of a ball on a film, by the other solution."""
    modulus, base = (G, 30e9) if soft else (40e9, 3e9)
    body = abel.Layered(modulus, NU, H, base, 0.2, tip)
    radii = np.geomspace(0.1, 2.5, 40) * H
    depth = np.array([abel.solve_radius(a, body, R, 20).approach for a in radii])
    return radii, depth, np.array([1.0 / abel.punch_compliance(a, body, 20) for a in radii])


def noisy(stiffness, seed=0, size=0.01):
    return stiffness * (1.0 + size * np.random.default_rng(seed).standard_normal(stiffness.size))


@pytest.mark.parametrize("soft", [True, False], ids=["soft film", "stiff film"])
@pytest.mark.parametrize("tip", [0.0, DIAMOND], ids=["rigid", "diamond"])
def test_the_stiffness_and_its_derivatives_agree_with_the_galerkin_solution(soft, tip):
    radii, depth, known = film(tip, soft)
    modulus, base = (G, 30e9) if soft else (40e9, 3e9)
    body = Coated(NU, base, 0.2, tip)
    for places, given in ((depth, False), (radii, True)):
        run = lambda g, h: log_stiffness(g, h, body, Tip(BALL, "ball", places, given, 1.0))  # noqa: B023
        log, slopes = run(modulus, H)
        np.testing.assert_allclose(np.exp(log), known, rtol=5e-6)
        for k, moved in enumerate([lambda s: (modulus * s, H), lambda s: (modulus, H * s)]):
            difference = (run(*moved(1.001))[0] - run(*moved(1.0 / 1.001))[0]) / (2.0 * np.log(1.001))
            np.testing.assert_allclose(slopes[:, k], difference, atol=2e-4)


@pytest.mark.slow
def test_a_parameter_at_the_end_of_its_range_has_a_note():
    """A film of 1 um of which at most 0.5 um are allowed; at 2 um nothing is said."""
    _, depth, known = film()
    fit = lambda high: fitting.fit_stiffness(
        fitting.StiffnessData(depth=depth, stiffness=noisy(known)), indenter=BALL, nu=NU, thickness="fit", substrate=SILICON,
        weights="relative", bounds={"thickness": (1e-7, high)},
    )  # fmt: skip
    said = [note for note in fit(5e-7).notes if "ends at the bound of the search" in note]
    assert len(said) == 1 and said[0].startswith(
        "thickness ends at the bound of the search, 5e-07: larger ones may"
    )
    assert not any("bound of the search" in note for note in fit(2e-6).notes)


@pytest.mark.slow
def test_the_modulus_and_thickness_of_a_film_are_recovered():
    _, depth, known = film()
    data = fitting.StiffnessData(depth=depth, stiffness=noisy(known))
    fit = fitting.fit_stiffness(
        data, indenter=BALL, nu=NU, thickness="fit", substrate=SILICON, weights="relative"
    )
    assert not fit.refused
    for name, true in (("G", G), ("thickness", H)):
        low, high = fit.intervals[name]
        assert low < true < high and high / low < 1.06
    held = fitting.fit_stiffness(
        data, indenter=BALL, nu=NU, thickness=H, substrate=SILICON, weights="relative"
    )
    E = 2.0 * (1.0 + NU) * G
    assert held.youngs_modulus[1] < E < held.youngs_modulus[2]
    np.testing.assert_allclose(held.moduli, E, rtol=0.06)  # of single depths
    assert held.apparent[-1] > 4.0 * E  # what a half-space would be taken to be
    assert fit.material.nu == NU and "film of" in fit.summary()


def test_a_half_space_under_every_tip():
    depth = np.linspace(5e-8, 1e-6, 50)
    for tip, radius in ((BALL, np.sqrt(R * depth)), (jc.FlatPunch(2e-6), np.full(50, 2e-6)),
                        (jc.Cone(1.0), 2.0 / np.pi * depth * np.tan(1.0))):  # fmt: skip
        stiffness = noisy(4.0 * G * radius / (1.0 - NU))
        data = fitting.StiffnessData(depth=depth, stiffness=stiffness)
        fit = fitting.fit_stiffness(data, indenter=tip, nu=NU, contact="elastic")
        low, high = fit.intervals["G"]
        assert not fit.refused and low < G < high and high / low < 1.02


@pytest.mark.parametrize(("widest", "deep"), [(0.7, True), (0.3, False)])
def test_a_ball_that_is_no_paraboloid_has_a_note_with_the_error_of_the_modulus(widest, deep):
    """Contact radius and depth of a rigid sphere by Sneddon (1965), sec. 6; the stiffness is that of a punch."""
    share = np.linspace(0.05, widest, 50)
    depth, stiffness = (
        R * share / 2.0 * np.log((1.0 + share) / (1.0 - share)),
        4.0 * G / (1.0 - NU) * R * share,
    )
    fit = fitting.fit_stiffness(fitting.StiffnessData(depth, stiffness), indenter=BALL, nu=NU)
    told = [note for note in fit.notes if "radius of the ball" in note]
    assert len(told) == deep and (not deep or "up to 10 % too low" in told[0])  # 0.607/6 at the largest depth
    assert fit.moduli[-1] == pytest.approx(2.0 * (1.0 + NU) * G * (1.0 - depth[-1] / R / 6.0), rel=0.01)


def test_a_sharp_tip_after_plastic_flow_with_an_area_function_and_an_elastic_tip():
    """Depth, load and stiffness of a material of constant hardness, from the formulas of Oliver and Pharr (1992)."""
    E, hardness, area = 70e9, 1.1e9, (24.5, 2e-6)
    contact_depth = np.linspace(3e-8, 1e-6, 60)
    A = area[0] * contact_depth**2 + area[1] * contact_depth
    reduced = 1.0 / ((1.0 - 0.23**2) / E + (1.0 - 0.07**2) / 1141e9)
    stiffness = 1.034 * 2.0 / np.sqrt(np.pi) * reduced * np.sqrt(A)
    load = hardness * A
    depth = contact_depth + 0.75 * load / stiffness
    data = fitting.StiffnessData(depth=depth, stiffness=stiffness, load=load)
    tip = jc.Cone.berkovich(jc.Elastic.from_young(1141e9, 0.07))
    fit = fitting.fit_stiffness(data, indenter=tip, nu=0.23, area=area, beta=1.034)
    assert fit.youngs_modulus[0] == pytest.approx(E, rel=1e-6)
    np.testing.assert_allclose(fit.moduli, E, rtol=1e-6)
    ideal = fitting.fit_stiffness(data, indenter=tip, nu=0.23, beta=1.034)  # without the blunt end
    assert ideal.moduli[0] > 1.5 * E and any("blunt" in text for text in (*ideal.notes, *ideal.refused))


def test_a_film_that_is_taken_for_a_half_space_is_rejected():
    _, depth, known = film()
    fit = fitting.fit_stiffness(
        fitting.StiffnessData(depth=depth, stiffness=noisy(known)), indenter=BALL, nu=NU
    )
    assert fit.verdict == "rejected" and "give its thickness" in fit.refused[0]


@pytest.mark.long
def test_intervals_hold_the_modulus_and_the_thickness():
    _, depth, known = film()
    held, count = np.zeros(2), 60
    for seed in range(count):
        data = fitting.StiffnessData(depth=depth, stiffness=noisy(known, seed))
        fit = fitting.fit_stiffness(
            data, indenter=BALL, nu=NU, thickness="fit", substrate=SILICON, weights="relative"
        )
        held += [low < true < high for (low, high), true in zip(fit.intervals.values(), (G, H), strict=True)]
    assert np.all(held / count > 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / count))


def test_a_file_and_the_command(tmp_path, capsys):
    """An export with a row of units and rows before contact."""
    _, depth, known = film()
    rows = [(-5.0, 0.0, 0.0), *zip(1e9 * depth, 1e3 * depth, noisy(known), strict=True)]
    head = "Displacement Into Surface\tLoad On Sample\tHarmonic Contact Stiffness\nnm\tmN\tN/m\n"
    path = tmp_path / "csm.txt"
    path.write_text(head + "".join(f"{d:.9g}\t{P:.9g}\t{S:.9g}\n" for d, P, S in rows))
    data = fitting.read_stiffness(path, window=(1e-8, None))
    assert data.depth.min() >= 1e-8 and any(
        "before contact" in note for note in fitting.read_stiffness(path).notes
    )
    out = tmp_path / "out"
    flags = [
        "--radius",
        "5e-6",
        "--nu",
        "0.35",
        "--thickness",
        "1e-6",
        "--substrate-nu",
        "0.2",
        "-o",
        str(out),
    ]
    main(["fit", "stiffness", str(path), "--substrate-modulus", "72e9", "--weights", "relative", *flags])
    found = json.loads((out / "summary.json").read_text())["youngs_modulus_Pa"]
    assert found["low"] < 2.0 * (1.0 + NU) * G < found["high"]
    assert "E of single depths" in capsys.readouterr().out and (out / "fit.png").stat().st_size > 1e4
    read_back(out / "curve.csv", curve_of("stiffness", "N/m", "depth [m]"))


NONE = "1.7976931348623157E+308"  # what the instrument writes where it has no value


def agilent(depth, load, stiffness):
    """An export with the approach from 1 um above the surface, a segment column, the stiffness before the correction for
    the frame, and an unloading without stiffness."""
    names = [
        "Segment",
        "Displacement Into Surface",
        "Load On Sample",
        "Harmonic Contact Stiffness",
        "Harmonic Stiffness",
    ]
    above = [
        ("", z, 1e-4 * (-1) ** k, 20.0, 20.0) for k, z in enumerate(np.linspace(-1e3, -1.0, 2 * depth.size))
    ]
    below = [("", d, P, S, 0.95 * S) for d, P, S in zip(1e9 * depth, 1e3 * load, stiffness, strict=True)]
    back = [("", 9e8 * depth[-1] * f, 1e3 * load[-1] * f, NONE, NONE) for f in np.linspace(0.99, 0.1, 30)]
    above[0] = ("Load Segment Type", *above[0][1:])
    back[0] = ("Unload From Peak Segment Type", *back[0][1:])
    rows = [names, ["", "nm", "mN", "N/m", "N/m"], *above, *below, *back, ["END", "", "", "", ""]]
    return "".join("\t".join(map(str, row)) + "\n" for row in rows)


def hysitron(depth, load, stiffness):
    names = ["Test Time (s)", "Indent Disp. (nm)", "Indent Act. Load (µN)", "Indent Load (µN)", "Disp. Amp. (nm)",
             "Storage Mod. (GPa)", "Storage Stiff. (µN/nm)", "Loss Stiff. (µN/nm)"]  # fmt: skip
    rows = zip(1e9 * depth, 1e6 * load, 1e-3 * stiffness, strict=True)
    lines = [(0.01 * k, d, P + 117.0, P, 0.65, 70.0, S, 0.02 * S) for k, (d, P, S) in enumerate(rows)]
    text = ["nanoDMA Text Export Version 1.00", "", *("\t ".join(map(str, row)) for row in (names, *lines))]
    return "\n".join(text) + "\n"


@pytest.mark.parametrize("layout", [agilent, hysitron])
def test_the_layouts_of_instruments(tmp_path, layout):
    """The contact stiffness up to the largest load, and nothing of the approach, the hold and the unloading."""
    _, depth, known = film()
    load = 1e3 * depth
    path = tmp_path / "csm.txt"
    path.write_bytes(layout(depth, load, known).encode("latin-1"))
    data = fitting.read_stiffness(path)
    np.testing.assert_allclose([data.depth, data.load, data.stiffness], [depth, load, known], rtol=1e-12)


def test_depths_of_the_other_sign_are_no_approach(tmp_path):
    _, depth, known = film()
    path = tmp_path / "csm.txt"
    path.write_text(agilent(-depth, depth, known))
    with pytest.raises(
        ValueError, match=r"expected depth, load and stiffness > 0, got 12. of 12. rows without"
    ):
        fitting.read_stiffness(path)


@pytest.mark.slow
def test_the_area_function_in_powers_of_nm(tmp_path, capsys):
    """A = 24.5 d^2 + 400 nm d + 900 nm^1.5 d^(1/2), and the stiffness of Sneddon for E = 70 GPa and nu = 0.2."""
    d = np.linspace(50.0, 1000.0, 40)  # contact depths [nm]
    A = 24.5 * d**2 + 400.0 * d + 900.0 * d**0.5
    S = 2.0 / np.sqrt(np.pi) * 70e9 / (1.0 - 0.2**2) * np.sqrt(A) * 1e-9
    load = 9e9 * A * 1e-18
    np.savetxt(
        tmp_path / "csm.csv", np.column_stack([d + 0.75e9 * load / S, 1e3 * load, noisy(S)]), delimiter=",",
        header="Depth (nm),Load (mN),Stiffness (N/m)", comments="",
    )  # fmt: skip
    known = ["fit", "stiffness", str(tmp_path / "csm.csv"), "--cone", "berkovich", "--nu", "0.2"]
    moduli = []
    for flags in (["--area-nm", "24.5,400,900"], ["--area", f"24.5,400e-9,{900 * 1e-9**1.5}"]):
        assert main([*known, *flags, "-o", str(tmp_path / flags[0])]) == 0
        moduli.append(json.loads((tmp_path / flags[0] / "summary.json").read_text())["youngs_modulus_Pa"])
    assert moduli[0]["low"] < 70e9 < moduli[0]["high"] and moduli[0]["high"] < 1.05 * moduli[0]["low"]
    assert moduli[1]["value"] == pytest.approx(moduli[0]["value"])
    assert main([*known, "--area-nm", "24.5,x", "-o", str(tmp_path / "bad")]) == 2
    assert "--area-nm: expected a number, got 'x'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"thickness": -1.0}, "thickness: expected a thickness > 0 m"),
        ({"substrate": SILICON}, "substrate: expected a thickness"),
        ({"contact": "oliver-pharr"}, "load: expected loads"),
        ({"contact": "plastic"}, "contact: expected one of elastic, oliver-pharr"),
        ({"area": (24.5,), "contact": "elastic"}, "area: expected none with an elastic contact"),
        ({"nu": 0.6}, "nu: expected -1 < nu <= 0.5"),
        ({"beta": 3.0}, "beta: expected 0.5 to 2"),
    ],
    ids=lambda given: next(iter(given)) if isinstance(given, dict) else "",
)
def test_mistakes(given, message):
    depth = np.linspace(1e-8, 1e-7, 9)
    with pytest.raises(ValueError, match=message):
        fitting.fit_stiffness(
            fitting.StiffnessData(depth=depth, stiffness=1e11 * depth), **{"indenter": BALL} | given
        )


def test_depths_in_other_units_are_refused():
    """With depths in mm taken as m, and another modulus, the stiffness of a ball is described as well."""
    depth = np.linspace(5e-8, 1e-6, 50)
    data = fitting.StiffnessData(depth=1e3 * depth, stiffness=4.0 * G * np.sqrt(R * depth) / (1.0 - NU))
    with pytest.raises(
        ValueError, match=r"depth: expected less than 2 times the radius of the ball, 5e-06 m, got 0.001 m"
    ):
        fitting.fit_stiffness(data, indenter=BALL, nu=NU)


def test_mistakes_in_data():
    with pytest.raises(ValueError, match="stiffness: expected values > 0 N/m, got 0 at index 0"):
        fitting.StiffnessData(depth=range(1, 7), stiffness=range(6))
