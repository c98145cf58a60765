"""Checks of the line: round trips and the clock, silence, repeats, and junk."""

import random
from itertools import pairwise
from statistics import median

from rig.clock.epochs import RESONATOR_TOLERANCE, epochs
from rig.clock.rate import ping_rate
from rig.clock.samples import samples
from rig.link import messages as wire
from rig.link.exchange import Answer
from rig.link.frames import DELIMITER, Frame, encode
from rig.link.messages import HOST_SILENCE_MS, DisarmReason, Phase, RefusalReason
from rig.records import ClockSample
from rig.selftest.board import LABEL, BoardUnderTest
from rig.selftest.findings import fail_if, insist, need, wrong_answer

TIMEOUT_MS = 400
"""Of the order to arm, longer than the patience with a silent host."""
_PINGS = 60
_LATE = 6  # of them, above which it is not the computer that was busy
_ASK_S = 0.1
_SLACK_S = 0.03  # of the computer, besides the line's own delay
_QUIET_S = 0.05
_BURSTS = 20


def measure_round_trips(board: BoardUnderTest) -> str:
    """Ping, unevenly, and see that answers come in good time and the clock keeps its rate."""
    pings = []
    for n in range(_PINGS):
        sent = board.clock.now_ns()
        pong = board.expect(wire.Ping(), wire.Pong)
        pings.append(ClockSample(sent, board.clock.now_ns(), pong.tick))
        board.clock.sleep(0.013 + 0.0071 * (n % 5))
    trips = sorted((p.host_recv_ns - p.host_send_ns) * 1e-9 for p in pings)
    board.slowest_s = trips[-1]
    limit_s = HOST_SILENCE_MS / 2000
    late = sum(trip > limit_s for trip in trips)
    fail_if(late > _LATE, "slow_answers", slowest_s=trips[-1])
    nominal_hz = board.identity.tick_hz
    rate = ping_rate(epochs(samples(pings), nominal_hz))
    fail_if(not rate.n, "clock_unknown", pings=len(pings))
    ppm, u95 = 1e6 * (rate.hz / nominal_hz - 1), 2e6 * rate.u_hz / nominal_hz
    fail_if(abs(ppm) > 1e6 * RESONATOR_TOLERANCE + u95, "clock_off", ppm=ppm, U95=u95)
    need(not late, f"a computer with time to ask the board every {1e3 * limit_s:.0f} ms")
    low, middle, high = (1e3 * trip for trip in (trips[0], median(trips), trips[-1]))
    return f"{low:.2f} to {high:.2f} ms, median {middle:.2f} ms; clock {ppm:+.0f} ± {u95:.0f} ppm"


def await_disarming(reason: DisarmReason, wait_ms: int, asks: int, board: BoardUnderTest) -> str:
    """See that an armed board disarms neither early nor late.

    Parameters
    ----------
    reason
        For which it must.
    wait_ms
        After which: the timeout of its order, or of its patience with a silent host.
    asks
        How often it is asked before the silence.
    board
        The board.
    """
    board.settle()
    asked_ns = [board.clock.now_ns()]
    board.expect(board.order(timeout_ms=TIMEOUT_MS), wire.Armed)
    for _ in range(asks):
        board.wait_for(_ASK_S, lambda _: False)
        board.state()
        asked_ns.append(board.clock.now_ns())
    pauses, asking_ns = (b - a for a, b in pairwise(asked_ns)), asked_ns[-1] - asked_ns[0]
    timely = max(pauses, default=0) <= HOST_SILENCE_MS * 10**6 and asking_ns <= TIMEOUT_MS * 10**6
    need(timely, f"a computer with time to ask the board every {HOST_SILENCE_MS} ms")
    event = f"{wait_ms} ms of silence"
    delay = (board.wait_disarmed(event, reason, wait_ms / 1000 + 0.3) - asked_ns[0]) * 1e-6
    off, room = wait_ms * RESONATOR_TOLERANCE, 1e3 * (_SLACK_S + 2 * board.slowest_s)
    if not -off - 1 <= delay - wait_ms <= off + room:
        expected, answer = (f"Disarmed after {ms:.0f} ms" for ms in (wait_ms, delay))
        raise wrong_answer(event, expected, answer)
    return f"after {delay:.0f} ms"


def repeat_requests(board: BoardUnderTest) -> None:
    """See that a repeated request is answered as before and not executed again."""
    board.settle()
    token = _repeat(board, board.order(), wire.Armed).token
    fired = _repeat(board, wire.Fire(token), wire.Fired)
    seal = board.collect_drop().certificate
    insist("a repeated Fire", fired.tick, seal.fire_tick)
    _repeat(board, wire.Acknowledge(LABEL, seal.crc32), wire.Done)
    board.refuse(wire.Acknowledge(LABEL, seal.crc32), RefusalReason.NO_SUCH_DROP)


def _repeat(board: BoardUnderTest, request: wire.HostMessage, kind: type[Answer]) -> Answer:
    """Send a request twice, and insist on the same answer."""
    answer = board.expect(request, kind)
    insist(f"{request}, repeated,", board.ask(request, again=True), answer)
    return answer


def send_junk(board: BoardUnderTest) -> str:
    """See that junk, and a frame without a seq, get no answer and disturb nothing."""
    board.settle()
    noise = random.Random(3)
    bursts = [noise.randbytes(noise.randrange(1, 300)) + DELIMITER for _ in range(_BURSTS)]
    for burst in (encode(Frame(wire.CODES[wire.Status], 0, 0, b"")), *bursts):
        board.write(burst)
        answer = board.wait_for(_QUIET_S, lambda heard: heard.ack == 0)
        insist("junk on the line", answer or "no answer", "no answer")
        board.state(phase=Phase.IDLE)
    return f"{_BURSTS} bursts"
