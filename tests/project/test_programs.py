"""Compiled programs: their options where they apply, and the same numbers inside what is traced."""

import functools
import gc

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tolerances import LAST_BITS, ROUND_OFF

from jaxcontact import Elastic, Sphere
from jaxcontact._compile import programs
from jaxcontact._compile.programs import Program
from jaxcontact._compile.transformed import Linear
from jaxcontact._support.pytree import pytree, static


def spread(ball, x, power=2):
    """A function of a module, of an object of the package and an array."""
    return {"depth": jnp.sin(x) ** power / (2.0 * ball.radius), "sum": (jnp.sum(x), None)}


def tenfold(x):
    return 10.0 * x


FEW = 1e-14  # closed forms of a few operations, which are computed in another order

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


def test_a_program_has_its_options_except_inside_what_is_recorded(monkeypatch):
    program, expected = Program(spread), spread(BALL, X)["depth"]
    monkeypatch.setattr(programs, "compiler_options", lambda optimised=True: {"no such option": True})
    depth = lambda x: program(BALL, x)["depth"]
    at_once = (
        lambda: depth(X),
        lambda: jax.vmap(depth)(X),
        lambda: jax.jvp(depth, (X,), (X,)),
        lambda: jax.vjp(depth, X),
        lambda: jax.linearize(depth, X),
    )
    for call in at_once:
        with pytest.raises(jax.errors.JaxRuntimeError, match="no such option"):
            call()
    recorded = (
        jax.jit(depth)(X),
        jax.jit(lambda x: depth(X) + 0.0 * x)(X),
        jax.lax.map(lambda x: depth(X) + 0.0 * x, X[:1])[0],
    )
    for found in recorded:
        np.testing.assert_allclose(found, expected, rtol=LAST_BITS)


def recurred(scale, x, count, power=2):
    """A function of a number, an array and an integer, whose results are coupled, constant, whole and logical."""
    last, path = jax.lax.scan(lambda c, u: (c * jnp.sin(u) + scale["r"], c**2), x[0], x)
    return {
        "power": jnp.sin(x) ** power / scale["r"],
        "path": (last, None, path),
        "count": count + 1,
        "ones": jnp.ones(3),
        "positive": x > 0.0,
    }


def number_of(function):
    """A number of two arguments, of the results of a function as ``recurred``."""

    def of(scale, x):
        found = function(scale, x, 3, power=3)
        last, _, path = found["path"]
        return jnp.sum(found["power"]) * last + jnp.sum(path) + jnp.sum(found["ones"]) + found["count"]

    return of


SCALE, TWO = {"r": 2.0}, jnp.stack([X + 0.1, 2.0 * X + 0.1])
ALONG = {"r": 1.0}, jnp.ones(7)
TRANSFORMED = {
    "grad": lambda f: jax.grad(f, (0, 1))(SCALE, X),
    "jvp": lambda f: jax.jvp(f, (SCALE, X), ALONG),
    "jacfwd": lambda f: jax.jacfwd(f, (0, 1))(SCALE, X),
    "jacrev": lambda f: jax.jacrev(lambda x: jnp.stack([f(SCALE, x), f(SCALE, 2.0 * x)]))(X),
    "linearize": lambda f: jax.linearize(f, SCALE, X)[1](*ALONG),
    "vmap": lambda f: jax.vmap(f, (None, 0))(SCALE, TWO),
    "vmap of grad": lambda f: jax.vmap(jax.grad(f, (0, 1)), (None, 0))(SCALE, TWO),
    "grad of vmap": lambda f: jax.grad(lambda x: jnp.sum(jax.vmap(f, (None, 0))(SCALE, x)))(TWO),
    "vmap of linearize": lambda f: jax.vmap(jax.linearize(lambda x: f(SCALE, x), X)[1])(jnp.eye(7)),
    "hessian": lambda f: jax.hessian(f, (0, 1))(SCALE, X),
    "grad of grad": lambda f: jax.grad(lambda x: jnp.sum(jax.grad(f, 1)(SCALE, x) ** 2))(X),
    "jacfwd of jacfwd": lambda f: jax.jacfwd(jax.jacfwd(f, 1), 1)(SCALE, X),
    "jacrev of jacfwd": lambda f: jax.jacrev(jax.jacfwd(f, 1), 1)(SCALE, X),
    "jit of grad": lambda f: jax.jit(jax.grad(f, (0, 1)))(SCALE, X),
    "jit of vjp": lambda f: jax.jit(jax.vjp(f, SCALE, X)[1])(1.0),
    "jit of linearize": lambda f: jax.jit(jax.linearize(f, SCALE, X)[1])(*ALONG),
    "map of vjp": lambda f: jax.lax.map(jax.vjp(f, SCALE, X)[1], jnp.arange(3.0)),
    "transposed linearize": lambda f: jax.linear_transpose(jax.linearize(lambda x: f(SCALE, x), X)[1], X)(
        1.0
    ),
    "checkpoint": lambda f: jax.grad(jax.checkpoint(f), 1)(SCALE, X),
}


