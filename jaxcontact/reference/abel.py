"""Ball and punch on a bonded layer over an elastic half-space: Abel transform and a Legendre-Galerkin solution.

With p(r) = int_r^a -g'(t)/sqrt(t^2 - r^2) dt and alpha N = A (1 + H), the contact equation is

    g(t) + (1/pi) int_-a^a g(s) k(t - s) ds = (2/(pi A)) (delta - t^2/R),  k(x) = int_0^inf H cos(alpha x) dalpha,

for a paraboloid of radius R, g(a) = 0; W = 2 pi int_0^a g. A is the compliance at infinite wavenumber (layer and
indenter), so that H decays like exp(-2 alpha h). g is a series of even Legendre polynomials of t/a; their
cosine transforms are spherical Bessel functions, so k is never formed, and the edge layers of a thin film are
resolved by the clustering of the polynomials' zeros. Source of the response: Wang et al., Tribology Letters 2025,
Appendix A, in compact form; for a viscoelastic layer the correspondence principle makes its modulus a function of the
Laplace variable.

Measured errors: approach 1e-9, radius and peak pressure 1e-5 (60 modes against 100, film of h/a = 1e-3 on steel);
the tables of O'Sullivan and King are reproduced to 1e-8, punch creep to 1e-8; the growing contact, 40 steps to 2000 s,
to 6e-5 in the radius and 2e-5 in the approach (a film of 10 to 50 um, against 80 steps and an independent march).

A `Layered` body here is a tuple of plain numbers. Lengths in m, moduli in Pa, loads in N, times in s.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.special import spherical_jn

from jaxcontact.reference.layered_solid import surface_response

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
CUTOFF = 15.0  # alpha h beyond which H < exp(-30) (2 alpha h)^2 = 1e-10
LONGEST = 1e-6  # alpha times the thickness of all layers below which a stack is equivalent to its half-space
TALBOT = 24  # number of nodes, for an error of 1e-12 for smooth monotone functions of time


class Layered(NamedTuple):
    """A layer of shear modulus G [Pa], nu and thickness [m] on a substrate; an elastic indenter's (1 - nu)/G [1/Pa]."""

    layer_modulus: complex
    layer_nu: float
    thickness: float
    substrate_modulus: float
    substrate_nu: float
    indenter_compliance: float = 0.0

    def with_modulus(self, modulus):
        """Return the body with another modulus of the layer."""
        return self._replace(layer_modulus=modulus)


class LayerStack(NamedTuple):
    """Layers on a half-space, and an elastic indenter's (1 - nu)/G [1/Pa].

    Shear moduli [Pa] and nu are given from the top down, (layers + 1,), thicknesses [m] as (layers,).
    """

    moduli: np.ndarray
    poissons: np.ndarray
    thicknesses: np.ndarray
    indenter_compliance: float = 0.0

    @property
    def thickness(self):
        """The thickness of the top layer, which determines the limit of short waves."""
        return self.thicknesses[0]

    @property
    def layer_modulus(self):
        return self.moduli[0]

    @property
    def layer_nu(self):
        return self.poissons[0]

    def with_modulus(self, modulus):
        """Return the body with other moduli of all solids, (layers + 1,)."""
        return self._replace(moduli=modulus)


class Contact(NamedTuple):
    """Load [N], approach [m], radius [m] and the coefficients of g [Pa m] in even Legendre polynomials of t/a."""

    load: float
    approach: float
    radius: float
    coefficients: np.ndarray


def scaled_response(alpha, body):
    """Return alpha N(alpha) [1/Pa] of the layered half-space, in compact form; complex moduli are allowed.

    For k and lambda close to one, as for a stiff layer, their differences from one are computed directly. For a stack,
    the response is found from all interface conditions, with alpha times the total thickness bounded below by
    ``LONGEST``.
    """
    if isinstance(body, LayerStack):
        alpha = np.maximum(alpha, LONGEST / np.sum(body.thicknesses))
        G, nu, h = (np.broadcast_to(part, (*alpha.shape, len(part))) for part in body[:3])
        response = alpha * surface_response(G, nu, h, alpha, np.zeros_like(alpha))[..., 2, 2]
        return response if np.iscomplexobj(body.moduli) else response.real
    Gc, nuc, h, Gs, nus, _ = body
    G, kc, ks, x = Gc / Gs, 3.0 - 4.0 * nuc, 3.0 - 4.0 * nus, alpha * h
    theta, one_less_theta = np.exp(-2.0 * x), -np.expm1(-2.0 * x)
    one_less_k, one_less_lam = (1.0 + kc) / (G + kc), (1.0 + kc) / (1.0 + G * ks)
    k, lam = 1.0 - one_less_k, 1.0 - one_less_lam
    D = (one_less_theta + one_less_lam * theta) * (
        one_less_theta + one_less_k * theta
    ) - 4.0 * k * x**2 * theta
    N = one_less_theta * (1.0 + theta) + (one_less_lam + lam * one_less_k) * theta**2 + 4.0 * x * k * theta
    return (1.0 - nuc) / Gc * N / D


