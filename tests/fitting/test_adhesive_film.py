"""Fits of the work of adhesion on elastic films, against the layered reference with its term of the edge."""

import functools
import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from force_curves import NU, RADIUS, SHIFT, UNITS, WORK, G
from scipy.interpolate import CubicSpline

import fitting
import jaxcontact as jc
from fitting.models.adhesive_contact import Extent, FilmOnBase, film_load_at, series_of
from jaxcontact.reference import abel

BODY = (1.0 - NU) / G, WORK, RADIUS
FILMS = [
    (0.01, 1.0),
    (0.1, 0.5),
    (10.0, 1.0),
    (100.0, 2.0),
]  # modulus over that of the base, thickness in units


@functools.cache
def branch(ratio, thickness):
    """Approach and load of the stable branch, from the reference."""
    layered = abel.Layered(G, NU, thickness * UNITS.radius, G / ratio, 0.3)
    radii = np.linspace(0.3, 2.6, 60) * UNITS.radius
    found = [abel.adhesive_contact(a, layered, RADIUS, WORK) for a in radii]
    approach, load = (np.array([getattr(one, name) for one in found]) for name in ("approach", "load"))
    end = int(np.argmin(approach))
    return approach[end:], load[end:]


def film_of(ratio, thickness):
    return FilmOnBase(thickness * UNITS.radius, G / ratio, 0.3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "ratio, thickness",
    [film if film[0] in (0.1, 10.0) else pytest.param(*film, marks=pytest.mark.slow) for film in FILMS],
)
def test_the_model_of_a_film_is_the_layered_reference_with_its_edge(ratio, thickness):
    film, extent = film_of(ratio, thickness), Extent(4.0 / thickness, 1.0 + ratio)
    approach, load = branch(ratio, thickness)
    inside = approach[2:]
    loads = jax.jit(film_load_at)
    at = lambda log_G, change, A: loads(
        inside, change, series_of(log_G, NU, 0.0, film, extent), (A, *BODY[1:]), (film.thickness, extent)
    )
    found = np.asarray(at(np.log(G), 0.0, BODY[0]))
    np.testing.assert_allclose(found, load[2:], atol=5e-5 * np.ptp(load))
    slope = jax.jacfwd(lambda q: at(np.log(G), q, BODY[0] * jnp.exp(-q)))(0.0)
    step = 1e-3
    central = [at(np.log(G) + s, 0.0, BODY[0] * np.exp(-s)) for s in (step, -step)]
    central = (np.asarray(central[0]) - np.asarray(central[1])) / (2.0 * step)
    np.testing.assert_allclose(slope, central, atol=2e-2 * np.abs(central).max())


def curve_on(ratio, thickness, noise, seed):
    """Approach and retraction of 80 points each; the standard deviation of the load in units is ``noise``."""
    approach, load = branch(ratio, thickness)
    down = np.linspace(approach[0] - 0.5 * UNITS.approach, approach[-1], 80)
    loads = CubicSpline(approach[1:], load[1:])(np.maximum(down, approach[1]))
    loads = np.where(down < 0.0, 0.0, loads), np.where(down < approach[0], 0.0, loads)[::-1]
    loads = np.concatenate(loads) + noise * UNITS.load * np.random.default_rng(seed).standard_normal(160)
    depth, marks = np.concatenate([down, down[::-1]]) + SHIFT, np.repeat(["approach", "retract"], 80)
    return fitting.IndentationData(t=0.01 * np.arange(160.0), load=loads, depth=depth, marks=marks)


def fitted(data, ratio, thickness, adhesion="JKR", **keywords):
    film = {"layer": thickness * UNITS.radius, "substrate": jc.Elastic(G / ratio, 0.3)} | keywords
    given = {"indenter": jc.Sphere(RADIUS), "nu": NU, "control": "depth", "contact_point": "fit"}
    given["bounds"] = {"G": (None, G / ratio) if ratio < 1.0 else (G / ratio, None)}
    return fitting.fit_indentation(data, "Elastic", adhesion=adhesion, **given, **film)


