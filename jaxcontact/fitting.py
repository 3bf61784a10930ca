"""The package ``fitting`` under the name ``jaxcontact.fitting``, for environments with another package ``fitting``.

Both names refer to the same module objects, submodules included: ``jaxcontact.fitting.creep is fitting.fits.creep``. No
other module of jaxcontact imports ``fitting``, a higher layer, when it is itself imported.
"""

import importlib
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

import fitting

PREFIX = "jaxcontact."


class _SameModules(MetaPathFinder, Loader):
    """An importer that finds ``jaxcontact.fitting.NAME`` as ``fitting.NAME``, which keeps its own specification."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        return ModuleSpec(name, self) if name.startswith(f"{__name__}.") else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = importlib.import_module(spec.name.removeprefix(PREFIX))
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        assert module.__spec__ is not None
        module.__spec__ = module.__spec__.loader_state


sys.meta_path.insert(0, _SameModules())
sys.modules[__name__] = fitting
