"""Fit functions, one module for each kind of data."""
