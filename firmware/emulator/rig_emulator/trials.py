# SPDX-License-Identifier: GPL-3.0-or-later
"""What a stamp is put through: real drops, dense trains, bursts, coincidences, short pulses."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.link.messages import pack_label
from rig_emulator.stand import Flip

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig_emulator.stand import Recording, Stamp, Stand
    from rig_emulator.wiring import Wiring
    from sim.interfaces import Lab

HZ = 16_000_000
HALF = 1 << 15
"""Cycles after which the firmware extends its counter."""
_MS = HZ // 1000


@dataclass(frozen=True)
class Spread:
    """How stamps scatter, in cycles about their mean.

    Attributes
    ----------
    count, mean, sd
        Of all stamps.
    p99, worst
        Of the distance from the mean.
    doubtful
        How many the host can tell to be doubtful.
    worst_trusted
        The largest distance among all others.
    """

    count: int
    mean: float
    sd: float
    p99: float
    worst: float
    doubtful: int
    worst_trusted: float


def spread(stamps: Sequence[Stamp]) -> Spread:
    """Summarise stamps."""
    errors = [stamp.error for stamp in stamps]
    mean = sum(errors) / len(errors)
    away = sorted(abs(error - mean) for error in errors)
    return Spread(
        count=len(errors),
        mean=mean,
        sd=(sum(a * a for a in away) / len(away)) ** 0.5,
        p99=away[int(0.99 * (len(away) - 1))],
        worst=away[-1],
        doubtful=sum(stamp.doubtful for stamp in stamps),
        worst_trusted=max((abs(s.error - mean) for s in stamps if not s.doubtful), default=0.0),
    )


def lab_flips(wiring: Wiring, lab: Lab, run: int) -> list[Flip]:
    """Tell what chains do to a board's gates, as far as it has them."""
    return [
        Flip(round(seconds * wiring.clock_hz), channel, blocked)
        for seconds, channel, blocked in lab.drop(pack_label(run, 1))
        if channel < len(wiring.gates)
    ]


def lab_drop(stand: Stand, lab: Lab, run: int) -> list[Stamp]:
    """Let chains fall before the board."""
    return stand.stamps_of(lab_flips(stand.wiring, lab, run))


def train(gates: int, count: int, rate: float, seed: int = 1, hz: int = HZ) -> list[Flip]:
    """Flip gates by chance, so many times a second on the whole; all are clear at the end."""
    chance = random.Random(seed)
    blocked = [False] * gates
    cycle, gap = hz // 800, hz / rate
    flips = []
    for n in range(count):
        on = [gate for gate, is_blocked in enumerate(blocked) if is_blocked]
        gate = chance.choice(on) if len(on) >= count - n else chance.randrange(gates)
        blocked[gate] = not blocked[gate]
        flips.append(Flip(cycle, gate, blocked[gate]))
        cycle += max(1, round(gap * chance.uniform(0.5, 1.5)))
    return flips


def sustained(stand: Stand, count: int, rate: float) -> tuple[int, int]:
    """Count the events of a train that arrived, and those for which there was no memory."""
    flips = train(len(stand.wiring.gates), count, rate)
    recording = stand.record_all(flips)
    if not recording.certificate.overflows:
        recording.stamps(flips)  # which would say what is missing
    return recording.certificate.events, recording.certificate.overflows


def burst(stand: Stand, count: int, rate: float) -> list[Stamp]:
    """Flip one gate as fast as that."""
    hz = stand.wiring.clock_hz
    flips = [Flip(round(hz / 800 + n * hz / rate), 3, n % 2 == 0) for n in range(count)]
    return stand.stamps_of(flips)


def twins(stand: Stand, count: int, spacing: int) -> list[Stamp]:
    """Flip two gates, on the two ports, one 1 to 64 cycles after the other, time and again."""
    last = len(stand.wiring.gates) - 1
    flips = []
    for n in range(count):
        at, lag = 20_000 + n * spacing, 1 + n % 64
        first, second = (0, last) if n // 64 % 2 else (last, 0)
        for after, blocked in ((0, True), (spacing // 2, False)):
            flips.append(Flip(at + after, first, blocked))
            flips.append(Flip(at + after + lag, second, blocked))
    return stand.stamps_of(flips)


def across_halves(stand: Stand, reach: int) -> list[Stamp]:
    """Flip a gate once at every cycle of ± reach around a place where the time is extended."""
    stand.record([], 5)  # to learn the board's time
    made: list[Flip] = []

    def flips(fire: int) -> list[Flip]:
        first = HALF - stand.tick_at(fire) % HALF
        for n, offset in enumerate(range(-reach, reach + 1)):
            made.append(Flip(first + (n + 1) * HALF + offset, 0, n % 2 == 0))
        return made

    return stand.record(flips, (2 * reach + 4) * HALF // _MS + 1).stamps(made)


def storm(stand: Stand, rate: float, pulse_us: int) -> Recording:
    """Toggle two gates, on both ports, all through a release pulse."""
    last = len(stand.wiring.gates) - 1
    gap = HZ / rate
    count = round((pulse_us * 16 + 10 * _MS) / gap)
    flips = [Flip(round(3000 + n * gap), last * (n // 2 % 2), n % 2 == 0) for n in range(count)]
    return stand.record(flips, pulse_us // 1000 + 5, pulse_us=pulse_us)


def pulse(stand: Stand, gate: int, width: int, count: int = 16) -> tuple[int, int]:
    """Give one gate short pulses, and count those seen as two edges and those as a glitch."""
    flips = []
    for n in range(count):
        at = 20_000 + 4001 * n
        flips += [Flip(at, gate, True), Flip(at + width, gate, False)]
    recording = stand.record_all(flips)
    return len(recording.events) - recording.certificate.glitches, recording.certificate.glitches
