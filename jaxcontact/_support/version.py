"""The version, defined in a module that both the package and its modules can import."""

__version__ = "0.2.0"
