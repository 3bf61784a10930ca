"""Poroelastic fits against the formulas of Hu et al. written out, and the ramp against a numerical solution."""

import dataclasses
import json
import re

import numpy as np
import pytest

import fitting
import jaxcontact as jc
from jaxcontact.__main__ import main
from tests.support.poroelastic_contact import BALL, CONE, Drained, Sealed, hu, ramp_error
from tests.support.poroelastic_elements import relaxation
from tests.support.tables import curve_of, read_back

BEAD = jc.Sphere(50e-6)
G, NU, D = 8e3, 0.25, 2e-10


def force(t, depth, indenter=BEAD, nu=NU, ramp=0.0, G=G, D=D, parts=4000):
    """F(t) after a ramp at constant speed, by a sum over increments of the depth."""
    if isinstance(indenter, jc.Sphere):
        a, size, curve, power = np.sqrt(indenter.radius * depth), 16 / 3, BALL, 1.5
    else:
        a, size, curve, power = 2 / np.pi * depth * np.tan(indenter.half_angle), 4.0, CONE, 2.0
    late = size * G * a * depth / (2 * (1 - nu))
    part = size * G * a * depth - late
    step = lambda lag: np.where(lag >= 0, late + part * hu(D * np.maximum(lag, 0) / a**2, curve), 0.0)
    error = ramp_error(D * ramp / a**2, D * np.maximum(t - ramp, 0) / a**2) * (t >= ramp)
    share = (np.arange(parts if ramp else 1) + 0.5) / parts
    return np.mean([step(t - ramp * one ** (1 / power)) for one in share], axis=0) - part * error


def curve(depth, indenter=BEAD, ramp=0.5, noise=0.0, seed=0, end=300.0, n=120, **given):
    """A ramp from contact on and a hold."""
    up = np.linspace(0.0, ramp, 25)[:-1] if ramp else np.zeros(0)
    t = np.append(up, ramp + np.geomspace(0.02, end, n))
    depths = np.minimum(t / ramp, 1.0) * depth if ramp else np.full(n, depth)
    load = force(t, depth, indenter, ramp=ramp, **given)
    errors = np.random.default_rng(seed).standard_normal(t.size) * noise * load.max()
    return fitting.IndentationData(t=t, load=load + errors, depth=depths)


@pytest.mark.parametrize("indenter", [BEAD, jc.Cone(1.2)], ids=["ball", "cone"])
def test_forces_are_on_the_master_curves(indenter):
    gel = fitting.Poroelastic(G=G, nu=NU, D=D)
    t = np.append(0.0, np.geomspace(1e-3, 1e4, 50))
    np.testing.assert_allclose(gel.force(t, 4e-6, indenter), force(t, 4e-6, indenter), rtol=1e-12)
    np.testing.assert_allclose(
        gel.force(0.0, 4e-6, indenter) / gel.force(1e9, 4e-6, indenter), 2 * (1 - NU), rtol=1e-9
    )


@pytest.mark.parametrize("indenter", [BEAD, jc.Cone(1.2)], ids=["ball", "cone"])
@pytest.mark.parametrize("ramp", [0.0, 0.5])
def test_parameters_come_back(indenter, ramp):
    data = curve(5e-6, indenter, ramp)
    fit = fitting.fit_poroelastic(data, indenter=indenter, weights="relative", viscosity=1e-3)
    np.testing.assert_allclose([fit.values[name] for name in ("G", "nu", "D")], [G, NU, D], rtol=2e-3)
    k = D * 1e-3 * (1 - 2 * NU) / (2 * (1 - NU) * G)
    np.testing.assert_allclose(fit.permeability[0], k, rtol=4e-3)
    # without noise and ramp the interval is as wide as rounding
    low, high = fit.permeability[1:]
    assert fit.verdict == "accepted" and low * (1 - 1e-12) < k < high * (1 + 1e-12)
    assert fit.ramps == pytest.approx([ramp])


@pytest.mark.slow
def test_a_ramp_that_is_stated_is_the_one_that_is_measured():
    data = curve(5e-6, ramp=0.5, noise=0.01)
    hold = fitting.IndentationData(t=data.t[24:], load=data.load[24:], depth=data.depth[24:])
    whole = fitting.fit_poroelastic(data, indenter=BEAD, weights="absolute")
    part = fitting.fit_poroelastic(hold, indenter=BEAD, weights="absolute", ramp=0.5)
    np.testing.assert_allclose(list(part.values.values()), list(whole.values.values()), rtol=2e-3)
    # its history is known
    later = fitting.fit_poroelastic(data.window(0.51, None), indenter=BEAD, weights="absolute")
    np.testing.assert_allclose(list(later.values.values()), list(whole.values.values()), rtol=2e-3)
    step = fitting.fit_poroelastic(hold, indenter=BEAD, weights="absolute", ramp=0.0)
    assert abs(step.values["D"] / D - 1) > 2 * abs(whole.values["D"] / D - 1)


