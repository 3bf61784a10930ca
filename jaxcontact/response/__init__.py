"""Response functions: displacement of the surface per pressure, by wavenumber and time."""
