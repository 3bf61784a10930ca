"""A material of the user's own fitted to a creep curve or a modulus, in the logarithms of its parameters.

The material is a subclass of ``jaxcontact.abc.Material``. An instance is given in place of a model: its numbers are the
start of the search, and what is not fitted (nu or a bulk modulus) is kept. All its other fields are numbers > 0. The strain
under a stress history that is linear between its knots is exact for the material's retardation spectrum
(``fitting/models/history.py``); moduli are its ``relaxation`` and ``complex_modulus``.

A search begins at the given numbers, and at the ``BEST`` of ``TRIED`` places within ``DECADES`` of them; the lowest of the
minima counts, and of equal ones that of the given numbers. Two elements of a kind are exchanged in it if the start does not
tell them apart.
"""

import dataclasses
import math
from typing import Any, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from fitting.fits.fractional import EDGE, Law, Relaxed, ScaledCreepCurve
from fitting.models import history
from fitting.models.parameters import Parameters
from fitting.models.structure import Compressibility, Sought, limits
from fitting.search.nonlinear import Objective, minimise
from jaxcontact.bodies.materials import Material

TRIED, BEST = 400, 8  # places at which the residuals are computed, and of these the starts of searches
EQUAL = 1e-6  # relative difference of the sums of squares of two minima that count as equal
DECADES = 3.0  # factor of a parameter at such a place over the given one, either way
HELD = ("nu", "bulk_modulus")
# the names that materials of jaxcontact have (``Material.shifted``), by their first letters, with units
UNITS = {"fluidity": "1/(Pa s)", "eta": "Pa s", "tau": "s", "G": "Pa", "J": "1/Pa"}


@dataclasses.dataclass(frozen=True, eq=False)
class OwnLaw(Law):
    """A material of one's own as the list of its parameters; start: the material at which the search begins."""

    start: Any = None

    @classmethod
    def of_material(cls, start: Material) -> Self:
        """Return the structure of a material; ValueError unless its parameters are numbers > 0."""
        fields = [field for field in dataclasses.fields(start) if not field.metadata.get("static")]  # type: ignore[arg-type]
        names = [field.name for field in fields if field.name not in HELD]
        for name in names:
            value = getattr(start, name)
            if np.ndim(value) != 0 or not (np.isreal(value) and 0.0 < float(value) < math.inf):
                raise ValueError(
                    f"model: expected numbers > 0 as the start of the search, got {name} = {value!r}"
                )
        if not names:
            raise ValueError(
                f"model: expected a material with parameters, got {type(start).__name__} without any"
            )
        dimensions = {
            name: next((unit for known, unit in UNITS.items() if name.startswith(known)), "")
            for name in names
        }
        where = {name: place for place, name in enumerate(names)}
        return cls(type(start), where, 0, None, dimensions=dimensions, start=start)

    def compliances(self, values: Array) -> Any:
        """Return the material, which provides ``creep``."""
        return self.material(self.parameters(values), None)

    def material(self, values: dict[str, Any], volume: Any) -> Any:
        """Return the material with these parameters and its own Poisson's ratio or bulk modulus."""
        return dataclasses.replace(self.start, **values)

    @property
    def notes(self) -> tuple[str, ...]:
        """None: the material is no approximation."""
        return ()

    @property
    def first(self) -> np.ndarray:
        """Logarithms (m,) of the start."""
        return np.log([float(getattr(self.start, name)) for name in self.where])


def structure_for(model: Any, data: Any) -> OwnLaw | None:
    """Return the structure where a model is an instance of a material, None of other models.

    ValueError where measured values were converted to shear with another Poisson's ratio than the material's, which would
    then not describe what was measured.
    """
    if not isinstance(model, Material):
        return None
    tensile = getattr(data, "nu", None)
    elastic = model.bulk_modulus is not None or model.nu is None
    if tensile is not None and (elastic or float(model.nu) != float(tensile)):
        own = "a bulk modulus" if elastic else f"nu = {float(model.nu):g}"
        raise ValueError(
            f"model: expected a material of nu = {tensile:g}, that of the data in tension, got {own}"
        )
    return OwnLaw.of_material(model)


