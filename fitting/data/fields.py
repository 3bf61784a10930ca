"""Measured fields of a contact: maps of pressure, gap and displacement, and images of the contact area."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

import jaxcontact as jc
from fitting.views.text import described
from jaxcontact._support.pytree import require_real

UNITS = {"pressure": "Pa", "gap": "m", "displacement": "m", "contact": ""}


@dataclasses.dataclass(frozen=True, eq=False)
class ContactData:
    """Fields of a contact measured over time, as pressure films, interferometers and contact microscopes give them.

    Args:
        times: (nt,) [s] of the history, not decreasing, from the first loading on. At a time without an image
            all pixels are NaN.
        control: ``jc.Load`` [N] or ``jc.Approach`` [m] over these times, as ``jc.indent`` takes it.
        fields: {name: (nt, nx, ny)}, or (nx, ny) for a single time. "pressure" [Pa]; "gap" [m]; "displacement" [m], which
            is a residual imprint where the load is zero; "contact", 1 for a pixel in contact and 0 for one out of
            contact. NaN, or the mask of a numpy array, marks a pixel that is not measured.
        grid: ``jc.Grid`` of the pixels, the same for all fields. It may differ in extent and spacing from that of the fit.
        sigma: {name: standard deviation of a pixel}, a number or an array of the shape of the field, up to a common factor
            of the field, which the fit estimates. Of a field without it the standard deviation is taken as constant. A
            contact image has none: its errors are those of a Bernoulli variable.
        notes: remarks, which the fit repeats.

    Raises:
        ValueError: an unknown field, an array of another shape, a contact image with other values than 0 and 1, or a
            standard deviation that is not > 0.

    Example:
        >>> grid = jc.Grid.square(n=8, width=8e-6)
        >>> data = fitting.ContactData([0.0], jc.Load(1.0), {"contact": np.eye(8)}, grid)
        >>> print(data.fields["contact"].shape)
        (1, 8, 8)
    """

    times: np.ndarray
    control: Any
    fields: Mapping[str, np.ndarray]
    grid: jc.Grid
    sigma: Mapping[str, Any] | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = lambda name, value: object.__setattr__(self, name, value)
        require_real("times", self.times)
        put("times", np.atleast_1d(np.asarray(self.times, dtype=float)))
        if self.times.ndim != 1 or not np.all(np.isfinite(self.times)) or np.any(np.diff(self.times) < 0):
            raise ValueError(f"times: expected (nt,) finite and not decreasing, got {self.times!r}")
        if not isinstance(self.control, jc.Load | jc.Approach):
            raise ValueError(f"control: expected a Load or an Approach, got {type(self.control).__name__}")
        put("control", dataclasses.replace(self.control, value=np.asarray(self.control.value, dtype=float)))
        if not isinstance(self.grid, jc.Grid):
            raise ValueError(f"grid: expected a Grid, got {type(self.grid).__name__}")
        if not self.fields or not set(self.fields) <= set(UNITS):
            raise ValueError(f"fields: expected some of {', '.join(UNITS)}, got {list(self.fields)}")

        # the fields, (nt, nx, ny) each
        fields, shape = {}, (self.times.size, *self.grid.shape)
        for name, value in self.fields.items():
            if not isinstance(value, np.ma.MaskedArray):  # masked cells are cells that were not measured
                require_real(f"fields[{name!r}]", value)
            array: np.ndarray = np.ma.array(value, dtype=float).filled(np.nan)
            array = array[None] if array.ndim == 2 else array
            if array.shape != shape:
                raise ValueError(f"fields[{name!r}]: expected shape {shape}, got {np.shape(value)}")
            known = array[np.isfinite(array)]
            if known.size == 0 or np.any(np.isinf(array)):
                raise ValueError(
                    f"fields[{name!r}]: expected finite values, or NaN where a pixel is not measured"
                )
            if name == "contact" and not np.all(np.isin(known, (0.0, 1.0))):
                raise ValueError(
                    f"fields['contact']: expected 0 and 1, got {known.min():g} to {known.max():g}"
                )
            array.setflags(write=False)
            fields[name] = array
        put("fields", fields)

        # their standard deviations, likewise
        sigma = {}
        for name, value in (self.sigma or {}).items():
            if name not in fields or name == "contact":
                own = [one for one in fields if one != "contact"]
                raise ValueError(f"sigma: expected those of {own}, got {name!r}")
            require_real(f"sigma[{name!r}]", value)
            array = np.asarray(value, dtype=float)
            if array.shape not in ((), shape[1:], shape):
                raise ValueError(f"sigma[{name!r}]: expected a number or shape {shape}, got {array.shape}")
            if not np.all(np.isfinite(array) & (array > 0)):
                raise ValueError(f"sigma[{name!r}]: expected finite values > 0")
            sigma[name] = np.broadcast_to(array, shape)
        put("sigma", sigma)

    def __repr__(self) -> str:
        rows = [(name, value[np.isfinite(value)], UNITS[name]) for name, value in self.fields.items()]
        pixels = " x ".join(map(str, self.grid.shape))
        return described(
            f"ContactData: {pixels} pixels at {self.times.size} times",
            [("times", self.times, "s"), *rows],
            self.notes,
        )
