"""The table of column names and the table of units, against lists made from the definitions."""

import pytest

from fitting.data import units
from fitting.data.table import NAMES, number, read_heading

INCH, POUND = 0.0254, 4.4482216152605  # [m], [N]: exact by definition
# kind, spellings, value in SI
UNITS = [
    ("t", "s sec sec. seconds Sekunden", 1.0), ("t", "ms msec", 1e-3), ("t", "µs us", 1e-6),
    ("t", "min mins minutes Minuten", 60.0), ("t", "h hr hrs hours Stunden Std", 3600.0),
    ("t", "d days Tage", 86400.0), ("t", "SEC S", 1.0), ("t", "week", 604800.0),
    ("load", "N", 1.0), ("load", "mN", 1e-3), ("load", "µN uN μN", 1e-6), ("load", "nN", 1e-9),
    ("load", "pN", 1e-12), ("load", "kN KN", 1e3), ("stress", "MN/m2", 1e6),
    ("load", "kgf kp", 9.80665), ("load", "gf", 9.80665e-3), ("load", "mgf", 9.80665e-6),
    ("load", "lbf", POUND), ("load", "dyn", 1e-5),
    ("depth", "m", 1.0), ("depth", "mm", 1e-3), ("depth", "µm um micron microns", 1e-6), ("depth", "nm", 1e-9),
    ("depth", "pm", 1e-12), ("depth", "cm", 1e-2), ("depth", "Å Angstrom angstroms A", 1e-10),
    ("stress", "Pa PA", 1.0), ("stress", "mPa", 1e-3), ("stress", "kPa KPa", 1e3), ("stress", "MPa N/mm2 N/mm² N/mm^2", 1e6),
    ("stress", "GPa kN/mm2", 1e9), ("stress", "hPa mbar", 100.0), ("stress", "bar", 1e5), ("stress", "N/m^2 N/m**2", 1.0),
    ("stress", "psi", POUND / INCH**2), ("stress", "ksi", 1e3 * POUND / INCH**2), ("stress", "dyn/cm2", 0.1),
    ("stress", "kgf/cm2 kp/cm²", 98066.5), ("stress", "gf/mm2", 9806.65), ("stress", "N·mm⁻² N*mm^-2", 1e6),
    ("strain", "- 1 m/m mm/mm", 1.0), ("strain", "% percent Prozent", 0.01), ("strain", "‰ mm/m", 1e-3),
    ("strain", "ppm µm/m microstrain µε", 1e-6),
    ("J", "1/Pa Pa^-1 Pa⁻¹ Pa-1 per_Pa 1_per_Pa 1/(Pa) (1/Pa) m2/N m²/N", 1.0), ("J", "1/kPa", 1e-3),
    ("J", "1/MPa MPa^-1 MPa^(-1) (MPa)^-1 mm2/N mm²/N mm^2/N mm²·N⁻¹", 1e-6), ("J", "1/GPa", 1e-9), ("J", "1/mPa", 1e3),
    ("J", "cm2/dyn cm²/dyn", 10.0), ("J", "1/psi", INCH**2 / POUND), ("J", "1/bar", 1e-5), ("J", "%/MPa", 1e-8),
    ("J", "cm2/kgf", 1 / 98066.5),
]  # fmt: skip
FOREIGN = {
    "t": "fortnight N",
    "load": "g V Mn MN",
    "depth": "V deg",
    "stress": "MPA N",
    "strain": "mm",
    "J": "Pa 1/MPA 1/s",
}


@pytest.mark.parametrize(("kind", "spellings", "value"), UNITS, ids=[spellings for _, spellings, _ in UNITS])
def test_units(kind, spellings, value):
    for text in spellings.split():
        assert units.factor(kind, text) == pytest.approx(value, rel=1e-12), text


def test_what_is_no_unit_of_its_kind():
    for kind, texts in FOREIGN.items():
        for text in ["?", *texts.split()]:
            with pytest.raises(KeyError):
                units.factor(kind, text)


@pytest.mark.parametrize(
    ("cell", "decimal", "value"),
    [
        ("1.512,8", ",", 1512.8), ("1,512.8", ".", 1512.8), ("1'512.8", ".", 1512.8), ("1.512", ",", 1512.0),
        ("0.512", ",", None), ("0,512", ".", None), ("1,5", ".", None), ("1.51.2", ",", None), ("−2,5E−3", ",", -2.5e-3),
        ("1.5D+02", ".", 150.0), (".5", ".", 0.5), ("5.", ".", 5.0), ("1_000", ".", None), ("0x10", ".", None),
        ("12 345", ".", None), ("12\u00a0345", ".", 12345.0), ("", ".", None), ("1e5", ",", 1e5), ("+3", ".", 3.0),
    ],
)  # fmt: skip
def test_numbers(cell, decimal, value):
    assert number(cell, decimal) == value


