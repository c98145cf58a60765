"""Checks of a board by a second one with the same firmware, joined to it by wires.

The other board's gates time the outputs of this one; its releases are this one's beams and stop.
docs/first-board.md lists the wires.
"""

from statistics import stdev

from rig.clock.epochs import RESONATOR_TOLERANCE
from rig.link import messages as wire
from rig.selftest.board import BoardUnderTest, Check, RecordedDrop, name_gates
from rig.selftest.checks import identify
from rig.selftest.findings import fail_if, insist

RELEASE, SYNC, QUIET = 1, 2, 4
"""Gates of the judge: at the board's release 0, at its sync output, and at ground."""
BEAMS, STOP = 1, 2
"""Releases of the judge: at the board's gates, and at its emergency stop and one gate more."""
AT_BEAMS, AT_STOP = 0x7FFF, 0x8000
"""Which gates of the board these are."""
_PULSES_US = (100, 1_000, 20_000, 100_000)
_STEP_US = 1777  # long beside what both clocks differ by, so that each edge meets a tick anywhere
_LONG_US = 400_000
_SPIKE_US = 100
_STOP_LIMIT_US = 1000.0
_PULSE_LIMIT_US = 30.0
"""Within these the stop acts and a pulse is as long as ordered: firmware/PROTOCOL.md."""


