"""The command ``jaxcontact play``: a page in the browser, on which the solver follows sliders."""

import argparse
import os
import threading
import time
import webbrowser
from collections.abc import Callable
from typing import Any

from jaxcontact.shell.playground.contacts import PRESETS, solve
from jaxcontact.shell.playground.server import PageServer


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
