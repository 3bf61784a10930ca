"""The texts for finite-element programs, read back here by their own conventions and compared with closed forms."""

import re

import jax.numpy as jnp
import numpy as np
import pytest

import jaxcontact as jc

TIMES = np.append(0.0, np.geomspace(1e-3, 1e5, 60))
RUBBER = jc.StandardLinearSolid(G1=2e6, G2=3e6, eta2=4e7, nu=0.4)
BURGERS = jc.Burgers(G1=0.75e9, G2=13.89e6, eta1=3.1486e12, eta2=120.9e9, nu=0.3)
SERIES = jc.Prony(J0=1e-9, J=np.array([2e-9, 5e-9, 1e-9]), tau=np.array([1.0, 100.0, 7.0]), bulk_modulus=4e9)


def of_abaqus(text):
    """Return G(t) and K(t) over TIMES, in the unit of stress of the text, from *ELASTIC at t = 0 and the pairs g, k, tau."""
    lines = [line for line in text.splitlines() if not line.startswith("**")]
    at = {line: i for i, line in enumerate(lines)}
    E, nu = map(float, lines[at["*ELASTIC, MODULI=INSTANTANEOUS"] + 1].split(","))
    G = np.ones_like(TIMES) * E / (2 * (1 + nu))
    K = np.ones_like(TIMES) * (np.inf if nu == 0.5 else E / (3 * (1 - 2 * nu)))
    start = at.get("*VISCOELASTIC, TIME=PRONY")
    rows = [] if start is None else [tuple(map(float, line.split(","))) for line in lines[start + 1 :]]
    G0, K0 = G.copy(), K.copy()
    for g, k, tau in rows:
        G -= G0 * g * (1 - np.exp(-TIMES / tau))
        K -= K0 * k * (1 - np.exp(-TIMES / tau)) if k else 0.0
    return G, K


def of_ansys(text):
    lines = [line for line in text.splitlines() if not line.startswith("!")]
    E, nu = (
        float(next(row for row in lines if row.startswith(f"MP,{key},")).split(",")[3])
        for key in ("EX", "PRXY")
    )
    tables = {}
    for line in lines:
        words = line.split(",")
        if words[0] == "TB":
            kind, count = words[5], int(words[4])
            tables[kind] = []
        elif words[0] == "TBDATA":
            assert int(words[1]) == len(tables[kind]) + 1  # the constants follow one another
            tables[kind] += map(float, words[2:])
            assert len(words) <= 8 and len(tables[kind]) <= 2 * count
    sums = {}
    for kind in ("SHEAR", "BULK"):
        pairs = np.reshape(tables.get(kind, []), (-1, 2))
        assert kind not in tables or len(pairs) == count
        sums[kind] = 1 - np.sum(pairs[:, 0] * (1 - np.exp(-TIMES[:, None] / pairs[:, 1])), 1)
    K0 = np.inf if nu == 0.5 else E / (3 * (1 - 2 * nu))
    return E / (2 * (1 + nu)) * sums["SHEAR"], K0 * sums["BULK"]


def of_comsol(text):
    elastic = {key: float(re.search(rf"% {key} = (\S+)\[Pa\]", text).group(1)) for key in "GK"}
    rows = [list(map(float, line.split())) for line in text.splitlines() if not line.startswith("%")]
    G, K = elastic["G"] + 0 * TIMES, elastic["K"] + 0 * TIMES
    for i, row in enumerate(rows, 1):
        assert row[0] == i
        G += row[1] * np.exp(-TIMES / row[2])
        K += row[3] * np.exp(-TIMES / row[2]) if len(row) > 3 else 0.0
    return G, K


READ = {"abaqus": of_abaqus, "ansys": of_ansys, "comsol": of_comsol}


@pytest.mark.parametrize("program", READ)
def test_a_standard_solid_is_read_back(program):
    """G(t) = Ge + (G1 - Ge) exp(-(G1 + G2) t/eta2), Ge = G1 G2/(G1 + G2)."""
    G, K = READ[program](getattr(RUBBER, f"to_{program}")())
    exact = 1.2e6 + 0.8e6 * np.exp(-5e6 * TIMES / 4e7)
    np.testing.assert_allclose(G, exact, rtol=1e-12)
    np.testing.assert_allclose(K, exact * 2 * 1.4 / (3 * 0.2), rtol=1e-12)


@pytest.mark.parametrize("program", READ)
def test_a_series_with_an_elastic_volume_is_read_back(program):
    """The relaxation is the one whose convolution with the creep is t, at the level of its quadrature."""
    G, K = READ[program](getattr(SERIES, f"to_{program}")())
    np.testing.assert_allclose(G, SERIES.relaxation(TIMES), rtol=1e-9)
    np.testing.assert_allclose(K, 4e9, rtol=1e-12)
    text = getattr(SERIES, f"to_{program}")()
    assert "relaxation times (not retardation times)" in text and "bulk modulus is elastic" in text


@pytest.mark.parametrize("program", READ)
def test_a_fluid_relaxes_to_zero_or_to_the_long_term_modulus(program):
    export = getattr(BURGERS, f"to_{program}")
    G, _ = READ[program](export())
    np.testing.assert_allclose(G, BURGERS.relaxation(TIMES), rtol=1e-9, atol=1e-9 * 0.75e9)
    assert "a fluid" in export()
    kept, _ = READ[program](export(long_term=1e-3))
    np.testing.assert_allclose(kept[0], 0.75e9, rtol=1e-12)
    assert np.max(np.abs(kept - G)) < 1.01e-3 * 0.75e9
    assert kept[-1] > G[-1] and "long_term" in export(long_term=1e-3)


