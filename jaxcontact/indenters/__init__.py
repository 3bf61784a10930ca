"""Indenters, and an a priori estimate of their contact."""
