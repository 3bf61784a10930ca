"""Surface response of a layered solid from its boundary and interface conditions, solved simultaneously.

At the wavevector (m, n), alpha^2 = m^2 + n^2, the functions psi = exp(i(m x + n y) -+ alpha z) are harmonic,
and each gives three displacement fields in equilibrium (the form of Papkovitch and Neuber, z from any plane),

    2 G u = curl(psi e_z),      2 G u = grad psi,      2 G u = (3 - 4 nu) psi e_z - z grad psi.

The six amplitudes in each layer, and three in the half-space, follow from the traction on the surface and
from continuity of displacement and traction at every interface. The traction on the body is
t = -(sigma_xz, sigma_yz, sigma_zz), so that a pressure acts along +z, into the body.

The equations are formed in extended precision, and the solution in double precision is refined with their
residuals. Errors against 60-digit arithmetic, for up to three layers: 2e-16 for stiffness ratios up to 1e3,
6e-15 up to 1e8, and 1e-12 if in addition the layers are thinner than 1/(1000 alpha).
"""

import numpy as np

REFINEMENTS = 2
PHASES = np.array([1j, 1j, 1.0])  # u_x = i U, u_y = i V and likewise t_x, t_y: U, V, u_z and t_z are real


def surface_response(moduli, poissons, thicknesses, m, n):
    """Return the displacement (x, y, z) of the surface per traction (x, y, z) on it, (..., 3, 3) complex [m/Pa].

    moduli: shear moduli [Pa], real or complex, (..., layers + 1), the top layer first, the half-space last;
    poissons: (..., layers + 1); thicknesses: (..., layers) [m]; m, n: (...) [rad/m], not both zero.
    """
    moduli, poissons, thicknesses, m, n = map(np.asarray, (moduli, poissons, thicknesses, m, n))
    # lengths in units of 1/alpha, moduli in units of the top layer's
    alpha, unit = (np.hypot(m, n), moduli[..., 0])
    direction = (np.asarray(m / alpha, np.longdouble), np.asarray(n / alpha, np.longdouble))
    solids = [(moduli[..., i] / unit, poissons[..., i]) for i in range(moduli.shape[-1])]
    depths = [np.asarray(thicknesses[..., i] * alpha, np.longdouble) for i in range(thicknesses.shape[-1])]
    top = _sides(solids[0], depths[0] if depths else None, *direction)[0]
    tractions = np.zeros((*alpha.shape, 6 * len(depths) + 3, 3), np.clongdouble)
    tractions[..., :3, :] = np.eye(3)
    amplitudes = _solved(_conditions(solids, depths, *direction), tractions)
    displacement = top[..., :3, :] @ amplitudes[..., : top.shape[-1], :]
    phases = PHASES[:, None] / PHASES
    return np.asarray(displacement / (unit * alpha)[..., None, None] * phases, np.complex128)


def _conditions(solids, depths, m, n):
    """Return the equations for all amplitudes: traction on the surface, then jumps at the interfaces."""
    size = 6 * len(depths) + 3
    matrix = np.zeros((*m.shape, size, size), np.clongdouble)
    row = 0
    for i, solid in enumerate(solids):
        top, bottom = _sides(solid, depths[i] if i < len(depths) else None, m, n)
        columns = slice(6 * i, 6 * i + top.shape[-1])
        if i == 0:
            matrix[..., :3, columns] = -top[..., 3:, :]
            row = 3
        else:
            matrix[..., row : row + 6, columns] = -top
            row += 6
        if i < len(depths):
            matrix[..., row : row + 6, columns] = bottom
    return matrix


def _sides(solid, depth, m, n):
    """Return the fields of all solutions at the top and at the bottom of a layer, (..., 6, 6); a half-space has three."""
    zero = np.zeros_like(m)
    if depth is None:
        return _fields(solid, -1, zero, m, n), None
    top = [_fields(solid, -1, zero, m, n), _fields(solid, 1, -depth, m, n)]
    bottom = [_fields(solid, -1, depth, m, n), _fields(solid, 1, zero, m, n)]
    return np.concatenate(top, -1), np.concatenate(bottom, -1)


def _fields(solid, sign, z, m, n):
    """Return U, V, W and the stresses xz, yz, zz of the three solutions with exp(sign z) at z, (..., 6, 3)."""
    G, nu = solid
    one, no = np.ones_like(z), np.zeros_like(z)
    nu = nu * one
    displacement = [
        [n, m, -m * z],
        [-m, n, -n * z],
        [no, sign * one, 3 - 4 * nu - sign * z],
    ]
    stress = [
        [sign * n / 2, sign * m, m * (1 - 2 * nu - sign * z)],
        [-sign * m / 2, sign * n, n * (1 - 2 * nu - sign * z)],
        [no, one, 2 * sign * (1 - nu) - z],
    ]
    as_arrays = lambda rows: np.stack([np.stack(np.broadcast_arrays(*row), -1) for row in rows], -2)
    u = as_arrays(displacement) / np.asarray(2 * G)[..., None, None]
    return np.concatenate([u, as_arrays(stress) + 0 * u], -2) * np.exp(sign * z)[..., None, None]


def _solved(matrix, right):
    """Return the solution of linear equations in extended precision."""
    rough = matrix.astype(np.complex128)
    solution = np.zeros_like(right)
    for _ in range(1 + REFINEMENTS):
        residual = right - matrix @ solution
        solution = solution + np.linalg.solve(rough, residual.astype(np.complex128))
    return solution
