"""Text and figures of fits, and the files that they leave."""
