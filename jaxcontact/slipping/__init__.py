"""Contact with friction: tractions in all directions, in time."""
