"""Gels of known causes of their relaxation, from the generator of ``tests.benchmarks.poroelastic_causes``."""

import dataclasses
import json

import numpy as np
import pytest

import fitting
import jaxcontact as jc
from jaxcontact.__main__ import main
from tests.benchmarks.poroelastic_causes import BEAD, KINDS, designs, gel, holds_of


def holds(kind, seed=0, **given):
    rng = np.random.default_rng([77, KINDS.index(kind), seed])
    properties = gel(kind, rng)
    return properties, holds_of(properties, rng, **given)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_the_cause_is_named_from_two_depths_and_not_from_one(kind):
    properties, curves = holds(kind)
    found = fitting.relaxation_cause(curves, indenter=BEAD)
    assert found.cause == kind
    low, high = found.share
    if kind == "viscoelastic":
        assert low == 0.0 and high < 0.2
    else:
        assert high > 0.2
        best, low, high = found.diffusivity
        assert low < properties[2] < high and low <= best <= high
    assert kind in found.summary() and found.to_dict()["cause"] == kind
    assert fitting.relaxation_cause(curves[:1], indenter=BEAD).cause == "cannot tell"


@pytest.mark.slow
def test_a_modulus_in_common_tells_more():
    _, curves = holds("poroelastic", points=100)
    free = fitting.relaxation_cause(curves, indenter=BEAD)
    same = fitting.relaxation_cause(curves, indenter=BEAD, same_modulus=True)
    assert same.cause == "poroelastic" and same.share[0] >= free.share[0] - 0.02
    # one depth is 10 % off: times alone do not see it, a modulus in common does
    off = [curves[0], dataclasses.replace(curves[1], load=1.1 * curves[1].load)]
    times = fitting.relaxation_cause(off, indenter=BEAD)
    np.testing.assert_allclose(times.share, free.share, atol=1e-3)
    assert (
        fitting.relaxation_cause(off, indenter=BEAD, same_modulus=True).chi2["both"] > 1.5 * same.chi2["both"]
    )


@pytest.mark.long
def test_design_states_which_second_depth_would_tell():
    """What it predicts for one hold holds for simulated pairs."""
    _, curves = holds("poroelastic")
    one = fitting.relaxation_cause(curves[:1], indenter=BEAD)
    found = fitting.design(one)
    assert 1.5 <= found.ratio <= 5.0 and "tells the cause" in str(found)
    assert found.named[5.0]["poroelastic"] == "poroelastic" and found.named[5.0].get(
        "viscoelastic", "viscoelastic"
    ) == ("viscoelastic")
    depth = 3e-6 * found.ratio
    _, pair = holds("poroelastic", depths=(3e-6, depth))
    assert fitting.relaxation_cause(pair, indenter=BEAD).cause == "poroelastic"


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS[:2])
def test_the_second_depth_that_design_states_tells_most_gels_and_a_smaller_one_does_not(kind):
    ratios, told, smaller = designs(2, seed=5, kinds=(kind,))[kind]
    assert all(1.5 <= ratio <= 5.0 for ratio in ratios) and told == 2 and smaller == 0


@pytest.mark.slow
def test_what_cannot_be_told_is_not_named():
    _, curves = holds("poroelastic")
    alike = fitting.relaxation_cause([curves[1], curves[1]], indenter=BEAD)
    assert alike.cause == "cannot tell" and "same contact radius" in alike.reason
    t = curves[0].t
    flat = [
        dataclasses.replace(
            one, load=np.full(t.size, 1e-6) * (1 + 0.02 * np.random.default_rng(0).standard_normal(t.size))
        )
        for one in curves
    ]
    assert "hardly relaxes" in fitting.relaxation_cause(flat, indenter=BEAD).reason
    wavy = [
        dataclasses.replace(one, load=one.load * (1 + 0.15 * np.sin(np.log(one.t + 1e-9) * 6)))
        for one in curves
    ]
    assert fitting.relaxation_cause(wavy, indenter=BEAD).cause == "cannot tell"
    with pytest.raises(ValueError, match="expected forces > 0 N"):
        fitting.relaxation_cause([dataclasses.replace(one, load=-one.load) for one in curves], indenter=BEAD)
    with pytest.raises(ValueError, match="expected a depth in m and not in mm, um or nm, and a radius in m"):
        fitting.relaxation_cause(
            [dataclasses.replace(one, depth=1e6 * one.depth) for one in curves], indenter=BEAD
        )


@pytest.mark.slow
def test_both_causes_are_in_doubt_where_ramps_are_not_known():
    """A network alone, pressed at one speed to two depths, without the points of the ramp."""
    holds, parts = [], (np.arange(500) + 0.5) / 500
    ramps = [1.0, 3.0]
    for seed, ramp in enumerate(ramps):
        since = ramp + np.geomspace(0.02, 60.0, 150)
        lags = since[:, None] - ramp * parts ** (2 / 3)
        relaxed = np.mean(0.4 + 0.3 * np.exp(-lags) + 0.3 * np.exp(-lags / 20.0), 1)
        noise = 0.005 * np.random.default_rng([0, seed]).standard_normal(150)
        depth = 2e-6 * ramp
        load = depth**1.5 * relaxed * (1.0 + noise)
        holds.append(fitting.IndentationData(t=since, load=1e3 * load, depth=np.full(150, depth)))
    assert fitting.relaxation_cause(holds, indenter=jc.Sphere(50e-6), ramp=ramps).cause == "viscoelastic"
    later = [dataclasses.replace(one, t=one.t - one.t[0] + 1e-3) for one in holds]
    found = fitting.relaxation_cause(later, indenter=jc.Sphere(50e-6))
    assert found.cause == "both" and "step at t = 0 is assumed" in found.reason


@pytest.mark.slow
def test_the_command_names_the_cause_of_two_files_and_the_second_depth_for_one(tmp_path, capsys):
    _, curves = holds("poroelastic", points=250)
    files = [str(tmp_path / f"{k}.csv") for k in range(2)]
    for file, one in zip(files, curves, strict=True):
        rows = np.column_stack([one.t, one.load, one.depth])
        np.savetxt(file, rows, delimiter=",", header="t [s],load [N],depth [m]", comments="")
    words = ["fit", "cause", *files, "-o", str(tmp_path / "out"), "--radius", "50e-6"]
    assert main(words) == 0
    expected = fitting.relaxation_cause(curves, indenter=BEAD)
    assert expected.summary() in capsys.readouterr().out
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert found["cause"] == expected.cause == "poroelastic" and found["files"] == ["0.csv", "1.csv"]
    assert main([*words, "--ramp", "0.1,0.2,0.3", "--force"]) == 2
    assert "expected one, or one for each of 2 curves, got 3" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main([*words, "--punch"])


@pytest.mark.parametrize("error", [0.0, 1e-3])
def test_holds_that_do_not_relax_have_no_cause_and_no_diffusivity(error):
    rng, t, bead = np.random.default_rng(2), np.geomspace(0.02, 60.0, 80), jc.Sphere(50e-6)
    holds = [
        fitting.IndentationData(
            t=t, load=load * (1.0 + error * rng.standard_normal(80)), depth=np.full(80, depth)
        )
        for load, depth in ((1e-6, 2e-6), (5e-6, 6e-6))
    ]
    found = fitting.relaxation_cause(holds, indenter=bead)
    assert found.cause == "cannot tell" and "hardly relaxes" in found.reason and "nan" not in str(found)
    assert np.isnan(found.nu) and found.to_dict()["nu"] is None
