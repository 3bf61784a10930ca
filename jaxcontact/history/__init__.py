"""Memory of the body and the march in time."""
