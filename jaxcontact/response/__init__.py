"""Response functions: surface displacement per unit pressure, as a function of wavenumber and time."""
