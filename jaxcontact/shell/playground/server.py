"""The command ``jaxcontact play`` and the server of its page: the files of the page, the presets, the stage of the solver,
and runs for the values of the sliders, one at a time."""

import argparse
import dataclasses
import functools
import json
import math
import os
import sys
import threading
import time
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, TypeAlias
from urllib.parse import urlsplit

import jax
import numpy as np

import jaxcontact as jc
from jaxcontact._compile.programs import Program

SPAN = 10.0
"""A slider goes from its default over this number to its default times this number."""

HOUR = 3600.0


@dataclass(frozen=True)
class Preset:
    """An example of the page: a body that is pressed onto a film on a substrate.

    indenter, film, substrate: their names on the page; nu: Poisson's ratio of the film; values: the default of each
    slider, by name. Of these stiffness is the shear modulus at first [Pa]; softening the growth of the compliance within
    the delay [s], as a share of the first; flow the time [s] in which it flows as much as its first strain; thickness
    and radius are in m; load in N, or N/m on a roller.
    """

    indenter: str
    film: str
    nu: float
    substrate: str
    values: dict[str, float]


PRESETS = {
    "ZDDP film on steel": Preset(
        "ball", "film", 0.3, "steel",
        {"load": 10e-3, "radius": 1e-3, "thickness": 150e-9, "stiffness": 2e9, "softening": 4.0, "delay": 100.0,
         "flow": 2.0 * HOUR},
    ),
    "Gel under a bead": Preset(
        "bead", "gel", 0.49, "glass",
        {"load": 1e-9, "radius": 25e-6, "thickness": 50e-6, "stiffness": 1e3, "softening": 1.0, "delay": 10.0,
         "flow": 10.0 * HOUR},
    ),
    "Rubber roller": Preset(
        "roller", "rubber", 0.49, "steel",
        {"load": 1e3, "radius": 50e-3, "thickness": 10e-3, "stiffness": 1e6, "softening": 0.5, "delay": 10.0,
         "flow": 100.0 * HOUR},
    ),
}  # fmt: skip


def checked(request: object) -> tuple[str, dict[str, float]]:
    """Return the preset and the values of a request; ValueError, in one line, if it is not one of the page's sliders."""
    if not isinstance(request, dict) or request.keys() != {"preset", "values"}:
        raise ValueError("request: expected an object with preset and values")
    name, values = request["preset"], request["values"]
    if not isinstance(name, str) or name not in PRESETS:
        raise ValueError(f"preset: expected one of {', '.join(PRESETS)}, got {str(name)[:40]!r}")
    defaults = PRESETS[name].values
    if not isinstance(values, dict) or values.keys() != defaults.keys():
        raise ValueError(f"values: expected an object with {', '.join(defaults)}")
    for key, default in defaults.items():
        value, low, high = values[key], default / SPAN, default * SPAN
        number = value if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan
        if not low * (1.0 - 1e-9) <= number <= high * (1.0 + 1e-9):
            raise ValueError(f"{key}: expected a number from {low:g} to {high:g}, got {str(value)[:40]}")
    return name, {key: float(values[key]) for key in defaults}


TIMES = np.append(0.0, [*np.outer([1.0, 10.0, 100.0, 1000.0], [1.0, 2.0, 3.0, 5.0]).ravel(), 1e4])
"""Times [s] under the load."""

STEEL = jc.Elastic.from_young(210e9, nu=0.3)
SUBSTRATES = {"steel": STEEL, "glass": jc.Elastic.from_young(70e9, nu=0.22)}


def solve(name: str, values: tuple[float, ...]) -> dict[str, Any]:
    """Return the results of a preset's contact in JSON's types and SI units, with its notes in words."""
    body, indenter, load = contact(name, **dict(zip(PRESETS[name].values, values, strict=True)))
    grid = jc.Grid.around(body, indenter, jc.Load(load), TIMES, n=48)
    if isinstance(indenter, jc.Cylinder):
        grid = jc.Grid((96, 1), (grid.width[0] / 96, 1.0), periodic=(False, True))
    history = _indented(*jax.tree.map(np.float64, (body, indenter, load)), grid)
    status = int(np.max(history.status))
    middle = history.grid.shape[1] // 2
    return {
        "times": TIMES.tolist(),
        "x": np.asarray(history.grid.axes()[0]).tolist(),
        "pressure": _finite(history.pressure[:, :, middle]),
        "approach": _finite(history.approach),
        "contact_radius": _finite(history.contact_radius),
        "strain": _finite(np.max(history.film_strain)),
        "failure": jc.Status(status).message if status else "",
        "notes": list(map(str, history.notes)),
    }


