"""The names that users rely on: this test fails when one disappears, or when one comes without a decision."""

import inspect
import re
import subprocess
import sys
import tomllib
from importlib import resources
from pathlib import Path

import pytest

import fitting
import jaxcontact as jc

ROOT = Path(__file__).parents[2]

JAXCONTACT = """
Approach Burgers Cone ContactHistory Cylinder Elastic FlatPunch Graded Grid HeightField KelvinVoigt Layer
LayeredHalfSpace Load Maxwell Prony Sensitivity SlidingHistory Sphere StandardLinearSolid SteadySliding cite indent
kernels enable_compilation_cache frequency_response normal_response read_result sensitivity write_result
slide slide_steady Status
ShearHistory Study sweep TangentialDisplacement TangentialLoad shear
InteriorFields subsurface SteadyRolling roll_steady self_affine
ContactClusters ContactStatistics PressureHistogram SurfaceStatistics contact_clusters contact_statistics
pressure_histogram surface_statistics Surface read_surface FractionalKelvinVoigt FractionalMaxwell FractionalZener Springpot
flash_temperature rub RubbingHistory Thermal ThermalFilm Archard ProportionalRemoval StressActivated
ArrheniusShift WLFShift ThermalBody heat_partition
AdhesiveHistory AdhesiveSlidingHistory DugdaleAdhesion ExponentialAdhesion
NumpyFunction Ellipsoid deflection Deflection
"""
FITTING = """
AdhesiveFit BatchFit Comparison CreepData CreepFit Design ForceFit GrowthData GrowthFit GrowthKinetics fit_growth
exclude fit_master fit_maxwell MasterFit MaxwellFit read_sweeps
IndentationData
IndentationFit JointFit ModulusFit OscillationData Posterior PronyFit Propagated RelaxationData compare design
fit_creep fit_creep_batch fit_force fit_indentation fit_oscillation fit_prony fit_relaxation fit_together posterior propagate
read_creep read_force read_growth read_indentation read_oscillation read_relaxation resample Minimum minimise
thin_layer_factor ViscoelasticForceFit
ContactData FieldFit fit_fields RubbedContact
StiffnessData StiffnessFit fit_stiffness read_stiffness SpectrumFit fit_spectrum MapFit fit_map
Poroelastic PoroelasticFit fit_poroelastic RelaxationCause relaxation_cause
"""

FORMER = {"load", "save"}  # of read_result and write_result, not in the reference


def public(module):
    """Classes and functions of a package, without its modules."""
    assert module.indent if module is jc else module  # jaxcontact takes its names when one is first used
    return {
        name
        for name, value in vars(module).items()
        if not name.startswith("_") and not inspect.ismodule(value)
    }


@pytest.mark.parametrize(
    ("module", "names"), [(jc, JAXCONTACT), (fitting, FITTING)], ids=["jaxcontact", "fitting"]
)
def test_no_public_name_disappears_or_comes_unannounced(module, names):
    assert public(module) - FORMER == set(names.split())
    assert set(getattr(module, "__all__", names.split())) == set(names.split())


MEMBERS = {
    jc.ContactHistory: "times grid profile pressure displacement gap approach load contact_area contact_radius"
    " smooth_area film_strain iterations error status converged saved plot peak_pressure notes diagnostics",
    jc.AdhesiveHistory: "jumps jump_energy viscous_energy cohesive_cells tabor_number",
    jc.AdhesiveSlidingHistory: "jumps jump_energy cohesive_cells tabor_number in_contact",
    jc.SteadySliding: "pressure approach tangential_force friction_coefficient pressure_centre power"
    " coulomb_force hysteresis_force hysteresis_power friction_power friction traction gap peak_pressure contact_radius"
    " notes plot",
    jc.SlidingHistory: "tangential_force hysteresis_force coulomb_force friction_coefficient pressure_centre power"
    " hysteresis_power friction_power friction traction stored_energy truncation_bound",
    jc.ShearHistory: "traction slip stick sticking_share notes tangential_load tangential_displacement dissipated"
    " friction_work",
    jc.RubbingHistory: "thickness temperature friction_work step_error pressure gap notes plot",
    jc.InteriorFields: "depths stress displacement von_mises peak plot notes summary to_xarray",
    jc.Deflection: "grid times displacement truncation_bound response_error status notes to_xarray",
    jc.NumpyFunction: "apply vjp",
    jc.Study: "folder cases failures notes notes_in_words done stacked",
    jc.SteadyRolling: "pressure traction slip_ratio stick tangential_load creepage power plot gap peak_pressure"
    " contact_radius sticking_share notes hysteresis_power friction_power hysteresis_force",
    jc.ContactStatistics: "mean_pressure area_fraction corrected_fraction perimeter mean_gap",
    jc.PressureHistogram: "edges density",
    jc.ContactClusters: "labels areas count",
    jc.SurfaceStatistics: "rms_height rms_slope rms_curvature wavenumber spectrum",
    jc.Burgers: "G1 G2 eta1 eta2 nu creep relaxation complex_modulus laplace_compliance shifted",
    jc.Prony: "J0 J tau nu fluidity creep relaxation complex_modulus",
    jc.Elastic: "G nu from_young creep relaxation",
    jc.Grid: "shape spacing periodic square around width axes coordinates cell_area",
    fitting.CreepFit: "material intervals identified predict summary plot",
    fitting.AdhesiveFit: "material law values intervals identified pull_off separation_work tabor_number summary plot",
    fitting.IndentationFit: "material intervals identified predict summary plot",
}


