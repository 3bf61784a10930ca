"""The inputs of a simulation: materials, layers, controls, grids and rough surfaces."""
