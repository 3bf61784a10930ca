"""Mistakes in a case file: each is named with the file and the key."""

import numpy as np

CASE = """
[layer]
material = "burgers"
G1 = 0.75e9
G2 = 13.89e6
eta1 = 3.1486e12
eta2 = 120.9e9
thickness = 150e-9
[substrate]
material = "elastic"
E = 210e9
[indenter]
shape = "sphere"
radius = 9.525e-3
[control]
load = 10.0
[times]
end = 600.0
steps = 6
[grid]
n = 32
width = 300e-6
"""
PRONY = 'material = "prony"\nJ0 = 1.0\nJ = [1.0, 2.0]\ntau = [1.0]\n'
LAYER = CASE[CASE.index('material = "burgers"') : CASE.index("thickness")]
BALL_TEXT = 'shape = "sphere"\nradius = 9.525e-3'
STICKS = '[adhesion]\nlaw = "exponential"\nwork = 0.05\nrange = 1e-9\n'
FILES = {
    "a typo in a law": (
        "[times]",
        STICKS.replace("range", "rnage") + "[times]",
        r'adhesion.rnage: unknown key; did you mean "range"\?',
    ),
    "an unknown law of adhesion": (
        "[times]",
        STICKS.replace("exponential", "exponental") + "[times]",
        r'adhesion.law: found "exponental", accepted: "exponential" \| "dugdale"',
    ),
    "no work of adhesion": (
        "[times]",
        STICKS.replace("work = 0.05\n", "") + "[times]",
        r"adhesion.work: missing; accepted: a number > 0",
    ),
    "adhesion without a width": (
        "[times]\nend = 600.0\nsteps = 6\n[grid]\nn = 32\nwidth = 300e-6",
        STICKS + "[times]\nend = 600.0\nsteps = 6\n[grid]\nn = 32",
        r"grid.width: missing; accepted with \[adhesion\]: width, or shape and spacing",
    ),
    "a rigid base without a layer": (
        CASE[: CASE.index("[indenter]")],
        '[substrate]\nmaterial = "rigid"\n',
        r'substrate.material: found "rigid" without a \[layer\]; accepted: a rigid base below layers',
    ),
    "not TOML": ("[grid]", "[grid", r"not TOML: "),
    "a unit without quotes": (
        "[times]",
        "[settings]\ntolerance = 450 GPa  # stiff\n[times]",
        r'not TOML: .*line \d+.*in quotes: tolerance = "450 GPa"',
    ),
    "text without quotes": (
        "[times]",
        "[settings]\ncorrespondence = exact\n[times]",
        r'in quotes: correspondence = "exact"',
    ),
    "a typo": ("thickness", "thicknes", r'layer.thicknes: unknown key; did you mean "thickness"\?'),
    "a typo in a section": ("[grid]", "[gird]", r'\[gird\]: unknown key; did you mean "grid"\?'),
    "both laws of volume": (
        "thickness",
        "nu = 0.3\nbulk_modulus = 1e9\nthickness",
        r"layer.nu: found both nu and bulk_modulus; accepted: one of them",
    ),
    "text for a number": ("10.0", '"ten"', r'control.load: found "ten", accepted: a number > 0'),
    "a missing key": (
        "thickness = 150e-9",
        "",
        r"layer.thickness: missing; accepted: a number > 0, from 1e-30 to 1e\+30, or a .npy file: thickness \[m\]",
    ),
    "an unknown material": (
        '"elastic"',
        '"steel"',
        r'substrate.material: found "steel", accepted: "elastic" \|',
    ),
    "both G and E": (
        "E = 210e9",
        "E = 210e9\nG = 80e9",
        r"substrate.G: found both G and E; accepted: one of them",
    ),
    "neither G nor E": ("E = 210e9", "", r"found neither G and E; accepted: one of them"),
    "a Prony series": (LAYER, PRONY, r"layer.tau: found 1 for 2 in J; accepted: as many numbers as in J"),
    "no heights": (
        BALL_TEXT,
        'shape = "height-field"\nheights = "none.npy"',
        r"indenter.heights: .*No such file",
    ),
    "heights that are no array": (
        BALL_TEXT,
        'shape = "height-field"\nheights = "case.toml"',
        r"not a .npy file",
    ),
    "heights in a line": (
        BALL_TEXT,
        'shape = "height-field"\nheights = "line.npy"',
        r"not a two-dimensional array",
    ),
    "heights with holes": (
        BALL_TEXT,
        'shape = "height-field"\nheights = "holes.npy"',
        r"found values that are not finite",
    ),
    "no grid for heights": (
        f"{BALL_TEXT}|n = 32\nwidth = 300e-6",
        'shape = "height-field"\nheights = "good.npy"|',
        r"grid.shape: missing",
    ),
    "both controls": (
        "load = 10.0",
        "load = 10.0\napproach = 1e-6",
        r"\[control\]: found both load and approach",
    ),
    "a load of another length": (
        "10.0",
        "[1.0, 2.0]",
        r"control.load: found 2 values; accepted: a number, or 7 values",
    ),
    "times twice": (
        "end = 600.0",
        "values = [0.0]\nend = 1.0",
        r"times.values: found with end, steps; accepted: values alone",
    ),
    "no end": ("end = 600.0", "", r"times.end: missing"),
    "a first time": ("end = 600.0", "end = 600.0\nfirst = 1.0", r'accepted: with spacing = "logarithmic"'),
    "a late first time": (
        "end = 600.0",
        'end = 600.0\nspacing = "logarithmic"\nfirst = 1e3',
        r"times.first: found 1000, accepted: .* end = 600",
    ),
    "a shape alone": (
        "n = 32\nwidth = 300e-6",
        "shape = [32, 32]",
        r"grid.spacing: missing; accepted: \[dx, dy\]",
    ),
    "a shape and n": (
        "width = 300e-6",
        "shape = [8, 8]\nspacing = [1e-6, 1e-6]",
        r"grid.n: found with shape",
    ),
}