def surface_compliance(body):
    """Return A [1/Pa], the compliance at infinite wavenumber of the layer's material and of the indenter."""
    return (1.0 - body.layer_nu) / body.layer_modulus + body.indenter_compliance


def _panels(end, width):
    """Return composite Gauss nodes and weights on [0, end]."""
    return _gauss(np.linspace(0.0, end, int(np.ceil(end / width)) + 1))


def _waves(end, width):
    """Return nodes and weights on panels graded towards zero, for the very long bending waves of a stiff layer."""
    ends = np.linspace(0.0, end, int(np.ceil(end / width)) + 1)
    return _gauss(np.concatenate([[0.0], np.geomspace(1e-10 * ends[1], ends[1], 40), ends[2:]]))


def _gauss(ends):
    """Return Gauss nodes and weights between adjacent end points."""
    half, mid = 0.5 * np.diff(ends), 0.5 * (ends[1:] + ends[:-1])
    return (mid[:, None] + half[:, None] * NODES).ravel(), (half[:, None] * WEIGHTS).ravel()


def _transforms(x, modes):
    """Return int_-1^1 P_2m(s) cos(x s) ds = 2 (-1)^m j_2m(x), shape (len(x), modes).

    Upward recurrence is used where it is stable (x above the order), scipy below.
    """
    j = np.empty((len(x), 2 * modes))
    low = x < 2 * modes
    j[low] = spherical_jn(np.arange(2 * modes), x[low, None])
    z = x[~low]
    up = [np.sin(z) / z, np.sin(z) / z**2 - np.cos(z) / z]
    for n in range(1, 2 * modes - 1):
        up.append((2 * n + 1) / z * up[n] - up[n - 1])
    j[~low] = np.array(up).T
    return 2.0 * (-1.0) ** np.arange(modes) * j[:, ::2]


@lru_cache(maxsize=4)
def _basis(octave, modes):
    """Return nodes x = alpha a, weights and transforms for every a/h up to 2^(octave/4)."""
    ratio = 2.0 ** (octave / 4)
    x, w = _waves(CUTOFF * ratio, min(2.0 * np.pi, 0.5 * ratio))
    return x, w, _transforms(x, modes)


def _masses(modes):
    """Return int_-1^1 P_2m^2."""
    return 2.0 / (4.0 * np.arange(modes) + 1.0)


def _solve(a, body, columns):
    """Return the coefficients of g for right-hand sides given as Legendre moments; A (1 + H) is applied to g."""
    modes = len(columns)
    x, w, F = _basis(int(np.ceil(4 * np.log2(a / body.thickness))), modes)
    A = surface_compliance(body)
    excess = scaled_response(x / a, body) + body.indenter_compliance - A
    matrix = np.diag(_masses(modes) * A) + (F.T * (w * excess / np.pi)) @ F
    return np.linalg.solve(matrix, columns)


def _sides(a, modes):
    """Return the moments of (2/pi) and (2/pi) t^2 with respect to P_2m(t/a)."""
    sides = np.zeros((modes, 2))
    sides[0, 0] = sides[0, 1] = 2.0 / np.pi
    sides[0, 1] *= a**2 / 3.0
    sides[1, 1] = 2.0 / np.pi * a**2 * 2.0 / 3.0
    return sides * _masses(modes)[:, None]


def solve_radius(contact_radius, body, radius, modes=60):
    """Return the contact of a paraboloid of radius R [m] with contact radius `contact_radius` [m]."""
    flat, curved = _solve(contact_radius, body, _sides(contact_radius, modes)).T
    approach = curved.sum() / flat.sum() / radius
    g = approach * flat - curved / radius
    return Contact(2.0 * np.pi * contact_radius * g[0], approach, contact_radius, g)


