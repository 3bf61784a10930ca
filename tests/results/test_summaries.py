"""What a result shows of itself, against what it holds."""

import dataclasses
import re
import sys

import jax
import matplotlib
import numpy as np
import pytest
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from tolerances import PEAK_ON_FEW_CELLS

import jaxcontact as jc
from jaxcontact._support import fields
from jaxcontact._support.prefixes import prefixed
from jaxcontact.results.plotting import colours_of_time, pick, time_axis
from jaxcontact.results.summaries import component

GRID = jc.Grid.square(n=32, width=5e-4)
RUBBER = jc.LayeredHalfSpace([], substrate=jc.Maxwell(G=1e6, eta=1e7, nu=0.4))
BALL = jc.Sphere(1e-2)


@pytest.fixture(scope="module")
def history():
    return jc.indent(RUBBER, BALL, jc.Load(5e-3), [0.0, 1.0, 2.0], grid=GRID)


@pytest.mark.slow
def test_a_history_shows_itself_in_ten_lines(history):
    text = repr(history)
    assert text == str(history) == history.summary() and len(text.splitlines()) <= 10
    assert "array" not in text and "3 times from 0 to 2 s on 32 x 32 cells of 15.625 µm" in text
    row = re.search(r"approach +([\d.]+) µm +([\d.]+) µm +([\d.]+) µm", text)
    np.testing.assert_allclose(
        [float(x) * 1e-6 for x in row.groups()], np.asarray(history.approach)[[0, 2, 2]], rtol=1e-4
    )
    assert re.search(r"load +5 mN +5 mN +5 mN", text) and "3 converged" in text
    first = jax.tree.map(lambda values: values[:1] if np.shape(values)[:1] == (3,) else values, history)
    assert repr(first).startswith("ContactHistory at 0 s on 32 x 32 cells")


def test_a_notebook_shows_text_and_a_picture(history):
    html = history._repr_html_()
    assert html.startswith("<pre>ContactHistory") and "data:image/png;base64,iVBOR" in html


def test_what_is_sheared_shows_where_it_slips_and_its_loop(history):
    """Traction along x alone; the half x < 0 of the contact slips back; the load in mN over the shift in µm is as given."""
    p = np.asarray(history.pressure)
    back = (p > 0.0) & (np.asarray(GRID.axes()[0]) < 0.0)[:, None]
    none = np.zeros_like(p)
    ways = np.array([[1.0, 0.0], [3.0, 0.0], [-4.0, 0.0]])
    sheared = jc.ShearHistory(
        **vars(history), traction=np.stack([0.5 * p, none], 1), slip=np.stack([-1e-6 * back, none], 1),
        stick=(p > 0.0) & ~back, tangential_load=1e-3 * ways, tangential_displacement=1e-6 * ways,
        dissipated=np.zeros(3), friction_work=none[-1],
    )  # fmt: skip
    assert re.search(r"tangential load x +1 mN +-4 mN +-4 mN\n", sheared.summary())
    assert re.search(r"tangential shift x +1 µm +-4 µm +-4 µm\n", sheared.summary())
    left, middle, right = sheared.plot().axes[:3]
    drawn = left.collections[0].get_array().reshape(p.shape[1:]).T
    np.testing.assert_array_equal(drawn, np.where(back[-1], 1, np.where(p[-1] > 0.0, 2, 0)))
    arrows = left.collections[1]
    assert arrows.U.size > 10 and np.all(arrows.U < 0.0) and np.all(arrows.X < 0.0)
    pressed, along_x = (line.get_ydata() for line in middle.lines)  # the traction along y, zero, is not drawn
    np.testing.assert_allclose(pressed, p[-1, :, 16] / 1e3)
    np.testing.assert_allclose(along_x, pressed / 2)
    assert [text.get_text() for text in middle.get_legend().get_texts()] == ["pressure", "traction x"]
    np.testing.assert_allclose(right.lines[0].get_xydata(), np.repeat(ways[:, :1], 2, 1))


