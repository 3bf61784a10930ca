"""Derivatives through the contact problem; the only module with derivative rules.

On the contact area A = {p > 0} the solution obeys K_AA p - approach = -gap, with sum p given or the approach
given. Hence, for changes dK, dgap, dtarget,

    K_AA dp - d approach = -(dK p + dgap)_A,      dp = 0 off A,      sum dp = d target (load)

which is linear: conjugate gradients in the same masked, zero-mean subspace, with the same
preconditioner and in the same window as the contact itself; for an operator that is not symmetric (a
complex spectrum), BiCGSTAB. ``custom_linear_solve`` transposes it, so forward and reverse mode and their
compositions all follow from this one rule.

A cell that is just entering or leaving contact (p = 0 and g = 0) counts as outside: the derivative is
that of the side on which it stays out. Without contact no derivative of the pressure is left; under a load of
zero the approach goes with the place of first touch. A derivative whose linear solve fails is nan.

First derivatives go over into those of the continuous problem as cells shrink. Second derivatives do not:
they are those of the discrete problem with its area of contact held, and miss what the moving edge adds
(under a given approach the load of an elastic body is piecewise linear: the second derivative is zero).
Differences of gradients over steps in which many cells enter see the edge.
"""

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array
from jax.ad_checkpoint import checkpoint_name

from jaxcontact import spectral
from jaxcontact._pytree import replace
from jaxcontact.contact import nonsymmetric
from jaxcontact.contact.nonsymmetric import Linear
from jaxcontact.contact.normal import Problem, Solution, in_window, preconditioner, projected, solve
from jaxcontact.contact.window import cut, paste, place

TANGENT_TOLERANCE = 1e-10
TANGENT_ITERATIONS = 400
KEPT = "pressure"  # what reverse mode keeps of a step: all that its linear solve needs


def solve_in_contact(problem: Problem, mask: Array, right: Array) -> Array:
    """x with P K P x = P right, P the projection onto cells of the mask (and zero mean under a load)."""
    inside = lambda x: projected(x, mask, problem.load_controlled)
    operator = lambda x: inside(spectral.convolve(problem.spectrum, inside(x)))
    if problem.symmetric:
        search = lambda _, b: _conjugate_gradients(problem, mask, b)
        return jax.lax.custom_linear_solve(operator, right, search, symmetric=True)
    forward, back = (partial(_bicgstab, inside, c) for c in (problem.circulant, problem.circulant.conj()))
    return jax.lax.custom_linear_solve(operator, right, forward, transpose_solve=back)


def _conjugate_gradients(problem: Problem, mask: Array, right: Array) -> Array:
    """In the window if it holds the mask, otherwise on the whole grid; the other search takes no step."""
    if problem.window is None:
        return _on_grid(problem, mask, right, TANGENT_ITERATIONS)
    shape = spectral.window_shape(mask.shape)
    corner, fits = place(mask, shape)
    b = projected(right, mask, problem.load_controlled)
    limits = jnp.where(fits, TANGENT_ITERATIONS, 0), jnp.where(fits, 0, TANGENT_ITERATIONS)
    part = _on_grid(in_window(problem, corner), cut(mask, corner, shape), cut(b, corner, shape), limits[0])
    return paste(part, corner, mask.shape) + _on_grid(problem, mask, b, limits[1])


def _on_grid(problem: Problem, mask: Array, right: Array, limit: Array | int) -> Array:
    """Preconditioned conjugate gradients from zero, of at most ``limit`` iterations; nan if they fail.

    From zero: the tangent of the step before, extrapolated or not, leaves 0.2 to 0.9 of the right side
    where cells have entered contact, saves no iteration, and costs a convolution.
    """
    inside = lambda x: projected(x, mask, problem.load_controlled)
    inverse = preconditioner(problem.circulant)
    precondition = lambda r: inside(spectral.apply_circulant(inverse, r))
    r = inside(right)
    z = precondition(r)
    descent = jnp.sum(r * z)
    goal = TANGENT_TOLERANCE**2 * descent

    def step(state):
        x, r, t, descent, count = state
        lifted = inside(spectral.convolve(problem.spectrum, t))
        curvature = jnp.sum(t * lifted)
        length = descent / jnp.where(curvature > 0.0, curvature, 1.0)
        x, r = x + length * t, r - length * lifted
        z = precondition(r)
        new = jnp.sum(r * z)
        return x, r, z + (new / descent) * t, new, count + 1

    going = lambda state: (state[3] > goal) & (state[4] < limit)
    x, _, _, descent, _ = jax.lax.while_loop(going, step, (jnp.zeros_like(r), r, z, descent, 0))
    return jnp.where((descent <= goal) | (limit == 0), x, jnp.nan)


def _bicgstab(inside: Linear, circulant: Array, operator: Linear, right: Array) -> Array:
    """For an operator that is not symmetric."""
    inverse = nonsymmetric.complex_preconditioner(circulant)
    precondition = lambda x: inside(spectral.apply_circulant(inverse, x))
    b = inside(right)
    x, _, met = nonsymmetric.bicgstab(operator, precondition, b, TANGENT_TOLERANCE, TANGENT_ITERATIONS)
    return jnp.where(met, x, jnp.nan)


@jax.custom_jvp
def solve_contact(problem: Problem, start: Array, tolerance: Array, max_iterations: Array) -> Solution:
    """``solve`` of contact.normal or .nonsymmetric, differentiable in everything in ``problem``."""
    method = solve if problem.symmetric else nonsymmetric.solve
    return method(problem, start, tolerance, max_iterations)


@solve_contact.defjvp
def _solve_contact_jvp(primals, tangents):
    problem, change = primals[0], tangents[0]
    solution = solve_contact(*primals)
    p = checkpoint_name(solution.pressure, KEPT)
    mask = p > 0.0
    transformed = spectral.transform(p)
    forcing = spectral.inverse(change.spectrum * transformed, p.shape)
    total = jnp.sum(p)
    over_total = jnp.where(total > 0.0, 1.0 / jnp.where(total > 0.0, total, 1.0), 0.0)
    if problem.load_controlled:
        share = change.target * over_total
        displacement = spectral.inverse(problem.spectrum * transformed, p.shape)
        right = -(forcing + change.gap + share * displacement)
        dp = share * p + solve_in_contact(problem, mask, right)
        # <p, K dp + dK p + dgap> = d approach sum p, with K^T p in place of the convolution of dp
        back = displacement
        if not problem.symmetric:
            back = spectral.inverse(problem.spectrum.conj() * transformed, p.shape)
        d_approach = jnp.sum(back * dp + p * (forcing + change.gap)) * over_total
        first_touch = jnp.argmin(problem.gap)
        d_approach = jnp.where(total > 0.0, d_approach, change.gap.ravel()[first_touch])
    else:
        dp = solve_in_contact(problem, mask, change.target - forcing - change.gap)
        d_approach = change.target
    du = forcing + spectral.convolve(problem.spectrum, dp)
    zero_iterations = jnp.zeros((), dtype=jax.dtypes.float0)
    tangent = Solution(dp, du, d_approach, jnp.zeros_like(solution.error), zero_iterations)
    return replace(solution, pressure=p), tangent
