"""What the body remembers, and the march in time."""
