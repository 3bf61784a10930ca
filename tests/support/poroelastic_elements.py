"""Step indentation of a poroelastic half-space by finite elements: displacements of second order and pore pressures of first
order in an axisymmetric rectangle, the equations of M. A. Biot (J. Appl. Phys. 12 (1941) 155), and the L-stable SDIRK method
of two stages in time. The radius of the contact is fixed at a = 1, with u_z = 1 - r^2/2 inside; G = 1 and D = 1. Nothing is
shared with ``poroelastic_contact``.
"""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

STAGE = 1 - 1 / np.sqrt(2)
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(3)
QUADRATIC = lambda x: (
    np.array([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2]),
    np.array([x - 0.5, -2 * x, x + 0.5]),
)
LINEAR = lambda x: (np.array([(1 - x) / 2, (1 + x) / 2]), np.array([-0.5, 0.5]))


def relaxation(nu, sealed, n=10, size=100.0, end=1.5, first=4e-4, each=8):
    """Return times, and (F - Finf)/(F0 - Finf) at them; sealed: whether the contact lets no solvent through."""
    near = np.linspace(0, 1, n + 1) ** 2.2
    r = np.concatenate([1 - near[::-1], 1 + near[1:], 2 * np.geomspace(1, size / 2, int(1.2 * n) + 1)[1:]])
    z = np.concatenate([near, np.geomspace(1, size, int(1.5 * n) + 1)[1:]])
    halved = lambda x: np.sort(np.concatenate([x, 0.5 * (x[1:] + x[:-1])]))
    R, Z = halved(r), halved(z)
    i, j = (one.ravel() for one in np.meshgrid(np.arange(r.size - 1), np.arange(z.size - 1), indexing="ij"))
    hr, hz, middle = (r[i + 1] - r[i]) / 2, (z[j + 1] - z[j]) / 2, (r[i + 1] + r[i]) / 2
    of_u = np.stack([(2 * i + a) * Z.size + 2 * j + b for a in range(3) for b in range(3)], 1)
    of_p = np.stack([(i + a) * z.size + j + b for a in range(2) for b in range(2)], 1)
    lame, k = 2 * nu / (1 - 2 * nu), (1 - 2 * nu) / (2 * (1 - nu))
    C = np.diag([2.0, 2.0, 2.0, 1.0])
    C[:3, :3] += lame

    # matrices of the elements: stiffness, volume change, flow
    stiff, volume, flow = (np.zeros((i.size, *shape)) for shape in ((18, 18), (4, 18), (4, 4)))
    for x, wx in zip(POINTS, WEIGHTS, strict=True):
        for y, wy in zip(POINTS, WEIGHTS, strict=True):
            (ur, dur), (uz, duz), (pr, dpr), (pz, dpz) = QUADRATIC(x), QUADRATIC(y), LINEAR(x), LINEAR(y)
            at = middle + hr * x
            w = 2 * np.pi * wx * wy * hr * hz * at
            by_r, by_z = np.outer(dur, uz).ravel() / hr[:, None], np.outer(ur, duz).ravel() / hz[:, None]
            B = np.zeros((i.size, 4, 18))
            B[:, 0, 0::2], B[:, 1, 0::2], B[:, 2, 1::2] = by_r, np.outer(ur, uz).ravel() / at[:, None], by_z
            B[:, 3, 0::2], B[:, 3, 1::2] = by_z, by_r
            stiff += np.einsum("eki,kl,elj,e->eij", B, C, B, w, optimize=True)
            volume += np.einsum("p,ei,e->epi", np.outer(pr, pz).ravel(), B[:, :3].sum(1), w)
            for slope in (np.outer(dpr, pz).ravel() / hr[:, None], np.outer(pr, dpz).ravel() / hz[:, None]):
                flow += k * np.einsum("ep,eq,e->epq", slope, slope, w)
    dofs = np.stack([2 * of_u, 2 * of_u + 1], 2).reshape(i.size, 18)
    nu_, np_ = 2 * R.size * Z.size, r.size * z.size

    def assembled(M, rows, columns, shape):
        rows, columns = np.repeat(rows, columns.shape[1], 1), np.tile(columns, (1, rows.shape[1]))
        return sp.csr_matrix((M.ravel(), (rows.ravel(), columns.ravel())), shape)

    K, B = assembled(stiff, dofs, dofs, (nu_, nu_)), assembled(volume, of_p, dofs, (np_, nu_))
    L = assembled(flow, of_p, of_p, (np_, np_))

    # held displacements and drained surfaces
    i, j = np.divmod(np.arange(R.size * Z.size), Z.size)
    held, value = np.zeros(nu_, bool), np.zeros(nu_)
    far, top = (i == R.size - 1) | (j == Z.size - 1), (j == 0) & (R[i] < 1 + 1e-9)
    held[0::2], held[1::2] = far | (i == 0), far | top
    value[1::2][top] = 1 - R[i][top] ** 2 / 2
    i, j = np.divmod(np.arange(np_), z.size)
    drained = (i == r.size - 1) | (j == z.size - 1) | ((j == 0) & ((r[i] > 1 - 1e-9) | (not sealed)))
    u, p, loaded = np.flatnonzero(~held), np.flatnonzero(~drained), 2 * np.flatnonzero(top) + 1
    K_, B_, L_, right = K[u][:, u], B[p][:, u], L[p][:, p], -(K[u] @ value)
    solver = lambda dt: splu(sp.bmat([[K_, -B_.T], [-B_, -dt * L_]], format="csc"))

    def force(x):
        whole, pore = value.copy(), np.zeros(np_)
        whole[u], pore[p] = x[: u.size], x[u.size :]
        return (K @ whole - B.T @ pore)[loaded].sum()

    relaxed = force(np.append(splu(K_.tocsc()).solve(right), np.zeros(p.size)))
    x = solver(1e-12).solve(np.append(right, B[p] @ value))  # nothing has left yet
    t, times, found, dt = 0.0, [0.0], [force(x)], first
    while t < end:
        one = solver(STAGE * dt)
        for _ in range(each):
            kept = -(B_ @ x[: u.size])
            stage = one.solve(np.append(right, kept))
            x = one.solve(np.append(right, kept + dt * (1 - STAGE) * (L_ @ stage[u.size :])))
            t += dt
            times.append(t)
            found.append(force(x))
        dt *= 2
    return np.array(times), (np.array(found) - relaxed) / (found[0] - relaxed)
