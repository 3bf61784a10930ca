"""A finite element model of a film of varying thickness, an oracle of its own: plane strain, periodic, quadratic elements.

The film stands on the flat top of a base that is DEPTH periods deep and fixed below. It needs scikit-fem and shares no code
with the package.
"""

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

ROWS, IN_FILM, IN_BASE, DEPTH, FINEST = 96, 6, 24, 3.0, 1e-3


def surface_displacement(thickness, pressure, film, base, x):
    """Return the displacement into the body at x (n,) of one period [0, 1] under a pressure per projected length.

    thickness, pressure: functions of x with period 1; film, base: (G, nu) each.
    """
    import skfem
    from skfem.helpers import ddot, sym_grad, trace

    depths = np.geomspace(FINEST, 1.0, IN_BASE)
    below = -DEPTH * (depths - depths[0]) / (1.0 - depths[0])
    levels = np.concatenate([below[::-1], np.linspace(0.0, 1.0, IN_FILM + 1)[1:]])
    flat = skfem.MeshQuad.init_tensor(np.linspace(0.0, 1.0, ROWS + 1), levels)
    nodes = skfem.MeshQuad2.from_mesh(flat).doflocs.copy()
    in_film = nodes[1] > 1e-12
    nodes[1, in_film] *= thickness(nodes[0, in_film])
    mesh = skfem.MeshQuad2(nodes, skfem.MeshQuad2.from_mesh(flat).t)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementQuad2()), intorder=4)
    of_film = (flat.p[1][flat.t].mean(0) > 0.0)[:, None]
    shear, poisson = (
        np.where(of_film, f, b) * np.ones_like(basis.dx) for f, b in zip(film, base, strict=True)
    )
    lame = 2.0 * shear * poisson / (1.0 - 2.0 * poisson)

    @skfem.BilinearForm
    def stiffness(u, v, w):
        strain, test = sym_grad(u), sym_grad(v)
        return w.lame * trace(strain) * trace(test) + 2.0 * w.shear * ddot(strain, test)

    top = flat.facets_satisfying(lambda x: np.abs(x[1] - 1.0) < 1e-9)
    edge = skfem.FacetBasis(mesh, basis.elem, facets=top, intorder=6)

    @skfem.LinearForm
    def load(v, w):
        return -pressure(w.x[0]) * v[1] * np.abs(w.n[1])

    matrix, force = stiffness.assemble(basis, lame=lame, shear=shear), load.assemble(edge)
    places = basis.doflocs
    join = _periodic(basis, places)
    fixed = np.unique(join.indices[np.abs(places[1] + DEPTH) < 1e-9])
    free = np.setdiff1d(np.arange(join.shape[1]), fixed)
    joined = (join.T @ matrix @ join).tocsc()
    solution = np.zeros(join.shape[1])
    solution[free] = spsolve(joined[free][:, free], (join.T @ force)[free])
    surface = basis.get_dofs(top).all("u^2")
    order = np.argsort(places[0, surface])
    return np.interp(x, places[0, surface][order], -(join @ solution)[surface][order])


def _periodic(basis, places):
    """Return the matrix that gives both sides of the period the same displacements."""
    component = np.zeros(places.shape[1], int)
    for dofs in (basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs):
        component[dofs[1]] = 1
    sides = [np.flatnonzero(np.abs(places[0] - x) < 1e-9) for x in (0.0, 1.0)]
    left, right = (side[np.lexsort((places[1, side], component[side]))] for side in sides)
    assert np.allclose(places[1, left], places[1, right])
    master = np.arange(places.shape[1])
    master[right] = left
    kept, index = np.unique(master, return_inverse=True)
    return sparse.csr_matrix(
        (np.ones(master.size), (np.arange(master.size), index)), (master.size, kept.size)
    )
