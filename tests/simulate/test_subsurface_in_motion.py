"""Stresses under a pressure that moves, and in the indenter."""

import numpy as np
import pytest

import jaxcontact as jc

BODY = jc.LayeredHalfSpace(
    [jc.Layer(jc.StandardLinearSolid(G1=2.0, G2=1.0, eta2=0.6, nu=0.3), 0.3)], jc.Elastic(3.0, 0.4)
)
GRID = jc.Grid((64, 8), (0.1, 0.1))
X, Y = (np.asarray(a) for a in GRID.coordinates())


def hill(way):
    """A pressure whose centre is at x = 0.6 less a way."""
    return 0.1 * np.exp(-(((X - 0.6 + way) / 0.3) ** 2) - (Y / 0.25) ** 2)


@pytest.mark.slow
def test_stresses_of_a_load_that_moves_are_those_of_its_history_in_the_frame_of_the_body():
    """Its history in steps of a cell, whose error is of second order; at the surface the displacement of
    ``deflection``, on a small grid, which the track leaves."""
    times, fine, depths = np.linspace(0.0, 1.0, 11), np.linspace(0.0, 1.0, 21), [0.0, 0.2, 0.5]
    history = np.stack([hill(2.0 * (1.0 - t)) for t in fine])
    explicit = jc.subsurface(
        BODY, GRID, history, np.stack([0.3 * history, 0.1 * history], 1), depths=depths, times=fine
    )
    small, own = jc.Grid((24, 8), (0.1, 0.1)), slice(26, 50)
    last = hill(0.0)[own]
    moved = jc.subsurface(
        BODY, small, last, np.stack([0.3 * last, 0.1 * last]), depths=depths, times=times, velocity=2.0
    )
    for name, tolerance in (("stress", 1e-3), ("displacement", 3e-3)):  # 6 % and 57 % without the motion
        ours, theirs = np.asarray(getattr(moved, name)), np.asarray(getattr(explicit, name))[..., own, :]
        np.testing.assert_allclose(ours, theirs, atol=tolerance * np.max(np.abs(theirs)))
    inside = jc.subsurface(BODY, small, last, depths=depths, times=times, velocity=2.0)
    theirs = np.asarray(jc.deflection(BODY, GRID, hill(0.0), times, velocity=2.0).displacement)[-1, own]
    np.testing.assert_allclose(inside.displacement[0, 2], theirs, atol=3e-4 * np.max(theirs))


@pytest.mark.slow
def test_displacements_in_body_and_indenter_add_to_those_of_the_contact():
    """A coated ball that creeps on glass; across the contact the traction is one and the same."""
    glass = jc.LayeredHalfSpace([], jc.Elastic(30e9, 0.25))
    coat = jc.Layer(jc.StandardLinearSolid(3e9, 3e9, 1e10, nu=0.3), 20e-6)
    ball = jc.Sphere(5e-3, jc.LayeredHalfSpace([coat], jc.Elastic.from_young(210e9, 0.3)))
    grid, times = jc.Grid.square(24, 400e-6), np.array([0.0, 1.0, 2.0, 4.0])
    history = jc.indent(glass, ball, jc.Load(5.0), times, grid=grid, substeps=4)
    pressure = np.asarray(history.pressure)
    traction = 0.2 * np.stack([pressure, 0.0 * pressure], 1)
    below = jc.subsurface(glass, grid, pressure[-1], depths=[0.0])
    inside = jc.subsurface(glass, grid, pressure, depths=[0.0], times=times, indenter=ball)
    total = below.displacement[0, 2] + inside.displacement[0, 2]
    np.testing.assert_allclose(total, history.displacement[-1], atol=2e-3 * float(np.max(total)))

    rubbed = jc.subsurface(glass, grid, pressure, traction, depths=[0.0], times=times, indenter=ball)
    in_axes_of_body = np.asarray(rubbed.stress)[0, :, 2] * np.array([-1.0, -1.0, 1.0])[:, None, None]
    expected = -np.concatenate([traction[-1], pressure[-1:]])
    np.testing.assert_allclose(in_axes_of_body, expected, atol=1e-5 * np.max(pressure))
