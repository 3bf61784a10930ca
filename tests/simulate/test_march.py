"""The march in time: its own work with a stepper that has closed forms, and what it brings to ``shear``."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact._support.pytree import pytree
from jaxcontact.history.time_loop import (
    Outcome,
    Stepper,
    Steps,
    before_rows,
    first_carry,
    in_blocks,
    march,
    march_from_rest,
)

FAILS = 13.0  # an input with which a step of the toy fails


@pytree
class Decay(Stepper):
    """A body that forgets: x' = rate x + input; every inner step slips by its input."""

    summed = ("slip",)

    rate: jax.Array

    def start(self):
        return jnp.zeros(())

    def advance(self, x, step):
        x = self.rate * x + step.more
        status = jnp.where(step.more == FAILS, int(jc.Status.AT_EDGE), int(jc.Status.FINE))
        return x, Outcome(
            {"slip": step.more * jnp.ones((2, 2)), "pressure": x * jnp.ones((2, 2))}, {"status": status}
        )


def steps_of(values):
    return Steps(jnp.ones(values.shape), jnp.ones(values.shape), jnp.asarray(values))


def brute_force(rate, values):
    """x and the sum of the inputs at the end of each row."""
    x, found = 0.0, []
    for row in values:
        for value in row:
            x = rate * x + value
        found.append((x, row.sum()))
    return np.array(found).T


@pytest.mark.parametrize("checkpoint", ["pressures", "blocks"])
@pytest.mark.parametrize(("nt", "substeps"), [(1, 3), (4, 1), (7, 2)])
def test_rows_sums_and_derivatives_against_a_loop(nt, substeps, checkpoint):
    """Also where rows fill up a block; the derivative by the rate is that of sum rate^(m - 1 - k) input_k."""
    values = np.random.default_rng(nt).uniform(0.5, 2.0, (nt, substeps))
    keep = lambda outcome: outcome
    state, outcomes = march_from_rest(Decay(jnp.asarray(0.8)), steps_of(values), keep, checkpoint)
    x, sums = brute_force(0.8, values)
    np.testing.assert_allclose(outcomes.fields["pressure"][:, 0, 1], x, rtol=1e-14)
    np.testing.assert_allclose(outcomes.fields["slip"][:, 1, 0], sums, rtol=1e-14)
    np.testing.assert_array_equal(state.carry.own, outcomes.fields["pressure"][-1, 0, 0])
    np.testing.assert_array_equal(state.last.fields["slip"], outcomes.fields["slip"][-1])

    root = lambda o: o._replace(fields={}, saved=jnp.sqrt(o.fields["pressure"][0, 0]))  # no slope at rest
    last = lambda rate: march_from_rest(Decay(rate), steps_of(values), root, checkpoint)[1].saved[-1] ** 2
    k = np.arange(values.size)[::-1]
    slope = np.sum(k * 0.8 ** np.maximum(k - 1, 0) * values.ravel())
    for derivative in (jax.grad(last), jax.jacfwd(last)):
        np.testing.assert_allclose(derivative(0.8), slope, rtol=1e-13)


def test_a_march_goes_on_from_its_carry_with_the_same_numbers():
    """In blocks of three rows, the carry through the host; a failure in the second row is known in all later ones."""
    values = np.random.default_rng(0).uniform(0.5, 2.0, (7, 2))
    values[1, 0] = FAILS
    stepper, keep = Decay(jnp.asarray(0.8)), lambda outcome: outcome
    whole = march_from_rest(stepper, steps_of(values), keep)[1]
    carry, blocks, found = first_carry(stepper), in_blocks(steps_of(values), 3), []
    for index in range(3):
        rows = jax.tree.map(lambda a, i=index: a[i], blocks)
        state, outcomes = march(stepper, before_rows(stepper, jax.device_get(carry), rows.steps), rows, keep)
        carry = state.carry
        found.append(jax.tree.map(lambda a, r=rows: a[np.asarray(r.exists)], outcomes))
    found = jax.tree.map(lambda *parts: np.concatenate(parts), *found)
    jax.tree.map(np.testing.assert_array_equal, found, whole)
    edge, inherited = int(jc.Status.AT_EDGE), int(jc.Status.INHERITED)
    assert whole.numbers["status"].tolist() == [0, edge, *5 * [inherited]]


BODY = jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=1e9, G2=1e9, eta2=1e9, nu=0.3))
PATH = jc.TangentialDisplacement(1e-6 * np.array([[0, 0], [1, 0], [2, 0], [1, 0.5], [-1, 0]]))
TIMES, GRID = np.arange(5.0), jc.Grid.square(16, 9e-4)


def sheared(body=BODY, friction=0.3, **options):
    return jc.shear(
        body,
        jc.Sphere(10e-3),
        jc.Load(5.0),
        PATH,
        TIMES,
        friction=friction,
        grid=GRID,
        coupled=False,
        **options,
    )


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_shear_keeps_what_save_says():
    """A function sees each time as the history of all has it, slip summed over the substeps."""

    def values(step):
        sticking = jnp.sum(step.stick) / jnp.sum(step.pressure > 0.0)
        return {"slip": step.slip, "share": sticking, "gap": step.gap, "load": step.tangential_load}

    whole, last = sheared(substeps=2), sheared(substeps=2, save="last")
    few = sheared(substeps=2, save=values)
    assert last.saved is None and set(few.saved) == {"slip", "share", "gap", "load"}
    same(few.saved["slip"], whole.slip)
    same(few.saved["share"], whole.sticking_share)
    same(few.saved["gap"], whole.gap)
    same(few.saved["load"], whole.tangential_load)
    for short in (few, last):
        same(short.friction_work, whole.friction_work)
        for name in ("pressure", "traction", "slip", "stick"):
            same(getattr(short, name), getattr(whole, name)[-1])


def same(found, expected):
    """To rounding of the largest number."""
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-11 * float(np.max(np.abs(expected))))


@pytest.mark.long
def test_reverse_mode_of_shear_in_blocks_is_bounded_in_memory():
    """With seven times as many rows, whose root is 2.7 times as large; the derivative is that with all pressures kept."""

    def compiled(nt, checkpoint):
        t = np.arange(float(nt))
        path = jc.TangentialDisplacement(1e-6 * np.stack([np.sin(t / 3.0), 0.0 * t], 1))

        def lost(friction):
            return jc.shear(
                jc.LayeredHalfSpace([], jc.Elastic(1e9, 0.3)), jc.Sphere(10e-3), jc.Load(5.0), path, t,
                friction=friction, grid=GRID, coupled=False, save="last", checkpoint=checkpoint, tolerance=1e-13,
            ).dissipated[-1]  # fmt: skip

        return jax.jit(jax.grad(lost)).lower(0.3).compile()

    size = lambda program: program.memory_analysis().temp_size_in_bytes
    few, many, keeping = compiled(9, "blocks"), compiled(64, "blocks"), compiled(9, "pressures")
    assert size(many) < 2.0 * size(few)
    same(few(0.3), keeping(0.3))
