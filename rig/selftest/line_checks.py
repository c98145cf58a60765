"""Checks of the line: round trips and the clock, silence, repeats, and junk."""

from __future__ import annotations

import random
from statistics import median
from typing import TYPE_CHECKING

from rig.clock.epochs import RESONATOR_TOLERANCE
from rig.clock.rate import tick_rate
from rig.link import messages as wire
from rig.link.frames import DELIMITER
from rig.link.messages import HOST_SILENCE_MS, DisarmReason, Phase, RefusalReason
from rig.records import ClockSample
from rig.selftest.verdicts import CheckFailedError, NotPossibleError

if TYPE_CHECKING:
    from rig.selftest.board import BoardUnderTest
    from rig.selftest.line import Heard

_PINGS = 60
_LATE = 6  # of them, above which it is not the computer that was busy
_TIMEOUT_MS = 400
_ASK_S = 0.1
_SLACK_S = 0.03  # of the computer, besides the line's own delay
_QUIET_S = 0.05
_BURSTS = 20


def round_trips(board: BoardUnderTest) -> str:
    """Ping, unevenly, and see that answers come in good time and the clock keeps its rate."""
    pings = []
    for n in range(_PINGS):
        sent = board.clock.now_ns()
        pong = board.answer(wire.Ping(), wire.Pong)
        pings.append(ClockSample(sent, board.clock.now_ns(), pong.tick))
        board.clock.sleep(0.013 + 0.0071 * (n % 5))
    trips = sorted((p.host_recv_ns - p.host_send_ns) * 1e-9 for p in pings)
    board.slowest_s = trips[-1]
    said = f"{trips[0] * 1e3:.2f} to {trips[-1] * 1e3:.2f} ms, median {median(trips) * 1e3:.2f} ms"
    late = sum(trip > HOST_SILENCE_MS / 2000 for trip in trips)
    if late > _LATE:
        raise CheckFailedError(f"{said}: too slow for a board that disarms after a silence")
    nominal = board.known().tick_hz
    rate = tick_rate(pings, nominal)
    if not rate.n or abs(rate.hz / nominal - 1) > RESONATOR_TOLERANCE + 2 * rate.u_hz / nominal:
        raise CheckFailedError(f"{said}; but its clock is not at the {nominal} Hz that it states")
    if late:
        raise NotPossibleError(f"{said}: this computer was too busy for {late} of {_PINGS}")
    return f"{said}; clock {(rate.hz / nominal - 1) * 1e6:+.0f} ppm"


def arming_times_out(board: BoardUnderTest) -> str:
    """See that an armed board that is asked now and then waits as long as it was told."""
    sent = asked = board.clock.now_ns()
    board.arm(timeout_ms=_TIMEOUT_MS)
    for _ in range(3):
        board.wait(_ASK_S, lambda _: False)
        phase, now = board.phase(), board.clock.now_ns()
        if phase is not Phase.ARMED:
            if now - asked > HOST_SILENCE_MS * 10**6 or now - sent > _TIMEOUT_MS * 10**6:
                board.unasked(_QUIET_S, wire.Disarmed)
                raise NotPossibleError("this computer was too busy to ask every 100 ms")
            raise CheckFailedError("it did not stay armed, though it was asked every 100 ms")
        asked = now
    return _disarms(board, DisarmReason.TIMEOUT, _TIMEOUT_MS, sent)


def a_silent_host(board: BoardUnderTest) -> str:
    """See that an armed board disarms when it hears nothing."""
    sent = board.clock.now_ns()
    board.arm()
    found = _disarms(board, DisarmReason.HOST_SILENT, HOST_SILENCE_MS, sent)
    board.refused(wire.Fire(1), RefusalReason.NOT_ARMED)
    return found


def _disarms(board: BoardUnderTest, reason: DisarmReason, ms: int, sent_ns: int) -> str:
    """Wait in silence for DISARMED, neither early nor late."""
    heard: Heard | None = board.unasked(ms / 1000 + 0.3, wire.Disarmed)
    if heard is None:
        raise CheckFailedError(f"{ms} ms are over, and it did not disarm")
    if not isinstance(heard.message, wire.Disarmed) or heard.message.reason is not reason:
        raise CheckFailedError(f"it should say DISARMED({reason.name}), but: {heard.message}")
    took = (heard.at_ns - sent_ns) * 1e-6
    room = 1e3 * (_SLACK_S + 2 * board.slowest_s)
    if not ms * (1 - RESONATOR_TOLERANCE) - 1 <= took <= ms * (1 + RESONATOR_TOLERANCE) + room:
        raise CheckFailedError(f"it disarmed after {took:.0f} ms instead of {ms} ms")
    if board.phase() is not Phase.IDLE:
        raise CheckFailedError("it says DISARMED and is not idle")
    return f"after {took:.0f} ms"


def repeats(board: BoardUnderTest) -> str:
    """See that a repeated request is answered as before and not executed again."""
    order = board.order()
    seq = board.next_seq()
    armed = board.ask(order, seq)
    token = board.armed_by(armed)
    if board.ask(order, seq) != armed:
        raise CheckFailedError("a repeated ARM armed it again")
    seq = board.next_seq()
    fired = board.ask(wire.Fire(token), seq)
    if not isinstance(fired, wire.Fired) or board.ask(wire.Fire(token), seq) != fired:
        raise CheckFailedError("a repeated FIRE is not answered as before")
    recorded = board.ending(fired, order.record_ms)
    if recorded.certificate.fire_tick != fired.tick:
        raise CheckFailedError("a repeated FIRE fired again")
    seq = board.next_seq()
    done = wire.Acknowledge(recorded.certificate.label, recorded.certificate.crc32)
    if [board.ask(done, seq), board.ask(done, seq)] != [wire.Done()] * 2:
        raise CheckFailedError("a repeated ACKNOWLEDGE is not answered as before")
    return ""


def without_seq(board: BoardUnderTest) -> str:
    """See that a frame without a seq is passed over."""
    board.line.say(wire.Status(), 0)
    heard = board.wait(_QUIET_S, lambda h: isinstance(h.message, wire.State))
    if heard is not None:
        raise CheckFailedError("it answers a request that has no seq")
    return ""


def junk(board: BoardUnderTest) -> str:
    """See that junk on the line disturbs nothing."""
    noise = random.Random(3)  # noqa: S311 - noise, not secrets
    for _ in range(_BURSTS):
        board.line.port.write(noise.randbytes(noise.randrange(1, 300)) + DELIMITER)
        if board.phase() is not Phase.IDLE:
            raise CheckFailedError("junk made it do something")
    return f"{_BURSTS} bursts"
