"""Every verb at lengths of a nanometre and of a metre: the same dimensionless numbers, iterations, notes and derivatives.

Moduli and times are held and lengths multiplied by a factor L, so that forces are multiplied by L^2 and velocities by L. An
absolute tolerance in SI units anywhere makes one of the two runs differ.
"""

import re
import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc

E = 1e9
QUANTITY = re.compile(r"-?\d[\d.]*(e[+-]?\d+)? ?[pnµmkMGT]?(m2|m3|m|N|Pa|W|J)\b")
TIMES = np.array([0.0, 0.5, 2.0])


def grid(L, n=14):
    return jc.Grid((n, n), (1.0 * L, 1.0 * L))


def body(L, q):
    film = jc.StandardLinearSolid(G1=E, G2=0.5 * E, eta2=0.5 * E, nu=0.4)
    return jc.LayeredHalfSpace([jc.Layer(film, 2.0 * L * q["thickness"])], jc.Elastic(G=20.0 * E, nu=0.3))


def solid():
    return jc.LayeredHalfSpace([], jc.StandardLinearSolid(G1=E, G2=0.5 * E, eta2=0.5 * E, nu=0.4))


def ball(L, material=None):
    return jc.Sphere(40.0 * L, material)


def load(L, q):
    return jc.Load(4.0 * E * L**2 * q["load"])


def pressed(run, L):
    """Dimensionless numbers that every contact has."""
    return {"pressure": run.pressure / E, "approach": run.approach / L}


def indent(L, q, **more):
    run = jc.indent(body(L, q), ball(L), load(L, q), TIMES, grid=grid(L), **more)
    return run, pressed(run, L) | {"area": run.smooth_area / L**2, "strain": run.film_strain}


def adhesive(L, q):
    law = jc.DugdaleAdhesion(work=0.05 * E * L, strength=0.2 * E)
    run = jc.indent(body(L, q), ball(L), load(L, q), TIMES, grid=grid(L, 20), adhesion=law, substeps=8)
    return run, pressed(run, L) | {"gap": run.gap / L, "tabor": run.tabor_number}


def mapped(L, q):
    film = jc.StandardLinearSolid(G1=E, G2=0.5 * E, eta2=0.5 * E, nu=0.4)
    thickness = L * q["thickness"] * (2.0 + 0.2 * jnp.sin(jnp.arange(14.0))[:, None] * jnp.ones(14))
    varied = jc.LayeredHalfSpace([jc.Layer(film, thickness)], jc.Elastic(G=20.0 * E, nu=0.3))
    run = jc.indent(varied, ball(L), load(L, q), TIMES, grid=grid(L))
    return run, pressed(run, L)


def slide(L, q):
    run = jc.slide(
        body(L, q), ball(L), load(L, q), TIMES, velocity=0.5 * L, grid=grid(L), friction=0.2, substeps=8
    )
    return run, pressed(run, L) | {"force": run.tangential_force / (E * L**2)}


def slide_steady(L, q):
    run = jc.slide_steady(solid(), ball(L), load(L, q), velocity=2.0 * L, grid=grid(L))
    return run, pressed(run, L) | {
        "force": run.tangential_force / (E * L**2),
        "power": run.power / (E * L**3),
    }


def shear(L, q):
    steel = jc.Elastic(G=20.0 * E, nu=0.3)
    turned = jc.TangentialLoad(jnp.stack([0.4 * E * L**2 * q["load"], jnp.zeros(())]))
    run = jc.shear(
        body(L, q), ball(L, steel), load(L, q), turned, TIMES, friction=0.3, grid=grid(L), substeps=8
    )
    return run, pressed(run, L) | {"traction": run.traction / E, "work": run.dissipated / (E * L**3)}


def roll_steady(L, q):
    steel = jc.Elastic(G=20.0 * E, nu=0.3)
    run = jc.roll_steady(
        body(L, q),
        ball(L, steel),
        load(L, q),
        velocity=2.0 * L,
        creepage=(1e-3, 0.0),
        friction=0.3,
        grid=grid(L),
    )
    return run, pressed(run, L) | {"traction": run.traction / E}