class _OwnCoordinates:
    """The coordinates, bounds and starts of a material of one's own, the same for a creep curve and for a modulus."""

    def bounded(self, sought: Sought) -> Sought:
        """Return the sought material with its own Poisson's ratio or bulk modulus in the place of the default."""
        assert isinstance(sought.structure, OwnLaw)
        own = (getattr(sought.structure.start, name) for name in HELD)
        return sought._replace(
            volume=Compressibility.of(*(None if value is None else float(value) for value in own))
        )

    def space(self, sought: Sought) -> Parameters:
        """Return the logarithms of the parameters within their bounds, and within ``EDGE`` e-folds of the start."""
        assert isinstance(sought.structure, OwnLaw)
        rows = []
        for (low, high), start in zip(sought.table.values(), sought.structure.first, strict=True):
            low, high = math.log(low) if low > 0.0 else -math.inf, math.log(high)
            rows.append((low, high) if low == high else (max(low, start - EDGE), min(high, start + EDGE)))
        return Parameters.of(sought.structure, rows, logarithmic=True)

    def starts(self, law: Any) -> list[np.ndarray]:
        """Return the coordinates (m,) of the lowest minimum with the first weights, where the search begins."""
        objective = self.objective(self.space(Sought(law, limits(law, None, None), None)))  # type: ignore[attr-defined]
        apart = math.log(10.0) * DECADES
        places = law.first + apart * np.random.default_rng(0).uniform(-1.0, 1.0, (TRIED, law.first.size))
        sizes = np.array([float(np.sum(objective.at(place) ** 2)) for place in places])
        best = places[np.argsort(np.where(np.isfinite(sizes), sizes, np.inf))[:BEST]]
        found = [minimise(objective, start) for start in (law.first, *best)]
        # of equal minima, such as those with two elements exchanged, that of the given numbers
        low = min(one.rss for one in found) * (1.0 + EQUAL) + objective.floor
        return [next(one for one in found if one.rss <= low).theta]


class OwnCreepCurve(_OwnCoordinates, ScaledCreepCurve):
    """A padded creep curve, scaled, for a material of one's own."""

    def objective(self, space: Parameters) -> Objective:
        """Return the least-squares objective over the coordinates (m,)."""
        assert isinstance(space.structure, OwnLaw)
        inputs = self.stressed, self.compliance, self.duration, space.structure.start
        names = tuple(space.structure.where)
        return Objective.of(
            _response, inputs, self.y, self.weight, space, points=slice(self.n), static=(names,)
        )


def _response(theta: Array, inputs: tuple[Any, Array, Array, Any], names: tuple[str, ...]) -> Array:
    """Return the scaled strain (n,): J0 E + sum_i J_i D(tau_i) + fluidity F of ``history.columns``."""
    basis, compliance, duration, start = inputs
    spectrum = dataclasses.replace(start, **dict(zip(names, jnp.exp(theta), strict=True))).spectrum()
    rates = jnp.atleast_1d(spectrum.rates) * duration
    flow = 0.0 if spectrum.fluidity is None else spectrum.fluidity * duration
    parts = [jnp.stack([jnp.asarray(part, float)]) for part in (spectrum.instantaneous, flow)]
    amounts = jnp.concatenate([parts[0], jnp.atleast_1d(spectrum.amplitudes), parts[1]]) / compliance
    return history.columns(basis, rates) @ amounts


class OwnModulus(_OwnCoordinates, Relaxed):
    """A modulus over times or angular frequencies, scaled, for a material of one's own."""

    def objective(self, space: Parameters, weights: np.ndarray | None = None) -> Objective:
        """Return the least-squares objective for weights (n,) of y, by default its reciprocals."""
        assert isinstance(space.structure, OwnLaw)
        weights = 1.0 / np.maximum(np.abs(self.y), np.finfo(float).tiny) if weights is None else weights
        inputs = self.x, self.unit, space.structure.start
        names = tuple(space.structure.where)
        return Objective.of(_moduli, inputs, self.y, weights, space, static=(names, self.relaxed))


def _moduli(theta: Array, inputs: tuple[Array, Array, Any], names: tuple[str, ...], relaxed: bool) -> Array:
    """Return the scaled moduli (n,), G' followed by G'' of an oscillation."""
    x, unit, start = inputs
    material = dataclasses.replace(start, **dict(zip(names, jnp.exp(theta), strict=True)))
    if relaxed:
        return material.relaxation(x) / unit
    found = material.complex_modulus(x[: x.size // 2]) / unit
    return jnp.concatenate([found.real, found.imag])
