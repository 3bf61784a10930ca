"""A process that solves many problems of different shapes lives: compiled programs are released before Linux's limit of
memory maps."""

import subprocess
import sys
import textwrap
import threading
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact._compile import programs

LIMIT = Path("/proc/sys/vm/max_map_count")
pytestmark = pytest.mark.skipif(not LIMIT.exists(), reason="this system has no limit of memory maps")
BODY, BALL = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25)), jc.Sphere(radius=5e-3)


def maps():
    return len(Path("/proc/self/maps").read_text().splitlines())


@pytest.fixture
def watch(monkeypatch):
    """The watch of this process, which counts after every compilation and whose limit a test may lower.

    Tests that ran before in this process may have made it release programs: its count begins at zero.
    """
    found = programs.watch_memory_maps()
    for name in ("limit", "allowed", "compiling", "counting"):
        monkeypatch.setattr(found, name, getattr(found, name))
    monkeypatch.setattr(found, "releases", 0)
    monkeypatch.setattr(programs, "COUNTING", np.inf)
    return found


def pressed():
    """The pressure and the derivative of the approach by the load of a small contact."""
    grid = jc.Grid.square(n=18, width=3.6e-4)
    approach = lambda load: jc.indent(BODY, BALL, jc.Load(load), [0.0], grid=grid).approach[0]
    pressure = jc.indent(BODY, BALL, jc.Load(20.0), [0.0], grid=grid).pressure
    return np.asarray(pressure), float(jax.grad(approach)(20.0))


@pytest.mark.slow
def test_programs_are_released_before_half_of_the_limit_and_give_the_same_results(watch):
    jax.clear_caches()  # the programs of tests that ran before
    without = maps()
    expected, before = pressed(), maps()
    watch.limit = 2 * before - 100
    watch.allowed = watch.limit / 2
    jax.jit(lambda x: jnp.sin(x) + 1.0)(2.0)  # a compilation of no package
    assert watch.releases == 1 and maps() < without + 0.2 * (before - without)
    again = pressed()
    np.testing.assert_array_equal(again[0], expected[0])
    assert again[1] == expected[1]


def test_maps_that_no_release_gives_back_do_not_clear_the_caches_at_every_compilation(watch):
    watch.limit, watch.allowed = int(1.2 * maps()), 0.0
    for k in range(1, 9):
        jax.jit(lambda x, k=k: jnp.cos(x * k))(1.0)
    assert watch.releases == 1


@pytest.mark.slow
def test_a_release_within_a_trace_and_in_threads_leaves_results_unchanged(watch):
    """Everything compiled clears the caches, constants within a trace included, while four threads differentiate."""

    def function(x, n):
        with jax.ensure_compile_time_eval():
            constant = jnp.linspace(0.0, 1.0, n).sum()
        return jnp.sum(jnp.sin(x) * constant)

    sizes, found, failed = range(3, 15), {}, []

    def work(n):
        try:
            for _ in range(3):
                watch.allowed = 0.0
                found[n] = np.asarray(jax.jit(jax.grad(lambda x: function(x, n)))(jnp.arange(n, dtype=float)))
        except BaseException as error:  # reported below, in the thread of the test
            failed.append(error)

    watch.limit = 0  # so that every count is beyond it
    for group in range(0, len(sizes), 4):
        threads = [threading.Thread(target=work, args=(n,)) for n in sizes[group : group + 4]]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert not failed and watch.releases > 20
    for n in sizes:
        np.testing.assert_allclose(found[n], np.cos(np.arange(n)) * n / 2, rtol=1e-14)


@pytest.mark.long
def test_a_process_that_solves_300_problems_of_different_shapes_lives():
    """It would need 130,000 maps, twice the limit; results of the first shape are the same before and after."""
    script = """
        import numpy as np
        import jaxcontact as jc
        from jaxcontact._compile import programs
        film = jc.Layer(jc.StandardLinearSolid(G1=1e9, G2=1e8, eta2=1e9, nu=0.4), 3e-5)
        body = jc.LayeredHalfSpace([film], substrate=jc.Elastic(G=2e10, nu=0.3))
        def solved(nx, ny, nt):
            grid = jc.Grid((nx, ny), (3e-5, 3e-5))
            run = jc.indent(body, jc.Sphere(radius=5e-3), jc.Load(np.full(nt, 1.0)), np.arange(nt), grid=grid)
            assert np.all(np.asarray(run.status) == 0), run.status
            return np.asarray(run.approach)
        first, most = solved(12, 12, 2), 0
        shapes = [(nx, ny, 2) for nx in range(12, 30) for ny in range(12, 29)]
        for shape in shapes[:300]:
            solved(*shape)
            most = max(most, len(open("/proc/self/maps").readlines()))
        assert np.array_equal(solved(12, 12, 2), first)
        print(len(shapes[:300]), most, programs.watch_memory_maps().releases)
    """
    ran = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", textwrap.dedent(script)], capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr[-2000:]
    solved, most, releases = map(int, ran.stdout.split())
    assert solved == 300 and most < 0.55 * int(LIMIT.read_text()) and releases >= 2
