"""Docstrings: whole, with arguments, units and an example that runs."""

import ast
import doctest
import inspect
import warnings
from pathlib import Path

import numpy as np
import pytest

import fitting
import jaxcontact as jc

ROOT = Path(__file__).parents[2]
SOURCES = sorted([*(ROOT / "jaxcontact").rglob("*.py"), *(ROOT / "fitting").rglob("*.py")])
PUBLIC = [getattr(module, name) for module in (jc, fitting) for name in getattr(module, "__all__", ())]
GIVEN = [  # what users are given, and do not make
    *(
        jc.AdhesiveHistory,
        jc.AdhesiveSlidingHistory,
        jc.ContactClusters,
        jc.ContactHistory,
        jc.ContactStatistics,
        jc.InteriorFields,
        jc.Deflection,
        jc.PressureHistogram,
        jc.RubbingHistory,
        jc.ShearHistory,
        jc.SlidingHistory,
        jc.SteadyRolling,
        jc.SteadySliding,
        jc.Sensitivity,
        jc.Status,
        jc.Study,
        jc.Surface,
        jc.SurfaceStatistics,
    ),
    *(
        fitting.AdhesiveFit,
        fitting.BatchFit,
        fitting.Comparison,
        fitting.CreepFit,
        fitting.Design,
        fitting.ForceFit,
        fitting.ViscoelasticForceFit,
        fitting.StiffnessFit,
        fitting.SpectrumFit,
        fitting.GrowthFit,
        fitting.IndentationFit,
        fitting.MapFit,
        fitting.MasterFit,
        fitting.MaxwellFit,
    ),
    *(
        fitting.FieldFit,
        fitting.JointFit,
        fitting.Minimum,
        fitting.ModulusFit,
        fitting.PoroelasticFit,
        fitting.RelaxationCause,
        fitting.Posterior,
        fitting.PronyFit,
        fitting.Propagated,
    ),
]


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_docstring_begins_with_a_whole_sentence(path):
    """Its first paragraph ends where a sentence may end."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            first, _, rest = (ast.get_docstring(node) or ".").partition("\n\n")
            formula_follows = rest.startswith("    ")
            assert formula_follows or first.rstrip()[-1] in ".:)?", f"{getattr(node, 'name', '')}: {first}"


@pytest.mark.parametrize("thing", PUBLIC, ids=lambda thing: thing.__name__)
def test_public_docstrings_name_every_argument_and_what_comes_back(thing):
    doc = inspect.getdoc(thing) or ""
    if thing in GIVEN:
        assert len(doc.splitlines()) > 2, thing
        return
    arguments = [name for name in inspect.signature(thing).parameters if name not in ("self", "_state")]
    assert not arguments or "\nArgs:\n" in doc
    listed = doc.partition("\nArgs:\n")[2].partition("\nReturns:\n")[0]
    missing = [name for name in arguments if name not in listed]
    assert not missing
    assert inspect.isclass(thing) or "\nReturns:\n" in doc
    assert "\nExample:\n" in doc


@pytest.mark.slow
@pytest.mark.parametrize("thing", PUBLIC, ids=lambda thing: thing.__name__)
def test_examples_run(thing):
    names = {"jc": jc, "fitting": fitting, "np": np}
    tests = doctest.DocTestFinder(recurse=False).find(thing, thing.__name__, globs=names)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for test in tests:
            runner.run(test)
    assert runner.failures == 0
