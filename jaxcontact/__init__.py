"""jaxcontact: differentiable time-dependent contact with a viscoelastic layered half-space.

Importing it switches jax to float64: the kernels span some sixteen decades, and float32 would
lose the film under the substrate.
"""

import jax

jax.config.update("jax_enable_x64", True)

from jaxcontact.materials import Burgers as Burgers  # noqa: E402
from jaxcontact.materials import Elastic as Elastic  # noqa: E402
from jaxcontact.materials import KelvinVoigt as KelvinVoigt  # noqa: E402
from jaxcontact.materials import Maxwell as Maxwell  # noqa: E402
from jaxcontact.materials import Prony as Prony  # noqa: E402
from jaxcontact.materials import StandardLinearSolid as StandardLinearSolid  # noqa: E402

__version__ = "0.1.0"
