"""The checks in order, and what becomes of each."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from rig.errors import DeviceError
from rig.link.port import port_clock
from rig.reasons import Reason, make_reason
from rig.selftest import drops, line_checks, requests
from rig.selftest.board import BoardUnderTest, SelftestOptions
from rig.selftest.findings import (
    CheckEndedError,
    Finding,
    NotPossibleError,
    Verdict,
    explain,
    make_check,
)
from rig.selftest.judge import JudgeBoard

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rig.clock.host import Clock
    from rig.link.port import Port


class Check(NamedTuple):
    """A check; one that needs a board that is idle cannot be made while it holds a drop."""

    name: str
    make: Callable[[BoardUnderTest], str | None]
    idle: bool = True


def _needs(needed: str) -> Callable[[BoardUnderTest], str]:
    def refuse(_board: BoardUnderTest) -> str:
        raise NotPossibleError("check_needs", needed=needed)

    return refuse


CHECKS = (
    Check("handshake", requests.identify, idle=False),
    Check("VERSION", requests.ask_other_versions, idle=False),
    Check("every message", requests.ask_every_message, idle=False),
    Check("UNKNOWN_MESSAGE", requests.send_unknown_messages, idle=False),
    Check("BAD_PARAMETER by length", requests.send_other_lengths, idle=False),
    Check("round trips", line_checks.measure_round_trips, idle=False),
    Check("gates", requests.look_at_gates, idle=False),
    Check("GATE_BLOCKED", requests.arm_blocked_gate),
    Check("NOT_ARMED", requests.fire_unarmed),
    Check("NO_SUCH_DROP", requests.read_no_drop),
    Check("BAD_PARAMETER", requests.send_bad_orders),
    Check("ARM and ABORT", requests.arm_and_abort),
    Check("WRONG_TOKEN", requests.send_wrong_tokens),
    Check("arming times out", line_checks.let_arming_time_out),
    Check("a silent host disarms", line_checks.stay_silent),
    Check("repeated frames", line_checks.repeat_requests),
    Check("frames without seq", line_checks.send_without_seq, idle=False),
    Check("junk on the line", line_checks.send_junk),
    Check("certificate", drops.compare_certificate),
    Check("BUSY", drops.ask_while_recording),
    Check("ABORT of a recording", drops.abort_a_recording),
    Check("HOLDING_A_DROP", drops.arm_while_holding),
    Check("reading again", drops.read_again),
    Check("ACKNOWLEDGE and WRONG_CRC", drops.acknowledge_drop),
    Check("sync output to gate", drops.measure_sync_edges),
    Check("COOLING", drops.arm_while_cooling),
    Check("GATE_UNSTEADY", _needs("a hand in a beam")),
    Check("STOPPED", _needs("a hand at the emergency stop")),
    Check("NOT_KEPT", _needs("more edges than the memory holds")),
)


def _judged_checks(judge: JudgeBoard) -> tuple[Check, ...]:
    return (
        Check("judge", judge.identify),
        Check("stamps", judge.measure_stamps),
        Check("release pulse", judge.measure_release),
        Check("emergency stop", judge.measure_stop),
        Check("STOPPED", judge.open_stop),
        Check("GATE_UNSTEADY", judge.disturb_beam),
    )


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
    lost: Reason | None = None
    used: list[BoardUnderTest] = [board]
    judged: tuple[Check, ...] = ()
    if judge_port is not None:
        used.append(BoardUnderTest(judge_port, port_clock(judge_port), options))
        judged = _judged_checks(JudgeBoard(used[1]))
    replaced = {check.name for check in judged}
    try:
        for check in (*(check for check in CHECKS if check.name not in replaced), *judged):
            if lost is not None:
                yield explain(check.name, lost, Verdict.NOT_POSSIBLE)
                continue
            finding = make_check(check.name, partial(_make, check), board)
            yield finding
            if finding.verdict is Verdict.FAILED:
                lost = _why_lost(board)
    finally:
        for each in used:
            with suppress(CheckEndedError, DeviceError):
                each.settle()


def _make(check: Check, board: BoardUnderTest) -> str | None:
    if board.identity is not None:
        board.settle()
    if check.idle:
        board.need_idle()
    return check.make(board)


def _why_lost(board: BoardUnderTest) -> Reason | None:
    """Say why no more checks can be made, if so."""
    if board.identity is None:
        return make_reason("no_identity")
    try:
        board.settle()
    except CheckEndedError as failure:
        return failure.reason
    return None
