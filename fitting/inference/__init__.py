"""Noise models, intervals, verdicts and results of fits."""
