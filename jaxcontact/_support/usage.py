"""The parser of the command line, which reports wrong usage in one line."""

import argparse
from typing import NoReturn

BAD_USAGE = 2


class Parser(argparse.ArgumentParser):
    """A parser that ends a wrong call with one line, without the list of all options."""

    def error(self, message: str) -> NoReturn:
        """Print the message and the command that explains the options, and exit with status 2."""
        self.exit(BAD_USAGE, f"{self.prog}: error: {message}; {self.prog} --help explains the options\n")
