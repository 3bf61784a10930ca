"""Frequency response functions: displacement of the surface per pressure, wavenumber by wavenumber."""
