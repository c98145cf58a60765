"""Studies: error against run time, extremes, and what scenes cost."""
