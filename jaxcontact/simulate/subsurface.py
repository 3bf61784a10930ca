"""Stresses and displacements below the surface.

From the top: the public function ``subsurface``; ``Track``, the way of a moving contact, and the checks; and ``_fields``,
the compiled computation, with its kernels. The response below the surface by wavenumber is in ``response.interior``.
"""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.checks import Verdict
from jaxcontact._support.pytree import as_float64, is_concrete, pytree, replace, untupled
from jaxcontact.bodies.body import LayeredHalfSpace, check_bonded, checked_body
from jaxcontact.bodies.grid import Grid, check_grid
from jaxcontact.history.memory import Way, phase_and_loss
from jaxcontact.history.motion import as_array, check_along_x, check_shape_of_velocity, moves, ways
from jaxcontact.history.time_loop import fine_values
from jaxcontact.indenters.shapes import Indenter, checked_indenter
from jaxcontact.operators import spectral
from jaxcontact.operators.coupled import spectrum as padded_spectrum
from jaxcontact.response.interior import (
    OF_DISPLACEMENTS,
    OF_GRADIENTS,
    Lags,
    SubsurfaceImages,
    Transfer,
    depths_of_interfaces,
    displacements,
    gradients,
    kernels_at_lags,
    lags_before_the_last,
    line_displacements,
    line_gradients,
    of_uniform,
    poisson_at,
    sampled,
    subsurface_images,
    summed,
)
from jaxcontact.response.stack import creeps, solids, spectra
from jaxcontact.results.contact import InteriorFields

STEP = 0.25  # cells by which a load moves in an inner step, unless their number is given
# largest number of inner steps, and of cells along a grid that contains the track
MOST_STEPS, WIDEST = 20000, 4096

Margins = tuple[tuple[int, int], tuple[int, int]]  # cells beside a grid, before and behind it, along x and y
NO_MARGINS: Margins = ((0, 0), (0, 0))


