"""Compiled programs: their store on disk, traces kept between processes, and the installed version of jax."""