def adhesive_contact(contact_radius, body, radius, work, modes=100):
    """Contact of a paraboloid of radius R [m] over `contact_radius` [m] with adhesion of short range, `work` [J/m^2].

    At the edge g(a) = -sqrt(4 a w/(pi A)), whose square is the energy release rate of the edge as a crack; A is that
    of short waves, as an edge sees the surface alone. On a half-space that is the theory of Johnson, Kendall and
    Roberts.
    """
    flat, curved = _solve(contact_radius, body, _sides(contact_radius, modes)).T
    edge = -np.sqrt(4.0 * contact_radius * work / (np.pi * surface_compliance(body)))
    approach = (edge + curved.sum() / radius) / flat.sum()
    g = approach * flat - curved / radius
    return Contact(2.0 * np.pi * contact_radius * g[0], approach, contact_radius, g)


def _guess(load, body, radius):
    """Return Hertz's radius for the compliance at the wavenumber 2/a, by fixed-point iteration."""
    a = 2.0 * body.thickness
    for _ in range(40):
        A = scaled_response(2.0 / a, body) + body.indenter_compliance
        a = np.sqrt(a * np.cbrt(0.375 * load * radius * A.real))
    return a


def solve_load(load, body, radius, modes=60):
    """Return the contact of a paraboloid of radius R [m] under `load` [N]."""
    return _carrying(load, lambda a: solve_radius(a, body, radius, modes), _guess(load, body, radius), 1e-2)


def _carrying(load, contact_of, start, step):
    """Return the contact whose radius carries the load, by the secant method in log a from a start and a step beside it."""
    x0, x1 = np.log(start), np.log(start) + step
    f0 = np.log(contact_of(np.exp(x0)).load / load)
    for _ in range(30):
        contact = contact_of(np.exp(x1))
        f1 = np.log(contact.load / load)
        if abs(f1) < 1e-11:
            return contact
        x0, x1, f0 = x1, x1 - f1 * (x1 - x0) / (f1 - f0), f1
    raise RuntimeError("the contact radius was not found")


def pressure(r, contact):
    """Return p(r) = int_r^a -g'(t)/sqrt(t^2 - r^2) dt [Pa], zero outside; the variable is v = sqrt(t^2 - r^2)."""
    r, a = np.atleast_1d(np.asarray(r, float)), contact.radius
    full = np.zeros(2 * len(contact.coefficients) - 1)
    full[::2] = contact.coefficients
    x, w = np.polynomial.legendre.leggauss(2 * len(full))
    reach = 0.5 * np.sqrt(np.maximum(a**2 - r**2, 0.0))[:, None]
    t = np.sqrt(r[:, None] ** 2 + (reach * (1.0 + x)) ** 2) / a
    slope = np.polynomial.legendre.legval(t, np.polynomial.legendre.legder(full))
    return -(reach * slope / (t * a**2)) @ w


def punch_compliance(punch_radius, body, modes=60):
    """Return delta/W [m/N] of a flat punch; complex for a complex layer modulus."""
    flat = _solve(punch_radius, body, _sides(punch_radius, modes)[:, :1])[0, 0]
    return 1.0 / (2.0 * np.pi * punch_radius * flat)


