"""A grid whose cells are divided among devices, or among hosts, gives the results of a single device."""

import os
import re
import socket
import subprocess
import sys
from collections import Counter

import jax
import numpy as np
import pytest

from jaxcontact.operators import spectral

PROBLEM = """
import jax, numpy as np
import jaxcontact as jc
from jax.sharding import Mesh

grid = jc.Grid((64, 64), (1e-6, 1e-6), periodic=True)
steel = jc.Elastic.from_young(210e9, nu=0.3)
heights = np.asarray(jc.self_affine(grid, hurst=0.8, rms_slope=0.02, shortest=4e-6, longest=30e-6, seed=0))
times = np.linspace(0.0, 3600.0, 4)

def pressed(heights, eta1):
    film = jc.Burgers(G1=1e9, G2=2e9, eta1=eta1, eta2=1.2e12, nu=0.38)
    body = jc.LayeredHalfSpace([jc.Layer(film, thickness=5e-6)], substrate=steel)
    indenter = jc.HeightField(heights, material=steel)
    control, options = jc.Load(0.5), {"save": "last", "tolerance": 1e-12, "substeps": 2}
    return jc.indent(body, indenter, control, times, grid=grid, **options)

mesh = Mesh(jax.devices(), ("cells",))
"""

FOUR_DEVICES = (
    PROBLEM
    + """
fields = lambda run: (run.pressure, run.approach, run.iterations)
pressure = lambda heights, eta1: pressed(heights, eta1).pressure
peak = lambda eta1: pressed(heights, eta1).pressure.max()
alone = [*fields(pressed(heights, 2e13)), jax.grad(peak)(2e13)]
with jax.set_mesh(mesh):
    parted = [*fields(pressed(heights, 2e13)), jax.grad(peak)(2e13)]
    program = jax.jit(pressure).lower(heights, 2e13).compile().as_text()
assert len(parted[0].sharding.device_set) == 4 and parted[0].addressable_shards[0].data.size == 64 * 64 // 4
for one, four in zip(alone, parted):
    print("difference", np.max(np.abs(np.asarray(four) - one)) / np.max(np.abs(one)))
print(program)
"""
)

TWO_HOSTS = """
import sys, jax
jax.config.update("jax_cpu_collectives_implementation", "gloo")
jax.distributed.initialize(sys.argv[1], num_processes=2, process_id=int(sys.argv[2]))
""" + (
    PROBLEM
    + """
with jax.set_mesh(mesh):
    run = pressed(heights, 2e13)
assert len(run.pressure.addressable_shards) == 1 and run.pressure.addressable_shards[0].data.size == 64 * 64 // 2
print(run.approach[-1], run.pressure.max())
"""
)


LONGEST = 600.0  # of a process [s]; they take less than a minute


def start(script: str, *arguments: str, devices: int) -> subprocess.Popen:
    """A process with a number of virtual devices."""
    flags = f"{os.environ.get('XLA_FLAGS', '')} --xla_force_host_platform_device_count={devices}"
    # hosts that read their programs from a folder of compiled ones wait for each other for ever
    environment = os.environ | {
        "XLA_FLAGS": flags,
        "JAX_PLATFORMS": "cpu",
        "JAX_ENABLE_COMPILATION_CACHE": "false",
    }
    command = [sys.executable, "-c", script, *arguments]
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def output(process: subprocess.Popen) -> str:
    try:
        printed, errors = process.communicate(timeout=LONGEST)
    finally:
        process.kill()
    assert process.returncode == 0, errors[-2000:]
    return printed


SHAPES = """
import jax, numpy as np
from jax.sharding import Mesh
from jaxcontact.operators import spectral

random = np.random.default_rng(0)
for shape, periodic in {(16, 16): (True, True), (12, 8): (False, False), (10, 7): (False, True)}.items():
    kernel, field = random.normal(size=(2, *shape))
    for axis, wraps in enumerate(periodic):
        if wraps:
            kernel = kernel + np.roll(np.flip(kernel, axis), 1, axis)
    convolve = lambda k, f: spectral.convolve(spectral.kernel_spectrum(k, periodic), f, periodic)
    with jax.set_mesh(Mesh(jax.devices(), ("cells",))):
        found = jax.jit(convolve)(kernel, field)
    expected = [
        sum(kernel[abs(i - k), abs(j - l)] * field[k, l] for k, l in np.ndindex(shape)) for i, j in np.ndindex(shape)
    ]
    print(np.max(np.abs(np.asarray(found).ravel() - expected)))
"""


@pytest.mark.slow
def test_convolutions_on_four_devices_agree_with_sums():
    """Also where the number of rows is not a multiple of the number of devices."""
    errors = [float(line) for line in output(start(SHAPES, devices=4)).split()]
    assert len(errors) == 3 and max(errors) < 1e-12, errors


@pytest.mark.slow
def test_four_devices_give_the_result_of_one_and_never_gather_a_field():
    """Pressure, approach, iterations and a gradient; each transform exchanges blocks once."""
    printed = output(start(FOUR_DEVICES, devices=4))
    differences = [float(each) for each in re.findall(r"difference (\S+)", printed)]
    assert len(differences) == 4 and max(differences) <= 1e-12, differences
    moves = Counter(re.findall(r"= .*? (all-gather|all-to-all|collective-permute)\(", printed))
    assert set(moves) == {"all-to-all"}, moves
    transforms = len(re.findall(r"= .*? fft\(", printed))
    assert transforms == 2 * moves["all-to-all"], "a two-dimensional transform has two parts and one exchange"


@pytest.mark.long
def test_two_hosts_give_the_result_of_one():
    with socket.socket() as free:
        free.bind(("localhost", 0))
        address = f"localhost:{free.getsockname()[1]}"
    hosts = [start(TWO_HOSTS, address, str(rank), devices=1) for rank in (0, 1)]
    found = [[float(word) for word in output(host).split()[-2:]] for host in hosts]
    namespace: dict = {}
    exec(PROBLEM, namespace)
    alone = namespace["pressed"](namespace["heights"], 2e13)
    expected = [float(alone.approach[-1]), float(alone.pressure.max())]
    np.testing.assert_allclose(found, [expected, expected], rtol=1e-12)


def test_a_mesh_with_an_explicit_axis_is_rejected():
    with (
        jax.set_mesh(jax.make_mesh((1,), ("cells",), axis_types=(jax.sharding.AxisType.Explicit,))),
        pytest.raises(ValueError, match='an axis "cells" of type Auto'),
    ):
        spectral.transform(np.zeros((4, 4)))
