"""Benchmarks: accuracy against hidden truth, and speed as ratios."""