@pytest.mark.parametrize("cls", MEMBERS, ids=lambda cls: cls.__name__)
def test_no_member_disappears(cls):
    fields = set(getattr(cls, "__dataclass_fields__", {}))
    missing = [name for name in MEMBERS[cls].split() if name not in fields and not hasattr(cls, name)]
    assert not missing


KEYWORDS = {
    jc.indent: "body indenter control times grid tolerance max_iterations save substeps correspondence kernels checkpoint",
    jc.slide: "body indenter control times velocity grid tolerance max_iterations save substeps kernels checkpoint friction",
    jc.slide_steady: "body indenter control velocity grid tolerance max_iterations kernels friction",
    jc.shear: "body indenter control tangential times friction grid coupled tolerance max_iterations save substeps",
    jc.roll_steady: "body indenter control velocity creepage friction grid coupled tolerance max_iterations",
    jc.rub: "body indenter control times velocity law grid friction wears thermal thickest tolerance max_iterations save"
    " substeps checkpoint",
    jc.subsurface: "body grid pressure traction depths times",
    jc.deflection: "body grid pressure times velocity substeps",
    jc.kernels: "body indenter grid nodes",
    jc.NumpyFunction: "f",
    jc.sweep: "f cases out executor processes version",
    jc.heat_partition: "heat_flux grid first second",
    jc.flash_temperature: "heat_flux grid velocity conductivity diffusivity film",
    jc.self_affine: "grid hurst rms_slope shortest longest seed",
    jc.surface_statistics: "heights grid",
    jc.read_surface: "path grid",
    jc.contact_statistics: "result",
    jc.pressure_histogram: "result bins",
    jc.contact_clusters: "result step",
    jc.write_result: "result path case",
    jc.read_result: "path",
    fitting.minimise: "loss start bounds scale method steps tolerance state",
    fitting.fit_fields: "data body parameters indenter grid units fixed bounds align blur noise level tolerance",
    fitting.fit_creep: "model weights fixed bounds",
    fitting.fit_indentation: "model indenter nu control layer substrate adhesion",
}


@pytest.mark.parametrize("function", KEYWORDS, ids=lambda function: function.__name__)
def test_no_argument_disappears(function):
    assert set(KEYWORDS[function].split()) <= set(inspect.signature(function).parameters)


@pytest.mark.parametrize("module", [jc, fitting], ids=lambda module: module.__name__)
def test_every_public_name_has_a_docstring_of_its_own(module):
    for name in public(module):
        doc = getattr(module, name).__doc__ or ""
        generated = re.match(rf"{name}\(", doc)  # what dataclass writes
        assert doc and not generated, name


def test_both_packages_are_typed():
    for package in ("jaxcontact", "fitting"):
        assert resources.files(package).joinpath("py.typed").is_file()


def test_one_version_everywhere_and_a_citation_with_the_doi():
    assert tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"] == jc.__version__
    citation = (ROOT / "CITATION.cff").read_text()
    assert f"\nversion: {jc.__version__}\n" in citation
    assert f"## {jc.__version__}" in (ROOT / "CHANGELOG.md").read_text()
    for text in (citation, jc.cite()):
        assert "10.1007/s11249-025-01990-5" in text
        assert "Time-Dependent Contact Behaviour" in text
    assert jc.__version__ in jc.cite()


def test_at_most_ten_direct_dependencies():
    assert len(tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]) <= 10


ALIAS = """
import importlib, pkgutil, sys
import jaxcontact.fitting as first
from jaxcontact.fitting import fit_creep
import fitting, jaxcontact
assert first is fitting is jaxcontact.fitting is sys.modules["jaxcontact.fitting"]
assert fit_creep is fitting.fit_creep
names = [each.name for each in pkgutil.walk_packages(fitting.__path__, "fitting.")]
for name in names:
    other, own = importlib.import_module("jaxcontact." + name), importlib.import_module(name)
    assert other is own and own.__spec__.name == own.__name__ == name, name
import pickle
assert pickle.loads(pickle.dumps(jaxcontact.fitting.CreepData)) is fitting.CreepData
try:
    import jaxcontact.fitting.nothing
except ModuleNotFoundError as error:
    print(len(names), error)
"""


@pytest.mark.slow
def test_fitting_has_a_second_name_with_the_same_modules():
    done = subprocess.run([sys.executable, "-c", ALIAS], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    count, said = done.stdout.split(maxsplit=1)
    assert int(count) > 40 and said.strip() == "No module named 'fitting.nothing'"


def test_a_name_that_does_not_exist_is_refused_as_by_any_module():
    with pytest.raises(AttributeError, match=r"^module 'jaxcontact' has no attribute 'nothing'$"):
        jc.nothing  # noqa: B018
    assert set(jc.__all__) <= set(dir(jc))


def test_results_are_written_and_read_by_their_former_names_too():
    assert jc.save is jc.write_result and jc.load is jc.read_result
