"""Measured moduli, relaxation over time or storage and loss over frequency: immutable, validated, in SI units."""

import dataclasses

import numpy as np

from fitting.data.curves import absolute, array, since_load, times
from fitting.views.text import described

CONVENTIONS = ("G", "E")


@dataclasses.dataclass(frozen=True, eq=False)
class RelaxationData:
    """Relaxation modulus, stress over strain after a strain step.

    Args:
        t: (n,) [s] since the step, > 0 or from 0 on, not decreasing.
        modulus: (n,) [Pa].
        convention: "G" in shear; "E" in tension, E = 2 (1 + nu) G.
        nu: Poisson's ratio, for "E" only.
        notes: remarks on what was read and corrected.
        start: time [s] of the strain step on the clock of t, which is subtracted; 0 if t counts from the step.
            None takes t as the time since the step, and adds a note if the spacing suggests that the clock started
            earlier (``fitting/data/curves.py``).
        temperature: of the test [K], for ``fit_master``.
        scatter: (n,) standard deviations up to a common factor, which a fit estimates; set by ``resample``.

    Raises:
        ValueError: any other input, with the expected and the received value.

    Example:
        >>> data = fitting.RelaxationData(t=[1, 2, 3, 4, 5], modulus=[9, 6, 4, 3, 2], convention="E", nu=0.5)
        >>> print(data.shear[0])
        3.0
    """

    t: np.ndarray
    modulus: np.ndarray
    convention: str = "G"
    nu: float | None = None
    notes: tuple[str, ...] = ()
    start: float | None = None
    temperature: float | None = None
    scatter: np.ndarray | None = None

    def __post_init__(self) -> None:
        since, late = since_load(times(self.t), self.start)
        for name, value in {"t": since, "start": 0.0, "notes": (*self.notes, *late)}.items():
            object.__setattr__(self, name, value)
        if self.t[0] < 0:
            raise ValueError(f"t: expected times >= 0, got {self.t[0]:g}")
        object.__setattr__(self, "modulus", array("modulus", self.modulus, self.t))
        if self.scatter is not None:
            object.__setattr__(self, "scatter", array("scatter", self.scatter, self.t))
        factor(self.convention, self.nu)
        object.__setattr__(self, "temperature", absolute(self.temperature))

    def __repr__(self) -> str:
        head = f"RelaxationData: {self.t.size} points, convention {self.convention}"
        rows = [("t", self.t, "s"), ("modulus", self.modulus, "Pa"), ("temperature", self.temperature, "K")]
        rows.append(("scatter", self.scatter, ""))
        return described(head, rows, self.notes)

    @property
    def shear(self) -> np.ndarray:
        """Relaxation modulus in shear G(t) [Pa], (n,)."""
        return self.modulus * factor(self.convention, self.nu)


@dataclasses.dataclass(frozen=True, eq=False)
class OscillationData:
    """Storage and loss moduli over angular frequency.

    Args:
        omega: (n,) angular frequency [rad/s] > 0, in any order; the points are sorted by it. At least two are different.
        storage: (n,) G' or E' [Pa].
        loss: (n,) G'' or E'' [Pa].
        convention: "G" in shear; "E" in tension, E = 2 (1 + nu) G.
        nu: Poisson's ratio, for "E" only.
        notes: remarks on what was read and corrected.
        temperature: of the test [K], for ``fit_master``.

    Attributes:
        reordered: whether the points had another order.

    Raises:
        ValueError: any other input, with the expected and the received value.

    Example:
        >>> data = fitting.OscillationData(omega=[1, 2, 3, 4, 5], storage=[1, 2, 3, 4, 5], loss=[1, 1, 1, 1, 1])
        >>> print(data.shear[0])
        (1+1j)
    """

    omega: np.ndarray
    storage: np.ndarray
    loss: np.ndarray
    convention: str = "G"
    nu: float | None = None
    notes: tuple[str, ...] = ()
    temperature: float | None = None
    reordered: bool = dataclasses.field(default=False, init=False)

    def __post_init__(self) -> None:
        omega = array("omega", self.omega)
        order = np.argsort(omega, kind="stable")
        if not omega[order[0]] > 0:
            raise ValueError(f"omega: expected frequencies > 0 rad/s, got {omega[order[0]]:g}")
        if np.ptp(omega) == 0.0:
            raise ValueError(f"omega: expected several frequencies, got {omega[0]:g} rad/s throughout")
        object.__setattr__(self, "reordered", bool(np.any(np.diff(omega) < 0)))
        factor(self.convention, self.nu)
        for name in ("omega", "storage", "loss"):
            object.__setattr__(self, name, array(name, getattr(self, name), omega)[order])
        object.__setattr__(self, "temperature", absolute(self.temperature))

    def __repr__(self) -> str:
        head = f"OscillationData: {self.omega.size} points, convention {self.convention}"
        rows = [("omega", self.omega, "rad/s"), ("storage", self.storage, "Pa"), ("loss", self.loss, "Pa")]
        rows.append(("temperature", self.temperature, "K"))
        return described(head, rows, self.notes)

    @property
    def shear(self) -> np.ndarray:
        """Complex shear modulus G' + i G'' [Pa], (n,) complex."""
        return (self.storage + 1j * self.loss) * factor(self.convention, self.nu)


def factor(convention: str, nu: float | None) -> float:
    """Return the factor from a modulus of this convention to shear; ValueError unless convention and nu are consistent."""
    if convention not in CONVENTIONS:
        raise ValueError(f"convention: expected one of {', '.join(CONVENTIONS)}, got {convention!r}")
    if convention == "E" and (nu is None or not -1.0 < nu <= 0.5):
        raise ValueError(f"nu: expected -1 < nu <= 0.5 for a tensile modulus (convention 'E'), got {nu!r}")
    if convention != "E" and nu is not None:
        raise ValueError(f"nu: expected none with convention {convention!r}, only 'E' needs it; got {nu!r}")
    return 1.0 if convention == "G" else 0.5 / (1.0 + (nu or 0.0))
