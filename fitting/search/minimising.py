"""Minimisation of any differentiable loss over any tree of parameters: inverse design and identification.

The parameters are searched in coordinates of order one (``SearchCoordinates``). The default method is L-BFGS
(optax) with a line search for the weak Wolfe conditions

    f(z + t d) <= f(z) + 1e-4 t g.d,      g(z + t d).d >= 0.9 g.d

by bisection, which also works where the loss has kinks, as it has where cells enter the contact. Source: A. S. Lewis,
M. L. Overton, Nonsmooth optimization via quasi-Newton methods, Math. Program. 141 (2013) 135. One program, value and
gradient together, is compiled and run once for each trial step. A trial at which the loss or its gradient is not
finite, or whose contact has a status other than fine, counts as too long and is shortened.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from tqdm import tqdm

from fitting.views import output, sheet
from jaxcontact._support.pytree import require_real

LOWER, FLATTER = 1e-4, 0.9  # constants of the Wolfe conditions
TRIALS = 30  # largest number of trials of one line search
FIRST = 0.1  # largest norm of the first change of the coordinates
WINDOW = 10  # steps over which progress is judged
SAME = 1e-9  # relative tolerance of a loss that is evaluated again
STUCK = "no step, however short, lowers the loss or has a status of 0"
# distance of the points beside a start with a gradient of zero, and number of their directions
AWAY, BESIDE = 1e-2, 8
MEMORY = 10  # number of pairs of changes kept by L-BFGS


# Coordinates of order one for the parameters of a minimisation, in which bounds are eliminated.
#
# A parameter x without bounds, with a scale s, has the coordinate z = x/s. Between bounds it is replaced by
#
#     x = low + (high - low)/(1 + exp(-z)),      x = low + s exp(z),      x = high - s exp(z)
#
# for two bounds, a lower one alone, and an upper one alone, with s = start - low or high - start: every z gives a
# value inside the bounds. A minimum on a bound is approached but not reached.


@dataclass(frozen=True)
class LeafCoordinates:
    """The coordinates of one leaf: bounds (None where open) and scale, which broadcast to its shape."""

    low: Any
    high: Any
    scale: Any

    @classmethod
    def of(cls, name: str, leaf: Any, bounds: Any, scale: Any) -> LeafCoordinates:
        """Return the coordinates of one leaf after checking its start, bounds and scale; ValueError that names the
        leaf."""
        require_real(f"start{name}", leaf)
        try:
            start = np.asarray(leaf, float)
        except (TypeError, ValueError):
            raise ValueError(f"start{name}: expected a number or an array, got {leaf!r}") from None
        if not np.all(np.isfinite(start)):
            raise ValueError(f"start{name}: expected finite numbers")
        low, high = None, None  # where open
        if bounds is not None:
            if not isinstance(bounds, tuple | list) or len(bounds) != 2:
                raise ValueError(f"bounds{name}: expected (low, high), None where open, got {bounds!r}")
            require_real(f"bounds{name}", bounds)
            low, high = (
                None if end is None or np.all(np.isinf(end)) else np.asarray(end, float) for end in bounds
            )
        if low is not None and high is not None and not np.all(low < high):
            raise ValueError(f"bounds{name}: expected low < high, got ({low}, {high})")
        inside = (low is None or np.all(start > low)) and (high is None or np.all(start < high))
        if not inside:
            span = f"{start:g}" if start.size == 1 else f"{start.min():g} to {start.max():g}"
            raise ValueError(f"start{name}: expected values inside the bounds ({low}, {high}), got {span}")
        if scale is not None and not np.all(np.asarray(scale) > 0.0):
            raise ValueError(f"scale{name}: expected > 0, got {scale}")
        if low is not None or high is not None:
            own = start - low if low is not None else high - start
            return cls(low, high, own)
        if scale is None:
            scale = float(np.sqrt(np.mean(start**2)))
            if scale == 0.0:
                raise ValueError(
                    f"scale{name}: expected a scale or bounds, since start{name} is zero throughout"
                )
        return cls(low, high, scale)

    def inwards(self, x: Array) -> Array:
        """Return the coordinate z of a value x."""
        if self.low is not None and self.high is not None:
            return jnp.log((x - self.low) / (self.high - x))
        if self.low is not None:
            return jnp.log((x - self.low) / self.scale)
        if self.high is not None:
            return jnp.log((self.high - x) / self.scale)
        return x / self.scale

    def outwards(self, z: Array) -> Array:
        """Return the value x of a coordinate z."""
        if self.low is not None and self.high is not None:
            return self.low + (self.high - self.low) * jax.nn.sigmoid(z)
        if self.low is not None:
            return self.low + self.scale * jnp.exp(z)
        if self.high is not None:
            return self.high - self.scale * jnp.exp(z)
        return z * self.scale


@dataclass(frozen=True)
class SearchCoordinates:
    """The coordinates of a tree of parameters, leaf by leaf."""

    tree: Any
    leaves: tuple[LeafCoordinates, ...]

    @classmethod
    def of(cls, start: Any, bounds: Any, scale: Any) -> SearchCoordinates:
        """Return the coordinates of a tree after checking start, bounds and scale; ValueError that names the leaf."""
        paths, tree = jax.tree_util.tree_flatten_with_path(start)
        if not paths:
            raise ValueError("start: expected numbers or arrays, got a tree without any")
        spans, scales = _by_leaf("bounds", bounds, tree), _by_leaf("scale", scale, tree)
        named = [(jax.tree_util.keystr(path), leaf) for path, leaf in paths]
        leaves = [
            LeafCoordinates.of(name, leaf, span, size)
            for (name, leaf), span, size in zip(named, spans, scales, strict=True)
        ]
        return cls(tree, tuple(leaves))

    def inwards(self, values: Any) -> list[Array]:
        """Return the coordinates of a tree of values, a list over its leaves."""
        found = jax.tree.leaves(values)
        return [own.inwards(jnp.asarray(x, float)) for own, x in zip(self.leaves, found, strict=True)]

    def outwards(self, coordinates: list[Array]) -> Any:
        """Return the tree of values at the given coordinates."""
        values = [own.outwards(z) for own, z in zip(self.leaves, coordinates, strict=True)]
        return jax.tree.unflatten(self.tree, values)


def _by_leaf(name: str, given: Any, tree: Any) -> list[Any]:
    """Return the argument for each leaf: one value for all, or a tree like ``start``."""
    pair = name == "bounds" and isinstance(given, tuple) and len(given) == 2
    pair = pair and all(end is None or isinstance(end, float | int) for end in given)
    if given is None or isinstance(given, float | int) or pair:
        return [given] * tree.num_leaves
    try:
        found = tree.flatten_up_to(given)
    except (ValueError, TypeError, KeyError):
        raise ValueError(
            f"{name}: expected one for all parameters, or a tree like start, got {given!r}"
        ) from None
    return found


@dataclass(frozen=True)
class Minimum:
    """Result of ``minimise``.

    point: the tree of parameters with the lowest loss found; value: its loss; converged: whether the search ended by
    its tolerance; message: the reason why it ended; values (steps + 1,): the loss at the start and after each step;
    gradients (steps + 1,): norms of its gradient with respect to the coordinates; evaluations: number of evaluations of
    value and gradient.
    """

    point: Any
    value: float
    converged: bool
    message: str
    values: np.ndarray
    gradients: np.ndarray
    evaluations: int

    def __str__(self) -> str:
        how = "converged" if self.converged else "not converged"
        count = f"{len(self.values) - 1} steps, {self.evaluations} evaluations"
        change = f"loss {self.values[0]:.6g} -> {self.value:.6g}"
        slope = f"gradient {self.gradients[0]:.2g} -> {self.gradients[-1]:.2g}"
        return f"{how}: {self.message}\n{count}\n{change}, {slope}"

    __repr__ = __str__

    @sheet.styled
    def plot(self) -> Any:
        """Return a Figure of loss and gradient norm over the steps, on logarithmic axes where they are positive."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7, 3), layout="constrained")
        for panel, values, name in zip(
            figure.subplots(1, 2),
            (self.values, self.gradients),
            ("loss", "norm of the gradient"),
            strict=True,
        ):
            panel.plot(values, color=sheet.VIOLET)
            panel.set_yscale("log" if np.all(values > 0.0) else "linear")
            panel.set_xlabel("step")
            panel.set_ylabel(name)
        return figure


