"""Derivatives of whole calculations: sensitivities in per cent per per cent, and products with the Jacobian for numpy."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxcontact._compile.programs import compiler_options
from jaxcontact._support import checks
from jaxcontact._support.pytree import as_float64, require_real


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


class NumpyFunction:
    """A calculation with named inputs and outputs, and the product of its Jacobian with cotangents, for code without jax.

    For y = f(x) and cotangents v, of the shapes of the outputs,

        vjp(x, v) = v^T dy/dx,

    which for a single output and v = 1 is the gradient. It is computed in reverse mode, at a cost that does not depend on
    the number of inputs. Inputs and outputs are numbers and numpy arrays, so that the optimisers of scipy, other programs,
    and suites that couple differentiable simulations can use any calculation of this package.

    f is compiled on the first call, and again for inputs of other shapes. Known values are therefore checked only if they
    do not depend on the inputs. Inputs out of range, and solutions that fail, give nan or a status other than zero: return
    ``history.status`` as an output of its own to learn why. Warnings and notes are not issued.

    Args:
        f: function that takes one dict of float64 arrays by name and returns a dict of numbers and arrays by name, written
            with ``jax.numpy`` and the functions of this package.

    Raises:
        ValueError: f is not callable. A call raises it for inputs or cotangents that are not numbers by name, for outputs
            that are not a dict, and for cotangents of other names or shapes than the outputs, or of outputs that are no
            real numbers, such as a status. Errors of f are passed on.

    Example:
        >>> grid, steel = jc.Grid.square(n=24, width=330e-6), jc.LayeredHalfSpace([], jc.Elastic.from_young(210e9))
        >>> def press(x):
        ...     history = jc.indent(steel, jc.Sphere(x["radius"]), jc.Load(x["load"]), [0.0], grid=grid)
        ...     return {"approach": history.approach[0], "status": history.status[0]}
        >>> pressed = jc.NumpyFunction(press)
        >>> x = {"radius": 9.525e-3, "load": 60.0}
        >>> y, slope = pressed.apply(x), pressed.vjp(x, {"approach": 1.0})
        >>> print(f"{slope['load'] * x['load'] / y['approach']:.2f}, {slope['radius'] * x['radius'] / y['approach']:.2f}")
        0.67, -0.33
    """

    def __init__(self, f: Callable[[dict[str, Array]], Mapping[str, Array]]) -> None:
        checks.require(callable(f), f"f: expected a function of a dict of inputs, got {type(f).__name__}")

        def outputs(inputs: dict[str, Array]) -> dict[str, Array]:
            found = f(inputs)
            _check_outputs(found)
            return {name: jnp.asarray(value) for name, value in found.items()}

        def pulled_back(inputs: dict[str, Array], cotangents: dict[str, Array]) -> dict[str, Array]:
            def chosen(inputs: dict[str, Array]) -> dict[str, Array]:
                # Names, shapes and types are known while this is traced, so that a mistake costs no run.
                found = outputs(inputs)
                for name, given in cotangents.items():
                    checks.require(
                        name in found, f"cotangents: expected names among {', '.join(found)}, got {name}"
                    )
                    real = jnp.issubdtype(found[name].dtype, jnp.floating)
                    checks.require(
                        real, f"cotangents: expected those of real outputs, got {name} of {found[name].dtype}"
                    )
                    shape = found[name].shape
                    checks.require(
                        given.shape == shape,
                        f"cotangents: expected shape {shape} for {name}, got {given.shape}",
                    )
                return {name: found[name].astype(jnp.float64) for name in cotangents}

            return jax.vjp(chosen, inputs)[1](cotangents)[0]

        self._outputs = jax.jit(outputs, compiler_options=compiler_options())
        self._pulled_back = jax.jit(pulled_back, compiler_options=compiler_options())

    def apply(self, inputs: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """Return the outputs by name, as numpy arrays, at inputs given by name as numbers or arrays."""
        return _in_numpy(self._outputs(_numbers("inputs", inputs)))

    def vjp(self, inputs: Mapping[str, Any], cotangents: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """Return the sum over the outputs of cotangent times derivative by each input, by the names of the inputs.

        cotangents: numbers or arrays of the shape of an output, by name; outputs that are left out count as zero. The
        result has the shapes of the inputs.
        """
        return _in_numpy(self._pulled_back(_numbers("inputs", inputs), _numbers("cotangents", cotangents)))


def _numbers(argument: str, given: Any) -> dict[str, np.ndarray]:
    """Return numbers and arrays by name as float64 arrays."""
    checks.require(
        isinstance(given, Mapping),
        f"{argument}: expected a dict of numbers by name, got {type(given).__name__}",
    )
    found = {}
    for name, value in given.items():
        require_real(f"{argument}: {name}", value)
        try:
            found[name] = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise ValueError(
                f"{argument}: expected a number or an array for {name}, got {type(value).__name__}"
            ) from None
    return found


def _in_numpy(found: dict[str, Array]) -> dict[str, np.ndarray]:
    return {name: np.asarray(value) for name, value in found.items()}


def _check_outputs(outputs: Any) -> None:
    kind = "an array" if isinstance(outputs, jax.Array) else type(outputs).__name__
    checks.require(isinstance(outputs, Mapping), f"f: expected a dict of outputs by name, got {kind}")


def _name(path: Any) -> str:
    """The path of a number as it is written in Python, of a dict by its keys: body.layers[0].material.G1."""
    return re.sub(r"\['(\w+)'\]", r".\1", jax.tree_util.keystr(path)).lstrip(".") or "value"


def _by_name(outputs: Any) -> dict[str, Array]:
    """Return the outputs of f as arrays by name."""
    _check_outputs(outputs)
    return {name: jnp.asarray(value, float) for name, value in outputs.items()}
