"""Disturbances of the simulated rig at twice their default."""

from __future__ import annotations

DOUBLED = {
    "skew_sd": "4 ms", "delay_sd": "2 ms", "hang_sd": "0.2 mm", "drop_error": "1",
    "rod_sd": "0.6 mm", "width_sd": "0.2 mm", "gate_sd": "0.4 mm", "datum_sd": "0.4 mm",
    "beam_sd": "1 mm", "impulse_sd": "0.04", "jitter_sd": "4 us", "missed": "2 %",
    "chatter": "1 %", "string": "0.4 %", "bounce": "10 %", "clock": "-2600 ppm",
    "latency": "0.6 ms",
}  # fmt: skip
"""Dials of the simulated rig at twice their default, as a port's URL takes them."""
STACK = ("clock", "latency")
"""Dials that only show where a board and a line stand between the chains and the analysis."""