def test_stresses_below_are_drawn_in_the_cut_through_their_peak():
    """A single cell is pulled at 4 MPa, 2 um deep: von Mises stress of 4 MPa there and none elsewhere."""
    stress = np.zeros((3, 3, 3, *GRID.shape))
    stress[1, 0, 0, 20, 5] = 4e6
    inside = jc.InteriorFields(GRID, np.array([1e-6, 2e-6, 5e-6]), stress, np.zeros((3, 3, *GRID.shape)))
    cut, over_depth = inside.plot().axes[:2]
    drawn = cut.collections[0].get_array().reshape(3, -1)
    assert np.flatnonzero(drawn).tolist() == [GRID.shape[0] + 20] and drawn.max() == pytest.approx(4.0)
    assert cut.yaxis_inverted() and over_depth.yaxis_inverted()
    assert cut.get_title().startswith("+ 4 MPa") and over_depth.get_title() == "below the +"
    np.testing.assert_allclose(over_depth.lines[0].get_xydata(), [[0, 1], [4, 2], [0, 5]], atol=1e-12)


def test_the_sheet_has_the_dimensions_of_the_contact_and_axes_from_zero(history):
    """Outline and surface are those of the fields, equal in contact; the load is constant and stands in the title."""
    figure = history.plot(RUBBER)
    section = figure.axes[0]
    text = " ".join(one.get_text() for one in section.texts)
    width, depth = 2e6 * float(history.contact_radius[-1]), 1e6 * float(history.approach[-1])
    assert f"2a = {width:.4g} µm" in text and f"approach {depth:.4g} µm" in text
    assert "load 5 mN" in text and "radius 10 mm" in text and "Maxwell, G = 1 MPa" in text
    outline, surface = (line.get_xydata() for line in section.lines[:2])
    touching = np.abs(outline[:, 0]) < 0.9 * float(history.contact_radius[-1])
    np.testing.assert_allclose(outline[touching], surface[touching], atol=1e-6 * depth * 1e-6)
    far = np.abs(outline[:, 0]) > 1.5 * float(history.contact_radius[-1])
    assert np.all(outline[far, 1] > surface[far, 1])
    assert figure.get_suptitle() == "load 5 mN"
    over_time = [ax for ax in figure.axes if ax.get_xlabel() == "time [s]"]
    assert len(over_time) == 3 and all(ax.get_ylim()[0] == 0.0 for ax in over_time)


def test_interfaces_and_the_maximum_are_marked_where_they_are():
    stress = np.zeros((3, 3, 3, *GRID.shape))
    stress[1, 0, 0, 20, 5] = 4e6
    fields = np.array([1e-6, 2e-6, 5e-6]), stress, np.zeros((3, 3, *GRID.shape))
    # the second below the drawing
    inside = jc.InteriorFields(GRID, *fields, interfaces=np.array([3e-6, 9e-6]))
    cut, over_depth = inside.plot().axes[:2]
    interface, cross = cut.lines
    assert set(interface.get_ydata()) == {3.0} and cut.get_title() == "+ 4 MPa, dashed: interface"
    np.testing.assert_allclose(cross.get_xydata(), [[float(GRID.axes()[0][20]) * 1e6, 2.0]])
    assert set(over_depth.lines[1].get_ydata()) == {3.0}


def test_a_sheet_takes_a_body_and_fields_below_it(history):
    with pytest.raises(ValueError, match="body: expected a LayeredHalfSpace or None, got Maxwell"):
        history.plot(RUBBER.substrate)
    with pytest.raises(
        ValueError, match="inside: expected the result of subsurface or None, got ContactHistory"
    ):
        history.plot(None, history)


def test_rounding_beside_a_load_is_shown_as_nothing():
    """And a small component that is more than that is shown as it is."""
    shown = component(np.array([[3.0, 2e-13], [1e-7, 0.0]]), "x"), component(np.array([[3.0, 2e-13]]), "y")
    np.testing.assert_array_equal(shown[0], [3.0, 1e-7])
    np.testing.assert_array_equal(shown[1], [0.0])


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (3.3554e-6, "m", "3.3554 µm"), (60.0, "N", "60 N"), (1e3, "Pa", "1 kPa"), (999.99e6, "Pa", "999.99 MPa"),
        (0.0, "N", "0 N"), (-2e-3, "N", "-2 mN"), (float("nan"), "m", "nan m"), (0.25, "", "0.25"),
        (5e-15, "m", "0.005 pm"), (-6.2719e-16, "Pa", "-6.27e-16 Pa"), (2.5e13, "Pa", "25000 GPa"),
    ],
)  # fmt: skip
def test_prefixes(value, unit, text):
    assert prefixed(value, unit) == text


