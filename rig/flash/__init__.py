"""Putting the firmware onto a board, and asking the board whether it is there."""