@pytest.mark.parametrize("name", TRANSFORMED)
def test_every_transformation_gives_what_it_gives_of_the_function(name):
    expected = TRANSFORMED[name](number_of(recurred))
    program = number_of(Program(recurred, ("power",), work=lambda *_, power: 1.0))
    for _ in range(2):
        jax.tree.map(
            lambda a, b: np.testing.assert_allclose(a, b, rtol=ROUND_OFF, atol=ROUND_OFF),
            TRANSFORMED[name](program),
            expected,
        )


def test_derivatives_of_a_program_are_compiled_once():
    program = Program(recurred, ("power",), work=lambda *_, power: 1.0)
    slope = jax.grad(number_of(program), (0, 1))
    slope(SCALE, X)
    compiled = []
    jax.monitoring.register_event_duration_secs_listener(
        lambda event, *_, **__: compiled.append(event) if event == programs.COMPILATION else None
    )
    slope(SCALE, X)
    assert not compiled


def test_derivatives_of_a_program_are_released_with_the_caches_of_jax():
    program = Program(recurred, ("power",), work=lambda *_, power: 1.0)

    def linear_functions():
        jax.clear_caches()
        gc.collect()
        return sum(isinstance(each, Linear) for each in gc.get_objects())

    before = linear_functions()
    for _ in range(2):
        jax.grad(number_of(program), (0, 1))(SCALE, X)
        jax.hessian(number_of(program))(SCALE, X)
        assert linear_functions() == before


def test_constants_within_jit_may_be_computed_at_once():
    inner = Program(lambda x: jnp.sin(x) * 2.0)
    program = Program(lambda x: inner(x) + inner(jnp.ones(7)))
    value = lambda x: jnp.sum(program(x))

    @jax.jit
    def of(x):
        with jax.ensure_compile_time_eval():
            return jax.grad(value)(X), value(X), value(x), jax.grad(value)(x), jax.vmap(value)(x[None])

    expected = 2.0 * np.cos(X), value(X), value(X), 2.0 * np.cos(X), value(X)[None]
    for found, wanted in zip(of(X), expected, strict=True):
        np.testing.assert_allclose(found, wanted, rtol=FEW)


@pytree
class Kept:
    """A number and a function of it."""

    x: jax.Array
    save: object = static()


class Times:
    """An object that is called, which keeps what is transformed."""

    def __init__(self, y):
        self.y = y

    def __call__(self, z):
        return self.y * z

    def of(self, z):
        return self.y * z


@pytest.mark.parametrize("save", [Times, lambda y: Times(y).of])
def test_an_object_in_the_arguments_may_keep_what_is_transformed(save):
    program = Program(lambda kept: jnp.sin(kept.x) * kept.save(kept.x))
    slopes = jax.grad(lambda x, y: program(Kept(x, save(y))), (0, 1))(0.7, 3.0)
    sine, cosine = np.sin(0.7), np.cos(0.7)
    np.testing.assert_allclose(slopes, (3.0 * (0.7 * cosine + sine), 0.7 * sine), rtol=FEW)


