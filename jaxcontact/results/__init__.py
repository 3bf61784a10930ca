"""Results of simulations, their notes, summaries and figures."""
