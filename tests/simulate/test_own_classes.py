"""Materials, indenters and laws of one's own, made from the bases in ``jaxcontact.abc``."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from own_classes import TwoKelvin

import jaxcontact as jc
from jaxcontact.abc import Adhesion, GrowthLaw, Indenter, Material, Spectrum, pytree


@pytree
class Quartic(Indenter):
    """A profile c r^4."""

    c: float

    def profile(self, grid):
        x, y = grid.coordinates()
        return self.c * (x**2 + y**2) ** 2


@pytree
class Decaying(Adhesion):
    """The exponential law, from its two functions alone."""

    work: float
    length: float

    def traction(self, gap):
        return self.work / self.length * jnp.exp(-gap / self.length)

    def energy(self, gap):
        return self.work * jnp.exp(-gap / self.length)


GEL = (2e3, 4e3, 8e3, 4e3, 8e4)


@pytest.mark.parametrize("base", [Material, Indenter, Adhesion, GrowthLaw])
def test_a_class_without_the_decorator_says_so(base):
    """Of an abstract base the missing methods are named first, by Python."""
    methods = dict.fromkeys(getattr(base, "__abstractmethods__", ()), lambda self, *_: 0.0)
    plain = type("Mine", (base,), {"__annotations__": {"work": float}, "nu": 0.3} | methods)
    with pytest.raises(
        TypeError, match=r"Mine: expected the decorator jaxcontact\.abc\.pytree above its class"
    ):
        plain(1.0)
    with pytest.raises(TypeError, match=r"Mine: expected the decorator"):
        plain()
    assert pytree(plain)(1.0).work == 1.0


def test_a_material_with_its_own_constructor_and_no_nu_is_refused():
    class Mine(Material):
        def __init__(self, E):
            object.__setattr__(self, "E", E)

        def spectrum(self):
            return jc.Elastic(self.E / 3.0).spectrum()

    body = jc.LayeredHalfSpace([], Mine(1e9))
    with pytest.raises(ValueError, match="substrate Mine: expected one of nu and bulk_modulus, got neither"):
        jc.indent(body, jc.Sphere(1e-3), jc.Load(1.0), [0.0], grid=jc.Grid.square(16, 1e-4))


@pytest.mark.slow
def test_a_material_without_a_bulk_modulus_is_one_of_constant_poissons_ratio():
    """One without Poisson's ratio says so; the compliance of a spring of 2 Pa at once and a dashpot of 4 Pa s is closed."""

    def spectrum(self):
        return Spectrum(1.0 / jnp.asarray(self.G), jnp.zeros(0), jnp.zeros(0), 1.0 / jnp.asarray(self.eta))

    fields = {"G": float, "eta": float}
    bare = pytree(type("Bare", (Material,), {"__annotations__": fields, "spectrum": spectrum}))
    with pytest.raises(
        TypeError, match=r"Bare: expected a field of Poisson's ratio, such as nu: float = 0\.3"
    ):
        bare(2.0, 4.0)
    fluid = {"__annotations__": fields | {"nu": float}, "nu": 0.4, "spectrum": spectrum}
    fluid = pytree(type("Fluid", (Material,), fluid))(2.0, 4.0)
    assert float(fluid.creep(8.0)) == pytest.approx(0.5 + 8.0 / 4.0, rel=1e-12)
    ball, load, given = jc.Sphere(1e-3), jc.Load(1e-5), {"grid": jc.Grid.square(24, 400e-6), "substeps": 8}
    sunk = lambda solid: jc.indent(jc.LayeredHalfSpace([], solid), ball, load, [0.0, 1.0], **given).approach
    np.testing.assert_allclose(sunk(fluid.scaled(1e3)), sunk(jc.Maxwell(2e3, 4e3, nu=0.4)), rtol=1e-9)


@pytest.mark.slow
def test_indent_with_a_material_of_ones_own():
    """Lee and Radok: approach^(3/2) = 3 (1 - nu) W J(t)/(8 sqrt(R)) with J(t) of the three springs in closed form."""
    times, W, R = np.array([0.0, 1.0, 10.0]), 1e-5, 1e-3
    body, grid = jc.LayeredHalfSpace([], TwoKelvin(*GEL)), jc.Grid.square(48, 400e-6)
    run = jc.indent(body, jc.Sphere(R), jc.Load(W), times, grid=grid, substeps=4)
    J = 1 / 2e3 + (1 - np.exp(-times)) / 4e3 + (1 - np.exp(-times / 10.0)) / 8e3
    np.testing.assert_allclose(run.approach, (3 * 0.6 * W * J / (8 * np.sqrt(R))) ** (2 / 3), rtol=1e-2)


