"""Operators: traction on the cells of a grid -> displacement of their centres."""
