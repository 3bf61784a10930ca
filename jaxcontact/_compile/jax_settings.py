"""The settings of jax on which this package relies: made at once, or when jax is imported if it is not yet.

No module of jax is imported here, so that ``import jaxcontact`` alone takes no time.
"""

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType


def make() -> None:
    """Make the settings; where jax is not imported yet, at the end of its import, before any other module can use it."""
    if "jax" in sys.modules:
        _make(sys.modules["jax"])
    else:
        sys.meta_path.insert(0, _AtImport())


class _AtImport(MetaPathFinder):
    """An importer that finds jax as the other importers do, and makes the settings once the module is executed."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != "jax":
            return None
        others = [finder for finder in sys.meta_path if finder is not self]
        found = next(filter(None, (finder.find_spec(name, path, target) for finder in others)), None)
        if found is not None and found.loader is not None:
            execute = found.loader.exec_module

            def execute_and_set(module: ModuleType) -> None:
                execute(module)
                _make(module)

            found.loader.exec_module = execute_and_set  # type: ignore[method-assign]
        return found


def _make(jax: ModuleType) -> None:
    jax.config.update("jax_enable_x64", True)
    # Programs dispatched asynchronously compete for jax's threads with the Fourier transforms inside them, and all run
    # slower.
    jax.config.update("jax_cpu_enable_async_dispatch", False)
    from jaxcontact._compile import installed_jax

    installed_jax.silence_the_compiler()
    installed_jax.warn_of_a_known_fault()
