"""Indentation of a material with an elastic response in volume, against Laplace inversion of the half-space's creep."""

import functools

import mpmath as mp
import numpy as np
import pytest

import fitting
import jaxcontact as jc

TRUTH = {"G1": 2e6, "G2": 1e6, "eta1": 3e8, "eta2": 4e7}
K, R, LOAD = 3e6, 5e-3, 0.02  # near incompressible at last, far from it at first
BALL = jc.Sphere(radius=R)
TIMES = np.concatenate([[0.0], np.geomspace(1.0, 600.0, 40)])


def surface(s):
    """s times the transform of the compliance (1 - nu) j, with j = s J(s) and K held."""
    G1, G2, eta1, eta2 = TRUTH.values()
    j = 1 / G1 + 1 / (G2 + eta2 * s) + 1 / (eta1 * s)
    return (j / 2) * (3 * K * j + 4) / (3 * K * j + 1)


@functools.cache
def responses(control):
    """Depth [m] under a held load, or load [N] at a held depth of 50 um, at ``TIMES``."""
    transform = surface if control == "load" else lambda s: 1 / surface(s)
    with mp.workdps(30):
        at = [float(transform(mp.mpf(10) ** 12))]
        at += [
            float(mp.invertlaplace(lambda s: transform(s) / s, float(t), method="dehoog")) for t in TIMES[1:]
        ]
    if control == "load":
        return (3.0 / (8.0 * np.sqrt(R)) * LOAD * np.array(at)) ** (2 / 3)
    return 8.0 * np.sqrt(R) / 3.0 * (50e-6) ** 1.5 * np.array(at)


def press(control, bulk_modulus=K, **options):
    held = np.full(TIMES.size, LOAD if control == "load" else 50e-6)
    load, depth = (held, responses(control)) if control == "load" else (responses(control), held)
    data = fitting.IndentationData(t=TIMES, load=load, depth=depth)
    return fitting.fit_indentation(
        data, "Burgers", indenter=BALL, bulk_modulus=bulk_modulus, control=control, **options
    )


@pytest.mark.slow
@pytest.mark.parametrize("control", ["load", pytest.param("depth", marks=pytest.mark.slow)])
def test_shear_creep_is_recovered_where_the_volume_stays_elastic(control):
    found = press(control)
    for name, value in TRUTH.items():
        assert found.values[name] == pytest.approx(value, rel=1e-5), name
    assert float(found.material.bulk_modulus) == K and found.nu is None
    assert "conditional on bulk_modulus = 3e+06 Pa" in found.summary()


@pytest.mark.slow
def test_a_bulk_modulus_that_is_uncertain_moves_the_fit():
    """The share of a prediction by gradients against fitting again with another bulk modulus."""
    fit, other = (press("load", bulk, sigma=1e-8) for bulk in (K, 1.001 * K))
    band = fitting.propagate(fit, lambda material: material.creep(900.0), spread={"bulk_modulus": 0.1 * K})
    moved = (other.predict(900.0) - fit.predict(900.0)) / 0.001 * 0.1
    assert float(band.shares["bulk_modulus"]) == pytest.approx(abs(float(moved)), rel=5e-3)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"nu": 0.3}, "exactly one of nu and bulk_modulus"),
        ({"bulk_modulus": None}, "exactly one of nu and bulk_modulus"),
        ({"bulk_modulus": -1.0}, "> 0 Pa, got -1"),
        ({"bulk_modulus": "3 MPa"}, "> 0 Pa, got '3 MPa'"),
    ],
)
def test_what_is_held_in_volume_is_one_number(options, words):
    data = fitting.IndentationData(t=TIMES, load=np.full(TIMES.size, LOAD), depth=1e-5 * (1.0 + TIMES))
    with pytest.raises(ValueError, match=words):
        fitting.fit_indentation(data, indenter=BALL, **{"bulk_modulus": K} | options)
