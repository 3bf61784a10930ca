"""The command ``jaxcontact play``: a page in the browser, on which the solver follows sliders."""

import argparse
import threading
import time

from jaxcontact.commands.played_contacts import solve
from jaxcontact_play.opening import open_page
from jaxcontact_play.presets import PRESETS


def play(options: argparse.Namespace) -> int:
    """Serve the page until an interrupt; the first contact is prepared while the browser loads the page."""
    runs = open_page(options.port, options.browser).runs
    runs.start(solve)
    name, preset = next(iter(PRESETS.items()))
    threading.Thread(target=runs.answer, args=(name, preset.values), daemon=True).start()
    while True:
        time.sleep(3600.0)
