"""Checks of the installed jax when jaxcontact is imported: known faults of a release, and messages of the compiler."""

import logging
import os
import warnings

import jax
import jaxlib

# the faults are in the compiler, that is in jaxlib: jax 0.10.2 is correct with jaxlib 0.10.1
FAULTS = {
    "0.10.2": "gives silently wrong numbers on a CPU (jax issue 39103)",
    "0.11.1": "hangs in large runs",
}
REMEDY = "pip install 'jax!={0}' 'jaxlib!={0}'"


def warn_of_a_known_fault() -> None:
    """Issue a warning of one line if the installed jaxlib has a known fault."""
    version = jaxlib.__version__
    if version in FAULTS:
        warnings.warn(f"jaxlib {version} {FAULTS[version]}: {REMEDY.format(version)}", stacklevel=3)


def silence_the_compiler() -> None:
    """Suppress XLA's own messages on stderr if jax was imported before jaxcontact, too late for XLA's variable.

    jax passes its logging level on to XLA. XLA keeps this level when jax's is set back to "not set", and the levels of
    Python's loggers are restored. A level chosen by the user, by jax's setting or XLA's variable, is kept.
    """
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
