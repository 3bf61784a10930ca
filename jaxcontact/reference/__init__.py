"""Closed forms and one-dimensional spectral solutions: independent references that share no code with the solver."""
