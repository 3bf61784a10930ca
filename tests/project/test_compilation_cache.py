"""Compiled programs on disk: nothing is compiled twice, and no number depends on them."""

import os
import subprocess
import sys
import zlib

import pytest

from jaxcontact._compile import compilation_cache
from jaxcontact._compile.compilation_cache import remove_incomplete

RUN = """
import sys, numpy as np
import jaxcontact as jc, jax
compiled = []
jax.monitoring.register_event_listener(lambda name, **_: compiled.append(name.endswith("/cache_misses")))
if sys.argv[1:]:
    jc.enable_compilation_cache(sys.argv[1])
rubber = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=1e6, nu=0.4))
history = jc.indent(rubber, jc.Sphere(1e-3), jc.Load(1e-3), [0.0], grid=jc.Grid.square(n=32, width=3e-4))
print(sum(compiled), float(history.approach[0]).hex(), np.asarray(history.pressure).tobytes().hex())
"""


def packed(content):
    """As jax packs a program: with zstandard where it is installed."""
    try:
        import zstandard
    except ImportError:
        return zlib.compress(content)
    return zstandard.ZstdCompressor().compress(content)


def start(*arguments, code=RUN, **environment):
    kept = {name: value for name, value in os.environ.items() if not name.startswith("JAX_")}
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.Popen(
        command, env=kept | environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )


def told(process):
    out, err = process.communicate(timeout=300)
    assert (process.returncode, err) == (0, "")
    compiled, *numbers = out.split()
    return int(compiled), numbers


@pytest.mark.slow
def test_the_second_process_compiles_nothing_and_all_find_the_same_numbers(tmp_path):
    """Two at once into an empty folder, one after them, and one without a cache."""
    at_once = [start(tmp_path), start(tmp_path)]
    first, second = map(told, at_once)
    without = told(start())
    third = told(start(tmp_path))
    assert third[0] == 0 < max(first[0], second[0])
    assert first[1] == second[1] == third[1] == without[1]


@pytest.mark.slow
@pytest.mark.parametrize("package", ["jaxcontact", "fitting"])
def test_jax_is_told_before_it_is_imported_to_be_silent_about_the_store(package):
    watch = "print(name, os.environ.get('TF_CPP_MIN_LOG_LEVEL')) if name == 'jax' else None"
    code = (
        "import os, sys; os.environ.pop('TF_CPP_MIN_LOG_LEVEL', None)\n"
        f"find = staticmethod(lambda name, *more: {watch})\n"
        f"sys.meta_path.insert(0, type('Watch', (), {{'find_spec': find}})); import {package}, jax"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("jax 3\n", "")


JAX_FIRST = """
import logging, sys
import jax
{setting}
import jaxcontact
jaxcontact.enable_compilation_cache(sys.argv[1])
print(jax.jit(lambda x: jax.numpy.sin(x) + 1.0)(1.0), logging.getLogger("jax").level)
"""


@pytest.mark.long
def test_a_program_from_the_store_is_taken_in_silence_where_jax_is_imported_first(tmp_path):
    """XLA writes to the file descriptor, so that only another process can be heard. The first run stores, the next take."""
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith(("JAX_", "TF_CPP"))
    }
    told = []
    for setting in ("", "", "logging.getLogger('jax').setLevel(30)"):
        command = [sys.executable, "-c", JAX_FIRST.format(setting=setting), str(tmp_path)]
        told.append(subprocess.run(command, env=environment, capture_output=True, text=True))
    assert [done.stderr for done in told] == ["", "", ""]
    assert len({done.stdout.split()[0] for done in told}) == 1 and list(tmp_path.glob("*/*-cache"))
    assert [done.stdout.split()[1] for done in told] == ["0", "0", "30"]


CUT = """
import sys
import jaxcontact as jc, jax
compiled = []
jax.monitoring.register_event_listener(lambda name, **_: compiled.append(name.endswith("/cache_misses")))
jc.enable_compilation_cache(*sys.argv[1:])
value = jax.jit(lambda x: jax.numpy.sin(x) + 1.0)(1.0)
print(sum(compiled), float(value).hex())
"""


@pytest.mark.long
@pytest.mark.parametrize("chosen", [False, True], ids=["ours", "JAX_COMPILATION_CACHE_DIR"])
def test_a_store_of_programs_that_were_cut_off_heals(tmp_path, chosen):
    """The run after compiles them once more, in silence, and the one after that nothing."""
    kept = {"JAX_COMPILATION_CACHE_DIR": str(tmp_path), "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0"}
    run = lambda: told(start(code=CUT, **kept) if chosen else start(tmp_path, code=CUT))
    count, result = run()
    assert count > 0 and run() == (0, result)
    for entry in tmp_path.rglob("*-cache"):
        entry.write_bytes(entry.read_bytes()[: entry.stat().st_size // 2])
    assert run() == (count, result) and run() == (0, result)


def test_each_program_is_unpacked_once_and_again_where_it_has_changed(tmp_path, monkeypatch):
    whole, unpacked = packed(b"a program" * 100), []
    for name, content in (("a", whole), ("b", whole), ("cut", whole[:-5]), ("empty", b"")):
        (tmp_path / f"{name}-cache").write_bytes(content)
        (tmp_path / f"{name}-atime").write_bytes(b"")
    monkeypatch.setattr(
        compilation_cache,
        "_is_complete",
        lambda path, plain=compilation_cache._is_complete: unpacked.append(path.name) or plain(path),
    )
    for _ in range(2):
        compilation_cache.remove_unreadable(tmp_path)
        assert {path.name[0] for path in tmp_path.glob("*-*")} == {"a", "b"}
    assert sorted(unpacked) == ["a-cache", "b-cache", "cut-cache", "empty-cache"]
    (tmp_path / "b-cache").write_bytes(whole[:-3])
    compilation_cache.remove_unreadable(tmp_path)
    assert unpacked[4:] == ["b-cache"] and not (tmp_path / "b-atime").exists()
    (tmp_path / compilation_cache.CHECKED).write_text("[1")
    compilation_cache.remove_unreadable(tmp_path)
    assert unpacked[5:] == ["a-cache"]


def test_half_an_entry_is_removed(tmp_path):
    """jax stores the time of the last use after the program; without it no entry could ever be stored again."""
    for name in ("whole-cache", "whole-atime", "half-cache"):
        (tmp_path / name).write_bytes(b"")
    remove_incomplete(tmp_path)
    assert sorted(path.name for path in tmp_path.glob("*-*")) == ["whole-atime", "whole-cache"]


@pytest.mark.slow
@pytest.mark.parametrize("home", [pytest.param("", marks=pytest.mark.long), "file"])
def test_the_command_line_works_where_nothing_can_be_kept(tmp_path, home):
    (tmp_path / "file").write_text("")
    arguments = ["jaxcontact", "check", "polymer_coating"]
    process = start(
        code=f"from jaxcontact.__main__ import enter; import sys; sys.argv = {arguments}; enter()",
        XDG_CACHE_HOME=str(tmp_path / home),
    )
    out, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "") and "can run" in out
    assert (tmp_path / "jaxcontact").exists() == (home == "")


@pytest.mark.slow
def test_an_address_of_a_store_elsewhere_makes_no_folder_here(tmp_path):
    code = "import jaxcontact as jc; jc.enable_compilation_cache()"
    process = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True,
        env=os.environ | {"JAX_COMPILATION_CACHE_DIR": "gs://bucket/programs"},
    )  # fmt: skip
    assert process.returncode == 0 and not list(tmp_path.iterdir())