@pytest.mark.slow
def test_a_material_of_ones_own_is_that_of_its_prony_series_and_can_be_differentiated():
    ball, load, grid = jc.Sphere(1e-3), jc.Load(1e-5), jc.Grid.square(24, 400e-6)
    last = lambda solid: jc.indent(
        jc.LayeredHalfSpace([jc.Layer(solid, 2e-4)], jc.Elastic(1e6, 0.3)),
        ball,
        load,
        [0.0, 5.0],
        grid=grid,
        substeps=4,
    ).approach[-1]
    series = lambda G1: jc.Prony(
        J0=1 / 2e3,
        J=jnp.stack([1 / G1, jnp.asarray(1 / 8e3)]),
        tau=jnp.stack([4e3 / G1, jnp.asarray(10.0)]),
        nu=0.4,
    )
    own = lambda G1: TwoKelvin(2e3, G1, 8e3, 4e3, 8e4)
    one, other = (
        jax.jit(jax.value_and_grad(lambda G1, make=make: last(make(G1))))(4e3) for make in (own, series)
    )
    np.testing.assert_allclose(one, other, rtol=1e-6)


@pytest.mark.slow
def test_indent_with_an_indenter_of_ones_own():
    """A rigid power law c r^n: with a^n = approach Gamma((n + 1)/2)/(c sqrt(pi) Gamma(n/2 + 1)), the load is
    2 E* a approach n/(n + 1) (L. A. Galin; I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47)."""
    a, c, G, nu = 2e-4, 1e9, 1e6, 0.4
    approach = c * a**4 * 8.0 / 3.0
    body, grid = jc.LayeredHalfSpace([], jc.Elastic(G, nu)), jc.Grid.square(64, 3 * a)
    run = jc.indent(body, Quartic(c), jc.Approach(approach), [0.0], grid=grid)
    assert float(run.contact_radius[0]) == pytest.approx(a, rel=5e-3)
    assert float(run.load[0]) == pytest.approx(2 * (2 * G / (1 - nu)) * a * approach * 4 / 5, rel=5e-3)


@pytest.mark.long
@pytest.mark.parametrize("verb", ["indent", "slide"])
def test_a_law_of_adhesion_of_ones_own_is_the_built_in_one_of_the_same_formula(verb):
    """Values and derivatives by the work and the range, of an approach to and from a standard linear solid."""
    solid = jc.LayeredHalfSpace([], jc.StandardLinearSolid(2e6, 2e6, 2e6, nu=0.5))
    options = {"grid": jc.Grid.square(20, 9e-6), "substeps": 4, "save": "last"} | (
        {} if verb == "indent" else {"velocity": 3e-7}
    )
    run = lambda law: getattr(jc, verb)(
        solid, jc.Sphere(5e-6), jc.Approach([1e-7, 5e-8]), [0.0, 0.5], adhesion=law, **options
    )

    def values(make):
        def of(q):
            history = run(make(50e-3 * q[0], 150e-9 * q[1]))
            found = jnp.stack(
                [
                    *history.load,
                    *history.tabor_number,
                    history.viscous_energy[-1] * 1e9 if verb == "indent" else history.hysteresis_force[-1],
                ]
            )
            return found, (found, history.status)

        return jax.jit(jax.jacrev(of, has_aux=True))(jnp.ones(2))

    (own, (load, status)), (built, (expected, _)) = values(Decaying), values(jc.ExponentialAdhesion)
    assert not np.any(status)
    np.testing.assert_allclose(load, expected, rtol=1e-9)
    np.testing.assert_allclose(own, built, rtol=1e-7, atol=1e-9 * np.abs(built).max())


def test_a_grid_around_an_indenter_without_an_outline_is_refused():
    with pytest.raises(ValueError, match=r"Grid\.around: expected an indenter with an outline, got Quartic"):
        jc.Grid.around(jc.LayeredHalfSpace([], jc.Elastic(1e6, 0.3)), Quartic(1e9), jc.Load(1.0), [0.0])


@pytest.mark.slow
def test_results_with_a_material_of_ones_own_can_be_saved(tmp_path):
    body, grid = jc.LayeredHalfSpace([], TwoKelvin(*GEL)), jc.Grid.square(24, 400e-6)
    run = jc.indent(body, jc.Sphere(1e-3), jc.Load(1e-5), [0.0, 1.0], grid=grid, substeps=4)
    jc.write_result(run, tmp_path / "run.npz")
    np.testing.assert_array_equal(jc.read_result(tmp_path / "run.npz").pressure, run.pressure)
