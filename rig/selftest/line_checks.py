"""Checks of the line: round trips and the clock, silence, repeats, and junk."""

from __future__ import annotations

import random
from collections.abc import Sequence
from statistics import median
from typing import TYPE_CHECKING

from rig.clock.epochs import RESONATOR_TOLERANCE, epochs
from rig.clock.rate import ping_rate
from rig.link import messages as wire
from rig.link.frames import DELIMITER
from rig.link.messages import HOST_SILENCE_MS, DisarmReason, Phase, RefusalReason
from rig.records import ClockSample
from rig.selftest.findings import NotPossibleError, fail_if, insist, wrong_answer

if TYPE_CHECKING:
    from rig.selftest.board import BoardUnderTest

_PINGS = 60
_LATE = 6  # of them, above which it is not the computer that was busy
_TIMEOUT_MS = 400
_ASK_S = 0.1
_SLACK_S = 0.03  # of the computer, besides the line's own delay
_QUIET_S = 0.05
_BURSTS = 20


def measure_round_trips(board: BoardUnderTest) -> str:
    """Ping, unevenly, and see that answers come in good time and the clock keeps its rate."""
    pings = []
    for n in range(_PINGS):
        sent = board.clock.now_ns()
        pong = board.answer(wire.Ping(), wire.Pong)
        pings.append(ClockSample(sent, board.clock.now_ns(), pong.tick))
        board.clock.sleep(0.013 + 0.0071 * (n % 5))
    trips = sorted((p.host_recv_ns - p.host_send_ns) * 1e-9 for p in pings)
    board.slowest_s = trips[-1]
    limit_s = HOST_SILENCE_MS / 2000
    late = sum(trip > limit_s for trip in trips)
    fail_if(late > _LATE, "slow_answers", slowest_s=trips[-1])
    clock = judge_clock(pings, board.identity.tick_hz)
    if late:
        raise NotPossibleError("computer_busy", interval_s=limit_s)
    low, middle, high = (1e3 * trip for trip in (trips[0], median(trips), trips[-1]))
    return f"{low:.2f} to {high:.2f} ms, median {middle:.2f} ms; clock {clock}"


def judge_clock(pings: Sequence[ClockSample], nominal_hz: int) -> str:
    """See that a board's clock is within what a resonator may be off; say by how much it is.

    Raises
    ------
    CheckFailedError
        It is not, or that is not known.
    """
    rate = ping_rate(epochs(pings, nominal_hz))
    fail_if(not rate.n, "clock_unknown", pings=len(pings))
    off, u = rate.hz / nominal_hz - 1, rate.u_hz / nominal_hz
    fail_if(abs(off) > RESONATOR_TOLERANCE + 2 * u, "clock_off", ppm=off * 1e6, U95=2e6 * u)
    return f"{off * 1e6:+.0f} ± {2 * u * 1e6:.0f} ppm"


def let_arming_time_out(board: BoardUnderTest) -> str:
    """See that an armed board that is asked now and then waits as long as it was told."""
    sent = asked = board.clock.now_ns()
    board.arm(timeout_ms=_TIMEOUT_MS)
    for _ in range(3):
        board.wait(_ASK_S, lambda _: False)
        phase, now_ns = board.state().phase, board.clock.now_ns()
        if phase is not Phase.ARMED:
            if now_ns - asked > HOST_SILENCE_MS * 10**6 or now_ns - sent > _TIMEOUT_MS * 10**6:
                board.wait_unasked(_QUIET_S, wire.Disarmed)
                raise NotPossibleError("computer_busy", interval_s=HOST_SILENCE_MS / 1000)
            raise wrong_answer("Status before the timeout", "ARMED", phase.name)
        asked = now_ns
    return _insist_disarmed(board, DisarmReason.TIMEOUT, _TIMEOUT_MS, sent)


def stay_silent(board: BoardUnderTest) -> str:
    """See that an armed board disarms when it hears nothing."""
    sent = board.clock.now_ns()
    board.arm()
    delay = _insist_disarmed(board, DisarmReason.HOST_SILENT, HOST_SILENCE_MS, sent)
    board.refuse(wire.Fire(1), RefusalReason.NOT_ARMED)
    return delay


def _insist_disarmed(board: BoardUnderTest, reason: DisarmReason, ms: int, sent_ns: int) -> str:
    """Wait in silence for DISARMED, neither early nor late."""
    silence = f"{ms} ms of silence"
    delay = (board.wait_disarmed(silence, reason, ms / 1000 + 0.3) - sent_ns) * 1e-6
    room = 1e3 * (_SLACK_S + 2 * board.slowest_s)
    if not ms * (1 - RESONATOR_TOLERANCE) - 1 <= delay <= ms * (1 + RESONATOR_TOLERANCE) + room:
        raise wrong_answer(silence, f"Disarmed after {ms} ms", f"Disarmed after {delay:.0f} ms")
    return f"after {delay:.0f} ms"


def repeat_requests(board: BoardUnderTest) -> None:
    """See that a repeated request is answered as before and not executed again."""
    token = board.read_token(_repeat(board, board.order()))
    fired = _repeat(board, wire.Fire(token))
    certificate = board.collect_drop().certificate
    insist("a repeated Fire", fired, wire.Fired(certificate.fire_tick))
    done = _repeat(board, wire.Acknowledge(certificate.label, certificate.crc32))
    insist("a repeated Acknowledge", done, wire.Done())


def _repeat(board: BoardUnderTest, request: wire.HostMessage) -> wire.Message:
    """Send a request twice, and insist on the same answer."""
    seq = board.next_seq()
    answer = board.ask(request, seq)
    insist(f"a repeated {type(request).__name__}", board.ask(request, seq), answer)
    return answer


def send_without_seq(board: BoardUnderTest) -> None:
    """See that a frame without a seq is passed over."""
    board.send(wire.Status(), 0)
    heard = board.wait(_QUIET_S, lambda h: isinstance(h.message, wire.State))
    if heard is not None:
        raise wrong_answer("Status without seq", "no answer", heard.message)


def send_junk(board: BoardUnderTest) -> str:
    """See that junk on the line disturbs nothing."""
    board.need_idle()
    noise = random.Random(3)
    for _ in range(_BURSTS):
        board.write(noise.randbytes(noise.randrange(1, 300)) + DELIMITER)
        board.insist_state("junk", phase=Phase.IDLE)
    return f"{_BURSTS} bursts"
