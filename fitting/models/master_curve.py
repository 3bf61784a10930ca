"""Master curve of time-temperature superposition: a cubic spline over the logarithm of the reduced frequency.

A curve measured at temperature T, of complex moduli G*(omega) or of a modulus G(t), lies on the master curve f if

    ln b_T G(omega, T) = f(ln omega + ln a_T),

with the shift factor a_T of the times and the vertical factor b_T of the moduli. For moduli over frequency, f has two
parts, ln |G*| and the phase angle, so that errors in proportion to |G*| are equal in both; for moduli over time, omega is
1/t. Each part is a cubic B-spline with equidistant knots over the range of the shifted data. Source: J. D. Ferry,
Viscoelastic Properties of Polymers, 3rd ed., 1980, ch. 11.
"""

import dataclasses
import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fitting.models.structure import ParameterList


class Sweeps(NamedTuple):
    """Curves at several temperatures one after the other.

    temperature (m,) [K], increasing; reference: place of the reference among them; x (n,): logarithm of the frequency
    [rad/s], or of 1/t; y (n,): logarithm of the modulus [Pa], or phase angle [rad]; which, part, block (n,): place of the
    temperature, 1 for a phase angle, and number of the measured curve.
    """

    temperature: np.ndarray
    reference: int
    x: np.ndarray
    y: np.ndarray
    which: np.ndarray
    part: np.ndarray
    block: np.ndarray

    @property
    def parts(self) -> int:
        """Number of parts of the master curve, 1 or 2."""
        return int(self.part.max()) + 1

    @property
    def others(self) -> np.ndarray:
        """Places (m - 1,) of the temperatures other than the reference."""
        return np.delete(np.arange(self.temperature.size), self.reference)


class Master(NamedTuple):
    """A master curve at given shifts.

    values, slope (n, parts (K + 3)): basis of the coefficients at the shifted data, with a block for each part, and its
    derivative with respect to the place u in knot intervals; u (n,); ends: smallest and largest shifted x, and their curves.
    """

    values: np.ndarray
    slope: np.ndarray
    u: np.ndarray
    ends: tuple[float, float, int, int]


def basis(u: np.ndarray, intervals: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the cubic B-splines (n, intervals + 3) at places u (n,) in knot intervals, and their derivatives."""
    i = np.clip(np.floor(u), 0, intervals - 1).astype(int)
    t = u - i
    four = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], -1) / 6.0
    rise = np.stack([-((1 - t) ** 2), 3 * t**2 - 4 * t, -3 * t**2 + 2 * t + 1, t**2], -1) / 2.0
    values, slope = np.zeros((2, u.size, intervals + 3))
    rows, columns = np.arange(u.size)[:, None], i[:, None] + np.arange(4)
    values[rows, columns], slope[rows, columns] = four, rise
    return values, slope


def master(sweeps: Sweeps, shifts: np.ndarray, intervals: int) -> Master:
    """Return the basis of the master curve at ln a_T (m,)."""
    x = sweeps.x + shifts[sweeps.which]
    first, last = int(np.argmin(x)), int(np.argmax(x))
    u = intervals * (x - x[first]) / (x[last] - x[first])
    ends = float(x[first]), float(x[last]), int(sweeps.which[first]), int(sweeps.which[last])
    both = [_by_part(one, sweeps) for one in basis(u, intervals)]
    return Master(both[0], both[1], u, ends)


def _by_part(columns: np.ndarray, sweeps: Sweeps) -> np.ndarray:
    """Return columns (n, k) in the block of the part of each point, (n, parts k)."""
    return np.concatenate([columns * (sweeps.part == k)[:, None] for k in range(sweeps.parts)], axis=1)


def by_shift(found: Master, coefficients: np.ndarray, sweeps: Sweeps, intervals: int) -> np.ndarray:
    """Return the derivative (n, m) of the master curve at the data with respect to ln a_T, knots moving included."""
    low, high, first, last = found.ends
    rise = found.slope @ coefficients * intervals / (high - low)
    count, share = sweeps.temperature.size, found.u / intervals
    own = np.eye(count)[sweeps.which]
    own[:, first] -= 1.0 - share
    own[:, last] -= share
    return rise[:, None] * own


@dataclasses.dataclass(frozen=True, eq=False)
class ShiftStructure(ParameterList):
    """A law of the shift factor about a reference temperature [K] as the list of its parameters; ``dict`` for no law."""

    reference: float = 0.0

    def material(self, values: dict[str, Any], volume: Any) -> Any:
        """Return the law, or the shift factors by name where there is none."""
        return values if self.model is dict else self.model(**values, reference=self.reference)


@functools.partial(jax.jit, static_argnames="law")
def log_factors(law: type, parameters: Any, reference: Any, temperature: Any) -> tuple[Any, Any]:
    """Return ln a_T (m,) of a law at temperatures (m,), and the derivatives (m, k) by the logarithms of its parameters."""
    shifts = lambda z: law(*jnp.exp(z), reference).log_factor(temperature)
    z = jnp.log(jnp.asarray(parameters, dtype=float))
    return shifts(z), jax.jacfwd(shifts)(z)