class Trial(NamedTuple):
    """A trial point of the search.

    z: coordinates (a list over leaves); value: loss; gradient: with respect to the coordinates; sound: whether the loss
    and its gradient are finite and the status is 0.
    """

    z: list[Array]
    value: float
    gradient: list[Array]
    sound: bool

    @property
    def norm(self) -> float:
        """Norm of the gradient."""
        return float(np.sqrt(_dot(self.gradient, self.gradient)))


def minimise(
    loss: Callable[[Any], Any],
    start: Any,
    *,
    bounds: Any = None,
    scale: Any = None,
    method: Any = "lbfgs",
    steps: int = 200,
    tolerance: float = 1e-5,
    state: str | Path | None = None,
) -> Minimum:
    """Minimise a differentiable loss over a tree of parameters.

    Args:
        loss: a function of a tree like ``start`` that returns the loss, a number, or (loss, status) with the ``status``
            of the contacts it solved; it is compiled, so it must be traceable by jax. A step to a point at which a
            status is not 0 (fine), or the loss or its gradient is not finite, is shortened and repeated.
        start: numbers and arrays in any jax pytree: a dict, a ``jc.Burgers``, a height map (nx, ny).
        bounds: (low, high), None where open, for all parameters, or a tree like ``start`` of such pairs, whose ends may
            be arrays. The start must lie inside. A bounded parameter is replaced by a coordinate that cannot leave its
            bounds.
        scale: the magnitude of a significant change of parameters without bounds: one number, or a tree like ``start``.
            By default the root mean square of each leaf of ``start``, which makes unlike parameters comparable.
        method: "lbfgs", or any optax transformation such as ``optax.adam(0.02)``, whose steps, in coordinates of order
            one, are then taken without a line search.
        steps: the largest number of steps, including those of a resumed search.
        tolerance: the search ends when the norm of the gradient falls below this fraction of the largest so far or,
            with "lbfgs", when ten steps together lower the loss by less than its square, relative to the loss.
        state: a file in which the search is saved after each step. A call with the same arguments resumes from it.

    Returns:
        A ``Minimum``: ``point``, ``value``, ``converged``, ``message``, the history, and ``plot()``.

    Raises:
        ValueError: a start that is outside its bounds, at which the loss is not finite or a status not 0, or that is zero
            without a scale; options
            out of range; a state file of another search.

    Example:
        >>> rosenbrock = lambda p: (1 - p["x"]) ** 2 + 100 * (p["y"] - p["x"] ** 2) ** 2
        >>> found = fitting.minimise(rosenbrock, {"x": -1.2, "y": 1.0})
        >>> f"{found.point['x']:.4f} {found.point['y']:.4f}"
        '1.0000 1.0000'
    """
    if steps != int(steps) or steps < 1:
        raise ValueError(f"steps: expected a whole number of at least 1, got {steps}")
    if not 0.0 < tolerance < 1.0:
        raise ValueError(f"tolerance: expected more than 0 and less than 1, got {tolerance}")
    coordinates = SearchCoordinates.of(start, bounds, scale)
    search = _Minimisation(
        loss, coordinates, method, float(tolerance), None if state is None else Path(state)
    )
    return search.run(start, int(steps))


