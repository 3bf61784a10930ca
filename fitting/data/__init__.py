"""Measured curves in SI units, and where contact and loading begin in them."""
