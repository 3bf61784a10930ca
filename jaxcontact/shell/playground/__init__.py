"""The command ``jaxcontact play``: its options here, its contacts, and the server of its page."""

import argparse


def port_number(text: str) -> int:
    """Return a port from its text; 0 lets the system choose one."""
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"expected a whole number from 0 to 65535, got {text!r}")
    return int(text)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command to a parser."""
    parser.add_argument(
        "--port", type=port_number, default=0, metavar="N", help="port of the page; by default a free one"
    )
    parser.add_argument(
        "--no-browser", dest="browser", action="store_false", help="print the address and open no browser"
    )
