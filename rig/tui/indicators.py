"""Recent activity of the gates: edge counts, flicker, steadiness, and a gate blocked by hand."""

from __future__ import annotations

from dataclasses import dataclass, replace

STEADY_S = 1.0
"""Time without changes after which a gate is steady, s."""
FLICKER_S = 2.0
FLICKERS = 4
"""Number of changes within `FLICKER_S` that count as flicker: a loose beam, not a hand."""


@dataclass(frozen=True, slots=True)
class Indicator:
    """A gate: its state, its number of edges, and the times of the latest."""

    channel: int
    blocked: bool = False
    edges: int = 0
    recent_s: tuple[float, ...] = ()

    def steady(self, now_s: float) -> bool:
        """Whether the gate has not changed for `STEADY_S`."""
        return not self.recent_s or now_s - self.recent_s[-1] >= STEADY_S

    def struck(self, count: int, now_s: float) -> Indicator:
        """Return the gate with `count` more edges."""
        recent = (*self.recent_s, *(now_s,) * count)[-FLICKERS:]
        return replace(self, edges=self.edges + count, recent_s=recent)

    def flickers(self, now_s: float) -> bool:
        """Whether the gate changes too often for a hand or a chain at rest."""
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
        """Return unchecked gates of unknown state."""
        return cls(tuple(map(Indicator, channels)))

    @property
    def blocked_channels(self) -> tuple[int, ...]:
        """Channels that are blocked."""
        return tuple(gate.channel for gate in self.gates if gate.blocked)

    @property
    def alone(self) -> int | None:
        """The only blocked channel; `None` for none or several."""
        return self.blocked_channels[0] if len(self.blocked_channels) == 1 and self.known else None

    def restless(self, now_s: float) -> tuple[int, ...]:
        """Return the channels that are not steady."""
        return tuple(gate.channel for gate in self.gates if not gate.steady(now_s))

    def seen(self, mask: int | None, now_s: float) -> Indicators:
        """Return the gates after a new mask of blocked channels; `None` if unknown."""
        if mask is None:
            return replace(self, known=False)
        gates = tuple(
            replace(gate, blocked=dark).struck(int(self.known and dark != gate.blocked), now_s)
            for gate in self.gates
            for dark in [bool(mask >> gate.channel & 1)]
        )
        looked = Indicators(gates, self.checked, known=True)
        if self.alone is None or looked.blocked_channels:
            return looked
        return replace(looked, checked=self.checked | {self.alone})

    def count_edges(self, channels: tuple[int, ...], now_s: float) -> Indicators:
        """Return the gates after edges of a drop, with the channel of each edge."""
        gates = (gate.struck(channels.count(gate.channel), now_s) for gate in self.gates)
        return replace(self, gates=tuple(gates))

    def reset(self) -> Indicators:
        """Return the gates with zero counts and without a gate check."""
        return Indicators.of(tuple(gate.channel for gate in self.gates))