def test_the_peak_of_each_time_is_that_of_its_map_or_absent(history):
    """Hertz: under a held load the mean pressure is 2/3 of the peak, whatever the creep."""
    mean = np.asarray(history.load / (np.pi * history.contact_radius**2))
    np.testing.assert_allclose(history.peak_pressure, 1.5 * mean, rtol=PEAK_ON_FEW_CELLS)
    many = jax.tree.map(lambda a: np.stack([a, 2 * a]), history)
    np.testing.assert_allclose(many.peak_pressure[1], 2 * history.peak_pressure)
    last = dataclasses.replace(history, pressure=history.pressure[-1], displacement=history.displacement[-1])
    assert not hasattr(last, "peak_pressure")
    with pytest.raises(AttributeError, match=r"got the last map only.*save=lambda step: step.pressure.max"):
        float(last.peak_pressure)


def test_the_last_field_alone_and_steady_states_and_many_runs(history):
    peak = float(np.max(history.pressure[-1]))
    last = dataclasses.replace(history, pressure=history.pressure[-1], displacement=history.displacement[-1])
    row = re.search(r"peak pressure +([\d.]+) kPa\n", last.summary())
    assert float(row.group(1)) == pytest.approx(peak / 1e3, rel=1e-4)
    steady = jc.SteadySliding(
        **{name: np.asarray(1.5) for name in fields.stored_fields(jc.SteadySliding)}
        | {"grid": GRID, "pressure": np.full((2, 2), 3e6), "status": np.asarray(6)}
    )
    assert re.search(
        r"tangential force +1.5 N\n", repr(steady)
    ) and "peak pressure                3 MPa" in str(steady)
    assert "1 no steady state" in str(steady)
    many = jax.tree.map(lambda a: np.stack([a, a]), history)
    assert repr(many) == "ContactHistory of status (2, 3): no single run"
    assert repr(jax.tree.map(lambda a: a[0], many)).startswith("ContactHistory of 3 times")
    with pytest.raises(ValueError, match=r"of one run, got a status of shape \(2, 3\)"):
        many.to_xarray()


def test_labelled_arrays_and_tables(history):
    xarray = pytest.importorskip("xarray")
    labelled = history.to_xarray()
    assert isinstance(labelled, xarray.Dataset) and labelled.pressure.dims == ("time", "x", "y")
    assert labelled.approach.attrs["units"] == "m"
    np.testing.assert_array_equal(labelled.pressure, history.pressure)
    frame = history.to_dataframe()
    assert frame.index.name == "times [s]" and "pressure [Pa]" not in frame
    np.testing.assert_array_equal(frame["approach [m]"], history.approach)


def test_labelled_arrays_have_the_gap_and_name_their_directions(history):
    """The gap is profile + displacement - approach, of the last time alone where the fields are."""
    pytest.importorskip("xarray")
    labelled = history.to_xarray()
    assert labelled.gap.dims == ("time", "x", "y") and labelled.gap.attrs["units"] == "m"
    expected = labelled.profile + labelled.displacement - labelled.approach
    np.testing.assert_array_equal(labelled.gap, expected.transpose("time", "x", "y"))
    assert "direction" not in labelled.coords
    last = {"pressure": history.pressure[-1], "displacement": history.displacement[-1]}
    alone = dataclasses.replace(history, **last).to_xarray()
    assert alone.gap.dims == ("x", "y")
    np.testing.assert_array_equal(alone.gap, labelled.gap[-1])
    own = {name: np.asarray(1.5) for name in fields.stored_fields(jc.SteadySliding)}
    named = ("pressure", "displacement", "profile", "contact_pressure", "shear_strength")
    maps = dict.fromkeys(named, np.ones(GRID.shape))
    vectors = dict.fromkeys(("velocity", "lateral_force", "pressure_centre"), np.array([1.0, 2.0]))
    sliding = jc.SteadySliding(**own | maps | vectors | {"grid": GRID, "status": np.asarray(0)})
    assert float(sliding.to_xarray().velocity.sel(direction="y")) == 2.0


