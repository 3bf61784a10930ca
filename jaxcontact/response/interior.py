"""Transfer functions to a depth: traction and displacement inside a stack under surface tractions, by wavenumber.

The plane at depth z divides the body in two. With A, B, C of ``response.layer`` and the compliance S of all that lies
below each layer (``response.stack``), the layers above the plane transmit

    t_below = j (j + C S)^-1 B^T t_above,      alpha u = S t,

layer by layer from the surface to the plane. In the plane of the wavevector these are 2 x 2 over (in-plane, normal)
with t_r = i tau, u_r = i U; in the transverse direction they are scalars. For a depth within the substrate, the
half-space itself is divided at that depth.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from jaxcontact.inputs.layers import LayeredHalfSpace
from jaxcontact.response.layer import TwoPort, two_port
from jaxcontact.response.stack import SurfaceCompliance, covered, solids, surface_compliance
from jaxcontact.response.volume import nu_at_first

Entries = tuple[Array, Array, Array, Array, Array]  # rr, rz, zr, zz, ss


class Transfer(NamedTuple):
    """Transfer functions from surface tractions to a depth; entries (out, in), r in the plane, z normal, s transverse.

    t_rr, t_rz, t_zr, t_zz, t_ss: to tractions; u_rr, ...: to alpha times displacement [1/Pa]; e_rr, e_rz, e_ss: u times
    the shear modulus at the depth, from which the in-plane stresses are formed.
    """

    t_rr: Array
    t_rz: Array
    t_zr: Array
    t_zz: Array
    t_ss: Array
    u_rr: Array
    u_rz: Array
    u_zr: Array
    u_zz: Array
    u_ss: Array
    e_rr: Array
    e_rz: Array
    e_ss: Array


def depths_of_interfaces(body: LayeredHalfSpace) -> Array:
    """Return the depths of the interfaces [m], (layers,)."""
    return jnp.cumsum(jnp.asarray([layer.thickness for layer in body.layers], float))


def poisson_at(body: LayeredHalfSpace, z: Array) -> Array:
    """Return Poisson's ratio at a depth z [m]; at an interface, that of the solid below."""
    return _poissons(body)[_solid_at(body, z)]


def _solid_at(body: LayeredHalfSpace, z: Array) -> Array:
    return jnp.sum(depths_of_interfaces(body) <= z)


def _poissons(body: LayeredHalfSpace) -> Array:
    return jnp.stack([nu_at_first(solid) for solid in solids(body)])


def transfer(body: LayeredHalfSpace, wavenumber: Array, z: Array, compliances: Array) -> Transfer:
    """Return the transfer functions at wavenumbers alpha >= 0 [rad/m] to the depth z [m], ().

    compliances: shear compliances of the solids [1/Pa], real or complex, (layers + 1, ...), which broadcast with the
    wavenumbers behind the first axis.
    """
    j, alpha = compliances, wavenumber
    bottom = depths_of_interfaces(body)
    top = jnp.append(0.0, bottom)
    # above the plane: all of the layers on top of its solid, and the part z - top of this one. It is chosen by number, so
    # that at the surface and at an interface the derivative by z is that below, and not half of it
    count, here = jnp.arange(top.size), _solid_at(body, z)
    whole = jnp.append(jnp.diff(top), 0.0)
    above = jnp.where(count < here, whole, jnp.where(count == here, z - top, 0.0))
    per_solid = lambda a: jnp.reshape(a, (-1, *[1] * (j.ndim - 1)))
    nu, below = per_solid(_poissons(body)), per_solid(jnp.diff(top) - above[:-1])
    ports = [two_port(alpha * above[i], nu[i]) for i in range(len(j))]
    compliance = [surface_compliance(j, nu, below, alpha)]  # of the solids below the plane
    for port, own in zip(ports[::-1], j[::-1], strict=True):  # of the solids below each layer above the plane
        compliance.insert(0, covered(compliance[0], own, port))
    one, zero = jnp.ones_like(compliance[0].normal), jnp.zeros_like(compliance[0].normal)
    t: Entries = (one, zero, zero, one, one)
    for port, own, foundation in zip(ports, j, compliance[1:], strict=True):
        t = _transmitted(port, own, foundation, t)
    L, K, N, T = compliance[-1]
    rr, rz, zr, zz, ss = t
    u = L * rr + K * zr, L * rz + K * zz, K * rr + N * zr, K * rz + N * zz, T * ss
    local = j[_solid_at(body, z)]
    return Transfer(*t, *u, u[0] / local, u[1] / local, u[4] / local)


def _transmitted(port: TwoPort, j: Array, below: SurfaceCompliance, t: Entries) -> Entries:
    """Return the tractions below a layer from those on top of it, both (rr, rz, zr, zz, ss)."""
    (B11, B12, B21, B22), (C11, C12, C22) = port.B, port.C
    L, K, N, T = below
    D11, D12 = j + C11 * L + C12 * K, C11 * K + C12 * N
    D21, D22 = C12 * L + C22 * K, j + C12 * K + C22 * N
    det = D11 * D22 - D12 * D21
    share = j / jnp.where(det == 0.0, 1.0, det)

    def through(r: Array, z: Array) -> tuple[Array, Array]:
        r, z = B11 * r + B21 * z, B12 * r + B22 * z
        return share * (D22 * r - D12 * z), share * (D11 * z - D21 * r)

    rr, rz, zr, zz, ss = t
    (rr, zr), (rz, zz) = through(rr, zr), through(rz, zz)
    across = j + port.tanh * T
    return rr, rz, zr, zz, ss * port.sech * j / jnp.where(across == 0.0, 1.0, across)
