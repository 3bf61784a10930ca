"""The page of ``jaxcontact play``: what its server computes is what its sliders say, and it works in a browser."""

import html
import http.client
import json
import re
import shutil
import signal
import subprocess
import sys
import threading
from contextlib import closing, contextmanager

import jax
import numpy as np
import pytest
from page_probe import POINTS

import jaxcontact as jc
from jaxcontact.__main__ import main
from jaxcontact.shell.case_file import read_case
from jaxcontact.shell.playground.server import PAGE, PRESETS, TIMES, PageServer, contact, solve

NODE = shutil.which("node")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
STEEL, GLASS = jc.Elastic.from_young(210e9, nu=0.3), jc.Elastic.from_young(70e9, nu=0.22)
ZDDP, GEL, ROLLER = PRESETS


@contextmanager
def served(solver):
    """A server of the page with a solver."""
    server = PageServer(0, solver)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()


def asked(server, method, path, body=None, **headers):
    """The status and the text of an answer."""
    with closing(http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=60)) as connection:
        connection.request(method, path, body, headers)
        answer = connection.getresponse()
        return answer.status, answer.read().decode()


def request_of(preset, **changed):
    return json.dumps({"preset": preset, "values": PRESETS[preset].values | changed})


def test_a_page_that_waits_is_told_for_what():
    started, go_on = threading.Event(), threading.Event()

    def solver(name, values):
        started.set()
        go_on.wait(30.0)
        return {"name": name, "values": values}

    with served(solver) as server:
        stage = lambda: json.loads(asked(server, "GET", "/stage")[1])["stage"]
        answers = []
        ask = lambda: answers.append(asked(server, "POST", "/run", request_of(GEL)))
        waiting = threading.Thread(target=ask)
        waiting.start()
        assert started.wait(30.0) and stage() == "compiling"
        go_on.set()
        waiting.join()
        assert json.loads(answers[0][1]) == {"name": GEL, "values": list(PRESETS[GEL].values.values())}
        assert asked(server, "POST", "/run", request_of(ZDDP))[0] == 200 and stage() == "compiling"
        assert asked(server, "POST", "/run", request_of(ZDDP, load=0.02))[0] == 200 and stage() == "computing"


@pytest.mark.parametrize(
    "body, line",
    {
        "not JSON": ("load=1", "request: expected JSON"),
        "a list": ("[1]", "request: expected an object with preset and values"),
        "another preset": (
            json.dumps({"preset": "A\nB", "values": {}}),
            "preset: expected one of ZDDP film on steel, Gel under a bead, Rubber roller, got 'A\\nB'",
        ),
        "no values": (json.dumps({"preset": GEL, "values": {}}), "values: expected an object with load, radius"),
        "above": (request_of(ZDDP, load=0.2), "load: expected a number from 0.001 to 0.1, got 0.2"),
        "below": (request_of(ZDDP, load=-1), "load: expected a number from 0.001 to 0.1, got -1"),
        "no number": (request_of(GEL, softening=float("nan")), "softening: expected a number from 0.1 to 10, got nan"),
        "a truth": (request_of(GEL, softening=True), "softening: expected a number from 0.1 to 10, got True"),
        "long": (" " * 20_000, "Content-Length: expected at most 10000 bytes"),
    }.values(),
)  # fmt: skip
def test_a_wrong_request_is_answered_with_one_line(body, line):
    with served(lambda name, values: pytest.fail("it ran")) as server:
        status, text = asked(server, "POST", "/run", body)
    assert status == 400 and text.startswith(line) and text.count("\n") == 1


def test_an_error_of_the_solver_is_shown():
    with served(lambda name, values: 1 / 0) as server:
        assert asked(server, "POST", "/run", request_of(GEL)) == (
            500,
            "ZeroDivisionError: division by zero\n",
        )


def test_only_pages_of_this_machine_are_answered():
    """A page from elsewhere may send requests here, under a name of its own that leads to this machine."""
    with served(lambda name, values: {}) as server:
        assert asked(server, "GET", "/", Host="localhost:80")[0] == 200
        assert asked(server, "GET", "/../__init__.py")[0] == 404
        for host in ("example.org", "localhost.example.org", "", "[", "127.0.0.1@example.org"):
            assert asked(server, "GET", "/", Host=host)[0] == 403
        own, other = "http://127.0.0.1:80", "http://example.org"
        assert asked(server, "POST", "/run", request_of(GEL), Origin=own) == (200, "{}")
        assert asked(server, "POST", "/run", request_of(GEL), Origin=other)[0] == 403


def test_a_port_in_use_is_an_error_of_one_line(capsys):
    with served(solve) as server:
        assert main(["play", "--no-browser", "--port", str(server.server_port)]) == 2
    line = f"jaxcontact: error: --port: expected a free port, got {server.server_port}: .*\n"
    assert re.fullmatch(line, capsys.readouterr().err)
    with pytest.raises(SystemExit, match="2"):
        main(["play", "--port", "70000"])
    assert "expected a whole number from 0 to 65535, got '70000'" in capsys.readouterr().err


