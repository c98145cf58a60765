"""Mechanics of a falling chain: pure functions of plain data."""
