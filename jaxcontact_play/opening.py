"""The opening of the page: its server starts, and a browser is sent there."""

import argparse
import contextlib
import functools
import threading
import webbrowser

from jaxcontact_play.options import add_options
from jaxcontact_play.server import PageServer


@functools.cache
def open_page(port: int, browser: bool) -> PageServer:
    """Start to serve the page on a port, print its address, and return the server; once in a process.

    Raises ValueError if the port cannot be used.
    """
    try:
        server = PageServer(port)
    except OSError as error:
        raise ValueError(f"--port: expected a free port, got {port}: {error.strerror}") from error
    address = f"http://127.0.0.1:{server.server_port}/"
    threading.Thread(target=server.serve_forever, daemon=True).start()
    print(f"{address} (Ctrl-C ends it)", flush=True)
    if browser:  # a browser in a terminal would keep this thread
        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
    return server


def open_early(arguments: list[str]) -> None:
    """Open the page, unless there is a mistake in the arguments or in the port, which the command itself reports."""
    parser = argparse.ArgumentParser(add_help=False, exit_on_error=False)
    add_options(parser)
    with contextlib.suppress(argparse.ArgumentError, ValueError):
        options, others = parser.parse_known_args(arguments)
        if not others:
            open_page(options.port, options.browser)
