"""From a file of an instrument to columns in SI units, step by step, one module for each step."""