# kind: headings, each with its unit after a bar
HEADINGS = {
    "time": "t [s]|s Time (min)|min Zeit/s|s Zeit t [s]|s Test time,s|s Time On Sample|None Series Time|None time_h|h",
    "step time": "Step time|None Interval Time [s]|s Time (action)(s)|s Schrittzeit in s|s step_time_min|min",
    "compliance": "J [1/GPa]|1/GPa J(t)|None J(t) [1/Pa]|1/Pa Creep Compliance [MPa^-1]|MPa^-1 J_1_per_Pa|1_per_Pa"
    " Compliance J (mm2/N)|mm2/N Nachgiebigkeit / (1/MPa)|(1/MPa) Kriechnachgiebigkeit [1/Pa]|1/Pa",
    "tensile compliance": "D(t) [1/GPa]|1/GPa D|None Tensile compliance (1/Pa)|1/Pa Zugkriechnachgiebigkeit|None",
    "strain": "strain|None Strain %|% γ [%]|% Shear Strain(%)|% Scherdeformation [%]|% gamma|None Creep strain [-]|-",
    "tensile strain": "ε [%]|% Tensile strain|None Dehnung [%]|% Axial Strain (mm/mm)|mm/mm elongation [%]|%",
    "stress": "stress [kPa]|kPa τ|None Shear Stress (Pa)|Pa Schubspannung|None tau_Pa|Pa",
    "tensile stress": "σ [MPa]|MPa Zugspannung [MPa]|MPa Tensile stress|None",
    "relaxation modulus": "G(t) [Pa]|Pa E(t)|None E_relax|None Relaxation modulus|None",
    "complex modulus": "Complex modulus|None G* (kPa)|kPa Complex Shear Modulus [Pa]|Pa"
    " Komplexer Schubmodul [Pa]|Pa",
    "tensile storage modulus": "E' [MPa]|MPa E_stor|None",
    "tensile loss modulus": "E'' [MPa]|MPa E_loss|None",
    "tensile complex modulus": "E* [MPa]|MPa Tensile complex modulus|None",
    "loss factor": "tan(delta)|None Tan δ|None tan delta [-]|- Loss Factor [1]|1 Verlustfaktor|None tan_delta|None",
    "phase angle": "Phase angle [°]|° Phase Angle (deg)|deg Phasenwinkel [Grad]|Grad δ(G*) [rad]|rad",
    "load": "P [mN]|mN F/mN|mN Load (µN)|µN Normal force [N]|N Kraft in N|N Prüfkraft F [mN]|mN Fn|None"
    " Load On Sample [mN]|mN Vertical Deflection|None vDeflection|None force_nN|nN",
    "delta": "δ|None δ [°]|° delta [nm]|nm",
    "depth": "h [nm]|nm Disp_nm|nm h/nm|nm Pd (nm)|nm Displacement Into Surface|None Eindringtiefe h [µm]|µm"
    " Indentation (nm)|nm Penetration depth|None Eindringung|None",
    "height": "Height (measured)|None height (measured) [m]|m measuredHeight|None",
    "smoothed height": "Height (measured & smoothed)|None smoothedMeasuredHeight|None",
    "commanded height": "height|None Piezo (nm)|nm height (piezo)|None",
    "segment": "segment|None Segment Index|None",
    "temperature": "T|None Temperature [C]|C Temp|None Temperatur in °C|°C",
    None: "H [GPa]|GPa log J|None Depth target|None Point No.|None",
    "modulus": "G [Pa]|Pa Modulus (GPa)|GPa Shear modulus|None",
    "tensile modulus": "E|None Young's modulus [MPa]|MPa E-Modul [MPa]|MPa",
    "creep modulus": "Creep modulus [MPa]|MPa Kriechmodul [MPa]|MPa",
    "contact area": "Contact Area (nm^2)|nm^2",
}  # fmt: skip


@pytest.mark.parametrize("kind", HEADINGS)
def test_headings(kind):
    """Names in the field's usual spellings; one letter is told by its case: t, not T; h, not H."""
    parts = HEADINGS[kind].split("|")
    names = [parts[0], *(part.split(" ", 1)[1] for part in parts[1:-1])]
    found_units = [part.split(" ", 1)[0] for part in parts[1:]]
    assert kind in NAMES or kind is None
    for name, unit in zip(names, found_units, strict=True):
        found = read_heading(name)
        assert (found.kind, str(found.unit)) == (kind, unit), name


def test_no_name_has_two_meanings():
    every = [name for names in NAMES.values() for name in names.split()]
    assert sorted(set(every)) == sorted(every)
