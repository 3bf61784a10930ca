"""Frictionless contact: an operator p -> u and a gap in, a pressure out."""
