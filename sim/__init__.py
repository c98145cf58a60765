"""Simulated rig: falling chains behind a virtual microcontroller, opened as ``sim://``."""
