"""Dials of the simulated rig at twice their default, as a port's URL takes them."""

from __future__ import annotations

from urllib.parse import quote

DOUBLED = {
    "skew_sd": "4 ms",
    "delay_sd": "2 ms",
    "hang_sd": "0.2 mm",
    "drop_error": "1",
    "rod_sd": "0.6 mm",
    "width_sd": "0.2 mm",
    "gate_sd": "0.4 mm",
    "beam_sd": "1 mm",
    "impulse_sd": "0.04",
    "jitter_sd": "4 us",
    "missed": "2 %",
    "chatter": "1 %",
    "string": "0.4 %",
    "bounce": "10 %",
    "clock": "-2600 ppm",
    "latency": "0.6 ms",
}

STACK = ("clock", "latency")
"""Dials that only show where a board and a line stand between the chains and the analysis."""


def doubled(url: str, dial: str) -> str:
    """Set one dial in a port's URL."""
    return with_setting(url, dial, DOUBLED[dial])


def with_setting(url: str, name: str, value: str) -> str:
    """Add a setting to a port's URL."""
    return f"{url}{'&' if '?' in url else '?'}{name}={quote(value)}"
