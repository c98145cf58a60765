"""What the gates did lately: edges counted, flicker and steadiness, and which one a hand blocks."""

from __future__ import annotations

from dataclasses import dataclass, replace

STEADY_S = 1.0
"""A gate that changed within this time is not steady."""
FLICKER_S = 2.0
FLICKERS = 4
"""That many changes within `FLICKER_S` are flicker: a loose beam, not a hand."""


@dataclass(frozen=True, slots=True)
class Indicator:
    """One gate: its state, its edges so far, and when the latest of them were seen."""

    channel: int
    blocked: bool = False
    edges: int = 0
    recent_s: tuple[float, ...] = ()

    def steady(self, now_s: float) -> bool:
        """Whether it has been quiet for `STEADY_S`."""
        return not self.recent_s or now_s - self.recent_s[-1] >= STEADY_S

    def struck(self, count: int, now_s: float) -> Indicator:
        """Count so many edges."""
        recent = (*self.recent_s, *(now_s,) * count)[-FLICKERS:]
        return replace(self, edges=self.edges + count, recent_s=recent)

    def flickers(self, now_s: float) -> bool:
        """Whether it changes too often for a hand or a chain at rest."""
        return sum(now_s - at <= FLICKER_S for at in self.recent_s) >= FLICKERS


@dataclass(frozen=True, slots=True)
class Indicators:
    """All gates of the scene.

    Attributes
    ----------
    checked
        Channels that were seen blocked alone and clear again: the gate check.
    """

    gates: tuple[Indicator, ...] = ()
    checked: frozenset[int] = frozenset()
    known: bool = False

    @classmethod
    def of(cls, channels: tuple[int, ...]) -> Indicators:
        """Begin with gates that nobody has looked at."""
        return cls(tuple(Indicator(channel) for channel in channels))

    @property
    def blocked(self) -> tuple[int, ...]:
        """Channels that are blocked."""
        return tuple(gate.channel for gate in self.gates if gate.blocked)

    @property
    def alone(self) -> int | None:
        """The one channel that is blocked now; `None` for none or several."""
        return self.blocked[0] if len(self.blocked) == 1 and self.known else None

    def restless(self, now_s: float) -> tuple[int, ...]:
        """Channels that are not steady."""
        return tuple(gate.channel for gate in self.gates if not gate.steady(now_s))

    def seen(self, mask: int | None, now_s: float) -> Indicators:
        """Look at the gates' mask; `None` means that nobody knows."""
        if mask is None:
            return replace(self, known=False)
        gates = tuple(
            replace(gate, blocked=dark).struck(int(self.known and dark != gate.blocked), now_s)
            for gate in self.gates
            for dark in [bool(mask >> gate.channel & 1)]
        )
        looked = Indicators(gates, self.checked, known=True)
        if self.alone is None or looked.blocked:
            return looked
        return replace(looked, checked=self.checked | {self.alone})

    def counted(self, channels: tuple[int, ...], now_s: float) -> Indicators:
        """Count edges of a drop, one entry of `channels` an edge."""
        gates = (gate.struck(channels.count(gate.channel), now_s) for gate in self.gates)
        return replace(self, gates=tuple(gates))

    def reset(self) -> Indicators:
        """Count from zero and begin the gate check again."""
        return Indicators.of(tuple(gate.channel for gate in self.gates))
