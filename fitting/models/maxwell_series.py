"""Generalised Maxwell model: a relaxation modulus as a series of given times, and its creep compliance.

    G(t) = Ge + sum_i G_i exp(-t/tau_i),     G*(omega) = Ge + sum_i G_i i omega tau_i/(1 + i omega tau_i)

The equivalent compliances are those of ``jaxcontact.inputs.spectrum.from_relaxation``. Source: N. W. Tschoegl, The
Phenomenological Theory of Linear Viscoelastic Behavior, 1989, secs. 3.5 and 8.1 (the models and their equivalence).
"""

import dataclasses
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

import jaxcontact as jc
from fitting.models.structure import ParameterList
from jaxcontact._support.pytree import refuse_masked
from jaxcontact.inputs.spectrum import Spectrum, from_relaxation


@dataclasses.dataclass(frozen=True, eq=False)
class MaxwellSeries(ParameterList):
    """The moduli Ge, G1 .. Gk of given relaxation times ``tau`` (k,) [s] as a list; the material is a ``jc.Prony``."""

    @classmethod
    def with_times(cls, tau: Any, equilibrium: bool) -> "MaxwellSeries":
        """Return the structure with times (k,) [s], with or without Ge; ValueError unless they are > 0."""
        refuse_masked("tau", tau)
        tau = np.unique(np.asarray(tau, dtype=float))
        if tau.ndim != 1 or tau.size == 0 or not np.all(np.isfinite(tau) & (tau > 0)):
            raise ValueError(f"tau: expected times > 0, got {tau}")
        names = (["Ge"] if equilibrium else []) + [f"G{i + 1}" for i in range(tau.size)]
        found = cls.of(jc.Prony, dict.fromkeys(names, "Pa"))
        return dataclasses.replace(found, tau=tau)

    @property
    def rates(self) -> np.ndarray:
        """Relaxation rates 1/tau (k,) [1/s]."""
        assert self.tau is not None
        return 1.0 / self.tau

    @property
    def solid(self) -> bool:
        """True if there is an equilibrium modulus."""
        return "Ge" in self.where

    def times(self, values: np.ndarray) -> Any:
        """Return the relaxation times (k,) [s]."""
        return self.tau

    def moduli(self, values: Array) -> tuple[Any, Array]:
        """Return Ge () and G (k,) of the list."""
        return (values[0], values[1:]) if self.solid else (0.0, values)

    def relaxation(self, values: Array, t: Array) -> Array:
        """Return G(t) at times t of any shape."""
        Ge, G = self.moduli(values)
        return Ge + jnp.exp(-t[..., None] * self.rates) @ G

    def complex_modulus(self, values: Array, omega: Array) -> Array:
        """Return G' + i G'' at angular frequencies omega of any shape."""
        Ge, G = self.moduli(values)
        s = 1j * omega[..., None] / self.rates
        return Ge + (s / (1.0 + s)) @ G

    def compliances(self, values: Array) -> Spectrum:
        """Return the equivalent compliances, k retarded ones and a fluidity."""
        Ge, G = self.moduli(values)
        return from_relaxation(Ge, G[::-1], jnp.asarray(self.rates[::-1]))

    def material(self, values: dict[str, Any], volume: Any) -> jc.Prony:
        """Return the equivalent series of retardation times."""
        c = self.compliances(jnp.stack([jnp.asarray(values[name], dtype=float) for name in self.where]))
        return jc.Prony(
            J0=c.instantaneous, J=c.amplitudes, tau=1.0 / c.rates, fluidity=c.fluidity, **volume.keyword
        )
