"""The image that an instrument records of the fields of a contact: blurred, shifted and rotated, at its own pixels.

A pixel at x in the image shows the place X = R(-angle) (x - shift) of the contact, R the rotation by an angle about the
origin of the model's grid: the model's origin is seen at ``shift``, and its x axis at ``angle``. A blurred field is

    f * N(0, w^2 + h^2/12 - H^2/12),

w the standard deviation of the instrument's blur, h the pixel, which averages over its area, and H the cell of the model
where its values are averages over cells, as those of the pressure are. The convolution is exact for the trigonometric
polynomial of the field continued evenly beyond its grid; values between cells follow by cubic convolution (R. G. Keys,
IEEE Trans. Acoust. Speech Signal Process. 29 (1981) 1153).

A pixel of a contact image is read as "in contact" with the probability

    P = e + (1 - 2 e) Phi(d/s),

d the signed distance to the edge of contact (positive inside), s the width of the transition and e the share of misread
pixels. Near the edge pressure rises as the root of the distance and the gap as its power 3/2 (K. L. Johnson, Contact
Mechanics, 1985, sec. 4.2), so that p^2/a - g^(2/3)/b is a signed distance, with a and b the slopes of p^2 and g^(2/3) at
the edge. On a grid its zero lies up to a tenth of a cell beside the edge; a constant is therefore added to d for which the
area of contact is ``smooth_area``, whose edge is accurate to a hundredth of a cell. An instrument that blurs the image
before it decides sees the level 1/2 of the blurred coverage.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from jaxcontact import Grid

NEAR = 0.1  # share of the largest p^2 and g^(2/3) over which the weights of the slopes at the edge decay
SOFT = 0.5  # transition of the coverage of a cell, in cells
FAR = 1e-6  # coverage beyond which the distance is not taken from it
LEAST = 1e-30
SHIFTS = "shift_x", "shift_y"
NEWTON = 3  # iterations for the constant that is added to the distance


class View(NamedTuple):
    """Nuisance parameters: shift (2,) [m], angle [rad], blur [m], width s [m], errors e."""

    shift: Array
    angle: Array
    blur: Array
    width: Array
    errors: Array

    def moved(self, values: dict[str, Array]) -> "View":
        """Return the view with other values () of some parameters, of which shift_x and shift_y are two."""
        shift = jnp.stack([values.get(name, own) for name, own in zip(SHIFTS, self.shift, strict=True)])
        return self._replace(shift=shift, **{name: v for name, v in values.items() if name not in SHIFTS})

    def part(self, name: str) -> Array:
        """Return the value () of a parameter."""
        return self.shift[SHIFTS.index(name)] if name in SHIFTS else jnp.asarray(getattr(self, name))


def pixels(grid: Grid, view: View) -> tuple[Array, Array]:
    """Return the places X and Y [m] in the contact, (nx, ny), that the pixels of a grid show."""
    x, y = grid.coordinates()
    x, y = x - view.shift[0], y - view.shift[1]
    c, s = jnp.cos(view.angle), jnp.sin(view.angle)
    return c * x + s * y, c * y - s * x


def observed(name: str, fields: dict[str, Array], model: Grid, image: Grid, view: View) -> Array:
    """Return what a field of the model, (nt, nx, ny) on its grid, looks like in the pixels of the image."""
    pixel = (image.spacing[0] ** 2 / 12.0, image.spacing[1] ** 2 / 12.0)
    at = pixels(image, view)
    if name == "contact":
        distance = jax.vmap(functools.partial(signed_distance, model=model))(
            fields["pressure"], fields["gap"]
        )
        distance = jax.vmap(functools.partial(with_area, grid=model))(distance, fields["smooth_area"])
        seen = jax.vmap(lambda d: sampled(_blurred_edge(d, model, view.blur), model, *at))(distance)
        return view.errors + (1.0 - 2.0 * view.errors) * jax.scipy.stats.norm.cdf(seen / view.width)
    cell = [d**2 / 12.0 if name == "pressure" else 0.0 for d in model.spacing]
    variance = [view.blur**2 + own - less for own, less in zip(pixel, cell, strict=True)]
    return jax.vmap(lambda f: sampled(blurred(f, model, *variance), model, *at))(fields[name])


def blurred(field: Array, grid: Grid, along_x: Array, along_y: Array) -> Array:
    """Return a field (nx, ny) convolved with a Gaussian of these variances [m^2], which may be slightly negative."""
    nx, ny = field.shape
    even = jnp.concatenate([field, field[::-1]], 0)
    even = jnp.concatenate([even, even[:, ::-1]], 1)
    kx = 2.0 * jnp.pi * jnp.fft.fftfreq(2 * nx, 1.0)[:, None] / grid.spacing[0]
    ky = 2.0 * jnp.pi * jnp.fft.rfftfreq(2 * ny, 1.0)[None, :] / grid.spacing[1]
    factor = jnp.exp(-0.5 * (along_x * kx**2 + along_y * ky**2))
    return jnp.fft.irfft2(factor * jnp.fft.rfft2(even), s=even.shape)[:nx, :ny]


def sampled(field: Array, grid: Grid, x: Array, y: Array) -> Array:
    """Return a field (nx, ny) at places x, y [m] of any shape by cubic convolution, constant beyond the grid."""
    (i, u), (j, v) = (
        _split(place / d + (n - 1) / 2.0, n)
        for place, d, n in zip((x, y), grid.spacing, field.shape, strict=True)
    )
    rows = [sum(w * field[i + a, j + b] for b, w in _keys(v)) for a, _ in _keys(u)]
    return jnp.asarray(sum(w * row for (_, w), row in zip(_keys(u), rows, strict=True)))


def _split(place: Array, n: int) -> tuple[Array, Array]:
    """Return the cell below a place in cells, with one below and two above it in the grid, and the rest."""
    place = jnp.clip(place, 1.0, n - 2.0 - 1e-9)
    below = jnp.floor(jax.lax.stop_gradient(place)).astype(int)
    return below, place - below


def _keys(t: Array) -> list[tuple[int, Array]]:
    """Return the weights of the cells -1, 0, 1 and 2 for a place t after the cell 0."""
    return [
        (-1, 0.5 * t * (-1.0 + t * (2.0 - t))),
        (0, 1.0 + 0.5 * t**2 * (3.0 * t - 5.0)),
        (1, 0.5 * t * (1.0 + t * (4.0 - 3.0 * t))),
        (2, 0.5 * t**2 * (t - 1.0)),
    ]


def signed_distance(pressure: Array, gap: Array, model: Grid) -> Array:
    """Return the distance [m] to the edge of contact, (nx, ny), positive inside; exact to first order near the edge."""
    inside, outside = (pressure / _most(pressure)) ** 2, _power(gap / _most(gap))
    return inside / _edge_slope(inside, model) - outside / _edge_slope(outside, model)


def with_area(distance: Array, area: Array, grid: Grid) -> Array:
    """Return the signed distance (nx, ny) plus the constant for which the area of contact [m^2] is ``area``, ()."""
    soft = SOFT * grid.spacing[0]
    change = jnp.zeros(())
    for _ in range(NEWTON):
        at = (distance + change) / soft
        excess = jnp.sum(jax.scipy.stats.norm.cdf(at)) * grid.cell_area - area
        slope = jnp.sum(jax.scipy.stats.norm.pdf(at)) * grid.cell_area / soft
        change = change - jnp.clip(excess / jnp.maximum(slope, LEAST), -soft, soft)
    return distance + change


def _most(field: Array) -> Array:
    return jnp.maximum(jnp.max(field), LEAST)


def _power(gap: Array) -> Array:
    """Return gap^(2/3), with derivative zero in contact."""
    open_ = gap > 1e-12
    return jnp.where(open_, jnp.where(open_, gap, 1.0) ** (2.0 / 3.0), 0.0)


def _edge_slope(field: Array, grid: Grid) -> Array:
    """Return the mean slope [1/m] of a field that is zero on one side of an edge, where it is small but not zero."""
    along_x = (field[2:, 1:-1] - field[:-2, 1:-1]) / (2.0 * grid.spacing[0])
    along_y = (field[1:-1, 2:] - field[1:-1, :-2]) / (2.0 * grid.spacing[1])
    inner = field[1:-1, 1:-1]
    square = along_x**2 + along_y**2
    weight = jnp.where(inner > 0.0, jnp.exp(-inner / NEAR), 0.0)
    root = jnp.sqrt(jnp.sum(weight * square) / jnp.maximum(jnp.sum(weight), LEAST) + LEAST)
    return jnp.maximum(root, 1e-3 / (grid.spacing[0] * grid.shape[0]))


def _blurred_edge(distance: Array, model: Grid, blur: Array) -> Array:
    """Return the signed distance to the level 1/2 of the blurred coverage, (nx, ny)."""
    soft = SOFT * model.spacing[0]
    whole = jnp.sqrt(soft**2 + blur**2)
    covered = blurred(jax.scipy.stats.norm.cdf(distance / soft), model, blur**2, blur**2)
    known = (covered > FAR) & (covered < 1.0 - FAR)
    level = whole * jax.scipy.stats.norm.ppf(jnp.where(known, covered, 0.5))
    return jnp.where(known, level, distance)
