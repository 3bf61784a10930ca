"""Traced programs on disk: no number depends on them, and no program is taken for another."""

import hashlib
import json
import os
import pickle
import subprocess
import sys
import time
import types
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tolerances import LAST_BITS

import jaxcontact as jc
from jaxcontact import Elastic, Sphere
from jaxcontact._compile import kept_traces
from jaxcontact._compile.kept_traces import Program, shapes
from jaxcontact._support import sources
from jaxcontact._support.pytree import pytree, static

traced = []


def spread(ball, x, power=2):
    """A function of a module, of an object of the package and an array."""
    traced.append(power)
    return {"depth": jnp.sin(x) ** power / (2.0 * ball.radius), "sum": (jnp.sum(x), None)}


def tenfold(x):
    traced.append(10)
    return 10.0 * x


@pytree
class Profile:
    """A tree whose structure has a function in it, as a user's may."""

    values: jax.Array
    shape: object = static()


def of_profile(profile):
    traced.append("profile")
    return profile.shape(profile.values)


BALL, X = Sphere(1e-3, material=Elastic(G=1e9, nu=0.3)), jnp.linspace(0.0, 1.0, 7)


@pytest.fixture(autouse=True)
def package_of_long_ago(monkeypatch):
    """This file as a part of the package, whose sources have not changed of late."""
    for function in (spread, tenfold, of_profile):
        monkeypatch.setattr(function, "__module__", "jaxcontact.tests")
    monkeypatch.setattr(kept_traces, "_sources", lambda packages: b"sources")
    traced.clear()


def unmet(function):
    """The same function, but to jax, which remembers what it has traced."""
    copy = types.FunctionType(function.__code__, globals(), function.__name__, function.__defaults__)
    copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
    return copy


def in_a_new_process(folder, function, *args, **static):
    """What a program that has met nothing yet finds, and how often it traced."""
    traced.clear()
    program = Program(unmet(function), tuple(static))
    with kept_traces.kept_traces(folder):
        first, again = program(*args, **static), program(*args, **static)
    assert jax.tree.all(jax.tree.map(np.array_equal, first, again))
    return first, len(traced)


def equal(a, b):
    return jax.tree.structure(a) == jax.tree.structure(b) and jax.tree.all(jax.tree.map(np.array_equal, a, b))


def test_the_second_process_traces_nothing_and_finds_the_same_bits(tmp_path):
    plain = jax.jit(spread)(BALL, X)
    first, count = in_a_new_process(tmp_path, spread, BALL, X)
    assert count == 1 and equal(first, plain)
    second, count = in_a_new_process(tmp_path, spread, BALL, X)
    assert count == 0 and equal(second, plain)


@pytest.mark.parametrize(
    ("args", "static"),
    [
        ((BALL, X), {"power": 3}),
        ((BALL, X[:4]), {}),
        ((BALL, X.astype(jnp.float32)), {}),
        ((Sphere(1e-3), X), {}),
    ],
    ids=["static", "shape", "type", "structure"],
)
def test_a_program_is_another_by_all_that_it_is_traced_from(tmp_path, args, static):
    in_a_new_process(tmp_path, spread, BALL, X)
    found, count = in_a_new_process(tmp_path, spread, *args, **static)
    assert count == 1 and equal(found, jax.jit(spread, static_argnames="power")(*args, **static))


def test_other_values_are_the_same_program(tmp_path):
    in_a_new_process(tmp_path, spread, BALL, X)
    found, count = in_a_new_process(tmp_path, spread, Sphere(2e-3, BALL.material), 2.0 * X)
    assert count == 0 and equal(found, jax.jit(spread)(Sphere(2e-3, BALL.material), 2.0 * X))


@pytest.mark.parametrize("what", ["_sources", "_settings"])
def test_other_sources_or_settings_are_another_program(tmp_path, monkeypatch, what):
    in_a_new_process(tmp_path, tenfold, X)
    monkeypatch.setattr(kept_traces, what, lambda *_: b"of another version")
    assert in_a_new_process(tmp_path, tenfold, X)[1] == 1