def test_a_function_in_the_arguments_may_use_what_is_transformed():
    program = Program(lambda kept: jnp.sin(kept.x) * kept.save(kept.x))

    def of(x, y):
        def scaled(z, times=1):
            return y * z if times == 1 else scaled(z)

        return program(Kept(x, functools.partial(lambda scale, z: x * scale(z, 2), scaled)))  # sin(x) x^2 y

    sine, cosine = np.sin(0.7), np.cos(0.7)
    by_x, by_y = 3.0 * (0.49 * cosine + 1.4 * sine), 0.49 * sine
    np.testing.assert_allclose(jax.grad(of, (0, 1))(0.7, 3.0), (by_x, by_y), rtol=FEW)
    np.testing.assert_allclose(jax.jacfwd(of, (0, 1))(0.7, 3.0), (by_x, by_y), rtol=FEW)
    np.testing.assert_allclose(jax.vmap(jax.grad(of), (None, 0))(0.7, X[:2] + 3.0)[0], by_x, rtol=FEW)
    by_both = jax.grad(lambda y: jax.grad(of)(0.7, y))(3.0)
    np.testing.assert_allclose(by_both, by_x / 3.0, rtol=FEW)


def test_the_work_of_a_batch_and_of_other_shapes_is_counted(monkeypatch):
    known = programs.compiler_options
    options = lambda optimised=True: {"no such option": True} if optimised else known(False)
    monkeypatch.setattr(programs, "compiler_options", options)
    program = Program(recurred, ("power",), work=lambda scale, x, *_, power: 0.01 * programs.BRIEF * x.size)
    of = lambda x: number_of(program)(SCALE, x)
    batch = lambda count: jnp.ones((count, 7)) * X
    # A call has 0.07 of the work that is brief, and a derivative a quarter of it.
    (
        jax.vmap(of)(batch(3)),
        jax.grad(of)(X),
        jax.vmap(jax.grad(of))(batch(5)),
        jax.jacrev(lambda x: of(x) * x)(X),
    )
    for dear in (
        lambda: jax.vmap(of)(batch(20)),
        lambda: jax.vmap(jax.grad(of))(batch(80)),
        lambda: jax.grad(of)(jnp.ones(500)),
        lambda: jax.vmap(jax.vjp(of, X)[1])(jnp.ones(80)),
    ):
        with pytest.raises(jax.errors.JaxRuntimeError, match="no such option"):
            dear()


def test_collection_is_paused_while_a_program_is_compiled():
    seen = []
    program = Program(lambda x: seen.append(gc.isenabled()) or jnp.sin(x))
    program(X), jax.grad(lambda x: jnp.sum(program(x)))(X)
    assert seen and not any(seen) and gc.isenabled()
    fails = Program(lambda x: jnp.reshape(x, (2, 2)))
    with pytest.raises(TypeError):
        fails(X)
    assert gc.isenabled()
    gc.disable()
    try:
        program(X[:3])
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_cotangents_that_are_zero_are_not_computed(monkeypatch):
    given, transposed = [], Linear.transposed
    noted = lambda self, which, *shapes: given.append(which) or transposed(self, which, *shapes)
    monkeypatch.setattr(Linear, "transposed", noted)
    first = Program(lambda x: {"sine": jnp.sin(x), "cosine": jnp.cos(x)})
    second = Program(lambda tree: {name: 2.0 * each for name, each in tree.items()})
    slope = jax.grad(lambda x: jnp.sum(second(first(x))["sine"]))(X)
    np.testing.assert_allclose(slope, 2.0 * np.cos(X), rtol=LAST_BITS)
    assert given == [(False, True), (False, True)]  # cosine and sine


def test_results_that_do_not_depend_on_what_moves_have_no_derivative_to_compile():
    program = Program(recurred, ("power",))
    out, pull = jax.vjp(lambda x: program(SCALE, x, 3, power=2)["ones"], X)
    np.testing.assert_array_equal(out, np.ones(3))
    np.testing.assert_array_equal(pull(jnp.ones(3))[0], np.zeros(7))


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
    for cached in ("_known_options", "compiler_options"):
        monkeypatch.setattr(programs, cached, getattr(programs, cached).__wrapped__)
    np.testing.assert_array_equal(Program(tenfold)(X), 10.0 * X)


def test_a_compiler_option_that_the_user_sets_is_kept(monkeypatch):
    monkeypatch.setenv(
        "XLA_FLAGS", "--xla_backend_optimization_level=0 --xla_cpu_parallel_codegen_split_count=4"
    )
    left = {"xla_cpu_use_fusion_emitters", "xla_disable_hlo_passes"}
    assert set(programs.compiler_options.__wrapped__()) == left
