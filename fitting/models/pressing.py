"""The fields of an indentation in the image of an instrument, and their derivatives by forward mode."""

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.models.imaging import View, observed
from fitting.models.structure import ParameterList

NEEDED = {
    "contact": ("pressure", "gap", "smooth_area")
}  # fields of the solver for one in an image; else the same


class BodyParameters(ParameterList):
    """The parameters of a body, whose ``model`` is a function from {parameter: value} to the body."""

    def material(self, values: dict[str, Any], volume: Any) -> Any:
        """Return the body with these parameters."""
        return self.model(values)

    def times(self, values: np.ndarray) -> float:
        """Return nan: a body has no single retardation time."""
        return float("nan")


class PressedImages:
    """Images of an indentation as functions of log parameters (k,) and a ``View``.

    body: from {parameter: value} to the body; setting: indenter, control and times; seen: names of the fields in the image;
    image, grid: the pixels and the cells of the model. The last histories are kept, so that varying the view alone solves
    no contact.
    """

    def __init__(
        self, body: Callable, names: tuple[str, ...], setting: tuple[Any, Any, Any], seen: tuple[str, ...],
        image: jc.Grid, grid: jc.Grid, tolerance: float,
    ) -> None:  # fmt: skip
        self.seen, self.image, self.grid = seen, image, grid
        self.given = (setting, grid, tolerance)
        needed = tuple(sorted({own for name in seen for own in NEEDED.get(name, (name,))}))
        self.static = {"body": body, "names": names, "needed": needed}
        self._store()

    def _store(self) -> None:
        """Keep the last solution and its derivatives."""
        self.history = functools.lru_cache(maxsize=2)(self._history)
        self.slopes = functools.lru_cache(maxsize=1)(self._slopes)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without the stored solutions, which cannot be pickled and are computed again."""
        return {name: value for name, value in vars(self).items() if name not in ("history", "slopes")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._store()

    def _history(self, logs: tuple[float, ...]) -> tuple[dict[str, Array], jc.ContactHistory]:
        """Return the fields, and the whole history."""
        return _run(jnp.asarray(logs), *self.given, **self.static)

    def status(self, logs: tuple[float, ...]) -> jc.Status:
        """Return the largest status."""
        return jc.Status(int(np.max(self.history(logs)[1].status)))

    def notes(self, logs: tuple[float, ...]) -> tuple[str, ...]:
        """Return the notes of the solver."""
        return tuple(self.history(logs)[1].notes)

    def _slopes(self, logs: tuple[float, ...]) -> dict[str, Array]:
        """Return derivatives of the fields (k, nt, nx, ny) with respect to log parameters."""
        return _moved(jnp.asarray(logs), *self.given, **self.static)

    def images(self, logs: np.ndarray, view: View) -> dict[str, np.ndarray]:
        """Return {name: (nt, nx, ny)}, nan where the solver has failed."""
        key = tuple(logs.tolist())
        fields, bad = self.history(key)[0], 0.0 if self.status(key) == jc.Status.FINE else np.nan
        seen = _see(fields, view, self.grid, self.image, seen=self.seen)
        return {name: np.asarray(image) + bad for name, image in seen.items()}

    def image_slopes(self, logs: np.ndarray, view: View, varied: tuple[str, ...]) -> tuple[dict, dict]:
        """Return {name: (k, nt, nx, ny)} with respect to log parameters, and {name: {parameter: (nt, nx, ny)}} with
        respect to the ``varied`` parameters of the view."""
        key = tuple(logs.tolist())
        given = self.history(key)[0], self.slopes(key), view, {name: view.part(name) for name in varied}
        return _tangents(*given, self.grid, self.image, seen=self.seen)


@functools.partial(jax.jit, static_argnames=("body", "names", "needed"))
def _run(
    logs: Array, setting: tuple[Any, Any, Any], grid: jc.Grid, tolerance: float, *,
    body: Callable, names: tuple[str, ...], needed: tuple[str, ...],
) -> tuple[dict[str, Array], jc.ContactHistory]:  # fmt: skip
    """Return the fields (nt, nx, ny) of an indentation, and its whole history; setting: indenter, control and times."""
    values = dict(zip(names, jnp.exp(logs), strict=True))
    history = jc.indent(body(values), *setting, grid=grid, tolerance=tolerance)
    return {name: getattr(history, name) for name in needed}, history


@functools.partial(jax.jit, static_argnames=("body", "names", "needed"))
def _moved(logs: Array, *given: Any, **static: Any) -> dict[str, Array]:
    """Return the derivatives (k, nt, nx, ny) of the fields with respect to log parameters (k,)."""
    slopes = jax.jacfwd(lambda at: _run(at, *given, **static)[0])(logs)
    return {name: jnp.moveaxis(value, -1, 0) for name, value in slopes.items()}


@functools.partial(jax.jit, static_argnames=("seen",))
def _see(
    fields: dict[str, Array], view: View, grid: jc.Grid, image: jc.Grid, *, seen: tuple[str, ...]
) -> dict[str, Array]:
    """Return the images of the fields that are seen."""
    return {name: observed(name, fields, grid, image, view) for name in seen}


@functools.partial(jax.jit, static_argnames=("seen",))
def _tangents(
    fields: dict[str, Array], moved: dict[str, Array], view: View, varied: dict[str, Array], grid: jc.Grid,
    image: jc.Grid, *, seen: tuple[str, ...],
) -> tuple[dict[str, Array], dict[str, dict[str, Array]]]:  # fmt: skip
    """Return the derivatives of the images along changes (k, nt, nx, ny) of the fields, and with respect to the values
    ``varied`` of the view."""
    one = lambda change: jax.jvp(lambda f: _see(f, view, grid, image, seen=seen), (fields,), (change,))[1]
    shown = lambda values: _see(fields, view.moved(values), grid, image, seen=seen)
    return jax.vmap(one)(moved), jax.jacfwd(shown)(varied) if varied else {name: {} for name in seen}
