"""Uses of a finished fit: posteriors, propagation of its uncertainty and design of tests."""
