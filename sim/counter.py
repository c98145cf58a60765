"""The virtual board's time: a 32-bit counter on a resonator that is a little off."""

from __future__ import annotations


class Counter:
    """Counts ticks of virtual time.

    Parameters
    ----------
    nominal_hz, ppm
        Nominal rate, and how far the true rate is off.
    start
        Count at virtual time 0; may be set anew, as a reset does.

    Attributes
    ----------
    hz
        The true rate.
    """

    def __init__(self, nominal_hz: int, ppm: float, start: int) -> None:
        self.hz = nominal_hz * (1 + ppm * 1e-6)
        self.start = start
        self._nhz = nominal_hz * 10**9 + round(nominal_hz * ppm * 1000)  # exact over years

    def tick_at(self, when_ns: int) -> int:
        """Read the counter (u32) at a moment."""
        return (self.start + when_ns * self._nhz // 10**18) % 2**32
