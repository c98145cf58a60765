"""Calibrated time: clock samples, the board's rate and its course, and seconds from ticks."""
