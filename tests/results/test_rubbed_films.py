"""Figures and derived quantities of a film that forms, from made-up fields; and the names of its laws."""

import dataclasses
import inspect

import jax
import numpy as np
import pytest
from test_storage import made_up

import jaxcontact as jc
from jaxcontact.results import figures

LINE = jc.Grid((6, 1), (2e-6, 1e-3), periodic=(False, True))


def lines_of(axes):
    return {line.get_label(): line.get_ydata() for line in axes.get_lines()}


def test_a_figure_has_the_section_the_growth_and_three_maps_with_their_units():
    made = made_up(jc.RubbingHistory)
    section, growth, *maps = (ax for ax in made.plot().axes if ax.get_xlabel())
    np.testing.assert_allclose(
        section.get_lines()[-1].get_ydata(), made.thickness[-1, :, 2] * 1e6, rtol=1e-12
    )
    curves = lines_of(growth)
    np.testing.assert_allclose(curves["largest"], made.thickness.max((1, 2)) * 1e6, rtol=1e-12)
    np.testing.assert_allclose(curves["in the middle"], made.thickness[:, 3, 2] * 1e6, rtol=1e-12)
    np.testing.assert_allclose(curves["mean in contact"], made.thickness.mean((1, 2)) * 1e6, rtol=1e-12)
    shown = [ax.collections[0] for ax in maps]
    for mesh, field in zip(shown, (made.thickness, made.pressure, made.temperature), strict=True):
        values = np.asarray(mesh.get_array())
        np.testing.assert_allclose(values / values.max(), field[-1].T / field[-1].max(), rtol=1e-12)
    labels = [ax.get_ylabel() for ax in made.plot().axes]
    assert {"thickness [µm]", "pressure [µPa]", "temperature [µK]"} <= set(labels)


@pytest.mark.parametrize(
    ("changes", "panels"),
    [
        ({"temperature": None}, 4),
        ({"last": True}, 4),
        ({"last": True, "temperature": None}, 3),
        ({"grid": LINE}, 2),
        ({"grid": LINE, "last": True}, 1),
    ],
    ids=str,
)
def test_a_figure_leaves_out_what_is_not_there(changes, panels):
    shape = {name: changes[name] for name in ("last", "grid") if name in changes}
    made = made_up(jc.RubbingHistory, **shape)
    if "temperature" in changes:
        made = dataclasses.replace(made, temperature=None)
    assert sum(bool(ax.get_xlabel()) for ax in made.plot().axes) == panels


def test_a_run_shows_the_film_in_section_where_one_forms():
    made = made_up(jc.RubbingHistory)
    x, times = made.grid.axes()[0], made.times
    figure = figures.film_of(x, {"thickness_line": made.thickness[:, :, 2]}, times)
    assert len(figure.axes[0].get_lines()) == len(times)
    assert figures.film_of(x, {"pressure_line": made.pressure[:, :, 2]}, times) is None


def test_peaks_are_those_of_the_maps_and_are_missing_without_them():
    made = made_up(jc.RubbingHistory)
    np.testing.assert_array_equal(made.peak_thickness, [h.max() for h in made.thickness])
    np.testing.assert_array_equal(made.peak_temperature, [t.max() for t in made.temperature])
    assert "peak thickness" in made.summary() and "peak temperature" in made.summary()
    with pytest.raises(AttributeError, match=r"peak_temperature: .* without thermal="):
        _ = dataclasses.replace(made, temperature=None).peak_temperature
    with pytest.raises(AttributeError, match=r"peak_thickness: .* the last map only"):
        _ = made_up(jc.RubbingHistory, last=True).peak_thickness


GIVEN = {"activation_energy": 1.2e-19, "activation_volume": 4e-30, "temperature": 373.0}


def test_a_rate_is_given_by_its_name_by_position_or_by_the_name_of_its_field():
    """``rate`` is a keyword of the constructor and the method that a rubbing calls."""
    for make, others in ((jc.StressActivated, GIVEN), (jc.ProportionalRemoval, {})):
        laws = [make(rate=1e-2, **others), make(1e-2, *others.values()), make(rate_constant=1e-2, **others)]
        assert laws[0] == laws[1] == laws[2] and laws[0].rate_constant == 1e-2
        assert callable(laws[0].rate) and next(iter(inspect.signature(make).parameters)) == "rate"
        assert dataclasses.replace(laws[0], rate_constant=2.0).rate_constant == 2.0
        assert jax.tree.map(lambda leaf: 2 * leaf, laws[0]).rate_constant == 2e-2
        with pytest.raises(TypeError, match="multiple values"):
            make(1e-2, *others.values(), rate=1e-2)
        with pytest.raises(TypeError, match="missing"):
            make(**others)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("moves", [pytest.param(False, marks=pytest.mark.long), True])
def test_wear_down_to_the_base_has_a_note_with_its_time_and_its_share_of_the_contact(moves):
    """The volume that is lost is then less than Archard's, coefficient x load x path; counted from the kept fields."""
    thin = jc.LayeredHalfSpace([jc.Layer(jc.Elastic(1e9, 0.3), 2e-7)], jc.Elastic.from_young(210e9))
    times, grid = np.linspace(0.0, 10.0, 21), jc.Grid((48, 24), (8e-6, 8e-6))
    motion = {"path": 4e-5 * np.sin(times)} if moves else {"velocity": 0.1}
    coefficient = 3e-11 if moves else 4e-15
    run = lambda save, law: jc.rub(
        thin, jc.Sphere(5e-3), jc.Load(1.0), times, law=law, grid=grid, save=save, substeps=4, **motion
    )
    kept, last = (run(save, jc.Archard(coefficient)) for save in ("all", "last"))
    (note,), *others = ([note for note in each.notes if "worn to its base" in note] for each in (kept, last))
    assert others == [[note]]
    pressed = np.asarray(kept.pressure) > 0.0
    bare = pressed & (np.asarray(kept.thickness) == 0.0)
    share = bare.sum((1, 2)) / pressed.sum((1, 2))
    first = float(note.split("t = ")[1].split(" s")[0])
    index = int(np.argmax(share > 0.0))
    assert times[index - 1] < first <= times[index]
    assert float(note.split("up to ")[1].split(" %")[0]) >= 100.0 * share.max() * 0.99
    volume = float((kept.thickness[0] - kept.thickness[-1]).sum() * grid.cell_area)
    way = np.abs(np.diff(motion["path"])).sum() if moves else 1.0
    assert volume < 0.95 * coefficient * 1.0 * way
    for save in ("all", "last"):
        gentle = run(save, jc.Archard(1e-3 * coefficient))
        assert not [note for note in gentle.notes if "base" in note]
