"""Influence coefficients: the displacement of one cell under a uniform traction on another one, in closed form."""
