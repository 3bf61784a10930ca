"""Every kind of operator against a dense matrix, summed in numpy from kernels at the offsets of all pairs of cells."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tolerances import ROUND_OFF

from jaxcontact.operators import spectral
from jaxcontact.operators.coupled import spectrum
from jaxcontact.operators.operator import FLOOR, Family, Operator, series_entries

SHAPE, RNG = (8, 7), np.random.default_rng(3)
GRIDS = {"free": (False, False), "strip": (False, True), "periodic": (True, True)}
I, J = (np.arange(n)[:, None] - np.arange(n) for n in SHAPE)
# offsets of all pairs of cells, (nx, 1, nx, 1) and (1, ny, 1, ny)
I, J = (
    I[:, None, :, None],
    J[None, :, None, :],
)
MEMBERS, TERMS = 3, 3
WEIGHTS = np.array([0.3, 1.2, -0.4])


def images(values, periodic):
    """A kernel as a function of integer offsets; of the sum over its images along periodic axes, which are summed here."""

    def at(i, j):
        total = np.zeros(np.broadcast_shapes(i.shape, j.shape))
        for a in range(-40, 41) if periodic[0] else (0,):
            for b in range(-40, 41) if periodic[1] else (0,):
                total = total + values(i + a * SHAPE[0], j + b * SHAPE[1])
        return total

    return at


@functools.cache  # so that sums over its images are made once
def even(k):
    """The k-th kernel: falls fast, even in both offsets."""
    return lambda i, j: (1.0 + 0.5 * k) * np.exp(-((0.35 + 0.1 * k) * np.hypot(i, (1.0 + 0.3 * k) * j)))


@functools.cache
def odd(k):
    """The k-th kernel that is odd along x and even along y."""
    return lambda i, j: 0.4 * i * np.exp(-(0.6 + 0.1 * k) * np.hypot(i, j))


@functools.cache
def whole(kernel, periodic):
    """The kernel between all pairs of cells, as a matrix."""
    n = SHAPE[0] * SHAPE[1]
    return images(kernel, periodic)(I, J).reshape(n, n)


@functools.cache
def corner(kernel, periodic):
    """The kernel at offsets (i, j) >= 0, (nx, ny)."""
    return jnp.asarray(images(kernel, periodic)(np.arange(SHAPE[0])[:, None], np.arange(SHAPE[1])[None, :]))


@functools.cache
def spectrum_of_odd(k, periodic):
    """The spectrum of an odd kernel; along a periodic axis the kernel of a period has all offsets."""
    if any(periodic):
        i, j = (np.arange(n) for n in spectral.padded_shape(SHAPE, periodic))
        wrapped = lambda at, n, wraps: (
            at if wraps else np.where(at < n, at, np.where(at > len(at) - n, at - len(at), 10**6))
        )
        i, j = (wrapped(at, n, wraps) for at, n, wraps in zip((i, j), SHAPE, periodic, strict=True))
        return spectral.transform(jnp.asarray(images(odd(k), periodic)(i[:, None], j[None, :])), (True, True))
    return spectrum(corner(odd(k), periodic), -1, 1)


@functools.cache
def family(periodic):
    return Family.of(jnp.stack([corner(even(k), periodic) for k in range(MEMBERS)]), periodic)


def resting(periodic):
    """One even kernel, mixed of three."""
    return family(periodic).combined(list(WEIGHTS)), sum(
        w * whole(even(k), periodic) for k, w in enumerate(WEIGHTS)
    )


def moving(periodic):
    """A kernel with an odd part."""
    at_rest, _ = resting(periodic)
    spectra = (at_rest.spectra[0] + spectrum_of_odd(0, periodic))[None]
    operator = Operator(spectra, at_rest.circulant.astype(complex), periodic=periodic)
    return operator, resting(periodic)[1] + whole(odd(0), periodic)


def rubbing(periodic):
    """A kernel and another one behind a coefficient of friction that varies."""
    operator, matrix = moving(periodic)
    mu = RNG.random(SHAPE)
    spectra = jnp.concatenate([operator.spectra, spectrum_of_odd(1, periodic)[None]])
    rubbed = Operator(
        spectra, operator.circulant, jnp.asarray(mu)[None], periodic=periodic, entries=((0, 0, 0), (0, 1, 1))
    )
    return rubbed, matrix + whole(odd(1), periodic) * mu.ravel()


def series(matrices, weights):
    """The symmetric product of matrices and functions of the place, f_0 = 1."""
    total = matrices[0].copy()
    for matrix, f in zip(matrices[1:], weights.reshape(len(weights), -1), strict=True):
        total += (f[:, None] * matrix + matrix * f) / 2.0
    return total


def varying(periodic):
    """A series in functions of the place; where all is periodic, of the fields of zero mean, with the lift by a mean."""
    weights, n = RNG.normal(size=(TERMS - 1, *SHAPE)), SHAPE[0] * SHAPE[1]
    halves = np.array([1.0, 0.5, 0.5])[:, None, None]
    made, lift = family(periodic), None
    matrix = series([whole(even(k), periodic) for k in range(TERMS)], weights)
    if all(periodic):
        lift = RNG.normal(size=SHAPE)
        less_mean, ones = np.eye(n) - 1.0 / n, np.ones(n) / n
        matrix = less_mean @ matrix @ less_mean + np.outer(lift.ravel(), ones) + np.outer(ones, lift.ravel())
        lift = jnp.asarray(lift)
    operator = Operator(
        halves * made.spectrum,
        made.circulant[0],
        jnp.asarray(weights),
        lift,
        periodic=periodic,
        entries=series_entries(TERMS),
    )
    return operator, matrix


def moving_varying(periodic):
    """The same of kernels with odd parts."""
    weights, made = RNG.normal(size=(TERMS - 1, *SHAPE)), family(periodic)
    halves = np.array([1.0, 0.5, 0.5])[:, None, None]
    spectra = jnp.stack([made.spectrum[k] + spectrum_of_odd(k, periodic) for k in range(TERMS)])
    matrices = [whole(even(k), periodic) + whole(odd(k), periodic) for k in range(TERMS)]
    circulant = made.circulant[0].astype(complex)
    entries = series_entries(TERMS)
    operator = Operator(halves * spectra, circulant, jnp.asarray(weights), periodic=periodic, entries=entries)
    return operator, series(matrices, weights)


KINDS = {
    "at rest": resting,
    "in motion": moving,
    "friction that varies": rubbing,
    "film that varies": varying,
    "film that varies, in motion": moving_varying,
}
CASES = [
    (kind, grid)
    for kind in KINDS
    for grid in GRIDS
    if not (grid == "periodic" and kind == "film that varies, in motion")
]


@pytest.fixture(params=CASES, ids=lambda case: ", ".join(case))
def case(request):
    kind, grid = request.param
    return *KINDS[kind](GRIDS[grid]), kind


FIELDS = RNG.normal(size=(3, *SHAPE))


def applied(linear):
    """Random fields under a linear map, as columns."""
    return np.stack([np.asarray(linear(jnp.asarray(field))).ravel() for field in FIELDS], 1)


def assert_is(linear, matrix):
    """A linear map of fields is that of a matrix."""
    expected = matrix @ FIELDS.reshape(len(FIELDS), -1).T
    np.testing.assert_allclose(applied(linear), expected, atol=ROUND_OFF * np.abs(expected).max())


def test_product(case):
    operator, matrix, _ = case
    assert_is(operator, matrix)


def test_transpose(case):
    operator, matrix, _ = case
    assert_is(operator.transpose(), matrix.T)
    np.testing.assert_array_equal(applied(operator.transpose().transpose()), applied(operator))


def test_symmetry_is_known_from_the_structure_and_real_spectra_stay_real(case):
    operator, matrix, kind = case
    assert operator.symmetric == (kind in ("at rest", "film that varies")) == np.allclose(matrix, matrix.T)
    assert jnp.iscomplexobj(operator.spectra) != operator.symmetric
    assert operator.transpose().spectra.dtype == operator.spectra.dtype


def test_tangent(case):
    """Against central differences of the dense products, of all leaves at once."""
    operator, _, _ = case
    pressure = jnp.asarray(RNG.normal(size=SHAPE))
    drawn = lambda a: (
        RNG.normal(size=a.shape) + (1j * RNG.normal(size=a.shape) if jnp.iscomplexobj(a) else 0.0)
    )
    change = jax.tree.map(lambda a: jnp.asarray(drawn(a)), operator)
    step = 1e-6
    moved = lambda sign: jax.tree.map(lambda a, d: a + sign * step * d, operator, change)(pressure)
    expected = (np.asarray(moved(1.0)) - np.asarray(moved(-1.0))) / (2.0 * step)
    found = np.asarray(operator.tangent(change, pressure))
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())
    along = jax.jvp(lambda operator: operator(pressure), (operator,), (change,))[1]
    np.testing.assert_allclose(found, along, atol=ROUND_OFF * np.abs(expected).max())


def test_preconditioner(case):
    """The inverse of the circulant, small and negative real parts raised; with the wide one, of a larger grid."""
    operator, _, _ = case
    circulant = np.asarray(operator.circulant if operator.wide is None else operator.wide)
    shape = spectral.wide_shape(SHAPE, operator.periodic) if operator.wide is not None else SHAPE
    floor = FLOOR * np.abs(circulant).mean()
    inverse = 1.0 / (np.maximum(circulant.real, floor) + 1j * circulant.imag)
    field = RNG.normal(size=SHAPE)
    padded = np.zeros(shape)
    padded[: SHAPE[0], : SHAPE[1]] = field
    waves = np.fft.fft(np.fft.rfft(padded, axis=1).T, axis=1)
    expected = np.fft.irfft(np.fft.ifft(inverse * waves, axis=1).T, n=shape[1], axis=1)[
        : SHAPE[0], : SHAPE[1]
    ]
    found = np.asarray(operator.preconditioner()(jnp.asarray(field)))
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


def test_even_parts(case):
    """``even`` is that of the kernels whose weights are on both sides; ``plus_even`` adds a share of it."""
    operator, matrix, kind = case
    even_part = (matrix + matrix.T) / 2.0
    if kind == "friction that varies":
        even_part = resting(operator.periodic)[1]
    assert operator.even().symmetric
    assert_is(operator.even(), even_part)
    assert_is(operator.plus_even(0.7), matrix + 0.7 * even_part)
    if kind == "in motion":
        assert_is(operator.uniform(), even_part)


@pytest.mark.parametrize("grid", GRIDS)
def test_mixtures_and_sums_of_a_family(grid):
    """A family with weights: its mixture, and the sum over fields of its last members."""
    periodic = GRIDS[grid]
    weights = RNG.normal(size=(1, *SHAPE))
    made = family(periodic)
    spectra = jnp.stack([made.spectra[:, 0], made.spectra[::-1, 0] / 2.0], 1)
    several = Family(
        spectra,
        jnp.stack([made.circulant] * 2, 1),
        jnp.asarray(weights),
        None,
        periodic=periodic,
        entries=series_entries(2),
    )
    each = [
        series([whole(even(k), periodic), whole(even(MEMBERS - 1 - k), periodic)], weights)
        for k in range(MEMBERS)
    ]
    expected = sum(w * matrix for w, matrix in zip(WEIGHTS, each, strict=True))
    assert_is(several.combined(list(WEIGHTS)), expected)
    fields = RNG.normal(size=(2, *SHAPE))
    total = sum(matrix @ field.ravel() for matrix, field in zip(each[1:], fields, strict=True)).reshape(SHAPE)
    np.testing.assert_allclose(
        several.superposed(jnp.asarray(fields)), total, atol=ROUND_OFF * np.abs(total).max()
    )
    np.testing.assert_array_equal(several.superposed(jnp.zeros((0, *SHAPE))), np.zeros(SHAPE))


def test_the_window_has_the_weights_of_its_place():
    shape = (72, 20)
    kernel = lambda i, j: np.exp(-0.5 * np.hypot(i, j))
    at, weights = kernel(np.arange(72)[:, None], np.arange(20)[None, :]), RNG.normal(size=(1, *shape))
    values = RNG.normal(size=shape)

    @jax.jit
    def part_and_whole():
        made = Family.of(jnp.asarray(at)[None])
        window = Family(made.window.spectra / 2.0, made.window.circulants)
        two = lambda f: Family(
            jnp.concatenate([2.0 * f.spectra, f.spectra], 1),
            jnp.concatenate([f.circulants] * 2, 1),
            entries=series_entries(2),
        )
        whole_grid = Family(
            jnp.concatenate([made.spectra, made.spectra / 2.0], 1),
            jnp.concatenate([made.circulants] * 2, 1),
            jnp.asarray(weights),
            window=two(window),
            entries=series_entries(2),
        ).combined([1.0])
        nx, ny = whole_grid.window_shape(shape)
        assert nx < 72 and ny < 20
        part, inside = whole_grid.restricted((jnp.asarray(3), jnp.asarray(2))), jnp.asarray(values[:nx, :ny])
        outer = whole_grid(jnp.zeros(shape).at[3 : 3 + nx, 2 : 2 + ny].set(inside))
        return part(inside), outer[3 : 3 + nx, 2 : 2 + ny]

    inner, outer = part_and_whole()
    np.testing.assert_allclose(inner, outer, atol=ROUND_OFF * float(jnp.abs(outer).max()))
