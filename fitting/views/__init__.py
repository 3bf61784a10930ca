"""Text and figures of fits, and their output files."""
