"""Pictures of results: marks where the contact is, colours and axes of times over decades, studies with units."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

import jaxcontact as jc
from jaxcontact.results import figures, plotting

GRID = jc.Grid((100, 1), (1e-6, 1e-3), periodic=(False, True))
X = np.asarray(GRID.axes()[0])


def section(first, last):
    """The texts and double arrows of the section of a contact from ``first`` to ``last`` [m]."""
    pressed = ((first < X) & (last > X)).astype(float)[:, None]
    result = SimpleNamespace(
        grid=GRID, pressure=pressed, profile=1e2 * X[:, None] ** 2, displacement=1e-7 * pressed, load=1.0,
        approach=1e-7, contact_radius=0.5 * (last - first), diagnostics=SimpleNamespace(),
    )  # fmt: skip
    ax = Figure().subplots()
    figures.contact_section(ax, result)
    texts = [text.get_text() for text in ax.texts]
    (spans,) = [[text.xy[0], text.xyann[0]] for text in ax.texts if getattr(text, "xyann", (0, 0))[0] > 0.0]
    return texts, sorted(spans)


@pytest.mark.parametrize(
    ("first", "last", "words"), [(-20e-6, 20e-6, "2a = 40 "), (-5e-6, 30e-6, "contact = 35 ")]
)
def test_the_mark_of_the_contact_is_where_the_contact_is(first, last, words):
    """A sliding contact leans forward: its mark begins and ends with the cells that are pressed."""
    texts, span = section(first, last)
    assert any(text.startswith(words) for text in texts), texts
    np.testing.assert_allclose(span, [first, last], atol=1e-9)


def test_the_film_of_a_rubbed_body_is_below_its_surface_in_the_scale_of_the_heights():
    """And material that an indenter has lost is none."""
    pressed = (np.abs(X) < 20e-6).astype(float)[:, None]
    result = SimpleNamespace(
        grid=GRID, pressure=pressed, profile=1e2 * X[:, None] ** 2, displacement=1e-7 * pressed, load=1.0,
        approach=1e-7, contact_radius=20e-6, diagnostics=SimpleNamespace(), thickness=5e-8 * pressed,
    )  # fmt: skip
    ax = Figure().subplots()
    figures.contact_section(ax, result)
    assert any(text.get_text() == "film up to 50 nm" for text in ax.texts)
    lines = [np.asarray(line.get_ydata()) for line in ax.lines]
    assert any(len(y) > 2 and np.isclose(y.min(), -1.5e-7) and np.isclose(y.max(), 0.0) for y in lines)
    result.thickness = -result.thickness
    ax = Figure().subplots()
    figures.contact_section(ax, result)
    assert not any(text.get_text().startswith("film") for text in ax.texts)


def test_what_grows_on_the_indenter_is_drawn_on_the_indenter():
    """Its lower side touches the surface, and its upper side is the indenter as it was."""
    pressed = (np.abs(X) < 20e-6).astype(float)[:, None]
    profile = 1e2 * X[:, None] ** 2
    result = SimpleNamespace(
        grid=GRID, pressure=pressed, profile=profile, displacement=1e-7 - profile * pressed, load=1.0, approach=1e-7,
        contact_radius=20e-6, diagnostics=SimpleNamespace(), thickness=2e-8 + 5e-8 * pressed,
        initial_indenter_film=np.full_like(pressed, 2e-8),
    )  # fmt: skip
    ax = Figure().subplots()
    figures.contact_section(ax, result)
    assert any(text.get_text() == "film up to 70 nm on the indenter" for text in ax.texts)
    film, outline, surface, *_ = (np.asarray(line.get_ydata()) for line in ax.lines)
    here = np.abs(X) < 43e-6
    np.testing.assert_allclose(film, (profile[:, 0] - 1e-7 + 2e-8)[here], atol=1e-15)
    np.testing.assert_allclose(film - outline, result.thickness[here, 0], atol=1e-15)
    touching = np.abs(X[here]) < 20e-6
    np.testing.assert_allclose(outline[touching], surface[touching], atol=1e-15)


def test_the_layers_of_a_coated_indenter_are_drawn_and_named():
    steel = jc.Elastic(80e9)
    coat = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9), 2e-6), jc.Layer(jc.Elastic(3e9), 5e-6)], steel)
    result = SimpleNamespace(
        grid=GRID, pressure=np.ones((100, 1)), profile=1e2 * X[:, None] ** 2, displacement=np.zeros((100, 1)), load=1.0,
        approach=1e-7, contact_radius=20e-6, diagnostics=SimpleNamespace(),
    )  # fmt: skip
    plain, coated = Figure().subplots(), Figure().subplots()
    figures.contact_section(plain, result)
    figures.contact_section(coated, result, None, jc.Sphere(1e-3, coat))
    assert len(coated.lines) == len(plain.lines) + 2
    names = "Elastic, G = 80 GPa\nElastic, G = 3 GPa, 5 µm\nElastic, G = 1 GPa, 2 µm"
    assert names in [text.get_text() for text in coated.texts]


def test_the_moment_of_rolling_with_spin_is_the_end_of_its_curve():
    grid = jc.Grid((6, 5), (2e-6, 3e-6))
    x, y = np.broadcast_arrays(*grid.coordinates())
    traction = np.stack([-2.0 * y, 3.0 * x])
    moment = float(np.sum(3.0 * x**2 + 2.0 * y**2) * grid.cell_area)
    state = SimpleNamespace(grid=grid, traction=traction, pressure=np.ones(grid.shape), moment=moment)
    ax = plotting.moment_over_the_radius(Figure().subplots(), state)
    (line,) = ax.lines
    unit = plotting.scale_of(np.array([moment]), "N m")[0]
    np.testing.assert_allclose(line.get_ydata()[-1] * unit, moment, rtol=1e-12)
    np.testing.assert_allclose(line.get_xdata()[-1], np.hypot(x, y).max() * 1e6, rtol=1e-12)


@pytest.mark.parametrize(
    ("times", "decades"),
    [
        (np.linspace(0.0, 100.0, 50), False),
        (np.geomspace(1.0, 100.0, 20), True),
        (np.append(0.0, np.geomspace(1.0, 30.0, 8)), True),
        (np.append(0.0, np.geomspace(20.0, 60.0, 8)), False),
        (np.array([0.0, 50.0, 100.0]), False),
    ],
)
def test_axes_and_colours_of_times_are_logarithmic_where_times_span_decades(times, decades):
    """Then the colours of evenly spaced logarithms are evenly spaced."""
    assert plotting.shows_decades(times) == decades
    colours, later = plotting.colours_of_time(times), times[times > 0.0]
    spaced = np.diff(colours.norm(later))
    if times.size > 3 and (decades or np.allclose(np.diff(later), later[1] - later[0], atol=1e-9)):
        assert np.ptp(spaced) < 1e-9


def test_colours_of_crowded_times_follow_their_order():
    """Ten of 14 times are in the last hundredth: all 14 have colours evenly apart, and ticks of the bar are such times."""
    times = np.concatenate([np.linspace(0.0, 99.0, 4), 99.1 + 0.1 * np.arange(10)])
    ax = Figure().add_subplot()
    plotting.time_lines(ax, np.arange(3.0), np.outer(times, np.ones(3)), times)
    colours = np.array([line.get_color() for line in ax.lines])
    expected = plotting.colormaps[plotting.COLOURS](np.linspace(0.0, 1.0, 14))
    np.testing.assert_allclose(colours, expected, atol=0.02)
    ticks = ax.figure.axes[1].get_yticks()
    assert ticks[0] == 0.0 and ticks[-1] == pytest.approx(100.0) and np.median(ticks) > 99.0


def test_studies_have_units_with_prefixes_and_ticks_at_their_values():
    cases = [{"layer.thickness [m]": h, "load": w} for h in (1e-7, 2e-7, 4e-7) for w in (10.0, 15.0)]
    figure = plotting.studies_figure(cases, {"peak_pressure": np.linspace(1e8, 6e8, 6)})
    ax, _ = figure.axes
    assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_title()) == (
        "layer.thickness [nm]",
        "load",
        "peak pressure [MPa]",
    )
    np.testing.assert_allclose(ax.get_xticks(), [100.0, 200.0, 400.0])
    np.testing.assert_allclose(ax.get_yticks(), [10.0, 15.0])
    assert [label.get_text() for label in ax.get_xticklabels()] == ["100", "200", "400"]
    mesh = ax.collections[0]
    np.testing.assert_allclose(np.sort(np.ravel(mesh.get_array())), np.linspace(100.0, 600.0, 6))


def test_a_traction_that_is_zero_is_not_in_the_legend():
    line = np.where(np.abs(X) < 2e-5, 1e6, 0.0)[:, None]
    result = SimpleNamespace(
        grid=GRID, pressure=line, traction=np.stack([0.3 * line, 0.0 * line]), stick=0.0 * line
    )
    ax = plotting.tractions_on_the_axis(Figure().subplots(), result)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["pressure", "traction x"]


def test_the_load_is_written_below_the_names_of_the_layers_of_an_indenter():
    steel = jc.Elastic.from_young(210e9, nu=0.3)
    ball = jc.Sphere(5e-3, jc.LayeredHalfSpace([jc.Layer(steel, 20e-6)], steel))
    result = SimpleNamespace(
        grid=GRID, pressure=np.ones((100, 1)), profile=1e2 * X[:, None] ** 2, displacement=np.zeros((100, 1)), load=1.0,
        approach=1e-7, contact_radius=20e-6, diagnostics=SimpleNamespace(),
    )  # fmt: skip
    ax = Figure((5.2, 3.8)).subplots()  # axes as large as in the picture of a history
    figures.contact_section(ax, result, None, ball)
    boxes = {text.get_text(): text.get_window_extent() for text in ax.texts}
    (load,) = (box for text, box in boxes.items() if text.startswith("load"))
    (names,) = (box for text, box in boxes.items() if "Elastic" in text)
    assert load.x1 > names.x0 and names.y0 > load.y1
