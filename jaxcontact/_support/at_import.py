"""What ``import jaxcontact`` does: settings of jax, and ``jaxcontact.fitting`` as a second name of ``fitting``.

The settings, on which this package relies, are made at once, or when jax is imported if it is not yet; no module of jax is
imported here, so that ``import jaxcontact`` alone takes no time. With them come checks of the installed jax: known faults of
a release, and messages of the compiler.

The second name is for environments with another package ``fitting``. Both refer to the same module objects, submodules
included: ``jaxcontact.fitting.fits is fitting.fits``. The import system finds it by an importer, so that ``fitting``, which
is built on jaxcontact, is imported only by those who ask for it.
"""

import importlib
import logging
import os
import sys
import warnings
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

PREFIX = "jaxcontact."
ALIAS = f"{PREFIX}fitting"
# the faults are in the compiler, that is in jaxlib: jax 0.10.2 is correct with jaxlib 0.10.1
FAULTS = {
    "0.10.2": "gives silently wrong numbers on a CPU (jax issue 39103)",
    "0.11.1": "hangs in large runs",
}
REMEDY = "pip install 'jax!={0}' 'jaxlib!={0}'"


def prepare() -> None:
    """Make the settings, where jax is not imported yet at the end of its import, before any other module can use it, and
    the second name."""
    if "jax" in sys.modules:
        _make(sys.modules["jax"])
    else:
        sys.meta_path.insert(0, _AtImport())
    sys.meta_path.insert(0, _SameModules())


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
    silence_the_compiler()
    # a warning of one line if the installed jaxlib has a known fault
    import jaxlib

    version = jaxlib.__version__
    if version in FAULTS:
        warnings.warn(f"jaxlib {version} {FAULTS[version]}: {REMEDY.format(version)}", stacklevel=2)


def silence_the_compiler() -> None:
    """Suppress XLA's own messages on stderr if jax was imported before jaxcontact, too late for XLA's variable.

    jax passes its logging level on to XLA. XLA keeps this level when jax's is set back to "not set", and the levels of
    Python's loggers are restored. A level chosen by the user, by jax's setting or XLA's variable, is kept.
    """
    import jax

    chosen = jax.config.jax_logging_level  # type: ignore[attr-defined]
    set_by_jax = os.environ.get("TF_CPP_MIN_LOG_LEVEL") == "1"
    if not set_by_jax or chosen not in (None, "NOTSET"):
        return
    loggers = [logging.getLogger(name) for name in ("jax", "jaxlib")]
    levels = [logger.level for logger in loggers]
    for level in ("CRITICAL", chosen):
        jax.config.update("jax_logging_level", level)
    for logger, number in zip(loggers, levels, strict=True):
        logger.setLevel(number)


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
