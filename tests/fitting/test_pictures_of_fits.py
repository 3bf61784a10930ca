"""Pictures of fits: axes on which a misfit is seen, residuals in standard deviations, all models of a comparison."""

import matplotlib
import numpy as np
import pytest

import fitting
import jaxcontact as jc

SOLID = jc.StandardLinearSolid(1e9, 5e8, 3e11)
T = np.geomspace(1.0, 1e4, 60)
NOISE = 0.01


@pytest.fixture(scope="module")
def table():
    noise = np.random.default_rng(0).standard_normal(60)
    data = fitting.CreepData(t=T, J=np.asarray(SOLID.creep(T)) * (1.0 + NOISE * noise))
    return fitting.compare(data, ["Maxwell", "StandardLinearSolid"], weights="relative")


@pytest.mark.slow
def test_creep_over_decades_has_logarithmic_axes_and_residuals_in_standard_deviations(table):
    """Measured minus fitted over the noise, which is 1 % of the values; rejected fits are red above."""
    best, worst = table.fits
    top, bottom = best.plot().axes[:2]
    assert top.get_xscale() == top.get_yscale() == "log"
    assert "deviations" in bottom.get_ylabel()
    (points,) = (line for line in bottom.lines if line.get_marker() == ".")
    residual = (best.curve[3] - best.fitted) / (NOISE * best.fitted)
    np.testing.assert_allclose(points.get_ydata(), residual, rtol=0.3, atol=0.2)
    assert worst.refused and worst.plot().get_suptitle().startswith("rejected")


def test_a_point_at_zero_stays_in_view():
    t = np.append(0.0, T)
    fit = fitting.fit_creep(
        fitting.CreepData(t=t, J=np.asarray(SOLID.creep(t)), sigma=np.full(61, 1e-12)), "Maxwell"
    )
    top = fit.plot().axes[0]
    assert top.get_xscale() == "symlog" and top.get_xlim()[0] <= 0.0


@pytest.mark.slow
@pytest.mark.parametrize(("ramp", "scale"), [(5.0, "log"), (300.0, "linear")])
def test_the_creep_of_an_indentation_hold_is_drawn_over_logarithmic_time(ramp, scale):
    """A load that rises all the time is no hold, and is drawn over linear time."""
    t = np.linspace(0.5, 300.0, 60)
    load = 1e-3 * np.minimum(t / ramp, 1.0)
    depth = (3.0 * 0.7 / 8.0 / np.sqrt(1e-4) * np.asarray(SOLID.creep(t)) * load) ** (2.0 / 3.0)
    data = fitting.IndentationData(t=t, load=load, depth=depth)
    fit = fitting.fit_indentation(data, "Maxwell", indenter=jc.Sphere(1e-4), nu=0.3)
    top = fit.plot().axes[0]
    assert (top.get_xscale(), top.get_yscale()) == (scale, "linear")


@pytest.mark.parametrize(("noise", "words"), [(1e-5, "95 % band, within the line"), (0.2, "95 % band")])
def test_the_legend_says_where_a_band_is_hidden_by_its_line(noise, words):
    """The line is drawn at even distances of log t, without a straight part between the first samples."""
    t = np.linspace(30.0, 7200.0, 60)
    J = np.asarray(SOLID.creep(t)) * (1.0 + noise * np.random.default_rng(1).standard_normal(60))
    fit = fitting.fit_creep(fitting.CreepData(t=t, J=J), jc.StandardLinearSolid, weights="relative")
    top = fit.plot().axes[0]
    assert words in [text.get_text() for text in top.get_legend().get_texts()]
    (line,) = (line for line in top.lines if line.get_label().startswith("Standard"))
    assert np.ptp(np.diff(np.log(line.get_xdata()))) < 1e-9


def test_the_picture_of_a_comparison_has_all_models_and_their_residuals(table, tmp_path):
    """Residuals of the best model are those of its own picture; those of Maxwell are many of its standard deviations."""
    figure = table.plot(tmp_path / "models.png")
    top, *below = figure.axes
    labels = [text.get_text() for text in top.get_legend().get_texts()]
    assert labels[0] == "data" and [label.split(",")[0] for label in labels[1:]] == [
        "StandardLinearSolid",
        "Maxwell",
    ]
    assert "rejected" in labels[2] and (tmp_path / "models.png").stat().st_size > 5000
    spread = [np.std(axes.lines[0].get_ydata()) for axes in below]
    assert 0.7 < spread[0] < 1.3 and spread[1] > 10.0


def test_pictures_of_fits_have_the_style_of_those_of_results_and_leave_that_of_others_alone(table):
    before = dict(matplotlib.rcParams)
    top = table.fits[0].plot().axes[0]
    assert not top.spines["right"].get_visible() and not top.get_legend().get_frame_on()
    assert dict(matplotlib.rcParams) == before
