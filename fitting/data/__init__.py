"""Measured curves in SI units, and the detection of contact and loading in them."""