def also(experiment, words, control="", old="", new=""):
    """A row: an [experiment], what stands in [control] beside the load, and one more change."""
    return (
        f"[control]|load = 10.0|{old}",
        f"[experiment]\n{experiment}\n[control]|load = 10.0\n{control}|{new}",
        words,
    )


SHEAR, PUSH = 'kind = "shear"\nfriction = 0.3', "tangential_load = [1.0, 0.0]"
STEADY, NO_TIMES = 'kind = "steady-sliding"\nvelocity = 1.0', ("[times]\nend = 600.0\nsteps = 6\n", "")
FILES |= {
    "an unknown experiment": also(
        'kind = "rub"', r'experiment.kind: found "rub", accepted: "indentation" \| "shear"'
    ),
    "friction of an indentation": also(
        "friction = 0.3",
        r'experiment.friction: found with experiment.kind = "indentation", accepted: with "shear" or',
    ),
    "no friction in shear": also(
        'kind = "shear"', r"experiment.friction: missing; accepted: a number >= 0", PUSH
    ),
    "friction that pushes": also(
        'kind = "shear"\nfriction = -0.1', r"friction: found -0.1, accepted: a number >= 0", PUSH
    ),
    "friction in no file": also(
        'kind = "shear"\nfriction = "mu.npy"', r"experiment.friction: .*mu.npy: No such file", PUSH
    ),
    "a word for coupled": also(
        f'{SHEAR}\ncoupled = "no"', r'coupled: found "no", accepted: true or false', PUSH
    ),
    "shear without a push": also(
        SHEAR,
        r"\[control\]: found neither tangential_load nor tangential_displacement; accepted: one of tangential_load \[N\]",
    ),
    "a push without direction": also(
        SHEAR,
        r"control.tangential_load: found 5.0, accepted: \[x, y\], or a list of them",
        "tangential_load = 5.0",
    ),
    "two pushes for seven times": also(
        SHEAR,
        r"tangential_load: found 2 values; accepted: \[x, y\], or 7 values as times",
        "tangential_load = [[0.0, 0.0], [1.0, 0.0]]",
    ),
    "creepage in shear": also(
        SHEAR,
        r'control.creepage: found with experiment.kind = "shear", accepted: with "steady-rolling"',
        "creepage = [1.0, 0.0]",
    ),
    "sliding without velocity": also(
        'kind = "sliding"', r"experiment.velocity: missing; accepted: a number, along x"
    ),
    "a velocity in space": also(
        'kind = "sliding"\nvelocity = [1.0, 0.0, 0.0]',
        r"experiment.velocity: found \[1.0, 0.0, 0.0\], accepted: a number",
    ),
    "times of a steady state": also(
        STEADY,
        r'\[times\]: found with experiment.kind = "steady-sliding", accepted: with "indentation" or "shear"',
    ),
    "substeps of a steady state": also(
        STEADY,
        r'solver.substeps: found with experiment.kind = "steady-sliding"',
        "",
        NO_TIMES[0],
        "[solver]\nsubsteps = 2\n",
    ),
    "a load over the times of a steady state": also(
        STEADY,
        r"control.load: found \[10.0, 1.0\], accepted: a number > 0",
        "",
        f"{NO_TIMES[0]}|load = 10.0",
        "|load = [10.0, 1.0]",
    ),
    "a steady state that rolls by nothing": also(
        'kind = "steady-rolling"\nvelocity = 1.0\nfriction = 0.3',
        r"found neither creepage nor tangential_load; accepted: one of creepage and tangential_load \[N\]",
        "",
        *NO_TIMES,
    ),
    "a rubbing without a law": also(
        'kind = "rubbing"\nvelocity = 0.1',
        r"\[growth\]: missing; accepted: one or more of \[growth\], \[removal\], \[wear\]",
    ),
    "a typo in a law": also(
        'kind = "rubbing"\nvelocity = 0.1\n[wear]\ncoeficient = 1e-18',
        r'wear.coeficient: unknown key; did you mean "coefficient"\?',
    ),
    "a typo in the second of two laws": also(
        'kind = "rubbing"\nvelocity = 0.1\n[[removal]]\nrate = 1e-3\n[[removal]]\nrat = 1e-3',
        r'removal\[1\].rat: unknown key; did you mean "rate"\?',
    ),
    "a law of another kind": also(
        'kind = "indentation"\n[wear]\ncoefficient = 1e-18',
        r'\[wear\]: found with experiment.kind = "indentation", accepted: with "rubbing"',
    ),
    "a length for an energy": also(
        'kind = "rubbing"\nvelocity = 0.1\n[growth]\nrate = 1.0\nactivation_energy = "1 nm"\nactivation_volume = 0.0',
        r'growth.activation_energy: found "1 nm", accepted: a number >= 0.*text with a unit: "1 J", eV, kJ/mol',
    ),
    "a shift without its reference": also(
        'kind = "rubbing"\nvelocity = 0.1\nfriction = 0.1\n[wear]\ncoefficient = 0.0\n[thermal]\nambient = 300.0\n'
        'conductivity = 46.0\nshift = "arrhenius"\nshift_energy = "1 eV"',
        r'thermal.shift_reference: missing with shift = "arrhenius"; accepted: shift_energy, shift_reference',
    ),
    "a key of another shift": also(
        'kind = "rubbing"\nvelocity = 0.1\nfriction = 0.1\n[wear]\ncoefficient = 0.0\n[thermal]\nambient = 300.0\n'
        "conductivity = 46.0\nshift_c1 = 17.0",
        r'thermal.shift_c1: found with shift = "none"; accepted: no other key of a shift',
    ),
    "heat twice": also(
        'kind = "rubbing"\nvelocity = 0.1\n[wear]\ncoefficient = 0.0\n[[thermal]]\nambient = 1.0\nconductivity = 1.0',
        r"\[thermal\]: found .*, accepted: a table",
    ),
    "a thickness that is no array": (
        "thickness = 150e-9",
        'thickness = "none.npy"',
        r"layer.thickness: .*none.npy: No such file",
    ),
    "a length for a load": (
        "load = 10.0",
        'load = "10 mm"',
        'control.load: found "10 mm", accepted: a number > 0.*normal load.*or text with a unit: "1 N", pN, nN',
    ),
    "a word for periodic": (
        "width = 300e-6",
        'periodic = "y"',
        r"periodic: found \"y\", accepted: true, false or \[x, y\]",
    ),
    "a periodic grid of no width": (
        "width = 300e-6",
        "periodic = true",
        r"grid.width: missing; accepted with periodic",
    ),
}


def written(name, folder):
    for file, values in {"line": [1.0], "holes": [[np.nan]], "good": [[1.0]]}.items():
        np.save(folder / f"{file}.npy", np.array(values))
    text, (old, new, words) = CASE, FILES[name]
    for a, b in zip(old.split("|"), new.split("|"), strict=True):
        assert a in text
        text = text.replace(a, b)
    (folder / "case.toml").write_text(text)
    return folder / "case.toml", words
