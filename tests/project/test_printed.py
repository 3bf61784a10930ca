"""What ``print`` shows of every public object: a few lines of names, ranges and units, never raw arrays."""

import dataclasses
import inspect
from concurrent.futures import ThreadPoolExecutor

import jax
import numpy as np
import pytest
from bodies import FILM, STEEL
from force_curves import force_curve
from test_storage import made_up

import fitting
import jaxcontact as jc
from jaxcontact.results import storage

MOST_LINES, LONGEST = 40, 160
RAMP = np.linspace(0.0, 60.0, 500)
X = np.linspace(-1.0, 1.0, 64)
HEIGHTS = 1e-6 * (X[:, None] ** 2 + X**2)
GRID = jc.Grid.square(64, 64e-6)
SERIES = jc.Prony(J0=1e-9, J=np.full(30, 1e-10), tau=np.geomspace(1.0, 1e6, 30), nu=0.3)
BODY = jc.LayeredHalfSpace([jc.Layer(FILM, 150e-9), jc.Layer(SERIES, 1e-6)], STEEL)
HISTORY = made_up(jc.ContactHistory)


def study(folder):
    def f(case):
        if case["x"] > 3:
            raise ValueError("x: expected at most 3")
        return {"map": np.zeros((50, 50))}

    return jc.sweep(f, [{"x": x} for x in range(100)], folder, executor=ThreadPoolExecutor(1))


OBJECTS = {
    "Approach": lambda: jc.Approach(1e-9 * RAMP),
    "Load": lambda: jc.Load(RAMP),
    "TangentialLoad": lambda: jc.TangentialLoad(np.stack([RAMP, RAMP], 1)),
    "TangentialDisplacement": lambda: jc.TangentialDisplacement(np.stack([RAMP, RAMP], 1)),
    "ExponentialAdhesion": lambda: jc.ExponentialAdhesion(50e-3, 2e-9),
    "DugdaleAdhesion": lambda: jc.DugdaleAdhesion(50e-3, 20e6),
    "Elastic": lambda: STEEL,
    "Maxwell": lambda: jc.Maxwell(1e9, 1e12),
    "KelvinVoigt": lambda: jc.KelvinVoigt(1e9, 1e12),
    "StandardLinearSolid": lambda: jc.StandardLinearSolid(1e9, 1e9, 1e12),
    "Burgers": lambda: FILM,
    "Prony": lambda: SERIES,
    "Springpot": lambda: jc.Springpot(1e9, 0.4),
    "FractionalMaxwell": lambda: jc.FractionalMaxwell(1e9, 1e9, 0.4),
    "FractionalKelvinVoigt": lambda: jc.FractionalKelvinVoigt(1e9, 1e9, 0.4),
    "FractionalZener": lambda: jc.FractionalZener(1e9, 1e9, 1e9, 0.4),
    "Layer": lambda: jc.Layer(FILM, 1e-9 * (1.0 + RAMP)),
    "Graded": lambda: jc.Graded(lambda depth: jc.Elastic(1e9), 1e-6),
    "LayeredHalfSpace": lambda: BODY,
    "Grid": lambda: GRID,
    "Sphere": lambda: jc.Sphere(5e-3, STEEL),
    "Cone": lambda: jc.Cone(1.2),
    "Cylinder": lambda: jc.Cylinder(1e-3, 1e-3),
    "FlatPunch": lambda: jc.FlatPunch(1e-3),
    "Ellipsoid": lambda: jc.Ellipsoid((1e-3, 2e-3)),
    "HeightField": lambda: jc.HeightField(HEIGHTS, STEEL),
    **{name: lambda kind=kind: made_up(kind) for name, kind in storage.result_classes().items()},
    "Deflection": lambda: jc.Deflection(
        GRID, np.arange(3.0), np.full((3, *GRID.shape), 1e-6), np.zeros(3), np.zeros(()), np.zeros(3, int)
    ),
    "ContactClusters": lambda: jc.contact_clusters(HISTORY),
    "ContactStatistics": lambda: jc.contact_statistics(HISTORY),
    "PressureHistogram": lambda: jc.pressure_histogram(HISTORY),
    "Sensitivity": lambda: jc.Sensitivity(("G1", "G2"), {"load": np.ones((2, 500))}),
    "Surface": lambda: jc.Surface(HEIGHTS, GRID),
    "ArrheniusShift": lambda: jc.ArrheniusShift(1.6e-19, 373.0),
    "WLFShift": lambda: jc.WLFShift(17.44, 51.6, 373.0),
    "Archard": lambda: jc.Archard(1e-18),
    "ProportionalRemoval": lambda: jc.ProportionalRemoval(1e-3),
    "StressActivated": lambda: jc.StressActivated(1e-2, 1e-19, 4e-30, None, stress="shear"),
    "Thermal": lambda: jc.Thermal(373.0, 46.0),
    "ThermalBody": lambda: jc.ThermalBody(46.0, 1.2e-5),
    "ThermalFilm": lambda: jc.ThermalFilm(1e-6, 1.0, 1e-6),
    "SurfaceStatistics": lambda: jc.surface_statistics(HEIGHTS, GRID),
    "Status": lambda: jc.Status.FINE,
    "kernels": lambda: jc.kernels(jc.LayeredHalfSpace([], FILM), jc.Sphere(1e-3), GRID),
}
T = np.linspace(0.5, 10.0, 200)
J = 1e-6 * (1.0 + T) * (1.0 + 0.01 * np.sin(37.0 * T))
CREEP = fitting.CreepData(t=T, J=J, start=0.0)