@pytest.mark.slow
def test_a_hold_without_its_ramp_has_a_note_on_what_the_ramp_would_change():
    whole = curve(5e-6, ramp=0.1, noise=0.003)
    hold = fitting.IndentationData(t=whole.t[24:], load=whole.load[24:], depth=whole.depth[24:])
    said = lambda fit: [note for note in fit.notes if "from t = 0 to the first point" in note]
    step = fitting.fit_poroelastic(hold, indenter=BEAD)
    (note,) = said(step)
    changes = [
        float(word.split(" by ")[1].split(" ")[0])
        for word in note.split("would change ")[1].split(":")[0].split(", ")
    ]
    known = fitting.fit_poroelastic(hold, indenter=BEAD, ramp=float(hold.t[0]))
    ratio = {name: known.values[name] / step.values[name] - 1 for name in ("G", "D")}
    expected = [100 * ratio["G"], known.values["nu"] - step.values["nu"], 100 * ratio["D"]]
    np.testing.assert_allclose(changes, expected, rtol=0.25)
    assert not said(known) and not said(fitting.fit_poroelastic(whole, indenter=BEAD))
    assert not said(fitting.fit_poroelastic(hold, indenter=BEAD, ramp=0.0))


@pytest.mark.slow
def test_two_holds_have_their_parameters_in_common():
    holds = [curve(depth, noise=0.02, seed=i) for i, depth in enumerate((3e-6, 9e-6))]
    fit = fitting.fit_poroelastic(holds, indenter=BEAD)
    for name, truth in (("G", G), ("nu", NU), ("D", D)):
        low, high = fit.intervals[name]
        assert low < truth < high and fit.identified[name]
    assert fit.verdict == "accepted" and np.unique(fit.which).size == 2
    assert (
        "a^2/D" in fit.summary()
        and fit.plot() is not None
        and fit.to_dict()["depths_m"] == pytest.approx([3e-6, 9e-6])
    )
    np.testing.assert_allclose(fit.predict(1e9, hold=1), force(1e9, 9e-6), rtol=0.05)


@pytest.mark.slow
def test_a_network_that_relaxes_too_is_found_with_two_depths():
    holds = []
    for i, depth in enumerate((3e-6, 9e-6)):
        one = curve(depth, ramp=0.0, end=1000.0)
        network = 0.6 + 0.4 * np.exp(-one.t / 2.0)
        errors = 1 + 0.003 * np.random.default_rng(i).standard_normal(one.t.size)
        holds.append(dataclasses.replace(one, load=one.load * network * errors))
    fit = fitting.fit_poroelastic(holds, indenter=BEAD, network=True, weights="proportional", level=0.999)
    truth = {"G": G, "nu": NU, "D": D, "relaxed": 0.6, "tau": 2.0}
    np.testing.assert_allclose([fit.values[name] for name in truth], list(truth.values()), rtol=0.1)
    assert all(low < truth[name] < high for name, (low, high) in fit.intervals.items())
    assert fit.verdict == "accepted"
    without = fitting.fit_poroelastic(holds, indenter=BEAD, weights="proportional")
    assert without.verdict == "rejected"


