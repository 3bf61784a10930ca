"""Compiled programs: their options and release, their cache on disk, and checks of the installed jax."""
