"""Traced programs on disk: no number depends on them, and no program is taken for another."""

import os
import subprocess
import sys
import types

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tolerances import LAST_BITS

from jaxcontact import Elastic, Sphere, kept_traces
from jaxcontact._pytree import pytree, static
from jaxcontact.kept_traces import Program, shapes

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
        for path in module.parent.glob("*.py"):
            os.utime(path, (0.0, 0.0))
        digests.append(kept_traces._sources.__wrapped__(frozenset({"pressed"})))
    assert len(set(digests)) == 2 and all(digests)
    module.touch()
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
    program = Program(unmet(spread), in_haste=True)
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
    [("run", "polymer_coating"), pytest.param(("fit", "creep", "creep.csv"), marks=pytest.mark.long)],
)
def test_a_command_run_twice_traces_once_and_writes_the_same_bytes(tmp_path, command):
    """And the same where nothing can be kept."""
    t = np.geomspace(0.1, 100.0, 20)
    J = 5e-6 + t / 5e6 + 1e-5 * (1.0 - np.exp(-t / 4.0)) * (1.0 + 0.01 * np.cos(9.0 * t))
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


def test_a_program_in_haste_is_optimised_inside_what_is_traced(monkeypatch):
    program, expected = Program(unmet(spread), in_haste=True), spread(BALL, X)["depth"]
    monkeypatch.setattr(kept_traces, "_haste", lambda: {"no such option": True})
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


def test_a_program_in_haste_stands_beside_what_is_differentiated():
    program = Program(unmet(spread), in_haste=True)
    slope = jax.grad(lambda x: jnp.sum(x * program(BALL, X)["depth"]))(X)
    np.testing.assert_allclose(slope, spread(BALL, X)["depth"], rtol=LAST_BITS)


def test_a_compiler_without_the_options_of_haste_optimises(monkeypatch):
    monkeypatch.setattr(kept_traces, "HASTE", {"no such option": True})
    monkeypatch.setattr(kept_traces, "_haste", kept_traces._haste.__wrapped__)
    np.testing.assert_array_equal(Program(unmet(tenfold), in_haste=True)(X), 10.0 * X)
