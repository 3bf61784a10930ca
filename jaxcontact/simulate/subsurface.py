"""Stresses and displacements below the surface."""

from __future__ import annotations

import warnings
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import as_float64, is_concrete, untupled
from jaxcontact.bodies.body import LayeredHalfSpace, check_bonded, checked_body
from jaxcontact.bodies.grid import Grid, check_grid, check_not_periodic
from jaxcontact.operators import spectral
from jaxcontact.operators.coupled import spectrum
from jaxcontact.response.in_time import creeps
from jaxcontact.response.interior import (
    OF_DISPLACEMENTS,
    OF_GRADIENTS,
    Lags,
    SubsurfaceImages,
    depths_of_interfaces,
    displacements,
    gradients,
    lags_before_the_last,
    poisson_at,
    subsurface_images,
    summed,
)
from jaxcontact.response.stack import solids, spectra
from jaxcontact.results.interior import InteriorFields


def subsurface(
    body: LayeredHalfSpace,
    grid: Grid,
    pressure: Array,
    traction: Array | None = None,
    *,
    depths: Array,
    times: Array | None = None,
) -> InteriorFields:
    """Compute stresses and displacements in layers and substrate under pressure and traction on the surface.

        sigma_ij(x, z, T) = sum over cells of int S_ijk(x - x', z, T - t) d t_k(x', t)

    The tractions t_k are uniform over rectangular cells and linear between the times. The result is exact for a
    half-space. For a layered body the response is approximated by images and by combining responses at different times;
    ``response_error`` of the result is the measured error of this approximation. It is about 1e-6, and up to 1e-3 near
    interfaces if a layer is a thousand times as stiff as the material below it has become by flow. Above 1e-4 the result
    has a note, with a warning, and above 1 % the status of the depth is ``NOT_RESOLVED``.

    S_ijk follows from that of an elastic body by the correspondence principle. In a half-space of one material with a
    constant Poisson's ratio the stresses are those of an elastic body at any time, while the displacements creep. A
    creeping film spreads the pressure and thereby reduces the stresses below it: with the example of ``Burgers`` on steel
    under 60 N the largest von Mises stress falls from 720 MPa to 403 MPa in 7200 s (739 MPa without a film). The
    stresses sigma_xx, sigma_yy and sigma_xy are discontinuous at interfaces; the value at an interface is that just
    below it. The transfer of tractions through the layers (``response.interior``) and its development in time
    (``response.interior``) were derived for this package.

    The result is differentiable with respect to all numbers, depths included; at the surface and at an interface the
    derivative by depth is that below it.

    Args:
        body: a ``LayeredHalfSpace``. Without ``times`` the response is the instantaneous one.
        grid: a ``Grid``.
        pressure: (nx, ny) [Pa], positive in compression, as in ``ContactHistory.pressure``; (nt, nx, ny) with times.
        traction: (2, nx, ny) [Pa] on the body, or (nt, 2, nx, ny), as in ``ShearHistory.traction``; None for zero.
        depths: (nz,) [m] >= 0, above a rigid base or at it, where stresses are those of the layer on it.
        times: (nt,) [s], as in ``indent``; the tractions are applied as a step at the first time. Viscoelastic materials
            must then be defined by ``nu`` and not by ``bulk_modulus``.

    Returns:
        ``InteriorFields`` at the last time; nan where a value traced by jit or vmap is outside its range.

    Raises:
        ValueError: invalid or unsupported input.

    Example:
        >>> glass = jc.LayeredHalfSpace([], substrate=jc.Elastic(G=30e9, nu=0.25))
        >>> grid = jc.Grid.square(n=32, width=300e-6)
        >>> history = jc.indent(glass, jc.Sphere(5e-3), jc.Load(20.0), [0.0], grid=grid)
        >>> inside = jc.subsurface(glass, grid, history.pressure[-1], depths=np.linspace(0.0, 150e-6, 16))
        >>> stress, place = inside.peak
        >>> f"{stress / history.pressure[-1].max():.2f} of the peak pressure, {place[2] * 1e6:.0f} um deep"
        '0.64 of the peak pressure, 50 um deep'
    """
    body, valid = checked_body(body)
    depths, times = untupled(depths), untupled(times)
    check_not_periodic(grid, "subsurface")
    valid = valid & check_grid(grid)

    # shapes and values of tractions, times and depths
    over_time: tuple[int, ...] = ()
    if times is not None:
        valid = valid & checks.not_decreasing("times [s]", times)
        over_time = np.shape(times)
    valid = valid & _check_field("pressure", pressure, over_time, grid.shape)
    if traction is not None:
        valid = valid & _check_field("traction", traction, over_time, (2, *grid.shape))
        check_bonded(body, "traction")
    shape = np.shape(depths)
    checks.require(len(shape) == 1 and shape[0] > 0, f"depths: expected a 1-d array, got shape {shape}")
    valid = valid & checks.non_negative("depths [m]", depths)
    if body.substrate is None:
        if is_concrete(body, depths):
            deepest, height = float(np.max(np.asarray(depths))), float(body.height)
            checks.require(
                deepest <= height * (1.0 + 1e-12),
                f"depths [m]: expected at most {height:g}, where the rigid base begins, got {deepest:g}",
            )
        valid = valid & (jnp.max(jnp.asarray(depths)) <= body.height * (1.0 + 1e-12))

    # after a history Poisson's ratio below the surface is a number
    moving = [solid for solid in solids(body) if creeps(solid) and solid.bulk_modulus is not None]
    checks.require(
        times is None or not moving,
        "times: expected None with a bulk modulus in a solid that creeps, whose Poisson's ratio varies with time",
    )
    # where the last change is a step, no solid has J(0) = 0
    ends_in_a_step = times is None or (
        is_concrete(times) and not (np.size(times) > 1 and times[-1] > times[-2])
    )
    if ends_in_a_step:
        at_first = spectra(body).instantaneous
        at_first = at_first if body.substrate is not None else at_first[:-1]
        valid = valid & checks.positive("compliance [1/Pa] of every solid at first", at_first)
    body, grid, pressure, depths = as_float64((body, grid, pressure, depths))
    if not is_concrete(valid):
        pressure = jnp.where(valid, pressure, jnp.nan)
    sideways = jnp.zeros((2, *grid.shape)) if traction is None else as_float64(traction)
    sideways = jnp.broadcast_to(sideways, (*pressure.shape[:-2], 2, *grid.shape))
    tractions = jnp.concatenate([sideways, pressure[..., None, :, :]], -3)
    if times is None:
        return _announced(_fields(body, grid, tractions[None], depths, None))
    if not any(creeps(solid) for solid in solids(body)):
        return _announced(_fields(body, grid, tractions[-1:], depths, None))
    changes = jnp.diff(tractions, axis=0, prepend=0.0)
    return _announced(_fields(body, grid, changes, depths, lags_before_the_last(as_float64(times))))


