"""What a terminal shows while a run compiles and marches, by a clock that the test turns."""

import io

import pytest

from jaxcontact._support.terminal import Progress, working


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    now = [1000.0]
    monkeypatch.setattr("tqdm.std.time", lambda: now[0])
    return now


def test_the_bar_says_compiling_and_its_rate_begins_after_it(clock):
    """30 s for the first 5 steps, which compile, then 5 steps a second."""
    terminal = Terminal()
    with Progress(20, "step", file=terminal) as progress:
        assert "compiling:   0%" in terminal.getvalue()
        clock[0] += 30.0
        progress.advance(5)
        for _ in range(2):
            clock[0] += 1.0
            progress.advance(5)
        last = terminal.getvalue().split("\r")[-1]
    assert "compiling" not in last
    assert "15/20 [00:02<00:01,  5.00step/s]" in last


def test_work_without_steps_is_named_from_the_start(clock):
    terminal = Terminal()
    with working("figure_4: compiling and running", file=terminal):
        assert "figure_4: compiling and running ..." in terminal.getvalue()


def test_where_there_is_no_terminal_nothing_is_written():
    stream = io.StringIO()
    with Progress(20, "step", file=stream) as progress, working("solving", file=stream):
        progress.advance(5)
    assert stream.getvalue() == ""
