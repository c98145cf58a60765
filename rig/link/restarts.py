"""A restart of the board that nobody asked for: when it was, why, and what to look at."""

from __future__ import annotations

from dataclasses import dataclass

_CAUSES = {1: "power", 2: "reset pin", 4: "brown-out", 8: "watchdog"}


@dataclass(frozen=True, slots=True)
class Restart:
    """A restart that the opening of the port does not explain.

    Attributes
    ----------
    host_ns
        When the board was back.
    cause
        As BOOT has it.
    label
        Of the drop that was recorded; `None` when nothing fell.
    back_s
        How long after FIRE it was back, s; 0 when nothing fell.
    start_up_s
        From a reset to BOOT, boot loader and all, as seen when the port was opened, s; `None` when
        that was not seen.
    """

    host_ns: int
    cause: int
    label: int | None = None
    back_s: float = 0.0
    start_up_s: float | None = None

    @property
    def when(self) -> str:
        """When it was, by what is known of the drop and of the board's boot loader."""
        if self.label is None:
            return "while nothing fell"
        if self.start_up_s is None or self.back_s < self.start_up_s:
            return f"within {self.back_s * 1e3:.0f} ms of FIRE"
        return f"about {(self.back_s - self.start_up_s) * 1e3:.0f} ms after FIRE"


def causes(mask: int) -> str:
    """Name the causes in a mask as BOOT has it; empty where a boot loader has cleared it."""
    return ", ".join(word for bit, word in _CAUSES.items() if mask & bit)