def _announced(fields: InteriorFields) -> InteriorFields:
    """Return the fields, and issue their notes as warnings where the numbers are known."""
    for note in fields.notes if is_concrete(fields) else ():
        warnings.warn(note, stacklevel=3)
    return fields


def _check_field(name: str, field: Any, over_time: tuple[int, ...], own: tuple[int, ...]) -> Verdict:
    shape, other = (*over_time, *own), "" if over_time else ", or one for each time with times="
    checks.require(np.shape(field) == shape, f"{name}: expected shape {shape}{other}, got {np.shape(field)}")
    return checks.finite(f"{name} [Pa]", field)


@jax.jit
def _fields(
    body: LayeredHalfSpace, grid: Grid, changes: Array, depths: Array, lags: Lags | None
) -> InteriorFields:
    """Return the interior fields from changes of (q_x, q_y, p), (nt, 3, nx, ny), and the lags since each."""

    sizes = jnp.max(jnp.abs(changes), (-1, -2))

    def at(z: Array) -> tuple[Array, Array, Array]:
        images = subsurface_images(body, z, lags)
        mixed = spectral.transform(jnp.tensordot(images.shares, changes, (0, 0)))
        passed, strains = _kernels_of_stress(grid, images)
        apply = lambda kernels: spectral.inverse(
            jnp.stack([jnp.einsum("kmyx,mkyx->yx", jnp.stack(row), mixed) for row in kernels]), grid.shape
        )
        stress = _stress(apply(passed), apply(strains), poisson_at(body, z))
        displacement = apply(_kernels_of_displacement(grid, images)) * grid.spacing[0]
        return stress, displacement, images.error(jax.lax.stop_gradient(sizes))

    stress, displacement, error = jax.lax.map(at, depths)
    interfaces = depths_of_interfaces(body)
    return InteriorFields(grid, depths, stress, displacement, error, interfaces if interfaces.size else None)


