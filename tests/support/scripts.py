"""Scripts of the documentation, imported as modules, and its printed blocks, compared with what a run prints."""

import importlib.util
import re
import sys
from pathlib import Path

import numpy as np

NUMBER = re.compile(r"[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?")
DOCS = Path(__file__).parents[2] / "docs"


def script(path):
    """Return a script in docs/, such as "benchmarks/answers.py", as a module."""
    found = importlib.util.spec_from_file_location(f"docs_{Path(path).stem}", DOCS / path)
    if (folder := str((DOCS / path).parent)) not in sys.path:
        sys.path.append(folder)  # where Python finds the modules of a script that is run
    module = importlib.util.module_from_spec(found)
    sys.modules[found.name] = module
    found.loader.exec_module(module)
    return module


def assert_printed_as_shown(found, shown):
    """Words are equal, and numbers within 1e-3: compilers and processors round differently."""
    assert NUMBER.sub("#", found).split() == NUMBER.sub("#", shown).split()
    numbers = [np.array(NUMBER.findall(text), float) for text in (found, shown)]
    np.testing.assert_allclose(*numbers, rtol=1e-3)
