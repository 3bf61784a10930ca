"""Fits to fields of a contact against closed forms, central differences and the scatter of repeated fits."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy import ndimage

import fitting
import jaxcontact as jc
from fitting.fits.fields import (
    ALIGN,
    Blocks,
    BodyParameters,
    FieldSearch,
    View,
    chosen,
    observed,
    signed_distance,
)
from fitting.models.structure import Sought, limits
from tests.benchmarks import fields

BALL, LOAD, TRUE = jc.Sphere(5e-3), jc.Load(1.0), 2e9
FINE, MODEL, IMAGE = jc.Grid.square(64, 400e-6), jc.Grid.square(32, 400e-6), jc.Grid.square(40, 320e-6)


def plate(p):
    return jc.LayeredHalfSpace([], substrate=jc.Elastic(G=p["G"], nu=0.3))


def hertz(x, y):
    """Pressure [Pa], gap [m] and radius [m] of a ball of 5 mm under 1 N on the plate (K. L. Johnson, sec. 4.2)."""
    modulus, R = 2.0 * TRUE / 0.7, 5e-3
    a = (0.75 * R / modulus) ** (1.0 / 3.0)
    r = np.hypot(x, y) / a
    p = 1.5 / (np.pi * a**2) * np.sqrt(np.maximum(1.0 - r**2, 0.0))
    s = np.maximum(r, 1.0)
    gap = a**2 / (np.pi * R) * ((s**2 - 2.0) * np.arccos(1.0 / s) + np.sqrt(s**2 - 1.0))
    return p, gap, a


def seen(image, shift=(0.0, 0.0)):
    x, y = (np.asarray(axis) for axis in image.coordinates())
    return hertz(x - shift[0], y - shift[1])


@pytest.mark.slow
def test_a_bump_is_blurred_shifted_and_rotated_as_in_closed_form():
    """A Gaussian convolved with a Gaussian is a Gaussian; a pixel adds the variance of its width."""
    model, image = jc.Grid.square(64, 64.0), jc.Grid.square(40, 30.0)
    sx, sy, blur, shift, angle = 4.0, 7.0, 1.7, (1.3, -0.7), 0.4
    x, y = (np.asarray(axis) for axis in model.coordinates())
    field = np.exp(-(x**2) / (2 * sx**2) - y**2 / (2 * sy**2))
    view = View(jnp.array(shift), jnp.array(angle), jnp.array(blur), jnp.array(1.0), jnp.array(0.0))
    found = observed("displacement", {"displacement": jnp.asarray(field)[None]}, model, image, view)[0]
    x, y = (np.asarray(axis) for axis in image.coordinates())
    x, y = x - shift[0], y - shift[1]
    along, across = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
    vx, vy = (s**2 + blur**2 + 0.75**2 / 12 for s in (sx, sy))
    exact = sx * sy / np.sqrt(vx * vy) * np.exp(-(along**2) / (2 * vx) - across**2 / (2 * vy))
    assert np.max(np.abs(np.asarray(found) - exact)) < 1e-3  # cubic convolution: third order in the spacing


def test_the_signed_distance_is_that_of_a_hertz_contact():
    p, gap, a = seen(FINE)
    found = np.asarray(signed_distance(jnp.asarray(p), jnp.asarray(gap), FINE))
    x, y = (np.asarray(axis) for axis in FINE.coordinates())
    exact = a - np.hypot(x, y)
    near = np.abs(exact) < 0.15 * a
    assert np.all(np.sign(found[near]) == np.sign(exact[near]))
    slope = np.polyfit(exact[near], found[near], 1)
    assert slope[0] == pytest.approx(1.0, abs=0.15) and abs(slope[1]) < 0.02 * a


def contact_data(seed=0, image=IMAGE, shift=(2.7e-6, -2.7e-6)):
    """Pressure, gap and contact image of the closed form with noise of 3 %."""
    rng = np.random.default_rng(seed)
    p, gap, _ = seen(image, shift)
    noisy = {
        name: f + 0.03 * f.max() * rng.standard_normal(f.shape) for name, f in (("pressure", p), ("gap", gap))
    }
    wrong = rng.random(p.shape) < 0.03
    return fitting.ContactData([0.0], LOAD, noisy | {"contact": ((p > 0) != wrong).astype(float)}, image)


def search(data, model=MODEL, align="shift and rotation", blur="fitted"):
    structure = BodyParameters.of(plate, {"G": "Pa"})
    sought = Sought(structure, limits(structure, None, None), None)
    return FieldSearch.of(data, sought, {"G": TRUE}, (BALL, model, 1e-11), ALIGN[align], blur, "constant")


@pytest.mark.long
def test_the_jacobian_of_the_residuals_is_that_of_central_differences():
    own = search(contact_data())
    theta = own.start + np.array([0.03, 0.3, -0.2, 0.1, 0.4, 0.3, 0.01])
    exact, rng, step = own.slopes(theta), np.random.default_rng(1), 1e-5
    for _ in range(10):
        move = rng.standard_normal(theta.size) * np.where(np.arange(theta.size) == theta.size - 1, 0.1, 1.0)
        ends = [own.vector(own.images(theta + sign * step * move)) for sign in (1.0, -1.0)]
        central = (ends[0] - ends[1]) / (2.0 * step)
        assert np.linalg.norm(exact @ move - central) < 1e-5 * np.linalg.norm(central)


@pytest.mark.parametrize("blur", [0.0, 1.5], ids=["white", "correlated"])
def test_block_means_have_the_variance_of_the_mean_of_the_image(blur):
    """The standard error of a mean over the image that the blocks give, against its scatter over many images."""
    rng, means, predicted = np.random.default_rng(2), [], []
    known = np.ones((1, 96, 96), dtype=bool)
    for _ in range(40):
        noise = rng.standard_normal((1, 96, 96))
        noise = ndimage.gaussian_filter(noise, (0, blur, blur), mode="wrap") if blur else noise
        blocks = chosen(noise, known)
        values = blocks.means(noise)
        sides = blocks.inflation**2  # what the correlation along y adds is about that along x
        means.append(values.mean())
        predicted.append(values.var() * sides / values.size)
    assert blocks.size == 1 if blur == 0.0 else blocks.size > 3
    ratio = np.mean(np.square(means)) / np.mean(predicted)
    assert 0.55 < ratio < 1.6  # chi square of 40 degrees of freedom, 99 %


@pytest.mark.slow
def test_the_correction_is_the_error_of_the_grid_in_closed_form():
    """Along the derivative by the modulus, with Hertz's pressure averaged over 8 x 8 places in each pixel. What is left is
    of fourth order, and what oscillates with the place of the edge among the cells."""
    own = search(pressure_data(), align="none", blur=0.0)
    own.correct(theta := own.start)
    x, y = (np.asarray(axis) for axis in IMAGE.coordinates())
    places = (np.arange(8) - 3.5) / 8.0 * float(IMAGE.spacing[0])
    exact = np.mean([hertz(x + dx, y + dy)[0] for dx in places for dy in places], 0)
    slope = np.asarray(own.pressing.image_slopes(theta[:1], own.view(theta), ())[0]["pressure"][0])
    along = lambda image: np.sum(slope * image) / np.sum(slope**2)
    error = along(exact - own.images(theta, own.pressing)["pressure"])
    found = [along(one["pressure"]) for one in own.errors]
    assert abs(error) > 0.005 and np.mean(found) == pytest.approx(error, rel=0.1)


def test_lines_of_blocks_are_series():
    blocks = Blocks.of(np.ones((2, 4, 6), dtype=bool), 2)
    assert blocks.lines().tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "pressure",
        pytest.param("gap", marks=pytest.mark.long),
        pytest.param("contact", marks=pytest.mark.long),
    ],
)
def test_every_field_finds_the_modulus_and_the_shift_of_hertz(name):
    data = contact_data()
    data = dataclasses.replace(data, fields={name: data.fields[name]})
    fit = fitting.fit_fields(data, plate, {"G": 1.3e9}, indenter=BALL, grid=FINE, units={"G": "Pa"})
    low, high = fit.intervals["G"]
    assert low < TRUE < high and fit.values["G"] == pytest.approx(TRUE, rel=0.05) and fit.identified["G"]
    assert fit.view["shift_x"] == pytest.approx(2.7e-6, abs=1e-6)
    assert fit.view["shift_y"] == pytest.approx(-2.7e-6, abs=1e-6)
    lower, upper = fit.band(name)
    assert np.all(lower <= fit.predict(name)) and np.all(fit.predict(name) <= upper)
    assert float(fit.material.substrate.G) == fit.values["G"] and fit.verdict == "accepted"
    assert f"of {name}" in fit.summary() and len(fit.plot().axes) == 6
    assert fit.to_dict()["parameters"] == {"G_Pa": fit.values["G"]}


@pytest.mark.long
@pytest.mark.parametrize("blur", [0.0, 1.5], ids=["white", "correlated"])
def test_the_standard_deviation_of_a_fit_is_the_scatter_of_repeated_fits(blur):
    rng, clean, logs, sds = np.random.default_rng(3), seen(IMAGE)[0], [], []
    for _ in range(60):
        noise = rng.standard_normal(clean.shape)
        noise = ndimage.gaussian_filter(noise, blur, mode="wrap") if blur else noise
        field = clean + 0.03 * clean.max() * noise / noise.std()
        fit = fitting.fit_fields(
            fitting.ContactData([0.0], LOAD, {"pressure": field}, IMAGE),
            plate,
            {"G": TRUE},
            indenter=BALL,
            grid=MODEL,
        )
        logs.append(np.log(fit.values["G"]))
        sds.append(fit.sd_log["G"])
    assert 0.7 < np.std(logs, ddof=1) / np.mean(sds) < 1.3  # chi square of 59 degrees of freedom, 99.9 %


def bent(p):
    """A modulus that is not a monotone function of the parameter: (x^3/3 - x) of its logarithm x has a maximum at -1."""
    x = jnp.log(p["p"])
    return plate({"G": TRUE * jnp.exp(0.4 * (x**3 / 3.0 - x) - 0.8832)})


def pressure_data(seed=0, noise=0.03):
    p, rng = seen(IMAGE)[0], np.random.default_rng(seed)
    field = p + noise * p.max() * rng.standard_normal(p.shape)
    return fitting.ContactData([0.0], LOAD, {"pressure": field}, IMAGE)


@pytest.mark.long
def test_a_local_optimum_is_not_taken_for_the_best():
    """The sum of squares has a local minimum at p = exp(-1), at which a search from exp(-0.6) ends. About the best one it
    has two minima on this grid, at logarithms of 2.386 and 2.393, between which 8 cells leave the contact."""
    fit = fitting.fit_fields(
        pressure_data(), bent, {"p": np.exp(-0.6)}, indenter=BALL, grid=MODEL, align="none"
    )
    assert np.log(fit.values["p"]) == pytest.approx(2.4, abs=0.1) and fit.verdict == "accepted"


@pytest.mark.slow
def test_parameters_that_describe_the_data_equally_well_are_rejected():
    """The modulus is an even function of the logarithm of the parameter."""
    even = lambda p: plate({"G": TRUE * jnp.exp(jnp.log(p["p"]) ** 2 - 1.0)})
    fit = fitting.fit_fields(
        pressure_data(), even, {"p": np.exp(0.5)}, indenter=BALL, grid=MODEL, align="none"
    )
    assert fit.verdict == "rejected" and any("describe the data as well" in why for why in fit.refused)
    assert not fit.identified["p"]


@pytest.mark.long
def test_intervals_from_every_field_hold_the_truth():
    """Twenty images of each kind on 64 x 64 pixels, fitted on 32 x 32 cells."""
    images = fields.images(32)
    for name in fields.FIELDS:
        found = fields.covered(name, "white", images, 20)
        assert found.held >= 0.85 and abs(found.bias) < found.half and found.refused <= 0.05, name


def imprint_of(p):
    """A half-space that has lost most of its instantaneous strain ten seconds after unloading."""
    solid = jc.StandardLinearSolid(G1=1e9, G2=0.5e9, eta2=0.5e9 * p["tau"], nu=0.3)
    return jc.LayeredHalfSpace([], substrate=solid)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:the time steps have an estimated error")
def test_a_rotated_residual_imprint_finds_the_retardation_time_and_the_angle():
    """The displacement under no load after a hold, under a ball of two radii, on a grid of twice the cells; the image is
    rotated by 0.3 and shifted by ``scipy.ndimage``."""
    times, load, n, width = [0.0, 20.0, 20.0, 30.0], jc.Load([2.0, 2.0, 0.0, 0.0]), 24, 600e-6
    shape = lambda grid: jc.HeightField(
        -(grid.coordinates()[0] ** 2) / 20e-3 - grid.coordinates()[1] ** 2 / 4e-3
    )
    model, fine = jc.Grid.square(n, width), jc.Grid.square(2 * n, width)
    truth = jc.indent(imprint_of({"tau": 15.0}), shape(fine), load, times, grid=fine, substeps=8)
    assert not np.any(truth.status) and float(truth.load[-1]) == 0.0
    left, angle, shift = np.asarray(truth.displacement[-1]), 0.3, np.array([7e-6, -4e-6])
    back = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    middle = np.full(2, n - 0.5)
    moved = middle - back @ (middle + shift / (width / (2 * n)))
    image = ndimage.affine_transform(left, back, moved, order=3, mode="nearest")
    images = np.full((4, 2 * n, 2 * n), np.nan)
    images[3] = image + 0.03 * image.max() * np.random.default_rng(0).standard_normal(image.shape)
    data = fitting.ContactData(times, load, {"displacement": images}, fine)
    fit = fitting.fit_fields(
        data, imprint_of, {"tau": 8.0}, bounds={"tau": (2.0, 60.0)}, indenter=shape(model), grid=model,
        align="shift and rotation",
    )  # fmt: skip
    low, high = fit.intervals["tau"]
    assert low < 15.0 < high and high / low < 1.5
    assert fit.view["angle"] == pytest.approx(angle, abs=0.03)
    assert fit.view["shift_x"] == pytest.approx(7e-6, abs=2e-6)
    assert fit.view["shift_y"] == pytest.approx(-4e-6, abs=2e-6)


WRONG_DATA = {
    "unknown field": ({"fields": {"heat": np.zeros((4, 4))}}, "fields: expected some of"),
    "shape": ({"fields": {"gap": np.zeros((5, 4))}}, r"fields\['gap'\]: expected shape"),
    "not measured": ({"fields": {"gap": np.full((4, 4), np.nan)}}, "expected finite values"),
    "grey contact": ({"fields": {"contact": np.full((4, 4), 0.5)}}, "expected 0 and 1, got 0.5"),
    "times": ({"times": [1.0, 0.0]}, "times: expected"),
    "control": ({"control": 1.0}, "control: expected a Load or an Approach, got float"),
    "grid": ({"grid": 1.0}, "grid: expected a Grid"),
    "sigma of another": ({"sigma": {"pressure": 1.0}}, "sigma: expected those of"),
    "sigma": ({"sigma": {"gap": 0.0}}, "expected finite values > 0"),
    "shape of sigma": ({"sigma": {"gap": np.ones(3)}}, "expected a number or shape"),
}


@pytest.mark.parametrize("case", WRONG_DATA)
def test_wrong_data_are_named(case):
    changed, words = WRONG_DATA[case]
    right = {
        "times": [0.0],
        "control": LOAD,
        "fields": {"gap": np.zeros((4, 4))},
        "grid": jc.Grid.square(4, 1e-4),
    }
    with pytest.raises(ValueError, match=words):
        fitting.ContactData(**(right | changed))


WRONG_FITS = {
    "data": ({"data": 1}, "data: expected ContactData"),
    "parameters": ({"parameters": {"G": -1.0}}, "starting value > 0"),
    "grid": ({"grid": jc.Grid.square(4, 1e-4)}, "at least 8 x 8 cells"),
    "align": ({"align": "tilt"}, "align: expected one of"),
    "blur": ({"blur": -1.0}, "blur: expected a number >= 0"),
    "noise": ({"noise": "relative"}, "noise: expected one of"),
    "fixed": ({"fixed": {"nu": 0.3}}, "fixed: plate has parameters"),
    "level": ({"level": 2.0}, "level: expected between 0 and 1"),
}


@pytest.mark.parametrize(
    "case", [pytest.param(c, marks=[pytest.mark.slow] * (c == "level")) for c in WRONG_FITS]
)
def test_wrong_input_of_a_fit_is_named(case):
    changed, words = WRONG_FITS[case]
    right = {
        "data": pressure_data(),
        "body": plate,
        "parameters": {"G": TRUE},
        "indenter": BALL,
        "grid": MODEL,
    }
    with pytest.raises(ValueError, match=words):
        fitting.fit_fields(**(right | changed))


@pytest.mark.slow
def test_notes_of_the_solver_are_those_of_the_fit():
    """The contact radius, (3 W R/(8 G/(1 - nu)))^(1/3)/R = 0.4, exceeds a third of the radius of the ball."""
    load, image = 0.4**3 * 5e-3**2 * 8.0 * TRUE / (3.0 * 0.7), jc.Grid.square(16, 8e-3)
    data = fitting.ContactData([0.0], jc.Load(load), {"pressure": np.ones((16, 16))}, image)
    sought = Sought(structure := BodyParameters.of(plate, {"G": "Pa"}), limits(structure, None, None), None)
    model = (BALL, jc.Grid.square(16, 8e-3), 1e-8)
    search = FieldSearch.of(data, sought, {"G": TRUE}, model, ALIGN["none"], 0.0, "constant")
    notes = " ".join(search.notes(np.log([TRUE]), np.zeros(1), np.zeros(1)))
    assert (
        "of the ball's radius: above a third a paraboloid" in notes
        and "cells across the smallest contact" in notes
    )
