"""Scripts of the documentation, imported as modules."""

import importlib.util
import sys
from pathlib import Path

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
