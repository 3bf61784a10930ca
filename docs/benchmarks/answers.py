"""Solve the benchmark problems of problems.json with jaxcontact.

    python docs/benchmarks/answers.py                  # all problems: some minutes
    python docs/benchmarks/answers.py hertz ting       # some of them
    python docs/benchmarks/answers.py -o answers.json  # also written as JSON
    python docs/benchmarks/answers.py --check FILE     # the answers of another code, in the same form

Answers are a JSON object {problem: {quantity: value}} in the units of problems.json; a code may leave out problems.
Exit status 1 means that an answer is not within the tolerance of its problem.
"""

import argparse
import json
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace as Inputs
from typing import Any

import answers_moved
import answers_pressed

PROBLEMS = json.loads(
    Path(__file__).with_name("problems.json").read_text(encoding="utf-8")
)
OURS = Path(__file__).with_name("jaxcontact.json")

SOLVERS: dict[str, Callable[[Inputs], dict[str, Any]]] = {
    "hertz": answers_pressed.hertz,
    "line-contact": answers_pressed.line_contact,
    "westergaard": answers_pressed.westergaard,
    "compliant-layer": answers_pressed.layer,
    "stiff-layer": answers_pressed.layer,
    "pavement": answers_pressed.pavement,
    "thin-sample": answers_pressed.thin_sample,
    "tribofilm": answers_pressed.tribofilm,
    "lee-radok": answers_pressed.lee_radok,
    "ting": answers_pressed.ting,
    "creeping-layer": answers_pressed.creeping_layer,
    "hunter": answers_moved.hunter,
    "cattaneo-mindlin": answers_moved.cattaneo_mindlin,
    "spence": answers_moved.spence,
    "carter": answers_moved.carter,
    "bentall-johnson": answers_moved.bentall_johnson,
    "viscoelastic-rolling": answers_moved.viscoelastic_rolling,
    "kalker": answers_moved.kalker,
    "jkr": answers_pressed.jkr,
    "maugis": answers_pressed.maugis,
    "archard": answers_moved.archard,
    "jaeger": answers_moved.jaeger,
}


def answer(name: str) -> dict[str, float]:
    """Return the quantities of a problem, as problems.json names them, computed by jaxcontact."""
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore"
        )  # some problems have strains or edges beyond what users are warned of
        found = SOLVERS[name](Inputs(**PROBLEMS[name]["inputs"]))
    return {quantity: float(found[quantity]) for quantity in PROBLEMS[name]["references"]}


def outside(
    name: str, found: dict[str, float], problems: dict[str, Any] = PROBLEMS
) -> list[str]:
    """Print a problem with its answers; return the quantities that are not within their tolerance."""
    wrong = []
    print(f"{name}: {problems[name]['title']}")
    for quantity, reference in problems[name]["references"].items():
        if quantity not in found:
            continue
        error = found[quantity] / reference["value"] - 1.0
        verdict = (
            "" if abs(error) <= reference["tolerance"] else "  NOT within the tolerance"
        )
        print(
            f"  {quantity:30} {found[quantity]:14.6g} {reference['unit']:4} reference {reference['value']:14.6g}"
            f"  error {100 * error:+8.3f} %  tolerance {100 * reference['tolerance']:g} %{verdict}",
            flush=True,
        )
        wrong += [quantity] if verdict else []
    return wrong


def table(
    answers: dict[str, dict[str, float]], problems: dict[str, Any] = PROBLEMS
) -> str:
    """Return the table of problems, references and answers, in Markdown."""
    lines = [
        "| problem | source; method of the reference | quantity | reference | jaxcontact | error | tolerance |"
    ]
    lines.append("|" + "---|" * 7)
    for name, problem in problems.items():
        about = [
            f"{problem['title']} (`{name}`)",
            f"{problem['source']}; {problem['method']}",
        ]
        for quantity, reference in problem["references"].items():
            value, unit, found = (
                reference["value"],
                reference["unit"],
                answers[name][quantity],
            )
            shown = f"{value:.5g} {unit}" if unit != "1" else f"{value:.5g}"
            error = f"{100 * (found / value - 1.0):+.3f} % | {100 * reference['tolerance']:g} %"
            lines.append(
                f"| {' | '.join(about)} | {quantity.replace('_', ' ')} | {shown} | {found:.5g} | {error} |"
            )
            about = ["", ""]
    return "\n".join(lines)


def command(
    description: str,
    problems: dict[str, Any],
    solve: Callable[[str], dict[str, float]],
    page: Callable[[], str],
    arguments: Sequence[str] | None,
    cost: Callable[[str], dict[str, float]] | None = None,
) -> int:
    """Run the command line of a set of problems; return 1 if an answer lies outside its tolerance, else 0.

    solve: the answers to a problem; page: the tables of the documentation; cost: what ``--cost`` measures.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help="problems; all by default"
    )
    parser.add_argument("-o", "--output", type=Path, help="write the answers as JSON")
    parser.add_argument(
        "--check",
        type=Path,
        metavar="FILE",
        help="read the answers of another code from a file",
    )
    parser.add_argument(
        "--table", action="store_true", help="print the tables of the documentation"
    )
    if cost is not None:
        parser.add_argument(
            "--cost", action="store_true", help="measure the cost of a gradient instead"
        )
    given = parser.parse_args(arguments)
    if unknown := [name for name in given.names if name not in problems]:
        parser.error(f"no problem {unknown[0]!r}; there are {', '.join(problems)}")
    if given.table:
        print(page())
        return 0
    known = json.loads(given.check.read_text(encoding="utf-8")) if given.check else None
    names = given.names or list(problems if known is None else known)
    found: dict[str, dict[str, float]] = {}
    wrong: list[str] = []
    for name in names:
        if cost is not None and given.cost:
            found[name] = cost(name)
            continue
        found[name] = solve(name) if known is None else known[name]
        wrong += outside(name, found[name], problems)
    if given.output:
        given.output.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 1 if wrong else 0


def main(arguments: Sequence[str] | None = None) -> int:
    return command(
        "Solve the benchmark problems with jaxcontact, or check answers.",
        PROBLEMS,
        answer,
        lambda: table(json.loads(OURS.read_text(encoding="utf-8"))),
        arguments,
    )


if __name__ == "__main__":
    sys.exit(main())
