"""What happened to sessions that were disturbed, counted."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from bench.invariants import broken, longest_on

if TYPE_CHECKING:
    from bench.process_fixture import ProcessFixture, Seen


@dataclass(slots=True)
class FaultTally:
    """What happened.

    Attributes
    ----------
    disturbed
        How often.
    fell_upon
        How often upon each of `bench.moments.STATES`.
    sessions, runs, drops
        Finished, done, and recorded (an attempt more for each that was spoiled).
    frames, bad_frames
        Received by the host, and those of them that the line had garbled.
    longest_on_s, off_after_s
        The longest time the release was on for certain; the longest after a disturbance that
        something was armed or on for certain.
    memory_bytes
        By how much a daemon grew while somebody did not read what it sent.
    broken
        Promises that were not kept, see `bench.invariants.broken`.
    """

    disturbed: int = 0
    fell_upon: Counter[str] = field(default_factory=Counter)
    sessions: int = 0
    runs: int = 0
    drops: int = 0
    frames: int = 0
    bad_frames: int = 0
    longest_on_s: float = 0.0
    off_after_s: float = 0.0
    memory_bytes: int = 0
    broken: list[str] = field(default_factory=list)

    def add(self, other: FaultTally) -> None:
        """Take another tally's counts."""
        for name in ("disturbed", "sessions", "runs", "drops", "frames", "bad_frames"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        for name in ("longest_on_s", "off_after_s", "memory_bytes"):
            setattr(self, name, max(getattr(self, name), getattr(other, name)))
        self.fell_upon += other.fell_upon
        self.broken += other.broken

    def add_session(self, processes: ProcessFixture) -> list[Seen]:
        """Count a finished session and every promise not kept in it; return the board's log."""
        happened = list(processes.happened())
        self.broken += broken(processes.session, happened, processes.runs)
        self.longest_on_s = max(self.longest_on_s, longest_on(happened))
        self.sessions += 1
        self.runs += processes.runs
        self.drops += len({seen["drop"]["label"] for seen in happened if "drop" in seen})
        return happened

    def json(self) -> dict[str, Any]:
        """Counts by name."""
        return {name: getattr(self, name) for name in self.__slots__} | {
            "fell_upon": dict(self.fell_upon)
        }
