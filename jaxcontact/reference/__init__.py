"""Closed forms and one-dimensional spectral solutions: oracles that share no code with the solver."""