class _Minimisation:
    """State of a minimisation: the compiled loss, the method, and the history so far."""

    def __init__(
        self, loss: Callable, coordinates: SearchCoordinates, method: Any, tolerance: float, file: Path | None
    ) -> None:
        import optax  # takes half a second to import

        if method != "lbfgs" and not isinstance(method, optax.GradientTransformation):
            raise ValueError(f'method: expected "lbfgs" or an optax transformation, got {method!r}')
        self.line_search = isinstance(method, str)
        self.method = optax.scale_by_lbfgs(MEMORY) if self.line_search else method
        self.update = jax.jit(self.method.update)
        self.coordinates, self.tolerance, self.file = coordinates, tolerance, file
        self.evaluations = 0
        # of the gradient in a line search, so that a small loss does not begin with a small step
        self.unit = 1.0
        self.values: list[float] = []
        self.gradients: list[float] = []

        def of_coordinates(z: list[Array]) -> tuple[Array, Array]:
            found = loss(coordinates.outwards(z))
            value, status = found if isinstance(found, tuple) else (found, 0)
            if jnp.shape(value) != ():
                raise ValueError(f"loss: expected one number, got shape {jnp.shape(value)}")
            return value, jnp.all(jnp.asarray(status) == 0)

        self.compiled = jax.jit(jax.value_and_grad(of_coordinates, has_aux=True))

    def at(self, z: list[Array]) -> Trial:
        """Return the trial point at coordinates z, with the loss and its gradient."""
        (value, fine), gradient = self.compiled(z)
        self.evaluations += 1
        finite = np.isfinite(value) and all(bool(jnp.all(jnp.isfinite(g))) for g in gradient)
        return Trial(z, float(value), gradient, bool(fine) and bool(finite))

    def run(self, start: Any, steps: int) -> Minimum:
        """Search from the start or from the saved state, until the tolerance or the number of steps is reached."""
        here = self.at(self.coordinates.inwards(start))
        if not here.sound:
            raise ValueError(
                f"start: expected a finite loss with a finite gradient and a status of 0, got {here.value}"
            )
        memory = self.method.init(here.z)
        self._remember(here)
        if self.line_search and 0.0 < here.norm < FIRST:
            self.unit = here.norm
        if self.file is not None and self.file.exists():
            here, memory = self._resumed(here, memory)
        if here.norm == 0.0:
            here = self._off_maximum(here)
        best, message = here, self._ended()
        with tqdm(total=steps, initial=len(self.values) - 1, unit="step", disable=None, leave=False) as bar:
            while not message and len(self.values) <= steps:
                found, memory = self._step(here, memory)
                if found is None:
                    message = STUCK
                    break
                here = found
                best = here if here.value < best.value else best
                self._remember(here)
                self._keep(here, memory)
                bar.update()
                bar.set_postfix_str(f"loss {here.value:.6g}")
                message = self._ended()
        converged = message not in ("", STUCK)
        words = message or f"stopped after {steps} steps"
        arrays = np.asarray(self.values), np.asarray(self.gradients)
        return Minimum(
            self.coordinates.outwards(best.z), best.value, converged, words, *arrays, self.evaluations
        )

    def _off_maximum(self, start: Trial) -> Trial:
        """Return a point beside a start whose gradient is zero, at which the loss is lower, or the start where it is a
        minimum.

        A gradient of zero is that of a maximum or a saddle too. The loss is compared at both sides along each of a few
        random directions and, where there are few coordinates, along each coordinate.
        """
        count = int(sum(np.size(z) for z in start.z))
        random = np.random.default_rng(0).standard_normal((BESIDE, count))
        rows = np.concatenate([np.eye(count), random]) if count <= BESIDE else random
        for row in rows:
            ends = np.cumsum([np.size(z) for z in start.z])[:-1]
            parts = np.split(row / np.linalg.norm(row), ends)
            direction = [
                jnp.reshape(jnp.asarray(part), np.shape(z)) for part, z in zip(parts, start.z, strict=True)
            ]
            for sign in (AWAY, -AWAY):
                trial = self.at(_moved(start.z, direction, sign))
                if trial.sound and trial.value < start.value:
                    self._remember(trial)
                    return trial
        return start

    def _step(self, here: Trial, memory: Any) -> tuple[Trial | None, Any]:
        """Take one step; return None as the trial where none was found."""
        gradient = [g / self.unit for g in here.gradient]
        change, memory = self.update(gradient, memory, here.z)
        if not self.line_search:
            for halvings in range(TRIALS):
                trial = self.at(_moved(here.z, change, 0.5**halvings))
                if trial.sound:
                    return trial, memory
            return None, memory
        direction = [-c for c in change]
        # curvature lost to rounding: restart from steepest descent
        if not _dot(direction, here.gradient) < 0.0:
            change, memory = self.update(gradient, self.method.init(here.z), here.z)
            direction = [-c for c in change]
        # along the direction to the weak Wolfe conditions, by bisection
        slope, low, high, best = _dot(direction, here.gradient), 0.0, np.inf, None
        length = 1.0
        if len(self.values) == 1:
            length = min(1.0, FIRST / float(np.sqrt(_dot(direction, direction))))
        for _ in range(TRIALS):
            trial = self.at(_moved(here.z, direction, length))
            if not trial.sound or trial.value > here.value + LOWER * length * slope:
                high = length
            else:
                best, low = trial, length
                if _dot(direction, trial.gradient) >= FLATTER * slope:
                    break
            length = 2.0 * low if np.isinf(high) else 0.5 * (low + high)
        return best, memory

    def _ended(self) -> str:
        """Return the reason why the search has ended, or an empty string if it has not."""
        if self.gradients[-1] <= self.tolerance * max(self.gradients):
            return f"the gradient fell below {self.tolerance:g} of its largest norm"
        recent = self.values[-1 - WINDOW :] if self.line_search else []
        if len(recent) > WINDOW and recent[0] - min(recent) <= self.tolerance**2 * abs(recent[-1]):
            return f"{WINDOW} steps lowered the loss by less than {self.tolerance**2:g} of it"
        return ""

    def _remember(self, trial: Trial) -> None:
        self.values.append(trial.value)
        self.gradients.append(trial.norm)

    def _keep(self, here: Trial, memory: Any) -> None:
        """Write the state of the search atomically."""
        if self.file is None:
            return
        leaves = jax.tree.leaves((here.z, memory))
        arrays = {f"leaf{i}": np.asarray(leaf) for i, leaf in enumerate(leaves)}
        arrays |= {"values": np.asarray(self.values), "gradients": np.asarray(self.gradients)}
        arrays["evaluations"] = np.asarray(self.evaluations)

        def fill(path: Path) -> None:
            with path.open("wb") as stream:
                np.savez(stream, **arrays)

        output.write(self.file, fill)

    def _resumed(self, here: Trial, memory: Any) -> tuple[Trial, Any]:
        """Return the point and the memory at which an earlier call ended; ValueError for the state of another search."""
        assert self.file is not None
        try:
            with self.file.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
                kept = dict(stored)
            # the same search: arrays of the same shapes, and the same loss at the start
            leaves, tree = jax.tree.flatten((here.z, memory))
            same = all(
                kept[f"leaf{i}"].shape == np.shape(leaf) and kept[f"leaf{i}"].dtype == np.asarray(leaf).dtype
                for i, leaf in enumerate(leaves)
            )
            same = same and f"leaf{len(leaves)}" not in kept and kept["values"][0] == here.value
        except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
            raise ValueError(
                f"state: {self.file} is damaged, or not the state of a search; expected another file"
            ) from error
        if not same:
            raise ValueError(
                f"state: {self.file} belongs to a search with other parameters, another start, loss or method;"
                " expected another file"
            )
        stored_leaves = [jnp.asarray(kept[f"leaf{i}"]) for i in range(len(leaves))]
        z, memory = jax.tree.unflatten(tree, stored_leaves)
        self.values, self.gradients = kept["values"].tolist(), kept["gradients"].tolist()
        self.evaluations = int(kept["evaluations"])
        resumed = self.at(z)  # with the loss and the bounds of this call
        if not np.isclose(resumed.value, self.values[-1], rtol=SAME, atol=0.0):
            raise ValueError(
                f"state: {self.file} belongs to a search with another loss or other bounds; expected another file"
            )
        return resumed, memory


def _dot(a: list[Array], b: list[Array]) -> float:
    return sum(float(jnp.vdot(x, y)) for x, y in zip(a, b, strict=True))


def _moved(z: list[Array], direction: list[Array], length: float) -> list[Array]:
    return [a + length * d for a, d in zip(z, direction, strict=True)]
