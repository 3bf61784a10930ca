"""The normal contact problem on the grid, by preconditioned conjugate gradients.

    u = K * p,     g = u + gap - approach >= 0,     p >= 0,     p g = 0,

with either the sum of the pressures or the approach given. The method is that of I. A. Polonsky and
L. M. Keer, Wear 231 (1999) 206, with five changes: a circulant preconditioner, on the whole grid of
residuals continued beyond the contact (``operators.operator``); the Polak-Ribiere
direction; cells that overlap enter the search together with the others, without a separate step; each iteration costs one
convolution, also where cells leave contact: a step of the last accepted length is tried, tensile cells are clipped to zero,
and the search along the clipped step, in which u is linear, is exact; and under a given approach directions have zero mean
too, with each new pressure multiplied by the factor of least energy, since a surface that moves as a whole, as that of a
stiff film does, would otherwise lose and regain its contact with every cell. On a large grid, of which enough is free of
contact, the search begins in a window around the contact (``operators.operator``); it always ends on the whole grid.

The stopping error is dimensionless and holds for the whole problem, also outside the contact:

    max( sum p |g| / sum p,  largest penetration ) / depth,

depth = approach above the lowest point of the profile (or the mean displacement, if larger).
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact._support.pytree import pytree, replace, static
from jaxcontact._support.reductions import largest, lowest_point, total, totals
from jaxcontact.contact.law import UNILATERAL
from jaxcontact.operators.operator import OnContact, Operator, cut, paste, place, unchanged

PARALLEL = 1e-14  # directions whose squared sine to the pressure is below this count as parallel to it
LENGTH = 0.5  # length of the first trial step, relative to the preconditioned residual
NEARLY = 0.8  # a step of least energy beyond this part of the trial is taken whole, so that clipped cells leave contact
LENGTHENED = 0.5, 2.0  # bounds of the change of the trial length from step to step where cells were clipped


@pytree
class Problem:
    """A contact to be solved, scaled so that its numbers are of order one.

    operator: p -> K p; gap: (nx, ny), at an approach of zero and without the pressure sought: the profile and the
    displacement that earlier pressure has left; target: sum of the pressures, or the approach, (); lowest: lowest value of
    the profile, (); law: the pressures and gaps that a cell may have; drag: the friction of a contact with adhesion
    (``contact.adhesive.Drag``), or None: without adhesion the operator contains the friction; windowed: whether the search
    begins in the window of the operator, if that has one.
    """

    operator: Operator
    gap: Array
    target: Array
    lowest: Array
    load_controlled: bool = static()
    law: Any = UNILATERAL  # a ContactLaw, or an Attraction for contact.adhesive
    drag: Any = None
    windowed: bool = static(default=True)


@pytree
class Solution:
    """The solution of a contact.

    pressure, and displacement under it (K p, and that of the drag), (nx, ny); approach, error, iterations, (). With
    adhesion also contact_pressure (nx, ny), the pressure without the attraction; separated (): whether there is no contact
    because none could carry the load; and unstable (): whether the search passed unstable states.
    """

    pressure: Array
    displacement: Array
    approach: Array
    error: Array
    iterations: Array
    contact_pressure: Array | None = None
    separated: Array | None = None
    unstable: Array | None = None

    @property
    def carried(self) -> Array:
        """The contact pressure, (nx, ny): with adhesion the pressure without the attraction, otherwise the pressure."""
        return self.pressure if self.contact_pressure is None else self.contact_pressure


class _State(NamedTuple):
    """State of the search: the pressure, its displacement, and what the next iteration needs of the last one.

    direction, before: direction and residual of the last iteration, (nx, ny); descent: <z, r> of it, zero to start afresh;
    length: of the next trial step along its direction; residual (nx, ny), approach, error, working: from ``_assessed``.
    """

    pressure: Array
    displacement: Array
    direction: Array
    before: Array
    descent: Array
    length: Array
    residual: Array
    approach: Array
    error: Array
    working: tuple[Array, Array]
    iterations: Array


def masked_mean(values: Array, mask: Array) -> Array:
    """Return the mean over the cells of the mask; zero for an empty one."""
    return total(jnp.where(mask, values, 0.0)) / jnp.maximum(total(mask), 1.0)


def projected(values: Array, mask: Array, load_controlled: bool) -> Array:
    """Return values that are zero outside the mask and, under a given load, of zero mean within it."""
    if load_controlled:
        values = values - masked_mean(values, mask)
    return jnp.where(mask, values, 0.0)


def approach_of(problem: Problem, pressure: Array, displacement: Array) -> Array:
    """Return the approach: as given, or the one at which the gap is zero in the mean over the free cells in contact.

    Where there is no contact it is that of first touch: the indenter's lowest point, which may lie between centres of
    cells, meets the lowest point of the surface. This is the lowest sampled point of u + gap less that of the profile,
    zero without history.
    """
    if not problem.load_controlled:
        return problem.target
    return _zero_gap(
        problem, pressure, displacement, lowest_point(displacement + problem.gap) - problem.lowest
    )


def _zero_gap(problem: Problem, pressure: Array, displacement: Array, otherwise: Array) -> Array:
    """Return the approach at which the gap of the free cells is zero in the mean, or another value if there are none."""
    surface, free = displacement + problem.gap, problem.law.free(pressure)
    if problem.law.prescribes:
        # All cells in contact may carry a prescribed pressure. Their gap is closed, with the least overlap; where a cell
        # outside lies lower than one of them, both have to change, and the approach is between the two.
        touching = problem.law.touching(pressure)
        highest = jnp.max(jnp.where(touching, surface, -jnp.inf))
        lowest = jnp.min(jnp.where(touching, jnp.inf, surface))
        otherwise = jnp.where(jnp.any(touching), jnp.minimum(highest, (highest + lowest) / 2.0), otherwise)
    return jnp.where(jnp.any(free), masked_mean(surface, free), otherwise)


def depth_of(problem: Problem, approach: Array, energy: Array, size: Array) -> Array:
    """Return the depth in the formula of the error, from the sums of p u (``energy``) and of p (``size``).

    It is zero only for a contact that just touches, where there is no gap either.
    """
    return jnp.maximum(jnp.abs(approach - problem.lowest), energy / positive_or_one(size))


def stopping_error(
    problem: Problem, pressure: Array, displacement: Array, residual: Array, approach: Array
) -> Array:
    """Return the dimensionless error of the formula at the head of the module, of any pressure.

    Within a search ``_assessed`` computes it from sums that it has already.
    """
    violation = problem.law.violation(pressure, residual)
    outside = violation * ~problem.law.touching(pressure)
    sums = pressure * violation, pressure, pressure * displacement
    violated, size, energy = totals(*sums)
    worst = jnp.maximum(violated / positive_or_one(size), largest(outside))
    return worst / positive_or_one(depth_of(problem, approach, energy, size))


def first_guess(problem: Problem) -> Array:
    """Return a pressure in proportion to the overlap of undeformed surfaces, at the approach or over a quarter of the
    cells."""
    gap, law = problem.gap, problem.law
    if problem.load_controlled:
        # The level below which a quarter of the cells lie, to 1e-6 of the range, by bisection: a sort takes longer, and
        # of a gap that is a constant XLA makes one for itself, slowly, while it compiles.
        def halve(_: int, ends: Array) -> Array:
            middle = jnp.mean(ends)
            return jnp.where(jnp.mean(gap < middle) < 0.25, ends.at[0].set(middle), ends.at[1].set(middle))

        level = jnp.mean(jax.lax.fori_loop(0, 20, halve, jnp.stack([jnp.min(gap), jnp.max(gap)])))
        overlap = jnp.maximum(level - gap, 0.0)
        overlap = jnp.where(jnp.any(overlap > 0.0), overlap, 1.0)
        return law.balanced(overlap, problem.target, overlap > 0.0)
    # s times the overlap o under the approach, with the s of least energy if o were the residual: <o, o>/<o, K o>
    overlap = jnp.maximum(problem.target - gap, 0.0)
    energy = jnp.sum(overlap * problem.operator(overlap))
    return law.admissible(overlap * jnp.sum(overlap**2) / jnp.where(energy > 0.0, energy, 1.0))


def usable_start(problem: Problem, start: Array) -> Array:
    """Return ``start``, clipped and scaled to the load, or the first guess where ``start`` has no contact or, under a given
    approach, does no work.

    A pressure that does work has, with the factor of least energy, an energy below zero, as have all later pressures.
    """
    start = problem.law.admissible(start)
    some = _usable(problem, start)
    if problem.load_controlled:
        start = jnp.where(some, start, 1.0)
        start = problem.law.balanced(start, problem.target, start > 0.0)
    return jax.lax.cond(some, lambda: start, lambda: first_guess(problem))


def _usable(problem: Problem, start: Array) -> Array:
    """Return whether a start has contact or, at a given approach, does work, () bool."""
    return total(start if problem.load_controlled else start * (problem.target - problem.gap)) > 0.0


def positive_or_one(value: Array) -> Array:
    """Return a value that is not positive as one, for a division whose result is not used then."""
    return jnp.where(value > 0.0, value, 1.0)


def _sized(problem: Problem) -> bool:
    """Return whether the magnitude of the whole pressure is free: at a given approach, if the law is homogeneous."""
    return not problem.load_controlled and problem.law.homogeneous


def _of_zero_mean(problem: Problem) -> bool:
    """Return whether search directions have zero mean: the load is given, or the magnitude of the pressure is free."""
    return problem.load_controlled or problem.law.homogeneous


@jax.jit  # so that it is traced once for each grid, and not before and within the loop
def _assessed(problem: Problem, s: _State) -> _State:
    """Return the state with residual, approach, error and working cells for its pressure, in few passes over the grid.

    residual: the gap at the approach of the search; working: the number of cells that the next iteration may change, and
    the sum of the residual over them.
    """
    law, surface = problem.law, s.displacement + problem.gap
    # The magnitude of least energy at a given approach: d/ds [s^2/2 <p, K p> + s <p, gap - approach>] = 0.
    if _sized(problem):
        work, energy = totals(s.pressure * (problem.target - problem.gap), s.pressure * s.displacement)
        share = jnp.where((work > 0.0) & (energy > 0.0), work / positive_or_one(energy), 1.0)
        s = s._replace(pressure=share * s.pressure, displacement=share * s.displacement)
        surface = s.displacement + problem.gap
    p, free = s.pressure, law.free(s.pressure)

    # The residual is the gap; under a given load at the approach of its zero mean over the cells in contact (Polonsky and
    # Keer's step 1), and so at a given approach if the magnitude is free.
    cells, heights, size, energy = totals(free, free * surface, p, p * s.displacement)
    if problem.load_controlled:
        without = lambda: approach_of(problem, p, s.displacement)
    else:
        without = lambda: _zero_gap(problem, p, s.displacement, problem.target)
    level = jax.lax.cond(cells > 0.0, lambda: heights / cells, without)
    approach = level if problem.load_controlled else problem.target
    residual = surface - (level if _of_zero_mean(problem) else approach)

    # The error as in ``stopping_error``.
    violation, working = law.violation(p, surface - approach), law.may_change(p, residual)
    violated, number, remaining = totals(p * violation, working, working * residual)
    worst = jnp.maximum(violated / positive_or_one(size), largest(violation * ~law.touching(p)))
    error = worst / positive_or_one(depth_of(problem, approach, energy, size))
    return s._replace(residual=residual, approach=approach, error=error, working=(number, remaining))


def _search(
    problem: Problem,
    precondition: OnContact,
    start: Array,
    displacement: Array,
    tolerance: Array,
    max_iterations: Array,
) -> _State:
    """Iterate from a usable start and the displacement under it: the conjugate gradients of the module."""
    law, sized = problem.law, _sized(problem)

    def iterate(s: _State) -> _State:
        p, r, (number, remaining) = s.pressure, s.residual, s.working

        # 1. Precondition the residual on the cells that may change: those in contact and those that overlap. Where the
        # directions have zero mean, that of r and of z = C r is subtracted, within the sums, which saves passes.
        inside = law.may_change(p, r).astype(float)
        over_number = jnp.where(_of_zero_mean(problem), 1.0, 0.0) / jnp.maximum(number, 1.0)
        z = inside * precondition(inside * (r - remaining * over_number), inside)
        products = z, z * r, z * s.before, inside * s.before, inside * s.direction
        mean, descent, kept, before, along = totals(*products)
        mean = mean * over_number
        descent, kept = descent - mean * remaining, kept - mean * before

        # 2. Conjugate direction t = z + beta t, beta = <z, r - r_before>/<z, r>_before >= 0 (E. Polak, G. Ribiere).
        beta = jnp.where(
            s.descent > 0.0, jnp.maximum((descent - kept) / positive_or_one(s.descent), 0.0), 0.0
        )
        t = inside * (z - (mean + beta * along * over_number) + beta * s.direction)

        # 3. Trial: the step of the last good length, clipped to admissible pressures and brought to the load.
        unclipped = p - s.length * t
        tried = law.admissible(unclipped)
        clipped = total(tried != unclipped) > 0.0
        if problem.load_controlled:
            tried = law.balanced(unclipped, problem.target, law.may_change(p, r))
        step = tried - p
        displacement_of_step = problem.operator(step)  # the convolution of the iteration

        # 4. The part of the step d that leaves the least energy, part = -<d, r>/<d, K d>, since u is linear along it.
        # Where the magnitude s of p is free, the least over both: the 2 x 2 system of d and p, by Cramer's rule. Where
        # the energy does not fall, none of the step at a given approach, all of it under a given load.
        residual = s.displacement + problem.gap - s.approach
        if not sized:
            falling, curvature = totals(step * residual, step * displacement_of_step)
            slope = -falling
        else:
            products = (
                step * residual,
                step * displacement_of_step,
                p * displacement_of_step,
                p * s.displacement,
                p * residual,
            )
            falling, curvature, mixed, stiffness, shrinking = totals(*products)
            slope, growing = -falling, -shrinking
            apart = curvature * stiffness - mixed**2 > PARALLEL * curvature * stiffness
            whole = (curvature * stiffness - mixed**2) + (growing * curvature - slope * mixed)
            slope, curvature = slope * stiffness - growing * mixed, jnp.where(apart, whole, 0.0)
        least, rising = slope / positive_or_one(curvature), 1.0 if problem.load_controlled else 0.0
        least = jnp.where(curvature > 0.0, jnp.where(least > 0.0, least, rising), 1.0)

        # 5. Go that part: up to one always, beyond as far as the pressure stays admissible, and the whole way if it is
        # nearly that. A direction along which the energy rises is given up, for a shorter step down the residual.
        longest = jax.lax.cond(least > 1.0, lambda: law.longest(p, step), lambda: least)
        part = jnp.minimum(least, longest)
        part = jnp.where(clipped & (part > NEARLY) & (part < 1.0), 1.0, part)
        rises = least == 0.0
        moved = s._replace(
            pressure=jnp.where(part == 1.0, tried, law.admissible(p + part * step)),
            displacement=s.displacement + part * displacement_of_step,
            direction=t,
            before=r,
            descent=jnp.where(rises, 0.0, descent),
            length=s.length * jnp.where(clipped | rises, jnp.clip(least, *LENGTHENED), least),
            iterations=s.iterations + 1,
        )
        return _assessed(problem, moved)

    zero, nothing, none = jnp.zeros_like(start), jnp.zeros(()), jnp.zeros((), int)
    unknown = zero, nothing, nothing, (nothing, nothing)
    first = _State(start, displacement, zero, zero, nothing, jnp.asarray(LENGTH), *unknown, none)
    first = _assessed(problem, first)
    if problem.load_controlled:  # without a load the start, zero pressure, is the solution
        first = first._replace(error=jnp.where(problem.target > 0.0, first.error, 0.0))
    going = lambda s: (s.error > tolerance) & (s.iterations < max_iterations)
    return jax.lax.while_loop(going, iterate, first)


def _search_in_window(
    problem: Problem, shape: tuple[int, int], start: Array, tolerance: Array, max_iterations: Array
) -> tuple[Array, Array]:
    """Return the pressure on the whole grid after a search in a window, and its iterations; ``start`` if it does not fit."""
    corner, fits = place(problem.law.touching(start), shape)
    part, operator = cut(start, corner, shape), problem.operator.restricted(corner)
    law = problem.law.in_window(corner, shape)
    within = replace(problem, operator=operator, gap=cut(problem.gap, corner, shape), law=law)
    # the contact covers much of the window, so that residuals continued beyond it would save few iterations
    precondition = unchanged(operator.preconditioner())
    limit = jnp.where(fits, max_iterations, 0)
    found = _search(within, precondition, part, operator(part), tolerance, limit)
    return jnp.where(fits, paste(found.pressure, corner, start.shape), start), found.iterations


def solve_on_grid(problem: Problem, start: Array, tolerance: Array, max_iterations: Array) -> Solution:
    """Solve as ``solve`` does, but without a search in a window."""
    start = usable_start(problem, start)
    return _solution(problem, start, problem.operator(start), tolerance, max_iterations)


def solve_further(
    problem: Problem, before: Solution, known: Array, tolerance: Array, max_iterations: Array
) -> Solution:
    """Solve as ``solve_on_grid`` does, from the solution with another gap; known: whether its displacement is K p still."""

    def anew() -> tuple[Array, Array]:
        start = usable_start(problem, before.pressure)
        return start, problem.operator(start)

    kept = known & _usable(problem, before.pressure)
    start, displacement = jax.lax.cond(kept, lambda: (before.pressure, before.displacement), anew)
    return _solution(problem, start, displacement, tolerance, max_iterations)


def solve(problem: Problem, start: Array, tolerance: Array, max_iterations: Array) -> Solution:
    """Solve from a start pressure (nx, ny); the iterations stop at the tolerance or the maximum.

    A load of zero gives a pressure of zero at the approach of first touch, an approach without contact a pressure of zero.
    ``error`` shows whether the tolerance was met.
    """
    p, taken = usable_start(problem, start), jnp.zeros((), int)
    window = problem.operator.window_shape(p.shape) if problem.windowed else None
    if window is not None:
        p, taken = _search_in_window(problem, window, p, tolerance, max_iterations)
    found = _solution(problem, p, problem.operator(p), tolerance, max_iterations - taken)
    return replace(found, iterations=taken + found.iterations)


def _solution(
    problem: Problem, start: Array, displacement: Array, tolerance: Array, max_iterations: Array
) -> Solution:
    """Return the solution found on the whole grid from a usable start and the displacement under it."""
    precondition = problem.operator.preconditioner_on_contact()
    s = _search(problem, precondition, start, displacement, tolerance, max_iterations)
    return Solution(s.pressure, s.displacement, s.approach, s.error, s.iterations)