def fit():
    return fitting.fit_creep(CREEP, "Maxwell", weights="relative")


def indentation():
    depth = (3.0 * 1e-3 * 0.75 * J / (8.0 * np.sqrt(1e-3))) ** (2.0 / 3.0)
    return fitting.IndentationData(t=T, load=np.full(200, 1e-3), depth=depth, sigma_depth=1e-3 * depth)


def relaxation():
    return fitting.RelaxationData(t=T, modulus=1e6 * np.exp(-T / 5.0), start=0.0)


def stiffness():
    depth = np.linspace(2e-8, 4e-7, 30)
    return fitting.StiffnessData(depth=depth, stiffness=1e11 * np.sqrt(5e-6 * depth))


def oscillation():
    omega = np.geomspace(1e-2, 1e2, 50)
    return fitting.OscillationData(
        omega=omega, storage=1e6 * omega**2 / (1 + omega**2), loss=1e6 * omega / (1 + omega**2)
    )


def microscope_curve():
    t = np.linspace(0.0, 1.0, 100)
    load = 1e-8 * np.maximum(t - 0.5, 0.0) ** 1.5
    return fitting.IndentationData(t=t, load=load, depth=2e-6 * t)


def melts():
    omega = np.geomspace(0.1, 100.0, 15)
    curves = []
    for T, shift in ((380.0, 3.0), (400.0, 1.0), (420.0, 0.4)):
        G = 1e5 * 1j * omega * shift / (1.0 + 1j * omega * shift)
        curves.append(fitting.OscillationData(omega, G.real, G.imag, temperature=T))
    return curves


def growth():
    kinetics = fitting.GrowthKinetics(1e-2, 1.2e-19, 4e-30, 0.2)
    conditions = [(3e8, 353.0), (9e8, 353.0), (3e8, 393.0)]
    return [
        fitting.GrowthData(T, kinetics.thickness(T, *one), stress=one[0], temperature=one[1])
        for one in conditions
    ]


def posterior():
    some = {"G": np.full(4000, 1e6), "eta": np.full(4000, 1e6)}
    ends, one = dict.fromkeys(some, (1e6, 2e6)), dict.fromkeys(some, 1.0)
    return fitting.Posterior(
        fit=fit(), samples=some, intervals=ends, medians=one, prior=ends, open=("G",), r_hat=one, ess=one,
        nuisances={}, divergent=0.0, draws=np.ones((4000, 3)),
    )  # fmt: skip


