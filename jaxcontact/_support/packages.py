"""The installed package that a module, a function or a class belongs to, with its version."""

import functools
import importlib.metadata
import importlib.util
import sys
from pathlib import Path
from typing import Any

OWN = ("jaxcontact", "fitting")


def home_of(value: Any) -> str | None:
    """Return the name of the module that a function or class is defined in, unaffected by wrapping."""
    scope = getattr(value, "__globals__", None)
    return scope.get("__name__") if isinstance(scope, dict) else getattr(value, "__module__", None)


@functools.cache
def package_of(module: str | None) -> tuple[str, str] | None:
    """Return (name, version) of the installed package of a module; None for a module of the user."""
    top = str(module).partition(".")[0]
    if module is None or top in ("__main__", "__mp_main__"):
        return None
    if top in OWN:
        return top, ""
    if top in sys.stdlib_module_names or top in sys.builtin_module_names:
        return "Python", "{}.{}".format(*sys.version_info)
    found = sys.modules.get(top)
    try:
        spec = getattr(found, "__spec__", None) or importlib.util.find_spec(top)
    except (ImportError, ValueError):
        return None
    places = [spec.origin or "", *(spec.submodule_search_locations or ())] if spec else []
    installed = any({"site-packages", "dist-packages"} & {*Path(place).parts} for place in places)
    return (top, _version(top)) if installed else None


def _version(top: str) -> str:
    try:
        return importlib.metadata.version(top)
    except importlib.metadata.PackageNotFoundError:
        distributions = importlib.metadata.packages_distributions().get(top, [])
        return " ".join(importlib.metadata.version(each) for each in distributions)
