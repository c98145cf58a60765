"""The checks in order, and what becomes of each."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

from rig.errors import DeviceError
from rig.link.port import port_clock
from rig.selftest import drops, line_checks, requests
from rig.selftest.board import BoardUnderTest, Check, SelftestOptions
from rig.selftest.findings import CheckEndedError, Finding, Verdict, explain, make_check, need
from rig.selftest.judge import JudgeBoard

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.clock.host import Clock
    from rig.link.port import Port
    from rig.reasons import Reason


CHECKS: dict[str, Check] = {
    "handshake": requests.identify,
    "VERSION": partial(requests.refuse_row, "VERSION"),
    "every message": requests.ask_every_message,
    "UNKNOWN_MESSAGE": partial(requests.refuse_row, "UNKNOWN_MESSAGE"),
    "BAD_PARAMETER by length": partial(requests.refuse_row, "BAD_PARAMETER by length"),
    "round trips": line_checks.measure_round_trips,
    "gates": requests.look_at_gates,
    "GATE_BLOCKED": requests.arm_blocked_gate,
    "NOT_ARMED": partial(requests.refuse_row, "NOT_ARMED"),
    "NO_SUCH_DROP": partial(requests.refuse_row, "NO_SUCH_DROP"),
    "BAD_PARAMETER": requests.send_bad_orders,
    "ARM and ABORT": requests.arm_and_abort,
    "WRONG_TOKEN": requests.send_wrong_tokens,
    "arming times out": line_checks.let_arming_time_out,
    "a silent host disarms": line_checks.stay_silent,
    "repeated frames": line_checks.repeat_requests,
    "frames without seq": line_checks.send_without_seq,
    "junk on the line": line_checks.send_junk,
    "certificate": drops.compare_certificate,
    "BUSY": drops.ask_while_recording,
    "ABORT of a recording": drops.abort_a_recording,
    "HOLDING_A_DROP": drops.arm_while_holding,
    "reading again": drops.read_again,
    "ACKNOWLEDGE and WRONG_CRC": drops.acknowledge_drop,
    "sync output to gate": drops.measure_sync_edges,
    "COOLING": drops.arm_while_cooling,
    "GATE_UNSTEADY": lambda _: need(False, "a hand in a beam"),
    "STOPPED": lambda _: need(False, "a hand at the emergency stop"),
    "NOT_KEPT": lambda _: need(False, "more edges than the memory holds"),
}


def selftest(
    port: Port, clock: Clock, options: SelftestOptions, judge_port: Port | None = None
) -> Iterator[Finding]:
    """Make every check, one after the other.

    Parameters
    ----------
    port, clock
        The open port and its time.
    options
        What may be done.
    judge_port
        The open port of a second board that is wired to this one.

    Yields
    ------
    Finding
        As soon as it is known. When the board is silent the rest is not possible.

    Raises
    ------
    DeviceError
        The connection broke.
    """
    board = BoardUnderTest(port, clock, options)
    judge = None
    if judge_port is not None:
        judge = JudgeBoard(judge_port, port_clock(judge_port), options)
    by_judge = judge.checks() if judge else {}
    by_hand = {name: check for name, check in CHECKS.items() if name not in by_judge}
    lost: Reason | None = None
    try:
        for name, check in (by_hand | by_judge).items():
            if lost is not None:
                yield explain(name, lost, Verdict.NOT_POSSIBLE)
                continue
            finding = make_check(name, _make, check, board)
            yield finding
            if finding.verdict is Verdict.FAILED:
                lost = make_check(name, board.settle).reason
    finally:
        for each in filter(None, (board, judge)):
            with suppress(CheckEndedError, DeviceError):
                each.settle()


def _make(check: Check, board: BoardUnderTest) -> str | None:
    if board.transcript.identity is not None:
        board.settle()
    return check(board)