def test_the_film_is_what_the_sliders_say():
    """J starts at 1/G1, gains softening/G1 in the delay, and as much as at first in the time it flows."""
    values = PRESETS[ZDDP].values | {"stiffness": 2e9, "softening": 3.0, "delay": 10.0, "flow": 1e4}
    body, ball, load = contact(ZDDP, **values)
    film = body.layers[0].material
    np.testing.assert_allclose(film.creep(0.0) * 2e9, 1.0, rtol=1e-12)
    np.testing.assert_allclose(film.creep(10.0) * 2e9, 1.0 + 3.0 * (1.0 - np.exp(-1.0)) + 1e-3, rtol=1e-12)
    np.testing.assert_allclose(film.creep(1e4) * 2e9, 1.0 + 3.0 + 1.0, rtol=1e-12)
    assert (body.layers[0].thickness, ball.radius, load) == (150e-9, 1e-3, 10e-3)


DIRECT = {  # preset: indenter, film and substrate for stiffness G, and the load, as a user would write them
    ZDDP: (
        jc.Sphere(1e-3, STEEL),
        lambda G: jc.Layer(
            jc.Burgers(G1=G, G2=G / 4.0, eta1=G * 7200.0, eta2=G / 4.0 * 100.0, nu=0.3), 150e-9
        ),
        STEEL,
        10e-3,
    ),
    ROLLER: (
        jc.Cylinder(50e-3, 1.0, STEEL),
        lambda G: jc.Layer(jc.Burgers(G1=G, G2=G / 0.5, eta1=G * 3.6e5, eta2=G / 0.5 * 10.0, nu=0.49), 10e-3),
        STEEL,
        1e3,
    ),
}


