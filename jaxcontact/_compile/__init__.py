"""Compiled programs: caches on disk for compiled programs and exported traces, and checks of the installed jax."""
