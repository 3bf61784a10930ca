"""The thickness of a film that grows in a contact, with the pressure of the contact on the film as it grows."""

import dataclasses
import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.models.kinetics import GrowthKinetics

FIELDS = ("body", "indenter", "grid", "velocity", "friction", "radius", "thickest")


@functools.partial(
    jax.tree_util.register_dataclass, data_fields=list(FIELDS), meta_fields=["stress", "substeps"]
)
@dataclasses.dataclass(frozen=True, repr=False)
class RubbedContact:
    """The contact in which growth curves were measured, for ``fit_growth(contact=...)``.

    The film is rubbed in place (``jaxcontact.rub``): its thickness changes the pressure, which drives its growth. The
    measured thickness is the mean over all cells whose centres lie within ``radius`` of the axis.

    Args:
        body: a ``LayeredHalfSpace`` with one ``Layer`` on an elastic substrate; the thickness of the layer is replaced by
            the initial thickness of each curve.
        indenter: the indenter.
        grid: the ``Grid``, whose cells should be well below the contact radius: about 24 across the grid suffice for a fit.
        velocity: rubbing velocity [m/s].
        friction: coefficient of friction.
        radius: of the area over which the thickness is measured [m]; at least half the diagonal of a cell.
        thickest: largest thickness that the film may reach in the search [m], with a margin.
        stress: the stress that drives the growth, "pressure" or "shear" for friction x pressure.
        substeps: steps between two points of a curve.

    Example:
        >>> steel, film = jc.Elastic.from_young(210e9), jc.Elastic.from_young(40e9)
        >>> body = jc.LayeredHalfSpace([jc.Layer(film, 0.0)], substrate=steel)
        >>> contact = fitting.RubbedContact(body, jc.Sphere(9.5e-3, steel), jc.Grid.square(n=16, width=400e-6), velocity=0.1,
        ...                                 friction=0.1, radius=30e-6, thickest=5e-7, stress="shear")
        >>> kinetics = fitting.GrowthKinetics(1e-2, 1.04e-19, 4e-29, 1e-3)
        >>> h = contact.thickness(kinetics, [600.0, 1200.0], load=60.0, temperature=373.0)
        >>> bool(h[1] > h[0] > 1e-9)
        True
    """

    body: Any
    indenter: Any
    grid: Any
    velocity: Any
    friction: Any
    radius: Any
    thickest: Any
    stress: str = "pressure"
    substeps: int = 1

    def __repr__(self) -> str:
        cells = " x ".join(map(str, self.grid.shape))
        return (
            f"RubbedContact of a {type(self.indenter).__name__} at {self.velocity:.4g} m/s on {cells} cells, thickness"
            f" within {self.radius:.4g} m, growth by {self.stress}"
        )

    def thickness(
        self, kinetics: GrowthKinetics, t: Any, *, load: Any, temperature: Any, initial: Any = 0.0
    ) -> Array:
        """Return the mean thickness [m] at times t (n,) [s] under a load [N] at a temperature [K], (n,).

        It is nan from a time on at which there is no solution, or the film is thicker than ``thickest``.
        """
        run = self.run(kinetics, t, load=load, temperature=temperature, initial=initial)
        usable = [jc.Status.FINE, jc.Status.STEP_TOO_LONG, jc.Status.INHERITED]
        failed = jnp.cumsum(~jnp.isin(run.status, jnp.array(usable))) > 0
        found: Array = jnp.where(failed, jnp.nan, run.saved)[1:]
        return found

    def run(
        self, kinetics: GrowthKinetics, t: Any, *, load: Any, temperature: Any, initial: Any = 0.0
    ) -> Any:
        """Return the ``RubbingHistory`` of a curve at the times 0 and t, with the mean thickness in ``saved``."""
        law, measured = kinetics.law(temperature, stress=self.stress), self.cells()
        t, (film,) = jnp.asarray(t, dtype=float), self.body.sublayers()
        body = jc.LayeredHalfSpace([jc.Layer(film.material, initial)], self.body.substrate)

        def mean_thickness(step: Any) -> Array:
            return jnp.sum(measured * step.thickness)

        return jc.rub(
            body, self.indenter, jc.Load(load), jnp.append(0.0, t), velocity=self.velocity, law=law, grid=self.grid,
            friction=self.friction, thickest=self.thickest, substeps=self.substeps,
            save=mean_thickness,
        )  # fmt: skip

    def cells(self) -> Array:
        """Return the weight of each cell in the mean, (nx, ny)."""
        x, y = self.grid.coordinates()
        inside = (x**2 + (0.0 if self.grid.plane_strain else y**2)) <= jnp.asarray(self.radius) ** 2
        return jnp.where(inside, 1.0, 0.0) / jnp.maximum(jnp.sum(inside), 1)

    def check(self) -> None:
        """Raise ValueError where the thickness would be measured at no cell."""
        if not np.any(np.asarray(self.cells()) > 0.0):
            raise ValueError(
                f"contact radius [m]: expected one that contains the centre of a cell, got {float(self.radius):g}"
            )
