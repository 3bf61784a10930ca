"""The open set of benchmark problems: its form, its reference values, our answers, and the table of the documentation."""

import json

import pytest
from scripts import DOCS, script

answers, references = script("benchmarks/answers.py"), script("benchmarks/references.py")
QUICK = {"hertz", "line-contact"}
# ten to thirty seconds each
DEAR = {
    "kalker",
    "bentall-johnson",
    "jkr",
    "maugis",
    "spence",
    "cattaneo-mindlin",
    "creeping-layer",
    "pavement",
    "viscoelastic-rolling",
    "archard",
}


def test_every_problem_can_be_read_and_solved_by_anybody():
    assert len(answers.PROBLEMS) >= 16
    assert answers.PROBLEMS.keys() == answers.SOLVERS.keys() == references.PROBLEMS.keys()
    for name, problem in answers.PROBLEMS.items():
        assert problem.keys() == {"title", "source", "method", "inputs", "references"}, name
        assert problem["source"] and problem["inputs"] and problem["references"], name
        for reference in problem["references"].values():
            assert reference.keys() == {"value", "unit", "tolerance"} and 0.0 < reference["tolerance"] < 0.05


@pytest.mark.parametrize("name", [
    name if name in QUICK else pytest.param(name, marks=pytest.mark.long if name in DEAR else pytest.mark.slow)
    for name in references.PROBLEMS
])  # fmt: skip
def test_reference_values_are_those_of_the_formulas(name):
    made, written = references.PROBLEMS[name](), answers.PROBLEMS[name]
    assert json.loads(json.dumps(made)).keys() == written.keys()
    for quantity, reference in written["references"].items():
        assert made["references"][quantity]["value"] == pytest.approx(reference["value"], rel=1e-6), quantity


@pytest.mark.slow
@pytest.mark.parametrize("name", [
    name if name in QUICK else pytest.param(name, marks=pytest.mark.long if name in DEAR else pytest.mark.slow)
    for name in answers.PROBLEMS
])  # fmt: skip
def test_every_answer_is_within_its_tolerance(name, capsys):
    assert answers.outside(name, answers.answer(name)) == [], capsys.readouterr().out


def test_wrong_answers_of_another_code_are_noticed(tmp_path, capsys):
    value = answers.PROBLEMS["hertz"]["references"]["approach"]["value"]
    file = tmp_path / "code.json"
    for factor, status in ((1.0005, 0), (1.005, 1)):
        file.write_text(json.dumps({"hertz": {"approach": factor * value}}))
        assert answers.main(["--check", str(file)]) == status
    assert "NOT within the tolerance" in capsys.readouterr().out


def test_the_page_has_the_table_of_the_files():
    """Its column of answers is that of the last run of the script; the tests above solve the problems again."""
    page = (DOCS / "benchmarks.md").read_text(encoding="utf-8")
    ours = json.loads((DOCS / "benchmarks" / "jaxcontact.json").read_text(encoding="utf-8"))
    assert answers.table(ours) in page
