"""The paper's Table 4: a steel ball on a viscoelastic tribofilm on steel.

The choice J = 2 phi: the paper's Eq. (14) fits phi(t) = 1/1.5 + (1 - exp(-0.02778 t/241.8))/0.02778 + t/6297.2
[1/GPa, t in s] and substitutes it, after Johnson, for 1/(2G). A shear creep compliance replaces
1/G, so J = 2 phi: every modulus and viscosity of Eq. (14) is halved here. Only then are the paper's own
figures reproduced: the approach of the film as a half-space under 60 N is 36.130 um with J = 2 phi (the paper prints
36.1380) and 22.90 um with J = phi.
"""

import warnings
from functools import lru_cache
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

import jaxcontact as jc

# An indentation run reduced to the data that figures need: the middle row of the fields, and scalars over time.


class Trace(NamedTuple):
    """A contact over time, along the middle row of cells.

    times (nt,) [s]; x (n,) and y [m] of that row; pressure [Pa] and displacement [m] along it, (nt, n); peak
    [Pa] of the whole field, approach [m], load [N], radius [m], strain, status: (nt,).
    """

    times: np.ndarray
    x: np.ndarray
    y: float
    pressure: np.ndarray
    displacement: np.ndarray
    peak: np.ndarray
    approach: np.ndarray
    load: np.ndarray
    radius: np.ndarray
    strain: np.ndarray
    status: np.ndarray

    @property
    def distance(self) -> np.ndarray:
        """The distance r (n,) [m] of the middle row's cells from the axis."""
        return np.hypot(self.x, self.y)

    @property
    def converged(self) -> bool:
        """True if every step converged, within the grid and with enough cells."""
        return bool(np.all(self.status == 0))


def press(body: Any, ball: Any, control: Any, times: Any, grid: jc.Grid) -> Trace:
    """Run ``jc.indent`` and reduce the fields; the film strain is reported in the table instead of a warning."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="film strain")
        history = jc.indent(body, ball, control, times, grid=grid)
    x, y = (np.asarray(axis) for axis in grid.axes())
    middle = len(y) // 2
    return Trace(
        times=np.asarray(history.times),
        x=x,
        y=float(y[middle]),
        pressure=np.asarray(history.pressure[:, :, middle]),
        displacement=np.asarray(history.displacement[:, :, middle]),
        peak=np.asarray(history.pressure.max(axis=(1, 2))),
        approach=np.asarray(history.approach),
        load=np.asarray(history.load),
        radius=np.asarray(history.contact_radius),
        strain=np.asarray(history.film_strain),
        status=np.asarray(history.status),
    )


def pressure_at(trace: Trace, step: int, r: float) -> float:
    """Return the pressure [Pa] at distance r [m] from the axis, interpolated linearly along the middle row."""
    half = trace.x > 0.0
    return float(np.interp(r, trace.distance[half], trace.pressure[step][half]))


NU = 0.3
STEEL = jc.Elastic.from_young(210e9, nu=NU)
RADIUS = 19.05e-3 / 2.0  # [m]
BALL = jc.Sphere(radius=RADIUS, material=STEEL)
BALL_COMPLIANCE = (1.0 - NU) / (210e9 / 2.6)  # (1 - nu)/G of the ball [1/Pa]
THICKNESS = 150e-9  # [m]
FILM = jc.Burgers(G1=1.5e9 / 2, G2=0.02778e9 / 2, eta1=6297.2e9 / 2, eta2=241.8e9 / 2, nu=NU)
ON_STEEL = jc.LayeredHalfSpace([jc.Layer(FILM, thickness=THICKNESS)], substrate=STEEL)
HALF_SPACE = jc.LayeredHalfSpace([], substrate=FILM)

DURATION = 7200.0  # [s]
STEPS = 120
TIMES = DURATION * (jnp.arange(STEPS + 1) / STEPS) ** 2  # dense where the film creeps and relaxes fastest
SHOWN = (0, 15, 30, 60, 90, 120)  # steps at 0, 1.9, 7.5, 30, 67.5 and 120 min

REMARKS = (
    "Linear theory is inaccurate at film strains above 0.2: such figures are results of the model, not predictions for"
    " the film.",
    "Poisson's ratio is constant, so the film creeps in volume as well as in shear: its compliance under a"
    " wide contact grows 33-fold in 7200 s. With an elastic bulk modulus (1.625 GPa) it would grow 1.6-fold,"
    " and at 60 N the final approach would be 2.571 um and p0 1.15 GPa, instead of 3.352 um and 0.668 GPa.",
)


@lru_cache(maxsize=8)
def creep(film_on_steel: bool, load: float, n: int) -> Trace:
    """Simulate a constant load [N] for 7200 s, on the film on steel or on the film as a half-space."""
    return _run(film_on_steel, jc.Load(load), n)


@lru_cache(maxsize=8)
def relaxation(film_on_steel: bool, approach: float, n: int) -> Trace:
    """Simulate a constant approach [um] for 7200 s, on the film on steel or on the film as a half-space."""
    return _run(film_on_steel, jc.Approach(approach * 1e-6), n)


def _run(film_on_steel: bool, control: jc.Load | jc.Approach, n: int) -> Trace:
    body = ON_STEEL if film_on_steel else HALF_SPACE
    return press(body, BALL, control, TIMES, jc.Grid.around(body, BALL, control, TIMES, n=n))
