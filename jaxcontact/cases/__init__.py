"""The paper's figures and tables, recomputed and compared: one module each, run by ``reproduce``."""
