"""Requirements on the installed jax when jaxcontact is imported: a release without known faults, and silence."""

import logging
import os
import warnings

import jax
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


def silence_the_compiler() -> None:
    """Keep XLA's own messages off stderr where jax was imported before jaxcontact, too late for its variable.

    jax hands its logging level on to XLA. XLA keeps the level when jax's is put back to "not set", and the loggers of
    Python are as they were. Whoever has chosen a level, by jax's setting or XLA's variable, keeps it.
    """
    chosen = jax.config.jax_logging_level  # type: ignore[attr-defined]
    if os.environ.get("TF_CPP_MIN_LOG_LEVEL") != "1" or chosen not in (
        None,
        "NOTSET",
    ):  # 1 is what jax sets itself
        return
    loggers = [logging.getLogger(name) for name in ("jax", "jaxlib")]
    levels = [logger.level for logger in loggers]
    for level in ("CRITICAL", chosen):
        jax.config.update("jax_logging_level", level)
    for logger, number in zip(loggers, levels, strict=True):
        logger.setLevel(number)
