"""The benchmark problems with derivatives: their form, reference values, our answers, and the tables of the page."""

import json

import numpy as np
import pytest
from scripts import DOCS, script

answers = script("benchmarks/answers.py")
gradients, references = script("benchmarks/gradients.py"), script("benchmarks/gradient_references.py")


def test_every_problem_has_a_value_and_derivatives_and_a_solver():
    names = set(gradients.PROBLEMS)
    assert len(names) == 5 and names == set(gradients.SOLVERS) == set(references.PROBLEMS)
    for name, problem in gradients.PROBLEMS.items():
        assert problem.keys() == {"title", "source", "method", "inputs", "references"}, name
        assert len(problem["references"]) > 1, name
        assert len({reference["unit"] for reference in problem["references"].values()}) == 1, name


@pytest.mark.parametrize("name", references.PROBLEMS)
def test_reference_values_are_those_of_the_formulas(name):
    made, written = references.PROBLEMS[name](), gradients.PROBLEMS[name]
    assert made["inputs"].keys() == written["inputs"].keys()
    for quantity, reference in written["references"].items():
        assert made["references"][quantity]["value"] == pytest.approx(reference["value"], rel=1e-5), quantity


def test_derivatives_that_have_a_closed_form_are_it():
    """With the share s of the pressure of full contact, the derivatives of the mean gap are amplitude (1 - s) along the
    wave and amplitude (1 - s) (1 - 3 s) along half its length. Rate and energy of the growth enter as a product. The
    derivatives of the Burgers material are those of its creep compliance."""
    found = {name: problem["references"] for name, problem in gradients.PROBLEMS.items()}
    wave = gradients.PROBLEMS["surface-heights"]["inputs"]
    full = (
        2.0 * np.pi * wave["amplitude"] * wave["shear_modulus"] / (1.0 - wave["poisson"]) / wave["wavelength"]
    )
    share = wave["mean_pressure"] / full
    exact = wave["amplitude"] * (1.0 - share)
    for along, slope in (("along_the_wave", exact), ("along_half_its_length", exact * (1.0 - 3.0 * share))):
        assert found["surface-heights"][along]["value"] == pytest.approx(slope, rel=1e-8), along

    growth, given = found["growth-kinetics"], gradients.PROBLEMS["growth-kinetics"]["inputs"]
    energy = given["activation_energy"] / (1.380649e-23 * given["temperature"])
    slope = -energy * growth["by_growth_rate"]["value"]
    assert growth["by_activation_energy"]["value"] == pytest.approx(slope, rel=1e-9)

    burgers = gradients.PROBLEMS["burgers-parameters"]["inputs"]
    t, (G1, G2, eta1, eta2) = (
        np.array(burgers["times"]),
        (burgers[name] for name in ("G1", "G2", "eta1", "eta2")),
    )
    decay = np.exp(-t * G2 / eta2)
    creep = 1.0 / G1 + t / eta1 + (1.0 - decay) / G2
    cubed = 0.375 * burgers["radius"] * burgers["load"] * (1.0 - burgers["poisson"]) * creep
    residual = np.log(np.cbrt(cubed) ** 2 / burgers["radius"] / burgers["measured_approach"])
    logs = {
        "G1": -1.0 / G1,
        "G2": t / eta2 * decay - (1.0 - decay) / G2,
        "eta1": -t / eta1,
        "eta2": -t / eta2 * decay,
    }
    for name, by_log in logs.items():
        expected = np.mean(2.0 * residual * 2.0 / 3.0 * by_log / creep)
        assert found["burgers-parameters"][f"by_{name}"]["value"] == pytest.approx(expected, rel=1e-6), name


@pytest.mark.slow
@pytest.mark.parametrize("name", gradients.PROBLEMS)
def test_every_answer_is_within_its_tolerance(name, capsys):
    found = gradients.answer(name)
    assert found.keys() == gradients.PROBLEMS[name]["references"].keys()
    assert answers.outside(name, found, gradients.PROBLEMS) == [], capsys.readouterr().out


def test_wrong_derivatives_of_another_code_are_noticed(tmp_path, capsys):
    value = gradients.PROBLEMS["surface-heights"]["references"]["along_the_wave"]["value"]
    file = tmp_path / "code.json"
    for factor, status in ((1.01, 0), (1.1, 1)):
        file.write_text(json.dumps({"surface-heights": {"along_the_wave": factor * value}}))
        assert gradients.main(["--check", str(file)]) == status
    assert "NOT within the tolerance" in capsys.readouterr().out


def test_the_page_has_the_tables_of_the_files():
    """Answers and costs are those of the last run of the script."""
    page = (DOCS / "benchmarks.md").read_text(encoding="utf-8")
    ours = json.loads(gradients.OURS.read_text(encoding="utf-8"))
    assert answers.table(ours, gradients.PROBLEMS) in page and gradients.cost_table() in page
    assert set(json.loads(gradients.COSTS.read_text(encoding="utf-8"))) == set(gradients.PROBLEMS)
