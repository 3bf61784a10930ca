"""The fits themselves, one module for each kind of data."""