def contact(
    name: str,
    stiffness: float,
    softening: float,
    delay: float,
    flow: float,
    thickness: float,
    radius: float,
    load: float,
) -> tuple[jc.LayeredHalfSpace, Any, float]:
    """Return a preset's body, indenter and load, for values in SI units; the load of a roller is that on a metre.

    The film follows the Burgers model: its compliance grows by the share softening within the delay, and as much as at
    first in the time of flow.
    """
    preset = PRESETS[name]
    second = stiffness / softening
    film = jc.Burgers(G1=stiffness, G2=second, eta1=stiffness * flow, eta2=second * delay, nu=preset.nu)
    body = jc.LayeredHalfSpace([jc.Layer(film, thickness)], SUBSTRATES[preset.substrate])
    roller = preset.indenter == "roller"
    return body, jc.Cylinder(radius, 1.0, STEEL) if roller else jc.Sphere(radius, STEEL), load


# The first figure waits for the compiler; on grids as small as these a run takes a tenth of a second all the same.
@functools.partial(Program, optimised=False)
def _indented(body: jc.LayeredHalfSpace, indenter: Any, load: Any, grid: jc.Grid) -> jc.ContactHistory:
    return jc.indent(body, indenter, jc.Load(load), TIMES, grid=grid, substeps=2)


def _finite(values: Any) -> Any:
    """Return numbers as lists, with None for those that a failed run does not have."""
    array = np.asarray(values).astype(object)
    array[~np.isfinite(np.asarray(values))] = None
    return array.tolist()


PAGE = Path(__file__).parent / "page"
FILES = {
    "/": ("text/html; charset=utf-8", "explorer.html"),
    "/page.css": ("text/css; charset=utf-8", "page.css"),
    "/page.js": ("text/javascript; charset=utf-8", "page.js"),
    "/solver.js": ("text/javascript; charset=utf-8", "solver.js"),
}
TABLE = b'<script src="numbers.js"></script>\n<script src="table.js"></script>'
SOLVER = b'<script src="solver.js"></script>'
"""The sources of the page's numbers: that of explorer.html, opened as a file, and that of this server."""

LOCAL = ("127.0.0.1", "localhost", "::1")
LARGEST = 10_000
"""Bytes of a request."""

Answer: TypeAlias = dict[str, Any]  # in JSON's types
Solver: TypeAlias = Callable[[str, tuple[float, ...]], Answer]  # from a preset and its values in their order


class Runs:
    """Runs of a solver, one at a time.

    stage: what a request waits for, "compiling" or "computing".
    """

    def __init__(self, solver: Solver) -> None:
        self.stage = "compiling"
        self._solver = functools.lru_cache(solver)
        self._one_at_a_time = threading.Lock()
        self._compiled: set[str] = set()

    def answer(self, name: str, values: dict[str, float]) -> Answer:
        """Return the solver's answer for values of a preset; it may raise ValueError."""
        indenter = PRESETS[name].indenter
        with self._one_at_a_time:
            self.stage = "computing" if indenter in self._compiled else "compiling"
            answer = self._solver(name, tuple(values.values()))
            self._compiled.add(indenter)
        return answer