@pytest.mark.parametrize("program", READ)
@pytest.mark.parametrize(
    "law", [jc.FractionalZener(G1=3e3, G2=1e3, V=2e3, alpha=0.4, nu=0.45), jc.Springpot(V=1e3, alpha=0.2)]
)
def test_a_fractional_law_is_read_back_within_its_stated_error(program, law):
    text = getattr(law, f"to_{program}")(1e-2, 1e3, tolerance=1e-4)
    G, _ = READ[program](text)
    stated = float(re.search(r"is within (\S+) of the law", text).group(1))
    inside = (TIMES >= 1e-2) & (TIMES <= 1e3)
    error = np.max(np.abs(G[inside] / law.relaxation(TIMES[inside]) - 1))
    assert 0.5 * stated < error < 1.2 * stated < 1e-2
    if isinstance(law, jc.FractionalZener):  # a solid keeps its modulus
        np.testing.assert_allclose(G[-1], law.relaxation(1e5), rtol=0.1)


def test_units_and_density_are_those_of_the_system():
    SI, _ = of_abaqus(RUBBER.to_abaqus())
    for units in ("mm", "um"):
        text = RUBBER.to_abaqus(units=units, density=1100.0)
        np.testing.assert_allclose(of_abaqus(text)[0], SI / 1e6, rtol=1e-12)
        density = float(text.split("*DENSITY\n")[1].split(",")[0])
        np.testing.assert_allclose(density, {"mm": 1.1e-9, "um": 1.1e-15}[units], rtol=1e-12)
    assert "MP,DENS,4,1100.0" in RUBBER.to_ansys(4, density=1100.0)


def test_an_elastic_or_incompressible_material():
    steel = jc.Elastic.from_young(210e9, nu=0.3)
    for program, read in READ.items():
        G, K = read(getattr(steel, f"to_{program}")())
        np.testing.assert_allclose(G, 210e9 / 2.6, rtol=1e-12)
        np.testing.assert_allclose(K, 175e9, rtol=1e-12)
    gel = jc.StandardLinearSolid(G1=2e3, G2=1e3, eta2=1e3, nu=0.5)
    np.testing.assert_allclose(of_abaqus(gel.to_abaqus())[0], gel.relaxation(TIMES), rtol=1e-9)
    assert "incompressible" in gel.to_ansys() and "BULK" not in gel.to_ansys()


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: jc.KelvinVoigt(1e3, 1e3).to_abaqus(), "expected a finite modulus at t = 0"),
        (lambda: RUBBER.to_abaqus(units="inch"), "units: expected one of m, mm, um"),
        (lambda: RUBBER.to_ansys(density=-1.0), "density"),
        (lambda: RUBBER.to_comsol(long_term=2.0), "long_term"),
        (lambda: jc.Springpot(1e3, 0.2).to_abaqus(1.0, 0.5), "longest: expected more than shortest"),
        (lambda: RUBBER.to_abaqus("RUBBER, TYPE 2"), "name: expected a letter and up to 79 letters"),
        (lambda: RUBBER.to_abaqus("RUBBER\n*STEP"), "name: expected a letter and up to 79 letters"),
        (lambda: RUBBER.to_abaqus("A" * 81), "name: expected a letter and up to 79 letters"),
        (lambda: RUBBER.to_ansys(0), "number: expected 1 to 999999, got 0"),
        (lambda: RUBBER.to_ansys(2.5), r"number: expected 1 to 999999, got 2\.5"),
        (lambda: jc.Elastic(1e6, nu=0.7).to_comsol(), r"material nu: expected -1 < nu <= 0\.5, got 0\.7"),
        (
            lambda: jc.StandardLinearSolid(2e6, -5e6, 1e6).to_abaqus(),
            "material StandardLinearSolid G2: expected > 0",
        ),
        (lambda: jc.Elastic(np.array([1e6, 2e6])).to_ansys(), "material Elastic G: expected a number"),
    ],
)
def test_what_cannot_be_written_is_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()


@pytest.mark.parametrize("program", ["abaqus", "ansys", "comsol"])
def test_numbers_of_numpy_and_jax_are_written_as_plain_numbers(program):
    fluid = jc.Prony(J0=1e-9, J=np.ones(3) * 1e-9, tau=np.array([1.0, 10.0, 100.0]), fluidity=1e-12, nu=0.3)
    # a modulus at long times for which several terms give up theirs
    for density in (1200.0, np.float64(1200.0), jnp.asarray(1200.0)):
        text = getattr(fluid, f"to_{program}")(long_term=0.4, density=density)
        assert "float64" not in text and "Array" not in text
        assert text == getattr(fluid, f"to_{program}")(long_term=np.float64(0.4), density=1200)
    G, _ = READ[program](text)
    np.testing.assert_allclose(G[[0, -1]], [1e9, 0.4e9], rtol=1e-9)


@pytest.mark.slow
def test_a_least_long_term_modulus_leaves_that_of_a_fractional_solid_as_it_is():
    solid = jc.FractionalZener(G1=3e3, G2=1.5e3, V=2e3, alpha=0.4, nu=0.4)
    assert solid.to_comsol(1e-2, 1e2, long_term=1e-6) == solid.to_comsol(1e-2, 1e2)
    G, _ = of_comsol(solid.to_comsol(1e-2, 1e2, long_term=0.4))
    np.testing.assert_allclose(G[-1], 0.4 * G[0], rtol=1e-9)  # more than the 1/3 of the solid
    springpot = jc.Springpot(V=1e3, alpha=0.2)
    assert "flows" in springpot.to_abaqus(1e-2, 1e2)
    assert "flows" not in springpot.to_abaqus(1e-2, 1e2, long_term=1e-3)
