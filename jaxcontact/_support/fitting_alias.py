"""The package ``fitting`` under the name ``jaxcontact.fitting``, for environments with another package ``fitting``.

Both names refer to the same module objects, submodules included: ``jaxcontact.fitting.creep is fitting.fits.creep``. The
import system finds the second name by an importer, so that ``fitting``, which is built on jaxcontact, is imported only by
those who ask for it.
"""

import importlib
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

PREFIX = "jaxcontact."
ALIAS = f"{PREFIX}fitting"


class _SameModules(MetaPathFinder, Loader):
    """An importer that finds ``jaxcontact.fitting`` and ``jaxcontact.fitting.NAME`` as ``fitting`` and ``fitting.NAME``,
    which keep their own specifications."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        return ModuleSpec(name, self) if name == ALIAS or name.startswith(f"{ALIAS}.") else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = importlib.import_module(spec.name.removeprefix(PREFIX))
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        assert module.__spec__ is not None
        module.__spec__ = module.__spec__.loader_state


def install() -> None:
    """Make ``import jaxcontact.fitting`` work."""
    sys.meta_path.insert(0, _SameModules())
