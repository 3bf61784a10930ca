"""Compiled programs: their options where they apply, and the same numbers inside what is traced."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tolerances import LAST_BITS

from jaxcontact import Elastic, Sphere
from jaxcontact._compile import programs
from jaxcontact._compile.programs import Program


def spread(ball, x, power=2):
    """A function of a module, of an object of the package and an array."""
    return {"depth": jnp.sin(x) ** power / (2.0 * ball.radius), "sum": (jnp.sum(x), None)}


def tenfold(x):
    return 10.0 * x


BALL, X = Sphere(1e-3, material=Elastic(G=1e9, nu=0.3)), jnp.linspace(0.0, 1.0, 7)


def test_a_static_argument_makes_another_program():
    program = Program(spread, ("power",))
    for power in (2, 3, 2):
        found = program(BALL, X, power=power)["depth"]
        np.testing.assert_allclose(found, spread(BALL, X, power)["depth"], rtol=LAST_BITS)


def test_transformations_go_through():
    program = Program(tenfold)
    np.testing.assert_array_equal(jax.grad(lambda x: program(x).sum())(X), 10.0 * np.ones(7))
    np.testing.assert_array_equal(jax.jit(jax.vmap(program))(X), 10.0 * X)


def test_a_fast_compiled_program_is_optimised_inside_what_is_traced(monkeypatch):
    program, expected = Program(spread), spread(BALL, X)["depth"]
    monkeypatch.setattr(programs, "compiler_options", lambda optimised=True: {"no such option": True})
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
    program = Program(spread)
    slope = jax.grad(lambda x: jnp.sum(x * program(BALL, X)["depth"]))(X)
    np.testing.assert_allclose(slope, spread(BALL, X)["depth"], rtol=LAST_BITS)


def test_an_unoptimised_program_returns_the_same(monkeypatch):
    made = lambda: Program(spread, optimised=False)
    np.testing.assert_allclose(made()(BALL, X)["depth"], spread(BALL, X)["depth"], rtol=LAST_BITS)
    monkeypatch.setattr(
        programs, "compiler_options", lambda optimised=True: {} if optimised else {"no such option": True}
    )
    with pytest.raises(jax.errors.JaxRuntimeError, match="no such option"):
        made()(BALL, X)


def test_a_program_of_known_work_is_optimised_when_its_calls_are_no_longer_brief(monkeypatch):
    known = programs.compiler_options
    options = lambda optimised=True: {"no such option": True} if optimised else known(False)
    monkeypatch.setattr(programs, "compiler_options", options)
    program = Program(spread, ("power",), work=lambda ball, x, power: 0.4 * programs.BRIEF * x.size / 7)
    for x, power in ((X, 2), (X, 3), (X[:3], 2), (X, 2), (X, 3)):
        found = program(BALL, x, power=power)["depth"]
        np.testing.assert_allclose(found, spread(BALL, x, power)["depth"], rtol=LAST_BITS)
    with pytest.raises(jax.errors.JaxRuntimeError, match="no such option"):  # the third with these shapes
        program(BALL, X, power=2)
    program(BALL, X[:3], power=2)
    with programs.optimised_at_once(), pytest.raises(jax.errors.JaxRuntimeError, match="no such option"):
        program(BALL, X[:4], power=2)


def test_a_compiler_without_the_fast_compile_options_optimises(monkeypatch):
    monkeypatch.setattr(programs, "FAST_COMPILE", {"no such option": True})
    monkeypatch.setattr(programs, "compiler_options", programs.compiler_options.__wrapped__)
    np.testing.assert_array_equal(Program(tenfold)(X), 10.0 * X)


def test_a_compiler_option_that_the_user_sets_is_kept(monkeypatch):
    monkeypatch.setenv("XLA_FLAGS", "--xla_backend_optimization_level=0")
    assert programs.compiler_options.__wrapped__() == {"xla_cpu_use_fusion_emitters": False}
