"""Forward models: from a material to the measured curve."""