class JudgeBoard(BoardUnderTest):
    """The second board, which is wired to the first."""

    rate = 1.0
    """Ticks of the first board in one of the second."""

    def checks(self) -> dict[str, Check]:
        """Give the checks of the first board, of which some replace those that need a hand."""
        return {
            "judge": lambda _: identify(self),
            "stamps": self.measure_stamps,
            "release pulse": self.measure_release,
            "emergency stop": self.measure_stop,
            "STOPPED": self.open_stop,
            "GATE_UNSTEADY": self.disturb_beam,
        }

    def measure_stamps(self, board: BoardUnderTest) -> str:
        """See how exactly all gates stamp pulses whose length is known, from 1 µs on."""
        recorded, judged = self._pulse(board, BEAMS, _LONG_US, AT_BEAMS)
        self.rate = _flanks(recorded)[1] / judged.certificate.pulse_ticks
        hz = board.identity.tick_hz
        ppm = 1e6 * (self.rate * self.identity.tick_hz / hz - 1)
        _limit("the clocks differ by", [ppm], 2e6 * RESONATOR_TOLERANCE, "ppm")
        errors, skews = [], []
        for n in range(board.options.drops):
            recorded, judged = self._pulse(board, BEAMS, 1 + _STEP_US * n, AT_BEAMS)
            skew, length = _flanks(recorded)
            errors.append(1e9 / hz * (length - judged.certificate.pulse_ticks * self.rate))
            skews.append(1e9 / hz * skew)
        late_ns = 1e9 / hz * board.identity.late_ticks
        worst = _limit("a stamp is off by", errors, late_ns, "ns")
        widest = _limit("gates differ by", skews, late_ns, "ns")
        scatter = f"{stdev(errors) / 2**0.5:.0f} ns" if len(errors) > 1 else "unknown"
        return (
            f"clock {ppm:+.2f} ppm; scatter {scatter}, two stamps {worst:.0f} ns at most; "
            f"skew {widest:.0f} ns"
        )

    def measure_release(self, board: BoardUnderTest) -> str:
        """See that release pulses are as long as ordered and as recorded, and begin at FIRE."""
        us = 1e6 / board.identity.tick_hz
        ordered, written, skews = [], [], []
        for pulse_us in _PULSES_US:
            own = {"gates": AT_BEAMS, "release": 1, "pulse_us": pulse_us}
            token, judge_token = self._arm_both(board, own, gates=RELEASE | SYNC)
            self.fire(judge_token)
            board.fire(token)
            seal, judged = board.collect_drop().certificate, self.collect_drop()
            (on, off), (high, _) = _changes(judged, RELEASE), _changes(judged, SYNC)
            ordered.append((off - on) * self.rate * us - pulse_us)
            written.append(((off - on) * self.rate - seal.pulse_ticks) * us)
            skews.append((high - on) * self.rate * us)
        late_us = board.identity.late_ticks * us
        off_us = _limit("a pulse is off by", ordered, _PULSE_LIMIT_US, "µs")
        record_us = _limit("a pulse and its record differ by", written, late_us, "µs")
        skew_us = _limit("release and sync differ by", skews, late_us, "µs")
        worst = (f"{1e3 * us:.0f} ns" for us in (off_us, record_us, skew_us))
        return "{} off at most; its record {}; sync {} from the release".format(*worst)

    def measure_stop(self, board: BoardUnderTest) -> str:
        """See that the emergency stop ends a pulse in time, and that a spike does not."""
        delays, pulse = [], {"release": 1, "pulse_us": _LONG_US}
        for _ in range(max(1, board.options.drops // 4)):
            recorded, _ = self._pulse(board, STOP, 10_000, AT_STOP, **pulse)
            seal = recorded.certificate
            insist("the stop in a pulse", seal.pulse_end.name, "STOPPED")
            ticks = seal.pulse_ticks - _changes(recorded, AT_STOP)[0]
            delays.append(1e6 / board.identity.tick_hz * ticks)
        worst = _limit("the stop acts after", delays, _STOP_LIMIT_US, "µs")
        recorded, _ = self._pulse(board, STOP, _SPIKE_US, AT_STOP, **pulse)
        insist("a spike", recorded.certificate.pulse_end.name, "ORDERED")
        return f"after {worst:.0f} µs at most; {_SPIKE_US} µs are ignored"

    def open_stop(self, board: BoardUnderTest) -> None:
        """See that an open emergency stop disarms the board and forbids arming."""
        own = {"gates": AT_BEAMS}
        _, judge_token = self._arm_both(board, own, release=STOP, pulse_us=_LONG_US)
        self.fire(judge_token)
        board.wait_disarmed("an open stop", wire.DisarmReason.STOPPED, 0.1)
        answer = board.request(board.order(**own), wire.DeviceMessage)
        insist("Arm", answer, wire.Refused(wire.RefusalReason.STOPPED, 0))
        self.collect_drop()

    def disturb_beam(self, board: BoardUnderTest) -> None:
        """See that a beam that was broken since ARM forbids firing."""
        own = {"gates": AT_BEAMS}
        token, judge_token = self._arm_both(board, own, release=BEAMS, pulse_us=1000)
        self.fire(judge_token)
        self.collect_drop()
        board.refuse(wire.Fire(token), wire.RefusalReason.GATE_UNSTEADY, AT_BEAMS)

    def _pulse(
        self, board: BoardUnderTest, output: int, length_us: int, gates: int, **own: int
    ) -> tuple[RecordedDrop, RecordedDrop]:
        """Pulse an output of the judge while the board records; give both records."""
        own["gates"] = gates
        token, judge_token = self._arm_both(board, own, release=output, pulse_us=length_us)
        board.fire(token)
        self.fire(judge_token)
        return board.collect_drop(), self.collect_drop()

    def _arm_both(
        self, board: BoardUnderTest, own: dict[str, int], gates: int = QUIET, **order: int
    ) -> tuple[int, int]:
        """Arm both at once, when both releases have rested; give the tokens."""
        record_ms = 100 + max(order.get("pulse_us", 0), own.get("pulse_us", 0)) // 1000
        # The judge goes on until the board has ended, which its sync output shows.
        order |= {"gates": gates, "record_ms": record_ms + 50}
        self.prepare(**order)
        return board.prepare(**own, record_ms=record_ms), self.prepare(**order)


def _changes(recorded: RecordedDrop, gate: int) -> tuple[int, int]:
    """Give the ticks since FIRE at which a gate changed: once, and back."""
    ticks = [edge.tick for edge in recorded.edges if gate >> edge.channel & 1]
    edges = len(ticks)
    fail_if(edges != 2, "judged_edges", gates_listed=name_gates(gate), edges=edges)
    return ticks[0], ticks[1]


def _flanks(recorded: RecordedDrop) -> tuple[int, int]:
    """Give by how much gates at the beams differ, and how long they were blocked, ticks."""
    masks = (1 << n for n in range(AT_BEAMS.bit_length()))
    rises, falls = zip(*(_changes(recorded, mask) for mask in masks), strict=True)
    return max(max(rises) - min(rises), max(falls) - min(falls)), falls[0] - rises[0]


def _limit(what: str, values: list[float], limit: float, unit: str) -> float:
    """Insist on a limit that no value may exceed in size; give the greatest."""
    worst = max(map(abs, values))
    measured, allowed = (f"{value:.3g} {unit}" for value in (worst, limit))
    fail_if(worst > limit, "judged_limit", text=what, measured=measured, limit=allowed)
    return worst
