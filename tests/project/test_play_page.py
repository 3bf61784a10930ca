"""The page to play with: what it presses is what its sliders say."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("marimo", reason="the page is the extra jaxcontact[play]")

pytestmark = pytest.mark.slow  # .ci/run installs marimo for this file alone
PAGE = Path(__file__).parents[2] / "notebooks" / "play.py"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    spec = importlib.util.spec_from_file_location("play", PAGE)
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        spec.loader.exec_module(module)
    return module


def values_of(page, preset, **changed):
    given = page.PRESETS[preset][4]
    return {name: changed.get(name, 1.0) * value * page.UNITS[unit] for name, (value, unit) in given.items()}


def test_the_film_is_what_the_sliders_say(page):
    """J starts at 1/G1, gains softening/G1 in the delay, and as much as at first in the time it flows."""
    film = page.film(2e9, 3.0, 10.0, 1e4, 0.3)
    np.testing.assert_allclose(film.creep(0.0) * 2e9, 1.0, rtol=1e-12)
    np.testing.assert_allclose(film.creep(10.0) * 2e9, 1.0 + 3.0 * (1.0 - np.exp(-1.0)) + 1e-3, rtol=1e-12)
    np.testing.assert_allclose(film.creep(1e4) * 2e9, 1.0 + 3.0 + 1.0, rtol=1e-12)


@pytest.mark.parametrize("preset", ["ZDDP film on steel", "gel under a bead", "rubber under a roller"])
def test_the_ends_of_the_sliders_have_a_result_that_carries_the_load(page, preset):
    first = None
    for changed in ({}, {"load": 0.1, "radius": 0.1, "thickness": 10.0}, {"load": 10.0, "thickness": 0.3}):
        values = values_of(page, preset, **changed)
        history = page.pressed(preset, **values)
        assert np.all(history.converged)
        cell = float(np.prod(history.grid.spacing))
        np.testing.assert_allclose(np.sum(history.pressure, (1, 2)) * cell, values["load"], rtol=1e-6)
        first = history if first is None else first
        left, right = page.drawn(preset, history, first, 100.0).axes
        assert 0.0 < left.lines[1].get_ydata().max() <= left.get_ylim()[1]
        np.testing.assert_allclose(
            right.lines[0].get_ydata()[-1] / right.lines[1].get_ydata()[-1],
            first.approach[-1] / history.approach[-1],
        )


def test_the_page_runs(tmp_path):
    out = tmp_path / "play.html"
    subprocess.run([sys.executable, "-m", "marimo", "export", "html", PAGE, "-o", out], check=True)
    assert "of its thickness at most" in out.read_text()
