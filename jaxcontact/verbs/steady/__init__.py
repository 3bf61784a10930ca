"""Operators of steady motion: the deformation that a moving contact leaves behind it."""
