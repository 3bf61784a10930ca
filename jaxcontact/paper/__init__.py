"""The paper's figures and tables, recomputed and compared, run by the command ``reproduce``."""

REPRODUCTIONS = (  # the names only, since importing the modules takes a second
    "figure_4", "figure_6", "figure_9", "figure_10", "figure_11", "figure_12", "figure_13", "figure_14", "figure_15",
    "speed_map", "claims",
)  # fmt: skip