Rows = list[list[Array]]


def _kernels_of_stress(grid: Grid, images: SubsurfaceImages) -> tuple[Rows, Rows]:
    """Spectra (M, my/2 + 1, mx) from (q_x, q_y, p) to the tractions (x, y, z), and to the strains xx, yy and 2 xy times
    the modulus, at a depth."""
    zero, one, two, three = summed(grid, gradients, OF_GRADIENTS, images)
    t_zz = spectrum(zero[0, 0], 1, 1)
    (rz_x, zr_x), (rz_y, zr_y) = spectrum(one[:, 0], -1, 1), spectrum(one[:, 1], 1, -1)
    (rr_xx, ss_xx, u_xx), (rr_yy, ss_yy, u_yy) = spectrum(two[:, 0], 1, 1), spectrum(two[:, 2], 1, 1)
    rr_xy, ss_xy, u_xy = spectrum(two[:, 1], -1, -1)
    (rr_xxx, ss_xxx), (rr_xyy, ss_xyy) = spectrum(three[:, 0], -1, 1), spectrum(three[:, 2], -1, 1)
    (rr_xxy, ss_xxy), (rr_yyy, ss_yyy) = spectrum(three[:, 1], 1, -1), spectrum(three[:, 3], 1, -1)
    tractions = [
        [-rr_xx - ss_yy, ss_xy - rr_xy, rz_x],
        [ss_xy - rr_xy, -rr_yy - ss_xx, rz_y],
        [-zr_x, -zr_y, t_zz],
    ]
    strains = [
        [-rr_xxx - ss_xyy, ss_xxy - rr_xxy, u_xx],
        [ss_xyy - rr_xyy, -rr_yyy - ss_xxy, u_yy],
        [ss_xxy - 2.0 * rr_xxy - ss_yyy, ss_xyy - 2.0 * rr_xyy - ss_xxx, 2.0 * u_xy],
    ]
    return tractions, strains


def _kernels_of_displacement(grid: Grid, images: SubsurfaceImages) -> Rows:
    """Spectra from (q_x, q_y, p) to the displacements (x, y, z) in cells of dx."""
    one, two = summed(grid, displacements, OF_DISPLACEMENTS, images)
    (rz_x, zr_x), (rz_y, zr_y) = spectrum(one[:, 0], -1, 1), spectrum(one[:, 1], 1, -1)
    (rr_xx, ss_xx, zz_xx), (rr_yy, ss_yy, zz_yy) = spectrum(two[:, 0], 1, 1), spectrum(two[:, 2], 1, 1)
    rr_xy, ss_xy, _ = spectrum(two[:, 1], -1, -1)
    return [
        [rr_xx + ss_yy, rr_xy - ss_xy, rz_x],
        [rr_xy - ss_xy, rr_yy + ss_xx, rz_y],
        [-zr_x, -zr_y, zz_xx + zz_yy],
    ]


def _stress(tractions: Array, strains: Array, nu: Array) -> Array:
    """(3, 3, nx, ny) from the tractions on a plane, (3, nx, ny), and the strains of ``_kernels_of_stress``, likewise."""
    out_x, out_y, out_z = -tractions
    xx, yy, twice_xy = strains
    plane, across = 2.0 / (1.0 - nu), nu / (1.0 - nu) * out_z
    rows = [
        [plane * (xx + nu * yy) + across, twice_xy, out_x],
        [twice_xy, plane * (yy + nu * xx) + across, out_y],
        [out_x, out_y, out_z],
    ]
    return jnp.stack([jnp.stack(row) for row in rows])