def rub(L, q):
    run = jc.rub(
        body(L, q), ball(L), load(L, q), TIMES, velocity=L, law=jc.Archard(0.05 / E), grid=grid(L), substeps=8
    )
    return run, pressed(run, L) | {"thickness": run.thickness / L}


def subsurface(L, q):
    x, y = grid(L).coordinates()
    pressure = E * q["load"] * jnp.exp(-(x**2 + y**2) / (8.0 * L**2))
    run = jc.subsurface(
        body(L, q),
        grid(L),
        pressure[None] * jnp.ones((3, 1, 1)),
        depths=L * np.array([0.0, 1.0, 3.0]),
        times=TIMES,
    )
    return run, {"stress": run.stress / E, "displacement": run.displacement / L}


def flash_temperature(L, q):
    x, y = grid(L).coordinates()
    flux = 1e9 / L * q["load"] * jnp.exp(-(x**2 + y**2) / (8.0 * L**2))
    film = jc.ThermalFilm(thickness=2.0 * L * q["thickness"], conductivity=1.0, diffusivity=5e-7)
    given = {"conductivity": 50.0, "diffusivity": 1.4e-5, "velocity": 1.4e-5 / L}
    return None, {"rise": jc.flash_temperature(flux, grid(L), film=film, **given)}


VERBS = {
    each.__name__: each
    for each in (
        indent,
        adhesive,
        mapped,
        slide,
        slide_steady,
        shear,
        roll_steady,
        rub,
        subsurface,
        flash_temperature,
    )
}


def numbers_of(verb, L):
    """Values, derivatives, and what the result says of itself with its quantities left out."""

    def total(q):
        run, values = verb(L, q)
        return sum(jnp.sum(jnp.where(v > 0.0, v, 0.0)) for v in values.values()), (run, values)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        slopes, (run, values) = jax.grad(total, has_aux=True)({"load": 1.0, "thickness": 1.0})
    said = {name: np.asarray(getattr(run, name)) for name in ("status", "iterations") if hasattr(run, name)}
    notes = [QUANTITY.sub("#", note) for note in getattr(run, "notes", ())]
    return values, slopes, said, notes


DEAR = ("adhesive", "shear", "slide", "rub", "subsurface", "roll_steady", "mapped")


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long if name in DEAR else ()) for name in VERBS]
)
def test_lengths_of_a_nanometre_and_of_a_metre_give_the_same_numbers(name):
    small, large = numbers_of(VERBS[name], 1e-9), numbers_of(VERBS[name], 1.0)
    for key, values in small[0].items():
        values, others = np.asarray(values), np.asarray(large[0][key])
        assert np.all(np.isfinite(values)) and np.max(np.abs(values)) > 0.0, key
        np.testing.assert_allclose(values, others, rtol=0.0, atol=2e-7 * np.max(np.abs(others)), err_msg=key)
    for key, slope in small[1].items():
        np.testing.assert_allclose(slope, large[1][key], rtol=1e-5, atol=1e-9, err_msg=f"derivative by {key}")
    assert small[3] == large[3]
    if "status" in small[2]:
        np.testing.assert_array_equal(small[2]["status"], large[2]["status"])
        assert np.all(small[2]["status"] == 0), small[2]["status"]
    if "iterations" in small[2]:
        np.testing.assert_allclose(small[2]["iterations"], large[2]["iterations"], atol=3, rtol=0.2)


def test_kernels_of_cells_of_another_size_are_refused_at_half_a_nanometre():
    made, other = jc.Grid.square(8, 8e-9), jc.Grid.square(8, 4e-9)
    q, tip = {"load": 1.0, "thickness": 1.0}, jc.Sphere(50e-9)
    ready = jc.kernels(body(1e-9, q), tip, made)
    with pytest.raises(ValueError, match="kernels: expected those of cells of"):
        jc.indent(body(1e-9, q), tip, jc.Load(1e-9), [0.0], grid=other, kernels=ready)
