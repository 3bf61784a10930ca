"""The version, where the package and its files can both have it."""

__version__ = "0.1.0"
