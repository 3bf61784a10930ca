"""Conversion of an instrument's file to columns in SI units, one module for each step."""
