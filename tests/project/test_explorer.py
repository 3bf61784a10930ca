"""The page explorer.html: what it interpolates is what direct runs give, and it works in a browser."""

import base64
import json
import re
import shutil
import subprocess
from pathlib import Path

import jax
import numpy as np
import pytest
from page_probe import POINTS

import jaxcontact as jc

PAGE = Path(jc.__file__).parent / "shell" / "playground" / "page"
TABLE = json.loads(re.search(r"const TABLE = (.*);\n", (PAGE / "numbers.js").read_text())[1])
LIMITS = {name: (low, high) for name, (low, high, _) in TABLE["axes"].items()}
SLIDERS = {  # as in table.js
    "load": (1e-3, 0.1),
    "radius": (2e-4, 2e-3),
    "thickness": (2e-6, 2e-5),
    "stiffness": (1e8, 1e10),
    "softening": (0.1, 10.0),
    "delay": (10.0, 1e3),
    "flow": (1e3, 1e6),
}
TIMES = np.append(0.0, np.geomspace(0.5, 1e4, 80))
SHOWN = [0, 10, 30, 50, 60, 70, 80]
AT = 0.7  # where pressures are compared, in contact radii from the axis
NODE = shutil.which("node")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def experiments(count, seed):
    """Return random positions of the sliders."""
    random = np.random.default_rng(seed)
    one = lambda: {name: float(np.exp(random.uniform(*np.log(limits)))) for name, limits in SLIDERS.items()}
    return [one() for _ in range(count)]


def cubic(position, size):
    """Return the first of four nodes and their weights, from the conditions on powers."""
    first = min(max(int(np.floor(position)) - 1, 0), size - 4)
    powers = np.arange(4.0)[None, :] ** np.arange(4)[:, None]
    return first, np.linalg.solve(powers, (position - first) ** np.arange(4.0))


def unpacked(packed, kind):
    whole = np.frombuffer(base64.b64decode(packed["values"]), kind).astype(float)
    return packed["low"] + (packed["high"] - packed["low"]) * whole / np.iinfo(kind).max


def between(point, axes, values):
    """Return values at the nodes of time, between the cases of a table."""
    values = values.reshape(*(size for _, _, size in axes.values()), -1)
    for value, (low, high, size) in zip(point, axes.values(), strict=True):
        first, weights = cubic(np.log(value / low) / np.log(high / low) * (size - 1), size)
        values = np.tensordot(weights, values[first : first + 4], 1)
    return values


def in_time(positions, values):
    places = [cubic(position, values.size) for position in positions]
    return np.array([weights @ values[first : first + 4] for first, weights in places])


def read(inputs, times):
    """Return the results of the table over times, by a second reading that shares no code with the page.

    They are approach, contact radius, and the pressure in the middle and at the share AT of the radius.
    """
    load, radius, h, G, s, delay, flow = (inputs[name] for name in SLIDERS)
    point = (load * radius / (G * h**3), s, flow / delay, G / TABLE["steel"])
    compliance = 1.0 + s * (1.0 - np.exp(-times / delay)) + times / flow
    where = np.log(compliance) / np.log(1.0 + s + TABLE["flown"]) * (TABLE["nodes"] - 1)
    approach, a = (
        unit
        * np.exp(in_time(where, between(point, TABLE["axes"], unpacked(TABLE["quantities"][name], "<u2"))))
        for name, unit in (("approach", h**2 / radius), ("contact_radius", h))
    )
    low, high, size = TABLE["shape"]["times"]
    when = np.log(np.clip(times / delay, low, high) / low) / np.log(high / low) * (size - 1)
    shape = [unpacked(packed, "u1") for packed in TABLE["shape"]["values"]]
    g = [in_time(when, between(point, TABLE["shape"]["axes"], values)) for values in shape]
    polynomials = np.linalg.solve((np.arange(4.0)[:, None] / 3.0) ** np.arange(4), g)
    pressures = [
        load / (np.pi * a**2) * np.sqrt(1.0 - share**2) * (share ** (2 * np.arange(4)) @ polynomials)
        for share in (0.0, AT)
    ]
    return np.array([approach, a, *pressures])