def fields():
    image = np.random.default_rng(0).random((1, 24, 24)) * 1e6
    return fitting.ContactData([0.0], jc.Load(1.0), {"pressure": image}, jc.Grid.square(24, 300e-6))


def field_fit():
    grid, ball = jc.Grid.square(24, 400e-6), jc.Sphere(5e-3)
    body = lambda p: jc.LayeredHalfSpace([], substrate=jc.Elastic(G=p["G"], nu=0.3))
    return fitting.fit_fields(fields(), body, {"G": 2e9}, indenter=ball, grid=grid, align="none")


def gel_hold(depth):
    gel, t = fitting.Poroelastic(G=10e3, nu=0.2, D=1e-10), np.geomspace(0.01, 50.0, 80)
    noise = 1.0 + 0.01 * np.random.default_rng(0).standard_normal(80)
    load = gel.force(t, depth, jc.Sphere(50e-6)) * noise
    return fitting.IndentationData(t=t, load=load, depth=np.full(80, depth))


OF_FITS = {
    "ContactData": fields,
    "FieldFit": field_fit,
    "CreepData": lambda: CREEP,
    "IndentationData": indentation,
    "RelaxationData": relaxation,
    "OscillationData": oscillation,
    "CreepFit": fit,
    "Propagated": lambda: fitting.propagate(fit(), lambda material: material.creep(RAMP)),
    "Posterior": posterior,
    "BatchFit": lambda: fitting.fit_creep_batch(T, [J] * 3, "Maxwell", weights="relative"),
    "Comparison": lambda: fitting.Comparison((fit(),)),
    "Minimum": lambda: fitting.Minimum(RAMP, 1.0, True, "the gradient is small", RAMP, RAMP, 7),
    "Design": lambda: fitting.design(jc.Maxwell(1e6, 1e6), points=50),
    "ModulusFit": lambda: fitting.fit_relaxation(relaxation(), "Maxwell"),
    "PronyFit": lambda: fitting.fit_prony(CREEP, 2),
    "GrowthData": lambda: growth()[0],
    "GrowthKinetics": lambda: fitting.GrowthKinetics(1e-2, 1.2e-19, 4e-30, 1e-4),
    "GrowthFit": lambda: fitting.fit_growth(growth(), weights="absolute"),
    "RubbedContact": lambda: fitting.RubbedContact(
        BODY, jc.Sphere(5e-3), GRID, velocity=0.1, friction=0.1, radius=1e-6, thickest=1e-6
    ),
    "MaxwellFit": lambda: fitting.fit_maxwell(relaxation()),
    "MasterFit": lambda: fitting.fit_master(melts()),
    "StiffnessData": stiffness,
    "SpectrumFit": lambda: fitting.fit_spectrum(oscillation()),
    "StiffnessFit": lambda: fitting.fit_stiffness(stiffness(), indenter=jc.Sphere(5e-6)),
    "Poroelastic": lambda: fitting.Poroelastic(G=1e4, nu=0.2, D=1e-10),
    "PoroelasticFit": lambda: fitting.fit_poroelastic(gel_hold(2e-6), indenter=jc.Sphere(50e-6)),
    "RelaxationCause": lambda: fitting.relaxation_cause(
        [gel_hold(2e-6), gel_hold(6e-6)], indenter=jc.Sphere(50e-6)
    ),
    "ForceFit": lambda: fitting.fit_force(microscope_curve(), indenter=jc.Sphere(5e-6)),
    "MapFit": lambda: fitting.fit_map([microscope_curve()], indenter=jc.Sphere(5e-6)),
    "ViscoelasticForceFit": lambda: fitting.fit_force(
        microscope_curve(), indenter=jc.Sphere(5e-6), model="Springpot"
    ),
    "AdhesiveFit": lambda: fitting.fit_indentation(
        force_curve(None),
        "Elastic",
        indenter=jc.Sphere(5e-6),
        nu=0.5,
        control="depth",
        contact_point="fit",
        adhesion="JKR",
    ),
    "JointFit": lambda: fitting.fit_together([CREEP, relaxation()], "Maxwell"),
    "IndentationFit": lambda: fitting.fit_indentation(
        indentation(), model=jc.Maxwell, indenter=jc.Sphere(1e-3), nu=0.5, control="load"
    ),
}
DEAR = {
    "MapFit",
    "AdhesiveFit",
    "BatchFit",
    "Design",
    "FieldFit",
    "GrowthFit",
    "ModulusFit",
    "PoroelasticFit",
    "PronyFit",
    "JointFit",
    "IndentationFit",
    "MasterFit",
    "MaxwellFit",
}