@pytest.mark.slow
@pytest.mark.parametrize(
    "ratio, thickness, accuracy",
    [
        (0.1, 0.5, 0.02),
        pytest.param(10.0, 1.0, 0.05, marks=pytest.mark.slow),
    ],  # many layered contacts for the series
)
def test_a_curve_on_a_film_gives_back_modulus_work_and_contact_point(ratio, thickness, accuracy):
    fit = fitted(curve_on(ratio, thickness, 0.01, 0), ratio, thickness)
    assert fit.verdict == "accepted" and fit.identified == {"G": True, "work": True}
    assert fit.values["G"] == pytest.approx(G, rel=accuracy)
    assert fit.values["work"] == pytest.approx(WORK, rel=0.03)  # the curve has 1 % of noise
    assert fit.film == film_of(ratio, thickness) and "a film of" in fit.summary()
    assert fit.nuisances["contact_point"][0] == pytest.approx(SHIFT, abs=0.01 * UNITS.approach)


@pytest.mark.long
@pytest.mark.parametrize("ratio, thickness", [(0.1, 0.5)])
def test_intervals_on_a_film_cover_the_truth(ratio, thickness):
    """60 simulated curves; with a coverage of 95 %, 52 intervals or more hold the truth with a probability of 99.8 %."""
    inside = []
    for seed in range(60):
        fit = fitted(curve_on(ratio, thickness, 0.01, seed), ratio, thickness)
        truth = {"G": G, "work": WORK}
        inside.append([fit.intervals[name][0] < truth[name] < fit.intervals[name][1] for name in truth])
    assert np.all(np.mean(inside, axis=0) > 0.86), np.mean(inside, axis=0)


@pytest.mark.long  # a curve of the solver, and many layered contacts for the series
def test_intervals_on_a_film_hold_the_truth_for_a_curve_of_the_solver_at_a_tabor_number_of_3():
    """A film of 10 times the modulus of its base: the model, without a range, gives 3 % too much work."""
    E, (approach, _) = 2.0 * G / (1.0 - NU), branch(10.0, 1.0)
    law = jc.ExponentialAdhesion(WORK, np.cbrt(RADIUS * WORK**2 / E**2) / 3.0)
    body = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(G, NU), UNITS.radius)], jc.Elastic(0.1 * G, 0.3))
    path = np.linspace(approach[-1], approach[0], 40)
    grid = jc.Grid.square(n=64, width=6.2 * UNITS.radius)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = jc.indent(
            body, jc.Sphere(RADIUS), jc.Approach(path), np.arange(40.0), grid=grid, adhesion=law, save="last"
        )
    assert np.all(found.converged)
    down = np.linspace(approach[0] - 0.5 * UNITS.approach, approach[-1], 80)
    loads = CubicSpline(path[::-1], np.asarray(found.load)[::-1])(np.maximum(down, path[-1]))
    loads = np.where(down < 0.0, 0.0, loads), np.where(down < path[-1], 0.0, loads)[::-1]
    noise = 0.003 * UNITS.load * np.random.default_rng(0).standard_normal(160)
    depth, marks = np.concatenate([down, down[::-1]]) + SHIFT, np.repeat(["approach", "retract"], 80)
    data = fitting.IndentationData(
        t=0.01 * np.arange(160.0), load=np.concatenate(loads) + noise, depth=depth, marks=marks
    )
    fit = fitted(data, 10.0, 1.0)
    assert fit.verdict == "accepted" and "taken to have no range" in " ".join(fit.notes)
    assert 1.01 * WORK < fit.values["work"] < 1.08 * WORK
    for name, truth in {"G": G, "work": WORK}.items():
        low, high = fit.intervals[name]
        assert low < truth < high


def test_what_a_fit_on_a_film_does_not_take_is_refused():
    data = curve_on(0.1, 0.5, 0.01, 0)
    with pytest.raises(ValueError, match="adhesion: expected \"JKR\" with a layer, got 'fit'"):
        fitted(data, 0.1, 0.5, "fit")
    with pytest.raises(ValueError, match="substrate: expected Elastic with nu beside a fit of the work"):
        fitted(data, 0.1, 0.5, substrate=None)
    with pytest.raises(ValueError, match="layer: expected a thickness > 0 m with a fit of the work"):
        fitted(data, 0.1, 0.5, layer=-1e-6)
    for bounds in (None, {"G": (G, 20.0 * G)}):
        with pytest.raises(
            ValueError, match=r"bounds: expected an upper bound of G up to that of the base.* lower"
        ):
            fitting.fit_indentation(
                data, "Elastic", adhesion="JKR", indenter=jc.Sphere(RADIUS), nu=NU, control="depth", layer=1e-6,
                substrate=jc.Elastic(10 * G, 0.3), bounds=bounds,
            )  # fmt: skip
    with pytest.raises(ValueError, match="grid: expected none with a fit of the work of adhesion"):
        fitted(data, 0.1, 0.5, grid=64)