def test_the_packages_sources_are_what_tells_its_versions_apart(tmp_path, monkeypatch):
    """A byte changed in a copy of one module changes the digest; a source changed of late is not trusted."""
    monkeypatch.undo()
    module = tmp_path / "pressed" / "module.py"
    module.parent.mkdir()
    module.write_text("A = 1\n")
    (tmp_path / "pressed" / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    __import__("pressed")
    digests = []
    for text in ("A = 1\n", "A = 2\n"):
        module.write_text(text)
        monkeypatch.setattr(
            sources, "START_TIME", time.time() + 2.0 * kept_traces.SETTLING_TIME
        )  # as if it were later
        digests.append(kept_traces._sources.__wrapped__(frozenset({"pressed"})))
    assert len(set(digests)) == 2 and all(digests)
    monkeypatch.setattr(sources, "START_TIME", time.time())
    assert kept_traces._sources.__wrapped__(frozenset({"pressed"})) == b""
    for path in module.parent.glob("*.py"):
        os.utime(path, (0.0, 0.0))  # as rsync and tar set it; the inode's time tells
    assert kept_traces._sources.__wrapped__(frozenset({"pressed"})) == b""
    monkeypatch.setattr(sources, "START_TIME", time.time() + 2.0 * kept_traces.SETTLING_TIME)
    for path in module.parent.glob("*.py"):
        path.rename(path.with_suffix(".pyc"))
    assert kept_traces._sources.__wrapped__(frozenset({"pressed"})) == b""


def test_sources_that_are_not_trusted_are_not_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(kept_traces, "_sources", lambda packages: b"")
    found, count = in_a_new_process(tmp_path, tenfold, X)
    assert count == 1 and equal(found, 10.0 * X) and not list(tmp_path.iterdir())


def test_what_a_users_function_does_is_not_told_by_its_name(tmp_path):
    """Two functions of one name, one after the other: each is traced, and nothing is kept."""
    for factor in (2.0, 3.0):

        def shape(x, factor=factor):
            return factor * x

        for function in (shape, lambda x, factor=factor: factor * x):
            found, _ = in_a_new_process(tmp_path, of_profile, Profile(X, function))
            assert equal(found, factor * X)
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="no owners of files")
def test_a_folder_or_file_that_others_may_write_into_is_not_used(tmp_path, monkeypatch):
    folder = tmp_path / "traces"
    in_a_new_process(folder, tenfold, X)
    assert folder.stat().st_mode & 0o777 == 0o700
    (file,) = folder.iterdir()
    for mode in (0o620, 0o602):
        file.chmod(mode)
        assert in_a_new_process(folder, tenfold, X)[1] == 1
    assert in_a_new_process(folder, tenfold, X)[1] == 0
    for mode in (0o770, 0o707, 0o1777):
        folder.chmod(mode)
        with pytest.raises(OSError, match=f"^{folder}: found a folder that another user"):
            in_a_new_process(folder, tenfold, X)
    folder.chmod(0o700)
    other = os.getuid() + 1
    monkeypatch.setattr(os, "getuid", lambda: other)
    with pytest.raises(OSError, match="another user owns"):
        in_a_new_process(folder, tenfold, X)


