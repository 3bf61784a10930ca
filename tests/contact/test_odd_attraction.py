"""Contact with adhesion of an operator with an odd part: its fixed point, and separation."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxcontact.bodies.grid import Grid
from jaxcontact.bodies.laws import ExponentialAdhesion
from jaxcontact.contact import adhesive
from jaxcontact.contact.adhesive import Attraction, Start
from jaxcontact.contact.normal import Problem
from jaxcontact.operators.kernels import on_grid
from jaxcontact.operators.operator import Operator
from jaxcontact.response.images import Images

SHAPE, FREE = (12, 11), (False, False)
ODD = 1.5  # of the even part, for the waves that move a quarter of their length; E0/Einf = 10 reaches 1.42


def problem_of(target):
    """A paraboloid under a load on a half-space of compliance 1 on unit cells, with an odd part along x."""
    even = on_grid(Grid(SHAPE, (1.0, 1.0), FREE), Images(jnp.zeros(0), jnp.ones((1, 1))))[0].combined([1.0])
    waves = 2.0 * jnp.pi * jnp.fft.fftfreq(even.spectra.shape[-1])
    spectrum = even.spectra * (1.0 + 1j * ODD * jnp.sin(waves))
    x, y = np.meshgrid(*(np.arange(n) - (n - 1) / 2 for n in SHAPE), indexing="ij")
    gap = jnp.asarray(0.02 * (x**2 + y**2))
    law = Attraction(ExponentialAdhesion(0.02, 0.15), FREE)
    operator = Operator(spectrum, even.circulant.astype(complex), periodic=FREE)
    return Problem(operator, gap, jnp.asarray(target), jnp.min(gap), True, law)


@jax.jit
def solved(problem, start):
    return adhesive.solve_in_turn(problem, start, jnp.asarray(1e-9), jnp.asarray(4000))


@pytest.mark.long
def test_a_large_odd_part_is_solved_for_and_forgotten_when_the_surfaces_separate():
    """The map alone does not contract: K_e^-1 K_o has eigenvalues up to 1.5i. The approach of separated surfaces is
    that of first touch, without the displacement by the pressure before."""
    problem = problem_of(0.4)
    found = solved(problem, Start(jnp.zeros(SHAPE), jnp.zeros(SHAPE, bool), jnp.asarray(True)))
    assert float(found.error) < 1e-9 and float(jnp.sum(found.pressure)) == pytest.approx(0.4, rel=1e-8)
    gap = np.asarray(problem.gap + problem.operator(found.pressure) - found.approach)
    contact = np.asarray(found.pressure + problem.law.traction(jnp.maximum(gap, 0.0)))
    touching = contact > 1e-8
    assert gap.min() > -1e-8 and np.all(gap[touching] < 1e-8) and 3 < touching.sum() < 90
    assert np.abs(contact[~touching]).max() < 1e-8
    # against gaps of up to 1
    assert np.abs(problem.operator(found.pressure) - problem.operator.uniform()(found.pressure)).max() > 0.1

    start = Start(found.pressure, found.carried > 0.0, jnp.asarray(False))
    apart = solved(problem_of(-3.0), start)
    assert bool(apart.separated) and not np.any(apart.pressure) and float(apart.approach) == 0.0