@pytest.mark.long  # compiles the solver for a ball and for a roller, twice
@pytest.mark.parametrize("name", DIRECT)
def test_the_numbers_are_those_of_a_call(name):
    """On the page's grid: that around the contact with 48 cells across, or twice as fine across a roller."""
    stiffness = 1.5 * PRESETS[name].values["stiffness"]
    with served(solve) as server:
        status, text = asked(server, "POST", "/run", request_of(name, stiffness=stiffness))
    found = json.loads(text)
    indenter, film, substrate, load = DIRECT[name]
    body, control = jc.LayeredHalfSpace([film(stiffness)], substrate), jc.Load(load)
    grid = jc.Grid.around(body, indenter, control, TIMES, n=48)
    if name == ROLLER:
        grid = jc.Grid((96, 1), (grid.width[0] / 96, 1.0), periodic=(False, True))
    history = jc.indent(body, indenter, control, TIMES, grid=grid, substeps=2)
    assert status == 200 and found["failure"] == "" and found["notes"] == list(map(str, history.notes))
    middle = np.asarray(history.pressure)[:, :, grid.shape[1] // 2]
    np.testing.assert_allclose(found["pressure"], middle, atol=1e-6 * middle.max())
    np.testing.assert_allclose(found["approach"], history.approach, rtol=1e-6)
    np.testing.assert_allclose(found["contact_radius"], history.contact_radius, rtol=1e-6)
    np.testing.assert_allclose(found["strain"], np.max(history.film_strain), rtol=1e-6)
    assert found["times"] == TIMES.tolist()


@pytest.mark.slow  # compiles the solver for a ball and for a roller
@pytest.mark.parametrize("name", PRESETS)
def test_the_ends_of_the_sliders_have_a_result_that_carries_the_load(name):
    """And the film of each example creeps within the times that are shown."""
    for factors in ({}, {"load": 0.1, "radius": 0.1, "thickness": 10.0}, {"load": 10.0, "thickness": 0.3}):
        values = {key: value * factors.get(key, 1.0) for key, value in PRESETS[name].values.items()}
        found = solve(name, tuple(values.values()))
        assert found["failure"] == ""
        x, pressure = np.array(found["x"]), np.array(found["pressure"])
        around = 1.0 if name == ROLLER else np.pi * np.abs(x)  # half a ring on either side
        carried = np.sum(pressure * around, axis=1) * (x[1] - x[0])
        np.testing.assert_allclose(carried, values["load"], rtol=1e-6 if name == ROLLER else 2e-2)
        if not factors:
            assert found["approach"][-1] > 1.25 * found["approach"][0] and not found["notes"]


@pytest.mark.slow
@pytest.mark.skipif(NODE is None, reason="node is not installed")
def test_the_case_file_of_the_page_is_its_contact(tmp_path):
    """A run of the file that the page copies is a run of what the page shows."""
    source, page = ((PAGE / name).read_text().removesuffix("begin();\n") for name in ("solver.js", "page.js"))
    presets = {
        name: {"indenter": one.indenter, "nu": one.nu, "substrate": one.substrate}
        for name, one in PRESETS.items()
    }
    asked = {name: PRESETS[name].values | {"stiffness": 1.5e3} for name in PRESETS}
    answer = {"times": TIMES.tolist(), "x": np.linspace(-0.02, 0.02, 96).tolist()}
    script = f"""
        presets = {json.dumps(presets)};
        const texts = Object.entries({json.dumps(asked)}).map((one) => caseFile(...one, {json.dumps(answer)}));
        console.log(JSON.stringify(texts));
    """
    (tmp_path / "page.js").write_text("\n".join([source, page, script]))
    done = subprocess.run([NODE, tmp_path / "page.js"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    for name, text in zip(asked, json.loads(done.stdout), strict=True):
        (tmp_path / "mine.toml").write_text(text)
        case = read_case(tmp_path / "mine.toml")
        body, indenter, load = contact(name, **asked[name])
        found = jax.tree.leaves((case.body, case.indenter, case.control, case.times))
        np.testing.assert_allclose(
            np.concatenate([np.ravel(leaf) for leaf in found]),
            np.concatenate(
                [np.ravel(leaf) for leaf in jax.tree.leaves((body, indenter, jc.Load(load), TIMES))]
            ),
            rtol=1e-5,
        )
        if name == ROLLER:
            assert case.grid.shape == (96, 1) and case.grid.periodic == (False, True)


PROBE = (
    POINTS
    + """
const wait = (found) => new Promise((go) => {
  const look = () => (found() ? go() : setTimeout(look, 20));
  look();
});
(async () => {
  await wait(() => points(".curve"));
  const first = points(".curve"), slider = document.getElementById("load");
  slider.value = 0.3;
  slider.dispatchEvent(new Event("input"));
  await wait(() => points(".ghost"));
  parent.postMessage(JSON.stringify({
    moved: points(".curve") !== first, ghost: alike(points(".ghost"), first),
    labels: document.querySelectorAll("label").length, state: document.getElementById("state").textContent,
    charts: [...document.querySelectorAll("#charts svg")].filter((each) => each.getBoundingClientRect().height).length,
    above: document.getElementById("charts").getBoundingClientRect().bottom <= slider.getBoundingClientRect().top,
    stays: getComputedStyle(document.getElementById("results")).position === "sticky",
    wide: document.documentElement.scrollWidth - innerWidth, inner: innerWidth,
  }), "*");
})();
"""
)


def shown_at(width):
    """On a wide screen three charts beside the sliders, on a phone one above them that stays."""
    narrow = width < 800
    return {"charts": 1 if narrow else 3, "above": narrow, "stays": narrow}


HOST = """<!doctype html><body><script src="host.js"></script><iframe src="/" width="{width}" height="900" frameborder="0">
</iframe></body>"""
RECEIVE = 'addEventListener("message", (event) => { document.body.dataset.found = event.data; });'


@pytest.mark.slow  # starts a browser, and compiles the solver for a ball
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
@pytest.mark.parametrize("width", [1400, 400])
def test_the_page_works_in_a_browser(width, tmp_path):
    """A slider moves the curve, the former one stays in grey, and nothing is wider than the window."""
    flags = "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-sync --dump-dom"
    flags += " --virtual-time-budget=20000 --disable-background-networking --disable-component-update"
    with served(solve) as server:
        kind, page = server.files["/"]
        server.files["/"] = kind, page.replace(b"</body>", b'<script src="probe.js"></script></body>')
        server.files["/host"] = kind, HOST.format(width=width).encode()
        server.files["/probe.js"] = server.files["/page.js"][0], PROBE.encode()
        server.files["/host.js"] = server.files["/page.js"][0], RECEIVE.encode()
        server.runs.answer(ZDDP, PRESETS[ZDDP].values)
        address = f"http://127.0.0.1:{server.server_port}/host"  # a window of Chromium is not narrower than 500 pixels
        done = subprocess.run(
            [CHROMIUM, *flags.split(), f"--user-data-dir={tmp_path / 'data'}", "--window-size=1500,1000", address],
            capture_output=True, text=True, timeout=120,
        )  # fmt: skip
    found = json.loads(html.unescape(re.search(r'data-found="([^"]*)"', done.stdout)[1]))
    assert found.pop("inner") == width
    assert found.pop("wide") <= 0
    state = r"The film is compressed by (\d+) % of its thickness at most; film strain reaches 0\.(\d+), .* is inaccurate"
    told = re.fullmatch(state, found.pop("state"))
    assert told and told[1] == told[2]
    assert found == {"moved": True, "ghost": True, "labels": 8} | shown_at(width)


@pytest.mark.slow  # compiles the solver for a ball
def test_the_command_serves_runs_until_it_is_ended(tmp_path):
    command = [sys.executable, "-m", "jaxcontact", "play", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        port = int(re.search(r":(\d+)/", process.stdout.readline())[1])
        with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=120)) as connection:
            connection.request("POST", "/run", request_of(ZDDP))
            assert json.load(connection.getresponse())["failure"] == ""
        process.send_signal(signal.SIGTERM)
        assert process.stderr.read() == "jaxcontact: error: interrupted by SIGTERM\n"
    assert process.returncode == 143
