"""A step that builds on a failed one is never reported as fine.

The failure is forced: after a time without load comes a contact that needs more iterations than there are. Under a load that
stays, the next steps go on from there until they converge, each by itself.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc
from jaxcontact._support.status import more_serious, most_serious, passed_on, to_next_row
from jaxcontact.history.normal_step import solved
from jaxcontact.history.time_loop import first_carry, in_blocks
from jaxcontact.simulate.indent import Indentation
from jaxcontact.simulate.run import plan_of, run_block
from jaxcontact.simulate.slide import reentered

FINE, FAILED, INHERITED = jc.Status.FINE, jc.Status.NOT_CONVERGED, jc.Status.INHERITED
MATERIALS = {
    "elastic": jc.Elastic(1e9, 0.3),
    "creeping": jc.StandardLinearSolid(G1=1e9, G2=1e9, eta2=1e9, nu=0.3),
}
BALL, GRID, TIMES = jc.Sphere(10e-3), jc.Grid.square(16, 9e-4), np.arange(10.0)
LOAD = np.append(0.0, 5.0 * np.ones(9))
FEW = 3  # iterations


def indent(body, load, times, **options):
    return jc.indent(body, BALL, load, times, **options)


def slide(body, load, times, **options):
    return jc.slide(body, BALL, load, times, velocity=1e-6, **options)


def shear(body, load, times, **options):
    to = jc.TangentialDisplacement((1e-8, 0.0))
    return jc.shear(body, BALL, load, to, times, friction=0.3, coupled=False, **options)


CASES = [  # verb, material, whether later steps inherit anything
    pytest.param(indent, "elastic", False, marks=pytest.mark.slow),
    pytest.param(indent, "creeping", True),
    pytest.param(shear, "elastic", True, marks=pytest.mark.long),
    pytest.param(shear, "creeping", True, marks=pytest.mark.long),
    pytest.param(slide, "elastic", False, marks=pytest.mark.long),
    pytest.param(slide, "creeping", True, marks=pytest.mark.long),
]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("verb", "material", "inherits"), CASES)
def test_steps_after_a_failed_one(verb, material, inherits):
    """Neither the same steps, nor, with substeps, a row in which an inner step failed, though its last one converged."""
    body, given = jc.LayeredHalfSpace([], MATERIALS[material]), {"grid": GRID, "max_iterations": FEW}
    status = np.asarray(verb(body, jc.Load(LOAD), TIMES, **given).status)
    last = int(np.max(np.flatnonzero(status == FAILED)))
    assert status[0] == FINE and status[1] == FAILED and last < 9, status
    assert np.all(status[last + 1 :] == (INHERITED if inherits else FINE)), status

    rows = verb(body, jc.Load(5.0), [0.0, 1e-6], substeps=9, **given)
    assert [*np.asarray(rows.status)] == ([FAILED, INHERITED] if inherits else [FINE, FINE])
    assert np.all(np.asarray(rows.converged) == (np.asarray(rows.status) == FINE))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_steps_after_a_load_that_friction_cannot_hold():
    """The load before and after it is the same; what it moved and cost is not known."""
    body = jc.LayeredHalfSpace([], MATERIALS["elastic"])
    push = jc.TangentialLoad([[0.0, 0.0], [2.0, 0.0], [0.5, 0.0], [0.5, 0.0]])
    history = jc.shear(body, BALL, jc.Load(5.0), push, TIMES[:4], friction=0.3, coupled=False, grid=GRID)
    assert [*np.asarray(history.status)] == [FINE, jc.Status.GROSS_SLIP, INHERITED, INHERITED]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_a_march_that_goes_on_from_a_carry_knows_of_an_earlier_failure():
    """In two blocks of five steps; the first step fails by itself, all others have a contact that moves little."""
    body, load = jc.LayeredHalfSpace([], MATERIALS["creeping"]), jc.Load(5.0)
    stepper, steps = _plan(body, load)
    carry, blocks = first_carry(stepper), in_blocks(steps, 5)
    assert blocks.exists.shape == (2, 5)
    found = []
    for index in range(2):
        carry = jax.tree.unflatten(jax.tree.structure(carry), jax.device_get(jax.tree.leaves(carry)))
        rows = jax.tree.map(lambda a, i=index: a[i], blocks)
        carry, outcomes = run_block(stepper, carry, rows)
        found += np.asarray(outcomes.numbers["status"]).tolist()
    assert found[0] == FAILED and found[4:] == 6 * [INHERITED]
    given = {"grid": GRID, "max_iterations": FEW}
    np.testing.assert_array_equal(jc.indent(body, BALL, load, 1e-6 * TIMES, **given).status, found)


def _plan(body, load):
    plan = plan_of(Indentation.of(body, BALL, load, 1e-6 * TIMES, GRID, max_iterations=FEW))
    return plan.stepper, plan.steps


def test_history_that_came_back_within_a_row():
    """An inner step between two times counts; what follows inherits it. The bound is 1 % of the largest approach so far."""
    comes_back = [
        # inner steps of each row: whether lost history lies under the contact, its bound, the largest approach so far
        [(False, 0.0, 100.0), (False, 3.0, 100.0)],
        [(True, 1.0, 100.0), (False, 0.0, 100.0)],
        [(True, 2.0, 100.0), (False, 0.0, 100.0)],
        [(True, 2.0, 300.0), (False, 0.0, 300.0)],
        [(False, 0.0, 300.0), (True, 3.1, 300.0)],
    ]
    failed, statuses = jnp.asarray(0), []
    for row in comes_back:
        failed = to_next_row(failed)
        for each in row:
            back = reentered(*map(jnp.asarray, each))
            own = jnp.where(back, int(jc.Status.REENTERED_TRACK), FINE)
            status, failed = more_serious(own, failed), more_serious(passed_on(own), failed)
        statuses.append(int(status))
    assert statuses == [FINE, FINE, jc.Status.REENTERED_TRACK, INHERITED, jc.Status.REENTERED_TRACK]


def test_what_is_passed_on():
    """A failure of the step itself comes first; few cells are reported, but are no failure that is passed on."""
    own = lambda status, earlier: int(more_serious(jnp.asarray(int(status)), jnp.asarray(int(earlier))))
    assert own(FINE, FINE) == FINE and own(jc.Status.TOO_COARSE, FINE) == jc.Status.TOO_COARSE
    assert own(FINE, INHERITED) == own(jc.Status.TOO_COARSE, INHERITED) == INHERITED
    assert own(FAILED, INHERITED) == FAILED and own(FINE, jc.Status.AT_EDGE) == jc.Status.AT_EDGE
    assert int(passed_on(jnp.asarray(int(jc.Status.TOO_COARSE)))) == FINE
    assert [int(to_next_row(jnp.asarray(int(s)))) for s in (FINE, FAILED, INHERITED)] == [0, 9, 9]


@pytest.mark.parametrize("error", [np.nan, np.inf, 1.0])
def test_an_error_that_is_no_number_is_a_failure(error):
    assert not solved(jnp.asarray(error), jnp.asarray(1e-8), jnp.zeros(3))
    assert not solved(jnp.asarray(0.0), jnp.asarray(1e-8), jnp.array([0.0, np.nan]))
    assert solved(jnp.asarray(0.0), jnp.asarray(1e-8), jnp.zeros(3))


# which of several statuses is reported -----------------------------------------------------------------------


ORDER = [name.strip() for name in jc.Status.__doc__.split("in this order:")[1].split(".")[0].split(",")]


@pytest.mark.parametrize("first", ORDER)
def test_of_every_pair_of_statuses_the_one_that_the_documentation_lists_first_is_reported(first):
    """In a step by itself, in whatever order they are found, and with the status of an earlier step."""
    assert sorted(ORDER) == sorted(status.name for status in jc.Status)
    for later in ORDER[ORDER.index(first) :]:
        pair, yes = (jc.Status[first], jc.Status[later]), jnp.asarray(True)
        for one, other in (pair, pair[::-1]):
            assert int(more_serious(jnp.asarray(int(one)), int(other))) == pair[0]
            assert int(most_serious((yes, one), (yes, other))) == pair[0]
            assert int(most_serious((yes, one), (~yes, pair[0]), status=int(other))) == pair[0]


BALL_OF_5, STEEL = jc.Sphere(5e-3), jc.Elastic.from_young(210e9, nu=0.3)
SMALL, LARGE = jc.Load(1e-4), jc.Load(5.0)  # contacts of less than three cells, and up to the edge of NARROW
NARROW = jc.Grid.square(16, 1e-4)
PUSH = jc.TangentialLoad([[0.0, 0.0], [2.0, 0.0]])


def first_and_second(verb):
    """The statuses of two times, the second with two reasons."""
    body = jc.LayeredHalfSpace([], MATERIALS["creeping"])
    flows = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9), 2e-5)], jc.Maxwell(1e9, 1e9))
    far = lambda grid: jax.jit(lambda v: jc.slide(body, BALL, SMALL, TIMES[:2], velocity=v, grid=grid).status)
    few = lambda load, grid: jc.indent(body, BALL, load, TIMES[:2], grid=grid, max_iterations=1).status
    sheared = lambda load, grid: (
        jc.shear(body, BALL, load, PUSH, TIMES[:2], friction=0.3, coupled=False, grid=grid).status
    )
    wears = {"velocity": 0.1, "law": jc.Archard(1e-10), "wears": "indenter", "grid": GRID}
    return {
        "coarse, not resolved": lambda: jc.indent(flows, BALL, SMALL, [0.0, 1e5], grid=GRID).status,
        "not converged, not resolved": lambda: (
            jc.indent(flows, BALL, LARGE, [0.0, 1e5], grid=GRID, max_iterations=1).status
        ),
        "coarse, too long": lambda: jc.rub(body, BALL_OF_5, SMALL, [0.0, 50.0], **wears).status,
        "at the edge, not converged": lambda: few(LARGE, NARROW),
        "coarse, too far": lambda: far(GRID)(1e-3),
        "coarse, gross slip": lambda: sheared(SMALL, GRID),
        "at the edge, gross slip": lambda: sheared(LARGE, NARROW),
    }[verb]()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("reasons", "expected"), [
    ("coarse, not resolved", "NOT_RESOLVED"),
    pytest.param("not converged, not resolved", "NOT_RESOLVED", marks=pytest.mark.long),
    pytest.param("coarse, too long", "STEP_TOO_LONG", marks=pytest.mark.long),
    ("at the edge, not converged", "NOT_CONVERGED"), ("coarse, too far", "MOVED_TOO_FAR"),
    pytest.param("coarse, gross slip", "GROSS_SLIP", marks=pytest.mark.long), ("at the edge, gross slip", "GROSS_SLIP"),
])  # fmt: skip
def test_the_more_serious_of_two_reasons_is_reported(reasons, expected):
    status = np.asarray(first_and_second(reasons))
    assert status[1] == jc.Status[expected], status
