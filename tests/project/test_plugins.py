"""Plug-ins: a distribution with a material and a reader, as metadata on ``sys.path``, used by case files and readers."""

import subprocess
import sys

import numpy as np
import pytest

import fitting
from jaxcontact._support import plugins
from jaxcontact.shell import case_schema
from jaxcontact.shell.case_file import CaseError, case_text, read_case

MODULE = '''
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxcontact.abc import Material, Spectrum, pytree

@pytree
class Gum(Material):
    """A spring and one Kelvin-Voigt element, by moduli and a time."""
    G: float
    delayed: float
    tau: float
    nu: float = 0.5
    bulk_modulus: float | None = None
    units: ClassVar = {"G": "Pa", "delayed": "Pa", "tau": "s"}

    def spectrum(self):
        return Spectrum(1.0 / jnp.asarray(self.G), jnp.stack([1.0 / jnp.asarray(self.delayed)]),
                        jnp.stack([1.0 / jnp.asarray(self.tau)]))

class NoMaterial:
    pass

def read(path):
    t, J = np.fromfile(path).reshape(2, -1)
    return {"t [min]": t, "J [1/GPa]": J}

def steps(path):
    return {name: {"t [s]": [1.0, 2.0, 4.0, 8.0, 9.0], "G [Pa]": [4.0, 3.0, 2.0, 1.5, value]} for name, value in
            (("first", 1.4), ("second", 1.0))}

def wrong(path):
    return [1.0, 2.0]
'''
ENTRIES = """
[jaxcontact.materials]
gum = tiny_plugin:Gum
stone = tiny_plugin:NoMaterial
gone = tiny_plugin:Nowhere

[jaxcontact.readers]
bits = tiny_plugin:read
steps = tiny_plugin:steps
odd = tiny_plugin:wrong
"""
CASE = """
[substrate]
material = "gum"
G = "20 kPa"
delayed = 1e4
tau = "2 min"
[indenter]
shape = "sphere"
radius = 1e-3
[control]
load = 1e-4
[times]
values = [0.0, 60.0, 600.0]
[grid]
n = 40
width = 4e-4
[solver]
substeps = 8
"""


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """The distribution tiny-plugin, of one module."""
    info = tmp_path / "tiny_plugin-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: tiny-plugin\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(ENTRIES)
    (tmp_path / "tiny_plugin.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    for choices in ("MATERIALS", "BASES"):
        monkeypatch.setattr(case_schema, choices, dict(getattr(case_schema, choices)))
        monkeypatch.setattr(f"jaxcontact.shell.case_file.{choices}", getattr(case_schema, choices))
    yield tmp_path
    sys.modules.pop("tiny_plugin", None)


@pytest.mark.slow
def test_a_material_of_a_plugin_is_one_of_a_case_file_and_is_imported_when_it_is_named(installed):
    """Lee and Radok: approach^(3/2) = 3 (1 - nu) W J(t)/(8 sqrt(R)), with J of the two springs in closed form."""
    path = installed / "case.toml"
    path.write_text(CASE)
    assert "gum" in plugins.names(plugins.MATERIALS) and "tiny_plugin" not in sys.modules
    case = read_case(path)
    assert "tiny_plugin" in sys.modules and type(case.body.substrate).__name__ == "Gum"
    J = 1 / 2e4 + (1 - np.exp(-np.array([0.0, 60.0, 600.0]) / 120.0)) / 1e4
    expected = (3.0 * 0.5 * 1e-4 * J / (8.0 * np.sqrt(1e-3))) ** (2.0 / 3.0)
    np.testing.assert_allclose(case.run().approach, expected, rtol=1e-2)
    text = case_text(case)
    assert "tau [s]" in text and "A spring and one Kelvin-Voigt element" in text
    (installed / "again.toml").write_text(text)
    assert read_case(installed / "again.toml").body.substrate == case.body.substrate


@pytest.mark.parametrize(
    "change, words",
    [
        (('G = "20 kPa"', ""), "substrate.G: missing"),
        (("tau", "tauu"), "unknown key"),
        (('"2 min"', '"2 mm"'), 'text with a unit: "1 s"'),
        (('"gum"', '"stone"'), "subclass of jaxcontact.abc.Material"),
        (('"gum"', '"gone"'), "plug-in 'gone' of tiny-plugin"),
        (('"gum"', '"glue"'), "or a material of a plug-in"),
    ],
)
def test_mistakes_with_materials_of_plugins_are_named(installed, change, words):
    path = installed / "case.toml"
    path.write_text(CASE.replace(*change))
    with pytest.raises(CaseError, match=words):
        read_case(path)


def test_a_reader_of_a_plugin_gives_columns_with_units(installed):
    t = np.arange(1.0, 9.0)
    (installed / "film.bits").write_bytes(np.stack([t, 2.0 + t]).tobytes())
    data = fitting.read_creep(installed / "film.bits")
    np.testing.assert_allclose(data.t, 60.0 * t, rtol=1e-12)
    np.testing.assert_allclose(data.J, (2.0 + t) * 1e-9, rtol=1e-12)


def test_a_reader_of_a_plugin_may_give_several_steps(installed):
    (installed / "gel.steps").write_bytes(b"\0")
    data = fitting.read_relaxation(installed / "gel.steps", segment="second", start=0.0)
    np.testing.assert_allclose(data.modulus, [4.0, 3.0, 2.0, 1.5, 1.0])


def test_a_reader_of_a_plugin_that_fails_is_named(installed):
    (installed / "gel.odd").write_bytes(b"\0")
    with pytest.raises(
        ValueError, match=r"gel.odd: expected columns .* plug-in for \.odd files, got: 'list'"
    ):
        fitting.read_creep(installed / "gel.odd")


@pytest.mark.slow
def test_importing_the_package_imports_no_plugin(installed):
    code = "import sys, jaxcontact, fitting, jaxcontact.shell.case_file; print('tiny_plugin' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", f"import sys; sys.path.insert(0, {str(installed)!r}); {code}"],
                          capture_output=True, text=True)  # fmt: skip
    assert done.stdout == "False\n", done.stderr
