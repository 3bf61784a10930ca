"""The expansion of a response in exponentials of time."""
