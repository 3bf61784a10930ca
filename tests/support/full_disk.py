"""A disk that is full for a while, by the limit on the size of files that a process may write."""

import contextlib

import jax
import pytest

resource = pytest.importorskip("resource", reason="Windows has no such limit")
KEPT_FROM = "jax_persistent_cache_min_compile_time_secs"


@contextlib.contextmanager
def limited(size):
    """No file longer than ``size`` bytes; programs are not kept meanwhile, of which the store would have parts."""
    before, kept_from = resource.getrlimit(resource.RLIMIT_FSIZE), getattr(jax.config, KEPT_FROM)
    jax.config.update(KEPT_FROM, 1e9)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        jax.config.update(KEPT_FROM, kept_from)