def test_the_command_line_says_once_that_it_does_not_use_such_a_folder(tmp_path):
    (tmp_path / "traces").mkdir()
    (tmp_path / "traces").chmod(0o777)
    done = subprocess.run(
        [sys.executable, "-m", "jaxcontact", "cite"], capture_output=True, text=True,
        env=os.environ | {"JAX_COMPILATION_CACHE_DIR": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 0 and "@article" in done.stdout
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"jaxcontact: warning: {tmp_path / 'traces'}: found a folder that another user")


class Opened:
    """What pickle would call on reading."""

    def __reduce__(self):
        return os.mkdir, ("opened",)


FORGED = {
    "a pickle": pickle.dumps((Opened(), b"")),
    "a function to call": b'["object", "os:mkdir", ["path", "opened"]]\n',
    "a class of elsewhere": b'["object", "pathlib:Path", ["a", 1]]\n',
    "a module of this project that has it": b'["object", "jaxcontact._compile.kept_traces:os.mkdir", ["path", "opened"]]\n',
    "not a dataclass": b'["object", "jaxcontact._compile.kept_traces:Program", ["function", 1]]\n',
    "not a tuple": b'["tuple of", "jaxcontact._compile.kept_traces:Program", 1]\n',
    "not JSON": b"{\n",
    "no kind": b"[]\n",
}


@pytest.mark.parametrize("kind", FORGED)
def test_reading_a_forged_file_executes_nothing(tmp_path, monkeypatch, kind):
    """With a right checksum: it is traced again."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "traces"
    in_a_new_process(folder, tenfold, X)
    (file,) = folder.iterdir()
    file.write_bytes(hashlib.sha256(FORGED[kind]).hexdigest().encode() + b"\n" + FORGED[kind])
    found, count = in_a_new_process(folder, tenfold, X)
    assert count == 1 and equal(found, 10.0 * X) and not (tmp_path / "opened").exists()


@pytest.mark.parametrize(
    "tree",
    [
        None, True, 3, 0.1, float("inf"), "text", (1, [2, ("a", None)]), {"a": 1, 2: (3,)}, Sphere, jc.indent,
        Sphere(0, material=Elastic(G=1, nu=2)), jc.Grid((3, 4), (5, 6), (True, False)), [(), [], {}],
    ],
    ids=lambda tree: type(tree).__name__,
)  # fmt: skip
def test_a_structure_comes_back_from_json(tree):
    again = kept_traces._restored(json.loads(json.dumps(kept_traces._description(tree))))
    assert again == tree and repr(again) == repr(tree)


def test_a_full_disk_leaves_no_part_of_a_file(tmp_path):
    from full_disk import limited

    with limited(100):
        found, _ = in_a_new_process(tmp_path / "traces", tenfold, X)
    assert equal(found, 10.0 * X) and not list((tmp_path / "traces").iterdir())


@pytest.mark.parametrize("spoil", [lambda text: text[:-20], lambda text: b"", lambda text: text + b"."])
def test_a_file_that_is_not_whole_is_traced_again(tmp_path, spoil):
    in_a_new_process(tmp_path, tenfold, X)
    (file,) = tmp_path.iterdir()
    file.write_bytes(spoil(file.read_bytes()))
    found, count = in_a_new_process(tmp_path, tenfold, X)
    assert count == 1 and equal(found, 10.0 * X)
    assert in_a_new_process(tmp_path, tenfold, X)[1] == 0


def test_transformations_go_through(tmp_path):
    program = Program(tenfold)
    with kept_traces.kept_traces(tmp_path):
        assert float(jax.grad(lambda x: jnp.sum(program(x)))(X)[0]) == 10.0
        assert equal(jax.vmap(program)(X), 10.0 * X)
        assert equal(jax.jit(program)(X), 10.0 * X)
    assert not list(tmp_path.iterdir())


def test_within_what_is_traced_nothing_is_kept_of_known_arrays_either(tmp_path):
    program = Program(unmet(spread))
    with kept_traces.kept_traces(tmp_path):
        found = jax.jit(lambda x: program(BALL, X)["depth"] + 0.0 * x)(X)
    np.testing.assert_allclose(found, spread(BALL, X)["depth"], rtol=LAST_BITS)
    assert not list(tmp_path.iterdir())


def test_shapes_are_kept_as_well(tmp_path):
    expected = jax.eval_shape(spread, BALL, X)
    for count in (1, 0):
        traced.clear()
        with kept_traces.kept_traces(tmp_path):
            assert shapes(unmet(spread), BALL, X) == expected
        assert len(traced) == count
    assert shapes(spread, BALL, X) == expected


def test_what_was_used_longest_ago_goes(tmp_path, monkeypatch):
    for name, age in (("old", 1.0), ("older", 0.0)):
        (tmp_path / name).write_bytes(b"0" * 1000)
        os.utime(tmp_path / name, (age, age))
    monkeypatch.setattr(kept_traces, "LARGEST", 6000)
    in_a_new_process(tmp_path, tenfold, X)
    names = sorted(path.name.partition("-")[0] for path in tmp_path.iterdir())
    assert names == ["old", "older", "tenfold"]
    monkeypatch.setattr(kept_traces, "LARGEST", 6000 - 1500)
    in_a_new_process(tmp_path, tenfold, X[:3])
    assert "older" not in {path.name for path in tmp_path.iterdir()}


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [("run", "case.toml"), pytest.param(("fit", "creep", "creep.csv"), marks=pytest.mark.long)],
)
def test_a_command_run_twice_traces_once_and_writes_the_same_bytes(tmp_path, command):
    """And the same where nothing can be kept."""
    t = np.geomspace(0.1, 100.0, 20)
    J = 5e-6 + t / 5e6 + 1e-5 * (1.0 - np.exp(-t / 4.0)) * (1.0 + 0.01 * np.cos(9.0 * t))
    ready = (Path(jc.__file__).parent / "cases" / "polymer_coating.toml").read_text()
    few = ready.replace("n = 128", "n = 32").replace("steps = 60", "steps = 6")
    (tmp_path / "case.toml").write_text(few)
    np.savetxt(tmp_path / "creep.csv", np.column_stack([t, J]), header="t [s], J [1/Pa]", delimiter=",")
    (tmp_path / "file").write_text("")
    written, programs = {}, {}
    for name, home in (("first", "home"), ("second", "home"), ("without", "file/home")):
        kept = {key: value for key, value in os.environ.items() if not key.startswith("JAX_")}
        done = subprocess.run(
            [sys.executable, "-m", "jaxcontact", *command, "-o", name],
            env=kept | {
                "XDG_CACHE_HOME": str(tmp_path / home), "JAX_LOG_COMPILES": "1", "MPLBACKEND": "Agg",
                "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
            },
            capture_output=True, text=True, cwd=tmp_path, check=True,
        )  # fmt: skip
        programs[name] = [
            line for line in done.stderr.splitlines() if "Finished tracing" in line and "of_leaves" in line
        ]
        written[name] = {
            path.name: path.read_bytes()
            for path in (tmp_path / name).iterdir()
            if path.suffix in (".npz", ".csv")
        }
    assert programs["first"] and not programs["second"]
    assert written["first"] == written["second"] == written["without"] and written["first"]


def test_a_fast_compiled_program_is_optimised_inside_what_is_traced(monkeypatch):
    program, expected = Program(unmet(spread)), spread(BALL, X)["depth"]
    monkeypatch.setattr(kept_traces, "fast_compile_options", lambda: {"no such option": True})
    with pytest.raises(jax.errors.JaxRuntimeError, match="no such option"):
        program(BALL, X)
    within = (
        jax.jit(lambda x: program(BALL, x)["depth"])(X),
        jax.jit(lambda x: program(BALL, X)["depth"] + 0.0 * x)(X),
        jax.vmap(lambda x: program(BALL, x)["depth"])(X),
        jax.jvp(lambda x: program(BALL, x)["depth"], (X,), (X,))[0],
        jax.lax.map(lambda x: program(BALL, X)["depth"] + 0.0 * x, X[:1])[0],
    )
    for found in within:
        np.testing.assert_allclose(found, expected, rtol=LAST_BITS)


def test_a_fast_compiled_program_stands_beside_what_is_differentiated():
    program = Program(unmet(spread))
    slope = jax.grad(lambda x: jnp.sum(x * program(BALL, X)["depth"]))(X)
    np.testing.assert_allclose(slope, spread(BALL, X)["depth"], rtol=LAST_BITS)


def test_an_unoptimised_program_returns_the_same(monkeypatch):
    made = lambda: Program(unmet(spread), optimised=False)
    np.testing.assert_allclose(made()(BALL, X)["depth"], spread(BALL, X)["depth"], rtol=LAST_BITS)
    monkeypatch.setattr(kept_traces, "unoptimised_options", lambda: {"no such option": True})
    with pytest.raises(jax.errors.JaxRuntimeError, match="no such option"):
        made()(BALL, X)


def test_a_compiler_without_thefast_compile_options_optimises(monkeypatch):
    monkeypatch.setattr(kept_traces, "FAST_COMPILE", {"no such option": True})
    monkeypatch.setattr(kept_traces, "fast_compile_options", kept_traces.fast_compile_options.__wrapped__)
    np.testing.assert_array_equal(Program(unmet(tenfold))(X), 10.0 * X)


def test_a_compiler_option_that_the_user_sets_is_kept(monkeypatch):
    monkeypatch.setenv("XLA_FLAGS", "--xla_backend_optimization_level=0")
    assert kept_traces.fast_compile_options.__wrapped__() == {"xla_cpu_use_fusion_emitters": False}
