"""What the gates did lately: edges counted, flicker and steadiness, and which one a hand blocks."""

from __future__ import annotations

from dataclasses import dataclass, replace

STEADY_S = 1.0
"""A gate that changed within this time is not steady."""
FLICKER_S = 2.0
FLICKERS = 4
"""That many changes within `FLICKER_S` are flicker: a loose beam, not a hand."""


@dataclass(frozen=True, slots=True)
class Lamp:
    """One gate: its state, its edges so far, and when the latest of them were seen."""

    channel: int
    blocked: bool = False
    edges: int = 0
    recent_s: tuple[float, ...] = ()

    def steady(self, now_s: float) -> bool:
        """Whether it has been quiet for `STEADY_S`."""
        return not self.recent_s or now_s - self.recent_s[-1] >= STEADY_S

    def flickers(self, now_s: float) -> bool:
        """Whether it changes too often for a hand or a chain at rest."""
        return sum(now_s - at <= FLICKER_S for at in self.recent_s) >= FLICKERS


@dataclass(frozen=True, slots=True)
class Lamps:
    """All gates of the scene.

    Attributes
    ----------
    waved
        Channels that were seen blocked alone and clear again: the wave-your-hand test.
    alone
        The one channel that is blocked now; `None` for none or several.
    """

    lamps: tuple[Lamp, ...] = ()
    waved: frozenset[int] = frozenset()
    alone: int | None = None
    known: bool = False

    @classmethod
    def of(cls, channels: tuple[int, ...]) -> Lamps:
        """Begin with lamps nobody has looked at."""
        return cls(tuple(Lamp(channel) for channel in channels))

    @property
    def blocked(self) -> tuple[int, ...]:
        """Channels that are blocked."""
        return tuple(lamp.channel for lamp in self.lamps if lamp.blocked)

    def restless(self, now_s: float) -> tuple[int, ...]:
        """Channels that are not steady."""
        return tuple(lamp.channel for lamp in self.lamps if not lamp.steady(now_s))

    def ready(self, now_s: float) -> bool:
        """Whether every beam is clear and steady."""
        return self.known and not self.blocked and not self.restless(now_s)

    def seen(self, mask: int | None, now_s: float) -> Lamps:
        """Look at the gates' mask; `None` means that nobody knows."""
        if mask is None:
            return replace(self, known=False, alone=None)
        lamps = tuple(_looked(lamp, mask, now_s, first=not self.known) for lamp in self.lamps)
        blocked = tuple(lamp.channel for lamp in lamps if lamp.blocked)
        waved = self.waved
        if self.alone is not None and not blocked:
            waved |= {self.alone}
        return Lamps(lamps, waved, blocked[0] if len(blocked) == 1 else None, known=True)

    def counted(self, channels: tuple[int, ...], now_s: float) -> Lamps:
        """Count edges of a drop, one entry of `channels` an edge."""
        return replace(
            self,
            lamps=tuple(
                _struck(lamp, count, now_s) if (count := channels.count(lamp.channel)) else lamp
                for lamp in self.lamps
            ),
        )

    def reset(self) -> Lamps:
        """Count from zero and begin the wave test again."""
        return Lamps.of(tuple(lamp.channel for lamp in self.lamps))


def _looked(lamp: Lamp, mask: int, now_s: float, *, first: bool) -> Lamp:
    blocked = bool(mask >> lamp.channel & 1)
    if blocked == lamp.blocked:
        return lamp
    lamp = replace(lamp, blocked=blocked)
    return lamp if first else _struck(lamp, 1, now_s)


def _struck(lamp: Lamp, count: int, now_s: float) -> Lamp:
    recent = (*lamp.recent_s, *(now_s,) * count)[-FLICKERS:]
    return replace(lamp, edges=lamp.edges + count, recent_s=recent)
