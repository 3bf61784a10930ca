"""The public functions of a simulation: indent, slide, shear, roll_steady, subsurface and their kin."""
