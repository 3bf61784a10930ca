"""Which parameter of a material plays which part in J(t) = j0 + j2 (1 - exp(-t/tau)) + f t."""

import math

import numpy as np

import jaxcontact as jc

# part -> meaning: 0: 1/p is j0; 1: 1/p is j2; 2: 1/p is f; 3: 1/p is j2/tau
PARTS: dict[type, dict[str, int]] = {
    jc.Elastic: {"G": 0},
    jc.Maxwell: {"G": 0, "eta": 2},
    jc.KelvinVoigt: {"G": 1, "eta": 3},
    jc.StandardLinearSolid: {"G1": 0, "G2": 1, "eta2": 3},
    jc.Burgers: {"G1": 0, "G2": 1, "eta1": 2, "eta2": 3},
}


def resolve(model: type | str) -> type:
    """The material class, given itself or its name; ValueError if it cannot be fitted."""
    by_name = {cls.__name__: cls for cls in PARTS}
    cls = by_name.get(model) if isinstance(model, str) else model
    if cls not in PARTS:
        raise ValueError(
            f"model: expected one of {sorted(by_name)}, got {getattr(model, '__name__', model)!r}"
        )
    return cls


def unit(name: str) -> str:
    """Unit of a parameter: Pa of a modulus, Pa s of a viscosity."""
    return "Pa" if name.startswith("G") else "Pa s"


def limits(
    model: type, fixed: dict[str, float] | None, bounds: dict[str, tuple] | None
) -> dict[str, tuple[float, float]]:
    """Bounds of every parameter, (0, inf) unless given, equal ones where fixed; ValueError on bad input."""
    table = {name: (0.0, math.inf) for name in PARTS[model]}
    for name, pair in (bounds or {}).items():
        table[name] = _pair(model, table, name, pair)
    for name, value in (fixed or {}).items():
        _known(model, table, name, "fixed")
        if not (isinstance(value, int | float | np.number) and math.isfinite(value) and value > 0):
            raise ValueError(f"fixed[{name!r}]: expected a number > 0, got {value!r}")
        table[name] = (float(value), float(value))
    return table


def _known(model: type, table: dict, name: str, what: str) -> None:
    if name not in table:
        raise ValueError(f"{what}: {model.__name__} has parameters {list(table)}, got {name!r}")


def _pair(model: type, table: dict, name: str, pair: tuple) -> tuple[float, float]:
    _known(model, table, name, "bounds")
    try:
        low, high = pair
    except (TypeError, ValueError):
        raise ValueError(
            f"bounds[{name!r}]: expected (low, high), None for an open side, got {pair!r}"
        ) from None
    low, high = 0.0 if low is None else float(low), math.inf if high is None else float(high)
    if not 0.0 <= low < high:
        raise ValueError(f"bounds[{name!r}]: expected 0 <= low < high, got {pair!r}")
    return low, high


def compliance_box(model: type, table: dict[str, tuple[float, float]]) -> np.ndarray:
    """Bounds of (j0, j2, f, j2/tau), (4, 2) [1/Pa, 1/Pa, 1/(Pa s), 1/(Pa s)]: 0 for a part that is absent."""
    box = np.zeros((4, 2))
    for name, part in PARTS[model].items():
        low, high = table[name]
        box[part] = 1.0 / high, math.inf if low == 0.0 else 1.0 / low
    return box


def material(model: type, parts: np.ndarray, nu: float) -> object:
    """The material with compliances (4,) = (j0, j2, f, j2/tau); zero gives an infinite parameter."""
    return model(**{name: reciprocal(parts[part]) for name, part in PARTS[model].items()}, nu=nu)


def reciprocal(value: float) -> float:
    """1/value, with 1/0 = inf and 1/inf = 0."""
    return math.inf if value == 0.0 else 1.0 / float(value)
