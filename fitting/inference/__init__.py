"""Noise, intervals, verdicts and results of a fit."""
