"""Bases for materials, indenters, adhesion and laws of growth of one's own.

A subclass with the abstract methods is accepted by every verb. ``fit_creep``, ``fit_relaxation`` and
``fit_oscillation`` take an instance of a material in place of a model, and case files take materials of plug-ins. A
subclass is a frozen dataclass whose numbers jax can differentiate, which the decorator ``pytree`` makes of it.

Example:
    >>> from jaxcontact.abc import Material, Spectrum, pytree
    >>> @pytree
    ... class TwoKelvin(Material):
    ...     G: float
    ...     G1: float
    ...     G2: float
    ...     eta1: float
    ...     eta2: float
    ...     nu: float = 0.4
    ...     bulk_modulus: float | None = None
    ...
    ...     def spectrum(self):
    ...         J = jnp.stack([1.0 / jnp.asarray(self.G1), 1.0 / jnp.asarray(self.G2)])
    ...         return Spectrum(1.0 / jnp.asarray(self.G), J, jnp.stack([self.G1 / self.eta1, self.G2 / self.eta2]))
    >>> gel = jc.LayeredHalfSpace([], TwoKelvin(2e3, 4e3, 8e3, 4e3, 8e4))
    >>> ball, grid = jc.Sphere(1e-3), jc.Grid.square(32, 500e-6)
    >>> run = jc.indent(gel, ball, jc.Load(1e-5), [0.0, 1.0, 10.0], grid=grid, substeps=4)
    >>> f"{run.approach[-1] * 1e6:.1f} um"
    '15.1 um'
"""

from jaxcontact._support.pytree import pytree
from jaxcontact.bodies.laws import Adhesion
from jaxcontact.bodies.laws import KineticLaw as GrowthLaw
from jaxcontact.bodies.materials import Material, Spectrum
from jaxcontact.indenters.predicted_contact import Outline
from jaxcontact.indenters.shapes import Indenter

__all__ = ["Adhesion", "GrowthLaw", "Indenter", "Material", "Outline", "Spectrum", "pytree"]