def from_the_page(script, folder):
    """Return what a script prints as JSON after the page's table and interpolation."""
    files = [(PAGE / name).read_text() for name in ("numbers.js", "table.js")]
    (folder / "page.js").write_text("\n".join([*files, script]))
    done = subprocess.run([NODE, folder / "page.js"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@jax.jit
def run(body, ball, load, grid):
    history = jc.indent(body, ball, jc.Load(load), TIMES, grid=grid, substeps=2)
    middle = history.pressure[:, :, grid.shape[1] // 2]
    return history.approach, history.contact_radius, middle, history.status


def direct(inputs):
    """Return the same results of a run on a finer grid with other steps, at the times that are shown."""
    load, radius, h, G, s, delay, flow = (inputs[name] for name in SLIDERS)
    steel = jc.Elastic.from_young(210e9, nu=0.3)
    film = jc.Burgers(G1=G, G2=G / s, eta1=G * flow, eta2=G / s * delay, nu=0.4)
    body, ball = jc.LayeredHalfSpace([jc.Layer(film, h)], substrate=steel), jc.Sphere(radius, material=steel)
    grid = jc.Grid.around(body, ball, jc.Load(load), TIMES, n=95)
    *results, status = run(*jax.tree.map(np.float64, (body, ball, load)), grid)
    assert not np.any(status)
    approach, a, middle = (np.asarray(values)[SHOWN] for values in results)
    pressures = [
        [np.interp(share * r, grid.axes()[0], p) for r, p in zip(a, middle, strict=True)]
        for share in (0.0, AT)
    ]
    return np.array([approach, a, *pressures])


@pytest.mark.long
def test_the_table_agrees_with_direct_runs_within_a_hundredth():
    """The pressure within a twentieth of the largest."""
    corners = [dict(zip(SLIDERS, values, strict=True)) for values in zip(*SLIDERS.values(), strict=True)]
    for inputs in [*experiments(10, seed=1), *corners]:
        found, expected = read(inputs, TIMES[SHOWN]), direct(inputs)
        np.testing.assert_allclose(found[:2], expected[:2], rtol=1e-2, err_msg=str(inputs))
        largest = np.max(expected[2:], axis=0)
        np.testing.assert_allclose(
            found[2:] / largest, expected[2:] / largest, atol=5e-2, err_msg=str(inputs)
        )


def test_no_position_of_the_sliders_is_outside_the_table():
    ends = {name: np.array(limits) for name, limits in SLIDERS.items()}
    load = ends["load"] * ends["radius"] / (ends["stiffness"] * ends["thickness"] ** 3)[::-1]
    found = {
        "load": load,
        "softening": ends["softening"],
        "flow": ends["flow"] / ends["delay"][::-1],
        "stiffness": ends["stiffness"] / TABLE["steel"],
    }
    for name, limits in LIMITS.items():
        np.testing.assert_allclose(found[name], limits, rtol=1e-9, err_msg=name)
    shown = (PAGE / "table.js").read_text()
    for name, limits in SLIDERS.items():
        low, high = re.search(rf"  {name}: \[(\S+), (\S+)\],", shown).groups()
        assert (float(low), float(high)) == limits, name


@pytest.mark.skipif(NODE is None, reason="node is not installed")
def test_the_page_reads_the_table_as_python_does(tmp_path):
    inputs = experiments(5, seed=2)
    script = f"""
        const times = {json.dumps(TIMES[SHOWN].tolist())}, names = ["approach", "contact_radius"];
        const all = {json.dumps(inputs)}.map((inputs) => {{
          const result = experiment(inputs);
          const pressure = (share) => times.map((t) => result(t).pressure(share * result(t).contact_radius));
          return [...names.map((name) => times.map((t) => result(t)[name])), pressure(0), pressure({AT})];
        }});
        console.log(JSON.stringify(all));
    """
    found = np.array(from_the_page(script, tmp_path))
    np.testing.assert_allclose(found, [read(one, TIMES[SHOWN]) for one in inputs], rtol=1e-9)


PROBE = (
    "<script>"
    + POINTS
    + """
const wait = (found) => new Promise((go) => {
  const look = () => (found() ? go() : setTimeout(look, 20));
  look();
});
(async () => {
  await wait(() => points(".curve"));
  const slider = document.getElementById("load"), first = points(".curve");
  slider.value = Number(slider.value) + 0.5;
  slider.dispatchEvent(new Event("input"));
  await wait(() => points(".ghost"));
  parent.postMessage(JSON.stringify({
    moved: points(".curve") !== first, ghost: alike(points(".ghost"), first),
    labels: document.querySelectorAll("label").length,
    wide: document.documentElement.scrollWidth - innerWidth, inner: innerWidth,
  }), "*");
})();
</script></body>
"""
)
HOST = """<!doctype html><body>
<script>addEventListener("message", (event) => {{ document.body.dataset.found = event.data; }});</script>
<iframe src="page/explorer.html" style="border: 0; height: 900px; width: {width}px"></iframe></body>
"""


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
@pytest.mark.parametrize("width", [1400, 400])
def test_the_page_works_in_a_browser(width, tmp_path):
    """A slider moves the curve, the former one stays in grey, and nothing is wider than the window."""
    shutil.copytree(PAGE, tmp_path / "page")
    page = tmp_path / "page" / "explorer.html"
    page.write_text(page.read_text().replace("</body>", PROBE))
    host = tmp_path / "host.html"  # a window of Chromium is not narrower than 500 pixels
    host.write_text(HOST.format(width=width))
    flags = "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-sync --dump-dom"
    flags += " --virtual-time-budget=5000 --disable-background-networking --disable-component-update"
    done = subprocess.run(
        [CHROMIUM, *flags.split(), f"--user-data-dir={tmp_path / 'data'}", "--window-size=1500,1000", host.as_uri()],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    found = json.loads(re.search(r'data-found="([^"]*)"', done.stdout)[1].replace("&quot;", '"'))
    assert found.pop("inner") == width
    assert found.pop("wide") <= 0
    assert found == {"moved": True, "ghost": True, "labels": 8}


def test_the_table_is_small():
    assert Path(PAGE / "table.js").stat().st_size < 300_000