class PageServer(ThreadingHTTPServer):
    """A server of the page for this machine alone, on a port, or on a free one if it is 0, with a solver."""

    daemon_threads = True
    allow_reuse_address = os.name == "posix"  # elsewhere this lets two servers share a port

    def __init__(self, port: int, solver: Solver):
        self.runs = Runs(solver)
        read = {path: (kind, (PAGE / name).read_bytes()) for path, (kind, name) in FILES.items()}
        self.files = {path: (kind, content.replace(TABLE, SOLVER)) for path, (kind, content) in read.items()}
        super().__init__(("127.0.0.1", port), _Handler)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing about a browser that no longer waits for its answer."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    server: PageServer
    protocol_version = "HTTP/1.1"
    wbufsize = -1  # headers and body in one packet: the browser would acknowledge the first one 40 ms later

    def do_GET(self) -> None:
        if not self._is_local():
            self._send_line(HTTPStatus.FORBIDDEN, "Host: expected a name of this machine")
        elif self.path in self.server.files:
            self._send(HTTPStatus.OK, *self.server.files[self.path])
        elif self.path == "/presets.json":
            presets = {name: dataclasses.asdict(preset) for name, preset in PRESETS.items()}
            self._send_json({"span": SPAN, "presets": presets})
        elif self.path == "/stage":
            self._send_json({"stage": self.server.runs.stage})
        else:
            self._send_line(HTTPStatus.NOT_FOUND, "there is no such page")

    def do_POST(self) -> None:
        if not self._is_local():
            self._send_line(HTTPStatus.FORBIDDEN, "Host, Origin: expected names of this machine")
            return
        if self.path != "/run":
            self._send_line(HTTPStatus.NOT_FOUND, "there is no such page")
            return
        try:
            length = self.headers.get("Content-Length", "")
            if not length.isdecimal() or int(length) > LARGEST:
                raise ValueError(f"Content-Length: expected at most {LARGEST} bytes of JSON")
            try:
                request = json.loads(self.rfile.read(int(length)))
            except (ValueError, RecursionError) as error:
                raise ValueError("request: expected JSON") from error
            answer = self.server.runs.answer(*checked(request))
        except ValueError as error:
            self._send_line(HTTPStatus.BAD_REQUEST, str(error))
        except Exception as error:  # the page shows it, whatever it is
            self._send_line(HTTPStatus.INTERNAL_SERVER_ERROR, f"{type(error).__name__}: {error}")
        else:
            self._send_json(answer)

    def _is_local(self) -> bool:
        """Return whether the browser asked for this machine by name, and for no page of another one."""
        asked = [f"//{self.headers.get('Host', '')}", self.headers.get("Origin", "//localhost")]
        try:
            return all(urlsplit(address).hostname in LOCAL for address in asked)
        except ValueError:  # brackets that are not an address
            return False

    def _send_json(self, content: Any) -> None:
        self._send(HTTPStatus.OK, "application/json", json.dumps(content, allow_nan=False).encode())

    def _send_line(self, status: HTTPStatus, line: str) -> None:
        self.close_connection = True  # what else was sent is not read
        self._send(status, "text/plain; charset=utf-8", (" ".join(line.split()) + "\n").encode())

    def _send(self, status: HTTPStatus, kind: str, content: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", "default-src 'self'; img-src data:")
        self.send_header("X-Content-Type-Options", "nosniff")
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: Any) -> None:
        """Write no line for each request."""


def play(options: argparse.Namespace) -> int:
    """Serve the page until an interrupt; the first contact is prepared while the browser loads the page.

    Raises ValueError if the port cannot be used.
    """
    # Before scipy is loaded, whose BLAS solves the small systems of a run: its threads wait for one another in a busy
    # loop, which takes up to a second of processor time per move where other programs use the processor as well.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        server = PageServer(options.port, solve)
    except OSError as error:
        raise ValueError(f"--port: expected a free port, got {options.port}: {error.strerror}") from error
    _in_background(server.serve_forever)
    address = f"http://127.0.0.1:{server.server_port}/"
    print(f"{address} (Ctrl-C ends it)", flush=True)
    if options.browser:  # a browser in a terminal would keep this thread
        _in_background(webbrowser.open, address)
    name, preset = next(iter(PRESETS.items()))
    _in_background(server.runs.answer, name, preset.values)
    while True:
        time.sleep(3600.0)


def _in_background(function: Callable[..., Any], *arguments: Any) -> None:
    threading.Thread(target=function, args=arguments, daemon=True).start()