def test_statistics_are_shown_in_words_and_units_with_prefixes():
    """No prefix before the power of a unit, which would be raised with it; an array by its ends."""
    numbers = dict(mean_pressure=np.array([2e3, 3e6]), area_fraction=0.25, corrected_fraction=0.125)
    shown = str(jc.ContactStatistics(**numbers, perimeter=4e-6, mean_gap=5e-9))
    for words in (
        "mean pressure +2 from 2 kPa to 3 MPa",
        "area fraction +0.25",
        "perimeter +4 µm",
        "gap +5 nm",
    ):
        assert re.search(words, shown)
    waves = dict(wavenumber=np.array([1e3, 2e3]), spectrum=np.array([1e-30, 3e-30]))
    shown = repr(jc.SurfaceStatistics(rms_height=6e-9, rms_slope=0.1, rms_curvature=7e3, **waves))
    for words in ("rms height +6 nm", "curvature +7000 1/m", "spectrum +2 from 1e-30 m.4 to 3e-30 m.4"):
        assert re.search(words, shown)
    assert "no numbers" in str(jax.eval_shape(lambda: jc.ContactStatistics(*[np.zeros(2)] * 5)))


def test_without_the_extra_the_words_say_what_to_install(history, monkeypatch):
    for name, call in (("xarray", history.to_xarray), ("pandas", history.to_dataframe)):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(ImportError, match=r"pip install 'jaxcontact\[io\]'"):
            call()


@pytest.mark.parametrize("count", [1, 2, 40, 41, 79, 151, 2000])
def test_lines_of_a_picture_are_in_equal_steps(count):
    """A step that differs looks like an event: of 41 lines one was left out. The last line is always there."""
    shown = pick(count)
    assert shown[0] == 0 and shown[-1] == count - 1 and len(shown) <= 41
    assert len(set(np.diff(shown)[:-1])) <= 1


@pytest.mark.parametrize(
    ("times", "scale"),
    [
        (np.linspace(0.0, 7200.0, 151), "linear"),
        (7200.0 * np.linspace(0.0, 1.0, 31) ** 2, "linear"),
        (np.append(0.0, np.geomspace(1.0, 3600.0, 12)), "symlog"),
        (np.geomspace(1e-3, 1e3, 60), "symlog"),
        (np.array([0.0]), "linear"),
    ],
)
def test_time_is_logarithmic_where_decades_are_shown(times, scale):
    """Equal steps and those of a square root are not; all times stay on the axis, zero among them."""
    ax = Figure().add_subplot()
    ax.plot(times, times)
    time_axis(ax, times)
    assert ax.get_xscale() == scale and ax.get_xlim()[0] <= times[0] <= times[-1] <= ax.get_xlim()[1]
    assert isinstance(colours_of_time(times).norm, LogNorm) == (scale == "symlog")


def test_the_common_style_leaves_no_trace(history):
    figure = history.plot()
    assert not figure.axes[0].spines["right"].get_visible()
    assert matplotlib.rcParams["axes.spines.right"] and matplotlib.rcParams["legend.frameon"]
    with matplotlib.style.context("jaxcontact.style"):  # as users would
        assert not matplotlib.rcParams["axes.spines.right"]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_step_without_a_result_prints_no_numbers_and_does_not_hide_the_largest_of_the_others():
    """The second step is nan, as after a solver that failed, though its load and area are numbers."""
    body, grid = jc.LayeredHalfSpace([], jc.Elastic(30e9, 0.25)), jc.Grid.square(16, 3e-4)
    history = jc.indent(body, jc.Sphere(5e-3), jc.Load(np.array([5.0, 20.0])), [0.0, 1.0], grid=grid)
    nan = np.array([0.0, np.nan])
    failed = dataclasses.replace(
        history,
        approach=history.approach + nan,
        status=np.array([0, int(jc.Status.NOT_FINITE)]),
        pressure=history.pressure + nan[:, None, None],
    )
    rows = [
        line
        for line in str(failed).splitlines()[2:]
        if not line.startswith(("note", "2 ")) and "iterations" not in line
    ]
    assert len(rows) > 4
    for row in rows:
        first, last, largest = row[20:34].strip(), row[34:48].strip(), row[48:62].strip()
        assert last.startswith("nan") and first == largest and not first.startswith("nan"), row
