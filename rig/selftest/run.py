"""The checks in order, and what becomes of each."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

from rig.errors import DeviceError
from rig.link.messages import MessageError
from rig.selftest import arming, drops, greeting, line_checks
from rig.selftest.board import BoardUnderTest
from rig.selftest.verdicts import CheckFailedError, CheckResult, NotPossibleError, Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rig.clock.host import Clock
    from rig.link.port import Port
    from rig.selftest.board import SelftestOptions


class Check(NamedTuple):
    """A check; one that needs a board that is idle cannot be made while it holds a drop."""

    name: str
    make: Callable[[BoardUnderTest], str]
    idle: bool = True


def _needs(what: str) -> Callable[[BoardUnderTest], str]:
    def never(_stage: BoardUnderTest) -> str:
        raise NotPossibleError(what)

    return never


CHECKS = (
    Check("handshake", greeting.handshake, idle=False),
    Check("VERSION", greeting.another_version, idle=False),
    Check("every message", greeting.every_message, idle=False),
    Check("UNKNOWN_MESSAGE", greeting.unknown_messages, idle=False),
    Check("BAD_PARAMETER by length", greeting.other_lengths, idle=False),
    Check("round trips", line_checks.round_trips, idle=False),
    Check("gates", greeting.gates_now, idle=False),
    Check("GATE_BLOCKED", greeting.a_blocked_gate),
    Check("NOT_ARMED", arming.fire_unarmed),
    Check("NO_SUCH_DROP", arming.no_drop),
    Check("BAD_PARAMETER", arming.bad_orders),
    Check("ARM and ABORT", arming.arm_and_abort),
    Check("WRONG_TOKEN", arming.wrong_tokens),
    Check("arming times out", line_checks.arming_times_out),
    Check("a silent host disarms", line_checks.a_silent_host),
    Check("repeated frames", line_checks.repeats),
    Check("frames without seq", line_checks.without_seq, idle=False),
    Check("junk on the line", line_checks.junk),
    Check("certificate", drops.certificate),
    Check("BUSY", drops.busy),
    Check("ABORT of a recording", drops.abort_a_recording),
    Check("HOLDING_A_DROP", drops.holding),
    Check("reading again", drops.reading_again),
    Check("ACKNOWLEDGE and WRONG_CRC", drops.acknowledging),
    Check("sync output to gate", drops.sync_edges),
    Check("COOLING", drops.cooling),
    Check("GATE_UNSTEADY", _needs("it needs a hand in a beam")),
    Check("STOPPED", _needs("it needs a hand at the emergency stop")),
    Check("NOT_KEPT", _needs("it needs more edges than the memory holds")),
)


def selftest(port: Port, clock: Clock, options: SelftestOptions) -> Iterator[CheckResult]:
    """Make every check, one after the other.

    Parameters
    ----------
    port, clock
        The open port and its time.
    options
        What may be done.

    Yields
    ------
    CheckResult
        As soon as it is known. When the board is silent the rest is not possible.

    Raises
    ------
    DeviceError
        The connection broke.
    """
    board = BoardUnderTest(port, clock, options)
    silent = ""
    try:
        for check in CHECKS:
            if silent:
                yield CheckResult(check.name, Verdict.NOT_POSSIBLE, silent)
                continue
            outcome = _made(check, board)
            yield outcome
            if outcome.verdict is Verdict.FAILED:
                silent = _lost(board)
    except OSError as error:
        raise DeviceError(
            f"the connection broke: {error}", "check the cable, then start again"
        ) from error
    finally:
        with suppress(CheckFailedError, MessageError, OSError):
            board.settle()


def _made(check: Check, board: BoardUnderTest) -> CheckResult:
    try:
        if board.identity is not None:
            board.settle()
        if check.idle:
            board.need_idle()
        return CheckResult(check.name, Verdict.OK, check.make(board))
    except CheckFailedError as failed:
        return CheckResult(check.name, Verdict.FAILED, str(failed))
    except NotPossibleError as why:
        return CheckResult(check.name, Verdict.NOT_POSSIBLE, str(why))
    except MessageError as error:
        return CheckResult(check.name, Verdict.FAILED, f"it sent what is no message: {error}")


def _lost(board: BoardUnderTest) -> str:
    """Say why no more checks can be made, if so."""
    if board.identity is None:
        return "nobody has introduced themselves"
    try:
        board.settle()
    except (CheckFailedError, MessageError) as error:
        return str(error)
    return ""
