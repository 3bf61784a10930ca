"""The memory of a body that moves past the indenter, and the steady state of sliding."""
