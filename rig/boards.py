"""What timers can do: every board that the firmware runs on, and what the wire can carry to any.

A board that is there says the same of itself (`rig.link.messages.Identity`), and then that counts.
"""

from typing import NamedTuple

GATES = 16
"""Gate inputs that the wire has bits for."""
RELEASES = 8
"""Release outputs that the wire has bits for."""
LONGEST_RECORD_MS = 0xFFFF
"""The longest recording that the wire can ask for."""


class Capabilities(NamedTuple):
    """What one kind of board can do.

    Attributes
    ----------
    name
        What its firmware calls it.
    gates, releases
        How many inputs and outputs it has.
    longest_pulse
        For which it drives a release, s.
    events
        Edges that it can keep.
    streams
        Whether it keeps the latest ones only, so that a drop may have any number of them.
    """

    name: str
    gates: int
    releases: int
    longest_pulse: float
    events: int
    streams: bool

    @property
    def most_edges(self) -> float:
        """How many edges a drop may have."""
        return float("inf") if self.streams else self.events

    @property
    def one(self) -> str:
        """Its name with an article."""
        return f"{'an' if self.name[0] in 'AEIOU' else 'a'} {self.name}"


MEGA = Capabilities("Arduino Mega 2560", 16, 2, 0.5, 1024, streams=False)
UNO = Capabilities("Arduino Uno", 12, 2, 0.5, 191, streams=True)
PICO = Capabilities("Raspberry Pi Pico", 16, 2, 0.5, 16384, streams=False)
BOARDS = {"pico": PICO, "mega": MEGA, "uno": UNO}
"""By the word for them at the command line."""