def talbot(transform, t):
    """Return f(t) from its Laplace transform of the complex s, by the modified Talbot contour."""
    theta = (2.0 * np.arange(TALBOT // 2) + 1.0) * np.pi / TALBOT
    u = 0.6407 * theta
    z = TALBOT * (0.5017 * theta / np.tan(u) - 0.6122 + 0.2645j * theta)
    slope = TALBOT * (0.5017 / np.tan(u) - 0.5017 * u / np.sin(u) ** 2 + 0.2645j)
    terms = (np.exp(p) * transform(p / t) * d for p, d in zip(z, slope, strict=True))
    return 2.0 / TALBOT / t * sum(term.imag for term in terms)


def punch_creep(t, punch_radius, body, modulus, modes=60):
    """Return delta(t)/W [m/N] of a flat punch under a step load; `modulus` is the layer's g(s) = 1/(s J(s)) [Pa]."""

    def transform(s):
        return punch_compliance(punch_radius, body.with_modulus(modulus(s)), modes) / s

    return talbot(transform, t)


def _tables(body, modulus, alpha, step, steps):
    """Return compliances (constant part, and excess over it at alpha) at times n step, and their means over each step."""

    def at(g):
        layer = body.with_modulus(g)
        A = surface_compliance(layer)
        return np.append(A, scaled_response(alpha, layer) + body.indenter_compliance - A)

    times = step * np.arange(1, steps + 1)
    first = at(modulus(1e9 / step)).real
    values = np.array([first] + [talbot(lambda s: at(modulus(s)) / s, t) for t in times])
    sums = np.array([0 * first] + [talbot(lambda s: at(modulus(s)) / s**2, t) for t in times])
    return values, np.diff(sums, axis=0) / step


class _Trial(NamedTuple):
    """Data of one instant: wavenumbers, weights, current compliance, and the contribution of the past, in waves and at
    nodes.
    """

    alpha: np.ndarray
    weights: np.ndarray
    compliance: np.ndarray
    past: np.ndarray
    nodes: np.ndarray
    node_weights: np.ndarray
    local: np.ndarray
    modes: int


def _instant(a, trial, radius):
    """Return the contact of radius a, with the displacement due to the past subtracted from the gap."""
    F = _transforms(trial.alpha * a, trial.modes)
    A, excess = trial.compliance[0], trial.compliance[1:]
    matrix = np.diag(_masses(trial.modes) * A) + (F.T * (a * trial.weights * excess / np.pi)) @ F
    legendre = np.polynomial.legendre.legvander(trial.nodes / a, 2 * trial.modes - 2)[:, ::2]
    past = F.T @ (trial.weights * trial.past) / np.pi
    past = past + 2.0 / a * legendre.T @ (trial.node_weights * trial.local)
    flat, curved, old = np.linalg.solve(matrix, np.column_stack([_sides(a, trial.modes), past])).T
    approach = (curved.sum() / radius + old.sum()) / flat.sum()
    g = approach * flat - curved / radius - old
    return Contact(2.0 * np.pi * a * g[0], approach, a, g)


def _on_nodes(contact, nodes):
    """Return g at the nodes, zero outside its contact."""
    full = np.zeros(2 * len(contact.coefficients) - 1)
    full[::2] = contact.coefficients
    s = nodes / contact.radius
    return np.where(s <= 1.0, np.polynomial.legendre.legval(np.minimum(s, 1.0), full), 0.0)


def _weights(n, values, means):
    """Return the compliances that multiply g of each instant 0..n, for g linear in time between instants."""
    return [values[n] - means[n - 1]] + [means[n - j] - means[n - j - 1] for j in range(1, n)] + [means[0]]


def march_step_load(load, duration, steps, body, modulus, radius, modes=30):
    """Return contacts at equal time steps over [0, duration] under a step load, for a growing contact.

    The layer creeps by the exact correspondence principle at constant nu: modulus(s) = g(s) = 1/(s J(s)) [Pa];
    the past enters as a Duhamel integral of Talbot inversions, with g linear in time between instants. The layer
    modulus of `body` is not used.
    """
    slow = body.with_modulus(1.0 / talbot(lambda s: 1.0 / (s * modulus(s)), duration))
    largest = 1.3 * solve_load(load, slow, radius, modes).radius
    alpha, w = _waves(CUTOFF / body.thickness, min(2.0 * np.pi / largest, 0.5 / body.thickness))
    values, means = _tables(body, modulus, alpha, duration / steps, steps)
    start = solve_load(load, body.with_modulus(modulus(1e9 * steps / duration).real), radius, modes)
    contacts, spectra = [start], []
    nodes, node_weights = _panels(start.radius, start.radius / 12)
    for n in range(1, steps + 1):
        last = contacts[-1]
        spectra.append(last.radius * _transforms(alpha * last.radius, modes) @ last.coefficients)
        share = np.array(_weights(n, values, means))
        local = sum(s[0] * _on_nodes(c, nodes) for s, c in zip(share, contacts, strict=False))
        past = sum(s[1:] * q for s, q in zip(share, spectra, strict=False))
        trial = _Trial(alpha, w, share[-1], past, nodes, node_weights, local, modes)
        at_radius = lambda a, trial=trial: _instant(a, trial, radius)
        contacts.append(_carrying(load, at_radius, last.radius, 1e-3))
        x, dx = _panels(contacts[-1].radius - last.radius, contacts[-1].radius)
        nodes, node_weights = np.append(nodes, last.radius + x), np.append(node_weights, dx)
    return contacts
