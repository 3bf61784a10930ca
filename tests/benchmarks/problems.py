"""The problems that are measured, by name: each makes a run of a grid of n x n cells and a number of steps."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import jaxcontact as jc
from tests.support.bodies import BALL, BODY, FILM, STEEL

ON_STEEL = jc.LayeredHalfSpace([], STEEL)
WIDTH = 600e-6
PASS_SPEED, PASS_STEP = 1611e-6, 0.005  # of the paper's Fig. 15: a pixel of 8.0551 um in each step


@dataclass(frozen=True)
class Problem:
    """run: one whole run, to be called again and again; steps: in it, to share its cost among."""

    run: Callable[[], Any]
    steps: int = 1


def at_once(body: jc.LayeredHalfSpace, indenter: Any, load: float, grid: jc.Grid) -> Problem:
    """A contact without history."""
    return Problem(lambda: jc.indent(body, indenter, jc.Load(load), np.zeros(1), grid=grid))


def hertz(n: int, steps: int) -> Problem:
    """A steel ball on steel."""
    return at_once(ON_STEEL, BALL, 60.0, jc.Grid.square(n, WIDTH))


def coated(n: int, steps: int) -> Problem:
    """The first contact of the film."""
    return at_once(BODY, BALL, 60.0, jc.Grid.square(n, WIDTH))


def rough(load: float) -> Callable[[int, int], Problem]:
    """A self-affine surface on a half-space, waves of 8 cells and more."""

    def problem(n: int, steps: int) -> Problem:
        grid = jc.Grid(shape=(n, n), spacing=(1e-6, 1e-6), periodic=True)
        heights = jc.self_affine(grid, hurst=0.8, rms_slope=0.1, shortest=8e-6, longest=n / 4 * 1e-6, seed=0)
        body = jc.LayeredHalfSpace([], jc.Elastic(G=0.25e9, nu=0.5))
        alone = jc.Grid(grid.shape, grid.spacing)
        return at_once(body, jc.HeightField(heights), load * 1e8 * (n * 1e-6) ** 2, alone)

    return problem


def film(n: int, steps: int) -> Problem:
    """Two hours of creep (the paper's Table 4)."""
    times, grid = jnp.linspace(0.0, 7200.0, steps + 1), jc.Grid.square(n, WIDTH)
    return Problem(lambda: jc.indent(BODY, BALL, jc.Load(60.0), times, grid=grid, save="last"), steps)


def patchy(n: int) -> jax.Array:
    """The thickness of the film in patches and with bare steel between them [m], (n, n)."""
    heights = jc.self_affine(
        jc.Grid.square(n, WIDTH), hurst=0.8, rms_slope=1.0, shortest=16 * WIDTH / n, longest=WIDTH / 2, seed=3
    )
    return 150e-9 * jnp.clip(0.5 + heights / (2.0 * jnp.std(heights)), 0.0, 2.0)


def varying(n: int, steps: int) -> Problem:
    """As ``film``, in patches that stay as they are."""
    times, grid = jnp.linspace(0.0, 7200.0, steps + 1), jc.Grid.square(n, WIDTH)
    body = jc.LayeredHalfSpace([jc.Layer(FILM, patchy(n))], STEEL)
    return Problem(lambda: jc.indent(body, BALL, jc.Load(60.0), times, grid=grid, save="last"), steps)


def rubbed(n: int, steps: int) -> Problem:
    """As ``varying``, with patches that grow by shear stress and are removed."""
    times, grid = jnp.linspace(0.0, 7200.0, steps + 1), jc.Grid.square(n, WIDTH)
    body = jc.LayeredHalfSpace([jc.Layer(FILM, patchy(n))], STEEL)
    law = jc.StressActivated(1e-4, 8e-20, 4e-29, 373.0, stress="shear") + jc.ProportionalRemoval(2e-4)
    return Problem(
        lambda: jc.rub(
            body, BALL, jc.Load(60.0), times, velocity=0.1, friction=0.1, law=law, grid=grid, save="last"
        ),
        steps,
    )


def rubbed_rough(n: int, steps: int) -> Problem:
    """A rough steel surface, waves of 8 cells and more, on patches that grow by shear stress and are removed; 2 s a step."""
    grid = jc.Grid((n, n), (4e-6, 4e-6), periodic=True)
    given = {"hurst": 0.8, "shortest": 32e-6, "longest": n * 2e-6}
    heights = jc.self_affine(grid, rms_slope=0.005, seed=1, **given)
    patches = jnp.clip(50.0 * jc.self_affine(grid, rms_slope=1e-5, seed=2, **given), 0.0, 150e-9)
    body = jc.LayeredHalfSpace([jc.Layer(FILM, patches)], STEEL)
    law = jc.StressActivated(1e-4, 8e-20, 4e-29, 373.0, stress="shear") + jc.ProportionalRemoval(2e-3)
    times, load = 2.0 * jnp.arange(steps + 1), 12.0 * (n / 128) ** 2
    return Problem(
        lambda: jc.rub(
            body, jc.HeightField(heights, STEEL), jc.Load(load), times, velocity=0.1, friction=0.1, law=law, grid=grid,
            save="last", thickest=500e-9,
        ),
        steps,
    )  # fmt: skip


def peak_of(n: int, steps: int) -> Callable[[Any], jax.Array]:
    times, grid = jnp.linspace(0.0, 7200.0, steps + 1), jc.Grid.square(n, WIDTH)
    return lambda case: jnp.max(jc.indent(*case, times, grid=grid, save="last").pressure) / 1e9


CASE = jax.tree.map(lambda a: jnp.asarray(a, float), (BODY, BALL, jc.Load(60.0)))


def traced(n: int, steps: int) -> Problem:
    """The film in one program of the user's, kernels included: what the gradients are held against."""
    forward = jax.jit(peak_of(n, steps))
    return Problem(lambda: forward(CASE), steps)


def reverse(n: int, steps: int) -> Problem:
    """The last peak pressure by every leaf of body, indenter and control, the forward run included."""
    gradient = jax.jit(jax.grad(peak_of(n, steps)))
    return Problem(lambda: gradient(CASE), steps)


def tangents(n: int, steps: int) -> Problem:
    """The same by G1, G2, eta1 and eta2, forward."""
    peak = peak_of(n, steps)

    def along(moduli: jax.Array) -> jax.Array:
        layer = jc.Layer(jc.Burgers(*moduli, FILM.nu), BODY.layers[0].thickness)
        return peak((jc.LayeredHalfSpace([layer], STEEL), *CASE[1:]))

    forward = jax.jit(jax.jacfwd(along))
    moduli = jnp.array([FILM.G1, FILM.G2, FILM.eta1, FILM.eta2])
    return Problem(lambda: forward(moduli), steps)


def slide(n: int, steps: int) -> Problem:
    """A pass over the film, a pixel in each step, decay rates of one node a band (as good as two for this film)."""
    grid, times = jc.Grid.square(n, n * PASS_SPEED * PASS_STEP), jnp.arange(steps + 1) * PASS_STEP
    kernels = jc.kernels(BODY, BALL, grid, nodes=1)
    return Problem(
        lambda: jc.slide(
            BODY, BALL, jc.Load(60.0), times, velocity=PASS_SPEED, grid=grid,
            tolerance=1e-6, save="last", kernels=kernels,
        ),
        steps,
    )  # fmt: skip


def shear(n: int, steps: int) -> Problem:
    """Fretting of a ball on steel, one cycle, coupled."""
    phase = np.linspace(0.0, 2.0 * np.pi, steps + 1)
    cycle = jc.TangentialLoad(np.stack([8.0 * np.sin(phase), 0.0 * phase], 1))
    grid = jc.Grid.square(n, 400e-6)
    return Problem(
        lambda: jc.shear(
            ON_STEEL, jc.Sphere(10e-3), jc.Load(40.0), cycle, phase, friction=0.3, grid=grid,
            save="last", tolerance=1e-6,
        ),
        steps,
    )  # fmt: skip


PROBLEMS: dict[str, Callable[[int, int], Problem]] = {
    "hertz": hertz,
    "coated": coated,
    "rough, a tenth in contact": rough(0.05),
    "rough, a third in contact": rough(0.2),
    "film": film,
    "film, one program": traced,
    "film, reverse gradient": reverse,
    "film, four tangents": tangents,
    "film, varying thickness": varying,
    "film, rubbed": rubbed,
    "rough film, rubbed": rubbed_rough,
    "slide": slide,
    "shear": shear,
}
COUNTED = (
    "hertz",
    "coated",
    "rough, a tenth in contact",
    "rough, a third in contact",
    "film",
    "film, varying thickness",
    "film, rubbed",
    "slide",
    "shear",
)
warnings.simplefilter("ignore")