@pytest.mark.slow
def test_the_numerical_solution_has_the_limits_of_hertz():
    """Undrained at once, drained at the end: F = 8 a d G/(3 (1 - nu)) with nu = 1/2 and the drained one."""
    drained = Drained(NU, 60)
    t = np.append(0.0, np.geomspace(1e-3, 1e5, 60))
    F = drained.force(t, np.ones(t.size), drained.x**2)
    np.testing.assert_allclose(F[[0, -1]], [8 / 3, 8 / 3 / (2 * (1 - NU))], rtol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("ramp", [0.01, 0.1])
def test_the_ramp_is_a_superposition_over_the_final_contact(ramp):
    """A ball on a half-space with a drained surface: the force after a ramp from that after a step, both computed."""
    drained = Drained(0.2, 60)
    t = np.append(0.0, np.geomspace(1e-5, 8.0, 70))
    F0, Finf = 8 / 3, 8 / 3 / 1.6
    step = drained.force(t, np.ones(t.size), drained.x**2)
    g = lambda x: np.interp(np.sqrt(x), np.sqrt(t), (step - Finf) / (F0 - Finf))
    up = np.linspace(0.0, ramp, 31)
    times = np.append(up, ramp + np.geomspace(0.02 * ramp, 5.0, 30))
    F = drained.force(times, np.minimum(times / ramp, 1.0), drained.x**2)[31:]
    share = (np.arange(400) + 0.5) / 400
    rule = np.array([np.mean(g(one - ramp * share ** (2 / 3))) for one in times[31:]])
    error = rule - (F - Finf) / (F0 - Finf)
    assert np.max(np.abs(error)) < 0.008  # what the intervals include
    late = times[31:] > 3 * ramp
    assert np.max(np.abs(error[late])) < 0.003
    by_radius = np.array(
        [np.mean(g((one - ramp * share ** (2 / 3)) / share ** (2 / 3))) for one in times[31:]]
    )
    assert np.max(np.abs(by_radius - (F - Finf) / (F0 - Finf))) > 0.05


def extrapolated(few, many):
    """The limit of a method of first order in the time step, from two numbers of steps."""
    return 2 * many - few


@pytest.mark.slow
def test_two_solutions_of_the_sealed_contact_agree_and_differ_from_the_published_curve():
    """An integral equation and finite elements, both with the radius of the contact fixed."""
    at = np.array([0.03, 0.1, 0.32, 1.0])
    t, g = relaxation(0.2, sealed=True)
    elements = np.interp(np.sqrt(at), np.sqrt(t), g)
    sealed, found = Sealed(0.2), []
    for n in (40, 80):
        t = np.append(0.0, np.geomspace(1e-4, 1.5, n))
        F = sealed.force(t, np.ones(n + 1), sealed.x**2, step=True, fixed=True) / (8 / 3)
        found.append(np.interp(np.sqrt(at), np.sqrt(t), (F - 1 / 1.6) / (1 - 1 / 1.6)))
    np.testing.assert_allclose(extrapolated(*found), elements, atol=0.01)
    assert np.all(np.abs(elements - hu(at))[1:] > 0.04)  # docs/limits.md


@pytest.mark.long
def test_the_effect_of_the_growing_contact_in_a_ramp():
    """The superposition over the final contact, and the force under a sealed ball."""
    sealed = Sealed(0.2)
    F0, Finf = 8 / 3, 8 / 3 / 1.6
    share, after = (np.arange(400) + 0.5) / 400, np.geomspace(0.05, 10.0, 12)
    at = np.append(0.0, np.geomspace(1e-5, 6.0, 60))

    def stepped(n):
        t = np.append(0.0, np.geomspace(1e-5, 6.0, n))
        F = sealed.force(t, np.ones(t.size), sealed.x**2, step=True)
        return np.interp(np.sqrt(at), np.sqrt(t), (F - Finf) / (F0 - Finf))

    def ramped(ramp, n):
        t = np.append(
            np.linspace(0.0, ramp, n + 1), ramp * (1 + np.geomspace(0.05, 10.0, 11 * (n // 16) + 1))
        )
        F = sealed.force(t, np.minimum(t / ramp, 1.0), sealed.x**2)
        return ((F - Finf) / (F0 - Finf))[n + 1 :: n // 16]

    g = extrapolated(stepped(60), stepped(120))
    for ramp in (0.03, 0.1):
        F = extrapolated(ramped(ramp, 32), ramped(ramp, 64))
        lags = ramp * (1 + after[:, None]) - ramp * share ** (2 / 3)
        rule = np.mean(np.interp(np.sqrt(lags), np.sqrt(at), g), 1)
        np.testing.assert_allclose(rule - F, ramp_error(ramp, ramp * after), atol=0.004)
        assert np.max(rule - F) > 0.008


@pytest.mark.slow
@pytest.mark.parametrize("ramp", [0.02, 0.1])
def test_zeros_that_are_not_those_of_the_contact_are_rejected(ramp):
    data = curve(5e-6, ramp=ramp, noise=0.01)
    assert fitting.fit_poroelastic(data, indenter=BEAD).verdict == "accepted"
    top = data.load.max()
    for wrong in (
        dataclasses.replace(data, load=data.load + 0.05 * top),
        dataclasses.replace(data, load=data.load - 0.05 * top),
        dataclasses.replace(data, depth=data.depth + 1e-6),
        dataclasses.replace(data, depth=data.depth - 0.5e-6),
    ):
        fit = fitting.fit_poroelastic(wrong, indenter=BEAD)
        assert fit.verdict == "rejected" and "not at zero" in fit.refused[0]
    # with points before contact, at any zeros: in_contact() finds them
    n = 30
    free = fitting.IndentationData(
        t=np.append(np.arange(n) * ramp / 25, data.t + n * ramp / 25),
        load=np.append(data.load[:1] + 0.01 * top * np.random.default_rng(1).standard_normal(n), data.load)
        + 0.05 * top,
        depth=np.append(np.linspace(-n / 25, 0, n, endpoint=False) * 5e-6, data.depth) + 3e-6,
    )
    assert fitting.fit_poroelastic(free, indenter=BEAD).verdict == "rejected"
    fit = fitting.fit_poroelastic(free.in_contact(indenter=BEAD), indenter=BEAD)
    np.testing.assert_allclose([fit.values["G"] / G, fit.values["D"] / D], 1.0, atol=0.12)
    # a contact that is taken too early is rejected, and the depth by which the reason corrects it is that of the contact
    early = free.in_contact(3e-6 - 0.3e-6)
    fit = fitting.fit_poroelastic(early, indenter=BEAD)
    found = re.search(r"the contact is (\S+) m deeper than the one of in_contact\(\)", fit.refused[0])
    # trial depths are 0.03 um apart, and noise of 1 % moves the best one
    assert float(found[1]) == pytest.approx(0.3e-6, abs=0.05e-6)
    better = free.in_contact(3e-6 - 0.3e-6 + float(found[1]))
    assert fitting.fit_poroelastic(better, indenter=BEAD).verdict == "accepted"


def test_what_wrong_zeros_would_change_is_stated_without_a_ramp():
    hold = curve(5e-6, ramp=0.0, noise=0.003)
    fit = fitting.fit_poroelastic(hold, indenter=BEAD)
    (note,) = [one for one in fit.notes if "an offset of 1 % of the largest force" in one]
    moved = fitting.fit_poroelastic(
        dataclasses.replace(hold, load=hold.load + 0.01 * hold.load.max()), indenter=BEAD
    )
    stated = float(note.split("nu by ")[1].split(",")[0])
    np.testing.assert_allclose(stated, moved.values["nu"] - fit.values["nu"], rtol=0.25)


@pytest.mark.slow
def test_thin_samples_and_strong_relaxation_are_named():
    data = curve(5e-6, noise=0.005)
    thin = fitting.fit_poroelastic(data, indenter=BEAD, thickness=60e-6)
    assert thin.verdict == "rejected" and "rigid base" in thin.refused[0]
    thick = fitting.fit_poroelastic(data, indenter=BEAD, thickness=2e-3)
    assert thick.verdict == "accepted" and any("of the thickness" in note for note in thick.notes)
    fast = dataclasses.replace(data, load=data.load * (0.2 + 0.8 * np.exp(-data.t / 3.0)))
    assert any("network relaxes too" in note for note in fitting.fit_poroelastic(fast, indenter=BEAD).notes)


@pytest.mark.slow
def test_a_loose_sample_is_stiffened_less_by_its_base():
    """By f(x)/(4 x^(3/2)/3) - 1 with f(0.1) of a thin gel, x = R d/h^2: bonded 0.06581, loose 0.05521."""
    data, thickness = curve(5e-6, noise=0.005), np.sqrt(float(BEAD.radius) * 5e-6 / 0.1)
    for unbonded, f in ((False, 0.06581), (True, 0.05521)):
        fit = fitting.fit_poroelastic(data, indenter=BEAD, thickness=thickness, unbonded=unbonded)
        (against,) = [one for one in fit.refused if "rigid base" in one]
        raised = float(against.split("sample by ")[1].split(" %")[0])
        # printed with two digits: half of the last one, and 0.1 for those of f
        assert raised == pytest.approx(100.0 * (f / (4.0 / 3.0 * 0.1**1.5) - 1.0), abs=0.6)
    with pytest.raises(ValueError, match="unbonded: expected False without a layer, got True"):
        fitting.fit_poroelastic(data, indenter=BEAD, unbonded=True)


def test_what_has_no_hold_is_refused():
    data = curve(5e-6)
    t = np.linspace(0.0, 1.0, 40)
    ramp = fitting.IndentationData(t=t, load=t, depth=1e-6 * t)
    in_micrometres = dataclasses.replace(data, depth=1e6 * data.depth)
    pulling = dataclasses.replace(data, load=-data.load)
    outwards = dataclasses.replace(data, depth=-data.depth)
    fit = fitting.fit_poroelastic
    for call, words in (
        (lambda: fit(ramp, indenter=BEAD), "expected a hold of at least 8 points"),
        (lambda: fit(t, indenter=BEAD), "data: expected IndentationData"),
        (lambda: fit([], indenter=BEAD), "at least one curve"),
        (lambda: fit(pulling, indenter=BEAD), r"load: expected forces > 0 N where the indenter presses, got -\S+ N in the"),
        (lambda: fitting.relaxation_cause([data, pulling], indenter=BEAD), "load: expected forces > 0 N"),
        (lambda: fit(outwards, indenter=BEAD), r"depth: expected depths > 0 m .* got -5e-06 to 0 m"),
        (lambda: fit(in_micrometres, indenter=BEAD), "expected a depth in m and not in mm, um or nm, and a radius in m"),
        (lambda: fit(data, indenter=jc.FlatPunch(1e-6)), "expected a Sphere or a Cone"),
        (lambda: fit(data, indenter=jc.Sphere(1e-3, jc.Elastic(1e9))), "expected a rigid one"),
        (lambda: fit(data, indenter=[BEAD, BEAD]), "one for each of 1 curves"),
        (lambda: fit(data, indenter=BEAD, ramp=5.0), "ramp: expected 0 to"),
        (lambda: fit(data, indenter=BEAD, viscosity=-1.0), "viscosity: expected a number > 0"),
        (lambda: fit(data, indenter=BEAD, bounds={"nu": (0.1, 0.7)}), "fixed, bounds: expected nu from 0 to 0.5"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=words):
            call()


@pytest.mark.parametrize(
    ("kind", "words", "line"),
    [
        (
            "poroelastic",
            "--radius 50",
            "--radius: expected a length in m, got 50 m, and 50 um is --radius 50e-6",
        ),
        ("cause", "--radius 50", "--radius: expected a length in m, got 50 m, and 50 um is --radius 50e-6"),
        (
            "cause",
            "--radius 50e-6 --ramp 99",
            "--ramp: expected 0 to 0.52 s, the begin of the hold, got 99.0",
        ),
        (
            "poroelastic",
            "--radius 50e-6 --viscosity -1",
            "--viscosity: expected a number > 0 or None, got -1.0",
        ),
        (
            "poroelastic",
            "--radius 50e-6 --fix nu=0.7",
            "--fix, --bound: expected nu from 0 to 0.5, got 0.7 to 0.7",
        ),
        ("poroelastic", "--radius 50e-6 --thickness 20", "--thickness: expected a length in m, got 20 m"),
    ],
)
def test_a_wrong_option_of_a_hold_is_one_line(tmp_path, capsys, kind, words, line):
    data = curve(5e-6)
    rows = "".join(
        f"{t:.9g},{P:.9g},{d:.9g}\n" for t, P, d in zip(data.t, data.load, data.depth, strict=True)
    )
    (tmp_path / "hold.csv").write_text("Time (s),Load (N),Depth (m)\n" + rows)
    command = ["fit", kind, str(tmp_path / "hold.csv"), "-o", str(tmp_path / "out")]
    assert main([*command, *words.split()]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and line in said[0] and not (tmp_path / "out").exists()


@pytest.mark.slow
def test_the_command_reads_a_hold_and_writes_its_parameters(tmp_path, capsys):
    data = curve(5e-6, noise=0.01)
    columns = np.column_stack([data.t, data.load, data.depth])
    path, out = tmp_path / "hold.csv", tmp_path / "out"
    np.savetxt(path, columns, delimiter=",", header="t [s],load [N],depth [m]", comments="")
    words = ["fit", "poroelastic", str(path), "-o", str(out), "--radius", "50e-6", "--viscosity", "1e-3"]
    assert main(words) == 0
    printed = capsys.readouterr().out
    summary = json.loads((out / "summary.json").read_text())
    assert "permeability" in printed and (out / "fit.png").exists()
    assert len(read_back(out / "curve.csv", curve_of("force", "N"))) > 20
    low, high = summary["intervals"]["D_m2_per_s"]
    assert low < D < high and summary["permeability_m2"]["value"] > 0
