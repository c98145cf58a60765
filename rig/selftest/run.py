"""The checks in order, and what becomes of each."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import partial

from rig.errors import DeviceError
from rig.link.messages import HOST_SILENCE_MS, DisarmReason
from rig.link.port import Port
from rig.selftest import checks, line_checks
from rig.selftest.board import BoardUnderTest, Check, SelftestOptions
from rig.selftest.findings import Finding, make_check, need
from rig.selftest.judge import JudgeBoard
from rig.selftest.line_checks import TIMEOUT_MS, await_disarming

CHECKS: dict[str, Check] = {
    "handshake": checks.identify,
    "bad requests": checks.send_bad_requests,
    "round trips": line_checks.measure_round_trips,
    "gates": checks.look_at_gates,
    "GATE_BLOCKED": checks.arm_blocked_gate,
    "IDLE": checks.ask_while_idle,
    "bad orders": checks.send_bad_orders,
    "ARMED": checks.ask_while_armed,
    "arming times out": partial(await_disarming, DisarmReason.TIMEOUT, TIMEOUT_MS, 3),
    "a silent host disarms": partial(await_disarming, DisarmReason.HOST_SILENT, HOST_SILENCE_MS, 0),
    "repeated frames": line_checks.repeat_requests,
    "junk on the line": line_checks.send_junk,
    "RECORDING": checks.ask_while_recording,
    "HOLDING": checks.ask_while_holding,
    "sync output to gate": checks.measure_sync_edges,
    "COOLING": checks.arm_while_cooling,
    "GATE_UNSTEADY": lambda _: need(False, "a hand in a beam"),
    "STOPPED": lambda _: need(False, "a hand at the emergency stop"),
    "NOT_KEPT": lambda _: need(False, "more edges than the memory holds"),
}
"""Where a name is that of a phase, its check asks all that a board in that phase must answer."""


def selftest(port: Port, options: SelftestOptions, judge: Port | None = None) -> Iterator[Finding]:
    """Make every check, one after the other.

    Parameters
    ----------
    port
        Open.
    options
        What may be done.
    judge
        The open port of a second board that is wired to this one.

    Yields
    ------
    Finding
        As soon as it is known. When the board is silent the rest is not possible.
    """
    judges = [JudgeBoard(each, options) for each in [judge] if each]
    by_judge = judges[0].checks() if judges else {}
    table = {name: check for name, check in CHECKS.items() if name not in by_judge} | by_judge
    yield from run_checks(table, BoardUnderTest(port, options), *judges)


def run_checks(
    table: Mapping[str, Check], board: BoardUnderTest, *judges: BoardUnderTest
) -> Iterator[Finding]:
    """Make some checks of a board, and leave all boards at rest; the parameters as above."""
    try:
        for name, check in table.items():
            yield make_check(name, check, board)
    finally:
        for each in (board, *judges):
            with suppress(DeviceError):
                each.settle()
