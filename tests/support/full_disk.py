"""A disk that is full for a while, by the limit on the size of files that a process may write."""

import contextlib
import sys

import jax
import pytest

resource = pytest.importorskip("resource", reason="Windows has no such limit")
KEPT_FROM = "jax_persistent_cache_min_compile_time_secs"


@contextlib.contextmanager
def limited(size):
    """No file longer than ``size`` bytes. No program and no bytecode of a module is kept meanwhile: a part
    of it would be, which the next process cannot read."""
    before, kept_from = resource.getrlimit(resource.RLIMIT_FSIZE), getattr(jax.config, KEPT_FROM)
    no_bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    jax.config.update(KEPT_FROM, 1e9)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        jax.config.update(KEPT_FROM, kept_from)
        sys.dont_write_bytecode = no_bytecode