def subsurface(
    body: LayeredHalfSpace,
    grid: Grid,
    pressure: Array,
    traction: Array | None = None,
    *,
    depths: Array,
    times: Array | None = None,
    velocity: Array | float | None = None,
    substeps: int | None = None,
    indenter: Indenter | None = None,
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

    With ``velocity`` the tractions move over the surface, and the fields are those in the frame of the load at the last
    time, as in ``deflection``: what was at x at the time t is at x - int_t^T v dt' in the end. The track is followed in
    inner steps; nothing of it is cut off where it leaves the grid.

    With ``indenter`` the fields are those in the indenter, under the pressure and the opposite traction. Its z points
    from the contact into the indenter, with x and y as they are: sigma_xz, sigma_yz and the displacement along z have the
    opposite sign in the axes of the body, in which sigma_iz is then continuous across the contact.

    The result is differentiable with respect to all numbers, depths included; at the surface and at an interface the
    derivative by depth is that below it.

    Args:
        body: a ``LayeredHalfSpace``. Without ``times`` the response is the instantaneous one.
        grid: a ``Grid``; along one periodic axis with several cells it is refused. On a grid that is periodic along both
            axes tractions are trigonometric polynomials, whose waves have the exact response, and displacement is relative
            to the mean of the surface (absolute on a rigid base).
        pressure: (nx, ny) [Pa], positive in compression, as in ``ContactHistory.pressure``; (nt, nx, ny) with times,
            where a single map that moves may also be given.
        traction: (2, nx, ny) [Pa] on the body, or (nt, 2, nx, ny), as in ``ShearHistory.traction``; None for zero.
        depths: (nz,) [m] >= 0, above a rigid base or at it, where stresses are those of the layer on it.
        times: (nt,) [s], as in ``indent``; the tractions are applied as a step at the first time. Viscoelastic materials
            must then be defined by ``nu`` and not by ``bulk_modulus``.
        velocity: of the load over the surface [m/s], with times: a number along x, (2,) or (nt, 2), linear between them;
            None for a load at rest.
        substeps: inner steps between two times, static, each of at most a cell; None: as many as it takes for moves of a
            quarter of a cell. Expected where the velocity is traced, in which case the grid has to hold the track.
        indenter: None, or an ``Indenter`` with a material, in which the fields are then, and not in the body.

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
    valid = valid & check_grid(grid)
    checks.require(
        grid.plane_strain or grid.periodic in ((False, False), (True, True)),
        "grid: expected one that is not periodic, one that is periodic along both axes, or plane strain, got"
        f" periodic={grid.periodic} with {tuple(grid.shape)} cells in subsurface",
    )

    # shapes and values of tractions, times and depths
    over_time: tuple[int, ...] = ()
    if times is not None:
        valid = valid & checks.not_decreasing("times [s]", times)
        over_time = np.shape(times)
    given_once = velocity is not None and np.shape(pressure) == tuple(grid.shape)
    valid = valid & _check_field("pressure", pressure, () if given_once else over_time, grid.shape)
    if traction is not None:
        given_once = velocity is not None and np.shape(traction) == (2, *grid.shape)
        valid = valid & _check_field("traction", traction, () if given_once else over_time, (2, *grid.shape))

    # the surface of the indenter, on which the traction is the opposite one
    if indenter is not None:
        valid = valid & checked_indenter(indenter, grid)[1]
        checks.require(
            indenter.material is not None,
            "indenter: expected one with a material, in which there are stresses, got a rigid one in subsurface",
        )
        body = indenter.surface() or LayeredHalfSpace([], indenter.material)
        body, _ = checked_body(body)
        traction = None if traction is None else -jnp.asarray(traction)
    if traction is not None:
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
    changing = [solid for solid in solids(body) if creeps(solid) and solid.bulk_modulus is not None]
    checks.require(
        times is None or not changing,
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

    described = grid  # whose numbers stay known inside jit
    body, grid, pressure, depths = as_float64((body, grid, pressure, depths))
    lead = () if times is None else np.shape(times)
    sideways = jnp.zeros((2, *grid.shape)) if traction is None else as_float64(traction)
    sideways = jnp.broadcast_to(sideways, (*lead, 2, *grid.shape))
    pressure = jnp.broadcast_to(pressure, (*lead, *grid.shape))
    tractions = jnp.concatenate([sideways, pressure[..., None, :, :]], -3)
    count, margins = 1, NO_MARGINS
    if velocity is not None:
        velocity = as_array(velocity)
        count, margins, within = _checked_motion(velocity, times, described, tractions, substeps)
        valid = valid & within
    if not is_concrete(valid):
        tractions = jnp.where(valid, tractions, jnp.nan)
    if times is None:
        return _announced(_fields(body, grid, tractions[None], depths, None))
    if not any(creeps(solid) for solid in solids(body)):
        return _announced(_fields(body, grid, tractions[-1:], depths, None))
    times = as_float64(times)
    if velocity is None or times.size == 1:
        changes = jnp.diff(tractions, axis=0, prepend=0.0)
        return _announced(_fields(body, grid, changes, depths, lags_before_the_last(times)))

    # the inner steps: their ends, the place of each among the times, and the way of the load from there to the last one
    ends = lambda values: jnp.append(values[:1], fine_values(values, count)[1:])
    left = lambda each: jnp.append(jnp.cumsum(each[1:].ravel()[::-1])[::-1], 0.0)
    move = moves(as_float64(velocity) / grid.spacing[0], times, count)
    way = Way(left(move.x), None if move.y is None else left(move.y))
    track = Track(way, ends(jnp.arange(1.0 * times.size)))
    wide = replace(grid, shape=tuple(n + sum(more) for n, more in zip(grid.shape, margins, strict=True)))
    tractions = jnp.pad(tractions, ((0, 0), (0, 0), *margins))
    found = _fields(
        body, wide, tractions, depths, lags_before_the_last(ends(times)), track, datum=grid.shape[0]
    )
    of_x, of_y = (slice(low, low + n) for (low, _), n in zip(margins, grid.shape, strict=True))
    stress, displacement = found.stress[..., of_x, of_y], found.displacement[..., of_x, of_y]
    return _announced(replace(found, grid=grid, stress=stress, displacement=displacement))


@pytree
class Track:
    """The way of a load from the end of each inner step to the last one [cells along x], (n,) each, and the place of each
    end among the times, their number and the share of the next step, (n,)."""

    way: Way
    place: Array

    def mixed(self, shares: Array, tractions: Array, grid: Grid) -> Array:
        """Return the spectra (M, 3, my/2 + 1, mx) of the changes of the tractions (nt, 3, nx, ny) in the inner steps, in the
        frame of the load at the last time and summed with the shares (n, M)."""
        mx, my = spectral.padded_shape(grid.shape, grid.periodic)
        ratio, last = grid.spacing[1] / grid.spacing[0], tractions.shape[0] - 2

        def add(
            carry: tuple[Array, Array], step: tuple[Array, Array, Way]
        ) -> tuple[tuple[Array, Array], None]:
            (total, before), (share, place, way) = carry, step
            i = jnp.clip(jnp.floor(jax.lax.stop_gradient(place)).astype(int), 0, last)
            field = tractions[i] + (place - i) * (tractions[i + 1] - tractions[i])
            phase, loss = phase_and_loss((mx, my), way, ratio)
            now = jnp.exp(jax.lax.complex(-loss, phase)) * spectral.transform(field, grid.periodic)
            return (total + share[:, None, None, None] * (now - before), now), None

        none = jnp.zeros((3, my // 2 + 1, mx), complex)
        start = jnp.broadcast_to(none, (shares.shape[1], *none.shape)), none
        return jax.lax.scan(add, start, (shares, self.place, self.way))[0][0]

    def sizes(self, tractions: Array) -> Array:
        """Return bounds on the changes in the inner steps, (n, 3): of the first one, a step, and of those that move."""
        moves = jnp.abs(jnp.diff(self.way.x)) + (0.0 if self.way.y is None else jnp.abs(jnp.diff(self.way.y)))
        share = jnp.append(1.0, jnp.minimum(moves + jnp.diff(self.place), 1.0))
        return share[:, None] * jnp.max(jnp.abs(tractions), (0, -1, -2))


def _checked_motion(
    velocity: Any, times: Any, grid: Grid, tractions: Array, substeps: int | None
) -> tuple[int, Margins, Verdict]:
    """Return the inner steps between two times, the cells that the track takes up beside the grid, and whether the values
    are in range: the inner steps, and a track that is traced, which has to lie on the grid."""
    # times and velocity, of which an unknown one cannot choose the number of inner steps
    checks.require(times is not None, "times: expected those of the motion with velocity=, got None")
    nt = np.shape(times)[0]
    valid = check_shape_of_velocity(velocity, nt) & check_along_x(np.shape(velocity), grid)
    valid = valid & checks.finite("velocity [m/s]", velocity)
    known = is_concrete(velocity, times, grid)
    checks.require(
        known or substeps is not None,
        "substeps: expected a number where velocity, times or grid are traced by jit, vmap or grad, got None",
    )

    # the inner steps, whose velocity is linear, and the places of the load at their ends before the last one [cells]
    numbers: Any = np if known else jnp
    start, end = ways(velocity, times, grid)
    fastest = numbers.max(numbers.maximum(numbers.abs(start), numbers.abs(end)), initial=0.0)
    if substeps is None:
        substeps = max(1, math.ceil(min(float(fastest) / STEP, 1e9) * (1.0 - 1e-12)))
        checks.require(
            substeps * nt <= MOST_STEPS,
            f"velocity: expected a track of at most {MOST_STEPS // 4} cells in all, got steps of {float(fastest):.4g} cells",
        )
    checks.whole("substeps", substeps, 1, MOST_STEPS)
    if known:
        needed = math.ceil(float(fastest) * (1.0 - 1e-12))
        checks.require(
            substeps >= needed,
            f"substeps: expected inner steps of at most a cell, {needed} or more of them, got {substeps}",
        )
    else:
        valid = valid & (fastest <= substeps * (1.0 + 1e-9))
    share = (numbers.arange(substeps) + 1.0)[:, None] / substeps
    way = start[:, None] * share + (end - start)[:, None] * share**2 / 2.0
    way = way + (numbers.cumsum(way[:, -1], 0) - way[:, -1])[:, None]
    places = numbers.concatenate([numbers.zeros((1, 2)), way.reshape(-1, 2)])
    behind = places[-1] - places

    # the cells that the load needs before and behind it, beyond those of the grid that are free
    margins, of_load = [], jnp.any(tractions != 0.0, (0, 1))
    for axis in range(2):
        low, high = numbers.max(behind[:, axis]), -numbers.min(behind[:, axis])
        if is_concrete(tractions) or not known:
            loaded = numbers.any(numbers.asarray(of_load), 1 - axis)
            low, high = low - numbers.argmax(loaded), high - numbers.argmax(loaded[::-1])
        if grid.periodic[axis]:
            margins.append((0, 0))
        elif known:
            margins.append((math.ceil(max(float(low), 0.0)), math.ceil(max(float(high), 0.0))))
        else:
            margins.append((0, 0))
            valid = valid & (numbers.maximum(low, high) <= 1e-9)
    widest = max(n + sum(more) for n, more in zip(grid.shape, margins, strict=True))
    checks.require(
        widest <= WIDEST,
        f"velocity: expected a track that fits on {WIDEST} cells, got {widest}: pass a later start or larger cells",
    )
    return substeps, tuple(margins), valid  # type: ignore[return-value]


def _announced(fields: InteriorFields) -> InteriorFields:
    """Return the fields, and issue their notes as warnings where the numbers are known."""
    for note in fields.notes if is_concrete(fields) else ():
        warnings.warn(note, stacklevel=3)
    return fields


def _check_field(name: str, field: Any, over_time: tuple[int, ...], own: tuple[int, ...]) -> Verdict:
    shape, other = (*over_time, *own), "" if over_time else ", or one for each time with times="
    checks.require(np.shape(field) == shape, f"{name}: expected shape {shape}{other}, got {np.shape(field)}")
    return checks.finite(f"{name} [Pa]", field)


@functools.partial(jax.jit, static_argnames="datum")
def _fields(
    body: LayeredHalfSpace,
    grid: Grid,
    changes: Array,
    depths: Array,
    lags: Lags | None,
    track: Track | None = None,
    datum: int | None = None,
) -> InteriorFields:
    """Return the interior fields from changes of (q_x, q_y, p), (nt, 3, nx, ny), and the lags since each; with a track from
    the tractions, and the lags since the ends of its inner steps. datum: of line loads [cells], or that of the grid."""

    # the changes mixed for the few lags that stand for all, and their sizes
    if track is None:
        mixed = lambda shares: spectral.transform(jnp.tensordot(shares, changes, (0, 0)), grid.periodic)
        sizes, mean = jnp.max(jnp.abs(changes), (-1, -2)), jnp.mean(changes, (-1, -2))
    else:
        mixed, sizes = lambda shares: track.mixed(shares, changes, grid), track.sizes(changes)
        means, place = jnp.mean(changes, (-1, -2)), track.place
        i = jnp.clip(jnp.floor(place).astype(int), 0, changes.shape[0] - 2)
        means = means[i] + (place - i)[:, None] * (means[i + 1] - means[i])
        mean = jnp.diff(means, axis=0, prepend=0.0)

    # on a periodic grid each wave for itself
    if all(grid.periodic):
        stress, displacement, error = jax.lax.map(
            lambda z: _of_waves(body, grid, mixed, mean, z, lags), depths
        )
        interfaces = depths_of_interfaces(body)
        return InteriorFields(
            grid, depths, stress, displacement, error, interfaces if interfaces.size else None
        )

    # elsewhere by influence coefficients of images, convolved with the tractions; a part of the stress follows from strains
    def at(z: Array) -> tuple[Array, Array, Array]:
        images = subsurface_images(body, z, lags)
        by_lag = mixed(images.shares)
        passed, strains = _kernels_of_stress(grid, images)
        apply = lambda kernels: spectral.inverse(
            jnp.stack([jnp.einsum("kmyx,mkyx->yx", jnp.stack(row), by_lag) for row in kernels]),
            grid.shape,
            grid.periodic,
        )
        stress = _stress(apply(passed), apply(strains), poisson_at(body, z))
        displacement = apply(_kernels_of_displacement(grid, images, datum)) * grid.spacing[0]
        return stress, displacement, images.error(jax.lax.stop_gradient(sizes))

    stress, displacement, error = jax.lax.map(at, depths)
    interfaces = depths_of_interfaces(body)
    return InteriorFields(grid, depths, stress, displacement, error, interfaces if interfaces.size else None)


def _of_waves(
    body: LayeredHalfSpace,
    grid: Grid,
    mixed: Callable[[Array], Array],
    mean: Array,
    z: Array,
    lags: Lags | None,
) -> tuple[Array, Array, Array]:
    """Return stress, displacement and error at a depth under tractions that are periodic along both axes; mixed: from the
    shares of lags to spectra; mean: of the changes, (nt, 3).

    Each wave of the grid has the transfer functions of ``response.interior`` at its wavevector, in the directions along it
    (r) and across (s), of cosines c and s. Waves of an odd factor that alternate from cell to cell have no sine on the grid.
    """
    (nx, ny), (dx, dy) = grid.shape, grid.spacing
    kx = 2.0 * jnp.pi * jnp.fft.fftfreq(nx)[None, :] / dx
    ky = 2.0 * jnp.pi * jnp.fft.rfftfreq(ny)[:, None] / dy
    at_zero = (kx == 0.0) & (ky == 0.0)
    alpha = jnp.sqrt(jnp.where(at_zero, 1.0, kx**2 + ky**2))
    recalled = kernels_at_lags(body, jnp.where(at_zero, 0.0, alpha).ravel(), z, lags)
    F = Transfer(*recalled.kernels.reshape(len(Transfer._fields), -1, *alpha.shape))
    q_x, q_y, p = jnp.moveaxis(mixed(recalled.shares), 1, 0)

    # the cosines; in odd powers those of waves that alternate from cell to cell are zero; any direction at wavenumber zero
    c, s = jnp.where(at_zero, 1.0, kx / alpha), jnp.where(at_zero, 0.0, ky / alpha)
    alternates = lambda n: (jnp.arange(n) == n // 2) & (n % 2 == 0)
    c1 = jnp.where(alternates(nx)[None, :], 0.0, c)
    s1 = jnp.where(alternates(ny)[: ny // 2 + 1, None], 0.0, s)
    cc, ss, cs = c**2, s**2, c1 * s1

    def plane(F_rr: Array, F_rz: Array, F_zr: Array, F_zz: Array, F_ss: Array) -> Array:
        """The components x, y and z of tractions or displacements, summed over the mixtures, (3, my, mx)."""
        x = (cc * F_rr + ss * F_ss) * q_x + cs * (F_rr - F_ss) * q_y + 1j * c1 * F_rz * p
        y = cs * (F_rr - F_ss) * q_x + (ss * F_rr + cc * F_ss) * q_y + 1j * s1 * F_rz * p
        z = -1j * F_zr * (c1 * q_x + s1 * q_y) + F_zz * p
        return jnp.sum(jnp.stack([x, y, z]), 1)

    # strains xx, yy and 2 xy times the modulus, i k u G
    rr, rz, tt = F.e_rr, F.e_rz, F.e_ss
    xx = -cc * rz * p + 1j * ((cc * c1 * rr + c1 * ss * tt) * q_x + cc * s1 * (rr - tt) * q_y)
    yy = -ss * rz * p + 1j * (c1 * ss * (rr - tt) * q_x + (ss * s1 * rr + cc * s1 * tt) * q_y)
    twice = -2.0 * cs * rz * p + 1j * (
        (2.0 * cc * s1 * rr - s1 * (cc - ss) * tt) * q_x + (2.0 * c1 * ss * rr + c1 * (cc - ss) * tt) * q_y
    )
    strains = jnp.where(at_zero, 0.0, jnp.sum(jnp.stack([xx, yy, twice]), 1))

    field = lambda spectra: spectral.inverse(spectra, grid.shape, grid.periodic)
    tractions = plane(F.t_rr, F.t_rz, F.t_zr, F.t_zz, F.t_ss)
    displacement = field(jnp.where(at_zero, 0.0, plane(F.u_rr, F.u_rz, F.u_zr, F.u_zz, F.u_ss) / alpha))
    if body.substrate is None:
        displacement = displacement + of_uniform(body, z, mean, lags)[:, None, None]
    stress = _stress(field(tractions), field(strains), poisson_at(body, z))

    # the error of the combination of lags, relative to the largest value of each function
    found = jnp.einsum("nm,fms->nfs", recalled.shares, recalled.kernels[..., sampled(alpha.size)])
    size = jnp.max(jnp.abs(recalled.exact), (0, 2))
    off = jnp.max(jnp.abs(found - recalled.exact), (0, 2)) / jnp.where(size > 0.0, size, 1.0)
    return stress, displacement, jax.lax.stop_gradient(jnp.max(off))


Rows = list[list[Array]]


def _kernels_of_stress(grid: Grid, images: SubsurfaceImages) -> tuple[Rows, Rows]:
    """Spectra (M, my/2 + 1, mx) from (q_x, q_y, p) to the tractions (x, y, z), and to the strains xx, yy and 2 xy times
    the modulus, at a depth."""
    of_kinds = line_gradients if grid.plane_strain else gradients
    zero, one, two, three = summed(grid, of_kinds, OF_GRADIENTS, images)
    spectrum = functools.partial(padded_spectrum, periodic=grid.periodic)
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


def _kernels_of_displacement(grid: Grid, images: SubsurfaceImages, datum: int | None) -> Rows:
    """Spectra from (q_x, q_y, p) to the displacements (x, y, z) in cells of dx."""
    of_kinds = functools.partial(line_displacements, datum=datum) if grid.plane_strain else displacements
    one, two = summed(grid, of_kinds, OF_DISPLACEMENTS, images)
    spectrum = functools.partial(padded_spectrum, periodic=grid.periodic)
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
