"""The page to play with: what it presses is what its sliders say."""

import importlib.util
import re
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


def drawn_lines(picture):
    """The points (n, 2) of each line of a picture: pressure before and now, approach before and now, and the time."""
    return [
        np.array([pair.split(",") for pair in points.split()], dtype=float)
        for points in re.findall(r'<polyline points="([^"]*)"', picture.text)
    ]


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
        lines = drawn_lines(page.drawn(preset, history, first, 100.0))
        heights = [190.0 - line[:, 1] for line in lines]  # above the axes, which are 180 units high
        assert all(np.all((height >= 0.0) & (height <= 180.0)) for height in heights)
        at = page.TIMES.tolist().index(100.0)
        peaks = [one.pressure[at].max() for one in (first, history)]
        np.testing.assert_allclose(heights[0].max() / heights[1].max(), peaks[0] / peaks[1], rtol=5e-3)
        deep = first.approach[-1] / history.approach[-1]
        np.testing.assert_allclose(heights[2][-1] / heights[3][-1], deep, rtol=5e-3)


def test_the_page_runs(tmp_path):
    out = tmp_path / "play.html"
    subprocess.run([sys.executable, "-m", "marimo", "export", "html", PAGE, "-o", out], check=True)
    assert "of its thickness at most" in out.read_text()
