"""Mistakes in what is pressed, by what, when and on which grid, and in what is asked of the outcome."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
from right_calls import (
    BALL,
    BODY,
    DRAWN,
    FILM,
    GRID,
    KERNELS,
    LINE,
    LOAD,
    PERIODIC,
    STEEL,
    TIMES,
    gel,
    indent,
    on,
    rub,
    steady,
    uneven,
    varying,
)

import jaxcontact as jc
from jaxcontact.abc import Adhesion, pytree


def loose(body):
    """The body with layers that slide on what is below them, of the same numbers."""
    layers = [jc.Layer(each.material, each.thickness, bonded=False) for each in body.layers]
    return jc.LayeredHalfSpace(layers, body.substrate)


@pytree
class Parabola(Adhesion):
    """Attraction 3 w/z (1 - g/z)^2 up to a gap z, times a factor that its energy lacks."""

    work: float
    range: float
    factor: float = 1.0

    def traction(self, gap):
        return self.factor * 3.0 * self.work / self.range * jnp.maximum(1.0 - gap / self.range, 0.0) ** 2

    def energy(self, gap):
        return self.work * jnp.maximum(1.0 - gap / self.range, 0.0) ** 3


def half_space(modulus):
    return jc.LayeredHalfSpace([], jc.Elastic(modulus, 0.3))


PRESSING = {
    "one time for a grid that is chosen": (
        lambda: indent(times=0.0, grid="auto"),
        r"Grid\.around: times: expected a 1-d array of times \[s\], got shape \(\)",
    ),
    "a number for a law of adhesion": (
        lambda: indent(adhesion=0.05),
        r"adhesion: expected ExponentialAdhesion, DugdaleAdhesion, a subclass of jc.abc.Adhesion with its work, or",
    ),
    "an attraction of one's own that is not the slope of its energy": (
        lambda: indent(adhesion=Parabola(0.05, 1e-9, 0.9)),
        r"adhesion: expected a traction that does not increase with the gap, an energy whose slope is -traction",
    ),
    "a work of adhesion below zero": (
        lambda: indent(adhesion=jc.DugdaleAdhesion(-0.05, 1e6)),
        r"adhesion: work \[J/m\^2\]: expected > 0, got -0\.05",
    ),
    "a hardness with adhesion": (
        lambda: indent(adhesion=jc.DugdaleAdhesion(0.05, 1e6), hardness=1e9),
        r"hardness: expected None with adhesion, got a hardness: surfaces that yield are computed without",
    ),
    "a hardness of zero": (lambda: indent(hardness=0.0), r"hardness \[Pa\]: expected > 0, got 0"),
    "a hardness of another grid": (
        lambda: indent(hardness=np.full((4, 4), 1e9)),
        r"hardness \[Pa\]: expected a number or shape \(8, 8\), got shape \(4, 4\)",
    ),
    "an attraction without range": (
        lambda: indent(adhesion=jc.ExponentialAdhesion(0.05, 0.0)),
        r"adhesion: range \[m\]: expected > 0, got 0",
    ),
    "a strength below zero": (
        lambda: indent(adhesion=jc.DugdaleAdhesion(0.05, -1e6)),
        r"adhesion: strength \[Pa\]: expected > 0, got -1e\+06",
    ),
    "a load that is not finite, with adhesion": (
        lambda: indent(control=jc.Load(np.inf), adhesion=jc.DugdaleAdhesion(0.05, 1e6)),
        r"Load \[N\]: expected finite numbers, got inf",
    ),
    "a material for a body": (lambda: indent(body=FILM), r"body: expected a LayeredHalfSpace, got Burgers"),
    "a layer outside a list": (
        lambda: indent(body=jc.LayeredHalfSpace(jc.Layer(FILM, 1e-7), STEEL)),
        r"expected a list of Layer, got Layer",
    ),
    "a material for a layer": (
        lambda: indent(body=jc.LayeredHalfSpace([FILM], STEEL)),
        r"expected Layer\(.*Burgers",
    ),
    "a film too stiff for its images": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9), 1e-6)], jc.Elastic(2e2))),
        r"layer: expected at most 1e\+06 times the substrate's modulus, got 5e\+06 times",
    ),
    "a thickness over the plane": (
        lambda: jc.slide(varying(), BALL, LOAD, TIMES, velocity=1.0, grid=GRID),
        r"layer thickness \[m\]: expected a number, got shape \(8, 8\): .* is for a Layer in indent, rub and",
    ),
    "a thickness that varies along the track": (
        lambda: steady(1.0, body=uneven(0)),
        r"layer thickness \[m\]: expected one that varies along y alone, .* got changes along x by up to 7e-08",
    ),
    "a thickness across a track that is not along x": (
        lambda: steady((1.0, 1.0), body=uneven(1)),
        r"layer thickness in the plane: expected \(nx, ny\) with a number as velocity, .*, a velocity of shape \(2,\)",
    ),
    "friction on a film that varies across the track": (
        lambda: steady(1.0, body=uneven(1), friction=0.1),
        r"layer thickness in the plane: expected no friction and no kernels",
    ),
    "a thickness of another plane": (
        lambda: indent(body=varying((8, 9))),
        r"layer thickness \[m\]: expected a number or shape \(8, 8\) or \(2, 8, 8\) as the grid and the times",
    ),
    "a thickness over the plane below zero": (
        lambda: indent(body=varying(value=-1e-9)),
        r"layer thickness \[m\]: expected >= 0",
    ),
    "two films over the plane": (
        lambda: indent(body=varying(layers=2)),
        r"body: expected one Layer on an Elastic substrate where its thickness varies in the plane, got 2 on Elastic",
    ),
    "a film over the plane on a rigid base": (
        lambda: indent(body=varying(substrate=None)),
        r"where its thickness varies in the plane, got 1 on a rigid base",
    ),
    "a loose film over the plane": (
        lambda: indent(body=gel(thickness=np.full((8, 8), 1e-7), substrate=STEEL)),
        r"body: expected a bonded layer where its thickness varies in the plane, got bonded=False",
    ),
    "nothing on a rigid base": (
        lambda: indent(body=jc.LayeredHalfSpace([], None)),
        r"body: expected at least one layer on a rigid base, substrate=None, got none",
    ),
    "a number for a bond": (
        lambda: indent(body=gel(bonded=0.5)),
        r"layer bonded: expected True or False, got 0\.5",
    ),
    "the quasi-elastic way on a rigid base without sides": (
        lambda: indent(body=gel(), grid=PERIODIC, correspondence="quasi-elastic"),
        r'correspondence: expected "exact" for a body on a rigid base and a grid that is periodic along both axes',
    ),
    "adhesion on a rigid base without sides": (
        lambda: indent(body=gel(), grid=PERIODIC, adhesion=jc.DugdaleAdhesion(0.05, 1e6)),
        r"adhesion: expected None for a body or an indenter on a rigid base and a grid that is periodic along both axes",
    ),
    "adhesion of a gel of the indenter on a rigid core without sides": (
        lambda: indent(
            indenter=jc.Sphere(5e-3, gel()), grid=PERIODIC, adhesion=jc.DugdaleAdhesion(0.05, 1e6)
        ),
        r"adhesion: expected None for a body or an indenter on a rigid base and a grid that is periodic along both axes",
    ),
    "the quasi-elastic way for a film over the plane": (
        lambda: indent(body=varying(), correspondence="quasi-elastic"),
        r"layer thickness in the plane: expected no kernels",
    ),
    "two films that are rubbed": (
        lambda: rub(body=jc.LayeredHalfSpace([jc.Layer(FILM, 1e-7)] * 2, STEEL)),
        r"body: expected one Layer of a thickness that is a number or \(nx, ny\) in rub",
    ),
    "a number for a law": (
        lambda: rub(law=1e-18),
        r"law: expected an object with a method rate\(step\), got float",
    ),
    "a wear coefficient below zero": (
        lambda: rub(law=jc.ProportionalRemoval(0.0) + jc.Archard(-1.0)),
        r"Archard coefficient \[1/Pa\]: expected >= 0",
    ),
    "removal below zero": (
        lambda: rub(law=jc.ProportionalRemoval(-1.0)),
        r"ProportionalRemoval rate \[1/s\]: expected",
    ),
    "growth without temperature": (
        lambda: rub(law=jc.StressActivated(1.0, 1e-19, 1e-30, 0.0)),
        r"StressActivated temperature \[K\]: expected > 0",
    ),
    "a temperature that nobody knows": (
        lambda: rub(law=jc.StressActivated(1.0, 1e-19, 1e-30, None)),
        r"law: expected a temperature, or thermal=, for StressActivated",
    ),
    "a velocity over other times": (
        lambda: rub(velocity=np.ones(3)),
        r"velocity: expected a number, shape \(2,\) or \(2, 2\) as times, got shape \(3,\)",
    ),
    "a number for heat": (lambda: rub(thermal=300.0), r"thermal: expected Thermal or None, got float"),
    "no conductivity": (
        lambda: rub(thermal=jc.Thermal(300.0, 0.0)),
        r"Thermal conductivity \[W/\(m K\)\]: expected > 0",
    ),
    "a velocity without end": (lambda: rub(velocity=np.inf), r"velocity \[m/s\]: expected finite numbers"),
    "a body that never was warm": (
        lambda: rub(thermal=jc.Thermal(0.0, 46.0)),
        r"Thermal ambient \[K\]: expected > 0",
    ),
    "more heat than there is": (
        lambda: rub(thermal=jc.Thermal(300.0, 46.0, share=2.0)),
        r"Thermal share: expected .* <= 1, got 2",
    ),
    "a number for a shift": (
        lambda: rub(thermal=jc.Thermal(300.0, 46.0, shift=1.0)),
        r"Thermal shift: expected None or an object with a method log_factor, got float",
    ),
    "a shift without a reference": (
        lambda: rub(thermal=jc.Thermal(300.0, 46.0, shift=jc.ArrheniusShift(1e-19, 0.0))),
        r"ArrheniusShift reference \[K\]: expected > 0",
    ),
    "a shift that is no softening": (
        lambda: rub(thermal=jc.Thermal(300.0, 46.0, shift=jc.WLFShift(-1.0, 50.0, 300.0))),
        r"WLFShift c1: expected > 0",
    ),
    "a shift of negative energy": (
        lambda: rub(thermal=jc.Thermal(300.0, 46.0, shift=jc.ArrheniusShift(-1e-19, 300.0))),
        r"ArrheniusShift activation_energy \[J\]: expected >= 0",
    ),
    "a shift at no temperature": (
        lambda: rub(thermal=jc.Thermal(300.0, 46.0, shift=jc.WLFShift(1.0, 50.0, 0.0))),
        r"WLFShift reference \[K\]: expected > 0",
    ),
    "a shift with infinite times": (
        lambda: rub(thermal=jc.Thermal(293.0, 46.0, shift=jc.WLFShift(17.44, 51.6, 378.0))),
        r"ln a_T of Thermal shift at ambient, inf where the body has infinite times: expected finite",
    ),
    "heat without friction": (
        lambda: rub(thermal=jc.Thermal(300.0, 46.0), friction=0.0),
        r"friction: expected a coefficient > 0 with thermal= or growth by shear stress, or shear_strength > 0 with"
        r" adhesion, got 0",
    ),
    "wear of both": (lambda: rub(wears="both"), r'wears: expected "film" or "indenter", got \'both\''),
    "growth backwards": (
        lambda: rub(law=jc.StressActivated(-1.0, 1e-19, 1e-30, 300.0)),
        r"StressActivated rate \[m/s\]: expected > 0",
    ),
    "growth that needs less than nothing": (
        lambda: rub(law=jc.StressActivated(1.0, -1e-19, 1e-30, 300.0)),
        r"StressActivated activation_energy \[J\]: expected >= 0",
    ),
    "an activation volume without end": (
        lambda: rub(law=jc.StressActivated(1.0, 1e-19, np.inf, 300.0)),
        r"StressActivated activation_volume \[m3\]: expected finite",
    ),
    "an activation energy in eV": (
        lambda: rub(law=jc.StressActivated(1.0, 0.8, 1e-30, 300.0)),
        r"StressActivated activation_energy \[J\]: expected <= 1e-17 \(in J per molecule: .*, got 0.8",
    ),
    "an activation volume in nm3": (
        lambda: rub(law=jc.StressActivated(1.0, 1e-19, 0.13, 300.0)),
        r"StressActivated activation_volume \[m3\]: expected <= 1e-24 \(in m3 per molecule: .*, got 0.13",
    ),
    "a shift by an energy per mole": (
        lambda: rub(thermal=jc.Thermal(300.0, 46.0, shift=jc.ArrheniusShift(8e4, 300.0))),
        r"ArrheniusShift activation_energy \[J\]: expected <= 1e-17 \(in J per molecule",
    ),
    "growth by another stress": (
        lambda: rub(law=jc.StressActivated(1.0, 1e-19, 1e-30, 300.0, stress="tension")),
        r'StressActivated stress: expected "pressure" or "shear", got \'tension\'',
    ),
    "kernels of no thickness": (lambda: rub(thickest=0.0), r"thickest \[m\]: expected > 0"),
    "a thickness over other times": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Layer(FILM, np.full(3, 1e-7))], STEEL)),
        r"layer thickness \[m\]: expected a number or shape \(2,\) as times, got \(3,\)",
    ),
    "a thickness that vanishes": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Layer(FILM, [1e-7, 0.0])], STEEL)),
        r"layer thickness \[m\]: expected > 0",
    ),
    "the quasi-elastic way for a film that grows": (
        lambda: indent(
            body=jc.LayeredHalfSpace([jc.Layer(FILM, [1e-7, 2e-7])], STEEL), correspondence="quasi-elastic"
        ),
        r"layer thickness over times: expected no kernels",
    ),
    "a film that grows under what slides": (
        lambda: steady(1.0, body=jc.LayeredHalfSpace([jc.Layer(FILM, [1e-7, 2e-7])], STEEL)),
        r"layer thickness \[m\]: expected a number, got shape \(2,\); only a Layer in indent accepts one value per time",
    ),
    "an impulse in a Prony table": (
        lambda: jc.KelvinVoigt(1e3, 1e3).to_abaqus(),
        r"expected a finite modulus at t = 0 for a Prony table, got inf Pa",
    ),
    "an unknown system of units": (
        lambda: STEEL.to_abaqus(units="inch"),
        r"units: expected one of m, mm, um \(the unit of length\), got 'inch'",
    ),
    "a parameter in the name of a material": (
        lambda: STEEL.to_abaqus("STEEL, TYPE 2"),
        r"name: expected a letter and up to 79 letters, digits, spaces, _, \. or -, got 'STEEL, TYPE 2'",
    ),
    "the number zero of a material": (lambda: STEEL.to_ansys(0), r"number: expected 1 to 999999, got 0"),
    "a density below zero": (lambda: STEEL.to_ansys(density=-1.0), r"density .*expected > 0, got -1"),
    "a long-term modulus above that at first": (
        lambda: FILM.to_comsol(long_term=2.0),
        r"long_term: expected 0 to 0\.5, got 2\.0",
    ),
    "a material for a profile": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Graded(FILM, 1e-7)], STEEL)),
        r"Graded profile: expected a function of depth, got Burgers",
    ),
    "no sublayers": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Graded(lambda depth: FILM, 1e-7, layers=0)], STEEL)),
        r"Graded layers: expected 1 to 1000, got 0",
    ),
    "a number for a material": (
        lambda: indent(body=on(210e9)),
        r"substrate: expected a material .*got float",
    ),
    "a negative thickness": (
        lambda: indent(body=jc.LayeredHalfSpace([jc.Layer(FILM, -1e-7)], STEEL)),
        r"thickness \[m\]: .*> 0, got -1e-07",
    ),
    "a negative modulus": (
        lambda: indent(body=on(jc.Elastic(-1.0))),
        r"substrate Elastic G: expected > 0, got -1",
    ),
    "a negative compliance": (
        lambda: indent(body=on(jc.Prony(-1.0, jnp.ones(1), jnp.ones(1)))),
        r"Prony J0: expected >= 0, got -1",
    ),
    "nu above one half": (
        lambda: indent(body=on(jc.Elastic(1e9, nu=0.6))),
        r"nu: expected -1 < nu <= 0.5, got 0.6",
    ),
    "a fractional law that is not cut": (
        lambda: indent(body=on(jc.Springpot(1e9, 0.5))),
        r"got Springpot: use its prony\(shortest, longest\)",
    ),
    "a cut from no time": (lambda: jc.Springpot(1e9, 0.5).prony(0.0, 1.0), r"shortest: expected > 0, got 0"),
    "a cut backwards": (
        lambda: jc.Springpot(1e9, 0.5).prony(1.0, 1.0),
        r"longest: expected more than shortest = 1 s, got 1",
    ),
    "a cut by half": (
        lambda: jc.Springpot(1e9, 0.5).prony(1.0, 2.0, 0.5),
        r"tolerance: expected > .*, got 0.5",
    ),
    "a springpot below zero": (
        lambda: jc.Springpot(-1e9, 0.5).prony(1.0, 2.0),
        r"V: expected > 0, got -1e\+09",
    ),
    "a springpot beyond a dashpot": (
        lambda: jc.Springpot(1e9, 1.1).prony(1.0, 2.0),
        r"alpha: expected > 0 and <= 1, got 1.1",
    ),
    "an order whose spectrum cannot be summed": (
        lambda: jc.FractionalZener(1e9, 1e9, 1e9, 0.9995).prony(1.0, 2.0),
        r"alpha: expected > 0 and <= 0.999, got 0.9995",
    ),
    "nu and a bulk modulus": (
        lambda: indent(body=on(jc.Elastic(1e9, nu=0.3, bulk_modulus=1e9))),
        r"substrate Elastic: expected one of nu and bulk_modulus, got both",
    ),
    "neither nu nor a bulk modulus": (
        lambda: indent(body=on(jc.Elastic(1e9, nu=None))),
        r"expected one of nu and bulk_modulus, got neither",
    ),
    "a bulk modulus below zero": (
        lambda: indent(body=on(jc.Elastic(1e9, bulk_modulus=-1e9))),
        r"Elastic bulk_modulus: expected > 0, got -1e\+09",
    ),
    "a bulk modulus the quasi-elastic way": (
        lambda: indent(body=on(jc.Maxwell(1e9, 1e9, bulk_modulus=1e9)), correspondence="quasi-elastic"),
        r'correspondence: expected "exact" with a bulk modulus',
    ),
    "times of a Prony series": (
        lambda: indent(body=on(jc.Prony(1.0, jnp.ones(2), jnp.ones(1)))),
        r"expected J and tau of one shape",
    ),
    "a number for an indenter": (
        lambda: indent(indenter=9.5e-3),
        r"indenter: expected a Sphere.* subclass of jaxcontact\.abc\.Indenter, got float",
    ),
    "a negative radius": (lambda: indent(indenter=jc.Sphere(-1.0)), r"radius \[m\]: expected > 0, got -1"),
    "a cylinder's radius": (
        lambda: indent(indenter=jc.Cylinder(0.0, 1.0)),
        r"cylinder radius \[m\]: expected > 0",
    ),
    "a cylinder's length": (
        lambda: indent(indenter=jc.Cylinder(1.0, 0.0)),
        r"cylinder length \[m\]: expected > 0",
    ),
    "a cone as blunt as a plane": (
        lambda: indent(indenter=jc.Cone(2.0)),
        r"cone half-angle \[rad\]: expected <= 1.57 \(.*radians",
    ),
    "a punch's radius": (
        lambda: indent(indenter=jc.FlatPunch(jnp.nan)),
        r"punch radius \[m\]: expected > 0, got nan",
    ),
    "a coated ball that wears": (
        lambda: rub(indenter=jc.Sphere(1.0, jc.LayeredHalfSpace([], STEEL)), wears="indenter"),
        r"indenter material: expected one Layer of a thickness that is a number or \(nx, ny\) in rub",
    ),
    "one compliance of a creeping ball": (
        lambda: jc.Sphere(1.0, FILM).compliance(),
        r"indenter material: expected Elastic or None, got Burgers",
    ),
    "a number for a ball's material": (
        lambda: indent(indenter=jc.Sphere(1.0, 3.0)),
        r"indenter material: expected a material, a LayeredHalfSpace or None, got float",
    ),
    "a creeping ball by superposition": (
        lambda: indent(indenter=jc.Sphere(1.0, FILM), correspondence="quasi-elastic"),
        r'correspondence: expected "exact" with an indenter that creeps or is coated, got "quasi-elastic"',
    ),
    "kernels of a rigid ball for a creeping one": (
        lambda: indent(indenter=jc.Sphere(1.0, FILM), kernels=jc.kernels(BODY, BALL, GRID)),
        r"kernels: expected those of one that creeps or is coated, as the indenter is, got those of one that is elastic",
    ),
    "heights of another grid": (
        lambda: indent(indenter=jc.HeightField(jnp.zeros((4, 4)))),
        r"expected shape \(8, 8\)",
    ),
    "complex heights": (
        lambda: indent(indenter=jc.HeightField(1j * np.eye(8))),
        r"heights \[m\]: expected real numbers, got complex numbers: take their real part or modulus",
    ),
    "durations of nanoseconds": (
        lambda: indent(times=np.array([0, 60], "m8[ns]")),
        r"times \[s\]: expected numbers, got durations \(timedelta64\[ns\]\): divide by numpy.timedelta64",
    ),
    "a load in text": (lambda: indent(control=jc.Load("50")), r"Load \[N\]: expected numbers, got text"),
    "heights behind a mask": (
        lambda: indent(indenter=jc.HeightField(np.ma.masked_greater(np.eye(8), 0.5))),
        r"heights: expected numbers without masked entries, got 8 masked of 64",
    ),
    "a load with a unit": (
        lambda: jc.Load(np.ones(2).view(type("Quantity", (np.ndarray,), {"unit": "mN", "to": None}))),
        r"value: expected plain numbers in SI, got a quantity with the unit 'mN': convert it",
    ),
    "a number for a control": (lambda: indent(control=60.0), r"control: expected Load or Approach, got 60.0"),
    "a load of another length": (
        lambda: indent(control=jc.Load([1.0, 2.0, 3.0])),
        r"number or shape \(2,\) as times",
    ),
    "an infinite load": (lambda: indent(control=jc.Load(np.inf)), r"Load \[N\]: expected >= 0, got inf"),
    "a negative load": (lambda: indent(control=jc.Load(-1.0)), r"Load \[N\]: expected >= 0, got -1"),
    "no load at all": (lambda: indent(control=jc.Load(0.0)), r"expected > 0 at some time, got 0"),
    "one time, not in an array": (
        lambda: indent(times=7200.0),
        r"times \[s\]: expected a 1-d array .* shape \(\)",
    ),
    "times that decrease": (
        lambda: indent(times=[0.0, 2.0, 1.0]),
        r"times that do not decrease, got \[0.0, 2.0, 1.0\]",
    ),
    "a number for a grid": (lambda: indent(grid=256), r"grid: expected a Grid, got int"),
    "a grid of three axes": (
        lambda: indent(grid=jc.Grid((4, 4, 4), (1.0, 1.0))),
        r"expected two whole numbers",
    ),
    "one spacing": (lambda: indent(grid=jc.Grid((4, 4), (1.0,))), r"grid spacing: expected \(dx, dy\)"),
    "a negative spacing": (
        lambda: indent(grid=jc.Grid((4, 4), (1.0, -1.0))),
        r"grid spacing \[m\]: expected > 1e-30",
    ),
    "a word for save": (
        lambda: indent(save="first"),
        r"""save: expected "all", "last" or a function, got 'first'""",
    ),
    "no substeps": (lambda: indent(substeps=0), r"substeps: expected 1 to 1000, got 0"),
    "a word for checkpoint": (
        lambda: indent(checkpoint="bloks"),
        r"""checkpoint: expected "pressures" or "blocks", got 'bloks'""",
    ),
    "kernels of other cells across": (
        lambda: indent(kernels=jc.kernels(BODY, BALL, jc.Grid((8, 8), (75e-6, 150e-6)))),
        r"kernels: expected those of cells of \(7.5e-05, 7.5e-05\) m, got \(7.5e-05, 0.00015\)",
    ),
    "kernels of another modulus": (
        lambda: indent(half_space(2e9), kernels=jc.kernels(half_space(1e9), BALL, GRID)),
        r"kernels: expected those of this body and this material of the indenter, got those of another, with"
        r" 1000000000 in the place of 2000000000",
    ),
    "kernels without the film": (
        lambda: indent(kernels=jc.kernels(half_space(1e9), BALL, GRID)),
        r"kernels: expected those of this body .* got those of other materials or layers",
    ),
    "kernels of a loose layer": (
        lambda: indent(kernels=jc.kernels(loose(BODY), BALL, GRID)),
        r"kernels: expected those of this body .* got those of other materials or layers",
    ),
    "kernels of another shape": (
        lambda: indent(kernels=jc.kernels(BODY, BALL, jc.Grid((8, 9), GRID.spacing))),
        r"kernels: expected those of a grid of \(8, 8\) cells, got \(8, 9\)",
    ),
    "heights with a gap": (
        lambda: indent(indenter=jc.HeightField(np.where(np.eye(8) > 0, np.nan, 0.0))),
        r"heights \[m\]: expected finite numbers, got 64 values from 0 to 0, 8 of them not finite",
    ),
    "an ellipsoid with one radius": (
        lambda: indent(indenter=jc.Ellipsoid(1e-2)),
        r"ellipsoid radii: expected \(Rx, Ry\), got shape \(\)",
    ),
    "an ellipsoid that is flat": (
        lambda: indent(indenter=jc.Ellipsoid((1e-2, 0.0))),
        r"ellipsoid radii \[m\]: expected > ",
    ),
    "a punch smaller than a cell": (
        lambda: indent(indenter=jc.FlatPunch(1e-9)),
        r"punch radius \[m\]: expected a size that covers a cell's centre \(cells are 7.5e-05 m\), got 1e-09",
    ),
    "a cylinder shorter than a cell": (
        lambda: indent(indenter=jc.Cylinder(1e-2, 1e-9)),
        r"cylinder length \[m\]: expected a size that covers",
    ),
    "a tolerance that says nothing": (
        lambda: indent(tolerance=10.0),
        r"tolerance: expected > 0 and <= 0.01, got 10",
    ),
    "no iterations": (lambda: indent(max_iterations=0), r"max_iterations: expected 1 to 1000000000, got 0"),
    "a grid of no size that can be multiplied": (
        lambda: indent(grid=jc.Grid.square(8, 1e100)),
        r"grid spacing \[m\]: expected > 1e-30 and <= 1e\+30",
    ),
    "a modulus for each of several films": (
        lambda: indent(body=on(jc.Elastic(np.array([1e9, 2e9])))),
        r"substrate Elastic G: expected a number, got shape \(2,\)",
    ),
    "an approach without a value": (
        lambda: indent(control=jc.Approach(np.nan)),
        r"Approach \[m\]: expected finite numbers, got nan",
    ),
    "kernels of wider cells": (
        lambda: indent(kernels=jc.kernels(BODY, BALL, jc.Grid.square(GRID.shape[0], 2 * GRID.width[0]))),
        "kernels: expected those of cells of",
    ),
    "statistics of what is no contact": (
        lambda: jc.contact_statistics(BALL),
        r"result: expected the result of indent, slide, slide_steady, \.\.\., got Sphere",
    ),
    "a histogram without bins": (
        lambda: jc.pressure_histogram(DRAWN, bins=0),
        r"bins: expected 1 to 10000, got 0",
    ),
    "patches at a time that is not there": (
        lambda: jc.contact_clusters(DRAWN, step=1),
        r"step: expected -1 to 0, got 1",
    ),
    "patches of many runs": (
        lambda: jc.contact_clusters(SimpleNamespace(**vars(DRAWN) | {"status": np.zeros(2)})),
        r"result: expected the result of one run, outside jit, got a status of shape \(2,\)",
    ),
    "statistics of heights of another grid": (
        lambda: jc.surface_statistics(np.zeros((4, 8)), GRID),
        r"heights: expected shape \(8, 8\), got \(4, 8\)",
    ),
    "statistics of heights with a gap": (
        lambda: jc.surface_statistics(np.where(np.eye(8) > 0, np.nan, 0.0), GRID),
        r"heights \[m\]: expected finite numbers",
    ),
    "statistics of a line of heights": (
        lambda: jc.surface_statistics(np.zeros((8, 1)), LINE),
        r"heights, grid: expected known values and more than one cell along y, got \(8, 1\) cells",
    ),
    "a word for correspondence": (
        lambda: indent(correspondence="fast"),
        r"""or "quasi-elastic", got 'fast'""",
    ),
    "a rigid ball on Kelvin-Voigt": (
        lambda: indent(body=on(jc.KelvinVoigt(1.0, 1.0))),
        r"expected an elastic indenter",
    ),
    "kernels, quasi-elastic": (
        lambda: indent(correspondence="quasi-elastic", kernels=KERNELS),
        r"""kernels: expected correspondence="exact" """,
    ),
    "too many nodes": (lambda: jc.kernels(BODY, BALL, GRID, nodes=9), r"nodes: expected 1 to 8, got 9"),
    "a grid without cells": (
        lambda: jc.Grid.square(0, 1.0),
        r"n: expected a whole number of at least 4, got 0",
    ),
    "a word for a grid": (
        lambda: jc.indent(BODY, BALL, LOAD, TIMES, grid="wide"),
        r"grid: expected a Grid, or \"auto\" without kernels, got 'wide'",
    ),
    "a grid of its own under jit": (
        lambda: jax.jit(lambda w: jc.indent(BODY, BALL, jc.Load(w), TIMES, grid="auto").load)(1.0),
        r"grid: expected a Grid inside jit, vmap and grad, got \"auto\"",
    ),
    "Grid.around under vmap": (
        lambda: jax.vmap(lambda w: jc.Grid.around(BODY, BALL, jc.Load(w), TIMES).spacing[0])(jnp.ones(2)),
        "Grid.around: expected known values, got values traced by jit, vmap or grad",
    ),
    "a number in Grid.around": (
        lambda: jc.Grid.around(BODY, BALL, 60.0, TIMES),
        r"control: .*order body.*got float",
    ),
    "a grid around nothing": (
        lambda: jc.Grid.around(BODY, BALL, jc.Approach(-1.0), TIMES),
        r"approach > 0 at some time",
    ),
    "a grid around heights": (
        lambda: jc.Grid.around(BODY, jc.HeightField(jnp.zeros((4, 4))), LOAD, TIMES),
        r"expected Grid\(shape=heights.shape",
    ),
    "a negative wavenumber": (lambda: jc.normal_response(BODY, -1.0), r"k \[rad/m\]: expected >= 0, got -1"),
    "a negative time": (lambda: jc.normal_response(BODY, 1.0, -1.0), r"t \[s\]: expected >= 0, got -1"),
    "a wavevector without end": (
        lambda: jc.frequency_response(BODY, np.inf, 0.0),
        r"kx \[rad/m\]: expected finite numbers, got inf",
    ),
    "half a wavevector": (
        lambda: jc.frequency_response(BODY, 1.0, np.nan),
        r"ky \[rad/m\]: expected finite numbers, got nan",
    ),
    "a wave before its time": (
        lambda: jc.frequency_response(BODY, 1.0, 1.0, -1.0),
        r"t \[s\]: expected >= 0",
    ),
}
