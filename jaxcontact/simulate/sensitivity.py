"""Sensitivities: by how many per cent a result moves when a parameter moves by one per cent."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._support import checks
from jaxcontact._support.pytree import as_float64


@dataclass(frozen=True)
class Sensitivity:
    """d log(output)/d log(parameter), without unit.

    parameters: names of the parameters, (m,); values: {output: array (m, ...)}, whose further axes are those of the output,
    with nan where an output is zero and has no logarithm. ``print`` shows a table of the last values.
    """

    parameters: tuple[str, ...]
    values: dict[str, np.ndarray]

    def __str__(self) -> str:
        width = max(len(name) for name in (*self.parameters, "parameter"))
        columns = [max(len(name), 9) for name in self.values]
        heads = "  ".join(name.rjust(c) for name, c in zip(self.values, columns, strict=True))
        lines = [f"{'parameter'.ljust(width)}  {heads}"]
        for i, parameter in enumerate(self.parameters):
            last = (float(np.ravel(table[i])[-1]) for table in self.values.values())
            cells = "  ".join(
                f"{round(float(v), 4) + 0.0:+.4f}".rjust(c) for v, c in zip(last, columns, strict=True)
            )
            lines.append(f"{parameter.ljust(width)}  {cells}")
        return "\n".join(lines)

    __repr__ = __str__

    def plot(self, times: Array) -> Any:
        """Return a figure of the sensitivities of every output over the times [s], (nt,), of its values.

        Raises ValueError if no output has one value for each time.
        """
        from jaxcontact.results import plotting

        over_time = {name: v for name, v in self.values.items() if v.shape[1:] == np.shape(times)}
        checks.require(
            bool(over_time), f"times: expected the shape of an output over time, got shape {np.shape(times)}"
        )
        return plotting.sensitivities(np.asarray(times), self.parameters, over_time)


def sensitivity(f: Callable[[Any], Mapping[str, Array]], body: Any) -> Sensitivity:
    """Compute the table d log(output)/d log(parameter) of a calculation in forward mode, one tangent per parameter.

    f is called once with the given values, so that its errors and warnings are those of an ordinary call, and is then
    compiled for the derivatives. ``sensitivity`` can therefore not be called inside jit. The sensitivity to a parameter
    whose value is zero is zero.

    Args:
        f: function of ``body`` that returns a dict of outputs, each a number or an array, such as one value per time.
        body: a ``LayeredHalfSpace``, or any pytree of numbers, such as a dict of body and indenter. Every number in it is a
            parameter, named by its path. An array is a single parameter: all its elements are multiplied by the same
            factor.

    Returns:
        A ``Sensitivity``.

    Raises:
        ValueError: f does not return a dict of outputs; errors of f are passed on.

    Example:
        >>> grid, ball = jc.Grid.square(n=24, width=330e-6), jc.Sphere(9.525e-3)
        >>> press = lambda body: jc.indent(body, ball, jc.Load(60.0), [0.0], grid=grid)
        >>> steel = jc.LayeredHalfSpace([], jc.Elastic.from_young(210e9))
        >>> table = jc.sensitivity(lambda body: {"approach": press(body).approach}, steel)
        >>> print(table)                                          # Hertz: -2/3 for G
        parameter      approach
        substrate.G     -0.66...
        substrate.nu    -0.28...
    """
    body = as_float64(body)
    found = _by_name(f(body))
    leaves, structure = jax.tree_util.tree_flatten_with_path(body)
    values = [leaf for _, leaf in leaves]

    def outputs(log_scale: Array) -> dict[str, Array]:
        scaled = [value * jnp.exp(s) for value, s in zip(values, log_scale, strict=True)]
        return _by_name(f(jax.tree.unflatten(structure, scaled)))

    slopes = jax.jit(jax.jacfwd(outputs))(jnp.zeros(len(values)))
    relative = {
        name: np.moveaxis(
            np.asarray(slopes[name] / jnp.where(value == 0.0, jnp.nan, value)[..., None]), -1, 0
        )
        for name, value in found.items()
    }
    return Sensitivity(tuple(_name(path) for path, _ in leaves), relative)


def _name(path: Any) -> str:
    """The path of a number as it is written in Python, of a dict by its keys: body.layers[0].material.G1."""
    return re.sub(r"\['(\w+)'\]", r".\1", jax.tree_util.keystr(path)).lstrip(".") or "value"


def _by_name(outputs: Any) -> dict[str, Array]:
    """Return the outputs of f as arrays by name."""
    checks.require(
        isinstance(outputs, Mapping), f"f: expected a dict of outputs by name, got {type(outputs).__name__}"
    )
    return {name: jnp.asarray(value, float) for name, value in outputs.items()}
