"""A warning where a release of jax is installed that pyproject.toml excludes (``pip --no-deps`` and conda allow it)."""

import warnings

import jaxlib

# the faults are the compiler's: jax 0.10.2 is right on jaxlib 0.10.1
FAULTS = {
    "0.10.2": "gives silently wrong numbers on a CPU (jax issue 39103)",
    "0.11.1": "hangs in large runs",
}
REMEDY = "pip install 'jax!={0}' 'jaxlib!={0}'"


def warn_of_a_known_fault() -> None:
    """Warn, in one line, where the installed jaxlib is one that must not be used."""
    version = jaxlib.__version__
    if version in FAULTS:
        warnings.warn(f"jaxlib {version} {FAULTS[version]}: {REMEDY.format(version)}", stacklevel=3)
