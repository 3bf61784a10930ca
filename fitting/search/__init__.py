"""Searches for the optimum of a fit."""
