"""Plain calls on a machine with one core, as a container or a job of a cluster has."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

CALLS = """
import json, os, sys
if len(sys.argv) > 1:
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
import jaxcontact as jc
steel = jc.Elastic.from_young(210e9, 0.3)
film = jc.LayeredHalfSpace([jc.Layer(jc.Elastic.from_young(3e9, 0.4), 30e-6)], steel)
given = {"velocity": 5e-5, "grid": jc.Grid.square(n=32, width=320e-6)}
slid = lambda **more: jc.slide(film, jc.Sphere(5e-3, steel), jc.Load(0.3), [0.0, 1.0], **given, **more)
rubbed, held = slid(friction=0.3), slid(adhesion=jc.DugdaleAdhesion(1.0, 1e7))
print(json.dumps([[float(run.approach[-1]), float(run.status[-1])] for run in (rubbed, held)]))
"""


@pytest.mark.slow
@pytest.mark.skipif(
    not hasattr(os, "sched_setaffinity"), reason="the system does not bind processes to cores"
)
def test_an_elastic_body_slides_with_friction_and_with_adhesion_on_one_core():
    """Programs with LAPACK, which was not found on one core beside transforms of the fields that no rate remembers."""
    environment = os.environ | {"JAX_ENABLE_COMPILATION_CACHE": "false"}
    run = lambda *where: json.loads(
        subprocess.check_output(
            [sys.executable, "-W", "ignore", "-c", CALLS, *where], env=environment, text=True
        )
    )
    one, many = run("one"), run()
    np.testing.assert_allclose(one, many, rtol=1e-9)
    assert np.all(np.array(one)[:, 1] == 0.0)
