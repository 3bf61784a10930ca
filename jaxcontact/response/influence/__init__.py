"""Influence coefficients: the displacement of one cell due to a uniform traction on another, in closed form."""
