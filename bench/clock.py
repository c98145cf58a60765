"""How well the board's clock is known after a time, with and without a 1 Hz reference."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from rig.bench.findings import Findings
from rig.clock.epochs import epochs
from rig.clock.rate import ping_rate, pulse_rate
from rig.commands.output import say
from rig.protocol.protocol import PPS_U
from rig.recorder.recorder import Recorder
from rig.recorder.sink import NullSink
from rig.records import Pulse
from rig.text_table import text_table

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator

    from rig.clock.rate import TickRate
    from rig.records import ClockSample

TICK_HZ = 16_000_000
CLOCK_PPM = -1300.0
LATENCY_S = 1e-3
REFERENCE_PPM = 0.05
DURATIONS_S = (10.0, 30.0, 60.0, 120.0, 300.0, 900.0)
SOURCES = {"pings": 0.0, "reference": PPS_U}


@dataclass(slots=True)
class _Kept(NullSink):
    """A record of clock samples only."""

    pings: list[Any] = field(default_factory=list)
    pulses: list[Any] = field(default_factory=list)

    def add_timing(self, record: ClockSample | Pulse) -> None:
        (self.pulses if isinstance(record, Pulse) else self.pings).append(record)


@dataclass(frozen=True, slots=True)
class RateError:
    """Errors of the rate after one duration, over all seeds, ppm.

    Attributes
    ----------
    duration_s, source
        How long clocks were compared, and with which.
    rms, worst
        Of the error.
    u
        Mean standard uncertainty as stated; a reference's own is 0.1 ppm.
    held
        Share of seeds whose error is within 1.96 u.
    """

    duration_s: float
    source: str
    rms: float
    worst: float
    u: float
    held: float


def clock(protocol: str, seeds: int, durations_s: tuple[float, ...]) -> list[RateError]:
    """Compare clocks over a simulated line with 1 ms of exponential jitter.

    Parameters
    ----------
    protocol
        Any protocol file: a simulation needs a scene.
    seeds
        Simulations 1, 2, ….
    durations_s
        After which the rate is looked at.
    """
    found: dict[tuple[float, str], list[tuple[float, float]]] = {}
    for seed in range(1, seeds + 1):
        kept = _compared(protocol, seed, max(durations_s))
        begin_ns = kept.pings[0].host_send_ns
        for duration in durations_s:
            end_ns = begin_ns + round(duration * 1e9)
            samples = epochs([p for p in kept.pings if p.host_recv_ns <= end_ns], TICK_HZ)
            pings = ping_rate(samples)
            pulses = [p for p in kept.pulses if p.host_recv_ns <= end_ns]
            rates = pings, pulse_rate(samples, pulses, pings)
            for (source, u), rate in zip(SOURCES.items(), rates, strict=True):
                if rate.n:
                    found.setdefault((duration, source), []).append(_error(rate, u))
        say(f"seed {seed} of {seeds}")
    return [_row(duration, source, pairs) for (duration, source), pairs in found.items()]


def _compared(protocol: str, seed: int, seconds: float) -> _Kept:
    """Let a recorder compare clocks, as in any session."""
    dials = f"quiet=1&clock={CLOCK_PPM}ppm&latency={LATENCY_S}s&reference={REFERENCE_PPM}ppm"
    url = f"sim://?protocol={quote(protocol)}&seed={seed}&{dials}"
    kept = _Kept()
    with Recorder(kept, url) as recorder:
        recorder.wait(seconds + 5.0)
    return kept


def _error(rate: TickRate, u: float) -> tuple[float, float]:
    true = TICK_HZ * (1.0 + CLOCK_PPM * 1e-6)
    return (rate.hz / true - 1.0) * 1e6, math.hypot(rate.u_hz / true, u) * 1e6


def _row(duration: float, source: str, pairs: list[tuple[float, float]]) -> RateError:
    n = len(pairs)
    return RateError(
        duration,
        source,
        math.sqrt(sum(error**2 for error, _ in pairs) / n),
        max(abs(error) for error, _ in pairs),
        sum(u for _, u in pairs) / n,
        sum(abs(error) <= 1.96 * u for error, u in pairs) / n,
    )


def run(arguments: Namespace) -> Iterator[Findings]:
    """Find errors of the tick rate against the time clocks were compared for."""
    errors = clock(arguments.protocol, arguments.seeds, DURATIONS_S)
    rows = [["after", "by", "rms", "worst", "stated u", "within 1.96 u"]]
    rows += [
        [f"{each.duration_s:.0f} s", each.source,
         *(f"{ppm:.2g} ppm" for ppm in (each.rms, each.worst, each.u)), f"{each.held:.0%}"]
        for each in errors
    ]  # fmt: skip
    yield Findings({"rows": [asdict(each) for each in errors]}, text_table(rows, left={1}))