def test_every_public_class_is_here():
    for module, objects in ((jc, OBJECTS), (fitting, OF_FITS)):
        classes = {name for name in module.__all__ if inspect.isclass(getattr(module, name))}
        assert classes - {"Study", "NumpyFunction"} <= set(objects)


def check(thing, name):
    for text in (repr(thing), str(thing)):
        lines = text.splitlines()
        assert 0 < len(lines) <= MOST_LINES and max(map(len, lines)) <= LONGEST, text
        for raw in ("array(", "Array(", "[[", "dtype", "...", " object at 0x", "{"):
            assert raw not in text, text
        assert name == "kernels" or type(thing).__name__ == name
    if "HeightField" in name or name == "Surface":
        assert "64 x 64 from 5.0" in text and "to 2e-06>" in text


@pytest.mark.parametrize("name", OBJECTS)
def test_objects_of_a_simulation_are_printed_in_words(name):
    check(OBJECTS[name](), name)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            name, marks=[pytest.mark.long if name == "FieldFit" else pytest.mark.slow] * (name in DEAR)
        )
        for name in OF_FITS
    ],
)
def test_objects_of_a_fit_are_printed_in_words(name):
    check(OF_FITS[name](), name)


def test_a_study_shows_how_many_cases_failed_and_some_of_them(tmp_path):
    text = repr(study(tmp_path))
    assert text.startswith("4 of 100 cases are in") and "failed: 76 more; study.failures has all" in text
    assert len(text.splitlines()) <= MOST_LINES


def test_numbers_are_printed_as_they_are_and_units_with_prefixes():
    """A number is not rounded, a few are listed, many are a range; of stresses the largest and where it is."""
    assert repr(jc.Load(60.123456789)) == "Load(value=60.123456789)"
    assert repr(jc.Load(np.array([0.0, 30.5]))) == "Load(value=[0.0, 30.5])"
    assert repr(jc.Load(RAMP)) == "Load(value=<500 from 0 to 60>)"
    stress = np.zeros((3, 3, 3, *GRID.shape))
    stress[1, 0, 0, 20, 5] = 4e6
    inside = jc.InteriorFields(GRID, np.array([1e-6, 2e-6, 5e-6]), stress, np.zeros((3, 3, *GRID.shape)))
    text = str(inside)
    assert "3 depths from 1 µm to 5 µm on 64 x 64 cells of 1 µm" in text
    assert "peak of von Mises stress 4 MPa at (x, y, z) = (-11.5 µm, -26.5 µm, 2 µm)" in text
    assert inside.notes == () and "note" not in text
    invalid = dataclasses.replace(inside, stress=np.full_like(stress, np.nan))
    assert "note: a value is outside its range" in str(invalid)


def test_traced_objects_are_printed_too():
    """What is traced by its structure, what has numbers by these."""
    texts = []

    @jax.jit
    def f(load, result):
        texts.extend([repr(jc.Load(load)), repr(result), repr(made_up(jc.InteriorFields)), repr(HISTORY)])
        return load

    f(RAMP, HISTORY)
    assert all(0 < len(text) < 3000 for text in texts) and texts[1].startswith("ContactHistory of status")
    assert texts[2] == repr(made_up(jc.InteriorFields)) and texts[3] == repr(HISTORY)
