"""Compiled programs: their options, their cache on disk, and checks of the installed jax."""
