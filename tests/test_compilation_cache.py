"""Compiled programs on disk: nothing is compiled twice, and no number depends on them."""

import os
import subprocess
import sys

import pytest

from jaxcontact.compilation_cache import mend

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


@pytest.mark.parametrize("package", ["jaxcontact", "fitting"])
def test_jax_is_told_before_it_is_imported_to_be_silent_about_the_store(package):
    watch = "print(name, os.environ.get('TF_CPP_MIN_LOG_LEVEL')) if name == 'jax' else None"
    code = (
        "import os, sys; os.environ.pop('TF_CPP_MIN_LOG_LEVEL', None)\n"
        f"find = staticmethod(lambda name, *more: {watch})\n"
        f"sys.meta_path.insert(0, type('Watch', (), {{'find_spec': find}})); import {package}"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("jax 3\n", "")


def test_half_an_entry_is_removed(tmp_path):
    """jax stores the time of the last use after the program; without it no entry could ever be stored again."""
    for name in ("whole-cache", "whole-atime", "half-cache"):
        (tmp_path / name).write_bytes(b"")
    mend(tmp_path)
    assert sorted(path.name for path in tmp_path.glob("*-*")) == ["whole-atime", "whole-cache"]


@pytest.mark.parametrize("home", ["", "file"])
def test_the_command_line_works_where_nothing_can_be_kept(tmp_path, home):
    (tmp_path / "file").write_text("")
    process = start(
        code="from jaxcontact.__main__ import enter; import sys; sys.argv = ['jaxcontact', 'cite']; enter()",
        XDG_CACHE_HOME=str(tmp_path / home),
    )
    out, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "") and "@article" in out
    assert (tmp_path / "jaxcontact").exists() == (home == "")
